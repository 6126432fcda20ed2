//! Steps of the polynomial shell under wild loads: how far it ever goes from rest, and whether it comes back. docs/evidence/front.md has the table.
//!
//! usage: bounded [--steps COUNT] [--docs FILE]
//!
//! COUNT steps of 1/60 s, 10⁶ unless told, are shared by the shells of front/judging.rs, with 8 modes and 20 fields. Every seventh step the loads jump: gravity in any
//! direction of up to thirty times what bends the shell by its size to first order, and a pull at a vertex of up to as much. Every fifth time there is none.
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
use scenes::Scene;
use shellwarp::model::{Model, Options};
use shellwarp::reduced;
use shellwarp::state::{Damping, Method, State};
use shellwarp::step::Integrator;
use shellwarp::{Shell, Vec3};
use std::sync::Arc;

const STEP: f64 = 1.0 / 60.0;
/// Steps under the same loads, and decades of their strength to either side of one size.
const JUMP: usize = 7;
const DECADES: f64 = 1.5;

struct Random(u64);

impl Random {
    /// Even between −1 and 1.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn direction(&mut self) -> Vec3 {
        Vec3::from_fn(|_, _| self.next())
    }
}

/// Of the shell's size.
fn largest(state: &State, shell: &Shell) -> f64 {
    displacements(state).iter().map(|u| u.norm()).fold(0.0, f64::max) / shell.mesh.size
}

fn jump(state: &mut State, model: &Model, random: &mut Random) {
    let (shell, lambda) = (&model.shell, model.modal.eigenvalues[0]);
    let unit = lambda * shell.mesh.size;
    let mut strength = || if random.next() > 0.6 { 0.0 } else { 10f64.powf(DECADES * random.next()) };
    let [gravity, pull] = [strength() * unit, 0.05 * strength() * unit * shell.total_mass];
    state.set_gravity(gravity * random.direction()).unwrap();
    let vertex = shell.free[((0.5 + 0.5 * random.next()) * (shell.free.len() - 1) as f64) as usize];
    state.set_forces([(vertex, pull * random.direction())], false).unwrap();
}

/// A row of the table.
fn measured(scene: &Scene, steps: usize) -> String {
    let reduced = reduced::Options { fields: 20, poses: reduced::MAX_POSES, ..Default::default() };
    let options = Options { modes: 8, reduced, ..Options::default() };
    let model = Arc::new(Model::precompute(scene.shell.clone(), &options, &mut |_, _| Ok(())).unwrap());
    let mut state = State::new(model.clone(), Method::PolynomialShell, Integrator::Exact).unwrap();
    let (mut furthest, mut refused, mut random) = (0.0f64, 0, Random(1));
    for k in 0..steps {
        if k % JUMP == 0 {
            jump(&mut state, &model, &mut random);
        }
        refused += usize::from(state.step(STEP).is_err());
        if k % 10 == 0 {
            furthest = furthest.max(largest(&state, &scene.shell));
        }
    }
    let short = state.report().unconverged_steps;
    state.set_gravity(Vec3::zeros()).unwrap();
    state.set_forces([], false).unwrap();
    let mass_coefficient = 2.0 * model.modal.eigenvalues[0].sqrt();
    state.set_damping(&Damping { mass_coefficient, ..Damping::default() }).unwrap();
    (0..1200).for_each(|_| state.step(STEP).unwrap());
    let left = largest(&state, &scene.shell);
    format!("| {} | {steps} | {furthest:.2} | {refused} | {short} | {left:.1e} |\n", scene.key)
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let value = |key: &str| arguments.iter().position(|a| a == key).and_then(|i| arguments.get(i + 1));
    let steps: usize = value("--steps").map_or(1_000_000, |count| count.parse().unwrap());
    let scenes = judging::all();
    let mut table = String::from(
        "| shell | steps | furthest, of its size | refused | short of their tolerance | left 20 s after it was let go, of its size |\n\
         |---|---|---|---|---|---|\n",
    );
    for scene in &scenes {
        let row = measured(scene, steps / scenes.len());
        print!("{row}");
        table.push_str(&row);
    }
    if let Some(file) = value("--docs") {
        docs::put_section(file, "bounded", &table).unwrap();
    }
}
