//! Against physics: the elastica, plate frequencies, and the warp's own error on an arc.

use crate::error::{observed_order, relative_l2};
use crate::library::{Library, Material, Model};
use crate::mesh::{Mesh, P3};
use crate::methods::{PAPER, method};
use anyhow::{Context, Result};
use std::path::Path;

/// Rows of numbers of a reference CSV, comments and header left out.
fn reference(data: &Path, name: &str) -> Result<Vec<Vec<f64>>> {
    let text = std::fs::read_to_string(data.join("reference").join(name)).context(name.to_owned())?;
    let lines = text.lines().filter(|l| !l.starts_with('#')).skip(1);
    lines.map(|l| l.split(',').map(|w| Ok(w.parse()?)).collect()).collect()
}

/// One load of the elastica on one strip.
pub struct Elastica {
    pub kind: &'static str,
    pub load: f64,
    pub slope_degrees: f64,
    /// Length over width; rows of triangles across: a fifth of it.
    pub slenderness: f64,
    /// Distance of the tip to the elastica's, over the elastica's tip displacement.
    pub shell: f64,
    /// Distance of all vertices to the nonlinear shell's on the same mesh, relative.
    pub warp: f64,
    pub lma: f64,
}

/// Rigidity EI = D (1 − ν²) b of a strip with free edges, D = 6 k_B, ν = −1/3.
const NARROW: f64 = 6.0 * (1.0 - 1.0 / 9.0);

pub fn elastica(library: &Library, data: &Path, full: bool) -> Result<Vec<Elastica>> {
    let strips: &[(f64, usize)] = if full { &[(10.0, 2), (20.0, 4), (40.0, 8)] } else { &[(10.0, 2), (20.0, 4)] };
    let mut all = vec![];
    for (kind, file) in [("tip load", "elastica_tip_load.csv"), ("self weight", "elastica_self_weight.csv")] {
        let table = reference(data, file)?;
        for &(slenderness, rows) in strips {
            let width = 1.0 / slenderness;
            let mesh = Mesh::strip(1.0, width, rows);
            let material = Material { area: 1e4, length: 1e4, bend: 1.0, density: 1.0 };
            let model = library.model(&mesh, material, &mesh.root(), 8, true)?;
            for row in table.iter().filter(|r| [1.0, 2.0, 3.0, 5.0].contains(&r[0])) {
                all.push(elastica_case(kind, row, (slenderness, rows), &mesh, &model)?);
            }
        }
    }
    Ok(all)
}

fn elastica_case(
    kind: &'static str,
    row: &[f64],
    (slenderness, rows): (f64, usize),
    mesh: &Mesh,
    model: &Model,
) -> Result<Elastica> {
    let (width, length) = (1.0 / slenderness, mesh.length());
    let end = mesh.vertices_where(|_, p| p[0] > mesh.length() - 1e-6);
    let at_edge = |v: &u32| mesh.place[*v as usize][1].abs() > 0.5 * width - 1e-9;
    let share: Vec<f64> = end.iter().map(|v| if at_edge(v) { 0.5 } else { 1.0 } / rows as f64).collect();
    let solved = |key| -> Result<Vec<P3>> {
        let mut state = model.state(method(key).method, method(key).integrator)?;
        if kind == "tip load" {
            let forces: Vec<P3> =
                share.iter().map(|s| [0.0, 0.0, -s * row[0] * NARROW * width / length.powi(2)]).collect();
            state.set_forces(&end, &forces)?;
        } else {
            state.set_gravity([0.0, 0.0, -row[0] * NARROW / length.powi(3)])?;
        }
        state.equilibrium()?;
        state.positions()
    };
    let shell = solved("shell_implicit")?;
    let mean = |c: usize| -> f64 {
        end.iter().zip(&share).map(|(&v, s)| s * (shell[v as usize][c] - mesh.positions[v as usize][c])).sum()
    };
    let (drop, shortening) = (-mean(2) / length, -mean(0) / length);
    let weights = mesh.vertex_areas();
    let against = |x: Result<Vec<P3>>| {
        x.map_or(f64::NAN, |x| relative_l2([(&x[..], &shell[..])].into_iter(), &mesh.positions, &weights))
    };
    Ok(Elastica {
        kind,
        load: row[0],
        slope_degrees: row[3].to_degrees(),
        slenderness,
        shell: (drop - row[1]).hypot(shortening - row[2]) / row[1].hypot(row[2]),
        warp: against(solved(PAPER)),
        lma: against(solved("lma_implicit")),
    })
}

/// One frequency of a cantilever plate on one mesh.
pub struct PlateMode {
    pub rows: usize,
    pub edge: f64,
    pub mode: usize,
    /// λ = ω a² √(ρh/D), here and by the Ritz series for ν = −1/3.
    pub here: f64,
    pub there: f64,
    /// Between this mesh and the one before.
    pub order: f64,
}

pub fn plate(library: &Library, data: &Path, full: bool) -> Result<Vec<PlateMode>> {
    let table = reference(data, "plate_kirchhoff_CFFF_ritz.csv")?;
    let row = table.iter().find(|r| r[0] == 1.0 && r[1] < -0.3).context("a square plate of ν = −1/3")?;
    // Heights of 15 and more rows are whole numbers of half edges to 0.08 %, so the plate is as square.
    let ladder: &[usize] = if full { &[15, 30, 60] } else { &[15, 30] };
    let mut all: Vec<PlateMode> = vec![];
    for &rows in ladder {
        let mesh = Mesh::strip(1.0, 1.0, rows);
        let material = Material { area: 1e6, length: 1e6, bend: 1.0, density: 1.0 };
        let model = library.model(&mesh, material, &mesh.root(), 6, true)?;
        let edge = 2.0 / (rows as f64 * 3f64.sqrt());
        for (mode, hertz) in model.frequencies()?.into_iter().enumerate() {
            let (here, there) = (hertz * std::f64::consts::TAU * mesh.length().powi(2) / 6f64.sqrt(), row[2 + mode]);
            let error = |x: f64| (x / there - 1.0).abs();
            let last = all.iter().rev().find(|p| p.mode == mode + 1);
            let order = last.map_or(f64::NAN, |p| observed_order([error(p.here), error(here)], [p.edge, edge]));
            all.push(PlateMode { rows, edge, mode: mode + 1, here, there, order });
        }
    }
    Ok(all)
}

/// A strip bent to an arc: the warp's tip beside the exact arc's and the one that the method's formula gives.
pub struct Arc {
    pub degrees: f64,
    pub modes: usize,
    /// ‖formula − exact‖/length: the method's own error.
    pub method: f64,
    /// ‖library − formula‖/length: what modes, mesh and code add.
    pub implementation: f64,
}

/// Sets the amplitudes of a strip to those of w = κs²/2 (lengths over the strip's) and reads where
/// the warp puts its tip.
pub fn arc(library: &Library, data: &Path, full: bool) -> Result<Vec<Arc>> {
    let mesh = Mesh::strip(1.0, 0.1, 4);
    let material = Material { area: 1e4, length: 1e4, bend: 1.0, density: 1.0 };
    let length = mesh.length();
    let tip = mesh.nearest([length, 0.0]);
    let mut all = vec![];
    let counts: &[usize] = if full { &[4, 16, 64] } else { &[4, 16] };
    for &modes in counts {
        let model = library.model(&mesh, material, &mesh.root(), modes, true)?;
        let weights = mesh.vertex_areas();
        let shapes: Vec<Vec<P3>> = (0..modes).map(|k| model.mode_shape(k)).collect::<Result<_>>()?;
        for row in reference(data, "modal_warping_arc_error.csv")?.iter().filter(|r| r[0] <= 90.0) {
            let bend = row[0].to_radians();
            let lift = |v: usize| 0.5 * bend * mesh.place[v][0].max(0.0).powi(2) / length;
            let amplitude = |phi: &Vec<P3>| (0..phi.len()).map(|v| weights[v] * phi[v][2] * lift(v)).sum();
            let q: Vec<f64> = shapes.iter().map(amplitude).collect();
            let mut state = model.state(method(PAPER).method, 0)?;
            state.set_amplitudes(&q)?;
            let x = state.positions()?[tip];
            let (drop, short) = (x[2] / length, (length - x[0]) / length);
            let (exact_drop, exact_short, formula_drop, formula_short) = (row[1], row[2], row[3], row[4]);
            all.push(Arc {
                degrees: row[0],
                modes,
                method: (formula_drop - exact_drop).hypot(formula_short - exact_short),
                implementation: (drop - formula_drop).hypot(short - formula_short),
            });
        }
    }
    Ok(all)
}
