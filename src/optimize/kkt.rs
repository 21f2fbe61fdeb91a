//! First-order optimality under constraints: multipliers, and what they leave of the gradient.

use super::vector::{dot, norm};
use crate::design::{Bounds, Evaluation, Problem};
use nalgebra::{DMatrix, DVector};

/// Distance from a bound, in natural steps of the variables (to first order for constraints), within which it counts
/// as reached.
pub(crate) const REACHED: f64 = 1e-4;
/// Singular values below this share of the largest count as zero: constraints that depend on each other share their
/// multiplier instead of having two huge ones that cancel.
const RANK: f64 = 1e-9;

/// How far a point is from satisfying the first-order conditions (Karush, Kuhn and Tucker).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Optimality {
    /// One for each constraint: the derivative of the optimal objective with respect to the bound that is reached.
    /// Positive at a lower bound, negative at an upper one, of any sign for an equality, 0 elsewhere.
    pub multipliers: Vec<f64>,
    /// One for each variable: the derivative of the optimal objective with respect to the bound that holds it, 0 where
    /// none does.
    pub bound_multipliers: Vec<f64>,
    /// Largest entry of the projected gradient of the Lagrangian, or of multiplier times distance from its bound, with
    /// the variables in natural steps.
    pub residual: f64,
    /// Euclidean norm of the projected gradient of the Lagrangian, with the variables in natural steps.
    pub norm: f64,
}

impl Optimality {
    /// The description of a point that has no evaluation.
    pub fn unknown() -> Self {
        Self { multipliers: Vec::new(), bound_multipliers: Vec::new(), residual: f64::NAN, norm: f64::NAN }
    }
}

/// A point that a method has reached, with its evaluation and how far it is from a constrained minimum.
#[derive(Debug, Clone)]
pub(super) struct Iterate {
    pub x: Vec<f64>,
    pub evaluation: Evaluation,
    pub optimality: Optimality,
    pub violation: f64,
}

impl Iterate {
    pub fn new(problem: &dyn Problem, x: &[f64], evaluation: Evaluation) -> Self {
        let optimality = optimality(problem, x, &evaluation);
        let violation = evaluation.violation(&problem.description().constraint_bounds);
        Self { x: x.to_vec(), evaluation, optimality, violation }
    }

    /// How much higher the objective is at `x` than here.
    ///
    /// The difference of two close objectives is lost in their round-off; there it is the integral of the gradient, by
    /// the trapezoidal rule. Otherwise no step could be told from a bad one once the objective is right to half its
    /// digits.
    pub fn height(&self, x: &[f64], evaluation: &Evaluation) -> f64 {
        let difference = evaluation.objective - self.evaluation.objective;
        if difference.abs() > SMALL_CHANGE * self.evaluation.objective.abs() {
            return difference;
        }
        let slopes = self.evaluation.gradient.iter().zip(&evaluation.gradient);
        x.iter().zip(&self.x).zip(slopes).map(|((x, from), (a, b))| 0.5 * (a + b) * (x - from)).sum()
    }
}

/// Relative change of the objective below which the gradients tell it better.
const SMALL_CHANGE: f64 = 1e-8;

/// Which side of its bounds a value has reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ActiveBound {
    Lower,
    Upper,
    Equal,
}

/// The side reached by `value`, with `slope` the norm of its gradient.
pub(super) fn reached(value: f64, bounds: &Bounds, slope: f64) -> Option<ActiveBound> {
    let near = REACHED * slope;
    if bounds.lower == bounds.upper {
        return Some(ActiveBound::Equal);
    }
    let (below, above) = (value - bounds.lower <= near, bounds.upper - value <= near);
    match (below, above) {
        (true, true) if value - bounds.lower > bounds.upper - value => Some(ActiveBound::Upper),
        (true, _) => Some(ActiveBound::Lower),
        (false, true) => Some(ActiveBound::Upper),
        (false, false) => None,
    }
}

/// A point of a problem with its derivatives, the variables counted in natural steps.
struct Measured<'a> {
    x: Vec<f64>,
    variable_bounds: Vec<Bounds>,
    gradient: Vec<f64>,
    constraints: &'a [f64],
    constraint_bounds: &'a [Bounds],
    jacobian: Vec<Vec<f64>>,
    steps: Vec<f64>,
}

impl<'a> Measured<'a> {
    fn new(problem: &'a dyn Problem, x: &[f64], evaluation: &'a Evaluation) -> Self {
        let description = problem.description();
        let steps = problem.natural_steps().unwrap_or_else(|| vec![1.0; x.len()]);
        let scaled = |row: &[f64]| row.iter().zip(&steps).map(|(g, step)| g * step).collect::<Vec<f64>>();
        let bounds = description.variable_bounds.iter().zip(&steps);
        Self {
            x: x.iter().zip(&steps).map(|(x, step)| x / step).collect(),
            variable_bounds: bounds.map(|(b, s)| Bounds { lower: b.lower / s, upper: b.upper / s }).collect(),
            gradient: scaled(&evaluation.gradient),
            constraints: &evaluation.constraints,
            constraint_bounds: &description.constraint_bounds,
            jacobian: evaluation.jacobian.iter().map(|row| scaled(row)).collect(),
            steps,
        }
    }
}

/// Derivative of a constraint per natural step, relative to its value, below which nothing that is free changes it.
const CONSTANT: f64 = 1e-9;

/// Whether no variable changes a constraint of this value and bounds: all that its gradient has is round-off.
pub(super) fn is_constant(value: f64, bounds: &Bounds, slope: f64) -> bool {
    let finite = |b: f64| if b.is_finite() { b.abs() } else { 0.0 };
    let size = value.abs().max(finite(bounds.lower)).max(finite(bounds.upper));
    slope <= CONSTANT * size + 1e-15
}

/// The optimality of `x`.
///
/// The multipliers minimise the norm of what is left of the gradient over all multipliers of the right sign for what is
/// reached at `x` (violated constraints included). They depend on the point only, not on the way to it.
pub(super) fn optimality(problem: &dyn Problem, x: &[f64], evaluation: &Evaluation) -> Optimality {
    let at = Measured::new(problem, x, evaluation);
    let multipliers = if evaluation.constraints.is_empty() {
        Vec::new()
    } else {
        let all = |_: usize| true;
        let (numbers, columns) = active(&at, &all);
        let weights = nonnegative_least_squares(&columns, &at.gradient);
        let mut multipliers = vec![0.0; evaluation.constraints.len()];
        for ((number, column), weight) in numbers.iter().zip(&columns).zip(weights) {
            if let Some(number) = number {
                multipliers[*number] = column.sign * weight;
            }
        }
        multipliers
    };
    let mut gradient = at.gradient.clone();
    for (row, multiplier) in at.jacobian.iter().zip(&multipliers).filter(|(_, m)| **m != 0.0) {
        gradient.iter_mut().zip(row).for_each(|(g, a)| *g -= multiplier * a);
    }
    let left = at.x.iter().zip(&gradient).zip(&at.variable_bounds).map(|((x, g), b)| reducible(*x, *g, b));
    let (largest, squares) = left.fold((0.0, 0.0), |(l, s): (f64, f64), g| (l.max(g.abs()), s + g * g));
    // a constraint that pulls must be at its bound
    let values = evaluation.constraints.iter().zip(at.constraint_bounds).zip(&multipliers);
    let slack = values
        .filter(|(_, m)| **m != 0.0)
        .map(|((value, b), m)| m.abs() * if *m > 0.0 { (value - b.lower).abs() } else { (b.upper - value).abs() });
    let residual = slack.fold(largest, f64::max);
    let held = at.x.iter().zip(&gradient).zip(&at.variable_bounds).map(|((x, g), b)| held_by(*x, *g, b));
    let bound_multipliers = held.zip(&at.steps).map(|(held, step)| held / step).collect();
    Optimality { multipliers, bound_multipliers, residual, norm: squares.sqrt() }
}

/// The gain to first order of a natural step of a variable, or of the way to the bound of the variable where that is
/// shorter. Unlike the clipped gradient it scales with the objective.
fn reducible(x: f64, slope: f64, bounds: &Bounds) -> f64 {
    let room = if slope > 0.0 { x - bounds.lower } else { bounds.upper - x };
    slope * room.clamp(0.0, 1.0)
}

/// The part of a Lagrangian's derivative that the bound of a variable takes up; 0 where no bound does.
fn held_by(x: f64, slope: f64, bounds: &Bounds) -> f64 {
    let held = match reached(x, bounds, 1.0) {
        Some(ActiveBound::Lower) => slope > 0.0,
        Some(ActiveBound::Upper) => slope < 0.0,
        Some(ActiveBound::Equal) => true,
        None => false,
    };
    if held { slope } else { 0.0 }
}

/// The gradients of everything reached, pointing into the feasible region; the first list tells which constraint
/// (those that `wanted` selects), `None` for a variable at its bound.
fn active(at: &Measured<'_>, wanted: &dyn Fn(usize) -> bool) -> (Vec<Option<usize>>, Vec<ActiveGradient>) {
    let (mut numbers, mut columns) = (Vec::new(), Vec::new());
    let mut push = |number: Option<usize>, gradient: Vec<f64>, side: ActiveBound| {
        let (sign, free) = match side {
            ActiveBound::Lower => (1.0, false),
            ActiveBound::Upper => (-1.0, false),
            ActiveBound::Equal => (1.0, true),
        };
        numbers.push(number);
        columns.push(ActiveGradient { gradient, sign, free });
    };
    let rows = at.constraints.iter().zip(&at.jacobian).zip(at.constraint_bounds);
    for (number, ((&value, row), bounds)) in rows.enumerate().filter(|(number, _)| wanted(*number)) {
        let slope = norm(row);
        if let Some(side) = reached(value, bounds, slope)
            && !is_constant(value, bounds, slope)
        {
            push(Some(number), row.clone(), side);
        }
    }
    for (i, (&value, bounds)) in at.x.iter().zip(&at.variable_bounds).enumerate() {
        if let Some(side) = reached(value, bounds, 1.0) {
            let mut unit = vec![0.0; at.x.len()];
            unit[i] = 1.0;
            push(None, unit, side);
        }
    }
    (numbers, columns)
}

/// The reasons that keep the violated constraints from being met: the other constraints that push against them at `x`,
/// and whether the variables' bounds do.
pub(super) fn opposition(
    problem: &dyn Problem,
    x: &[f64],
    evaluation: &Evaluation,
    tolerance: f64,
) -> (Vec<usize>, bool) {
    let at = Measured::new(problem, x, evaluation);
    let violated = |k: usize| at.constraint_bounds[k].violation(evaluation.constraints[k]) > tolerance;
    // the way that reduces the violations, each measured as a distance in the variables
    let mut wanted = vec![0.0; x.len()];
    for (k, row) in at.jacobian.iter().enumerate().filter(|(k, _)| violated(*k)) {
        let short = evaluation.constraints[k] < at.constraint_bounds[k].lower;
        let slope = norm(row).max(f64::MIN_POSITIVE);
        wanted.iter_mut().zip(row).for_each(|(w, a)| *w += if short { a / slope } else { -a / slope });
    }
    // held by: −wanted is a combination of what points into the feasible region
    wanted.iter_mut().for_each(|w| *w = -*w);
    let met = |k: usize| !violated(k);
    let (numbers, columns) = active(&at, &met);
    let weights = nonnegative_least_squares(&columns, &wanted);
    let significant = 1e-6 * norm(&wanted);
    let holding = numbers.iter().zip(&columns).zip(&weights);
    let holding: Vec<Option<usize>> = holding
        .filter(|((_, column), weight)| weight.abs() * norm(&column.gradient) > significant)
        .map(|((number, _), _)| *number)
        .collect();
    (holding.iter().flatten().copied().collect(), holding.contains(&None))
}

/// One column of a least-squares problem.
struct ActiveGradient {
    gradient: Vec<f64>,
    /// The unknown is a nonnegative weight of `sign · gradient`.
    sign: f64,
    /// The weight may have any sign.
    free: bool,
}

/// Weights `w` (nonnegative, but for free columns) that minimise `‖Σ w_k sign_k gradient_k − wanted‖` by the active-set
/// method of Lawson and Hanson (Solving Least Squares Problems, chapter 23).
fn nonnegative_least_squares(columns: &[ActiveGradient], wanted: &[f64]) -> Vec<f64> {
    let lengths: Vec<f64> = columns.iter().map(|c| norm(&c.gradient)).collect();
    let unit = |k: usize, i: usize| columns[k].sign * columns[k].gradient[i] / lengths[k];
    let mut weights = vec![0.0; columns.len()];
    let mut passive: Vec<usize> = (0..columns.len()).filter(|&k| columns[k].free && lengths[k] > 0.0).collect();
    let solve = |passive: &[usize]| -> Vec<f64> {
        if passive.is_empty() {
            return Vec::new();
        }
        let matrix = DMatrix::from_fn(wanted.len(), passive.len(), |i, k| unit(passive[k], i));
        let svd = matrix.svd(true, true);
        let threshold = RANK * svd.singular_values.max();
        let solution = svd.solve(&DVector::from_column_slice(wanted), threshold);
        solution.map(|s| s.iter().copied().collect()).unwrap_or_else(|_| vec![0.0; passive.len()])
    };
    passive.iter().zip(solve(&passive)).for_each(|(&k, w)| weights[k] = w);
    let tolerance = 1e-13 * norm(wanted);
    for _ in 0..3 * columns.len() + 1 {
        let rest: Vec<f64> = (0..wanted.len())
            .map(|i| wanted[i] - passive.iter().map(|&k| weights[k] * unit(k, i)).sum::<f64>())
            .collect();
        let gain = |k: usize| columns[k].sign * dot(&columns[k].gradient, &rest) / lengths[k];
        let entering = (0..columns.len())
            .filter(|k| lengths[*k] > 0.0 && !passive.contains(k))
            .map(|k| (gain(k), k))
            .filter(|(g, _)| *g > tolerance)
            .max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, entering)) = entering else { break };
        passive.push(entering);
        // back to the feasible weights on the way to the unconstrained ones
        loop {
            let target = solve(&passive);
            let bad = |(&k, &t): (&usize, &f64)| !columns[k].free && t <= 0.0;
            if !passive.iter().zip(&target).any(bad) {
                passive.iter().zip(target).for_each(|(&k, t)| weights[k] = t);
                break;
            }
            let share = passive
                .iter()
                .zip(&target)
                .filter(|pair| bad(*pair))
                .map(|(&k, &t)| weights[k] / (weights[k] - t).max(f64::MIN_POSITIVE))
                .fold(1.0, f64::min);
            passive.iter().zip(&target).for_each(|(&k, t)| weights[k] += share * (t - weights[k]));
            let leaves = |k: usize| !columns[k].free && weights[k] <= 1e-15;
            let left: Vec<usize> = passive.iter().copied().filter(|&k| leaves(k)).collect();
            left.iter().for_each(|&k| weights[k] = 0.0);
            passive.retain(|k| !left.contains(k));
            if left.is_empty() {
                break;
            }
        }
    }
    weights.iter().zip(&lengths).map(|(w, l)| if *l > 0.0 { w / l } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn column(gradient: &[f64], free: bool) -> ActiveGradient {
        ActiveGradient { gradient: gradient.to_vec(), sign: 1.0, free }
    }

    #[test]
    fn weights_are_nonnegative_and_optimal() {
        // a vector inside the cone is met exactly
        let columns =
            [column(&[2.0, 0.0, 0.0], false), column(&[1.0, 1.0, 0.0], false), column(&[0.0, 0.0, 1.0], true)];
        let weights = nonnegative_least_squares(&columns, &[3.0, 1.0, -4.0]);
        assert_relative_eq!(weights[..], [1.0, 1.0, -4.0], epsilon = 1e-14);
        // outside, the nearest point of the cone is on a face
        let weights = nonnegative_least_squares(&columns, &[3.0, -1.0, 0.0]);
        assert_relative_eq!(weights[..], [1.5, 0.0, 0.0], epsilon = 1e-14);
        // behind the cone it is the tip
        let weights = nonnegative_least_squares(&columns[..2], &[-3.0, -1.0, 0.0]);
        assert_eq!(weights, [0.0, 0.0]);
    }

    #[test]
    fn random_cones_satisfy_the_conditions_of_a_projection() {
        let mut seed = 7_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        for trial in 0..200 {
            let (n, k) = (2 + trial % 9, 1 + trial % 7);
            let mut columns: Vec<ActiveGradient> = (0..k)
                .map(|j| ActiveGradient {
                    gradient: (0..n).map(|_| random()).collect(),
                    sign: if random() > 0.0 { 1.0 } else { -1.0 },
                    free: j % 3 == 2,
                })
                .collect();
            if trial % 4 == 0 {
                // two constraints that are the same
                let twin = columns[0].gradient.clone();
                columns.push(ActiveGradient { gradient: twin, sign: columns[0].sign, free: false });
            }
            let wanted: Vec<f64> = (0..n).map(|_| random()).collect();
            let weights = nonnegative_least_squares(&columns, &wanted);
            let rest: Vec<f64> = (0..n)
                .map(|i| wanted[i] - columns.iter().zip(&weights).map(|(c, w)| w * c.sign * c.gradient[i]).sum::<f64>())
                .collect();
            for (column, weight) in columns.iter().zip(&weights) {
                let slope = column.sign * dot(&column.gradient, &rest);
                assert!(column.free || *weight >= 0.0);
                if column.free || *weight > 1e-12 {
                    assert!(slope.abs() < 1e-10, "trial {trial}: {slope:e}");
                } else {
                    assert!(slope < 1e-10, "trial {trial}: {slope:e}");
                }
            }
        }
    }
}
