//! Reverse sweep through the wake: the speeds along it (and, in the same sweep, those through the cut at the edge), the
//! [path](super::path) and the dead air.

use super::edge::add_cut;
use super::influence::{PanelWeights, add_wake_stream, edge_frame_dual, scatter_edge};
use super::path::add_path;
use super::reverse::{Collected, Lanes, Reverse, Strengths, lanes};
use super::sums::Points;
use super::velocity::{HalfPanels, Observers, Velocities};
use crate::flow::coefficients::Coefficients;
use crate::flow::duals::{Dual2, Dual4, gradient};
use crate::flow::layer::equations::Interval;
use crate::flow::layer::{EdgeLaw, Regime};
use crate::flow::panel::coupling::response::{wake_points, wake_tangents};
use crate::flow::panel::outline::TrailingEdge;
use crate::flow::panel::solved::Solved;
use crate::flow::panel::wake;

/// Adds the derivatives that act through the wake, but for the panel equations of the flow that the path follows, whose
/// sheets and multipliers the result holds.
pub(super) fn add_wake(
    solved: &Solved,
    reverse: &Reverse,
    weights: &PanelWeights,
    collected: &mut Collected,
) -> (Strengths, PanelWeights) {
    let points = wake_points(&reverse.flow.path.nodes);
    let mut by_points = collected.nodes.as_ref().map(|_| vec![[0.0; 2]; points.len()]);
    add_wake_stream(reverse, weights, &points, &mut by_points, collected);
    add_velocities(reverse, &weights.edge, &points, &mut by_points, collected);
    // middles of the panels are means of the nodes
    let by_nodes = by_points.map(|by_points| {
        let mut by_nodes: Vec<[f64; 2]> = by_points.iter().step_by(2).copied().collect();
        for (k, middle) in by_points.iter().skip(1).step_by(2).enumerate() {
            for c in 0..2 {
                by_nodes[k][c] += 0.5 * middle[c];
                by_nodes[k + 1][c] += 0.5 * middle[c];
            }
        }
        by_nodes
    });
    if reverse.section.panels.outline.trailing_edge == TrailingEdge::Blunt {
        add_dead_air(solved, reverse, collected);
    }
    add_path(reverse, &by_nodes, collected)
}

/// Adds the velocities through the cut at the trailing edge and along the wake: positions of the panels and of the
/// points themselves, directions, onset flow. Node 0 of the wake takes the speed of the edge, whatever the geometry.
fn add_velocities(
    reverse: &Reverse,
    edge_weights: &Lanes,
    ends: &[[f64; 2]],
    by_ends: &mut Coefficients<Vec<[f64; 2]>>,
    collected: &mut Collected,
) {
    let (flow, cut) = (reverse.flow, &reverse.section.panels.edge.cut);
    let (sin, cos) = flow.alpha.sin_cos();
    let first = cut.points.len();
    let places: Vec<[f64; 2]> = cut.points.iter().map(|p| p.0).chain(flow.path.nodes[1..].iter().copied()).collect();
    let directions: (Vec<f64>, Vec<f64>) = std::iter::repeat_n(cut.direction, first)
        .chain(flow.wake_tangents[1..].iter().copied())
        .map(|[x, y]| (x, y))
        .unzip();
    let points = Points::new(&places, |i| match cut.points.get(i) {
        Some((_, weight)) => edge_weights * *weight,
        None => lanes(&reverse.wake_weights, |weights| weights[i + 1 - first]),
    });
    let mut sums = Velocities::new([cos, sin], places.len());
    let observers = Observers { points: &points, directions: [&directions.0, &directions.1] };
    sums.add_section(reverse, &reverse.at_solution, observers, &flow.from_surface, collected);
    sums.add_wake(reverse, observers, HalfPanels { ends, polar: &flow.from_wake, first_of_wake: first }, by_ends);
    add_cut(reverse, edge_weights, &sums.velocity, &sums.by_point, collected);
    for k in 1..flow.path.nodes.len() {
        let i = first + k - 1;
        let tangent = flow.wake_tangents[k];
        let by_point = sums.by_point.at(i);
        let weights = &points.weights[i];
        collected.alpha += weights * (cos * tangent[1] - sin * tangent[0]);
        for (by_ends, weight) in by_ends.iter_mut().zip(weights) {
            for c in 0..2 {
                by_ends[2 * k][c] += weight * by_point[c];
            }
        }
        add_tangent(reverse, k, sums.velocity.at(i), weights, by_ends);
    }
}

/// Adds the effect of the tangent at wake node `k`, which turns with the two neighbouring nodes.
fn add_tangent(
    reverse: &Reverse,
    k: usize,
    velocity: [f64; 2],
    weights: &Lanes,
    by_points: &mut Coefficients<Vec<[f64; 2]>>,
) {
    let nodes = &reverse.flow.path.nodes;
    let (before, behind) = (k - 1, (k + 1).min(nodes.len() - 1));
    let at = |i: usize, first: usize| [0, 1].map(|c| Dual4::from_re(nodes[i][c]).derivative(first + c));
    let tangent = wake_tangents(&[at(before, 0), at(behind, 2)])[0];
    let g = gradient(&(tangent[0] * velocity[0] + tangent[1] * velocity[1]));
    for (by_points, weight) in by_points.iter_mut().zip(weights) {
        for c in 0..2 {
            by_points[2 * before][c] += weight * g[c];
            by_points[2 * behind][c] += weight * g[2 + c];
        }
    }
}

/// Adds the effect of the dead air behind a blunt edge, in the equations and in the mass defect of the wake.
fn add_dead_air(solved: &Solved, reverse: &Reverse, collected: &mut Collected) {
    let (layer, at) = (&solved.system.layer, reverse.at);
    let first = at.numbering.wake_start();
    let nodes = &reverse.section.panels.outline.nodes;
    let gaps = wake::dead_air(&edge_frame_dual(nodes), layer.distances);
    let mut by_gap = vec![Lanes::zeros(); gaps.len()];
    for (j, by_gap) in by_gap.iter_mut().enumerate() {
        *by_gap += lanes(&reverse.mass, |mass| mass[first + j]) * at.derived[first + j].speed.re;
    }
    let law = layer.law.map(Dual2::from_re);
    for number in 1..gaps.len() {
        let k = first + number;
        let [before, own] = [k - 1, k].map(|i| at.derived[i].map(|v| Dual2::from_re(v.re)));
        let gap = [0, 1].map(|end| Dual2::from_re(layer.gap[number - 1 + end]).derivative(end));
        let interval = Interval { from: &before, span: layer.wake_span(number, gap), regime: Regime::Wake };
        for (r, m) in interval.residual(&own, &law).iter().zip(&reverse.multipliers.chain[k]) {
            by_gap[number - 1] -= m * r.eps[0];
            by_gap[number] -= m * r.eps[1];
        }
    }
    for (gap, weights) in gaps.iter().zip(&by_gap) {
        scatter_edge(gradient(gap), weights, &mut collected.nodes);
    }
}

#[cfg(test)]
mod tests;
