//! Scenes of tests/scenes that run by modes, with the basis in 32 and in 64 bits, by the command-line program.

use crate::mesh::P3;
use crate::table::{Table, percent};
use anyhow::{Context, Result, ensure};
use std::path::Path;
use std::process::Command;

/// Scenes in motion by a modal method; comparisons and nonlinear shells have no basis to compare.
fn moves_by_modes(text: &str) -> bool {
    let line = |start: &str| text.lines().any(|l| l.trim_start().starts_with(start));
    !line("[comparison]") && !line("method = \"shell-implicit\"") && !line("method = \"shell-explicit\"")
}

/// Frames of a point cache.
fn read_pc2(path: &Path) -> Result<Vec<Vec<P3>>> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    ensure!(bytes.len() > 32 && bytes.starts_with(b"POINTCACHE2\0"), "{} is no point cache", path.display());
    let count = u32::from_le_bytes(bytes[16..20].try_into()?) as usize;
    let numbers = bytes[32..].chunks_exact(4).map(|b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])));
    let numbers: Vec<f64> = numbers.collect();
    Ok(numbers.chunks_exact(3 * count).map(|f| f.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect()).collect())
}

fn play(cli: &Path, scene: &Path, out: &Path, double: bool) -> Result<()> {
    std::fs::create_dir_all(out)?;
    let mut command = Command::new(cli);
    command.arg("run").arg(scene).arg("--quiet").arg("--out").arg(out);
    if double {
        command.arg("--double");
    }
    let output = command.output().with_context(|| cli.display().to_string())?;
    ensure!(output.status.success(), "{}: {}", scene.display(), String::from_utf8_lossy(&output.stderr));
    Ok(())
}

/// Largest rotation, rad, over the frames of a table.
fn largest_rotation(path: &Path) -> Result<f64> {
    let mut reader = csv::Reader::from_path(path)?;
    let column = reader.headers()?.iter().position(|h| h == "max_rotation").context("no max_rotation")?;
    let mut largest = 0.0f64;
    for record in reader.records() {
        largest = largest.max(record?[column].parse()?);
    }
    Ok(largest)
}

pub fn table(cli: &Path, scenes: &Path, out: &Path) -> Result<Table> {
    let header = ["scene", "shell", "f32 to f64, largest", "at the end", "of the size", "largest rotation"];
    let mut table = Table::new("precision", &header);
    let mut files: Vec<_> = std::fs::read_dir(scenes)?.map(|e| Ok(e?.path())).collect::<Result<_>>()?;
    files.sort();
    for scene in files.iter().filter(|f| f.extension().is_some_and(|e| e == "toml")) {
        if !moves_by_modes(&std::fs::read_to_string(scene)?) {
            continue;
        }
        let name = scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let [single, double] = ["f32", "f64"].map(|p| out.join("precision").join(&name).join(p));
        play(cli, scene, &single, false)?;
        play(cli, scene, &double, true)?;
        let mut caches: Vec<_> = std::fs::read_dir(&single)?.map(|e| Ok(e?.path())).collect::<Result<_>>()?;
        caches.retain(|p| p.extension().is_some_and(|e| e == "pc2"));
        caches.sort();
        for cache in caches {
            let shell = cache.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let (a, b) = (read_pc2(&cache)?, read_pc2(&double.join(cache.file_name().unwrap_or_default()))?);
            let apart = |(a, b): (&Vec<P3>, &Vec<P3>)| {
                let each = a.iter().zip(b).map(|(a, b)| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt());
                each.fold(0.0, f64::max)
            };
            let moved = b.iter().map(|f| apart((f, &b[0]))).fold(f64::MIN_POSITIVE, f64::max);
            let each: Vec<f64> = a.iter().zip(&b).map(apart).collect();
            let largest = each.iter().copied().fold(0.0, f64::max);
            let rotation = largest_rotation(&double.join(format!("{shell}_frames.csv")))?;
            table.push([
                name.clone(),
                shell,
                percent(largest / moved),
                percent(each.last().copied().unwrap_or(0.0) / moved),
                percent(largest / size(&b[0])),
                format!("{:.0}°", rotation.to_degrees()),
            ]);
        }
    }
    Ok(table)
}

fn size(x: &[P3]) -> f64 {
    let range = |c: usize| {
        let (low, high) = x.iter().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p[c]), h.max(p[c])));
        high - low
    };
    (0..3).map(|c| range(c).powi(2)).sum::<f64>().sqrt()
}
