//! The nonlinear solver against independent equilibria, closed forms, itself at other steps, and conservation laws.

use crate::common::*;
use rand::{Rng, SeedableRng, rngs::StdRng};
use shellwarp::reference::{Equilibrium, EquilibriumOptions, Rayleigh, Solver};
use shellwarp::step::{Integrator, Oscillator};
use shellwarp::{Error, ErrorKind, Material, Mesh, Shell, Supports, Vec3};
use std::sync::Arc;

const UNDAMPED: Rayleigh = Rayleigh { mass: 0.0, stiffness: 0.0 };

fn zeros(shell: &Shell) -> Vec<Vec3> {
    vec![Vec3::zeros(); shell.mass.len()]
}

/// Gravity as a dead load, m g.
fn weight(shell: &Shell, gravity: Vec3) -> Vec<Vec3> {
    shell.mass.iter().map(|m| *m * gravity).collect()
}

fn beam(name: &str) -> (Arc<Shell>, Solver, serde_json::Value) {
    let (shell, json) = reference(name);
    let shell = Arc::new(shell);
    (shell.clone(), Solver::new(shell).unwrap(), json)
}

fn equilibrium(solver: &mut Solver, start: &[Vec3], forces: &[Vec3]) -> Equilibrium {
    solver.equilibrium(start, forces, &EquilibriumOptions::default(), &mut |_| Ok(())).unwrap()
}

fn numbers(value: &serde_json::Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn l2(u: &[Vec3]) -> f64 {
    u.iter().map(|u| u.norm_squared()).sum::<f64>().sqrt()
}

fn difference(a: &[Vec3], b: &[Vec3]) -> f64 {
    l2(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>())
}

fn work(forces: &[Vec3], u: &[Vec3]) -> f64 {
    forces.iter().zip(u).map(|(f, u)| f.dot(u)).sum()
}

#[test]
fn equilibria_match_the_reference() {
    for name in ["flat_beam", "v_beam"] {
        let (shell, mut solver, json) = beam(name);
        for case in json["equilibria"].as_array().unwrap() {
            let gravity = Vec3::from_vec(numbers(&case["gravity"]));
            let solution = equilibrium(&mut solver, &zeros(&shell), &weight(&shell, gravity));
            let u = &solution.displacement;
            let what = format!("{name}, gravity {gravity:?}");
            println!(
                "{what}: {} iterations in {} increments, residual {:.1e}, difference {:.1e}",
                solution.iterations,
                solution.increments,
                solution.residual,
                l2(u) / case["ds_l2"].as_f64().unwrap() - 1.0
            );
            // The reference's own residuals are up to 7e-6 of the load.
            assert_close(&what, l2(u), case["ds_l2"].as_f64().unwrap(), 1e-5, 0.0);
            let probes = case["probe_vertices"].as_array().unwrap();
            for (probe, expected) in probes.iter().zip(case["ds_probe"].as_array().unwrap()) {
                let error = u[probe.as_u64().unwrap() as usize] - Vec3::from_vec(numbers(expected));
                assert!(error.norm() <= 1e-5 * l2(u), "{what}: probe {probe} is off by {error:?}");
            }
            // Stated tolerance 1e-8, or the rounding of coordinates of size 4 in edges of stiffness 1e5 under 0.005 of load.
            assert!(solution.residual <= 1e-6, "{what}: {}", solution.residual);
        }
    }
}

#[test]
fn loading_and_unloading_return_to_rest() {
    for name in ["flat_beam", "v_beam"] {
        let (shell, mut solver, _) = beam(name);
        let loaded = equilibrium(&mut solver, &zeros(&shell), &weight(&shell, Vec3::new(0.0, 0.1, -0.3))).displacement;
        let back = equilibrium(&mut solver, &loaded, &zeros(&shell)).displacement;
        // 1e-8 of the forces undone, over a softest mode four orders softer than the load's own.
        assert!(l2(&back) <= 1e-6 * l2(&loaded), "{name}: {:e} of {:e}", l2(&back), l2(&loaded));
        let at_once = EquilibriumOptions { first_increment: 1.0, ..Default::default() };
        let forces = weight(&shell, Vec3::new(0.0, 0.1, -0.3));
        let again = solver.equilibrium(&back, &forces, &at_once, &mut |_| Ok(())).unwrap().displacement;
        assert!(difference(&again, &loaded) <= 1e-6 * l2(&loaded), "{name}");
    }
}

fn sheet_held_where(held: impl Fn(&Vec3) -> bool) -> Arc<Shell> {
    let (positions, triangles) = equilateral_sheet(10, 6, 0.1);
    let fixed = (0..positions.len() as u32).filter(|&v| held(&positions[v as usize])).collect();
    let mesh = Mesh::new(positions, &triangles).unwrap();
    Arc::new(Shell::new(mesh, Material::default(), &Supports { fixed, ..Default::default() }).unwrap())
}

#[test]
fn a_sheet_hinged_along_its_side_swings_down_and_hangs() {
    let shell = sheet_held_where(|p| p.x < 1e-6);
    let mut solver = Solver::new(shell.clone()).unwrap();
    let u = equilibrium(&mut solver, &zeros(&shell), &weight(&shell, Vec3::new(0.0, 0.0, -1.0))).displacement;
    for (u, rest) in u.iter().zip(&shell.mesh.positions) {
        // Turned by 90° and stretched by ρ g L²/2 over the membrane's 4 k_L/(√3 l) = 2e5: 2e-6 of the length 1.
        assert!((rest + u - Vec3::new(0.0, rest.y, -rest.x)).norm() <= 1e-5);
    }
}

#[test]
fn a_shell_held_everywhere_stays_where_it_is() {
    let shell = sheet_held_where(|_| true);
    let mut solver = Solver::new(shell.clone()).unwrap();
    let forces = weight(&shell, Vec3::new(0.0, 0.0, -1.0));
    let (mut u, mut v) = (zeros(&shell), zeros(&shell));
    assert_eq!(equilibrium(&mut solver, &u, &forces).displacement, zeros(&shell));
    solver.implicit_euler(&mut u, &mut v, &forces, UNDAMPED, 0.1).unwrap();
    solver.symplectic_euler(&mut u, &mut v, &forces, UNDAMPED, 0.1).unwrap();
    assert_eq!((u, v), (zeros(&shell), zeros(&shell)));
}

#[test]
fn a_solve_can_be_stopped_at_any_iteration() {
    let (shell, mut solver, _) = beam("v_beam");
    let forces = weight(&shell, Vec3::new(0.0, 0.0, -3.0));
    let options = EquilibriumOptions::default();
    let mut every = 0;
    let count = &mut |_| {
        every += 1;
        Ok(())
    };
    let whole = solver.equilibrium(&zeros(&shell), &forces, &options, count).unwrap();
    let mut calls = 0;
    loop {
        let mut heard = 0;
        let outcome = solver.equilibrium(&zeros(&shell), &forces, &options, &mut |p| {
            assert!(p.load > 0.0 && p.load <= 1.0 && p.residual.is_finite() && p.iterations <= whole.iterations);
            heard += 1;
            if heard > calls { Err(Error::new(ErrorKind::Cancelled, "stop")) } else { Ok(()) }
        });
        match outcome {
            Ok(solution) => {
                assert_eq!(solution.displacement, whole.displacement);
                break;
            }
            Err(e) => assert_eq!(e.kind, ErrorKind::Cancelled),
        }
        calls += 1;
    }
    assert!(calls == every && calls >= whole.iterations, "{calls} calls of {every}, {} iterations", whole.iterations);
}

#[test]
fn a_load_without_equilibrium_is_an_error_with_the_numbers() {
    let free = free_sheet();
    let forces = weight(&free, Vec3::new(0.0, 0.0, -1.0));
    let outcome = Solver::new(free.clone()).unwrap().equilibrium(
        &zeros(&free),
        &forces,
        &EquilibriumOptions { max_iterations: 200, ..Default::default() },
        &mut |_| Ok(()),
    );
    let error = outcome.unwrap_err();
    println!("{error}");
    assert_eq!(error.kind, ErrorKind::Numerical);
    assert!(error.message.contains("residual"), "{error}");
}

#[test]
fn bad_arguments_are_named_and_nothing_is_touched() {
    let (shell, mut solver, _) = beam("v_beam");
    let (good, short) = (zeros(&shell), zeros(&shell)[1..].to_vec());
    let mut bad = good.clone();
    bad[7].y = f64::NAN;
    let options = EquilibriumOptions::default();
    for (start, forces, named) in [(&good, &bad, "forces[7]"), (&short, &good, "368"), (&bad, &good, "start[7]")] {
        let error = solver.equilibrium(start, forces, &options, &mut |_| Ok(())).unwrap_err();
        assert_eq!(error.kind, ErrorKind::InvalidArgument);
        assert!(error.message.contains(named), "{error}");
    }
    let negative = Rayleigh { mass: -1.0, stiffness: 0.0 };
    for (forces, damping, h) in
        [(&bad, UNDAMPED, 0.01), (&good, negative, 0.01), (&good, UNDAMPED, 0.0), (&good, UNDAMPED, f64::NAN)]
    {
        let (mut u, mut v) = (good.clone(), good.clone());
        v[40].z = 1.0;
        let before = (u.clone(), v.clone());
        let implicit = solver.implicit_euler(&mut u, &mut v, forces, damping, h).unwrap_err();
        let explicit = solver.symplectic_euler(&mut u, &mut v, forces, damping, h).unwrap_err();
        assert_eq!((implicit.kind, explicit.kind), (ErrorKind::InvalidArgument, ErrorKind::InvalidArgument));
        assert_eq!((u, v), before);
    }
}

/// A cantilever strip of unit length and 1/`slenderness` width with `rows` rows of triangles.
struct Strip {
    shell: Arc<Shell>,
    length: f64,
    /// EI = D (1 − ν²) b of a free-edged strip, D = 6 k_B and ν = −1/3.
    rigidity: f64,
    /// Vertices of the end and their shares of its width.
    tip: Vec<(usize, f64)>,
}

impl Strip {
    fn new(slenderness: f64, rows: usize) -> Self {
        let edge = 2.0 / (slenderness * rows as f64 * 3f64.sqrt());
        let columns = (1.0 / edge).round() as usize + 1;
        let (positions, triangles) = equilateral_sheet(columns, rows, edge);
        let (end, width) = (columns as f64 * edge, 1.0 / slenderness);
        let is_edge = |p: &Vec3| p.y < 1e-6 * edge || p.y > width - 1e-6 * edge;
        let share = |p: &Vec3| if is_edge(p) { 0.5 / rows as f64 } else { 1.0 / rows as f64 };
        let at_end = positions.iter().enumerate().filter(|(_, p)| p.x > end - 0.1 * edge);
        let tip = at_end.map(|(v, p)| (v, share(p))).collect();
        let fixed = (0..positions.len() as u32).filter(|&v| positions[v as usize].x < 1.01 * edge).collect();
        let material = Material { k_area: 1e4, k_length: 1e4, k_bend: 1.0, area_density: 1.0 };
        let mesh = Mesh::new(positions, &triangles).unwrap();
        let shell = Arc::new(Shell::new(mesh, material, &Supports { fixed, ..Default::default() }).unwrap());
        // As in tests/modal/modes.rs: the first hinge row's curvature belongs to half an edge on either side of it.
        Self { shell, length: end - 0.5 * edge, rigidity: 6.0 * (1.0 - 1.0 / 9.0) * width, tip }
    }

    /// Drop and shortening of the end over the length.
    fn tip_under(&self, forces: &[Vec3]) -> [f64; 2] {
        let mut solver = Solver::new(self.shell.clone()).unwrap();
        let solution = equilibrium(&mut solver, &zeros(&self.shell), forces);
        let tip: Vec3 = self.tip.iter().map(|(v, share)| *share * solution.displacement[*v]).sum();
        println!("{} vertices: {} iterations", self.shell.mass.len(), solution.iterations);
        [-tip.z / self.length, -tip.x / self.length]
    }

    /// The end's load P = λ EI/L².
    fn tip_load(&self, lambda: f64) -> Vec<Vec3> {
        let mut forces = zeros(&self.shell);
        let load = lambda * self.rigidity / self.length.powi(2);
        self.tip.iter().for_each(|(v, share)| forces[*v].z = -share * load);
        forces
    }

    /// The weight per length w = G EI/L³.
    fn self_weight(&self, g: f64) -> Vec<Vec3> {
        let width = self.rigidity / (6.0 * (1.0 - 1.0 / 9.0));
        weight(&self.shell, Vec3::new(0.0, 0.0, -g * self.rigidity / (self.length.powi(3) * width)))
    }
}

/// Loads of an elastica table up to just past a slope of 60° at the end, with its drop and shortening.
fn elastica(name: &str) -> Vec<Vec<f64>> {
    let rows = csv(name);
    let past = rows.iter().position(|r| r[3] > 60f64.to_radians()).unwrap();
    rows[..=past].iter().filter(|r| r[0] >= 1.0).cloned().collect()
}

#[test]
fn strips_follow_the_elastica_to_a_slope_of_sixty_degrees() {
    let (coarse, middle, fine) = (Strip::new(10.0, 2), Strip::new(20.0, 4), Strip::new(40.0, 8));
    type Load = fn(&Strip, f64) -> Vec<Vec3>;
    let loads: [(&str, Load); 2] =
        [("elastica_tip_load.csv", Strip::tip_load), ("elastica_self_weight.csv", Strip::self_weight)];
    for (name, load) in loads {
        for row in elastica(name) {
            let error = |strip: &Strip| {
                let tip = strip.tip_under(&load(strip, row[0]));
                (tip[0] - row[1]).hypot(tip[1] - row[2]) / row[1].hypot(row[2])
            };
            let e = [error(&coarse), error(&middle), error(&fine)];
            println!("{name}, load {}, slope {:.0}°: errors {e:?}", row[0], row[3].to_degrees());
            // The strip grows narrow and fine together: first order, from the free edges and the clamp's zone.
            assert!(e[2] <= 0.01 && e[1] <= 0.6 * e[0] && e[2] <= 0.6 * e[1], "{name}, load {}: {e:?}", row[0]);
        }
    }
}

fn free_sheet() -> Arc<Shell> {
    sheet_held_where(|_| false)
}

/// A velocity of drift, spin and smooth deformation.
fn tumbling(shell: &Shell) -> Vec<Vec3> {
    let (drift, spin) = (Vec3::new(0.3, -0.2, 0.5), Vec3::new(2.0, 1.0, -3.0));
    let bend = |p: &Vec3| Vec3::new(0.1 * p.y, 0.2 * p.x * p.x, 3.0 * (4.0 * p.x).sin() * (5.0 * p.y).cos());
    shell.mesh.positions.iter().map(|p| drift + spin.cross(p) + bend(p)).collect()
}

fn momentum(shell: &Shell, v: &[Vec3]) -> Vec3 {
    shell.mass.iter().zip(v).map(|(m, v)| *m * v).sum()
}

fn angular_momentum(shell: &Shell, u: &[Vec3], v: &[Vec3]) -> Vec3 {
    let rest = &shell.mesh.positions;
    (0..v.len()).map(|i| shell.mass[i] * (rest[i] + u[i]).cross(&v[i])).sum()
}

#[test]
fn a_free_shell_keeps_its_momenta_under_explicit_steps_whatever_the_damping() {
    let shell = free_sheet();
    let mut solver = Solver::new(shell.clone()).unwrap();
    let none = zeros(&shell);
    for stiffness in [0.0, 1e-5] {
        let damping = Rayleigh { mass: 0.0, stiffness };
        let h = 0.5 * solver.stable_step(damping).unwrap();
        let (mut u, mut v) = (zeros(&shell), tumbling(&shell));
        let start = (momentum(&shell, &v), angular_momentum(&shell, &u, &v));
        for _ in 0..5000 {
            solver.symplectic_euler(&mut u, &mut v, &none, damping, h).unwrap();
        }
        let end = (momentum(&shell, &v), angular_momentum(&shell, &u, &v));
        // 5000 steps of forces about 1e3 times larger than m v/s in sums that cancel to 1e-16.
        assert!((end.0 - start.0).norm() <= 1e-11 * start.0.norm(), "{:?}", end.0 - start.0);
        assert!((end.1 - start.1).norm() <= 1e-11 * start.1.norm(), "{:?}", end.1 - start.1);
        assert!(l2(&u) > 1.0);
    }
}

#[test]
fn a_free_shell_keeps_its_momentum_and_never_gains_energy_under_implicit_steps() {
    let shell = free_sheet();
    let mut solver = Solver::new(shell.clone()).unwrap();
    let none = zeros(&shell);
    for h in [1.0 / 30.0, 1.0 / 1000.0] {
        let (mut u, mut v) = (zeros(&shell), tumbling(&shell));
        let start = momentum(&shell, &v);
        let mut energy = solver.kinetic_energy(&v);
        for step in 0..100 {
            solver.implicit_euler(&mut u, &mut v, &none, UNDAMPED, h).unwrap();
            let now = solver.kinetic_energy(&v) + solver.elastic_energy(&u);
            assert!(now <= energy * (1.0 + 1e-12), "h = {h}, step {step}: {energy} to {now}");
            energy = now;
        }
        // Newton's last residual of 1e-9 at most, mostly far less, and it cancels in the sum.
        let change = (momentum(&shell, &v) - start).norm();
        assert!(change <= 1e-9 * start.norm(), "h = {h}: {change:e}");
    }
}

#[test]
fn implicit_steps_of_a_frame_are_stable_under_strong_gravity() {
    for (name, g) in [("flat_beam", 10.0), ("flat_beam", 100.0), ("v_beam", 10.0), ("v_beam", 100.0)] {
        let (shell, mut solver, _) = beam(name);
        let forces = weight(&shell, Vec3::new(0.0, 0.0, -g));
        let (mut u, mut v) = (zeros(&shell), zeros(&shell));
        let (mut energy, mut highest_gain, mut iterations, mut most) = (0.0, 0.0f64, 0, 0);
        for step in 0..150 {
            let report = solver.implicit_euler(&mut u, &mut v, &forces, UNDAMPED, 1.0 / 30.0).unwrap();
            (iterations, most) = (iterations + report.iterations, most.max(report.iterations));
            let now = solver.kinetic_energy(&v) + solver.elastic_energy(&u) - work(&forces, &u);
            // A dead load is conservative, so its potential counts. Steps through a snap may gain some of it, none in all.
            assert!(now <= 1e-9 * g, "{name}, g = {g}, step {step}: {now}");
            highest_gain = highest_gain.max(now - energy);
            energy = now;
        }
        println!(
            "{name}, g = {g}: {:.1} iterations a step, {most} at most; gain {highest_gain:e} of {energy}",
            iterations as f64 / 150.0
        );
        assert!(shell.held.iter().zip(&u).all(|(held, u)| !held || *u == Vec3::zeros()));
    }
}

#[test]
fn explicit_and_implicit_steps_agree_on_a_released_beam() {
    let (shell, mut solver, _) = beam("v_beam");
    let none = zeros(&shell);
    let start = equilibrium(&mut solver, &none, &weight(&shell, Vec3::new(0.0, 0.0, -3.0))).displacement;
    let run = |solver: &mut Solver, implicit: bool, steps: usize| {
        let (mut u, mut v) = (start.clone(), zeros(&shell));
        let h = 1.0 / steps as f64;
        let mut shots = vec![];
        for step in 1..=steps {
            if implicit {
                solver.implicit_euler(&mut u, &mut v, &none, UNDAMPED, h).unwrap();
            } else {
                solver.symplectic_euler(&mut u, &mut v, &none, UNDAMPED, h).unwrap();
            }
            if step % (steps / 10) == 0 {
                shots.extend_from_slice(&u);
            }
        }
        shots
    };
    assert!(1.0 / 30000.0 < 0.5 * solver.stable_step(UNDAMPED).unwrap());
    let explicit = run(&mut solver, false, 30000);
    let errors = [600, 1200].map(|n| difference(&run(&mut solver, true, n), &explicit) / l2(&explicit));
    println!("relative L2 difference of ten shapes over a second: {errors:?}");
    // Backward Euler is of first order, and damps mode k by λ_k h/2 a second: 1 % of the first at 1200 steps. The explicit
    // steps' own error is of the order of ω h: 2e-4.
    assert!(errors[1] <= 0.01 && (1.7..2.3).contains(&(errors[0] / errors[1])), "{errors:?}");
}

#[test]
fn a_released_or_crumpled_beam_never_gains_energy_under_implicit_steps() {
    let mut rng = StdRng::seed_from_u64(2);
    for name in ["flat_beam", "v_beam"] {
        let (shell, mut solver, _) = beam(name);
        let none = zeros(&shell);
        let bent = equilibrium(&mut solver, &none, &weight(&shell, Vec3::new(0.0, 0.1, -0.3))).displacement;
        let crumpled = shell.held.iter().map(|held| f64::from(!held) * 0.05 * random_vector(&mut rng)).collect();
        for (u, h) in [(&bent, 1.0 / 30.0), (&crumpled, 1.0 / 30.0), (&crumpled, 1.0 / 1000.0)] {
            let (mut u, mut v): (Vec<Vec3>, _) = (u.clone(), none.clone());
            let first = solver.elastic_energy(&u);
            let mut energy = first;
            for step in 0..60 {
                solver.implicit_euler(&mut u, &mut v, &none, UNDAMPED, h).unwrap();
                let now = solver.kinetic_energy(&v) + solver.elastic_energy(&u);
                // The residual of 1e-9 does less work than this.
                assert!(now <= energy + 1e-9 * first, "{name}, h = {h}, step {step}: {energy} to {now}");
                energy = now;
            }
            println!("{name}, h = {h}: {first} to {energy}");
        }
    }
}

/// Modal amplitude φᵀMu.
fn amplitude(shell: &Shell, phi: &[Vec3], u: &[Vec3]) -> f64 {
    (0..u.len()).map(|v| shell.mass[v] * phi[v].dot(&u[v])).sum()
}

#[test]
fn small_vibrations_step_as_their_mode_does() {
    let (shell, mut solver, _) = beam("v_beam");
    let (modes, none, steps) = (modes_of(&shell, 3), zeros(&shell), 300);
    for (phi, lambda) in modes.shapes.iter().zip(&modes.eigenvalues) {
        let (scale, lambda) = (1e-6, *lambda);
        let start: Vec<Vec3> = phi.iter().map(|phi| scale * phi).collect();

        let damping = Rayleigh { mass: 0.2, stiffness: 5e-3 };
        let oscillator = Oscillator { damping: damping.mass + damping.stiffness * lambda, eigenvalue: lambda };
        let h = 0.02 / lambda.sqrt();
        let (mut u, mut v, mut q) = (start.clone(), none.clone(), (scale, 0.0));
        for _ in 0..steps {
            solver.implicit_euler(&mut u, &mut v, &none, damping, h).unwrap();
            q = oscillator.advance(Integrator::ImplicitEuler, q.0, q.1, 0.0, h);
        }
        // Nonlinear terms are of the order of the amplitude over an edge, 1e-5; the residual of 1e-9 adds up to less.
        assert_close("implicit", amplitude(&shell, phi, &u), q.0, 1e-5, scale);

        let damping = Rayleigh { mass: 50.0, stiffness: 1e-5 };
        let (c, h) = (damping.mass + damping.stiffness * lambda, 0.5 * solver.stable_step(damping).unwrap());
        let (mut u, mut v, mut q) = (start, none.clone(), (scale, 0.0));
        for _ in 0..steps {
            solver.symplectic_euler(&mut u, &mut v, &none, damping, h).unwrap();
            q.1 -= h * (lambda * q.0 + c * q.1);
            q.0 += h * q.1;
        }
        assert_close("explicit", amplitude(&shell, phi, &u), q.0, 1e-5, scale);
    }
}

#[test]
fn the_stable_step_is_just_below_the_limit_of_the_highest_mode() {
    let (shell, mut solver, _) = beam("v_beam");
    let none = zeros(&shell);
    let mut rng = StdRng::seed_from_u64(1);
    let noise: Vec<Vec3> = shell.held.iter().map(|held| f64::from(!held) * random_vector(&mut rng)).collect();
    for damping in [UNDAMPED, Rayleigh { mass: 10.0, stiffness: 1e-5 }, Rayleigh { mass: 0.0, stiffness: 1e-3 }] {
        let stable = solver.stable_step(damping).unwrap();
        let mut growth = |h: f64| {
            let (mut u, mut v) = (noise.iter().map(|d| 1e-9 * d).collect::<Vec<_>>(), none.clone());
            let survives = (0..1000).all(|_| solver.symplectic_euler(&mut u, &mut v, &none, damping, h).is_ok());
            if survives { l2(&u) / (1e-9 * l2(&noise)) } else { f64::INFINITY }
        };
        let (inside, outside) = (growth(stable), growth(1.5 * stable));
        println!("{damping:?}: growth {inside:.2e} at {stable:.2e} s, {outside:.2e} at half as much again");
        // Neutral vibrations may add up; an unstable one grows by a factor a step. Gershgorin's bound of the eigenvalue is
        // 20 to 40 % high here, so up to 40 % in the step when damping rules.
        assert!(inside < 10.0 && outside > 1e3, "{damping:?}: {inside:e}, {outside:e}");
    }
}

fn random_vector(rng: &mut StdRng) -> Vec3 {
    Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0))
}

#[test]
fn explicit_steps_do_not_allocate_and_implicit_ones_only_in_the_sparse_solver() {
    let (shell, mut solver, _) = beam("v_beam");
    let forces = weight(&shell, Vec3::new(0.0, 0.0, -3.0));
    let damping = Rayleigh { mass: 0.1, stiffness: 1e-4 };
    let (mut u, mut v) = (zeros(&shell), zeros(&shell));
    let explicit = allocation_counter::measure(|| {
        solver.symplectic_euler(&mut u, &mut v, &forces, damping, 1e-5).unwrap();
    });
    assert_eq!(explicit.count_total, 0);
    // The first factorization of a thread sets up what the library keeps.
    solver.implicit_euler(&mut u, &mut v, &forces, damping, 0.03).unwrap();
    let (before, mut iterations) = (solver.factorizations(), 0);
    let implicit = allocation_counter::measure(|| {
        iterations = solver.implicit_euler(&mut u, &mut v, &forces, damping, 0.03).unwrap().iterations;
    });
    // The scratch of a factorization and of its solution, and, where an earlier factor was tried first or instead, of the solutions by that.
    let factored = 2 * (solver.factorizations() - before) as u64;
    let scratch = factored..=factored + iterations as u64;
    assert!(scratch.contains(&implicit.count_total), "{} for {iterations} iterations", implicit.count_total);
}
