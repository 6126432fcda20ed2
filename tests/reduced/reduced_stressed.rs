//! Reduced shells of shells that are under stress where they rest, by rest angles, a rest shape or growth: against the full shell.

use crate::common::*;
use crate::plates::*;
use nalgebra::DMatrix;
use shellwarp::arithmetic::Arithmetic;
use shellwarp::energy::Curvature;
use shellwarp::material::{Crease, ElasticSheet, Elasticity, Map, On, Quantity};
use shellwarp::mesh::Mesh;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reduced;
use shellwarp::shell::Make;
use shellwarp::state::{Method, State};
use shellwarp::step::Integrator;
use shellwarp::{ErrorKind, Material, Shell, Supports, Vec3};
use std::sync::Arc;

const SHEET: ElasticSheet = ElasticSheet { young: 1e6, poisson: 0.3, thickness: 0.01, volume_density: 20.0 };
const PAPER: Material = Material { k_area: 4000.0, k_length: 300.0, k_bend: 0.015, area_density: 0.2 };

fn held_at_one_end(positions: &[Vec3]) -> Supports {
    let clamped = (0..positions.len() as u32).filter(|v| positions[*v as usize].x < 1e-9).collect();
    Supports { clamped, ..Supports::default() }
}

fn made((positions, triangles): &Sheet, make: Make) -> Arc<Shell> {
    let mesh = Mesh::new(positions.clone(), triangles).unwrap();
    Arc::new(Shell::made(mesh, make, &held_at_one_end(positions)).unwrap())
}

/// A card with a fold across its middle that rests at a quarter turn, against which its neighbours pull.
fn card(material: Elasticity) -> Arc<Shell> {
    let sheet = rectangle(Family::Diagonal, 20, 1.0, 0.3);
    let mesh = Mesh::new(sheet.0.clone(), &sheet.1).unwrap();
    let on = |v: &u32| (sheet.0[*v as usize].x - 0.5).abs() < 1e-9;
    let fold = mesh.edges.iter().map(|e| e.vertices).filter(|ends| ends.iter().all(on));
    let creases =
        fold.map(|vertices| Crease { vertices, factor: 1.0, angle: Some(1.5), yield_angle: f64::INFINITY }).collect();
    made(&sheet, Make { creases, ..Make::of(material) })
}

/// A strip whose rims are longer than its middle: they are pressed, the middle is pulled, everywhere and at rest.
fn ruffled(material: Elasticity) -> Arc<Shell> {
    let (flat, triangles) = rectangle(Family::UnionJack, 20, 1.0, 0.3);
    let rest = flat.iter().map(|x| Vec3::new(x.x * (1.0 + 0.02 * (x.y / 0.15 - 1.0).powi(2)), x.y, 0.0)).collect();
    let start = flat.iter().map(|x| Vec3::new(x.x, x.y, 0.02 * x.x * x.x)).collect();
    made(&(start, triangles), Make { rest_shape: Some(rest), ..Make::of(material) })
}

/// A strip that rests as the quarter of a tube, held flat at its end.
fn curled(material: Elasticity) -> Arc<Shell> {
    let (flat, triangles) = rectangle(Family::Diagonal, 20, 1.0, 0.3);
    let roll = |x: &Vec3| Vec3::new((1.5 * x.x).sin() / 1.5, x.y, (1.0 - (1.5 * x.x).cos()) / 1.5);
    let rest = Some(flat.iter().map(roll).collect());
    made(&(flat, triangles), Make { rest_shape: rest, ..Make::of(material) })
}

/// A strip of which one rim grew in length and width: no shape has these lengths. It starts bent, so that no load snaps it to the other side.
fn grown(material: Elasticity) -> Arc<Shell> {
    let (flat, triangles) = rectangle(Family::UnionJack, 20, 1.0, 0.3);
    let values = flat.iter().map(|x| 1.0 + 0.01 * (x.y / 0.3).powi(2)).collect();
    let start = flat.iter().map(|x| Vec3::new(x.x, x.y, 0.02 * x.x * x.x)).collect();
    let maps = vec![Map { quantity: Quantity::Growth, on: On::Vertices, values }];
    made(&(start, triangles), Make { maps, ..Make::of(material) })
}

fn stressed() -> Vec<(&'static str, Arc<Shell>)> {
    let kinds = [("Koiter", SHEET.into()), ("paper", PAPER.into())];
    let shells = kinds.iter().flat_map(|(_, material)| {
        [
            ("card", card(*material)),
            ("ruffled", ruffled(*material)),
            ("curled", curled(*material)),
            ("grown", grown(*material)),
        ]
    });
    shells.collect()
}

fn model(shell: &Arc<Shell>, fields: usize) -> Arc<Model> {
    let reduced = reduced::Options { fields, poses: 28, ..Default::default() };
    let options = Options { modes: 8, precision: Precision::F64, reduced, ..Options::default() };
    Arc::new(Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).unwrap())
}

fn at_rest(model: &Arc<Model>, method: Method, gravity: Vec3) -> Vec<Vec3> {
    let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
    state.set_gravity(gravity).unwrap();
    state.equilibrium().unwrap();
    displacements(&state)
}

/// Gravity that moves the slowest mode by about a fifth of the size.
fn strength(model: &Model) -> f64 {
    let (lambda, p) = (model.modal.eigenvalues[0], model.modal.participation().factors()[0]);
    let far = (0..model.shell.mass.len()).map(|v| model.modal.mode_at(0, v).0.norm()).fold(0.0, f64::max);
    0.2 * model.shell.mesh.size * lambda / (p.norm() * far)
}

#[test]
fn a_reduced_shell_follows_the_full_one_from_where_it_rests_under_stress() {
    for (name, shell) in stressed() {
        let model = model(&shell, 24);
        let g = strength(&model);
        let loads = [-Vec3::z(), Vec3::z(), Vec3::new(0.3, 0.5, -0.6), Vec3::x()];
        let mut errors = vec![];
        for load in loads {
            let exact = at_rest(&model, Method::ImplicitShell, g * load);
            let far = exact.iter().map(|u| u.norm()).fold(0.0, f64::max) / model.shell.mesh.size;
            let [reduced, warp] =
                [Method::ReducedShell, Method::Warp].map(|method| error(&at_rest(&model, method, g * load), &exact));
            println!("{name}, {:?}: moves {far:.3}, reduced {reduced:.4}, warp {warp:.4}", shell.material);
            errors.push((reduced, warp, far));
        }
        // Samples leave a hundredth of the forces that they were chosen by; 24 fields hold these shapes better than that.
        let worst = errors.iter().map(|e| e.0).fold(0.0, f64::max);
        assert!(worst < 0.01, "{name}: {worst}");
        assert!(errors.iter().all(|(reduced, warp, _)| reduced < warp), "{name}: {errors:?}");
        assert!(errors.iter().map(|e| e.2).fold(0.0, f64::max) > 0.05, "{name}: {errors:?}");
    }
}

#[test]
fn it_rests_there_exactly_and_swings_as_its_modes_do() {
    for (name, shell) in stressed() {
        let model = model(&shell, 8);
        let mut state = State::new(model.clone(), Method::ReducedShell, Integrator::Exact).unwrap();
        (0..50).for_each(|_| state.step(0.01).unwrap());
        assert!(displacements(&state).iter().all(|u| *u == Vec3::zeros()), "{name}");
        let energy = &model.reduced.as_ref().unwrap().energy;
        let mut stiffness = DMatrix::zeros(energy.n(), energy.n());
        energy.hessian(&vec![0.0; energy.n()], Curvature::Exact, &mut energy.scratch(), &mut stiffness);
        for (k, lambda) in model.modal.eigenvalues.iter().enumerate() {
            let off = (stiffness[(k, k)] / lambda - 1.0).abs();
            println!("{name}: mode {k} is off by {off:.1e}");
            assert!(off < 0.01, "{name}: mode {k}, {off}"); // as much as samples may leave
        }
    }
}

#[test]
fn a_saved_model_and_a_deterministic_one_move_alike() {
    for (name, shell) in [("card", card(SHEET.into())), ("ruffled", ruffled(PAPER.into()))] {
        let model = model(&shell, 8);
        let bytes = model.save().unwrap();
        let loaded = Arc::new(Model::load(&bytes).unwrap());
        assert!(loaded.save().unwrap() == bytes, "{name}");
        let portable = model.with_arithmetic(Arithmetic::Portable).unwrap();
        let run = |model: &Arc<Model>| {
            let mut state = State::new(model.clone(), Method::ReducedShell, Integrator::Exact).unwrap();
            state.set_gravity(Vec3::new(0.0, 0.0, -3.0)).unwrap();
            (0..5).for_each(|_| state.step(0.01).unwrap());
            displacements(&state)
        };
        let moved = run(&model);
        assert!(moved == run(&loaded), "{name}");
        let off = error(&run(&portable), &moved);
        assert!(off < 1e-6, "{name}: {off}"); // other sums, the same numbers
    }
}

#[test]
fn what_there_is_not_is_refused_by_name() {
    let shell = card(PAPER.into());
    let model = model(&shell, 8);
    let error = model.require(Method::PolynomialShell).err().unwrap();
    assert!(error.kind == ErrorKind::Unsupported && error.message.contains("rest angles"), "{error}");
    assert_eq!(model.chosen_method(), Method::ReducedShell);
    // Nothing holds it.
    let sheet = rectangle(Family::Diagonal, 8, 1.0, 0.3);
    let rest = sheet.0.iter().map(|x| Vec3::new(x.x, x.y, 0.1 * x.x * x.x)).collect();
    let mesh = Mesh::new(sheet.0.clone(), &sheet.1).unwrap();
    let make = Make { rest_shape: Some(rest), ..Make::of(PAPER) };
    let free = Arc::new(Shell::made(mesh, make, &Supports::default()).unwrap());
    let reduced = reduced::Options { fields: 8, ..Default::default() };
    let options = Options { modes: 12, reduced, ..Options::default() };
    let error = Model::precompute(free, &options, &mut |_, _| Ok(())).err().unwrap();
    assert!(error.kind == ErrorKind::Unsupported && error.message.contains("moves freely"), "{error}");
}
