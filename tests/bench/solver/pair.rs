//! Two searches for the same equilibria: by the energy alone, and with the stress as an unknown.

use crate::common::mass_error;
use nalgebra::Matrix3;
use shellwarp::constraint::Constraint;
use shellwarp::reference::{EquilibriumOptions, Solver};
use shellwarp::{Shell, Vec3};
use std::sync::Arc;
use std::time::Instant;

/// Ends further apart than this, relative, are not the same.
pub const APART: f64 = 1e-3;

/// What a row of a table counts, by the energy alone and with the stress as an unknown.
#[derive(Default)]
pub struct Tally {
    pub loads: usize,
    factorizations: [usize; 2],
    seconds: [f64; 2],
    found: [usize; 2],
    pub elsewhere: Vec<Elsewhere>,
}

/// Two ends that are not the same.
pub struct Elsewhere {
    pub load: String,
    pub apart: f64,
    /// The potential of each.
    pub potential: [f64; 2],
}

impl Tally {
    /// Cells of a table: factorizations, seconds, found, elsewhere, lower.
    pub fn cells(&self) -> String {
        let ([a, b], [s, t], [f, g]) = (self.factorizations, self.seconds, self.found);
        let lower = self.elsewhere.iter().filter(|e| e.potential[1] < e.potential[0]).count();
        format!("{} | {a} → {b} | {s:.1} → {t:.1} | {f} → {g} | {} | {lower}", self.loads, self.elsewhere.len())
    }

    pub fn add(&mut self, other: &Self) {
        self.loads += other.loads;
        for k in 0..2 {
            self.factorizations[k] += other.factorizations[k];
            self.seconds[k] += other.seconds[k];
            self.found[k] += other.found[k];
        }
        let copied = |e: &Elsewhere| Elsewhere { load: e.load.clone(), ..*e };
        self.elsewhere.extend(other.elsewhere.iter().map(copied));
    }
}

/// Heads the cells of [`Tally::cells`].
pub const HEAD: &str = "loads | factorizations | seconds | found | elsewhere | lower";

pub struct Pair {
    shell: Arc<Shell>,
    pub solvers: [Solver; 2],
    /// Where each has come to.
    ends: [Vec<Vec3>; 2],
}

impl Pair {
    pub fn new(shell: Arc<Shell>) -> Self {
        let solvers = [false, true].map(|mixed| {
            let mut solver = Solver::new(shell.clone()).unwrap();
            solver.set_mixed(mixed);
            solver
        });
        let rest = vec![Vec3::zeros(); shell.mass.len()];
        Self { shell, solvers, ends: [rest.clone(), rest] }
    }

    /// The searches that follow begin at rest.
    pub fn begin(&mut self) {
        self.ends.iter_mut().flatten().for_each(|u| *u = Vec3::zeros());
    }

    /// Goes from where each has come to on to a load; one that finds nothing stays where it is.
    pub fn search(&mut self, load: &str, forces: &[Vec3], constraints: &[Constraint], tally: &mut Tally) {
        tally.loads += 1;
        let mut found = [false; 2];
        for (k, (solver, end)) in self.solvers.iter_mut().zip(&mut self.ends).enumerate() {
            let (before, started) = (solver.factorizations(), Instant::now());
            solver.set_constraints(Matrix3::identity(), constraints.to_vec(), end).unwrap();
            if let Ok(there) = solver.equilibrium(end, forces, &EquilibriumOptions::default(), &mut |_| Ok(())) {
                *end = there.displacement;
                found[k] = true;
            }
            tally.seconds[k] += started.elapsed().as_secs_f64();
            tally.factorizations[k] += solver.factorizations() - before;
            tally.found[k] += usize::from(found[k]);
        }
        let apart = mass_error(&self.shell, &self.ends[1], &self.ends[0]);
        if found == [true; 2] && apart > APART {
            let work = |u: &[Vec3]| u.iter().zip(forces).map(|(u, f)| u.dot(f)).sum::<f64>();
            let potential = [0, 1].map(|k| self.solvers[0].elastic_energy(&self.ends[k]) - work(&self.ends[k]));
            tally.elsewhere.push(Elsewhere { load: load.to_owned(), apart, potential });
        }
    }
}
