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
//! | Φ√M and Ψ√M by vertex, then mode | 6nm × f32 or f64 |
//! | xxh3 of all before | u64 |
//!
//! A model with a reduced shell of f fields and s sampled elements has the version 2: the words of the front are followed by f and s,
//! 2 × u32, and Φ and Ψ by
//!
//! | what | type |
//! |---|---|
//! | what the samples leave of the forces | f64 |
//! | sampled elements, ascending by rest row; their weights | s × u32, s × f64 |
//! | D, by column | m² × f64 |
//! | B√M by vertex, then field | 3nf × f32 or f64 |
//!
//! Edges, components, masses, energies and the fingerprint follow from these by the code that made them in the first place,
//! which checks the mesh again on the way. So whatever a file holds, a loaded model keeps every promise that the rest of the
//! library relies on, of memory and of finite results; that its modes are those of its shell is the writer's word.

use crate::energy::DISCRETE_SHELLS;
use crate::error::try_zeroed;
use crate::mesh::Mesh;
use crate::model::{AnyBasis, Precision, with_basis};
use crate::modes::{Certificate, MAX_MODES, PHASES};
use crate::real::Real;
use crate::reduced::{AnyFields, Fields, MAX_FIELDS, ReducedShell, with_fields};
use crate::warp::Basis;
use crate::{Error, ErrorKind, Material, Model, Result, Shell, Supports, Vec3};
use nalgebra::DMatrix;
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_64;

const MAGIC: [u8; 4] = *b"SWMD";
const VERSION: u32 = 1;
const REDUCED_VERSION: u32 = 2;
const BYTE_ORDER: u32 = 0x0102_0304;
/// Bytes that tell the size of the whole.
pub const HEADER: usize = 48;
const WORDS: usize = 10;
const REDUCED_WORDS: usize = 12;
const FACTS: usize = 8 * (3 + 7 + PHASES);

/// Φᵀ M Φ of a mode may differ from 1 by this: f32 leaves 1e-7.
const NORM_ERROR: f64 = 1e-4;
/// Ψ may exceed the largest rotation said by its own rounding: relative, and absolute among the subnormal f32.
const ROTATION_ERROR: (f64, f64) = (1e-6, 1e-44);

fn invalid<T>(message: impl Into<String>) -> Result<T> {
    Err(Error::new(ErrorKind::InvalidData, message))
}

/// Sizes and kinds at the front.
#[derive(Clone, Copy)]
struct Header {
    precision: Precision,
    vertices: u32,
    triangles: u32,
    modes: u32,
    zero_modes: u32,
    reoriented: u32,
    /// Fields and samples of the reduced shell.
    reduced: Option<(u32, u32)>,
}

impl Header {
    fn of(model: &Model) -> Self {
        let mesh = &model.shell.mesh;
        Self {
            precision: model.precision(),
            vertices: mesh.positions.len() as u32,
            triangles: mesh.triangles.len() as u32,
            modes: model.n_modes() as u32,
            zero_modes: model.zero_modes as u32,
            reoriented: mesh.n_reoriented as u32,
            reduced: model.reduced.as_ref().map(|reduced| (reduced.n() as u32, reduced.samples.len() as u32)),
        }
    }

    fn words(&self) -> impl Iterator<Item = u32> {
        let Self { precision, vertices, triangles, modes, zero_modes, reoriented, reduced } = *self;
        let magic = u32::from_le_bytes(MAGIC);
        let precision = precision.number_bytes() as u32;
        let version = if reduced.is_some() { REDUCED_VERSION } else { VERSION };
        let words: [u32; WORDS] = [
            magic,
            version,
            BYTE_ORDER,
            precision,
            DISCRETE_SHELLS,
            vertices,
            triangles,
            modes,
            zero_modes,
            reoriented,
        ];
        words.into_iter().chain(reduced.into_iter().flat_map(|(fields, samples)| [fields, samples]))
    }

    /// Bytes of [`Header::words`].
    fn bytes(&self) -> usize {
        4 * if self.reduced.is_some() { REDUCED_WORDS } else { WORDS }
    }

    /// Reads and checks the first [`HEADER`] bytes.
    fn read(bytes: &[u8]) -> Result<Self> {
        if bytes.len() < HEADER || bytes[..4] != MAGIC {
            return invalid(format!("these {} bytes are not a saved model", bytes.len()));
        }
        let word = |i: usize| u32::from_le_bytes(bytes[4 * i..4 * i + 4].try_into().expect("four bytes"));
        if word(2) != BYTE_ORDER {
            return invalid(format!("the saved model has the byte-order mark {:#010x}: foreign or damaged", word(2)));
        }
        if word(1) != VERSION && word(1) != REDUCED_VERSION {
            let known = format!("{VERSION} and {REDUCED_VERSION}");
            return invalid(format!("the saved model has format version {}; this library reads {known}", word(1)));
        }
        let precision = [Precision::F32, Precision::F64].into_iter().find(|p| p.number_bytes() == word(3) as usize);
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
        let reduced = (word(1) == REDUCED_VERSION).then(|| (word(10), word(11)));
        if reduced.is_some_and(|(fields, _)| fields < modes || fields as usize > MAX_FIELDS || zero_modes > 0) {
            return invalid(format!("the saved model has a reduced shell of {} fields: out of range", word(10)));
        }
        Ok(Self { precision, vertices, triangles, modes, zero_modes, reoriented, reduced })
    }

    /// Bytes of the whole, exact whatever the counts are.
    fn size(&self) -> u128 {
        let [n, t, m] = [self.vertices, self.triangles, self.modes].map(u128::from);
        let number = self.precision.number_bytes() as u128;
        let reduced = self.reduced.map_or(0, |(fields, samples)| {
            let [fields, samples] = [fields, samples].map(u128::from);
            8 + 12 * samples + 8 * m * m + 3 * n * fields * number
        });
        (self.bytes() + FACTS + 8) as u128 + 25 * n + 12 * t + 24 * m + 6 * n * m * number + reduced
    }
}

/// Size that a saved model says it has in its first [`HEADER`] bytes. Fails on anything else.
pub fn announced_size(header: &[u8]) -> Result<u128> {
    Ok(Header::read(header)?.size())
}

impl Model {
    /// Size of [`Model::save`].
    pub fn saved_size(&self) -> usize {
        Header::of(self).size() as usize
    }

    /// Everything there is, so that [`Model::load`] gives a model of the same bits.
    /// One that is linearised where it hangs has no saved form yet.
    pub fn save(&self) -> Result<Vec<u8>> {
        if self.shell.carried.is_some() {
            return Err(Error::new(ErrorKind::Unsupported, "a model linearised where it hangs cannot be saved yet"));
        }
        let mut out: Vec<u8> = Vec::new();
        let size = self.saved_size();
        let refused = |_| Error::new(ErrorKind::OutOfMemory, format!("the saved model needs {size} bytes"));
        out.try_reserve_exact(size).map_err(refused)?;
        Header::of(self).words().for_each(|word| out.extend(word.to_le_bytes()));
        let Self { shell, certificate, .. } = self;
        [self.peak_bytes, certificate.count, certificate.found].iter().for_each(|x| put_u64(&mut out, *x as u64));
        let Material { k_area, k_length, k_bend, area_density } = shell.material;
        let Certificate { residual, orthonormality, shift, .. } = *certificate;
        let facts = [k_area, k_length, k_bend, area_density, residual, orthonormality, shift];
        facts.iter().chain(&self.seconds).for_each(|x| x.put(&mut out));
        shell.mesh.positions.iter().flatten().for_each(|x| x.put(&mut out));
        shell.mesh.triangles.iter().flatten().for_each(|v| out.extend(v.to_le_bytes()));
        out.extend(shell.held.iter().map(|held| u8::from(*held)));
        let per_mode = [&self.eigenvalues, &self.largest_rotation, &self.largest_swing];
        per_mode.into_iter().flatten().for_each(|x| x.put(&mut out));
        with_basis!(&self.basis, basis => put_basis(basis, &mut out));
        if let Some(reduced) = &self.reduced {
            put_reduced(reduced, shell.mass.len(), &mut out);
        }
        let sum = xxh3_64(&out);
        put_u64(&mut out, sum);
        debug_assert_eq!(out.len(), size);
        Ok(out)
    }

    /// The model that [`Model::save`] wrote. Fails on any other bytes, before it allocates more than a small multiple of them.
    pub fn load(bytes: &[u8]) -> Result<Self> {
        let header = Header::read(bytes)?;
        if header.size() != bytes.len() as u128 {
            let message = format!("{} bytes are not the {} of this saved model", bytes.len(), header.size());
            return invalid(message);
        }
        let (body, sum) = bytes.split_at(bytes.len() - 8);
        if xxh3_64(body) != u64::from_le_bytes(sum.try_into().expect("eight bytes")) {
            return invalid("the saved model is damaged: its checksum does not match");
        }
        Self::restore(&header, Reader { rest: &body[header.bytes()..] }).map_err(|error| match error.kind {
            ErrorKind::OutOfMemory => error,
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
        let [eigenvalues, largest_rotation, largest_swing] = [(); 3].map(|()| from.numbers(header.modes));
        let certificate = Certificate { residual, orthonormality, shift, count, found };
        check_facts(&shell, &certificate, &seconds)?;
        check_modes(header, &shell, &eigenvalues, [&largest_rotation, &largest_swing])?;
        let basis = match header.precision {
            Precision::F32 => AnyBasis::F32(restore_basis(&shell, &largest_rotation, &mut from)?),
            Precision::F64 => AnyBasis::F64(restore_basis(&shell, &largest_rotation, &mut from)?),
        };
        let reduced = header.reduced.map(|sizes| restore_reduced(header, sizes, &shell, &mut from)).transpose()?;
        Ok(Self {
            fingerprint: crate::model::fingerprint(&shell, &eigenvalues, header.precision),
            shell: Arc::new(shell),
            eigenvalues,
            largest_rotation,
            largest_swing,
            zero_modes: header.zero_modes as usize,
            certificate,
            basis,
            reduced,
            seconds,
            peak_bytes,
        })
    }
}

fn put_u64(out: &mut Vec<u8>, x: u64) {
    out.extend(x.to_le_bytes());
}

fn put_basis<T: Real>(basis: &Basis<T>, out: &mut Vec<u8>) {
    for v in 0..basis.n_vertices {
        (0..basis.modes).for_each(|k| basis.stored(k, v).iter().for_each(|x| x.put(out)));
    }
}

fn put_reduced(reduced: &ReducedShell, n_vertices: usize, out: &mut Vec<u8>) {
    reduced.fit.put(out);
    reduced.samples.iter().for_each(|(element, _)| out.extend(element.to_le_bytes()));
    reduced.samples.iter().for_each(|(_, weight)| weight.put(out));
    reduced.energy.correction().iter().for_each(|x| x.put(out));
    with_fields!(&reduced.fields, fields => {
        for v in 0..n_vertices {
            (0..fields.n).for_each(|k| fields.stored(k, v).iter().for_each(|x| x.put(out)));
        }
    });
}

/// What is left to read. The size was checked, so that there is always enough.
struct Reader<'a> {
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    fn take(&mut self, size: usize) -> &'a [u8] {
        let (taken, rest) = self.rest.split_at(size);
        self.rest = rest;
        taken
    }

    fn word(&mut self) -> u64 {
        u64::from_le_bytes(self.take(8).try_into().expect("eight bytes"))
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
    let point = |row: &[u8]| Vec3::from_fn(|i, _| f64::get(&row[8 * i..8 * i + 8]));
    let positions: Vec<Vec3> = from.take(24 * n).chunks_exact(24).map(point).collect();
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

/// What is only told to the host.
fn check_facts(shell: &Shell, certificate: &Certificate, seconds: &[f64]) -> Result<()> {
    let Certificate { residual, orthonormality, shift, count, found } = *certificate;
    let told = [residual, orthonormality].into_iter().chain(seconds.iter().copied());
    if told.into_iter().any(|x| !(x.is_finite() && x >= 0.0)) || !shift.is_finite() {
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

/// Φ and Ψ: finite, normed, zero where nothing moves, and turning no vertex by more than is said.
fn restore_basis<T: Real>(shell: &Shell, largest_rotation: &[f64], from: &mut Reader) -> Result<Basis<T>> {
    let (n, modes) = (shell.mass.len(), largest_rotation.len());
    let row = 6 * T::BYTES;
    let bytes = from.take(n * modes * row);
    let mut basis = Basis::<T>::new(&shell.mesh.positions, &shell.mass, modes, shell.total_mass)?;
    let mut norms = try_zeroed::<f64>("the norms", modes)?;
    let mut turns = try_zeroed::<f64>("the rotations", modes)?;
    for v in 0..n {
        let moves = shell.mass[v] > 0.0 && !shell.held[v];
        let share = shell.mass[v] / shell.total_mass;
        for k in 0..modes {
            let at = (v * modes + k) * row;
            let stored: [T; 6] = std::array::from_fn(|i| T::get(&bytes[at + i * T::BYTES..at + (i + 1) * T::BYTES]));
            let square = |half: &[T]| half.iter().map(|x| x.to_f64() * x.to_f64()).sum::<f64>();
            let (shape, turn) = (square(&stored[..3]), square(&stored[3..]));
            if !(shape + turn).is_finite() {
                return invalid(format!("mode {k} is not finite at vertex {v}"));
            }
            if !(moves || shape == 0.0) {
                return invalid(format!("mode {k} moves vertex {v}, which is held"));
            }
            norms[k] += share * shape;
            turns[k] = turns[k].max(turn);
            basis.set_stored(k, v, stored);
        }
    }
    if !basis.is_finite() {
        return invalid("its positions leave the range of its precision"); // which the shapes do not
    }
    let (relative, absolute) = ROTATION_ERROR;
    let root_mass = shell.total_mass.sqrt();
    for k in 0..modes {
        let norm_error = (norms[k] - 1.0).abs();
        let turn_bound = largest_rotation[k] * root_mass * (1.0 + relative) + absolute;
        if !(norm_error <= NORM_ERROR && turns[k].sqrt() <= turn_bound) {
            let facts = format!("norm {:e}, turns {:e} of {turn_bound:e}", norms[k], turns[k].sqrt());
            return invalid(format!("mode {k} is not normed, or turns further than is said: {facts}"));
        }
    }
    Ok(basis)
}

/// Samples that are elements with positive weights, D symmetric, and fields that are normed and move nothing that is held.
fn restore_reduced(header: &Header, sizes: (u32, u32), shell: &Shell, from: &mut Reader) -> Result<ReducedShell> {
    let ((fields, samples), m) = (sizes, header.modes as usize);
    let fit = from.number();
    let index = |row: &[u8]| u32::from_le_bytes(row.try_into().expect("four bytes"));
    let elements: Vec<u32> = from.take(4 * samples as usize).chunks_exact(4).map(index).collect();
    let weights = from.numbers(samples);
    let correction = DMatrix::from_vec(m, m, from.take(8 * m * m).chunks_exact(8).map(f64::get).collect());
    let ascend = elements.windows(2).all(|pair| pair[0] < pair[1]);
    if !ascend || elements.last().is_some_and(|&e| e as usize >= shell.energy.n_elements()) {
        return invalid("its sampled elements do not ascend, or are none of its shell's");
    }
    if !(weights.iter().all(|w| w.is_finite() && *w > 0.0) && fit.is_finite() && fit >= 0.0) {
        return invalid("a weight of its samples is not positive");
    }
    if !correction.iter().all(|x| x.is_finite()) || correction != correction.transpose() {
        return invalid("the correction of its rest stiffness is not symmetric");
    }
    let fields = match header.precision {
        Precision::F32 => AnyFields::F32(restore_fields(shell, fields as usize, from)?),
        Precision::F64 => AnyFields::F64(restore_fields(shell, fields as usize, from)?),
    };
    let samples = elements.into_iter().zip(weights).collect();
    let mut reduced = ReducedShell::assemble(shell, fields, samples, correction)?;
    reduced.fit = fit;
    Ok(reduced)
}

fn restore_fields<T: Real>(shell: &Shell, n: usize, from: &mut Reader) -> Result<Fields<T>> {
    let row = 3 * T::BYTES;
    let bytes = from.take(shell.mass.len() * n * row);
    let mut fields = Fields::<T>::new(&shell.mesh.positions, n, shell.total_mass)?;
    let mut norms = vec![0.0; n];
    for (i, row) in bytes.chunks_exact(row).enumerate() {
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
        Some(k) => invalid(format!("field {k} has the norm {:e}", norms[k])),
        None => Ok(fields),
    }
}
