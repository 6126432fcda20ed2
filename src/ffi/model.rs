//! Models: the shell, and after precompute its modes.

pub use super::info::*;
pub use super::material::*;
pub use super::precompute::*;

use super::constraint::{SW_AXIS_X, SW_AXIS_Y, SW_AXIS_Z};
use super::guard::{guard, read};
use super::log::{SW_LOG_WARNING, log};
use super::mesh::{SwMeshDesc, read_mesh};
use super::pointer::{VectorRows, asks_for_size, byte_slice, check_flags, copy_out, not_null, object, put, read_array};
use super::status::{Fault, SW_ERROR_INVALID_DATA, SW_ERROR_NOT_PRECOMPUTED, SwStatus};
use super::structs::{described, read_descriptor_or_default};
use crate::energy::Thick;
use crate::model::Model;
use crate::model::file;
use crate::model::weight::OwnWeight;
use crate::shell::Make;
use crate::{Mesh, Shell, Supports, Vec3};
use std::ffi::c_void;
use std::sync::{Arc, RwLock};

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
    /// Clamped vertices (n_clamped): fixed together with all their edge neighbours, which holds the slope as well. With SW_ENERGY_KOITER
    /// the slope is held exactly at edges between two of them, and their neighbours stay free; only those on no such edge need these.
    pub clamped: *const u32,
    /// Length of fixed.
    pub n_fixed: u32,
    /// Length of clamped.
    pub n_clamped: u32,
    /// Vertices held along some axes of the support frame only (n_axis_vertices): on a symmetry plane, a diaphragm, a rail. What is held stays
    /// exactly at zero in every mode, field, step and answer. Those that are fixed or clamped besides are fixed.
    pub axis_vertices: *const u32,
    /// Which axes each is held along: SW_AXIS_X, SW_AXIS_Y and SW_AXIS_Z or'ed (n_axis_vertices), or NULL.
    pub axes: *const u8,
    /// A direction that each is held along besides, of any length, zero for none (n_axis_vertices x 3), or NULL.
    pub axis_directions: *const f64,
    /// Length of axis_vertices.
    pub n_axis_vertices: u32,
    /// Must be 0.
    pub reserved: u32,
    /// Which of the axes are normals of planes of symmetry: SW_AXIS_X, SW_AXIS_Y and SW_AXIS_Z or'ed, and SW_AXIS_DIRECTION for that of axis_directions
    /// (n_axis_vertices), or NULL. The vertex is held along them, as by axes. Boundary edges between two vertices on the same plane also keep their
    /// slope, as if the shell went on beyond as its mirror image: half a shell then bends as the whole. Each such vertex must be on such an edge.
    pub symmetric_axes: *const u8,
}

/// Of SwSupportDesc::symmetric_axes: the direction in axis_directions.
pub const SW_AXIS_DIRECTION: u32 = 8;

described!(SwSupportDesc, n_clamped);

pub(super) struct ModelContent {
    pub(super) shell: Arc<Shell>,
    pub(super) model: Option<Arc<Model>>,
    /// Metres in the mesh's unit, if told.
    pub(super) unit: Option<f64>,
    /// What follows from that with a model that was precomputed.
    pub(super) weight: Option<OwnWeight>,
    /// Whether its stiffness was fitted to an asset's.
    pub(super) calibrated: bool,
}

impl ModelContent {
    /// Of the precomputed model, or before that the shell.
    pub(super) fn shell_to_bind(&self) -> Arc<Shell> {
        self.model.as_ref().map_or(&self.shell, |model| &model.shell).clone()
    }
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

unsafe fn supports_of(desc: &SwSupportDesc) -> Result<Supports, Fault> {
    check_flags("supports->flags", desc.flags, 0)?;
    // SAFETY: the host's lists hold as many vertices as the descriptor says.
    unsafe {
        Ok(Supports {
            fixed: read_array("supports->fixed", desc.fixed, desc.n_fixed.into())?,
            clamped: read_array("supports->clamped", desc.clamped, desc.n_clamped.into())?,
            ..held_along(desc)?
        })
    }
}

/// The axes and directions that vertices are held along, and those of them that are normals of planes of symmetry.
unsafe fn held_along(desc: &SwSupportDesc) -> Result<Supports, Fault> {
    let count = u64::from(desc.n_axis_vertices);
    if desc.reserved != 0 {
        return Err(Fault::argument(format!("supports->reserved is {}: it must be 0", desc.reserved)));
    }
    if count > 0 && desc.axes.is_null() && desc.axis_directions.is_null() && desc.symmetric_axes.is_null() {
        let message = format!(
            "supports->axes, supports->axis_directions and supports->symmetric_axes are NULL, but n_axis_vertices is {count}"
        );
        return Err(Fault::argument(message));
    }
    // SAFETY: the host's lists hold as many vertices, or three numbers of each, as the descriptor says.
    let (vertices, axes, directions, symmetric) = unsafe {
        let vertices: Vec<u32> = read_array("supports->axis_vertices", desc.axis_vertices, count)?;
        let some = |null: bool| if null { 0 } else { count };
        let axes: Vec<u8> = read_array("supports->axes", desc.axes, some(desc.axes.is_null()))?;
        let size = 3 * some(desc.axis_directions.is_null());
        let directions: Vec<f64> = read_array("supports->axis_directions", desc.axis_directions, size)?;
        let symmetric: Vec<u8> =
            read_array("supports->symmetric_axes", desc.symmetric_axes, some(desc.symmetric_axes.is_null()))?;
        (vertices, axes, directions, symmetric)
    };
    let mut held = Supports::default();
    for (i, v) in vertices.iter().enumerate() {
        let bits = axes.get(i).map_or(0, |bits| u32::from(*bits));
        if bits & !(SW_AXIS_X | SW_AXIS_Y | SW_AXIS_Z) != 0 {
            return Err(Fault::argument(format!("supports->axes[{i}] is {bits}: only SW_AXIS_X, _Y and _Z are known")));
        }
        let mirrored = symmetric.get(i).map_or(0, |bits| u32::from(*bits));
        if mirrored & !(SW_AXIS_X | SW_AXIS_Y | SW_AXIS_Z | SW_AXIS_DIRECTION) != 0 {
            let message = format!(
                "supports->symmetric_axes[{i}] is {mirrored}: only SW_AXIS_X, _Y and _Z and SW_AXIS_DIRECTION are known"
            );
            return Err(Fault::argument(message));
        }
        let each = |bits: u32| (0..3).filter(move |c| bits >> c & 1 == 1).map(|c| (*v, Vec3::ith(c, 1.0)));
        held.along.extend(each(bits & !mirrored));
        held.symmetric.extend(each(mirrored));
        let direction = directions.get(3 * i..3 * i + 3).map_or(Vec3::zeros(), Vec3::from_column_slice);
        let list = if mirrored & SW_AXIS_DIRECTION == 0 { &mut held.along } else { &mut held.symmetric };
        if direction != Vec3::zeros() {
            list.push((*v, direction));
        } else if mirrored & SW_AXIS_DIRECTION != 0 {
            let message = format!(
                "supports->symmetric_axes[{i}] has SW_AXIS_DIRECTION, but vertex {v} has no direction in axis_directions"
            );
            return Err(Fault::argument(message));
        }
    }
    Ok(held)
}

/// Makes a model of a mesh, a material (NULL = defaults) and supports (NULL = none: the shell floats free).
///
/// On success *model is a new object, to be given to sw_model_destroy; on failure it is untouched. The descriptors and what
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
        // SAFETY: `model` is not NULL; descriptors are NULL or have their struct_size, and what they point to is as long as they say.
        unsafe {
            let material = read_descriptor_or_default("material", material)?;
            let made_of = material;
            let unit = unit_of(&made_of)?;
            let (material, maps, creases) = (material_of(&made_of)?, maps_of(&made_of)?, creases_of(&made_of)?);
            let supports = supports_of(&read_descriptor_or_default("supports", supports)?)?;
            let (positions, triangles) = read_mesh(mesh)?;
            let rest_shape = rest_shape_of(&made_of, positions.len())?;
            let (rest_lengths, fibres) = (rest_lengths_of(&made_of)?, fibres_of(&made_of)?);
            let (ties, tie_distance) = (ties_of(&made_of)?, made_of.tie_distance);
            let make =
                Make { maps, creases, rest_shape, rest_lengths, fibres, ties, tie_distance, ..Make::of(material) };
            let shell = Arc::new(Shell::made(Mesh::new(positions, &triangles)?, make, &supports)?);
            log_repairs(&shell.mesh);
            if shell.material.discrete_shells().is_some_and(|material| material.k_length == 0.0) {
                log(SW_LOG_WARNING, "material->k_length is 0, so that no edge resists stretching");
            }
            if let Some(Thick { count, triangle, part }) = shell.thick() {
                let message = format!(
                    "the sheet is thicker than a tenth of its radius of curvature at {count} triangles, most at triangle {triangle}, where it is {part:.2} of it: \
                    thin-shell theory holds below a tenth, and a sharp fold should be a crease"
                );
                log(SW_LOG_WARNING, &message);
            }
            if let Some(thickness) = shell.as_thick_as_wide() {
                let (size, part) = (shell.mesh.size, thickness / shell.mesh.size);
                let message = format!(
                    "the sheet is {thickness:?} thick, {part:.2} of the mesh's size of {size:.3e}: thin-shell theory holds below a tenth. \
                    Is thickness in the mesh's unit, and not exchanged for poisson?"
                );
                log(SW_LOG_WARNING, &message);
            }
            let content = ModelContent { shell, model: None, unit, weight: None, calibrated: false };
            put(model, Box::into_raw(Box::new(SwModel(RwLock::new(content)))));
        }
        Ok(())
    })
}

/// Sizes from the origin from which a mesh is warned of. At 3e4 rounding leaves 5e-4 of a card's load, and at 3e6 a training finds nothing.
const FAR: f64 = 1e4;

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
    if mesh.reach > FAR * mesh.size {
        let message = format!(
            "the mesh is {:.1e} of its sizes from the origin, so that its shape is rounded to {:.0e} of its size: put it near the origin, \
             and its frame where it is",
            mesh.reach / mesh.size,
            f64::EPSILON * mesh.reach / mesh.size
        );
        log(SW_LOG_WARNING, &message);
    }
}

/// Destroys a model. NULL does nothing. States made from it live on. An object must not be destroyed twice or during a call.
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

/// Saves a precomputed model, so that sw_model_load gives it back without another precompute: about 24 bytes per vertex and
/// mode (48 with SW_PRECISION_F64, 12 with SW_PRECISION_I16) and 49 per vertex, or 73 with sag_gravity; 12 (24 with
/// SW_PRECISION_F64) more per vertex and mode or field of a reduced shell. Two calls: with `bytes` NULL and `capacity` 0 only *size
/// is written.
/// Nothing of a state is saved (sw_state_save), and no time: two precomputes of the same input on one machine save the same bytes.
/// Callable concurrently.
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
        // SAFETY: `object` refuses NULL; the host passes a live model, and room for `capacity` bytes; `size` is not NULL.
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
/// new object, to be given to sw_model_destroy; on failure it is untouched. `bytes` (size) are read during the call only.
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
        // SAFETY: neither pointer is NULL; the host passes `size` bytes and a place for the model. No more is read than the first bytes announce.
        unsafe {
            let announced = file::announced_size(byte_slice("bytes", bytes, size.min(file::FRONT as u64))?)?;
            if announced != u128::from(size) {
                let message = format!("{size} bytes are not the {announced} of this saved model");
                return Err(Fault::new(SW_ERROR_INVALID_DATA, message));
            }
            let loaded = Model::load(byte_slice("bytes", bytes, size)?)?;
            let content = ModelContent {
                shell: loaded.shell.clone(),
                model: Some(Arc::new(loaded)),
                unit: None,
                weight: None,
                calibrated: false,
            };
            put(model, Box::into_raw(Box::new(SwModel(RwLock::new(content)))));
        }
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
