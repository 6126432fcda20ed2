//! The same steps on several numbers of threads.

use crate::common::leaf;
use crate::steps::{Swing, Way, dinosaur, sheet};
use crate::{docs, wanted};
use faer::MatMut;
use shellwarp::threads::set_threads;
use shellwarp::{Shell, Vec3};
use std::sync::Arc;
use std::time::Instant;

/// Best of so many runs, as other work on the machine only adds.
const RUNS: usize = 3;

/// Milliseconds of a matrix' factorization and of a solution, and of both in single precision, at best.
fn factor_times(shell: &Shell) -> [f64; 4] {
    let mut matrix = shell.matrix(&[]);
    shell
        .energy
        .visit_rest_rows(&mut |(vertices, row)| matrix.add_element(vertices, |p, q| row[p] * row[q].transpose()));
    shell.free.iter().enumerate().for_each(|(i, v)| matrix.add_diagonal(i, 900.0 * shell.mass[*v as usize]));
    let symbolic = shell.analysis(matrix.lower.symbolic()).unwrap();
    let mut factor = symbolic.factor().unwrap();
    let mut room = symbolic.solving_room(1).unwrap();
    let mut x = vec![1.0; matrix.lower.ncols()];
    let mut single = symbolic.single_factor().expect("large factors have one");
    let mut best = [f64::INFINITY; 4];
    for _ in 0..3 * RUNS {
        let n = x.len();
        let mut timed = |k: usize, work: &mut dyn FnMut(MatMut<f64>)| {
            let column = MatMut::from_column_major_slice_mut(&mut x, n, 1);
            let started = Instant::now();
            work(column);
            best[k] = best[k].min(1e3 * started.elapsed().as_secs_f64());
        };
        timed(0, &mut |_| assert!(symbolic.refactorize(&matrix.lower, &mut factor).unwrap()));
        timed(1, &mut |x| symbolic.solve_in_room(&factor, x, &mut room));
        timed(2, &mut |_| assert!(symbolic.refactorize_single(&matrix.lower, &mut single).unwrap()));
        timed(3, &mut |x| symbolic.solve_single_in_room(&single, x, &mut room));
    }
    best
}

pub fn table(counts: &[usize], only: &[String]) -> String {
    let mut table = format!(
        "Steps of 1/30 s from rest under 9.8 m/s², the first six, on {} (load {}), best of {RUNS} runs; \
         `target/release/examples/solver threads 1 2 4`. Every number of threads ends with the same bits.\n\n\
         | shell | vertices | threads | ms a step | of one thread | a factorization | a solution | in single precision |\n\
         |---|---|---|---|---|---|---|---|\n",
        docs::machine(),
        docs::load()
    );
    for (name, shell) in [("leaf", leaf(2)), ("leaf", leaf(4)), ("dinosaur", dinosaur()), ("sheet", sheet())] {
        if !wanted(only, name) {
            continue;
        }
        let shell = Arc::new(shell);
        let weight: Vec<Vec3> = shell.mass.iter().map(|m| Vec3::new(0.3, -0.2, -1.0) * (m * 9.8)).collect();
        let (mut alone, mut end) = (f64::NAN, None);
        for &count in counts {
            assert!(set_threads(count));
            let mut best = f64::INFINITY;
            for _ in 0..RUNS {
                let mut swing = Swing::new(&shell, Way::Reusing);
                (0..6).for_each(|_| swing.step(&weight, vec![]));
                best = best.min(1e3 * swing.seconds / 6.0);
                let bits: Vec<u64> = swing.u.iter().flat_map(|u| u.data.0[0].map(f64::to_bits)).collect();
                assert!(end.get_or_insert_with(|| bits.clone()) == &bits, "other bits with {count} threads");
            }
            alone = if alone.is_nan() { best } else { alone };
            let [factorization, solution, single, solution_in_single] = factor_times(&shell);
            let row = format!(
                "| {name} | {} | {count} | {best:.0} | {:.2} | {factorization:.1} | {solution:.1} | {single:.1}, {solution_in_single:.1} |\n",
                shell.mass.len(),
                best / alone
            );
            print!("{row}");
            table += &row;
        }
    }
    table
}
