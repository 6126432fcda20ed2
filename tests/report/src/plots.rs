//! Plots as SVG, log–log or linear, in one style.

use crate::methods::Marker;
use crate::names::{LETTER, places};
use crate::table::escape;
use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use std::ops::Range;

/// What the numbers on an axis are.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    Linear,
    Log,
    /// Logarithmic, microseconds, labelled µs, ms, s.
    Time,
    /// Logarithmic, labelled in percent.
    Percent,
}

pub struct Series {
    pub name: String,
    pub colour: (u8, u8, u8),
    pub marker: Option<Marker>,
    pub line: bool,
    pub points: Vec<(f64, f64)>,
}

#[derive(Default)]
pub struct Marks {
    /// Drawn as a staircase.
    pub front: Vec<(f64, f64)>,
    /// Ringed, and its name.
    pub ringed: Option<((f64, f64), &'static str)>,
    /// A vertical line and its name.
    pub limit: Option<(f64, &'static str)>,
    /// Horizontal lines, what stands right of each, and what they are.
    pub levels: Vec<(f64, String)>,
    pub levels_are: &'static str,
    /// Series have their names beside them in place of a legend below.
    pub named: bool,
}

pub struct Plot<'a> {
    pub title: String,
    /// What an axis has, with its unit where its labels have none.
    pub x: (&'a str, Scale),
    pub y: (&'a str, Scale),
    pub series: Vec<Series>,
    pub marks: Marks,
    /// Without the legend.
    pub size: (u32, u32),
}

/// A plot by itself, and one of two side by side.
pub const WHOLE: (u32, u32) = (900, 520);
pub const HALF: (u32, u32) = (560, 430);

const INK: RGBColor = RGBColor(40, 44, 52);
const GRID: RGBColor = RGBColor(226, 228, 232);
const FAINT: RGBColor = RGBColor(110, 110, 110);

/// Pixels: of the title, and of a line of the legend.
const TITLE: i32 = 34;
const LINE: i32 = 21;

impl Scale {
    fn place(self, x: f64) -> f64 {
        if self == Scale::Linear { x } else { x.log10() }
    }

    fn label(self, place: f64) -> String {
        let whole = (place - place.round()).abs() < 1e-6;
        let exponent = place.round() as i32;
        match self {
            Scale::Linear => {
                let text = format!("{place:.2}");
                text.trim_end_matches('0').trim_end_matches('.').to_owned()
            }
            _ if !whole => String::new(),
            Scale::Log if (-2..=5).contains(&exponent) => format!("{}", 10f64.powi(exponent)),
            Scale::Log => format!("1e{exponent}"),
            Scale::Time => {
                let (unit, shift) = [("µs", 0), ("ms", 3), ("s", 6)][(exponent.max(0) / 3).min(2) as usize];
                format!("{} {unit}", 10f64.powi(exponent - shift))
            }
            Scale::Percent if exponent >= -5 => format!("{} %", 10f64.powi(exponent + 2) as f32),
            Scale::Percent => format!("1e{} %", exponent + 2),
        }
    }

    /// The range of an axis: whole decades, or the data with a little air.
    fn range(self, values: impl Iterator<Item = f64>) -> Range<f64> {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for x in values.map(|x| self.place(x)).filter(|x| x.is_finite()) {
            (low, high) = (low.min(x), high.max(x));
        }
        if low > high {
            return 0.0..1.0;
        }
        if self == Scale::Linear {
            let air = 0.05 * (high - low).max(1e-12);
            return low - air..high + air;
        }
        (low - 0.05).floor()..(high + 0.05).ceil()
    }

    /// How many labels plotters may choose: one a decade.
    fn labels(self, range: &Range<f64>) -> usize {
        if self == Scale::Linear { 8 } else { (range.end - range.start).round() as usize + 1 }
    }
}

/// Where the area of the data stands in the picture, pixels.
const LEFT: i32 = 90;
const BOTTOM: i32 = 52;

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
type Drawn = std::result::Result<(), Box<dyn std::error::Error>>;

/// What stands before a name in the legend.
#[derive(Clone, Copy)]
enum Symbol {
    Line(RGBColor),
    /// Of a line upright, as it is drawn.
    Dashes(RGBColor),
    /// Of a level.
    Dots(RGBColor),
    Marker(Marker, RGBColor),
    Ring,
}

fn rgb(colour: (u8, u8, u8)) -> RGBColor {
    RGBColor(colour.0, colour.1, colour.2)
}

fn symbol<'b, C: Clone + 'static>(at: C, marker: Marker, colour: RGBColor) -> DynElement<'static, SVGBackend<'b>, C> {
    let (fill, thin, thick) = (colour.mix(0.65).filled(), colour.stroke_width(1), colour.stroke_width(2));
    match marker {
        Marker::Disc => Circle::new(at, 4, fill).into_dyn(),
        Marker::Ring => Circle::new(at, 4, thin).into_dyn(),
        Marker::Cross => Cross::new(at, 4, thick).into_dyn(),
        Marker::Triangle => TriangleMarker::new(at, 5, fill).into_dyn(),
    }
}

impl Plot<'_> {
    /// The SVG's text.
    pub fn draw(&self) -> Result<String> {
        let mut text = String::new();
        self.draw_into(&mut text).map_err(|e| anyhow!("{e}"))?;
        // For readers who do not see it.
        let (head, rest) = text.split_once('>').expect("an SVG's tag");
        let title = escape(&self.title);
        Ok(format!("{head} role=\"img\" aria-label=\"{title}\">\n<title>{title}</title>{rest}"))
    }

    /// Of an axis; levels lie on the second.
    fn range(&self, axis: fn((f64, f64)) -> f64, scale: Scale) -> Range<f64> {
        let levels = self.marks.levels.iter().map(|l| axis((f64::NAN, l.0)));
        scale.range(self.series.iter().flat_map(|s| &s.points).map(|p| axis(*p)).chain(levels))
    }

    fn legend(&self) -> Vec<(Symbol, &str)> {
        let mut all: Vec<(Symbol, &str)> = vec![];
        if !self.marks.named {
            all.extend(self.series.iter().map(|s| {
                let colour = rgb(s.colour);
                (s.marker.map_or(Symbol::Line(colour), |m| Symbol::Marker(m, colour)), &s.name[..])
            }));
        }
        if !self.marks.front.is_empty() {
            all.push((Symbol::Line(INK), "what nothing beats"));
        }
        all.extend(self.marks.ringed.iter().map(|r| (Symbol::Ring, r.1)));
        let shown = |limit: &&(f64, &str)| self.range(|p| p.0, self.x.1).contains(&self.x.1.place(limit.0));
        all.extend(self.marks.limit.iter().filter(shown).map(|l| (Symbol::Dashes(FAINT), l.1)));
        if !self.marks.levels.is_empty() {
            all.push((Symbol::Dots(FAINT), self.marks.levels_are));
        }
        all
    }

    /// Pixels of a column of the legend, and how many lines there are.
    fn legend_size(&self, legend: &[(Symbol, &str)]) -> (i32, i32) {
        let longest = legend.iter().map(|l| l.1.chars().count()).max().unwrap_or(0) as i32;
        let column = (LETTER * longest + 48).max(1);
        let columns = ((self.size.0 as i32 - 24) / column).max(1);
        (column, (legend.len() as i32 + columns - 1) / columns)
    }

    fn draw_into(&self, text: &mut String) -> Drawn {
        let legend = self.legend();
        let (column, lines) = self.legend_size(&legend);
        let height = self.size.1 + (LINE * lines) as u32;
        let root = SVGBackend::with_string(text, (self.size.0, height)).into_drawing_area();
        root.fill(&WHITE)?;
        root.draw(&Text::new(self.title.clone(), (14, 10), ("sans-serif", 18, &INK).into_text_style(&root)))?;
        let (top, below) = root.split_vertically(self.size.1);
        let (x, y) = (self.range(|p| p.0, self.x.1), self.range(|p| p.1, self.y.1));
        let labels = (self.x.1.labels(&x), self.y.1.labels(&y));
        let words = self.marks.levels.iter().map(|l| l.1.chars().count()).max().unwrap_or(0) as i32;
        let mut chart = ChartBuilder::on(&top)
            .margin(12)
            .margin_top(TITLE)
            .margin_right(24 + LETTER * words)
            .x_label_area_size(BOTTOM)
            .y_label_area_size(LEFT - 12)
            .build_cartesian_2d(x.clone(), y.clone())?;
        chart
            .configure_mesh()
            .x_desc(self.x.0)
            .y_desc(self.y.0)
            .x_labels(labels.0)
            .y_labels(labels.1)
            .x_label_formatter(&|v| self.x.1.label(*v))
            .y_label_formatter(&|v| self.y.1.label(*v))
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID)
            .axis_style(INK)
            .label_style(("sans-serif", 15, &INK))
            .axis_desc_style(("sans-serif", 16, &INK))
            .draw()?;
        self.draw_marks(&mut chart, &x, &y)?;
        for series in &self.series {
            self.draw_series(&mut chart, series)?;
        }
        if let Some((p, _)) = &self.marks.ringed {
            let p = self.at(*p);
            chart.draw_series([p].into_iter().filter(finite).map(|p| Circle::new(p, 10, INK.stroke_width(2))))?;
        }
        self.draw_levels(&mut chart, &top, &x)?;
        if self.marks.named {
            self.draw_names(&mut chart, &top)?;
        }
        for (k, (symbol, name)) in legend.iter().enumerate() {
            let columns = ((self.size.0 as i32 - 24) / column).max(1);
            let at = (20 + column * (k as i32 % columns), LINE * (k as i32 / columns));
            draw_entry(&below, *symbol, name, at)?;
        }
        root.present()?;
        Ok(())
    }

    fn at(&self, p: (f64, f64)) -> (f64, f64) {
        (self.x.1.place(p.0), self.y.1.place(p.1))
    }

    /// The limit's line and the front's staircase.
    fn draw_marks(&self, chart: &mut Chart, x: &Range<f64>, y: &Range<f64>) -> Drawn {
        if let Some((limit, _)) = &self.marks.limit {
            let place = self.x.1.place(*limit);
            if x.contains(&place) {
                chart.draw_series(DashedLineSeries::new(
                    [(place, y.start), (place, y.end)],
                    5,
                    5,
                    FAINT.stroke_width(1),
                ))?;
            }
        }
        let mut stairs = vec![];
        for p in &self.marks.front {
            let p = self.at(*p);
            if let Some(&(_, last)) = stairs.last() {
                stairs.push((p.0, last));
            }
            stairs.push(p);
        }
        if let Some(&(_, last)) = stairs.last() {
            stairs.push((x.end, last));
            chart.draw_series(LineSeries::new(stairs, INK.mix(0.75).stroke_width(2)))?;
        }
        Ok(())
    }

    /// Each with its words right of the data, no nearer to one another than a line.
    fn draw_levels(&self, chart: &mut Chart, area: &DrawingArea<SVGBackend, Shift>, x: &Range<f64>) -> Drawn {
        let mut all: Vec<(f64, &str)> =
            self.marks.levels.iter().map(|(l, words)| (self.y.1.place(*l), &words[..])).collect();
        all.retain(|l| l.0.is_finite());
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut lowest = i32::MIN;
        for (place, words) in all {
            chart.draw_series(DashedLineSeries::new(
                [(x.start, place), (x.end, place)],
                2,
                4,
                FAINT.stroke_width(1),
            ))?;
            let (right, line) = chart.backend_coord(&(x.end, place));
            let top = (line - 8).max(lowest);
            lowest = top + 17;
            area.draw(&Text::new(
                words.to_owned(),
                (right + 6, top),
                ("sans-serif", 14, &FAINT).into_text_style(area),
            ))?;
        }
        Ok(())
    }

    /// Each series' name by its last point.
    fn draw_names(&self, chart: &mut Chart, area: &DrawingArea<SVGBackend, Shift>) -> Drawn {
        let pixels = |p: &(f64, f64)| chart.backend_coord(&self.at(*p));
        let shown: Vec<&Series> = self.series.iter().filter(|s| !s.points.is_empty()).collect();
        let names: Vec<_> = shown.iter().map(|s| (s.name.clone(), pixels(&s.points[s.points.len() - 1]))).collect();
        let mut points: Vec<_> = shown.iter().flat_map(|s| &s.points).map(pixels).collect();
        // Along the lines between them, too.
        for pair in shown.iter().flat_map(|s| s.points.windows(2)) {
            let ((x, y), (u, v)) = (pixels(&pair[0]), pixels(&pair[1]));
            let parts = 1 + (u - x).abs().max((v - y).abs()) / 8;
            points.extend((1..parts).map(|k| (x + (u - x) * k / parts, y + (v - y) * k / parts)));
        }
        let inner = [LEFT + 2, TITLE, self.size.0 as i32 - 8, self.size.1 as i32 - BOTTOM - 14];
        for (series, place) in shown.iter().zip(places(&names, &points, inner)) {
            let colour = rgb(series.colour);
            area.draw(&Text::new(series.name.clone(), place, ("sans-serif", 16, &colour).into_text_style(area)))?;
        }
        Ok(())
    }

    fn draw_series(&self, chart: &mut Chart, series: &Series) -> Drawn {
        let colour = rgb(series.colour);
        let points: Vec<(f64, f64)> = series.points.iter().map(|p| self.at(*p)).filter(finite).collect();
        if series.line {
            chart.draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(2)))?;
        }
        if let Some(marker) = series.marker {
            chart.draw_series(points.into_iter().map(|p| symbol(p, marker, colour)))?;
        }
        Ok(())
    }
}

fn finite(p: &(f64, f64)) -> bool {
    p.0.is_finite() && p.1.is_finite()
}

/// A line of the legend; `at` is its upper left corner.
fn draw_entry(area: &DrawingArea<SVGBackend, Shift>, what: Symbol, name: &str, at: (i32, i32)) -> Drawn {
    let (middle, ends) = ((at.0 + 10, at.1 + 9), [(at.0, at.1 + 9), (at.0 + 20, at.1 + 9)]);
    match what {
        Symbol::Line(colour) => area.draw(&PathElement::new(ends, colour.stroke_width(2)))?,
        Symbol::Dashes(colour) => {
            for k in [0, 7, 14] {
                let dash = [(middle.0, at.1 + k), (middle.0, at.1 + k + 4)];
                area.draw(&PathElement::new(dash, colour.stroke_width(1)))?;
            }
        }
        Symbol::Dots(colour) => {
            for k in [0, 6, 12, 18] {
                let dot = [(at.0 + k, at.1 + 9), (at.0 + k + 2, at.1 + 9)];
                area.draw(&PathElement::new(dot, colour.stroke_width(1)))?;
            }
        }
        Symbol::Marker(marker, colour) => area.draw(&symbol(middle, marker, colour))?,
        Symbol::Ring => area.draw(&Circle::new(middle, 8, INK.stroke_width(2)))?,
    }
    area.draw(&Text::new(name.to_owned(), (at.0 + 28, at.1 + 2), ("sans-serif", 14, &INK).into_text_style(area)))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_has_its_title_its_axes_and_every_name_once() {
        let series = |name: &str, y: f64| Series {
            name: name.to_owned(),
            colour: (1, 2, 3),
            marker: Some(Marker::Disc),
            line: true,
            points: vec![(1.0, y), (100.0, 0.1 * y)],
        };
        let mut plot = Plot {
            title: "What it costs & what it brings".to_owned(),
            x: ("time of a frame", Scale::Time),
            y: ("error, %", Scale::Percent),
            series: vec![series("warp", 0.5), series("reduced shell", 0.2)],
            marks: Marks {
                limit: Some((50.0, "real time")),
                levels: vec![(0.1, "97 vertices".to_owned())],
                levels_are: "of the mesh",
                ..Marks::default()
            },
            size: WHOLE,
        };
        for named in [false, true] {
            plot.marks.named = named;
            let svg = plot.draw().unwrap();
            let lines: Vec<&str> = svg.lines().map(str::trim).collect();
            for words in
                ["time of a frame", "error, %", "warp", "reduced shell", "real time", "97 vertices", "of the mesh"]
            {
                assert_eq!(lines.iter().filter(|line| **line == words).count(), 1, "{words}: {svg}");
            }
            assert!(svg.contains("<title>What it costs &amp; what it brings</title>"));
        }
    }
}
