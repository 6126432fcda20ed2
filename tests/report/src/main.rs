//! Measures every method of the built library and writes out/report: CSV files, SVG plots, index.html.

mod cache;
mod convergence;
mod cost;
mod effort;
mod error;
mod kernels;
mod library;
mod mesh;
mod methods;
mod motion;
mod motions;
mod names;
mod page;
mod peers;
mod physics;
mod plots;
mod row;
mod scenes;
mod stability;
mod statics;
mod summary;
mod summary_page;
mod table;

use anyhow::{Context, Result};
use effort::{Effort, Progress};
use std::path::{Path, PathBuf};

const USAGE: &str = "usage: shellwarp-report --library FILE [--out DIR] [--viewer FILE] [--python FILE] [--docs DIR] \
    [--quick | --smoke] [--fresh]
    [--stability [--cli FILE | --group NAME]] [--kernels] [--precompute VERTICES]

  --library  the built shared library
  --out      where the report goes, out/report by default
  --viewer   the bundled player; without it the page has none
  --python   the Python with the peers' packages
  --docs     also write error_and_speed.md and its plots there
  --quick    fewer knobs and scenes, under two minutes
  --smoke    a few seconds, for tests
  --fresh    forget the reference runs of earlier reports
  --stability  only the map of where each method holds; with --docs also stability.md
  --group    of that map only these cells, such as contact; with --docs its rows of stability.md
  --kernels  only the plots of the DIR/kernels.csv that `make bench` leaves; with --docs they go there
  --cli      the command-line program, for the comparison of 32 and 64 bits
  --precompute  only time one precompute of so many vertices, and print it as JSON";

/// What `make bench` leaves where the report goes.
const KERNELS: &str = "kernels.csv";

struct Options {
    library: PathBuf,
    out: PathBuf,
    viewer: Option<PathBuf>,
    python: PathBuf,
    docs: Option<PathBuf>,
    effort: Effort,
    fresh: bool,
    stability: bool,
    kernels: bool,
    cli: Option<PathBuf>,
    group: Option<String>,
    precompute: Option<usize>,
}

fn options() -> Result<Options> {
    use lexopt::prelude::*;
    let mut o = Options {
        library: PathBuf::new(),
        out: "out/report".into(),
        viewer: None,
        python: "python3".into(),
        docs: None,
        effort: Effort::Full,
        fresh: false,
        stability: false,
        kernels: false,
        cli: None,
        group: None,
        precompute: None,
    };
    let mut parser = lexopt::Parser::from_env();
    while let Some(argument) = parser.next()? {
        match argument {
            Long("library") => o.library = parser.value()?.into(),
            Long("out") => o.out = parser.value()?.into(),
            Long("viewer") => o.viewer = Some(parser.value()?.into()),
            Long("python") => o.python = parser.value()?.into(),
            Long("docs") => o.docs = Some(parser.value()?.into()),
            Long("quick") => o.effort = Effort::Quick,
            Long("smoke") => o.effort = Effort::Smoke,
            Long("fresh") => o.fresh = true,
            Long("stability") => o.stability = true,
            Long("kernels") => o.kernels = true,
            Long("cli") => o.cli = Some(parser.value()?.into()),
            Long("group") => o.group = Some(parser.value()?.string()?),
            Long("precompute") => o.precompute = Some(parser.value()?.parse()?),
            Long("help") => {
                println!("{USAGE}");
                std::process::exit(0);
            }
            other => return Err(other.unexpected().into()),
        }
    }
    anyhow::ensure!(o.kernels || !o.library.as_os_str().is_empty(), "--library is missing\n{USAGE}");
    Ok(o)
}

/// The processor as the system names it.
fn machine() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|l| l.strip_prefix("model name")).and_then(|l| l.split_once(": "));
    let cores = std::thread::available_parallelism().map_or(0, |n| n.get());
    format!("{}, {cores} cores", name.map_or(std::env::consts::ARCH, |n| n.1))
}

fn measure(o: &Options, data: &Path, peers: &Path) -> Result<summary::Report> {
    let library = library::Library::open(&o.library)?;
    let cache = cache::Cache::open(o.out.join("cache"), &o.library, o.fresh)?;
    let (effort, full) = (o.effort, o.effort == Effort::Full);
    let wanted = |key: &str| match effort {
        Effort::Full => true,
        Effort::Quick => key != "dinosaur", // its reference alone takes minutes
        Effort::Smoke => key == "vee_release" || key == "ball",
    };
    let scenes: Vec<_> = scenes::all(data)?.into_iter().filter(|s| wanted(s.key)).collect();
    let sweeps = if effort == Effort::Smoke { &statics::SWEEPS[..1] } else { statics::SWEEPS };
    let mut progress = Progress::new(scenes.len() + sweeps.len() + 6);
    let mut still = vec![];
    for sweep in sweeps {
        progress.stage(sweep.title);
        still.push((sweep, statics::run(sweep, &library, effort, &mut progress).context(sweep.title)?));
    }
    let mut moved = vec![];
    for scene in scenes {
        progress.stage(scene.title);
        let outcome = motion::run(&scene, &library, &cache, effort, &mut progress).context(scene.title)?;
        moved.push((scene, outcome));
    }
    progress.stage("convergence");
    let beam = scenes::all(data)?.swap_remove(0);
    let steps = if effort == Effort::Smoke { vec![] } else { convergence::steps(&beam, &library, &cache, effort)? };
    let modes = convergence::modes(&library, effort)?;
    progress.stage("elastica, plate, arc, independent program");
    let elastica = physics::elastica(&library, data, full)?;
    let plate = physics::plate(&library, data, full)?;
    let arcs = physics::arc(&library, data, full)?;
    let independent = statics::independent(&library, data)?;
    progress.stage("cost of a step");
    let sizes: &[usize] = if full { &[330, 13_000] } else { &[330] };
    let parts = sizes.iter().map(|n| cost::parts(&library, *n, 8)).collect::<Result<_>>()?;
    let growth = cost::growth(&library, effort, &mut progress)?;
    progress.stage("cost of precomputing");
    let precompute = cost::precompute(&o.library, effort, &mut progress)?;
    progress.stage("cost of reduced shells");
    let reduced = cost::reduced(&library, effort, &mut progress)?;
    progress.stage("peers");
    let peers = peers::all(&o.python, peers, full)?;
    let same_sheet = peers.cloth.as_ref().ok().and_then(|all| all.first()).map(|c| c.vertices);
    let beside_peers = same_sheet.map_or(Ok(vec![]), |n| cost::sheet_frames(&library, n))?;
    progress.done();
    let version = library.version();
    let motions = moved;
    let sweeps = still;
    Ok(summary::Report {
        effort,
        version,
        sweeps,
        motions,
        steps,
        modes,
        independent,
        elastica,
        plate,
        arcs,
        parts,
        growth,
        kernels: kernels::read(&o.out.join(KERNELS))?,
        precompute,
        reduced,
        peers,
        beside_peers,
    })
}

fn main() -> std::process::ExitCode {
    match run() {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("report: FAILED: {error:#}");
            std::process::ExitCode::FAILURE
        }
    }
}

fn run() -> Result<()> {
    let o = options()?;
    if let Some(size) = o.precompute {
        let library = library::Library::open(&o.library)?;
        println!("{}", serde_json::to_string(&cost::precompute_once(&library, size)?)?);
        return Ok(());
    }
    std::fs::create_dir_all(&o.out)?;
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    if o.stability {
        let library = library::Library::open(&o.library)?;
        if let Some(group) = &o.group {
            return stability::run_group(&library, group, &o.out, o.docs.as_deref());
        }
        return stability::run(&library, o.cli.as_deref(), &here.join("../scenes"), &o.out, o.docs.as_deref());
    }
    if o.kernels {
        let folder = o.docs.map_or(o.out.clone(), |docs| docs.join("report"));
        let figures = kernels::figures(&kernels::read(&o.out.join(KERNELS))?)?;
        return figures.iter().try_for_each(|figure| figure.write(&folder));
    }
    let report = measure(&o, &here.join("../data"), &here.join("peers"))?;
    row::write(&o.out, &report.rows())?;
    report.tables().iter().try_for_each(|t| t.write(&o.out))?;
    let figures = page::figures(&report)?;
    figures.iter().try_for_each(|figure| figure.write(&o.out))?;
    let viewer = o.viewer.as_ref().map(std::fs::read_to_string).transpose().context("the bundled player")?;
    page::write(&o.out, &report, &figures, &machine(), viewer.as_deref())?;
    if let Some(docs) = &o.docs {
        summary_page::write(docs, &report, &figures)?;
    }
    println!("report: {}", o.out.join("index.html").display());
    Ok(())
}
