//! Colliders: solids that shells touch.

use super::guard::{guard, read};
use super::mesh::{SwMeshDesc, read_mesh};
use super::model::{SwModel, vertex_rows};
use super::output::{space_of, write_places};
use super::pointer::{VectorRows, byte_slice, check_flags, copy_out, enumerant, not_null, object, put, read_array};
use super::state::{SwState, reading, rotation, vector, writing};
use super::status::{Fault, SW_ERROR_INVALID_DATA, SwStatus};
use super::structs::{Output, Outputs, described, grows, read_descriptor};
use crate::Vec3;
use crate::collider::{GridOptions, Resolution, Solid, fit_capsule};
use crate::contact::{Contact, Obstacle, patches_near};
use crate::error::require_non_negative;
use crate::features::{Contact as Built, Feature, Proof};
use crate::support::Pose;
use std::ffi::c_void;
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_64;

/// The half-space z <= 0.
pub const SW_COLLIDER_PLANE: u32 = 1;
/// A ball about the origin: radius.
pub const SW_COLLIDER_SPHERE: u32 = 2;
/// All points within radius of the segment from -half_length to half_length along z.
pub const SW_COLLIDER_CAPSULE: u32 = 3;
/// A box about the origin: half_extents.
pub const SW_COLLIDER_BOX: u32 = 4;
/// The convex hull of mesh->positions; its triangles are not read.
pub const SW_COLLIDER_HULL: u32 = 5;
/// The inside of a closed mesh, or what is behind one of SW_COLLIDER_ONE_SIDED, prepared as signed distances on a grid.
pub const SW_COLLIDER_MESH: u32 = 6;

/// The same of a mesh whose vertices move: sw_state_deform_collider. Its distances are exact, by a search for each point.
pub const SW_COLLIDER_DEFORMING_MESH: u32 = 7;

/// In SwColliderDesc, of SW_COLLIDER_MESH and SW_COLLIDER_DEFORMING_MESH: the mesh may be open, such as a ground, a wall of one skin or a body with a neck
/// that is not closed. Its front is where its triangles run counterclockwise, and turned ones follow the most of their piece. It is solid behind by `depth`:
/// at places whose nearest point of the mesh is in front of them, no farther than that, and not on its rim. So the front is right however sharp the mesh is
/// bent, and what lies behind the solid at the start stays behind. A mesh that is closed and not inside out is what it is without the flag. Two parts
/// of one mesh of which one's back is within `depth` of the other's front should be colliders of their own.
pub const SW_COLLIDER_ONE_SIDED: u32 = 2;

/// In sw_state_move_collider and sw_state_deform_collider: the collider is there at once and has no velocity.
pub const SW_COLLIDER_TELEPORT: u32 = 1;

/// A solid in axes of its own, which sw_state_move_collider places. Every collider is kinematic: only the host moves it, and no shell pushes it.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwColliderDesc {
    /// Set by sw_collider_desc_init.
    pub struct_size: u32,
    /// SW_COLLIDER_.... Required.
    pub kind: u32,
    /// SW_COLLIDER_ONE_SIDED or 0.
    pub flags: u32,
    /// Must be 0.
    pub reserved: u32,
    /// Of a sphere or capsule, length, positive.
    pub radius: f64,
    /// Of a capsule, length, not negative.
    pub half_length: f64,
    /// Of a box, length, positive.
    pub half_extents: [f64; 3],
    /// Coefficient of Coulomb's friction, not negative; 0 = none. About 0.3 to 0.6 for cloth and leaves.
    pub friction: f64,
    /// The shell stays so far off the surface, length, not negative; such as half its own thickness.
    pub thickness: f64,
    /// Of SW_COLLIDER_HULL, SW_COLLIDER_MESH and SW_COLLIDER_DEFORMING_MESH, in the collider's axes; copied.
    pub mesh: *const SwMeshDesc,
    /// Of SW_COLLIDER_MESH: cells along the longest side of the mesh, 4 to 2000; 0 = 64. A cell is about the size of the finest feature.
    pub cells: u32,
    /// Must be 0.
    pub reserved2: u32,
    /// Of SW_COLLIDER_ONE_SIDED: how far behind its triangles the mesh is solid, length, from 1e-6 to 100 times its longest side, of SW_COLLIDER_MESH two
    /// cells or more. 0 = four cells, of SW_COLLIDER_DEFORMING_MESH a 16th of its longest side.
    pub depth: f64,
}

described!(SwColliderDesc, reserved2);

/// Where a collider is at the end of the next step.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwColliderPoseDesc {
    /// Set by sw_collider_pose_desc_init.
    pub struct_size: u32,
    /// SW_COLLIDER_TELEPORT or 0.
    pub flags: u32,
    /// World position of its origin.
    pub origin: [f64; 3],
    /// Row-major rotation matrix from its axes to the world's; all zero = identity.
    pub rotation: [f64; 9],
}

described!(SwColliderPoseDesc, rotation);

/// Where the shell touched a collider at the end of the last step. Output only.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwContact {
    /// A vertex three times, the ends of an edge and the second again, or the corners of a triangle.
    pub vertices: [u32; 3],
    /// Which of the state's colliders.
    pub collider: u32,
    /// Of the vertices: what touches is their mean by these.
    pub weights: [f64; 3],
    /// Where it is, world space.
    pub point: [f64; 3],
    /// Of the collider's surface, outward, of length 1.
    pub normal: [f64; 3],
    /// From the surface with its thickness; negative inside.
    pub gap: f64,
    /// On the shell, friction included, world axes.
    pub force: [f64; 3],
}

grows!(SwContact, force);

/// An immutable solid with its friction and thickness. Share it by any number of states and threads.
pub struct SwCollider {
    solid: Arc<Solid>,
    friction: f64,
    thickness: f64,
}

fn is_one_sided(desc: &SwColliderDesc) -> Result<bool, Fault> {
    let (kind, depth) = (desc.kind, desc.depth);
    let one_sided = desc.flags & SW_COLLIDER_ONE_SIDED != 0;
    if one_sided && ![SW_COLLIDER_MESH, SW_COLLIDER_DEFORMING_MESH].contains(&kind) {
        return Err(Fault::argument(format!(
            "desc->flags has SW_COLLIDER_ONE_SIDED, and desc->kind is {kind}: it goes with SW_COLLIDER_MESH and SW_COLLIDER_DEFORMING_MESH"
        )));
    }
    if !one_sided && depth != 0.0 {
        return Err(Fault::argument(format!("desc->depth is {depth:?}: it must be 0 without SW_COLLIDER_ONE_SIDED")));
    }
    Ok(one_sided)
}

unsafe fn solid_of(desc: &SwColliderDesc) -> Result<Solid, Fault> {
    check_flags("desc->flags", desc.flags, SW_COLLIDER_ONE_SIDED)?;
    check_flags("desc->reserved", desc.reserved, 0)?;
    check_flags("desc->reserved2", desc.reserved2, 0)?;
    let kinds = [
        SW_COLLIDER_PLANE,
        SW_COLLIDER_SPHERE,
        SW_COLLIDER_CAPSULE,
        SW_COLLIDER_BOX,
        SW_COLLIDER_HULL,
        SW_COLLIDER_MESH,
        SW_COLLIDER_DEFORMING_MESH,
    ];
    let kinds = kinds.map(|kind| (kind, kind));
    let kind = enumerant("desc->kind", desc.kind, &kinds)?;
    let one_sided = is_one_sided(desc)?;
    Ok(match kind {
        SW_COLLIDER_SPHERE => Solid::sphere(desc.radius)?,
        SW_COLLIDER_CAPSULE => Solid::capsule(desc.half_length, desc.radius)?,
        SW_COLLIDER_BOX => Solid::cuboid(Vec3::from(desc.half_extents))?,
        SW_COLLIDER_HULL => {
            // SAFETY: `read_descriptor` refuses NULL and a wrong size; the host passes a live descriptor.
            let mesh = unsafe { read_descriptor("desc->mesh", desc.mesh)? };
            let (n, format, stride) = (mesh.n_vertices, mesh.position_format, mesh.position_stride);
            let rows = VectorRows::checked("desc->mesh->positions", mesh.positions, format, 3, stride, n.into())?;
            // SAFETY: the host's buffer holds n rows.
            Solid::hull(&(0..n as usize).map(|i| unsafe { rows.read(i) }).collect::<Vec<_>>())?
        }
        SW_COLLIDER_MESH => {
            // SAFETY: `read_mesh` refuses NULL and a wrong size; the host's buffers hold as many rows as the descriptor says.
            let (positions, triangles) = unsafe { read_mesh(desc.mesh)? };
            let cells = if desc.cells == 0 {
                GridOptions::default().resolution
            } else {
                Resolution::Cells(desc.cells as usize)
            };
            let options = GridOptions { resolution: cells, margin: 2.0 * desc.thickness, ..GridOptions::default() };
            if one_sided {
                Solid::one_sided_grid(&positions, &triangles, desc.depth, &options)?
            } else {
                Solid::grid(&positions, &triangles, &options)?
            }
        }
        SW_COLLIDER_DEFORMING_MESH => {
            // SAFETY: as of SW_COLLIDER_MESH.
            let (positions, triangles) = unsafe { read_mesh(desc.mesh)? };
            if one_sided {
                Solid::one_sided_moving_mesh(&positions, &positions, &triangles, desc.depth)?
            } else {
                Solid::moving_mesh(&positions, &positions, &triangles)?
            }
        }
        _ => Solid::plane(),
    })
}

/// Makes a collider. On success *collider is a new object, to be given to sw_collider_destroy; on failure it is untouched.
/// A mesh takes up to seconds, and about a megabyte at 64 cells. Triangles that are turned against their neighbours are taken as meant.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also on a size that is not from 1e-100 to 1e100, on SW_COLLIDER_ONE_SIDED of another kind and on a depth beyond its range;
/// SW_ERROR_INVALID_DESC; SW_ERROR_INVALID_MESH on a mesh that is open or inside out without SW_COLLIDER_ONE_SIDED, or thinner than its cells, with the place.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_collider_create(desc: *const SwColliderDesc, collider: *mut *mut SwCollider) -> SwStatus {
    guard(|| {
        not_null("collider", collider)?;
        // SAFETY: `read_descriptor` refuses NULL and a wrong size; the host passes a live descriptor.
        let desc = unsafe { read_descriptor("desc", desc)? };
        let friction = require_non_negative("desc->friction", desc.friction)?;
        let thickness = require_non_negative("desc->thickness", desc.thickness)?;
        // SAFETY: what the descriptor points to is as long as it says.
        let made = Box::new(SwCollider { solid: Arc::new(unsafe { solid_of(&desc)? }), friction, thickness });
        // SAFETY: not NULL; the host passes a place for the output.
        unsafe { put(collider, Box::into_raw(made)) };
        Ok(())
    })
}

/// Friction and thickness behind the solid's bytes, and a checksum of all.
const SAVED_TAIL: usize = 24;

/// Saves a collider, so that sw_collider_load gives it back without preparing its mesh again. Two calls: with `bytes` NULL and `capacity` 0
/// only *size is written. Callable concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUFFER_SIZE when capacity < *size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_collider_save(
    collider: *const SwCollider,
    bytes: *mut c_void,
    capacity: u64,
    size: *mut u64,
) -> SwStatus {
    guard(|| {
        // SAFETY: `object` refuses NULL; the host passes a live collider, and room for `capacity` bytes; `size` is not NULL.
        unsafe {
            let collider = object("collider", collider)?;
            not_null("size", size)?;
            let mut saved = collider.solid.save();
            saved.extend(collider.friction.to_le_bytes());
            saved.extend(collider.thickness.to_le_bytes());
            saved.extend(xxh3_64(&saved).to_le_bytes());
            copy_out("bytes", &saved, bytes.cast(), capacity)?;
            put(size, saved.len() as u64);
        }
        Ok(())
    })
}

/// Makes a collider of what sw_collider_save gave. Safe on any bytes. On success *collider is a new object, to be given to
/// sw_collider_destroy; on failure it is untouched.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DATA.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_collider_load(bytes: *const c_void, size: u64, collider: *mut *mut SwCollider) -> SwStatus {
    guard(|| {
        not_null("collider", collider)?;
        // SAFETY: `byte_slice` refuses NULL; the host passes `size` bytes.
        let bytes = unsafe { byte_slice("bytes", bytes, size)? };
        let number = |at: usize| u64::from_le_bytes(std::array::from_fn(|i| bytes[at + i]));
        let Some(solid) = bytes.len().checked_sub(SAVED_TAIL) else {
            return Err(Fault::new(SW_ERROR_INVALID_DATA, format!("these {size} bytes are not a saved collider")));
        };
        let [friction, thickness] = [number(solid), number(solid + 8)].map(f64::from_bits);
        let whole = xxh3_64(&bytes[..solid + 16]) == number(solid + 16);
        if !whole || ![friction, thickness].iter().all(|x| x.is_finite() && *x >= 0.0) {
            return Err(Fault::new(
                SW_ERROR_INVALID_DATA,
                "the saved collider is damaged: its checksum does not match",
            ));
        }
        let solid = Arc::new(Solid::load(&bytes[..solid])?);
        // SAFETY: not NULL; the host passes a place for the output.
        unsafe { put(collider, Box::into_raw(Box::new(SwCollider { solid, friction, thickness }))) };
        Ok(())
    })
}

/// Destroys a collider. NULL does nothing. States that have it go on with it. An object must not be destroyed twice or during a call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_collider_destroy(collider: *mut SwCollider) {
    guard(|| {
        if !collider.is_null() {
            // SAFETY: made by sw_collider_create and not destroyed before.
            drop(unsafe { Box::from_raw(collider) });
        }
        Ok(())
    });
}

/// Replaces the colliders of a state; count 0 removes all. Each is in the world's axes until sw_state_move_collider, and is known by its
/// place in the list. One that was in the same place before stays where it is. The list is copied; a collider may come more than once.
///
/// Every method keeps its shell out of colliders: a step is taken in rounds, until no gap of a contact and no penetration is beyond 2e-5 of
/// the mesh's size, at most twelve. So a step among colliders costs as many steps as it has rounds and a reading of the positions each; one
/// that touches nothing costs one round. Vertices are looked at, and points between them where a collider is smaller than an edge. Vertices that a
/// support holds pass through. A vertex that crosses a collider within a step, however fast, is stopped where it entered. One that begins
/// a step inside comes out by at most the mesh's size a second. What a method's modes or fields cannot follow stays inside, and
/// sw_state_report tells how deep. An explicit step feels a spring of its own vertex's mass instead.
/// Friction is Coulomb's; an equilibrium has none.
/// Contacts are cloned and saved with a state; colliders are cloned, survive its reset and loading, but are not saved.
/// Allocates; steps of modal methods then do not.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also above 65536 colliders; SW_ERROR_UNSUPPORTED by a library without SW_FEATURE_CONTACT, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_set_colliders(
    state: *mut SwState,
    colliders: *const *const SwCollider,
    count: u32,
) -> SwStatus {
    // SAFETY: `writing` refuses a NULL state; the host's list holds `count` live colliders, none of which may be NULL.
    unsafe {
        writing(state, |state| {
            if count as usize > crate::state::MOST_OBSTACLES {
                let most = crate::state::MOST_OBSTACLES;
                return Err(Fault::argument(format!("count is {count}: at most {most} colliders")));
            }
            let mut obstacles = Vec::with_capacity(count as usize);
            for (i, collider) in read_array("colliders", colliders, count.into())?.into_iter().enumerate() {
                let SwCollider { solid, friction, thickness } = object(&format!("colliders[{i}]"), collider)?;
                let still = Obstacle::new(solid.clone(), Pose::identity());
                let still = still.with_friction(*friction).with_thickness(*thickness);
                obstacles.push(Obstacle { placed: false, ..still });
            }
            Ok(state.set_obstacles(obstacles)?)
        })
    }
}

/// Sets where a collider is at the end of the next step; it gets there evenly, and friction feels its velocity. It stays where it is when
/// not called. The first call for a collider simply places it. sw_state_equilibrium has it there, at rest.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also where the state has no such collider; SW_ERROR_INVALID_DESC, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_move_collider(
    state: *mut SwState,
    collider: u32,
    desc: *const SwColliderPoseDesc,
) -> SwStatus {
    // SAFETY: `writing` refuses a NULL state, `read_descriptor` a NULL or uninitialised descriptor; the host passes live ones.
    unsafe {
        writing(state, |state| {
            let desc = read_descriptor("desc", desc)?;
            check_flags("desc->flags", desc.flags, SW_COLLIDER_TELEPORT)?;
            let pose = Pose { origin: vector("origin", &desc.origin)?, rotation: rotation(&desc.rotation)? };
            Ok(state.move_obstacle(collider as usize, pose, desc.flags & SW_COLLIDER_TELEPORT != 0)?)
        })
    }
}

/// Sets the shape that a collider of SW_COLLIDER_DEFORMING_MESH has at the end of the next step: positions (n_vertices x 3) of its vertices in their order,
/// in its axes, as SW_FORMAT_..., `stride` bytes apart (0 = packed). The triangles stay. What lies on it is taken along, and friction feels how it moves. It
/// keeps the shape when not called. With SW_COLLIDER_TELEPORT it has it at once. The state takes a copy for its own the first time, so that states may share the
/// collider; that copy is dropped by sw_state_set_colliders. The mesh should not meet itself.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also where the state has no such collider or it has another number of vertices; SW_ERROR_UNSUPPORTED of
/// other kinds; SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_deform_collider(
    state: *mut SwState,
    collider: u32,
    flags: u32,
    format: u32,
    positions: *const c_void,
    stride: u64,
    n_vertices: u32,
) -> SwStatus {
    // SAFETY: `writing` refuses a NULL state; the host's array has n_vertices rows.
    unsafe {
        writing(state, |state| {
            check_flags("flags", flags, SW_COLLIDER_TELEPORT)?;
            let rows = VectorRows::checked("positions", positions, format, 3, stride, n_vertices.into())?;
            let mut x = crate::error::reserve("the collider's positions", n_vertices as usize)?;
            x.extend((0..n_vertices as usize).map(|i| rows.read(i)));
            Ok(state.deform_obstacle(collider as usize, &x, flags & SW_COLLIDER_TELEPORT != 0)?)
        })
    }
}

/// A capsule about points. Output only.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwCapsuleFit {
    /// Set by sw_capsule_fit_init.
    pub struct_size: u32,
    /// Always 0.
    pub reserved: u32,
    /// Of a SwColliderDesc of SW_COLLIDER_CAPSULE.
    pub radius: f64,
    /// The same.
    pub half_length: f64,
    /// Of its SwColliderPoseDesc.
    pub origin: [f64; 3],
    /// The same.
    pub rotation: [f64; 9],
}

described!(SwCapsuleFit, rotation);

/// Fits a small capsule about points, such as the vertices of a bone: (n_points x 3) as SW_FORMAT_..., `stride` bytes apart (0 = packed). All are inside.
/// `fit` must be initialised by sw_capsule_fit_init.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also where there is no point, where all are at one place or one is not within 1e100; SW_ERROR_INVALID_DESC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_fit_capsule(
    format: u32,
    points: *const c_void,
    stride: u64,
    n_points: u32,
    fit: *mut SwCapsuleFit,
) -> SwStatus {
    guard(|| {
        // SAFETY: NULL is refused; the host passes an initialised struct, whose size is checked, and n_points rows.
        unsafe {
            let place = Output::checked("fit", fit)?;
            let rows = VectorRows::checked("points", points, format, 3, stride, n_points.into())?;
            let points: Vec<Vec3> = (0..n_points as usize).map(|i| rows.read(i)).collect();
            let mut out: SwCapsuleFit = super::structs::Described::initial();
            let (pose, half_length, radius) = fit_capsule(&points)?;
            (out.half_length, out.radius) = (half_length, radius);
            let matrix = pose.rotation.to_rotation_matrix();
            out.origin = pose.origin.into();
            out.rotation = std::array::from_fn(|i| matrix[(i / 3, i % 3)]);
            place.write(out);
        }
        Ok(())
    })
}

/// Finds where a shell is likely to be touched: vertices for contact_patches of SwPrecomputeDesc, before the precompute or after. Of those that move and
/// rest no farther than `distance` from a collider's surface with its thickness, first the nearest, then each time the one farthest from those before, at most
/// `capacity`. *count is how many there are; fewer where no others are near. Colliders (n_colliders) stand where poses (n_colliders x 12) say: an origin, then
/// the row-major rotation matrix from the collider's axes, all zero = identity. NULL = all at the origin. The model's own axes are the world's. One that moves may
/// come several times, with a pose each.
/// Callable concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also where `distance` is negative or a pose is no rotation; SW_ERROR_UNSUPPORTED by a library without
/// SW_FEATURE_CONTACT, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
#[allow(clippy::too_many_arguments)] // each has its own meaning
pub unsafe extern "C" fn sw_model_patches_near(
    model: *const SwModel,
    colliders: *const *const SwCollider,
    poses: *const f64,
    n_colliders: u32,
    distance: f64,
    vertices: *mut u32,
    capacity: u32,
    count: *mut u32,
) -> SwStatus {
    guard(|| {
        // SAFETY: NULL is refused; the host passes a live model, n_colliders live colliders with 12 numbers each or NULL, and room for `capacity`
        // vertices.
        unsafe {
            let shell = read("model", &object("model", model)?.0)?.shell_to_bind();
            not_null("count", count)?;
            let _proof: Built = Proof::of(Feature::Contact)?;
            let distance = require_non_negative("distance", distance)?;
            let numbers = if poses.is_null() { 0 } else { 12 * u64::from(n_colliders) };
            let poses: Vec<f64> = read_array("poses", poses, numbers)?;
            let mut obstacles = Vec::with_capacity(n_colliders as usize);
            for (i, collider) in read_array("colliders", colliders, n_colliders.into())?.into_iter().enumerate() {
                let SwCollider { solid, thickness, .. } = object(&format!("colliders[{i}]"), collider)?;
                let named = |fault: Fault| Fault {
                    message: fault.message.replacen("desc->", &format!("poses[{i}]: "), 1),
                    ..fault
                };
                let pose = poses.get(12 * i..12 * i + 12).map_or(Ok(Pose::identity()), pose_of).map_err(named)?;
                obstacles.push(Obstacle::new(solid.clone(), pose).with_thickness(*thickness));
            }
            let found = patches_near(&shell, &obstacles, distance, capacity as usize);
            copy_out("vertices", &found, vertices, capacity.into())?;
            put(count, found.len() as u32);
        }
        Ok(())
    })
}

/// Of an origin and a rotation matrix.
fn pose_of(numbers: &[f64]) -> Result<Pose, Fault> {
    Ok(Pose {
        origin: vector("origin", &std::array::from_fn(|i| numbers[i]))?,
        rotation: rotation(&std::array::from_fn(|i| numbers[3 + i]))?,
    })
}

/// Positions for the eye (n_vertices x 3): as sw_state_positions, but what is inside a collider is pushed out of it, and its neighbours follow smoothly.
/// Cosmetic: the motion does not know, and forces and contacts are those of sw_state_positions. Vertices that a support holds stay. *deepest, which may be NULL, is
/// how deep a vertex still is: 0 but between colliders that leave no room. Allocates. Callable concurrently.
/// Errors: as sw_state_positions; SW_ERROR_OUT_OF_MEMORY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_positions_outside(
    state: *const SwState,
    space: u32,
    format: u32,
    out: *mut c_void,
    stride: u64,
    n_vertices: u32,
    deepest: *mut f64,
) -> SwStatus {
    // SAFETY: `reading` refuses NULL; the host passes a live state, a buffer of n_vertices rows, which is checked, and a place for *deepest or NULL.
    unsafe {
        reading(state, |state| {
            let rows = vertex_rows(state.model(), out, format, 3, stride, n_vertices)?;
            let space = space_of(space)?;
            state.check_range(space, rows.largest_coordinate())?;
            let (x, left) = state.positions_outside(space)?;
            write_places(&rows, &x, "pushed")?;
            if !deepest.is_null() {
                put(deepest, left);
            }
            Ok(())
        })
    }
}

fn contact_of(contact: &Contact) -> SwContact {
    SwContact {
        vertices: contact.vertices,
        collider: contact.obstacle,
        weights: contact.weights,
        point: contact.point.into(),
        normal: contact.normal.into(),
        gap: contact.gap,
        force: contact.force.into(),
    }
}

/// Where the shell touched at the end of the last step or equilibrium. `element_size` is sizeof(SwContact). Two calls: with `contacts`
/// NULL and `capacity` 0 only *count is written. Callable concurrently.
/// Errors: SW_ERROR_INVALID_DESC, SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUFFER_SIZE when capacity < *count, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_contacts(
    state: *const SwState,
    contacts: *mut SwContact,
    element_size: u32,
    capacity: u32,
    count: *mut u32,
) -> SwStatus {
    // SAFETY: `reading` refuses a NULL state; `count` is not NULL, and the host's array has room for `capacity` elements.
    unsafe {
        reading(state, |state| {
            not_null("count", count)?;
            let out = Outputs::checked("contacts", contacts, element_size)?;
            let all: Vec<SwContact> = state.contacts().map(|contact| contact_of(&contact)).collect();
            out.copy_out("contacts", &all, capacity)?;
            put(count, all.len() as u32);
            Ok(())
        })
    }
}
