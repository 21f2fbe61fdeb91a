//! Reverse sweep through the velocities that panels induce at points, taken in one direction per point.

use super::influence::{closing_strengths, origin, scatter_edge, seen_from};
use super::reverse::{Collected, Lanes, Reverse, Strengths};
use super::sums::{PanelSums, Points, Quantity, Slopes, Vectors, panel_sums, scatter_ends};
use crate::flow::coefficients::Coefficients;
use crate::flow::duals::{Dual3, Dual4, gradient};
use crate::flow::panel::coupling::response::wake_place;
use crate::flow::panel::kernel::{Place, velocity_influence};
use crate::flow::panel::outline::TrailingEdge;
use crate::flow::panel::polar::{Pairs, Polar, Straight};
use num_dual::DualNum;
use std::ops::Range;

/// Velocity of a panel with linear vortex and source strengths in the direction of every point. The numbers per point
/// are the slopes and the velocity along and across the panel.
#[derive(Clone, Copy)]
struct PanelVelocity<'a> {
    pairs: Pairs<'a>,
    panel: &'a Straight,
    /// Directions at the points, the two coordinates in separate lists.
    directions: [&'a [f64]; 2],
    /// Vortex strengths at the two ends.
    vortex: [f64; 2],
    /// Source strengths at the two ends.
    source: [f64; 2],
    /// A constant source strength times the length of the panel.
    jump: f64,
}

impl Quantity<5> for PanelVelocity<'_> {
    #[inline(always)]
    fn of(&self, points: Range<usize>) -> Self {
        let directions = self.directions.map(|v| &v[points.clone()]);
        Self { pairs: self.pairs.of(points), directions, ..*self }
    }

    #[inline(always)]
    fn at(&self, i: usize, at: [Dual3; 2], length: Dual3, place: Place) -> [[f64; 5]; 1] {
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
        let [wx, wy] = self.directions.map(|v| v[i]);
        let [tx, ty] = self.panel.tangent;
        let speed = along * (wx * tx + wy * ty) + across * (wy * tx - wx * ty);
        [[speed.eps[0], speed.eps[1], speed.eps[2], along.re, across.re]]
    }

    #[inline(always)]
    fn beyond(&self, i: usize, [_, _, _, along, across]: &[f64; 5]) -> [f64; 2] {
        let [x, y] = self.directions.map(|v| v[i]);
        [along * x + across * y, along * y - across * x]
    }
}

/// Points at which velocities are evaluated.
#[derive(Clone, Copy)]
pub(super) struct Observers<'a> {
    pub points: &'a Points,
    /// Directions in which the velocities are taken, the two coordinates in separate lists.
    pub directions: [&'a [f64]; 2],
}

/// The half panels of the wake.
#[derive(Clone, Copy)]
pub(super) struct HalfPanels<'a> {
    /// Ends of the half panels.
    pub ends: &'a [[f64; 2]],
    /// Distances and directions from the ends to the points.
    pub polar: &'a Polar,
    /// Number of the point that is node 1 of the wake. The following points are the following nodes of the wake, which
    /// stand on its panels.
    pub first_of_wake: usize,
}

/// Sums over the panels, under way.
pub(super) struct Velocities {
    slopes: Slopes<5>,
    /// Velocity at every point.
    pub velocity: Vectors,
    /// Derivatives, with respect to every point, of the velocity in the direction of that point.
    pub by_point: Vectors,
}

impl Velocities {
    /// Sums that contain the onset flow alone.
    pub fn new(onset: [f64; 2], points: usize) -> Self {
        let (velocity, by_point) = (Vectors::new(onset, points), Vectors::new([0.0; 2], points));
        Self { slopes: Slopes::zeros(points), velocity, by_point }
    }

    /// Adds the panels of the section with the given strengths, the closing panel among them. `polar` has the distances
    /// and directions from the nodes to the points. The derivatives go to the nodes in `collected`.
    pub fn add_section(
        &mut self,
        reverse: &Reverse,
        sheets: &Strengths,
        Observers { points, directions }: Observers,
        polar: &Polar,
        collected: &mut Collected,
    ) {
        let outline = &reverse.section.panels.outline;
        let n = outline.len();
        let Strengths { nodes: strengths, smoothed, .. } = sheets;
        let mut sums = Vec::with_capacity(n);
        for j in 0..n - 1 {
            let velocity = PanelVelocity {
                pairs: polar.pairs_of([j, j + 1]),
                panel: &Straight::new(outline.panel(j)),
                directions,
                vortex: [strengths[j], strengths[j + 1]],
                source: [0.0; 2],
                jump: smoothed[j] - smoothed[j + 1],
            };
            sums.push(self.add(points, &velocity, [], |_| Place::Elsewhere));
        }
        scatter_ends(&sums, &outline.nodes, &mut collected.nodes);
        if outline.trailing_edge == TrailingEdge::Blunt {
            let edge_speed = 0.5 * (strengths[0] - strengths[n - 1]);
            self.add_closing(reverse, edge_speed, points, directions, collected);
        }
    }

    /// Adds the half panels of the wake. The derivatives go to their ends in `by_ends`.
    pub fn add_wake(
        &mut self,
        reverse: &Reverse,
        Observers { points, directions }: Observers,
        HalfPanels { ends, polar, first_of_wake }: HalfPanels,
        by_ends: &mut Coefficients<Vec<[f64; 2]>>,
    ) {
        let sources = &reverse.at_solution.wake;
        let mut sums = Vec::with_capacity(ends.len());
        for h in 0..ends.len() - 1 {
            let velocity = PanelVelocity {
                pairs: polar.pairs_of([h, h + 1]),
                panel: &Straight::new([ends[h], ends[h + 1]]),
                directions,
                vortex: [0.0; 2],
                source: [sources[h], sources[h + 1]],
                jump: 0.0,
            };
            // the node of the wake that this half panel ends or starts at
            let own = Some(h.div_ceil(2)).filter(|k| *k > 0).map(|k| first_of_wake + k - 1);
            sums.push(self.add(points, &velocity, own, |i| wake_place(i + 1 - first_of_wake, h)));
        }
        scatter_ends(&sums, ends, by_ends);
    }

    /// Adds one panel and returns its sums over the points.
    fn add(
        &mut self,
        points: &Points,
        quantity: &PanelVelocity,
        special: impl IntoIterator<Item = usize>,
        place: impl Fn(usize) -> Place,
    ) -> PanelSums {
        let panel = quantity.panel;
        self.slopes.fill(points, panel, quantity, special, place);
        self.slopes.add_outer(0, panel, &mut self.by_point);
        self.slopes.add_vectors(0, [3, 4], panel, &mut self.velocity);
        panel_sums(points, &self.slopes, 0)
    }

    /// Adds the closing panel of a blunt edge, which moves with the nodes of the edge.
    fn add_closing(
        &mut self,
        reverse: &Reverse,
        edge_speed: f64,
        points: &Points,
        directions: [&[f64]; 2],
        collected: &mut Collected,
    ) {
        let outline = &reverse.section.panels.outline;
        let n = outline.len();
        let closing = closing_strengths(reverse);
        let panel = outline.panel(n - 1);
        // velocity per strength of vortices and sources, weighted
        let mut sums = [Lanes::zeros(); 2];
        for k in 0..points.x.len() {
            let along = |v: [Dual4; 2]| v[0] * directions[0][k] + v[1] * directions[1][k];
            let v = velocity_influence(seen_from(points.at(k), panel), origin(), Place::Elsewhere);
            let by_vortex = [0, 1].map(|c| v.vortex[0][c] + v.vortex[1][c]);
            let by_source = [0, 1].map(|c| v.source[0][c] + v.source[1][c]);
            let total = [0, 1].map(|c| (by_vortex[c] * closing[0].re + by_source[c] * closing[1].re) * edge_speed);
            let g = gradient(&along(total));
            self.velocity.add(k, total.map(|v| v.re));
            self.by_point.add(k, [-g[0] - g[2], -g[1] - g[3]]);
            let weights = &points.weights[k];
            for (nodes, weight) in collected.nodes.iter_mut().zip(weights) {
                for c in 0..2 {
                    nodes[n - 1][c] += weight * g[c];
                    nodes[0][c] += weight * g[2 + c];
                }
            }
            sums[0] += weights * along(by_vortex).re;
            sums[1] += weights * along(by_source).re;
        }
        for (strength, sum) in closing.iter().zip(sums) {
            scatter_edge(gradient(strength), &(sum * edge_speed), &mut collected.nodes);
        }
    }
}
