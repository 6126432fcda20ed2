//! The sections of a saved model: what only some models have.

use super::header::Header;
use super::{points, put_u64, supports, u64_of};
use crate::energy::Mirror;
use crate::error::invalid;
use crate::features::{self, Feature, Proof};
use crate::material::{Bond, Crease, Fibres, Map, On, Orthotropy, Quantity, RestLength};
use crate::modal::with_basis;
use crate::model::front::Front;
use crate::precision::Precision;
use crate::real::Real;
use crate::reduced::ReducedShell;
use crate::reduced::polynomial::PolynomialEnergy;
use crate::support::Roller;
use crate::{Mesh, Model, Result, Shell, Vec3};
use nalgebra::Matrix3;

type Tag = [u8; 4];

/// Tag, zero and size before a section's content.
const SECTION_FRONT: usize = 16;
/// Bytes of a crease.
const CREASE: usize = 24;
/// What varies over the shell.
const MAPS: Tag = *b"MAPS";
/// Edges that fold.
const CREASES: Tag = *b"CREA";
/// Yield angles of these.
const YIELDS: Tag = *b"YIEL";
/// Stiffness along and across.
const ORTHOTROPY: Tag = *b"ORTH";
/// The shape without stress.
const REST_SHAPE: Tag = *b"REST";
/// Lengths without stress.
const LENGTHS: Tag = *b"LENG";
/// Where the shell rests by these.
const SETTLED: Tag = *b"SETL";
/// Fields that follow moving supports.
const SUPPORTS: Tag = *b"SUPP";
/// Vertices held along some directions.
const ROLLERS: Tag = *b"ROLL";
/// Bytes of one.
const ROLLER: usize = 80;
/// Edges on planes of symmetry.
const MIRRORS: Tag = *b"SYMM";
/// Bytes of one.
const MIRROR: usize = 40;
/// What is held together.
const TIES: Tag = *b"TIES";
/// Bytes of one.
const TIE: usize = 56;
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
/// That the choice is the full shell.
const FULL_SHELL: Tag = *b"FULL";

/// Tag and bytes of the content of each section that `model` has.
fn sizes(model: &Model) -> impl Iterator<Item = (Tag, usize)> {
    let maps = model.shell.maps.all();
    let maps = (!maps.is_empty()).then(|| (MAPS, maps.iter().map(|map| 16 + 8 * map.values.len()).sum()));
    let creases = model.shell.creases.all();
    let yields = model.shell.creases.yield_somewhere().then_some((YIELDS, 8 * creases.len()));
    let creases = (!creases.is_empty()).then_some((CREASES, CREASE * creases.len()));
    let orthotropy = model.shell.orthotropy.as_ref().map(|fibres| (ORTHOTROPY, 16 + 24 * fibres.given.len()));
    let rollers = &model.shell.rollers;
    let rollers = (!rollers.is_empty()).then_some((ROLLERS, ROLLER * rollers.len()));
    let mirrors = &model.shell.mirrors;
    let mirrors = (!mirrors.is_empty()).then_some((MIRRORS, MIRROR * mirrors.len()));
    let bonds = &model.shell.bonds;
    let bonds = (!bonds.is_empty()).then_some((TIES, TIE * bonds.len()));
    let rest_shape = model.shell.rest_shape.as_ref().map(|shape| (REST_SHAPE, 24 * shape.len()));
    let lengths = model.shell.metric.as_ref().map(|metric| (LENGTHS, 8 * metric.lengths.len()));
    let settled = model.shell.settled_from.as_ref().map(|given| (SETTLED, 24 * given.len()));
    let sag = model.shell.sag.as_ref().map(|sag| (SAG, 24 + 24 * sag.rest.len()));
    let units = (model.modal.precision() == Precision::I16).then_some((UNITS, 16 * model.modal.n_amplitudes()));
    let supports = model.modal.supports.as_ref().map(|fields| (SUPPORTS, supports::size(fields)));
    let reduced = model.reduced.as_ref().map(|reduced| (REDUCED, reduced.saved_size(model.shell.mass.len())));
    let polynomial = model.reduced.as_ref().and_then(|reduced| reduced.polynomial.as_ref());
    let polynomial = polynomial.map(|polynomial| (POLYNOMIAL, polynomial.saved_size()));
    let front = model.front.as_ref().map(|front| (FRONT_OF_CHOICE, front.saved_size()));
    let full_shell = model.takes_full_shell.then_some((FULL_SHELL, 0));
    let made_of = [maps, creases, yields, orthotropy, rollers, mirrors, bonds, rest_shape, lengths, settled, sag];
    made_of.into_iter().chain([units, supports, polynomial, reduced, front, full_shell]).flatten()
}

/// Bytes of all sections of `model`.
pub(super) fn bytes(model: &Model) -> u64 {
    sizes(model).map(|(_, size)| (SECTION_FRONT + size) as u64).sum()
}

/// Appends them.
pub(super) fn put(model: &Model, out: &mut Vec<u8>) {
    for (tag, size) in sizes(model) {
        out.extend(tag);
        out.extend(0u32.to_le_bytes());
        put_u64(out, size as u64);
        match (tag, &model.shell.sag, &model.reduced) {
            (SAG, Some(sag), _) => {
                sag.gravity.iter().chain(model.shell.mesh.positions.iter().flatten()).for_each(|x| x.put(out));
            }
            (SUPPORTS, ..) => model.modal.supports.iter().for_each(|fields| supports::put(fields, out)),
            (TIES, ..) => model.shell.bonds.iter().for_each(|bond| put_bond(bond, out)),
            (MIRRORS, ..) => model.shell.mirrors.iter().for_each(|mirror| put_mirror(mirror, out)),
            (ROLLERS, ..) => model.shell.rollers.iter().for_each(|roller| put_roller(roller, out)),
            (CREASES, ..) => model.shell.creases.all().iter().for_each(|crease| put_crease(crease, out)),
            (YIELDS, ..) => model.shell.creases.all().iter().for_each(|crease| crease.yield_angle.put(out)),
            (ORTHOTROPY, ..) => model.shell.orthotropy.iter().for_each(|fibres| put_orthotropy(fibres, out)),
            (REST_SHAPE, ..) => model.shell.rest_shape.iter().flat_map(|x| x.iter()).for_each(|x| put_point(x, out)),
            (LENGTHS, ..) => model.shell.metric.iter().flat_map(|of| &of.lengths).for_each(|x| x.put(out)),
            (SETTLED, ..) => model.shell.unloaded().iter().for_each(|x| put_point(x, out)),
            (MAPS, ..) => model.shell.maps.all().iter().for_each(|map| put_map(map, out)),
            (POLYNOMIAL, _, Some(reduced)) => reduced.polynomial.iter().for_each(|polynomial| polynomial.save(out)),
            (REDUCED, _, Some(reduced)) => reduced.save(model.shell.mass.len(), out),
            (FRONT_OF_CHOICE, ..) => model.front.iter().for_each(|front| front.save(out)),
            (FULL_SHELL, ..) => (),
            _ => {
                let units = with_basis!(&model.modal.basis, basis => basis.units());
                units.iter().flatten().for_each(|unit| unit.put(out));
            }
        }
    }
}

fn put_map(map: &Map, out: &mut Vec<u8>) {
    out.extend((map.quantity as u32).to_le_bytes());
    out.extend((map.on as u32).to_le_bytes());
    put_u64(out, map.values.len() as u64);
    map.values.iter().for_each(|x| x.put(out));
}

fn put_crease(crease: &Crease, out: &mut Vec<u8>) {
    crease.vertices.iter().for_each(|v| out.extend(v.to_le_bytes()));
    crease.factor.put(out);
    crease.angle.unwrap_or(f64::NAN).put(out);
}

fn put_orthotropy(fibres: &Orthotropy, out: &mut Vec<u8>) {
    [fibres.across, fibres.shear].iter().for_each(|x| x.put(out));
    fibres.given.iter().for_each(|direction| put_point(direction, out));
}

fn put_bond(bond: &Bond, out: &mut Vec<u8>) {
    std::iter::once(bond.vertex).chain(bond.corners).for_each(|v| out.extend(v.to_le_bytes()));
    bond.weights.iter().chain([&bond.height, &bond.stiffness]).for_each(|x| x.put(out));
}

/// The ties in numbers, checked for a mesh.
pub(super) fn restore_bonds(mesh: &Mesh, content: &[u8]) -> Result<Vec<Bond>> {
    if content.is_empty() || !content.len().is_multiple_of(TIE) {
        return invalid(format!("{} bytes are not its ties", content.len()));
    }
    let word = |row: &[u8]| u32::from_le_bytes([row[0], row[1], row[2], row[3]]);
    let bond = |row: &[u8]| Bond {
        vertex: word(row),
        corners: [4, 8, 12].map(|at| word(&row[at..])),
        weights: [16, 24, 32].map(|at| f64::get(&row[at..at + 8])),
        height: f64::get(&row[40..48]),
        stiffness: f64::get(&row[48..]),
    };
    let bonds: Vec<Bond> = content.chunks_exact(TIE).map(bond).collect();
    match bonds.iter().find(|bond| !bond.is_sound(mesh)) {
        Some(bad) => invalid(format!("the tie of vertex {} is none", bad.vertex)),
        None => Ok(bonds),
    }
}

fn put_roller(roller: &Roller, out: &mut Vec<u8>) {
    out.extend(roller.vertex.to_le_bytes());
    out.extend(roller.held.to_le_bytes());
    roller.free.iter().for_each(|x| x.put(out));
}

/// The rollers of a shell without any, checked.
pub(super) fn restore_rollers(shell: &Shell, content: &[u8]) -> Result<Vec<Roller>> {
    if content.is_empty() || !content.len().is_multiple_of(ROLLER) {
        return invalid(format!("{} bytes are not its vertices that are held along axes", content.len()));
    }
    let word = |row: &[u8]| u32::from_le_bytes([row[0], row[1], row[2], row[3]]);
    let roller = |row: &[u8]| Roller {
        vertex: word(row),
        held: word(&row[4..]),
        free: Matrix3::from_iterator(row[8..].chunks_exact(8).map(f64::get)),
    };
    let rollers: Vec<Roller> = content.chunks_exact(ROLLER).map(roller).collect();
    let free = |roller: &Roller| shell.free.binary_search(&roller.vertex).is_ok() && roller.is_sound();
    if let Some(bad) = rollers.iter().find(|roller| !free(roller)) {
        return invalid(format!("vertex {} is not held along one or two axes", bad.vertex));
    }
    match rollers.is_sorted_by_key(|roller| roller.vertex) && !rollers.windows(2).any(|w| w[0].vertex == w[1].vertex) {
        true => Ok(rollers),
        false => invalid("its vertices that are held along axes do not ascend"),
    }
}

fn put_mirror(mirror: &Mirror, out: &mut Vec<u8>) {
    mirror.ends.iter().for_each(|v| out.extend(v.to_le_bytes()));
    mirror.normal.iter().chain([&mirror.offset]).for_each(|x| x.put(out));
}

/// The edges on planes of symmetry, checked for a mesh.
pub(super) fn restore_mirrors(mesh: &Mesh, content: &[u8]) -> Result<Vec<Mirror>> {
    if content.is_empty() || !content.len().is_multiple_of(MIRROR) {
        return invalid(format!("{} bytes are not its edges on planes of symmetry", content.len()));
    }
    let word = |row: &[u8]| u32::from_le_bytes([row[0], row[1], row[2], row[3]]);
    let mirror = |row: &[u8]| Mirror {
        ends: [word(row), word(&row[4..])],
        normal: Vec3::from_iterator(row[8..32].chunks_exact(8).map(f64::get)),
        offset: f64::get(&row[32..]),
    };
    let mirrors: Vec<Mirror> = content.chunks_exact(MIRROR).map(mirror).collect();
    if let Some(bad) = mirrors.iter().find(|mirror| !mirror.is_sound(mesh)) {
        return invalid(format!("the edge of the vertices {:?} is on no plane of symmetry", bad.ends));
    }
    match mirrors.windows(2).all(|pair| pair[0].ends < pair[1].ends) {
        true => Ok(mirrors),
        false => invalid("its edges on planes of symmetry do not ascend"),
    }
}

fn put_point(x: &Vec3, out: &mut Vec<u8>) {
    x.iter().for_each(|x| x.put(out));
}

/// The creases, with their yield angles where any yields; what they hold is the shell's to check.
pub(super) fn restore_creases(content: &[u8], yields: Option<&[u8]>) -> Result<Vec<Crease>> {
    let n = content.len() / CREASE;
    if let Some(yields) = yields.filter(|yields| yields.len() != 8 * n) {
        return invalid(format!("{} bytes are not the yield angles of its {n} creases", yields.len()));
    }
    if content.is_empty() || !content.len().is_multiple_of(CREASE) {
        return invalid(format!("{} bytes are not its creases", content.len()));
    }
    let crease = |(i, row): (usize, &[u8])| {
        let [a, b, factor, angle] = [&row[..4], &row[4..8], &row[8..16], &row[16..]];
        let vertices = [a, b].map(|v| u32::from_le_bytes([v[0], v[1], v[2], v[3]]));
        let angle = f64::get(angle);
        let yield_angle = yields.map_or(f64::INFINITY, |yields| f64::get(&yields[8 * i..8 * i + 8]));
        Crease { vertices, factor: f64::get(factor), angle: (!angle.is_nan()).then_some(angle), yield_angle }
    };
    Ok(content.chunks_exact(CREASE).enumerate().map(crease).collect())
}

/// Stiffness along and across; what it holds is the shell's to check.
pub(super) fn restore_fibres(content: &[u8]) -> Result<Fibres> {
    match content.split_at_checked(16) {
        Some((ratios, directions)) if !directions.is_empty() && directions.len().is_multiple_of(24) => {
            let [across, shear] = [&ratios[..8], &ratios[8..]].map(f64::get);
            Ok(Fibres { across, shear, directions: points(directions) })
        }
        _ => invalid(format!("{} bytes are not its directions", content.len())),
    }
}

/// The shell where it rests by its creases and its rest shape.
pub(super) fn restore_settled(shell: Shell, content: Option<&[u8]>) -> Result<Shell> {
    let n = shell.mesh.positions.len();
    let positions = match content {
        None if shell.must_settle() => return invalid("it lacks where it rests by its rest shape, lengths or angles"),
        None => return Ok(shell),
        Some(_) if !shell.must_settle() => return invalid("it rests elsewhere than its mesh, without a reason"),
        Some(content) if content.len() != 24 * n => {
            return invalid(format!("{} bytes are not where {n} vertices rest", content.len()));
        }
        Some(content) => points(content),
    };
    if let Some(v) = shell.stray(&positions) {
        return invalid(format!("vertex {v} rests at {:?}", positions[v].data.0[0]));
    }
    Ok(shell.settled(positions))
}

/// The maps; their lengths and values are the shell's to check.
pub(super) fn restore_maps(mut content: &[u8]) -> Result<Vec<Map>> {
    let mut maps = vec![];
    while let Some((front, rest)) = content.split_at_checked(16) {
        let word = |i: usize| u32::from_le_bytes([front[i], front[i + 1], front[i + 2], front[i + 3]]);
        let quantity = Quantity::ALL.into_iter().find(|q| *q != Quantity::Growth && *q as u32 == word(0));
        let on = [On::Vertices, On::Triangles].into_iter().find(|on| *on as u32 == word(4));
        let size = u64_of(&front[8..]).checked_mul(8).filter(|size| *size <= rest.len() as u64);
        let (Some(quantity), Some(on), Some(size)) = (quantity, on, size) else {
            return invalid(format!("its map {} is of nothing known", maps.len()));
        };
        let (values, rest) = rest.split_at(size as usize);
        maps.push(Map { quantity, on, values: values.chunks_exact(8).map(f64::get).collect() });
        content = rest;
    }
    match content.is_empty() && !maps.is_empty() {
        true => Ok(maps),
        false => invalid("its maps are cut short"),
    }
}

/// Lengths of all edges without stress.
pub(super) fn restore_lengths(mesh: &Mesh, content: &[u8]) -> Result<Vec<RestLength>> {
    if content.len() != 8 * mesh.edges.len() {
        return invalid(format!("{} bytes are not the lengths of {} edges", content.len(), mesh.edges.len()));
    }
    let lengths = content.chunks_exact(8).map(f64::get);
    Ok(mesh.edges.iter().zip(lengths).map(|(edge, length)| RestLength { vertices: edge.vertices, length }).collect())
}

/// Contents of the sections that a file has.
#[derive(Default)]
pub(super) struct Sections<'a> {
    pub(super) maps: Option<&'a [u8]>,
    pub(super) creases: Option<&'a [u8]>,
    pub(super) yields: Option<&'a [u8]>,
    pub(super) orthotropy: Option<&'a [u8]>,
    pub(super) rollers: Option<&'a [u8]>,
    pub(super) mirrors: Option<&'a [u8]>,
    pub(super) ties: Option<&'a [u8]>,
    pub(super) rest_shape: Option<&'a [u8]>,
    pub(super) lengths: Option<&'a [u8]>,
    pub(super) settled: Option<&'a [u8]>,
    pub(super) sag: Option<&'a [u8]>,
    pub(super) units: Option<&'a [u8]>,
    pub(super) supports: Option<&'a [u8]>,
    pub(super) reduced: Option<&'a [u8]>,
    pub(super) polynomial: Option<&'a [u8]>,
    pub(super) front: Option<&'a [u8]>,
    pub(super) full_shell: Option<&'a [u8]>,
}

/// By their tags.
pub(super) fn split(mut bytes: &[u8]) -> Result<Sections<'_>> {
    let mut sections = Sections::default();
    while !bytes.is_empty() {
        let Some((front, rest)) = bytes.split_at_checked(SECTION_FRONT) else {
            return invalid("its last section is cut short");
        };
        let (tag, size) = (String::from_utf8_lossy(&front[..4]), u64_of(&front[8..]));
        let known = match &front[..8] {
            [b'M', b'A', b'P', b'S', 0, 0, 0, 0] => &mut sections.maps,
            [b'C', b'R', b'E', b'A', 0, 0, 0, 0] => &mut sections.creases,
            [b'Y', b'I', b'E', b'L', 0, 0, 0, 0] => &mut sections.yields,
            [b'O', b'R', b'T', b'H', 0, 0, 0, 0] => &mut sections.orthotropy,
            [b'R', b'O', b'L', b'L', 0, 0, 0, 0] => &mut sections.rollers,
            [b'S', b'Y', b'M', b'M', 0, 0, 0, 0] => &mut sections.mirrors,
            [b'T', b'I', b'E', b'S', 0, 0, 0, 0] => &mut sections.ties,
            [b'R', b'E', b'S', b'T', 0, 0, 0, 0] => &mut sections.rest_shape,
            [b'L', b'E', b'N', b'G', 0, 0, 0, 0] => &mut sections.lengths,
            [b'S', b'E', b'T', b'L', 0, 0, 0, 0] => &mut sections.settled,
            [b'S', b'A', b'G', b'S', 0, 0, 0, 0] => &mut sections.sag,
            [b'U', b'N', b'I', b'T', 0, 0, 0, 0] => &mut sections.units,
            [b'S', b'U', b'P', b'P', 0, 0, 0, 0] => &mut sections.supports,
            [b'R', b'E', b'D', b'U', 0, 0, 0, 0] => &mut sections.reduced,
            [b'P', b'O', b'L', b'Y', 0, 0, 0, 0] => &mut sections.polynomial,
            [b'A', b'U', b'T', b'O', 0, 0, 0, 0] => &mut sections.front,
            [b'F', b'U', b'L', b'L', 0, 0, 0, 0] => &mut sections.full_shell,
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
    match sections.full_shell {
        Some(content) if !content.is_empty() => invalid("its choice of the full shell has a content"),
        _ => Ok(sections),
    }
}

/// Units of Φ and Ψ of each mode: 1 except of a basis in 16 bits.
pub(super) fn restore_units(header: &Header, content: Option<&[u8]>) -> Result<Vec<[f64; 2]>> {
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

pub(super) fn restore_reduced(
    (header, n_modes): (&Header, usize),
    shell: &Shell,
    (content, polynomial): (&[u8], Option<&[u8]>),
) -> Result<ReducedShell> {
    let _proof: features::ReducedShell = Proof::of(Feature::ReducedShell)?;
    let zero_modes = header.zero_modes as usize;
    if shell.sag.is_some() || shell.settled_from.is_some() && (zero_modes > 0 || polynomial.is_some()) {
        return invalid(
            "it has a reduced shell, but hangs, or is under stress at rest and moves freely or has a polynomial energy",
        );
    }
    let mut reduced = ReducedShell::load(shell, n_modes.saturating_sub(zero_modes), header.precision, content)?;
    reduced.let_go(shell, zero_modes).or_else(|error| invalid(format!("it has a reduced shell: {error}")))?;
    reduced.polynomial = polynomial.map(|content| PolynomialEnergy::load(reduced.n(), content)).transpose()?;
    Ok(reduced)
}

/// The front, whose choice the model must be able to move by.
pub(super) fn restore_front(
    reduced: &Option<ReducedShell>,
    shell: &Shell,
    linear: bool,
    content: &[u8],
) -> Result<Front> {
    let front = Front::load(content)?;
    let choice = front.choice();
    let can = choice.method.entry().needs.require(!linear, reduced.is_some()).is_ok();
    match can && choice.sagged == shell.sag.is_some() {
        true => Ok(front),
        false => invalid("it cannot move by the method that was chosen for it"),
    }
}

pub(super) fn restore_sag(shell: &Shell, content: &[u8]) -> Result<Shell> {
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
