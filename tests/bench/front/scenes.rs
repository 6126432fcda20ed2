//! Shells and the loads on them. The lists are fixed: no method or default was chosen by looking at a held-out load.

use crate::common::{equilateral_sheet, leaf, read_obj, reference, trouser_leg};
use nalgebra::Rotation3;
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};
use std::sync::Arc;

/// A shell held by its supports.
pub struct Scene {
    pub key: &'static str,
    pub text: &'static str,
    pub shell: Arc<Shell>,
    /// Where gravity points.
    pub down: Vec3,
    /// Where pulls act: validation's, then held-out ones.
    points: [usize; 4],
    /// Those of the last list, and of the judging one.
    fresh_points: [usize; 4],
    judging_points: [usize; 4],
    pub lists: &'static [List],
}

/// What a load is for. Training loads are those of the precompute (`TrainingLoads::loads` of src/reduced).
#[derive(Clone, Copy, PartialEq)]
pub enum Part {
    /// Defaults are chosen by these.
    Validation,
    /// Methods were compared by these, and a first share of the membrane tried on them.
    HeldOut,
    /// The verdict is on these, written down when all was chosen.
    Fresh,
    /// On shells of their own (`judging`), written down before anything was measured on them.
    Judging,
}

/// Loads that are followed, and kept, together.
#[derive(Clone, Copy, PartialEq)]
pub enum List {
    /// Validation's and held-out ones.
    First,
    Fresh,
    Judging,
}

impl Part {
    pub fn list(self) -> List {
        match self {
            Self::Validation | Self::HeldOut => List::First,
            Self::Fresh => List::Fresh,
            Self::Judging => List::Judging,
        }
    }
}

/// What acts, at the strength 1.
pub enum Action {
    /// A dead force on every vertex.
    Forces(Vec<Vec3>),
    /// A vertex is led along a direction by a share of the shell's size; the axes beside it are free.
    Handle(usize, Vec3),
}

pub struct Load {
    pub name: &'static str,
    pub part: Part,
    pub action: Action,
}

impl Scene {
    fn new(key: &'static str, text: &'static str, shell: Shell, down: Vec3) -> Self {
        let [points, fresh_points, judging_points] = [7, 12, 31].map(|seed| spread(&shell, seed));
        let lists = &[List::First, List::Fresh];
        Self { key, text, shell: Arc::new(shell), down, points, fresh_points, judging_points, lists }
    }

    /// One for the judging list alone.
    pub fn to_judge(key: &'static str, text: &'static str, shell: Shell) -> Self {
        Self { lists: &[List::Judging], ..Self::new(key, text, shell, -Vec3::z()) }
    }

    /// Loads of unit weight in sum where they are forces.
    pub fn loads(&self, list: List) -> Vec<Load> {
        let shell = &self.shell;
        let normals = shell.mesh.normals(&shell.mesh.positions);
        // Directions are given with z up.
        let upright = Rotation3::rotation_between(&-Vec3::z(), &self.down).unwrap_or_else(Rotation3::identity);
        let along = |d: [f64; 3]| upright * Vec3::from(d).normalize();
        let share = |v: usize| shell.mass[v] / shell.total_mass;
        let n = shell.mass.len();
        let gravity = |d: [f64; 3]| (0..n).map(|v| share(v) * along(d)).collect::<Vec<_>>();
        let wind = |d: [f64; 3]| (0..n).map(|v| share(v) * normals[v].dot(&along(d)) * normals[v]).collect::<Vec<_>>();
        let pull = |v: usize, d: [f64; 3]| {
            let mut force = vec![Vec3::zeros(); n];
            force[v] = along(d);
            force
        };
        let push = |v: usize| {
            let mut force = vec![Vec3::zeros(); n];
            let reach = 0.15 * shell.mesh.size;
            for w in 0..n {
                let apart = (shell.mesh.positions[w] - shell.mesh.positions[v]).norm() / reach;
                force[w] = share(w) * (1.0 - apart).max(0.0) * normals[v];
            }
            let total = force.iter().fold(Vec3::zeros(), |sum, f| sum + f).norm();
            force.iter_mut().for_each(|f| *f /= total);
            force
        };
        let sum = |a: Vec<Vec3>, b: Vec<Vec3>, part: f64| -> Vec<Vec3> {
            a.iter().zip(&b).map(|(a, b)| a + part * b).collect()
        };
        let [p, q, r, s] = match list {
            List::First => self.points,
            List::Fresh => self.fresh_points,
            List::Judging => self.judging_points,
        };
        let handle = |v: usize| {
            let axis = normals[v].iamax();
            Action::Handle(v, Vec3::ith(axis, normals[v][axis].signum()))
        };
        use Action::Forces;
        use Part::{Fresh, HeldOut, Judging, Validation};
        let of = |part, list: Vec<(&'static str, Action)>| {
            list.into_iter().map(move |(name, action)| Load { name, part, action })
        };
        if list == List::Judging {
            let list = vec![
                ("gravity, tilted 6", Forces(gravity([0.35, -0.4, -0.85]))),
                ("gravity, tilted 7", Forces(gravity([-0.25, 0.75, 0.6]))),
                ("pull 6", Forces(pull(p, [0.4, 0.3, 0.87]))),
                ("push 4", Forces(push(q))),
                ("wind 4", Forces(wind([0.2, 0.9, 0.4]))),
                ("gravity and pull 4", Forces(sum(gravity([0.1, 0.2, -0.97]), pull(s, [-0.6, 0.5, 0.6]), 0.05))),
                ("handle 6", handle(r)),
            ];
            return of(Judging, list).collect();
        }
        if list == List::Fresh {
            let list = vec![
                ("gravity, tilted 4", Forces(gravity([-0.7, 0.3, -0.6]))),
                ("gravity, tilted 5", Forces(gravity([0.45, -0.6, 0.65]))),
                ("gravity, aside 2", Forces(gravity([-0.8, -0.55, 0.2]))),
                ("gravity, up", Forces(gravity([-0.1, 0.15, 0.95]))),
                ("pull 4", Forces(pull(p, [-0.55, 0.35, 0.75]))),
                ("pull 5", Forces(pull(q, [0.25, 0.9, -0.35]))),
                ("push 3", Forces(push(s))),
                ("wind 3", Forces(wind([-0.7, 0.5, 0.5]))),
                ("gravity and pull 3", Forces(sum(gravity([0.0, 0.0, -1.0]), pull(r, [-0.5, -0.7, 0.5]), 0.05))),
                ("handle 4", handle(p)),
                ("handle 5", handle(r)),
            ];
            return of(Fresh, list).collect();
        }
        let validation = vec![
            ("gravity, tilted 1", Forces(gravity([0.4, 0.5, -0.77]))),
            ("pull 1", Forces(pull(p, [0.5, -0.6, 0.6]))),
            ("push 1", Forces(push(q))),
            ("wind 1", Forces(wind([0.8, -0.2, 0.5]))),
            ("gravity and pull 1", Forces(sum(gravity([0.0, 0.0, -1.0]), pull(q, [-0.3, 0.9, 0.2]), 0.05))),
            ("handle 1", handle(p)),
        ];
        let held_out = vec![
            ("gravity, down", Forces(gravity([0.05, 0.03, -1.0]))),
            ("gravity, tilted 2", Forces(gravity([-0.5, -0.5, 0.7]))),
            ("gravity, tilted 3", Forces(gravity([0.3, 0.8, 0.5]))),
            ("gravity, aside", Forces(gravity([0.6, -0.75, -0.2]))),
            ("pull 2", Forces(pull(r, [0.6, 0.5, -0.62]))),
            ("pull 3", Forces(pull(s, [-0.3, -0.8, 0.5]))),
            ("push 2", Forces(push(r))),
            ("wind 2", Forces(wind([0.6, 0.3, 0.74]))),
            ("gravity and pull 2", Forces(sum(gravity([0.0, 0.0, -1.0]), pull(s, [0.8, 0.6, 0.0]), 0.05))),
            ("gravity and wind", Forces(sum(gravity([0.0, 0.0, -1.0]), wind([0.6, 0.3, 0.74]), 1.0))),
            ("handle 2", handle(r)),
            ("handle 3", handle(s)),
        ];
        of(Validation, validation).chain(of(HeldOut, held_out)).collect()
    }
}

/// Four places on the shell that move: of a fixed random choice of 40 free vertices the ones furthest from the supports and each other,
/// but for the very furthest, which the precompute knows.
fn spread(shell: &Shell, mut seed: u64) -> [usize; 4] {
    let x = &shell.mesh.positions;
    let held: Vec<usize> = (0..x.len()).filter(|&v| shell.held[v]).collect();
    let mut choice: Vec<usize> = (0..40)
        .map(|_| {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            shell.free[(seed >> 33) as usize % shell.free.len()] as usize
        })
        .collect();
    let mut chosen: Vec<usize> = vec![];
    std::array::from_fn(|_| {
        let near = |v: usize| {
            let from = held.iter().chain(&chosen);
            from.map(|&w| (x[v] - x[w]).norm_squared()).fold(f64::INFINITY, f64::min)
        };
        let best = (0..choice.len()).max_by(|&a, &b| near(choice[a]).total_cmp(&near(choice[b]))).unwrap_or(0);
        chosen.push(choice.swap_remove(best));
        chosen[chosen.len() - 1]
    })
}

fn held(positions: &[Vec3], keep: impl Fn(&Vec3) -> bool) -> Supports {
    let fixed = (0..positions.len() as u32).filter(|&v| keep(&positions[v as usize])).collect();
    Supports { fixed, ..Default::default() }
}

pub fn shell(positions: Vec<Vec3>, triangles: &[[u32; 3]], material: Material, keep: impl Fn(&Vec3) -> bool) -> Shell {
    let supports = held(&positions, keep);
    Shell::new(Mesh::new(positions, triangles).unwrap(), material, &supports).unwrap()
}

/// The hat of tests/scenes/character.toml, held along its band.
pub fn hat() -> Shell {
    let (positions, triangles) = read_obj("character_hat.obj");
    let material = Material { k_area: 2e5, k_length: 2e5, k_bend: 1400.0, area_density: 0.05 };
    let (sin, cos) = 14f64.to_radians().sin_cos();
    shell(positions, &triangles, material, |x| (cos * (x.y - 168.6) - sin * (x.z + 6.0)).abs() < 1.4)
}

/// A quarter of a cylinder, held along half of a straight edge.
fn cylinder() -> Shell {
    let (mut positions, triangles) = equilateral_sheet(24, 20, 0.06);
    for x in &mut positions {
        let angle = x.y / 0.7;
        *x = Vec3::new(x.x, 0.7 * angle.sin(), 0.7 * angle.cos());
    }
    let material = Material { k_area: 1e4, k_length: 1e4, k_bend: 0.5, area_density: 1.0 };
    shell(positions, &triangles, material, |x| x.y < 0.06 && x.x < 0.75)
}

pub fn all() -> Vec<Scene> {
    let (down, below) = (-Vec3::z(), -Vec3::y());
    vec![
        Scene::new("flat_beam", "flat beam, tests/data/meshes/flat_beam.obj", reference("flat_beam").0, down),
        Scene::new("v_beam", "V-beam, tests/data/meshes/v_beam.obj", reference("v_beam").0, down),
        Scene::new("leaf", "leaf, doubly curved, soft in bending", leaf(1), down),
        Scene::new("cylinder", "quarter of a cylinder, held along half an edge", cylinder(), down),
        Scene::new("hat", "hat, tests/data/meshes/character_hat.obj, held at its band", hat(), below),
        Scene::new(
            "leg",
            "trouser leg, tests/data/meshes/character_leg_left.obj, held at the waist",
            trouser_leg("left"),
            below,
        ),
    ]
}
