//! Smooth functions over a shell's vertices that sum to 1, each largest at a centre of its own.

use crate::error::try_zeroed;
use crate::{Error, Result, Shell};

/// Vertices that move, for each patch.
const VERTICES: usize = 6;
/// Fewest and most.
const FEWEST: usize = 4;
const MOST: usize = 40;
/// The functions' width, of the distance from any vertex to a centre.
const WIDTH: f64 = 0.7;
/// A smaller value is none.
const SMALL: f64 = 1e-3;

/// Values above zero by vertex, ascending in the patch.
pub struct Patches {
    at: Vec<Vec<(u32, f64)>>,
    n: usize,
}

impl Patches {
    /// Over the vertices that move.
    pub fn new(shell: &Shell) -> Result<Self> {
        let (x, free) = (&shell.mesh.positions, &shell.free);
        let wanted = (free.len() / VERTICES).clamp(FEWEST, MOST).min(free.len());
        let Some(first) = free.first() else { return Err(Error::argument("no vertex moves")) };
        let mut away: Vec<f64> = free.iter().map(|v| (x[*v as usize] - x[*first as usize]).norm()).collect();
        let mut centres = vec![*first];
        // The first of the furthest.
        let furthest = |away: &[f64]| (0..away.len()).rev().max_by(|i, j| away[*i].total_cmp(&away[*j]));
        while let Some(next) = furthest(&away).filter(|i| away[*i] > 0.0 && centres.len() < wanted) {
            let centre = free[next];
            centres.push(centre);
            for (away, v) in away.iter_mut().zip(free) {
                *away = away.min((x[*v as usize] - x[centre as usize]).norm());
            }
        }
        let cover = away.iter().copied().fold(0.0, f64::max);
        let width = if cover > 0.0 { WIDTH * cover } else { shell.mesh.size };
        let mut at: Vec<Vec<(u32, f64)>> = try_zeroed("the patches", x.len())?;
        for (v, at) in at.iter_mut().enumerate() {
            let distances = centres.iter().map(|c| (x[v] - x[*c as usize]).norm_squared());
            let nearest = distances.clone().fold(f64::INFINITY, f64::min);
            let value = |squared: f64| libm::exp((nearest - squared) / (2.0 * width * width));
            let values = (0..).zip(distances).map(|(i, squared)| (i, value(squared))).filter(|(_, phi)| *phi > SMALL);
            *at = values.collect();
            let sum: f64 = at.iter().map(|(_, phi)| phi).sum();
            at.iter_mut().for_each(|(_, phi)| *phi /= sum);
        }
        Ok(Self { at, n: centres.len() })
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.n
    }

    /// The values at a vertex.
    pub fn at(&self, v: usize) -> &[(u32, f64)] {
        &self.at[v]
    }

    /// The mean over vertices of Σ φ_i values_i.
    pub fn on(&self, vertices: &[u32], values: &[f64]) -> f64 {
        let at = |v: &u32| self.at(*v as usize).iter().map(|(i, phi)| phi * values[*i as usize]).sum::<f64>();
        vertices.iter().map(at).sum::<f64>() / vertices.len() as f64
    }
}
