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
//! y(v) being the whole displacement there; the second term is what an error of w = Ψq changes in R̃(w) y. Under linear modal
//! analysis nothing turns: θ = 0 and no ψ. Modes are left out,
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

    /// The fewest of `modes` that meet the demand, or all with the bound that they reach. In a `linear` scene nothing turns.
    pub fn choose(&self, shell: &Shell, modes: &Modes, linear: bool) -> Result<Choice> {
        let all = || (0..modes.shapes.len()).collect();
        if modes.zero_modes == modes.shapes.len() {
            let bound = if shell.n_unknowns() == modes.shapes.len() { 0.0 } else { f64::INFINITY };
            return Ok(Choice { keep: all(), bound });
        }
        let responses = Responses::new(self, shell, modes, linear)?;
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
    fn new(demand: &Demand, shell: &Shell, modes: &'a Modes, linear: bool) -> Result<Self> {
        let statics = Statics::new(demand, shell, modes, linear)?;
        let n = shell.mass.len();
        let mut pulled = Pulled { size: vec![0.0; n], reach: vec![0.0; modes.shapes.len()], tail: vec![[0.0; 2]; n] };
        (0..statics.handles.len()).for_each(|h| statics.pull(h, &mut pulled));
        let size: Vec<f64> = (0..n).map(|v| statics.size(v) + pulled.size[v]).collect();
        let tail = (0..n).map(|v| {
            let ([u, w], [by_handles, turn]) = (statics.tail(v), pulled.tail[v]);
            u + by_handles + 0.5 * size[v] * (w + turn)
        });
        let tail = tail.collect();
        let amplitude = (0..modes.shapes.len()).map(|k| statics.amplitude(k) + pulled.reach[k]).collect();
        Ok(Self { modes, turns: statics.turns, amplitude, size, tail })
    }

    /// c_k (n_vertices).
    fn of_mode(&self, k: usize) -> Vec<f64> {
        let shown = |v: usize| self.modes.shapes[k][v].norm() + 0.5 * self.size[v] * self.turns[k][v].norm();
        (0..self.size.len()).map(|v| self.amplitude[k] * shown(v)).collect()
    }
}

/// How the shell answers unit loads, in the computed modes and in the tail.
struct Statics<'a> {
    demand: &'a Demand,
    shell: &'a Shell,
    modes: &'a Modes,
    /// Ψ of each mode; zeros where the scene is linear and nothing turns.
    turns: Vec<Vec<Vec3>>,
    /// Σ m φ_k.
    factors: Vec<Vec3>,
    /// θ (n_vertices).
    turn: Vec<f64>,
    /// Those that the supports leave free.
    handles: Vec<u32>,
    /// Tails of an acceleration along each axis, of the same with θ at each vertex, and of a pull at each handle along each axis.
    tails: Vec<Vec<Vec3>>,
    /// Their rotations.
    tail_turns: Vec<Vec<Vec3>>,
}

const AXES: [usize; 3] = [0, 1, 2];
/// Where the three tails of the turned acceleration and those of the handles begin.
const TURNED: usize = 3;
const PULLS: usize = 6;

/// Three fields, from `first`, at a vertex.
fn three(fields: &[Vec<Vec3>], first: usize, v: usize) -> [Vec3; 3] {
    AXES.map(|c| fields[first + c][v])
}

/// What handles add to the bounds.
struct Pulled {
    /// |y| (n_vertices).
    size: Vec<f64>,
    /// Largest amplitude of each mode.
    reach: Vec<f64>,
    /// Displacement and rotation by the tail (n_vertices).
    tail: Vec<[f64; 2]>,
}

impl<'a> Statics<'a> {
    fn new(demand: &'a Demand, shell: &'a Shell, modes: &'a Modes, linear: bool) -> Result<Self> {
        let rotation = (!linear).then(|| ModalRotation::new(&shell.mesh));
        let rotated = |u: &Vec<Vec3>| rotation.as_ref().map_or(vec![Vec3::zeros(); u.len()], |w| w.apply(u));
        let factor = |phi: &Vec<Vec3>| phi.iter().zip(&shell.mass).map(|(phi, m)| *m * phi).sum::<Vec3>();
        let handles = demand.handles.iter().copied().filter(|v| !shell.held[*v as usize]).collect();
        let mut statics = Self {
            demand,
            shell,
            modes,
            turns: modes.shapes.iter().map(rotated).collect(),
            factors: modes.shapes.iter().map(factor).collect(),
            turn: vec![],
            handles,
            tails: vec![],
            tail_turns: vec![],
        };
        let turn = |v: usize| demand.amplification * demand.worst(&statics.response(&statics.turns, v));
        statics.turn = (0..shell.mass.len()).map(|v| turn(v).min(2.0)).collect();
        statics.tails = tails(shell, modes, &statics.loads())?;
        statics.tail_turns = statics.tails.iter().map(rotated).collect();
        Ok(statics)
    }

    fn elastic(&self) -> std::ops::Range<usize> {
        self.modes.zero_modes..self.modes.shapes.len()
    }

    /// The static answer of `fields` that go with the modes, to an acceleration along each axis.
    fn response(&self, fields: &[Vec<Vec3>], v: usize) -> [Vec3; 3] {
        let share = |k: usize, c: usize| self.factors[k][c] / self.modes.eigenvalues[k];
        AXES.map(|c| self.elastic().map(|k| fields[k][v] * share(k, c)).sum())
    }

    /// Those of the tails.
    fn loads(&self) -> Vec<Vec<Vec3>> {
        let (mass, axis) = (&self.shell.mass, |c: usize| Vec3::ith(c, 1.0));
        let uniform = AXES.map(|c| mass.iter().map(|m| *m * axis(c)).collect());
        let turned = AXES.map(|c| mass.iter().zip(&self.turn).map(|(m, turn)| m * turn * axis(c)).collect());
        let pulls = self.handles.iter().flat_map(|v| {
            AXES.map(|c| {
                let mut pull = vec![Vec3::zeros(); mass.len()];
                pull[*v as usize] = axis(c);
                pull
            })
        });
        uniform.into_iter().chain(turned).chain(pulls).collect()
    }

    /// φ_k at handle `h`, over λ_k.
    fn flexibility(&self, h: usize, k: usize) -> Vec3 {
        self.modes.shapes[k][self.handles[h] as usize] / self.modes.eigenvalues[k]
    }

    /// How far vertex `v` goes where a force of 1 pulls handle `h` along each axis.
    fn compliance(&self, h: usize, v: usize) -> Matrix3<f64> {
        let modes = |c: usize| self.elastic().map(move |k| self.modes.shapes[k][v] * self.flexibility(h, k)[c]);
        Matrix3::from_columns(&AXES.map(|c| modes(c).sum::<Vec3>() + self.tails[PULLS + 3 * h + c][v]))
    }

    /// Adds what handle `h` does: U C⁻¹ d with the compliance C at its vertex, in the directions in which this gives.
    fn pull(&self, h: usize, pulled: &mut Pulled) {
        let distance = self.demand.amplification * self.demand.distance;
        let gives = self.compliance(h, self.handles[h] as usize).symmetric_eigen();
        let softest = gives.eigenvalues.amax();
        let strength = gives.eigenvalues.map(|c| if c > STIFF * softest { distance / c } else { 0.0 });
        let force = gives.eigenvectors * Matrix3::from_diagonal(&strength) * gives.eigenvectors.transpose();
        let mut far = 1.0f64;
        for (v, size) in pulled.size.iter_mut().enumerate() {
            let u = (self.compliance(h, v) * force).norm();
            *size += u;
            far = far.max(u / distance.max(f64::MIN_POSITIVE));
        }
        // Without a mode the handle gives less, and moves the rest the more: once for the mode itself, once for that.
        for k in self.elastic() {
            pulled.reach[k] += (1.0 + far) * (force * self.flexibility(h, k)).norm();
        }
        for (v, tail) in pulled.tail.iter_mut().enumerate() {
            let by = |fields| (Matrix3::from_columns(&three(fields, PULLS + 3 * h, v)) * force).norm();
            tail[0] += (1.0 + far) * by(&self.tails);
            tail[1] += (1.0 + far) * by(&self.tail_turns);
        }
    }

    /// |y| at vertex `v`, without handles.
    fn size(&self, v: usize) -> f64 {
        let (known, tail) = (self.response(&self.modes.shapes, v), three(&self.tails, 0, v));
        self.demand.amplification * self.demand.worst(&AXES.map(|c| known[c] + tail[c]))
    }

    /// Displacement and rotation of vertex `v` by the tail, without handles.
    fn tail(&self, v: usize) -> [f64; 2] {
        let of = |fields: &[Vec<Vec3>]| {
            let turned = self.demand.size() * frobenius(&three(fields, TURNED, v));
            self.demand.amplification * (self.demand.worst(&three(fields, 0, v)) + turned)
        };
        [of(&self.tails), of(&self.tail_turns)]
    }

    /// How far loads move mode `k`, without handles.
    fn amplitude(&self, k: usize) -> f64 {
        let Self { demand, factors, modes, .. } = self;
        if modes.eigenvalues[k] == 0.0 {
            return 0.0;
        }
        let straight = factors[k].dot(&demand.gravity).abs() + demand.acceleration * factors[k].norm();
        let moments = modes.shapes[k].iter().zip(&self.shell.mass).zip(&self.turn);
        let turning: f64 = moments.map(|((phi, m), turn)| m * phi.norm() * turn).sum();
        demand.amplification * (straight + demand.size() * turning) / modes.eigenvalues[k]
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
