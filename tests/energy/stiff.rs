//! Modes and implicit steps where stiffness and sizes differ by many powers of ten: right, or refused with the numbers, never
//! silently wrong.

use crate::common::*;
use shellwarp::modes::{Modes, Progress, lowest_modes};
use shellwarp::reference::{Rayleigh, Solver};
use shellwarp::{ErrorKind, Material, Mesh, Shell, Supports, Vec3};
use std::sync::Arc;

type Sheet = (Vec<Vec3>, Vec<[u32; 3]>);

fn stiff(k: f64) -> Material {
    Material { k_area: k, k_length: k, k_bend: 1.0, area_density: 1.0 }
}

fn root((positions, _): &Sheet, edge: f64) -> Vec<u32> {
    (0..positions.len() as u32).filter(|v| positions[*v as usize].x < 1.01 * edge).collect()
}

fn solve(sheet: &Sheet, material: Material, fixed: &[u32], wanted: usize) -> shellwarp::Result<Modes> {
    let mesh = Mesh::new(sheet.0.clone(), &sheet.1)?;
    let shell = Shell::new(mesh, material, &Supports { fixed: fixed.to_vec(), ..Default::default() })?;
    lowest_modes(&shell, wanted, &mut Progress::new(&mut |_, _| Ok(())))
}

/// The sheet and a copy of it scaled by `ratio` beside it.
fn with_small_copy(sheet: &Sheet, ratio: f64) -> Sheet {
    let n = sheet.0.len() as u32;
    let (mut positions, mut triangles) = sheet.clone();
    positions.extend(sheet.0.iter().map(|p| p * ratio + Vec3::new(0.0, 3.0, 0.0)));
    triangles.extend(sheet.1.iter().map(|t| t.map(|v| v + n)));
    (positions, triangles)
}

#[test]
fn a_small_sheet_beside_a_large_one_does_not_spoil_its_modes() {
    // Sizes 1 : 1e8. Before the problem was split by components, 1 : 1e6 gave eigenvalues a hundred times too large, certified.
    for (columns, rows) in [(8, 4), (30, 8)] {
        let edge = 1.0 / columns as f64;
        let sheet = equilateral_sheet(columns, rows, edge);
        for free in [false, true] {
            let fixed = if free { vec![] } else { root(&sheet, edge) };
            let alone = solve(&sheet, stiff(1e4), &fixed, 12).unwrap();
            for power in [2, 4, 6, 8] {
                let both = with_small_copy(&sheet, 10f64.powi(-power));
                let n = sheet.0.len() as u32;
                let fixed: Vec<u32> = fixed.iter().flat_map(|v| [*v, v + n]).collect();
                let modes = solve(&both, stiff(1e4), &fixed, 12 + if free { 6 } else { 0 }).unwrap();
                assert_eq!(modes.zero_modes, if free { 12 } else { 0 });
                assert_eq!(modes.certificate.count, modes.certificate.found);
                let zeros = if free { 6 } else { 0 };
                for (k, lambda) in alone.eigenvalues.iter().enumerate().skip(zeros) {
                    // The same numbers to rounding: 1e-12 for 1e3 unknowns.
                    assert_close(&format!("1e-{power}, mode {k}"), modes.eigenvalues[k + zeros], *lambda, 1e-12, 0.0);
                }
            }
        }
    }
}

#[test]
fn the_smaller_sheets_modes_follow_the_scaling_law_too() {
    // λ ~ k_B/(ρ L⁴) for bending: a copy of 1 : 1000 with all its modes asked for.
    let sheet = equilateral_sheet(4, 2, 0.25);
    let fixed = root(&sheet, 0.25);
    let n = sheet.0.len() as u32;
    let both: Vec<u32> = fixed.iter().flat_map(|v| [*v, v + n]).collect();
    let ratio = 1e-3;
    let modes = solve(&with_small_copy(&sheet, ratio), stiff(1e4), &both, 1000).unwrap();
    // The membrane terms scale as L⁻³ and the others as L⁻⁴ and L⁻²: the small sheet's own, from its own material.
    let lengths = |s: f64| Material { k_area: 1e4 * s * s, k_length: 1e4 * s, k_bend: 1.0, area_density: 1.0 };
    let alone = solve(&sheet, lengths(ratio), &fixed, 1000).unwrap();
    let small = &modes.eigenvalues[alone.eigenvalues.len()..];
    for (k, lambda) in alone.eigenvalues.iter().enumerate() {
        assert_close(&format!("mode {k}"), small[k] * ratio.powi(4), *lambda, 1e-9, 0.0);
    }
}

#[test]
fn a_small_stiff_sheet_keeps_its_bending_modes() {
    // A flat sheet's bending does not know its membrane. By the dense solver alone, 1e16 gave an eigenvalue 13 times too large.
    let sheet = equilateral_sheet(8, 4, 0.125);
    for free in [false, true] {
        let fixed = if free { vec![] } else { root(&sheet, 0.125) };
        let base = solve(&sheet, stiff(1e5), &fixed, 8).unwrap();
        for power in [8, 10, 12, 14, 16] {
            let modes = solve(&sheet, stiff(10f64.powi(power)), &fixed, 8).unwrap();
            for k in base.zero_modes..8.min(base.zero_modes + 2) {
                // √(‖A‖/λ) of rounding: 3e8 of 1e-16 at 1e16.
                let name = format!("k = 1e{power}, free: {free}, mode {k}");
                assert_close(&name, modes.eigenvalues[k], base.eigenvalues[k], 1e-7, 0.0);
            }
        }
    }
}

/// A third of a cylinder of radius 1 and length 1.
fn arch(across: usize) -> Sheet {
    let edge = 1.0 / across as f64;
    let (flat, triangles) = equilateral_sheet(2 * across, across, edge);
    let bend = |p: &Vec3| Vec3::new(p.x.sin(), p.y, p.x.cos());
    (flat.iter().map(bend).collect(), triangles)
}

#[test]
fn a_stiff_curved_shell_is_right_or_refused_with_the_numbers() {
    // The sparse search against the refined dense one, which is taken when many modes are asked for.
    let sheet = arch(8);
    let n = sheet.0.len();
    for fixed in [vec![], root(&sheet, 0.06)] {
        let mut refused = 0;
        for power in [4, 6, 8, 10, 12, 14, 16, 18, 20] {
            let material = stiff(10f64.powi(power));
            let sure = solve(&sheet, material, &fixed, 3 * n).unwrap();
            match solve(&sheet, material, &fixed, 10) {
                Ok(modes) => {
                    // Digits lost to stiffness are told: none at 1e4, and more than a few of them past 1e12.
                    let lost = modes.certificate.disagreement;
                    println!("1e{power}: eigenvalues disagree by {lost:.1e}");
                    assert!(
                        lost <= 0.01 && (power > 4 || lost < 1e-7) && (power < 12 || lost > 1e-9),
                        "1e{power}: {lost:e}"
                    );
                    for k in sure.zero_modes..10 {
                        // Twice the second-order error of the share that vectors may be wrong by.
                        let name = format!("k = 1e{power}, mode {k}");
                        assert_close(&name, modes.eigenvalues[k], sure.eigenvalues[k], 2e-3, 0.0);
                    }
                }
                Err(error) => {
                    refused += 1;
                    println!("1e{power}: {}", error.message);
                    assert_eq!(error.kind, ErrorKind::Numerical);
                    assert!(error.message.contains("64-bit") && error.message.contains('e'), "{}", error.message);
                }
            }
        }
        println!("{refused} refused of 9 with {} fixed", fixed.len());
        assert!(refused < 6, "{refused}: up to 1e10 there is no reason to");
    }
}

#[test]
fn a_strip_that_narrows_a_millionfold_is_refused_with_the_numbers() {
    // Its dense solution is itself out of reach; the factorized eigenvalue is off by a fifth.
    let n = 60;
    let q = 1e-6f64.powf(1.0 / f64::from(n));
    let (mut positions, mut triangles) = (vec![], vec![]);
    for i in 0..=n {
        let w = q.powi(i);
        positions.extend([Vec3::new(1.0 - w, 0.0, 0.0), Vec3::new(1.0 - w, 0.1 * w, 0.0)]);
        if i < n {
            let a = 2 * i as u32;
            triangles.extend([[a, a + 2, a + 1], [a + 1, a + 2, a + 3]]);
        }
    }
    let error = solve(&(positions, triangles), stiff(1e4), &[0, 1, 2, 3], 8).err().unwrap();
    assert_eq!(error.kind, ErrorKind::Numerical);
    assert!(error.message.contains("mode 0 of 8: its eigenvalue is"), "{}", error.message);
}

#[test]
fn a_tiny_sheet_does_not_stop_the_implicit_steps_of_a_large_one() {
    // Rounding on the tiny one gives forces of 1e-16 k/l, far above the load on the large one; nothing held it, so its share of
    // the Hessian was singular to rounding, and the shift against that held the large one, too: 1 : 1e6 did not fall at all.
    let sheet = equilateral_sheet(16, 3, 0.25);
    let (n, edge, h, steps) = (sheet.0.len(), 0.25, 1.0 / 30.0, 30);
    let gravity = Vec3::new(0.0, 0.0, -0.5);
    let play = |both: &Sheet, fixed: Vec<u32>| {
        let mesh = Mesh::new(both.0.clone(), &both.1).unwrap();
        let shell = Arc::new(Shell::new(mesh, stiff(1e4), &Supports { fixed, ..Default::default() }).unwrap());
        let forces: Vec<Vec3> = shell.mass.iter().map(|m| *m * gravity).collect();
        let mut solver = Solver::new(shell.clone()).unwrap();
        let (mut u, mut v) = (vec![Vec3::zeros(); forces.len()], vec![Vec3::zeros(); forces.len()]);
        for _ in 0..steps {
            let report = solver.implicit_euler(&mut u, &mut v, &forces, Rayleigh::default(), h).unwrap();
            // Solutions, of which those by a kept factor are cheap: 27 at 1 : 1e4, where the tiny one's rounding hovers about the end; without it 4.
            assert!(report.iterations <= 40, "{report:?}");
        }
        (u, shell.mass.clone())
    };
    let fallen = 0.5 * gravity.z * h * h * f64::from(steps * (steps + 1)); // backward Euler's
    let centre = |(u, mass): (&[Vec3], &[f64])| {
        mass.iter().zip(u).map(|(m, u)| *m * u.z).sum::<f64>() / mass.iter().sum::<f64>()
    };
    let bent = play(&sheet, root(&sheet, edge)).0;
    for power in [1, 2, 4, 6, 8] {
        let both = with_small_copy(&sheet, 10f64.powi(-power));
        let (u, mass) = play(&both, vec![]);
        for part in [0..n, n..2 * n] {
            // Newton's tolerance of 1e-9 a step.
            assert_close(&format!("1e-{power}"), centre((&u[part.clone()], &mass[part])), fallen, 1e-7, 0.0);
        }
        let (u, mass) = play(&both, root(&sheet, edge));
        assert_close("the tiny one's fall", centre((&u[n..], &mass[n..])), fallen, 1e-7, 0.0);
        for (u, alone) in u.iter().zip(&bent) {
            // The same, over a softest mode some thousand times softer than the load's own.
            assert!((u - alone).norm() <= 1e-6 * bent[n - 1].norm(), "1e-{power}: {u:?} for {alone:?}");
        }
    }
}
