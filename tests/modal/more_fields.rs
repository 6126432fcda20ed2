//! What becomes of a reduced shell when more fields are asked for: no other model where there are no more, and no larger error where there are.
//!
//! The sweep's shells are a card, arched by a hair so that it has one answer, and a leaf; its loads are no training's: a tilted gravity,
//! a pinch of the card by 40 % of its length, a lift of the leaf's tip along two axes.

use crate::common::*;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::model::{Model, Options, Precision};
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::{Material, Mesh, Shell, Supports, Vec3, reduced};
use std::sync::Arc;

fn asked(shell: &Arc<Shell>, fields: usize, poses: usize) -> Arc<Model> {
    let reduced = reduced::Options { fields, poses, ..Default::default() };
    let options = Options { modes: 8, precision: Precision::F64, reduced, ..Options::default() };
    Arc::new(Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).unwrap())
}

fn found(model: &Model) -> usize {
    model.reduced.as_ref().unwrap().n() - model.modal.n_modes()
}

/// 30 × 10 cm of card, arched by a hundredth of its length, with a vertex at its end.
fn card() -> (Arc<Shell>, u32) {
    let (mut positions, triangles) = equilateral_sheet(16, 6, 0.3 / 16.0);
    positions.iter_mut().for_each(|x| x.z = 0.003 * (x.x * std::f64::consts::PI / 0.3).sin());
    let fixed = (0..positions.len() as u32).filter(|&v| positions[v as usize].x < 0.02).collect();
    let material = Material { k_area: 5e3, k_length: 5e3, k_bend: 2.7e-3, area_density: 0.3 };
    let far = |v: &usize| positions[*v].x - 0.01 * (positions[*v].y - 0.05).abs();
    let tip = (0..positions.len()).max_by(|a, b| far(a).total_cmp(&far(b))).unwrap() as u32;
    let mesh = Mesh::new(positions, &triangles).unwrap();
    (Arc::new(Shell::new(mesh, material, &Supports { fixed, ..Default::default() }).unwrap()), tip)
}

/// The mirror image across y of displacements of a shell that is its own but for a hair.
fn mirrored(shell: &Shell, u: &[Vec3]) -> Vec<Vec3> {
    let x = &shell.mesh.positions;
    let middle = x.iter().map(|x| x.y).sum::<f64>() / x.len() as f64;
    let across = |v: usize| {
        let image = Vec3::new(x[v].x, 2.0 * middle - x[v].y, x[v].z);
        let far = |w: &usize| (x[*w] - image).norm_squared();
        let w = (0..x.len()).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap();
        Vec3::new(u[w].x, -u[w].y, u[w].z)
    };
    (0..x.len()).map(across).collect()
}

/// The full shell's equilibrium beside displacements `u`, with a vertex where it is in those.
fn beside(model: &Arc<Model>, u: &[Vec3], (vertex, way): (u32, Vec3)) -> State {
    let mut state = State::new(model.clone(), Method::ImplicitShell, Integrator::ImplicitEuler).unwrap();
    let rest = &model.shell.mesh.positions;
    let target = Target::Position(rest[vertex as usize] + way);
    let axes = [way.x != 0.0, way.y != 0.0, way.z != 0.0];
    state.set_constraint(Constraint { id: 1, vertex, axes, compliance: 0.0, target }).unwrap();
    let x: Vec<Vec3> = rest.iter().zip(u).map(|(x, u)| x + u).collect();
    state.set_pose(Space::Frame, &x, None).unwrap();
    state.equilibrium().unwrap();
    state
}

/// Under gravity, and with the vertex led in eight parts.
fn loaded(model: &Arc<Model>, method: Method, gravity: Vec3, led: Option<(u32, Vec3)>) -> Vec<Vec3> {
    let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
    state.set_gravity(gravity).unwrap();
    state.equilibrium().unwrap();
    for (part, (vertex, way)) in (1..=8).zip(led.into_iter().cycle()) {
        let place = model.shell.mesh.positions[vertex as usize] + f64::from(part) / 8.0 * way;
        let axes = [way.x != 0.0, way.y != 0.0, way.z != 0.0];
        let target = Target::Position(place);
        state.set_constraint(Constraint { id: 1, vertex, axes, compliance: 0.0, target }).unwrap();
        state.equilibrium().unwrap();
    }
    displacements(&state)
}

#[test]
fn who_asks_for_more_fields_than_there_are_gets_the_same_model() {
    let (shell, _) = card();
    for poses in [0, 8] {
        let all = asked(&shell, 100, poses);
        let there_are = found(&all);
        println!("{there_are} fields of {poses} poses");
        assert!((20..51).contains(&there_are));
        let bits = all.reduced_fingerprint;
        for fields in [there_are, 51, 64, 120] {
            assert!(asked(&shell, fields, poses).reduced_fingerprint == bits, "{fields} of {poses} poses");
        }
        assert_eq!(found(&asked(&shell, there_are - 1, poses)), there_are - 1);
    }
}

/// A leaf whose tip is lifted toward its stem twists to one side or the other: two equilibria of the full shell, mirror images of each other.
/// Which of them a shell takes is decided by a hair, and the reduced shell's fields are another hair: its error is against the one that it took.
#[test]
fn the_error_does_not_grow_with_the_fields_asked_for() {
    let (card, end) = card();
    let leaf = Arc::new(leaf(1));
    let far = |v: &usize| leaf.mesh.positions[*v].x - leaf.mesh.positions[*v].y.abs();
    let tip = (0..leaf.mass.len()).max_by(|a, b| far(a).total_cmp(&far(b))).unwrap() as u32;
    let (tilted, down) = (Vec3::new(0.4, 0.5, -0.77), Vec3::new(0.0, 0.0, -0.1));
    let lift = (tip, Vec3::new(-0.1, 0.0, 0.2));
    let scenes = [
        ("card, gravity", &card, 2.0 * tilted, None, false),
        ("card, pinch at 40 %", &card, down, Some((end, Vec3::new(-0.12, 0.0, 0.0))), false),
        ("leaf, gravity", &leaf, 0.2 * tilted, None, false),
        ("leaf, tip lifted", &leaf, Vec3::zeros(), Some(lift), true),
    ];
    let mut kept: Vec<(*const Shell, usize, Arc<Model>)> = vec![];
    for (name, shell, gravity, led, two_sided) in scenes {
        let mut errors = vec![];
        for fields in [12, 40, 51, 100] {
            let key = (Arc::as_ptr(shell), fields);
            let before = kept.iter().find(|(shell, fields, _)| (*shell, *fields) == key).map(|kept| kept.2.clone());
            let model = before.unwrap_or_else(|| asked(shell, fields, 8));
            kept.push((key.0, key.1, model.clone()));
            let exact = loaded(&model, Method::ImplicitShell, gravity, led);
            let own = loaded(&model, Method::ReducedShell, gravity, led);
            let mut off = error(&own, &exact);
            if two_sided {
                let [one, other] = [&exact, &mirrored(shell, &exact)].map(|u| beside(&model, u, lift));
                let apart = error(&displacements(&one), &displacements(&other));
                let energies = [&one, &other].map(|state| state.report().elastic_energy);
                let image = error(&displacements(&other), &mirrored(shell, &exact));
                println!("{apart:.3} apart, energies {energies:.6?}, {image:.4} from the mirror image");
                // The leaf's sheet is its mirror image but for 2e-4 of its width.
                assert!(apart > 1.0 && image < 1e-2, "{apart} apart, {image} from the mirror image");
                assert_close("energy", energies[0], energies[1], 1e-2, 0.0);
                off = off.min(error(&own, &displacements(&other)));
            }
            println!("{name}: asked {fields}, found {}: {off:.4}", found(&model));
            errors.push((found(&model), off));
        }
        for pair in errors.windows(2) {
            // Equal where no more are found. More fields hold other poses' details at first, samples and the membrane's share are chosen anew: a
            // seventh, of which a tenth was measured, or a thousandth of the displacement.
            let ((fewer, before), (more, after)) = (pair[0], pair[1]);
            assert!(more > fewer || after == before, "{name}");
            assert!(after <= 1.15 * before + 1e-3, "{name}: {after} after {before}");
        }
    }
}

/// A shell about to buckle to either side lies in a valley that is nearly flat, where a search crawls.
#[test]
fn an_equilibrium_is_found_whatever_the_rounding() {
    let leaf = Arc::new(leaf(1));
    let far = |v: &usize| leaf.mesh.positions[*v].x - leaf.mesh.positions[*v].y.abs();
    let tip = (0..leaf.mass.len()).max_by(|a, b| far(a).total_cmp(&far(b))).unwrap() as u32;
    let model = asked(&leaf, 40, 8);
    let lifted = |k: u32| {
        let mut state = State::new(model.clone(), Method::ReducedShell, Integrator::ImplicitEuler).unwrap();
        let way = Vec3::new(-0.1, 0.0, 0.2) / 8.0 * (1.0 + 1e-9 * f64::from(k));
        let target = Target::Position(leaf.mesh.positions[tip as usize] + way);
        let axes = [true, false, true];
        state.set_constraint(Constraint { id: 1, vertex: tip, axes, compliance: 0.0, target }).unwrap();
        state.equilibrium().unwrap();
        state.report().elastic_energy
    };
    let first = lifted(0);
    // Mirror images of a sheet that is its own but for 2e-4 of its width.
    (1..6).for_each(|k| assert_close("energy", lifted(k), first, 1e-2, 0.0));
}
