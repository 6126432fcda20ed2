//! Cholesky factors of large matrices, on several threads.
//!
//! A panel takes what earlier ones leave, in their order, and is then factorized. So the bits are the same on any number of threads.

use super::columns::Scalar;
use super::panels::{Panel, Panels, Update, pattern};
use crate::error::try_zeroed;
use crate::threads::WaitFor;
use crate::{Error, Result};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use faer::{Accum, MatMut, MatRef, Par};
use std::sync::{Mutex, OnceLock, PoisonError};

/// Rows of a product that are made at once, to stay in the cache.
const TALL: usize = 256;

/// Multiplications in a nanosecond.
const MULTIPLIED: f64 = 5.0;

/// Why a factorization ends early.
enum Stopped {
    NotPositive,
    Failed(Error),
}

/// A task's own numbers while it has them, and when it has done for the others to read.
pub struct Part<'a, T> {
    own: Mutex<Option<&'a mut [T]>>,
    done: OnceLock<&'a [T]>,
}

impl<'a, T> Part<'a, T> {
    fn of(own: &'a mut [T]) -> Self {
        Self { own: Mutex::new(Some(own)), done: OnceLock::new() }
    }

    pub fn take(&self) -> &'a mut [T] {
        self.own.lock().unwrap_or_else(PoisonError::into_inner).take().expect("each task runs once")
    }

    pub fn publish(&self, own: &'a mut [T]) {
        let once = self.done.set(own);
        assert!(once.is_ok(), "each task runs once");
    }

    pub fn done(&self) -> &'a [T] {
        self.done.get().expect("a task runs after those that it waits for")
    }
}

/// `values` by task.
pub fn parts<'a, T>(n: usize, mut values: &'a mut [T], len: impl Fn(usize) -> usize) -> Vec<Part<'a, T>> {
    let part = |t| {
        let (own, rest) = std::mem::take(&mut values).split_at_mut(len(t));
        values = rest;
        Part::of(own)
    };
    (0..n).map(part).collect()
}

/// What a thread works with.
struct Scratch<T> {
    /// Where each row is among a panel's.
    place: Vec<u32>,
    /// Of a product's rows, those that are one after the other there: the first's place, and how many.
    runs: Vec<[u32; 2]>,
    product: Vec<T>,
    stack: MemBuffer,
}

/// A factor's structure and its panels.
#[derive(Clone, Copy)]
pub struct Branches<'a> {
    pub structure: &'a SymbolicSupernodalCholesky<usize>,
    pub panels: &'a Panels,
}

fn view<'a, T: Scalar>(panel: &Panel, values: &'a [T]) -> MatRef<'a, T> {
    MatRef::from_column_major_slice(values, panel.rows, panel.width).subrows(panel.inside, panel.height())
}

impl Branches<'_> {
    fn columns(&self, s: usize) -> usize {
        self.structure.supernode_end()[s] - self.structure.supernode_begin()[s]
    }

    /// A = LLᵀ for the `entries` of A's lower triangle into `values`; false where A is not numerically positive definite.
    pub fn factorize<T: Scalar>(&self, entries: &[f64], values: &mut [T], operations: f64) -> Result<bool> {
        let panels = self.panels;
        assert!(entries.len() == panels.n_entries(), "the matrix has the pattern that was analysed");
        let parts = parts(panels.n_tasks(), values, |t| panels.values(t).len());
        let widest = panels.panels.iter().map(|panel| panel.width).max().unwrap_or(0);
        let scratch = cholesky_in_place_scratch::<T>(widest, Par::Seq, Default::default());
        let make = || -> std::result::Result<Scratch<T>, Stopped> {
            let place = try_zeroed("a factor of the stiffness", self.structure.nrows()).map_err(Stopped::Failed)?;
            let product = try_zeroed("a factor of the stiffness", TALL * widest).map_err(Stopped::Failed)?;
            let stack = MemBuffer::try_new(scratch)
                .map_err(|_| Stopped::Failed(super::factor::out_of_memory("Cholesky factorization")))?;
            Ok(Scratch { place, runs: vec![], product, stack })
        };
        let body = |scratch: &mut Scratch<T>, t: usize, wait: WaitFor| {
            let own = parts[t].take();
            self.factorize_task((t, entries), &mut *own, &parts, (scratch, &wait))?;
            parts[t].publish(own);
            Ok(())
        };
        match panels.factor.run((operations / MULTIPLIED) as u64, make, body) {
            Ok(()) => Ok(true),
            Err(Stopped::NotPositive) => Ok(false),
            Err(Stopped::Failed(error)) => Err(error),
        }
    }

    fn factorize_task<T: Scalar>(
        &self,
        (t, entries): (usize, &[f64]),
        own: &mut [T],
        parts: &[Part<T>],
        (scratch, wait): (&mut Scratch<T>, &WaitFor),
    ) -> std::result::Result<(), Stopped> {
        let (panels, begin) = (self.panels, self.panels.values(t).start);
        own.fill(T::default());
        for &[entry, at] in panels.entries(t) {
            own[at as usize] += T::of(entries[entry as usize]);
        }
        for k in panels.of_task(t) {
            let panel = panels.panels[k];
            let (before, rest) = own.split_at_mut(panel.values - begin);
            let target = &mut rest[..panel.rows * panel.width];
            self.place_rows(&panel, &mut scratch.place);
            for update in panels.updates(k) {
                for d in panels.of_supernode(update.supernode as usize) {
                    let task = panels.task_of[d] as usize;
                    let values = if task == t { &*before } else { parts[task].done() };
                    self.take_from(&panel, target, (d, self.of_panel(d, values)), (update, scratch));
                }
            }
            for d in panels.of_supernode(panel.supernode).start..k {
                let values = match panels.task_of[d] as usize {
                    task if task == t => &*before,
                    task => wait.found(|| parts[task].done.get().copied()).ok_or(Stopped::NotPositive)?,
                };
                take_beside(&panel, target, (&panels.panels[d], self.of_panel(d, values)));
            }
            finish(&panel, target, &mut scratch.stack)?;
        }
        Ok(())
    }

    /// The values of a panel among those of its task.
    fn of_panel<'b, T>(&self, d: usize, values: &'b [T]) -> &'b [T] {
        let panel = &self.panels.panels[d];
        let at = panel.values - self.panels.values(self.panels.task_of[d] as usize).start;
        &values[at..at + panel.rows * panel.width]
    }

    /// Notes where the rows of a panel are.
    fn place_rows(&self, panel: &Panel, place: &mut [u32]) {
        let own = panel.own(self.columns(panel.supernode));
        for r in 0..own {
            place[panel.first + r] = r as u32;
        }
        for (r, row) in pattern(self.structure, panel.supernode).iter().enumerate() {
            place[*row] = (own + r) as u32;
        }
    }

    /// What a panel takes from one of an earlier supernode.
    fn take_from<T: Scalar>(
        &self,
        panel: &Panel,
        target: &mut [T],
        (d, values): (usize, &[T]),
        (update, scratch): (&Update, &mut Scratch<T>),
    ) {
        let (s, from, count) = (update.supernode as usize, update.from as usize, update.count as usize);
        let earlier = &self.panels.panels[d];
        let rows = &pattern(self.structure, s)[from..];
        let left = view(earlier, values).subrows(earlier.own(self.columns(s)) + from, rows.len());
        let right = left.subrows(0, count).transpose();
        let Scratch { place, runs, product, .. } = scratch;
        let mut at = 0;
        while at < rows.len() {
            let tall = TALL.min(rows.len() - at);
            let product = &mut product[..tall * count];
            let made = MatMut::from_column_major_slice_mut(product, tall, count);
            matmul(made, Accum::Replace, left.subrows(at, tall), right, T::of(1.0), Par::Seq);
            find_runs(&rows[at..at + tall], place, runs);
            for (column, product) in rows[..count].iter().zip(product.chunks_exact(tall)) {
                let target = &mut target[(column - panel.first) * panel.rows + panel.inside..][..panel.height()];
                let mut rest = product;
                for [first, count] in runs.iter() {
                    let (own, others) = rest.split_at(*count as usize);
                    rest = others;
                    let target = &mut target[*first as usize..][..own.len()];
                    target.iter_mut().zip(own).for_each(|(entry, value)| *entry -= *value);
                }
            }
            at += tall;
        }
    }
}

/// Parts rows, ascending, where their places are not one after the other.
fn find_runs(rows: &[usize], place: &[u32], runs: &mut Vec<[u32; 2]>) {
    runs.clear();
    for row in rows {
        let place = place[*row];
        match runs.last_mut() {
            Some([first, count]) if *first + *count == place => *count += 1,
            _ => runs.push([place, 1]),
        }
    }
}

/// What a panel takes from an earlier one of its own supernode.
fn take_beside<T: Scalar>(panel: &Panel, target: &mut [T], (earlier, values): (&Panel, &[T])) {
    let left = view(earlier, values).subrows(panel.inside - earlier.inside, panel.height());
    let right = left.subrows(0, panel.width).transpose();
    let target = MatMut::from_column_major_slice_mut(target, panel.rows, panel.width);
    matmul(target.subrows_mut(panel.inside, panel.height()), Accum::Add, left, right, T::of(-1.0), Par::Seq);
}

/// Factorizes a panel that has taken all.
fn finish<T: Scalar>(panel: &Panel, target: &mut [T], stack: &mut MemBuffer) -> std::result::Result<(), Stopped> {
    let target = MatMut::from_column_major_slice_mut(target, panel.rows, panel.width);
    let own = target.subrows_mut(panel.inside, panel.height());
    let (mut top, mut below) = own.split_at_row_mut(panel.width);
    let (none, stack) = (Default::default(), MemStack::new(stack));
    cholesky_in_place(top.as_mut(), none, Par::Seq, stack, Default::default()).map_err(|_| Stopped::NotPositive)?;
    solve_lower_triangular_in_place(top.as_ref(), below.as_mut().transpose_mut(), Par::Seq);
    Ok(())
}
