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
    /// Equilibria that were tried; with none there is nothing to go by.
    pub tried: u32,
    /// Of the polynomial.
    pub polynomial: Errors,
    /// Of the sampled energy.
    pub sampled: Errors,
    /// The largest |q| of the equilibria.
    pub reach: f64,
    /// And their largest membrane energy by the polynomial, as its root.
    pub strain: f64,
}

/// The polynomial is taken where it misses at most this multiple of what the sampled energy does: its step is many times faster.
const WORTH: f64 = 1.25;

impl Gate {
    /// Whether the polynomial is as good as the sampled energy where it was trained.
    pub fn holds(&self) -> bool {
        let near = |own: f64, other: f64| own <= WORTH * other;
        let Self { polynomial, sampled, .. } = self;
        self.tried > 0 && near(polynomial.median, sampled.median) && near(polynomial.most, sampled.most)
    }
}
