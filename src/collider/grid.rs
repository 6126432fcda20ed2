//! A distance on a grid: quadratic B-splines, whose value and gradient are continuous.
//!
//!   d(p) = h Σ_i c_i B(u_x − i_x) B(u_y − i_y) B(u_z − i_z),   u = (p − o) / h
//!   c = f − (δ_x² + δ_y² + δ_z²) f / 8,   f the signed distance at the nodes, in cells
//!
//! These c give quadratic polynomials as they are: the error is of third order in h where the distance is smooth, of first order at its creases.
//! Beyond the grid, with the nearest point c in it: d(p)² = |p − c|² + d(c)², no more than the true distance squared.

use super::{Ball, SIZES, Touch};
use crate::Vec3;
use crate::error::{Result, invalid};

#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// Nodes along x, y and z, at least [`LEAST_NODES`] each; x runs fastest.
    pub nodes: [usize; 3],
    /// Where the first node is.
    pub origin: Vec3,
    /// h.
    pub cell: f64,
    /// Then [`PADDING`]. c, of no more than [`MOST_VALUE`]; those on the border are positive.
    pub values: Vec<f32>,
    pub ball: Ball,
    pub inner_radius: f64,
    pub surface_error: f64,
    per_cell: f64,
    /// Bounds over the whole grid: of the gradient, and of h times the second derivative along any direction.
    slope: f64,
    bend: f64,
}

/// What a spline of degree two needs, and an inside.
pub(super) const LEAST_NODES: usize = 5;
pub(super) const MOST_NODES: usize = 1 << 12;
/// Cells: farther than any two nodes, with room for δ².
pub(super) const MOST_VALUE: f32 = 4e4;
/// Values after the last, as four are read where three count.
pub(super) const PADDING: usize = 1;
/// Of a cell: closer than this to the margin is there. The interpolation is no better.
const CLOSE: f64 = 1e-4;
/// A way that needs more steps creeps along the margin, and counts as there.
const STEPS: usize = 100_000;

/// The distance and its gradient; what lies on the way from the grid to the point.
struct Sample {
    distance: f64,
    gradient: Vec3,
    beyond: Vec3,
}

impl Grid {
    /// Fails unless it keeps what its fields promise.
    pub fn new(
        (nodes, origin, cell): ([usize; 3], Vec3, f64),
        values: Vec<f32>,
        (ball, inner_radius, surface_error): (Ball, f64, f64),
    ) -> Result<Self> {
        let [nx, ny, nz] = nodes;
        let fits =
            nodes.iter().all(|n| (LEAST_NODES..=MOST_NODES).contains(n)) && nx * ny * nz + PADDING == values.len();
        let known = |c: &f64| c.abs() <= 10.0 * SIZES.end(); // no NaN is
        let sizes = cell >= 1e-4 * SIZES.start() && cell <= *SIZES.end() && origin.iter().all(known);
        let told = ball.center.iter().all(known)
            && [ball.radius, inner_radius, surface_error].iter().all(|told| known(told) && *told >= 0.0)
            && inner_radius > 0.0;
        if !fits || !sizes || !told {
            return invalid(format!("a grid of {nx} × {ny} × {nz} nodes in cells of {cell:?} is out of range"));
        }
        let mut grid = Self {
            nodes,
            origin,
            cell,
            values,
            ball,
            inner_radius,
            surface_error,
            per_cell: 1.0 / cell,
            slope: 0.0,
            bend: 0.0,
        };
        grid.check_values()?;
        (grid.slope, grid.bend) = grid.bounds();
        Ok(grid)
    }

    fn check_values(&self) -> Result<()> {
        let [nx, ny, nz] = self.nodes;
        for (at, value) in self.values.iter().enumerate().take(nx * ny * nz) {
            let (i, j, k) = (at % nx, at / nx % ny, at / (nx * ny));
            // A spline on the border reads two nodes deep.
            let border = i < 2 || j < 2 || k < 2 || i + 2 >= nx || j + 2 >= ny || k + 2 >= nz;
            let right = value.abs() <= MOST_VALUE && (!border || *value > 0.0); // no NaN is
            if !right {
                return invalid(format!("the grid's value {value:?} at node {i}, {j}, {k} is out of range"));
            }
        }
        Ok(())
    }

    /// Of the gradient, and of second derivatives: these are means of second differences, and no norm of a 3 × 3 matrix is above three
    /// times its largest number.
    fn bounds(&self) -> (f64, f64) {
        let stride = [1, self.nodes[0], self.nodes[0] * self.nodes[1]];
        let value = |at: usize| f64::from(self.values[at]);
        let (mut slope, mut second) = (0.0f64, 0.0f64);
        for at in 0..self.values.len() - PADDING {
            let place: [usize; 3] = std::array::from_fn(|a| at / stride[a] % self.nodes[a]);
            let above: [bool; 3] = std::array::from_fn(|a| place[a] + 1 < self.nodes[a]);
            let within: [bool; 3] = std::array::from_fn(|a| place[a] > 0 && above[a]);
            if within == [true; 3] {
                slope = slope.max(self.slope_about(at, &stride));
            }
            for a in 0..3 {
                let s = stride[a];
                if within[a] {
                    second = second.max((value(at + s) - 2.0 * value(at) + value(at - s)).abs());
                }
                for b in (0..a).filter(|b| above[a] && above[*b]) {
                    let t = stride[b];
                    second = second.max((value(at + s + t) - value(at + s) - value(at + t) + value(at)).abs());
                }
            }
        }
        (slope, 3.0 * second)
    }

    /// |∇d| is no more in the cell about the node `at`: along each axis it is a mean of differences between 3 × 3 × 3 nodes.
    #[inline]
    fn slope_about(&self, at: usize, stride: &[usize; 3]) -> f64 {
        let mut sum = 0.0;
        for a in 0..3 {
            let (s, t, r) = (stride[a], stride[(a + 1) % 3], stride[(a + 2) % 3]);
            let mut most = 0.0f32;
            for line in 0..9 {
                let middle = at + line % 3 * t + line / 3 * r - t - r;
                let [low, mid, high] = [middle - s, middle, middle + s].map(|at| self.values[at]);
                most = most.max((mid - low).abs()).max((high - mid).abs());
            }
            sum += f64::from(most) * f64::from(most);
        }
        sum.sqrt()
    }

    #[inline]
    fn sample(&self, p: &Vec3) -> Sample {
        let mut first = [0usize; 3];
        let (mut weights, mut slopes) = ([[0.0; 3]; 3], [[0.0; 3]; 3]);
        let mut beyond = Vec3::zeros();
        for a in 0..3 {
            let n = self.nodes[a];
            let u = (p[a] - self.origin[a]) * self.per_cell;
            let inside = u.clamp(0.5, n as f64 - 1.5);
            beyond[a] = (u - inside) * self.cell;
            let middle = ((inside + 0.5) as usize).min(n - 2);
            let t = inside - middle as f64;
            let (low, high) = (0.5 - t, 0.5 + t);
            first[a] = middle - 1;
            weights[a] = [0.5 * low * low, 0.75 - t * t, 0.5 * high * high];
            slopes[a] = [-low, -2.0 * t, high];
        }
        let [nx, ny, _] = self.nodes;
        // Four numbers side by side: sums over y and z of rows along x, and of their slopes along y and z.
        let (mut rows, mut rows_y, mut rows_z) = ([0.0; 4], [0.0; 4], [0.0; 4]);
        for k in 0..3 {
            for j in 0..3 {
                let at = first[0] + nx * (first[1] + j + ny * (first[2] + k));
                let row: &[f32; 4] = self.values[at..at + 4].try_into().expect("four");
                let weight = weights[1][j] * weights[2][k];
                let (weight_y, weight_z) = (slopes[1][j] * weights[2][k], weights[1][j] * slopes[2][k]);
                for i in 0..4 {
                    let c = f64::from(row[i]);
                    rows[i] += weight * c;
                    rows_y[i] += weight_y * c;
                    rows_z[i] += weight_z * c;
                }
            }
        }
        let sum = |weights: &[f64; 3], row: &[f64; 4]| weights[0] * row[0] + weights[1] * row[1] + weights[2] * row[2];
        let value = sum(&weights[0], &rows);
        let gradient = Vec3::new(sum(&slopes[0], &rows), sum(&weights[0], &rows_y), sum(&weights[0], &rows_z));
        Sample { distance: value * self.cell, gradient, beyond }
    }

    #[inline]
    pub fn touch(&self, p: &Vec3) -> Touch {
        self.sample(p).touch()
    }

    /// None where the distance is surely more than `reach`, by the node next to `p`.
    #[inline]
    pub fn touch_within(&self, p: &Vec3, reach: f64) -> Option<Touch> {
        let node = |a: usize| {
            let last = self.nodes[a] as f64 - 2.0;
            ((p[a] - self.origin[a]) * self.per_cell + 0.5).clamp(1.0, last) as u32 as usize
        };
        let value = f64::from(self.values[node(0) + self.nodes[0] * (node(1) + self.nodes[1] * node(2))]);
        // The spline is a mean of nodes at most half a step off along each axis, in the mean: √3/2 of the slope.
        let least = (value - 0.8661 * self.slope) * self.cell;
        (least <= reach).then(|| self.touch(p))
    }

    pub fn bytes(&self) -> usize {
        size_of::<Self>() + self.values.capacity() * size_of::<f32>()
    }

    /// By steps that the bounds of slope and bend allow: each ends before the distance can be down at the margin.
    pub fn first_touch(&self, from: &Vec3, to: &Vec3, margin: f64) -> Option<(f64, Touch)> {
        let way = to - from;
        let length = crate::wide_norm(&way);
        let slope = self.slope.max(1.0); // beyond the grid it is no more than the larger
        let (mut share, mut last) = (0.0, None);
        for _ in 0..STEPS {
            let p = from + share * way;
            let sample = self.sample(&p);
            let touch = sample.touch();
            let gap = touch.distance - margin;
            let falls = touch.normal.dot(&way);
            if gap <= 0.0 || (gap <= CLOSE * self.cell && falls < 0.0) {
                return (share > 0.0 || gap > 0.0).then_some((share, touch));
            }
            if share >= 1.0 || length == 0.0 {
                return None;
            }
            let step = (gap / slope).max(self.safe_step(&p, &sample, &way, gap));
            share = (share + step / length).min(1.0);
            last = Some((share, touch));
        }
        last
    }

    /// The root of gap + slope s − ½ bend s², as far as the grid reaches; 0 beyond.
    fn safe_step(&self, p: &Vec3, sample: &Sample, way: &Vec3, gap: f64) -> f64 {
        if sample.beyond != Vec3::zeros() {
            return 0.0;
        }
        let ahead = unit(way);
        let mut reach = f64::INFINITY;
        for a in 0..3 {
            let (first, last) = (0.5, self.nodes[a] as f64 - 1.5);
            let end = self.origin[a] + self.cell * if ahead[a] > 0.0 { last } else { first };
            reach = reach.min((end - p[a]) / ahead[a]); // infinite or NaN where it does not move that way
        }
        let falls = sample.gradient.dot(&ahead);
        let bend = self.bend * self.per_cell;
        let root = (falls * falls + 2.0 * bend * gap).sqrt();
        // Of the two forms of the root the one without cancellation.
        let step = if falls > 0.0 { (falls + root) / bend } else { 2.0 * gap / (root - falls) };
        step.min(reach).max(0.0)
    }
}

impl Sample {
    #[inline]
    fn touch(&self) -> Touch {
        let Self { distance, gradient, beyond } = self;
        if *beyond == Vec3::zeros() {
            return Touch { distance: *distance, normal: unit(gradient) };
        }
        // The border is outside of the mesh: the distance there is positive.
        let along = gradient.zip_map(beyond, |g, b| if b == 0.0 { g } else { 0.0 });
        let whole = (beyond.norm_squared() + distance * distance).sqrt();
        Touch { distance: whole, normal: unit(&(beyond / whole + along * (distance / whole))) }
    }
}

/// Of length 1; x of a zero.
#[inline]
fn unit(v: &Vec3) -> Vec3 {
    let norm = v.norm();
    if norm > super::primitive::NO_DIRECTION { v / norm } else { Vec3::x() }
}
