//! A mesh to simulate in another's place: few vertices, even triangles, a manifold, whatever the other is made of.
//!
//! | step | file |
//! |---|---|
//! | vertices that lie together become one; lines and repeated triangles go | `soup` |
//! | two sides become the sheet in their middle | `sides` |
//! | edges of more than two triangles and one-sided strips are refused or cut | `link` |
//! | boundaries and creases are found at the proxy's scale | `lines` |
//! | the rest is remeshed evenly | `remesh`, `edit`, `ground` |
//! | a shell on it is made to answer as one on the asset does | `calibrate` |

mod calibrate;
mod edit;
mod ground;
mod lines;
mod link;
mod remesh;
mod sides;
mod soup;

pub use calibrate::{Calibration, calibrate};

use crate::mesh::NONE;
use crate::{Error, ErrorKind, Mesh, Result, Vec3};
use edit::quality;
use ground::Ground;
use lines::{Kept, Lines};
use link::Manifold;
use remesh::{edge_length, remesh};
use soup::Soup;
use std::sync::Arc;

/// The most vertices that a proxy has.
pub const MOST_VERTICES: usize = 4_000_000;
/// A piece that is smaller across than so many edges is left out.
const SMALLEST_PIECE: f64 = 3.0;
/// A proxy with a worse triangle that moves is made again without creases.
const WORST_WITH_CREASES: f64 = 0.3;
/// And without the outline of what is held: where that is off by half an edge, so is what the shell hangs by. A leaf on a proxy of a tenth is 6.6 % off with a triangle
/// of 0.24, and 13.7 % without its outline.
const WORST_HELD: f64 = 0.2;

/// Vertices of the proxy for each tip that it keeps: of a rough surface none.
const TIP: usize = 30;

/// How two sides are treated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sides {
    /// Those of thin sheets are found.
    Find,
    /// Those that are no further apart.
    Within(f64),
    /// Both are simulated.
    Keep,
}

/// What is wanted.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Vertices of the proxy.
    pub n_vertices: usize,
    /// Vertices of the asset that lie within this distance become one.
    pub weld: f64,
    /// Of sheets with thickness.
    pub sides: Sides,
    /// Cut what is no manifold, in place of an error.
    pub cut: bool,
    /// Small pieces stay.
    pub keep_pieces: bool,
}

/// Where a vertex of the proxy lies on the asset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// Vertices of the asset.
    pub vertices: [u32; 3],
    /// Their weights, of sum 1.
    pub weights: [f64; 3],
}

/// A proxy and how it came about.
#[derive(Clone, Debug)]
pub struct Proxy {
    /// In the asset's axes and lengths.
    pub positions: Vec<Vec3>,
    /// Of a manifold, turned alike.
    pub triangles: Vec<[u32; 3]>,
    /// Of each vertex.
    pub sources: Vec<Source>,
    /// Of each vertex of the asset, the nearest of the proxy.
    pub nearest: Vec<u32>,
    /// What it stands for.
    pub sheet: Arc<Sheet>,
    /// What was done.
    pub info: Info,
}

/// An asset made ready: a manifold of its own vertices, two sides as one sheet, small pieces and holes gone.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// In the asset's axes and lengths.
    pub positions: Vec<Vec3>,
    /// Turned alike.
    pub triangles: Vec<[u32; 3]>,
    /// What supports hold, ascending.
    pub held: Vec<u32>,
    /// Of each vertex of the asset, which it is here; [`NONE`] of one that is left out.
    pub of_asset: Vec<u32>,
}

/// What was done to an asset, and what came out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Info {
    /// Length of the edges that was aimed at.
    pub edge_length: f64,
    /// The worst triangle's 4√3 A / Σl²: 1 is equilateral.
    pub worst_quality: f64,
    /// Of all triangles.
    pub mean_quality: f64,
    /// Of what is simulated of the asset, the vertex furthest from the proxy: its distance, and which.
    pub furthest: (f64, u32),
    /// Vertices made one with another.
    pub n_welded: usize,
    /// Triangles that repeated another.
    pub n_repeated: usize,
    /// Triangles of second sides and rims that were left out.
    pub n_sides_joined: usize,
    /// Between the sides, where some were joined.
    pub thickness: f64,
    /// Places cut because no manifold was there.
    pub n_cut: usize,
    /// Pieces of the proxy.
    pub n_pieces: usize,
    /// Pieces too small for the proxy.
    pub n_left_out: usize,
    /// Holes too small for it.
    pub n_holes_closed: usize,
}

impl Proxy {
    /// Of any list of triangles. `heard` is told the share that is done.
    pub fn new(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        options: &Options,
        heard: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<Self> {
        Self::holding(positions, triangles, &[], options, heard)
    }

    /// The same, with the outline of vertices that supports `held` kept.
    pub fn holding(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        held: &[u32],
        options: &Options,
        heard: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<Self> {
        check(options)?;
        if let Some((i, v)) = held.iter().enumerate().find(|(_, v)| **v as usize >= positions.len()) {
            let n = positions.len();
            return Err(Error::argument(format!("held[{i}] is vertex {v}, but the mesh has {n} vertices")));
        }
        heard(0.0)?;
        let soup = Soup::new(positions, triangles, options.weld)?;
        let scale = soup.scale();
        heard(0.05)?;
        let mut info = Info { n_welded: soup.n_welded, n_repeated: soup.n_repeated, ..Info::default() };
        let mut manifold = sheet(&soup, options, &mut info)?;
        info.n_cut = manifold.n_cut;
        heard(0.1)?;
        let wanted = options.n_vertices;
        if !options.keep_pieces {
            info.n_left_out = leave_out(&mut manifold, wanted);
        }
        info.n_holes_closed =
            link::close_holes(&mut manifold, |manifold| Ok(edge_over(manifold, &Ground::new(manifold)?, wanted)))?;
        let mut part = |share: f64| heard(0.1 + 0.8 * share);
        let of_asset = of_asset(&soup, &manifold, scale.length_inward(info.thickness))?;
        let mut marked = marked(&soup, &manifold, held);
        let there = held.iter().map(|v| of_asset[*v as usize]).filter(|v| *v != NONE);
        there.for_each(|v| marked[v as usize] = true);
        let made = made(&manifold, &marked, wanted, &mut part)?;
        info.edge_length = scale.length_outward(made.1);
        let sheet = Sheet {
            positions: manifold.positions.iter().map(|x| scale.outward(x)).collect(),
            triangles: manifold.triangles.clone(),
            held: (0u32..).zip(&marked).filter(|(_, held)| **held).map(|(v, _)| v).collect(),
            of_asset,
        };
        let proxy = Self::finished(&soup, &manifold, made, sheet.into(), info)?;
        heard(1.0)?;
        Ok(proxy)
    }

    fn finished(
        soup: &Soup,
        manifold: &Manifold,
        (made, edge): (edit::Edit, f64),
        sheet: Arc<Sheet>,
        mut info: Info,
    ) -> Result<Self> {
        let scale = soup.scale();
        let (inward, mut triangles, old) = made.packed();
        crate::collider::sort_triangles(&inward, &mut triangles);
        let positions: Vec<Vec3> = inward.iter().map(|x| scale.outward(x)).collect();
        let checked = Mesh::new(positions, &triangles).map_err(|e| {
            Error::new(ErrorKind::Numerical, format!("no good proxy was found: {e}; ask for more vertices"))
        })?;
        info.n_pieces = checked.n_components;
        let triangles = checked.triangles;
        let qualities = triangles.iter().map(|t| {
            let [a, b, c] = t.map(|v| inward[v as usize]);
            quality(&a, &b, &c)
        });
        (info.worst_quality, info.mean_quality) = (f64::INFINITY, 0.0);
        for q in qualities {
            info.worst_quality = info.worst_quality.min(q);
            info.mean_quality += q / triangles.len() as f64;
        }
        let ground = Ground::new(manifold)?;
        let mut sources = vec![];
        for (x, v) in inward.iter().zip(&old) {
            let near = ground.normals[made.near[*v as usize] as usize];
            let Some(foot) = ground.facing(x, &near, made.near[*v as usize], edge) else {
                return Err(Error::new(ErrorKind::Numerical, "a vertex of the proxy has no place on the asset"));
            };
            let tri = ground.triangles[foot.triangle as usize];
            let vertices = tri.map(|v| soup.asset[manifold.soup[v as usize] as usize]);
            sources.push(Source { vertices, weights: foot.weights });
        }
        let on_proxy = Ground::over(&inward, &triangles)?;
        let nearest_of = |x: &Vec3| {
            let foot = on_proxy.nearest(x, f64::INFINITY, |_| true);
            foot.map_or((0, 0.0), |foot| {
                let corner = (0..3).max_by(|i, j| foot.weights[*i].total_cmp(&foot.weights[*j]).then(j.cmp(i)));
                (triangles[foot.triangle as usize][corner.unwrap_or(0)], foot.squared.sqrt())
            })
        };
        let of_soup: Vec<u32> = soup.positions.iter().map(|x| nearest_of(x).0).collect();
        for (v, x) in manifold.positions.iter().enumerate() {
            let distance = scale.length_outward(nearest_of(x).1);
            if distance > info.furthest.0 {
                info.furthest = (distance, soup.asset[manifold.soup[v] as usize]);
            }
        }
        let nearest = soup.welded.iter().map(|w| if *w == NONE { 0 } else { of_soup[*w as usize] }).collect();
        Ok(Self { positions: checked.positions, triangles, sources, nearest, sheet, info })
    }
}

fn check(options: &Options) -> Result<()> {
    let n = options.n_vertices;
    if !(4..=MOST_VERTICES).contains(&n) {
        return Err(Error::argument(format!("n_vertices is {n}: it must be from 4 to {MOST_VERTICES}")));
    }
    crate::error::require_non_negative("weld", options.weld)?;
    match options.sides {
        Sides::Within(thickness) if !(thickness.is_finite() && thickness > 0.0) => {
            Err(Error::argument(format!("thickness is {thickness:?}: it must be above 0")))
        }
        _ => Ok(()),
    }
}

/// The manifold to be remeshed: of two sides, the sheet in the middle.
fn sheet(soup: &Soup, options: &Options, info: &mut Info) -> Result<Manifold> {
    let thickness = match options.sides {
        Sides::Keep => return Manifold::new(soup, options.cut),
        Sides::Find => 0.0,
        Sides::Within(thickness) => soup.scale().length_inward(thickness),
    };
    let whole = Manifold::new(soup, true)?;
    let Some(found) = sides::middle(soup, &whole, thickness)? else {
        return if whole.n_cut > 0 { Manifold::new(soup, options.cut) } else { Ok(whole) };
    };
    (info.n_sides_joined, info.thickness) = (found.n_dropped, soup.scale().length_outward(found.thickness));
    let kept: Vec<usize> = (0..found.kept.len()).filter(|t| found.kept[*t]).collect();
    let rest = soup.part(&kept);
    let mut manifold = Manifold::new(&rest, options.cut)?;
    for (t, whole_t) in kept.iter().enumerate() {
        for v in manifold.triangles[t] {
            let corner =
                whole.triangles[*whole_t].into_iter().find(|w| whole.soup[*w as usize] == manifold.soup[v as usize]);
            if let Some(w) = corner {
                manifold.positions[v as usize] = found.moved[w as usize];
            }
        }
    }
    Ok(manifold)
}

/// The length of edges for so many vertices over a manifold.
fn edge_over(manifold: &Manifold, ground: &Ground, wanted: usize) -> f64 {
    let open = (0..manifold.twins.len()).filter(|h| manifold.twins[*h] == NONE);
    let length = |h: usize| {
        let tri = manifold.triangles[h / 3];
        (manifold.positions[tri[(h + 1) % 3] as usize] - manifold.positions[tri[h % 3] as usize]).norm()
    };
    let (count, perimeter) = open.fold((0, 0.0), |(count, sum), h| (count + 1, sum + length(h)));
    let (v, e, f) =
        (manifold.positions.len() as f64, (manifold.twins.len() + count) as f64 / 2.0, manifold.triangles.len() as f64);
    edge_length(ground.area(), perimeter, v - e + f, wanted as f64)
}

/// Takes out the pieces that are too small for triangles of the proxy; how many these are. The largest stays.
fn leave_out(manifold: &mut Manifold, wanted: usize) -> usize {
    let (piece, n) = manifold.pieces();
    if n < 2 {
        return 0;
    }
    let mut boxes = vec![(Vec3::repeat(f64::INFINITY), Vec3::repeat(-f64::INFINITY)); n];
    for (v, x) in manifold.positions.iter().enumerate() {
        let (low, high) = &mut boxes[piece[v] as usize];
        (*low, *high) = (low.inf(x), high.sup(x));
    }
    let sizes: Vec<f64> = boxes.iter().map(|(low, high)| (high - low).norm()).collect();
    let largest = (0..n).max_by(|i, j| sizes[*i].total_cmp(&sizes[*j]).then(j.cmp(i))).unwrap_or(0);
    let mut out = vec![false; n];
    for _ in 0..3 {
        let stays = |t: usize| !out[piece[manifold.triangles[t][0] as usize] as usize];
        let area: f64 = (0..manifold.triangles.len()).filter(|t| stays(*t)).map(|t| area_of(manifold, t)).sum();
        let edge = edge_length(area, 0.0, 1.0, wanted as f64);
        let now: Vec<bool> = (0..n).map(|p| p != largest && sizes[p] < SMALLEST_PIECE * edge).collect();
        if now == out {
            break;
        }
        out = now;
    }
    let count = out.iter().filter(|o| **o).count();
    if count > 0 {
        let stays: Vec<bool> = manifold.triangles.iter().map(|t| !out[piece[t[0] as usize] as usize]).collect();
        manifold.keep(|t| stays[t]);
    }
    count
}

fn area_of(manifold: &Manifold, t: usize) -> f64 {
    let [a, b, c] = manifold.triangles[t].map(|v| manifold.positions[v as usize]);
    0.5 * (b - a).cross(&(c - a)).norm()
}

/// Of each vertex of the asset, the first of the manifold's that it became, or of one on a side that was left out, no further off than `reach`, the nearest; or [`NONE`].
fn of_asset(soup: &Soup, manifold: &Manifold, reach: f64) -> Result<Vec<u32>> {
    let mut of_soup = vec![NONE; soup.positions.len()];
    manifold.soup.iter().enumerate().rev().for_each(|(number, v)| of_soup[*v as usize] = number as u32);
    if reach > 0.0 {
        let ground = Ground::new(manifold)?;
        for (x, number) in soup.positions.iter().zip(&mut of_soup).filter(|(_, number)| **number == NONE) {
            let Some(foot) = ground.nearest(x, reach, |_| true) else { continue };
            let corner = (0..3).max_by(|i, j| foot.weights[*i].total_cmp(&foot.weights[*j]).then(j.cmp(i)));
            *number = manifold.triangles[foot.triangle as usize][corner.unwrap_or(0)];
        }
    }
    Ok(soup.welded.iter().map(|w| of_soup.get(*w as usize).copied().unwrap_or(NONE)).collect())
}

/// Of the manifold's vertices, which are `held` ones of the asset; none where no one is.
fn marked(soup: &Soup, manifold: &Manifold, held: &[u32]) -> Vec<bool> {
    if held.is_empty() {
        return vec![];
    }
    let mut of_soup = vec![false; soup.positions.len()];
    held.iter().map(|v| soup.welded[*v as usize]).filter(|w| *w != NONE).for_each(|w| of_soup[w as usize] = true);
    manifold.soup.iter().map(|v| of_soup[*v as usize]).collect()
}

/// The remesh with tips, creases and the outline of what is held, or without some of these where they leave bad triangles.
fn made(manifold: &Manifold, held: &[bool], wanted: usize, heard: &mut remesh::Heard) -> Result<(edit::Edit, f64)> {
    let ground = Ground::new(manifold)?;
    let edge = edge_over(manifold, &ground, wanted);
    // What is held throughout does not move, whatever its triangles are.
    let moves = |mesh: &edit::Edit, t: &[u32; 3]| {
        let middle = t.iter().map(|v| mesh.at(*v)).sum::<Vec3>() / 3.0;
        let near = mesh.near[t[0] as usize];
        let foot = ground.facing(&middle, &ground.normals[near as usize], near, edge);
        foot.is_none_or(|foot| !ground.triangles[foot.triangle as usize].iter().all(|v| held[*v as usize]))
    };
    let worst = |mesh: &edit::Edit| {
        let alive = mesh.triangles.iter().filter(|t| t[0] != NONE);
        let of = |t: &[u32; 3]| quality(mesh.at(t[0]), mesh.at(t[1]), mesh.at(t[2]));
        alive
            .map(|t| (t, of(t)))
            .filter(|(t, q)| *q >= 0.9 || held.is_empty() || moves(mesh, t))
            .map(|(_, q)| q)
            .fold(1.0, f64::min)
    };
    let mut best: Option<(edit::Edit, f64)> = None;
    let tries = [
        (wanted / TIP, true, held, WORST_WITH_CREASES),
        (wanted / TIP, false, held, WORST_WITH_CREASES),
        (0, false, held, WORST_HELD),
        (0, false, &[][..], 0.0),
    ];
    for (most_tips, creases, held, least) in tries {
        let lines = Lines::new(manifold, &ground, edge, Kept { most_tips, creases, held })?;
        let made = remesh(manifold, &ground, &lines, wanted, edge, heard)?;
        let found = worst(&made.0);
        if best.as_ref().is_none_or(|best| found > worst(&best.0)) {
            best = Some(made);
        }
        if !lines.any_inner || found >= least {
            break;
        }
    }
    best.ok_or_else(|| Error::new(ErrorKind::Numerical, "no good proxy was found: ask for more vertices"))
}
