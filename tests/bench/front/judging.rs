//! The judging list: shells that nothing was tuned on, under `Part::Judging`'s loads. It was written down, and committed, before anything was
//! measured on it, and is not changed by what it tells.
//!
//! The claims: with 8 modes and 20 fields, in the form that the gate takes, the median of the error over the paper's warp's is at most 0.1; at a
//! fifth of the size nine loads of ten are at most 5 % off; after `State::fall_back` none is worse than the warp.

use crate::common::equilateral_sheet;
use crate::scenes::{Scene, shell};
use shellwarp::{Material, Vec3};
use std::f64::consts::PI;

const FABRIC: Material = Material { k_area: 1e4, k_length: 1e4, k_bend: 0.3, area_density: 1.0 };
const STIFF: Material = Material { k_area: 2e4, k_length: 2e4, k_bend: 2.0, area_density: 0.5 };

/// About 250 vertices of a sheet of 1.2 by 0.7, put elsewhere by `place`.
fn bent(place: impl Fn(f64, f64) -> Vec3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let (mut positions, triangles) = equilateral_sheet(20, 12, 0.06);
    positions.iter_mut().for_each(|x| *x = place(x.x, x.y));
    (positions, triangles)
}

/// Curved along and across to either side, held along a short edge.
fn saddle() -> Scene {
    let (positions, triangles) = bent(|x, y| Vec3::new(x, y, 0.35 * (x - 0.6).powi(2) - 0.9 * (y - 0.31).powi(2)));
    Scene::to_judge("saddle", "saddle, held along a short edge", shell(positions, &triangles, FABRIC, |x| x.x < 0.07))
}

/// A third of a cone, held at its narrow end.
fn cone() -> Scene {
    let (positions, triangles) = bent(|x, y| {
        let (radius, angle) = (0.2 + 0.35 * x, 2.1 * (y / 0.62 - 0.5));
        Vec3::new(x, radius * angle.sin(), radius * angle.cos())
    });
    Scene::to_judge(
        "cone",
        "third of a cone, held at its narrow end",
        shell(positions, &triangles, FABRIC, |x| x.x < 0.07),
    )
}

/// Waves across, held at one end.
fn corrugated() -> Scene {
    let (positions, triangles) = bent(|x, y| Vec3::new(x, y, 0.05 * (2.0 * PI * y / 0.31).sin()));
    Scene::to_judge(
        "corrugated",
        "corrugated sheet, held at one end",
        shell(positions, &triangles, STIFF, |x| x.x < 0.07),
    )
}

/// A strip that is twisted by a quarter of a turn, held at one end.
fn helicoid() -> Scene {
    let (positions, triangles) = bent(|x, y| {
        let (turn, across) = (0.5 * PI * x / 1.2, 0.6 * (y - 0.31));
        Vec3::new(x, across * turn.cos(), across * turn.sin())
    });
    Scene::to_judge(
        "helicoid",
        "strip twisted by a quarter turn, held at one end",
        shell(positions, &triangles, FABRIC, |x| x.x < 0.07),
    )
}

/// Part of a sphere, held at a patch of its rim.
fn cap() -> Scene {
    let (positions, triangles) = bent(|x, y| {
        let (x, y) = (x - 0.6, y - 0.31);
        Vec3::new(x, y, (1.0 - x * x - y * y).sqrt())
    });
    let held = |x: &Vec3| x.x < -0.4 && x.y < -0.1;
    Scene::to_judge("cap", "part of a sphere, held at a corner", shell(positions, &triangles, STIFF, held))
}

pub fn all() -> Vec<Scene> {
    vec![saddle(), cone(), corrugated(), helicoid(), cap()]
}
