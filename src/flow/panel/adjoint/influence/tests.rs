//! The terms of the panel equations against forward sweeps of the kernels.

use super::super::reverse::{Collected, Reverse, Strengths, lanes};
use super::super::testing::{
    Sums, at_solutions, closing_stream, edge_speed, moving_ends, no_points, no_weights, stream, wake_stream,
};
use super::{PanelWeights, add_closing, add_panels, add_wake_stream, panel_weights};
use crate::flow::panel::adjoint::influence::{Points, Vectors};
use crate::flow::panel::coupling::response::wake_points;
use crate::flow::panel::outline::{Outline, TrailingEdge};
use crate::flow::panel::testing::{Direction, moving};

fn with_weights(check: impl Fn(&Reverse, &PanelWeights, &Outline, &Direction)) {
    at_solutions(|_, reverse, _| {
        let weights = panel_weights(reverse.section, &reverse.strengths);
        let outline = &reverse.section.panels.outline;
        for direction in Direction::several(outline) {
            check(reverse, &weights, outline, &direction);
        }
    });
}

#[test]
fn panels_add_the_change_of_the_stream_function_at_the_nodes() {
    with_weights(|reverse, weights, outline, direction| {
        let (alpha, nodes) = (moving(reverse.flow.alpha, direction.alpha), direction.moved(&outline.nodes));
        let inviscid = Strengths::inviscid(reverse.flow);
        let none = no_weights(outline.len());
        for sheets in [&reverse.at_solution, &inviscid] {
            let forward = stream(sheets, outline, &nodes, alpha);
            // with the multipliers in either place, and none in the other
            for parts in [[(sheets, weights), (&inviscid, &none)], [(&inviscid, &none), (sheets, weights)]] {
                let mut collected = Collected::nothing(outline.len());
                add_panels(reverse, parts, &mut collected);
                let sums = Sums::zero().over(&collected, direction);
                sums.assert_are("panels", &forward, |i| lanes(&weights.stream, |weights| weights[i]));
            }
        }
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
        add_closing(reverse, edge_speed(&reverse.at_solution), &points, &mut by_point, &mut collected);
        points.add_weighted(&by_point, &mut collected);
        let forward = closing_stream(&reverse.at_solution, outline, &direction.moved(&outline.nodes));
        let sums = Sums::zero().over(&collected, direction);
        sums.assert_are("closing panel", &forward, |i| lanes(&weights.stream, |weights| weights[i]));
    });
}

#[test]
fn the_wake_adds_the_change_of_its_stream_function_at_the_nodes() {
    with_weights(|reverse, weights, outline, direction| {
        let ends = wake_points(&reverse.flow.path.nodes);
        let (mut collected, mut by_ends) = (Collected::nothing(outline.len()), no_points(ends.len()));
        add_wake_stream(reverse, weights, &ends, &mut by_ends, &mut collected);
        let (rates, moved) = moving_ends(direction, &ends);
        let forward = wake_stream(reverse, outline, &direction.moved(&outline.nodes), &moved);
        let sums = Sums::zero().over(&collected, direction).over_points(&by_ends, &rates);
        sums.assert_are("wake", &forward, |i| lanes(&weights.stream, |weights| weights[i]));
    });
}
