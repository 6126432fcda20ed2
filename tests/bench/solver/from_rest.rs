//! Forces of the lists in `front/scenes.rs`, each at once from rest, up to large ones.

use crate::pair::{APART, HEAD, Pair, Tally};
use crate::scenes::{self, Action, Scene};
use crate::{docs, wanted};
use shellwarp::Vec3;
use shellwarp::reference::EquilibriumOptions;

/// Largest displacements to first order, in model sizes.
const AIMS: [f64; 3] = [0.1, 0.3, 1.0];
/// Of the weight, a force that leaves the shell linear.
const LITTLE: f64 = 1e-3;

fn largest(u: &[Vec3]) -> f64 {
    u.iter().map(|u| u.norm()).fold(0.0, f64::max)
}

/// Those of a scene, each at the strengths of [`AIMS`].
fn forces(scene: &Scene, pair: &mut Pair) -> Vec<(&'static str, f64, Vec<Vec3>)> {
    let rest = vec![Vec3::zeros(); scene.shell.mass.len()];
    let mut list = vec![];
    for load in scene.lists.iter().flat_map(|list| scene.loads(*list)) {
        let Action::Forces(forces) = &load.action else { continue };
        let little: Vec<Vec3> = forces.iter().map(|f| f * (LITTLE * scene.shell.total_mass)).collect();
        let found = pair.solvers[1].equilibrium(&rest, &little, &EquilibriumOptions::default(), &mut |_| Ok(()));
        let Ok(linear) = found else { continue };
        let factor = scene.shell.mesh.size / largest(&linear.displacement);
        list.extend(AIMS.map(|aim| (load.name, aim, little.iter().map(|f| f * (aim * factor)).collect())));
    }
    list
}

pub fn table(only: &[String]) -> String {
    let mut table = format!(
        "From rest to 1e-8 of the load, forces that move the shell by 0.1, 0.3 and 1 of its size to first order; `make bench-solver` on {} \
         (load {}). By the energy alone → with the stress as an unknown. Elsewhere: ends that differ by more than {APART}, and where the \
         potential is lower with the stress as an unknown.\n\n| shell | {HEAD} |\n|---|---|---|---|---|---|---|\n",
        docs::machine(),
        docs::load()
    );
    let mut all = Tally::default();
    for scene in scenes::all().iter().filter(|scene| wanted(only, scene.key)) {
        let (mut tally, mut pair) = (Tally::default(), Pair::new(scene.shell.clone()));
        for (name, aim, forces) in forces(scene, &mut pair) {
            pair.begin();
            pair.search(&format!("{name} | {aim}"), &forces, &[], &mut tally);
        }
        let row = format!("| {} | {} |\n", scene.key, tally.cells());
        print!("{row}");
        table += &row;
        all.add(&tally);
    }
    table + &format!("| all | {} |\n", all.cells())
}
