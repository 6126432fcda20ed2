//! The obstacle course of linear shells by Koiter's energy, against the displacements that its authors give. `docs/evidence/koiter.md` has it on all meshes.

use crate::plates;
use course::{Problem, cylinder, hemisphere, roof, solved};
use plates::Family;
use shellwarp::energy::koiter;
use shellwarp::material::ElasticSheet;
use shellwarp::{Material, Mesh, Vec3};

#[allow(dead_code)] // what prints the page
#[path = "../bench/koiter_obstacles.rs"]
mod course;

/// For the page alone.
fn name(family: Family) -> String {
    format!("{family:?}")
}

/// How far the displacement is off the reference's, at 16 cells and at 32, of squares cut along both diagonals by turns.
fn off(make: fn(Family, usize) -> Problem, sheet: ElasticSheet, reference: f64) -> [f64; 2] {
    [16, 32].map(|n| {
        let problem = make(Family::UnionJack, n);
        let mesh = Mesh::new(problem.sheet.0.clone(), &problem.sheet.1).unwrap();
        solved(&problem, &koiter(&mesh, &sheet, &[])) / reference - 1.0
    })
}

/// An error of first order halves with the cells, one of second order is a quarter; 0.6 leaves room for what neither says, such as the reference's digits.
fn converges([coarse, fine]: [f64; 2]) -> bool {
    fine.abs() < 0.6 * coarse.abs()
}

/// Membrane and bending together. Triangles of constant strain are too stiff by some percent: 9 at 16 cells on the page.
#[test]
fn scordelis_and_los_roof_sinks_as_far_as_theirs() {
    let sheet = ElasticSheet { young: 4.32e8, poisson: 0.0, thickness: 0.25, volume_density: 1.0 };
    let off = off(roof, sheet, 0.3024);
    assert!(off[0].abs() < 0.1 && converges(off), "{off:?}");
}

/// Bending nearly without stretch, which locks where strains cannot vanish: an energy that locks gives a fraction, the page's paper 0.5.
#[test]
fn a_pinched_hemisphere_does_not_lock() {
    let sheet = ElasticSheet { young: 6.825e7, poisson: 0.3, thickness: 0.04, volume_density: 1.0 };
    let off = off(hemisphere, sheet, 0.0924);
    assert!(off[0].abs() < 0.02 && converges(off), "{off:?}");
}

/// A point force, near which the cells must be small: 15 % at 16 cells, as the page has it, and half of it at 32.
#[test]
fn a_pinched_cylinder_gives_as_far_as_the_series_says() {
    let sheet = ElasticSheet { young: 3e4, poisson: 0.3, thickness: 1.0, volume_density: 1.0 };
    let off = off(cylinder, sheet, 164.24 / 3e4);
    assert!(off[0].abs() < 0.17 && converges(off), "{off:?}");
}
