//! The points of a shell that contact is looked for at: free vertices, and points between them where solids are small. In patches.

use crate::point_energy::Point;
use crate::{Mesh, Shell, Vec3};

/// Probes of a patch.
const PATCH: usize = 16;
/// Probes are no farther apart than this, in radii of the smallest solid,
const APART: f64 = 1.2;
/// but where an edge would be cut into more parts.
const PARTS: usize = 4;

/// See the module's text.
pub struct Probes {
    /// Those of a patch one after another.
    pub points: Vec<Point>,
    /// What mass moves with each, at least: of the lightest corner.
    pub mass: Vec<f64>,
    /// The first probe of each patch, and their number.
    first: Vec<usize>,
    /// Of the mesh.
    pub size: f64,
    /// The radius of the smallest solid that they are for.
    pub spacing: f64,
}

/// A ball about the probes of a patch.
#[derive(Clone, Copy, Debug, Default)]
pub struct Reach {
    /// In world space.
    pub center: Vec3,
    /// Not negative.
    pub radius: f64,
    /// At a step's end: as far its probes are at most from the center and its way.
    pub from: f64,
}

impl Probes {
    /// Of a shell, for solids no smaller than with this radius. A point is a probe where a corner of its edge or triangle is free.
    pub fn new(shell: &Shell, spacing: f64) -> Self {
        let mesh = &shell.mesh;
        let mut free = vec![false; mesh.positions.len()];
        shell.free.iter().for_each(|v| free[*v as usize] = true);
        let mut points: Vec<Point> = shell.free.iter().map(|v| Point::vertex(*v)).collect();
        add_between(mesh, &free, spacing, &mut points);
        let mut places: Vec<(Vec3, Point)> =
            points.into_iter().map(|point| (point.place(|v| mesh.positions[v]), point)).collect();
        let mut first = vec![0];
        halve(&mut places, &mut first, 0);
        let points: Vec<Point> = places.into_iter().map(|(_, point)| point).collect();
        let lightest = |point: &Point| {
            let moving = point.corners().filter(|(v, w)| free[*v] && *w > 0.0);
            moving.map(|(v, _)| shell.mass[v]).fold(f64::INFINITY, f64::min)
        };
        Self { mass: points.iter().map(lightest).collect(), points, first, size: mesh.size, spacing }
    }

    /// Number of patches.
    pub fn patches(&self) -> usize {
        self.first.len() - 1
    }

    /// The probes of a patch.
    pub fn patch(&self, i: usize) -> std::ops::Range<usize> {
        self.first[i]..self.first[i + 1]
    }

    /// The patch of a probe.
    pub fn patch_of(&self, probe: usize) -> usize {
        self.first.partition_point(|first| *first <= probe) - 1
    }

    /// The ball of a patch with the vertices at `x`.
    pub fn reach(&self, patch: usize, x: &[Vec3]) -> Reach {
        let (mut low, mut high) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        for point in &self.points[self.patch(patch)] {
            let p = point.place(|v| x[v]);
            (low, high) = (low.inf(&p), high.sup(&p));
        }
        Reach { center: 0.5 * (low + high), radius: 0.5 * (high - low).norm(), from: 0.0 }
    }

    /// Sets the balls of all patches.
    pub fn measure(&self, x: &[Vec3], reach: &mut [Reach]) {
        reach.iter_mut().enumerate().for_each(|(patch, reach)| *reach = self.reach(patch, x));
    }

    /// The ball of a patch at the end of a step that it began at `start`.
    pub fn reach_after(&self, patch: usize, x: &[Vec3], start: &Reach) -> Reach {
        let end = self.reach(patch, x);
        Reach { from: (end.center - start.center).norm() + start.radius.max(end.radius), ..end }
    }

    /// Memory that it takes.
    pub fn bytes(&self) -> usize {
        self.points.len() * (size_of::<Point>() + 8) + self.first.len() * 8
    }
}

/// Adds the points of edges and within triangles.
fn add_between(mesh: &Mesh, free: &[bool], spacing: f64, points: &mut Vec<Point>) {
    let length = |a: u32, b: u32| (mesh.positions[a as usize] - mesh.positions[b as usize]).norm();
    let parts = |length: f64| (length / (APART * spacing)).ceil().clamp(1.0, PARTS as f64) as usize;
    let moves = |corners: &[u32]| corners.iter().any(|v| free[*v as usize]);
    for [a, b] in mesh.edges.iter().map(|edge| edge.vertices).filter(|corners| moves(corners)) {
        let n = parts(length(a, b));
        points.extend((1..n).map(|i| Point::between([a, b], i as f64 / n as f64)));
    }
    for corners in mesh.triangles.iter().filter(|corners| moves(&corners[..])) {
        let [a, b, c] = *corners;
        let n = parts(length(a, b).max(length(b, c)).max(length(c, a)));
        for i in 1..n {
            for j in 1..n - i {
                let [s, t] = [i, j].map(|i| i as f64 / n as f64);
                points.push(Point::within(*corners, [1.0 - s - t, s, t]));
            }
        }
    }
}

/// Orders places so that neighbours follow each other, and notes where each patch ends: by halves along the longest side.
fn halve(places: &mut [(Vec3, Point)], first: &mut Vec<usize>, begin: usize) {
    if places.len() <= PATCH {
        if !places.is_empty() {
            first.push(begin + places.len());
        }
        return;
    }
    let corner = |by: fn(&Vec3, &Vec3) -> Vec3| places.iter().map(|(x, _)| *x).reduce(|a, b| by(&a, &b));
    let (low, high) = (corner(Vec3::inf).unwrap_or_default(), corner(Vec3::sup).unwrap_or_default());
    let axis = (high - low).imax();
    places.sort_by(|a, b| a.0[axis].total_cmp(&b.0[axis])); // stable: the same order each time
    let middle = places.len() / 2;
    let (left, right) = places.split_at_mut(middle);
    halve(left, first, begin);
    halve(right, first, begin + middle);
}
