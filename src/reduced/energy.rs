//! The discrete shell's energy in reduced coordinates, E(x̄ + Bq), its gradient Bᵀ∇E and its Hessian BᵀHB, on some of the
//! elements with nonnegative weights. Only the vertices of those elements are ever placed.
//!
//! Fields that hold a bent shape to a thousandth still stretch it a little, and on a thin shell that little costs more than the bend:
//! the minimum of E on few fields bends far too little (membrane locking). So the membrane's strains ε = √(2w) s (a number an element)
//! count by their part along a few *stress fields* S (elements × stresses, SᵀS = I) that equilibria of the shell are known to have, as in
//! mixed methods with assumed stress (Pian 1964):
//!
//!   E_membrane = ½ (1 − α) |Sᵀε|² + ½ α |ε|²,
//!
//! with a share α against motions that no stress field resists, the smaller the less the membrane carries. On samples of weight w, Sᵀε is
//! Σ w S_e ε_e.
//!
//! A shell that is under stress where it rests, by a rest shape or angles of its own, has elements that pull at each other there. Stress stiffens
//! and softens, so that samples must have all of it: the strains ε at rest are among the stress fields, ε = S r, and Sᵀε is r there and changes by what samples
//! say. And samples would not balance, so that E goes without g·q, where g is what they leave at q = 0.
//!
//! Files from before samples were weighed by the modes' rest stiffness add ½ qᵀDq on the modes, what their samples left of it. No model
//! is made with D: where the shell is bent far a constant matrix is not what was left out, and if negative it buckles the shell.

use super::elastic::Scratch;
use super::products;
use crate::arithmetic::Arithmetic;
use crate::energy::{Curvature, Energy, MAX_ELEMENT, Mat3, Yielding};
use crate::{Shell, Vec3};
use nalgebra::{DMatrix, DVector};
use pulp::Arch;
use std::ops::{AddAssign, Range};

/// Of the trace of SᵀS, what keeps it regular where stress fields are alike on samples.
const RIDGE: f64 = 1e-12;

/// See the module's text.
pub struct ReducedEnergy {
    energy: Box<dyn Energy>,
    /// Rest positions of the vertices that the elements touch.
    rest: Vec<Vec3>,
    /// B at them: x, y, z of each vertex in turn, a row of `stride` numbers each.
    rows: Vec<f64>,
    /// Vertices of each element.
    elements: Vec<([u32; MAX_ELEMENT], usize)>,
    /// Those of elements that follow each other on the same vertices, as of a triangle, once; and of each element, where its group's blocks are.
    groups: Vec<([u32; MAX_ELEMENT], usize)>,
    places: Vec<usize>,
    /// How many of them, the first, are the membrane's.
    membrane: usize,
    /// √w S at these, a row of `n_stresses` each (a multiple of [`products::WIDTH`]; none: the plain energy).
    stresses: Vec<f64>,
    n_stresses: usize,
    /// α, 1 without stress fields.
    membrane_share: f64,
    /// Coordinates, and numbers in a row.
    n: usize,
    stride: usize,
    /// D (modes × modes), of files that have one.
    correction: Option<DMatrix<f64>>,
    /// What r has over the samples' Sᵀε at rest, and g; empty where nothing is under stress at rest.
    missing: Vec<f64>,
    pull: Vec<f64>,
    stressed: bool,
    /// The registers that it is evaluated in: the processor's widest unless set, as of [`crate::warp::Basis`].
    pub arch: Arch,
}

/// Room, so that evaluation does not allocate, and what is known of the last q.
#[derive(Clone)]
pub struct Room {
    /// q, padded; no numbers before the first. And how many there were.
    q: Vec<f64>,
    shapes: usize,
    /// Of it: E without D, the vertices, √w ε of each element and its gradient, σ = ∂E/∂(√w ε), and Sᵀε.
    value: f64,
    x: Vec<Vec3>,
    strain: Vec<f64>,
    strain_rows: Vec<[Vec3; MAX_ELEMENT]>,
    stress: Vec<f64>,
    resultants: Vec<f64>,
    gradient: Vec<Vec3>,
    sum: Vec<f64>,
    /// Of each group.
    blocks: Vec<Mat3>,
    /// Bᵀb of the elements' rows b (elements × stride), and ∂(Sᵀε)/∂q (stresses × stride).
    lines: Vec<f64>,
    coupling: Vec<f64>,
    /// H B (as the rows).
    product: Vec<f64>,
    square: Vec<f64>,
}

impl Room {
    /// As if there had been no q.
    pub fn forget(&mut self) {
        self.q.iter_mut().take(1).for_each(|q| *q = f64::NAN);
    }

    /// How many q there were since this was asked last.
    pub fn take_shapes(&mut self) -> usize {
        std::mem::take(&mut self.shapes)
    }
}

impl ReducedEnergy {
    /// On the elements with a weight other than 0 (in the order of the shell's rest rows); `fields` are the columns of B.
    pub fn new(shell: &Shell, fields: &[Vec<Vec3>], weights: &[f64]) -> Self {
        let mut index = vec![u32::MAX; shell.mass.len()];
        let (mut touched, mut elements) = (vec![], vec![]);
        let mut weight = weights.iter();
        shell.energy.visit_rest_rows(&mut |(vertices, _)| {
            if weight.next().is_none_or(|w| *w == 0.0) {
                return;
            }
            let mut own = [0; MAX_ELEMENT];
            for (slot, &v) in own.iter_mut().zip(vertices) {
                if index[v as usize] == u32::MAX {
                    index[v as usize] = touched.len() as u32;
                    touched.push(v as usize);
                }
                *slot = index[v as usize];
            }
            elements.push((own, vertices.len()));
        });
        let membrane = weights[..shell.energy.n_membrane()].iter().filter(|w| **w != 0.0).count();
        let n = fields.len();
        let stride = n.next_multiple_of(products::WIDTH);
        let mut rows = vec![0.0; 3 * touched.len() * stride];
        for (row, (v, c)) in
            rows.chunks_exact_mut(stride).zip(touched.iter().flat_map(|v| (0..3).map(move |c| (*v, c))))
        {
            row.iter_mut().zip(fields).for_each(|(x, field)| *x = field[v][c]);
        }
        let (groups, places) = grouped(&elements);
        Self {
            energy: shell.energy.sampled(weights, &index),
            rest: touched.iter().map(|&v| shell.mesh.positions[v]).collect(),
            rows,
            elements,
            groups,
            places,
            membrane,
            stresses: vec![],
            n_stresses: 0,
            membrane_share: 1.0,
            n,
            stride,
            correction: None,
            missing: vec![],
            pull: vec![],
            stressed: shell.is_stressed(),
            arch: Arithmetic::default().arch(),
        }
    }

    /// Its creases that yield, if any: all of the shell's, whatever else is sampled.
    pub fn yielding(&self) -> Option<&Yielding> {
        self.energy.yielding()
    }

    /// How many these are.
    pub fn n_yielding(&self) -> usize {
        self.energy.yielding().map_or(0, |yielding| yielding.rest_angles().len())
    }

    /// The rest angles of these after they yielded at x̄ + Bq, where any did.
    pub fn yielded(&self, q: &[f64], scratch: &mut Scratch) -> Option<Vec<f64>> {
        let yielding = self.energy.yielding()?;
        let room = scratch.sampled();
        self.place(q, room);
        yielding.yielded(|v| room.x[v as usize])
    }

    /// Sets them. What scratches know of q is to be forgotten then.
    pub fn set_rest_angles(&mut self, angles: &[f64]) {
        if let Some(yielding) = self.energy.yielding_mut() {
            yielding.set_rest_angles(angles);
        }
    }

    /// A copy with rest angles of its own, of an energy with creases that yield.
    pub(super) fn own(&self) -> Option<Self> {
        let energy: Box<dyn Energy> = Box::new(self.energy.yielding()?.clone());
        let (rest, rows, elements, stresses) =
            (self.rest.clone(), self.rows.clone(), self.elements.clone(), self.stresses.clone());
        let (groups, places) = (self.groups.clone(), self.places.clone());
        let (correction, missing, pull) = (self.correction.clone(), self.missing.clone(), self.pull.clone());
        Some(Self { energy, rest, rows, elements, groups, places, stresses, correction, missing, pull, ..*self })
    }

    /// Whether its elements are under stress at q = 0.
    pub fn is_stressed(&self) -> bool {
        self.stressed
    }

    /// Sets r and g, after all that they depend on.
    pub(super) fn balance(&mut self) {
        (self.missing, self.pull) = (vec![], vec![]);
        if !self.stressed {
            return;
        }
        let rest = vec![0.0; self.n];
        if self.n_stresses > 0 {
            let mut scratch = self.scratch();
            let room = scratch.sampled();
            self.place(&rest, room);
            self.missing = self.lacking(&room.strain, &room.resultants);
        }
        let mut pull = rest.clone();
        self.gradient(&rest, &mut self.scratch(), &mut pull);
        self.pull = pull;
    }

    /// r − Sᵀε with S r = ε on the samples, by least squares; nothing where these are too few to tell.
    fn lacking(&self, strain: &[f64], resultants: &[f64]) -> Vec<f64> {
        let rows = DMatrix::from_row_slice(self.membrane, self.n_stresses, &self.stresses);
        let mut normal = rows.tr_mul(&rows);
        let ridge = RIDGE * normal.trace();
        (0..normal.nrows()).for_each(|i| normal[(i, i)] += ridge);
        let right = rows.tr_mul(&DVector::from_column_slice(&strain[..self.membrane]));
        let found = normal.cholesky().map(|factor| factor.solve(&right));
        found.map_or(vec![], |r| r.iter().zip(resultants).map(|(r, sum)| r - sum).collect())
    }

    /// Sets D (modes × modes), which only files from before stress fields have.
    pub(super) fn set_correction(&mut self, correction: DMatrix<f64>) {
        self.correction = Some(correction);
    }

    /// D, of a model whose file has one.
    pub(super) fn correction(&self) -> Option<&DMatrix<f64>> {
        self.correction.as_ref()
    }

    /// Sets S and α. Of S, `of(e)` is the row of the membrane's element that is e-th among the elements here, of weight `weights[e]`.
    pub fn assume<'a>(&mut self, weights: &[f64], of: impl Fn(usize) -> &'a [f64], membrane_share: f64) {
        self.n_stresses = if self.membrane == 0 { 0 } else { of(0).len().next_multiple_of(products::WIDTH) };
        self.membrane_share = if self.n_stresses == 0 { 1.0 } else { membrane_share };
        self.stresses = vec![0.0; self.membrane * self.n_stresses];
        for (e, row) in self.stresses.chunks_exact_mut(self.n_stresses.max(1)).enumerate() {
            row.iter_mut().zip(of(e)).for_each(|(out, s)| *out = weights[e].sqrt() * s);
        }
    }

    /// Elements of the membrane.
    pub fn n_membrane(&self) -> usize {
        self.membrane
    }

    /// Coordinates, and zeros up to a multiple of the widest register's numbers.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Stress fields, and zeros up to a multiple of the widest register's numbers.
    pub fn n_stresses(&self) -> usize {
        self.n_stresses
    }

    /// √w S at an element of the membrane.
    pub fn stress_row(&self, e: usize) -> &[f64] {
        &self.stresses[e * self.n_stresses..(e + 1) * self.n_stresses]
    }

    /// To x̄ + Bq: everything that the scratch knows of a q.
    fn place(&self, q: &[f64], room: &mut Room) {
        if room.q[..self.n] == *q {
            return;
        }
        room.q[..self.n].copy_from_slice(q);
        room.shapes += 1;
        let Room { q, value, x, strain, strain_rows, stress, resultants, .. } = room;
        self.arch.dispatch(products::Place { rows: &self.rows, rest: &self.rest, q, x });
        let mut e = 0;
        self.energy.visit_strains(x, &mut |(_, row), value| {
            strain_rows[e][..row.len()].copy_from_slice(row);
            strain[e] = value;
            e += 1;
        });
        *value = self.resist(strain, stress, resultants);
    }

    /// σ and Sᵀε of strains; returns their energy.
    fn resist(&self, strain: &[f64], stress: &mut [f64], resultants: &mut [f64]) -> f64 {
        let own = self.membrane_share;
        match self.missing.is_empty() {
            true => resultants.fill(0.0),
            false => resultants.copy_from_slice(&self.missing),
        }
        stress.copy_from_slice(strain);
        let stresses = &self.stresses;
        self.arch.dispatch(products::Resist { stresses, strain, stress, resultants, own });
        let missed: f64 = self.missing.iter().zip(&*resultants).map(|(missing, r)| missing * r).sum();
        0.5 * (strain.iter().zip(&*stress).map(|(strain, stress)| strain * stress).sum::<f64>() + (1.0 - own) * missed)
    }

    /// Coordinates.
    pub fn n(&self) -> usize {
        self.n
    }

    /// Elements evaluated.
    pub fn n_elements(&self) -> usize {
        self.elements.len()
    }

    /// What work grows with: elements and numbers of B; of a Hessian, multiplications of blocks with B, of products of B's rows and of stress
    /// fields, and of strains along stress fields.
    pub fn operations(&self) -> [f64; 5] {
        let (stride, stresses) = (self.stride as f64, self.n_stresses as f64);
        let blocks: usize = self.groups.iter().map(|(_, k)| 9 * k * k).sum();
        let squares = (self.rows.len() as f64 / stride + stresses) * stride * stride / 2.0;
        let along = self.membrane as f64 * stresses * stride;
        [self.elements.len() as f64, self.rows.len() as f64, blocks as f64 * stride, squares, along]
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        8 * (self.rows.len() + self.stresses.len()) + size_of::<Vec3>() * self.rest.len() + 150 * self.elements.len()
    }

    /// Room for one evaluation at a time.
    pub fn scratch(&self) -> Scratch {
        self.room(true)
    }

    /// Room for one evaluation at a time of values, gradients and forces, without that for Hessians, which is most of it.
    pub fn placing(&self) -> Scratch {
        self.room(false)
    }

    fn room(&self, hessians: bool) -> Scratch {
        let zeros = vec![Vec3::zeros(); self.rest.len()];
        let of = |count: usize| if hessians { count } else { 0 };
        Scratch::Sampled(Box::new(Room {
            q: (0..self.stride).map(|k| if k < self.n { f64::NAN } else { 0.0 }).collect(),
            shapes: 0,
            value: 0.0,
            x: zeros.clone(),
            strain: vec![0.0; self.elements.len()],
            strain_rows: vec![[Vec3::zeros(); MAX_ELEMENT]; self.elements.len()],
            stress: vec![0.0; self.elements.len()],
            resultants: vec![0.0; self.n_stresses],
            gradient: zeros,
            sum: vec![0.0; self.stride],
            blocks: vec![Mat3::zeros(); of(self.groups.iter().map(|(_, k)| k * k).sum())],
            lines: vec![0.0; of(self.elements.len() * self.stride)],
            coupling: vec![0.0; of(self.n_stresses * self.stride)],
            product: vec![0.0; of(self.rows.len())],
            square: vec![0.0; of(self.stride * self.stride)],
        }))
    }

    /// E(x̄ + Bq).
    pub fn value(&self, q: &[f64], scratch: &mut Scratch) -> f64 {
        let room = scratch.sampled();
        self.place(q, room);
        let corrected = self.correction.as_ref().map_or(0.0, |d| (0..d.nrows()).map(|k| q[k] * along(d, k, q)).sum());
        let pulled: f64 = self.pull.iter().zip(q).map(|(g, q)| g * q).sum();
        room.value + 0.5 * corrected - pulled
    }

    /// Bᵀ∇E at x̄ + Bq.
    pub fn gradient(&self, q: &[f64], scratch: &mut Scratch, out: &mut [f64]) {
        let room = scratch.sampled();
        self.place(q, room);
        let Room { gradient, strain_rows, stress, sum, .. } = room;
        gradient.fill(Vec3::zeros());
        for (((vertices, k), row), stress) in self.elements.iter().zip(&*strain_rows).zip(&*stress) {
            vertices[..*k].iter().zip(row).for_each(|(&v, row)| gradient[v as usize] += *stress * row);
        }
        sum.fill(0.0);
        self.arch.dispatch(products::Project { rows: &self.rows, of: gradient, sum });
        out.copy_from_slice(&sum[..self.n]);
        out.iter_mut().zip(&self.pull).for_each(|(out, g)| *out -= g);
        if let Some(d) = &self.correction {
            (0..d.nrows()).for_each(|k| out[k] += along(d, k, q));
        }
    }

    /// BᵀHB at x̄ + Bq (n × n, both triangles).
    pub fn hessian(&self, q: &[f64], curvature: Curvature, scratch: &mut Scratch, out: &mut DMatrix<f64>) {
        let room = scratch.sampled();
        self.place(q, room);
        let Room { x, blocks, strain_rows, stress, product, square, lines, coupling, .. } = room;
        self.find_curvature((x, stress), curvature, blocks);
        let own = self.membrane_share;
        for (e, (((_, k), row), at)) in self.elements.iter().zip(&*strain_rows).zip(&self.places).enumerate() {
            let share = if e < self.membrane { own } else { 1.0 };
            for (blocks, left) in blocks[*at..at + k * k].chunks_exact_mut(*k).zip(row) {
                let left = share * left;
                blocks.iter_mut().zip(row).for_each(|(block, right)| *block += left * right.transpose());
            }
        }
        square.fill(0.0);
        let Self { rows, stride, groups: elements, .. } = self;
        self.arch.dispatch(products::Multiply { rows, stride: *stride, elements, blocks, out: product });
        self.arch.dispatch(products::AddProducts {
            left: (rows, *stride),
            right: (product, *stride),
            lower: true,
            out: square,
        });
        self.add_coupling(strain_rows, lines, coupling, square);
        self.unpack(square, out);
        if let Some(d) = &self.correction {
            out.view_mut((0, 0), d.shape()).add_assign(d);
        }
    }

    /// Σ σ ∂²ε of each group.
    fn find_curvature(&self, (x, stress): (&[Vec3], &[f64]), curvature: Curvature, blocks: &mut [Mat3]) {
        let (mut groups, mut now, mut at, mut end) = (self.groups.iter(), &[][..], 0, 0);
        self.energy.visit_stress_hessian(x, stress, curvature, &mut |(vertices, element)| {
            if vertices == now {
                return blocks[at..end].iter_mut().zip(element).for_each(|(sum, block)| *sum += block);
            }
            now = groups.next().map_or(&[], |(vertices, k)| &vertices[..*k]);
            (at, end) = (end, end + element.len());
            blocks[at..end].copy_from_slice(element);
        });
    }

    /// Bᵀ(Σ b bᵀ)B with the rows √(2w) ∇s at x̄ + Bq: the viscosity of [`crate::reference`].
    pub fn viscosity(&self, q: &[f64], scratch: &mut Scratch, out: &mut DMatrix<f64>) {
        let room = scratch.sampled();
        self.place(q, room);
        let Room { strain_rows, lines, square, coupling, .. } = room;
        square.fill(0.0);
        self.add_coupling(strain_rows, lines, coupling, square);
        self.project_rows(0..self.elements.len(), strain_rows, lines);
        let own = self.membrane_share.sqrt();
        lines[..self.membrane * self.stride].iter_mut().for_each(|x| *x *= own);
        self.add_square(lines, square);
        self.unpack(square, out);
    }

    /// Bᵀb of some elements' rows b.
    fn project_rows(&self, some: Range<usize>, strain_rows: &[[Vec3; MAX_ELEMENT]], lines: &mut [f64]) {
        let (rows, elements, strain_rows) = (&self.rows, &self.elements[some.clone()], &strain_rows[some]);
        let out = (self.stride, lines);
        self.arch.dispatch(products::ProjectRows { rows, elements, strain_rows, factors: &[], out });
    }

    /// square += LᵀL, lower triangle.
    fn add_square(&self, lines: &[f64], square: &mut [f64]) {
        let lines = (lines, self.stride);
        self.arch.dispatch(products::AddProducts { left: lines, right: lines, lower: true, out: square });
    }

    /// square += (1 − α) CᵀC, with C = ∂(Sᵀε)/∂q.
    fn add_coupling(
        &self,
        strain_rows: &[[Vec3; MAX_ELEMENT]],
        lines: &mut [f64],
        coupling: &mut [f64],
        square: &mut [f64],
    ) {
        if self.n_stresses == 0 {
            return;
        }
        self.project_rows(0..self.membrane, strain_rows, lines);
        coupling.fill(0.0);
        self.arch.dispatch(products::AddProducts {
            left: (&self.stresses, self.n_stresses),
            right: (&lines[..self.membrane * self.stride], self.stride),
            lower: false,
            out: coupling,
        });
        let root = (1.0 - self.membrane_share).sqrt();
        coupling.iter_mut().for_each(|c| *c *= root);
        self.add_square(coupling, square);
    }

    /// Both triangles from the lower one.
    fn unpack(&self, square: &[f64], out: &mut DMatrix<f64>) {
        for i in 0..self.n {
            for j in 0..=i {
                let value = square[i * self.stride + j];
                (out[(i, j)], out[(j, i)]) = (value, value);
            }
        }
    }

    /// Hands Bᵀb of the rest row b of each `wanted` element to `visit`, in order. Of an energy on all elements of the shell.
    pub fn visit_rest_rows(&self, shell: &Shell, wanted: impl Fn(usize) -> bool, mut visit: impl FnMut(&[f64])) {
        let mut sum = vec![0.0; self.stride];
        let mut e = 0;
        shell.energy.visit_rest_rows(&mut |(_, row)| {
            if wanted(e) {
                products::project_row(&self.rows, (&self.elements[e].0, row), &mut sum);
                visit(&sum[..self.n]);
            }
            e += 1;
        });
    }

    /// Of each element at x̄ + Bq.
    pub fn forces<'a>(&'a self, q: &[f64], scratch: &'a mut Scratch) -> Forces<'a> {
        let room = scratch.sampled();
        self.place(q, room);
        Forces { energy: self, room }
    }

    /// A share of the width of what its elements touch.
    pub fn length(&self, share: f64) -> f64 {
        let first = self.rest.first().copied().unwrap_or_default();
        share * self.rest.iter().map(|x| (x - first).norm()).fold(0.0, f64::max)
    }

    /// The furthest that amplitudes move a vertex of the elements along an axis.
    pub fn reach(&self, q: &[f64]) -> f64 {
        self.rows
            .chunks_exact(self.stride)
            .map(|row| row.iter().zip(q).map(|(b, q)| b * q).sum::<f64>().abs())
            .fold(0.0, f64::max)
    }

    /// σ of each element for strains that are given.
    pub fn stress_of(&self, strain: &[f64]) -> Vec<f64> {
        let (mut stress, mut resultants) = (vec![0.0; strain.len()], vec![0.0; self.n_stresses]);
        self.resist(strain, &mut stress, &mut resultants);
        stress
    }

    /// σ of an element for its strain, where Sᵀε is `along` for all.
    pub fn stress_along(&self, e: usize, strain: f64, along: &[f64]) -> f64 {
        if e >= self.membrane || self.n_stresses == 0 {
            return strain;
        }
        let own = self.membrane_share;
        own * strain + (1.0 - own) * products::dot(self.stress_row(e), along)
    }

    /// ∂(Sᵀε)/∂q (stresses × stride) where the last Hessian was.
    pub fn coupling(&self, scratch: &mut Scratch) -> Vec<f64> {
        let root = (1.0 - self.membrane_share).sqrt();
        scratch.sampled().coupling.iter().map(|c| c / root).collect()
    }
}

/// Bᵀ∇E of each element somewhere, and its strain.
pub struct Forces<'a> {
    energy: &'a ReducedEnergy,
    room: &'a Room,
}

impl Forces<'_> {
    /// Writes the force of an element to `out` (n, and zeros up to a multiple of [`products::WIDTH`]); its strain.
    pub fn of(&self, element: usize, out: &mut [f64]) -> f64 {
        let (energy, room, one) = (self.energy, self.room, element..element + 1);
        let (elements, strain_rows) = (&energy.elements[one.clone()], &room.strain_rows[one.clone()]);
        let (rows, out) = (&energy.rows, (out.len(), out));
        energy.arch.dispatch(products::ProjectRows { rows, elements, strain_rows, factors: &room.stress[one], out });
        room.strain[element]
    }

    /// That of all elements (n), and behind it Sᵀε.
    pub fn sum(&self) -> Vec<f64> {
        let Self { energy, room } = self;
        let mut gradient = vec![Vec3::zeros(); energy.rest.len()];
        for (((vertices, k), row), stress) in energy.elements.iter().zip(&room.strain_rows).zip(&room.stress) {
            vertices[..*k].iter().zip(row).for_each(|(&v, row)| gradient[v as usize] += *stress * row);
        }
        let mut sum = vec![0.0; energy.stride];
        energy.arch.dispatch(products::Project { rows: &energy.rows, of: &gradient, sum: &mut sum });
        sum.truncate(energy.n);
        sum.extend(&room.resultants);
        sum
    }
}

/// Runs of elements on the same vertices, and where the blocks of each element's run begin.
fn grouped(elements: &[([u32; MAX_ELEMENT], usize)]) -> (Vec<([u32; MAX_ELEMENT], usize)>, Vec<usize>) {
    let (mut groups, mut places, mut at, mut end) = (vec![], vec![], 0, 0);
    for element in elements {
        if groups.last() != Some(element) {
            groups.push(*element);
            (at, end) = (end, end + element.1 * element.1);
        }
        places.push(at);
    }
    (groups, places)
}

/// (Dq)_k.
fn along(d: &DMatrix<f64>, k: usize, q: &[f64]) -> f64 {
    (0..d.ncols()).map(|j| d[(k, j)] * q[j]).sum()
}
