//! What a state shows: positions, normals, rotations and measures.

use super::model::vertex_rows;
use super::pointer::{VectorRows, enumerant, read_list};
use super::state::{SwState, reading};
use super::status::{Fault, SW_ERROR_NUMERICAL, SwStatus};
use super::structs::{Described, Output, described};
use crate::Vec3;
use crate::state::{Space, State};
use std::ffi::c_void;

/// World axes and origin.
pub const SW_SPACE_WORLD: u32 = 0;
/// Axes and origin of the support frame.
pub const SW_SPACE_FRAME: u32 = 1;

/// Measures of a state. The caller sets struct_size with sw_state_report_init.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwStateReport {
    /// Set by sw_state_report_init.
    pub struct_size: u32,
    /// Of rotations alone, and no measure of the error, which sw_state_certify estimates: 1 while max_rotation is at most a quarter
    /// turn, where the warp itself gets a fifth of a strip's displacement wrong, or half a turn with SW_METHOD_ROTATION_STRAIN; always 1
    /// for a nonlinear shell, reduced or not. 1 does not mean that the pose is right: on curved shells modes are most of the error.
    pub turn_in_range: u32,
    /// Seconds stepped since creation or reset.
    pub time: f64,
    /// Of the motion in the frame. Under handles SW_INTEGRATOR_EXACT moves by impulses at the start of each step: a shell that
    /// rests at the ends of steps reports the energy of half an impulse there, which falls with the square of the step.
    pub kinetic_energy: f64,
    /// Of the deformation; of modal methods also that of the resistance to bends beyond half a turn, see sw_state_step.
    pub elastic_energy: f64,
    /// Work done on the shell by constraints since creation or reset.
    pub constraint_work: f64,
    /// Largest rotation of a vertex, rad: |w| of modal methods, which counts turns; at most half a turn of nonlinear shells. A
    /// modal method on a model with SW_PRECOMPUTE_LINEAR computes it from the displacements at each call.
    pub max_rotation: f64,
    /// Largest displacement in the frame.
    pub max_displacement: f64,
    /// Of all vertices, the share turned further than turn_in_range allows. Of rotations alone, too.
    pub fraction_turned_too_far: f64,
    /// Steps of a reduced shell since creation or reset, as this object took them, whose Newton search ended short of its
    /// tolerance: finite, but less accurate than the others; shorter steps help. 0 for other methods.
    pub unconverged_steps: u64,
    /// Contacts with colliders that had a force at the end of the last step or equilibrium.
    pub contact_count: u64,
    /// Of any vertex, how far it was inside a collider and its thickness then; 0 outside. What modes or fields cannot follow stays.
    pub deepest_penetration: f64,
    /// Of the colliders on the shell over the last step, world axes.
    pub contact_impulse: [f64; 3],
    /// How far any support that moved is from where the model's support_fields have it, length: by so much the shell is bent beside it. More
    /// fields make it less. 0 where none moved, and for nonlinear shells.
    pub support_miss: f64,
    /// Largest change of an edge's length from the mesh to the rest shape that sw_state_move_rest sent last, a share; 0 without one.
    pub rest_stretch: f64,
    /// Estimate of what the last step of a reduced, polynomial or full shell got wrong by its length: root mean square displacement by
    /// mass, length. Of reduced shells it is from their own stages, and falls with the cube of the step, with the square where the shell touches.
    /// Of the full shell it is h²/2 times the acceleration, and falls with the square. Errors of steps add up at most, and
    /// damping takes them back. Not of fields or loads, which sw_state_certify tells. 0 before a step and for other methods.
    pub step_error: f64,
}

described!(SwStateReport, support_miss);

pub(super) fn space_of(space: u32) -> Result<Space, Fault> {
    enumerant("space", space, &[(SW_SPACE_WORLD, Space::World), (SW_SPACE_FRAME, Space::Frame)])
}

/// Writes places of vertices that were `moved`, unless the format has no numbers for them.
///
/// # Safety
///
/// The rows are those of a live array of the host's, and as many as places.
pub(super) unsafe fn write_places(rows: &VectorRows, x: &[Vec3], moved: &str) -> Result<(), Fault> {
    let largest = rows.largest_coordinate();
    if let Some(v) = x.iter().position(|x| !x.iter().all(|c| c.abs() <= largest)) {
        let message = format!("vertex {v} is {moved} beyond the numbers of this format");
        return Err(Fault::new(SW_ERROR_NUMERICAL, message));
    }
    // SAFETY: as the caller promises.
    x.iter().enumerate().for_each(|(v, x)| unsafe { rows.write::<3>(v, (*x).into()) });
    Ok(())
}

/// Writes where the state's own motion has the vertices.
///
/// # Safety
///
/// The rows are those of a live array of the host's, and as many as vertices.
pub(super) unsafe fn write_own(rows: &VectorRows, state: &State, space: Space) {
    // SAFETY: as the caller promises.
    unsafe {
        if rows.double() {
            state.position_rows(space, |first, x| rows.write_all(first, x));
        } else {
            state.position_rows_f32(space, |first, x| rows.write_all(first, x));
        }
    }
}

/// Deformed positions (n_vertices x 3) in SW_SPACE_..., as SW_FORMAT_..., `stride` bytes from vertex to vertex (0 = packed).
/// Order and number of vertices are those of the mesh. Callable concurrently.
/// At rest in an unmoved frame they are the mesh's own to the last bit, with sag_gravity those of the hanging shape. SW_FORMAT_F64 adds the displacement to the mesh's
/// positions and places the sum in 64 bits. SW_FORMAT_F32 is the faster: with SW_PRECISION_F32 all of it is done in 32 bits,
/// good to four units in the last place of the largest coordinate among rest positions, frame origin and result.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also when n_vertices is not the mesh's; SW_ERROR_NUMERICAL when a coordinate of any vertex, in
/// the frame or in the space asked for, exceeds 8.5e37 in SW_FORMAT_F32 or the numbers of SW_FORMAT_F64; SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_positions(
    state: *const SwState,
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
            state.check_range(space, rows.largest_coordinate())?;
            write_own(&rows, state, space);
            Ok(())
        })
    }
}

/// The positions of some vertices (n x 3), in the order of the list `vertices` (n; nothing is read or written for 0), otherwise as sw_state_positions and with the same
/// bits: what is seen, a proxy, a render region. Costs as much as the blocks of 16 vertices that these lie in; a list in ascending
/// order visits each block once. Callable concurrently.
/// Errors: as sw_state_positions; SW_ERROR_INVALID_ARGUMENT also on a vertex that does not exist.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_positions_of(
    state: *const SwState,
    space: u32,
    format: u32,
    vertices: *const u32,
    n: u32,
    out: *mut c_void,
    stride: u64,
) -> SwStatus {
    // SAFETY: `reading` refuses NULL; the host passes a live state, and `n` vertices and rows, which are checked for NULL.
    unsafe {
        reading(state, |state| {
            let space = space_of(space)?;
            if n == 0 {
                return Ok(());
            }
            let mut vertices = read_list("vertices", vertices, n.into())?;
            let rows = VectorRows::checked("out", out, format, 3, stride, n.into())?;
            if rows.overlaps(&vertices) {
                vertices = vertices.into_owned().into();
            }
            state.check_range(space, rows.largest_coordinate())?;
            if rows.double() {
                state.positions_of(space, &vertices, |i, x| rows.write_all(i, &[x]))?;
            } else {
                state.positions_of_f32(space, &vertices, |i, x| rows.write_all(i, &[x]))?;
            }
            Ok(())
        })
    }
}

/// Area-weighted unit normals of the deformed shell (n_vertices x 3), as sw_state_positions; zero at unreferenced vertices.
/// They follow the orientation of the mesh's triangles, as re-oriented where these disagree. Allocates.
/// Errors: as sw_state_positions, SW_ERROR_OUT_OF_MEMORY; SW_ERROR_NUMERICAL when a normal cannot be told.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_normals(
    state: *const SwState,
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
            Ok(state.normals(space_of(space)?, |v, n| rows.write::<3>(v, n.into()))?)
        })
    }
}

/// Rotation of each vertex's frame from rest (exp of its modal rotation, or the mean of its triangles'), as unit quaternions w x y z (n_vertices x 4), for
/// hosts that carry tangent frames, hair or instances along. Otherwise as sw_state_positions.
/// Errors: as sw_state_positions, SW_ERROR_UNSUPPORTED for a modal method on a model with SW_PRECOMPUTE_LINEAR.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_rotations(
    state: *const SwState,
    space: u32,
    format: u32,
    out: *mut c_void,
    stride: u64,
    n_vertices: u32,
) -> SwStatus {
    // SAFETY: `reading` refuses NULL; the host passes a live state, and a buffer of n_vertices rows, which is checked.
    unsafe {
        reading(state, |state| {
            let rows = vertex_rows(state.model(), out, format, 4, stride, n_vertices)?;
            Ok(state.rotations(space_of(space)?, |v, r| rows.write(v, [r.w, r.i, r.j, r.k]))?)
        })
    }
}

/// Energies, and how far the shell is bent. `report` must be initialised by sw_state_report_init. Visits every vertex, so
/// costs as much as reading the positions. Callable concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_NUMERICAL when a measure leaves the range of numbers,
/// SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_report(state: *const SwState, report: *mut SwStateReport) -> SwStatus {
    // SAFETY: `reading` refuses NULL; the host passes a live state, and an initialised report, whose size is checked.
    unsafe {
        reading(state, |state| {
            let place = Output::checked("report", report)?;
            let mut out = SwStateReport::initial();
            let measured = state.report().all_finite()?;
            out.turn_in_range = u32::from(state.turn_in_range(&measured));
            out.time = measured.time;
            out.kinetic_energy = measured.kinetic_energy;
            out.elastic_energy = measured.elastic_energy;
            out.constraint_work = measured.constraint_work;
            out.max_rotation = measured.max_rotation;
            out.fraction_turned_too_far = measured.fraction_turned_too_far;
            out.max_displacement = measured.max_displacement;
            out.unconverged_steps = measured.unconverged_steps;
            let touched = state.contact_summary();
            out.contact_count = touched.count as u64;
            out.deepest_penetration = touched.deepest;
            out.contact_impulse = touched.impulse.into();
            out.support_miss = state.supports_missed();
            out.rest_stretch = state.rest_stretch();
            out.step_error = measured.step_error;
            place.write(out);
            Ok(())
        })
    }
}
