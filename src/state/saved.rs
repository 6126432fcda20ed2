//! The saved form of a state: magic, version and method in 16 bits each, model fingerprint, number of unknowns, then little-endian doubles (time, frame
//! pose and velocities, constraint work, unknowns, their rates), then a checksum of all before it. The unknowns are the modal
//! amplitudes, or those of a reduced shell's fields, or three displacements per vertex of a nonlinear shell. Loads, damping, constraints
//! and the pose asked for next are inputs and not saved. Version 1 had no method: its amplitudes mean something else to each, so that it
//! is refused.

use super::reduced::Motion;
use super::{Dynamics, Method, Nodal, Reduced, State};
use crate::support::{Frame, Pose};
use crate::{Error, ErrorKind, Result, Vec3};
use nalgebra::{Quaternion, UnitQuaternion, Vector4};
use xxhash_rust::xxh3::xxh3_64;

const MAGIC: [u8; 4] = *b"SWST";
const VERSION: u16 = 2;
/// Bytes that tell what the rest is.
pub const HEADER: usize = 24;
const FIXED_DOUBLES: usize = 15;

fn invalid<T>(message: impl Into<String>) -> Result<T> {
    Err(Error::new(ErrorKind::InvalidData, message))
}

fn word(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes"))
}

impl State {
    fn n_unknowns(&self) -> usize {
        match &self.dynamics {
            Dynamics::Modal(modal) => modal.q.len(),
            Dynamics::Nodal(nodal) => 3 * nodal.u.len(),
            Dynamics::Reduced(reduced) => reduced.motion.q.len(),
        }
    }

    /// Of the model, as far as this kind of unknowns goes.
    fn fingerprint(&self) -> u64 {
        match &self.dynamics {
            Dynamics::Modal(_) | Dynamics::Nodal(_) => self.model.fingerprint,
            Dynamics::Reduced(_) => self.model.reduced_fingerprint,
        }
    }

    /// Size of [`State::save`].
    pub fn saved_size(&self) -> usize {
        HEADER + 8 * (FIXED_DOUBLES + 2 * self.n_unknowns()) + 8
    }

    /// The dynamic state: restoring it continues bit for bit.
    pub fn save(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(self.saved_size());
        bytes.extend(MAGIC);
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend((self.method().number() as u16).to_le_bytes());
        bytes.extend(self.fingerprint().to_le_bytes());
        bytes.extend((self.n_unknowns() as u64).to_le_bytes());
        let mut push = |x: &f64| bytes.extend(x.to_le_bytes());
        let Frame { pose, velocity, angular_velocity, .. } = &self.frame;
        push(&self.time);
        pose.origin.iter().chain(pose.rotation.coords.iter()).for_each(&mut push);
        velocity.iter().chain(angular_velocity.iter()).for_each(&mut push);
        match &self.dynamics {
            Dynamics::Modal(modal) => {
                push(&modal.constraint_work);
                modal.q.iter().chain(&modal.q_dot).for_each(push);
            }
            Dynamics::Nodal(nodal) => {
                push(&nodal.constraint_work);
                nodal.u.iter().chain(&nodal.velocity).flat_map(|v| v.iter()).for_each(push);
            }
            Dynamics::Reduced(reduced) => {
                push(&reduced.constraint_work);
                let Motion { q, q_dot } = &reduced.motion;
                q.iter().chain(q_dot).for_each(push);
            }
        }
        bytes.extend(xxh3_64(&bytes).to_le_bytes());
        bytes
    }

    /// Restores what [`State::save`] gave, on the same model. Fails without changing anything on damaged or foreign bytes.
    pub fn load(&mut self, bytes: &[u8]) -> Result<()> {
        let numbers = self.checked_numbers(bytes)?;
        let vector = |at: usize| Vec3::from_column_slice(&numbers[at..at + 3]);
        // Not renormalized: the same bits must come back.
        let rotation = UnitQuaternion::new_unchecked(Quaternion::from(Vector4::from_column_slice(&numbers[4..8])));
        let pose = Pose { origin: vector(1), rotation };
        self.rest.wake();
        self.time = numbers[0];
        self.placed = true;
        self.rates = Default::default();
        self.frame = Frame { velocity: vector(8), angular_velocity: vector(11), ..Frame::at_rest(pose) };
        let (unknowns, rates) = numbers[FIXED_DOUBLES..].split_at(self.n_unknowns());
        match &mut self.dynamics {
            Dynamics::Modal(modal) => {
                modal.constraint_work = numbers[14];
                modal.q.copy_from_slice(unknowns);
                modal.q_dot.copy_from_slice(rates);
            }
            Dynamics::Nodal(nodal) => {
                nodal.constraint_work = numbers[14];
                let copy = |to: &mut [Vec3], from: &[f64]| {
                    to.iter_mut().zip(from.chunks_exact(3)).for_each(|(to, from)| to.copy_from_slice(from));
                };
                copy(&mut nodal.u, unknowns);
                copy(&mut nodal.velocity, rates);
            }
            Dynamics::Reduced(reduced) => {
                reduced.constraint_work = numbers[14];
                reduced.motion.q.copy_from_slice(unknowns);
                reduced.motion.q_dot.copy_from_slice(rates);
            }
        }
        Ok(())
    }

    /// Fails unless the first [`HEADER`] bytes are of a saved state of this library's version and this state's method.
    pub fn check_saved_kind(&self, bytes: &[u8]) -> Result<()> {
        if bytes.len() < HEADER || bytes[..4] != MAGIC {
            return invalid(format!("these {} bytes are not a saved state", bytes.len()));
        }
        let half = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        match (half(4), half(6)) {
            (VERSION, _) => (),
            (1, 0) => {
                let unsaid = "the saved state has format version 1, which does not say its method";
                return invalid(format!("{unsaid}; this library reads {VERSION}: save it anew"));
            }
            (version, _) => {
                return invalid(format!("the saved state has format version {version}; this library reads {VERSION}"));
            }
        }
        let (own, number) = (self.method(), u32::from(half(6)));
        let Some(method) = Method::of_number(number) else {
            return invalid(format!("the saved state is of the method {number}, which this library does not know"));
        };
        if method != own {
            return invalid(format!("the saved state is of {method}, but this state moves by {own}"));
        }
        Ok(())
    }

    fn checked_numbers(&self, bytes: &[u8]) -> Result<Vec<f64>> {
        self.check_saved_kind(bytes)?;
        let (found, expected) = (word(bytes, 16), self.n_unknowns() as u64);
        if found != expected || bytes.len() != self.saved_size() {
            let sizes = format!("{} bytes for {found} unknowns", bytes.len());
            return invalid(format!("the saved state has {sizes}; this one has {} for {expected}", self.saved_size()));
        }
        let body = bytes.len() - 8;
        if xxh3_64(&bytes[..body]) != word(bytes, body) {
            return invalid("the saved state is damaged: its checksum does not match");
        }
        if word(bytes, 8) != self.fingerprint() {
            return invalid("the saved state belongs to another model");
        }
        let numbers: Vec<f64> = (HEADER..body).step_by(8).map(|at| f64::from_bits(word(bytes, at))).collect();
        let turn = Vector4::from_column_slice(&numbers[4..8]).norm();
        if numbers.iter().any(|x| !x.is_finite()) || (turn - 1.0).abs() > 1e-9 || numbers[0] < 0.0 {
            return invalid("the saved state holds numbers out of range");
        }
        let (unknowns, rates) = numbers[FIXED_DOUBLES..].split_at(self.n_unknowns());
        let vectors = |from: &[f64]| from.chunks_exact(3).map(Vec3::from_column_slice).collect::<Vec<_>>();
        let sound = match &self.dynamics {
            Dynamics::Modal(modal) => modal.has_meaning(&self.model.modal, unknowns, rates),
            Dynamics::Nodal(_) => Nodal::has_meaning(&self.model, &vectors(unknowns), &vectors(rates)),
            Dynamics::Reduced(_) => Reduced::has_meaning(&self.model, unknowns, rates),
        };
        if !sound {
            return invalid("the saved state moves vertices beyond all range");
        }
        Ok(numbers)
    }
}
