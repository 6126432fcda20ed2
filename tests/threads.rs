//! The pool that steps many states: every item once, the same bits on any number of threads, no thread before it is needed and
//! none after it was told to go. One test: the pool belongs to the process.
#![allow(missing_docs)]
mod common;
use common::*;
use shellwarp::constraint::{Constraint, Target};
use shellwarp::material::ElasticSheet;
use shellwarp::model::{Model, Options};
use shellwarp::reference::{Rayleigh, Solver};
use shellwarp::sparse::{BlockMatrix, Symbolic};
use shellwarp::state::{Method, State};
use shellwarp::step::Integrator;
use shellwarp::threads::{Tasks, for_each, for_each_long, set_threads, share};
use shellwarp::{Error, ErrorKind, Mesh, Shell, Supports, reduced};
use shellwarp::{Vec3, threads};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Names of the process's threads that are the pool's; none where the system does not tell.
fn pool_threads() -> Vec<String> {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let names = tasks.filter_map(|task| std::fs::read_to_string(task.path().join("comm")).ok());
    let mut names: Vec<_> = names.map(|name| name.trim().to_owned()).filter(|n| n.starts_with("shellwarp-")).collect();
    names.sort();
    names
}

/// A thread takes its name, and leaves the system's list, a moment after it was made or joined. The hour ends a hung test only.
fn wait_for(names: &[&str]) {
    let patience = Instant::now();
    while pool_threads() != names {
        assert!(patience.elapsed() < Duration::from_secs(3600), "{:?} instead of {names:?}", pool_threads());
        std::thread::yield_now();
    }
}

fn visits(count: usize, nanoseconds: impl Fn(usize) -> u64 + Sync) -> Vec<u32> {
    let mut items: Vec<(usize, u32)> = (0..count).map(|i| (i, 0)).collect();
    for_each(&mut items, |(i, _)| nanoseconds(*i), |(_, visits)| *visits += 1);
    items.into_iter().map(|(_, visits)| visits).collect()
}

/// A thousand small states and two large ones after some steps: all their saved bytes.
fn motion(models: &[Arc<Model>]) -> Vec<Vec<u8>> {
    let state = |i: usize| {
        let model = &models[usize::from(i % 500 == 7)];
        let method = [Method::Warp, Method::VirtualWorkWarp, Method::LinearModalAnalysis][i % 3];
        let mut state = State::new(model.clone(), method, Integrator::Exact).unwrap();
        state.set_gravity(Vec3::new(0.0, 0.1, -0.5) * (1.0 + i as f64 / 100.0)).unwrap();
        state
    };
    let mut states: Vec<State> = (0..1000).map(state).collect();
    for _ in 0..3 {
        for_each(&mut states, State::step_nanoseconds, |state| state.step(1.0 / 30.0).unwrap());
    }
    states.iter().map(State::save).collect()
}

fn model(name: &str) -> Arc<Model> {
    let options = Options { modes: 8, ..Options::default() };
    Arc::new(Model::precompute(Arc::new(reference(name).0), &options, &mut |_, _| Ok(())).unwrap())
}

/// The saved bytes of a reduced shell that was trained.
fn trained() -> Vec<u8> {
    let reduced = reduced::Options { fields: 6, poses: 40, ..Default::default() };
    let options = Options { modes: 4, reduced, ..Options::default() };
    Model::precompute(Arc::new(reference("flat_beam").0), &options, &mut |_, _| Ok(())).unwrap().save().unwrap()
}

/// Long work has threads of its own, so that steps find the pool's free.
fn long_work_is_done_once_and_heard_of_on_the_calling_thread() {
    let caller = std::thread::current().id();
    let run = |failing: usize, most: usize| {
        let mut items: Vec<(usize, u32)> = (0..50).map(|i| (i, 0)).collect();
        let mut heard = 0;
        let outcome = for_each_long(
            &mut items,
            most,
            || Ok(()),
            |(), (i, visits), go_on| {
                *visits += 1;
                std::thread::sleep(Duration::from_millis(1));
                go_on()?;
                if *i == failing { Err(Error::new(ErrorKind::Numerical, "that one")) } else { Ok(()) }
            },
            &mut |done| {
                assert_eq!(std::thread::current().id(), caller);
                assert!(done <= 50);
                heard += 1;
                if failing == usize::MAX - 1 && heard == 3 {
                    return Err(Error::new(ErrorKind::Cancelled, "enough"));
                }
                Ok(())
            },
        );
        (outcome.map_err(|error| error.kind), items.into_iter().map(|(_, visits)| visits).collect::<Vec<_>>())
    };
    for most in [0, 1, 3, 100] {
        assert_eq!(run(usize::MAX, most), (Ok(()), vec![1; 50]), "{most}");
        let (outcome, visits) = run(7, most);
        assert_eq!(outcome, Err(ErrorKind::Numerical), "{most}");
        assert!(visits.iter().all(|v| *v <= 1) && visits.contains(&0), "the others were given up: {visits:?}");
        assert_eq!(run(usize::MAX - 1, most).0, Err(ErrorKind::Cancelled), "{most}");
    }
}

/// Eight threads of which two still work: each of these shares with three that are done, both at once.
fn the_last_of_long_work_share_alike_with_threads_that_are_done() {
    assert!(set_threads(8));
    let inside = [const { AtomicUsize::new(0) }; 2];
    let mut items: Vec<usize> = (0..8).collect();
    let done = for_each_long(
        &mut items,
        8,
        || Ok(()),
        |(), item, _| {
            let Some(own) = inside.get(*item) else { return Ok(()) };
            while threads::sharers(u64::MAX) < 4 {
                std::thread::yield_now();
            }
            share(u64::MAX, |threads| {
                assert_eq!(threads, 4);
                own.fetch_add(1, Ordering::SeqCst);
                while inside.iter().any(|calls| calls.load(Ordering::SeqCst) == 0) {
                    std::thread::yield_now();
                }
            });
            Ok(())
        },
        &mut |_| Ok(()),
    );
    assert!(done.is_ok());
    assert_eq!(inside.map(AtomicUsize::into_inner), [4, 4]);
}

/// What two works tell is heard on the calling thread; an error of either, or of who hears, ends both.
fn two_works_are_done_and_heard_of_on_the_calling_thread() {
    let caller = std::thread::current().id();
    let run = |failing: usize, most: f64| {
        let mut shares = vec![];
        let work = |k: usize| {
            move |watch: threads::Watch| {
                (1..5).try_for_each(|step| watch(f64::from(step) / 4.0))?;
                if k == failing { Err(Error::new(ErrorKind::Numerical, "that one")) } else { Ok(k) }
            }
        };
        let outcome = threads::both(work(1), work(2), &mut |share| {
            assert_eq!(std::thread::current().id(), caller);
            shares.push(share);
            if share > most { Err(Error::new(ErrorKind::Cancelled, "enough")) } else { Ok(()) }
        });
        assert!(shares.is_sorted() && shares.iter().all(|share| (0.0..=1.0).contains(share)), "{shares:?}");
        let stopped = shares.last().is_some_and(|share| *share > most);
        (outcome.map_err(|error| error.kind), stopped)
    };
    for count in [1, 2, 5] {
        assert!(set_threads(count));
        assert_eq!(run(0, 2.0).0, Ok((1, 2)), "{count} threads");
        assert_eq!([1, 2].map(|failing| run(failing, 2.0).0), [Err(ErrorKind::Numerical); 2], "{count} threads");
        let (outcome, stopped) = run(0, 0.1); // not stopped where another thread did both before this one heard
        assert_eq!(outcome, if stopped { Err(ErrorKind::Cancelled) } else { Ok((1, 2)) }, "{count} threads");
        assert!(stopped || count > 1);
    }
}

/// Shells whose factors and elements are shared: the paper's energy on one that hangs by a side, Koiter's on one that slides along two.
fn large() -> Vec<Arc<Shell>> {
    let (positions, triangles) = equilateral_sheet(44, 44, 1.0 / 44.0);
    let side = |near: &dyn Fn(&Vec3) -> bool| -> Vec<u32> {
        (0..positions.len() as u32).filter(|v| near(&positions[*v as usize])).collect()
    };
    let along = side(&|x| x.y < 0.01 && x.x > 0.1).into_iter().map(|v| (v, Vec3::new(0.0, 1.0, 0.5))).collect();
    let supports = Supports { fixed: side(&|x| x.x < 0.02), along, ..Supports::default() };
    let sheet = ElasticSheet { young: 1e6, poisson: 0.3, thickness: 1e-3, volume_density: 1000.0 };
    let sheet = Shell::new(Mesh::new(positions.clone(), &triangles).unwrap(), sheet, &supports).unwrap();
    vec![Arc::new(leaf(2)), Arc::new(sheet)]
}

/// Bits of displacements and velocities after some steps under weight.
fn stepped(shell: &Arc<Shell>, strength: f64) -> Vec<u64> {
    let mut solver = Solver::new(shell.clone()).unwrap();
    let still = vec![Vec3::zeros(); shell.mass.len()];
    let (mut u, mut velocity) = (still.clone(), still);
    let weight: Vec<Vec3> = shell.mass.iter().map(|m| Vec3::new(0.3, -0.2, -1.0) * (m * strength)).collect();
    for _ in 0..3 {
        let damping = Rayleigh { mass: 0.5, stiffness: 0.0 };
        solver.implicit_euler(&mut u, &mut velocity, &weight, damping, 1.0 / 30.0).unwrap();
    }
    u.iter().chain(&velocity).flat_map(|d| d.data.0[0].map(f64::to_bits)).collect()
}

/// A state on the full shell that is led by a handle, saved.
fn led(shell: &Arc<Shell>) -> Vec<u8> {
    let options = Options { modes: 2, ..Options::default() };
    let model = Arc::new(Model::precompute(shell.clone(), &options, &mut |_, _| Ok(())).unwrap());
    let mut state = State::new(model, Method::ImplicitShell, Integrator::ImplicitEuler).unwrap();
    let vertex = *shell.free.last().unwrap();
    let target = Target::Position(shell.mesh.positions[vertex as usize] + Vec3::new(0.0, 0.0, 0.01));
    state.set_constraint(Constraint { id: 1, vertex, axes: [true; 3], compliance: 0.0, target }).unwrap();
    (0..2).for_each(|_| state.step(1.0 / 30.0).unwrap());
    state.save()
}

/// K + M/h² at rest, that less so much of M that it is not positive definite, and that with as much more that single precision does.
fn matrices(shell: &Shell) -> [BlockMatrix; 3] {
    [900.0, -1e6, 1e6].map(|shift| {
        let mut matrix = shell.matrix(&[]);
        let add = &mut |(vertices, row): (&[u32], &[Vec3])| {
            matrix.add_element(vertices, |p, q| row[p] * row[q].transpose());
        };
        shell.energy.visit_rest_rows(add);
        shell.free.iter().enumerate().for_each(|(i, v)| matrix.add_diagonal(i, shift * shell.mass[*v as usize]));
        matrix.fill_rollers(|stiffness| stiffness);
        matrix
    })
}

/// Bits of x = A⁻¹b by a factor, which is that of A: ‖Ax − b‖ is rounding, by a product that knows nothing of the factor.
fn solved(shell: &Shell) -> Vec<u64> {
    let [matrix, indefinite, heavy] = matrices(shell);
    let symbolic = shell.analysis(matrix.lower.symbolic()).unwrap();
    assert!(symbolic.bytes() > 0, "its factor is one of those that are shared");
    assert!(symbolic.cholesky(&indefinite.lower).unwrap().is_none());
    let factor = symbolic.cholesky(&matrix.lower).unwrap().unwrap();
    let n = matrix.lower.ncols();
    let b: Vec<f64> = (0..n).map(|i| libm::sin(1.7 * i as f64)).collect();
    let (mut x, mut product) = (b.clone(), vec![0.0; n]);
    factor.solve_in_place(faer::MatMut::from_column_major_slice_mut(&mut x, n, 1)).unwrap();
    matrix.times(&x, &mut product, &mut vec![]);
    let norm = |v: &mut dyn Iterator<Item = f64>| v.map(|v| v * v).sum::<f64>().sqrt();
    let largest = matrix.lower.val().iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let off = norm(&mut product.iter().zip(&b).map(|(a, b)| a - b));
    // Of a backward stable solution, some units of rounding of ‖A‖‖x‖; a wrong entry of the factor would leave parts of ‖b‖.
    let rounding = 100.0 * f64::EPSILON * largest * norm(&mut x.iter().copied());
    assert!(off <= rounding && rounding < 1e-2 * norm(&mut b.iter().copied()), "{off:e} of {rounding:e}");
    // Columns at once are solved by the same factor in another order.
    let mut twice = [b.clone(), b.clone()].concat();
    factor.solve_in_place(faer::MatMut::from_column_major_slice_mut(&mut twice, n, 2)).unwrap();
    let apart = norm(&mut twice[n..].iter().zip(&x).map(|(a, b)| a - b));
    assert!(apart <= 1e-6 * norm(&mut x.iter().copied()), "{apart:e}"); // rounding times the condition, up to 1e8 here
    let by_single = solved_in_single(&symbolic, [&heavy, &indefinite], &b);
    x.iter().chain(&by_single).map(|x| x.to_bits()).collect()
}

/// A⁻¹b by a factor in single precision, which there is none of the other matrix.
fn solved_in_single(symbolic: &Symbolic, [matrix, indefinite]: [&BlockMatrix; 2], b: &[f64]) -> Vec<f64> {
    let mut factor = symbolic.single_factor().unwrap();
    assert!(!symbolic.refactorize_single(&indefinite.lower, &mut factor).unwrap());
    assert!(symbolic.refactorize_single(&matrix.lower, &mut factor).unwrap());
    let (n, mut room) = (b.len(), symbolic.solving_room(1).unwrap());
    let [mut x, mut exact] = [b.to_vec(), b.to_vec()];
    let column = faer::MatMut::from_column_major_slice_mut(&mut x, n, 1);
    symbolic.solve_single_in_room(&factor, column, &mut room);
    let double = symbolic.cholesky(&matrix.lower).unwrap().unwrap();
    double.solve_in_place(faer::MatMut::from_column_major_slice_mut(&mut exact, n, 1)).unwrap();
    let norm = |v: &mut dyn Iterator<Item = f64>| v.map(|v| v * v).sum::<f64>().sqrt();
    let apart = norm(&mut x.iter().zip(&exact).map(|(a, b)| a - b)) / norm(&mut exact.iter().copied());
    assert!(apart < 1e-2, "{apart:e}"); // 6e-8 times a condition of some 1e4; a wrong entry would leave parts of 1
    x
}

/// Bits of a product with a matrix that is taken in parts, which is that of its entries one by one.
fn multiplied(matrix: &BlockMatrix) -> Vec<u64> {
    let n = matrix.lower.ncols();
    let x: Vec<f64> = (0..n).map(|i| libm::sin(1.7 * i as f64)).collect();
    let (mut product, mut room) = (vec![0.0; n], vec![]);
    matrix.times(&x, &mut product, &mut room);
    assert!(room.len() > n, "parts reach beyond their own columns");
    let (mut sums, mut magnitudes) = (vec![0.0; n], vec![0.0; n]);
    let mut add = |i: usize, value: f64| {
        sums[i] += value;
        magnitudes[i] += value.abs();
    };
    for entry in matrix.lower.triplet_iter() {
        add(entry.row, entry.val * x[entry.col]);
        if entry.row != entry.col {
            add(entry.col, entry.val * x[entry.row]);
        }
    }
    for (i, (a, b)) in product.iter().zip(&sums).enumerate() {
        assert!((a - b).abs() <= 1e-14 * magnitudes[i], "row {i}: {a} and {b}"); // roundings of some dozen terms
    }
    product.iter().map(|x| x.to_bits()).collect()
}

/// One state's work is shared to the same bits: alone, beside others that share, and inside work on many.
fn large_shells_move_to_the_same_bits() {
    let shells = large();
    assert!(set_threads(1));
    let results = |strength| shells.iter().map(|shell| stepped(shell, strength)).collect::<Vec<_>>();
    let alone: Vec<_> = [3.0, 9.8].map(results).into();
    let (linear, saved) = (shells.iter().map(|s| solved(s)).collect::<Vec<_>>(), led(&shells[0]));
    let [larger, ..] = matrices(&leaf(4));
    let product = multiplied(&larger);
    for count in [2, 3, 4, 8, 16] {
        assert!(set_threads(count));
        assert!(results(9.8) == alone[1], "{count} threads");
        assert!(shells.iter().map(|s| solved(s)).eq(linear.iter().cloned()), "{count} threads");
        assert!(led(&shells[0]) == saved, "{count} threads");
        assert!(multiplied(&larger) == product, "{count} threads");
    }
    let mut many: Vec<_> = (0..4).map(|k| (&shells[k % 2], &alone[k / 2][k % 2], [3.0, 9.8][k / 2], false)).collect();
    for_each(&mut many, |_| 1_000_000, |(shell, end, strength, same)| *same = stepped(shell, *strength) == **end);
    assert!(many.iter().all(|(.., same)| *same), "states that are stepped at once");
    many.iter_mut().for_each(|(.., same)| *same = false);
    let long = |(): &mut (), (shell, end, strength, same): &mut (&Arc<Shell>, &_, f64, bool), _: threads::GoOn| {
        *same = stepped(shell, *strength) == **end;
        Ok(())
    };
    assert!(for_each_long(&mut many, 16, || Ok(()), long, &mut |_| Ok(())).is_ok());
    assert!(many.iter().all(|(.., same)| *same), "long work that shares");
    std::thread::scope(|scope| {
        for (shell, end, strength, _) in &many {
            scope.spawn(move || assert!(stepped(shell, *strength) == **end, "calls at the same time"));
        }
    });
}

/// Tasks run once each, after those that they wait for; an error or a panic ends all, and is the caller's.
fn tasks_wait_for_one_another() {
    let n = 200;
    // Each waits for two earlier ones.
    let pairs: Vec<[u32; 2]> = (1..n).flat_map(|k| [[k / 2, k], [(k - 1) / 3, k]]).filter(|[a, b]| a < b).collect();
    let mut pairs = pairs;
    pairs.sort_unstable();
    pairs.dedup();
    let tasks = Tasks::new(n as usize, &pairs, (0..u64::from(n)).map(|k| k * 7 % 13).collect());
    let done: Vec<_> = (0..n).map(|_| std::sync::atomic::AtomicUsize::new(0)).collect();
    let runs = |k: usize| done[k].load(std::sync::atomic::Ordering::SeqCst);
    for count in [1, 2, 5] {
        assert!(set_threads(count));
        done.iter().for_each(|runs| runs.store(0, std::sync::atomic::Ordering::SeqCst));
        let outcome = tasks.run(
            1_000_000_000,
            || Ok::<_, usize>(()),
            |(), task, _| {
                let earlier = pairs.iter().filter(|[_, second]| *second as usize == task);
                assert!(earlier.clone().all(|[first, _]| runs(*first as usize) == 1), "{task} came too soon");
                done[task].fetch_add(1, std::sync::atomic::Ordering::SeqCst);
                Ok(())
            },
        );
        assert_eq!(outcome, Ok(()));
        assert!((0..n as usize).all(|k| runs(k) == 1), "{count} threads");
        let failing = |(): &mut (), task: usize, _: threads::WaitFor| if task == 150 { Err(task) } else { Ok(()) };
        assert_eq!(tasks.run(1_000_000_000, || Ok(()), failing), Err(150), "{count} threads");
        let falls = std::panic::catch_unwind(|| {
            let falling = |(): &mut (), task: usize, _: threads::WaitFor| {
                assert!(task != 150, "it fell");
                Ok::<_, usize>(())
            };
            tasks.run(1_000_000_000, || Ok(()), falling)
        });
        assert!(falls.is_err(), "{count} threads");
    }
    let inside = std::sync::atomic::AtomicUsize::new(0);
    share(u64::MAX, |threads| {
        assert!((1..=5).contains(&threads));
        share(u64::MAX, |threads| {
            assert_eq!(threads, 1, "shared work does not share again");
            inside.fetch_add(1, std::sync::atomic::Ordering::SeqCst);
        });
    });
    assert_eq!(inside.into_inner(), 5);
}

#[test]
fn the_pool_visits_all_once_to_the_same_bits_and_comes_and_goes_as_asked() {
    assert!(set_threads(4));
    assert_eq!(pool_threads(), [""; 0], "no thread before the first call");
    assert_eq!(visits(100, |_| 10), vec![1; 100]);
    assert_eq!(pool_threads(), [""; 0], "little work makes no threads");

    assert_eq!(visits(3, |_| 1_000_000), vec![1; 3]);
    if cfg!(target_os = "linux") {
        wait_for(&["shellwarp-1", "shellwarp-2", "shellwarp-3"]); // the caller is the fourth
    }
    assert_eq!(visits(0, |_| u64::MAX), vec![0; 0]);
    assert_eq!(visits(1, |_| u64::MAX), vec![1]);
    assert_eq!(visits(10_007, |i| (i as u64 % 97) * 50), vec![1; 10_007], "uneven work");
    assert_eq!(visits(5000, |i| if i == 0 { 1_000_000_000 } else { 0 }), vec![1; 5000], "one takes it all");

    let models = [model("flat_beam"), model("v_beam")];
    assert!(set_threads(1));
    let alone = motion(&models);
    for count in [2, 3, 8] {
        assert!(set_threads(count));
        assert!(motion(&models) == alone, "{count} threads");
    }

    long_work_is_done_once_and_heard_of_on_the_calling_thread();
    two_works_are_done_and_heard_of_on_the_calling_thread();
    assert!(set_threads(1));
    let alone = trained();
    for count in [2, 5] {
        assert!(set_threads(count));
        assert!(trained() == alone, "trained on {count} threads");
    }

    tasks_wait_for_one_another();
    the_last_of_long_work_share_alike_with_threads_that_are_done();
    large_shells_move_to_the_same_bits();

    assert!(set_threads(1));
    wait_for(&[]);
    assert_eq!(visits(100, |_| 1_000_000), vec![1; 100]);
    assert_eq!(pool_threads(), [""; 0], "one thread is the caller");
    assert!(threads::set_threads(0));
}
