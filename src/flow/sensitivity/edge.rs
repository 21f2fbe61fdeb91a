//! Reverse sweep through the equation of the trailing edge: every panel and the few points of the cut.

use super::influence::{closing_strengths, origin, scatter_edge, seen_from};
use super::{Collected, Each, OUTPUTS, Reverse};
use crate::flow::coupled::duals::{Dual4, Dual8, gradient};
use crate::flow::panel::edge::Cut;
use crate::flow::panel::kernel::{Place, VelocityInfluence, velocity_influence};
use crate::flow::panel::outline::TrailingEdge;

/// One point of the cut: what the velocity there and its sensitivities add up to.
struct AtPoint {
    point: [f64; 2],
    weight: f64,
    direction: [f64; 2],
    /// Velocity at the point.
    velocity: [f64; 2],
    /// Derivative of the velocity through the cut with respect to the point.
    by_point: [f64; 2],
}

impl AtPoint {
    fn all(cut: &Cut<f64>) -> impl Iterator<Item = Self> {
        let direction = cut.direction;
        cut.points.into_iter().map(move |(point, weight)| Self {
            point,
            weight,
            direction,
            velocity: [0.0; 2],
            by_point: [0.0; 2],
        })
    }

    /// Adds the velocity `of` a panel; returns the weighted derivatives through the cut by its two ends.
    fn add(&mut self, panel: [[f64; 2]; 2], of: impl Fn(VelocityInfluence<Dual4>, Dual4) -> [Dual4; 2]) -> [f64; 4] {
        let seen = seen_from(self.point, panel);
        let (dx, dy) = (seen[1][0] - seen[0][0], seen[1][1] - seen[0][1]);
        let length = num_dual::DualNum::sqrt(&(dx * dx + dy * dy));
        let velocity = of(velocity_influence(seen, origin(), Place::Elsewhere), length);
        let g = gradient(&(velocity[0] * self.direction[0] + velocity[1] * self.direction[1]));
        for c in 0..2 {
            self.velocity[c] += velocity[c].re;
            self.by_point[c] -= g[c] + g[2 + c];
        }
        g.map(|g| self.weight * g)
    }
}

/// Adds the derivatives by the two ends of a panel.
fn add_ends(g: [f64; 4], weight: f64, [a, b]: [&mut [f64; 2]; 2]) {
    for c in 0..2 {
        a[c] += weight * g[c];
        b[c] += weight * g[2 + c];
    }
}

/// The cut as a function of nodes 0, 1, N − 2, N − 1 (two directions each).
fn cut_dual(nodes: &[[f64; 2]]) -> Cut<Dual8> {
    let n = nodes.len();
    let at = |i: usize, k: usize| [0, 1].map(|c| Dual8::from_re(nodes[i][c]).derivative(2 * k + c));
    Cut::new([at(0, 0), at(1, 1)], [at(n - 2, 2), at(n - 1, 3)])
}

/// The points and the direction of the cut move with the four nodes at the edge.
fn add_cut(reverse: &Reverse, weights: &[f64; OUTPUTS], points: &[AtPoint], collected: &mut Collected) {
    let cut = cut_dual(&reverse.section.panels.outline.nodes);
    let mut total = [0.0; 8];
    for (at, (point, _)) in points.iter().zip(&cut.points) {
        for c in 0..2 {
            let (moved, turned) = (gradient(&point[c]), gradient(&cut.direction[c]));
            for k in 0..8 {
                total[k] += at.weight * (at.by_point[c] * moved[k] + at.velocity[c] * turned[k]);
            }
        }
    }
    for output in 0..OUTPUTS {
        scatter_edge(total, weights[output], &mut collected.nodes[output]);
    }
}

/// Onset flow, panels of the surface and the closing panel.
pub(super) fn add_surface_panels(
    reverse: &Reverse,
    weights: &[f64; OUTPUTS],
    strengths: &[f64],
    smoothed: &[f64],
    collected: &mut Collected,
) {
    let outline = &reverse.section.panels.outline;
    let n = outline.len();
    let (sin, cos) = reverse.flow.alpha.sin_cos();
    let cut = &reverse.section.panels.edge.cut;
    let mut points: Vec<AtPoint> = AtPoint::all(cut).collect();
    for output in 0..OUTPUTS {
        collected.alpha[output] += weights[output] * cut.through([-sin, cos]);
    }
    for at in &mut points {
        at.velocity = [cos, sin];
        for j in 0..n - 1 {
            let g = at.add(outline.panel(j), |v, length| {
                let source = num_dual::DualNum::recip(&length) * (smoothed[j] - smoothed[j + 1]);
                [0, 1].map(|c| {
                    v.vortex[0][c] * strengths[j]
                        + v.vortex[1][c] * strengths[j + 1]
                        + (v.source[0][c] + v.source[1][c]) * source
                })
            });
            for output in 0..OUTPUTS {
                let (left, right) = collected.nodes[output].split_at_mut(j + 1);
                add_ends(g, weights[output], [&mut left[j], &mut right[0]]);
            }
        }
    }
    if outline.trailing_edge == TrailingEdge::Blunt {
        add_closing(reverse, weights, strengths, &mut points, collected);
    }
    add_cut(reverse, weights, &points, collected);
}

fn add_closing(
    reverse: &Reverse,
    weights: &[f64; OUTPUTS],
    strengths: &[f64],
    points: &mut [AtPoint],
    collected: &mut Collected,
) {
    let outline = &reverse.section.panels.outline;
    let n = outline.len();
    let speed = 0.5 * (strengths[0] - strengths[n - 1]);
    let [vortex, source] = closing_strengths(reverse);
    let panel = outline.panel(n - 1);
    // mean velocity through the cut per strength
    let mut sums = [0.0; 2];
    for at in points {
        let g = at.add(panel, |v, _| {
            [0, 1].map(|c| {
                (v.vortex[0][c] + v.vortex[1][c]) * (vortex.re * speed)
                    + (v.source[0][c] + v.source[1][c]) * (source.re * speed)
            })
        });
        let v = velocity_influence(panel, at.point, Place::Elsewhere);
        for c in 0..2 {
            sums[0] += at.weight * at.direction[c] * (v.vortex[0][c] + v.vortex[1][c]);
            sums[1] += at.weight * at.direction[c] * (v.source[0][c] + v.source[1][c]);
        }
        for output in 0..OUTPUTS {
            let (left, right) = collected.nodes[output].split_at_mut(n - 1);
            add_ends(g, weights[output], [&mut right[0], &mut left[0]]);
        }
    }
    for output in 0..OUTPUTS {
        let nodes = &mut collected.nodes[output];
        scatter_edge(gradient(&vortex), weights[output] * sums[0] * speed, nodes);
        scatter_edge(gradient(&source), weights[output] * sums[1] * speed, nodes);
    }
}

/// Wake sources; adds to the ends of the wake's half panels too.
pub(super) fn add_wake_panels(
    reverse: &Reverse,
    weights: &[f64; OUTPUTS],
    ends: &[[f64; 2]],
    strengths: &[f64],
    by_ends: &mut Each<Vec<[f64; 2]>>,
    collected: &mut Collected,
) {
    let mut points: Vec<AtPoint> = AtPoint::all(&reverse.section.panels.edge.cut).collect();
    for at in &mut points {
        for h in 0..ends.len() - 1 {
            let g = at.add([ends[h], ends[h + 1]], |v, _| {
                [0, 1].map(|c| v.source[0][c] * strengths[h] + v.source[1][c] * strengths[h + 1])
            });
            for output in 0..OUTPUTS {
                let (left, right) = by_ends[output].split_at_mut(h + 1);
                add_ends(g, weights[output], [&mut left[h], &mut right[0]]);
            }
        }
    }
    add_cut(reverse, weights, &points, collected);
}
