//! The scenes in motion, played by every method over its knobs, against the converged nonlinear shell.

use crate::cache::Cache;
use crate::effort::{Effort, Progress};
use crate::error::{amplitude, period, quartiles, relative_l2};
use crate::library::{Library, Model};
use crate::mesh::{Mesh, P3};
use crate::methods::{Family, KINDS, METHODS, Method, PAPER, method};
use crate::row::Row;
use crate::scenes::{Drive, FRAME, Played, Reference, Scene, Setting};
use anyhow::Result;

/// What a scene gave.
pub struct Outcome {
    pub rows: Vec<Row>,
    /// Estimated relative L2 error of the reference itself.
    pub reference_error: f64,
    /// How it was found, for the page.
    pub reference_text: String,
    /// For the page: each method in the paper's number of modes, steps of 1/30 s, and the full shell last.
    pub shown: Vec<Track>,
}

/// A motion of the page's player.
pub struct Track {
    pub name: &'static str,
    pub colour: (u8, u8, u8),
    /// Relative L2 error; none of the reference itself.
    pub error: Option<f64>,
    pub frames: Vec<Vec<P3>>,
}

/// The methods that are shown, by the integrator that does not damp where there is one, and by the most fields.
const SHOWN: [&str; 7] =
    ["lma_exact", "warp_exact", "virtual_work_exact", "rotation_strain", "polynomial_40", "adaptive_40", "reduced_40"];

fn is_shown(scene: &Scene, s: &Setting) -> bool {
    let modes = s.method.fields > 0 || s.modes == scene.paper_modes;
    SHOWN.contains(&s.method.key) && modes && s.steps == 1.0 && !s.f64_basis && !s.coarse
}

fn setting(method: &'static Method, modes: usize, steps: f64) -> Setting {
    Setting { method, modes, steps, f64_basis: false, coarse: false }
}

/// Steps times modes times frames times vertices that a single run may take: about two seconds. The paper's setting at the
/// explicit shell's step is let through on small meshes.
const LARGEST_RUN: f64 = 1e8;

/// Every choice of knobs.
pub fn settings(scene: &Scene, effort: Effort) -> Vec<Setting> {
    let full = effort == Effort::Full;
    let (modes, steps): (&[usize], &[f64]) = match effort {
        Effort::Full => (&[1, 2, 4, 8, 16, 32, 64], &[0.5, 1.0, 2.0, 4.0, 8.0, 32.0, 1000.0]),
        Effort::Quick => (&[2, 4, 8, 32], &[1.0, 4.0]),
        Effort::Smoke => (&[2, 8], &[1.0]),
    };
    let mut all = vec![];
    for &m in modes.iter().filter(|m| **m <= scene.most_modes) {
        for method in METHODS.iter().filter(|m| matches!(m.family, Family::Lma | Family::Warp)) {
            let finest = if m == scene.paper_modes && method.key == PAPER { 1000.0 } else { 128.0 / m as f64 };
            for &k in steps.iter().filter(|k| **k <= finest.max(4.0)) {
                let work = k * (m * scene.frames * scene.mesh.positions.len()) as f64;
                if work > if k == 1000.0 { 10.0 * LARGEST_RUN } else { LARGEST_RUN } {
                    continue;
                }
                let plain = setting(method, m, k);
                if full && (m == scene.paper_modes || m == scene.most_modes) && k <= 8.0 {
                    all.push(Setting { f64_basis: true, ..plain.clone() });
                }
                if full && scene.coarse.is_some() && m <= 16 && k <= 4.0 {
                    all.push(Setting { coarse: true, ..plain.clone() });
                }
                all.push(plain);
            }
        }
    }
    // Fields stand for what more modes would bring, and their steps are of second order.
    let modes = if effort == Effort::Smoke { 2 } else { 8 };
    for method in METHODS.iter().filter(|m| m.family == Family::Reduced) {
        all.extend(steps.iter().filter(|k| (1.0..=4.0).contains(*k)).map(|&k| setting(method, modes, k)));
    }
    let [implicit, second, explicit] = ["shell_implicit", "shell_second", "shell_explicit"].map(method);
    let implicit_steps: &[f64] = match scene.reference {
        Reference::Extrapolated => &[1.0, 2.0, 4.0],
        _ if full => &[0.5, 1.0, 2.0, 4.0, 8.0, 16.0],
        _ => steps,
    };
    all.extend(implicit_steps.iter().map(|&k| setting(implicit, 1, k)));
    let few = if matches!(scene.reference, Reference::Extrapolated) { 1.0 } else { 4.0 }; // minutes a run
    all.extend(implicit_steps.iter().filter(|k| **k <= few).map(|&k| setting(second, 1, k)));
    if let Reference::Explicit { steps, check } = scene.reference {
        let mut counts = vec![steps];
        if full {
            counts.extend([check, steps / 4]);
        }
        all.extend(counts.into_iter().map(|k| setting(explicit, 1, k as f64)));
        if full {
            let coarse = |method, k: f64| Setting { coarse: true, ..setting(method, 1, k) };
            all.push(coarse(explicit, check as f64));
            all.extend(implicit_steps.iter().filter(|k| **k <= 4.0).map(|&k| coarse(implicit, k)));
        }
    }
    all.sort_by_key(|s| (s.method.family == Family::Shell, s.method.fields, s.coarse, s.f64_basis, s.modes)); // one model for neighbours
    all
}

/// The reference's frames, its own error and how it came about.
fn reference(scene: &Scene, library: &Library, cache: &Cache, effort: Effort) -> Result<(Played, f64, String)> {
    let run = |key, k: usize| {
        let s = setting(method(key), 1, k as f64);
        cache.played(scene, &s, || scene.play(&scene.model(library, &s)?, &s))
    };
    let weights = scene.mesh.vertex_areas();
    match scene.reference {
        Reference::Explicit { steps, check } => {
            let fine = run("shell_explicit", steps)?;
            let text = format!("explicit steps of 1/{} s", 30 * steps);
            if effort != Effort::Full {
                return Ok((fine, f64::NAN, text));
            }
            let other = run("shell_explicit", check)?;
            let difference = relative_l2(pairs(&other.frames, &fine.frames), &scene.mesh.positions, &weights);
            let error = difference / (steps as f64 / check as f64 - 1.0);
            Ok((fine, error, format!("{text}, its own error from a second run at 1/{} s", 30 * check)))
        }
        Reference::Extrapolated => {
            let [one, two, four] = [1, 2, 4].map(|k| run("shell_implicit", k));
            let (one, two, mut four) = (one?, two?, four?);
            let combined = |weights: P3| -> Vec<Vec<P3>> {
                let frames = one.frames.iter().zip(&two.frames).zip(&four.frames);
                let place = |((a, b), d): ((&P3, &P3), &P3)| -> P3 {
                    std::array::from_fn(|c| weights[0] * a[c] + weights[1] * b[c] + weights[2] * d[c])
                };
                frames.map(|((a, b), d)| a.iter().zip(b).zip(d).map(place).collect()).collect()
            };
            let once = combined([0.0, -1.0, 2.0]);
            four.frames = combined([1.0 / 3.0, -2.0, 8.0 / 3.0]);
            let error = relative_l2(pairs(&once, &four.frames), &scene.mesh.positions, &weights);
            let text = "implicit steps of 1/30, 1/60 and 1/120 s extrapolated twice to none; the error is the difference to \
                extrapolating once";
            Ok((four, error, text.to_owned()))
        }
    }
}

/// Frames that both have.
fn pairs<'a>(a: &'a [Vec<P3>], b: &'a [Vec<P3>]) -> impl Iterator<Item = (&'a [P3], &'a [P3])> {
    a.iter().zip(b).filter(|(a, b)| !a.is_empty() && !b.is_empty()).map(|(a, b)| (&a[..], &b[..]))
}

/// A motion carried over to another mesh of the same sheet.
fn carried(frames: &[Vec<P3>], from: &Mesh, to: &Mesh) -> Vec<Vec<P3>> {
    let samples: Vec<_> = to.place.iter().map(|p| from.sample(*p)).collect();
    let place = |frame: &Vec<P3>, v: usize| -> P3 {
        std::array::from_fn(|c| {
            let u = samples[v].iter().map(|&(i, w)| w * (frame[i][c] - from.positions[i][c])).sum::<f64>();
            to.positions[v][c] + u
        })
    };
    frames.iter().map(|frame| (0..to.positions.len()).map(|v| place(frame, v)).collect()).collect()
}

/// All runs of a scene.
pub fn run(
    scene: &Scene,
    library: &Library,
    cache: &Cache,
    effort: Effort,
    progress: &mut Progress,
) -> Result<Outcome> {
    progress.say(&format!("{}: the reference", scene.title));
    let (truth, reference_error, reference_text) = reference(scene, library, cache, effort)?;
    let truth_on_coarse = scene.coarse.as_ref().map(|(mesh, _)| carried(&truth.frames, &scene.mesh, mesh));
    let (mut rows, mut shown) = (vec![], vec![]);
    let all = settings(scene, effort);
    let mut last: Option<((usize, u32, bool, bool), Model)> = None;
    for (done, s) in all.iter().enumerate() {
        progress.say(&format!("{}: run {} of {}", scene.title, done + 1, all.len()));
        let modes = if s.method.family == Family::Shell { 1 } else { s.modes };
        let key = (modes, s.method.fields, s.f64_basis, s.coarse);
        if last.as_ref().is_none_or(|(k, _)| *k != key) {
            last = Some((key, scene.model(library, s)?));
        }
        let model = &last.as_ref().expect("just made").1;
        let play = || scene.play(model, s);
        let played = if s.method.family == Family::Shell { cache.played(scene, s, play) } else { play() };
        let truth_here = if s.coarse { truth_on_coarse.as_ref().unwrap_or(&truth.frames) } else { &truth.frames };
        let frames = played.as_ref().ok().filter(|_| is_shown(scene, s)).map(|played| played.frames.clone());
        let mut row = measured(scene, s, played, &truth, truth_here);
        // Nothing is known to be closer than the reference is to the truth: not its neighbours, nor itself.
        row.l2 = row.l2.max(reference_error);
        let reference = matches!(scene.reference, Reference::Explicit { steps, .. } if s.steps == steps as f64);
        if reference && s.method.key == "shell_explicit" && !s.coarse {
            row.l2 = reference_error;
        }
        if let Some(frames) = frames {
            let name = KINDS.iter().find(|k| k.method == s.method.method).map_or(s.method.label, |k| k.name);
            shown.push(Track { name, colour: s.method.colour, error: Some(row.l2), frames });
        }
        rows.push(row);
    }
    let order = |t: &Track| KINDS.iter().position(|k| k.name == t.name);
    shown.sort_by_key(order);
    let colour = method("shell_implicit").colour;
    shown.push(Track { name: "full shell", colour, error: None, frames: truth.frames });
    Ok(Outcome { rows, reference_error, reference_text, shown })
}

fn measured(scene: &Scene, s: &Setting, played: Result<Played>, truth: &Played, truth_here: &[Vec<P3>]) -> Row {
    let mesh = scene.mesh_of(s);
    let mut row = Row::new(scene.key, String::new(), s.method, s.modes);
    (row.steps, row.f64_basis, row.vertices) = (s.steps, s.f64_basis, mesh.positions.len());
    row.paper = s.method.key == PAPER && s.modes == scene.paper_modes && s.steps == 1.0 && !s.f64_basis && !s.coarse;
    let played = match played {
        Ok(played) => played,
        Err(error) => {
            row.failure = error.to_string();
            return row;
        }
    };
    row.l2 = relative_l2(pairs(&played.frames, truth_here), &mesh.positions, &mesh.vertex_areas());
    let rest = mesh.area(&mesh.positions);
    let changes = played.frames.iter().filter(|f| !f.is_empty()).map(|f| mesh.area(f) / rest - 1.0);
    row.area = changes.fold(0.0, |worst: f64, a| if a.abs() > worst.abs() { a } else { worst });
    if s.steps >= 1.0 {
        let signal = |mesh: &Mesh, frames: &[Vec<P3>]| -> Vec<f64> {
            let v = mesh.nearest(scene.probe.0);
            frames.iter().map(|f| f[v][scene.probe.1]).collect()
        };
        let (ours, theirs) = (signal(mesh, &played.frames), signal(&scene.mesh, &truth.frames));
        row.amplitude = amplitude(&ours) / amplitude(&theirs) - 1.0;
        if let (Drive::Released, Some(a), Some(b)) = (scene.drive, period(&ours, FRAME), period(&theirs, FRAME)) {
            row.period = a / b - 1.0;
        }
        if let (Drive::Released, 0.0) = (scene.drive, scene.damping) {
            let largest = played.energy.iter().map(|e| e[1]).fold(0.0, f64::max);
            row.drift = played.energy.iter().map(|e| e[0].abs()).fold(0.0, f64::max) / largest;
        }
    }
    row.us = quartiles(&played.seconds).map(|t| t * 1e6);
    row
}
