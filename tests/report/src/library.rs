//! The built shared library as a host sees it: the functions looked up by name, models and states that free themselves.
//!
//! The types come from the crate that the header is generated from; the test below holds each function to its declaration.
#![allow(unsafe_code)] // a host's calls across the interface

use crate::mesh::{Mesh, P3};
use anyhow::{Context, Result, bail};
use shellwarp::ffi::collider::{self, SwCollider, SwColliderDesc, SwColliderPoseDesc};
use shellwarp::ffi::constraint::{self, SwConstraintDesc, SwConstraintReport};
use shellwarp::ffi::load::{SwEquilibriumReport, SwForceDesc};
use shellwarp::ffi::material::{SW_ENERGY_KOITER, SW_MAP_ON_VERTICES, SwMaterialMap};
use shellwarp::ffi::mesh::SwMeshDesc;
use shellwarp::ffi::model::{SwMaterialDesc, SwModel, SwModelInfo, SwPrecomputeDesc, SwSupportDesc};
use shellwarp::ffi::pointer::{SW_FORMAT_F32, SW_FORMAT_F64};
use shellwarp::ffi::state::{self, SwDampingDesc, SwFrameDesc, SwState, SwStateDesc, SwStateReport};
use shellwarp::ffi::status;
use shellwarp::ffi::structs::Described;
use std::ffi::{CStr, c_char, c_void};
use std::path::Path;
use std::ptr::null_mut;
use std::sync::Arc;

macro_rules! functions {
    ($($module:ident::$name:ident($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// Every function that the report calls.
        struct Api {
            $($name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
            _library: libloading::Library,
        }

        impl Api {
            fn load(path: &Path) -> Result<Self> {
                // SAFETY: the library's initialisers do nothing; the types are those of the header.
                unsafe {
                    let library = libloading::Library::new(path).with_context(|| format!("{}", path.display()))?;
                    Ok(Self {
                        $($name: *library.get(concat!(stringify!($name), "\0").as_bytes())?,)*
                        _library: library,
                    })
                }
            }
        }

        #[cfg(test)]
        #[test]
        fn every_function_is_called_as_the_interface_declares_it() {
            $(let _: unsafe extern "C" fn($($argument),*) $(-> $result)? = shellwarp::ffi::$module::$name;)*
        }
    };
}

functions! {
    status::sw_last_error_message() -> *const c_char;
    status::sw_abi_version() -> u32;
    status::sw_version_string() -> *const c_char;
    model::sw_model_create(*const SwMeshDesc, *const SwMaterialDesc, *const SwSupportDesc, *mut *mut SwModel) -> u32;
    model::sw_model_precompute(*mut SwModel, *const SwPrecomputeDesc) -> u32;
    model::sw_model_destroy(*mut SwModel);
    model::sw_model_info(*const SwModel, *mut SwModelInfo) -> u32;
    model::sw_model_frequencies(*const SwModel, *mut f64, u32, *mut u32) -> u32;
    model::sw_model_mode_shape(*const SwModel, u32, u32, u32, *mut c_void, u64, u32) -> u32;
    state::sw_state_create(*const SwModel, *const SwStateDesc, *mut *mut SwState) -> u32;
    state::sw_state_destroy(*mut SwState);
    state::sw_state_set_gravity(*mut SwState, *const f64) -> u32;
    state::sw_state_set_damping(*mut SwState, *const SwDampingDesc) -> u32;
    state::sw_state_set_frame(*mut SwState, *const SwFrameDesc) -> u32;
    state::sw_state_set_amplitudes(*mut SwState, *const f64, *const f64, u32) -> u32;
    state::sw_state_step(*mut SwState, f64) -> u32;
    state::sw_state_positions(*const SwState, u32, u32, *mut c_void, u64, u32) -> u32;
    state::sw_state_normals(*const SwState, u32, u32, *mut c_void, u64, u32) -> u32;
    state::sw_state_rotations(*const SwState, u32, u32, *mut c_void, u64, u32) -> u32;
    state::sw_state_report(*const SwState, *mut SwStateReport) -> u32;
    collider::sw_collider_create(*const SwColliderDesc, *mut *mut SwCollider) -> u32;
    collider::sw_collider_destroy(*mut SwCollider);
    collider::sw_state_set_colliders(*mut SwState, *const *const SwCollider, u32) -> u32;
    collider::sw_state_move_collider(*mut SwState, u32, *const SwColliderPoseDesc) -> u32;
    constraint::sw_state_set_constraint(*mut SwState, *const SwConstraintDesc) -> u32;
    constraint::sw_state_clear_constraint(*mut SwState, u32) -> u32;
    constraint::sw_state_constraint_report(*const SwState, *mut SwConstraintReport, u32, u32, *mut u32) -> u32;
    load::sw_state_set_forces(*mut SwState, *const SwForceDesc) -> u32;
    load::sw_state_equilibrium(*mut SwState, *mut SwEquilibriumReport) -> u32;
}

impl Api {
    fn check(&self, status: u32) -> Result<()> {
        if status == status::SW_OK {
            return Ok(());
        }
        // SAFETY: never NULL, valid until the next failed call on this thread.
        let message = unsafe { CStr::from_ptr((self.sw_last_error_message)()) };
        bail!("{}", message.to_string_lossy())
    }
}

/// k_A, k_L, k_B and mass per area.
#[derive(Clone, Copy, Debug)]
pub struct Material {
    pub area: f64,
    pub length: f64,
    pub bend: f64,
    pub density: f64,
}

/// A sheet of Koiter's energy without Poisson's ratio, in place of a material; and how it varies.
#[derive(Clone, Debug)]
pub struct Sheet {
    pub young: f64,
    pub thickness: f64,
    pub density: f64,
    /// SW_MAP_... and its values at the vertices.
    pub map: Option<(u32, Vec<f64>)>,
    /// Edges, and what their stiffness is multiplied by.
    pub creases: Vec<([u32; 2], f64)>,
    /// Young's modulus across a direction, and the direction; `young` is along it.
    pub grain: Option<(f64, [f64; 3])>,
}

/// A solid about its origin.
#[derive(Clone, Copy, Debug)]
pub enum Solid {
    /// z ≤ 0.
    Plane,
    /// Its radius.
    Ball(f64),
    /// Along y: its radius and half its length.
    Rod(f64, f64),
    /// Half its sides.
    Box(P3),
}

/// The library.
#[derive(Clone)]
pub struct Library(Arc<Api>);

impl Library {
    pub fn open(path: &Path) -> Result<Self> {
        let api = Api::load(path)?;
        // SAFETY: no arguments.
        let version = unsafe { (api.sw_abi_version)() };
        if version < status::SW_ABI_VERSION {
            bail!("{}: interface version {version} is older than this program's", path.display());
        }
        Ok(Self(Arc::new(api)))
    }

    pub fn version(&self) -> String {
        // SAFETY: never NULL, constant.
        unsafe { CStr::from_ptr((self.0.sw_version_string)()) }.to_string_lossy().into_owned()
    }

    /// A model with its lowest modes. `fixed` are vertices.
    pub fn model(
        &self,
        mesh: &Mesh,
        material: Material,
        fixed: &[u32],
        modes: usize,
        f64_basis: bool,
    ) -> Result<Model> {
        self.reduced_model(mesh, material, fixed, modes, f64_basis, 0)
    }

    /// The same with fields for the reduced shell.
    pub fn reduced_model(
        &self,
        mesh: &Mesh,
        material: Material,
        fixed: &[u32],
        modes: usize,
        f64_basis: bool,
        fields: u32,
    ) -> Result<Model> {
        let mut c = SwMaterialDesc::initial();
        (c.k_area, c.k_length, c.k_bend, c.area_density) =
            (material.area, material.length, material.bend, material.density);
        self.model_of(mesh, &c, fixed, modes, f64_basis, fields)
    }

    /// The same of a sheet.
    pub fn sheet_model(&self, mesh: &Mesh, sheet: &Sheet, fixed: &[u32], modes: usize, fields: u32) -> Result<Model> {
        let mut c = SwMaterialDesc::initial();
        c.energy = SW_ENERGY_KOITER;
        (c.young, c.thickness, c.volume_density) = (sheet.young, sheet.thickness, sheet.density);
        let mut map = SwMaterialMap::initial();
        if let Some((quantity, values)) = &sheet.map {
            (map.quantity, map.on, map.format) = (*quantity, SW_MAP_ON_VERTICES, SW_FORMAT_F64);
            (map.values, map.count) = (values.as_ptr().cast(), values.len() as u32);
            (c.maps, c.n_maps) = (&map, 1);
        }
        let (edges, factors): (Vec<[u32; 2]>, Vec<f64>) = sheet.creases.iter().copied().unzip();
        (c.creases, c.crease_factors, c.n_creases) = (edges.as_ptr().cast(), factors.as_ptr(), edges.len() as u32);
        if let Some((across, direction)) = &sheet.grain {
            (c.young_across, c.directions, c.n_directions) = (*across, direction.as_ptr().cast(), 1);
            c.direction_format = SW_FORMAT_F64;
        }
        self.model_of(mesh, &c, fixed, modes, false, fields)
    }

    /// What the descriptor points to must live through the call.
    fn model_of(
        &self,
        mesh: &Mesh,
        material: &SwMaterialDesc,
        fixed: &[u32],
        modes: usize,
        f64_basis: bool,
        fields: u32,
    ) -> Result<Model> {
        let api = &self.0;
        let mut m = SwMeshDesc::initial();
        m.position_format = SW_FORMAT_F64;
        m.positions = mesh.positions.as_ptr().cast();
        m.triangles = mesh.triangles.as_ptr().cast();
        (m.n_vertices, m.n_triangles) = (mesh.positions.len() as u32, mesh.triangles.len() as u32);
        let mut s = SwSupportDesc::initial();
        (s.fixed, s.n_fixed) = (fixed.as_ptr(), fixed.len() as u32);
        let mut p = SwPrecomputeDesc::initial();
        (p.modes, p.precision) = (modes as u32, if f64_basis { 2 } else { 1 });
        p.reduced_fields = fields;
        let mut handle = null_mut();
        // SAFETY: descriptors and what they point to live through the calls.
        unsafe {
            api.check((api.sw_model_create)(&m, material, &s, &mut handle))?;
            let model = Model { api: api.clone(), handle, n: mesh.positions.len() };
            api.check((api.sw_model_precompute)(handle, &p))?;
            Ok(model)
        }
    }
}

/// A precomputed model.
pub struct Model {
    api: Arc<Api>,
    handle: *mut SwModel,
    n: usize,
}

impl Drop for Model {
    fn drop(&mut self) {
        // SAFETY: made by sw_model_create, destroyed once.
        unsafe { (self.api.sw_model_destroy)(self.handle) }
    }
}

impl Model {
    pub fn info(&self) -> Result<SwModelInfo> {
        let mut info = SwModelInfo::initial();
        // SAFETY: a live model, an initialised struct.
        self.api.check(unsafe { (self.api.sw_model_info)(self.handle, &mut info) })?;
        Ok(info)
    }

    pub fn frequencies(&self) -> Result<Vec<f64>> {
        let mut count = 0;
        let mut hertz = vec![0.0; self.info()?.modes as usize];
        // SAFETY: the buffer has as many entries as said.
        self.api.check(unsafe {
            (self.api.sw_model_frequencies)(self.handle, hertz.as_mut_ptr(), hertz.len() as u32, &mut count)
        })?;
        Ok(hertz)
    }

    /// Mode k's displacements (n).
    pub fn mode_shape(&self, mode: usize) -> Result<Vec<P3>> {
        let mut out = vec![[0.0; 3]; self.n];
        // SAFETY: the buffer has n x 3 doubles.
        self.api.check(unsafe {
            let to = out.as_mut_ptr().cast();
            (self.api.sw_model_mode_shape)(self.handle, mode as u32, 1, SW_FORMAT_F64, to, 0, self.n as u32)
        })?;
        Ok(out)
    }

    /// A state at rest, by SW_METHOD_... and SW_INTEGRATOR_....
    pub fn state(&self, method: u32, integrator: u32) -> Result<State> {
        let mut desc = SwStateDesc::initial();
        (desc.method, desc.integrator) = (method, integrator);
        let mut handle = null_mut();
        // SAFETY: a live model.
        self.api.check(unsafe { (self.api.sw_state_create)(self.handle, &desc, &mut handle) })?;
        Ok(State { api: self.api.clone(), handle, n: self.n })
    }
}

/// A rigid motion of the support: origin, yaw about y, and their first and second rates.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pose {
    pub origin: [P3; 3],
    pub yaw: [f64; 3],
}

/// A moving shell.
pub struct State {
    api: Arc<Api>,
    handle: *mut SwState,
    n: usize,
}

impl Drop for State {
    fn drop(&mut self) {
        // SAFETY: made by sw_state_create, destroyed once.
        unsafe { (self.api.sw_state_destroy)(self.handle) }
    }
}

// SAFETY throughout: a live state of this library, buffers of n_vertices, descriptors that live through the call.
impl State {
    pub fn set_gravity(&mut self, gravity: P3) -> Result<()> {
        self.api.check(unsafe { (self.api.sw_state_set_gravity)(self.handle, gravity.as_ptr()) })
    }

    /// Rayleigh's ξ.
    pub fn set_mass_damping(&mut self, coefficient: f64) -> Result<()> {
        let mut desc = SwDampingDesc::initial();
        desc.mass_coefficient = coefficient;
        self.api.check(unsafe { (self.api.sw_state_set_damping)(self.handle, &desc) })
    }

    pub fn set_frame(&mut self, pose: &Pose) -> Result<()> {
        let mut desc = SwFrameDesc::initial();
        desc.flags = state::SW_FRAME_MOTION_GIVEN;
        let (s, c) = pose.yaw[0].sin_cos();
        (desc.origin, desc.rotation) = (pose.origin[0], [c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c]);
        (desc.velocity, desc.acceleration) = (pose.origin[1], pose.origin[2]);
        (desc.angular_velocity[1], desc.angular_acceleration[1]) = (pose.yaw[1], pose.yaw[2]);
        self.api.check(unsafe { (self.api.sw_state_set_frame)(self.handle, &desc) })
    }

    /// A force on each of `vertices`, replacing all.
    pub fn set_forces(&mut self, vertices: &[u32], forces: &[P3]) -> Result<()> {
        let mut desc = SwForceDesc::initial();
        (desc.format, desc.count) = (SW_FORMAT_F64, vertices.len() as u32);
        (desc.forces, desc.vertices) = (forces.as_ptr().cast(), vertices.as_ptr());
        self.api.check(unsafe { (self.api.sw_state_set_forces)(self.handle, &desc) })
    }

    /// Holds a vertex along the axes of the mask at a world position.
    pub fn hold(&mut self, id: u32, vertex: u32, axes: u32, position: P3) -> Result<()> {
        let mut desc = SwConstraintDesc::initial();
        (desc.id, desc.kind, desc.vertex, desc.axes) = (id, constraint::SW_CONSTRAINT_POSITION, vertex, axes);
        desc.position = position;
        self.api.check(unsafe { (self.api.sw_state_set_constraint)(self.handle, &desc) })
    }

    /// Lets a handle go.
    pub fn release(&mut self, id: u32) -> Result<()> {
        self.api.check(unsafe { (self.api.sw_state_clear_constraint)(self.handle, id) })
    }

    /// Whether the last step met all constraints, and after how many linearizations.
    pub fn constraints_met(&self) -> Result<(bool, u32)> {
        let (size, mut count, call) = (size_of::<SwConstraintReport>() as u32, 0, self.api.sw_state_constraint_report);
        self.api.check(unsafe { call(self.handle, null_mut(), size, 0, &mut count) })?;
        let mut reports = Vec::with_capacity(count as usize);
        // SAFETY: as many as there is room for, all of them written on success.
        unsafe {
            self.api.check(call(self.handle, reports.as_mut_ptr(), size, count, &mut count))?;
            reports.set_len(count as usize);
        }
        Ok((reports.iter().all(|r| r.met == 1), reports.iter().map(|r| r.iterations).max().unwrap_or(0)))
    }

    /// The support is here at the end of the next step, its motion whatever that takes.
    pub fn set_place(&mut self, origin: P3) -> Result<()> {
        let mut desc = SwFrameDesc::initial();
        desc.origin = origin;
        self.api.check(unsafe { (self.api.sw_state_set_frame)(self.handle, &desc) })
    }

    /// Solids with a coefficient of friction each, in place of all others.
    pub fn set_colliders(&mut self, solids: &[(Solid, f64)]) -> Result<()> {
        let mut made: Vec<*const SwCollider> = vec![];
        let set = solids.iter().try_for_each(|(solid, friction)| {
            let mut desc = SwColliderDesc::initial();
            desc.friction = *friction;
            match *solid {
                Solid::Plane => desc.kind = collider::SW_COLLIDER_PLANE,
                Solid::Ball(radius) => (desc.kind, desc.radius) = (collider::SW_COLLIDER_SPHERE, radius),
                Solid::Rod(radius, half) => {
                    (desc.kind, desc.radius, desc.half_length) = (collider::SW_COLLIDER_CAPSULE, radius, half);
                }
                Solid::Box(half) => (desc.kind, desc.half_extents) = (collider::SW_COLLIDER_BOX, half),
            }
            let mut handle = null_mut();
            self.api.check(unsafe { (self.api.sw_collider_create)(&desc, &mut handle) })?;
            made.push(handle);
            Ok(())
        });
        let call = self.api.sw_state_set_colliders;
        let set = set.and_then(|()| self.api.check(unsafe { call(self.handle, made.as_ptr(), made.len() as u32) }));
        // The state keeps what it needs of them.
        made.iter().for_each(|handle| unsafe { (self.api.sw_collider_destroy)(handle.cast_mut()) });
        set
    }

    /// Where a collider is at the end of the next step; the first time, where it is. A rod lies along y, any other stands upright, or with `over` upside down.
    pub fn move_collider(&mut self, index: u32, solid: Solid, over: bool, origin: P3) -> Result<()> {
        let mut desc = SwColliderPoseDesc::initial();
        desc.origin = origin;
        desc.rotation = match (solid, over) {
            (Solid::Rod(..), _) => [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0],
            (_, true) => [1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0],
            (_, false) => [0.0; 9],
        };
        self.api.check(unsafe { (self.api.sw_state_move_collider)(self.handle, index, &desc) })
    }

    pub fn set_amplitudes(&mut self, q: &[f64]) -> Result<()> {
        let rest = vec![0.0; q.len()];
        let call = self.api.sw_state_set_amplitudes;
        self.api.check(unsafe { call(self.handle, q.as_ptr(), rest.as_ptr(), q.len() as u32) })
    }

    pub fn step(&mut self, h: f64) -> Result<()> {
        self.api.check(unsafe { (self.api.sw_state_step)(self.handle, h) })
    }

    /// Moves to the static solution.
    pub fn equilibrium(&mut self) -> Result<()> {
        self.api.check(unsafe { (self.api.sw_state_equilibrium)(self.handle, null_mut()) })
    }

    /// Positions as a host takes them: 32 bits, world axes.
    pub fn write_f32(&self, out: &mut [[f32; 3]]) -> Result<()> {
        assert_eq!(out.len(), self.n);
        let call = self.api.sw_state_positions;
        self.api.check(unsafe { call(self.handle, 0, SW_FORMAT_F32, out.as_mut_ptr().cast(), 0, self.n as u32) })
    }

    /// Positions in the support's frame (n).
    pub fn positions(&self) -> Result<Vec<P3>> {
        let mut out = vec![[0.0; 3]; self.n];
        let call = self.api.sw_state_positions;
        self.api.check(unsafe { call(self.handle, 1, SW_FORMAT_F64, out.as_mut_ptr().cast(), 0, self.n as u32) })?;
        Ok(out)
    }

    pub fn write_normals(&self, out: &mut [[f32; 3]]) -> Result<()> {
        assert_eq!(out.len(), self.n);
        let call = self.api.sw_state_normals;
        self.api.check(unsafe { call(self.handle, 0, SW_FORMAT_F32, out.as_mut_ptr().cast(), 0, self.n as u32) })
    }

    pub fn write_rotations(&self, out: &mut [[f32; 4]]) -> Result<()> {
        assert_eq!(out.len(), self.n);
        let call = self.api.sw_state_rotations;
        self.api.check(unsafe { call(self.handle, 0, SW_FORMAT_F32, out.as_mut_ptr().cast(), 0, self.n as u32) })
    }

    pub fn report(&self) -> Result<SwStateReport> {
        let mut report = SwStateReport::initial();
        self.api.check(unsafe { (self.api.sw_state_report)(self.handle, &mut report) })?;
        Ok(report)
    }
}
