//! A mesh to simulate in another's place.

use super::guard::{guard, write};
use super::mesh::{SwMeshDesc, read_mesh};
use super::model::SwModel;
use super::pointer::{Rows, VectorRows, check_flags, not_null, object, put, read_array};
use super::precompute::{SwProgressFn, tell_progress};
use super::status::{Fault, SwStatus};
use super::structs::{Output, described, read_descriptor, read_descriptor_or_default};
use crate::error::require_non_negative;
use crate::proxy::{Calibration, Options, Proxy, Sides, calibrate};
use std::ffi::c_void;
use std::sync::Arc;

/// Cut the asset where it is no manifold: edges of more than two triangles, sheets that touch in a point, strips with one side. What was cut is free to part.
pub const SW_PROXY_CUT: u32 = 1;
/// Simulate both sides of a sheet with thickness.
pub const SW_PROXY_KEEP_SIDES: u32 = 2;
/// Leave no piece out, however small.
pub const SW_PROXY_KEEP_PIECES: u32 = 4;

/// What proxy is wanted.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwProxyDesc {
    /// Set by sw_proxy_desc_init.
    pub struct_size: u32,
    /// Bitwise or of SW_PROXY_...
    pub flags: u32,
    /// Vertices of the proxy, 4 to 4,000,000. It gets within some per cent of them; more where the asset has more holes, lines or pieces than so few can follow.
    pub n_vertices: u32,
    /// Must be 0.
    pub reserved: u32,
    /// Vertices of the asset within this distance become one; 0 = those at the same place.
    pub weld: f64,
    /// Two sides no further apart become the sheet in their middle, and where they cannot be told apart is an error. 0 = sheets no thicker than a 20th of the
    /// asset's size and a tenth of the piece's are found, and the rest is simulated as it is.
    pub thickness: f64,
    /// Hears of progress, with 0 for the phase; may be NULL.
    pub progress: SwProgressFn,
    /// Handed to it.
    pub progress_user: *mut c_void,
    /// Vertices of the asset that supports hold (n_held): the outline of what they hold is kept where it is wide enough for the proxy's triangles, so that as much
    /// of the proxy is held. Of sw_proxy_nearest these are the proxy's vertices to be held. NULL = none.
    pub held: *const u32,
    /// Length of held.
    pub n_held: u32,
    /// Must be 0.
    pub held_flags: u32,
}

described!(SwProxyDesc, progress_user);

/// What was done to an asset, and what came out.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwProxyInfo {
    /// Set by sw_proxy_info_init.
    pub struct_size: u32,
    /// Vertices of the proxy.
    pub n_vertices: u32,
    /// Triangles of the proxy.
    pub n_triangles: u32,
    /// Pieces of the proxy that do not hang together.
    pub n_pieces: u32,
    /// Vertices of the asset.
    pub n_asset_vertices: u32,
    /// Pieces of the asset left out, as they are less than three edges of the proxy across. Bound to the proxy, they follow it.
    pub n_left_out: u32,
    /// Vertices of the asset made one with another.
    pub n_welded: u32,
    /// Triangles of the asset left out as another has the same corners.
    pub n_repeated: u32,
    /// Triangles of the asset left out as second sides and rims.
    pub n_sides_joined: u32,
    /// Places where the asset was cut, with SW_PROXY_CUT.
    pub n_cut: u32,
    /// Of the asset's vertices that the proxy stands for, the one furthest from it.
    pub furthest_vertex: u32,
    /// Holes closed, as they are less than three edges of the proxy around.
    pub n_holes_closed: u32,
    /// Its distance; with sides joined, from where their middle was.
    pub furthest_distance: f64,
    /// Length of edges aimed at.
    pub edge_length: f64,
    /// Between sides that were joined; 0 = none were.
    pub thickness: f64,
    /// 4 sqrt(3) area / sum of squared sides, 1 for equilateral triangles: of the worst.
    pub worst_quality: f64,
    /// The mean of all triangles.
    pub mean_quality: f64,
}

described!(SwProxyInfo, mean_quality);

/// A mesh to simulate in an asset's place. Immutable. Share it by any number of threads.
pub struct SwProxy {
    proxy: Proxy,
    n_asset: usize,
}

/// Makes a mesh of a wanted number of vertices to simulate in an asset's place, whatever that is made of: triangles in any order and number, loose, double-sided,
/// with thickness, in pieces. On success *proxy is a new object, to be given to sw_proxy_destroy; on failure it is untouched. Make a model of its positions and
/// triangles, and bind the asset's vertices to that by sw_binding_create.
///
/// Triangles are close to equilateral, boundaries and creases are kept, and the result is an oriented manifold. Takes about 0.15 s for 10,000 triangles. The same input
/// gives the same proxy. Callable concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT; SW_ERROR_INVALID_DESC; SW_ERROR_INVALID_MESH with the place and what to do, where the asset is no manifold or its two sides cannot
/// be told apart; SW_ERROR_CANCELLED; SW_ERROR_NUMERICAL where no good triangles were found; SW_ERROR_OUT_OF_MEMORY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_proxy_create(
    mesh: *const SwMeshDesc,
    desc: *const SwProxyDesc,
    proxy: *mut *mut SwProxy,
) -> SwStatus {
    guard(|| {
        // SAFETY: NULL is refused; the host passes descriptors, arrays as long as these say, and a place for the output.
        unsafe {
            not_null("proxy", proxy)?;
            let desc = read_descriptor("desc", desc)?;
            let options = read_options(&desc)?;
            let (positions, triangles) = read_mesh(mesh)?;
            let mut heard = |share: f64| tell_progress(desc.progress, desc.progress_user, 0, share);
            let held = read_array("desc->held", desc.held, desc.n_held.into())?;
            let made = Proxy::holding(&positions, &triangles, &held, &options, &mut heard)?;
            put(proxy, Box::into_raw(Box::new(SwProxy { proxy: made, n_asset: positions.len() })));
        }
        Ok(())
    })
}

fn read_options(desc: &SwProxyDesc) -> Result<Options, Fault> {
    check_flags("desc->flags", desc.flags, SW_PROXY_CUT | SW_PROXY_KEEP_SIDES | SW_PROXY_KEEP_PIECES)?;
    check_flags("desc->reserved", desc.reserved, 0)?;
    check_flags("desc->held_flags", desc.held_flags, 0)?;
    let thickness = require_non_negative("desc->thickness", desc.thickness)?;
    let keep = desc.flags & SW_PROXY_KEEP_SIDES != 0;
    if keep && thickness > 0.0 {
        return Err(Fault::argument(format!("desc->thickness is {thickness} and desc->flags has SW_PROXY_KEEP_SIDES")));
    }
    Ok(Options {
        n_vertices: desc.n_vertices as usize,
        weld: require_non_negative("desc->weld", desc.weld)?,
        sides: match thickness {
            _ if keep => Sides::Keep,
            0.0 => Sides::Find,
            _ => Sides::Within(thickness),
        },
        cut: desc.flags & SW_PROXY_CUT != 0,
        keep_pieces: desc.flags & SW_PROXY_KEEP_PIECES != 0,
    })
}

/// Destroys a proxy; NULL is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_proxy_destroy(proxy: *mut SwProxy) {
    let _ = guard(|| {
        if !proxy.is_null() {
            // SAFETY: the host gives back what it was given, once.
            drop(unsafe { Box::from_raw(proxy) });
        }
        Ok(())
    });
}

/// What a proxy has, and what was done to the asset. `info` must be initialised by sw_proxy_info_init. Callable concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_proxy_info(proxy: *const SwProxy, info: *mut SwProxyInfo) -> SwStatus {
    guard(|| {
        // SAFETY: `object` refuses NULL; the host passes a live proxy, and an initialised struct, whose size is checked.
        unsafe {
            let SwProxy { proxy, n_asset } = object("proxy", proxy)?;
            let place = Output::checked("info", info)?;
            let mut out: SwProxyInfo = super::structs::Described::initial();
            let (n, done) = (|count: usize| count.min(u32::MAX as usize) as u32, &proxy.info);
            (out.n_vertices, out.n_triangles) = (n(proxy.positions.len()), n(proxy.triangles.len()));
            (out.n_pieces, out.n_asset_vertices, out.n_left_out) = (n(done.n_pieces), n(*n_asset), n(done.n_left_out));
            out.n_holes_closed = n(done.n_holes_closed);
            (out.n_welded, out.n_repeated) = (n(done.n_welded), n(done.n_repeated));
            (out.n_sides_joined, out.n_cut) = (n(done.n_sides_joined), n(done.n_cut));
            (out.furthest_distance, out.furthest_vertex) = done.furthest;
            (out.edge_length, out.thickness) = (done.edge_length, done.thickness);
            (out.worst_quality, out.mean_quality) = (done.worst_quality, done.mean_quality);
            place.write(out);
        }
        Ok(())
    })
}

fn check_count(name: &str, given: u32, has: usize) -> Result<(), Fault> {
    match given as usize == has {
        true => Ok(()),
        false => Err(Fault::argument(format!("{name} is {given}, but there are {has}"))),
    }
}

/// Positions of a proxy's vertices (n_vertices x 3) in the asset's axes and lengths, as SW_FORMAT_..., `stride` bytes from vertex to vertex (0 = packed). Callable
/// concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also when n_vertices is not the proxy's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_proxy_positions(
    proxy: *const SwProxy,
    format: u32,
    positions: *mut c_void,
    stride: u64,
    n_vertices: u32,
) -> SwStatus {
    guard(|| {
        // SAFETY: `object` refuses NULL; the host passes a live proxy, and a buffer of n_vertices rows, which is checked.
        unsafe {
            let SwProxy { proxy, .. } = object("proxy", proxy)?;
            check_count("n_vertices", n_vertices, proxy.positions.len())?;
            let rows = VectorRows::checked("positions", positions, format, 3, stride, n_vertices.into())?;
            proxy.positions.iter().enumerate().for_each(|(i, x)| rows.write::<3>(i, (*x).into()));
        }
        Ok(())
    })
}

/// Triangles of a proxy (n_triangles x 3), packed. Callable concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also when n_triangles is not the proxy's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_proxy_triangles(proxy: *const SwProxy, triangles: *mut u32, n_triangles: u32) -> SwStatus {
    guard(|| {
        // SAFETY: `object` refuses NULL; the host passes a live proxy, and a buffer of n_triangles rows, which is checked.
        unsafe {
            let SwProxy { proxy, .. } = object("proxy", proxy)?;
            check_count("n_triangles", n_triangles, proxy.triangles.len())?;
            let rows = Rows::checked("triangles", triangles.cast_const().cast(), 12, 0, n_triangles.into())?;
            proxy.triangles.iter().enumerate().for_each(|(t, tri)| put(rows.at(t).cast(), *tri));
        }
        Ok(())
    })
}

/// Where each vertex of a proxy lies on the asset: three of its vertices and their weights, of sum 1 (n_vertices x 3 each, packed). By these painted values, groups
/// and colours come to the proxy. Either may be NULL. Callable concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also when n_vertices is not the proxy's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_proxy_sources(
    proxy: *const SwProxy,
    vertices: *mut u32,
    weights: *mut f64,
    n_vertices: u32,
) -> SwStatus {
    guard(|| {
        // SAFETY: `object` refuses NULL; the host passes a live proxy, and buffers of n_vertices rows, which are checked.
        unsafe {
            let SwProxy { proxy, .. } = object("proxy", proxy)?;
            check_count("n_vertices", n_vertices, proxy.sources.len())?;
            let count = n_vertices.into();
            let rows = |name: &str, base: *const c_void, row: usize| match base.is_null() {
                true => Ok(None),
                false => Rows::checked(name, base, row, 0, count).map(Some),
            };
            let corners = rows("vertices", vertices.cast_const().cast(), 12)?;
            let shares = rows("weights", weights.cast_const().cast(), 24)?;
            for (i, source) in proxy.sources.iter().enumerate() {
                if let Some(rows) = &corners {
                    put(rows.at(i).cast(), source.vertices);
                }
                if let Some(rows) = &shares {
                    put(rows.at(i).cast(), source.weights);
                }
            }
        }
        Ok(())
    })
}

/// Of each vertex of the asset, the nearest of the proxy (n_asset_vertices); 0 of one in no triangle. Callable concurrently.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also when n_asset_vertices is not the asset's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_proxy_nearest(
    proxy: *const SwProxy,
    vertices: *mut u32,
    n_asset_vertices: u32,
) -> SwStatus {
    guard(|| {
        // SAFETY: `object` refuses NULL; the host passes a live proxy, and a buffer of n_asset_vertices, which is checked.
        unsafe {
            let SwProxy { proxy, .. } = object("proxy", proxy)?;
            check_count("n_asset_vertices", n_asset_vertices, proxy.nearest.len())?;
            let rows = Rows::checked("vertices", vertices.cast_const().cast(), 4, 0, n_asset_vertices.into())?;
            proxy.nearest.iter().enumerate().for_each(|(i, v)| put(rows.at(i).cast(), *v));
        }
        Ok(())
    })
}

/// How a model is calibrated.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwCalibrationDesc {
    /// Set by sw_calibration_desc_init.
    pub struct_size: u32,
    /// Must be 0.
    pub flags: u32,
    /// Hears of progress, with 0 for the phase; may be NULL.
    pub progress: SwProgressFn,
    /// Handed to it.
    pub progress_user: *mut c_void,
    /// Vertices of the asset that supports hold (n_held). NULL = those that the proxy was made with.
    pub held: *const u32,
    /// Length of held.
    pub n_held: u32,
    /// Must be 0.
    pub reserved: u32,
}

described!(SwCalibrationDesc, reserved);

/// What a calibration found.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwCalibrationInfo {
    /// Set by sw_calibration_info_init.
    pub struct_size: u32,
    /// Patches of the proxy that have factors of their own, each between 1/4 and 4; between patches these change smoothly.
    pub n_patches: u32,
    /// Vertices of the mesh that it was compared with: the asset's, or of a finer proxy where these are very many, or fewer than twice the proxy's.
    pub n_compared: u32,
    /// Loads whose answers were compared: gravity along each axis, and loads that follow from these.
    pub n_loads: u32,
    /// Under gravity along each axis, to first order: root mean square of how far the proxy's vertices were off, relative to how far the asset moves there; before.
    pub difference_before: f64,
    /// And after.
    pub difference_after: f64,
    /// Least factor of the stiffness against stretching.
    pub stretching_min: f64,
    /// Largest.
    pub stretching_max: f64,
    /// Least factor of the stiffness against bending.
    pub bending_min: f64,
    /// Largest.
    pub bending_max: f64,
    /// The proxy's mass over the asset's, before.
    pub mass_before: f64,
}

described!(SwCalibrationInfo, mass_before);

/// Fits the stiffness of a model on a proxy's mesh so that it answers to gravity as the same sheet does on the asset, and gives it the asset's mass: what a coarse mesh gets
/// wrong is mostly how stiff it is, and where. `model` is of the proxy's positions and triangles, the proxy was made with what supports hold as `held`, or the descriptor has it, and the model was
/// not precomputed yet. `desc` may be NULL for defaults, `info` NULL if nothing is to be told.
///
/// Each triangle's stiffness against stretching and against bending gets a factor, and so does its mass: the material has maps of triangles after that, which are saved with
/// the model. Creases, ties and rest shapes are left out of the comparison, and stay as they are. With the paper's energy the asset is one whose k_length is less by its
/// shorter edges. Takes one factorization of the asset's stiffness and about ten of the proxy's: about a second for an asset of 10,000 vertices. On failure the model is as it was.
/// Not to be called at the same time as any other function on this model.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also for a model of another mesh, one that was calibrated or precomputed before; SW_ERROR_INVALID_DESC; SW_ERROR_UNSUPPORTED where a piece of the proxy is not
/// held, or nothing of the asset is; SW_ERROR_INVALID_MESH or SW_ERROR_NUMERICAL where the asset cannot be a shell; SW_ERROR_CANCELLED, SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_model_calibrate(
    model: *mut SwModel,
    proxy: *const SwProxy,
    desc: *const SwCalibrationDesc,
    info: *mut SwCalibrationInfo,
) -> SwStatus {
    guard(|| {
        // SAFETY: `object` refuses NULL; the host passes live objects, and structs that are NULL or have their struct_size.
        let (handle, SwProxy { proxy, .. }, desc, place) = unsafe {
            let place = if info.is_null() { None } else { Some(Output::checked("info", info)?) };
            let desc = read_descriptor_or_default("desc", desc)?;
            (object("model", model.cast_const())?, object("proxy", proxy)?, desc, place)
        };
        check_flags("desc->flags", desc.flags, 0)?;
        check_flags("desc->reserved", desc.reserved, 0)?;
        // SAFETY: the host's list of held vertices is as long as the descriptor says.
        let held = unsafe { read_array("desc->held", desc.held, desc.n_held.into())? };
        let mut content = write("model", &handle.0)?;
        if content.calibrated || content.model.is_some() {
            let what = if content.calibrated { "calibrated" } else { "precomputed" };
            return Err(Fault::argument(format!("the model was {what} before: calibrate one that is new")));
        }
        let mut heard = |share: f64| tell_progress(desc.progress, desc.progress_user, 0, share);
        let (shell, found) = calibrate(&content.shell, proxy, &held, &mut heard)?;
        (content.shell, content.calibrated) = (Arc::new(shell), true);
        if let Some(place) = place {
            // SAFETY: an initialised struct, whose size was checked.
            unsafe { place.write(told(&found)) };
        }
        Ok(())
    })
}

fn told(found: &Calibration) -> SwCalibrationInfo {
    let n = |count: usize| count.min(u32::MAX as usize) as u32;
    let mut out: SwCalibrationInfo = super::structs::Described::initial();
    (out.n_patches, out.n_compared, out.n_loads) = (n(found.n_patches), n(found.n_compared), n(found.n_loads));
    [out.difference_before, out.difference_after] = found.difference;
    [out.stretching_min, out.stretching_max] = found.stretching;
    [out.bending_min, out.bending_max] = found.bending;
    out.mass_before = found.mass;
    out
}
