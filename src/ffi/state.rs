//! States: method, damping, frame, amplitudes, steps, saved form.

pub use super::output::*;

use super::guard::{guard, read, write};
use super::method::{SW_METHOD_AUTO, method_of};
use super::model::{SwModel, check_vertex_count};
use super::pointer::{
    VectorRows, byte_slice, check_flags, copy_out, enumerant, not_null, object, put, read_array, read_list,
    read_numbers,
};
use super::status::{Fault, SW_ERROR_INVALID_DATA, SwStatus};
use super::structs::{described, read_descriptor, read_descriptor_or_default};
use crate::arithmetic::Arithmetic;
use crate::error::require_finite;
use crate::state::{Damping, SAVED_HEADER, State};
use crate::step::Integrator;
use crate::support::{FrameMotion, Pose, Rates};
use crate::{Model, Vec3};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use std::ffi::c_void;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, RwLock};

/// Backward Euler: first order, stable for every step, damps what the step does not resolve.
pub const SW_INTEGRATOR_IMPLICIT_EULER: u32 = 1;
/// The closed-form motion of each mode under a force constant over the step: no numerical damping of its own.
pub const SW_INTEGRATOR_EXACT: u32 = 2;
/// Second order: two implicit stages of the full shell. They cost two to three steps of backward Euler and calm nothing that the step resolves. A
/// step among contacts, on a rest shape that moves, or that lets a stretched shell go is one of backward Euler. Modal methods
/// take SW_INTEGRATOR_EXACT for it; reduced shells are of second order always.
pub const SW_INTEGRATOR_SECOND_ORDER: u32 = 3;

/// The state gives the same bits on every processor and platform, on one saved model: its kernels multiply and add in two roundings, and
/// nothing that differs from platform to platform is called. A step by modes takes up to 1.3 times as long, one of a reduced shell two to five
/// times. It holds for what sw_state_step, sw_state_equilibrium and the outputs give by all methods but SW_METHOD_SHELL_..., not for
/// certificates, nor for which method sw_state_fall_back takes by them.
pub const SW_STATE_DETERMINISTIC: u32 = 1;

/// How a state moves.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwStateDesc {
    /// Set by sw_state_desc_init.
    pub struct_size: u32,
    /// SW_METHOD_...; 0 = SW_METHOD_WARP, or SW_METHOD_LMA on a model with SW_PRECOMPUTE_LINEAR.
    pub method: u32,
    /// SW_INTEGRATOR_... of modal methods and SW_METHOD_SHELL_IMPLICIT; 0 = SW_INTEGRATOR_IMPLICIT_EULER.
    pub integrator: u32,
    /// SW_STATE_... or 0.
    pub flags: u32,
}

described!(SwStateDesc, flags);

/// Damping of each mode: c = xi + zeta lambda + 2 ratio sqrt(lambda); of SW_METHOD_SHELL_... xi M + zeta K. The full shell has no modes to
/// damp one by one: ratios that are all alike add the xi that damps its slowest swing by this share, and others are refused. All must be finite and not negative; 0 = none. It may be stronger on some of the shell than on other parts, by factors at the vertices.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwDampingDesc {
    /// Set by sw_damping_desc_init.
    pub struct_size: u32,
    /// 0, 1 (one ratio for all modes) or the number of modes.
    pub n_ratios: u32,
    /// Rayleigh's xi, 1/s.
    pub mass_coefficient: f64,
    /// Rayleigh's zeta, s.
    pub stiffness_coefficient: f64,
    /// Fractions of critical damping (n_ratios).
    pub ratios: *const f64,
    /// What xi and the ratios are multiplied by at each vertex (n_factors), not negative, or NULL: 1 everywhere. The full shell has xi of each vertex, reduced shells what
    /// that is on their fields. Modal methods, and ratios, have of each mode the mean over what moves in it: right where damping is light. Reduced shells that move freely refuse them.
    pub factors: *const c_void,
    /// Bytes from factor to factor; 0 = packed.
    pub factor_stride: u64,
    /// SW_FORMAT_... of factors.
    pub factor_format: u32,
    /// 0, or the number of vertices.
    pub n_factors: u32,
}

described!(SwDampingDesc, ratios);

/// The frame jumps to its new pose and is at rest there: no inertial load.
pub const SW_FRAME_TELEPORT: u32 = 1;
/// The velocities and accelerations of the descriptor are used instead of differences of poses.
pub const SW_FRAME_MOTION_GIVEN: u32 = 2;

/// A pose of the support frame, world = origin + rotation local, and optionally its motion, all in world axes.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwFrameDesc {
    /// Set by sw_frame_desc_init.
    pub struct_size: u32,
    /// SW_FRAME_... or 0. SW_FRAME_TELEPORT wins.
    pub flags: u32,
    /// World position of the frame's origin.
    pub origin: [f64; 3],
    /// Row-major rotation matrix, its columns the frame's axes in world space. All zero = identity. Must be orthonormal to
    /// 1e-4 and right-handed; the nearest rotation is used.
    pub rotation: [f64; 9],
    /// Velocity of the origin, read with SW_FRAME_MOTION_GIVEN only, as the three below.
    pub velocity: [f64; 3],
    /// Acceleration of the origin.
    pub acceleration: [f64; 3],
    /// Angular velocity, rad/s.
    pub angular_velocity: [f64; 3],
    /// Angular acceleration, rad/s^2.
    pub angular_acceleration: [f64; 3],
}

described!(SwFrameDesc, angular_acceleration);

/// A moving shell. Opaque. One thread at a time, but functions that take it const may run at the same time as each other;
/// a violation returns SW_ERROR_BUSY.
pub struct SwState {
    pub(super) state: RwLock<State>,
    /// About how long a step takes, when the state was made or given its method.
    pub(super) step_nanoseconds: AtomicU64,
    /// The last call for many states that moved it.
    pub(super) batch: AtomicU64,
}

impl From<State> for SwState {
    /// A handle for Rust programs that call the interface: benchmarks on models that were not precomputed.
    fn from(state: State) -> Self {
        Self { step_nanoseconds: state.step_nanoseconds().into(), state: RwLock::new(state), batch: AtomicU64::new(0) }
    }
}

fn new_handle(state: State) -> *mut SwState {
    Box::into_raw(Box::new(state.into()))
}

/// Runs `body` with shared use of the state.
pub(super) unsafe fn reading(state: *const SwState, body: impl FnOnce(&State) -> Result<(), Fault>) -> SwStatus {
    guard(|| {
        // SAFETY: NULL is refused; the host passes a live state.
        let handle = unsafe { object("state", state)? };
        body(&*read("state", &handle.state)?)
    })
}

/// Runs `body` with exclusive use of the state.
pub(super) unsafe fn writing(state: *mut SwState, body: impl FnOnce(&mut State) -> Result<(), Fault>) -> SwStatus {
    guard(|| {
        // SAFETY: NULL is refused; the host passes a live state.
        let handle = unsafe { object("state", state.cast_const())? };
        body(&mut *write("state", &handle.state)?)
    })
}

/// As [`writing`], of what may change the method.
pub(super) unsafe fn switching(state: *mut SwState, body: impl FnOnce(&mut State) -> Result<(), Fault>) -> SwStatus {
    guard(|| {
        // SAFETY: NULL is refused; the host passes a live state.
        let handle = unsafe { object("state", state.cast_const())? };
        let mut state = write("state", &handle.state)?;
        let done = body(&mut state);
        handle.step_nanoseconds.store(state.step_nanoseconds(), Ordering::Relaxed);
        done
    })
}

/// Makes a state at rest on a precomputed model; `desc` may be NULL for defaults. No loads, no damping, the frame at the
/// world's origin. The state keeps alive what it needs of the model. Callable concurrently on one model.
/// On success *state is a new object, to be given to sw_state_destroy; on failure it is untouched.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_NOT_PRECOMPUTED, SW_ERROR_UNSUPPORTED for a warp or rotation-strain
/// reconstruction on a model with SW_PRECOMPUTE_LINEAR, for SW_METHOD_REDUCED_SHELL on a model without reduced_fields and for
/// SW_METHOD_AUTO on one without a choice, for SW_METHOD_SHELL_... with SW_STATE_DETERMINISTIC; SW_ERROR_NUMERICAL and SW_ERROR_OUT_OF_MEMORY where a method has to prepare itself,
/// SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_create(
    model: *const SwModel,
    desc: *const SwStateDesc,
    state: *mut *mut SwState,
) -> SwStatus {
    guard(|| {
        not_null("state", state)?;
        // SAFETY: `state` is not NULL, a live model is required and NULL refused, and `desc` is NULL or has its struct_size.
        unsafe {
            let desc = read_descriptor_or_default("desc", desc)?;
            check_flags("desc->flags", desc.flags, SW_STATE_DETERMINISTIC)?;
            let model = object("model", model)?.precomputed()?;
            let integrators = [
                (0, Integrator::ImplicitEuler),
                (SW_INTEGRATOR_IMPLICIT_EULER, Integrator::ImplicitEuler),
                (SW_INTEGRATOR_EXACT, Integrator::Exact),
                (SW_INTEGRATOR_SECOND_ORDER, Integrator::SecondOrder),
            ];
            let integrator = enumerant("desc->integrator", desc.integrator, &integrators)?;
            let arithmetic = if desc.flags == 0 { Arithmetic::Fastest } else { Arithmetic::Portable };
            let model = model.with_arithmetic(arithmetic)?;
            let made = match desc.method {
                SW_METHOD_AUTO => State::of_choice(model, integrator),
                method => State::new(model.clone(), method_of("desc->method", &model, method)?, integrator),
            };
            put(state, new_handle(made?));
        }
        Ok(())
    })
}

/// Destroys a state. NULL does nothing. An object must not be destroyed twice or during a call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_destroy(state: *mut SwState) {
    guard(|| {
        if !state.is_null() {
            // SAFETY: made by this library and not destroyed before.
            drop(unsafe { Box::from_raw(state) });
        }
        Ok(())
    });
}

/// Back to rest and time 0. Loads, damping and constraints stay; the frame stays where it was last set, at rest.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_reset(state: *mut SwState) -> SwStatus {
    // SAFETY: `writing` refuses NULL; the host passes a live state.
    unsafe {
        writing(state, |state| {
            state.reset();
            Ok(())
        })
    }
}

/// Makes an independent copy, loads, damping and constraints included; stepping both alike gives the same bits. *clone is a new object.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_clone(state: *const SwState, clone: *mut *mut SwState) -> SwStatus {
    // SAFETY: `reading` refuses NULL; the host passes a live state, and a place for the output, not at NULL.
    unsafe {
        reading(state, |state| {
            not_null("clone", clone)?;
            put(clone, new_handle(state.try_clone()?));
            Ok(())
        })
    }
}

/// Sets when the state rests: it then skips its steps, which only let time pass, until something changes. With 0, as at first, it
/// rests when a step has left every bit as it was, so that skipping the next changes none either. With a length, a modal
/// state without handles rests as soon as what is left of its swing about the equilibrium of its present loads can move no vertex
/// further than that (to first order); what is left is then dropped, and a state restored by sw_state_load may go on with other bits.
/// Nonlinear shells, reduced or not, never rest.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_set_rest_tolerance(state: *mut SwState, tolerance: f64) -> SwStatus {
    // SAFETY: `writing` refuses NULL; the host passes a live state.
    unsafe { writing(state, |state| Ok(state.set_rest_tolerance(tolerance)?)) }
}

/// Sets gravity: 3 doubles, acceleration (length unit / s^2). It keeps its direction in the world, however the shell and the frame
/// turn. 0 at first.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_set_gravity(state: *mut SwState, gravity: *const f64) -> SwStatus {
    // SAFETY: `writing` refuses NULL; the host passes a live state, and three numbers, not at NULL.
    unsafe { writing(state, |state| Ok(state.set_gravity(read_numbers::<3>("gravity", gravity)?.into())?)) }
}

/// The factors of a descriptor, for so many vertices.
unsafe fn factors_of(desc: &SwDampingDesc, vertices: usize) -> Result<Arc<[f64]>, Fault> {
    if desc.n_factors == 0 {
        return Ok(Arc::default());
    }
    if desc.n_factors as usize != vertices {
        let message = format!("desc->n_factors is {}: give none, or {vertices}", desc.n_factors);
        return Err(Fault::argument(message)); // nothing is read: the host's array is not that long
    }
    let rows = VectorRows::checked(
        "desc->factors",
        desc.factors,
        desc.factor_format,
        1,
        desc.factor_stride,
        desc.n_factors.into(),
    )?;
    // SAFETY: the host passes a factor for each vertex.
    Ok((0..vertices).map(|v| unsafe { rows.read_one(v) }).collect())
}

/// Replaces all damping.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_UNSUPPORTED for ratios of SW_METHOD_SHELL_... and
/// for factors of a reduced shell that moves freely, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_set_damping(state: *mut SwState, desc: *const SwDampingDesc) -> SwStatus {
    // SAFETY: `writing` refuses NULL; the host passes a live state, and a descriptor that has its struct_size.
    unsafe {
        writing(state, |state| {
            let desc = read_descriptor("desc", desc)?;
            let modes = state.model().modal.n_modes();
            if desc.n_ratios > 1 && desc.n_ratios as usize != modes {
                let message = format!("desc->n_ratios is {}: give no ratios, 1 or {modes}", desc.n_ratios);
                return Err(Fault::argument(message)); // nothing is read: the host's array is not that long
            }
            Ok(state.set_damping(&Damping {
                mass_coefficient: desc.mass_coefficient,
                stiffness_coefficient: desc.stiffness_coefficient,
                ratios: read_array("desc->ratios", desc.ratios, desc.n_ratios.into())?,
                factors: factors_of(&desc, state.model().shell.mass.len())?,
            })?)
        })
    }
}

/// Multiplies all stiffness by a factor, from 1e-9 to 1e9, from the next step on: of membrane, bending and creases alike, in every method, without a precompute. 1 at
/// first; sw_state_reset leaves it. Shape and velocities stay. Frequencies go with the factor's root, ratios of critical damping stay, and a step costs as much as
/// before. Meant for slow changes, such as a leaf that wilts: the energy jumps with the factor.
/// A saved state is loaded by a state of the same factor.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_set_stiffness(state: *mut SwState, factor: f64) -> SwStatus {
    // SAFETY: `writing` refuses NULL; the host passes a live state.
    unsafe { writing(state, |state| Ok(state.set_stiffness(factor)?)) }
}

/// Sets the factor of sw_state_set_stiffness by which the slowest mode that swings has this frequency: the square of what it is over the frequency of
/// sw_model_frequencies. *factor is then that factor; `factor` may be NULL.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also where no mode swings or the factor is outside of its range; SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_set_frequency(state: *mut SwState, hertz: f64, factor: *mut f64) -> SwStatus {
    // SAFETY: `writing` refuses NULL; the host passes a live state, and a place for one number or NULL.
    unsafe {
        writing(state, |state| {
            let found = state.set_frequency(hertz)?;
            if !factor.is_null() {
                put(factor, found);
            }
            Ok(())
        })
    }
}

/// Sets the factor of sw_state_set_stiffness by which the shell sags so far: the vertex that moves furthest is then `length` from where it rests without load, in
/// the equilibrium of the present gravity and loads. The state is there then, as after sw_state_equilibrium. By the state's own method, and so as near as that
/// is: take SW_METHOD_SHELL_IMPLICIT for a stiffness that all methods share. Takes three to six equilibria, more where the first are not found.
/// `tolerance` is relative to `length`; 0 = 0.01. *factor is then that factor; `factor` may be NULL. Allocates.
/// Errors, which change nothing: SW_ERROR_INVALID_ARGUMENT, also where nothing moves, no factor is found by which it sags so far, or only one by
/// which an edge stretches to more than twice its length; as sw_state_equilibrium.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_set_sag(
    state: *mut SwState,
    length: f64,
    tolerance: f64,
    factor: *mut f64,
) -> SwStatus {
    // SAFETY: `writing` refuses NULL; the host passes a live state, and a place for one number or NULL.
    unsafe {
        writing(state, |state| {
            let found = state.set_sag(length, if tolerance == 0.0 { 0.01 } else { tolerance })?;
            if !factor.is_null() {
                put(factor, found);
            }
            Ok(())
        })
    }
}

pub(super) fn vector(name: &str, values: &[f64; 3]) -> Result<Vec3, Fault> {
    for (i, x) in values.iter().enumerate() {
        require_finite(format_args!("desc->{name}[{i}]"), *x)?;
    }
    Ok(Vec3::from(*values))
}

pub(super) fn rotation(values: &[f64; 9]) -> Result<UnitQuaternion<f64>, Fault> {
    for (i, x) in values.iter().enumerate() {
        require_finite(format_args!("desc->rotation[{i}]"), *x)?;
    }
    if values.iter().all(|x| *x == 0.0) {
        return Ok(UnitQuaternion::identity());
    }
    let matrix = Matrix3::from_row_slice(values);
    let error = (matrix.transpose() * matrix - Matrix3::identity()).amax();
    if error > 1e-4 || matrix.determinant() < 0.0 {
        let message =
            format!("desc->rotation is no rotation: |R^T R - I| is {error:.1e}, det {:.2e}", matrix.determinant());
        return Err(Fault::argument(message));
    }
    // Newton's iteration for the orthogonal polar factor; quadratic, so three steps from 1e-4 reach rounding.
    let nearest = (0..3).fold(matrix, |r, _| 0.5 * (r * (3.0 * Matrix3::identity() - r.transpose() * r)));
    Ok(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(nearest)))
}

/// Sets where the support frame is at the end of the next step; call it before each step while the frame moves. It stays
/// where it is when not called. The first call after creation or reset, before any step, simply places the frame.
///
/// The shell feels gravity less the frame's acceleration, and the Euler, centrifugal and Coriolis forces of its rotation.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_set_frame(state: *mut SwState, desc: *const SwFrameDesc) -> SwStatus {
    // SAFETY: `writing` refuses NULL; the host passes a live state, and a descriptor that has its struct_size.
    unsafe {
        writing(state, |state| {
            let desc = read_descriptor("desc", desc)?;
            check_flags("desc->flags", desc.flags, SW_FRAME_TELEPORT | SW_FRAME_MOTION_GIVEN)?;
            let pose = Pose { origin: vector("origin", &desc.origin)?, rotation: rotation(&desc.rotation)? };
            let motion = if desc.flags & SW_FRAME_TELEPORT != 0 {
                FrameMotion::Teleport
            } else if desc.flags & SW_FRAME_MOTION_GIVEN != 0 {
                FrameMotion::Given(Rates {
                    velocity: vector("velocity", &desc.velocity)?,
                    acceleration: vector("acceleration", &desc.acceleration)?,
                    angular_velocity: vector("angular_velocity", &desc.angular_velocity)?,
                    angular_acceleration: vector("angular_acceleration", &desc.angular_acceleration)?,
                })
            } else {
                FrameMotion::Continuous
            };
            state.set_frame(pose, motion);
            Ok(())
        })
    }
}

/// Sets modal amplitudes and their rates (count each, count = number of modes); unit: length times sqrt(mass).
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_UNSUPPORTED by a nonlinear shell, reduced or not, SW_ERROR_NUMERICAL when vertices would
/// turn by more than 1e6 rad, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_set_amplitudes(
    state: *mut SwState,
    amplitudes: *const f64,
    velocities: *const f64,
    count: u32,
) -> SwStatus {
    // SAFETY: `writing` refuses NULL; the host passes a live state, and arrays as long as `count`, which is checked.
    unsafe {
        writing(state, |state| {
            check_count(state.model(), count)?;
            let q = read_list("amplitudes", amplitudes, count.into())?;
            let q_dot = read_list("velocities", velocities, count.into())?;
            Ok(state.set_amplitudes(&q, &q_dot)?)
        })
    }
}

/// The host's arrays are only as long as it says: read nothing when the number is wrong.
fn check_count(model: &Model, count: u32) -> Result<(), Fault> {
    match model.modal.n_modes() {
        n if n == count as usize => Ok(()),
        n => Err(Fault::argument(format!("count is {count}, but the model has {n} modes"))),
    }
}

/// Poses the shell: takes the nearest motion that the state's method has.
/// `positions` and `velocities` (n_vertices x 3) are of all vertices, in the order of the mesh, in SW_SPACE_... and as SW_FORMAT_..., `stride`
/// and `velocity_stride` bytes from vertex to vertex (0 = packed). NULL velocities mean at rest in the support frame. The world's are as in
/// sw_state_positions: the frame is where it was at the end of the last step, and velocities contain its own.
/// Nearest is meant in the mass norm. `missed` (or NULL) gets what is left: the root mean square distance of the vertices from `positions`,
/// weighted by mass, in the mesh's unit. Nonlinear shells take every vertex that moves; held and unreferenced vertices stay. Modes and fields
/// seldom have the pose itself. Positions read in SW_FORMAT_F64 and set again come back within 1e-6 of the largest displacement, with
/// SW_PRECISION_F64 within 1e-9. Modal methods search from rest: of a pose turned by more than two radians they may find another, which
/// `missed` shows.
/// Time, frame, loads, damping and constraints stay. Takes as long as hundreds of readings of the
/// positions. Allocates. On failure nothing has changed.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also when n_vertices is not the mesh's, on a number that is not finite, and on a vertex more than 1e6 sizes
/// of the mesh from rest or faster than 1e15 of them a second; SW_ERROR_NUMERICAL when the method cannot tell the pose; SW_ERROR_OUT_OF_MEMORY,
/// SW_ERROR_BUSY.
#[allow(clippy::too_many_arguments)] // each has its own meaning
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_set_pose(
    state: *mut SwState,
    space: u32,
    format: u32,
    positions: *const c_void,
    stride: u64,
    velocities: *const c_void,
    velocity_stride: u64,
    n_vertices: u32,
    missed: *mut f64,
) -> SwStatus {
    // SAFETY: `writing` refuses NULL; the host passes a live state, and rows for n_vertices, which is checked.
    unsafe {
        writing(state, |state| {
            let space = space_of(space)?;
            check_vertex_count(state.model(), n_vertices)?;
            let field = |name: &str, base, stride| -> Result<Vec<Vec3>, Fault> {
                let rows = VectorRows::checked(name, base, format, 3, stride, n_vertices.into())?;
                Ok((0..n_vertices as usize).map(|v| rows.read(v)).collect())
            };
            let x = field("positions", positions, stride)?;
            let given = !velocities.is_null();
            let rate = given.then(|| field("velocities", velocities, velocity_stride)).transpose()?;
            let distance = state.set_pose(space, &x, rate.as_deref())?;
            if !missed.is_null() {
                put(missed, distance);
            }
            Ok(())
        })
    }
}

/// Modal amplitudes q and rates. Two calls: with both pointers NULL and `capacity` 0 only *count is written.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_UNSUPPORTED by a nonlinear shell, reduced or not, SW_ERROR_BUFFER_SIZE when capacity < *count, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_amplitudes(
    state: *const SwState,
    amplitudes: *mut f64,
    velocities: *mut f64,
    capacity: u32,
    count: *mut u32,
) -> SwStatus {
    // SAFETY: `reading` refuses NULL; the host passes a live state, and room for `capacity` elements; the count is not NULL.
    unsafe {
        reading(state, |state| {
            not_null("count", count)?;
            let (q, q_dot) = state.amplitudes()?;
            if amplitudes.is_null() != velocities.is_null() {
                not_null("amplitudes", amplitudes)?;
                not_null("velocities", velocities)?;
            }
            copy_out("amplitudes", q, amplitudes, capacity.into())?;
            let tempo = state.tempo();
            let scaled: Vec<f64> = if tempo == 1.0 { vec![] } else { q_dot.iter().map(|rate| tempo * rate).collect() };
            copy_out("velocities", if tempo == 1.0 { q_dot } else { &scaled }, velocities, capacity.into())?;
            put(count, q.len() as u32);
            Ok(())
        })
    }
}

/// Advances by `seconds` > 0; any step, changing from call to call. Modal methods do not allocate. On failure nothing has
/// moved. Loads that would bend a modal method's shell beyond half a turn meet a growing resistance, which ordinary scenes
/// never feel: whatever the load, the root of the sum of squares of the elastic modes' largest turns stays below three quarters of a
/// turn. So no vertex turns further than that times the root of their number; only handles and sw_state_set_amplitudes may turn it on.
/// Without loads and handles a modal method's energy never grows. A step by SW_METHOD_SHELL_IMPLICIT takes at most 2000 linear solves, with
/// all that handles and colliders need.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_NUMERICAL when the result would leave the range of numbers (turns of 1e6 rad) or the step of
/// a nonlinear shell is not found, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_step(state: *mut SwState, seconds: f64) -> SwStatus {
    // SAFETY: `writing` refuses NULL; the host passes a live state.
    unsafe { writing(state, |state| Ok(state.step(seconds)?)) }
}

/// Saves the dynamic state (time, frame, amplitudes and rates, constraint work): 152 bytes and 16 a mode, or mode and field of a
/// reduced shell, so 952 at 50 modes; 152 and 48 a vertex of a nonlinear shell; with
/// colliders 16 more, 56 a collider and 48 a contact; with a rest shape that moves 40 more and 104 a vertex; and 16 a crease that yields. Loads, damping and constraints are inputs and not saved. Two calls: with `bytes` NULL and `capacity` 0 only *size is written. Callable concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUFFER_SIZE when capacity < *size, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_save(
    state: *const SwState,
    bytes: *mut c_void,
    capacity: u64,
    size: *mut u64,
) -> SwStatus {
    // SAFETY: `reading` refuses NULL; the host passes a live state, and room for `capacity` elements; the count is not NULL.
    unsafe {
        reading(state, |state| {
            not_null("size", size)?;
            let saved = state.save();
            copy_out("bytes", &saved, bytes.cast(), capacity)?;
            put(size, saved.len() as u64);
            Ok(())
        })
    }
}

/// Restores what sw_state_save gave of a state of the same method, on a model made from the same inputs; the run then goes on with
/// the same bits. Safe on any bytes: they carry a version, the method, sizes, the model's fingerprint and a checksum. Bytes of format
/// version 1 did not say their method and are refused. On failure nothing has changed. A pose set
/// for the next step is dropped: set it after loading.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DATA, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_load(state: *mut SwState, bytes: *const c_void, size: u64) -> SwStatus {
    // SAFETY: `writing` refuses NULL; the host passes a live state, and `size` bytes, not at NULL.
    unsafe {
        writing(state, |state| {
            not_null("bytes", bytes)?;
            // No more is read than the first bytes announce.
            state.check_saved_kind(byte_slice("bytes", bytes, size.min(SAVED_HEADER as u64))?)?;
            if !state.takes_saved_size(size) {
                let message =
                    format!("{size} bytes are not a saved state of this model, which has {}", state.saved_size());
                return Err(Fault::new(SW_ERROR_INVALID_DATA, message));
            }
            Ok(state.load(byte_slice("bytes", bytes, size)?)?)
        })
    }
}
