//! Viscous points at 160 panels: cold, warm, their gradients, a polar; and a point with a shock.

#[allow(dead_code)]
mod sections;

use aeroform::case::Case;
use aeroform::flow::{Condition, FlowSolver, PanelledSection, Settings, StreamtubeSolver, TrailingEdge};
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use sections::{Chain, POINTS, cold, condition, nodes, polar};
use std::hint::black_box;
use std::ops::ControlFlow;

fn flow(c: &mut Criterion) {
    let mut group = c.benchmark_group("flow");
    group.sample_size(20);
    for (name, degrees, reynolds, trips) in POINTS {
        let what =
            format!("{name} at {degrees}, Re {reynolds:.0e}, {}", if trips[0].is_some() { "tripped" } else { "free" });
        let nodes = nodes(name);
        let at = condition(degrees, reynolds, trips);
        group.bench_function(format!("cold point, {what}"), |b| b.iter(|| cold(black_box(&nodes), black_box(&at))));

        let section = PanelledSection::new(&nodes, TrailingEdge::Blunt).expect("nodes of a section");
        let settings = Settings::default();
        let before = section.analyze(&condition(degrees - 0.5, reynolds, trips), &settings, None).expect("in range");
        group.bench_function(format!("warm point, {what}"), |b| {
            b.iter(|| section.analyze(black_box(&at), &settings, Some(&before)).expect("in range"));
        });

        let solution = cold(&nodes, &at);
        group.bench_function(format!("gradients, {what}"), |b| b.iter(|| black_box(&solution).gradients()));
    }
    let solution = cold(&nodes("naca0012"), &condition(2.0, 1e6, [None; 2]));
    for variables in [58, 580] {
        let chain = Chain::new(variables);
        group.bench_function(format!("gradients and chain to {variables} variables"), |b| {
            b.iter(|| chain.apply(&black_box(&solution).gradients().expect("converged")));
        });
    }
    let section = PanelledSection::new(&nodes("naca0012"), TrailingEdge::Blunt).expect("nodes of a section");
    group.bench_function("polar of 15 angles", |b| {
        b.iter(|| polar(black_box(&section), (0..15).map(|k| 0.5 * f64::from(k)), 1e6));
    });
    group.finish();
}

/// A supercritical point with a shock: NACA 0012 at M 0.75 and 2 degrees.
fn transonic(c: &mut Criterion) {
    let mut group = c.benchmark_group("transonic");
    group.sample_size(10);
    let nodes = nodes("naca0012");
    let at = Condition { mach: 0.75, ..condition(2.0, 5e6, [Some(0.1); 2]) };
    let prepared = |nodes: &[[f64; 2]]| {
        StreamtubeSolver::default().section(nodes, TrailingEdge::Blunt).expect("nodes of a section")
    };
    let section = prepared(&nodes);
    let solution = section.analyze(&at, None).expect("in range");
    group.bench_function("cold point", |b| b.iter(|| section.analyze(black_box(&at), None)));
    let thicker: Vec<[f64; 2]> = nodes.iter().map(|p| [p[0], 1.01 * p[1]]).collect();
    let thicker = prepared(&thicker);
    group.bench_function("warm point", |b| b.iter(|| thicker.analyze(black_box(&at), Some(&solution))));
    // a solution keeps its derivatives
    let fresh = || section.analyze(&at, Some(&solution)).expect("in range");
    group.bench_function("gradients", |b| {
        b.iter_batched(fresh, |solution| solution.gradients(), BatchSize::LargeInput);
    });
    let case = Case::open("naca0024-cubic").expect("a built-in case");
    group.bench_function("whole naca0024-cubic", |b| {
        b.iter(|| case.run(&mut |_| ControlFlow::Continue(())).expect("the case runs"));
    });
    group.finish();
}

criterion_group!(benches, flow, transonic);
criterion_main!(benches);
