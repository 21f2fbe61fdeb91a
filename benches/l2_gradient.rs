//! Objective of the shape match alone, and with its whole gradient, for 32, 128 and 512 variables.
//!
//! Ends with the ratio of the two, each the best of many interleaved batches, which a busy machine disturbs least.

mod cases;

use aeroform::design::{DesignProblem, Problem};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use std::time::Instant;

fn value(problem: &mut DesignProblem, x: &[f64]) -> f64 {
    problem.objective(x).expect("a value")
}

fn value_and_gradient(problem: &mut DesignProblem, x: &[f64]) -> f64 {
    problem.evaluate(x).expect("a value").objective
}

/// Shortest time of one call among many batches, in seconds.
fn best(f: &mut dyn FnMut() -> f64, shortest: &mut f64) {
    const CALLS: u32 = 50;
    let start = Instant::now();
    for _ in 0..CALLS {
        black_box(f());
    }
    *shortest = shortest.min(start.elapsed().as_secs_f64() / f64::from(CALLS));
}

fn l2_gradient(c: &mut Criterion) {
    let mut group = c.benchmark_group("l2_gradient");
    let mut ratios = Vec::new();
    for n in [4, 8, 16] {
        let mut problem = cases::open(n, "lbfgs").problem;
        let x = cases::shaken(&problem.description().start);
        let variables = x.len();
        group.bench_function(BenchmarkId::new("value", variables), |b| b.iter(|| value(&mut problem, black_box(&x))));
        group.bench_function(BenchmarkId::new("value and gradient", variables), |b| {
            b.iter(|| value_and_gradient(&mut problem, black_box(&x)));
        });
        let (mut alone, mut both) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..100 {
            best(&mut || value(&mut problem, black_box(&x)), &mut alone);
            best(&mut || value_and_gradient(&mut problem, black_box(&x)), &mut both);
        }
        ratios.push((variables, alone, both));
    }
    group.finish();
    for (variables, alone, both) in ratios {
        println!(
            "l2_gradient: {variables} variables: value {:.2} us, with gradient {:.2} us, ratio {:.2}",
            1e6 * alone,
            1e6 * both,
            both / alone
        );
    }
}

criterion_group!(benches, l2_gradient);
criterion_main!(benches);
