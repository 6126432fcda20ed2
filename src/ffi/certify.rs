//! What a state gets wrong, and another method for it.

use super::load::{SwWatchFn, ask};
use super::method::{SW_METHOD_AUTO, method_of};
use super::model::vertex_rows;
use super::output::{space_of, write_own, write_places};
use super::state::{SwState, reading, switching, writing};
use super::status::{Fault, SwStatus};
use super::structs::{Described, Output, described};
use crate::clock::Instant;
use crate::state::{Certificate, Method, State};
use std::ffi::c_void;
use std::ptr::null_mut;

/// Of a correction: more would take as long as the full shell's own search.
pub(super) const MOST_STEPS: u32 = 100;

/// For sw_state_correct: on to the full shell's equilibrium, where fields are more than 5 % off it. For what shows corrected positions: those that
/// sw_state_correct kept since the last step.
pub const SW_STEPS_AUTO: u32 = 0xffff_ffff;

/// How far a state is from the full nonlinear shell, by an estimate. The caller sets struct_size with sw_certificate_init.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwCertificate {
    /// Set by sw_certificate_init.
    pub struct_size: u32,
    /// 1 when error is above 0.2: the pose is outside what the method, or the fields of a reduced shell, were made for.
    pub out_of_range: u32,
    /// Estimated error of the displacement relative to it, both as mass-weighted L2 norms; displacements count from the shape of no
    /// energy, also with sag_gravity.
    pub error: f64,
    /// Estimated error of the vertex that has the largest, length.
    pub max_error: f64,
    /// That vertex.
    pub vertex: u32,
    /// The SW_METHOD_... that it is of.
    pub method: u32,
    /// What the full shell's forces leave of the load's at this pose, relative to the load, inertia and constraints' forces included: no
    /// measure of the error, since stretching that nobody sees leaves hundreds of times the load.
    pub residual: f64,
    /// The same at the better pose that the estimate compares with, or the share by which a hard constraint or wind was not followed
    /// there. Above 0.01 the search for it was cut short, and the estimate is rough.
    pub remaining: f64,
    /// Factorizations of the full shell's stiffness that it took.
    pub factorizations: u32,
    /// 0.
    pub reserved: u32,
    /// Bytes of the full shell's matrix, factor and fields, which the model keeps for the next call.
    pub bytes: u64,
    /// As error, of the positions that sw_state_correct kept since the last step: a second estimate, from there. The same as error where nothing is kept, and
    /// from sw_state_fall_back.
    pub corrected_error: f64,
    /// As max_error, of these.
    pub corrected_max_error: f64,
    /// That it took; 0 where there is no clock, as in a WebAssembly module.
    pub seconds: f64,
}

described!(SwCertificate, remaining);

/// Estimates what a state gets wrong against the full nonlinear shell, under the loads, constraints and frame as they are now, by
/// a few Newton steps of the full shell from the present pose. At rest that is the error of the equilibrium; where the full shell
/// has several, as one that buckles, it is the distance to the one that these steps lead to, and another may be far. That one is
/// stable: a column that a method keeps upright counts as far off as it would fall. In motion the inertia and damping that the method has
/// are taken for right: it is what its forces get wrong at this moment, not what has added up. Rigid motions that supports and constraints
/// leave free do not count. What a hard constraint misses of its target counts, also before a step. Wind follows the shell. A state of a
/// nonlinear shell gets zeros.
///
/// Takes as long as one to three steps of SW_METHOD_SHELL_IMPLICIT. Of a pose that is far off it takes longer: up to sixty iterations of a factorization each,
/// of a few where the shell is about to snap; with wind, free motions, missed constraints and balances that prove unstable some times that. The
/// first time it takes the analysis of the stiffness, too, which the model keeps. To be called now and then, not in every step. `certificate` must be initialised by sw_certificate_init. Callable
/// concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_UNSUPPORTED by a library without the feature nonlinear-shell,
/// SW_ERROR_NUMERICAL when the full shell has no stiffness to go by, as where k_bend is 0 and parts turn freely against each other;
/// SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_certify(state: *const SwState, certificate: *mut SwCertificate) -> SwStatus {
    // SAFETY: passed on unchanged, without a callback.
    unsafe { sw_state_certify_watched(state, certificate, None, null_mut()) }
}

/// As sw_state_certify, with a callback that hears of each iteration and may cancel: between two calls there is one factorization, or a
/// few where the shell is about to snap. `watch` may be NULL.
/// Errors: as of sw_state_certify, SW_ERROR_CANCELLED, SW_ERROR_INVALID_ARGUMENT for an answer that is neither.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_certify_watched(
    state: *const SwState,
    certificate: *mut SwCertificate,
    watch: SwWatchFn,
    user: *mut c_void,
) -> SwStatus {
    // SAFETY: `reading` refuses NULL; the host passes a live state, and an initialised certificate, whose size is checked.
    unsafe {
        reading(state, |state| {
            let (out, start) = (Output::checked("certificate", certificate)?, Instant::now());
            // SAFETY: the host gave this callback with this user pointer.
            let found = state.certify_watched(&mut |residual| ask(watch, user, residual))?;
            out.write(certificate_of(&found, state.method(), start));
            Ok(())
        })
    }
}

fn certificate_of(found: &Certificate, method: Method, start: Instant) -> SwCertificate {
    let mut out = SwCertificate::initial();
    out.out_of_range = u32::from(found.out_of_range());
    (out.error, out.max_error, out.vertex) = (found.error, found.max_error, found.vertex as u32);
    (out.method, out.residual, out.remaining) = (method.number(), found.residual, found.remaining);
    (out.factorizations, out.bytes) = (found.factorizations as u32, found.bytes as u64);
    [out.corrected_error, out.corrected_max_error] = found.corrected;
    out.seconds = start.elapsed().as_secs_f64();
    out
}

/// Takes `steps` Newton steps of the full nonlinear shell, and keeps where they lead. They go toward its balance under the loads that are set now and the inertia that the
/// method has. A dial between the method and SW_METHOD_SHELL_IMPLICIT, for output alone: the motion does not know. Call it once a frame, after its
/// steps; sw_state_positions_corrected and bound points with correction_steps show what is kept until the next step. It goes on from where the last call led,
/// moved along with the method's pose, or from that pose where this leaves far less of the force. So one step a frame is enough also where the shell buckles, once it has
/// caught up. A copy of the state has its own, and sw_state_save saves it: 8 bytes for each of 3 numbers a vertex and one an element of the energy.
/// sw_state_reset, a change by sw_state_set_method and whatever puts the shell elsewhere forget it. steps is 0 to 100; 0 forgets it. A nonlinear shell
/// needs none. SW_STEPS_AUTO goes on to the full shell's equilibrium, as sw_state_certify seeks it, where that finds more than 5 % of the displacement wrong. Where it
/// finds no equilibrium it takes the full shell's way from rest. So it does first where more than half is wrong and nothing is kept of an earlier frame. That way is for
/// shells of up to 2,500 vertices that supports or handles hold and that touch nothing. SW_STEPS_AUTO is for states at rest that move by
/// fields: no velocities, and forces that balance the loads to a thousandth, as after sw_state_equilibrium; without SW_STATE_DETERMINISTIC; whose rest shape does not move. Of any other, and where it finds none, it keeps
/// nothing and succeeds. In motion it does nothing: near a fold the inertia of a method that is far off leads astray. Each takes a factorization of the full shell's stiffness, and the first call its analysis, which the model keeps. Allocates.
/// Errors: as sw_state_certify; what was kept before stays.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_correct(state: *mut SwState, steps: u32) -> SwStatus {
    // SAFETY: passed on unchanged, without a callback.
    unsafe { sw_state_correct_watched(state, steps, None, null_mut()) }
}

/// As sw_state_correct, with a callback that hears of each step, and of each iteration of SW_STEPS_AUTO, and may cancel. Then what was kept before stays. `watch` may be NULL.
/// Errors: as of sw_state_correct, SW_ERROR_CANCELLED, SW_ERROR_INVALID_ARGUMENT for an answer that is neither.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_correct_watched(
    state: *mut SwState,
    steps: u32,
    watch: SwWatchFn,
    user: *mut c_void,
) -> SwStatus {
    // SAFETY: `writing` refuses NULL; the host passes a live state that no other thread uses, and gave this callback with this user pointer.
    unsafe {
        writing(state, |state| {
            let watch = &mut |residual| ask(watch, user, residual);
            if steps == SW_STEPS_AUTO {
                return Ok(state.correct_as_needed(watch)?);
            }
            check_steps(steps)?;
            Ok(state.correct_watched(steps as usize, watch)?)
        })
    }
}

/// Steps to show: by SW_STEPS_AUTO any number of what is kept, or none.
pub(super) fn steps_shown(state: &State, steps: u32) -> u32 {
    if steps == SW_STEPS_AUTO { u32::from(state.is_corrected()) } else { steps }
}

fn check_steps(steps: u32) -> Result<(), Fault> {
    if steps > MOST_STEPS {
        return Err(Fault::argument(format!("steps is {steps}: it must be at most {MOST_STEPS}, or SW_STEPS_AUTO")));
    }
    Ok(())
}

/// Positions (n_vertices x 3) where sw_state_correct led since the last step. Without that, they are where `steps` Newton steps of the full nonlinear shell lead from
/// the state's pose, or from what an earlier frame kept. Loads are those that are set now, and the inertia is the method's. For output alone: the motion does not know, and no step costs more.
/// From a reduced shell that is a few percent off, one step leaves about a fifth of the error and two less than
/// a hundredth; from one that is far off, as where the shell buckles, they help less. sw_state_certify tells the error of the method's own pose.
/// steps is 0 to 100; 0 gives sw_state_positions, as does a nonlinear shell. SW_STEPS_AUTO shows what is kept, and takes no step: sw_state_positions where
/// nothing is. Each takes a factorization of the full shell's stiffness, and
/// the first call its analysis, which the model keeps. Vertices that hard constraints hold stay. Allocates. Callable concurrently.
/// Errors: as sw_state_positions, and as sw_state_certify.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_positions_corrected(
    state: *const SwState,
    steps: u32,
    space: u32,
    format: u32,
    out: *mut c_void,
    stride: u64,
    n_vertices: u32,
) -> SwStatus {
    // SAFETY: `reading` refuses NULL; the host passes a live state, and a buffer of n_vertices rows, which is checked.
    unsafe {
        reading(state, |state| {
            let rows = vertex_rows(state.model(), out, format, 3, stride, n_vertices)?;
            let space = space_of(space)?;
            let steps = steps_shown(state, steps);
            check_steps(steps)?;
            state.check_range(space, rows.largest_coordinate())?;
            if steps == 0 {
                write_own(&rows, state, space);
                return Ok(());
            }
            write_places(&rows, &state.positions_corrected(space, steps as usize)?, "corrected")
        })
    }
}

/// Goes on by SW_METHOD_WARP, the paper's method, where that is nearer to the full nonlinear shell. It is so where its estimate by
/// sw_state_certify, or what its hard handles miss of their way, is less than the state's own. It is also where the state misses more than half
/// of a hard handle's way and the warp less. A state without velocities, as after sw_state_equilibrium, found or not, is set against a warp at
/// rest under the same loads. That is sought from its rest shape, or from the state's pose where solids or nothing hold it. A state that moves is
/// set against the warp at the nearest pose, as by sw_state_set_method.
/// `certificate`, initialised by sw_certificate_init, is of the method that goes on, which it names. SW_METHOD_WARP and the nonlinear
/// shells are only certified.
///
/// Takes as long as two of sw_state_certify. The two estimates of a state without velocities may lead to different equilibria, as of a shell
/// that buckles or snaps through. Where a hard handle leads it, both are set against that of the state's own, which depends on the way that
/// it took. In two cases both are set against the equilibrium of the full shell from rest, and the certificate is of it. The first: the state's own
/// estimate finds half of its displacement wrong, and the warp comes to the handle. The second: no hard handle leads it, and the estimates do not
/// decide or one is wanting. Then it takes as long as sw_state_equilibrium of SW_METHOD_SHELL_IMPLICIT besides. Call it when a
/// handle is let go or a pose is found, not in every step. States saved before belong to the method that they were saved with. Allocates;
/// on failure nothing has changed.
/// Errors: as of sw_state_certify, SW_ERROR_NUMERICAL where neither method has an estimate.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_fall_back(state: *mut SwState, certificate: *mut SwCertificate) -> SwStatus {
    // SAFETY: passed on unchanged, without a callback.
    unsafe { sw_state_fall_back_watched(state, certificate, None, null_mut()) }
}

/// As sw_state_fall_back, with a callback that hears of each iteration of all that it seeks, and may cancel: then nothing has changed. `watch` may be NULL.
/// Errors: as of sw_state_fall_back, SW_ERROR_CANCELLED, SW_ERROR_INVALID_ARGUMENT for an answer that is neither.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_fall_back_watched(
    state: *mut SwState,
    certificate: *mut SwCertificate,
    watch: SwWatchFn,
    user: *mut c_void,
) -> SwStatus {
    // SAFETY: `switching` refuses NULL; the host passes a live state, and an initialised certificate, whose size is checked.
    unsafe {
        switching(state, |state| {
            let (out, start) = (Output::checked("certificate", certificate)?, Instant::now());
            // SAFETY: the host gave this callback with this user pointer.
            let found = state.fall_back_watched(&mut |residual| ask(watch, user, residual))?;
            out.write(certificate_of(&found, state.method(), start));
            Ok(())
        })
    }
}

/// Goes on by another SW_METHOD_..., from the pose and velocities nearest to the present ones in the mass norm, with the same time,
/// frame, loads, damping, constraints and integrator: when sw_state_certify or unconverged_steps tell that a reduced shell has left
/// its range, SW_METHOD_WARP_VIRTUAL_WORK or SW_METHOD_WARP goes on, and back again. To SW_METHOD_SHELL_IMPLICIT nothing is lost; to
/// fields or modes, what these do not span, so vertices jump by that much. 0 is the default method of the model. States saved before
/// belong to the method that they were saved with. Allocates; on failure nothing has changed.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_UNSUPPORTED where the method cannot take a constraint or damping ratios that differ from each other,
/// or as by sw_state_create; SW_ERROR_NUMERICAL, SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_set_method(state: *mut SwState, method: u32) -> SwStatus {
    // SAFETY: `switching` refuses NULL; the host passes a live state.
    unsafe {
        switching(state, |state| {
            Ok(match method {
                SW_METHOD_AUTO => state.set_chosen_method(),
                _ => state.set_method(method_of("method", state.model(), method)?),
            }?)
        })
    }
}
