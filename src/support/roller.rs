//! Vertices held along some directions only: symmetry planes, diaphragms, rails.
//!
//! Such a vertex keeps its three unknowns. With the projector P onto the directions in which it moves, its part of a gradient is Pg, and its
//! blocks of a stiffness are PBP + k(1 − P): what is held stays exactly at zero, apart from all else.

use super::Supports;
use crate::{Error, Mesh, Result, Vec3};
use nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector6};

/// Directions count as independent when one is off the others by more than this, rad: less than any host means.
const INDEPENDENT: f64 = 1e-6;

/// A twist that moves what is held by less than the root of this part of the size is free; rows of f32 coordinates are straight to 1e-7.
const FREE: f64 = 1e-12;

/// A vertex held along one or two directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roller {
    /// Which.
    pub vertex: u32,
    /// P.
    pub free: Matrix3<f64>,
    /// How many directions are held.
    pub held: u32,
}

impl Roller {
    /// Whether it is a projector that leaves as many directions as it says.
    pub fn is_sound(&self) -> bool {
        let p = &self.free;
        let off = (p * p - p).amax().max((p - p.transpose()).amax());
        let left = p.trace() + f64::from(self.held) - 3.0;
        (1..=2).contains(&self.held) && off <= INDEPENDENT && left.abs() <= INDEPENDENT
    }

    /// Turns of the vertex that keep its displacement where it may move: about what is held if that is one direction, else about what is free.
    pub fn turns(&self) -> Matrix3<f64> {
        if self.held == 1 { Matrix3::identity() - self.free } else { self.free }
    }

    /// The same in axes that are turned.
    pub fn turned(&self, by: &UnitQuaternion<f64>) -> Self {
        let turn = by.to_rotation_matrix();
        Self { free: turn.matrix() * self.free * turn.matrix().transpose(), ..*self }
    }

    /// Unit vectors that are held.
    pub fn directions(&self) -> impl Iterator<Item = Vec3> {
        let mut taken = Matrix3::identity() - self.free;
        (0..self.held).map(move |_| {
            let longest = (0..3).max_by(|a, b| taken[(*a, *a)].total_cmp(&taken[(*b, *b)])).unwrap_or(0);
            let n: Vec3 = taken.column(longest) / taken[(longest, longest)].max(f64::MIN_POSITIVE).sqrt();
            taken -= n * n.transpose();
            n
        })
    }
}

impl Supports {
    /// What `along` and `symmetric` hold, ascending; vertices held along three directions become `held`, and those that are held already are passed over.
    pub fn rollers(&self, mesh: &Mesh, held: &mut [bool]) -> Result<Vec<Roller>> {
        let n = mesh.positions.len();
        let mut rollers: Vec<Roller> = vec![];
        for (i, (v, direction)) in self.along.iter().chain(&self.symmetric).enumerate() {
            if *v as usize >= n {
                return Err(Error::argument(format!("axes[{i}] is of vertex {v}, but the mesh has {n} vertices")));
            }
            let Some(direction) = unit(direction) else {
                let d = direction.data.0[0];
                return Err(Error::argument(format!("axes[{i}] of vertex {v} is {d:?}: it must be a direction")));
            };
            let at = rollers.binary_search_by_key(v, |roller| roller.vertex).unwrap_or_else(|at| {
                rollers.insert(at, Roller { vertex: *v, free: Matrix3::identity(), held: 0 });
                at
            });
            rollers[at].hold(&direction);
        }
        rollers.iter().filter(|roller| roller.held == 3).for_each(|roller| held[roller.vertex as usize] = true);
        rollers.retain(|roller| !held[roller.vertex as usize]);
        Ok(rollers)
    }
}

impl Roller {
    fn hold(&mut self, direction: &Vec3) {
        if let Some(n) = (self.free * direction).try_normalize(INDEPENDENT) {
            self.free -= n * n.transpose();
            self.held += 1;
        }
    }
}

/// Of length 1 whatever its size; none of zero or what is not finite.
pub(super) fn unit(direction: &Vec3) -> Option<Vec3> {
    let largest = direction.amax();
    let scaled = direction / largest;
    (largest > 0.0 && largest.is_finite() && scaled.iter().all(|x| x.is_finite())).then(|| scaled.normalize())
}

/// How many rigid motions leave `held` where they are: points, and directions that each is held along; and do not turn about any of `about`.
pub fn rigid_motions(held: &[(Vec3, Vec3)], about: &[Vec3]) -> usize {
    let center = held.iter().map(|(x, _)| x).sum::<Vec3>() / held.len().max(1) as f64;
    let reach = held.iter().map(|(x, _)| (x - center).norm()).fold(f64::MIN_POSITIVE, f64::max);
    let row = |(x, n): &(Vec3, Vec3)| {
        let moment = ((x - center) / reach).cross(n);
        Vector6::new(n.x, n.y, n.z, moment.x, moment.y, moment.z)
    };
    let turn = |n: &Vec3| Vector6::new(0.0, 0.0, 0.0, n.x, n.y, n.z);
    let rows = held.iter().map(row).chain(about.iter().map(turn));
    let gram: Matrix6<f64> = rows.map(|row| row * row.transpose()).sum();
    let eigenvalues = gram.symmetric_eigenvalues();
    let least = FREE * eigenvalues.max();
    eigenvalues.iter().filter(|lambda| **lambda <= least).count()
}
