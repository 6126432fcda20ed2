//! Modal warping: displacements u_i = R̃(w_i) (Φq)_i with w = Ψq, the path integral of rotated rates when q and w grow
//! together from zero (paper section 4.2; [2] section 4).

mod basis;
mod coefficients;
mod derivative;
mod modal_rotation;
mod tangent;

pub use basis::{Basis, Lanes3};
pub use coefficients::{Coefficients, Slopes, coefficients, coefficients_and_slopes};
pub use derivative::warp_with_derivative;
pub use modal_rotation::ModalRotation;
pub use tangent::Tangent;

use crate::Vec3;
use crate::real::Real;

/// Vertices per block.
pub const LANES: usize = 16;

/// Linear displacement, rotation vector and rotation coefficients of one block.
pub struct WarpedBlock<T> {
    linear: Lanes3<T>,
    /// The modal rotation w = Ψq.
    pub w: Lanes3<T>,
    coefficients: Coefficients<T>,
}

fn dot<T: Real>(a: &Lanes3<T>, b: &Lanes3<T>, i: usize) -> T {
    a[0][i] * b[0][i] + a[1][i] * b[1][i] + a[2][i] * b[2][i]
}

/// alpha v + beta w × v + gamma w (w·v), lane by lane.
fn rotate_like<T: Real>(
    w: &Lanes3<T>,
    v: &Lanes3<T>,
    alpha: &[T; LANES],
    beta: &[T; LANES],
    gamma: &[T; LANES],
) -> Lanes3<T> {
    let mut out = [[T::default(); LANES]; 3];
    for c in 0..3 {
        let (d, e) = ((c + 1) % 3, (c + 2) % 3);
        for i in 0..LANES {
            let cross = w[d][i] * v[e][i] - w[e][i] * v[d][i];
            out[c][i] = alpha[i] * v[c][i] + beta[i] * cross + gamma[i] * dot(w, v, i) * w[c][i];
        }
    }
    out
}

impl<T: Real> WarpedBlock<T> {
    /// Evaluates one block of `basis` at amplitudes `q`.
    pub fn new(basis: &Basis<T>, block: usize, q: &[f64]) -> Self {
        let (linear, w) = basis.combine(block, q);
        let coefficients = coefficients(&std::array::from_fn(|i| dot(&w, &w, i)));
        Self { linear, w, coefficients }
    }

    /// Φq: the displacement of linear modal analysis.
    pub fn linear(&self) -> &Lanes3<T> {
        &self.linear
    }

    /// u = R̃(w) Φq.
    pub fn displacement(&self) -> Lanes3<T> {
        let Coefficients { a, b, c } = &self.coefficients;
        rotate_like(&self.w, &self.linear, a, b, c)
    }

    fn cosine(&self) -> [T; LANES] {
        std::array::from_fn(|i| T::of(1.0) - dot(&self.w, &self.w, i) * self.coefficients.b[i])
    }

    /// R(w) v.
    pub fn rotate(&self, v: &Lanes3<T>) -> Lanes3<T> {
        rotate_like(&self.w, v, &self.cosine(), &self.coefficients.a, &self.coefficients.b)
    }

    /// R(w)ᵀ v.
    pub fn rotate_back(&self, v: &Lanes3<T>) -> Lanes3<T> {
        rotate_like(&self.w, v, &self.cosine(), &self.coefficients.a.map(|a| -a), &self.coefficients.b)
    }
}

/// Lane `i` as a vector.
pub fn lane<T: Real>(v: &Lanes3<T>, i: usize) -> Vec3 {
    Vec3::new(v[0][i].to_f64(), v[1][i].to_f64(), v[2][i].to_f64())
}
