//! Reverse sweep through the wake: speeds along it, its path and its dead air.

use super::influence::{
    add_wake_stream, closing_strengths, edge_frame_dual, half_panel_strengths, origin, scatter_edge, seen_from,
    solution_strengths,
};
use super::sums::{Dual3, Points, Quantity, Slopes, Table, scatter_ends};
use super::{Collected, Each, OUTPUTS, Reverse, Solved};
use crate::flow::boundary_layer::interval::{self, Span};
use crate::flow::boundary_layer::station::Regime;
use crate::flow::coupled::chain::WAKE_ORIGIN;
use crate::flow::coupled::duals::{Dual2, Dual4, Dual8, gradient};
use crate::flow::coupled::response::{wake_place, wake_points, wake_tangents};
use crate::flow::panel::kernel::{Place, velocity_influence};
use crate::flow::panel::outline::TrailingEdge;
use crate::flow::panel::polar::{Pairs, Polar, Straight};
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

/// Speed along the wake of a panel with linear vortex and source strengths: slopes, and the velocity along and across
/// the panel.
#[derive(Clone, Copy)]
struct WakeSpeed<'a> {
    pairs: Pairs<'a>,
    panel: &'a Straight,
    /// Directions of the wake at its nodes.
    tangents: &'a [[f64; 2]],
    /// Vortex strengths at the two ends.
    vortex: [f64; 2],
    /// Source strengths at the two ends, and a constant one over the length of the panel.
    source: [f64; 2],
    jump: f64,
}

impl Quantity<5> for WakeSpeed<'_> {
    fn first(&self, points: usize) -> Self {
        Self { pairs: self.pairs.first(points), tangents: &self.tangents[..points], ..*self }
    }

    #[inline(always)]
    fn at(&self, i: usize, at: [Dual3; 2], length: Dual3, place: Place) -> [f64; 5] {
        let v = self.pairs.of_surface(i, self.panel).sight(at, length, place).velocity();
        let constant = length.recip() * self.jump;
        let (a, b) = (v.vortex(0), v.vortex(1));
        let (c, d) = (v.source(0), v.source(1));
        let total = |e: usize| {
            a[e] * self.vortex[0]
                + b[e] * self.vortex[1]
                + c[e] * self.source[0]
                + d[e] * self.source[1]
                + (c[e] + d[e]) * constant
        };
        let (along, across) = (total(0), total(1));
        let [wx, wy] = self.tangents[i];
        let [tx, ty] = self.panel.tangent;
        let speed = along * (wx * tx + wy * ty) + across * (wy * tx - wx * ty);
        [speed.eps[0], speed.eps[1], speed.eps[2], along.re, across.re]
    }
}

/// Sums over the wake nodes under way.
struct Speeds {
    slopes: Slopes<5>,
    velocity: Vec<[f64; 2]>,
    by_node: Vec<[f64; 2]>,
}

impl Speeds {
    /// Adds one panel, number `j` of `table`. Node 0 of the wake takes the speed of the edge, whatever the geometry.
    fn add(
        &mut self,
        nodes: &Points,
        (table, j): (&mut Table, usize),
        quantity: &WakeSpeed,
        special: &[usize],
        place: impl Fn(usize) -> Place,
    ) {
        let panel = quantity.panel;
        self.slopes.fill(nodes, panel, quantity, special, place);
        self.slopes.0[0] = [0.0; 5];
        table.enter(j, panel, nodes, &self.slopes);
        let turned = self.slopes.0.iter().zip(quantity.tangents);
        table.enter_turn(j, turned.map(|([_, _, _, t, n], [x, y])| [t * x + n * y, t * y - n * x]));
        self.slopes.add_outer(panel, &mut self.by_node);
        for (sum, [_, _, _, along, across]) in self.velocity.iter_mut().zip(&self.slopes.0) {
            let [x, y] = panel.outer([*along, *across]);
            sum[0] += x;
            sum[1] += y;
        }
    }
}

/// Speeds along the wake: positions of panels and wake nodes, tangents, onset flow.
fn add_speeds(reverse: &Reverse, points: &[[f64; 2]], by_points: &mut Each<Vec<[f64; 2]>>, collected: &mut Collected) {
    let (outline, flow) = (&reverse.section.panels.outline, reverse.flow);
    let (n, w) = (outline.len(), flow.wake_nodes.len());
    let (strengths, smoothed, _) = solution_strengths(reverse);
    let sources = half_panel_strengths(reverse);
    let (sin, cos) = flow.alpha.sin_cos();
    let nodes = Points::new(&flow.wake_nodes, |output, k| if k == 0 { 0.0 } else { reverse.wake_weights[output][k] });
    let tangents = &flow.wake_tangents[..];
    let mut speeds = Speeds { slopes: Slopes::zeros(w), velocity: vec![[cos, sin]; w], by_node: vec![[0.0; 2]; w] };
    let mut table = Table::new(w, n - 1);
    for j in 0..n - 1 {
        let speed = WakeSpeed {
            pairs: flow.from_surface.pairs_of([j, j + 1]),
            panel: &Straight::new(outline.panel(j)),
            tangents,
            vortex: [strengths[j], strengths[j + 1]],
            source: [0.0; 2],
            jump: smoothed[j] - smoothed[j + 1],
        };
        speeds.add(&nodes, (&mut table, j), &speed, &[], |_| Place::Elsewhere);
    }
    scatter_ends(&table.sums(&nodes), &outline.nodes, &mut collected.nodes);
    let among = Polar::new(&flow.wake_nodes, points);
    let mut table = Table::new(w, points.len() - 1);
    for h in 0..points.len() - 1 {
        let speed = WakeSpeed {
            pairs: among.pairs_of([h, h + 1]),
            panel: &Straight::new([points[h], points[h + 1]]),
            tangents,
            vortex: [0.0; 2],
            source: [sources[h], sources[h + 1]],
            jump: 0.0,
        };
        let at_end = [h / 2, h.div_ceil(2)];
        speeds.add(&nodes, (&mut table, h), &speed, &at_end, |k| wake_place(k, h));
    }
    scatter_ends(&table.sums(&nodes), points, by_points);
    if outline.trailing_edge == TrailingEdge::Blunt {
        add_closing(reverse, 0.5 * (strengths[0] - strengths[n - 1]), &mut speeds, collected);
    }
    for k in 1..w {
        let tangent = tangents[k];
        for output in 0..OUTPUTS {
            collected.alpha[output] += nodes.weights[k][output] * (cos * tangent[1] - sin * tangent[0]);
            for c in 0..2 {
                by_points[output][2 * k][c] += nodes.weights[k][output] * speeds.by_node[k][c];
            }
        }
        add_tangent(reverse, k, speeds.velocity[k], nodes.weights[k], by_points);
    }
}

/// The closing panel of a blunt edge, which moves with the nodes of the edge.
fn add_closing(reverse: &Reverse, edge_speed: f64, speeds: &mut Speeds, collected: &mut Collected) {
    let outline = &reverse.section.panels.outline;
    let n = outline.len();
    let closing = closing_strengths(reverse);
    let panel = outline.panel(n - 1);
    for k in 1..speeds.velocity.len() {
        let tangent = reverse.flow.wake_tangents[k];
        let along = |v: [Dual4; 2]| v[0] * tangent[0] + v[1] * tangent[1];
        let v = velocity_influence(seen_from(reverse.flow.wake_nodes[k], panel), origin(), Place::Elsewhere);
        let by_vortex = [0, 1].map(|c| v.vortex[0][c] + v.vortex[1][c]);
        let by_source = [0, 1].map(|c| v.source[0][c] + v.source[1][c]);
        let total = [0, 1].map(|c| (by_vortex[c] * closing[0].re + by_source[c] * closing[1].re) * edge_speed);
        let g = gradient(&along(total));
        for c in 0..2 {
            speeds.velocity[k][c] += total[c].re;
            speeds.by_node[k][c] -= g[c] + g[2 + c];
        }
        for output in 0..OUTPUTS {
            let weight = reverse.wake_weights[output][k];
            let nodes = &mut collected.nodes[output];
            for c in 0..2 {
                nodes[n - 1][c] += weight * g[c];
                nodes[0][c] += weight * g[2 + c];
            }
            let w = weight * edge_speed;
            scatter_edge(gradient(&closing[0]), w * along(by_vortex).re, nodes);
            scatter_edge(gradient(&closing[1]), w * along(by_source).re, nodes);
        }
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
