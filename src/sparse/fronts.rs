//! Solutions by a large factor, on several threads.
//!
//! Each task has a front: its own rows, and those below that its columns reach. Up the tree it hands sums for these to the front above, which adds
//! what it is given in order; down the tree it takes from there what was solved for. So the bits are the same on any number of threads.

use super::branches::{Branches, parts};
use super::columns::{Lower, Scalar, SolveDown, SolveUp};
use super::panels::{NONE, Panel, Panels, pattern};
use crate::Result;
use crate::error::try_zeroed;
use crate::threads::WaitFor;
use faer::MatMut;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use pulp::Arch;
use std::ops::Range;

/// Entries of a factor read in a nanosecond.
const READ: f64 = 1.0;

/// Where rows are in fronts.
#[derive(Default)]
pub struct Fronts {
    /// The fronts among all of them: `start[t]..start[t + 1]`.
    start: Vec<usize>,
    /// Of each panel, where the rows below it are in its task's front: `panel_start[k]..panel_start[k + 1]`.
    panel_start: Vec<usize>,
    in_front: Vec<u32>,
    /// Of each task, where the rows below it are in the front above: `task_start[t]..task_start[t + 1]`.
    task_start: Vec<usize>,
    in_above: Vec<u32>,
}

/// The rows of a front: some after one another, then others.
struct Rows<'a> {
    first: usize,
    end: usize,
    others: &'a [usize],
}

impl Rows<'_> {
    fn count(&self) -> usize {
        self.end - self.first + self.others.len()
    }

    fn place(&self, row: usize) -> u32 {
        let place = match row < self.end {
            true => row - self.first,
            false => self.end - self.first + self.others.partition_point(|other| *other < row),
        };
        place as u32
    }

    /// But for so many first ones.
    fn below(&self, own: usize) -> impl Iterator<Item = usize> {
        (self.first + own..self.end).chain(self.others.iter().copied())
    }
}

/// A panel's rows, from its own first one on.
fn rows_of<'a>(structure: &'a SymbolicSupernodalCholesky<usize>, panel: &Panel) -> Rows<'a> {
    let s = panel.supernode;
    Rows { first: panel.first, end: structure.supernode_end()[s], others: pattern(structure, s) }
}

impl Fronts {
    pub fn new(structure: &SymbolicSupernodalCholesky<usize>, panels: &Panels) -> Self {
        let front = |t: usize| {
            let last = &panels.panels[panels.of_task(t).end - 1];
            Rows { first: panels.columns(t).start, ..rows_of(structure, last) }
        };
        let n_tasks = panels.n_tasks();
        let mut fronts = Self::default();
        for t in 0..n_tasks {
            fronts.start.push(fronts.start.last().map_or(0, |start| start + front(t - 1).count()));
            let (own, columns) = (front(t), panels.columns(t).len());
            fronts.task_start.push(fronts.in_above.len());
            if let Some(above) = Some(panels.above[t]).filter(|above| *above != NONE) {
                let above = front(panels.task_of[above as usize] as usize);
                fronts.in_above.extend(own.below(columns).map(|row| above.place(row)));
            }
            for panel in &panels.panels[panels.of_task(t)] {
                fronts.panel_start.push(fronts.in_front.len());
                fronts.in_front.extend(rows_of(structure, panel).below(panel.width).map(|row| own.place(row)));
            }
        }
        let all = n_tasks.checked_sub(1).map_or(0, |last| fronts.start[last] + front(last).count());
        fronts.start.push(all);
        fronts.task_start.push(fronts.in_above.len());
        fronts.panel_start.push(fronts.in_front.len());
        fronts
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        8 * (self.start.len() + self.panel_start.len() + self.task_start.len())
            + 4 * (self.in_front.len() + self.in_above.len())
    }

    /// Numbers in all of them.
    fn count(&self) -> usize {
        self.start.last().copied().unwrap_or(0)
    }

    fn len(&self, t: usize) -> usize {
        self.start[t + 1] - self.start[t]
    }

    fn of_panel(&self, k: usize) -> &[u32] {
        &self.in_front[self.panel_start[k]..self.panel_start[k + 1]]
    }

    fn of_task(&self, t: usize) -> &[u32] {
        &self.in_above[self.task_start[t]..self.task_start[t + 1]]
    }
}

impl Branches<'_> {
    /// Room for [`Self::solve`].
    pub fn solving_room(&self) -> Result<Vec<f64>> {
        try_zeroed("a triangular solve", self.panels.fronts.count())
    }

    /// x ← A⁻¹x by a factor of A in this order.
    pub fn solve<T: Scalar>(&self, values: &[T], mut x: MatMut<'_, f64>, order: PermRef<'_, usize>, room: &mut [f64]) {
        let forward = order.arrays().0;
        let (panels, fronts) = (self.panels, &self.panels.fronts);
        for t in 0..panels.n_tasks() {
            let front = &mut room[fronts.start[t]..fronts.start[t + 1]];
            let (own, below) = front.split_at_mut(panels.columns(t).len());
            own.iter_mut().zip(&forward[panels.columns(t)]).for_each(|(x_k, i)| *x_k = x[(*i, 0)]);
            below.fill(0.0);
        }
        self.solve_up(values, room);
        self.solve_down(values, room);
        for t in 0..panels.n_tasks() {
            let own = room[fronts.start[t]..].iter().zip(&forward[panels.columns(t)]);
            own.for_each(|(x_k, i)| x[(*i, 0)] = *x_k);
        }
    }

    /// x ← L⁻¹x.
    fn solve_up<T: Scalar>(&self, values: &[T], room: &mut [f64]) {
        let (panels, fronts, arch) = (self.panels, &self.panels.fronts, Arch::new());
        let parts = parts(panels.n_tasks(), room, |t| fronts.len(t));
        let body = |rows: &mut Vec<f64>, t: usize, _: WaitFor| {
            let front = parts[t].take();
            for &child in panels.children(t) {
                let child = child as usize;
                let given = &parts[child].done()[panels.columns(child).len()..];
                fronts.of_task(child).iter().zip(given).for_each(|(place, value)| front[*place as usize] += value);
            }
            for k in panels.of_task(t) {
                let (panel, own, rows) = self.panel_in_front(k, t, rows);
                rows[..own.len()].copy_from_slice(&front[own.clone()]);
                rows[own.len()..].fill(0.0);
                arch.dispatch(SolveUp { lower: Lower::of(panel, values), rows: &mut *rows });
                let (solved, given) = rows.split_at(own.len());
                front[own].copy_from_slice(solved);
                fronts.of_panel(k).iter().zip(given).for_each(|(place, value)| front[*place as usize] += value);
            }
            parts[t].publish(front);
            Ok(())
        };
        let never = panels.up.run(self.nanoseconds(), || Ok::<_, ()>(vec![0.0; self.tallest()]), body);
        debug_assert!(never.is_ok());
    }

    /// x ← L⁻ᵀx.
    fn solve_down<T: Scalar>(&self, values: &[T], room: &mut [f64]) {
        let (panels, fronts, arch) = (self.panels, &self.panels.fronts, Arch::new());
        let n = panels.n_tasks();
        let parts = parts(n, room, |t| fronts.len(t));
        let body = |rows: &mut Vec<f64>, turned: usize, _: WaitFor| {
            let t = n - 1 - turned;
            let front = parts[t].take();
            if let Some(above) = Some(panels.above[t]).filter(|above| *above != NONE) {
                let above = parts[panels.task_of[above as usize] as usize].done();
                let below = &mut front[panels.columns(t).len()..];
                below.iter_mut().zip(fronts.of_task(t)).for_each(|(value, place)| *value = above[*place as usize]);
            }
            for k in panels.of_task(t).rev() {
                let (panel, own, rows) = self.panel_in_front(k, t, rows);
                let (solved, below) = rows.split_at_mut(own.len());
                solved.copy_from_slice(&front[own.clone()]);
                below.iter_mut().zip(fronts.of_panel(k)).for_each(|(value, place)| *value = front[*place as usize]);
                arch.dispatch(SolveDown { lower: Lower::of(panel, values), rows: &mut *rows });
                front[own.clone()].copy_from_slice(&rows[..own.len()]);
            }
            parts[t].publish(front);
            Ok(())
        };
        let never = panels.down.run(self.nanoseconds(), || Ok::<_, ()>(vec![0.0; self.tallest()]), body);
        debug_assert!(never.is_ok());
    }

    /// A panel, where its columns are in its task's front, and room for its rows.
    fn panel_in_front<'a>(&self, k: usize, t: usize, rows: &'a mut [f64]) -> (&Panel, Range<usize>, &'a mut [f64]) {
        let panel = &self.panels.panels[k];
        let at = panel.first - self.panels.columns(t).start;
        (panel, at..at + panel.width, &mut rows[..panel.height()])
    }

    /// Rows of a panel, at most.
    fn tallest(&self) -> usize {
        self.panels.panels.iter().map(|panel| panel.height()).max().unwrap_or(0)
    }

    fn nanoseconds(&self) -> u64 {
        (self.structure.len_val() as f64 / READ) as u64
    }
}
