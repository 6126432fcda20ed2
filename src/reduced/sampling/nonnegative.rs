//! Nonnegative least squares (Lawson, Hanson 1974), many columns at once.
//!
//! Which columns come next is seen on a copy in 16 bits, with a bound of what that misses, and settled in 64 bits where the bound leaves it open: the
//! choice is that of 64 bits, and a pass goes over a quarter of the memory. The active columns and their products are kept, so that
//! nothing is copied or multiplied twice.

use crate::Result;
use faer::linalg::solvers::Solve;
use faer::{Col, ColRef, Mat, MatRef, Side};
use nalgebra::DVector;
use pulp::Arch;
use std::cmp::Ordering;

/// Columns that are smaller than this part of the mean are left out: those of elements that are held all around are rounding,
/// which a weight makes into noise that no search gets through.
const LEAST_FORCE: f64 = 1e-3;
/// Columns taken up at once, as a part of those wanted.
const BATCH: f64 = 0.03;
/// min |Ax − b| over x ≥ 0 with at most `wanted` nonzero entries, or until `suffices` of the residual b − Ax and the share of the work
/// done; returns x and the residual.
pub(super) fn nonnegative(
    a: &Mat<f64>,
    b: &DVector<f64>,
    wanted: usize,
    mut suffices: impl FnMut(&DVector<f64>, f64) -> Result<bool>,
) -> Result<(Vec<f64>, DVector<f64>)> {
    let mut set = ActiveSet::new(a, b);
    let mut residual = b.clone();
    let batch = ((BATCH * wanted as f64) as usize).max(1);
    while !suffices(&residual, set.active.len() as f64 / wanted as f64)? && set.active.len() < wanted {
        let best = set.best(&residual, 1e-12 * b.norm(), batch.min(wanted - set.active.len()));
        if best.is_empty() {
            break;
        }
        set.add(&best);
        set.solve();
        let before = residual.norm();
        residual = set.residual(b);
        if residual.norm() > before * (1.0 - 1e-9) {
            best.iter().for_each(|&j| set.barred[j] = true); // thrown out as soon as taken in
        }
    }
    Ok((set.x, residual))
}

/// x ≥ 0, and the columns along which it may be positive.
struct ActiveSet<'a> {
    a: &'a Mat<f64>,
    norms: Vec<f64>,
    rough: Rough,
    /// Aᵀb.
    right: Col<f64>,
    x: Vec<f64>,
    active: Vec<usize>,
    /// The active columns, one behind the other.
    taken: Vec<f64>,
    /// Of them.
    gram: Mat<f64>,
    /// Columns that are never taken in.
    barred: Vec<bool>,
}

impl<'a> ActiveSet<'a> {
    /// None active.
    fn new(a: &'a Mat<f64>, b: &DVector<f64>) -> Self {
        let n = a.ncols();
        let norms: Vec<f64> = (0..n).map(|j| a.col(j).norm_l2()).collect();
        let least = LEAST_FORCE * norms.iter().sum::<f64>() / n as f64;
        let barred = norms.iter().map(|norm| *norm <= least).collect();
        let right = a.transpose() * ColRef::from_slice(b.as_slice());
        let rough = Rough::new(a, &norms);
        Self { a, norms, rough, right, x: vec![0.0; n], active: vec![], taken: vec![], gram: Mat::zeros(0, 0), barred }
    }

    /// Columns along which the residual falls fastest, by more than `least`, at most so many.
    fn best(&self, residual: &DVector<f64>, least: f64, most: usize) -> Vec<usize> {
        let whole = residual.norm();
        let open = |j: usize| self.x[j] == 0.0 && !self.barred[j];
        let ranges: Vec<Option<[f64; 2]>> = self.rough.gains(residual, whole, open);
        // What is surely as good as the last of the best, and those that may be better.
        let mut sure: Vec<f64> = ranges.iter().flatten().map(|[low, _]| *low).collect();
        sure.sort_by(|p, q| q.total_cmp(p));
        let bar = sure.get(most.saturating_sub(1)).copied().unwrap_or(f64::NEG_INFINITY).max(least);
        let residual = ColRef::from_slice(residual.as_slice());
        let mut gains: Vec<(f64, usize)> = (0..ranges.len())
            .filter(|&j| ranges[j].is_some_and(|[_, high]| high >= bar))
            .map(|j| ((self.a.col(j).transpose() * residual) / self.norms[j], j))
            .filter(|(gain, _)| *gain > least)
            .collect();
        gains.sort_by(|p, q| q.0.total_cmp(&p.0).then(p.1.cmp(&q.1)));
        gains.into_iter().take(most).map(|(_, j)| j).collect()
    }

    /// The active columns from the `first` on.
    fn taken(&self, first: usize) -> MatRef<'_, f64> {
        let rows = self.a.nrows();
        MatRef::from_column_major_slice(&self.taken[first * rows..], rows, self.active.len() - first)
    }

    /// Takes columns in.
    fn add(&mut self, list: &[usize]) {
        let old = self.active.len();
        self.active.extend(list);
        list.iter().for_each(|&j| self.taken.extend(self.a.col(j).iter()));
        let count = self.active.len();
        let products = self.taken(0).transpose() * self.taken(old);
        self.gram.resize_with(count, count, |i, k| match i.cmp(&k) {
            Ordering::Equal => products[(i, i - old)] * (1.0 + 1e-12),
            Ordering::Greater => products[(k, i - old)],
            Ordering::Less => products[(i, k - old)],
        });
    }

    /// Moves x to the least squares over the active columns; columns whose entry reaches 0 on the way are thrown out.
    fn solve(&mut self) {
        while let Ok(factor) = self.gram.llt(Side::Lower) {
            let z = factor.solve(Col::from_fn(self.active.len(), |i| self.right[self.active[i]]));
            if z.iter().all(|z| *z > 0.0) {
                self.active.iter().zip(z.iter()).for_each(|(&j, z)| self.x[j] = *z);
                return;
            }
            self.approach(&z);
        }
    }

    /// Moves x towards `z` as far as it stays nonnegative, and throws out columns whose entry is 0 there.
    fn approach(&mut self, z: &Col<f64>) {
        let Self { norms, x, active, taken, gram, .. } = self;
        let mut alpha = 1.0f64;
        for (i, &j) in active.iter().enumerate().filter(|(i, _)| z[*i] <= 0.0) {
            alpha = alpha.min(x[j] / (x[j] - z[i]));
        }
        active.iter().zip(z.iter()).for_each(|(&j, z)| x[j] += alpha * (z - x[j]));
        let largest = active.iter().map(|&j| x[j] * norms[j]).fold(0.0, f64::max);
        let out = |i: &usize| z[*i] <= 0.0 && x[active[*i]] * norms[active[*i]] <= 1e-12 * largest;
        let out: Vec<usize> = (0..active.len()).filter(out).collect();
        let rows = self.a.nrows();
        for &i in out.iter().rev() {
            // The last one takes its place.
            x[active[i]] = 0.0;
            active.swap_remove(i);
            let last = active.len();
            taken.copy_within(last * rows.., i * rows);
            taken.truncate(last * rows);
            if i < last {
                (0..last).for_each(|k| (gram[(i, k)], gram[(k, i)]) = (gram[(last, k)], gram[(last, k)]));
                gram[(i, i)] = gram[(last, last)];
            }
            gram.truncate(last, last);
        }
    }

    /// b − Ax.
    fn residual(&self, b: &DVector<f64>) -> DVector<f64> {
        let taken = self.taken(0) * Col::from_fn(self.active.len(), |k| self.x[self.active[k]]);
        DVector::from_fn(b.len(), |i, _| b[i] - taken[i])
    }
}

/// The columns over their norms in 16 bits, the upper half of an f32.
struct Rough {
    rows: usize,
    entries: Vec<u16>,
    /// Of each column, the norm of what its entries miss.
    missed: Vec<f64>,
    arch: Arch,
}

/// Numbers that are summed side by side.
const SIDE_BY_SIDE: usize = 32;

impl Rough {
    fn new(a: &Mat<f64>, norms: &[f64]) -> Self {
        let rows = a.nrows();
        let (mut entries, mut missed) = (Vec::with_capacity(rows * a.ncols()), Vec::with_capacity(a.ncols()));
        for (j, norm) in norms.iter().enumerate() {
            let mut squares = 0.0;
            let unit = if *norm > 0.0 { 1.0 / norm } else { 0.0 };
            entries.extend(a.col(j).iter().map(|x| {
                let x = x * unit;
                let half = (((x as f32).to_bits() + 0x8000) >> 16) as u16; // to the nearest; |x| is at most 1
                squares += (x - f64::from(wide(half))).powi(2);
                half
            }));
            missed.push(squares.sqrt());
        }
        Self { rows, entries, missed, arch: Arch::new() }
    }

    /// Of each `open` column, a number that its gain, aᵀr/|a|, is surely not below, and one that it is not above.
    fn gains(&self, residual: &DVector<f64>, whole: f64, open: impl Fn(usize) -> bool) -> Vec<Option<[f64; 2]>> {
        let unit = if whole > 0.0 { 1.0 / whole } else { 0.0 };
        let r: Vec<f32> = residual.iter().map(|r| (r * unit) as f32).collect();
        // Of sums of f32, each of rows/32 terms, and of what they are made of.
        let rounding = (self.rows as f64 / SIDE_BY_SIDE as f64 + 64.0) * f64::from(f32::EPSILON);
        let columns = self.entries.chunks_exact(self.rows.max(1)).zip(&self.missed).enumerate();
        let gain = |(j, (entries, missed)): (usize, (&[u16], &f64))| {
            open(j).then(|| {
                let (middle, off) = (f64::from(self.arch.dispatch(|| rough_dot(entries, &r))), missed + rounding);
                [whole * (middle - off), whole * (middle + off)]
            })
        };
        columns.map(gain).collect()
    }
}

/// Of its upper half.
#[inline(always)]
fn wide(half: u16) -> f32 {
    f32::from_bits(u32::from(half) << 16)
}

#[inline(always)]
fn rough_dot(a: &[u16], b: &[f32]) -> f32 {
    let mut sums = [0.0f32; SIDE_BY_SIDE];
    let (a, b) = (a.chunks_exact(SIDE_BY_SIDE), b.chunks_exact(SIDE_BY_SIDE));
    let rest: f32 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| wide(*a) * b).sum();
    for (a, b) in a.zip(b) {
        for k in 0..SIDE_BY_SIDE {
            sums[k] += wide(a[k]) * b[k];
        }
    }
    sums.iter().sum::<f32>() + rest
}

#[cfg(test)]
mod tests {
    use super::super::Random;
    use super::*;

    const ROWS: usize = 1003;

    /// Columns of sizes from 1e-9 to 1e9.
    fn columns(count: usize, random: &mut Random) -> Mat<f64> {
        let sizes: Vec<f64> = (0..count).map(|_| 10f64.powf(9.0 * random.next())).collect();
        let mut a = Mat::zeros(ROWS, count);
        for (j, size) in sizes.iter().enumerate() {
            let common = random.next();
            (0..ROWS).for_each(|i| a[(i, j)] = size * (common + random.next().powi(3)));
        }
        a
    }

    fn vector(random: &mut Random) -> DVector<f64> {
        DVector::from_fn(ROWS, |_, _| 1e-5 * (0.3 + random.next()))
    }

    fn gain(a: &Mat<f64>, r: &DVector<f64>, j: usize) -> f64 {
        let dot: f64 = (0..ROWS).map(|i| a[(i, j)] * r[i]).sum();
        dot / a.col(j).norm_l2()
    }

    #[test]
    fn gains_are_within_what_16_bits_tell_of_them() {
        let mut random = Random::new();
        let (a, r) = (columns(300, &mut random), vector(&mut random));
        let norms: Vec<f64> = (0..300).map(|j| a.col(j).norm_l2()).collect();
        let ranges = Rough::new(&a, &norms).gains(&r, r.norm(), |j| j != 7);
        assert!(ranges[7].is_none());
        for (j, range) in ranges.iter().enumerate().filter(|(j, _)| *j != 7) {
            let ([low, high], exact) = (range.unwrap(), gain(&a, &r, j));
            assert!(low <= exact && exact <= high, "{low} {exact} {high}");
            assert!(high - low < 0.01 * r.norm()); // 8 bits of a number: it tells something
        }
    }

    #[test]
    fn the_columns_that_come_next_are_those_of_64_bits() {
        let mut random = Random::new();
        for most in [1, 5, 40, 400] {
            let (a, r) = (columns(300, &mut random), vector(&mut random));
            let set = ActiveSet::new(&a, &r);
            let mut order: Vec<usize> = (0..300).filter(|j| !set.barred[*j] && gain(&a, &r, *j) > 1e-7).collect();
            order.sort_by(|p, q| gain(&a, &r, *q).total_cmp(&gain(&a, &r, *p)));
            order.truncate(most);
            assert_eq!(set.best(&r, 1e-7, most), order);
        }
    }

    /// The conditions of Karush, Kuhn and Tucker; and weights that have an exact solution are found.
    #[test]
    fn weights_are_the_least_squares_of_those_that_are_not_negative() {
        let mut random = Random::new();
        let mut a = Mat::zeros(ROWS, 200);
        (0..200).for_each(|j| (0..ROWS).for_each(|i| a[(i, j)] = 0.5 + random.next()));
        let b = 1e5 * vector(&mut random);
        let (x, residual) = nonnegative(&a, &b, 200, |_, _| Ok(false)).unwrap();
        assert!(x.iter().all(|x| *x >= 0.0) && x.iter().filter(|x| **x > 0.0).count() > 20 && x.contains(&0.0));
        for (j, x) in x.iter().enumerate() {
            let slope = gain(&a, &residual, j) / b.norm();
            assert!(slope < 1e-9 && (*x == 0.0 || slope > -1e-9), "{j}: {x}, {slope}"); // the diagonal is larger by 1e-12
        }
        let told: Vec<f64> = (0..200).map(|j| if j % 3 == 0 { 1.0 + random.next() } else { 0.0 }).collect();
        let b = DVector::from_fn(ROWS, |i, _| (0..200).map(|j| a[(i, j)] * told[j]).sum());
        let (x, residual) = nonnegative(&a, &b, 200, |_, _| Ok(false)).unwrap();
        assert!(residual.norm() < 1e-9 * b.norm());
        assert!(x.iter().zip(&told).all(|(x, told)| (x - told).abs() < 1e-7)); // a condition of 1e2, squared
    }
}
