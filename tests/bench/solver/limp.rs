//! Cotton that hangs limp and is blown on.

use crate::common::equilateral_sheet;
use crate::steps::{Swing, Way};
use crate::wanted;
use shellwarp::material::PRESETS;
use shellwarp::{Mesh, Shell, Supports, Vec3};
use std::sync::Arc;

/// Frames of cotton that hangs and is blown on.
const LIMP_FRAMES: usize = 60;

/// Cotton by its preset: a flag held by one side, a cloth by two corners, a skirt by its waist, of two sizes.
fn cottons() -> impl Iterator<Item = (&'static str, Shell)> {
    let preset = PRESETS.iter().find(|preset| preset.name == c"cotton").unwrap();
    let made = move |(positions, triangles): (Vec<Vec3>, Vec<[u32; 3]>), held: &dyn Fn(&Vec3) -> bool| {
        let fixed = (0..positions.len() as u32).filter(|v| held(&positions[*v as usize])).collect();
        let mesh = Mesh::new(positions, &triangles).unwrap();
        Shell::new(mesh, preset.sheet, &Supports { fixed, ..Supports::default() }).unwrap()
    };
    [24, 48].into_iter().flat_map(move |n| {
        let sheet = || equilateral_sheet(n, n, 0.6 / n as f64);
        let top = sheet().0.iter().map(|p| p.y).fold(0.0, f64::max);
        let corner = move |p: &Vec3| p.y > top - 0.03 && (p.x < 0.04 || p.x > 0.56);
        [
            ("flag", made(sheet(), &|p| p.x < 0.015)),
            ("cloth", made(sheet(), &corner)),
            ("skirt", made(skirt(n * 7 / 12), &|p| p.z == 0.0)),
        ]
    })
}

/// 60 cm long, 12 cm in radius above and 30 below.
fn skirt(rows: usize) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let around = 4 * rows;
    let at = |row: usize, k: usize| (row * around + k % around) as u32;
    let place = |row: usize, k: usize| {
        let down = row as f64 / rows as f64;
        let angle = std::f64::consts::TAU * (k as f64 + 0.5 * (row % 2) as f64) / around as f64;
        let radius = 0.12 + 0.18 * down;
        Vec3::new(radius * angle.cos(), radius * angle.sin(), -0.6 * down)
    };
    let positions = (0..=rows).flat_map(|row| (0..around).map(move |k| place(row, k))).collect();
    let pair = |row: usize, k: usize| {
        let [a, b, c, d] = [at(row, k), at(row, k + 1), at(row + 1, k), at(row + 1, k + 1)];
        if row.is_multiple_of(2) { [[a, c, b], [b, c, d]] } else { [[a, c, d], [a, d, b]] }
    };
    (positions, (0..rows).flat_map(|row| (0..around).flat_map(move |k| pair(row, k))).collect())
}

pub fn table(only: &[String]) {
    println!(
        "| shell | vertices | steps | iterations a step | most | factorizations | ms |\n|---|---|---|---|---|---|---|"
    );
    for (name, shell) in cottons().filter(|(name, _)| wanted(only, name)) {
        let shell = Arc::new(shell);
        let (mut swing, mut most) = (Swing::new(&shell, Way::Reusing), 0);
        for frame in 0..LIMP_FRAMES {
            let gust = 6.0 * (0.2 * frame as f64).sin();
            let weight: Vec<Vec3> = shell.mass.iter().map(|m| Vec3::new(0.3 * gust, gust, -9.8) * *m).collect();
            let before = swing.iterations;
            swing.step(&weight, vec![]);
            most = most.max(swing.iterations - before);
        }
        let [a, b, c] = swing.per_frame(LIMP_FRAMES);
        println!("| {name} | {} | {LIMP_FRAMES} | {a:.1} | {most} | {b:.1} | {:.0} |", shell.mass.len(), 1e3 * c);
    }
}
