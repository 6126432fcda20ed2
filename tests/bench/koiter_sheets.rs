//! More of what Koiter's energy is measured by: a far bent cantilever at every load, orthotropic plates, a crease, and what a precompute costs.

use super::common;
use super::plates::{FAMILIES, Family, Sheet, rectangle};
use super::{Elasticity, Mesh, Shell, Supports, Vec3, name, paper_of_beam};
use nalgebra::UnitQuaternion;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::material::{Crease, ElasticSheet, Fibres};
use shellwarp::model::{Model, Options};
use shellwarp::modes::Phase;
use shellwarp::reference::{EquilibriumOptions, Solver};
use shellwarp::shell::Make;
use shellwarp::state::{Method, Space, State};
use shellwarp::step::Integrator;
use std::f64::consts::PI;
use std::sync::Arc;
use std::time::Instant;

/// Of Sze, Liu, Lo (2004), table of 3.1: P/4, the end's shortening and its rise.
const SZE_3_1: [[f64; 3]; 20] = [
    [0.05, 0.026, 0.663],
    [0.10, 0.103, 1.309],
    [0.15, 0.224, 1.922],
    [0.20, 0.381, 2.493],
    [0.25, 0.563, 3.015],
    [0.30, 0.763, 3.488],
    [0.35, 0.971, 3.912],
    [0.40, 1.184, 4.292],
    [0.45, 1.396, 4.631],
    [0.50, 1.604, 4.933],
    [0.55, 1.807, 5.202],
    [0.60, 2.002, 5.444],
    [0.65, 2.190, 5.660],
    [0.70, 2.370, 5.855],
    [0.75, 2.541, 6.031],
    [0.80, 2.705, 6.190],
    [0.85, 2.861, 6.335],
    [0.90, 3.010, 6.467],
    [0.95, 3.151, 6.588],
    [1.00, 3.286, 6.698],
];

fn clamped(sheet: &(Vec<Vec3>, Vec<[u32; 3]>)) -> Supports {
    Supports {
        fixed: vec![],
        clamped: (0..sheet.0.len() as u32).filter(|v| sheet.0[*v as usize].x < 1e-9).collect(),
        ..Default::default()
    }
}

fn made(sheet: (Vec<Vec3>, Vec<[u32; 3]>), make: Make, supports: Supports) -> Shell {
    let mesh = Mesh::new(sheet.0, &sheet.1).expect("the sheets are manifolds");
    Shell::made(mesh, make, &supports).expect("the sheets have mass")
}

/// A force on the end x = `length`, spread by the lengths that its vertices stand for; and these.
fn end_load(shell: &Shell, length: f64, force: f64) -> (Vec<Vec3>, Vec<usize>) {
    let x = &shell.mesh.positions;
    let at_end = |v: usize| x[v].x > length * (1.0 - 1e-9);
    let ends: Vec<[usize; 2]> = shell.mesh.edges.iter().map(|e| e.vertices.map(|v| v as usize)).collect();
    let ends: Vec<[usize; 2]> = ends.into_iter().filter(|[a, b]| at_end(*a) && at_end(*b)).collect();
    let width: f64 = ends.iter().map(|[a, b]| (x[*a] - x[*b]).norm()).sum();
    let mut load = vec![Vec3::zeros(); x.len()];
    for [a, b] in &ends {
        let share = 0.5 * force * (x[*a] - x[*b]).norm() / width;
        [a, b].iter().for_each(|v| load[**v].z += share);
    }
    (load, (0..x.len()).filter(|v| at_end(*v)).collect())
}

fn mean_of(u: &[Vec3], end: &[usize]) -> Vec3 {
    end.iter().map(|v| u[*v]).sum::<Vec3>() / end.len() as f64
}

/// Where the end goes at every load, against the table.
fn sze_3_1() {
    println!("## The same cantilever at all twenty loads\n");
    println!(
        "The largest difference from the reference's table, P from 0.2 to 4, over the largest displacement along (3.286) and across (6.698), percent.\n"
    );
    println!("| mesh | cells | along | across | the paper's along | across |\n|---|---|---|---|---|---|");
    let sheet = ElasticSheet { young: 1.2e6, poisson: 0.0, thickness: 0.1, volume_density: 1.0 };
    for (family, n) in FAMILIES.into_iter().flat_map(|family| [20, 40].map(|n| (family, n))) {
        let off = |material: Elasticity| {
            let mesh = rectangle(family, n, 10.0, 1.0);
            let supports = clamped(&mesh);
            let shell = Arc::new(made(mesh, Make::of(material), supports));
            let mut solver = Solver::new(shell.clone()).expect("the beam is held");
            let mut u = vec![Vec3::zeros(); shell.mass.len()];
            let mut worst = [0.0f64; 2];
            for [share, along, across] in SZE_3_1 {
                let (load, end) = end_load(&shell, 10.0, 4.0 * share);
                let found = solver.equilibrium(&u, &load, &EquilibriumOptions::default(), &mut |_| Ok(()));
                let Ok(found) = found else { return [f64::NAN; 2] };
                u = found.displacement;
                let tip = mean_of(&u, &end);
                worst = [worst[0].max((-tip.x - along).abs() / 3.286), worst[1].max((tip.z - across).abs() / 6.698)];
            }
            worst.map(|off| 100.0 * off)
        };
        let [[a, b], [c, d]] = [sheet.into(), paper_of_beam(10.0 / n as f64, &sheet).into()].map(off);
        println!("| {} | {n} | {a:.2} | {b:.2} | {c:.2} | {d:.2} |", name(family));
    }
    println!();
}

/// Length of the cantilever of 3.2, and the moment by which it is a circle.
const ROLLED: f64 = 12.0;
const FULL_MOMENT: f64 = 50.0 * PI / 3.0;

/// Where the end goes under an end moment, against the circle's arc. The vertices of the end are turned, and the moment is what holds them so.
fn sze_3_2() {
    println!("## A cantilever under an end moment, rolled up to a circle\n");
    println!(
        "Sze, Liu, Lo (2004), 3.2: 12 by 1 by 0.1, E = 1.2e6, ν = 0, the moment M from 0.05 to 1 times 50π/3, which rolls it up to a whole circle. The exact solution is an arc of"
    );
    println!(
        "φ = M L/(E I): the end is at L sin φ/φ along and L (1 − cos φ)/φ across. The vertices of the end are turned about the width until what holds them is M. It enters over the last"
    );
    println!(
        "cell: of second order for where the end is. \"Along\" and \"across\": the largest difference at twenty moments over the largest displacement along (12) and across (8.695), percent. \"Open\": the distance"
    );
    println!("of the end from the clamp at M = 50π/3 over the length, which is 0 by the exact solution.\n");
    println!(
        "| mesh | cells | along | across | open | the paper's along | across | open |\n|---|---|---|---|---|---|---|---|"
    );
    let sheet = ElasticSheet { young: 1.2e6, poisson: 0.0, thickness: 0.1, volume_density: 1.0 };
    for (family, n) in FAMILIES.into_iter().flat_map(|family| [24, 48].map(|n| (family, n))) {
        let paper = paper_of_beam(ROLLED / n as f64, &sheet).into();
        let row = [sheet.into(), paper].map(|material| rolled_up(family, n, material));
        let [[a, b, c], [d, e, f]] = row.map(|off| off.map(|off| format!("{off:.2}")));
        println!("| {} | {n} | {a} | {b} | {c} | {d} | {e} | {f} |", name(family));
    }
    println!();
}

/// The differences along and across and what is open, percent; no numbers where no equilibrium is found.
fn rolled_up(family: Family, n: usize, material: Elasticity) -> [f64; 3] {
    let mesh = rectangle(family, n, ROLLED, 1.0);
    let supports = clamped(&mesh);
    let shell = Arc::new(made(mesh, Make::of(material), supports));
    let end: Vec<usize> =
        (0..shell.mass.len()).filter(|v| shell.mesh.positions[*v].x > ROLLED * (1.0 - 1e-9)).collect();
    let options = Options { modes: 2, ..Options::default() };
    let model = Arc::new(Model::precompute(shell, &options, &mut |_, _| Ok(())).expect("the beam swings"));
    let mut state = State::new(model, Method::ImplicitShell, Integrator::Exact).expect("the full shell is built in");
    let (mut worst, mut open, mut turn_by_moment) = ([0.0f64; 2], f64::NAN, f64::NAN);
    for k in 1..=20 {
        let moment = FULL_MOMENT * f64::from(k) / 20.0;
        let phi = moment * ROLLED / 100.0; // E I = 100
        let mut turn = if turn_by_moment.is_finite() { turn_by_moment * moment } else { phi };
        for _ in 0..4 {
            let Some(found) = moment_of(&mut state, &end, turn) else { return [f64::NAN; 3] };
            turn_by_moment = turn / found;
            if (found / moment - 1.0).abs() < 1e-6 {
                break;
            }
            turn = turn_by_moment * moment;
        }
        let mut tip = Vec3::zeros();
        state.positions(Space::World, |v, x| tip += if end.contains(&v) { x } else { Vec3::zeros() });
        tip /= end.len() as f64;
        let exact = [ROLLED * phi.sin() / phi, ROLLED * (1.0 - phi.cos()) / phi];
        worst = [worst[0].max((tip.x - exact[0]).abs() / 12.0), worst[1].max((tip.z.abs() - exact[1]).abs() / 8.695)];
        open = libm::hypot(tip.x, tip.z) / ROLLED;
    }
    [worst[0], worst[1], open].map(|off| 100.0 * off)
}

/// The moment about the width that turns the vertices of the end so far.
fn moment_of(state: &mut State, end: &[usize], turn: f64) -> Option<f64> {
    for v in end {
        let target = Target::Orientation(UnitQuaternion::from_axis_angle(&Vec3::y_axis(), -turn));
        let held = Constraint { id: *v as u32, vertex: *v as u32, axes: [false, true, false], compliance: 0.0, target };
        state.set_constraint(held).ok()?;
    }
    state.equilibrium().ok()?;
    Some(state.constraints().map(|(_, outcome)| -outcome.force.y).sum())
}

/// A supported plate that is stiffer along x, or along a diagonal of a strip.
fn orthotropic() {
    println!("## Orthotropic plates\n");
    println!(
        "Errors in percent of the four lowest frequencies of a square plate of E₁/E₂ = 12, E₁/G = 15, ν₁₂ = 0.4, simply supported, with E₁ along x: the closed form is"
    );
    println!(
        "ω² = π⁴ (D₁m⁴ + 2H m²n² + D₂n⁴)/(ρh), H = ν₁₂D₂ + G h³/6. The strip, 40 long and 1 wide, is the same sheet cut at an angle and clamped. Its lowest frequency is set against that of"
    );
    println!(
        "a beam of 1/E = c⁴/E₁ + (1/G − 2ν₁₂/E₁) c²s² + s⁴/E₂, whose clamp does not hold the twist: 160 cells along it. `tests/energy/orthotropy.rs`.\n"
    );
    println!("| mesh | 8 cells | 16 | 32 | strip at 0° | 30° | 45° | 90° |\n|---|---|---|---|---|---|---|---|");
    let sheet = ElasticSheet { young: 1.0, poisson: 0.4, thickness: 1e-3, volume_density: 1.0 };
    let (across, shear) = (1.0 / 12.0, 1.0 / 15.0);
    let make = |angle: f64| {
        let directions = vec![Vec3::new(angle.cos(), angle.sin(), 0.0)];
        Make { fibres: Some(Fibres { across, shear, directions }), ..Make::of(sheet) }
    };
    let unit = sheet.thickness.powi(3) / 12.0;
    let first = unit / (1.0 - sheet.poisson * sheet.poisson * across);
    let mixed = sheet.poisson * across * first + 2.0 * shear * unit;
    let squared = |m: i32, n: i32| {
        let [m, n] = [m, n].map(f64::from);
        PI.powi(4) * (first * m.powi(4) + 2.0 * mixed * (m * n).powi(2) + across * first * n.powi(4))
            / sheet.area_density()
    };
    let mut exact: Vec<f64> = (1..6).flat_map(|m| (1..6).map(move |n| squared(m, n))).map(f64::sqrt).collect();
    exact.sort_by(f64::total_cmp);
    for family in FAMILIES {
        let plates = [8, 16, 32].map(|n| {
            let square = rectangle(family, n, 1.0, 1.0);
            let at_edge = |x: &Vec3| x.x.min(x.y).min(1.0 - x.x).min(1.0 - x.y) < 1e-9;
            let fixed = (0..square.0.len() as u32).filter(|v| at_edge(&square.0[*v as usize])).collect();
            let shell = made(square, make(0.0), Supports { fixed, clamped: vec![], ..Default::default() });
            super::percent(&super::frequencies(&shell, sheet.area_density(), 4), &exact)
        });
        let strips = [0.0f64, 30.0, 45.0, 90.0].map(|degrees| {
            let strip = rectangle(family, 160, 40.0, 1.0);
            let supports = clamped(&strip);
            let shell = made(strip, make(degrees.to_radians()), supports);
            let (c, s) = (degrees.to_radians().cos().powi(2), degrees.to_radians().sin().powi(2));
            let compliance = c * c + (1.0 / shear - 2.0 * sheet.poisson) * c * s + s * s / across;
            let beam = (1.875_104_068_7 / 40.0f64).powi(2) * (sheet.thickness.powi(2) / (12.0 * compliance)).sqrt();
            super::percent(&super::frequencies(&shell, sheet.area_density(), 1), &[beam])
        });
        println!("| {} | {} | {} |", name(family), plates.join(" | "), strips.join(" | "));
    }
    println!();
}

/// What a fold across a strip's middle adds to how far its end sinks.
fn crease() {
    println!("## A crease\n");
    println!(
        "A strip of 1 by 0.1, clamped, with a fold across its middle of a factor of the sheet's own stiffness, under a small force at its end. Against the same strip without"
    );
    println!(
        "the fold and a rotational spring of the factor times D/(a cell's length): error of the end's displacement, percent. ν = 0, 20 cells along.\n"
    );
    println!("| mesh | factor 0.01 | 0.1 | 0.5 | 4 |\n|---|---|---|---|---|");
    let sheet = ElasticSheet { young: 1e6, poisson: 0.0, thickness: 0.01, volume_density: 20.0 };
    let rigidity = sheet.stiffness()[1];
    for family in [Family::Diagonal, Family::UnionJack] {
        let strip = || rectangle(family, 20, 1.0, 0.1);
        let sinks = |creases: Vec<Crease>| {
            let supports = clamped(&strip());
            let shell = Arc::new(made(strip(), Make { creases, ..Make::of(sheet) }, supports));
            let (load, end) = end_load(&shell, 1.0, 1e-5 * rigidity);
            let options = EquilibriumOptions { tolerance: 1e-9, ..Default::default() };
            let mut solver = Solver::new(shell).expect("the strip is held");
            let found = solver.equilibrium(&vec![Vec3::zeros(); load.len()], &load, &options, &mut |_| Ok(()));
            found.map_or(f64::NAN, |found| mean_of(&found.displacement, &end).z)
        };
        let plain = sinks(vec![]);
        let mesh = Mesh::new(strip().0, &strip().1).expect("it is a manifold");
        let middle = |v: &u32| (mesh.positions[*v as usize].x - 0.5).abs() < 1e-9;
        let folds = mesh.edges.iter().map(|e| e.vertices).filter(|ends| ends.iter().all(middle));
        let folds: Vec<[u32; 2]> = folds.collect();
        let row = [0.01, 0.1, 0.5, 4.0].map(|factor: f64| {
            let creases = folds
                .iter()
                .map(|vertices| Crease { vertices: *vertices, factor, angle: None, yield_angle: f64::INFINITY })
                .collect();
            let more = 1e-5 * 0.25 * 0.05 * (1.0 / factor - 1.0) / 0.1;
            format!("{:.2}", 100.0 * (sinks(creases) / (plain + more) - 1.0))
        });
        println!("| {} | {} |", name(family), row.join(" | "));
    }
    println!();
}

/// The time of a precompute over that of the paper's energy: the least of several, taken by turns.
fn cost() {
    println!("## Cost of a precompute\n");
    println!(
        "Seconds for 16 modes of a square that is clamped on one side, over those of the paper's energy on the same mesh; the least of seven runs, by turns, in one process.\n"
    );
    println!("| mesh | vertices | the paper's, s | Koiter's, s | ratio |\n|---|---|---|---|---|");
    let sheet = ElasticSheet { young: 1e6, poisson: 0.3, thickness: 1e-2, volume_density: 1.0 };
    let paper =
        shellwarp::Material { k_area: 2.5e3, k_length: 1e2, k_bend: 1e6 * 1e-6 / 12.0 / 6.0, area_density: 1e-2 };
    for family in FAMILIES {
        let square = rectangle(family, 48, 1.0, 1.0);
        let shells = [Elasticity::from(paper), sheet.into()].map(|material| {
            let supports = clamped(&square);
            Arc::new(made(square.clone(), Make::of(material), supports))
        });
        let mut least = [f64::MAX; 2];
        for _ in 0..7 {
            for (least, shell) in least.iter_mut().zip(&shells) {
                let options = Options { modes: 16, ..Options::default() };
                let fresh = Arc::new(made(square.clone(), Make::of(shell.material), clamped(&square)));
                let start = Instant::now();
                Model::precompute(fresh, &options, &mut |_, _| Ok(())).expect("the sheet swings");
                *least = least.min(start.elapsed().as_secs_f64());
            }
        }
        let [p, k] = least;
        println!("| {} | {} | {p:.3} | {k:.3} | {:.2} |", name(family), square.0.len(), k / p);
    }
    println!();
}

/// Microseconds of a step of a leaf that swings under gravity: the median of a hundred, and the least of three such, by turns.
fn step_time(state: &mut State) -> f64 {
    let mut times: Vec<f64> = (0..100)
        .map(|_| {
            let start = Instant::now();
            state.step(1.0 / 60.0).expect("a step");
            1e6 * start.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[50]
}

/// What a step costs by each method, over that by the paper's energy.
pub fn cost_of_a_step() {
    println!("## Cost of a step\n");
    println!(
        "A square arched along and across, of squares cut along both diagonals by turns, clamped on one side, 16 modes and 24 fields: microseconds of a step by the paper's energy and by"
    );
    println!(
        "Koiter's, both in the same swing under gravity; the median of a hundred steps, the least of three runs, by turns. Modal methods and the polynomial read what they are made of, whatever"
    );
    println!("energy that was; the reduced and the full shell evaluate the energy.\n");
    println!("| method | the paper's, µs | Koiter's, µs | ratio |\n|---|---|---|---|");
    let models = arched_pair(Family::UnionJack, 12).map(|(square, material)| {
        let fresh = Arc::new(made(square.clone(), Make::of(material), clamped(&square)));
        let reduced = shellwarp::reduced::Options { fields: 24, ..Default::default() };
        let options = Options { modes: 16, reduced, ..Options::default() };
        Arc::new(Model::precompute(fresh, &options, &mut |_, _| Ok(())).expect("the sheet is trained"))
    });
    let methods = [
        ("warp", Method::Warp),
        ("rotation–strain", Method::RotationStrain),
        ("polynomial shell", Method::PolynomialShell),
        ("reduced shell", Method::ReducedShell),
        ("full shell, implicit", Method::ImplicitShell),
    ];
    for (name, method) in methods {
        let mut least = [f64::MAX; 2];
        for _ in 0..3 {
            for (least, model) in least.iter_mut().zip(&models) {
                let mut state =
                    State::new(model.clone(), method, Integrator::ImplicitEuler).expect("the model has all");
                state.set_gravity(Vec3::new(0.0, 0.0, -9.8)).expect("gravity is finite");
                *least = least.min(step_time(&mut state));
            }
        }
        let [p, k] = least;
        println!("| {name} | {p:.1} | {k:.1} | {:.2} |", k / p);
    }
    println!();
}

/// A square arched along and across, with the constants by both energies of the same sheet.
fn arched_pair(family: Family, n: usize) -> [(Sheet, Elasticity); 2] {
    let (mut positions, triangles) = rectangle(family, n, 1.0, 1.0);
    positions.iter_mut().for_each(|x| x.z = 0.4 * x.x * (1.0 - x.x) + 0.3 * (x.y - 0.5).powi(2));
    pair((positions, triangles), 1.0 / n as f64)
}

/// A mesh of such edges, with the constants by both energies of the same sheet.
fn pair(mesh: Sheet, edge: f64) -> [(Sheet, Elasticity); 2] {
    let sheet = ElasticSheet { young: 1e6, poisson: 0.3, thickness: 1e-2, volume_density: 1.0 };
    let paper = shellwarp::Material {
        k_area: 2.5e3,
        k_length: 0.25 * 3f64.sqrt() * edge * 1e4,
        k_bend: 1.0 / 12.0 / 6.0 / (1.0 - 0.09),
        area_density: 1e-2,
    };
    [(mesh.clone(), paper.into()), (mesh, sheet.into())]
}

/// Positions and triangles of a shell.
fn bare(shell: &Shell) -> Sheet {
    (shell.mesh.positions.clone(), shell.mesh.triangles.clone())
}

/// The stages of a training, and the share of its progress at which each ends.
const STAGES: [(f64, &str); 4] =
    [(0.6, "equilibria and fields"), (0.7, "poses"), (0.9, "samples"), (1.0, "polynomial")];

/// What is held on each mesh of this section: the end of a leaf, one side of the others.
const HELD: f64 = 0.01;
/// That of hosts.
const FIELDS: usize = 40;

/// What this process has taken so far on all threads, to a hundredth, so that other work on the machine counts little. Of Linux.
fn processor_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    after_name.split_whitespace().skip(11).take(2).map(|ticks| ticks.parse::<f64>().unwrap_or(f64::NAN) / 100.0).sum()
}

/// Processor seconds of a precompute with a reduced shell, of each stage and of all, and how many elements it samples.
fn training_time(square: &Sheet, material: Elasticity, fields: usize) -> ([f64; 5], usize) {
    let held = (0..square.0.len() as u32).filter(|v| square.0[*v as usize].x < HELD).collect();
    let supports = Supports { clamped: held, ..Default::default() };
    let fresh = Arc::new(made(square.clone(), Make::of(material), supports));
    let reduced = shellwarp::reduced::Options { fields, ..Default::default() };
    let options = Options { modes: 16, reduced, ..Options::default() };
    let start = processor_seconds();
    let (mut seconds, mut last) = ([0.0; 5], 0.0);
    let mut watch = |phase: Phase, share: f64| {
        let now = processor_seconds() - start;
        let stage = STAGES.iter().position(|(end, _)| share <= *end).unwrap_or(STAGES.len() - 1);
        if phase == Phase::Training {
            seconds[stage] += now - last;
        }
        last = now;
        Ok(())
    };
    let model = Model::precompute(fresh, &options, &mut watch).expect("the sheet is trained");
    seconds[4] = processor_seconds() - start;
    (seconds, model.reduced.as_ref().map_or(0, |reduced| reduced.energy.n_elements()))
}

/// The same of a precompute with a reduced shell, and where it goes.
pub fn cost_of_training() {
    println!("## Cost of a precompute with a reduced shell\n");
    println!(
        "A leaf of two sizes, a card, and the square arched along and across, clamped at one end, with 40 fields as in hosts, polynomial and all; the least of three runs, by turns. Where the time goes:"
    );
    println!(
        "processor seconds by the paper's energy and by Koiter's. Both sample as many elements as leave 1 % of the forces, and 16 a field or mode at most.\n"
    );
    println!("| mesh | vertices | ratio | all | {} | elements |", STAGES.map(|(_, name)| name).join(" | "));
    println!("|---|---|---|---|---|---|---|---|---|");
    let (leaf, fine) = (bare(&common::leaf(1)), bare(&common::leaf(2)));
    let card = rectangle(Family::Equilateral, 16, 1.6, 1.0);
    let meshes = [
        ("leaf", pair(leaf, 0.05)),
        ("card", pair(card, 0.0625)),
        ("equilateral", arched_pair(Family::Equilateral, 24)),
        ("union jack", arched_pair(Family::UnionJack, 24)),
        ("finer leaf", pair(fine, 0.025)),
    ];
    for (name, pair) in meshes {
        let mut least = [[f64::MAX; 5]; 2];
        let mut elements = [0; 2];
        for _ in 0..3 {
            for (k, (square, material)) in pair.iter().enumerate() {
                let (seconds, count) = training_time(square, *material, FIELDS);
                elements[k] = count;
                if seconds[4] < least[k][4] {
                    least[k] = seconds;
                }
            }
        }
        let [p, k] = least;
        let stages = [4, 0, 1, 2, 3].map(|s| format!("{:.2}, {:.2}", p[s], k[s])).join(" | ");
        let [a, b] = elements;
        println!("| {name} | {} | {:.2} | {stages} | {a}, {b} |", pair[0].0.0.len(), k[4] / p[4]);
    }
    println!(
        "\nSamples are nonnegative least squares on the forces of all elements at all poses: six elements a triangle by Koiter's energy, four by the paper's. Poses are searches with the"
    );
    println!(
        "energy of all elements. The ratio is largest where the paper's energy leaves 1 % with fewer elements than Koiter's. The goal is 1.6.\n"
    );
}

/// Prints the sections.
pub fn print() {
    sze_3_1();
    sze_3_2();
    orthotropic();
    crease();
    cost();
    cost_of_a_step();
    cost_of_training();
}
