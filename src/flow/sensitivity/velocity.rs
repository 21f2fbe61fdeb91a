//! Reverse sweep through the velocities that panels bring about at points, taken in a direction at each point.

use super::influence::{closing_strengths, origin, scatter_edge, seen_from};
use super::sums::{Points, Quantity, Slopes, Table, scatter_ends};
use super::{Collected, Each, OUTPUTS, Reverse, Strengths};
use crate::flow::coupled::duals::{Dual3, Dual4, gradient};
use crate::flow::coupled::response::wake_place;
use crate::flow::panel::kernel::{Place, velocity_influence};
use crate::flow::panel::outline::TrailingEdge;
use crate::flow::panel::polar::{Pairs, Polar, Straight};
use num_dual::DualNum;

/// Velocity of a panel with linear vortex and source strengths in the direction of every point: its slopes, and the
/// velocity along and across the panel.
#[derive(Clone, Copy)]
struct PanelVelocity<'a> {
    pairs: Pairs<'a>,
    panel: &'a Straight,
    /// Directions at the points.
    directions: &'a [[f64; 2]],
    /// Vortex strengths at the two ends.
    vortex: [f64; 2],
    /// Source strengths at the two ends, and a constant one over the length of the panel.
    source: [f64; 2],
    jump: f64,
}

impl Quantity<5> for PanelVelocity<'_> {
    fn first(&self, points: usize) -> Self {
        Self { pairs: self.pairs.first(points), directions: &self.directions[..points], ..*self }
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
        let [wx, wy] = self.directions[i];
        let [tx, ty] = self.panel.tangent;
        let speed = along * (wx * tx + wy * ty) + across * (wy * tx - wx * ty);
        [speed.eps[0], speed.eps[1], speed.eps[2], along.re, across.re]
    }
}

/// Points at which velocities are wanted.
#[derive(Clone, Copy)]
pub(super) struct Observers<'a> {
    pub points: &'a Points,
    /// Directions in which the velocities are taken.
    pub directions: &'a [[f64; 2]],
    /// Distances and directions from the nodes of the section, and from the ends of the wake's half panels.
    pub from_surface: &'a Polar,
    pub from_wake: &'a Polar,
    /// Number of the point that is node 1 of the wake; the next ones are the next nodes, which stand on its panels.
    pub first_of_wake: usize,
}

/// Sums over the points under way.
pub(super) struct Velocities {
    slopes: Slopes<5>,
    /// Velocity at every point.
    pub velocity: Vec<[f64; 2]>,
    /// Derivatives of the velocity in the direction of a point with respect to the point.
    pub by_point: Vec<[f64; 2]>,
}

impl Velocities {
    /// In an onset flow.
    pub fn new(onset: [f64; 2], points: usize) -> Self {
        Self { slopes: Slopes::zeros(points), velocity: vec![onset; points], by_point: vec![[0.0; 2]; points] }
    }

    /// Adds all panels: those of the surface, the half panels of the wake between `ends`, and the closing panel. The
    /// derivatives go to the nodes and, `by_ends`, to the ends.
    pub fn add_panels(
        &mut self,
        reverse: &Reverse,
        observers: &Observers,
        ends: &[[f64; 2]],
        by_ends: &mut Each<Vec<[f64; 2]>>,
        collected: &mut Collected,
    ) {
        let outline = &reverse.section.panels.outline;
        let (n, count) = (outline.len(), self.velocity.len());
        let Strengths { nodes: strengths, smoothed, wake: sources } = &reverse.at_solution;
        let Observers { points, directions, from_surface, from_wake, first_of_wake } = *observers;
        let mut table = Table::new(count);
        for j in 0..n - 1 {
            let velocity = PanelVelocity {
                pairs: from_surface.pairs_of([j, j + 1]),
                panel: &Straight::new(outline.panel(j)),
                directions,
                vortex: [strengths[j], strengths[j + 1]],
                source: [0.0; 2],
                jump: smoothed[j] - smoothed[j + 1],
            };
            self.add(points, &mut table, &velocity, [], |_| Place::Elsewhere);
        }
        scatter_ends(&table.sums(), &outline.nodes, &mut collected.nodes);
        let mut table = Table::new(count);
        for h in 0..ends.len() - 1 {
            let velocity = PanelVelocity {
                pairs: from_wake.pairs_of([h, h + 1]),
                panel: &Straight::new([ends[h], ends[h + 1]]),
                directions,
                vortex: [0.0; 2],
                source: [sources[h], sources[h + 1]],
                jump: 0.0,
            };
            // the node of the wake that this half panel ends or starts at
            let own = Some(h.div_ceil(2)).filter(|k| *k > 0).map(|k| first_of_wake + k - 1);
            self.add(points, &mut table, &velocity, own, |i| wake_place(i + 1 - first_of_wake, h));
        }
        scatter_ends(&table.sums(), ends, by_ends);
        if outline.trailing_edge == TrailingEdge::Blunt {
            let edge_speed = 0.5 * (strengths[0] - strengths[n - 1]);
            self.add_closing(reverse, edge_speed, points, directions, collected);
        }
    }

    /// Adds one panel, the next of `table`.
    fn add(
        &mut self,
        points: &Points,
        table: &mut Table,
        quantity: &PanelVelocity,
        special: impl IntoIterator<Item = usize>,
        place: impl Fn(usize) -> Place,
    ) {
        let panel = quantity.panel;
        self.slopes.fill(points, panel, quantity, special, place);
        let slopes = &self.slopes.0;
        table.enter(panel, points, &self.slopes, |i| {
            let ([_, _, _, along, across], [x, y]) = (slopes[i], quantity.directions[i]);
            [along * x + across * y, along * y - across * x]
        });
        self.slopes.add_outer(panel, &mut self.by_point);
        for (sum, [_, _, _, along, across]) in self.velocity.iter_mut().zip(&self.slopes.0) {
            let [x, y] = panel.outer([*along, *across]);
            sum[0] += x;
            sum[1] += y;
        }
    }

    /// Adds the closing panel of a blunt edge, which moves with the nodes of the edge.
    fn add_closing(
        &mut self,
        reverse: &Reverse,
        edge_speed: f64,
        points: &Points,
        directions: &[[f64; 2]],
        collected: &mut Collected,
    ) {
        let outline = &reverse.section.panels.outline;
        let n = outline.len();
        let closing = closing_strengths(reverse);
        let panel = outline.panel(n - 1);
        // velocity per strength of vortices and sources, weighted
        let mut sums = [[0.0; 2]; OUTPUTS];
        for k in 0..self.velocity.len() {
            let along = |v: [Dual4; 2]| v[0] * directions[k][0] + v[1] * directions[k][1];
            let v = velocity_influence(seen_from(points.at(k), panel), origin(), Place::Elsewhere);
            let by_vortex = [0, 1].map(|c| v.vortex[0][c] + v.vortex[1][c]);
            let by_source = [0, 1].map(|c| v.source[0][c] + v.source[1][c]);
            let total = [0, 1].map(|c| (by_vortex[c] * closing[0].re + by_source[c] * closing[1].re) * edge_speed);
            let g = gradient(&along(total));
            for c in 0..2 {
                self.velocity[k][c] += total[c].re;
                self.by_point[k][c] -= g[c] + g[2 + c];
            }
            for output in 0..OUTPUTS {
                let weight = points.weights[k][output];
                let nodes = &mut collected.nodes[output];
                for c in 0..2 {
                    nodes[n - 1][c] += weight * g[c];
                    nodes[0][c] += weight * g[2 + c];
                }
                sums[output][0] += weight * along(by_vortex).re;
                sums[output][1] += weight * along(by_source).re;
            }
        }
        for (output, [by_vortex, by_source]) in sums.into_iter().enumerate() {
            let nodes = &mut collected.nodes[output];
            scatter_edge(gradient(&closing[0]), by_vortex * edge_speed, nodes);
            scatter_edge(gradient(&closing[1]), by_source * edge_speed, nodes);
        }
    }
}
