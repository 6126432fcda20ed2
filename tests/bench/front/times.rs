//! Error against the time of a frame, method by method, on each shell: a table and its picture.

use crate::cases::{self, AIMS, Case};
use crate::common::leaf;
use crate::scenes::{Action, Part, Scene};
use crate::{corrected, docs, median, off};
use shellwarp::Vec3;
use shellwarp::model::{Model, Options};
use shellwarp::reduced;
use shellwarp::state::{Damping, Method, Space, State};
use shellwarp::step::Integrator;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

/// Loads count up to this aim, in sizes.
const LARGEST: f64 = AIMS[1];
/// Frames of the way from one strength to the next, and seconds of one.
const FRAMES: usize = 24;
const FRAME: f64 = 1.0 / 30.0;
const MODES: usize = 8;
const FEW: usize = 2;
const FIELDS: [usize; 3] = [20, 40, 100];
/// Times that frames are timed, the best of which counts; those of the full shell and by its steps once.
const RUNS: usize = 5;

/// A way to have a shell's frames.
struct Way {
    model: Arc<Model>,
    method: Method,
    fields: usize,
    /// Newton steps of the full shell in each frame, which go on from one to the next.
    steps: usize,
}

/// A point of the front: of the loads, the error's median and 90th percentile, and microseconds of a frame.
struct Point {
    way: String,
    loads: usize,
    error: [f64; 2],
    frame: f64,
}

fn trained(scene: &Scene, fields: usize) -> Arc<Model> {
    let reduced = reduced::Options { fields, poses: reduced::MAX_POSES, ..Default::default() };
    let options = Options { modes: MODES, reduced, may_be_full: true, ..Options::default() };
    Arc::new(Model::precompute(scene.shell.clone(), &options, &mut |_, _| Ok(())).unwrap())
}

fn ways(scene: &Scene) -> Vec<Way> {
    let models = FIELDS.map(|fields| trained(scene, fields));
    let few = Options { modes: FEW, ..Options::default() };
    let few = Arc::new(Model::precompute(scene.shell.clone(), &few, &mut |_, _| Ok(())).unwrap());
    let mut ways = vec![];
    for method in [Method::LinearModalAnalysis, Method::Warp] {
        ways.push(Way { model: few.clone(), method, fields: 0, steps: 0 });
    }
    for method in [Method::LinearModalAnalysis, Method::Warp, Method::VirtualWorkWarp, Method::RotationStrain] {
        ways.push(Way { model: models[0].clone(), method, fields: 0, steps: 0 });
    }
    for method in [Method::PolynomialShell, Method::ReducedShell] {
        for (model, fields) in models.iter().zip(FIELDS) {
            ways.push(Way { model: model.clone(), method, fields, steps: 0 });
        }
    }
    let (model, fields) = (&models[1], FIELDS[1]);
    for steps in 1..=3 {
        ways.push(Way { model: model.clone(), method: model.chosen_form(), fields, steps });
    }
    ways.push(Way { model: model.clone(), method: Method::ImplicitShell, fields: 0, steps: 0 });
    ways
}

/// Gravity under which frames are timed: the last of these loads.
fn gravity(scene: &Scene, cases: &[Case]) -> Option<Vec3> {
    let of = cases.iter().rfind(|case| case.name.starts_with("gravity") && !case.name.contains("and"))?;
    let Action::Forces(forces) = &scene.loads(of.part.list())[of.load].action else { return None };
    let strength = of.strengths.last().copied().unwrap_or(0.0);
    Some(forces.iter().sum::<Vec3>() * (strength / scene.shell.total_mass))
}

/// Seconds of a frame: a step and all positions in single precision. Gravity grows over 24 frames, and stays for as many more.
fn seconds(scene: &Scene, way: &Way, gravity: Vec3) -> f64 {
    let mut state = State::new(way.model.clone(), way.method, Integrator::Exact).unwrap();
    state.set_damping(&Damping { mass_coefficient: 3.0, ..Damping::default() }).unwrap();
    let mut places = vec![[0f32; 3]; scene.shell.mass.len()];
    let mut seconds = 0.0;
    for k in 1..=2 * FRAMES {
        state.set_gravity(gravity * (k as f64 / FRAMES as f64).min(1.0)).unwrap();
        let started = Instant::now();
        state.step(FRAME).unwrap();
        match way.steps {
            0 => state.position_rows_f32(Space::Frame, |v, rows| places[v..v + rows.len()].copy_from_slice(rows)),
            steps => {
                state.correct(steps).unwrap();
                let x = state.positions_corrected(Space::Frame, steps).unwrap();
                places.iter_mut().zip(x).for_each(|(place, x)| *place = x.map(|x| x as f32).into());
            }
        }
        black_box(&places);
        seconds += started.elapsed().as_secs_f64();
    }
    seconds / (2 * FRAMES) as f64
}

/// How far a load's equilibrium is off, by a way; corrected frames lead there one after another.
fn error(scene: &Scene, way: &Way, case: &Case) -> f64 {
    let of = (&way.model, way.method);
    let found = match way.steps {
        0 => cases::loaded(scene, of.0, of.1, case).filter(|(_, found)| *found).map(|(s, _)| off(scene, &s, case)),
        steps => cases::led(scene, of, case, FRAMES, &mut |state| {
            let _ = state.correct(steps); // the next frame goes on from what there is
        })
        .and_then(|state| corrected(scene, &state, steps, case)),
    };
    found.unwrap_or(f64::INFINITY)
}

fn point(scene: &Scene, way: &Way, cases: &[Case], gravity: Vec3) -> Point {
    let full = way.method == Method::ImplicitShell;
    let mut errors: Vec<f64> = match full {
        true => vec![0.0; cases.len()], // it is the judge
        false => cases.iter().map(|case| error(scene, way, case)).collect(),
    };
    errors.sort_by(f64::total_cmp);
    let runs = if full || way.steps > 0 { 1 } else { RUNS };
    let frame = (0..runs).map(|_| seconds(scene, way, gravity)).fold(f64::INFINITY, f64::min);
    let modes = way.model.modal.n_modes();
    let method = way.method.entry().name.to_str().unwrap();
    let name = format!("{method},{modes},{},{}", way.fields, way.steps);
    Point {
        way: name,
        loads: cases.len(),
        error: [median(errors.clone()), errors[(errors.len() - 1) * 9 / 10]],
        frame: 1e6 * frame,
    }
}

/// One of many vertices, under few loads.
fn large() -> Scene {
    Scene::to_judge("large leaf", "leaf of 6,925 vertices", leaf(4))
}

/// Microseconds that a frame may take.
const BUDGETS: [f64; 7] = [2.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6];

/// A row of the table: what is least within each budget.
fn row(key: &str, points: &[Point]) -> String {
    let within = |budget: &f64| {
        let best = points.iter().filter(|p| p.frame <= *budget).min_by(|a, b| a.error[0].total_cmp(&b.error[0]));
        match best.map(|p| 100.0 * p.error[0]) {
            None => "–".to_owned(),
            Some(error) if error < 0.01 => "< 0.01 %".to_owned(),
            Some(error) => format!("{error:.2} %"),
        }
    };
    let mut times: Vec<f64> = points.iter().map(|p| p.frame).collect();
    times.sort_by(f64::total_cmp);
    let gap = times.windows(2).map(|pair| pair[1] / pair[0]).fold(0.0, f64::max);
    let cells: Vec<String> = BUDGETS.iter().map(within).collect();
    format!("| {key} | {} | {} | {gap:.1} |\n", points[0].loads, cells.join(" | "))
}

/// Writes `docs/evidence/fronts.csv` beside the table in `docs`, if that is given.
pub fn table(key: Option<&String>, file: Option<&String>) {
    let mut table = format!(
        "Median error within so much time a frame: a step of 1/30 s under gravity that grows, and all positions. `make bench-fronts` on {} (load {}).\n\n\
         | shell | loads | 2 µs | 10 µs | 100 µs | 1 ms | 10 ms | 100 ms | 1 s | largest gap |\n|---|---|---|---|---|---|---|---|---|---|\n",
        docs::machine(),
        docs::load()
    );
    let mut csv = String::from("shell,method,modes,fields,steps,loads,error,error_90,frame_us\n");
    for scene in crate::scenes::all().iter().chain([&large()]).filter(|scene| key.is_none_or(|key| key == scene.key)) {
        let counts = |case: &Case| {
            case.part != Part::Validation && case.is_confirmed() && case.aim <= LARGEST && case.came_near()
        };
        let cases: Vec<Case> = cases::find(scene).into_iter().filter(counts).collect();
        let gravity = gravity(scene, &cases).expect("a load of gravity");
        let points: Vec<Point> = ways(scene).iter().map(|way| point(scene, way, &cases, gravity)).collect();
        for Point { way, loads, error: [middle, most], frame } in &points {
            let line = format!("{},{way},{loads},{middle:.3e},{most:.3e},{frame:.2}\n", scene.key);
            print!("{line}");
            csv += &line;
        }
        let row = row(scene.key, &points);
        print!("{row}");
        table += &row;
    }
    if let Some(file) = file {
        docs::put_section(file, "front times", &table).unwrap();
        std::fs::write("docs/evidence/fronts.csv", csv).unwrap();
    }
}
