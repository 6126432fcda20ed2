//! External loads, and the static solution under them.

use super::floats::as_the_host;
use super::pointer::{VectorRows, check_flags, read_list};
use super::precompute::answered;
use super::state::{SwState, vector, writing};
use super::status::{Fault, SwStatus};
use super::structs::{Described, Output, described, read_descriptor};
use crate::State;
use crate::clock::Instant;
use crate::load::Wind;
use std::ffi::c_void;
use std::ptr::null_mut;

/// The forces act in the next step, or the next sw_state_equilibrium, and are then forgotten.
pub const SW_FORCES_ONE_STEP: u32 = 1;

/// Forces on vertices, world axes. Copied during the call.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwForceDesc {
    /// Set by sw_force_desc_init.
    pub struct_size: u32,
    /// SW_FORCES_... or 0: the forces stay until replaced.
    pub flags: u32,
    /// SW_FORMAT_... of forces. Required unless count is 0.
    pub format: u32,
    /// Number of forces: 0 removes all; with vertices NULL it must be the number of vertices.
    pub count: u32,
    /// Forces (count x 3).
    pub forces: *const c_void,
    /// Bytes from one force to the next, 0 = packed.
    pub stride: u64,
    /// The vertex of each force (count), or NULL: one for every vertex in order. A vertex may come more than once.
    pub vertices: *const u32,
}

described!(SwForceDesc, vertices);

/// Air that drags at the shell's triangles as they are turned and move: on each of area A, with the air's velocity relative to
/// it split into the part n along its normal and the rest t, 1/2 density A (normal_drag |n| n + tangential_drag |t| t).
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwWindDesc {
    /// Set by sw_wind_desc_init.
    pub struct_size: u32,
    /// SW_FORMAT_... of local_velocities, when given.
    pub local_format: u32,
    /// Of the air everywhere, world axes.
    pub velocity: [f64; 3],
    /// Mass per volume, not negative; 0 = no wind. Air: 1.2 kg/m^3.
    pub density: f64,
    /// Drag coefficient against the face, not negative; about 1 to 2.
    pub normal_drag: f64,
    /// Drag coefficient along the face, not negative; about 0.01 to 0.1.
    pub tangential_drag: f64,
    /// Velocity of the air at each vertex beside the one everywhere (n_vertices x 3, world axes), or NULL. Copied.
    pub local_velocities: *const c_void,
    /// Bytes from one to the next, 0 = packed.
    pub local_stride: u64,
}

described!(SwWindDesc, local_stride);

unsafe fn set_forces(state: &mut State, desc: &SwForceDesc) -> Result<(), Fault> {
    check_flags("desc->flags", desc.flags, SW_FORCES_ONE_STEP)?;
    let (count, once) = (desc.count as usize, desc.flags & SW_FORCES_ONE_STEP != 0);
    if count == 0 {
        return Ok(state.set_forces([], once)?);
    }
    let rows = VectorRows::checked("desc->forces", desc.forces, desc.format, 3, desc.stride, desc.count.into())?;
    // SAFETY: the host's buffer holds count rows.
    let force = |i: usize| unsafe { rows.read(i) };
    if !desc.vertices.is_null() {
        // SAFETY: the host's list holds count vertices.
        let vertices = unsafe { read_list("desc->vertices", desc.vertices, desc.count.into())? };
        return Ok(state.set_forces(vertices.iter().enumerate().map(|(i, v)| (*v, force(i))), once)?);
    }
    match state.model().shell.mass.len() {
        n if n == count => Ok(state.set_forces((0..desc.count).map(|v| (v, force(v as usize))), once)?),
        n => Err(Fault::argument(format!("desc->count is {count}, but the mesh has {n} vertices"))),
    }
}

/// Replaces all forces on vertices. They keep their directions in the world, as gravity does.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_set_forces(state: *mut SwState, desc: *const SwForceDesc) -> SwStatus {
    // SAFETY: `writing` refuses a NULL state, `read_descriptor` a NULL or uninitialised descriptor; the host passes live ones.
    unsafe { writing(state, |state| set_forces(state, &read_descriptor("desc", desc)?)) }
}

/// Replaces the wind. It presses in a step as at its start, on SW_METHOD_SHELL_IMPLICIT as at its end, to first order.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_UNSUPPORTED by a library without SW_FEATURE_WIND,
/// SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_set_wind(state: *mut SwState, desc: *const SwWindDesc) -> SwStatus {
    // SAFETY: `writing` refuses a NULL state, `read_descriptor` a NULL or uninitialised descriptor; the host passes live ones.
    unsafe {
        writing(state, |state| {
            let desc = read_descriptor("desc", desc)?;
            let n = state.model().shell.mass.len();
            let mut local = vec![];
            if !desc.local_velocities.is_null() {
                let (format, stride) = (desc.local_format, desc.local_stride);
                let base = desc.local_velocities;
                let rows = VectorRows::checked("desc->local_velocities", base, format, 3, stride, n as u64)?;
                local = (0..n).map(|v| rows.read(v)).collect(); // the host's buffer holds a row per vertex
            }
            Ok(state.set_wind(Wind {
                velocity: vector("velocity", &desc.velocity)?,
                density: desc.density,
                normal_drag: desc.normal_drag,
                tangential_drag: desc.tangential_drag,
                local,
            })?)
        })
    }
}

/// How a static solution was found. The caller sets struct_size with sw_equilibrium_report_init.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwEquilibriumReport {
    /// Set by sw_equilibrium_report_init.
    pub struct_size: u32,
    /// Fixed-point or Newton iterations.
    pub iterations: u32,
    /// |q - f(q)/lambda| / |q| of a modal method, |F - dE/dx| / |F| of a nonlinear shell, of the reduced one in its fields. Of nonlinear
    /// shells without load it is relative to the start's, or to the shell's own stiffness. Under a small load it may be as large as the load: rounding
    /// of the coordinates, where that moves the shell by less than a thousandth of its displacement.
    pub residual: f64,
    /// That it took; 0 where there is no clock, as in a WebAssembly module.
    pub seconds: f64,
}

described!(SwEquilibriumReport, residual);

/// Moves the state to the static solution of its method under the present loads and constraints, at rest in the frame as
/// it moves: at the pose set last, with the rates that sw_state_set_frame gives, none after a teleport, else the velocity and the spin of
/// the last step, steady in the frame's own axes. So the shell feels the centrifugal force of a frame that turns, and the frame moves on
/// without a jolt; time does not pass. The search starts from the present shape. Where that is of modes or fields, after
/// sw_state_set_method, a nonlinear shell seeks the equilibrium beside it, and where there is none takes the way from rest. `report` may be
/// NULL. Blocks; on failure nothing has moved, as where the spin is faster than the shell can bear.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_NUMERICAL when none is found, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_equilibrium(state: *mut SwState, report: *mut SwEquilibriumReport) -> SwStatus {
    // SAFETY: passed on unchanged, without a callback.
    unsafe { sw_state_equilibrium_watched(state, report, None, null_mut()) }
}

/// Hears of a search after each iteration what it leaves of the force, relative, on the thread that called it. Where the search goes on from another
/// start, or another one follows, it rises again. Must return SW_PROGRESS_CONTINUE or SW_PROGRESS_CANCEL, as SwProgressFn, and must not destroy
/// the state. Calls for the state from there may get SW_ERROR_BUSY.
pub type SwWatchFn = Option<unsafe extern "C" fn(user: *mut c_void, residual: f64) -> u32>;

/// As sw_state_equilibrium, with a callback that hears how the search goes and may cancel: then nothing has moved. It hears of each iteration of
/// nonlinear shells and of modal methods, and of each share of the load of reduced ones: dozens of their iterations. `watch` may be NULL.
/// Errors: as of sw_state_equilibrium, SW_ERROR_CANCELLED, SW_ERROR_INVALID_ARGUMENT for an answer that is neither.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_equilibrium_watched(
    state: *mut SwState,
    report: *mut SwEquilibriumReport,
    watch: SwWatchFn,
    user: *mut c_void,
) -> SwStatus {
    // SAFETY: `writing` refuses a NULL state; the report is NULL or initialised, and its size is checked; the host gave this callback with this user pointer.
    unsafe {
        writing(state, |state| {
            let out = if report.is_null() { None } else { Some(Output::checked("report", report)?) };
            let start = Instant::now();
            let (residual, iterations) = state.equilibrium_watched(&mut |residual| ask(watch, user, residual))?;
            if let Some(out) = out {
                let (iterations, seconds) = (iterations as u32, start.elapsed().as_secs_f64());
                out.write(SwEquilibriumReport { residual, iterations, seconds, ..Described::initial() });
            }
            Ok(())
        })
    }
}

/// Asks a callback whether to go on.
///
/// # Safety
///
/// The host gave it with this user pointer.
pub(super) unsafe fn ask(watch: SwWatchFn, user: *mut c_void, residual: f64) -> crate::Result<()> {
    let Some(watch) = watch else { return Ok(()) };
    // SAFETY: as above.
    answered(as_the_host(|| unsafe { watch(user, residual) }))
}
