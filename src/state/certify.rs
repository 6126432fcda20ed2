//! What a state gets wrong, estimated from the state itself by the full shell (a posteriori).
//!
//! With the loads F at its pose x, and the inertia and damping M a that the method itself carries, the full shell leaves
//!
//!   r = F − M a − ∇E(x)
//!
//! out of balance. From there a few Newton steps of the full shell lead to the pose that would balance F − M a, by the way δ: the
//! estimate of the error. At rest a = 0 and δ is the error against the full shell's equilibrium, as far as the steps get. In motion it
//! is what the method's forces get wrong at this moment, not what has added up since the start.
//!
//! A balance may be unstable. A shell that stands on one would fall, so δ then leads on to the stable equilibrium that it falls to. One
//! that moves may pass it, as its inertia is part of the balance, and δ ends there.
//!
//! Rigid motions that nothing holds are no part of it ([`crate::reference`]'s `free_motion`): inertia answers them. Hard handles are led to
//! their targets, and wind follows the shape.
//!
//! Of a method with coordinates q and u(q), M a = M J g, with J = ∂u/∂q as its law has it and g the part of the generalized forces
//! that its own elastic forces do not balance, constraints included: g = q̈ + C q̇.

use super::{Method, Space, State, external};
use crate::constraint::{Constraint, Outcome, Target};
use crate::error::{none_or_found, unless_none};
use crate::features::Feature;
use crate::methods::{self, Acting, Reaction, Watch};
use crate::point_energy::{InFrame, PointEnergy};
use crate::reference::{self, LOST, Load, SOLVES, Solver, mass_norm as norm};
use crate::support::FrameMotion;
use crate::{Error, ErrorKind, Result, Vec3, rotation};
use nalgebra::UnitQuaternion;
use std::sync::Arc;

/// A hard handle that misses by less, in sizes or rad, is met.
const MET: f64 = 1e-6;

/// Of the loads and the handles' forces, what is left at an equilibrium, at most.
pub(super) const BALANCED: f64 = 1e-3;

/// A shell stands still whose inertia is this part of its loads, and which the slowest mode moves by this part of its way in a radian, at most.
const STILL: f64 = 1e-3;

/// Roundings of a coordinate that a vertex may be off by and count as right: as many as positions and displacements take on their way.
const ROUNDED: f64 = 4.0;

/// Times that the full shell is led again as it came into solids, at most.
const TOUCHES: usize = 6;

/// A method is outside what it was made for when it gets more than this share of the displacement wrong: what the warp does by its own
/// error at [`super::ROTATION_RANGE`].
pub const LARGEST_ERROR: f64 = 0.2;

/// The estimate.
#[derive(Clone, Copy, Debug, Default)]
pub struct Certificate {
    /// ‖δ‖_M/‖u + δ‖_M, u from the shape of no energy.
    pub error: f64,
    /// Largest |δ|.
    pub max_error: f64,
    /// The vertex that has it.
    pub vertex: usize,
    /// The same two of the positions that [`State::correct`] led to, by Newton steps from there. Where it did not since the last step, the errors above.
    pub corrected: [f64; 2],
    /// ‖r‖ over the vertices that move, along what constraints leave free, relative to F − M a with the constraints' forces.
    pub residual: f64,
    /// The same where the steps ended.
    pub remaining: f64,
    /// Factorizations of the full shell's stiffness that it took.
    pub factorizations: usize,
    /// Bytes of the full shell's matrix, factor and fields, which the model keeps.
    pub bytes: usize,
}

/// With where the steps led (n_vertices, frame axes).
type Estimate = Result<(Certificate, Vec<Vec3>)>;

impl Certificate {
    /// Whether the method is outside what it was made for.
    pub fn out_of_range(&self) -> bool {
        self.error > LARGEST_ERROR
    }
}

impl State {
    /// Estimates what the state gets wrong under the loads that are set now; zeros for a nonlinear shell. Takes a few
    /// factorizations of the full shell's stiffness.
    pub fn certify(&self) -> Result<Certificate> {
        self.certify_watched(&mut |_| Ok(()))
    }

    /// The same, where `watch` hears of each iteration what is left of the force, relative, and may stop the work with an error.
    pub fn certify_watched(&self, watch: &mut Watch) -> Result<Certificate> {
        Feature::NonlinearShell.require()?;
        self.refuse_moving_rest("a certificate")?;
        if self.motion.is_full_shell() {
            return Ok(Certificate::default());
        }
        let (own, _) = self.estimate(None, watch)?;
        let Some(way) = self.correction.as_ref().and_then(|kept| kept.way()) else { return Ok(own) };
        let (kept, _) = self.estimate(Some(way), watch)?;
        let factorizations = own.factorizations + kept.factorizations;
        Ok(Certificate { corrected: kept.corrected, factorizations, ..own })
    }

    /// As [`State::certify`], of a method that is not a nonlinear shell's, or of the positions by `way` (n_vertices, frame axes) from its own.
    pub(super) fn estimate(&self, way: Option<&[Vec3]>, watch: &mut Watch) -> Estimate {
        let shell = &self.model.shell;
        let mut judges = self.contacts.clone();
        let judging = self.judging_points(&mut judges, None);
        self.with_full_shell(judging.as_ref(), |solver, u, load| {
            let (mut found, mut joined) = (None, judging.clone());
            let (mut end, mut factorizations) = (vec![], 0);
            let start: Vec<Vec3> = (0..u.len()).map(|v| u[v] + way.map_or(Vec3::zeros(), |way| way[v])).collect();
            for _ in 0..TOUCHES {
                solver.join(joined.take());
                let corrected = solver.correct(&start, load, SOLVES, watch);
                solver.join(None); // others use it next
                let corrected = corrected?;
                factorizations += corrected.factorizations;
                end =
                    shell.mesh.positions.iter().zip(&start).zip(&corrected.way).map(|((x, u), d)| x + u + d).collect();
                found = Some(corrected);
                joined = self.judging_points(&mut judges, Some(&end));
                if joined.is_none() {
                    break;
                }
            }
            let Some(found) = found else { unreachable!("there is a first time") };
            let ([residual, left], errors) = (found.force, self.errors_of(&found.way, &end));
            let (remaining, bytes) = (left.max(found.short), solver.bytes());
            let certificate = Certificate { residual, remaining, factorizations, bytes, ..errors };
            let Certificate { error, max_error, residual, remaining, .. } = certificate;
            match [error, max_error, residual, remaining].iter().all(|x| x.is_finite()) {
                true => Ok((certificate, end)),
                false => Err(Error::new(ErrorKind::Numerical, "the estimate leaves the range of numbers")),
            }
        })
    }

    /// Calls `body` with a solver of the full shell under the constraints, the displacements (n_vertices), and the load that balances the
    /// method's inertia.
    pub(super) fn with_full_shell<T>(
        &self,
        judging: Option<&InFrame>,
        body: impl FnOnce(&mut Solver, &[Vec3], &Load) -> Result<T>,
    ) -> Result<T> {
        let shell = &self.model.shell;
        self.refuse_mechanisms()?;
        let reactions = self.reactions(judging);
        let [u, rate, inertia] = self.present_motion(&reactions);
        let less = |forces: Vec<Vec3>| -> Vec<Vec3> { forces.iter().zip(&inertia).map(|(f, ma)| f - ma).collect() };
        let loads = self.loads_at(&u, &rate);
        let moving = shell.free_norm(&loads);
        if let Some(v) = less(loads).iter().position(|f| !f.iter().all(|x| x.is_finite())) {
            return Err(Error::new(
                ErrorKind::Numerical,
                format!("load and inertia on vertex {v} are beyond the range of numbers"),
            ));
        }
        let own = shell.with_rest_angles(&self.motion.rest_angles()).map(Arc::new);
        self.model.solvers.with(
            || Solver::new(shell.clone()),
            |solver| {
                solver.set_shell(own.unwrap_or_else(|| shell.clone()));
                let axes = self.frame.pose.rotation.inverse().to_rotation_matrix();
                solver.set_constraints(*axes.matrix(), self.constraints_in_frame(&u), &u)?;
                if judging.is_some() && solver.moves_freely(&u) {
                    let message = "no estimate of a shell that nothing but contact holds: handles and supports let it move as a whole";
                    return Err(Error::new(ErrorKind::Unsupported, message));
                }
                let reactions = reactions.iter().map(|(_, [pull, _])| pull.norm_squared()).sum::<f64>().sqrt();
                let held = libm::hypot(reactions, self.support_pull());
                let still = self.is_still(&u, &rate, &inertia, libm::hypot(moving, held));
                let (at, follows) = (|u: &[Vec3]| less(self.loads_at(u, &rate)), self.loads.needs_motion());
                body(solver, &u, &Load { at: &at, follows, held, moving, still, foreign: true })
            },
        )
    }

    /// Fails where parts of the shell move against each other without strain: then no balance is nearest, and Newton's steps lead anywhere.
    fn refuse_mechanisms(&self) -> Result<()> {
        let (shell, modal) = (&self.model.shell, &self.model.modal);
        let (free, rigid) = (modal.zero_modes, reference::rigid_motions(shell));
        let soft = !shell.resists_all();
        let untold = soft && free > 0 && free == modal.n_modes(); // more of them may lie beyond
        if free <= rigid && !untold {
            return Ok(());
        }
        let message = format!(
            "the full shell has no stiffness to go by: {free} of the {} modes move it without strain, and {rigid} motions are rigid",
            modal.n_modes()
        );
        Err(Error::new(ErrorKind::Numerical, message))
    }

    /// The errors of a pose that is `way` from where it should be, `end` (n_vertices, frame axes). What rounding moves is none.
    fn errors_of(&self, way: &[Vec3], end: &[Vec3]) -> Certificate {
        let (shell, rest) = (&self.model.shell, self.stress_free_positions());
        let rounding = ROUNDED * f64::EPSILON * shell.mesh.reach;
        if way.iter().all(|way| way.norm() <= rounding) {
            return Certificate::default();
        }
        let longest = |a: &usize, b: &usize| way[*a].norm_squared().total_cmp(&way[*b].norm_squared());
        let vertex = (0..way.len()).max_by(longest).unwrap_or(0);
        let errors = [ratio(norm(shell, |v| way[v]), norm(shell, |v| end[v] - rest[v])), way[vertex].norm()];
        let [error, max_error] = errors;
        Certificate { error, max_error, vertex, corrected: errors, ..Certificate::default() }
    }

    /// Goes on by the paper's warp where that is nearer to the full shell, as far as estimates and what handles miss tell; returns the
    /// estimate of the method that goes on. A state that moves is set against the warp at its pose. One without velocities is set against a warp at
    /// rest, sought from the rest shape, or else from the state's pose, which comes first where solids or nothing hold it.
    ///
    /// Its estimate and the warp's may be of different equilibria. Where a hard handle leads it, both are set against the equilibrium that its own
    /// estimate led to, as that depends on the way that it took. In two cases both are set against the equilibrium that the full shell has from rest,
    /// which takes as long as its static solution. The first: its own estimate finds half of its displacement wrong, and the warp comes to the handle.
    /// The second: nothing leads it, and the estimates do not decide or one is wanting. Fails, changing nothing, where neither has an estimate.
    pub fn fall_back(&mut self) -> Result<Certificate> {
        self.fall_back_watched(&mut |_| Ok(()))
    }

    /// The same, where `watch` hears of each iteration what is left of the force, relative, and may stop the work with an error: then nothing has changed.
    pub fn fall_back_watched(&mut self, watch: &mut Watch) -> Result<Certificate> {
        Feature::NonlinearShell.require()?;
        self.refuse_moving_rest("a certificate")?;
        match self.method() {
            Method::Warp => return self.certify_watched(watch),
            Method::ImplicitShell | Method::ExplicitShell => return Ok(Certificate::default()),
            _ => (),
        }
        let Some(warp) = unless_none(self.as_warp(watch))? else { return self.certify_watched(watch) };
        let own = none_or_found(self.estimate(None, watch))?;
        let other = none_or_found(warp.estimate(None, watch))?;
        let led = self.constraints().any(|(c, _)| c.compliance == 0.0);
        let by_its_way = |own: &Certificate| led && (own.error <= LOST || warp.missed() > LOST);
        let known = match &own {
            _ if !self.is_standing() => None,
            Ok((own, end)) if by_its_way(own) => (own.remaining <= BALANCED).then(|| end.clone()),
            own if self.is_clear(own, &other) => None,
            _ => unless_none(self.path_from_rest(watch))?,
        };
        let (own, other) = match known {
            Some(end) => (Ok(self.against(&end, &own)), Ok(warp.against(&end, &other))),
            None => (own.map(|(own, _)| own), other.map(|(other, _)| other)),
        };
        match (own, other) {
            (Ok(own), Ok(other)) if self.is_better(&own, (&warp, &other)) => Ok(own),
            (_, Ok(other)) => {
                *self = warp;
                Ok(other)
            }
            (own, Err(_)) => own,
        }
    }

    /// The warp that would go on: at this state's pose, or at rest where this one has no velocities.
    fn as_warp(&self, watch: &mut Watch) -> Result<State> {
        let mut warp = self.try_clone()?;
        warp.set_method(Method::Warp)?;
        if !self.is_standing() {
            return Ok(warp);
        }
        warp.frame.motion = FrameMotion::Given(self.rates);
        let mut unbent = warp.try_clone()?;
        unbent.unbend();
        let (mut first, mut second) = if self.stays_put() { (unbent, warp) } else { (warp, unbent) };
        if unless_none(first.equilibrium_watched(watch))?.is_some() {
            return Ok(first);
        }
        second.equilibrium_watched(watch).map(|_| second)
    }

    /// Whether the estimates of this state and of the warp decide between them, wherever they led.
    fn is_clear(&self, own: &Estimate, other: &Estimate) -> bool {
        let (Ok((own, here)), Ok((other, there))) = (own, other) else { return false };
        let (shell, rest) = (&self.model.shell, self.stress_free_positions());
        let size = |end: &[Vec3]| norm(shell, |v| end[v] - rest[v]);
        // An error against the other's end is within their distance of that against its own.
        let apart = norm(shell, |v| here[v] - there[v]);
        2.0 * apart <= (own.error * size(here) - other.error * size(there)).abs()
    }

    /// The shape of no energy (n_vertices).
    fn stress_free_positions(&self) -> &[Vec3] {
        let shell = &self.model.shell;
        shell.unloaded()
    }

    /// The equilibrium that the full shell's path from rest leads to under the loads and constraints (n_vertices, frame axes).
    pub(super) fn path_from_rest(&self, watch: &mut Watch) -> Result<Vec<Vec3>> {
        let mut full = self.try_clone()?;
        full.reset();
        full.frame.motion = FrameMotion::Given(self.rates);
        full.change_method(Method::ImplicitShell)?;
        full.equilibrium_watched(watch)?;
        Ok(full.in_frame())
    }

    /// The errors against the pose `end`; the rest as of the estimate.
    fn against(&self, end: &[Vec3], estimate: &Estimate) -> Certificate {
        let way: Vec<Vec3> = end.iter().zip(self.in_frame()).map(|(end, x)| end - x).collect();
        let untold = Certificate { residual: 1.0, remaining: 1.0, ..Certificate::default() };
        let known = estimate.as_ref().map_or(untold, |(certificate, _)| *certificate);
        let Certificate { error, max_error, vertex, corrected, .. } = self.errors_of(&way, end);
        Certificate { error, max_error, vertex, corrected, ..known }
    }

    /// Positions (n_vertices, frame axes).
    pub(super) fn in_frame(&self) -> Vec<Vec3> {
        let mut places = vec![Vec3::zeros(); self.model.shell.mass.len()];
        self.positions(Space::Frame, |v, x| places[v] = x);
        places
    }

    /// Takes the rest shape, and nothing else of [`State::reset`].
    fn unbend(&mut self) {
        self.motion.reset();
        if let Some(supports) = &self.supports {
            self.motion.place_supports(&supports.now);
        }
    }

    /// Whether its rest shape is where supports or handles hold it. What touches solids, or nothing holds, is where it came to.
    pub(super) fn stays_put(&self) -> bool {
        let held = self.model.modal.zero_modes == 0 || self.constraints().next().is_some();
        held && self.contacts.is_none()
    }

    /// No velocity: at an equilibrium, or at a pose that was set.
    pub(super) fn is_standing(&self) -> bool {
        let mut standing = true;
        self.motion.visit_motion(&mut |_, _, rate| standing &= rate == Vec3::zeros());
        standing
    }

    /// Whether inertia and speed are too small to tell from rest, beside `loads` and the slowest mode's.
    fn is_still(&self, u: &[Vec3], rate: &[Vec3], inertia: &[Vec3], loads: f64) -> bool {
        let (shell, modal) = (&self.model.shell, &self.model.modal);
        let slowest = modal.eigenvalues.iter().find(|lambda| **lambda > 0.0).map_or(0.0, |lambda| lambda.sqrt());
        let speed = norm(shell, |v| rate[v]);
        shell.free_norm(inertia) <= STILL * loads && speed <= STILL * slowest * norm(shell, |v| u[v])
    }

    /// Whether this state, with what it gets wrong, is no further from the full shell than the warp.
    fn is_better(&self, own: &Certificate, (warp, other): (&State, &Certificate)) -> bool {
        let [missed, missed_by_warp] = [self.missed(), warp.missed()];
        if missed > LOST && missed_by_warp < missed {
            return false;
        }
        own.error.max(missed) <= other.error.max(missed_by_warp)
    }

    /// The largest share of its way that a hard handle's vertex is short of.
    fn missed(&self) -> f64 {
        let held: Vec<&Constraint> = self.constraints().map(|(c, _)| c).filter(|c| c.compliance == 0.0).collect();
        if held.is_empty() {
            return 0.0;
        }
        let mut place = vec![Vec3::zeros(); self.model.shell.mass.len()];
        self.positions(Space::World, |v, x| place[v] = x);
        let pose = &self.frame.pose;
        let missed = |c: &Constraint| {
            let Target::Position(target) = c.target else { return 0.0 };
            let rest = pose.origin + pose.rotation * self.model.shell.mesh.positions[c.vertex as usize];
            let along = |d: Vec3| (0..3).filter(|a| c.axes[*a]).map(|a| d[a] * d[a]).sum::<f64>().sqrt();
            along(target - place[c.vertex as usize]) / along(target - rest).max(MET * self.model.shell.mesh.size)
        };
        held.into_iter().map(missed).fold(0.0, f64::max)
    }

    /// u, its rate and M a, as the method has them (n_vertices each, frame axes).
    fn present_motion(&self, reactions: &[Reaction]) -> [Vec<Vec3>; 3] {
        let (model, pose, rates) = (&self.model, &self.frame.pose, &self.rates);
        let shell = &model.shell;
        let mut scratch = self.scratch.clone();
        if self.loads.point_forces(shell.mass.len()).is_none() {
            self.fill_loads((pose, rates), pose, &mut scratch);
        }
        let (external, own) = (external(&self.loads, &scratch, model, &pose.into()), self.body_load(pose, rates));
        let [mut u, mut rate, mut inertia] = [(); 3].map(|()| vec![Vec3::zeros(); shell.mass.len()]);
        self.motion.visit_motion(&mut |v, displacement, speed| (u[v], rate[v]) = (displacement, speed));
        for (v, u) in u.iter_mut().enumerate() {
            *u = self.support_at(v).map_or(*u, |x| x - shell.mesh.positions[v]);
        }
        let acting = Acting {
            load: &own,
            external,
            points: None,
            supports: self.heading(),
            axes: pose.into(),
            passage: None,
            again: false,
        };
        self.motion.visit_acceleration(&acting, reactions, &mut |v, a| inertia[v] += shell.mass[v] * a);
        [u, rate, inertia]
    }

    /// F on the full shell at displacements `u` that change by `rate` (n_vertices each, frame axes).
    fn loads_at(&self, u: &[Vec3], rate: &[Vec3]) -> Vec<Vec3> {
        let (model, pose, rates) = (&self.model, &self.frame.pose, &self.rates);
        let shell = &model.shell;
        let mut scratch = self.scratch.clone();
        if self.loads.point_forces(shell.mass.len()).is_none() {
            if self.loads.needs_motion() {
                let mut place = self.placing(pose, rates, &mut scratch);
                (0..u.len()).for_each(|v| place(v, u[v], rate[v]));
            }
            self.press(pose, &mut scratch);
        }
        // The full shell carries its whole weight; modes of a shell that hangs carry what differs from where it hangs.
        let whole = crate::load::BodyLoad::new(self.gravity, pose, rates);
        let on = |v: usize| whole.at(shell.mass[v], shell.mesh.positions[v] + u[v], rate[v]);
        let mut force: Vec<Vec3> = (0..u.len()).map(on).collect();
        let external = external(&self.loads, &scratch, model, &pose.into());
        if let Some(on_all) = external.on_all() {
            force.iter_mut().zip(on_all).for_each(|(f, more)| *f += more);
        }
        external.point_forces().for_each(|(v, more)| force[v as usize] += more);
        force
    }

    /// Vertex, force and torque (frame axes) of each constraint, as the last step had them, and of energies of points.
    fn reactions(&self, points: Option<&InFrame>) -> Vec<Reaction> {
        let to_frame = self.frame.pose.rotation.inverse();
        let reaction = |(c, outcome): (&Constraint, &Outcome)| {
            let pull = to_frame * outcome.force;
            let both =
                if matches!(c.target, Target::Position(_)) { [pull, Vec3::zeros()] } else { [Vec3::zeros(), pull] };
            (c.vertex, both)
        };
        let mut reactions: Vec<Reaction> = self.constraints().map(reaction).collect();
        if let Some(points) = points {
            let x = self.in_frame();
            for (i, point) in points.points().iter().enumerate() {
                let force = -points.gradient_at(i, &point.place(|v| x[v]));
                reactions.extend(point.corners().map(|(v, w)| (v as u32, [w * force, Vec3::zeros()])));
            }
        }
        reactions
    }

    /// The constraints as the full shell has them. Hard ones that are met to rounding hold the shell where it is.
    fn constraints_in_frame(&self, u: &[Vec3]) -> Vec<Constraint> {
        let (mesh, pose) = (&self.model.shell.mesh, &self.frame.pose);
        let turned = self.constraints().any(|(c, _)| matches!(c.target, Target::Orientation(_)));
        let turns: Vec<UnitQuaternion<f64>> = if turned { methods::rotations(mesh, u) } else { vec![] };
        let in_frame = |(c, _): (&Constraint, &Outcome)| {
            let v = c.vertex as usize;
            let missed = |d: Vec3| (0..3).filter(|a| c.axes[*a]).map(|a| d[a].abs()).fold(0.0, f64::max);
            let hard = c.compliance == 0.0;
            let target = match c.target.in_frame(pose) {
                Target::Position(target) => {
                    let place = mesh.positions[v] + u[v];
                    let met = missed(pose.rotation * (target - place)) <= MET * mesh.size;
                    Target::Position(if met && hard { place } else { target })
                }
                Target::Orientation(target) => {
                    let met = missed(pose.rotation * rotation::vector(&(target * turns[v].inverse()))) <= MET;
                    Target::Orientation(if met && hard { turns[v] } else { target })
                }
            };
            Constraint { target, ..*c }
        };
        self.constraints().map(in_frame).collect()
    }
}
fn ratio(a: f64, b: f64) -> f64 {
    if a > 0.0 { a / b.max(f64::MIN_POSITIVE) } else { 0.0 }
}
