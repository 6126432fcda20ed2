//! Shells that a handle leads, which the precompute was told, against the full shell with the same handle. docs/evidence/front.md has the table.
//!
//! usage: handles [--scene KEY] [--tuning] [--docs FILE]
//!
//! Under gravity that moves the shell by a twentieth of its size to first order, a vertex goes a way in eight parts, and the shell is at rest after
//! each. Some are turned as they go. With 16 modes and 40 or 64 fields. The full shell goes its ways in parts and in half-parts; ways that it ends
//! elsewhere by these have more than one answer, and are left out.
//!
//! The judging list was written down before anything was measured on it. What is chosen, is chosen by the tuning list alone (`--tuning`).
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;
#[path = "docs.rs"]
mod docs;
#[allow(dead_code)] // the front's own
#[path = "front/scenes.rs"]
mod scenes;

use common::{displacements, equilateral_sheet, mass_error, reference, trouser_leg};
use nalgebra::UnitQuaternion;
use scenes::{hat, shell};
use shellwarp::constraint::{Constraint, Target};
use shellwarp::model::{Model, Options};
use shellwarp::reduced;
use shellwarp::state::{Method, State};
use shellwarp::step::Integrator;
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};
use std::f64::consts::PI;
use std::sync::Arc;

/// Parts of a way, modes, and fields beside them with whether the precompute is told of the handle.
const PARTS: usize = 8;
const MODES: usize = 16;
const FIELDS: [(usize, bool); 3] = [(40, false), (40, true), (64, true)];
/// Of what moves the shell by its size to first order.
const GRAVITY: f64 = 0.05;
/// Of the displacement, what half-parts of the way may change.
const CONFIRMED: f64 = 0.01;

/// A shell and one of its vertices, which goes by each of the ways: in sizes, and turns in rad about an axis.
struct Led {
    key: &'static str,
    shell: Arc<Shell>,
    down: Vec3,
    vertex: usize,
    ways: Vec<(&'static str, Vec3, Vec3)>,
}

const NONE: Vec3 = Vec3::new(0.0, 0.0, 0.0);

fn way(x: f64, y: f64, z: f64) -> Vec3 {
    Vec3::new(x, y, z)
}

/// The free vertex that is furthest along a direction.
fn furthest(shell: &Shell, along: impl Fn(&Vec3) -> f64) -> usize {
    let at = |v: &u32| along(&shell.mesh.positions[*v as usize]);
    shell.free.iter().copied().max_by(|a, b| at(a).total_cmp(&at(b))).unwrap() as usize
}

/// The leaf of `shellwarp new-scene`.
fn first_leaf() -> Shell {
    let (mut positions, mut triangles) = (vec![], vec![]);
    for i in 0..=32u32 {
        for j in 0..=10 {
            let (s, t) = (f64::from(i) / 32.0, f64::from(j) / 5.0 - 1.0);
            let width = 0.024 * (0.06 + 0.94 * (PI * (0.05 + 0.94 * s.powf(0.8))).sin().powf(0.9));
            positions.push(way(0.1 * s, width * t, 0.003 * t.abs() * (PI * s).sin() + 0.012 * s * (1.0 - s)));
        }
    }
    for i in 0..32 {
        for j in 0..10 {
            let (a, b) = (i * 11 + j, i * 11 + j + 11);
            triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
        }
    }
    let material = Material { k_area: 6112.8, k_length: 20.38, k_bend: 5.8927e-5, area_density: 0.2 };
    let supports = Supports { clamped: (0..11).collect(), ..Default::default() };
    Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &supports).unwrap()
}

fn tuning() -> Vec<Led> {
    let (down, first) = (-Vec3::z(), Arc::new(first_leaf()));
    let tip = 32 * 11 + 5;
    let side = furthest(&first, |x| x.y);
    let (leaf, vee) = (Arc::new(common::leaf(1)), Arc::new(reference("v_beam").0));
    let flat = Arc::new(reference("flat_beam").0);
    let edge = furthest(&flat, |x| x.x + 0.1 * x.y);
    let (end, far) = (furthest(&leaf, |x| x.x), furthest(&vee, |x| x.x));
    vec![
        Led {
            key: "new-scene, tip",
            shell: first.clone(),
            down,
            vertex: tip,
            ways: vec![
                ("up", way(0.0, 0.0, 0.18), NONE),
                ("inward", way(-0.1, 0.0, 0.0), NONE),
                ("sideways", way(0.0, 0.04, 0.0), NONE),
                ("turned", way(-0.01, 0.0, 0.09), way(0.5, 0.0, 0.0)),
            ],
        },
        Led {
            key: "new-scene, side",
            shell: first,
            down,
            vertex: side,
            ways: vec![
                ("up", way(0.0, 0.0, 0.135), NONE),
                ("inward", way(0.0, -0.05, 0.0), NONE),
                ("turned", way(0.0, 0.0, 0.07), way(0.5, 0.0, 0.0)),
            ],
        },
        Led {
            key: "leaf, tip",
            shell: leaf,
            down,
            vertex: end,
            ways: vec![("up", way(-0.03, 0.0, 0.2), NONE), ("inward", way(-0.1, 0.0, 0.0), NONE)],
        },
        Led {
            key: "flat beam, corner",
            shell: flat,
            down,
            vertex: edge,
            ways: vec![
                ("up", way(-0.02, 0.0, 0.15), NONE),
                ("inward", way(-0.08, 0.0, 0.0), NONE),
                ("sideways", way(0.0, 0.02, 0.0), NONE),
            ],
        },
        Led {
            key: "V-beam, end",
            shell: vee,
            down,
            vertex: far,
            ways: vec![("up", way(-0.02, 0.0, 0.15), NONE), ("inward", way(-0.05, 0.0, 0.0), NONE)],
        },
    ]
}

/// Chosen before a method was tried on any of these.
fn judging() -> Vec<Led> {
    let fabric = Material { k_area: 1e4, k_length: 1e4, k_bend: 0.3, area_density: 1.0 };
    let (positions, triangles) = equilateral_sheet(20, 12, 0.06);
    let card = Arc::new(shell(positions, &triangles, fabric, |x| x.x < 0.07));
    let corner = furthest(&card, |x| x.x - 0.1 * x.y);
    let middle = furthest(&card, |x| x.x - (x.y - 0.31).abs());
    let card_ways = || {
        vec![
            ("up", way(-0.03, 0.0, 0.2), NONE),
            ("sideways", way(0.0, 0.04, 0.0), NONE),
            ("inward", way(-0.12, 0.0, 0.0), NONE),
            ("turned", way(-0.015, 0.0, 0.1), way(0.5, 0.0, 0.0)),
        ]
    };
    let hat = Arc::new(hat());
    let brim = furthest(&hat, |x| x.z - 0.05 * x.y);
    let leg = Arc::new(trouser_leg("left"));
    let hem = furthest(&leg, |x| 0.2 * x.z - x.y);
    let below = -Vec3::y();
    vec![
        Led { key: "card, corner", shell: card.clone(), down: -Vec3::z(), vertex: corner, ways: card_ways() },
        Led { key: "card, middle of the end", shell: card, down: -Vec3::z(), vertex: middle, ways: card_ways() },
        Led {
            key: "hat, brim",
            shell: hat,
            down: below,
            vertex: brim,
            ways: vec![
                ("up", way(0.0, 0.1, 0.0), NONE),
                ("sideways", way(0.05, 0.0, 0.0), NONE),
                ("inward", way(0.0, 0.0, -0.06), NONE),
                ("turned", way(0.0, 0.05, 0.0), way(0.4, 0.0, 0.0)),
            ],
        },
        Led {
            key: "trouser leg, hem",
            shell: leg,
            down: below,
            vertex: hem,
            ways: vec![
                ("up", way(0.0, 0.06, 0.0), NONE),
                ("sideways", way(0.1, 0.02, 0.0), NONE),
                ("inward", way(0.0, 0.01, -0.08), NONE),
                ("turned", way(0.03, 0.0, 0.03), way(0.0, 0.5, 0.0)),
            ],
        },
    ]
}

impl Led {
    /// At rest after each part; none where an equilibrium is not found.
    fn shapes(
        &self,
        model: &Arc<Model>,
        method: Method,
        (to, turn): (Vec3, Vec3),
        parts: usize,
    ) -> Option<Vec<Vec<Vec3>>> {
        let mut state = State::new(model.clone(), method, Integrator::Exact).ok()?;
        let size = self.shell.mesh.size;
        state.set_gravity(GRAVITY * model.modal.eigenvalues[0] * size * self.down).ok()?;
        let (mut shapes, vertex) = (vec![], self.vertex as u32);
        let rest = self.shell.mesh.positions[self.vertex];
        for k in 0..=parts {
            let share = k as f64 / parts as f64;
            let mut hold = |id, target| {
                state.set_constraint(Constraint { id, vertex, axes: [true; 3], compliance: 0.0, target }).ok()
            };
            hold(0, Target::Position(rest + share * size * to))?;
            if turn != NONE {
                hold(1, Target::Orientation(UnitQuaternion::from_scaled_axis(share * turn)))?;
            }
            state.equilibrium().ok()?;
            if k > 0 {
                shapes.push(displacements(&state));
            }
        }
        Some(shapes)
    }

    /// The share that is wrong at the end, and over the way, in %.
    fn off(&self, shapes: Option<Vec<Vec<Vec3>>>, exact: &[Vec<Vec3>]) -> String {
        let Some(shapes) = shapes else { return "no equilibrium".into() };
        let end = mass_error(&self.shell, &shapes[PARTS - 1], &exact[PARTS - 1]);
        let square = |u: &dyn Fn(usize, usize) -> Vec3| -> f64 {
            let all = (0..PARTS).flat_map(|k| (0..self.shell.mass.len()).map(move |v| (k, v)));
            all.map(|(k, v)| self.shell.mass[v] * u(k, v).norm_squared()).sum()
        };
        let way = (square(&|k, v| shapes[k][v] - exact[k][v]) / square(&|k, v| exact[k][v])).sqrt();
        format!("{:.1}, {:.1}", 100.0 * end, 100.0 * way)
    }

    /// By the full shell; none where it has more than one answer.
    fn exact(&self, plain: &Arc<Model>, way: (Vec3, Vec3)) -> Option<Vec<Vec<Vec3>>> {
        let [coarse, fine] = [PARTS, 2 * PARTS].map(|parts| self.shapes(plain, Method::ImplicitShell, way, parts));
        let fine: Vec<Vec<Vec3>> = fine?.into_iter().skip(1).step_by(2).collect();
        let apart = |(a, b): (&Vec<Vec3>, &Vec<Vec3>)| mass_error(&self.shell, a, b);
        coarse?.iter().zip(&fine).all(|pair| apart(pair) <= CONFIRMED).then_some(fine)
    }

    /// A row of the table for each way.
    fn rows(&self) -> String {
        let options = Options { modes: MODES, ..Options::default() };
        let plain = Arc::new(Model::precompute(self.shell.clone(), &options, &mut |_, _| Ok(())).unwrap());
        let models = FIELDS.map(|(fields, told)| self.model(fields, told));
        let mut rows = String::new();
        for &(name, to, turn) in &self.ways {
            let Some(exact) = self.exact(&plain, (to, turn)) else {
                rows.push_str(&format!("| {} | {name} | more than one answer | | | | | | | | |\n", self.key));
                continue;
            };
            let by = |model: &Arc<Model>, method| self.off(self.shapes(model, method, (to, turn), PARTS), &exact);
            let mut row = format!("| {} | {name} | {} ", self.key, by(&plain, Method::Warp));
            for model in &models {
                for method in [Method::ReducedShell, Method::PolynomialShell] {
                    row.push_str(&format!("| {} ", by(model, method)));
                }
            }
            println!("{row}|");
            rows.push_str(&format!("{row}|\n"));
        }
        rows
    }

    fn model(&self, fields: usize, told: bool) -> Arc<Model> {
        let reduced = reduced::Options { fields, poses: reduced::MAX_POSES, ..Default::default() };
        let handles = if told { vec![self.vertex as u32] } else { vec![] };
        let options = Options { modes: MODES, reduced, handles, ..Options::default() };
        Arc::new(Model::precompute(self.shell.clone(), &options, &mut |_, _| Ok(())).unwrap())
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let value = |key: &str| arguments.iter().position(|a| a == key).and_then(|i| arguments.get(i + 1));
    let list = if arguments.iter().any(|a| a == "--tuning") { tuning() } else { judging() };
    let mut table = String::from("| handle | way | warp ");
    for (fields, told) in FIELDS {
        let told = if told { "" } else { ", not told" };
        table.push_str(&format!("| samples, {fields}{told} | polynomial, {fields}{told} "));
    }
    table.push_str("|\n|---|---|---|---|---|---|---|---|---|---|---|\n");
    for led in list.iter().filter(|led| value("--scene").is_none_or(|key| led.key.contains(&key[..]))) {
        table.push_str(&led.rows());
    }
    match value("--docs") {
        Some(file) => docs::put_section(file, "handles", &table).unwrap(),
        None => print!("{table}"),
    }
}
