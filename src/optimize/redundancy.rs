//! Constraints that say nothing of their own: nothing changes them, or other equalities imply them.

use super::kkt::{Iterate, is_constant};
use super::vector::{dot, norm};
use crate::design::Problem;

/// Length of what is left of a unit gradient after those before it, below which it depends on them.
const DEPENDENT: f64 = 1e-7;
/// The length below which it nearly does: the two then ask for the derivative across them, which hardly anyone means.
const NEARLY: f64 = 1e-3;

/// The reason why a constraint says nothing of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Redundancy {
    /// No free variable changes it.
    Constant,
    /// The gradients of equalities before it combine to its own.
    Dependent,
    /// They combine to nearly its own.
    Nearly,
}

/// The constraints that say nothing of their own at a point: all that are constant, and equalities that depend on
/// others.
pub(super) fn redundant(problem: &dyn Problem, point: &Iterate) -> Vec<(usize, Redundancy)> {
    let description = problem.description();
    let steps = problem.natural_steps().unwrap_or_else(|| vec![1.0; point.x.len()]);
    let free: Vec<usize> = (0..steps.len())
        .filter(|&k| description.variable_bounds[k].lower < description.variable_bounds[k].upper)
        .collect();
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut found = Vec::new();
    for (k, bounds) in description.constraint_bounds.iter().enumerate() {
        let row: Vec<f64> = free.iter().map(|&j| point.evaluation.jacobian[k][j] * steps[j]).collect();
        let slope = norm(&row);
        if is_constant(point.evaluation.constraints[k], bounds, slope) {
            found.push((k, Redundancy::Constant));
        } else if bounds.lower == bounds.upper {
            let mut rest: Vec<f64> = row.iter().map(|a| a / slope).collect();
            // twice, against round-off
            for _ in 0..2 {
                for unit in &basis {
                    let along = dot(unit, &rest);
                    rest.iter_mut().zip(unit).for_each(|(r, u)| *r -= along * u);
                }
            }
            let length = norm(&rest);
            if length < DEPENDENT {
                found.push((k, Redundancy::Dependent));
            } else {
                if length < NEARLY {
                    found.push((k, Redundancy::Nearly));
                }
                basis.push(rest.iter().map(|r| r / length).collect());
            }
        }
    }
    found
}

/// The constraints that no free variable changes.
pub(super) fn constant(problem: &dyn Problem, point: &Iterate) -> Vec<usize> {
    let found = redundant(problem, point).into_iter();
    found.filter(|(_, kind)| *kind == Redundancy::Constant).map(|(k, _)| k).collect()
}

/// Whether constraints are violated by more than a tolerance, and no free variable changes any of these.
pub(super) fn misses_only_constants(problem: &dyn Problem, point: &Iterate, tolerance: f64) -> bool {
    let bounds = &problem.description().constraint_bounds;
    let missed = |k: &usize| bounds[*k].violation(point.evaluation.constraints[*k]) > tolerance;
    let constant = constant(problem, point);
    let mut missed = (0..bounds.len()).filter(missed).peekable();
    missed.peek().is_some() && missed.all(|k| constant.contains(&k))
}

/// The redundant constraints in words, with a space before; empty where there are none.
pub(super) fn in_words(problem: &dyn Problem, point: &Iterate) -> String {
    let names = &problem.description().constraint_names;
    let found = redundant(problem, point);
    let listed = |kind: Redundancy| -> Option<String> {
        let list: Vec<&str> = found.iter().filter(|(_, k)| *k == kind).map(|(k, _)| names[*k].as_str()).collect();
        (!list.is_empty()).then(|| list.join(", "))
    };
    let constant = listed(Redundancy::Constant)
        .map(|list| format!(" Nothing that is free changes {list}: left out of the conditions, and best deleted."));
    let dependent = listed(Redundancy::Dependent)
        .map(|list| format!(" Redundant beside the other equalities: {list}; its multiplier is shared with theirs."));
    let nearly = listed(Redundancy::Nearly).map(|list| {
        format!(" Nearly the same as other equalities: {list}; together they ask for more than each, and one is best deleted.")
    });
    constant.into_iter().chain(dependent).chain(nearly).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::{Bounds, Evaluation};
    use crate::differentiate::VectorFunction;
    use crate::optimize::testcases::*;
    use crate::optimize::{Sqp, Termination};
    use crate::scalar::Scalar;
    use std::convert::Infallible;

    /// A bowl under two equalities that say the same, one that nothing changes, and one more.
    #[derive(Clone)]
    struct Tied;

    impl VectorFunction for Tied {
        type Error = Infallible;
        fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, Infallible> {
            let bowl = x.iter().map(|x| *x * *x).sum::<S>();
            Ok(vec![bowl, x[0] + x[1], (x[0] + x[1]) * 3.0, x[0] * 0.0 + 0.005, x[2] - x[1]])
        }
    }

    #[test]
    fn redundant_equalities_are_named_and_do_no_harm() {
        let limits = [(1.0, 1.0), (3.0, 3.0), (0.005, 0.005), (0.5, 0.5)];
        let mut case = Constrained::new(Tied, &[1.0, 2.0, 3.0], &limits);
        let outcome = run(&Sqp::default(), &mut case);
        assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
        // x0 = 1 − x1 and x2 = x1 + 1/2: the minimum of the squares at x1 = 1/6
        for (x, expected) in outcome.x.iter().zip([5.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0]) {
            assert!((x - expected).abs() < 1e-5, "{:?}", outcome.x);
        }
        assert!(outcome.multipliers.iter().all(|m| m.abs() < 10.0), "{:?}", outcome.multipliers);
        assert_eq!(outcome.multipliers[2], 0.0);
        assert!(outcome.message.contains("Nothing that is free changes c2"), "{}", outcome.message);
        assert!(outcome.message.contains("Redundant beside the other equalities: c1"), "{}", outcome.message);
    }

    #[test]
    fn nearly_equal_equalities_are_named() {
        let case = Constrained::new(Tied, &[1.0; 3], &[(1.0, 1.0), (3.0, 3.0)]);
        let named = |slope: f64| {
            let evaluation = Evaluation {
                objective: 3.0,
                gradient: vec![2.0; 3],
                constraints: vec![2.0, 6.0],
                jacobian: vec![vec![1.0, 1.0, 0.0], vec![3.0, 3.0, slope]],
                values: vec![],
            };
            in_words(&case, &Iterate::new(&case, &[1.0; 3], evaluation))
        };
        assert!(named(1e-9).contains("Redundant beside the other equalities: c1"));
        assert!(named(1e-5).contains("Nearly the same as other equalities: c1;"));
        assert_eq!(named(0.1), "");
    }

    #[test]
    fn a_constraint_that_nothing_changes_and_that_is_not_met_is_named() {
        let limits = [(1.0, 1.0), (3.0, 3.0), (0.01, 0.02), (0.5, 0.5)];
        let outcome = run(&Sqp::default(), &mut Constrained::new(Tied, &[1.0, 2.0, 3.0], &limits));
        assert_eq!(outcome.status, Termination::Infeasible, "{}", outcome.message);
        let words = "c2 is 0.005, 5.0e-3 off the minimum 0.01 (nothing that is free changes it). Relax";
        assert!(outcome.message.contains(words), "{}", outcome.message);
        // the rest is as it would be without it, and no evaluation is spent in vain
        assert!((outcome.x[1] - 1.0 / 6.0).abs() < 1e-5 && outcome.evaluations < 20, "{}", outcome.evaluations);
        // one that another stands against is no such
        let limits = [(1.0, 1.0), (6.0, 6.0), (0.005, 0.005), (0.5, 0.5)];
        let outcome = run(&Sqp::default(), &mut Constrained::new(Tied, &[1.0, 2.0, 3.0], &limits));
        assert_eq!(outcome.status, Termination::Infeasible, "{}", outcome.message);
        assert!(outcome.message.contains("; they stand against each other. Relax"), "{}", outcome.message);
    }

    #[test]
    fn independent_equalities_are_not() {
        let case = Constrained::new(Tied, &[1.0; 3], &[(1.0, 1.0), (0.0, 9.0), (0.0, 1.0), (0.5, 0.5)]);
        let evaluation = Evaluation {
            objective: 3.0,
            gradient: vec![2.0; 3],
            constraints: vec![2.0, 6.0, 0.5, 0.0],
            jacobian: vec![vec![1.0, 1.0, 0.0], vec![3.0, 3.0, 0.0], vec![0.0, 0.0, 1e-3], vec![0.0, -1.0, 1.0]],
            values: vec![],
        };
        let point = Iterate::new(&case, &[1.0; 3], evaluation);
        // an inequality that runs along with an equality is none
        assert_eq!(redundant(&case, &point), []);
        assert_eq!(case.description.constraint_bounds[0], Bounds { lower: 1.0, upper: 1.0 });
    }
}
