//! Sequential quadratic programming in a trust region, for few evaluations.
//!
//! Every iteration minimises a quadratic model of the Lagrangian under the linearised constraints and bounds, and costs
//! one evaluation, rarely two. The parts:
//!
//! * **Units.** Free variables count in natural steps ([`Problem::natural_steps`]), rows of constraints by their
//!   steepest gradient, so that a run does not depend on how objective and variables are scaled. Variables with equal
//!   bounds are left out.
//! * **Step.** What the linearised constraints lack has a price, so that every model has a solution. The price is ten
//!   times the norm of the gradient and raised only where the model says that more relief can be had (Byrd, Nocedal and
//!   Waltz 2008). Steps are no longer than a radius in the metric of the problem ([`Problem::metric`]), for a
//!   free-form box the relative change of its cells.
//! * **Bend.** Constraints that take no evaluation ([`Problem::known_constraints`]) are followed to the end of a step
//!   before it is tried, and a step that they would spoil is bent back onto them.
//! * **Judgement.** A merit function with prices from the multipliers decides. Two things stand beside it: a funnel,
//!   a bound of the violation that narrows as the run goes on (Gould and Toint 2010), by the gradients of the constraints
//!   and by their own units, and a few steps in a row that lower the objective as predicted though the merit function
//!   rises, against the effect of Maratos. A step that is refused is tried again with the curvature of the constraints
//!   taken into account.
//! * **Curvature.** Damped BFGS that begins with too little curvature, in the shape that the problem takes for likely
//!   ([`Problem::likely_curvature`]), lowers what it does not know where a step finds less than modelled, and learns from
//!   refused steps as well. All steps are remembered with the changes of all gradients, and the model is made anew from
//!   them with every change of the multipliers; later in a run it goes through the latest steps twice.
//! * **Leaps.** A refused step that is short, and whose values differ by more than the derivatives at either end tell, has
//!   crossed a leap of the analysis. Several of them without a gain end the run, which says where the leap is.
//! * **Margins.** Inequalities that are violated or active at the start keep a distance at first, which shrinks: the
//!   way there otherwise ends on a limit from which the run does not come back. A margin is never wider than half of
//!   what its constraint has been seen to allow.

mod bend;
mod curvature;
mod finish;
mod frame;
pub(in crate::optimize) mod leap;
mod proposal;
mod quadratic;
mod rows;
mod state;
mod trial;

use super::ledger::Ledger;
use super::optimizer::{Limits, Optimizer};
use super::outcome::{OptimizeError, Outcome, Progress, Termination};
use super::redundancy;
use super::scope::Scope;
use super::settings::Setting;
use super::verdict;
use super::watch::{Ending, Watch};
use crate::design::Problem;
use finish::{restore, retreat, settle};
use frame::Frame;
use state::SqpRun;
use std::ops::ControlFlow;
use trial::advance;

/// Sequential quadratic programming for problems with equality, one- and two-sided constraints and bounds.
///
/// The run has converged where every constraint is met within [`feasibility_tolerance`](Self::feasibility_tolerance)
/// and the [KKT residual](Outcome::kkt_residual), which is relative to the objective, is at most
/// [`optimality_tolerance`](Self::optimality_tolerance). A failed analysis is a refused step. Where no constraint can
/// be met any better the run ends as [`Termination::Infeasible`] and the message names what stands against what.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sqp {
    /// KKT residual at which the run has converged: the relative change of the objective that a hundredth of a natural
    /// step of a variable could still bring.
    pub optimality_tolerance: f64,
    /// Largest violation of a constraint, in its own unit, that counts as none.
    pub feasibility_tolerance: f64,
    /// Length of a step along the negative gradient at the start, in natural steps of the variables: the first guess of
    /// the curvature, better too long than too short.
    pub first_step: f64,
    /// Longest step at the start, in the metric of the problem with the variables in natural steps.
    pub radius: f64,
    /// Iterations without progress after which the run has stalled.
    pub patience: usize,
    /// Limits of the run.
    pub limits: Limits,
}

impl Default for Sqp {
    fn default() -> Self {
        Self {
            optimality_tolerance: 1e-6,
            feasibility_tolerance: 1e-9,
            first_step: 4.0,
            radius: 1.0,
            patience: 30,
            limits: Limits::default(),
        }
    }
}

impl Sqp {
    /// The name in case files.
    pub const NAME: &'static str = "sqp";
    pub(super) const SCOPE: Scope = Scope { method: Self::NAME, constraints: true, dense: true };

    /// Violation of a constraint that says it cannot be met, rather than that it was not met so closely.
    fn missed(&self) -> f64 {
        self.feasibility_tolerance.max(1e-6)
    }

    fn settings(&self) -> [Setting; 5] {
        let [optimality, feasibility] = Setting::of_constraints(self.optimality_tolerance, self.feasibility_tolerance);
        [
            optimality,
            feasibility,
            Setting::count("patience", self.patience),
            Setting::positive("first_step", self.first_step),
            Setting::positive("radius", self.radius),
        ]
    }
}

impl Optimizer for Sqp {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn minimize(
        &self,
        problem: &mut dyn Problem,
        observer: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    ) -> Result<Outcome, OptimizeError> {
        Self::SCOPE.check(problem, self.limits, &self.settings())?;
        let ledger = Ledger::new(problem, observer, self.limits);
        let mut ledger = ledger.feasible_within(self.feasibility_tolerance).measured();
        let verdict = solve(&mut ledger, self);
        Ok(ledger.close(verdict))
    }
}

/// Violation below which an optimal point is brought onto the constraints by the shortest way.
const NEARLY_MET: f64 = 3e-3;

fn begin(ledger: &mut Ledger<'_>, settings: &Sqp) -> Result<SqpRun, (Termination, String)> {
    let start = ledger.start_in_bounds();
    let frame = Frame::new(ledger);
    let evaluation = ledger.evaluate(&start).map_err(|failure| verdict::fails_at_start(&failure.reason))?;
    Ok(SqpRun::new(ledger, frame, &start, evaluation).stepping(settings.first_step, settings.radius))
}

fn solve(ledger: &mut Ledger<'_>, settings: &Sqp) -> (Termination, String) {
    let mut run = match begin(ledger, settings) {
        Ok(run) => run,
        Err(verdict) => return verdict,
    };
    let (optimality, feasibility) = (settings.optimality_tolerance, settings.feasibility_tolerance);
    let mut watch = Watch::new(feasibility, settings.patience);
    let mut missed_by = f64::INFINITY;
    loop {
        let wanted = optimality * ledger.unit(&run.point.evaluation);
        match watch.judge(ledger, &run.point, wanted) {
            None => {}
            Some(Ending::Optimal) => {
                ledger.settle_on(&run.point.x, &run.point.evaluation);
                // the constraints that hold may be off by what their multipliers let pass
                if run.slack() > feasibility {
                    settle(ledger, &mut run, optimality, feasibility);
                }
                return (Termination::Converged, verdict::converged(ledger, &run.point));
            }
            Some(Ending::OutOfIterations) => {
                let point = retreat(ledger, &mut run, feasibility);
                return (Termination::IterationLimit, verdict::out_of_iterations(ledger, &point));
            }
            Some(Ending::Stalled) => {
                if afresh(&mut run, settings, &mut missed_by) {
                    watch.begin_again(ledger.iteration);
                    continue;
                }
                let point = retreat(ledger, &mut run, feasibility);
                return verdict::at_rest(ledger, &point, settings.missed());
            }
        }
        // an optimal point that misses the constraints only needs to get onto them
        let optimal = run.point.optimality.residual <= wanted;
        if optimal && redundancy::misses_only_constants(ledger, &run.point, feasibility) {
            let point = ledger.handed_out(&run.point);
            return verdict::at_rest(ledger, &point, settings.missed());
        }
        let nearly = optimal && run.point.violation < NEARLY_MET && restore(ledger, &mut run);
        let advanced = if nearly { Some(()) } else { advance(ledger, &mut run) };
        match advanced {
            Some(()) => ledger.iteration += 1,
            None if ledger.halted().is_some() => return (Termination::Interrupted, String::new()),
            None if let Some(leap) = run.leaps.ending() => {
                let point = ledger.handed_out(&run.point);
                return verdict::leaping(ledger, &point, leap);
            }
            None if ledger.last_failed() => return verdict::beset(ledger, &ledger.handed_out(&run.point)),
            None if afresh(&mut run, settings, &mut missed_by) => watch.begin_again(ledger.iteration),
            None => {
                let point = retreat(ledger, &mut run, feasibility);
                return verdict::at_rest(ledger, &point, settings.missed());
            }
        }
    }
}

/// Share of a violation below which it has fallen enough since the last fresh start to be worth another.
const WORTH: f64 = 0.9;

/// Starts afresh from a point that misses its constraints, before it is said that they cannot be met: the curvature that
/// constraints have far from here, times prices that were raised since, can bar the way to them. `missed_by` is the
/// violation at the last fresh start.
fn afresh(run: &mut SqpRun, settings: &Sqp, missed_by: &mut f64) -> bool {
    let violation = run.point.violation;
    if violation <= settings.missed() || violation > WORTH * *missed_by {
        return false;
    }
    *missed_by = violation;
    run.begin_again(settings.first_step, settings.radius);
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::differentiate::VectorFunction;
    use crate::optimize::testcases::Constrained;
    use crate::scalar::Scalar;
    use std::convert::Infallible;

    /// `x² + y²` where `x + y` has to be 2.
    struct Far;

    impl VectorFunction for Far {
        type Error = Infallible;
        fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, Infallible> {
            Ok(vec![x[0] * x[0] + x[1] * x[1], x[0] + x[1]])
        }
    }

    #[test]
    fn a_run_begins_afresh_where_constraints_are_missed_and_only_while_that_helps() {
        let settings = Sqp::default();
        let mut problem = Constrained::new(Far, &[0.5, 0.5], &[(2.0, f64::INFINITY)]);
        let mut observer = |_: &Progress<'_>| ControlFlow::Continue(());
        let mut ledger = Ledger::new(&mut problem, &mut observer, Limits::default());
        let Ok(mut run) = begin(&mut ledger, &settings) else { panic!("no start") };
        let mut missed_by = f64::INFINITY;
        (run.radius, run.price, run.relaxed, run.funnel) = (1e-3, 1e6, 2, 1e-2);
        run.rows.iter_mut().for_each(|row| (row.margin, row.weight) = (0.1, 5.0));
        assert!(afresh(&mut run, &settings, &mut missed_by));
        assert_eq!((missed_by, run.radius, run.price, run.relaxed), (1.0, settings.radius, 0.0, 0));
        assert!(run.funnel >= 1.0 && run.rows.iter().all(|row| (row.margin, row.weight) == (0.0, 0.0)));
        // another time only where a tenth of the violation has gone since
        assert!(!afresh(&mut run, &settings, &mut missed_by));
        run.point.violation = 0.91;
        assert!(!afresh(&mut run, &settings, &mut missed_by));
        run.point.violation = 0.89;
        assert!(afresh(&mut run, &settings, &mut missed_by));
        assert_eq!(missed_by, 0.89);
        // what is met as closely as it is asked for needs no fresh start
        run.point.violation = 1e-7;
        assert!(!afresh(&mut run, &settings, &mut missed_by));
    }
}
