//! Which modes a scene needs: given what will act on the shell and how far any vertex may be off, those whose contribution could
//! show.
//!
//! Statics tell how much a load f moves the shell in each mode, φ_k (φ_kᵀf)/λ_k, and what all modes that were not computed add
//! together, the tail u = K⁻¹(f − MΦΦᵀf): one solve a load. A load that comes and goes moves a mode D times as far. For loads of
//! an acceleration a in a direction, or of a size in any, which turn with the shell by up to θ(v) at a vertex, and for handles that
//! move a vertex by d, a mode can move vertex v by at most
//!
//!   c_k(v) = D (|Σ m φ_k·a| + Σ m |φ_k| |a| θ)/λ_k · (|φ_k(v)| + ½ |y(v)| |ψ_k(v)|),
//!
//! y(v) being the whole displacement there; the second term is what an error of w = Ψq changes in R̃(w) y. Modes are left out,
//! the least first, while the sum of the c_k left out and of the tail stays within the tolerance at every vertex.

use super::{Modes, ScaledStiffness};
use crate::error::{require_finite, require_non_negative};
use crate::sparse::Symbolic;
use crate::warp::ModalRotation;
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use faer::Mat;
use nalgebra::Matrix3;

/// What will act on a shell, and how far off a vertex may be.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Demand {
    /// Length.
    pub tolerance: f64,
    /// An acceleration that acts in this direction (frame axes): gravity.
    pub gravity: Vec3,
    /// One of this size that acts in any direction, less gravity: of the frame, or gravity where the frame turns.
    pub acceleration: f64,
    /// Vertices that handles move, and how far from rest.
    pub handles: Vec<u32>,
    /// Length.
    pub distance: f64,
    /// D: 1 for loads that change slowly, 2 for ones that come at once, up to 2/(π ratio) for shaking in time with a mode of
    /// that damping ratio.
    pub amplification: f64,
}

/// The modes that a demand leaves.
pub struct Choice {
    /// Ascending.
    pub keep: Vec<usize>,
    /// No vertex should be off by more, against all modes.
    pub bound: f64,
}

/// The part of the lowest elastic eigenvalue that is added to all, so that a shell which floats can be solved: it takes the same
/// part of the tail at most.
const SHIFT: f64 = 1e-4;

/// Directions in which a vertex gives by less than this part of its softest are not pulled along: a handle that moves there gets
/// there by bending, or not at all.
const STIFF: f64 = 0.1;

impl Demand {
    /// Fails on numbers out of range and on vertices that do not exist.
    pub fn validated(self, shell: &Shell) -> Result<Self> {
        require_non_negative("tolerance", self.tolerance)?;
        require_non_negative("acceleration", self.acceleration)?;
        require_non_negative("handle_distance", self.distance)?;
        require_non_negative("amplification", self.amplification)?;
        self.gravity.iter().try_for_each(|g| require_finite("gravity", *g).map(drop))?;
        let n = shell.mass.len();
        match self.handles.iter().find(|v| **v as usize >= n) {
            Some(v) => Err(Error::argument(format!("a handle is at vertex {v} of {n}"))),
            None => Ok(self),
        }
    }

    /// |f·a| for any a of the demand, where `f` gives the response to a unit acceleration along each axis.
    fn worst(&self, f: &[Vec3; 3]) -> f64 {
        let along = f[0] * self.gravity.x + f[1] * self.gravity.y + f[2] * self.gravity.z;
        along.norm() + self.acceleration * frobenius(f)
    }

    fn size(&self) -> f64 {
        self.gravity.norm() + self.acceleration
    }

    /// The fewest of `modes` that meet the demand, or all with the bound that they reach.
    pub fn choose(&self, shell: &Shell, modes: &Modes) -> Result<Choice> {
        let all = || (0..modes.shapes.len()).collect();
        if modes.zero_modes == modes.shapes.len() {
            let bound = if shell.n_unknowns() == modes.shapes.len() { 0.0 } else { f64::INFINITY };
            return Ok(Choice { keep: all(), bound });
        }
        let responses = Responses::new(self, shell, modes)?;
        let mut off = responses.tail.clone();
        let largest = |field: &[f64]| field.iter().copied().fold(0.0, f64::max);
        let mut order: Vec<(f64, usize)> =
            (modes.zero_modes..modes.shapes.len()).map(|k| (largest(&responses.of_mode(k)), k)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut keep: Vec<bool> = vec![true; modes.shapes.len()];
        let mut bound = largest(&off);
        for (_, k) in order {
            let more: Vec<f64> = off.iter().zip(responses.of_mode(k)).map(|(off, c)| off + c).collect();
            if largest(&more) > self.tolerance {
                break;
            }
            (keep[k], off, bound) = (false, more, bound.max(largest(&off)));
        }
        let bound = bound.max(largest(&off));
        Ok(Choice { keep: (0..keep.len()).filter(|k| keep[*k]).collect(), bound })
    }
}

fn frobenius(f: &[Vec3; 3]) -> f64 {
    f.iter().map(Vec3::norm_squared).sum::<f64>().sqrt()
}

/// Bounds on how far modes and the tail move vertices.
struct Responses<'a> {
    modes: &'a Modes,
    /// Ψ of each mode.
    turns: Vec<Vec<Vec3>>,
    /// Largest amplitude of each mode; 0 for zero modes, which are never left out.
    amplitude: Vec<f64>,
    /// |y| (n_vertices).
    size: Vec<f64>,
    /// Of all modes that were not computed, together (n_vertices).
    tail: Vec<f64>,
}

impl<'a> Responses<'a> {
    fn new(demand: &Demand, shell: &Shell, modes: &'a Modes) -> Result<Self> {
        let rotation = ModalRotation::new(&shell.mesh);
        let turns: Vec<Vec<Vec3>> = modes.shapes.iter().map(|phi| rotation.apply(phi)).collect();
        let (n, amplification) = (shell.mass.len(), demand.amplification);
        let elastic = modes.zero_modes..modes.shapes.len();
        let factor = |k: usize| modes.shapes[k].iter().zip(&shell.mass).map(|(phi, m)| *m * phi).sum::<Vec3>();
        let factors: Vec<Vec3> = (0..modes.shapes.len()).map(factor).collect();
        // The static response in the computed modes, and its rotation, for an acceleration along each axis.
        let response = |fields: &[Vec<Vec3>], v: usize| {
            let axis = |c: usize| elastic.clone().map(|k| fields[k][v] * (factors[k][c] / modes.eigenvalues[k])).sum();
            [axis(0), axis(1), axis(2)]
        };
        let turn: Vec<f64> = (0..n).map(|v| (amplification * demand.worst(&response(&turns, v))).min(2.0)).collect();

        let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
        let uniform = axes.iter().map(|axis| shell.mass.iter().map(|m| *m * axis).collect());
        let turned = axes.iter().map(|axis| shell.mass.iter().zip(&turn).map(|(m, turn)| m * turn * axis).collect());
        let handles: Vec<u32> = demand.handles.iter().copied().filter(|v| !shell.held[*v as usize]).collect();
        let pulls = handles.iter().flat_map(|v| {
            axes.iter().map(|axis| {
                let mut pull = vec![Vec3::zeros(); n];
                pull[*v as usize] = *axis;
                pull
            })
        });
        let tails = tails(shell, modes, &uniform.chain(turned).chain(pulls).collect::<Vec<_>>())?;
        let tail_turns: Vec<Vec<Vec3>> = tails.iter().map(|u| rotation.apply(u)).collect();
        let three = |fields: &[Vec<Vec3>], first: usize, v: usize| [0, 1, 2].map(|c| fields[first + c][v]);

        // Handles: U C⁻¹ d with the compliance C at the vertex, of which a mode gives φφᵀ/λ, in the directions in which it gives.
        let mut reach = vec![0.0f64; modes.shapes.len()];
        let mut handle_size = vec![0.0; n];
        let mut handle_tail = vec![[0.0; 2]; n];
        for (h, v) in handles.iter().enumerate() {
            let at = *v as usize;
            let flexible = |k: usize| modes.shapes[k][at] / modes.eigenvalues[k];
            let column = |w: usize, c: usize| {
                elastic.clone().map(|k| modes.shapes[k][w] * flexible(k)[c]).sum::<Vec3>() + tails[6 + 3 * h + c][w]
            };
            let gives = Matrix3::from_columns(&[column(at, 0), column(at, 1), column(at, 2)]).symmetric_eigen();
            let softest = gives.eigenvalues.amax();
            let pull =
                gives.eigenvalues.map(|c| if c > STIFF * softest { amplification * demand.distance / c } else { 0.0 });
            let force = gives.eigenvectors * Matrix3::from_diagonal(&pull) * gives.eigenvectors.transpose();
            let pulled = |columns: [Vec3; 3]| (Matrix3::from_columns(&columns) * force).norm();
            let mut far = 1.0f64;
            for w in 0..n {
                let u = pulled([column(w, 0), column(w, 1), column(w, 2)]);
                handle_size[w] += u;
                far = far.max(u / (amplification * demand.distance).max(f64::MIN_POSITIVE));
            }
            // Without a mode the handle gives less, and moves the rest the more: once for the mode itself, once for that.
            for k in elastic.clone() {
                reach[k] += (1.0 + far) * (force * flexible(k)).norm();
            }
            for w in 0..n {
                handle_tail[w][0] += (1.0 + far) * pulled(three(&tails, 6 + 3 * h, w));
                handle_tail[w][1] += (1.0 + far) * pulled(three(&tail_turns, 6 + 3 * h, w));
            }
        }

        let size: Vec<f64> = (0..n)
            .map(|v| {
                let (known, tail) = (response(&modes.shapes, v), three(&tails, 0, v));
                let whole = [0, 1, 2].map(|c| known[c] + tail[c]);
                amplification * demand.worst(&whole) + handle_size[v]
            })
            .collect();
        let tail = (0..n)
            .map(|v| {
                let of = |fields: &[Vec<Vec3>]| {
                    demand.worst(&three(fields, 0, v)) + demand.size() * frobenius(&three(fields, 3, v))
                };
                let [handle, handle_turn] = handle_tail[v];
                let (u, w) = (amplification * of(&tails) + handle, amplification * of(&tail_turns) + handle_turn);
                u + 0.5 * size[v] * w
            })
            .collect();
        let amplitude = |k: usize| {
            if modes.eigenvalues[k] == 0.0 {
                return 0.0;
            }
            let straight = factors[k].dot(&demand.gravity).abs() + demand.acceleration * factors[k].norm();
            let turning: f64 = (0..n).map(|v| shell.mass[v] * modes.shapes[k][v].norm() * turn[v]).sum();
            amplification * (straight + demand.size() * turning) / modes.eigenvalues[k] + reach[k]
        };
        let amplitude = (0..modes.shapes.len()).map(amplitude).collect();
        Ok(Self { modes, turns, amplitude, size, tail })
    }

    /// c_k (n_vertices).
    fn of_mode(&self, k: usize) -> Vec<f64> {
        let shown = |v: usize| self.modes.shapes[k][v].norm() + 0.5 * self.size[v] * self.turns[k][v].norm();
        (0..self.size.len()).map(|v| self.amplitude[k] * shown(v)).collect()
    }
}

/// K⁻¹(f − MΦΦᵀf) for each of the `loads` (n_vertices each).
fn tails(shell: &Shell, modes: &Modes, loads: &[Vec<Vec3>]) -> Result<Vec<Vec<Vec3>>> {
    let stiffness = ScaledStiffness::assemble(shell)?;
    let lowest = modes.eigenvalues[modes.zero_modes];
    let symbolic = Symbolic::analyse(stiffness.lower.symbolic(), &shell.points(&shell.free))?;
    let singular = || {
        Error::new(ErrorKind::Numerical, "the stiffness is singular: its statics do not tell which modes are needed")
    };
    let factor = symbolic.cholesky(&stiffness.shifted(-SHIFT * lowest))?.ok_or_else(singular)?;
    let mut solution = Mat::zeros(shell.n_unknowns(), loads.len());
    for (column, load) in loads.iter().enumerate() {
        let mut rest = load.clone();
        for phi in &modes.shapes {
            let share: f64 = phi.iter().zip(load).map(|(phi, f)| phi.dot(f)).sum();
            rest.iter_mut().zip(phi).zip(&shell.mass).for_each(|((f, phi), m)| *f -= share * *m * phi);
        }
        let unknowns = shell.free.iter().flat_map(|v| rest[*v as usize].data.0[0]);
        for (i, (f, root)) in unknowns.zip(&stiffness.root_mass).enumerate() {
            solution[(i, column)] = f / root;
        }
    }
    factor.solve_in_place(solution.as_mut())?;
    let field = |column: usize| {
        let u: Vec<f64> =
            stiffness.root_mass.iter().enumerate().map(|(i, root)| solution[(i, column)] / root).collect();
        shell.scatter(&u)
    };
    Ok((0..loads.len()).map(field).collect())
}
