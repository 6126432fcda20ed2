//! What a state does in a step, what it leaves out and why, and what each part costs in memory and operations.
//!
//! Operations are instructions on registers of 8 numbers of 32 bits, by a model that is linear in vertices, modes and what acts. Its
//! coefficients are fitted to counts by callgrind; `make bench-leave-out` shows how far the estimate is off. Other registers take
//! more or fewer in proportion.

use crate::Model;
use crate::constraint::ConstraintSet;
use crate::load::{BodyLoad, Loads};
use crate::modal::with_basis;

/// What a step or an output consists of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartKind {
    /// Rest positions, masses, triangles, edges, constants of each mode.
    Shape,
    /// Φ.
    Displacements,
    /// Ψ.
    Rotations,
    /// The oscillator of each mode with its guard; states.
    Modes,
    /// Gravity and the acceleration of the frame.
    UniformLoad,
    /// Inertia of a turning frame.
    Spin,
    /// Forces on vertices.
    Forces,
    /// Wind.
    Wind,
    /// Constraints.
    Constraints,
    /// The nonlinear shell.
    NonlinearShell,
    /// The reduced nonlinear shell.
    ReducedShell,
    /// Contact with solids.
    Contact,
}

/// One of them.
#[derive(Clone, Debug)]
pub struct Part {
    /// Which.
    pub kind: PartKind,
    /// A step or an output uses it at present.
    pub active: bool,
    /// Held by the model or the state.
    pub bytes: usize,
    /// Of one step at present; 0 when asleep.
    pub operations: f64,
    /// Why it is active, how far, or why not.
    pub reason: String,
}

impl PartKind {
    /// In a few words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Shape => "rest shape",
            Self::Displacements => "mode shapes",
            Self::Rotations => "modal rotations",
            Self::Modes => "modes",
            Self::UniformLoad => "gravity and frame acceleration",
            Self::Spin => "inertia of a turning frame",
            Self::Forces => "forces on vertices",
            Self::Wind => "wind",
            Self::Constraints => "constraints",
            Self::NonlinearShell => "nonlinear shell",
            Self::ReducedShell => "reduced shell",
            Self::Contact => "contact",
        }
    }
}

/// Of a vertex and of a triangle, where a force acts on each vertex and where wind does.
pub const FORCE_VERTEX: f64 = 53.0;
const WIND_VERTEX: f64 = 80.0;
const WIND_TRIANGLE: f64 = 188.0;
/// Of an iteration over the constraints: for each row, row and mode, and pair of rows and mode.
const HANDLE: [f64; 3] = [1316.0, 385.0, 2.0];
/// Iterations where no step tells.
pub const ITERATIONS: usize = 3;

/// The state around a method's motion, and a step to come.
pub struct Around<'a> {
    /// What it moves on.
    pub model: &'a Model,
    /// Forces and wind.
    pub loads: &'a Loads,
    /// Gravity and inertia in the step.
    pub load: BodyLoad,
    /// Seconds.
    pub h: f64,
    /// Vectors that the state holds for forces and for wind.
    pub room: [usize; 2],
    /// Bytes of the state beside these.
    pub state_bytes: usize,
}

impl Around<'_> {
    /// Bytes of Φ, and of Ψ with what rotation–strain reconstruction has beside it.
    pub fn shape_bytes(&self) -> [usize; 2] {
        let [phi, psi] = with_basis!(&self.model.modal.basis, basis => basis.shape_bytes());
        [phi, psi + self.model.strain_bytes()]
    }

    /// The rest shape, which is always used.
    fn shape(&self) -> Part {
        let (mesh, model) = (&self.model.shell.mesh, self.model);
        let basis = self.shape_bytes();
        let reason = format!("{} vertices, {} triangles", mesh.positions.len(), mesh.triangles.len());
        let bytes = model.bytes() - basis[0] - basis[1] - model.reduced.as_ref().map_or(0, |reduced| reduced.bytes());
        Part { kind: PartKind::Shape, active: true, bytes, operations: 0.0, reason }
    }

    /// Modes and rotations of a method that has no use for them.
    pub fn unused_modes(&self, [displacements, rotations]: [&str; 2]) -> [Part; 2] {
        let [phi, psi] = self.shape_bytes();
        [
            Part { bytes: phi, ..Part::absent(PartKind::Displacements, displacements) },
            Part { bytes: psi, ..Part::absent(PartKind::Rotations, rotations) },
        ]
    }

    /// What a uniform load and a turning frame do where they cost nothing to speak of.
    pub fn cheap_loads(&self, [uniform, spin]: [&str; 2]) -> [Part; 2] {
        let turns = self.load.spin_rate().is_some();
        [
            Part { active: !self.load.is_zero(), ..Part::absent(PartKind::UniformLoad, uniform) },
            Part { active: turns, ..Part::absent(PartKind::Spin, spin) },
        ]
    }

    /// Forces and wind, for any kind of method: when forces act on some vertices alone, `point` instructions for each of them.
    pub fn forces_and_wind(&self, point: f64, whole: f64) -> [Part; 2] {
        let (n, triangles) = (self.model.shell.mass.len(), self.model.shell.mesh.triangles.len());
        let (forces, [on_all, moving]) = (self.loads.forces.len(), self.room);
        let vector = size_of::<crate::Vec3>();
        let few = self.loads.point_forces(n).is_some();
        let (operations, reason) = match (forces, few) {
            (0, _) => (0.0, "no forces are set".to_string()),
            (_, true) => (point * forces as f64, format!("only the vertices of {forces} forces are visited")),
            (_, false) => (FORCE_VERTEX * n as f64, format!("{forces} forces: all vertices are visited")),
        };
        let bytes = self.loads.forces.capacity() * size_of::<(u32, crate::Vec3)>() + on_all * vector;
        let forces = Part { kind: PartKind::Forces, active: forces > 0, bytes, operations, reason };
        let wind = match &self.loads.wind {
            None => Part::absent(PartKind::Wind, "no wind is set"),
            Some(wind) => Part {
                kind: PartKind::Wind,
                active: true,
                bytes: (moving + wind.local.len()) * vector,
                operations: whole + (WIND_VERTEX + FORCE_VERTEX) * n as f64 + WIND_TRIANGLE * triangles as f64,
                reason: format!("presses on {triangles} triangles as they are turned and move"),
            },
        };
        [forces, wind]
    }

    /// Constraints of a method with so many unknowns.
    pub fn constraints(&self, set: &ConstraintSet, modes: usize) -> Part {
        let rows: usize = set.report().map(|(c, _)| c.axes.iter().filter(|held| **held).count()).sum();
        if rows == 0 {
            return Part::absent(PartKind::Constraints, "no constraint is set");
        }
        let iterations = set.report().map(|(_, outcome)| outcome.iterations).max().unwrap_or(0).max(1);
        let [row, row_mode, pair_mode] = HANDLE;
        let (r, m) = (rows as f64, modes as f64);
        let once = r * row + r * m * row_mode + 0.5 * r * (r + 1.0) * m * pair_mode;
        Part {
            kind: PartKind::Constraints,
            active: true,
            bytes: (rows * (modes + rows + 5) + 9 * modes) * size_of::<f64>(),
            operations: f64::from(iterations) * once,
            reason: format!("{rows} rows, {iterations} iterations as in the last step"),
        }
    }

    /// A method's own parts, the rest shape, and what it has no use for, in the order of [`PartKind`].
    pub fn with_the_rest(&self, own: impl Iterator<Item = Part>) -> Vec<Part> {
        let mut parts: Vec<Part> = own.chain([self.shape()]).collect();
        let unused = "the method has no use for it";
        for rest in [self.unused_reduced_shell(), Part::absent(PartKind::NonlinearShell, unused)] {
            if parts.iter().all(|part| part.kind != rest.kind) {
                parts.push(rest);
            }
        }
        parts.sort_by_key(|part| part.kind as u32);
        parts
    }

    /// What the model holds of a reduced shell, for other methods.
    fn unused_reduced_shell(&self) -> Part {
        let (bytes, reason) = match &self.model.reduced {
            Some(reduced) => (reduced.bytes(), "the method has no use for it; the model holds it"),
            None => (0, "the model was precomputed without reduced_fields"),
        };
        Part { bytes, ..Part::absent(PartKind::ReducedShell, reason) }
    }
}

/// Where numbers of iterations come from.
pub const AS_BEFORE: &str = "as in the last step";
/// The same.
pub const BEFORE_ANY: &str = "before any step";

impl Part {
    /// One that a step does not use.
    pub fn absent(kind: PartKind, reason: &str) -> Self {
        Self { kind, active: false, bytes: 0, operations: 0.0, reason: reason.into() }
    }
}
