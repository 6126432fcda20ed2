//! Support fields of a saved model.

use super::header::Header;
use super::{points, put_u64, u64_of};
use crate::error::invalid;
use crate::modal::ModalBasis;
use crate::modes::{SupportFields, groups, supported};
use crate::real::Real;
use crate::{Result, Shell};

/// Bytes of the section.
pub(super) fn size(fields: &SupportFields) -> usize {
    8 + 24 * fields.n() * fields.held.len() + 8 * (fields.coupling.len() + fields.stiffness.len())
}

/// Appends its content.
pub(super) fn put(fields: &SupportFields, out: &mut Vec<u8>) {
    put_u64(out, fields.n() as u64);
    fields.patterns.iter().flatten().flatten().for_each(|x| x.put(out));
    fields.coupling.iter().chain(&fields.stiffness).for_each(|x| x.put(out));
}

/// Eigenvalues of modes, and as many more for support fields, which have none.
pub(super) fn padded(modal: &ModalBasis) -> Vec<f64> {
    let mut eigenvalues = modal.eigenvalues.clone();
    eigenvalues.resize(modal.n_amplitudes(), modal.eigenvalues.last().copied().unwrap_or(0.0));
    eigenvalues
}

/// The fields, checked; where supports are, the shell says.
pub(super) fn restore(header: &Header, shell: &Shell, content: &[u8]) -> Result<SupportFields> {
    let held = supported(shell);
    let (m, h) = (header.modes as usize, held.len());
    if h == 0 {
        return invalid("it has support fields, but no supports");
    }
    let n = content.split_at_checked(8).map_or(u64::MAX, |(n, _)| u64_of(n));
    if n > (m - (header.zero_modes as usize).min(m)) as u64 {
        return invalid(format!("it has {n} support fields among {m} modes"));
    }
    let n = n as usize;
    let expected = 8 + 24 * n as u128 * h as u128 + 8 * (n as u128) * (m as u128);
    if content.len() as u128 != expected {
        return invalid(format!("{} bytes are not its {n} support fields of {h} supports", content.len()));
    }
    let (patterns, rest) = content[8..].split_at(24 * n * h);
    let patterns = points(patterns).chunks(h).map(<[_]>::to_vec).collect();
    let mut numbers = rest.chunks_exact(8).map(f64::get);
    let coupling = numbers.by_ref().take(n * (m - n)).collect();
    let fields = SupportFields {
        group: groups(shell, &held),
        held,
        patterns,
        coupling,
        stiffness: numbers.collect(),
        root_mass: shell.total_mass.sqrt(),
    };
    if fields.is_finite() { Ok(fields) } else { invalid("a support field is not finite") }
}
