//! Steps of Newton's method with factors that are kept.
//!
//! A step with kept factors costs a fifth of one with new ones. The steps tell how the system has changed since it was
//! linearised: Broyden's method corrects the factors by them, as far as the steps reach.
//!
//! Source: Kelley, "Iterative Methods for Linear and Nonlinear Equations", SIAM (1995), section 7.3.

use super::geometry::Geometry;
use super::limits::{Factor, Limits, inside, limit};
use super::numbering::Unknowns;
use super::system::{Linearised, Problem, Residuals};

/// Largest number of steps with the same factors.
const STEPS: usize = 12;
/// Largest number of further steps that are expected to be enough. More cost as much as new factors and a step with them,
/// which are better ones for the adjoint and for the next flow of a design.
const EXPECTED: f64 = 3.0;
/// Largest ratio of the residuals after and before a step that is expected to lead anywhere.
const RATIO: f64 = 0.4;
/// With the factors of a neighbour: the largest ratio of the residuals with which the iteration may end, and the residual
/// at which new factors are made otherwise. Those are then good ones for the adjoint.
const NEIGHBOUR: (f64, f64) = (0.03, 1e-5);
/// With the factors of a neighbour: the largest ratio that is expected to lead anywhere, and the largest number of steps to
/// that residual at the last ratio. The ratio falls from step to step as the steps tell more of the system.
const APPROACH: (f64, f64) = (0.7, 12.0);
/// Largest change of any unknown, and largest residual after it, of a flow that is converged to round-off.
pub(super) const ROUND_OFF: f64 = 1e-9;
/// Largest share of a step in the one before that is corrected.
const SHARE: f64 = 0.7;

/// Factors with the steps that have been made with them.
pub(super) struct Chords<'a> {
    pub problem: &'a Problem,
    pub at: &'a Linearised,
    pub limits: &'a Limits,
    steps: Vec<Unknowns>,
    /// The residual before the last step.
    before: Option<f64>,
    /// Whether the factors are those of the flow itself.
    own: bool,
}

impl<'a> Chords<'a> {
    /// Factors of a neighbouring flow.
    pub fn of_neighbour(problem: &'a Problem, at: &'a Linearised, limits: &'a Limits) -> Self {
        Self { problem, at, limits, steps: Vec::new(), before: None, own: false }
    }

    /// Factors with which a step from the residual `before` has been made.
    pub fn after(problem: &'a Problem, at: &'a Linearised, limits: &'a Limits, step: Unknowns, before: f64) -> Self {
        Self { problem, at, limits, steps: vec![step], before: Some(before), own: true }
    }

    /// Goes on to a residual below the tolerance, which is the result, where that costs less than new factors. The unknowns
    /// are the best that were found, and `geometry` is theirs where it is known.
    pub fn finish(mut self, unknowns: &mut Unknowns, geometry: &mut Option<Geometry<f64>>) -> Option<f64> {
        let mut last = None;
        for number in 0..=STEPS {
            let residuals = self.problem.residuals(unknowns, geometry);
            let residual = residuals.as_ref().map_or(f64::NAN, Residuals::largest);
            if residual < self.limits.tolerance {
                return Some(residual);
            }
            // what such steps do not change any more is converged to round-off
            if number > 0 && self.is_round_off(residual) {
                return Some(residual);
            }
            // written so that NaN goes back
            if let Some(last) = last
                && !self.before.is_some_and(|before| residual < before)
            {
                *unknowns = last;
                *geometry = None;
                return None;
            }
            if number == STEPS || !self.is_worth_while(number, residual) {
                return None;
            }
            let (next, of_next) = self.next(unknowns, &residuals?)?;
            *geometry = Some(of_next);
            last = Some(std::mem::replace(unknowns, next));
            self.before = Some(residual);
        }
        None
    }

    /// Whether another step is expected to lead to the end for less than new factors, or to a better place for them.
    fn is_worth_while(&self, number: usize, residual: f64) -> bool {
        let Some(before) = self.before else { return residual.is_finite() };
        // a step with old factors leaves about twice as much as the one for which they were made
        let ratio = if self.own && number == 0 { 2.0 } else { 1.0 } * residual / before;
        let further = (self.limits.tolerance / residual).ln() / ratio.ln();
        let (good, close) = NEIGHBOUR;
        if self.own || ratio < good {
            return ratio < RATIO && further <= EXPECTED;
        }
        let (largest, steps) = APPROACH;
        ratio < largest && residual > close && (close / residual).ln() / ratio.ln() <= steps
    }

    /// Whether a residual does not fall any more because the last step was one of round-off.
    fn is_round_off(&self, residual: f64) -> bool {
        let still = self.before.is_some_and(|before| residual > RATIO * before);
        let tiny = self.steps.last().is_some_and(|step| step.largest() < ROUND_OFF);
        self.own && still && tiny && residual <= ROUND_OFF
    }

    /// The unknowns after the next step, with their geometry; `None` where it would have to be cut.
    fn next(&mut self, unknowns: &Unknowns, residuals: &Residuals<f64>) -> Option<(Unknowns, Geometry<f64>)> {
        let change = self.corrected(self.at.band.step(&residuals.stations, &residuals.globals)?)?;
        let mut factor = Factor::full();
        limit(self.problem, unknowns, &change, self.limits.relaxed, &mut factor);
        let next = inside(self.problem, unknowns, &change, &self.at.areas, &mut factor);
        self.steps.push(change);
        next.filter(|_| factor.is_full())
    }

    /// A step that is corrected by those before; `None` where the correction is too large or not finite.
    fn corrected(&self, mut change: Unknowns) -> Option<Unknowns> {
        for pair in self.steps.windows(2) {
            let share = pair[0].product(&change) / pair[0].product(&pair[0]);
            change = change.stepped(&pair[1], share);
        }
        if let Some(last) = self.steps.last() {
            let share = last.product(&change) / last.product(last);
            // written so that NaN has no correction
            if !(share.abs() < SHARE) {
                return None;
            }
            let unscaled = change.clone();
            change = change.stepped(&unscaled, (1.0 - share).recip() - 1.0);
        }
        change.largest().is_finite().then_some(change)
    }
}
