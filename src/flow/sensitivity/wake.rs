//! Reverse sweep through the wake: speeds along it, its path and its dead air.

use super::influence::{
    add_wake_stream, closing_strengths, edge_frame_dual, half_panel_strengths, origin, scatter, scatter_edge,
    seen_from, solution_strengths,
};
use super::sums::{Dual3, PanelSums, variables};
use super::{Collected, Each, OUTPUTS, Reverse, Solved};
use crate::flow::boundary_layer::interval::{self, Span};
use crate::flow::boundary_layer::station::Regime;
use crate::flow::coupled::chain::WAKE_ORIGIN;
use crate::flow::coupled::duals::{Dual2, Dual4, Dual8, gradient};
use crate::flow::coupled::response::{wake_place, wake_points, wake_tangents};
use crate::flow::panel::kernel::{Place, velocity_influence};
use crate::flow::panel::outline::TrailingEdge;
use crate::flow::panel::polar::{Polar, Straight};
use crate::flow::panel::wake;
use num_dual::DualNum;

pub(super) fn add_wake(solved: &Solved, reverse: &Reverse, collected: &mut Collected) {
    let points = wake_points(&reverse.flow.wake_nodes);
    let mut by_points: Each<Vec<[f64; 2]>> = std::array::from_fn(|_| vec![[0.0; 2]; points.len()]);
    add_wake_stream(reverse, &mut by_points, collected);
    add_speeds(reverse, &points, &mut by_points, collected);
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

/// Speeds along the wake: positions of panels and wake nodes, tangents, onset flow.
fn add_speeds(reverse: &Reverse, points: &[[f64; 2]], by_points: &mut Each<Vec<[f64; 2]>>, collected: &mut Collected) {
    let (outline, flow) = (&reverse.section.panels.outline, reverse.flow);
    let n = outline.len();
    let (strengths, smoothed, _) = solution_strengths(reverse);
    let sources = half_panel_strengths(reverse);
    let (sin, cos) = flow.alpha.sin_cos();
    let blunt = outline.trailing_edge == TrailingEdge::Blunt;
    let edge_speed = 0.5 * (strengths[0] - strengths[n - 1]);
    let closing = closing_or_nothing(reverse, blunt);
    let panels: Vec<Straight> = (0..n - 1).map(|j| Straight::new(outline.panel(j))).collect();
    let mut sums = vec![PanelSums::default(); n - 1];
    let halves: Vec<Straight> = points.windows(2).map(|w| Straight::new([w[0], w[1]])).collect();
    let mut half_sums = vec![PanelSums::default(); halves.len()];
    let among = Polar::among(points);
    // node 0 of the wake takes the speed of the edge, whatever the geometry
    for k in 1..flow.wake_nodes.len() {
        let (at, tangent) = (flow.wake_nodes[k], flow.wake_tangents[k]);
        let along = |v: [Dual4; 2]| v[0] * tangent[0] + v[1] * tangent[1];
        let mut velocity = [cos, sin];
        let mut own: Each<[f64; 2]> = [[0.0; 2]; OUTPUTS];
        let weights: [f64; OUTPUTS] = std::array::from_fn(|o| reverse.wake_weights[o][k]);
        // a velocity in the frame of a panel
        let mut add = |panel: &Straight, sums: &mut PanelSums, [t, n]: [Dual3; 2]| {
            let outer = panel.outer([t.re, n.re]);
            velocity[0] += outer[0];
            velocity[1] += outer[1];
            let [tx, ty] = panel.tangent;
            let component = t * (tangent[0] * tx + tangent[1] * ty) + n * (tangent[1] * tx - tangent[0] * ty);
            sums.add(panel, at, component.eps, &weights);
            let turned = [t.re * tangent[0] + n.re * tangent[1], t.re * tangent[1] - n.re * tangent[0]];
            sums.add_turn(turned, &weights);
            let by_point = panel.outer([component.eps[0], component.eps[1]]);
            for output in 0..OUTPUTS {
                own[output][0] += weights[output] * by_point[0];
                own[output][1] += weights[output] * by_point[1];
            }
        };
        for (j, panel) in panels.iter().enumerate() {
            let seen = flow.from_surface.seen_of_surface(k, [j, j + 1], panel);
            let (place, length) = variables(panel, at);
            let v = seen.sight(place, length, Place::Elsewhere).velocity();
            let source = length.recip() * (smoothed[j] - smoothed[j + 1]);
            let (a, b) = (v.vortex(0), v.vortex(1));
            let (c, d) = (v.source(0), v.source(1));
            let total = [0, 1].map(|e| a[e] * strengths[j] + b[e] * strengths[j + 1] + (c[e] + d[e]) * source);
            add(panel, &mut sums[j], total);
        }
        for (h, panel) in halves.iter().enumerate() {
            let seen = among.seen_of_surface(2 * k, [h, h + 1], panel);
            let (place, length) = variables(panel, at);
            let v = seen.sight(place, length, wake_place(k, h)).velocity();
            let (a, b) = (v.source(0), v.source(1));
            add(panel, &mut half_sums[h], [0, 1].map(|e| a[e] * sources[h] + b[e] * sources[h + 1]));
        }
        if blunt {
            let v = velocity_influence(seen_from(at, outline.panel(n - 1)), origin(), Place::Elsewhere);
            let by_vortex = [0, 1].map(|c| v.vortex[0][c] + v.vortex[1][c]);
            let by_source = [0, 1].map(|c| v.source[0][c] + v.source[1][c]);
            let total = [0, 1].map(|c| (by_vortex[c] * closing[0].re + by_source[c] * closing[1].re) * edge_speed);
            velocity[0] += total[0].re;
            velocity[1] += total[1].re;
            let g = gradient(&along(total));
            for output in 0..OUTPUTS {
                let (first, rest) = collected.nodes[output].split_at_mut(1);
                let last = rest.len() - 1;
                scatter(g, weights[output], &mut own[output], [&mut rest[last], &mut first[0]]);
            }
            for output in 0..OUTPUTS {
                let w = weights[output] * edge_speed;
                scatter_edge(gradient(&closing[0]), w * along(by_vortex).re, &mut collected.nodes[output]);
                scatter_edge(gradient(&closing[1]), w * along(by_source).re, &mut collected.nodes[output]);
            }
        }
        for output in 0..OUTPUTS {
            let target = &mut by_points[output][2 * k];
            target[0] += own[output][0];
            target[1] += own[output][1];
            collected.alpha[output] += weights[output] * (cos * tangent[1] - sin * tangent[0]);
        }
        add_tangent(reverse, k, velocity, weights, by_points);
    }
    for output in 0..OUTPUTS {
        scatter_ends(&sums, &outline.nodes, output, &mut collected.nodes[output]);
        scatter_ends(&half_sums, points, output, &mut by_points[output]);
    }
}

/// Adds the derivatives of one output with respect to the ends of consecutive panels.
fn scatter_ends(sums: &[PanelSums], ends: &[[f64; 2]], output: usize, targets: &mut [[f64; 2]]) {
    for (j, sums) in sums.iter().enumerate() {
        let by_ends = sums.by_ends([ends[j], ends[j + 1]], output);
        for c in 0..2 {
            targets[j][c] += by_ends[0][c];
            targets[j + 1][c] += by_ends[1][c];
        }
    }
}

fn closing_or_nothing(reverse: &Reverse, blunt: bool) -> [Dual8; 2] {
    if blunt { closing_strengths(reverse) } else { [Dual8::from_re(0.0); 2] }
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
            for (r, m) in residuals.iter().zip(&reverse.multipliers[output].chain[k]) {
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
