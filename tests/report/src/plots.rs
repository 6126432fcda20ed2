//! Plots as SVG, log–log or linear, in one style.

use crate::methods::Marker;
use anyhow::{Result, anyhow};
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
    /// Ringed and named.
    pub ringed: Option<((f64, f64), String)>,
    /// A vertical line and its name.
    pub limit: Option<(f64, String)>,
    /// Curves rise, and leave the upper left corner to the legend.
    pub rising: bool,
}

pub struct Plot<'a> {
    pub x: (&'a str, Scale),
    pub y: (&'a str, Scale),
    pub series: Vec<Series>,
    pub marks: Marks,
    pub size: (u32, u32),
}

/// A plot by itself, and one of two side by side.
pub const WHOLE: (u32, u32) = (900, 520);
pub const HALF: (u32, u32) = (560, 430);

const INK: RGBColor = RGBColor(40, 44, 52);
const GRID: RGBColor = RGBColor(226, 228, 232);

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
            return low - air..high + 6.0 * air; // room for the legend
        }
        (low - 0.05).floor()..(high + 0.05).ceil()
    }

    /// How many labels plotters may choose: one a decade.
    fn labels(self, range: &Range<f64>) -> usize {
        if self == Scale::Linear { 8 } else { (range.end - range.start).round() as usize + 1 }
    }
}

/// Of a plot's width and height, what the legend of a front takes in the lower left corner, which is made free of the front by decades
/// below it; and how many there are in all, at most.
const LEGEND: (f64, f64) = (0.38, 0.52);
const MOST_DECADES: f64 = 8.0;

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

impl Plot<'_> {
    /// The SVG's text.
    pub fn draw(&self) -> Result<String> {
        let mut text = String::new();
        self.draw_into(&mut text).map_err(|e| anyhow!("{e}"))?;
        Ok(text)
    }

    fn draw_into(&self, text: &mut String) -> std::result::Result<(), Box<dyn std::error::Error>> {
        let root = SVGBackend::with_string(text, self.size).into_drawing_area();
        root.fill(&WHITE)?;
        let all = || self.series.iter().flat_map(|s| &s.points);
        let (x, mut y) = (self.x.1.range(all().map(|p| p.0)), self.y.1.range(all().map(|p| p.1)));
        let share = |range: &Range<f64>, place: f64| (place - range.start) / (range.end - range.start);
        let covered = |y: &Range<f64>, p: (f64, f64)| share(&x, p.0) < LEGEND.0 && share(y, p.1) < LEGEND.1;
        while y.end - y.start < MOST_DECADES && self.marks.front.iter().any(|p| covered(&y, self.at(*p))) {
            y.start -= 1.0;
        }
        let labels = (self.x.1.labels(&x), self.y.1.labels(&y));
        let mut chart = ChartBuilder::on(&root)
            .margin(12)
            .margin_right(24)
            .x_label_area_size(52)
            .y_label_area_size(78)
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
        self.draw_ring(&mut chart)?;
        // Cheap and exact at once is what nothing is: with a front, that corner is free.
        let corner = match &self.marks {
            Marks { rising: true, .. } => SeriesLabelPosition::UpperLeft,
            Marks { front, .. } if front.is_empty() => SeriesLabelPosition::UpperRight,
            _ => SeriesLabelPosition::LowerLeft,
        };
        chart
            .configure_series_labels()
            .position(corner)
            .background_style(WHITE.mix(0.85))
            .border_style(GRID)
            .label_font(("sans-serif", 14, &INK))
            .legend_area_size(26)
            .draw()?;
        root.present()?;
        Ok(())
    }

    fn at(&self, p: (f64, f64)) -> (f64, f64) {
        (self.x.1.place(p.0), self.y.1.place(p.1))
    }

    /// The limit's line and the front's staircase.
    fn draw_marks(
        &self,
        chart: &mut Chart,
        x: &Range<f64>,
        y: &Range<f64>,
    ) -> std::result::Result<(), Box<dyn std::error::Error>> {
        if let Some((limit, name)) = &self.marks.limit {
            let place = self.x.1.place(*limit);
            if x.contains(&place) {
                let style = RGBColor(150, 150, 150).stroke_width(1);
                chart.draw_series(DashedLineSeries::new([(place, y.start), (place, y.end)], 5, 5, style))?;
                let style = ("sans-serif", 13, &RGBColor(110, 110, 110)).into_text_style(&self.size);
                chart.draw_series([Text::new(
                    format!(" {name}"),
                    (place, y.start + 0.95 * (y.end - y.start)),
                    style,
                )])?;
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
            let style = INK.mix(0.75).stroke_width(2);
            chart
                .draw_series(LineSeries::new(stairs, style))?
                .label("Pareto front")
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], style));
        }
        Ok(())
    }

    fn draw_series(&self, chart: &mut Chart, series: &Series) -> std::result::Result<(), Box<dyn std::error::Error>> {
        let colour = RGBColor(series.colour.0, series.colour.1, series.colour.2);
        let points: Vec<(f64, f64)> =
            series.points.iter().map(|p| self.at(*p)).filter(|p| p.0.is_finite() && p.1.is_finite()).collect();
        if series.line {
            let drawn = chart.draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(2)))?;
            if series.marker.is_none() {
                drawn
                    .label(&series.name)
                    .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(2)));
            }
        }
        let points = points.into_iter();
        let name = &series.name;
        let (fill, thin, thick) = (colour.mix(0.65).filled(), colour.stroke_width(1), colour.stroke_width(2));
        match series.marker {
            None => {}
            Some(Marker::Disc) => {
                let drawn = chart.draw_series(points.map(|p| Circle::new(p, 4, fill)))?;
                drawn.label(name).legend(move |(x, y)| Circle::new((x + 10, y), 4, fill));
            }
            Some(Marker::Ring) => {
                let drawn = chart.draw_series(points.map(|p| Circle::new(p, 4, thin)))?;
                drawn.label(name).legend(move |(x, y)| Circle::new((x + 10, y), 4, thin));
            }
            Some(Marker::Cross) => {
                let drawn = chart.draw_series(points.map(|p| Cross::new(p, 4, thick)))?;
                drawn.label(name).legend(move |(x, y)| Cross::new((x + 10, y), 4, thick));
            }
            Some(Marker::Triangle) => {
                let drawn = chart.draw_series(points.map(|p| TriangleMarker::new(p, 5, fill)))?;
                drawn.label(name).legend(move |(x, y)| TriangleMarker::new((x + 10, y), 5, fill));
            }
        }
        Ok(())
    }

    fn draw_ring(&self, chart: &mut Chart) -> std::result::Result<(), Box<dyn std::error::Error>> {
        let Some((p, name)) = &self.marks.ringed else { return Ok(()) };
        let p = self.at(*p);
        if !(p.0.is_finite() && p.1.is_finite()) {
            return Ok(());
        }
        let style = ("sans-serif", 15, &INK).into_text_style(&self.size);
        chart.draw_series([Circle::new(p, 10, INK.stroke_width(2))])?;
        let name = name.clone();
        chart.draw_series([EmptyElement::at(p) + Text::new(name, (14, -20), style)])?;
        Ok(())
    }
}
