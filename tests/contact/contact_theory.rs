//! Contact against closed forms of beams, and over very many steps.

use crate::common::equilateral_sheet;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use shellwarp::collider::Solid;
use shellwarp::contact::{Obstacle, patches_near};
use shellwarp::material::{ElasticSheet, Elasticity};
use shellwarp::model::{Model, Options, Precision};
use shellwarp::state::{Damping, Method, Space, State};
use shellwarp::step::Integrator;
use shellwarp::support::Pose;
use shellwarp::{Mesh, Shell, Supports, Vec3};
use std::sync::Arc;

const G: f64 = 9.81;
const H: f64 = 1.0 / 60.0;

/// A strip along x, a metre long and 0.07 wide, of 2 mm: its weight and bending stiffness per width follow from the sheet.
const SHEET: ElasticSheet = ElasticSheet { young: 1.57e9, poisson: 0.0, thickness: 2e-3, volume_density: 1000.0 };
const EDGE: f64 = 0.02;

fn weight() -> f64 {
    SHEET.volume_density * SHEET.thickness * G
}

fn stiffness() -> f64 {
    SHEET.young * SHEET.thickness.powi(3) / 12.0
}

/// Its first row is a hinge.
fn hinged_strip() -> Shell {
    let (positions, triangles) = equilateral_sheet(50, 4, EDGE);
    let fixed = (0..positions.len() as u32).filter(|v| positions[*v as usize].x < 1e-9).collect();
    let mesh = Mesh::new(positions, &triangles).unwrap();
    Shell::new(mesh, Elasticity::Koiter(SHEET), &Supports { fixed, ..Default::default() }).unwrap()
}

fn on_floor(shell: Shell, modes: usize, method: Method, depth: f64) -> State {
    let options = Options { modes, precision: Precision::F64, ..Options::default() };
    let model = Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap());
    let mut state = State::new(model, method, Integrator::ImplicitEuler).unwrap();
    state.set_gravity(Vec3::new(0.0, 0.0, -G)).unwrap();
    let floor = Pose { origin: Vec3::new(0.0, 0.0, -depth), ..Pose::identity() };
    state.set_obstacles(vec![Obstacle::new(Arc::new(Solid::plane()), floor)]).unwrap();
    // Backward Euler's own damping lays it down; then the equilibrium.
    state.set_damping(&Damping { mass_coefficient: 3.0, ..Damping::default() }).unwrap();
    (0..240).for_each(|_| state.step(H).unwrap());
    state.equilibrium().unwrap();
    state
}

/// A heavy beam hangs from a hinge at the height H above a floor, and lies on it from a length L on:
///
///   EI w'''' = -q, w = w' = w'' = 0 where it lifts off, w = H and w'' = 0 at the hinge:  L = (24 EI H/q)^(1/4).
///
/// The hinge carries qL/2, the floor all else; at the lift-off there is a force of qL/2.
#[test]
fn a_heavy_strip_lifts_off_the_floor_where_the_beam_does() {
    let height = 0.02;
    let (q, ei) = (weight(), stiffness());
    let length = (24.0 * ei * height / q).powf(0.25);
    println!("lift-off at {length:.4} by the beam; H/L is {:.3}", height / length);
    for (method, modes, tolerance) in [(Method::ImplicitShell, 4, 0.02), (Method::Warp, 40, 0.05)] {
        let state = on_floor(hinged_strip(), modes, method, height);
        let shell = &state.model().shell;
        let width = shell.total_area / 1.0;
        let floor: f64 = state.contacts().map(|contact| contact.force.z).sum();
        let all = q * shell.total_area;
        let hinge = all - floor;
        let first = state.contacts().map(|contact| contact.point.x).fold(f64::INFINITY, f64::min);
        let line: f64 = state.contacts().filter(|c| c.point.x < length + 2.0 * EDGE).map(|c| c.force.z).sum();
        // Half the way up the beam is at w(L/2) = H (2 (1/2)^3 - (1/2)^4).
        let middle = height * (2.0 / 8.0 - 1.0 / 16.0);
        let at = |x: f64| {
            let (mut sum, mut n) = (0.0, 0);
            state.positions(Space::World, |v, p| {
                if (shell.mesh.positions[v].x - x).abs() < 0.51 * EDGE {
                    (sum, n) = (sum + p.z + height, n + 1);
                }
            });
            sum / f64::from(n)
        };
        let lifted = at(((length / 2.0) / EDGE).round() * EDGE);
        println!(
            "{method}: lift-off at {first:.3}, hinge carries {:.4} of qL/2, near the lift-off {:.3} of qL/2, middle at {:.3} of the beam's",
            hinge / (q * length / 2.0 * width),
            line / (q * length / 2.0 * width),
            lifted / middle
        );
        assert!((hinge / (q * length / 2.0 * width) - 1.0).abs() < tolerance, "{method}: {hinge}");
        // A column of vertices is half an edge from the next.
        assert!((first - length).abs() < 1.5 * EDGE, "{method}: {first}");
    }
}

/// The elastica that hangs from a hinge above a floor and lies on it from the length L on, without friction and so without tension. With s from
/// where it lifts off, at the angle θ there and the force P of the floor at that place,
///
///   EI θ'' = (P − q s) cos θ,  θ = θ' = 0 at s = 0,  θ' = 0 and ∫ sin θ = H at the hinge, s = L.
///
/// Returns L, P and the way along the floor, ∫ cos θ.
fn elastica(height: f64) -> [f64; 3] {
    let (q, ei) = (weight(), stiffness());
    // From the floor up to where θ' is 0 again: s, the height there and the way.
    let shoot = |force: f64| -> [f64; 3] {
        let slope =
            |s: f64, [angle, bend, ..]: [f64; 4]| [bend, (force - q * s) * angle.cos() / ei, angle.sin(), angle.cos()];
        let h = 1e-4;
        let (mut s, mut y) = (0.0, [0.0; 4]);
        loop {
            let add = |y: [f64; 4], k: [f64; 4], h: f64| -> [f64; 4] { std::array::from_fn(|i| y[i] + h * k[i]) };
            let a = slope(s, y);
            let b = slope(s + 0.5 * h, add(y, a, 0.5 * h));
            let c = slope(s + 0.5 * h, add(y, b, 0.5 * h));
            let d = slope(s + h, add(y, c, h));
            let next: [f64; 4] = std::array::from_fn(|i| y[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
            if next[1] <= 0.0 {
                let part = y[1] / (y[1] - next[1]);
                return [s + part * h, y[2] + part * (next[2] - y[2]), y[3] + part * (next[3] - y[3])];
            }
            (s, y) = (s + h, next);
        }
    };
    let (mut low, mut high) = (1e-3, 8.0); // N/m: more lifts it higher, up to 52 degrees at the hinge, and soon beyond curls it over
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if shoot(middle)[1] < height { low = middle } else { high = middle }
    }
    let [length, _, way] = shoot(low);
    [length, low, way]
}

/// The floor rises under the strip, and the line where it lifts off rolls along: from a slope of 48 degrees at the hinge, where the beam of
/// small slopes has it elsewhere, to one of 6, where both agree.
#[test]
fn a_heavy_strip_rolls_on_the_floor_as_the_elastica_does() {
    let (q, ei) = (weight(), stiffness());
    let mut state = on_floor(hinged_strip(), 4, Method::ImplicitShell, 0.35);
    let width = state.model().shell.total_area; // it is a metre long
    let (mut last, mut apart) = (0.35, vec![]);
    for height in [0.35, 0.2, 0.1, 0.02] {
        for step in 1..=180 {
            let depth = last + (height - last) * f64::min(f64::from(step) / 120.0, 1.0);
            let floor = Pose { origin: Vec3::new(0.0, 0.0, -depth), ..Pose::identity() };
            state.move_obstacle(0, floor, false).unwrap();
            state.step(H).unwrap();
        }
        last = height;
        state.equilibrium().unwrap();
        let rest = &state.model().shell.mesh.positions;
        let [length, force, way] = elastica(height);
        let beam = (24.0 * ei * height / q).powf(0.25);
        let pushes: f64 = state.contacts().map(|contact| contact.force.z).sum();
        let hinge = (q * width - pushes) / width;
        let first = |of: &dyn Fn(&shellwarp::contact::Contact) -> f64| {
            state.contacts().map(|c| of(&c)).fold(f64::INFINITY, f64::min)
        };
        let along = first(&|c| c.vertices.iter().zip(c.weights).map(|(v, w)| w * rest[*v as usize].x).sum());
        let at = first(&|c| c.point.x);
        let expected = q * length - force;
        println!(
            "H {height}: L {along:.3} of {length:.4} ({beam:.4} by the beam), at {at:.3} of {way:.4}, hinge {:.4} of the elastica's",
            hinge / expected
        );
        assert!((hinge / expected - 1.0).abs() < 0.01, "H {height}: {hinge} for {expected}");
        // A column of vertices is half an edge from the next.
        assert!((along - length).abs() < 1.5 * EDGE, "H {height}: lifts off at {along} for {length}");
        assert!((at - way).abs() < 1.5 * EDGE, "H {height}: lifts off above {at} for {way}");
        apart.push((beam / way - 1.0).abs());
    }
    // The test tells one theory from the other.
    assert!(apart[0] > 0.08 && apart[3] < 0.005, "{apart:?}");
}

/// Energy of a leaf of paper thrown about among balls for 100,000 steps, without loads: none is gained, with friction and without.
#[test]
fn energy_does_not_grow_in_a_hundred_thousand_random_steps() {
    let (positions, triangles) = equilateral_sheet(6, 4, 0.1);
    let fixed = (0..positions.len() as u32).filter(|v| positions[*v as usize].x < 0.06).collect();
    let material = shellwarp::Material { k_area: 1e3, k_length: 1e3, k_bend: 0.05, area_density: 0.5 };
    let mesh = Mesh::new(positions, &triangles).unwrap();
    let shell = Shell::new(mesh, material, &Supports { fixed, ..Default::default() }).unwrap();
    let options = Options { modes: 6, precision: Precision::F64, ..Options::default() };
    let model = Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap());
    for (method, friction) in [(Method::Warp, 0.0), (Method::Warp, 0.6), (Method::LinearModalAnalysis, 0.6)] {
        let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
        let mut rng = StdRng::seed_from_u64(23);
        let (mut worst, mut out, mut touched, mut led, mut steps) = (0.0f64, 0.0f64, 0u64, 0, 0);
        while steps < 100_000 {
            let balls = (0..3).map(|_| {
                let place =
                    Vec3::new(rng.random_range(0.2..0.7), rng.random_range(-0.1..0.5), rng.random_range(-0.2..-0.115));
                let ball = Arc::new(Solid::sphere(rng.random_range(0.05..0.11)).unwrap());
                Obstacle::new(ball, Pose { origin: place, ..Pose::identity() }).with_friction(friction)
            });
            state.set_obstacles(balls.collect()).unwrap();
            let speed: f64 = rng.random_range(2.0..12.0);
            let rates: Vec<Vec3> =
                model.shell.mesh.positions.iter().map(|x| Vec3::new(0.0, 0.0, -speed * x.x * x.x)).collect();
            state.set_pose(Space::World, &model.shell.mesh.positions, Some(&rates)).unwrap();
            let energy = |state: &State| {
                let report = state.report();
                report.kinetic_energy + report.elastic_energy
            };
            let first = energy(&state);
            let (mut least, mut inside) = (first, false);
            for _ in 0..200 {
                state.step(H * rng.random_range(0.2..2.0)).unwrap();
                let now = energy(&state);
                // What modes or twelve rounds leave inside is led out in the next steps, by at most a size a second: that is work.
                let led_out = inside;
                inside = state.contact_summary().deepest > 2e-5 * model.shell.mesh.size;
                if led_out || inside {
                    out = out.max((now - least) / first);
                    led += 1;
                } else {
                    worst = worst.max((now - least) / first);
                }
                least = if led_out { now } else { least.min(now) };
                touched += state.contact_summary().count as u64;
                steps += 1;
            }
        }
        println!(
            "{method}, mu {friction}: {touched} contacts, energy grew by {worst:.1e} of the first; in {led} steps led out by {out:.1e}"
        );
        assert!(touched > 500, "{method} touches nothing");
        // A contact has the stiffness k = 100 M/h². One that stops all of the motion Mv in a step has λ²/2k = Mv²/200, a hundredth of its energy.
        assert!(worst < 1e-2, "{method}: {worst}");
        assert!(led < steps / 100 && out < 0.05, "{method}: {led} steps led a vertex out, by {out}");
    }
}

/// A sheet that nothing holds comes to rest on a floor also by an equilibrium, which no swing leads it to.
#[test]
fn an_equilibrium_lays_a_free_sheet_on_the_floor() {
    let (positions, triangles) = equilateral_sheet(10, 6, 0.1);
    let material = shellwarp::Material { area_density: 0.2, ..Default::default() };
    let shell = Shell::new(Mesh::new(positions, &triangles).unwrap(), material, &Supports::default()).unwrap();
    let options = Options { modes: 16, precision: Precision::F64, ..Options::default() };
    let model = Arc::new(Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).unwrap());
    for method in [Method::LinearModalAnalysis, Method::Warp] {
        let mut state = State::new(model.clone(), method, Integrator::ImplicitEuler).unwrap();
        state.set_gravity(Vec3::new(0.0, 0.0, -G)).unwrap();
        let floor = Pose { origin: Vec3::new(0.0, 0.0, -0.03), ..Pose::identity() };
        state.set_obstacles(vec![Obstacle::new(Arc::new(Solid::plane()), floor)]).unwrap();
        let found = state.equilibrium();
        if method == Method::Warp {
            // It turns what the shell has moved along with the shell: no rest is found, and that is said.
            assert!(found.is_err_and(|error| error.message.contains("no equilibrium")));
            continue;
        }
        let force: f64 = state.contacts().map(|contact| contact.force.z).sum();
        let weight = G * model.shell.total_mass;
        let mut heights = vec![];
        state.positions(Space::World, |_, x| heights.push(x.z + 0.03));
        let far = heights.iter().map(|z| z.abs()).fold(0.0, f64::max);
        println!(
            "{method}: {found:?}, the floor carries {:.6} of the weight, all within {far:.1e} of it",
            force / weight
        );
        assert!((force / weight - 1.0).abs() < 1e-4 && far < 1e-3, "{method}: {force} of {weight}, {far}");
    }
}

/// Three balls bend a leaf of two modes against each other: it cannot give way to all. With answers at their places it does.
#[test]
fn contact_patches_follow_what_modes_cannot() {
    let shell = Arc::new(crate::common::leaf(1));
    let places =
        [(0.5, 1.0), (0.85, -1.0), (1.2, 1.0)].map(|(x, side)| (Vec3::new(x, 0.0, 0.25 * x * (1.5 - x)), side));
    let near = |p: Vec3| {
        let distance = |v: &u32| (shell.mesh.positions[*v as usize] - p).norm();
        *shell.free.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap()
    };
    let patches: Vec<u32> = places.iter().map(|(p, _)| near(*p)).collect();
    let deepest = |patches: Vec<u32>| {
        let options = Options { modes: 2, precision: Precision::F64, contact_patches: patches, ..Options::default() };
        let model = Arc::new(Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).unwrap());
        let count = model.modal.eigenvalues.len();
        assert!(model.modal.eigenvalues.windows(2).all(|pair| pair[0] <= pair[1]));
        let mut state = State::new(model, Method::Warp, Integrator::ImplicitEuler).unwrap();
        let ball = Arc::new(Solid::sphere(0.2).unwrap());
        // From 0.01 off the leaf to 0.02 within where it rests, from below and from above.
        let at = |(p, side): (Vec3, f64), share: f64| {
            let off = 0.2 + 0.01 - 0.03 * share;
            Pose { origin: p - side * off * Vec3::z(), ..Pose::identity() }
        };
        state.set_obstacles(places.map(|place| Obstacle::new(ball.clone(), at(place, 0.0))).to_vec()).unwrap();
        for k in 1..=90 {
            for (i, place) in places.into_iter().enumerate() {
                state.move_obstacle(i, at(place, (f64::from(k) / 60.0).min(1.0)), false).unwrap();
            }
            state.step(H).unwrap();
        }
        (count, state.contact_summary().deepest / shell.mesh.size)
    };
    let ((few, without), (more, with)) = (deepest(vec![]), deepest(patches));
    println!("three balls: {few} modes leave {without:.1e} of the size inside, {more} with patches {with:.1e}");
    assert!(few == 2 && more == 5 && without > 1e-3 && with < 0.1 * without, "{without} {with}");
    // Found by where the balls are first.
    let ball = Arc::new(Solid::sphere(0.2).unwrap());
    let first = |(p, side): (Vec3, f64)| Pose { origin: p - side * 0.21 * Vec3::z(), ..Pose::identity() };
    let balls = places.map(|place| Obstacle::new(ball.clone(), first(place)));
    let found = patches_near(&shell, &balls, 0.03, 6);
    let of = |v: &u32| {
        let gap = |ball: &Obstacle| (shell.mesh.positions[*v as usize] - ball.pose.origin).norm() - 0.2;
        balls.each_ref().map(gap)
    };
    assert!(found.len() == 6 && found.iter().all(|v| of(v).into_iter().fold(f64::INFINITY, f64::min) <= 0.03));
    for i in 0..3 {
        assert!(found.iter().any(|v| of(v)[i] <= 0.03), "none at ball {i}: {found:?}");
    }
    let (count, left) = deepest(found.clone());
    println!("{} patches found near them: {left:.1e}", found.len());
    assert!(count == 8 && left < 0.1 * without, "{left} {without}");
    assert_eq!(patches_near(&shell, &balls, 0.03, 6), found);
    assert!(patches_near(&shell, &balls, 0.0, 6).is_empty() && patches_near(&shell, &[], 1.0, 6).is_empty());
    assert_eq!(patches_near(&shell, &balls, 10.0, 10_000).len(), shell.free.len());
}

/// The answer of a patch is that of the whole shell: a push there bends four modes and a patch as all modes together.
#[test]
fn a_patch_answers_a_push_as_the_whole_shell_does() {
    let (positions, triangles) = equilateral_sheet(12, 4, 0.1);
    let fixed = (0..positions.len() as u32).filter(|v| positions[*v as usize].x < 0.06).collect();
    let shell = Shell::new(
        Mesh::new(positions, &triangles).unwrap(),
        shellwarp::Material::default(),
        &Supports { fixed, ..Default::default() },
    );
    let shell = Arc::new(shell.unwrap());
    let at = shell.free[shell.free.len() * 2 / 3];
    let moved = |modes: usize, patches: Vec<u32>| {
        let options = Options { modes, precision: Precision::F64, contact_patches: patches, ..Options::default() };
        let model = Arc::new(Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).unwrap());
        let mut state = State::new(model, Method::LinearModalAnalysis, Integrator::Exact).unwrap();
        state.set_forces([(at, Vec3::new(0.0, 0.0, 0.01))], false).unwrap();
        state.equilibrium().unwrap();
        crate::common::displacements(&state)
    };
    let all = moved(3 * shell.free.len(), vec![]);
    let (few, patched) =
        (crate::common::error(&moved(4, vec![]), &all), crate::common::error(&moved(4, vec![at]), &all));
    println!("a push at a vertex: 4 modes are {few:.1e} off all {}, with a patch {patched:.1e}", 3 * shell.free.len());
    assert!(few > 1e-3 && patched < 1e-8, "{few} {patched}");
}

#[test]
fn patches_that_cannot_be_are_named() {
    let refused = |shell: Shell, patches: Vec<u32>| {
        let options = Options { contact_patches: patches, ..Options::default() };
        Model::precompute(Arc::new(shell), &options, &mut |_, _| Ok(())).err().unwrap().message
    };
    assert!(
        refused(crate::common::leaf(1), vec![300, 100_000])
            .contains("contact_patches[1] is vertex 100000: the mesh has 472")
    );
    assert!(refused(crate::common::leaf(1), vec![0]).contains("contact_patches[0] is vertex 0: it does not move"));
    let (positions, triangles) = equilateral_sheet(4, 3, 0.1);
    let mesh = Mesh::new(positions, &triangles).unwrap();
    let free = Shell::new(mesh, shellwarp::Material::default(), &Supports::default()).unwrap();
    assert!(refused(free, vec![3]).contains("can move freely"));
}
