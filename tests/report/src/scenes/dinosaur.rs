//! The paper's dinosaur, as tests/scenes/dinosaur.toml has it, shaken from rest for two seconds.

use super::{Drive, Reference, Scene};
use crate::library::{Material, Pose};
use crate::mesh::Mesh;
use anyhow::Result;
use std::path::Path;

/// Non-uniformly: two tones along x, one along z, and a yaw.
fn shake(time: f64) -> Pose {
    let mut pose = Pose::default();
    let tone = |amplitude: f64, frequency: f64| {
        let omega = std::f64::consts::TAU * frequency;
        let (sin, cos) = (omega * time).sin_cos();
        [amplitude * (1.0 - cos), amplitude * omega * sin, amplitude * omega * omega * cos]
    };
    let (x1, x2, z, yaw) = (tone(2.0, 0.62), tone(0.6, 1.37), tone(2.0, 0.81), tone(3f64.to_radians(), 0.53));
    for k in 0..3 {
        pose.origin[k] = [x1[k] + x2[k], 0.0, z[k]];
        pose.yaw[k] = yaw[k];
    }
    pose
}

pub fn scene(data: &Path) -> Result<Scene> {
    Ok(Scene {
        key: "dinosaur",
        title: "Dinosaur, shaken",
        text: "The paper's experiment: a skin of 13,117 vertices, held where it touches the ground, its support shaken from rest; \
            soft rubber, half a centimetre thick. Four modes in the paper.",
        mesh: Mesh::read_obj(&data.join("meshes/dinosaur.obj"))?,
        coarse: None,
        material: Material { area: 1e6, length: 1e6, bend: 1e4, density: 0.5 },
        fixed: |mesh| mesh.vertices_where(|p, _| p[1] <= 0.02),
        gravity: [0.0; 3],
        damping: 0.4,
        frames: 60,
        drive: Drive::Shaken(shake),
        ball: None,
        probe: ([0.0, 0.0], 0),
        paper_modes: 4,
        reference: Reference::Extrapolated,
        most_modes: 32,
    })
}
