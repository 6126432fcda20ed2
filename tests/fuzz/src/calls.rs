//! Any sequence of calls on a few models and states. After each one: no internal error; what failed changed nothing; what comes
//! out is finite.

use super::host::*;
use super::input::Input;
use shellwarp::ffi::batch::sw_states_step;
use shellwarp::ffi::certify::*;
use shellwarp::ffi::constraint::*;
use shellwarp::ffi::load::*;
use shellwarp::ffi::model::*;
use shellwarp::ffi::plan::sw_state_plan_text;
use shellwarp::ffi::pointer::SW_FORMAT_F64;
use shellwarp::ffi::state::*;
use shellwarp::ffi::status::*;
use shellwarp::ffi::structs::Described;
use std::ptr::null_mut;

/// Calls in one run, states at a time, and equilibria, which may take a thousand iterations.
const MAX_CALLS: usize = 40;
const MAX_STATES: usize = 3;
const MAX_EQUILIBRIA: usize = 1;

fn models() -> Vec<Model> {
    let sheet = Triangles::sheet(3, 1);
    let held = |change: &dyn Fn(&mut SwPrecomputeDesc)| {
        let mut options = SwPrecomputeDesc::initial();
        options.modes = 4;
        change(&mut options);
        sheet.model_by(&[0, 1, 2, 3], Some(&options))
    };
    let mut lone = Triangles::sheet(1, 1);
    lone.x.push([7.0, 7.0, 7.0]); // of no triangle
    vec![
        sheet.model(&[0, 1, 2, 3], 4, SW_PRECISION_F32),
        sheet.model(&[0, 1, 2, 3], 4, SW_PRECISION_F64),
        sheet.model(&[], 8, SW_PRECISION_F32),          // floats
        lone.model(&[0, 1], 12, SW_PRECISION_F64),      // a hinge
        lone.model(&[0, 1, 2, 3], 3, SW_PRECISION_F32), // no unknowns
        sheet.model(&[], 0, 0),                         // no modes
        held(&|o| o.precision = SW_PRECISION_I16),
        held(&|o| o.flags = SW_PRECOMPUTE_LINEAR),
        held(&|o| o.reduced_fields = 4),
        held(&|o| (o.precision, o.reduced_fields, o.reduced_poses) = (SW_PRECISION_F64, 8, 4)),
        held(&|o| o.sag_gravity = [0.0, 0.3, -1.0]),
    ]
}

struct Play<'a> {
    input: Input<'a>,
    models: &'a [Model],
    states: Vec<State>,
    saved: Vec<u8>,
    equilibria: usize,
}

type Handle = *mut SwState;

impl Play<'_> {
    fn create(&mut self) {
        let model = &self.models[self.input.below(self.models.len())];
        let mut options = SwStateDesc::initial();
        (options.method, options.integrator) = (self.input.code(9), self.input.code(3));
        options.flags = u32::from(self.input.one_in(64));
        let mut state = null_mut();
        let failures = [SW_ERROR_INVALID_ARGUMENT, SW_ERROR_NOT_PRECOMPUTED, SW_ERROR_UNSUPPORTED];
        if ok_or(unsafe { sw_state_create(model.0, &options, &mut state) }, &failures) {
            if self.states.len() == MAX_STATES {
                self.states.remove(0);
            }
            self.states.push(State { handle: state, n_vertices: model.info().n_vertices as usize });
        }
    }

    fn copy(&mut self, which: usize) {
        let mut copy = null_mut();
        unsafe { ok(sw_state_clone(self.states[which].handle, &mut copy)) };
        let copy = State { handle: copy, n_vertices: self.states[which].n_vertices };
        assert!(copy.seen() == self.states[which].seen(), "a clone differs");
        if self.states.len() == MAX_STATES {
            self.states.remove(0);
        }
        self.states.push(copy);
    }

    fn forces(&mut self, state: Handle, n: usize) -> SwStatus {
        let count = self.input.below(4);
        let forces: Vec<[f64; 3]> = (0..count.max(n)).map(|_| self.input.numbers()).collect();
        let vertices: Vec<u32> = (0..count).map(|_| self.input.index(n)).collect();
        let mut desc = SwForceDesc::initial();
        (desc.flags, desc.format) = (self.input.code(2), 2);
        (desc.count, desc.forces) = (count as u32, forces.as_ptr().cast());
        if self.input.one_in(8) {
            desc.count = n as u32;
        } else {
            desc.vertices = vertices.as_ptr();
        }
        unsafe { sw_state_set_forces(state, &desc) }
    }

    fn wind(&mut self, state: Handle, n: usize) -> SwStatus {
        let local: Vec<[f64; 3]> = (0..n).map(|_| self.input.numbers()).collect();
        let mut desc = SwWindDesc::initial();
        desc.velocity = self.input.numbers();
        (desc.density, desc.normal_drag) = (self.input.number().abs(), self.input.number().abs());
        desc.tangential_drag = self.input.number();
        if self.input.one_in(3) {
            (desc.local_format, desc.local_velocities) = (2, local.as_ptr().cast());
        }
        unsafe { sw_state_set_wind(state, &desc) }
    }

    fn damping(&mut self, state: Handle) -> SwStatus {
        let ratios: [f64; 12] = self.input.numbers::<12>().map(f64::abs);
        let mut desc = SwDampingDesc::initial();
        (desc.mass_coefficient, desc.stiffness_coefficient) = (self.input.number().abs(), self.input.number().abs());
        (desc.ratios, desc.n_ratios) = (ratios.as_ptr(), [0, 1, 4, 8, 12][self.input.below(5)]);
        unsafe { sw_state_set_damping(state, &desc) }
    }

    /// Row-major, of a rotation vector; now and then any numbers.
    fn rotation(&mut self) -> [f64; 9] {
        if self.input.one_in(16) {
            return self.input.numbers();
        }
        let turn = nalgebra::Vector3::from(self.input.numbers::<3>().map(|x| 3.0 * x));
        let turn = if turn.norm() < 1e3 { turn } else { nalgebra::Vector3::zeros() };
        let matrix = nalgebra::Rotation3::from_scaled_axis(turn).into_inner();
        std::array::from_fn(|i| matrix[(i / 3, i % 3)])
    }

    fn frame(&mut self, state: Handle) -> SwStatus {
        let mut desc = SwFrameDesc::initial();
        (desc.flags, desc.origin, desc.rotation) = (self.input.code(4), self.input.numbers(), self.rotation());
        if desc.flags & SW_FRAME_MOTION_GIVEN != 0 {
            (desc.velocity, desc.acceleration) = (self.input.numbers(), self.input.numbers());
            (desc.angular_velocity, desc.angular_acceleration) = (self.input.numbers(), self.input.numbers());
        }
        unsafe { sw_state_set_frame(state, &desc) }
    }

    fn constraint(&mut self, state: Handle, n: usize) -> SwStatus {
        let mut desc = SwConstraintDesc::initial();
        (desc.id, desc.kind, desc.vertex) = (self.input.code(4), self.input.code(3), self.input.index(n));
        desc.axes = self.input.code(8);
        desc.compliance = if self.input.one_in(4) { self.input.number() } else { 0.0 };
        desc.position = self.input.numbers();
        desc.rotation = self.rotation();
        unsafe { sw_state_set_constraint(state, &desc) }
    }

    fn amplitudes(&mut self, state: Handle) -> SwStatus {
        let (q, rate) = (self.input.numbers::<12>(), self.input.numbers::<12>());
        let count = [4, 8, 12][self.input.below(3)];
        unsafe { sw_state_set_amplitudes(state, q.as_ptr(), rate.as_ptr(), count) }
    }

    /// The present positions but for a vertex or a few, now and then with velocities.
    fn pose(&mut self, state: Handle, n: usize) -> SwStatus {
        let (space, mut missed) = (self.input.code(2), f64::NAN);
        let mut x = vec![[0.0; 3]; n];
        let status = unsafe { sw_state_positions(state, space, SW_FORMAT_F64, x.as_mut_ptr().cast(), 0, n as u32) };
        if !sane(status) {
            return status;
        }
        for _ in 0..self.input.below(4) {
            let vertex = self.input.below(n.max(1));
            let place = self.input.numbers();
            x.iter_mut().skip(vertex).take(1).for_each(|x| *x = place);
        }
        let rates: Vec<[f64; 3]> =
            if self.input.one_in(3) { (0..n).map(|_| self.input.numbers()).collect() } else { vec![] };
        let velocities = if rates.is_empty() { std::ptr::null() } else { rates.as_ptr().cast() };
        let count = if self.input.one_in(16) { self.input.index(n) } else { n as u32 };
        let (x, missed_by) = (x.as_ptr().cast(), &mut missed);
        let status = unsafe { sw_state_set_pose(state, space, SW_FORMAT_F64, x, 0, velocities, 0, count, missed_by) };
        assert!(if sane(status) { missed.is_finite() } else { missed.is_nan() }, "status {status}, missed {missed}");
        status
    }

    fn equilibrium(&mut self, state: Handle) -> SwStatus {
        self.equilibria += 1;
        if self.equilibria > MAX_EQUILIBRIA {
            return SW_OK;
        }
        if self.input.one_in(4) { self.sag(state) } else { unsafe { sw_state_equilibrium(state, null_mut()) } }
    }

    /// Looks for a stiffness, which takes equilibria. A search that finds none changes nothing.
    fn sag(&mut self, state: Handle) -> SwStatus {
        let which = self.states.iter().position(|s| s.handle == state).unwrap_or(0);
        let (before, mut factor) = (self.states[which].seen(), f64::NAN);
        let (length, tolerance) = (self.input.number(), if self.input.one_in(2) { self.input.number() } else { 0.0 });
        let status = unsafe { sw_state_set_sag(state, length, tolerance, &mut factor) };
        if sane(status) {
            assert!((1e-9..=1e9).contains(&factor), "factor {factor}");
        } else {
            assert!(
                factor.is_nan() && self.states[which].seen() == before,
                "status {status} changed a state, or {factor}"
            );
        }
        status
    }

    /// Estimates the error, which takes factorizations and so happens as seldom as an equilibrium.
    fn certify(&mut self, which: usize) -> SwStatus {
        self.equilibria += 1;
        if self.equilibria > MAX_EQUILIBRIA {
            return SW_OK;
        }
        let state = &self.states[which];
        let before = state.seen();
        let mut out = SwCertificate::initial();
        if ok_or(unsafe { sw_state_certify(state.handle, &mut out) }, &[SW_ERROR_NUMERICAL]) {
            all_finite("certificate", &[out.error, out.max_error, out.residual, out.remaining]);
        }
        assert!(state.seen() == before, "an estimate changed a state");
        let handle = state.handle;
        ok_or(
            unsafe { sw_state_correct(handle, self.input.code(3)) },
            &[SW_ERROR_INVALID_ARGUMENT, SW_ERROR_NUMERICAL],
        );
        SW_OK
    }

    /// Reads what changes nothing: the plan of a step, and the positions of some vertices.
    fn look(&mut self, which: usize) -> SwStatus {
        let State { handle: state, n_vertices: n } = self.states[which];
        let before = self.states[which].seen();
        let (mut size, h) = (0, self.input.number());
        let vertices: [u32; 3] = std::array::from_fn(|_| self.input.index(n));
        let mut out = [f64::NAN; 9];
        unsafe {
            let status = sw_state_plan_text(state, h, null_mut(), 0, &mut size);
            assert!(sane(status) == (size > 0), "status {status}, {size} bytes");
            let (list, to) = (vertices.as_ptr(), out.as_mut_ptr().cast());
            let status = sw_state_positions_of(state, SW_SPACE_WORLD, SW_FORMAT_F64, list, 3, to, 0);
            assert!(if sane(status) { out.iter().all(|x| x.is_finite()) } else { out.iter().all(|x| x.is_nan()) });
        }
        assert!(self.states[which].seen() == before, "reading changed a state");
        SW_OK
    }

    /// One call on the state; its status.
    fn call(&mut self, which: usize, kind: usize) -> SwStatus {
        let State { handle: state, n_vertices: n } = self.states[which];
        match kind {
            0 => self.forces(state, n),
            1 => self.wind(state, n),
            2 => self.damping(state),
            3 | 4 => self.frame(state),
            5 | 6 => self.constraint(state, n),
            7 => self.amplitudes(state),
            8 => {
                let gravity: [f64; 3] = self.input.numbers();
                unsafe { sw_state_set_gravity(state, gravity.as_ptr()) }
            }
            9 => unsafe { sw_state_clear_constraint(state, self.input.code(5)) },
            10 => unsafe { sw_state_reset(state) },
            11 => self.equilibrium(state),
            12 => {
                self.saved = self.states[which].save();
                SW_OK
            }
            13 => unsafe { sw_state_load(state, self.saved.as_ptr().cast(), self.saved.len() as u64) },
            14 => self.look(which),
            15 => unsafe { sw_state_set_rest_tolerance(state, self.input.number()) },
            16 => unsafe { sw_state_set_method(state, self.input.code(9)) },
            17 => self.certify(which),
            18 => self.pose(state, n),
            19 => unsafe { sw_state_set_stiffness(state, self.input.number()) },
            20 => unsafe { sw_state_set_frequency(state, self.input.number(), null_mut()) },
            _ => {
                let h = self.input.number();
                unsafe { sw_state_step(state, if self.input.one_in(8) { h } else { h.abs() }) }
            }
        }
    }

    /// Every state in one call, now and then one of them twice.
    fn step_all(&mut self) {
        let mut handles: Vec<Handle> = self.states.iter().map(|state| state.handle).collect();
        if self.input.one_in(8) {
            handles.push(handles[0]);
        }
        let before: Vec<Seen> = self.states.iter().map(State::seen).collect();
        let mut statuses = vec![SW_OK; handles.len()];
        let h = self.input.number();
        let out = statuses.as_mut_ptr();
        let status = unsafe { sw_states_step(handles.as_ptr(), handles.len() as u32, h, out) };
        sane(status);
        assert_eq!(status, statuses.iter().copied().find(|s| *s != SW_OK).unwrap_or(SW_OK));
        for ((state, before), status) in self.states.iter().zip(before).zip(statuses) {
            if status == SW_OK {
                state.check_outputs();
            } else {
                assert!(state.seen() == before, "a failed step of many changed a state");
            }
        }
    }

    fn next(&mut self) {
        let kind = self.input.below(28);
        if self.states.is_empty() || kind >= 26 {
            return self.create();
        }
        let which = self.input.below(self.states.len());
        match kind {
            24 => self.copy(which),
            25 => drop(self.states.remove(which)),
            23 => self.step_all(),
            _ => {
                let before = self.states[which].seen();
                if sane(self.call(which, kind)) {
                    self.states[which].check_outputs();
                } else {
                    assert!(self.states[which].seen() == before, "a failed call changed the state: {}", message());
                }
            }
        }
    }
}

pub fn run(bytes: &[u8]) {
    thread_local! {
        static MODELS: Vec<Model> = models();
    }
    MODELS.with(|models| {
        let input = Input::new(bytes);
        let mut play = Play { input, models, states: vec![], saved: vec![0], equilibria: 0 };
        for _ in 0..MAX_CALLS {
            if play.input.is_empty() {
                break;
            }
            play.next();
        }
    });
}
