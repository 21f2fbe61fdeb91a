//! Reverse sweep through the path of the wake, which follows the flow without boundary layer.
//!
//! The strengths of that flow have multipliers of their own, from the same factors as those of the strengths of the
//! solution.

use super::edge::add_cut;
use super::influence::{PanelWeights, edge_frame_dual, panel_weights, scatter_edge};
use super::reverse::{Collected, Lanes, Reverse, Strengths, lanes};
use super::sums::Points;
use super::velocity::{Observers, Velocities};
use crate::flow::coefficients::{COEFFICIENTS, Coefficients};
use crate::flow::duals::{Dual2, Dual8, gradient};
use crate::flow::linear::product;
use crate::flow::panel::streamline;
use nalgebra::DMatrix;
use num_dual::DualNum;

/// Adds the effect of the path for given sensitivities to the nodes of the wake, but for the panel equations of the flow
/// that the path follows. The result holds the sheets of that flow and the multipliers of the panel equations for them.
pub(super) fn add_path(
    reverse: &Reverse,
    by_nodes: &Coefficients<Vec<[f64; 2]>>,
    collected: &mut Collected,
) -> (Strengths, PanelWeights) {
    add_start(reverse, by_nodes, collected);
    let across = Across::new(reverse, by_nodes);
    let weights = panel_weights(reverse.section, &across.by_strength(reverse));
    let sheets = Strengths::inviscid(reverse.flow);
    add_velocities(reverse, &across, &weights, &sheets, collected);
    (sheets, weights)
}

/// Adds how the path moves and turns with the trailing edge that it leaves, for the velocities held.
fn add_start(reverse: &Reverse, by_nodes: &Coefficients<Vec<[f64; 2]>>, collected: &mut Collected) {
    let velocity: Vec<[Dual8; 2]> = reverse.flow.path.velocity.iter().map(|v| v.map(Dual8::from_re)).collect();
    let frame = edge_frame_dual(&reverse.section.panels.outline.nodes);
    let path = streamline::nodes(&frame, &velocity, &reverse.section.wake_distances);
    for (k, node) in path.iter().enumerate() {
        for c in 0..2 {
            scatter_edge(gradient(&node[c]), &lanes(by_nodes, |nodes| nodes[k][c]), &mut collected.nodes);
        }
    }
}

/// Components of the velocities that turn the panels of the wake: those across the panels from number 1 on.
struct Across {
    /// Unit vectors across the panels, to the left.
    directions: Vec<[f64; 2]>,
    /// Sensitivities to the components.
    weights: Vec<Lanes>,
}

impl Across {
    fn new(reverse: &Reverse, by_nodes: &Coefficients<Vec<[f64; 2]>>) -> Self {
        let (path, distances) = (&reverse.flow.path, &reverse.section.wake_distances);
        let count = path.velocity.len();
        let (mut directions, mut weights) = (vec![[0.0; 2]; count], vec![Lanes::zeros(); count]);
        // a panel moves all nodes behind it
        let mut behind = [Lanes::zeros(); 2];
        for k in (0..count).rev() {
            for c in 0..2 {
                behind[c] += lanes(by_nodes, |nodes| nodes[k + 2][c]);
            }
            let step = distances[k + 2] - distances[k + 1];
            let [vx, vy] = path.velocity[k];
            let speed = vx.hypot(vy);
            directions[k] = [-vy / speed, vx / speed];
            let change = Dual2::from_re(0.0).derivative(0);
            let moving = [0, 1].map(|c| change * directions[k][c] + path.velocity[k][c]);
            let turned = streamline::direction(moving);
            weights[k] = (behind[0] * turned[0].eps[0] + behind[1] * turned[1].eps[0]) * step;
        }
        Self { directions, weights }
    }

    /// Sensitivities to the strengths at the nodes of the section.
    fn by_strength(&self, reverse: &Reverse) -> Coefficients<Vec<f64>> {
        // one row per coefficient, one column per panel
        let weights = |axis: usize| {
            DMatrix::from_fn(COEFFICIENTS, self.weights.len(), |o, k| self.weights[k][o] * self.directions[k][axis])
        };
        let [along_x, along_y] = &reverse.flow.path.by_strength;
        let sums = product(&weights(0), along_x) + product(&weights(1), along_y);
        Coefficients::from_array(std::array::from_fn(|o| sums.row(o).iter().copied().collect()))
    }
}

/// Adds the velocities across the panels of the wake and those through the cut at the trailing edge, for the strengths
/// of the flow without boundary layer held.
fn add_velocities(
    reverse: &Reverse,
    across: &Across,
    weights: &PanelWeights,
    sheets: &Strengths,
    collected: &mut Collected,
) {
    let (edge, path) = (&reverse.section.panels.edge, &reverse.flow.path);
    let cut = &edge.cut;
    let first = cut.points.len();
    let places: Vec<[f64; 2]> = cut.points.iter().map(|p| p.0).chain(path.places.iter().copied()).collect();
    let directions: (Vec<f64>, Vec<f64>) =
        std::iter::repeat_n(cut.direction, first).chain(across.directions.iter().copied()).map(|[x, y]| (x, y)).unzip();
    let points = Points::new(&places, |i| match cut.points.get(i) {
        Some((_, weight)) => weights.edge * *weight,
        None => across.weights[i - first],
    });
    let (sin, cos) = reverse.flow.alpha.sin_cos();
    let mut sums = Velocities::new([cos, sin], places.len());
    let observers = Observers { points: &points, directions: [&directions.0, &directions.1] };
    sums.add_section(reverse, sheets, observers, &edge.polar.followed_by(&path.from_surface, 0), collected);
    add_cut(reverse, &weights.edge, &sums.velocity, &sums.by_point, collected);
    for ([nx, ny], weights) in across.directions.iter().zip(&across.weights) {
        collected.alpha += weights * (cos * ny - sin * nx);
    }
    let by_place: Vec<[f64; 2]> = (first..places.len()).map(|i| sums.by_point.at(i)).collect();
    add_places(reverse, across, &by_place, collected);
}

/// Adds how the places at which the velocities are taken follow the trailing edge and the incidence. `by_place` are the
/// derivatives of the components across with respect to these places.
fn add_places(reverse: &Reverse, across: &Across, by_place: &[[f64; 2]], collected: &mut Collected) {
    let distances = &reverse.section.wake_distances;
    let alpha = reverse.flow.alpha;
    let fixed = [alpha.cos(), alpha.sin()].map(Dual8::from_re);
    let places = streamline::places(&edge_frame_dual(&reverse.section.panels.outline.nodes), fixed, distances);
    let (sin, cos) = Dual2::from_re(alpha).derivative(0).sin_cos();
    let turning = streamline::places(&reverse.section.edge_frame().map(Dual2::from_re), [cos, sin], distances);
    for (k, weights) in across.weights.iter().enumerate() {
        let [x, y] = by_place[k];
        scatter_edge(gradient(&(places[k][0] * x + places[k][1] * y)), weights, &mut collected.nodes);
        collected.alpha += weights * (turning[k][0] * x + turning[k][1] * y).eps[0];
    }
}

#[cfg(test)]
pub(super) mod tests;
