//! Vertices held along axes: symmetry planes, diaphragms and rails, in every method.

use crate::common::*;
use crate::plates::*;
use nalgebra::UnitQuaternion;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::material::{ElasticSheet, Elasticity};
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reference::{EquilibriumOptions, Rayleigh, Solver, rigid_motions};
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::{FrameMotion, Pose};
use shellwarp::{ErrorKind, Material, Mesh, Shell, Supports, Vec3, reduced};
use std::sync::Arc;

const THIN: ElasticSheet = ElasticSheet { young: 1.0, poisson: 0.3, thickness: 1e-3, volume_density: 1.0 };
const CARD: Material = Material { k_area: 5e3, k_length: 5e3, k_bend: 2.7e-3, area_density: 0.3 };

/// What is held at a place.
type Hold = fn(&Vec3) -> Vec<Vec3>;

fn shell_of((positions, triangles): Sheet, material: impl Into<Elasticity>, hold: Hold) -> Shell {
    let along = positions.iter().enumerate().flat_map(|(v, x)| hold(x).into_iter().map(move |n| (v as u32, n)));
    let supports = Supports { along: along.collect(), ..Default::default() };
    Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &supports).unwrap()
}

/// The sheet and its mirror image at x = 0 as one; and where each vertex has its image.
fn mirrored((half, of_half): Sheet) -> (Sheet, Vec<u32>) {
    let (mut positions, mut triangles) = (half.clone(), of_half.clone());
    let mut image: Vec<u32> = (0..half.len() as u32).collect();
    for (v, x) in half.iter().enumerate().filter(|(_, x)| x.x > 1e-9) {
        image[v] = positions.len() as u32;
        positions.push(Vec3::new(-x.x, x.y, x.z));
        image.push(v as u32);
    }
    let there = |v: u32| image[v as usize];
    triangles.extend(of_half.iter().map(|[a, b, c]| [there(*a), there(*c), there(*b)]));
    ((positions, triangles), image)
}

fn in_plane(x: &Vec3) -> Vec<Vec3> {
    match x.y < 1e-9 {
        true => vec![Vec3::z(), Vec3::y()],
        false => vec![Vec3::z()],
    }
}

fn in_plane_and_symmetric(x: &Vec3) -> Vec<Vec3> {
    let mut held = in_plane(x);
    held.extend((x.x.abs() < 1e-9).then(Vec3::x));
    held
}

fn in_plane_and_centred(x: &Vec3) -> Vec<Vec3> {
    let mut held = in_plane(x);
    held.extend((x.norm() < 1e-9).then(Vec3::x));
    held
}

#[test]
fn half_a_sheet_on_its_symmetry_plane_has_the_even_frequencies_of_the_whole() {
    // The dense search, and that for large shells.
    for cells in [5, 12] {
        let half = rectangle(Family::Irregular, cells, 1.0, 0.7);
        let (whole, image) = mirrored(half.clone());
        let half = shell_of(half, THIN, in_plane_and_symmetric);
        let whole = shell_of(whole, THIN, in_plane);
        let [of_half, of_whole] = [modes_of(&half, 6), modes_of(&whole, 14)];
        assert_eq!((of_half.zero_modes, of_whole.zero_modes), (0, 1), "the whole slides along x");
        let certificate = of_half.certificate;
        assert_eq!(certificate.count, certificate.found);
        let odd = |shape: &Vec<Vec3>| -> f64 {
            let sum = |(v, x): (usize, &Vec3)| (x.x + shape[image[v] as usize].x).abs();
            shape.iter().enumerate().map(sum).fold(0.0, f64::max) / shape.iter().map(|x| x.amax()).fold(0.0, f64::max)
        };
        let even: Vec<f64> =
            (1..14).filter(|k| odd(&of_whole.shapes[*k]) < 1e-3).map(|k| of_whole.eigenvalues[k]).collect();
        assert!(even.len() >= 5, "{} even modes", even.len());
        for (found, exact) in of_half.eigenvalues.iter().zip(&even) {
            // The same matrix but for the order of its sums; the search ends at 1e-10.
            assert_close("eigenvalue", *found, *exact, 1e-8, 0.0);
        }
        for shape in &of_half.shapes {
            for roller in half.rollers.iter() {
                let x = shape[roller.vertex as usize];
                assert!(roller.directions().all(|n| n.dot(&x) == 0.0), "held at {}: {x:?}", roller.vertex);
            }
        }
    }
}

#[test]
fn half_a_sheet_hangs_as_the_whole() {
    let half = rectangle(Family::Irregular, 8, 1.0, 0.7);
    let n = half.0.len();
    let (whole, _) = mirrored(half.clone());
    let hanging = |shell: Shell| {
        let shell = Arc::new(shell);
        let load: Vec<Vec3> = shell.mass.iter().map(|m| *m * Vec3::new(0.0, -0.02, 3.0)).collect();
        let mut solver = Solver::new(shell.clone()).unwrap();
        let none = vec![Vec3::zeros(); load.len()];
        let options = EquilibriumOptions { tolerance: 1e-10, ..Default::default() };
        solver.equilibrium(&none, &load, &options, &mut |_| Ok(())).unwrap().displacement
    };
    let half = hanging(shell_of(half, THIN, in_plane_and_symmetric));
    let whole = hanging(shell_of(whole, THIN, in_plane_and_centred));
    assert!(whole.iter().map(|u| u.y.abs()).fold(0.0, f64::max) > 1e-3);
    // Both to 1e-10 of the load, through a stiffness whose condition is that of 16 cells, 1e3.
    assert!(error(&half, &whole[..n]) < 1e-6, "{:e}", error(&half, &whole[..n]));
    assert!(half.iter().all(|u| u.z == 0.0), "the load along what is held does nothing");
}

#[test]
fn a_plate_held_across_alone_has_the_frequencies_of_a_supported_one_and_slides() {
    for family in FAMILIES {
        let shell = shell_of(rectangle(family, 32, 1.0, 1.0), THIN, |x| {
            let at_edge = x.x.min(x.y).min(1.0 - x.x).min(1.0 - x.y) < 1e-9;
            if at_edge { vec![Vec3::z()] } else { vec![] }
        });
        let modes = modes_of(&shell, 7);
        assert_eq!((modes.zero_modes, rigid_motions(&shell)), (3, 3));
        let unit = (THIN.area_density() / THIN.stiffness()[1]).sqrt();
        let found = modes.eigenvalues[3..].iter().map(|lambda| lambda.sqrt() * unit);
        let off: Vec<f64> = found.zip(SUPPORTED).map(|(f, e)| 100.0 * (f / e - 1.0)).collect();
        println!("{family:?}: {off:.2?} %");
        // Second order in the cell, as with edges that are fixed in the plane, too: tests/energy/koiter.rs.
        assert!(off.iter().all(|off| off.abs() < 1.0), "{family:?}: {off:?}");
    }
}

/// The roof's deflection in the middle of its free edge, over that published.
fn scordelis_lo(cells: usize) -> f64 {
    let (flat, triangles) = rectangle(Family::Diagonal, cells, 1.0, 1.0);
    let half_angle = 40f64.to_radians();
    let bend = |x: &Vec3| {
        let angle = half_angle * (2.0 * x.x - 1.0);
        Vec3::new(25.0 * angle.sin(), 50.0 * x.y, 25.0 * angle.cos())
    };
    let positions: Vec<Vec3> = flat.iter().map(bend).collect();
    let mut along = vec![];
    for (v, x) in flat.iter().enumerate() {
        if x.y.min(1.0 - x.y) < 1e-9 {
            along.extend([(v as u32, Vec3::x()), (v as u32, Vec3::z())]); // a diaphragm
        }
        if (x.x - 0.5).abs() < 1e-9 && (x.y - 0.5).abs() < 1e-9 {
            along.push((v as u32, Vec3::y()));
        }
    }
    let sheet = ElasticSheet { young: 4.32e8, poisson: 0.0, thickness: 0.25, volume_density: 1.0 };
    let supports = Supports { along, ..Default::default() };
    let shell = Arc::new(Shell::new(Mesh::new(positions, &triangles).unwrap(), sheet, &supports).unwrap());
    assert_eq!(rigid_motions(&shell), 0);
    // A thousandth of the load: the answer is linear to a part of 1e-3.
    let small = 1e-3;
    let load: Vec<Vec3> = (0..shell.mass.len()).map(|v| -Vec3::z() * (90.0 * small * shell.area_of(v))).collect();
    let mut solver = Solver::new(shell.clone()).unwrap();
    let none = vec![Vec3::zeros(); load.len()];
    let found = solver.equilibrium(&none, &load, &Default::default(), &mut |_| Ok(())).unwrap();
    let middle = flat.iter().position(|x| x.x < 1e-9 && (x.y - 0.5).abs() < 1e-9).unwrap();
    -found.displacement[middle].z / small / 0.3024
}

#[test]
fn scordelis_and_los_roof_on_diaphragms_sags_as_published() {
    let found = [8, 16, 32].map(scordelis_lo);
    println!("8, 16, 32 cells a side: {found:.4?} of 0.3024");
    // Constant strains: 30, 14 and 4.5 % too stiff. The published value is that of most elements, 2 % below deep-shell theory's.
    assert!((found[2] - 1.0).abs() < 0.05, "{found:?}");
    assert!((found[2] - 1.0).abs() < (found[1] - 1.0).abs(), "{found:?}");
}

/// A strip of card fixed at one end, on a rail along its far corner and in a plane aslant at the other.
fn led_strip() -> (Arc<Shell>, u32, u32) {
    let (positions, triangles) = equilateral_sheet(12, 4, 0.025);
    let end = positions.iter().map(|x| x.x).fold(0.0, f64::max);
    let top = positions.iter().map(|x| x.y).fold(0.0, f64::max);
    let at = |x: f64, y: f64| positions.iter().position(|p| (p - Vec3::new(x, y, 0.0)).norm() < 1e-9).unwrap() as u32;
    let (rail, slide) = (at(end, 0.0), at(end, top));
    let fixed = (0..positions.len() as u32).filter(|v| positions[*v as usize].x < 0.02).collect();
    let along = vec![(rail, Vec3::y()), (rail, Vec3::x()), (slide, Vec3::new(3.0, 1.0, 2.0))];
    let supports = Supports { fixed, along, ..Default::default() };
    (Arc::new(Shell::new(Mesh::new(positions, &triangles).unwrap(), CARD, &supports).unwrap()), rail, slide)
}

fn led_model() -> (Arc<Model>, u32, u32) {
    let (shell, rail, slide) = led_strip();
    let reduced = reduced::Options { fields: 6, gravity: 10.0, ..Default::default() };
    let options = Options { modes: 8, precision: Precision::F64, reduced, ..Options::default() };
    (Arc::new(Model::precompute(shell, &options, &mut |_, _| Ok(())).unwrap()), rail, slide)
}

const METHODS: [Method; 7] = [
    Method::Warp,
    Method::VirtualWorkWarp,
    Method::LinearModalAnalysis,
    Method::ReducedShell,
    Method::PolynomialShell,
    Method::ImplicitShell,
    Method::ExplicitShell,
];

fn local(state: &State) -> Vec<Vec3> {
    let mut x = vec![Vec3::zeros(); state.model().shell.mass.len()];
    state.positions(Space::Frame, |v, p| x[v] = p);
    x
}

#[test]
fn what_is_held_stays_in_every_method_while_the_rest_moves() {
    let (model, rail, slide) = led_model();
    let rest = &model.shell.mesh.positions;
    let aslant = Vec3::new(3.0, 1.0, 2.0).normalize();
    for method in METHODS {
        let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
        state.set_gravity(Vec3::new(2.0, 3.0, -9.8)).unwrap();
        let turned = UnitQuaternion::from_scaled_axis(Vec3::new(0.1, 0.2, 0.0));
        let explicit = method == Method::ExplicitShell;
        let stable = 0.5 * Solver::new(model.shell.clone()).unwrap().stable_step(Rayleigh::default()).unwrap();
        let (steps, h) = if explicit { (400, stable) } else { (10, 1.0 / 60.0) };
        for k in 1..=steps {
            let share = f64::from(k) / f64::from(steps);
            let pose = Pose { origin: Vec3::zeros(), rotation: UnitQuaternion::identity().slerp(&turned, share) };
            state.set_frame(if explicit { Pose::identity() } else { pose }, FrameMotion::Continuous);
            state.step(h).unwrap();
        }
        let x = local(&state);
        let moved = x.iter().zip(rest).map(|(x, rest)| (x - rest).norm()).fold(0.0, f64::max);
        assert!(moved > 1e-7, "{method}: {moved:e}");
        let u = |v: u32| x[v as usize] - rest[v as usize];
        assert_eq!((u(rail).x, u(rail).y), (0.0, 0.0), "{method}");
        // Along no axis of the frame the projector rounds, and so does the pose.
        assert!(u(slide).dot(&aslant).abs() < 1e-14, "{method}: {:e}", u(slide).dot(&aslant));
        assert!(u(slide).norm() > 1e-12, "{method}: it slides");
    }
    let refused = State::new(model, Method::RotationStrain, Integrator::ImplicitEuler).err().unwrap();
    assert_eq!(refused.kind, ErrorKind::Unsupported);
    assert!(refused.message.contains("along some axes"), "{}", refused.message);
}

#[test]
fn methods_agree_with_the_full_shell_on_a_led_strip() {
    let (model, ..) = led_model();
    let at_rest = |method: Method| {
        let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
        state.set_gravity(Vec3::new(0.0, 0.0, -0.01)).unwrap();
        state.equilibrium().unwrap();
        let x = local(&state);
        (x.iter().zip(&model.shell.mesh.positions).map(|(x, r)| x - r).collect::<Vec<_>>(), state)
    };
    let (exact, full) = at_rest(Method::ImplicitShell);
    assert!(full.certify().unwrap().error < 1e-6, "{:e}", full.certify().unwrap().error);
    for (method, most) in [(Method::Warp, 0.05), (Method::LinearModalAnalysis, 0.05), (Method::ReducedShell, 0.05)] {
        let (u, state) = at_rest(method);
        let (off, told) = (mass_error(&model.shell, &u, &exact), state.certify().unwrap().error);
        println!("{method}: {off:.4}, certified {told:.4}");
        // Small loads: what eight modes leave of the answer.
        assert!(off < most && (told - off).abs() < 0.1 * off + 1e-3, "{method}: {off} {told}");
    }
}

#[test]
fn handles_lead_such_a_vertex_where_its_support_lets_it() {
    let (model, rail, slide) = led_model();
    let rest = &model.shell.mesh.positions;
    for method in [Method::Warp, Method::LinearModalAnalysis, Method::ImplicitShell, Method::ExplicitShell] {
        let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
        let stable = 0.5 * Solver::new(model.shell.clone()).unwrap().stable_step(Rayleigh::default()).unwrap();
        let h = if method == Method::ExplicitShell { stable } else { 1.0 / 60.0 };
        let goal = rest[rail as usize] + Vec3::new(1e-3, 1e-3, 1e-3);
        let target = Target::Position(goal);
        state.set_constraint(Constraint { id: 1, vertex: rail, axes: [true; 3], compliance: 0.0, target }).unwrap();
        (0..5).for_each(|_| state.step(h).unwrap());
        let x = local(&state)[rail as usize] - rest[rail as usize];
        assert_eq!((x.x, x.y), (0.0, 0.0), "{method}");
        assert_close(&format!("{method}"), x.z, 1e-3, 1e-6, 0.0);
        let residual = state.constraints().next().unwrap().1.residual;
        assert_close(&format!("{method}: what it misses"), residual, 2f64.sqrt() * 1e-3, 1e-6, 0.0);
        // Aslant, softly.
        state.clear_constraints();
        let target = Target::Position(rest[slide as usize] + Vec3::new(3.0, 1.0, 2.0) * 1e-3);
        state.set_constraint(Constraint { id: 2, vertex: slide, axes: [true; 3], compliance: 1e-4, target }).unwrap();
        (0..5).for_each(|_| state.step(h).unwrap());
        let x = local(&state)[slide as usize] - rest[slide as usize];
        assert!(x.dot(&Vec3::new(3.0, 1.0, 2.0)).abs() < 1e-13, "{method}: {x:?}");
    }
}

#[test]
fn a_saved_model_has_the_same_bits() {
    let (model, ..) = led_model();
    let bytes = model.save().unwrap();
    let loaded = Model::load(&bytes).unwrap();
    assert_eq!(loaded.shell.rollers, model.shell.rollers);
    assert_eq!((loaded.fingerprint, loaded.save().unwrap()), (model.fingerprint, bytes.clone()));
    // A projector that is none, a vertex that is fixed: refused by name.
    let at = bytes.windows(4).position(|tag| tag == b"ROLL").unwrap() + 16;
    for (place, bad) in [(at + 8, 7.0f64.to_le_bytes().to_vec()), (at, 0u32.to_le_bytes().to_vec())] {
        let mut broken = bytes.clone();
        broken[place..place + bad.len()].copy_from_slice(&bad);
        let error = Model::load(&sealed(broken)).err().unwrap();
        assert!(error.kind == ErrorKind::InvalidData && error.message.contains("along"), "{}", error.message);
    }
}

#[test]
fn directions_add_up_and_wrong_ones_are_named() {
    let (positions, triangles) = equilateral_sheet(3, 2, 0.1);
    let made = |along: Vec<(u32, Vec3)>| {
        let supports = Supports { fixed: vec![0], along, ..Default::default() };
        Shell::new(Mesh::new(positions.clone(), &triangles).unwrap(), CARD, &supports)
    };
    // Three make a fixed vertex; of a fixed one, and one that repeats, nothing is left to hold.
    let along = vec![
        (2, Vec3::x()),
        (2, Vec3::new(1.0, 1e-3, 0.0)),
        (2, Vec3::z()),
        (0, Vec3::x()),
        (3, Vec3::y()),
        (3, -Vec3::y()),
    ];
    let shell = made(along).unwrap();
    assert!(shell.held[2] && shell.rollers.len() == 1 && shell.rollers[0].held == 1);
    assert_eq!(shell.n_freedoms(), 3 * (positions.len() - 2) - 1);
    for (along, name) in [
        (vec![(1, Vec3::zeros())], "axes[0]"),
        (vec![(1, Vec3::x()), (99, Vec3::x())], "vertex 99"),
        (vec![(1, Vec3::new(f64::NAN, 0.0, 0.0))], "axes[0]"),
    ] {
        let error = made(along).err().unwrap();
        assert!(error.kind == ErrorKind::InvalidArgument && error.message.contains(name), "{}", error.message);
    }
}
