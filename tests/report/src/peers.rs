//! Other people's programs, run for scale. What is not installed is left out, and the page says so.

use anyhow::Result;
use serde::Deserialize;
use std::path::Path;
use std::process::Command;

/// A peer's figures, or why there are none.
pub type Found<T> = std::result::Result<T, String>;

#[derive(Deserialize)]
pub struct Eigsh {
    pub scipy: String,
    pub unknowns: usize,
    pub modes: usize,
    pub runs: usize,
    pub ours_seconds: f64,
    pub scipy_seconds: f64,
    pub eigenvalues_apart: f64,
}

#[derive(Deserialize)]
pub struct Cloth {
    pub solver: String,
    pub vertices: usize,
    pub us_per_frame: f64,
}

pub struct Peers {
    pub eigsh: Found<Eigsh>,
    pub cloth: Found<Vec<Cloth>>,
}

/// Runs a script of tests/report/peers that prints JSON on its last line.
fn run<T: for<'a> Deserialize<'a>>(python: &Path, script: &Path, module: &str, argument: &str) -> Found<T> {
    let has = Command::new(python).args(["-c", &format!("import {module}")]).output();
    if !has.is_ok_and(|o| o.status.success()) {
        return Err(format!(
            "skipped: the Python package {module} is not installed (sh cmake/bootstrap.sh bench cloth)"
        ));
    }
    let done = Command::new(python).arg(script).arg(argument).output().map_err(|e| e.to_string())?;
    let text = String::from_utf8_lossy(&done.stdout);
    let last = text.lines().last().unwrap_or_default();
    let reason = |e: serde_json::Error| {
        let trouble = String::from_utf8_lossy(&done.stderr);
        format!("failed: {}: {e}: {}", script.display(), trouble.lines().last().unwrap_or_default())
    };
    serde_json::from_str(last).map_err(reason)
}

pub fn all(python: &Path, folder: &Path, full: bool) -> Result<Peers> {
    let script = |name: &str| folder.join(name);
    if !full {
        let left_out = || "left out of a quick run".to_owned();
        return Ok(Peers { eigsh: Err(left_out()), cloth: Err(left_out()) });
    }
    Ok(Peers {
        eigsh: run(python, &script("eigsh_scipy.py"), "scipy", "3"),
        cloth: run(python, &script("cloth_newton.py"), "newton", "5"),
    })
}
