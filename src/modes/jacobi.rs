//! Eigenpairs of a small AᵀA-like stiffness to the accuracy of its rows, by one-sided Jacobi rotations.
//!
//! A = BᵀB with a row of B for each energy term. A symmetric eigensolver on A is accurate to 1e-16 ‖A‖: eigenvalues below
//! that are noise. Working on B, the same numbers are accurate to 1e-16 ‖B‖ in √λ, so that 1e-16 √(‖A‖/λ) of an eigenvalue
//! is lost instead of 1e-16 ‖A‖/λ.

use crate::Shell;
use faer::Mat;

/// Columns are orthogonal when the cosine between them is below this: rounding of a sum of a few hundred products.
const ORTHOGONAL: f64 = 1e-15;

/// Starting from nearly right vectors two or three sweeps do.
const MAX_SWEEPS: usize = 30;

/// Turns the columns of `vectors` (n × n, orthonormal) into eigenvectors; returns the eigenvalues, in the columns' order.
pub fn refine(shell: &Shell, vectors: &mut Mat<f64>) -> Vec<f64> {
    let mut images = &scaled_rows(shell) * &*vectors;
    let n = vectors.ncols();
    for _ in 0..MAX_SWEEPS {
        let mut rotated = false;
        for (p, q) in (0..n).flat_map(|p| (p + 1..n).map(move |q| (p, q))) {
            rotated |= orthogonalize(&mut images, vectors, p, q);
        }
        if !rotated {
            break;
        }
    }
    (0..n).map(|j| images.col(j).squared_norm_l2()).collect()
}

/// Rotates columns p and q of both matrices so that the images are orthogonal; whether anything had to be done.
fn orthogonalize(images: &mut Mat<f64>, vectors: &mut Mat<f64>, p: usize, q: usize) -> bool {
    let product = images.col(p).transpose() * images.col(q);
    let (a, b) = (images.col(p).squared_norm_l2(), images.col(q).squared_norm_l2());
    if product.abs() <= ORTHOGONAL * a.sqrt() * b.sqrt() {
        return false;
    }
    let zeta = (b - a) / (2.0 * product);
    let tangent = zeta.signum() / (zeta.abs() + libm::hypot(zeta, 1.0));
    let cosine = libm::hypot(tangent, 1.0).recip();
    rotate(images, p, q, cosine, cosine * tangent);
    rotate(vectors, p, q, cosine, cosine * tangent);
    // A rotation that changes nothing in 53 bits ends the sweep's work here; else two noise columns would turn for ever.
    tangent.abs() > f64::EPSILON
}

fn rotate(matrix: &mut Mat<f64>, p: usize, q: usize, cosine: f64, sine: f64) {
    for i in 0..matrix.nrows() {
        let (x, y) = (matrix[(i, p)], matrix[(i, q)]);
        matrix[(i, p)] = cosine * x - sine * y;
        matrix[(i, q)] = sine * x + cosine * y;
    }
}

/// B M^−½ (energy terms that see what moves × n).
fn scaled_rows(shell: &Shell) -> Mat<f64> {
    let mut index = vec![None; shell.mass.len()];
    shell.free.iter().enumerate().for_each(|(i, &v)| index[v as usize] = Some(i));
    let mut rows: Vec<Vec<(usize, f64)>> = vec![];
    shell.energy.visit_rest_rows(&mut |(vertices, row)| {
        let mut line = vec![];
        for (&v, gradient) in vertices.iter().zip(row) {
            if let Some(i) = index[v as usize] {
                let root = shell.mass[v as usize].sqrt();
                let gradient = shell.roller_of(v).map_or(*gradient, |roller| roller.free * gradient);
                line.extend((0..3).map(|c| (3 * i + c, gradient[c] / root)));
            }
        }
        if !line.is_empty() {
            rows.push(line);
        }
    });
    let mut matrix = Mat::zeros(rows.len(), shell.n_unknowns());
    for (r, line) in rows.iter().enumerate() {
        line.iter().for_each(|&(k, value)| matrix[(r, k)] += value);
    }
    matrix
}
