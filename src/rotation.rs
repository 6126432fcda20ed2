//! Rotations and their vectors, angle times axis, with the same bits on every platform.

use crate::Vec3;
use nalgebra::{Quaternion, UnitQuaternion};

/// The rotation by |w| rad about w.
pub fn by(w: &Vec3) -> UnitQuaternion<f64> {
    let half = 0.5 * w.norm();
    if half <= f64::EPSILON {
        return UnitQuaternion::new_unchecked(Quaternion::from_parts(1.0, 0.5 * w));
    }
    let (sine, cosine) = libm::sincos(half);
    UnitQuaternion::new_unchecked(Quaternion::from_parts(cosine, w * (0.5 * sine / half)))
}

/// The vector of a rotation, of at most half a turn.
pub fn vector(turn: &UnitQuaternion<f64>) -> Vec3 {
    let (axis, cosine) = (turn.imag(), turn.scalar());
    let sine = axis.norm();
    if sine <= f64::EPSILON {
        return axis * (2.0 * cosine.signum());
    }
    axis * (cosine.signum() * 2.0 * libm::atan2(sine, cosine.abs()) / sine)
}

/// The least rotation that turns the direction `from` into `to`, unit vectors; half a turn about some axis where they are opposite.
pub fn shortest(from: &Vec3, to: &Vec3) -> UnitQuaternion<f64> {
    let quaternion = Quaternion::from_parts(1.0 + from.dot(to), from.cross(to));
    UnitQuaternion::try_new(quaternion, f64::EPSILON).unwrap_or_else(|| {
        let across = from.cross(&Vec3::ith(from.iamin(), 1.0));
        UnitQuaternion::new_normalize(Quaternion::from_parts(0.0, across))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shortest_rotation_turns_one_direction_into_the_other() {
        let directions = [
            Vec3::x(),
            -Vec3::x(),
            Vec3::new(0.6, -0.8, 0.0),
            Vec3::new(-0.6, 0.8 - 1e-9, 0.0).normalize(),
            -Vec3::z(),
        ];
        for from in &directions {
            for to in &directions {
                let turn = shortest(from, to);
                // Next to opposite ones the axis is what rounding leaves of it.
                let tolerance = if from.dot(to) < -0.999 { 1e-7 } else { 1e-15 };
                assert!((turn * from - to).norm() < tolerance, "{from} {to}");
                assert!((turn.angle() - from.angle(to)).abs() < 1e-7);
            }
        }
    }

    #[test]
    fn rotations_and_vectors_are_those_of_nalgebra() {
        for (k, size) in [0.0, 1e-300, 1e-17, 1e-9, 0.3, 1.0, 3.0, 3.1, 4.0, 7.0].into_iter().enumerate() {
            let w = size * Vec3::new(0.48, -0.6 + 1e-3 * k as f64, 0.64).normalize();
            let (own, other) = (by(&w), UnitQuaternion::from_scaled_axis(w));
            assert!((own.coords - other.coords).norm() < 1e-15, "{size}");
            assert!((own.coords.norm() - 1.0).abs() < 1e-15, "{size}");
            // Half a turn has two vectors; beyond, a rotation's vector is not the one that made it.
            assert!((vector(&own) - own.scaled_axis()).norm() < 4e-15, "{size}");
            assert!(size > 3.2 || (vector(&own) - w).norm() <= 4e-15 * size, "{size}");
        }
    }
}
