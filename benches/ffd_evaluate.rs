//! Evaluation of a deformed bicubic 5 × 5 box at a million scattered parameters, on one core.

#[allow(dead_code)]
mod points;

use aeroform::ffd::BoxEvaluator;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;

const POINTS: usize = 1_000_000;

fn ffd_evaluate(c: &mut Criterion) {
    let evaluator = BoxEvaluator::new(&points::deformed());
    let parameters = points::scattered(POINTS);
    let mut moved = vec![[0.0; 2]; POINTS];
    let mut group = c.benchmark_group("ffd_evaluate");
    group.throughput(Throughput::Elements(POINTS as u64)).sample_size(20);
    group.bench_function("5x5 bicubic, 1000000 points", |b| {
        b.iter(|| evaluator.evaluate_many(black_box(&parameters), black_box(&mut moved)));
    });
    // the generic spline, whose basis functions are computed anew for every point, for a ratio in the same run
    let lattice = points::deformed();
    let few = POINTS / 10;
    group.throughput(Throughput::Elements(few as u64));
    group.bench_function("5x5 bicubic, generic spline, 100000 points", |b| {
        b.iter(|| {
            for (u, point) in black_box(&parameters[..few]).iter().zip(black_box(&mut moved)) {
                *point = lattice.spline().point_at(*u);
            }
        });
    });
    group.finish();
}

criterion_group!(benches, ffd_evaluate);
criterion_main!(benches);
