//! A solid where it is, and where it goes in the next step.

use crate::collider::{Solid, Touch};
use crate::support::Pose;
use crate::{Result, Vec3};
use std::sync::Arc;

/// See the module's text. Poses are in world space.
#[derive(Clone)]
pub struct Obstacle {
    /// Shared.
    pub solid: Arc<Solid>,
    /// μ of Coulomb's law, not negative.
    pub friction: f64,
    /// The shell stays so far off the surface, not negative.
    pub thickness: f64,
    /// At the end of the last step.
    pub pose: Pose,
    /// At the end of the next.
    pub target: Pose,
    /// It stands somewhere; else the first move only places it.
    pub placed: bool,
}

/// From a pose's axes.
fn inward(pose: &Pose, x: &Vec3) -> Vec3 {
    pose.rotation.inverse_transform_vector(&(x - pose.origin))
}

/// All of a solid that does not turn or deform in the step.
#[derive(Clone, Copy)]
pub struct Around {
    /// Of its ball, or on its plane; where it is at the end, world space.
    center: Vec3,
    /// With its thickness and what its distances are off by.
    radius: f64,
    /// Outward, of a plane.
    normal: Option<Vec3>,
    /// Its way.
    pub led: f64,
}

impl Around {
    /// Of a solid with this pose.
    fn of(obstacle: &Obstacle, pose: &Pose, led: f64) -> Self {
        let own = obstacle.thickness + obstacle.solid.surface_error();
        match obstacle.solid.bounds() {
            Some(ball) => Self { center: pose.place(&ball.center), radius: ball.radius + own, normal: None, led },
            None => Self { center: pose.origin, radius: own, normal: Some(pose.rotation * Vec3::z()), led },
        }
    }

    /// Nothing within `reach` of a place comes near.
    #[inline]
    pub fn is_far(&self, place: &Vec3, reach: f64) -> bool {
        let (way, least) = (place - self.center, self.radius + self.led + reach);
        match self.normal {
            None => way.norm_squared() > least * least,
            Some(normal) => normal.dot(&way) > least,
        }
    }
}

impl Obstacle {
    /// What is about it where it stands when the step begins, where it does not deform in the step.
    pub fn begins(&self) -> Option<Around> {
        (!self.solid.deforms()).then(|| Around::of(self, &self.pose, 0.0))
    }

    /// What is about it, where it does not turn or deform in the step.
    pub fn around(&self) -> Option<Around> {
        let stays = self.pose.rotation == self.target.rotation && !self.solid.deforms();
        stays.then(|| Around::of(self, &self.target, (self.target.origin - self.pose.origin).norm()))
    }

    /// That stands there, without friction and thickness.
    pub fn new(solid: Arc<Solid>, pose: Pose) -> Self {
        Self { solid, friction: 0.0, thickness: 0.0, pose, target: pose, placed: true }
    }

    /// With Coulomb's μ.
    pub fn with_friction(self, friction: f64) -> Self {
        Self { friction, ..self }
    }

    /// With a distance that the shell keeps from the surface.
    pub fn with_thickness(self, thickness: f64) -> Self {
        Self { thickness, ..self }
    }

    /// Where `x` of when the step begins is in the solid's axes, and goes as the matter at the surface next to it goes.
    pub fn at_start(&self, x: &Vec3) -> Vec3 {
        self.carried(&inward(&self.pose, x))
    }

    /// Where a place in the solid's axes is taken by its change of shape.
    pub fn carried(&self, x: &Vec3) -> Vec3 {
        if !self.solid.deforms() {
            return *x;
        }
        // The surface that was next to it is next to where that takes it.
        let near = x + self.solid.slip(x);
        x + self.solid.slip(&near)
    }

    /// Gives the solid the shape that it has at the end of the next step, of its own. `jump`: it has it at once.
    pub fn deform(&mut self, positions: &[Vec3], jump: bool) -> Result<()> {
        let solid = Arc::make_mut(&mut self.solid);
        solid.lead(positions)?;
        if jump {
            solid.arrive();
        }
        Ok(())
    }

    /// Where `x` of when it ends is.
    pub fn at_end(&self, x: &Vec3) -> Vec3 {
        inward(&self.target, x)
    }

    /// World space of a place in the solid's axes, at the end of the step.
    pub fn place(&self, x: &Vec3) -> Vec3 {
        self.target.origin + self.target.rotation * x
    }

    /// The same of a direction.
    pub fn direction(&self, n: &Vec3) -> Vec3 {
        self.target.rotation * n
    }

    /// From the surface with its thickness.
    pub fn touch(&self, local: &Vec3) -> Touch {
        let touch = self.solid.touch(local);
        Touch { distance: touch.distance - self.thickness, ..touch }
    }

    /// As [`Obstacle::touch`], for whoever needs none farther than `reach`, which is not negative.
    pub fn touch_within(&self, local: &Vec3, reach: f64) -> Option<Touch> {
        let touch = self.solid.touch_within(local, reach + self.thickness)?;
        Some(Touch { distance: touch.distance - self.thickness, ..touch })
    }

    /// The first place on a way, in the solid's axes.
    pub fn first_touch(&self, from: &Vec3, to: &Vec3) -> Option<(Vec3, Touch)> {
        let (share, touch) = self.solid.first_touch(from, to, self.thickness)?;
        Some((from + share * (to - from), Touch { distance: touch.distance - self.thickness, ..touch }))
    }

    /// It moves in the next step.
    pub fn moves(&self) -> bool {
        self.pose != self.target || self.solid.deforms()
    }

    /// Its way in the step, of any of its points within `reach` of the origin.
    pub fn way(&self, reach: f64) -> f64 {
        let turn = self.pose.rotation.angle_to(&self.target.rotation);
        (self.target.origin - self.pose.origin).norm() + turn * reach
    }

    /// The same of any point of its surface; infinite where none is known.
    pub fn longest_way(&self) -> f64 {
        match self.solid.bounds() {
            _ if self.pose == self.target && !self.solid.deforms() => 0.0,
            Some(ball) if !self.solid.deforms() => self.way(ball.center.norm() + ball.radius),
            _ => f64::INFINITY,
        }
    }

    /// The same that stays where it is.
    pub fn now(&self) -> Self {
        Self { target: self.pose, ..self.clone() }
    }

    /// The step has ended.
    pub fn arrive(&mut self) {
        self.pose = self.target;
        if self.solid.deforms() {
            Arc::make_mut(&mut self.solid).arrive();
        }
    }
}
