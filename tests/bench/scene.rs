//! Sheets whose modes are given instead of computed, so that a benchmark of 10⁶ vertices starts at once. Shapes are waves over
//! the sheet, normalised as modes are; a kernel's time does not depend on what they look like.
#![allow(dead_code, missing_docs)] // each benchmark uses its own part

use shellwarp::material::ElasticSheet;
use shellwarp::modal::{AnyBasis, ModalBasis};
use shellwarp::model::{Model, Options, Precision};
use shellwarp::modes::SpectrumCertificate;
use shellwarp::reduced;
use shellwarp::state::{Damping, Method, State};
use shellwarp::step::Integrator;
use shellwarp::warp::{Basis, Entry};
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};
use std::sync::Arc;

/// Seconds of a step.
pub const FRAME: f64 = 1.0 / 30.0;

/// Of one that the method can take.
pub fn frame(method: Method) -> f64 {
    if method == Method::ExplicitShell { 1e-6 } else { FRAME }
}

/// A strip of exactly `n` vertices, an even number of at least 4, two to ten across.
fn strip(n: usize) -> Mesh {
    let across = (2..=10).rev().find(|across| n.is_multiple_of(*across)).expect("an even number of vertices");
    let edge = 1.0 / (n / across) as f64;
    let positions = (0..n).map(|v| Vec3::new((v / across) as f64, (v % across) as f64, 0.0) * edge).collect();
    let mut triangles = vec![];
    for row in 0..n / across - 1 {
        for column in 0..across - 1 {
            let a = (row * across + column) as u32;
            let (b, c, d) = (a + 1, a + across as u32, a + across as u32 + 1);
            triangles.extend([[a, c, d], [a, d, b]]);
        }
    }
    Mesh::new(positions, &triangles).expect("a strip is a mesh")
}

/// Φ and Ψ of mode `k` at `x`, per √M.
fn shape(k: usize, x: &Vec3) -> (Vec3, Vec3) {
    let wave = (k + 1) as f64 * 1.7;
    let (sine, cosine) = (wave * x.x).sin_cos();
    (Vec3::new(0.1 * sine, 0.2 * cosine * x.x, 1.0 - cosine), Vec3::new(0.1 * sine, -0.3 * wave * sine, 0.2 * x.x))
}

fn basis<E: Entry>(shell: &Shell, modes: usize, linear: bool) -> Basis<E> {
    let rest = &shell.mesh.positions;
    let make = if linear { Basis::linear } else { Basis::new };
    let mut basis = make(rest, &shell.mass, modes, shell.total_mass).expect("memory for the basis");
    let scale = shell.total_mass.sqrt().recip();
    for k in 0..modes {
        let (phi, psi): (Vec<_>, Vec<_>) =
            rest.iter().map(|x| shape(k, x)).map(|(phi, psi)| (phi * scale, psi * scale)).unzip();
        basis.set_mode(k, &phi, &psi);
    }
    basis
}

/// A model of `n` vertices (even) and `modes` modes.
pub fn model(n: usize, modes: usize, precision: Precision) -> Arc<Model> {
    model_on(n, modes, |shell| match precision {
        Precision::F32 => AnyBasis::F32(basis(shell, modes, false)),
        Precision::F64 => AnyBasis::F64(basis(shell, modes, false)),
        Precision::I16 => AnyBasis::I16(basis(shell, modes, false)),
    })
}

/// One for linear modal analysis alone.
pub fn linear_model(n: usize, modes: usize) -> Arc<Model> {
    model_on(n, modes, |shell| AnyBasis::F32(basis(shell, modes, true)))
}

fn model_on(n: usize, modes: usize, basis: impl FnOnce(&Shell) -> AnyBasis) -> Arc<Model> {
    let shell = Arc::new(Shell::new(strip(n), Material::default(), &Supports::default()).expect("a sound shell"));
    let basis = basis(&shell);
    let turning = if matches!(&basis, AnyBasis::F32(basis) if basis.is_linear()) { 0 } else { modes };
    let largest = |k: usize| 0.4 * (1.7 * (k + 1) as f64).max(1.0) / shell.total_mass.sqrt();
    let modal = ModalBasis {
        shell: shell.clone(),
        eigenvalues: (0..modes).map(|k| (6.0 * (k + 1) as f64).powi(2)).collect(),
        largest_rotation: (0..turning).map(largest).collect(),
        largest_swing: vec![0.0; turning],
        supports: None,
        zero_modes: 0,
        basis,
        participation: Default::default(),
    };
    Arc::new(Model {
        modal: Arc::new(modal),
        certificate: SpectrumCertificate { count: modes, found: modes, ..SpectrumCertificate::default() },
        strain: Default::default(),
        arithmetic: Default::default(),
        other: Default::default(),
        truncation: 0.0,
        reduced: None,
        seconds: Default::default(),
        peak_bytes: 0,
        fingerprint: 0,
        reduced_fingerprint: 0,
        front: None,
        without_reduced: None,
        takes_full_shell: false,
        solvers: Default::default(),
        shell,
    })
}

/// A clamped strip of `n` vertices with 8 modes and so many fields of the reduced shell.
pub fn clamped_model(n: usize, fields: usize) -> Arc<Model> {
    let mesh = strip(n);
    let fixed = (0..n as u32).filter(|&v| mesh.positions[v as usize].x < 2.5 * mesh.positions[1].y).collect();
    let material = Material { k_area: 1e4, k_length: 1e4, k_bend: 0.1, area_density: 1.0 };
    trained_strip(Shell::new(mesh, material, &Supports { fixed, ..Default::default() }).expect("a sound shell"), fields)
}

/// The same of a sheet in engineering units, of the same stiffness against bending.
pub fn clamped_sheet_model(n: usize, fields: usize) -> Arc<Model> {
    let mesh = strip(n);
    let clamped = (0..n as u32).filter(|&v| mesh.positions[v as usize].x < 1.5 * mesh.positions[1].y).collect();
    let sheet = ElasticSheet { young: 1e6, poisson: 0.3, thickness: 0.0187, volume_density: 53.5 };
    trained_strip(Shell::new(mesh, sheet, &Supports { clamped, ..Default::default() }).expect("a sound shell"), fields)
}

fn trained_strip(shell: Shell, fields: usize) -> Arc<Model> {
    let reduced = reduced::Options { fields, ..Default::default() };
    let options = Options { modes: 8, reduced, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).expect("a model"))
}

/// A state that has swung for some frames and goes on swinging.
pub fn moving(model: &Arc<Model>, method: Method) -> State {
    let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).expect("a modal state");
    state.set_gravity(Vec3::new(0.0, 0.2, -0.8)).expect("finite");
    state.set_damping(&Damping { mass_coefficient: 1.0, ..Damping::default() }).expect("finite");
    (0..5).for_each(|_| state.step(frame(method)).expect("a step"));
    state
}
