//! Motion of a reduced shell that supports leave free: amplitudes of its fields in a frame that floats with it.
//!
//! The frame's place and turn are unknowns beside the amplitudes, and inertia couples them exactly ([`crate::reduced::rigid`]). A shell that
//! nothing holds, or handles alone, slides and turns; one on a row of fixed vertices turns about it. Elastic and viscous forces are those of
//! the fields and do not know of rigid motion.

mod acceleration;
mod passage;
mod place;
mod rows;
mod settle;
mod stage;
mod step;

use super::nodal::{are_angles, extent, rotations};
use super::plan::{Around, Part, PartKind};
use super::reduced::estimate::Estimate;
use super::{Acting, Damping, Motion, Reaction, Watch, WriteRotation, write_rotations};
use crate::constraint::ConstraintSet;
use crate::method::Method;
use crate::modal::ModalBasis;
use crate::point_energy::PointEnergy;
use crate::reduced::{
    Elastic, Form, Moments, Newton, Places, Pull, ReducedShell, Rigid, Rows, WithRigid, Work, with_fields,
};
use crate::reference::Rayleigh;
use crate::reference::orientation::Ring;
use crate::support::Pose;
use crate::warp::{Extent, Placement};
use crate::{Error, ErrorKind, Model, Result, Shell, Vec3};
use nalgebra::{DMatrix, UnitQuaternion};
use place::{Momentum, Place, Rates};
use std::sync::Arc;

/// Past this displacement, in units of the model's size, an amplitude has no meaning left; and the frame's numbers none.
const LARGEST_BEND: f64 = 1e6;
const LARGEST_SLIDE: f64 = 1e12;

/// What a step or an equilibrium reads.
#[derive(Clone, Copy)]
struct At<'a> {
    shell: &'a Shell,
    reduced: &'a ReducedShell,
    rigid: &'a Rigid,
    pose: &'a Pose,
    points: Option<&'a dyn PointEnergy>,
}

impl<'a> At<'a> {
    fn of(shell: &'a Shell, reduced: &'a ReducedShell, rigid: &'a Rigid, acting: &Acting<'a>) -> Self {
        let points = acting.points.map(|points| points as &dyn PointEnergy);
        Self { shell, reduced, rigid, pose: acting.axes.frame, points }
    }
}

/// Room for a step. Vectors of z have the fields' coordinates first, then those of rigid motion.
#[derive(Clone)]
struct Room {
    moments: Moments,
    /// Loads that stay over the step, and all of them at the present guess.
    dead: Pull,
    pull: Pull,
    /// C of the fields.
    viscosity: DMatrix<f64>,
    /// Of the potential beside its shift; b; z; and z of the guess and of where the stage starts.
    matrix: DMatrix<f64>,
    load: Vec<f64>,
    z: Vec<f64>,
    /// Rates of z at the start of a step, after its first stage, and at its end, without those of slides.
    paces: [Vec<f64>; 3],
    guess: Vec<f64>,
    start: Vec<f64>,
}

impl Room {
    fn new(fields: usize, n: usize) -> Self {
        let zeros = vec![0.0; n];
        Self {
            moments: Moments::new(fields),
            dead: Pull::new(fields),
            pull: Pull::new(fields),
            viscosity: DMatrix::zeros(fields, fields),
            matrix: DMatrix::zeros(n, n),
            load: zeros.clone(),
            z: zeros.clone(),
            paces: [zeros.clone(), zeros.clone(), zeros.clone()],
            guess: zeros.clone(),
            start: zeros,
        }
    }
}

/// See the module's text.
#[derive(Clone)]
struct Floating {
    shell: Arc<Shell>,
    /// For damping ratios.
    basis: Arc<ModalBasis>,
    reduced: Arc<ReducedShell>,
    rigid: Arc<Rigid>,
    form: Form,
    fingerprint: u64,
    place: Place,
    rates: Rates,
    /// ξ and ζ.
    damping: Rayleigh,
    /// 2 ratio √λ of each mode that bends the shell.
    modal_damping: Vec<f64>,
    constraints: ConstraintSet,
    /// Steps whose search ended short of its tolerance.
    unconverged: u64,
    /// Of the last step; none before one.
    work: Work,
    estimate: Estimate,
    newton: Newton,
    rows: Rows,
    /// The triangles at each vertex whose orientation is held, made when a step first needs them.
    rings: Vec<(u32, Ring)>,
    /// Of the points with an energy of their own, in the body and as the guess has them.
    body: Places,
    points: Places,
    /// Where a stage starts from, with its momenta; where it began; its end.
    from: Place,
    with: Momentum,
    elsewhere: Momentum,
    began: Place,
    next: Place,
    next_rates: Rates,
    /// Where a step began whose first stages stand.
    begins: (Place, Rates),
    room: Room,
}

/// At rest, undamped.
pub(super) fn build(model: &Model, form: Form, rigid: &Rigid) -> Result<Box<dyn Motion>> {
    let reduced = model.require_reduced()?;
    let (fields, n) = (reduced.n(), reduced.n() + rigid.n());
    let (place, rates) = (Place::rest(fields), Rates::rest(fields));
    Ok(Box::new(Floating {
        shell: model.shell.clone(),
        basis: model.modal.clone(),
        reduced: reduced.clone(),
        rigid: Arc::new(rigid.clone()),
        form,
        fingerprint: model.reduced_fingerprint,
        damping: Rayleigh::default(),
        modal_damping: vec![0.0; model.modal.n_modes() - model.modal.zero_modes],
        constraints: ConstraintSet::default(),
        unconverged: 0,
        work: Work::default(),
        estimate: Estimate::none(n),
        newton: Newton::new(&WithRigid { energy: reduced.elastic(form), rigid: rigid.n() }),
        rows: Rows::new(0, n),
        rings: vec![],
        body: Places::none(),
        points: Places::none(),
        from: place.clone(),
        with: Momentum::rest(fields),
        elsewhere: Momentum::rest(fields),
        began: place.clone(),
        next: place.clone(),
        next_rates: rates.clone(),
        begins: (place.clone(), rates.clone()),
        room: Room::new(fields, n),
        place,
        rates,
    }))
}

impl Floating {
    fn n(&self) -> usize {
        self.reduced.n()
    }

    /// Bytes held.
    fn bytes(&self) -> usize {
        let (n, rows) = (self.room.z.len(), self.rows.len());
        8 * (5 * n * n + 60 * n + rows * (2 * n + rows + 4))
    }

    /// E.
    fn elastic(&self) -> &dyn Elastic {
        self.reduced.elastic(self.form)
    }

    /// Where a position of the body, as it is stored, comes to in the frame.
    fn outward(&self) -> Placement {
        let turn = *self.place.turn.to_rotation_matrix().matrix();
        Placement { origin: self.rigid.pivot + self.place.slide - turn * self.rigid.pivot, rotation: Some(turn) }
    }

    /// A position of the body, placed.
    fn placing(&self, placement: &Placement) -> Placement {
        let own = self.outward();
        let rotation = match (placement.rotation, own.rotation) {
            (Some(outer), Some(inner)) => Some(outer * inner),
            (_, inner) => inner,
        };
        Placement { origin: placement.place(own.origin), rotation }
    }

    /// Bq of every vertex.
    fn bent(&self) -> Vec<Vec3> {
        let mut u = vec![Vec3::zeros(); self.shell.mass.len()];
        with_fields!(&self.reduced.fields, fields => fields.displacements(&self.place.q, |v, at| u[v] = at));
        u
    }

    /// Displacements from rest in the frame.
    fn displacements(&self) -> Vec<Vec3> {
        let mut u = vec![Vec3::zeros(); self.shell.mass.len()];
        self.visit_motion(&mut |v, at, _| u[v] = at);
        u
    }

    fn is_within_range(&self, place: &Place, rates: &Rates) -> bool {
        let size = self.shell.mesh.size;
        let largest = LARGEST_BEND * size * self.shell.total_mass.sqrt();
        let speeds: f64 = rates.q.iter().map(|v| v * v).sum();
        let rigid = rates.slide.norm_squared() + rates.spin.norm_squared() * (1.0 + size * size);
        (speeds + rigid * self.shell.total_mass.max(1.0)).is_finite()
            && place.q.iter().all(|q| q.abs() <= largest)
            && place.slide.amax() <= LARGEST_SLIDE * size
            && place.turn.coords.iter().all(|c| c.is_finite())
    }

    /// ½ M v² + ½ ωᵀJω + ω·Hq̇ + ½ q̇ᵀq̇ at rates whose moments are in the room.
    fn kinetic(&self, rates: &Rates) -> f64 {
        let moments = &self.room.moments;
        let slide = if self.rigid.slides { self.rigid.mass * rates.slide.norm_squared() } else { 0.0 };
        let turn = rates.spin.dot(&(moments.momentum(&rates.spin) + moments.carried));
        0.5 * (slide + turn + rates.q.iter().map(|v| v * v).sum::<f64>())
    }

    /// Creases that are bent beyond their yield angle rest at another one from here on.
    fn yield_creases(&mut self) {
        let Self { reduced, place, newton, .. } = self;
        if reduced.energy.yielding().is_some()
            && let Some(angles) = reduced.energy.yielded(&place.q, newton.scratch().own())
        {
            self.set_rest_angles(&angles);
        }
    }

    fn plan_shell(&self) -> Part {
        let n = self.room.z.len();
        let nanoseconds = self.step_nanoseconds() as f64;
        let reason = format!("{} fields and {} rigid motions in a frame that floats", self.n(), self.rigid.n());
        let bytes = self.reduced.bytes() + self.bytes();
        Part {
            kind: PartKind::ReducedShell,
            active: true,
            bytes,
            operations: 3.0 * nanoseconds + (n * n) as f64,
            reason,
        }
    }
}

impl Motion for Floating {
    fn method(&self) -> Method {
        match self.form {
            Form::Sampled => Method::ReducedShell,
            Form::Polynomial => Method::PolynomialShell,
        }
    }

    fn try_clone(&self) -> Result<Box<dyn Motion>> {
        Ok(Box::new(self.clone()))
    }

    fn reset(&mut self) {
        (self.place, self.rates) = (Place::rest(self.n()), Rates::rest(self.n()));
        self.constraints.reset();
        self.unconverged = 0;
        self.work = Work::default();
        self.estimate.forget();
        if let Some(made) = self.reduced.energy.yielding().map(|yielding| yielding.made().clone()) {
            self.set_rest_angles(&made);
        }
    }

    fn is_held(&self) -> bool {
        !self.rigid.slides
    }

    fn stop(&mut self) {
        self.estimate.forget();
        self.rates = Rates::rest(self.n());
    }

    fn step(&mut self, acting: &Acting, h: f64) -> Result<()> {
        self.advance_by(acting, h)?;
        self.yield_creases();
        Ok(())
    }

    fn settle(&mut self, acting: &Acting, watch: &mut Watch) -> Result<(f64, usize)> {
        let found = self.find_equilibrium(acting, watch)?;
        self.yield_creases();
        Ok(found)
    }

    fn project_from(&mut self, u: &[Vec3], rate: &[Vec3]) -> Result<()> {
        let (place, rates) = self.nearest(u, rate);
        if !self.is_within_range(&place, &rates) {
            return Err(Error::new(ErrorKind::Numerical, "the pose is beyond what the fields can tell"));
        }
        (self.place, self.rates) = (place, rates);
        self.estimate.forget();
        Ok(())
    }

    fn step_nanoseconds(&self) -> u64 {
        2 * self.reduced.step_nanoseconds(self.form) + 30 * (self.n() * self.n()) as u64
    }

    fn unknowns(&self) -> [Vec<f64>; 2] {
        let mut unknowns = [vec![], vec![]];
        self.copy_unknowns(&mut unknowns);
        unknowns
    }

    /// Behind the fields' come the slide and a quaternion; velocities, spin about the body's axes, and a zero. Then rest angles of creases that yield,
    /// with zeros for rates.
    fn copy_unknowns(&self, into: &mut [Vec<f64>; 2]) {
        let [places, rates] = into;
        places.clone_from(&self.place.q);
        places.extend(self.place.slide.iter().chain(self.place.turn.coords.iter()));
        rates.clone_from(&self.rates.q);
        rates.extend(self.rates.slide.iter().chain(self.rates.spin.iter()).chain(&[0.0]));
        if let Some(yielding) = self.reduced.energy.yielding() {
            places.extend(yielding.rest_angles());
            rates.resize(places.len(), 0.0);
        }
    }

    fn expect_points(&mut self, n: usize) {
        self.body.expect(self.n(), n);
        self.points.expect(self.room.z.len(), n);
    }

    fn set_unknowns(&mut self, [places, rates]: [&[f64]; 2]) {
        let n = self.n() + place::RIGID_UNKNOWNS;
        self.place.set(&places[..n]);
        self.rates.set(&rates[..n]);
        self.set_rest_angles(&places[n..]);
        self.estimate.forget();
    }

    fn n_unknowns(&self) -> usize {
        self.n() + place::RIGID_UNKNOWNS + self.reduced.energy.n_yielding()
    }

    fn rest_angles(&self) -> Vec<f64> {
        self.reduced.energy.yielding().map_or(vec![], |yielding| yielding.rest_angles().to_vec())
    }

    fn set_rest_angles(&mut self, angles: &[f64]) {
        if ReducedShell::set_rest_angles(&mut self.reduced, angles) {
            self.newton.scratch().forget();
        }
    }

    fn is_representable(&self, unknowns: [&[f64]; 2]) -> bool {
        let (mut place, mut rates) = (Place::rest(self.n()), Rates::rest(self.n()));
        let n = self.n() + place::RIGID_UNKNOWNS;
        place.set(&unknowns[0][..n]);
        rates.set(&unknowns[1][..n]);
        are_angles(&unknowns[0][n..])
            && (place.turn.coords.norm() - 1.0).abs() <= place::UNIT
            && self.is_within_range(&place, &rates)
    }

    fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    fn set_damping(&mut self, damping: &Damping) -> Result<bool> {
        if !damping.factors.is_empty() {
            let message = "a reduced shell that moves freely takes no damping by vertices: use the full shell";
            return Err(Error::new(ErrorKind::Unsupported, message));
        }
        self.modal_damping = damping.by_ratio(&self.basis)?.split_off(self.basis.zero_modes);
        self.damping = Rayleigh { mass: damping.mass_coefficient, stiffness: damping.stiffness_coefficient };
        Ok(true)
    }

    fn constraints(&self) -> &ConstraintSet {
        &self.constraints
    }

    fn change_constraints(&mut self, change: &mut dyn FnMut(&mut ConstraintSet)) {
        change(&mut self.constraints);
        let rows = self.constraints.report().map(|(c, _)| c.axes.iter().filter(|held| **held).count()).sum();
        if self.rows.len() != rows {
            self.rows = Rows::new(rows, self.room.z.len());
            self.newton.make_room(rows);
        }
    }

    fn positions(&self, placement: &Placement, write: &mut dyn FnMut(usize, &[[f64; 3]])) {
        let (rest, placement) = (&self.shell.mesh.positions, self.placing(placement));
        let place = |v: usize, u: Vec3| write(v, &[placement.place(rest[v] + u).into()]);
        with_fields!(&self.reduced.fields, fields => fields.displacements(&self.place.q, place));
    }

    fn positions_f32(&self, placement: &Placement, write: &mut dyn FnMut(usize, &[[f32; 3]])) {
        let placement = self.placing(placement);
        with_fields!(&self.reduced.fields, fields => fields.positions_f32(&self.place.q, &placement, write));
    }

    fn positions_of(&self, placement: &Placement, vertices: &[u32], write: &mut dyn FnMut(usize, [f64; 3])) {
        let placement = self.placing(placement);
        let rest = |i: usize| self.shell.mesh.positions[vertices[i] as usize];
        let place = |i: usize, u: Vec3| write(i, placement.place(rest(i) + u).into());
        with_fields!(&self.reduced.fields, fields => fields.displacements_of(&self.place.q, vertices, place));
    }

    fn positions_of_f32(&self, placement: &Placement, vertices: &[u32], write: &mut dyn FnMut(usize, [f32; 3])) {
        let placement = self.placing(placement);
        with_fields!(&self.reduced.fields, fields =>
            fields.positions_of_f32(&self.place.q, &placement, vertices, write));
    }

    /// The mean rotation of the vertex's triangles.
    fn rotations(&self, frame: UnitQuaternion<f64>, write: &mut WriteRotation) -> Result<()> {
        write_rotations(rotations(&self.shell.mesh, &self.bent()), frame * self.place.turn, write)
    }

    fn visit_motion(&self, visit: &mut dyn FnMut(usize, Vec3, Vec3)) {
        let (place, rates, pivot) = (&self.place, &self.rates, self.rigid.pivot);
        let (turn, rest) = (place.turn.to_rotation_matrix(), &self.shell.mesh.positions);
        let mut moved = |v: usize, u: Vec3, u_dot: Vec3| {
            let y = rest[v] - pivot + u;
            let x = pivot + place.slide + turn * y;
            visit(v, x - rest[v], rates.slide + turn * (rates.spin.cross(&y) + u_dot));
        };
        with_fields!(&self.reduced.fields, fields => fields.motion(&place.q, &rates.q, &mut moved));
    }

    fn visit_acceleration(&self, acting: &Acting, reactions: &[Reaction], visit: &mut dyn FnMut(usize, Vec3)) {
        let mut probe = self.clone();
        let all = self.acceleration(&mut probe, acting, reactions);
        let (fields, rigid) = all.split_at(self.n());
        let (alpha, slide) = (self.rigid.turn(rigid), self.rigid.slide(rigid));
        let (place, rates, spin) = (&self.place, &self.rates, self.rates.spin);
        let (turn, rest) = (place.turn.to_rotation_matrix(), &self.shell.mesh.positions);
        let mut bend = vec![Vec3::zeros(); rest.len()];
        with_fields!(&self.reduced.fields, fields_of => fields_of.displacements(fields, |v, a| bend[v] = a));
        let mut moved = |v: usize, u: Vec3, u_dot: Vec3| {
            let y = rest[v] - self.rigid.pivot + u;
            let turning = alpha.cross(&y) + spin.cross(&(spin.cross(&y) + 2.0 * u_dot));
            visit(v, turn * (slide + turning + bend[v]));
        };
        with_fields!(&self.reduced.fields, fields => fields.motion(&place.q, &rates.q, &mut moved));
    }

    fn largest_displacement(&self) -> f64 {
        self.place.slide.amax() + LARGEST_BEND * self.shell.mesh.size
    }

    fn extent(&self) -> Extent {
        extent(&self.shell.mesh, &self.displacements())
    }

    /// E and T.
    fn energies(&self) -> (f64, f64) {
        let energy = self.elastic();
        let mut probe = self.clone();
        self.reduced.set_moments(&self.rigid, (&self.place.q, &self.rates.q), &mut probe.room.moments);
        (energy.value(&self.place.q, &mut energy.scratch()), probe.kinetic(&self.rates))
    }

    fn step_error(&self) -> f64 {
        self.estimate.length(&self.newton, self.shell.total_mass)
    }

    fn unconverged_steps(&self) -> u64 {
        self.unconverged
    }

    fn plan(&self, around: &Around) -> Vec<Part> {
        let n = self.room.z.len();
        let modes = around.unused_modes([
            "the reduced shell has fields of its own; the model holds them",
            "the reduced shell does not warp; the model holds them",
        ]);
        let summed = "sums over the vertices taken once";
        let loads = around.cheap_loads([summed, summed]);
        let forces = around.forces_and_wind(60.0 * n as f64, 0.0);
        let own = [
            Part::absent(PartKind::Modes, "the reduced shell moves by its fields"),
            around.constraints(&self.constraints, n),
            self.plan_shell(),
        ];
        around.with_the_rest(own.into_iter().chain(modes).chain(loads).chain(forces))
    }
}
