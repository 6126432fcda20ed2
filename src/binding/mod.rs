//! Points that follow a shell: what is drawn, where another mesh is simulated.
//!
//!   x = X + Σᵢ [aᵢ uᵢ + (Fᵢ − 1) gᵢ],   gᵢ = Σⱼ dᵢⱼ (Xⱼ − Xᵢ) + bᵢ r,   r = X − Σ bᵢ Xᵢ
//!
//! over the corners i of the triangle where X stands at rest. uᵢ are the corners' displacements and Fᵢ turns the shell's tangents and normal
//! there (`frames`). a, d belong to a surface with a continuous normal through the corners (`patch`), b are barycentric (`foot`). So a point
//! costs the same whatever the method and the number of modes. A shell at rest leaves points where they are to the last bit, and a
//! rigid motion carries them rigidly. On a flat mesh quadratic motions are met exactly.

mod foot;
mod frames;
mod patch;
mod saved;
mod sums;

use crate::error::{reserve, try_zeroed};
use crate::{Error, ErrorKind, Mesh, Result, Shell, Vec3, wide_norm};
use foot::Ground;
use frames::{Followed, Frames};
use patch::{Patch, slope};
use pulp::Arch;
use std::ops::Range;
use std::sync::Arc;
use sums::{applied, sums};

/// A point further off than this, in sizes of the mesh, belongs to no shell.
const FURTHEST: f64 = 1e6;

/// Points to be bound, in the axes of the mesh at rest.
#[derive(Clone, Copy, Default)]
pub struct Points<'a> {
    /// Where they are.
    pub positions: &'a [Vec3],
    /// Normals of what is drawn, of any length but zero, or none.
    pub normals: Option<&'a [Vec3]>,
    /// Tangents across these, or none.
    pub tangents: Option<&'a [Vec3]>,
    /// No point may be further from the mesh; 0 for any.
    pub max_distance: f64,
}

/// By what a point or a direction follows the three corners: factors of displacement and of the changes of t₁, t₂ and n.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(64))]
struct Row {
    factors: [[f32; 4]; 3],
    corners: [u32; 3],
}

/// Directions of a point at rest, and by what they follow.
#[derive(Clone, Copy, Default)]
struct Turning {
    /// A tangent, and the normal times it.
    rest: [[f64; 3]; 2],
    /// As of a row.
    factors: [[[f32; 4]; 3]; 2],
    corners: [u32; 3],
}

impl Turning {
    fn new(rest: [[f64; 3]; 2], rows: [Row; 2]) -> Self {
        Self { rest, factors: rows.map(|row| row.factors), corners: rows[0].corners }
    }
}

/// Points bound to a mesh. Immutable, shared by states and threads.
pub struct Binding {
    mesh: Arc<Mesh>,
    /// The shape that the points were bound to: the mesh, or of a shell with sag the shape of no energy.
    base: Arc<[Vec3]>,
    frames: Frames,
    rest: Vec<[f64; 3]>,
    rows: Vec<Row>,
    /// Empty without normals and tangents.
    turning: Vec<Turning>,
    has: [bool; 2],
    /// Of any point from the mesh, and which.
    furthest: (f64, u32),
    /// Of any point and any coordinate, and the largest sum of a row's factors.
    reach: f64,
    gain: f64,
}

/// The shell as the points of a binding see it at one time.
pub struct Pose<'a> {
    binding: &'a Binding,
    followed: Vec<Followed>,
    rates: Vec<Followed>,
    /// What sums are by instructions of; these are the same in all, as nothing is summed across registers.
    arch: Arch,
}

fn name(what: &str, i: usize, v: &Vec3) -> String {
    format!("{what}[{i}] is ({:?}, {:?}, {:?})", v.x, v.y, v.z)
}

fn check(what: &str, n: usize, values: &[Vec3]) -> Result<()> {
    if values.len() != n {
        return Err(Error::argument(format!("{} {what} for {n} points", values.len())));
    }
    match values.iter().position(|v| !v.iter().all(|c| c.is_finite())) {
        Some(i) => Err(Error::argument(format!("{}: it must be finite", name(what, i, &values[i])))),
        None => Ok(()),
    }
}

/// Unit vectors, whatever their length.
fn directions(what: &str, values: &[Vec3]) -> Result<Vec<Vec3>> {
    let mut out = reserve(what, values.len())?;
    for (i, v) in values.iter().enumerate() {
        match (v / v.amax()).try_normalize(0.0) {
            Some(unit) if unit.iter().all(|c| c.is_finite()) => out.push(unit),
            _ => return Err(Error::argument(format!("{}: it has no direction", name(what, i, v)))),
        }
    }
    Ok(out)
}

/// What is precomputed for the points of one mesh.
struct Maker<'a> {
    positions: &'a [Vec3],
    frames: &'a Frames,
    ground: Ground<'a>,
}

impl Maker<'_> {
    fn row(&self, corners: [u32; 3], a: [f64; 3], g: [Vec3; 3]) -> Row {
        let factors = std::array::from_fn(|i| {
            let along = self.frames.components(corners[i], &g[i]);
            [a[i], along.x, along.y, along.z].map(|c| c as f32)
        });
        Row { factors, corners }
    }

    /// Rows of the point and of the directions, and how far the point is from the mesh.
    fn bind<const N: usize>(&self, p: &Vec3, directions: [Vec3; N]) -> (Row, [Row; N], f64) {
        let foot = self.ground.foot(p);
        let x = foot.vertices.map(|v| self.positions[v as usize]);
        let (b, patch) = (foot.weights, Patch::new(&x));
        let off = p - (0..3).map(|i| b[i] * x[i]).sum::<Vec3>();
        let sides = |data: &patch::Data, i: usize| -> Vec3 {
            (0..2).map(|which| data[slope(i, which)] * (x[(i + 1 + which) % 3] - x[i])).sum()
        };
        let [here, _] = patch.at(&b, &[0.0; 3]);
        let g = std::array::from_fn(|i| sides(&here, i) + b[i] * off);
        let row = self.row(foot.vertices, [here[0], here[1], here[2]], g);
        let turned = directions.map(|direction| {
            let rate = self.ground.rates(&foot, &direction);
            let [_, moving] = patch.at(&b, &rate);
            let off_rate = direction - (0..3).map(|i| rate[i] * x[i]).sum::<Vec3>();
            let g = std::array::from_fn(|i| sides(&moving, i) + rate[i] * off + b[i] * off_rate);
            self.row(foot.vertices, [moving[0], moving[1], moving[2]], g)
        });
        (row, turned, off.norm())
    }
}

/// A tangent and the normal times it.
fn axes(normal: Option<&Vec3>, tangent: Option<&Vec3>) -> Option<[Vec3; 2]> {
    let (normal, first) = match (normal, tangent) {
        (Some(n), Some(t)) => (*n, t - n * n.dot(t)),
        (Some(n), None) => (*n, n.cross(&Vec3::ith(n.iamin(), 1.0))),
        (None, Some(t)) => (t.cross(&Vec3::ith(t.iamin(), 1.0)), *t),
        (None, None) => return None,
    };
    let first = first.try_normalize(1e-9)?;
    Some([first, normal.cross(&first).normalize()])
}

impl Binding {
    /// Binds points to the rest shape of a shell. Fails on points that are not finite, further off than they may be, or not near the mesh at all.
    pub fn new(shell: &Shell, points: &Points) -> Result<Self> {
        let n = points.positions.len();
        if n == 0 || n > u32::MAX as usize {
            return Err(Error::argument(format!("{n} points: 1 to {} can be bound", u32::MAX)));
        }
        check("points", n, points.positions)?;
        let unit = |what: &str, values: Option<&[Vec3]>| -> Result<Option<Vec<Vec3>>> {
            let Some(values) = values else { return Ok(None) };
            check(what, n, values)?;
            directions(what, values).map(Some)
        };
        let (normals, tangents) = (unit("normals", points.normals)?, unit("tangents", points.tangents)?);
        let mut bound = Self::empty(shell)?;
        bound.has = [normals.is_some(), tangents.is_some()];
        let size = bound.mesh.size;
        let scaled: Vec<Vec3> = scaled(&bound.base, size)?;
        let up: Vec<Vec3> = (0..scaled.len()).map(|v| bound.frames.normal(v as u32)).collect();
        let ground = Ground::new(&scaled, &up, &bound.mesh.triangles)?;
        let maker = Maker { positions: &scaled, frames: &bound.frames, ground };
        let (mut rest, mut rows) = (reserve("the points", n)?, reserve("the points", n)?);
        let mut turning = reserve("the points' directions", if bound.has == [false; 2] { 0 } else { n })?;
        let limit = if points.max_distance > 0.0 { points.max_distance } else { FURTHEST * size };
        for (i, x) in points.positions.iter().enumerate() {
            let far = |how: f64| {
                let place = name("points", i, x);
                Error::argument(format!("{place}: it is {how:.3e} from the mesh, further than {limit:.3e}"))
            };
            let p = x / size;
            if !wide_norm(&p).is_finite()
                || wide_norm(&(p - scaled[bound.mesh.triangles[0][0] as usize])) > 2.0 * FURTHEST
            {
                return Err(far(wide_norm(&(x - bound.base[bound.mesh.triangles[0][0] as usize]))));
            }
            let at = |of: &Option<Vec<Vec3>>| of.as_ref().map(|of| of[i]);
            let (row, distance) = match axes(at(&normals).as_ref(), at(&tangents).as_ref()) {
                Some(axes) => {
                    let (row, rows, distance) = maker.bind(&p, axes);
                    turning.push(Turning::new(axes.map(Into::into), rows));
                    (row, distance)
                }
                None if bound.has != [false; 2] => {
                    let place = name("tangents", i, &tangents.as_ref().map_or(Vec3::zeros(), |of| of[i]));
                    return Err(Error::argument(format!("{place}: it runs along the point's normal")));
                }
                None => {
                    let (row, [], distance) = maker.bind(&p, []);
                    (row, distance)
                }
            };
            let distance = distance * size;
            if distance > limit {
                return Err(far(distance));
            }
            if distance > bound.furthest.0 {
                bound.furthest = (distance, i as u32);
            }
            rest.push((*x).into());
            rows.push(row);
        }
        (bound.rest, bound.rows, bound.turning) = (rest, rows, turning);
        bound.measured()
    }

    /// To the shell's mesh, without points.
    fn empty(shell: &Shell) -> Result<Self> {
        let mesh = shell.mesh.clone();
        let base: Arc<[Vec3]> = shell.given().into();
        let frames = Frames::new(&mesh, &scaled(&base, mesh.size)?)?;
        let (rest, rows, turning) = (vec![], vec![], vec![]);
        let (furthest, has) = ((0.0, 0), [false; 2]);
        Ok(Self { mesh, base, frames, rest, rows, turning, has, furthest, reach: 0.0, gain: 0.0 })
    }

    /// With how far its points can get. Fails where a factor is no number, or as large as no point needs.
    fn measured(mut self) -> Result<Self> {
        self.reach = self.rest.iter().flatten().map(|c| c.abs()).fold(0.0, f64::max);
        let sum = |factors: &[[f32; 4]; 3]| factors.iter().flatten().map(|c| f64::from(c.abs())).sum::<f64>();
        for (i, row) in self.rows.iter().enumerate() {
            let turning = self.turning.get(i).map_or(&[][..], |turning| &turning.factors);
            let gain = turning.iter().map(sum).fold(sum(&row.factors), |a, b| if b <= a { a } else { b });
            let bounded = gain <= LARGEST_GAIN;
            if !bounded {
                let place = format!("point {i} cannot be bound to triangle {:?} of the mesh", row.corners);
                return Err(Error::new(
                    ErrorKind::Numerical,
                    format!("{place}: it is too thin or too sharply bent there"),
                ));
            }
            self.gain = self.gain.max(gain);
        }
        Ok(self)
    }

    /// Number of points.
    pub fn n_points(&self) -> usize {
        self.rest.len()
    }

    /// Whether it has normals, and tangents.
    pub fn has(&self) -> [bool; 2] {
        self.has
    }

    /// The point furthest from the mesh: how far it is, and its number.
    pub fn furthest(&self) -> (f64, u32) {
        self.furthest
    }

    /// Memory that it holds.
    pub fn bytes(&self) -> usize {
        self.rest.capacity() * size_of::<[f64; 3]>()
            + self.rows.capacity() * size_of::<Row>()
            + self.turning.capacity() * size_of::<Turning>()
            + self.base.len() * size_of::<Vec3>()
            + self.frames.bytes()
    }

    /// Whether a support holds all that a point follows, of a shell that these vertices are held of.
    pub fn is_held(&self, point: usize, held: &[bool]) -> bool {
        self.rows[point].corners.iter().all(|v| held[*v as usize])
    }

    /// Whether a shell has the mesh that the points are bound to.
    pub fn fits(&self, shell: &Shell) -> bool {
        let base = shell.given();
        Arc::ptr_eq(&self.mesh, &shell.mesh) || (*self.base == *base && self.mesh.triangles == shell.mesh.triangles)
    }

    /// The shell at deformed `positions` (n_vertices, axes of the rest shape), with the vertices' velocities where points' are wanted.
    pub fn pose(&self, mut positions: Vec<Vec3>, velocities: Option<&mut [Vec3]>) -> Result<Pose<'_>> {
        let size = self.mesh.size;
        for (x, rest) in positions.iter_mut().zip(&*self.base) {
            *x = (*x - rest) / size;
        }
        let followed = self.frames.follow(&positions)?;
        let rates = match velocities {
            Some(velocities) => {
                velocities.iter_mut().for_each(|v| *v /= size);
                self.frames.follow_rates(&positions, velocities)?
            }
            None => vec![],
        };
        Ok(Pose { binding: self, followed, rates, arch: Arch::new() })
    }
}

/// More than a thousand times what a point as far off as it may be needs.
const LARGEST_GAIN: f64 = 1e10;

fn scaled(positions: &[Vec3], size: f64) -> Result<Vec<Vec3>> {
    let mut out = try_zeroed("the mesh in its size", positions.len())?;
    out.iter_mut().zip(positions).for_each(|(x, position): (&mut Vec3, _)| *x = position / size);
    Ok(out)
}

/// Of length 1; zero where it has no direction.
#[inline(always)]
fn unit(v: Vec3) -> Vec3 {
    let length = v.norm_squared().sqrt();
    if length > 0.0 { v * (1.0 / length) } else { Vec3::zeros() }
}

impl Pose<'_> {
    fn bound(&self, followed: &[Followed]) -> f64 {
        let larger = |a: f32, b: f32| if b <= a { a } else { b }; // and no number is
        let largest = followed.iter().flatten().flatten().map(|c| c.abs()).fold(0f32, larger);
        self.binding.mesh.size * self.binding.gain * f64::from(largest)
    }

    /// A bound of every coordinate of a point.
    pub fn reach(&self) -> f64 {
        self.binding.reach + self.bound(&self.followed)
    }

    /// A bound of every component of a velocity.
    pub fn speed(&self) -> f64 {
        self.bound(&self.rates)
    }

    /// Where the points of a range are.
    pub fn positions(&self, points: Range<usize>, mut write: impl FnMut(usize, Vec3)) {
        let (bound, size, first) = (self.binding, self.binding.mesh.size, points.start);
        let rest = &bound.rest[points.clone()];
        sums(self.arch, &bound.rows[points], &self.followed, |i, [u]| {
            write(first + i, Vec3::from_fn(|c, _| rest[i][c] + size * f64::from(u[c])));
        });
    }

    /// Where they are, and their velocities; zero where the pose was made without.
    pub fn velocities(&self, points: Range<usize>, mut write: impl FnMut(usize, Vec3, Vec3)) {
        let size = self.binding.mesh.size;
        self.positions(points, |i, x| {
            let [v] = match self.rates.is_empty() {
                true => [[0.0; 4]],
                false => applied(&self.binding.rows[i], &self.rates),
            };
            write(i, x, Vec3::from_fn(|c, _| size * f64::from(v[c])));
        });
    }

    /// Hands what became of points' two directions to `take`.
    fn turned(&self, points: Range<usize>, mut take: impl FnMut(usize, [Vec3; 2])) {
        let first = points.start;
        let turning = &self.binding.turning[points];
        sums(self.arch, turning, &self.followed, |i, changes| {
            let rest = &turning[i].rest;
            take(first + i, [0, 1].map(|k| Vec3::from_fn(|c, _| rest[k][c] + f64::from(changes[k][c]))));
        });
    }

    /// Their unit normals, across the deformed tangents; zero where these span nothing. Of a binding that has any.
    pub fn normals(&self, points: Range<usize>, mut write: impl FnMut(usize, Vec3)) {
        self.turned(points, |i, [t, s]| write(i, unit(t.cross(&s))));
    }

    /// Their unit tangents; zero where they have no length. Of a binding that has any.
    pub fn tangents(&self, points: Range<usize>, mut write: impl FnMut(usize, Vec3)) {
        self.turned(points, |i, [t, _]| write(i, unit(t)));
    }
}
