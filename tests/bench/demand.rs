//! What a tolerance saves on twelve scenes, as a table of docs/evidence/leave_out.md:
//! tests/bench/leave_out.py starts it.
#![allow(missing_docs)]

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/demand_scenes.rs"]
mod demand_scenes;

use demand_scenes::*;
use shellwarp::model::Model;
use shellwarp::modes::Demand;
use std::sync::Arc;

/// Runs whose least times are taken.
const RUNS: usize = 7;

/// Seconds of all steps with their positions, each the least of some runs.
fn seconds(scene: &Scene, model: &Arc<Model>) -> f64 {
    let runs: Vec<Vec<f64>> =
        (0..RUNS).map(|_| run(scene, model).into_iter().map(|(_, time)| time).collect()).collect();
    (0..runs[0].len()).map(|k| runs.iter().map(|run| run[k]).fold(f64::INFINITY, f64::min)).sum()
}

fn main() {
    println!("| scene | asked | bound | error | modes | time of all modes |");
    println!("| --- | --- | --- | --- | --- | --- |");
    for scene in scenes() {
        let all = precomputed(&scene, ALL, None);
        let whole = run(&scene, &all);
        let (moved, time) = (moved(&whole, &scene), seconds(&scene, &all));
        for share in SHARES {
            let demand = Demand { tolerance: share * moved, ..scene.demand.clone() };
            let model = precomputed(&scene, ALL, Some(demand));
            let [bound, error] = [model.truncation, apart(&run(&scene, &model), &whole)].map(|x| 100.0 * x / moved);
            let saved = 100.0 * seconds(&scene, &model) / time;
            println!(
                "| {} | {:.0} % | {bound:.2} % | {error:.3} % | {} | {saved:.0} % |",
                scene.name,
                100.0 * share,
                model.modal.n_modes()
            );
        }
    }
}
