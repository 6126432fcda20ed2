//! The sums that a polynomial energy is evaluated by, in the processor's widest registers. What an evaluation reads is laid out in the order
//! in which it is read. Coefficients of second and higher order have 32 bits; sums have 64, or 32 where a Newton step needs no more.
//!
//! Symmetric matrices are triangles, row i from the diagonal on, or squares of rows of `stride` numbers that are 0 before the diagonal.
//!
//! Loops stand where closures would do: those that reach a function of the standard library lose the wide registers.
#![allow(clippy::needless_range_loop)] // registers are unrolled by number

use super::super::outer::add_outer;
use super::super::products::WIDTH;
use pulp::{Simd, bytemuck};

/// Numbers whose sums are made at once; triangles are padded to it.
pub const TILE: usize = 32;
/// Rows that are read at once; forms' fields are padded to it.
pub const ROWS: usize = super::super::outer::ROWS;
/// Forms side by side: numbers of 32 bits in the widest register.
pub const SIDE: usize = 2 * WIDTH;
/// Entries of such rows at the diagonal.
const CORNER: usize = ROWS * (ROWS + 1) / 2;

/// Where entry (i, j), i ≤ j, of a triangle is; that of (n, n) is their number.
pub fn at(i: usize, j: usize, n: usize) -> usize {
    i * (2 * n - i + 1) / 2 + j - i
}

/// Where entry e of matrix k is among tiles of `count` matrices.
pub fn tiled(k: usize, e: usize, count: usize) -> usize {
    (e / TILE * count + k) * TILE + e % TILE
}

/// Which entry of a form's lower triangle, as [`turn`] reads it, (i, j) is, j ≤ i.
pub fn entry(i: usize, j: usize) -> usize {
    let (block, row) = (i / ROWS, i % ROWS);
    let before = block * ROWS;
    let first = before * (before + 1) / 2;
    if j < before { first + j * ROWS + row } else { first + before * ROWS + row * (row + 1) / 2 + j - before }
}

/// Numbers of a register.
#[inline(always)]
fn lanes<S: Simd>() -> usize {
    size_of::<S::f64s>() / size_of::<f64>()
}

/// In how many bits sums of numbers of 32 are made.
pub trait Sums<S: Simd> {
    /// A sum, and as many as a register holds.
    type Number: Copy + Default;
    type Register: Copy;
    /// Numbers in a register.
    const LANES: usize;
    fn registers(numbers: &mut [Self::Number]) -> &mut [Self::Register];
    fn splat(simd: S, x: Self::Number) -> Self::Register;
    /// As many numbers as a register holds.
    fn read(simd: S, numbers: &[f32]) -> Self::Register;
    /// ab + c, and a + b.
    fn multiply_add(simd: S, a: Self::Register, b: Self::Register, c: Self::Register) -> Self::Register;
    fn add(simd: S, a: Self::Register, b: Self::Register) -> Self::Register;
}

/// 64 bits.
pub struct Double;
/// 32 bits: half the time.
pub struct Single;

impl<S: Simd> Sums<S> for Double {
    type Number = f64;
    type Register = S::f64s;
    const LANES: usize = size_of::<S::f64s>() / size_of::<f64>();

    #[inline(always)]
    fn registers(numbers: &mut [f64]) -> &mut [S::f64s] {
        S::as_mut_simd_f64s(numbers).0
    }

    #[inline(always)]
    fn splat(simd: S, x: f64) -> S::f64s {
        simd.splat_f64s(x)
    }

    #[inline(always)]
    fn read(simd: S, numbers: &[f32]) -> S::f64s {
        let mut wide = [simd.splat_f64s(0.0)];
        for (wide, x) in bytemuck::cast_slice_mut::<S::f64s, f64>(&mut wide).iter_mut().zip(numbers) {
            *wide = f64::from(*x);
        }
        wide[0]
    }

    #[inline(always)]
    fn multiply_add(simd: S, a: S::f64s, b: S::f64s, c: S::f64s) -> S::f64s {
        simd.mul_add_e_f64s(a, b, c)
    }

    #[inline(always)]
    fn add(simd: S, a: S::f64s, b: S::f64s) -> S::f64s {
        simd.add_f64s(a, b)
    }
}

impl<S: Simd> Sums<S> for Single {
    type Number = f32;
    type Register = S::f32s;
    const LANES: usize = size_of::<S::f32s>() / size_of::<f32>();

    #[inline(always)]
    fn registers(numbers: &mut [f32]) -> &mut [S::f32s] {
        S::as_mut_simd_f32s(numbers).0
    }

    #[inline(always)]
    fn splat(simd: S, x: f32) -> S::f32s {
        simd.splat_f32s(x)
    }

    #[inline(always)]
    fn read(_: S, numbers: &[f32]) -> S::f32s {
        S::as_simd_f32s(numbers).0[0]
    }

    #[inline(always)]
    fn multiply_add(simd: S, a: S::f32s, b: S::f32s, c: S::f32s) -> S::f32s {
        simd.mul_add_e_f32s(a, b, c)
    }

    #[inline(always)]
    fn add(simd: S, a: S::f32s, b: S::f32s) -> S::f32s {
        simd.add_f32s(a, b)
    }
}

/// out = Qq of all forms, on a multiple of [`ROWS`] fields.
///
/// Of [`SIDE`] forms that are side by side in turn, `forms` has the lower triangle of Q, `out` the fields.
#[inline(always)]
pub fn turn<S: Simd, T: Sums<S>>(simd: S, q: &[T::Number], forms: &[f32], out: &mut [T::Number]) {
    let (forms, out) = (forms.as_chunks::<SIDE>().0, T::registers(out));
    match SIDE / T::LANES {
        1 => turned::<S, T, 1>(simd, q, forms, out),
        2 => turned::<S, T, 2>(simd, q, forms, out),
        4 => turned::<S, T, 4>(simd, q, forms, out),
        8 => turned::<S, T, 8>(simd, q, forms, out),
        _ => turned::<S, T, 16>(simd, q, forms, out),
    }
}

/// With N registers for the forms that are side by side.
#[inline(always)]
fn turned<S: Simd, T: Sums<S>, const N: usize>(
    simd: S,
    q: &[T::Number],
    forms: &[[f32; SIDE]],
    out: &mut [T::Register],
) {
    let n = q.len();
    let sums = out.as_chunks_mut::<N>().0.chunks_exact_mut(n);
    for (mut rest, sums) in forms.chunks_exact(n * (n + 1) / 2).zip(sums) {
        for i in (0..n).step_by(ROWS) {
            let (wide, others) = rest.split_at(ROWS * i);
            let (corner, others) = others.split_at(CORNER);
            rest = others;
            for part in 0..N {
                add_rows::<S, T, N>(simd, q, (wide, corner), part, sums); // one register after the other: more sums find no room
            }
        }
    }
}

/// Qq of one register's forms, as far as the rows go whose entries before and at the diagonal these are: their own, and more for those before.
#[inline(always)]
fn add_rows<S: Simd, T: Sums<S>, const N: usize>(
    simd: S,
    q: &[T::Number],
    (wide, corner): (&[[f32; SIDE]], &[[f32; SIDE]]),
    part: usize,
    sums: &mut [[T::Register; N]],
) {
    let before = wide.len() / ROWS;
    let (head, tail) = sums.split_at_mut(before);
    let mut own = [T::splat(simd, T::Number::default()); ROWS];
    let mut rows = own;
    for r in 0..ROWS {
        own[r] = T::splat(simd, q[before + r]);
    }
    for ((column, out), q) in wide.as_chunks::<ROWS>().0.iter().zip(head).zip(q) {
        let (along, mut sum) = (T::splat(simd, *q), out[part]);
        for r in 0..ROWS {
            let x = T::read(simd, &column[r][part * T::LANES..][..T::LANES]);
            rows[r] = T::multiply_add(simd, x, along, rows[r]);
            sum = T::multiply_add(simd, x, own[r], sum);
        }
        out[part] = sum;
    }
    for r in 0..ROWS {
        for c in 0..=r {
            let x = T::read(simd, &corner[r * (r + 1) / 2 + c][part * T::LANES..][..T::LANES]);
            rows[r] = T::multiply_add(simd, x, own[c], rows[r]);
            if c < r {
                rows[c] = T::multiply_add(simd, x, own[r], rows[c]);
            }
        }
    }
    for r in 0..ROWS {
        tail[r][part] = rows[r];
    }
}

/// J += A where J is Qq, and s = ½ (A + J)·q, on `q`'s fields.
#[inline(always)]
pub fn strains<S: Simd>(simd: S, q: &[f64], linear: &[f64], jacobian: &mut [f64], s: &mut [f64]) {
    let side = SIDE / lanes::<S>();
    let (linear, jacobian) = (S::as_simd_f64s(linear).0, S::as_mut_simd_f64s(jacobian).0);
    let blocks = linear.chunks_exact(side * q.len()).zip(jacobian.chunks_exact_mut(side * q.len()));
    for ((linear, jacobian), s) in blocks.zip(S::as_mut_simd_f64s(s).0.chunks_exact_mut(side)) {
        for part in 0..side {
            let mut sums = [simd.splat_f64s(0.0); ROWS]; // in turn, for one waits for the one before
            for (i, q) in q.as_chunks::<ROWS>().0.iter().enumerate() {
                for r in 0..ROWS {
                    let at = (i * ROWS + r) * side + part;
                    let own = simd.add_f64s(linear[at], jacobian[at]);
                    jacobian[at] = own;
                    sums[r] = simd.mul_add_e_f64s(simd.add_f64s(linear[at], own), simd.splat_f64s(q[r]), sums[r]);
                }
            }
            let twice = simd.add_f64s(simd.add_f64s(sums[0], sums[1]), simd.add_f64s(sums[2], sums[3]));
            s[part] = simd.mul_f64s(twice, simd.splat_f64s(0.5));
        }
    }
}

/// out_i += Σ J_ik v_k over all forms, with J on `n` fields as [`strains`] gives it.
#[inline(always)]
pub fn add_transposed<S: Simd>(simd: S, jacobian: &[f64], v: &[f64], n: usize, out: &mut [f64]) {
    let (jacobian, v) = (S::as_simd_f64s(jacobian).0, S::as_simd_f64s(v).0);
    let side = SIDE / lanes::<S>();
    for (block, out) in out.chunks_mut(ROWS).enumerate() {
        let mut sums = [simd.splat_f64s(0.0); ROWS];
        for (jacobian, v) in jacobian.chunks_exact(side * n).zip(v.chunks_exact(side)) {
            for (part, v) in v.iter().enumerate() {
                for r in 0..ROWS {
                    sums[r] = simd.mul_add_e_f64s(jacobian[(block * ROWS + r) * side + part], *v, sums[r]);
                }
            }
        }
        for (out, sum) in out.iter_mut().zip(sums) {
            *out += simd.reduce_sum_f64s(sum);
        }
    }
}

/// out = Σ c_k M_k of an even number of matrices whose tiles are in turn.
#[inline(always)]
pub fn combine<S: Simd, T: Sums<S>>(simd: S, tiles: &[f32], factors: &[T::Number], out: &mut [T::Number]) {
    match TILE / T::LANES {
        2 => combined::<S, T, 2>(simd, tiles, factors, out),
        4 => combined::<S, T, 4>(simd, tiles, factors, out),
        8 => combined::<S, T, 8>(simd, tiles, factors, out),
        16 => combined::<S, T, 16>(simd, tiles, factors, out),
        _ => combined::<S, T, 32>(simd, tiles, factors, out),
    }
}

/// With N registers for a tile.
#[inline(always)]
fn combined<S: Simd, T: Sums<S>, const N: usize>(simd: S, tiles: &[f32], factors: &[T::Number], out: &mut [T::Number]) {
    let (tiles, factors) = (tiles.as_chunks::<TILE>().0.as_chunks::<2>().0, factors.as_chunks::<2>().0);
    let out = T::registers(out).as_chunks_mut::<N>().0;
    let apart = usize::from(N <= 4); // a sum waits for the one before, where there are few
    for (tiles, out) in tiles.chunks_exact(factors.len().max(1)).zip(out) {
        let mut sums = [[T::splat(simd, T::Number::default()); N]; 2];
        for (x, factors) in tiles.iter().zip(factors) {
            for k in 0..2 {
                let (own, sums) = (T::splat(simd, factors[k]), &mut sums[k * apart]);
                for r in 0..N {
                    sums[r] = T::multiply_add(simd, T::read(simd, &x[k][r * T::LANES..][..T::LANES]), own, sums[r]);
                }
            }
        }
        for r in 0..N {
            out[r] = T::add(simd, sums[0][r], sums[1][r]);
        }
    }
}

/// The rows of a triangle, and those of a square from the diagonal on.
#[inline(always)]
pub fn rows<'a, T>(
    mut triangle: &'a [T],
    (n, stride): (usize, usize),
    square: &'a mut [f64],
) -> impl Iterator<Item = (&'a [T], &'a mut [f64])> {
    square.chunks_exact_mut(stride).take(n).enumerate().map(move |(i, row)| {
        let (own, others) = triangle.split_at(n - i);
        triangle = others;
        (own, &mut row[i..n])
    })
}

/// out = M q of a square; `q` and `out` have the stride's numbers, the square a multiple of [`ROWS`].
#[inline(always)]
pub fn multiply<S: Simd>(simd: S, square: &[f64], q: &[f64], out: &mut [f64]) {
    let stride = q.len();
    let columns = stride / lanes::<S>();
    let wide = S::as_simd_f64s(q).0;
    out.fill(0.0);
    for (block, rows) in square.chunks_exact(ROWS * stride).enumerate() {
        let i = ROWS * block;
        let (mut own, mut sums) = ([simd.splat_f64s(0.0); ROWS], [simd.splat_f64s(0.0); ROWS]);
        for r in 0..ROWS {
            own[r] = simd.splat_f64s(q[i + r]);
        }
        {
            let (rows, out) = (S::as_simd_f64s(rows).0, S::as_mut_simd_f64s(out).0);
            for c in i / lanes::<S>()..columns {
                let mut sum = out[c];
                for r in 0..ROWS {
                    let x = rows[r * columns + c];
                    sums[r] = simd.mul_add_e_f64s(x, wide[c], sums[r]);
                    sum = simd.mul_add_e_f64s(x, own[r], sum);
                }
                out[c] = sum;
            }
        }
        for r in 0..ROWS {
            out[i + r] += simd.reduce_sum_f64s(sums[r]) - rows[r * stride + i + r] * q[i + r]; // the diagonal was in both
        }
    }
}

/// The Jacobian by rows of a form, and each times its factor; of as many forms as there are factors.
#[inline(always)]
pub fn scale<S: Simd>(simd: S, jacobian: &[f64], factors: &[f64], (m, stride): (usize, usize), out: [&mut [f64]; 2]) {
    let [scaled, rows] = out;
    let blocks = jacobian.as_chunks::<SIDE>().0.chunks_exact(m).zip(rows.chunks_mut(SIDE * stride));
    for (block, rows) in blocks {
        for (c, fields) in block.as_chunks::<ROWS>().0.iter().enumerate() {
            for (k, row) in rows.chunks_exact_mut(stride).enumerate() {
                let own = [fields[0][k], fields[1][k], fields[2][k], fields[3][k]];
                row[ROWS * c..][..ROWS].copy_from_slice(&own);
            }
        }
    }
    let columns = stride / lanes::<S>();
    let (rows, scaled) = (S::as_simd_f64s(rows).0, S::as_mut_simd_f64s(scaled).0);
    for ((to, from), factor) in scaled.chunks_exact_mut(columns).zip(rows.chunks_exact(columns)).zip(factors) {
        let factor = simd.splat_f64s(*factor);
        for (to, from) in to.iter_mut().zip(from) {
            *to = simd.mul_f64s(*from, factor);
        }
    }
}

/// square += LᵀR, from the diagonal on, over rows of forms; the square has a multiple of [`ROWS`].
#[inline(always)]
pub fn add_products<S: Simd>(simd: S, sides: (&[f64], &[f64]), stride: usize, square: &mut [f64]) {
    for (block, own) in square.chunks_exact_mut(ROWS * stride).enumerate() {
        add_outer(simd, sides, own, (ROWS * block, stride));
    }
}
