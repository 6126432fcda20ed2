//! A small host: owning handles, and what a call must keep whatever it was given.

use shellwarp::ffi::constraint::{SwConstraintReport, sw_state_constraint_report};
use shellwarp::ffi::mesh::SwMeshDesc;
use shellwarp::ffi::model::*;
use shellwarp::ffi::pointer::SW_FORMAT_F64;
use shellwarp::ffi::state::*;
use shellwarp::ffi::status::*;
use shellwarp::ffi::structs::Described;
use std::ffi::CStr;
use std::ptr::{null, null_mut};

pub fn message() -> String {
    unsafe { CStr::from_ptr(sw_last_error_message()) }.to_string_lossy().into_owned()
}

/// Any status but an internal error; and a failure says why.
#[track_caller]
pub fn sane(status: SwStatus) -> bool {
    assert!(status < SW_ERROR_INTERNAL, "status {status}: {}", message());
    assert!(status == SW_OK || !message().is_empty());
    status == SW_OK
}

#[track_caller]
pub fn ok(status: SwStatus) {
    assert!(sane(status), "status {status}: {}", message());
}

/// A failure may only be one of these.
#[track_caller]
pub fn ok_or(status: SwStatus, allowed: &[SwStatus]) -> bool {
    assert!(sane(status) || allowed.contains(&status), "status {status}: {}", message());
    status == SW_OK
}

#[track_caller]
pub fn all_finite(what: &str, numbers: &[f64]) {
    assert!(numbers.iter().all(|x| x.is_finite()), "{what}: {numbers:?}");
}

/// The size of an element of sw_state_constraint_report.
const REPORT_SIZE: u32 = size_of::<SwConstraintReport>() as u32;

pub struct Model(pub *mut SwModel);

impl Drop for Model {
    fn drop(&mut self) {
        unsafe { sw_model_destroy(self.0) }
    }
}

/// Positions and triangles, packed.
#[derive(Clone, Debug, Default)]
pub struct Triangles {
    pub x: Vec<[f64; 3]>,
    pub t: Vec<[u32; 3]>,
}

impl Triangles {
    /// A sheet of `nx` by `ny` squares of side 1/4.
    pub fn sheet(nx: u32, ny: u32) -> Self {
        let at = |i: u32, j: u32| i * (ny + 1) + j;
        let mut out = Self::default();
        for i in 0..=nx {
            out.x.extend((0..=ny).map(|j| [0.25 * f64::from(i), 0.25 * f64::from(j), 0.0]));
        }
        for i in 0..nx {
            for j in 0..ny {
                let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                out.t.extend([[a, b, c], [a, c, d]]);
            }
        }
        out
    }

    pub fn desc(&self) -> SwMeshDesc {
        let mut mesh = SwMeshDesc::initial();
        mesh.position_format = SW_FORMAT_F64;
        (mesh.positions, mesh.triangles) = (self.x.as_ptr().cast(), self.t.as_ptr().cast());
        (mesh.n_vertices, mesh.n_triangles) = (self.x.len() as u32, self.t.len() as u32);
        mesh
    }

    /// A model of them with vertices fixed; precomputed if modes are wanted.
    pub fn model(&self, fixed: &[u32], modes: u32, precision: u32) -> Model {
        let mut options = SwPrecomputeDesc::initial();
        (options.modes, options.precision) = (modes, precision);
        self.model_by(fixed, (modes > 0).then_some(&options))
    }

    /// The same, precomputed as told.
    pub fn model_by(&self, fixed: &[u32], options: Option<&SwPrecomputeDesc>) -> Model {
        let mut supports = SwSupportDesc::initial();
        (supports.fixed, supports.n_fixed) = (fixed.as_ptr(), fixed.len() as u32);
        let mut model = null_mut();
        unsafe {
            ok(sw_model_create(&self.desc(), null(), &supports, &mut model));
            if let Some(options) = options {
                ok(sw_model_precompute(model, options));
            }
        }
        Model(model)
    }
}

impl Model {
    pub fn info(&self) -> SwModelInfo {
        let mut info = SwModelInfo::initial();
        unsafe { ok(sw_model_info(self.0, &mut info)) };
        info
    }

    pub fn save(&self) -> Vec<u8> {
        let mut size = 0;
        unsafe {
            ok(sw_model_save(self.0, null_mut(), 0, &mut size));
            let mut bytes = vec![0u8; size as usize];
            ok(sw_model_save(self.0, bytes.as_mut_ptr().cast(), size, &mut size));
            bytes
        }
    }

    /// The model of these bytes, if they are one.
    pub fn load(bytes: &[u8]) -> Option<Self> {
        let mut model = null_mut();
        let status = unsafe { sw_model_load(bytes.as_ptr().cast(), bytes.len() as u64, &mut model) };
        let loaded = ok_or(status, &[SW_ERROR_INVALID_DATA]);
        assert_eq!(loaded, !model.is_null());
        loaded.then_some(Self(model))
    }

    pub fn state(&self, method: u32, integrator: u32) -> State {
        let mut options = SwStateDesc::initial();
        (options.method, options.integrator) = (method, integrator);
        let mut state = null_mut();
        unsafe { ok(sw_state_create(self.0, &options, &mut state)) };
        State { handle: state, n_vertices: self.info().n_vertices as usize }
    }
}

pub struct State {
    pub handle: *mut SwState,
    pub n_vertices: usize,
}

impl Drop for State {
    fn drop(&mut self) {
        unsafe { sw_state_destroy(self.handle) }
    }
}

/// All that can be seen of a state.
#[derive(PartialEq)]
pub struct Seen {
    pub saved: Vec<u8>,
    pub positions: Vec<u64>,
    pub constraints: Vec<String>,
}

impl State {
    pub fn save(&self) -> Vec<u8> {
        let mut size = 0;
        unsafe {
            ok(sw_state_save(self.handle, null_mut(), 0, &mut size));
            let mut bytes = vec![0u8; size as usize];
            ok(sw_state_save(self.handle, bytes.as_mut_ptr().cast(), size, &mut size));
            bytes
        }
    }

    pub fn load(&self, bytes: &[u8]) -> bool {
        let status = unsafe { sw_state_load(self.handle, bytes.as_ptr().cast(), bytes.len() as u64) };
        ok_or(status, &[SW_ERROR_INVALID_DATA])
    }

    pub fn positions(&self, space: u32) -> Vec<f64> {
        let mut x = vec![0.0; 3 * self.n_vertices];
        let n = self.n_vertices as u32;
        unsafe { ok(sw_state_positions(self.handle, space, SW_FORMAT_F64, x.as_mut_ptr().cast(), 0, n)) };
        x
    }

    pub fn constraints(&self) -> Vec<SwConstraintReport> {
        let mut count = 0;
        unsafe {
            ok(sw_state_constraint_report(self.handle, null_mut(), REPORT_SIZE, 0, &mut count));
            let mut reports = Vec::with_capacity(count as usize);
            ok(sw_state_constraint_report(self.handle, reports.as_mut_ptr(), REPORT_SIZE, count, &mut count));
            reports.set_len(count as usize);
            reports
        }
    }

    pub fn seen(&self) -> Seen {
        let print =
            |r: SwConstraintReport| format!("{} {} {} {:?} {:?}", r.id, r.met, r.iterations, r.residual, r.force);
        Seen {
            saved: self.save(),
            positions: self.positions(SW_SPACE_WORLD).into_iter().map(f64::to_bits).collect(),
            constraints: self.constraints().into_iter().map(print).collect(),
        }
    }

    /// Everything that comes out is finite, and rotations turn.
    pub fn check_outputs(&self) {
        let n = self.n_vertices as u32;
        let mut x = vec![0.0; 4 * self.n_vertices];
        for space in [SW_SPACE_WORLD, SW_SPACE_FRAME] {
            all_finite("positions", &self.positions(space));
            unsafe { ok(sw_state_normals(self.handle, space, SW_FORMAT_F64, x.as_mut_ptr().cast(), 0, n)) };
            all_finite("normals", &x[..3 * self.n_vertices]);
            // A model for LMA alone has none.
            let status = unsafe { sw_state_rotations(self.handle, space, SW_FORMAT_F64, x.as_mut_ptr().cast(), 0, n) };
            if !ok_or(status, &[SW_ERROR_UNSUPPORTED]) {
                continue;
            }
            for r in x.chunks(4) {
                let norm = r.iter().map(|x| x * x).sum::<f64>();
                assert!((norm - 1.0).abs() < 1e-5, "a rotation {r:?}"); // a matrix of a host's is taken to 1e-4
            }
        }
        let mut report = SwStateReport::initial();
        unsafe { ok(sw_state_report(self.handle, &mut report)) };
        let measures = [report.time, report.max_rotation, report.max_displacement, report.fraction_turned_too_far];
        all_finite("report", &measures);
        all_finite("energies", &[report.kinetic_energy, report.elastic_energy, report.constraint_work]);
        for r in self.constraints() {
            all_finite("constraint", &[r.residual, r.force[0], r.force[1], r.force[2]]);
        }
    }
}
