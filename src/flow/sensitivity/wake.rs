//! Reverse sweep through the wake: speeds along it (and through the cut at the edge, in the same sweep), its path and its
//! dead air.

use super::edge::add_cut;
use super::influence::{PanelWeights, add_wake_stream, edge_frame_dual, scatter_edge};
use super::sums::Points;
use super::velocity::{Observers, Velocities};
use super::{Collected, Each, OUTPUTS, Reverse, Solved};
use crate::flow::boundary_layer::interval::{self, Span};
use crate::flow::boundary_layer::station::Regime;
use crate::flow::coupled::chain::WAKE_ORIGIN;
use crate::flow::coupled::duals::{Dual2, Dual4, Dual8, gradient};
use crate::flow::coupled::response::{wake_points, wake_tangents};
use crate::flow::panel::outline::TrailingEdge;
use crate::flow::panel::wake;
use num_dual::DualNum;

pub(super) fn add_wake(solved: &Solved, reverse: &Reverse, weights: &PanelWeights, collected: &mut Collected) {
    let points = wake_points(&reverse.flow.wake_nodes);
    let mut by_points: Each<Vec<[f64; 2]>> = std::array::from_fn(|_| vec![[0.0; 2]; points.len()]);
    add_wake_stream(reverse, weights, &points, &mut by_points, collected);
    add_velocities(reverse, &weights.edge, &points, &mut by_points, collected);
    // middles of the panels are means of the nodes
    let mut by_nodes: Each<Vec<[f64; 2]>> = std::array::from_fn(|o| by_points[o].iter().step_by(2).copied().collect());
    for output in 0..OUTPUTS {
        for (k, middle) in by_points[output].iter().skip(1).step_by(2).enumerate() {
            for c in 0..2 {
                by_nodes[output][k][c] += 0.5 * middle[c];
                by_nodes[output][k + 1][c] += 0.5 * middle[c];
            }
        }
    }
    add_path(reverse, &by_nodes, collected);
    if reverse.section.panels.outline.trailing_edge == TrailingEdge::Blunt {
        add_dead_air(solved, reverse, collected);
    }
}

/// Velocities through the cut at the trailing edge and along the wake: positions of panels and of the points
/// themselves, directions, onset flow. Node 0 of the wake takes the speed of the edge, whatever the geometry.
fn add_velocities(
    reverse: &Reverse,
    edge_weights: &[f64; OUTPUTS],
    ends: &[[f64; 2]],
    by_ends: &mut Each<Vec<[f64; 2]>>,
    collected: &mut Collected,
) {
    let (flow, cut) = (reverse.flow, &reverse.section.panels.edge.cut);
    let (sin, cos) = flow.alpha.sin_cos();
    let first = cut.points.len();
    let places: Vec<[f64; 2]> = cut.points.iter().map(|p| p.0).chain(flow.wake_nodes[1..].iter().copied()).collect();
    let directions: (Vec<f64>, Vec<f64>) = std::iter::repeat_n(cut.direction, first)
        .chain(flow.wake_tangents[1..].iter().copied())
        .map(|[x, y]| (x, y))
        .unzip();
    let points = Points::new(&places, |output, i| match cut.points.get(i) {
        Some((_, weight)) => edge_weights[output] * weight,
        None => reverse.wake_weights[output][i + 1 - first],
    });
    let mut sums = Velocities::new([cos, sin], places.len());
    let observers = Observers {
        points: &points,
        directions: [&directions.0, &directions.1],
        from_surface: &flow.from_surface,
        from_wake: &flow.from_wake,
        first_of_wake: first,
    };
    sums.add_panels(reverse, &observers, ends, by_ends, collected);
    add_cut(reverse, edge_weights, &sums.velocity, &sums.by_point, collected);
    for k in 1..flow.wake_nodes.len() {
        let i = first + k - 1;
        let tangent = flow.wake_tangents[k];
        let by_point = sums.by_point.at(i);
        for output in 0..OUTPUTS {
            collected.alpha[output] += points.weights[i][output] * (cos * tangent[1] - sin * tangent[0]);
            for c in 0..2 {
                by_ends[output][2 * k][c] += points.weights[i][output] * by_point[c];
            }
        }
        add_tangent(reverse, k, sums.velocity.at(i), points.weights[i], by_ends);
    }
}

/// The tangent at wake node `k` turns with its neighbours.
fn add_tangent(
    reverse: &Reverse,
    k: usize,
    velocity: [f64; 2],
    weights: [f64; OUTPUTS],
    by_points: &mut Each<Vec<[f64; 2]>>,
) {
    let nodes = &reverse.flow.wake_nodes;
    let (before, behind) = (k - 1, (k + 1).min(nodes.len() - 1));
    let at = |i: usize, first: usize| [0, 1].map(|c| Dual4::from_re(nodes[i][c]).derivative(first + c));
    let tangent = wake_tangents(&[at(before, 0), at(behind, 2)])[0];
    let g = gradient(&(tangent[0] * velocity[0] + tangent[1] * velocity[1]));
    for output in 0..OUTPUTS {
        for c in 0..2 {
            by_points[output][2 * before][c] += weights[output] * g[c];
            by_points[output][2 * behind][c] += weights[output] * g[2 + c];
        }
    }
}

/// The path follows the trailing edge and the incidence.
fn add_path(reverse: &Reverse, by_nodes: &Each<Vec<[f64; 2]>>, collected: &mut Collected) {
    let distances = &reverse.section.wake_distances;
    let alpha = reverse.flow.alpha;
    let nodes = &reverse.section.panels.outline.nodes;
    let fixed = [alpha.cos(), alpha.sin()].map(Dual8::from_re);
    let path = wake::path(&edge_frame_dual(nodes), fixed, distances);
    let (sin, cos) = Dual2::from_re(alpha).derivative(0).sin_cos();
    let frame = reverse.section.edge_frame().map(Dual2::from_re);
    let turning = wake::path(&frame, [cos, sin], distances);
    for output in 0..OUTPUTS {
        for (k, weight) in by_nodes[output].iter().enumerate() {
            for c in 0..2 {
                scatter_edge(gradient(&path[k][c]), weight[c], &mut collected.nodes[output]);
                collected.alpha[output] += weight[c] * gradient(&turning[k][c])[0];
            }
        }
    }
}

/// The dead air behind a blunt edge, in the wake's equations and in its mass defect.
fn add_dead_air(solved: &Solved, reverse: &Reverse, collected: &mut Collected) {
    let layer = solved.system.layer();
    let first = layer.numbering.wake_start();
    let at = reverse.at;
    let nodes = &reverse.section.panels.outline.nodes;
    let gaps = wake::dead_air(&edge_frame_dual(nodes), layer.distances);
    let mut by_gap: Each<Vec<f64>> = std::array::from_fn(|_| vec![0.0; gaps.len()]);
    for j in 0..gaps.len() {
        let k = first + j;
        let speed = at.derived[k].state.log_speed.re.exp();
        for output in 0..OUTPUTS {
            by_gap[output][j] += reverse.mass[output][k] * speed;
        }
        if j == 0 {
            continue;
        }
        let plain = [k - 1, k].map(|i| at.derived[i].map(|v| Dual2::from_re(v.re)));
        let span = Span {
            x: [j - 1, j].map(|i| Dual2::from_re(WAKE_ORIGIN + layer.distances[i])),
            gap: [0, 1].map(|e| Dual2::from_re(layer.gap[j - 1 + e]).derivative(e)),
        };
        let residuals = interval::momentum_and_energy(&plain[0], &plain[1], &span, Regime::Wake);
        for output in 0..OUTPUTS {
            for (r, m) in residuals.iter().zip(reverse.multipliers.chain[k].map(|m| m[output])) {
                let g = gradient(r);
                by_gap[output][j - 1] -= m * g[0];
                by_gap[output][j] -= m * g[1];
            }
        }
    }
    for output in 0..OUTPUTS {
        for (gap, weight) in gaps.iter().zip(&by_gap[output]) {
            scatter_edge(gradient(gap), *weight, &mut collected.nodes[output]);
        }
    }
}
