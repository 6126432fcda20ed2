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

/// The rows of one group in a page that is there, which has them in its first two tables.
pub fn replace(docs: &Path, group: &str, cells: &[Cell]) -> Result<()> {
    let path = docs.join("stability.md");
    let fresh = [overview(cells), exceptions(cells)].map(|t| t.markdown());
    let text = with_rows(&std::fs::read_to_string(&path)?, group, &fresh)?;
    std::fs::write(path, text)?;
    Ok(())
}

/// Where the group's rows stand in each of the tables, those of the fresh tables instead.
fn with_rows(page: &str, group: &str, fresh: &[String; 2]) -> Result<String> {
    let start = format!("| {group} |");
    let (mut text, mut tables, mut inside) = (String::new(), 0, false);
    for line in page.lines() {
        let is_row = tables < fresh.len() && line.starts_with(&start);
        if is_row && !inside {
            text.extend(fresh[tables].lines().skip(2).map(|row| format!("{row}\n"))); // behind its head
            tables += 1;
        }
        inside = inside && line.starts_with(&start) || is_row;
        if !inside {
            text += line;
            text.push('\n');
        }
    }
    anyhow::ensure!(
        tables == fresh.len(),
        "{tables} of {} tables have rows of {group}: remake the whole page",
        fresh.len()
    );
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::with_rows;

    #[test]
    fn only_the_rows_of_a_group_are_replaced() {
        let head = "| group |\n| --- |\n";
        let page = format!("a\n{head}| x | 1 |\n| y | 2 |\n| y | 3 |\n| z | 4 |\n\n{head}| y | 5 |\nend | y | 6 |\n");
        let fresh = [format!("{head}| y | 7 |\n"), format!("{head}| y | 8 |\n| y | 9 |\n")];
        let expected =
            format!("a\n{head}| x | 1 |\n| y | 7 |\n| z | 4 |\n\n{head}| y | 8 |\n| y | 9 |\nend | y | 6 |\n");
        assert_eq!(with_rows(&page, "y", &fresh).unwrap(), expected);
        assert!(with_rows(&page, "x", &fresh).unwrap_err().to_string().contains("1 of 2 tables"));
    }
}
