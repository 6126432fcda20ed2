//! The sparse factorization against the matrix itself and against dense eigenvalues.

use crate::common::*;
use faer::{Mat, Side};
use shellwarp::modes::{ScaledStiffness, entries};
use shellwarp::sparse::Symbolic;
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};

fn sheet(columns: usize, rows: usize, held: bool) -> Shell {
    let (positions, triangles) = equilateral_sheet(columns, rows, 1.0);
    let bent: Vec<Vec3> = positions.iter().map(|p| Vec3::new(p.x, p.y, (0.3 * p.x).sin())).collect();
    let fixed = (0..bent.len() as u32).filter(|&v| held && bent[v as usize].x <= 1.0).collect();
    Shell::new(Mesh::new(bent, &triangles).unwrap(), Material::default(), &Supports { fixed, ..Default::default() })
        .unwrap()
}

fn analysed(shell: &Shell) -> (ScaledStiffness, Symbolic) {
    let stiffness = ScaledStiffness::assemble(shell).unwrap();
    let symbolic = Symbolic::analyse(stiffness.lower.symbolic(), &shell.points(&shell.free)).unwrap();
    (stiffness, symbolic)
}

/// The matrix A + I, its solution for given columns, and those.
fn solved(shell: &Shell) -> (ScaledStiffness, Mat<f64>, Mat<f64>) {
    let (stiffness, symbolic) = analysed(shell);
    let n = shell.n_unknowns();
    let cholesky = symbolic.cholesky(&stiffness.shifted(-1.0)).unwrap().unwrap();
    let wanted = Mat::from_fn(n, 3, |i, j| ((i * (7 + j) + 13 * j) % 101) as f64 / 50.0 - 1.0);
    let mut x = Mat::<f64>::zeros(n, 3);
    for j in 0..3 {
        let column: Vec<f64> = wanted.col(j).iter().copied().collect();
        let image = stiffness.apply(&column);
        (0..n).for_each(|i| x[(i, j)] = image[i] + column[i]);
    }
    cholesky.solve_in_place(x.as_mut()).unwrap();
    (stiffness, x, wanted)
}

#[test]
fn a_solve_inverts_the_matrix_in_either_order_of_elimination_with_the_same_bits_twice() {
    // The second sheet is large enough for nested dissection to be tried, and long enough for it to be taken.
    for shell in [sheet(30, 12, true), sheet(250, 90, true)] {
        let (stiffness, x, wanted) = solved(&shell);
        assert_eq!(x, solved(&shell).1);
        // Rounding of a product with A, over the least eigenvalue 1 of A + I.
        assert!((x - wanted).norm_max() < 1e-15 * stiffness.norm * 100.0);
    }
}

#[test]
fn a_large_sheet_is_dissected_and_a_small_one_is_not() {
    for (columns, rows, dissected) in [(30, 12, false), (250, 90, true)] {
        let shell = sheet(columns, rows, true);
        let stiffness = ScaledStiffness::assemble(&shell).unwrap();
        // Without points there is nothing to dissect.
        let pattern = stiffness.lower.symbolic();
        let by_degree = Symbolic::analyse(pattern, &[]).unwrap().operations();
        let chosen = Symbolic::analyse(pattern, &shell.points(&shell.free)).unwrap().operations();
        assert_eq!(chosen < by_degree, dissected, "{chosen:e} and {by_degree:e} by degree");
    }
}

#[test]
fn negative_eigenvalues_are_counted_all_through_the_spectrum() {
    for held in [true, false] {
        let shell = sheet(9, 5, held);
        let (stiffness, symbolic) = analysed(&shell);
        let n = shell.n_unknowns();
        let mut dense = Mat::<f64>::zeros(n, n);
        entries(&stiffness.lower).for_each(|(i, j, value)| dense[(i, j)] = value);
        let values = dense.self_adjoint_eigenvalues(Side::Lower).unwrap();
        let wide = |k: &usize| values[k + 1] - values[*k] > 1e-9 * stiffness.norm;
        let mut tried = 0;
        for k in (0..n - 1).filter(wide) {
            let shift = 0.5 * (values[k] + values[k + 1]);
            let count = symbolic.negative_eigenvalues(&stiffness.shifted(shift)).unwrap();
            assert_eq!(count, Some(k + 1), "below {shift:e}");
            tried += 1;
        }
        assert!(tried > n / 2, "{tried}");
        let above = symbolic.negative_eigenvalues(&stiffness.shifted(2.0 * stiffness.norm)).unwrap();
        assert_eq!(above, Some(n));
    }
}

#[test]
fn an_indefinite_matrix_has_no_cholesky_factor() {
    let shell = sheet(9, 5, true);
    let (stiffness, symbolic) = analysed(&shell);
    assert!(symbolic.cholesky(&stiffness.shifted(stiffness.norm)).unwrap().is_none());
}
