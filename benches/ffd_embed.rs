//! Embedding of ten thousand scattered points in a bicubic 5 × 5 box.

#[allow(dead_code)]
mod points;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;

const POINTS: usize = 10_000;

fn ffd_embed(c: &mut Criterion) {
    let lattice = points::bicubic();
    let inside = points::inside(POINTS);
    let mut group = c.benchmark_group("ffd_embed");
    group.throughput(Throughput::Elements(POINTS as u64)).sample_size(20);
    group.bench_function("5x5 bicubic, 10000 points", |b| {
        b.iter(|| lattice.embed(black_box(&inside)).expect("all points are inside"));
    });
    group.finish();
}

criterion_group!(benches, ffd_embed);
criterion_main!(benches);
