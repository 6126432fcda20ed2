//! Motion of the reduced discrete shell: amplitudes of its fields.

mod adaptive;
pub(super) mod estimate;
mod rows;
mod settle;
mod step;

use super::nodal::{extent, rotations};
use super::plan::{AS_BEFORE, Around, BEFORE_ANY, ITERATIONS, Part, PartKind};
use super::{Acting, Damping, Motion, Reaction, Watch, WriteRotation, write_rotations};
use crate::constraint::ConstraintSet;
use crate::features::{Feature, Proof, ReducedShell as Built};
use crate::method::Method;
use crate::modal::ModalBasis;
use crate::point_energy::PointEnergy;
use crate::reduced::{Elastic, Form, Newton, Places, ReducedShell, Rows, Work, sum_of, with_fields};
use crate::reference::Rayleigh;
use crate::reference::orientation::Ring;
use crate::support::Axes;
use crate::warp::{Extent, Placement};
use crate::{Error, ErrorKind, Model, Result, Shell, Vec3};
use adaptive::Adaptive;
use estimate::Estimate;
use nalgebra::{DMatrix, UnitQuaternion};
use rows::{places, ring_of};
use std::sync::Arc;

/// Projection rounds when a shape is set; each adds the digits of B, at least four.
const PROJECTIONS: usize = 4;
/// Past this displacement, in units of the model's size, an amplitude has no meaning left.
const LARGEST_DISPLACEMENT: f64 = 1e6;

/// Of the reduced shell, by [`crate::reduced::ReducedEnergy::operations`]: of a shape, a gradient and a Hessian, and of a
/// multiplication of its factorization.
const REDUCED_SHAPE: [f64; 5] = [600.0, 0.7, 0.0, 0.0, 0.0];
const REDUCED_GRADIENT: [f64; 5] = [30.0, 0.7, 0.0, 0.0, 0.0];
const REDUCED_HESSIAN: [f64; 5] = [5000.0, 0.1, 0.65, 0.65, 0.9];
const REDUCED_FACTOR: f64 = 1.0;
/// Of a multiplication of the polynomial, as counted on AVX2 (see `make bench-instructions`); and of an entry of a matrix, where it is solved
/// with and where it is factorized first.
const POLYNOMIAL: f64 = 0.8;
const POLYNOMIAL_SOLVED: f64 = 10.0;
const POLYNOMIAL_FACTORIZED: f64 = 10.0;
/// What a step takes where none tells.
const WORK: Work = Work { hessians: 1, gradients: ITERATIONS, shapes: ITERATIONS + 1 };
/// Of a vertex with a force of its own, for each field of the reduced shell.
const REDUCED_POINT: f64 = 20.0;

/// q and its rates.
#[derive(Clone)]
struct Coordinates {
    q: Vec<f64>,
    q_dot: Vec<f64>,
}

impl Coordinates {
    fn rest(n: usize) -> Self {
        Self { q: vec![0.0; n], q_dot: vec![0.0; n] }
    }

    fn copy_from(&mut self, q: &[f64], q_dot: &[f64]) {
        self.q.copy_from_slice(q);
        self.q_dot.copy_from_slice(q_dot);
    }
}

/// What a step or an equilibrium reads.
#[derive(Clone, Copy)]
struct At<'a> {
    shell: &'a Shell,
    reduced: &'a ReducedShell,
    axes: Axes<'a>,
    points: Option<&'a dyn PointEnergy>,
}

impl<'a> At<'a> {
    fn of(shell: &'a Shell, reduced: &'a ReducedShell, acting: &Acting<'a>) -> Self {
        let points = acting.points.map(|points| points as &dyn PointEnergy);
        Self { shell, reduced, axes: acting.axes, points }
    }
}

/// Amplitudes and what acts on them.
#[derive(Clone)]
struct Reduced {
    shell: Arc<Shell>,
    /// For damping ratios.
    basis: Arc<ModalBasis>,
    reduced: Arc<ReducedShell>,
    /// In which its energy is now; and of a shell that has both.
    form: Form,
    adaptive: Option<Adaptive>,
    fingerprint: u64,
    motion: Coordinates,
    /// ξ and ζ.
    damping: Rayleigh,
    /// 2 ratio √λ of each mode.
    modal_damping: Vec<f64>,
    /// ξ Bᵀ M f B with factors f of the vertices, in the place of ξ; none without.
    by_vertices: Option<Arc<DMatrix<f64>>>,
    constraints: ConstraintSet,
    /// Steps whose search ended short of its tolerance.
    unconverged: u64,
    /// Whether the search of the last stage ended beyond all numbers.
    overflows: bool,
    /// Of the last step; none before one.
    work: Work,
    estimate: Estimate,
    newton: Newton,
    rows: Rows,
    /// The triangles at each vertex whose orientation is held, made when a step first needs them.
    rings: Vec<(u32, Ring)>,
    /// Of the points with an energy of their own.
    places: Places,
    /// Where a step began of which a stage stands.
    begins: Coordinates,
    /// Next q.
    next: Vec<f64>,
    /// That of the last pass.
    last: Vec<f64>,
    /// b of the potential.
    load: Vec<f64>,
    /// The load without inertia.
    force: Vec<f64>,
    /// Next rates.
    rates: Vec<f64>,
    /// Where a stage starts: q and q̇ of its backward Euler; and a q that the shell can be at.
    from: [Vec<f64>; 2],
    start: Vec<f64>,
    viscosity: DMatrix<f64>,
    /// That of modes alone, where there is no other.
    resistance: Vec<f64>,
}

/// At rest, undamped.
pub fn build(model: &Model, form: Form) -> Result<Box<dyn Motion>> {
    if let Some(rigid) = &model.require_reduced()?.rigid {
        return super::floating::build(model, form, rigid);
    }
    Ok(Box::new(at_rest(model, form)?))
}

/// The same in the form for where it is.
pub fn build_adaptive(model: &Model) -> Result<Box<dyn Motion>> {
    let mut made = at_rest(model, Form::Polynomial)?;
    let range = made.reduced.polynomial.as_ref().map_or(0.0, |polynomial| polynomial.gate.range);
    made.adaptive = Some(Adaptive::new(range, made.reduced.energy.scratch()));
    Ok(Box::new(made))
}

fn at_rest(model: &Model, form: Form) -> Result<Reduced> {
    let _proof: Built = Proof::of(Feature::ReducedShell)?;
    let reduced = model.require_reduced()?;
    let n = reduced.n();
    let zeros = vec![0.0; n];
    Ok(Reduced {
        shell: model.shell.clone(),
        basis: model.modal.clone(),
        reduced: reduced.clone(),
        form,
        adaptive: None,
        fingerprint: model.reduced_fingerprint,
        motion: Coordinates::rest(n),
        damping: Rayleigh::default(),
        modal_damping: vec![0.0; model.modal.n_modes()],
        by_vertices: None,
        constraints: ConstraintSet::default(),
        unconverged: 0,
        overflows: false,
        work: Work::default(),
        estimate: Estimate::none(n),
        newton: Newton::new(reduced.elastic(form)),
        rows: Rows::new(0, n),
        rings: vec![],
        places: Places::none(),
        begins: Coordinates::rest(n),
        next: zeros.clone(),
        last: zeros.clone(),
        load: zeros.clone(),
        force: zeros.clone(),
        rates: zeros.clone(),
        from: [zeros.clone(), zeros.clone()],
        start: zeros,
        viscosity: DMatrix::zeros(n, n),
        resistance: vec![0.0; n],
    })
}

impl Reduced {
    /// Bytes held.
    fn bytes(&self) -> usize {
        let (n, rows) = (self.next.len(), self.rows.len());
        8 * (2 * n * n + 18 * n + rows * (2 * n + rows + 4))
    }

    /// E.
    fn elastic(&self) -> &dyn Elastic {
        self.reduced.elastic(self.form)
    }

    fn take_places(&mut self, at: At) {
        if let Some(points) = at.points {
            self.places.take(at.shell, at.reduced, points.points());
        }
    }

    /// Whether positions and energies are numbers.
    fn is_within_range(&self, q: &[f64], q_dot: &[f64]) -> bool {
        let kinetic = sum_of(q_dot, q_dot, |v, _| v * v);
        kinetic.is_finite() && q.iter().all(|q| q.abs() <= self.largest())
    }

    /// Whether the next rates lead a hundred times beyond all amplitudes in another step of `h`: no step that ends within them has such.
    fn outruns_range(&self, h: f64) -> bool {
        self.rates.iter().any(|rate| (0.01 * h * rate).abs() > self.largest())
    }

    fn largest(&self) -> f64 {
        LARGEST_DISPLACEMENT * self.shell.mesh.size * self.shell.total_mass.sqrt()
    }

    /// BᵀF without the turning frame's.
    fn set_force(&mut self, Acting { load, external, .. }: &Acting) {
        let reduced = &self.reduced;
        self.force.fill(0.0);
        reduced.add_uniform(&load.parts().0, &mut self.force);
        if let Some(forces) = external.on_all() {
            with_fields!(&reduced.fields, fields => fields.project(forces, &mut self.force));
        }
        for (v, force) in external.point_forces() {
            for (k, sum) in self.force.iter_mut().enumerate() {
                *sum += with_fields!(&reduced.fields, fields => fields.at(k, v as usize)).dot(&force);
            }
        }
    }

    fn displacements(&self) -> Vec<Vec3> {
        let mut u = vec![Vec3::zeros(); self.shell.mass.len()];
        with_fields!(&self.reduced.fields, fields => fields.displacements(&self.motion.q, |v, at| u[v] = at));
        u
    }

    /// g of [`Motion::visit_acceleration`]: the force on each field and that of constraints, less the elastic one.
    fn unbalanced(&self, acting: &Acting, reactions: &[Reaction]) -> Vec<f64> {
        let reduced = &self.reduced;
        let Coordinates { q, q_dot } = &self.motion;
        let at = At::of(&self.shell, reduced, acting);
        let mut probe = self.clone();
        probe.set_force(acting);
        if let Some((gradient, coriolis)) = acting.load.parts().1 {
            reduced.add_spin(gradient, coriolis, (q, q_dot), &mut probe.force);
        }
        self.elastic().gradient(q, probe.newton.scratch(), &mut probe.rates);
        for (k, g) in probe.force.iter_mut().enumerate() {
            let field = |v: u32| with_fields!(&reduced.fields, fields => fields.at(k, v as usize));
            let held = |(v, [force, torque]): &Reaction| {
                let mut work = field(*v).dot(force);
                if *torque != Vec3::zeros() {
                    let ring = ring_of(&mut probe.rings, &self.shell, *v);
                    let by_vertex = ring.turn(&places(at, ring, q)).1;
                    let turned = by_vertex.iter().zip(&ring.vertices).map(|(by, v)| torque.dot(&(by * field(*v))));
                    work += turned.sum::<f64>();
                }
                work
            };
            *g += reactions.iter().map(held).sum::<f64>() - probe.rates[k];
        }
        probe.force
    }

    /// Operations of a Hessian, a gradient and a shape, and what they go by.
    fn costs(&self) -> ([f64; 3], String) {
        if let (Form::Polynomial, Some(polynomial)) = (self.form, &self.reduced.polynomial) {
            let [shape, hessian] = polynomial.operations().map(|count| POLYNOMIAL * count);
            let entries = (polynomial.n() * polynomial.n()) as f64;
            let costs = [hessian + POLYNOMIAL_FACTORIZED * entries, POLYNOMIAL_SOLVED * entries, shape];
            return (costs, format!("and {} forms", polynomial.n_forms()));
        }
        let counts = self.reduced.energy.operations();
        let of_one = |costs: [f64; 5]| -> f64 { counts.iter().zip(costs).map(|(count, cost)| count * cost).sum() };
        let costs = [REDUCED_HESSIAN, REDUCED_GRADIENT, REDUCED_SHAPE].map(of_one);
        (costs, format!("on {} elements", self.reduced.samples.len()))
    }

    fn plan_shell(&self) -> Part {
        let n = self.reduced.n();
        let (Work { hessians, gradients, shapes }, whence) =
            if self.work.shapes > 0 { (self.work, AS_BEFORE) } else { (WORK, BEFORE_ANY) };
        let ([hessian, gradient, shape], of) = self.costs();
        let factor = REDUCED_FACTOR * (n * n * n) as f64 / 6.0;
        let operations = hessians as f64 * (hessian + factor) + gradients as f64 * gradient + shapes as f64 * shape;
        let output = self.reduced.packed.as_ref().map_or(String::new(), |packed| {
            let (used, bound) = (packed.n_used(&self.motion.q), packed.bound(&self.motion.q));
            format!("; output in 16 bits reads {used} fields now and is off by {bound:.1e} at most")
        });
        let reason = format!(
            "{n} fields {of}; {hessians} Hessians, {gradients} gradients and {shapes} shapes {whence}{output}{}",
            self.tell_form()
        );
        let bytes = self.reduced.bytes() + self.bytes();
        Part { kind: PartKind::ReducedShell, active: true, bytes, operations, reason }
    }
}

impl Motion for Reduced {
    fn method(&self) -> Method {
        self.own_method()
    }

    fn try_clone(&self) -> Result<Box<dyn Motion>> {
        Ok(Box::new(self.clone()))
    }

    fn reset(&mut self) {
        self.motion = Coordinates::rest(self.next.len());
        self.constraints.reset();
        self.unconverged = 0;
        self.work = Work::default();
        self.take_form(Form::Polynomial);
        self.estimate.forget();
        if let Some(made) = self.reduced.energy.yielding().map(|yielding| yielding.made().clone()) {
            self.take_rest_angles(&made);
        }
    }

    fn stop(&mut self) {
        self.estimate.forget();
        self.motion.q_dot.fill(0.0);
    }

    fn step(&mut self, acting: &Acting, h: f64) -> Result<()> {
        self.advance_by_choice(acting, h)?;
        self.yield_creases();
        Ok(())
    }

    fn settle(&mut self, acting: &Acting, watch: &mut Watch) -> Result<(f64, usize)> {
        let found = self.settle_by_choice(acting, watch)?;
        self.yield_creases();
        Ok(found)
    }

    /// BᵀMu and BᵀMu̇, and again of what is left, because B is rounded.
    fn project_from(&mut self, u: &[Vec3], rate: &[Vec3]) -> Result<()> {
        let (reduced, mass) = (&self.reduced, &self.shell.mass);
        let mut motion = Coordinates::rest(reduced.n());
        for _ in 0..PROJECTIONS {
            let mut left = [u.to_vec(), rate.to_vec()];
            let take = |v: usize, x: Vec3, x_dot: Vec3| {
                left[0][v] = (left[0][v] - x) * mass[v];
                left[1][v] = (left[1][v] - x_dot) * mass[v];
            };
            with_fields!(&reduced.fields, fields => fields.motion(&motion.q, &motion.q_dot, &mut { take }));
            with_fields!(&reduced.fields, fields => fields.project(&left[0], &mut motion.q));
            with_fields!(&reduced.fields, fields => fields.project(&left[1], &mut motion.q_dot));
        }
        if !self.is_within_range(&motion.q, &motion.q_dot) {
            return Err(Error::new(ErrorKind::Numerical, "the pose is beyond what the fields can tell"));
        }
        self.motion = motion;
        self.choose_form();
        self.estimate.forget();
        Ok(())
    }

    fn step_nanoseconds(&self) -> u64 {
        self.reduced.step_nanoseconds(self.form)
    }

    fn unknowns(&self) -> [Vec<f64>; 2] {
        let mut unknowns = [self.motion.q.clone(), self.motion.q_dot.clone()];
        self.add_more_unknowns(&mut unknowns);
        unknowns
    }

    fn copy_unknowns(&self, into: &mut [Vec<f64>; 2]) {
        into[0].clone_from(&self.motion.q);
        into[1].clone_from(&self.motion.q_dot);
        self.add_more_unknowns(into);
    }

    fn expect_points(&mut self, n: usize) {
        self.places.expect(self.reduced.n(), n);
    }

    fn set_unknowns(&mut self, [q, q_dot]: [&[f64]; 2]) {
        self.estimate.forget();
        let n = self.motion.q.len();
        self.motion.q.copy_from_slice(&q[..n]);
        self.motion.q_dot.copy_from_slice(&q_dot[..n]);
        self.set_more_unknowns(&q[n..]);
    }

    fn n_unknowns(&self) -> usize {
        self.motion.q.len() + self.n_more_unknowns()
    }

    fn is_representable(&self, [q, q_dot]: [&[f64]; 2]) -> bool {
        let n = self.motion.q.len();
        self.is_within_range(&q[..n], &q_dot[..n]) && self.can_be_more(&q[n..])
    }

    fn rest_angles(&self) -> Vec<f64> {
        self.reduced.energy.yielding().map_or(vec![], |yielding| yielding.rest_angles().to_vec())
    }

    fn set_rest_angles(&mut self, angles: &[f64]) {
        self.take_rest_angles(angles);
    }

    fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    fn set_damping(&mut self, damping: &Damping) -> Result<bool> {
        self.modal_damping = damping.by_ratio(&self.basis)?;
        let Damping { mass_coefficient: xi, stiffness_coefficient: stiffness, factors, .. } = damping;
        let by_vertices = !factors.is_empty() && *xi > 0.0;
        self.by_vertices = by_vertices.then(|| Arc::new(*xi * self.reduced.mass_by(&self.shell, factors)));
        self.damping = Rayleigh { mass: if by_vertices { 0.0 } else { *xi }, stiffness: *stiffness };
        Ok(true)
    }

    fn constraints(&self) -> &ConstraintSet {
        &self.constraints
    }

    fn change_constraints(&mut self, change: &mut dyn FnMut(&mut ConstraintSet)) {
        change(&mut self.constraints);
        let rows = self.constraints.report().map(|(c, _)| c.axes.iter().filter(|held| **held).count()).sum();
        if self.rows.len() != rows {
            self.rows = Rows::new(rows, self.next.len());
            self.newton.make_room(rows);
        }
    }

    fn positions(&self, placement: &Placement, write: &mut dyn FnMut(usize, &[[f64; 3]])) {
        let rest = &self.shell.mesh.positions;
        let place = |v: usize, u: Vec3| write(v, &[placement.place(rest[v] + u).into()]);
        with_fields!(&self.reduced.fields, fields => fields.displacements(&self.motion.q, place));
    }

    fn positions_f32(&self, placement: &Placement, write: &mut dyn FnMut(usize, &[[f32; 3]])) {
        match &self.reduced.packed {
            Some(packed) => packed.positions_f32(&self.motion.q, placement, write),
            None => {
                with_fields!(&self.reduced.fields, fields => fields.positions_f32(&self.motion.q, placement, write))
            }
        }
    }

    fn positions_of(&self, placement: &Placement, vertices: &[u32], write: &mut dyn FnMut(usize, [f64; 3])) {
        let rest = |i: usize| self.shell.mesh.positions[vertices[i] as usize];
        let place = |i: usize, u: Vec3| write(i, placement.place(rest(i) + u).into());
        with_fields!(&self.reduced.fields, fields => fields.displacements_of(&self.motion.q, vertices, place));
    }

    fn positions_of_f32(&self, placement: &Placement, vertices: &[u32], write: &mut dyn FnMut(usize, [f32; 3])) {
        match &self.reduced.packed {
            Some(packed) => packed.positions_of_f32(&self.motion.q, placement, vertices, write),
            None => with_fields!(&self.reduced.fields, fields =>
                fields.positions_of_f32(&self.motion.q, placement, vertices, write)),
        }
    }

    /// The mean rotation of the vertex's triangles.
    fn rotations(&self, frame: UnitQuaternion<f64>, write: &mut WriteRotation) -> Result<()> {
        write_rotations(rotations(&self.shell.mesh, &self.displacements()), frame, write)
    }

    fn visit_motion(&self, mut visit: &mut dyn FnMut(usize, Vec3, Vec3)) {
        let Coordinates { q, q_dot } = &self.motion;
        with_fields!(&self.reduced.fields, fields => fields.motion(q, q_dot, &mut visit));
    }

    fn visit_acceleration(&self, acting: &Acting, reactions: &[Reaction], visit: &mut dyn FnMut(usize, Vec3)) {
        let g = self.unbalanced(acting, reactions);
        with_fields!(&self.reduced.fields, fields => fields.displacements(&g, visit));
    }

    fn largest_displacement(&self) -> f64 {
        LARGEST_DISPLACEMENT * self.shell.mesh.size
    }

    fn extent(&self) -> Extent {
        extent(&self.shell.mesh, &self.displacements())
    }

    /// E and ½ q̇ᵀq̇.
    fn energies(&self) -> (f64, f64) {
        let energy = self.elastic();
        let kinetic: f64 = self.motion.q_dot.iter().map(|v| v * v).sum();
        (energy.value(&self.motion.q, &mut energy.scratch()), 0.5 * kinetic)
    }

    fn step_error(&self) -> f64 {
        self.estimate.length(&self.newton, self.shell.total_mass)
    }

    fn unconverged_steps(&self) -> u64 {
        self.unconverged
    }

    fn plan(&self, around: &Around) -> Vec<Part> {
        let n = self.reduced.n();
        let modes = around.unused_modes([
            "the reduced shell has fields of its own; the model holds them",
            "the reduced shell does not warp; the model holds them",
        ]);
        let summed = "sums over the vertices taken once";
        let loads = around.cheap_loads([summed, summed]);
        let forces = around.forces_and_wind(REDUCED_POINT * n as f64, 0.0);
        let own = [
            Part::absent(PartKind::Modes, "the reduced shell moves by its fields"),
            around.constraints(&self.constraints, n),
            self.plan_shell(),
        ];
        around.with_the_rest(own.into_iter().chain(modes).chain(loads).chain(forces))
    }
}
