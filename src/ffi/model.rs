//! Models: the shell, and after precompute its modes.

use super::constraint::{SW_AXIS_X, SW_AXIS_Y, SW_AXIS_Z};
use super::floats::as_the_host;
use super::guard::{guard, read, write};
use super::log::{SW_LOG_INFO, SW_LOG_WARNING, log};
use super::mesh::{SwMeshDesc, read_mesh};
use super::pointer::{
    VectorRows, asks_for_size, byte_slice, check_flags, copy_out, enumerant, not_null, object, put, read_array,
};
use super::status::{
    Fault, SW_ERROR_INVALID_DATA, SW_ERROR_NOT_PRECOMPUTED, SW_ERROR_NUMERICAL, SW_ERROR_UNSUPPORTED, SwStatus,
};
use super::structs::{Described, Output, Outputs, described, grows, read_descriptor_or_default};
use crate::auto::{self, Budget};
use crate::error::{require_finite, require_non_negative};
use crate::model::file;
use crate::model::front::Candidate;
use crate::model::{Model, Options, Precision};
use crate::modes::{Demand, PHASES, Phase};
use crate::reduced;
use crate::{Error, ErrorKind, Material, Mesh, Shell, State, Supports};
use std::ffi::c_void;
use std::sync::{Arc, RwLock};

/// Discrete shells: area, length and dihedral-angle terms (Grinspun et al. 2003), as in the paper.
pub const SW_ENERGY_DISCRETE_SHELLS: u32 = 1;

/// Material constants, uniform over the shell. 0 means the default; stiffnesses must not be negative.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwMaterialDesc {
    /// Set by sw_material_desc_init.
    pub struct_size: u32,
    /// SW_ENERGY_...; 0 = SW_ENERGY_DISCRETE_SHELLS.
    pub energy: u32,
    /// Area stiffness k_A, energy per area. Default 1e4.
    pub k_area: f64,
    /// Length stiffness k_L, energy per length. Default 1e4. On a near-equilateral mesh of edge l the membrane stiffness
    /// (Young's modulus times thickness) is about 4 k_L / (sqrt(3) l).
    pub k_length: f64,
    /// Bending stiffness k_B, energy. Default 1. The plate rigidity is D = 6 k_B with Poisson's ratio -1/3.
    pub k_bend: f64,
    /// Mass per area. Default 1.
    pub area_density: f64,
}

described!(SwMaterialDesc, area_density);

/// Which vertices are held in place in the support frame. Lists may repeat vertices.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwSupportDesc {
    /// Set by sw_support_desc_init.
    pub struct_size: u32,
    /// Must be 0.
    pub flags: u32,
    /// Fixed vertices (n_fixed). A straight row of them is a hinge: nothing resists turning about it.
    pub fixed: *const u32,
    /// Clamped vertices (n_clamped): fixed together with all their edge neighbours, which holds the slope as well.
    pub clamped: *const u32,
    /// Length of fixed.
    pub n_fixed: u32,
    /// Length of clamped.
    pub n_clamped: u32,
}

described!(SwSupportDesc, n_clamped);

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
/// Modal rotations, run-time layout, and the reduced shell.
pub const SW_PHASE_ROTATION: u32 = 5;
/// Number of phases, which grows with them.
pub const SW_PHASE_COUNT: usize = 6;
/// Places for the phases in SwModelInfo::seconds, for good: there will not be more.
pub const SW_PHASE_CAPACITY: usize = 16;

/// Hears of progress on the thread that called sw_model_precompute: SW_PHASE_... and the fraction of that phase, 0 to 1.
/// A phase may come up more than once, or not at all on a small mesh, and a newer library may have phases that this header
/// does not. Work on a mesh in pieces is told as SW_PHASE_MODES, piece by piece. A numeric factorization is one step, during
/// which nothing is heard and no cancel is taken: some tenths of a second for 10^4 vertices and some seconds for 10^5. There
/// are two or more. Must return SW_PROGRESS_CONTINUE or SW_PROGRESS_CANCEL; anything else is an error, so that a callback
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
    /// The vertices that handles move (n_handles).
    pub handles: *const u32,
    /// Length of handles.
    pub n_handles: u32,
    /// SW_AXIS_... bits of the frame's axes along which handles hold their vertices, for SW_METHOD_AUTO; 0 = all.
    pub handle_axes: u32,
    /// Displacement fields beyond the modes for SW_METHOD_REDUCED_SHELL, which needs some; 0 = none, and the model takes no more
    /// time and memory than without. 40 suit 8 modes; modes and fields are at most 128 together. The shell must be held so
    /// that nothing moves freely, and sag_gravity be zero.
    pub reduced_fields: u32,
    /// Triangles, edges and hinges, together, that stand for all in its steps, whose cost grows with their number; 0 = as many as
    /// leave out 1 % of the elastic forces, but at most 16 for each mode and field.
    pub reduced_elements: u32,
    /// Equilibria of the full shell that its fields are trained on, of gravity, pressure and pulls at points in turn; at most 52 are used.
    /// Each takes as long as a static solution of SW_METHOD_SHELL_IMPLICIT, but of a load that buckles the shell only the part that was
    /// balanced after a few hundred iterations is used, from 8,000 vertices on after a hundred. The fields are saved with the model. 0 = all
    /// 52 up to 4,000 vertices, fewer on larger meshes, as 208,000 over their number.
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
    /// Seconds that the training by reduced_poses may take, beyond which no further equilibrium is sought; 0 = any. What is found in time
    /// depends on the machine and its load, and with it the fields: reduced_poses alone gives the same ones every time.
    pub reduced_seconds: f64,
    /// The same as a multiple of the time that the modes took; 0 = any.
    pub reduced_mode_searches: f64,
}

described!(SwPrecomputeDesc, reduced_mode_searches);

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
    /// Three per vertex that moves.
    pub n_unknowns: u32,
    /// 1 after sw_model_precompute, else 0; all fields below but mass, area and size are 0 before.
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
    /// Seconds by SW_PHASE_...; 0 beyond the last. Their sum is the time of the precompute, with phases that a host does not know.
    pub seconds: [f64; SW_PHASE_CAPACITY],
    /// Bytes that the model holds for the run.
    pub bytes_model: u64,
    /// Bytes of one state of a modal method.
    pub bytes_state: u64,
    /// Estimate of the most bytes held at once during precompute.
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
    /// Elements that stand for all there.
    pub reduced_elements: u32,
    /// What these leave of the elastic forces and the rest stiffness that they were chosen by, relative.
    pub reduced_residual: f64,
    /// Largest share by which an eigenvalue by the factorized stiffness and by the energy of its mode differ: the digits that rounding
    /// has left of it in stiff cases, where residual, a share of the largest stiffness, says nothing. Above 1e-2 the precompute refuses.
    /// 0 on a model that was loaded.
    pub eigenvalue_disagreement: f64,
    /// What SW_METHOD_AUTO means here, an SW_METHOD_...; 0 without a choice. sw_model_front tells what it went by.
    pub auto_method: u32,
    /// 0.
    pub reserved: u32,
    /// Its largest error in the choice, length; DBL_MAX where it found no equilibrium under one of the loads.
    pub auto_error: f64,
}

described!(SwModelInfo, auto_error);

pub(super) struct ModelContent {
    shell: Arc<Shell>,
    pub(super) model: Option<Arc<Model>>,
}

/// A shell and, after precompute, its modes. Opaque.
pub struct SwModel(pub(super) RwLock<ModelContent>);

impl SwModel {
    /// The precomputed model, or the status that says it is missing.
    pub(super) fn precomputed(&self) -> Result<Arc<Model>, Fault> {
        let content = read("model", &self.0)?;
        let missing =
            || Fault::new(SW_ERROR_NOT_PRECOMPUTED, "the model has no modes yet: call sw_model_precompute first");
        content.model.clone().ok_or_else(missing)
    }
}

fn material_of(desc: &SwMaterialDesc) -> Result<Material, Fault> {
    enumerant("material->energy", desc.energy, &[(0, ()), (SW_ENERGY_DISCRETE_SHELLS, ())])?;
    let default = Material::default();
    let or = |value: f64, default: f64| if value == 0.0 { default } else { value };
    Ok(Material {
        k_area: or(desc.k_area, default.k_area),
        k_length: or(desc.k_length, default.k_length),
        k_bend: or(desc.k_bend, default.k_bend),
        area_density: or(desc.area_density, default.area_density),
    })
}

unsafe fn supports_of(desc: &SwSupportDesc) -> Result<Supports, Fault> {
    check_flags("supports->flags", desc.flags, 0)?;
    // SAFETY: the host's lists hold as many vertices as the descriptor says.
    unsafe {
        Ok(Supports {
            fixed: read_array("supports->fixed", desc.fixed, desc.n_fixed.into())?,
            clamped: read_array("supports->clamped", desc.clamped, desc.n_clamped.into())?,
        })
    }
}

/// Makes a model of a mesh, a material (NULL = defaults) and supports (NULL = none: the shell floats free).
///
/// On success *model is a new handle, to be given to sw_model_destroy; on failure it is untouched. The descriptors and what
/// they point to are copied. Callable from any thread.
/// Errors: SW_ERROR_INVALID_DESC, SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_MESH, SW_ERROR_NUMERICAL when masses leave the
/// floating-point range, SW_ERROR_OUT_OF_MEMORY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_model_create(
    mesh: *const SwMeshDesc,
    material: *const SwMaterialDesc,
    supports: *const SwSupportDesc,
    model: *mut *mut SwModel,
) -> SwStatus {
    guard(|| {
        not_null("model", model)?;
        // SAFETY: the header's contract; NULL is excluded above.
        unsafe {
            let material = material_of(&read_descriptor_or_default("material", material)?)?;
            let supports = supports_of(&read_descriptor_or_default("supports", supports)?)?;
            let (positions, triangles) = read_mesh(mesh)?;
            let shell = Arc::new(Shell::new(Mesh::new(positions, &triangles)?, material, &supports)?);
            log_repairs(&shell.mesh);
            let content = ModelContent { shell, model: None };
            put(model, Box::into_raw(Box::new(SwModel(RwLock::new(content)))));
        }
        Ok(())
    })
}

fn log_repairs(mesh: &Mesh) {
    if mesh.n_reoriented > 0 {
        log(
            SW_LOG_WARNING,
            &format!("{} triangles were turned over to agree with their neighbours", mesh.n_reoriented),
        );
    }
    if mesh.n_unreferenced > 0 {
        log(SW_LOG_WARNING, &format!("{} vertices belong to no triangle and are carried along", mesh.n_unreferenced));
    }
}

/// Computes modes and modal rotations; `desc` may be NULL for defaults. May be called again with other options: states made
/// before keep the modes they were made with.
///
/// Blocks for seconds on large meshes. On failure or cancellation the model is as it was before. Not to be called at the
/// same time as any other function on this model.
/// Errors: SW_ERROR_INVALID_DESC, SW_ERROR_INVALID_ARGUMENT, SW_ERROR_CANCELLED, SW_ERROR_NUMERICAL, also when the shell does not
/// come to rest under sag_gravity or is about to buckle there, SW_ERROR_UNSUPPORTED for a reduced shell that can move freely or has
/// sag_gravity, and for what this library was built without; SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_model_precompute(model: *mut SwModel, desc: *const SwPrecomputeDesc) -> SwStatus {
    guard(|| {
        // SAFETY: the header's contract.
        let (handle, desc) = unsafe { (object("model", model)?, read_descriptor_or_default("desc", desc)?) };
        check_flags("desc->flags", desc.flags, SW_PRECOMPUTE_LINEAR)?;
        let known = [(0, Precision::F32), (SW_PRECISION_F32, Precision::F32), (SW_PRECISION_F64, Precision::F64)];
        let known: Vec<_> = known.into_iter().chain([(SW_PRECISION_I16, Precision::I16)]).collect();
        let precision = enumerant("desc->precision", desc.precision, &known)?;
        for (k, g) in desc.sag_gravity.iter().enumerate() {
            require_finite(format_args!("desc->sag_gravity[{k}]"), *g)?;
        }
        let linear = desc.flags & SW_PRECOMPUTE_LINEAR != 0;
        let budget = match (require_non_negative("desc->auto_error", desc.auto_error)?, desc.auto_operations) {
            (0.0, 0.0) => None,
            (error, operations) => {
                let most = require_non_negative("desc->auto_operations", operations)?;
                Some(Budget { error, operations: if most > 0.0 { most } else { f64::INFINITY } })
            }
        };
        let demand = match desc.tolerance {
            0.0 if budget.is_none() => None,
            tolerance => Some(Demand {
                tolerance,
                gravity: desc.demand_gravity.into(),
                acceleration: desc.demand_acceleration,
                // SAFETY: the host's list holds as many vertices as the descriptor says.
                handles: unsafe { read_array("desc->handles", desc.handles, desc.n_handles.into())? },
                distance: desc.handle_distance,
                axes: [SW_AXIS_X, SW_AXIS_Y, SW_AXIS_Z].map(|axis| desc.handle_axes & axis != 0),
                speed: desc.handle_speed,
                amplification: if desc.demand_amplification == 0.0 { 2.0 } else { desc.demand_amplification },
            }),
        };
        check_flags("desc->handle_axes", desc.handle_axes, SW_AXIS_X | SW_AXIS_Y | SW_AXIS_Z)?;
        check_flags("desc->reduced_flags", desc.reduced_flags, SW_REDUCED_UNTRAINED)?;
        let reduced = reduced::Options {
            fields: desc.reduced_fields as usize,
            elements: desc.reduced_elements as usize,
            poses: desc.reduced_poses as usize,
            gravity: require_non_negative("desc->reduced_gravity", desc.reduced_gravity)?,
            seconds: unless_zero("desc->reduced_seconds", desc.reduced_seconds)?,
            mode_searches: unless_zero("desc->reduced_mode_searches", desc.reduced_mode_searches)?,
        };
        let most = if desc.tolerance != 0.0 { MOST_MODES } else { Options::default().modes };
        let modes = if desc.modes == 0 { most } else { desc.modes as usize };
        let mut options = Options { demand, modes, precision, sag: desc.sag_gravity.into(), linear, reduced };
        let mut content = write("model", &handle.0)?;
        match (desc.reduced_flags & SW_REDUCED_UNTRAINED != 0, desc.reduced_poses) {
            (true, 0) => (),
            (true, poses) => {
                let message =
                    format!("desc->reduced_poses is {poses} and desc->reduced_flags has SW_REDUCED_UNTRAINED");
                return Err(Fault::argument(message));
            }
            (false, 0) => options.reduced.poses = reduced::default_poses(content.shell.mass.len()),
            (false, _) => (),
        }
        let mut progress = |phase: Phase, fraction: f64| call_progress(&desc, phase, fraction);
        let shell = content.shell.clone();
        let computed = match budget {
            Some(budget) => auto::precompute(shell, &options, budget, &mut progress)?,
            None => Model::precompute(shell, &options, &mut progress)?,
        };
        log_certificate(&computed);
        content.model = Some(Arc::new(computed));
        Ok(())
    })
}

/// A limit; 0 is none.
fn unless_zero(name: &str, limit: f64) -> crate::Result<f64> {
    require_non_negative(name, limit)?;
    Ok(if limit > 0.0 { limit } else { f64::INFINITY })
}

fn call_progress(desc: &SwPrecomputeDesc, phase: Phase, fraction: f64) -> crate::Result<()> {
    let Some(callback) = desc.progress else { return Ok(()) };
    // SAFETY: the host gave this callback with this user pointer.
    match as_the_host(|| unsafe { callback(desc.progress_user, phase as u32, fraction) }) {
        SW_PROGRESS_CONTINUE => Ok(()),
        SW_PROGRESS_CANCEL => Err(Error::new(ErrorKind::Cancelled, "the progress callback cancelled the precompute")),
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

/// Destroys a model. NULL does nothing. States made from it live on. A handle must not be destroyed twice or during a call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_model_destroy(model: *mut SwModel) {
    guard(|| {
        if !model.is_null() {
            // SAFETY: made by sw_model_create and not destroyed before.
            drop(unsafe { Box::from_raw(model) });
        }
        Ok(())
    });
}

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
    info.n_unknowns = shell.n_unknowns() as u32;
    (info.total_mass, info.total_area, info.size) = (shell.total_mass, shell.total_area, shell.mesh.size);
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
    if let Some(choice) = model.front.as_ref().map(|front| front.choice()) {
        (info.auto_method, info.auto_error) = (choice.method.number(), choice.error.min(f64::MAX));
    }
    if let Some(reduced) = &model.reduced {
        info.reduced_fields = (reduced.n() - model.modal.n_modes()) as u32;
        info.reduced_elements = reduced.samples.len() as u32;
        info.reduced_residual = reduced.fit;
    }
}

/// Counts, sizes, certificate and timings. `info` must be initialised by sw_model_info_init. Callable concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_BUSY during a precompute.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_model_info(model: *const SwModel, info: *mut SwModelInfo) -> SwStatus {
    guard(|| {
        // SAFETY: the header's contract.
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
        // SAFETY: the header's contract; NULL is excluded above.
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
        // SAFETY: the header's contract; NULL is excluded above.
        unsafe {
            let model = object("model", model)?.precomputed()?;
            let values: Vec<f64> = model.modal.frequencies().collect();
            copy_out("hertz", &values, hertz, capacity.into())?;
            put(count, values.len() as u32);
        }
        Ok(())
    })
}

/// Saves a precomputed model, so that sw_model_load gives it back without another precompute: about 24 bytes per vertex and
/// mode (48 with SW_PRECISION_F64, 12 with SW_PRECISION_I16) and 49 per vertex, or 73 with sag_gravity; 12 (24 with
/// SW_PRECISION_F64) more per vertex and mode or field of a reduced shell. Two calls: with `bytes` NULL and `capacity` 0 only *size
/// is written.
/// Nothing of a state is saved (sw_state_save). Callable concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_NOT_PRECOMPUTED, SW_ERROR_BUFFER_SIZE when capacity < *size,
/// SW_ERROR_UNSUPPORTED by a library without SW_FEATURE_SAVED_MODELS, SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_model_save(
    model: *const SwModel,
    bytes: *mut c_void,
    capacity: u64,
    size: *mut u64,
) -> SwStatus {
    guard(|| {
        not_null("size", size)?;
        // SAFETY: the header's contract; NULL is excluded above.
        unsafe {
            let model = object("model", model)?.precomputed()?;
            let needed = model.saved_size() as u64;
            if !asks_for_size("bytes", bytes, needed, capacity)? {
                copy_out("bytes", &model.save()?, bytes.cast(), capacity)?;
            }
            put(size, needed);
        }
        Ok(())
    })
}

/// Makes a precomputed model of what sw_model_save gave, in this or an older version of the library. On success *model is a
/// new handle, to be given to sw_model_destroy; on failure it is untouched. `bytes` (size) are read during the call only.
///
/// The model has the same bits as the one saved: steps, handles, equilibria and saved states of either go on with the other.
/// No eigenvalue search is done; the time goes into reading the bytes and checking the mesh. Safe on any bytes: they carry a
/// version, sizes and a checksum, and whatever they hold beyond that is checked, so that forged ones cannot do harm; that the
/// modes belong to the shell is not checked. Callable from any thread.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DATA, SW_ERROR_UNSUPPORTED by a library without SW_FEATURE_SAVED_MODELS or the
/// model's precision, SW_ERROR_OUT_OF_MEMORY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_model_load(bytes: *const c_void, size: u64, model: *mut *mut SwModel) -> SwStatus {
    guard(|| {
        not_null("model", model)?;
        not_null("bytes", bytes)?;
        // SAFETY: the header's contract; NULL is excluded above. No more is read than the first bytes announce.
        unsafe {
            let announced = file::announced_size(byte_slice("bytes", bytes, size.min(file::FRONT as u64))?)?;
            if announced != u128::from(size) {
                let message = format!("{size} bytes are not the {announced} of this saved model");
                return Err(Fault::new(SW_ERROR_INVALID_DATA, message));
            }
            let loaded = Model::load(byte_slice("bytes", bytes, size)?)?;
            let content = ModelContent { shell: loaded.shell.clone(), model: Some(Arc::new(loaded)) };
            put(model, Box::into_raw(Box::new(SwModel(RwLock::new(content)))));
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
        // SAFETY: the header's contract.
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

/// An output buffer with one row per vertex of the model.
pub(super) fn vertex_rows(
    model: &Model,
    out: *mut c_void,
    format: u32,
    components: usize,
    stride: u64,
    n_vertices: u32,
) -> Result<VectorRows, Fault> {
    check_vertex_count(model, n_vertices)?;
    VectorRows::checked("out", out, format, components, stride, n_vertices.into())
}

/// The host's arrays are only as long as it says: nothing is read or written when the number is wrong.
pub(super) fn check_vertex_count(model: &Model, n_vertices: u32) -> Result<(), Fault> {
    match model.shell.mesh.positions.len() {
        n if n == n_vertices as usize => Ok(()),
        n => Err(Fault::argument(format!("n_vertices is {n_vertices}, but the mesh has {n} vertices"))),
    }
}
