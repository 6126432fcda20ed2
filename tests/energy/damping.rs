//! Damping that differs over the shell: by every method against each other and the decay of a mode, and what is refused.

use crate::common::*;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reduced;
use shellwarp::state::{Damping, Method, State};
use shellwarp::step::Integrator;
use shellwarp::{ErrorKind, Material, Mesh, Shell, Supports, Vec3};
use std::f64::consts::TAU;
use std::sync::Arc;

const SOFT: Material = Material { k_area: 4000.0, k_length: 300.0, k_bend: 0.015, area_density: 0.2 };

fn strip(held: bool) -> Arc<Shell> {
    let (positions, triangles) = equilateral_sheet(20, 4, 0.05);
    let clamped = (0..positions.len() as u32).filter(|v| held && positions[*v as usize].x < 0.03).collect();
    let supports = Supports { clamped, ..Supports::default() };
    Arc::new(Shell::new(Mesh::new(positions, &triangles).unwrap(), SOFT, &supports).unwrap())
}

fn model(shell: &Arc<Shell>, modes: usize) -> Arc<Model> {
    let reduced = reduced::Options { fields: 12, poses: 12, ..Default::default() };
    let options = Options { modes, precision: Precision::F64, reduced, ..Options::default() };
    Arc::new(Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).unwrap())
}

const METHODS: [Method; 5] =
    [Method::LinearModalAnalysis, Method::Warp, Method::ReducedShell, Method::PolynomialShell, Method::ImplicitShell];

/// Where it is some periods of the slowest mode after it was let go from where a light weight holds it.
fn released(model: &Arc<Model>, method: Method, damping: &Damping, periods: f64) -> Vec<Vec3> {
    let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
    state.set_damping(damping).unwrap();
    state.set_gravity(Vec3::new(0.0, 0.0, -0.05)).unwrap();
    state.equilibrium().unwrap();
    state.set_gravity(Vec3::zeros()).unwrap();
    let h = TAU / model.modal.eigenvalues[0].sqrt() / 100.0;
    (0..(100.0 * periods) as usize).for_each(|_| state.step(h).unwrap());
    displacements(&state)
}

/// The amplitude of the slowest mode in a displacement.
fn first(model: &Model, u: &[Vec3]) -> f64 {
    (0..u.len()).map(|v| model.shell.mass[v] * model.modal.mode_at(0, v).0.dot(&u[v])).sum()
}

#[test]
fn equal_factors_are_a_factor_on_the_coefficient() {
    let model = model(&strip(true), 6);
    let factors: Arc<[f64]> = vec![2.5; model.shell.mass.len()].into();
    for method in METHODS {
        let by_vertices = Damping { mass_coefficient: 0.4, factors: factors.clone(), ..Damping::default() };
        let plain = Damping { mass_coefficient: 1.0, ..Damping::default() };
        let [a, b] = [by_vertices, plain].map(|damping| released(&model, method, &damping, 0.3));
        let off = error(&a, &b);
        println!("{method:?}: {off:.1e}");
        assert!(off < rounding(method), "{method:?}: {off}");
    }
    let ratio = |ratio: f64, factors: &Arc<[f64]>| Damping {
        ratios: vec![ratio],
        factors: factors.clone(),
        ..Damping::default()
    };
    for method in &METHODS[..4] {
        let [a, b] = [ratio(0.02, &factors), ratio(0.05, &Arc::default())].map(|d| released(&model, *method, &d, 0.3));
        assert!(error(&a, &b) < rounding(*method), "{method:?}");
    }
}

/// BᵀMB is the identity to rounding in 64 bits. The polynomial's stages step by a Hessian of 32, which either damping rounds in its own way.
fn rounding(method: Method) -> f64 {
    if method == Method::PolynomialShell { 1e-6 } else { 1e-9 }
}

#[test]
fn a_mode_decays_by_the_mean_factor_of_what_moves_in_it_in_every_method() {
    let shell = strip(true);
    let model = model(&shell, 6);
    let middle = 0.5 * shell.mesh.positions.iter().map(|x| x.x).fold(0.0, f64::max);
    let omega = model.modal.eigenvalues[0].sqrt();
    for (inner, outer) in [(1.0, 0.0), (0.0, 1.0), (1.0, 5.0)] {
        let factor = |x: &Vec3| if x.x < middle { inner } else { outer };
        let factors: Vec<f64> = shell.mesh.positions.iter().map(factor).collect();
        // To first order in damping, by Rayleigh's quotient: c = ξ Σ m f |φ|².
        let mean: f64 =
            (0..factors.len()).map(|v| shell.mass[v] * factors[v] * model.modal.mode_at(0, v).0.norm_squared()).sum();
        let (xi, periods) = (0.1 * omega / mean, 1.0);
        let expected = (-0.5 * xi * mean * periods * TAU / omega).exp();
        let damping = Damping { mass_coefficient: xi, factors: factors.into(), ..Damping::default() };
        for method in METHODS {
            let [damped, free] =
                [damping.clone(), Damping::default()].map(|d| first(&model, &released(&model, method, &d, periods)));
            println!("{inner} {outer} {method:?}: {:.4}, expected {expected:.4}", damped / free);
            // The swing is a little later by damping, which costs the square of c/2ω, and other modes ride along.
            assert!(
                (damped / free / expected - 1.0).abs() < 0.005,
                "{inner} {outer} {method:?}: {} of {expected}",
                damped / free
            );
        }
    }
}

#[test]
fn what_is_no_damping_is_refused_by_name_and_changes_nothing() {
    let model = model(&strip(true), 6);
    let n = model.shell.mass.len();
    let mut state = State::new(model.clone(), Method::Warp, Integrator::Exact).unwrap();
    let mut refused = |factors: Vec<f64>, words: &[&str]| {
        let damping = Damping { mass_coefficient: 1.0, factors: factors.into(), ..Damping::default() };
        let error = state.set_damping(&damping).unwrap_err();
        assert!(
            error.kind == ErrorKind::InvalidArgument && words.iter().all(|word| error.message.contains(word)),
            "{error}"
        );
    };
    refused(vec![1.0; n - 1], &["factors", &n.to_string()]);
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        let mut factors = vec![1.0; n];
        factors[7] = bad;
        refused(factors, &["factors[7]"]);
    }
    let free = self::model(&strip(false), 14);
    let mut state = State::new(free.clone(), Method::ReducedShell, Integrator::Exact).unwrap();
    let factors = vec![1.0; free.shell.mass.len()].into();
    let error = state.set_damping(&Damping { factors, ..Damping::default() }).unwrap_err();
    assert!(error.kind == ErrorKind::Unsupported && error.message.contains("moves freely"), "{error}");
}
