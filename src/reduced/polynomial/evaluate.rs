//! Evaluation of a polynomial energy: what is known of a q, made when it is first asked for.

use super::super::factor::Rows;
use super::super::sums::{Double, Single};
use super::{PolynomialEnergy, even, kernel};
use pulp::{Simd, WithSimd};

/// Room, so that evaluation does not allocate, and what is known of the last q.
#[derive(Clone)]
pub struct Room {
    /// q, padded; no numbers before the first. How many there were, and whether sums of the last have 32 bits.
    q: Vec<f64>,
    shapes: usize,
    single: bool,
    /// Of it: E, once it was asked for, and its gradient; s, dE/ds and d²E/ds², and ∂s/∂q by field.
    value: Option<f64>,
    gradient: Vec<f64>,
    pub(super) s: Vec<f64>,
    stress: Vec<f64>,
    curvature: Vec<f64>,
    jacobian: Vec<f64>,
    /// C₂ + ½ C₃q, its product with q and that of C₂ alone.
    bending: Vec<f64>,
    bent: Vec<f64>,
    product: Vec<f64>,
    /// q and sums for products.
    spread: [Vec<f64>; 2],
    sums: [Vec<f64>; 2],
    /// A Hessian but for JᵀWJ, and as a square; ∂s/∂q by form, with factors and without.
    blocks: Vec<f64>,
    square: Vec<f64>,
    scaled: Vec<f64>,
    rows: Vec<f64>,
    narrow: Narrow,
}

/// The same in 32 bits: Qq of each form in the place of ∂s/∂q, and of bending C₃q alone.
#[derive(Clone)]
struct Narrow {
    q: Vec<f32>,
    stress: Vec<f32>,
    curvature: Vec<f32>,
    turned: Vec<f32>,
    /// C₃q and its product with q, and the Hessian but for JᵀWJ.
    bending: Vec<f32>,
    product: Vec<f32>,
    blocks: Vec<f32>,
    spread: [Vec<f32>; 2],
    sums: [Vec<f32>; 2],
    scaled: Vec<f32>,
    rows: Vec<f32>,
}

impl Narrow {
    fn of(energy: &PolynomialEnergy) -> Self {
        let PolynomialEnergy { padded, forms, narrow, .. } = energy;
        let stride = narrow.stride;
        let zeros = |count: usize| vec![0.0; count];
        Self {
            q: zeros(stride),
            stress: zeros(*forms),
            curvature: zeros(*forms),
            turned: zeros(padded * forms),
            bending: zeros(narrow.bending.len()),
            product: zeros(stride),
            blocks: zeros(narrow.bending.len()),
            spread: [padded * kernel::ROWS; 2].map(zeros),
            sums: [padded * kernel::ROWS; 2].map(zeros),
            scaled: zeros(narrow.linear.len()),
            rows: zeros(narrow.linear.len()),
        }
    }
}

impl Room {
    /// For one evaluation at a time.
    pub(super) fn of(energy: &PolynomialEnergy) -> Self {
        let (n, stride, padded, forms) = (energy.n, energy.stride, energy.padded, energy.forms);
        let [fields, by_form, by_both] = [stride, forms, padded * forms].map(|count| vec![0.0; count]);
        let [blocks, square, spread] =
            [energy.stiffness.len(), padded * stride, padded * kernel::ROWS].map(|count| vec![0.0; count]);
        Self {
            q: (0..stride).map(|k| if k < n { f64::NAN } else { 0.0 }).collect(),
            shapes: 0,
            single: false,
            value: None,
            gradient: fields.clone(),
            s: by_form.clone(),
            stress: by_form.clone(),
            curvature: by_form,
            jacobian: by_both,
            bending: blocks.clone(),
            bent: fields.clone(),
            product: fields,
            spread: [spread.clone(), spread.clone()],
            sums: [spread.clone(), spread],
            blocks,
            square,
            scaled: vec![0.0; energy.count * stride],
            rows: vec![0.0; energy.count * stride],
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
pub(super) fn resist(weight: f64, bound: f64, s: f64) -> [f64; 3] {
    let ratio = bound * s * s;
    let share = 1.0 / (1.0 + ratio);
    let force = weight * s * share;
    [0.5 * s * force, force * share, weight * (1.0 - 3.0 * ratio) * share * share * share]
}

struct Place<'a> {
    energy: &'a PolynomialEnergy,
    room: &'a mut Room,
}

/// dE/ds and d²E/ds² of all forms.
#[inline(always)]
fn resist_all(energy: &PolynomialEnergy, s: &[f64], stress: &mut [f64], curvature: &mut [f64]) {
    let both = stress.iter_mut().zip(curvature).zip(s);
    for (((stress, curvature), s), (weight, bound)) in both.zip(energy.weights.iter().zip(&energy.bounds)) {
        [_, *stress, *curvature] = resist(*weight, *bound, *s);
    }
}

impl WithSimd for Place<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { energy, room } = self;
        let Room { q, gradient, s, stress, curvature, jacobian, bending, bent, product, .. } = room;
        let Room { spread: [tiled, repeated], sums: [along, across], .. } = room;
        let (n, padded, count) = (energy.n, energy.padded, even(energy.n));
        kernel::turn::<S, Double>(simd, &q[..padded], &energy.lanes, jacobian);
        kernel::strains(simd, &q[..padded], &energy.linear, jacobian, s);
        resist_all(energy, s, stress, curvature);
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
        let Room { q: wide, gradient, s, stress: wide_stress, curvature, bent, product: straight, narrow, .. } = room;
        let Narrow { q, stress, turned, bending, product, .. } = narrow;
        let (n, padded, count) = (energy.n, energy.padded, even(energy.n));
        q.iter_mut().zip(&*wide).for_each(|(q, wide)| *q = *wide as f32);
        kernel::turn::<S, Single>(simd, &q[..padded], &energy.lanes, turned);
        kernel::near_strains(simd, (&wide[..padded], &q[..padded]), &energy.linear, turned, s);
        resist_all(energy, s, wide_stress, curvature);
        stress.iter_mut().zip(&*wide_stress).for_each(|(stress, wide)| *stress = *wide as f32);
        kernel::combine::<S, Single>(simd, &energy.cubic, &q[..count], bending);
        {
            let ([tiled, repeated], [along, across]) = (&mut narrow.spread, &mut narrow.sums);
            kernel::spread(&q[..padded], [tiled, repeated]);
            kernel::multiply::<S, Single>(simd, bending, [tiled, repeated], [along, across], product);
        }
        let ([tiled, repeated], [along, across]) = (&mut room.spread, &mut room.sums);
        kernel::spread(&wide[..padded], [tiled, repeated]);
        kernel::multiply::<S, Double>(simd, &energy.bending, [tiled, repeated], [along, across], straight);
        for ((bent, straight), second) in bent.iter_mut().zip(&*straight).zip(&*product) {
            *bent = straight + 0.5 * f64::from(*second);
        }
        gradient.copy_from_slice(bent);
        let both = (&energy.linear[..], &turned[..]);
        kernel::add_near_transposed(simd, both, (wide_stress, stress), padded, &mut gradient[..n]);
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
        let Self { energy, room, out: Rows { stride, rows: out } } = self;
        let Room { curvature: wide, narrow, .. } = room;
        let Narrow { stress, curvature, turned, bending, blocks, scaled, rows, .. } = narrow;
        let (n, padded, count) = (energy.n, energy.padded, energy.count);
        blocks.copy_from_slice(bending);
        kernel::add::<S, Single>(simd, blocks, &energy.narrow.bending);
        kernel::add_pairs(simd, &energy.narrow.quadratic, &stress[..even(count)], blocks);
        kernel::unpack(blocks, n, stride, out);
        curvature.iter_mut().zip(&*wide).for_each(|(curvature, wide)| *curvature = *wide as f32);
        kernel::by_forms(turned, (padded, stride), rows);
        kernel::add::<S, Single>(simd, rows, &energy.narrow.linear);
        kernel::scale::<S, Single>(simd, rows, &curvature[..count], stride, scaled);
        kernel::add_products::<S, Single>(simd, (scaled, rows), stride, out);
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
        let Room { q, s, bent, product, .. } = room;
        let forms = (0..energy.forms).map(|k| resist(energy.weights[k], energy.bounds[k], s[k])[0]).sum::<f64>();
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
        let Room { stress: wide, curvature, jacobian, bending, blocks, square, scaled, rows, narrow, .. } = room;
        let Narrow { stress, blocks: sum, .. } = narrow;
        let (n, stride, count) = (energy.n, energy.stride, energy.count);
        stress.iter_mut().zip(&*wide).for_each(|(stress, wide)| *stress = *wide as f32);
        kernel::combine::<S, Single>(simd, &energy.quadratic, &stress[..even(count)], sum);
        for (((out, both), own), sum) in blocks.iter_mut().zip(&*bending).zip(&energy.bending).zip(&*sum) {
            *out = 2.0 * both - own + f64::from(*sum);
        }
        kernel::unpack(blocks, n, stride, square);
        kernel::by_forms(jacobian, (energy.padded, stride), rows);
        kernel::scale::<S, Double>(simd, rows, &curvature[..count], stride, scaled);
        kernel::add_products::<S, Double>(simd, (scaled, rows), stride, square);
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
        let Room { jacobian, square, scaled, rows, .. } = room;
        let (n, stride) = (energy.n, energy.stride);
        let firm = &energy.weights[..energy.membrane];
        let (scaled, rows) = (&mut scaled[..firm.len() * stride], &mut rows[..firm.len() * stride]);
        kernel::unpack(bending, n, stride, square);
        kernel::by_forms(jacobian, (energy.padded, stride), rows);
        kernel::scale::<S, Double>(simd, rows, firm, stride, scaled);
        kernel::add_products::<S, Double>(simd, (scaled, rows), stride, square);
    }
}
