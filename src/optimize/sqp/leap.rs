//! Leaps of the analysis: values that differ at designs so close that no derivative at either tells it.

use super::frame::Frame;
use crate::design::Evaluation;
use crate::optimize::kkt::Iterate;

/// Longest step, in natural steps of the variables, on which a leap is told from a strong curvature.
const SHORT: f64 = 1e-2;
/// Change over what the steeper of the two ends tells from which it is a leap. Along a wall, which is convex, a change is
/// never more than its steeper end tells.
const UNTOLD: f64 = 3.0;
/// Share of a value below which a change may be round-off or the tolerance of the analysis.
const SLIGHT: f64 = 1e-6;
/// Leaps met until a run ends that gains nothing meanwhile.
const MOST: usize = 8;
/// Share of the objective whose gain makes the leaps so far forgotten.
const WORTH: f64 = 1e-4;

/// A change that no derivative tells.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::optimize) struct Leap {
    /// Position of the constraint that leaps; `None` for the objective.
    pub constraint: Option<usize>,
    /// The value at the design kept, and at the one refused.
    pub values: [f64; 2],
    /// Distance of the two designs, in natural steps of the variables.
    pub length: f64,
}

impl Leap {
    /// The leap between a point and a design that was refused, if there is one.
    fn between(point: &Iterate, x: &[f64], evaluation: &Evaluation, frame: &Frame) -> Option<Self> {
        let way = frame.way(&point.x, x);
        let length = way.norm();
        if length > SHORT {
            return None;
        }
        let told = |ends: [&[f64]; 2]| ends.map(|gradient| frame.gradient(gradient).dot(&way).abs());
        let leaps = |values: [f64; 2], ends: [&[f64]; 2]| {
            let change = (values[1] - values[0]).abs();
            let steeper = told(ends).into_iter().fold(0.0, f64::max);
            change > SLIGHT * values[0].abs().max(values[1].abs()) && change > UNTOLD * steeper
        };
        let here = &point.evaluation;
        let objective = [here.objective, evaluation.objective];
        if leaps(objective, [&here.gradient, &evaluation.gradient]) {
            return Some(Self { constraint: None, values: objective, length });
        }
        (0..here.constraints.len()).find_map(|k| {
            let values = [here.constraints[k], evaluation.constraints[k]];
            let found = leaps(values, [&here.jacobian[k], &evaluation.jacobian[k]]);
            found.then_some(Self { constraint: Some(k), values, length })
        })
    }
}

/// The leaps that a run has met since it last gained.
#[derive(Debug, Clone, Default)]
pub(in crate::optimize) struct Leaps {
    count: usize,
    /// The shortest of them.
    shortest: Option<Leap>,
    /// Objective at the first of them.
    since: f64,
}

impl Leaps {
    /// Notes a design that was refused.
    pub(super) fn note(&mut self, point: &Iterate, x: &[f64], evaluation: &Evaluation, frame: &Frame) {
        let Some(leap) = Leap::between(point, x, evaluation, frame) else { return };
        if self.count == 0 || self.since - point.evaluation.objective > WORTH * self.since.abs() {
            *self = Self { since: point.evaluation.objective, ..Self::default() };
        }
        self.count += 1;
        if self.shortest.as_ref().is_none_or(|shortest| leap.length < shortest.length) {
            self.shortest = Some(leap);
        }
    }

    /// The shortest leap, where there were so many that the run should end.
    pub(super) fn ending(&self) -> Option<&Leap> {
        self.shortest.as_ref().filter(|_| self.count >= MOST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::Problem;
    use crate::differentiate::VectorFunction;
    use crate::optimize::testcases::*;
    use crate::optimize::{Sqp, Termination};
    use crate::scalar::Scalar;
    use std::convert::Infallible;

    /// A bowl under a constraint, with a step of a height or a wall of a steepness where `x0` falls below 0.6.
    #[derive(Clone)]
    struct Stepped {
        step: f64,
        of_constraint: f64,
        wall: f64,
    }

    impl VectorFunction for Stepped {
        type Error = Infallible;
        fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, Infallible> {
            let below = if x[0].re() < 0.6 { 1.0 } else { 0.0 };
            let bowl = x.iter().map(|x| *x * *x).sum::<S>();
            let wall = ((-x[0] + 0.6) * self.wall).exp() * 1e-6;
            Ok(vec![bowl + wall + below * self.step, x[0] + x[1] + below * self.of_constraint])
        }
    }

    fn outcome(function: Stepped) -> crate::optimize::Outcome {
        run(&Sqp::default(), &mut Constrained::new(function, &[2.0, 1.5], &[(1.0, 1.0)]))
    }

    #[test]
    fn a_run_that_comes_to_a_leap_ends_soon_and_says_so() {
        for (step, of_constraint, words) in
            [(10.0, 0.0, "the objective leaps from 0.52"), (0.0, 10.0, "c0 leaps from 1")]
        {
            let end = outcome(Stepped { step, of_constraint, wall: 0.0 });
            assert_eq!(end.status, Termination::Stalled, "{}", end.message);
            assert!(end.message.contains(words), "{}", end.message);
            assert!((end.x[0] - 0.6).abs() < 0.01 && end.evaluations < 80, "{:?} {}", end.x, end.evaluations);
        }
    }

    #[test]
    fn a_wall_is_no_leap_nor_is_a_long_step() {
        let between = |function: &Stepped, from: f64, to: f64| {
            let (from, to) = ([from, 0.4], [to, 0.4]);
            let mut case = Constrained::new(function.clone(), &from, &[(1.0, 1.0)]);
            let [here, there] = [from, to].map(|x| case.evaluate(&x).unwrap());
            Leap::between(&Iterate::new(&case, &from, here), &to, &there, &Frame::new(&case))
        };
        let wall = Stepped { step: 0.0, of_constraint: 0.0, wall: 2e3 };
        assert_eq!(between(&wall, 0.6, 0.595), None);
        assert_eq!(between(&wall, 0.595, 0.6), None);
        let stepped = Stepped { step: 0.1, of_constraint: 0.0, wall: 0.0 };
        assert_eq!(between(&stepped, 0.62, 0.59), None);
        assert_eq!(between(&stepped, 0.607, 0.601), None);
        let leap = between(&stepped, 0.604, 0.599).unwrap();
        assert!(leap.constraint.is_none() && (leap.length - 0.005).abs() < 1e-12, "{leap:?}");
        let stepped = Stepped { step: 0.0, of_constraint: 0.1, wall: 0.0 };
        assert_eq!(between(&stepped, 0.604, 0.599).unwrap().constraint, Some(0));
    }
}
