//! Evaluation of a polynomial energy: what is known of a q, made when it is first asked for.

use super::super::aligned::Aligned;
use super::super::factor::{Rows, SIDE};
use super::super::sums::{Double, Single};
use super::engineering::{self, Engineering, LEADING, Matrix, Strained};
use super::{PolynomialEnergy, even, kernel, near};
use pulp::{Simd, WithSimd};

/// Room, so that evaluation does not allocate, and what is known of the last q.
#[derive(Clone)]
pub struct Room {
    /// q, padded; no numbers before the first. How many there were, and whether sums of the last have 32 bits.
    q: Aligned<f64>,
    shapes: usize,
    single: bool,
    /// Of it: E, once it was asked for, and its gradient; s, dE/ds and d²E/ds², and ∂s/∂q by field.
    value: Option<f64>,
    gradient: Aligned<f64>,
    s: Aligned<f64>,
    stress: Aligned<f64>,
    curvature: Aligned<f64>,
    /// Of the first forms, where they count by engineering strains.
    strained: Strained,
    jacobian: Aligned<f64>,
    /// C₂ + ½ C₃q, its product with q and that of C₂ alone.
    bending: Aligned<f64>,
    bent: Aligned<f64>,
    product: Aligned<f64>,
    /// q and sums for products.
    spread: [Aligned<f64>; 2],
    sums: [Aligned<f64>; 2],
    /// A Hessian but for JᵀWJ, and as a square; ∂s/∂q by form, with factors and without.
    blocks: Aligned<f64>,
    square: Aligned<f64>,
    scaled: Aligned<f64>,
    rows: Aligned<f64>,
    narrow: Narrow,
}

/// The same in 32 bits: Qq of each form in the place of ∂s/∂q, and of bending C₃q alone.
#[derive(Clone)]
struct Narrow {
    /// q as rows of forms are placed, in 64 bits as well.
    q: Aligned<f32>,
    wide: Aligned<f64>,
    stress: Aligned<f32>,
    curvature: Aligned<f32>,
    /// Qq of the forms that are side by side, and by rows of a form: of the last ones, and of all once there is a Hessian.
    turned: Aligned<f32>,
    by_form: Aligned<f32>,
    /// Σ σA and Σ σQq.
    straight: Aligned<f64>,
    curved: Aligned<f32>,
    /// C₃q and its product with q, and the Hessian but for JᵀWJ.
    bending: Aligned<f32>,
    product: Aligned<f32>,
    blocks: Aligned<f32>,
    spread: [Aligned<f32>; 2],
    sums: [Aligned<f32>; 2],
    /// By rows of a form, ∂s/∂q times its factor, once there is a Hessian: then `by_form` is ∂s/∂q.
    scaled: Aligned<f32>,
    joined: bool,
}

impl Narrow {
    fn of(energy: &PolynomialEnergy) -> Self {
        let PolynomialEnergy { padded, forms, narrow, .. } = energy;
        let stride = narrow.stride;
        let zeros = Aligned::zeros;
        Self {
            q: zeros(stride),
            wide: Aligned::zeros(stride),
            stress: zeros(*forms),
            curvature: zeros(*forms),
            turned: zeros(padded * forms),
            by_form: zeros(energy.count.next_multiple_of(SIDE) * stride),
            straight: Aligned::zeros(stride),
            curved: zeros(stride),
            bending: zeros(narrow.bending.len()),
            product: zeros(stride),
            blocks: zeros(narrow.bending.len()),
            spread: [padded * kernel::ROWS; 2].map(zeros),
            sums: [padded * kernel::ROWS; 2].map(zeros),
            scaled: zeros(narrow.linear.len()),
            joined: false,
        }
    }
}

impl Room {
    /// For one evaluation at a time.
    pub(super) fn of(energy: &PolynomialEnergy) -> Self {
        let (n, stride, padded, forms) = (energy.n, energy.stride, energy.padded, energy.forms);
        let [fields, by_form, by_both] = [stride, forms, padded * forms].map(Aligned::zeros);
        let [blocks, square, spread] =
            [energy.stiffness.len(), padded * stride, padded * kernel::ROWS].map(Aligned::zeros);
        Self {
            q: (0..stride).map(|k| if k < n { f64::NAN } else { 0.0 }).collect::<Vec<f64>>().into(),
            shapes: 0,
            single: false,
            value: None,
            gradient: fields.clone(),
            s: by_form.clone(),
            stress: by_form.clone(),
            curvature: by_form,
            strained: Strained::none(),
            jacobian: by_both,
            bending: blocks.clone(),
            bent: fields.clone(),
            product: fields,
            spread: [spread.clone(), spread.clone()],
            sums: [spread.clone(), spread],
            blocks,
            square,
            scaled: Aligned::zeros(energy.count * stride),
            rows: Aligned::zeros(forms * stride),
            narrow: Narrow::of(energy),
        }
    }

    /// How many q there were since this was asked last.
    pub fn take_shapes(&mut self) -> usize {
        std::mem::take(&mut self.shapes)
    }

    /// Moves to a q, with sums of 64 bits, or `near` it with those of 32.
    #[inline]
    pub(super) fn place(&mut self, energy: &PolynomialEnergy, q: &[f64], near: bool) {
        if self.single == near && self.q[..energy.n] == *q {
            return;
        }
        self.q[..energy.n].copy_from_slice(q);
        self.shapes += 1;
        self.value = None;
        self.single = near;
        if near {
            energy.arch.dispatch(PlaceNear { energy, room: self });
        } else {
            energy.arch.dispatch(Place { energy, room: self });
        }
    }

    pub(super) fn value(&mut self, energy: &PolynomialEnergy) -> f64 {
        if let Some(value) = self.value {
            return value;
        }
        let value = energy.arch.dispatch(Value { energy, room: self });
        self.value = Some(value);
        value
    }

    /// Of the energy, what the first so many forms have.
    pub(super) fn resisted(&self, energy: &PolynomialEnergy, forms: usize) -> f64 {
        let first = if energy.engineering.is_some() { LEADING.min(forms) } else { 0 };
        let others = (first..forms).map(|k| resist(energy.weights[k], energy.bounds[k], self.s[k])[0]);
        self.strained.energy + others.sum::<f64>()
    }

    pub(super) fn gradient(&self, n: usize) -> &[f64] {
        &self.gradient[..n]
    }

    /// The Hessian as a square, from the diagonal on.
    pub(super) fn hessian(&mut self, energy: &PolynomialEnergy) -> &[f64] {
        energy.arch.dispatch(Hessian { energy, room: self });
        &self.square
    }

    /// The Hessian in 32 bits, near a q.
    pub(super) fn near_hessian(&mut self, energy: &PolynomialEnergy, out: Rows) {
        energy.arch.dispatch(NearHessian { energy, room: self, out });
    }

    /// Σ w ∇s∇sᵀ over the membrane's forms and what bending resists with.
    pub(super) fn resistance(&mut self, energy: &PolynomialEnergy, bending: &[f64]) -> &[f64] {
        energy.arch.dispatch(Resistance { energy, bending, room: self });
        &self.square
    }
}

/// φ-weighted: E, dE/ds and d²E/ds² of ½ w φ(s), with 1/S² given.
#[inline(always)]
fn resist(weight: f64, bound: f64, s: f64) -> [f64; 3] {
    let ratio = bound * s * s;
    let share = 1.0 / (1.0 + ratio);
    let force = weight * s * share;
    [0.5 * s * force, force * share, weight * (1.0 - 3.0 * ratio) * share * share * share]
}

struct Place<'a> {
    energy: &'a PolynomialEnergy,
    room: &'a mut Room,
}

/// dE/ds and d²E/ds² of all forms. Where the first count by engineering strains, `strained` knows theirs.
#[inline(always)]
fn resist_all(
    energy: &PolynomialEnergy,
    s: &[f64],
    (stress, curvature): (&mut [f64], &mut [f64]),
    strained: &mut Strained,
) {
    let both = stress.iter_mut().zip(curvature).zip(s);
    for (((stress, curvature), s), (weight, bound)) in both.zip(energy.weights.iter().zip(&energy.bounds)) {
        [_, *stress, *curvature] = resist(*weight, *bound, *s);
    }
    if let Some(engineering) = &energy.engineering {
        strain(engineering, (s, &energy.weights), (stress, strained));
    }
}

/// Apart from the sums, whose registers it does not need.
#[inline(never)]
fn strain(engineering: &Engineering, (s, weights): (&[f64], &[f64]), (stress, strained): (&mut [f64], &mut Strained)) {
    *strained = engineering.at(s, weights);
    stress[..LEADING].copy_from_slice(strained.stress.as_slice());
}

/// A matrix of the first forms by rows.
fn by_rows<N: Copy>(matrix: &Matrix, number: impl Fn(f64) -> N) -> [[N; LEADING]; LEADING] {
    std::array::from_fn(|i| std::array::from_fn(|j| number(matrix[(i, j)])))
}

impl WithSimd for Place<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { energy, room } = self;
        let Room { q, gradient, s, stress, curvature, strained, jacobian, bending, bent, product, .. } = room;
        let Room { spread: [tiled, repeated], sums: [along, across], .. } = room;
        let (n, padded, count) = (energy.n, energy.padded, even(energy.n));
        kernel::turn::<S, Double>(simd, &q[..padded], &energy.lanes, jacobian);
        kernel::strains(simd, &q[..padded], &energy.linear, jacobian, s);
        resist_all(energy, s, (stress, curvature), strained);
        kernel::combine::<S, Double>(simd, &energy.cubic, &q[..count], bending);
        bending.iter_mut().zip(&energy.bending).for_each(|(sum, base)| *sum = base + 0.5 * *sum);
        // The gradient of ½ qᵀC₂q + ⅙ C₃(q, q, q) is (C₂ + ½ C₃q)q.
        kernel::spread(&q[..padded], [tiled, repeated]);
        kernel::multiply::<S, Double>(simd, bending, [tiled, repeated], [along, across], bent);
        kernel::multiply::<S, Double>(simd, &energy.bending, [tiled, repeated], [along, across], product);
        gradient.copy_from_slice(bent);
        kernel::add_transposed(simd, jacobian, stress, padded, &mut gradient[..n]);
    }
}

struct PlaceNear<'a> {
    energy: &'a PolynomialEnergy,
    room: &'a mut Room,
}

impl WithSimd for PlaceNear<'_> {
    type Output = ();

    /// What is linear in q has 64 bits: a shell that hardly moves feels its forces to rounding.
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { energy, room } = self;
        let Room {
            q: wide,
            gradient,
            s,
            stress: wide_stress,
            curvature,
            strained,
            bent,
            product: straight,
            narrow,
            ..
        } = room;
        let Narrow { q, wide: placed, stress, turned, by_form, bending, product, .. } = narrow;
        let (n, padded, count, own) = (energy.n, energy.padded, energy.count, &energy.narrow);
        let (at, beside) = ((own.stride, own.first), near::beside(count));
        narrow.joined = false;
        placed[own.first..][..n].copy_from_slice(&wide[..n]);
        q.iter_mut().zip(&*placed).for_each(|(q, wide)| *q = *wide as f32);
        let sides = beside.next_multiple_of(SIDE);
        let (lanes, turned) = (&energy.lanes[..sides * (padded * (padded + 1) / 2)], &mut turned[..sides * padded]);
        let last = &mut by_form[beside * own.stride..];
        kernel::turn::<S, Single>(simd, &q[own.first..], lanes, turned);
        near::strains(simd, (&wide[..padded], &q[own.first..]), &energy.linear, turned, s);
        let forms = (&own.straight[beside * own.stride..], &own.squares[..]);
        near::last_strains(simd, (placed, q), forms, own.first, (last, &mut s[beside..count]));
        resist_all(energy, s, (wide_stress, curvature), strained);
        stress.iter_mut().zip(&*wide_stress).for_each(|(stress, wide)| *stress = *wide as f32);
        let q = &q[own.first..];
        kernel::combine::<S, Single>(simd, &energy.cubic, &q[..even(n).min(padded)], bending);
        let ([tiled, repeated], [along, across]) = (&mut narrow.spread, &mut narrow.sums);
        kernel::spread(q, [tiled, repeated]);
        kernel::multiply::<S, Single>(simd, bending, [tiled, repeated], [along, across], product);
        near::sum_rows::<S, Double>(simd, &own.square, &wide[..n], (energy.stride, 0), straight);
        for ((bent, straight), second) in bent.iter_mut().zip(&*straight).zip(&*product) {
            *bent = straight + 0.5 * f64::from(*second);
        }
        near::sum_rows::<S, Double>(simd, &own.straight, &wide_stress[..count], at, &mut narrow.straight);
        near::sum_rows::<S, Single>(simd, last, &stress[beside..count], at, &mut narrow.curved);
        near::add_forms(simd, turned, &stress[..beside.next_multiple_of(SIDE)], &mut narrow.curved[own.first..]);
        let forces = narrow.straight[own.first..].iter().zip(&narrow.curved[own.first..]);
        for ((out, bent), (straight, curved)) in gradient.iter_mut().zip(&*bent).zip(forces) {
            *out = bent + (straight + f64::from(*curved));
        }
    }
}

struct NearHessian<'a> {
    energy: &'a PolynomialEnergy,
    room: &'a mut Room,
    out: Rows<'a>,
}

impl WithSimd for NearHessian<'_> {
    type Output = ();

    /// Q has 16 bits here, which Newton steps do not feel.
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { energy, room, out: Rows { stride, first, rows: out } } = self;
        let Room { curvature: wide, strained, narrow, .. } = room;
        let Narrow { stress, curvature, turned, by_form, bending, blocks, scaled, joined, .. } = narrow;
        let (n, count, own) = (energy.n, energy.count, &energy.narrow);
        blocks.copy_from_slice(bending);
        kernel::add::<S, Single>(simd, blocks, &own.bending);
        kernel::add_pairs(simd, &own.quadratic, &stress[..even(count)], blocks);
        kernel::unpack(blocks, n, (stride, first), out);
        if !*joined {
            curvature.iter_mut().zip(&*wide).for_each(|(curvature, wide)| *curvature = *wide as f32);
            let (padded, sides) = (energy.padded, near::beside(count).next_multiple_of(SIDE));
            near::by_forms(simd, &turned[..sides * padded], (padded, stride, first), by_form);
            near::join(simd, &own.linear, &curvature[..count], stride, (by_form, scaled));
            if let Some(engineering) = &energy.engineering {
                let x = by_rows(&engineering.curvature(strained), |x| x as f32);
                engineering::mix::<S, Single>(simd, &x, by_form, stride, scaled);
            }
            *joined = true;
        }
        kernel::add_products::<S, Single>(simd, (scaled, &by_form[..count * stride]), (stride, first), out);
    }
}

struct Value<'a> {
    energy: &'a PolynomialEnergy,
    room: &'a mut Room,
}

impl WithSimd for Value<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let Self { energy, room } = self;
        let forms = room.resisted(energy, energy.forms);
        let Room { q, bent, product, .. } = room;
        // Of b = qᵀ(C₂ + ½ C₃q)q and c = qᵀC₂q, c/2 + (b − c)/3.
        let own: f64 = q[..energy.n].iter().zip(&*product).map(|(q, p)| q * p).sum();
        let both: f64 = q[..energy.n].iter().zip(&*bent).map(|(q, b)| q * b).sum();
        forms + own / 6.0 + both / 3.0
    }
}

struct Hessian<'a> {
    energy: &'a PolynomialEnergy,
    room: &'a mut Room,
}

impl WithSimd for Hessian<'_> {
    type Output = ();

    /// Σ σ Q has sums of 32 bits: what they miss, Newton steps make up for.
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { energy, room } = self;
        let Room { stress: wide, curvature, strained, jacobian, bending, blocks, square, scaled, rows, narrow, .. } =
            room;
        let Narrow { stress, blocks: sum, .. } = narrow;
        let (n, stride, count) = (energy.n, energy.stride, energy.count);
        stress.iter_mut().zip(&*wide).for_each(|(stress, wide)| *stress = *wide as f32);
        kernel::combine::<S, Single>(simd, &energy.quadratic, &stress[..even(count)], sum);
        for (((out, both), own), sum) in blocks.iter_mut().zip(&*bending).zip(&energy.bending).zip(&*sum) {
            *out = 2.0 * both - own + f64::from(*sum);
        }
        kernel::unpack(blocks, n, (stride, 0), square);
        kernel::by_forms(jacobian, (energy.padded, stride, 0), rows);
        let rows = &rows[..count * stride];
        kernel::scale::<S, Double>(simd, rows, &curvature[..count], stride, scaled);
        if let Some(engineering) = &energy.engineering {
            let x = by_rows(&engineering.curvature(strained), |x| x);
            engineering::mix::<S, Double>(simd, &x, rows, stride, scaled);
        }
        kernel::add_products::<S, Double>(simd, (scaled, rows), (stride, 0), square);
    }
}

struct Resistance<'a> {
    energy: &'a PolynomialEnergy,
    bending: &'a [f64],
    room: &'a mut Room,
}

impl WithSimd for Resistance<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { energy, bending, room } = self;
        let Room { strained, jacobian, square, scaled, rows, .. } = room;
        let (n, stride) = (energy.n, energy.stride);
        let firm = &energy.weights[..energy.membrane];
        let scaled = &mut scaled[..firm.len() * stride];
        kernel::unpack(bending, n, (stride, 0), square);
        kernel::by_forms(jacobian, (energy.padded, stride, 0), rows);
        let rows = &rows[..firm.len() * stride];
        kernel::scale::<S, Double>(simd, rows, firm, stride, scaled);
        if let Some(engineering) = &energy.engineering {
            let x = by_rows(&engineering.resistance(strained), |x| x);
            engineering::mix::<S, Double>(simd, &x, rows, stride, scaled);
        }
        kernel::add_products::<S, Double>(simd, (scaled, rows), (stride, 0), square);
    }
}
