//! A shell on a proxy that is given the stiffness of its asset.

use crate::common::{error, leaf, read_obj};
use shellwarp::binding::{Binding, Points};
use shellwarp::material::{ElasticSheet, Factors, Map, Maps, On, Quantity};
use shellwarp::proxy::{Calibration, Options, Proxy, Sides, calibrate};
use shellwarp::reference::Solver;
use shellwarp::{Error, ErrorKind, Material, Mesh, Result, Shell, Supports, Vec3};
use std::sync::Arc;

const SHEET: ElasticSheet = ElasticSheet { young: 1e9, poisson: 0.3, thickness: 0.01, volume_density: 1000.0 };

fn shell(positions: &[Vec3], triangles: &[[u32; 3]], fixed: Vec<u32>, sheet: ElasticSheet) -> Shell {
    let mesh = Mesh::new(positions.to_vec(), triangles).unwrap();
    Shell::new(mesh, sheet, &Supports { fixed, ..Default::default() }).unwrap()
}

type Load<'a> = dyn Fn(&Shell) -> Vec<Vec3> + 'a;

struct Asset {
    own: Arc<Shell>,
    made: Proxy,
    proxy: Arc<Shell>,
}

fn asset(positions: &[Vec3], triangles: &[[u32; 3]], held: &[u32], n_vertices: usize) -> Asset {
    let options = Options { n_vertices, weld: 0.0, sides: Sides::Find, cut: false, keep_pieces: false };
    let made = Proxy::holding(positions, triangles, held, &options, &mut |_| Ok(())).unwrap();
    let thickness = Mesh::new(positions.to_vec(), triangles).unwrap().size / 200.0;
    let sheet = ElasticSheet { thickness, ..SHEET };
    let mut fixed: Vec<u32> = held.iter().map(|v| made.nearest[*v as usize]).collect();
    fixed.sort_unstable();
    fixed.dedup();
    let proxy = shell(&made.positions, &made.triangles, fixed, sheet).into();
    Asset { own: shell(positions, triangles, held.to_vec(), sheet).into(), made, proxy }
}

/// The leaf of four thousand vertices on a tenth of them, in sizes of the first.
fn leaf_asset(size: f64) -> Asset {
    let leaf = leaf(3);
    let held: Vec<u32> = (0..leaf.mass.len() as u32).filter(|v| leaf.held[*v as usize]).collect();
    let positions: Vec<Vec3> = leaf.mesh.positions.iter().map(|x| x * size).collect();
    asset(&positions, &leaf.mesh.triangles, &held, positions.len() / 10)
}

fn calibrated(asset: &Asset) -> (Arc<Shell>, Calibration) {
    let (shell, found) = calibrate(&asset.proxy, &asset.made, &[], &mut |_| Ok(())).unwrap();
    (shell.into(), found)
}

/// Where forces take the asset's vertices by way of the proxy, and how far that is off where they take the asset itself.
fn off(asset: &Asset, proxy: &Arc<Shell>, forces: impl Fn(&Shell) -> Vec<Vec3>) -> f64 {
    let settled = |shell: &Arc<Shell>| {
        let rest = vec![Vec3::zeros(); shell.mass.len()];
        let mut solver = Solver::new(shell.clone()).unwrap();
        solver.equilibrium(&rest, &forces(shell), &Default::default(), &mut |_| Ok(())).unwrap().displacement
    };
    let rest = &asset.own.mesh.positions;
    let (exact, u) = (settled(&asset.own), settled(proxy));
    let largest = exact.iter().map(|u| u.norm()).fold(0.0, f64::max) / asset.own.mesh.size;
    assert!((0.003..0.03).contains(&largest), "moves by {largest:.4} of its size");
    let binding = Binding::new(proxy, &Points { positions: rest, ..Points::default() }).unwrap();
    let x = proxy.mesh.positions.iter().zip(&u).map(|(x, u)| x + u).collect();
    let mut followed = vec![Vec3::zeros(); rest.len()];
    binding.pose(x, None).unwrap().positions(0..rest.len(), |i, x| followed[i] = x - rest[i]);
    error(&followed, &exact)
}

fn pressure(shell: &Shell, p: f64) -> Vec<Vec3> {
    let mut forces = vec![Vec3::zeros(); shell.mass.len()];
    for t in &shell.mesh.triangles {
        let [a, b, c] = t.map(|v| shell.mesh.positions[v as usize]);
        let third = p / 6.0 * (b - a).cross(&(c - a));
        t.iter().for_each(|v| forces[*v as usize] += third);
    }
    forces
}

/// Gravity is what a calibration compares, to first order; it knows nothing of pressure, and of a pull that grows toward the tip.
#[test]
fn a_calibrated_proxy_answers_as_its_asset_to_loads_it_was_not_fitted_to() {
    let asset = leaf_asset(1.0);
    let (fitted, found) = calibrated(&asset);
    assert!(found.difference[1] < 0.2 * found.difference[0], "{found:?}");
    let pulled = |shell: &Shell, along: Vec3| -> Vec<Vec3> {
        shell.mass.iter().zip(&shell.mesh.positions).map(|(m, x)| *m * x.x.powi(4) * along).collect()
    };
    let loads: [(&str, &Load<'_>); 3] = [
        ("gravity", &|shell| shell.mass.iter().map(|m| *m * Vec3::new(0.4, 2.0, 2.0)).collect()),
        ("pressure", &|shell| pressure(shell, 20.0)),
        ("pull", &|shell| pulled(shell, Vec3::new(0.2, 1.0, 0.5))),
    ];
    for (name, load) in loads {
        let (before, after) = (off(&asset, &asset.proxy, load), off(&asset, &fitted, load));
        // The goal for assets is 2 % at a tenth of the vertices; the proxy's own stiffness misses it.
        assert!(before > 0.02 && after < 0.02, "{name}: {before:.4} to {after:.4}");
    }
}

/// Every patch weighs what its part of the asset does, and patches sum to 1.
#[test]
fn a_calibrated_proxy_weighs_what_its_asset_does() {
    let (positions, triangles) = read_obj("character_hat.obj");
    let band = |x: &Vec3| (x.x.hypot(x.z + 6.0) - 10.0).abs() < 2.0 && (x.y - 168.6).abs() < 5.0;
    let held: Vec<u32> = (0..positions.len() as u32).filter(|v| band(&positions[*v as usize])).collect();
    let asset = asset(&positions, &triangles, &held, 117);
    let (fitted, found) = calibrated(&asset);
    assert!((asset.proxy.total_mass / asset.own.total_mass - found.mass).abs() < 1e-9);
    assert!(found.mass < 0.99, "{found:?}"); // a polygon in a round hat
    assert!((fitted.total_mass / asset.own.total_mass - 1.0).abs() < 1e-9); // sums of a thousand
    let sum: f64 = fitted.mass.iter().sum();
    assert_eq!(sum, fitted.total_mass);
    assert!(found.difference[1] < found.difference[0]);
    for [low, high] in [found.stretching, found.bending] {
        assert!((0.25..=1.0).contains(&low) && (1.0..=4.0).contains(&high), "{found:?}"); // the bounds
    }
}

/// Four times the vertices take the place of an asset that has no more than its proxy, as that says no better how stiff the sheet is. A remesh has 2 % more or less.
#[test]
fn an_asset_no_finer_than_its_proxy_is_compared_by_a_finer_one() {
    let leaf = leaf(1);
    let (positions, triangles) = (leaf.mesh.positions.clone(), leaf.mesh.triangles.clone());
    let held: Vec<u32> = (0..positions.len() as u32).filter(|v| leaf.held[*v as usize]).collect();
    let asset = asset(&positions, &triangles, &held, positions.len());
    let (_, found) = calibrated(&asset);
    let wanted = 4.0 * asset.made.positions.len() as f64;
    assert!((found.n_compared as f64 / wanted - 1.0).abs() < 0.12, "{found:?}");
    assert!(found.difference[1] < 0.2 * found.difference[0], "{found:?}");
}

#[test]
fn the_unit_of_length_does_not_matter() {
    // By a power of two the proxy has the same bits; only ratios of answers count, and roots and exponents of two round alike.
    let [one, other] = [1.0, 1024.0].map(|size| calibrated(&leaf_asset(size)).1);
    assert_eq!((one.n_patches, one.n_loads, one.n_compared), (other.n_patches, other.n_loads, other.n_compared));
    for (a, b) in [one.stretching, one.bending, one.difference]
        .as_flattened()
        .iter()
        .zip([other.stretching, other.bending, other.difference].as_flattened())
    {
        assert!((a / b - 1.0).abs() < 1e-6, "{one:?} {other:?}");
    }
}

#[test]
fn the_papers_energy_is_calibrated_too() {
    let asset = leaf_asset(1.0);
    let material = Material { k_area: 1e4, k_length: 1e4, k_bend: 0.1, area_density: 1.0 };
    let fixed = (0..asset.proxy.held.len() as u32).filter(|v| asset.proxy.held[*v as usize]).collect();
    let mesh = Mesh::new(asset.made.positions.clone(), &asset.made.triangles).unwrap();
    let proxy = Shell::new(mesh, material, &Supports { fixed, ..Default::default() }).unwrap();
    let (fitted, found) = calibrate(&proxy, &asset.made, &[], &mut |_| Ok(())).unwrap();
    assert!(found.difference[1] < 0.5 * found.difference[0], "{found:?}");
    let quantities: Vec<Quantity> = fitted.maps.all().iter().map(|map| map.quantity).collect();
    assert_eq!(quantities, [Quantity::KArea, Quantity::KLength, Quantity::KBend, Quantity::AreaDensity]);
}

/// Factors go on maps of vertices as on constants: E h, E h³ and ρ h of each triangle are multiplied, the cube's mean being that of a linear h.
#[test]
fn factors_multiply_stretching_bending_and_mass_apart() {
    let (positions, triangles) = (vec![Vec3::zeros(), Vec3::x(), Vec3::y()], [[0, 1, 2]]);
    let mesh = Mesh::new(positions, &triangles).unwrap();
    let map = Map { quantity: Quantity::Thickness, on: On::Vertices, values: vec![1.0, 2.0, 3.0] };
    let (maps, material) = Maps::new(vec![map], &mesh, SHEET.into()).unwrap();
    let factors = [Factors { stretching: 2.0, bending: 0.5, mass: 3.0 }];
    let (multiplied, _) = maps.times(&factors, &mesh, material).unwrap();
    let [young, h, density] = [Quantity::Young, Quantity::Thickness, Quantity::VolumeDensity]
        .map(|quantity| multiplied.of(quantity).unwrap().values[0]);
    // ∫h = 2, ∫h³ over a triangle of a linear h from 1 to 3: (6 + 6·14)/10.
    let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-14, "{a} {b}");
    near(young * h, 2.0 * SHEET.young * 2.0);
    near(young * h * h * h, 0.5 * SHEET.young * 9.0);
    near(density * h, 3.0 * SHEET.volume_density * 2.0);
}

fn refused<T>(kind: ErrorKind, words: &str, result: Result<T>) {
    let error = result.err().expect("an error");
    assert!(error.kind == kind && error.message.contains(words), "{error:?} lacks {words}");
}

#[test]
fn what_cannot_be_calibrated_is_named() {
    let asset = leaf_asset(1.0);
    let quiet = &mut |_| Ok(());
    refused(ErrorKind::InvalidArgument, "the proxy", calibrate(&asset.own, &asset.made, &[], quiet));
    refused(
        ErrorKind::InvalidArgument,
        "held[1] is vertex 5000",
        calibrate(&asset.proxy, &asset.made, &[0, 5000], quiet),
    );
    let mesh = || Mesh::new(asset.made.positions.clone(), &asset.made.triangles).unwrap();
    let loose = Shell::new(mesh(), SHEET, &Supports::default()).unwrap();
    refused(ErrorKind::Unsupported, "move freely", calibrate(&loose, &asset.made, &[], quiet));
    let all = Supports { fixed: (0..loose.mass.len() as u32).collect(), ..Default::default() };
    let stiff = Shell::new(mesh(), SHEET, &all).unwrap();
    refused(ErrorKind::InvalidArgument, "no vertex of the model moves", calibrate(&stiff, &asset.made, &[], quiet));
    let unheld = Proxy::new(
        &asset.own.mesh.positions,
        &asset.own.mesh.triangles,
        &Options { n_vertices: 300, weld: 0.0, sides: Sides::Find, cut: false, keep_pieces: false },
        quiet,
    )
    .unwrap();
    let model = shell(&unheld.positions, &unheld.triangles, vec![0, 1, 2], SHEET);
    refused(ErrorKind::Unsupported, "held", calibrate(&model, &unheld, &[], quiet));
}

#[test]
fn a_calibration_can_be_cancelled_at_every_word() {
    let asset = leaf_asset(1.0);
    let mut words = 0;
    calibrate(&asset.proxy, &asset.made, &[], &mut |_| {
        words += 1;
        Ok(())
    })
    .unwrap();
    assert!(words > 3);
    for stop in [0, 2, words - 1] {
        let mut heard = 0;
        let stopped = calibrate(&asset.proxy, &asset.made, &[], &mut |share| {
            assert!((0.0..=1.0).contains(&share));
            heard += 1;
            if heard > stop { Err(Error::new(ErrorKind::Cancelled, "enough")) } else { Ok(()) }
        });
        refused(ErrorKind::Cancelled, "enough", stopped);
    }
}
