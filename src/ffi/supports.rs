//! Supports that move against each other, and a rest shape that moves.

use super::model::check_vertex_count;
use super::pointer::{VectorRows, check_flags};
use super::state::{SwState, writing};
use super::status::SwStatus;
use std::ffi::c_void;

/// The supports are there without having moved: nothing feels inertia of it.
pub const SW_SUPPORTS_TELEPORT: u32 = 1;

/// Sets where supported vertices are at the end of the next step, each on a path of its own; call it before each step while they move. They stay
/// where they are when not called. `positions` (n_vertices x 3, world space) has a row for every vertex in the order of the mesh, as
/// SW_FORMAT_..., `stride` bytes from vertex to vertex (0 = packed); only rows of supports (fixed and clamped vertices, with the neighbours that
/// these need) are read. The first call after creation or reset, before any step, simply places them. `flags`: SW_SUPPORTS_TELEPORT or 0.
///
/// The support frame is set to the rigid motion nearest to them, as by sw_state_set_frame, with its inertia: rows may move and turn as one,
/// however far, by every method. What is left of their motion bends the shell: SW_METHOD_WARP, SW_METHOD_WARP_VIRTUAL_WORK and SW_METHOD_LMA
/// follow it by the model's support_fields (SwPrecomputeDesc), with the inertia of that; nonlinear shells, not reduced, follow exactly. Other methods
/// return SW_ERROR_UNSUPPORTED when it is more than 1e-5 of the model's size. Supports are shown where they are; SwStateReport's
/// support_miss is how far the fields are from that.
///
/// A later sw_state_set_frame moves the supports along, in the frame as they are. Modes do not know that a sheet which is pushed
/// together buckles: sw_state_certify shows it.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also when n_vertices is not the mesh's or the shell has no supports; SW_ERROR_UNSUPPORTED, see above;
/// SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY. A support must be finite, and within 1e6 sizes of the mesh of the rigid motion. On failure nothing has
/// changed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_move_supports(
    state: *mut SwState,
    format: u32,
    positions: *const c_void,
    stride: u64,
    n_vertices: u32,
    flags: u32,
) -> SwStatus {
    // SAFETY: `writing` refuses NULL; the host passes a live state, and rows for n_vertices, which is checked.
    unsafe {
        writing(state, |state| {
            check_flags("flags", flags, SW_SUPPORTS_TELEPORT)?;
            check_vertex_count(state.model(), n_vertices)?;
            let rows = VectorRows::checked("positions", positions, format, 3, stride, n_vertices.into())?;
            Ok(state.move_supports(|v| rows.read(v), flags & SW_SUPPORTS_TELEPORT != 0)?)
        })
    }
}

/// The rest shape is there without having moved: nothing feels inertia of it.
pub const SW_REST_TELEPORT: u32 = 1;

/// Sets where the rest shape is at the end of the next step, as the host animates it by blend shapes or a skeleton; call it before each step while it
/// moves. `positions` (n_vertices x 3, world space) has a row for every vertex in the order of the mesh, as SW_FORMAT_..., `stride` bytes from
/// vertex to vertex (0 = packed); NULL with n_vertices 0: the mesh is the rest shape again. `flags`: SW_REST_TELEPORT or 0. The first call places it.
///
/// The method's displacement from the mesh is added to the shape, turned at each vertex by the mean rotation of its triangles. Gravity, forces, wind and the
/// inertia of the shape's motion act in these axes. Supports go with the shape, exactly. Nothing is precomputed anew: a shape that is bent or stretched far from the
/// mesh has another stiffness, which the modes do not know; rest_stretch of SwStateReport tells the largest change of an edge. The full shells take lengths and
/// angles at rest from the shape, with the mesh's masses: they are the shell of that shape. The support frame then
/// is for output in SW_SPACE_FRAME alone. Colliders touch what is shown, and targets of constraints are where it is shown. It is saved with the state; a state saved
/// before it moved leaves it, when loaded, where it was sent last, at rest.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also when n_vertices is not the mesh's, or a vertex is not finite or beyond 1e9 sizes of the mesh; SW_ERROR_UNSUPPORTED
/// with sag_gravity, zero modes or supports that moved by themselves, and by a full shell with a shape without stress or rest angles of its own, creases that yield
/// or planes of symmetry. Its step fails with SW_ERROR_NUMERICAL where a triangle of the shape has no area; SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY. On failure nothing has
/// changed. While it moves, supports that move by themselves and poses are refused. So are certificates and corrections: to
/// judge a pose, go on by a full shell.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_move_rest(
    state: *mut SwState,
    format: u32,
    positions: *const c_void,
    stride: u64,
    n_vertices: u32,
    flags: u32,
) -> SwStatus {
    // SAFETY: `writing` refuses NULL; the host passes a live state, and rows for n_vertices, which is checked.
    unsafe {
        writing(state, |state| {
            check_flags("flags", flags, SW_REST_TELEPORT)?;
            if positions.is_null() && n_vertices == 0 {
                state.clear_rest();
                return Ok(());
            }
            check_vertex_count(state.model(), n_vertices)?;
            let rows = VectorRows::checked("positions", positions, format, 3, stride, n_vertices.into())?;
            Ok(state.move_rest(|v| rows.read(v), flags & SW_REST_TELEPORT != 0)?)
        })
    }
}
