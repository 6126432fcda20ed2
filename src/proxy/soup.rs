//! A list of triangles made ready: vertices that lie together are one, and no triangle is a line or there twice.

use crate::collider::sort_triangles;
use crate::error::{Result, reserve};
use crate::mesh::NONE;
use crate::{Error, ErrorKind, Vec3};
use std::collections::HashMap;

/// Heights below this share of a triangle's longest side are none.
const NO_HEIGHT: f64 = 1e-9;

/// Triangles over vertices of their own, scaled to a size of 1 about the origin.
pub struct Soup {
    pub positions: Vec<Vec3>,
    /// Near ones next to each other, as a tree wants them.
    pub triangles: Vec<[u32; 3]>,
    /// Of each vertex here, the first of the asset's that became it.
    pub asset: Vec<u32>,
    /// Of each vertex of the asset, which it is here; [`NONE`] where it is in no triangle.
    pub welded: Vec<u32>,
    /// Vertices that were made one with another.
    pub n_welded: usize,
    /// Triangles that were there twice, such as the other side of a sheet.
    pub n_repeated: usize,
    scale: Scale,
}

/// From the asset's lengths to a size of 1.
#[derive(Clone, Copy)]
pub struct Scale {
    reach: f64,
    center: Vec3,
    size: f64,
}

impl Scale {
    fn of(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self> {
        let reach = triangles.iter().flatten().map(|v| positions[*v as usize].amax()).fold(0.0, f64::max);
        let corners = || triangles.iter().flatten().map(|v| positions[*v as usize] / reach);
        let low = corners().fold(Vec3::repeat(f64::INFINITY), |low, x| low.inf(&x));
        let high = corners().fold(Vec3::repeat(-f64::INFINITY), |high, x| high.sup(&x));
        let size = (high - low).norm();
        let extended = reach > 0.0 && size > 1e-12;
        if !extended {
            return Err(Error::new(ErrorKind::InvalidMesh, "the mesh has no extent: its vertices lie together"));
        }
        Ok(Self { reach, center: 0.5 * (low + high), size })
    }

    fn inward(&self, x: &Vec3) -> Vec3 {
        (x / self.reach - self.center) / self.size
    }

    /// Back to the asset's place.
    pub fn outward(&self, x: &Vec3) -> Vec3 {
        (x * self.size + self.center) * self.reach
    }

    /// A length of the asset here.
    pub fn length_inward(&self, length: f64) -> f64 {
        length / self.reach / self.size
    }

    /// A length here in the asset.
    pub fn length_outward(&self, length: f64) -> f64 {
        length * self.size * self.reach
    }
}

impl Soup {
    /// Of a list as hosts have it. Vertices within `weld` of each other, or at the same place, become one.
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]], weld: f64) -> Result<Self> {
        check(positions, triangles)?;
        let scale = Scale::of(positions, triangles)?;
        let mut soup = Self {
            positions: vec![],
            triangles: vec![],
            asset: vec![],
            welded: vec![],
            n_welded: 0,
            n_repeated: 0,
            scale,
        };
        soup.weld(positions, triangles, scale.length_inward(weld))?;
        soup.triangles = reserve("the proxy's triangles", triangles.len())?;
        let renamed = triangles.iter().map(|t| t.map(|v| soup.welded[v as usize]));
        soup.triangles.extend(renamed.filter(|[a, b, c]| a != b && b != c && c != a));
        soup.drop_repeated();
        soup.split_at_flat();
        if soup.triangles.is_empty() {
            return Err(Error::new(ErrorKind::InvalidMesh, "no triangle has an area: all are points or lines"));
        }
        sort_triangles(&soup.positions, &mut soup.triangles);
        Ok(soup)
    }

    /// The scale that it was brought to.
    pub fn scale(&self) -> Scale {
        self.scale
    }

    /// "vertex 7 of the asset at (1, 2, 3)".
    pub fn place(&self, v: u32) -> String {
        let x = self.scale.outward(&self.positions[v as usize]);
        format!("vertex {} at ({:.6}, {:.6}, {:.6})", self.asset[v as usize], x.x, x.y, x.z)
    }

    /// Of the same vertices, some of the triangles.
    pub fn part(&self, kept: &[usize]) -> Self {
        Self {
            positions: self.positions.clone(),
            triangles: kept.iter().map(|t| self.triangles[*t]).collect(),
            asset: self.asset.clone(),
            welded: vec![],
            n_welded: 0,
            n_repeated: 0,
            scale: self.scale,
        }
    }

    fn weld(&mut self, positions: &[Vec3], triangles: &[[u32; 3]], distance: f64) -> Result<()> {
        self.welded = vec![NONE; positions.len()];
        let mut used = vec![false; positions.len()];
        triangles.iter().flatten().for_each(|v| used[*v as usize] = true);
        let mut cells = Cells::new(distance);
        for (v, x) in positions.iter().enumerate().filter(|(v, _)| used[*v]) {
            let x = self.scale.inward(x);
            self.welded[v] = match cells.near(&x, &self.positions) {
                Some(w) => {
                    self.n_welded += 1;
                    w
                }
                None => {
                    let new = self.positions.len() as u32;
                    cells.add(&x, new);
                    self.positions.push(x);
                    self.asset.push(v as u32);
                    new
                }
            };
        }
        Ok(())
    }

    fn drop_repeated(&mut self) {
        let mut order: Vec<([u32; 3], u32)> = (0u32..).zip(&self.triangles).map(|(t, tri)| (sorted(*tri), t)).collect();
        order.sort_unstable();
        let mut first = vec![false; self.triangles.len()];
        order.chunk_by(|a, b| a.0 == b.0).for_each(|same| first[same[0].1 as usize] = true);
        let before = self.triangles.len();
        let mut t = 0;
        self.triangles.retain(|_| {
            t += 1;
            first[t - 1]
        });
        self.n_repeated += before - self.triangles.len();
    }

    fn is_flat(&self, tri: &[u32; 3]) -> bool {
        let [a, b, c] = tri.map(|v| self.positions[v as usize]);
        let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
        (b - a).cross(&(c - a)).norm() <= NO_HEIGHT * longest
    }

    /// Triangles without height are left out. The one across their longest side is split where their third corner lies, so that no slit opens.
    fn split_at_flat(&mut self) {
        let flat = self.triangles.iter().filter(|tri| self.is_flat(tri)).count();
        if flat == 0 {
            return;
        }
        let mut across: HashMap<[u32; 2], Vec<u32>> = HashMap::new();
        for (t, tri) in self.triangles.iter().enumerate() {
            sides(tri).iter().for_each(|side| across.entry(*side).or_default().push(t as u32));
        }
        let mut open: Vec<u32> = (0..self.triangles.len() as u32).collect();
        open.retain(|t| self.is_flat(&self.triangles[*t as usize]));
        let mut gone = vec![false; self.triangles.len()];
        for _ in 0..4 * flat {
            let Some(t) = open.pop() else { break };
            let tri = self.triangles[t as usize];
            gone[t as usize] = true;
            let length =
                |k: usize| (self.positions[tri[(k + 1) % 3] as usize] - self.positions[tri[k] as usize]).norm_squared();
            let k = (0..3).max_by(|i, j| length(*i).total_cmp(&length(*j)).then(j.cmp(i))).unwrap_or(0);
            let (a, b, c) = (tri[k], tri[(k + 1) % 3], tri[(k + 2) % 3]);
            let there = across.get(&low_high(a, b)).into_iter().flatten();
            let others: Vec<u32> = there.copied().filter(|other| *other != t && !gone[*other as usize]).collect();
            let &[other] = &others[..] else { continue };
            let [p, q, r] = turned_to(self.triangles[other as usize], low_high(a, b));
            if r == c {
                continue;
            }
            // p-q is the shared side, r the far corner.
            gone[other as usize] = true;
            for new in [[p, c, r], [c, q, r]] {
                let at = self.triangles.len() as u32;
                self.triangles.push(new);
                gone.push(false);
                sides(&new).iter().for_each(|side| across.entry(*side).or_default().push(at));
                if self.is_flat(&new) {
                    open.push(at);
                }
            }
        }
        let mut t = 0;
        let triangles = std::mem::take(&mut self.triangles);
        let kept = triangles.into_iter().filter(|tri| {
            t += 1;
            !gone[t - 1] && !self.is_flat(tri)
        });
        self.triangles = kept.collect();
        self.drop_repeated();
    }
}

fn sorted(mut tri: [u32; 3]) -> [u32; 3] {
    tri.sort_unstable();
    tri
}

pub fn low_high(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

fn sides(tri: &[u32; 3]) -> [[u32; 2]; 3] {
    [0, 1, 2].map(|k| low_high(tri[k], tri[(k + 1) % 3]))
}

/// The triangle begun at the side, in its own direction.
fn turned_to(tri: [u32; 3], side: [u32; 2]) -> [u32; 3] {
    let k = (0..3).find(|k| low_high(tri[*k], tri[(k + 1) % 3]) == side).unwrap_or(0);
    [tri[k], tri[(k + 1) % 3], tri[(k + 2) % 3]]
}

fn check(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<()> {
    let bad = |message: String| Err(Error::new(ErrorKind::InvalidMesh, message));
    for (t, tri) in triangles.iter().enumerate() {
        for &v in tri {
            match positions.get(v as usize) {
                None => return bad(format!("triangle {t} names vertex {v}, which does not exist")),
                Some(x) if !x.iter().all(|c| c.is_finite()) => {
                    return bad(format!("vertex {v} is ({:?}, {:?}, {:?}): it must be finite", x.x, x.y, x.z));
                }
                Some(_) => {}
            }
        }
    }
    Ok(())
}

/// Cells as wide as the distance: what is within it is in the same cell or the next. In a cell few are, as all are further apart.
struct Cells {
    distance: f64,
    exact: HashMap<[u64; 3], u32>,
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl Cells {
    /// Smaller distances are none: coordinates have 16 digits.
    const LEAST: f64 = 1e-13;

    fn new(distance: f64) -> Self {
        let distance = if distance > Self::LEAST { distance.min(2.0) } else { 0.0 };
        Self { distance, exact: HashMap::new(), cells: HashMap::new() }
    }

    fn bits(x: &Vec3) -> [u64; 3] {
        [x.x, x.y, x.z].map(|c| (c + 0.0).to_bits()) // −0 counts as 0
    }

    fn cell(&self, x: &Vec3) -> [i64; 3] {
        [x.x, x.y, x.z].map(|c| (c / self.distance).floor() as i64)
    }

    fn add(&mut self, x: &Vec3, v: u32) {
        if self.distance > 0.0 {
            self.cells.entry(self.cell(x)).or_default().push(v);
        } else {
            self.exact.insert(Self::bits(x), v);
        }
    }

    fn near(&self, x: &Vec3, positions: &[Vec3]) -> Option<u32> {
        if self.distance == 0.0 {
            return self.exact.get(&Self::bits(x)).copied();
        }
        let [i, j, k] = self.cell(x);
        let mut best: Option<(f64, u32)> = None;
        for cell in 0..27 {
            let at = [i + cell % 3 - 1, j + cell / 3 % 3 - 1, k + cell / 9 - 1];
            for &w in self.cells.get(&at).into_iter().flatten() {
                let squared = (positions[w as usize] - x).norm_squared();
                let nearer = best.is_none_or(|(least, first)| squared < least || (squared == least && w < first));
                if squared <= self.distance * self.distance && nearer {
                    best = Some((squared, w));
                }
            }
        }
        best.map(|(_, w)| w)
    }
}
