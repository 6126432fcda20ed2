//! Points that follow a shell.

use super::certify::{MOST_STEPS, SW_STEPS_AUTO, steps_shown};
use super::guard::{guard, read};
use super::model::SwModel;
use super::output::space_of;
use super::pointer::{VectorRows, byte_slice, check_flags, copy_out, not_null, object, put};
use super::state::{SwState, reading};
use super::status::{Fault, SW_ERROR_NUMERICAL, SW_ERROR_UNSUPPORTED, SwStatus};
use super::structs::{Output, described, read_descriptor};
use crate::Vec3;
use crate::binding::{Binding, Points, Pose};
use crate::error::require_non_negative;
use crate::state::{Outside, Outward, Shown, State};
use crate::threads::for_each;
use std::ffi::c_void;
use std::ops::Range;

/// Points to be bound to a shell's mesh: the vertices of another mesh that is drawn, or any other points.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwBindingDesc {
    /// Set by sw_binding_desc_init.
    pub struct_size: u32,
    /// Must be 0.
    pub flags: u32,
    /// SW_FORMAT_... of all three arrays.
    pub format: u32,
    /// Length of each array given. At least 1.
    pub n_points: u32,
    /// Where the points are while the mesh is as sw_model_create was given it, in its axes (n_points x 3).
    pub points: *const c_void,
    /// Bytes from point to point; 0 = packed.
    pub point_stride: u64,
    /// Normals there (n_points x 3), of any length but 0. NULL: none can be read.
    pub normals: *const c_void,
    /// Bytes from normal to normal; 0 = packed.
    pub normal_stride: u64,
    /// Tangents there (n_points x 3); with normals, the part across these counts. NULL: none can be read.
    pub tangents: *const c_void,
    /// Bytes from tangent to tangent; 0 = packed.
    pub tangent_stride: u64,
    /// A point further from the mesh is refused; 0 = any up to a million sizes of the mesh.
    pub max_distance: f64,
}

described!(SwBindingDesc, max_distance);

/// What a binding has.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwBindingInfo {
    /// Set by sw_binding_info_init.
    pub struct_size: u32,
    /// Number of points.
    pub n_points: u32,
    /// 1 if it was made with normals.
    pub has_normals: u32,
    /// 1 if it was made with tangents.
    pub has_tangents: u32,
    /// Of the point furthest from the mesh, its distance.
    pub furthest_distance: f64,
    /// Which point that is.
    pub furthest_point: u32,
    /// Always 0.
    pub reserved: u32,
    /// Memory that it holds.
    pub bytes: u64,
}

described!(SwBindingInfo, bytes);

/// Which points to read, and where their values go. NULL arrays are left out.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwBoundPointsDesc {
    /// Set by sw_bound_points_desc_init.
    pub struct_size: u32,
    /// SW_SPACE_....
    pub space: u32,
    /// SW_FORMAT_... of all arrays.
    pub format: u32,
    /// SW_BOUND_OUTSIDE or 0.
    pub flags: u32,
    /// The first point to read.
    pub first: u32,
    /// So many points; 0 = all from `first` on.
    pub count: u32,
    /// Where they are (count x 3).
    pub positions: *mut c_void,
    /// Bytes from position to position; 0 = packed.
    pub position_stride: u64,
    /// Unit normals of what is drawn (count x 3).
    pub normals: *mut c_void,
    /// Bytes from normal to normal; 0 = packed.
    pub normal_stride: u64,
    /// Unit tangents (count x 3).
    pub tangents: *mut c_void,
    /// Bytes from tangent to tangent; 0 = packed.
    pub tangent_stride: u64,
    /// Velocities, length unit / s, for motion blur (count x 3).
    pub velocities: *mut c_void,
    /// Bytes from velocity to velocity; 0 = packed.
    pub velocity_stride: u64,
    /// Newton steps of the full nonlinear shell, 0 to 100, or SW_STEPS_AUTO: points follow sw_state_positions_corrected. Not with SW_BOUND_OUTSIDE,
    /// beside which SW_STEPS_AUTO is 0.
    pub correction_steps: u32,
    /// Must be 0.
    pub reserved: u32,
    /// With SW_BOUND_OUTSIDE, how deep the deepest of the points read still is: 0 but between colliders that leave no room. NULL: not told.
    pub deepest: *mut f64,
}

described!(SwBoundPointsDesc, velocity_stride);

/// For the eye: points follow sw_state_positions_outside, and those that are inside a collider yet, such as points off the surface, leave it the shortest way.
pub const SW_BOUND_OUTSIDE: u32 = 1;

/// Points bound to a mesh. Immutable. Share it by any number of states and threads.
pub struct SwBinding(Binding);

/// The vectors of one of the host's arrays, or none.
unsafe fn vectors(
    name: &str,
    desc: &SwBindingDesc,
    base: *const c_void,
    stride: u64,
) -> Result<Option<Vec<Vec3>>, Fault> {
    if base.is_null() {
        return Ok(None);
    }
    let rows = VectorRows::checked(name, base, desc.format, 3, stride, desc.n_points.into())?;
    let mut out = crate::error::reserve(name, desc.n_points as usize)?;
    // SAFETY: the host's array holds n_points rows.
    out.extend((0..desc.n_points as usize).map(|i| unsafe { rows.read(i) }));
    Ok(Some(out))
}

/// Binds points to a model's mesh, precomputed or not. On success *binding is a new object, to be given to sw_binding_destroy; on failure it is
/// untouched. It stays as it is when the model is precomputed anew or destroyed.
///
/// A point follows the triangle that it stands on, along normals that turn smoothly from vertex to vertex: by a surface with continuous normals through the
/// deformed vertices, and off it with their turn. So positions of coarse triangles give no creases. At rest points are where they were given to the
/// last bit; a rigid motion carries them rigidly; displacements are good to 1e-6 of themselves. With sag_gravity points are bound to the mesh as given,
/// and hang with it. Takes about a microsecond a point. Callable concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also on a point that is not finite or too far off, and a normal or tangent without direction;
/// SW_ERROR_INVALID_DESC; SW_ERROR_NUMERICAL where the mesh is too thin or sharp to bind to; SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_binding_create(
    model: *const SwModel,
    desc: *const SwBindingDesc,
    binding: *mut *mut SwBinding,
) -> SwStatus {
    guard(|| {
        // SAFETY: NULL is refused; the host passes a live model and descriptor, arrays as long as that says, and a place for the output.
        unsafe {
            let model = object("model", model)?;
            not_null("binding", binding)?;
            let desc = read_descriptor("desc", desc)?;
            check_flags("desc->flags", desc.flags, 0)?;
            not_null("desc->points", desc.points)?;
            let max_distance = require_non_negative("desc->max_distance", desc.max_distance)?;
            let positions = vectors("desc->points", &desc, desc.points, desc.point_stride)?.unwrap_or_default();
            let normals = vectors("desc->normals", &desc, desc.normals, desc.normal_stride)?;
            let tangents = vectors("desc->tangents", &desc, desc.tangents, desc.tangent_stride)?;
            let shell = read("model", &model.0)?.shell_to_bind();
            let points = Points {
                positions: &positions,
                normals: normals.as_deref(),
                tangents: tangents.as_deref(),
                max_distance,
            };
            put(binding, Box::into_raw(Box::new(SwBinding(Binding::new(&shell, &points)?))));
        }
        Ok(())
    })
}

/// Destroys a binding; NULL is ignored. No state uses it between calls.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_binding_destroy(binding: *mut SwBinding) {
    let _ = guard(|| {
        if !binding.is_null() {
            // SAFETY: the host gives back what it was given, once.
            drop(unsafe { Box::from_raw(binding) });
        }
        Ok(())
    });
}

/// What a binding has. `info` must be initialised by sw_binding_info_init. Callable concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_binding_info(binding: *const SwBinding, info: *mut SwBindingInfo) -> SwStatus {
    guard(|| {
        // SAFETY: `object` refuses NULL; the host passes a live binding, and an initialised struct, whose size is checked.
        unsafe {
            let SwBinding(binding) = object("binding", binding)?;
            let place = Output::checked("info", info)?;
            let mut out: SwBindingInfo = super::structs::Described::initial();
            out.n_points = binding.n_points() as u32;
            [out.has_normals, out.has_tangents] = binding.has().map(u32::from);
            (out.furthest_distance, out.furthest_point) = binding.furthest();
            out.bytes = binding.bytes() as u64;
            place.write(out);
        }
        Ok(())
    })
}

/// Saves a binding, so that sw_binding_load gives it back without the search. Two calls: with `bytes` NULL and `capacity` 0 only *size is
/// written. Callable concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUFFER_SIZE when capacity < *size, SW_ERROR_OUT_OF_MEMORY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_binding_save(
    binding: *const SwBinding,
    bytes: *mut c_void,
    capacity: u64,
    size: *mut u64,
) -> SwStatus {
    guard(|| {
        // SAFETY: `object` refuses NULL; the host passes a live binding, and room for `capacity` bytes; `size` is not NULL.
        unsafe {
            let SwBinding(binding) = object("binding", binding)?;
            not_null("size", size)?;
            let saved = binding.save()?;
            copy_out("bytes", &saved, bytes.cast(), capacity)?;
            put(size, saved.len() as u64);
        }
        Ok(())
    })
}

/// Makes a binding of what sw_binding_save gave, for a model of the same mesh. Safe on any bytes. On success *binding is a new object, to be given
/// to sw_binding_destroy; on failure it is untouched. Callable concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DATA, also where the bytes belong to another mesh; SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_binding_load(
    model: *const SwModel,
    bytes: *const c_void,
    size: u64,
    binding: *mut *mut SwBinding,
) -> SwStatus {
    guard(|| {
        // SAFETY: NULL is refused; the host passes a live model, `size` bytes and a place for the output.
        unsafe {
            let model = object("model", model)?;
            not_null("binding", binding)?;
            let bytes = byte_slice("bytes", bytes, size)?;
            let shell = read("model", &model.0)?.shell_to_bind();
            put(binding, Box::into_raw(Box::new(SwBinding(Binding::load(&shell, bytes)?))));
        }
        Ok(())
    })
}

/// What is written, each to its rows.
struct Arrays {
    positions: Option<VectorRows>,
    normals: Option<VectorRows>,
    tangents: Option<VectorRows>,
    velocities: Option<VectorRows>,
    first: usize,
}

/// Points that a thread takes, and those of them that were inside solids: where they go, in the frame, by number.
struct Share {
    points: Range<usize>,
    out: Vec<(usize, Vec3)>,
    deepest: f64,
}

impl Share {
    fn push_out(&mut self, pose: &Pose, outside: &Outside, held: impl Fn(usize) -> bool) {
        let Self { points, out, deepest } = self;
        pose.positions(points.clone(), |i, x| {
            let Some((there, depth)) = outside.of(&x).filter(|_| !held(i)) else { return };
            out.push((i, there));
            *deepest = deepest.max(depth);
        });
    }
}

// SAFETY: threads write rows of ranges that have no row in common.
unsafe impl Sync for Arrays {}

impl Arrays {
    fn checked(desc: &SwBoundPointsDesc, count: usize) -> Result<Self, Fault> {
        let rows = |name: &str, base: *mut c_void, stride: u64| match base.is_null() {
            true => Ok(None),
            false => VectorRows::checked(name, base, desc.format, 3, stride, count as u64).map(Some),
        };
        Ok(Self {
            positions: rows("desc->positions", desc.positions, desc.position_stride)?,
            normals: rows("desc->normals", desc.normals, desc.normal_stride)?,
            tangents: rows("desc->tangents", desc.tangents, desc.tangent_stride)?,
            velocities: rows("desc->velocities", desc.velocities, desc.velocity_stride)?,
            first: desc.first as usize,
        })
    }

    /// Reads a range of points.
    unsafe fn write(&self, pose: &Pose, outward: &Outward, Share { points, out, .. }: &Share) {
        let place = |rows: &VectorRows, i: usize, v: Vec3| {
            // SAFETY: the host's array has a row for every point asked for.
            unsafe { rows.write::<3>(i - self.first, v.into()) }
        };
        if let Some(rows) = &self.positions {
            pose.positions(points.clone(), |i, x| place(rows, i, outward.position(x)));
            out.iter().for_each(|(i, x)| place(rows, *i, outward.position(*x)));
        }
        if let Some(rows) = &self.normals {
            pose.normals(points.clone(), |i, n| place(rows, i, outward.direction(n)));
        }
        if let Some(rows) = &self.tangents {
            pose.tangents(points.clone(), |i, t| place(rows, i, outward.direction(t)));
        }
        if let Some(rows) = &self.velocities {
            pose.velocities(points.clone(), |i, x, v| place(rows, i, outward.velocity(x, v)));
        }
    }
}

/// Points that a thread takes at once, and about how long each takes.
const SHARE: usize = 4096;
const NANOSECONDS: u64 = 10;

/// Reads points of a binding, as the state's shell is now: positions, normals, tangents and velocities of one formula. Costs the same whatever the method and
/// the number of modes: what reading the mesh's positions costs, and some nanoseconds a point. Many points are shared among threads, see
/// sw_set_threads, to the same bits. In SW_SPACE_WORLD velocities contain the frame's. Allocates. Callable concurrently.
///
/// With correction_steps or SW_BOUND_OUTSIDE points follow the surface that is corrected or pushed out, by the same formula: normals and tangents are its own. Velocities are of the motion alone, as
/// that surface turns them: what correction and push change from frame to frame is not in them. SW_BOUND_OUTSIDE leaves no point inside a collider by more than 1e-6 of the mesh's size, by the
/// collider's own distance and thickness, but for those on triangles that supports hold, and where *deepest tells; a point that went out by itself keeps its normal.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also on points that do not exist and a binding to another mesh; SW_ERROR_INVALID_DESC; SW_ERROR_UNSUPPORTED
/// for normals or tangents of a binding made without; SW_ERROR_NUMERICAL when a point may be beyond the numbers of the format; SW_ERROR_OUT_OF_MEMORY,
/// SW_ERROR_BUSY. Then nothing is written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_state_bound_points(
    state: *const SwState,
    binding: *const SwBinding,
    desc: *const SwBoundPointsDesc,
) -> SwStatus {
    // SAFETY: `reading` refuses a NULL state, `object` a NULL binding, `read_descriptor` a NULL descriptor; the host's arrays have `count` rows.
    unsafe {
        reading(state, |state| {
            let SwBinding(binding) = object("binding", binding)?;
            let desc = read_descriptor("desc", desc)?;
            check_flags("desc->flags", desc.flags, SW_BOUND_OUTSIDE)?;
            let shown = shown(state, &desc)?;
            let space = space_of(desc.space)?;
            let (first, n) = (desc.first as usize, binding.n_points());
            let count = if desc.count == 0 { n.saturating_sub(first) } else { desc.count as usize };
            if first >= n || count > n - first {
                return Err(Fault::argument(format!("desc: {count} points from point {first} on, of {n}")));
            }
            let arrays = Arrays::checked(&desc, count)?;
            let [normals, tangents] = binding.has();
            for (asked, has, name) in [(&arrays.normals, normals, "normals"), (&arrays.tangents, tangents, "tangents")]
            {
                if asked.is_some() && !has {
                    let message = format!("desc->{name}: the binding was made without {name}");
                    return Err(Fault::new(SW_ERROR_UNSUPPORTED, message));
                }
            }
            let pose = state.bound(binding, shown, arrays.velocities.is_some())?;
            let outward = state.to_space(space);
            check_reach(&arrays, &pose, &outward)?;
            let share = |start: usize| {
                let points = start..(start + SHARE).min(first + count);
                Share { points, out: vec![], deepest: 0.0 }
            };
            let mut shares: Vec<Share> = (first..first + count).step_by(SHARE).map(share).collect();
            let time = |share: &Share| share.points.len() as u64 * NANOSECONDS;
            if let Some(outside) = state.outside().filter(|_| shown.outside) {
                let held = &state.model().shell.held;
                for_each(&mut shares, time, |share| share.push_out(&pose, &outside, |i| binding.is_held(i, held)));
                check_pushed(&arrays, &shares, &outward)?;
            }
            for_each(&mut shares, time, |share| arrays.write(&pose, &outward, share));
            if !desc.deepest.is_null() {
                put(desc.deepest, shares.iter().map(|share| share.deepest).fold(0.0, f64::max));
            }
            Ok(())
        })
    }
}

fn shown(state: &State, desc: &SwBoundPointsDesc) -> Result<Shown, Fault> {
    let outside = desc.flags & SW_BOUND_OUTSIDE != 0;
    let unasked = outside && desc.correction_steps == SW_STEPS_AUTO;
    let corrections = if unasked { 0 } else { steps_shown(state, desc.correction_steps) };
    if corrections > MOST_STEPS {
        let message = format!("it must be at most {MOST_STEPS}, or SW_STEPS_AUTO");
        return Err(Fault::argument(format!("desc->correction_steps is {corrections}: {message}")));
    }
    if outside && corrections > 0 {
        return Err(Fault::argument("desc: points are pushed out or corrected, not both"));
    }
    if desc.reserved != 0 {
        return Err(Fault::argument(format!("desc->reserved is {}: it must be 0", desc.reserved)));
    }
    Ok(Shown { corrections: corrections as usize, outside })
}

/// Fails where a point that went out is beyond the numbers of the format.
fn check_pushed(arrays: &Arrays, shares: &[Share], outward: &Outward) -> Result<(), Fault> {
    let Some(rows) = &arrays.positions else { return Ok(()) };
    let limit = rows.largest_coordinate();
    let within = |x: &Vec3| outward.position(*x).iter().all(|c| c.abs() <= limit);
    match shares.iter().flat_map(|share| &share.out).find(|(_, x)| !within(x)) {
        None => Ok(()),
        Some((i, _)) => {
            let message = format!("point {i} is pushed out beyond the {limit:e} of this format");
            Err(Fault::new(SW_ERROR_NUMERICAL, message))
        }
    }
}

/// Fails where a value may leave the numbers of the format.
fn check_reach(arrays: &Arrays, pose: &Pose, outward: &Outward) -> Result<(), Fault> {
    let speed = arrays.velocities.as_ref().map(|rows| (rows, "velocity", outward.speed(pose.reach(), pose.speed())));
    let place = arrays.positions.as_ref().map(|rows| (rows, "position", outward.origin() + 2.0 * pose.reach()));
    for (rows, what, largest) in [place, speed].into_iter().flatten() {
        let limit = rows.largest_coordinate();
        let within = largest <= limit;
        if !within {
            let message = format!("a point's {what} may be up to {largest:e}, beyond the {limit:e} of this format");
            return Err(Fault::new(SW_ERROR_NUMERICAL, message));
        }
    }
    Ok(())
}
