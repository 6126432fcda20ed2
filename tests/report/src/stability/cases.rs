//! The cases: stiffness, units, steps, damping, moving supports, modes, shapes, folds, handles.

use super::methods;
use super::trial::{Cell, Drive, End, Judge, Problem, distance, judged};
use crate::library::{Library, Material, Pose, State};
use crate::mesh::{Mesh, P3};
use crate::methods::{Family, Method, method};
use crate::scenes::beams::LENGTH;
use anyhow::Result;
use shellwarp::ffi::method::SW_METHOD_SHELL_EXPLICIT;
use shellwarp::ffi::state::{SW_INTEGRATOR_EXACT, SW_INTEGRATOR_SECOND_ORDER};

pub(super) const STILL: Drive = &|_, _: &mut State| Ok(());

/// Everything but the explicit shell, whose steps must be short.
pub(super) fn common() -> impl Iterator<Item = &'static Method> {
    methods().filter(|m| m.method != SW_METHOD_SHELL_EXPLICIT)
}

/// A flat strip, held at one end, that sags by 8 % of its length; its slowest mode swings in 12 s.
pub(super) fn strip(rows: usize) -> Problem {
    let mesh = Mesh::strip(LENGTH, 0.8, rows);
    let fixed = mesh.root();
    let material = Material { area: 1e4, length: 1e4, bend: 1.0, density: 1.0 };
    Problem { mesh, material, sheet: None, fixed, modes: 8, gravity: [0.0, 0.0, -0.05], damping: 1.0, steps: vec![] }
}

/// Half a minute and more at the slowest mode's critical damping: at rest to 1e-5. A nonlinear shell takes fewer, longer steps.
pub(super) fn settling(m: &Method) -> Vec<f64> {
    if m.family == Family::Shell { vec![1.0; 60] } else { vec![1.0 / 30.0; 1800] }
}

pub(super) fn linear_modes(m: &Method, end: &End) -> String {
    let turn = end.rotation.to_degrees();
    match m.family {
        Family::Lma => format!("turned by {turn:.0}°: a linear displacement stretches what turns"),
        Family::Warp => format!("turned by {turn:.0}°: linear modes at large turns, or too few of them"),
        Family::Reduced => format!("turned by {turn:.0}°: beyond what its fields can take on"),
        Family::Shell => "the step's own error".to_owned(),
    }
}

/// Judged by the nonlinear shell at rest, or that of the first of its components `alone`; 5 % is what linear modes are worth at a sag of 8 %.
pub(super) fn by_the_shell(
    library: &Library,
    key: (&'static str, String),
    problem: &Problem,
    alone: Option<&Problem>,
) -> Vec<Cell> {
    let known = alone.unwrap_or(problem);
    let rest = known.at_rest(library, method("shell_implicit"));
    let error = |end: &End| {
        let rest = rest.as_ref().map_err(|e| anyhow::anyhow!("{e}"))?;
        Ok(distance(&end.positions[..rest.len()], rest, &known.mesh.positions, 1e-6 * problem.size()))
    };
    let bound = 100.0 * problem.size();
    let judge = Judge { name: "nonlinear shell at rest", tolerance: 0.05, error: &error, reason: &linear_modes, bound };
    let run = |m| {
        let problem = Problem { steps: settling(m), ..problem.clone() };
        judged(library, key.clone(), m, &problem, STILL, &judge)
    };
    common().map(run).collect()
}

/// A flat sheet's sag does not know its membrane, if it is so small that it is linear: at 8 % of the length a mesh whose lines
/// zigzag across would have to stretch. The load is 1e-9 of the usual.
fn stiffness(library: &Library) -> Vec<Cell> {
    let with = |ratio: f64| {
        let k = ratio / LENGTH.powi(2);
        let base = strip(8);
        let gravity = base.gravity.map(|g| 1e-9 * g);
        Problem { material: Material { area: k, length: k, ..base.material }, gravity, ..base }
    };
    let expected = with(1e4).at_rest(library, method("shell_implicit"));
    let mut cells = vec![];
    for ratio in [1.0, 1e2, 1e4, 1e6, 1e8, 1e10, 1e12, 1e14] {
        let p = with(ratio);
        let error = |end: &End| {
            let expected = expected.as_ref().map_err(|e| anyhow::anyhow!("{e}"))?;
            Ok(distance(&end.positions, expected, &p.mesh.positions, 1e-12))
        };
        let reason = |m: &Method, _: &End| match m.family {
            Family::Shell => {
                "Newton's residual is rounding of the membrane's forces, k · 1e-16, against a load of 1e-10".to_owned()
            }
            _ => "the membrane is so soft that modes in the plane take places among the eight".to_owned(),
        };
        // Eight modes leave 1e-3 of the sag out.
        let name = "nonlinear shell at rest at 1e4, linear load";
        let judge = Judge { name, tolerance: 5e-3, error: &error, reason: &reason, bound: 100.0 };
        for m in common() {
            let p = Problem { steps: settling(m), ..p.clone() };
            cells.push(judged(library, ("membrane to bending k/k_B·L²", format!("{ratio:e}")), m, &p, STILL, &judge));
        }
    }
    cells
}

/// The problem in units of length, stiffness and mass, and the factor on displacements.
pub(super) fn in_units(p: &Problem, length: f64, stiffness: f64, mass: f64, offset: f64) -> Problem {
    let time = length * (mass / stiffness).sqrt();
    let mut q = p.clone();
    q.mesh.positions.iter_mut().flatten().for_each(|x| *x = *x * length + offset);
    q.material = Material {
        area: p.material.area * stiffness / length.powi(2),
        length: p.material.length * stiffness / length,
        bend: p.material.bend * stiffness,
        density: p.material.density * mass / length.powi(2),
    };
    q.gravity = p.gravity.map(|g| g * length / time.powi(2));
    q.damping /= time;
    q.steps.iter_mut().for_each(|h| *h *= time);
    q
}

fn units(library: &Library) -> Vec<Cell> {
    let cases: [(&str, [f64; 4]); 9] = [
        ("stiffness × 1e12", [1.0, 1e12, 1.0, 0.0]),
        ("stiffness × 1e-12", [1.0, 1e-12, 1.0, 0.0]),
        ("mass × 1e12", [1.0, 1.0, 1e12, 0.0]),
        ("mass × 1e-12", [1.0, 1.0, 1e-12, 0.0]),
        ("stiffness × 1e12, mass × 1e-12", [1.0, 1e12, 1e-12, 0.0]),
        ("size × 1e-6", [1e-6, 1.0, 1.0, 0.0]),
        ("size × 1e6", [1e6, 1.0, 1.0, 0.0]),
        ("1e6 from the origin", [1.0, 1.0, 1.0, 1e6]),
        ("size × 1e-3, 1e3 from the origin", [1e-3, 1.0, 1.0, 1e3]),
    ];
    let mut cells = vec![];
    for m in methods() {
        let explicit = m.method == SW_METHOD_SHELL_EXPLICIT;
        let mut base = strip(4);
        base.steps = if explicit { vec![5e-5; 4000] } else { vec![1.0 / 30.0; 60] };
        let expected = base.run(library, m, STILL);
        for (name, [length, stiffness, mass, offset]) in &cases {
            let problem = in_units(&base, *length, *stiffness, *mass, *offset);
            let error = |end: &End| {
                let base_end = expected.as_ref().map_err(|e| anyhow::anyhow!("{e}"))?;
                let back = |x: &P3| x.map(|x| (x - offset) / length);
                let positions: Vec<P3> = end.positions.iter().map(back).collect();
                Ok(distance(&positions, &base_end.positions, &base.mesh.positions, 1e-6))
            };
            let reason = |m: &Method, _: &End| match m.family {
                Family::Shell => {
                    "coordinates keep 16 digits, of which the offset takes its share from the strains".into()
                }
                Family::Reduced => "samples are chosen one by one, where rounding may turn a choice".into(),
                _ => "coordinates keep 16 digits, of which the offset takes its share from the modes".to_owned(),
            };
            // 32 bits of basis, Newton's tolerance of the shell, and 1e-10 of coordinates far away over strains of 1e-4.
            let judge = Judge {
                name: "the same in other units",
                tolerance: 1e-4,
                error: &error,
                reason: &reason,
                bound: 100.0 * problem.size(),
            };
            cells.push(judged(library, ("units", (*name).to_owned()), m, &problem, STILL, &judge));
        }
    }
    cells
}

/// Numbers in [0, 1), always the same.
fn random(count: usize) -> Vec<f64> {
    let mut seed = 1u64;
    let mut next = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..count).map(|_| next()).collect()
}

/// Kinetic over elastic energy of a shell that still creeps, but goes nowhere.
const AT_REST: f64 = 1e-6;

/// Judged by the rest of the method itself, reached in even steps of 1/30 s.
fn by_its_rest(
    library: &Library,
    key: (&'static str, String),
    m: &'static Method,
    problem: &Problem,
    drive: Drive,
) -> Cell {
    let even = Problem { steps: settling(m), ..problem.clone() };
    let expected = even.run(library, m, STILL);
    let floor = 1e-3 * problem.size();
    let error = |end: &End| {
        let expected = expected.as_ref().map_err(|e| anyhow::anyhow!("{e}"))?;
        Ok(distance(&end.positions, &expected.positions, &problem.mesh.positions, floor))
    };
    let reason = |_: &Method, end: &End| {
        let share = end.kinetic / end.elastic.max(f64::MIN_POSITIVE);
        if share < AT_REST {
            "rests in another shape: what its handles folded over stays folded".to_owned()
        } else {
            format!("it has not come back to rest: kinetic energy {share:.0e} of the elastic")
        }
    };
    // The rest is reached to 1e-5; 32 bits of basis besides.
    let bound = 1e4 * problem.size();
    let judge = Judge { name: "its own rest in even steps", tolerance: 1e-3, error: &error, reason: &reason, bound };
    judged(library, key, m, problem, drive, &judge)
}

fn steps(library: &Library) -> Vec<Cell> {
    let mut cells = vec![];
    for m in methods() {
        for h in [1e-6, 1e-3, 0.1, 1.0, 10.0] {
            let mut p = strip(4);
            p.steps = vec![h; 200];
            p.steps.extend(settling(m));
            cells.push(by_its_rest(library, ("step h", format!("200 of {h:e} s, then rest")), m, &p, STILL));
        }
        let mut p = strip(4);
        p.steps = random(300).iter().map(|x| 10f64.powf(7.0 * x - 6.0)).collect();
        p.steps.extend(settling(m));
        cells.push(by_its_rest(library, ("step h", "1e-6 to 10 s at random".to_owned()), m, &p, STILL));
    }
    cells
}

fn damping(library: &Library) -> Vec<Cell> {
    let mut cells = vec![];
    for m in common() {
        for xi in [0.0, 1e-3, 0.1] {
            let steps = vec![1.0 / 30.0; if m.family == Family::Shell { 400 } else { 6000 }];
            let p = Problem { damping: xi, steps, ..strip(4) };
            let rest = p.at_rest(library, m);
            let error = |end: &End| {
                let rest = rest.as_ref().map_err(|e| anyhow::anyhow!("{e}"))?;
                let moved = |x: &P3, r: &P3| (0..3).map(|c| (x[c] - r[c]).powi(2)).sum::<f64>().sqrt();
                let most = rest.iter().zip(&p.mesh.positions).map(|(x, r)| moved(x, r)).fold(0.0, f64::max);
                Ok((end.displacement / (2.0 * most) - 1.0).max(0.0))
            };
            let reason = |_: &Method, _: &End| "it swings higher than it fell".to_owned();
            // Higher modes are not in step with the first: a few percent above twice the sag.
            let name = "energy: a released shell swings to at most twice its sag";
            let judge = Judge { name, tolerance: 0.05, error: &error, reason: &reason, bound: 100.0 };
            cells.push(judged(library, ("damping ξ", format!("{xi:e} 1/s, released")), m, &p, STILL, &judge));
        }
        let creeping = |xi: f64| Problem { damping: xi, steps: vec![xi * 0.1; 60], ..strip(4) };
        let expected = creeping(1e6).run(library, m, STILL);
        for xi in [1e4, 1e8, 1e10, 1e12] {
            let p = creeping(xi);
            let error = |end: &End| {
                let expected = expected.as_ref().map_err(|e| anyhow::anyhow!("{e}"))?;
                Ok(distance(&end.positions, &expected.positions, &p.mesh.positions, 1e-6))
            };
            let reason = |_: &Method, _: &End| "it does not creep as its time scale says".to_owned();
            let name = "creep: steps as long as the damping is large give the same motion";
            let judge = Judge { name, tolerance: 1e-3, error: &error, reason: &reason, bound: 100.0 };
            cells.push(judged(
                library,
                ("damping ξ", format!("{xi:e} 1/s, steps of {:e} s", 0.1 * xi)),
                m,
                &p,
                STILL,
                &judge,
            ));
        }
    }
    cells
}

fn supports(library: &Library) -> Vec<Cell> {
    let mut cells = vec![];
    for m in common() {
        for revolutions in [0.01, 0.1, 1.0, 10.0, 100.0] {
            let omega = std::f64::consts::TAU * revolutions;
            let h = 1.0 / 60.0;
            let steps = vec![h; 60];
            let spin = |k: usize, state: &mut State| {
                let t = (k + 1) as f64 * h;
                state.set_frame(&Pose { origin: [[0.0; 3]; 3], yaw: [omega * t, omega, 0.0] })
            };
            let p = Problem { steps, ..strip(4) };
            let shell = p.run(library, method("shell_implicit"), &spin);
            let error = |end: &End| {
                let shell = shell.as_ref().map_err(|e| anyhow::anyhow!("the nonlinear shell: {e}"))?;
                Ok(distance(&end.positions, &shell.positions, &p.mesh.positions, 0.01))
            };
            let reason = |m: &Method, end: &End| {
                match m.family {
                Family::Reduced => {
                    let turn = end.rotation.to_degrees();
                    format!("turned by {turn:.0}°; the centrifugal force stretches it in ways that its fields do not hold")
                }
                _ => "linear modes have no centrifugal stiffening: past the slowest mode's frequency, 0.08 Hz, the load exceeds K"
                    .into(),
            }
            };
            let judge = Judge {
                name: "nonlinear shell, same steps",
                tolerance: 0.05,
                error: &error,
                reason: &reason,
                bound: 1e4,
            };
            if m.family != Family::Shell {
                cells.push(judged(
                    library,
                    ("support", format!("{revolutions} rev/s from rest, 1 s")),
                    m,
                    &p,
                    &spin,
                    &judge,
                ));
            } else {
                let bounded = |end: &End| Ok((end.displacement / (2.0 * LENGTH) - 1.0).max(0.0));
                let name = "no point farther than to the other side";
                let far = |_: &Method, _: &End| "it is torn by the centrifugal force, ρΩ²L² against k".to_owned();
                let judge = Judge { name, tolerance: 1e-9, error: &bounded, reason: &far, bound: 1e6 };
                cells.push(judged(
                    library,
                    ("support", format!("{revolutions} rev/s from rest, 1 s")),
                    m,
                    &p,
                    &spin,
                    &judge,
                ));
            }
        }
        let jump = |k: usize, state: &mut State| match k {
            5 => state.set_place([10.0 * LENGTH, 0.0, 10.0 * LENGTH]),
            20 => state.set_place([0.0; 3]),
            _ => Ok(()),
        };
        let mut p = strip(4);
        p.steps = vec![1.0 / 30.0; 40];
        p.steps.extend(settling(m));
        cells.push(by_its_rest(library, ("support", "jumps of 10 lengths in a frame".to_owned()), m, &p, &jump));
    }
    cells
}

fn modes(library: &Library) -> Vec<Cell> {
    let counts = [1, 2, 4, 8, 16, 64, 200, 1000];
    let of = |n: &usize| {
        let key = ("modes", format!("{n} of {} unknowns", 3 * (strip(4).mesh.positions.len() - strip(4).fixed.len())));
        by_the_shell(library, key, &Problem { modes: *n, ..strip(4) }, None)
    };
    counts.iter().flat_map(of).collect()
}

fn folds(library: &Library) -> Vec<Cell> {
    let angles = [0.0, 45.0, 90.0, 135.0, 170.0, 179.0, 179.9];
    let of = |fold: &f64| {
        let (sin, cos) = (0.5 * fold).to_radians().sin_cos();
        let base = strip(4);
        let mesh = base.mesh.clone().shaped(|[x, y]| [x, y * cos, y.abs() * sin]);
        by_the_shell(library, ("rest fold", format!("{fold}°")), &Problem { mesh, ..base }, None)
    };
    angles.iter().flat_map(of).collect()
}

fn mesh_of(positions: Vec<P3>, triangles: Vec<[u32; 3]>) -> Mesh {
    let place = positions.iter().map(|p| [p[0], p[1]]).collect();
    Mesh { positions, triangles, place }
}

/// Both in one mesh, the second scaled and moved aside.
fn beside(a: &Mesh, b: &Mesh, scale: f64) -> Mesh {
    let n = a.positions.len() as u32;
    let mut positions = a.positions.clone();
    positions.extend(b.positions.iter().map(|p| [p[0] * scale, p[1] * scale + 3.0, p[2] * scale]));
    let mut triangles = a.triangles.clone();
    triangles.extend(b.triangles.iter().map(|t| t.map(|v| v + n)));
    mesh_of(positions, triangles)
}

fn shapes() -> Vec<(&'static str, Mesh, Vec<u32>)> {
    let square = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.2]];
    let needle = |l: f64| vec![[0.0, 0.0, 0.0], [l, 0.0, 0.0], [0.5 * l, 1.0, 0.0], [0.5 * l, -1.0, 0.3]];
    let one_wide = Mesh::strip(LENGTH, 0.2, 1);
    let root = one_wide.root();
    let octahedron = {
        let p = vec![
            [1.0, 0.0, 0.0],
            [-1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, -1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 0.0, -1.0],
        ];
        let t = vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
        mesh_of(p, t)
    };
    let sheet = Mesh::strip(LENGTH, 0.8, 4);
    let all: Vec<u32> = (0..sheet.positions.len() as u32).collect();
    let n = sheet.positions.len() as u32;
    let both: Vec<u32> = sheet.root().into_iter().flat_map(|v| [v, v + n]).collect();
    vec![
        ("one triangle, free", mesh_of(square[..3].to_vec(), vec![[0, 1, 2]]), vec![]),
        ("two triangles, free", mesh_of(square.clone(), vec![[0, 1, 2], [0, 2, 3]]), vec![]),
        ("two triangles, one edge held", mesh_of(square, vec![[0, 1, 2], [0, 2, 3]]), vec![0, 1]),
        ("strip one triangle wide, held", one_wide, root),
        ("needles 1 : 1e6, free", mesh_of(needle(1e6), vec![[0, 1, 2], [1, 0, 3]]), vec![]),
        ("closed octahedron, free", octahedron.clone(), vec![]),
        ("closed octahedron, held at one vertex", octahedron, vec![4]),
        ("two strips, free", beside(&sheet, &sheet, 1.0), vec![]),
        ("two strips of sizes 1 : 1e6, free", beside(&sheet, &sheet, 1e-6), vec![]),
        ("two strips of sizes 1 : 1e6, held", beside(&sheet, &sheet, 1e-6), both),
        ("all vertices fixed", sheet.clone(), all),
        ("free strip", sheet.clone(), vec![]),
        ("hinged along an end", sheet.clone(), sheet.vertices_where(|_, p| p[0] < 0.0)),
        ("held at one vertex", sheet.clone(), vec![sheet.nearest([0.0, 0.0]) as u32]),
    ]
}

/// What a shape without rest is judged by: the fall of its centre, or what hangs not being longer than it was.
fn topology(library: &Library) -> Vec<Cell> {
    let mut cells = vec![];
    for (name, mesh, fixed) in shapes() {
        let base = Problem { mesh, fixed, gravity: [0.0, 0.0, -0.05], ..strip(4) };
        let rests = !base.fixed.is_empty() && !["one vertex", "hinged", "one edge"].iter().any(|w| name.contains(w));
        if rests {
            let alone = name.contains("two strips").then(|| Problem { gravity: base.gravity, ..strip(4) });
            cells.extend(by_the_shell(library, ("shape", name.to_owned()), &base, alone.as_ref()));
            continue;
        }
        for m in common() {
            let h = 1.0 / 30.0;
            let p = Problem { steps: vec![h; 30], damping: 0.0, ..base.clone() };
            let areas = p.mesh.vertex_areas();
            let total: f64 = areas.iter().sum();
            let rest = &p.mesh.positions;
            let fallen = |end: &End| {
                let drop = |v: usize| areas[v] / total * (end.positions[v][2] - rest[v][2]);
                let drop: f64 = (0..rest.len()).map(drop).sum();
                // Backward Euler falls by h/2 a second more; the exact propagator and steps of second order do not.
                let exact = [SW_INTEGRATOR_EXACT, SW_INTEGRATOR_SECOND_ORDER].contains(&m.integrator)
                    || m.family == Family::Reduced;
                let late = if exact { 0.0 } else { h };
                Ok((drop / (-0.5 * 0.05 * (1.0 + late)) - 1.0).abs())
            };
            let stretched = |end: &End| {
                let apart =
                    |x: &[P3], a: u32, b: u32| distance(&[x[a as usize]], &[x[b as usize]], &[x[b as usize]], 1.0);
                let edges = p.mesh.triangles.iter().flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
                let ratio = |[a, b]: [u32; 2]| (apart(&end.positions, a, b) / apart(rest, a, b) - 1.0).abs();
                Ok(edges.map(ratio).fold(0.0, f64::max))
            };
            let key = ("shape", name.to_owned());
            let bound = 100.0 * p.size().max(1.0);
            let cell = if p.fixed.is_empty() {
                // 32 bits of basis.
                let reason = |m: &Method, _: &End| match m.family {
                    Family::Shell => "the step's own error".to_owned(),
                    _ => "rigid modes that are left out, or lost to rounding".to_owned(),
                };
                let name = "its centre's free fall";
                let judge = Judge { name, tolerance: 1e-4, error: &fallen, reason: &reason, bound };
                judged(library, key, m, &p, STILL, &judge)
            } else {
                let judge = Judge {
                    name: "no edge changes by 2 %",
                    tolerance: 0.02,
                    error: &stretched,
                    reason: &linear_modes,
                    bound,
                };
                judged(library, key, m, &p, STILL, &judge)
            };
            cells.push(cell);
        }
    }
    cells
}

fn handles(library: &Library) -> Vec<Cell> {
    let base = strip(4);
    let tip = base.mesh.nearest([LENGTH, 0.0]) as u32;
    let near = {
        let first = base.mesh.vertices_where(|_, p| p[0] > 0.0);
        let outside = |v: &u32| !base.fixed.contains(v);
        let by_x = |a: &u32, b: &u32| base.mesh.place[*a as usize][0].total_cmp(&base.mesh.place[*b as usize][0]);
        first.into_iter().filter(outside).min_by(by_x).unwrap_or(tip)
    };
    let at = |v: u32| base.mesh.positions[v as usize];
    type Step<'a> = Box<dyn Fn(usize, &mut State) -> Result<()> + 'a>;
    let torn = |v: u32| -> Step {
        Box::new(move |k, state| match k {
            1..=12 => state.hold(1, v, 7, {
                let [x, y, z] = at(v);
                [x, y, z + 100.0 * LENGTH * k as f64 / 60.0]
            }),
            13 => state.release(1),
            _ => Ok(()),
        })
    };
    let coincident: Step = Box::new(|k, state| {
        let [x, y, z] = at(tip);
        match k {
            1 => state.hold(1, tip, 7, [x, y, z + 0.5]).and_then(|()| state.hold(2, tip, 7, [x, y, z - 1.0])),
            30 => state.hold(2, near, 7, [x, y, z + 0.5]),
            60 => state.release(1).and_then(|()| state.release(2)),
            _ => Ok(()),
        }
    });
    let cases: [(&str, Step); 3] = [
        ("tip torn away at 100 lengths/s, let go", torn(tip)),
        ("the same at a vertex next to supports", torn(near)),
        ("one vertex to two places, two vertices to one", coincident),
    ];
    let mut cells = vec![];
    for m in common() {
        for (name, drive) in &cases {
            let mut p = base.clone();
            p.steps = vec![1.0 / 60.0; 70];
            p.steps.extend(settling(m));
            p.steps.extend(settling(m));
            cells.push(by_its_rest(library, ("handle", (*name).to_owned()), m, &p, drive));
        }
    }
    cells
}

type Group = fn(&Library) -> Vec<Cell>;

const GROUPS: [(&str, Group); 11] = [
    ("stiffness", stiffness),
    ("units", units),
    ("steps", steps),
    ("damping", damping),
    ("supports", supports),
    ("modes", modes),
    ("folds", folds),
    ("shapes", topology),
    ("handles", handles),
    ("material", super::material::all),
    ("contact", super::contact::all),
];

pub fn all(library: &Library) -> Vec<Cell> {
    let start = std::time::Instant::now();
    let run = |(name, group): &(&str, Group)| {
        eprintln!("stability: {:4.0} s  {name}", start.elapsed().as_secs_f64());
        group(library)
    };
    GROUPS.iter().flat_map(run).collect()
}

pub fn of_group(library: &Library, name: &str) -> Result<Vec<Cell>> {
    let Some((_, group)) = GROUPS.iter().find(|(n, _)| *n == name) else {
        let names = GROUPS.map(|(n, _)| n).join(", ");
        anyhow::bail!("no group {name}: there are {names}");
    };
    Ok(group(library))
}
