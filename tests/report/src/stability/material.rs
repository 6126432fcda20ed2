//! Sheets that vary strongly, creases and grain: thickness and Young's modulus along a strip, hinges along its middle, moduli that differ by direction.

use super::cases::{STILL, by_the_shell, common, settling, strip};
use super::trial::{Cell, End, Judge, Problem, distance, judged};
use crate::library::{Library, Sheet};
use crate::methods::{Family, Method, method};
use shellwarp::ffi::material::{SW_MAP_THICKNESS, SW_MAP_YOUNG};

const THICKNESS: f64 = 0.01;

/// Radian frequency of the plain strip's slowest swing: its mass damping is near the critical one.
const SWING: f64 = 0.52;

/// How far a strip sags whose load is linear, of its length.
const SAG: f64 = 1e-9;

/// A sheet as stiff and heavy as the plain strip of the other groups.
fn sheet() -> Sheet {
    let young = 12.0 * 6.0 / THICKNESS.powi(3);
    Sheet { young, thickness: THICKNESS, density: 1.0 / THICKNESS, map: None, creases: vec![], grain: None }
}

/// Deflection of a beam clamped at 0 under its weight, by its rigidity and mass at a place: the closed form, integrated in small steps.
struct Beam {
    dx: f64,
    /// At multiples of dx.
    w: Vec<f64>,
    /// Rayleigh's quotient of that shape.
    swing: f64,
}

impl Beam {
    fn new(length: f64, rigidity: impl Fn(f64) -> f64, mass: impl Fn(f64) -> f64) -> Self {
        const STEPS: usize = 20_000;
        let dx = length / STEPS as f64;
        let at = |k: usize| (k as f64 + 0.5) * dx;
        let (mut shear, mut moment, mut bend) = (0.0, 0.0, vec![0.0; STEPS]);
        for k in (0..STEPS).rev() {
            let weight = mass(at(k)) * dx;
            bend[k] = (moment + 0.5 * (shear + 0.25 * weight) * dx) / rigidity(at(k));
            moment += (shear + 0.5 * weight) * dx;
            shear += weight;
        }
        let (mut slope, mut w) = (0.0, vec![0.0]);
        for (k, bend) in bend.iter().enumerate() {
            w.push(w[k] + (slope + 0.5 * bend * dx) * dx);
            slope += bend * dx;
        }
        let sum = |power: i32| (0..STEPS).map(|k| mass(at(k)) * w[k + 1].powi(power)).sum::<f64>();
        let swing = (sum(1) / sum(2)).sqrt();
        Self { dx, w, swing }
    }

    fn at(&self, x: f64) -> f64 {
        self.w[((x / self.dx).round().max(0.0) as usize).min(self.w.len() - 1)]
    }

    fn tip(&self) -> f64 {
        self.w[self.w.len() - 1]
    }
}

/// A strip whose thickness or modulus goes from 1 at its root to `contrast` at its tip, and how it hangs.
fn graded(quantity: u32, contrast: f64) -> (Problem, Vec<[f64; 3]>) {
    let base = strip(8);
    let length = base.mesh.length();
    let grade = |x: f64| contrast.powf((x / length).clamp(0.0, 1.0));
    let power = if quantity == SW_MAP_THICKNESS { 3 } else { 1 };
    let mass = |x: f64| if quantity == SW_MAP_THICKNESS { grade(x) } else { 1.0 };
    let soft = Beam::new(length, |x| 6.0 * grade(x).powi(power), mass);
    let mut sheet = sheet();
    let stiffer = (SWING / soft.swing).powi(2); // so that it swings as the plain strip does
    sheet.young *= stiffer;
    let uniform = if quantity == SW_MAP_THICKNESS { sheet.thickness } else { sheet.young };
    sheet.map = Some((quantity, base.mesh.place.iter().map(|p| uniform * grade(p[0])).collect()));
    let gravity = SAG * length * stiffer / soft.tip();
    let hung = |p: &[f64; 3]| [p[0], p[1], -gravity / stiffer * soft.at(p[0])];
    let expected = base.mesh.positions.iter().map(hung).collect();
    (Problem { sheet: Some(sheet), gravity: [0.0, 0.0, -gravity], ..base }, expected)
}

fn contrasts(library: &Library) -> Vec<Cell> {
    let mut cells = vec![];
    let quantities = [(SW_MAP_THICKNESS, "thickness"), (SW_MAP_YOUNG, "Young's modulus")];
    for (quantity, name, contrast) in
        quantities.into_iter().flat_map(|(q, name)| [1e-6, 1e-3, 1.0, 1e3, 1e6].map(|c| (q, name, c)))
    {
        let (p, expected) = graded(quantity, contrast);
        let error = |end: &End| Ok(distance(&end.positions, &expected, &p.mesh.positions, 1e-12));
        let shell = method("shell_implicit");
        // By steps, as its own cell: a search for rest does not begin at loads whose strains are rounding.
        let settled = Problem { steps: settling(shell), ..p.clone() }.run(library, shell, STILL);
        let of_mesh = settled.map(|end| distance(&end.positions, &expected, &p.mesh.positions, 1e-12));
        let reason = |m: &Method, end: &End| match &of_mesh {
            _ if m.family == Family::Shell => "the mesh's, or the step's own error".to_owned(),
            Ok(off) if distance(&end.positions, &expected, &p.mesh.positions, 1e-12) < 1.2 * off => {
                "the mesh's: the nonlinear shell is as far off the beam".to_owned()
            }
            Ok(off) => format!("its modes or fields: the nonlinear shell is {:.1} % off", 100.0 * off),
            Err(e) => format!("its modes or fields; the nonlinear shell has no end to compare with: {e}"),
        };
        // At 1e6 a triangle has one thickness where the beam's changes by a third: the mesh alone leaves some percent.
        let judge = Judge { name: "beam theory", tolerance: 0.05, error: &error, reason: &reason, bound: 100.0 };
        for m in common() {
            let p = Problem { steps: settling(m), ..p.clone() };
            let key = ("material", format!("{name} at the tip × {contrast:e}"));
            cells.push(judged(library, key, m, &p, STILL, &judge));
        }
    }
    cells
}

/// Edges along the middle of the strip, by which its halves fold.
fn creases(library: &Library) -> Vec<Cell> {
    let base = strip(4);
    let middle = |v: u32| base.mesh.place[v as usize][1].abs() < 1e-9;
    let mut edges: Vec<[u32; 2]> = vec![];
    for [a, b, c] in &base.mesh.triangles {
        for [a, b] in [[*a, *b], [*b, *c], [*c, *a]] {
            let edge = [a.min(b), a.max(b)];
            if middle(a) && middle(b) && !edges.contains(&edge) {
                edges.push(edge);
            }
        }
    }
    let of = |factor: &f64| {
        let creases = edges.iter().map(|edge| (*edge, *factor)).collect();
        let problem = Problem { sheet: Some(Sheet { creases, ..sheet() }), ..base.clone() };
        by_the_shell(library, ("material", format!("crease along the middle × {factor:e}")), &problem, None)
    };
    [0.0, 1e-6, 1e-3, 1e3, 1e6].iter().flat_map(of).collect()
}

/// A strip as stiff along itself as the plain one, and by another modulus across, Huber's shear modulus between them: a beam of the modulus along it.
/// The shear of such a sheet gives by (thickness/length)²·E/G of that, 1e-4 at most.
fn grain(library: &Library) -> Vec<Cell> {
    let base = strip(8);
    let length = base.mesh.length();
    let beam = Beam::new(length, |_| 6.0, |_| 1.0);
    let (stiffer, gravity) = ((SWING / beam.swing).powi(2), SAG * length * (SWING / beam.swing).powi(2) / beam.tip());
    let hung = |p: &[f64; 3]| [p[0], p[1], -gravity / stiffer * beam.at(p[0])];
    let expected: Vec<[f64; 3]> = base.mesh.positions.iter().map(hung).collect();
    let along = Sheet { young: sheet().young * stiffer, ..sheet() };
    let off = |end: &End, expected: &[[f64; 3]]| distance(&end.positions, expected, &base.mesh.positions, 1e-12);
    let with = |young: f64, across: f64, direction: [f64; 3]| Problem {
        sheet: Some(Sheet { grain: Some((across, direction)), ..Sheet { young, ..along.clone() } }),
        gravity: [0.0, 0.0, -gravity],
        ..base.clone()
    };
    let shell = method("shell_implicit");
    let mut cells = vec![];
    for contrast in [1e-4, 1e-2, 1e2, 1e4] {
        let p = with(along.young, along.young * contrast, [1.0, 0.0, 0.0]);
        // By steps, as the contrasts above.
        let settled = Problem { steps: settling(shell), ..p.clone() }.run(library, shell, STILL);
        let of_mesh =
            settled.map_or_else(|e| e.to_string(), |end| format!("{:.1} % off", 100.0 * off(&end, &expected)));
        let error = |end: &End| Ok(off(end, &expected));
        let reason = |_: &Method, _: &End| {
            format!("the mesh's: half as much on cells half as large; the nonlinear shell is {of_mesh}")
        };
        let judge = Judge { name: "beam theory", tolerance: 0.05, error: &error, reason: &reason, bound: 100.0 };
        for m in common() {
            let p = Problem { steps: settling(m), ..p.clone() };
            let key = ("material", format!("Young's modulus across × {contrast:e}"));
            cells.push(judged(library, key, m, &p, STILL, &judge));
        }
    }
    // At 45 degrees what bends also twists, and the clamp holds it: no closed form.
    for contrast in [1e-4, 1e-2, 1e2, 1e4] {
        let young = along.young * f64::max(1.0, 1.0 / contrast); // the lesser modulus is the plain strip's
        let p = with(young, young * contrast, [1.0, 1.0, 0.0]);
        let settled = Problem { steps: settling(shell), ..p.clone() }.run(library, shell, STILL);
        let error =
            |end: &End| settled.as_ref().map(|known| off(end, &known.positions)).map_err(|e| anyhow::anyhow!("{e}"));
        let reason = |_: &Method, _: &End| "its modes or fields".to_owned();
        let judge = Judge {
            name: "nonlinear shell by steps, linear load",
            tolerance: 0.05,
            error: &error,
            reason: &reason,
            bound: 100.0,
        };
        for m in common().filter(|m| m.family != Family::Shell) {
            let p = Problem { steps: settling(m), ..p.clone() };
            let key = ("material", format!("at 45°, Young's modulus across × {contrast:e}"));
            cells.push(judged(library, key, m, &p, STILL, &judge));
        }
    }
    cells
}

pub fn all(library: &Library) -> Vec<Cell> {
    let mut cells = contrasts(library);
    cells.extend(grain(library));
    cells.extend(creases(library));
    cells
}
