//! The sums that a polynomial energy is evaluated by, in the processor's widest registers. What an evaluation reads is laid out in the order
//! in which it is read.
//!
//! Symmetric matrices are triangles, row i from the diagonal on, or squares of rows of `stride` numbers that are 0 before the diagonal.

use super::super::MAX_FIELDS;
use super::super::products::WIDTH;
use pulp::Simd;

/// Numbers whose sums are made at once; triangles are padded to it.
pub const TILE: usize = 32;
/// Rows of Q that are read at once; forms' fields are padded to it.
pub const ROWS: usize = 4;
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

/// Which entry of a form's lower triangle, as [`strains`] reads it, (i, j) is, j ≤ i.
pub fn entry(i: usize, j: usize) -> usize {
    let (block, row) = (i / ROWS, i % ROWS);
    let before = block * ROWS;
    let first = before * (before + 1) / 2;
    if j < before { first + j * ROWS + row } else { first + before * ROWS + row * (row + 1) / 2 + j - before }
}

/// Registers that so many numbers fill.
#[inline(always)]
fn registers<S: Simd>(numbers: usize) -> usize {
    numbers * size_of::<f64>() / size_of::<S::f64s>()
}

/// Numbers of a register.
#[inline(always)]
fn lanes<S: Simd>() -> usize {
    size_of::<S::f64s>() / size_of::<f64>()
}

/// J = A + Qq of all forms, and s = (A + ½ Qq)·q, on a multiple of [`ROWS`] fields.
///
/// Of 8 forms that are side by side in turn, `forms` has the lower triangle of Q, `linear` and `jacobian` the fields.
#[inline(always)]
pub fn strains<S: Simd>(simd: S, q: &[f64], forms: &[f64], linear: &[f64], jacobian: &mut [f64], s: &mut [f64]) {
    let sizes = (S::as_simd_f64s(forms).0, S::as_simd_f64s(linear).0);
    let out = (S::as_mut_simd_f64s(jacobian).0, S::as_mut_simd_f64s(s).0);
    match registers::<S>(WIDTH) {
        1 => strained::<S, 1>(simd, q, sizes, out),
        2 => strained::<S, 2>(simd, q, sizes, out),
        4 => strained::<S, 4>(simd, q, sizes, out),
        _ => strained::<S, 8>(simd, q, sizes, out),
    }
}

/// With N registers for the 8 forms that are side by side.
#[inline(always)]
fn strained<S: Simd, const N: usize>(
    simd: S,
    q: &[f64],
    (forms, linear): (&[S::f64s], &[S::f64s]),
    (jacobian, s): (&mut [S::f64s], &mut [S::f64s]),
) {
    let n = q.len();
    let (forms, linear) = (forms.as_chunks::<N>().0, linear.as_chunks::<N>().0);
    let (jacobian, s) = (jacobian.as_chunks_mut::<N>().0, s.as_chunks_mut::<N>().0);
    let sides = linear.chunks_exact(n).zip(jacobian.chunks_exact_mut(n));
    for ((mut rest, (linear, sums)), s) in forms.chunks_exact(n * (n + 1) / 2).zip(sides).zip(s) {
        sums.copy_from_slice(linear);
        for i in (0..n).step_by(ROWS) {
            let (wide, others) = rest.split_at(ROWS * i);
            let (corner, others) = others.split_at(CORNER);
            rest = others;
            for part in 0..N {
                add_rows(simd, q, (wide, corner), part, sums); // one register after the other: more sums find no room
            }
        }
        for part in 0..N {
            let mut twice = simd.splat_f64s(0.0);
            for ((linear, sum), q) in linear.iter().zip(&*sums).zip(q) {
                twice = simd.mul_add_e_f64s(simd.add_f64s(linear[part], sum[part]), simd.splat_f64s(*q), twice);
            }
            s[part] = simd.mul_f64s(twice, simd.splat_f64s(0.5));
        }
    }
}

/// sums += Qq of one register's forms, as far as the rows go whose entries before and at the diagonal these are.
#[inline(always)]
#[allow(clippy::type_complexity)] // said by the names of its parts
fn add_rows<S: Simd, const N: usize>(
    simd: S,
    q: &[f64],
    (wide, corner): (&[[S::f64s; N]], &[[S::f64s; N]]),
    part: usize,
    sums: &mut [[S::f64s; N]],
) {
    let before = wide.len() / ROWS;
    let (head, tail) = sums.split_at_mut(before);
    let own: [S::f64s; ROWS] = std::array::from_fn(|r| simd.splat_f64s(q[before + r]));
    let mut rows: [S::f64s; ROWS] = std::array::from_fn(|r| tail[r][part]);
    for ((column, out), q) in wide.as_chunks::<ROWS>().0.iter().zip(head).zip(q) {
        let (along, mut sum) = (simd.splat_f64s(*q), out[part]);
        for r in 0..ROWS {
            let x = column[r][part];
            rows[r] = simd.mul_add_e_f64s(x, along, rows[r]);
            sum = simd.mul_add_e_f64s(x, own[r], sum);
        }
        out[part] = sum;
    }
    let mut entries = corner.iter();
    for r in 0..ROWS {
        for c in 0..=r {
            let Some(x) = entries.next() else { return };
            rows[r] = simd.mul_add_e_f64s(x[part], own[c], rows[r]);
            if c < r {
                rows[c] = simd.mul_add_e_f64s(x[part], own[r], rows[c]);
            }
        }
    }
    (0..ROWS).for_each(|r| tail[r][part] = rows[r]);
}

/// out_i += Σ J_ik v_k over all forms, with J on `n` fields as [`strains`] gives it.
#[inline(always)]
pub fn add_transposed<S: Simd>(simd: S, jacobian: &[f64], v: &[f64], n: usize, out: &mut [f64]) {
    let (jacobian, v) = (S::as_simd_f64s(jacobian).0, S::as_simd_f64s(v).0);
    let wide = registers::<S>(WIDTH);
    for (i, out) in out.iter_mut().enumerate() {
        let mut sum = simd.splat_f64s(0.0);
        for (lane, v) in v.chunks_exact(wide).enumerate() {
            let own = &jacobian[(lane * n + i) * wide..][..wide];
            own.iter().zip(v).for_each(|(x, v)| sum = simd.mul_add_e_f64s(*x, *v, sum));
        }
        *out += simd.reduce_sum_f64s(sum);
    }
}

/// out += Σ c_k M_k of matrices whose tiles are in turn.
#[inline(always)]
pub fn combine<S: Simd>(simd: S, tiles: &[f64], factors: &[f64], out: &mut [f64]) {
    match registers::<S>(TILE) {
        4 => combined::<S, 4>(simd, tiles, factors, out),
        8 => combined::<S, 8>(simd, tiles, factors, out),
        16 => combined::<S, 16>(simd, tiles, factors, out),
        _ => combined::<S, 32>(simd, tiles, factors, out),
    }
}

#[inline(always)]
fn combined<S: Simd, const N: usize>(simd: S, tiles: &[f64], factors: &[f64], out: &mut [f64]) {
    let tiles = S::as_simd_f64s(tiles).0.as_chunks::<N>().0;
    let out = S::as_mut_simd_f64s(out).0.as_chunks_mut::<N>().0;
    for (tiles, out) in tiles.chunks_exact(factors.len().max(1)).zip(out) {
        let mut sums = *out;
        for (x, factor) in tiles.iter().zip(factors) {
            let own = simd.splat_f64s(*factor);
            (0..N).for_each(|r| sums[r] = simd.mul_add_e_f64s(x[r], own, sums[r]));
        }
        *out = sums;
    }
}

/// The rows of a triangle into a square, whose numbers before the diagonal stay.
#[inline(always)]
pub fn square(triangle: &[f64], (n, stride): (usize, usize), out: &mut [f64]) {
    let mut rest = triangle;
    for (i, row) in out.chunks_exact_mut(stride).enumerate().take(n) {
        let (own, others) = rest.split_at(n - i);
        row[i..n].copy_from_slice(own);
        rest = others;
    }
}

/// out = M q of a square; `q` and `out` have the stride's numbers. Returns qᵀMq.
#[inline(always)]
pub fn multiply<S: Simd>(simd: S, square: &[f64], n: usize, q: &[f64], out: &mut [f64]) -> f64 {
    let stride = q.len();
    out.fill(0.0);
    let mut beyond = [0.0; MAX_FIELDS];
    let (wide, used) = (S::as_simd_f64s(q).0, n.div_ceil(lanes::<S>()));
    {
        let out = S::as_mut_simd_f64s(out).0;
        for (i, row) in square.chunks_exact(stride).enumerate().take(n) {
            let from = i / lanes::<S>();
            let (own, mut sum) = (simd.splat_f64s(q[i]), simd.splat_f64s(0.0));
            let columns = S::as_simd_f64s(row).0[from..used].iter().zip(&wide[from..used]);
            for ((x, q), out) in columns.zip(&mut out[from..used]) {
                sum = simd.mul_add_e_f64s(*x, *q, sum);
                *out = simd.mul_add_e_f64s(*x, own, *out);
            }
            beyond[i] = simd.reduce_sum_f64s(sum) - row[i] * q[i];
        }
    }
    let mut product = 0.0;
    for i in 0..n {
        out[i] += beyond[i];
        product += out[i] * q[i];
    }
    product
}

/// out = c J, forms side by side, and J by rows of a form.
#[inline(always)]
pub fn scale<S: Simd>(simd: S, jacobian: &[f64], factors: &[f64], (m, stride): (usize, usize), out: [&mut [f64]; 2]) {
    let [scaled, rows] = out;
    let wide = registers::<S>(WIDTH);
    let (from, factors) = (S::as_simd_f64s(jacobian).0, S::as_simd_f64s(factors).0);
    let to = S::as_mut_simd_f64s(scaled).0;
    let blocks = from.chunks_exact(m * wide).zip(to.chunks_exact_mut(m * wide)).zip(factors.chunks_exact(wide));
    for ((from, to), factors) in blocks {
        for (from, to) in from.chunks_exact(wide).zip(to.chunks_exact_mut(wide)) {
            for ((to, from), factor) in to.iter_mut().zip(from).zip(factors) {
                *to = simd.mul_f64s(*from, *factor);
            }
        }
    }
    let numbers = jacobian.as_chunks::<WIDTH>().0;
    for (block, rows) in numbers.chunks_exact(m).zip(rows.chunks_exact_mut(WIDTH * stride)) {
        let mut rows = rows.chunks_exact_mut(stride);
        let mut next = || rows.next().unwrap_or_default().iter_mut();
        let (first, second) = (next().zip(next()).zip(next().zip(next())), next().zip(next()).zip(next().zip(next())));
        for (fields, (((a, b), (c, d)), ((e, f), (g, h)))) in block.iter().zip(first.zip(second)) {
            [*a, *b, *c, *d, *e, *f, *g, *h] = *fields;
        }
    }
}

/// square += LᵀR, from the diagonal on, over forms: `left` has them side by side on `m` fields, `right` in rows.
#[inline(always)]
pub fn add_products<S: Simd>(
    simd: S,
    (left, m): (&[f64], usize),
    right: &[f64],
    (n, stride): (usize, usize),
    square: &mut [f64],
) {
    let (left, wide) = (left.as_chunks::<WIDTH>().0, S::as_simd_f64s(right).0);
    let (columns, used) = (registers::<S>(stride), n.div_ceil(lanes::<S>()));
    for i in (0..n).step_by(ROWS) {
        let packed = S::as_mut_simd_f64s(&mut square[i * stride..(i + ROWS).min(n) * stride]).0;
        for a in (i / lanes::<S>()..used).step_by(2) {
            let mut sums = [[simd.splat_f64s(0.0); 2]; ROWS];
            let two = usize::from(a + 1 < used);
            for (left, right) in left.chunks_exact(m).zip(wide.chunks_exact(WIDTH * columns)) {
                let Some(own) = left.get(i..i + ROWS) else { return };
                for (k, right) in right.chunks_exact(columns).enumerate() {
                    let right = [right[a], right[a + two]];
                    for r in 0..ROWS {
                        let own = simd.splat_f64s(own[r][k]);
                        sums[r][0] = simd.mul_add_e_f64s(right[0], own, sums[r][0]);
                        sums[r][1] = simd.mul_add_e_f64s(right[1], own, sums[r][1]);
                    }
                }
            }
            for (row, sums) in packed.chunks_exact_mut(columns).zip(&sums) {
                for c in 0..=two {
                    row[a + c] = simd.add_f64s(row[a + c], sums[c]);
                }
            }
        }
    }
}
