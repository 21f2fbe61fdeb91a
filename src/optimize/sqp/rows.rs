//! The sides of the constraints, as the method counts them.

use super::frame::Frame;
use crate::design::{Bounds, Evaluation};
use crate::optimize::constraint_row::ConstraintRow;
use crate::optimize::kkt::is_constant;

/// Distance that an inequality keeps from its bound at the beginning, in natural steps, where it is violated or nearly
/// so at the start.
const MARGIN: f64 = 0.05;
/// Share of the room between two bounds that a margin may take.
const SHARE: f64 = 0.25;
/// Distance from its bound, in natural steps, at which an inequality gets a margin.
const NEAR: f64 = 0.01;
/// Factor of a margin from one iteration to the next.
const DECAY: f64 = 0.7;
/// Share of the distance from its bound that an inequality has come to which its margin takes at most: a margin that
/// is wider than there is room would ask for what cannot be had.
const KEPT: f64 = 0.5;
/// Margin that is dropped.
const LEAST_MARGIN: f64 = 1e-4;

/// One side of a constraint: its value is to be at least 0, and its gradient has about the length one.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub side: ConstraintRow,
    /// Distance it keeps from its bound for now.
    pub margin: f64,
    /// Price of its shortfall in the merit function.
    pub weight: f64,
    /// A change of its constraint that is large: the largest of its bound, its value at the start, and its change over a
    /// natural step there.
    pub unit: f64,
}

impl Row {
    /// The distance from the bound and its margin.
    pub fn value(&self, evaluation: &Evaluation) -> f64 {
        self.side.value(evaluation) - self.margin
    }

    /// Lets the margin shrink after a step of some length to a point of this evaluation: steps as short as the margin have
    /// nothing to keep away from.
    pub fn narrow(&mut self, length: f64, evaluation: &Evaluation) {
        let distance = self.side.value(evaluation);
        if distance >= 0.0 {
            self.margin = self.margin.min(KEPT * distance);
        }
        let kept = self.margin > LEAST_MARGIN && length > self.margin;
        self.margin = if kept { DECAY * self.margin } else { 0.0 };
    }

    /// Measures the row by the steepest gradient it has had.
    pub fn rescale(&mut self, frame: &Frame, evaluation: &Evaluation) {
        let steeper = frame.slope(&evaluation.jacobian[self.side.constraint]) * self.side.factor.abs();
        if steeper > 1.0 {
            self.side.factor /= steeper;
            self.weight *= steeper;
            self.margin /= steeper;
        }
    }
}

/// All sides of all constraints at the start.
pub(super) fn rows(bounds: &[Bounds], frame: &Frame, start: &Evaluation) -> Vec<Row> {
    let mut rows = Vec::new();
    for (constraint, (b, gradient)) in bounds.iter().zip(&start.jacobian).enumerate() {
        let slope = frame.slope(gradient);
        let constant = is_constant(start.constraints[constraint], b, slope);
        let factor = if constant { 1.0 } else { 1.0 / slope };
        let sides = [(b.lower, factor), (b.upper, -factor)].into_iter().filter(|(bound, _)| bound.is_finite());
        for (bound, factor) in sides {
            let side = ConstraintRow { constraint, bound, factor };
            let room = SHARE * (b.upper - b.lower) * factor.abs();
            let near = !constant && side.value(start) < NEAR;
            let large = slope.max(bound.abs()).max(start.constraints[constraint].abs());
            let unit = if large > 0.0 { large } else { 1.0 };
            rows.push(Row { side, margin: if near { MARGIN.min(room) } else { 0.0 }, weight: 0.0, unit });
        }
    }
    rows
}

/// Largest shortfall of the rows, each in its own unit.
pub(super) fn farthest(rows: &[Row], evaluation: &Evaluation) -> f64 {
    rows.iter().map(|row| beyond(row, evaluation.constraints[row.side.constraint])).fold(0.0, f64::max)
}

/// Shortfall of a row at a value of its constraint, in its own unit; negative where there is none.
pub(super) fn beyond(row: &Row, value: f64) -> f64 {
    -row.side.of(value) / (row.side.factor.abs() * row.unit)
}

/// Sum of the shortfalls of values that should be at least 0.
pub(super) fn short(values: &[f64]) -> f64 {
    values.iter().map(|v| (-v).max(0.0)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The margin that is left of 0.05 after a step of some length to a point this far from the bound.
    fn left(margin: f64, length: f64, distance: f64) -> f64 {
        let side = ConstraintRow { constraint: 0, bound: 2.0, factor: -0.5 };
        let mut row = Row { side, margin, weight: 1.0, unit: 1.0 };
        let evaluation = Evaluation {
            objective: 0.0,
            gradient: vec![0.0],
            constraints: vec![2.0 - 2.0 * distance],
            jacobian: vec![vec![1.0]],
            values: vec![],
        };
        row.narrow(length, &evaluation);
        row.margin
    }

    #[test]
    fn a_margin_shrinks_and_is_capped_by_half_of_the_room_that_was_found() {
        // plenty of room, none found yet, half of the margin found
        assert!((left(0.05, 1.0, 0.3) - 0.7 * 0.05).abs() < 1e-15);
        assert!((left(0.05, 1.0, -0.3) - 0.7 * 0.05).abs() < 1e-15);
        assert!((left(0.05, 1.0, 0.02) - 0.7 * 0.01).abs() < 1e-15);
        // at the bound itself there is no room at all
        assert_eq!(left(0.05, 1.0, 0.0), 0.0);
    }

    #[test]
    fn a_margin_is_dropped_where_steps_are_short_or_it_is_next_to_nothing() {
        assert_eq!(left(0.05, 0.04, 0.3), 0.0);
        assert_eq!(left(0.9e-4, 1.0, 0.3), 0.0);
        assert!(left(1.1e-4, 1.0, 0.3) > 0.0);
    }
}
