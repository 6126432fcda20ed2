//! Error against the full shell on loads that were never trained on: the paper's warp beside reduced shells of several sizes, with the best
//! that their fields could do, and what goes on after `State::fall_back`. docs/evidence/front.md says what it found.
//!
//! usage: front [--scene KEY] [--reduced "FIELDS,ELEMENTS,POSES ..."] [--docs FILE] [--ablate] [--follow] [--judge] [--gates] [--times]
//!
//! With --ablate, what each ingredient of the reduced shell buys, on held-out and fresh loads: a column of docs/evidence/front.md for each shell.
//! With --follow, what one or two Newton steps of the full shell a frame make of the loads at a fifth of the size.
//! With --judge, the judging list of front/judging.rs by what SW_METHOD_AUTO takes, with 8 modes and 20, 40 and 100 fields. With --gates, what each
//! gate found and took. With --times, error against the time of a frame on each shell.
#![allow(missing_docs)]

#[path = "front/cases.rs"]
mod cases;
#[path = "../common/mod.rs"]
mod common;
#[path = "docs.rs"]
mod docs;
#[path = "front/followed.rs"]
mod followed;
#[path = "front/judging.rs"]
mod judging;
#[path = "front/pooled.rs"]
mod pooled;
#[path = "front/scenes.rs"]
mod scenes;
#[path = "front/times.rs"]
mod times;

use cases::{Case, loaded};
use common::{displacements, mass_error};
use pooled::{Measured, Pool};
use scenes::{Part, Scene};
use shellwarp::Vec3;
use shellwarp::model::{Model, Options};
use shellwarp::reduced::{self, AnyFields, Assumed, ReducedShell};
use shellwarp::state::{Method, Space, State};
use std::sync::Arc;
use std::time::Instant;

/// Fields, elements and equilibria of the reduced shells.
const SPECS: &str = "20,0,62 40,0,62 100,0,62";
/// Up to rounding and the tolerance of equilibria.
const SAME: f64 = 1.0001;
/// Of the aims, that of the claims, and what is near the full shell there.
const AT: f64 = 0.2;
const NEARLY: f64 = 0.05;
/// Of the loads, what an equilibrium of the full shell leaves that a certificate led to, at most.
const BALANCED: f64 = 1e-3;

/// The best that fields can do.
fn projection(model: &Model, exact: &[Vec3]) -> f64 {
    let Some(reduced) = &model.reduced else { return f64::NAN };
    let AnyFields::F32(fields) = &reduced.fields else { return f64::NAN };
    let mass = &model.shell.mass;
    let q: Vec<f64> =
        (0..fields.n).map(|k| (0..exact.len()).map(|v| mass[v] * fields.at(k, v).dot(&exact[v])).sum()).collect();
    let mut u = vec![Vec3::zeros(); exact.len()];
    fields.displacements(&q, |v, x| u[v] = x);
    mass_error(&model.shell, &u, exact)
}

/// What is left after Newton steps of the full shell from there.
fn corrected(scene: &Scene, state: &State, steps: usize, case: &Case) -> Option<f64> {
    let rest = &scene.shell.mesh.positions;
    let x = state.positions_corrected(Space::Frame, steps).ok()?;
    let u: Vec<Vec3> = x.iter().zip(rest).map(|(x, rest)| x - rest).collect();
    Some(mass_error(&scene.shell, &u, &case.exact))
}

fn off(scene: &Scene, state: &State, case: &Case) -> f64 {
    mass_error(&scene.shell, &displacements(state), &case.exact)
}

/// Where the full shell comes to rest from a state, beside it or by the way from rest: how far that is off, and its potential energy beside the
/// reference's. Empty where it finds no rest.
fn beside(scene: &Scene, state: &State, case: &Case) -> String {
    let mut full = match state.try_clone() {
        Ok(full) => full,
        Err(_) => return String::new(),
    };
    if full.set_method(Method::ImplicitShell).and_then(|()| full.equilibrium()).is_err() {
        return String::new();
    }
    let [own, reference] = [&displacements(&full), &case.exact].map(|u| case.potential(scene, u));
    format!(
        " [from there the full shell rests {:.4} off, energy {own:.6e}, reference {reference:.6e}]",
        off(scene, &full, case)
    )
}

/// A model without its stress fields: the membrane's own energy on the same fields and elements.
fn without_stress_fields(mut model: Model) -> Model {
    if let Some(of) = model.reduced.take().and_then(Arc::into_inner) {
        let fields = (model.modal.n_modes(), of.fields);
        let plain = ReducedShell::assemble(&model.shell, fields, of.samples, Assumed::none());
        model.reduced = Some(Arc::new(plain.unwrap()));
    }
    model
}

/// Of the loads that nothing was chosen by, the medians of the error over the paper's and of the error where the shell moves by a fifth
/// of its size, and how many loads are worse than the paper, those without an equilibrium among them.
fn verdict(scene: &Scene, cases: &[Case], paper: &[f64], model: &Arc<Model>, method: Method) -> String {
    let (mut ratios, mut fifth, mut lost) = (vec![], vec![], 0);
    for (case, paper) in cases.iter().zip(paper) {
        let found = loaded(scene, model, method, case).filter(|(_, found)| *found);
        let own = found.map_or(f64::INFINITY, |(state, _)| off(scene, &state, case));
        ratios.push(own / paper);
        lost += usize::from(own == f64::INFINITY);
        if case.aim == AT {
            fifth.push(own);
        }
    }
    let worse = ratios.iter().filter(|ratio| **ratio > SAME).count();
    let median = |list: &mut Vec<f64>| {
        list.sort_by(f64::total_cmp);
        list[list.len() / 2]
    };
    format!("{:.3}, {:.1} %, {worse} ({lost})", median(&mut ratios), 100.0 * median(&mut fifth))
}

/// Prints a row of the table for each scene: a column for each ingredient.
fn ablate(scene: &Scene, cases: Vec<Case>) {
    let counts = |case: &Case| case.part != Part::Validation && case.is_confirmed();
    let cases: Vec<Case> = cases.into_iter().filter(counts).collect();
    let every = usize::MAX;
    let precomputed = |fields: usize, elements: usize, poses: usize| {
        let reduced = reduced::Options { fields, elements, poses, ..Default::default() };
        let options = Options { modes: 8, reduced, ..Options::default() };
        Model::precompute(scene.shell.clone(), &options, &mut |_, _| Ok(())).unwrap()
    };
    let untrained = Arc::new(without_stress_fields(precomputed(36, every, 0)));
    let found = |case: &Case| loaded(scene, &untrained, Method::Warp, case).filter(|(_, found)| *found);
    // Loads under which the paper's method finds no equilibrium tell nothing of a ratio.
    let (cases, paper): (Vec<Case>, Vec<f64>) = cases
        .into_iter()
        .filter_map(|case| found(&case).map(|(s, _)| off(scene, &s, &case)).map(|e| (case, e)))
        .unzip();
    print!("| {} |", scene.key);
    for method in [Method::Warp, Method::VirtualWorkWarp, Method::RotationStrain, Method::ReducedShell] {
        print!(" {} |", verdict(scene, &cases, &paper, &untrained, method));
    }
    drop(untrained);
    let ladder: [&dyn Fn() -> Model; 4] = [
        &|| precomputed(36, every, 0),
        &|| without_stress_fields(precomputed(40, every, reduced::MAX_POSES)),
        &|| precomputed(40, every, reduced::MAX_POSES),
        &|| precomputed(40, 0, reduced::MAX_POSES),
    ];
    for make in ladder {
        print!(" {} |", verdict(scene, &cases, &paper, &Arc::new(make()), Method::ReducedShell));
    }
    println!();
}

/// A form of the reduced shell on a model, measured.
struct Contender {
    spec: String,
    method: Method,
    model: Arc<Model>,
}

/// What a contender's errors were on one part of a scene's loads.
#[derive(Default)]
struct Tally {
    /// Error, the paper's, and whether the load moves the shell by a fifth of its size.
    errors: Vec<(f64, f64, bool)>,
    /// Loads worse than the paper after `State::fall_back`.
    fallen: usize,
}

fn median(mut list: Vec<f64>) -> f64 {
    list.sort_by(f64::total_cmp);
    list.get(list.len() / 2).copied().unwrap_or(f64::NAN)
}

impl Tally {
    fn ratios(&self) -> Vec<f64> {
        self.errors.iter().map(|(own, paper, _)| own / paper).collect()
    }

    /// Cells of the table, as [`HEADER`] names them.
    fn cells(&self) -> String {
        let fifth =
            |of: fn(&(f64, f64, bool)) -> f64| 100.0 * median(self.errors.iter().filter(|e| e.2).map(of).collect());
        let worse = self.ratios().iter().filter(|ratio| **ratio > SAME).count();
        let lost = self.errors.iter().filter(|e| e.0 == f64::INFINITY).count();
        let (own, paper) = (fifth(|e| e.0), fifth(|e| e.1));
        format!(
            "{:.3} | {own:.2} | {paper:.1} | {worse} of {} | {lost} | {}",
            median(self.ratios()),
            self.errors.len(),
            self.fallen
        )
    }
}

/// The models of a scene by this list of fields, elements and poses, each in both forms of the reduced shell.
fn contenders(scene: &Scene, specs: &str) -> Vec<Contender> {
    let mut all = vec![];
    for spec in specs.split_whitespace() {
        let n: Vec<usize> = spec.split(',').map(|n| n.parse().unwrap()).collect();
        let reduced = reduced::Options { fields: n[0], elements: n[1], poses: n[2], ..Default::default() };
        let options = Options { modes: 8, reduced, may_be_full: true, ..Options::default() };
        let start = Instant::now();
        let model = Arc::new(Model::precompute(scene.shell.clone(), &options, &mut |_, _| Ok(())).unwrap());
        let reduced = model.reduced.as_ref().unwrap();
        println!(
            "  {spec}: {} fields, {} elements, fit {:.1e}, {:.1} s",
            reduced.n(),
            reduced.samples.len(),
            reduced.fit,
            start.elapsed().as_secs_f64()
        );
        if let Some(polynomial) = &reduced.polynomial {
            println!("  {:?}: {:?}", model.chosen_method(), polynomial.gate);
        }
        let mut forms = vec![Method::ReducedShell, Method::PolynomialShell];
        for chosen in [model.chosen_form(), model.chosen_method()] {
            if !forms.contains(&chosen) {
                forms.push(chosen);
            }
        }
        all.extend(forms.into_iter().map(|method| Contender { spec: spec.to_owned(), method, model: model.clone() }));
    }
    all
}

/// Measures all contenders under one load, and prints a line.
fn measure(scene: &Scene, contenders: &[Contender], (tallies, pool): (&mut [Tally], &mut Pool), case: &Case) {
    let of = |model: &Arc<Model>, method: Method| loaded(scene, model, method, case);
    let error = |found: &Option<(State, bool)>| match found {
        Some((state, true)) => off(scene, state, case),
        _ => f64::INFINITY,
    };
    let paper = error(&of(&contenders[0].model, Method::Warp));
    let mark = if case.is_confirmed() { "" } else { "unconfirmed " };
    print!("{mark}{:<22} {:.2} {:.3}: paper {paper:.3} |", case.name, case.aim, case.moved);
    for (contender, tally) in contenders.iter().zip(tallies) {
        let found = of(&contender.model, contender.method);
        let own = error(&found);
        if case.is_confirmed() {
            tally.errors.push((own, paper, case.aim == AT));
        }
        print!(" {own:.4} ({:.4})", projection(&contender.model, &case.exact));
        let two = found.as_ref().filter(|(_, found)| *found).and_then(|(state, _)| corrected(scene, state, 2, case));
        let none = f64::INFINITY;
        let mut measured = Measured { own, paper, after: none, certified: none, two: two.unwrap_or(none) };
        let Some((mut state, _)) = found else {
            pool.add(scene, contender, case, measured);
            continue;
        };
        let estimate = state.fall_back();
        let (stays, after) = (state.method() == contender.method, off(scene, &state, case));
        measured.after = after;
        measured.certified = match &estimate {
            Ok(found) if found.remaining <= BALANCED => found.error,
            _ => f64::INFINITY,
        };
        pool.add(scene, contender, case, measured);
        tally.fallen += usize::from(after > SAME * paper && case.is_confirmed());
        let (estimate, remaining) = estimate.map_or((f64::NAN, f64::NAN), |c| (c.error, c.remaining));
        print!(" [{} {after:.4}, estimate {estimate:.4}, left {remaining:.0e}]", if stays { "stays" } else { "falls" });
        if case.is_confirmed() && after > SAME * paper {
            print!("{}", beside(scene, &state, case));
        }
    }
    println!();
}

/// Measures all contenders on a scene, and adds their rows to the table and to what is counted over all scenes.
fn contest(scene: &Scene, cases: &[Case], specs: &str, (table, pool): (&mut String, &mut Pool)) {
    let contenders = contenders(scene, specs);
    for (part, name) in [(Part::Validation, "validation"), (Part::HeldOut, "held out"), (Part::Fresh, "fresh")] {
        let mut tallies: Vec<Tally> = contenders.iter().map(|_| Tally::default()).collect();
        for case in cases.iter().filter(|case| case.part == part) {
            measure(scene, &contenders, (&mut tallies, pool), case);
        }
        for (contender, tally) in contenders.iter().zip(&tallies) {
            let fields = contender.model.reduced.as_ref().map_or(0, |reduced| reduced.n());
            let form = format!("{:?}", contender.method);
            let row =
                format!("| {} | {} ({fields}) | {form} | {name} | {} |", scene.key, contender.spec, tally.cells());
            println!("{row}");
            table.push_str(&row);
            table.push('\n');
        }
    }
}

const HEADER: &str = "| shell | asked for (coordinates) | form | loads | error over the paper's, median | at a fifth of the size, % | the paper's there, % \
| worse than the paper | not found | worse after falling back |\n|---|---|---|---|---|---|---|---|---|---|\n";

/// Of what the gate took on the judging list: the error, that after falling back, the paper's, and whether the load is aimed at a fifth of the
/// size and moves the shell by that.
#[derive(Default)]
struct Verdict(Vec<(f64, f64, f64, [bool; 2])>);

impl Verdict {
    /// Cells of the table, as [`JUDGED`] names them.
    fn cells(&self) -> String {
        let Self(all) = self;
        let ratios: Vec<f64> = all.iter().map(|(own, _, paper, _)| own / paper).collect();
        let of = |kind: usize| all.iter().filter(move |e| e.3[kind]);
        let own: Vec<f64> = of(0).map(|e| e.0).collect();
        let paper = of(0).map(|e| e.2).collect();
        let good = |kind: usize| format!("{} of {}", of(kind).filter(|e| e.0 <= NEARLY).count(), of(kind).count());
        let worse = ratios.iter().filter(|ratio| **ratio > SAME).count();
        let after = all.iter().filter(|(_, after, paper, _)| *after > SAME * paper).count();
        let lost = all.iter().filter(|e| e.0 == f64::INFINITY).count();
        let (fifth, paper) = (100.0 * median(own), 100.0 * median(paper));
        format!(
            "{:.3} | {fifth:.2} | {paper:.1} | {} | {} | {worse} of {} | {lost} | {after}",
            median(ratios),
            good(0),
            good(1),
            all.len()
        )
    }
}

/// Of loads that move a shell by a fifth of its size, what its fields could do at best, what it does, and what is left after steps of the full shell.
#[derive(Default)]
struct Reach {
    ratios: Vec<f64>,
    at_a_fifth: [Vec<f64>; 2 + CORRECTED.len()],
}

/// Newton steps of the full shell from where the load has led it, one after another.
const CORRECTED: [usize; 3] = [1, 2, 4];

impl Reach {
    fn add(
        &mut self,
        scene: &Scene,
        contender: &Contender,
        case: &Case,
        before: f64,
        paper: f64,
        found: Option<State>,
    ) {
        self.ratios.push(before / paper);
        if case.aim != AT {
            return;
        }
        let after = |steps: usize| found.as_ref().and_then(|state| corrected(scene, state, steps, case));
        let steps = CORRECTED.map(|steps| after(steps).unwrap_or(f64::INFINITY));
        let all = [projection(&contender.model, &case.exact), before].into_iter().chain(steps);
        self.at_a_fifth.iter_mut().zip(all).for_each(|(list, error)| list.push(error));
    }

    fn extend(&mut self, other: &Self) {
        self.ratios.extend(&other.ratios);
        self.at_a_fifth.iter_mut().zip(&other.at_a_fifth).for_each(|(list, of)| list.extend(of));
    }

    /// Cells of the table, as [`REACHED`] names them: medians in %, and how many are at most 5 % off.
    fn cells(&self) -> String {
        let good = |list: &[f64]| list.iter().filter(|error| **error <= NEARLY).count();
        let each = |list: &Vec<f64>| format!("{:.2}, {} of {}", 100.0 * median(list.clone()), good(list), list.len());
        format!("{:.3} | {}", median(self.ratios.clone()), self.at_a_fifth.each_ref().map(each).join(" | "))
    }
}

const REACHED: &str = "| shell | fields | error over the paper's, median | best of its fields | the shell | after one step | two | four |\n\
|---|---|---|---|---|---|---|---|\n";

/// Fields that the judging list is measured by; its claims are about the first number.
const JUDGED_FIELDS: [usize; 3] = [20, 40, 100];

/// One shell of the judging list, added to the verdict on all.
fn judged(scene: &Scene, fields: usize, all: &mut Verdict, reach: &mut Reach) -> [String; 2] {
    let contenders = contenders(scene, &format!("{fields},0,62"));
    let model = &contenders[0].model;
    let method = model.chosen_method();
    let (mut own, mut reached) = (Verdict::default(), Reach::default());
    for case in cases::find(scene).iter().filter(|case| case.is_confirmed()) {
        let error = |found: &Option<(State, bool)>| match found {
            Some((state, true)) => off(scene, state, case),
            _ => f64::INFINITY,
        };
        let paper = error(&loaded(scene, model, Method::Warp, case));
        let found = loaded(scene, model, method, case);
        let before = error(&found);
        let state = found.as_ref().filter(|(_, found)| *found).and_then(|(state, _)| state.try_clone().ok());
        reached.add(scene, &contenders[0], case, before, paper, state);
        let fallen = found.map(|(mut state, _)| {
            state.fall_back().ok();
            state
        });
        let after = fallen.as_ref().map_or(f64::INFINITY, |state| off(scene, state, case));
        let Case { name, aim, moved, .. } = case;
        print!("  {name:<20} {aim:.2} {moved:.3}: {before:.4}, after falling back {after:.4}, paper {paper:.4}");
        let worse = fallen.as_ref().filter(|_| after > SAME * paper);
        println!("{}", worse.map_or_else(String::new, |state| beside(scene, state, case)));
        own.0.push((before, after, paper, [case.aim == AT, case.aim == AT && case.came_near()]));
    }
    all.0.extend(&own.0);
    reach.extend(&reached);
    [
        format!("| {} | {method:?} | {} |\n", scene.key, own.cells()),
        format!("| {} | {fields} | {} |\n", scene.key, reached.cells()),
    ]
}

const JUDGED: &str = "| shell | form | error over the paper's, median | at a fifth of the size, % | the paper's there, % | at most 5 % there \
| of what came there | worse than the paper | not found | worse after falling back |\n|---|---|---|---|---|---|---|---|---|---|\n";

/// The claims, and what stands between them and the shells.
fn judge() -> [String; 2] {
    let (mut claims, mut reached) = (String::from(JUDGED), String::from(REACHED));
    for fields in JUDGED_FIELDS {
        let (mut all, mut reach) = (Verdict::default(), Reach::default());
        for scene in judging::all() {
            println!("{} ({}): {} vertices", scene.key, scene.text, scene.shell.mass.len());
            let rows = judged(&scene, fields, &mut all, &mut reach);
            print!("{}{}", rows[0], rows[1]);
            if fields == JUDGED_FIELDS[0] {
                claims.push_str(&rows[0]);
            }
            reached.push_str(&rows[1]);
        }
        if fields == JUDGED_FIELDS[0] {
            claims += &format!("| all | | {} |\n", all.cells());
        }
        reached += &format!("| all | {fields} | {} |\n", reach.cells());
    }
    print!("{claims}\n{reached}");
    [claims, reached]
}

/// What a step a frame makes of the loads at a fifth, of all scenes or one.
fn follow(key: Option<&String>, docs: Option<&String>) {
    let mut table = followed::HEADER.to_owned();
    for scene in scenes::all().iter().filter(|scene| key.is_none_or(|key| key == scene.key)) {
        for fields in [20, 40] {
            let row = followed::row(scene, fields);
            print!("{row}");
            table += &row;
        }
    }
    if let Some(file) = docs {
        docs::put_section(file, "front followed", &table).unwrap();
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let value = |key: &str| arguments.iter().position(|a| a == key).and_then(|i| arguments.get(i + 1));
    if arguments.iter().any(|a| a == "--judge") {
        let [claims, reached] = judge();
        if let Some(file) = value("--docs") {
            docs::put_section(file, "judging", &claims).unwrap();
            docs::put_section(file, "judging reach", &reached).unwrap();
        }
        return;
    }
    let (mut table, mut pool) = (String::from(HEADER), Pool::default());
    if arguments.iter().any(|a| a == "--gates") {
        let asked = |scene: &Scene| value("--scene").is_none_or(|key| key == scene.key);
        for scene in scenes::all().into_iter().chain(judging::all()).filter(asked) {
            println!("{}", scene.key);
            contenders(&scene, value("--reduced").map_or(SPECS, |specs| specs));
        }
        return;
    }
    if arguments.iter().any(|a| a == "--times") {
        return times::table(value("--scene"), value("--docs"));
    }
    if arguments.iter().any(|a| a == "--follow") {
        return follow(value("--scene"), value("--docs"));
    }
    for scene in scenes::all() {
        if value("--scene").is_some_and(|key| key != scene.key) {
            continue;
        }
        let start = Instant::now();
        let cases = cases::find(&scene);
        if arguments.iter().any(|a| a == "--ablate") {
            ablate(&scene, cases);
            continue;
        }
        println!(
            "{} ({}): {} vertices, {} cases in {:.1} s",
            scene.key,
            scene.text,
            scene.shell.mass.len(),
            cases.len(),
            start.elapsed().as_secs_f64()
        );
        let specs = value("--reduced").map_or(SPECS, |specs| specs);
        contest(&scene, &cases, specs, (&mut table, &mut pool));
    }
    let pooled = pool.table();
    print!("{pooled}");
    if let Some(file) = value("--docs") {
        docs::put_section(file, "front", &table).unwrap();
        docs::put_section(file, "front pooled", &pooled).unwrap();
    }
}
