//! The rigid motion that supports leave to a reduced shell, beside its fields.
//!
//! A vertex is at o + d + R y, y = p + Bq, with p its rest place from the pivot o. A shell that nothing holds slides by d and turns by R about
//! its centre of mass; one that is held at a point or along a row turns about these. The fields are orthogonal to these motions at rest, in M.
//! With rates q̇, v and ω in the axes of the body, each vertex moves by v + R(ω × y + Bq̇), and
//!
//!   T = ½ M v² + ½ ωᵀJω + ω·Hq̇ + ½ q̇ᵀq̇,    J = tr(Y) − Y,  Y = Σ m y yᵀ,   H_k = Σ m y × b_k.
//!
//! All of it follows from Z_k = Σ m y b_kᵀ, which is linear in q, so that a step does not know the mesh.

use super::ReducedShell;
use super::elastic::{Elastic, Scratch};
use super::factor::Factor;
use crate::energy::Curvature;
use crate::reference::FreeMotions;
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use nalgebra::{DMatrix, Matrix3, UnitQuaternion};
use pulp::Arch;

/// Which rigid motions are free, and what inertia they meet at rest.
#[derive(Clone, Debug)]
pub struct Rigid {
    /// o.
    pub pivot: Vec3,
    /// It slides along all axes.
    pub slides: bool,
    /// What it turns about, orthonormal: one or three.
    pub axes: Vec<Vec3>,
    /// J at rest about each of them.
    pub inertia: Vec<f64>,
    /// M.
    pub mass: f64,
    /// Σ m p, Σ m p pᵀ and Σ m p b_kᵀ.
    pub(super) first: Vec3,
    spread: Matrix3<f64>,
    coupling: Vec<Matrix3<f64>>,
    /// Σ m b_k.
    pub(super) weight: Vec<Vec3>,
}

/// Σ a × b of Σ a bᵀ.
pub fn crossed(sum: &Matrix3<f64>) -> Vec3 {
    Vec3::new(sum[(1, 2)] - sum[(2, 1)], sum[(2, 0)] - sum[(0, 2)], sum[(0, 1)] - sum[(1, 0)])
}

/// What a model of so many zero modes can move by beside its fields; none where it is held. Fails for what no frame floats with.
pub fn free_motions(shell: &Shell, zero_modes: usize) -> Result<Option<FreeMotions>> {
    let free = FreeMotions::new(shell, std::iter::empty(), &shell.mesh.positions);
    if zero_modes == 0 {
        return Ok(None);
    }
    let refuse = |message: String| Err(Error::new(ErrorKind::Unsupported, message));
    if !shell.rollers.is_empty() {
        return refuse("a reduced shell that moves freely holds no vertices along some axes only: hold it".into());
    }
    if shell.mesh.n_components > 1 {
        let pieces = shell.mesh.n_components;
        return refuse(format!("a reduced shell that moves freely must be of one piece: this has {pieces}"));
    }
    let rigid = free.count();
    if zero_modes != rigid {
        return refuse(format!(
            "a reduced shell needs all {rigid} rigid motions, and no others, among the modes without stiffness: there are {zero_modes}"
        ));
    }
    if ![1, 3, 6].contains(&rigid) {
        return refuse(format!(
            "a reduced shell turns about an axis or a point, or floats: this has {rigid} free motions"
        ));
    }
    Ok(Some(free))
}

impl Rigid {
    /// Of the shell with `columns` as its fields.
    pub(super) fn new(shell: &Shell, free: &FreeMotions, columns: &[Vec<Vec3>]) -> Result<Self> {
        let (mass, rest) = (&shell.mass, &shell.mesh.positions);
        let slides = free.count() == 6;
        let held = (0..rest.len()).filter(|&v| shell.held[v]);
        let (sum, count) = held.fold((Vec3::zeros(), 0.0), |(sum, n), v| (sum + rest[v], n + 1.0));
        let weighed = (0..rest.len()).fold(Vec3::zeros(), |sum, v| sum + mass[v] * rest[v]);
        let pivot = if slides { weighed / shell.total_mass } else { sum / count };
        let mut first = Vec3::zeros();
        let mut spread = Matrix3::zeros();
        for v in 0..rest.len() {
            let p = rest[v] - pivot;
            first += mass[v] * p;
            spread += mass[v] * p * p.transpose();
        }
        let about = Matrix3::identity() * spread.trace() - spread;
        let axes: Vec<Vec3> = match free.count() {
            1 => free.turns().into_iter().map(|turn| turn.normalize()).collect(),
            _ => about.symmetric_eigen().eigenvectors.column_iter().map(|axis| axis.into_owned()).collect(),
        };
        let inertia: Vec<f64> = axes.iter().map(|axis| axis.dot(&(about * axis))).collect();
        if !inertia.iter().all(|inertia| *inertia > 0.0 && inertia.is_finite()) {
            let message = "a reduced shell that moves freely needs inertia about every axis that it turns about";
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        let coupled = |column: &Vec<Vec3>| {
            let sum = |sum: Matrix3<f64>, v: usize| sum + mass[v] * (rest[v] - pivot) * column[v].transpose();
            (0..rest.len()).fold(Matrix3::zeros(), sum)
        };
        let weight = |column: &Vec<Vec3>| (0..rest.len()).fold(Vec3::zeros(), |sum, v| sum + mass[v] * column[v]);
        let still = |sum: Vec3| if slides { Vec3::zeros() } else { sum };
        Ok(Self {
            pivot,
            slides,
            axes,
            inertia,
            mass: shell.total_mass,
            first: still(first),
            spread,
            coupling: columns.iter().map(coupled).collect(),
            weight: columns.iter().map(|column| still(weight(column))).collect(),
        })
    }

    /// Coordinates of rigid motion.
    pub fn n(&self) -> usize {
        self.axes.len() + if self.slides { 3 } else { 0 }
    }

    /// Coordinates of fields.
    pub fn n_fields(&self) -> usize {
        self.coupling.len()
    }

    /// The small turn that rigid coordinates mean, body axes: they are normed by the inertia at rest.
    pub fn turn(&self, rigid: &[f64]) -> Vec3 {
        let parts = self.axes.iter().zip(&self.inertia).zip(rigid);
        parts.map(|((axis, inertia), z)| axis * (z / inertia.sqrt())).fold(Vec3::zeros(), |sum, turn| sum + turn)
    }

    /// The slide that they mean, body axes.
    pub fn slide(&self, rigid: &[f64]) -> Vec3 {
        if self.slides { Vec3::from_column_slice(&rigid[self.axes.len()..]) / self.mass.sqrt() } else { Vec3::zeros() }
    }

    /// The rigid coordinates of a small turn and a slide, body axes; also of rates.
    pub fn coordinates(&self, turn: &Vec3, slide: &Vec3, out: &mut [f64]) {
        for ((axis, inertia), out) in self.axes.iter().zip(&self.inertia).zip(out.iter_mut()) {
            *out = axis.dot(turn) * inertia.sqrt();
        }
        if self.slides {
            (0..3).for_each(|c| out[self.axes.len() + c] = slide[c] * self.mass.sqrt());
        }
    }

    /// What torque and force, body axes, are along rigid coordinates; adds to `out`.
    pub fn add_force(&self, torque: &Vec3, force: &Vec3, out: &mut [f64]) {
        for ((axis, inertia), out) in self.axes.iter().zip(&self.inertia).zip(out.iter_mut()) {
            *out += axis.dot(torque) / inertia.sqrt();
        }
        if self.slides {
            (0..3).for_each(|c| out[self.axes.len() + c] += force[c] / self.mass.sqrt());
        }
    }

    /// Adds to a mass matrix of all coordinates, times `scale`, what the moments have beside 1 on its diagonal.
    pub fn add_mass(&self, moments: &Moments, scale: f64, out: &mut DMatrix<f64>) {
        let (n, inertia) = (self.n_fields(), moments.inertia());
        for (r, (axis, own)) in self.axes.iter().zip(&self.inertia).enumerate() {
            for k in 0..n {
                let both = scale * axis.dot(&moments.arm(k)) / own.sqrt();
                out[(n + r, k)] += both;
                out[(k, n + r)] += both;
            }
            for (s, (other, its)) in self.axes.iter().zip(&self.inertia).enumerate() {
                let rest = if r == s { 1.0 } else { 0.0 };
                out[(n + r, n + s)] += scale * (axis.dot(&(inertia * other)) / (own * its).sqrt() - rest);
            }
        }
    }

    /// Adds the curvature that forces have as the body turns, by itself and with the fields.
    pub fn add_curvature(&self, curved: &Matrix3<f64>, fields: impl Fn(usize) -> Vec3, out: &mut DMatrix<f64>) {
        let n = self.n_fields();
        for (r, (axis, own)) in self.axes.iter().zip(&self.inertia).enumerate() {
            for k in 0..n {
                let both = axis.dot(&fields(k)) / own.sqrt();
                out[(n + r, k)] += both;
                out[(k, n + r)] += both;
            }
            for (s, (other, its)) in self.axes.iter().zip(&self.inertia).enumerate() {
                out[(n + r, n + s)] += axis.dot(&(curved * other)) / (own * its).sqrt();
            }
        }
    }

    /// The angular acceleration that rigid forces give.
    pub fn relief(&self, moments: &Moments, force: &[f64]) -> Vec3 {
        let torque = self.axes.iter().zip(&self.inertia).zip(force).map(|((axis, own), f)| axis * (f * own.sqrt()));
        let (torque, inertia) = (torque.sum::<Vec3>(), moments.inertia());
        match &self.axes[..] {
            [axis] => axis * (axis.dot(&torque) / axis.dot(&(inertia * axis))),
            _ => inertia.try_inverse().map_or(Vec3::zeros(), |inverse| inverse * torque),
        }
    }

    /// The torque (frame axes) about free axes alone, of a body that is turned.
    pub fn along_turned(&self, turn: &UnitQuaternion<f64>, torque: &Vec3) -> Vec3 {
        if self.axes.len() == 3 { *torque } else { turn * self.along(&(turn.inverse() * torque)) }
    }

    /// The turn about free axes alone.
    pub fn along(&self, turn: &Vec3) -> Vec3 {
        if self.axes.len() == 3 { *turn } else { self.axes[0] * self.axes[0].dot(turn) }
    }
}

/// Sums over the vertices at a shape and its rates, body axes.
#[derive(Clone, Default)]
pub struct Moments {
    /// Z_k = Σ m y b_kᵀ.
    pub fields: Vec<Matrix3<f64>>,
    /// Σ m u̇ b_kᵀ with u̇ = Bq̇.
    pub rates: Vec<Matrix3<f64>>,
    /// Y.
    pub spread: Matrix3<f64>,
    /// Σ m u̇ yᵀ.
    pub stirred: Matrix3<f64>,
    /// Σ m y.
    pub first: Vec3,
    /// Σ m u̇.
    pub first_rate: Vec3,
    /// Hq̇.
    pub carried: Vec3,
}

impl Moments {
    /// Room for so many fields.
    pub fn new(n: usize) -> Self {
        Self { fields: vec![Matrix3::zeros(); n], rates: vec![Matrix3::zeros(); n], ..Self::default() }
    }

    /// J.
    pub fn inertia(&self) -> Matrix3<f64> {
        Matrix3::identity() * self.spread.trace() - self.spread
    }

    /// H_k.
    pub fn arm(&self, k: usize) -> Vec3 {
        crossed(&self.fields[k])
    }

    /// The rate of H_k.
    pub fn swing(&self, k: usize) -> Vec3 {
        crossed(&self.rates[k])
    }

    /// Jω + Hq̇.
    pub fn momentum(&self, spin: &Vec3) -> Vec3 {
        self.inertia() * spin + self.carried
    }

    /// ∂T/∂q_k at ω.
    pub fn thrust(&self, k: usize, spin: &Vec3) -> f64 {
        let fields = &self.fields[k];
        spin.norm_squared() * fields.trace() - spin.dot(&(fields * spin)) - spin.dot(&crossed(&self.rates[k]))
    }
}

impl ReducedShell {
    /// Sets the moments of a shape and its rates.
    pub fn set_moments(&self, rigid: &Rigid, (q, q_dot): (&[f64], &[f64]), out: &mut Moments) {
        let n = q.len();
        let still = q_dot.iter().all(|rate| *rate == 0.0);
        out.fields.copy_from_slice(&rigid.coupling);
        out.rates.fill(Matrix3::zeros());
        for a in 0..3 {
            for b in 0..3 {
                let inertia = &self.inertia[b][a]; // Σ m b_j,a b_k,b at (j, k)
                for k in 0..n {
                    let column = inertia.column(k);
                    out.fields[k][(a, b)] += column.iter().zip(q).map(|(s, q)| s * q).sum::<f64>();
                    if !still {
                        out.rates[k][(a, b)] = column.iter().zip(q_dot).map(|(s, q)| s * q).sum::<f64>();
                    }
                }
            }
        }
        (out.spread, out.stirred) = (rigid.spread, Matrix3::zeros());
        (out.first, out.first_rate, out.carried) = (rigid.first, Vec3::zeros(), Vec3::zeros());
        for k in 0..n {
            out.spread += q[k] * (out.fields[k] + rigid.coupling[k].transpose());
            out.stirred += q_dot[k] * out.fields[k].transpose();
            out.first += q[k] * rigid.weight[k];
            out.first_rate += q_dot[k] * rigid.weight[k];
            out.carried += q_dot[k] * out.arm(k);
        }
        out.spread = 0.5 * (out.spread + out.spread.transpose());
    }
}

/// An energy on fields with rigid coordinates behind them, which it does not know.
#[derive(Clone, Copy)]
pub struct WithRigid<'a> {
    /// On the fields.
    pub energy: &'a dyn Elastic,
    /// How many coordinates of rigid motion.
    pub rigid: usize,
}

/// Room for the energy of fields, and its Hessian.
#[derive(Clone)]
pub struct RigidRoom {
    own: Scratch,
    hessian: DMatrix<f64>,
    near: Factor,
}

impl RigidRoom {
    /// How many q there were since this was asked last.
    pub fn take_shapes(&mut self) -> usize {
        self.own.take_shapes()
    }

    /// That of the energy on fields.
    pub fn own(&mut self) -> &mut Scratch {
        &mut self.own
    }
}

impl Elastic for WithRigid<'_> {
    fn n(&self) -> usize {
        self.energy.n() + self.rigid
    }

    fn arch(&self) -> Arch {
        self.energy.arch()
    }

    fn scratch(&self) -> Scratch {
        let n = self.energy.n();
        Scratch::Rigid(Box::new(RigidRoom {
            own: self.energy.scratch(),
            hessian: DMatrix::zeros(n, n),
            near: Factor::new(n, self.arch()),
        }))
    }

    fn value(&self, q: &[f64], scratch: &mut Scratch) -> f64 {
        self.energy.value(&q[..self.energy.n()], scratch.rigid().own())
    }

    fn gradient(&self, q: &[f64], scratch: &mut Scratch, out: &mut [f64]) {
        let n = self.energy.n();
        self.energy.gradient(&q[..n], scratch.rigid().own(), &mut out[..n]);
        out[n..].fill(0.0);
    }

    fn hessian(&self, q: &[f64], curvature: Curvature, scratch: &mut Scratch, out: &mut DMatrix<f64>) {
        let (n, room) = (self.energy.n(), scratch.rigid());
        self.energy.hessian(&q[..n], curvature, &mut room.own, &mut room.hessian);
        out.fill(0.0);
        out.view_mut((0, 0), (n, n)).copy_from(&room.hessian);
    }

    fn near_value(&self, q: &[f64], scratch: &mut Scratch) -> f64 {
        self.energy.near_value(&q[..self.energy.n()], scratch.rigid().own())
    }

    fn near_gradient(&self, q: &[f64], scratch: &mut Scratch, out: &mut [f64]) {
        let n = self.energy.n();
        self.energy.near_gradient(&q[..n], scratch.rigid().own(), &mut out[..n]);
        out[n..].fill(0.0);
    }

    fn near_hessian(&self, q: &[f64], scratch: &mut Scratch, out: &mut Factor) -> bool {
        let (n, room) = (self.energy.n(), scratch.rigid());
        let made = self.energy.near_hessian(&q[..n], &mut room.own, &mut room.near);
        out.take(&room.near);
        made
    }

    fn viscosity(&self, q: &[f64], scratch: &mut Scratch, out: &mut DMatrix<f64>) {
        let (n, room) = (self.energy.n(), scratch.rigid());
        self.energy.viscosity(&q[..n], &mut room.own, &mut room.hessian);
        out.fill(0.0);
        out.view_mut((0, 0), (n, n)).copy_from(&room.hessian);
    }
}
