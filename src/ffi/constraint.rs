//! Manipulation constraints: handles on single vertices.

use super::pointer::{check_flags, enumerant, not_null, put};
use super::state::{SwState, reading, rotation, vector, writing};
use super::status::{Fault, SwStatus};
use super::structs::{Outputs, described, grows, read_descriptor};
use crate::constraint::{Constraint, MET, Outcome, Target};

/// Holds the vertex's position.
pub const SW_CONSTRAINT_POSITION: u32 = 1;
/// Holds the orientation of the vertex's frame (sw_state_rotations), which at rest is the support frame's.
pub const SW_CONSTRAINT_ORIENTATION: u32 = 2;

/// World x axis.
pub const SW_AXIS_X: u32 = 1;
/// World y axis.
pub const SW_AXIS_Y: u32 = 2;
/// World z axis.
pub const SW_AXIS_Z: u32 = 4;

/// Stands for every constraint in sw_state_clear_constraint.
pub const SW_ALL_CONSTRAINTS: u32 = 0xffff_ffff;

/// A handle (paper section 4.4). Position and orientation of one vertex are two constraints.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwConstraintDesc {
    /// Set by sw_constraint_desc_init.
    pub struct_size: u32,
    /// The host's number for it, below SW_ALL_CONSTRAINTS; setting a number again replaces the constraint.
    pub id: u32,
    /// SW_CONSTRAINT_.... Required.
    pub kind: u32,
    /// Vertex held.
    pub vertex: u32,
    /// SW_AXIS_... bits along or about which it holds; 0 = all.
    pub axes: u32,
    /// Must be 0.
    pub flags: u32,
    /// Displacement per force (length/force) or rotation per torque (rad/torque), not negative; 0 = hard.
    pub compliance: f64,
    /// World position (SW_CONSTRAINT_POSITION).
    pub position: [f64; 3],
    /// World orientation, row-major rotation matrix as in SwFrameDesc (SW_CONSTRAINT_ORIENTATION); all zero = identity. Of
    /// all rotation vectors that mean it the one nearest to the present is taken, so a handle can be turned round and round.
    pub rotation: [f64; 9],
}

described!(SwConstraintDesc, rotation);

/// What the last step made of a constraint. Output only.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwConstraintReport {
    /// The host's number.
    pub id: u32,
    /// SW_CONSTRAINT_....
    pub kind: u32,
    /// Vertex held.
    pub vertex: u32,
    /// 1 if the residual is at most a millionth of the model's size, or a microradian, beyond what the compliance gives way.
    /// 0 before the first step.
    pub met: u32,
    /// Linearizations that the whole set took in the last step.
    pub iterations: u32,
    /// 0.
    pub reserved: u32,
    /// What is missing along the held axes: length or rad.
    pub residual: f64,
    /// Force or torque on the shell, world axes, over the last step.
    pub force: [f64; 3],
}

grows!(SwConstraintReport, force);

fn constraint_of(desc: &SwConstraintDesc) -> Result<Constraint, Fault> {
    check_flags("desc->flags", desc.flags, 0)?;
    check_flags("desc->axes", desc.axes, SW_AXIS_X | SW_AXIS_Y | SW_AXIS_Z)?;
    if desc.id == SW_ALL_CONSTRAINTS {
        return Err(Fault::argument(format!("desc->id is {}, which stands for all constraints", desc.id)));
    }
    let orients = [(SW_CONSTRAINT_POSITION, false), (SW_CONSTRAINT_ORIENTATION, true)];
    let target = if enumerant("desc->kind", desc.kind, &orients)? {
        Target::Orientation(rotation(&desc.rotation)?)
    } else {
        Target::Position(vector("position", &desc.position)?)
    };
    let held = |axis| desc.axes == 0 || desc.axes & axis != 0;
    let axes = [held(SW_AXIS_X), held(SW_AXIS_Y), held(SW_AXIS_Z)];
    Ok(Constraint { id: desc.id, vertex: desc.vertex, axes, compliance: desc.compliance, target })
}

/// Adds a constraint, or moves or replaces the one with its id; it stays until cleared, and needs no new precompute. From the
/// next step on the handle is where it was put (`met` in the report), or as near as the modes allow: constraints out of reach,
/// at a vertex that a support holds, conflicting or more than the modes get the least-squares answer.
///
/// A hard handle may ask for more than the shell can do gracefully: pushed along itself, a sheet that hardly stretches can
/// only crumple. Near the rest pose it does not, and gets the least-squares answer; further away, ask
/// sw_state_certify, hold only the axes that matter, or give a compliance.
///
/// A nonlinear shell's handles are met exactly where supports and other handles leave the vertex free: a hard position is
/// prescribed; where several want one vertex at different places it is at their mean. A step whose handles move too far for
/// Newton's method to follow takes them a part of the way, and `met` is 0. The orientation is the mean of the triangles'
/// rotations at the vertex. An explicit step sets positions, so a handle should move by little in each.
///
/// Constraints are cloned with a state and survive its reset and loading, but are not saved. Allocates unless it replaces one of the same
/// axes. A reduced shell follows hard handles as far as its fields can with a root mean square displacement of twice the model's size;
/// it has the orientation of a nonlinear shell, and meets it as nearly as four passes of a step do, in an equilibrium to 1e-4 rad. Steps that hold one allocate.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_UNSUPPORTED for an orientation of a modal method on a model with
/// SW_PRECOMPUTE_LINEAR, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_set_constraint(state: *mut SwState, desc: *const SwConstraintDesc) -> SwStatus {
    // SAFETY: `writing` refuses a NULL state, `read_descriptor` a NULL or uninitialised descriptor; the host passes live ones.
    unsafe {
        writing(state, |state| {
            let desc = read_descriptor("desc", desc)?;
            Ok(state.set_constraint(constraint_of(&desc)?)?)
        })
    }
}

/// Removes a constraint, or all there are with SW_ALL_CONSTRAINTS.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also when there is none with this id; SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_clear_constraint(state: *mut SwState, id: u32) -> SwStatus {
    // SAFETY: `writing` refuses NULL; the host passes a live state.
    unsafe {
        writing(state, |state| {
            if id == SW_ALL_CONSTRAINTS {
                state.clear_constraints();
                return Ok(());
            }
            Ok(state.clear_constraint(id)?)
        })
    }
}

fn report_of(constraint: &Constraint, outcome: &Outcome, (size, stiffness): (f64, f64)) -> SwConstraintReport {
    let (kind, unit) = match constraint.target {
        Target::Position(_) => (SW_CONSTRAINT_POSITION, size),
        Target::Orientation(_) => (SW_CONSTRAINT_ORIENTATION, 1.0),
    };
    let gives_way = constraint.compliance * outcome.force.norm();
    SwConstraintReport {
        id: constraint.id,
        kind,
        vertex: constraint.vertex,
        met: u32::from(outcome.iterations > 0 && outcome.residual <= MET * unit + gives_way * (1.0 + MET)),
        iterations: outcome.iterations,
        reserved: 0,
        residual: outcome.residual,
        force: (stiffness * outcome.force).into(),
    }
}

/// What the last step made of each constraint, by ascending id. `element_size` is sizeof(SwConstraintReport). Two calls: with `reports` NULL and `capacity` 0 only *count is
/// written. Callable concurrently.
/// Errors: SW_ERROR_INVALID_DESC, SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUFFER_SIZE when capacity < *count, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_constraint_report(
    state: *const SwState,
    reports: *mut SwConstraintReport,
    element_size: u32,
    capacity: u32,
    count: *mut u32,
) -> SwStatus {
    // SAFETY: `reading` refuses a NULL state; `count` is not NULL, and the host's array has room for `capacity` elements.
    unsafe {
        reading(state, |state| {
            not_null("count", count)?;
            let out = Outputs::checked("reports", reports, element_size)?;
            let by = (state.model().shell.mesh.size, state.stiffness());
            let all: Vec<SwConstraintReport> = state.constraints().map(|(c, o)| report_of(c, o, by)).collect();
            out.copy_out("reports", &all, capacity)?;
            put(count, all.len() as u32);
            Ok(())
        })
    }
}
