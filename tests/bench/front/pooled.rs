//! Errors over all scenes' held-out and fresh loads: of each form, of the one that the gate takes, and of what `SW_METHOD_AUTO` takes where it may be the full shell.

use crate::cases::Case;
use crate::scenes::{Part, Scene};
use crate::{AT, Contender, NEARLY, SAME, median};
use shellwarp::state::Method;

/// Errors of a contender under a load, the paper's, that after `State::fall_back` and what its certificate says of it, and that after two Newton steps of
/// the full shell.
#[derive(Clone, Copy)]
pub struct Measured {
    pub own: f64,
    pub paper: f64,
    pub after: f64,
    /// Against the equilibrium of the full shell that is nearest to it; of a load with several it may be another than the reference.
    pub certified: f64,
    pub two: f64,
}

/// A form, the gate's choice of one, or the automatic choice.
#[derive(PartialEq)]
enum Row {
    Form(Method),
    Chosen,
    Auto,
}

struct Entry {
    scene: &'static str,
    measured: Measured,
    /// Whether it was aimed at a fifth of the size, and whether it came there.
    aimed: bool,
    hit: bool,
}

/// Entries by the row's fields, elements and poses, and form.
#[derive(Default)]
pub struct Pool {
    rows: Vec<(String, Row, Vec<Entry>)>,
    scenes: Vec<&'static str>,
    chosen: Vec<(String, &'static str, Method)>,
}

impl Pool {
    /// Of a load that nothing was chosen by and that has an answer.
    pub fn add(&mut self, scene: &Scene, contender: &Contender, case: &Case, measured: Measured) {
        if case.part == Part::Validation || !case.is_confirmed() {
            return;
        }
        if !self.scenes.contains(&scene.key) {
            self.scenes.push(scene.key);
        }
        let chosen = contender.model.chosen_form();
        let choice = (contender.spec.clone(), scene.key, chosen);
        if !self.chosen.contains(&choice) {
            self.chosen.push(choice);
        }
        let aimed = case.aim == AT;
        let hit = aimed && case.came_near();
        let mut put = |row: Row| {
            let at = self.rows.iter().position(|(spec, of, _)| *spec == contender.spec && *of == row);
            let at = at.unwrap_or_else(|| {
                self.rows.push((contender.spec.clone(), row, vec![]));
                self.rows.len() - 1
            });
            self.rows[at].2.push(Entry { scene: scene.key, measured, aimed, hit });
        };
        if matches!(contender.method, Method::PolynomialShell | Method::ReducedShell) {
            put(Row::Form(contender.method));
        }
        if contender.method == chosen {
            put(Row::Chosen);
        }
        if contender.method == contender.model.chosen_method() {
            put(Row::Auto);
        }
    }

    /// Medians and counts, and what the gate takes.
    pub fn table(&self) -> String {
        let names: Vec<String> = self.scenes.iter().map(|scene| scene.replace('_', " ")).collect();
        let mut table = format!(
            "| fields | form | error over the paper's, median | {} | all that came to a fifth | all aimed at a fifth | after two steps | worse than the paper after falling back | of these, within 5 % of another equilibrium |\n|---|---|---|{}---|---|---|---|---|\n",
            names.join(" | "),
            "---|".repeat(names.len())
        );
        for (spec, row, entries) in &self.rows {
            let fields = fields_of(spec);
            let form = match row {
                Row::Form(Method::PolynomialShell) => String::from("polynomial"),
                Row::Form(_) => String::from("samples"),
                Row::Chosen => String::from("the gate's"),
                Row::Auto => String::from("auto"),
            };
            let ratio = median(entries.iter().map(|e| e.measured.own / e.measured.paper).collect());
            let good = |list: &[&Entry], of: fn(&Measured) -> f64| {
                format!("{} of {}", list.iter().filter(|e| of(&e.measured) <= NEARLY).count(), list.len())
            };
            let hit: Vec<&Entry> = entries.iter().filter(|e| e.hit).collect();
            let aimed: Vec<&Entry> = entries.iter().filter(|e| e.aimed).collect();
            let each: Vec<String> = (self.scenes.iter())
                .map(|scene| good(&hit.iter().copied().filter(|e| e.scene == *scene).collect::<Vec<_>>(), |m| m.own))
                .collect();
            let worse = || entries.iter().filter(|e| e.measured.after > SAME * e.measured.paper);
            let elsewhere = worse().filter(|e| e.measured.certified <= NEARLY).count();
            table += &format!(
                "| {fields} | {form} | {ratio:.3} | {} | {} | {} | {} | {} of {} | {elsewhere} |\n",
                each.join(" | "),
                good(&hit, |m| m.own),
                good(&aimed, |m| m.own),
                good(&hit, |m| m.two),
                worse().count(),
                entries.len()
            );
        }
        table +=
            &format!("\n| fields | the gate takes for {} |\n|---|{}\n", names.join(" | "), "---|".repeat(names.len()));
        let mut specs: Vec<&str> = self.rows.iter().map(|(spec, ..)| spec.as_str()).collect();
        specs.dedup();
        for spec in specs {
            let of = |scene: &&str| {
                let chosen = self.chosen.iter().find(|(of, key, _)| of == spec && key == scene);
                chosen.map_or_else(String::new, |(_, _, method)| format!("{method:?}"))
            };
            let all: Vec<String> = self.scenes.iter().map(of).collect();
            table += &format!("| {} | {} |\n", fields_of(spec), all.join(" | "));
        }
        table
    }
}

fn fields_of(spec: &str) -> &str {
    spec.split(',').next().unwrap_or(spec)
}
