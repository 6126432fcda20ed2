//! The precompute of a model: what to precompute, progress, and the choice of a method.

use super::constraint::{SW_AXIS_X, SW_AXIS_Y, SW_AXIS_Z};
use super::floats::as_the_host;
use super::guard::{guard, write};
use super::log::{SW_LOG_INFO, SW_LOG_WARNING, log};
use super::model::SwModel;
use super::pointer::{check_flags, enumerant, object, read_array};
use super::status::{Fault, SwStatus};
use super::structs::{described, read_descriptor_or_default};
use crate::auto::{self, Budget};
use crate::error::{require_finite, require_non_negative};
use crate::model::weight::OwnWeight;
use crate::model::{Model, Options, Precision};
use crate::modes::{Demand, Phase};
use crate::reduced;
use crate::{Error, ErrorKind};
use std::ffi::c_void;
use std::sync::Arc;

/// Go on.
pub const SW_PROGRESS_CONTINUE: u32 = 0x100;
/// Stop: sw_model_precompute returns SW_ERROR_CANCELLED and the model stays as it was.
pub const SW_PROGRESS_CANCEL: u32 = 0x200;

/// Stiffness and masses.
pub const SW_PHASE_ASSEMBLY: u32 = 0;
/// Fill-reducing ordering, symbolic factorization.
pub const SW_PHASE_ORDERING: u32 = 1;
/// Numeric factorization.
pub const SW_PHASE_FACTORIZATION: u32 = 2;
/// Eigenvalue iteration.
pub const SW_PHASE_MODES: u32 = 3;
/// Inertia count and residuals.
pub const SW_PHASE_CERTIFICATE: u32 = 4;
/// Modal rotations and run-time layout.
pub const SW_PHASE_ROTATION: u32 = 5;
/// Equilibria of the full shell, and the reduced shell that is trained on them.
pub const SW_PHASE_TRAINING: u32 = 6;
/// Number of phases, which grows with them.
pub const SW_PHASE_COUNT: usize = 7;
/// Places for the phases in SwModelInfo::seconds, for good: there will not be more.
pub const SW_PHASE_CAPACITY: usize = 16;

/// Hears of progress on the thread that called sw_model_precompute: SW_PHASE_... and the fraction of that phase, 0 to 1.
/// A phase may come up more than once, or not at all on a small mesh, and a newer library may have phases that this header
/// does not. Work on a mesh in pieces is told as SW_PHASE_MODES, piece by piece. A numeric factorization is one step, during
/// which nothing is heard and no cancel is taken: some tenths of a second for 10^4 vertices and some seconds for 10^5. There
/// are two or more. With more than 60 fields and modes parts of SW_PHASE_TRAINING are as silent, up to two seconds. Must return SW_PROGRESS_CONTINUE or SW_PROGRESS_CANCEL; anything else is an error, so that a callback
/// which forgets to return is found out. Must not throw or long-jump, nor destroy the model.
pub type SwProgressFn = Option<unsafe extern "C" fn(user: *mut c_void, phase: u32, fraction: f64) -> u32>;

/// The run-time basis in 32 bits: half the memory and time; positions good to about 1e-6 of the displacement.
pub const SW_PRECISION_F32: u32 = 1;
/// The run-time basis in 64 bits.
pub const SW_PRECISION_F64: u32 = 2;
/// The run-time basis in 16 bits of a unit for each mode, computed with in 32: half the memory of SW_PRECISION_F32, and as fast where
/// memory limits; positions good to about 1e-5 of the displacement (basis_rounding of SwModelInfo).
pub const SW_PRECISION_I16: u32 = 3;

/// For SW_METHOD_LMA and the nonlinear shells alone: no modal rotations are computed, and the basis takes half the memory. States
/// are then SW_METHOD_LMA by default, whose sw_state_rotations and constraints on orientations return SW_ERROR_UNSUPPORTED, and so
/// does making a state of another modal method.
pub const SW_PRECOMPUTE_LINEAR: u32 = 1;

/// For SW_METHOD_AUTO, in a time that needs no asking: with a reduced shell of reduced_fields (0 = 40, or 64 where a shell that is held is told of handles; fewer where
/// modes and fields would be more than 128) where the shell can have one, and else without. Unless reduced_poses, reduced_seconds or reduced_mode_searches say otherwise, its
/// training ends after 8e7 / (vertices to the power 1.5) iterations, about half a minute, with the same result everywhere. No reduced shell is made
/// of a shell with sag_gravity or support_fields; nor, unless a limit is given, above 10,000 vertices. Nor is one made of a shell that moves
/// freely with too few modes, in pieces or with a rest shape of its own, nor where training finds fewer than four equilibria. sw_model_offers
/// tells why, auto_method of SwModelInfo what became of it.
/// With auto_error or auto_operations these choose.
pub const SW_PRECOMPUTE_AUTO: u32 = 2;

/// SW_METHOD_AUTO may be SW_METHOD_SHELL_IMPLICIT, by steps of second order, where the shell has at most 2,500 vertices and SW_PRECOMPUTE_AUTO or reduced_fields train it: where what was
/// trained misses half of its training by more than 5 % (auto_corrects of SwModelInfo) and supports hold the shell, and where SW_PRECOMPUTE_AUTO finds fewer than four equilibria. A step then
/// takes a hundredth of a second to a second, where fields take microseconds. States with SW_STATE_DETERMINISTIC keep to the fields. With auto_error or auto_operations
/// these choose. For hosts that show one shell or a few; saved models keep the choice.
pub const SW_PRECOMPUTE_AUTO_FULL: u32 = 4;

/// The reduced shell's fields are the modes' own derivatives: no training, a fraction of the precompute, and many times the error.
pub const SW_REDUCED_UNTRAINED: u32 = 1;

/// Computed at most to meet a tolerance, unless asked otherwise.
const MOST_MODES: usize = 256;

/// What to precompute.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwPrecomputeDesc {
    /// Set by sw_precompute_desc_init.
    pub struct_size: u32,
    /// Number of lowest modes, zero modes included; 0 = 16, or 256 with a tolerance. No more are given than there are unknowns, nor
    /// more than 1024; sw_model_info tells.
    /// Loose pieces have six zero modes each, which come before all others. Where more modes are equal than are given, those come
    /// first that translations along x, y and z agree with: they hold all that gravity does to the equal ones. Rotations about the
    /// centre of mass are next, then fixed pseudo-random mixtures. A shell in thousands of pieces costs what one piece of its size costs.
    pub modes: u32,
    /// SW_PRECISION_... of the run-time basis; 0 = SW_PRECISION_F32. Modes are always computed in 64 bits.
    pub precision: u32,
    /// SW_PRECOMPUTE_... or 0.
    pub flags: u32,
    /// NULL = none.
    pub progress: SwProgressFn,
    /// Passed to progress.
    pub progress_user: *mut c_void,
    /// Gravity in frame axes, acceleration. Unless zero, the mesh is first let sag under it to rest by the nonlinear shell, and
    /// modes are those of the sagged shape under its own weight; states begin there, and displacements and max_displacement
    /// count from there. Under this gravity the shape is then exact, and under others the error of a modal method grows with the
    /// difference only. The shell must be supported.
    pub sag_gravity: [f64; 3],
    /// Unless 0, modes are left out that a scene cannot show: under the loads below, no vertex is off by more than this length,
    /// against the same method with all modes. `modes` is then the most that are computed; 0 = 256. sw_model_info tells the bound
    /// that was reached, which exceeds the tolerance where that was not enough; SW_ERROR_NUMERICAL where there is none. The bound is an
    /// estimate by statics, see demand_amplification, and holds for turns of less than a rad.
    pub tolerance: f64,
    /// Gravity of the scene in frame axes. Read, as all fields from here to n_handles, with a tolerance or for SW_METHOD_AUTO only.
    pub demand_gravity: [f64; 3],
    /// Size of an acceleration that may act in any direction: of the frame, or gravity where the frame turns.
    pub demand_acceleration: f64,
    /// How much further loads move the shell than at rest: 1 when they change slowly; 0 = 2, when they come at once; up to
    /// 2/(pi ratio) when they shake it in time with a mode of that damping ratio.
    pub demand_amplification: f64,
    /// How far from rest handles move their vertices, in the directions in which these give. For a tolerance, to hold a vertex in
    /// others as well can ask for more modes; see auto_error for what is judged there.
    pub handle_distance: f64,
    /// The vertices that handles move (n_handles). A reduced shell reads them, too, and spends up to half of its fields on how it gives there:
    /// three for pulls at each, and three for turns where the half has room for those of all. From 24 fields on the
    /// training of a shell that is held leads the full shell by them, by a fifth of its size where it gives most, the others held at rest.
    pub handles: *const u32,
    /// Length of handles.
    pub n_handles: u32,
    /// SW_AXIS_... bits of the frame's axes along which handles hold their vertices, for SW_METHOD_AUTO; 0 = all.
    pub handle_axes: u32,
    /// Displacement fields beyond the modes for SW_METHOD_REDUCED_SHELL, which needs some; 0 = none, and the model takes no more
    /// time and memory than without. 40 suit 8 modes, 64 where handles are told to a shell that is held; modes and fields are at most 128 together. sag_gravity must be
    /// zero. A shell that moves freely, in one piece, needs all its rigid motions among the modes: 6 modes more where nothing holds it.
    pub reduced_fields: u32,
    /// Triangles, edges and hinges, together, that stand for all in its steps, whose cost grows with their number; 0 = as many as
    /// leave out 1 % of the elastic forces, but at most 16 for each mode and field.
    pub reduced_elements: u32,
    /// Equilibria of the full shell that its fields are trained on: under gravity along the axes, pressure, by handles that are known, under weak
    /// pulls at points, gravity along the diagonals between the axes and strong pulls; then by half of each but the weak pulls. At most 62 are used,
    /// or 68 where handles are known.
    /// Each takes as long as a static solution of SW_METHOD_SHELL_IMPLICIT. Of a load that buckles the shell only the part is used that was
    /// balanced after a few hundred iterations, from 8,000 vertices on after a hundred. The fields are saved with the model. 0 = as many as
    /// 208,000 over the number of vertices, at most 62.
    pub reduced_poses: u32,
    /// Bitwise or of SW_REDUCED_...
    pub reduced_flags: u32,
    /// Strength of the gravity that its scenes will have, acceleration, from which the loads of the training follow; 0 = what bends
    /// the shell by a quarter of its size to first order. SW_ERROR_NUMERICAL beyond 1e12 times that.
    pub reduced_gravity: f64,
    /// Unless this and auto_operations are both 0, the method for SW_METHOD_AUTO is chosen, and the model made for it alone. Tried are
    /// SW_METHOD_LMA, SW_METHOD_WARP, SW_METHOD_WARP_VIRTUAL_WORK and SW_METHOD_ROTATION_STRAIN, the last two also on the shape that
    /// hangs under demand_gravity, and SW_METHOD_REDUCED_SHELL with reduced_fields (0 = 40) and with half as many; with
    /// SW_PRECOMPUTE_LINEAR only the first and the reduced shells. With sag_gravity the modes are those of that shape, and no reduced
    /// shell is tried. Taken is the cheapest that gets no vertex wrong by more than this length against the full shell's equilibria;
    /// else the most accurate. Trials are demand_gravity, demand_acceleration and handles, read without a tolerance too.
    ///
    /// A handle's position is held hard along handle_axes. It is led in four parts from where it hangs to handle_distance from rest, in each direction
    /// in which the vertex gives at least a tenth as much as in its softest, either way: straight, along the way that the shell's vertex takes by
    /// itself, and straight between these directions. Each part is judged, and the errors of handles count a quarter more, for places in
    /// between. Not judged are orientations, several handles at once, more than six of them, compliances, and motion. A flat sheet that is
    /// lifted straight with all axes held is stretched, and no method is near there: hold only the axes that matter.
    ///
    /// Takes about four times a precompute, each reduced shell with its training, and an equilibrium of the full shell for each load, for handles
    /// at most 200.
    pub auto_error: f64,
    /// Chosen among are those of these methods whose step takes no more operations than this, as sw_state_plan counts them, or else the
    /// cheapest alone; 0 = all.
    pub auto_operations: f64,
    /// The fastest that handles move, length/s; 0 = any. With a tolerance, where it is known, the modes' static answers to pulls at the
    /// handles may stand for those modes that nothing else needs, up to three a handle: hundreds of modes are then a few. They are counted
    /// and saved as modes, and have frequencies as these, of their own energy; sw_model_info's certificate is of the modes beside them.
    pub handle_speed: f64,
    /// Seconds that the training by reduced_poses may take, from the end of the modes' work to the end of the precompute; 0 = any. No further
    /// equilibrium is sought once what follows would end later, and none where that leaves less time than what came before took. What follows is
    /// estimated: trainings were measured to take up to two fifths more. Where it would take more than half of the time, samples and the polynomial are
    /// fitted to a quarter of the examples or fewer; it is not cut further. What is found in time depends on the machine and its load, and with it the
    /// fields: reduced_poses alone gives the same ones every time.
    pub reduced_seconds: f64,
    /// The same as a multiple of the time that the modes took; 0 = any.
    pub reduced_mode_searches: f64,
    /// Vertices (n_contact_patches) where the shell is to be touched by what is smaller than its modes. The shell's static answer to a push along the normal at each joins the
    /// modes, and with them the methods that move by modes. They are counted and saved as modes, and have frequencies as these, of their own energy. The
    /// shell must be held so that nothing moves freely. Not with auto_error or auto_operations. NULL = none.
    pub contact_patches: *const u32,
    /// Length of contact_patches.
    pub n_contact_patches: u32,
    /// Fields by which the modal methods follow supports that move against each other (sw_state_move_supports); 0 = none. The first follow each group
    /// of supports that edges join as it moves, turns and strains, 12 a group less the 6 rigid motions of all, which need none; further ones
    /// follow its bending: 24 suit most. The shell's static answer to each is solved for, and they cost in a step and in output as much as modes. Not for a
    /// shell with clamped edges of SW_ENERGY_KOITER: fix two rows there.
    pub support_fields: u32,
}

described!(SwPrecomputeDesc, support_fields);

/// Computes modes and modal rotations; `desc` may be NULL for defaults. May be called again with other options: states made
/// before keep the modes they were made with.
///
/// Blocks for seconds on large meshes. On failure or cancellation the model is as it was before. Not to be called at the
/// same time as any other function on this model.
/// Errors: SW_ERROR_INVALID_DESC, SW_ERROR_INVALID_ARGUMENT, SW_ERROR_CANCELLED, SW_ERROR_NUMERICAL, also when the shell does not
/// come to rest under sag_gravity or is about to buckle there, SW_ERROR_UNSUPPORTED for a reduced shell that moves freely in several
/// pieces, whose modes do not hold all its rigid motions, or that has sag_gravity, and for what this library was built without; SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_model_precompute(model: *mut SwModel, desc: *const SwPrecomputeDesc) -> SwStatus {
    guard(|| {
        // SAFETY: `object` refuses NULL; the host passes a live model, and a descriptor that is NULL or has its struct_size.
        let (handle, desc) = unsafe { (object("model", model)?, read_descriptor_or_default("desc", desc)?) };
        // SAFETY: the host's list of handles holds as many vertices as the descriptor says.
        let (mut options, budget) = unsafe { read_options(&desc)? };
        let mut content = write("model", &handle.0)?;
        let vertices = content.shell.mass.len();
        if desc.reduced_flags & SW_REDUCED_UNTRAINED == 0 && desc.reduced_poses == 0 {
            options.reduced.poses = reduced::default_poses(vertices);
        }
        if options.reduced.optional
            && desc.reduced_fields == 0
            && desc.n_handles > 0
            && content.shell.held.contains(&true)
        {
            options.reduced.fields = reduced::FIELDS_WITH_HANDLES;
        }
        let limited = desc.reduced_poses > 0 || desc.reduced_seconds > 0.0 || desc.reduced_mode_searches > 0.0;
        if options.reduced.optional && !limited {
            options.reduced.iterations = reduced::affordable_iterations(vertices);
        }
        let mut progress = |phase: Phase, fraction: f64| call_progress(&desc, phase, fraction);
        let shell = content.shell.clone();
        let computed = match budget {
            Some(budget) => auto::precompute(shell, &options, budget, &mut progress)?,
            None => Model::precompute(shell, &options, &mut progress)?,
        };
        log_certificate(&computed);
        content.weight = content.unit.map(|metres| OwnWeight::of(&computed, metres));
        if let Some(doubt) = content.weight.as_ref().and_then(OwnWeight::doubt) {
            log(SW_LOG_WARNING, &doubt);
        }
        content.model = Some(Arc::new(computed));
        Ok(())
    })
}

/// All but the poses that 0 stands for, and what the automatic choice may cost.
///
/// # Safety
/// `desc.handles` points to `desc.n_handles` vertices.
unsafe fn read_options(desc: &SwPrecomputeDesc) -> Result<(Options, Option<Budget>), Fault> {
    let known = SW_PRECOMPUTE_LINEAR | SW_PRECOMPUTE_AUTO | SW_PRECOMPUTE_AUTO_FULL;
    check_flags("desc->flags", desc.flags, known)?;
    let known = [(0, Precision::F32), (SW_PRECISION_F32, Precision::F32), (SW_PRECISION_F64, Precision::F64)];
    let known: Vec<_> = known.into_iter().chain([(SW_PRECISION_I16, Precision::I16)]).collect();
    let precision = enumerant("desc->precision", desc.precision, &known)?;
    for (k, g) in desc.sag_gravity.iter().enumerate() {
        require_finite(format_args!("desc->sag_gravity[{k}]"), *g)?;
    }
    let budget = read_budget(desc)?;
    let demand = match desc.tolerance {
        0.0 if budget.is_none() => None,
        // SAFETY: the caller's contract is the same.
        _ => Some(unsafe { read_demand(desc)? }),
    };
    check_flags("desc->handle_axes", desc.handle_axes, SW_AXIS_X | SW_AXIS_Y | SW_AXIS_Z)?;
    let reduced = read_reduced(desc, budget.is_none())?;
    let handles = match reduced.fields {
        0 => vec![],
        // SAFETY: the caller's contract is the same.
        _ => unsafe { read_array("desc->handles", desc.handles, desc.n_handles.into())? },
    };
    let most = if desc.tolerance != 0.0 { MOST_MODES } else { Options::default().modes };
    let options = Options {
        demand,
        modes: if desc.modes == 0 { most } else { desc.modes as usize },
        precision,
        sag: desc.sag_gravity.into(),
        linear: desc.flags & SW_PRECOMPUTE_LINEAR != 0,
        reduced,
        // SAFETY: the host's list holds as many vertices as the descriptor says.
        contact_patches: unsafe {
            read_array("desc->contact_patches", desc.contact_patches, desc.n_contact_patches.into())?
        },
        handles,
        support_fields: desc.support_fields as usize,
        may_be_full: desc.flags & SW_PRECOMPUTE_AUTO_FULL != 0,
    };
    if budget.is_some() && options.support_fields > 0 {
        return Err(Fault::argument("desc->support_fields: not with auto_error or auto_operations"));
    }
    if budget.is_some() && !options.contact_patches.is_empty() {
        return Err(Fault::argument("desc->contact_patches: not with auto_error or auto_operations"));
    }
    Ok((options, budget))
}

/// None without an automatic choice.
fn read_budget(desc: &SwPrecomputeDesc) -> Result<Option<Budget>, Fault> {
    let error = require_non_negative("desc->auto_error", desc.auto_error)?;
    if error == 0.0 && desc.auto_operations == 0.0 {
        return Ok(None);
    }
    let most = require_non_negative("desc->auto_operations", desc.auto_operations)?;
    Ok(Some(Budget { error, operations: if most > 0.0 { most } else { f64::INFINITY } }))
}

/// # Safety
/// `desc.handles` points to `desc.n_handles` vertices.
unsafe fn read_demand(desc: &SwPrecomputeDesc) -> Result<Demand, Fault> {
    Ok(Demand {
        tolerance: desc.tolerance,
        gravity: desc.demand_gravity.into(),
        acceleration: desc.demand_acceleration,
        // SAFETY: there are so many by the caller's contract.
        handles: unsafe { read_array("desc->handles", desc.handles, desc.n_handles.into())? },
        distance: desc.handle_distance,
        axes: [SW_AXIS_X, SW_AXIS_Y, SW_AXIS_Z].map(|axis| desc.handle_axes & axis != 0),
        speed: desc.handle_speed,
        amplification: if desc.demand_amplification == 0.0 { 2.0 } else { desc.demand_amplification },
    })
}

fn read_reduced(desc: &SwPrecomputeDesc, chosen_by_gate: bool) -> Result<reduced::Options, Fault> {
    check_flags("desc->reduced_flags", desc.reduced_flags, SW_REDUCED_UNTRAINED)?;
    if desc.reduced_flags & SW_REDUCED_UNTRAINED != 0 && desc.reduced_poses > 0 {
        let poses = desc.reduced_poses;
        let message = format!("desc->reduced_poses is {poses} and desc->reduced_flags has SW_REDUCED_UNTRAINED");
        return Err(Fault::argument(message));
    }
    let optional = chosen_by_gate && desc.flags & SW_PRECOMPUTE_AUTO != 0;
    let fields = if optional && desc.reduced_fields == 0 { reduced::FIELDS } else { desc.reduced_fields as usize };
    Ok(reduced::Options {
        fields,
        elements: desc.reduced_elements as usize,
        poses: desc.reduced_poses as usize,
        gravity: require_non_negative("desc->reduced_gravity", desc.reduced_gravity)?,
        seconds: unless_zero("desc->reduced_seconds", desc.reduced_seconds)?,
        mode_searches: unless_zero("desc->reduced_mode_searches", desc.reduced_mode_searches)?,
        optional,
        ..Default::default()
    })
}

/// A limit; 0 is none.
fn unless_zero(name: &str, limit: f64) -> crate::Result<f64> {
    require_non_negative(name, limit)?;
    Ok(if limit > 0.0 { limit } else { f64::INFINITY })
}

fn call_progress(desc: &SwPrecomputeDesc, phase: Phase, fraction: f64) -> crate::Result<()> {
    tell_progress(desc.progress, desc.progress_user, phase as u32, fraction)
}

pub(super) fn tell_progress(progress: SwProgressFn, user: *mut c_void, phase: u32, fraction: f64) -> crate::Result<()> {
    let Some(callback) = progress else { return Ok(()) };
    // SAFETY: the host gave this callback with this user pointer.
    answered(as_the_host(|| unsafe { callback(user, phase, fraction) }))
}

/// What a callback asked for.
pub(super) fn answered(answer: u32) -> crate::Result<()> {
    match answer {
        SW_PROGRESS_CONTINUE => Ok(()),
        SW_PROGRESS_CANCEL => Err(Error::new(ErrorKind::Cancelled, "the progress callback cancelled the work")),
        other => {
            Err(Error::argument(format!("the progress callback returned {other:#x}: neither continue nor cancel")))
        }
    }
}

/// Share by which eigenvalues may disagree before the log says so.
const WORTH_A_WARNING: f64 = 1e-4;

fn log_certificate(model: &Model) {
    let c = &model.certificate;
    if c.count != c.found {
        log(SW_LOG_WARNING, &format!("{} eigenvalues lie below {:e}, but {} were found", c.count, c.shift, c.found));
    }
    if c.disagreement > WORTH_A_WARNING {
        let message = "eigenvalues are good to a share of";
        log(SW_LOG_WARNING, &format!("{message} {:.0e} only: stiffness or triangle sizes differ much", c.disagreement));
    }
    if let Some(why) = &model.without_reduced {
        log(SW_LOG_INFO, &format!("no reduced shell: {}. SW_METHOD_AUTO is {}", why.message, model.chosen_method()));
    }
    if model.modal.zero_modes > 0 {
        log(
            SW_LOG_INFO,
            &format!(
                "{} of {} modes are zero modes: nothing resists them",
                model.modal.zero_modes,
                model.modal.n_modes()
            ),
        );
    }
}
