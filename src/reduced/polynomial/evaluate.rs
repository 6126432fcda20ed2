//! Evaluation of a polynomial energy: what is known of a q, made when it is first asked for.

use super::{PolynomialEnergy, even, kernel};
use kernel::{Double, Single};
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
    /// C₂ + ½ C₃q, and its product with q.
    bending: Vec<f64>,
    bent: Vec<f64>,
    /// For products: a triangle, a square, ∂s/∂q by form, with factors and without.
    triangle: Vec<f64>,
    square: Vec<f64>,
    scaled: Vec<f64>,
    rows: Vec<f64>,
    product: Vec<f64>,
    narrow: Narrow,
}

/// The same in 32 bits.
#[derive(Clone)]
struct Narrow {
    q: Vec<f32>,
    stress: Vec<f32>,
    jacobian: Vec<f32>,
    triangle: Vec<f32>,
}

impl Room {
    /// For one evaluation at a time.
    pub(super) fn of(energy: &PolynomialEnergy) -> Self {
        let (n, stride, padded, forms) = (energy.n, energy.stride, energy.padded, energy.forms);
        let [fields, by_form, by_both] = [stride, forms, padded * forms].map(|count| vec![0.0; count]);
        let [triangle, square] = [energy.stiffness.len(), padded * stride].map(|count| vec![0.0; count]);
        let [q, stress, jacobian, narrow] =
            [stride, forms, padded * forms, triangle.len()].map(|count| vec![0.0; count]);
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
            bending: square.clone(),
            bent: fields.clone(),
            triangle,
            square,
            scaled: vec![0.0; energy.count * stride],
            rows: vec![0.0; energy.count * stride],
            product: fields,
            narrow: Narrow { q, stress, jacobian, triangle: narrow },
        }
    }

    /// How many q there were since this was asked last.
    pub fn take_shapes(&mut self) -> usize {
        std::mem::take(&mut self.shapes)
    }

    /// Moves to a q, with sums of 64 bits, or of 32 where that is `enough`.
    #[inline]
    pub(super) fn place(&mut self, energy: &PolynomialEnergy, q: &[f64], enough: bool) {
        if self.q[..energy.n] == *q && (enough || !self.single) {
            return;
        }
        self.q[..energy.n].copy_from_slice(q);
        self.shapes += 1;
        self.value = None;
        self.single = enough;
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

impl Place<'_> {
    /// J − A and ½ C₃q on top of C₂, by sums of 64 bits.
    #[inline(always)]
    fn sum<S: Simd>(&mut self, simd: S) {
        let Self { energy, room } = self;
        let Room { q, jacobian, bending, triangle, .. } = room;
        let (n, stride, count) = (energy.n, energy.stride, even(energy.n));
        kernel::turn::<S, Double>(simd, &q[..energy.padded], &energy.lanes, jacobian);
        kernel::combine::<S, Double>(simd, &energy.cubic, &q[..count], triangle);
        add_half(&energy.bending, triangle, (n, stride), bending);
    }

    /// The same by sums of 32 bits.
    #[inline(always)]
    fn sum_single<S: Simd>(&mut self, simd: S) {
        let Self { energy, room } = self;
        let Room { q: wide, jacobian: both, bending, narrow, .. } = room;
        let Narrow { q, jacobian, triangle, .. } = narrow;
        let (n, stride, count) = (energy.n, energy.stride, even(energy.n));
        q.iter_mut().zip(&*wide).for_each(|(q, wide)| *q = *wide as f32);
        kernel::turn::<S, Single>(simd, &q[..energy.padded], &energy.lanes, jacobian);
        both.iter_mut().zip(&*jacobian).for_each(|(both, own)| *both = f64::from(*own));
        kernel::combine::<S, Single>(simd, &energy.cubic, &q[..count], triangle);
        add_half(&energy.bending, triangle, (n, stride), bending);
    }
}

/// A square from the diagonal on: another, and half a triangle.
#[inline(always)]
fn add_half<T: Copy + Into<f64>>(base: &[f64], triangle: &[T], (n, stride): (usize, usize), square: &mut [f64]) {
    let rows = kernel::rows(triangle, (n, stride), square).zip(base.chunks_exact(stride)).enumerate();
    for (i, ((own, row), base)) in rows {
        for ((sum, base), x) in row.iter_mut().zip(&base[i..]).zip(own) {
            *sum = base + 0.5 * (*x).into();
        }
    }
}

impl WithSimd for Place<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        if self.room.single {
            self.sum_single(simd)
        } else {
            self.sum(simd)
        }
        let Self { energy, room } = self;
        let Room { q, gradient, s, stress, curvature, jacobian, bending, bent, .. } = room;
        let (n, padded) = (energy.n, energy.padded);
        kernel::strains(simd, &q[..padded], &energy.linear, jacobian, s);
        for ((((stress, curvature), s), weight), bound) in
            stress.iter_mut().zip(curvature).zip(&*s).zip(&energy.weights).zip(&energy.bounds)
        {
            [_, *stress, *curvature] = resist(*weight, *bound, *s);
        }
        // The gradient of ½ qᵀC₂q + ⅙ C₃(q, q, q) is (C₂ + ½ C₃q)q.
        kernel::multiply(simd, bending, q, bent);
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
        kernel::multiply(simd, &energy.bending, q, product);
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
        let Room { stress: wide, curvature, jacobian, bending, square, scaled, rows, narrow, .. } = room;
        let Narrow { stress, triangle, .. } = narrow;
        let (n, stride, count) = (energy.n, energy.stride, energy.count);
        stress.iter_mut().zip(&*wide).for_each(|(stress, wide)| *stress = *wide as f32);
        kernel::combine::<S, Single>(simd, &energy.quadratic, &stress[..even(count)], triangle);
        for ((sum, both), own) in square.iter_mut().zip(&*bending).zip(&energy.bending) {
            *sum = 2.0 * both - own;
        }
        for (own, row) in kernel::rows(triangle, (n, stride), square) {
            row.iter_mut().zip(own).for_each(|(sum, x)| *sum += f64::from(*x));
        }
        kernel::scale(simd, jacobian, &curvature[..count], (energy.padded, stride), [scaled, rows]);
        kernel::add_products(simd, (scaled, rows), stride, square);
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
        square.fill(0.0);
        kernel::rows(bending, (n, stride), square).for_each(|(own, row)| row.copy_from_slice(own));
        kernel::scale(simd, jacobian, firm, (energy.padded, stride), [scaled, rows]);
        kernel::add_products(simd, (scaled, rows), stride, square);
    }
}
