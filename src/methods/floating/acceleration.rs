//! What a floating shell's inertia and damping answer, for the certificate.

use super::{At, Floating, Room, rows};
use crate::Vec3;
use crate::methods::{Acting, Reaction};
use crate::reduced::Flight;
use nalgebra::{DMatrix, DVector};

impl Floating {
    /// Acceleration of the fields' and the rigid coordinates by all forces that elastic ones do not balance, with damping: see
    /// [`Motion::visit_acceleration`]. In the probe's room stay the moments.
    pub(super) fn acceleration(&self, probe: &mut Self, acting: &Acting, reactions: &[Reaction]) -> Vec<f64> {
        let (reduced, rigid, shell) = (&*self.reduced, &*self.rigid, &*self.shell);
        let (place, rates, n) = (&self.place, &self.rates, self.n());
        let turn = place.turn.to_rotation_matrix();
        reduced.set_moments(rigid, (&place.q, &rates.q), &mut probe.room.moments);
        let Room { moments, pull, .. } = &mut probe.room;
        pull.set(shell, reduced, rigid, acting.load, acting.external);
        if let Some(spin) = acting.load.parts().1 {
            let at = Flight { slide: place.slide, turn, q: &place.q, velocity: rates.slide, spin: rates.spin };
            pull.add_spin(rigid, spin, &at, moments);
        }
        let at = At { shell, reduced, rigid, pose: acting.axes.frame, points: None };
        for (v, [force, torque]) in reactions {
            pull.add_at(reduced, (shell.mesh.positions[*v as usize] - rigid.pivot, *v as usize), force);
            if *torque != Vec3::zeros() {
                let ring = rows::ring_of(&mut probe.rings, shell, *v);
                let by_vertex = ring.turn(&rows::places(at, ring, place)).1;
                for (by, v) in by_vertex.iter().zip(&ring.vertices) {
                    let p = shell.mesh.positions[*v as usize] - rigid.pivot;
                    pull.add_at(reduced, (p, *v as usize), &by.tr_mul(torque));
                }
            }
        }
        let mut force = vec![0.0; n + rigid.n()];
        self.elastic().gradient(&place.q, &mut self.elastic().scratch(), &mut force[..n]);
        force.iter_mut().for_each(|f| *f = -*f);
        pull.add_along(rigid, &turn, &place.q, &mut force);
        // Less what the rates alone make of the momenta.
        (0..n).for_each(|k| force[k] -= rates.spin.dot(&moments.swing(k)) - moments.thrust(k, &rates.spin));
        let spread = moments.stirred + moments.stirred.transpose();
        let gained = rates.spin * spread.trace() - spread * rates.spin;
        let torque = gained + rates.spin.cross(&moments.momentum(&rates.spin));
        rigid.add_force(&-torque, &Vec3::zeros(), &mut force[n..]);
        let mut mass = DMatrix::identity(force.len(), force.len());
        rigid.add_mass(moments, 1.0, &mut mass);
        mass.cholesky()
            .map_or(force.clone(), |factor| factor.solve(&DVector::from_column_slice(&force)).as_slice().to_vec())
    }
}
