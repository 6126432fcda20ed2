//! An energy of single points from outside, here of floors, joins every method's own: against closed forms, against soft constraints, and
//! method against method.

use crate::common::*;
use nalgebra::{Matrix3, UnitQuaternion};
use shellwarp::constraint::{Constraint, Target};
use shellwarp::energy::Curvature;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::point_energy::{Point, PointEnergy};
use shellwarp::reduced;
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::{FrameMotion, Pose};
use shellwarp::{ErrorKind, Vec3};
use std::f64::consts::FRAC_PI_2;
use std::sync::{Arc, OnceLock};

/// ½ k min(n · x − height, 0)² at each of some points.
struct Floor {
    points: Vec<Point>,
    stiffness: Vec<f64>,
    normal: Vec3,
    height: f64,
}

impl Floor {
    fn depth(&self, x: &Vec3) -> f64 {
        (self.normal.dot(x) - self.height).min(0.0)
    }
}

impl PointEnergy for Floor {
    fn points(&self) -> &[Point] {
        &self.points
    }
    fn value_at(&self, i: usize, x: &Vec3) -> f64 {
        0.5 * self.stiffness[i] * self.depth(x).powi(2)
    }
    fn gradient_at(&self, i: usize, x: &Vec3) -> Vec3 {
        self.stiffness[i] * self.depth(x) * self.normal
    }
    fn hessian_at(&self, i: usize, x: &Vec3, _: Curvature) -> Matrix3<f64> {
        let stiffness = if self.depth(x) < 0.0 { self.stiffness[i] } else { 0.0 };
        stiffness * self.normal * self.normal.transpose()
    }
}

const ALL: [Method; 8] = [
    Method::LinearModalAnalysis,
    Method::Warp,
    Method::VirtualWorkWarp,
    Method::RotationStrain,
    Method::ReducedShell,
    Method::PolynomialShell,
    Method::ImplicitShell,
    Method::ExplicitShell,
];

/// The middle of the beam's free end.
const TIP: u32 = 204;

/// A flat beam in the plane z = 0 of its frame, held at one end.
fn beam() -> &'static Arc<Model> {
    static MODEL: OnceLock<Arc<Model>> = OnceLock::new();
    MODEL.get_or_init(|| {
        let reduced = reduced::Options { fields: 16, elements: 400, poses: 8, ..Default::default() };
        let options = Options { modes: 8, precision: Precision::F64, reduced, ..Options::default() };
        let shell = reference("flat_beam").0;
        Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
    })
}

/// Its frame elsewhere, its z axis along −y of the world.
fn pose() -> Pose {
    Pose { origin: Vec3::new(1.0, 2.0, 3.0), rotation: UnitQuaternion::from_axis_angle(&Vec3::x_axis(), FRAC_PI_2) }
}

fn up() -> Vec3 {
    pose().rotation * Vec3::z()
}

fn state(method: Method, integrator: Integrator) -> State {
    let mut state = State::new(beam().clone(), method, integrator).unwrap();
    state.set_frame(pose(), FrameMotion::Continuous);
    state
}

/// Displacement of the tip along z per force there, by the modes.
fn flexibility(v: u32) -> f64 {
    let modal = &beam().modal;
    (0..modal.n_modes()).map(|k| modal.mode_at(k, v as usize).0.z.powi(2) / modal.eigenvalues[k]).sum()
}

/// Gravity under which linear modes let the tip sink by `depth` model sizes.
fn gravity(depth: f64) -> Vec3 {
    let mut plain = state(Method::LinearModalAnalysis, Integrator::ImplicitEuler);
    plain.set_gravity(-up()).unwrap();
    plain.equilibrium().unwrap();
    up() * (depth * beam().shell.mesh.size / displacement(&plain, TIP).z)
}

fn displacement(state: &State, v: u32) -> Vec3 {
    let mut at = Vec3::zeros();
    state.positions(Space::Frame, |i, x| at = if i == v as usize { x } else { at });
    at - beam().shell.mesh.positions[v as usize]
}

/// Over one point, `rise` above where it is at rest.
fn floor_at(point: Point, rise: f64, stiffness: f64) -> Arc<Floor> {
    let height = up().dot(&pose().origin) + rise;
    Arc::new(Floor { points: vec![point], stiffness: vec![stiffness], normal: up(), height })
}

/// The same two-sided, as a constraint: the world's y axis is the floor's normal.
fn spring_at(id: u32, v: u32, rise: f64, compliance: f64) -> Constraint {
    let target = pose().origin + pose().rotation * (beam().shell.mesh.positions[v as usize] + rise * Vec3::z());
    Constraint { id, vertex: v, axes: [false, true, false], compliance, target: Target::Position(target) }
}

/// Of the larger of two shapes' displacements, how far they are apart.
fn apart(a: &State, b: &State) -> f64 {
    let (a, b) = (displacements(a), displacements(b));
    let largest = b.iter().map(|u| u.norm()).fold(0.0, f64::max);
    a.iter().zip(&b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) / largest
}

#[test]
fn linear_modes_sink_into_a_floor_by_the_closed_form() {
    let (k, load) = (5.0 / flexibility(TIP), gravity(0.1));
    let (sunk, rise) = (-0.1 * beam().shell.mesh.size, -0.04 * beam().shell.mesh.size);
    for integrator in [Integrator::ImplicitEuler, Integrator::Exact] {
        let mut state = state(Method::LinearModalAnalysis, integrator);
        state.set_gravity(load).unwrap();
        state.set_point_energy(Some(floor_at(Point::vertex(TIP), rise, k))).unwrap();
        state.equilibrium().unwrap();
        // u = u₀ + af with f = k(rise − u); the basis and its fixed point have eleven digits.
        let a = flexibility(TIP);
        let exact = (sunk + a * k * rise) / (1.0 + a * k);
        assert_close("the tip", displacement(&state, TIP).z, exact, 1e-9, 0.0);
    }
}

#[test]
fn an_explicit_step_feels_the_force_of_where_it_starts() {
    let mut state = state(Method::ExplicitShell, Integrator::ImplicitEuler);
    let (h, k, rise) = (1e-6, 3.0, 0.01);
    state.set_point_energy(Some(floor_at(Point::vertex(TIP), rise, k))).unwrap();
    state.step(h).unwrap();
    let mass = beam().shell.mass[TIP as usize];
    // Positions of size 1 have an error of 1e-16.
    assert_close("the tip", displacement(&state, TIP).z, h * h * k * rise / mass, 1e-3, 1e-12);
}

#[test]
fn a_floor_under_a_vertex_is_a_soft_constraint_there() {
    let size = beam().shell.mesh.size;
    let k = 5.0 / flexibility(TIP);
    for method in ALL {
        let mut both = [(); 2].map(|()| state(method, Integrator::ImplicitEuler));
        both.iter_mut().for_each(|state| state.set_gravity(gravity(0.1)).unwrap());
        both[0].set_point_energy(Some(floor_at(Point::vertex(TIP), -0.04 * size, k))).unwrap();
        both[1].set_constraint(spring_at(1, TIP, -0.04 * size, 1.0 / k)).unwrap();
        for state in &mut both {
            state.equilibrium().unwrap();
        }
        assert!(displacement(&both[0], TIP).z < -0.04 * size, "{method}: the floor carries nothing");
        // Two searches that end at a residual of 1e-7 of the load.
        assert!(apart(&both[0], &both[1]) < 1e-5, "{method}: {:e}", apart(&both[0], &both[1]));
    }
}

#[test]
fn steps_under_a_floor_are_those_with_a_soft_constraint() {
    let (k, rise) = (5.0 / flexibility(TIP), 0.05 * beam().shell.mesh.size);
    for method in ALL.into_iter().filter(|method| *method != Method::ExplicitShell) {
        for integrator in [Integrator::ImplicitEuler, Integrator::Exact] {
            let mut both = [(); 2].map(|()| state(method, integrator));
            both[0].set_point_energy(Some(floor_at(Point::vertex(TIP), rise, k))).unwrap();
            both[1].set_constraint(spring_at(1, TIP, rise, 1.0 / k)).unwrap();
            let mut steps = 0;
            while steps < 12 && displacement(&both[1], TIP).z < 0.9 * rise {
                both.iter_mut().for_each(|state| state.step(0.01).unwrap());
                steps += 1;
            }
            // Ends of steps are found to 1e-5 by the reduced shells, of energies; others are far nearer.
            assert!(apart(&both[0], &both[1]) < 1e-4, "{method}: {:e}", apart(&both[0], &both[1]));
            assert!(steps > 1, "{method}: it is there after {steps} steps");
        }
    }
}

/// The same force, given to the corners by their weights, holds the same shape, where a method's loads act by virtual work.
#[test]
fn a_point_within_a_triangle_pulls_its_corners_by_their_weights() {
    let size = beam().shell.mesh.size;
    let corners = *beam().shell.mesh.triangles.iter().find(|t| t.contains(&TIP)).unwrap();
    let point = Point::within(corners, [0.5, 0.3, 0.2]);
    let k = 5.0 / flexibility(TIP);
    for method in ALL.into_iter().filter(|method| *method != Method::Warp) {
        let mut both = [(); 2].map(|()| state(method, Integrator::ImplicitEuler));
        both.iter_mut().for_each(|state| state.set_gravity(gravity(0.1)).unwrap());
        both[0].set_point_energy(Some(floor_at(point, -0.04 * size, k))).unwrap();
        both[0].equilibrium().unwrap();
        let sunk = point.place(|v| displacement(&both[0], v as u32)).z + 0.04 * size;
        assert!(sunk < 0.0, "{method}: the floor carries nothing");
        let forces = point.corners().map(|(v, w)| (v as u32, -w * k * sunk * up()));
        both[1].set_forces(forces.collect::<Vec<_>>(), false).unwrap();
        both[1].equilibrium().unwrap();
        // Searches end at 1e-7 of the load; under dead forces the beam is six times as soft as on the floor.
        assert!(apart(&both[0], &both[1]) < 1e-5, "{method}: {:e}", apart(&both[0], &both[1]));
    }
}

#[test]
fn a_floor_and_a_hard_constraint_act_together() {
    let size = beam().shell.mesh.size;
    let x = |v: u32| beam().shell.mesh.positions[v as usize].x;
    let off = |v: &u32| (x(*v) - 0.5 * x(TIP)).abs();
    let middle = *beam().shell.free.iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
    let k = 5.0 / flexibility(TIP);
    for method in ALL {
        let mut both = [(); 2].map(|()| state(method, Integrator::ImplicitEuler));
        for state in &mut both {
            state.set_gravity(gravity(0.1)).unwrap();
            state.set_constraint(spring_at(7, middle, -0.02 * size, 0.0)).unwrap();
        }
        both[0].set_point_energy(Some(floor_at(Point::vertex(TIP), -0.04 * size, k))).unwrap();
        both[1].set_constraint(spring_at(1, TIP, -0.04 * size, 1.0 / k)).unwrap();
        for state in &mut both {
            state.equilibrium().unwrap();
        }
        assert!(displacement(&both[0], TIP).z < -0.04 * size, "{method}: the floor carries nothing");
        assert!(apart(&both[0], &both[1]) < 1e-5, "{method}: {:e}", apart(&both[0], &both[1]));
        let missing = displacement(&both[0], middle).z + 0.02 * size;
        assert!(missing.abs() < 1e-6 * size, "{method} misses its constraint by {missing:e}");
    }
}

#[test]
fn a_floor_out_of_reach_changes_no_bit() {
    let points: Vec<Point> = (0..beam().shell.mass.len() as u32).map(Point::vertex).collect();
    let stiffness = vec![1e3; points.len()];
    let far = Arc::new(Floor { points, stiffness, normal: up(), height: -1e3 });
    for method in ALL {
        let saved = [None, Some(far.clone() as Arc<dyn PointEnergy>)].map(|energy| {
            let mut state = state(method, Integrator::ImplicitEuler);
            state.set_gravity(gravity(0.05)).unwrap();
            state.set_point_energy(energy).unwrap();
            let h = if method == Method::ExplicitShell { 1e-6 } else { 0.02 };
            (0..3).for_each(|_| state.step(h).unwrap());
            let moving = state.save();
            state.equilibrium().unwrap();
            (moving, state.save())
        });
        assert!(saved[0] == saved[1], "{method}");
    }
}

/// On a floor below the beam, under a load that lets linear modes sink by three times the floor's depth.
fn lying(method: Method) -> State {
    let (shell, load) = (&beam().shell, gravity(0.15));
    let size = shell.mesh.size;
    let points = shell.free.iter().map(|v| Point::vertex(*v)).collect();
    // An acceleration of ten times gravity at a depth of 1 % of the size.
    let stiffness = shell.free.iter().map(|v| 1e3 * load.norm() / size * shell.mass[*v as usize]).collect();
    let height = up().dot(&pose().origin) - 0.05 * size;
    let mut state = state(method, Integrator::ImplicitEuler);
    state.set_gravity(load).unwrap();
    state.set_point_energy(Some(Arc::new(Floor { points, stiffness, normal: up(), height }))).unwrap();
    state.equilibrium().unwrap();
    state
}

/// All methods of the shell's own energy lie on a floor alike; modal ones as near as they bend like it. Estimates tell how near.
#[test]
fn a_beam_comes_to_lie_on_a_floor_by_every_method() {
    let size = beam().shell.mesh.size;
    let exact = displacements(&lying(Method::ImplicitShell));
    let deepest = exact.iter().map(|u| u.z).fold(0.0, f64::min);
    assert!(deepest < -0.05 * size && deepest > -0.06 * size, "{deepest}");
    for (method, bound) in ALL.into_iter().zip(LYING) {
        let state = lying(method);
        let off = mass_error(&beam().shell, &displacements(&state), &exact);
        let estimate = state.certify().unwrap().error;
        println!("{method}: {off:.1e}, estimated {estimate:.1e}");
        assert!(off <= bound, "{method}: {off:e}");
        // Two digits of an estimate are plenty; exact shapes have an error of 1e-6 themselves.
        assert!((estimate - off).abs() <= 0.1 * off + 1e-6, "{method}: {off:e} is estimated as {estimate:e}");
    }
}

/// Twice what was measured.
const LYING: [f64; 8] = [6e-2, 7e-3, 7e-3, 4e-4, 4e-4, 4e-4, 0.0, 0.0];

#[test]
fn energies_of_no_vertex_of_the_shell_are_refused() {
    let mut state = state(Method::Warp, Integrator::ImplicitEuler);
    let n = beam().shell.mass.len() as u32;
    let error = state.set_point_energy(Some(floor_at(Point::vertex(n), 0.0, 1.0))).unwrap_err();
    assert_eq!(error.kind, ErrorKind::InvalidArgument);
    assert!(error.message.contains(&format!("vertex {n} of {n}")), "{error}");
}
