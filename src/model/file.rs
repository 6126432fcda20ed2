//! The saved form of a model: everything that precompute found, so that loading needs no eigenvalue search.
//!
//! All little-endian, one after another without gaps:
//!
//! | what | type |
//! |---|---|
//! | magic "SWMD", version, byte-order mark, precision, energy, n vertices, t triangles, m modes, zero modes, re-oriented triangles | 10 × u32 |
//! | estimate of the peak memory, count and found of the certificate | 3 × u64 |
//! | k_A, k_L, k_B, mass per area, or for energy 2 E, ν, thickness, mass per volume; residual, orthonormality, shift; room for seconds by phase, 0 since they are not saved | 13 × f64 |
//! | positions of the mesh as it was given | 3n × f64 |
//! | triangles, oriented | 3t × u32 |
//! | held | n × u8, 0 or 1; for energy 2 also 2, clamped: held, and on an edge of such whose slope is held |
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
//! | "MAPS" | of each map, the number of its constant and of what it is on, as u32, how many values, as u64, and these, as f64 |
//! | "CREA" | of each crease its ends, as u32, its factor and rest angle, as f64; no number for that of the mesh |
//! | "ORTH" | E₂/E₁ and G₁₂/E₁, the directions of E₁, one or t of them: (2 + 3) or (2 + 3t) × f64 |
//! | "ROLL" | of each vertex held along one or two directions its number and how many, as u32, and the projector onto the others, 9 × f64 |
//! | "SYMM" | of each edge on a plane of symmetry its ends, ascending, as u32, the plane's normal, of length 1, and normal · x on it: 4 × f64 |
//! | "TIES" | of each tie its vertex and the corners of the triangle that this is tied to, thrice the vertex where it is one, as u32, the weights of the corners, the height over it and the stiffness, or 0: 5 × f64 |
//! | "REST" | the rest shape, if not the mesh: 3n × f64 |
//! | "LENG" | length of each edge without stress, if not that of the rest shape or the mesh, edges in order of (lower, higher) vertex: one × f64 |
//! | "SETL" | where it rests by these without load: 3n × f64 |
//! | "SAGS" | gravity, positions where the shell hangs under it: (3 + 3n) × f64; the modes are those of this shape |
//! | "SUPP" | of the s support fields, which are the last of the m modes: how many, as u64, the pattern of each at h supported vertices with mass: 3sh × f64, their coupling with the m − s modes and their stiffness: (s(m − s) + s²) × f64 |
//! | "UNIT" | what an entry of one stands for, in Φ√M and in Ψ√M, of each mode: 2m × f64; the basis is of i16, in 2⁻¹⁶ of these |
//! | "REDU" | the reduced shell: see `reduced/saved.rs` |
//! | "POLY" | its energy as a polynomial, if it has one: see `reduced/polynomial/saved.rs` |
//! | "AUTO" | the front of a chosen method: see `model/front.rs` |
//! | "FULL" | nothing: the choice is the full shell |
//!
//! A section that this library does not know is an error: the model would mean something else without it.
//!
//! Edges, components, masses, energies and the fingerprint follow from these by the code that made them in the first place,
//! which checks the mesh again on the way. So whatever a file holds, a loaded model keeps every promise that the rest of the
//! library relies on, of memory and of finite results; that its modes are those of its shell is the writer's word.

mod basis;
mod header;
mod sections;
mod supports;

pub use header::{FRONT, announced_size};

use crate::energy::KOITER;
use crate::error::invalid;
use crate::features::{Feature, Proof, SavedModels};
use crate::material::{ElasticSheet, Elasticity};
use crate::mesh::Mesh;
use crate::modal::{ModalBasis, with_basis};
use crate::modes::{PHASES, SpectrumCertificate, SupportFields};
use crate::real::Real;
use crate::shell::Make;
use crate::{Error, ErrorKind, Material, Model, Result, Shell, Supports, Vec3};
use header::{HEADER, Header, SECONDS};
use sections::Sections;
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_64;

/// Of a vertex whose slope is held along an edge.
const CLAMPED: u8 = 2;

/// Four constants of the material.
fn constants(material: &Elasticity) -> [f64; 4] {
    match *material {
        Elasticity::DiscreteShells(Material { k_area, k_length, k_bend, area_density }) => {
            [k_area, k_length, k_bend, area_density]
        }
        Elasticity::Koiter(ElasticSheet { young, poisson, thickness, volume_density }) => {
            [young, poisson, thickness, volume_density]
        }
    }
}

/// The material of an energy with these constants.
fn material(energy: u32, constants: [f64; 4]) -> Elasticity {
    let [a, b, c, density] = constants;
    match energy {
        KOITER => ElasticSheet { young: a, poisson: b, thickness: c, volume_density: density }.into(),
        _ => Material { k_area: a, k_length: b, k_bend: c, area_density: density }.into(),
    }
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
        let SpectrumCertificate { residual, orthonormality, shift, .. } = *certificate;
        let facts = [residual, orthonormality, shift];
        // No seconds: two precomputes of the same input save the same bytes.
        constants(&shell.material).iter().chain(&facts).chain(&[0.0; SECONDS]).for_each(|x| x.put(&mut out));
        shell.given().iter().flatten().for_each(|x| x.put(&mut out));
        shell.mesh.triangles.iter().flatten().for_each(|v| out.extend(v.to_le_bytes()));
        out.extend((0..shell.held.len()).map(|v| if shell.is_clamped(v) { CLAMPED } else { u8::from(shell.held[v]) }));
        let without = vec![0.0; if header.linear { modal.n_amplitudes() } else { 0 }]; // in place of what a linear model lacks
        let eigenvalues = supports::padded(modal);
        let per_mode = [&eigenvalues, &modal.largest_rotation, &without, &modal.largest_swing, &without];
        per_mode.into_iter().flatten().for_each(|x| x.put(&mut out));
        with_basis!(&modal.basis, modes => basis::put(modes, &mut out));
        sections::put(self, &mut out);
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
        let material = material(header.energy, std::array::from_fn(|_| from.number()));
        let [residual, orthonormality, shift] = std::array::from_fn(|_| from.number());
        let mut seconds = [0.0; PHASES];
        seconds[..SECONDS].fill_with(|| from.number());
        let sections = sections::split(from.last(header.sections as usize))?;
        let shell = restore_shell(header, &mut from, material, &sections)?;
        let shell = sections::restore_settled(shell, sections.settled)?;
        let shell = Arc::new(match sections.sag {
            Some(content) => sections::restore_sag(&shell, content)?,
            None => shell,
        });
        let certificate = SpectrumCertificate { residual, orthonormality, shift, disagreement: 0.0, count, found };
        check_facts(&shell, &certificate, &seconds)?;
        let modal = restore_modal(header, &shell, (sections.units, sections.supports), &mut from)?;
        let restore =
            |content| sections::restore_reduced((header, modal.n_modes()), &shell, (content, sections.polynomial));
        let reduced = sections.reduced.map(restore).transpose()?;
        if reduced.is_none() && sections.polynomial.is_some() {
            return invalid("it has a polynomial energy, but no reduced shell");
        }
        let fits = |content| sections::restore_front(&reduced, &shell, header.linear, content);
        let front = sections.front.map(fits).transpose()?;
        let fingerprint = super::fingerprint(&shell, &modal, header.precision);
        Ok(Self {
            fingerprint,
            reduced_fingerprint: super::reduced_fingerprint(fingerprint, &shell, reduced.as_ref()),
            shell,
            modal: Arc::new(modal),
            certificate,
            front,
            without_reduced: None,
            takes_full_shell: sections.full_shell.is_some(),
            reduced: reduced.map(Arc::new),
            solvers: Default::default(),
            strain: Default::default(),
            arithmetic: Default::default(),
            other: Default::default(),
            truncation: 0.0,
            seconds,
            peak_bytes,
        })
    }
}

/// Eigenvalues and basis, checked.
fn restore_modal(
    header: &Header,
    shell: &Arc<Shell>,
    (units, supports): (Option<&[u8]>, Option<&[u8]>),
    from: &mut Reader,
) -> Result<ModalBasis> {
    let [mut eigenvalues, mut largest_rotation, mut largest_swing] = [(); 3].map(|()| from.numbers(header.modes));
    check_modes(header, shell, &eigenvalues, [&largest_rotation, &largest_swing])?;
    let units = sections::restore_units(header, units)?;
    let supports = supports.map(|content| supports::restore(header, shell, content)).transpose()?;
    eigenvalues.truncate(eigenvalues.len() - supports.as_ref().map_or(0, SupportFields::n));
    let basis = basis::restore((header, eigenvalues.len()), shell, (&largest_rotation, &units), from)?;
    if header.linear {
        largest_rotation.clear();
        largest_swing.clear();
    }
    Ok(ModalBasis {
        shell: shell.clone(),
        eigenvalues,
        largest_rotation,
        largest_swing,
        zero_modes: header.zero_modes as usize,
        supports,
        basis,
        participation: Default::default(),
    })
}

fn u64_of(bytes: &[u8]) -> u64 {
    u64::from_le_bytes(bytes.try_into().expect("eight bytes"))
}

fn put_u64(out: &mut Vec<u8>, x: u64) {
    out.extend(x.to_le_bytes());
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
fn restore_shell(header: &Header, from: &mut Reader, material: Elasticity, sections: &Sections) -> Result<Shell> {
    let (n, t) = (header.vertices as usize, header.triangles as usize);
    let positions = points(from.take(24 * n));
    let index = |row: &[u8], i: usize| u32::from_le_bytes(row[4 * i..4 * i + 4].try_into().expect("four bytes"));
    let corners = |row: &[u8]| std::array::from_fn(|i| index(row, i));
    let triangles: Vec<[u32; 3]> = from.take(12 * t).chunks_exact(12).map(corners).collect();
    let held = from.take(n);
    let most = if header.energy == KOITER { CLAMPED } else { 1 };
    if held.iter().any(|held| *held > most) {
        return invalid("a vertex is neither held nor free");
    }
    let mut mesh = Mesh::new(positions, &triangles)?;
    if mesh.n_reoriented > 0 {
        return invalid("its triangles are not oriented consistently");
    }
    mesh.n_reoriented = header.reoriented as usize;
    let all = |kind: u8| (0..header.vertices).filter(|v| held[*v as usize] == kind).collect::<Vec<u32>>();
    let supports = Supports { fixed: all(1), clamped: all(CLAMPED), ..Default::default() };
    let maps = sections.maps.map_or(Ok(vec![]), sections::restore_maps)?;
    let creases = match (sections.creases, sections.yields) {
        (None, None) => vec![],
        (creases, yields) => sections::restore_creases(creases.unwrap_or_default(), yields)?,
    };
    if let Some(content) = sections.rest_shape.filter(|content| content.len() != 24 * n) {
        return invalid(format!("{} bytes are not the rest shape of {n} vertices", content.len()));
    }
    let rest_shape = sections.rest_shape.map(points);
    let fibres = sections.orthotropy.map(sections::restore_fibres).transpose()?;
    let has_fibres = fibres.is_some();
    let bonds = sections.ties.map_or(Ok(vec![]), |content| sections::restore_bonds(&mesh, content))?;
    let mirrors = sections.mirrors.map_or(Ok(vec![]), |content| sections::restore_mirrors(&mesh, content))?;
    let rest_lengths = sections.lengths.map_or(Ok(vec![]), |content| sections::restore_lengths(&mesh, content))?;
    let make = Make { maps, creases, rest_shape, rest_lengths, fibres, bonds, mirrors, ..Make::of(material) };
    let mut shell = Shell::made(mesh, make, &supports)?;
    if shell.orthotropy.is_some() != has_fibres {
        return invalid("it has directions, but is the same in all of them");
    }
    if let Some(content) = sections.rollers {
        shell.rollers = sections::restore_rollers(&shell, content)?.into();
    }
    if let Some(v) = shell.mirrors.iter().flat_map(|m| m.ends.map(|v| (v, m.normal))).find(|(v, n)| !shell.holds(*v, n))
    {
        return invalid(format!("vertex {} is on a plane of symmetry, but may leave it", v.0));
    }
    if let Some(v) = supports.clamped.iter().find(|v| !shell.is_clamped(**v as usize)) {
        return invalid(format!("vertex {v} is clamped, but on no edge between two such"));
    }
    Ok(shell)
}

fn points(bytes: &[u8]) -> Vec<Vec3> {
    let point = |row: &[u8]| Vec3::from_fn(|i, _| f64::get(&row[8 * i..8 * i + 8]));
    bytes.chunks_exact(24).map(point).collect()
}

/// What the host is only shown.
fn check_facts(shell: &Shell, certificate: &SpectrumCertificate, seconds: &[f64]) -> Result<()> {
    let SpectrumCertificate { residual, orthonormality, shift, count, found, .. } = *certificate;
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
