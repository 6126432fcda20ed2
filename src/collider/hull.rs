//! The convex hull of points: planes for the inside, the nearest triangle for the outside.

use super::moving::Rim;
use super::surface::{FARTHEST, ball_about, check_sides};
use super::tree::{self, FAR_OFF, Nearest, Tree, corners};
use super::{Ball, SIZES, Touch};
use crate::Vec3;
use crate::error::{Error, Result, invalid, reserve};

/// More would be slower than a grid.
pub(super) const MOST_TRIANGLES: usize = 512;
/// Of the size, where a point counts as on a plane: rounding of planes through points of the least such thickness. The others are tried
/// where a hull of nearly coplanar points does not close.
const ON_PLANE: [f64; 4] = [1e-12, 1e-10, 1e-8, 1e-6];
/// Of the size: thinner is no body.
const FLAT: f64 = 1e-9;
/// Of the size: how far points may be out of the hull in the end.
const OUT: f64 = 1e-5;
/// Steps of the search for the largest ball within: the radius is found within a part in a hundred.
const BALLS: usize = 2000;

#[derive(Clone, Debug)]
pub(super) struct Hull {
    /// Corners alone, in units of `unit`.
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    pub unit: f64,
    tree: Tree,
    /// Per triangle its normal and where it is along that; no corner of the hull is beyond.
    planes: Vec<(Vec3, f64)>,
    /// The same by fours: x, y and z of normals, and places along them.
    fours: Vec<[[f64; 4]; 4]>,
    pub ball: Ball,
    pub inner_radius: f64,
}

/// A triangle while the hull grows.
#[derive(Clone)]
struct Face {
    corners: [u32; 3],
    /// The face beyond the side from each corner to the next.
    beyond: [u32; 3],
    normal: Vec3,
    offset: f64,
    /// Points above it that no other face has.
    above: Vec<u32>,
    gone: bool,
}

struct Growing<'a> {
    points: &'a [Vec3],
    on_plane: f64,
    faces: Vec<Face>,
    alive: usize,
}

impl Hull {
    pub fn of(points: &[Vec3]) -> Result<Self> {
        for (i, p) in points.iter().enumerate() {
            if let Some(bad) = p.iter().find(|c| c.is_nan() || c.abs() > *SIZES.end()) {
                return Err(Error::argument(format!(
                    "point {i} of the hull has the coordinate {bad:?}: the limit is {:e}",
                    SIZES.end()
                )));
            }
        }
        let (low, high) =
            points.iter().fold((Vec3::repeat(f64::INFINITY), Vec3::repeat(-f64::INFINITY)), |(low, high), p| {
                (low.inf(p), high.sup(p))
            });
        let size = if points.len() < 4 { 0.0 } else { (high - low).max() };
        if !SIZES.contains(&size) {
            let n = points.len();
            return Err(Error::argument(format!(
                "the hull of {n} points is {size:e} large: it needs 4 or more, and a size from {:e} to {:e}",
                SIZES.start(),
                SIZES.end()
            )));
        }
        let reach = low.amax().max(high.amax());
        if reach > FARTHEST * size {
            return Err(Error::argument(format!(
                "the hull is {size:e} large, {reach:e} from the origin: the limit is {FARTHEST:e} times as far"
            )));
        }
        let unit = 2f64.powi(libm::log2(size).ceil() as i32);
        let scaled: Vec<Vec3> = points.iter().map(|p| p / unit).collect();
        let first = simplex(&scaled, unit)?;
        let mut problem = None;
        for on_plane in ON_PLANE {
            match grow(&scaled, first, on_plane).and_then(|triangles| Self::of_triangles(&scaled, &triangles, unit)) {
                Ok(hull) if hull.holds(&scaled) => return Ok(hull),
                Ok(_) => (),
                Err(error) => problem = Some(error),
            }
        }
        Err(problem.unwrap_or_else(|| Error::argument("the hull's points are too nearly coplanar for a convex body")))
    }

    /// Of triangles among more points.
    fn of_triangles(points: &[Vec3], triangles: &[[u32; 3]], unit: f64) -> Result<Self> {
        let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        let number = |v: &u32| used.binary_search(v).expect("it is one of them") as u32;
        let positions: Vec<Vec3> = used.iter().map(|v| points[*v as usize]).collect();
        let mut triangles: Vec<[u32; 3]> = triangles.iter().map(|t| t.each_ref().map(number)).collect();
        tree::sort(&positions, &mut triangles);
        Self::new(positions, triangles, unit)
    }

    /// Of its corners and triangles in the order of a tree. Fails unless they bound a convex body.
    pub fn new(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>, unit: f64) -> Result<Self> {
        let (n, t) = (positions.len(), triangles.len());
        let exist = triangles.iter().flatten().all(|v| (*v as usize) < n);
        let near = positions.iter().flatten().all(|c| c.abs() <= 2.0 * FARTHEST); // no NaN is
        if !exist || !near || t > MOST_TRIANGLES || n > MOST_TRIANGLES {
            return invalid(format!("a hull of {n} corners and {t} triangles is out of range"));
        }
        check_sides(&triangles, Rim::None)?;
        let planes = planes(&positions, &triangles)?;
        let tree = Tree::new(&positions, &triangles)?;
        let ball = ball_about(&positions, &triangles, unit);
        let inner_radius = inner_radius(&positions, &planes) * unit;
        if inner_radius.is_nan() || inner_radius <= 0.0 {
            return Err(Error::argument("the hull has no inside"));
        }
        let fours = planes.chunks(4).map(by_four).collect();
        Ok(Self { positions, triangles, unit, tree, planes, fours, ball, inner_radius })
    }

    fn holds(&self, points: &[Vec3]) -> bool {
        points.iter().all(|p| self.planes.iter().all(|(normal, offset)| normal.dot(p) - offset <= OUT))
    }

    /// The plane that `p` is highest above, in units: how high, and which.
    #[inline]
    fn highest(&self, p: &Vec3) -> (f64, usize) {
        let (mut most, mut at) = ([f64::NEG_INFINITY; 4], [0.0; 4]);
        let mut here = 0.0;
        for [x, y, z, offset] in &self.fours {
            for lane in 0..4 {
                let over = x[lane] * p.x + y[lane] * p.y + z[lane] * p.z - offset[lane];
                let higher = over > most[lane];
                most[lane] = if higher { over } else { most[lane] };
                at[lane] = if higher { here } else { at[lane] };
            }
            here += 4.0;
        }
        let best = (1..4).fold(0, |best, lane| if most[lane] > most[best] { lane } else { best });
        (most[best], at[best] as usize + best)
    }

    #[inline]
    pub fn touch(&self, p: &Vec3) -> Touch {
        let p = p / self.unit;
        self.touch_below(&p, self.highest(&p))
    }

    /// None where the distance is surely more than `reach`.
    #[inline]
    pub fn touch_within(&self, p: &Vec3, reach: f64) -> Option<Touch> {
        let p = p / self.unit;
        let highest = self.highest(&p);
        (highest.0 * self.unit <= reach).then(|| self.touch_below(&p, highest))
    }

    fn touch_below(&self, p: &Vec3, (over, at): (f64, usize)) -> Touch {
        let on_plane = Touch { distance: over * self.unit, normal: self.planes[at].0 };
        if over <= 0.0 {
            return on_plane;
        }
        let near = p.map(|c| c.clamp(-FAR_OFF, FAR_OFF)); // its square is a number
        let mut nearest = Nearest::within(f64::INFINITY);
        nearest.look_at(&self.positions, &self.triangles, &near, at);
        if nearest.weights.iter().all(|weight| *weight > 0.0) {
            return on_plane; // its foot is in the triangle
        }
        nearest = self.tree.nearest(&self.positions, &self.triangles, &near, nearest);
        let way = p - nearest.foot(&self.positions, &self.triangles);
        let distance = crate::wide_norm(&way);
        // Within rounding of a plane the way has no sure direction.
        if distance > over { Touch { distance: distance * self.unit, normal: way / distance } } else { on_plane }
    }

    pub fn bytes(&self) -> usize {
        size_of::<Self>()
            + self.tree.bytes()
            + self.positions.capacity() * size_of::<Vec3>()
            + self.triangles.capacity() * size_of::<[u32; 3]>()
            + self.planes.capacity() * size_of::<(Vec3, f64)>()
            + self.fours.capacity() * size_of::<[[f64; 4]; 4]>()
    }
}

/// The last are of planes that no point is above.
fn by_four(planes: &[(Vec3, f64)]) -> [[f64; 4]; 4] {
    let mut four = [[0.0; 4], [0.0; 4], [0.0; 4], [f64::INFINITY; 4]];
    for (lane, (normal, offset)) in planes.iter().enumerate() {
        for (row, number) in [normal.x, normal.y, normal.z, *offset].into_iter().enumerate() {
            four[row][lane] = number;
        }
    }
    four
}

/// Through each triangle, moved out to the outermost corner. Fails unless that is close by.
fn planes(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Vec<(Vec3, f64)>> {
    let mut planes = reserve("the planes of the hull", triangles.len())?;
    for triangle in triangles {
        let [a, b, c] = corners(positions, triangle);
        let normal = (b - a).cross(&(c - a)).normalize();
        let offset = positions.iter().map(|x| normal.dot(x)).fold(f64::NEG_INFINITY, f64::max);
        let out = offset - normal.dot(&a);
        if out.is_nan() || out.abs() > OUT {
            let [a, b, c] = triangle;
            return Err(Error::argument(format!("the hull is not convex at its triangle {a}, {b}, {c}")));
        }
        planes.push((normal, offset));
    }
    Ok(planes)
}

/// Of the largest ball within all planes, nearly: away from the nearest plane by ever shorter steps.
fn inner_radius(positions: &[Vec3], planes: &[(Vec3, f64)]) -> f64 {
    let mut center = positions.iter().sum::<Vec3>() / positions.len() as f64;
    let mut best = f64::NEG_INFINITY;
    let mut first = None;
    for i in 0..BALLS {
        let (normal, room) = planes
            .iter()
            .map(|(normal, offset)| (normal, offset - normal.dot(&center)))
            .fold((&planes[0].0, f64::INFINITY), |least, next| if next.1 < least.1 { next } else { least });
        best = room.max(best);
        let step = 0.5 * *first.get_or_insert(room) / (1.0 + i as f64).sqrt();
        center -= step * normal;
    }
    best
}

/// Four points that span a body, the fourth below the plane of the first three.
fn simplex(points: &[Vec3], unit: f64) -> Result<[u32; 4]> {
    let farthest = |of: &dyn Fn(&Vec3) -> f64| {
        let each = points.iter().map(of).enumerate();
        each.fold((0, f64::NEG_INFINITY), |most, next| if next.1 > most.1 { next } else { most })
    };
    let ends = [0, 1, 2].map(|axis| [farthest(&|p| p[axis]).0, farthest(&|p| -p[axis]).0]);
    let length = |ends: &[usize; 2]| (points[ends[0]] - points[ends[1]]).norm();
    let [i, j] = ends.into_iter().fold(ends[0], |most, next| if length(&next) > length(&most) { next } else { most });
    let (a, side) = (points[i], (points[j] - points[i]).normalize());
    let (k, off) = farthest(&|p| (p - a).cross(&side).norm());
    if off <= FLAT {
        return Err(Error::argument(format!(
            "the hull's points lie on a line: they are {:e} off it at most",
            off * unit
        )));
    }
    let normal = side.cross(&(points[k] - a)).normalize();
    let (l, thick) = farthest(&|p| normal.dot(&(p - a)).abs());
    if thick <= FLAT {
        let (thick, size) = (thick * unit, length(&[i, j]) * unit);
        return Err(Error::argument(format!(
            "the hull's points lie in a plane: they are {thick:e} off it at most, {size:e} apart"
        )));
    }
    let [i, j, k, l] = [i, j, k, l].map(|at| at as u32);
    Ok(if normal.dot(&(points[l as usize] - a)) > 0.0 { [i, k, j, l] } else { [i, j, k, l] })
}

/// The triangles of the hull, counterclockwise from outside: the farthest point above a face joins, until none is (Barber et al., 1996).
fn grow(points: &[Vec3], [a, b, c, d]: [u32; 4], on_plane: f64) -> Result<Vec<[u32; 3]>> {
    let mut hull = Growing { points, on_plane, faces: vec![], alive: 4 };
    for (triangle, beyond) in
        [([a, b, c], [1, 2, 3]), ([b, a, d], [0, 3, 2]), ([c, b, d], [0, 1, 3]), ([a, c, d], [0, 2, 1])]
    {
        let face = hull.face(triangle, beyond)?;
        hull.faces.push(face);
    }
    hull.share_out((0..points.len() as u32).collect(), 0);
    let mut next = 0;
    while next < hull.faces.len() {
        if hull.faces[next].gone || hull.faces[next].above.is_empty() {
            next += 1;
            continue;
        }
        hull.join_farthest(next)?;
        if hull.alive > MOST_TRIANGLES {
            let (count, n) = (hull.alive, points.len());
            let advice = "take fewer points, or a grid";
            return Err(Error::argument(format!(
                "the hull of {n} points has {count} triangles and more; the limit is {MOST_TRIANGLES}: {advice}"
            )));
        }
    }
    Ok(hull.faces.iter().filter(|face| !face.gone).map(|face| face.corners).collect())
}

fn unclosed() -> Error {
    Error::argument("the hull's points are too nearly coplanar for a convex body")
}

impl Growing<'_> {
    fn face(&self, triangle: [u32; 3], beyond: [u32; 3]) -> Result<Face> {
        let [a, b, c] = corners(self.points, &triangle);
        let normal = (b - a).cross(&(c - a)).try_normalize(1e-30).ok_or_else(unclosed)?;
        Ok(Face { corners: triangle, beyond, normal, offset: normal.dot(&a), above: vec![], gone: false })
    }

    fn over(&self, face: usize, point: u32) -> f64 {
        self.faces[face].normal.dot(&self.points[point as usize]) - self.faces[face].offset
    }

    /// Points to the face from `first` on that they are farthest above.
    fn share_out(&mut self, points: Vec<u32>, first: usize) {
        for point in points {
            let (mut best, mut most) = (usize::MAX, self.on_plane);
            for face in first..self.faces.len() {
                let over = self.over(face, point);
                if over > most {
                    (best, most) = (face, over);
                }
            }
            if best != usize::MAX {
                self.faces[best].above.push(point);
            }
        }
    }

    /// The point farthest above a face, with new faces to all edges around those that it sees.
    fn join_farthest(&mut self, from: usize) -> Result<()> {
        let above = &self.faces[from].above;
        let apex = above
            .iter()
            .copied()
            .fold(above[0], |most, next| if self.over(from, next) > self.over(from, most) { next } else { most });
        let (mut seen, mut rim) = (vec![from], vec![]);
        self.faces[from].gone = true;
        let mut at = 0;
        while at < seen.len() {
            let face = self.faces[seen[at]].clone();
            at += 1;
            for k in 0..3 {
                let other = face.beyond[k] as usize;
                if self.faces[other].gone {
                    continue; // seen already
                }
                if self.over(other, apex) > self.on_plane {
                    self.faces[other].gone = true;
                    seen.push(other);
                } else {
                    rim.push((face.corners[k], face.corners[(k + 1) % 3], other));
                }
            }
        }
        self.close(apex, &rim, &seen)
    }

    fn close(&mut self, apex: u32, rim: &[(u32, u32, usize)], seen: &[usize]) -> Result<()> {
        let first = self.faces.len();
        let starting_at = |v: u32| {
            let mut found = rim.iter().enumerate().filter(|(_, side)| side.0 == v).map(|(i, _)| i);
            found.next().filter(|_| found.next().is_none()).ok_or_else(unclosed)
        };
        for (i, (a, b, other)) in rim.iter().enumerate() {
            let after = first + starting_at(*b)?;
            let before = rim.iter().position(|side| side.1 == *a).ok_or_else(unclosed)? + first;
            let face = self.face([*a, *b, apex], [*other as u32, after as u32, before as u32])?;
            let k =
                (0..3).find(|k| self.faces[*other].corners[*k] == *b && self.faces[*other].corners[(*k + 1) % 3] == *a);
            self.faces[*other].beyond[k.ok_or_else(unclosed)?] = (first + i) as u32;
            self.faces.push(face);
        }
        self.alive = self.alive + rim.len() - seen.len();
        let mut points = vec![];
        seen.iter().for_each(|face| points.append(&mut self.faces[*face].above));
        points.retain(|point| *point != apex);
        self.share_out(points, first);
        Ok(())
    }
}
