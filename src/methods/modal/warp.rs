//! The warp by either law of the force, and linear modal analysis.

use super::map::Map;
use crate::Vec3;
use crate::features::Feature;
use crate::load::{BodyLoad, External};
use crate::method::Method;
use crate::methods::ROTATION_RANGE;
use crate::modal::{AnyBasis, ModalBasis, with_basis};
use crate::step::ForceLaw;
use crate::step::guard::Pull;
use crate::step::modal_force::{self, Acting, Scratch};
use crate::step::point_force;
use crate::warp::{self, Amplitudes, Extent, ModalRotation, Placement};

/// Room for projections in the precision that the basis is computed with.
#[derive(Clone)]
enum AnyScratch {
    F32(Scratch<f32>),
    F64(Scratch<f64>),
}

/// u = R̃(Ψq) Φq, or u = Φq.
#[derive(Clone)]
pub struct Warp {
    law: ForceLaw,
    scratch: AnyScratch,
}

impl Warp {
    /// With room for the forces of `basis`.
    pub fn new(basis: &ModalBasis, law: ForceLaw) -> Self {
        let modes = basis.n_amplitudes();
        let scratch = match basis.basis {
            AnyBasis::F32(_) | AnyBasis::I16(_) => AnyScratch::F32(Scratch::new(modes)),
            AnyBasis::F64(_) => AnyScratch::F64(Scratch::new(modes)),
        };
        Self { law, scratch }
    }

    fn amplitudes<'a>(&self, q: &'a [f64]) -> Amplitudes<'a> {
        Amplitudes { q, warped: self.law.warped() }
    }

    /// The law whose J is the derivative of the positions.
    fn tangent_law(&self) -> ForceLaw {
        if self.law.warped() { ForceLaw::VirtualWork } else { ForceLaw::Linear }
    }
}

impl Map for Warp {
    fn method(&self) -> Method {
        match self.law {
            ForceLaw::Rotated => Method::Warp,
            ForceLaw::VirtualWork => Method::VirtualWorkWarp,
            ForceLaw::Linear => Method::LinearModalAnalysis,
        }
    }

    fn law(&self) -> ForceLaw {
        self.law
    }

    fn rotation_range(&self) -> f64 {
        ROTATION_RANGE
    }

    /// Of an acceleration that acts everywhere alike by sums taken once where these suffice, else over all vertices; and of forces on
    /// some vertices.
    fn project(
        &mut self,
        basis: &ModalBasis,
        (load, external): (&BodyLoad, External),
        (q, q_dot): (&[f64], &[f64]),
        force: &mut [f64],
    ) -> Pull {
        let Self { law, scratch } = self;
        let total_mass = basis.shell.total_mass;
        let participation = basis.participation();
        let shortened =
            external.on_all().is_none() && participation.suffices(*law, || basis.bend(law.warped()).largest(q));
        let mut pull = match (load.everywhere_alike(), &basis.basis, scratch) {
            (Some(a), _, _) if shortened => {
                participation.force(*law, a, q, force);
                Pull { body: a.norm(), ..Pull::default() }
            }
            (_, basis, scratch) => {
                let acting = Acting { load, external: external.on_all(), law: *law, q, q_dot, total_mass };
                match (basis, scratch) {
                    (AnyBasis::F32(basis), AnyScratch::F32(scratch)) => {
                        modal_force::project(basis, &acting, scratch, force)
                    }
                    (AnyBasis::F64(basis), AnyScratch::F64(scratch)) if Feature::F64Basis.is_built_in() => {
                        modal_force::project(basis, &acting, scratch, force)
                    }
                    (AnyBasis::I16(basis), AnyScratch::F32(scratch)) if Feature::I16Basis.is_built_in() => {
                        modal_force::project(basis, &acting, scratch, force)
                    }
                    _ => unreachable!("a state's scratch has its basis's precision"),
                }
            }
        };
        if *law == ForceLaw::VirtualWork {
            pull.reach = participation.largest_displacement(q);
        }
        pull.external +=
            with_basis!(&basis.basis, basis => point_force::add(basis, *law, q, external.point_forces(), force));
        pull
    }

    fn positions(
        &self,
        (modal, q): (&ModalBasis, &[f64]),
        placement: &Placement,
        write: impl FnMut(usize, &[[f64; 3]]),
    ) {
        let rest = &modal.shell.mesh.positions;
        with_basis!(&modal.basis, basis =>
            warp::visit_positions_f64(basis, self.amplitudes(q), (rest, placement), write));
    }

    fn positions_f32(
        &self,
        (modal, q): (&ModalBasis, &[f64]),
        placement: &Placement,
        write: impl FnMut(usize, &[[f32; 3]]),
    ) {
        with_basis!(&modal.basis, basis => warp::visit_positions_f32(basis, self.amplitudes(q), placement, write));
    }

    fn positions_of(
        &self,
        (modal, q): (&ModalBasis, &[f64]),
        placement: &Placement,
        vertices: &[u32],
        write: impl FnMut(usize, [f64; 3]),
    ) {
        let rest = &modal.shell.mesh.positions;
        with_basis!(&modal.basis, basis =>
            warp::visit_positions_of_f64(basis, self.amplitudes(q), (rest, placement), vertices, write));
    }

    fn positions_of_f32(
        &self,
        (modal, q): (&ModalBasis, &[f64]),
        placement: &Placement,
        vertices: &[u32],
        write: impl FnMut(usize, [f32; 3]),
    ) {
        with_basis!(&modal.basis, basis =>
            warp::visit_positions_of_f32(basis, self.amplitudes(q), placement, vertices, write));
    }

    /// u = R̃ Φq, |R̃| ≤ 1 and |∂R̃/∂w| ≤ ½: |Δu| ≤ |ΦΔq| + ½ |ΨΔq| |Φq|.
    fn largest_change(&self, modal: &ModalBasis, from: &[f64], q: &[f64]) -> f64 {
        let participation = modal.participation();
        let reach = participation.reach();
        if reach.len() != q.len() {
            return f64::INFINITY; // support fields, too
        }
        let change = |k: usize| (q[k] - from[k]).abs();
        let linear: f64 = (0..q.len()).map(|k| change(k) * reach[k]).sum();
        if !self.law.warped() {
            return linear;
        }
        let bend = modal.bend(true);
        let turn: f64 = (0..q.len()).map(|k| change(k) * bend.of(k)).sum();
        linear + 0.5 * turn * participation.largest_displacement(from)
    }

    fn extent(&self, (modal, q): (&ModalBasis, &[f64])) -> Extent {
        if modal.is_linear() {
            return linear_extent(modal, q);
        }
        let limit = ROTATION_RANGE * ROTATION_RANGE;
        with_basis!(&modal.basis, basis => warp::extent(basis, self.amplitudes(q), limit))
    }

    fn visit_motion(&self, modal: &ModalBasis, motion: (&[f64], &[f64]), visit: impl FnMut(usize, Vec3, Vec3)) {
        with_basis!(&modal.basis, basis => modal_force::visit_motion(basis, self.law, motion, visit));
    }

    fn visit_visible_motion(&self, modal: &ModalBasis, motion: (&[f64], &[f64]), visit: impl FnMut(usize, Vec3, Vec3)) {
        with_basis!(&modal.basis, basis => modal_force::visit_motion(basis, self.tangent_law(), motion, visit));
    }

    fn pull_back(&self, (modal, q): (&ModalBasis, &[f64]), forces: &[(u32, Vec3)], along: &mut [f64]) {
        let (law, forces) = (self.tangent_law(), forces.iter().copied());
        with_basis!(&modal.basis, basis => point_force::add(basis, law, q, forces, along));
    }

    fn step_nanoseconds(&self, basis: &ModalBasis) -> u64 {
        200 + basis.shell.mass.len() as u64 * (1 + basis.n_modes() as u64 / 3)
    }
}

/// How far a basis without Ψ is bent, by w = W(Φq), which is Ψq.
fn linear_extent(modal: &ModalBasis, q: &[f64]) -> Extent {
    let mut u = vec![Vec3::zeros(); modal.shell.mass.len()];
    with_basis!(&modal.basis, basis =>
        modal_force::visit_motion(basis, ForceLaw::Linear, (q, q), |v, displacement, _| u[v] = displacement));
    let turns: Vec<f64> = ModalRotation::new(&modal.shell.mesh).apply(&u).iter().map(Vec3::norm_squared).collect();
    Extent {
        displacement: u.iter().map(Vec3::norm_squared).fold(0.0, f64::max),
        rotation: turns.iter().copied().fold(0.0, f64::max),
        beyond: turns.iter().filter(|turn| **turn > ROTATION_RANGE * ROTATION_RANGE).count(),
    }
}
