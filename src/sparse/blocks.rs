//! The lower triangle of a symmetric matrix made of elements: 3 × 3 blocks between the free vertices of an element.

use crate::mesh::NONE;
use crate::support::Roller;
use crate::{Error, ErrorKind, Result};
use faer::sparse::{SparseColMat, SymbolicSparseColMat};
use nalgebra::Matrix3;
use std::borrow::Borrow;

/// Hands the vertices of each element to what it is given.
pub type VisitElements<'a> = dyn FnMut(&mut dyn FnMut(&[u32])) + 'a;

/// For each free vertex, the free vertices not before it that share an element with it; the first is itself.
pub(super) struct BlockPattern {
    start: Vec<usize>,
    rows: Vec<u32>,
}

impl BlockPattern {
    pub(super) fn column(&self, j: usize) -> &[u32] {
        &self.rows[self.start[j]..self.start[j + 1]]
    }

    fn of(n: usize, index: &[u32], visit: &mut VisitElements) -> Self {
        let mut columns: Vec<Vec<u32>> = (0..n as u32).map(|j| vec![j]).collect();
        visit(&mut |vertices| {
            for &v in vertices {
                for &w in vertices {
                    let (j, i) = (index[v as usize], index[w as usize]);
                    if j < i && i != NONE && !columns[j as usize].contains(&i) {
                        columns[j as usize].push(i);
                    }
                }
            }
        });
        let mut start = vec![0];
        let mut rows = Vec::new();
        for column in &mut columns {
            column.sort_unstable();
            rows.extend_from_slice(column);
            start.push(rows.len());
        }
        Self { start, rows }
    }

    /// Expands blocks into the scalar lower triangle.
    fn scalar_pattern(&self) -> SymbolicSparseColMat<usize> {
        let n = self.start.len() - 1;
        let mut col_ptr = vec![0];
        let mut row_idx = Vec::with_capacity(9 * self.rows.len());
        for j in 0..n {
            for c in 0..3 {
                let scalars = self.column(j).iter().flat_map(|&i| (0..3).map(move |d| 3 * i as usize + d));
                row_idx.extend(scalars.skip(c));
                col_ptr.push(row_idx.len());
            }
        }
        SymbolicSparseColMat::new_checked(3 * n, 3 * n, col_ptr, None, row_idx)
    }
}

/// Columns up to so many entries are counted through, without a branch that the processor could guess wrong.
const SHORT: usize = 64;

/// Where `i` is in an ascending column that has it.
fn place_of(i: u32, column: &[u32]) -> usize {
    let place = match column.len() {
        ..=SHORT => column.iter().map(|&row| u32::from(row < i)).sum::<u32>() as usize,
        _ => column.partition_point(|&row| row < i),
    };
    assert!(column.get(place) == Some(&i), "the pattern holds every pair of an element");
    place
}

/// A symmetric matrix with the pattern of the shell's stiffness, three unknowns per free vertex.
pub struct BlockMatrix {
    /// Lower triangle, columns sorted (n_unknowns × n_unknowns).
    pub lower: SparseColMat<usize, f64>,
    pub(super) pattern: BlockPattern,
    /// Free index of each vertex, [`NONE`] for one that does not move (n_vertices).
    index: Vec<u32>,
    /// What is held of free vertices, and the mean diagonal entry of the rest stiffness there.
    rollers: Vec<(Roller, f64)>,
    /// Their places among these by free index, [`NONE`] for others; nothing without any.
    roller_at: Vec<u32>,
}

impl BlockMatrix {
    /// The zero matrix over the `free` of so many vertices, with room for the elements whose vertices `visit` hands out.
    pub fn new(n_vertices: usize, free: &[u32], visit: &mut VisitElements) -> Self {
        let mut index = vec![NONE; n_vertices];
        free.iter().enumerate().for_each(|(i, &v)| index[v as usize] = i as u32);
        let pattern = BlockPattern::of(free.len(), &index, visit);
        let scalar = pattern.scalar_pattern();
        let values = vec![0.0; scalar.row_idx().len()];
        let lower = SparseColMat::new(scalar, values);
        Self { lower, pattern, index, rollers: vec![], roller_at: vec![] }
    }

    /// The same where these rollers hold free vertices; `add_stiffness` adds the mean diagonal entry of the rest stiffness at each vertex
    /// (n_vertices), and is asked where there are any.
    pub fn rolling(mut self, rollers: &[Roller], add_stiffness: impl FnOnce(&mut [f64])) -> Self {
        if rollers.is_empty() {
            return self;
        }
        let mut stiffness = vec![0.0; self.index.len()];
        add_stiffness(&mut stiffness);
        self.roller_at = vec![NONE; self.lower.ncols() / 3];
        for (k, roller) in rollers.iter().enumerate() {
            self.roller_at[self.index[roller.vertex as usize] as usize] = k as u32;
            let own = stiffness[roller.vertex as usize];
            self.rollers.push((*roller, if own > 0.0 { own } else { 1.0 }));
        }
        self
    }

    /// Adds the element with these vertices; `block(p, q)` couples the p-th (row) with the q-th (column) of them, and is
    /// asked for the lower triangle and the free vertices only.
    pub fn add_element(&mut self, vertices: &[u32], block: impl Fn(usize, usize) -> Matrix3<f64>) {
        self.all().add_element(vertices, block);
    }

    /// All columns.
    pub fn all(&mut self) -> Columns<'_> {
        let Self { lower, pattern, index, rollers, roller_at } = self;
        let rollers = Rollers { rollers, roller_at };
        let (symbolic, values) = lower.parts_mut();
        Columns { free: [0, NONE], values, skipped: 0, starts: symbolic.col_ptr(), pattern, index, rollers }
    }

    /// Fills what held directions leave empty of the diagonal, by `value` of the stiffness there.
    pub fn fill_rollers(&mut self, value: impl Fn(f64) -> f64) {
        for k in 0..self.rollers.len() {
            let (roller, stiffness) = self.rollers[k];
            let i = self.index[roller.vertex as usize];
            let (symbolic, values) = self.lower.parts_mut();
            let block = value(stiffness) * (Matrix3::identity() - roller.free);
            add_block(symbolic.col_ptr(), (values, 0), (0, i), &block);
        }
    }

    /// The columns of ranges of free vertices, ascending, each for a thread of its own.
    pub fn columns(&mut self, ranges: impl Iterator<Item = [usize; 2]>) -> Vec<Columns<'_>> {
        let Self { lower, pattern, index, rollers, roller_at } = self;
        let rollers = Rollers { rollers, roller_at };
        let (symbolic, mut values) = lower.parts_mut();
        let (starts, mut taken) = (symbolic.col_ptr(), 0);
        let part = |[first, end]: [usize; 2]| {
            let (own, rest) = std::mem::take(&mut values)[starts[3 * first] - taken..]
                .split_at_mut(starts[3 * end] - starts[3 * first]);
            (values, taken) = (rest, starts[3 * end]);
            Columns {
                free: [first as u32, end as u32],
                values: own,
                skipped: starts[3 * first],
                starts,
                pattern,
                index,
                rollers,
            }
        };
        ranges.map(part).collect()
    }

    /// Adds `value` to the three diagonal entries of the i-th free vertex.
    pub fn add_diagonal(&mut self, i: usize, value: f64) {
        for j in 3 * i..3 * i + 3 {
            let first = self.lower.symbolic().col_ptr()[j];
            self.lower.val_mut()[first] += value;
        }
    }

    /// The diagonal entries, by unknown.
    pub fn diagonal(&self) -> impl Iterator<Item = f64> + '_ {
        let first = &self.lower.symbolic().col_ptr()[..self.lower.ncols()];
        first.iter().map(|&k| self.lower.val()[k])
    }

    /// Fails with the first entry that is not finite.
    pub fn require_finite(&self) -> Result<()> {
        // All are looked at, without a branch for each.
        if self.lower.val().iter().fold(true, |all, v| all & v.is_finite()) {
            return Ok(());
        }
        let Some(bad) = self.lower.val().iter().find(|v| !v.is_finite()) else {
            return Ok(());
        };
        let message = format!("the stiffness matrix has the entry {bad:?}: stiffness, density or size out of range");
        Err(Error::new(ErrorKind::Numerical, message))
    }
}

/// Adds the block at a `place` of its column of blocks j, the first of which is on the diagonal, to values that begin after so many `skipped` ones.
#[inline(always)]
fn add_block(starts: &[usize], (values, skipped): (&mut [f64], usize), (place, j): (usize, u32), block: &Matrix3<f64>) {
    let j_first = 3 * j as usize;
    for (c, (start, column)) in starts[j_first..j_first + 3].iter().zip(block.as_slice().as_chunks::<3>().0).enumerate()
    {
        // Each column begins with its diagonal entry.
        let at = start - skipped;
        if place == 0 {
            values[at..at + 3 - c].iter_mut().zip(&column[c..]).for_each(|(entry, b)| *entry += b);
        } else {
            let at = at + 3 * place - c;
            values[at..at + 3].iter_mut().zip(column).for_each(|(entry, b)| *entry += b);
        }
    }
}

/// What is held of free vertices.
#[derive(Clone, Copy)]
struct Rollers<'a> {
    rollers: &'a [(Roller, f64)],
    roller_at: &'a [u32],
}

impl Rollers<'_> {
    fn projected(&self, i: u32, block: Matrix3<f64>, j: u32) -> Matrix3<f64> {
        let roller = |k: u32| self.rollers.get(self.roller_at[k as usize] as usize).map(|(roller, _)| roller.free);
        let rows = roller(i).map_or(block, |free| free * block);
        roller(j).map_or(rows, |free| rows * free)
    }
}

/// The columns of some free vertices.
pub struct Columns<'a> {
    /// From one to before the other.
    free: [u32; 2],
    values: &'a mut [f64],
    /// Values before these.
    skipped: usize,
    starts: &'a [usize],
    pattern: &'a BlockPattern,
    index: &'a [u32],
    rollers: Rollers<'a>,
}

impl Columns<'_> {
    /// Sets these to zero.
    pub fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// As [`BlockMatrix::add_element`], what of it is in these columns.
    #[inline(always)]
    pub fn add_element<B: Borrow<Matrix3<f64>>>(&mut self, vertices: &[u32], block: impl Fn(usize, usize) -> B) {
        for (q, &v) in vertices.iter().enumerate() {
            let j = self.index[v as usize];
            if !(self.free[0]..self.free[1]).contains(&j) {
                continue;
            }
            let column = self.pattern.column(j as usize);
            for (p, &w) in vertices.iter().enumerate() {
                let i = self.index[w as usize];
                if i != NONE && j <= i {
                    let place = if i == j { 0 } else { place_of(i, column) };
                    let (block, values) = (block(p, q), (&mut *self.values, self.skipped));
                    match self.rollers.rollers {
                        [] => add_block(self.starts, values, (place, j), block.borrow()),
                        _ => {
                            let left = self.rollers.projected(i, *block.borrow(), j);
                            add_block(self.starts, values, (place, j), &left);
                        }
                    }
                }
            }
        }
    }
}

/// (row, column, value) of every stored entry.
pub fn entries(lower: &SparseColMat<usize, f64>) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
    let (pattern, values) = (lower.symbolic(), lower.val());
    (0..lower.ncols()).flat_map(move |j| {
        let range = pattern.col_ptr()[j]..pattern.col_ptr()[j + 1];
        range.map(move |k| (pattern.row_idx()[k], j, values[k]))
    })
}
