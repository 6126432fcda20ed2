//! A triangle mesh that a solid is made of, closed or one-sided: checked, oriented, in units of its size.

use super::moving::Rim;
use super::{SIZES, tree};
use crate::Vec3;
use crate::error::{Error, ErrorKind, Result};
use crate::mesh::{Kind, Severity, UnionFind, check};

/// Coordinates that are more than this many sizes from the origin leave fewer than six digits of the shape.
pub(super) const FARTHEST: f64 = 1e10;
/// Of surface times size: rounding of a volume that is zero.
const NO_VOLUME: f64 = 1e-13;
const NO_TRIANGLE: &str = "the mesh has no triangle of three different vertices";

/// Every edge has two triangles that run along it in opposite directions, so that there is an inside; or a front, where one may be at a rim.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    /// In units of `unit`. Those that no triangle uses are at zero.
    pub positions: Vec<Vec3>,
    /// In the order of a [`tree::Tree`].
    pub triangles: Vec<[u32; 3]>,
    /// A power of two no shorter than the longest side of the box about it.
    pub unit: f64,
}

fn invalid_mesh<T>(message: String) -> Result<T> {
    Err(Error::new(ErrorKind::InvalidMesh, message))
}

/// The box about the vertices that triangles use.
pub(super) fn box_about(positions: &[Vec3], triangles: &[[u32; 3]]) -> (Vec3, Vec3) {
    triangles
        .iter()
        .flatten()
        .map(|v| &positions[*v as usize])
        .fold((Vec3::repeat(f64::INFINITY), Vec3::repeat(-f64::INFINITY)), |(low, high), x| (low.inf(x), high.sup(x)))
}

/// Triangles that hang together, named by a vertex: six times their volume, twice their area, the box about them.
#[derive(Clone, Default)]
struct Piece {
    volume: f64,
    area: f64,
    reach: Option<(Vec3, Vec3)>,
}

impl Piece {
    fn add(&mut self, volume: f64, [a, b, c]: &[Vec3; 3]) {
        self.volume += volume;
        self.area += (b - a).cross(&(c - a)).norm();
        let (low, high) = self.reach.unwrap_or((*a, *a));
        self.reach = Some((low.inf(a).inf(b).inf(c), high.sup(a).sup(b).sup(c)));
    }

    fn may_hold(&self, p: &Vec3) -> bool {
        self.reach.is_some_and(|(low, high)| low <= *p && *p <= high)
    }
}

impl Surface {
    /// Fails with the place unless the mesh is closed and its volume is positive. See [`super::Solid::grid`].
    pub fn closed(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self> {
        let raw = oriented(positions, triangles, Rim::None);
        let triangles = match raw {
            Ok(triangles) => triangles,
            Err(error) => match welded(positions, triangles) {
                Some(triangles) => oriented(positions, &triangles, Rim::None)?,
                None => return Err(error),
            },
        };
        let surface = Self::sized(positions, triangles)?;
        surface.check_volume()?;
        Ok(surface)
    }

    /// One that may be open, and need not have an inside. Vertices at the same place count as one where every edge then has one or two triangles.
    pub fn open(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self> {
        let one_vertex_a_place = welded(positions, triangles).and_then(|t| oriented(positions, &t, Rim::Allowed).ok());
        let triangles = one_vertex_a_place.map_or_else(|| oriented(positions, triangles, Rim::Allowed), Ok)?;
        Self::sized(positions, triangles)
    }

    fn sized(positions: &[Vec3], triangles: Vec<[u32; 3]>) -> Result<Self> {
        let (low, high) = box_about(positions, &triangles);
        let (size, reach) = ((high - low).max(), low.amax().max(high.amax()));
        if reach > *SIZES.end() || !SIZES.contains(&size) || reach > FARTHEST * size {
            let limits =
                format!("{:e} to {:e}, and {FARTHEST:e} times as far from the origin", SIZES.start(), SIZES.end());
            return invalid_mesh(format!(
                "the mesh is {size:e} large, {reach:e} from the origin: the limits are {limits}"
            ));
        }
        let unit = 2f64.powi(libm::log2(size).ceil() as i32);
        let mut scaled = vec![Vec3::zeros(); positions.len()];
        triangles.iter().flatten().for_each(|&v| scaled[v as usize] = positions[v as usize] / unit);
        let mut surface = Self { positions: scaled, triangles, unit };
        tree::sort(&surface.positions, &mut surface.triangles);
        Ok(surface)
    }

    /// Six times the volume that triangle `t` spans with `about`.
    fn volume(&self, t: usize, about: &Vec3) -> f64 {
        let [a, b, c] = tree::corners(&self.positions, &self.triangles[t]).map(|x| x - about);
        a.dot(&b.cross(&c))
    }

    fn check_volume(&self) -> Result<()> {
        let (low, high) = self.box_about();
        let about = 0.5 * (low + high);
        let mut sets = UnionFind::new(self.positions.len());
        for [a, b, c] in &self.triangles {
            sets.join(*a, *b);
            sets.join(*b, *c);
        }
        let piece_of: Vec<u32> = self.triangles.iter().map(|t| sets.find(t[0])).collect();
        let mut pieces = vec![Piece::default(); self.positions.len()];
        for (t, piece) in piece_of.iter().enumerate() {
            pieces[*piece as usize].add(self.volume(t, &about), &tree::corners(&self.positions, &self.triangles[t]));
        }
        let whole: f64 = pieces.iter().map(|piece| piece.volume).sum();
        let nothing = NO_VOLUME * pieces.iter().map(|piece| piece.area).sum::<f64>();
        let volume = whole * self.unit.powi(3) / 6.0; // zero or infinite in a message at worst
        if whole < -nothing {
            return invalid_mesh(format!(
                "the mesh is inside out: its volume is {volume:e}; turn its triangles so that they run counterclockwise seen from outside"
            ));
        }
        if whole <= nothing {
            return invalid_mesh(format!("the mesh has no inside: its volume is {volume:e}"));
        }
        for piece in (0..pieces.len()).filter(|piece| pieces[*piece].volume < -NO_VOLUME * pieces[*piece].area) {
            // Within another one its triangles fill the sphere, 4π; out of it, they sum to zero.
            let about = &self.positions[piece];
            let others = piece_of.iter().zip(&self.triangles);
            let others = others.filter(|(p, _)| **p as usize != piece && pieces[**p as usize].may_hold(about));
            if others.map(|(_, t)| self.solid_angle(t, about)).sum::<f64>() < 2.0 * std::f64::consts::PI {
                return invalid_mesh(format!(
                    "a piece of the mesh is inside out, and in no other one: that of vertex {piece}"
                ));
            }
        }
        Ok(())
    }

    /// Of a triangle, seen from a point (Van Oosterom and Strackee, 1983).
    fn solid_angle(&self, triangle: &[u32; 3], about: &Vec3) -> f64 {
        let [a, b, c] = tree::corners(&self.positions, triangle).map(|x| x - about);
        let [x, y, z] = [a.norm(), b.norm(), c.norm()];
        2.0 * libm::atan2(a.dot(&b.cross(&c)), x * y * z + a.dot(&b) * z + b.dot(&c) * x + c.dot(&a) * y)
    }

    pub fn box_about(&self) -> (Vec3, Vec3) {
        box_about(&self.positions, &self.triangles)
    }

    /// Side of the box about it.
    pub fn longest(&self) -> f64 {
        let (low, high) = self.box_about();
        (high - low).max()
    }

    /// The ball about all of it, in lengths.
    pub fn ball(&self) -> super::Ball {
        ball_about(&self.positions, &self.triangles, self.unit)
    }
}

/// About the middle of the box.
pub(super) fn ball_about(positions: &[Vec3], triangles: &[[u32; 3]], unit: f64) -> super::Ball {
    let (low, high) = box_about(positions, triangles);
    let center = 0.5 * (low + high);
    let radius = triangles.iter().flatten().map(|v| (positions[*v as usize] - center).norm()).fold(0.0, f64::max);
    // A rounding more than the farthest vertex.
    super::Ball { center: center * unit, radius: radius * unit * (1.0 + 4.0 * f64::EPSILON) }
}

/// The usable triangles, turned to agree with their neighbours. Fails with the first fault.
fn oriented(positions: &[Vec3], triangles: &[[u32; 3]], rim: Rim) -> Result<Vec<[u32; 3]>> {
    let (n, t) = (positions.len(), triangles.len());
    if n == 0 || t == 0 || n >= u32::MAX as usize || t >= (u32::MAX / 2) as usize {
        return invalid_mesh(format!("the mesh has {n} vertices and {t} triangles"));
    }
    let findings = check(positions, triangles);
    // Triangles without an area have distances; pieces that meet at a vertex have an inside.
    let harmless = [Kind::RepeatedVertex, Kind::ZeroArea, Kind::NonManifoldVertex];
    let fault = |kind: Kind| kind.severity() == Severity::Error && !harmless.contains(&kind);
    if let Some(first) = findings.diagnostics.iter().find(|d| fault(d.kind)) {
        return invalid_mesh(first.to_string());
    }
    let mut turned = findings.orientation.apply(triangles);
    turned.retain(|[a, b, c]| a != b && b != c && c != a);
    check_sides(&turned, rim)?;
    Ok(turned)
}

/// Fails unless each edge that is run along one way is run along the other way too, or, where a rim is allowed, by none.
pub(super) fn check_sides(triangles: &[[u32; 3]], rim: Rim) -> Result<()> {
    let mut sides: Vec<([u32; 2], bool)> = vec![];
    for t in triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            sides.push(([a.min(b), a.max(b)], a < b));
        }
    }
    sides.sort_unstable();
    let of_edges = || sides.chunk_by(|a, b| a.0 == b.0);
    if rim == Rim::Allowed {
        let meets = |run: &&[([u32; 2], bool)]| run.len() > 2 || run.len() == 2 && run[0].1 == run[1].1;
        return match of_edges().find(meets) {
            _ if triangles.is_empty() => invalid_mesh(NO_TRIANGLE.into()),
            None => Ok(()),
            Some(run) => {
                let [a, b] = run[0].0;
                invalid_mesh(format!("edge {a}-{b} has {} triangles that have no common front", run.len()))
            }
        };
    }
    let open: Vec<[u32; 2]> = of_edges().filter(|run| run.len() != 2).map(|run| run[0].0).collect();
    match open.first() {
        _ if triangles.is_empty() => invalid_mesh(NO_TRIANGLE.into()),
        None => Ok(()),
        Some([a, b]) => invalid_mesh(format!(
            "the mesh is open: edge {a}-{b} has one triangle ({} such edges); a solid needs a closed mesh: close it, or take it as one-sided",
            open.len()
        )),
    }
}

/// With one vertex for all at the same place; None where there are no two.
fn welded(positions: &[Vec3], triangles: &[[u32; 3]]) -> Option<Vec<[u32; 3]>> {
    let key = |v: u32| positions[v as usize].map(|c| (c + 0.0).to_bits()); // −0 counts as 0
    let compare = |a: &u32, b: &u32| key(*a).as_slice().cmp(key(*b).as_slice()).then(a.cmp(b));
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_unstable_by(compare);
    let mut first: Vec<u32> = (0..positions.len() as u32).collect();
    for run in order.chunk_by(|a, b| key(*a) == key(*b)) {
        run.iter().for_each(|v| first[*v as usize] = run[0]);
    }
    let any = first.iter().enumerate().any(|(v, f)| v != *f as usize);
    let exist = triangles.iter().flatten().all(|v| (*v as usize) < first.len());
    (any && exist).then(|| triangles.iter().map(|t| t.map(|v| first[v as usize])).collect())
}
