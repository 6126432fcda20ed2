//! Steps of 1/30 s: shells that fall from rest and swing, the paper's dinosaur as it is shaken, and a character's garments as they dance.

use crate::character::{self, Garment};
use crate::common::{equilateral_sheet, leaf, mass_error, mesh};
use crate::{docs, wanted};
use nalgebra::Matrix3;
use shellwarp::constraint::Constraint;
use shellwarp::reference::{Rayleigh, Solver};
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};
use std::f64::consts::TAU;
use std::sync::Arc;
use std::time::Instant;

/// Seconds of a step.
const FRAME: f64 = 1.0 / 30.0;

/// How directions are found.
#[derive(Clone, Copy)]
pub enum Way {
    /// By the energy alone, a factor for each.
    Energy,
    /// With the stress as an unknown, a factor for each.
    Mixed,
    /// The same, by earlier factors where they do.
    Reusing,
}

/// A shell that moves.
pub struct Swing {
    pub solver: Solver,
    pub u: Vec<Vec3>,
    velocity: Vec<Vec3>,
    pub iterations: usize,
    pub seconds: f64,
    /// Steps that were not found.
    lost: usize,
}

impl Swing {
    pub fn new(shell: &Arc<Shell>, way: Way) -> Self {
        let mut solver = Solver::new(shell.clone()).unwrap();
        solver.set_mixed(!matches!(way, Way::Energy));
        solver.set_reusing(matches!(way, Way::Reusing));
        let still = vec![Vec3::zeros(); shell.mass.len()];
        Self { solver, u: still.clone(), velocity: still, iterations: 0, seconds: 0.0, lost: 0 }
    }

    pub fn step(&mut self, forces: &[Vec3], joints: Vec<Constraint>) {
        let damping = Rayleigh { mass: 0.5, stiffness: 0.0 };
        let started = Instant::now();
        self.solver.set_constraints(Matrix3::identity(), joints, &self.u).unwrap();
        match self.solver.implicit_euler(&mut self.u, &mut self.velocity, forces, damping, FRAME) {
            Ok(step) => self.iterations += step.iterations,
            Err(_) => self.lost += 1,
        }
        self.seconds += started.elapsed().as_secs_f64();
    }

    /// Iterations, factorizations and seconds.
    pub fn per_frame(&self, frames: usize) -> [f64; 3] {
        [self.iterations as f64, self.solver.factorizations() as f64, self.seconds].map(|x| x / frames as f64)
    }
}

/// A shell, and how it is moved.
enum Moved {
    /// Falls from rest under gravity that is not along its axes.
    Falls(Shell),
    /// Stands on ground that shakes.
    Shaken(Shell),
    Dances(Garment),
}

impl Moved {
    /// The shell, and for each frame the acceleration that acts on it and what leads it.
    fn begin(self) -> (Arc<Shell>, impl Fn(usize) -> (Vec3, Vec<Constraint>)) {
        let (shell, worn, shaken) = match self {
            Self::Falls(shell) => (Arc::new(shell), None, false),
            Self::Shaken(shell) => (Arc::new(shell), None, true),
            Self::Dances(garment) => (garment.shell.clone(), Some(garment), false),
        };
        let frame = move |k: usize| match &worn {
            Some(garment) => (character::GRAVITY, garment.joints((k + 1) as f64 * FRAME)),
            None if shaken => (-ground(k as f64 * FRAME), vec![]),
            None => (9.8 * Vec3::new(0.3, -0.2, -1.0), vec![]),
        };
        (shell, frame)
    }
}

/// The acceleration of the ground of tests/scenes/dinosaur.toml, but for its turns, by differences over a frame.
fn ground(time: f64) -> Vec3 {
    let place = |t: f64| {
        let along = 3.0 * (TAU * 0.62 * t).sin() + (TAU * 1.37 * t + 40f64.to_radians()).sin();
        character::begun(t) * Vec3::new(along, 0.0, 2.5 * (TAU * 0.81 * t).sin())
    };
    (place(time + FRAME) - 2.0 * place(time) + place(time - FRAME)) / FRAME.powi(2)
}

/// Runs so many steps in each of these ways. They take turns, so that other work on the machine slows all.
fn swings<const N: usize>(moved: Moved, frames: usize, ways: [Way; N]) -> (Arc<Shell>, [Swing; N]) {
    let (shell, frame) = moved.begin();
    let mut swings = ways.map(|way| Swing::new(&shell, way));
    for k in 0..frames {
        let (gravity, joints) = frame(k);
        let forces: Vec<Vec3> = shell.mass.iter().map(|m| *m * gravity).collect();
        swings.iter_mut().for_each(|swing| swing.step(&forces, joints.clone()));
    }
    (shell, swings)
}

pub fn table(only: &[String]) -> String {
    let mut table = format!(
        "Steps of 1/30 s; `make bench-solver` on {} (load {}). By the energy alone → with the stress as an unknown → by earlier factors, too. \
         Apart: where these end, relative to the first, by mass. By all threads.\n\n\
         | shell | vertices | steps | iterations a step | factorizations | ms | not found | apart |\n|---|---|---|---|---|---|---|---|\n",
        docs::machine(),
        docs::load()
    );
    let mut shells = vec![
        ("leaf", Moved::Falls(leaf(1)), 60),
        ("leaf", Moved::Falls(leaf(2)), 30),
        ("leaf", Moved::Falls(leaf(4)), 6),
        ("dinosaur", Moved::Falls(dinosaur()), 6),
        ("dinosaur, shaken", Moved::Shaken(dinosaur()), 60),
        ("sheet", Moved::Falls(sheet()), 6),
    ];
    shells.extend(character::GARMENTS.map(|(name, garment)| (name, Moved::Dances(garment()), 60)));
    for (name, moved, frames) in shells.into_iter().filter(|(name, ..)| wanted(only, name)) {
        let (shell, swings) = swings(moved, frames, [Way::Energy, Way::Mixed, Way::Reusing]);
        let each = swings.each_ref().map(|swing| swing.per_frame(frames));
        let three =
            |k: usize, scale: f64, digits: usize| each.map(|of| format!("{:.digits$}", scale * of[k])).join(" → ");
        let apart = [1, 2].map(|k| format!("{:.0e}", mass_error(&shell, &swings[k].u, &swings[0].u))).join(", ");
        let row = format!(
            "| {name} | {} | {frames} | {} | {} | {} | {} | {apart} |\n",
            shell.mass.len(),
            three(0, 1.0, 1),
            three(1, 1.0, 1),
            three(2, 1e3, 0),
            swings.each_ref().map(|swing| swing.lost.to_string()).join(" → ")
        );
        print!("{row}");
        table += &row;
    }
    table
}

/// That of tests/scenes/dinosaur.toml.
pub fn dinosaur() -> Shell {
    let mesh = mesh("dinosaur.obj");
    let material = Material { k_area: 1e6, k_length: 1e6, k_bend: 1e4, area_density: 0.5 };
    let fixed = (0..mesh.positions.len() as u32).filter(|&v| mesh.positions[v as usize].y < 0.02).collect();
    Shell::new(mesh, material, &Supports { fixed, ..Supports::default() }).unwrap()
}

/// A metre of cloth held along one side.
pub fn sheet() -> Shell {
    let (positions, triangles) = equilateral_sheet(116, 116, 1.0 / 116.0);
    let fixed = (0..positions.len() as u32).filter(|&v| positions[v as usize].x < 0.02).collect();
    let material = Material { k_area: 1e3, k_length: 1e3, k_bend: 1e-3, area_density: 0.2 };
    Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &Supports { fixed, ..Supports::default() }).unwrap()
}
