//! Where each method holds: extreme cases, each run through the built library and judged by something outside of it.

mod cases;
mod contact;
mod gravity;
mod material;
mod page;
mod precision;
mod touch;
mod trial;

use crate::library::Library;
use crate::methods::{METHODS, Method};
use crate::table::Table;
use anyhow::Result;
use std::path::Path;
use trial::Cell;

/// Of the reduced shells the one with fewest fields stands for all: what is asked here is where it holds, not how near it comes.
fn methods() -> impl Iterator<Item = &'static Method> {
    let least = METHODS.iter().map(|m| m.fields).filter(|n| *n > 0).min().unwrap_or(0);
    METHODS.iter().filter(move |m| m.fields == 0 || m.fields == least)
}

/// Everything measured.
struct Map {
    cells: Vec<Cell>,
    ends: Table,
    precision: Option<Table>,
}

/// Measures, writes stability.csv and gravity.csv to `out`, and the summary to `docs` when given.
pub fn run(library: &Library, cli: Option<&Path>, scenes: &Path, out: &Path, docs: Option<&Path>) -> Result<()> {
    let mut cells = cases::all(library);
    let (held, ends) = gravity::all(library, &scenes.join("../data"))?;
    cells.extend(held);
    let precision = cli.map(|cli| precision::table(cli, scenes, out)).transpose()?;
    let map = Map { cells, ends, precision };
    page::table(&map.cells).write(out)?;
    map.ends.write(out)?;
    if let Some(table) = &map.precision {
        table.write(out)?;
    }
    if let Some(docs) = docs {
        page::write(docs, &map)?;
    }
    check(&map.cells, out)
}

/// The cells of one group alone: stability.csv, and its rows in `docs` when given.
pub fn run_group(library: &Library, group: &str, out: &Path, docs: Option<&Path>) -> Result<()> {
    let cells = cases::of_group(library, group)?;
    page::table(&cells).write(out)?;
    if let Some(docs) = docs {
        page::replace(docs, group, &cells)?;
    }
    check(&cells, out)
}

fn check(cells: &[Cell], out: &Path) -> Result<()> {
    let broken: Vec<_> = cells.iter().filter(|c| c.verdict == trial::Verdict::Broken).collect();
    anyhow::ensure!(broken.is_empty(), "not finite, or out of bounds: {broken:?}");
    let unexplained: Vec<_> = cells.iter().filter(|c| c.needs_reason()).collect();
    anyhow::ensure!(unexplained.is_empty(), "cells without a reason: {unexplained:?}");
    println!("stability: {} cells, {}", cells.len(), out.join("stability.csv").display());
    Ok(())
}
