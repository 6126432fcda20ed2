//! Motions in which loads and handles jump, against the full shell in steps of a sixteenth and less. docs/evidence/front.md has the table.
//!
//! usage: dynamics [--scene KEY] [--docs FILE]
//!
//! The shells of front/judging.rs, with 8 modes and 20 fields that know the vertex of the handle, in steps h of a fortieth of their slowest
//! period T and of a quarter of that.
//! Damped by mass to 3 % of critical at that period. The motions were written down before anything was measured on them:
//!
//! - flip: gravity begins, points the other way after T/2, and ends after 3T/2;
//! - release: gravity holds the shell at rest, and ends;
//! - drag: a handle is led along the normal in T/2, holds for T/4, and lets go;
//! - turn: the same, and the handle turns by 0.6 rad about an axis in the surface.
//!
//! The reference is the full shell, by backward Euler in steps of h/16 and h/32. Its error is of first order, so twice the second less the first
//! is taken for the motion.
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;
#[path = "docs.rs"]
mod docs;
#[path = "front/judging.rs"]
mod judging;
#[allow(dead_code)] // the front's own
#[path = "front/scenes.rs"]
mod scenes;

use common::displacements;
use nalgebra::UnitQuaternion;
use scenes::{Action, List, Scene};
use shellwarp::constraint::{Constraint, Target};
use shellwarp::model::{Model, Options};
use shellwarp::reduced;
use shellwarp::state::{Damping, Method, State};
use shellwarp::step::Integrator;
use shellwarp::{Shell, Vec3};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Frames of a period, and of a motion.
const PERIOD: usize = 40;
const FRAMES: usize = 100;
/// Every motion runs at these shares of the sizes below: at the full ones the shells swing by up to their size.
const LEVELS: [f64; 2] = [0.25, 1.0];
/// Of what moves the shell by its size to first order, and how far a handle goes, of its size.
const GRAVITY: f64 = 0.2;
const LED: f64 = 0.15;
const TURNED: f64 = 0.6;
const DAMPING: f64 = 0.03;

#[derive(Clone, Copy)]
enum Motion {
    Flip,
    Release,
    Drag,
    Turn,
}

const MOTIONS: [(&str, Motion); 4] =
    [("flip", Motion::Flip), ("release", Motion::Release), ("drag", Motion::Drag), ("turn", Motion::Turn)];

/// A shell and what acts on it.
struct Stage {
    model: Arc<Model>,
    gravity: Vec3,
    vertex: usize,
    along: Vec3,
    level: f64,
}

impl Stage {
    fn new(scene: &Scene) -> Self {
        let reduced = reduced::Options { fields: 20, poses: reduced::MAX_POSES, ..Default::default() };
        let handle = scene.loads(List::Judging).into_iter().find_map(|load| match load.action {
            Action::Handle(vertex, along) => Some((vertex, along)),
            Action::Forces(_) => None,
        });
        let (vertex, along) = handle.unwrap();
        let options = Options { modes: 8, reduced, handles: vec![vertex as u32], ..Options::default() };
        let model = Arc::new(Model::precompute(scene.shell.clone(), &options, &mut |_, _| Ok(())).unwrap());
        let unit = model.modal.eigenvalues[0] * scene.shell.mesh.size;
        let gravity = GRAVITY * unit * Vec3::new(0.35, -0.4, -0.85).normalize();
        Self { model, gravity, vertex, along, level: 1.0 }
    }

    /// Seconds of a frame.
    fn frame(&self) -> f64 {
        TAU / self.model.modal.eigenvalues[0].sqrt() / PERIOD as f64
    }

    fn shell(&self) -> &Shell {
        &self.model.shell
    }

    /// The same at another level.
    fn at(&self, level: f64) -> Self {
        Self { model: self.model.clone(), gravity: level * self.gravity, level, ..*self }
    }

    /// Share of the way that the handle has gone at the end of a share of the k-th frame.
    fn led(&self, k: usize, share: f64) -> f64 {
        self.level * ((k as f64 + share) / (0.5 * PERIOD as f64)).min(1.0)
    }

    /// What a host does before a step that ends after a share of the k-th frame.
    fn act(&self, motion: Motion, k: usize, share: f64, state: &mut State) {
        const LET_GO: usize = PERIOD * 3 / 4;
        match (motion, k) {
            (Motion::Flip, 0) => state.set_gravity(self.gravity).unwrap(),
            (Motion::Flip, k) if k == PERIOD / 2 => state.set_gravity(-self.gravity).unwrap(),
            (Motion::Flip, k) if k == PERIOD * 3 / 2 => state.set_gravity(Vec3::zeros()).unwrap(),
            (Motion::Release, 0) => state.set_gravity(Vec3::zeros()).unwrap(),
            (Motion::Drag | Motion::Turn, 0..LET_GO) => {
                let (way, shell) = (self.led(k, share), self.shell());
                let to = shell.mesh.positions[self.vertex] + LED * way * shell.mesh.size * self.along;
                let mut hold = |id, target| {
                    let vertex = self.vertex as u32;
                    let constraint = Constraint { id, vertex, axes: [true; 3], compliance: 0.0, target };
                    state.set_constraint(constraint).unwrap();
                };
                hold(0, Target::Position(to));
                if matches!(motion, Motion::Turn) {
                    let axis = self.along.cross(&Vec3::new(0.6, 0.7, 0.4)).normalize();
                    hold(1, Target::Orientation(UnitQuaternion::from_scaled_axis(TURNED * way * axis)));
                }
            }
            (Motion::Drag | Motion::Turn, _) => state.clear_constraints(),
            _ => {}
        }
    }

    /// Displacements at the end of every frame, in so many steps a frame; none where a step is refused.
    fn moved(&self, motion: Motion, method: Method, integrator: Integrator, steps: usize) -> Option<Vec<Vec<Vec3>>> {
        let mut state = State::new(self.model.clone(), method, integrator).ok()?;
        let mass_coefficient = 2.0 * DAMPING * self.model.modal.eigenvalues[0].sqrt();
        state.set_damping(&Damping { mass_coefficient, ..Damping::default() }).ok()?;
        if let Motion::Release = motion {
            state.set_gravity(self.gravity).ok()?;
            state.equilibrium().ok()?;
        }
        let mut shapes = vec![];
        for k in 0..FRAMES {
            for part in 1..=steps {
                self.act(motion, k, part as f64 / steps as f64, &mut state);
                state.step(self.frame() / steps as f64).ok()?;
            }
            shapes.push(displacements(&state));
        }
        Some(shapes)
    }

    /// Over all frames and vertices by mass, relative.
    fn error(&self, shapes: &[Vec<Vec3>], exact: &[Vec<Vec3>]) -> f64 {
        let mass = &self.shell().mass;
        let square = |u: &dyn Fn(usize, usize) -> Vec3| -> f64 {
            (0..FRAMES)
                .flat_map(|k| (0..mass.len()).map(move |v| (k, v)))
                .map(|(k, v)| mass[v] * u(k, v).norm_squared())
                .sum()
        };
        (square(&|k, v| shapes[k][v] - exact[k][v]) / square(&|k, v| exact[k][v])).sqrt()
    }
}

/// A row of the table for each motion.
fn measured(scene: &Scene) -> String {
    let whole = Stage::new(scene);
    let mut rows = String::new();
    for ((name, motion), level) in MOTIONS.into_iter().flat_map(|motion| LEVELS.map(|level| (motion, level))) {
        let stage = whole.at(level);
        let full = |steps| stage.moved(motion, Method::ImplicitShell, Integrator::ImplicitEuler, steps);
        let (Some(coarse), Some(fine)) = (full(16), full(32)) else {
            rows.push_str(&format!("| {} | {name} | the full shell refused a step | | | | | | | |\n", scene.key));
            continue;
        };
        let twice = |(a, b): (&Vec3, &Vec3)| 2.0 * b - a;
        let exact: Vec<Vec<Vec3>> =
            coarse.iter().zip(&fine).map(|(a, b)| a.iter().zip(b).map(twice).collect()).collect();
        let furthest = exact.iter().flatten().map(|u| u.norm()).fold(0.0, f64::max) / stage.shell().mesh.size;
        let mut row = format!("| {} | {name} | {furthest:.2} ", scene.key);
        let mut cell = |shapes: Option<Vec<Vec<Vec3>>>| {
            let text = shapes.map_or("refused".into(), |shapes| format!("{:.1}", 100.0 * stage.error(&shapes, &exact)));
            row.push_str(&format!("| {text} "));
        };
        let contenders = [
            (Method::Warp, Integrator::ImplicitEuler, 1),
            (Method::Warp, Integrator::Exact, 1),
            (Method::RotationStrain, Integrator::Exact, 1),
            (Method::PolynomialShell, Integrator::Exact, 1),
            (Method::PolynomialShell, Integrator::Exact, 4),
            (Method::ReducedShell, Integrator::Exact, 4),
            (Method::ImplicitShell, Integrator::ImplicitEuler, 1),
        ];
        for (method, integrator, steps) in contenders {
            cell(stage.moved(motion, method, integrator, steps));
        }
        cell(Some(coarse));
        row.push_str("|\n");
        print!("{row}");
        rows.push_str(&row);
    }
    rows
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let value = |key: &str| arguments.iter().position(|a| a == key).and_then(|i| arguments.get(i + 1));
    let mut table = String::from(
        "| shell | motion | furthest, of its size | warp, backward Euler, h | warp, exact, h | rotation–strain, exact, h | polynomial, h | polynomial, h/4 \
         | samples, h/4 | full shell, h | full shell, h/16 |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for scene in judging::all().iter().filter(|scene| value("--scene").is_none_or(|key| key == scene.key)) {
        table.push_str(&measured(scene));
    }
    if let Some(file) = value("--docs") {
        docs::put_section(file, "dynamics", &table).unwrap();
    }
}
