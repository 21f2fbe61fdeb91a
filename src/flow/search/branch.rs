//! Continuation along a branch of solutions through its folds.
//!
//! Where the layer at a nose bursts, or a bubble jumps from one bump of ragged coordinates to the next, the branch of
//! solutions over the angle of attack turns back and forward again. No solution at the next angle is then near the last
//! one, but both lie on one curve. The search follows the arc length of that curve in place of the angle
//! (pseudo-arclength continuation; Keller, "Numerical Solution of Bifurcation and Nonlinear Eigenvalue Problems",
//! 1977).
//!
//! On the way the wake stays where it is at the requested angle, so that the system is linear in the onset flow and the
//! derivative with respect to the angle is the onset flow turned by a right angle.

use super::budget::Budget;
use super::family::{Effort, Equations, Family, Residuals};
use super::neighbour::{Neighbour, temporary_trips};
use super::newton;
use crate::flow::layer::{Change, Layout, Metric, Unknowns};

/// Length of the first step, in the metric of the usual changes of one Newton step.
const FIRST_STEP: f64 = 0.5;
/// Longest step, in the metric of [`FIRST_STEP`].
const LARGEST_STEP: f64 = 2.0;
/// Shortest step, in the metric of [`FIRST_STEP`].
const SMALLEST_STEP: f64 = 0.002;
/// Growth of the step after an easy one.
const LONGER: f64 = 1.6;
/// Work up to which a step counts as easy, in Newton iterations.
const EASY: f64 = 3.2;
/// Factor on the step after a failure.
const SHORTER: f64 = 0.4;
/// Number of steps after a failure before they grow again.
const CAUTION: usize = 2;
/// Work after which a branch is given up, in Newton iterations on the requested stations.
const WORK: f64 = 500.0;
/// Largest number of steps along a branch.
const STEPS: usize = 300;
/// Change of the angle of attack, in degrees, that counts as a step of length one.
const DEGREES: f64 = 1.0;
/// Change of the logarithm of the places of trips that counts as a step of length one.
const LOG_TRIP: f64 = 0.5;
/// Distance behind the start of a branch at which it is given up, in steps of length one.
const BEHIND: f64 = 2.0;
/// Largest number of factorisations in one step.
const FACTORISATIONS: usize = 4;
/// Largest residual of the solutions on the way.
const TOLERANCE: f64 = 1e-4;
/// Residual at which a step is given up.
const LOST: f64 = 30.0;
/// Limits of an attempt to land where the parameter has the requested value.
const LANDING: Effort = Effort { tolerance: 1e-5, iterations: 20, patience: 8, reach: f64::INFINITY, shortest: 0.0 };
/// Contraction of the residuals up to which factors are kept.
const CONTRACTION: f64 = 0.5;
/// Residual below which kept factors are used at all.
const CLOSE: f64 = 1.0;
/// Work of an evaluation of the residuals, over that of an iteration.
const EVALUATION: f64 = 0.3;

/// The parameter that changes along a branch; 0 is the requested value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Parameter {
    /// Angle of attack less the requested one, in degrees.
    Angle,
    /// Logarithm of the distance of temporary trips from the stagnation point over the lengths of the sides.
    Trips,
}

impl Parameter {
    /// Square of the step length that one unit of the parameter counts as.
    fn weight(self) -> f64 {
        match self {
            Self::Angle => DEGREES.powi(-2),
            Self::Trips => LOG_TRIP.powi(-2),
        }
    }

    /// The value of the parameter at a place.
    fn value(self, place: &Neighbour) -> f64 {
        match self {
            Self::Angle => place.turned,
            Self::Trips => place.trips.ln(),
        }
    }

    /// The place with the parameter at `value`.
    pub(super) fn at(self, value: f64, place: &Neighbour) -> Neighbour {
        match self {
            Self::Angle => Neighbour { turned: value, ..*place },
            Self::Trips => Neighbour { trips: value.exp(), ..*place },
        }
    }
}

/// A solution on the branch, or an estimate of one, with the value of the parameter.
#[derive(Clone)]
struct OnBranch {
    unknowns: Unknowns,
    /// Value of the parameter.
    value: f64,
}

/// A direction in which to go from a point.
#[derive(Clone)]
struct Direction {
    change: Change,
    /// Change of the parameter.
    value: f64,
}

/// Follows the branch from a solution at `place` to one where the parameter has the requested value.
pub(super) fn follow<F: Family>(
    family: &F,
    budget: &mut Budget,
    layout: &Layout,
    what: &str,
    from: Unknowns,
    (parameter, place): (Parameter, Neighbour),
) -> Option<Unknowns> {
    let mut branch = Branch::new(family, layout, parameter, place);
    let start = parameter.value(&place);
    let mut at = OnBranch { unknowns: from, value: start };
    let mut heading: Option<Direction> = None;
    let limit = budget.work() + WORK;
    let mut stride = Stride { length: FIRST_STEP, successes: CAUTION };
    for count in 1..=STEPS {
        // a branch that has come back behind its start goes nowhere
        let behind = (at.value.abs() - start.abs()) * parameter.weight().sqrt() > BEHIND;
        if budget.exhausted() || budget.work() > limit || behind {
            break;
        }
        branch.set(at.value);
        let ahead = branch.ahead(&at, heading.as_ref())?;
        budget.spend(1.0, layout);
        let next = stride.take(&mut branch, budget, &at, &ahead)?;
        if next.value == 0.0 || next.value.signum() != at.value.signum() {
            let near = if next.value.abs() < at.value.abs() { &next } else { &at };
            branch.set(0.0);
            let end = newton::solve(&branch.equations(), near.unknowns.clone(), LANDING);
            budget.note(&format!("{what}, {count} steps along the branch"), &end);
            if end.converged {
                return Some(end.unknowns);
            }
        }
        (at, heading) = (next, Some(ahead.direction));
    }
    None
}

/// Length of the next step, and the number of steps since the last failure.
struct Stride {
    /// Length of the next step, in the metric of [`FIRST_STEP`].
    length: f64,
    /// Number of steps since the last failure.
    successes: usize,
}

impl Stride {
    /// Takes a step and shortens it until it succeeds.
    fn take<F: Family>(
        &mut self,
        branch: &mut Branch<F>,
        budget: &mut Budget,
        at: &OnBranch,
        ahead: &Ahead<F>,
    ) -> Option<OnBranch> {
        loop {
            let (next, work) = branch.step(at, ahead, self.length);
            budget.spend(work, branch.layout);
            if next.is_some() {
                self.successes += 1;
                if work <= EASY && self.successes > CAUTION {
                    self.length = (self.length * LONGER).min(LARGEST_STEP);
                }
                return next;
            }
            *self = Self { length: self.length * SHORTER, successes: 0 };
            if self.length < SMALLEST_STEP || budget.exhausted() {
                return None;
            }
        }
    }
}

/// The equations linearised and factorised at some unknowns.
pub(super) struct Jacobian<F: Family> {
    at: F::At,
    factors: F::Factors,
    /// Change of the unknowns per change of the parameter.
    pub by_value: Change,
}

/// The curve of solutions, at one value of the parameter.
pub(super) struct Branch<'a, F: Family> {
    family: &'a F,
    parameter: Parameter,
    place: Neighbour,
    outer: F::Outer,
    trips: [Option<f64>; 2],
    layout: &'a Layout,
}

impl<'a, F: Family> Branch<'a, F> {
    pub fn new(family: &'a F, layout: &'a Layout, parameter: Parameter, place: Neighbour) -> Self {
        let outer = family.turned(place.turned.to_radians());
        Self { family, parameter, place, outer, trips: temporary_trips(family, place.trips), layout }
    }

    /// Moves the outer flow or the trips to a value of the parameter.
    pub fn set(&mut self, value: f64) {
        self.place = self.parameter.at(value, &self.place);
        match self.parameter {
            Parameter::Angle => self.family.turn(&mut self.outer, value.to_radians()),
            Parameter::Trips => self.trips = temporary_trips(self.family, self.place.trips),
        }
    }

    /// The equations at the current value of the parameter.
    pub fn equations(&self) -> F::Equations<'_> {
        self.family.equations(&self.outer, self.layout, self.trips)
    }

    /// Linearises and factorises the equations; `None` where they are singular.
    pub fn jacobian(&self, unknowns: &Unknowns) -> Option<Jacobian<F>> {
        let equations = self.equations();
        let at = equations.linearise(unknowns);
        let factors = equations.factorise(&at)?;
        let by_value = self.by_parameter(&equations, &at, &factors);
        by_value.is_finite().then_some(Jacobian { at, factors, by_value })
    }

    /// Minus the inverse Jacobian times the derivative of the residuals with respect to the parameter.
    fn by_parameter<E: Equations>(&self, equations: &E, at: &E::At, factors: &E::Factors) -> Change {
        match self.parameter {
            Parameter::Angle => {
                let mut change = equations.by_angle(at, factors);
                change.stretch(1f64.to_radians());
                change
            }
            Parameter::Trips => {
                let wanted = self.family.trips();
                // a temporary trip moves by its own distance from the stagnation point
                let rates = [0, 1].map(|side| match self.trips[side] {
                    Some(arc) if wanted[side] != Some(arc) => arc - self.family.stagnation(),
                    _ => 0.0,
                });
                equations.by_trips(at, factors, rates)
            }
        }
    }

    /// The way on from a point: onward from `heading`, or at the start towards the requested condition.
    fn ahead(&self, at: &OnBranch, heading: Option<&Direction>) -> Option<Ahead<F>> {
        let jacobian = self.jacobian(&at.unknowns)?;
        let by_value = &jacobian.by_value;
        let metric = Metric::new(self.equations().layer(), &at.unknowns);
        let weight = self.parameter.weight();
        let length = (metric.dot(by_value, by_value) + weight).sqrt();
        let onward = match heading {
            Some(last) => metric.dot(&last.change, by_value) + last.value * weight,
            None => -at.value,
        };
        let factor = onward.signum() / length;
        let mut direction = Direction { change: by_value.clone(), value: factor };
        direction.change.stretch(factor);
        Some(Ahead { jacobian, direction, metric })
    }

    /// The next solution, found by a step along `ahead` and then across it, and the work that took.
    fn step(&mut self, from: &OnBranch, ahead: &Ahead<F>, length: f64) -> (Option<OnBranch>, f64) {
        let direction = &ahead.direction;
        let start = self.equations().layer().carried(&from.unknowns, &direction.change, length);
        let start = OnBranch { unknowns: start, value: from.value + length * direction.value };
        let mut work = 0.0;
        let mut settled = self.settle(start, ahead, &ahead.jacobian, &mut work);
        for _ in 0..FACTORISATIONS {
            let mut at = match settled {
                Settled::Done(at) => return (Some(at), work),
                Settled::Lost => return (None, work),
                Settled::Slow(at) => at,
            };
            self.set(at.value);
            work += 1.0;
            let Some((jacobian, change, value)) = self.newton_across(ahead, &at.unknowns) else { return (None, work) };
            let equations = self.equations();
            let layer = equations.layer();
            let factor = layer.admissible_factor(&layer.profiles(&at.unknowns), &at.unknowns, &change);
            at.unknowns = layer.carried(&at.unknowns, &change, factor);
            at.value += factor * value;
            drop(equations);
            settled = self.settle(at, ahead, &jacobian, &mut work);
        }
        match settled {
            Settled::Done(at) => (Some(at), work),
            _ => (None, work),
        }
    }

    /// A Jacobian at some unknowns, and Newton's step with it across the direction: the changes of the unknowns and of
    /// the parameter.
    fn newton_across(&self, ahead: &Ahead<F>, unknowns: &Unknowns) -> Option<(Jacobian<F>, Change, f64)> {
        let jacobian = self.jacobian(unknowns)?;
        let equations = self.equations();
        let residuals = equations.residuals_at(&jacobian.at);
        let straight = equations.solve(&jacobian.at, &jacobian.factors, residuals);
        let (change, value) = self.across(ahead, straight, &jacobian.by_value)?;
        Some((jacobian, change, value))
    }

    /// Newton's method across the direction with the given factors, as long as they reduce the residuals well.
    fn settle(&mut self, mut at: OnBranch, ahead: &Ahead<F>, jacobian: &Jacobian<F>, work: &mut f64) -> Settled {
        let mut before = f64::INFINITY;
        loop {
            self.set(at.value);
            let equations = self.equations();
            let state = equations.evaluate(&at.unknowns);
            let residuals = equations.residuals_of(&state);
            *work += EVALUATION;
            let largest = residuals.largest();
            if largest < TOLERANCE {
                return Settled::Done(at);
            }
            if !(largest < LOST) {
                return Settled::Lost;
            }
            if !(largest < CONTRACTION * before.min(CLOSE)) {
                return Settled::Slow(at);
            }
            before = largest;
            let straight = equations.solve(&jacobian.at, &jacobian.factors, residuals);
            let Some((change, value)) = self.across(ahead, straight, &jacobian.by_value) else {
                return Settled::Lost;
            };
            at.unknowns = equations.layer().carried(&at.unknowns, &change, 1.0);
            at.value += value;
        }
    }

    /// Turns Newton's step `change` at a fixed parameter into one that leads across the direction: the changes of the
    /// unknowns and of the parameter.
    fn across(&self, ahead: &Ahead<F>, mut change: Change, by_value: &Change) -> Option<(Change, f64)> {
        let Ahead { direction, metric, .. } = ahead;
        let along = metric.dot(&direction.change, by_value) + direction.value * self.parameter.weight();
        let value = -metric.dot(&direction.change, &change) / along;
        change.add(by_value, value);
        change.is_finite().then_some((change, value))
    }
}

/// How far Newton's method came with one set of factors.
enum Settled {
    /// The residuals are below the tolerance.
    Done(OnBranch),
    /// The residuals no longer fall as they should.
    Slow(OnBranch),
    /// The residuals are too large, or the equations are singular.
    Lost,
}

/// The way on from a point of the curve.
struct Ahead<F: Family> {
    jacobian: Jacobian<F>,
    /// Unit tangent.
    direction: Direction,
    metric: Metric,
}
