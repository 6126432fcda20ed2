//! Fill-reducing orders of elimination by geometry.
//!
//! Nested dissection (George 1973): the 3 × 3 blocks lie in space, so they are cut in halves across their longest extent, the halves
//! again, and what separates two halves is eliminated after them. Small pieces are in order of approximate minimum degree (Amestoy,
//! Davis, Duff 1996).

use crate::error::try_zeroed;
use crate::mesh::NONE;
use crate::{Error, ErrorKind, Result, Vec3};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::amd;
use faer::sparse::{SymbolicSparseColMat, SymbolicSparseColMatRef};
use nalgebra::Matrix3;

/// Pieces up to this many blocks are ordered by minimum degree.
const PIECE: usize = 100;

/// The block to eliminate at each position by approximate minimum degree, for a lower triangle of N × N blocks. An N-th of the unknowns
/// to order, and no more fill: a block's rows are alike.
pub fn minimum_degree<const N: usize>(lower: SymbolicSparseColMatRef<'_, usize>) -> Result<Vec<u32>> {
    let n = lower.ncols() / N;
    let (mut start, mut rows) = (vec![0], vec![]);
    for j in 0..n {
        rows.extend(lower.row_idx_of_col_raw(N * j).iter().step_by(N).map(|i| i / N));
        start.push(rows.len());
    }
    Ok(by_degree(start, rows)?.into_iter().map(|k| k as u32).collect())
}

/// An order of approximate minimum degree for the lower triangle of these columns.
fn by_degree(start: Vec<usize>, rows: Vec<usize>) -> Result<Vec<usize>> {
    let n = start.len() - 1;
    let lower = SymbolicSparseColMat::new_unsorted_checked(n, n, start, None, rows);
    let out_of_memory = || Error::new(ErrorKind::OutOfMemory, "not enough memory for the fill-reducing order");
    let mut order = try_zeroed("the fill-reducing order", n)?;
    let mut position = try_zeroed("the fill-reducing order", n)?;
    let scratch = amd::order_maybe_unsorted_scratch::<usize>(n, lower.row_idx().len());
    let mut buffer = MemBuffer::try_new(scratch).map_err(|_| out_of_memory())?;
    let stack = MemStack::new(&mut buffer);
    amd::order_maybe_unsorted(&mut order, &mut position, lower.as_ref(), Default::default(), stack)
        .map_err(|_| out_of_memory())?;
    Ok(order)
}

/// The block to eliminate at each position, for a lower triangle of 3 × 3 blocks that each lie at a point.
pub fn nested_dissection(lower: SymbolicSparseColMatRef<'_, usize>, points: &[Vec3]) -> Result<Vec<u32>> {
    let mut blocks: Vec<u32> = (0..points.len() as u32).collect();
    let mut order = Vec::with_capacity(blocks.len());
    Pieces::of(lower)?.dissect(points, &mut blocks, &mut order)?;
    Ok(order)
}

/// A graph with all its neighbours both ways, to be taken apart.
struct Pieces {
    start: Vec<usize>,
    neighbours: Vec<u32>,
    /// Place of each block in the piece at hand.
    place: Vec<u32>,
}

impl Pieces {
    fn of(lower: SymbolicSparseColMatRef<'_, usize>) -> Result<Self> {
        let n = lower.ncols() / 3;
        let mut start = try_zeroed::<usize>("the fill-reducing order", n + 1)?;
        // Column 3j begins with the three rows of its own block.
        let below = |j: usize| lower.row_idx_of_col_raw(3 * j)[3..].iter().step_by(3).map(|i| i / 3);
        let pairs = || (0..n).flat_map(|j| below(j).map(move |i| (i, j)));
        pairs().flat_map(|(i, j)| [i, j]).for_each(|i| start[i + 1] += 1);
        (0..n).for_each(|i| start[i + 1] += start[i]);
        let mut neighbours = try_zeroed::<u32>("the fill-reducing order", start[n])?;
        let mut next = start.clone();
        for (i, j) in pairs().flat_map(|(i, j)| [(i, j), (j, i)]) {
            neighbours[next[i]] = j as u32;
            next[i] += 1;
        }
        Ok(Self { start, neighbours, place: vec![NONE; n] })
    }

    fn around(&self, block: u32) -> &[u32] {
        &self.neighbours[self.start[block as usize]..self.start[block as usize + 1]]
    }

    /// Appends an order of the blocks to `order`: one half, the other, what separates them.
    fn dissect(&mut self, points: &[Vec3], blocks: &mut [u32], order: &mut Vec<u32>) -> Result<()> {
        if blocks.len() <= PIECE {
            order.extend(self.minimum_degree(blocks)?);
            return Ok(());
        }
        let along = longest_extent(points, blocks);
        let key = |block: &u32| (points[*block as usize].dot(&along), *block);
        let middle = blocks.len() / 2;
        blocks.select_nth_unstable_by(middle, |a, b| {
            let (a, b) = (key(a), key(b));
            a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
        });
        blocks.iter().enumerate().for_each(|(k, b)| self.place[*b as usize] = u32::from(k >= middle));
        let borders = |side: u32| {
            let touches = |b: &&u32| self.around(**b).iter().any(|other| self.place[*other as usize] == 1 - side);
            let half = if side == 0 { &blocks[..middle] } else { &blocks[middle..] };
            half.iter().filter(touches).copied().collect::<Vec<u32>>()
        };
        let [near, far] = [borders(0), borders(1)];
        let mut separator = if near.len() <= far.len() { near } else { far };
        separator.iter().for_each(|b| self.place[*b as usize] = 2);
        let (mut first, mut second) = (vec![], vec![]);
        for &b in blocks.iter() {
            match self.place[b as usize] {
                0 => first.push(b),
                1 => second.push(b),
                _ => {}
            }
        }
        blocks.iter().for_each(|b| self.place[*b as usize] = NONE);
        for half in [&mut first, &mut second] {
            self.dissect(points, half, order)?;
        }
        order.append(&mut separator);
        Ok(())
    }

    /// An order of the blocks by approximate minimum degree, as if there were no others.
    fn minimum_degree(&mut self, blocks: &[u32]) -> Result<Vec<u32>> {
        blocks.iter().enumerate().for_each(|(k, b)| self.place[*b as usize] = k as u32);
        let (mut start, mut rows) = (vec![0], vec![]);
        for (k, &block) in blocks.iter().enumerate() {
            let inside = self.around(block).iter().map(|b| self.place[*b as usize]);
            rows.push(k);
            rows.extend(inside.filter(|i| *i != NONE && *i > k as u32).map(|i| i as usize));
            start.push(rows.len());
        }
        blocks.iter().for_each(|b| self.place[*b as usize] = NONE);
        Ok(by_degree(start, rows)?.into_iter().map(|k| blocks[k]).collect())
    }
}

/// The direction in which the blocks are spread most.
fn longest_extent(points: &[Vec3], blocks: &[u32]) -> Vec3 {
    let at = |b: &u32| points[*b as usize];
    let mean = blocks.iter().map(at).sum::<Vec3>() / blocks.len() as f64;
    let mut spread = Matrix3::zeros();
    for x in blocks.iter().map(at) {
        spread += (x - mean) * (x - mean).transpose();
    }
    let eigen = spread.symmetric_eigen();
    eigen.eigenvectors.column(eigen.eigenvalues.imax()).into()
}
