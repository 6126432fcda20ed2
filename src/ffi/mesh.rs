//! Mesh descriptors and located diagnostics.

use super::guard::guard;
use super::pointer::{Rows, VectorRows, not_null, put};
use super::status::{Fault, SW_ERROR_INVALID_MESH, SwStatus, copy_text};
use super::structs::{Outputs, described, grows, read_descriptor};
use crate::Vec3;
use crate::mesh::{Diagnostic, Kind, Severity, check};
use std::ffi::{c_char, c_void};

/// Handled: the mesh can be used.
pub const SW_SEVERITY_WARNING: u32 = 1;
/// The mesh is refused by sw_model_create.
pub const SW_SEVERITY_ERROR: u32 = 2;

/// Error. A triangle names a vertex that does not exist. element: triangle; `value[0]`: the index.
pub const SW_DIAGNOSTIC_INDEX_OUT_OF_RANGE: u32 = 1;
/// Error. A triangle names a vertex twice. element: triangle.
pub const SW_DIAGNOSTIC_REPEATED_VERTEX: u32 = 2;
/// Error. A coordinate is NaN or infinite. element: vertex; `value[0]`: the coordinate.
pub const SW_DIAGNOSTIC_NON_FINITE_COORDINATE: u32 = 3;
/// Error. Area at most 1e-12 of the longest edge squared. element: triangle; value: area, longest edge.
pub const SW_DIAGNOSTIC_ZERO_AREA: u32 = 4;
/// Error. Two triangles on the same vertices. element: the second; `value[0]`: the first.
pub const SW_DIAGNOSTIC_DUPLICATE_TRIANGLE: u32 = 5;
/// Error. More than two triangles on an edge. element: its first triangle; vertices: the edge, then that triangle's third; `value[0]`: how
/// many.
pub const SW_DIAGNOSTIC_NON_MANIFOLD_EDGE: u32 = 6;
/// Error. The triangles around a vertex form several fans. element: vertex; `value[0]`: how many fans.
pub const SW_DIAGNOSTIC_NON_MANIFOLD_VERTEX: u32 = 7;
/// Error. No consistent orientation exists, as on a Moebius strip. element: a triangle where it fails.
pub const SW_DIAGNOSTIC_NOT_ORIENTABLE: u32 = 8;
/// Warning. The triangle is turned against its neighbours; it is re-oriented internally. element: triangle.
pub const SW_DIAGNOSTIC_INCONSISTENT_ORIENTATION: u32 = 9;
/// Warning. No triangle uses the vertex; it is carried along with the support frame. element: vertex.
pub const SW_DIAGNOSTIC_UNREFERENCED_VERTEX: u32 = 10;
/// Warning. Two vertices at the same place, perhaps an unwelded seam. element: the second; `value[0]`: the first.
pub const SW_DIAGNOSTIC_COINCIDENT_VERTICES: u32 = 11;
/// Warning. element: triangle; `value[0]`: quality 4 sqrt(3) area / sum of squared sides, below 0.02.
pub const SW_DIAGNOSTIC_SLIVER: u32 = 12;

/// Length of SwDiagnostic::message, the closing NUL included; for good.
pub const SW_DIAGNOSTIC_MESSAGE_SIZE: usize = 160;

/// One located problem of a mesh. Output only.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwDiagnostic {
    /// SW_DIAGNOSTIC_....
    pub kind: u32,
    /// SW_SEVERITY_....
    pub severity: u32,
    /// Triangle or vertex, as the kind says.
    pub element: u32,
    /// The vertices concerned, UINT32_MAX where unused.
    pub vertices: [u32; 4],
    /// 0.
    pub reserved: u32,
    /// Numbers, as the kind says.
    pub value: [f64; 2],
    /// The same in words, NUL-terminated.
    pub message: [c_char; SW_DIAGNOSTIC_MESSAGE_SIZE],
}

grows!(SwDiagnostic, message);

/// A triangle mesh in the host's memory. Nothing is kept: the library copies what it needs during the call.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SwMeshDesc {
    /// Set by sw_mesh_desc_init.
    pub struct_size: u32,
    /// SW_FORMAT_F32 or SW_FORMAT_F64: type of the coordinates. Required.
    pub position_format: u32,
    /// Rest positions (n_vertices x 3), in any unit of length; all else follows in that unit. Required.
    pub positions: *const c_void,
    /// Bytes from one vertex to the next, 0 = packed. Maya points: 32; Houdini P: 12.
    pub position_stride: u64,
    /// Vertex indices from 0 (n_triangles x 3). Required.
    pub triangles: *const u32,
    /// Bytes from one triangle to the next, 0 = packed.
    pub triangle_stride: u64,
    /// At least 1, below UINT32_MAX.
    pub n_vertices: u32,
    /// At least 1, below 2^30.
    pub n_triangles: u32,
}

described!(SwMeshDesc, n_triangles);

/// Corners are numbered 3t + k in 32 bits.
const MAX_TRIANGLES: u32 = 1 << 30;

/// The host's mesh, copied: positions and triangles.
pub(super) unsafe fn read_mesh(desc: *const SwMeshDesc) -> Result<(Vec<Vec3>, Vec<[u32; 3]>), Fault> {
    // SAFETY: passed on unchanged.
    let desc = unsafe { read_descriptor("mesh", desc)? };
    let (n, t) = (desc.n_vertices, desc.n_triangles);
    if n == 0 || t == 0 || n == u32::MAX || t >= MAX_TRIANGLES {
        let message = format!("mesh has {n} vertices and {t} triangles: outside 1..2^32-2 and 1..2^30-1");
        return Err(Fault::new(SW_ERROR_INVALID_MESH, message));
    }
    let (format, stride) = (desc.position_format, desc.position_stride);
    let points = VectorRows::checked("mesh->positions", desc.positions, format, 3, stride, n.into())?;
    let corners = Rows::checked("mesh->triangles", desc.triangles.cast(), 12, desc.triangle_stride, t.into())?;
    let mut positions = crate::error::try_zeroed("the mesh", n as usize)?;
    let mut triangles = crate::error::try_zeroed("the mesh", t as usize)?;
    // SAFETY: the host's buffers hold as many rows as the descriptor says.
    unsafe {
        positions.iter_mut().enumerate().for_each(|(i, p)| *p = points.read(i));
        triangles.iter_mut().enumerate().for_each(|(i, t)| *t = corners.at(i).cast::<[u32; 3]>().read_unaligned());
    }
    Ok((positions, triangles))
}

fn kind_code(kind: Kind) -> u32 {
    match kind {
        Kind::IndexOutOfRange => SW_DIAGNOSTIC_INDEX_OUT_OF_RANGE,
        Kind::RepeatedVertex => SW_DIAGNOSTIC_REPEATED_VERTEX,
        Kind::NonFiniteCoordinate => SW_DIAGNOSTIC_NON_FINITE_COORDINATE,
        Kind::ZeroArea => SW_DIAGNOSTIC_ZERO_AREA,
        Kind::DuplicateTriangle => SW_DIAGNOSTIC_DUPLICATE_TRIANGLE,
        Kind::NonManifoldEdge => SW_DIAGNOSTIC_NON_MANIFOLD_EDGE,
        Kind::NonManifoldVertex => SW_DIAGNOSTIC_NON_MANIFOLD_VERTEX,
        Kind::NotOrientable => SW_DIAGNOSTIC_NOT_ORIENTABLE,
        Kind::InconsistentOrientation => SW_DIAGNOSTIC_INCONSISTENT_ORIENTATION,
        Kind::UnreferencedVertex => SW_DIAGNOSTIC_UNREFERENCED_VERTEX,
        Kind::CoincidentVertices => SW_DIAGNOSTIC_COINCIDENT_VERTICES,
        Kind::Sliver => SW_DIAGNOSTIC_SLIVER,
    }
}

impl From<&Diagnostic> for SwDiagnostic {
    fn from(d: &Diagnostic) -> Self {
        let mut text = [0u8; SW_DIAGNOSTIC_MESSAGE_SIZE];
        copy_text(&d.to_string(), &mut text);
        let severity = match d.kind.severity() {
            Severity::Warning => SW_SEVERITY_WARNING,
            Severity::Error => SW_SEVERITY_ERROR,
        };
        Self {
            kind: kind_code(d.kind),
            severity,
            element: d.element,
            vertices: d.vertices,
            reserved: 0,
            value: d.value,
            message: text.map(|byte| byte as c_char),
        }
    }
}

/// Finds every problem of a mesh without building anything; errors come first, then warnings, each by kind and element.
///
/// Writes min(capacity, *count) diagnostics; `count` is how many there are in all. `diagnostics` may be NULL if `capacity`
/// is 0; `element_size` is sizeof(SwDiagnostic). SW_OK says that the check was done, not that the mesh is good: read the severities. Callable from any thread.
/// Errors: SW_ERROR_INVALID_DESC, SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_MESH when a count is out of range.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_mesh_check(
    mesh: *const SwMeshDesc,
    diagnostics: *mut SwDiagnostic,
    element_size: u32,
    capacity: u32,
    count: *mut u32,
) -> SwStatus {
    guard(|| {
        not_null("count", count)?;
        if capacity > 0 {
            not_null("diagnostics", diagnostics)?;
        }
        let out = Outputs::checked("diagnostics", diagnostics, element_size)?;
        // SAFETY: the mesh's arrays are as long as its counts say; `count` is not NULL, and the host's array has room for `capacity` elements.
        unsafe {
            let (positions, triangles) = read_mesh(mesh)?;
            let found = check(&positions, &triangles).diagnostics;
            out.write(found.iter().take(capacity as usize).map(SwDiagnostic::from));
            put(count, found.len().min(u32::MAX as usize) as u32);
        }
        Ok(())
    })
}
