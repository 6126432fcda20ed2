//! Distances that have a closed form.

use super::Touch;
use crate::Vec3;

/// Below this a vector's square is not a normal number, so that it has no sure direction.
pub(super) const NO_DIRECTION: f64 = 1e-150;

#[derive(Clone, Copy, Debug)]
pub(super) struct Capsule {
    pub half_length: f64,
    pub radius: f64,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Cuboid {
    pub half: Vec3,
}

/// To all within `radius` of the origin; the normal at the origin is x.
#[inline]
pub(super) fn ball(p: &Vec3, radius: f64) -> Touch {
    let norm = p.norm();
    let normal = if norm > NO_DIRECTION { p / norm } else { Vec3::x() };
    Touch { distance: norm - radius, normal }
}

impl Capsule {
    #[inline]
    pub fn touch(&self, p: &Vec3) -> Touch {
        let beyond = p.z - p.z.clamp(-self.half_length, self.half_length);
        ball(&Vec3::new(p.x, p.y, beyond), self.radius)
    }
}

impl Cuboid {
    #[inline]
    pub fn touch(&self, p: &Vec3) -> Touch {
        let over = p.abs() - self.half;
        let outside = over.sup(&Vec3::zeros());
        let norm = outside.norm();
        if norm > NO_DIRECTION {
            return Touch { distance: norm, normal: (outside / norm).zip_map(p, f64::copysign) };
        }
        let axis = if over.x >= over.y.max(over.z) { 0 } else { 1 + usize::from(over.z > over.y) };
        let mut normal = Vec3::zeros();
        normal[axis] = 1f64.copysign(p[axis]);
        Touch { distance: over[axis], normal }
    }
}
