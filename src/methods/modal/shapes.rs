//! How amplitudes place single points, and the derivative of that.

use super::constraints::VertexMap;
use super::square::{self, Line, lines, lines_mut, padded, plus, sum};
use crate::Vec3;
use crate::point_energy::Point;
use crate::warp::{Basis, Entry, warp, warp_with_derivative};
use nalgebra::Matrix3;
use pulp::{Arch, Simd, WithSimd};

/// q, and what belongs to it: what vertices share there ([`VertexMap::share`]), and [`Shapes::combine`].
#[derive(Clone, Copy)]
pub struct At<'a> {
    pub q: &'a [f64],
    pub shared: &'a [Matrix3<f64>],
    pub sums: &'a [[f64; 6]],
}

/// How amplitudes place vertices, frame axes.
pub struct Placing<'a, E: Entry> {
    pub basis: &'a Basis<E>,
    /// u = R̃Φq, or u = Φq.
    pub warped: bool,
    pub rest: &'a [Vec3],
    /// What moves vertices instead.
    pub vertices: Option<&'a dyn VertexMap>,
}

impl<E: Entry> Placing<'_, E> {
    /// Sets what vertices share at `q`.
    pub fn share(&self, q: &[f64], slopes: bool, shared: &mut Vec<Matrix3<f64>>) {
        if let Some(map) = self.vertices {
            map.share(q, slopes, shared);
        }
    }

    /// p of a point.
    pub fn place_point(&self, point: &Point, shapes: &Shapes, i: usize, at: At) -> Vec3 {
        if self.vertices.is_some() {
            let rest = point.place(|v| self.rest[v]);
            let (modes, fields) = shapes.of(i).split_at(3 * at.q.len());
            let linear = modes.chunks_exact(3).zip(at.q).map(|(row, q)| *q * Vec3::from_column_slice(row));
            let beyond = fields.chunks_exact(3).zip(at.shared).map(|(row, n)| n * Vec3::from_column_slice(row));
            return linear.chain(beyond).fold(rest, |sum, part| sum + part);
        }
        let corners = point.corners().zip(&at.sums[shapes.corners(i)]);
        corners.fold(Vec3::zeros(), |sum, ((v, w), sums)| {
            let (linear, turn) = split(sums);
            sum + w * (self.rest[v] + warp(&turn, &linear, self.warped))
        })
    }

    /// Sets J to ∂p/∂q of the first `modes` amplitudes: a padded row for each axis.
    pub fn derive_point(
        &self,
        point: &Point,
        shapes: &Shapes,
        i: usize,
        at: At,
        (modes, jacobian): (usize, &mut [f64]),
    ) {
        let stride = padded(modes);
        if self.vertices.is_some() {
            jacobian.fill(0.0);
            let (linear, fields) = shapes.of(i).split_at(3 * at.q.len());
            let slopes = &at.shared[fields.len() / 3..];
            for (k, row) in linear.chunks_exact(3).enumerate().take(modes) {
                let turned = fields.chunks_exact(3).zip(slopes.iter().skip(k).step_by(modes));
                let beyond = turned.map(|(row, slope)| slope * Vec3::from_column_slice(row));
                let motion = beyond.fold(Vec3::from_column_slice(row), |sum, part| sum + part);
                (0..3).for_each(|axis| jacobian[axis * stride + k] = motion[axis]);
            }
            return;
        }
        let corners =
            point.corners().zip(&at.sums[shapes.corners(i)]).zip(shapes.of(i).chunks_exact(6 * shapes.stride));
        for (c, (((_, w), sums), rows)) in corners.enumerate() {
            let (linear, turn) = split(sums);
            let (_, by_linear, by_w) = warp_with_derivative(&turn, &linear, self.warped);
            let by = [by_linear, by_w].map(|by| if w == 1.0 { by.data.0 } else { (w * by).data.0 });
            shapes.arch.dispatch(Move { strides: [stride, shapes.stride], rows, by, anew: c == 0, jacobian });
        }
        if at.q.len() > modes {
            // Support fields, which stay.
            jacobian.chunks_exact_mut(stride).for_each(|row| row[modes..].fill(0.0));
        }
    }
}

/// Φq and Ψq of a corner.
#[inline]
fn split(sums: &[f64; 6]) -> (Vec3, Vec3) {
    (Vec3::from_column_slice(&sums[..3]), Vec3::from_column_slice(&sums[3..]))
}

/// What amplitudes move points by.
#[derive(Clone, Default)]
pub struct Shapes {
    points: Vec<Point>,
    /// Of one corner after the other six rows of all modes, of the components of φ and of ψ. Where a map moves vertices, of each point φ of each
    /// mode and each b_c, by the weights of its corners.
    rows: Vec<f64>,
    /// Where those of each point begin.
    first: Vec<usize>,
    /// Of a row.
    stride: usize,
    mapped: bool,
    /// p in whole lines.
    whole: Vec<f64>,
    arch: Arch,
}

impl Shapes {
    pub fn expect(&mut self, points: usize, modes: usize, fields: usize) {
        let corners = 2 * points; // a vertex or two
        self.points.reserve(points.saturating_sub(self.points.len()));
        self.whole.reserve(padded(modes));
        self.first.reserve((points + 1).saturating_sub(self.first.len()));
        let rows = (corners * 6 * padded(modes)).max(3 * (modes + fields) * points);
        self.rows.reserve(rows.saturating_sub(self.rows.len()));
    }

    /// Of these points; costs nothing where they are those from before.
    pub fn take<E: Entry>(&mut self, points: &[Point], placing: &Placing<E>, modes: usize) {
        if self.points == points {
            return;
        }
        self.mapped = placing.vertices.is_some();
        self.stride = padded(modes);
        let Self { points: taken, rows, first, stride, .. } = self;
        taken.clear();
        taken.extend_from_slice(points);
        first.clear();
        rows.clear();
        for point in points {
            first.push(rows.len());
            if let Some(map) = placing.vertices {
                let mean = |of: &dyn Fn(usize) -> Vec3| point.place(of);
                (0..modes).for_each(|k| rows.extend(mean(&|v| placing.basis.at(k, v).0).iter()));
                (0..map.n_fields()).for_each(|c| rows.extend(mean(&|v| map.field(c, v)).iter()));
                continue;
            }
            for &v in point.vertices() {
                let begin = rows.len();
                rows.resize(begin + 6 * *stride, 0.0);
                for k in 0..modes {
                    let (phi, psi) = placing.basis.at(k, v as usize);
                    let components = phi.iter().chain(psi.iter());
                    components.enumerate().for_each(|(c, x)| rows[begin + c * *stride + k] = *x);
                }
            }
        }
        first.push(rows.len());
    }

    fn of(&self, i: usize) -> &[f64] {
        &self.rows[self.first[i]..self.first[i + 1]]
    }

    /// Which of all corners are those of a point.
    fn corners(&self, i: usize) -> std::ops::Range<usize> {
        self.first[i] / (6 * self.stride)..self.first[i + 1] / (6 * self.stride)
    }

    /// Sets Φp and Ψp of each corner, which a map has no need of.
    pub fn combine(&mut self, p: &[f64], sums: &mut Vec<[f64; 6]>) {
        sums.clear();
        if self.mapped || self.stride == 0 {
            return;
        }
        let mut whole = std::mem::take(&mut self.whole);
        whole.clear();
        whole.extend_from_slice(p);
        whole.resize(self.stride, 0.0);
        self.arch.dispatch(Combine { shapes: self, p: lines(&whole), sums });
        self.whole = whole;
    }
}

/// Adds the motion of a corner by each mode, or begins with it.
struct Move<'a> {
    /// Of rows of J and of the corner.
    strides: [usize; 2],
    rows: &'a [f64],
    /// Columns of the derivatives by Φq and by Ψq.
    by: [[[f64; 3]; 3]; 2],
    anew: bool,
    jacobian: &'a mut [f64],
}

impl WithSimd for Move<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { strides: [stride, own], rows, by: [linear, turned], anew, jacobian } = self;
        let (phi, psi) = rows.split_at(3 * own);
        let [x, y, z] = square::rows(phi, own).map(lines);
        let [u, v, w] = square::rows(psi, own).map(lines);
        for (axis, out) in jacobian.chunks_exact_mut(stride).enumerate() {
            let ways = x.iter().zip(y).zip(z).zip(u).zip(v).zip(w);
            for (out, (((((x, y), z), u), v), w)) in lines_mut(out).iter_mut().zip(ways) {
                let begun = if anew { Line::default() } else { *out };
                let moved = plus(plus(plus(begun, linear[0][axis], *x), linear[1][axis], *y), linear[2][axis], *z);
                *out = plus(plus(plus(moved, turned[0][axis], *u), turned[1][axis], *v), turned[2][axis], *w);
            }
        }
    }
}

/// [`Shapes::combine`].
struct Combine<'a> {
    shapes: &'a Shapes,
    p: &'a [Line],
    sums: &'a mut Vec<[f64; 6]>,
}

impl WithSimd for Combine<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { shapes, p, sums } = self;
        let n = p.len();
        for rows in lines(&shapes.rows).chunks_exact(6 * n) {
            let mut all = [Line::default(); 6];
            for (l, p) in p.iter().enumerate() {
                for (c, sum) in all.iter_mut().enumerate() {
                    let row = rows[c * n + l];
                    *sum = std::array::from_fn(|i| sum[i] + row[i] * p[i]);
                }
            }
            sums.push(all.map(|line| sum(&line)));
        }
    }
}
