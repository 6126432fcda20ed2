//! Evaluation of a polynomial energy: what is known of a q, made when it is first asked for.

use super::super::products::WIDTH;
use super::{PolynomialEnergy, kernel};
use pulp::{Simd, WithSimd};

/// Room, so that evaluation does not allocate, and what is known of the last q.
#[derive(Clone)]
pub struct Room {
    /// q, padded; no numbers before the first. And how many there were.
    q: Vec<f64>,
    shapes: usize,
    /// Of it: E, once it was asked for, and its gradient; s, dE/ds and d²E/ds², and ∂s/∂q by field.
    value: Option<f64>,
    gradient: Vec<f64>,
    pub(super) s: Vec<f64>,
    stress: Vec<f64>,
    curvature: Vec<f64>,
    jacobian: Vec<f64>,
    /// C₂ + ½ C₃q, and its product with q.
    bending: Vec<f64>,
    bent: Vec<f64>,
    /// For products: a triangle; squares with zeros before the diagonal; ∂s/∂q with factors by field, and by form.
    triangle: Vec<f64>,
    clean: Vec<f64>,
    square: Vec<f64>,
    scaled: Vec<f64>,
    rows: Vec<f64>,
    product: Vec<f64>,
}

impl Room {
    /// For one evaluation at a time.
    pub(super) fn of(energy: &PolynomialEnergy) -> Self {
        let (n, stride, padded) = (energy.n, energy.stride, energy.padded);
        let (fields, forms, lanes) = (vec![0.0; stride], vec![0.0; energy.forms], vec![0.0; padded * energy.forms]);
        let (triangle, square) = (vec![0.0; energy.bending.len()], vec![0.0; n * stride]);
        Self {
            q: (0..stride).map(|k| if k < n { f64::NAN } else { 0.0 }).collect(),
            shapes: 0,
            value: None,
            gradient: fields.clone(),
            s: forms.clone(),
            stress: forms.clone(),
            curvature: forms,
            jacobian: lanes.clone(),
            bending: triangle.clone(),
            bent: fields.clone(),
            triangle,
            clean: square.clone(),
            square,
            scaled: lanes,
            rows: vec![0.0; energy.forms * stride],
            product: fields,
        }
    }

    /// How many q there were since this was asked last.
    pub fn take_shapes(&mut self) -> usize {
        std::mem::take(&mut self.shapes)
    }

    /// Moves to a q.
    #[inline]
    pub(super) fn place(&mut self, energy: &PolynomialEnergy, q: &[f64]) {
        if self.q[..energy.n] == *q {
            return;
        }
        self.q[..energy.n].copy_from_slice(q);
        self.shapes += 1;
        self.value = None;
        energy.arch.dispatch(Place { energy, room: self });
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

impl WithSimd for Place<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { energy, room } = self;
        let Room { q, gradient, s, stress, curvature, jacobian, bending, bent, clean, product, .. } = room;
        let (n, stride, padded) = (energy.n, energy.stride, energy.padded);
        kernel::strains(simd, &q[..padded], &energy.lanes, &energy.linear, jacobian, s);
        for ((((stress, curvature), s), weight), bound) in
            stress.iter_mut().zip(curvature).zip(&*s).zip(&energy.weights).zip(&energy.bounds)
        {
            [_, *stress, *curvature] = resist(*weight, *bound, *s);
        }
        // The gradient of ½ qᵀC₂q + ⅙ C₃(q, q, q) is (C₂ + ½ C₃q)q.
        product.iter_mut().zip(&*q).for_each(|(half, q)| *half = 0.5 * q);
        bending.copy_from_slice(&energy.bending);
        kernel::combine(simd, &energy.cubic, &product[..n], bending);
        kernel::square(bending, (n, stride), clean);
        kernel::multiply(simd, clean, n, q, bent);
        gradient.copy_from_slice(bent);
        kernel::add_transposed(simd, jacobian, stress, padded, &mut gradient[..n]);
    }
}

struct Value<'a> {
    energy: &'a PolynomialEnergy,
    room: &'a mut Room,
}

impl WithSimd for Value<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Self { energy, room } = self;
        let Room { q, s, bent, product, .. } = room;
        let forms = (0..energy.forms).map(|k| resist(energy.weights[k], energy.bounds[k], s[k])[0]).sum::<f64>();
        // Of b = qᵀ(C₂ + ½ C₃q)q and c = qᵀC₂q, c/2 + (b − c)/3.
        let both: f64 = q[..energy.n].iter().zip(&*bent).map(|(q, b)| q * b).sum();
        forms + kernel::multiply(simd, &energy.bending_square, energy.n, q, product) / 6.0 + both / 3.0
    }
}

struct Hessian<'a> {
    energy: &'a PolynomialEnergy,
    room: &'a mut Room,
}

impl WithSimd for Hessian<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { energy, room } = self;
        let Room { stress, curvature, jacobian, bending, triangle, square, scaled, rows, .. } = room;
        let (n, stride, padded) = (energy.n, energy.stride, energy.padded);
        for ((sum, both), own) in triangle.iter_mut().zip(&*bending).zip(&energy.bending) {
            *sum = 2.0 * both - own;
        }
        kernel::combine(simd, &energy.quadratic, stress, triangle);
        kernel::square(triangle, (n, stride), square);
        kernel::scale(simd, jacobian, curvature, (padded, stride), [scaled, rows]);
        kernel::add_products(simd, (scaled, padded), rows, (n, stride), square);
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
        let (n, stride, padded) = (energy.n, energy.stride, energy.padded);
        let count = energy.membrane.next_multiple_of(WIDTH);
        let (scaled, rows) = (&mut scaled[..count * padded], &mut rows[..count * stride]);
        kernel::square(bending, (n, stride), square);
        let jacobian = &jacobian[..count * padded];
        kernel::scale(simd, jacobian, &energy.firm[..count], (padded, stride), [scaled, rows]);
        kernel::add_products(simd, (scaled, padded), rows, (n, stride), square);
    }
}
