//! Models that leave out the modes which a scene does not need: whatever the scene and the tolerance, no vertex is off by more than
//! asked, against the same method with many more modes. tests/bench/demand.rs prints what that saves.
#![allow(missing_docs)]
mod common;
#[path = "common/demand_scenes.rs"]
mod demand_scenes;
use demand_scenes::*;
use shellwarp::modes::Demand;

#[test]
fn no_vertex_is_off_by_more_than_the_tolerance() {
    for scene in scenes() {
        let whole = run(&scene, &precomputed(&scene, ALL, None));
        let moved = moved(&whole, &scene);
        let mut fewest = usize::MAX;
        for share in SHARES {
            let tolerance = share * moved;
            let model = precomputed(&scene, ALL, Some(Demand { tolerance, ..scene.demand.clone() }));
            let (off, modes, bound) = (apart(&run(&scene, &model), &whole), model.n_modes(), model.truncation);
            println!(
                "{:<32} moves {moved:.3}, asked {tolerance:.1e}, bound {bound:.1e}, off {off:.1e}, {modes} modes",
                scene.name
            );
            assert!(off <= tolerance && modes < ALL, "{}: {off:e} of {tolerance:e}", scene.name);
            assert!(bound <= tolerance, "{}: too few modes", scene.name);
            assert!(modes <= fewest);
            fewest = modes;
        }
    }
}
