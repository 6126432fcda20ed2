//! Any colliders, anywhere, on the way of a few shells, and any points bound to these. After each call: no internal error; what failed changed
//! nothing; what comes out is finite.

use super::host::*;
use super::input::Input;
use shellwarp::ffi::binding::*;
use shellwarp::ffi::certify::sw_state_set_method;
use shellwarp::ffi::collider::*;
use shellwarp::ffi::load::sw_state_equilibrium;
use shellwarp::ffi::mesh::SwMeshDesc;
use shellwarp::ffi::model::*;
use shellwarp::ffi::pointer::SW_FORMAT_F64;
use shellwarp::ffi::state::*;
use shellwarp::ffi::status::*;
use shellwarp::ffi::structs::Described;
use std::ptr::null_mut;

/// Calls in one run, and equilibria, which may take a thousand iterations.
const MAX_CALLS: usize = 30;
const MAX_EQUILIBRIA: usize = 1;
const METHODS: [u32; 6] = [1, 2, 3, 4, 5, 8];

fn models() -> Vec<Model> {
    let sheet = Triangles::sheet(3, 1);
    vec![
        sheet.model(&[0, 1], 6, SW_PRECISION_F64),
        sheet.model(&[], 8, SW_PRECISION_F32), // floats
        Triangles::sheet(1, 1).model(&[0, 1], 4, SW_PRECISION_F64),
    ]
}

const BOX: [[f64; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 1.0],
    [0.0, 1.0, 1.0],
    [1.0, 1.0, 1.0],
];
const SIDES: [[u32; 3]; 12] = [
    [0, 2, 3],
    [0, 3, 1],
    [4, 5, 7],
    [4, 7, 6],
    [0, 1, 5],
    [0, 5, 4],
    [2, 6, 7],
    [2, 7, 3],
    [0, 4, 6],
    [0, 6, 2],
    [1, 3, 7],
    [1, 7, 5],
];

struct Collider(*mut SwCollider);

impl Drop for Collider {
    fn drop(&mut self) {
        unsafe { sw_collider_destroy(self.0) }
    }
}

struct Play<'a> {
    input: Input<'a>,
    state: State,
    colliders: Vec<Collider>,
    binding: *mut SwBinding,
    n_points: usize,
    equilibria: usize,
}

impl Drop for Play<'_> {
    fn drop(&mut self) {
        unsafe { sw_binding_destroy(self.binding) }
    }
}

impl Play<'_> {
    /// The box with some corners anywhere.
    fn corners(&mut self) -> [[f64; 3]; 8] {
        let mut corners = BOX;
        for _ in 0..self.input.below(3) {
            corners[self.input.below(8)] = self.input.numbers();
        }
        corners
    }

    fn create(&mut self) {
        let corners = self.corners();
        let mut mesh = SwMeshDesc::initial();
        mesh.position_format = SW_FORMAT_F64;
        (mesh.positions, mesh.triangles) = (corners.as_ptr().cast(), SIDES.as_ptr().cast());
        (mesh.n_vertices, mesh.n_triangles) = (8, 12);
        let mut desc = SwColliderDesc::initial();
        desc.kind = self.input.code(8);
        (desc.radius, desc.half_length) = (self.input.number().abs(), self.input.number().abs());
        desc.half_extents = self.input.numbers::<3>().map(f64::abs);
        desc.friction = if self.input.one_in(2) { self.input.number() } else { 0.4 };
        desc.thickness = if self.input.one_in(4) { self.input.number() } else { 0.0 };
        (desc.mesh, desc.cells) = (&mesh, 4 + self.input.below(8) as u32);
        if self.input.one_in(2) {
            desc.flags = SW_COLLIDER_ONE_SIDED;
            desc.depth = if self.input.one_in(2) { self.input.number() } else { 0.0 };
            mesh.n_triangles = 1 + self.input.below(12) as u32;
            desc.mesh = &mesh;
        }
        let mut made = null_mut();
        if sane(unsafe { sw_collider_create(&desc, &mut made) }) {
            self.colliders.push(Collider(made));
        }
        if self.colliders.len() > 3 {
            self.colliders.remove(0);
        }
    }

    fn set(&mut self) -> SwStatus {
        let list: Vec<*const SwCollider> = self.colliders.iter().map(|c| c.0.cast_const()).collect();
        unsafe { sw_state_set_colliders(self.state.handle, list.as_ptr(), list.len() as u32) }
    }

    fn place(&mut self) -> SwStatus {
        let mut pose = SwColliderPoseDesc::initial();
        (pose.origin, pose.flags) = (self.input.numbers(), self.input.code(2));
        if self.input.one_in(8) {
            pose.rotation = self.input.numbers();
        }
        unsafe { sw_state_move_collider(self.state.handle, self.input.code(3), &pose) }
    }

    fn deform(&mut self) -> SwStatus {
        let corners = self.corners();
        let count = if self.input.one_in(16) { self.input.index(8) } else { 8 };
        let (which, flags) = (self.input.code(3), self.input.code(2));
        let positions = corners.as_ptr().cast();
        unsafe { sw_state_deform_collider(self.state.handle, which, flags, SW_FORMAT_F64, positions, 0, count.min(8)) }
    }

    fn bind(&mut self, model: &Model) {
        let points: Vec<[f64; 3]> = (0..1 + self.input.below(6)).map(|_| self.input.numbers()).collect();
        let normals: Vec<[f64; 3]> = points.iter().map(|_| self.input.numbers()).collect();
        let mut desc = SwBindingDesc::initial();
        (desc.format, desc.n_points, desc.points) = (SW_FORMAT_F64, points.len() as u32, points.as_ptr().cast());
        if self.input.one_in(2) {
            desc.normals = normals.as_ptr().cast();
        }
        let mut made = null_mut();
        if sane(unsafe { sw_binding_create(model.0, &desc, &mut made) }) {
            unsafe { sw_binding_destroy(self.binding) };
            (self.binding, self.n_points) = (made, points.len());
        }
    }

    /// What changes nothing.
    fn look(&mut self) {
        let n = self.state.n_vertices;
        let (mut x, mut left) = (vec![[f64::NAN; 3]; n], f64::NAN);
        let out = x.as_mut_ptr().cast();
        unsafe {
            let space = self.input.code(2);
            let status =
                sw_state_positions_outside(self.state.handle, space, SW_FORMAT_F64, out, 0, n as u32, &mut left);
            if ok_or(status, &[SW_ERROR_INVALID_ARGUMENT, SW_ERROR_NUMERICAL]) {
                all_finite("positions outside", x.as_flattened());
                all_finite("what is left", &[left]);
            }
            let mut count = 0;
            ok(sw_state_contacts(self.state.handle, null_mut(), size_of::<SwContact>() as u32, 0, &mut count));
            if self.binding.is_null() {
                return;
            }
            let [mut points, mut velocities] = [(); 2].map(|()| vec![[f64::NAN; 3]; self.n_points]);
            let mut read = SwBoundPointsDesc::initial();
            (read.format, read.positions) = (SW_FORMAT_F64, points.as_mut_ptr().cast());
            read.velocities = velocities.as_mut_ptr().cast();
            if ok_or(sw_state_bound_points(self.state.handle, self.binding, &read), &[SW_ERROR_NUMERICAL]) {
                all_finite("bound points", points.as_flattened());
                all_finite("their velocities", velocities.as_flattened());
            }
        }
    }

    fn call(&mut self, kind: usize) -> SwStatus {
        let state = self.state.handle;
        match kind {
            0 | 1 => self.set(),
            2..=4 => self.place(),
            5 | 6 => self.deform(),
            7 => {
                let gravity: [f64; 3] = self.input.numbers();
                unsafe { sw_state_set_gravity(state, gravity.as_ptr()) }
            }
            8 => {
                self.equilibria += 1;
                if self.equilibria > MAX_EQUILIBRIA {
                    return SW_OK;
                }
                unsafe { sw_state_equilibrium(state, null_mut()) }
            }
            9 => {
                let saved = self.state.save();
                unsafe { sw_state_load(state, saved.as_ptr().cast(), saved.len() as u64) }
            }
            10 => unsafe { sw_state_set_method(state, METHODS[self.input.below(METHODS.len())]) },
            _ => {
                let h = self.input.number().abs();
                unsafe { sw_state_step(state, h) }
            }
        }
    }
}

pub fn run(bytes: &[u8]) {
    thread_local! {
        static MODELS: Vec<Model> = models();
    }
    MODELS.with(|models| {
        let mut input = Input::new(bytes);
        let model = &models[input.below(models.len())];
        let state = model.state(METHODS[input.below(METHODS.len())], 1 + input.below(2) as u32);
        let mut play = Play { input, state, colliders: vec![], binding: null_mut(), n_points: 0, equilibria: 0 };
        for _ in 0..MAX_CALLS {
            if play.input.is_empty() {
                break;
            }
            match play.input.below(22) {
                18 | 19 => play.create(),
                20 => play.bind(model),
                21 => play.look(),
                kind => {
                    let before = play.state.seen();
                    if sane(play.call(kind)) {
                        play.state.check_outputs();
                    } else {
                        assert!(play.state.seen() == before, "a failed call changed the state: {}", message());
                    }
                }
            }
        }
    });
}
