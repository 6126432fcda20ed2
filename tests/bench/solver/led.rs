//! The judging list's shells, led by one vertex: moved, turned, and both, hard and softly, and then under a weight, too.

use crate::judging;
use crate::pair::{HEAD, Pair, Tally};
use crate::{docs, wanted};
use nalgebra::UnitQuaternion;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::{Shell, Vec3};

/// A displacement in sizes, and a rotation vector in rad.
const KEYS: [([f64; 3], [f64; 3]); 4] = [
    ([0.0, 0.0, 0.1], [0.3, 0.0, 0.0]),
    ([-0.05, 0.1, 0.15], [0.2, -0.5, 0.3]),
    ([-0.1, -0.1, 0.1], [0.0, 0.4, -0.6]),
    ([0.0, 0.05, -0.15], [-0.7, 0.0, 0.2]),
];
/// Of a soft constraint, its compliance over size²/k_bend: length per force, and the same number in rad per torque.
const SOFT: f64 = 0.1;

/// The free vertex furthest from the supports.
fn furthest(shell: &Shell) -> usize {
    let x = &shell.mesh.positions;
    let held: Vec<usize> = (0..x.len()).filter(|v| shell.held[*v]).collect();
    let away = |v: u32| held.iter().map(|w| (x[v as usize] - x[*w]).norm()).fold(f64::INFINITY, f64::min);
    shell.free.iter().copied().max_by(|a, b| away(*a).total_cmp(&away(*b))).unwrap() as usize
}

/// Leads a shell through all keys, each from where the one before ended.
fn lead(pair: &mut Pair, shell: &Shell, [moved, turned]: [bool; 2], compliance: f64, weight: f64, tally: &mut Tally) {
    let v = furthest(shell);
    let forces: Vec<Vec3> = shell.mass.iter().map(|m| Vec3::new(0.0, 0.0, -weight * m)).collect();
    pair.begin();
    for (at, (place, turn)) in KEYS.iter().enumerate() {
        let holds = |id, target| Constraint { id, vertex: v as u32, axes: [true; 3], compliance, target };
        let position = Target::Position(shell.mesh.positions[v] + shell.mesh.size * Vec3::from(*place));
        let orientation = Target::Orientation(UnitQuaternion::from_scaled_axis(Vec3::from(*turn)));
        let both = [moved.then(|| holds(1, position)), turned.then(|| holds(2, orientation))];
        let list: Vec<Constraint> = both.into_iter().flatten().collect();
        pair.search(&format!("{moved} {turned} {compliance:.0e} {weight:.0e} key {at}"), &forces, &list, tally);
    }
}

pub fn table(only: &[String]) -> String {
    let mut table = format!(
        "Moved, turned, and both, through four keys each; hard, softly, and under a weight. By the energy alone → with stresses and torques as unknowns; `make bench-solver` on {} (load {}).\n\n\
         | shell | {HEAD} |\n|---|---|---|---|---|---|---|\n",
        docs::machine(),
        docs::load()
    );
    let mut all = Tally::default();
    for scene in judging::all().iter().filter(|scene| wanted(only, scene.key)) {
        let (shell, mut tally, mut pair) = (&scene.shell, Tally::default(), Pair::new(scene.shell.clone()));
        let bend = shell.material.discrete_shells().unwrap().k_bend;
        // A weight that bends the shell by about a tenth of its size.
        let (weight, soft) = (bend / (shell.mesh.size * shell.total_mass), SOFT * shell.mesh.size.powi(2) / bend);
        for parts in [[true, false], [false, true], [true, true]] {
            for (compliance, weight) in [(0.0, 0.0), (soft, 0.0), (0.0, weight)] {
                lead(&mut pair, shell, parts, compliance, weight, &mut tally);
            }
        }
        let row = format!("| {} | {} |\n", scene.key, tally.cells());
        print!("{row}");
        for e in &tally.elsewhere {
            println!("  {}: {:.1e} apart, potentials {:?}", e.load, e.apart, e.potential);
        }
        table += &row;
        all.add(&tally);
    }
    table + &format!("| all | {} |\n", all.cells())
}
