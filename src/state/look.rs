//! Stiffness by look: the factor by which a shell swings as fast, or sags as far, as it is told.
//!
//! A sag goes with the inverse of the stiffness while it is small, and ever less when it is not: in logarithms of both a line of slope −1 that
//! flattens. The search takes secants there, between the last factor that was too soft and the last that was too stiff.

use super::stiffness::RANGE;
use super::{Space, State};
use crate::error::require_finite;
use crate::{Error, ErrorKind, Result, Vec3};

/// Equilibria at most: a secant takes three to six, halving from a shell that finds none ten more.
const TRIALS: usize = 30;
/// The most that a factor changes at once, as a logarithm.
const STRIDE: f64 = 4.0;
/// Of a logarithm of sags over one of factors: below this the shell hangs as far as it ever will, and a secant would go anywhere.
const FLAT: f64 = 0.2;
/// Factors that are tried where no equilibrium was found yet.
const MISSES: u32 = 8;
/// Of the mesh's size: a shell that moves less moves by rounding; and so many such factors are tried.
const UNMOVED: f64 = 1e-11;
const STILL: u32 = 4;
/// An edge that stretches by more of its length than this is no sheet's: the sag cannot be had by bending.
const STRETCH: f64 = 1.0;
/// What a clamped strip sags over gravity's acceleration by the square of its slowest radian frequency: 12.36/8.
const STRIP: f64 = 1.545;

/// A factor that was tried: its logarithm, and that of the sag over the one that is wanted.
#[derive(Clone, Copy)]
struct Tried {
    factor: f64,
    sag: f64,
}

/// What is known of the factor.
struct Search {
    first: f64,
    too_soft: f64,
    too_stiff: f64,
    last: Option<Tried>,
    /// Equilibria that were not found before the first that was.
    misses: u32,
}

impl Search {
    fn new(first: f64) -> Self {
        Self { first, too_soft: f64::NEG_INFINITY, too_stiff: f64::INFINITY, last: None, misses: 0 }
    }

    /// The next factor's logarithm.
    fn next(&mut self, now: Tried) -> f64 {
        let place = if now.sag > 0.0 { &mut self.too_soft } else { &mut self.too_stiff };
        *place = now.factor;
        let before = self.last.replace(now);
        let slope = before.map_or(-1.0, |before| (now.sag - before.sag) / (now.factor - before.factor));
        let slope = if slope < -FLAT { slope } else { -FLAT };
        let next = now.factor + (-now.sag / slope).clamp(-STRIDE, STRIDE);
        if next <= self.too_soft {
            return 0.5 * (self.too_soft + now.factor);
        }
        if next >= self.too_stiff { 0.5 * (self.too_stiff + now.factor) } else { next }
    }

    /// Where no equilibrium was found: nearer to the last that was, or to both sides of the first by turns, as loads may be too large for the search or,
    /// of a stiff sheet, no more than rounding.
    fn retreat(&mut self, factor: f64) -> f64 {
        if let Some(last) = self.last {
            let place = if factor < last.factor { &mut self.too_soft } else { &mut self.too_stiff };
            *place = factor;
            return 0.5 * (factor + last.factor);
        }
        self.misses += 1;
        let strides = f64::from(self.misses.div_ceil(2)) * STRIDE;
        self.first + if self.misses % 2 == 1 { strides } else { -strides }
    }
}

impl State {
    /// Sets the stiffness by which the slowest mode that swings has this frequency in Hz; returns the factor.
    pub fn set_frequency(&mut self, hertz: f64) -> Result<f64> {
        require_positive("hertz", hertz)?;
        let slowest = self.slowest().ok_or_else(|| {
            Error::argument("hertz: none of the modes swings, so that there is no frequency to set: hold some vertices, or ask for more modes")
        })?;
        let ratio = hertz / slowest;
        self.set_stiffness(ratio * ratio)?;
        Ok(ratio * ratio)
    }

    /// Sets the stiffness by which the vertex that moves furthest is so far from rest in the equilibrium under the present loads, to a relative
    /// tolerance, and moves there; returns the factor. Fails, changing nothing, where none is found, or only one by which an edge stretches to more than
    /// twice its length.
    pub fn set_sag(&mut self, length: f64, tolerance: f64) -> Result<f64> {
        require_positive("length", length)?;
        if !(tolerance > 0.0 && tolerance < 1.0) {
            return Err(Error::argument(format!("tolerance is {tolerance:?}: it must be above 0 and below 1")));
        }
        let before = self.try_clone()?;
        let found = self.find_sag(length, tolerance);
        if found.is_err() {
            *self = before;
        }
        found
    }

    /// Hz of the slowest mode that swings, by the stiffness that was precomputed.
    fn slowest(&self) -> Option<f64> {
        self.model.modal.frequencies().find(|hertz| *hertz > 0.0)
    }

    /// Where a strip of that frequency sags so far by its weight; without gravity the present stiffness.
    fn first_factor(&self, length: f64) -> f64 {
        let gravity = self.tempo.factor * self.gravity.norm();
        let guess =
            self.slowest().map_or(0.0, |hertz| STRIP * gravity / (std::f64::consts::TAU * hertz).powi(2) / length);
        let present = self.stiffness();
        if guess > 0.0 { guess.clamp(RANGE[0], RANGE[1]) } else { present }
    }

    /// The factor, unless the shell hangs so far by its edges' stretch.
    fn unless_stretched(&self, length: f64, factor: f64) -> Result<f64> {
        let mut x = vec![Vec3::zeros(); self.model.shell.mesh.positions.len()];
        self.positions(Space::Frame, |v, place| x[v] = place);
        let rest = self.model.shell.given();
        let span = |x: &[Vec3], [a, b]: [u32; 2]| (x[b as usize] - x[a as usize]).norm();
        let edges = self.model.shell.mesh.edges.iter().map(|edge| edge.vertices);
        let stretch = edges.map(|ends| span(&x, ends) / span(rest, ends) - 1.0).fold(0.0, f64::max);
        if stretch <= STRETCH {
            return Ok(factor);
        }
        Err(Error::argument(format!(
            "length: no stiffness was found by which the shell sags by {length:?} without stretching: an edge would be {:.2e} times its length, and the mesh is {:.3e} wide",
            1.0 + stretch,
            self.model.shell.mesh.size
        )))
    }

    fn find_sag(&mut self, length: f64, tolerance: f64) -> Result<f64> {
        let mut factor = libm::log(self.first_factor(length));
        let (mut search, mut sag, mut still) = (Search::new(factor), 0.0, 0);
        let [softest, stiffest] = RANGE.map(libm::log);
        let unmoved = UNMOVED * self.model.shell.mesh.size;
        for _ in 0..TRIALS {
            factor = factor.clamp(softest, stiffest);
            let taken = libm::exp(factor).clamp(RANGE[0], RANGE[1]);
            self.set_stiffness(taken)?;
            match self.equilibrium() {
                Ok(_) => sag = self.report().max_displacement,
                Err(error) if error.kind == ErrorKind::Numerical && search.misses < MISSES => {
                    factor = search.retreat(factor);
                    continue;
                }
                Err(error) => return Err(error),
            }
            if sag <= unmoved {
                still += 1;
                sag = unmoved;
            }
            if (sag / length - 1.0).abs() <= tolerance {
                return self.unless_stretched(length, taken);
            }
            let now = Tried { factor, sag: libm::log(sag / length) };
            let at_an_end = if now.sag > 0.0 { factor >= stiffest } else { factor <= softest };
            if at_an_end || still >= STILL {
                break;
            }
            factor = search.next(now);
        }
        if sag <= unmoved {
            return Err(Error::argument("length: nothing moves under the present loads: set gravity first"));
        }
        let last = self.stiffness();
        Err(Error::argument(format!(
            "length: no stiffness was found by which the shell sags by {length:?}; the factor {last:.3e} gives {sag:.4e}"
        )))
    }
}

fn require_positive(name: &str, value: f64) -> Result<()> {
    if require_finite(name, value)? > 0.0 {
        return Ok(());
    }
    Err(Error::argument(format!("{name} is {value:?}: it must be above 0")))
}
