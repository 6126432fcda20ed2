//! The log callback: the only global state, and the only way the library speaks unasked.

use super::floats::as_the_host;
use super::guard::guard;
use super::status::SwStatus;
use std::ffi::{CString, c_char, c_void};
use std::sync::Mutex;

/// Something a curious user may want to know.
pub const SW_LOG_INFO: u32 = 1;
/// Something was handled that the user should know of.
pub const SW_LOG_WARNING: u32 = 2;

/// Receives a message. Called on the thread that makes the call concerned; must not throw or long-jump.
pub type SwLogFn = Option<unsafe extern "C" fn(user: *mut c_void, level: u32, message: *const c_char)>;

struct Sink {
    callback: unsafe extern "C" fn(*mut c_void, u32, *const c_char),
    user: usize,
}

static SINK: Mutex<Option<Sink>> = Mutex::new(None);

/// Sets the receiver of log messages for the whole process, NULL for none (the default). The library never prints. When
/// this returns, calls under way on other threads may still use the old callback once.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_set_log_callback(callback: SwLogFn, user: *mut c_void) -> SwStatus {
    guard(|| {
        let sink = callback.map(|callback| Sink { callback, user: user as usize });
        *SINK.lock().unwrap_or_else(|poisoned| poisoned.into_inner()) = sink;
        Ok(())
    })
}

/// Sends a message to the host, if it listens. The lock is not held during the call.
pub(super) fn log(level: u32, message: &str) {
    let sink = SINK.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let Some((callback, user)) = sink.as_ref().map(|s| (s.callback, s.user)) else { return };
    drop(sink);
    if let Ok(text) = CString::new(message) {
        // SAFETY: the host set this callback with this user pointer.
        as_the_host(|| unsafe { callback(user as *mut c_void, level, text.as_ptr()) });
    }
}

#[cfg(test)]
mod tests {
    use super::super::model::*;
    use super::super::pointer::SW_FORMAT_F64;
    use super::super::status::SW_OK;
    use super::super::structs::Described;
    use super::super::{material::SW_ENERGY_KOITER, mesh::SwMeshDesc};
    use super::*;
    use std::cell::RefCell;
    use std::ffi::CStr;
    use std::ptr::{null, null_mut};

    thread_local! {
        static WARNINGS: RefCell<Vec<String>> = const { RefCell::new(vec![]) };
    }

    /// Other tests' models speak on their own threads.
    unsafe extern "C" fn keep(_: *mut c_void, level: u32, message: *const c_char) {
        // SAFETY: NUL-terminated.
        let message = unsafe { CStr::from_ptr(message) }.to_string_lossy().into_owned();
        if level == SW_LOG_WARNING {
            WARNINGS.with_borrow_mut(|all| all.push(message));
        }
    }

    /// A unit square, folded by a right angle along a diagonal, of so thick a sheet.
    fn warnings(thickness: f64) -> Vec<String> {
        warnings_at(thickness, 0.0)
    }

    /// The same square, so far from the origin.
    fn warnings_at(thickness: f64, away: f64) -> Vec<String> {
        let positions = [[0.0f64, 0.0, 0.0], [0.5, 0.5, 0.5f64.sqrt()], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let positions = positions.map(|[x, y, z]| [x + away, y, z]);
        let triangles = [0u32, 1, 2, 0, 2, 3];
        let mut mesh = SwMeshDesc::initial();
        (mesh.position_format, mesh.n_vertices, mesh.n_triangles) = (SW_FORMAT_F64, 4, 2);
        (mesh.positions, mesh.triangles) = (positions.as_ptr().cast(), triangles.as_ptr());
        let mut material = SwMaterialDesc::initial();
        material.energy = SW_ENERGY_KOITER;
        (material.young, material.thickness, material.volume_density) = (1e6, thickness, 20.0);
        let mut model = null_mut();
        // SAFETY: descriptors and what they point to live through the calls.
        unsafe {
            assert_eq!(sw_set_log_callback(Some(keep), null_mut()), SW_OK);
            assert_eq!(sw_model_create(&mesh, &material, null(), &mut model), SW_OK);
            sw_model_destroy(model);
            assert_eq!(sw_set_log_callback(None, null_mut()), SW_OK);
        }
        WARNINGS.take()
    }

    /// Both heights are 1/√2, so that the curvature is π/2 · √2 = 2.22.
    #[test]
    fn a_sheet_beyond_a_tenth_of_its_radius_of_curvature_is_warned_of() {
        assert!(warnings(0.044).is_empty());
        let said = warnings(0.09);
        assert_eq!(said.len(), 1, "{said:?}");
        let words = ["a tenth of its radius of curvature at 2 triangles", "it is 0.20 of it"];
        assert!(words.iter().all(|words| said[0].contains(words)), "{said:?}");
    }

    #[test]
    fn a_mesh_far_from_the_origin_is_warned_of() {
        assert!(warnings_at(0.01, 1e4).is_empty());
        let said = warnings_at(0.01, 1e6);
        assert!(said.len() == 1 && said[0].contains("of its sizes from the origin"), "{said:?}");
    }
}
