//! How modal amplitudes move a shell: u(q), its derivative J = ∂u/∂q, and the modal force of loads.

use super::VertexMap;
use crate::Vec3;
use crate::load::{BodyLoad, External};
use crate::method::Method;
use crate::modal::ModalBasis;
use crate::step::ForceLaw;
use crate::step::guard::Pull;
use crate::warp::{Extent, Placement};

/// A map of a modal method. All axes are the frame's.
pub trait Map: Clone + Send + Sync + 'static {
    /// The method that moves by it.
    fn method(&self) -> Method;
    /// What its modal force is made by.
    fn law(&self) -> ForceLaw;
    /// Rotation, rad, up to which positions are good.
    fn rotation_range(&self) -> f64;
    /// Sets the modal force at amplitudes and rates `motion`; returns how strongly the loads pull.
    fn project(
        &mut self,
        basis: &ModalBasis,
        load: (&BodyLoad, External),
        motion: (&[f64], &[f64]),
        force: &mut [f64],
    ) -> Pull;
    /// Hands the positions of all vertices at `q` to `write`, in order: the first vertex of some, and their rows.
    fn positions(&self, at: (&ModalBasis, &[f64]), placement: &Placement, write: impl FnMut(usize, &[[f64; 3]]));
    /// The same in the basis's precision, rounded to f32.
    fn positions_f32(&self, at: (&ModalBasis, &[f64]), placement: &Placement, write: impl FnMut(usize, &[[f32; 3]]));
    /// The positions of some vertices, to the same bits: the place in the list, and the row.
    fn positions_of(
        &self,
        at: (&ModalBasis, &[f64]),
        placement: &Placement,
        vertices: &[u32],
        write: impl FnMut(usize, [f64; 3]),
    );
    /// As [`Map::positions_of`], for [`Map::positions_f32`].
    fn positions_of_f32(
        &self,
        at: (&ModalBasis, &[f64]),
        placement: &Placement,
        vertices: &[u32],
        write: impl FnMut(usize, [f32; 3]),
    );
    /// How far any vertex is, at most, at `q` from where it is at `from`; infinite where that is not known.
    fn largest_change(&self, _: &ModalBasis, _from: &[f64], _q: &[f64]) -> f64 {
        f64::INFINITY
    }
    /// How far the shell is bent at `q`.
    fn extent(&self, at: (&ModalBasis, &[f64])) -> Extent;
    /// Hands u and Jq̇ of every vertex to `visit`, in order, J as the law of the force has it.
    fn visit_motion(&self, basis: &ModalBasis, motion: (&[f64], &[f64]), visit: impl FnMut(usize, Vec3, Vec3));
    /// The same with the derivative of the positions.
    fn visit_visible_motion(&self, basis: &ModalBasis, motion: (&[f64], &[f64]), visit: impl FnMut(usize, Vec3, Vec3)) {
        self.visit_motion(basis, motion, visit);
    }
    /// Adds Jᵀ of forces on vertices to `along` (modes), J the derivative of the positions. Allocates.
    fn pull_back(&self, at: (&ModalBasis, &[f64]), forces: &[(u32, Vec3)], along: &mut [f64]);
    /// What moves single vertices, where it is not the warp.
    fn vertices(&self) -> Option<&dyn VertexMap> {
        None
    }
    /// Whether it moves with support fields.
    fn follows_supports(&self) -> bool {
        true
    }
    /// Sampled triangles that turn the shell, and what they leave of what all would do; none where vertices turn.
    fn samples(&self) -> Option<(usize, f64)> {
        None
    }
    /// About how long a step takes.
    fn step_nanoseconds(&self, basis: &ModalBasis) -> u64;
}
