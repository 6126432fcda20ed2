//! Convergence in step size: each method on the released flat beam against its own limit, and in modes on the hanging beam.

use crate::cache::Cache;
use crate::effort::Effort;
use crate::error::{observed_order, relative_l2};
use crate::library::Library;
use crate::mesh::P3;
use crate::methods::{Family, METHODS};
use crate::scenes::{Scene, Setting};
use crate::statics::hanging;
use anyhow::Result;

/// One step size of one method.
pub struct StepPoint {
    pub method: &'static str,
    pub steps: f64,
    /// Relative L2 distance over time to the same method at the finest step.
    pub error: f64,
    pub order: f64,
}

/// The first second is enough, and keep it cheap.
const FRAMES: usize = 30;

/// Distances to the finest run; the order is that of neighbours, so the last one shown is half the finest's step or longer.
pub fn steps(scene: &Scene, library: &Library, cache: &Cache, effort: Effort) -> Result<Vec<StepPoint>> {
    let scene = Scene { frames: FRAMES, ..scene.clone() };
    let mut all = vec![];
    for method in METHODS {
        let steps: &[f64] = match (method.key, effort) {
            ("shell_explicit", Effort::Full) => &[500.0, 1000.0, 2000.0, 8000.0],
            ("shell_explicit", _) => continue,
            ("shell_implicit" | "shell_second", Effort::Full) => &[1.0, 2.0, 4.0, 8.0, 64.0],
            ("shell_implicit" | "shell_second", _) => &[1.0, 2.0, 8.0],
            _ if method.family == Family::Reduced => &[1.0, 2.0, 4.0, 8.0, 64.0],
            _ => &[1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 1024.0],
        };
        let run = |k: f64| {
            let s = Setting { method, modes: 8, steps: k, f64_basis: true, coarse: false };
            let play = || scene.play(&scene.model(library, &s)?, &s);
            if method.family == Family::Shell { cache.played(&scene, &s, play) } else { play() }
        };
        let finest = run(*steps.last().expect("steps"))?;
        let weights = scene.mesh.vertex_areas();
        let mut last: Option<(f64, f64)> = None;
        for &k in &steps[..steps.len() - 1] {
            let played = run(k)?;
            let pairs = played.frames.iter().zip(&finest.frames).map(|(a, b)| (&a[..], &b[..]));
            let error = relative_l2(pairs, &scene.mesh.positions, &weights);
            let order = last.map_or(f64::NAN, |(e, s)| observed_order([e, error], [1.0 / s, 1.0 / k]));
            all.push(StepPoint { method: method.key, steps: k, error, order });
            last = Some((error, k));
        }
    }
    Ok(all)
}

/// Modes, and relative L2 error of LMA and of the warp against the nonlinear shell on the same mesh.
pub fn modes(library: &Library, effort: Effort) -> Result<Vec<(usize, [f64; 2])>> {
    use crate::scenes::beams::{ROWS, flat_mesh, material};
    let mesh = flat_mesh(ROWS);
    let gravity: P3 = [0.0, 0.0, -0.2];
    let most = if effort == Effort::Full { 128 } else { 32 };
    let counts: Vec<usize> = [1, 2, 4, 8, 16, 32, 64, 128].into_iter().filter(|m| *m <= most).collect();
    let model = |m| library.model(&mesh, material(ROWS, 1e4, 1.0), &mesh.root(), m, true);
    let truth = hanging(&model(1)?, crate::methods::method("shell_implicit"), gravity)?;
    let mut all = vec![];
    for m in counts {
        let model = model(m)?;
        let error = |key| -> Result<f64> {
            let x = hanging(&model, crate::methods::method(key), gravity)?;
            Ok(relative_l2([(&x[..], &truth[..])].into_iter(), &mesh.positions, &mesh.vertex_areas()))
        };
        all.push((m, [error("lma_implicit")?, error("warp_implicit")?]));
    }
    Ok(all)
}
