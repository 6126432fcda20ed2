//! What a step of a modal method does, and what it leaves out.

use super::{Map, Modal};
use crate::load::BodyLoad;
use crate::methods::plan::{Around, Part, PartKind};
use crate::modal::ModalBasis;
use crate::step::{ForceLaw, Integrator};
use crate::warp::LANES;

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
fn samples_reason((n, left): (usize, f64)) -> String {
    let left = 100.0 * left;
    format!("{n} sampled triangles turn the output and the force; they leave {left:.1} % of what all would do")
}

fn cost([once, each]: Cost, count: usize) -> f64 {
    once + each * count as f64
}

/// What a step of a modal method does to the loads that act everywhere.
struct ModalStep {
    law: ForceLaw,
    samples: Option<(usize, f64)>,
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

impl ModalStep {
    /// Of a sweep over all vertices in each pass, by modes or samples.
    fn sweep(&self, block: Cost, count: usize) -> f64 {
        self.blocks * self.passes * cost(block, count)
    }

    /// What linear modal analysis would do is laid to the load, the rest of a sweep to the rotations.
    fn rotations(&self, bytes: usize, without: bool) -> Part {
        let (active, reason) = match (without, self.law.warped(), self.samples) {
            (true, ..) => (false, "the model was precomputed without them".into()),
            (_, false, _) => (false, "linear modal analysis; SW_PRECOMPUTE_LINEAR would not store them".into()),
            (.., Some(samples)) => (true, samples_reason(samples)),
            _ if self.sweeps => (true, "the force and the output turn with the shell".into()),
            _ => (true, "the output turns with the shell; the step does not need them".into()),
        };
        let swept = |of_sweep: f64| if self.sweeps { of_sweep } else { 0.0 };
        let operations = match self.samples {
            Some((n, _)) => self.passes * n as f64 * cost(STRAIN, self.modes) + swept(self.sweep(STRAIN_BLOCK, n)),
            None => swept(self.sweep(LawCost::of(self.law).block, self.modes) - self.sweep(LINEAR.block, self.modes)),
        };
        Part { kind: PartKind::Rotations, active, bytes, operations, reason }
    }

    fn uniform_load(&self) -> Part {
        let warps = self.law.warped() && self.samples.is_none();
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
            (_, true, _) if self.samples.is_some() => "sums over the vertices taken once",
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
        let operations = match self.samples {
            Some((n, _)) => self.sweep(STRAIN_SPIN, n),
            None => self.sweep(LawCost::of(self.law).spin, self.modes),
        };
        Part { kind: PartKind::Spin, active: true, bytes: 0, operations, reason }
    }
}

impl<M: Map> Modal<M> {
    /// The parts of a step that takes the load so many times.
    pub fn plan_step(&self, around: &Around, passes: f64) -> Vec<Part> {
        let (basis, modes, costs) = (&*self.basis, self.basis.n_amplitudes(), LawCost::of(self.map.law()));
        let [phi, psi] = around.shape_bytes();
        let step = self.modal_step(around, passes);
        let whole = step.blocks * (cost(costs.block, modes) + cost(costs.spin, modes));
        let loads = around.forces_and_wind(step.passes * cost(costs.point, modes), whole);
        let oscillator = if self.integrator == Integrator::Exact { EXACT } else { IMPLICIT };
        let part = |kind, bytes, operations, reason: String| Part { kind, active: true, bytes, operations, reason };
        let shapes = part(PartKind::Displacements, phi, 0.0, format!("{modes} modes"));
        let modes_part = part(
            PartKind::Modes,
            around.state_bytes,
            cost(oscillator, modes) * step.passes,
            modes_reason(basis, &around.load),
        );
        let own = [
            shapes,
            step.rotations(psi, basis.is_linear()),
            modes_part,
            step.uniform_load(),
            step.spin(),
            around.constraints(self.constraints.set(), modes),
        ];
        around.with_the_rest(own.into_iter().chain(loads))
    }

    fn modal_step(&self, Around { load, loads, .. }: &Around, passes: f64) -> ModalStep {
        let (basis, law, samples) = (&self.basis, self.map.law(), self.map.samples());
        let n = basis.shell.mass.len();
        let spins = load.spin_rate().is_some();
        let on_all = loads.point_forces(n).is_none();
        let known_ahead = || {
            let bend = || basis.bend(law.warped()).largest(&self.q);
            samples.is_some() || basis.participation().suffices(law, bend)
        };
        let short = !spins && !on_all && known_ahead();
        let loaded = !load.is_zero();
        let sweeps = !short && (on_all || loaded);
        let blocks = n.div_ceil(LANES) as f64;
        ModalStep { law, samples, modes: basis.n_amplitudes(), passes, blocks, spins, short, sweeps, loaded }
    }
}

fn modes_reason(basis: &ModalBasis, load: &BodyLoad) -> String {
    let modes = basis.n_amplitudes();
    let along = load.everywhere_alike().and_then(|a| a.try_normalize(0.0));
    match along.map(|along| basis.effective_mass_along(&along)) {
        Some(share) if share < FEW_MODES && modes > 0 => {
            let share = 100.0 * share;
            format!(
                "{modes} oscillators; they carry only {share:.0} % of the mass along the load: modes may be missing"
            )
        }
        _ => format!("{modes} oscillators with their guard"),
    }
}
