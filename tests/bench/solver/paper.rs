//! The paper's scenes at rest: its beams under gravity and led by their tips, and what its character wears, hung by its joints.

use crate::character;
use crate::common::{mesh, reference};
use crate::pair::{HEAD, Pair, Tally};
use crate::{docs, wanted};
use nalgebra::UnitQuaternion;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::{Material, Shell, Supports, Vec3};
use std::sync::Arc;

/// A beam of tests/data/reference, its membrane and its bending by these factors.
fn beam(name: &str, [membrane, bending]: [f64; 2]) -> Arc<Shell> {
    let (shell, _) = reference(name);
    let of = shell.material.discrete_shells().unwrap();
    let material =
        Material { k_area: membrane * of.k_area, k_length: membrane * of.k_length, k_bend: bending * of.k_bend, ..*of };
    let fixed = (0..shell.held.len() as u32).filter(|v| shell.held[*v as usize]).collect();
    let supports = Supports { fixed, ..Supports::default() };
    Arc::new(Shell::new(mesh(&format!("{name}.obj")), material, &supports).unwrap())
}

/// Each from rest.
fn weights(shell: Arc<Shell>, direction: [f64; 3], strengths: &[f64], tally: &mut Tally) {
    let mut pair = Pair::new(shell.clone());
    for g in strengths {
        pair.begin();
        let forces: Vec<Vec3> = shell.mass.iter().map(|m| *g * *m * Vec3::from(direction)).collect();
        pair.search(&format!("gravity {g}"), &forces, &[], tally);
    }
}

/// A displacement, and a rotation in degrees.
type Key = (Option<[f64; 3]>, Option<[f64; 3]>);

/// Positions and rotations of the flat beam's tip, one after another: the keys of tests/scenes/handles_*.toml.
fn led(keys: &[Key], axes: [bool; 3], tally: &mut Tally) {
    let shell = beam("flat_beam", [1.0, 1.0]);
    let tip = Vec3::new(4.0, 0.0, 0.0);
    let place = |v: usize| shell.mesh.positions[v];
    let nearest = |a: &usize, b: &usize| (place(*a) - tip).norm().total_cmp(&(place(*b) - tip).norm());
    let v = (0..shell.mass.len()).min_by(nearest).unwrap();
    let mut pair = Pair::new(shell.clone());
    let none = vec![Vec3::zeros(); shell.mass.len()];
    for (at, (offset, turn)) in keys.iter().enumerate() {
        let holds = |id: u32, axes, target| Constraint { id, vertex: v as u32, axes, compliance: 0.0, target };
        let position = offset.map(|d| holds(1, axes, Target::Position(place(v) + Vec3::from(d))));
        let turned = |r: [f64; 3]| UnitQuaternion::from_scaled_axis(Vec3::from(r).map(f64::to_radians));
        let orientation = turn.map(|r| holds(2, [true; 3], Target::Orientation(turned(r))));
        let constraints: Vec<Constraint> = position.into_iter().chain(orientation).collect();
        pair.search(&format!("key {}", at + 1), &none, &constraints, tally);
    }
}

type Scene = (&'static str, Box<dyn Fn(&mut Tally)>);

fn scenes() -> Vec<Scene> {
    let down = [0.0, 0.0, -1.0];
    let stiffer = move |name: &'static str, g: f64| -> Box<dyn Fn(&mut Tally)> {
        Box::new(move |tally| {
            for factor in [1.0, 10.0, 100.0] {
                weights(beam(name, [1.0, factor]), down, &[g], tally);
            }
        })
    };
    let swept = |membrane: f64, direction, strengths: &'static [f64]| -> Box<dyn Fn(&mut Tally)> {
        Box::new(move |tally| weights(beam("v_beam", [membrane, 1.0]), direction, strengths, tally))
    };
    let places = [[-0.6, 0.0, 1.8], [-0.7, 0.2, 1.5], [-0.5, 0.0, 1.2], [-0.5, -0.2, 1.4], [-0.6, 0.0, 1.8]];
    let turns = [[60.0, 0.0, 0.0], [0.0, -70.0, 0.0], [-60.0, 0.0, 0.0], [-45.0, -50.0, 0.0]];
    let heights = [1.4, 1.5, 0.0, -1.5, -1.2].map(|z| [0.0, 0.0, z]);
    let twists = [[0.0; 3], [50.0, 0.0, 0.0], [0.0, -60.0, 0.0], [-50.0, 0.0, 0.0], [0.0; 3]];
    let both: Vec<_> = heights.into_iter().zip(twists).map(|(d, r)| (Some(d), Some(r))).collect();
    let mut scenes: Vec<Scene> = vec![
        ("flat beam, bending × 1, 10, 100", stiffer("flat_beam", 0.4)),
        ("V-beam, bending × 1, 10, 100", stiffer("v_beam", 7.0)),
        ("V-beam, straight down", swept(1.0, down, &[1.0, 3.0, 5.0, 7.0])),
        ("V-beam, aslant", swept(1.0, [0.0, 0.6, -0.8], &[1.0, 3.0, 5.0, 7.0])),
        ("V-beam, soft membrane", swept(0.01, down, &[0.02, 0.05, 0.1, 0.2, 0.3])),
        ("flat beam, its tip led", Box::new(move |tally| led(&places.map(|d| (Some(d), None)), [true; 3], tally))),
        ("flat beam, its tip turned", Box::new(move |tally| led(&turns.map(|r| (None, Some(r))), [true; 3], tally))),
        ("flat beam, its tip led and turned", Box::new(move |tally| led(&both, [false, false, true], tally))),
    ];
    for (name, garment) in character::GARMENTS {
        let hang = move |tally: &mut Tally| {
            let worn = garment();
            let mut pair = Pair::new(worn.shell.clone());
            let weight: Vec<Vec3> = worn.shell.mass.iter().map(|m| *m * character::GRAVITY).collect();
            pair.search("hangs", &weight, &worn.joints(0.0), tally);
        };
        scenes.push((name, Box::new(hang)));
    }
    scenes
}

pub fn table(only: &[String]) -> String {
    let mut table = format!(
        "By the energy alone → with the stress as an unknown; `make bench-solver` on {} (load {}).\n\n| scene | {HEAD} |\n|---|---|---|---|---|---|---|\n",
        docs::machine(),
        docs::load()
    );
    for (name, run) in scenes().iter().filter(|(name, _)| wanted(only, name)) {
        let mut tally = Tally::default();
        run(&mut tally);
        let row = format!("| {name} | {} |\n", tally.cells());
        print!("{row}");
        for e in &tally.elsewhere {
            println!("  {}: {:.1e} apart, potentials {:?}", e.load, e.apart, e.potential);
        }
        table += &row;
    }
    table
}
