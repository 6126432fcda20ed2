//! The front of a saved model: which version and kind it is, and how large.

use super::sections;
use super::u64_of;
use crate::Model;
use crate::Result;
use crate::energy::{DISCRETE_SHELLS, KOITER};
use crate::error::invalid;
use crate::limits::MAX_MODES;
use crate::material::Elasticity;
use crate::precision::Precision;

const MAGIC: [u8; 4] = *b"SWMD";
const PLAIN: u32 = 1;
const WITH_SECTIONS: u32 = 2;
const BYTE_ORDER: u32 = 0x0102_0304;
pub(super) const HEADER: usize = 40;
/// Bytes that tell the size of the whole: the header and, with sections, their size.
pub const FRONT: usize = HEADER + 8;
/// In the word of the precision.
const WITHOUT_TURNS: u32 = 0x100;
const FACTS: usize = 8 * (3 + 7 + SECONDS);
/// Room for seconds, of the phases that there were first.
pub const SECONDS: usize = 6;

/// Sizes and kinds at the front.
#[derive(Clone, Copy)]
pub(super) struct Header {
    pub(super) precision: Precision,
    /// Without Ψ.
    pub(super) linear: bool,
    /// Number of the energy.
    pub(super) energy: u32,
    pub(super) vertices: u32,
    pub(super) triangles: u32,
    /// Support fields are among them, at the end.
    pub(super) modes: u32,
    pub(super) zero_modes: u32,
    pub(super) reoriented: u32,
    /// Bytes of all sections.
    pub(super) sections: u64,
}

impl Header {
    pub(super) fn of(model: &Model) -> Self {
        let mesh = &model.shell.mesh;
        Self {
            precision: model.modal.precision(),
            linear: model.modal.is_linear(),
            energy: match model.shell.material {
                Elasticity::DiscreteShells(_) => DISCRETE_SHELLS,
                Elasticity::Koiter(_) => KOITER,
            },
            vertices: mesh.positions.len() as u32,
            triangles: mesh.triangles.len() as u32,
            modes: model.modal.n_amplitudes() as u32,
            zero_modes: model.modal.zero_modes as u32,
            reoriented: mesh.n_reoriented as u32,
            sections: sections::bytes(model),
        }
    }

    pub(super) fn words(&self) -> [u32; HEADER / 4] {
        let Self { precision, linear, energy, vertices, triangles, modes, zero_modes, reoriented, .. } = *self;
        let magic = u32::from_le_bytes(MAGIC);
        let precision = precision.number_bytes() as u32 | if linear { WITHOUT_TURNS } else { 0 };
        let version = if self.sections > 0 { WITH_SECTIONS } else { PLAIN };
        [magic, version, BYTE_ORDER, precision, energy, vertices, triangles, modes, zero_modes, reoriented]
    }

    /// Reads and checks the first [`FRONT`] bytes.
    pub(super) fn read(bytes: &[u8]) -> Result<Self> {
        if bytes.len() < HEADER || bytes[..4] != MAGIC {
            return invalid(format!("these {} bytes are not a saved model", bytes.len()));
        }
        let word = |i: usize| u32::from_le_bytes(bytes[4 * i..4 * i + 4].try_into().expect("four bytes"));
        if word(2) != BYTE_ORDER {
            return invalid(format!("the saved model has the byte-order mark {:#010x}: foreign or damaged", word(2)));
        }
        let sections = match word(1) {
            PLAIN => 0,
            WITH_SECTIONS if bytes.len() >= FRONT => u64_of(&bytes[HEADER..FRONT]),
            WITH_SECTIONS => return invalid(format!("these {} bytes are not a saved model", bytes.len())),
            version => {
                let reads = format!("this library reads {PLAIN} and {WITH_SECTIONS}");
                return invalid(format!("the saved model has format version {version}; {reads}"));
            }
        };
        if word(1) == WITH_SECTIONS && sections == 0 {
            return invalid("the saved model has sections of 0 bytes");
        }
        let (bytes, linear) = (word(3) & !WITHOUT_TURNS, word(3) & WITHOUT_TURNS != 0);
        let precisions = [Precision::F32, Precision::F64, Precision::I16];
        let precision = precisions.into_iter().find(|p| p.number_bytes() == bytes as usize);
        let Some(precision) = precision else {
            return invalid(format!("the saved model has numbers of {} bytes", word(3)));
        };
        let energy = word(4);
        if ![DISCRETE_SHELLS, KOITER].contains(&energy) {
            return invalid(format!("the saved model has the energy {}, which this library does not know", word(4)));
        }
        let [vertices, triangles, modes, zero_modes, reoriented] = std::array::from_fn(|i| word(5 + i));
        if vertices == 0 || triangles == 0 || modes as usize > MAX_MODES || zero_modes > modes || reoriented > triangles
        {
            let counts = format!("{vertices} vertices, {triangles} triangles, {zero_modes} zero modes of {modes}");
            return invalid(format!("the saved model has {counts}: out of range"));
        }
        Ok(Self { precision, linear, energy, vertices, triangles, modes, zero_modes, reoriented, sections })
    }

    /// Bytes of the whole, exact whatever the counts are.
    pub(super) fn size(&self) -> u128 {
        let [n, t, m] = [self.vertices, self.triangles, self.modes].map(u128::from);
        let basis = if self.linear { 3 } else { 6 } * n * m * self.precision.number_bytes() as u128;
        let sections = u128::from(self.sections) + if self.sections > 0 { 8 } else { 0 };
        (HEADER + FACTS + 8) as u128 + 25 * n + 12 * t + 24 * m + basis + sections
    }
}

/// Size that a saved model says it has in its first [`FRONT`] bytes. Fails on anything else.
pub fn announced_size(header: &[u8]) -> Result<u128> {
    Ok(Header::read(header)?.size())
}
