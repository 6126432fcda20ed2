//! The saved form of a state: magic, version and method in 16 bits each, model fingerprint, number of unknowns, then little-endian doubles (time, frame
//! pose and velocities, constraint work, unknowns, their rates; where there are solids, how many of them and of contacts, and these), then a checksum of all before it. The unknowns are the modal
//! amplitudes, or those of a reduced shell's fields, or three displacements per vertex of a nonlinear shell. Loads, damping, constraints,
//! the pose asked for next, the stiffness factor, by which rates are, and solids but for where they are, are inputs and not saved. Version 1 had no method: its amplitudes mean something else to each, so that it
//! is refused. A state without solids has version 2, one with them version 3. Where supports moved it is version 4: after the unknowns
//! come how many supports there are and, three numbers each, where they are in the frame and their rates, and then the solids, none too. Where
//! the rest shape moved it is version 5: in the place of supports come the number of vertices, whether the shape was placed without a step since, its stretch
//! and, for each vertex, its place, turn and both their rates. Where a correction is kept the version's second byte is 1, and before the checksum come whether
//! it is of this pose, its way and its stresses. In a state whose rest shape moves one of an older version leaves that where it was sent.

use super::moving_rest::{MovingRest, VERTEX_DOUBLES};
use super::{MOST_OBSTACLES, Method, State};
use crate::contact::{CONTACT_DOUBLES, Contacts, OBSTACLE_DOUBLES};
use crate::error::invalid;
use crate::modes::supported;
use crate::support::{Frame, Pose};
use crate::{Result, Vec3};
use nalgebra::{Quaternion, UnitQuaternion, Vector4};
use xxhash_rust::xxh3::xxh3_64;

const MAGIC: [u8; 4] = *b"SWST";
/// Of a state without solids, and of one with them.
const VERSION: u16 = 2;
const WITH_CONTACTS: u16 = 3;
/// Of one whose supports moved.
const WITH_SUPPORTS: u16 = 4;
/// Of one whose rest shape moves.
const WITH_REST: u16 = 5;
/// Beside one of these: a correction is kept.
const WITH_CORRECTION: u16 = 0x100;
/// Bytes that tell what the rest is.
pub const HEADER: usize = 24;
const FIXED_DOUBLES: usize = 15;

fn word(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes"))
}

impl State {
    /// Size of [`State::save`].
    pub fn saved_size(&self) -> usize {
        let contacts = self.contacts.as_ref().map_or(0, |contacts| {
            let [obstacles, touching] = contacts.saved_counts();
            2 + OBSTACLE_DOUBLES * obstacles + CONTACT_DOUBLES * touching
        });
        let moved = self.support_doubles() + self.moving_rest.as_ref().map_or(0, |_| self.rest_doubles());
        let none = if moved > 0 && self.contacts.is_none() { 2 } else { 0 };
        let correction = self.correction.as_ref().map_or(0, |_| self.correction_doubles());
        HEADER + 8 * (self.motion_doubles() + moved + contacts + none + correction) + 8
    }

    /// Of the model, and of the stiffness factor, by which rates are.
    fn mark(&self) -> u64 {
        self.motion.fingerprint() ^ self.tempo.mark()
    }

    /// Whether bytes of a saved state of this model and method can be as many.
    pub fn takes_saved_size(&self, size: u64) -> bool {
        let least = (HEADER + 8 * self.motion_doubles() + 8) as u64;
        let room =
            |contacts: &Contacts| OBSTACLE_DOUBLES * contacts.obstacles.len() + CONTACT_DOUBLES * contacts.capacity();
        let contacts = 2 + self.contacts.as_deref().map_or(OBSTACLE_DOUBLES * MOST_OBSTACLES, room);
        let moved = (1 + 6 * supported(&self.model.shell).len()).max(self.rest_doubles());
        (least..=least + 8 * (contacts + moved + self.correction_doubles()) as u64).contains(&size)
    }

    /// Numbers about supports.
    fn support_doubles(&self) -> usize {
        self.supports.as_ref().map_or(0, |supports| 1 + 6 * supports.held.len())
    }

    /// Numbers about a rest shape that moves.
    fn rest_doubles(&self) -> usize {
        3 + VERTEX_DOUBLES * self.model.shell.mass.len()
    }

    /// Numbers of a saved state's first part.
    fn motion_doubles(&self) -> usize {
        FIXED_DOUBLES + 2 * self.motion.n_unknowns()
    }

    /// The dynamic state: restoring it continues bit for bit.
    pub fn save(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(self.saved_size());
        bytes.extend(MAGIC);
        let version = match (&self.supports, &self.contacts) {
            _ if self.moving_rest.is_some() => WITH_REST,
            (Some(_), _) => WITH_SUPPORTS,
            (None, Some(_)) => WITH_CONTACTS,
            (None, None) => VERSION,
        };
        let correction = self.correction.as_ref().map_or(0, |_| WITH_CORRECTION);
        bytes.extend((version | correction).to_le_bytes());
        bytes.extend((self.method().number() as u16).to_le_bytes());
        bytes.extend(self.mark().to_le_bytes());
        bytes.extend((self.motion.n_unknowns() as u64).to_le_bytes());
        let mut push = |x: &f64| bytes.extend(x.to_le_bytes());
        let Frame { pose, velocity, angular_velocity, .. } = &self.frame;
        push(&self.time);
        pose.origin.iter().chain(pose.rotation.coords.iter()).for_each(&mut push);
        velocity.iter().chain(angular_velocity.iter()).for_each(&mut push);
        push(&self.motion.constraints().work);
        self.motion.unknowns().iter().flatten().for_each(&mut push);
        if let Some(supports) = &self.supports {
            push(&(supports.held.len() as f64));
            supports.now.iter().chain(&supports.rates).flatten().for_each(&mut push);
        }
        if let Some(rest) = &self.moving_rest {
            push(&(self.model.shell.mass.len() as f64));
            rest.save(&mut push);
        }
        match &self.contacts {
            Some(contacts) => {
                contacts.saved_counts().iter().for_each(|n| push(&(*n as f64)));
                contacts.save(&mut |x| push(&x));
            }
            None if version >= WITH_SUPPORTS => [0.0; 2].iter().for_each(&mut push),
            None => (),
        }
        if let Some(correction) = &self.correction {
            correction.save(&mut push);
        }
        bytes.extend(xxh3_64(&bytes).to_le_bytes());
        bytes
    }

    /// Restores what [`State::save`] gave, on the same model. Fails without changing anything on damaged or foreign bytes.
    pub fn load(&mut self, bytes: &[u8]) -> Result<()> {
        let numbers = self.checked_numbers(bytes)?;
        let (numbers, correction) = self.without_correction(bytes, &numbers);
        let (motion, others) = numbers.split_at(self.motion_doubles());
        let with_rest = bytes[4] == WITH_REST as u8;
        let moved = match bytes[4] == WITH_SUPPORTS as u8 {
            true => 1 + 6 * supported(&self.model.shell).len(),
            false if with_rest => self.rest_doubles(),
            false => 0,
        };
        let (moved, contacts) = others.split_at(moved);
        if with_rest {
            let rest = MovingRest::saved(&moved[1..])?;
            let before = self.moving_rest.replace(Box::new(rest));
            if let Err(error) = self.make_room() {
                self.moving_rest = before;
                return Err(error);
            }
            self.supports = None;
        } else {
            self.restore_supports(moved)?;
            match &mut self.moving_rest {
                Some(_) if self.supports.is_some() => self.moving_rest = None,
                Some(rest) => rest.stop(),
                None => (),
            }
        }
        let vector = |at: usize| Vec3::from_column_slice(&numbers[at..at + 3]);
        // Not renormalized: the same bits must come back.
        let rotation = UnitQuaternion::new_unchecked(Quaternion::from(Vector4::from_column_slice(&numbers[4..8])));
        let pose = Pose { origin: vector(1), rotation };
        self.rest.wake();
        self.time = numbers[0];
        self.placed = true;
        self.rates = Default::default();
        self.frame = Frame { velocity: vector(8), angular_velocity: vector(11), ..Frame::at_rest(pose) };
        self.carry_motion();
        let (unknowns, rates) = motion[FIXED_DOUBLES..].split_at(self.motion.n_unknowns());
        self.motion.change(|set| set.work = numbers[14]);
        self.motion.set_unknowns([unknowns, rates]);
        let touched = contacts.first().is_some_and(|obstacles| *obstacles > 0.0);
        match &mut self.contacts {
            Some(own) if touched => own.load(&contacts[2..]),
            _ => self.forget_past(),
        }
        self.restore_correction(correction);
        Ok(())
    }

    /// The numbers of a saved state before those of a correction, and these.
    fn without_correction<'a>(&self, bytes: &[u8], numbers: &'a [f64]) -> (&'a [f64], &'a [f64]) {
        let own = if bytes[5] == 1 { self.correction_doubles().min(numbers.len()) } else { 0 };
        numbers.split_at(numbers.len() - own)
    }

    /// Fails unless the first [`HEADER`] bytes are of a saved state of this library's version and this state's method.
    pub fn check_saved_kind(&self, bytes: &[u8]) -> Result<()> {
        if bytes.len() < HEADER || bytes[..4] != MAGIC {
            return invalid(format!("these {} bytes are not a saved state", bytes.len()));
        }
        let half = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        match (half(4) & !WITH_CORRECTION, half(6)) {
            (VERSION | WITH_CONTACTS | WITH_SUPPORTS | WITH_REST, _) => (),
            (1, 0) => {
                let unsaid = "the saved state has format version 1, which does not say its method";
                return invalid(format!("{unsaid}; this library reads {VERSION} to {WITH_REST}: save it anew"));
            }
            _ => {
                let reads = format!("this library reads {VERSION} to {WITH_REST}");
                return invalid(format!("the saved state has format version {}; {reads}", half(4)));
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
        let body = bytes.len() - 8;
        let correction = if bytes[5] == 1 { self.correction_doubles() } else { 0 };
        let least = HEADER + 8 * (self.motion_doubles() + correction);
        let short = if bytes[4] == VERSION as u8 { body != least } else { body <= least };
        if found != expected || short || !body.is_multiple_of(8) {
            let sizes = format!("{} bytes for {found} unknowns", bytes.len());
            return invalid(format!("the saved state has {sizes}; this one has {} for {expected}", self.saved_size()));
        }
        if xxh3_64(&bytes[..body]) != word(bytes, body) {
            return invalid("the saved state is damaged: its checksum does not match");
        }
        if word(bytes, 8) != self.mark() {
            return invalid("the saved state belongs to another model, or another stiffness factor: set that first");
        }
        let numbers: Vec<f64> = (HEADER..body).step_by(8).map(|at| f64::from_bits(word(bytes, at))).collect();
        let turn = Vector4::from_column_slice(&numbers[4..8]).norm();
        if numbers.iter().any(|x| !x.is_finite()) || (turn - 1.0).abs() > 1e-9 || numbers[0] < 0.0 {
            return invalid("the saved state holds numbers out of range");
        }
        let (checked, correction) = self.without_correction(bytes, &numbers);
        if bytes[5] == 1 {
            self.check_saved_correction(correction)?;
        }
        let (motion, rest) = checked.split_at(self.motion_doubles());
        let moved = match u16::from(bytes[4]) {
            WITH_SUPPORTS => self.check_saved_supports(rest)?,
            WITH_REST => self.check_saved_rest(rest)?,
            _ => 0,
        };
        let contacts = &rest[moved..];
        let (unknowns, rates) = motion[FIXED_DOUBLES..].split_at(self.motion.n_unknowns());
        if !self.motion.is_representable([unknowns, rates]) {
            return invalid("the saved state moves vertices beyond all range");
        }
        self.check_saved_contacts(contacts, moved > 0)?;
        Ok(numbers)
    }

    /// How many numbers are about the rest shape. Fails where they are of none, or one that this state cannot have.
    fn check_saved_rest(&self, numbers: &[f64]) -> Result<usize> {
        self.check_can_move_rest()?;
        let (n, doubles) = (self.model.shell.mass.len(), self.rest_doubles());
        if numbers.len() < doubles || numbers[0] != n as f64 {
            return invalid(format!("the saved state's rest shape is not one of {n} vertices"));
        }
        MovingRest::check_saved(&numbers[1..doubles], self.model.shell.mesh.size)?;
        Ok(doubles)
    }

    /// Of what follows the motion: how many solids and contacts, and these.
    fn check_saved_contacts(&self, numbers: &[f64], with_counts: bool) -> Result<()> {
        let [obstacles, touching, rest @ ..] = numbers else { return Ok(()) };
        let most = (numbers.len() + 1) as f64;
        let whole = |n: &f64| (0.0..most).contains(n) && n.fract() == 0.0 && n.is_sign_positive();
        let counts = [obstacles, touching].map(|n| if whole(n) { *n as usize } else { usize::MAX / 8 });
        let doubles =
            OBSTACLE_DOUBLES.saturating_mul(counts[0]).saturating_add(CONTACT_DOUBLES.saturating_mul(counts[1]));
        if rest.len() != doubles {
            return invalid("the saved state holds contacts out of range");
        }
        match &self.contacts {
            _ if counts == [0, 0] && with_counts => Ok(()),
            _ if counts[0] == 0 => invalid("the saved state holds contacts with no collider"),
            Some(contacts) => contacts.check_saved(counts[0], rest),
            None => {
                invalid(format!("the saved state touched {obstacles} colliders; this one has none: set them first"))
            }
        }
    }
}
