//! Strips of 4.04 x 0.8 held at one end: flat, folded to a V, led by the tip, and lifted by a ball.

use super::{Drive, Reference, Scene};
use crate::library::Material;
use crate::mesh::{Mesh, P3};

/// Rows of triangles across a strip; half as many on the coarse one.
pub const ROWS: usize = 8;

/// A strip's material with the membrane stiffness of edge 0.1 at any resolution: k_L goes with the edge's length.
pub fn material(rows: usize, membrane: f64, bend: f64) -> Material {
    let edge = 2.0 * 0.8 / (rows as f64 * 3f64.sqrt());
    Material { area: membrane, length: membrane * edge / 0.1, bend, density: 1.0 }
}

/// 4.04: a whole number of half edges at 4, 8, 16 … rows.
pub const LENGTH: f64 = 4.041451884327381;

pub fn flat_mesh(rows: usize) -> Mesh {
    Mesh::strip(LENGTH, 0.8, rows)
}

/// Folded along its middle by 20° on either side.
pub fn vee_mesh(rows: usize) -> Mesh {
    let (sin, cos) = 20f64.to_radians().sin_cos();
    flat_mesh(rows).shaped(|[x, y]| [x, y * cos, y.abs() * sin])
}

fn strip(key: &'static str, shape: fn(usize) -> Mesh, membrane: f64, bend: f64) -> Scene {
    Scene {
        key,
        title: "",
        text: "",
        mesh: shape(ROWS),
        coarse: Some((shape(ROWS / 2), material(ROWS / 2, membrane, bend))),
        material: material(ROWS, membrane, bend),
        fixed: Mesh::root,
        gravity: [0.0; 3],
        damping: 0.0,
        frames: 0,
        drive: Drive::Released,
        ball: None,
        probe: ([LENGTH, 0.0], 2),
        paper_modes: 8,
        reference: Reference::Explicit { steps: 500, check: 400 },
        most_modes: 64,
    }
}

pub fn flat() -> Scene {
    Scene {
        title: "Flat beam, released",
        text: "A flat strip held at one end is let go under gravity and swings freely, without any damping, for two periods. \
            Its tip drops by more than a quarter of its length.",
        gravity: [0.0, 0.0, -1.0],
        frames: 240,
        ..strip("flat_release", flat_mesh, 1e4, 10.0)
    }
}

pub fn vee() -> Scene {
    Scene {
        title: "V-beam, released",
        text: "A strip folded to a V, of a soft membrane, is let go and swings freely, without any damping. Its section flattens \
            somewhat where it bends, which slows the true swing and which no modal method follows.",
        gravity: [0.0, 0.0, -1.2],
        frames: 180,
        reference: Reference::Explicit { steps: 400, check: 300 },
        ..strip("vee_release", vee_mesh, 1e3, 10.0)
    }
}

/// A full turn in four seconds, up by 1.5 and back to the start.
fn path(time: f64) -> f64 {
    0.75 * (1.0 - (0.5 * std::f64::consts::PI * time).cos())
}

pub fn led() -> Scene {
    let strip = strip("handle", flat_mesh, 1e4, 10.0);
    let vertex = strip.mesh.nearest([LENGTH, 0.0]) as u32;
    Scene {
        title: "A handle dragged on a path",
        text: "The middle of a flat strip's free end is lifted by 1.5 and brought back in four seconds; its other two coordinates \
            are free.",
        damping: 2.0,
        frames: 120,
        drive: Drive::Led { vertex, height: path },
        probe: ([2.0, 0.0], 2),
        ..strip
    }
}

/// Waits below the strip for a second, is up by 1.1 after two more, and sinks again.
fn rise(time: f64) -> P3 {
    let lift = 0.55 * (1.0 - (0.5 * std::f64::consts::PI * (time - 1.0).max(0.0)).cos());
    [2.6, 0.1, -1.3 + lift]
}

pub fn touched() -> Scene {
    Scene {
        title: "A ball that lifts a strip",
        text: "A flat strip held at one end falls on a ball that waits below it, a little beside its middle line, and is lifted by it and let \
            down again in four seconds. There is no friction. Contact makes steps of the full shell of first order, so that its own error is larger.",
        gravity: [0.0, 0.0, -0.6],
        damping: 2.0,
        frames: 120,
        ball: Some((0.5, rise)),
        reference: Reference::Extrapolated,
        coarse: None,
        ..strip("ball", flat_mesh, 1e4, 10.0)
    }
}
