//! The saved form of a binding: magic, version, the hash of the mesh it belongs to, points and rows, and a checksum. Little-endian.

use super::{Binding, Row, Turning};
use crate::error::{invalid, reserve};
use crate::{Result, Shell, Vec3};
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

const MAGIC: [u8; 4] = *b"SWBI";
const VERSION: u32 = 1;
/// Magic, version, what directions there are, number of points, hash of the mesh, distance and number of the furthest point.
const HEADER: usize = 4 + 4 + 4 + 4 + 8 + 8 + 4;
const ROW: usize = 60;

fn hash_of(base: &[Vec3], triangles: &[[u32; 3]]) -> u64 {
    let mut hash = Xxh3::new();
    base.iter().flat_map(|x| x.iter()).for_each(|c| hash.update(&c.to_le_bytes()));
    triangles.iter().flatten().for_each(|v| hash.update(&v.to_le_bytes()));
    hash.digest()
}

fn write_row(out: &mut Vec<u8>, corners: &[u32; 3], factors: &[[f32; 4]; 3]) {
    corners.iter().for_each(|v| out.extend(v.to_le_bytes()));
    factors.iter().flatten().for_each(|c| out.extend(c.to_le_bytes()));
}

impl Binding {
    /// All of it but the mesh: what is loaded gives the same bits.
    pub fn save(&self) -> Result<Vec<u8>> {
        let per_point = 24 + ROW + if self.turning.is_empty() { 0 } else { 48 + 2 * ROW };
        let mut out = reserve("the saved binding", HEADER + self.rest.len() * per_point + 8)?;
        out.extend(MAGIC);
        out.extend(VERSION.to_le_bytes());
        out.extend((u32::from(self.has[0]) + 2 * u32::from(self.has[1])).to_le_bytes());
        out.extend((self.rest.len() as u32).to_le_bytes());
        out.extend(hash_of(&self.base, &self.mesh.triangles).to_le_bytes());
        out.extend(self.furthest.0.to_le_bytes());
        out.extend(self.furthest.1.to_le_bytes());
        self.rest.iter().flatten().for_each(|c| out.extend(c.to_le_bytes()));
        self.rows.iter().for_each(|row| write_row(&mut out, &row.corners, &row.factors));
        for turning in &self.turning {
            turning.rest.iter().flatten().for_each(|c| out.extend(c.to_le_bytes()));
            turning.factors.iter().for_each(|factors| write_row(&mut out, &turning.corners, factors));
        }
        out.extend(xxh3_64(&out).to_le_bytes());
        Ok(out)
    }

    /// What [`Binding::save`] gave, for a shell of the same mesh. Fails on damaged bytes and on another mesh's. Whatever bytes are loaded,
    /// points stay finite.
    pub fn load(shell: &Shell, bytes: &[u8]) -> Result<Self> {
        let number = |at: usize| u32::from_le_bytes(std::array::from_fn(|i| bytes[at + i]));
        let wide = |at: usize| u64::from_le_bytes(std::array::from_fn(|i| bytes[at + i]));
        if bytes.len() < HEADER + 8 || bytes[..4] != MAGIC {
            return invalid(format!("these {} bytes are not a saved binding", bytes.len()));
        }
        if number(4) != VERSION {
            return invalid(format!(
                "the saved binding has format version {}; this library reads {VERSION}",
                number(4)
            ));
        }
        let (body, checksum) = bytes.split_at(bytes.len() - 8);
        if xxh3_64(body).to_le_bytes() != checksum {
            return invalid("the saved binding is damaged: its checksum does not match");
        }
        let (directions, n) = (number(8), number(12) as usize);
        let per_point = 24 + ROW + if directions == 0 { 0 } else { 48 + 2 * ROW };
        if directions > 3 || n == 0 || (body.len() - HEADER) as u64 != n as u64 * per_point as u64 {
            return invalid(format!("the saved binding says {n} points, but has {} bytes", bytes.len()));
        }
        let mut bound = Self::empty(shell)?;
        if wide(16) != hash_of(&bound.base, &bound.mesh.triangles) {
            return invalid("the saved binding belongs to another mesh");
        }
        bound.has = [directions & 1 != 0, directions & 2 != 0];
        bound.furthest = (f64::from_bits(wide(24)), number(32));
        let mut reader = Reader { bytes: &body[HEADER..], n_vertices: bound.base.len() as u32 };
        bound.rest = reserve("the points", n)?;
        bound.rows = reserve("the points", n)?;
        bound.turning = reserve("the points' directions", if directions == 0 { 0 } else { n })?;
        (0..n).for_each(|_| bound.rest.push(reader.vector()));
        for _ in 0..n {
            bound.rows.push(reader.row()?);
        }
        for _ in 0..bound.turning.capacity().min(n) {
            let (rest, rows) = ([reader.vector(), reader.vector()], [reader.row()?, reader.row()?]);
            if rows[0].corners != rows[1].corners {
                return invalid("the saved binding has a point whose directions follow two triangles");
            }
            bound.turning.push(Turning::new(rest, rows));
        }
        let turned = bound.turning.iter().flat_map(|t| t.rest.as_flattened());
        let distance = &bound.furthest.0;
        let finite = bound.rest.as_flattened().iter().chain(turned).chain([distance]).all(|c| c.is_finite());
        if !finite || bound.furthest.1 as usize >= n {
            return invalid("the saved binding has a point at no place");
        }
        bound.measured().or_else(|error| invalid(format!("the saved binding is refused: {error}")))
    }
}

/// Of bytes whose number is known to suffice.
struct Reader<'a> {
    bytes: &'a [u8],
    n_vertices: u32,
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (first, rest) = self.bytes.split_first_chunk().expect("the number of bytes was checked");
        self.bytes = rest;
        *first
    }

    fn vector(&mut self) -> [f64; 3] {
        std::array::from_fn(|_| f64::from_le_bytes(self.take()))
    }

    fn row(&mut self) -> Result<Row> {
        let corners = std::array::from_fn(|_| u32::from_le_bytes(self.take()));
        let factors = std::array::from_fn(|_| std::array::from_fn(|_| f32::from_le_bytes(self.take())));
        match corners.iter().find(|v| **v >= self.n_vertices) {
            Some(v) => invalid(format!("the saved binding names vertex {v} of {}", self.n_vertices)),
            None => Ok(Row { factors, corners }),
        }
    }
}
