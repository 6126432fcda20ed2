//! docs/evidence/error_and_speed.md: the main figures, and the plots beside them.

use crate::page::{Figure, filled};
use crate::summary::Report;
use anyhow::Result;
use std::path::Path;

const TEMPLATE: &str = include_str!("../page/summary.md");

/// The plots that the summary shows.
const SHOWN: [&str; 7] = [
    "fixed_leaf",
    "fixed_dinosaur",
    "pareto_vee_static",
    "pareto_flat_release",
    "pareto_dinosaur",
    "cost_vertices",
    "cost_modes",
];

/// The processor by class and widest vector instructions, not by name.
fn class() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let has = |flag: &str| text.split_whitespace().any(|word| word == flag);
    let vectors = [("avx512f", " with AVX-512"), ("avx2", " with AVX2"), ("asimd", " with Neon")];
    let vectors = vectors.iter().find(|(flag, _)| has(flag)).map_or("", |v| v.1);
    format!("one core of a virtual {} machine{vectors}", std::env::consts::ARCH.replace('_', "-"))
}

pub fn write(folder: &Path, report: &Report, figures: &[Figure]) -> Result<()> {
    let parts: Vec<(&str, String)> = vec![
        ("class", class()),
        ("answer", report.answer().markdown()),
        ("choice", report.choice().markdown()),
        ("next_factor", report.next_factor().markdown()),
        ("references", report.references().markdown()),
        ("kinds", report.error_kinds().markdown()),
        ("arc", report.arc_table().markdown()),
        ("parts", report.parts_table().markdown()),
        ("growth", report.growth_table().markdown()),
        ("precompute", report.precompute_table().markdown()),
        ("reduced", report.reduced_table().markdown()),
        ("peers", report.peers_table().markdown()),
    ];
    std::fs::create_dir_all(folder.join("report"))?;
    std::fs::write(folder.join("error_and_speed.md"), filled(TEMPLATE, &parts))?;
    for figure in figures.iter().filter(|f| SHOWN.contains(&&f.name[..])) {
        figure.write(&folder.join("report"))?;
    }
    Ok(())
}
