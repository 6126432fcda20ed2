//! The lowest modes of a shell from those of its pieces.
//!
//! Equal eigenvalues, of one piece or of many, are one group with one stated basis. The counts of the pieces add up.

use super::canonical::{self, Span, repeated};
use super::pieces::Piece;
use super::{Modes, Phase, Progress, ScaledStiffness, Solution, SpectrumCertificate};
use crate::{Result, Shell};
use faer::Mat;

/// An eigenpair: its value, piece, and number among the piece's.
type Pair = (f64, usize, usize);

/// All pieces' eigenpairs, ascending; equal ones in the order of the pieces.
fn sorted(solved: &[Solution]) -> Vec<Pair> {
    let of = |(piece, one): (usize, &Solution)| {
        one.eigenvalues.iter().enumerate().map(|(k, lambda)| (*lambda, piece, k)).collect::<Vec<Pair>>()
    };
    let mut all: Vec<Pair> = solved.iter().enumerate().flat_map(of).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all
}

/// The last pair of the group that the last wanted one belongs to; `None` where there are not so many.
fn last_of_wanted(all: &[Pair], wanted: usize) -> Option<usize> {
    (wanted - 1..all.len()).find(|&i| all.get(i + 1).is_none_or(|next| !repeated(all[i].0, next.0)))
}

/// The largest eigenvalue of the last wanted one's group; infinite where there are too few.
pub fn end_of_wanted(solved: &[Solution], wanted: usize) -> f64 {
    let all = sorted(solved);
    last_of_wanted(&all, wanted).map_or(f64::INFINITY, |last| all[last].0)
}

/// The `wanted` lowest modes of all.
pub fn merge(
    shell: &Shell,
    stiffness: &ScaledStiffness,
    (pieces, solved): (&[Piece], &[Solution]),
    wanted: usize,
    progress: &mut Progress,
) -> Result<Modes> {
    let all = sorted(solved);
    let wanted = wanted.min(all.len());
    let mut certificate = counted(&all, solved, wanted);
    let mut vectors = Mat::zeros(shell.n_unknowns(), wanted);
    let rigid = canonical::rigid_fields(shell, &stiffness.root_mass);
    let mut first = 0;
    for group in all.chunk_by(|a, b| repeated(a.0, b.0)) {
        let given = group.len().min(wanted - first);
        if given == 0 {
            break;
        }
        let span = span(shell, (pieces, solved), group);
        canonical::state_basis(&span, &rigid, vectors.as_mut().subcols_mut(first, given));
        first += given;
    }
    certificate.orthonormality = orthonormality(&vectors);

    let eigenvalues: Vec<f64> = all[..wanted].iter().map(|pair| pair.0).collect();
    let (norm, root_mass) = (stiffness.unscaled_norm(), &stiffness.root_mass);
    let mut shapes = Vec::with_capacity(wanted);
    for (j, &lambda) in eigenvalues.iter().enumerate() {
        let y: Vec<f64> = vectors.col(j).iter().copied().collect();
        let phi: Vec<f64> = y.iter().zip(root_mass).map(|(y, r)| y / r).collect();
        let image = stiffness.apply(&y);
        let residual = (0..y.len()).map(|i| root_mass[i] * (image[i] - lambda * y[i]));
        let relative = euclidean(residual) / (norm * euclidean(phi.iter().copied()));
        certificate.residual = larger(certificate.residual, relative);
        shapes.push(shell.scatter(&phi));
    }
    progress.report(Phase::Certificate, 1.0)?;
    let zero_modes = eigenvalues.iter().filter(|lambda| **lambda == 0.0).count();
    Ok(Modes { zero_modes, eigenvalues, shapes, certificate, peak_bytes: peak_bytes(stiffness, solved) })
}

/// The counts. Each piece's list is complete up to its own shift, at or above its last wanted mode; so is the whole up to the least of
/// those and the first mode that is left out.
fn counted(all: &[Pair], solved: &[Solution], wanted: usize) -> SpectrumCertificate {
    let disagreement = solved.iter().map(|one| one.disagreement).fold(0.0, f64::max);
    if let [one] = solved {
        let (shift, count, found) = (one.shift, one.count, one.eigenvalues.len());
        return SpectrumCertificate { shift, count, found, disagreement, ..Default::default() };
    }
    let end = last_of_wanted(all, wanted).unwrap_or(all.len() - 1);
    let complete = solved.iter().map(|one| one.shift).fold(f64::INFINITY, f64::min);
    let above = all.get(end + 1).map_or(complete, |next| all[end].0 + 0.25 * (next.0 - all[end].0));
    let shift = complete.min(above);
    let found = all.iter().filter(|pair| pair.0 < shift).count();
    let missing: usize = solved.iter().map(|one| one.count.saturating_sub(one.eigenvalues.len())).sum();
    SpectrumCertificate { shift, count: found + missing, found, disagreement, ..Default::default() }
}

/// The space of a group; a piece's pairs follow each other in it.
fn span<'a>(shell: &Shell, (pieces, solved): (&'a [Piece], &[Solution]), group: &[Pair]) -> Span<'a> {
    let mut group = group.to_vec();
    group.sort_by_key(|pair| (pair.1, pair.2));
    let of = |own: &[Pair]| {
        let (_, piece, first) = own[0];
        (&pieces[piece].free[..], solved[piece].vectors.subcols(first, own.len()).to_owned())
    };
    Span { n: shell.n_unknowns(), pieces: group.chunk_by(|a, b| a.1 == b.1).map(of).collect() }
}

/// That of the piece with the most, with what is kept of all where there are others.
fn peak_bytes(stiffness: &ScaledStiffness, solved: &[Solution]) -> usize {
    let most = solved.iter().map(|one| one.peak_bytes).max().unwrap_or(0);
    let kept: usize = solved.iter().map(|one| 8 * one.vectors.nrows() * one.vectors.ncols()).sum();
    if solved.len() == 1 { most } else { most + kept + 16 * stiffness.lower.val().len() }
}

/// The larger one; infinite where `b` is no number.
fn larger(a: f64, b: f64) -> f64 {
    if b.is_nan() { f64::INFINITY } else { a.max(b) }
}

fn euclidean(x: impl Iterator<Item = f64>) -> f64 {
    x.map(|x| x * x).sum::<f64>().sqrt()
}

fn orthonormality(vectors: &Mat<f64>) -> f64 {
    let gram = vectors.transpose() * vectors;
    let k = gram.ncols();
    let error = |(i, j): (usize, usize)| (gram[(i, j)] - f64::from(u8::from(i == j))).abs();
    (0..k * k).map(|ij| error((ij / k, ij % k))).fold(0.0, larger)
}
