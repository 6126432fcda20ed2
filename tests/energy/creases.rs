//! Creases and rest shapes: derivatives, a hinged strip and a folded card against closed forms, curled strips, all methods, saved models, bad input.

use crate::common::*;
use crate::plates::*;
use crate::saved::{assert_damage_is_refused, assert_moves_by_the_same_bits};
use rand::{Rng, SeedableRng, rngs::StdRng};
use shellwarp::energy::{Curvature, dihedral_angle};
use shellwarp::material::{Crease, ElasticSheet, Elasticity};
use shellwarp::mesh::Mesh;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reference::{EquilibriumOptions, Solver, settled};
use shellwarp::shell::Make;
use shellwarp::state::{Method, State};
use shellwarp::step::Integrator;
use shellwarp::{Material, Shell, Supports, Vec3};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

const SHEET: ElasticSheet = ElasticSheet { young: 1e6, poisson: 0.3, thickness: 0.01, volume_density: 20.0 };
const PAPER: Material = Material { k_area: 4000.0, k_length: 300.0, k_bend: 0.015, area_density: 0.2 };

fn materials() -> [Elasticity; 2] {
    [SHEET.into(), PAPER.into()]
}

fn clamped(positions: &[Vec3]) -> Supports {
    Supports {
        fixed: vec![],
        clamped: (0..positions.len() as u32).filter(|v| positions[*v as usize].x < 1e-9).collect(),
        ..Supports::default()
    }
}

/// Clamped along x = 0.
fn shell(sheet: &Sheet, make: Make) -> Shell {
    Shell::made(Mesh::new(sheet.0.clone(), &sheet.1).unwrap(), make, &clamped(&sheet.0)).unwrap()
}

/// The edges of a mesh whose ends both lie at `x` along the sheet.
fn line(sheet: &Sheet, x: f64) -> Vec<[u32; 2]> {
    let mesh = Mesh::new(sheet.0.clone(), &sheet.1).unwrap();
    let on = |v: &u32| (sheet.0[*v as usize].x - x).abs() < 1e-9;
    mesh.edges.iter().map(|e| e.vertices).filter(|ends| ends.iter().all(on)).collect()
}

fn creases(edges: &[[u32; 2]], factor: f64, angle: Option<f64>) -> Vec<Crease> {
    edges.iter().map(|vertices| Crease { vertices: *vertices, factor, angle, yield_angle: f64::INFINITY }).collect()
}

fn bumpy(family: Family) -> Sheet {
    let (mut positions, triangles) = rectangle(family, 6, 1.0, 0.6);
    positions.iter_mut().for_each(|x| x.z = 0.1 * (3.0 * x.x + x.y).sin());
    (positions, triangles)
}

fn random_field(random: &mut StdRng, n: usize) -> Vec<Vec3> {
    (0..n).map(|_| Vec3::from_fn(|_, _| random.random_range(-1.0..1.0))).collect()
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

fn settle(shell: Shell) -> Arc<Shell> {
    settled(&Arc::new(shell), &mut |_| Ok(())).unwrap()
}

/// Dihedral angles of a mesh's edges.
fn angles(shell: &Shell, edges: &[[u32; 2]]) -> Vec<f64> {
    let of = |ends: &[u32; 2]| {
        let edge = shell.mesh.edges.iter().find(|e| e.vertices == *ends).unwrap();
        let [[a, b], [c, d]] = [edge.vertices, edge.opposite];
        dihedral_angle(&[a, b, c, d].map(|v| shell.mesh.positions[v as usize]))
    };
    edges.iter().map(of).collect()
}

#[test]
fn creases_that_change_nothing_leave_every_bit() {
    for (family, material) in FAMILIES.iter().flat_map(|family| materials().map(|material| (*family, material))) {
        let sheet = bumpy(family);
        let plain = shell(&sheet, Make::of(material));
        let inside = plain.mesh.edges.iter().filter(|e| e.is_interior());
        let ones = creases(&inside.map(|e| e.vertices).collect::<Vec<_>>(), 1.0, None);
        let creased = shell(&sheet, Make { creases: ones, ..Make::of(material) });
        let x: Vec<Vec3> = sheet.0.iter().map(|x| x + 0.1 * Vec3::new(x.y, x.z, x.x * x.x)).collect();
        assert!(plain.energy.value(&x) == creased.energy.value(&x) && plain.energy.value(&x) > 0.0);
        assert!(gradient(&plain, &x) == gradient(&creased, &x));
        assert!(modes_of(&plain, 6).eigenvalues == modes_of(&creased, 6).eigenvalues, "{family:?}");
    }
}

#[test]
fn creased_energies_have_the_derivatives_that_they_say() {
    let mut random = StdRng::seed_from_u64(3);
    for (family, material) in FAMILIES.iter().flat_map(|family| materials().map(|material| (*family, material))) {
        let sheet = bumpy(family);
        let mesh = Mesh::new(sheet.0.clone(), &sheet.1).unwrap();
        let every_third = mesh.edges.iter().filter(|e| e.is_interior()).step_by(3).enumerate();
        let factors = [0.0, 0.2, 1.0, 5.0];
        let crease = |(k, e): (usize, &shellwarp::mesh::Edge)| Crease {
            vertices: e.vertices,
            factor: factors[k % 4],
            angle: (k % 3 != 0).then(|| 0.1 * k as f64 % 1.0),
            yield_angle: if k % 5 == 4 { 0.05 } else { f64::INFINITY },
        };
        let rest_shape = sheet.0.iter().map(|x| Vec3::new(1.1 * x.x, x.y, 0.3 * x.x * x.x)).collect();
        let make =
            Make { creases: every_third.map(crease).collect(), rest_shape: Some(rest_shape), ..Make::of(material) };
        let shell = shell(&sheet, make);
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

/// The deflection of the far end of a strip of length 1 and width `width` under a small force across it.
fn deflection(shell: Shell, force: f64) -> f64 {
    let tip: Vec<usize> = (0..shell.mass.len()).filter(|v| shell.mesh.positions[*v].x > 1.0 - 1e-9).collect();
    // The force on the end's edges, by halves on their ends.
    let share = |v: &usize| {
        let y = shell.mesh.positions[*v].y;
        let ends =
            tip.iter().map(|w| shell.mesh.positions[*w].y).fold((f64::MAX, f64::MIN), |(a, b), y| (a.min(y), b.max(y)));
        if y == ends.0 || y == ends.1 { 0.5 } else { 1.0 }
    };
    let whole: f64 = tip.iter().map(share).sum();
    let mut load = vec![Vec3::zeros(); shell.mass.len()];
    tip.iter().for_each(|v| load[*v].z = force * share(v) / whole);
    let none = vec![Vec3::zeros(); load.len()];
    let mut solver = Solver::new(Arc::new(shell)).unwrap();
    let options = EquilibriumOptions { tolerance: 1e-9, ..Default::default() };
    let u = solver.equilibrium(&none, &load, &options, &mut |_| Ok(())).unwrap().displacement;
    tip.iter().map(|v| u[*v].z).sum::<f64>() / tip.len() as f64
}

#[test]
fn a_hinged_strip_gives_as_two_beams_with_a_rotational_spring() {
    let (cells, width, at) = (20, 0.1, 0.5);
    let sheet = ElasticSheet { poisson: 0.0, ..SHEET };
    // Of the sheet's own stiffness over one cell: D/h, and of the paper's energy 6 k_B/h.
    let rigidity = |material: &Elasticity| match material {
        Elasticity::Koiter(sheet) => sheet.stiffness()[1],
        Elasticity::DiscreteShells(material) => 6.0 * material.k_bend,
    };
    for material in [sheet.into(), PAPER.into()] {
        for family in [Family::Diagonal, Family::UnionJack] {
            let mesh = rectangle(family, cells, 1.0, width);
            let force = 1e-4 * rigidity(&material) * width;
            let plain = deflection(shell(&mesh, Make::of(material)), force);
            for factor in [0.01, 0.1, 0.5, 4.0] {
                let creases = creases(&line(&mesh, at), factor, None);
                assert_eq!(creases.len(), 2);
                let found = deflection(shell(&mesh, Make { creases, ..Make::of(material) }), force);
                let cell = 1.0 / cells as f64;
                let more = force * (1.0 - at).powi(2) * cell * (1.0 / factor - 1.0) / (rigidity(&material) * width);
                let off = (found - plain - more) / plain;
                println!(
                    "{family:?}, factor {factor}: {found:.4e} against {:.4e}, off by {:.3} %",
                    plain + more,
                    100.0 * off
                );
                let bound = match material {
                    // The moment across the line is the creases' alone, so that what they give adds up; nearly linear.
                    Elasticity::DiscreteShells(_) => 1e-3,
                    // Beside a crease of another stiffness a triangle bends by its other edges: a part of a cell of 20.
                    Elasticity::Koiter(_) => 0.02,
                };
                assert!(off.abs() < bound, "{family:?} {factor}: {off}");
            }
        }
    }
}

/// A flat card of which the half beyond x = 0.5 is to stand up, and the same turned up there.
fn card(family: Family) -> (Sheet, Sheet, Vec<[u32; 2]>) {
    let flat = rectangle(family, 8, 1.0, 0.5);
    let edges = line(&flat, 0.5);
    let up = |x: &Vec3| if x.x > 0.5 { Vec3::new(0.5, x.y, x.x - 0.5) } else { *x };
    let folded = (flat.0.iter().map(up).collect(), flat.1.clone());
    (flat, folded, edges)
}

#[test]
fn a_card_folded_to_a_right_angle_rests_there_and_swings_as_one_made_so() {
    for (family, material) in
        [Family::Diagonal, Family::UnionJack].iter().flat_map(|family| materials().map(|material| (*family, material)))
    {
        let (flat, folded, edges) = card(family);
        for factor in [0.1, 1.0] {
            // The triangles rise along their normals: not convex.
            let make = Make { creases: creases(&edges, factor, Some(-FRAC_PI_2)), ..Make::of(material) };
            let card = settle(shell(&flat, make));
            for angle in angles(&card, &edges) {
                assert!((angle + FRAC_PI_2).abs() < 1e-6, "{family:?}: {angle}"); // balanced to 1e-8 of what folds it
            }
            let off = card.mesh.positions.iter().zip(&folded.0).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(off < 1e-6, "{family:?} {factor}: {off}");
            assert!(card.given() == flat.0);
            let made =
                shell(&folded, Make { creases: creases(&edges, factor, Some(-FRAC_PI_2)), ..Make::of(material) });
            let [found, exact] = [modes_of(&card, 6), modes_of(&made, 6)].map(|modes| modes.eigenvalues);
            for (found, exact) in found.iter().zip(&exact) {
                assert_close("eigenvalue", *found, *exact, 1e-5, 0.0);
            }
        }
    }
}

#[test]
fn a_free_card_folds_where_it_is_and_keeps_its_six_free_motions() {
    for material in materials() {
        let (flat, _, edges) = card(Family::Diagonal);
        let mesh = Mesh::new(flat.0.clone(), &flat.1).unwrap();
        let make = Make { creases: creases(&edges, 0.5, Some(1.0)), ..Make::of(material) };
        let card = settle(Shell::made(mesh, make, &Supports::default()).unwrap());
        assert!(angles(&card, &edges).iter().all(|angle| (angle - 1.0).abs() < 1e-6));
        let center = |x: &[Vec3]| x.iter().zip(&card.mass).map(|(x, m)| *m * x).sum::<Vec3>() / card.total_mass;
        assert!((center(&card.mesh.positions) - center(&flat.0)).norm() < 1e-9);
        let modes = modes_of(&card, 10);
        assert!(modes.eigenvalues[..6].iter().all(|lambda| *lambda == 0.0) && modes.eigenvalues[6] > 0.0);
    }
}

/// A flat strip, and the same rolled to an arc of an angle about the y axis; clamped at x = 0, where it starts along x.
fn arc(family: Family, angle: f64) -> (Sheet, Vec<Vec3>) {
    let flat = rectangle(family, 24, 1.0, 0.2);
    let radius = 1.0 / angle;
    let rolled = |x: &Vec3| Vec3::new(radius * (x.x / radius).sin(), x.y, radius * (1.0 - (x.x / radius).cos()));
    let rest = flat.0.iter().map(rolled).collect();
    (flat, rest)
}

#[test]
fn a_flat_strip_curls_to_its_rest_shape() {
    for (family, material) in FAMILIES.iter().flat_map(|family| materials().map(|material| (*family, material))) {
        for angle in [1.0, PI, 1.5 * PI] {
            let (flat, rest) = arc(family, angle);
            let strip = shell(&flat, Make { rest_shape: Some(rest.clone()), ..Make::of(material) });
            let size = strip.energy.value(&flat.0);
            let strip = settle(strip);
            let left = strip.energy.value(&strip.mesh.positions);
            // At the clamp the strip is flat by an edge's length and must bend there; the far end shows what that turns.
            let tip = (0..flat.0.len()).filter(|v| flat.0[*v].x > 1.0 - 1e-9);
            let off = tip.map(|v| (strip.mesh.positions[v] - rest[v]).norm()).fold(0.0, f64::max);
            println!("{family:?} {angle:.2}: energy {:.1e} of that of the flat one, tip off by {off:.4}", left / size);
            assert!(off < 0.1 && left < 0.05 * size, "{family:?} {angle}: {off} {left} of {size}");
        }
    }
}

#[test]
fn a_free_strip_curls_to_the_very_rest_shape() {
    for material in materials() {
        let (flat, rest) = arc(Family::Diagonal, 1.5 * PI);
        let mesh = Mesh::new(flat.0.clone(), &flat.1).unwrap();
        let make = Make { rest_shape: Some(rest.clone()), ..Make::of(material) };
        let strip = settle(Shell::made(mesh, make, &Supports::default()).unwrap());
        // Rigid motions aside all distances are those of the rest shape.
        let x = &strip.mesh.positions;
        let pairs = (0..x.len()).flat_map(|v| (0..v).map(move |w| (v, w)));
        let off = pairs.map(|(v, w)| ((x[v] - x[w]).norm() - (rest[v] - rest[w]).norm()).abs()).fold(0.0, f64::max);
        println!("distances are off by {off:.1e}");
        assert!(off < 1e-6);
        assert!(modes_of(&strip, 8).eigenvalues[..6].iter().all(|lambda| *lambda == 0.0));
    }
}

#[test]
fn a_shell_that_is_given_at_rest_stays_to_the_last_bits() {
    for material in materials() {
        let sheet = bumpy(Family::Irregular);
        let plain = shell(&sheet, Make::of(material));
        let inside: Vec<[u32; 2]> = plain.mesh.edges.iter().filter(|e| e.is_interior()).map(|e| e.vertices).collect();
        let same = inside.iter().zip(angles(&plain, &inside));
        let same = same.map(|(vertices, angle)| Crease {
            vertices: *vertices,
            factor: 1.0,
            angle: Some(angle),
            yield_angle: f64::INFINITY,
        });
        let by_angles = Make { creases: same.collect(), ..Make::of(material) };
        let by_shape = Make { rest_shape: Some(sheet.0.clone()), ..Make::of(material) };
        for make in [by_angles, by_shape] {
            let shell = settle(shell(&sheet, make));
            let off = shell.mesh.positions.iter().zip(&sheet.0).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(off < 1e-12, "{off}");
        }
    }
}

fn model(shell: Shell) -> Arc<Model> {
    let options = Options { modes: 8, precision: Precision::F64, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap())
}

/// A folded card, a strip between two clamps that its rest shape bends, each of each energy.
fn stressed() -> Vec<Shell> {
    let mut all = vec![];
    for material in materials() {
        let (flat, _, edges) = card(Family::Diagonal);
        all.push(shell(&flat, Make { creases: creases(&edges, 0.3, Some(-1.2)), ..Make::of(material) }));
        let (flat, rest) = arc(Family::Diagonal, 1.0);
        let ends = (0..flat.0.len() as u32).filter(|v| (flat.0[*v as usize].x - 0.5).abs() > 0.5 - 1e-9).collect();
        let mesh = Mesh::new(flat.0.clone(), &flat.1).unwrap();
        let make = Make { rest_shape: Some(rest), ..Make::of(material) };
        all.push(Shell::made(mesh, make, &Supports { fixed: ends, ..Default::default() }).unwrap());
    }
    all
}

#[test]
fn every_method_moves_about_where_the_shell_rests() {
    for shell in stressed() {
        let size = shell.mesh.size;
        let model = model(shell);
        let start = model.shell.mesh.positions.clone();
        let at_rest = |method: Method, gravity: f64| {
            let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
            state.set_gravity(Vec3::new(0.0, 0.0, gravity)).unwrap();
            state.equilibrium().unwrap();
            let mut x = vec![Vec3::zeros(); start.len()];
            state.positions(shellwarp::state::Space::Frame, |v, p| x[v] = p);
            (x, state.certify().unwrap())
        };
        for method in [Method::LinearModalAnalysis, Method::Warp, Method::RotationStrain, Method::ImplicitShell] {
            // Without load nothing moves from there; balanced to 1e-8 of what settled it.
            let still = at_rest(method, 0.0).0;
            let off = still.iter().zip(&start).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(off < 1e-6 * size, "{method:?}: {off}");
        }
        let (exact, _) = at_rest(Method::ImplicitShell, -0.05);
        let moved: Vec<Vec3> = exact.iter().zip(&start).map(|(a, b)| a - b).collect();
        let far = moved.iter().map(|u| u.norm()).fold(0.0, f64::max);
        for method in [Method::Warp, Method::RotationStrain] {
            let (x, certified) = at_rest(method, -0.05);
            let u: Vec<Vec3> = x.iter().zip(&start).map(|(a, b)| a - b).collect();
            let off = error(&u, &moved);
            println!("moves by {far:.1e}; {method:?}: error {off:.4}, certified {:.4}", certified.error);
            assert!(off < 0.3 && far > 1e-5, "{method:?}: {off}"); // eight modes
            assert!(
                (certified.error / off - 1.0).abs() < 0.5 || off < 1e-3,
                "{method:?}: {} of {off}",
                certified.error
            );
        }
    }
}

#[test]
fn a_saved_model_has_its_creases_and_rest_shape_and_moves_by_the_same_bits() {
    for shell in stressed() {
        let model = model(shell);
        let bytes = model.save().unwrap();
        let loaded = Arc::new(Model::load(&bytes).unwrap());
        assert!(loaded.save().unwrap() == bytes && loaded.shell.creases == model.shell.creases);
        assert!(
            loaded.shell.rest_shape == model.shell.rest_shape && loaded.shell.settled_from == model.shell.settled_from
        );
        assert!(loaded.shell.mesh.positions == model.shell.mesh.positions);
        assert_moves_by_the_same_bits([&model, &loaded], &[Method::Warp, Method::ImplicitShell]);
        assert_damage_is_refused(&bytes);
    }
}

#[test]
fn bad_creases_and_rest_shapes_are_refused_by_name_and_number() {
    let sheet = rectangle(Family::Diagonal, 4, 1.0, 1.0);
    let refused = |make: Make, words: &[&str]| {
        let mesh = Mesh::new(sheet.0.clone(), &sheet.1).unwrap();
        let error = Shell::made(mesh, make, &Supports::default()).err().unwrap();
        assert!(words.iter().all(|word| error.message.contains(word)), "{error}");
    };
    for material in materials() {
        let with = |creases: Vec<Crease>| Make { creases, ..Make::of(material) };
        let good = Crease { vertices: [6, 7], factor: 1.0, angle: None, yield_angle: f64::INFINITY };
        let bad_edge =
            |vertices: [u32; 2], words: &[&str]| refused(with(vec![good, Crease { vertices, ..good }]), words);
        bad_edge([6, 25], &["crease 1", "6-25", "25 vertices"]);
        bad_edge([u32::MAX, 6], &["crease 1", "4294967295-6", "25 vertices"]);
        bad_edge([6, 6], &["crease 1", "6-6", "does not have"]);
        bad_edge([0, 24], &["crease 1", "0-24", "does not have"]);
        bad_edge([0, 1], &["crease 1", "0-1", "only one triangle"]);
        bad_edge([6, 7], &["creases 0 and 1", "same edge 6-7"]);
        bad_edge([7, 6], &["creases 0 and 1", "same edge 6-7"]);
        for factor in [-1.0, -1e-300, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            refused(with(vec![Crease { factor, ..good }]), &["factor of crease 0", "6-7", &format!("{factor:?}")]);
        }
        for angle in [3.2, -3.2, 360.0, f64::NAN, f64::INFINITY, -f64::INFINITY] {
            let crease = Crease { angle: Some(angle), ..good };
            refused(with(vec![crease]), &["rest angle of crease 0", "6-7", &format!("{angle:?}"), "-pi to pi"]);
        }
        let shaped = |rest_shape: Vec<Vec3>| Make { rest_shape: Some(rest_shape), ..Make::of(material) };
        refused(shaped(sheet.0[1..].to_vec()), &["rest shape has 24 positions", "25 vertices"]);
        refused(shaped(vec![]), &["rest shape has 0 positions", "25 vertices"]);
        let change = |v: usize, x: Vec3| {
            let mut shape = sheet.0.clone();
            shape[v] = x;
            shape
        };
        refused(shaped(change(3, Vec3::new(f64::NAN, 0.0, 0.0))), &["the rest shape", "3"]);
        refused(shaped(change(3, Vec3::new(0.0, f64::INFINITY, 0.0))), &["the rest shape", "3"]);
        refused(shaped(change(0, sheet.0[1])), &["the rest shape"]);
        refused(shaped(vec![Vec3::zeros(); 25]), &["the rest shape"]);
    }
}
