//! The sums that a polynomial energy is evaluated by, in the processor's widest registers.
//!
//! Symmetric matrices are packed: row i has the columns from ⌊i/8⌋·8 to the stride, what is left of the diagonal is 0.

use super::super::MAX_FIELDS;
use super::super::products::WIDTH;
use pulp::Simd;

/// Where row `i` of a packed matrix begins; that of the row past the last is its size.
pub fn start(i: usize, stride: usize) -> usize {
    let (blocks, rest) = (i / WIDTH, i % WIDTH);
    // Σ over whole blocks of 8 rows of (stride − 8 block), and the rows of the last.
    WIDTH * (blocks * stride - WIDTH * (blocks * blocks.saturating_sub(1) / 2)) + rest * (stride - WIDTH * blocks)
}

/// Where entry (i, j), i ≤ j, of a packed matrix is.
pub fn at(i: usize, j: usize, stride: usize) -> usize {
    start(i, stride) + j - i / WIDTH * WIDTH
}

/// Registers that so many numbers fill.
#[inline(always)]
fn registers<S: Simd>(numbers: usize) -> usize {
    numbers * size_of::<f64>() / size_of::<S::f64s>()
}

/// Rows J = A + Qq of all forms, field by field, and s = (A + ½ Qq)·q.
///
/// `forms` are the lower triangles of Q, 8 forms side by side; `linear` and `jacobian` have a row of all forms for each field.
#[inline(always)]
pub fn strains<S: Simd>(simd: S, q: &[f64], forms: &[f64], linear: &[f64], jacobian: &mut [f64], s: &mut [f64]) {
    let sizes = (S::as_simd_f64s(forms).0, S::as_simd_f64s(linear).0);
    match registers::<S>(WIDTH) {
        1 => strained::<S, 1>(simd, q, sizes, jacobian, s),
        2 => strained::<S, 2>(simd, q, sizes, jacobian, s),
        4 => strained::<S, 4>(simd, q, sizes, jacobian, s),
        _ => strained::<S, 8>(simd, q, sizes, jacobian, s),
    }
}

/// With N registers for the 8 forms that are side by side.
#[inline(always)]
fn strained<S: Simd, const N: usize>(
    simd: S,
    q: &[f64],
    (forms, linear): (&[S::f64s], &[S::f64s]),
    jacobian: &mut [f64],
    s: &mut [f64],
) {
    let n = q.len();
    let zero = [simd.splat_f64s(0.0); N];
    let jacobian = S::as_mut_simd_f64s(jacobian).0;
    let s = S::as_mut_simd_f64s(s).0;
    let across = s.len();
    let (lines, _) = forms.as_chunks::<N>();
    let add = |sum: &mut [S::f64s; N], x: &[S::f64s; N], factor: S::f64s| {
        (0..N).for_each(|r| sum[r] = simd.mul_add_e_f64s(x[r], factor, sum[r]));
    };
    let mut room = [zero; MAX_FIELDS];
    for (lane, lines) in lines.chunks_exact(n * (n + 1) / 2).enumerate() {
        let of = |i: usize| i * across + lane * N;
        let sums = &mut room[..n];
        (0..n).for_each(|i| sums[i].copy_from_slice(&linear[of(i)..][..N]));
        let mut i = 0;
        while i + 2 <= n {
            let (head, tail) = sums.split_at_mut(i);
            let first = i * (i + 1) / 2;
            let (upper, lower) = lines[first..first + 2 * i + 3].split_at(i + 1);
            let own = [simd.splat_f64s(q[i]), simd.splat_f64s(q[i + 1])];
            let mut rows = [tail[0], tail[1]];
            for (((x, y), sum), q) in upper.iter().zip(lower).zip(head).zip(q) {
                let along = simd.splat_f64s(*q);
                add(&mut rows[0], x, along);
                add(&mut rows[1], y, along);
                add(sum, x, own[0]);
                add(sum, y, own[1]);
            }
            add(&mut rows[0], &upper[i], own[0]);
            add(&mut rows[0], &lower[i], own[1]);
            add(&mut rows[1], &lower[i], own[0]);
            add(&mut rows[1], &lower[i + 1], own[1]);
            tail[..2].copy_from_slice(&rows);
            i += 2;
        }
        if i < n {
            let (head, tail) = sums.split_at_mut(i);
            let row = &lines[i * (i + 1) / 2..];
            let own = simd.splat_f64s(q[i]);
            for ((x, sum), q) in row.iter().zip(head).zip(q) {
                add(&mut tail[0], x, simd.splat_f64s(*q));
                add(sum, x, own);
            }
            add(&mut tail[0], &row[i], own);
        }
        let mut twice = zero;
        for i in 0..n {
            let own = simd.splat_f64s(q[i]);
            for r in 0..N {
                let mean = simd.add_f64s(linear[of(i) + r], sums[i][r]);
                twice[r] = simd.mul_add_e_f64s(mean, own, twice[r]);
                jacobian[of(i) + r] = sums[i][r];
            }
        }
        (0..N).for_each(|r| s[lane * N + r] = simd.mul_f64s(twice[r], simd.splat_f64s(0.5)));
    }
}

/// out += Σ c_k M_k of packed matrices in turn.
#[inline(always)]
pub fn combine<S: Simd>(simd: S, matrices: &[f64], factors: &[f64], out: &mut [f64]) {
    let out = S::as_mut_simd_f64s(out).0;
    let matrices = S::as_simd_f64s(matrices).0;
    let size = out.len();
    let mut k = 0;
    while k + 4 <= factors.len() {
        let own: [S::f64s; 4] = std::array::from_fn(|m| simd.splat_f64s(factors[k + m]));
        let (first, rest) = matrices[k * size..(k + 4) * size].split_at(size);
        let (second, rest) = rest.split_at(size);
        let (third, fourth) = rest.split_at(size);
        for ((((out, a), b), c), d) in out.iter_mut().zip(first).zip(second).zip(third).zip(fourth) {
            let sum = simd.mul_add_e_f64s(*b, own[1], simd.mul_add_e_f64s(*a, own[0], *out));
            *out = simd.mul_add_e_f64s(*d, own[3], simd.mul_add_e_f64s(*c, own[2], sum));
        }
        k += 4;
    }
    for k in k..factors.len() {
        let own = simd.splat_f64s(factors[k]);
        for (out, m) in out.iter_mut().zip(&matrices[k * size..]) {
            *out = simd.mul_add_e_f64s(*m, own, *out);
        }
    }
}

/// out = M q of a packed matrix; `q` and `out` have the stride's numbers. Returns qᵀMq.
#[inline(always)]
pub fn multiply<S: Simd>(simd: S, matrix: &[f64], n: usize, q: &[f64], out: &mut [f64]) -> f64 {
    let (stride, mut first) = (q.len(), 0);
    out.fill(0.0);
    let mut beyond = [0.0; MAX_FIELDS];
    let wide = S::as_simd_f64s(q).0;
    {
        let out = S::as_mut_simd_f64s(out).0;
        for i in 0..n {
            let from = i / WIDTH * WIDTH;
            let row = S::as_simd_f64s(&matrix[first..first + stride - from]).0;
            let (own, mut sum) = (simd.splat_f64s(q[i]), simd.splat_f64s(0.0));
            let skipped = registers::<S>(from);
            for ((x, q), out) in row.iter().zip(&wide[skipped..]).zip(&mut out[skipped..]) {
                sum = simd.mul_add_e_f64s(*x, *q, sum);
                *out = simd.mul_add_e_f64s(*x, own, *out);
            }
            beyond[i] = simd.reduce_sum_f64s(sum) - matrix[first + i - from] * q[i];
            first += stride - from;
        }
    }
    let mut square = 0.0;
    for i in 0..n {
        out[i] += beyond[i];
        square += out[i] * q[i];
    }
    square
}

/// packed += LᵀR with rows of `stride` numbers.
#[inline(always)]
pub fn add_products<S: Simd>(simd: S, left: &[f64], right: &[f64], (n, stride): (usize, usize), packed: &mut [f64]) {
    let wide = S::as_simd_f64s(right).0;
    let columns = registers::<S>(stride);
    let mut first = 0;
    for i in (0..n).step_by(4) {
        let (from, rows) = (i / WIDTH * WIDTH, 4.min(n - i));
        let length = stride - from;
        let (skipped, regs) = (registers::<S>(from), registers::<S>(length));
        let packed = S::as_mut_simd_f64s(&mut packed[first..first + rows * length]).0;
        for a in (0..regs).step_by(2) {
            let mut sums = [[simd.splat_f64s(0.0); 2]; 4];
            let two = usize::from(a + 1 < regs);
            for (left, right) in left.chunks_exact(stride).zip(wide.chunks_exact(columns)) {
                let right = [right[skipped + a], right[skipped + a + two]];
                for (row, sums) in sums.iter_mut().enumerate() {
                    let own = simd.splat_f64s(left[i + row]); // rows are padded to a multiple of 8
                    sums[0] = simd.mul_add_e_f64s(right[0], own, sums[0]);
                    sums[1] = simd.mul_add_e_f64s(right[1], own, sums[1]);
                }
            }
            for (row, sums) in sums[..rows].iter().enumerate() {
                for c in 0..=two {
                    let out = &mut packed[row * regs + a + c];
                    *out = simd.add_f64s(*out, sums[c]);
                }
            }
        }
        first += rows * length;
    }
}
