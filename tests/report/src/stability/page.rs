//! stability.csv and docs/evidence/stability.md.

use super::Map;
use super::trial::{Cell, Verdict};
use crate::page::filled;
use crate::table::{Table, percent};
use anyhow::Result;
use std::path::Path;

const TEMPLATE: &str = include_str!("../../page/stability.md");

fn verdict(cell: &Cell) -> &'static str {
    match cell.verdict {
        Verdict::Accurate => "accurate",
        Verdict::Inaccurate => "stable, inaccurate",
        Verdict::Guarded => "guarded",
        Verdict::Refused => "refused",
        Verdict::Broken => "BROKEN",
    }
}

/// Every cell.
pub fn table(cells: &[Cell]) -> Table {
    let mut table = Table::new("stability", &["group", "case", "method", "verdict", "error", "judged by", "reason"]);
    for c in cells {
        let texts = [c.group, &c.case, c.method, verdict(c), &percent(c.error), c.judge, &c.note];
        table.push(texts.map(|t| t.replace('|', "/")));
    }
    table
}

/// A row for each group and method: how many cells of each verdict, the worst error of the accurate ones, and the reasons.
fn overview(cells: &[Cell]) -> Table {
    let header = ["group", "method", "cells", "accurate", "inaccurate", "guarded", "refused", "worst accurate"];
    let mut table = Table::new("stability_overview", &header);
    let mut keys: Vec<(&str, &str)> = vec![];
    for c in cells {
        if !keys.contains(&(c.group, c.method)) {
            keys.push((c.group, c.method));
        }
    }
    for (group, method) in keys {
        let of: Vec<&Cell> = cells.iter().filter(|c| c.group == group && c.method == method).collect();
        let count = |v: Verdict| of.iter().filter(|c| c.verdict == v).count().to_string();
        let accurate = of.iter().filter(|c| c.verdict == Verdict::Accurate);
        let worst = accurate.map(|c| c.error).fold(f64::NAN, f64::max);
        table.push([
            group.to_owned(),
            method.to_owned(),
            of.len().to_string(),
            count(Verdict::Accurate),
            count(Verdict::Inaccurate),
            count(Verdict::Guarded),
            count(Verdict::Refused),
            percent(worst),
        ]);
    }
    table
}

/// The cells that are not accurate; methods of one case with one reason share a line.
fn exceptions(cells: &[Cell]) -> Table {
    let mut table =
        Table::new("stability_exceptions", &["group", "case", "methods", "verdict", "error", "judged by", "reason"]);
    let mut rows: Vec<(&Cell, Vec<&str>, [f64; 2])> = vec![];
    for c in cells.iter().filter(|c| c.verdict != Verdict::Accurate) {
        let twin = rows
            .iter_mut()
            .find(|(r, ..)| r.group == c.group && r.case == c.case && r.verdict == c.verdict && r.note == c.note);
        match twin {
            Some((_, methods, range)) => {
                methods.push(c.method);
                *range = [range[0].min(c.error), range[1].max(c.error)];
            }
            None => rows.push((c, vec![c.method], [c.error; 2])),
        }
    }
    for (c, methods, range) in rows {
        let error = match range.map(percent) {
            [low, high] if low == high => low,
            [low, high] => format!("{low} to {high}"),
        };
        let texts = [c.group, &c.case, &methods.join("; "), verdict(c), &error, c.judge, &c.note];
        table.push(texts.map(|t| t.replace('|', "/")));
    }
    table
}

pub fn write(docs: &Path, map: &Map) -> Result<()> {
    let none = || "Not measured: the command-line program was not given.\n".to_owned();
    let parts: Vec<(&str, String)> = vec![
        ("overview", overview(&map.cells).markdown()),
        ("exceptions", exceptions(&map.cells).markdown()),
        ("ends", map.ends.markdown()),
        ("precision", map.precision.as_ref().map_or_else(none, Table::markdown)),
    ];
    std::fs::create_dir_all(docs)?;
    std::fs::write(docs.join("stability.md"), filled(TEMPLATE, &parts))?;
    Ok(())
}
