//! The sums that a polynomial energy is evaluated by, in the processor's widest registers. What an evaluation reads is laid out in the order
//! in which it is read. Forms lie side by side as the numbers of 32 bits in the widest register do, [`SIDE`]. Coefficients of second and higher order have 32 bits; sums have 64, or 32 where a Newton step needs no more.
//!
//! Of symmetric matrices there are the blocks of [`ROWS`] × [`ROWS`] numbers at and behind the diagonal, row of blocks by row, each by rows and
//! those at the diagonal whole; or the rows of a square of `stride` numbers, where what is before the diagonal has no meaning.
//!
//! Loops stand where closures would do: those that reach a function of the standard library lose the wide registers.
#![allow(clippy::needless_range_loop)] // registers are unrolled by number

use super::super::factor::SIDE;
use super::super::outer::add_outer;
use super::super::sums::{Single, Sums};
use pulp::{Simd, bytemuck};

/// Numbers whose sums are made at once; symmetric matrices are padded to it.
pub const TILE: usize = 32;
/// Rows that are read at once; forms' fields are padded to it.
pub const ROWS: usize = super::super::outer::ROWS;
/// Numbers of a block.
pub const BLOCK: usize = ROWS * ROWS;
/// Entries of such rows at the diagonal.
const CORNER: usize = ROWS * (ROWS + 1) / 2;

/// Where entry (i, j), i ≤ j or both of one block, of a symmetric matrix is.
pub fn at(i: usize, j: usize, n: usize) -> usize {
    let (row, column, count) = (i / ROWS, j / ROWS, n.div_ceil(ROWS));
    (row * (2 * count - row + 1) / 2 + column - row) * BLOCK + i % ROWS * ROWS + j % ROWS
}

/// Numbers of it, padded to tiles.
pub fn size(n: usize) -> usize {
    let count = n.div_ceil(ROWS);
    (count * (count + 1) / 2 * BLOCK).next_multiple_of(TILE)
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

/// Two numbers in one: the second as the 32 bits are, so that the first, its lower half, is in its last places, and the first by its upper half.
pub fn paired(first: f32, second: f32) -> u32 {
    const LIMIT: u64 = f32::MAX.to_bits() as u64;
    let sign = |x: f32| x.to_bits() & !(i32::MAX as u32);
    let nearest = |x: f32, low: u32| {
        let size = u64::from(x.abs().to_bits());
        let upper = (size + 0x8000).saturating_sub(u64::from(low)).min(LIMIT) >> 16;
        (upper << 16) as u32 | low
    };
    let low = (nearest(first, 0) | sign(first)) >> 16;
    nearest(second, low) | sign(second)
}

/// out += Σ c_k M_k of pairs of matrices whose numbers are [`paired`], and whose tiles are in turn.
#[inline(always)]
pub fn add_pairs<S: Simd>(simd: S, tiles: &[u32], factors: &[f32], out: &mut [f32]) {
    match TILE / <Single as Sums<S>>::LANES {
        2 => added_pairs::<S, 2>(simd, tiles, factors, out),
        4 => added_pairs::<S, 4>(simd, tiles, factors, out),
        8 => added_pairs::<S, 8>(simd, tiles, factors, out),
        16 => added_pairs::<S, 16>(simd, tiles, factors, out),
        _ => added_pairs::<S, 32>(simd, tiles, factors, out),
    }
}

/// With N registers for a tile.
#[inline(always)]
fn added_pairs<S: Simd, const N: usize>(simd: S, tiles: &[u32], factors: &[f32], out: &mut [f32]) {
    let (tiles, factors) = (S::as_simd_u32s(tiles).0.as_chunks::<N>().0, factors.as_chunks::<2>().0);
    let (out, half) = (S::as_mut_simd_f32s(out).0.as_chunks_mut::<N>().0, simd.splat_u32s(16));
    let apart = usize::from(N <= 4); // a sum waits for the one before, where there are few
    for (tiles, out) in tiles.chunks_exact(factors.len().max(1)).zip(out) {
        let mut sums = [*out, [simd.splat_f32s(0.0); N]];
        for (pairs, factors) in tiles.iter().zip(factors) {
            let [first, second] = [simd.splat_f32s(factors[0]), simd.splat_f32s(factors[1])];
            for r in 0..N {
                let low = bytemuck::cast(simd.wrapping_dyn_shl_u32s(pairs[r], half));
                sums[0][r] = simd.mul_add_e_f32s(low, first, sums[0][r]);
                sums[apart][r] = simd.mul_add_e_f32s(bytemuck::cast(pairs[r]), second, sums[apart][r]);
            }
        }
        for r in 0..N {
            out[r] = simd.add_f32s(sums[0][r], sums[1][r]);
        }
    }
}

/// q for products with blocks: each block of numbers again and again, and each number.
#[inline(always)]
pub fn spread<N: Copy>(q: &[N], [tiled, repeated]: [&mut [N]; 2]) {
    let both = tiled.as_chunks_mut::<ROWS>().0.as_chunks_mut::<ROWS>().0.iter_mut();
    let both = both.zip(repeated.as_chunks_mut::<ROWS>().0.as_chunks_mut::<ROWS>().0);
    for (q, (tiled, repeated)) in q.as_chunks::<ROWS>().0.iter().zip(both) {
        *tiled = [*q; ROWS];
        *repeated = [[q[0]; ROWS], [q[1]; ROWS], [q[2]; ROWS], [q[3]; ROWS]];
    }
}

/// out = M q of a symmetric matrix, with q as [`spread`] gives it, and room for as many sums.
#[inline(always)]
pub fn multiply<S: Simd, T: Sums<S>>(
    simd: S,
    blocks: &[T::Number],
    [tiled, repeated]: [&[T::Number]; 2],
    [along, across]: [&mut [T::Number]; 2],
    out: &mut [T::Number],
) {
    match BLOCK / T::LANES {
        1 => multiplied::<S, T, 1>(simd, blocks, [tiled, repeated], [along, across]),
        2 => multiplied::<S, T, 2>(simd, blocks, [tiled, repeated], [along, across]),
        4 => multiplied::<S, T, 4>(simd, blocks, [tiled, repeated], [along, across]),
        8 => multiplied::<S, T, 8>(simd, blocks, [tiled, repeated], [along, across]),
        _ => multiplied::<S, T, 16>(simd, blocks, [tiled, repeated], [along, across]),
    }
    let sums = along.as_chunks::<ROWS>().0.as_chunks::<ROWS>().0.iter();
    let sums = sums.zip(across.as_chunks::<ROWS>().0.as_chunks::<ROWS>().0);
    for (out, (along, across)) in out.as_chunks_mut::<ROWS>().0.iter_mut().zip(sums) {
        let ([a, b, c, d], [e, f, g, h]) = (transposed(along), *across);
        for r in 0..ROWS {
            let along = T::sum([T::sum([a[r], b[r]]), T::sum([c[r], d[r]])]);
            let across = T::sum([T::sum([e[r], f[r]]), T::sum([g[r], h[r]])]);
            out[r] = T::sum([along, across]);
        }
    }
}

/// With N registers for a block: sums along each row of blocks' rows, and across those of each column's.
#[inline(always)]
fn multiplied<S: Simd, T: Sums<S>, const N: usize>(
    simd: S,
    blocks: &[T::Number],
    [tiled, repeated]: [&[T::Number]; 2],
    [along, across]: [&mut [T::Number]; 2],
) {
    let (mut blocks, tiled, repeated) =
        (T::view(blocks).as_chunks::<N>().0, T::view(tiled).as_chunks::<N>().0, T::view(repeated).as_chunks::<N>().0);
    let (along, across) = (T::registers(along).as_chunks_mut::<N>().0, T::registers(across).as_chunks_mut::<N>().0);
    for (b, along) in along.iter_mut().enumerate() {
        let (own, others) = blocks.split_at(tiled.len() - b);
        blocks = others;
        let zero = T::splat(simd, T::Number::default());
        let mut sums = [zero; N];
        for r in 0..N {
            sums[r] = T::multiply(simd, own[0][r], tiled[b][r]);
        }
        if b == 0 {
            across[0] = [zero; N];
        }
        for ((x, tiled), across) in own[1..].iter().zip(&tiled[b + 1..]).zip(&mut across[b + 1..]) {
            for r in 0..N {
                sums[r] = T::multiply_add(simd, x[r], tiled[r], sums[r]);
                let before = if b == 0 { zero } else { across[r] };
                across[r] = T::multiply_add(simd, x[r], repeated[b][r], before);
            }
        }
        *along = sums;
    }
}

/// Columns for rows.
#[inline(always)]
fn transposed<N: Copy>([a, b, c, d]: &[[N; ROWS]; ROWS]) -> [[N; ROWS]; ROWS] {
    [[a[0], b[0], c[0], d[0]], [a[1], b[1], c[1], d[1]], [a[2], b[2], c[2], d[2]], [a[3], b[3], c[3], d[3]]]
}

/// The rows of a square, from the block at the diagonal on, of so many fields; zeros behind them. Their first number is at `first`.
#[inline(always)]
pub fn unpack<N: Copy + Default>(blocks: &[N], n: usize, (stride, first): (usize, usize), rows: &mut [N]) {
    let mut blocks = blocks.as_chunks::<ROWS>().0.as_chunks::<ROWS>().0;
    let count = n.div_ceil(ROWS);
    for (b, rows) in rows.chunks_exact_mut(ROWS * stride).enumerate().take(count) {
        let (own, others) = blocks.split_at(count - b);
        blocks = others;
        for (r, row) in rows.chunks_exact_mut(stride).enumerate() {
            let (row, behind) = row.as_chunks_mut::<ROWS>().0[first / ROWS + b..].split_at_mut(own.len());
            for (out, block) in row.iter_mut().zip(own) {
                *out = block[r];
            }
            for out in behind {
                *out = [N::default(); ROWS];
            }
        }
    }
}

/// What lies by fields, of forms side by side, by rows of a form, whose first number is at `first`; there are rows for all that are side by side.
#[inline(always)]
pub fn by_forms<N: Copy>(fields: &[N], (m, stride, first): (usize, usize, usize), rows: &mut [N]) {
    for (block, rows) in fields.as_chunks::<SIDE>().0.chunks_exact(m).zip(rows.chunks_exact_mut(SIDE * stride)) {
        for k in 0..SIDE / ROWS {
            let (a, others) = rows[k * ROWS * stride..][..ROWS * stride].split_at_mut(stride);
            let (b, others) = others.split_at_mut(stride);
            let (c, d) = others.split_at_mut(stride);
            let a = a[first..].as_chunks_mut::<ROWS>().0.iter_mut();
            let rows = a.zip(b[first..].as_chunks_mut::<ROWS>().0).zip(c[first..].as_chunks_mut::<ROWS>().0);
            let rows = rows.zip(d[first..].as_chunks_mut::<ROWS>().0);
            for (x, (((a, b), c), d)) in block.as_chunks::<ROWS>().0.iter().zip(rows) {
                let quads =
                    [x[0].as_chunks().0[k], x[1].as_chunks().0[k], x[2].as_chunks().0[k], x[3].as_chunks().0[k]];
                [*a, *b, *c, *d] = transposed(&quads);
            }
        }
    }
}

/// Rows of forms, and each times its factor.
#[inline(always)]
pub fn scale<S: Simd, T: Sums<S>>(
    simd: S,
    rows: &[T::Number],
    factors: &[T::Number],
    stride: usize,
    scaled: &mut [T::Number],
) {
    let columns = stride / T::LANES;
    let (rows, scaled) = (T::view(rows), T::registers(scaled));
    for ((to, from), factor) in scaled.chunks_exact_mut(columns).zip(rows.chunks_exact(columns)).zip(factors) {
        let factor = T::splat(simd, *factor);
        for (to, from) in to.iter_mut().zip(from) {
            *to = T::multiply(simd, *from, factor);
        }
    }
}

/// a += b.
#[inline(always)]
pub fn add<S: Simd, T: Sums<S>>(simd: S, a: &mut [T::Number], b: &[T::Number]) {
    for (a, b) in T::registers(a).iter_mut().zip(T::view(b)) {
        *a = T::add(simd, *a, *b);
    }
}

/// square += LᵀR, from the diagonal on, over rows of forms whose first number is at `first`; the square has a multiple of [`ROWS`].
#[inline(always)]
pub fn add_products<S: Simd, T: Sums<S>>(
    simd: S,
    sides: (&[T::Number], &[T::Number]),
    (stride, first): (usize, usize),
    square: &mut [T::Number],
) {
    for (block, own) in square.chunks_exact_mut(ROWS * stride).enumerate() {
        add_outer::<S, T>(simd, sides, own, (first + ROWS * block, stride));
    }
}
