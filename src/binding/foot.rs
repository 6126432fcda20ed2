//! Where a point stands on a mesh: X = Σ bᵢ (Xᵢ + t Nᵢ), along normals that turn smoothly from vertex to vertex.
//!
//! Nearest points jump inside a bend and stay on its edges outside. Along such normals neighbouring points stand side by side.

use crate::Vec3;
use crate::collider::{Nearest, Tree, sort_triangles};
use crate::error::{Result, reserve};
use nalgebra::{Matrix2, Matrix3, Vector2};
use std::collections::HashMap;

const NOBODY: u32 = u32::MAX;
/// Triangles that a search crosses, and rounds of Newton's method in each, before it takes the nearest point instead.
const CROSSINGS: usize = 32;
const ROUNDS: usize = 20;
/// Of the mesh's size: a foot is found where the rest is less.
const MET: f64 = 1e-12;
/// A coordinate so little below zero is on the side.
const ON_SIDE: f64 = 1e-9;

/// Where a point stands.
#[derive(Clone, Copy, Debug)]
pub struct Foot {
    pub vertices: [u32; 3],
    /// Barycentric, none negative.
    pub weights: [f64; 3],
    /// Along the normals.
    pub height: f64,
    /// Which coordinates are held at zero as the shell ends there.
    pub held: [bool; 3],
}

pub struct Ground<'a> {
    positions: &'a [Vec3],
    normals: &'a [Vec3],
    triangles: Vec<[u32; 3]>,
    /// Across the side opposite to each corner.
    neighbours: Vec<[u32; 3]>,
    tree: Tree,
}

impl<'a> Ground<'a> {
    /// Over a mesh of size about 1 with unit normals at its vertices.
    pub fn new(positions: &'a [Vec3], normals: &'a [Vec3], triangles: &[[u32; 3]]) -> Result<Self> {
        let mut sorted = reserve("the mesh's triangles", triangles.len())?;
        sorted.extend_from_slice(triangles);
        sort_triangles(positions, &mut sorted);
        let tree = Tree::new(positions, &sorted)?;
        let mut neighbours = vec![[NOBODY; 3]; sorted.len()];
        let mut open: HashMap<[u32; 2], (u32, usize)> = HashMap::with_capacity(2 * sorted.len());
        for t in 0..sorted.len() {
            for k in 0..3 {
                let (a, b) = (sorted[t][(k + 1) % 3], sorted[t][(k + 2) % 3]);
                match open.remove(&[b, a]) {
                    Some((other, corner)) => {
                        neighbours[t][k] = other;
                        neighbours[other as usize][corner] = t as u32;
                    }
                    None => {
                        open.insert([a, b], (t as u32, k));
                    }
                }
            }
        }
        Ok(Self { positions, normals, triangles: sorted, neighbours, tree })
    }

    fn corners(&self, t: usize) -> [[Vec3; 2]; 3] {
        self.triangles[t].map(|v| [self.positions[v as usize], self.normals[v as usize]])
    }

    /// The nearest point of the mesh, and how far it is.
    fn nearest(&self, p: &Vec3) -> Nearest {
        self.tree.nearest(self.positions, &self.triangles, p, Nearest::within(f64::INFINITY))
    }

    /// Where `p` stands.
    pub fn foot(&self, p: &Vec3) -> Foot {
        let nearest = self.nearest(p);
        let start = Foot {
            vertices: self.triangles[nearest.triangle],
            weights: nearest.weights,
            height: 0.0,
            held: [false; 3],
        };
        self.walk(p, nearest.triangle, start.weights).unwrap_or(start)
    }

    fn walk(&self, p: &Vec3, mut t: usize, mut weights: [f64; 3]) -> Option<Foot> {
        let mut height = 0.0;
        for _ in 0..CROSSINGS {
            (weights, height) = within(p, &self.corners(t), (weights, height))?;
            let k = (0..3).min_by(|i, j| weights[*i].total_cmp(&weights[*j]))?;
            if weights[k] >= -ON_SIDE {
                let sum: f64 = weights.iter().map(|w| w.max(0.0)).sum();
                let weights = weights.map(|w| w.max(0.0) / sum);
                return Some(Foot { vertices: self.triangles[t], weights, height, held: [false; 3] });
            }
            let across = self.neighbours[t][k];
            if across == NOBODY {
                return self.on_side(p, t, k);
            }
            let [i, j] = [self.triangles[t][(k + 1) % 3], self.triangles[t][(k + 2) % 3]];
            t = across as usize;
            let share = (weights[(k + 2) % 3] / (weights[(k + 1) % 3] + weights[(k + 2) % 3])).clamp(0.0, 1.0);
            weights = self.triangles[t].map(|v| match v {
                v if v == i => 1.0 - share,
                v if v == j => share,
                _ => 0.0,
            });
        }
        None
    }

    /// On the side opposite to corner `k`, where the shell ends: the least of |p − Σ bᵢ (Xᵢ + t Nᵢ)|.
    fn on_side(&self, p: &Vec3, t: usize, k: usize) -> Option<Foot> {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let corners = self.corners(t);
        let ([a, n], [b, m]) = (corners[i], corners[j]);
        let side = b - a;
        let mut s = ((p - a).dot(&side) / side.norm_squared()).clamp(0.0, 1.0);
        let mut height = 0.0;
        for _ in 0..ROUNDS {
            let up = n + s * (m - n);
            height = (p - a - s * side).dot(&up) / up.norm_squared();
            let left = p - a - s * side - height * up;
            let along = side + height * (m - n);
            let squares = Matrix2::new(along.dot(&along), along.dot(&up), along.dot(&up), up.dot(&up));
            let step = squares.try_inverse()? * Vector2::new(along.dot(&left), up.dot(&left));
            let next = (s + step.x).clamp(0.0, 1.0);
            let moved = (next - s).abs();
            s = next;
            if moved < MET {
                break;
            }
        }
        let (mut weights, mut held) = ([0.0; 3], [false; 3]);
        (weights[i], weights[j]) = (1.0 - s, s);
        held[k] = true;
        held[i] = s >= 1.0;
        held[j] = s <= 0.0;
        height.is_finite().then_some(Foot { vertices: self.triangles[t], weights, height, held })
    }

    /// How weights and height change when the point moves by `step`: least squares where coordinates are held.
    pub fn rates(&self, foot: &Foot, step: &Vec3) -> [f64; 3] {
        let corners = foot.vertices.map(|v| [self.positions[v as usize], self.normals[v as usize]]);
        let up: Vec3 = (0..3).map(|i| foot.weights[i] * corners[i][1]).sum();
        let raised = corners.map(|[x, n]| x + foot.height * n);
        let free: Vec<usize> = (0..3).filter(|i| !foot.held[*i]).collect();
        let mut rates = [0.0; 3];
        match free[..] {
            [i, j, k] => {
                let matrix = Matrix3::from_columns(&[raised[j] - raised[i], raised[k] - raised[i], up]);
                if let Some(inverse) = matrix.try_inverse() {
                    let rate = inverse * step;
                    (rates[i], rates[j], rates[k]) = (-rate.x - rate.y, rate.x, rate.y);
                }
            }
            [i, j] => {
                let along = raised[j] - raised[i];
                let squares = Matrix2::new(along.dot(&along), along.dot(&up), along.dot(&up), up.dot(&up));
                if let Some(inverse) = squares.try_inverse() {
                    let rate = inverse * Vector2::new(along.dot(step), up.dot(step));
                    (rates[i], rates[j]) = (-rate.x, rate.x);
                }
            }
            _ => (),
        }
        rates
    }
}

/// Newton's method for the point within one triangle, on whose plane it goes on beyond the sides.
fn within(p: &Vec3, corners: &[[Vec3; 2]; 3], start: ([f64; 3], f64)) -> Option<([f64; 3], f64)> {
    let [[a, n], [b, m], [c, l]] = *corners;
    let ([_, mut v, mut w], mut height) = start;
    for _ in 0..ROUNDS {
        let up = n + v * (m - n) + w * (l - n);
        let left = p - (a + v * (b - a) + w * (c - a) + height * up);
        let columns = [b - a + height * (m - n), c - a + height * (l - n), up];
        let step = Matrix3::from_columns(&columns).try_inverse()? * left;
        (v, w, height) = (v + step.x, w + step.y, height + step.z);
        let bounded = v.abs() < 1e3 && w.abs() < 1e3 && height.is_finite();
        if !bounded {
            return None;
        }
        if left.norm() <= MET {
            // A foot beyond where the normals meet is on the wrong side of them.
            let turned = columns[0].cross(&columns[1]).dot(&(b - a).cross(&(c - a))) <= 0.0;
            return if turned { None } else { Some(([1.0 - v - w, v, w], height)) };
        }
    }
    None
}
