//! What hosts read from a deformed shell: positions in rows x y z, and how far it is bent. One pass over the basis each;
//! from the registers' lanes straight to rows, in whole groups of vertices.

use super::lanes::{Kind, Lanes, Vectors};
use super::{Basis, Block, Entry, LANES, Line, Sweep, WarpPose, Weights, sweep, sweep_blocks, with_weights};
use crate::Vec3;
use crate::real::Real;
use nalgebra::Matrix3;
use std::ops::Range;

/// Where the frame is that rest positions and displacements are given in: x = origin + rotation (rest + u).
#[derive(Clone, Copy)]
pub struct Placement {
    /// Of the frame.
    pub origin: Vec3,
    /// None for the identity, so that nothing is rounded by it.
    pub rotation: Option<Matrix3<f64>>,
}

impl Placement {
    /// Where `local` is.
    #[inline(always)]
    pub fn place(&self, local: Vec3) -> Vec3 {
        self.origin + self.rotation.map_or(local, |rotation| rotation * local)
    }
}

/// Amplitudes and how they move vertices.
#[derive(Clone, Copy)]
pub struct Amplitudes<'a> {
    /// Modal amplitudes (modes).
    pub q: &'a [f64],
    /// u = R̃(Ψq) Φq; otherwise u = Φq.
    pub warped: bool,
}

/// How vertices move.
#[derive(Clone, Copy)]
struct Moving<'a, T> {
    weights: Weights<'a, T>,
    warped: bool,
}

impl<T: Real> Moving<'_, T> {
    /// u of a group.
    #[inline(always)]
    fn displacement<E: Entry<Real = T>, S: Kind, const N: usize>(
        &self,
        lanes: Lanes<T, S, N>,
        block: &Block<E>,
        at: usize,
    ) -> Vectors<T, S, N> {
        if self.warped {
            WarpPose::new(lanes, block.combine(lanes, at, self.weights), self.weights.doublings).displacement()
        } else {
            block.combine_linear(lanes, at, self.weights)
        }
    }
}

fn with_motion<E: Entry>(basis: &Basis<E>, amplitudes: Amplitudes, work: impl FnOnce(Moving<E::Real>)) {
    with_weights(basis, amplitudes.q, |weights| work(Moving { weights, warped: amplitudes.warped }));
}

/// The lanes of a group's vectors, component by component.
#[inline(always)]
fn lines<T: Real, S: Kind, const N: usize>(lanes: Lanes<T, S, N>, v: &Vectors<T, S, N>) -> [Line<T>; 3] {
    let mut lines = [Line([T::default(); LANES]); 3];
    (0..3).for_each(|c| lanes.store(v[c], &mut lines[c].0, 0));
    lines
}

/// Hands `rows` of `width` vertices on, less those past the end.
#[inline(always)]
fn hand_on<F>(
    rows: &[[F; 3]; LANES],
    (first, width, n_vertices): (usize, usize, usize),
    write: &mut impl FnMut(usize, &[[F; 3]]),
) {
    if first + width <= n_vertices {
        write(first, &rows[..width]); // of a length known when compiling
    } else if first < n_vertices {
        write(first, &rows[..n_vertices - first]);
    }
}

/// Hands the positions of all vertices to `write` as f32, group by group: the first vertex and some rows. Computed in the
/// basis's precision T throughout, rest positions included, and rounded to f32 at the end.
pub fn visit_positions_f32<E: Entry>(
    basis: &Basis<E>,
    amplitudes: Amplitudes,
    placement: &Placement,
    write: impl FnMut(usize, &[[f32; 3]]),
) {
    with_motion(basis, amplitudes, |motion| rows_f32(basis, 0..basis.n_blocks(), motion, placement, write));
}

/// The same of the vertices in `vertices` alone, to the same bits: the place in the list and the row. As many blocks are visited
/// as the list has runs of vertices of one block.
pub fn visit_positions_of_f32<E: Entry>(
    basis: &Basis<E>,
    amplitudes: Amplitudes,
    placement: &Placement,
    vertices: &[u32],
    write: impl FnMut(usize, [f32; 3]),
) {
    with_motion(basis, amplitudes, |motion| {
        visit_runs(vertices, |blocks, write| rows_f32(basis, blocks, motion, placement, write), write);
    });
}

/// As [`visit_positions_of_f32`], for [`visit_positions_f64`].
pub fn visit_positions_of_f64<E: Entry>(
    basis: &Basis<E>,
    amplitudes: Amplitudes,
    (rest, placement): (&[Vec3], &Placement),
    vertices: &[u32],
    write: impl FnMut(usize, [f64; 3]),
) {
    with_motion(basis, amplitudes, |motion| {
        visit_runs(vertices, |blocks, write| rows_f64(basis, blocks, motion, (rest, placement), write), write);
    });
}

/// Has the rows of each run of vertices of one block made by `rows`, and hands on those of the list.
pub fn visit_runs<F: Copy + Default>(
    vertices: &[u32],
    rows: impl Fn(Range<usize>, &mut dyn FnMut(usize, &[[F; 3]])),
    mut write: impl FnMut(usize, [F; 3]),
) {
    let block = |v: &u32| *v as usize / LANES;
    let mut place = 0;
    for run in vertices.chunk_by(|a, b| block(a) == block(b)) {
        let b = block(&run[0]);
        let mut of_block = [[F::default(); 3]; LANES];
        rows(b..b + 1, &mut |first, rows| of_block[first % LANES..][..rows.len()].copy_from_slice(rows));
        for v in run {
            write(place, of_block[*v as usize % LANES]);
            place += 1;
        }
    }
}

fn rows_f32<E: Entry>(
    basis: &Basis<E>,
    blocks: Range<usize>,
    motion: Moving<E::Real>,
    placement: &Placement,
    write: impl FnMut(usize, &[[f32; 3]]),
) {
    struct Rows<'a, T, W> {
        n_vertices: usize,
        motion: Moving<'a, T>,
        placement: &'a Placement,
        write: W,
    }

    impl<E: Entry, W: FnMut(usize, &[[f32; 3]])> Sweep<E> for Rows<'_, E::Real, W> {
        #[inline(always)]
        fn visit<S: Kind, const N: usize>(
            &mut self,
            lanes: Lanes<E::Real, S, N>,
            block: Block<E>,
            first: usize,
            at: usize,
        ) {
            let splat = |v: Vec3| [lanes.splat(v.x), lanes.splat(v.y), lanes.splat(v.z)];
            let u = self.motion.displacement(lanes, &block, at);
            let mut x = lanes.add_vectors(&block.rest(lanes, at), &u);
            if let Some(rotation) = &self.placement.rotation {
                let column = |c: usize| splat(rotation.column(c).into());
                let xy = lanes.scale_add(x[1], &column(1), &lanes.scale(x[0], &column(0)));
                x = lanes.scale_add(x[2], &column(2), &xy);
            }
            let [x, y, z] = lines(lanes, &lanes.add_vectors(&splat(self.placement.origin), &x));
            let mut rows = [[0f32; 3]; LANES];
            for i in 0..lanes.width() {
                rows[i] = [x.0[i].to_f32(), y.0[i].to_f32(), z.0[i].to_f32()];
            }
            hand_on(&rows, (first, lanes.width(), self.n_vertices), &mut self.write);
        }
    }

    sweep_blocks(basis, blocks, &mut Rows { n_vertices: basis.n_vertices, motion, placement, write });
}

/// As [`visit_positions_f32`], with the displacements of the basis's precision added to the f64 `rest` positions and placed
/// in f64.
pub fn visit_positions_f64<E: Entry>(
    basis: &Basis<E>,
    amplitudes: Amplitudes,
    (rest, placement): (&[Vec3], &Placement),
    write: impl FnMut(usize, &[[f64; 3]]),
) {
    with_motion(basis, amplitudes, |motion| rows_f64(basis, 0..basis.n_blocks(), motion, (rest, placement), write));
}

fn rows_f64<E: Entry>(
    basis: &Basis<E>,
    blocks: Range<usize>,
    motion: Moving<E::Real>,
    (rest, placement): (&[Vec3], &Placement),
    write: impl FnMut(usize, &[[f64; 3]]),
) {
    struct Rows<'a, T, W> {
        motion: Moving<'a, T>,
        rest: &'a [Vec3],
        placement: &'a Placement,
        write: W,
    }

    impl<E: Entry, W: FnMut(usize, &[[f64; 3]])> Sweep<E> for Rows<'_, E::Real, W> {
        #[inline(always)]
        fn visit<S: Kind, const N: usize>(
            &mut self,
            lanes: Lanes<E::Real, S, N>,
            block: Block<E>,
            first: usize,
            at: usize,
        ) {
            let [x, y, z] = lines(lanes, &self.motion.displacement(lanes, &block, at));
            let Placement { origin, rotation } = *self.placement;
            let mut rows = [[0f64; 3]; LANES];
            let rest = self.rest.get(first..).unwrap_or_default();
            for ((i, row), rest) in rows[..lanes.width()].iter_mut().enumerate().zip(rest) {
                let local = rest + Vec3::new(x.0[i].to_f64(), y.0[i].to_f64(), z.0[i].to_f64());
                *row = match &rotation {
                    None => (origin + local).into(),
                    Some(rotation) => (origin + rotation * local).into(),
                };
            }
            hand_on(&rows, (first, lanes.width(), self.rest.len()), &mut self.write);
        }
    }

    sweep_blocks(basis, blocks, &mut Rows { motion, rest, placement, write });
}

/// How far a shell is bent.
#[derive(Clone, Copy, Debug, Default)]
pub struct Extent {
    /// Largest |u|².
    pub displacement: f64,
    /// Largest |w|², rad².
    pub rotation: f64,
    /// Number of vertices with |w|² beyond a limit.
    pub beyond: usize,
}

/// The extent at given amplitudes; `limit` is a |w|². A basis without Ψ has no rotations to show.
pub fn extent<E: Entry>(basis: &Basis<E>, amplitudes: Amplitudes, limit: f64) -> Extent {
    struct Measure<'a, T> {
        motion: Moving<'a, T>,
        without_turns: bool,
        limit: f64,
        displacement: [f64; LANES],
        rotation: [f64; LANES],
        beyond: [u64; LANES],
    }

    impl<E: Entry> Sweep<E> for Measure<'_, E::Real> {
        #[inline(always)]
        fn visit<S: Kind, const N: usize>(
            &mut self,
            lanes: Lanes<E::Real, S, N>,
            block: Block<E>,
            _: usize,
            at: usize,
        ) {
            let Moving { weights, warped } = self.motion;
            let (u, w) = if self.without_turns {
                (block.combine_linear(lanes, at, weights), [lanes.splat(0.0); 3])
            } else {
                let (linear, turn) = block.combine(lanes, at, weights);
                let pose = || WarpPose::new(lanes, (linear, turn), weights.doublings);
                (if warped { pose().displacement() } else { linear }, turn)
            };
            let (u, w) = (lines(lanes, &u), lines(lanes, &w));
            // In f64: the squares of what f32 holds leave its range. The last block's padding is zero.
            let square = |v: &[Line<E::Real>; 3], i: usize| {
                let [x, y, z] = [v[0].0[i].to_f64(), v[1].0[i].to_f64(), v[2].0[i].to_f64()];
                x * x + y * y + z * z
            };
            for i in 0..lanes.width() {
                let (u, w) = (square(&u, i), square(&w, i));
                self.displacement[i] = self.displacement[i].max(u);
                self.rotation[i] = self.rotation[i].max(w);
                self.beyond[i] += u64::from(w > self.limit);
            }
        }
    }

    let zero = [0.0; LANES];
    let mut found = Extent::default();
    with_motion(basis, amplitudes, |motion| {
        let without_turns = basis.is_linear();
        let mut all = Measure { motion, without_turns, limit, displacement: zero, rotation: zero, beyond: [0; LANES] };
        sweep(basis, &mut all);
        let largest = |values: [f64; LANES]| values.into_iter().fold(0.0, f64::max);
        let beyond = all.beyond.iter().sum::<u64>() as usize;
        found = Extent { displacement: largest(all.displacement), rotation: largest(all.rotation), beyond };
    });
    found
}
