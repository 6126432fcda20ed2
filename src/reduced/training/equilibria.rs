//! The equilibria of the full shell that a training takes, found on several threads.
//!
//! A shell that moves freely is pinned in as many directions as there are motions, and each load is balanced at rest first. So the pins bear
//! only what the bend makes of a load, and the search is that of a held shell. Where handles will hold it, they do so under gravity and
//! pressure. The shape found is then turned to nearest to rest.

use super::{TrainingLoads, added};
use crate::clock::Instant;
use crate::reference::{AtRest, EquilibriumOptions, FreeMotions, Held, Solver};
use crate::threads::{GoOn, for_each_long};
use crate::{Error, ErrorKind, Result, Shell, Vec3};
use nalgebra::Matrix3;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Fields are compressed to far less than this tolerance. Most equilibria take 5 to 20 iterations, those of a shell that buckles some 100s.
/// They are worth it (a leaf under its own weight), but take most of the time on large meshes: there the last shape before has to do.
/// Where the shell snaps, fields for the shape before that are wanted, not for the one that it falls to.
const TRAINING: EquilibriumOptions =
    EquilibriumOptions { tolerance: 1e-5, first_increment: 0.5, max_iterations: 400, follow_snaps: false };
/// Iterations times vertices, at most, but no less than [`LEAST_ITERATIONS`].
const ITERATED: usize = 800_000;
const LEAST_ITERATIONS: usize = 100;
/// Solvers at once, each with a factor of its own: some tens of megabytes for 10^4 vertices.
const MOST_SOLVERS: usize = 16;
/// Poses that are nearer than this, in model sizes, are the same.
const SAME: f64 = 1e-6;

/// An equilibrium of the full shell to train on.
pub(in crate::reduced) struct TrainingPose {
    /// The number of its load.
    pub(in crate::reduced) load: usize,
    /// Whether all of the load is balanced, or the part that was before the search grew long.
    pub(in crate::reduced) whole: bool,
    /// Whether a handle led there.
    pub(in crate::reduced) led: bool,
    pub(in crate::reduced) displacement: Vec<Vec3>,
}

/// What follows from each other: half a load and the whole.
struct Chain {
    /// The number of the whole.
    first: usize,
    found: Vec<TrainingPose>,
    /// Iterations up to the end of each of those, and in all.
    ends: Vec<usize>,
    taken: usize,
}

/// What chains share.
struct Search<'a> {
    of: &'a TrainingLoads,
    /// That the loads are of, and what is solved for.
    shell: &'a Arc<Shell>,
    /// Under loads on all of it, and under pulls.
    pinned: [Arc<Shell>; 2],
    loads: Vec<Vec<Vec3>>,
    /// Loads to take, the first of the list.
    wanted: usize,
    started: Instant,
    time: f64,
    /// Iterations that all may take, and what chains have taken that ended.
    left: usize,
    all: AtomicUsize,
}

impl TrainingLoads {
    /// Equilibria of the full shell under at most `count` loads, or under a part of those that are not found whole; those that are not found
    /// within the `time`, and so many iterations, are left out. The same on any number of threads, but for the time.
    pub(in crate::reduced) fn train(
        &self,
        shell: &Arc<Shell>,
        (count, time, left): (usize, f64, usize),
        watch: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<Vec<TrainingPose>> {
        if count == 0 || time == 0.0 || left == 0 {
            return Ok(vec![]);
        }
        let mut loads = self.loads(shell);
        if let Some(free) = &self.free {
            loads.iter_mut().for_each(|load| free.balance(shell, &shell.mesh.positions, load));
        }
        let pinned = self.pinned(shell)?;
        let wanted = count.min(loads.len());
        let mut chains: Vec<Chain> = (0..wanted.min(self.list.len()))
            .map(|first| Chain { first, found: vec![], ends: vec![], taken: 0 })
            .collect();
        let search = Search {
            of: self,
            shell,
            pinned,
            loads,
            wanted,
            started: Instant::now(),
            time,
            left,
            all: AtomicUsize::new(0),
        };
        let at_rest = search.tangents_at_rest(chains.iter().map(|chain| self.kind(chain.first)))?;
        let n_chains = chains.len() as f64;
        let mut order: Vec<&mut Chain> = chains.iter_mut().collect();
        if time == f64::INFINITY && left == usize::MAX {
            order.sort_by_key(|chain| !self.load(chain.first).is_long()); // so that none is begun where the others end
        }
        for_each_long(
            &mut order,
            MOST_SOLVERS,
            || Ok([None, None, None]),
            |solvers: &mut [Option<Solver>; 3], chain, go_on| {
                // Where iterations are bounded chains begin in their order: all that ended were before this one.
                if search.all.load(Ordering::SeqCst) >= left {
                    return Ok(());
                }
                let kind = self.kind(chain.first);
                let solver = match &mut solvers[kind] {
                    Some(solver) => solver,
                    none => none.insert(Solver::new(search.pinned.get(kind).unwrap_or(shell).clone())?),
                };
                solver.begin_by(at_rest.get(kind).cloned().flatten());
                let followed = search.follow(solver, chain, go_on);
                search.all.fetch_add(chain.taken, Ordering::SeqCst);
                followed
            },
            &mut |done| watch(done as f64 / n_chains),
        )?;
        // Of what was found, what one chain after the other would have had iterations for: so it does not depend on who was first.
        let (mut before, mut found) = (0, vec![]);
        for chain in chains {
            let in_time = |(_, end): &(TrainingPose, usize)| before + end <= left;
            let kept = chain.found.into_iter().zip(chain.ends).take_while(in_time);
            found.extend(kept.map(|(pose, _)| pose));
            before += chain.taken;
        }
        Ok(found)
    }

    /// Whether a load is on all of the shell, 0, or a pull, 1, or what a handle does, 2.
    fn kind(&self, load: usize) -> usize {
        if self.lead(load).is_some() { 2 } else { usize::from(!self.load(load).is_distributed()) }
    }

    /// What is solved for under loads on all of the shell, and under pulls.
    fn pinned(&self, shell: &Arc<Shell>) -> Result<[Arc<Shell>; 2]> {
        let Some(free) = &self.free else { return Ok([shell.clone(), shell.clone()]) };
        let rest = &shell.mesh.positions;
        let alone = Arc::new(shell.pinned(free.pins(rest))?);
        if self.handles.vertices.is_empty() {
            return Ok([alone.clone(), alone]);
        }
        let axes = |v: &usize| (0..3).map(|axis| (*v as u32, Vec3::ith(axis, 1.0))).collect::<Vec<_>>();
        let mut pins: Vec<(u32, Vec3)> = self.handles.vertices.iter().flat_map(axes).collect();
        let held = pins.iter().map(|(v, n)| (*v, Held::Along(*n)));
        pins.extend(FreeMotions::new(shell, held, rest).pins(rest));
        Ok([Arc::new(shell.pinned(pins)?), alone])
    }
}

impl Search<'_> {
    /// What chains under loads on all of the shell, and under pulls, begin by, where several of these `kinds` do.
    fn tangents_at_rest(&self, kinds: impl Iterator<Item = usize>) -> Result<[Option<Arc<AtRest>>; 2]> {
        let (mut of, same) = ([0; 3], Arc::ptr_eq(&self.pinned[0], &self.pinned[1]));
        kinds.for_each(|kind| of[if same { kind & 2 } else { kind }] += 1);
        let find = |kind: usize| match of[kind] {
            0 | 1 => Ok(None),
            _ => Solver::new(self.pinned[kind].clone())?.tangent_at_rest(),
        };
        let first = find(0)?;
        let second = if same { first.clone() } else { find(1)? };
        Ok([first, second])
    }

    /// From half a load to the whole, where the half is wanted, and in quarters of it at first.
    fn follow(&self, solver: &mut Solver, chain: &mut Chain, go_on: GoOn) -> Result<()> {
        let size = self.shell.mesh.size;
        let mut pose = vec![Vec3::zeros(); self.shell.mass.len()];
        let half = self.of.halved.iter().position(|k| *k == chain.first).map(|k| self.of.list.len() + k);
        let half = half.filter(|half| *half < self.wanted);
        let max_iterations = (ITERATED / pose.len()).clamp(LEAST_ITERATIONS, TRAINING.max_iterations);
        let first_increment = if half.is_some() { 0.5 } else { 0.25 };
        let options = EquilibriumOptions { first_increment, max_iterations, ..TRAINING };
        for load in half.into_iter().chain([chain.first]) {
            go_on()?;
            if self.in_time(chain.taken).is_err() {
                break;
            }
            let lead = self.of.lead(load);
            if let Some(lead) = lead {
                let share = if half == Some(load) { 0.5 } else { 1.0 };
                solver.set_constraints(Matrix3::identity(), self.of.handles.led(self.shell, lead, share), &pose)?;
            }
            let taken = &mut chain.taken;
            let watch = &mut |_| {
                *taken += 1;
                go_on().and_then(|()| self.in_time(*taken))
            };
            let whole = match solver.equilibrium(&pose, &self.loads[load], &options, watch) {
                Ok(_) => true,
                Err(error) if error.kind == ErrorKind::Numerical => false,
                Err(error) => return Err(error),
            };
            if lead.is_some() && !whole {
                break; // the constraints are met part of the way
            }
            let displacement = solver.reached();
            let way = displacement.iter().zip(&pose).map(|(u, last)| (u - last).norm()).fold(0.0, f64::max);
            if way <= SAME * size {
                break;
            }
            pose.clone_from(&displacement);
            chain.found.push(TrainingPose {
                load,
                whole,
                led: lead.is_some(),
                displacement: self.nearest(displacement),
            });
            chain.ends.push(chain.taken);
            if !whole {
                break;
            }
        }
        Ok(())
    }

    /// A shape of the pinned shell, where that moves freely turned to nearest to rest.
    fn nearest(&self, displacement: Vec<Vec3>) -> Vec<Vec3> {
        if Arc::ptr_eq(self.shell, &self.pinned[0]) {
            return displacement;
        }
        let rest = &self.shell.mesh.positions;
        let mut x = added(rest, &displacement);
        FreeMotions::new(self.shell, std::iter::empty(), &x).align(self.shell, &mut x, rest);
        x.iter().zip(rest).map(|(x, rest)| x - rest).collect()
    }

    fn in_time(&self, taken: usize) -> Result<()> {
        match taken < self.left && self.started.elapsed().as_secs_f64() < self.time {
            true => Ok(()),
            false => Err(Error::new(ErrorKind::Numerical, "no time is left")),
        }
    }
}
