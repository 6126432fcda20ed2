//! Measured points. Errors and times go to files of their own, so that the errors can be compared from run to run byte by byte.

use crate::methods::{Family, Method};
use anyhow::Result;
use std::path::Path;

/// One run of one method with one choice of its knobs.
#[derive(Clone)]
pub struct Row {
    pub scene: String,
    /// The load of a static case.
    pub case: String,
    pub method: &'static Method,
    pub modes: usize,
    /// Steps per frame of 1/30 s.
    pub steps: f64,
    pub f64_basis: bool,
    pub vertices: usize,
    /// The scene's paper setting.
    pub paper: bool,
    /// Empty, or why there are no errors.
    pub failure: String,
    /// Relative L2 displacement error.
    pub l2: f64,
    /// ΣA/ΣĀ − 1: largest in magnitude over time.
    pub area: f64,
    /// Relative errors of period and amplitude of the scene's probe.
    pub period: f64,
    pub amplitude: f64,
    /// Largest change of total energy over the largest elastic energy, where nothing puts energy in or out.
    pub drift: f64,
    /// Microseconds per frame: lower quartile, median, upper quartile.
    pub us: [f64; 3],
}

impl Row {
    /// A run without measures yet.
    pub fn new(scene: &str, case: String, method: &'static Method, modes: usize) -> Self {
        Self {
            scene: scene.to_owned(),
            case,
            method,
            modes,
            steps: 1.0,
            f64_basis: false,
            vertices: 0,
            paper: false,
            failure: String::new(),
            l2: f64::NAN,
            area: f64::NAN,
            period: f64::NAN,
            amplitude: f64::NAN,
            drift: f64::NAN,
            us: [f64::NAN; 3],
        }
    }

    /// The step as people write it.
    pub fn step(&self) -> String {
        format!("1/{}", (30.0 * self.steps).round())
    }

    /// The knobs in words.
    pub fn knobs(&self) -> String {
        let mut words = vec![];
        if self.method.family != Family::Shell {
            words.push(format!("{} mode{}", self.modes, if self.modes == 1 { "" } else { "s" }));
        }
        words.push(format!("h = {} s", self.step()));
        if self.f64_basis {
            words.push("f64".to_owned());
        }
        words.push(format!("{} vertices", self.vertices));
        words.join(", ")
    }

    fn key(&self) -> [String; 7] {
        let modes = if self.method.family == Family::Shell { String::new() } else { self.modes.to_string() };
        let precision = if self.f64_basis || self.method.family == Family::Shell { "f64" } else { "f32" };
        let (scene, case) = (self.scene.clone(), self.case.clone());
        [scene, case, self.method.key.into(), modes, self.step(), precision.into(), self.vertices.to_string()]
    }
}

/// Six digits, or nothing.
pub fn number(x: f64) -> String {
    if x.is_finite() { format!("{x:.5e}") } else { String::new() }
}

const KEY: [&str; 7] = ["scene", "case", "method", "modes", "step_s", "precision", "vertices"];

/// Writes errors.csv and times.csv.
pub fn write(folder: &Path, rows: &[Row]) -> Result<()> {
    let mut errors = csv::Writer::from_path(folder.join("errors.csv"))?;
    let measures = ["l2_error", "area_change", "period_error", "amplitude_error", "energy_drift", "paper", "failure"];
    errors.write_record(KEY.iter().chain(&measures))?;
    let mut times = csv::Writer::from_path(folder.join("times.csv"))?;
    times.write_record(KEY.iter().chain(&["us_per_frame", "lower_quartile", "upper_quartile"]))?;
    for row in rows {
        let values = [row.l2, row.area, row.period, row.amplitude, row.drift].map(number);
        let tail = [if row.paper { "yes".to_owned() } else { String::new() }, row.failure.clone()];
        errors.write_record(row.key().iter().chain(&values).chain(&tail))?;
        let us =
            [row.us[1], row.us[0], row.us[2]].map(|t| if t.is_finite() { format!("{t:.2}") } else { String::new() });
        times.write_record(row.key().iter().chain(&us))?;
    }
    errors.flush()?;
    times.flush()?;
    Ok(())
}

/// Writes a table of texts.
pub fn write_table(path: &Path, header: &[&str], rows: &[Vec<String>]) -> Result<()> {
    let mut table = csv::Writer::from_path(path)?;
    table.write_record(header)?;
    rows.iter().try_for_each(|row| table.write_record(row))?;
    table.flush()?;
    Ok(())
}
