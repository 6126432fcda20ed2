//! Error against the full shell on loads that were never trained on: the paper's warp beside reduced shells of several sizes, with the best
//! that their fields could do, and what goes on after `State::fall_back`. docs/front.md says what it found.
//!
//! usage: front [--scene KEY] [--reduced "FIELDS,ELEMENTS,POSES ..."]
#![allow(missing_docs)]

#[path = "front/cases.rs"]
mod cases;
#[path = "../common/mod.rs"]
mod common;
#[path = "front/scenes.rs"]
mod scenes;

use cases::{Case, apply, displacements, state};
use scenes::{Part, Scene};
use shellwarp::model::{Model, Options};
use shellwarp::reduced::{self, AnyFields};
use shellwarp::state::{Method, State};
use shellwarp::{Shell, Vec3};
use std::sync::Arc;
use std::time::Instant;

/// Up to rounding and the tolerance of equilibria.
const SAME: f64 = 1.0001;

fn error(shell: &Shell, u: &[Vec3], exact: &[Vec3]) -> f64 {
    let norm = |f: &dyn Fn(usize) -> Vec3| -> f64 {
        (0..exact.len()).map(|v| shell.mass[v] * f(v).norm_squared()).sum::<f64>().sqrt()
    };
    norm(&|v| u[v] - exact[v]) / norm(&|v| exact[v])
}

/// The best that fields can do.
fn projection(model: &Model, exact: &[Vec3]) -> f64 {
    let Some(reduced) = &model.reduced else { return f64::NAN };
    let AnyFields::F32(fields) = &reduced.fields else { return f64::NAN };
    let mass = &model.shell.mass;
    let q: Vec<f64> =
        (0..fields.n).map(|k| (0..exact.len()).map(|v| mass[v] * fields.at(k, v).dot(&exact[v])).sum()).collect();
    let mut u = vec![Vec3::zeros(); exact.len()];
    fields.displacements(&q, |v, x| u[v] = x);
    error(&model.shell, &u, exact)
}

/// Under the load of a case, whether it comes to rest or not.
fn loaded(scene: &Scene, model: &Arc<Model>, method: Method, case: &Case) -> Option<(State, bool)> {
    let rest = &scene.shell.mesh.positions;
    let mut state = state(model, method).ok()?;
    apply(&mut state, &scene.loads(case.part == Part::Fresh)[case.load].action, case.strength, rest).ok()?;
    let found = state.equilibrium().is_ok();
    Some((state, found))
}

fn off(scene: &Scene, state: &State, case: &Case) -> f64 {
    error(&scene.shell, &displacements(state, &scene.shell.mesh.positions), &case.exact)
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let value = |key: &str| arguments.iter().position(|a| a == key).and_then(|i| arguments.get(i + 1));
    for scene in scenes::all() {
        if value("--scene").is_some_and(|key| key != scene.key) {
            continue;
        }
        let start = Instant::now();
        let cases = cases::find(&scene);
        println!(
            "{} ({}): {} vertices, {} cases in {:.1} s",
            scene.key,
            scene.text,
            scene.shell.mass.len(),
            cases.len(),
            start.elapsed().as_secs_f64()
        );
        let mut models = vec![];
        for spec in value("--reduced").map_or("40,0,52 100,0,52", |s| s).split_whitespace() {
            let n: Vec<usize> = spec.split(',').map(|n| n.parse().unwrap()).collect();
            let reduced = reduced::Options { fields: n[0], elements: n[1], poses: n[2], ..Default::default() };
            let options = Options { modes: 8, reduced, ..Options::default() };
            let start = Instant::now();
            let model = Arc::new(Model::precompute(scene.shell.clone(), &options, &mut |_, _| Ok(())).unwrap());
            let reduced = model.reduced.as_ref().unwrap();
            println!(
                "  {spec}: {} fields, {} elements, fit {:.1e}, {:.1} s",
                reduced.n(),
                reduced.samples.len(),
                reduced.fit,
                start.elapsed().as_secs_f64()
            );
            models.push(model);
        }
        for (part, name) in [(Part::Validation, "validation"), (Part::HeldOut, "held out"), (Part::Fresh, "fresh")] {
            let (mut ratios, mut fallen) = (vec![vec![]; models.len()], vec![0; models.len()]);
            for case in cases.iter().filter(|case| case.part == part) {
                let of = |model: &Arc<Model>, method: Method| {
                    let at_rest = loaded(&scene, model, method, case);
                    at_rest.filter(|(_, found)| *found).map_or(f64::INFINITY, |(state, _)| off(&scene, &state, case))
                };
                let warp = of(&models[0], Method::Warp);
                print!("{:<22} {:.2} {:.3}: paper {warp:.3} |", case.name, case.aim, case.moved);
                for ((model, ratios), fallen) in models.iter().zip(&mut ratios).zip(&mut fallen) {
                    let own = of(model, Method::ReducedShell);
                    ratios.push((own / warp, own));
                    print!(" {own:.4} ({:.4})", projection(model, &case.exact));
                    let Some((mut state, _)) = loaded(&scene, model, Method::ReducedShell, case) else { continue };
                    let estimate = state.fall_back();
                    let (stays, after) = (state.method() == Method::ReducedShell, off(&scene, &state, case));
                    *fallen += usize::from(after > SAME * warp);
                    let (estimate, remaining) = estimate.map_or((f64::NAN, f64::NAN), |c| (c.error, c.remaining));
                    print!(
                        " [{} {after:.4}, estimate {estimate:.4}, left {remaining:.0e}]",
                        if stays { "stays" } else { "falls" }
                    );
                }
                println!();
            }
            for (ratios, fallen) in ratios.iter_mut().zip(fallen) {
                ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
                let mut errors: Vec<f64> = ratios.iter().map(|r| r.1).collect();
                errors.sort_by(f64::total_cmp);
                let middle = ratios.len() / 2;
                println!(
                    "  {}: ratio median {:.3}, worst {:.3}; error median {:.4}, worst {:.4}; worse than the paper: {}, fallen back: {fallen}",
                    name,
                    ratios[middle].0,
                    ratios[ratios.len() - 1].0,
                    errors[middle],
                    errors[errors.len() - 1],
                    ratios.iter().filter(|r| r.0 > 1.0).count()
                );
            }
        }
    }
}
