//! Motion in modal coordinates: the warp, rotation–strain reconstruction and linear modal analysis.

use crate::constraint::{ConstraintSet, Constraints, Step};
use crate::features::Feature;
use crate::load::{BodyLoad, External};
use crate::modal::{AnyBasis, ModalBasis, with_basis};
use crate::step::guard::Pull;
use crate::step::modal_force::{self, Acting, Scratch};
use crate::step::point_force;
use crate::step::{ForceLaw, Integrator, Oscillator};
use crate::strain::{self, RotationStrain};
use crate::support::{Pose, Rates};
use crate::warp::{self, Amplitudes, Extent, Placement, visit_turns};
use crate::{Error, ErrorKind, Result, Vec3};
use std::sync::Arc;

/// Past this rotation, rad, or this displacement, in units of 1/√M, an amplitude has no meaning left and f32 no room.
const LARGEST_ROTATION: f64 = 1e6;
const LARGEST_AMPLITUDE: f64 = 1e30;

/// In a spinning frame the load is taken at the middle of the step: at its start the Coriolis force would lag by half a step and
/// feed energy into one sense of whirling, without bound. Elsewhere the start will do (paper). The middle is found by fixed
/// point, each pass of which gains a factor ωh: enough passes to keep a whirling tube's energy to 5 % over 3000 steps.
pub fn midpoint_passes(load: &BodyLoad, h: f64) -> usize {
    match load.spin_rate().map(|rate| rate * h) {
        None => 0,
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

/// Seconds; its square times any elastic eigenvalue is beyond all rounding.
const LONG_STEP: f64 = 1e9;

/// Room for projections in the precision that the basis is computed with.
#[derive(Clone)]
enum AnyScratch {
    F32(Scratch<f32>),
    F64(Scratch<f64>),
}

/// Amplitudes and what acts on them.
#[derive(Clone)]
pub struct Modal {
    pub law: ForceLaw,
    pub integrator: Integrator,
    /// c of each mode.
    pub damping: Vec<f64>,
    pub constraints: Constraints,
    pub constraint_work: f64,
    pub q: Vec<f64>,
    pub q_dot: Vec<f64>,
    /// The next q and q̇ until they are known to be good, and the modal force.
    next: [Vec<f64>; 2],
    force: Vec<f64>,
    pull: Pull,
    scratch: AnyScratch,
    /// Instead of the warp.
    strain: Option<(Arc<RotationStrain>, strain::Scratch)>,
    /// The state that loads are taken at.
    mean: [Vec<f64>; 2],
    /// The last step left every bit as it was.
    pub unchanged: bool,
}

impl Modal {
    /// At rest, undamped.
    pub fn new(modal: &ModalBasis, law: ForceLaw, integrator: Integrator) -> Self {
        let modes = modal.n_modes();
        let zeros = vec![0.0; modes];
        modal.participation(); // now: a step does not allocate
        let scratch = match modal.basis {
            AnyBasis::F32(_) | AnyBasis::I16(_) => AnyScratch::F32(Scratch::new(modes)),
            AnyBasis::F64(_) => AnyScratch::F64(Scratch::new(modes)),
        };
        Self {
            law,
            integrator,
            damping: zeros.clone(),
            constraints: Constraints::new(modes),
            constraint_work: 0.0,
            q: zeros.clone(),
            q_dot: zeros.clone(),
            next: [zeros.clone(), zeros.clone()],
            force: zeros.clone(),
            pull: Pull::default(),
            scratch,
            strain: None,
            mean: [zeros.clone(), zeros],
            unchanged: false,
        }
    }

    /// As [`Modal::new`], with positions and forces by the rotation–strain reconstruction `map`.
    pub fn rotation_strain(modal: &ModalBasis, map: Arc<RotationStrain>, integrator: Integrator) -> Self {
        let scratch = map.scratch(modal);
        Self { strain: Some((map, scratch)), ..Self::new(modal, ForceLaw::VirtualWork, integrator) }
    }

    /// The map of rotation–strain reconstruction, if that is how it moves.
    pub fn strain(&self) -> Option<&RotationStrain> {
        self.strain.as_ref().map(|(map, _)| &**map)
    }

    /// Back to rest.
    pub fn reset(&mut self) {
        self.q.fill(0.0);
        self.q_dot.fill(0.0);
        self.constraints.change(ConstraintSet::reset);
        self.constraint_work = 0.0;
    }

    /// Whether amplitudes `q` give finite positions in any precision, and the energies can be told.
    pub fn has_meaning(&self, modal: &ModalBasis, q: &[f64], q_dot: &[f64]) -> bool {
        let largest = LARGEST_AMPLITUDE * modal.shell.total_mass.sqrt();
        let (elastic, kinetic) = self.energies_at(modal, q, q_dot);
        let turns = self.law.warped() && modal.bend(true).largest(q) > LARGEST_ROTATION;
        let bounded = !turns && q.iter().all(|q| q.abs() <= largest);
        bounded && elastic.is_finite() && kinetic.is_finite()
    }

    /// Replaces q and q̇, finite and of the right number.
    pub fn set_amplitudes(&mut self, modal: &ModalBasis, q: &[f64], q_dot: &[f64]) -> Result<()> {
        if !self.has_meaning(modal, q, q_dot) {
            return Err(Error::new(ErrorKind::Numerical, "these amplitudes turn or move vertices beyond all range"));
        }
        self.q.copy_from_slice(q);
        self.q_dot.copy_from_slice(q_dot);
        Ok(())
    }

    /// One step of `h` under `load` and `external` forces. Changes nothing on failure.
    pub fn step(&mut self, modal: &ModalBasis, load: &BodyLoad, external: External, pose: &Pose, h: f64) -> Result<()> {
        self.mean[0].copy_from_slice(&self.q);
        self.mean[1].copy_from_slice(&self.q_dot);
        self.project_load(modal, load, external);
        self.move_freely(modal, h);
        for _ in 0..midpoint_passes(load, h) {
            for (mean, (now, next)) in self.mean.iter_mut().zip([&self.q, &self.q_dot].into_iter().zip(&self.next)) {
                mean.iter_mut().zip(now.iter().zip(next)).for_each(|(mean, (a, b))| *mean = 0.5 * (a + b));
            }
            self.project_load(modal, load, external);
            self.move_freely(modal, h);
        }
        let work = self.meet_constraints(modal, pose, h);
        let told = (self.constraint_work + work).is_finite() && self.constraints.set().is_finite();
        if !told || !self.has_meaning(modal, &self.next[0], &self.next[1]) {
            return Err(Error::new(
                ErrorKind::Numerical,
                format!("the step of {h:?} s does not give finite positions"),
            ));
        }
        self.unchanged = work == 0.0 && self.next == [&*self.q, &*self.q_dot] && self.constraints.set().is_unchanged();
        let [next_q, next_q_dot] = &mut self.next;
        std::mem::swap(&mut self.q, next_q);
        std::mem::swap(&mut self.q_dot, next_q_dot);
        self.constraint_work += work;
        self.constraints.change(ConstraintSet::accept);
        Ok(())
    }

    /// The modal force at the mean state: of an acceleration that acts everywhere alike by sums taken once where these suffice,
    /// else over all vertices; and of forces on some vertices.
    fn project_load(&mut self, modal: &ModalBasis, load: &BodyLoad, external: External) {
        if self.strain.is_some() {
            return self.project_by_strain(modal, load, external);
        }
        let Self { law, mean: [q, q_dot], force, scratch, .. } = self;
        let total_mass = modal.shell.total_mass;
        let participation = modal.participation();
        let shortened =
            external.on_all().is_none() && participation.suffices(*law, || modal.bend(law.warped()).largest(q));
        self.pull = match (load.everywhere_alike(), &modal.basis, scratch) {
            (Some(a), _, _) if shortened => {
                participation.force(*law, a, q, force);
                Pull { body: a.norm(), ..Pull::default() }
            }
            (_, basis, scratch) => {
                let acting = Acting { load, external: external.on_all(), law: *law, q, q_dot, total_mass };
                match (basis, scratch) {
                    (AnyBasis::F32(basis), AnyScratch::F32(scratch)) => {
                        modal_force::project(basis, &acting, scratch, force)
                    }
                    (AnyBasis::F64(basis), AnyScratch::F64(scratch)) if Feature::F64Basis.is_built_in() => {
                        modal_force::project(basis, &acting, scratch, force)
                    }
                    (AnyBasis::I16(basis), AnyScratch::F32(scratch)) if Feature::I16Basis.is_built_in() => {
                        modal_force::project(basis, &acting, scratch, force)
                    }
                    _ => unreachable!("a state's scratch has its modal's precision"),
                }
            }
        };
        if *law == ForceLaw::VirtualWork {
            self.pull.reach = q.iter().zip(participation.reach()).map(|(q, reach)| reach * q.abs()).sum();
        }
        self.pull.external +=
            with_basis!(&modal.basis, basis => point_force::add(basis, *law, q, external.on_some(), force));
    }

    /// The same by rotation–strain reconstruction.
    fn project_by_strain(&mut self, modal: &ModalBasis, load: &BodyLoad, external: External) {
        let Some((map, scratch)) = &mut self.strain else { return };
        let [q, q_dot] = &self.mean;
        self.pull = map.project(modal, (load, external), (q, q_dot), scratch, &mut self.force);
        self.pull.reach = q.iter().zip(modal.participation().reach()).map(|(q, reach)| reach * q.abs()).sum();
    }

    /// The next q and q̇ without constraints.
    fn move_freely(&mut self, modal: &ModalBasis, h: f64) {
        let guard = modal.guard(self.law.warped());
        let [next_q, next_q_dot] = &mut self.next;
        let damping = |k: usize| match self.law.warped() {
            true => guard.damping(k, self.damping[k], &self.pull, h),
            false => self.damping[k],
        };
        for k in 0..self.q.len() {
            let oscillator = Oscillator { damping: damping(k), eigenvalue: modal.eigenvalues[k] };
            (next_q[k], next_q_dot[k]) =
                oscillator.advance(self.integrator, self.q[k], self.q_dot[k], self.force[k], h);
        }
        let held = guard.hold(damping, h, next_q, next_q_dot);
        if held && self.integrator == Integrator::Exact {
            guard.limit(&self.force, (&self.q, &self.q_dot), next_q, next_q_dot);
        }
        next_q.iter_mut().chain(next_q_dot).filter(|x| x.abs() < NEGLIGIBLE).for_each(|x| *x = 0.0);
    }

    /// Moves the next q and q̇ to where the constraints are met; returns the work done.
    fn meet_constraints(&mut self, modal: &ModalBasis, pose: &Pose, h: f64) -> f64 {
        let Self { law, integrator, constraints, damping, q, next: [next_q, next_q_dot], strain, .. } = self;
        if constraints.set().is_empty() {
            return 0.0;
        }
        let mesh = &modal.shell.mesh;
        let step = Step {
            pose,
            h,
            integrator: *integrator,
            modes: (damping, &modal.eigenvalues),
            rest: &mesh.positions,
            size: mesh.size,
            bend: modal.bend(law.warped()),
            warped: law.warped(),
            strain: strain.as_ref().map(|(map, _)| (&**map, modal)),
        };
        with_basis!(&modal.basis, basis => constraints.project(basis, &step, q, (next_q, next_q_dot)))
    }

    /// An upper bound of every vertex's rotation, rad, or without the warp of its displacement in modal sizes.
    pub fn largest_bend(&self, modal: &ModalBasis) -> f64 {
        modal.bend(self.law.warped()).largest(&self.q)
    }

    /// How far any vertex can still move, to first order, under the forces of the last step: see the text of `rest`. `None`
    /// where handles act, and for a shell that drifts.
    pub fn motion_left(&self, modal: &ModalBasis) -> Option<f64> {
        let left = |(k, lambda): (usize, &f64)| {
            let swing = if *lambda > 0.0 {
                (self.q[k] - self.force[k] / lambda).hypot(self.q_dot[k] / lambda.sqrt())
            } else if self.q_dot[k] == 0.0 && self.force[k] == 0.0 {
                0.0
            } else {
                f64::INFINITY
            };
            swing * modal.participation().reach()[k]
        };
        self.constraints.set().is_empty().then(|| modal.eigenvalues.iter().enumerate().map(left).sum())
    }

    fn amplitudes(&self) -> Amplitudes<'_> {
        Amplitudes { q: &self.q, warped: self.law.warped() }
    }

    /// Hands the positions of all vertices to `write`, in order: the first vertex of some, and their rows.
    pub fn positions(&self, modal: &ModalBasis, placement: &Placement, write: impl FnMut(usize, &[[f64; 3]])) {
        self.positions_at((modal, &self.q), placement, write);
    }

    /// The same at amplitudes `q`.
    pub fn positions_at(
        &self,
        (modal, q): (&ModalBasis, &[f64]),
        placement: &Placement,
        write: impl FnMut(usize, &[[f64; 3]]),
    ) {
        if let Some(strain) = self.strain() {
            return strain.positions((modal, q), placement, write);
        }
        let rest = &modal.shell.mesh.positions;
        let amplitudes = Amplitudes { q, warped: self.law.warped() };
        with_basis!(&modal.basis, basis => warp::visit_positions_f64(basis, amplitudes, (rest, placement), write));
    }

    /// As [`Modal::positions`], in the basis's precision and rounded to f32.
    pub fn positions_f32(&self, modal: &ModalBasis, placement: &Placement, write: impl FnMut(usize, &[[f32; 3]])) {
        if let Some(strain) = self.strain() {
            return strain.positions_f32((modal, &self.q), placement, write);
        }
        with_basis!(&modal.basis, basis => warp::visit_positions_f32(basis, self.amplitudes(), placement, write));
    }

    /// The positions of some vertices, to the same bits: the place in the list, and the row.
    pub fn positions_of(
        &self,
        modal: &ModalBasis,
        placement: &Placement,
        vertices: &[u32],
        write: impl FnMut(usize, [f64; 3]),
    ) {
        if let Some(strain) = self.strain() {
            return strain.positions_of((modal, &self.q), placement, vertices, write);
        }
        let rest = &modal.shell.mesh.positions;
        with_basis!(&modal.basis, basis =>
            warp::visit_positions_of_f64(basis, self.amplitudes(), (rest, placement), vertices, write));
    }

    /// As [`Modal::positions_of`], for [`Modal::positions_f32`].
    pub fn positions_of_f32(
        &self,
        modal: &ModalBasis,
        placement: &Placement,
        vertices: &[u32],
        write: impl FnMut(usize, [f32; 3]),
    ) {
        if let Some(strain) = self.strain() {
            return strain.positions_of_f32((modal, &self.q), placement, vertices, write);
        }
        with_basis!(&modal.basis, basis =>
            warp::visit_positions_of_f32(basis, self.amplitudes(), placement, vertices, write));
    }

    /// How far it is bent; `limit` is a |w|².
    pub fn extent(&self, modal: &ModalBasis, limit: f64) -> Extent {
        let extent = with_basis!(&modal.basis, basis => warp::extent(basis, self.amplitudes(), limit));
        match self.strain() {
            Some(strain) => Extent { displacement: strain.reach(modal, &self.q), ..extent },
            None => extent,
        }
    }

    /// Hands the rotation vector w (frame axes) of every vertex to `visit`, in order.
    pub fn visit_turns(&self, modal: &ModalBasis, visit: impl FnMut(usize, Vec3)) {
        with_basis!(&modal.basis, basis => visit_turns(basis, &self.q, visit));
    }

    /// Hands displacement u and its rate u̇ (frame axes) of every vertex to `visit`, in order.
    pub fn visit_motion(&self, modal: &ModalBasis, visit: impl FnMut(usize, Vec3, Vec3)) {
        if let Some(strain) = self.strain() {
            return strain.visit_motion(modal, (&self.q, &self.q_dot), visit);
        }
        with_basis!(&modal.basis, basis => modal_force::visit_motion(basis, self.law, (&self.q, &self.q_dot), visit));
    }

    /// Hands J g of every vertex to `visit`, in order: see the text of `certify`. `grips` are the forces and torques of constraints.
    pub fn visit_acceleration(
        &self,
        modal: &ModalBasis,
        load: &BodyLoad,
        external: External,
        grips: &[(u32, [Vec3; 2])],
        mut visit: impl FnMut(usize, Vec3),
    ) {
        let mut probe = self.clone();
        probe.mean = [self.q.clone(), self.q_dot.clone()];
        probe.project_load(modal, load, external);
        let mut g = probe.force;
        // Constraints act by virtual work whatever the law of the loads.
        let pulls: Vec<_> = grips.iter().map(|(v, [force, _])| (*v, *force)).collect();
        self.pull_back(modal, &self.q, &pulls, &mut g);
        for (k, g) in g.iter_mut().enumerate() {
            *g -= modal.eigenvalues[k] * self.q[k];
            *g += grips.iter().map(|(v, [_, torque])| modal.mode_at(k, *v as usize).1.dot(torque)).sum::<f64>();
        }
        modal.guard(self.law.warped()).add_force(&self.q, &mut g);
        match self.strain() {
            Some(strain) => strain.visit_motion(modal, (&self.q, &g), |v, _, a| visit(v, a)),
            None => with_basis!(&modal.basis, basis =>
                modal_force::visit_motion(basis, self.law, (&self.q, &g), |v, _, a| visit(v, a))),
        }
    }

    /// The law whose J is the derivative of the positions.
    fn tangent_law(&self) -> ForceLaw {
        if self.law.warped() { ForceLaw::VirtualWork } else { ForceLaw::Linear }
    }

    /// Displacements and their rates as positions move: (∂u/∂q) q̇ by any law.
    pub fn visit_visible_motion(&self, modal: &ModalBasis, visit: impl FnMut(usize, Vec3, Vec3)) {
        self.visit_visible(modal, (&self.q, &self.q_dot), visit);
    }

    /// The same at amplitudes and rates `motion`.
    pub fn visit_visible(&self, modal: &ModalBasis, motion: (&[f64], &[f64]), visit: impl FnMut(usize, Vec3, Vec3)) {
        match self.strain() {
            Some(strain) => strain.visit_motion(modal, motion, visit),
            None => with_basis!(&modal.basis, basis =>
                modal_force::visit_motion(basis, self.tangent_law(), motion, visit)),
        }
    }

    /// Adds (∂u/∂q)ᵀ of forces on vertices (frame axes) at amplitudes `q` to `along` (modes). Allocates.
    pub fn pull_back(&self, modal: &ModalBasis, q: &[f64], forces: &[(u32, Vec3)], along: &mut [f64]) {
        let Some(strain) = self.strain() else {
            let (law, forces) = (self.tangent_law(), forces.iter().copied());
            with_basis!(&modal.basis, basis => point_force::add(basis, law, q, forces, along));
            return;
        };
        let nothing = BodyLoad::new(Vec3::zeros(), &Pose::identity(), &Rates::default());
        let loads = (&nothing, External::OnSome(forces, Pose::identity().rotation));
        let mut pulled = vec![0.0; q.len()];
        strain.project(modal, loads, (q, q), &mut strain.scratch(modal), &mut pulled);
        along.iter_mut().zip(pulled).for_each(|(sum, force)| *sum += force);
    }

    /// ½ qᵀΛq with the guard's share, and ½ q̇ᵀq̇.
    pub fn energies(&self, modal: &ModalBasis) -> (f64, f64) {
        self.energies_at(modal, &self.q, &self.q_dot)
    }

    fn energies_at(&self, modal: &ModalBasis, q: &[f64], q_dot: &[f64]) -> (f64, f64) {
        let elastic: f64 = q.iter().zip(&modal.eigenvalues).map(|(q, lambda)| lambda * q * q).sum();
        let guard = modal.guard(self.law.warped()).energy(q);
        (0.5 * elastic + guard, 0.5 * q_dot.iter().map(|v| v * v).sum::<f64>())
    }

    /// The static solution Λq = f(q) + Jᵀμ by fixed point, from the present q: a step of backward Euler so long that inertia
    /// and damping vanish gives Λ⁻¹f, and q moves a fraction of the way there, which is halved when the residual grows.
    /// Returns the residual |q − Λ⁻¹f|/|Λ⁻¹f| and the iterations. Changes nothing on failure.
    pub fn settle(
        &mut self,
        modal: &ModalBasis,
        load: &BodyLoad,
        external: External,
        pose: &Pose,
    ) -> Result<(f64, usize)> {
        let start = (self.q.clone(), self.q_dot.clone(), self.integrator, self.constraint_work);
        self.integrator = Integrator::ImplicitEuler;
        let mut outcome = self.fixed_point(modal, load, external, pose);
        // A frame that turns faster than the shell can bear throws it as far as the guard lets it.
        if load.spin_rate().is_some() && modal.guard(self.law.warped()).energy(&self.q) > 0.0 {
            let message = "no equilibrium: the frame's spin bends the shell beyond all range";
            outcome = Err(Error::new(ErrorKind::Numerical, message));
        }
        (self.integrator, self.constraint_work) = (start.2, start.3);
        if outcome.is_err() {
            (self.q, self.q_dot) = (start.0, start.1);
        }
        outcome
    }

    fn fixed_point(
        &mut self,
        modal: &ModalBasis,
        load: &BodyLoad,
        external: External,
        pose: &Pose,
    ) -> Result<(f64, usize)> {
        // What is left of the start by rounding is nothing: where no load is, the solution is zero, and all would be large to it.
        let rounding = f64::EPSILON.powi(2) * self.q.iter().map(|q| q * q).sum::<f64>();
        let (mut fraction, mut last) = (1.0f64, f64::INFINITY);
        for iteration in 1..=SETTLE_ITERATIONS {
            let before = self.q.clone();
            self.q_dot.fill(0.0);
            let grew = |e: Error| Error::new(e.kind, "no equilibrium: the amplitudes grow without bound");
            self.step(modal, load, external, pose, LONG_STEP).map_err(grew)?;
            self.q_dot.fill(0.0);
            let moved: f64 = before.iter().zip(&self.q).map(|(a, b)| (a - b).powi(2)).sum();
            let residual =
                (moved / self.q.iter().map(|q| q * q).sum::<f64>().max(rounding).max(f64::MIN_POSITIVE)).sqrt();
            if residual <= settled(&modal.basis) {
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
