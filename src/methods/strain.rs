//! Rotation–strain reconstruction: modal amplitudes move the shell by the map of [`crate::strain`].

use super::Motion;
use super::modal::{Map, Modal, VertexMap};
use crate::load::{BodyLoad, External};
use crate::method::Method;
use crate::modal::{ModalBasis, with_basis};
use crate::step::guard::Pull;
use crate::step::{ForceLaw, Integrator};
use crate::strain::{REACH, RotationStrain, Scratch};
use crate::support::{Pose, Rates};
use crate::warp::{self, Amplitudes, Extent, Placement};
use crate::{Model, Result, Vec3};
use nalgebra::Matrix3;
use std::sync::Arc;

/// The map, with room for its forces.
#[derive(Clone)]
struct Reconstruction {
    basis: Arc<ModalBasis>,
    map: Arc<RotationStrain>,
    scratch: Scratch,
}

/// At rest, undamped.
pub fn build(model: &Model, integrator: Integrator) -> Result<Box<dyn Motion>> {
    let map = model.rotation_strain()?;
    let scratch = map.scratch(&model.modal);
    Ok(Box::new(Modal::new(model, Reconstruction { basis: model.modal.clone(), map, scratch }, integrator)))
}

impl VertexMap for Reconstruction {
    fn displacement(&self, v: usize, q: &[f64]) -> Vec3 {
        self.map.displacement(&self.basis, v, q)
    }

    fn slopes(&self, at: (usize, &Vec3), q: &[f64], visit: &mut dyn FnMut(usize, f64)) {
        self.map.slopes(&self.basis, at, q, visit);
    }

    fn n_fields(&self) -> usize {
        self.map.n_samples()
    }

    fn field(&self, c: usize, v: usize) -> Vec3 {
        self.map.field(c, v)
    }

    fn share(&self, q: &[f64], slopes: bool, shared: &mut Vec<Matrix3<f64>>) {
        self.map.share(q, slopes, shared);
    }
}

impl Map for Reconstruction {
    fn method(&self) -> Method {
        Method::RotationStrain
    }

    fn law(&self) -> ForceLaw {
        ForceLaw::VirtualWork
    }

    fn rotation_range(&self) -> f64 {
        REACH
    }

    fn project(
        &mut self,
        basis: &ModalBasis,
        load: (&BodyLoad, External),
        motion: (&[f64], &[f64]),
        force: &mut [f64],
    ) -> Pull {
        let mut pull = self.map.project(basis, load, motion, &mut self.scratch, force);
        pull.reach = basis.participation().largest_displacement(motion.0);
        pull
    }

    fn positions(&self, at: (&ModalBasis, &[f64]), placement: &Placement, write: impl FnMut(usize, &[[f64; 3]])) {
        self.map.positions(at, placement, write);
    }

    fn positions_f32(&self, at: (&ModalBasis, &[f64]), placement: &Placement, write: impl FnMut(usize, &[[f32; 3]])) {
        self.map.positions_f32(at, placement, write);
    }

    fn positions_of(
        &self,
        at: (&ModalBasis, &[f64]),
        placement: &Placement,
        vertices: &[u32],
        write: impl FnMut(usize, [f64; 3]),
    ) {
        self.map.positions_of(at, placement, vertices, write);
    }

    fn positions_of_f32(
        &self,
        at: (&ModalBasis, &[f64]),
        placement: &Placement,
        vertices: &[u32],
        write: impl FnMut(usize, [f32; 3]),
    ) {
        self.map.positions_of_f32(at, placement, vertices, write);
    }

    fn extent(&self, (modal, q): (&ModalBasis, &[f64])) -> Extent {
        let amplitudes = Amplitudes { q, warped: true };
        let extent = with_basis!(&modal.basis, basis => warp::extent(basis, amplitudes, REACH * REACH));
        Extent { displacement: self.map.reach(modal, q), ..extent }
    }

    fn visit_motion(&self, basis: &ModalBasis, motion: (&[f64], &[f64]), visit: impl FnMut(usize, Vec3, Vec3)) {
        self.map.visit_motion(basis, motion, visit);
    }

    fn pull_back(&self, (modal, q): (&ModalBasis, &[f64]), forces: &[(u32, Vec3)], along: &mut [f64]) {
        let nothing = BodyLoad::new(Vec3::zeros(), &Pose::identity(), &Rates::default());
        let loads = (&nothing, External::OnSome(forces, Pose::identity().rotation));
        let mut pulled = vec![0.0; q.len()];
        self.map.project(modal, loads, (q, q), &mut self.map.scratch(modal), &mut pulled);
        along.iter_mut().zip(pulled).for_each(|(sum, force)| *sum += force);
    }

    fn vertices(&self) -> Option<&dyn VertexMap> {
        Some(self)
    }

    /// Its samples are chosen for modes.
    fn follows_supports(&self) -> bool {
        false
    }

    fn samples(&self) -> Option<(usize, f64)> {
        Some((self.map.n_samples(), self.map.left))
    }

    fn step_nanoseconds(&self, _: &ModalBasis) -> u64 {
        1000 + 200 * self.map.n_samples() as u64
    }
}
