//! Products of a matrix with a vector, on several threads.
//!
//! Some columns add to the rows of others. So large matrices are taken in parts of columns, always as many: each sums what it gives on its own, and
//! these sums are added in order. So the bits are the same on any number of threads.

use super::blocks::BlockMatrix;
use crate::threads::share_items;
use std::ops::Range;

/// Parts of a matrix of at least so many columns of blocks.
const PARTS: usize = 4;
const LARGE: usize = 4_000;

/// Nanoseconds for an entry.
const NANOSECONDS: f64 = 0.5;

impl BlockMatrix {
    /// `product` ← the matrix times `x` (n_unknowns), by way of the sums in `room`.
    pub fn times(&self, x: &[f64], product: &mut [f64], room: &mut Vec<f64>) {
        product.fill(0.0);
        let n = x.len() / 3;
        if n < LARGE {
            return self.add_product(0..n, x, product);
        }
        let (starts, nanoseconds) = (self.lower.symbolic().col_ptr(), NANOSECONDS * self.lower.val().len() as f64);
        let edge = |k: usize| starts.partition_point(|at| at * PARTS < k * starts[3 * n]).div_ceil(3);
        let reach = |columns: &Range<usize>| columns.clone().filter_map(|j| self.pattern.column(j).last()).max();
        let parts = (0..PARTS).map(|k| edge(k)..edge(k + 1));
        let rows = parts.map(|columns| (reach(&columns).map_or(columns.start, |last| *last as usize + 1), columns));
        let rows: Vec<(usize, Range<usize>)> = rows.collect();
        room.clear();
        room.resize(rows.iter().map(|(end, columns)| 3 * (end - columns.start)).sum(), 0.0);
        let (mut rest, mut items) = (&mut room[..], vec![]);
        for (end, columns) in rows {
            let (own, others) = rest.split_at_mut(3 * (end - columns.start));
            rest = others;
            items.push((columns, own));
        }
        share_items(&mut items, nanoseconds as u64, |(columns, sums)| self.add_product(columns.clone(), x, sums));
        for (columns, sums) in items {
            product[3 * columns.start..].iter_mut().zip(sums).for_each(|(sum, own)| *sum += *own);
        }
    }

    /// Adds what some columns and their mirror images give to `sums`, which begin at the first of these columns.
    fn add_product(&self, columns: Range<usize>, x: &[f64], sums: &mut [f64]) {
        let (starts, values) = (self.lower.symbolic().col_ptr(), self.lower.val());
        let (x, begin) = (&x[3 * columns.start..], columns.start);
        for j in columns {
            // Each column begins with its diagonal entry.
            let [a, b, c] = [0, 1, 2].map(|k| &values[starts[3 * j + k]..starts[3 * j + k + 1]]);
            let first = 3 * (j - begin);
            let own = [x[first], x[first + 1], x[first + 2]];
            let mut given =
                [a[0] * own[0] + a[1] * own[1] + a[2] * own[2], b[0] * own[1] + b[1] * own[2], c[0] * own[2]];
            sums[first + 1] += a[1] * own[0];
            sums[first + 2] = sums[first + 2] + a[2] * own[0] + b[1] * own[1];
            let blocks = a[3..].chunks_exact(3).zip(b[2..].chunks_exact(3)).zip(c[1..].chunks_exact(3));
            for (&i, ((a, b), c)) in self.pattern.column(j)[1..].iter().zip(blocks) {
                let at = 3 * (i as usize - begin);
                let (other, sums) = (&x[at..at + 3], &mut sums[at..at + 3]);
                for r in 0..3 {
                    sums[r] = sums[r] + a[r] * own[0] + b[r] * own[1] + c[r] * own[2];
                    given[0] += a[r] * other[r];
                    given[1] += b[r] * other[r];
                    given[2] += c[r] * other[r];
                }
            }
            (0..3).for_each(|k| sums[first + k] += given[k]);
        }
    }
}
