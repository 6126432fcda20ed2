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
//!
//! A handle is a load at one vertex, to which hundreds of modes add a little each. Where it is known how fast handles move, their static
//! correction may stand for these modes (MacNeal 1971): what the modes left out answer to pulls at the handles, K⁻¹(f − MΦΦᵀf), made
//! orthonormal in M and in K (Ritz vectors), joins the modes. Then a mode left out is off only by how it swings about its static
//! answer, ω²e + ë = −ä_s: by at most ∫|ä_s|/ω, 2s/ω for a handle that starts and stops at the speed s, and so is a Ritz vector.

use super::{Modes, ScaledStiffness};
use crate::error::{require_finite, require_non_negative};
use crate::warp::ModalRotation;
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use faer::Mat;
use nalgebra::{DMatrix, Matrix3, SymmetricEigen};

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
    /// Axes (of the frame) along which handles hold their vertices; none for all.
    pub axes: [bool; 3],
    /// The fastest that handles move, length/s; 0 for any, and no static correction.
    pub speed: f64,
    /// D: 1 for loads that change slowly, 2 for ones that come at once, up to 2/(π ratio) for shaking in time with a mode of
    /// that damping ratio.
    pub amplification: f64,
}

/// The modes that a demand leaves.
pub struct Choice {
    /// Ascending.
    pub keep: Vec<usize>,
    /// Ritz values, ascending, and vectors of the static correction for handles.
    pub corrections: Vec<(f64, Vec<Vec3>)>,
    /// No vertex should be off by more, against all modes.
    pub bound: f64,
}

/// The part of the lowest elastic eigenvalue that is added to all, so that a shell which floats can be solved: it takes the same
/// part of the tail at most.
const SHIFT: f64 = 1e-4;

/// Directions in which a vertex gives by less than this part of its softest are not pulled along: a handle that moves there gets
/// there by bending, or not at all.
const STIFF: f64 = 0.1;

/// Of the stiffest answer to a pull, what one that others give already has left at most.
const REPEATED: f64 = 1e-9;

impl Demand {
    /// Fails on numbers out of range and on vertices that do not exist.
    pub fn validated(self, shell: &Shell) -> Result<Self> {
        require_non_negative("tolerance", self.tolerance)?;
        require_non_negative("demand_acceleration", self.acceleration)?;
        require_non_negative("handle_distance", self.distance)?;
        require_non_negative("handle_speed", self.speed)?;
        require_non_negative("demand_amplification", self.amplification)?;
        self.gravity.iter().try_for_each(|g| require_finite("demand_gravity", *g).map(drop))?;
        let n = shell.mass.len();
        match self.handles.iter().find(|v| **v as usize >= n) {
            Some(v) => Err(Error::argument(format!("a handle is at vertex {v} of {n}"))),
            None => Ok(self),
        }
    }

    /// Axes along which handles hold.
    pub fn held(&self) -> [bool; 3] {
        if self.axes == [false; 3] { [true; 3] } else { self.axes }
    }

    fn beyond_range(&self) -> Error {
        let [x, y, z] = self.gravity.data.0[0];
        let loads = format!("demand_gravity [{x:e}, {y:e}, {z:e}], demand_acceleration {:e}", self.acceleration);
        let moves = format!("handle_distance {:e}, demand_amplification {:e}", self.distance, self.amplification);
        let message = format!("{loads}, {moves}: they would move the shell beyond the range of numbers");
        Error::new(ErrorKind::Numerical, message)
    }

    /// |f·a| for any a of the demand, where `f` gives the response to a unit acceleration along each axis.
    fn worst(&self, f: &[Vec3; 3]) -> f64 {
        let along = f[0] * self.gravity.x + f[1] * self.gravity.y + f[2] * self.gravity.z;
        along.norm() + self.acceleration * frobenius(f)
    }

    fn size(&self) -> f64 {
        self.gravity.norm() + self.acceleration
    }

    /// The fewest of `modes` that meet the demand, with static corrections where these make them fewer; or all with the bound that
    /// they reach. In a `linear` scene nothing turns.
    pub fn choose(&self, shell: &Shell, modes: &Modes, linear: bool) -> Result<Choice> {
        if modes.zero_modes == modes.shapes.len() {
            let bound = if shell.n_freedoms() == modes.shapes.len() { 0.0 } else { f64::INFINITY };
            return Ok(Choice { keep: (0..modes.shapes.len()).collect(), corrections: vec![], bound });
        }
        let responses = Responses::new(self, shell, modes, linear)?;
        let plain = responses.choose(false);
        if self.speed == 0.0 || self.distance == 0.0 || responses.statics.handles.is_empty() {
            return Ok(plain);
        }
        let corrected = responses.choose(true);
        let fields = |choice: &Choice| choice.keep.len() + choice.corrections.len();
        let [off, less_off] = [&plain, &corrected].map(|choice| (choice.bound - self.tolerance).max(0.0));
        let better = less_off < off || (less_off == off && fields(&corrected) < fields(&plain));
        Ok(if better { corrected } else { plain })
    }

    /// Of what a mode with the eigenvalue λ answers to handles, how much it is off where their static correction is there.
    fn swing(&self, lambda: f64) -> f64 {
        let still = self.amplification * self.distance * lambda.sqrt();
        f64::min(1.0, 2.0 * self.speed / still.max(f64::MIN_POSITIVE))
    }
}

fn frobenius(f: &[Vec3; 3]) -> f64 {
    f.iter().map(Vec3::norm_squared).sum::<f64>().sqrt()
}

/// Bounds on how far modes and the tail move vertices; by loads, and by handles.
struct Responses<'a> {
    statics: Statics<'a>,
    /// Largest amplitude of each mode; 0 for zero modes, which are never left out.
    amplitude: Vec<[f64; 2]>,
    /// |y| (n_vertices).
    size: Vec<f64>,
    /// Of all modes that were not computed, together (n_vertices).
    tail: Vec<[f64; 2]>,
    /// The handles' pulls: the vertex's number among the handles, and a direction in which it gives.
    pulls: Vec<(usize, Vec3)>,
    /// Forces in these directions at most (pulls).
    strength: Vec<f64>,
}

impl<'a> Responses<'a> {
    fn new(demand: &'a Demand, shell: &'a Shell, modes: &'a Modes, linear: bool) -> Result<Self> {
        let statics = Statics::new(demand, shell, modes, linear)?;
        let n = shell.mass.len();
        let mut pulled = Pulled {
            size: vec![0.0; n],
            reach: vec![0.0; modes.shapes.len()],
            tail: vec![[0.0; 2]; n],
            pulls: vec![],
            strength: vec![],
        };
        (0..statics.handles.len()).for_each(|h| statics.pull(h, &mut pulled));
        let Pulled { size, reach, tail, pulls, strength } = pulled;
        let size: Vec<f64> = (0..n).map(|v| statics.size(v) + size[v]).collect();
        let tail = (0..n).map(|v| {
            let shown = |[u, turn]: [f64; 2]| u + 0.5 * size[v] * turn;
            [shown(statics.tail(v)), shown(tail[v])]
        });
        let tail = tail.collect();
        let of_mode = |k: usize| statics.amplitude(&modes.shapes[k], modes.eigenvalues[k]);
        let amplitude = (0..modes.shapes.len()).map(|k| [of_mode(k), reach[k]]).collect();
        let made = Self { statics, amplitude, size, tail, pulls, strength };
        if made.is_finite() { Ok(made) } else { Err(demand.beyond_range()) }
    }

    /// Bounds and what they are sums of.
    fn is_finite(&self) -> bool {
        let pairs = self.amplitude.iter().chain(&self.tail).flatten();
        let largest: f64 = pairs.chain(&self.size).chain(&self.strength).sum();
        (largest * (1.0 + self.size.iter().sum::<f64>())).is_finite()
    }

    /// The fewest modes within the tolerance, `corrected` by Ritz vectors or not; all where they are too few.
    fn choose(&self, corrected: bool) -> Choice {
        let Statics { modes, demand, .. } = &self.statics;
        let largest = |field: &[f64]| field.iter().copied().fold(0.0, f64::max);
        let mut order: Vec<(f64, usize)> =
            self.statics.elastic().map(|k| (largest(&self.of_mode(k, corrected)), k)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let without = |count: usize| {
            let left_out: Vec<usize> = order[..count].iter().map(|(_, k)| *k).collect();
            let corrections = if corrected { self.corrections(&left_out) } else { vec![] };
            let last = modes.eigenvalues[modes.eigenvalues.len() - 1];
            let share = if corrected { demand.swing(last) } else { 1.0 };
            let mut off: Vec<f64> = self.tail.iter().map(|[loads, handles]| loads + share * handles).collect();
            let mut add = |field: Vec<f64>| off.iter_mut().zip(field).for_each(|(off, c)| *off += c);
            left_out.iter().for_each(|k| add(self.of_mode(*k, corrected)));
            corrections.iter().for_each(|(lambda, shape)| add(self.of_correction(*lambda, shape)));
            let keep = (0..modes.shapes.len()).filter(|k| !left_out.contains(k)).collect();
            Choice { keep, corrections, bound: largest(&off) }
        };
        // The more are left out the larger the bound: halving finds how many may be.
        let (mut most, mut too_many) = (0, order.len() + 1);
        let mut choice = without(0);
        while too_many - most > 1 {
            let middle = most + (too_many - most) / 2;
            let tried = without(middle);
            if tried.bound <= demand.tolerance {
                (most, choice) = (middle, tried);
            } else {
                too_many = middle;
            }
        }
        choice
    }

    /// c_k (n_vertices).
    fn of_mode(&self, k: usize, corrected: bool) -> Vec<f64> {
        let Statics { modes, demand, turns, .. } = &self.statics;
        let share = if corrected { demand.swing(modes.eigenvalues[k]) } else { 1.0 };
        let [loads, handles] = self.amplitude[k];
        self.shown(loads + share * handles, &modes.shapes[k], &turns[k])
    }

    /// What a Ritz vector may be off (n_vertices).
    fn of_correction(&self, lambda: f64, shape: &[Vec3]) -> Vec<f64> {
        let Statics { demand, handles, rotation, .. } = &self.statics;
        let turns = rotation.as_ref().map_or(vec![Vec3::zeros(); shape.len()], |rotation| rotation.apply(shape));
        let pulled = self.pulls.iter().zip(&self.strength);
        let by_handles: f64 =
            pulled.map(|((h, along), force)| force * shape[handles[*h] as usize].dot(along).abs() / lambda).sum();
        self.shown(self.statics.amplitude(shape, lambda) + demand.swing(lambda) * by_handles, shape, &turns)
    }

    /// Displacement with what its turn changes, at an amplitude.
    fn shown(&self, amplitude: f64, shape: &[Vec3], turns: &[Vec3]) -> Vec<f64> {
        let shown = |v: usize| amplitude * (shape[v].norm() + 0.5 * self.size[v] * turns[v].norm());
        (0..self.size.len()).map(shown).collect()
    }

    /// Ritz values and vectors of what the modes left out, computed or not, answer to the handles' pulls: with the answers u,
    /// (uᵀKu) z = θ (uᵀMu) z and uᵀKu = fᵀu.
    fn corrections(&self, left_out: &[usize]) -> Vec<(f64, Vec<Vec3>)> {
        let Statics { modes, shell, handles, tails, .. } = &self.statics;
        let answer = |(h, along): &(usize, Vec3)| -> Vec<Vec3> {
            let mut u: Vec<Vec3> = (0..shell.mass.len())
                .map(|v| AXES.iter().map(|c| along[*c] * tails[PULLS + 3 * h + c][v]).sum())
                .collect();
            for &k in left_out {
                let amplitude = self.statics.flexibility(*h, k).dot(along);
                u.iter_mut().zip(&modes.shapes[k]).for_each(|(u, phi)| *u += amplitude * phi);
            }
            u
        };
        let answers: Vec<Vec<Vec3>> = self.pulls.iter().map(answer).collect();
        let m = answers.len();
        let stiffness = DMatrix::from_fn(m, m, |i, j| {
            let along = |(h, along): &(usize, Vec3), u: &[Vec3]| u[handles[*h] as usize].dot(along);
            0.5 * (along(&self.pulls[i], &answers[j]) + along(&self.pulls[j], &answers[i]))
        });
        let scale: Vec<f64> = (0..m).map(|i| 1.0 / stiffness[(i, i)].max(f64::MIN_POSITIVE).sqrt()).collect();
        let scaled = SymmetricEigen::new(DMatrix::from_fn(m, m, |i, j| scale[i] * stiffness[(i, j)] * scale[j]));
        let largest = scaled.eigenvalues.amax();
        let own: Vec<usize> = (0..m).filter(|i| scaled.eigenvalues[*i] > REPEATED * largest).collect();
        let white = DMatrix::from_fn(m, own.len(), |i, j| {
            scale[i] * scaled.eigenvectors[(i, own[j])] / scaled.eigenvalues[own[j]].sqrt()
        });
        let mass = DMatrix::from_fn(m, m, |i, j| {
            (0..shell.mass.len()).map(|v| shell.mass[v] * answers[i][v].dot(&answers[j][v])).sum::<f64>()
        });
        let inverse = SymmetricEigen::new(white.tr_mul(&mass) * &white); // of the Ritz values
        let vectors = white * inverse.eigenvectors;
        let mut found: Vec<(f64, Vec<Vec3>)> = (0..own.len())
            .filter(|r| inverse.eigenvalues[*r] > 0.0)
            .map(|r| {
                let weight = |i: usize| vectors[(i, r)] / inverse.eigenvalues[r].sqrt();
                let shape = |v: usize| (0..m).map(|i| weight(i) * answers[i][v]).sum();
                (1.0 / inverse.eigenvalues[r], (0..shell.mass.len()).map(shape).collect())
            })
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found
    }
}

/// How the shell answers unit loads, in the computed modes and in the tail.
struct Statics<'a> {
    demand: &'a Demand,
    shell: &'a Shell,
    modes: &'a Modes,
    /// Of displacements; none where the scene is linear and nothing turns.
    rotation: Option<ModalRotation>,
    /// Ψ of each mode.
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
    /// See [`Responses`].
    pulls: Vec<(usize, Vec3)>,
    strength: Vec<f64>,
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
            rotation: None,
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
        statics.rotation = rotation;
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
        for (along, strength) in gives.eigenvectors.column_iter().zip(&strength).filter(|(_, s)| **s > 0.0) {
            pulled.pulls.push((h, along.into_owned()));
            pulled.strength.push((1.0 + far) * strength);
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

    /// How far loads move a field of an eigenvalue, without handles.
    fn amplitude(&self, shape: &[Vec3], lambda: f64) -> f64 {
        let Self { demand, shell, .. } = self;
        if lambda == 0.0 {
            return 0.0;
        }
        let factor: Vec3 = shape.iter().zip(&shell.mass).map(|(phi, m)| *m * phi).sum();
        let straight = factor.dot(&demand.gravity).abs() + demand.acceleration * factor.norm();
        let moments = shape.iter().zip(&shell.mass).zip(&self.turn);
        let turning: f64 = moments.map(|((phi, m), turn)| m * phi.norm() * turn).sum();
        demand.amplification * (straight + demand.size() * turning) / lambda
    }
}

/// K⁻¹(f − MΦΦᵀf) for each of the `loads` (n_vertices each).
fn tails(shell: &Shell, modes: &Modes, loads: &[Vec<Vec3>]) -> Result<Vec<Vec<Vec3>>> {
    let stiffness = ScaledStiffness::assemble(shell)?;
    let lowest = modes.eigenvalues[modes.zero_modes];
    let symbolic = shell.analysis(stiffness.lower.symbolic())?;
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
    stiffness.project(shell, solution.as_mut());
    factor.solve_in_place(solution.as_mut())?;
    let field = |column: usize| {
        let u: Vec<f64> =
            stiffness.root_mass.iter().enumerate().map(|(i, root)| solution[(i, column)] / root).collect();
        shell.scatter(&u)
    };
    Ok((0..loads.len()).map(field).collect())
}
