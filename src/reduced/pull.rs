//! Forces on a shell that moves rigidly beside its fields, summed by what they do to it.

use super::rigid::{Moments, Rigid, crossed};
use super::{ReducedShell, with_fields};
use crate::load::{BodyLoad, External};
use crate::{Shell, Vec3};
use nalgebra::{Matrix3, Rotation3};

/// Forces by what they do: their sum, and Σ F pᵀ and Σ F b_kᵀ, frame axes against body axes.
#[derive(Clone, Default)]
pub struct Pull {
    /// Σ F.
    pub total: Vec3,
    /// Σ F pᵀ.
    pub rest: Matrix3<f64>,
    /// Σ F b_kᵀ.
    pub fields: Vec<Matrix3<f64>>,
}

impl Pull {
    /// None, with room for so many fields.
    pub fn new(n: usize) -> Self {
        Self { fields: vec![Matrix3::zeros(); n], ..Self::default() }
    }

    /// Takes over others, without allocation.
    pub fn copy_from(&mut self, other: &Self) {
        (self.total, self.rest) = (other.total, other.rest);
        self.fields.copy_from_slice(&other.fields);
    }

    /// All of them times a share.
    pub fn scale(&mut self, share: f64) {
        self.total *= share;
        self.rest *= share;
        self.fields.iter_mut().for_each(|field| *field *= share);
    }

    /// Σ F yᵀ at `q`.
    pub fn place(&self, q: &[f64]) -> Matrix3<f64> {
        self.fields.iter().zip(q).fold(self.rest, |sum, (field, q)| sum + *q * field)
    }

    /// Adds what the forces are along fields and rigid coordinates of a shell that is turned by `turn`.
    pub fn add_along(&self, rigid: &Rigid, turn: &Rotation3<f64>, q: &[f64], out: &mut [f64]) {
        let back = turn.matrix().transpose();
        let (fields, motion) = out.split_at_mut(self.fields.len());
        fields.iter_mut().zip(&self.fields).for_each(|(out, field)| *out += turn.matrix().dot(field));
        rigid.add_force(&-crossed(&(back * self.place(q))), &(back * self.total), motion);
    }

    /// Σ F·x but for a constant, at a place.
    pub fn work(&self, slide: &Vec3, turn: &Rotation3<f64>, q: &[f64]) -> f64 {
        self.total.dot(slide) + turn.matrix().dot(&self.place(q))
    }

    /// Sets the loads that stay as they are over a step: a uniform acceleration, forces and wind.
    pub fn set(&mut self, shell: &Shell, reduced: &ReducedShell, rigid: &Rigid, load: &BodyLoad, external: External) {
        let (uniform, _) = load.parts();
        self.total = rigid.mass * uniform;
        self.rest = uniform * rigid.first.transpose();
        self.fields.iter_mut().zip(&rigid.weight).for_each(|(out, weight)| *out = uniform * weight.transpose());
        let rest = &shell.mesh.positions;
        for (v, force) in external.point_forces() {
            self.add_at(reduced, (rest[v as usize] - rigid.pivot, v as usize), &force);
        }
        let Some(forces) = external.on_all() else { return };
        for (v, force) in forces.iter().enumerate() {
            self.total += force;
            self.rest += force * (rest[v] - rigid.pivot).transpose();
        }
        with_fields!(&reduced.fields, fields => fields.project_moments(forces, &mut self.fields));
    }

    /// Adds a force on a vertex with rest place `p`.
    pub fn add_at(&mut self, reduced: &ReducedShell, (p, v): (Vec3, usize), force: &Vec3) {
        self.total += force;
        self.rest += force * p.transpose();
        for (k, out) in self.fields.iter_mut().enumerate() {
            *out += force * with_fields!(&reduced.fields, fields => fields.at(k, v)).transpose();
        }
    }

    /// Adds what a turning frame does, −m (G x + c × ẋ), at the place and the rates `at`, which the moments are of.
    pub fn add_spin(
        &mut self,
        rigid: &Rigid,
        (gradient, coriolis): (&Matrix3<f64>, &Vec3),
        at: &Flight,
        moments: &Moments,
    ) {
        let (across, about) = (coriolis.cross_matrix(), at.spin.cross_matrix());
        let origin = -(gradient * (rigid.pivot + at.slide) + across * at.velocity);
        let (bend, stir) = (gradient * at.turn.matrix(), across * at.turn.matrix());
        let moved = about * moments.first + moments.first_rate;
        self.total += rigid.mass * origin - bend * moments.first - stir * moved;
        let moved = about * moments.spread + moments.stirred;
        self.rest += origin * moments.first.transpose() - bend * moments.spread - stir * moved;
        for (k, out) in self.fields.iter_mut().enumerate() {
            let moved = about * moments.fields[k] + moments.rates[k];
            let force = origin * rigid.weight[k].transpose() - bend * moments.fields[k] - stir * moved;
            *out += force;
            self.rest -= at.q[k] * force; // of the rest places alone
        }
    }
}

/// Where a shell is and how it moves: d, R, q, v and ω.
#[derive(Clone, Copy)]
pub struct Flight<'a> {
    /// d.
    pub slide: Vec3,
    /// R.
    pub turn: Rotation3<f64>,
    /// q.
    pub q: &'a [f64],
    /// v.
    pub velocity: Vec3,
    /// ω, body axes.
    pub spin: Vec3,
}
