//! Reverse sweep through the equation of the trailing edge: the cut, whose few points move with the edge.

use super::influence::scatter_edge;
use super::reverse::{Collected, Lanes, Reverse};
use super::sums::Vectors;
use crate::flow::duals::{Dual8, gradient};
use crate::flow::panel::edge::Cut;

/// The cut as a function of the nodes 0, 1, N − 2 and N − 1, with two directions per node.
fn cut_dual(nodes: &[[f64; 2]]) -> Cut<Dual8> {
    let n = nodes.len();
    let at = |i: usize, k: usize| [0, 1].map(|c| Dual8::from_re(nodes[i][c]).derivative(2 * k + c));
    Cut::new([at(0, 0), at(1, 1)], [at(n - 2, 2), at(n - 1, 3)])
}

/// Adds the onset flow through the cut, and the motion of the points and of the direction of the cut with the four
/// nodes at the edge. `velocity` is the velocity at the points, the points of the cut first; `by_point` are the
/// derivatives of the component through the cut with respect to the points.
pub(super) fn add_cut(
    reverse: &Reverse,
    weights: &Lanes,
    velocity: &Vectors,
    by_point: &Vectors,
    collected: &mut Collected,
) {
    let cut = cut_dual(&reverse.section.panels.outline.nodes);
    let mut total = [0.0; 8];
    for (p, (point, weight)) in cut.points.iter().enumerate() {
        let (velocity, by_point) = (velocity.at(p), by_point.at(p));
        for c in 0..2 {
            let (moved, turned) = (gradient(&point[c]), gradient(&cut.direction[c]));
            for k in 0..8 {
                total[k] += weight * (by_point[c] * moved[k] + velocity[c] * turned[k]);
            }
        }
    }
    let (sin, cos) = reverse.flow.alpha.sin_cos();
    let by_alpha = reverse.section.panels.edge.cut.through([-sin, cos]);
    collected.alpha += weights * by_alpha;
    scatter_edge(total, weights, &mut collected.nodes);
}
