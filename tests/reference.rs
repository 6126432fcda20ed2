//! The nonlinear solver against independent equilibria, closed forms, itself at other steps, and conservation laws.
#![allow(missing_docs)]
mod common;
use common::*;
use shellwarp::reference::*;
use shellwarp::{Shell, Vec3};
use std::sync::Arc;

fn gravity_forces(shell: &Shell, g: Vec3) -> Vec<Vec3> {
    shell.mass.iter().map(|m| *m * g).collect()
}

fn numbers(value: &serde_json::Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

#[test]
fn exper() {
    for name in ["flat_beam", "v_beam"] {
        let (shell, json) = reference(name);
        let shell = Arc::new(shell);
        let mut solver = Solver::new(shell.clone()).unwrap();
        let n = shell.mass.len();
        for case in json["equilibria"].as_array().unwrap() {
            let gravity = Vec3::from_vec(numbers(&case["gravity"]));
            let forces = gravity_forces(&shell, gravity);
            for first_increment in [1.0, 0.25, 0.1] {
                let t = std::time::Instant::now();
                let mut log = vec![];
                let r = solver.equilibrium(
                    &vec![Vec3::zeros(); n],
                    &forces,
                    &EquilibriumOptions { first_increment, ..Default::default() },
                    &mut |p| {
                        log.push(p.residual);
                        Ok(())
                    },
                );
                match r {
                    Ok(e) => {
                        let l2 = e.displacement.iter().map(|u| u.norm_squared()).sum::<f64>().sqrt();
                        let x = case["ds_l2"].as_f64().unwrap();
                        println!(
                            "{name} {gravity:?} inc {first_increment}: it {} incs {} res {:.1e} l2 err {:.1e} {:?} json res {} last {:?}",
                            e.iterations,
                            e.increments,
                            e.residual,
                            l2 / x - 1.0,
                            t.elapsed(),
                            case["ds_residual"],
                            &log[log.len().saturating_sub(4)..]
                        );
                    }
                    Err(e) => println!("{name} {gravity:?} inc {first_increment}: {e}"),
                }
            }
        }
    }
}
