//! Motion in modal coordinates: the warp, rotation–strain reconstruction and linear modal analysis, by the [`Map`] of each.

mod constraints;
mod joint;
mod map;
mod mapped;
mod motion;
mod plan;
mod points;
mod project;
mod shapes;
mod square;
mod supports;
mod warp;

pub use constraints::VertexMap;
pub use map::Map;

use super::{Acting, Motion, Reaction, Watch};
use crate::constraint::Target;
use crate::load::BodyLoad;
use crate::method::Method;
use crate::modal::{AnyBasis, ModalBasis, with_basis};
use crate::point_energy::PointEnergy;
use crate::step::guard::Pull;
use crate::step::{ForceLaw, Integrator, Oscillator};
use crate::{Error, ErrorKind, Model, Result};
use constraints::{ModalConstraints, Step};
use joint::Spring;
use points::PointSearch;
use shapes::Placing;
use std::sync::Arc;
use supports::SupportMotion;
use warp::Warp;

/// Past this rotation, rad, or this displacement, in units of 1/√M, an amplitude has no meaning left and f32 no room.
const LARGEST_ROTATION: f64 = 1e6;
const LARGEST_AMPLITUDE: f64 = 1e30;

/// A frame that turns by less than this in a step, rad, does not spin. Supports that are led give turns by rounding, of positions in 32
/// bits up to 1e-6: the load would be taken at another time than in a frame that does not turn. A lag of half a step feeds in the square of this.
const STILL: f64 = 1e-5;

/// In a spinning frame the load is taken at the middle of the step: at its start the Coriolis force would lag by half a step and
/// feed energy into one sense of whirling, without bound. Elsewhere the start will do (paper). The middle is found by fixed
/// point, each pass of which gains a factor ωh: enough passes to keep a whirling tube's energy to 5 % over 3000 steps.
fn midpoint_passes(load: &BodyLoad, h: f64) -> usize {
    match load.spin_rate().map(|rate| rate * h) {
        None => 0,
        Some(angle) if angle <= STILL => 0,
        Some(angle) if angle <= 0.03 => 1,
        Some(angle) if angle <= 0.1 => 2,
        Some(_) => 4,
    }
}

/// A fixed point is accepted at this relative residual. A basis of 32 bits gives a force of seven digits; below that the
/// iteration only wanders.
fn settled(basis: &AnyBasis) -> f64 {
    match basis {
        AnyBasis::F32(_) | AnyBasis::I16(_) => 1e-6,
        AnyBasis::F64(_) => 1e-11,
    }
}
/// The fraction of the way per iteration never falls below this.
const LEAST_FRACTION: f64 = 1.0 / 16.0;
const SETTLE_ITERATIONS: usize = 1000;

/// Amplitudes and rates below this become zero: as they die away they would reach the subnormal numbers, which processors take a
/// hundred times longer for, and so would their squares.
const NEGLIGIBLE: f64 = 1e-150;

/// Turns of constraints and an energy of points, at most, and how near they come to each other, of q: eight digits are those of a basis
/// of 32 bits.
const TURNS: usize = 200;
const IN_TURN: f64 = 1e-8;
/// The turn of an equilibrium before which both are met at once. Turns after it that leave more than the next part of the last one's
/// distance gain nothing, and so many of them are the last.
const AT_ONCE: usize = 2;
const STUCK: f64 = 0.8;
const PATIENCE: usize = 4;
/// Of q, how far apart both are where no turn brings them together; there is no equilibrium where so many iterations in a row end so.
const ODDS: f64 = 1e-3;
const AT_ODDS: usize = 8;

/// Sum over the elastic modes of the largest turn of each, rad, that energies of points may lead to: half a turn and as much again for what
/// modes have against each other.
const FURTHEST_BEND: f64 = 2.0 * std::f64::consts::PI;

/// Seconds; its square times any elastic eigenvalue is beyond all rounding.
const LONG_STEP: f64 = 1e9;
/// The square of a step that is long beside the slowest swing, in these swings; and what a step may turn a shell that only contact stops.
const LONG_SWINGS: f64 = 1e3;
const LITTLE_TURN: f64 = 0.1;

/// Amplitudes, the map by which they move the shell, and what acts on them.
#[derive(Clone)]
pub struct Modal<M> {
    basis: Arc<ModalBasis>,
    map: M,
    integrator: Integrator,
    /// c of each mode.
    damping: Vec<f64>,
    constraints: ModalConstraints,
    /// What support fields do; none without them.
    supports: Option<Box<SupportMotion>>,
    /// Amplitudes of modes, and then of support fields.
    q: Vec<f64>,
    q_dot: Vec<f64>,
    /// The next q and q̇ until they are known to be good, and the modal force.
    next: [Vec<f64>; 2],
    force: Vec<f64>,
    /// Made when an energy of points first joins.
    search: Option<PointSearch>,
    /// The last step ended with constraints and an energy of points apart.
    at_odds: bool,
    pull: Pull,
    /// The state that loads are taken at.
    mean: [Vec<f64>; 2],
    /// The last step left every bit as it was.
    unchanged: bool,
    /// Of the model.
    fingerprint: u64,
}

/// The warp by either law, or linear modal analysis, at rest and undamped.
pub fn build(model: &Model, method: Method, integrator: Integrator) -> Result<Box<dyn Motion>> {
    let law = match method {
        Method::VirtualWorkWarp => ForceLaw::VirtualWork,
        Method::LinearModalAnalysis => ForceLaw::Linear,
        _ => ForceLaw::Rotated,
    };
    Ok(Box::new(Modal::new(model, Warp::new(&model.modal, law), integrator)))
}

impl<M: Map> Modal<M> {
    /// At rest, undamped.
    pub fn new(model: &Model, map: M, integrator: Integrator) -> Self {
        let basis = model.modal.clone();
        let zeros = vec![0.0; basis.n_amplitudes()];
        basis.participation(); // now: a step does not allocate
        Self {
            map,
            integrator,
            damping: vec![0.0; basis.n_modes()],
            constraints: ModalConstraints::new(basis.n_amplitudes()),
            supports: basis.supports.as_ref().map(|fields| Box::new(SupportMotion::new(fields))),
            q: zeros.clone(),
            q_dot: zeros.clone(),
            next: [zeros.clone(), zeros.clone()],
            force: zeros.clone(),
            search: None,
            at_odds: false,
            pull: Pull::default(),
            mean: [zeros.clone(), zeros],
            unchanged: false,
            fingerprint: model.fingerprint,
            basis,
        }
    }

    fn is_warped(&self) -> bool {
        self.map.law().warped()
    }

    /// Whether amplitudes `q` give finite positions in any precision, and the energies are numbers.
    fn is_representable_at(&self, q: &[f64], q_dot: &[f64]) -> bool {
        let modal = &self.basis;
        let largest = LARGEST_AMPLITUDE * modal.shell.total_mass.sqrt();
        let (elastic, kinetic) = self.energies_at(q, q_dot);
        let turns = self.is_warped() && modal.bend(true).largest(q) > LARGEST_ROTATION;
        let bounded = !turns && q.iter().all(|q| q.abs() <= largest);
        bounded && elastic.is_finite() && kinetic.is_finite()
    }

    /// Replaces q and q̇ of modes, or with those of support fields.
    fn take_amplitudes(&mut self, q: &[f64], q_dot: &[f64]) -> Result<()> {
        if !self.is_representable_at(q, q_dot) {
            return Err(Error::new(ErrorKind::Numerical, "these amplitudes turn or move vertices beyond all range"));
        }
        self.q[..q.len()].copy_from_slice(q);
        self.q_dot[..q_dot.len()].copy_from_slice(q_dot);
        Ok(())
    }

    /// One step of `h`.
    fn advance(&mut self, acting: &Acting, h: f64) -> Result<()> {
        self.follow_supports(acting, h);
        if !(acting.again && self.take_free_end()) {
            self.advance_freely(acting, h);
        }
        let work = match acting.points {
            None => self.meet_constraints(acting, h),
            Some(energy) => self.meet_constraints_and(energy, acting, h),
        };
        let constrained = (self.constraints.set().work + work).is_finite() && self.constraints.set().is_finite();
        let finite = constrained && (self.pull.body + self.pull.external).is_finite(); // else the guard takes the load for none
        if !finite || !self.is_representable_at(&self.next[0], &self.next[1]) {
            let message = format!("the step of {h:?} s does not give finite positions");
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        self.unchanged = work == 0.0 && self.next == [&*self.q, &*self.q_dot] && self.constraints.set().is_unchanged();
        let [next_q, next_q_dot] = &mut self.next;
        std::mem::swap(&mut self.q, next_q);
        std::mem::swap(&mut self.q_dot, next_q_dot);
        self.constraints.change(|set| set.accept(work));
        Ok(())
    }

    /// Moves the next q and q̇ to the end of the step without constraints and points; notes it where points are searched for.
    fn advance_freely(&mut self, acting: &Acting, h: f64) {
        self.mean[0].copy_from_slice(&self.q);
        self.mean[1].copy_from_slice(&self.q_dot);
        self.project_load(acting);
        self.move_freely(h);
        for _ in 0..midpoint_passes(acting.load, h) {
            for (mean, (now, next)) in self.mean.iter_mut().zip([&self.q, &self.q_dot].into_iter().zip(&self.next)) {
                mean.iter_mut().zip(now.iter().zip(next)).for_each(|(mean, (a, b))| *mean = 0.5 * (a + b));
            }
            self.project_load(acting);
            self.move_freely(h);
        }
        if let Some(search) = &mut self.search {
            search.free.iter_mut().zip(&self.next).for_each(|(free, next)| free.copy_from_slice(next));
            search.goes_on = false;
        }
    }

    /// Puts the next q and q̇ where the step before had them without points.
    fn take_free_end(&mut self) -> bool {
        let Some(search) = &self.search else { return false };
        self.next.iter_mut().zip(&search.free).for_each(|(next, free)| next.copy_from_slice(free));
        true
    }

    /// The modal force at the mean state.
    fn project_load(&mut self, Acting { load, external, .. }: &Acting) {
        let Self { basis, map, mean: [q, q_dot], force, pull, .. } = self;
        *pull = map.project(basis, (load, *external), (q, q_dot), force);
        if let (Some(supports), Some(fields)) = (&self.supports, &self.basis.supports) {
            fields.add_inertia(&supports.acceleration, &mut self.force);
        }
    }

    /// c of mode `k` in a step of `h` under the present load.
    fn step_damping(&self, k: usize, h: f64) -> f64 {
        match self.is_warped() {
            true => self.basis.guard(true).damping(k, self.damping[k], &self.pull, h),
            false => self.damping[k],
        }
    }

    /// The next q and q̇ without constraints.
    fn move_freely(&mut self, h: f64) {
        let (modal, warped) = (&self.basis, self.map.law().warped());
        let guard = modal.guard(warped);
        let [next_q, next_q_dot] = &mut self.next;
        let modes = self.damping.len();
        if let Some(supports) = &self.supports {
            next_q[modes..].copy_from_slice(&supports.amplitudes);
            next_q_dot[modes..].copy_from_slice(&supports.rates);
        }
        let (next_q, next_q_dot) = (&mut next_q[..modes], &mut next_q_dot[..modes]);
        let damping = |k: usize| match warped {
            true => guard.damping(k, self.damping[k], &self.pull, h),
            false => self.damping[k],
        };
        for k in 0..modes {
            let oscillator = Oscillator { damping: damping(k), eigenvalue: modal.eigenvalues[k] };
            (next_q[k], next_q_dot[k]) =
                oscillator.advance(self.integrator, self.q[k], self.q_dot[k], self.force[k], h);
        }
        let held = guard.hold(damping, h, next_q, next_q_dot);
        if held && self.integrator == Integrator::Exact {
            guard.limit(&self.force[..modes], (&self.q[..modes], &self.q_dot[..modes]), next_q, next_q_dot);
        }
        next_q.iter_mut().chain(next_q_dot).filter(|x| x.abs() < NEGLIGIBLE).for_each(|x| *x = 0.0);
    }

    /// Moves the next q and q̇ to where the constraints are met; returns the work done.
    fn meet_constraints(&mut self, acting: &Acting, h: f64) -> f64 {
        let Self { basis: modal, map, integrator, constraints, damping, q, next: [next_q, next_q_dot], .. } = self;
        if constraints.set().is_empty() {
            return 0.0;
        }
        let (mesh, warped) = (&modal.shell.mesh, map.law().warped());
        let step = Step {
            axes: acting.axes,
            h,
            integrator: *integrator,
            modes: (damping, &modal.eigenvalues),
            rest: &mesh.positions,
            size: mesh.size,
            bend: modal.bend(warped),
            warped,
            vertices: map.vertices(),
        };
        with_basis!(&modal.basis, basis => constraints.project(basis, &step, q, (next_q, next_q_dot)))
    }

    /// As [`Modal::meet_constraints`], and to where `energy` has its force at the step's end.
    ///
    /// Both move the free end of the step: by Γ∇W and by ΓJᵀμ. Each is found with the other as found last, in turns (Boyle, Dykstra 1986),
    /// until the place is the same after either. Where handles alone hold a shell, that takes an equilibrium thousands of turns: its third one
    /// begins where both are met at once.
    fn meet_constraints_and(&mut self, energy: &dyn PointEnergy, acting: &Acting, h: f64) -> f64 {
        let mut search = self.search.take().unwrap_or_else(|| PointSearch::new(self.damping.len(), self.q.len()));
        let goes_on = std::mem::replace(&mut search.goes_on, true);
        if !goes_on {
            search.respond((h, self.integrator), &self.basis.eigenvalues, |k| self.step_damping(k, h));
            search.free.iter_mut().zip(&self.next).for_each(|(free, next)| free.copy_from_slice(next));
        }
        search.exact = self.map.vertices().is_some() || !self.constraints.set().is_empty();
        search.continues = !search.exact && goes_on && energy.is_nearly_met();
        if !search.continues {
            search.moved.copy_from_slice(&self.next[0]);
        }
        search.center.copy_from_slice(&self.next[0]);
        search.start.copy_from_slice(&self.q);
        let modes = self.damping.len();
        search.start[modes..].copy_from_slice(&self.next[0][modes..]);
        let mut work = 0.0;
        let (mut last, mut stuck) = (f64::INFINITY, 0);
        self.at_odds = true;
        for turn in 0..TURNS {
            if turn == AT_ONCE && h == LONG_STEP {
                self.minimize_held(energy, &mut search, acting);
            }
            self.minimize(energy, &mut search);
            self.bend_no_further(&mut search);
            let PointSearch { rate, free, center, moved, .. } = &mut search;
            let [next_q, next_q_dot] = &mut self.next;
            for k in 0..rate.len() {
                let change = moved[k] - center[k];
                next_q[k] = free[0][k] + change;
                next_q_dot[k] = free[1][k] + rate[k] * change;
                center[k] = next_q[k];
            }
            if self.constraints.set().is_empty() {
                self.at_odds = false;
                break;
            }
            work = self.meet_constraints(acting, h);
            let next = &self.next[0];
            let apart: f64 = next.iter().zip(&*moved).map(|(a, b)| (a - b).powi(2)).sum();
            let size: f64 = next.iter().zip(&free[0]).map(|(a, b)| a * a + b * b).sum();
            for k in 0..moved.len() {
                center[k] = free[0][k] + next[k] - center[k];
            }
            let met = apart <= IN_TURN * IN_TURN * size;
            let both: f64 = next.iter().zip(&*moved).map(|(a, b)| a * a + b * b).sum();
            self.at_odds = !met && apart > ODDS * ODDS * both;
            stuck += usize::from(h == LONG_STEP && turn >= AT_ONCE && apart > STUCK * STUCK * last);
            last = apart;
            if met || stuck >= PATIENCE {
                break;
            }
        }
        if energy.is_passive() {
            self.gain_nothing(&search.free);
        }
        self.search = Some(search);
        work
    }

    /// Slows the next motion down where it has more energy than the free end of the step, by the map's curvature: what stands still gives none.
    fn gain_nothing(&mut self, [free, free_rate]: &[Vec<f64>; 2]) {
        let (elastic, kinetic) = self.energies_at(&self.next[0], &self.next[1]);
        let (free_elastic, free_kinetic) = self.energies_at(free, free_rate);
        let room = free_elastic + free_kinetic - elastic;
        if kinetic > room.max(0.0) {
            let share = (room.max(0.0) / kinetic).sqrt();
            self.next[1].iter_mut().for_each(|rate| *rate *= share);
        }
    }

    /// Goes back towards the free end where an energy of points would bend a warped shell beyond the range of all loads.
    fn bend_no_further(&self, PointSearch { center, moved, .. }: &mut PointSearch) {
        if !self.is_warped() {
            return;
        }
        let bend = self.basis.bend(true);
        let elastic = |q: &[f64]| -> f64 {
            let turns = q.iter().zip(&self.basis.eigenvalues).enumerate().filter(|(_, (_, lambda))| **lambda > 0.0);
            turns.map(|(k, (q, _))| (q * bend.of(k)).abs()).sum()
        };
        let [free, reached] = [elastic(center), elastic(moved)];
        let limit = free.max(FURTHEST_BEND);
        if reached > limit {
            let share = (limit - free) / (reached - free); // the sum is a norm
            center.iter().zip(moved).for_each(|(center, moved)| *moved = center + share * (*moved - center));
        }
    }

    /// As [`Modal::minimize`], with handles' places met besides; turns then go on from there.
    fn minimize_held(&self, energy: &dyn PointEnergy, search: &mut PointSearch, acting: &Acting) {
        let (warped, mesh) = (self.map.law().warped(), &self.basis.shell.mesh);
        let handles = self.constraints.set().items().iter().filter_map(|c| {
            let pose = acting.axes.of(c.vertex);
            let to_frame = *pose.rotation.inverse().to_rotation_matrix().matrix();
            let Target::Position(target) = c.target.in_frame(pose) else { return None };
            let axes = (0..3).filter(|axis| c.axes[*axis]).map(|axis| to_frame.column(axis));
            let held = axes.map(|axis| axis * axis.transpose()).sum();
            Some((c.vertex, Spring::new(target, held, c.compliance)))
        });
        with_basis!(&self.basis.basis, basis => {
            let placing = Placing { basis, warped, rest: &mesh.positions, vertices: self.map.vertices() };
            search.meet(&placing, energy, handles, mesh.size);
        });
    }

    fn minimize(&self, energy: &dyn PointEnergy, search: &mut PointSearch) {
        let (warped, rest) = (self.map.law().warped(), &self.basis.shell.mesh.positions);
        with_basis!(&self.basis.basis, basis => {
            search.minimize(&Placing { basis, warped, rest, vertices: self.map.vertices() }, energy);
        });
    }

    /// g of [`Motion::visit_acceleration`]: the modal force and that of constraints, less the elastic one.
    fn unbalanced(&self, acting: &Acting, reactions: &[Reaction]) -> Vec<f64> {
        let modal = &self.basis;
        let mut probe = self.clone();
        probe.mean = [self.q.clone(), self.q_dot.clone()];
        probe.project_load(acting);
        let mut g = probe.force;
        // Constraints act by virtual work whatever the law of the loads.
        let pulls: Vec<_> = reactions.iter().map(|(v, [force, _])| (*v, *force)).collect();
        self.map.pull_back((modal, &self.q), &pulls, &mut g);
        let modes = modal.n_modes();
        for (k, g) in g[..modes].iter_mut().enumerate() {
            *g -= modal.eigenvalues[k] * self.q[k];
            *g += reactions.iter().map(|(v, [_, torque])| modal.mode_at(k, *v as usize).1.dot(torque)).sum::<f64>();
        }
        modal.guard(self.is_warped()).add_force(&self.q[..modes], &mut g[..modes]);
        if let Some(supports) = &self.supports {
            g[modes..].copy_from_slice(&supports.acceleration);
        }
        g
    }

    /// ½ qᵀΛq with the guard's share, and ½ q̇ᵀq̇.
    fn energies_at(&self, q: &[f64], q_dot: &[f64]) -> (f64, f64) {
        let modal = &self.basis;
        let elastic: f64 = q.iter().zip(&modal.eigenvalues).map(|(q, lambda)| lambda * q * q).sum();
        let guard = modal.guard(self.is_warped()).energy(q);
        let following = modal.supports.as_ref().map_or(0.0, |fields| fields.energy(&q[modal.n_modes()..]));
        (0.5 * elastic + guard + following, 0.5 * q_dot.iter().map(|v| v * v).sum::<f64>())
    }

    /// The static solution Λq = f(q) + Jᵀμ by fixed point, from the present q: a step of backward Euler so long that inertia
    /// and damping vanish gives Λ⁻¹f, and q moves a fraction of the way there, which is halved when the residual grows.
    /// Returns the residual |q − Λ⁻¹f|/|Λ⁻¹f| and the iterations. Changes nothing on failure.
    fn find_equilibrium(&mut self, acting: &Acting, watch: &mut Watch) -> Result<(f64, usize)> {
        let start = (self.q.clone(), self.q_dot.clone(), self.integrator, self.constraints.set().work);
        if let Some(to) = acting.supports {
            self.set_supports(to.displacement);
        }
        self.integrator = Integrator::ImplicitEuler;
        let settling = self.settling_damping(acting);
        let damping = std::mem::replace(&mut self.damping, settling);
        let mut outcome = self.fixed_point(acting, watch);
        self.damping = damping;
        // A frame that turns faster than the shell can bear throws it as far as the guard lets it.
        if acting.load.spin_rate().is_some() && self.basis.guard(self.is_warped()).energy(&self.q) > 0.0 {
            let message = "no equilibrium: the frame's spin bends the shell beyond all range";
            outcome = Err(Error::new(ErrorKind::Numerical, message));
        }
        self.integrator = start.2;
        self.constraints.change(|set| set.work = start.3);
        if outcome.is_err() {
            (self.q, self.q_dot) = (start.0, start.1);
        }
        outcome
    }

    /// Damping for the fixed point: none, but where contact stops what else moves freely. In so long a step that would go beyond all range, and the
    /// guard against loads would hold it in the contact's place. So it comes to rest by and by, each time from where it was (the proximal
    /// point method), with ways that turn the shell little.
    fn settling_damping(&self, acting: &Acting) -> Vec<f64> {
        let eigenvalues = &self.basis.eigenvalues;
        let free = |k: &usize| eigenvalues[*k] <= 0.0;
        let mut damping = self.damping.clone();
        if acting.points.is_none() || !(0..eigenvalues.len()).any(|k| free(&k)) {
            return damping;
        }
        let mut probe = self.clone();
        probe.mean = [self.q.clone(), vec![0.0; self.q.len()]];
        probe.project_load(acting);
        let bend = self.basis.bend(self.is_warped());
        let turn: f64 = (0..eigenvalues.len()).filter(free).map(|k| (probe.force[k] * bend.of(k)).abs()).sum();
        let slowest = eigenvalues.iter().copied().find(|lambda| *lambda > 0.0).unwrap_or(1.0);
        // 1/h² of a step that is long beside the slowest swing, or in which the load turns the shell by this much.
        let held = (slowest / LONG_SWINGS).max(turn / LITTLE_TURN);
        (0..damping.len()).filter(free).for_each(|k| damping[k] = LONG_STEP * held);
        damping
    }

    fn fixed_point(&mut self, acting: &Acting, watch: &mut Watch) -> Result<(f64, usize)> {
        // What is left of the start by rounding is nothing: where no load is, the solution is zero, and all would be large to it.
        let rounding = f64::EPSILON.powi(2) * self.q.iter().map(|q| q * q).sum::<f64>();
        let (mut fraction, mut last, mut odds) = (1.0f64, f64::INFINITY, 0);
        for iteration in 1..=SETTLE_ITERATIONS {
            let before = self.q.clone();
            self.q_dot.fill(0.0);
            let grew = |e: Error| Error::new(e.kind, "no equilibrium: the amplitudes grow without bound");
            self.advance(acting, LONG_STEP).map_err(grew)?;
            self.q_dot.fill(0.0);
            let moved: f64 = before.iter().zip(&self.q).map(|(a, b)| (a - b).powi(2)).sum();
            let residual =
                (moved / self.q.iter().map(|q| q * q).sum::<f64>().max(rounding).max(f64::MIN_POSITIVE)).sqrt();
            watch(residual)?;
            let still = residual <= settled(&self.basis.basis);
            odds = if acting.points.is_some() && self.at_odds { odds + 1 } else { 0 };
            if odds == AT_ODDS || (still && odds > 0) {
                let message = format!(
                    "no equilibrium: these modes cannot follow handles and colliders at once, after {iteration} iterations"
                );
                return Err(Error::new(ErrorKind::Numerical, message));
            }
            if still {
                return Ok((residual, iteration));
            }
            fraction = if residual > last { (0.5 * fraction).max(LEAST_FRACTION) } else { fraction };
            last = residual;
            before.iter().zip(&mut self.q).for_each(|(before, q)| *q = before + fraction * (*q - before));
        }
        let message = format!("no equilibrium: the residual is {last:.1e} after {SETTLE_ITERATIONS} iterations");
        Err(Error::new(ErrorKind::Numerical, message))
    }
}
