//! The methods by which states move, as a table that hosts read.

use super::guard::guard;
use super::model::SwModel;
use super::pointer::object;
use super::status::{Fault, SwStatus};
use crate::method::{AUTO, Entry, METHODS, Method, Needs};
use crate::model::Model;
use std::ffi::{CStr, c_char};

/// Modal warping (the paper): u = R~(Psi q) Phi q, modal force Phi^T R^T F.
pub const SW_METHOD_WARP: u32 = 1;
/// Linear modal analysis: u = Phi q, modal force Phi^T F.
pub const SW_METHOD_LMA: u32 = 2;
/// The full nonlinear shell by backward Euler with Newton's method: ground truth, seconds a frame on large meshes. No
/// amplitudes, and one damping ratio, that of its slowest swing; saved states hold every vertex.
pub const SW_METHOD_SHELL_IMPLICIT: u32 = 3;
/// The same by symplectic Euler; steps must be very short (the paper: 1/30000 s).
pub const SW_METHOD_SHELL_EXPLICIT: u32 = 4;
/// Modal warping with the exact modal force of its own positions, (du/dq)^T F: dead loads are conservative. A step costs up
/// to twice that of SW_METHOD_WARP.
pub const SW_METHOD_WARP_VIRTUAL_WORK: u32 = 5;
/// The full nonlinear energy on a few displacement fields, u = B q, by a Runge-Kutta method of second order and Newton's method, of a
/// model precomputed with reduced_fields: a fraction of the warp's error, without its limit of rotation, at a step's cost that hardly grows with the mesh.
/// No amplitudes. Stiffness damping is by the stiffness of the present shape, damping ratios are those of the modes. The integrator is
/// its own.
pub const SW_METHOD_REDUCED_SHELL: u32 = 6;
/// The reduced shell with its energy as a polynomial of the fields' amplitudes, of the same model and training: no element is evaluated in a
/// step, which takes a fraction of the time of SW_METHOD_REDUCED_SHELL and does not know the mesh. Where hinges turn by radians or
/// edges stretch by tenths of their length it is too stiff. A model that was saved without it is refused: precompute anew. So is one
/// with ties, or under stress at rest.
pub const SW_METHOD_POLYNOMIAL_SHELL: u32 = 9;
/// Both of these: SW_METHOD_POLYNOMIAL_SHELL as long as the shell is no further from rest, in the mass norm, than the training's equilibria up to which
/// the polynomial was as good as the samples, SW_METHOD_REDUCED_SHELL beyond, and back at four fifths of it. Both have the same fields, so that nothing
/// jumps but the cost of a step and the elastic energy that is told. A saved state knows which form acts; sw_state_plan tells. Refused as
/// SW_METHOD_POLYNOMIAL_SHELL is, and for shells that move freely.
pub const SW_METHOD_ADAPTIVE_SHELL: u32 = 10;
/// Rotation-strain reconstruction: each triangle is turned by the rotation of its modal displacement and keeps its linear strain, and
/// the vertices follow; modal force (du/dq)^T F. What bends without stretching keeps its lengths and area, so that large bends of
/// shells that are flat at rest come closer to the nonlinear shell; on curved ones it is as close as SW_METHOD_WARP_VIRTUAL_WORK, since
/// both have the same modes. A step under gravity visits no vertex. The first state of a model prepares it, which takes as long as
/// a part of the precompute, on small meshes up to twice as long; the model then holds 3 more numbers a vertex and sample, of
/// which there are at most 32. turn_in_range of sw_state_report up to half a turn.
pub const SW_METHOD_ROTATION_STRAIN: u32 = 8;
/// The method that the precompute chose for the scene by auto_error, auto_operations or both: see SwPrecomputeDesc. Without these, of a
/// model with a reduced shell, by reduced_fields or SW_PRECOMPUTE_AUTO: SW_METHOD_POLYNOMIAL_SHELL where it met the training's equilibria as
/// well as SW_METHOD_REDUCED_SHELL; SW_METHOD_ADAPTIVE_SHELL where it did so up to a quarter of their size or more; else SW_METHOD_REDUCED_SHELL. Of any other model what 0 stands for, the warp.
/// With SW_PRECOMPUTE_AUTO_FULL it is SW_METHOD_SHELL_IMPLICIT where fields do not hold the shell, by steps of second order whatever integrator is asked for.
pub const SW_METHOD_AUTO: u32 = 7;

/// Modes: any precompute.
pub const SW_NEEDS_MODES: u32 = 1;
/// Modal rotations: a precompute without SW_PRECOMPUTE_LINEAR.
pub const SW_NEEDS_ROTATIONS: u32 = 2;
/// Fields: a precompute with reduced_fields.
pub const SW_NEEDS_REDUCED_FIELDS: u32 = 3;
/// Something to choose from: a precompute with SW_PRECOMPUTE_AUTO, auto_error, auto_operations or reduced_fields. On other models
/// SW_METHOD_AUTO is the warp.
pub const SW_NEEDS_CHOICE: u32 = 4;

/// Number of methods that this library knows, SW_METHOD_AUTO included.
#[unsafe(no_mangle)]
pub extern "C" fn sw_method_count() -> u32 {
    METHODS.len() as u32 + 1
}

/// The SW_METHOD_... at `index` of the table, in the order for menus; SW_METHOD_AUTO is the last. 0 at and beyond sw_method_count().
#[unsafe(no_mangle)]
pub extern "C" fn sw_method_at(index: u32) -> u32 {
    match METHODS.get(index as usize) {
        Some(entry) => entry.number,
        None if index as usize == METHODS.len() => SW_METHOD_AUTO,
        None => 0,
    }
}

/// A method's name for files and scripts, such as "warp-virtual-work". Lower case, parted by hyphens; it never changes.
/// "" for an unknown number. Never NULL; constant.
#[unsafe(no_mangle)]
pub extern "C" fn sw_method_name(method: u32) -> *const c_char {
    text_of(method, c"auto", |entry| entry.name)
}

/// A method's name for menus, such as "Warp by virtual work". "" for an unknown number. Never NULL; constant.
#[unsafe(no_mangle)]
pub extern "C" fn sw_method_label(method: u32) -> *const c_char {
    text_of(method, c"Automatic", |entry| entry.label)
}

/// What a model must have for states of a method, SW_NEEDS_.... 0 for an unknown number.
#[unsafe(no_mangle)]
pub extern "C" fn sw_method_needs(method: u32) -> u32 {
    match Method::of_number(method).map(|method| method.entry().needs) {
        Some(Needs::Modes) => SW_NEEDS_MODES,
        Some(Needs::Rotations) => SW_NEEDS_ROTATIONS,
        Some(Needs::ReducedFields) => SW_NEEDS_REDUCED_FIELDS,
        None if method == SW_METHOD_AUTO => SW_NEEDS_CHOICE,
        None => 0,
    }
}

/// Whether states of a method can be made on a model: SW_OK, or the error that sw_state_create would give. Callable concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT for an unknown method, SW_ERROR_NOT_PRECOMPUTED, SW_ERROR_UNSUPPORTED, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_model_offers(model: *const SwModel, method: u32) -> SwStatus {
    guard(|| {
        // SAFETY: the host passes a live object of this library, or NULL, which is refused.
        let model = unsafe { object("model", model)? }.precomputed()?;
        Ok(model.require(method_of("method", &model, method)?)?)
    })
}

fn text_of(method: u32, auto: &'static CStr, of: impl Fn(&Entry) -> &'static CStr) -> *const c_char {
    let text = match Method::of_number(method) {
        Some(method) => of(method.entry()),
        None if method == SW_METHOD_AUTO => auto,
        None => c"",
    };
    text.as_ptr()
}

/// What SW_METHOD_... and 0 mean for states of `model`. `name` is the argument's.
pub(super) fn method_of(name: &str, model: &Model, method: u32) -> Result<Method, Fault> {
    match method {
        0 if model.modal.is_linear() => Ok(Method::LinearModalAnalysis),
        0 => Ok(Method::Warp),
        SW_METHOD_AUTO => Ok(model.chosen_method()),
        _ => Method::of_number(method)
            .ok_or_else(|| Fault::argument(format!("{name} is {method}, which is no SW_METHOD_..."))),
    }
}

/// The table and the constants of the header are the same numbers.
const _: () = {
    let header = [
        (Method::Warp, SW_METHOD_WARP),
        (Method::VirtualWorkWarp, SW_METHOD_WARP_VIRTUAL_WORK),
        (Method::RotationStrain, SW_METHOD_ROTATION_STRAIN),
        (Method::ReducedShell, SW_METHOD_REDUCED_SHELL),
        (Method::PolynomialShell, SW_METHOD_POLYNOMIAL_SHELL),
        (Method::AdaptiveShell, SW_METHOD_ADAPTIVE_SHELL),
        (Method::ImplicitShell, SW_METHOD_SHELL_IMPLICIT),
        (Method::ExplicitShell, SW_METHOD_SHELL_EXPLICIT),
        (Method::LinearModalAnalysis, SW_METHOD_LMA),
    ];
    assert!(header.len() == METHODS.len() && AUTO == SW_METHOD_AUTO);
    let mut k = 0;
    while k < METHODS.len() {
        assert!(header[k].0 as u8 == METHODS[k].method as u8 && header[k].1 == METHODS[k].number);
        k += 1;
    }
};
