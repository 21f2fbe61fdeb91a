//! The whole drag minimisation of the case `kulfan-5x5` (38 variables, a viscous flow an evaluation).

use aeroform::case::Case;
use aeroform::optimize::{Optimizer, Sqp, Termination};
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use std::ops::ControlFlow;

fn kulfan(c: &mut Criterion) {
    let case = Case::open("kulfan-5x5").expect("a built-in case");
    let method = Sqp { feasibility_tolerance: 1e-10, ..Sqp::default() };
    let mut group = c.benchmark_group("kulfan");
    group.sample_size(10);
    group.bench_function("5x5", |b| {
        b.iter_batched(
            || case.problem.clone(),
            |mut problem| {
                let outcome = method.minimize(&mut problem, &mut |_| ControlFlow::Continue(())).expect("a fit problem");
                assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
                outcome
            },
            BatchSize::SmallInput,
        );
    });
    group.finish();
}

criterion_group!(benches, kulfan);
criterion_main!(benches);
