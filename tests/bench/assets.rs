//! What a proxy of an asset is off: its frequencies and its displacements against those of the asset simulated itself, and of that what following leaves. As it is, and calibrated.
//!
//! usage: assets [--parts] [--only ASSET] [--docs FILE]
//!
//! `--parts` tells of the hat alone how much of its error is the shape, the triangles and following.
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;
#[path = "docs.rs"]
mod docs;

use common::{error, leaf, modes_of, read_obj};
use shellwarp::binding::{Binding, Points};
use shellwarp::material::ElasticSheet;
use shellwarp::modes::Modes;
use shellwarp::proxy::{Options, Proxy, Sides, Source, calibrate};
use shellwarp::reference::Solver;
use shellwarp::{Mesh, Shell, Supports, Vec3};
use std::collections::HashMap;
use std::fmt::Write;
use std::sync::Arc;

const MODES: usize = 10;
/// The share of the vertices, whether what is held keeps its outline, and whether the stiffness is calibrated.
const PROXIES: [(usize, bool, bool); 6] =
    [(10, false, false), (10, true, false), (10, true, true), (4, false, false), (4, true, false), (4, true, true)];
const DIRECTIONS: [[f64; 3]; 3] = [[1.0, 0.2, 0.1], [0.1, 1.0, 0.2], [0.2, 0.1, 1.0]];
/// Of the size, to first order.
const AIM: f64 = 0.01;
/// Of the size.
const THICKNESS: f64 = 1.0 / 200.0;

struct Asset {
    name: &'static str,
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    held: Vec<u32>,
}

fn asset(
    name: &'static str,
    (positions, triangles): (Vec<Vec3>, Vec<[u32; 3]>),
    is_held: impl Fn(&Vec3) -> bool,
) -> Asset {
    let held = (0..positions.len() as u32).filter(|v| is_held(&positions[*v as usize])).collect();
    Asset { name, positions, triangles, held }
}

/// Whether a head is there for the hat to sit on.
fn band(x: &Vec3) -> bool {
    (x.x.hypot(x.z + 6.0) - 10.0).abs() < 2.0 && (x.y - 168.6).abs() < 5.0
}

/// The others are held at the stem, the collar, the feet.
fn assets() -> [Asset; 5] {
    let leaf = leaf(3).mesh;
    let hat = read_obj("character_hat.obj");
    let fine_hat = {
        let held: Vec<bool> = hat.0.iter().map(band).collect();
        let (positions, triangles, held) = halved(&hat.0, &hat.1, &held);
        let held = (0..positions.len() as u32).filter(|v| held[*v as usize]).collect();
        Asset { name: "hat, each triangle in four", positions, triangles, held }
    };
    [
        asset("leaf", (leaf.positions.clone(), leaf.triangles.clone()), |x| x.x < 0.06),
        asset("hat", hat, band),
        fine_hat,
        asset("shirt", read_obj("shirt.obj"), |x| x.y > 145.0),
        asset("dinosaur", read_obj("dinosaur.obj"), |x| x.y < 0.02),
    ]
}

fn shell(positions: &[Vec3], triangles: &[[u32; 3]], fixed: Vec<u32>, size: f64) -> Arc<Shell> {
    let sheet = ElasticSheet { young: 1e9, poisson: 0.3, thickness: THICKNESS * size, volume_density: 1000.0 };
    let mesh = Mesh::new(positions.to_vec(), triangles).unwrap();
    Arc::new(Shell::new(mesh, sheet, &Supports { fixed, ..Default::default() }).unwrap())
}

fn settled(shell: &Arc<Shell>, forces: &[Vec3]) -> Vec<Vec3> {
    let rest = vec![Vec3::zeros(); shell.mass.len()];
    let mut solver = Solver::new(shell.clone()).unwrap();
    solver.equilibrium(&rest, forces, &Default::default(), &mut |_| Ok(())).unwrap().displacement
}

/// Where points go that follow a shell displaced by `u`, less where they were.
fn followed(binding: &Binding, shell: &Shell, u: &[Vec3], rest: &[Vec3]) -> Vec<Vec3> {
    let x = shell.mesh.positions.iter().zip(u).map(|(x, u)| x + u).collect();
    let mut out = vec![Vec3::zeros(); rest.len()];
    binding.pose(x, None).unwrap().positions(0..rest.len(), |i, x| out[i] = x - rest[i]);
    out
}

fn frequencies(modes: &Modes) -> Vec<f64> {
    modes.eigenvalues[..MODES].iter().map(|lambda| lambda.sqrt()).collect()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// What each load does to a shell.
#[derive(Clone, Copy)]
enum Load {
    /// An acceleration.
    Gravity(Vec3),
    /// Force per area, along the normals.
    Pressure(f64),
    /// An acceleration of what is near the vertex furthest from what is held.
    Pull(Vec3, Vec3, f64),
}

impl Load {
    fn on(&self, shell: &Shell) -> Vec<Vec3> {
        let x = &shell.mesh.positions;
        match *self {
            Self::Gravity(g) => shell.mass.iter().map(|m| *m * g).collect(),
            Self::Pull(g, tip, reach) => {
                let share = |x: &Vec3| (-(x - tip).norm_squared() / (reach * reach)).exp();
                shell.mass.iter().zip(x).map(|(m, x)| *m * share(x) * g).collect()
            }
            Self::Pressure(p) => {
                let mut forces = vec![Vec3::zeros(); x.len()];
                for t in &shell.mesh.triangles {
                    let [a, b, c] = t.map(|v| x[v as usize]);
                    t.iter().for_each(|v| forces[*v as usize] += p / 6.0 * (b - a).cross(&(c - a)));
                }
                forces
            }
        }
    }

    fn times(&self, factor: f64) -> Self {
        match *self {
            Self::Gravity(g) => Self::Gravity(factor * g),
            Self::Pull(g, tip, reach) => Self::Pull(factor * g, tip, reach),
            Self::Pressure(p) => Self::Pressure(factor * p),
        }
    }
}

/// The load that moves the shell by [`AIM`], as its modes tell.
fn aimed(shell: &Shell, modes: &Modes, load: Load) -> Load {
    let forces = load.on(shell);
    let mut u = vec![Vec3::zeros(); shell.mass.len()];
    for (shape, lambda) in modes.shapes.iter().zip(&modes.eigenvalues) {
        let work: f64 = shape.iter().zip(&forces).map(|(phi, f)| phi.dot(f)).sum();
        u.iter_mut().zip(shape).for_each(|(u, phi)| *u += phi * (work / lambda));
    }
    load.times(AIM * shell.mesh.size / u.iter().map(|u| u.norm()).fold(0.0, f64::max))
}

/// Of the size: how far a pull reaches. Of the first loads' displacements: how far the last go.
const REACH: f64 = 0.1;
const FURTHER: f64 = 5.0;

fn rows(asset: &Asset, table: &mut String, others: &mut String) {
    let Asset { name, positions, triangles, held } = asset;
    let size = Mesh::new(positions.clone(), triangles).unwrap().size;
    let own = shell(positions, triangles, held.clone(), size);
    let modes = modes_of(&own, MODES);
    let own_frequencies = frequencies(&modes);
    let away = |v: &u32| {
        held.iter().map(|h| (positions[*h as usize] - positions[*v as usize]).norm()).fold(f64::INFINITY, f64::min)
    };
    let tip = *own.free.iter().max_by(|v, w| away(v).total_cmp(&away(w))).unwrap();
    let gravity = DIRECTIONS.map(|along| aimed(&own, &modes, Load::Gravity(along.into())));
    let pulls =
        [0, 1, 2].map(|c| aimed(&own, &modes, Load::Pull(Vec3::ith(c, 1.0), positions[tip as usize], REACH * size)));
    let mut loads: Vec<Load> = gravity.into_iter().chain(pulls).collect();
    loads.push(aimed(&own, &modes, Load::Pressure(1.0)));
    loads.extend(gravity.map(|load| load.times(FURTHER)));
    let exact: Vec<Vec<Vec3>> = loads.iter().map(|load| settled(&own, &load.on(&own))).collect();
    for (share, keep, fit) in PROXIES {
        let n_vertices = positions.len() / share;
        let options = Options { n_vertices, weld: 0.0, sides: Sides::Find, cut: false, keep_pieces: false };
        let made =
            Proxy::holding(positions, triangles, if keep { held } else { &[] }, &options, &mut |_| Ok(())).unwrap();
        let mut fixed: Vec<u32> = held.iter().map(|v| made.nearest[*v as usize]).collect();
        fixed.sort_unstable();
        fixed.dedup();
        let mut proxy = shell(&made.positions, &made.triangles, fixed, size);
        if fit {
            proxy = Arc::new(calibrate(&proxy, &made, &[], &mut |_| Ok(())).unwrap().0);
        }
        let off = frequencies(&modes_of(&proxy, MODES))
            .iter()
            .zip(&own_frequencies)
            .map(|(a, b)| 100.0 * (a / b - 1.0))
            .collect::<Vec<_>>();
        let (low, high) =
            (off.iter().copied().fold(f64::INFINITY, f64::min), off.iter().copied().fold(-f64::INFINITY, f64::max));
        let binding = Binding::new(&proxy, &Points { positions, ..Points::default() }).unwrap();
        let wrong = |i: usize| {
            let u = settled(&proxy, &loads[i].on(&proxy));
            100.0 * error(&followed(&binding, &proxy, &u, positions), &exact[i])
        };
        let whole: Vec<f64> = (0..3).map(wrong).collect();
        // The proxy's vertices where the asset has them.
        let following = exact[..3].iter().map(|exact| {
            let at = |s: &Source| s.vertices.iter().zip(s.weights).map(|(v, w)| w * exact[*v as usize]).sum();
            let there: Vec<Vec3> = made.sources.iter().map(at).collect();
            100.0 * error(&followed(&binding, &proxy, &there, positions), exact)
        });
        let worst = whole.iter().copied().fold(0.0, f64::max);
        let line = format!(
            "| {name} | {} | {} | {} | {} | {low:+.1} to {high:+.1} | {:.1} | {worst:.1} | {:.2} |",
            positions.len(),
            made.positions.len(),
            if keep { "kept" } else { "" },
            if fit { "yes" } else { "" },
            median(whole.clone()),
            median(following.collect())
        );
        println!("{line}");
        writeln!(table, "{line}").unwrap();
        if keep && share == 10 {
            let list = |range: std::ops::Range<usize>| {
                range.map(|i| format!("{:.1}", wrong(i))).collect::<Vec<_>>().join(", ")
            };
            let line = format!(
                "| {name} | {} | {} | {} | {} |",
                if fit { "yes" } else { "" },
                list(3..6),
                list(6..7),
                list(7..10)
            );
            println!("{line}");
            writeln!(others, "{line}").unwrap();
        }
    }
}

/// Each triangle as four, in its plane; a vertex in the middle of an edge is held where both ends are.
fn halved(x: &[Vec3], triangles: &[[u32; 3]], held: &[bool]) -> (Vec<Vec3>, Vec<[u32; 3]>, Vec<bool>) {
    let (mut x, mut held) = (x.to_vec(), held.to_vec());
    let mut middles = HashMap::new();
    let mut out = vec![];
    for t in triangles {
        let [m, n, o] = [0, 1, 2].map(|k| {
            let (a, b) = (t[k].min(t[(k + 1) % 3]), t[k].max(t[(k + 1) % 3]));
            *middles.entry((a, b)).or_insert_with(|| {
                x.push(0.5 * (x[a as usize] + x[b as usize]));
                held.push(held[a as usize] && held[b as usize]);
                x.len() as u32 - 1
            })
        });
        out.extend([[t[0], m, o], [m, t[1], n], [o, n, t[2]], [m, n, o]]);
    }
    (x, out, held)
}

/// What is off at which number of vertices: where the proxy's vertices are put where the asset has them, where its flat triangles are cut in sixteen, as it is, and calibrated. First order: a
/// thousandth of the loads.
fn parts(asset: &Asset, table: &mut String) {
    let Asset { positions, triangles, held, .. } = asset;
    let size = Mesh::new(positions.clone(), triangles).unwrap().size;
    let own = shell(positions, triangles, held.clone(), size);
    let modes = modes_of(&own, MODES);
    let full = DIRECTIONS.map(|along| aimed(&own, &modes, Load::Gravity(along.into())));
    let loads = full.map(|load| load.times(1e-3));
    let answers = |shell: &Arc<Shell>| loads.map(|load| settled(shell, &load.on(shell)));
    let exact = answers(&own);
    let off = |found: &[Vec<Vec3>; 3]| {
        let each = found.iter().zip(&exact).map(|(u, exact)| format!("{:.1}", 100.0 * error(&u[..exact.len()], exact)));
        each.collect::<Vec<_>>().join(", ")
    };
    let cut = |x: &[Vec3], triangles: &[[u32; 3]], held: &[bool], times: usize| {
        let (mut x, mut triangles, mut held) = (x.to_vec(), triangles.to_vec(), held.to_vec());
        (0..times).for_each(|_| (x, triangles, held) = halved(&x, &triangles, &held));
        let fixed = (0..x.len() as u32).filter(|v| held[*v as usize]).collect();
        shell(&x, &triangles, fixed, size)
    };
    let own_held: Vec<bool> = (0..positions.len() as u32).map(|v| held.contains(&v)).collect();
    let far = full.map(|load| {
        let far = settled(&own, &load.on(&own)).iter().map(|u| u.norm()).fold(0.0, f64::max);
        format!("{:.1}", 100.0 * far / size)
    });
    writeln!(table, "Under the loads of the table above it moves by {} % of its size. Cut in four, its own triangles move by {} % otherwise, to first order.\n", far.join(", "), off(&answers(&cut(positions, triangles, &own_held, 1)))).unwrap();
    table.push_str(
        "| proxy | following alone, % | its shape, % | as it is, % | calibrated, % |\n|---|---|---|---|---|\n",
    );
    for share in [10, 5, 4, 2] {
        let n_vertices = positions.len() / share;
        let options = Options { n_vertices, weld: 0.0, sides: Sides::Find, cut: false, keep_pieces: false };
        let made = Proxy::holding(positions, triangles, held, &options, &mut |_| Ok(())).unwrap();
        let mut made_held = vec![false; made.positions.len()];
        held.iter().for_each(|v| made_held[made.nearest[*v as usize] as usize] = true);
        let read = |shell: &Arc<Shell>, u: &[Vec3]| {
            let binding = Binding::new(shell, &Points { positions, ..Points::default() }).unwrap();
            followed(&binding, shell, u, positions)
        };
        let by = |shell: &Arc<Shell>| off(&answers(shell).map(|u| read(shell, &u)));
        let proxy = cut(&made.positions, &made.triangles, &made_held, 0);
        let at = |exact: &[Vec3]| -> Vec<Vec3> {
            let of = |s: &Source| s.vertices.iter().zip(s.weights).map(|(v, w)| w * exact[*v as usize]).sum();
            made.sources.iter().map(of).collect()
        };
        let following = off(&[0, 1, 2].map(|i| read(&proxy, &at(&exact[i]))));
        let shape = by(&cut(&made.positions, &made.triangles, &made_held, 2));
        let fitted = Arc::new(calibrate(&proxy, &made, &[], &mut |_| Ok(())).unwrap().0);
        let n = made.positions.len();
        writeln!(table, "| {n} | {following} | {shape} | {} | {} |", by(&proxy), by(&fitted)).unwrap();
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let mut table = String::from(
        "| asset | vertices | proxy | outline of supports | calibrated | ten frequencies, % | displacement, median % | worst % | following alone, % |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    let mut others = String::from(
        "| asset | calibrated | pulls, % | pressure, % | gravity, five times as far, % |\n|---|---|---|---|---|\n",
    );
    if arguments.iter().any(|a| a == "--parts") {
        for (asset, section) in assets()[1..3].iter().zip(["parts", "fine parts"]) {
            let mut table = String::new();
            parts(asset, &mut table);
            println!("{table}");
            if let Some(at) = arguments.iter().position(|a| a == "--docs") {
                docs::put_section(&arguments[at + 1], section, &table).unwrap();
            }
        }
        return;
    }
    println!("{table}");
    let only = arguments.iter().position(|a| a == "--only").map(|at| &arguments[at + 1]);
    let wanted = |asset: &&Asset| only.is_none_or(|name| name == asset.name);
    assets().iter().filter(wanted).for_each(|asset| rows(asset, &mut table, &mut others));
    if let Some(at) = arguments.iter().position(|a| a == "--docs") {
        docs::put_section(&arguments[at + 1], "assets", &table).unwrap();
        docs::put_section(&arguments[at + 1], "others", &others).unwrap();
    }
}
