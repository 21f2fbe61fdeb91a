//! Fixtures of the tests of single terms of the reverse sweep: solutions with their multipliers, and the comparison of
//! what a term collects with a forward sweep.

use super::influence::{PanelWeights, add_panels};
use super::reverse::{Collected, Lanes, Reverse, Strengths, lanes};
use crate::flow::coefficients::{COEFFICIENTS, Coefficients};
use crate::flow::panel::coupling::reduced::Reduced;
use crate::flow::panel::coupling::response::{edge_place, wake_place};
use crate::flow::panel::kernel::{Place, VelocityInfluence, stream_influence, velocity_influence, wake_source_stream};
use crate::flow::panel::outline::{Outline, TrailingEdge, TrailingEdgeFrame};
use crate::flow::panel::outputs::direct;
use crate::flow::panel::solved::{Direct, Solved};
use crate::flow::panel::testing::{Direction, Forward, assert_same, cambered_flows, moving, wave};
use num_dual::DualNum;

/// Visits the solutions for a blunt edge and for a sharp one.
pub(super) fn at_solutions(visit: impl Fn(&Solved, &Reverse, &Coefficients<Direct>)) {
    for record in cambered_flows() {
        let solved = record.solved();
        let reduced = Reduced::new(solved.at).unwrap();
        let direct = direct(&solved);
        let reverse = Reverse::new(&solved, &reduced, &direct);
        visit(&solved, &reverse, &direct);
    }
}

/// No derivatives with respect to so many points.
pub(super) fn no_points(count: usize) -> Coefficients<Vec<[f64; 2]>> {
    Coefficients::<()>::default().map(|()| vec![[0.0; 2]; count])
}

impl Collected {
    /// Nothing collected for a section of so many nodes.
    pub fn nothing(nodes: usize) -> Self {
        let none = Lanes::zeros;
        Self { nodes: no_points(nodes), alpha: none(), mach: none(), reynolds: none() }
    }
}

/// Sums of products for every coefficient, and of their magnitudes.
#[derive(Clone, Copy)]
pub(super) struct Sums {
    value: Lanes,
    scale: Lanes,
}

impl Sums {
    pub fn zero() -> Self {
        Self { value: Lanes::zeros(), scale: Lanes::zeros() }
    }

    /// Adds `rate` times numbers of all coefficients.
    pub fn add(&mut self, numbers: &Lanes, rate: f64) {
        self.value += numbers * rate;
        self.scale += (numbers * rate).abs();
    }

    /// Derivatives with respect to points times the rates at which these move.
    pub fn over_points(mut self, by_points: &Coefficients<Vec<[f64; 2]>>, rates: &[[f64; 2]]) -> Self {
        for (i, rate) in rates.iter().enumerate() {
            for c in 0..2 {
                self.add(&lanes(by_points, |by_points| by_points[i][c]), rate[c]);
            }
        }
        self
    }

    /// Numbers that a term collected, times the rates of a direction.
    pub fn over(self, collected: &Collected, direction: &Direction) -> Self {
        let mut sums = self.over_points(&collected.nodes, &direction.nodes);
        sums.add(&collected.alpha, direction.alpha);
        sums.add(&collected.mach, direction.mach);
        sums.add(&collected.reynolds, direction.reynolds);
        sums
    }

    /// Asserts that these are the weighted rates of the quantities of a forward sweep: one weight per quantity and
    /// coefficient.
    #[track_caller]
    pub fn assert_are(&self, what: &str, forward: &[Forward], weight: impl Fn(usize) -> Lanes) {
        let mut expected = Self::zero();
        forward.iter().enumerate().for_each(|(i, quantity)| expected.add(&weight(i), quantity.v1));
        for o in 0..COEFFICIENTS {
            let name = Coefficients::<()>::NAMES[o];
            let scale = self.scale[o].max(expected.scale[o]);
            assert_same(&format!("{what}, {name}"), self.value[o], expected.value[o], scale);
        }
    }
}

/// The frame of the trailing edge of moving nodes.
pub(super) fn edge_frame(nodes: &[[Forward; 2]]) -> TrailingEdgeFrame<Forward> {
    let n = nodes.len();
    TrailingEdgeFrame::new([nodes[0], nodes[1]], [nodes[n - 2], nodes[n - 1]])
}

/// Length of a moving panel.
pub(super) fn length([a, b]: [[Forward; 2]; 2]) -> Forward {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    (dx * dx + dy * dy).sqrt()
}

/// Ends of the half panels of the wake that move without any order, but leave a sharp edge where it is.
pub(super) fn moving_ends(direction: &Direction, ends: &[[f64; 2]]) -> (Vec<[f64; 2]>, Vec<[Forward; 2]>) {
    let mut rates: Vec<[f64; 2]> = (0..ends.len()).map(|h| [wave(7, h), wave(8, h)]).collect();
    rates[0] = [0, 1].map(|c| 0.5 * (direction.nodes[0][c] + direction.nodes[direction.nodes.len() - 1][c]));
    let moved = ends.iter().zip(&rates).map(|(end, rate)| [0, 1].map(|c| moving(end[c], rate[c]))).collect();
    (rates, moved)
}

/// Stream function at the nodes of the half panels of the wake, for their sources held.
pub(super) fn wake_stream(
    reverse: &Reverse,
    outline: &Outline,
    nodes: &[[Forward; 2]],
    ends: &[[Forward; 2]],
) -> Vec<Forward> {
    let sources = &reverse.at_solution.wake;
    let stream = |i: usize| -> Forward {
        let of_panel = |h: usize| {
            let [a, b] = wake_source_stream([ends[h], ends[h + 1]], nodes[i], edge_place(outline, i, h));
            a * sources[h] + b * sources[h + 1]
        };
        (0..ends.len() - 1).map(of_panel).sum()
    };
    (0..nodes.len()).map(stream).collect()
}

/// Speed at the trailing edge.
pub(super) fn edge_speed(sheets: &Strengths) -> f64 {
    let strengths = &sheets.nodes;
    0.5 * (strengths[0] - strengths[strengths.len() - 1])
}

/// Stream function at the nodes of the closing panel, for strengths held.
pub(super) fn closing_stream(sheets: &Strengths, outline: &Outline, nodes: &[[Forward; 2]]) -> Vec<Forward> {
    let n = nodes.len();
    let speed = edge_speed(sheets);
    let (frame, panel) = (edge_frame(nodes), [nodes[n - 1], nodes[0]]);
    let stream = |i: usize| {
        let influence = stream_influence(panel, nodes[i], outline.place(i, n - 1));
        ((influence.vortex[0] + influence.vortex[1]) * frame.vortex + influence.source * frame.source) / length(panel)
            * speed
    };
    (0..n).map(stream).collect()
}

/// Stream function at the nodes of the onset flow and of all panels of the section, for strengths and
/// defects held.
pub(super) fn stream(sheets: &Strengths, outline: &Outline, nodes: &[[Forward; 2]], alpha: Forward) -> Vec<Forward> {
    let (strengths, mass) = (&sheets.nodes, &sheets.smoothed);
    let (sin, cos) = alpha.sin_cos();
    let onset = nodes.iter().map(|[x, y]| *y * cos - *x * sin);
    let mut result: Vec<Forward> = onset.collect();
    for j in 0..nodes.len() - 1 {
        let panel = [nodes[j], nodes[j + 1]];
        let outflow = length(panel).recip() * (mass[j] - mass[j + 1]);
        for (i, stream) in result.iter_mut().enumerate() {
            let influence = stream_influence(panel, nodes[i], outline.place(i, j));
            *stream += influence.vortex[0] * strengths[j] + influence.vortex[1] * strengths[j + 1];
            *stream += influence.source * outflow;
        }
    }
    if outline.trailing_edge == TrailingEdge::Blunt {
        for (stream, closing) in result.iter_mut().zip(closing_stream(sheets, outline, nodes)) {
            *stream += closing;
        }
    }
    result
}

/// Velocity at a point, which may be a node of the wake, for all strengths held.
pub(super) fn velocity(
    (held, outline): (&Strengths, &Outline),
    nodes: &[[Forward; 2]],
    ends: &[[Forward; 2]],
    alpha: Forward,
    (point, number): ([Forward; 2], Option<usize>),
) -> [Forward; 2] {
    let n = nodes.len();
    let (gamma, mass) = (&held.nodes, &held.smoothed);
    let mut sum = [alpha.cos(), alpha.sin()];
    let mut add = |influence: VelocityInfluence<Forward>, vortex: [Forward; 2], source: [Forward; 2]| {
        for c in 0..2 {
            for end in 0..2 {
                sum[c] += influence.vortex[end][c] * vortex[end] + influence.source[end][c] * source[end];
            }
        }
    };
    let still = |pair: [f64; 2]| pair.map(Forward::from);
    for j in 0..n - 1 {
        let panel = [nodes[j], nodes[j + 1]];
        let outflow = length(panel).recip() * (mass[j] - mass[j + 1]);
        add(velocity_influence(panel, point, Place::Elsewhere), still([gamma[j], gamma[j + 1]]), [outflow; 2]);
    }
    for h in 0..ends.len().saturating_sub(1) {
        let place = number.map_or(Place::Elsewhere, |k| wake_place(k, h));
        let influence = velocity_influence([ends[h], ends[h + 1]], point, place);
        add(influence, still([0.0; 2]), still([held.wake[h], held.wake[h + 1]]));
    }
    if outline.trailing_edge == TrailingEdge::Blunt {
        let (frame, panel) = (edge_frame(nodes), [nodes[n - 1], nodes[0]]);
        let per_length = length(panel).recip() * (0.5 * (gamma[0] - gamma[n - 1]));
        let influence = velocity_influence(panel, point, Place::Elsewhere);
        add(influence, [frame.vortex * per_length; 2], [frame.source * per_length; 2]);
    }
    sum
}

/// Multipliers of the panel equations that are all zero.
pub(super) fn no_weights(nodes: usize) -> PanelWeights {
    PanelWeights { stream: Coefficients::<()>::default().map(|()| vec![0.0; nodes]), edge: Lanes::zeros() }
}

/// Adds the panel equations for one pair of sheets alone.
pub(super) fn add_panels_of(
    (sheets, weights): (Strengths, PanelWeights),
    reverse: &Reverse,
    collected: &mut Collected,
) {
    let none = no_weights(reverse.section.len());
    add_panels(reverse, [(&sheets, &weights), (&reverse.at_solution, &none)], collected);
}
