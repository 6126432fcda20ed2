//! The polynomial energy's kernel beside its floor, streaming its coefficients once.

use crate::contest::{Contestant, Stream, measure};
use nalgebra::DMatrix;
use pulp::Arch;
use shellwarp::energy::Curvature;
use shellwarp::reduced::polynomial::{Coefficients, Form, PolynomialEnergy};
use std::fmt::Write;
use std::hint::black_box;

/// Modes and fields together, and forms as leaves have them.
const SIZES: [(usize, usize); 3] = [(20, 31), (28, 34), (48, 40)];

/// With numbers that mean nothing; time does not depend on them.
pub fn energy(n: usize, forms: usize) -> PolynomialEnergy {
    let symmetric = |seed: usize| DMatrix::from_fn(n, n, |i, j| ((seed + i + j) as f64).sin());
    let form = |k: usize| Form {
        weight: 1.0,
        bound: 0.0,
        linear: (0..n).map(|i| ((k * n + i) as f64).cos()).collect(),
        quadratic: symmetric(7 * k),
    };
    let coefficients = Coefficients {
        forms: (0..forms).map(form).collect(),
        membrane: forms - 4,
        bending: symmetric(1),
        stiffness: symmetric(2),
        cubic: (0..n).map(symmetric).collect(), // sin(i + j + k) is symmetric
        engineering: None,
    };
    PolynomialEnergy::new(&coefficients)
}

/// Microseconds of an evaluation, and the ratio to the floor.
pub fn table() -> String {
    let mut text = "### The polynomial shell's energy, µs, and the ratio to its floor\n\n".to_owned();
    text += "| modes and fields | forms | floor | gradient | and Hessian |\n| ---: | ---: | ---: | ---: | ---: |\n";
    for (n, forms) in SIZES {
        let (energy, arch) = (energy(n, forms), Arch::new());
        let floats: Vec<f32> = (0..energy.bytes() / 64 * 16).map(|k| (k % 7) as f32).collect();
        let places = [0.1, 0.11].map(|size: f64| (0..n).map(|k| size * (k as f64).sin()).collect::<Vec<f64>>());
        let (mut gradient, mut hessian) = (vec![0.0; n], DMatrix::zeros(n, n));
        let [mut first, mut second] = [energy.scratch(), energy.scratch()];
        let (mut turn, mut other_turn) = (0, 0);
        let mut all = [
            Contestant::new("floor", || {
                arch.dispatch(Stream { basis: black_box(&floats), block: floats.len(), out: None });
            }),
            Contestant::new("gradient", || {
                turn = 1 - turn; // what was asked for last costs nothing
                energy.gradient(&places[turn], &mut first, &mut gradient);
                black_box(&gradient);
            }),
            Contestant::new("and Hessian", || {
                other_turn = 1 - other_turn;
                energy.lower_hessian(&places[other_turn], Curvature::Exact, &mut second, &mut hessian);
                black_box(&hessian);
            }),
        ];
        measure(&mut all);
        let [floor, gradient, both] = [0, 1, 2].map(|k: usize| 1e6 * all[k].best);
        let _ = writeln!(
            text,
            "| {n} | {forms} | {floor:.2} | {gradient:.2} ({:.2}) | {both:.2} ({:.2}) |",
            gradient / floor,
            both / floor
        );
    }
    text
}
