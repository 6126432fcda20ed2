//! Beams at rest under gravity: the paper's sweeps (its figure 6), the ladder of meshes, and the bundled beams beside an
//! independent implementation's numbers.

use crate::effort::{Effort, Progress};
use crate::error::{observed_order, quartiles, relative_l2};
use crate::library::{Library, Material, Model};
use crate::mesh::{Mesh, P3, dot, sub};
use crate::methods::{Method, PAPER, method, modal_at_rest};
use crate::row::Row;
use crate::scenes::FRAME;
use crate::scenes::beams::{LENGTH, ROWS, flat_mesh, material, vee_mesh};
use anyhow::{Context, Result};
use std::path::Path;

/// A beam and the loads it is put under.
pub struct Sweep {
    pub key: &'static str,
    pub title: &'static str,
    pub text: &'static str,
    shape: fn(usize) -> Mesh,
    membrane: f64,
    direction: P3,
    pub loads: &'static [f64],
    /// The load under which every knob is tried.
    pub knob_load: f64,
}

pub const SWEEPS: &[Sweep] = &[
    Sweep {
        key: "flat_static",
        title: "Flat beam, at rest under gravity",
        text: "A flat strip, 4.04 × 0.8, clamped at one end, hangs still. At g = 0.4 it bends by about 45°.",
        shape: flat_mesh,
        membrane: 1e4,
        direction: [0.0, 0.0, -1.0],
        loads: &[0.05, 0.1, 0.2, 0.4, 0.8],
        knob_load: 0.4,
    },
    Sweep {
        key: "vee_static",
        title: "V-beam, at rest under gravity",
        text: "The strip folded to a V by 20° on either side, of a soft membrane, so that the section keeps its shape and rotation is \
            what matters: the paper's comparison.",
        shape: vee_mesh,
        membrane: 1e2,
        direction: [0.0, 0.0, -1.0],
        loads: &[0.02, 0.05, 0.1, 0.2, 0.3],
        knob_load: 0.2,
    },
    Sweep {
        key: "vee_stiff_static",
        title: "Stiff V-beam, at rest under gravity",
        text: "The same with a hundred times the membrane stiffness: the V flattens where it bends, which no linear stiffness follows.",
        shape: vee_mesh,
        membrane: 1e4,
        direction: [0.0, 0.0, -1.0],
        loads: &[0.5, 1.0, 2.0, 3.0, 5.0],
        knob_load: 3.0,
    },
    Sweep {
        key: "vee_oblique_static",
        title: "Stiff V-beam, pulled aside",
        text: "The stiff V-beam under a load that is not in its plane of symmetry. The paper's force law can be worse than no warp here.",
        shape: vee_mesh,
        membrane: 1e4,
        direction: [0.0, 0.6, -0.8],
        loads: &[0.5, 1.0, 2.0, 3.0, 5.0],
        knob_load: 3.0,
    },
];

/// What a sweep gave.
pub struct Outcome {
    pub rows: Vec<Row>,
    /// Rows across, edge, vertices, relative L2 distance to the finest mesh, and the order between this and the one before.
    pub ladder: Vec<(usize, f64, usize, f64, f64)>,
}

impl Sweep {
    fn gravity(&self, load: f64) -> P3 {
        self.direction.map(|d| d * load)
    }

    fn model(&self, library: &Library, rows: usize, modes: usize, f64_basis: bool) -> Result<(Mesh, Model)> {
        self.reduced_model(library, rows, modes, f64_basis, 0)
    }

    fn reduced_model(
        &self,
        library: &Library,
        rows: usize,
        modes: usize,
        f64_basis: bool,
        fields: u32,
    ) -> Result<(Mesh, Model)> {
        let mesh = (self.shape)(rows);
        let material = material(rows, self.membrane, 1.0);
        let model = library.reduced_model(&mesh, material, &mesh.root(), modes, f64_basis, fields)?;
        Ok((mesh, model))
    }
}

/// The shape at rest under gravity.
pub fn hanging(model: &Model, method: &Method, gravity: P3) -> Result<Vec<P3>> {
    let mut state = model.state(method.method, method.integrator)?;
    state.set_gravity(gravity)?;
    state.equilibrium()?;
    state.positions()
}

/// Microseconds a frame while the beam falls from rest, one step of 1/30 s a frame.
fn frame_times(model: &Model, method: &Method, gravity: P3, n: usize, frames: usize) -> Result<[f64; 3]> {
    let mut state = model.state(method.method, method.integrator)?;
    state.set_gravity(gravity)?;
    let mut host = vec![[0f32; 3]; n];
    let mut seconds = vec![];
    for _ in 0..frames {
        let start = std::time::Instant::now();
        state.step(FRAME)?;
        state.write_f32(&mut host)?;
        seconds.push(start.elapsed().as_secs_f64());
    }
    Ok(quartiles(&seconds).map(|t| t * 1e6))
}

/// Displacements where the meshes are compared: 40 x 8 places of the sheet.
fn sampled(mesh: &Mesh, x: &[P3]) -> Vec<P3> {
    let places = (0..320).map(|k| [LENGTH * ((k / 8) as f64 + 0.5) / 40.0, 0.8 * ((k % 8) as f64 + 0.5) / 8.0 - 0.4]);
    let displacement = |place| -> P3 {
        let sample = mesh.sample(place);
        std::array::from_fn(|c| sample.iter().map(|&(v, w)| w * (x[v][c] - mesh.positions[v][c])).sum())
    };
    places.map(displacement).collect()
}

/// Relative L2 distance of displacements given at the same places.
fn apart(a: &[P3], b: &[P3]) -> f64 {
    relative_l2([(a, b)].into_iter(), &vec![[0.0; 3]; a.len()], &vec![1.0; a.len()])
}

/// One method against the nonlinear shell on the same mesh.
fn row(sweep: &Sweep, method: &'static Method, load: f64, mesh: &Mesh, x: &[P3], l2: f64) -> Row {
    let mut row = Row::new(sweep.key, format!("g={load}"), method, 0);
    row.vertices = mesh.positions.len();
    row.l2 = l2;
    row.area = mesh.area(x) / mesh.area(&mesh.positions) - 1.0;
    row
}

pub fn run(sweep: &Sweep, library: &Library, effort: Effort, progress: &mut Progress) -> Result<Outcome> {
    let mut rows = vec![];
    progress.say(&format!("{}: loads", sweep.title));
    sweep_loads(sweep, library, &mut rows)?;
    let (ladder, finest) = match effort {
        Effort::Full => (&[4, 8, 16, 32][..], 32),
        _ => (&[4, 8, 16][..], 16),
    };
    progress.say(&format!("{}: the finest mesh", sweep.title));
    let shell = method("shell_implicit");
    let gravity = sweep.gravity(sweep.knob_load);
    let (mesh, model) = sweep.model(library, finest, 1, false)?;
    let truth = sampled(&mesh, &hanging(&model, shell, gravity)?);
    drop(model);
    let mut steps: Vec<(usize, f64, usize, f64, f64)> = vec![];
    for &across in ladder.iter().filter(|n| **n < finest) {
        progress.say(&format!("{}: {across} rows of triangles", sweep.title));
        let edge = 1.6 / (across as f64 * 3f64.sqrt());
        let (mesh, model) = sweep.model(library, across, 1, false)?;
        let x = hanging(&model, shell, gravity)?;
        let l2 = apart(&sampled(&mesh, &x), &truth);
        let order = steps.last().map_or(f64::NAN, |last| observed_order([last.3, l2], [last.1, edge]));
        steps.push((across, edge, mesh.positions.len(), l2, order));
        let mut r = row(sweep, shell, sweep.knob_load, &mesh, &x, l2);
        r.scene = format!("{}_knobs", sweep.key);
        r.us = frame_times(&model, shell, gravity, mesh.positions.len(), 20)?;
        rows.push(r);
        let modes: &[usize] = if effort == Effort::Full { &[1, 2, 4, 8, 16, 32, 64] } else { &[2, 8, 32] };
        for (&m, f64_basis) in modes.iter().flat_map(|m| [(m, false), (m, true)]) {
            if f64_basis && (effort != Effort::Full || m < 8) {
                continue;
            }
            let (mesh, shared) = sweep.model(library, across, m, f64_basis)?;
            for method in modal_at_rest().filter(|method| method.fields == 0 || (m == 8 && !f64_basis)) {
                let own =
                    (method.fields > 0).then(|| sweep.reduced_model(library, across, m, f64_basis, method.fields));
                let own = own.transpose()?;
                let model = own.as_ref().map_or(&shared, |own| &own.1);
                let found = hanging(model, method, gravity);
                let mut r = match &found {
                    Ok(x) => row(sweep, method, sweep.knob_load, &mesh, x, apart(&sampled(&mesh, x), &truth)),
                    Err(error) => {
                        let mut r = Row::new(sweep.key, format!("g={}", sweep.knob_load), method, m);
                        r.failure = error.to_string();
                        r
                    }
                };
                (r.scene, r.modes, r.f64_basis) = (format!("{}_knobs", sweep.key), m, f64_basis);
                r.paper = method.key == PAPER && m == 8 && !f64_basis && across == ROWS;
                r.us = frame_times(model, method, gravity, mesh.positions.len(), 60)?;
                rows.push(r);
            }
        }
    }
    Ok(Outcome { rows, ladder: steps })
}

/// 8 modes against the nonlinear shell on the same mesh, over gravity.
fn sweep_loads(sweep: &Sweep, library: &Library, rows: &mut Vec<Row>) -> Result<()> {
    let (mesh, model) = sweep.model(library, ROWS, 8, true)?;
    let weights = mesh.vertex_areas();
    let of = |m: &'static Method| Ok((m, sweep.reduced_model(library, ROWS, 8, true, m.fields)?.1));
    let models = modal_at_rest().map(of).collect::<Result<Vec<_>>>()?;
    for &load in sweep.loads {
        let gravity = sweep.gravity(load);
        let shell = method("shell_implicit");
        let truth = hanging(&model, shell, gravity)?;
        let mut r = row(sweep, shell, load, &mesh, &truth, 0.0);
        r.l2 = f64::NAN; // the reference itself
        rows.push(r);
        for (method, model) in &models {
            let mut r = match hanging(model, method, gravity) {
                Ok(x) => {
                    let l2 = relative_l2([(&x[..], &truth[..])].into_iter(), &mesh.positions, &weights);
                    row(sweep, method, load, &mesh, &x, l2)
                }
                Err(error) => {
                    let mut r = row(sweep, method, load, &mesh, &mesh.positions, f64::NAN);
                    r.failure = error.to_string();
                    r
                }
            };
            (r.modes, r.f64_basis) = (8, true);
            rows.push(r);
        }
    }
    Ok(())
}

/// ‖u‖ of each method on a bundled beam under one gravity, here and in an independent implementation.
pub struct Independent {
    pub beam: String,
    pub gravity: P3,
    pub method: &'static str,
    pub here: f64,
    pub there: f64,
}

/// The bundled beams beside tests/data/reference.
pub fn independent(library: &Library, data: &Path) -> Result<Vec<Independent>> {
    let mut all = vec![];
    for beam in ["flat_beam", "v_beam"] {
        let path = data.join(format!("reference/{beam}.json"));
        let json: serde_json::Value = serde_json::from_reader(std::fs::File::open(path)?)?;
        let mesh = Mesh::read_obj(&data.join(format!("meshes/{beam}.obj")))?;
        let number = |key: &str| json[key].as_f64().context("a number");
        let material = Material {
            area: number("k_area")?,
            length: number("k_length")?,
            bend: number("k_bend")?,
            density: number("area_density")?,
        };
        let list = |value: &serde_json::Value| -> Result<Vec<f64>> {
            value.as_array().context("a list")?.iter().map(|x| x.as_f64().context("a number")).collect()
        };
        let fixed: Vec<u32> = list(&json["fixed_vertices"])?.into_iter().map(|v| v as u32).collect();
        let model = library.model(&mesh, material, &fixed, 8, true)?;
        for case in json["equilibria"].as_array().context("a list")? {
            let gravity = list(&case["gravity"])?;
            let gravity = [gravity[0], gravity[1], gravity[2]];
            for (key, name) in [("lma_implicit", "lma_l2"), (PAPER, "mwts_l2"), ("shell_implicit", "ds_l2")] {
                let Some(there) = case[name].as_f64() else { continue };
                // Where the independent fixed point wound up instead of settling there is nothing to compare.
                if key == PAPER && case["mwts_fixed_point_converged"] != true {
                    continue;
                }
                let Ok(x) = hanging(&model, method(key), gravity) else { continue };
                let square = |v: usize| dot(sub(x[v], mesh.positions[v]), sub(x[v], mesh.positions[v]));
                let here = (0..x.len()).map(square).sum::<f64>().sqrt();
                all.push(Independent { beam: beam.to_owned(), gravity, method: key, here, there });
            }
        }
    }
    Ok(all)
}
