//! Creases that yield: a folded card against the closed form of an elastic, perfectly plastic hinge, energy that never grows, states that keep
//! their folds, methods that cannot, bad input.

use crate::common::*;
use crate::plates::*;
use nalgebra::UnitQuaternion;
use rand::{Rng, SeedableRng, rngs::StdRng};
use shellwarp::constraint::{Constraint, Target};
use shellwarp::energy::{Energy, dihedral_angle};
use shellwarp::material::{Crease, ElasticSheet, Elasticity};
use shellwarp::mesh::Mesh;
use shellwarp::model::{Model, Options};
use shellwarp::shell::Make;
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::{ErrorKind, Material, Shell, Supports, Vec3};
use std::f64::consts::PI;
use std::sync::Arc;

const SHEET: ElasticSheet = ElasticSheet { young: 1e6, poisson: 0.0, thickness: 0.01, volume_density: 20.0 };
const PAPER: Material = Material { k_area: 4000.0, k_length: 300.0, k_bend: 0.015, area_density: 0.2 };
const CELLS: usize = 8;
const WIDTH: f64 = 0.25;
const FACTOR: f64 = 0.05;
/// Rad.
const YIELD: f64 = 0.3;

fn materials() -> [Elasticity; 2] {
    [SHEET.into(), PAPER.into()]
}

/// A card of length 1, clamped at x = 0, with a fold across its middle.
fn card(material: Elasticity, yield_angle: f64) -> Shell {
    card_of(material, FACTOR, yield_angle)
}

fn card_of(material: Elasticity, factor: f64, yield_angle: f64) -> Shell {
    let (positions, triangles) = rectangle(Family::Diagonal, CELLS, 1.0, WIDTH);
    let mesh = Mesh::new(positions, &triangles).unwrap();
    let creases = fold(&mesh).into_iter().map(|vertices| Crease { vertices, factor, angle: None, yield_angle });
    let make = Make { creases: creases.collect(), ..Make::of(material) };
    let clamped = (0..mesh.positions.len() as u32).filter(|v| mesh.positions[*v as usize].x < 1e-9).collect();
    Shell::made(mesh, make, &Supports { clamped, ..Supports::default() }).unwrap()
}

fn fold(mesh: &Mesh) -> Vec<[u32; 2]> {
    let on = |v: &u32| (mesh.positions[*v as usize].x - 0.5).abs() < 1e-9;
    mesh.edges.iter().map(|e| e.vertices).filter(|ends| ends.iter().all(on)).collect()
}

fn model(shell: Shell) -> Arc<Model> {
    let options = Options { modes: 8, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
}

fn state(model: &Arc<Model>, method: Method) -> State {
    State::new(model.clone(), method, Integrator::Exact).unwrap()
}

fn places(state: &State) -> Vec<Vec3> {
    let mut x = vec![Vec3::zeros(); state.model().shell.mass.len()];
    state.positions(Space::World, |v, p| x[v] = p);
    x
}

/// Angles at the fold.
fn angles(state: &State) -> Vec<f64> {
    let (mesh, x) = (&state.model().shell.mesh, places(state));
    let of = |ends: &[u32; 2]| {
        let edge = mesh.edges.iter().find(|e| e.vertices == *ends).unwrap();
        let [[a, b], [c, d]] = [edge.vertices, edge.opposite];
        dihedral_angle(&[a, b, c, d].map(|v| x[v as usize]))
    };
    fold(mesh).iter().map(of).collect()
}

fn end(mesh: &Mesh) -> Vec<u32> {
    (0..mesh.positions.len() as u32).filter(|v| mesh.positions[*v as usize].x > 1.0 - 1e-9).collect()
}

/// Turns the card's end about the width, wherever it goes: by a pure moment.
fn hold(state: &mut State, angle: f64) {
    for vertex in end(&state.model().shell.mesh.clone()) {
        let target = Target::Orientation(UnitQuaternion::from_axis_angle(&Vec3::y_axis(), -angle));
        let axes = [false, true, false];
        state.set_constraint(Constraint { id: vertex, vertex, axes, compliance: 0.0, target }).unwrap();
    }
}

/// How far the edges of a line are not bent alike: by so much they lead each other when nothing else does.
fn differ(angles: &[f64]) -> f64 {
    angles.iter().fold(0.0, |most: f64, angle| most.max((angle - angles[0]).abs()))
}

/// From one angle to another in equilibria.
fn lead(state: &mut State, from: f64, to: f64) {
    for k in 1..=12 {
        hold(state, from + (to - from) * f64::from(k) / 12.0);
        state.equilibrium().unwrap();
    }
}

fn let_go(state: &mut State) {
    state.clear_constraints();
    state.equilibrium().unwrap();
}

#[test]
fn a_card_folded_by_handles_keeps_the_fold_but_for_its_yield_angle() {
    for material in materials() {
        let model = model(card(material, YIELD));
        let mut folding = state(&model, Method::ImplicitShell);
        lead(&mut folding, 0.0, 2.0 * PI / 3.0);
        let bent = angles(&folding);
        // Beyond the yield angle the moment is that of the limit: k y, with the plate's stiffness over a cell, by the factor.
        let rigidity = match material {
            Elasticity::Koiter(sheet) => sheet.stiffness()[1],
            Elasticity::DiscreteShells(material) => 6.0 * material.k_bend,
        };
        let limit = FACTOR * rigidity * WIDTH * CELLS as f64 * YIELD;
        let moment: f64 = folding.constraints().map(|(_, outcome)| outcome.force.y).sum();
        println!("moment {moment:.6e} of {limit:.6e}, bent to {:.4} rad", bent[0].abs());
        // A fold line that is not quite straight has its moments about axes that are not quite the width: 3e-5 of paper.
        assert!((moment.abs() / limit - 1.0).abs() < 1e-4, "{moment} {limit}");
        assert!(bent.iter().all(|angle| angle.abs() > 1.6), "{bent:?}");
        let bents = bent.clone();
        let_go(&mut folding);
        for (angle, bent) in angles(&folding).iter().zip(&bent) {
            let left = bent - YIELD.copysign(*bent);
            assert!((angle - left).abs() < 1e-6 + differ(&bents), "{angle} of {left}");
        }
        // Nothing pulls any more, but for the square of such differences.
        let stored = folding.report().elastic_energy;
        assert!(stored < limit / YIELD * (1e-6 + differ(&bents)).powi(2), "{stored}");
        // Laid flat by hand it yields back, and springs up by the yield angle.
        lead(&mut folding, 1.7, 0.0);
        let flat = angles(&folding);
        let_go(&mut folding);
        for (angle, from) in angles(&folding).iter().zip(&flat) {
            assert!((angle - from - YIELD.copysign(bent[0])).abs() < 1e-6 + differ(&flat), "{angle} {from}");
        }
    }
}

#[test]
fn a_card_bent_within_its_yield_angle_is_the_elastic_one() {
    for material in materials() {
        let [elastic, yielding] = [f64::INFINITY, 2.5].map(|limit| {
            let mut folding = state(&model(card(material, limit)), Method::ImplicitShell);
            lead(&mut folding, 0.0, 1.0);
            let folded = displacements(&folding);
            let_go(&mut folding);
            (folded, displacements(&folding))
        });
        // Sums in another order: rounding, by what an equilibrium leaves.
        assert!(error(&yielding.0, &elastic.0) < 1e-6);
        assert!(yielding.1.iter().all(|u| u.norm() < 1e-6));
    }
}

#[test]
fn what_yields_gives_heat_and_never_energy() {
    let mut random = StdRng::seed_from_u64(5);
    for material in materials() {
        let shell = card(material, 0.1);
        let mut own = shell.energy.yielding().unwrap().clone();
        let mut yields = 0;
        for _ in 0..200 {
            let field: Vec<Vec3> = shell
                .mesh
                .positions
                .iter()
                .map(|x| x + Vec3::from_fn(|_, _| random.random_range(-0.08..0.08)))
                .collect();
            let at = |v: u32| field[v as usize];
            let before = own.value(&field);
            let Some(angles) = own.yielded(at) else { continue };
            yields += 1;
            own.set_rest_angles(&angles);
            let after = own.value(&field);
            assert!(after <= before * (1.0 + 1e-14), "{before} {after}"); // a sum of squares of which each falls
            assert!(own.yielded(at).is_none() && angles.iter().all(|angle| angle.abs() <= PI));
        }
        assert!(yields > 100);
    }
}

/// Kicks the flap of a card by a speed that folds it.
fn kick(state: &mut State, speed: f64) {
    let mesh = state.model().shell.mesh.clone();
    let forces: Vec<(u32, Vec3)> =
        end(&mesh).iter().map(|v| (*v, Vec3::new(0.0, 0.0, speed * state.model().shell.mass[*v as usize]))).collect();
    state.set_forces(forces, true).unwrap();
}

#[test]
fn a_card_that_is_struck_loses_what_its_fold_takes_and_gains_nothing_by_either_integrator() {
    for (method, h) in [(Method::ImplicitShell, 2e-3), (Method::ExplicitShell, 2e-5)] {
        let left = [f64::INFINITY, 0.1].map(|limit| {
            let mut card = state(&model(card_of(PAPER.into(), 0.3, limit)), method);
            kick(&mut card, 3.0 / h);
            card.step(h).unwrap();
            let total = |card: &State| {
                let report = card.report();
                report.elastic_energy + report.kinetic_energy
            };
            let given = total(&card);
            let mut most = given;
            for _ in 0..(0.3 / h) as usize {
                card.step(h).unwrap();
                most = most.max(total(&card));
            }
            // The explicit integrator's energy swings by the square of step times frequency: 3e-4 of it here.
            assert!(most <= given * 1.003, "{method:?}: {most} of {given}");
            total(&card) / given
        });
        println!("{method:?}: elastic keeps {:.3}, yielding {:.3}", left[0], left[1]);
        assert!(left[1] < 0.8 * left[0], "{method:?}: {left:?}");
    }
}

#[test]
fn folds_are_cloned_saved_reset_and_taken_back_with_the_state() {
    for method in [Method::ImplicitShell, Method::ExplicitShell] {
        let h = if method == Method::ImplicitShell { 5e-3 } else { 2e-5 };
        let model = model(card(PAPER.into(), 0.05));
        let mut card = state(&model, method);
        kick(&mut card, 3.0 / h);
        for _ in 0..(0.2 / h) as usize {
            card.step(h).unwrap();
        }
        let saved = card.save();
        assert_eq!(saved.len(), card.saved_size());
        let mut copy = card.try_clone().unwrap();
        let loaded = Model::load(&model.save().unwrap()).unwrap();
        assert!(loaded.shell.creases == model.shell.creases);
        let mut later = state(&Arc::new(loaded), method);
        later.load(&saved).unwrap();
        let run = |state: &mut State| {
            (0..20).for_each(|_| state.step(h).unwrap());
            displacements(state)
        };
        let on = run(&mut card);
        assert!(on == run(&mut copy) && on == run(&mut later) && on.iter().any(|u| u.norm() > 0.05));
        // Its creases rest elsewhere: without speed and load it stays folded.
        card.set_method(Method::ImplicitShell).unwrap();
        card.equilibrium().unwrap();
        assert!(angles(&card).iter().all(|angle| angle.abs() > 0.05), "{:?}", angles(&card));
        card.reset();
        card.equilibrium().unwrap();
        assert!(displacements(&card).iter().all(|u| u.norm() < 1e-9));
        // Rest angles beyond half a turn are none.
        let mut bad = saved.clone();
        let at = 24 + 8 * (15 + 3 * model.shell.mass.len());
        bad[at..at + 8].copy_from_slice(&4.0f64.to_le_bytes());
        let sum = xxhash_rust::xxh3::xxh3_64(&bad[..bad.len() - 8]);
        let body = bad.len() - 8;
        bad[body..].copy_from_slice(&sum.to_le_bytes());
        assert!(copy.load(&bad).is_err() && displacements(&copy) == on);
    }
}

#[test]
fn methods_of_one_rest_shape_refuse_by_name() {
    let model = model(card(SHEET.into(), 0.1));
    let refused = [
        Method::Warp,
        Method::VirtualWorkWarp,
        Method::LinearModalAnalysis,
        Method::RotationStrain,
        Method::PolynomialShell,
    ];
    for method in refused {
        let error = State::new(model.clone(), method, Integrator::Exact).err().unwrap();
        assert_eq!(error.kind, ErrorKind::Unsupported);
        assert!(
            error.message.contains("yield") && error.message.contains("full shell"),
            "{method:?}: {}",
            error.message
        );
        let mut full = state(&model, Method::ImplicitShell);
        assert!(full.set_method(method).is_err() && full.method() == Method::ImplicitShell);
    }
}

#[test]
fn bad_yield_angles_are_refused_by_number() {
    let (positions, triangles) = rectangle(Family::Diagonal, 4, 1.0, 1.0);
    let good = Crease { vertices: [6, 7], factor: 0.5, angle: None, yield_angle: f64::INFINITY };
    for yield_angle in [0.0, -0.1, f64::NAN, f64::NEG_INFINITY] {
        let mesh = Mesh::new(positions.clone(), &triangles).unwrap();
        let creases = vec![good, Crease { vertices: [7, 12], yield_angle, ..good }];
        let make = Make { creases, ..Make::of(SHEET) };
        let message = Shell::made(mesh, make, &Supports::default()).err().unwrap().message;
        assert!(message.contains("yield angle of crease 1") && message.contains("7-12"), "{message}");
    }
    // A crease that turns freely has no moment to yield by.
    let mesh = Mesh::new(positions, &triangles).unwrap();
    let free = Crease { factor: 0.0, yield_angle: 0.1, ..good };
    let shell = Shell::made(mesh, Make { creases: vec![free], ..Make::of(SHEET) }, &Supports::default()).unwrap();
    assert!(!shell.creases.yield_somewhere() && shell.energy.yielding().is_none());
}
