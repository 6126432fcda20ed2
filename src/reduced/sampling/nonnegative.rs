//! Nonnegative least squares (Lawson, Hanson 1974), many columns at once.
//!
//! Which columns come next is seen on a copy in 16 bits, with a bound of what that misses, and settled in 64 bits where the bound leaves it open: the
//! choice is that of 64 bits, and a pass goes over a quarter of the memory. The active columns and their products are kept, so that
//! nothing is copied or multiplied twice.
//!
//! Columns of neighbours are much alike: a round that takes in the best of all throws most of them out again. So each round looks at [`POOL`] times as many, and
//! takes some by orthogonal matching pursuit (Pati, Rezaiifar, Krishnaprasad 1993): what one gains of the residual counts no more for the next. That takes half
//! as many rounds.

mod factor;
mod strip;

use crate::{Result, threads};
use factor::Factor;
use faer::{Col, Mat, MatRef};
use nalgebra::DVector;
use pulp::Arch;
use strip::{Dot, Strip, column};

/// Columns that are smaller than this part of the mean are left out: those of elements that are held all around are rounding,
/// which a weight makes into noise that no search gets through.
const LEAST_FORCE: f64 = 1e-3;
/// Columns taken up at once, as a part of those wanted.
const BATCH: f64 = 0.03;
/// They are taken from so many times as many. A column is taken where those before it leave at least this part of its square.
const POOL: usize = 3;
const LEAST_LEFT: f64 = 0.1;
/// Columns that a thread takes at once: of all, and of the active ones.
const STRIP: usize = 64;
const FEW: usize = 48;

/// min |Ax − b|, A in 32 bits, over x ≥ 0 with at most `wanted` nonzero entries. It ends sooner where `suffices` of the residual b − Ax, and of the share of
/// the work that is done, says so. Returns x and the residual.
pub(super) fn nonnegative(
    a: MatRef<'_, f32>,
    b: &DVector<f64>,
    wanted: usize,
    mut suffices: impl FnMut(&DVector<f64>, f64) -> Result<bool>,
) -> Result<(Vec<f64>, DVector<f64>)> {
    let mut set = ActiveSet::new(a, b, wanted);
    let mut residual = b.clone();
    let batch = ((BATCH * wanted as f64) as usize).max(1);
    while !suffices(&residual, set.active.len() as f64 / wanted as f64)? && set.active.len() < wanted {
        let some = batch.min(wanted - set.active.len());
        let best = set.apart(set.best(&residual, 1e-12 * b.norm(), POOL * some), some);
        if best.is_empty() {
            break;
        }
        if set.add(&best) {
            set.solve();
        }
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
    a: MatRef<'a, f32>,
    strips: Vec<Strip>,
    /// Of each column.
    norms: Vec<f64>,
    /// Aᵀb.
    right: Vec<f64>,
    x: Vec<f64>,
    active: Vec<usize>,
    /// The active columns, one behind the other, and of each column, where among them it is.
    taken: Vec<f64>,
    places: Vec<usize>,
    /// Of the products of the active columns, in an order of its own.
    factor: Factor,
    order: Vec<usize>,
    /// Columns that are never taken in.
    barred: Vec<bool>,
    arch: Arch,
}

/// Nanoseconds that a pass over so many numbers takes, about.
fn pass(numbers: usize) -> u64 {
    numbers as u64 / 3
}

impl<'a> ActiveSet<'a> {
    /// None active.
    fn new(a: MatRef<'a, f32>, b: &DVector<f64>, wanted: usize) -> Self {
        let n = a.ncols();
        let firsts: Vec<usize> = (0..n).step_by(STRIP).collect();
        let strips = threads::map(&firsts, pass(4 * a.nrows() * n), |first| {
            Strip::new(*first, a.subcols(*first, STRIP.min(n - first)), b.as_slice())
        });
        let of = |list: fn(&Strip) -> &[f64]| strips.iter().flat_map(list).copied().collect::<Vec<f64>>();
        let (norms, right) = (of(|strip| &strip.norms), of(|strip| &strip.right));
        let least = LEAST_FORCE * norms.iter().sum::<f64>() / n as f64;
        let barred = norms.iter().map(|norm| *norm <= least).collect();
        let factor = Factor::new(wanted.min(n));
        let taken = Vec::with_capacity(factor.most() * a.nrows());
        let (x, places, active, order) = (vec![0.0; n], vec![usize::MAX; n], vec![], vec![]);
        Self { a, strips, norms, right, x, active, taken, places, factor, order, barred, arch: Arch::new() }
    }

    /// Columns along which the residual falls fastest, by more than `least`, at most so many, and how fast.
    fn best(&self, residual: &DVector<f64>, least: f64, most: usize) -> Vec<(f64, usize)> {
        let whole = residual.norm();
        let unit = if whole > 0.0 { 1.0 / whole } else { 0.0 };
        let r: Vec<f32> = residual.iter().map(|r| (r * unit) as f32).collect();
        let open = |j: usize| self.x[j] == 0.0 && !self.barred[j];
        let rough = pass(r.len() * self.x.len() / 4);
        let ranges = threads::map(&self.strips, rough, |strip| strip.gains(self.arch, (&r, whole), open)).concat();
        // What is surely as good as the last of the best, and those that may be better.
        let mut sure: Vec<f64> = ranges.iter().flatten().map(|[low, _]| *low).collect();
        let last = most.saturating_sub(1);
        let bar = match last < sure.len() {
            true => *sure.select_nth_unstable_by(last, |p, q| q.total_cmp(p)).1,
            false => f64::NEG_INFINITY,
        };
        let bar = bar.max(least);
        let residual = residual.as_slice();
        let better: Vec<usize> =
            (0..ranges.len()).filter(|&j| ranges[j].is_some_and(|[_, high]| high >= bar)).collect();
        let few: Vec<&[usize]> = better.chunks(FEW).collect();
        let gain = |j: &usize| (self.arch.dispatch(Dot(column(self.a, *j), residual)) / self.norms[*j], *j);
        let work = pass(self.a.nrows() * better.len());
        let mut gains = threads::map(&few, work, |few| few.iter().map(gain).collect::<Vec<_>>()).concat();
        gains.retain(|(gain, _)| *gain > least);
        gains.sort_by(|p, q| q.0.total_cmp(&p.0).then(p.1.cmp(&q.1)));
        gains.truncate(most);
        gains
    }

    /// Of columns with their gains at most so many, each the best for what those before it leave of the residual.
    fn apart(&self, columns: Vec<(f64, usize)>, most: usize) -> Vec<usize> {
        let (mut gains, list): (Vec<f64>, Vec<usize>) = columns.into_iter().unzip();
        let unit =
            Mat::from_fn(self.a.nrows(), list.len(), |i, k| f64::from(self.a[(i, list[k])]) / self.norms[list[k]]);
        let firsts: Vec<usize> = (0..list.len()).step_by(FEW).collect();
        let work = pass(self.a.nrows() * list.len() * list.len() / 4);
        let products =
            threads::map(&firsts, work, |first| unit.subcols(*first, FEW.min(list.len() - first)).transpose() * &unit);
        // The rows of a Cholesky factor whose pivots are those that are taken, and what it leaves of the diagonal.
        let (mut rows, mut left): (Vec<Vec<f64>>, _) = (vec![], vec![1.0; list.len()]);
        let mut taken = vec![];
        while taken.len() < most {
            let open = (0..list.len()).filter(|k| gains[*k] > 0.0 && left[*k] >= LEAST_LEFT);
            let Some(k) = open.max_by(|p, q| gains[*p].total_cmp(&gains[*q]).then(q.cmp(p))) else { break };
            let root = left[k].sqrt();
            let known = |i: usize| rows.iter().map(|row| row[i] * row[k]).sum::<f64>();
            let row: Vec<f64> = (0..list.len()).map(|i| (products[i / FEW][(i % FEW, k)] - known(i)) / root).collect();
            let gain = gains[k] / root;
            for (i, along) in row.iter().enumerate() {
                gains[i] -= along * gain;
                left[i] -= along * along;
            }
            left[k] = 0.0;
            taken.push(list[k]);
            rows.push(row);
        }
        taken
    }

    /// The active columns, a few at a time, and the first one's place.
    fn few(&self) -> Vec<(usize, MatRef<'_, f64>)> {
        let rows = self.a.nrows();
        let few = self.taken.chunks((FEW * rows).max(1)).enumerate();
        few.map(|(k, few)| (k * FEW, MatRef::from_column_major_slice(few, rows, few.len() / rows))).collect()
    }

    /// Takes columns in. False, and they are barred, where they are next to dependent.
    fn add(&mut self, list: &[usize]) -> bool {
        let (old, rows) = (self.active.len(), self.a.nrows());
        for &j in list {
            self.taken.extend(column(self.a, j).iter().copied().map(f64::from));
        }
        let new = MatRef::from_column_major_slice(&self.taken[old * rows..], rows, list.len());
        let work = pass(self.taken.len() * list.len() / 4);
        let products = threads::map(&self.few(), work, |(_, few)| few.transpose() * new);
        let product = |place: usize, k: usize| products[place / FEW][(place % FEW, k)];
        let across = Mat::from_fn(old, list.len(), |i, k| product(self.places[self.order[i]], k));
        let ridge = |i: usize, k: usize| if i == k { 1.0 + 1e-12 } else { 1.0 };
        let own = Mat::from_fn(list.len(), list.len(), |i, k| product(old + i, k) * ridge(i, k));
        if !self.factor.append(across, own) {
            self.taken.truncate(old * rows);
            list.iter().for_each(|&j| self.barred[j] = true);
            return false;
        }
        self.order.extend(list);
        self.active.extend(list);
        list.iter().enumerate().for_each(|(k, &j)| self.places[j] = old + k);
        true
    }

    /// Moves x to the least squares over the active columns; columns whose entry reaches 0 on the way are thrown out.
    fn solve(&mut self) {
        loop {
            let z = self.factor.solve(self.order.iter().map(|&j| self.right[j]));
            if z.iter().all(|z| *z > 0.0) {
                self.order.iter().zip(z).for_each(|(&j, z)| self.x[j] = z);
                return;
            }
            let mut out = self.approach(&z);
            if out.is_empty() {
                return; // where numbers end
            }
            for &i in out.iter().rev() {
                let column = self.order.remove(i);
                self.throw_out(column);
            }
            self.factor.remove(&mut out);
        }
    }

    /// Moves x towards `z` as far as it stays nonnegative; which of the order have the entry 0 there.
    fn approach(&mut self, z: &[f64]) -> Vec<usize> {
        let Self { norms, x, order, .. } = self;
        let mut alpha = 1.0f64;
        for (&j, z) in order.iter().zip(z).filter(|(_, z)| **z <= 0.0) {
            alpha = alpha.min(x[j] / (x[j] - z));
        }
        order.iter().zip(z).for_each(|(&j, z)| x[j] += alpha * (z - x[j]));
        let largest = order.iter().map(|&j| x[j] * norms[j]).fold(0.0, f64::max);
        let is_out = |i: &usize| z[*i] <= 0.0 && x[order[*i]] * norms[order[*i]] <= 1e-12 * largest;
        (0..order.len()).filter(is_out).collect()
    }

    /// Makes a column inactive. The last one takes its place.
    fn throw_out(&mut self, column: usize) {
        let (rows, place, last) = (self.a.nrows(), self.places[column], self.active.len() - 1);
        self.x[column] = 0.0;
        self.active.swap_remove(place);
        self.taken.copy_within(last * rows.., place * rows);
        self.taken.truncate(last * rows);
        if place < last {
            self.places[self.active[place]] = place;
        }
    }

    /// b − Ax.
    fn residual(&self, b: &DVector<f64>) -> DVector<f64> {
        let parts = threads::map(&self.few(), pass(self.taken.len()), |(first, few)| {
            few * Col::from_fn(few.ncols(), |k| self.x[self.active[first + k]])
        });
        let mut residual = b.clone();
        parts.iter().for_each(|part| residual.iter_mut().zip(part.iter()).for_each(|(left, x)| *left -= x));
        residual
    }
}

#[cfg(test)]
mod tests {
    use super::super::Random;
    use super::*;

    const ROWS: usize = 1003;

    /// Columns of sizes from 1e-9 to 1e9.
    fn columns(count: usize, random: &mut Random) -> Mat<f32> {
        let sizes: Vec<f64> = (0..count).map(|_| 10f64.powf(9.0 * random.next())).collect();
        let mut a = Mat::zeros(ROWS, count);
        for (j, size) in sizes.iter().enumerate() {
            let common = random.next();
            (0..ROWS).for_each(|i| a[(i, j)] = (size * (common + random.next().powi(3))) as f32);
        }
        a
    }

    fn vector(random: &mut Random) -> DVector<f64> {
        DVector::from_fn(ROWS, |_, _| 1e-5 * (0.3 + random.next()))
    }

    fn gain(a: &Mat<f32>, r: &DVector<f64>, j: usize) -> f64 {
        let own = own(a, j);
        own.dot(r) / own.norm()
    }

    fn own(a: &Mat<f32>, j: usize) -> DVector<f64> {
        DVector::from_fn(ROWS, |i, _| f64::from(a[(i, j)]))
    }

    #[test]
    fn gains_are_within_what_16_bits_tell_of_them() {
        let mut random = Random::new();
        let (a, r) = (columns(300, &mut random), vector(&mut random));
        let set = ActiveSet::new(a.as_ref(), &r, 300);
        let unit: Vec<f32> = r.iter().map(|x| (x / r.norm()) as f32).collect();
        let ranges: Vec<_> =
            set.strips.iter().flat_map(|strip| strip.gains(set.arch, (&unit, r.norm()), |j| j != 7)).collect();
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
            let set = ActiveSet::new(a.as_ref(), &r, 300);
            let mut order: Vec<usize> = (0..300).filter(|j| !set.barred[*j] && gain(&a, &r, *j) > 1e-7).collect();
            order.sort_by(|p, q| gain(&a, &r, *q).total_cmp(&gain(&a, &r, *p)));
            order.truncate(most);
            let best: Vec<usize> = set.best(&r, 1e-7, most).into_iter().map(|(_, j)| j).collect();
            assert_eq!(best, order);
        }
    }

    /// Orthogonal matching pursuit, one column after the other.
    #[test]
    fn columns_are_taken_by_what_those_before_leave_of_the_residual() {
        let mut random = Random::new();
        let (a, r) = (columns(300, &mut random), vector(&mut random));
        let set = ActiveSet::new(a.as_ref(), &r, 300);
        let best = set.best(&r, 0.0, 120);
        let mut list: Vec<usize> = best.iter().map(|(_, j)| *j).collect();
        let taken = set.apart(best, 12);
        assert!(taken.len() == 12 && taken != list[..12]);
        let (mut left, mut axes): (_, Vec<DVector<f64>>) = (r.clone(), vec![]);
        for j in taken {
            let beside = |j: usize| {
                let mut own = own(&a, j).normalize();
                (0..2).for_each(|_| axes.iter().for_each(|axis| own -= axis * axis.dot(&own)));
                own
            };
            let open = list.iter().filter(|j| beside(**j).norm_squared() >= LEAST_LEFT);
            assert_eq!(open.max_by(|p, q| gain(&a, &left, **p).total_cmp(&gain(&a, &left, **q))), Some(&j));
            let axis = beside(j).normalize();
            left -= &axis * axis.dot(&left);
            axes.push(axis);
            list.retain(|other| *other != j);
        }
    }

    /// The conditions of Karush, Kuhn and Tucker; and weights that have an exact solution are found.
    #[test]
    fn weights_are_the_least_squares_of_those_that_are_not_negative() {
        let mut random = Random::new();
        let mut a = Mat::zeros(ROWS, 200);
        (0..200).for_each(|j| (0..ROWS).for_each(|i| a[(i, j)] = (0.5 + random.next()) as f32));
        let b = 1e5 * vector(&mut random);
        let (x, residual) = nonnegative(a.as_ref(), &b, 200, |_, _| Ok(false)).unwrap();
        assert!(x.iter().all(|x| *x >= 0.0) && x.iter().filter(|x| **x > 0.0).count() > 20 && x.contains(&0.0));
        for (j, x) in x.iter().enumerate() {
            let slope = gain(&a, &residual, j) / b.norm();
            assert!(slope < 1e-9 && (*x == 0.0 || slope > -1e-9), "{j}: {x}, {slope}"); // the diagonal is larger by 1e-12
        }
        let told: Vec<f64> = (0..200).map(|j| if j % 3 == 0 { 1.0 + random.next() } else { 0.0 }).collect();
        let b = DVector::from_fn(ROWS, |i, _| (0..200).map(|j| f64::from(a[(i, j)]) * told[j]).sum());
        let (x, residual) = nonnegative(a.as_ref(), &b, 200, |_, _| Ok(false)).unwrap();
        assert!(residual.norm() < 1e-9 * b.norm());
        assert!(x.iter().zip(&told).all(|(x, told)| (x - told).abs() < 1e-7)); // a condition of 1e2, squared
    }
}
