//! A moving shell: modal amplitudes over a shared [`Model`], and the loads on it. Cheap to make, clone and save.

use crate::constraint::{Constraint, Constraints, Outcome, Step};
use crate::error::{require_finite, require_non_negative};
use crate::model::with_basis;
use crate::step::modal_force::{self, BodyLoad};
use crate::step::{Integrator, Oscillator};
use crate::support::{Frame, Motion, Pose, Rates};
use crate::warp::{WarpedBlock, lane};
use crate::{Error, ErrorKind, Model, Result, Vec3};
use nalgebra::{Quaternion, UnitQuaternion};
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_64;

/// How amplitudes become positions and loads become modal forces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Modal warping: u = R̃(Ψq) Φq, f = Φᵀ RᵀF (the paper).
    Warp,
    /// Linear modal analysis: u = Φq, f = ΦᵀF.
    LinearModalAnalysis,
}

/// Axes in which output is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// World axes and origin.
    World,
    /// The support frame's.
    Frame,
}

/// Rayleigh damping and a ratio per mode: c = ξ + ζλ + 2 ratio √λ.
#[derive(Clone, Debug, Default)]
pub struct Damping {
    /// ξ, 1/s.
    pub mass_coefficient: f64,
    /// ζ, s.
    pub stiffness_coefficient: f64,
    /// Of critical, per mode; empty for none, one value for all modes.
    pub ratios: Vec<f64>,
}

/// Measures of the present state.
#[derive(Clone, Copy, Debug)]
pub struct Report {
    /// Seconds stepped since creation or reset.
    pub time: f64,
    /// ½ q̇ᵀq̇.
    pub kinetic_energy: f64,
    /// ½ qᵀΛq.
    pub elastic_energy: f64,
    /// Work done on the shell by constraints since creation or reset.
    pub constraint_work: f64,
    /// Largest |w|, rad.
    pub max_rotation: f64,
    /// Largest |u| in the frame.
    pub max_displacement: f64,
}

/// Beyond a quarter turn the warp's own error exceeds a fifth of the displacement (closed form of a strip bent to an arc).
pub const ROTATION_RANGE: f64 = std::f64::consts::FRAC_PI_2;

/// See the module's text.
#[derive(Clone)]
pub struct State {
    model: Arc<Model>,
    method: Method,
    integrator: Integrator,
    gravity: Vec3,
    /// c of each mode.
    damping: Vec<f64>,
    frame: Frame,
    time: f64,
    constraints: Constraints,
    constraint_work: f64,
    q: Vec<f64>,
    q_dot: Vec<f64>,
    /// The next q and q̇ until they are known to be finite, and the modal force.
    next: [Vec<f64>; 2],
    force: Vec<f64>,
}

impl State {
    /// At rest, without loads, undamped, the frame at the world's origin.
    pub fn new(model: Arc<Model>, method: Method, integrator: Integrator) -> Self {
        let zeros = vec![0.0; model.n_modes()];
        Self {
            method,
            integrator,
            gravity: Vec3::zeros(),
            damping: zeros.clone(),
            frame: Frame::at_rest(Pose::identity()),
            time: 0.0,
            constraints: Constraints::new(zeros.len()),
            constraint_work: 0.0,
            q: zeros.clone(),
            q_dot: zeros.clone(),
            next: [zeros.clone(), zeros.clone()],
            force: zeros,
            model,
        }
    }

    /// The model it moves on.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// Modal amplitudes q and their rates q̇.
    pub fn amplitudes(&self) -> (&[f64], &[f64]) {
        (&self.q, &self.q_dot)
    }

    /// Pose of the support frame at the end of the last step.
    pub fn pose(&self) -> &Pose {
        &self.frame.pose
    }

    /// Bytes of a state of `n_modes` modes.
    pub fn bytes_for(n_modes: usize) -> usize {
        size_of::<Self>() + 6 * size_of::<f64>() * n_modes
    }

    /// Back to rest and time 0. Loads, damping and constraints stay; the frame stays where it is, at rest.
    pub fn reset(&mut self) {
        self.q.fill(0.0);
        self.q_dot.fill(0.0);
        self.time = 0.0;
        self.constraint_work = 0.0;
        self.frame = Frame::at_rest(self.frame.target);
    }

    /// World axes, acceleration.
    pub fn set_gravity(&mut self, gravity: Vec3) -> Result<()> {
        for (c, name) in gravity.iter().zip(["gravity[0]", "gravity[1]", "gravity[2]"]) {
            require_finite(name, *c)?;
        }
        self.gravity = gravity;
        Ok(())
    }

    /// Replaces all damping.
    pub fn set_damping(&mut self, damping: &Damping) -> Result<()> {
        let xi = require_non_negative("mass_coefficient", damping.mass_coefficient)?;
        let zeta = require_non_negative("stiffness_coefficient", damping.stiffness_coefficient)?;
        let (given, modes) = (damping.ratios.len(), self.q.len());
        if given > 1 && given != modes {
            return Err(Error::argument(format!("{given} damping ratios for {modes} modes: give none, 1 or {modes}")));
        }
        for (k, ratio) in damping.ratios.iter().enumerate() {
            require_non_negative(&format!("ratios[{k}]"), *ratio)?;
        }
        let ratio = |k: usize| damping.ratios.get(k).or(damping.ratios.first()).copied().unwrap_or(0.0);
        let coefficient = |(k, lambda): (usize, &f64)| xi + zeta * lambda + 2.0 * ratio(k) * lambda.sqrt();
        self.damping = self.model.eigenvalues.iter().enumerate().map(coefficient).collect();
        Ok(())
    }

    /// Adds a constraint, or replaces the one with its id.
    pub fn set_constraint(&mut self, constraint: Constraint) -> Result<()> {
        self.constraints.set(constraint, self.model.shell.mass.len())
    }

    /// Removes a constraint. Fails if there is none with this id.
    pub fn clear_constraint(&mut self, id: u32) -> Result<()> {
        if self.constraints.clear(id) { Ok(()) } else { Err(Error::argument(format!("there is no constraint {id}"))) }
    }

    /// Removes all constraints.
    pub fn clear_constraints(&mut self) {
        self.constraints.clear_all();
    }

    /// The constraints, by ascending id, with what the last step made of them.
    pub fn constraints(&self) -> impl ExactSizeIterator<Item = (&Constraint, &Outcome)> {
        self.constraints.report()
    }

    /// Where the support frame is at the end of the next step. Before the first step it is simply placed there.
    pub fn set_frame(&mut self, target: Pose, motion: Motion) {
        if self.time == 0.0 {
            self.frame = Frame::at_rest(target);
        }
        self.frame.target = target;
        self.frame.motion = motion;
    }

    /// Replaces q and q̇ (modes each).
    pub fn set_amplitudes(&mut self, q: &[f64], q_dot: &[f64]) -> Result<()> {
        for (name, given) in [("amplitudes", q), ("velocities", q_dot)] {
            if given.len() != self.q.len() {
                return Err(Error::argument(format!("{} {name} for {} modes", given.len(), self.q.len())));
            }
            for (k, x) in given.iter().enumerate() {
                require_finite(&format!("{name}[{k}]"), *x)?;
            }
        }
        self.q.copy_from_slice(q);
        self.q_dot.copy_from_slice(q_dot);
        Ok(())
    }

    /// Advances by `h` > 0 seconds. Loads turn with the shell as it was at the start of the step (paper eq. 12). Fails, and
    /// leaves everything as it was, when the result would not be finite. Does not allocate.
    pub fn step(&mut self, h: f64) -> Result<()> {
        if !(h.is_finite() && h > 0.0) {
            return Err(Error::argument(format!("the step is {h} s: it must be positive and finite")));
        }
        let mut frame = self.frame;
        let rates = frame.advance(h);
        self.compute_force(&frame.pose, &rates);
        self.move_freely(h);
        let work = self.meet_constraints(&frame.pose, h);
        let finite = self.next.iter().flatten().all(|x| x.is_finite()) && (self.time + h + work).is_finite();
        if !finite {
            let message = format!("the step of {h} s from time {} s does not give finite amplitudes", self.time);
            return Err(Error::new(ErrorKind::Numerical, message));
        }
        let [next_q, next_q_dot] = &mut self.next;
        std::mem::swap(&mut self.q, next_q);
        std::mem::swap(&mut self.q_dot, next_q_dot);
        self.frame = frame;
        self.time += h;
        self.constraint_work += work;
        Ok(())
    }

    /// The next q and q̇ without constraints.
    fn move_freely(&mut self, h: f64) {
        let [next_q, next_q_dot] = &mut self.next;
        for k in 0..self.q.len() {
            let oscillator = Oscillator { damping: self.damping[k], eigenvalue: self.model.eigenvalues[k] };
            (next_q[k], next_q_dot[k]) =
                oscillator.advance(self.integrator, self.q[k], self.q_dot[k], self.force[k], h);
        }
    }

    /// Moves the next q and q̇ to where the constraints are met; returns the work done.
    fn meet_constraints(&mut self, pose: &Pose, h: f64) -> f64 {
        let Self { model, method, constraints, damping, q, next: [next_q, next_q_dot], .. } = self;
        if constraints.is_empty() {
            return 0.0;
        }
        let mesh = &model.shell.mesh;
        let modes = (&damping[..], &model.eigenvalues[..]);
        let step = Step {
            pose,
            h,
            modes,
            rest: &mesh.positions,
            size: mesh.size,
            bend: &model.bend,
            warped: *method == Method::Warp,
        };
        with_basis!(&model.basis, basis => constraints.project(basis, &step, q, (next_q, next_q_dot)))
    }

    fn compute_force(&mut self, pose: &Pose, rates: &Rates) {
        let Self { model, method, gravity, q, q_dot, force, .. } = self;
        let load = BodyLoad::new(*gravity, pose, rates);
        let warped = *method == Method::Warp;
        with_basis!(&model.basis, basis => {
            modal_force::project(basis, &model.shell, &load, warped, (q, q_dot), force);
        });
    }

    /// Hands displacement u (frame axes) and rotation vector w of every vertex to `visit`, in order.
    fn visit_vertices(&self, mut visit: impl FnMut(usize, Vec3, Vec3)) {
        with_basis!(&self.model.basis, basis => for block in 0..basis.n_blocks() {
            let warped = WarpedBlock::new(basis, block, &self.q);
            let u = match self.method {
                Method::Warp => warped.displacement(),
                Method::LinearModalAnalysis => *warped.linear(),
            };
            let first = block * crate::warp::LANES;
            for i in 0..crate::warp::LANES.min(basis.n_vertices - first) {
                visit(first + i, lane(&u, i), lane(&warped.w, i));
            }
        });
    }

    fn rotation_to(&self, space: Space) -> UnitQuaternion<f64> {
        match space {
            Space::World => self.frame.pose.rotation,
            Space::Frame => UnitQuaternion::identity(),
        }
    }

    /// Hands the deformed position of every vertex to `write`, in order.
    pub fn positions(&self, space: Space, mut write: impl FnMut(usize, Vec3)) {
        let rest = &self.model.shell.mesh.positions;
        let Pose { origin, rotation } = match space {
            Space::World => self.frame.pose,
            Space::Frame => Pose::identity(),
        };
        if rotation == UnitQuaternion::identity() {
            self.visit_vertices(|v, u, _| write(v, origin + (rest[v] + u))); // exact at rest
        } else {
            let matrix = rotation.to_rotation_matrix();
            self.visit_vertices(|v, u, _| write(v, origin + matrix * (rest[v] + u)));
        }
    }

    /// Hands the area-weighted unit normal of the deformed shell at every vertex to `write`; zero at unreferenced ones.
    pub fn normals(&self, space: Space, mut write: impl FnMut(usize, Vec3)) -> Result<()> {
        let mut x = crate::error::try_zeroed("the deformed positions", self.model.shell.mass.len())?;
        self.positions(Space::Frame, |v, position| x[v] = position);
        let rotation = self.rotation_to(space);
        self.model.shell.mesh.normals(&x).into_iter().enumerate().for_each(|(v, n)| write(v, rotation * n));
        Ok(())
    }

    /// Hands the rotation of every vertex's frame to `write`: exp [w]×, in world space turned with the support frame.
    pub fn rotations(&self, space: Space, mut write: impl FnMut(usize, UnitQuaternion<f64>)) {
        let frame = self.rotation_to(space);
        self.visit_vertices(|v, _, w| write(v, frame * UnitQuaternion::from_scaled_axis(w)));
    }

    /// Energies, and how far the shell is bent.
    pub fn report(&self) -> Report {
        let half_sum = |terms: &mut dyn Iterator<Item = f64>| 0.5 * terms.sum::<f64>();
        let eigenvalues = &self.model.eigenvalues;
        let (mut rotation, mut displacement) = (0.0f64, 0.0f64);
        self.visit_vertices(|_, u, w| {
            rotation = rotation.max(w.norm_squared());
            displacement = displacement.max(u.norm_squared());
        });
        Report {
            time: self.time,
            kinetic_energy: half_sum(&mut self.q_dot.iter().map(|v| v * v)),
            constraint_work: self.constraint_work,
            elastic_energy: half_sum(&mut self.q.iter().zip(eigenvalues).map(|(q, lambda)| lambda * q * q)),
            max_rotation: rotation.sqrt(),
            max_displacement: displacement.sqrt(),
        }
    }
}

/// The saved form: magic, version, model fingerprint, number of modes, then little-endian doubles (time, frame pose and
/// velocities, constraint work, q, q̇), then a checksum of all before it. Loads, damping and the pose asked for next are inputs, not saved.
const MAGIC: [u8; 4] = *b"SWST";
const VERSION: u32 = 1;
const HEADER: usize = 24;
const FIXED_DOUBLES: usize = 15;

impl State {
    /// Size of [`State::save`].
    pub fn saved_size(&self) -> usize {
        HEADER + 8 * (FIXED_DOUBLES + 2 * self.q.len()) + 8
    }

    /// The dynamic state: restoring it continues bit for bit.
    pub fn save(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(self.saved_size());
        bytes.extend(MAGIC);
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend(self.model.fingerprint.to_le_bytes());
        bytes.extend((self.q.len() as u64).to_le_bytes());
        let Frame { pose, velocity, angular_velocity, .. } = &self.frame;
        let fixed =
            [self.time].into_iter().chain(pose.origin.iter().copied()).chain(pose.rotation.coords.iter().copied());
        let fixed =
            fixed.chain(velocity.iter().copied()).chain(angular_velocity.iter().copied()).chain([self.constraint_work]);
        fixed
            .chain(self.q.iter().copied())
            .chain(self.q_dot.iter().copied())
            .for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend(xxh3_64(&bytes).to_le_bytes());
        bytes
    }

    /// Restores what [`State::save`] gave, on the same model. Fails without changing anything on damaged or foreign bytes.
    pub fn load(&mut self, bytes: &[u8]) -> Result<()> {
        let invalid = |message: String| Err(Error::new(ErrorKind::InvalidData, message));
        let word = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes"));
        if bytes.len() < HEADER + 8 || bytes[..4] != MAGIC {
            return invalid(format!("these {} bytes are not a saved state", bytes.len()));
        }
        let version = u32::from_le_bytes(bytes[4..8].try_into().expect("four bytes"));
        if version != VERSION {
            return invalid(format!("the saved state has format version {version}; this library reads {VERSION}"));
        }
        if word(16) != self.q.len() as u64 || bytes.len() != self.saved_size() {
            let message = format!(
                "{} bytes of {} modes; this model's {} modes need {}",
                bytes.len(),
                word(16),
                self.q.len(),
                self.saved_size()
            );
            return invalid(format!("the saved state has the wrong size: {message}"));
        }
        let body = bytes.len() - 8;
        if xxh3_64(&bytes[..body]) != word(body) {
            return invalid("the saved state is damaged: its checksum does not match".into());
        }
        if word(8) != self.model.fingerprint {
            return invalid("the saved state belongs to another model".into());
        }
        let numbers: Vec<f64> = (HEADER..body).step_by(8).map(|at| f64::from_bits(word(at))).collect();
        let rotation = Quaternion::from(nalgebra::Vector4::from_column_slice(&numbers[4..8]));
        if numbers.iter().any(|x| !x.is_finite()) || (rotation.norm() - 1.0).abs() > 1e-9 || numbers[0] < 0.0 {
            return invalid("the saved state holds numbers out of range".into());
        }
        let vector = |at: usize| Vec3::from_column_slice(&numbers[at..at + 3]);
        // Not renormalized: the same bits must come back.
        let pose = Pose { origin: vector(1), rotation: UnitQuaternion::new_unchecked(rotation) };
        self.time = numbers[0];
        self.constraint_work = numbers[14];
        self.frame = Frame { velocity: vector(8), angular_velocity: vector(11), ..Frame::at_rest(pose) };
        let (q, q_dot) = numbers[FIXED_DOUBLES..].split_at(self.q.len());
        self.q.copy_from_slice(q);
        self.q_dot.copy_from_slice(q_dot);
        Ok(())
    }
}
