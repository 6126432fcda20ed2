//! Contacts in saved states: numbers that bring back the same bits.

use super::{Contacts, Touching};
use crate::Vec3;
use crate::error::invalid;
use crate::{Result, support::Pose};
use nalgebra::{Quaternion, UnitQuaternion, Vector4};
use std::sync::Arc;

/// Numbers of a solid: its pose.
pub const OBSTACLE_DOUBLES: usize = 7;
/// Numbers of a contact: the probe, the solid, λ, and the anchor.
pub const CONTACT_DOUBLES: usize = 6;

impl Contacts {
    /// How many solids and contacts are saved.
    pub fn saved_counts(&self) -> [usize; 2] {
        [self.obstacles.len(), self.pressed.list.len()]
    }

    /// Hands out their numbers.
    pub fn save(&self, push: &mut dyn FnMut(f64)) {
        for Pose { origin, rotation } in self.obstacles.iter().map(|obstacle| &obstacle.pose) {
            origin.iter().chain(rotation.coords.iter()).for_each(|x| push(*x));
        }
        for touch in &self.pressed.list {
            [f64::from(touch.probe), f64::from(touch.obstacle), touch.force].into_iter().for_each(&mut *push);
            touch.anchor.iter().for_each(|x| push(*x));
        }
    }

    /// Fails unless these numbers, all finite, are of `obstacles` solids and contacts of this shell with them.
    pub fn check_saved(&self, obstacles: usize, numbers: &[f64]) -> Result<()> {
        let own = self.obstacles.len();
        if obstacles != own {
            return invalid(format!(
                "the saved state touched {obstacles} colliders; this one has {own}: set them first"
            ));
        }
        let (poses, contacts) = numbers.split_at(OBSTACLE_DOUBLES * obstacles);
        let unit = |pose: &[f64]| (Vector4::from_column_slice(&pose[3..]).norm() - 1.0).abs() <= 1e-9;
        let mut last = None;
        let good = |contact: &[f64]| {
            let whole = |x: f64, n: usize| x.is_sign_positive() && x.fract() == 0.0 && x < n as f64;
            let key = (contact[0] as u32, contact[1] as u32);
            let rises = last.is_none_or(|last| last < key);
            last = Some(key);
            rises && whole(contact[0], self.probes.points.len()) && whole(contact[1], own) && contact[2] >= 0.0
        };
        let few = contacts.len() / CONTACT_DOUBLES <= self.capacity();
        if few && poses.chunks_exact(OBSTACLE_DOUBLES).all(unit) && contacts.chunks_exact(CONTACT_DOUBLES).all(good) {
            return Ok(());
        }
        invalid("the saved state holds contacts out of range")
    }

    /// Takes numbers that were checked.
    pub fn load(&mut self, numbers: &[f64]) {
        let (poses, contacts) = numbers.split_at(OBSTACLE_DOUBLES * self.obstacles.len());
        for (obstacle, pose) in self.obstacles.iter_mut().zip(poses.chunks_exact(OBSTACLE_DOUBLES)) {
            // Not renormalized: the same bits must come back.
            let rotation = UnitQuaternion::new_unchecked(Quaternion::from(Vector4::from_column_slice(&pose[3..])));
            obstacle.pose = Pose { origin: Vec3::from_column_slice(&pose[..3]), rotation };
            (obstacle.target, obstacle.placed) = (obstacle.pose, true);
        }
        let Self { probes, pressed, before, summary, .. } = self;
        before.clear();
        before.extend(contacts.chunks_exact(CONTACT_DOUBLES).map(|contact| {
            let (probe, anchor) = (contact[0] as u32, Vec3::from_column_slice(&contact[3..]));
            let new = Touching::new(probe, contact[1] as u32, probes.mass[probe as usize], anchor);
            Touching { force: contact[2], ..new }
        }));
        Arc::make_mut(pressed).take(before, probes);
        *summary = Default::default();
    }
}
