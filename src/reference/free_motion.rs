//! Rigid motions that supports and constraints leave free, and shapes apart from them.
//!
//! A component moves rigidly by a twist (t, ω), t + ω × (x − c) at x, c its centre of mass. Each held direction n at x takes out the
//! twists that move x along n. The others meet no stiffness: only inertia answers a force along them. So of a load F what does work on
//! such motions Z is M Z (ZᵀMZ)⁻¹ Zᵀ F, an acceleration and no strain. Without it F is in balance along Z, and the shape that it bends
//! the shell to does not depend on what keeps the shell from drifting: here some directions of a few vertices.

use crate::mesh::NONE;
use crate::{Shell, Vec3, rotation};
use nalgebra::{DMatrix, DVector, Matrix3x6, Matrix6, Vector6};

/// A twist that moves what is held by less than the root of this part of the size is free; rows of f32 coordinates are straight to 1e-7.
const FREE: f64 = 1e-12;

/// Below this the terms of a turn's series that are left out are rounding.
const SMALL_TURN: f64 = 1e-4;

/// Rounds that bring a shape nearest to another; each leaves the third power of the turn. Of one by nearly half a turn, what is missing of that doubles
/// first: they go on while more is left than this.
const FITS: usize = 8;
const MOST_FITS: usize = 64;
const FITTED: f64 = 1e-9;

/// What is held of a vertex.
#[derive(Clone, Copy)]
pub enum Held {
    /// Its position along a direction.
    Along(Vec3),
    /// Its orientation about one.
    About(Vec3),
}

/// The free motions of one component.
struct Free {
    /// Those that move.
    vertices: Vec<u32>,
    /// c.
    center: Vec3,
    /// Orthonormal twists, ω times the shell's size (6 x n).
    twists: Vec<Vector6<f64>>,
    size: f64,
}

/// The free motions of all components at one pose.
pub struct FreeMotions(Vec<Free>);

impl FreeMotions {
    /// At positions `x` with the supports and `held` besides.
    pub fn new(shell: &Shell, held: impl Iterator<Item = (u32, Held)>, x: &[Vec3]) -> Self {
        let component = |v: usize| shell.mesh.component[v];
        let mut centers = vec![(Vec3::zeros(), 0.0); shell.mesh.n_components];
        for (v, mass) in shell.mass.iter().enumerate().filter(|(v, _)| component(*v) != NONE) {
            let (sum, total) = &mut centers[component(v) as usize];
            *sum += *mass * x[v];
            *total += mass;
        }
        let size = shell.mesh.size;
        let center = |c: usize| centers[c].0 / centers[c].1;
        let mut grams = vec![Matrix6::zeros(); centers.len()];
        for v in (0..x.len()).filter(|&v| shell.held[v] && component(v) != NONE) {
            let c = component(v) as usize;
            let moves = motion((x[v] - center(c)) / size);
            grams[c] += moves.tr_mul(&moves);
            if shell.is_clamped(v) {
                grams[c] += Matrix6::identity(); // nor does it turn about its edge
            }
        }
        let rollers = shell.rollers.iter().flat_map(|r| r.directions().map(|n| (r.vertex, Held::Along(n))));
        let mirrored = shell.mirrored_edges().map(|(v, n)| (v, Held::About(n)));
        for (v, held) in rollers.chain(mirrored).chain(held).filter(|(v, _)| component(*v as usize) != NONE) {
            let c = component(v as usize) as usize;
            let row = match held {
                Held::Along(n) => motion((x[v as usize] - center(c)) / size).tr_mul(&n),
                Held::About(n) => Vector6::new(0.0, 0.0, 0.0, n.x, n.y, n.z),
            };
            grams[c] += row * row.transpose();
        }
        let mut free: Vec<Option<Free>> = (0..grams.len())
            .map(|c| {
                let eigen = grams[c].symmetric_eigen();
                let least = FREE * eigen.eigenvalues.max();
                let twists: Vec<Vector6<f64>> = (0..6)
                    .filter(|&k| eigen.eigenvalues[k] <= least)
                    .map(|k| eigen.eigenvectors.column(k).into())
                    .collect();
                (!twists.is_empty()).then(|| Free { vertices: vec![], center: center(c), twists, size })
            })
            .collect();
        for &v in &shell.free {
            if let Some(free) = &mut free[component(v as usize) as usize] {
                free.vertices.push(v);
            }
        }
        Self(free.into_iter().flatten().filter(|free| !free.vertices.is_empty()).collect())
    }

    /// Whether nothing moves freely.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.0.iter().map(|free| free.twists.len()).sum()
    }

    /// What each of them turns about, with its rate.
    pub fn turns(&self) -> Vec<Vec3> {
        let turn = |twist: &Vector6<f64>| twist.fixed_rows::<3>(3).into_owned();
        self.0.iter().flat_map(|free| free.twists.iter().map(turn)).collect()
    }

    /// Takes from the loads `forces` (n_vertices) what accelerates free motions.
    pub fn balance(&self, shell: &Shell, x: &[Vec3], forces: &mut [Vec3]) {
        for free in &self.0 {
            let along = free.coefficients(shell, x, |v| forces[v]);
            free.vertices
                .iter()
                .map(|&v| v as usize)
                .for_each(|v| forces[v] -= shell.mass[v] * free.field(&along, x[v]));
        }
    }

    /// Moves `x` freely to nearest to `anchor` by mass.
    pub fn align(&self, shell: &Shell, x: &mut [Vec3], anchor: &[Vec3]) {
        for free in &self.0 {
            for round in 0..MOST_FITS {
                let twist = free.coefficients(shell, x, |v| shell.mass[v] * (anchor[v] - x[v]));
                let (slide, turn) = (twist.fixed_rows::<3>(0).into_owned(), twist.fixed_rows::<3>(3) / free.size);
                // Along the screw whose axis does not move, so that what is held stays. Of a small turn the axis may be far away.
                let angle = turn.norm();
                let (first, second) = match angle > SMALL_TURN {
                    true => {
                        let (sine, cosine) = libm::sincos(angle);
                        ((1.0 - cosine) / angle.powi(2), (angle - sine) / angle.powi(3))
                    }
                    false => (0.5, 1.0 / 6.0),
                };
                let along = slide + first * turn.cross(&slide) + second * turn.cross(&turn.cross(&slide));
                let rotation = rotation::by(&turn);
                free.vertices.iter().for_each(|&v| {
                    let x = &mut x[v as usize];
                    *x = free.center + rotation * (*x - free.center) + along;
                });
                let there = angle <= f64::EPSILON && slide.norm() <= f64::EPSILON * free.size;
                if there || round + 1 >= FITS && angle <= FITTED {
                    break;
                }
            }
        }
    }

    /// As many directions of vertices as there are free motions: held, they hold the shell against these and nothing else.
    pub fn pins(&self, x: &[Vec3]) -> Vec<(u32, Vec3)> {
        self.0.iter().flat_map(|free| free.pins(x)).collect()
    }
}

impl Free {
    /// Z (ZᵀMZ)⁻¹ Zᵀ f as a twist, of forces `f`.
    fn coefficients(&self, shell: &Shell, x: &[Vec3], f: impl Fn(usize) -> Vec3) -> Vector6<f64> {
        let (mut inertia, mut force) = (Matrix6::zeros(), Vector6::zeros());
        for v in self.vertices.iter().map(|&v| v as usize) {
            let moves = motion((x[v] - self.center) / self.size);
            inertia += shell.mass[v] * moves.tr_mul(&moves);
            force += moves.tr_mul(&f(v));
        }
        let n = self.twists.len();
        let reduced = DMatrix::from_fn(n, n, |i, j| self.twists[i].dot(&(inertia * self.twists[j])));
        let work = DVector::from_fn(n, |i, _| self.twists[i].dot(&force));
        let Some(factor) = reduced.cholesky() else { return Vector6::zeros() };
        factor.solve(&work).iter().zip(&self.twists).map(|(c, twist)| *c * twist).sum()
    }

    /// The motion of a vertex at `x`.
    fn field(&self, twist: &Vector6<f64>, x: Vec3) -> Vec3 {
        motion((x - self.center) / self.size) * twist
    }

    /// One for each twist: where and along what the twists that are left move most.
    fn pins(&self, x: &[Vec3]) -> Vec<(u32, Vec3)> {
        let mut left = self.twists.clone();
        let pin = |_| {
            let spread = |v: u32| -> nalgebra::Matrix3<f64> {
                left.iter().map(|t| self.field(t, x[v as usize])).map(|u| u * u.transpose()).sum()
            };
            let most = |a: &&u32, b: &&u32| spread(**a).trace().total_cmp(&spread(**b).trace());
            let vertex = *self.vertices.iter().max_by(most)?;
            let eigen = spread(vertex).symmetric_eigen();
            let direction: Vec3 = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into();
            let row: Vec<f64> = left.iter().map(|t| direction.dot(&self.field(t, x[vertex as usize]))).collect();
            let squared: f64 = row.iter().map(|r| r * r).sum();
            if squared.is_nan() || squared <= 0.0 {
                return None;
            }
            let pinned: Vector6<f64> = row.iter().zip(&left).map(|(r, t)| *r * t).sum();
            left.iter_mut().zip(&row).for_each(|(t, r)| *t -= (r / squared) * pinned);
            Some((vertex, direction))
        };
        (0..self.twists.len()).map_while(pin).collect()
    }
}

/// Maps a twist to the motion at `r` from its centre, both with lengths over the shell's size.
fn motion(r: Vec3) -> Matrix3x6<f64> {
    let mut map = Matrix3x6::zeros();
    map.fixed_columns_mut::<3>(0).fill_with_identity();
    map.fixed_columns_mut::<3>(3).copy_from(&-r.cross_matrix());
    map
}
