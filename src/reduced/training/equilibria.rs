//! The equilibria of the full shell that a training takes, found on several threads.

use super::{TrainingLoads, added};
use crate::clock::Instant;
use crate::reference::{EquilibriumOptions, FreeMotions, Load, Solver};
use crate::threads::{GoOn, for_each_long};
use crate::{Error, ErrorKind, Result, Shell, Vec3};
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
/// Of a load, what an equilibrium of a shell that moves freely may leave.
const BALANCED: f64 = 1e-4;
/// What a pose of a shell that floats counts as, in iterations.
const OF_A_BALANCE: usize = 8;
/// Solvers at once, each with a factor of its own: some tens of megabytes for 10^4 vertices.
const MOST_SOLVERS: usize = 8;
/// Poses that are nearer than this, in model sizes, are the same.
const SAME: f64 = 1e-6;

/// An equilibrium of the full shell to train on.
pub(in crate::reduced) struct TrainingPose {
    /// The number of its load.
    pub(in crate::reduced) load: usize,
    /// Whether all of the load is balanced, or the part that was before the search grew long.
    pub(in crate::reduced) whole: bool,
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
    shell: &'a Shell,
    loads: Vec<Vec<Vec3>>,
    /// Loads to take, the first of the list.
    wanted: usize,
    started: Instant,
    time: f64,
    /// Whether the shell can move freely.
    floats: bool,
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
        let loads = self.loads(shell);
        let wanted = count.min(loads.len());
        let mut chains: Vec<Chain> = (0..wanted.min(loads.len() / 2))
            .map(|first| Chain { first, found: vec![], ends: vec![], taken: 0 })
            .collect();
        let search = Search {
            shell,
            loads,
            wanted,
            started: Instant::now(),
            time,
            floats: self.free.is_some(),
            left,
            all: AtomicUsize::new(0),
        };
        let n_chains = chains.len() as f64;
        for_each_long(
            &mut chains,
            MOST_SOLVERS,
            || Solver::new(shell.clone()),
            |solver, chain, go_on| {
                // Chains begin in their order: all that ended were before this one.
                if search.all.load(Ordering::SeqCst) >= left {
                    return Ok(());
                }
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
}

impl Search<'_> {
    /// From half a load to the whole, where the half is wanted, and in quarters of it at first.
    fn follow(&self, solver: &mut Solver, chain: &mut Chain, go_on: GoOn) -> Result<()> {
        let size = self.shell.mesh.size;
        let mut pose = vec![Vec3::zeros(); self.shell.mass.len()];
        let half = chain.first + self.loads.len() / 2;
        let max_iterations = (ITERATED / pose.len()).clamp(LEAST_ITERATIONS, TRAINING.max_iterations);
        let first_increment = if half < self.wanted { 0.5 } else { 0.25 };
        let options = EquilibriumOptions { first_increment, max_iterations, ..TRAINING };
        for load in [half, chain.first].into_iter().filter(|load| *load < self.wanted) {
            go_on()?;
            if self.in_time(chain.taken).is_err() {
                break;
            }
            if self.floats {
                let from = (&pose[..], &self.loads[load][..]);
                chain.taken += OF_A_BALANCE;
                let Some(displacement) = balanced(solver, from, max_iterations, go_on)? else { break };
                pose.clone_from(&displacement);
                chain.found.push(TrainingPose { load, whole: true, displacement });
                chain.ends.push(chain.taken);
                continue;
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
            let displacement = solver.reached();
            let way = displacement.iter().zip(&pose).map(|(u, last)| (u - last).norm()).fold(0.0, f64::max);
            if way <= SAME * size {
                break;
            }
            pose.clone_from(&displacement);
            chain.found.push(TrainingPose { load, whole, displacement });
            chain.ends.push(chain.taken);
            if !whole {
                break;
            }
        }
        Ok(())
    }

    fn in_time(&self, taken: usize) -> Result<()> {
        match taken < self.left && self.started.elapsed().as_secs_f64() < self.time {
            true => Ok(()),
            false => Err(Error::new(ErrorKind::Numerical, "no time is left")),
        }
    }
}

/// From displacements `start` to where a shell that moves freely balances what of a load does not set it in motion, turned to nearest to rest;
/// none where none is found.
fn balanced(
    solver: &mut Solver,
    (start, load): (&[Vec3], &[Vec3]),
    solves: usize,
    go_on: GoOn,
) -> Result<Option<Vec<Vec3>>> {
    let shell = solver.shell().clone();
    let moving = load.iter().map(|f| f.norm_squared()).sum::<f64>().sqrt();
    let under = Load { at: &|_| load.to_vec(), follows: false, held: 0.0, moving, still: true, foreign: false };
    let found = match solver.correct(start, &under, solves, &mut |_| go_on()) {
        Ok(found) => found,
        Err(error) if error.kind == ErrorKind::Numerical => return Ok(None),
        Err(error) => return Err(error),
    };
    if !(found.force[1] <= BALANCED && found.short == 0.0) {
        return Ok(None);
    }
    let rest = &shell.mesh.positions;
    let mut x = added(&added(rest, start), &found.way);
    FreeMotions::new(&shell, std::iter::empty(), &x).align(&shell, &mut x, rest);
    Ok(Some(x.iter().zip(rest).map(|(x, rest)| x - rest).collect()))
}
