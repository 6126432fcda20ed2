//! How near a polynomial energy is to the full shell, beside the sampled energy: by the equilibria that both were trained on.

/// Of all training equilibria, at most, that either energy misses when it is solved for them; relative, in the mass norm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Half of the errors are smaller.
    pub median: f64,
    /// Nine tenths are smaller.
    pub most: f64,
}

impl Errors {
    /// Of a list of them.
    pub fn of(mut list: Vec<f64>) -> Self {
        list.sort_by(f64::total_cmp);
        let at = |share: f64| list.get((share * list.len() as f64) as usize).copied().unwrap_or(0.0);
        Self { median: at(0.5), most: at(0.9) }
    }
}

/// See the module's text.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gate {
    /// Equilibria that were tried and are seen; with none there is nothing to go by.
    pub tried: u32,
    /// Of the polynomial.
    pub polynomial: Errors,
    /// Of the sampled energy.
    pub sampled: Errors,
    /// The largest |q| of the equilibria.
    pub reach: f64,
    /// And their largest membrane energy by the polynomial, as its root.
    pub strain: f64,
    /// The largest |q| up to which the polynomial is as good as the samples, by the equilibria up to there: the reach where it holds, 0 where
    /// it is so nowhere.
    pub range: f64,
    /// The relative error that it may have although samples have less. Not saved: it follows from the energy.
    pub unseen: f64,
}

/// The polynomial is taken where it misses at most this multiple of what the sampled energy does: its step is many times faster.
const WORTH: f64 = 1.25;
/// And where it misses no more than this, which nobody sees: samples may then miss less still, as they are fitted to these equilibria. Not where the
/// membrane carries the loads: the polynomial then misses more of loads that no training had, and samples do not.
pub const UNSEEN: f64 = 0.01;
/// What misses more of a shape ends at another one, and how far off that is tells little.
const LOST: f64 = 0.1;
/// And what misses more than this is on its way to no shape at all.
const ASTRAY: f64 = 2.0;

/// What moves the shell by less than this part of the furthest is not seen beside it: a flat sheet that is pulled along itself, which fields that bend it
/// miss by many times as much.
const SEEN: f64 = 1e-3;

/// Equilibria that a range rests on, at least; and the least range that is worth a change of form in motion, of the reach.
const LEAST: usize = 4;
const SOME: f64 = 0.25;

/// Whether the polynomial is as good as the sampled energy.
fn as_good(polynomial: &Errors, sampled: &Errors, unseen: f64) -> bool {
    let within = |polynomial: f64, sampled: f64| polynomial <= unseen.max(WORTH * sampled);
    within(polynomial.median, sampled.median.max(LOST))
        && within(polynomial.median.min(LOST), sampled.median)
        && within(polynomial.most.min(LOST), sampled.most)
        && polynomial.most <= ASTRAY
}

impl Gate {
    /// Whether the polynomial is as good as the sampled energy where it was trained.
    pub fn holds(&self) -> bool {
        self.tried > 0 && as_good(&self.polynomial, &self.sampled, self.unseen)
    }

    /// Whether it is so for a part of the training, of motions that are not too large.
    pub fn holds_in_part(&self) -> bool {
        !self.holds() && self.range >= SOME * self.reach && self.range > 0.0
    }

    /// From |q| of each equilibrium, and what the polynomial and the samples miss of it; and what is unseen.
    pub fn of(mut tried: Vec<[f64; 3]>, unseen: f64) -> Self {
        let reach = tried.iter().map(|one| one[0]).fold(0.0, f64::max);
        tried.retain(|one| one[0] >= SEEN * reach);
        tried.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let errors = |count: usize| [1, 2].map(|k| Errors::of(tried[..count].iter().map(|one| one[k]).collect()));
        let [polynomial, sampled] = errors(tried.len());
        let mut gate = Self { tried: tried.len() as u32, polynomial, sampled, reach, unseen, ..Self::default() };
        let is_good = |count: &usize| {
            let [polynomial, sampled] = errors(*count);
            as_good(&polynomial, &sampled, unseen)
        };
        let within = (LEAST..=tried.len()).rev().find(is_good).map_or(0.0, |count| tried[count - 1][0]);
        gate.range = if gate.holds() { reach } else { within };
        gate
    }
}
