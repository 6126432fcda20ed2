//! Dense symmetric eigenproblems by the QR algorithm.
//!
//! faer's default switches to divide and conquer at dimension 128, which (0.24.4) lost eight digits on a matrix with a
//! sixfold zero eigenvalue, as every free shell has; its QR algorithm does not.

use crate::{Error, ErrorKind, Result};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{ComputeEigenvectors, SelfAdjointEvdParams, self_adjoint_evd, self_adjoint_evd_scratch};
use faer::{Auto, Col, Mat, MatRef, Par, Spec};

/// Eigenvalues, ascending, and orthonormal eigenvectors of the symmetric matrix whose lower triangle is `a`.
pub fn symmetric_eigen(a: MatRef<'_, f64>) -> Result<(Vec<f64>, Mat<f64>)> {
    let n = a.nrows();
    let parameters: Spec<SelfAdjointEvdParams, f64> =
        SelfAdjointEvdParams { recursion_threshold: usize::MAX, ..Auto::<f64>::auto() }.into();
    let scratch = self_adjoint_evd_scratch::<f64>(n, ComputeEigenvectors::Yes, Par::Seq, parameters);
    let mut buffer = MemBuffer::try_new(scratch)
        .map_err(|_| Error::new(ErrorKind::OutOfMemory, "not enough memory for the dense eigenproblem"))?;
    let mut values = Col::<f64>::zeros(n);
    let mut vectors = Mat::<f64>::zeros(n, n);
    let stack = MemStack::new(&mut buffer);
    self_adjoint_evd(a, values.as_mut().as_diagonal_mut(), Some(vectors.as_mut()), Par::Seq, stack, parameters)
        .map_err(|_| Error::new(ErrorKind::Numerical, "a dense eigenvalue problem did not converge"))?;
    Ok((values.iter().copied().collect(), vectors))
}
