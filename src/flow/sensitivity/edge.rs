//! Reverse sweep through the equation of the trailing edge: every panel and the few points of the cut.

use super::influence::scatter_edge;
use super::sums::Points;
use super::velocity::{Observers, Velocities};
use super::{Collected, Each, OUTPUTS, Reverse};
use crate::flow::coupled::duals::{Dual8, gradient};
use crate::flow::panel::edge::Cut;

/// The cut as a function of nodes 0, 1, N − 2, N − 1 (two directions each).
fn cut_dual(nodes: &[[f64; 2]]) -> Cut<Dual8> {
    let n = nodes.len();
    let at = |i: usize, k: usize| [0, 1].map(|c| Dual8::from_re(nodes[i][c]).derivative(2 * k + c));
    Cut::new([at(0, 0), at(1, 1)], [at(n - 2, 2), at(n - 1, 3)])
}

/// The points and the direction of the cut move with the four nodes at the edge.
fn add_cut(reverse: &Reverse, weights: &[f64; OUTPUTS], sums: &Velocities, collected: &mut Collected) {
    let cut = cut_dual(&reverse.section.panels.outline.nodes);
    let mut total = [0.0; 8];
    for (p, (point, weight)) in cut.points.iter().enumerate() {
        for c in 0..2 {
            let (moved, turned) = (gradient(&point[c]), gradient(&cut.direction[c]));
            for k in 0..8 {
                total[k] += weight * (sums.by_point[p][c] * moved[k] + sums.velocity[p][c] * turned[k]);
            }
        }
    }
    for output in 0..OUTPUTS {
        scatter_edge(total, weights[output], &mut collected.nodes[output]);
    }
}

/// Velocity through the cut: onset flow, panels of the surface, the closing panel and the wake's sources. Adds to the
/// nodes and, `by_ends`, to the `ends` of the wake's half panels.
pub(super) fn add_edge(
    reverse: &Reverse,
    weights: &[f64; OUTPUTS],
    ends: &[[f64; 2]],
    by_ends: &mut Each<Vec<[f64; 2]>>,
    collected: &mut Collected,
) {
    let (sin, cos) = reverse.flow.alpha.sin_cos();
    let edge = &reverse.section.panels.edge;
    for output in 0..OUTPUTS {
        collected.alpha[output] += weights[output] * edge.cut.through([-sin, cos]);
    }
    let points = Points::new(&edge.cut.points.map(|p| p.0), |output, p| weights[output] * edge.cut.points[p].1);
    let count = edge.cut.points.len();
    let directions = vec![edge.cut.direction; count];
    let mut sums = Velocities::new([cos, sin], count, 0);
    let observers = Observers {
        points: &points,
        directions: &directions,
        from_surface: &edge.polar,
        from_wake: &reverse.flow.edge_polar,
        of_wake: false,
    };
    sums.add_panels(reverse, &observers, ends, by_ends, collected);
    add_cut(reverse, weights, &sums, collected);
}
