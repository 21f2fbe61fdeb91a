//! The terms of the panel equations against forward sweeps of the kernels.

use super::super::reverse::{Collected, Reverse, lanes};
use super::super::testing::{Sums, at_solutions, edge_frame, length, moving_ends, no_points, wake_stream};
use super::{PanelWeights, add_closing, add_panels, add_wake_stream, panel_weights};
use crate::flow::panel::adjoint::influence::{Points, Vectors};
use crate::flow::panel::coupling::response::wake_points;
use crate::flow::panel::kernel::stream_influence;
use crate::flow::panel::outline::{Outline, TrailingEdge};
use crate::flow::panel::testing::{Direction, Forward, moving};
use num_dual::DualNum;

/// Stream function at the nodes of the closing panel, for the strengths of a solution held.
fn closing_stream(reverse: &Reverse, outline: &Outline, nodes: &[[Forward; 2]]) -> Vec<Forward> {
    let n = nodes.len();
    let strengths = &reverse.at_solution.nodes;
    let speed = 0.5 * (strengths[0] - strengths[n - 1]);
    let (frame, panel) = (edge_frame(nodes), [nodes[n - 1], nodes[0]]);
    let stream = |i: usize| {
        let influence = stream_influence(panel, nodes[i], outline.place(i, n - 1));
        ((influence.vortex[0] + influence.vortex[1]) * frame.vortex + influence.source * frame.source) / length(panel)
            * speed
    };
    (0..n).map(stream).collect()
}

/// Stream function at the nodes of the onset flow and of all panels of the section, for the strengths and the defects of
/// a solution held.
fn stream(reverse: &Reverse, outline: &Outline, nodes: &[[Forward; 2]], alpha: Forward) -> Vec<Forward> {
    let (strengths, mass) = (&reverse.at_solution.nodes, &reverse.at_solution.smoothed);
    let (sin, cos) = alpha.sin_cos();
    let onset = nodes.iter().map(|[x, y]| *y * cos - *x * sin);
    let mut result: Vec<Forward> = onset.collect();
    for j in 0..nodes.len() - 1 {
        let panel = [nodes[j], nodes[j + 1]];
        let outflow = length(panel).recip() * (mass[j] - mass[j + 1]);
        for (i, stream) in result.iter_mut().enumerate() {
            let influence = stream_influence(panel, nodes[i], outline.place(i, j));
            *stream += influence.vortex[0] * strengths[j] + influence.vortex[1] * strengths[j + 1];
            *stream += influence.source * outflow;
        }
    }
    if outline.trailing_edge == TrailingEdge::Blunt {
        for (stream, closing) in result.iter_mut().zip(closing_stream(reverse, outline, nodes)) {
            *stream += closing;
        }
    }
    result
}

fn with_weights(check: impl Fn(&Reverse, &PanelWeights, &Outline, &Direction)) {
    at_solutions(|_, reverse, _| {
        let weights = panel_weights(reverse);
        let outline = &reverse.section.panels.outline;
        for direction in Direction::several(outline) {
            check(reverse, &weights, outline, &direction);
        }
    });
}

#[test]
fn panels_add_the_change_of_the_stream_function_at_the_nodes() {
    with_weights(|reverse, weights, outline, direction| {
        let mut collected = Collected::nothing(outline.len());
        add_panels(reverse, weights, &mut collected);
        let alpha = moving(reverse.flow.alpha, direction.alpha);
        let forward = stream(reverse, outline, &direction.moved(&outline.nodes), alpha);
        let sums = Sums::zero().over(&collected, direction);
        sums.assert_are("panels", &forward, |i| lanes(&weights.stream, |weights| weights[i]));
    });
}

#[test]
fn the_closing_panel_adds_the_change_of_its_own_stream_function() {
    with_weights(|reverse, weights, outline, direction| {
        if outline.trailing_edge == TrailingEdge::Sharp {
            return;
        }
        let mut collected = Collected::nothing(outline.len());
        let points = Points::new(&outline.nodes, |i| lanes(&weights.stream, |weights| weights[i]));
        let mut by_point = Vectors::new([0.0; 2], outline.len());
        add_closing(reverse, &points, &mut by_point, &mut collected);
        points.add_weighted(&by_point, &mut collected);
        let forward = closing_stream(reverse, outline, &direction.moved(&outline.nodes));
        let sums = Sums::zero().over(&collected, direction);
        sums.assert_are("closing panel", &forward, |i| lanes(&weights.stream, |weights| weights[i]));
    });
}

#[test]
fn the_wake_adds_the_change_of_its_stream_function_at_the_nodes() {
    with_weights(|reverse, weights, outline, direction| {
        let ends = wake_points(&reverse.flow.wake_nodes);
        let (mut collected, mut by_ends) = (Collected::nothing(outline.len()), no_points(ends.len()));
        add_wake_stream(reverse, weights, &ends, &mut by_ends, &mut collected);
        let (rates, moved) = moving_ends(direction, &ends);
        let forward = wake_stream(reverse, outline, &direction.moved(&outline.nodes), &moved);
        let sums = Sums::zero().over(&collected, direction).over_points(&by_ends, &rates);
        sums.assert_are("wake", &forward, |i| lanes(&weights.stream, |weights| weights[i]));
    });
}
