//! The section "REDU" of a saved model ([`crate::model::file`]): f fields and s sampled elements, p of them of the membrane, of a shell of n
//! vertices and m modes, with t stress fields.
//!
//! | what | type |
//! |---|---|
//! | f, the modes included; t | 2 × u16 |
//! | s | u32 |
//! | what the samples leave of the forces | f64 |
//! | sampled elements, ascending by rest row | s × u32 |
//! | their weights | s × f64 |
//! | D, by column: zeros except in files older than stress fields | m² × f64 |
//! | S at the membrane's samples, by sample | pt × f64 |
//! | B√M by vertex, then field | 3nf × f64, or f32 unless the basis is of f64 |
//! | α, unless it is 0.003 or t is 0 | f64 |

use super::{AnyFields, Assumed, Fields, LEAST_SHARE, MAX_FIELDS, MAX_STRESSES, ReducedShell, with_fields};
use crate::error::invalid;
use crate::features::Feature;
use crate::precision::Precision;
use crate::real::Real;
use crate::{Result, Shell};
use nalgebra::DMatrix;

/// BᵀMB of a field may differ from 1 by this: f32 leaves 1e-7.
const NORM_ERROR: f64 = 1e-4;
const FRONT: usize = 16;

/// Bytes of a section whose membrane's samples have `stresses` numbers.
fn size([vertices, modes, fields, samples, stresses]: [usize; 5], precision: Precision) -> u128 {
    let [n, m, f, s, stresses] = [vertices, modes, fields, samples, stresses].map(|count| count as u128);
    let number = if precision == Precision::F64 { 8 } else { 4 };
    FRONT as u128 + 12 * s + 8 * m * m + 8 * stresses + 3 * n * f * number
}

impl ReducedShell {
    /// Size of [`ReducedShell::save`].
    pub fn saved_size(&self, n_vertices: usize) -> usize {
        let precision = match self.fields {
            AnyFields::F32(_) => Precision::F32,
            AnyFields::F64(_) => Precision::F64,
        };
        let counts = [n_vertices, self.modes, self.n(), self.samples.len(), self.assumed.stresses.len()];
        size(counts, precision) as usize + if self.saves_share() { 8 } else { 0 }
    }

    fn saves_share(&self) -> bool {
        self.assumed.stresses.nrows() > 0 && self.assumed.membrane_share != LEAST_SHARE
    }

    /// Appends the content of the section.
    pub fn save(&self, n_vertices: usize, out: &mut Vec<u8>) {
        [self.n(), self.assumed.stresses.nrows()].iter().for_each(|count| out.extend((*count as u16).to_le_bytes()));
        out.extend((self.samples.len() as u32).to_le_bytes());
        self.fit.put(out);
        self.samples.iter().for_each(|(element, _)| out.extend(element.to_le_bytes()));
        self.samples.iter().for_each(|(_, weight)| weight.put(out));
        match self.energy.correction() {
            Some(correction) => correction.iter().for_each(|x| x.put(out)),
            None => (0..self.modes * self.modes).for_each(|_| 0f64.put(out)),
        }
        self.assumed.stresses.iter().for_each(|x| x.put(out));
        with_fields!(&self.fields, fields => {
            for v in 0..n_vertices {
                (0..fields.n).for_each(|k| fields.stored(k, v).iter().for_each(|x| x.put(out)));
            }
        });
        if self.saves_share() {
            self.assumed.membrane_share.put(out);
        }
    }

    /// What [`ReducedShell::save`] wrote, for a shell whose basis has `modes` in `precision`. Samples are elements with positive weights,
    /// D is symmetric, and fields are normed and move nothing that is held.
    pub fn load(shell: &Shell, modes: usize, precision: Precision, content: &[u8]) -> Result<Self> {
        let parts = Parts::of(shell, modes, precision, content)?;
        let numbers = |bytes: &[u8]| bytes.chunks_exact(8).map(f64::get).collect::<Vec<_>>();
        let (elements, weights, fit) = (&parts.elements, numbers(parts.weights), parts.fit);
        let ascend = elements.windows(2).all(|pair| pair[0] < pair[1]);
        if !ascend || elements.last().is_some_and(|&e| e as usize >= shell.energy.n_elements()) {
            return invalid("its sampled elements do not ascend, or are none of its shell's");
        }
        if !(weights.iter().all(|w| w.is_finite() && *w > 0.0) && fit.is_finite() && fit >= 0.0) {
            return invalid("a weight of its samples is not positive");
        }
        let correction = DMatrix::from_vec(modes, modes, numbers(parts.correction));
        if !correction.iter().all(|x| x.is_finite()) || correction != correction.transpose() {
            return invalid("the correction of its rest stiffness is not symmetric");
        }
        let assumed = parts.stresses()?;
        let fields = match precision {
            Precision::F64 if Feature::F64Basis.is_built_in() => {
                AnyFields::F64(load_fields(shell, parts.n, parts.fields)?)
            }
            _ => AnyFields::F32(load_fields(shell, parts.n, parts.fields)?),
        };
        let samples = parts.elements.into_iter().zip(weights).collect();
        let mut reduced = Self { fit, ..Self::assemble(shell, (modes, fields), samples, assumed)? };
        if shell.energy.yielding().is_some_and(|own| own.rest_angles().len() != reduced.energy.n_yielding()) {
            return invalid("its samples lack a crease that yields");
        }
        if correction.iter().any(|x| *x != 0.0) {
            reduced.energy.set_correction(correction);
        }
        reduced.set_output(shell, precision)?;
        Ok(reduced)
    }
}

/// Where a section has what, by its sizes alone.
struct Parts<'a> {
    /// f, t.
    n: usize,
    n_stresses: usize,
    fit: f64,
    elements: Vec<u32>,
    /// How many of them are the membrane's.
    membrane: usize,
    weights: &'a [u8],
    correction: &'a [u8],
    stresses: &'a [u8],
    fields: &'a [u8],
    /// α, or nothing.
    share: &'a [u8],
}

impl<'a> Parts<'a> {
    /// Fails unless the sizes agree.
    fn of(shell: &Shell, modes: usize, precision: Precision, content: &'a [u8]) -> Result<Self> {
        let Some((front, rest)) = content.split_at_checked(FRONT) else {
            return invalid(format!("{} bytes are not a reduced shell", content.len()));
        };
        let count = |at: usize| u32::from_le_bytes(front[at..at + 4].try_into().expect("four bytes")) as usize;
        let (n, t) = (count(0) & 0xffff, count(0) >> 16);
        let (samples, fit) = (count(4), f64::get(&front[8..]));
        if n < modes || n > MAX_FIELDS || t > MAX_STRESSES {
            return invalid(format!("a reduced shell of {n} fields, {t} stresses and {modes} modes is out of range"));
        }
        let with_share = if t > 0 { 8 } else { 0 };
        let misfit = |stresses: usize| {
            let expected = size([shell.mass.len(), modes, n, samples, stresses], precision);
            let sizes = format!("{n} fields and {samples} elements: {expected}");
            let message = format!("{} bytes are not those of a reduced shell of {sizes}", content.len());
            (![expected, expected + with_share].contains(&(content.len() as u128))).then_some(message)
        };
        let Some((elements, rest)) = rest.split_at_checked(4 * samples) else {
            return invalid(misfit(0).unwrap_or_default());
        };
        let index = |row: &[u8]| u32::from_le_bytes(row.try_into().expect("four bytes"));
        let elements: Vec<u32> = elements.chunks_exact(4).map(index).collect();
        let membrane = elements.iter().filter(|e| (**e as usize) < shell.energy.n_membrane()).count();
        if let Some(message) = misfit(t * membrane) {
            return invalid(message);
        }
        let (weights, rest) = rest.split_at(8 * samples);
        let (correction, rest) = rest.split_at(8 * modes * modes);
        let (stresses, rest) = rest.split_at(8 * t * membrane);
        let expected = size([shell.mass.len(), modes, n, samples, t * membrane], precision) as usize;
        let (fields, share) = rest.split_at(rest.len() - (content.len() - expected));
        Ok(Self { n, n_stresses: t, fit, elements, membrane, weights, correction, stresses, fields, share })
    }

    /// S and α.
    fn stresses(&self) -> Result<Assumed> {
        let membrane_share = if self.share.is_empty() { LEAST_SHARE } else { f64::get(self.share) };
        let numbers = self.stresses.chunks_exact(8).map(f64::get).collect();
        let stresses = DMatrix::from_vec(self.n_stresses, self.membrane, numbers);
        // Columns of an orthonormal matrix, at most.
        if !stresses.iter().all(|x| x.abs() <= 1.0 + NORM_ERROR) {
            return invalid("a stress field of its membrane is not normed");
        }
        if !(membrane_share > 0.0 && membrane_share < 1.0) {
            return invalid(format!(
                "the membrane's own share is {membrane_share:?}: it is more than 0 and less than 1"
            ));
        }
        Ok(if self.n_stresses > 0 { Assumed { stresses, membrane_share } } else { Assumed::none() })
    }
}

fn load_fields<T: Real>(shell: &Shell, n: usize, bytes: &[u8]) -> Result<Fields<T>> {
    let mut fields = Fields::<T>::new(&shell.mesh.positions, n, shell.total_mass)?;
    let mut norms = vec![0.0; n];
    for (i, row) in bytes.chunks_exact(3 * T::BYTES).enumerate() {
        let (v, k) = (i / n, i % n);
        let stored: [T; 3] = std::array::from_fn(|c| T::get(&row[c * T::BYTES..(c + 1) * T::BYTES]));
        let square: f64 = stored.iter().map(|x| x.to_f64() * x.to_f64()).sum();
        let moves = shell.mass[v] > 0.0 && !shell.held[v];
        if !square.is_finite() || !(moves || square == 0.0) {
            return invalid(format!("field {k} is not finite at vertex {v}, or moves it though it is held"));
        }
        norms[k] += shell.mass[v] / shell.total_mass * square;
        fields.set_stored(k, v, stored);
    }
    match norms.iter().position(|norm| (norm - 1.0).abs() > NORM_ERROR) {
        Some(k) => invalid(format!("field {k} of its reduced shell has the norm {:e}", norms[k])),
        None => Ok(fields),
    }
}
