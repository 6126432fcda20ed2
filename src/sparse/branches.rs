//! Cholesky factors of large matrices, and solutions by them, on several threads.
//!
//! A panel takes what earlier ones leave, in their order, and is then factorized. Up the tree, each task hands what it leaves of a right side to
//! the one above it, which adds these in order; down the tree, it takes what it needs from there. So the bits are the same on any number of threads.

use super::columns::{Lower, SolveDown, SolveUp};
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
use pulp::Arch;
use std::sync::{Mutex, OnceLock, PoisonError};

/// Rows of a product that are made at once, to stay in the cache.
const TALL: usize = 256;

/// Multiplications in a nanosecond, and entries read.
const MULTIPLIED: f64 = 5.0;
const READ: f64 = 0.5;

/// Why a factorization ends early.
enum Stopped {
    NotPositive,
    Failed(Error),
}

/// A task's own numbers while it has them, and when it has done for the others to read.
struct Part<'a> {
    own: Mutex<Option<&'a mut [f64]>>,
    done: OnceLock<&'a [f64]>,
}

impl<'a> Part<'a> {
    fn of(own: &'a mut [f64]) -> Self {
        Self { own: Mutex::new(Some(own)), done: OnceLock::new() }
    }

    fn take(&self) -> &'a mut [f64] {
        self.own.lock().unwrap_or_else(PoisonError::into_inner).take().expect("each task runs once")
    }

    fn publish(&self, own: &'a mut [f64]) {
        let once = self.done.set(own);
        assert!(once.is_ok(), "each task runs once");
    }

    fn done(&self) -> &'a [f64] {
        self.done.get().expect("a task runs after those that it waits for")
    }
}

/// `values` by task.
fn parts<'a>(n: usize, mut values: &'a mut [f64], len: impl Fn(usize) -> usize) -> Vec<Part<'a>> {
    let part = |t| {
        let (own, rest) = std::mem::take(&mut values).split_at_mut(len(t));
        values = rest;
        Part::of(own)
    };
    (0..n).map(part).collect()
}

/// What a thread works with.
struct Scratch {
    /// Where each row is among a panel's.
    place: Vec<u32>,
    /// Of a product's rows, those that are one after the other there: the first's place, and how many.
    runs: Vec<[u32; 2]>,
    product: Vec<f64>,
    stack: MemBuffer,
}

/// A factor's structure and its panels.
#[derive(Clone, Copy)]
pub struct Branches<'a> {
    pub structure: &'a SymbolicSupernodalCholesky<usize>,
    pub panels: &'a Panels,
}

/// Room for a solution's sums.
pub struct SumRoom(Vec<f64>);

fn view<'a>(panel: &Panel, values: &'a [f64]) -> MatRef<'a, f64> {
    MatRef::from_column_major_slice(values, panel.rows, panel.width).subrows(panel.inside, panel.height())
}

impl Branches<'_> {
    fn columns(&self, s: usize) -> usize {
        self.structure.supernode_end()[s] - self.structure.supernode_begin()[s]
    }

    /// A = LLᵀ for the `entries` of A's lower triangle into `values`; false where A is not numerically positive definite.
    pub fn factorize(&self, entries: &[f64], values: &mut [f64], operations: f64) -> Result<bool> {
        let panels = self.panels;
        assert!(entries.len() == panels.n_entries(), "the matrix has the pattern that was analysed");
        let parts = parts(panels.n_tasks(), values, |t| panels.values(t).len());
        let widest = panels.panels.iter().map(|panel| panel.width).max().unwrap_or(0);
        let scratch = cholesky_in_place_scratch::<f64>(widest, Par::Seq, Default::default());
        let make = || -> std::result::Result<Scratch, Stopped> {
            let place = try_zeroed("a factor of the stiffness", self.structure.nrows()).map_err(Stopped::Failed)?;
            let product = try_zeroed("a factor of the stiffness", TALL * widest).map_err(Stopped::Failed)?;
            let stack = MemBuffer::try_new(scratch)
                .map_err(|_| Stopped::Failed(super::factor::out_of_memory("Cholesky factorization")))?;
            Ok(Scratch { place, runs: vec![], product, stack })
        };
        let body = |scratch: &mut Scratch, t: usize, wait: WaitFor| {
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

    fn factorize_task(
        &self,
        (t, entries): (usize, &[f64]),
        own: &mut [f64],
        parts: &[Part],
        (scratch, wait): (&mut Scratch, &WaitFor),
    ) -> std::result::Result<(), Stopped> {
        let (panels, begin) = (self.panels, self.panels.values(t).start);
        own.fill(0.0);
        for &[entry, at] in panels.entries(t) {
            own[at as usize] += entries[entry as usize];
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
    fn of_panel<'b>(&self, d: usize, values: &'b [f64]) -> &'b [f64] {
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
    fn take_from(
        &self,
        panel: &Panel,
        target: &mut [f64],
        (d, values): (usize, &[f64]),
        (update, scratch): (&Update, &mut Scratch),
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
            matmul(made, Accum::Replace, left.subrows(at, tall), right, 1.0, Par::Seq);
            find_runs(&rows[at..at + tall], place, runs);
            for (column, product) in rows[..count].iter().zip(product.chunks_exact(tall)) {
                let target = &mut target[(column - panel.first) * panel.rows + panel.inside..][..panel.height()];
                let mut rest = product;
                for [first, count] in runs.iter() {
                    let (own, others) = rest.split_at(*count as usize);
                    rest = others;
                    let target = &mut target[*first as usize..][..own.len()];
                    target.iter_mut().zip(own).for_each(|(entry, value)| *entry -= value);
                }
            }
            at += tall;
        }
    }

    /// X ← A⁻¹X for one column after another, which are permuted already.
    pub fn solve(&self, values: &[f64], x: &mut [f64], room: &mut SumRoom) {
        self.solve_up(values, x, room);
        self.solve_down(values, x);
    }

    /// Room for [`Self::solve`].
    pub fn sum_room(&self) -> Result<SumRoom> {
        let sums = (0..self.panels.n_tasks()).map(|t| self.n_below(t)).sum();
        Ok(SumRoom(try_zeroed("a triangular solve", sums)?))
    }

    /// Rows beyond a task's own.
    fn below(&self, t: usize) -> (usize, &[usize]) {
        let last = self.panels.panels[self.panels.of_task(t).end - 1];
        let own = last.own(self.columns(last.supernode)) - last.width;
        (own, pattern(self.structure, last.supernode))
    }

    fn n_below(&self, t: usize) -> usize {
        let (own, pattern) = self.below(t);
        own + pattern.len()
    }

    fn nanoseconds(&self) -> u64 {
        (self.structure.len_val() as f64 / READ) as u64
    }

    /// x ← L⁻¹x.
    fn solve_up(&self, values: &[f64], x: &mut [f64], room: &mut SumRoom) {
        let (panels, arch) = (self.panels, Arch::new());
        let own = parts(panels.n_tasks(), x, |t| panels.columns(t).len());
        let sums = parts(panels.n_tasks(), &mut room.0, |t| self.n_below(t));
        let make = || Ok::<_, ()>((vec![0_u32; self.structure.nrows()], vec![0.0; self.tallest()]));
        let body = |(place, product): &mut (Vec<u32>, Vec<f64>), t: usize, _: WaitFor| {
            let (x, sum) = (own[t].take(), sums[t].take());
            let columns = panels.columns(t);
            sum.fill(0.0);
            let last = panels.panels[panels.of_task(t).end - 1].first + panels.panels[panels.of_task(t).end - 1].width;
            let (beside, pattern) = self.below(t);
            (0..beside).for_each(|r| place[last + r] = r as u32);
            pattern.iter().enumerate().for_each(|(r, row)| place[*row] = (beside + r) as u32);
            let add = |x: &mut [f64], sum: &mut [f64], row: usize, value: f64| match columns.contains(&row) {
                true => x[row - columns.start] += value,
                false => sum[place[row] as usize] += value,
            };
            for &child in panels.children(t) {
                let given = sums[child as usize].done();
                let (beside, pattern) = self.below(child as usize);
                let first = panels.columns(child as usize).end;
                let rows = (first..first + beside).chain(pattern.iter().copied());
                rows.zip(given).for_each(|(row, value)| add(x, sum, row, *value));
            }
            for k in panels.of_task(t) {
                let panel = panels.panels[k];
                let at = panel.first - columns.start;
                let product = &mut product[..panel.height() - panel.width];
                let lower = Lower::of(&panel, values);
                arch.dispatch(SolveUp { lower, x: &mut x[at..at + panel.width], product });
                let first = panel.first + panel.width;
                let beside = panel.own(self.columns(panel.supernode)) - panel.width;
                let rows = (first..first + beside).chain(self.pattern_of(&panel).iter().copied());
                rows.zip(product).for_each(|(row, value)| add(x, sum, row, -*value));
            }
            own[t].publish(x);
            sums[t].publish(sum);
            Ok(())
        };
        let never = panels.up.run(self.nanoseconds(), make, body);
        debug_assert!(never.is_ok());
    }

    fn pattern_of(&self, panel: &Panel) -> &[usize] {
        pattern(self.structure, panel.supernode)
    }

    /// Rows of a panel, at most.
    fn tallest(&self) -> usize {
        self.panels.panels.iter().map(|panel| panel.rows).max().unwrap_or(0)
    }

    /// x ← L⁻ᵀx.
    fn solve_down(&self, values: &[f64], x: &mut [f64]) {
        let (panels, arch) = (self.panels, Arch::new());
        let n = panels.n_tasks();
        let own = parts(n, x, |t| panels.columns(t).len());
        let make = || Ok::<_, ()>(vec![0.0; self.tallest()]);
        let body = |below: &mut Vec<f64>, turned: usize, _: WaitFor| {
            let t = n - 1 - turned;
            let x = own[t].take();
            let columns = panels.columns(t);
            for k in panels.of_task(t).rev() {
                let panel = panels.panels[k];
                let first = panel.first + panel.width;
                let beside = panel.own(self.columns(panel.supernode)) - panel.width;
                let rows = (first..first + beside).chain(self.pattern_of(&panel).iter().copied());
                let mut at = (usize::MAX, &[][..], 0);
                let below = &mut below[..panel.height() - panel.width];
                for (value, row) in below.iter_mut().zip(rows) {
                    *value = if columns.contains(&row) {
                        x[row - columns.start]
                    } else {
                        let task = panels.task_of[panels.panel_of[row] as usize] as usize;
                        if at.0 != task {
                            at = (task, own[task].done(), panels.columns(task).start);
                        }
                        at.1[row - at.2]
                    };
                }
                let at = panel.first - columns.start;
                let lower = Lower::of(&panel, values);
                arch.dispatch(SolveDown { lower, x: &mut x[at..at + panel.width], below });
            }
            own[t].publish(x);
            Ok(())
        };
        let never = panels.down.run(self.nanoseconds(), make, body);
        debug_assert!(never.is_ok());
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
fn take_beside(panel: &Panel, target: &mut [f64], (earlier, values): (&Panel, &[f64])) {
    let left = view(earlier, values).subrows(panel.inside - earlier.inside, panel.height());
    let right = left.subrows(0, panel.width).transpose();
    let target = MatMut::from_column_major_slice_mut(target, panel.rows, panel.width);
    matmul(target.subrows_mut(panel.inside, panel.height()), Accum::Add, left, right, -1.0, Par::Seq);
}

/// Factorizes a panel that has taken all.
fn finish(panel: &Panel, target: &mut [f64], stack: &mut MemBuffer) -> std::result::Result<(), Stopped> {
    let target = MatMut::from_column_major_slice_mut(target, panel.rows, panel.width);
    let own = target.subrows_mut(panel.inside, panel.height());
    let (mut top, mut below) = own.split_at_row_mut(panel.width);
    let (none, stack) = (Default::default(), MemStack::new(stack));
    cholesky_in_place(top.as_mut(), none, Par::Seq, stack, Default::default()).map_err(|_| Stopped::NotPositive)?;
    solve_lower_triangular_in_place(top.as_ref(), below.as_mut().transpose_mut(), Par::Seq);
    Ok(())
}
