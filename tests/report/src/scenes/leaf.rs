//! A curved open shell: a leaf with a trough along its midrib, wide in the middle and drawn to a tip, held at its stem.

use super::{Drive, Reference, Scene};
use crate::library::{Material, Pose};
use crate::mesh::Mesh;

const ROWS: usize = 12;

/// 2.41: 12.5 edges of the coarse mesh.
const LENGTH: f64 = 2.405626121623441;

fn leaf(rows: usize) -> Mesh {
    Mesh::strip(LENGTH, 1.0, rows).shaped(|[x, y]| {
        let s = (x / LENGTH).max(0.0);
        let y = y * (0.25 + 0.9 * (std::f64::consts::PI * (0.08 + 0.86 * s)).sin());
        [x, y, 0.5 * y * y + 0.25 * (2.0 * s).sin()]
    })
}

fn material(rows: usize) -> Material {
    Material { area: 5e3, length: 5e3 * ROWS as f64 / rows as f64, bend: 1.0, density: 1.0 }
}

/// Its stem sways to and fro, from rest.
fn sway(time: f64) -> Pose {
    let mut pose = Pose::default();
    for (amplitude, frequency) in [(0.08, 0.5), (0.02, 1.1)] {
        let omega = std::f64::consts::TAU * frequency;
        let (sin, cos) = (omega * time).sin_cos();
        pose.origin[0][2] += amplitude * (1.0 - cos);
        pose.origin[1][2] += amplitude * omega * sin;
        pose.origin[2][2] += amplitude * omega * omega * cos;
    }
    pose
}

pub fn scene() -> Scene {
    Scene {
        key: "leaf",
        title: "Leaf, swayed",
        text: "A doubly curved leaf held at its stem, whose support sways up and down while gravity pulls it aside. Curved sheets \
            are where a linear modal stiffness is weakest.",
        mesh: leaf(ROWS),
        coarse: Some((leaf(ROWS / 2), material(ROWS / 2))),
        material: material(ROWS),
        fixed: Mesh::root,
        gravity: [0.0, -0.15, -0.3],
        damping: 0.5,
        frames: 120,
        drive: Drive::Shaken(sway),
        ball: None,
        probe: ([LENGTH, 0.0], 2),
        paper_modes: 8,
        reference: Reference::Explicit { steps: 1000, check: 750 },
        most_modes: 64,
    }
}
