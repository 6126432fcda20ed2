//! What a step of a state consists of, and what was left out.

use super::pointer::{asks_for_size, copy_out, not_null, put};
use super::state::{SwState, reading};
use super::status::{SwStatus, copy_text};
use super::structs::{Outputs, grows};
use crate::state::{Part, PartKind};
use std::ffi::c_char;

/// Rest positions, masses, triangles, edges, constants of each mode.
pub const SW_PART_SHAPE: u32 = 1;
/// Mode shapes Phi.
pub const SW_PART_DISPLACEMENTS: u32 = 2;
/// Modal rotations Psi.
pub const SW_PART_ROTATIONS: u32 = 3;
/// The oscillator of each mode with its guard, and the state.
pub const SW_PART_MODES: u32 = 4;
/// Gravity and the acceleration of the frame.
pub const SW_PART_UNIFORM_LOAD: u32 = 5;
/// Inertia of a turning frame.
pub const SW_PART_SPIN: u32 = 6;
/// Forces on vertices.
pub const SW_PART_FORCES: u32 = 7;
/// Wind.
pub const SW_PART_WIND: u32 = 8;
/// Constraints.
pub const SW_PART_CONSTRAINTS: u32 = 9;
/// The nonlinear shell.
pub const SW_PART_NONLINEAR_SHELL: u32 = 10;
/// The reduced nonlinear shell.
pub const SW_PART_REDUCED_SHELL: u32 = 11;
/// Contact with colliders.
pub const SW_PART_CONTACT: u32 = 12;

/// Length of SwPlanPart::reason, the closing NUL included; for good.
pub const SW_PLAN_REASON_SIZE: usize = 120;

/// One part of a step. Output only.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwPlanPart {
    /// SW_PART_....
    pub part: u32,
    /// 1 when the step or the output uses it, else 0.
    pub active: u32,
    /// Bytes held for it by the model or the state, whether used or not.
    pub bytes: u64,
    /// Estimate of the instructions of the step, on registers of 8 numbers of 32 bits (AVX2); 0 when left out. Mostly within a
    /// quarter (docs/evidence/leave_out.md); for an implicit step of a nonlinear shell, reduced or not, by the iterations of the last step.
    pub operations: f64,
    /// Why it is used, or was left out; NUL-terminated.
    pub reason: [c_char; SW_PLAN_REASON_SIZE],
}

grows!(SwPlanPart, reason);

impl From<&Part> for SwPlanPart {
    fn from(part: &Part) -> Self {
        let kind = match part.kind {
            PartKind::Shape => SW_PART_SHAPE,
            PartKind::Displacements => SW_PART_DISPLACEMENTS,
            PartKind::Rotations => SW_PART_ROTATIONS,
            PartKind::Modes => SW_PART_MODES,
            PartKind::UniformLoad => SW_PART_UNIFORM_LOAD,
            PartKind::Spin => SW_PART_SPIN,
            PartKind::Forces => SW_PART_FORCES,
            PartKind::Wind => SW_PART_WIND,
            PartKind::Constraints => SW_PART_CONSTRAINTS,
            PartKind::NonlinearShell => SW_PART_NONLINEAR_SHELL,
            PartKind::ReducedShell => SW_PART_REDUCED_SHELL,
            PartKind::Contact => SW_PART_CONTACT,
        };
        let mut text = [0u8; SW_PLAN_REASON_SIZE];
        copy_text(&part.reason, &mut text);
        Self {
            part: kind,
            active: part.active.into(),
            bytes: part.bytes as u64,
            operations: part.operations,
            reason: text.map(|byte| byte as c_char),
        }
    }
}

/// What a step of `seconds` from the present state uses, what it leaves out and why, and what each part costs: one entry for each
/// SW_PART_..., in ascending order. `element_size` is sizeof(SwPlanPart). Two calls: with `parts` NULL and `capacity` 0 only *count is written. Callable concurrently.
/// Errors: SW_ERROR_INVALID_DESC, SW_ERROR_INVALID_ARGUMENT, also as by sw_state_step; SW_ERROR_BUFFER_SIZE when capacity < *count; SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_plan(
    state: *const SwState,
    seconds: f64,
    parts: *mut SwPlanPart,
    element_size: u32,
    capacity: u32,
    count: *mut u32,
) -> SwStatus {
    // SAFETY: `reading` refuses a NULL state; `count` is not NULL, and the host's array has room for `capacity` elements.
    unsafe {
        reading(state, |state| {
            not_null("count", count)?;
            let out = Outputs::checked("parts", parts, element_size)?;
            let plan: Vec<SwPlanPart> = state.plan(seconds)?.iter().map(SwPlanPart::from).collect();
            out.copy_out("parts", &plan, capacity)?;
            put(count, plan.len() as u32);
            Ok(())
        })
    }
}

/// The same as a table in words, UTF-8 and NUL-terminated. Two calls: with `text` NULL and `capacity` 0 only *size is written, the NUL
/// included. Callable concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also as by sw_state_step; SW_ERROR_BUFFER_SIZE when capacity < *size; SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_plan_text(
    state: *const SwState,
    seconds: f64,
    text: *mut c_char,
    capacity: u64,
    size: *mut u64,
) -> SwStatus {
    // SAFETY: `reading` refuses a NULL state; `size` is not NULL, and the host's text has room for `capacity` bytes.
    unsafe {
        reading(state, |state| {
            not_null("size", size)?;
            let mut table = state.plan_text(seconds)?.into_bytes();
            table.push(0);
            if !asks_for_size("text", text, table.len() as u64, capacity)? {
                copy_out("text", &table, text.cast::<u8>(), capacity)?;
            }
            put(size, table.len() as u64);
            Ok(())
        })
    }
}
