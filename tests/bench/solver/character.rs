//! The garments of tests/scenes/character.toml, which float and are led at their joints by a dance. Units cm, g, s.

use crate::common::mesh;
use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use shellwarp::constraint::{Constraint, Target};
use shellwarp::{Material, Shell, Supports, Vec3};
use std::f64::consts::TAU;
use std::sync::Arc;

pub const GRAVITY: Vec3 = Vec3::new(0.0, -981.0, 0.0);
/// The dance begins in this time, s.
const RISE: f64 = 1.5;

/// The share of a motion that has begun, as in scenes: 0 to 1, with two derivatives that are zero at both ends.
pub fn begun(time: f64) -> f64 {
    let x = (time / RISE).clamp(0.0, 1.0);
    x.powi(3) * (10.0 + x * (6.0 * x - 15.0))
}

/// Axis, amplitude (cm or degrees), frequency in Hz, phase in degrees.
type Wave = (usize, f64, f64, f64);

/// A bone turns about its joint, and goes with its parent.
struct Bone {
    parent: Option<&'static Bone>,
    joint: Vec3,
    shifts: &'static [Wave],
    turns: &'static [Wave],
}

const fn bone(parent: &'static Bone, joint: [f64; 3], turns: &'static [Wave]) -> Bone {
    Bone { parent: Some(parent), joint: Vec3::new(joint[0], joint[1], joint[2]), shifts: &[], turns }
}

static PELVIS: Bone = Bone {
    parent: None,
    joint: Vec3::new(0.0, 92.0, -6.0),
    shifts: &[(1, 3.75, 0.0, 90.0), (1, 9.0, 0.4, 90.0), (1, 2.25, 0.8, 90.0), (1, 5.0, 1.6, 0.0), (0, 9.0, 0.8, 0.0)],
    turns: &[(1, 48.0, 0.2, 0.0), (1, 14.0, 0.8, 0.0), (2, 6.0, 0.8, 90.0)],
};
static CHEST: Bone = bone(
    &PELVIS,
    [0.0, 106.0, -6.0],
    &[(2, 12.0, 0.8, 180.0), (1, 16.0, 0.8, 90.0), (0, 9.0, 0.3, 0.0), (0, 5.0, 1.6, 90.0)],
);
static HEAD: Bone =
    bone(&CHEST, [0.0, 150.0, -6.0], &[(0, 13.0, 1.6, 60.0), (2, 14.0, 0.8, 20.0), (1, 26.0, 0.3, 0.0)]);
static ARM_LEFT: Bone = bone(
    &CHEST,
    [18.5, 141.0, -5.5],
    &[(2, 10.0, 0.0, 90.0), (2, 19.0, 0.8, 0.0), (0, -5.0, 0.0, 90.0), (0, 12.0, 0.8, 90.0)],
);
static ARM_RIGHT: Bone = bone(
    &CHEST,
    [-18.5, 141.0, -5.5],
    &[(2, -10.0, 0.0, 90.0), (2, -19.0, 0.8, 180.0), (0, -5.0, 0.0, 90.0), (0, 12.0, 0.8, 270.0)],
);
static THIGH: Bone = bone(
    &PELVIS,
    [8.4, 89.0, -6.6],
    &[(0, -17.0, 0.0, 90.0), (0, 10.0, 1.6, 0.0), (0, -16.0, 0.8, 0.0), (2, 4.0, 0.0, 90.0)],
);
static SHIN: Bone =
    bone(&THIGH, [10.2, 48.0, -4.4], &[(0, 24.0, 0.0, 90.0), (0, -12.0, 1.6, 0.0), (0, 12.0, 0.8, 0.0)]);

fn sum(waves: &[Wave], time: f64) -> Vec3 {
    let begun = begun(time);
    let of = |&(axis, amplitude, frequency, phase): &Wave| {
        Vec3::ith(axis, begun * amplitude * (TAU * frequency * time + f64::to_radians(phase)).sin())
    };
    waves.iter().map(of).fold(Vec3::zeros(), |sum, x| sum + x)
}

impl Bone {
    fn pose(&self, time: f64) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_scaled_axis(sum(self.turns, time).map(f64::to_radians));
        let joint = Translation3::from(self.joint);
        let own = Translation3::from(sum(self.shifts, time)) * joint * turn * joint.inverse();
        self.parent.map_or(own, |parent| parent.pose(time) * own)
    }
}

/// A shell, and where bones hold it: a vertex, and whether its orientation is held, too.
pub struct Garment {
    pub shell: Arc<Shell>,
    joints: Vec<(&'static Bone, usize, bool)>,
}

impl Garment {
    fn new(name: &str, k: [f64; 3], joints: &[(&'static Bone, [f64; 3], bool)]) -> Self {
        let material = Material { k_area: k[0], k_length: k[0], k_bend: k[1], area_density: k[2] };
        let shell = Arc::new(Shell::new(mesh(name), material, &Supports::default()).unwrap());
        let nearest = |at: &[f64; 3]| {
            let off = |v: &usize| (shell.mesh.positions[*v] - Vec3::from(*at)).norm();
            (0..shell.mass.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap()
        };
        let joints = joints.iter().map(|(bone, at, turns)| (*bone, nearest(at), *turns)).collect();
        Self { shell, joints }
    }

    /// What holds it at a time of the dance, s.
    pub fn joints(&self, time: f64) -> Vec<Constraint> {
        let mut list = vec![];
        for (bone, v, turns) in &self.joints {
            let pose = bone.pose(time);
            let place = pose * nalgebra::Point3::from(self.shell.mesh.positions[*v]);
            let targets = [Some(Target::Position(place.coords)), turns.then_some(Target::Orientation(pose.rotation))];
            for target in targets.into_iter().flatten() {
                let (id, vertex) = (list.len() as u32, *v as u32);
                list.push(Constraint { id, vertex, axes: [true; 3], compliance: 0.0, target });
            }
        }
        list
    }
}

fn hat() -> Garment {
    let at = [
        (&HEAD, [0.0, 171.1, 3.9], true),
        (&HEAD, [0.0, 166.1, -15.9], false),
        (&HEAD, [9.6, 168.6, -6.0], false),
        (&HEAD, [-9.6, 168.6, -6.0], false),
    ];
    Garment::new("character_hat.obj", [2e5, 2500.0, 0.05], &at)
}

fn leg() -> Garment {
    let at = [
        (&THIGH, [8.4, 89.0, 3.0], true),
        (&THIGH, [8.4, 89.0, -16.2], false),
        (&THIGH, [16.0, 89.0, -6.6], false),
        (&THIGH, [0.8, 89.0, -6.6], false),
        (&SHIN, [10.2, 48.0, 2.6], true),
        (&SHIN, [11.0, 37.0, -13.0], false),
    ];
    Garment::new("character_leg_left.obj", [1e5, 8000.0, 0.04], &at)
}

fn shirt() -> Garment {
    let at = [
        (&CHEST, [0.0, 147.0, 2.1], true),
        (&CHEST, [0.0, 152.0, -9.0], false),
        (&CHEST, [15.0, 148.0, -6.0], false),
        (&CHEST, [-15.0, 148.0, -6.0], false),
        (&ARM_LEFT, [30.0, 126.0, -4.5], false),
        (&ARM_RIGHT, [-30.0, 126.0, -4.5], false),
        (&PELVIS, [0.0, 97.0, 7.0], false),
        (&PELVIS, [0.0, 97.0, -20.0], false),
    ];
    Garment::new("shirt.obj", [1e5, 9000.0, 0.03], &at)
}

type Worn = (&'static str, fn() -> Garment);

/// By name.
pub const GARMENTS: [Worn; 3] = [("character's hat", hat), ("character's left leg", leg), ("character's shirt", shirt)];
