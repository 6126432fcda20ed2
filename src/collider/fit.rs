//! A capsule about points, as for the bone of a character.

use super::SIZES;
use crate::error::{Error, Result, reserve};
use crate::support::Pose;
use crate::{Vec3, rotation};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector2};

/// Rounds of tilts about both axes across, the first by [`FIRST_TILT`], each half as far as the one before where none made it smaller.
const TILTS: usize = 40;
const FIRST_TILT: f64 = 0.2;
/// Axes from which they begin: few points have several valleys.
const TILTED: usize = 5;
/// The radius grows at each step but the last: a few more than the three points that hold a circle.
const CIRCLE_STEPS: usize = 100;
/// Of the size: rounding of the pose, by which a point at the end of a long bone may come out.
const ROUNDING: f64 = 4e-15;
/// Of the size: the radius about points on a line.
const THINNEST: f64 = 1e-9;

/// About points in units of their size, along an axis.
#[derive(Clone, Copy)]
struct Fit {
    /// Its third column is the axis.
    axes: Matrix3<f64>,
    center: Vec3,
    half_length: f64,
    radius: f64,
}

/// A small [capsule](super::Solid::capsule) with all `points` inside: its pose, half length and radius.
///
/// The axis is found by tilts from several, the principal ones among them. About the axis the radius is the least, and then the length. Fails where
/// there is no point, where all are at one place, and where one is not within 1e100.
pub fn fit_capsule(points: &[Vec3]) -> Result<(Pose, f64, f64)> {
    for (i, p) in points.iter().enumerate() {
        if let Some(bad) = p.iter().find(|c| c.is_nan() || c.abs() > *SIZES.end()) {
            let limit = SIZES.end();
            return Err(Error::argument(format!(
                "point {i} of the capsule has the coordinate {bad:?}: the limit is {limit:e}"
            )));
        }
    }
    let empty = (Vec3::repeat(f64::INFINITY), Vec3::repeat(-f64::INFINITY));
    let (low, high) = points.iter().fold(empty, |(low, high), p| (low.inf(p), high.sup(p)));
    let size = if points.is_empty() { 0.0 } else { (high - low).max() };
    if !SIZES.contains(&size) {
        let (n, least, most) = (points.len(), SIZES.start(), SIZES.end());
        return Err(Error::argument(format!(
            "the {n} points of the capsule are {size:e} large: it needs {least:e} to {most:e}"
        )));
    }
    let (middle, unit) = (low + 0.5 * (high - low), 2f64.powi(libm::log2(size).ceil() as i32));
    let mut near = reserve("the points of the capsule", points.len())?;
    near.extend(points.iter().map(|p| (p - middle) / unit));
    let fit = Fit::along(&near, smallest(&near).axes);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(fit.axes));
    let pose = Pose { origin: middle + unit * fit.center, rotation };
    // By the very pose that is given back.
    let beyond = |p: &Vec3| {
        let local = pose.rotation.inverse() * ((p - pose.origin) / unit);
        Vec3::new(local.x, local.y, local.z - local.z.clamp(-fit.half_length, fit.half_length)).norm()
    };
    let reach = points.iter().map(|p| p.amax()).fold(0.0, f64::max) / unit;
    let radius = points.iter().map(beyond).fold(THINNEST, f64::max) + ROUNDING * reach.max(1.0);
    let half_length = if fit.half_length > THINNEST { fit.half_length * unit } else { 0.0 };
    let radius = radius + if half_length == 0.0 { fit.half_length } else { 0.0 };
    Ok((pose, half_length.max(0.0), (radius * unit).max(*SIZES.start())))
}

/// Of many points the farthest along each of 386 directions, in axes and lengths in which they are as far spread along each.
fn outermost(points: &[Vec3], axes: &Matrix3<f64>, spread: &Vec3) -> Vec<Vec3> {
    let lattice = || -4..=4i32;
    let all = lattice().flat_map(|x| lattice().flat_map(move |y| lattice().map(move |z| [x, y, z])));
    let directions: Vec<[i32; 3]> = all.filter(|d| d.iter().any(|c| c.abs() == 4)).collect();
    if points.len() <= directions.len() {
        return points.to_vec();
    }
    let farthest = |d: &[i32; 3]| {
        let way = axes * Vec3::from_fn(|a, _| f64::from(d[a]) / spread[a]);
        let each = points.iter().map(|p| way.dot(p)).enumerate();
        each.fold((0, f64::NEG_INFINITY), |most, next| if next.1 > most.1 { next } else { most }).0
    };
    let mut found: Vec<usize> = directions.iter().map(farthest).collect();
    found.sort_unstable();
    found.dedup();
    found.into_iter().map(|i| points[i]).collect()
}

/// Of those along the axes, edges and corners of a cube that lies along the principal axes, the smallest few, each tilted until no tilt makes
/// it smaller.
fn smallest(points: &[Vec3]) -> Fit {
    let mean = points.iter().sum::<Vec3>() / points.len() as f64;
    let spread: Matrix3<f64> = points.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
    let eigen = spread.symmetric_eigen();
    let (axes, most) = (eigen.eigenvectors, eigen.eigenvalues.max());
    let points = &outermost(points, &axes, &eigen.eigenvalues.map(|value| value.max(1e-12 * most).sqrt()));
    let mut fits: Vec<Fit> = (14..27)
        .map(|i| {
            let way = Vec3::from_fn(|a, _| (i / [1, 3, 9][a] % 3) as f64 - 1.0); // one of each and its opposite
            let along = (axes * way).normalize();
            let across = along.cross(&axes.column((way.iamin() + 1) % 3).into_owned());
            let u = if across.norm() > 0.5 { across } else { along.cross(&axes.column(way.iamin()).into_owned()) }
                .normalize();
            Fit::along(points, Matrix3::from_columns(&[u, along.cross(&u), along]))
        })
        .collect();
    fits.sort_by(|a, b| a.volume().total_cmp(&b.volume()));
    fits.truncate(TILTED);
    let tilted = fits.iter().map(|fit| tilted(points, fit.axes));
    tilted.reduce(|best, fit| if fit.volume() < best.volume() { fit } else { best }).expect("there are some")
}

fn tilted(points: &[Vec3], axes: Matrix3<f64>) -> Fit {
    let mut best = Fit::along(points, axes);
    let mut tilt = FIRST_TILT;
    for _ in 0..TILTS {
        let before = best.volume();
        for (x, y) in [(tilt, 0.0), (-tilt, 0.0), (0.0, tilt), (0.0, -tilt)] {
            let turn = rotation::by(&Vec3::new(x, y, 0.0)).to_rotation_matrix();
            let fit = Fit::along(points, best.axes * turn.matrix());
            if fit.volume() < best.volume() {
                best = fit;
            }
        }
        if best.volume() >= before * (1.0 - 1e-3) {
            tilt *= 0.5;
        }
    }
    best
}

impl Fit {
    fn along(points: &[Vec3], axes: Matrix3<f64>) -> Self {
        let [u, v, w] = [0, 1, 2].map(|k| axes.column(k).into_owned());
        let across = |p: &Vec3| Vector2::new(u.dot(p), v.dot(p));
        let (middle, radius) = circle(points.len(), |i| across(&points[i]));
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for p in points {
            // As far as the round end about it reaches.
            let room = (radius * radius - (across(p) - middle).norm_squared()).max(0.0).sqrt();
            (low, high) = (low.min(w.dot(p) + room), high.max(w.dot(p) - room));
        }
        let center = u * middle.x + v * middle.y + w * (0.5 * (low + high));
        Self { axes, center, half_length: (0.5 * (high - low)).max(0.0), radius }
    }

    /// Over 2π.
    fn volume(&self) -> f64 {
        self.radius * self.radius * (2.0 / 3.0 * self.radius + self.half_length)
    }
}

/// The least circle about points: that of at most three of them, with the farthest point outside of it, until there is none.
fn circle(n: usize, point: impl Fn(usize) -> Vector2<f64>) -> (Vector2<f64>, f64) {
    let mut held = vec![point(0)];
    let (mut center, mut radius) = (point(0), 0.0);
    for _ in 0..CIRCLE_STEPS {
        let far = |i: usize| (point(i) - center).norm();
        let (next, most) =
            (0..n).map(|i| (i, far(i))).fold((0, -1.0), |most, next| if next.1 > most.1 { next } else { most });
        if most <= radius * (1.0 + 1e-12) {
            break;
        }
        held.push(point(next));
        (center, radius, held) = circle_of_few(&held);
    }
    let most = (0..n).map(|i| (point(i) - center).norm()).fold(0.0, f64::max);
    (center, most)
}

/// The least of the circles of two and three of at most four points that has all of them, and those two or three.
fn circle_of_few(points: &[Vector2<f64>]) -> (Vector2<f64>, f64, Vec<Vector2<f64>>) {
    let mut best = (points[0], f64::INFINITY, points.to_vec());
    let mut look_at = |center: Vector2<f64>, of: &[Vector2<f64>]| {
        let radius = points.iter().map(|p| (p - center).norm()).fold(0.0, f64::max);
        if radius < best.1 {
            best = (center, radius, of.to_vec());
        }
    };
    for i in 0..points.len() {
        for j in 0..i {
            look_at(0.5 * (points[i] + points[j]), &[points[i], points[j]]);
            for k in 0..j {
                let (a, b) = (points[j] - points[i], points[k] - points[i]);
                let area = 2.0 * a.perp(&b);
                let (s, t) = (a.norm_squared(), b.norm_squared());
                let off = Vector2::new(b.y * s - a.y * t, a.x * t - b.x * s) / area;
                if off.iter().all(|c| c.is_finite()) {
                    look_at(points[i] + off, &[points[i], points[j], points[k]]);
                }
            }
        }
    }
    best
}
