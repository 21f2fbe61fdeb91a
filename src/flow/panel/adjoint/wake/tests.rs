//! The terms of the wake against forward sweeps of the kernels.

use super::super::influence::panel_weights;
use super::super::path::tests::path;
use super::super::reverse::{Collected, Lanes, Reverse, lanes};
use super::super::testing::{
    Sums, add_panels_of, at_solutions, edge_frame, moving_ends, no_points, velocity, wake_stream,
};
use super::{add_dead_air, add_tangent, add_velocities, add_wake};
use crate::flow::layer::{Derived, EdgeLaw};
use crate::flow::panel::coupling::response::{wake_points, wake_tangents};
use crate::flow::panel::coupling::system::mass_defect;
use crate::flow::panel::edge::Cut;
use crate::flow::panel::outline::TrailingEdge;
use crate::flow::panel::solved::Solved;
use crate::flow::panel::testing::{Direction, Forward, moving, wave};
use crate::flow::panel::wake;

fn with_directions(check: impl Fn(&Solved, &Reverse, &Direction)) {
    at_solutions(|solved, reverse, _| {
        for direction in Direction::several(&reverse.section.panels.outline) {
            check(solved, reverse, &direction);
        }
    });
}

/// Mean velocity through the cut at the edge, then the speeds along the wake behind its first node.
fn speeds(reverse: &Reverse, nodes: &[[Forward; 2]], ends: &[[Forward; 2]], alpha: Forward) -> Vec<Forward> {
    let (n, held) = (nodes.len(), (&reverse.at_solution, &reverse.section.panels.outline));
    let cut = Cut::new([nodes[0], nodes[1]], [nodes[n - 2], nodes[n - 1]]);
    let through = cut
        .points
        .iter()
        .map(|(point, weight)| cut.through(velocity(held, nodes, ends, alpha, (*point, None))) * *weight);
    let through: Forward = through.sum();
    let wake_nodes: Vec<[Forward; 2]> = ends.iter().step_by(2).copied().collect();
    let tangents = wake_tangents(&wake_nodes);
    let along = (1..wake_nodes.len()).map(|k| {
        let [x, y] = velocity(held, nodes, ends, alpha, (wake_nodes[k], Some(k)));
        x * tangents[k][0] + y * tangents[k][1]
    });
    std::iter::once(through).chain(along).collect()
}

/// Weight of entry `i` of [`speeds`].
fn speed_weight(reverse: &Reverse, edge: &Lanes, i: usize) -> Lanes {
    if i == 0 { *edge } else { lanes(&reverse.wake_weights, |weights| weights[i]) }
}

#[test]
fn velocities_add_the_change_of_the_speeds_along_the_wake_and_through_the_cut() {
    with_directions(|_, reverse, direction| {
        let outline = &reverse.section.panels.outline;
        let edge = panel_weights(reverse.section, &reverse.strengths).edge;
        let ends = wake_points(&reverse.flow.path.nodes);
        let (mut collected, mut by_ends) = (Collected::nothing(outline.len()), no_points(ends.len()));
        add_velocities(reverse, &edge, &ends, &mut by_ends, &mut collected);
        let (rates, moved) = moving_ends(direction, &ends);
        let alpha = moving(reverse.flow.alpha, direction.alpha);
        let forward = speeds(reverse, &direction.moved(&outline.nodes), &moved, alpha);
        let sums = Sums::zero().over(&collected, direction).over_points(&by_ends, &rates);
        sums.assert_are("velocities", &forward, |i| speed_weight(reverse, &edge, i));
    });
}

#[test]
fn a_tangent_adds_the_turn_of_the_direction_that_a_speed_is_taken_in() {
    with_directions(|_, reverse, direction| {
        let ends = wake_points(&reverse.flow.path.nodes);
        let (rates, moved) = moving_ends(direction, &ends);
        let nodes: Vec<[Forward; 2]> = moved.iter().step_by(2).copied().collect();
        for k in [1, 4, nodes.len() - 1] {
            let weights = Lanes::from_fn(|o, _| wave(3, o + k));
            let mut by_ends = no_points(ends.len());
            add_tangent(reverse, k, [0.9, -0.4], &weights, &mut by_ends);
            let [x, y] = wake_tangents(&nodes)[k];
            let sums = Sums::zero().over_points(&by_ends, &rates);
            sums.assert_are("tangent", &[x * 0.9 - y * 0.4], |_| weights);
        }
    });
}

/// Residuals of the layer and defects of the stations of the wake, for moving widths of the dead air.
fn behind_the_edge(solved: &Solved, gap: &[Forward]) -> (Vec<[Forward; 3]>, Vec<Forward>) {
    let layer = &solved.system.layer;
    let law = layer.law.map(Forward::from);
    let derived: Vec<Derived<Forward>> = layer.derive(solved.unknowns, |state| state.map(Forward::from), &law);
    let abscissas = solved.at.positions.abscissas.each_ref().map(|side| side.iter().map(|x| x.re).collect());
    let wake = &derived[layer.numbering().wake_start()..];
    let mass = wake.iter().zip(gap).map(|(station, gap)| mass_defect(station, Some(*gap))).collect();
    (layer.residuals(&derived, &abscissas, &law, gap), mass)
}

/// The numbers of [`behind_the_edge`] in a row, and the weight of each.
fn dead_air(solved: &Solved, reverse: &Reverse, nodes: &[[Forward; 2]]) -> (Vec<Forward>, Vec<Lanes>) {
    let gap = wake::dead_air(&edge_frame(nodes), &reverse.section.wake_distances);
    let (residuals, mass) = behind_the_edge(solved, &gap);
    let first = reverse.at.numbering.wake_start();
    let weights = reverse.multipliers.chain.as_flattened().iter().map(|multiplier| -multiplier);
    let by_mass = (0..mass.len()).map(|j| lanes(&reverse.mass, |mass| mass[first + j]));
    (residuals.as_flattened().iter().copied().chain(mass).collect(), weights.chain(by_mass).collect())
}

#[test]
fn dead_air_adds_the_change_of_the_equations_and_of_the_defects_of_the_wake() {
    with_directions(|solved, reverse, direction| {
        let outline = &reverse.section.panels.outline;
        if outline.trailing_edge == TrailingEdge::Sharp {
            return;
        }
        let mut collected = Collected::nothing(outline.len());
        add_dead_air(solved, reverse, &mut collected);
        let (forward, weights) = dead_air(solved, reverse, &direction.moved(&outline.nodes));
        Sums::zero().over(&collected, direction).assert_are("dead air", &forward, |i| weights[i]);
    });
}

#[test]
fn the_wake_as_a_whole_follows_the_nodes_of_the_section_and_the_incidence() {
    with_directions(|solved, reverse, direction| {
        let outline = &reverse.section.panels.outline;
        let weights = panel_weights(reverse.section, &reverse.strengths);
        let mut collected = Collected::nothing(outline.len());
        let panels = add_wake(solved, reverse, &weights, &mut collected);
        add_panels_of(panels, reverse, &mut collected);
        let (nodes, alpha) = (direction.moved(&outline.nodes), moving(reverse.flow.alpha, direction.alpha));
        let path = path(reverse, &nodes, alpha);
        let halves = path.windows(2).flat_map(|pair| [[0, 1].map(|c| (pair[0][c] + pair[1][c]) * 0.5), pair[1]]);
        let ends: Vec<[Forward; 2]> = std::iter::once(path[0]).chain(halves).collect();
        let stream = wake_stream(reverse, outline, &nodes, &ends);
        let speeds = speeds(reverse, &nodes, &ends, alpha);
        let mut all: Vec<(Forward, Lanes)> = Vec::new();
        all.extend(stream.iter().enumerate().map(|(i, v)| (*v, lanes(&weights.stream, |weights| weights[i]))));
        all.extend(speeds.iter().enumerate().map(|(i, v)| (*v, speed_weight(reverse, &weights.edge, i))));
        if outline.trailing_edge == TrailingEdge::Blunt {
            let (forward, weights) = dead_air(solved, reverse, &nodes);
            all.extend(forward.into_iter().zip(weights));
        }
        let (forward, weights): (Vec<Forward>, Vec<Lanes>) = all.into_iter().unzip();
        Sums::zero().over(&collected, direction).assert_are("wake", &forward, |i| weights[i]);
    });
}
