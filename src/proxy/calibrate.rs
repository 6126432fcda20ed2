//! A shell on a proxy whose stiffness is fitted so that it answers as one on the asset does: what a coarse mesh gets wrong is, where displacements are small,
//! how stiff it is, and where.
//!
//!   K u = M q,  q the three axes, then M⁻¹-images of the answers: q_{k+3} = u_k made M-orthonormal
//!
//! are the answers to gravity and to the loads of the slowest motions, of the finer shell once, of the coarse one at every step. Factors of stretching and
//! of bending, each exp Σ θ_i φ_i with smooth φ_i that sum to 1, are found by Gauss–Newton from the answers' differences at the coarse vertices.

use super::{MOST_VERTICES, Options, Proxy, Sheet, Sides};
use crate::material::{Factors, Map, Orthotropy, Quantity};
use crate::mesh::NONE;
use crate::shell::Make;
use crate::sparse::{Factor, Symbolic};
use crate::{Error, ErrorKind, Mesh, Result, Shell, Supports, Vec3};
use faer::Mat;
use std::sync::Arc;

mod fit;
mod patches;
mod sources;

use fit::Fit;
use patches::Patches;
use sources::Sources;

/// Blocks of three loads: gravity, and twice what follows from it.
const BLOCKS: usize = 3;
/// A vertex further from the finer mesh than this, in sizes, says that the meshes are not of one thing.
const FURTHEST: f64 = 0.1;
/// Of the largest answer's, by root mean square: a smaller one is none.
const LEAST: f64 = 1e-12;
/// Of its length, what a load must have that others do not give already.
const NEW: f64 = 1e-6;

/// An asset of more vertices than this, and than so many times the proxy's, is compared by a proxy of so many.
const FINEST: usize = 20_000;
const FINER: usize = 10;
/// One that has not so many times the proxy's vertices says no more than that, and one of so many is compared.
const COARSEST: usize = 2;
const INSTEAD: usize = 4;

/// What a calibration found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Calibration {
    /// Patches that have factors of their own.
    pub n_patches: usize,
    /// Vertices of the asset made ready, or of the finer proxy in its place.
    pub n_compared: usize,
    /// Loads that were compared.
    pub n_loads: usize,
    /// Root mean square over gravity along the axes of ‖u − u_fine‖/‖u_fine‖, as the shell was given and as it is now.
    pub difference: [f64; 2],
    /// Least and largest factor against stretching.
    pub stretching: [f64; 2],
    /// Least and largest factor against bending.
    pub bending: [f64; 2],
    /// Its mass over the finer shell's, as it was given.
    pub mass: f64,
}

/// `shell`, on the mesh of `proxy`, with the stiffness by which it answers as the same sheet does on the asset, and with the masses of that. Creases, ties and rest shapes are
/// left out of what is compared, and keep what they are. `held` are the asset's vertices that supports hold, none for those that the proxy was made with. `heard` is told the share that is done.
pub fn calibrate(
    shell: &Shell,
    proxy: &Proxy,
    held: &[u32],
    heard: &mut dyn FnMut(f64) -> Result<()>,
) -> Result<(Shell, Calibration)> {
    if shell.mesh.positions.len() != proxy.positions.len() || shell.mesh.triangles.len() != proxy.triangles.len() {
        let [own, other] = [shell.mesh.positions.len(), proxy.positions.len()];
        return Err(Error::argument(format!(
            "the model has {own} vertices, the proxy {other}: the model must be on the proxy's mesh"
        )));
    }
    let held = held_there(proxy, held)?;
    heard(0.0)?;
    let (coarse, fine) = pair(shell, proxy, &held, &mut |share| heard(0.2 * share))?;
    let sources = Sources::new(&coarse.mesh.positions, used(&coarse), &fine, FURTHEST)?;
    let onto = Sources::new(&fine.mesh.positions, used(&fine), &coarse, f64::INFINITY)?;
    let patches = Patches::new(&coarse)?;
    let masses = masses(&coarse, &fine, &patches, &onto);
    let weighed = coarse.stiffened(&masses)?;
    let answers = Answers::of(&fine)?;
    heard(0.4)?;
    let mut fit = Fit::new(&coarse, &weighed, &patches, &answers, [&sources, &onto])?;
    let (mut factors, found) = fit.run(&mut |share| heard(0.4 + 0.6 * share))?;
    factors.iter_mut().zip(masses).for_each(|(factors, masses)| factors.mass = masses.mass);
    let calibrated = shell.stiffened(&factors)?;
    heard(1.0)?;
    Ok((
        calibrated,
        Calibration { mass: coarse.total_mass / fine.total_mass, n_compared: fine.mesh.positions.len(), ..found },
    ))
}

/// Of what the proxy was made of, the vertices that are held: those given, of the asset, or else those that it was made with.
fn held_there(proxy: &Proxy, given: &[u32]) -> Result<Vec<u32>> {
    let (sheet, n) = (&proxy.sheet, proxy.nearest.len());
    if let Some((i, v)) = given.iter().enumerate().find(|(_, v)| **v as usize >= n) {
        return Err(Error::argument(format!("held[{i}] is vertex {v}, but the asset has {n} vertices")));
    }
    let mut held: Vec<u32> = match given {
        [] => sheet.held.clone(),
        _ => given.iter().map(|v| sheet.of_asset[*v as usize]).filter(|v| *v != NONE).collect(),
    };
    held.sort_unstable();
    held.dedup();
    match held.is_empty() {
        true => Err(loose("the asset")),
        false => Ok(held),
    }
}

/// The plain sheets that are compared: on the proxy, and on the asset made ready.
fn pair(
    shell: &Shell,
    proxy: &Proxy,
    held: &[u32],
    heard: &mut dyn FnMut(f64) -> Result<()>,
) -> Result<(Shell, Shell)> {
    let clamped: Vec<u32> = (0..shell.held.len() as u32).filter(|v| shell.is_clamped(*v as usize)).collect();
    let fixed = (0..shell.held.len() as u32).filter(|v| shell.held[*v as usize]).collect();
    let along = shell.rollers.iter().flat_map(|roller| roller.directions().map(|n| (roller.vertex, n))).collect();
    let supports = Supports { fixed, clamped, along, symmetric: vec![] };
    let mesh = Mesh::new(proxy.positions.clone(), &proxy.triangles)?;
    let maps = shell.maps.all().to_vec();
    let fibres = shell.orthotropy.as_deref().map(Orthotropy::fibres);
    let coarse = Shell::made(mesh, Make { maps, fibres, ..Make::of(shell.material) }, &supports)?;
    if coarse.free.is_empty() {
        return Err(Error::argument("no vertex of the model moves: there is nothing to calibrate"));
    }
    let (mesh, held) = fine_mesh(proxy, held, heard)?;
    let onto = Sources::new(&mesh.positions, |_| true, &coarse, f64::INFINITY)?;
    let mut maps: Vec<Map> = shell.maps.all().iter().map(|map| onto.map(map, &mesh.triangles)).collect();
    let mut material = shell.material;
    if let Some(k) = Quantity::KLength.of(&mut material) {
        // Stretching is resisted by k_length over the length of edges.
        let shorter = mean_edge(&mesh) / mean_edge(&coarse.mesh);
        *k *= shorter;
        let mapped = maps.iter_mut().filter(|map| map.quantity == Quantity::KLength);
        mapped.flat_map(|map| &mut map.values).for_each(|k| *k *= shorter);
    }
    let fibres = shell.orthotropy.as_deref().map(|fibres| onto.fibres(fibres, &mesh.triangles));
    let supports = carried(&held, &onto, shell);
    let fine = Shell::made(mesh, Make { maps, fibres, ..Make::of(material) }, &supports)?;
    Ok((coarse, fine))
}

fn mean_edge(mesh: &Mesh) -> f64 {
    let length = |[a, b]: [u32; 2]| (mesh.positions[b as usize] - mesh.positions[a as usize]).norm();
    mesh.edges.iter().map(|edge| length(edge.vertices)).sum::<f64>() / mesh.edges.len() as f64
}

/// What holds the asset: its `held` vertices as the nearest of the proxy's are. Where neighbours of these are held that stand for none, they are clamped.
fn carried(held: &[u32], onto: &Sources, shell: &Shell) -> Supports {
    let near: Vec<u32> = held.iter().map(|v| onto.corner(*v as usize)).collect();
    let mut stands = vec![false; shell.mass.len()];
    near.iter().for_each(|v| stands[*v as usize] = true);
    let mut clamped: Vec<bool> = (0..stands.len()).map(|v| shell.is_clamped(v)).collect();
    for edge in &shell.mesh.edges {
        let [a, b] = edge.vertices.map(|v| v as usize);
        for (v, other) in [(a, b), (b, a)] {
            clamped[v] |= stands[v] && shell.held[v] && shell.held[other] && !stands[other];
        }
    }
    let mut carried = Supports::default();
    for (v, near) in held.iter().zip(near) {
        match shell.roller_of(near) {
            Some(roller) if !shell.held[near as usize] => carried.along.extend(roller.directions().map(|n| (*v, n))),
            _ if clamped[near as usize] => carried.clamped.push(*v),
            _ => carried.fixed.push(*v),
        }
    }
    carried
}

/// The asset made ready, and which of its vertices are held; in place of one that has very many, or hardly more than the proxy, a finer proxy.
fn fine_mesh(proxy: &Proxy, held: &[u32], heard: &mut dyn FnMut(f64) -> Result<()>) -> Result<(Mesh, Vec<u32>)> {
    let Sheet { positions, triangles, .. } = &*proxy.sheet;
    let (own, most) = (proxy.positions.len(), FINEST.max(FINER * proxy.positions.len()));
    if (COARSEST * own..=most).contains(&positions.len()) {
        return Ok((Mesh::new(positions.clone(), triangles)?, held.to_vec()));
    }
    let n_vertices = if positions.len() > most { most } else { INSTEAD * own }.min(MOST_VERTICES);
    let options = Options { n_vertices, weld: 0.0, sides: Sides::Keep, cut: true, keep_pieces: true };
    let finer = Proxy::holding(positions, triangles, held, &options, heard)?;
    let mut nearest: Vec<u32> = held.iter().map(|v| finer.nearest[*v as usize]).collect();
    nearest.sort_unstable();
    nearest.dedup();
    Ok((Mesh::new(finer.positions, &finer.triangles)?, nearest))
}

/// The vertices that triangles use.
fn used(shell: &Shell) -> impl Fn(usize) -> bool + '_ {
    |v| shell.mass[v] > 0.0
}

/// Factors of mass alone, by which every patch weighs as much as that part of the finer shell.
fn masses(shell: &Shell, fine: &Shell, patches: &Patches, onto: &Sources) -> Vec<Factors> {
    let n = patches.len();
    let (mut own, mut wanted) = (vec![0.0; n], vec![0.0; n]);
    for v in (0..shell.mass.len()).filter(|v| shell.mass[*v] > 0.0) {
        patches.at(v).iter().for_each(|(i, phi)| own[*i as usize] += phi * shell.mass[v]);
    }
    for (v, (corners, weights)) in onto.of.iter().enumerate().filter(|(v, _)| fine.mass[*v] > 0.0) {
        for (corner, weight) in corners.iter().zip(weights) {
            patches.at(*corner as usize).iter().for_each(|(i, phi)| wanted[*i as usize] += phi * weight * fine.mass[v]);
        }
    }
    let bound = fit::LARGEST;
    let ratios: Vec<f64> =
        own.iter().zip(&wanted).map(|(own, wanted)| (wanted / own).clamp(1.0 / bound, bound)).collect();
    let of = |t: &[u32; 3]| Factors { mass: patches.on(t, &ratios), ..Factors::ONE };
    shell.mesh.triangles.iter().map(of).collect()
}

/// A load of a shell.
pub enum Load {
    /// An acceleration of all its mass.
    Gravity(Vec3),
    /// Forces (n_vertices).
    Forces(Vec<Vec3>),
}

impl Load {
    pub fn on(&self, shell: &Shell) -> Vec<Vec3> {
        match self {
            Self::Gravity(g) => shell.mass.iter().map(|m| *m * g).collect(),
            Self::Forces(forces) => forces.clone(),
        }
    }
}

/// Loads and their answers (n_vertices).
pub struct Answers {
    pub of: Vec<(Load, Vec<Vec3>)>,
}

impl Answers {
    fn of(fine: &Shell) -> Result<Self> {
        let solver = Static::new(fine)?.ok_or_else(|| loose("the asset"))?;
        let dot = |a: &[Vec3], b: &[Vec3]| -> f64 { (0..a.len()).map(|v| fine.mass[v] * a[v].dot(&b[v])).sum() };
        let mut block: Vec<Load> = (0..3).map(|c| Load::Gravity(Vec3::ith(c, 1.0))).collect();
        let mut basis: Vec<Vec<Vec3>> = vec![];
        let mut of: Vec<(Load, Vec<Vec3>)> = vec![];
        for _ in 0..BLOCKS {
            let forces: Vec<Vec<Vec3>> = block.iter().map(|load| load.on(fine)).collect();
            let answers = solver.solve(&forces)?;
            let largest = answers.iter().map(|u| dot(u, u)).fold(0.0, f64::max).sqrt();
            let mut next = vec![];
            for (load, u) in block.into_iter().zip(answers) {
                let length = dot(&u, &u).sqrt();
                if length.is_nan() || length <= LEAST * largest {
                    continue; // held along this axis
                }
                let mut x: Vec<Vec3> = u.iter().map(|u| u / length).collect();
                for _ in 0..2 {
                    for b in &basis {
                        let along = dot(&x, b);
                        x.iter_mut().zip(b).for_each(|(x, b)| *x -= along * b);
                    }
                }
                let left = dot(&x, &x).sqrt();
                if left > NEW {
                    x.iter_mut().for_each(|x| *x /= left);
                    next.push(Load::Forces(x.iter().zip(&fine.mass).map(|(x, m)| *m * x).collect()));
                    basis.push(x);
                }
                of.push((load, u));
            }
            block = next;
        }
        match of.iter().flat_map(|(_, u)| u).flatten().all(|c| c.is_finite()) {
            true if !of.is_empty() => Ok(Self { of }),
            _ => Err(Error::new(ErrorKind::Numerical, "the asset's answers to gravity are no numbers")),
        }
    }
}

fn loose(name: &str) -> Error {
    let message = format!(
        "{name} can move freely, so that it has no answer to gravity: hold every piece of it, and name what is held as held"
    );
    Error::new(ErrorKind::Unsupported, message)
}

/// Linear answers of a shell at rest.
pub struct Static<'a> {
    shell: &'a Shell,
    symbolic: Arc<Symbolic>,
    factor: Factor,
}

impl<'a> Static<'a> {
    /// None of a shell that moves freely.
    pub fn new(shell: &'a Shell) -> Result<Option<Self>> {
        let mut matrix = shell.matrix(&[]);
        shell.energy.visit_rest_rows(&mut |(vertices, row)| {
            matrix.add_element(vertices, |p, q| row[p] * row[q].transpose());
        });
        matrix.fill_rollers(|own| own);
        matrix.require_finite()?;
        let pivots: Vec<f64> = matrix.diagonal().collect();
        let symbolic = shell.analysis(matrix.lower.symbolic())?;
        let mut factor = symbolic.factor()?;
        if pivots.iter().any(|p| *p <= 0.0) || !symbolic.refactorize(&matrix.lower, &mut factor)? {
            return Ok(None);
        }
        Ok(Some(Self { shell, symbolic, factor }))
    }

    /// X ← K⁻¹X of unknowns.
    pub fn solve_in_place(&self, x: &mut Mat<f64>) -> Result<()> {
        self.project(x);
        self.symbolic.solve_in_place(&self.factor, x.as_mut())?;
        self.project(x);
        Ok(())
    }

    fn project(&self, x: &mut Mat<f64>) {
        for roller in self.shell.rollers.iter() {
            let Ok(i) = self.shell.free.binary_search(&roller.vertex) else { continue };
            for j in 0..x.ncols() {
                let kept = roller.free * Vec3::from_fn(|c, _| x[(3 * i + c, j)]);
                (0..3).for_each(|c| x[(3 * i + c, j)] = kept[c]);
            }
        }
    }

    /// The answers to forces (n_vertices each).
    pub fn solve(&self, forces: &[Vec<Vec3>]) -> Result<Vec<Vec<Vec3>>> {
        let free = &self.shell.free;
        let mut x = Mat::from_fn(3 * free.len(), forces.len(), |i, j| forces[j][free[i / 3] as usize][i % 3]);
        self.solve_in_place(&mut x)?;
        Ok((0..forces.len()).map(|j| self.shell.scatter(x.col_as_slice(j))).collect())
    }
}
