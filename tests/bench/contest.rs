//! Contestants that take turns on one machine, and the readings that kernels are measured against.
//!
//! Criterion and divan time one function after the other; on a machine with other work to do that makes ratios worthless, so
//! here the contestants take turns and the least time of each counts. Caches are warm: a basis that fits one is read from it.

use pulp::{Simd, WithSimd};
use shellwarp::{Model, Vec3};
use std::hint::black_box;
use std::time::Instant;

/// Turns of each contestant, and what one turn lasts at least, s.
const ROUNDS: usize = 25;
const TURN: f64 = 2e-3;

/// A timed thing.
pub struct Contestant<'a> {
    pub name: &'static str,
    /// Done before each turn, not timed.
    before: Box<dyn FnMut() + 'a>,
    call: Box<dyn FnMut() + 'a>,
    calls_per_turn: usize,
    /// Least seconds of a call.
    pub best: f64,
}

impl<'a> Contestant<'a> {
    pub fn new(name: &'static str, call: impl FnMut() + 'a) -> Self {
        Self { name, before: Box::new(|| ()), call: Box::new(call), calls_per_turn: 1, best: f64::INFINITY }
    }

    /// Does `before` before each turn, not timed.
    pub fn after(self, before: impl FnMut() + 'a) -> Self {
        Self { before: Box::new(before), ..self }
    }

    /// The first call is not timed: it finds the caches filled by the others.
    fn take_turn(&mut self) {
        (self.before)();
        (self.call)();
        let start = Instant::now();
        (0..self.calls_per_turn).for_each(|_| (self.call)());
        self.best = self.best.min(start.elapsed().as_secs_f64() / self.calls_per_turn as f64);
    }
}

/// Lets all take turns.
pub fn measure(contestants: &mut [Contestant]) {
    for one in &mut *contestants {
        one.take_turn();
        one.take_turn();
        one.calls_per_turn = ((TURN / one.best).ceil() as usize).max(1);
        one.best = f64::INFINITY;
    }
    for _ in 0..ROUNDS {
        contestants.iter_mut().for_each(Contestant::take_turn);
    }
}

/// Reads `basis` in blocks of `block` floats and, with room for it, writes 48 floats a block: the readings.
pub struct Stream<'a> {
    pub basis: &'a [f32],
    pub block: usize,
    pub out: Option<&'a mut [f32]>,
}

impl WithSimd for Stream<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { basis, block, mut out } = self;
        let mut total = [simd.splat_f32s(0.0); 8];
        for (b, block) in basis.chunks_exact(block).enumerate() {
            let (registers, _) = S::as_simd_f32s(block);
            let (eights, rest) = registers.as_chunks::<8>();
            let add = |sum: &mut S::f32s, x: &S::f32s| *sum = simd.add_f32s(*sum, *x);
            eights.iter().for_each(|eight| total.iter_mut().zip(eight).for_each(|(sum, x)| add(sum, x)));
            total.iter_mut().zip(rest).for_each(|(sum, x)| add(sum, x));
            if let Some(out) = &mut out {
                let (rows, _) = S::as_mut_simd_f32s(&mut out[48 * b..48 * b + 48]);
                rows.iter_mut().enumerate().for_each(|(i, row)| *row = total[i % 8]);
            }
        }
        black_box(total);
    }
}

/// Φ and Ψ vertex by vertex, mode by mode, as one would first write them.
pub struct Naive {
    shapes: Vec<(Vec3, Vec3)>,
    rest: Vec<Vec3>,
    modes: usize,
}

impl Naive {
    pub fn new(model: &Model) -> Self {
        let (n, modes) = (model.shell.mass.len(), model.modal.n_modes());
        let shapes =
            (0..n).flat_map(|v| (0..modes).map(move |k| (k, v))).map(|(k, v)| model.modal.mode_at(k, v)).collect();
        Self { shapes, rest: model.shell.mesh.positions.clone(), modes }
    }

    pub fn positions(&self, q: &[f64], out: &mut [[f32; 3]]) {
        for (v, rest) in self.rest.iter().enumerate() {
            let (mut u, mut w) = (Vec3::zeros(), Vec3::zeros());
            for ((phi, psi), q) in self.shapes[v * self.modes..][..self.modes].iter().zip(q) {
                u += phi * *q;
                w += psi * *q;
            }
            let angle = w.norm();
            let (b, c) = if angle > 1e-4 {
                ((1.0 - angle.cos()) / angle.powi(2), (angle - angle.sin()) / angle.powi(3))
            } else {
                (0.5, 1.0 / 6.0)
            };
            let x = rest + u + w.cross(&u) * b + w.cross(&w.cross(&u)) * c;
            out[v] = [x.x as f32, x.y as f32, x.z as f32];
        }
    }
}
