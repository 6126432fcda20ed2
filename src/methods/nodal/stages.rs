//! Steps of second order of the full shell: two stages of backward Euler, as the reduced shells take (`methods/reduced/step.rs`).
//!
//! Their numbers are in `step/stages.rs`, y = (u, u̇). The second stage starts from y + (1 + √2)(y₁ − y), where a shell that turns is stretched. It is
//! searched for from y₁, with the stress there.
//!
//! One step of backward Euler takes their place among contacts and on a rest shape that moves. It does so, too, where the first stage lets go what
//! stiffness drives and the step does not resolve, where a search fails, and where energy comes from nowhere.

use super::Nodal;
use crate::constraint::{Constraint, Target};
use crate::methods::Acting;
use crate::point_energy::PointEnergy;
use crate::reference::{Ring, part_way};
use crate::step::stages::{GAMMA, MISSED, NOTHING, ONWARD, SUDDEN};
use crate::{ErrorKind, Result, Vec3};

/// Of the energies of a step, what it may gain besides: its error is of third order in what it resolves, at most some percent.
const GAIN: f64 = 0.05;

/// What two stages came to.
pub(super) struct Stages {
    pub iterations: usize,
    /// Of constraints.
    pub work: f64,
    /// The root mean square displacement that the step got wrong.
    pub missed: f64,
}

impl Nodal {
    /// Whether a step may have two stages.
    pub(super) fn takes_stages(&self, acting: &Acting) -> bool {
        let sudden = acting.points.is_some_and(|points| points.is_sudden());
        self.second_order && !sudden && !acting.again && self.carried.is_none()
    }

    /// Two stages, under the forces that are set; `None`, and all as before them, where backward Euler is to take their place.
    pub(super) fn stages(&mut self, acting: &Acting, h: f64) -> Result<Option<Stages>> {
        let shared = self.solver.is_sharing();
        if !shared {
            self.solver.share_work(true);
        }
        let done = self.try_stages(acting, h);
        if !shared {
            self.solver.share_work(false);
        }
        let failed = match done {
            Ok(Some(stages)) => return Ok(Some(stages)),
            Ok(None) => None,
            Err(error) if error.kind == ErrorKind::Numerical => None,
            Err(error) => Some(error),
        };
        self.go_back();
        self.set_force(acting)?;
        failed.map_or(Ok(None), Err)
    }

    fn try_stages(&mut self, acting: &Acting, h: f64) -> Result<Option<Stages>> {
        let tau = GAMMA * h;
        let at_start = self.shell.energy.value(&self.bent()) + self.solver.kinetic_energy(&self.velocity);
        let mut iterations = self.stage(acting, (h, tau, GAMMA))?;
        if acting.load.spin_rate().is_some() {
            // What the frame's turning does, at this stage's end.
            self.set_force(acting)?;
            self.solver.step_again();
            self.go_back();
            iterations += self.stage(acting, (h, tau, GAMMA))?;
        }
        if self.relaxes(tau) {
            return Ok(None);
        }
        let work = ONWARD * self.record_outcomes(iterations);
        let first = self.velocity.clone();
        self.go_onward(acting);
        self.solver.second_stage();
        iterations += self.stage(acting, (h, tau, 1.0))?;
        let work = work + self.record_outcomes(iterations);
        let passive = acting.load.spin_rate().is_none() && acting.supports.is_none();
        if passive && self.gains(at_start, work) {
            return Ok(None);
        }
        let rates = self.before[1].iter().zip(&first).zip(&self.velocity);
        let missed: Vec<Vec3> = rates
            .map(|((start, first), end)| MISSED * h * ((end - first) / (1.0 - GAMMA) - (first - start) / GAMMA))
            .collect();
        let missed = (2.0 * self.solver.kinetic_energy(&missed) / self.shell.total_mass).sqrt().min(f64::MAX);
        Ok(Some(Stages { iterations, work, missed }))
    }

    /// Backward Euler over `tau` to the place where constraints and supports are at this share of their way in the step of `h`.
    fn stage(&mut self, acting: &Acting, (h, tau, share): (f64, f64, f64)) -> Result<usize> {
        if let Some(to) = acting.supports {
            for (v, d) in self.supported.iter().map(|v| *v as usize).zip(to.displacement) {
                let way = if to.jump { Vec3::zeros() } else { d - self.before[0][v] };
                (self.u[v], self.velocity[v]) = (d - (1.0 - share) * way, way / h);
            }
        }
        self.solver.join(self.seen_points(acting.points));
        self.pass_constraints(acting.axes.frame, share)?;
        let Self { solver, damping, u, velocity, force, .. } = self;
        Ok(solver.implicit_euler(u, velocity, force, *damping, tau)?.iterations)
    }

    /// Leaves a hard target at a share of its way from where the step begins.
    pub(super) fn lead_part_way(&self, constraint: &mut Constraint, share: f64) {
        let place = |v: u32| self.shell.mesh.positions[v as usize] + self.before[0][v as usize];
        constraint.target = match constraint.target {
            Target::Position(to) => Target::Position(place(constraint.vertex).lerp(&to, share)),
            Target::Orientation(to) => {
                let ring = Ring::of(&self.shell.mesh, constraint.vertex);
                let x: Vec<Vec3> = ring.vertices.iter().map(|v| place(*v)).collect();
                Target::Orientation(part_way(&ring.rotation(&x), &to, share))
            }
        };
    }

    /// Where the step begins.
    fn go_back(&mut self) {
        self.u.copy_from_slice(&self.before[0]);
        self.velocity.copy_from_slice(&self.before[1]);
    }

    /// From the first stage's end to the start of the second, with the forces of its end.
    fn go_onward(&mut self, acting: &Acting) {
        let (rest, mass, turns) = (&self.shell.mesh.positions, &self.shell.mass, acting.load.spin_rate().is_some());
        let [u, rate] = &self.before;
        for v in self.shell.free.iter().map(|v| *v as usize) {
            if turns {
                let at = |u: Vec3, rate: Vec3| acting.load.at(mass[v], rest[v] + u, rate);
                self.force[v] += ONWARD * (at(self.u[v], self.velocity[v]) - at(u[v], rate[v]));
            }
            self.u[v] = u[v] + ONWARD * (self.u[v] - u[v]);
            let gained = ONWARD * (self.velocity[v] - rate[v]);
            self.velocity[v] = rate[v] + gained;
            // The wind's force was that at the rates of the step's start.
            if let Some(drag) = acting.external.drag().get(v) {
                self.force[v] -= drag * gained;
            }
        }
    }

    /// Whether the first stage jumps where stiffness resists, and not inertia.
    fn relaxes(&self, tau: f64) -> bool {
        let shell = &self.shell;
        let [u, rate] = &self.before;
        let (mut jump, mut coasted, mut size) = (0.0, 0.0, 0.0);
        let jumped = |v: usize| self.u[v] - u[v] - tau * rate[v];
        for v in shell.free.iter().map(|v| *v as usize) {
            jump += shell.mass[v] * jumped(v).norm_squared();
            coasted += shell.mass[v] * (tau * rate[v]).norm_squared();
            size += shell.mass[v] * u[v].norm_squared();
        }
        if jump <= SUDDEN * SUDDEN * coasted || jump <= NOTHING * NOTHING * size {
            return false;
        }
        let mut change = vec![Vec3::zeros(); u.len()];
        let start: Vec<Vec3> = shell.mesh.positions.iter().zip(u).map(|(r, u)| r + u).collect();
        shell.energy.add_gradient(&start, &mut change);
        change.iter_mut().for_each(|f| *f = -*f);
        shell.energy.add_gradient(&self.bent(), &mut change);
        let stiff: f64 = shell.free.iter().map(|v| *v as usize).map(|v| jumped(v).dot(&change[v])).sum();
        stiff > jump / (tau * tau)
    }

    /// Whether the shell has more energy than where the step began and what loads and constraints did.
    fn gains(&self, at_start: f64, work: f64) -> bool {
        let at_end = self.shell.energy.value(&self.bent()) + self.solver.kinetic_energy(&self.velocity);
        let moved = self.shell.free.iter().map(|v| *v as usize);
        let loads: f64 = moved.map(|v| self.force[v].dot(&(self.u[v] - self.before[0][v]))).sum();
        let room = at_start.abs() + loads.abs() + work.abs();
        let gained = at_end - at_start - loads - work;
        gained.is_nan() || gained > GAIN * room
    }
}
