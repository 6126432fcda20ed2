//! What a state does in a step, what it leaves out and why, and what each part costs in memory and operations.
//!
//! Operations are instructions on registers of 8 numbers of 32 bits, by a model that is linear in vertices, modes and what acts. Its
//! coefficients are fitted to counts by callgrind; `make bench-leave-out` shows how far the estimate is off. Other registers take
//! more or fewer in proportion.

use super::{Dynamics, Modal, State};
use crate::Result;
use crate::load::BodyLoad;
use crate::modal::with_basis;
use crate::reduced::Work;
use crate::step::{ForceLaw, Integrator};
use crate::strain::RotationStrain;
use crate::warp::LANES;

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
    Handles,
    /// The nonlinear shell.
    NonlinearShell,
    /// The reduced nonlinear shell.
    ReducedShell,
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
            Self::Handles => "constraints",
            Self::NonlinearShell => "nonlinear shell",
            Self::ReducedShell => "reduced shell",
        }
    }
}

/// Modes that carry less of the mass along a uniform load may be too few for it.
const FEW_MODES: f64 = 0.6;

/// Instructions: once, and for each mode.
type Cost = [f64; 2];

/// Of a step beside the loads, by integrator.
const IMPLICIT: Cost = [1500.0, 150.0];
const EXACT: Cost = [1500.0, 790.0];

/// What a law costs.
struct LawCost {
    /// Of a block of vertices in a sweep over all, and what a turning frame adds to it.
    block: Cost,
    spin: Cost,
    /// Of a vertex with a force of its own.
    point: Cost,
}

const LINEAR: LawCost = LawCost { block: [121.0, 24.0], spin: [127.0, 12.0], point: [60.0, 59.0] };
const ROTATED: LawCost = LawCost { block: [203.0, 32.3], spin: [275.0, 12.0], point: [400.0, 109.0] };
const VIRTUAL_WORK: LawCost = LawCost { block: [388.0, 40.3], spin: [339.0, 24.0], point: [530.0, 109.0] };

/// Of rotation–strain reconstruction: of a sample, and for each mode; of a block of vertices in a sweep over all, and for each sample, and
/// what a turning frame adds to it.
const STRAIN: Cost = [784.0, 41.5];
const STRAIN_BLOCK: Cost = [1100.0, 100.0];
const STRAIN_SPIN: Cost = [2500.0, 140.0];

/// Of the sums taken once: for each mode, and with the warp for each pair of modes.
const SHORT: Cost = [8.0, 9.0];
/// Of a vertex and of a triangle, where a force acts on each vertex and where wind does.
const FORCE_VERTEX: f64 = 53.0;
const WIND_VERTEX: f64 = 80.0;
const WIND_TRIANGLE: f64 = 188.0;
/// Of an iteration over the constraints: for each row, row and mode, and pair of rows and mode.
const HANDLE: [f64; 3] = [1316.0, 385.0, 2.0];
/// Of an element of the nonlinear shell in an explicit step.
const EXPLICIT_ELEMENT: f64 = 275.0;
/// Of an iteration of its implicit step: of an element, a multiplication of the factorization, an entry of the factor.
const IMPLICIT_STEP: [f64; 3] = [4300.0, 2.0, 4.0];
/// Of the reduced shell, by [`crate::reduced::ReducedEnergy::operations`]: of a shape, a gradient and a Hessian, and of a
/// multiplication of its factorization.
const REDUCED_SHAPE: [f64; 5] = [600.0, 0.7, 0.0, 0.0, 0.0];
const REDUCED_GRADIENT: [f64; 5] = [30.0, 0.7, 0.0, 0.0, 0.0];
const REDUCED_HESSIAN: [f64; 5] = [5000.0, 0.1, 0.65, 0.65, 0.9];
const REDUCED_FACTOR: f64 = 1.0;
/// Iterations where no step tells, and what a step of a reduced shell takes.
const ITERATIONS: usize = 3;
const WORK: Work = Work { hessians: 1, gradients: ITERATIONS, shapes: ITERATIONS + 1 };
/// Of a vertex with a force of its own, for each field of the reduced shell.
const REDUCED_POINT: f64 = 20.0;

impl LawCost {
    fn of(law: ForceLaw) -> &'static Self {
        match law {
            ForceLaw::Linear => &LINEAR,
            ForceLaw::Rotated => &ROTATED,
            ForceLaw::VirtualWork => &VIRTUAL_WORK,
        }
    }
}

/// What turns the shell by rotation–strain reconstruction.
fn strain_reason(strain: &RotationStrain) -> String {
    format!(
        "{} sampled triangles turn the output and the force; they leave {:.1} % of what all would do",
        strain.n_samples(),
        100.0 * strain.left
    )
}

fn cost([once, each]: Cost, count: usize) -> f64 {
    once + each * count as f64
}

/// What a step of a modal method does to the loads that act everywhere.
struct ModalStep<'a> {
    law: ForceLaw,
    strain: Option<&'a RotationStrain>,
    modes: usize,
    /// Times that the load is taken.
    passes: f64,
    blocks: f64,
    /// The frame turns.
    spins: bool,
    /// Sums that were taken once will do.
    short: bool,
    /// All vertices are visited.
    sweeps: bool,
    /// Something acts everywhere.
    loaded: bool,
}

impl ModalStep<'_> {
    /// Of a sweep over all vertices in each pass, by modes or samples.
    fn sweep(&self, block: Cost, count: usize) -> f64 {
        self.blocks * self.passes * cost(block, count)
    }

    /// What linear modal analysis would do is laid to the load, the rest of a sweep to the rotations.
    fn rotations(&self, bytes: usize, without: bool) -> Part {
        let (active, reason) = match (without, self.law.warped(), self.strain) {
            (true, ..) => (false, "the model was precomputed without them".into()),
            (_, false, _) => (false, "linear modal analysis; SW_PRECOMPUTE_LINEAR would not store them".into()),
            (.., Some(strain)) => (true, strain_reason(strain)),
            _ if self.sweeps => (true, "the force and the output turn with the shell".into()),
            _ => (true, "the output turns with the shell; the step does not need them".into()),
        };
        let swept = |of_sweep: f64| if self.sweeps { of_sweep } else { 0.0 };
        let operations = match self.strain {
            Some(strain) => {
                let n = strain.n_samples();
                self.passes * n as f64 * cost(STRAIN, self.modes) + swept(self.sweep(STRAIN_BLOCK, n))
            }
            None => swept(self.sweep(LawCost::of(self.law).block, self.modes) - self.sweep(LINEAR.block, self.modes)),
        };
        Part { kind: PartKind::Rotations, active, bytes, operations, reason }
    }

    fn uniform_load(&self) -> Part {
        let warps = self.law.warped() && self.strain.is_none();
        let pairs = if warps { self.modes * self.modes } else { 0 };
        let summed = SHORT[0] * self.modes as f64 + SHORT[1] * pairs as f64;
        let operations = match (self.sweeps, self.short && self.loaded) {
            (true, _) => self.sweep(LINEAR.block, self.modes),
            (_, true) => summed,
            _ => 0.0,
        };
        let reason = match (self.loaded, self.short, self.sweeps) {
            (false, ..) => "nothing acts everywhere alike",
            (_, true, _) if warps => "sums over the vertices taken once: no vertex turns by more than 1.4e-3 rad",
            (_, true, _) if self.strain.is_some() => "sums over the vertices taken once",
            (_, true, _) => "sums over the vertices taken once: the force does not depend on the shape",
            (_, _, true) => "summed over all vertices, as each is turned",
            _ => "nothing to sum",
        };
        let active = self.loaded || self.sweeps;
        Part { kind: PartKind::UniformLoad, active, bytes: 0, operations, reason: reason.into() }
    }

    fn spin(&self) -> Part {
        if !self.spins {
            return Part::absent(PartKind::Spin, "the frame does not turn");
        }
        let reason = format!("Euler, centrifugal and Coriolis forces, {} times a step", self.passes);
        let operations = match self.strain {
            Some(strain) => self.sweep(STRAIN_SPIN, strain.n_samples()),
            None => self.sweep(LawCost::of(self.law).spin, self.modes),
        };
        Part { kind: PartKind::Spin, active: true, bytes: 0, operations, reason }
    }
}

impl State {
    /// The parts of a step of `h` seconds from the present state, all of them, in the order of [`PartKind`]. Fails as a step of such
    /// a length does.
    pub fn plan(&self, h: f64) -> Result<Vec<Part>> {
        self.check_step(h)?;
        let mut parts = match &self.dynamics {
            Dynamics::Modal(_) => self.plan_modal(h),
            Dynamics::Nodal(_) => self.plan_nodal(h),
            Dynamics::Reduced(_) => self.plan_reduced(h),
        };
        if self.rest.skips(h) {
            for part in &mut parts {
                part.operations = 0.0;
                if part.active && !matches!(part.kind, PartKind::Shape | PartKind::Displacements | PartKind::Rotations)
                {
                    part.active = false;
                    part.reason = "the state rests".into();
                }
            }
        }
        Ok(parts)
    }

    /// [`State::plan`] as a table.
    pub fn plan_text(&self, h: f64) -> Result<String> {
        let parts = self.plan(h)?;
        let mut text = format!("{:<32}{:>6}{:>12}{:>14}  why\n", "part", "", "bytes", "operations");
        for Part { kind, active, bytes, operations, reason } in &parts {
            let used = if *active { "on" } else { "–" };
            text += &format!("{:<32}{used:>6}{bytes:>12}{operations:>14.0}  {reason}\n", kind.name());
        }
        let bytes: usize = parts.iter().map(|part| part.bytes).sum();
        let operations: f64 = parts.iter().map(|part| part.operations).sum();
        text += &format!("{:<38}{bytes:>12}{operations:>14.0}\n", "in all");
        Ok(text)
    }

    /// Bytes of Φ, and of Ψ with what rotation–strain reconstruction has beside it.
    fn shape_bytes(&self) -> [usize; 2] {
        let [phi, psi] = with_basis!(&self.model.modal.basis, basis => basis.shape_bytes());
        [phi, psi + self.model.strain_bytes()]
    }

    fn shape_part(&self) -> Part {
        let (mesh, model) = (&self.model.shell.mesh, &self.model);
        let basis = self.shape_bytes();
        let reason = format!("{} vertices, {} triangles", mesh.positions.len(), mesh.triangles.len());
        let bytes = model.bytes() - basis[0] - basis[1] - model.reduced.as_ref().map_or(0, |reduced| reduced.bytes());
        Part { kind: PartKind::Shape, active: true, bytes, operations: 0.0, reason }
    }

    /// Forces and wind, for either kind of state: when forces act on some vertices alone, `point` instructions for each of them.
    fn load_parts(&self, point: f64, whole: f64) -> [Part; 2] {
        let (n, triangles) = (self.model.shell.mass.len(), self.model.shell.mesh.triangles.len());
        let (forces, scratch) = (self.loads.forces.len(), &self.scratch);
        let vector = size_of::<crate::Vec3>();
        let few = self.loads.on_some(n).is_some();
        let (operations, reason) = match (forces, few) {
            (0, _) => (0.0, "no forces are set".to_string()),
            (_, true) => (point * forces as f64, format!("only the vertices of {forces} forces are visited")),
            (_, false) => (FORCE_VERTEX * n as f64, format!("{forces} forces: all vertices are visited")),
        };
        let bytes = self.loads.forces.capacity() * size_of::<(u32, crate::Vec3)>() + scratch.force.len() * vector;
        let forces = Part { kind: PartKind::Forces, active: forces > 0, bytes, operations, reason };
        let wind = match &self.loads.wind {
            None => Part::absent(PartKind::Wind, "no wind is set"),
            Some(wind) => Part {
                kind: PartKind::Wind,
                active: true,
                bytes: (scratch.x.len() + scratch.v.len() + wind.local.len()) * vector,
                operations: whole + (WIND_VERTEX + FORCE_VERTEX) * n as f64 + WIND_TRIANGLE * triangles as f64,
                reason: format!("presses on {triangles} triangles as they are turned and move"),
            },
        };
        [forces, wind]
    }

    fn plan_modal(&self, h: f64) -> Vec<Part> {
        let Dynamics::Modal(modal) = &self.dynamics else { return vec![] };
        let (modes, costs) = (self.model.modal.n_modes(), LawCost::of(modal.law));
        let [phi, psi] = self.shape_bytes();
        let mut frame = self.frame;
        let rates = frame.advance(h);
        let load = self.body_load(&frame.pose, &rates);
        let step = self.modal_step(modal, &load, h);
        let whole = self.n_blocks() * (cost(costs.block, modes) + cost(costs.spin, modes));
        let [forces, wind] = self.load_parts(step.passes * cost(costs.point, modes), whole);
        let oscillator = if modal.integrator == Integrator::Exact { EXACT } else { IMPLICIT };
        let part = |kind, bytes, operations, reason: String| Part { kind, active: true, bytes, operations, reason };
        let shapes = part(PartKind::Displacements, phi, 0.0, format!("{modes} modes"));
        let oscillators = cost(oscillator, modes) * step.passes;
        vec![
            self.shape_part(),
            shapes,
            step.rotations(psi, self.model.modal.is_linear()),
            part(PartKind::Modes, Self::bytes_for(modes), oscillators, self.modes_reason(&load)),
            step.uniform_load(),
            step.spin(),
            forces,
            wind,
            self.handles_part(modes),
            Part::absent(PartKind::NonlinearShell, "the method has no use for it"),
            self.unused_reduced_shell(),
        ]
    }

    fn n_blocks(&self) -> f64 {
        self.model.shell.mass.len().div_ceil(LANES) as f64
    }

    fn modal_step<'a>(&self, modal: &'a Modal, load: &BodyLoad, h: f64) -> ModalStep<'a> {
        let (model, law, strain) = (&self.model, modal.law, modal.strain());
        let spins = load.spin_rate().is_some();
        let on_all = self.loads.on_some(model.shell.mass.len()).is_none();
        let known_ahead =
            || strain.is_some() || model.modal.participation().suffices(law, || modal.largest_bend(&model.modal));
        let short = !spins && !on_all && known_ahead();
        let loaded = !load.is_zero();
        let passes = 1.0 + super::modal::midpoint_passes(load, h) as f64;
        let sweeps = !short && (on_all || loaded);
        ModalStep {
            law,
            strain,
            modes: model.modal.n_modes(),
            passes,
            blocks: self.n_blocks(),
            spins,
            short,
            sweeps,
            loaded,
        }
    }

    fn modes_reason(&self, load: &BodyLoad) -> String {
        let (model, modes) = (&self.model, self.model.modal.n_modes());
        let along = load.everywhere_alike().and_then(|a| a.try_normalize(0.0));
        match along.map(|along| model.modal.effective_mass_along(&along)) {
            Some(share) if share < FEW_MODES && modes > 0 => {
                let share = 100.0 * share;
                format!(
                    "{modes} oscillators; they carry only {share:.0} % of the mass along the load: modes may be missing"
                )
            }
            _ => format!("{modes} oscillators with their guard"),
        }
    }

    fn handles_part(&self, modes: usize) -> Part {
        let rows: usize = self.constraints().map(|(c, _)| c.axes.iter().filter(|held| **held).count()).sum();
        if rows == 0 {
            return Part::absent(PartKind::Handles, "no constraint is set");
        }
        let iterations = self.constraints().map(|(_, outcome)| outcome.iterations).max().unwrap_or(0).max(1);
        let [row, row_mode, pair_mode] = HANDLE;
        let (r, m) = (rows as f64, modes as f64);
        let once = r * row + r * m * row_mode + 0.5 * r * (r + 1.0) * m * pair_mode;
        Part {
            kind: PartKind::Handles,
            active: true,
            bytes: (rows * (modes + rows + 5) + 9 * modes) * size_of::<f64>(),
            operations: f64::from(iterations) * once,
            reason: format!("{rows} rows, {iterations} iterations as in the last step"),
        }
    }

    fn plan_nodal(&self, h: f64) -> Vec<Part> {
        let Dynamics::Nodal(nodal) = &self.dynamics else { return vec![] };
        let model = &self.model;
        let [phi, psi] = self.shape_bytes();
        let mut frame = self.frame;
        let rates = frame.advance(h);
        let load = self.body_load(&frame.pose, &rates);
        let mesh = &model.shell.mesh;
        let elements = (mesh.triangles.len() + 2 * mesh.edges.len()) as f64;
        let [forces, wind] = self.load_parts(FORCE_VERTEX, 0.0);
        let of =
            |kind, active, bytes, reason: &str| Part { kind, active, bytes, operations: 0.0, reason: reason.into() };
        let (operations, reason) = if nodal.is_explicit() {
            (elements * EXPLICIT_ELEMENT, format!("{elements} elements"))
        } else {
            let (iterations, [factorization, entries]) = nodal.operations();
            let (iterations, whence) = foreseen(iterations);
            let [element, multiplication, entry] = IMPLICIT_STEP;
            let once = elements * element + factorization * multiplication + entries * entry;
            (iterations * once, format!("{elements} elements, {iterations} iterations {whence}"))
        };
        let shell = Part { kind: PartKind::NonlinearShell, active: true, bytes: nodal.bytes(), operations, reason };
        vec![
            self.shape_part(),
            of(PartKind::Displacements, false, phi, "the nonlinear shell has no use for modes; the model holds them"),
            of(PartKind::Rotations, false, psi, "the nonlinear shell has no use for modes; the model holds them"),
            Part::absent(PartKind::Modes, "the nonlinear shell moves vertex by vertex"),
            of(PartKind::UniformLoad, !load.is_zero(), 0, "added to each vertex"),
            of(PartKind::Spin, load.spin_rate().is_some(), 0, "added to each vertex while the frame turns"),
            forces,
            wind,
            self.handles_part(0),
            shell,
            self.unused_reduced_shell(),
        ]
    }

    /// What the model holds of one, for other methods.
    fn unused_reduced_shell(&self) -> Part {
        let (bytes, reason) = match &self.model.reduced {
            Some(reduced) => (reduced.bytes(), "the method has no use for it; the model holds it"),
            None => (0, "the model was precomputed without reduced_fields"),
        };
        Part { bytes, ..Part::absent(PartKind::ReducedShell, reason) }
    }

    fn plan_reduced(&self, h: f64) -> Vec<Part> {
        let (Dynamics::Reduced(state), Some(reduced)) = (&self.dynamics, &self.model.reduced) else { return vec![] };
        let [phi, psi] = self.shape_bytes();
        let mut frame = self.frame;
        let rates = frame.advance(h);
        let load = self.body_load(&frame.pose, &rates);
        let (n, elements) = (reduced.n(), reduced.samples.len());
        let [forces, wind] = self.load_parts(REDUCED_POINT * n as f64, 0.0);
        let of =
            |kind, active, bytes, reason: &str| Part { kind, active, bytes, operations: 0.0, reason: reason.into() };
        let (Work { hessians, gradients, shapes }, whence) =
            if state.work.shapes > 0 { (state.work, LAST) } else { (WORK, NONE) };
        let counts = reduced.energy.operations();
        let of_one = |costs: [f64; 5]| -> f64 { counts.iter().zip(costs).map(|(count, cost)| count * cost).sum() };
        let factor = REDUCED_FACTOR * (n * n * n) as f64 / 6.0;
        let operations = hessians as f64 * (of_one(REDUCED_HESSIAN) + factor)
            + gradients as f64 * of_one(REDUCED_GRADIENT)
            + shapes as f64 * of_one(REDUCED_SHAPE);
        let shell = Part {
            kind: PartKind::ReducedShell,
            active: true,
            bytes: reduced.bytes() + state.bytes(),
            operations,
            reason: format!(
                "{n} fields on {elements} elements; {hessians} Hessians, {gradients} gradients and {shapes} shapes {whence}"
            ),
        };
        vec![
            self.shape_part(),
            of(PartKind::Displacements, false, phi, "the reduced shell has fields of its own; the model holds them"),
            of(PartKind::Rotations, false, psi, "the reduced shell does not warp; the model holds them"),
            Part::absent(PartKind::Modes, "the reduced shell moves by its fields"),
            of(PartKind::UniformLoad, !load.is_zero(), 0, "sums over the vertices taken once"),
            of(PartKind::Spin, load.spin_rate().is_some(), 0, "sums over the vertices taken once"),
            forces,
            wind,
            self.handles_part(n),
            Part::absent(PartKind::NonlinearShell, "the method has no use for it"),
            shell,
        ]
    }
}

const LAST: &str = "as in the last step";
const NONE: &str = "for want of a step";

/// Iterations of the next step, by those of the last.
fn foreseen(last: usize) -> (f64, &'static str) {
    if last > 0 { (last as f64, LAST) } else { (ITERATIONS as f64, NONE) }
}

impl Part {
    fn absent(kind: PartKind, reason: &str) -> Self {
        Self { kind, active: false, bytes: 0, operations: 0.0, reason: reason.into() }
    }
}
