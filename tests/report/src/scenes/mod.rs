//! The scenes in motion. Each is a shell, what holds and moves it, and how long it is watched.

pub mod beams;
mod dinosaur;
mod leaf;

use crate::library::{Library, Material, Model, Pose, Solid, State};
use crate::mesh::{Mesh, P3, dot, sub};
use crate::methods::Method;
use anyhow::Result;

/// Seconds of a frame: 30 frames/s.
pub const FRAME: f64 = 1.0 / 30.0;

/// What moves the shell besides gravity.
#[derive(Clone, Copy)]
pub enum Drive {
    /// Let go from rest.
    Released,
    /// Its support moves.
    Shaken(fn(f64) -> Pose),
    /// One vertex is led in height.
    Led { vertex: u32, height: fn(f64) -> f64 },
}

/// How the nonlinear shell's motion is known. What is left is estimated from two step sizes: the error of a first-order
/// method at step h₁ is ‖x₁ − x₂‖/(h₂/h₁ − 1).
#[derive(Clone, Copy)]
pub enum Reference {
    /// Explicit steps per frame, and the fewer of the run that it is compared with.
    Explicit { steps: usize, check: usize },
    /// Implicit steps: runs with 1, 2 and 4 a frame, extrapolated twice: (8 x₄ − 6 x₂ + x₁)/3.
    Extrapolated,
}

/// A ball's radius, and the way of its middle.
pub type Ball = (f64, fn(f64) -> P3);

#[derive(Clone)]
pub struct Scene {
    pub key: &'static str,
    pub title: &'static str,
    /// For the page: what is seen, and what is measured.
    pub text: &'static str,
    pub mesh: Mesh,
    /// A coarser mesh of the same shape, with its material: the knob of mesh resolution.
    pub coarse: Option<(Mesh, Material)>,
    pub material: Material,
    pub fixed: fn(&Mesh) -> Vec<u32>,
    pub gravity: P3,
    /// Rayleigh's ξ, 1/s.
    pub damping: f64,
    pub frames: usize,
    pub drive: Drive,
    /// What the shell touches.
    pub ball: Option<Ball>,
    /// Place and axis of the signal whose period and amplitude are measured.
    pub probe: ([f64; 2], usize),
    /// Modes of the paper's setting.
    pub paper_modes: usize,
    /// Where the reference comes from.
    pub reference: Reference,
    /// Largest number of modes tried.
    pub most_modes: usize,
}

/// All scenes, the dinosaur from its file.
pub fn all(data: &std::path::Path) -> Result<Vec<Scene>> {
    Ok(vec![beams::flat(), beams::vee(), beams::led(), beams::touched(), leaf::scene(), dinosaur::scene(data)?])
}

/// What is chosen for one run.
#[derive(Clone, Debug)]
pub struct Setting {
    pub method: &'static Method,
    pub modes: usize,
    /// Steps per frame; ½ is one step for two frames.
    pub steps: f64,
    pub f64_basis: bool,
    pub coarse: bool,
}

/// What a run gave.
#[derive(Clone, Default)]
pub struct Played {
    /// Positions in the support's frame at the end of each frame (frames x n); empty where no step ends.
    pub frames: Vec<Vec<P3>>,
    /// Kinetic, elastic and gravity's energy together, and elastic alone, by frame.
    pub energy: Vec<[f64; 2]>,
    /// Seconds of computation per frame, steps and reading the positions.
    pub seconds: Vec<f64>,
}

impl Scene {
    pub fn mesh_of(&self, setting: &Setting) -> &Mesh {
        match &self.coarse {
            Some((mesh, _)) if setting.coarse => mesh,
            _ => &self.mesh,
        }
    }

    pub fn material_of(&self, setting: &Setting) -> Material {
        self.coarse.as_ref().filter(|_| setting.coarse).map_or(self.material, |c| c.1)
    }

    pub fn model(&self, library: &Library, setting: &Setting) -> Result<Model> {
        let (mesh, material) = (self.mesh_of(setting), self.material_of(setting));
        let (fixed, fields) = ((self.fixed)(mesh), setting.method.fields);
        library.reduced_model(mesh, material, &fixed, setting.modes, setting.f64_basis, fields)
    }

    /// Plays the scene. Fails when a step fails, as an explicit one that is too long does.
    pub fn play(&self, model: &Model, setting: &Setting) -> Result<Played> {
        let mesh = self.mesh_of(setting);
        let mut state = model.state(setting.method.method, setting.method.integrator)?;
        state.set_gravity(self.gravity)?;
        state.set_mass_damping(self.damping)?;
        if let Some((radius, _)) = self.ball {
            state.set_colliders(&[(Solid::Ball(radius), 0.0)])?;
        }
        self.drive(&mut state, setting, mesh, 0.0)?;
        let masses: Vec<f64> = mesh.vertex_areas().iter().map(|a| a * self.material.density).collect();
        let mut host = vec![[0f32; 3]; mesh.positions.len()];
        let mut played = Played::default();
        let frames_at_once = (1.0 / setting.steps).max(1.0) as usize;
        let steps = (setting.steps.max(1.0)) as usize;
        let h = FRAME * frames_at_once as f64 / steps as f64;
        for frame in (0..self.frames).step_by(frames_at_once) {
            let start = std::time::Instant::now();
            for k in 1..=steps {
                self.drive(&mut state, setting, mesh, frame as f64 * FRAME + k as f64 * h)?;
                state.step(h)?;
            }
            state.write_f32(&mut host)?;
            let seconds = start.elapsed().as_secs_f64() / frames_at_once as f64;
            for skipped in 1..=frames_at_once {
                played.seconds.push(seconds);
                let positions = if skipped == frames_at_once { state.positions()? } else { vec![] };
                played.energy.push(self.energy(&state, &positions, mesh, &masses)?);
                played.frames.push(positions);
            }
        }
        Ok(played)
    }

    /// Sets what moves the shell at the end of the next step.
    fn drive(&self, state: &mut State, setting: &Setting, mesh: &Mesh, time: f64) -> Result<()> {
        if let Some((radius, place)) = self.ball {
            state.move_collider(0, Solid::Ball(radius), false, place(time))?;
        }
        match self.drive {
            Drive::Released => Ok(()),
            Drive::Shaken(pose) => state.set_frame(&pose(time)),
            Drive::Led { vertex, height } => {
                let vertex =
                    if setting.coarse { mesh.nearest(self.mesh.place[vertex as usize]) as u32 } else { vertex };
                let mut target = mesh.positions[vertex as usize];
                target[2] += height(time);
                state.hold(0, vertex, 4, target)
            }
        }
    }

    /// Total and elastic energy.
    fn energy(&self, state: &State, positions: &[P3], mesh: &Mesh, masses: &[f64]) -> Result<[f64; 2]> {
        let report = state.report()?;
        let lift = |(v, x): (usize, &P3)| masses[v] * dot(self.gravity, sub(*x, mesh.positions[v]));
        let gravity: f64 = positions.iter().enumerate().map(lift).sum();
        Ok([report.kinetic_energy + report.elastic_energy - gravity, report.elastic_energy])
    }
}
