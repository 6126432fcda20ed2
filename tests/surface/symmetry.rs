//! Planes of symmetry: half, a quarter and an eighth of a shell bend as the whole.

use crate::common::*;
use crate::plates::*;
use nalgebra::Matrix3;
use rand::{Rng, SeedableRng, rngs::StdRng};
use shellwarp::energy::{Curvature, Energy, Stress};
use shellwarp::material::{ElasticSheet, Elasticity};
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reference::{EquilibriumOptions, Solver, rigid_motions};
use shellwarp::shell::Make;
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::{ErrorKind, Material, Mesh, Shell, Supports, Vec3, reduced};
use std::sync::Arc;

const THIN: ElasticSheet = ElasticSheet { young: 1.0, poisson: 0.3, thickness: 1e-3, volume_density: 1.0 };
const CARD: Material = Material { k_area: 5e3, k_length: 5e3, k_bend: 2.7e-3, area_density: 0.3 };

/// Which half-spaces of x, y and z a part of a shell is of.
type Planes = [bool; 3];
/// Directions that are held at a place.
type Hold = fn(&Vec3) -> Vec<Vec3>;

fn materials() -> [Elasticity; 2] {
    [THIN.into(), CARD.into()]
}

fn on(x: &Vec3, axis: usize) -> bool {
    x[axis].abs() < 1e-9
}

/// A part and its mirror images as one mesh, and which vertex of it each vertex is an image of.
fn whole((mut positions, mut triangles): Sheet, planes: Planes) -> (Sheet, Vec<u32>) {
    let mut of: Vec<u32> = (0..positions.len() as u32).collect();
    for axis in (0..3).filter(|axis| planes[*axis]) {
        let mut image: Vec<u32> = (0..positions.len() as u32).collect();
        for v in (0..positions.len()).filter(|v| !on(&positions[*v], axis)).collect::<Vec<_>>() {
            image[v] = positions.len() as u32;
            let mut x = positions[v];
            x[axis] = -x[axis];
            positions.push(x);
            of.push(of[v]);
        }
        let images: Vec<[u32; 3]> =
            triangles.iter().map(|[a, b, c]| [image[*a as usize], image[*c as usize], image[*b as usize]]).collect();
        triangles.extend(images);
    }
    ((positions, triangles), of)
}

fn part((positions, triangles): Sheet, material: Elasticity, planes: Planes, hold: Hold) -> Shell {
    let axes = |x: &Vec3| (0..3).filter(|axis| planes[*axis] && on(x, *axis)).collect::<Vec<_>>();
    let symmetric = positions.iter().enumerate().flat_map(|(v, x)| axes(x).into_iter().map(move |k| (v as u32, k)));
    let symmetric = symmetric.map(|(v, k)| (v, Vec3::ith(k, 1.0))).collect();
    let supports = Supports { along: held(&positions, hold), symmetric, ..Default::default() };
    Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &supports).unwrap()
}

fn held(positions: &[Vec3], hold: impl Fn(&Vec3) -> Vec<Vec3>) -> Vec<(u32, Vec3)> {
    positions.iter().enumerate().flat_map(|(v, x)| hold(x).into_iter().map(move |n| (v as u32, n))).collect()
}

fn all_of(sheet: Sheet, material: Elasticity, hold: impl Fn(&Vec3) -> Vec<Vec3>) -> Shell {
    let supports = Supports { along: held(&sheet.0, hold), ..Default::default() };
    Shell::new(Mesh::new(sheet.0, &sheet.1).unwrap(), material, &supports).unwrap()
}

/// Two rows at y = 0: a clamp of either energy, on the meshes below.
fn cantilevered(x: &Vec3) -> Vec<Vec3> {
    if x.y < 0.13 { vec![Vec3::x(), Vec3::y(), Vec3::z()] } else { vec![] }
}

#[test]
fn half_a_cantilevered_plate_has_the_even_frequencies_of_the_whole() {
    // The dense search, and that for large shells. Koiter's energy takes other diagonals than the mesh's where these are irregular, and not the
    // same ones in half of a mesh.
    for (family, cells, materials) in [
        (Family::Diagonal, 6, &materials()[..]),
        (Family::Diagonal, 14, &materials()[..]),
        (Family::Irregular, 8, &materials()[1..]),
    ] {
        for material in materials {
            let half = rectangle(family, cells, 0.5, 1.0);
            let (both, of) = whole(half.clone(), [true, false, false]);
            let half = part(half, *material, [true, false, false], cantilevered);
            let both = all_of(both, *material, cantilevered);
            let [of_half, of_both] = [modes_of(&half, 5), modes_of(&both, 14)];
            assert_eq!((of_half.zero_modes, of_both.zero_modes), (0, 0));
            assert_eq!(of_half.certificate.count, of_half.certificate.found);
            let even = |k: &usize| {
                let shape = &of_both.shapes[*k];
                let off = |(v, u): (usize, &Vec3)| {
                    let own = shape[of[v] as usize];
                    (Vec3::new(u.x.abs(), u.y, u.z) - Vec3::new(own.x.abs(), own.y, own.z)).amax()
                };
                let size = shape.iter().map(|u| u.amax()).fold(0.0, f64::max);
                shape.iter().enumerate().map(off).fold(0.0, f64::max) < 1e-3 * size
            };
            let even: Vec<f64> = (0..14).filter(even).map(|k| of_both.eigenvalues[k]).collect();
            println!("{family:?} {cells}: {} even ones of 14", even.len());
            assert!(even.len() >= 4, "{} even modes", even.len());
            for (found, exact) in of_half.eigenvalues.iter().zip(&even) {
                // The same matrix but for the order of its sums; the search ends at 1e-10.
                assert_close("eigenvalue", *found, *exact, 1e-8, 0.0);
            }
        }
    }
}

#[test]
fn without_the_slope_half_a_plate_is_another_shell() {
    let half = rectangle(Family::Diagonal, 6, 0.5, 1.0);
    let held = |x: &Vec3| {
        let mut held = cantilevered(x);
        held.extend(on(x, 0).then(Vec3::x));
        held
    };
    // The first twist is odd for the whole plate, and half of it does that alone. The paper's hinges resist twist more on such a mesh.
    for (material, least) in materials().into_iter().zip([1.5, 1.08]) {
        let with = modes_of(&part(half.clone(), material, [true, false, false], cantilevered), 2);
        let without = modes_of(&all_of(half.clone(), material, held), 2);
        assert!(
            with.eigenvalues[1] > least * without.eigenvalues[1],
            "{:?} {:?}",
            with.eigenvalues,
            without.eigenvalues
        );
    }
}

#[test]
fn a_free_half_moves_rigidly_as_a_free_whole_that_stays_symmetric() {
    for material in materials() {
        for (planes, left) in [([true, false, false], 3), ([true, true, false], 1)] {
            let shell = part(rectangle(Family::Diagonal, 6, 0.5, 1.0), material, planes, |_| vec![]);
            let modes = modes_of(&shell, 5);
            // Along the planes, and about the normal of a single one.
            assert_eq!((modes.zero_modes, rigid_motions(&shell)), (left, left));
        }
    }
}

/// Answers to a load of part and whole, the whole's at the vertices of the part.
fn answers(
    sheet: Sheet,
    material: Elasticity,
    planes: Planes,
    hold: Hold,
    load: impl Fn(&Vec3) -> Vec3,
) -> [Vec<Vec3>; 2] {
    let n = sheet.0.len();
    let (both, _) = whole(sheet.clone(), planes);
    let hanging = |shell: Shell| {
        let shell = Arc::new(shell);
        let load: Vec<Vec3> = shell.mass.iter().zip(&shell.mesh.positions).map(|(m, x)| *m * load(x)).collect();
        let mut solver = Solver::new(shell.clone()).unwrap();
        let none = vec![Vec3::zeros(); load.len()];
        let options = EquilibriumOptions { tolerance: 1e-10, ..Default::default() };
        solver.equilibrium(&none, &load, &options, &mut |_| Ok(())).unwrap().displacement
    };
    let of_part = hanging(part(sheet, material, planes, hold));
    // An even displacement keeps each plane in its place: so no rigid motion is left.
    let on_planes =
        |x: &Vec3| (0..3).filter(|c| planes[*c] && on(x, *c)).map(|c| Vec3::ith(c, 1.0)).collect::<Vec<_>>();
    let mut of_whole = hanging(all_of(both, material, |x| [hold(x), on_planes(x)].concat()));
    of_whole.truncate(n);
    [of_part, of_whole]
}

#[test]
fn half_a_cantilever_bends_far_as_the_whole() {
    for (material, pull) in [(Elasticity::from(THIN), 4e-7), (CARD.into(), 0.2)] {
        let sheet = rectangle(Family::Diagonal, 6, 0.5, 1.0);
        let load = |x: &Vec3| pull * Vec3::new(0.0, 0.0, 1.0 + x.x.abs());
        let [half, both] = answers(sheet, material, [true, false, false], cantilevered, load);
        let tip = half.iter().map(|u| u.norm()).fold(0.0, f64::max);
        println!("tip {tip}, apart {:e}", error(&half, &both));
        assert!(tip > 0.3, "{tip}");
        // The same equations but for the order of their sums: rounding, through a stiffness of the condition 1e6.
        assert!(error(&half, &both) < 1e-10, "{:e}", error(&half, &both));
    }
}

/// A quarter of Scordelis and Lo's roof, an eighth of a pinched cylinder and a quarter of a hemisphere with a hole. With what holds each, and
/// the load per mass by which it moves about as far as it is thick.
fn benchmarks() -> [(&'static str, Sheet, ElasticSheet, Planes, Hold, f64); 3] {
    let bent = |place: &dyn Fn(f64, f64) -> Vec3| {
        let (flat, triangles) = rectangle(Family::Diagonal, 7, 1.0, 1.0);
        let place = |x: &Vec3| {
            let mut there = place(x.x, x.y);
            // Exactly on the planes.
            (0..3).filter(|c| there[*c].abs() < 1e-9).collect::<Vec<_>>().into_iter().for_each(|c| there[c] = 0.0);
            there
        };
        (flat.iter().map(place).collect::<Vec<_>>(), triangles)
    };
    let on_arc = |radius: f64, angle: f64| (radius * angle.sin(), radius * angle.cos());
    let roof = bent(&|s, t| {
        let (x, z) = on_arc(25.0, 40f64.to_radians() * s);
        Vec3::new(x, 25.0 * t, z)
    });
    let cylinder = bent(&|s, t| {
        let (x, z) = on_arc(300.0, 90f64.to_radians() * s);
        Vec3::new(x, 300.0 * t, z)
    });
    let hemisphere = bent(&|s, t| {
        let (across, along) = on_arc(10.0, 90f64.to_radians() * s);
        let lift = 72f64.to_radians() * t;
        Vec3::new(across * lift.cos(), along * lift.cos(), 10.0 * lift.sin() + 1.0)
    });
    let diaphragm: Hold = |x| if x.y.abs() > 24.9 { vec![Vec3::x(), Vec3::z()] } else { vec![] };
    let end: Hold = |x| if x.y.abs() > 299.9 { vec![Vec3::x(), Vec3::z()] } else { vec![] };
    let foot: Hold = |x| if x.z < 1.0 + 1e-9 { vec![Vec3::z()] } else { vec![] };
    let sheet = |young, poisson, thickness| ElasticSheet { young, poisson, thickness, volume_density: 1.0 };
    [
        ("roof", roof, sheet(4.32e8, 0.0, 0.25), [true, true, false], diaphragm, 4e2),
        ("pinched cylinder", cylinder, sheet(3e6, 0.3, 3.0), [true, true, true], end, 2.0),
        ("hemisphere", hemisphere, sheet(6.825e7, 0.3, 0.04), [true, true, false], foot, 20.0),
    ]
}

#[test]
fn parts_of_published_shells_bend_as_the_whole() {
    for (name, sheet, of, planes, hold, pull) in benchmarks() {
        let paper = Material { k_area: 1e4, k_length: 1e4, k_bend: 1.0, area_density: 1.0 };
        for material in [Elasticity::from(of), paper.into()] {
            // Symmetric about all planes, and rising to one side.
            let pull = if matches!(material, Elasticity::Koiter(_)) { pull } else { 1e-3 };
            let load = |x: &Vec3| {
                let across = Vec3::new(x.x, -0.5 * x.y, if planes[2] { -x.z } else { -1.0 });
                pull * across / x.norm()
            };
            let [one, all] = answers(sheet.clone(), material, planes, hold, load);
            println!("{name}: {:e}, apart {:e}", one.iter().map(|u| u.norm()).fold(0.0, f64::max), error(&one, &all));
            // As above.
            assert!(error(&one, &all) < 1e-10, "{name}: {:e}", error(&one, &all));
        }
    }
}

/// A part of a bowl at two planes, and of a material of each kind, in a shape that is off rest everywhere.
fn bent_parts() -> Vec<(Shell, Vec<Vec3>)> {
    let (flat, triangles) = rectangle(Family::Irregular, 4, 1.0, 1.0);
    let bowl: Vec<Vec3> =
        flat.iter().map(|x| Vec3::new(x.x, x.y, 0.4 * x.x * x.x + 0.3 * (x.y + 0.2 * x.x).powi(2))).collect();
    let mut random = StdRng::seed_from_u64(3);
    let mut moved = |x: &Vec3| x + 0.02 * Vec3::from_fn(|_, _| random.random_range(-1.0..1.0));
    let shape: Vec<Vec3> = bowl.iter().map(&mut moved).collect();
    let shells =
        materials().map(|material| part((bowl.clone(), triangles.clone()), material, [true, true, false], |_| vec![]));
    shells.into_iter().map(|shell| (shell, shape.clone())).collect()
}

fn gradient(energy: &dyn Energy, x: &[Vec3]) -> Vec<Vec3> {
    let mut gradient = vec![Vec3::zeros(); x.len()];
    energy.add_gradient(x, &mut gradient);
    gradient
}

fn dot(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

/// What is handed the blocks of one element after the other.
type Visitor<'a> = dyn FnMut((&[u32], &[Matrix3<f64>])) + 'a;

/// Hessian times d.
fn along(visit: &dyn Fn(&mut Visitor), d: &[Vec3]) -> Vec<Vec3> {
    let mut out = vec![Vec3::zeros(); d.len()];
    visit(&mut |(vertices, blocks)| {
        for (ij, block) in blocks.iter().enumerate() {
            let (i, j) = (vertices[ij / vertices.len()], vertices[ij % vertices.len()]);
            out[i as usize] += block * d[j as usize];
        }
    });
    out
}

#[test]
fn derivatives_at_planes_of_symmetry_match_differences() {
    for (shell, x) in bent_parts() {
        let energy = &*shell.energy;
        let mut random = StdRng::seed_from_u64(5);
        for _ in 0..5 {
            let d: Vec<Vec3> = x.iter().map(|_| Vec3::from_fn(|_, _| random.random_range(-1.0..1.0))).collect();
            let at = |h: f64| x.iter().zip(&d).map(|(x, d)| x + h * d).collect::<Vec<_>>();
            let h = 1e-5;
            let slope = (energy.value(&at(h)) - energy.value(&at(-h))) / (2.0 * h);
            let own = gradient(energy, &x);
            // Central differences on edges of 0.25: truncation (h/0.25)² = 2e-9 times higher derivatives, rounding 1e-16/h.
            assert_close("gradient", slope, dot(&own, &d), 1e-6, dot(&own, &own).sqrt());
            let exact = along(&|visit| energy.visit_hessian(&x, Curvature::Exact, visit), &d);
            let [ahead, behind] = [h, -h].map(|h| gradient(energy, &at(h)));
            let differences: Vec<Vec3> = ahead.iter().zip(&behind).map(|(a, b)| (a - b) / (2.0 * h)).collect();
            assert!(error(&differences, &exact) < 1e-6, "{:e}", error(&differences, &exact));
            // ½ Σ ε², Σ ε ∇ε, and the mixed Hessian by the shell's own stresses.
            let (mut half_squares, mut sum, mut stress) = (0.0, vec![Vec3::zeros(); x.len()], vec![]);
            energy.visit_strains(&x, &mut |(vertices, row), strain| {
                half_squares += 0.5 * strain * strain;
                vertices.iter().zip(row).for_each(|(v, b)| sum[*v as usize] += strain * b);
                stress.push(strain);
            });
            assert_eq!(stress.len(), energy.n_elements());
            assert_close("strains", half_squares, energy.value(&x), 1e-12, 0.0);
            assert!(error(&sum, &own) < 1e-12);
            let mixed = along(&|visit| energy.visit_mixed_hessian(&x, Stress::whole(&stress), visit), &d);
            assert!(error(&mixed, &exact) < 1e-12, "{:e}", error(&mixed, &exact));
        }
    }
}

#[test]
fn samples_of_all_elements_at_their_own_weight_are_the_energy() {
    for (shell, x) in bent_parts() {
        let energy = &*shell.energy;
        let last_first = |v: u32| x.len() as u32 - 1 - v;
        let index: Vec<u32> = (0..x.len() as u32).map(last_first).collect();
        let there: Vec<Vec3> = x.iter().rev().copied().collect();
        let mut random = StdRng::seed_from_u64(7);
        let weights: Vec<f64> = (0..energy.n_elements()).map(|_| f64::from(random.random_range(0..3u8))).collect();
        let (mut expected, mut element) = (0.0, 0);
        energy.visit_strains(&x, &mut |_, strain| {
            expected += 0.5 * weights[element] * strain * strain;
            element += 1;
        });
        let sampled = energy.sampled(&weights, &index);
        assert_close("samples", sampled.value(&there), expected, 1e-12, 0.0);
    }
}

#[test]
fn the_energy_at_rest_is_nothing_and_its_rows_are_those_of_the_shape() {
    for (shell, _) in bent_parts() {
        let (rest, energy) = (&shell.mesh.positions, &*shell.energy);
        let (mut rows, mut at_rest) = (vec![], vec![]);
        energy.visit_rows(rest, &mut |(vertices, row)| rows.push((vertices.to_vec(), row.to_vec())));
        energy.visit_rest_rows(&mut |(vertices, row)| at_rest.push((vertices.to_vec(), row.to_vec())));
        assert_eq!(rows.len(), at_rest.len());
        for (one, other) in rows.iter().zip(&at_rest) {
            assert_eq!(one.0, other.0);
            let size = one.1.iter().map(|b| b.norm()).fold(0.0, f64::max);
            assert!(one.1.iter().zip(&other.1).all(|(a, b)| (a - b).norm() < 1e-12 * size));
        }
        // Rounding of the angles and lengths, squared.
        assert!(energy.value(rest) < 1e-24, "{:e}", energy.value(rest));
    }
}

fn half_model() -> Arc<Model> {
    let (flat, triangles) = rectangle(Family::Diagonal, 4, 0.1, 0.2);
    let supports = Supports {
        clamped: (0..flat.len() as u32).filter(|v| flat[*v as usize].y < 1e-9).collect(),
        symmetric: (0..flat.len() as u32).filter(|v| on(&flat[*v as usize], 0)).map(|v| (v, Vec3::x())).collect(),
        ..Default::default()
    };
    let shell = Shell::new(Mesh::new(flat, &triangles).unwrap(), CARD, &supports).unwrap();
    let reduced = reduced::Options { fields: 8, gravity: 10.0, ..Default::default() };
    let options = Options { modes: 8, precision: Precision::F64, reduced, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
}

#[test]
fn every_method_bends_half_a_shell_as_the_full_shell_does() {
    let model = half_model();
    let rest = &model.shell.mesh.positions;
    let at_rest = |method: Method| {
        let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
        state.set_gravity(Vec3::new(0.0, 0.0, -10.0)).unwrap();
        state.equilibrium().unwrap();
        let mut u = vec![Vec3::zeros(); rest.len()];
        state.positions(Space::Frame, |v, p| u[v] = p - rest[v]);
        (u, state)
    };
    let (exact, full) = at_rest(Method::ImplicitShell);
    let tip = exact.iter().map(|u| u.norm()).fold(0.0, f64::max);
    assert!(full.certify().unwrap().error < 1e-6 && tip > 0.02, "{tip}");
    // Of the displacement, at a sixth of the length and more: what each is known for.
    for (method, most) in [(Method::Warp, 0.1), (Method::ReducedShell, 0.03), (Method::PolynomialShell, 0.03)] {
        let (u, state) = at_rest(method);
        let (off, told) = (mass_error(&model.shell, &u, &exact), state.certify().unwrap().error);
        println!("{method}: tip {tip:.4}, {off:.4}, certified {told:.4}");
        assert!(off < most && (told - off).abs() < 0.1 * off + 1e-3, "{method}: {off} {told}");
        for (x, u) in rest.iter().zip(&u).filter(|(x, _)| on(x, 0)) {
            assert_eq!(u.x, 0.0, "{method} at {x:?}");
        }
    }
}

#[test]
fn a_saved_half_has_the_same_bits_and_broken_planes_are_refused() {
    let model = half_model();
    let bytes = model.save().unwrap();
    let loaded = Model::load(&bytes).unwrap();
    assert_eq!(loaded.shell.mirrors, model.shell.mirrors);
    assert_eq!((loaded.fingerprint, loaded.save().unwrap()), (model.fingerprint, bytes.clone()));
    let at = bytes.windows(4).position(|tag| tag == b"SYMM").unwrap() + 16;
    // Another vertex, a normal that is none, a plane elsewhere.
    for (place, bad) in [
        (at, 7u32.to_le_bytes().to_vec()),
        (at + 8, 7.0f64.to_le_bytes().to_vec()),
        (at + 32, 0.05f64.to_le_bytes().to_vec()),
        (at + 32, f64::NAN.to_le_bytes().to_vec()),
    ] {
        let mut broken = bytes.clone();
        broken[place..place + bad.len()].copy_from_slice(&bad);
        let error = Model::load(&sealed(broken)).err().unwrap();
        assert!(error.kind == ErrorKind::InvalidData && error.message.contains("symmetry"), "{}", error.message);
    }
}

#[test]
fn planes_that_do_not_fit_are_named_by_their_vertex() {
    let (positions, triangles) = rectangle(Family::Diagonal, 4, 0.4, 0.4);
    let made = |positions: &[Vec3], symmetric: Vec<(u32, Vec3)>, rest_shape: Option<Vec<Vec3>>| {
        let supports = Supports { symmetric, ..Default::default() };
        let make = Make { rest_shape, ..Make::of(CARD) };
        Shell::made(Mesh::new(positions.to_vec(), &triangles).unwrap(), make, &supports)
    };
    let plane: Vec<(u32, Vec3)> = (0..5).map(|j| (5 * j, Vec3::x())).collect();
    assert_eq!(made(&positions, plane.clone(), None).unwrap().mirrors.len(), 4);
    let with = |v: u32, n: Vec3| plane.iter().copied().chain([(v, n)]).collect::<Vec<_>>();
    let mut off = positions.clone();
    off[10].x += 0.01;
    let mut leaning = positions.clone();
    leaning.iter_mut().for_each(|x| x.x += 0.1 * x.y);
    for (positions, symmetric, rest, text) in [
        (&positions, with(99, Vec3::x()), None, "vertex 99"),
        (&positions, with(3, Vec3::zeros()), None, "vertex 3 has the normal"),
        (
            &positions,
            with(6, Vec3::x()),
            None,
            "vertex 6 is to be on a plane of symmetry, but it is not on the mesh's boundary",
        ),
        (&positions, with(3, Vec3::x()), None, "no boundary edge leads from it"),
        (&off, plane.clone(), None, "vertex 10 is off the plane"),
        (&positions, (0..5).map(|j| (5 * j, Vec3::z())).collect(), None, "lies in the plane"),
        (&positions, plane.clone(), Some(leaning), "the rest shape"),
    ] {
        let error = made(positions, symmetric, rest).err().unwrap_or_else(|| panic!("taken: {text}"));
        assert!(error.kind == ErrorKind::InvalidArgument && error.message.contains(text), "{text}: {}", error.message);
    }
}

#[test]
fn stiffness_of_half_is_that_of_the_whole_for_even_displacements() {
    for material in materials() {
        let (sheet, planes) = (rectangle(Family::Diagonal, 3, 1.0, 1.0), [true, true, false]);
        let (both, of) = whole(sheet.clone(), planes);
        let one = part(sheet, material, planes, |_| vec![]);
        let all = all_of(both, material, |_| vec![]);
        let mut random = StdRng::seed_from_u64(9);
        let mut u: Vec<Vec3> = one.mass.iter().map(|_| Vec3::from_fn(|_, _| random.random_range(-1.0..1.0))).collect();
        one.project(&mut u);
        let sign = |v: usize, c: usize| if all.mesh.positions[v][c] < 0.0 { -1.0 } else { 1.0 };
        let even: Vec<Vec3> = (0..of.len()).map(|v| Vec3::from_fn(|c, _| sign(v, c) * u[of[v] as usize][c])).collect();
        let energy = |shell: &Shell, u: &[Vec3]| shellwarp::energy::rest_quadratic_form(&*shell.energy, u);
        assert_close("energy", 4.0 * energy(&one, &u), energy(&all, &even), 1e-12, 0.0);
    }
}
