//! The saved form of a state: magic, version and method in 16 bits each, model fingerprint, number of unknowns, then little-endian doubles (time, frame
//! pose and velocities, constraint work, unknowns, their rates), then a checksum of all before it. The unknowns are the modal
//! amplitudes, or those of a reduced shell's fields, or three displacements per vertex of a nonlinear shell. Loads, damping, constraints
//! and the pose asked for next are inputs and not saved. Version 1 had no method: its amplitudes mean something else to each, so that it
//! is refused.

use super::{Method, State};
use crate::error::invalid;
use crate::support::{Frame, Pose};
use crate::{Result, Vec3};
use nalgebra::{Quaternion, UnitQuaternion, Vector4};
use xxhash_rust::xxh3::xxh3_64;

const MAGIC: [u8; 4] = *b"SWST";
const VERSION: u16 = 2;
/// Bytes that tell what the rest is.
pub const HEADER: usize = 24;
const FIXED_DOUBLES: usize = 15;

fn word(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes"))
}

impl State {
    /// Size of [`State::save`].
    pub fn saved_size(&self) -> usize {
        HEADER + 8 * (FIXED_DOUBLES + 2 * self.motion.n_unknowns()) + 8
    }

    /// The dynamic state: restoring it continues bit for bit.
    pub fn save(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(self.saved_size());
        bytes.extend(MAGIC);
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend((self.method().number() as u16).to_le_bytes());
        bytes.extend(self.motion.fingerprint().to_le_bytes());
        bytes.extend((self.motion.n_unknowns() as u64).to_le_bytes());
        let mut push = |x: &f64| bytes.extend(x.to_le_bytes());
        let Frame { pose, velocity, angular_velocity, .. } = &self.frame;
        push(&self.time);
        pose.origin.iter().chain(pose.rotation.coords.iter()).for_each(&mut push);
        velocity.iter().chain(angular_velocity.iter()).for_each(&mut push);
        push(&self.motion.constraints().work);
        self.motion.unknowns().iter().flatten().for_each(push);
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
        let (unknowns, rates) = numbers[FIXED_DOUBLES..].split_at(self.motion.n_unknowns());
        self.motion.change(|set| set.work = numbers[14]);
        self.motion.set_unknowns([unknowns, rates]);
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
        let (found, expected) = (word(bytes, 16), self.motion.n_unknowns() as u64);
        if found != expected || bytes.len() != self.saved_size() {
            let sizes = format!("{} bytes for {found} unknowns", bytes.len());
            return invalid(format!("the saved state has {sizes}; this one has {} for {expected}", self.saved_size()));
        }
        let body = bytes.len() - 8;
        if xxh3_64(&bytes[..body]) != word(bytes, body) {
            return invalid("the saved state is damaged: its checksum does not match");
        }
        if word(bytes, 8) != self.motion.fingerprint() {
            return invalid("the saved state belongs to another model");
        }
        let numbers: Vec<f64> = (HEADER..body).step_by(8).map(|at| f64::from_bits(word(bytes, at))).collect();
        let turn = Vector4::from_column_slice(&numbers[4..8]).norm();
        if numbers.iter().any(|x| !x.is_finite()) || (turn - 1.0).abs() > 1e-9 || numbers[0] < 0.0 {
            return invalid("the saved state holds numbers out of range");
        }
        let (unknowns, rates) = numbers[FIXED_DOUBLES..].split_at(self.motion.n_unknowns());
        if !self.motion.is_representable([unknowns, rates]) {
            return invalid("the saved state moves vertices beyond all range");
        }
        Ok(numbers)
    }
}
