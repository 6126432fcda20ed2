//! The estimate of a step's error of the full shell, against the same step in small parts.

use crate::common::*;
use shellwarp::model::{Model, Options};
use shellwarp::state::{Damping, Method, State};
use shellwarp::step::Integrator;
use shellwarp::{Result, Vec3};
use std::sync::Arc;

const PARTS: usize = 16;

fn leaf_that_falls(model: &Arc<Model>, method: Method) -> State {
    let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
    state.set_damping(&Damping { mass_coefficient: 1.0, ..Default::default() }).unwrap();
    state.set_gravity(Vec3::new(0.0, 0.0, -0.2)).unwrap();
    state
}

fn apart(a: &State, b: &State) -> f64 {
    let mass = &a.model().shell.mass;
    let squares: f64 =
        displacements(a).iter().zip(displacements(b)).zip(mass).map(|((a, b), m)| m * (a - b).norm_squared()).sum();
    (squares / a.model().shell.total_mass).sqrt()
}

/// Over a fall the estimate is the true error of each step, by the square of the step, within a factor of two: stiff modes that a step does
/// not resolve are what is left.
#[test]
fn the_full_shell_tells_what_a_step_gets_wrong() -> Result<()> {
    let model = Arc::new(Model::precompute(
        Arc::new(leaf(1)),
        &Options { modes: 4, ..Options::default() },
        &mut |_, _| Ok(()),
    )?);
    let period = std::f64::consts::TAU / model.modal.eigenvalues[0].sqrt();
    let mut at = vec![];
    for steps in [40, 80] {
        let h = period / steps as f64;
        let mut state = leaf_that_falls(&model, Method::ImplicitShell);
        assert_eq!(state.report().step_error, 0.0);
        let (mut told, mut true_error) = (0.0, 0.0);
        for k in 0..steps {
            let before = state.save();
            state.step(h)?;
            let mut fine = leaf_that_falls(&model, Method::ImplicitShell);
            fine.load(&before)?;
            assert_eq!(fine.report().step_error, 0.0);
            (0..PARTS).try_for_each(|_| fine.step(h / PARTS as f64))?;
            let (found, is) = (state.report().step_error, apart(&state, &fine));
            if k > steps / 10 {
                told += found;
                true_error += is;
            }
        }
        println!("{steps} steps a period: told {told:.3e}, is {true_error:.3e} in sum");
        assert!((0.5..2.0).contains(&(told / true_error)), "{told} of {true_error}");
        at.push(told / steps as f64);
        state.reset();
        assert_eq!(state.report().step_error, 0.0);
    }
    assert!((3.0..5.0).contains(&(at[0] / at[1])), "the square of the step: {at:?}");
    Ok(())
}
