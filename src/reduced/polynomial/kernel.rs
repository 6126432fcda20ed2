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

/// J = A + Qq of all forms, and s = (A + ½ Qq)·q.
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

/// Rows of Q that are read at once.
const ROWS: usize = 4;

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
    for ((forms, (linear, sums)), s) in forms.chunks_exact(n * (n + 1) / 2).zip(sides).zip(s) {
        sums.copy_from_slice(linear);
        for part in 0..N {
            add_rows(simd, q, forms, part, sums); // one register after the other: more sums find no room
            let mut twice = simd.splat_f64s(0.0);
            for ((linear, sum), q) in linear.iter().zip(&*sums).zip(q) {
                twice = simd.mul_add_e_f64s(simd.add_f64s(linear[part], sum[part]), simd.splat_f64s(*q), twice);
            }
            s[part] = simd.mul_f64s(twice, simd.splat_f64s(0.5));
        }
    }
}

/// sums += Qq of one register's forms.
#[inline(always)]
fn add_rows<S: Simd, const N: usize>(
    simd: S,
    q: &[f64],
    forms: &[[S::f64s; N]],
    part: usize,
    sums: &mut [[S::f64s; N]],
) {
    let (n, mut rest) = (q.len(), forms);
    let whole = n - n % ROWS;
    for i in (0..whole).step_by(ROWS) {
        let (head, tail) = sums.split_at_mut(i);
        let own: [S::f64s; ROWS] = std::array::from_fn(|r| simd.splat_f64s(q[i + r]));
        let mut lines = [rest; ROWS];
        for (r, line) in lines.iter_mut().enumerate() {
            (*line, rest) = rest.split_at(i + r + 1);
        }
        let mut rows: [S::f64s; ROWS] = std::array::from_fn(|r| tail[r][part]);
        let [a, b, c, d] = lines.map(|line| &line[..i]);
        for (((((a, b), c), d), out), q) in a.iter().zip(b).zip(c).zip(d).zip(head).zip(q) {
            let (along, mut sum) = (simd.splat_f64s(*q), out[part]);
            for (r, x) in [a[part], b[part], c[part], d[part]].into_iter().enumerate() {
                rows[r] = simd.mul_add_e_f64s(x, along, rows[r]);
                sum = simd.mul_add_e_f64s(x, own[r], sum);
            }
            out[part] = sum;
        }
        for r in 0..ROWS {
            for c in 0..r {
                let x = lines[r][i + c][part];
                rows[r] = simd.mul_add_e_f64s(x, own[c], rows[r]);
                rows[c] = simd.mul_add_e_f64s(x, own[r], rows[c]);
            }
            rows[r] = simd.mul_add_e_f64s(lines[r][i + r][part], own[r], rows[r]);
        }
        (0..ROWS).for_each(|r| tail[r][part] = rows[r]);
    }
    for i in whole..n {
        let (head, tail) = sums.split_at_mut(i);
        let (own, mut row) = (simd.splat_f64s(q[i]), tail[0][part]);
        let (line, others) = rest.split_at(i + 1);
        rest = others;
        for ((x, out), q) in line.iter().zip(head).zip(q) {
            row = simd.mul_add_e_f64s(x[part], simd.splat_f64s(*q), row);
            out[part] = simd.mul_add_e_f64s(x[part], own, out[part]);
        }
        tail[0][part] = simd.mul_add_e_f64s(line[i][part], own, row);
    }
}

/// out_i += Σ J_ik v_k over all forms, with J as [`strains`] gives it.
#[inline(always)]
pub fn add_transposed<S: Simd>(simd: S, jacobian: &[f64], v: &[f64], n: usize, out: &mut [f64]) {
    let (jacobian, v) = (S::as_simd_f64s(jacobian).0, S::as_simd_f64s(v).0);
    let wide = registers::<S>(WIDTH);
    for (i, out) in out[..n].iter_mut().enumerate() {
        let mut sum = simd.splat_f64s(0.0);
        for (lane, v) in v.chunks_exact(wide).enumerate() {
            let own = &jacobian[(lane * n + i) * wide..][..wide];
            own.iter().zip(v).for_each(|(x, v)| sum = simd.mul_add_e_f64s(*x, *v, sum));
        }
        *out += simd.reduce_sum_f64s(sum);
    }
}

/// Matrices whose sum is made at once.
const MATRICES: usize = 8;

/// out += Σ c_k M_k of packed matrices in turn.
#[inline(always)]
pub fn combine<S: Simd>(simd: S, matrices: &[f64], factors: &[f64], out: &mut [f64]) {
    let out = S::as_mut_simd_f64s(out).0;
    let matrices = S::as_simd_f64s(matrices).0;
    let size = out.len();
    let groups = factors.chunks_exact(MATRICES);
    let others = groups.remainder();
    for (factors, matrices) in groups.clone().zip(matrices.chunks_exact((MATRICES * size).max(1))) {
        let own: [S::f64s; MATRICES] = std::array::from_fn(|m| simd.splat_f64s(factors[m]));
        let all: [&[S::f64s]; MATRICES] = std::array::from_fn(|m| &matrices[m * size..][..size]);
        let [a, b, c, d, e, f, g, h] = all;
        let [first, second] = [a.iter().zip(b).zip(c).zip(d), e.iter().zip(f).zip(g).zip(h)];
        for ((out, (((a, b), c), d)), (((e, f), g), h)) in out.iter_mut().zip(first).zip(second) {
            let mut sum = *out;
            for (m, x) in [a, b, c, d, e, f, g, h].into_iter().enumerate() {
                sum = simd.mul_add_e_f64s(*x, own[m], sum);
            }
            *out = sum;
        }
    }
    let first = factors.len() - others.len();
    for (factor, matrix) in others.iter().zip(matrices[first * size..].chunks_exact(size.max(1))) {
        let own = simd.splat_f64s(*factor);
        out.iter_mut().zip(matrix).for_each(|(out, m)| *out = simd.mul_add_e_f64s(*m, own, *out));
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
