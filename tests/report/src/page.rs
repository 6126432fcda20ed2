//! The page: one file with tables, plots and the player.

use crate::cost::READING;
use crate::effort::Effort;
use crate::error::pareto_front;
use crate::kernels;
use crate::methods::{Family, KINDS, METHODS, Marker};
use crate::motions;
use crate::plots::{HALF, Marks, Plot, Scale, Series, WHOLE};
use crate::row::Row;
use crate::scenes::FRAME;
use crate::summary::{Report, fixed_mesh, points};
use crate::table::escape;
use anyhow::Result;
use std::path::Path;

const TEMPLATE: &str = include_str!("../page/template.html");
const STYLE: &str = include_str!("../page/style.css");
/// Beside the page. Made by `make contact-pictures` and `make demo-blender`.
const PICTURES: [(&str, &[u8]); 2] = [
    ("contact.png", include_bytes!("../../../docs/guide/pictures/contact.png")),
    ("character.png", include_bytes!("../../../docs/guide/pictures/blender_character.png")),
];

/// Error against run time of one scene, over all knobs. Dotted: what each mesh gets wrong by itself.
pub fn pareto_plot(title: &str, rows: &[&Row], meshes: &[(f64, String)]) -> Plot<'static> {
    let points = points(rows);
    let series = METHODS.iter().map(|m| Series {
        name: m.label.to_owned(),
        colour: m.colour,
        marker: Some(m.marker),
        line: false,
        points: (0..rows.len())
            .filter(|&i| rows[i].method.key == m.key && rows[i].l2 > 0.0)
            .map(|i| points[i])
            .collect(),
    });
    let shown = series.filter(|s: &Series| s.points.iter().any(|p| p.1.is_finite())).collect();
    let ringed = rows.iter().find(|r| r.paper).map(|r| ((r.us[1], r.l2), "the paper's setting"));
    let front = pareto_front(&points).into_iter().map(|i| points[i]).filter(|p| p.1 > 0.0).collect();
    Plot {
        title: format!("{title}: error against time, all settings and meshes"),
        x: TIME,
        y: ERROR,
        series: shown,
        marks: Marks {
            front,
            ringed,
            limit: REAL_TIME,
            levels: meshes.to_vec(),
            levels_are: "the mesh's own error",
            named: false,
        },
        size: WHOLE,
    }
}

const TIME: (&str, Scale) = ("computing time for a frame of 1/30 s", Scale::Time);
const ERROR: (&str, Scale) = ("error, % of the displacement (relative L2)", Scale::Percent);
const REAL_TIME: Option<(f64, &str)> = Some((1e6 / 30.0, "real time: 1/30 s"));

/// What a user with a mesh asks: the least error of each method for its time, on the scene's own mesh.
pub fn fixed_mesh_plot(title: &str, rows: &[&Row]) -> Plot<'static> {
    let mut vertices = 0;
    let mut series = vec![];
    for kind in KINDS {
        let own = fixed_mesh(rows);
        let own: Vec<&Row> = own.into_iter().filter(|r| r.method.method == kind.method && r.l2 > 0.0).collect();
        let Some(first) = own.first() else { continue };
        vertices = first.vertices;
        let all = points(&own);
        let mut front: Vec<_> = pareto_front(&all).into_iter().map(|i| all[i]).collect();
        // What brings less than a twentieth is not worth a point.
        front.dedup_by(|next, last| next.1 > 0.95 * last.1);
        series.push(line(kind.name, first.method.colour, Some(Marker::Disc), front));
    }
    Plot {
        title: format!("{title}: error against time on one mesh of {vertices} vertices"),
        x: TIME,
        y: ERROR,
        series,
        marks: Marks { limit: REAL_TIME, named: true, ..Marks::default() },
        size: WHOLE,
    }
}

pub fn line(name: &str, colour: (u8, u8, u8), marker: Option<Marker>, points: Vec<(f64, f64)>) -> Series {
    Series { name: name.to_owned(), colour, marker, line: true, points }
}

pub fn colour(key: &str) -> (u8, u8, u8) {
    METHODS.iter().find(|m| m.key == key).map_or((60, 60, 60), |m| m.colour)
}

/// A grey scale for series that are no method.
fn grey(k: usize, of: usize) -> (u8, u8, u8) {
    let t = 40 + (150 * k / of.max(1)) as u8;
    (t, t / 2 + 40, 200 - t / 2)
}

pub struct Figure {
    /// File name without .svg.
    pub name: String,
    pub svg: String,
}

impl Figure {
    pub fn write(&self, folder: &Path) -> Result<()> {
        Ok(std::fs::write(folder.join(format!("{}.svg", self.name)), &self.svg)?)
    }
}

/// All plots, by name.
pub fn figures(report: &Report) -> Result<Vec<Figure>> {
    let mut all = vec![];
    let mut put = |name: String, plot: Plot| -> Result<()> {
        all.push(Figure { name, svg: plot.draw()? });
        Ok(())
    };
    for (sweep, outcome) in &report.sweeps {
        let knobs: Vec<&Row> = outcome.rows.iter().filter(|r| r.scene.ends_with("_knobs")).collect();
        let meshes: Vec<_> = outcome.ladder.iter().map(|l| (l.3, format!("{} vertices", l.2))).collect();
        put(format!("pareto_{}", sweep.key), pareto_plot(sweep.title, &knobs, &meshes))?;
        put(format!("fixed_{}", sweep.key), fixed_mesh_plot(sweep.title, &knobs))?;
        let by_load = |measure: fn(&Row) -> f64, shell: bool| -> Vec<Series> {
            METHODS
                .iter()
                .filter(|m| m.integrator < 2 && (shell || m.family != Family::Shell))
                .map(|m| {
                    let rows = outcome.rows.iter().filter(|r| r.scene == sweep.key && r.method.key == m.key);
                    let load = |r: &Row| r.case.trim_start_matches("g=").parse().unwrap_or(f64::NAN);
                    let name = m.label.split(',').next().unwrap_or(m.label);
                    line(name, m.colour, Some(m.marker), rows.map(|r| (load(r), measure(r))).collect())
                })
                .filter(|s| !s.points.is_empty())
                .collect()
        };
        let x = ("gravity, m/s²", Scale::Linear);
        let plot = |what, y, series| Plot {
            title: format!("{}: {what}", sweep.title),
            x,
            y,
            series,
            marks: Marks::default(),
            size: HALF,
        };
        let error = plot("error", ERROR, by_load(|r| r.l2, false));
        put(format!("sweep_error_{}", sweep.key), error)?;
        let area = plot("change of area", ("change of area, %", Scale::Linear), by_load(|r| 100.0 * r.area, true));
        put(format!("sweep_area_{}", sweep.key), area)?;
    }
    for (scene, outcome) in &report.motions {
        let rows: Vec<&Row> = outcome.rows.iter().collect();
        put(format!("pareto_{}", scene.key), pareto_plot(scene.title, &rows, &[]))?;
        put(format!("fixed_{}", scene.key), fixed_mesh_plot(scene.title, &rows))?;
        let (v, c) = (scene.mesh.nearest(scene.probe.0), scene.probe.1);
        let traces = outcome.shown.iter().map(|track| {
            let height = |f: &Vec<[f64; 3]>| f[v][c] - scene.mesh.positions[v][c];
            let signal = track.frames.iter().enumerate().map(|(k, f)| ((k + 1) as f64 * FRAME, height(f)));
            line(track.name, track.colour, None, signal.collect())
        });
        let y = (["displacement along x, m", "displacement along y, m", "displacement along z, m"][c], Scale::Linear);
        put(
            format!("trace_{}", scene.key),
            Plot {
                title: format!("{}: one vertex over time", scene.title),
                x: ("time, s", Scale::Linear),
                y,
                series: traces.collect(),
                marks: Marks::default(),
                size: WHOLE,
            },
        )?;
    }
    convergence_figures(report, &mut put)?;
    cost_figures(report, &mut put)?;
    all.extend(kernels::figures(&report.kernels)?);
    Ok(all)
}

type Put<'a> = dyn FnMut(String, Plot) -> Result<()> + 'a;

fn convergence_figures(report: &Report, put: &mut Put) -> Result<()> {
    let series = METHODS.iter().map(|m| {
        let own = report.steps.iter().filter(|p| p.method == m.key);
        line(m.label, m.colour, Some(m.marker), own.map(|p| (FRAME / p.steps, p.error)).collect())
    });
    let y = ("distance to its own limit, % of the displacement", Scale::Percent);
    let series = series.filter(|s| !s.points.is_empty()).collect();
    let mut whole = |name: &str, title: &str, x, y, series| {
        put(name.to_owned(), Plot { title: title.to_owned(), x, y, series, marks: Marks::default(), size: WHOLE })
    };
    whole("convergence_steps", "Flat beam, released: convergence in step size", ("step, s", Scale::Log), y, series)?;
    let mut series: Vec<Series> = report
        .sweeps
        .iter()
        .enumerate()
        .map(|(k, (sweep, outcome))| {
            let points = outcome.ladder.iter().map(|l| (l.1, l.3)).collect();
            line(sweep.title, grey(k, 4), Some(Marker::Disc), points)
        })
        .collect();
    let plate = report.plate.iter().filter(|p| p.mode == 1).map(|p| (p.edge, (p.here / p.there - 1.0).abs()));
    series.push(line("square plate, first frequency", (20, 20, 20), Some(Marker::Cross), plate.collect()));
    let y = ("error, % of the displacement or frequency", Scale::Percent);
    whole("convergence_mesh", "Full shell: convergence in mesh size", ("edge length, m", Scale::Log), y, series)?;
    let by = |k: usize| report.modes.iter().map(|(m, e)| (*m as f64, e[k])).collect::<Vec<_>>();
    let series = vec![
        line("linear modes", colour("lma_implicit"), Some(Marker::Disc), by(0)),
        line("warp", colour("warp_implicit"), Some(Marker::Disc), by(1)),
    ];
    whole(
        "convergence_modes",
        "Flat beam at rest: convergence in modes",
        ("number of modes", Scale::Log),
        ERROR,
        series,
    )
}

fn cost_figures(report: &Report, put: &mut Put) -> Result<()> {
    let labels = [("vertices", "number of vertices", "8 modes"), ("modes", "number of modes", "3,000 vertices")];
    for (what, label, at) in labels {
        let names = [
            ("step, linear modes", "lma_implicit", Marker::Disc),
            ("step, warp", "warp_implicit", Marker::Disc),
            ("positions, warp", "warp_implicit", Marker::Ring),
            (READING, "", Marker::Cross),
        ];
        let series = names.into_iter().map(|(name, key, marker)| {
            let own = report.growth.iter().filter(|c| c.series == format!("{what}: {name}"));
            let name = if name == READING { "reading the basis in a plain loop" } else { name };
            line(name, colour(key), Some(marker), own.map(|c| (c.size as f64, c.us)).collect())
        });
        let series = series.filter(|s| !s.points.is_empty()).collect();
        let plot = Plot {
            title: format!("Time of a frame's parts over {what}, {at}"),
            x: (label, Scale::Log),
            y: ("time of a call", Scale::Time),
            series,
            marks: Marks::default(),
            size: HALF,
        };
        put(format!("cost_{what}"), plot)?;
    }
    let all = |measure: &dyn Fn(&crate::cost::Precompute) -> f64| -> Vec<(f64, f64)> {
        report.precompute.iter().map(|p| (p.vertices as f64, measure(p))).collect()
    };
    let mut series = vec![line("all", (20, 20, 20), Some(Marker::Disc), all(&|p| 1e6 * p.seconds))];
    for (k, phase) in crate::cost::PHASES.iter().enumerate() {
        let points = all(&|p| 1e6 * p.phases[k]).into_iter().filter(|p| p.1 > 0.0).collect();
        series.push(line(phase, grey(k, 6), None, points));
    }
    let (x, y) = (("number of vertices", Scale::Log), ("time", Scale::Time));
    let title = "Precompute of a square sheet, 16 modes, by phase".to_owned();
    put("precompute".into(), Plot { title, x, y, series, marks: Marks::default(), size: WHOLE })
}

/// Writes index.html and its pictures; `viewer` is the bundled player, if there is one.
pub fn write(folder: &Path, report: &Report, figures: &[Figure], machine: &str, viewer: Option<&str>) -> Result<()> {
    let figure = |name: &str| -> String {
        let svg = figures.iter().find(|f| f.name == name).map_or("", |f| &f.svg);
        format!("<div class=\"plot\">{svg}</div>")
    };
    let mut scenes = String::new();
    let all_settings = |key: &str| {
        let plot = figure(&format!("pareto_{key}"));
        format!("<details><summary>All settings and meshes</summary>{plot}</details>")
    };
    for (scene, outcome) in &report.motions {
        scenes += &scene_section(scene.title, scene.text, &figure(&format!("fixed_{}", scene.key)));
        scenes += &all_settings(scene.key);
        let failures = outcome.rows.iter().filter(|r| !r.failure.is_empty()).count();
        if failures > 0 {
            scenes += &format!(
                "<p class=\"note\">Runs that failed, as explicit steps that are too long do: {failures}; see errors.csv.</p>"
            );
        }
        scenes += "<p>The probe over time, 1/30 s steps and the exact propagator:</p>";
        scenes += &figure(&format!("trace_{}", scene.key));
    }
    for (sweep, outcome) in &report.sweeps {
        let heading = format!("{} (g = {})", sweep.title, sweep.knob_load);
        scenes += &scene_section(&heading, sweep.text, &figure(&format!("fixed_{}", sweep.key)));
        scenes += &all_settings(sweep.key);
        scenes += "<p>Over gravity, 8 modes, against the nonlinear shell on the same mesh:</p><div class=\"pair\">";
        scenes += &figure(&format!("sweep_error_{}", sweep.key));
        scenes += &figure(&format!("sweep_area_{}", sweep.key));
        scenes += &format!(
            "</div><details><summary>The numbers</summary>{}</details>",
            report.sweep_table(sweep, outcome).html()
        );
    }
    let player = match viewer {
        Some(_) => include_str!("../page/player.html").to_owned(),
        None => "<p class=\"note\">The 3D player is left out: npm was not there to bundle it.</p>".to_owned(),
    };
    let mut scripts = String::new();
    if let Some(viewer) = viewer {
        let entries = report.motions.iter().rev().map(|(s, o)| motions::entry(s, o)).collect::<Result<Vec<_>>>()?;
        let data = serde_json::to_string(&entries)?;
        scripts = format!(
            "<script type=\"application/json\" id=\"motions\">{data}</script>\n<script>{}</script>",
            viewer.replace("</script", "<\\/script")
        );
    }
    let note = match report.effort {
        Effort::Full => "",
        _ => {
            "<p class=\"note\">A quick run: fewer knobs and scenes, and no peers. <code>make report</code> makes the whole.</p>"
        }
    };
    let opening = report.opening();
    let methods = KINDS.iter().map(|k| format!("<li><b>{}</b>: {}</li>", escape(k.name), escape(k.advice)));
    let parts: Vec<(&str, String)> = vec![
        ("style", STYLE.to_owned()),
        ("opening_text", escape(opening.text)),
        ("opening_plot", figure(&format!("fixed_{}", opening.key))),
        ("answer", report.answer().html()),
        ("count", spelled(KINDS.len())),
        ("methods", methods.collect()),
        ("note", note.to_owned()),
        ("version", escape(&report.version)),
        ("machine", escape(machine)),
        ("player", player),
        ("choice", report.choice().html()),
        ("scenes", scenes),
        ("next_factor", report.next_factor().html()),
        ("references", report.references().html()),
        ("plot_steps", figure("convergence_steps")),
        ("table_steps", report.convergence_steps().html()),
        ("plot_mesh", figure("convergence_mesh")),
        ("table_mesh", report.convergence_mesh().html()),
        ("plot_modes", figure("convergence_modes")),
        ("table_modes", report.convergence_modes().html()),
        ("kinds", report.error_kinds().html()),
        ("elastica", report.elastica_table().html()),
        ("plate", report.plate_table().html()),
        ("arc", report.arc_table().html()),
        ("peers", report.peers_table().html()),
        ("parts", report.parts_table().html()),
        ("plot_vertices", figure("cost_vertices")),
        ("plot_cost_modes", figure("cost_modes")),
        ("growth", report.growth_table().html()),
        ("kernels", kernels_section(report, &(figure("kernels_vertices") + &figure("kernels_modes")))),
        ("plot_precompute", figure("precompute")),
        ("precompute", report.precompute_table().html()),
        ("reduced", report.reduced_table().html()),
        ("scripts", scripts),
    ];
    std::fs::write(folder.join("index.html"), filled(TEMPLATE, &parts))?;
    PICTURES.iter().try_for_each(|(name, bytes)| Ok(std::fs::write(folder.join(name), bytes)?))
}

/// A number of methods in letters, at the head of a sentence.
fn spelled(n: usize) -> String {
    let words = ["No", "One", "Two", "Three", "Four", "Five", "Six", "Seven", "Eight", "Nine", "Ten"];
    words.get(n).map_or_else(|| n.to_string(), |word| (*word).to_owned())
}

/// The template with each {{name}} replaced once, so that nothing in the data is taken for a name.
pub fn filled(template: &str, parts: &[(&str, String)]) -> String {
    let mut text = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, after) = after.split_once("}}").expect("a closed name in the template");
        text += before;
        text += &parts.iter().find(|(n, _)| *n == name).unwrap_or_else(|| panic!("no part {name} of the page")).1;
        rest = after;
    }
    text + rest
}

/// What `make bench` measured; nothing where it was not run.
fn kernels_section(report: &Report, plots: &str) -> String {
    if report.kernels.is_empty() {
        return String::new();
    }
    let text = "Of the last <code>make bench</code> beside this page. A reading is that of the basis once in the widest registers and, for positions, \
        the writing of them, timed in the same turns. All figures and what limits them: docs/evidence/speed.md.";
    format!("<h3>The kernels and their goals</h3>\n<p>{text}</p>\n{}{plots}", kernels::goals(&report.kernels).html())
}

fn scene_section(title: &str, text: &str, plot: &str) -> String {
    format!("<h3>{}</h3><p>{}</p>{plot}", escape(title), escape(text))
}
