//! Where a floating shell is, how it moves, and its momenta.

use super::{At, Floating};
use crate::reduced::{Flight, Moments, with_fields};
use crate::support::turn_between;
use crate::{Vec3, rotation};
use nalgebra::{DMatrix, DVector, Quaternion, UnitQuaternion, Vector4};

/// Numbers of a saved place behind the fields'; and how far a saved quaternion may be from a unit.
pub(super) const RIGID_UNKNOWNS: usize = 7;
pub(super) const UNIT: f64 = 1e-9;
/// Rounds in which the nearest place is found; each leaves a part of what the fields turn.
const ROUNDS: usize = 40;
/// Of a radian, what a round may turn as the last one.
const TURNED: f64 = 1e-13;

/// q, d and R.
#[derive(Clone)]
pub(super) struct Place {
    pub q: Vec<f64>,
    pub slide: Vec3,
    pub turn: UnitQuaternion<f64>,
}

/// q̇, v, and ω in the axes of the body.
#[derive(Clone)]
pub(super) struct Rates {
    pub q: Vec<f64>,
    pub slide: Vec3,
    pub spin: Vec3,
}

/// ∂T/∂q̇, the velocity, and the angular momentum about the pivot along what is free, in the frame's axes.
#[derive(Clone)]
pub(super) struct Momentum {
    pub q: Vec<f64>,
    pub slide: Vec3,
    pub spin: Vec3,
}

impl Place {
    pub fn rest(n: usize) -> Self {
        Self { q: vec![0.0; n], slide: Vec3::zeros(), turn: UnitQuaternion::identity() }
    }

    /// Without allocation.
    pub fn copy_from(&mut self, other: &Self) {
        self.q.copy_from_slice(&other.q);
        (self.slide, self.turn) = (other.slide, other.turn);
    }

    /// Takes the numbers that [`crate::methods::Motion::unknowns`] gives, without allocation.
    pub fn set(&mut self, places: &[f64]) {
        let n = self.q.len();
        self.q.copy_from_slice(&places[..n]);
        self.slide = Vec3::from_column_slice(&places[n..n + 3]);
        // Not renormalized: the same bits must come back.
        self.turn = UnitQuaternion::new_unchecked(Quaternion::from(Vector4::from_column_slice(&places[n + 3..n + 7])));
    }

    /// Turns by a rotation vector in body axes.
    pub fn turn_by(&mut self, turn: &Vec3) {
        self.turn = UnitQuaternion::new_normalize((self.turn * rotation::by(turn)).into_inner());
    }

    /// From another place to this one: the turn and the slide in this one's body axes.
    pub fn way_from(&self, other: &Self) -> (Vec3, Vec3) {
        let turn = rotation::vector(&(other.turn.inverse() * self.turn));
        (turn, self.turn.inverse() * (self.slide - other.slide))
    }
}

impl Rates {
    pub fn rest(n: usize) -> Self {
        Self { q: vec![0.0; n], slide: Vec3::zeros(), spin: Vec3::zeros() }
    }

    /// Without allocation.
    pub fn copy_from(&mut self, other: &Self) {
        self.q.copy_from_slice(&other.q);
        (self.slide, self.spin) = (other.slide, other.spin);
    }

    /// Takes the numbers that [`crate::methods::Motion::unknowns`] gives, without allocation.
    pub fn set(&mut self, rates: &[f64]) {
        let n = self.q.len();
        self.q.copy_from_slice(&rates[..n]);
        self.slide = Vec3::from_column_slice(&rates[n..n + 3]);
        self.spin = Vec3::from_column_slice(&rates[n + 3..n + 6]);
    }

    /// As a place and they make a flight.
    pub fn flight<'a>(&self, place: &'a Place) -> Flight<'a> {
        let turn = place.turn.to_rotation_matrix();
        Flight { slide: place.slide, turn, q: &place.q, velocity: self.slide, spin: self.spin }
    }
}

impl Momentum {
    pub fn rest(n: usize) -> Self {
        Self { q: vec![0.0; n], slide: Vec3::zeros(), spin: Vec3::zeros() }
    }

    /// Of rates at a place that the moments are of.
    pub fn set(&mut self, at: At, (place, rates): (&Place, &Rates), moments: &Moments) {
        for (k, (p, rate)) in self.q.iter_mut().zip(&rates.q).enumerate() {
            *p = rate + rates.spin.dot(&moments.arm(k));
        }
        self.slide = rates.slide;
        self.spin = place.turn * at.rigid.along(&moments.momentum(&rates.spin));
    }

    /// Goes on from another by a multiple of the way to this one.
    pub fn go_on(&mut self, from: &Self, share: f64) {
        self.q.iter_mut().zip(&from.q).for_each(|(p, from)| *p = from + share * (*p - from));
        self.slide = from.slide + share * (self.slide - from.slide);
        self.spin = from.spin + share * (self.spin - from.spin);
    }
}

impl Floating {
    /// The place and the rates nearest to displacements and their rates (n_vertices, frame axes) in the mass norm.
    pub(super) fn nearest(&self, u: &[Vec3], rate: &[Vec3]) -> (Place, Rates) {
        let (shell, reduced, rigid) = (&self.shell, &self.reduced, &self.rigid);
        let (mass, rest, n) = (&shell.mass, &shell.mesh.positions, self.n());
        let mut place = Place::rest(n);
        if rigid.slides {
            place.slide = (0..u.len()).map(|v| mass[v] * u[v]).sum::<Vec3>() / rigid.mass;
        }
        let goal = |v: usize| rest[v] + u[v] - rigid.pivot - place.slide;
        let project = |forces: &[Vec3], out: &mut Vec<f64>| {
            out.fill(0.0);
            with_fields!(&reduced.fields, fields => fields.project(forces, out));
        };
        let (mut bent, mut turn) = (vec![Vec3::zeros(); u.len()], UnitQuaternion::identity());
        for _ in 0..ROUNDS {
            let turned = self.turn_to(|v| (rest[v] - rigid.pivot + bent[v], goal(v)), &turn);
            let more = rotation::vector(&(turn.inverse() * turned)).norm();
            turn = turned;
            let back = turn.inverse();
            let momentum = |v: usize| (back * goal(v) - (rest[v] - rigid.pivot)) * mass[v];
            project(&(0..u.len()).map(momentum).collect::<Vec<_>>(), &mut place.q);
            with_fields!(&reduced.fields, fields => fields.displacements(&place.q, |v, at| bent[v] = at));
            if more <= TURNED {
                break;
            }
        }
        place.turn = turn;
        let rates = self.nearest_rates(&place, &bent, rate);
        (place, rates)
    }

    /// The turn of the body that brings places (from, to) nearest by mass, from one before.
    fn turn_to(&self, pair: impl Fn(usize) -> (Vec3, Vec3), before: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
        let mass = &self.shell.mass;
        if self.rigid.axes.len() == 3 {
            // About the pivot itself: mirrored pairs have their means there.
            let weighed = |v: usize| {
                let ((from, to), root) = (pair(v), mass[v].sqrt());
                [(from * root, to * root), (-from * root, -to * root)]
            };
            return turn_between(|| (0..mass.len()).flat_map(weighed));
        }
        let axis = self.rigid.axes[0];
        let (mut along, mut across) = (0.0, 0.0);
        for v in 0..mass.len() {
            let (from, to) = pair(v);
            let flat = |x: Vec3| x - axis * axis.dot(&x);
            along += mass[v] * flat(from).dot(&flat(to));
            across += mass[v] * axis.dot(&from.cross(&to));
        }
        if along == 0.0 && across == 0.0 { *before } else { rotation::by(&(axis * libm::atan2(across, along))) }
    }

    fn nearest_rates(&self, place: &Place, bent: &[Vec3], rate: &[Vec3]) -> Rates {
        let (shell, reduced, rigid, n) = (&self.shell, &self.reduced, &self.rigid, self.n());
        let mut rates = Rates::rest(n);
        if rate.iter().all(|rate| *rate == Vec3::zeros()) {
            return rates;
        }
        let back = place.turn.inverse();
        let momenta: Vec<Vec3> = rate.iter().zip(&shell.mass).map(|(v, m)| back * v * *m).collect();
        let mut along = vec![0.0; n + rigid.n()];
        with_fields!(&reduced.fields, fields => fields.project(&momenta, &mut along[..n]));
        let arm = |v: usize| shell.mesh.positions[v] - rigid.pivot + bent[v];
        let spin: Vec3 = momenta.iter().enumerate().map(|(v, p)| arm(v).cross(p)).sum();
        rigid.add_force(&spin, &momenta.iter().sum(), &mut along[n..]);
        let mut moments = Moments::new(n);
        reduced.set_moments(rigid, (&place.q, &rates.q), &mut moments);
        let mut mass = DMatrix::identity(along.len(), along.len());
        rigid.add_mass(&moments, 1.0, &mut mass);
        let Some(factor) = mass.cholesky() else { return rates };
        let found = factor.solve(&DVector::from_column_slice(&along));
        rates.q.copy_from_slice(&found.as_slice()[..n]);
        rates.spin = rigid.turn(&found.as_slice()[n..]);
        rates.slide = place.turn * rigid.slide(&found.as_slice()[n..]);
        rates
    }
}
