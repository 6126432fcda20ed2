//! The polynomial energy of reduced shells: its derivatives, its invariance, and its equilibria against the full shell.

use crate::common::*;
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3};
use shellwarp::energy::Curvature;
use shellwarp::material::{Crease, ElasticSheet, Fibres, Map, On, Quantity};
use shellwarp::model::{Model, Options, Precision};
use shellwarp::reduced::polynomial::{Gate, LEADING, PolynomialEnergy, Sources, make};
use shellwarp::reduced::{
    self, AnyFields, Assumed, Elastic, Factor, Newton, Potential, ReducedEnergy, ReducedShell, Stop,
};
use shellwarp::reference::{EquilibriumOptions, Solver};
use shellwarp::shell::Make;
use shellwarp::state::{Damping, Method, State};
use shellwarp::step::Integrator;
use shellwarp::{Material, Mesh, Shell, Supports, Vec3};
use std::sync::{Arc, OnceLock};

fn model(shell: &Arc<Shell>, fields: usize) -> Arc<Model> {
    let reduced = reduced::Options { fields, poses: reduced::MAX_POSES, ..Default::default() };
    let options = Options { modes: 8, precision: Precision::F64, reduced, ..Options::default() };
    Arc::new(Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).unwrap())
}

fn leaf_like() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let (mut positions, triangles) = equilateral_sheet(20, 10, 0.075);
    for x in &mut positions {
        let width = 0.35 + 0.65 * (std::f64::consts::PI * x[0] / 1.5).sin().max(0.0);
        let y = width * (x[1] - 0.325);
        *x = Vec3::new(x[0], y, 0.25 * x[0] * (1.5 - x[0]) + 0.8 * y * y);
    }
    (positions, triangles)
}

/// A leaf-like sheet, curved along and across, held at its stem.
fn curved() -> &'static Arc<Model> {
    static MODEL: OnceLock<Arc<Model>> = OnceLock::new();
    MODEL.get_or_init(|| {
        let (positions, triangles) = leaf_like();
        held(positions, &triangles, |x| x[0] < 0.08, 0.1)
    })
}

const SHEET: ElasticSheet = ElasticSheet { young: 1e6, poisson: 0.3, thickness: 0.01, volume_density: 100.0 };

/// The same leaf in engineering units, clamped at its stem.
fn koiter_leaf() -> &'static Arc<Model> {
    static MODEL: OnceLock<Arc<Model>> = OnceLock::new();
    MODEL.get_or_init(|| {
        let (positions, triangles) = leaf_like();
        let clamped = (0..positions.len() as u32).filter(|v| positions[*v as usize][0] < 0.08).collect();
        let supports = Supports { clamped, ..Default::default() };
        let mesh = Mesh::new(positions, &triangles).unwrap();
        model(&Arc::new(Shell::new(mesh, SHEET, &supports).unwrap()), 20)
    })
}

/// The gutter in engineering units, of squares cut along both diagonals, thicker at its end, and soft along its fold.
fn koiter_gutter() -> &'static Arc<Model> {
    static MODEL: OnceLock<Arc<Model>> = OnceLock::new();
    MODEL.get_or_init(|| {
        let (positions, triangles) = gutter();
        let row = |v: u32| (v / GUTTER_ROW, v % GUTTER_ROW);
        let crease = |i: u32| Crease {
            vertices: [i * GUTTER_ROW + GUTTER_ROW / 2, (i + 1) * GUTTER_ROW + GUTTER_ROW / 2],
            factor: 0.5,
            angle: None,
            yield_angle: f64::INFINITY,
        };
        let fixed = (0..positions.len() as u32).filter(|v| row(*v).0 == 0).collect();
        let thickness = positions.iter().map(|x| if x[0] > 1.0 { 0.02 } else { 0.01 }).collect();
        let maps = vec![Map { quantity: Quantity::Thickness, on: On::Vertices, values: thickness }];
        let creases = (0..GUTTER_LENGTH).map(crease).collect();
        let make = Make { maps, creases, ..Make::of(SHEET) };
        let supports = Supports { fixed, ..Default::default() };
        let mesh = Mesh::new(positions, &triangles).unwrap();
        model(&Arc::new(Shell::made(mesh, make, &supports).unwrap()), 20)
    })
}

/// The leaf with a grain: ten times stiffer along its length than across.
fn koiter_grain() -> &'static Arc<Model> {
    static MODEL: OnceLock<Arc<Model>> = OnceLock::new();
    MODEL.get_or_init(|| {
        let (positions, triangles) = leaf_like();
        let clamped = (0..positions.len() as u32).filter(|v| positions[*v as usize][0] < 0.08).collect();
        let supports = Supports { clamped, ..Default::default() };
        let mesh = Mesh::new(positions, &triangles).unwrap();
        let fibres = Some(Fibres { across: 0.1, shear: 0.1, directions: vec![Vec3::x()] });
        model(&Arc::new(Shell::made(mesh, Make { fibres, ..Make::of(SHEET) }, &supports).unwrap()), 20)
    })
}

/// A trouser leg, limp, whose membrane carries the loads.
fn leg() -> &'static Arc<Model> {
    static MODEL: OnceLock<Arc<Model>> = OnceLock::new();
    MODEL.get_or_init(|| model(&Arc::new(trouser_leg("right")), 20))
}

/// All shells that are tried, by name.
fn shells() -> [(&'static str, &'static Arc<Model>); 6] {
    [
        ("curved", curved()),
        ("folded", folded()),
        ("cylinder", cylinder()),
        ("Koiter's leaf", koiter_leaf()),
        ("Koiter's grain", koiter_grain()),
        ("Koiter's gutter", koiter_gutter()),
    ]
}

/// With one that counts by engineering strains.
fn with_leg() -> impl Iterator<Item = (&'static str, &'static Arc<Model>)> {
    assert!(polynomial_of(leg()).coefficients().engineering.is_some());
    shells().into_iter().chain([("leg", leg())])
}

const GUTTER_LENGTH: u32 = 20;
const GUTTER_ROW: u32 = 9;

fn gutter() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let m = GUTTER_ROW as i32 / 2;
    let (mut positions, mut triangles) = (vec![], vec![]);
    for i in 0..=GUTTER_LENGTH {
        for j in -m..=m {
            let y = 0.06 * f64::from(j);
            positions.push(Vec3::new(0.07 * f64::from(i), y, 0.8 * y.abs()));
            if i < GUTTER_LENGTH && j < m {
                let a = i * GUTTER_ROW + (j + m) as u32;
                let b = a + GUTTER_ROW;
                let turned = (i as i32 + j) % 2 == 0;
                triangles.extend(if turned {
                    [[a, b, b + 1], [a, b + 1, a + 1]]
                } else {
                    [[a, b, a + 1], [b, b + 1, a + 1]]
                });
            }
        }
    }
    (positions, triangles)
}

/// A gutter with a sharp fold along it, held at one end.
fn folded() -> &'static Arc<Model> {
    static MODEL: OnceLock<Arc<Model>> = OnceLock::new();
    MODEL.get_or_init(|| {
        let (positions, triangles) = gutter();
        held(positions, &triangles, |x| x[0] < 0.01, 0.1)
    })
}

/// A quarter of a cylinder, held along a part of one edge.
fn cylinder() -> &'static Arc<Model> {
    static MODEL: OnceLock<Arc<Model>> = OnceLock::new();
    MODEL.get_or_init(|| {
        let (mut positions, triangles) = equilateral_sheet(14, 12, 0.1);
        for x in &mut positions {
            let angle = x[1] / 0.7;
            *x = Vec3::new(x[0], 0.7 * angle.sin(), 0.7 * angle.cos());
        }
        held(positions, &triangles, |x| x[1] < 0.09 && x[0] < 0.75, 0.5)
    })
}

fn held(positions: Vec<Vec3>, triangles: &[[u32; 3]], fixed: impl Fn(&Vec3) -> bool, k_bend: f64) -> Arc<Model> {
    let fixed = (0..positions.len() as u32).filter(|v| fixed(&positions[*v as usize])).collect();
    let material = Material { k_area: 1e4, k_length: 1e4, k_bend, area_density: 1.0 };
    let supports = Supports { fixed, ..Default::default() };
    let shell = Shell::new(Mesh::new(positions, triangles).unwrap(), material, &supports).unwrap();
    model(&Arc::new(shell), 20)
}

fn reduced_of(model: &Model) -> &ReducedShell {
    model.reduced.as_ref().unwrap()
}

fn polynomial_of(model: &Model) -> &PolynomialEnergy {
    reduced_of(model).polynomial.as_ref().unwrap()
}

fn columns_of(model: &Model) -> Vec<Vec<Vec3>> {
    let AnyFields::F64(fields) = &reduced_of(model).fields else { panic!("asked for 64 bits") };
    (0..fields.n).map(|k| (0..model.shell.mass.len()).map(|v| fields.at(k, v)).collect()).collect()
}

/// Amplitudes that bend a shell by some tenths of its size.
fn bent(n: usize, size: f64) -> Vec<f64> {
    (0..n).map(|k| size * (1.7 * k as f64 + 0.3).sin() / (1.0 + k as f64)).collect()
}

#[test]
fn gradient_and_hessian_are_those_of_the_value() {
    for (name, model) in with_leg() {
        let (energy, n) = (polynomial_of(model), reduced_of(model).n());
        let mut scratch = energy.scratch();
        let size = if name == "leg" { 0.4 * energy.gate.reach } else { 0.2 };
        let q = bent(n, size);
        let mut hessian = DMatrix::zeros(n, n);
        energy.hessian(&q, Curvature::Exact, &mut scratch, &mut hessian);
        let [mut plus, mut minus, mut here] = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        energy.gradient(&q, &mut scratch, &mut here);
        let scale = here.iter().map(|g| g.abs()).fold(0.0, f64::max);
        for k in 0..n {
            let h = 5e-5 * size;
            let at = |sign: f64| (0..n).map(|j| q[j] + if j == k { sign * h } else { 0.0 }).collect::<Vec<_>>();
            let slope = (energy.value(&at(1.0), &mut scratch) - energy.value(&at(-1.0), &mut scratch)) / (2.0 * h);
            energy.gradient(&at(1.0), &mut scratch, &mut plus);
            energy.gradient(&at(-1.0), &mut scratch, &mut minus);
            assert_close("slope", here[k], slope, 1e-5, scale); // h² of the third derivative
            for j in 0..n {
                assert_close("curvature", hessian[(j, k)], (plus[j] - minus[j]) / (2.0 * h), 1e-6, hessian.amax());
                assert_eq!(hessian[(j, k)], hessian[(k, j)]);
            }
        }
    }
}

#[test]
fn the_rest_shape_has_no_energy_and_its_stiffness_is_the_shells() {
    for (name, model) in with_leg() {
        let (energy, n) = (polynomial_of(model), reduced_of(model).n());
        let shell = &model.shell;
        let (rest, mut scratch) = (vec![0.0; n], energy.scratch());
        let mut gradient = rest.clone();
        assert_eq!(energy.value(&rest, &mut scratch), 0.0);
        energy.gradient(&rest, &mut scratch, &mut gradient);
        assert_eq!(gradient, rest);
        let [mut own, mut exact] = [DMatrix::zeros(n, n), DMatrix::zeros(n, n)];
        energy.hessian(&rest, Curvature::Exact, &mut scratch, &mut own);
        let mut stiff = own.clone();
        energy.viscosity(&rest, &mut scratch, &mut stiff);
        let columns = columns_of(model);
        let all = ReducedEnergy::new(shell, &columns, &vec![1.0; shell.energy.n_elements()]);
        all.hessian(&rest, Curvature::Exact, &mut all.scratch(), &mut exact);
        let modes = 8;
        let worst = (0..modes).map(|k| (own[(k, k)] / exact[(k, k)] - 1.0).abs()).fold(0.0, f64::max);
        let damped = (0..modes).map(|k| (stiff[(k, k)] / exact[(k, k)] - 1.0).abs()).fold(0.0, f64::max);
        let least = own.clone().symmetric_eigenvalues().min();
        println!("{name}: modes' stiffness off by {worst:.1e}, viscosity by {damped:.1e}, least {least:.3e}");
        // The corrections are compressed to a few; 1e-2 is half a percent of a frequency. Bending's own rest Hessian is whole.
        // Half of the modes are exact; the leg's others stretch its edges, which the cubic knows least.
        assert!(worst < if name == "leg" { 2e-2 } else { 1e-2 }, "{name}: {worst}");
        assert!(damped < 1e-9, "{name}: {damped}");
        assert!(least > 0.9 * exact[(0, 0)], "{name}: softer than any mode: {least}");
    }
}

/// √(δᵀ(H + shift)⁻¹δ/scale) of a force δ too much: the residual that it makes in a stage of a step of 1/60 s.
fn residual_of(energy: &PolynomialEnergy, q: &[f64], force: &[f64]) -> f64 {
    let (n, mut scratch) = (energy.n(), energy.scratch());
    let (mut gradient, mut hessian) = (vec![0.0; n], DMatrix::zeros(n, n));
    energy.gradient(q, &mut scratch, &mut gradient);
    energy.hessian(q, Curvature::Semidefinite, &mut scratch, &mut hessian);
    let shift = ((1.0 - 0.5f64.sqrt()) / 60.0).powi(-2);
    (0..n).for_each(|i| hessian[(i, i)] += shift);
    let force = DVector::from_column_slice(force);
    let scale: f64 = (0..n).map(|i| (q[i] * gradient[i]).abs() + shift * q[i] * q[i]).sum();
    (hessian.cholesky().unwrap().solve(&force).dot(&force) / scale).sqrt()
}

/// Sums of 32 bits miss some 2⁻²⁴ of what is of second and higher order; the rest is of 64.
#[test]
fn steps_by_sums_of_32_bits_feel_the_forces_of_64() {
    for (name, model) in shells() {
        let (energy, n) = (polynomial_of(model), reduced_of(model).n());
        let [mut first, mut second] = [energy.scratch(), energy.scratch()];
        let [mut near, mut exact] = [vec![0.0; n], vec![0.0; n]];
        let (mut near_hessian, mut hessian) = (Factor::new(n, energy.arch), DMatrix::zeros(n, n));
        let mut both = |q: &[f64]| {
            energy.near_gradient(q, &mut first, &mut near);
            energy.near_hessian(q, &mut first, &mut near_hessian);
            energy.gradient(q, &mut second, &mut exact);
            energy.lower_hessian(q, Curvature::Exact, &mut second, &mut hessian);
            let off: Vec<f64> = near.iter().zip(&exact).map(|(a, b)| a - b).collect();
            let entries = (0..n).flat_map(|i| (0..=i).map(move |j| (i, j)));
            let curved = entries.map(|(i, j)| (near_hessian.entry(j, i) - hessian[(i, j)]).abs()).fold(0.0, f64::max);
            (off, exact.clone(), curved / hessian.amax())
        };
        let (off, _, curved) = both(&vec![0.0; n]);
        assert!(off.iter().all(|x| *x == 0.0) && curved < 1e-6, "{name} at rest: {curved:e}"); // rounding to 32 bits
        // Where the second order is a 1e-6th of the first, the whole is off by 1e-6 of what sums of 32 bits miss.
        let norm = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
        let slight: Vec<f64> = bent(n, 1.0).iter().map(|q| 1e-6 * energy.gate.reach * q).collect();
        let (off, force, _) = both(&slight);
        println!("{name}: off by {:.1e} of the force where it hardly moves", norm(&off) / norm(&force));
        assert!(norm(&off) < 1e-10 * norm(&force), "{name}: {:e}", norm(&off) / norm(&force));
        for share in [0.1, 0.3, 1.0] {
            let bent = bent(n, 1.0);
            let q: Vec<f64> = bent.iter().map(|q| share * energy.gate.reach * q / norm(&bent)).collect();
            let (off, _, curved) = both(&q);
            let residual = residual_of(energy, &q, &off);
            println!("{name} at {share} of the training: residual {residual:.1e}, Hessian off by {curved:.1e}");
            // A stage leaves 1.5e-4.
            assert!(residual < 1.5e-5, "{name}, {share}: {residual:e}");
            // Of Q it has 8 bits behind the point: a Newton step leaves as much of the way, and the stage's stop counts ten times as much.
            assert!(curved < 4e-3, "{name}, {share}: {curved:e}");
        }
    }
}

/// Twice what rounding to 32 bits can have changed.
#[test]
fn equilibria_do_not_feel_the_last_bit_of_the_coefficients() {
    for (name, model) in shells() {
        let (energy, columns) = (polynomial_of(model), columns_of(model));
        let mut seed = 1u64;
        let mut nudged = |x: &mut f64| {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            assert_eq!(f64::from(*x as f32), *x);
            let x32 = *x as f32;
            *x = f64::from(if seed >> 63 == 0 { x32.next_up() } else { x32.next_down() });
        };
        let n = energy.n();
        let mut other = energy.coefficients();
        for form in &mut other.forms {
            for (i, j) in (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))) {
                nudged(&mut form.quadratic[(i, j)]);
                form.quadratic[(j, i)] = form.quadratic[(i, j)];
            }
        }
        for (i, j) in (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            for k in 0..=j {
                let mut x = other.cubic[i][(j, k)];
                nudged(&mut x);
                for [i, j, k] in [[i, j, k], [i, k, j], [j, i, k], [j, k, i], [k, i, j], [k, j, i]] {
                    other.cubic[i][(j, k)] = x;
                }
            }
        }
        let other = PolynomialEnergy::new(&other);
        let mut off: Vec<f64> = judging(model)
            .iter()
            .map(|(_, load)| {
                let [own, other] = [energy, &other].map(|energy| equilibrium(energy, &columns, load));
                error(&other, &own)
            })
            .collect();
        off.sort_by(f64::total_cmp);
        let (median, worst) = (off[off.len() / 2], off[off.len() - 1]);
        println!("{name}: equilibria move by {median:.1e}, at most {worst:.1e}");
        // A hundredth of what the polynomial itself is off by, 1 % and more; beside a snap a load may go either way.
        assert!(median < 1e-5 && off[off.len() * 3 / 4] < 1e-4, "{name}: {off:?}");
    }
}

/// Directions of the loads that equilibria are judged by, none of them trained: oblique gravity, a pull at a free vertex, and both.
fn judging(model: &Model) -> Vec<(String, Vec<Vec3>)> {
    let shell = &model.shell;
    let columns = columns_of(model);
    // The strength by which gravity moves the first mode by a quarter of the size, to first order.
    let effective = |k: usize| {
        let sum: Vec3 = columns[k].iter().zip(&shell.mass).map(|(u, m)| u * *m).sum();
        let largest = columns[k].iter().map(|u| u.norm()).fold(0.0, f64::max);
        sum.norm() * largest / model.modal.eigenvalues[k]
    };
    let gravity = 0.25 * shell.mesh.size / (0..8).map(effective).fold(0.0, f64::max);
    let total: f64 = shell.mass.iter().sum();
    let far = |to: Vec3| {
        *shell
            .free
            .iter()
            .max_by(|a, b| {
                let at = |v: u32| to.dot(&shell.mesh.positions[v as usize]);
                at(**a).total_cmp(&at(**b))
            })
            .unwrap() as usize
    };
    let mut loads = vec![];
    for (g, direction) in
        [Vec3::new(0.3, 0.8, 0.5), Vec3::new(-0.5, -0.5, 0.7), Vec3::new(0.05, 0.03, -1.0), Vec3::new(0.6, -0.75, -0.2)]
            .iter()
            .enumerate()
    {
        for strength in [0.4, 0.8] {
            let load: Vec<Vec3> = shell.mass.iter().map(|m| direction.normalize() * (strength * gravity * m)).collect();
            loads.push((format!("gravity {g} {strength}"), load));
        }
    }
    for (p, (place, direction)) in [
        (Vec3::new(1.0, 0.6, 0.0), Vec3::new(0.6, 0.5, -0.62)),
        (Vec3::new(0.7, -1.0, 0.0), Vec3::new(-0.55, 0.35, 0.75)),
    ]
    .iter()
    .enumerate()
    {
        for strength in [0.02, 0.04] {
            let mut load = vec![Vec3::zeros(); shell.mass.len()];
            load[far(*place)] = direction.normalize() * (strength * gravity * total);
            loads.push((format!("pull {p} {strength}"), load.clone()));
            load.iter_mut().zip(&shell.mass).for_each(|(f, m)| f[2] -= 0.3 * gravity * m);
            loads.push((format!("both {p} {strength}"), load));
        }
    }
    loads
}

fn equilibrium(energy: &dyn Elastic, columns: &[Vec<Vec3>], load: &[Vec3]) -> Vec<Vec3> {
    let n = columns.len();
    let (mut q, mut newton) = (vec![0.0; n], Newton::new(energy));
    let force: Vec<f64> = columns.iter().map(|b| b.iter().zip(load).map(|(b, f)| b.dot(f)).sum()).collect();
    for share in [0.25, 0.5, 0.75, 1.0] {
        let part: Vec<f64> = force.iter().map(|f| share * f).collect();
        newton.minimize(
            energy,
            &Potential::of_load(&part),
            &mut q,
            Stop { tolerance: 1e-7, iterations: 200, led: false, near: false, least: 0.0 },
        );
    }
    (0..load.len()).map(|v| (0..n).map(|k| q[k] * columns[k][v]).sum()).collect()
}

#[test]
fn equilibria_under_untrained_loads_are_as_near_to_the_shell_as_the_sampled_energys() {
    for (name, model) in shells() {
        let shell = &model.shell;
        let columns = columns_of(model);
        let mut errors = [vec![], vec![], vec![]];
        let mut solver = Solver::new(shell.clone()).unwrap();
        for (label, load) in judging(model) {
            let mut u = vec![Vec3::zeros(); load.len()];
            let mut found = true;
            for share in [0.25, 0.5, 0.75, 1.0] {
                let part: Vec<Vec3> = load.iter().map(|f| f * share).collect();
                match solver.equilibrium(&u, &part, &EquilibriumOptions::default(), &mut |_| Ok(())) {
                    Ok(end) => u = end.displacement,
                    Err(_) => found = false,
                }
            }
            if !found {
                println!("{name} {label}: no equilibrium of the shell");
                continue;
            }
            let mut warp = State::new(model.clone(), Method::Warp, Integrator::Exact).unwrap();
            warp.set_forces((0..).zip(load.iter().copied()), false).unwrap();
            warp.equilibrium().unwrap();
            let of = [
                equilibrium(polynomial_of(model), &columns, &load),
                equilibrium(&reduced_of(model).energy, &columns, &load),
                displacements(&warp),
            ];
            let own = [0, 1, 2].map(|k| mass_error(shell, &of[k], &u));
            let size = u.iter().map(|u| u.norm()).fold(0.0, f64::max) / shell.mesh.size;
            println!("{name} {label} ({size:.2}): polynomial {:.4}, sampled {:.4}, warp {:.4}", own[0], own[1], own[2]);
            (0..3).for_each(|k| errors[k].push(own[k]));
        }
        let median = errors.map(|mut list| {
            list.sort_by(f64::total_cmp);
            list[list.len() / 2]
        });
        println!("{name}: medians {median:.4?}");
        let [polynomial, sampled, warp] = median;
        // It leaves no hinge out. On the folded gutter, loads near a snap decide: precomputes on other registers give 3.4 to 3.8 % beside 3.4 to
        // 4.4 % by samples. Where it has a twentieth of the warp's error the samples' draw decides: on the cylinder they have 0.08 to 0.11 % for 0.11.
        assert!(polynomial <= f64::max(1.25 * sampled, 0.05 * warp), "{name}: {polynomial}, sampled {sampled}");
        assert!(polynomial <= 0.1 * warp, "{name}: {polynomial}, warp {warp}");
    }
}

/// Fields that hold every affine motion, and one that bends; on no shell that is held.
fn affine(shell: &Shell) -> Vec<Vec<Vec3>> {
    let x = &shell.mesh.positions;
    let field = |c: usize, of: &dyn Fn(&Vec3) -> f64| x.iter().map(|x| Vec3::ith(c, of(x))).collect::<Vec<_>>();
    let mut fields: Vec<_> = (0..9).map(|k| field(k / 3, &|x| x[k % 3])).collect();
    fields.push(field(2, &|x| x[0] * x[0]));
    fields
}

fn made(shell: &Shell, columns: &[Vec<Vec3>], assumed: &Assumed) -> PolynomialEnergy {
    let shapes: Vec<Vec<f64>> = (0..6).map(|s| bent(columns.len(), 0.1 + 0.1 * f64::from(s))).collect();
    let stiffness = DMatrix::zeros(columns.len(), columns.len()); // of none of these fields is it known
    let sources =
        Sources { shell, columns, modes: 0, assumed, shapes: &shapes, gains: 10_000_000, stiffness: &stiffness };
    make(&sources, &mut |_| Ok(())).unwrap().unwrap()
}

#[test]
fn turning_costs_nothing() {
    for (_, model) in shells().into_iter().filter(|(_, model)| model.shell.clamped.is_empty()) {
        let shell = &model.shell;
        let columns = affine(shell);
        let energy = made(shell, &columns, &Assumed::none());
        let mut scratch = energy.scratch();
        let mut bend = vec![0.0; 10];
        bend[9] = 0.1;
        let like = energy.value(&bend, &mut scratch);
        for angle in [0.1, 1.0, 3.0] {
            let turned =
                Rotation3::new(Vec3::new(0.3, -0.8, 0.5).normalize() * angle).into_inner() - Matrix3::identity();
            let q: Vec<f64> = (0..10).map(|k| if k < 9 { turned[(k / 3, k % 3)] } else { 0.0 }).collect();
            let cost = energy.value(&q, &mut scratch);
            println!("{angle} rad: {cost:.1e} of {like:.1e}");
            assert!(cost.abs() <= 1e-8 * like, "{angle} rad cost {cost:e} of {like:e}"); // rounding of 10⁴ w
        }
    }
}

/// A triangle in space with one beyond each side, folded by these angles more than at rest.
fn patch(rest: [f64; 3], more: [f64; 3]) -> Vec<Vec3> {
    let corners = [Vec3::new(0.0, 0.0, 0.0), Vec3::new(1.0, 0.1, 0.0), Vec3::new(0.35, 0.8, 0.0)];
    let beyond = [[0.45, 0.7], [0.6, 0.9], [0.4, 0.55]]; // foot and height
    let mut all = corners.to_vec();
    for k in 0..3 {
        let [a, b, c] = [corners[(k + 1) % 3], corners[(k + 2) % 3], corners[k]];
        let edge = b - a;
        let along = edge.normalize();
        let inward = (c - a) - along * (c - a).dot(&along);
        let out = -inward.normalize();
        let turned = Rotation3::new(along * (rest[k] + more[k])) * out;
        all.push(a + beyond[k][0] * edge + beyond[k][1] * turned);
    }
    all
}

#[test]
fn triangles_that_turn_about_their_sides_cost_what_the_shells_do() {
    let triangles = [[0, 1, 2], [2, 1, 3], [0, 2, 4], [1, 0, 5]];
    for (rest, order) in [([0.0; 3], 2.0), ([0.3, 0.5, -0.2], 1.0)] {
        let mesh = Mesh::new(patch(rest, [0.0; 3]), &triangles).unwrap();
        let shell = Shell::new(mesh, SHEET, &Supports::default()).unwrap();
        let columns: Vec<Vec<Vec3>> = (0..18)
            .map(|k| (0..6).map(|v| if v == k / 3 { Vec3::ith(k % 3, 1.0) } else { Vec3::zeros() }).collect())
            .collect();
        let energy = made(&shell, &columns, &Assumed::none());
        let miss = |scale: f64| {
            let x = patch(rest, [0.5, -0.3, 0.4].map(|angle| scale * angle));
            let q: Vec<f64> =
                x.iter().zip(&shell.mesh.positions).flat_map(|(x, y)| [0, 1, 2].map(|c| x[c] - y[c])).collect();
            let exact = shell.energy.value(&x);
            (energy.value(&q, &mut energy.scratch()) - exact) / exact
        };
        let [whole, half, quarter] = [1.0, 0.5, 0.25].map(miss);
        println!("{rest:?}: off by {whole:.2e}, {half:.2e} at half, {quarter:.2e} at a quarter of the angles");
        // Flat, what is left out is of fourth order in the angles, else of third.
        assert!((half / quarter).abs() > 0.8 * f64::powf(2.0, order), "{half:e}, {quarter:e}");
        assert!(quarter.abs() < 0.05, "{quarter:e}");
    }
}

#[test]
fn a_stress_field_meets_greens_strain_at_any_size() {
    let shell = &curved().shell;
    let (mesh, material) = (&shell.mesh, shell.material.discrete_shells().unwrap());
    let columns = affine(shell);
    for edge in [0, 7, mesh.edges.len() - 1] {
        let element = mesh.triangles.len() + edge;
        let stresses = DMatrix::from_fn(1, shell.energy.n_membrane(), |_, e| f64::from(u8::from(e == element)));
        let energy = made(shell, &columns, &Assumed { stresses, membrane_share: 0.0 });
        let q = bent(10, 0.7);
        let place = |v: u32| {
            let v = v as usize;
            mesh.positions[v] + (0..10).map(|k| q[k] * columns[k][v]).sum::<Vec3>()
        };
        let [a, b] = mesh.edges[edge].vertices;
        let length = (mesh.positions[b as usize] - mesh.positions[a as usize]).norm();
        let gain = (place(b) - place(a)).norm_squared() - length * length;
        let strain = (2.0 * material.k_length / length).sqrt() * gain / (2.0 * length);
        let expected = 0.5 * strain * strain;
        // Q has 32 bits, and s is a difference of terms some times as large.
        assert_close("membrane", energy.membrane(&q, &mut energy.scratch()), expected, 1e-6, 0.0);
    }
}

#[test]
fn the_gate_lets_it_pass_where_it_is_about_as_near_as_the_samples() {
    for (name, model) in with_leg() {
        let gate = polynomial_of(model).gate;
        println!("{name} {gate:?}");
        assert!(gate.tried > 20 && gate.reach > 0.0 && gate.strain > 0.0);
        // Of the folded sheet both miss about 3 % by median, and the draw of samples decides whether the polynomial misses 1.25 times as much.
        assert!(gate.holds() || name == "folded", "{gate:?}");
        assert!(gate.polynomial.median < 1.5 * gate.sampled.median, "{gate:?}");
        let chosen = match gate.holds() {
            true => Method::PolynomialShell,
            false if gate.holds_in_part() => Method::AdaptiveShell,
            false => Method::ReducedShell,
        };
        assert_eq!(model.chosen_method(), chosen);
    }
    assert!(!Gate::default().holds(), "nothing was tried");
}

#[test]
fn it_is_saved_with_its_model_and_checked() {
    for model in [cylinder(), leg()] {
        is_saved(model);
    }
}

fn is_saved(model: &Model) {
    let (bytes, energy) = (model.save().unwrap(), polynomial_of(model));
    let loaded = Model::load(&bytes).unwrap();
    let other = polynomial_of(&loaded);
    assert_eq!((other.gate, other.coefficients()), (energy.gate, energy.coefficients()));
    assert_eq!(loaded.save().unwrap(), bytes);
    let q = bent(energy.n(), 0.3);
    assert_eq!(energy.value(&q, &mut energy.scratch()), other.value(&q, &mut other.scratch()));
    let mut content = vec![];
    energy.save(&mut content);
    assert_eq!(content.len(), energy.saved_size());
    let f = |x: f64| x.to_le_bytes().to_vec();
    let cases: [(&str, usize, Vec<u8>, &str); 6] = [
        ("fields", 0, vec![17], "out of range"),
        ("forms", 4, vec![255, 255], "out of range"),
        ("membrane", 8, vec![255], "out of range"),
        ("weight", 64, f(-1.0), "not positive"),
        ("bound", 72, f(-1.0), "not positive"),
        ("number", 80, f(f64::NAN), "no number"),
    ];
    for (what, at, patch, named) in cases {
        let mut forged = content.clone();
        forged[at..at + patch.len()].copy_from_slice(&patch);
        let error = PolynomialEnergy::load(energy.n(), &forged).err().unwrap();
        assert!(error.message.contains(named), "{what}: {}", error.message);
    }
    let counts = energy.coefficients().engineering.is_some();
    let engineering = if counts { 8 * LEADING * LEADING * (LEADING + 1) / 2 } else { 0 };
    let before = content.len() - 8 - engineering; // of models saved before the range was known
    let gate = PolynomialEnergy::load(energy.n(), &content[..before]).unwrap().gate;
    assert_eq!(gate.range, if gate.holds() { gate.reach } else { 0.0 });
    let mut forged = content.clone();
    forged[before..before + 8].copy_from_slice(&f(-1.0));
    assert!(PolynomialEnergy::load(energy.n(), &forged).err().unwrap().message.contains("range"));
    if counts {
        let mut forged = content.clone();
        forged[before + 8..before + 16].copy_from_slice(&f(f64::INFINITY));
        assert!(PolynomialEnergy::load(energy.n(), &forged).err().unwrap().message.contains("no number"));
        forged = content.clone();
        forged[8] = LEADING as u8 - 1; // forms of the membrane
        assert!(PolynomialEnergy::load(energy.n(), &forged).err().unwrap().message.contains("too few"));
    }
    for end in [0, 15, content.len() - 16] {
        assert!(PolynomialEnergy::load(energy.n(), &content[..end]).is_err());
    }
}

#[test]
fn evaluation_does_not_allocate() {
    let energy = polynomial_of(cylinder());
    let (q, mut scratch) = (bent(energy.n(), 0.2), energy.scratch());
    let (mut gradient, mut hessian) = (q.clone(), DMatrix::zeros(q.len(), q.len()));
    let used = allocation_counter::measure(|| {
        energy.value(&q, &mut scratch);
        energy.gradient(&q, &mut scratch, &mut gradient);
        energy.hessian(&q, Curvature::Exact, &mut scratch, &mut hessian);
        energy.viscosity(&q, &mut scratch, &mut hessian);
    });
    assert_eq!(used.count_total, 0);
}

fn moving(model: &Arc<Model>, method: Method) -> State {
    let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
    state.set_gravity(Vec3::new(0.0, 0.06, -0.08) * model.modal.eigenvalues[0] * model.shell.mesh.size).unwrap();
    state
}

/// Stages of steps of 1/60 s, each from where the rates lead, under a load that turns over twice a second.
#[test]
fn stages_that_end_without_a_look_are_balanced_to_what_they_say() {
    const TOLERANCE: f64 = 1.5e-4;
    for (name, model) in with_leg() {
        let (reduced, energy) = (reduced_of(model), polynomial_of(model));
        let n = energy.n();
        let (mut newton, mut scratch) = (Newton::new(energy), energy.scratch());
        let [mut q, mut rates, mut force, mut gradient] = [(); 4].map(|()| vec![0.0; n]);
        let strength = 0.15 * model.modal.eigenvalues[0] * model.shell.mesh.size;
        reduced.add_uniform(&(Vec3::new(0.1, 0.3, -1.0) * strength), &mut force);
        let tau = (1.0 - 0.5f64.sqrt()) / 60.0;
        let shift = tau.powi(-2);
        let (mut taken, mut beyond, mut worst, mut most) = (0, 0, 0.0f64, 0.0f64);
        for k in 0..600 {
            let sign = if k / 100 % 2 == 0 { 1.0 } else { -1.0 };
            let mut next: Vec<f64> = (0..n).map(|i| q[i] + tau * rates[i]).collect();
            let load: Vec<f64> = (0..n).map(|i| sign * force[i] + shift * next[i]).collect();
            let potential = Potential { shift, ..Potential::of_load(&load) };
            if let Some(end) = newton.approach(energy, &potential, &mut next, (TOLERANCE, false)) {
                taken += 1;
                energy.gradient(&next, &mut scratch, &mut gradient);
                let mut hessian = DMatrix::zeros(n, n);
                energy.hessian(&next, Curvature::Exact, &mut scratch, &mut hessian);
                let scale: f64 = (0..n).map(|i| (next[i] * gradient[i]).abs() + (next[i] * load[i]).abs()).sum();
                (0..n).for_each(|i| hessian[(i, i)] += shift);
                let off = DVector::from_fn(n, |i, _| gradient[i] + shift * next[i] - load[i]);
                let left = (hessian.cholesky().unwrap().solve(&off).dot(&off) / scale).sqrt();
                worst = worst.max(left);
                beyond += usize::from(left > TOLERANCE);
                assert!(end.converged && end.residual <= TOLERANCE);
            } else {
                let stop = Stop { tolerance: 1e-9, iterations: 60, led: false, near: false, least: 0.0 };
                newton.minimize(energy, &potential, &mut next, stop);
            }
            rates = (0..n).map(|i| (next[i] - q[i]) / tau).collect();
            q = next;
            most = most.max(q.iter().map(|q| q * q).sum::<f64>().sqrt());
        }
        println!(
            "{name}: {taken} of 600 stages, at most {worst:.1e} left, {beyond} more than they say, up to {:.2} of the training",
            most / energy.gate.reach
        );
        // What they say is an estimate; where a gutter folds, it is five times off.
        assert!(worst <= 10.0 * TOLERANCE && beyond <= 30, "{name}: {worst:e}, {beyond} beyond");
        assert!(taken > 480, "{name}: {taken}");
    }
}

#[test]
fn a_state_moves_by_it_as_by_the_samples() {
    for (name, model) in [("curved", curved()), ("cylinder", cylinder())] {
        let paths = [Method::PolynomialShell, Method::ReducedShell, Method::Warp].map(|method| {
            let mut state = moving(model, method);
            (0..60)
                .map(|_| {
                    state.step(1.0 / 60.0).unwrap();
                    displacements(&state)
                })
                .collect::<Vec<_>>()
                .concat()
        });
        let [own, warp] = [0, 2].map(|k| error(&paths[k], &paths[1]));
        let size = paths[1].iter().map(|u| u.norm()).fold(0.0, f64::max) / model.shell.mesh.size;
        println!("{name} moves by {size:.2}: polynomial {own:.3}, warp {warp:.3} off the samples' path");
        assert!(own < 0.1 && own < 0.5 * warp, "{name}: {own} and {warp}"); // the samples' own error at rest is 1 %
    }
}

#[test]
fn a_step_does_not_allocate_and_goes_on_with_the_same_bits() {
    let damping = Damping { stiffness_coefficient: 0.01, ..Damping::default() };
    let mut state = moving(cylinder(), Method::PolynomialShell);
    state.set_damping(&damping).unwrap();
    (0..3).for_each(|_| state.step(0.01).unwrap());
    let used = allocation_counter::measure(|| state.step(0.01).unwrap());
    assert_eq!(used.count_total, 0);
    let saved = state.save();
    let again = Arc::new(Model::load(&cylinder().save().unwrap()).unwrap());
    assert_eq!(polynomial_of(&again).coefficients(), polynomial_of(cylinder()).coefficients());
    let mut other = moving(&again, Method::PolynomialShell);
    other.set_damping(&damping).unwrap();
    other.load(&saved).unwrap();
    for state in [&mut state, &mut other] {
        state.step(0.01).unwrap();
    }
    assert_eq!(displacements(&state), displacements(&other));
}

#[test]
fn a_released_shell_gains_no_energy() {
    for (_, model) in shells() {
        let mut state = moving(model, Method::PolynomialShell);
        (0..20).for_each(|_| state.step(1.0 / 60.0).unwrap());
        state.set_gravity(Vec3::zeros()).unwrap();
        let energy = |state: &State| {
            let report = state.report();
            report.elastic_energy + report.kinetic_energy
        };
        let (mut last, first) = (energy(&state), energy(&state));
        for _ in 0..120 {
            state.step(1.0 / 60.0).unwrap();
            let now = energy(&state);
            assert!(now <= last + 1e-2 * first, "{last:e} became {now:e}"); // the integrator's own error
            last = now;
        }
        assert!(last <= first);
    }
}

#[test]
fn a_model_that_was_saved_without_it_says_so() {
    let mut model = Model::load(&cylinder().save().unwrap()).unwrap();
    let mut reduced = model.reduced.take().and_then(Arc::into_inner).unwrap();
    reduced.polynomial = None;
    model.reduced = Some(Arc::new(reduced));
    let bytes = model.save().unwrap();
    let model = Arc::new(Model::load(&bytes).unwrap());
    let error = State::new(model.clone(), Method::PolynomialShell, Integrator::Exact).err().unwrap();
    assert!(error.message.contains("has no polynomial energy"), "{error}");
    State::new(model, Method::ReducedShell, Integrator::Exact).unwrap();
}

#[test]
fn wild_loads_never_run_away() {
    for (name, model) in with_leg() {
        let unit = model.modal.eigenvalues[0] * model.shell.mesh.size;
        let mut state = State::new(model.clone(), Method::PolynomialShell, Integrator::Exact).unwrap();
        let (mut furthest, mut seed) = (0.0f64, 1u64);
        let mut random = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        for k in 0..6000 {
            if k % 7 == 0 {
                // Up to thirty times what bends it by a size to first order, in any direction; nothing for a while.
                let strength = if k % 5 == 0 { 0.0 } else { 10f64.powf(1.5 * random()) };
                state.set_gravity(Vec3::new(random(), random(), random()) * (strength * unit)).unwrap();
            }
            state.step(1.0 / 60.0).unwrap();
            if k % 10 == 0 {
                let largest = displacements(&state).iter().map(|u| u.norm()).fold(0.0, f64::max);
                furthest = furthest.max(largest / model.shell.mesh.size);
            }
        }
        state.set_gravity(Vec3::zeros()).unwrap();
        state
            .set_damping(&Damping { mass_coefficient: 2.0 * model.modal.eigenvalues[0].sqrt(), ..Damping::default() })
            .unwrap();
        // Its slowest swing comes to rest by e⁻¹⁰⁰; from far away it first takes a while to come back.
        let seconds = 100.0 / model.modal.eigenvalues[0].sqrt();
        (0..(60.0 * seconds) as usize).for_each(|_| state.step(1.0 / 60.0).unwrap());
        let left = displacements(&state).iter().map(|u| u.norm()).fold(0.0, f64::max) / model.shell.mesh.size;
        println!(
            "{name}: at most {furthest:.2} of its size, {} short steps; {left:.1e} after it was let go",
            state.report().unconverged_steps
        );
        // It spans one or two sizes; edges resist from there on. At rest all is given back, unless the shell has another shape to rest in: a
        // sharp gutter that is bent far enough stays bent, the full one too, if not as far.
        // A shape that the polynomial alone holds is told by the certificate. The limp leg goes to 2.8 by its samples, too. Whether it comes to rest straight or crumpled is up to rounding; the full one stays crumpled, too.
        assert!(furthest < if name == "leg" { 3.5 } else { 3.0 }, "{name}: {furthest}");
        if left >= 1e-9 {
            let mut full = state.try_clone().unwrap();
            full.set_method(Method::ImplicitShell).unwrap();
            full.equilibrium().unwrap();
            let stays = displacements(&full).iter().map(|u| u.norm()).fold(0.0, f64::max) / model.shell.mesh.size;
            let as_far = ["folded", "Koiter's gutter", "leg"].contains(&name) || (left - stays).abs() < 0.05;
            let certified = state.certify();
            let told = certified.as_ref().is_ok_and(|found| found.error > 0.1);
            assert!((stays > 0.1 && as_far) || told, "{name}: {left}, the full shell {stays}, {certified:?}");
        }
    }
}
