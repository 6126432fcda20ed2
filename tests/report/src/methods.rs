//! The library's methods, one row each: a new force law or integrator is a new row.

use shellwarp::ffi::method::*;
use shellwarp::ffi::state::*;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    Lma,
    Warp,
    Reduced,
    Shell,
}

#[derive(Debug)]
pub struct Method {
    /// Its name in the CSV files.
    pub key: &'static str,
    /// Its name in the plots.
    pub label: &'static str,
    pub family: Family,
    /// SW_METHOD_....
    pub method: u32,
    /// SW_INTEGRATOR_....
    pub integrator: u32,
    /// Fields beyond the modes, of the reduced shell.
    pub fields: u32,
    pub colour: (u8, u8, u8),
    /// What its points look like.
    pub marker: Marker,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    Disc,
    Ring,
    Cross,
    Triangle,
}

const RED: (u8, u8, u8) = (200, 55, 45);
const BLUE: (u8, u8, u8) = (35, 95, 190);
const VIOLET: (u8, u8, u8) = (125, 60, 165);
const BROWN: (u8, u8, u8) = (120, 85, 60);
const ORANGE: (u8, u8, u8) = (205, 120, 20);
const TEAL: (u8, u8, u8) = (0, 135, 140);
const PINK: (u8, u8, u8) = (200, 60, 135);
const GREEN: (u8, u8, u8) = (30, 135, 75);

/// Linear modal analysis red, warps blue and violet, rotation–strain brown, reduced shells orange, teal and pink, full shells green, as on every
/// page of the report.
pub const METHODS: &[Method] = &[
    Method {
        key: "lma_implicit",
        label: "linear modes, implicit Euler",
        family: Family::Lma,
        method: SW_METHOD_LMA,
        integrator: SW_INTEGRATOR_IMPLICIT_EULER,
        fields: 0,
        colour: RED,
        marker: Marker::Disc,
    },
    Method {
        key: "lma_exact",
        label: "linear modes, exact propagator",
        family: Family::Lma,
        method: SW_METHOD_LMA,
        integrator: SW_INTEGRATOR_EXACT,
        fields: 0,
        colour: RED,
        marker: Marker::Ring,
    },
    Method {
        key: PAPER,
        label: "warp, implicit Euler (paper)",
        family: Family::Warp,
        method: SW_METHOD_WARP,
        integrator: SW_INTEGRATOR_IMPLICIT_EULER,
        fields: 0,
        colour: BLUE,
        marker: Marker::Disc,
    },
    Method {
        key: "warp_exact",
        label: "warp, exact propagator",
        family: Family::Warp,
        method: SW_METHOD_WARP,
        integrator: SW_INTEGRATOR_EXACT,
        fields: 0,
        colour: BLUE,
        marker: Marker::Ring,
    },
    Method {
        key: "virtual_work_implicit",
        label: "warp by virtual work, implicit Euler",
        family: Family::Warp,
        method: SW_METHOD_WARP_VIRTUAL_WORK,
        integrator: SW_INTEGRATOR_IMPLICIT_EULER,
        fields: 0,
        colour: VIOLET,
        marker: Marker::Disc,
    },
    Method {
        key: "virtual_work_exact",
        label: "warp by virtual work, exact propagator",
        family: Family::Warp,
        method: SW_METHOD_WARP_VIRTUAL_WORK,
        integrator: SW_INTEGRATOR_EXACT,
        fields: 0,
        colour: VIOLET,
        marker: Marker::Ring,
    },
    Method {
        key: "rotation_strain",
        label: "rotation–strain, implicit Euler",
        family: Family::Warp,
        method: SW_METHOD_ROTATION_STRAIN,
        integrator: SW_INTEGRATOR_IMPLICIT_EULER,
        fields: 0,
        colour: BROWN,
        marker: Marker::Disc,
    },
    Method {
        key: "reduced_12",
        label: "reduced shell, SDIRK2, 12 fields",
        family: Family::Reduced,
        method: SW_METHOD_REDUCED_SHELL,
        integrator: 0,
        fields: 12,
        colour: ORANGE,
        marker: Marker::Ring,
    },
    Method {
        key: "reduced_40",
        label: "reduced shell, SDIRK2, 40 fields",
        family: Family::Reduced,
        method: SW_METHOD_REDUCED_SHELL,
        integrator: 0,
        fields: 40,
        colour: ORANGE,
        marker: Marker::Disc,
    },
    Method {
        key: "polynomial_12",
        label: "polynomial shell, SDIRK2, 12 fields",
        family: Family::Reduced,
        method: SW_METHOD_POLYNOMIAL_SHELL,
        integrator: 0,
        fields: 12,
        colour: TEAL,
        marker: Marker::Ring,
    },
    Method {
        key: "polynomial_40",
        label: "polynomial shell, SDIRK2, 40 fields",
        family: Family::Reduced,
        method: SW_METHOD_POLYNOMIAL_SHELL,
        integrator: 0,
        fields: 40,
        colour: TEAL,
        marker: Marker::Disc,
    },
    Method {
        key: "adaptive_40",
        label: "adaptive shell, SDIRK2, 40 fields",
        family: Family::Reduced,
        method: SW_METHOD_ADAPTIVE_SHELL,
        integrator: 0,
        fields: 40,
        colour: PINK,
        marker: Marker::Cross,
    },
    Method {
        key: "shell_implicit",
        label: "full shell, implicit Euler",
        family: Family::Shell,
        method: SW_METHOD_SHELL_IMPLICIT,
        integrator: 0,
        fields: 0,
        colour: GREEN,
        marker: Marker::Triangle,
    },
    Method {
        key: "shell_second",
        label: "full shell, SDIRK2",
        family: Family::Shell,
        method: SW_METHOD_SHELL_IMPLICIT,
        integrator: SW_INTEGRATOR_SECOND_ORDER,
        fields: 0,
        colour: GREEN,
        marker: Marker::Ring,
    },
    Method {
        key: "shell_explicit",
        label: "full shell, explicit Euler",
        family: Family::Shell,
        method: SW_METHOD_SHELL_EXPLICIT,
        integrator: 0,
        fields: 0,
        colour: GREEN,
        marker: Marker::Cross,
    },
];

/// What the page says of a method of the library.
pub struct Kind {
    /// SW_METHOD_....
    pub method: u32,
    /// The library's label.
    pub name: &'static str,
    /// How it moves, and when to take it.
    pub advice: &'static str,
}

/// From the cheapest to the dearest, as a rule.
pub const KINDS: &[Kind] = &[
    Kind {
        method: SW_METHOD_LMA,
        name: "linear modes",
        advice: "adds up vibration shapes (LMA). The cheapest. Take it for small vibrations; it swells in bends.",
    },
    Kind {
        method: SW_METHOD_WARP,
        name: "warp",
        advice: "the paper's: every vertex also turns by its own rotation. Take it for flat shells that bend up to a quarter turn, many \
            of them, or very large meshes.",
    },
    Kind {
        method: SW_METHOD_WARP_VIRTUAL_WORK,
        name: "warp by virtual work",
        advice: "the warp with the exact force of its own shape, at up to twice the step's time. Take it where loads pull aside, or \
            energy must be kept.",
    },
    Kind {
        method: SW_METHOD_ROTATION_STRAIN,
        name: "rotation–strain",
        advice: "turns triangles instead of vertices, so that bends keep lengths and areas. The most accurate of the modal methods on \
            shells that are flat at rest.",
    },
    Kind {
        method: SW_METHOD_POLYNOMIAL_SHELL,
        name: "polynomial shell",
        advice: "the reduced shell with its energy as a polynomial: tens of microseconds, whatever the mesh. Take it for curved or folded \
            shells and large bends in real time.",
    },
    Kind {
        method: SW_METHOD_ADAPTIVE_SHELL,
        name: "adaptive shell",
        advice: "the polynomial shell as far as it was as good as the samples in training, the reduced shell beyond. Take it where a shell \
            is near rest most of the time and bends far at times.",
    },
    Kind {
        method: SW_METHOD_REDUCED_SHELL,
        name: "reduced shell",
        advice: "the nonlinear energy on a few trained fields, evaluated at a few hundred elements. Take it for errors of a few percent \
            and less, at a small part of the full shell's time. Training takes seconds to two minutes.",
    },
    Kind {
        method: SW_METHOD_SHELL_IMPLICIT,
        name: "full shell, implicit",
        advice: "the full nonlinear equations at every vertex. Take it for snaps, crumples, and loads unlike any that a reduced shell \
            was trained on.",
    },
    Kind {
        method: SW_METHOD_SHELL_EXPLICIT,
        name: "full shell, explicit",
        advice: "the same by short explicit steps: reference runs on small meshes.",
    },
];

/// The paper's method.
pub const PAPER: &str = "warp_implicit";

pub fn method(key: &str) -> &'static Method {
    METHODS.iter().find(|m| m.key == key).expect("a method of the table")
}

/// What moves in modes, by the integrator that stands for both at rest, and the reduced shells.
pub fn modal_at_rest() -> impl Iterator<Item = &'static Method> {
    METHODS
        .iter()
        .filter(|m| m.family != Family::Shell && (m.fields > 0 || m.integrator == SW_INTEGRATOR_IMPLICIT_EULER))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_of_the_library_is_measured_and_described() {
        let mut library: Vec<u32> = shellwarp::method::METHODS.iter().map(|m| m.number).collect();
        let mut described: Vec<u32> = KINDS.iter().map(|k| k.method).collect();
        let mut measured: Vec<u32> = METHODS.iter().map(|m| m.method).collect();
        for list in [&mut library, &mut described, &mut measured] {
            list.sort_unstable();
        }
        measured.dedup();
        assert_eq!((&described, &measured), (&library, &library));
    }
}
