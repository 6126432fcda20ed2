//! Fields by which a shell follows supports that move against each other.
//!
//! Supports that move by d off the frame's rigid motion carry the shell to where no force is left on it,
//!
//!   K_ff u_f = −K_fs d,
//!
//! and modes vibrate about that. d is spanned by few patterns p_j: polynomials of the rest positions, first of low degree, on each group
//! of supports that edges join. They are orthonormal in the mean over the supports, and orthogonal to the rigid motions, which are the
//! frame's. With u_j the answer to p_j, amplitudes s_j and modes φ_k,
//!
//!   u = Σ q_k φ_k + Σ s_j u_j,   q̈_k + λ_k q_k = f_k − Σ_j (φ_kᵀ M u_j) s̈_j :
//!
//! there is no elastic coupling, as u_j are in balance.

use super::{MAX_MODES, Modes, ScaledStiffness};
use crate::energy::Curvature;
use crate::mesh::UnionFind;
use crate::support::turn_between;
use crate::warp::warp_with_derivative;
use crate::{Error, ErrorKind, Result, Shell, Vec3, rotation};
use faer::Mat;

/// Degree of the polynomials, at most.
const MOST_DEGREE: i32 = 4;

/// Of its length, what a pattern must have that others do not give already.
const NEW: f64 = 1e-6;

/// Of the lowest eigenvalue, what is added to those of motions that are free, so that all have an answer. It is off by as much.
const ADDED: f64 = 1e-6;
/// The same of ‖A‖, where no mode is elastic.
const ADDED_BLINDLY: f64 = 1e-12;

/// Displacements of all vertices (fields × n_vertices).
pub type Shapes = Vec<Vec<Vec3>>;

/// See the module's text. Amplitudes are in units of length times √M, as those of modes.
#[derive(Clone, Debug, PartialEq)]
pub struct SupportFields {
    /// Supported vertices with mass, ascending.
    pub held: Vec<u32>,
    /// Which of the groups each belongs to.
    pub group: Vec<u32>,
    /// p_j at each of them (fields × held).
    pub patterns: Vec<Vec<Vec3>>,
    /// φ_kᵀ M u_j, at k fields + j.
    pub coupling: Vec<f64>,
    /// u_iᵀ K u_j, at i fields + j.
    pub stiffness: Vec<f64>,
    /// √M.
    pub root_mass: f64,
}

impl SupportFields {
    /// Chooses patterns and solves for the answers to them: at most `wanted`, fewer where supports are few. Returns the answers, over √M
    /// (fields × n_vertices), beside the rest.
    pub fn new(shell: &Shell, modes: &Modes, wanted: usize) -> Result<(Self, Shapes)> {
        let held = supported(shell);
        if held.is_empty() {
            return Err(Error::argument(format!("support_fields is {wanted}, but the shell has no supports")));
        }
        if !shell.clamped.is_empty() {
            let message = "support_fields: the slope at clamped edges cannot follow moving supports: fix two rows of vertices instead";
            return Err(Error::new(ErrorKind::Unsupported, message));
        }
        if wanted + modes.eigenvalues.len() > MAX_MODES {
            let message =
                format!("{wanted} support_fields and {} modes are more than {MAX_MODES}", modes.eigenvalues.len());
            return Err(Error::argument(message));
        }
        let group = groups(shell, &held);
        let patterns = patterns(shell, &held, &group, wanted);
        let root_mass = shell.total_mass.sqrt();
        let shapes = answers(shell, modes, &held, &patterns)?;
        let forces = stiffness_times(shell, &shapes);
        let stiffness = shapes.iter().flat_map(|u| forces.iter().map(|f| product(u, f))).collect();
        let weighted = |v: usize, x: &Vec3| *x * shell.mass[v];
        let momenta: Vec<Vec<Vec3>> =
            shapes.iter().map(|u| u.iter().enumerate().map(|(v, x)| weighted(v, x)).collect()).collect();
        let coupling = modes.shapes.iter().flat_map(|phi| momenta.iter().map(|mu| product(phi, mu))).collect();
        Ok((Self { held, group, patterns, coupling, stiffness, root_mass }, shapes))
    }

    /// Number of fields.
    pub fn n(&self) -> usize {
        self.patterns.len()
    }

    /// Sets the amplitudes of supports that are displaced by `d` from their places in the frame at `rest` (held each). The warp turns what its groups' own
    /// rotations turn, so that it is undone.
    pub fn amplitudes(&self, rest: &[Vec3], d: &[Vec3], warped: bool, out: &mut [f64]) {
        out.fill(0.0);
        let scale = self.root_mass / self.held.len() as f64;
        let n_groups = self.group.iter().max().map_or(0, |last| last + 1);
        for g in 0..n_groups {
            let own = || (0..self.held.len()).filter(|i| self.group[*i] == g);
            let back = match warped {
                true => self.unwarp(rest, d, own),
                false => nalgebra::Matrix3::identity(),
            };
            for i in own() {
                let linear = scale * (back * d[i]);
                out.iter_mut().zip(&self.patterns).for_each(|(s, p)| *s += p[i].dot(&linear));
            }
        }
    }

    /// R̃⁻¹ of the rotation of a group.
    fn unwarp<I: Iterator<Item = usize>>(
        &self,
        rest: &[Vec3],
        d: &[Vec3],
        own: impl Fn() -> I,
    ) -> nalgebra::Matrix3<f64> {
        let at = |i: usize| rest[self.held[i] as usize];
        let turn = turn_between(|| own().map(|i| (at(i), at(i) + d[i])));
        let (_, warp, _) = warp_with_derivative(&rotation::vector(&turn), &Vec3::zeros(), true);
        warp.try_inverse().unwrap_or_else(nalgebra::Matrix3::identity)
    }

    /// ½ sᵀKs.
    pub fn energy(&self, s: &[f64]) -> f64 {
        let rows = self.stiffness.chunks_exact(self.n().max(1)).zip(s);
        0.5 * rows.map(|(row, s_i)| s_i * row.iter().zip(s).map(|(k, s)| k * s).sum::<f64>()).sum::<f64>()
    }

    /// Size of the forces on the supports that hold them at s, to first order: those of the least squares among all that do the work of Ks.
    pub fn pull(&self, s: &[f64]) -> f64 {
        let rows = self.stiffness.chunks_exact(self.n().max(1));
        let along = rows.map(|row| row.iter().zip(s).map(|(k, s)| k * s).sum::<f64>());
        self.root_mass * along.map(|g| g * g).sum::<f64>().sqrt() / (self.held.len() as f64).sqrt()
    }

    /// Adds the modal force of accelerations s̈.
    pub fn add_inertia(&self, acceleration: &[f64], force: &mut [f64]) {
        for (force, row) in force.iter_mut().zip(self.coupling.chunks_exact(self.n().max(1))) {
            *force -= row.iter().zip(acceleration).map(|(c, a)| c * a).sum::<f64>();
        }
    }

    /// Whether every number in it is finite.
    pub fn is_finite(&self) -> bool {
        let patterns = self.patterns.iter().flatten().flat_map(|p| p.iter());
        patterns.chain(&self.coupling).chain(&self.stiffness).all(|x| x.is_finite())
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.held.len() * 8
            + self.n() * self.held.len() * size_of::<Vec3>()
            + 8 * (self.coupling.len() + self.stiffness.len())
    }
}

/// The supported vertices that have mass, ascending.
pub fn supported(shell: &Shell) -> Vec<u32> {
    (0..shell.mass.len() as u32).filter(|v| shell.held[*v as usize] && shell.mass[*v as usize] > 0.0).collect()
}

/// Of each of `held`, which of the groups that edges join it belongs to, numbered in the order of their first vertices.
pub fn groups(shell: &Shell, held: &[u32]) -> Vec<u32> {
    let mut sets = UnionFind::new(held.len());
    let place = |v: u32| held.binary_search(&v).ok().map(|i| i as u32);
    for [a, b] in shell.mesh.edges.iter().map(|e| e.vertices) {
        if let (Some(a), Some(b)) = (place(a), place(b)) {
            sets.join(a, b);
        }
    }
    let mut roots = vec![]; // each the first of its group, so that they ascend
    let number = |i: u32| match roots.binary_search(&sets.find(i)) {
        Ok(group) => group as u32,
        Err(_) => {
            roots.push(i);
            roots.len() as u32 - 1
        }
    };
    (0..held.len() as u32).map(number).collect()
}

/// At most `wanted` patterns: of each degree in turn, on each group in turn.
fn patterns(shell: &Shell, held: &[u32], group: &[u32], wanted: usize) -> Vec<Vec<Vec3>> {
    let rest = shell.points(held);
    let n = rest.len() as f64;
    let center = rest.iter().sum::<Vec3>() / n;
    let reach = rest.iter().map(|x| (x - center).norm()).fold(f64::MIN_POSITIVE, f64::max);
    let mut basis: Vec<Vec<Vec3>> = vec![];
    let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
    let rigid = axes.iter().map(|a| vec![*a; rest.len()]);
    let turns = axes.iter().map(|a| rest.iter().map(|x| a.cross(&((x - center) / reach))).collect());
    rigid.chain(turns).for_each(|motion: Vec<Vec3>| basis.extend(orthonormal(&basis, motion)));
    let rigid = basis.len();
    let n_groups = group.iter().max().map_or(0, |last| last + 1);
    let frames: Vec<(Vec3, f64)> = (0..n_groups).map(|g| extent_of(&rest, group, g)).collect();
    for degree in 0..=MOST_DEGREE {
        for (g, (center, reach)) in (0u32..).zip(&frames) {
            for powers in monomials(degree) {
                for axis in axes {
                    if basis.len() - rigid == wanted || basis.len() == 3 * rest.len() {
                        return basis.split_off(rigid);
                    }
                    let value = |x: &Vec3| -> f64 {
                        let at = (x - center) / *reach;
                        (0..3).map(|c| at[c].powi(powers[c])).product()
                    };
                    let on = |(x, own): (&Vec3, &u32)| if *own == g { axis * value(x) } else { Vec3::zeros() };
                    let pattern = rest.iter().zip(group).map(on).collect();
                    basis.extend(orthonormal(&basis, pattern));
                }
            }
        }
    }
    basis.split_off(rigid)
}

/// Centre of a group and its reach from there.
fn extent_of(rest: &[Vec3], group: &[u32], g: u32) -> (Vec3, f64) {
    let own = || rest.iter().zip(group).filter(|(_, own)| **own == g).map(|(x, _)| x);
    let center = own().sum::<Vec3>() / own().count() as f64;
    (center, own().map(|x| (x - center).norm()).fold(f64::MIN_POSITIVE, f64::max))
}

/// Powers of x, y, z of this degree in sum.
fn monomials(degree: i32) -> impl Iterator<Item = [i32; 3]> {
    (0..=degree).rev().flat_map(move |i| (0..=degree - i).rev().map(move |j| [i, j, degree - i - j]))
}

/// The part of `p` that `basis` does not span, of mean square 1; none where little is left. Twice, for the digits.
fn orthonormal(basis: &[Vec<Vec3>], mut p: Vec<Vec3>) -> Option<Vec<Vec3>> {
    let n = p.len() as f64;
    let before = (product(&p, &p) / n).sqrt();
    for _ in 0..2 {
        for b in basis {
            let along = product(b, &p) / n;
            p.iter_mut().zip(b).for_each(|(p, b)| *p -= along * b);
        }
    }
    let left = (product(&p, &p) / n).sqrt();
    (left > NEW * before.max(f64::MIN_POSITIVE) && left.is_finite()).then(|| p.into_iter().map(|x| x / left).collect())
}

fn product(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

/// K times fields on all vertices, held ones included.
fn stiffness_times(shell: &Shell, fields: &[Vec<Vec3>]) -> Vec<Vec<Vec3>> {
    let mut forces = vec![vec![Vec3::zeros(); shell.mass.len()]; fields.len()];
    if shell.is_stressed() {
        shell.energy.visit_hessian(&shell.mesh.positions, Curvature::Exact, &mut |(vertices, blocks)| {
            for (force, field) in forces.iter_mut().zip(fields) {
                for (p, v) in vertices.iter().enumerate() {
                    let part = |(q, w): (usize, &u32)| blocks[p * vertices.len() + q] * field[*w as usize];
                    force[*v as usize] += vertices.iter().enumerate().map(part).sum::<Vec3>();
                }
            }
        });
    } else {
        shell.energy.visit_rest_rows(&mut |(vertices, row)| {
            for (force, field) in forces.iter_mut().zip(fields) {
                let strain: f64 = vertices.iter().zip(row).map(|(v, b)| b.dot(&field[*v as usize])).sum();
                vertices.iter().zip(row).for_each(|(v, b)| force[*v as usize] += strain * b);
            }
        });
    }
    forces
}

/// u_j over √M (fields × n_vertices).
fn answers(shell: &Shell, modes: &Modes, held: &[u32], patterns: &[Vec<Vec3>]) -> Result<Vec<Vec<Vec3>>> {
    let root_mass = shell.total_mass.sqrt();
    let mut shapes = vec![vec![Vec3::zeros(); shell.mass.len()]; patterns.len()];
    for (shape, pattern) in shapes.iter_mut().zip(patterns) {
        held.iter().zip(pattern).for_each(|(v, p)| shape[*v as usize] = p / root_mass);
    }
    if shell.free.is_empty() || patterns.is_empty() {
        return Ok(shapes);
    }
    let forces = stiffness_times(shell, &shapes);
    let stiffness = ScaledStiffness::assemble(shell)?;
    let symbolic = shell.analysis(stiffness.lower.symbolic())?;
    let elastic = modes.eigenvalues.get(modes.zero_modes);
    let added = match modes.zero_modes {
        0 => 0.0,
        _ => elastic.map_or(ADDED_BLINDLY * stiffness.norm, |lambda| ADDED * lambda),
    };
    let Some(factor) = symbolic.cholesky(&stiffness.shifted(-added))? else {
        return Err(Error::new(ErrorKind::Numerical, "support_fields: the stiffness is not positive definite"));
    };
    let mut solved = Mat::<f64>::zeros(shell.n_unknowns(), patterns.len());
    for (j, force) in forces.iter().enumerate() {
        for (at, v) in shell.free.iter().enumerate() {
            (0..3).for_each(|c| solved[(3 * at + c, j)] = -force[*v as usize][c] / stiffness.root_mass[3 * at + c]);
        }
    }
    stiffness.project(shell, solved.as_mut());
    factor.solve_in_place(solved.as_mut())?;
    stiffness.project(shell, solved.as_mut());
    for (j, shape) in shapes.iter_mut().enumerate() {
        for (at, v) in shell.free.iter().enumerate() {
            let x = |c: usize| solved[(3 * at + c, j)] / stiffness.root_mass[3 * at + c];
            shape[*v as usize] = Vec3::from_fn(|c, _| x(c));
        }
        remove_free_motion(shell, &modes.shapes[..modes.zero_modes], shape);
    }
    Ok(shapes)
}

/// Takes the zero modes from the vertices that move.
fn remove_free_motion(shell: &Shell, zero_modes: &[Vec<Vec3>], shape: &mut [Vec3]) {
    for phi in zero_modes {
        let along: f64 = shell.free.iter().map(|v| *v as usize).map(|v| shell.mass[v] * phi[v].dot(&shape[v])).sum();
        shell.free.iter().map(|v| *v as usize).for_each(|v| shape[v] -= along * phi[v]);
    }
}
