//! What the measurements say: the tables of the page and of docs/evidence/error_and_speed.md, and the CSV files behind them.

use crate::convergence::StepPoint;
use crate::cost::{Cost, PHASES, Precompute, Reduced};
use crate::error::cheapest_within;
use crate::kernels::Kernel;
use crate::methods::{Family, method};
use crate::peers::Peers;
use crate::physics::{Arc, Elastica, PlateMode};
use crate::row::{Row, number};
use crate::scenes::Scene;
use crate::statics::{Independent, Sweep};
use crate::table::{Table, decimal, duration, megabytes, percent};
use crate::{effort::Effort, motion, statics};

/// Everything that a run found.
pub struct Report {
    pub effort: Effort,
    pub version: String,
    pub sweeps: Vec<(&'static Sweep, statics::Outcome)>,
    pub motions: Vec<(Scene, motion::Outcome)>,
    pub steps: Vec<StepPoint>,
    pub modes: Vec<(usize, [f64; 2])>,
    pub independent: Vec<Independent>,
    pub elastica: Vec<Elastica>,
    pub plate: Vec<PlateMode>,
    pub arcs: Vec<Arc>,
    /// At the size of the beams and of the dinosaur.
    pub parts: Vec<Vec<Cost>>,
    pub growth: Vec<Cost>,
    /// Of the last `make bench`, or none.
    pub kernels: Vec<Kernel>,
    pub precompute: Vec<Precompute>,
    pub reduced: Vec<Reduced>,
    pub peers: Peers,
    /// Our methods on the cloth solver's sheet: name, vertices, microseconds a frame.
    pub beside_peers: Vec<(&'static str, usize, f64)>,
}

/// The points of a plot: microseconds and error.
pub fn points(rows: &[&Row]) -> Vec<(f64, f64)> {
    rows.iter().map(|r| (r.us[1], r.l2)).collect()
}

/// The runs on the mesh that the scene has in the paper's setting, as a host has them: a basis of 32 bits.
pub fn fixed_mesh<'a>(rows: &[&'a Row]) -> Vec<&'a Row> {
    let vertices = rows.iter().find(|r| r.paper).map(|r| r.vertices);
    rows.iter().copied().filter(|r| Some(r.vertices) == vertices && !r.f64_basis && r.l2.is_finite()).collect()
}

/// The cheapest run within each error: one line for each choice, with the tightest need that it meets.
fn cheapest<'a>(rows: &[&'a Row]) -> Vec<(&'a Row, f64)> {
    let mut best: Vec<(usize, f64)> = vec![];
    for need in [0.2, 0.1, 0.05, 0.02, 0.01] {
        if let Some(k) = cheapest_within(&points(rows), need) {
            best.retain(|b| b.0 != k);
            best.push((k, need));
        }
    }
    best.into_iter().map(|(k, need)| (rows[k], need)).collect()
}

/// The scene that the page opens with.
pub struct Opening<'a> {
    pub key: &'a str,
    pub title: &'a str,
    pub text: &'a str,
    pub rows: Vec<&'a Row>,
}

fn words(row: &Row) -> String {
    format!("{}, {}", row.method.label, row.knobs())
}

impl Report {
    /// Title and the rows with all knobs, of each scene.
    pub fn scenes(&self) -> Vec<(&str, Vec<&Row>)> {
        let mut all = vec![];
        for (sweep, outcome) in &self.sweeps {
            all.push((sweep.title, outcome.rows.iter().filter(|r| r.scene.ends_with("_knobs")).collect()));
        }
        for (scene, outcome) in &self.motions {
            all.push((scene.title, outcome.rows.iter().collect()));
        }
        all
    }

    pub fn rows(&self) -> Vec<Row> {
        let statics = self.sweeps.iter().flat_map(|s| &s.1.rows);
        statics.chain(self.motions.iter().flat_map(|m| &m.1.rows)).cloned().collect()
    }

    /// A curved shell in motion, as most are; in a small report what there is.
    pub fn opening(&self) -> Opening<'_> {
        let leaf = self.motions.iter().find(|m| m.0.key == "leaf").or(self.motions.last());
        let (scene, outcome) = leaf.expect("a scene in motion");
        Opening { key: scene.key, title: scene.title, text: scene.text, rows: outcome.rows.iter().collect() }
    }

    /// The cheapest within an error on the mesh of the page's opening.
    pub fn answer(&self) -> Table {
        let opening = self.opening();
        let mut table = Table::new("opening", &["scene", "an error of at most", "take", "error", "time a frame"]);
        for (row, need) in cheapest(&fixed_mesh(&opening.rows)) {
            table.push([opening.title.to_owned(), percent(need), words(row), percent(row.l2), duration(row.us[1])]);
        }
        table
    }

    /// Which method for which need: per scene the paper's setting and the cheapest within an error.
    pub fn choice(&self) -> Table {
        let mut table = Table::new("choice", &["scene", "need", "method and knobs", "error", "time a frame"]);
        for (title, rows) in self.scenes() {
            let mut put = |need: String, row: &Row| {
                table.push([title.to_owned(), need, words(row), percent(row.l2), duration(row.us[1])]);
            };
            if let Some(row) = rows.iter().find(|r| r.paper && r.l2.is_finite()) {
                put("the paper's setting".to_owned(), row);
            }
            cheapest(&rows).into_iter().for_each(|(row, need)| put(format!("within {}", percent(need)), row));
        }
        table
    }

    /// What halving the error costs, from the paper's setting on.
    pub fn next_factor(&self) -> Table {
        let header = ["scene", "error at most", "cheapest", "error", "time a frame", "times the one before"];
        let mut table = Table::new("next_factor_of_two", &header);
        for (title, rows) in self.scenes() {
            let Some(paper) = rows.iter().find(|r| r.paper && r.l2.is_finite()) else { continue };
            let points = points(&rows);
            let (mut before, mut target) = (paper.us[1], paper.l2);
            for k in 0..6 {
                let Some(best) = cheapest_within(&points, target) else { break };
                let row = rows[best];
                let name = if k == 0 { "the paper's setting".to_owned() } else { format!("1/{} of it", 1 << k) };
                let ratio = decimal(row.us[1] / before);
                table.push([title.to_owned(), name, words(row), percent(row.l2), duration(row.us[1]), ratio]);
                (before, target) = (row.us[1], 0.5 * target);
            }
        }
        table
    }

    /// The references and their own errors.
    pub fn references(&self) -> Table {
        let mut table = Table::new("references", &["scene", "reference", "its own error"]);
        for (sweep, outcome) in &self.sweeps {
            let text = "static nonlinear shell on the finest mesh, its error from the distance to the next".to_owned();
            // d = e − e/2ᵖ between meshes of edge l and l/2, with the order p observed, at most the second.
            let error = outcome.ladder.last().map_or(f64::NAN, |l| l.3 / (2f64.powf(l.4.clamp(1.0, 2.0)) - 1.0));
            table.push([sweep.title.to_owned(), text, percent(error)]);
        }
        for (scene, outcome) in &self.motions {
            table.push([scene.title.to_owned(), outcome.reference_text.clone(), percent(outcome.reference_error)]);
        }
        table
    }

    pub fn sweep_table(&self, sweep: &Sweep, outcome: &statics::Outcome) -> Table {
        let mut table = Table::new("errors", &["g", "method", "L2 error", "area change"]);
        for row in outcome.rows.iter().filter(|r| r.scene == sweep.key) {
            let load = row.case.trim_start_matches("g=").to_owned();
            let l2 = if row.method.family == Family::Shell { "reference".to_owned() } else { percent(row.l2) };
            table.push([load, row.method.label.to_owned(), l2, percent(row.area)]);
        }
        table
    }

    pub fn convergence_mesh(&self) -> Table {
        let mut table = Table::new("convergence_mesh", &["case", "rows across", "vertices", "edge", "error", "order"]);
        for (sweep, outcome) in &self.sweeps {
            for &(across, edge, vertices, error, order) in &outcome.ladder {
                let case = format!("{}, nonlinear shell", sweep.title);
                table.push([
                    case,
                    across.to_string(),
                    vertices.to_string(),
                    number(edge),
                    percent(error),
                    decimal(order),
                ]);
            }
        }
        table
    }

    pub fn plate_table(&self) -> Table {
        let header = ["rows across", "mode", "here", "Kirchhoff plate", "error", "order"];
        let mut table = Table::new("plate_frequencies", &header);
        for p in &self.plate {
            let values = [
                format!("{:.5}", p.here),
                format!("{:.5}", p.there),
                percent(p.here / p.there - 1.0),
                decimal(p.order),
            ];
            table.push([p.rows.to_string(), p.mode.to_string()].into_iter().chain(values));
        }
        table
    }

    pub fn convergence_steps(&self) -> Table {
        let mut table = Table::new("convergence_steps", &["method", "step_s", "distance to its limit", "order"]);
        for p in &self.steps {
            table.push([p.method.to_owned(), format!("1/{}", 30.0 * p.steps), percent(p.error), decimal(p.order)]);
        }
        table
    }

    pub fn convergence_modes(&self) -> Table {
        let mut table = Table::new("convergence_modes", &["modes", "linear modes", "warp"]);
        for (m, e) in &self.modes {
            table.push([m.to_string(), percent(e[0]), percent(e[1])]);
        }
        table
    }

    /// Method, discretization and implementation error, apart.
    pub fn error_kinds(&self) -> Table {
        let header = ["case", "method error", "discretization error", "implementation error"];
        let mut table = Table::new("error_kinds", &header);
        let none = || "–".to_owned();
        for (sweep, outcome) in &self.sweeps {
            let case = format!("g={}", sweep.knob_load);
            let warp =
                outcome.rows.iter().find(|r| r.scene == sweep.key && r.case == case && r.method.key == "warp_implicit");
            let mesh = outcome.ladder.iter().find(|l| l.0 == crate::scenes::beams::ROWS);
            let [w, d] = [warp.map_or(f64::NAN, |r| r.l2), mesh.map_or(f64::NAN, |m| m.3)];
            table.push([format!("{}, {case}, warp of 8 modes", sweep.title), percent(w), percent(d), none()]);
        }
        for e in self.elastica.iter().filter(|e| e.load == 2.0) {
            let case = format!("elastica, {} {}, slenderness {}", e.kind, e.load, e.slenderness);
            table.push([case, percent(e.warp), percent(e.shell), none()]);
        }
        for a in self.arcs.iter().filter(|a| [45.0, 90.0].contains(&a.degrees)) {
            let case = format!("arc of {}°, warp of {} modes (over the length)", a.degrees, a.modes);
            table.push([case, percent(a.method), none(), percent(a.implementation)]);
        }
        for key in ["lma_implicit", "warp_implicit", "shell_implicit"] {
            let apart = self.independent.iter().filter(|i| i.method == key).map(|i| (i.here / i.there - 1.0).abs());
            let case =
                format!("bundled beams, {}: ‖u‖ against an independent implementation, worst", method(key).label);
            table.push([case, none(), none(), percent(apart.fold(0.0, f64::max))]);
        }
        table
    }

    pub fn independent_table(&self) -> Table {
        let mut table = Table::new("independent", &["beam", "gravity", "method", "here", "there", "apart"]);
        for i in &self.independent {
            let gravity = i.gravity.map(|g| format!("{g:.2}")).join(" ");
            let values =
                [format!("{:.9}", i.here), format!("{:.9}", i.there), format!("{:.1e}", i.here / i.there - 1.0)];
            table.push([i.beam.clone(), gravity, i.method.to_owned()].into_iter().chain(values));
        }
        table
    }

    pub fn elastica_table(&self) -> Table {
        let header =
            ["load", "slope", "slenderness", "nonlinear shell to elastica", "warp to shell", "linear modes to shell"];
        let mut table = Table::new("elastica", &header);
        for e in &self.elastica {
            let load = format!("{} {}", e.kind, e.load);
            let errors = [percent(e.shell), percent(e.warp), percent(e.lma)];
            table.push([load, format!("{:.0}°", e.slope_degrees), e.slenderness.to_string()].into_iter().chain(errors));
        }
        table
    }

    pub fn arc_table(&self) -> Table {
        let mut table = Table::new("warp_on_an_arc", &["arc", "modes", "method error", "library to formula"]);
        for a in &self.arcs {
            let values = [percent(a.method), percent(a.implementation)];
            table.push([format!("{}°", a.degrees), a.modes.to_string()].into_iter().chain(values));
        }
        table
    }

    pub fn parts_table(&self) -> Table {
        let mut table = Table::new("step_parts", &["part of a frame", "vertices", "time", "times reading the basis"]);
        for c in self.parts.iter().flatten() {
            table.push([c.series.clone(), c.size.to_string(), duration(c.us), decimal(c.reads)]);
        }
        table
    }

    pub fn growth_table(&self) -> Table {
        let header = ["series", "size", "time, µs", "times reading the basis", "ns per vertex and mode", "note"];
        let mut table = Table::new("step_growth", &header);
        for c in &self.growth {
            let each = if c.work > 0 { format!("{:.1}", 1e3 * c.us / c.work as f64) } else { "–".to_owned() };
            let us = format!("{:.2}", c.us);
            table.push([c.series.clone(), c.size.to_string(), us, decimal(c.reads), each, c.note.clone()]);
        }
        table
    }

    pub fn precompute_table(&self) -> Table {
        let mut header = vec!["vertices", "modes", "seconds"];
        header.extend(PHASES);
        header.extend(["peak MB", "estimated MB", "model MB"]);
        let mut table = Table::new("precompute", &header);
        for p in &self.precompute {
            let head = [p.vertices.to_string(), p.modes.to_string(), format!("{:.2}", p.seconds)];
            let phases = p.phases.iter().map(|s| format!("{s:.2}"));
            let tail = [p.peak.unwrap_or(f64::NAN), p.estimate, p.model].map(megabytes);
            table.push(head.into_iter().chain(phases).chain(tail));
        }
        table
    }

    /// Steps, and the precompute as a multiple of that of the modes alone.
    pub fn reduced_table(&self) -> Table {
        let header = ["vertices", "fields", "elements", "precompute", "times the modes alone", "step"];
        let mut table = Table::new("reduced_shells", &header);
        for r in &self.reduced {
            let [alone, with] = r.seconds;
            let sizes = [r.vertices, r.fields, r.elements].map(|n| n.to_string());
            let times = [duration(1e6 * with), decimal(with / alone), duration(r.us)];
            table.push(sizes.into_iter().chain(times));
        }
        table
    }

    pub fn peers_table(&self) -> Table {
        let mut table = Table::new("peers", &["program", "task", "time", "note"]);
        match &self.peers.eigsh {
            Ok(p) => {
                let task =
                    format!("{} lowest modes of the dinosaur, {} unknowns, best of {}", p.modes, p.unknowns, p.runs);
                let ours = "file to model, certificate included".to_owned();
                table.push(["shellwarp".to_owned(), task.clone(), duration(p.ours_seconds * 1e6), ours]);
                let note = format!(
                    "eigsh alone; {:.1} times shellwarp; eigenvalues agree to {:.0e}",
                    p.scipy_seconds / p.ours_seconds,
                    p.eigenvalues_apart
                );
                table.push([format!("SciPy {}", p.scipy), task, duration(p.scipy_seconds * 1e6), note]);
            }
            Err(reason) => {
                table.push(["SciPy".to_owned(), "modes of the dinosaur".to_owned(), "–".to_owned(), reason.clone()])
            }
        }
        match &self.peers.cloth {
            Ok(solvers) => {
                for c in solvers {
                    let task = format!("a frame of 1/30 s, sheet of {} vertices", c.vertices);
                    let note = "for scale: another material and method; contacts off".to_owned();
                    table.push([c.solver.clone(), task, duration(c.us_per_frame), note]);
                }
            }
            Err(reason) => {
                table.push(["Newton".to_owned(), "a frame of a sheet".to_owned(), "–".to_owned(), reason.clone()])
            }
        }
        for (label, vertices, us) in &self.beside_peers {
            let task = format!("a frame of 1/30 s, sheet of {vertices} vertices");
            table.push(["shellwarp".to_owned(), task, duration(*us), (*label).to_owned()]);
        }
        let dinosaur = self.motions.iter().find(|m| m.0.key == "dinosaur");
        if let Some(row) = dinosaur.and_then(|m| m.1.rows.iter().find(|r| r.paper)) {
            let task = format!("a frame of 1/30 s, dinosaur of {} vertices", row.vertices);
            let note = format!("the paper's setting: {}", row.knobs());
            table.push(["shellwarp".to_owned(), task, duration(row.us[1]), note]);
        }
        table
    }

    /// Every table that has a file of its own.
    pub fn tables(&self) -> Vec<Table> {
        vec![
            self.answer(),
            self.choice(),
            self.next_factor(),
            self.references(),
            self.convergence_mesh(),
            self.convergence_steps(),
            self.convergence_modes(),
            self.plate_table(),
            self.elastica_table(),
            self.arc_table(),
            self.independent_table(),
            self.error_kinds(),
            self.parts_table(),
            self.growth_table(),
            self.precompute_table(),
            self.reduced_table(),
            self.peers_table(),
        ]
    }
}
