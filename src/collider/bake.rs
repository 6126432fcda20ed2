//! Signed distances of a closed mesh at the nodes of a grid.
//!
//! The distance is that to the nearest triangle; farther than [`BAND`] cells, to the nearest of those that are nearest to nodes around. Inside is where a row of nodes has come through the surface inwards more often than outwards,
//! so that pieces may overlap, triangles may have no area, and a hollow stays one.

use super::Ball;
use super::grid::{Grid, LEAST_NODES, MOST_NODES, MOST_VALUE, PADDING};
use super::sheet::Sheet;
use super::surface::Surface;
use super::tree::{Nearest, Tree, corners};
use super::triangle::place;
use crate::Vec3;
use crate::error::{Error, ErrorKind, Result, require_non_negative, reserve, try_zeroed};

/// How long a grid's cells are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resolution {
    /// So many along the longest side of the mesh, from 4 to 2000.
    Cells(usize),
    /// So long each.
    Length(f64),
}

/// How a mesh becomes a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridOptions {
    /// 64 cells along the longest side unless set.
    pub resolution: Resolution,
    /// So far from the mesh distances are as good as at its surface; at least four cells are added. 0 unless set.
    pub margin: f64,
    /// Memory that the grid may take, in bytes; making it takes four times as much. 64 MiB unless set.
    pub most_bytes: usize,
}

impl Default for GridOptions {
    fn default() -> Self {
        Self { resolution: Resolution::Cells(64), margin: 0.0, most_bytes: 64 << 20 }
    }
}

/// Cells between the box about the mesh and the first node: the spline begins half a cell later, where gradients of values two nodes off do
/// not reach the mesh. Not a round number, so that the faces of a box lie on no node.
const PAD: f64 = 4.618;
const CELLS: std::ops::RangeInclusive<f64> = 4.0..=2000.0;
/// Cells from the surface within which the nearest triangle is searched for. Farther away a search meets as many triangles as it is far.
const BAND: f64 = 3.0;
const NONE: u32 = u32::MAX;
/// Farther than any two points of a grid.
const FARTHER: f64 = 1e20;
/// Nodes around one, less 1, that come earlier: the row before it, two rows below that, and one.
const BEFORE: [[usize; 3]; 13] = [
    [0, 0, 0],
    [1, 0, 0],
    [2, 0, 0],
    [0, 1, 0],
    [1, 1, 0],
    [2, 1, 0],
    [0, 2, 0],
    [1, 2, 0],
    [2, 2, 0],
    [0, 0, 1],
    [1, 0, 1],
    [2, 0, 1],
    [0, 1, 1],
];
/// Two sides of a wedge of 67° pull on the node between them with this strength: sides that face each other more than that are a thin part.
const FACING: f64 = 0.55;
/// Places tried for a row that meets an edge or a corner, each this far off, in cells.
const TRIES: usize = 32;
const ASIDE: f64 = 1e-7;
/// Cells: the middle of a one-sided mesh is then two behind the surface, where the spline there does not feel its crease, or one and nearly so.
const DEPTH: f64 = 4.0;
const LEAST_DEPTH: f64 = 2.0;
/// Cells behind a one-sided mesh to where its nearest triangle is searched for.
const DEEPEST: f64 = 8.0;

/// Nodes around one more layer than a grid keeps, for second differences. In units of the surface.
struct Lattice {
    nodes: [usize; 3],
    origin: Vec3,
    cell: f64,
}

/// A row of nodes goes through a triangle.
#[derive(Clone, Copy)]
struct Crossing {
    row: u32,
    x: f64,
    /// +1 inwards, −1 outwards.
    turn: i32,
    triangle: u32,
}

/// Per node a triangle, and the point of it that is nearest.
struct Near {
    triangles: Vec<u32>,
    feet: Vec<Vec3>,
}

impl Near {
    fn set(&mut self, at: usize, surface: &Surface, nearest: &Nearest) {
        let corners = corners(&surface.positions, &surface.triangles[nearest.triangle]);
        (self.triangles[at], self.feet[at]) = (nearest.triangle as u32, place(&corners, &nearest.weights));
    }
}

pub(super) fn bake(surface: &Surface, options: &GridOptions) -> Result<Grid> {
    let cell = cell_length(surface.longest(), surface.unit, options)?;
    let lattice = Lattice::about(surface.box_about(), cell, surface.unit, options)?;
    let distances = lattice.signed_distances(surface)?;
    let inner_radius = lattice.inner_radius(&distances)? * surface.unit;
    lattice.grid(&distances, (&surface.positions, &surface.triangles, surface.unit), (surface.ball(), inner_radius))
}

/// Of a mesh that is solid behind its triangles by a depth, 0 for four cells.
pub(super) fn bake_one_sided(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    depth: f64,
    options: &GridOptions,
) -> Result<Grid> {
    let surface = Surface::open(positions, triangles)?;
    let unit = surface.unit;
    let cell = cell_length(surface.longest(), unit, options)?;
    let depth = if depth == 0.0 { DEPTH * cell * unit } else { depth };
    if depth < LEAST_DEPTH * cell * unit {
        return Err(Error::argument(format!(
            "the depth of the one-sided mesh is {depth:?}, and a cell of its grid {:e}: take {LEAST_DEPTH} cells or more, or more cells",
            cell * unit
        )));
    }
    let sheet = Sheet::of(positions, positions, triangles, depth)?;
    let lattice = Lattice::about(sheet.box_about(), cell, unit, options)?;
    let near = lattice.near(&surface, BAND.max((sheet.depth / cell).min(DEEPEST)))?;
    let mut distances = reserve("distances of the grid", near.triangles.len())?;
    for (at, triangle) in near.triangles.iter().enumerate() {
        let (p, mut nearest) = (lattice.place_of(at), Nearest::within(f64::INFINITY));
        nearest.look_at(&surface.positions, &surface.triangles, &p, *triangle as usize);
        distances.push(sheet.touch_at(&p, &nearest).distance / cell);
    }
    let mesh = (surface.positions.as_slice(), surface.triangles.as_slice(), unit);
    lattice.grid(&distances, mesh, (sheet.ball, sheet.mesh.inner_radius))
}

/// In units of the surface.
fn cell_length(longest: f64, unit: f64, options: &GridOptions) -> Result<f64> {
    let (what, cells) = match options.resolution {
        Resolution::Cells(n) => ("cells along the longest side", n as f64),
        Resolution::Length(length) => ("cells along the longest side by their length", longest / (length / unit)),
    };
    if !CELLS.contains(&cells) {
        let (least, most) = (CELLS.start(), CELLS.end());
        return Err(Error::argument(format!("the grid has {cells:?} {what}: it must be from {least} to {most}")));
    }
    Ok(longest / cells)
}

/// The largest distance that the grid has for a vertex or a middle of a triangle, whose own is zero.
fn surface_error(grid: &Grid, (positions, triangles, unit): (&[Vec3], &[[u32; 3]], f64)) -> f64 {
    let of = |p: Vec3| grid.touch(&(p * unit)).distance.abs();
    let each = |t: &[u32; 3]| {
        let [a, b, c] = corners(positions, t);
        [of(a), of(b), of(c), of((a + b + c) / 3.0)].into_iter().fold(0.0, f64::max)
    };
    triangles.iter().map(each).fold(0.0, f64::max)
}

impl Lattice {
    fn about((low, high): (Vec3, Vec3), cell: f64, unit: f64, options: &GridOptions) -> Result<Self> {
        let margin = require_non_negative("the grid's margin", options.margin)? / unit;
        let pad = PAD + margin / cell;
        let counts = (high - low).map(|side| (side / cell + 2.0 * pad).ceil() + 1.0);
        let bytes = counts.product() * size_of::<f32>() as f64;
        if bytes > options.most_bytes as f64 || counts.max() > MOST_NODES as f64 {
            let [x, y, z] = counts.into();
            let (needs, limit) = (bytes / 1048576.0, options.most_bytes as f64 / 1048576.0);
            return Err(Error::new(
                ErrorKind::OutOfMemory,
                format!(
                    "the grid of {x} × {y} × {z} nodes needs {needs:.1} MiB; the limit is {limit:.1} MiB, and {MOST_NODES} nodes along an axis"
                ),
            ));
        }
        let nodes: [usize; 3] = counts.map(|n| n as usize + 2).into();
        debug_assert!(nodes.iter().all(|n| *n >= LEAST_NODES + 2));
        Ok(Self { nodes, origin: low - Vec3::repeat((pad + 1.0) * cell), cell })
    }

    /// Of distances in cells, of a mesh and its unit.
    fn grid(
        &self,
        distances: &[f64],
        mesh: (&[Vec3], &[[u32; 3]], f64),
        (ball, inner_radius): (Ball, f64),
    ) -> Result<Grid> {
        let values = self.coefficients(distances)?;
        let (nodes, unit) = (self.nodes.map(|n| n - 2), mesh.2);
        let (cell, origin) = (self.cell * unit, (self.origin + Vec3::repeat(self.cell)) * unit);
        let mut grid = Grid::new((nodes, origin, cell), values, (ball, inner_radius, 0.0))?;
        grid.surface_error = surface_error(&grid, mesh);
        Ok(grid)
    }

    fn place(&self, i: usize, j: usize, k: usize) -> Vec3 {
        self.origin + self.cell * Vec3::new(i as f64, j as f64, k as f64)
    }

    fn place_of(&self, at: usize) -> Vec3 {
        let [nx, ny, _] = self.nodes;
        self.place(at % nx, at / nx % ny, at / (nx * ny))
    }

    /// In cells; x runs fastest.
    fn signed_distances(&self, surface: &Surface) -> Result<Vec<f64>> {
        let [nx, ny, _] = self.nodes;
        let mut distances = self.distances(surface)?;
        let crossings = self.crossings(surface)?;
        let mut ahead = crossings.as_slice();
        for (row, distances) in distances.chunks_exact_mut(nx).enumerate() {
            let mut inside = 0;
            for (i, distance) in distances.iter_mut().enumerate() {
                let x = self.place(i, row % ny, row / ny).x;
                while let Some((crossing, later)) = ahead.split_first() {
                    if crossing.row as usize != row || crossing.x > x {
                        break;
                    }
                    inside += crossing.turn;
                    ahead = later;
                }
                *distance = if inside > 0 { -*distance } else { *distance };
            }
            ahead = &ahead[ahead.iter().take_while(|c| c.row as usize == row).count()..];
        }
        Ok(distances)
    }

    /// Without a sign.
    fn distances(&self, surface: &Surface) -> Result<Vec<f64>> {
        let near = self.near(surface, BAND)?;
        let mut distances = reserve("distances of the grid", near.feet.len())?;
        distances.extend(near.feet.iter().enumerate().map(|(at, foot)| (self.place_of(at) - foot).norm() / self.cell));
        Ok(distances)
    }

    /// Of each node the nearest triangle, and beyond so many cells one that is nearly that.
    fn near(&self, surface: &Surface, band: f64) -> Result<Near> {
        let n: usize = self.nodes.iter().product();
        let tree = Tree::new(&surface.positions, &surface.triangles)?;
        let mut near = Near { triangles: try_zeroed("the grid", n)?, feet: try_zeroed("the grid", n)? };
        let band = Nearest::within(band * self.cell);
        for at in 0..n {
            let p = self.place_of(at);
            let mut best = band;
            if at > 0 && near.triangles[at - 1] != NONE {
                let likely = near.triangles[at - 1] as usize;
                best.look_at(&surface.positions, &surface.triangles, &p, likely);
            }
            best = tree.nearest(&surface.positions, &surface.triangles, &p, best);
            if best.triangle == usize::MAX {
                (near.triangles[at], near.feet[at]) = (NONE, Vec3::repeat(FARTHER));
            } else {
                near.set(at, surface, &best);
            }
        }
        let searched: Vec<bool> = near.triangles.iter().map(|t| *t != NONE).collect();
        for _ in 0..2 {
            (0..n).filter(|at| !searched[*at]).for_each(|at| self.spread(surface, at, &mut near, false));
            (0..n).rev().filter(|at| !searched[*at]).for_each(|at| self.spread(surface, at, &mut near, true));
        }
        Ok(near)
    }

    /// To a node: the triangle whose nearest point to one of the thirteen nodes before it, or after it, is the nearest of theirs.
    fn spread(&self, surface: &Surface, at: usize, near: &mut Near, after: bool) {
        let [nx, ny, nz] = self.nodes;
        let place = [at % nx, at / nx % ny, at / (nx * ny)];
        let p = self.place_of(at);
        let mut best = (at, (p - near.feet[at]).norm_squared());
        for [x, y, z] in BEFORE {
            let step = |a: usize, by: usize| if after { place[a] + 2 - by } else { place[a] + by };
            let [i, j, k] = [step(0, x), step(1, y), step(2, z)]; // one too large
            if (1..=nx).contains(&i) && (1..=ny).contains(&j) && (1..=nz).contains(&k) {
                let other = i - 1 + nx * (j - 1 + ny * (k - 1));
                let squared = (p - near.feet[other]).norm_squared();
                best = if squared < best.1 { (other, squared) } else { best };
            }
        }
        if best.0 != at {
            let mut nearest = Nearest::within(f64::INFINITY);
            nearest.look_at(&surface.positions, &surface.triangles, &p, near.triangles[best.0] as usize);
            near.set(at, surface, &nearest);
        }
    }

    /// By row, then x. In each row as many go in as out.
    fn crossings(&self, surface: &Surface) -> Result<Vec<Crossing>> {
        let [_, ny, nz] = self.nodes;
        let mut all = vec![];
        let index = |x: f64, axis: usize| (x - self.origin[axis]) / self.cell;
        for t in 0..surface.triangles.len() {
            let own = corners(&surface.positions, &surface.triangles[t]);
            let low = own[0].inf(&own[1]).inf(&own[2]);
            let high = own[0].sup(&own[1]).sup(&own[2]);
            for k in index(low.z, 2) as usize..=(index(high.z, 2) as usize).min(nz - 1) {
                for j in index(low.y, 1) as usize..=(index(high.y, 1) as usize).min(ny - 1) {
                    all.extend(crossing(surface, t, (j + ny * k) as u32, &self.place(0, j, k)));
                }
            }
        }
        let order =
            |a: &Crossing, b: &Crossing| a.row.cmp(&b.row).then(a.x.total_cmp(&b.x)).then(a.triangle.cmp(&b.triangle));
        all.sort_unstable_by(order);
        let mut rows = reserve("crossings of the grid", all.len())?;
        for row in all.chunk_by(|a, b| a.row == b.row) {
            if row.iter().map(|c| c.turn).sum::<i32>() == 0 {
                rows.extend(row);
            } else {
                rows.extend(self.row_aside(surface, row[0].row)?);
            }
        }
        Ok(rows)
    }

    /// The crossings of a row that meets an edge within rounding: those a little aside.
    fn row_aside(&self, surface: &Surface, row: u32) -> Result<Vec<Crossing>> {
        let ny = self.nodes[1];
        let at = self.place(0, row as usize % ny, row as usize / ny);
        for aside in 1..=TRIES {
            let angle = 2.4 * aside as f64; // all around
            let (by, (sine, cosine)) = (ASIDE * self.cell * aside as f64, libm::sincos(angle));
            let near = at + by * Vec3::new(0.0, cosine, sine);
            let mut found: Vec<Crossing> =
                (0..surface.triangles.len()).filter_map(|t| crossing(surface, t, row, &near)).collect();
            if found.iter().map(|c| c.turn).sum::<i32>() == 0 {
                found.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.triangle.cmp(&b.triangle)));
                return Ok(found);
            }
        }
        let place = at * surface.unit;
        let told = format!("y = {:e}, z = {:e}", place.y, place.z);
        Err(Error::new(ErrorKind::Numerical, format!("the grid finds no inside on the line {told}: take other cells")))
    }

    /// Least depth between sides that face each other, in units of the surface; no less than half a cell.
    fn inner_radius(&self, distances: &[f64]) -> Result<f64> {
        let [nx, ny, nz] = self.nodes;
        let mut least = f64::INFINITY;
        let (mut deepest, strides) = (0.0f64, [1, nx, nx * ny]);
        for k in 1..nz - 1 {
            for j in 1..ny - 1 {
                for at in (1..nx - 1).map(|i| i + nx * (j + ny * k)).filter(|at| distances[*at] < 0.0) {
                    let slope = Vec3::from_fn(|a, _| 0.5 * (distances[at + strides[a]] - distances[at - strides[a]]));
                    deepest = deepest.max(-distances[at]);
                    if slope.norm() <= FACING {
                        // Between parallel sides the middle is so far off, as the slope falls by 1 in a cell.
                        least = least.min(slope.norm() - distances[at]);
                    }
                }
            }
        }
        if deepest == 0.0 {
            let message = "the mesh is thinner than the grid's cells everywhere: no node is inside; take smaller cells";
            return Err(Error::new(ErrorKind::InvalidMesh, message));
        }
        Ok(self.cell * if least.is_finite() { least.max(0.5) } else { deepest.max(0.5) })
    }

    /// c of the [`super::grid`], without the outermost nodes.
    fn coefficients(&self, f: &[f64]) -> Result<Vec<f32>> {
        let [nx, ny, nz] = self.nodes;
        let strides = [1, nx, nx * ny];
        let mut values = reserve("the grid", (nx - 2) * (ny - 2) * (nz - 2) + PADDING)?;
        for k in 1..nz - 1 {
            for j in 1..ny - 1 {
                for at in (1..nx - 1).map(|i| i + nx * (j + ny * k)) {
                    let second: f64 = strides.iter().map(|s| f[at + s] - 2.0 * f[at] + f[at - s]).sum();
                    let value = f[at] - second / 8.0;
                    values.push((value as f32).clamp(-MOST_VALUE, MOST_VALUE));
                }
            }
        }
        values.extend([0.0; PADDING]);
        Ok(values)
    }
}

/// Where the line along x through `at` goes through triangle `t`. Both triangles of an edge see the line on the same side of it.
fn crossing(surface: &Surface, t: usize, row: u32, at: &Vec3) -> Option<Crossing> {
    let triangle = surface.triangles[t];
    let mut parts = [0.0; 3];
    for k in 0..3 {
        let (from, to) = (triangle[(k + 1) % 3], triangle[(k + 2) % 3]);
        let (a, b) = (surface.positions[from.min(to) as usize], surface.positions[from.max(to) as usize]);
        let side = (b.y - a.y) * (at.z - a.z) - (b.z - a.z) * (at.y - a.y);
        parts[k] = if from < to { side } else { -side };
    }
    let turn = match parts {
        [a, b, c] if a > 0.0 && b > 0.0 && c > 0.0 => -1, // the normal looks along x
        [a, b, c] if a < 0.0 && b < 0.0 && c < 0.0 => 1,
        _ => return None,
    };
    let own = corners(&surface.positions, &triangle);
    let sum: f64 = parts.iter().sum();
    let x = (0..3).map(|k| parts[k] / sum * own[k].x).sum();
    Some(Crossing { row, x, turn, triangle: t as u32 })
}
