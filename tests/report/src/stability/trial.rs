//! One run of one method on one case, and its verdict.

use crate::library::{Library, Material, Model, Sheet, State};
use crate::mesh::{Mesh, P3};
use crate::methods::{Family, Method};
use anyhow::{Result, ensure};
use shellwarp::ffi::state::SwStateReport;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    Accurate,
    Inaccurate,
    Guarded,
    Refused,
    Broken,
}

/// One entry of the map.
#[derive(Clone, Debug)]
pub struct Cell {
    pub group: &'static str,
    pub case: String,
    pub method: &'static str,
    pub verdict: Verdict,
    /// Relative error against the judge, where there is one.
    pub error: f64,
    /// What it is judged by.
    pub judge: &'static str,
    /// Why it is not stable and accurate.
    pub note: String,
}

impl Cell {
    /// Of what is not accurate: none, or one that names no number.
    pub fn needs_reason(&self) -> bool {
        self.verdict != Verdict::Accurate && (self.note.is_empty() || self.note.contains("NaN"))
    }
}

/// A problem: model, load and steps.
#[derive(Clone)]
pub struct Problem {
    pub mesh: Mesh,
    pub material: Material,
    /// In place of the material.
    pub sheet: Option<Sheet>,
    pub fixed: Vec<u32>,
    pub modes: usize,
    pub gravity: P3,
    /// Rayleigh's ξ.
    pub damping: f64,
    pub steps: Vec<f64>,
}

/// Called before each step with its number.
pub type Drive<'a> = &'a dyn Fn(usize, &mut State) -> Result<()>;

/// Where a run ended.
pub struct End {
    /// In the support's frame.
    pub positions: Vec<P3>,
    /// Largest displacement and rotation on the way.
    pub displacement: f64,
    pub rotation: f64,
    /// ½ q̇ᵀq̇ over the elastic energy at the end.
    pub kinetic: f64,
    pub elastic: f64,
    pub contact: Told,
}

/// What a report tells of colliders after a step.
#[derive(Clone, Copy, Default)]
pub struct Told {
    pub contacts: u64,
    /// How deep the shell is in one.
    pub penetration: f64,
    /// Of all on the shell, over the step.
    pub impulse: P3,
}

impl Told {
    pub fn of(report: &SwStateReport) -> Self {
        let SwStateReport { contact_count, deepest_penetration, contact_impulse, .. } = *report;
        Self { contacts: contact_count, penetration: deepest_penetration, impulse: contact_impulse }
    }
}

impl Problem {
    /// As the method needs it.
    pub fn model(&self, library: &Library, method: &Method) -> Result<Model> {
        if let Some(sheet) = &self.sheet {
            return library.sheet_model(&self.mesh, sheet, &self.fixed, self.modes, method.fields);
        }
        library.reduced_model(&self.mesh, self.material, &self.fixed, self.modes, false, method.fields)
    }

    pub fn size(&self) -> f64 {
        let range = |c: usize| {
            let of = |pick: fn(f64, f64) -> f64, start| self.mesh.positions.iter().map(|p| p[c]).fold(start, pick);
            of(f64::max, f64::NEG_INFINITY) - of(f64::min, f64::INFINITY)
        };
        (0..3).map(|c| range(c).powi(2)).sum::<f64>().sqrt()
    }

    pub fn run(&self, library: &Library, method: &Method, drive: Drive) -> Result<End> {
        let model = self.model(library, method)?;
        let mut state = model.state(method.method, method.integrator)?;
        state.set_gravity(self.gravity)?;
        state.set_mass_damping(self.damping)?;
        let (positions, contact) = (vec![], Told::default());
        let mut end = End { positions, displacement: 0.0, rotation: 0.0, kinetic: 0.0, elastic: 0.0, contact };
        for (k, h) in self.steps.iter().enumerate() {
            drive(k, &mut state)?;
            state.step(*h)?;
            if k % 8 == 7 || k + 1 == self.steps.len() {
                let report = state.report()?;
                end.displacement = end.displacement.max(report.max_displacement);
                end.rotation = end.rotation.max(report.max_rotation);
                (end.kinetic, end.elastic) = (report.kinetic_energy, report.elastic_energy);
                end.contact = Told::of(&report);
                ensure!(report.max_displacement.is_finite() && report.kinetic_energy.is_finite(), "{NOT_FINITE}");
            }
        }
        end.positions = state.positions()?;
        ensure!(end.positions.iter().flatten().all(|x| x.is_finite()), "{NOT_FINITE}");
        Ok(end)
    }

    /// The static solution of the nonlinear shell, or another method's own.
    pub fn at_rest(&self, library: &Library, method: &Method) -> Result<Vec<P3>> {
        let mut state = self.model(library, method)?.state(method.method, 0)?;
        state.set_gravity(self.gravity)?;
        state.equilibrium()?;
        state.positions()
    }
}

const NOT_FINITE: &str = "positions are not finite";

/// |a − b| / max(|b − rest|, floor) in the 2-norm over vertices.
pub fn distance(a: &[P3], b: &[P3], rest: &[P3], floor: f64) -> f64 {
    let square = |x: &P3, y: &P3| (0..3).map(|c| (x[c] - y[c]).powi(2)).sum::<f64>();
    let apart: f64 = a.iter().zip(b).map(|(a, b)| square(a, b)).sum();
    let moved: f64 = b.iter().zip(rest).map(|(b, r)| square(b, r)).sum();
    apart.sqrt() / moved.sqrt().max(floor)
}

/// What is expected of a case.
pub struct Judge<'a> {
    pub name: &'static str,
    pub tolerance: f64,
    /// Relative error of an end; NaN where only bounds are known.
    pub error: &'a dyn Fn(&End) -> Result<f64>,
    /// Why an error beyond the tolerance is as it is, for the method's family.
    pub reason: &'a dyn Fn(&Method, &End) -> String,
    /// Displacements beyond this are a defect.
    pub bound: f64,
}

/// Beyond half a turn the modal methods' guard acts.
const GUARDED: f64 = std::f64::consts::PI;

pub fn judged(
    library: &Library,
    (group, case): (&'static str, String),
    method: &'static Method,
    problem: &Problem,
    drive: Drive,
    judge: &Judge,
) -> Cell {
    let cell = |verdict, error, note| Cell {
        group,
        case: case.clone(),
        method: method.label,
        verdict,
        error,
        judge: judge.name,
        note,
    };
    let end = match problem.run(library, method, drive) {
        Ok(end) => end,
        Err(e) if e.to_string() == NOT_FINITE || e.to_string().contains("internal") => {
            return cell(Verdict::Broken, f64::NAN, e.to_string());
        }
        Err(e) => return cell(Verdict::Refused, f64::NAN, e.to_string()),
    };
    if end.displacement > judge.bound {
        return cell(Verdict::Broken, f64::NAN, format!("moved by {:.1e}", end.displacement));
    }
    let error = match (judge.error)(&end) {
        Ok(error) => error,
        Err(e) => return cell(Verdict::Inaccurate, f64::NAN, format!("no judge: {e}")),
    };
    if error <= judge.tolerance {
        cell(Verdict::Accurate, error, String::new())
    } else if end.rotation > GUARDED && matches!(method.family, Family::Lma | Family::Warp) {
        let note =
            format!("turned by {:.0}° on the way: beyond half a turn the guard holds it", end.rotation.to_degrees());
        cell(Verdict::Guarded, error, note)
    } else {
        cell(Verdict::Inaccurate, error, (judge.reason)(method, &end))
    }
}
