//! Tables: written as CSV files, and the same rows on the page.

use crate::row::write_table;
use anyhow::Result;
use std::path::Path;

pub struct Table {
    /// File name without .csv.
    pub name: &'static str,
    pub header: Vec<&'static str>,
    pub rows: Vec<Vec<String>>,
}

impl Table {
    pub fn new(name: &'static str, header: &[&'static str]) -> Self {
        Self { name, header: header.to_vec(), rows: vec![] }
    }

    pub fn push(&mut self, row: impl IntoIterator<Item = String>) {
        self.rows.push(row.into_iter().collect());
    }

    pub fn write(&self, folder: &Path) -> Result<()> {
        write_table(&folder.join(format!("{}.csv", self.name)), &self.header, &self.rows)
    }

    pub fn html(&self) -> String {
        let cells = |tag: &str, row: &mut dyn Iterator<Item = &str>| -> String {
            let open = |cell: &str| {
                if cell.chars().count() < 12 { format!("<{tag} class=\"short\">") } else { format!("<{tag}>") }
            };
            row.map(|cell| format!("{}{}</{tag}>", open(cell), escape(cell))).collect()
        };
        let head = cells("th", &mut self.header.iter().copied());
        let body: String =
            self.rows.iter().map(|r| format!("<tr>{}</tr>\n", cells("td", &mut r.iter().map(|c| &c[..])))).collect();
        let file = format!("<p class=\"file\">{}.csv</p>", self.name);
        format!("<div class=\"scroll\"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>{file}")
    }

    pub fn markdown(&self) -> String {
        let line = |cells: Vec<&str>| format!("| {} |\n", cells.join(" | "));
        let mut text = line(self.header.clone());
        text += &line(vec!["---"; self.header.len()]);
        for row in &self.rows {
            text += &line(row.iter().map(|c| &c[..]).collect());
        }
        text
    }
}

pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// 0.0314 as "3.1 %".
pub fn percent(x: f64) -> String {
    if !x.is_finite() {
        return "–".to_owned();
    }
    let p = 100.0 * x;
    if (p - p.round()).abs() < 1e-9 {
        return format!("{} %", p.round());
    }
    let digits = if p == 0.0 { 0 } else { (1 - p.abs().log10().floor() as i32).clamp(0, 9) };
    format!("{p:.*} %", digits as usize)
}

/// Microseconds as people say them, to two or three digits. Differences of times below what is resolved are said to be so.
pub fn duration(us: f64) -> String {
    if !us.is_finite() {
        return "–".to_owned();
    }
    if us < 0.05 {
        return "< 0.1 µs".to_owned();
    }
    let (value, unit) = match us {
        us if us < 1e3 => (us, "µs"),
        us if us < 1e6 => (us / 1e3, "ms"),
        us => (us / 1e6, "s"),
    };
    let digits = if value < 10.0 { 1 } else { 0 };
    format!("{value:.digits$} {unit}")
}

/// Two decimals, or a dash.
pub fn decimal(x: f64) -> String {
    // Zero is added to what rounds to −0.
    if x.is_finite() { format!("{:.2}", (100.0 * x).round() / 100.0 + 0.0) } else { "–".to_owned() }
}

/// Megabytes, or a dash where the system does not tell.
pub fn megabytes(x: f64) -> String {
    match x {
        x if !x.is_finite() => "–".to_owned(),
        x if x < 9.95 => format!("{x:.1}"),
        x => format!("{x:.0}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_as_people_write_them() {
        assert_eq!([percent(0.0314), percent(1.2), percent(0.00071)], ["3.1 %", "120 %", "0.071 %"]);
        assert_eq!([duration(3.21), duration(32_100.0), duration(1.5e6)], ["3.2 µs", "32 ms", "1.5 s"]);
        // Differences of times come out at or below nothing.
        assert_eq!([duration(-0.03), duration(0.0), duration(0.06)], ["< 0.1 µs", "< 0.1 µs", "0.1 µs"]);
        assert_eq!([decimal(-0.004), decimal(-0.1), decimal(2.345)], ["0.00", "-0.10", "2.35"]);
        assert_eq!([megabytes(0.34), megabytes(12.6), megabytes(f64::NAN)], ["0.3", "13", "–"]);
    }
}
