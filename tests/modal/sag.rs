//! Linearised where it hangs: exact under the gravity it was linearised under, close to it under others.

use crate::common::*;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::{Error, ErrorKind, Material, Mesh, Shell, Supports, Vec3};
use std::sync::Arc;

fn model(shell: &Arc<Shell>, sag: Vec3) -> Arc<Model> {
    let options = Options { modes: 8, precision: Precision::F64, sag, ..Options::default() };
    Arc::new(Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).unwrap())
}

/// Deformed positions at rest under `gravity`.
fn at_rest(model: &Arc<Model>, method: Method, gravity: Vec3) -> Vec<Vec3> {
    let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
    state.set_gravity(gravity).unwrap();
    state.equilibrium().unwrap();
    let mut x = vec![Vec3::zeros(); model.shell.mass.len()];
    state.positions(Space::Frame, |v, p| x[v] = p);
    x
}

fn distance(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm_squared()).sum::<f64>().sqrt()
}

/// Error relative to the displacement from the rest shape, with the plain and with the sagged model.
fn errors(shell: &Arc<Shell>, sag: Vec3, gravity: Vec3, method: Method) -> (f64, f64) {
    let rest = &shell.mesh.positions;
    let (plain, sagged) = (model(shell, Vec3::zeros()), model(shell, sag));
    let exact = at_rest(&plain, Method::ImplicitShell, gravity);
    let size = distance(&exact, rest);
    let error = |model| distance(&at_rest(model, method, gravity), &exact) / size;
    (error(&plain), error(&sagged))
}

const OBLIQUE: Vec3 = Vec3::new(0.0, 0.6, -0.8);
const DOWN: Vec3 = Vec3::new(0.0, 0.0, -1.0);

#[test]
fn under_its_own_gravity_the_sagged_shape_is_exact_and_stays() {
    for (name, gravity) in [("flat_beam", 0.4 * DOWN), ("v_beam", 3.0 * OBLIQUE)] {
        let shell = Arc::new(reference(name).0);
        let model = model(&shell, gravity);
        let exact = at_rest(&self::model(&shell, Vec3::zeros()), Method::ImplicitShell, gravity);
        for method in [Method::LinearModalAnalysis, Method::Warp, Method::VirtualWorkWarp] {
            let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
            state.set_gravity(gravity).unwrap();
            (0..100).for_each(|_| state.step(1.0 / 30.0).unwrap());
            assert_eq!(state.report().max_displacement, 0.0, "{name}, {method:?}: nothing pulls it away");
            let mut x = vec![Vec3::zeros(); exact.len()];
            state.positions(Space::Frame, |v, p| x[v] = p);
            assert!(distance(&x, &exact) <= 1e-9 * distance(&exact, &shell.mesh.positions)); // two solves to 1e-8 of the load
        }
    }
}

#[test]
fn under_other_gravities_it_has_the_errors_known_from_an_independent_implementation() {
    // Four fifths of the gravity, to the digits that are known: .003 and .013.
    for (name, sag, expected) in [("flat_beam", 0.4 * DOWN, 0.003), ("v_beam", 5.0 * DOWN, 0.013)] {
        let shell = Arc::new(reference(name).0);
        let (plain, sagged) = errors(&shell, sag, 0.8 * sag, Method::Warp);
        println!("{name}: {plain:.4} from the rest shape, {sagged:.4} from the sagged one");
        assert!((sagged - expected).abs() <= 0.0006 && sagged < 0.25 * plain, "{name}: {sagged} after {plain}");
    }
    // Tilted by 10°: .0001 to .02.
    for (name, sag) in [("flat_beam", 0.4 * DOWN), ("v_beam", 5.0 * DOWN), ("v_beam", 3.0 * OBLIQUE)] {
        let shell = Arc::new(reference(name).0);
        let tilted = nalgebra::Rotation3::from_axis_angle(&Vec3::x_axis(), 10f64.to_radians()) * sag;
        for method in [Method::Warp, Method::VirtualWorkWarp] {
            let (plain, sagged) = errors(&shell, sag, tilted, method);
            println!("{name}, {method:?}, tilted: {plain:.4} from the rest shape, {sagged:.4} from the sagged one");
            assert!(sagged < 0.02 && sagged < 0.1 * plain, "{name}: {sagged} after {plain}");
        }
    }
}

#[test]
fn small_motions_have_the_period_of_the_nonlinear_shell_there() {
    // The flat beam at 45° has a first frequency a sixth above the straight one's. Released from a slightly smaller load.
    let shell = Arc::new(reference("flat_beam").0);
    let gravity = 0.4 * DOWN;
    let model = model(&shell, gravity);
    let period = |method: Method| {
        let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
        state.set_gravity(0.99 * gravity).unwrap();
        state.equilibrium().unwrap();
        state.set_gravity(gravity).unwrap();
        let tip = |state: &State| {
            let mut z = 0.0;
            state.positions(Space::Frame, |v, x| z = if v == 204 { x.z } else { z });
            z
        };
        let start = tip(&state);
        let (h, mut time, mut last, mut lowest) = (1.0 / 240.0, 0.0, start, f64::INFINITY);
        while tip(&state) <= last || time < 1.0 {
            (last, lowest) = (tip(&state), lowest.min(tip(&state)));
            state.step(h).unwrap();
            time += h;
        }
        assert!(lowest < start);
        2.0 * time // from the highest point to the lowest is half a period
    };
    let (warp, exact) = (period(Method::Warp), period(Method::ImplicitShell));
    println!("period {warp} s, nonlinear {exact} s");
    // Turning points are found to a step of 1/240 s; backward Euler lags by another.
    assert_close("period", warp, exact, 0.01, 0.0);
}

#[test]
fn what_cannot_hang_at_rest_is_refused() {
    let (positions, triangles) = equilateral_sheet(6, 4, 0.1);
    let mesh = Mesh::new(positions, &triangles).unwrap();
    let free = Arc::new(Shell::new(mesh, Material::default(), &Supports::default()).unwrap());
    let options = Options { sag: DOWN, ..Options::default() };
    let error = Model::precompute(free, &options, &mut |_, _| Ok(())).err().unwrap();
    assert!(error.message.contains("no equilibrium"), "{}", error.message);
    // And a cancel is heard on the way.
    let shell = Arc::new(reference("v_beam").0);
    let mut stop = |_, _| Err(Error::new(ErrorKind::Cancelled, "stop"));
    let error = Model::precompute(shell, &options, &mut stop).err().unwrap();
    assert_eq!(error.kind, ErrorKind::Cancelled);
}
