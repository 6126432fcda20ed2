//! Sparse factorizations over one symbolic analysis: Cholesky to solve with, LBLᵀ to count negative eigenvalues with.

use super::branches::Branches;
use super::columns::Scalar;
use super::ordering::{minimum_degree, nested_dissection};
use super::panels::Panels;
use crate::{Error, ErrorKind, Result, Vec3};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::perm::PermRef;
use faer::prelude::Reborrow;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
    supernodal::{SupernodalIntranodeLbltRef, SymbolicSupernodalCholesky},
};
use faer::sparse::linalg::{SupernodalThreshold, SymbolicSupernodalParams};
use faer::sparse::{SparseColMat, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

/// One thread: results must not depend on the number of threads. Large factors have several by [`Branches`].
const PAR: Par = Par::Seq;

/// From this many multiplications on a factor is made in panels, whose order does not depend on threads: some milliseconds of one.
const BRANCHED: f64 = 3e7;

pub(super) fn out_of_memory(what: &str) -> Error {
    Error::new(ErrorKind::OutOfMemory, format!("not enough memory for the {what}"))
}

/// Supernodes of up to so many columns that are joined, in panels, where this part of the joint one is zeros, at most: products of wide ones cost less than
/// what is taken from many narrow ones. Three columns are a vertex.
const JOINED: [(usize, f64); 4] = [(12, 1.0), (48, 0.3), (96, 0.1), (usize::MAX, 0.05)];

/// Whether factors in single precision are built in. Their kernels are a third of a megabyte, and pages that load the module have no large shells.
const SINGLE: bool = !cfg!(target_family = "wasm");

/// From this many vertices on nested dissection is tried too; below it takes longer than it saves.
const DISSECTED: usize = 5_000;

/// Fill-reducing ordering (approximate minimum degree, or nested dissection where that is less work) and elimination structure of
/// a lower-triangular pattern.
pub struct Symbolic {
    inner: SymbolicCholesky<usize>,
    /// Of a large one.
    panels: Option<Panels>,
}

impl Symbolic {
    /// Analyses a pattern of 3 × 3 blocks, each of which lies at one of the `points`.
    pub fn analyse(lower: SymbolicSparseColMatRef<'_, usize>, points: &[Vec3]) -> Result<Self> {
        let mut order = minimum_degree::<3>(lower)?;
        let mut best = Self::ordered::<3>(lower, &order)?;
        if points.len() >= DISSECTED {
            let other = nested_dissection(lower, points)?;
            let dissected = Self::ordered::<3>(lower, &other)?;
            if dissected.operations() < best.operations() {
                (best, order) = (dissected, other);
            }
        }
        if best.operations() >= BRANCHED {
            let joined = SymbolicSupernodalParams { relax: Some(&JOINED) };
            best = Self::in_form::<3>(lower, &order, (SupernodalThreshold::FORCE_SUPERNODAL, joined))?;
            if let Some(order) = best.inner.perm() {
                best.panels = Panels::new(best.structure(), lower, order)?;
            }
        }
        Ok(best)
    }

    /// Analyses a pattern of single entries. Its factors are made column by column, in plain sums: their bits are the same on every
    /// processor. They solve; operations and negative eigenvalues are not counted.
    pub fn analyse_scalar(lower: SymbolicSparseColMatRef<'_, usize>) -> Result<Self> {
        let plain = (SupernodalThreshold::FORCE_SIMPLICIAL, SymbolicSupernodalParams::default());
        Self::in_form::<1>(lower, &minimum_degree::<1>(lower)?, plain)
    }

    /// With the blocks of N × N in this order. Always supernodal, because only that form pivots and so gives a reliable inertia.
    fn ordered<const N: usize>(lower: SymbolicSparseColMatRef<'_, usize>, order: &[u32]) -> Result<Self> {
        Self::in_form::<N>(lower, order, (SupernodalThreshold::FORCE_SUPERNODAL, SymbolicSupernodalParams::default()))
    }

    fn in_form<const N: usize>(
        lower: SymbolicSparseColMatRef<'_, usize>,
        order: &[u32],
        (supernodal_flop_ratio_threshold, supernodal_params): (SupernodalThreshold, SymbolicSupernodalParams),
    ) -> Result<Self> {
        let forward: Vec<usize> = order.iter().flat_map(|&k| (0..N).map(move |c| N * k as usize + c)).collect();
        let mut inverse = crate::error::try_zeroed("the fill-reducing order", forward.len())?;
        forward.iter().enumerate().for_each(|(k, &i)| inverse[i] = k);
        let order = SymmetricOrdering::Custom(PermRef::new_checked(&forward, &inverse, forward.len()));
        let params =
            CholeskySymbolicParams { supernodal_flop_ratio_threshold, supernodal_params, ..Default::default() };
        let inner = factorize_symbolic_cholesky(lower, Side::Lower, order, params)
            .map_err(|_| out_of_memory("symbolic factorization"))?;
        Ok(Self { inner, panels: None })
    }

    fn structure(&self) -> &SymbolicSupernodalCholesky<usize> {
        let SymbolicCholeskyRaw::Supernodal(structure) = self.inner.raw() else {
            unreachable!("an analysis of blocks is supernodal");
        };
        structure
    }

    fn branches(&self) -> Option<Branches<'_>> {
        self.panels.as_ref().map(|panels| Branches { structure: self.structure(), panels })
    }

    /// Bytes of what a large factor is made by.
    pub fn bytes(&self) -> usize {
        self.panels.as_ref().map_or(0, Panels::bytes)
    }

    /// Multiplications of a factorization: the squares of the numbers of entries of the factor's columns.
    pub fn operations(&self) -> f64 {
        if self.inner.nrows() == 0 {
            return 0.0; // an analysis of nothing has no supernodes
        }
        let structure = self.structure();
        let rows = structure.col_ptr_for_row_idx();
        (0..structure.n_supernodes())
            .map(|s| {
                let columns = structure.supernode_end()[s] - structure.supernode_begin()[s];
                let below = rows[s + 1] - rows[s];
                (below + 1..=below + columns).map(|entries| (entries as f64).powi(2)).sum::<f64>()
            })
            .sum()
    }

    /// Bytes of the values of one factor.
    pub fn factor_bytes(&self) -> usize {
        self.inner.len_val() * size_of::<f64>()
    }

    /// A = LLᵀ, or `None` when A is not numerically positive definite.
    pub fn cholesky(&self, lower: &SparseColMat<usize, f64>) -> Result<Option<Cholesky<'_>>> {
        let mut factor = self.factor()?;
        Ok(if self.refactorize(lower, &mut factor)? { Some(Cholesky { symbolic: self, factor }) } else { None })
    }

    /// Room for the values of a factor.
    pub fn factor(&self) -> Result<Factor> {
        Ok(Factor { values: crate::error::try_zeroed("a factor of the stiffness", self.inner.len_val())? })
    }

    /// A = LLᵀ into `factor`, whose values mean nothing when the answer is no: A is not numerically positive definite.
    pub fn refactorize(&self, lower: &SparseColMat<usize, f64>, factor: &mut Factor) -> Result<bool> {
        if let Some(branches) = self.branches() {
            return branches.factorize(lower.val(), &mut factor.values, self.operations());
        }
        let scratch = self.inner.factorize_numeric_llt_scratch::<f64>(PAR, Default::default());
        let mut buffer = MemBuffer::try_new(scratch).map_err(|_| out_of_memory("Cholesky factorization"))?;
        let stack = MemStack::new(&mut buffer);
        let (side, none) = (Side::Lower, Default::default());
        let values = &mut factor.values;
        Ok(self.inner.factorize_numeric_llt(values, lower.rb(), side, none, PAR, stack, Default::default()).is_ok())
    }

    /// Room for a factor in single precision, to precondition with; none where there is no memory for it, in a WebAssembly module, or of a small one,
    /// which gains little.
    pub fn single_factor(&self) -> Option<Factor<f32>> {
        if !SINGLE {
            return None;
        }
        self.panels.as_ref()?;
        let values = crate::error::try_zeroed("a factor of the stiffness", self.inner.len_val());
        Some(Factor { values: values.ok()? })
    }

    /// As [`Symbolic::refactorize`] in single precision; the answer is no, too, where A is not positive definite to its digits.
    pub fn refactorize_single(&self, lower: &SparseColMat<usize, f64>, factor: &mut Factor<f32>) -> Result<bool> {
        match self.branches() {
            Some(branches) if SINGLE => branches.factorize(lower.val(), &mut factor.values, self.operations()),
            _ => Ok(false),
        }
    }

    /// X ← A⁻¹X for all columns at once, with A's factor.
    pub fn solve_in_place(&self, factor: &Factor, x: MatMut<'_, f64>) -> Result<()> {
        let mut room = self.solving_room(x.ncols())?;
        self.solve_in_room(factor, x, &mut room);
        Ok(())
    }

    /// Room for solutions of so many columns.
    pub fn solving_room(&self, columns: usize) -> Result<SolvingRoom> {
        if let Some(branches) = self.branches().filter(|_| columns == 1) {
            return Ok(SolvingRoom::Branched(branches.solving_room()?));
        }
        let scratch = self.inner.solve_in_place_scratch::<f64>(columns, PAR);
        MemBuffer::try_new(scratch).map(SolvingRoom::Whole).map_err(|_| out_of_memory("triangular solve"))
    }

    /// As [`Symbolic::solve_in_place`], without allocating where the factor is small.
    pub fn solve_in_room(&self, factor: &Factor, x: MatMut<'_, f64>, room: &mut SolvingRoom) {
        match room {
            SolvingRoom::Branched(..) => self.solve_branched(&factor.values, x, room),
            SolvingRoom::Whole(room) => {
                let factor = LltRef::new(&self.inner, &factor.values);
                factor.solve_in_place_with_conj(Conj::No, x, PAR, MemStack::new(room));
            }
        }
    }

    /// The same with a factor in single precision; sums are in double.
    pub fn solve_single_in_room(&self, factor: &Factor<f32>, x: MatMut<'_, f64>, room: &mut SolvingRoom) {
        if SINGLE {
            self.solve_branched(&factor.values, x, room);
        }
    }

    fn solve_branched<T: Scalar>(&self, values: &[T], x: MatMut<'_, f64>, room: &mut SolvingRoom) {
        match (room, self.branches(), self.inner.perm()) {
            (SolvingRoom::Branched(room), Some(branches), Some(order)) => branches.solve(values, x, order, room),
            _ => unreachable!("the room is of this analysis"),
        }
    }

    /// The number of negative eigenvalues of A by Sylvester's law of inertia: A = LBLᵀ with Bunch–Kaufman pivoting inside
    /// supernodes. `None` when a pivot is zero or not finite, so that the sign is undecided.
    pub fn negative_eigenvalues(&self, lower: &SparseColMat<usize, f64>) -> Result<Option<usize>> {
        self.negative_eigenvalues_in(lower, &mut self.factor()?)
    }

    /// The same with L in `room`, whose values mean nothing after that.
    pub fn negative_eigenvalues_in(
        &self,
        lower: &SparseColMat<usize, f64>,
        room: &mut Factor,
    ) -> Result<Option<usize>> {
        let n = self.inner.nrows();
        let values = &mut room.values;
        let mut subdiagonal = vec![0.0; n];
        let (mut forward, mut inverse) = (vec![0; n], vec![0; n]);
        let scratch = self.inner.factorize_numeric_intranode_lblt_scratch::<f64>(PAR, Default::default());
        let mut buffer = MemBuffer::try_new(scratch).map_err(|_| out_of_memory("LBLᵀ factorization"))?;
        self.inner.factorize_numeric_intranode_lblt(
            values,
            &mut subdiagonal,
            &mut forward,
            &mut inverse,
            lower.rb(),
            Side::Lower,
            PAR,
            MemStack::new(&mut buffer),
            Default::default(),
        );
        let structure = self.structure();
        let perm = faer::perm::PermRef::new_checked(&forward, &inverse, n);
        let factor = SupernodalIntranodeLbltRef::new(structure, values, &subdiagonal, perm);
        let mut negative = 0;
        for s in 0..structure.n_supernodes() {
            let (node, start) = (factor.supernode(s), structure.supernode_begin()[s]);
            let block = node.val();
            let Some(count) = negative_pivots(block.ncols(), |j| block[(j, j)], |j| subdiagonal[start + j]) else {
                return Ok(None);
            };
            negative += count;
        }
        Ok(Some(negative))
    }
}

/// Negative eigenvalues of the block diagonal B of 1 × 1 and 2 × 2 pivots.
fn negative_pivots(n: usize, diagonal: impl Fn(usize) -> f64, below: impl Fn(usize) -> f64) -> Option<usize> {
    let mut negative = 0;
    let mut j = 0;
    while j < n {
        if below(j) == 0.0 {
            let d = diagonal(j);
            if !(d.is_finite() && d != 0.0) {
                return None;
            }
            negative += usize::from(d < 0.0);
            j += 1;
        } else {
            let (a, b, c) = (diagonal(j), below(j), diagonal(j + 1));
            let determinant = (a / b) * (c / b) - 1.0;
            if !(determinant.is_finite() && determinant != 0.0) {
                return None;
            }
            negative += if determinant < 0.0 { 1 } else { 2 * usize::from(a + c < 0.0) };
            j += 2;
        }
    }
    Some(negative)
}

/// Scratch of solutions.
pub enum SolvingRoom {
    /// Of a small factor, or of several columns.
    Whole(MemBuffer),
    /// Of a large one.
    Branched(Vec<f64>),
}

/// The values of a Cholesky factor, to be filled again and again.
pub struct Factor<T = f64> {
    values: Vec<T>,
}

impl Clone for Factor {
    fn clone(&self) -> Self {
        Self { values: self.values.clone() }
    }

    /// Into the memory that is there.
    fn clone_from(&mut self, other: &Self) {
        self.values.clone_from(&other.values);
    }
}

/// A numeric Cholesky factor with its analysis.
pub struct Cholesky<'a> {
    symbolic: &'a Symbolic,
    factor: Factor,
}

impl Cholesky<'_> {
    /// X ← A⁻¹X for all columns at once.
    pub fn solve_in_place(&self, x: MatMut<'_, f64>) -> Result<()> {
        self.symbolic.solve_in_place(&self.factor, x)
    }
}
