//! Shells that touch: solids that are fast, thin, there from the start or all around; friction, mass and stiffness at their ends.

use super::cases::{common, in_units, strip};
use super::touch::{Collider, DEEPEST, Scene, Seen};
use super::trial::{Cell, End, Problem, distance};
use crate::library::{Library, Solid};
use crate::mesh::P3;
use anyhow::Result;
use shellwarp::ffi::state::SW_INTEGRATOR_EXACT;
use std::cell::RefCell;
use std::collections::BTreeSet;

const H: f64 = 1.0 / 60.0;

/// The strip for so many steps, without loads.
fn unloaded(steps: usize) -> Problem {
    Problem { gravity: [0.0; 3], steps: vec![H; steps], ..strip(4) }
}

/// The strip that falls on something for six seconds; its tip would sag by 8 % of its length.
fn falling() -> Problem {
    Problem { steps: vec![1.0 / 30.0; 180], ..strip(4) }
}

/// A ball that meets the strip at three quarters of its length at so many sizes a second.
fn fast(library: &Library) -> Vec<Cell> {
    let of = |(speed, h): &(f64, f64)| {
        let problem = Problem { steps: vec![*h; 20], ..unloaded(0) };
        let (x, way, radius) = (0.75 * problem.mesh.length(), speed * problem.size() * h, 0.3);
        let place = move |steps: usize| [x, 0.0, -radius - 0.37 * way + steps as f64 * way];
        let case = format!("ball at {speed} sizes/s, steps of {h:.3} s");
        Scene::new(case, problem, vec![Collider::led(Solid::Ball(radius), place)]).stays_out(library)
    };
    let cases =
        [(0.1, H), (1.0, H), (1.0, 1.0 / 15.0), (10.0, 1e-3), (10.0, H), (10.0, 1.0 / 15.0), (100.0, H), (1000.0, H)];
    cases.iter().flat_map(of).collect()
}

/// Of the lines between vertices that cross the line x = `at`: how far the lowest is below `height`.
fn below(problem: &Problem, positions: &[P3], at: f64, height: f64) -> f64 {
    let edges = problem.mesh.triangles.iter().flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
    let crossing = edges.filter_map(|edge| {
        let [a, b] = edge.map(|v| positions[v as usize]);
        let t = (at - a[0]) / (b[0] - a[0]);
        (0.0..=1.0).contains(&t).then_some(a[2] + t * (b[2] - a[2]))
    });
    height - crossing.fold(f64::INFINITY, f64::min)
}

/// Plates and rods under the outer half: what is thinner than a step is long, or than an edge.
fn thin(library: &Library) -> Vec<Cell> {
    let mut cells = vec![];
    let problem = falling();
    let (size, length) = (problem.size(), problem.mesh.length());
    let top = -0.02 * size;
    for half in [1e-2, 1e-4, 1e-6, 1e-9] {
        let thick = half * size;
        let plate = Solid::Box([0.75 * length, length, thick]);
        let collider = Collider::still(plate, [1.25 * length, 0.0, top - thick]);
        let scene = Scene {
            why: Some("so thin that what is inside is as near to its other side"),
            ..Scene::new(format!("plate of thickness {:e} of the size", 2.0 * half), problem.clone(), vec![collider])
        };
        let over = |x: &&P3| x[0] > 0.5 * length;
        let error =
            |seen: &Seen, _: &End| seen.before.iter().filter(over).map(|x| top - x[2]).fold(0.0, f64::max) / size;
        cells.extend(
            common().map(|m| scene.judged(library, m, ("no vertex below its top, of the size", DEEPEST), &error)),
        );
    }
    for radius in [1e-1, 2e-2, 1e-2, 1e-3, 1e-6] {
        // Between the columns of vertices, and between their quarters.
        let (x, radius_of) = (0.78 * length, radius * size);
        let rod = Collider::still(Solid::Rod(radius_of, length), [x, 0.0, top - radius_of]);
        let scene = Scene {
            why: (radius_of < 0.05)
                .then_some("passes between the points of the shell that are looked at, a quarter of an edge apart"),
            ..Scene::new(format!("rod of radius {radius:e} of the size across"), problem.clone(), vec![rod])
        };
        let error = |seen: &Seen, _: &End| below(&scene.problem, &seen.before, x, top).max(0.0) / size;
        cells.extend(
            common().map(|m| scene.judged(library, m, ("no edge below its top, of the size", DEEPEST), &error)),
        );
    }
    cells
}

/// What touches where the shell rests, by the distance that the shell goes.
fn at_rest(library: &Library) -> Vec<Cell> {
    let mut cells = vec![];
    let plane = |over: bool| Collider { over, ..Collider::still(Solid::Plane, [0.0; 3]) };
    let cases: [(&str, f64, Vec<Collider>); 5] = [
        ("a plane touches at rest, no load", 0.0, vec![plane(false)]),
        ("a plane carries it", 1.0, vec![plane(false)]),
        ("a plane carries 1e3 of its weight", 1e3, vec![plane(false)]),
        ("a plane carries 1e6 of its weight", 1e6, vec![plane(false)]),
        ("two planes touch at rest on either side", 1.0, vec![plane(false), plane(true)]),
    ];
    for (case, weight, colliders) in cases {
        let base = Problem { steps: vec![H; 120], ..strip(4) };
        let problem = Problem { gravity: base.gravity.map(|g| weight * g), ..base };
        let size = problem.size();
        let scene = Scene::new(case, problem, colliders);
        let error = |_: &Seen, end: &End| end.displacement / size;
        cells.extend(common().map(|m| scene.judged(library, m, ("it stays, of the size", DEEPEST), &error)));
    }
    // Nothing holds it but the plane.
    let areas: f64 = strip(4).mesh.vertex_areas().iter().sum();
    for (g, steps) in [(9.81, 1), (9.81, 60), (0.05, 1), (0.05, 60)] {
        let gravity = [0.0, 0.0, -g];
        let problem = Problem { fixed: vec![], modes: 16, steps: vec![H; 120], damping: 0.0, gravity, ..strip(4) };
        let weight = g * areas * problem.material.density;
        let case = format!("a free strip on a plane, g = {g}, force over the last {steps} steps");
        let why = Some(
            "falls by less in a step, g h², than rounds leave of gaps, 2e-5 of the size: its force comes in pulses",
        );
        let scene = Scene { why, ..Scene::new(case, problem, vec![plane(false)]) };
        let error = |seen: &Seen, _: &End| {
            let last = seen.impulse.iter().rev().take(steps).map(|i| i[2]).sum::<f64>();
            (last / (steps as f64 * H) / weight - 1.0).abs()
        };
        cells.extend(common().map(|m| scene.judged(library, m, ("the plane's force is its weight", 0.01), &error)));
    }
    cells
}

/// A ball in which the strip lies when it starts, and planes; five seconds later it is out.
fn deep(library: &Library) -> Vec<Cell> {
    let mut cells = vec![];
    for share in [0.001, 0.01, 0.05, 0.1] {
        let problem = unloaded(300);
        let middle = problem.mesh.nearest([0.75 * problem.mesh.length(), 0.0]);
        let (x, radius, size) = (problem.mesh.positions[middle][0], 0.3, problem.size());
        let ball = Collider::still(Solid::Ball(radius), [x, 0.0, share * size - radius]);
        let scene = Scene::new(format!("starts {share} of its size deep in a ball"), problem, vec![ball]);
        cells.extend(Scene { at_end: true, ..scene }.stays_out(library));
    }
    for share in [0.001, 0.01, 0.05] {
        let problem = unloaded(300);
        let (half, size) = (0.5 * problem.mesh.length(), problem.size());
        let plane = Collider::still(Solid::Plane, [0.0, 0.0, share * size]);
        let scene =
            Scene::new(format!("starts {share} of its size below a plane; its outer half"), problem, vec![plane]);
        let looked_at = Box::new(move |x: &P3| x[0] > half);
        cells.extend(Scene { at_end: true, looked_at, ..scene }.stays_out(library));
    }
    let problem = unloaded(120);
    let size = problem.size();
    let closing = |sign: f64| {
        let place = move |steps: usize| [0.0, 0.0, sign * size * (0.005 - 0.02 * (steps as f64 / 60.0).min(1.0))];
        Collider { over: sign > 0.0, ..Collider::led(Solid::Plane, place) }
    };
    // They overlap by 3 % of its size: at best 1.5 % is left in each.
    let why = Some("there is no room between them: 1.5 % of the size is left at best");
    let scene = Scene::new("squeezed by planes that overlap", problem, vec![closing(1.0), closing(-1.0)]);
    cells.extend(Scene { at_end: true, why, ..scene }.stays_out(library));
    cells
}

/// How far a free strip slides down a slope in the second half of a second, and how a plane takes it along.
fn friction(library: &Library) -> Vec<Cell> {
    const N: usize = 60;
    const G: f64 = 9.81;
    let free = |gravity: P3| Problem { fixed: vec![], modes: 16, damping: 0.0, gravity, steps: vec![H; N], ..strip(4) };
    let way = |seen: &Seen| seen.middle[N - 1][0] - seen.middle[N / 2 - 1][0];
    let mut cells = vec![];
    let slope: f64 = 0.3;
    let (sin, cos) = slope.atan().sin_cos();
    for mu in [0.0, 0.25, 0.35, 1e3, 1e9] {
        let plane = Collider { friction: mu, ..Collider::still(Solid::Plane, [0.0; 3]) };
        let scene = Scene::new(format!("slope of 0.3, friction {mu:e}"), free([G * sin, 0.0, -G * cos]), vec![plane]);
        for m in common() {
            let error = |seen: &Seen, _: &End| {
                // Speeds grow evenly; backward Euler's position is that of the speed at the step's end.
                let late = if m.integrator == SW_INTEGRATOR_EXACT { 0.0 } else { 0.5 };
                let steps = |n: f64| 0.5 * n * n + late * n;
                let ways = H * H * (steps(N as f64) - steps(0.5 * N as f64));
                (way(seen) - G * cos * (slope - mu).max(0.0) * ways).abs() / (G * sin * ways)
            };
            cells.push(scene.judged(library, m, ("Coulomb's law, of the way without friction", 0.02), &error));
        }
    }
    for mu in [0.0, 0.8, 1e9] {
        // A twentieth of a second's speed is reached in a third of the time, by 0.3 of what friction 1 could do.
        let led = |steps: usize| {
            let n = steps as f64;
            let x = if steps <= 20 { 0.5 * n * (n + 1.0) } else { 210.0 + 20.0 * (n - 20.0) };
            [3.0 * H * H * x, 0.0, 0.0]
        };
        let plane = Collider { friction: mu, ..Collider::led(Solid::Plane, led) };
        let scene = Scene::new(format!("a plane that speeds up, friction {mu:e}"), free([0.0, 0.0, -G]), vec![plane]);
        let expected = if mu > 0.0 { led(N)[0] - led(N / 2)[0] } else { 0.0 };
        let error = |seen: &Seen, _: &End| (way(seen) - expected).abs() / (led(N)[0] - led(N / 2)[0]);
        cells.extend(common().map(|m| scene.judged(library, m, ("Coulomb's law, of the plane's way", 0.02), &error)));
    }
    cells
}

/// A ball that rises by 2 % of the size into the strip: stiffness and mass at given gravity, and the same in other units.
fn extremes(library: &Library) -> Vec<Cell> {
    let mut cells = vec![];
    let base = Problem { steps: vec![1.0 / 30.0; 90], ..strip(4) };
    let (x, size) = (0.75 * base.mesh.length(), base.size());
    let ball = |scale: f64, offset: f64| {
        let place = move |steps: usize| {
            let rise = 0.02 * size * (steps as f64 / 30.0).min(1.0);
            [x, 0.0, rise - 0.3].map(|c| c * scale + offset)
        };
        Collider { friction: 0.3, ..Collider::led(Solid::Ball(0.3 * scale), place) }
    };
    let stiff = [1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9].map(|k| (format!("stiffness × {k:e}"), k, 1.0));
    let heavy = [1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9].map(|m| (format!("mass × {m:e}"), 1.0, m));
    for (name, stiffness, mass) in stiff.into_iter().chain(heavy) {
        let mut problem = base.clone();
        let m = &mut problem.material;
        [&mut m.area, &mut m.length, &mut m.bend].into_iter().for_each(|k| *k *= stiffness);
        m.density *= mass;
        cells.extend(Scene::new(format!("a ball rises, {name}"), problem, vec![ball(1.0, 0.0)]).stays_out(library));
    }
    let units: [(&str, [f64; 4]); 7] = [
        ("stiffness × 1e12", [1.0, 1e12, 1.0, 0.0]),
        ("stiffness × 1e-12", [1.0, 1e-12, 1.0, 0.0]),
        ("mass × 1e12", [1.0, 1.0, 1e12, 0.0]),
        ("mass × 1e-12", [1.0, 1.0, 1e-12, 0.0]),
        ("size × 1e-6", [1e-6, 1.0, 1.0, 0.0]),
        ("size × 1e6", [1e6, 1.0, 1.0, 0.0]),
        ("1e3 from the origin", [1.0, 1.0, 1.0, 1e3]),
    ];
    for m in common() {
        let end_of = |scene: &Scene| -> Result<Vec<P3>> {
            let kept = RefCell::new(vec![]);
            let error = |_: &Seen, end: &End| {
                kept.replace(end.positions.clone());
                0.0
            };
            let cell = scene.judged(library, m, ("", 1.0), &error);
            anyhow::ensure!(!kept.borrow().is_empty(), "{}", cell.note);
            Ok(kept.take())
        };
        let expected = end_of(&Scene::new("", base.clone(), vec![ball(1.0, 0.0)]));
        for (name, [length, stiffness, mass, offset]) in &units {
            let problem = in_units(&base, *length, *stiffness, *mass, *offset);
            let scene = Scene {
                why: Some("rounds end within 2e-5 of the size, which rounding decides"),
                ..Scene::new(format!("a ball rises, units: {name}"), problem, vec![ball(*length, *offset)])
            };
            let error = |_: &Seen, end: &End| {
                let back = |x: &P3| x.map(|x| (x - offset) / length);
                let positions: Vec<P3> = end.positions.iter().map(back).collect();
                let of = |expected: &Vec<P3>| distance(&positions, expected, &base.mesh.positions, 1e-6);
                expected.as_ref().map_or(f64::NAN, of)
            };
            // A thousandth of its way is what rounds may leave.
            cells.push(scene.judged(library, m, ("the same in other units", 5e-3), &error));
        }
    }
    cells
}

/// A free strip that falls flat on a plane, by the height in sizes.
fn drops(library: &Library) -> Vec<Cell> {
    let mut cells = vec![];
    for height in [0.01, 0.1, 1.0, 10.0, 100.0] {
        let problem = Problem { fixed: vec![], modes: 16, damping: 0.0, gravity: [0.0, 0.0, -9.81], ..strip(4) };
        let way = height * problem.size();
        // A second after it lands.
        let steps = ((2.0 * way / 9.81).sqrt() / H).ceil() as usize + 60;
        let problem = Problem { steps: vec![H; steps], ..problem };
        let plane = Collider { friction: 0.3, ..Collider::still(Solid::Plane, [0.0, 0.0, -way]) };
        let case = format!("a free strip falls from {height} sizes onto a plane");
        cells.extend(Scene::new(case, problem, vec![plane]).stays_out(library));
    }
    cells
}

/// The held strip falls onto a bed of balls, each under a vertex of its outer half.
fn beds(library: &Library) -> Vec<Cell> {
    let mut cells = vec![];
    for [along, across] in [[1, 1], [2, 2], [5, 4], [10, 5], [20, 10]] {
        let problem = falling();
        let (length, width) = (problem.mesh.length(), 0.8);
        let apart = [0.5 * length / along as f64, width / across as f64];
        let radius = 0.5 * apart[0].min(apart[1]);
        let top = -0.02 * problem.size();
        let nearest = |k: usize| {
            let [x, y] = [(k % along) as f64, (k / along) as f64];
            problem.mesh.nearest([0.5 * length + (x + 0.5) * apart[0], (y + 0.5) * apart[1] - 0.5 * width])
        };
        let under: BTreeSet<usize> = (0..along * across).map(nearest).collect();
        let ball = |v: &usize| {
            let [x, y, _] = problem.mesh.positions[*v];
            Collider { friction: 0.3, ..Collider::still(Solid::Ball(radius), [x, y, top - radius]) }
        };
        let balls: Vec<Collider> = under.iter().map(ball).collect();
        let case = format!("a bed of {} balls", balls.len());
        cells.extend(Scene::new(case, problem.clone(), balls).stays_out(library));
    }
    cells
}

pub fn all(library: &Library) -> Vec<Cell> {
    [fast, thin, at_rest, deep, friction, extremes, drops, beds].iter().flat_map(|cells| cells(library)).collect()
}
