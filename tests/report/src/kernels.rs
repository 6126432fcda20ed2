//! What `make bench` measured: the plots of docs/evidence/speed.md, and the goals beside it on the report's page.

use crate::methods::Marker;
use crate::page::{Figure, colour, line};
use crate::plots::{Marks, Plot, Scale, WHOLE};
use crate::table::Table;
use anyhow::{Context, Result};
use serde::Deserialize;
use std::path::Path;

/// A line of its CSV file.
#[derive(Deserialize)]
pub struct Kernel {
    kernel: String,
    /// Of each state.
    vertices: usize,
    modes: usize,
    states: usize,
    threads: usize,
    ns_per_vertex: f64,
    times_reading: Option<f64>,
    /// In readings of the basis.
    goal: String,
}

/// Empty where there is no such file.
pub fn read(file: &Path) -> Result<Vec<Kernel>> {
    if !file.exists() {
        return Ok(vec![]);
    }
    let rows = csv::Reader::from_path(file)?.into_deserialize().collect::<csv::Result<_>>();
    rows.with_context(|| format!("{}: make bench writes it anew", file.display()))
}

pub fn goals(kernels: &[Kernel]) -> Table {
    let mut table = Table::new("kernels", &["kernel", "vertices", "modes", "goal, × reading", "now"]);
    for k in kernels.iter().filter(|k| !k.goal.is_empty()) {
        let now = k.times_reading.map_or_else(String::new, |ratio| format!("{ratio:.2}"));
        table.push([k.kernel.clone(), k.vertices.to_string(), k.modes.to_string(), k.goal.clone(), now]);
    }
    table
}

const SHOWN: [(&str, &str, Marker); 6] = [
    ("step, warp", "warp_implicit", Marker::Disc),
    ("step, virtual work", "virtual_work_implicit", Marker::Triangle),
    ("positions, f32", "warp_implicit", Marker::Ring),
    ("positions, f32, i16", "lma_implicit", Marker::Ring),
    ("positions, naive f64", "", Marker::Disc),
    ("read", "", Marker::Cross),
];

/// Time of a call over vertices, with 8 modes, and over modes, at the most measured size.
pub fn figures(kernels: &[Kernel]) -> Result<Vec<Figure>> {
    let alone = || kernels.iter().filter(|k| (k.states, k.threads) == (1, 1));
    let counts = |n: usize| alone().filter(|k| k.vertices == n && k.kernel == "read").count();
    let Some(most) = alone().map(|k| k.vertices).max_by_key(|n| counts(*n)) else { return Ok(vec![]) };
    let figure = |name: &str, label: &str, size: fn(&Kernel) -> usize, chosen: &dyn Fn(&Kernel) -> bool| {
        let series = SHOWN.map(|(name, key, marker)| {
            let own = alone().filter(|k| k.kernel == name && chosen(k));
            let points = own.map(|k| (size(k) as f64, 1e-3 * k.ns_per_vertex * k.vertices as f64));
            let name = if name == "read" { "reading the f32 basis once" } else { name };
            line(name, colour(key), Some(marker), points.collect())
        });
        let plot = Plot {
            title: format!("Time of the kernels over {label}"),
            x: (label.trim_start_matches("the "), Scale::Log),
            y: ("time of a call", Scale::Time),
            series: series.into(),
            marks: Marks::default(),
            size: WHOLE,
        };
        anyhow::Ok(Figure { name: name.to_owned(), svg: plot.draw()? })
    };
    let modes = format!("the number of modes ({most} vertices)");
    Ok(vec![
        figure("kernels_vertices", "the number of vertices (8 modes)", |k| k.vertices, &|k| {
            k.modes == 8 && k.vertices != most
        })?,
        figure("kernels_modes", &modes, |k| k.modes, &|k| k.vertices == most)?,
    ])
}
