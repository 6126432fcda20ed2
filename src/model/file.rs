//! The saved form of a model: everything that precompute found, so that loading needs no eigenvalue search.
//!
//! All little-endian, one after another without gaps:
//!
//! | what | type |
//! |---|---|
//! | magic "SWMD", version, byte-order mark, precision, energy, n vertices, t triangles, m modes, zero modes, re-oriented triangles | 10 × u32 |
//! | estimate of the peak memory, count and found of the certificate | 3 × u64 |
//! | k_A, k_L, k_B, density; residual, orthonormality, shift; seconds by phase | 13 × f64 |
//! | rest positions | 3n × f64 |
//! | triangles, oriented | 3t × u32 |
//! | held | n × u8, 0 or 1 |
//! | eigenvalues, largest rotation, largest swing of each mode | 3m × f64 |
//! | Φ√M and Ψ√M by vertex, then mode | 6nm × f32, f64 or i16; without Ψ 3nm |
//! | xxh3 of all before | u64 |
//!
//! The precision is the bytes of a number of the basis, plus 256 for a basis without Ψ. Version 1 is a model that needs no more. Version 2 has sections beside that: the bytes of all sections as one u64 after the
//! first row of the table, and the sections before the checksum, each a tag of four letters, a u32 of zero, the bytes of its
//! content as u64, and its content:
//!
//! | tag | content |
//! |---|---|
//! | "SAGS" | gravity, positions where the shell hangs under it: (3 + 3n) × f64; the modes are those of this shape |
//! | "UNIT" | what an entry of one stands for, in Φ√M and in Ψ√M, of each mode: 2m × f64; the basis is of i16, in 2⁻¹⁶ of these |
//! | "REDU" | the reduced shell: see `reduced/saved.rs` |
//! | "POLY" | its energy as a polynomial, if it has one: see `reduced/polynomial/saved.rs` |
//! | "AUTO" | the front of a chosen method: see `model/front.rs` |
//!
//! A section that this library does not know is an error: the model would mean something else without it.
//!
//! Edges, components, masses, energies and the fingerprint follow from these by the code that made them in the first place,
//! which checks the mesh again on the way. So whatever a file holds, a loaded model keeps every promise that the rest of the
//! library relies on, of memory and of finite results; that its modes are those of its shell is the writer's word.

use super::front::Front;
use crate::energy::DISCRETE_SHELLS;
use crate::error::{invalid, try_zeroed};
use crate::features::{self, Feature, Proof, SavedModels};
use crate::limits::MAX_MODES;
use crate::mesh::Mesh;
use crate::modal::{AnyBasis, ModalBasis, with_basis};
use crate::modes::{Certificate, PHASES};
use crate::precision::Precision;
use crate::real::Real;
use crate::reduced::ReducedShell;
use crate::reduced::polynomial::PolynomialEnergy;
use crate::warp::{Basis, Entry};
use crate::{Error, ErrorKind, Material, Model, Result, Shell, Supports, Vec3};
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_64;

const MAGIC: [u8; 4] = *b"SWMD";
const PLAIN: u32 = 1;
const WITH_SECTIONS: u32 = 2;
const BYTE_ORDER: u32 = 0x0102_0304;
const HEADER: usize = 40;
/// Bytes that tell the size of the whole: the header and, with sections, their size.
pub const FRONT: usize = HEADER + 8;
/// In the word of the precision.
const WITHOUT_TURNS: u32 = 0x100;
const FACTS: usize = 8 * (3 + 7 + PHASES);

/// Tag, zero and size before a section's content.
const SECTION_FRONT: usize = 16;
/// Where the shell hangs.
const SAG: Tag = *b"SAGS";
/// Units of a basis in 16 bits.
const UNITS: Tag = *b"UNIT";
/// The reduced shell.
const REDUCED: Tag = *b"REDU";
/// Its energy as a polynomial.
const POLYNOMIAL: Tag = *b"POLY";
/// What a choice of the method went by.
const FRONT_OF_CHOICE: Tag = *b"AUTO";

/// Φᵀ M Φ of a mode may differ from 1 by this, f32 leaves 1e-7, and by what 16 bits leave of a large Φ, up to a bound.
const NORM_ERROR: f64 = 1e-4;
const LARGEST_NORM_ERROR: f64 = 0.1;
/// Ψ may exceed the largest rotation said by its own rounding: relative, and absolute among the subnormal f32.
const ROTATION_ERROR: (f64, f64) = (1e-6, 1e-44);

type Tag = [u8; 4];

/// Sizes and kinds at the front.
#[derive(Clone, Copy)]
struct Header {
    precision: Precision,
    /// Without Ψ.
    linear: bool,
    vertices: u32,
    triangles: u32,
    modes: u32,
    zero_modes: u32,
    reoriented: u32,
    /// Bytes of all sections.
    sections: u64,
}

impl Header {
    fn of(model: &Model) -> Self {
        let mesh = &model.shell.mesh;
        Self {
            precision: model.modal.precision(),
            linear: model.modal.is_linear(),
            vertices: mesh.positions.len() as u32,
            triangles: mesh.triangles.len() as u32,
            modes: model.modal.n_modes() as u32,
            zero_modes: model.modal.zero_modes as u32,
            reoriented: mesh.n_reoriented as u32,
            sections: section_sizes(model).map(|(_, size)| (SECTION_FRONT + size) as u64).sum(),
        }
    }

    fn words(&self) -> [u32; HEADER / 4] {
        let Self { precision, linear, vertices, triangles, modes, zero_modes, reoriented, .. } = *self;
        let magic = u32::from_le_bytes(MAGIC);
        let precision = precision.number_bytes() as u32 | if linear { WITHOUT_TURNS } else { 0 };
        let version = if self.sections > 0 { WITH_SECTIONS } else { PLAIN };
        [magic, version, BYTE_ORDER, precision, DISCRETE_SHELLS, vertices, triangles, modes, zero_modes, reoriented]
    }

    /// Reads and checks the first [`FRONT`] bytes.
    fn read(bytes: &[u8]) -> Result<Self> {
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
        if word(4) != DISCRETE_SHELLS {
            return invalid(format!("the saved model has the energy {}, which this library does not know", word(4)));
        }
        let [vertices, triangles, modes, zero_modes, reoriented] = std::array::from_fn(|i| word(5 + i));
        if vertices == 0 || triangles == 0 || modes as usize > MAX_MODES || zero_modes > modes || reoriented > triangles
        {
            let counts = format!("{vertices} vertices, {triangles} triangles, {zero_modes} zero modes of {modes}");
            return invalid(format!("the saved model has {counts}: out of range"));
        }
        Ok(Self { precision, linear, vertices, triangles, modes, zero_modes, reoriented, sections })
    }

    /// Bytes of the whole, exact whatever the counts are.
    fn size(&self) -> u128 {
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

impl Model {
    /// Size of [`Model::save`].
    pub fn saved_size(&self) -> usize {
        Header::of(self).size() as usize
    }

    /// Everything there is, so that [`Model::load`] gives a model of the same bits.
    pub fn save(&self) -> Result<Vec<u8>> {
        let _proof: SavedModels = Proof::of(Feature::SavedModels)?;
        let mut out: Vec<u8> = Vec::new();
        let (header, size) = (Header::of(self), self.saved_size());
        let refused = |_| Error::new(ErrorKind::OutOfMemory, format!("the saved model needs {size} bytes"));
        out.try_reserve_exact(size).map_err(refused)?;
        header.words().iter().for_each(|word| out.extend(word.to_le_bytes()));
        if header.sections > 0 {
            put_u64(&mut out, header.sections);
        }
        let Self { shell, modal, certificate, .. } = self;
        [self.peak_bytes, certificate.count, certificate.found].iter().for_each(|x| put_u64(&mut out, *x as u64));
        let Material { k_area, k_length, k_bend, area_density } = shell.material;
        let Certificate { residual, orthonormality, shift, .. } = *certificate;
        let facts = [k_area, k_length, k_bend, area_density, residual, orthonormality, shift];
        facts.iter().chain(&self.seconds).for_each(|x| x.put(&mut out));
        let rest = shell.sag.as_ref().map_or(&shell.mesh.positions, |sag| &sag.rest);
        rest.iter().flatten().for_each(|x| x.put(&mut out));
        shell.mesh.triangles.iter().flatten().for_each(|v| out.extend(v.to_le_bytes()));
        out.extend(shell.held.iter().map(|held| u8::from(*held)));
        let without = vec![0.0; if header.linear { modal.n_modes() } else { 0 }]; // in place of what a linear model lacks
        let per_mode = [&modal.eigenvalues, &modal.largest_rotation, &without, &modal.largest_swing, &without];
        per_mode.into_iter().flatten().for_each(|x| x.put(&mut out));
        with_basis!(&modal.basis, basis => put_basis(basis, &mut out));
        put_sections(self, &mut out);
        let sum = xxh3_64(&out);
        put_u64(&mut out, sum);
        debug_assert_eq!(out.len(), size);
        Ok(out)
    }

    /// The model that [`Model::save`] wrote. Fails on any other bytes, before it allocates more than a small multiple of them.
    pub fn load(bytes: &[u8]) -> Result<Self> {
        let _proof: SavedModels = Proof::of(Feature::SavedModels)?;
        let header = Header::read(bytes)?;
        header.precision.require()?;
        if header.size() != bytes.len() as u128 {
            let message = format!("{} bytes are not the {} of this saved model", bytes.len(), header.size());
            return invalid(message);
        }
        let (body, sum) = bytes.split_at(bytes.len() - 8);
        if xxh3_64(body) != u64_of(sum) {
            return invalid("the saved model is damaged: its checksum does not match");
        }
        let front = if header.sections > 0 { FRONT } else { HEADER };
        Self::restore(&header, Reader { rest: &body[front..] }).map_err(|error| match error.kind {
            ErrorKind::OutOfMemory | ErrorKind::Unsupported => error,
            _ => Error::new(ErrorKind::InvalidData, format!("the saved model is not one: {}", error.message)),
        })
    }

    fn restore(header: &Header, mut from: Reader) -> Result<Self> {
        let [peak_bytes, count, found] = std::array::from_fn(|_| from.word() as usize);
        let [k_area, k_length, k_bend, area_density] = std::array::from_fn(|_| from.number());
        let [residual, orthonormality, shift] = std::array::from_fn(|_| from.number());
        let seconds: [f64; PHASES] = std::array::from_fn(|_| from.number());
        let material = Material { k_area, k_length, k_bend, area_density };
        let shell = restore_shell(header, &mut from, material)?;
        let sections = sections_of(from.last(header.sections as usize))?;
        let shell = match sections.sag {
            Some(content) => restore_sag(&shell, content)?,
            None => shell,
        };
        let [eigenvalues, mut largest_rotation, mut largest_swing] = [(); 3].map(|()| from.numbers(header.modes));
        let certificate = Certificate { residual, orthonormality, shift, disagreement: 0.0, count, found };
        check_facts(&shell, &certificate, &seconds)?;
        check_modes(header, &shell, &eigenvalues, [&largest_rotation, &largest_swing])?;
        let units = restore_units(header, sections.units)?;
        let modes = (&largest_rotation[..], &units[..]);
        let basis = match header.precision {
            Precision::F32 => AnyBasis::F32(restore_basis(&shell, modes, header.linear, &mut from)?),
            Precision::F64 if Feature::F64Basis.is_built_in() => {
                AnyBasis::F64(restore_basis(&shell, modes, header.linear, &mut from)?)
            }
            Precision::I16 if Feature::I16Basis.is_built_in() => {
                AnyBasis::I16(restore_basis(&shell, modes, header.linear, &mut from)?)
            }
            _ => unreachable!("refused above"),
        };
        if header.linear {
            largest_rotation.clear();
            largest_swing.clear();
        }
        let restore = |content| restore_reduced(header, &shell, (content, sections.polynomial));
        let reduced = sections.reduced.map(restore).transpose()?;
        if reduced.is_none() && sections.polynomial.is_some() {
            return invalid("it has a polynomial energy, but no reduced shell");
        }
        let fits = |content| restore_front(&reduced, &shell, header.linear, content);
        let front = sections.front.map(fits).transpose()?;
        let fingerprint = super::fingerprint(&shell, &eigenvalues, header.precision);
        let shell = Arc::new(shell);
        let modal = ModalBasis {
            shell: shell.clone(),
            eigenvalues,
            largest_rotation,
            largest_swing,
            zero_modes: header.zero_modes as usize,
            basis,
            participation: Default::default(),
        };
        Ok(Self {
            fingerprint,
            reduced_fingerprint: super::reduced_fingerprint(fingerprint, &shell, reduced.as_ref()),
            shell,
            modal: Arc::new(modal),
            certificate,
            front,
            reduced: reduced.map(Arc::new),
            solvers: Default::default(),
            strain: Default::default(),
            truncation: 0.0,
            seconds,
            peak_bytes,
        })
    }
}

fn u64_of(bytes: &[u8]) -> u64 {
    u64::from_le_bytes(bytes.try_into().expect("eight bytes"))
}

fn put_u64(out: &mut Vec<u8>, x: u64) {
    out.extend(x.to_le_bytes());
}

fn put_basis<E: Entry>(basis: &Basis<E>, out: &mut Vec<u8>) {
    for v in 0..basis.n_vertices {
        (0..basis.modes).for_each(|k| basis.stored(k, v).iter().take(basis.shapes()).for_each(|x| x.append(out)));
    }
}

/// What is left to read. The size was checked, so that there is always enough.
struct Reader<'a> {
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    /// Takes from the end.
    fn last(&mut self, size: usize) -> &'a [u8] {
        let (rest, last) = self.rest.split_at(self.rest.len() - size);
        self.rest = rest;
        last
    }

    fn take(&mut self, size: usize) -> &'a [u8] {
        let (taken, rest) = self.rest.split_at(size);
        self.rest = rest;
        taken
    }

    fn word(&mut self) -> u64 {
        u64_of(self.take(8))
    }

    fn number(&mut self) -> f64 {
        f64::from_bits(self.word())
    }

    fn numbers(&mut self, count: u32) -> Vec<f64> {
        self.take(8 * count as usize).chunks_exact(8).map(f64::get).collect()
    }
}

/// Mesh, material and supports, checked as those of a host are.
fn restore_shell(header: &Header, from: &mut Reader, material: Material) -> Result<Shell> {
    let (n, t) = (header.vertices as usize, header.triangles as usize);
    let positions = points(from.take(24 * n));
    let index = |row: &[u8], i: usize| u32::from_le_bytes(row[4 * i..4 * i + 4].try_into().expect("four bytes"));
    let corners = |row: &[u8]| std::array::from_fn(|i| index(row, i));
    let triangles: Vec<[u32; 3]> = from.take(12 * t).chunks_exact(12).map(corners).collect();
    let held = from.take(n);
    if held.iter().any(|held| *held > 1) {
        return invalid("a vertex is neither held nor free");
    }
    let mut mesh = Mesh::new(positions, &triangles)?;
    if mesh.n_reoriented > 0 {
        return invalid("its triangles are not oriented consistently");
    }
    mesh.n_reoriented = header.reoriented as usize;
    let fixed = (0..header.vertices).filter(|v| held[*v as usize] == 1).collect();
    Shell::new(mesh, material, &Supports { fixed, clamped: vec![] })
}

fn points(bytes: &[u8]) -> Vec<Vec3> {
    let point = |row: &[u8]| Vec3::from_fn(|i, _| f64::get(&row[8 * i..8 * i + 8]));
    bytes.chunks_exact(24).map(point).collect()
}

/// Tag and bytes of the content of each section that `model` has.
fn section_sizes(model: &Model) -> impl Iterator<Item = (Tag, usize)> {
    let sag = model.shell.sag.as_ref().map(|sag| (SAG, 24 + 24 * sag.rest.len()));
    let units = (model.modal.precision() == Precision::I16).then_some((UNITS, 16 * model.modal.n_modes()));
    let reduced = model.reduced.as_ref().map(|reduced| (REDUCED, reduced.saved_size(model.shell.mass.len())));
    let polynomial = model.reduced.as_ref().and_then(|reduced| reduced.polynomial.as_ref());
    let polynomial = polynomial.map(|polynomial| (POLYNOMIAL, polynomial.saved_size()));
    let front = model.front.as_ref().map(|front| (FRONT_OF_CHOICE, front.saved_size()));
    [sag, units, polynomial, reduced, front].into_iter().flatten()
}

fn put_sections(model: &Model, out: &mut Vec<u8>) {
    for (tag, size) in section_sizes(model) {
        out.extend(tag);
        out.extend(0u32.to_le_bytes());
        put_u64(out, size as u64);
        match (tag, &model.shell.sag, &model.reduced) {
            (SAG, Some(sag), _) => {
                sag.gravity.iter().chain(model.shell.mesh.positions.iter().flatten()).for_each(|x| x.put(out));
            }
            (POLYNOMIAL, _, Some(reduced)) => reduced.polynomial.iter().for_each(|polynomial| polynomial.save(out)),
            (REDUCED, _, Some(reduced)) => reduced.save(model.shell.mass.len(), out),
            (FRONT_OF_CHOICE, ..) => model.front.iter().for_each(|front| front.save(out)),
            _ => {
                let units = with_basis!(&model.modal.basis, basis => basis.units());
                units.iter().flatten().for_each(|unit| unit.put(out));
            }
        }
    }
}

/// Contents of the sections that a file has.
#[derive(Default)]
struct Sections<'a> {
    sag: Option<&'a [u8]>,
    units: Option<&'a [u8]>,
    reduced: Option<&'a [u8]>,
    polynomial: Option<&'a [u8]>,
    front: Option<&'a [u8]>,
}

fn sections_of(mut bytes: &[u8]) -> Result<Sections<'_>> {
    let mut sections = Sections::default();
    while !bytes.is_empty() {
        let Some((front, rest)) = bytes.split_at_checked(SECTION_FRONT) else {
            return invalid("its last section is cut short");
        };
        let (tag, size) = (String::from_utf8_lossy(&front[..4]), u64_of(&front[8..]));
        let known = match &front[..8] {
            [b'S', b'A', b'G', b'S', 0, 0, 0, 0] => &mut sections.sag,
            [b'U', b'N', b'I', b'T', 0, 0, 0, 0] => &mut sections.units,
            [b'R', b'E', b'D', b'U', 0, 0, 0, 0] => &mut sections.reduced,
            [b'P', b'O', b'L', b'Y', 0, 0, 0, 0] => &mut sections.polynomial,
            [b'A', b'U', b'T', b'O', 0, 0, 0, 0] => &mut sections.front,
            _ => return invalid(format!("this library does not know its section {tag:?}")),
        };
        if size > rest.len() as u64 {
            return invalid(format!("its section {tag:?} of {size} bytes is cut short"));
        }
        let (content, rest) = rest.split_at(size as usize);
        if known.replace(content).is_some() {
            return invalid(format!("it has two sections {tag:?}"));
        }
        bytes = rest;
    }
    Ok(sections)
}

/// Units of Φ and Ψ of each mode: 1 except of a basis in 16 bits.
fn restore_units(header: &Header, content: Option<&[u8]>) -> Result<Vec<[f64; 2]>> {
    let modes = header.modes as usize;
    let content = match (header.precision, content) {
        (Precision::I16, Some(content)) if content.len() == 16 * modes => content,
        (Precision::F32 | Precision::F64, None) => return Ok(vec![[1.0; 2]; modes]),
        (_, content) => {
            let size = content.map_or(0, <[u8]>::len);
            return invalid(format!("{size} bytes are not the units of its {modes} modes"));
        }
    };
    let pair = |two: &[u8]| [f64::get(&two[..8]), f64::get(&two[8..])];
    let units: Vec<_> = content.chunks_exact(16).map(pair).collect();
    match units.iter().flatten().find(|unit| !(unit.is_normal() && **unit > 0.0)) {
        Some(unit) => invalid(format!("a unit of its basis is {unit:?}")),
        None => Ok(units),
    }
}

fn restore_reduced(
    header: &Header,
    shell: &Shell,
    (content, polynomial): (&[u8], Option<&[u8]>),
) -> Result<ReducedShell> {
    let _proof: features::ReducedShell = Proof::of(Feature::ReducedShell)?;
    if header.zero_modes > 0 || shell.sag.is_some() {
        return invalid("it has a reduced shell, but moves freely or hangs");
    }
    let mut reduced = ReducedShell::load(shell, header.modes as usize, header.precision, content)?;
    reduced.polynomial = polynomial.map(|content| PolynomialEnergy::load(reduced.n(), content)).transpose()?;
    Ok(reduced)
}

/// The front, whose choice the model must be able to move by.
fn restore_front(reduced: &Option<ReducedShell>, shell: &Shell, linear: bool, content: &[u8]) -> Result<Front> {
    let front = Front::load(content)?;
    let choice = front.choice();
    let can = choice.method.entry().needs.require(!linear, reduced.is_some()).is_ok();
    match can && choice.sagged == shell.sag.is_some() {
        true => Ok(front),
        false => invalid("it cannot move by the method that was chosen for it"),
    }
}

fn restore_sag(shell: &Shell, content: &[u8]) -> Result<Shell> {
    let rest = &shell.mesh.positions;
    if content.len() != 24 + 24 * rest.len() {
        return invalid(format!("{} bytes are not where {} vertices hang", content.len(), rest.len()));
    }
    let (gravity, positions) = (points(&content[..24])[0], points(&content[24..]));
    if let Some(v) = shell.stray(&positions) {
        return invalid(format!("vertex {v} hangs at {:?}", positions[v].data.0[0]));
    }
    if !gravity.iter().all(|g| g.is_finite()) {
        return invalid(format!("it hangs under the gravity {:?}", gravity.data.0[0]));
    }
    Ok(shell.hung(gravity, positions))
}

/// What the host is only shown.
fn check_facts(shell: &Shell, certificate: &Certificate, seconds: &[f64]) -> Result<()> {
    let Certificate { residual, orthonormality, shift, count, found, .. } = *certificate;
    let measures = [residual, orthonormality].into_iter().chain(seconds.iter().copied());
    if measures.into_iter().any(|x| !(x.is_finite() && x >= 0.0)) || !shift.is_finite() {
        return invalid("its certificate or its timing is out of range");
    }
    if count > shell.n_unknowns() || found > shell.n_unknowns() {
        return invalid(format!("its certificate counts {count} and {found} modes of {}", shell.n_unknowns()));
    }
    Ok(())
}

fn check_modes(header: &Header, shell: &Shell, eigenvalues: &[f64], largest: [&[f64]; 2]) -> Result<()> {
    if eigenvalues.len() > shell.n_unknowns() {
        return invalid(format!("it has {} modes of {} unknowns", eigenvalues.len(), shell.n_unknowns()));
    }
    let finite = |x: &f64| x.is_finite() && *x >= 0.0;
    if !eigenvalues.iter().chain(largest[0]).chain(largest[1]).all(finite) {
        return invalid("an eigenvalue or a largest rotation is negative or not finite");
    }
    let zero = &eigenvalues[..header.zero_modes as usize];
    if !eigenvalues.is_sorted() || zero.iter().any(|lambda| *lambda != 0.0) {
        return invalid("its eigenvalues do not ascend from its zero modes");
    }
    Ok(())
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

/// Φ and Ψ: finite, normed, zero where nothing moves, and turning no vertex by more than is said.
fn restore_basis<E: Entry>(
    shell: &Shell,
    (largest_rotation, units): (&[f64], &[[f64; 2]]),
    linear: bool,
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
        for ((entries, found), units) in rows.clone().zip(&mut found).zip(units) {
            let square = |half: &[E], unit: f64| half.iter().map(|x| (x.decode() * unit).powi(2)).sum::<f64>();
            let (shape, turn) = (square(&entries[..3], units[0]), square(&entries[3..], units[1]));
            found.norm += share * shape;
            found.shape = found.shape.max(shape);
            found.turn = found.turn.max(turn);
            all += shape + turn;
            moved += shape;
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
        if !((found.norm - 1.0).abs() <= NORM_ERROR + rounding && found.turn.sqrt() <= turn_bound) {
            let facts = format!("norm {:e}, turns {:e} of {turn_bound:e}", found.norm, found.turn.sqrt());
            return invalid(format!("mode {k} is not normed, or turns further than is said: {facts}"));
        }
        basis.set_scale(k, units[k], largest_turn);
    }
    Ok(basis)
}
