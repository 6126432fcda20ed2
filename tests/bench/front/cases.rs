//! Equilibria of the full shell: the truth that methods are measured against, kept in out/front between runs.

use crate::common::{displacements, mass_error};
use crate::scenes::{Action, Load, Part, Scene};
use shellwarp::constraint::{Constraint, Target};
use shellwarp::model::{Model, Options};
use shellwarp::state::{Method, State};
use shellwarp::step::Integrator;
use shellwarp::{Result, Vec3};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;
use std::sync::Arc;

/// Largest displacements aimed at, in model sizes.
pub const AIMS: [f64; 3] = [0.1, 0.2, 0.5];
/// Numbers of a case before its displacements: its load's, its aim, its strength, and how far ways end apart.
const HEAD: usize = 4;
/// A load is scaled until it comes as near as this factor, or so often.
const NEAR: f64 = 1.2;
const TRIALS: usize = 5;
/// Parts of the way from one strength to the next by which the load grows a second time.
const FINER: usize = 8;
/// Of the displacement, what the finer way may change. Past a bifurcation that a step of the load jumps over, it changes all of it, and the
/// full shell itself has no answer that methods could be measured against.
const CONFIRMED: f64 = 0.01;

pub struct Case {
    pub name: &'static str,
    pub part: Part,
    pub aim: f64,
    /// Of the load of strength 1, after those of the aims before it: a load grows by these.
    pub strengths: Vec<f64>,
    /// Largest displacement, in model sizes.
    pub moved: f64,
    /// Place of the load in the scene's list.
    pub load: usize,
    pub exact: Vec<Vec3>,
    /// How far from it the full shell ends by the finer way, a relative error.
    apart: f64,
}

impl Case {
    /// Whether the load moves the shell by what was aimed at, up to the factor that its search ends with.
    pub fn came_near(&self) -> bool {
        (self.aim / NEAR..=self.aim * NEAR).contains(&self.moved)
    }

    /// E(x̄ + u) less what forces do along u; of a handle E alone.
    pub fn potential(&self, scene: &Scene, u: &[Vec3]) -> f64 {
        let x: Vec<Vec3> = scene.shell.mesh.positions.iter().zip(u).map(|(x, u)| x + u).collect();
        let strength = self.strengths.last().copied().unwrap_or(0.0);
        let work: f64 = match &scene.loads(self.part.list())[self.load].action {
            Action::Forces(forces) => forces.iter().zip(u).map(|(f, u)| strength * f.dot(u)).sum(),
            Action::Handle(..) => 0.0,
        };
        scene.shell.energy.value(&x) - work
    }

    /// Whether the full shell has one answer.
    pub fn is_confirmed(&self) -> bool {
        self.apart <= CONFIRMED
    }
}

fn state(model: &Arc<Model>, method: Method) -> Result<State> {
    State::new(model.clone(), method, Integrator::Exact)
}

/// Sets a load at a strength.
fn apply(state: &mut State, action: &Action, strength: f64, rest: &[Vec3]) -> Result<()> {
    match action {
        Action::Forces(forces) => {
            let scaled = forces.iter().map(|f| strength * f);
            state.set_forces((0u32..).zip(scaled).filter(|(_, f)| *f != Vec3::zeros()), false)
        }
        Action::Handle(vertex, direction) => {
            let v = *vertex;
            let axes = std::array::from_fn(|a| direction[a] != 0.0);
            let target = Target::Position(rest[v] + strength * direction);
            state.set_constraint(Constraint { id: 1, vertex: v as u32, axes, compliance: 0.0, target })
        }
    }
}

/// Under the load of a case as it grows, each strength from the equilibrium of the one before; and whether the last has one.
pub fn loaded(scene: &Scene, model: &Arc<Model>, method: Method, case: &Case) -> Option<(State, bool)> {
    let rest = &scene.shell.mesh.positions;
    let loads = scene.loads(case.part.list());
    let mut state = state(model, method).ok()?;
    let mut found = true;
    for strength in &case.strengths {
        apply(&mut state, &loads[case.load].action, *strength, rest).ok()?;
        found = state.equilibrium().is_ok();
    }
    Some((state, found))
}

/// The same in so many frames from one strength to the next, each of which is told.
pub fn led(
    scene: &Scene,
    (model, method): (&Arc<Model>, Method),
    case: &Case,
    frames: usize,
    frame: &mut dyn FnMut(&mut State),
) -> Option<State> {
    let rest = &scene.shell.mesh.positions;
    let loads = scene.loads(case.part.list());
    let mut state = state(model, method).ok()?;
    let mut before = 0.0;
    for strength in &case.strengths {
        for k in 1..=frames {
            let part = before + (strength - before) * k as f64 / frames as f64;
            apply(&mut state, &loads[case.load].action, part, rest).ok()?;
            let _ = state.equilibrium();
            frame(&mut state);
        }
        before = *strength;
    }
    Some(state)
}

/// The cases of a scene; those whose equilibrium is not found are left out.
pub fn find(scene: &Scene) -> Vec<Case> {
    scene.lists.iter().flat_map(|list| of_list(scene, &scene.loads(*list))).collect()
}

fn of_list(scene: &Scene, loads: &[Load]) -> Vec<Case> {
    let path = cache(scene, loads);
    let mut numbers = vec![];
    if let Ok(bytes) = std::fs::read(&path) {
        numbers = bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap_or_default())).collect();
    } else {
        solve(scene, loads, &mut numbers);
        let bytes: Vec<u8> = numbers.iter().flat_map(|x: &f64| x.to_le_bytes()).collect();
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, bytes).unwrap();
    }
    let (size, n) = (scene.shell.mesh.size, scene.shell.mass.len());
    let mut strengths: Vec<f64> = vec![];
    let read = |row: &[f64]| {
        let load = &loads[row[0] as usize];
        if row[1] == AIMS[0] {
            strengths.clear();
        }
        strengths.push(row[2]);
        let exact: Vec<Vec3> = row[HEAD..].chunks_exact(3).map(|c| Vec3::new(c[0], c[1], c[2])).collect();
        Case {
            name: load.name,
            part: load.part,
            aim: row[1],
            strengths: strengths.clone(),
            moved: largest(&exact) / size,
            load: row[0] as usize,
            exact,
            apart: row[3],
        }
    };
    numbers.chunks_exact(HEAD + 3 * n).map(read).collect()
}

/// Named by all that the equilibria follow from.
fn cache(scene: &Scene, loads: &[Load]) -> PathBuf {
    let mut hasher = DefaultHasher::new();
    let mut add = |v: &Vec3| v.iter().for_each(|x| x.to_bits().hash(&mut hasher));
    scene.shell.mesh.positions.iter().for_each(&mut add);
    for load in loads {
        match &load.action {
            Action::Forces(forces) => forces.iter().for_each(&mut add),
            Action::Handle(v, direction) => add(&(*v as f64 * direction)),
        }
    }
    AIMS.iter().for_each(|aim| add(&Vec3::repeat(*aim)));
    let m = scene.shell.material.discrete_shells().unwrap();
    add(&Vec3::new(m.k_area, m.k_length, m.k_bend));
    (0..scene.shell.held.len()).filter(|v| scene.shell.held[*v]).for_each(|v| add(&Vec3::repeat(v as f64)));
    PathBuf::from(format!("out/front/{}_grown_twice_{:016x}.bin", scene.key, hasher.finish()))
}

/// Follows each load as it grows: its number, aim, strength, how far apart ways end, and the displacements. Trials of a strength all start
/// from the aim before: past a snap a shell does not come back by the way it went.
fn solve(scene: &Scene, loads: &[Load], numbers: &mut Vec<f64>) {
    let shell = &scene.shell;
    let options = Options { modes: 1, ..Options::default() };
    let model = Arc::new(Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).unwrap());
    let rest = &shell.mesh.positions;
    let size = shell.mesh.size;
    for (l, load) in loads.iter().enumerate() {
        let grown = |from: &State, strength: f64| -> Option<(State, Vec<Vec3>)> {
            let mut state = from.try_clone().ok()?;
            apply(&mut state, &load.action, strength, rest).ok()?;
            state.equilibrium().ok()?;
            let u = displacements(&state);
            Some((state, u))
        };
        let mut state = state(&model, Method::ImplicitShell).unwrap();
        let (mut finer, mut before) = (state.try_clone().ok().map(|state| (state, vec![])), 0.0);
        // What a tiny load does gives the first strength.
        let tiny = match load.action {
            Action::Handle(..) => 1e-3 * size,
            Action::Forces(_) => 1e-3 * shell.material.discrete_shells().unwrap().k_bend / size,
        };
        let Some((_, u)) = grown(&state, tiny) else { continue };
        let (mut last, mut power) = ((tiny, largest(&u) / size), 1.0);
        for aim in AIMS {
            let mut best: Option<(f64, f64, State, Vec<Vec3>)> = None;
            for _ in 0..TRIALS {
                let strength = match load.action {
                    Action::Handle(..) => aim * size,
                    Action::Forces(_) => last.0 * (aim / last.1).powf(1.0 / power),
                };
                let Some((state, u)) = grown(&state, strength) else { break };
                let moved = largest(&u) / size;
                let slope = (moved / last.1).ln() / (strength / last.0).ln();
                power = if slope.is_finite() { slope.clamp(0.35, 2.0) } else { power };
                last = (strength, moved);
                let off = (moved / aim).ln().abs();
                if best.as_ref().is_none_or(|(known, ..)| off < *known) {
                    best = Some((off, strength, state, u));
                }
                if off < NEAR.ln() || matches!(load.action, Action::Handle(..)) {
                    break;
                }
            }
            let Some((_, strength, found, u)) = best else { break };
            let part = |k: usize| before + (strength - before) * k as f64 / FINER as f64;
            finer = finer.and_then(|start| (1..=FINER).try_fold(start, |from, k| grown(&from.0, part(k))));
            let apart = finer.as_ref().map_or(f64::INFINITY, |(_, other)| mass_error(shell, other, &u));
            (state, before) = (found, strength);
            numbers.extend([l as f64, aim, strength, apart]);
            numbers.extend(u.iter().flat_map(|u| u.iter().copied()));
        }
    }
}

fn largest(u: &[Vec3]) -> f64 {
    u.iter().map(|u| u.norm()).fold(0.0, f64::max)
}
