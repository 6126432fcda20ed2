//! The methods by which a shell moves: a room each, behind one trait.
//!
//! A room holds a method's unknowns, its step, its equilibrium, what it makes of constraints, and its output. The state around it
//! has the frame, the loads, the time and the rest; it knows [`Motion`] alone.

mod floating;
pub mod modal;
mod nodal;
pub mod plan;
mod reduced;
mod strain;

pub use crate::method::Method;
pub use nodal::rotations;

use crate::constraint::{Constraint, ConstraintSet};
use crate::load::{BodyLoad, External};
use crate::modal::ModalBasis;
use crate::point_energy::InFrame;
use crate::reduced::Form;
use crate::step::Integrator;
use crate::support::{Axes, Passage, Pose};
use crate::warp::{Extent, Placement};
use crate::{Error, ErrorKind, Model, Result, Vec3};
use nalgebra::UnitQuaternion;
use plan::{Around, Part};
use std::sync::Arc;

/// Beyond a quarter turn the warp's own error exceeds a fifth of the displacement (closed form of a strip bent to an arc).
pub const ROTATION_RANGE: f64 = std::f64::consts::FRAC_PI_2;

/// What acts on a shell in a step or at an equilibrium. The load is in frame axes.
#[derive(Clone, Copy)]
pub struct Acting<'a> {
    /// Gravity and inertia.
    pub load: &'a BodyLoad,
    /// Forces on vertices and wind.
    pub external: External<'a>,
    /// Energies of points that join, in world space as seen from the frame.
    pub points: Option<&'a InFrame>,
    /// Where supports that move in the frame are at the end of the step.
    pub supports: Option<SupportTargets<'a>>,
    /// At the end of the step.
    pub axes: Axes<'a>,
    /// How the frame gets there, where it moves and does not hold the shell.
    pub passage: Option<Passage>,
    /// As in the call before but for the points: the same loads, from the same unknowns and for the same time.
    pub again: bool,
}

/// Where moving supports go.
#[derive(Clone, Copy)]
pub struct SupportTargets<'a> {
    /// Off their places in the frame (supported vertices with mass, ascending).
    pub displacement: &'a [Vec3],
    /// They are there without having moved: nothing feels inertia of it.
    pub jump: bool,
}

/// Force and torque of a constraint, or of an energy of points, on a vertex (frame axes).
pub type Reaction = (u32, [Vec3; 2]);

/// Takes the rotation of a vertex.
pub type WriteRotation<'a> = dyn FnMut(usize, UnitQuaternion<f64>) + 'a;

/// Hears what is left of the force in a search, relative, and may stop it with an error.
pub type Watch<'a> = dyn FnMut(f64) -> Result<()> + 'a;

/// Rayleigh damping and a ratio per mode: c = ξ + ζλ + 2 ratio √λ.
#[derive(Clone, Debug, Default)]
pub struct Damping {
    /// ξ, 1/s.
    pub mass_coefficient: f64,
    /// ζ, s.
    pub stiffness_coefficient: f64,
    /// Of critical, per mode; empty for none, one value for all modes.
    pub ratios: Vec<f64>,
    /// What ξ and ratios are multiplied by at each vertex (n_vertices); empty for 1 everywhere. A mode's ratio is by the mean over its motion.
    pub factors: Arc<[f64]>,
}

impl Damping {
    /// 2 ratio √λ of each mode, by its mean factor. Fails unless there is a ratio for none, all alike or each.
    fn by_ratio(&self, basis: &ModalBasis) -> Result<Vec<f64>> {
        let mut by_ratio = self.uniform_by_ratio(&basis.eigenvalues)?;
        if !self.factors.is_empty() && by_ratio.iter().any(|c| *c > 0.0) {
            by_ratio.iter_mut().zip(basis.means(&self.factors)).for_each(|(c, mean)| *c *= mean);
        }
        Ok(by_ratio)
    }

    fn uniform_by_ratio(&self, eigenvalues: &[f64]) -> Result<Vec<f64>> {
        let (given, modes) = (self.ratios.len(), eigenvalues.len());
        if given > 1 && given != modes {
            let message = format!("{given} damping ratios for {modes} modes: give none, 1 or {modes}");
            return Err(Error::argument(message));
        }
        let ratio = |k: usize| self.ratios.get(k).or(self.ratios.first()).copied().unwrap_or(0.0);
        Ok(eigenvalues.iter().enumerate().map(|(k, lambda)| 2.0 * ratio(k) * lambda.sqrt()).collect())
    }
}

/// A shell that moves by some method. Displacements are from rest, in frame axes, by vertex.
///
/// A function that fails changes nothing. Output hands out rows to closures, some at a time where kernels make them so.
pub trait Motion: Send + Sync {
    /// Which method it is.
    fn method(&self) -> Method;
    /// An independent copy.
    fn try_clone(&self) -> Result<Box<dyn Motion>>;
    /// Back to rest; constraints and damping stay.
    fn reset(&mut self);
    /// No speed.
    fn stop(&mut self);

    /// One step of `h` > 0 seconds.
    fn step(&mut self, acting: &Acting, h: f64) -> Result<()>;
    /// The static solution from the present shape. Returns the residual relative to the load, and the iterations. `watch` may stop it with an
    /// error; then, as where none is found, nothing has changed.
    fn settle(&mut self, acting: &Acting, watch: &mut Watch) -> Result<(f64, usize)>;
    /// Takes the motion nearest to displacements and their rates (n_vertices) in the mass norm.
    fn project_from(&mut self, u: &[Vec3], rate: &[Vec3]) -> Result<()>;
    /// The pose that was just taken is one of modes or fields.
    fn come_from_fields(&mut self) {}
    /// Whether the pose is such a one still.
    fn comes_from_fields(&self) -> bool {
        false
    }
    /// The last step left every bit as it was.
    fn is_unchanged(&self) -> bool {
        false
    }
    /// How far any vertex can still move under the forces of the last step, where that is known.
    fn motion_left(&self) -> Option<f64> {
        None
    }
    /// About how long a step takes without forces and wind.
    fn step_nanoseconds(&self) -> u64;

    /// Supports may move against each other.
    fn follows_supports(&self) -> bool {
        false
    }
    /// Puts supports where they are, displaced in the frame (supported vertices with mass), at rest there.
    fn place_supports(&mut self, _displacement: &[Vec3]) {}
    /// How far any support is from where the method shows it.
    fn supports_missed(&self, _displacement: &[Vec3]) -> f64 {
        0.0
    }

    /// A step feels the forces of where it starts, and not those of where it ends.
    fn feels_start(&self) -> bool {
        false
    }

    /// Whether the steps that follow are parts and rounds of one, which together may take no more work than one.
    fn share_work(&mut self, _sharing: bool) {}

    /// Makes room for steps in which energies act on so many points.
    fn expect_points(&mut self, _n: usize) {}

    /// Where vertices are placed from the mesh, on a rest shape that moves (n_vertices, world space): told before steps and output there, by those
    /// whose energy is of the shape.
    fn carry(&mut self, _axes: Option<&[Pose]>) {}

    /// The support frame holds it and takes it along.
    fn is_held(&self) -> bool {
        true
    }

    /// The full nonlinear shell, which others are measured by.
    fn is_full_shell(&self) -> bool {
        false
    }
    /// Loads are felt beside the weight that a sagged shell carries where it is linearised.
    fn is_about_sag(&self) -> bool {
        false
    }
    /// [`Motion::settle`] finds the forces of a turning frame by itself.
    fn settles_spin(&self) -> bool {
        false
    }

    /// Unknowns and their rates.
    fn unknowns(&self) -> [Vec<f64>; 2];
    /// Unknowns and their rates, into what a call before this filled: then without allocation.
    fn copy_unknowns(&self, into: &mut [Vec<f64>; 2]);
    /// Takes what [`Motion::unknowns`] gave, or what is representable.
    fn set_unknowns(&mut self, unknowns: [&[f64]; 2]);
    /// Number of unknowns.
    fn n_unknowns(&self) -> usize;
    /// Whether unknowns and rates give finite positions and energies.
    fn is_representable(&self, unknowns: [&[f64]; 2]) -> bool;
    /// Rest angles of creases that yield, in the order of the energy's; they are unknowns too.
    fn rest_angles(&self) -> Vec<f64> {
        vec![]
    }
    /// Takes rest angles of creases that yield, as many as there are.
    fn set_rest_angles(&mut self, _angles: &[f64]) {}
    /// What the unknowns mean something by.
    fn fingerprint(&self) -> u64;
    /// Modal amplitudes and their rates.
    fn amplitudes(&self) -> Result<(&[f64], &[f64])> {
        unsupported("amplitudes")
    }
    /// Replaces them; any numbers, any lengths.
    fn set_amplitudes(&mut self, _q: &[f64], _q_dot: &[f64]) -> Result<()> {
        unsupported("amplitudes")
    }

    /// Replaces all damping; numbers are not negative. Returns whether anything changed.
    fn set_damping(&mut self, damping: &Damping) -> Result<bool>;
    /// Those that act.
    fn constraints(&self) -> &ConstraintSet;
    /// Changes them, with room for their work afterwards. See `change`.
    fn change_constraints(&mut self, change: &mut dyn FnMut(&mut ConstraintSet));
    /// Fails on a constraint that the method cannot take.
    fn check_constraint(&self, _constraint: &Constraint) -> Result<()> {
        Ok(())
    }

    /// Hands the placed positions of all vertices to `write`, in order: the first vertex of some, and their rows.
    fn positions(&self, placement: &Placement, write: &mut dyn FnMut(usize, &[[f64; 3]]));
    /// The same in the precision of the basis, rounded to f32.
    fn positions_f32(&self, placement: &Placement, write: &mut dyn FnMut(usize, &[[f32; 3]]));
    /// How far any vertex is, at most, from where it is at the unknowns `from` (frame axes); infinite where that is not known.
    fn largest_change(&self, _from: &[f64]) -> f64 {
        f64::INFINITY
    }
    /// The positions of some vertices, to the same bits: the place in the list, and the row.
    fn positions_of(&self, placement: &Placement, vertices: &[u32], write: &mut dyn FnMut(usize, [f64; 3]));
    /// As [`Motion::positions_of`], for [`Motion::positions_f32`].
    fn positions_of_f32(&self, placement: &Placement, vertices: &[u32], write: &mut dyn FnMut(usize, [f32; 3]));
    /// Hands `frame` times the rotation of every vertex from rest to `write`, in order.
    fn rotations(&self, frame: UnitQuaternion<f64>, write: &mut WriteRotation) -> Result<()>;
    /// Hands displacement and rate of every vertex to `visit`, in order, as loads feel them.
    fn visit_motion(&self, visit: &mut dyn FnMut(usize, Vec3, Vec3));
    /// The same as positions move.
    fn visit_visible_motion(&self, visit: &mut dyn FnMut(usize, Vec3, Vec3)) {
        self.visit_motion(visit);
    }
    /// Hands J g of every vertex to `visit`, in order: J = ∂u/∂q as the method's law has it, and g = q̈ + Cq̇
    /// are the generalized forces, those of constraints among them, that its own elastic forces do not balance.
    fn visit_acceleration(&self, acting: &Acting, reactions: &[Reaction], visit: &mut dyn FnMut(usize, Vec3));
    /// No vertex is further from rest by more than some orders of magnitude.
    fn largest_displacement(&self) -> f64;
    /// How far it is bent; beyond [`Motion::rotation_range`], or a quarter turn.
    fn extent(&self) -> Extent;
    /// The rotation, rad, beyond which positions are no longer good, if there is one.
    fn rotation_range(&self) -> Option<f64> {
        None
    }
    /// Elastic and kinetic energy.
    fn energies(&self) -> (f64, f64);
    /// The root mean square displacement, by mass, that the last step got wrong, as its stages tell; 0 where they do not.
    fn step_error(&self) -> f64 {
        0.0
    }
    /// Steps since rest whose search ended short of its tolerance.
    fn unconverged_steps(&self) -> u64 {
        0
    }

    /// What a step does, and what it leaves out.
    fn plan(&self, around: &Around) -> Vec<Part>;
}

impl dyn Motion {
    /// What a change of the constraints gives.
    pub fn change<T>(&mut self, change: impl FnOnce(&mut ConstraintSet) -> T) -> T {
        let (mut change, mut changed) = (Some(change), None);
        self.change_constraints(&mut |set| changed = change.take().map(|change| change(set)));
        changed.expect("a method changes its constraints when it is asked to")
    }
}

/// At rest, undamped. `integrator` is for modal methods and the full shell. Fails when the model lacks what the method needs.
pub fn build(model: &Model, method: Method, integrator: Integrator) -> Result<Box<dyn Motion>> {
    model.require(method)?;
    let of_modes = if integrator == Integrator::SecondOrder { Integrator::Exact } else { integrator };
    match method {
        Method::Warp | Method::VirtualWorkWarp | Method::LinearModalAnalysis => modal::build(model, method, of_modes),
        Method::RotationStrain => strain::build(model, of_modes),
        Method::ImplicitShell | Method::ExplicitShell => nodal::build(model, method, integrator),
        Method::ReducedShell => reduced::build(model, Form::Sampled),
        Method::PolynomialShell => reduced::build(model, Form::Polynomial),
        Method::AdaptiveShell => reduced::build_adaptive(model),
    }
}

fn unsupported<T>(what: &str) -> Result<T> {
    Err(Error::new(ErrorKind::Unsupported, format!("{what}: this state's method has no modes")))
}

/// Fails with the first vertex whose value is none.
pub fn all_finite<T>(what: &str, values: &[T], good: impl Fn(&T) -> bool) -> Result<()> {
    match values.iter().position(|value| !good(value)) {
        None => Ok(()),
        Some(v) => {
            let message = format!("the {what} at vertex {v} is beyond the range of numbers");
            Err(Error::new(ErrorKind::Numerical, message))
        }
    }
}

fn write_rotations(
    rotations: Vec<UnitQuaternion<f64>>,
    frame: UnitQuaternion<f64>,
    write: &mut WriteRotation,
) -> Result<()> {
    all_finite("rotation", &rotations, |r| r.coords.iter().all(|c| c.is_finite()))?;
    rotations.into_iter().enumerate().for_each(|(v, r)| write(v, frame * r));
    Ok(())
}
