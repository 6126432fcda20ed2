//! The basis of a saved model.

use super::Reader;
use super::header::Header;
use crate::error::{invalid, try_zeroed};
use crate::features::Feature;
use crate::modal::AnyBasis;
use crate::precision::Precision;
use crate::warp::{Basis, Entry};
use crate::{Result, Shell};

/// Φᵀ M Φ of a mode may differ from 1 by this, f32 leaves 1e-7, and by what 16 bits leave of a large Φ, up to a bound.
const NORM_ERROR: f64 = 1e-4;
const LARGEST_NORM_ERROR: f64 = 0.1;
/// Ψ may exceed the largest rotation said by its own rounding: relative, and absolute among the subnormal f32.
const ROTATION_ERROR: (f64, f64) = (1e-6, 1e-44);

/// Appends Φ√M and Ψ√M.
pub(super) fn put<E: Entry>(basis: &Basis<E>, out: &mut Vec<u8>) {
    for v in 0..basis.n_vertices {
        (0..basis.modes).for_each(|k| basis.stored(k, v).iter().take(basis.shapes()).for_each(|x| x.append(out)));
    }
}

/// Φ and Ψ in the precision that the header says, which this build has.
pub(super) fn restore(
    (header, n_modes): (&Header, usize),
    shell: &Shell,
    modes: (&[f64], &[[f64; 2]]),
    from: &mut Reader,
) -> Result<AnyBasis> {
    let linear = header.linear;
    Ok(match header.precision {
        Precision::F32 => AnyBasis::F32(restore_basis(shell, modes, (linear, n_modes), from)?),
        Precision::F64 if Feature::F64Basis.is_built_in() => {
            AnyBasis::F64(restore_basis(shell, modes, (linear, n_modes), from)?)
        }
        Precision::I16 if Feature::I16Basis.is_built_in() => {
            AnyBasis::I16(restore_basis(shell, modes, (linear, n_modes), from)?)
        }
        _ => unreachable!("a header of another precision was refused"),
    })
}

/// Of the modes that were read.
#[derive(Clone, Copy, Default)]
struct Found {
    /// Φᵀ M Φ.
    norm: f64,
    /// Largest |Φ|² M.
    shape: f64,
    /// Largest |Ψ|² M.
    turn: f64,
}

/// Φ and Ψ: finite, of the first `n_modes` normed and zero where nothing moves, and turning no vertex by more than is said.
fn restore_basis<E: Entry>(
    shell: &Shell,
    (largest_rotation, units): (&[f64], &[[f64; 2]]),
    (linear, n_modes): (bool, usize),
    from: &mut Reader,
) -> Result<Basis<E>> {
    let (n, modes) = (shell.mass.len(), largest_rotation.len());
    let make = if linear { Basis::<E>::linear } else { Basis::<E>::new };
    let mut basis = make(&shell.mesh.positions, &shell.mass, modes, shell.total_mass)?;
    let row = basis.shapes() * E::BYTES;
    let bytes = from.take(n * modes * row);
    let mut found = try_zeroed::<Found>("the norms", modes)?;
    for v in (0..n).take_while(|_| modes > 0) {
        let entry = |bytes: &[u8]| bytes.split_at_checked(E::BYTES).map_or_else(E::default, |(own, _)| E::restore(own));
        let entries = |row: &[u8]| std::array::from_fn(|i| entry(row.get(i * E::BYTES..).unwrap_or_default()));
        let rows = bytes[v * modes * row..(v + 1) * modes * row].chunks_exact(row).map(entries);
        let share = shell.mass[v] / shell.total_mass;
        let (mut all, mut moved) = (0.0, 0.0);
        for (k, ((entries, found), units)) in rows.clone().zip(&mut found).zip(units).enumerate() {
            let square = |half: &[E], unit: f64| half.iter().map(|x| (x.decode() * unit).powi(2)).sum::<f64>();
            let (shape, turn) = (square(&entries[..3], units[0]), square(&entries[3..], units[1]));
            found.norm += share * shape;
            found.shape = found.shape.max(shape);
            found.turn = found.turn.max(turn);
            all += shape + turn;
            moved += if k < n_modes { shape } else { 0.0 };
        }
        if !all.is_finite() {
            return invalid(format!("a mode is not finite at vertex {v}"));
        }
        if moved != 0.0 && (shell.mass[v] <= 0.0 || shell.held[v]) {
            return invalid(format!("a mode moves vertex {v}, which is held"));
        }
        basis.set_stored(v, rows);
    }
    if !basis.is_finite() {
        return invalid("its positions leave the range of its precision"); // which the shapes do not
    }
    let (relative, absolute) = ROTATION_ERROR;
    let root_mass = shell.total_mass.sqrt();
    for (k, found) in found.iter().enumerate() {
        let largest_turn = largest_rotation[k] * root_mass;
        let turn_bound = largest_turn * (1.0 + relative + 2.0 * E::ROUNDING) + absolute;
        let rounding = (4.0 * E::ROUNDING * found.shape.sqrt()).min(LARGEST_NORM_ERROR);
        let normed = k >= n_modes || (found.norm - 1.0).abs() <= NORM_ERROR + rounding;
        if !(normed && found.turn.sqrt() <= turn_bound) {
            let facts = format!("norm {:e}, turns {:e} of {turn_bound:e}", found.norm, found.turn.sqrt());
            return invalid(format!("mode {k} is not normed, or turns further than is said: {facts}"));
        }
        basis.set_scale(k, units[k], largest_turn);
    }
    Ok(basis)
}
