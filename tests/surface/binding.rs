//! Points that follow a shell.

use crate::common::{equilateral_sheet, leaf};
use nalgebra::Rotation3;
use shellwarp::binding::{Binding, Points};
use shellwarp::material::{ElasticSheet, Elasticity};
use shellwarp::model::Options;
use shellwarp::reduced;
use shellwarp::state::{Method, Shown, Space, State};
use shellwarp::step::Integrator;
use shellwarp::{Material, Mesh, Model, Shell, Supports, Vec3};
use std::sync::Arc;

fn shell(positions: Vec<Vec3>, triangles: &[[u32; 3]]) -> Shell {
    let material = Material { k_area: 1e4, k_length: 1e4, k_bend: 0.1, area_density: 1.0 };
    let fixed = (0..positions.len() as u32).filter(|v| positions[*v as usize].x < 0.06).collect();
    Shell::new(Mesh::new(positions, triangles).unwrap(), material, &Supports { fixed, ..Default::default() }).unwrap()
}

/// Numbers from 0 to 1 that look like chance.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::from_fn(|_, _| 2.0 * self.next() - 1.0)
    }
}

/// A flat sheet with moved vertices: 15 by 9 edges of 0.1.
fn rough_sheet() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let (mut positions, triangles) = equilateral_sheet(15, 9, 0.1);
    let mut chance = Chance(3);
    for x in &mut positions {
        let inside = x.x > 0.01 && x.x < 1.49 && x.y > 0.01 && x.y < 0.77;
        if inside {
            *x += 0.02 * Vec3::new(chance.next() - 0.5, chance.next() - 0.5, 0.0);
        }
    }
    (positions, triangles)
}

/// Points of the rough sheet's plane, not at its very rim, lifted by up to `height`.
fn points_on_sheet(n: usize, height: f64) -> Vec<Vec3> {
    let mut chance = Chance(7);
    let mut point =
        || Vec3::new(0.02 + 1.46 * chance.next(), 0.02 + 0.74 * chance.next(), height * (2.0 * chance.next() - 1.0));
    (0..n).map(|_| point()).collect()
}

fn bind(shell: &Shell, positions: &[Vec3]) -> Binding {
    Binding::new(shell, &Points { positions, ..Points::default() }).unwrap()
}

fn followed(binding: &Binding, deformed: Vec<Vec3>) -> Vec<Vec3> {
    let mut out = vec![Vec3::zeros(); binding.n_points()];
    binding.pose(deformed, None).unwrap().positions(0..binding.n_points(), |i, x| out[i] = x);
    out
}

#[test]
fn points_rest_to_the_last_bit_and_vertices_go_where_they_go() {
    let shell = leaf(1);
    let mesh = &shell.mesh;
    let mut chance = Chance(1);
    let off: Vec<Vec3> = mesh.positions.iter().map(|x| x + 0.05 * chance.vector()).collect();
    assert_eq!(followed(&bind(&shell, &off), mesh.positions.clone()), off);

    let moved: Vec<Vec3> = mesh.positions.iter().map(|x| x + 0.1 * chance.vector()).collect();
    let at = followed(&bind(&shell, &mesh.positions), moved.clone());
    let worst = at.iter().zip(&moved).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(worst < 1e-7, "{worst:e}: a vertex's own row is its displacement in 32 bits");
}

#[test]
fn a_rigid_motion_carries_points_rigidly() {
    let shell = leaf(1);
    let mut chance = Chance(5);
    let points: Vec<Vec3> = shell.mesh.positions.iter().map(|x| x + 0.1 * chance.vector()).collect();
    let normals: Vec<Vec3> = points.iter().map(|_| chance.vector()).collect();
    let given = Points { positions: &points, normals: Some(&normals), ..Points::default() };
    let binding = Binding::new(&shell, &given).unwrap();
    let (turn, shift) = (Rotation3::from_euler_angles(2.0, -1.0, 0.5), Vec3::new(1.0, -2.0, 3.0));
    let deformed: Vec<Vec3> = shell.mesh.positions.iter().map(|x| turn * x + shift).collect();
    let pose = binding.pose(deformed, None).unwrap();
    let mut worst = [0f64; 2];
    pose.positions(0..points.len(), |i, x| worst[0] = worst[0].max((x - turn * points[i] - shift).norm()));
    pose.normals(0..points.len(), |i, n| worst[1] = worst[1].max((n - turn * normals[i].normalize()).norm()));
    println!("rigid motion: positions {:.1e}, normals {:.1e}", worst[0], worst[1]);
    assert!(worst[0] < 5e-6 && worst[1] < 5e-5, "32 bits, and factors of some ten for directions: {worst:?}");
}

#[test]
fn quadratic_motions_of_a_flat_sheet_are_met_exactly() {
    let (positions, triangles) = rough_sheet();
    let shell = shell(positions, &triangles);
    let map = |x: &Vec3| {
        let z = 0.2 * x.x * x.x - 0.1 * x.x * x.y + 0.3 * x.y * x.y;
        Vec3::new(x.x + 0.1 * x.y * x.y, x.y - 0.05 * x.x * x.x, z)
    };
    let points = points_on_sheet(500, 0.0);
    let normals = vec![Vec3::z(); points.len()];
    let binding =
        Binding::new(&shell, &Points { positions: &points, normals: Some(&normals), ..Points::default() }).unwrap();
    let pose = binding.pose(shell.mesh.positions.iter().map(map).collect(), None).unwrap();
    let mut worst = [0f64; 2];
    pose.positions(0..500, |i, x| worst[0] = worst[0].max((x - map(&points[i])).norm()));
    pose.normals(0..500, |i, n| {
        let p = points[i];
        let along_x = Vec3::new(1.0, -0.1 * p.x, 0.4 * p.x - 0.1 * p.y);
        let along_y = Vec3::new(0.2 * p.y, 1.0, -0.1 * p.x + 0.6 * p.y);
        worst[1] = worst[1].max((n - along_x.cross(&along_y).normalize()).norm());
    });
    println!("quadratic motion: positions {:.1e}, normals {:.1e}", worst[0], worst[1]);
    // The ridge of 1e-6 on second derivatives and 32 bits.
    assert!(worst[0] < 2e-6 && worst[1] < 2e-5, "{worst:?}");
}

/// Rolls the sheet onto a cylinder of this radius; a point at height z goes to radius + z.
fn rolled(x: &Vec3, radius: f64) -> Vec3 {
    let (angle, r) = (x.x / radius, radius - x.z);
    Vec3::new(r * angle.sin(), x.y, radius - r * angle.cos())
}

#[test]
fn a_rolled_sheet_carries_points_on_it_and_off_it_to_third_order() {
    let error = |fine: usize, height: f64| {
        let (positions, triangles) = equilateral_sheet(15 * fine, 9 * fine, 0.1 / fine as f64);
        let shell = shell(positions, &triangles);
        let points = points_on_sheet(2000, height);
        let at = followed(&bind(&shell, &points), shell.mesh.positions.iter().map(|x| rolled(x, 0.5)).collect());
        at.iter().zip(&points).map(|(x, p)| (x - rolled(p, 0.5)).norm()).fold(0.0, f64::max)
    };
    println!("rolled sheet, worst error: edges | on it | up to 0.1 off it");
    let rows: Vec<[f64; 2]> = [1, 2, 4].map(|fine| [error(fine, 0.0), error(fine, 0.1)]).to_vec();
    for (row, fine) in rows.iter().zip([1, 2, 4]) {
        println!("{:6.3} {:.2e} {:.2e}", 0.1 / f64::from(fine), row[0], row[1]);
    }
    // Flat triangles would be off by edge² / (8 radius): 2.5e-3 at 0.1. On it: an order of three, at the rim two rings reach one side only.
    assert!(rows[0][0] < 5e-4 && rows[1][0] < rows[0][0] / 5.0 && rows[2][0] < rows[1][0] / 5.0, "{rows:?}");
    // Off it the turn is interpolated linearly: an order of two.
    assert!(rows[1][1] < rows[0][1] / 3.0 && rows[2][1] < rows[1][1] / 3.0, "{rows:?}");
}

#[test]
fn normals_and_positions_are_continuous_across_the_triangles() {
    let (positions, triangles) = equilateral_sheet(15, 9, 0.1);
    let shell = shell(positions, &triangles);
    // Along a line that crosses many sides, on the sheet and above it.
    let n = 20_001;
    for height in [0.0, 0.05] {
        let line: Vec<Vec3> = (0..n)
            .map(|i| Vec3::new(0.1 + 1.3 * i as f64 / (n - 1) as f64, 0.123 + 0.4 * i as f64 / (n - 1) as f64, height))
            .collect();
        let normals = vec![Vec3::z(); n];
        let binding =
            Binding::new(&shell, &Points { positions: &line, normals: Some(&normals), ..Points::default() }).unwrap();
        let bent = |x: &Vec3| rolled(&Vec3::new(x.x, x.y, 0.0), 0.3) + 0.1 * (5.0 * x.y).sin() * Vec3::y();
        let pose = binding.pose(shell.mesh.positions.iter().map(bent).collect(), None).unwrap();
        let (mut x, mut normal) = (vec![Vec3::zeros(); n], vec![Vec3::zeros(); n]);
        pose.positions(0..n, |i, p| x[i] = p);
        pose.normals(0..n, |i, d| normal[i] = d);
        let jump = |v: &[Vec3]| v.windows(2).map(|w| (w[1] - w[0]).norm()).fold(0.0, f64::max);
        let mean = |v: &[Vec3]| v.windows(2).map(|w| (w[1] - w[0]).norm()).sum::<f64>() / (n - 1) as f64;
        println!(
            "height {height}: positions step {:.2e} (mean {:.2e}), normals {:.2e} (mean {:.2e}); flat triangles: normals 0.29",
            jump(&x),
            mean(&x),
            jump(&normal),
            mean(&normal)
        );
        assert!(jump(&x) < 2.0 * mean(&x), "a step of the line is as long as its neighbours");
        // A triangle turns against the next by up to 0.1 · 0.866 / 0.3 = 0.29 rad. On the sheet normals have no jump; off it they have one
        // of the height times what the curvature changes from triangle to triangle.
        let limit = if height == 0.0 { 2.0 * mean(&normal) } else { 0.29 / 5.0 };
        assert!(jump(&normal) < limit, "{}", jump(&normal));
    }
}

#[test]
fn a_point_ten_thicknesses_off_stays_rigid_with_the_shell() {
    let shell = leaf(1);
    let mesh = &shell.mesh;
    let thickness = 0.01 * mesh.size;
    let up = mesh.normals(&mesh.positions);
    let points: Vec<Vec3> = mesh.positions.iter().zip(&up).flat_map(|(x, n)| [*x, x + 10.0 * thickness * n]).collect();
    let binding = bind(&shell, &points);
    let bent: Vec<Vec3> = mesh.positions.iter().map(|x| rolled(&Vec3::new(x.x, x.y, -x.z), 0.6)).collect();
    let at = followed(&binding, bent);
    let worst = at.chunks(2).map(|two| ((two[1] - two[0]).norm() / (10.0 * thickness) - 1.0).abs()).fold(0.0, f64::max);
    println!("ten thicknesses off: distance off by {:.1} %", 100.0 * worst);
    assert!(worst < 0.05, "{worst}");
}

fn model(shell: Shell, reduced: usize) -> Arc<Model> {
    let reduced = reduced::Options { fields: reduced, ..Default::default() };
    let options = Options { reduced, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
}

#[test]
fn velocities_and_tangents_are_derivatives_of_positions() {
    let model = model(leaf(1), 0);
    let h = 1e-4;
    let mesh = &model.shell.mesh;
    let up = mesh.normals(&mesh.positions);
    let tangent = |n: &Vec3| n.cross(&Vec3::ith(n.iamin(), 1.0)).normalize();
    // A vertex's corner, the same a little along its tangent; off the rim, where the ground has an end.
    let places: Vec<(Vec3, Vec3)> = mesh
        .triangles
        .iter()
        .map(|t| t.map(|v| (mesh.positions[v as usize], up[v as usize])))
        .map(|[a, b, c]| (0.5 * a.0 + 0.3 * b.0 + 0.2 * c.0 + 0.01 * a.1, (a.1 + b.1 + c.1).normalize()))
        .collect();
    let points: Vec<Vec3> = places.iter().flat_map(|(x, n)| [x - h * tangent(n), x + h * tangent(n)]).collect();
    let tangents: Vec<Vec3> = places.iter().flat_map(|(_, n)| [tangent(n); 2]).collect();
    let binding =
        Binding::new(&model.shell, &Points { positions: &points, tangents: Some(&tangents), ..Points::default() })
            .unwrap();
    let mut state = State::new(model.clone(), Method::Warp, Integrator::Exact).unwrap();
    state.set_gravity(Vec3::new(0.0, 3.0, -9.81)).unwrap();
    for _ in 0..20 {
        state.step(1.0 / 60.0).unwrap();
    }
    let read = |state: &State| {
        let n = binding.n_points();
        let pose = state.bound(&binding, Shown::default(), true).unwrap();
        let mut out = [(); 3].map(|()| vec![Vec3::zeros(); n]);
        pose.positions(0..n, |i, x| out[0][i] = x);
        pose.velocities(0..n, |i, _, v| out[1][i] = v);
        pose.tangents(0..n, |i, x| out[2][i] = x);
        out
    };
    let now = read(&state);
    let worst = now[0]
        .chunks(2)
        .zip(now[2].chunks(2))
        .map(|(x, t)| (((x[1] - x[0]).normalize()) - t[0]).norm())
        .fold(0.0, f64::max);
    assert!(worst < 5e-3, "tangents against differences of 32-bit displacements over {h}: {worst}");
    let (q, q_dot) = state.amplitudes().map(|(q, p)| (q.to_vec(), p.to_vec())).unwrap();
    let shifted = |s: f64| {
        let mut other = state.try_clone().unwrap();
        let moved: Vec<f64> = q.iter().zip(&q_dot).map(|(q, p)| q + s * p).collect();
        other.set_amplitudes(&moved, &q_dot).unwrap();
        read(&other)[0].clone()
    };
    let dt = 1e-3;
    let (before, after) = (shifted(-dt), shifted(dt));
    let fastest = now[1].iter().map(|v| v.norm()).fold(0.0, f64::max);
    let off = (0..points.len()).map(|i| ((after[i] - before[i]) / (2.0 * dt) - now[1][i]).norm()).fold(0.0, f64::max);
    println!("velocities up to {fastest:.2}, off by {off:.1e} from differences over {dt} s");
    assert!(fastest > 0.1 && off < 2e-3 * fastest, "{off} of {fastest}");
}

/// The leaf's mesh as a sheet of this thickness.
fn leaf_sheet(fine: usize, thickness: f64) -> Shell {
    let held = leaf(fine);
    let sheet = ElasticSheet { young: 1e7, poisson: 0.3, thickness, volume_density: 1000.0 };
    let fixed = (0..held.held.len() as u32).filter(|v| held.held[*v as usize]).collect();
    let mesh = Mesh::new(held.mesh.positions.clone(), &held.mesh.triangles).unwrap();
    Shell::new(mesh, Elasticity::Koiter(sheet), &Supports { fixed, ..Default::default() }).unwrap()
}

#[test]
fn a_coarse_shell_moves_fine_points_as_a_fine_shell_does() {
    let thickness = 0.02;
    let (coarse, fine) = (leaf_sheet(1, thickness), leaf_sheet(3, thickness));
    let render = fine.mesh.positions.clone();
    let n = coarse.mesh.positions.len();
    println!(
        "leaf, {} points on {n} vertices, displacement at equilibrium against that of the fine shell:",
        render.len()
    );
    let binding = bind(&coarse, &render);
    let same = |x: &Vec3| render.iter().position(|y| (x - y).norm() < 1e-9).unwrap();
    let shared: Vec<usize> = coarse.mesh.positions.iter().map(same).collect();
    let (coarse, fine) = (model(coarse, 0), model(fine, 0));
    for method in [Method::Warp, Method::ImplicitShell] {
        let settled = |model: &Arc<Model>| {
            let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
            state.set_gravity(Vec3::new(0.0, 0.0, -9.81)).unwrap();
            state.equilibrium().unwrap();
            state
        };
        let exact = crate::common::displacements(&settled(&fine));
        let state = settled(&coarse);
        let mut u = vec![Vec3::zeros(); render.len()];
        state.bound(&binding, Shown::default(), false).unwrap().positions(0..render.len(), |i, x| u[i] = x - render[i]);
        let error = crate::common::error(&u, &exact);
        let vertices: Vec<Vec3> = shared.iter().map(|i| exact[*i]).collect();
        let own = crate::common::error(&crate::common::displacements(&state), &vertices);
        let furthest = exact.iter().map(|u| u.norm()).fold(0.0, f64::max);
        println!(
            "{method:?}: up to {furthest:.3}, off by {:.2} %, the coarse vertices by {:.2} %",
            100.0 * error,
            100.0 * own
        );
        assert!(error < 0.02, "{method:?}: {error}");
        assert!(error < own + 0.003, "{method:?}: following adds no error of its own: {error}, {own}");
    }
}

#[test]
fn what_cannot_be_bound_is_named() {
    let shell = leaf(1);
    let good = shell.mesh.positions.clone();
    let refused = |points: &Points| match Binding::new(&shell, points) {
        Ok(_) => panic!("this was bound"),
        Err(error) => error.message,
    };
    let with = |i: usize, x: Vec3| {
        let mut points = good.clone();
        points[i] = x;
        points
    };
    assert!(refused(&Points::default()).contains("0 points"));
    for bad in [f64::NAN, f64::INFINITY] {
        let message = refused(&Points { positions: &with(7, Vec3::new(bad, 0.0, 0.0)), ..Points::default() });
        assert!(message.contains("points[7]"), "{message}");
    }
    for far in [1e9, 1e200, f64::MAX] {
        let message = refused(&Points { positions: &with(5, Vec3::new(0.0, far, 0.0)), ..Points::default() });
        assert!(message.contains("points[5]") && message.contains("from the mesh"), "{message}");
    }
    let near =
        Points { positions: &with(3, good[3] + Vec3::new(0.0, 0.0, 1.0)), max_distance: 0.5, ..Points::default() };
    assert!(refused(&near).contains("points[3]"), "{}", refused(&near));
    let normals = vec![Vec3::z(); 4];
    let few = Points { positions: &good, normals: Some(&normals), ..Points::default() };
    assert!(refused(&few).contains("4 normals"));
    let mut normals = vec![Vec3::z(); good.len()];
    normals[2] = Vec3::zeros();
    assert!(refused(&Points { positions: &good, normals: Some(&normals), ..Points::default() }).contains("normals[2]"));
    normals[2] = Vec3::z();
    let along = Points { positions: &good, normals: Some(&normals), tangents: Some(&normals), ..Points::default() };
    assert!(refused(&along).contains("tangents[0]"));
}

#[test]
fn saved_bindings_give_the_same_bits_and_damaged_ones_are_refused() {
    let shell = leaf(1);
    let mut chance = Chance(9);
    let points: Vec<Vec3> = shell.mesh.positions.iter().map(|x| x + 0.02 * chance.vector()).collect();
    let normals: Vec<Vec3> = points.iter().map(|_| chance.vector()).collect();
    let binding =
        Binding::new(&shell, &Points { positions: &points, normals: Some(&normals), ..Points::default() }).unwrap();
    let bytes = binding.save().unwrap();
    let loaded = Binding::load(&shell, &bytes).unwrap();
    assert_eq!(loaded.save().unwrap(), bytes);
    let deformed: Vec<Vec3> = shell.mesh.positions.iter().map(|x| rolled(x, 0.7)).collect();
    assert_eq!(followed(&loaded, deformed.clone()), followed(&binding, deformed));
    assert_eq!(loaded.furthest(), binding.furthest());
    assert!(Binding::load(&leaf(2), &bytes).is_err_and(|e| e.message.contains("another mesh")));
    for length in [0, 3, 20, 44, bytes.len() - 1] {
        assert!(Binding::load(&shell, &bytes[..length]).is_err());
    }
    for _ in 0..2000 {
        let mut bad = bytes.clone();
        let at = (chance.next() * bad.len() as f64) as usize;
        bad[at] ^= 1 << (chance.next() * 8.0) as u32;
        assert!(Binding::load(&shell, &bad).is_err(), "a flipped bit at {at}");
    }
    // With a right checksum, whatever the numbers are: refused, or finite.
    for _ in 0..2000 {
        let mut bad = bytes[..bytes.len() - 8].to_vec();
        for _ in 0..3 {
            let at = (chance.next() * bad.len() as f64) as usize;
            bad[at] = (chance.next() * 256.0) as u8;
        }
        let sum = xxhash_rust::xxh3::xxh3_64(&bad).to_le_bytes();
        bad.extend(sum);
        if let Ok(loaded) = Binding::load(&shell, &bad) {
            let pose = loaded.pose(shell.mesh.positions.iter().map(|x| rolled(x, 0.7)).collect(), None).unwrap();
            assert!(pose.reach().is_finite());
            pose.positions(0..loaded.n_points(), |i, x| assert!(x.iter().all(|c| c.is_finite()), "point {i}"));
            pose.normals(0..loaded.n_points(), |i, x| assert!(x.iter().all(|c| c.is_finite()), "normal {i}"));
        }
    }
}

#[test]
fn every_method_carries_points_and_a_sagged_shell_does_from_the_given_shape() {
    let shell = leaf(1);
    let points: Vec<Vec3> = shell.mesh.positions.iter().map(|x| x + Vec3::new(0.0, 0.0, 0.02)).collect();
    let binding = bind(&shell, &points);
    let model = model(shell, 20);
    for method in [
        Method::Warp,
        Method::VirtualWorkWarp,
        Method::LinearModalAnalysis,
        Method::RotationStrain,
        Method::ReducedShell,
        Method::PolynomialShell,
        Method::ImplicitShell,
    ] {
        let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
        state.set_gravity(Vec3::new(0.0, 0.0, -1.0)).unwrap();
        (0..5).for_each(|_| state.step(1.0 / 60.0).unwrap());
        let mut x = vec![];
        state.positions(Space::Frame, |_, p| x.push(p));
        let at = followed(&binding, x);
        let mut read = vec![];
        state.bound(&binding, Shown::default(), false).unwrap().positions(0..points.len(), |_, p| read.push(p));
        assert_eq!(at, read, "{method:?}");
        assert!(at.iter().zip(&points).any(|(a, b)| (a - b).norm() > 1e-3), "{method:?}");
    }
}
