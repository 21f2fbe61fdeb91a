//! Reverse sweep through the panel equations: every panel and every node, once for all outputs.

use super::sums::{PanelSums, variables};
use super::{Collected, Each, OUTPUTS, Reverse};
use crate::flow::coupled::duals::{Dual4, Dual8, gradient};
use crate::flow::coupled::response::{edge_place, wake_points, wake_strength_matrix};
use crate::flow::panel::kernel::stream_influence;
use crate::flow::panel::outline::{TrailingEdge, TrailingEdgeFrame};
use crate::flow::panel::polar::Straight;
use nalgebra::{DMatrix, DVector};

/// Multipliers of the panel equations, negative.
pub(super) struct PanelWeights {
    /// Of the stream function at the nodes.
    pub stream: Each<Vec<f64>>,
    /// Of the mean velocity through the cut at the trailing edge.
    pub edge: [f64; OUTPUTS],
}

pub(super) fn panel_weights(reverse: &Reverse) -> PanelWeights {
    let n = reverse.section.len();
    let mut columns = DMatrix::zeros(n + 1, OUTPUTS);
    for output in 0..OUTPUTS {
        columns.column_mut(output).rows_mut(0, n).copy_from_slice(&reverse.strengths[output]);
    }
    reverse.section.panels.factors.solve_transposed(&mut columns);
    let stream = std::array::from_fn(|output| {
        let column = columns.column(output);
        let mut weights: Vec<f64> = (0..n).map(|i| -column[i]).collect();
        // the first equation is the mean of both edge nodes
        weights[0] *= 0.5;
        weights[n - 1] = weights[0];
        weights
    });
    PanelWeights { stream, edge: std::array::from_fn(|output| -columns[(n - 1, output)]) }
}

/// A panel seen from a point, with the relative positions of its ends as variables.
pub(super) fn seen_from(point: [f64; 2], panel: [[f64; 2]; 2]) -> [[Dual4; 2]; 2] {
    [0, 1].map(|end| [0, 1].map(|c| Dual4::from_re(panel[end][c] - point[c]).derivative(2 * end + c)))
}

pub(super) const ORIGIN: [f64; 2] = [0.0; 2];

pub(super) fn origin() -> [Dual4; 2] {
    ORIGIN.map(Dual4::from_re)
}

/// Adds the gradient of a quantity of a panel seen from a point to the point and the two ends.
pub(super) fn scatter(g: [f64; 4], weight: f64, point: &mut [f64; 2], ends: [&mut [f64; 2]; 2]) {
    for (end, target) in ends.into_iter().enumerate() {
        for c in 0..2 {
            target[c] += weight * g[2 * end + c];
            point[c] -= weight * g[2 * end + c];
        }
    }
}

/// The vortex strengths at the nodes and the smoothed defects of a solution.
pub(super) fn solution_strengths(reverse: &Reverse) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let at = reverse.at;
    let nodes: Vec<f64> = at.speeds.node_mass.iter().map(|m| m.re).collect();
    let wake = at.mass[at.numbering.wake_start()..].to_vec();
    let strengths = crate::flow::coupled::speeds::node_strengths(reverse.section, reverse.flow, &nodes, &wake);
    let mut smoothed = nodes;
    crate::flow::coupled::response::smooth(&mut smoothed);
    (strengths, smoothed, wake)
}

pub(super) fn add_panels(reverse: &Reverse, collected: &mut Collected) {
    let PanelWeights { stream: weights, edge } = panel_weights(reverse);
    let outline = &reverse.section.panels.outline;
    let n = outline.len();
    let (strengths, smoothed, _) = solution_strengths(reverse);
    super::edge::add_surface_panels(reverse, &edge, &strengths, &smoothed, collected);
    let (sin, cos) = reverse.flow.alpha.sin_cos();
    for (i, point) in outline.nodes.iter().enumerate() {
        for output in 0..OUTPUTS {
            let w = weights[output][i];
            // stream function of the onset flow: y cos α − x sin α
            collected.nodes[output][i][0] -= w * sin;
            collected.nodes[output][i][1] += w * cos;
            collected.alpha[output] -= w * (point[1] * sin + point[0] * cos);
        }
    }
    let lanes: Vec<[f64; OUTPUTS]> = (0..n).map(|i| std::array::from_fn(|output| weights[output][i])).collect();
    let mut velocity = vec![[0.0; 2]; n];
    for j in 0..n - 1 {
        let ends = outline.panel(j);
        let panel = Straight::new(ends);
        let jump = smoothed[j + 1] - smoothed[j];
        let mut sums = PanelSums::default();
        for (i, point) in outline.nodes.iter().enumerate() {
            let seen = reverse.section.panels.polar.seen_of_surface(i, [j, j + 1], &panel);
            let (at, length) = variables(&panel, *point);
            let influence = seen.sight(at, length, outline.place(i, j)).stream();
            let stream = influence.vortex[0] * strengths[j] + influence.vortex[1] * strengths[j + 1]
                - influence.source / length * jump;
            sums.add(&panel, *point, stream.eps, &lanes[i]);
            let by_point = panel.outer([stream.eps[0], stream.eps[1]]);
            velocity[i][0] += by_point[0];
            velocity[i][1] += by_point[1];
        }
        for output in 0..OUTPUTS {
            let by_ends = sums.by_ends(ends, output);
            for c in 0..2 {
                collected.nodes[output][j][c] += by_ends[0][c];
                collected.nodes[output][j + 1][c] += by_ends[1][c];
            }
        }
    }
    for output in 0..OUTPUTS {
        for (i, v) in velocity.iter().enumerate() {
            for c in 0..2 {
                collected.nodes[output][i][c] += lanes[i][output] * v[c];
            }
        }
    }
    if outline.trailing_edge == TrailingEdge::Blunt {
        add_closing(reverse, &weights, &strengths, collected);
    }
}

/// Strengths per length of the closing panel for unit edge speed, with derivatives with respect to the first two
/// nodes and the last two.
pub(super) fn closing_strengths(reverse: &Reverse) -> [Dual8; 2] {
    let nodes = &reverse.section.panels.outline.nodes;
    let frame = edge_frame_dual(nodes);
    let n = nodes.len();
    let unit = |v: f64, k: usize| Dual8::from_re(v).derivative(k);
    let dx = unit(nodes[0][0], 0) - unit(nodes[n - 1][0], 6);
    let dy = unit(nodes[0][1], 1) - unit(nodes[n - 1][1], 7);
    let length = num_dual::DualNum::sqrt(&(dx * dx + dy * dy));
    [frame.vortex / length, frame.source / length]
}

/// The trailing edge as a function of nodes 0, 1, N − 2, N − 1 (two directions each).
pub(super) fn edge_frame_dual(nodes: &[[f64; 2]]) -> TrailingEdgeFrame<Dual8> {
    let n = nodes.len();
    let at = |i: usize, k: usize| [0, 1].map(|c| Dual8::from_re(nodes[i][c]).derivative(2 * k + c));
    TrailingEdgeFrame::new([at(0, 0), at(1, 1)], [at(n - 2, 2), at(n - 1, 3)])
}

/// Adds a gradient over the four edge nodes.
pub(super) fn scatter_edge(g: [f64; 8], weight: f64, nodes: &mut [[f64; 2]]) {
    let n = nodes.len();
    for (k, i) in [0, 1, n - 2, n - 1].into_iter().enumerate() {
        for c in 0..2 {
            nodes[i][c] += weight * g[2 * k + c];
        }
    }
}

fn add_closing(reverse: &Reverse, weights: &Each<Vec<f64>>, strengths: &[f64], collected: &mut Collected) {
    let outline = &reverse.section.panels.outline;
    let n = outline.len();
    let speed = 0.5 * (strengths[0] - strengths[n - 1]);
    let [vortex, source] = closing_strengths(reverse);
    let mut sums = [[0.0; 2]; OUTPUTS];
    for (i, point) in outline.nodes.iter().enumerate() {
        let influence = stream_influence(seen_from(*point, outline.panel(n - 1)), origin(), outline.place(i, n - 1));
        let by_vortex = influence.vortex[0] + influence.vortex[1];
        let g = gradient(&(by_vortex * (vortex.re * speed) + influence.source * (source.re * speed)));
        for output in 0..OUTPUTS {
            let w = weights[output][i];
            let nodes = &mut collected.nodes[output];
            for c in 0..2 {
                nodes[n - 1][c] += w * g[c];
                nodes[0][c] += w * g[2 + c];
                nodes[i][c] -= w * (g[c] + g[2 + c]);
            }
            sums[output][0] += w * by_vortex.re;
            sums[output][1] += w * influence.source.re;
        }
    }
    for output in 0..OUTPUTS {
        let nodes = &mut collected.nodes[output];
        scatter_edge(gradient(&vortex), sums[output][0] * speed, nodes);
        scatter_edge(gradient(&source), sums[output][1] * speed, nodes);
    }
}

/// Wake sources in the stream function at the nodes; adds to the nodes and to the ends of the wake's half panels.
pub(super) fn add_wake_stream(reverse: &Reverse, by_points: &mut Each<Vec<[f64; 2]>>, collected: &mut Collected) {
    let PanelWeights { stream: weights, edge } = panel_weights(reverse);
    let outline = &reverse.section.panels.outline;
    let points = wake_points(&reverse.flow.wake_nodes);
    let strengths = half_panel_strengths(reverse);
    super::edge::add_wake_panels(reverse, &edge, &points, &strengths, by_points, collected);
    let n = outline.len();
    let lanes: Vec<[f64; OUTPUTS]> = (0..n).map(|i| std::array::from_fn(|output| weights[output][i])).collect();
    let mut velocity = vec![[0.0; 2]; n];
    for h in 0..points.len() - 1 {
        let ends = [points[h], points[h + 1]];
        let panel = Straight::new(ends);
        let mut sums = PanelSums::default();
        for (i, node) in outline.nodes.iter().enumerate() {
            let seen = reverse.flow.polar.seen_of_wake(i, [h, h + 1], &panel);
            let (at, length) = variables(&panel, *node);
            let [a, b] = seen.sight(at, length, edge_place(outline, i, h)).wake_stream();
            let stream = a * strengths[h] + b * strengths[h + 1];
            sums.add(&panel, *node, stream.eps, &lanes[i]);
            let by_point = panel.outer([stream.eps[0], stream.eps[1]]);
            velocity[i][0] += by_point[0];
            velocity[i][1] += by_point[1];
        }
        for output in 0..OUTPUTS {
            let by_ends = sums.by_ends(ends, output);
            for c in 0..2 {
                by_points[output][h][c] += by_ends[0][c];
                by_points[output][h + 1][c] += by_ends[1][c];
            }
        }
    }
    for output in 0..OUTPUTS {
        for (i, v) in velocity.iter().enumerate() {
            for c in 0..2 {
                collected.nodes[output][i][c] += lanes[i][output] * v[c];
            }
        }
    }
}

/// Source strengths at the ends of the half panels of the wake.
pub(super) fn half_panel_strengths(reverse: &Reverse) -> Vec<f64> {
    let at = reverse.at;
    let matrix = wake_strength_matrix(&reverse.section.wake_distances);
    let mass = DVector::from_row_slice(&at.mass[at.numbering.wake_start()..]);
    (matrix * mass).as_slice().to_vec()
}
