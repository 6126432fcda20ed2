//! Reduced shells come to rest where nothing loads them: the terms of their energy vanish there, and rounding is all that is left.

use crate::plates::*;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::material::{Crease, ElasticSheet, Elasticity};
use shellwarp::mesh::Mesh;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reduced;
use shellwarp::shell::Make;
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::{Material, Shell, Supports, Vec3};
use std::sync::Arc;

const SHEET: ElasticSheet = ElasticSheet { young: 1e6, poisson: 0.3, thickness: 0.01, volume_density: 20.0 };
/// As thin as foil: rounding of its stretching pulls as its bending does.
const FOIL: ElasticSheet = ElasticSheet { young: 1e9, poisson: 0.3, thickness: 2e-5, volume_density: 1000.0 };
const PAPER: Material = Material { k_area: 4000.0, k_length: 300.0, k_bend: 0.015, area_density: 0.2 };
/// Of a length of 1.
const HEIGHT: f64 = 0.2;

/// A card of length 1 and width 0.3, clamped at x = 0, with a soft fold across its middle; flat or a gutter.
fn card(material: Elasticity, curved: bool, folds: bool) -> Arc<Model> {
    let (mut positions, triangles) = rectangle(Family::Diagonal, 20, 1.0, 0.3);
    positions.iter_mut().filter(|_| curved).for_each(|x| x.z = 0.8 * (x.y - 0.15).powi(2));
    let mesh = Mesh::new(positions, &triangles).unwrap();
    let on = |v: &u32| folds && (mesh.positions[*v as usize].x - 0.5).abs() < 1e-9;
    let folds = mesh.edges.iter().map(|e| e.vertices).filter(|ends| ends.iter().all(on));
    let crease = |vertices: [u32; 2]| Crease { vertices, factor: 0.05, angle: None, yield_angle: f64::INFINITY };
    let make = Make { creases: folds.map(crease).collect(), ..Make::of(material) };
    let at = |x: f64| -> Vec<u32> {
        (0..mesh.positions.len() as u32).filter(|v| (mesh.positions[*v as usize].x - x).abs() < 1e-9).collect()
    };
    let (clamped, handles) = (at(0.0), at(1.0));
    let shell = Arc::new(Shell::made(mesh.clone(), make, &Supports { clamped, ..Supports::default() }).unwrap());
    let reduced = reduced::Options { fields: 16, poses: 12, ..Default::default() };
    let options = Options { modes: 8, precision: Precision::F64, reduced, handles, ..Options::default() };
    Arc::new(Model::precompute(shell, &options, &mut |_, _| Ok(())).unwrap())
}

/// The far corners, lifted so far by hard handles.
fn lift(state: &mut State, height: f64) {
    let mesh = state.model().shell.mesh.clone();
    let at_corner = |x: &Vec3| x.x > 1.0 - 1e-9 && (x.y - 0.15).abs() > 0.149;
    for (v, x) in mesh.positions.iter().enumerate().filter(|(_, x)| at_corner(x)) {
        let (vertex, target) = (v as u32, Target::Position(x + Vec3::new(0.0, 0.0, height)));
        let axes = [false, false, true];
        state.set_constraint(Constraint { id: vertex, vertex, axes, compliance: 0.0, target }).unwrap();
    }
}

/// The largest distance from the mesh, of its size.
fn off(state: &State) -> f64 {
    let mesh = &state.model().shell.mesh;
    let mut most = 0.0f64;
    state.positions(Space::World, |v, x| most = most.max((x - mesh.positions[v]).norm()));
    most / mesh.size
}

const METHODS: [Method; 2] = [Method::ReducedShell, Method::PolynomialShell];

#[test]
fn a_card_whose_handles_are_let_go_without_load_comes_to_rest() {
    let materials: [(Elasticity, bool, bool); 5] = [
        (SHEET.into(), false, true),
        (SHEET.into(), true, false),
        (FOIL.into(), false, false),
        (PAPER.into(), false, true),
        (PAPER.into(), true, true),
    ];
    for (material, curved, folds) in materials {
        let model = card(material, curved, folds);
        for method in METHODS {
            let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
            state.equilibrium().unwrap_or_else(|e| panic!("{material:?} {method:?} at once: {e}"));
            assert!(off(&state) < 1e-12, "{material:?} {method:?}: {}", off(&state)); // rounding of the basis, in 64 bits
            lift(&mut state, HEIGHT);
            state.equilibrium().unwrap_or_else(|e| panic!("{material:?} {method:?} lifted: {e}"));
            assert!(off(&state) > 0.1);
            state.clear_constraints();
            for time in 0..3 {
                let (residual, iterations) =
                    state.equilibrium().unwrap_or_else(|e| panic!("{material:?} {method:?} let go: {e}"));
                println!("{method:?}: {:.1e} off, residual {residual:.1e}, {iterations} iterations", off(&state));
                // UNSEEN is 1e-9; the last step takes most of what was left.
                assert!(off(&state) < 1e-9, "{material:?} {method:?}, time {time}: {}", off(&state));
            }
            lift(&mut state, 0.0); // to where it rests by itself
            state.equilibrium().unwrap_or_else(|e| panic!("{material:?} {method:?} held at rest: {e}"));
            assert!(off(&state) < 1e-9, "{material:?} {method:?}: {}", off(&state));
        }
    }
}

/// A load however small is balanced to the tolerance as before: it is not taken for none.
#[test]
fn a_load_of_a_billionth_sags_by_a_billionth() {
    let model = card(SHEET.into(), false, false);
    for method in METHODS {
        let sag = |gravity: f64| {
            let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
            state.set_gravity(Vec3::new(0.0, 0.0, -gravity)).unwrap();
            state.equilibrium().unwrap();
            off(&state)
        };
        let (small, tiny) = (sag(1e-6), sag(1e-12));
        println!("{method:?}: {small:e} {tiny:e}");
        // Positions of 64 bits beside a sag of 1e-12 of the size: 1e-4 of it.
        assert!((tiny / small * 1e6 - 1.0).abs() < 1e-3, "{method:?}: {small:e} {tiny:e}");
    }
}
