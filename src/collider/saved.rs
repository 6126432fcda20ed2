//! The saved form of a solid: magic, version and kind in 16 bits each, its numbers, and a checksum of all before it. Numbers are little-endian:
//! counts in 32 bits, lengths in 64, a grid's values in 32. What follows from them, as trees and planes, is made anew.

use super::grid::{Grid, LEAST_NODES, MOST_NODES, PADDING};
use super::hull::Hull;
use super::moving::{Moving, Rim};
use super::primitive::{Capsule, Cuboid};
use super::sheet::Sheet;
use super::{Ball, SIZES, Shape, Solid};
use crate::error::{Result, invalid, reserve};
use crate::{Error, ErrorKind, Vec3};
use xxhash_rust::xxh3::xxh3_64;

const MAGIC: [u8; 4] = *b"SWSO";
const VERSION: u16 = 1;
const HEADER: usize = 8;

impl Shape {
    /// Numbers keep their meaning.
    fn number(&self) -> u16 {
        match self {
            Shape::Plane => 1,
            Shape::Sphere(_) => 2,
            Shape::Capsule(_) => 3,
            Shape::Cuboid(_) => 4,
            Shape::Hull(_) => 5,
            Shape::Grid(_) => 6,
            Shape::Moving(_) => 7,
            Shape::Sheet(_) => 8,
        }
    }
}

impl Solid {
    /// All of it: what is loaded answers with the same bits.
    pub fn save(&self) -> Vec<u8> {
        let mut out = Writer { bytes: MAGIC.to_vec() };
        out.bytes.extend(VERSION.to_le_bytes());
        out.bytes.extend(self.shape.number().to_le_bytes());
        match &self.shape {
            Shape::Plane => (),
            Shape::Sphere(radius) => out.doubles(&[*radius]),
            Shape::Capsule(Capsule { half_length, radius }) => out.doubles(&[*half_length, *radius]),
            Shape::Cuboid(Cuboid { half }) => out.doubles(half.as_slice()),
            Shape::Hull(hull) => {
                out.doubles(&[hull.unit]);
                out.vectors(&hull.positions);
                out.triangles(&hull.triangles);
            }
            Shape::Grid(grid) => {
                grid.nodes.iter().for_each(|n| out.count(*n));
                out.doubles(grid.origin.as_slice());
                out.doubles(grid.ball.center.as_slice());
                out.doubles(&[grid.cell, grid.ball.radius, grid.inner_radius, grid.surface_error]);
                let values = &grid.values[..grid.values.len() - PADDING];
                values.iter().for_each(|value| out.bytes.extend(value.to_le_bytes()));
            }
            Shape::Moving(mesh) => out.moving(mesh),
            Shape::Sheet(sheet) => {
                out.doubles(&[sheet.depth]);
                out.moving(&sheet.mesh);
            }
        }
        let checksum = xxh3_64(&out.bytes);
        out.bytes.extend(checksum.to_le_bytes());
        out.bytes
    }

    /// What [`Solid::save`] gave. Fails on damaged bytes. Whatever bytes are loaded, touches stay finite.
    pub fn load(bytes: &[u8]) -> Result<Self> {
        let half = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        if bytes.len() < HEADER + 8 || bytes[..4] != MAGIC {
            return invalid(format!("these {} bytes are not a saved solid", bytes.len()));
        }
        if half(4) != VERSION {
            return invalid(format!("the saved solid has format version {}; this library reads {VERSION}", half(4)));
        }
        let (body, checksum) = bytes.split_at(bytes.len() - 8);
        if xxh3_64(body).to_le_bytes() != checksum {
            return invalid("the saved solid is damaged: its checksum does not match");
        }
        let mut rest = Reader { bytes: &body[HEADER..] };
        let solid = rest.solid(half(6)).map_err(|error| match error.kind {
            ErrorKind::OutOfMemory => error,
            _ => Error::new(ErrorKind::InvalidData, format!("the saved solid is refused: {error}")),
        })?;
        if rest.bytes.is_empty() { Ok(solid) } else { invalid("the saved solid has bytes that mean nothing") }
    }
}

struct Writer {
    bytes: Vec<u8>,
}

impl Writer {
    fn count(&mut self, n: usize) {
        self.bytes.extend((n as u32).to_le_bytes()); // meshes have fewer than 2³² vertices, grids fewer nodes along an axis
    }

    fn doubles(&mut self, numbers: &[f64]) {
        numbers.iter().for_each(|x| self.bytes.extend(x.to_le_bytes()));
    }

    fn vectors(&mut self, vectors: &[Vec3]) {
        self.count(vectors.len());
        vectors.iter().for_each(|v| self.doubles(v.as_slice()));
    }

    fn moving(&mut self, mesh: &Moving) {
        self.doubles(&[mesh.unit, mesh.inner_radius]);
        self.vectors(&mesh.positions);
        self.vectors(&mesh.before);
        self.triangles(&mesh.triangles);
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) {
        self.count(triangles.len());
        triangles.iter().flatten().for_each(|v| self.bytes.extend(v.to_le_bytes()));
    }
}

struct Reader<'a> {
    bytes: &'a [u8],
}

impl Reader<'_> {
    fn solid(&mut self, kind: u16) -> Result<Solid> {
        let shape = match kind {
            1 => Shape::Plane,
            2 => return Solid::sphere(self.double()?),
            3 => return Solid::capsule(self.double()?, self.double()?),
            4 => return Solid::cuboid(self.vector()?),
            5 => {
                let unit = self.unit()?;
                Shape::Hull(Box::new(Hull::new(self.vectors()?, self.triangles()?, unit)?))
            }
            6 => Shape::Grid(Box::new(self.grid()?)),
            7 => Shape::Moving(Box::new(self.moving(Rim::None)?)),
            8 => {
                let depth = self.double()?;
                Shape::Sheet(Box::new(Sheet::new(self.moving(Rim::Allowed)?, depth)?))
            }
            other => return invalid(format!("its kind is {other}, which this library does not know")),
        };
        Ok(Solid { shape })
    }

    fn moving(&mut self, rim: Rim) -> Result<Moving> {
        let (unit, inner_radius) = (self.unit()?, self.double()?);
        let mut mesh = Moving::new(self.vectors()?, self.vectors()?, self.triangles()?, unit, rim)?;
        if !(inner_radius > 0.0 && inner_radius <= 10.0 * SIZES.end()) {
            return invalid(format!("its inner radius is {inner_radius:?}"));
        }
        mesh.inner_radius = inner_radius;
        Ok(mesh)
    }

    fn grid(&mut self) -> Result<Grid> {
        let nodes = [self.count()?, self.count()?, self.count()?];
        if !nodes.iter().all(|n| (LEAST_NODES..=MOST_NODES).contains(n)) {
            return invalid(format!("its grid has {} × {} × {} nodes", nodes[0], nodes[1], nodes[2]));
        }
        let (origin, center) = (self.vector()?, self.vector()?);
        let [cell, radius, inner_radius, surface_error] =
            [self.double()?, self.double()?, self.double()?, self.double()?];
        let n: usize = nodes.iter().product();
        let mut values = reserve("the grid", self.fits(n, size_of::<f32>())? + PADDING)?;
        for _ in 0..n {
            values.push(f32::from_le_bytes(self.take()?));
        }
        values.extend([0.0; PADDING]);
        Grid::new((nodes, origin, cell), values, (Ball { center, radius }, inner_radius, surface_error))
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let Some((first, rest)) = self.bytes.split_first_chunk() else { return invalid("its bytes end too early") };
        self.bytes = rest;
        Ok(*first)
    }

    fn count(&mut self) -> Result<usize> {
        Ok(u32::from_le_bytes(self.take()?) as usize)
    }

    /// So many items of that size are there.
    fn fits(&self, n: usize, size: usize) -> Result<usize> {
        if n <= self.bytes.len() / size { Ok(n) } else { invalid("its bytes end too early") }
    }

    fn double(&mut self) -> Result<f64> {
        Ok(f64::from_le_bytes(self.take()?))
    }

    fn unit(&mut self) -> Result<f64> {
        let unit = self.double()?;
        let known = unit >= *SIZES.start() && unit <= 2.0 * SIZES.end(); // no NaN is
        if known { Ok(unit) } else { invalid(format!("its unit is {unit:?}")) }
    }

    fn vector(&mut self) -> Result<Vec3> {
        Ok(Vec3::new(self.double()?, self.double()?, self.double()?))
    }

    fn vectors(&mut self) -> Result<Vec<Vec3>> {
        let n = self.count()?;
        let mut vectors = reserve("the saved vertices", self.fits(n, size_of::<Vec3>())?)?;
        for _ in 0..n {
            vectors.push(self.vector()?);
        }
        Ok(vectors)
    }

    fn triangles(&mut self) -> Result<Vec<[u32; 3]>> {
        let n = self.count()?;
        let mut triangles = reserve("the saved triangles", self.fits(n, size_of::<[u32; 3]>())?)?;
        for _ in 0..n {
            triangles.push([self.take()?, self.take()?, self.take()?].map(u32::from_le_bytes));
        }
        Ok(triangles)
    }
}
