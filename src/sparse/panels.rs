//! The columns of a large factor in panels, the panels in tasks, and which task waits for which.
//!
//! Wide supernodes are cut into panels of columns. The panels of a small subtree of the elimination tree are one task, every other panel is one of
//! its own. Subtrees do not meet, so theirs are made at once; what a panel takes from earlier ones it takes in their order, whoever makes it.
//! All of this follows from the pattern alone, and so do the bits of a factor.

use super::fronts::Fronts;
use crate::Result;
use crate::error::try_zeroed;
use crate::threads::{Tasks, lists};
use faer::perm::PermRef;
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use std::ops::Range;

/// Columns of a panel, at most.
const WIDE: usize = 96;

/// A subtree of no more than this part of all multiplications is one task.
const SUBTREE: f64 = 1.0 / 128.0;

/// No panel, no task.
pub const NONE: u32 = u32::MAX;

/// Columns of a supernode.
#[derive(Clone, Copy)]
pub struct Panel {
    /// The first, of all and in its supernode, and how many.
    pub first: usize,
    pub inside: usize,
    pub width: usize,
    pub supernode: usize,
    /// Rows of the supernode, with its own.
    pub rows: usize,
    /// Its values begin there.
    pub values: usize,
}

impl Panel {
    /// Rows from its own first one on.
    pub fn height(&self) -> usize {
        self.rows - self.inside
    }

    /// Those of the supernode's own columns among them.
    pub fn own(&self, columns: usize) -> usize {
        columns - self.inside
    }
}

/// Rows of an earlier supernode that lie in a panel: so many of its pattern from there on.
#[derive(Clone, Copy)]
pub struct Update {
    pub supernode: u32,
    pub from: u32,
    pub count: u32,
}

/// An entry of the matrix, and where in a task's values it goes.
pub type Entry = [u32; 2];

/// See the module's text.
pub struct Panels {
    pub panels: Vec<Panel>,
    /// The panels of each supernode: `of_supernode[s]..of_supernode[s + 1]`.
    pub of_supernode: Vec<u32>,
    /// What each panel takes, by earlier supernode.
    update_start: Vec<u32>,
    updates: Vec<Update>,
    /// The panels of each task: `tasks[t]..tasks[t + 1]`.
    tasks: Vec<u32>,
    /// The task of each panel.
    pub task_of: Vec<u32>,
    /// The panel of each column.
    pub panel_of: Vec<u32>,
    /// The panel whose rows the last one of each task gives to, or none.
    pub above: Vec<u32>,
    /// The tasks that give to each: start and list.
    child_start: Vec<u32>,
    children: Vec<u32>,
    entry_start: Vec<u32>,
    entries: Vec<Entry>,
    /// Of a factorization, of the solution up the tree and down, there by numbers from the last task back.
    pub factor: Tasks,
    pub up: Tasks,
    pub down: Tasks,
    pub fronts: Fronts,
}

impl Panels {
    /// For the factor of this structure, of matrices with the pattern `lower`, permuted; `None` where it is not in the order of a tree.
    pub fn new(
        structure: &SymbolicSupernodalCholesky<usize>,
        lower: SymbolicSparseColMatRef<'_, usize>,
        order: PermRef<'_, usize>,
    ) -> Result<Option<Self>> {
        let (panels, of_supernode) = cut(structure);
        let mut panel_of = try_zeroed::<u32>("the factor's panels", structure.nrows())?;
        for (k, panel) in panels.iter().enumerate() {
            panel_of[panel.first..panel.first + panel.width].fill(k as u32);
        }
        let parents = parents(structure, &panels, &panel_of);
        let (update_start, updates) = updates(structure, panels.len(), &panel_of);
        let work = work(structure, &panels, &update_start, &updates);
        let Some((tasks, task_of)) = grouped(&parents, &work) else { return Ok(None) };
        let n_tasks = tasks.len() - 1;
        let last = |t: usize| tasks[t + 1] as usize - 1;
        let above: Vec<u32> = (0..n_tasks).map(|t| parents[last(t)]).collect();
        let task_above = |t: usize| above.get(t).filter(|p| **p != NONE).map(|p| task_of[*p as usize]);
        let pairs: Vec<[u32; 2]> = (0..n_tasks).filter_map(|t| Some([t as u32, task_above(t)?])).collect();
        let by_above: Vec<[u32; 2]> = pairs.iter().map(|[t, above]| [*above, *t]).collect();
        let (child_start, children) = lists(n_tasks, &by_above);
        let mut task_work = vec![0.0; n_tasks];
        work.iter().zip(&task_of).for_each(|(work, task)| task_work[*task as usize] += work);
        let mut urgency: Vec<u64> = task_work.iter().map(|work| *work as u64 + 1).collect();
        for t in (0..n_tasks).rev() {
            urgency[t] += task_above(t).map_or(0, |above| urgency[above as usize]);
        }
        let turned = |t: u32| n_tasks as u32 - 1 - t;
        let down: Vec<[u32; 2]> = pairs.iter().map(|[t, above]| [turned(*above), turned(*t)]).collect();
        let mut sooner = vec![];
        for &[t, above] in &pairs {
            // Panels of a supernode begin together, and wait for one another where they must. One with others below it in its task is
            // waited for, as those are.
            let mut first = tasks[above as usize] as usize;
            let own = &panels[tasks[t as usize] as usize];
            if own.supernode == panels[first].supernode {
                continue;
            }
            let supernode = panels[first].supernode;
            while first < panels.len() && panels[first].supernode == supernode {
                sooner.push([t, task_of[first]]);
                first = tasks[task_of[first] as usize + 1] as usize;
            }
        }
        let by_size = (0..n_tasks).rev().map(|t| task_work[t] as u64).collect();
        let factor = Tasks::new(n_tasks, &sooner, urgency.clone());
        let up = Tasks::new(n_tasks, &pairs, urgency);
        let down = Tasks::new(n_tasks, &down, by_size);
        let mut made = Self {
            panels,
            of_supernode,
            update_start,
            updates,
            tasks,
            task_of,
            panel_of,
            above,
            child_start,
            children,
            entry_start: vec![],
            entries: vec![],
            factor,
            up,
            down,
            fronts: Fronts::default(),
        };
        made.fronts = Fronts::new(structure, &made);
        Ok(made.place_entries(structure, lower, order)?.then_some(made))
    }

    /// Tasks.
    pub fn n_tasks(&self) -> usize {
        self.tasks.len() - 1
    }

    /// The panels of a task.
    pub fn of_task(&self, t: usize) -> Range<usize> {
        self.tasks[t] as usize..self.tasks[t + 1] as usize
    }

    /// The panels of a supernode.
    pub fn of_supernode(&self, s: usize) -> Range<usize> {
        self.of_supernode[s] as usize..self.of_supernode[s + 1] as usize
    }

    /// The columns of a task.
    pub fn columns(&self, t: usize) -> Range<usize> {
        let (first, last) = (self.panels[self.of_task(t).start], self.panels[self.of_task(t).end - 1]);
        first.first..last.first + last.width
    }

    /// The values of a task.
    pub fn values(&self, t: usize) -> Range<usize> {
        let (first, last) = (self.panels[self.of_task(t).start], self.panels[self.of_task(t).end - 1]);
        first.values..last.values + last.rows * last.width
    }

    /// What a panel takes from earlier supernodes.
    pub fn updates(&self, panel: usize) -> &[Update] {
        &self.updates[self.update_start[panel] as usize..self.update_start[panel + 1] as usize]
    }

    /// The tasks whose rows begin in this one.
    pub fn children(&self, t: usize) -> &[u32] {
        &self.children[self.child_start[t] as usize..self.child_start[t + 1] as usize]
    }

    /// The matrix' entries in a task's columns.
    pub fn entries(&self, t: usize) -> &[Entry] {
        &self.entries[self.entry_start[t] as usize..self.entry_start[t + 1] as usize]
    }

    /// Entries of the matrix.
    pub fn n_entries(&self) -> usize {
        self.entries.len()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let lists = [&self.of_supernode, &self.update_start, &self.tasks, &self.task_of, &self.panel_of, &self.above];
        let more = [&self.child_start, &self.children, &self.entry_start];
        let words: usize = lists.iter().chain(&more).map(|list| list.len()).sum();
        4 * words
            + self.panels.len() * size_of::<Panel>()
            + self.updates.len() * size_of::<Update>()
            + self.entries.len() * size_of::<Entry>()
            + self.factor.bytes()
            + self.up.bytes()
            + self.down.bytes()
            + self.fronts.bytes()
    }

    /// Finds where the matrix' entries go; false where numbers of 32 bits do not do.
    fn place_entries(
        &mut self,
        structure: &SymbolicSupernodalCholesky<usize>,
        lower: SymbolicSparseColMatRef<'_, usize>,
        order: PermRef<'_, usize>,
    ) -> Result<bool> {
        let n_tasks = self.n_tasks();
        let longest = (0..n_tasks).map(|t| self.values(t).len()).max().unwrap_or(0);
        if longest.max(lower.row_idx().len()) >= NONE as usize {
            return Ok(false);
        }
        let place = order.arrays().1;
        let pairs = || {
            (0..lower.ncols()).flat_map(|j| {
                let column = lower.col_ptr()[j]..lower.col_ptr()[j + 1];
                column
                    .map(move |k| (k, place[lower.row_idx()[k]].max(place[j]), place[lower.row_idx()[k]].min(place[j])))
            })
        };
        let mut start = vec![0_u32; n_tasks + 1];
        let task = |j: usize| self.task_of[self.panel_of[j] as usize] as usize;
        pairs().for_each(|(_, _, j)| start[task(j) + 1] += 1);
        (0..n_tasks).for_each(|t| start[t + 1] += start[t]);
        let mut entries = try_zeroed::<Entry>("the factor's panels", lower.row_idx().len())?;
        let mut next = start.clone();
        for (k, i, j) in pairs() {
            let (panel, t) = (self.panels[self.panel_of[j] as usize], task(j));
            let row = row_in(structure, panel.supernode, i);
            let at = panel.values + (j - panel.first) * panel.rows + row - self.values(t).start;
            entries[next[t] as usize] = [k as u32, at as u32];
            next[t] += 1;
        }
        (self.entry_start, self.entries) = (start, entries);
        Ok(true)
    }
}

/// The rows below a supernode's own.
pub fn pattern(structure: &SymbolicSupernodalCholesky<usize>, s: usize) -> &[usize] {
    structure.supernode(s).pattern()
}

/// Where row i is among a supernode's.
fn row_in(structure: &SymbolicSupernodalCholesky<usize>, s: usize, i: usize) -> usize {
    let (begin, end) = (structure.supernode_begin()[s], structure.supernode_end()[s]);
    match i < end {
        true => i - begin,
        false => end - begin + pattern(structure, s).partition_point(|row| *row < i),
    }
}

fn cut(structure: &SymbolicSupernodalCholesky<usize>) -> (Vec<Panel>, Vec<u32>) {
    let (mut panels, mut of_supernode) = (vec![], vec![0]);
    for s in 0..structure.n_supernodes() {
        let (begin, end) = (structure.supernode_begin()[s], structure.supernode_end()[s]);
        let columns = end - begin;
        let rows = columns + pattern(structure, s).len();
        let parts = columns.div_ceil(WIDE);
        for k in 0..parts {
            let [inside, next] = [k, k + 1].map(|k| k * columns / parts);
            let values = structure.col_ptr_for_val()[s] + inside * rows;
            panels.push(Panel { first: begin + inside, inside, width: next - inside, supernode: s, rows, values });
        }
        of_supernode.push(panels.len() as u32);
    }
    (panels, of_supernode)
}

/// The panel in which the rows below each one begin.
fn parents(structure: &SymbolicSupernodalCholesky<usize>, panels: &[Panel], panel_of: &[u32]) -> Vec<u32> {
    let parent = |k: usize| match panels.get(k + 1) {
        Some(next) if next.supernode == panels[k].supernode => k as u32 + 1,
        _ => pattern(structure, panels[k].supernode).first().map_or(NONE, |row| panel_of[*row]),
    };
    (0..panels.len()).map(parent).collect()
}

fn updates(
    structure: &SymbolicSupernodalCholesky<usize>,
    n_panels: usize,
    panel_of: &[u32],
) -> (Vec<u32>, Vec<Update>) {
    let visit = |visit: &mut dyn FnMut(usize, Update)| {
        for s in 0..structure.n_supernodes() {
            let pattern = pattern(structure, s);
            let mut from = 0;
            for run in pattern.chunk_by(|a, b| panel_of[*a] == panel_of[*b]) {
                let update = Update { supernode: s as u32, from: from as u32, count: run.len() as u32 };
                visit(panel_of[run[0]] as usize, update);
                from += run.len();
            }
        }
    };
    let mut start = vec![0_u32; n_panels + 1];
    visit(&mut |panel, _| start[panel + 1] += 1);
    (0..n_panels).for_each(|k| start[k + 1] += start[k]);
    let mut list = vec![Update { supernode: 0, from: 0, count: 0 }; start[n_panels] as usize];
    let mut next = start.clone();
    visit(&mut |panel, update| {
        list[next[panel] as usize] = update;
        next[panel] += 1;
    });
    (start, list)
}

/// Multiplications of each panel.
fn work(
    structure: &SymbolicSupernodalCholesky<usize>,
    panels: &[Panel],
    start: &[u32],
    updates: &[Update],
) -> Vec<f64> {
    let of = |(k, panel): (usize, &Panel)| {
        let own = panel.height() * panel.width * (panel.inside + panel.width / 2);
        let taken = updates[start[k] as usize..start[k + 1] as usize].iter().map(|update| {
            let s = update.supernode as usize;
            let columns = structure.supernode_end()[s] - structure.supernode_begin()[s];
            let rows = pattern(structure, s).len() - update.from as usize;
            columns * rows * update.count as usize
        });
        (own + taken.sum::<usize>()) as f64
    };
    panels.iter().enumerate().map(of).collect()
}

/// The panels of each task, and the task of each panel; `None` where a subtree's panels do not follow one another.
fn grouped(parents: &[u32], work: &[f64]) -> Option<(Vec<u32>, Vec<u32>)> {
    let n = parents.len();
    let (mut below, mut sizes) = (work.to_vec(), vec![1; n]);
    for k in 0..n {
        if let Some(parent) = Some(parents[k] as usize).filter(|p| *p != NONE as usize) {
            below[parent] += below[k];
            sizes[parent] += sizes[k];
        }
    }
    let most = SUBTREE * work.iter().sum::<f64>();
    let (mut starts, mut next) = (vec![], n);
    while next > 0 {
        let root = next - 1;
        let size = if below[root] <= most { sizes[root] } else { 1 };
        let first = next.checked_sub(size)?;
        let inside = |k: &usize| (first..next).contains(&(parents[*k] as usize));
        if !(first..root).all(|k| inside(&k)) {
            return None;
        }
        starts.push(first as u32);
        next = first;
    }
    starts.reverse();
    let mut task_of = vec![0; n];
    starts.push(n as u32);
    for (t, ends) in starts.windows(2).enumerate() {
        task_of[ends[0] as usize..ends[1] as usize].fill(t as u32);
    }
    Some((starts, task_of))
}
