//! Shells in many pieces: right modes, a stated choice among equal ones, and a bounded cost.

use crate::common::*;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::modes::{Demand, Modes, Progress, ScaledStiffness, demanded_modes, lowest_modes, repeated};
use shellwarp::state::{Method, State};
use shellwarp::step::Integrator;
use shellwarp::{Error, ErrorKind, Material, Mesh, Shell, Supports, Vec3};
use std::collections::HashMap;
use std::sync::Arc;

type Sheet = (Vec<Vec3>, Vec<[u32; 3]>);

/// A sheet of 3 × 2 rows that is arched, so that no two of its modes are equal.
fn arch() -> Sheet {
    let (mut positions, triangles) = equilateral_sheet(3, 2, 0.5);
    positions.iter_mut().for_each(|p| p.z = 0.3 * p.x * (1.5 - p.x) + 0.1 * p.x * p.y);
    (positions, triangles)
}

fn quad() -> Sheet {
    let corner = |x: f64, y: f64| Vec3::new(x, y, 0.0);
    (vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)], vec![[0, 1, 2], [0, 2, 3]])
}

/// So many of a sheet, in rows of a hundred.
fn copies(count: usize, (positions, triangles): &Sheet) -> Sheet {
    let n = positions.len() as u32;
    let place = |i: usize| Vec3::new(2.0 * (i % 100) as f64, 2.0 * (i / 100) as f64, 0.0);
    let moved = (0..count).flat_map(|i| positions.iter().map(move |p| p + place(i))).collect();
    let named = (0..count as u32).flat_map(|i| triangles.iter().map(move |t| t.map(|v| v + i * n))).collect();
    (moved, named)
}

/// The vertices of every copy that these are of the sheet.
fn of_copies(count: usize, (positions, _): &Sheet, vertices: &[u32]) -> Vec<u32> {
    (0..count as u32).flat_map(|i| vertices.iter().map(move |v| v + i * positions.len() as u32)).collect()
}

fn both(mut a: Sheet, b: Sheet) -> Sheet {
    let n = a.0.len() as u32;
    a.0.extend(b.0);
    a.1.extend(b.1.iter().map(|t| t.map(|v| v + n)));
    a
}

fn shell(sheet: Sheet, clamped: Vec<u32>) -> Shell {
    let material = Material { k_area: 100.0, k_length: 100.0, k_bend: 1.0, area_density: 1.0 };
    let supports = Supports { clamped, ..Default::default() };
    Shell::new(Mesh::new(sheet.0, &sheet.1).unwrap(), material, &supports).unwrap()
}

/// The side x = 0 of a sheet.
fn side(sheet: &Sheet) -> Vec<u32> {
    (0..sheet.0.len() as u32).filter(|v| sheet.0[*v as usize].x == 0.0).collect()
}

/// What every result must show: nothing is missing, ΦᵀMΦ = I and Kφ = λMφ, the last two from the shapes themselves.
#[track_caller]
fn assert_certified(shell: &Shell, modes: &Modes) {
    let c = &modes.certificate;
    println!("{c:?}, zero modes {} of {}", modes.zero_modes, modes.shapes.len());
    assert_eq!(c.count, c.found, "a mode is missing");
    assert!(c.residual <= 1e-8 && c.orthonormality <= 1e-10);
    assert!(modes.eigenvalues.is_sorted());
    assert!(c.found >= modes.shapes.len() && modes.eigenvalues.iter().all(|lambda| *lambda < c.shift));
    let stiffness = ScaledStiffness::assemble(shell).unwrap();
    for (i, (phi, lambda)) in modes.shapes.iter().zip(&modes.eigenvalues).enumerate() {
        let product = |other: &Vec<Vec3>| (0..phi.len()).map(|v| shell.mass[v] * phi[v].dot(&other[v])).sum::<f64>();
        for (j, other) in modes.shapes[..=i].iter().enumerate() {
            let expected = f64::from(u8::from(i == j));
            assert!((product(other) - expected).abs() <= 1e-10, "ΦᵀMΦ at {i}, {j} is {}", product(other));
        }
        let y: Vec<f64> =
            shell.free.iter().flat_map(|v| (phi[*v as usize] * shell.mass[*v as usize].sqrt()).data.0[0]).collect();
        let off = stiffness.apply(&y).iter().zip(&y).map(|(a, y)| (a - lambda * y).powi(2)).sum::<f64>().sqrt();
        assert!(off <= 1e-8 * stiffness.norm, "mode {i}: ‖Ay − λy‖ = {off:e}");
    }
}

#[test]
fn thirty_loose_quads_and_more_have_their_modes() {
    for count in [30, 31, 1000] {
        let shell = shell(copies(count, &quad()), vec![]);
        let modes = modes_of(&shell, 16);
        assert_certified(&shell, &modes);
        // All sixteen are rigid motions of the quads, of which there are six each.
        assert_eq!((modes.zero_modes, modes.certificate.found), (16, 6 * count));
        // The first three move all alike, along x, y and z.
        for (axis, phi) in [Vec3::x(), Vec3::y(), Vec3::z()].iter().zip(&modes.shapes) {
            let amount = 1.0 / shell.total_mass.sqrt();
            assert!(phi.iter().all(|u| (u - amount * axis).norm() <= 1e-12 * amount), "{count} quads along {axis:?}");
        }
    }
}

#[test]
fn alike_pieces_have_one_pieces_eigenvalues_as_often_as_there_are_pieces() {
    let sheet = arch();
    for (count, held) in [(12, true), (12, false), (40, true), (40, false)] {
        let clamped = |count: usize| if held { of_copies(count, &sheet, &side(&sheet)) } else { vec![] };
        let alone = modes_of(&shell(sheet.clone(), clamped(1)), 10);
        let all = shell(copies(count, &sheet), clamped(count));
        // Into the middle of the eighth group.
        let wanted = 7 * count + count / 2;
        let modes = modes_of(&all, wanted);
        assert_certified(&all, &modes);
        assert_eq!(modes.zero_modes, if held { 0 } else { 6 * count });
        assert_eq!(modes.certificate.found, 8 * count, "to the end of the group");
        for (k, lambda) in modes.eigenvalues.iter().enumerate().skip(modes.zero_modes) {
            // Coordinates lose two digits at a distance of 80: 1e-14 of an edge, 1e-12 of an energy.
            assert_close(&format!("mode {k}"), *lambda, alone.eigenvalues[k / count], 1e-10, 0.0);
        }
    }
}

/// Σ P_k²/Σ m along z of the first modes.
fn carried(shell: &Shell, modes: &Modes) -> f64 {
    let factor = |phi: &Vec<Vec3>| phi.iter().zip(&shell.mass).map(|(phi, m)| m * phi.z).sum::<f64>();
    let moving: f64 = shell.free.iter().map(|v| shell.mass[*v as usize]).sum();
    modes.shapes.iter().map(|phi| factor(phi).powi(2)).sum::<f64>() / moving
}

#[test]
fn three_of_forty_equal_modes_hold_all_that_gravity_does_to_the_forty() {
    let sheet = arch();
    let alone = shell(sheet.clone(), side(&sheet));
    let all = shell(copies(40, &sheet), of_copies(40, &sheet, &side(&sheet)));
    let (one, three) = (modes_of(&alone, 1), modes_of(&all, 3));
    assert_certified(&all, &three);
    assert_eq!(three.certificate.found, 40);
    assert!(repeated(three.eigenvalues[0], three.eigenvalues[2]));
    assert!(carried(&alone, &one) > 0.1);
    // To the digits that the copies' coordinates leave.
    assert_close("effective mass", carried(&all, &three), carried(&alone, &one), 1e-10, 0.0);
}

#[test]
fn crumbs_do_not_change_a_large_shells_modes() {
    let (sheet, crumb) = (equilateral_sheet(20, 16, 0.5), arch());
    let n = sheet.0.len() as u32;
    let small: Sheet = (crumb.0.iter().map(|p| 0.05 * p - Vec3::new(9.0, 9.0, 0.0)).collect(), crumb.1.clone());
    let alone = modes_of(&shell(sheet.clone(), side(&sheet)), 12);
    for held in [true, false] {
        let count = 300usize;
        let crumbs = of_copies(count, &crumb, &side(&crumb)).iter().map(|v| v + n).collect();
        let clamped = [side(&sheet), if held { crumbs } else { vec![] }].concat();
        let all = shell(both(sheet.clone(), copies(count, &small)), clamped);
        let modes = modes_of(&all, 12);
        assert_certified(&all, &modes);
        if held {
            for (k, lambda) in alone.eigenvalues.iter().enumerate() {
                // The same numbers to rounding: 1e-12 for 1e3 unknowns.
                assert_close(&format!("mode {k}"), modes.eigenvalues[k], *lambda, 1e-12, 0.0);
            }
        } else {
            assert_eq!((modes.zero_modes, modes.certificate.found), (12, 6 * count));
        }
    }
}

#[test]
fn supports_cut_a_sheet_into_pieces_too() {
    // Strips of 6 columns between clamped columns, as one mesh.
    let strips = 9;
    let sheet = |strips: usize| equilateral_sheet(6 * strips, 4, 0.25);
    let clamped = |sheet: &Sheet| -> Vec<u32> {
        (0..sheet.0.len() as u32).filter(|v| (sheet.0[*v as usize].x / 1.5).fract() == 0.0).collect()
    };
    let (one, many) = (sheet(1), sheet(strips));
    let alone = modes_of(&shell(one.clone(), clamped(&one)), 3);
    let all = shell(many.clone(), clamped(&many));
    let modes = modes_of(&all, 3 * strips);
    assert_certified(&all, &modes);
    assert_eq!((all.mesh.n_components, modes.zero_modes), (1, 0));
    for (k, lambda) in modes.eigenvalues.iter().enumerate() {
        assert_close(&format!("mode {k}"), *lambda, alone.eigenvalues[k / strips], 1e-10, 0.0);
    }
}

/// A mesh cut along the sides of boxes of `edge`, with a vertex for each fan of triangles: pieces of every size and shape.
fn cut((positions, triangles): &Sheet, edge: f64) -> Sheet {
    let cell = |t: &[u32; 3]| {
        let centre = t.iter().map(|v| positions[*v as usize]).sum::<Vec3>() / 3.0;
        [centre.x, centre.y, centre.z].map(|x| (x / edge).floor() as i64)
    };
    // Corners 3t + k of one fan are one vertex: the least of them stands for it.
    let mut fan: Vec<usize> = (0..3 * triangles.len()).collect();
    let mut sides: HashMap<(u32, u32), (usize, [usize; 2])> = HashMap::new();
    let mut pairs = vec![];
    for (t, tri) in triangles.iter().enumerate() {
        for k in 0..3 {
            let l = (k + 1) % 3;
            match sides.get(&(tri[l], tri[k])) {
                // The neighbour runs along the edge the other way.
                Some((other, [a, b])) if cell(&triangles[*other]) == cell(tri) => {
                    pairs.extend([(3 * t + k, *b), (3 * t + l, *a)]);
                }
                _ => drop(sides.insert((tri[k], tri[l]), (t, [3 * t + k, 3 * t + l]))),
            }
        }
    }
    let mut changed = true;
    while std::mem::take(&mut changed) {
        for &(a, b) in &pairs {
            let least = fan[a].min(fan[b]);
            changed |= fan[a] != least || fan[b] != least;
            (fan[a], fan[b]) = (least, least);
        }
    }
    let mut number = HashMap::new();
    let mut points = vec![];
    let mut vertex = |corner: usize| {
        *number.entry(fan[corner]).or_insert_with(|| {
            points.push(positions[triangles[corner / 3][corner % 3] as usize]);
            points.len() as u32 - 1
        })
    };
    let cut = (0..triangles.len()).map(|t| [vertex(3 * t), vertex(3 * t + 1), vertex(3 * t + 2)]).collect();
    (points, cut)
}

#[test]
fn a_mesh_cut_into_irregular_pieces_has_the_modes_of_its_pieces() {
    let mesh = read_obj("character_hat.obj");
    let size = Mesh::new(mesh.0.clone(), &mesh.1).unwrap().size;
    let shell = shell(cut(&mesh, size / 7.0), vec![]);
    let pieces = shell.mesh.n_components;
    println!("{} vertices in {pieces} pieces", shell.mass.len());
    assert!(pieces > 30);
    let zeros = 6 * pieces;
    let modes = modes_of(&shell, zeros + 20);
    assert_certified(&shell, &modes);
    assert_eq!(modes.zero_modes, zeros);
    // Elastic modes of pieces that differ are each of one piece.
    for phi in &modes.shapes[zeros..] {
        let moves = |v: &usize| phi[*v].norm() > 0.0;
        let mut of: Vec<u32> = (0..phi.len()).filter(moves).map(|v| shell.mesh.component[v]).collect();
        of.dedup();
        of.sort_unstable();
        of.dedup();
        assert_eq!(of.len(), 1);
    }
    let few = modes_of(&shell, 16);
    assert_certified(&shell, &few);
    assert_eq!((few.zero_modes, few.certificate.found), (16, zeros));
}

#[test]
fn sagged_pieces_are_pieces_too() {
    let sheet = arch();
    let gravity = Vec3::new(0.0, 0.0, -0.5);
    let options = Options { modes: 12, precision: Precision::F64, sag: gravity, ..Options::default() };
    let model = |shell: Shell, modes| {
        let options = Options { modes, ..options.clone() };
        Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap()
    };
    let alone = model(shell(sheet.clone(), side(&sheet)), 2);
    let all = model(shell(copies(12, &sheet), of_copies(12, &sheet, &side(&sheet))), 24);
    assert_eq!(all.certificate.count, all.certificate.found);
    for (k, lambda) in all.modal.eigenvalues.iter().enumerate() {
        // The equilibrium is found to 1e-10 or so of the loads.
        assert_close(&format!("mode {k}"), *lambda, alone.modal.eigenvalues[k / 12], 1e-7, 0.0);
    }
}

#[test]
fn a_tolerance_chooses_among_equal_modes() {
    let sheet = arch();
    let all = shell(copies(12, &sheet), of_copies(12, &sheet, &side(&sheet)));
    let gravity = Vec3::new(0.0, 0.0, -1.0);
    let demand = Demand { tolerance: 0.01, gravity, amplification: 1.0, ..Demand::default() };
    let (modes, bound) = demanded_modes(&all, &demand, (200, true), &mut Progress::new(&mut |_, _| Ok(()))).unwrap();
    println!("{} modes, bound {bound:e}", modes.shapes.len());
    // Gravity moves each group along one field, the first of its basis.
    assert!(bound <= demand.tolerance && modes.shapes.len() <= 12);
}

#[test]
fn modes_of_pieces_are_the_same_bits_every_time() {
    let sheet = arch();
    let make = || modes_of(&shell(copies(25, &sheet), of_copies(20, &sheet, &side(&sheet))), 40);
    let (a, b) = (make(), make());
    assert_eq!(a.eigenvalues, b.eigenvalues);
    assert_eq!(a.shapes, b.shapes);
}

#[test]
fn progress_goes_on_through_the_pieces_and_can_stop_between_them() {
    let sheet = arch();
    let shell = shell(copies(25, &sheet), of_copies(25, &sheet, &side(&sheet)));
    let mut calls = vec![];
    let mut record = |phase, fraction| {
        calls.push((phase, fraction));
        Ok(())
    };
    lowest_modes(&shell, 16, &mut Progress::new(&mut record)).unwrap();
    assert!(calls.len() > 25, "each piece is heard of");
    for pair in calls.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        assert!((0.0..=1.0).contains(&pair[0].1) && pair[0].1 <= pair[1].1, "{pair:?}");
    }
    for stop in 0..calls.len() {
        let mut count = 0;
        let mut cancel = |_, _| {
            count += 1;
            if count > stop { Err(Error::new(ErrorKind::Cancelled, "stop")) } else { Ok(()) }
        };
        let outcome = lowest_modes(&shell, 16, &mut Progress::new(&mut cancel));
        assert_eq!(outcome.err().map(|e| e.kind), Some(ErrorKind::Cancelled), "call {stop}");
    }
}

/// Bytes that were asked for in all, and the most at once, from the mesh to the first step of every method.
fn bytes(count: usize) -> [f64; 2] {
    let shell = Arc::new(shell(copies(count, &quad()), vec![]));
    let counted = allocation_counter::measure(|| {
        let model = Arc::new(Model::precompute(shell.clone(), &Options::default(), &mut |_, _| Ok(())).unwrap());
        for method in [Method::LinearModalAnalysis, Method::Warp, Method::RotationStrain, Method::ImplicitShell] {
            let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
            state.set_gravity(Vec3::new(0.0, 0.0, -9.8)).unwrap();
            state.step(1.0 / 60.0).unwrap();
        }
    });
    [counted.bytes_total as f64, counted.bytes_max as f64]
}

#[test]
fn work_and_memory_grow_with_the_pieces_and_not_with_their_square() {
    let (few, many) = (bytes(500), bytes(4000));
    let growth = [many[0] / few[0], many[1] / few[1]];
    println!("eight times the pieces: {growth:?} times the bytes in all and at once");
    // Work on a vector as long as the shell, or on a thing for each piece, asks for memory. Once a piece it would be 64 times.
    assert!(growth.iter().all(|g| *g < 10.0), "{growth:?}");
}
