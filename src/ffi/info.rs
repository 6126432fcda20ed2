//! What a model has: counts, certificate, frequencies, mode shapes, and what a choice went by.

use super::guard::{guard, read};
use super::model::{ModelContent, SwModel, vertex_rows};
use super::pointer::{copy_out, enumerant, not_null, object, put};
use super::precompute::{SW_PHASE_CAPACITY, SW_PHASE_COUNT, SW_PRECISION_F32, SW_PRECISION_F64, SW_PRECISION_I16};
use super::status::{Fault, SW_ERROR_NUMERICAL, SW_ERROR_UNSUPPORTED, SwStatus};
use super::structs::{Described, Output, Outputs, described, grows};
use crate::State;
use crate::model::front::Candidate;
use crate::model::weight::{EARTH, OwnWeight};
use crate::model::{Model, Precision};
use crate::modes::PHASES;
use std::ffi::c_void;
use std::sync::Arc;

/// Facts about a model. The caller sets struct_size with sw_model_info_init.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwModelInfo {
    /// Set by sw_model_info_init.
    pub struct_size: u32,
    /// Vertices of the mesh.
    pub n_vertices: u32,
    /// Triangles of the mesh.
    pub n_triangles: u32,
    /// Edges.
    pub n_edges: u32,
    /// Edges with two triangles.
    pub n_interior_edges: u32,
    /// Connected components.
    pub n_components: u32,
    /// Vertices that no triangle uses.
    pub n_unreferenced: u32,
    /// Triangles turned over internally.
    pub n_reoriented: u32,
    /// Vertices held by supports, clamped neighbours included.
    pub n_fixed: u32,
    /// Three per vertex that moves, less the axes that it is held along.
    pub n_unknowns: u32,
    /// 1 after sw_model_precompute, else 0; all fields below but mass, area, size, metres_per_unit and earth_gravity are 0 before.
    pub precomputed: u32,
    /// Number of modes.
    pub modes: u32,
    /// How many of them have eigenvalue 0: rigid motions and mechanisms that nothing resists.
    pub zero_modes: u32,
    /// Eigenvalues below inertia_shift by the inertia of an LBL^T factorization.
    pub inertia_count: u32,
    /// Modes found below inertia_shift. Equal to inertia_count: none is missing. Larger than modes when these end inside a
    /// group of repeated eigenvalues: 6000 for 16 modes of 1000 loose pieces.
    pub inertia_found: u32,
    /// SW_PRECISION_....
    pub precision: u32,
    /// Sum of the lumped masses.
    pub total_mass: f64,
    /// Sum of the rest areas.
    pub total_area: f64,
    /// Diagonal of the bounding box.
    pub size: f64,
    /// max |K phi - lambda M phi| / (|K| |phi|) over the modes, 2-norms and the 1-norm of K.
    pub residual: f64,
    /// max |Phi^T M Phi - I|.
    pub orthonormality: f64,
    /// Where eigenvalues were counted, 1/s^2.
    pub inertia_shift: f64,
    /// Seconds by SW_PHASE_...; 0 beyond the last. Their sum is the time of the precompute, with phases that a host does not know. 0 of a
    /// model that was loaded.
    pub seconds: [f64; SW_PHASE_CAPACITY],
    /// Bytes that the model holds for the run.
    pub bytes_model: u64,
    /// Bytes of one state of a modal method.
    pub bytes_state: u64,
    /// Estimate of the most bytes held at once during precompute. With a reduced shell it is by what trainings on two threads took, and right within a half.
    pub bytes_precompute_peak: u64,
    /// Largest rounding error e of a component of a mode shape phi or its rotation psi in the run-time basis, relative to the
    /// largest such component of its mode. With amplitudes q it moves no vertex by more than sqrt(3) e times the sum over the
    /// modes of |q_k| (max|phi_k| + max|psi_k| max|u|), u the displacement without the warp.
    pub basis_rounding: f64,
    /// How far a vertex may be off because modes were truncated, by the tolerance and the demand of SwPrecomputeDesc; 0 without one, and on a
    /// model that was loaded.
    pub truncation_bound: f64,
    /// Share of the mass that moves which the modes carry along x, y, z of the frame: far below 1, modes are missing for loads along
    /// that axis.
    pub effective_mass: [f64; 3],
    /// Fields of SW_METHOD_REDUCED_SHELL beyond the modes; fewer than asked for where these span no more. 0 = it has none.
    pub reduced_fields: u32,
    /// Number of sampled elements.
    pub reduced_elements: u32,
    /// What these leave of the elastic forces and the rest stiffness that they were chosen by, relative.
    pub reduced_residual: f64,
    /// Largest share by which an eigenvalue by the factorized stiffness and by the energy of its mode differ: the digits that rounding
    /// has left of it in stiff cases, where residual, a share of the largest stiffness, says nothing. Above 1e-2 the precompute refuses.
    /// 0 on a model that was loaded.
    pub eigenvalue_disagreement: f64,
    /// What SW_METHOD_AUTO means here, an SW_METHOD_.... sw_model_front tells what it went by, if it was tried.
    pub auto_method: u32,
    /// Fields that follow moving supports; fewer than asked for where supports are few.
    pub support_fields: u32,
    /// Its largest error in the choice, length; DBL_MAX where it found no equilibrium under one of the loads.
    pub auto_error: f64,
    /// metres_per_unit of the material; 0 = not told, as it is not on a model that was loaded.
    pub metres_per_unit: f64,
    /// The Earth's gravity in the mesh's unit, 9.80665 / metres_per_unit: what a host sets by sw_state_set_gravity, downward, where its scene has none. 0 where
    /// the unit was not told.
    pub earth_gravity: f64,
    /// How far this moves a vertex at most along x, y or z to first order, as far as the modes tell, in sizes of the mesh; 0 where the unit was not told.
    pub weight_moves: f64,
    /// How far it turns one, rad; 0 with SW_PRECOMPUTE_LINEAR, too.
    pub weight_turns: f64,
    /// What that form of the reduced shell which the training chose misses of the equilibria that its fields were trained on, relative, by mass: half of them by less. 0 where
    /// none was chosen by them: by auto_error or auto_operations, without fields, without a training.
    pub training_error_median: f64,
    /// Nine tenths of them by less. What moves the shell by less than a thousandth of the furthest does not count.
    pub training_error_most: f64,
    /// 1 where training_error_median is above 0.05: the fields do not hold the shell as far as that moves it. SW_METHOD_SHELL_IMPLICIT is for its motion, which SW_METHOD_AUTO is with
    /// SW_PRECOMPUTE_AUTO_FULL; sw_state_correct by SW_STEPS_AUTO is for its equilibria by fields.
    pub auto_corrects: u32,
    /// 0.
    pub reserved: u32,
}

described!(SwModelInfo, auto_error);

fn info_of(content: &ModelContent) -> SwModelInfo {
    let shell = &content.shell;
    let mut info = SwModelInfo::initial();
    info.n_vertices = shell.mesh.positions.len() as u32;
    info.n_triangles = shell.mesh.triangles.len() as u32;
    info.n_edges = shell.mesh.edges.len() as u32;
    info.n_interior_edges = shell.mesh.n_interior_edges() as u32;
    info.n_components = shell.mesh.n_components as u32;
    info.n_unreferenced = shell.mesh.n_unreferenced as u32;
    info.n_reoriented = shell.mesh.n_reoriented as u32;
    info.n_fixed = shell.held.iter().filter(|held| **held).count() as u32;
    info.n_unknowns = shell.n_freedoms() as u32;
    (info.total_mass, info.total_area, info.size) = (shell.total_mass, shell.total_area, shell.mesh.size);
    if let Some(metres) = content.unit {
        (info.metres_per_unit, info.earth_gravity) = (metres, EARTH / metres);
    }
    if let Some(OwnWeight { moves, turns, .. }) = content.weight {
        (info.weight_moves, info.weight_turns) = (moves, turns);
    }
    if let Some(model) = &content.model {
        fill_precomputed(&mut info, model);
    }
    info
}

fn fill_precomputed(info: &mut SwModelInfo, model: &Arc<Model>) {
    const { assert!(SW_PHASE_COUNT == PHASES && PHASES <= SW_PHASE_CAPACITY) };
    let certificate = &model.certificate;
    info.precomputed = 1;
    info.modes = model.modal.n_modes() as u32;
    info.support_fields = (model.modal.n_amplitudes() - model.modal.n_modes()) as u32;
    info.zero_modes = model.modal.zero_modes as u32;
    info.inertia_count = certificate.count as u32;
    info.inertia_found = certificate.found as u32;
    info.precision = match model.modal.precision() {
        Precision::F32 => SW_PRECISION_F32,
        Precision::F64 => SW_PRECISION_F64,
        Precision::I16 => SW_PRECISION_I16,
    };
    info.eigenvalue_disagreement = model.certificate.disagreement;
    info.residual = certificate.residual;
    info.orthonormality = certificate.orthonormality;
    info.inertia_shift = certificate.shift;
    info.seconds[..PHASES].copy_from_slice(&model.seconds);
    info.effective_mass = model.modal.effective_mass().into(); // makes what the bytes then count
    info.bytes_model = model.bytes() as u64;
    info.bytes_state = State::bytes_for(model.modal.n_modes()) as u64;
    info.bytes_precompute_peak = model.peak_bytes as u64;
    info.basis_rounding = model.modal.precision().rounding();
    info.truncation_bound = model.truncation;
    info.auto_method = model.chosen_method().number();
    info.auto_error = model.front.as_ref().map_or(0.0, |front| front.choice().error.min(f64::MAX));
    if let Some(errors) = model.training_errors() {
        (info.training_error_median, info.training_error_most) = (errors.median, errors.most);
    }
    info.auto_corrects = u32::from(model.needs_correction());
    if let Some(reduced) = &model.reduced {
        info.reduced_fields = reduced.n_trained() as u32;
        info.reduced_elements = reduced.samples.len() as u32;
        info.reduced_residual = reduced.fit;
    }
}

/// Counts, sizes, certificate and timings. `info` must be initialised by sw_model_info_init. Callable concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_BUSY during a precompute.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_model_info(model: *const SwModel, info: *mut SwModelInfo) -> SwStatus {
    guard(|| {
        // SAFETY: `object` refuses NULL; the host passes a live model, and an initialised info, whose size is checked.
        unsafe {
            let handle = object("model", model)?;
            let out = Output::checked("info", info)?;
            let content = read("model", &handle.0)?;
            out.write(info_of(&content));
        }
        Ok(())
    })
}

/// A method that was tried for SW_METHOD_AUTO. Output only.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwFrontPoint {
    /// SW_METHOD_....
    pub method: u32,
    /// 1 for the one that was taken.
    pub chosen: u32,
    /// 1 for modes of the shape that hangs under demand_gravity.
    pub sagged: u32,
    /// Fields beyond the modes, of a reduced shell.
    pub fields: u32,
    /// Its elements.
    pub elements: u32,
    /// 1 where it found no equilibrium under one of the loads; error is then DBL_MAX.
    pub failed: u32,
    /// Of a step, as sw_state_plan counts them.
    pub operations: f64,
    /// The furthest that any vertex is off under any of the loads, length.
    pub error: f64,
}

grows!(SwFrontPoint, error);

impl SwFrontPoint {
    fn of(candidate: &Candidate, chosen: bool) -> Self {
        let Candidate { method, sagged, fields, elements, operations, error } = *candidate;
        let (fields, elements) = (fields as u32, elements as u32);
        let (method, chosen, sagged) = (method.number(), chosen.into(), sagged.into());
        let (failed, error) = (u32::from(!error.is_finite()), error.min(f64::MAX));
        Self { method, chosen, sagged, fields, elements, failed, operations, error }
    }
}

/// The methods that were tried for SW_METHOD_AUTO, none on a model without a choice. `element_size` is sizeof(SwFrontPoint). Two calls: with `points` NULL and `capacity` 0
/// only *count is written. Callable concurrently.
/// Errors: SW_ERROR_INVALID_DESC, SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUFFER_SIZE when capacity < *count, SW_ERROR_NOT_PRECOMPUTED, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_model_front(
    model: *const SwModel,
    points: *mut SwFrontPoint,
    element_size: u32,
    capacity: u32,
    count: *mut u32,
) -> SwStatus {
    guard(|| {
        not_null("count", count)?;
        // SAFETY: `object` refuses NULL; the host passes a live model, and room for `capacity` elements; `count` is not NULL.
        unsafe {
            let out = Outputs::checked("points", points, element_size)?;
            let model = object("model", model)?.precomputed()?;
            let point = |front: &crate::model::front::Front| -> Vec<SwFrontPoint> {
                let numbered = front.candidates.iter().enumerate();
                numbered.map(|(k, candidate)| SwFrontPoint::of(candidate, k == front.chosen)).collect()
            };
            let found = model.front.as_ref().map_or_else(Vec::new, point);
            out.copy_out("points", &found, capacity)?;
            put(count, found.len() as u32);
        }
        Ok(())
    })
}

/// Frequencies sqrt(lambda)/(2 pi) in Hz, ascending; a zero mode's is exactly 0. Two calls: with `hertz` NULL and `capacity` 0
/// only *count is written. Callable concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUFFER_SIZE when capacity < *count, SW_ERROR_NOT_PRECOMPUTED, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_model_frequencies(
    model: *const SwModel,
    hertz: *mut f64,
    capacity: u32,
    count: *mut u32,
) -> SwStatus {
    guard(|| {
        not_null("count", count)?;
        // SAFETY: `object` refuses NULL; the host passes a live model, and room for `capacity` numbers; `count` is not NULL.
        unsafe {
            let model = object("model", model)?.precomputed()?;
            let values: Vec<f64> = model.modal.frequencies().collect();
            copy_out("hertz", &values, hertz, capacity.into())?;
            put(count, values.len() as u32);
        }
        Ok(())
    })
}

/// Phi: displacement per unit amplitude, mass-orthonormal, 1/sqrt(mass).
pub const SW_SHAPE_DISPLACEMENT: u32 = 1;
/// Psi = W Phi: rotation vector per unit amplitude (paper eq. 10).
pub const SW_SHAPE_ROTATION: u32 = 2;

/// One mode (n_vertices x 3) as SW_SHAPE_..., in SW_FORMAT_..., `stride` bytes from vertex to vertex (0 = packed). The sign and
/// the basis of repeated modes follow a fixed rule: modes agree with the translations along x, y, z, then the rotations about
/// them, then a fixed random field, the first that they see. Callable concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also when n_vertices is not the mesh's; SW_ERROR_NOT_PRECOMPUTED; SW_ERROR_UNSUPPORTED for
/// rotations of a model with SW_PRECOMPUTE_LINEAR; SW_ERROR_NUMERICAL when SW_FORMAT_F32 does not hold them; SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_model_mode_shape(
    model: *const SwModel,
    mode: u32,
    shape: u32,
    format: u32,
    out: *mut c_void,
    stride: u64,
    n_vertices: u32,
) -> SwStatus {
    guard(|| {
        // SAFETY: `object` refuses NULL; the host passes a live model.
        let model = unsafe { object("model", model)? }.precomputed()?;
        if mode as usize >= model.modal.n_modes() {
            return Err(Fault::argument(format!("mode is {mode}, but the model has {} modes", model.modal.n_modes())));
        }
        let rotation = enumerant("shape", shape, &[(SW_SHAPE_DISPLACEMENT, false), (SW_SHAPE_ROTATION, true)])?;
        if rotation && model.modal.is_linear() {
            let message = "the model was precomputed with SW_PRECOMPUTE_LINEAR: it has no modal rotations";
            return Err(Fault::new(SW_ERROR_UNSUPPORTED, message));
        }
        let rows = vertex_rows(&model, out, format, 3, stride, n_vertices)?;
        let shape = |v: usize| {
            let (phi, psi) = model.modal.mode_at(mode as usize, v);
            if rotation { psi } else { phi }
        };
        let vertices = 0..n_vertices as usize;
        if let Some(v) = vertices.clone().find(|v| shape(*v).amax() > rows.largest()) {
            let message = format!("mode {mode} has {:e} at vertex {v}, which 32 bits do not hold", shape(v).amax());
            return Err(Fault::new(SW_ERROR_NUMERICAL, message));
        }
        // SAFETY: the host's buffer has n_vertices rows.
        vertices.for_each(|v| unsafe { rows.write::<3>(v, shape(v).into()) });
        Ok(())
    })
}
