//! Solids that shells touch: where a point is to their surface.
//!
//!   d(p) > 0 outside, < 0 inside;   n(p) = ∇d, of length 1;   |d(p) − d(q)| ≤ |p − q|
//!
//! [`Solid`] says where this holds but nearly. A solid is immutable, but for a mesh that moves, and knows only its own axes: what has one also has its pose, its friction and its thickness.

mod bake;
mod fit;
mod grid;
mod hull;
mod moving;
mod primitive;
mod saved;
mod sheet;
mod surface;
mod sweep;
mod tree;
mod triangle;

pub use bake::{GridOptions, Resolution};
pub use fit::fit_capsule;
pub(crate) use tree::{Nearest, Tree, sort as sort_triangles};

use crate::error::require_non_negative;
use crate::{Error, Result, Vec3};
use grid::Grid;
use hull::Hull;
use moving::Moving;
use primitive::{Capsule, Cuboid};
use sheet::Sheet;
use surface::Surface;

/// Where a point is to a solid's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// From the surface; negative inside.
    pub distance: f64,
    /// Outward, of length 1: the gradient of the distance.
    pub normal: Vec3,
}

/// All points that are no farther from `center` than `radius`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// In the solid's axes.
    pub center: Vec3,
    /// Not negative.
    pub radius: f64,
}

/// A body. Send and Sync: share it by an `Arc`.
///
/// | | distance | convex | changes by no more than the way |
/// |---|---|---|---|
/// | plane, sphere, capsule, box | exact | yes | yes |
/// | hull | exact | yes | yes |
/// | moving mesh | exact | no | yes, but where the mesh meets itself |
/// | one-sided moving mesh | exact | no | yes, but where a back meets a front |
/// | grid | within half a cell; to third order where it is smooth | no | by 1.4 times the way at sharp corners |
#[derive(Clone, Debug)]
pub struct Solid {
    shape: Shape,
}

#[derive(Clone, Debug)]
enum Shape {
    Plane,
    Sphere(f64),
    Capsule(Capsule),
    Cuboid(Cuboid),
    Grid(Box<Grid>),
    Hull(Box<Hull>),
    Moving(Box<Moving>),
    Sheet(Box<Sheet>),
}

/// Sizes whose squares, and those of points that matter beside them, are normal numbers.
const SIZES: std::ops::RangeInclusive<f64> = 1e-100..=1e100;
/// Points farther away along an axis are taken to be here, so that no square overflows.
const FAR: f64 = 1e150;

impl Solid {
    /// The half-space z ≤ 0.
    pub fn plane() -> Self {
        Self { shape: Shape::Plane }
    }

    /// A ball about the origin. Fails unless its radius is within 1e-100 and 1e100.
    pub fn sphere(radius: f64) -> Result<Self> {
        Ok(Self { shape: Shape::Sphere(require_size("the sphere's radius", radius)?) })
    }

    /// All points within `radius` of the segment from −`half_length` to `half_length` along z, which may be 0.
    pub fn capsule(half_length: f64, radius: f64) -> Result<Self> {
        let half_length = match half_length {
            0.0 => 0.0, // a sphere
            half => require_size("the capsule's half length", half)?,
        };
        let radius = require_size("the capsule's radius", radius)?;
        Ok(Self { shape: Shape::Capsule(Capsule { half_length, radius }) })
    }

    /// A box about the origin, `half` as long along each axis to either side.
    pub fn cuboid(half: Vec3) -> Result<Self> {
        for (axis, half) in ["x", "y", "z"].iter().zip(&half) {
            require_size(format_args!("the box's half extent along {axis}"), *half)?;
        }
        Ok(Self { shape: Shape::Cuboid(Cuboid { half }) })
    }

    /// The convex hull of points, with an exact distance. A touch tests all its planes: more than 512 triangles are refused, and points that lie
    /// in a plane, on a line or at one place. Of points within a rounding of a plane some may be left outside, by 1e-5 of its size at most.
    pub fn hull(points: &[Vec3]) -> Result<Self> {
        Ok(Self { shape: Shape::Hull(Box::new(Hull::of(points)?)) })
    }

    /// All within a closed triangle mesh whose vertices move: where they were and where they are. Then [`Solid::update`] gives the next shape.
    ///
    /// The mesh is checked as for a [grid](Solid::grid), once. The distance is exact and 1-Lipschitz as long as the mesh does not meet itself;
    /// where it does, the sign is that of the nearest triangle. A touch searches a tree of boxes, an update fits these anew.
    pub fn moving_mesh(before: &[Vec3], after: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self> {
        Ok(Self { shape: Shape::Moving(Box::new(Moving::of(before, after, triangles)?)) })
    }

    /// All within a closed triangle mesh, as distances on a grid whose value and gradient are continuous.
    ///
    /// Every edge needs two triangles. Vertices at the same place count as one where that closes the mesh, and triangles that disagree with
    /// most of their piece are turned. Triangles may have no area, pieces may overlap, and a piece that is turned inside out within another
    /// is a hollow. Refused with the place: open edges, edges of more than two triangles, one-sided strips, a mesh or a piece that is
    /// inside out, and one that lies between all nodes. Parts thinner than two cells come out too thin or not at all:
    /// [`Solid::surface_error`] tells.
    ///
    /// The distance is off by a share of a cell at creases, and by the third power of the cell's share of a radius of curvature elsewhere. It
    /// changes by up to 1.4 times the way at sharp corners. Beyond the mesh's box and four cells, or the `margin`, it is a lower
    /// bound and its gradient points there only roughly.
    pub fn grid(positions: &[Vec3], triangles: &[[u32; 3]], options: &GridOptions) -> Result<Self> {
        let surface = Surface::closed(positions, triangles)?;
        Ok(Self { shape: Shape::Grid(Box::new(bake::bake(&surface, options)?)) })
    }

    /// All that is behind a triangle mesh by no more than `depth`, whose vertices move: a mesh that may be open. Its front is where its triangles run
    /// counterclockwise. A depth of 0 is a 16th of the longest side of the mesh.
    ///
    /// A place is behind where its nearest point of the mesh is in front of it and not on the rim: however sharp the mesh is bent, the front is right, and the
    /// distance exact. A mesh that is closed and not inside out is [`Solid::moving_mesh`], with all its inside.
    pub fn one_sided_moving_mesh(before: &[Vec3], after: &[Vec3], triangles: &[[u32; 3]], depth: f64) -> Result<Self> {
        let depth = require_non_negative("the depth of the one-sided mesh", depth)?;
        if let Ok(mesh) = Moving::of(before, after, triangles) {
            return Ok(Self { shape: Shape::Moving(Box::new(mesh)) });
        }
        Ok(Self { shape: Shape::Sheet(Box::new(Sheet::of(before, after, triangles, depth)?)) })
    }

    /// The same on a grid, as [`Solid::grid`] of a closed mesh. A depth of 0 is four cells, and it must be two or more.
    pub fn one_sided_grid(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        depth: f64,
        options: &GridOptions,
    ) -> Result<Self> {
        let depth = require_non_negative("the depth of the one-sided mesh", depth)?;
        let grid = match Surface::closed(positions, triangles) {
            Ok(surface) => bake::bake(&surface, options)?,
            Err(_) => bake::bake_one_sided(positions, triangles, depth, options)?,
        };
        Ok(Self { shape: Shape::Grid(Box::new(grid)) })
    }

    /// Finite whatever `p` is, and the normal of length 1. Where several normals are right, as at a centre, it is always the same of them.
    #[inline]
    pub fn touch(&self, p: &Vec3) -> Touch {
        let p = near(p);
        match &self.shape {
            Shape::Plane => Touch { distance: p.z, normal: Vec3::z() },
            Shape::Sphere(radius) => primitive::ball(&p, *radius),
            Shape::Capsule(capsule) => capsule.touch(&p),
            Shape::Cuboid(cuboid) => cuboid.touch(&p),
            Shape::Grid(grid) => grid.touch(&p),
            Shape::Hull(hull) => hull.touch(&p),
            Shape::Moving(mesh) => mesh.touch(&p),
            Shape::Sheet(sheet) => sheet.touch(&p),
        }
    }

    /// As [`Solid::touch`], for whoever needs no touch farther than `reach`: None there, at a fraction of the cost mostly.
    #[inline]
    pub fn touch_within(&self, p: &Vec3, reach: f64) -> Option<Touch> {
        let at = near(p);
        let touch = match &self.shape {
            Shape::Grid(grid) => grid.touch_within(&at, reach)?,
            Shape::Hull(hull) => hull.touch_within(&at, reach)?,
            Shape::Moving(mesh) => mesh.touch_within(&at, reach)?,
            Shape::Sheet(sheet) => sheet.touch_within(&at, reach)?,
            _ => self.touch(p),
        };
        (touch.distance <= reach).then_some(touch)
    }

    /// A ball about all of it; None of a plane.
    pub fn bounds(&self) -> Option<Ball> {
        let about_origin = |radius| Some(Ball { center: Vec3::zeros(), radius });
        match &self.shape {
            Shape::Plane => None,
            Shape::Sphere(radius) => about_origin(*radius),
            Shape::Capsule(Capsule { half_length, radius }) => about_origin(half_length + radius),
            Shape::Cuboid(Cuboid { half }) => about_origin(half.norm()),
            Shape::Grid(grid) => Some(grid.ball),
            Shape::Hull(hull) => Some(hull.ball),
            Shape::Moving(mesh) => Some(mesh.ball),
            Shape::Sheet(sheet) => Some(sheet.ball),
        }
    }

    /// Radius of the largest ball within its thinnest part; infinite of a plane. A step shorter than this does not leap through.
    /// Of a mesh, half the thickness between sides that face each other by more than 67°; of a moving one, in its first shape.
    pub fn inner_radius(&self) -> f64 {
        match &self.shape {
            Shape::Plane => f64::INFINITY,
            Shape::Sphere(radius) | Shape::Capsule(Capsule { radius, .. }) => *radius,
            Shape::Cuboid(Cuboid { half }) => half.min(),
            Shape::Grid(grid) => grid.inner_radius,
            Shape::Hull(hull) => hull.inner_radius,
            Shape::Moving(mesh) => mesh.inner_radius,
            Shape::Sheet(sheet) => sheet.mesh.inner_radius,
        }
    }

    /// By how much its distance changes with the way to another place, at most: that of a grid, which is interpolated, by up to 1.4 times the way.
    pub fn slope(&self) -> f64 {
        if matches!(self.shape, Shape::Grid(_)) { 1.5 } else { 1.0 }
    }

    /// The largest distance that a grid has for a vertex or the middle of a triangle of its mesh, where it should be zero; 0 of other solids.
    pub fn surface_error(&self) -> f64 {
        match &self.shape {
            Shape::Grid(grid) => grid.surface_error,
            _ => 0.0,
        }
    }

    /// How far the matter at the surface next to `p` came since the shape before, in the solid's axes. Zero of what does not deform.
    pub fn slip(&self, p: &Vec3) -> Vec3 {
        match &self.shape {
            Shape::Moving(mesh) => mesh.slip(&near(p)),
            Shape::Sheet(sheet) => sheet.mesh.slip(&near(p)),
            _ => Vec3::zeros(),
        }
    }

    /// The next shape of a [moving mesh](Solid::moving_mesh), with as many positions as the first; the present one becomes the one before.
    /// Allocates nothing. Fails without changing anything, and of other solids.
    pub fn update(&mut self, positions: &[Vec3]) -> Result<()> {
        match &mut self.shape {
            Shape::Moving(mesh) => mesh.update(positions),
            Shape::Sheet(sheet) => sheet.update(positions),
            _ => Err(Error::new(crate::ErrorKind::Unsupported, "only a moving mesh takes new positions")),
        }
    }

    /// Whether it has another shape than before.
    pub fn deforms(&self) -> bool {
        match &self.shape {
            Shape::Moving(mesh) => mesh.moved,
            Shape::Sheet(sheet) => sheet.mesh.moved,
            _ => false,
        }
    }

    /// As [`Solid::update`], but the shape before stays where there is one since the last [`Solid::arrive`].
    pub fn lead(&mut self, positions: &[Vec3]) -> Result<()> {
        match &mut self.shape {
            Shape::Moving(mesh) => mesh.replace(positions),
            Shape::Sheet(sheet) => sheet.replace(positions),
            _ => self.update(positions),
        }
    }

    /// The present shape becomes the one before.
    pub fn arrive(&mut self) {
        match &mut self.shape {
            Shape::Moving(mesh) => mesh.arrive(),
            Shape::Sheet(sheet) => sheet.mesh.arrive(),
            _ => (),
        }
    }

    /// Memory that it takes.
    pub fn bytes(&self) -> usize {
        size_of::<Self>()
            + match &self.shape {
                Shape::Plane | Shape::Sphere(_) | Shape::Capsule(_) | Shape::Cuboid(_) => 0,
                Shape::Grid(grid) => grid.bytes(),
                Shape::Hull(hull) => hull.bytes(),
                Shape::Moving(mesh) => mesh.bytes(),
                Shape::Sheet(sheet) => sheet.bytes(),
            }
    }

    /// The first place on the way from `from` to `to` where the distance is no more than `margin`: the share of the way, and the touch there.
    ///
    /// None where the way starts within the margin, never gets there, or has an end beyond 1e150.
    /// However thin the solid and long the way, it is not leapt over.
    pub fn first_touch(&self, from: &Vec3, to: &Vec3, margin: f64) -> Option<(f64, Touch)> {
        let near = from.iter().chain(to).chain([&margin]).all(|x| x.abs() <= FAR); // no NaN is
        match &self.shape {
            _ if !near => None,
            Shape::Grid(grid) => grid.first_touch(from, to, margin),
            Shape::Moving(mesh) => mesh.first_touch(from, to, margin),
            Shape::Sheet(sheet) => sheet.first_touch(from, to, margin),
            _ => sweep::convex(|p| self.touch(p), from, to, margin),
        }
    }
}

/// Numbers whose squares are numbers.
#[inline]
fn near(p: &Vec3) -> Vec3 {
    p.map(|c| if c.is_nan() { -FAR } else { c.clamp(-FAR, FAR) })
}

/// Fails with the name and value unless it is a size within [`SIZES`].
fn require_size(name: impl std::fmt::Display, value: f64) -> Result<f64> {
    if SIZES.contains(&value) {
        Ok(value)
    } else {
        let (least, most) = (SIZES.start(), SIZES.end());
        Err(Error::argument(format!("{name} is {value:?}: it must be from {least:e} to {most:e}")))
    }
}
