//! The loads of docs/evidence/front.md, of which each grows from rest to three strengths.

use crate::cases;
use crate::pair::{HEAD, Pair, Tally};
use crate::scenes::{self, Action};
use crate::{docs, wanted};
use shellwarp::Vec3;
use shellwarp::constraint::{Constraint, Target};

/// The tables of what the searches took, and of where they end elsewhere.
pub fn tables(only: &[String]) -> [String; 2] {
    let mut table = format!(
        "The loads of [front](front.md), its handles among them, from one strength to the next. By the energy alone → with the stress as an unknown; \
         `make bench-solver` on {} (load {}).\n\n| shell | {HEAD} |\n|---|---|---|---|---|---|---|\n",
        docs::machine(),
        docs::load()
    );
    let mut ends = String::from(
        "| shell | load | aim | apart, % | potential, by the energy alone | with the stress as an unknown |\n|---|---|---|---|---|---|\n",
    );
    let mut all = Tally::default();
    for scene in scenes::all().iter().filter(|scene| wanted(only, scene.key)) {
        let (mut tally, mut pair) = (Tally::default(), Pair::new(scene.shell.clone()));
        let n = scene.shell.mass.len();
        for case in cases::find(scene) {
            if case.strengths.len() == 1 {
                pair.begin();
            }
            let strength = case.strengths[case.strengths.len() - 1];
            let (mut forces, mut constraints) = (vec![Vec3::zeros(); n], vec![]);
            match &scene.loads(case.part.list())[case.load].action {
                Action::Forces(of) => forces.iter_mut().zip(of).for_each(|(f, of)| *f = strength * of),
                Action::Handle(v, direction) => {
                    let target = Target::Position(scene.shell.mesh.positions[*v] + strength * direction);
                    let axes = std::array::from_fn(|a| direction[a] != 0.0);
                    constraints.push(Constraint { id: 1, vertex: *v as u32, axes, compliance: 0.0, target });
                }
            }
            pair.search(&format!("{} | {}", case.name, case.aim), &forces, &constraints, &mut tally);
        }
        for e in &tally.elsewhere {
            let [a, b] = e.potential;
            ends += &format!("| {} | {} | {:.1} | {a:.6e} | {b:.6e} |\n", scene.key, e.load, 100.0 * e.apart);
        }
        let row = format!("| {} | {} |\n", scene.key, tally.cells());
        print!("{row}");
        table += &row;
        all.add(&tally);
    }
    table += &format!("| all | {} |\n", all.cells());
    println!("{ends}");
    [table, ends]
}
