//! Fixtures of the tests of single terms of the reverse sweep: solutions with their multipliers, and the comparison of
//! what a term collects with a forward sweep.

use super::reverse::{Collected, Lanes, Reverse, lanes};
use crate::flow::coefficients::{COEFFICIENTS, Coefficients};
use crate::flow::panel::coupling::reduced::Reduced;
use crate::flow::panel::coupling::response::edge_place;
use crate::flow::panel::kernel::wake_source_stream;
use crate::flow::panel::outline::{Outline, TrailingEdgeFrame};
use crate::flow::panel::outputs::direct;
use crate::flow::panel::solved::{Direct, Solved};
use crate::flow::panel::testing::{Direction, Forward, assert_same, cambered_flows, moving, wave};

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
    num_dual::DualNum::sqrt(&(dx * dx + dy * dy))
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
