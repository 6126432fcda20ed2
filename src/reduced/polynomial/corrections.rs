//! What bending lacks, ½ Σ yᵀDy over the hinges, by few forms of weights of either sign: along the softest modes exactly to second order, then by
//! the |D|^½ y of the shapes, then by the eigenvectors of the signs of D.

use super::bends::Bend;
use super::pairs::Gains;
use crate::modes::symmetric_eigen;
use crate::reduced::basis::{MULTIPLICATION, add_lower};
use crate::{Result, threads};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};
use nalgebra::{DMatrix, SymmetricEigen};

/// Modes along which bending is exact to second order, and further corrections of it.
pub const SOFTEST: usize = 4;
const CORRECTIONS: usize = 4;
/// Of the largest eigenvalue, those that are rounding.
const NEGLIGIBLE: f64 = 1e-10;
/// Bends whose products are summed at once.
const CHUNK: usize = 512;

/// |D|^½ y of some bends at shapes with the gains.
struct Roots<'a> {
    bends: &'a [Bend],
    /// Eigenvectors of D by the roots of its eigenvalues.
    roots: Vec<DMatrix<f64>>,
    /// Their signs, and whose pair each is of.
    signs: Vec<f64>,
    rows: Vec<(usize, usize)>,
}

impl<'a> Roots<'a> {
    fn new(bends: &'a [Bend]) -> Self {
        let (mut roots, mut signs, mut rows) = (vec![], vec![], vec![]);
        for (b, bend) in bends.iter().enumerate() {
            let told = bend.correction.iter().all(|x| x.is_finite());
            let size = bend.pairs.len();
            let correction = if told { bend.correction.clone() } else { DMatrix::zeros(size, size) };
            let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(correction);
            signs.extend(eigenvalues.iter().map(|x| x.signum()));
            roots.push(DMatrix::from_fn(size, size, |i, k| eigenvectors[(i, k)] * eigenvalues[k].abs().sqrt()));
            rows.extend((0..size).map(|k| (b, k)));
        }
        Self { bends, roots, signs, rows }
    }

    /// Of each pair, by one list of gains after the other (shapes × Σ pairs).
    fn at(&self, lists: [&Gains; 2]) -> Mat<f64> {
        let mut z = Mat::zeros(lists.iter().map(|gains| gains.shapes).sum(), self.rows.len());
        for ((b, k), z) in self.rows.iter().zip(z.col_iter_mut()) {
            let Some(z) = z.try_as_col_major_mut() else { break };
            let (first, second) = z.as_slice_mut().split_at_mut(lists[0].shapes);
            for (i, pair) in self.bends[*b].pairs.iter().enumerate().filter_map(|(i, pair)| Some((i, (*pair)?))) {
                let root = self.roots[*b][(i, *k)];
                for (sums, gains) in [&mut *first, &mut *second].into_iter().zip(lists) {
                    sums.iter_mut().zip(gains.of(pair)).for_each(|(sum, y)| *sum += root * y);
                }
            }
        }
        z
    }
}

/// The few sums over pairs (pairs × sums) whose squares, by their signed weights, are near ½ Σ yᵀDy; and the weights. First those of slopes at rest
/// along the softest modes, for which they are exact to second order, then those of what these leave of the shapes'.
pub fn corrections(bends: &[Bend], lists: [&Gains; 2], pairs: usize) -> Result<(Mat<f64>, Vec<f64>)> {
    let shapes = lists[0].shapes + lists[1].shapes;
    let parts = threads::parts(bends, CHUNK);
    let work = 3.0 * MULTIPLICATION * (bends.len() * shapes * shapes) as f64;
    let made = threads::map(&parts, work as u64, |part| {
        let mut gram = Mat::<f64>::zeros(shapes, shapes);
        let roots: Vec<Roots> = part.chunks(CHUNK).map(Roots::new).collect();
        for some in &roots {
            let z = some.at(lists);
            add_lower(gram.as_mut(), z.as_ref(), z.transpose());
        }
        (roots, gram)
    });
    let mut gram = Mat::<f64>::zeros(shapes, shapes);
    made.iter().for_each(|(_, part)| gram += part);
    let gram = Mat::from_fn(shapes, shapes, |i, j| gram[(i.max(j), i.min(j))]);
    let mixing = mixing(&gram, lists[0].shapes)?;
    if mixing.ncols() == 0 {
        return Ok((Mat::zeros(pairs, 0), vec![]));
    }
    let fields = threads::map(&made, work as u64 / 10, |(roots, _)| {
        roots.iter().map(|some| mixing.transpose() * some.at(lists)).collect::<Vec<_>>()
    });
    let mut sums = Mat::<f64>::zeros(pairs, mixing.ncols());
    let mut signed = Mat::<f64>::zeros(mixing.ncols(), mixing.ncols());
    for (roots, fields) in made.iter().flat_map(|(roots, _)| roots).zip(fields.iter().flatten()) {
        let by_sign = Mat::from_fn(fields.ncols(), mixing.ncols(), |row, k| roots.signs[row] * fields[(k, row)]);
        matmul(signed.as_mut(), Accum::Add, fields, &by_sign, 1.0, Par::Seq);
        for (row, (b, k)) in roots.rows.iter().enumerate() {
            for (i, pair) in roots.bends[*b].pairs.iter().enumerate().filter_map(|(i, pair)| Some((i, (*pair)?))) {
                (0..mixing.ncols()).for_each(|c| sums[(pair, c)] += roots.roots[*b][(i, *k)] * fields[(c, row)]);
            }
        }
    }
    let (weights, turns) = symmetric_eigen(signed.as_ref())?;
    Ok((sums * turns, weights))
}

/// What of each list makes a few orthonormal ones, with the products of two (lists × fields): all of the first `softest`, and the strongest of what
/// these leave of the others, which count by the roots of their sizes.
fn mixing(gram: &Mat<f64>, softest: usize) -> Result<Mat<f64>> {
    let (all, mut out) = (gram.nrows(), Mat::<f64>::zeros(gram.nrows(), 0));
    let ends = [(0, softest, softest), (softest, all, CORRECTIONS)];
    for (first, end, most) in ends.into_iter().filter(|(first, end, _)| first < end) {
        let count = end - first;
        // e less what `out` has of it, by lists.
        let mut rest = Mat::from_fn(all, count, |i, k| if i == first + k { 1.0 } else { 0.0 });
        let held = out.transpose() * gram.subcols(first, count);
        rest -= &out * held;
        let products = rest.transpose() * gram * &rest;
        let scale: Vec<f64> = (first..end).map(|k| gram[(k, k)].max(f64::MIN_POSITIVE).sqrt().sqrt().recip()).collect();
        let scaled = Mat::from_fn(count, count, |i, j| scale[i] * products[(i.max(j), i.min(j))] * scale[j]);
        if scaled.norm_max() == 0.0 {
            continue;
        }
        let (values, vectors) = symmetric_eigen(scaled.as_ref())?;
        let largest = values[count - 1];
        let kept: Vec<usize> = (0..count).rev().take(most).filter(|k| values[*k] > NEGLIGIBLE * largest).collect();
        let turns = Mat::from_fn(count, kept.len(), |i, k| scale[i] * vectors[(i, kept[k])] / values[kept[k]].sqrt());
        let more = rest * turns;
        let before = out.ncols();
        out =
            Mat::from_fn(all, before + kept.len(), |i, k| if k < before { out[(i, k)] } else { more[(i, k - before)] });
    }
    Ok(out)
}
