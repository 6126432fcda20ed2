//! Gradients and Hessians of the polynomial shell that steps take, beside those of 64 bits.

use nalgebra::DMatrix;
use shellwarp::energy::Curvature;
use shellwarp::reduced::Factor;
use shellwarp::reduced::polynomial::{Coefficients, Form, PolynomialEnergy};
use shellwarp::{arithmetic::Arithmetic, reduced::Elastic};

/// Of numbers near 1 that follow no pattern.
fn energy(n: usize, forms: usize) -> PolynomialEnergy {
    let number = |seed: usize| (0.7 * seed as f64 + 0.1 * (seed * seed) as f64).sin();
    let symmetric =
        |seed: usize| DMatrix::from_fn(n, n, |i, j| number(seed + 31 * (i + j) + 7 * i.min(j) * (1 + i.max(j))));
    let form = |k: usize| Form {
        weight: if k % 5 == 4 { -0.3 } else { 1.0 },
        bound: if k % 5 == 4 { 0.5 } else { 0.0 },
        linear: (0..n).map(|i| number(k * n + i)).collect(),
        quadratic: symmetric(1000 * k),
    };
    let third = |i: usize, j: usize, k: usize| number(i + j + k + 5 * i * j * k);
    PolynomialEnergy::new(&Coefficients {
        forms: (0..forms).map(form).collect(),
        membrane: forms - forms / 5,
        bending: symmetric(1),
        stiffness: symmetric(2),
        cubic: (0..n).map(|k| DMatrix::from_fn(n, n, |i, j| third(i, j, k))).collect(),
        engineering: None,
    })
}

/// Whatever of registers the fields fill, and whether forms are left over beside those that lie side by side or fill another side; on the
/// processor's registers and on one number at a time.
#[test]
fn steps_take_the_gradient_and_the_hessian_of_any_count_of_fields_and_forms() {
    for n in [1, 3, 4, 12, 13, 20, 28, 33] {
        for forms in [0, 1, 8, 9, 15, 16, 17, 24, 25, 31, 40] {
            for arithmetic in [Arithmetic::Fastest, Arithmetic::Portable] {
                let energy = energy(n, forms).with_arithmetic(arithmetic);
                let mut scratch = Elastic::scratch(&energy);
                let q: Vec<f64> = (0..n).map(|i| 0.3 * (2.0 * i as f64 + 0.5).cos()).collect();
                let (mut exact, mut hessian) = (vec![0.0; n], DMatrix::zeros(n, n));
                energy.gradient(&q, &mut scratch, &mut exact);
                energy.hessian(&q, Curvature::Exact, &mut scratch, &mut hessian);
                let (mut near, mut factor) = (vec![0.0; n], Factor::new(n, Elastic::arch(&energy)));
                energy.near_gradient(&q, &mut scratch, &mut near);
                // Twice, for the second finds what the first has left.
                for turn in 0..2 {
                    energy.near_hessian(&q, &mut scratch, &mut factor);
                    let entries = (0..n).flat_map(|i| (i..n).map(move |j| (i, j)));
                    let off = entries.map(|(i, j)| (factor.entry(i, j) - hessian[(i, j)]).abs()).fold(0.0, f64::max);
                    // Q of 16 bits misses 2⁻⁸ of each number at most, and the larger the sum the less.
                    assert!(off <= 4e-3 * hessian.amax(), "{n} fields, {forms} forms, {turn}: {off}");
                }
                let size = exact.iter().fold(0.0f64, |most, x| most.max(x.abs()));
                let off = exact.iter().zip(&near).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                // Sums of some hundred numbers of 32 bits.
                assert!(off <= 1e-5 * size, "{n} fields, {forms} forms: {off} of {size}");
            }
        }
    }
}
