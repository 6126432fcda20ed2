//! Sheets that are stiffer along than across: derivatives, closed forms of plates and strips, the same on every mesh, all methods, bad input.

use crate::common::*;
use crate::plates::*;
use rand::{Rng, SeedableRng, rngs::StdRng};
use shellwarp::energy::Curvature;
use shellwarp::material::{Crease, ElasticSheet, Fibres, Map, On, Quantity};
use shellwarp::mesh::Mesh;
use shellwarp::model::{Model, Options, Precision};
use shellwarp::shell::Make;
use shellwarp::state::{Method, State};
use shellwarp::step::Integrator;
use shellwarp::{Shell, Supports, Vec3, reduced};
use std::f64::consts::PI;
use std::sync::Arc;

/// About spruce: E₂ a twelfth, G a fifteenth.
const WOOD: ElasticSheet = ElasticSheet { young: 1.0, poisson: 0.4, thickness: 1e-3, volume_density: 1.0 };
const ACROSS: f64 = 1.0 / 12.0;
const SHEAR: f64 = 1.0 / 15.0;

fn fibres(directions: Vec<Vec3>) -> Option<Fibres> {
    Some(Fibres { across: ACROSS, shear: SHEAR, directions })
}

fn at(angle: f64) -> Vec3 {
    Vec3::new(angle.cos(), angle.sin(), 0.0)
}

fn made((positions, triangles): &Sheet, make: Make, supports: Supports) -> Shell {
    Shell::made(Mesh::new(positions.clone(), triangles).unwrap(), make, &supports).unwrap()
}

fn where_held(sheet: &Sheet, held: impl Fn(&Vec3) -> bool) -> Vec<u32> {
    (0..sheet.0.len() as u32).filter(|v| held(&sheet.0[*v as usize])).collect()
}

fn clamped(sheet: &Sheet) -> Supports {
    Supports { clamped: where_held(sheet, |x| x.x < 1e-9), ..Supports::default() }
}

/// A bumpy sheet, its fibres along circles about a corner: every flip has two directions.
fn bumpy(family: Family) -> Shell {
    let (mut positions, triangles) = rectangle(family, 6, 1.0, 0.6);
    positions.iter_mut().for_each(|x| x.z = 0.1 * (3.0 * x.x + x.y).sin());
    let centre = |t: &[u32; 3]| t.iter().map(|v| positions[*v as usize]).sum::<Vec3>() / 3.0;
    let directions = triangles.iter().map(|t| Vec3::new(-centre(t).y, centre(t).x, 0.1)).collect();
    let sheet = (positions, triangles);
    let thick = ElasticSheet { thickness: 0.1, young: 5.0, ..WOOD };
    made(&sheet, Make { fibres: fibres(directions), ..Make::of(thick) }, clamped(&sheet))
}

fn random_field(random: &mut StdRng, n: usize) -> Vec<Vec3> {
    (0..n).map(|_| Vec3::from_fn(|_, _| random.random_range(-1.0..1.0))).collect()
}

fn along(x: &[Vec3], d: &[Vec3], h: f64) -> Vec<Vec3> {
    x.iter().zip(d).map(|(x, d)| x + h * d).collect()
}

fn inner(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

fn gradient(shell: &Shell, x: &[Vec3]) -> Vec<Vec3> {
    let mut gradient = vec![Vec3::zeros(); x.len()];
    shell.energy.add_gradient(x, &mut gradient);
    gradient
}

fn curvature(shell: &Shell, x: &[Vec3], d: &[Vec3], e: &[Vec3]) -> f64 {
    let mut sum = 0.0;
    shell.energy.visit_hessian(x, Curvature::Exact, &mut |(vertices, blocks)| {
        for (ij, block) in blocks.iter().enumerate() {
            let [i, j] = [ij / vertices.len(), ij % vertices.len()].map(|k| vertices[k] as usize);
            sum += e[i].dot(&(block * d[j]));
        }
    });
    sum
}

#[test]
fn it_has_the_derivatives_of_its_energy() {
    let mut random = StdRng::seed_from_u64(7);
    for family in FAMILIES {
        let shell = bumpy(family);
        let n = shell.mass.len();
        assert!(shell.energy.value(&shell.mesh.positions) == 0.0);
        for trial in 0..4 {
            let x = along(&shell.mesh.positions, &random_field(&mut random, n), 4e-3 * f64::from(trial));
            let (d, e) = (random_field(&mut random, n), random_field(&mut random, n));
            // Central differences over edges of 0.17: truncation (h/0.17)² = 4e-9 times higher derivatives.
            let h = 1e-5;
            let [ahead, behind] = [h, -h].map(|h| along(&x, &d, h));
            let slope = (shell.energy.value(&ahead) - shell.energy.value(&behind)) / (2.0 * h);
            let g = gradient(&shell, &x);
            assert_close("slope", inner(&g, &d), slope, 1e-6, (inner(&g, &g) * inner(&d, &d)).sqrt().max(1.0));
            let change = inner(&along(&gradient(&shell, &ahead), &gradient(&shell, &behind), -1.0), &e) / (2.0 * h);
            let size = curvature(&shell, &x, &d, &d).abs().max(curvature(&shell, &x, &e, &e).abs());
            assert_close("curve", curvature(&shell, &x, &d, &e), change, 1e-6, size);
        }
    }
}

/// D₁, D₂ and H = ν₁₂ D₂ + 2 G h³/12 of [`WOOD`] with these ratios.
fn rigidities() -> [f64; 3] {
    let unit = WOOD.young * WOOD.thickness.powi(3) / 12.0;
    let first = unit / (1.0 - WOOD.poisson * WOOD.poisson * ACROSS);
    [first, ACROSS * first, WOOD.poisson * ACROSS * first + 2.0 * SHEAR * unit]
}

#[test]
fn a_supported_plate_has_the_frequencies_of_the_closed_form_on_every_mesh() {
    let [d1, d2, h] = rigidities();
    for (family, angle) in FAMILIES.into_iter().flat_map(|family| [0.0, 0.5 * PI].map(|angle| (family, angle))) {
        let sheet = rectangle(family, 32, 1.0, 1.0);
        let at_edge = |x: &Vec3| x.x.min(x.y).min(1.0 - x.x).min(1.0 - x.y) < 1e-9;
        let supports = Supports { fixed: where_held(&sheet, at_edge), ..Supports::default() };
        let shell = made(&sheet, Make { fibres: fibres(vec![3.0 * at(angle)]), ..Make::of(WOOD) }, supports);
        let found: Vec<f64> = modes_of(&shell, 4).eigenvalues.iter().map(|lambda| lambda.sqrt()).collect();
        let (dx, dy) = if angle == 0.0 { (d1, d2) } else { (d2, d1) };
        let squared = |m: f64, n: f64| dx * m.powi(4) + 2.0 * h * (m * n).powi(2) + dy * n.powi(4);
        let mut exact: Vec<f64> = (1..6)
            .flat_map(|m| (1..6).map(move |n| (f64::from(m), f64::from(n))))
            .map(|(m, n)| PI * PI * (squared(m, n) / WOOD.area_density()).sqrt())
            .collect();
        exact.sort_by(f64::total_cmp);
        let off: Vec<f64> = found.iter().zip(&exact).map(|(f, e)| 100.0 * (f / e - 1.0)).collect();
        println!("{family:?} {angle:.2}: {off:.2?} %");
        // Second order in the cell; four waves across where the sheet is soft: a cell is an eighth of a wave. As tests/energy/koiter.rs allows two.
        assert!(off.iter().all(|off| off.abs() < 2.0), "{family:?} {angle}: {off:?}");
    }
}

#[test]
fn a_strip_cut_at_an_angle_swings_as_a_beam_of_that_modulus() {
    for family in FAMILIES {
        for degrees in [0.0f64, 30.0, 45.0, 90.0] {
            let (sheet, angle) = (rectangle(family, 160, 40.0, 1.0), degrees.to_radians());
            let make = Make { fibres: fibres(vec![at(angle)]), ..Make::of(WOOD) };
            let found = modes_of(&made(&sheet, make, clamped(&sheet)), 1).eigenvalues[0].sqrt();
            // Free to twist, a strip bends by the compliance along it: 1/E = c⁴/E₁ + (1/G − 2ν/E₁) c²s² + s⁴/E₂.
            let (c, s) = (angle.cos().powi(2), angle.sin().powi(2));
            let compliance = c * c + (1.0 / SHEAR - 2.0 * WOOD.poisson) * c * s + s * s / ACROSS;
            let root = 1.875_104_068_7 / 40.0f64;
            let exact = root * root * (WOOD.thickness.powi(2) / (12.0 * compliance)).sqrt();
            println!("{family:?} {degrees}°: {:.2} %", 100.0 * (found / exact - 1.0));
            // The clamp holds the twist over about a width of forty; four triangles across.
            assert_close("frequency", found, exact, 0.03, 0.0);
        }
    }
}

#[test]
fn equal_moduli_are_the_isotropic_sheet_to_the_bit_and_turning_everything_turns_nothing() {
    let sheet = rectangle(Family::UnionJack, 12, 1.0, 0.7);
    let save = |shell: Shell| {
        let options = Options { modes: 6, precision: Precision::F64, ..Options::default() };
        Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap().save().unwrap()
    };
    let plain = save(made(&sheet, Make::of(WOOD), clamped(&sheet)));
    for shear in [0.0, 1.0 / (2.0 * (1.0 + WOOD.poisson))] {
        let fibres = Fibres { across: 1.0, shear, directions: vec![Vec3::new(1.0, 2.0, 3.0)] };
        assert!(save(made(&sheet, Make { fibres: Some(fibres), ..Make::of(WOOD) }, clamped(&sheet))) == plain);
    }
    // The law itself, just off equal moduli; and the whole turned in space, directions of either sign and any length.
    let slowest = |sheet: &Sheet, fibres: Fibres, supports: Supports| {
        let shell = made(sheet, Make { fibres: Some(fibres), ..Make::of(WOOD) }, supports);
        modes_of(&shell, 3).eigenvalues[2].sqrt()
    };
    let supports = || clamped(&sheet);
    let near = Fibres { across: 1.0 + 1e-9, shear: 0.0, directions: vec![at(0.7)] };
    let isotropic = modes_of(&made(&sheet, Make::of(WOOD), supports()), 3).eigenvalues[2].sqrt();
    assert_close("nearly isotropic", slowest(&sheet, near, supports()), isotropic, 1e-6, 0.0); // another flip is none here
    let turn = nalgebra::Rotation3::from_euler_angles(0.3, -1.1, 2.0);
    let turned = (sheet.0.iter().map(|x| turn * x).collect(), sheet.1.clone());
    let wood = |direction: Vec3| fibres(vec![direction]).unwrap();
    let (here, there) = (
        slowest(&sheet, wood(at(0.5)), supports()),
        slowest(&turned, wood(turn * (-7.0 * at(0.5) + 0.5 * Vec3::z())), supports()),
    );
    assert_close("turned", there, here, 1e-8, 0.0); // two searches, to 1e-10 each
    // A rest shape that is the mesh turned: the direction goes with the matter.
    let shape = Make { fibres: fibres(vec![at(0.5)]), rest_shape: Some(turned.0.clone()), ..Make::of(WOOD) };
    let settled = shellwarp::reference::settled(&Arc::new(made(&sheet, shape, supports())), &mut |_| Ok(())).unwrap();
    assert_close("rest shape", modes_of(&settled, 3).eigenvalues[2].sqrt(), here, 1e-6, 0.0);
}

#[test]
fn maps_scale_all_moduli_and_a_crease_goes_by_what_bends_about_it() {
    let sheet = rectangle(Family::Irregular, 10, 1.0, 0.6);
    let eigenvalue = |make: Make| modes_of(&made(&sheet, make, clamped(&sheet)), 2).eigenvalues[1];
    let wood = || Make { fibres: fibres(vec![at(0.4)]), ..Make::of(WOOD) };
    let map = Map { quantity: Quantity::Young, on: On::Triangles, values: vec![3.0; sheet.1.len()] };
    assert_close("a map of three", eigenvalue(Make { maps: vec![map], ..wood() }), 3.0 * eigenvalue(wood()), 1e-8, 0.0);
    // A fold across a strip, by Koiter's springs: with the fibres along, its stiffness is E₁'s, across, E₂'s.
    let strip = rectangle(Family::Diagonal, 20, 10.0, 1.0);
    let mesh = Mesh::new(strip.0.clone(), &strip.1).unwrap();
    let middle = |v: &u32| (strip.0[*v as usize].x - 5.0).abs() < 1e-9;
    let folds = mesh.edges.iter().map(|e| e.vertices).filter(|ends| ends.iter().all(middle));
    let creases: Vec<Crease> =
        folds.map(|vertices| Crease { vertices, factor: 1e-3, angle: None, yield_angle: f64::INFINITY }).collect();
    let slowest = |angle: f64| {
        let make = Make { creases: creases.clone(), fibres: fibres(vec![at(angle)]), ..Make::of(WOOD) };
        modes_of(&made(&strip, make, clamped(&strip)), 1).eigenvalues[0]
    };
    // Nearly all of what bends is the fold: λ goes as its stiffness, D₁ or D₂. The halves give 1 % of it.
    assert_close("folds", slowest(0.0) / slowest(0.5 * PI), 1.0 / ACROSS, 0.03, 0.0);
}

#[test]
fn every_method_moves_it_and_a_saved_model_moves_by_the_same_bits() {
    let shell = bumpy(Family::Irregular);
    let reduced = reduced::Options { fields: 12, elements: 400, poses: 4, ..Default::default() };
    let options = Options { modes: 16, precision: Precision::F64, reduced, ..Options::default() };
    let model = Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap());
    let bytes = model.save().unwrap();
    let loaded = Arc::new(Model::load(&bytes).unwrap());
    assert!(loaded.save().unwrap() == bytes);
    assert!(loaded.shell.orthotropy == model.shell.orthotropy && loaded.shell.orthotropy.is_some());
    let hangs = |model: &Arc<Model>, method: Method| {
        let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
        state.set_gravity(Vec3::new(0.0, 0.0, -1e-5)).unwrap();
        state.equilibrium().unwrap();
        displacements(&state)
    };
    let exact = hangs(&model, Method::ImplicitShell);
    for method in
        [Method::LinearModalAnalysis, Method::Warp, Method::RotationStrain, Method::ReducedShell, Method::ImplicitShell]
    {
        let found = hangs(&model, method);
        println!(
            "{method:?}: {:.4} of {:.1e}",
            error(&found, &exact),
            exact.iter().map(|u| u.norm()).fold(0.0, f64::max)
        );
        // Small bending: what sixteen modes leave of the weight's shape.
        assert!(error(&found, &exact) < 2e-3, "{method:?}: {}", error(&found, &exact));
        assert!(found == hangs(&loaded, method), "{method:?}");
    }
}

#[test]
fn what_no_sheet_is_made_of_is_refused_by_name() {
    let sheet = rectangle(Family::Diagonal, 2, 1.0, 1.0);
    let refused = |fibres: Fibres, poisson: f64, name: &str| {
        let make = Make { fibres: Some(fibres), ..Make::of(ElasticSheet { poisson, ..WOOD }) };
        let made = Shell::made(Mesh::new(sheet.0.clone(), &sheet.1).unwrap(), make, &Supports::default());
        let message = made.map(|_| ()).unwrap_err().message;
        assert!(message.contains(name), "{name}: {message}");
    };
    let wood = |directions: Vec<Vec3>| fibres(directions).unwrap();
    refused(Fibres { across: 4.0, ..wood(vec![at(0.0)]) }, 0.5, "between -0.5 and 0.5");
    refused(Fibres { across: 0.1, ..wood(vec![at(0.0)]) }, -1.0, "poisson is -1");
    refused(Fibres { across: -1.0, ..wood(vec![at(0.0)]) }, 0.3, "young_across is -1");
    refused(Fibres { across: 1e-12, ..wood(vec![at(0.0)]) }, 0.3, "young_across is 1e-12");
    refused(Fibres { shear: f64::NAN, ..wood(vec![at(0.0)]) }, 0.3, "shear is NaN");
    refused(wood(vec![]), 0.3, "0 directions");
    refused(wood(vec![at(0.0); 3]), 0.3, "3 directions");
    refused(wood(vec![Vec3::zeros()]), 0.3, "at triangle 0 is none");
    let mut one_is_wrong = vec![at(0.0); sheet.1.len()];
    one_is_wrong[5] = Vec3::new(1e-5, 0.0, 1.0);
    refused(wood(one_is_wrong), 0.3, "at triangle 5 is across");
    let paper = Make { fibres: fibres(vec![at(0.0)]), ..Make::of(shellwarp::Material::default()) };
    let made = Shell::made(Mesh::new(sheet.0.clone(), &sheet.1).unwrap(), paper, &Supports::default());
    assert!(made.map(|_| ()).unwrap_err().message.contains("Koiter"));
    // Far from isotropic, and beyond an isotropic sheet's Poisson's ratio.
    let extreme = Fibres { across: 1e-4, shear: 1e-4, directions: vec![at(0.3)] };
    let make = Make { fibres: Some(extreme), ..Make::of(ElasticSheet { poisson: 0.9, ..WOOD }) };
    let eigenvalues = modes_of(&made_of(&sheet, make), 3).eigenvalues;
    assert!(eigenvalues.iter().all(|lambda| lambda.is_finite() && *lambda >= 0.0));
}

fn made_of(sheet: &Sheet, make: Make) -> Shell {
    made(sheet, make, clamped(sheet))
}
