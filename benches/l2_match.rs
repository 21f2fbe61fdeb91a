//! The whole shape match of the paper (32 variables), by both optimisers.

#[allow(dead_code)]
mod cases;

use aeroform::optimize::{Method, Optimizer};
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use std::ops::ControlFlow;

fn l2_match(c: &mut Criterion) {
    let mut group = c.benchmark_group("l2_match");
    group.sample_size(20);
    for name in ["lbfgs", "newton"] {
        let case = cases::open(4, name);
        let method = Method::from_name(name).expect("a name of the list");
        group.bench_function(name, |b| {
            b.iter_batched(
                || case.problem.clone(),
                |mut problem| {
                    method.minimize(&mut problem, &mut |_| ControlFlow::Continue(())).expect("no constraints")
                },
                BatchSize::SmallInput,
            );
        });
    }
    group.finish();
}

criterion_group!(benches, l2_match);
criterion_main!(benches);
