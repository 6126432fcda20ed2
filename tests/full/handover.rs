//! Going on by the full shell from a pose that fields have.

use crate::common::{displacements, equilateral_sheet, leaf, mass_error};
use shellwarp::constraint::{Constraint, Target};
use shellwarp::model::{Model, Options};
use shellwarp::state::{Method, State};
use shellwarp::step::Integrator;
use shellwarp::{Material, Mesh, Shell, Supports, Vec3, reduced};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

fn model(shell: Shell) -> Arc<Model> {
    let reduced = reduced::Options { fields: 20, poses: 40, ..Default::default() };
    let options = Options { modes: 8, reduced, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
}

/// A thin strip that is twisted by a quarter of a turn, held at one end.
fn helicoid() -> Shell {
    let (mut positions, triangles) = equilateral_sheet(16, 9, 0.075);
    for x in &mut positions {
        let (turn, across) = (FRAC_PI_2 * x.x / 1.2, 0.6 * (x.y - 0.3));
        *x = Vec3::new(x.x, across * turn.cos(), across * turn.sin());
    }
    let fixed = (0..positions.len() as u32).filter(|v| positions[*v as usize].x < 0.08).collect();
    let material = Material { k_area: 1e4, k_length: 1e4, k_bend: 0.3, area_density: 1.0 };
    Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &Supports { fixed, ..Default::default() }).unwrap()
}

type Load<'a> = Box<dyn Fn(&mut State) + 'a>;

/// At rest where `set` leads it.
fn at_rest(model: &Arc<Model>, method: Method, set: &dyn Fn(&mut State)) -> State {
    let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
    set(&mut state);
    state.equilibrium().unwrap();
    state
}

/// Poses of fields stretch a shell a little everywhere, and hold up to a hundred times the energy of the equilibrium beside them. From that load
/// the way to the present one led to other equilibria, 61 to 231 % off, with six of the eight handles, and took 81 to 209 iterations.
#[test]
fn the_full_shell_finds_the_equilibrium_beside_a_pose_of_fields() {
    for (name, shell) in [("helicoid", helicoid()), ("leaf", leaf(1))] {
        let model = model(shell);
        let (rest, size) = (&model.shell.mesh.positions, model.shell.mesh.size);
        let tip = (0..rest.len()).max_by(|a, b| rest[*a].x.total_cmp(&rest[*b].x)).unwrap();
        let led = |way: [f64; 3]| {
            move |state: &mut State| {
                let target = Target::Position(rest[tip] + size * Vec3::from(way));
                let handle = Constraint { id: 1, vertex: tip as u32, axes: [true; 3], compliance: 0.0, target };
                state.set_constraint(handle).unwrap();
            }
        };
        let weighed = |gravity: [f64; 3]| move |state: &mut State| state.set_gravity(Vec3::from(gravity)).unwrap();
        let mut loads: Vec<Load> = vec![];
        for way in [[0.0, 0.0, 0.1], [0.0, 0.1, 0.1], [-0.05, 0.0, 0.2], [0.0, 0.2, 0.0]] {
            loads.push(Box::new(led(way)));
        }
        for gravity in [[0.0, 0.3, -0.5], [0.3, 1.0, 1.0], [0.0, 0.0, 3.0]] {
            loads.push(Box::new(weighed(gravity)));
        }
        for (k, set) in loads.iter().enumerate() {
            let exact = displacements(&at_rest(&model, Method::ImplicitShell, set));
            let mut state = at_rest(&model, Method::PolynomialShell, set);
            let off = |state: &State| mass_error(&model.shell, &displacements(state), &exact);
            let before = off(&state);
            state.set_method(Method::ImplicitShell).unwrap();
            let (_, iterations) = state.equilibrium().unwrap();
            println!("{name}, load {k}: {before:.5} off, then {:.1e} after {iterations} iterations", off(&state));
            assert!(off(&state) < 1e-5, "{name}, load {k}"); // equilibria are found to 1e-8 of the load, and soft shells give way by more
            // Where the pose is more than a tenth off, the search may find none beside it, and the way from rest is taken.
            assert!(iterations <= 30 || before > 0.1, "{name}, load {k}: {iterations}");
        }
    }
}

/// A second search goes on from where the first one came to, as it does where no other method was.
#[test]
fn an_equilibrium_of_the_full_shell_is_no_foreign_pose() {
    let model = model(leaf(1));
    let weigh = |state: &mut State| state.set_gravity(Vec3::new(0.3, 1.0, 1.0)).unwrap();
    let mut state = at_rest(&model, Method::PolynomialShell, &weigh);
    state.set_method(Method::ImplicitShell).unwrap();
    state.equilibrium().unwrap();
    let found = displacements(&state);
    let (_, iterations) = state.equilibrium().unwrap();
    let (_, again) = state.equilibrium().unwrap();
    assert!(iterations <= 3 && again == iterations, "{iterations} {again}"); // to rounding
    assert!(mass_error(&model.shell, &displacements(&state), &found) < 1e-9);
    state.set_gravity(Vec3::new(0.3, 1.0, 1.1)).unwrap();
    let mut direct = State::new(model.clone(), Method::ImplicitShell, Integrator::Exact).unwrap();
    direct.set_gravity(Vec3::new(0.3, 1.0, 1.1)).unwrap();
    direct.equilibrium().unwrap();
    state.equilibrium().unwrap();
    assert!(mass_error(&model.shell, &displacements(&state), &displacements(&direct)) < 1e-5);
}
