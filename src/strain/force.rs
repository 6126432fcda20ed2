//! The modal force f_k = Φ_kᵀF + Σ_c (∂N_c/∂q_k) : H_c with H_c = Σ_i F_i b_ciᵀ.

use super::fields::{Fields, Rows, Sums};
use super::fit::combined;
use super::{AnyBasis, AnyFields, MOST_SAMPLES, RotationStrain, sample};
use crate::Vec3;
use crate::features::Feature;
use crate::load::BodyLoad;
use crate::load::External;
use crate::modal::ModalBasis;
use crate::real::Real;
use crate::step::guard::Pull;
use crate::warp::{Basis, Entry, LANES, Line};
use nalgebra::Matrix3;

/// Lanes are summed in the basis's precision over so many blocks, then in f64.
const BLOCKS_PER_SUM: usize = 64;

#[derive(Clone)]
enum AnySums {
    F32(Sums<f32>),
    F64(Sums<f64>),
}

/// Room, so that a step does not allocate.
#[derive(Clone)]
pub struct Scratch {
    /// G of each sample, and H.
    at: Vec<Matrix3<f64>>,
    on_samples: Vec<Matrix3<f64>>,
    sums: AnySums,
}

/// Amplitudes and their rates.
type Motion<'a> = (&'a [f64], &'a [f64]);

impl RotationStrain {
    /// Room for [`RotationStrain::project`].
    pub fn scratch(&self, modal: &ModalBasis) -> Scratch {
        let (modes, n) = (modal.n_amplitudes(), self.n_samples());
        let sums = match &self.fields {
            AnyFields::F32(_) => AnySums::F32(Sums::new(modes, n)),
            AnyFields::F64(_) => AnySums::F64(Sums::new(modes, n)),
        };
        Scratch { at: vec![Matrix3::zeros(); n], on_samples: vec![Matrix3::zeros(); n], sums }
    }

    /// Sets `force` (modes) to the modal force at amplitudes q that change at the rates q̇. Returns how strongly the loads pull.
    pub fn project(
        &self,
        modal: &ModalBasis,
        (load, external): (&BodyLoad, External),
        (q, q_dot): Motion,
        scratch: &mut Scratch,
        force: &mut [f64],
    ) -> Pull {
        let Scratch { at, on_samples, sums } = scratch;
        at.iter_mut().enumerate().for_each(|(c, g)| *g = combined(self.of_sample(c), q));
        let mut pull = match (load.everywhere_alike(), external.on_all()) {
            (Some(a), None) => {
                let factors = modal.participation().factors();
                force.iter_mut().zip(factors).for_each(|(force, p)| *force = p.dot(a));
                on_samples.iter_mut().zip(&self.weighted).for_each(|(h, weighted)| *h = a * weighted.transpose());
                Pull { body: a.norm(), ..Pull::default() }
            }
            (_, on_all) => {
                force.fill(0.0);
                on_samples.fill(Matrix3::zeros());
                self.sum_over_vertices(modal, (load, on_all), (q, q_dot), sums, (force, on_samples))
            }
        };
        for (v, on_vertex) in external.point_forces() {
            let v = v as usize;
            force.iter_mut().enumerate().for_each(|(k, force)| *force += modal.mode_at(k, v).0.dot(&on_vertex));
            let add = |(c, h): (usize, &mut Matrix3<f64>)| *h += on_vertex * self.field(c, v).transpose();
            on_samples.iter_mut().enumerate().for_each(add);
            pull.external += on_vertex.norm();
        }
        for (c, (g, h)) in at.iter().zip(&*on_samples).enumerate() {
            let slope = sample::pull_back(g, h);
            force.iter_mut().zip(self.of_sample(c)).for_each(|(force, g)| *force += slope.dot(g));
        }
        pull
    }

    fn sum_over_vertices(
        &self,
        modal: &ModalBasis,
        loads: (&BodyLoad, Option<&[Vec3]>),
        motion: Motion,
        sums: &mut AnySums,
        (force, on_samples): (&mut [f64], &mut [Matrix3<f64>]),
    ) -> Pull {
        let mut to = Gathered { force, on_samples, scale: modal.shell.total_mass };
        match (&modal.basis, &self.fields, sums) {
            (AnyBasis::F32(basis), AnyFields::F32(fields), AnySums::F32(sums)) => {
                self.sum(modal, (basis, fields), loads, motion, sums, &mut to)
            }
            (AnyBasis::I16(basis), AnyFields::F32(fields), AnySums::F32(sums)) if Feature::I16Basis.is_built_in() => {
                self.sum(modal, (basis, fields), loads, motion, sums, &mut to)
            }
            (AnyBasis::F64(basis), AnyFields::F64(fields), AnySums::F64(sums)) if Feature::F64Basis.is_built_in() => {
                self.sum(modal, (basis, fields), loads, motion, sums, &mut to)
            }
            _ => unreachable!("fields and sums have the basis's precision"),
        }
    }

    fn sum<E: Entry>(
        &self,
        modal: &ModalBasis,
        (basis, fields): (&Basis<E>, &Fields<E::Real>),
        (load, external): (&BodyLoad, Option<&[Vec3]>),
        (q, q_dot): Motion,
        sums: &mut Sums<E::Real>,
        gathered: &mut Gathered,
    ) -> Pull {
        let (mass, rest) = (&modal.shell.mass, &modal.shell.mesh.positions);
        let scale = 1.0 / modal.shell.total_mass;
        let mut room = [[Matrix3::zeros(); MOST_SAMPLES]; 2];
        let spins = load.spin_rate().is_some();
        let [room, rate_room] = &mut room;
        let remainders = self.remainders(room, q);
        let rates = self.rates(rate_room, (q, q_dot));
        let (mut square, mut norms) = (0.0, 0.0);
        sums.clear();
        for b in 0..basis.n_blocks() {
            // Where a vertex is and how it moves matters in a spinning frame alone.
            let mut moving = [[Vec3::zeros(); LANES]; 2];
            if spins {
                for (moving, (q, factors)) in moving.iter_mut().zip([(q, remainders), (q_dot, rates)]) {
                    fields.displacements(basis, b..b + 1, (q, factors), |_, u, _| *moving = wide(u));
                }
            }
            let mut rows: Rows<E::Real> = Default::default();
            for (i, v) in (b * LANES..mass.len()).take(LANES).enumerate() {
                let body = load.at(mass[v], rest[v] + moving[0][i], moving[1][i]);
                if mass[v] > 0.0 {
                    square += body.norm_squared() / mass[v];
                }
                let external = external.map_or(Vec3::zeros(), |forces| forces[v]);
                norms += external.norm();
                let force = (body + external) * scale;
                (0..3).for_each(|c| rows[c].0[i] = E::Real::of(force[c]));
            }
            fields.project(basis, b, &rows, sums);
            if (b + 1) % BLOCKS_PER_SUM == 0 || b + 1 == basis.n_blocks() {
                gathered.take(basis, sums);
            }
        }
        Pull { body: (square * scale).sqrt(), external: norms, reach: 0.0 }
    }

    /// The rates of N_c.
    pub(super) fn rates<'a>(
        &self,
        room: &'a mut [Matrix3<f64>; MOST_SAMPLES],
        (q, q_dot): Motion,
    ) -> &'a [Matrix3<f64>] {
        self.each(room, |gradients| sample::remainder_rate(&combined(gradients, q), &combined(gradients, q_dot)))
    }
}

/// The rows of a block as vectors.
pub(super) fn wide<T: Real>(rows: &Rows<T>) -> [Vec3; LANES] {
    std::array::from_fn(|i| Vec3::from_fn(|c, _| rows[c].0[i].to_f64()))
}

/// Sums in f64, of forces that were multiplied by 1/scale.
struct Gathered<'a> {
    force: &'a mut [f64],
    on_samples: &'a mut [Matrix3<f64>],
    scale: f64,
}

impl Gathered<'_> {
    fn take<E: Entry>(&mut self, basis: &Basis<E>, sums: &mut Sums<E::Real>) {
        let sum = |line: &Line<E::Real>| line.0.iter().map(|x| x.to_f64()).sum::<f64>();
        for ((force, [line, _]), [unit, _]) in self.force.iter_mut().zip(&sums.modes).zip(basis.units()) {
            *force += sum(line) * unit * (self.scale / basis.root_mass());
        }
        for (h, lines) in self.on_samples.iter_mut().zip(&sums.fields) {
            *h += Matrix3::from_fn(|c, d| sum(&lines[c][d]) * self.scale);
        }
        sums.clear();
    }
}

impl<T: Real> Sums<T> {
    fn clear(&mut self) {
        self.modes.fill(Default::default());
        self.fields.fill(Default::default());
    }
}
