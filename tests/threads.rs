//! The pool that steps many states: every item once, the same bits on any number of threads, no thread before it is needed and
//! none after it was told to go. One test: the pool belongs to the process.
#![allow(missing_docs)]
mod common;
use common::*;
use shellwarp::model::{Model, Options};
use shellwarp::state::{Method, State};
use shellwarp::step::Integrator;
use shellwarp::threads::{for_each, for_each_long, set_threads};
use shellwarp::{Error, ErrorKind, reduced};
use shellwarp::{Vec3, threads};
use std::sync::Arc;
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
    assert!(set_threads(1));
    let alone = trained();
    for count in [2, 5] {
        assert!(set_threads(count));
        assert!(trained() == alone, "trained on {count} threads");
    }

    assert!(set_threads(1));
    wait_for(&[]);
    assert_eq!(visits(100, |_| 1_000_000), vec![1; 100]);
    assert_eq!(pool_threads(), [""; 0], "one thread is the caller");
    assert!(threads::set_threads(0));
}
