//! Positions and motion of the vertices.

use super::fields::Rows;
use super::force::wide;
use super::{AnyBasis, AnyFields, MOST_SAMPLES, RotationStrain, with_fields};
use crate::Vec3;
use crate::features::Feature;
use crate::modal::ModalBasis;
use crate::real::Real;
use crate::warp::{LANES, Placement, visit_runs};
use nalgebra::Matrix3;
use std::ops::Range;

/// Makes the positions of a block from its displacements and rest positions, in the basis's precision, rounded to f32.
#[allow(clippy::type_complexity)] // said by the names of its parts
fn placed_rows<T: Real>(placement: &Placement) -> impl Fn(&Rows<T>, &Rows<T>) -> [[f32; 3]; LANES] {
    let origin: [T; 3] = std::array::from_fn(|c| T::of(placement.origin[c]));
    let matrix = |r: Matrix3<f64>| std::array::from_fn(|c| std::array::from_fn(|d| T::of(r[(c, d)])));
    let turn: Option<[[T; 3]; 3]> = placement.rotation.map(matrix);
    move |u, rest| {
        std::array::from_fn(|i| {
            let local: [T; 3] = std::array::from_fn(|c| rest[c].0[i] + u[c].0[i]);
            std::array::from_fn(|c| {
                let turned = turn.map_or(local[c], |r| r[c][0] * local[0] + r[c][1] * local[1] + r[c][2] * local[2]);
                (origin[c] + turned).to_f32()
            })
        })
    }
}

impl RotationStrain {
    fn rows_f64(
        &self,
        (modal, q): (&ModalBasis, &[f64]),
        blocks: Range<usize>,
        placement: &Placement,
        write: &mut (impl FnMut(usize, &[[f64; 3]]) + ?Sized),
    ) {
        let rest = &modal.shell.mesh.positions;
        let mut room = [Matrix3::zeros(); MOST_SAMPLES];
        let remainders = self.remainders(&mut room, q);
        with_fields!(modal, self, basis, fields => {
            fields.displacements(basis, blocks, (q, remainders), |first, u, _| {
                let mut rows = [[0.0; 3]; LANES];
                for ((row, u), rest) in rows.iter_mut().zip(wide(u)).zip(&rest[first..]) {
                    let local = rest + u;
                    *row = (placement.origin + placement.rotation.map_or(local, |turn| turn * local)).into();
                }
                write(first, &rows[..LANES.min(rest.len() - first)]);
            });
        });
    }

    fn rows_f32(
        &self,
        (modal, q): (&ModalBasis, &[f64]),
        blocks: Range<usize>,
        placement: &Placement,
        write: &mut (impl FnMut(usize, &[[f32; 3]]) + ?Sized),
    ) {
        let n = modal.shell.mass.len();
        let mut room = [Matrix3::zeros(); MOST_SAMPLES];
        let remainders = self.remainders(&mut room, q);
        with_fields!(modal, self, basis, fields => {
            let rows = placed_rows(placement);
            fields.displacements(basis, blocks, (q, remainders), |first, u, rest| {
                write(first, &rows(u, rest)[..LANES.min(n - first)]);
            });
        });
    }

    /// Hands the positions of all vertices to `write`, in order: the first vertex of some, and their rows.
    pub fn positions(
        &self,
        at: (&ModalBasis, &[f64]),
        placement: &Placement,
        mut write: impl FnMut(usize, &[[f64; 3]]),
    ) {
        self.rows_f64(at, blocks(at.0), placement, &mut write);
    }

    /// As [`RotationStrain::positions`], in the basis's precision and rounded to f32.
    pub fn positions_f32(
        &self,
        at: (&ModalBasis, &[f64]),
        placement: &Placement,
        mut write: impl FnMut(usize, &[[f32; 3]]),
    ) {
        self.rows_f32(at, blocks(at.0), placement, &mut write);
    }

    /// The positions of some vertices, to the same bits: the place in the list, and the row.
    pub fn positions_of(
        &self,
        at: (&ModalBasis, &[f64]),
        placement: &Placement,
        vertices: &[u32],
        write: impl FnMut(usize, [f64; 3]),
    ) {
        visit_runs(vertices, |blocks, write| self.rows_f64(at, blocks, placement, write), write);
    }

    /// As [`RotationStrain::positions_of`], for [`RotationStrain::positions_f32`].
    pub fn positions_of_f32(
        &self,
        at: (&ModalBasis, &[f64]),
        placement: &Placement,
        vertices: &[u32],
        write: impl FnMut(usize, [f32; 3]),
    ) {
        visit_runs(vertices, |blocks, write| self.rows_f32(at, blocks, placement, write), write);
    }

    /// Hands displacement u and its rate u̇ (frame axes) of every vertex to `visit`, in order.
    pub fn visit_motion(
        &self,
        modal: &ModalBasis,
        (q, q_dot): (&[f64], &[f64]),
        mut visit: impl FnMut(usize, Vec3, Vec3),
    ) {
        let n = modal.shell.mass.len();
        let mut room = [[Matrix3::zeros(); MOST_SAMPLES]; 2];
        let [room, rate_room] = &mut room;
        let (remainders, rates) = (self.remainders(room, q), self.rates(rate_room, (q, q_dot)));
        with_fields!(modal, self, basis, fields => {
            for b in blocks(modal) {
                let mut motion = [[Vec3::zeros(); LANES]; 2];
                for (rows, at) in motion.iter_mut().zip([(q, remainders), (q_dot, rates)]) {
                    fields.displacements(basis, b..b + 1, at, |_, u, _| *rows = wide(u));
                }
                let [u, rate] = motion;
                (b * LANES..n).zip(u.iter().zip(&rate)).for_each(|(v, (u, rate))| visit(v, *u, *rate));
            }
        });
    }

    /// Largest |u|².
    pub fn reach(&self, modal: &ModalBasis, q: &[f64]) -> f64 {
        let mut room = [Matrix3::zeros(); MOST_SAMPLES];
        let remainders = self.remainders(&mut room, q);
        let mut largest = 0.0f64;
        with_fields!(modal, self, basis, fields => {
            fields.displacements(basis, blocks(modal), (q, remainders), |_, u, _| {
                largest = wide(u).iter().map(|u| u.norm_squared()).fold(largest, f64::max);
            });
        });
        largest
    }
}

fn blocks(modal: &ModalBasis) -> Range<usize> {
    0..modal.shell.mass.len().div_ceil(LANES)
}
