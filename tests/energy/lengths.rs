//! Lengths without stress: against rest shapes and closed forms, a rim that ruffles, derivatives, all methods, saved models, bad input.

use crate::common::*;
use crate::plates::*;
use crate::saved::{assert_damage_is_refused, assert_moves_by_the_same_bits};
use rand::{Rng, SeedableRng, rngs::StdRng};
use shellwarp::energy::{Curvature, dihedral_angle};
use shellwarp::material::{Crease, ElasticSheet, Elasticity, Fibres, Map, On, Quantity, RestLength};
use shellwarp::mesh::Mesh;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reference::settled;
use shellwarp::shell::Make;
use shellwarp::state::{Method, State};
use shellwarp::step::Integrator;
use shellwarp::{Material, Shell, Supports, Vec3};
use std::f64::consts::PI;
use std::sync::Arc;

const SHEET: ElasticSheet = ElasticSheet { young: 1e6, poisson: 0.3, thickness: 0.01, volume_density: 20.0 };
const PAPER: Material = Material { k_area: 4000.0, k_length: 300.0, k_bend: 0.015, area_density: 0.2 };

fn materials() -> [Elasticity; 2] {
    [SHEET.into(), PAPER.into()]
}

fn mesh_of(sheet: &Sheet) -> Mesh {
    Mesh::new(sheet.0.clone(), &sheet.1).unwrap()
}

fn held(sheet: &Sheet, at: impl Fn(&Vec3) -> bool) -> Supports {
    let fixed = (0..sheet.0.len() as u32).filter(|v| at(&sheet.0[*v as usize])).collect();
    Supports { fixed, ..Supports::default() }
}

/// Clamped along x = 0.
fn clamped(sheet: &Sheet) -> Supports {
    let Supports { fixed, .. } = held(sheet, |x| x.x < 1e-9);
    Supports { clamped: fixed, ..Supports::default() }
}

fn made(sheet: &Sheet, make: Make, supports: &Supports) -> Shell {
    Shell::made(mesh_of(sheet), make, supports).unwrap()
}

fn settle(shell: Shell) -> Arc<Shell> {
    settled(&Arc::new(shell), &mut |_| Ok(())).unwrap()
}

fn growth(values: Vec<f64>) -> Map {
    Map { quantity: Quantity::Growth, on: On::Vertices, values }
}

/// All lengths of a mesh in another shape.
fn lengths(mesh: &Mesh, x: &[Vec3]) -> Vec<RestLength> {
    let of = |vertices: [u32; 2]| {
        let [a, b] = vertices.map(|v| x[v as usize]);
        RestLength { vertices, length: (b - a).norm() }
    };
    mesh.edges.iter().map(|e| of(e.vertices)).collect()
}

/// All angles of a mesh in another shape.
fn angles(mesh: &Mesh, x: &[Vec3]) -> Vec<Crease> {
    let of = |e: &shellwarp::mesh::Edge| {
        let [[a, b], [c, d]] = [e.vertices, e.opposite];
        let angle = Some(dihedral_angle(&[a, b, c, d].map(|v| x[v as usize])));
        Crease { vertices: e.vertices, factor: 1.0, angle, yield_angle: f64::INFINITY }
    };
    mesh.edges.iter().filter(|e| e.is_interior()).map(of).collect()
}

fn furthest(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

fn gradient(shell: &Shell, x: &[Vec3]) -> Vec<Vec3> {
    let mut gradient = vec![Vec3::zeros(); x.len()];
    shell.energy.add_gradient(x, &mut gradient);
    gradient
}

fn hessian_times(shell: &Shell, x: &[Vec3], d: &[Vec3]) -> Vec<Vec3> {
    let mut product = vec![Vec3::zeros(); x.len()];
    shell.energy.visit_hessian(x, Curvature::Exact, &mut |(vertices, blocks)| {
        for (i, v) in vertices.iter().enumerate() {
            for (j, w) in vertices.iter().enumerate() {
                product[*v as usize] += blocks[i * vertices.len() + j] * d[*w as usize];
            }
        }
    });
    product
}

fn inner(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

fn random_field(random: &mut StdRng, n: usize) -> Vec<Vec3> {
    (0..n).map(|_| Vec3::from_fn(|_, _| random.random_range(-1.0..1.0))).collect()
}

/// A sheet that is bent and waves.
fn bumpy(family: Family) -> Sheet {
    let (mut positions, triangles) = rectangle(family, 6, 1.0, 0.6);
    positions.iter_mut().for_each(|x| x.z = 0.1 * (3.0 * x.x + x.y).sin());
    (positions, triangles)
}

/// Growth that no shape in the plane has.
fn uneven(sheet: &Sheet) -> Map {
    growth(sheet.0.iter().map(|x| 1.0 + 0.2 * (4.0 * x.x).sin() * (5.0 * x.y).cos()).collect())
}

#[test]
fn lengths_that_change_nothing_leave_every_bit() {
    for (family, material) in FAMILIES.iter().flat_map(|family| materials().map(|material| (*family, material))) {
        let sheet = bumpy(family);
        let plain = made(&sheet, Make::of(material), &clamped(&sheet));
        let ones = Make { maps: vec![growth(vec![1.0; sheet.0.len()])], ..Make::of(material) };
        let own = Make { rest_lengths: lengths(&plain.mesh, &sheet.0), ..Make::of(material) };
        let x: Vec<Vec3> = sheet.0.iter().map(|x| x + 0.1 * Vec3::new(x.y, x.z, x.x * x.x)).collect();
        for make in [ones, own] {
            let same = made(&sheet, make, &clamped(&sheet));
            assert!(same.metric.is_none() && !same.must_settle() && same.maps.is_empty() && same.mass == plain.mass);
            assert!(plain.energy.value(&x) == same.energy.value(&x) && plain.energy.value(&x) > 0.0);
            assert!(gradient(&plain, &x) == gradient(&same, &x));
        }
    }
}

/// The same energy, forces and masses whether a shape is told by its positions or by its lengths.
#[test]
fn lengths_and_angles_of_a_shape_make_the_shell_of_its_positions() {
    for (family, material) in FAMILIES.iter().flat_map(|family| materials().map(|material| (*family, material))) {
        let flat = rectangle(family, 6, 1.0, 0.6);
        let stretched: Vec<Vec3> =
            flat.0.iter().map(|x| Vec3::new(1.2 * x.x + 0.1 * x.y, 0.9 * x.y - 0.05 * x.x * x.y, 0.0)).collect();
        let curled: Vec<Vec3> = flat.0.iter().map(|x| Vec3::new(x.x.sin(), 1.1 * x.y, 1.0 - x.x.cos())).collect();
        let mesh = mesh_of(&flat);
        let fibres = match material {
            Elasticity::Koiter(_) => {
                Some(Fibres { across: 0.3, shear: 0.0, directions: vec![Vec3::new(1.0, 0.4, 0.0)] })
            }
            Elasticity::DiscreteShells(_) => None,
        };
        for (shape, fibres) in [(&stretched, None), (&curled, None), (&stretched, fibres)] {
            // Edges of which an angle is told are not flipped, so that both shells bend on the same triangles.
            let creases = angles(&mesh, shape);
            let by_shape = Make {
                rest_shape: Some(shape.clone()),
                creases: creases.clone(),
                fibres: fibres.clone(),
                ..Make::of(material)
            };
            let by_lengths = Make { rest_lengths: lengths(&mesh, shape), creases, fibres, ..Make::of(material) };
            let [by_shape, by_lengths] = [by_shape, by_lengths].map(|make| made(&flat, make, &clamped(&flat)));
            // Lengths and heights by square roots of sums: a few roundings of each, more where terms cancel.
            let x: Vec<Vec3> = flat.0.iter().map(|x| x + 0.1 * Vec3::new(x.y, x.x * x.y, x.x * x.x)).collect();
            assert_close("energy", by_lengths.energy.value(&x), by_shape.energy.value(&x), 1e-12, 0.0);
            let [a, b] = [&by_shape, &by_lengths].map(|shell| gradient(shell, &x));
            assert!(furthest(&a, &b) < 1e-11 * a.iter().map(|g| g.norm()).fold(0.0, f64::max), "{family:?}");
            for (m, n) in by_shape.mass.iter().zip(&by_lengths.mass) {
                assert_close("mass", *n, *m, 1e-13, 0.0);
            }
        }
        // Without angles flips are the same where both shapes are flat.
        let by_shape = Make { rest_shape: Some(stretched.clone()), ..Make::of(material) };
        let by_lengths = Make { rest_lengths: lengths(&mesh, &stretched), ..Make::of(material) };
        let [by_shape, by_lengths] = [by_shape, by_lengths].map(|make| made(&flat, make, &clamped(&flat)));
        let x: Vec<Vec3> = stretched.iter().map(|x| Vec3::new(x.x, x.y, 0.2 * x.x * x.x)).collect();
        if family != Family::Irregular {
            assert_close("bending", by_lengths.energy.value(&x), by_shape.energy.value(&x), 1e-12, 0.0);
        }
        let [a, b] = [by_shape, by_lengths].map(settle);
        // Both are solved to 1e-8 of the forces that they begin with; limp ways of moving give by more.
        let off = furthest(&a.mesh.positions, &b.mesh.positions);
        println!("{family:?}: equilibria apart by {off:.1e}");
        assert!(off < 1e-5, "{off}");
    }
}

#[test]
fn energies_with_lengths_have_the_derivatives_that_they_say() {
    let mut random = StdRng::seed_from_u64(8);
    for (family, material) in FAMILIES.iter().flat_map(|family| materials().map(|material| (*family, material))) {
        let sheet = bumpy(family);
        let mesh = mesh_of(&sheet);
        let every_fifth = mesh.edges.iter().filter(|e| e.is_interior()).step_by(5).enumerate();
        let crease = |(k, e): (usize, &shellwarp::mesh::Edge)| Crease {
            vertices: e.vertices,
            factor: [0.2, 1.0, 5.0][k % 3],
            angle: (k % 2 == 0).then_some(0.3),
            yield_angle: if k % 4 == 3 { 0.05 } else { f64::INFINITY },
        };
        let (creases, maps) = (every_fifth.map(crease).collect(), vec![uneven(&sheet)]);
        let shell = made(&sheet, Make { creases, maps, ..Make::of(material) }, &clamped(&sheet));
        assert!(shell.metric.is_some());
        let n = sheet.0.len();
        let x: Vec<Vec3> = sheet.0.iter().zip(random_field(&mut random, n)).map(|(x, d)| x + 0.02 * d).collect();
        let d = random_field(&mut random, n);
        let step = |h: f64| x.iter().zip(&d).map(|(x, d)| x + h * d).collect::<Vec<_>>();
        // Central differences of h err by h² and by rounding over h: about 1e-9 of the largest derivative at 1e-5.
        let h = 1e-5;
        let slope = (shell.energy.value(&step(h)) - shell.energy.value(&step(-h))) / (2.0 * h);
        assert_close("slope", inner(&gradient(&shell, &x), &d), slope, 1e-6, 0.0);
        let [more, less] = [h, -h].map(|h| gradient(&shell, &step(h)));
        let numeric: Vec<Vec3> = more.iter().zip(&less).map(|(a, b)| (a - b) / (2.0 * h)).collect();
        let exact = hessian_times(&shell, &x, &d);
        let off: Vec<Vec3> = exact.iter().zip(&numeric).map(|(a, b)| a - b).collect();
        assert!(inner(&off, &off) < 1e-12 * inner(&exact, &exact), "{family:?} {material:?}");
    }
}

/// All lengths by 1.01: a strip that nothing holds is larger by 1 % and has no stress; also one that is bent without stress.
#[test]
fn a_free_strip_that_is_heated_grows_without_stress() {
    for (family, material) in FAMILIES.iter().flat_map(|family| materials().map(|material| (*family, material))) {
        for sheet in [rectangle(family, 10, 1.0, 0.2), bumpy(family)] {
            let grown = growth(vec![1.01; sheet.0.len()]);
            let strip = made(&sheet, Make { maps: vec![grown], ..Make::of(material) }, &Supports::default());
            let cold = strip.energy.value(&sheet.0);
            let strip = settle(strip);
            let left = strip.energy.value(&strip.mesh.positions);
            let hot: Vec<Vec3> = sheet.0.iter().map(|x| 1.01 * x).collect();
            for edge in &strip.mesh.edges {
                let [a, b] = edge.vertices.map(|v| v as usize);
                let now = (strip.mesh.positions[b] - strip.mesh.positions[a]).norm();
                // Solved to 1e-8 of the forces that 1 % makes: 1e-10 of the length, times what the mesh makes worse of it.
                assert_close("length", now, (hot[b] - hot[a]).norm(), 1e-7, 0.0);
            }
            assert!(left < 1e-10 * cold, "{family:?}: {left:e} of {cold:e}");
            assert_close(
                "area",
                strip.total_area / made(&sheet, Make::of(material), &Supports::default()).total_area,
                1.01f64.powi(2),
                1e-13,
                0.0,
            );
        }
    }
}

/// Held at both ends it cannot grow: what pulls there is E ε in plane stress, here with the sides free, of Green's strain.
#[test]
fn a_bar_between_walls_that_is_heated_presses_by_its_modulus_times_the_growth() {
    let (epsilon, width) = (1e-4, 0.2);
    for family in FAMILIES {
        let bar = rectangle(family, 10, 1.0, width);
        let ends = held(&bar, |x| (x.x - 0.5).abs() > 0.5 - 1e-9);
        // Along x alone, so that the ends may widen as the bar does: no corners with stress of their own.
        let along = ends.fixed.iter().map(|v| (*v, Vec3::x()));
        let plane = (0..bar.0.len() as u32).map(|v| (v, Vec3::z()));
        let supports = Supports { along: plane.chain(along).collect(), ..Supports::default() };
        let maps = vec![growth(vec![1.0 + epsilon; bar.0.len()])];
        let bar_made = settle(made(&bar, Make { maps, ..Make::of(SHEET) }, &supports));
        let pulls = gradient(&bar_made, &bar_made.mesh.positions);
        let wall: f64 = ends.fixed.iter().map(|v| *v as usize).filter(|v| bar.0[*v].x > 0.5).map(|v| pulls[v].x).sum();
        // Stretched by 1/(1 + ε) of its length without stress: Green's strain ½ (λ² − 1), and the force E h w λ times it.
        let stretch = 1.0 / (1.0 + epsilon);
        let green = 0.5 * (stretch * stretch - 1.0);
        let force = SHEET.young * SHEET.thickness * width * (1.0 + epsilon) * stretch * green;
        println!("{family:?}: {wall:.6e} against {force:.6e}");
        // Exact for a uniform strain on any mesh.
        assert_close("force of the wall", wall, force, 1e-6, 0.0);
        // To first order it is E h w ε.
        assert_close("first order", -wall, SHEET.young * SHEET.thickness * width * epsilon, 2.0 * epsilon, 0.0);
    }
}

/// A disk of rings, without a hole.
fn disk(rings: usize, around: usize) -> Sheet {
    let mut positions = vec![Vec3::zeros()];
    let mut triangles = vec![];
    for ring in 1..=rings {
        for k in 0..around {
            let (r, phi) =
                (ring as f64 / rings as f64, 2.0 * PI * (k as f64 + 0.5 * (ring % 2) as f64) / around as f64);
            positions.push(Vec3::new(r * phi.cos(), r * phi.sin(), 0.0));
        }
    }
    let at = |ring: usize, k: usize| (1 + (ring - 1) * around + k % around) as u32;
    for k in 0..around {
        triangles.push([0, at(1, k), at(1, k + 1)]);
        for ring in 1..rings {
            let shift = ring % 2;
            triangles.push([at(ring, k), at(ring + 1, k + shift), at(ring, k + 1)]);
            triangles.push([at(ring, k + 1), at(ring + 1, k + shift), at(ring + 1, k + 1 + shift)]);
        }
    }
    (positions, triangles)
}

/// Longer at the rim than 2π times its distance from the middle, a disk cannot be flat: it ruffles, by itself.
#[test]
fn a_disk_whose_rim_grew_ruffles_with_less_energy_than_flat() {
    let thin = ElasticSheet { thickness: 0.002, ..SHEET };
    let soft = Material { k_bend: 1e-4, ..PAPER };
    for material in [Elasticity::from(thin), soft.into()] {
        let disk = disk(8, 36);
        let rim = disk.0.iter().map(|x| 1.0 + 0.25 * x.norm().powi(4)).collect();
        let n = disk.0.len();
        let make = || Make { maps: vec![growth(Vec::clone(&rim))], ..Make::of(material) };
        let middle = held(&disk, |x| x.norm() < 0.2);
        let plane = Supports { along: (0..n as u32).map(|v| (v, Vec3::z())).collect(), ..middle.clone() };
        let flat = settle(made(&disk, make(), &plane));
        let ruffled = settle(made(&disk, make(), &middle));
        let [flat_energy, energy] = [&flat, &ruffled].map(|shell| shell.energy.value(&shell.mesh.positions));
        let heights: Vec<f64> = ruffled.mesh.positions[n - 36..].iter().map(|x| x.z).collect();
        let most = heights.iter().fold(0.0f64, |most, z| most.max(z.abs()));
        let turns = (0..36).filter(|k| heights[*k] * heights[(k + 1) % 36] < 0.0).count();
        println!(
            "{energy:.3e} against {flat_energy:.3e} flat; the rim leaves its plane by {most:.3}, through it {turns} times"
        );
        assert!(energy < 0.5 * flat_energy && most > 0.05 && turns >= 4, "{energy} {flat_energy} {most} {turns}");
        // It is stable: no mode of a held shell has an eigenvalue below zero.
        assert!(modes_of(&ruffled, 4).eigenvalues[0] > 0.0);
    }
}

fn model(shell: Shell) -> Arc<Model> {
    let options = Options { modes: 8, precision: Precision::F64, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
}

/// Of each energy, uneven and held at one side.
fn grown() -> Vec<Shell> {
    let of = |material| {
        let sheet = bumpy(Family::UnionJack);
        let small = growth(uneven(&sheet).values.iter().map(|x| 1.0 + 0.2 * (x - 1.0)).collect());
        made(&sheet, Make { maps: vec![small], ..Make::of(material) }, &clamped(&sheet))
    };
    materials().into_iter().map(of).collect()
}

#[test]
fn every_method_moves_about_where_a_grown_shell_rests() {
    for shell in grown() {
        let model = model(shell);
        let start = model.shell.mesh.positions.clone();
        assert!(model.shell.is_stressed() && furthest(&start, model.shell.given()) > 1e-3);
        let at_rest = |method: Method, gravity: f64| {
            let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
            state.set_gravity(Vec3::new(0.0, 0.0, gravity)).unwrap();
            state.equilibrium().unwrap();
            let mut x = vec![Vec3::zeros(); start.len()];
            state.positions(shellwarp::state::Space::Frame, |v, p| x[v] = p);
            (x, state.certify().unwrap().error)
        };
        for method in [Method::LinearModalAnalysis, Method::Warp, Method::RotationStrain, Method::ImplicitShell] {
            // Without load nothing moves from there; balanced to 1e-8 of what settled it.
            let off = furthest(&at_rest(method, 0.0).0, &start);
            assert!(off < 1e-6, "{method:?}: {off}");
        }
        let moved = |x: &[Vec3]| x.iter().zip(&start).map(|(a, b)| a - b).collect::<Vec<_>>();
        let exact = moved(&at_rest(Method::ImplicitShell, -0.05).0);
        for method in [Method::Warp, Method::RotationStrain] {
            let (x, certified) = at_rest(method, -0.05);
            let off = error(&moved(&x), &exact);
            println!("{method:?}: error {off:.4}, certified {certified:.4}");
            assert!(off < 0.3, "{method:?}: {off}"); // eight modes
            assert!((certified / off - 1.0).abs() < 0.5 || off < 1e-3, "{method:?}: {certified} of {off}");
        }
    }
}

#[test]
fn a_saved_model_has_its_lengths_and_moves_by_the_same_bits() {
    for shell in grown() {
        let model = model(shell);
        let bytes = model.save().unwrap();
        assert!(bytes.windows(4).any(|tag| tag == b"LENG"));
        let loaded = Arc::new(Model::load(&bytes).unwrap());
        assert!(loaded.save().unwrap() == bytes && loaded.shell.metric == model.shell.metric);
        assert!(loaded.shell.mesh.positions == model.shell.mesh.positions && loaded.shell.mass == model.shell.mass);
        assert_moves_by_the_same_bits([&model, &loaded], &[Method::Warp, Method::ImplicitShell]);
        assert_damage_is_refused(&bytes);
    }
}

#[test]
fn bad_lengths_are_refused_by_name_and_number() {
    let sheet = rectangle(Family::Diagonal, 4, 1.0, 1.0);
    let refused = |make: Make, words: &[&str]| {
        let error = Shell::made(mesh_of(&sheet), make, &Supports::default()).err().unwrap();
        assert!(words.iter().all(|word| error.message.contains(word)), "{error}");
    };
    for material in materials() {
        let with = |rest_lengths: Vec<RestLength>| Make { rest_lengths, ..Make::of(material) };
        let good = RestLength { vertices: [6, 7], length: 0.25 };
        let bad =
            |vertices: [u32; 2], words: &[&str]| refused(with(vec![good, RestLength { vertices, ..good }]), words);
        bad([6, 25], &["rest length 1", "6-25", "does not have"]);
        bad([u32::MAX, 6], &["rest length 1", "4294967295-6"]);
        bad([6, 6], &["rest length 1", "6-6", "does not have"]);
        bad([0, 24], &["rest length 1", "0-24", "does not have"]);
        bad([7, 6], &["rest lengths 0 and 1", "same edge 7-6"]);
        for length in [0.0, -0.25, f64::NAN, f64::INFINITY] {
            let words = ["rest length 0", "6-7", &format!("{length:?}"), "must be positive"];
            refused(with(vec![RestLength { length, ..good }]), &words);
        }
        // Sides of 1/4 and their diagonal: longer than 0.6036, 1/4 of 1 + √2, and no triangle closes.
        for length in [0.7, 0.6036] {
            refused(
                with(vec![RestLength { length, ..good }]),
                &["triangle ", &format!("{length:e}"), "7-6", "shorter"],
            );
        }
        let map = |values: Vec<f64>| Make { maps: vec![growth(values)], ..Make::of(material) };
        refused(map(vec![1.1; 24]), &["map of growth has 24 values", "25 vertices"]);
        for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let mut values = vec![1.1; 25];
            values[3] = value;
            refused(map(values), &["value 3 of the map of growth", &format!("{value:?}"), "must be positive"]);
        }
        // Three times as long at one vertex its edges are twice as long, and still close with the third; not at a hundred times.
        let mut steep = vec![1.0; 25];
        steep[12] = 3.0;
        assert!(Shell::made(mesh_of(&sheet), map(steep.clone()), &Supports::default()).is_ok());
        steep[12] = 100.0;
        refused(map(steep), &["triangle ", "-12", "without stress"]);
        let twice = Make { maps: vec![growth(vec![1.1; 25]), growth(vec![1.1; 25])], ..Make::of(material) };
        refused(twice, &["two maps of growth"]);
    }
}
