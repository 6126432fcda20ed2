//! Shells in motion: how far what moves by fields is from the full shell, and what is shown after Newton steps in each frame.

use crate::common::{leaf, read_obj};
use crate::{docs, scenes};
use shellwarp::model::{Model, Options};
use shellwarp::reduced;
use shellwarp::state::{Damping, Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::{Material, Shell, Vec3};
use std::sync::Arc;

const FRAMES: usize = 30;
/// A frame, s, and steps of it.
const FRAME: f64 = 1.0 / 30.0;
const STEPS: usize = 4;
/// The judge is judged by itself in steps of this part.
const FINER: usize = 2;
/// Frames in which a weight grows.
const GROWS: usize = 20;
/// Newton steps in each frame.
const WAYS: [usize; 2] = [1, 2];

struct Subject {
    key: &'static str,
    shell: Arc<Shell>,
    /// A weight of 1 g, and centimetres of a unit.
    weight: Vec3,
    centimetres: f64,
    /// Weights that come at once, in g; and one that grows.
    drops: [f64; 3],
    ramp: f64,
}

/// A weight, how it comes, and damping by mass, 1/s.
struct Motion {
    share: f64,
    grows: bool,
    damping: f64,
}

impl Motion {
    fn of(subject: &Subject) -> Vec<Self> {
        let drops = subject.drops.map(|share| Self { share, grows: false, damping: 3.0 });
        let ramps = [0.0, 3.0, 40.0].map(|damping| Self { share: subject.ramp, grows: true, damping });
        drops.into_iter().chain(ramps).collect()
    }

    fn name(&self) -> String {
        if self.grows { format!("{} g in {GROWS} frames", self.share) } else { format!("{} g at once", self.share) }
    }

    /// Runs a state, in so many steps a frame, and tells it each frame.
    fn run(&self, subject: &Subject, state: &mut State, steps: usize, told: &mut dyn FnMut(&mut State)) {
        state.set_damping(&Damping { mass_coefficient: self.damping, ..Damping::default() }).unwrap();
        for k in 1..=FRAMES {
            let part = if self.grows { (k as f64 / GROWS as f64).min(1.0) } else { 1.0 };
            state.set_gravity(part * self.share * subject.weight).unwrap();
            (0..steps).for_each(|_| state.step(FRAME / steps as f64).unwrap());
            told(state);
        }
    }
}

/// The hat held by its crown, so that its brim hangs free.
fn crowned() -> Shell {
    let (positions, triangles) = read_obj("character_hat.obj");
    let heights = || positions.iter().map(|x| x.y);
    let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
    let material = Material { k_area: 2e5, k_length: 2e5, k_bend: 1400.0, area_density: 0.05 };
    scenes::shell(positions.clone(), &triangles, material, |x| x.y > high - 0.25 * (high - low))
}

fn subjects() -> [Subject; 3] {
    let hat = |key, shell| Subject {
        key,
        shell: Arc::new(shell),
        weight: Vec3::new(0.0, -981.0, 0.0),
        centimetres: 1.0,
        drops: [0.2, 0.5, 1.0],
        ramp: 0.5,
    };
    let leaf = Subject {
        key: "leaf",
        shell: Arc::new(leaf(1)),
        weight: Vec3::new(0.0, 0.0, -9.81),
        centimetres: 100.0,
        drops: [0.03, 0.1, 0.3],
        ramp: 0.1,
    };
    [leaf, hat("hat, by its band", scenes::hat()), hat("hat, by its crown", crowned())]
}

/// Root mean square over the vertices, mean over frames, cm.
fn apart(subject: &Subject, a: &[Vec<Vec3>], b: &[Vec<Vec3>]) -> String {
    let of_frame = |(a, b): (&Vec<Vec3>, &Vec<Vec3>)| {
        (a.iter().zip(b).map(|(a, b)| (a - b).norm_squared()).sum::<f64>() / a.len() as f64).sqrt()
    };
    let mean = a.iter().zip(b).map(of_frame).sum::<f64>() / a.len() as f64;
    let mean = subject.centimetres * mean;
    if mean < 0.1 { format!("{mean:.3}") } else { format!("{mean:.2}") }
}

fn row(subject: &Subject, model: &Arc<Model>, motion: &Motion) -> String {
    let positions = &subject.shell.mesh.positions;
    // What is shown of each frame.
    let frames = |method, steps, corrections| {
        let (mut state, mut frames) = (State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap(), vec![]);
        motion.run(subject, &mut state, steps, &mut |state| {
            state.correct(corrections).unwrap();
            let x = state.positions_corrected(Space::Frame, corrections).unwrap();
            frames.push(x.iter().zip(positions).map(|(x, rest)| x - rest).collect::<Vec<_>>());
        });
        frames
    };
    let (finer, full, own, shown) = std::thread::scope(|scope| {
        let finer = scope.spawn(|| frames(Method::ImplicitShell, FINER * STEPS, 0));
        let full = frames(Method::ImplicitShell, STEPS, 0);
        let by_fields = |corrections| frames(model.chosen_method(), STEPS, corrections);
        let (own, shown) = (by_fields(0), WAYS.map(by_fields));
        (finer.join().unwrap(), full, own, shown)
    });
    let rest = vec![vec![Vec3::zeros(); positions.len()]; FRAMES];
    let [moved, judge, own] = [&rest, &finer, &own].map(|other| apart(subject, other, &full));
    let shown = shown.map(|frames| apart(subject, &frames, &full));
    let (name, damping) = (motion.name(), motion.damping);
    format!("| {} | {name} | {damping} | {moved} | {judge} | {own} | {} |\n", subject.key, shown.join(" | "))
}

pub fn table(keys: &[String], file: Option<&String>) {
    let mut table = format!(
        "Centimetres, root mean square over the vertices, mean over {FRAMES} frames of {STEPS} steps of 1/{:.0} s by backward Euler. The judge is the full shell by the same steps; it is told apart from \
         itself by steps of half the length. What moves by fields has 40 of them beside 16 modes, and is what `SW_METHOD_AUTO` takes. `make bench-correction` on {} (load {}).\n\n\
         | shell | weight | damping, 1/s | the full shell moved | by half steps | by fields | shown, 1 step a frame | 2 steps |\n\
         |---|---|---|---|---|---|---|---|\n",
        STEPS as f64 / FRAME,
        docs::machine(),
        docs::load()
    );
    for subject in subjects().iter().filter(|s| keys.is_empty() || keys.iter().any(|key| key == s.key)) {
        let poses = reduced::default_poses(subject.shell.mass.len());
        let reduced = reduced::Options { fields: 40, poses, ..Default::default() };
        let options = Options { modes: 16, reduced, ..Options::default() };
        let model = Arc::new(Model::precompute(subject.shell.clone(), &options, &mut |_, _| Ok(())).unwrap());
        for motion in Motion::of(subject) {
            let row = row(subject, &model, &motion);
            print!("{row}");
            table.push_str(&row);
        }
    }
    if let Some(file) = file {
        docs::put_section(file, "motion", &table).unwrap();
    }
}
