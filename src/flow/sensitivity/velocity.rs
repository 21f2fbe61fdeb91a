//! Reverse sweep through the velocities that panels bring about at points, taken in a direction at each point.

use super::influence::{closing_strengths, origin, scatter_edge, seen_from};
use super::sums::{Dual3, Points, Quantity, Slopes, Table};
use super::{Collected, OUTPUTS, Reverse};
use crate::flow::coupled::duals::{Dual4, gradient};
use crate::flow::panel::kernel::{Place, velocity_influence};
use crate::flow::panel::polar::{Pairs, Straight};
use num_dual::DualNum;

/// Velocity of a panel with linear vortex and source strengths in the direction of every point: its slopes, and the
/// velocity along and across the panel.
#[derive(Clone, Copy)]
pub(super) struct PanelVelocity<'a> {
    pub pairs: Pairs<'a>,
    pub panel: &'a Straight,
    /// Directions at the points.
    pub directions: &'a [[f64; 2]],
    /// Vortex strengths at the two ends.
    pub vortex: [f64; 2],
    /// Source strengths at the two ends, and a constant one over the length of the panel.
    pub source: [f64; 2],
    pub jump: f64,
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

/// Sums over the points under way.
pub(super) struct Velocities {
    slopes: Slopes<5>,
    /// Velocity at every point.
    pub velocity: Vec<[f64; 2]>,
    /// Derivatives of the velocity in the direction of a point with respect to the point.
    pub by_point: Vec<[f64; 2]>,
    /// First points that take no part.
    idle: usize,
}

impl Velocities {
    /// In an onset flow; the first `idle` points take no part.
    pub fn new(onset: [f64; 2], points: usize, idle: usize) -> Self {
        Self { slopes: Slopes::zeros(points), velocity: vec![onset; points], by_point: vec![[0.0; 2]; points], idle }
    }

    /// Adds one panel, the next of `table`.
    pub fn add(
        &mut self,
        points: &Points,
        table: &mut Table,
        quantity: &PanelVelocity,
        special: &[usize],
        place: impl Fn(usize) -> Place,
    ) {
        let panel = quantity.panel;
        self.slopes.fill(points, panel, quantity, special, place);
        self.slopes.0[..self.idle].fill([0.0; 5]);
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
    pub fn add_closing(
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
        for k in self.idle..self.velocity.len() {
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
