//! Strains as the shell's elements have them, where the membrane carries the loads: forms are Green's strains, which grow faster.
//!
//! An edge whose Green's strain is z has the engineering strain √(1 + 2z) − 1. The strains of elements are to second order those of forms less a
//! square: ŝ_j = s_j − ½ C_j(s, s), with C of the second derivatives of all elements' strains. Taken on, as for one edge,
//!
//!   ŝ = ⅓ s + ⅔ r,   (1 + ¾ M(s)) r = s,   M(s)_ja = Σ_b C_jab s_b,
//!
//! which is within 3 % of that root from z = −0.3 to 2 and goes on growing. The first [`LEADING`] forms count so, which are turned to hold most of
//! the strains of the shapes that the shell is likely to take; the others stay as they are.
//!
//! Pressed together beyond all that a shell can be, 1 + ¾ M is singular: from little before that on, r is as large as it can be.

use super::super::sums::Sums;
use nalgebra::{SMatrix, SVector};
use pulp::Simd;

/// Forms that count by engineering strains.
pub const LEADING: usize = 8;
/// The share of s in ŝ, and what M counts beside 1: (1 − SHARE) PACE is ½.
const SHARE: f64 = 1.0 / 3.0;
const PACE: f64 = 0.75;
/// The least pivot of 1 + ¾ M.
const LEAST: f64 = 0.1;
/// ŝ over s beyond it.
const MOST: f64 = SHARE + (1.0 - SHARE) / LEAST;

/// By leading form.
pub type Vector = SVector<f64, LEADING>;
/// By two of them.
pub type Matrix = SMatrix<f64, LEADING, LEADING>;

/// C: for each leading form the matrix of its squares, symmetric. In units of 1/√energy, as s has √energy.
#[derive(Clone, Debug, PartialEq)]
pub struct Engineering(pub [Matrix; LEADING]);

/// What is known at some s.
#[derive(Clone, Copy)]
pub struct Strained {
    /// ½ Σ w ŝ², and ∂/∂s.
    pub energy: f64,
    pub stress: Vector,
    weights: Vector,
    /// The factors of 1 + ¾ M, r and the solution of its transpose with wŝ; none beyond.
    within: Option<(Matrix, Vector, Vector)>,
}

impl Strained {
    /// Of s = 0 with weights of 0.
    pub fn none() -> Self {
        Self { energy: 0.0, stress: Vector::zeros(), weights: Vector::zeros(), within: None }
    }
}

impl Engineering {
    /// At s of the leading forms, of weights w.
    pub fn at(&self, s: &[f64], weights: &[f64]) -> Strained {
        let (s, weights) = (Vector::from_column_slice(&s[..LEADING]), Vector::from_column_slice(&weights[..LEADING]));
        let Some(factors) = factors(Matrix::identity() + PACE * self.turned(&s)) else {
            let stress = MOST * MOST * weights.component_mul(&s);
            return Strained { energy: 0.5 * s.dot(&stress), stress, weights, within: None };
        };
        let r = solved(&factors, s);
        let strain = SHARE * s + (1.0 - SHARE) * r;
        let force = weights.component_mul(&strain);
        let push = solved_transposed(&factors, force);
        let stress = SHARE * force + (1.0 - SHARE) * (push - PACE * (self.along(&push) * r));
        Strained { energy: 0.5 * strain.dot(&force), stress, weights, within: Some((factors, r, push)) }
    }

    /// ∂²/∂s² of the energy.
    pub fn curvature(&self, at: &Strained) -> Matrix {
        let Some((_, _, push)) = &at.within else { return self.resistance(at) };
        let slope = self.slope(at);
        let both = self.along(push) * slope;
        self.resisting(at, &slope) - PACE * (1.0 - SHARE) * (both + both.transpose())
    }

    /// Σ w ∇ŝ∇ŝᵀ.
    pub fn resistance(&self, at: &Strained) -> Matrix {
        self.resisting(at, &self.slope(at))
    }

    fn resisting(&self, at: &Strained, slope: &Matrix) -> Matrix {
        let strains = SHARE * Matrix::identity() + (1.0 - SHARE) * slope;
        strains.transpose() * Matrix::from_diagonal(&at.weights) * strains
    }

    /// ∂r/∂s.
    fn slope(&self, at: &Strained) -> Matrix {
        let Some((factors, r, _)) = &at.within else { return Matrix::identity() / LEAST };
        let mut slope = Matrix::identity() - PACE * self.turned(r);
        slope.column_iter_mut().for_each(|mut column| column.copy_from(&solved(factors, column.clone_owned())));
        slope
    }

    /// M(s).
    fn turned(&self, s: &Vector) -> Matrix {
        Matrix::from_columns(&self.0.each_ref().map(|of| of * s)).transpose()
    }

    /// Σ v_j C_j.
    fn along(&self, v: &Vector) -> Matrix {
        self.0.iter().zip(v).map(|(of, v)| *v * of).sum()
    }
}

/// L and U, L with ones on its diagonal; none where a pivot is less than [`LEAST`].
fn factors(mut a: Matrix) -> Option<Matrix> {
    for k in 0..LEADING {
        let pivot = a[(k, k)];
        if pivot.is_nan() || pivot < LEAST {
            return None;
        }
        for i in k + 1..LEADING {
            let factor = a[(i, k)] / pivot;
            a[(i, k)] = factor;
            (k + 1..LEADING).for_each(|j| a[(i, j)] -= factor * a[(k, j)]);
        }
    }
    Some(a)
}

/// Of LU x = b.
fn solved(factors: &Matrix, mut b: Vector) -> Vector {
    for i in 0..LEADING {
        (0..i).for_each(|j| b[i] -= factors[(i, j)] * b[j]);
    }
    for i in (0..LEADING).rev() {
        (i + 1..LEADING).for_each(|j| b[i] -= factors[(i, j)] * b[j]);
        b[i] /= factors[(i, i)];
    }
    b
}

/// Of UᵀLᵀ x = b.
fn solved_transposed(factors: &Matrix, mut b: Vector) -> Vector {
    for i in 0..LEADING {
        (0..i).for_each(|j| b[i] -= factors[(j, i)] * b[j]);
        b[i] /= factors[(i, i)];
    }
    for i in (0..LEADING).rev() {
        (i + 1..LEADING).for_each(|j| b[i] -= factors[(j, i)] * b[j]);
    }
    b
}

/// The leading rows of `scaled` become X times those of `rows`.
#[inline(always)]
pub fn mix<S: Simd, T: Sums<S>>(
    simd: S,
    x: &[[T::Number; LEADING]; LEADING],
    rows: &[T::Number],
    stride: usize,
    scaled: &mut [T::Number],
) {
    let columns = stride / T::LANES;
    let (rows, scaled) = (T::view(rows), T::registers(scaled));
    for (x, scaled) in x.iter().zip(scaled.chunks_exact_mut(columns)) {
        for (c, out) in scaled.iter_mut().enumerate() {
            let mut sum = T::splat(simd, T::Number::default());
            for (k, x) in x.iter().enumerate() {
                sum = T::multiply_add(simd, rows[k * columns + c], T::splat(simd, *x), sum);
            }
            *out = sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of edges that do not know of each other.
    fn apart() -> Engineering {
        Engineering(std::array::from_fn(|j| {
            let mut of = Matrix::zeros();
            of[(j, j)] = 1.0;
            of
        }))
    }

    #[test]
    fn one_edge_has_its_strain_by_length() {
        let ones = [1.0; LEADING];
        for percent in (-30..=200).step_by(5) {
            let green = 0.01 * f64::from(percent);
            let mut s = [0.0; LEADING];
            s[3] = green;
            let exact = (1.0 + 2.0 * green).sqrt() - 1.0;
            let strain = (2.0 * apart().at(&s, &ones).energy).sqrt().copysign(green);
            assert!((strain - exact).abs() <= 0.03 * exact.abs(), "{green}: {strain} for {exact}");
            // s − ½ s² and no more where it is small: the next term is ⅜ z³ for ½ z³.
            if green.abs() < 0.11 {
                assert!((strain - (green - 0.5 * green * green)).abs() <= 0.5 * green.abs().powi(3));
            }
        }
    }

    #[test]
    fn pressed_beyond_all_it_resists_most_and_goes_on_doing_so() {
        let ones = [1.0; LEADING];
        let at = |s: f64| apart().at(&[s; LEADING], &ones);
        // 1 + ¾ s is the least pivot at −1.2.
        let [before, beyond] = [at(-1.199), at(-1.201)];
        assert!(
            beyond.energy > 0.98 * before.energy && beyond.energy.is_finite(),
            "{} {}",
            before.energy,
            beyond.energy
        );
        assert!(beyond.stress.iter().all(|x| *x < 0.0));
        let resisting = apart().curvature(&beyond);
        assert_eq!(resisting, apart().resistance(&beyond));
        assert!((resisting[(0, 0)] * -1.201 - beyond.stress[0]).abs() < 1e-9 * beyond.stress[0].abs());
        assert!(at(f64::NAN).energy.is_nan());
    }
}
