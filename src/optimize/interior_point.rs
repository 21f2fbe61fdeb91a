//! The interior-point method of IPOPT, as the crate `pounce-rs` ports it, behind the feature `interior-point`.
//!
//! The solver owns the functions that it calls, so it runs on a thread of its own that asks for evaluations; the thread of
//! the caller answers them, judges each point by the measure of the other methods and ends the run.

use super::kkt::Iterate;
use super::ledger::Ledger;
use super::optimizer::{Limits, Optimizer};
use super::outcome::{OptimizeError, Outcome, Progress, Termination};
use super::scope::Scope;
use super::settings::Setting;
use super::verdict;
use crate::design::{Evaluation, Problem, ProblemDescription};
use pounce_rs::prelude::{
    BoundsInfo, IndexStyle, IpoptApplication, IpoptCq, IpoptData, NlpInfo, Solution, SparsityRequest, StartingPoint,
    TNLP,
};
use std::cell::RefCell;
use std::ops::ControlFlow;
use std::rc::Rc;
use std::sync::mpsc::{Receiver, Sender, channel};

/// The interior-point method of Wächter and Biegler (Math. Program. 106, 2006) with limited-memory BFGS, for problems
/// with equality, one- and two-sided constraints and bounds.
///
/// The run has converged at the first point that it evaluates where every constraint is met within
/// [`feasibility_tolerance`](Self::feasibility_tolerance) and the [KKT residual](Outcome::kkt_residual) is at most
/// [`optimality_tolerance`](Self::optimality_tolerance). A failed analysis shortens the step. [`Sqp`](super::Sqp) needs
/// fewer evaluations on most drag cases; this method is here for comparison and for problems on which the other fails.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InteriorPoint {
    /// KKT residual at which the run has converged: the relative change of the objective that a hundredth of a natural
    /// step of a variable could still bring.
    pub optimality_tolerance: f64,
    /// Largest violation of a constraint, in its own unit, that counts as none.
    pub feasibility_tolerance: f64,
    /// Pairs of steps and changes of gradients that the curvature is made from.
    pub memory: usize,
    /// Limits of the run.
    pub limits: Limits,
}

impl Default for InteriorPoint {
    fn default() -> Self {
        Self { optimality_tolerance: 1e-6, feasibility_tolerance: 1e-9, memory: 40, limits: Limits::default() }
    }
}

/// Tolerance that the solver itself has: far below what ends a run here.
const SOLVER_TOLERANCE: f64 = 1e-11;
/// Largest number that counts as a bound.
const UNBOUNDED: f64 = 2e19;

impl InteriorPoint {
    /// The name in results.
    pub const NAME: &'static str = "interior-point";
    pub(super) const SCOPE: Scope = Scope { method: Self::NAME, constraints: true, dense: true };

    fn settings(&self) -> [Setting; 3] {
        let [optimality, feasibility] = Setting::of_constraints(self.optimality_tolerance, self.feasibility_tolerance);
        [optimality, feasibility, Setting::count("memory", self.memory)]
    }
}

impl Optimizer for InteriorPoint {
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

fn solve(ledger: &mut Ledger<'_>, settings: &InteriorPoint) -> (Termination, String) {
    let description = ledger.description().clone();
    let start = ledger.start_in_bounds();
    let first = match ledger.evaluate(&start) {
        Ok(evaluation) => evaluation,
        Err(failure) => return verdict::fails_at_start(&failure.reason),
    };
    let steps = ledger.natural_steps().unwrap_or_else(|| vec![1.0; start.len()]);
    let unit = ledger.unit(&first);
    let point = Iterate::new(ledger, &start, first.clone());
    if let Some(verdict) = optimal(ledger, settings, &point) {
        return verdict;
    }
    let (ask, asked) = channel();
    let (answer, answers) = channel();
    let functions =
        Functions { description, steps, unit, start: start.clone(), latest: Some((start, first)), ask, answers };
    let memory = settings.memory;
    std::thread::scope(|scope| {
        let builder = std::thread::Builder::new().name(InteriorPoint::NAME.into());
        let spawned = builder.spawn_scoped(scope, move || drive(functions, memory));
        if let Err(error) = spawned {
            return (Termination::Failed, format!("The thread of the solver cannot be started: {error}."));
        }
        // the solver sees the end of the channels where the run ends, and returns
        serve(ledger, settings, point, &asked, answer)
    })
}

/// Something that the solver tells the thread of the caller.
enum Message {
    /// It wants an evaluation.
    Evaluate(Vec<f64>),
    /// It begins another iteration.
    Iteration,
}

/// Answers the solver until the run ends.
fn serve(
    ledger: &mut Ledger<'_>,
    settings: &InteriorPoint,
    mut point: Iterate,
    asked: &Receiver<Message>,
    answer: Sender<Option<Evaluation>>,
) -> (Termination, String) {
    while let Ok(message) = asked.recv() {
        let x = match message {
            Message::Evaluate(x) => x,
            Message::Iteration if ledger.out_of_iterations() => {
                let end = ledger.handed_out(&point);
                return (Termination::IterationLimit, verdict::out_of_iterations(ledger, &end));
            }
            Message::Iteration => {
                ledger.iteration += 1;
                continue;
            }
        };
        let found = ledger.evaluate(&x).ok();
        if ledger.halted().is_some() {
            // the ledger words it
            return (Termination::Interrupted, String::new());
        }
        if let Some(evaluation) = &found {
            point = Iterate::new(ledger, &x, evaluation.clone());
            if let Some(verdict) = optimal(ledger, settings, &point) {
                return verdict;
            }
        }
        if answer.send(found).is_err() {
            break;
        }
    }
    if ledger.last_failed() {
        return verdict::beset(ledger, &ledger.handed_out(&point));
    }
    verdict::at_rest(ledger, &ledger.handed_out(&point), settings.feasibility_tolerance)
}

fn optimal(ledger: &mut Ledger<'_>, settings: &InteriorPoint, point: &Iterate) -> Option<(Termination, String)> {
    let wanted = settings.optimality_tolerance * ledger.unit(&point.evaluation);
    if point.violation > settings.feasibility_tolerance || point.optimality.residual > wanted {
        return None;
    }
    ledger.settle_on(&point.x, &point.evaluation);
    Some((Termination::Converged, verdict::converged(ledger, point)))
}

/// Runs the solver to its end.
fn drive(functions: Functions, memory: usize) {
    let mut solver = IpoptApplication::new();
    if solver.initialize().is_err() {
        return;
    }
    let options = solver.options_mut();
    let memory = i32::try_from(memory).unwrap_or(i32::MAX);
    let set = [
        options.set_string_value("hessian_approximation", "limited-memory", true, true),
        options.set_string_value("presolve", "no", true, true),
        options.set_integer_value("limited_memory_max_history", memory, true, true),
        options.set_integer_value("print_level", 0, true, true),
        options.set_integer_value("max_iter", i32::MAX, true, true),
        options.set_numeric_value("tol", SOLVER_TOLERANCE, true, true),
        // constraints are met as closely as they were asked for
        options.set_numeric_value("bound_relax_factor", 0.0, true, true),
    ];
    if set.iter().any(Result::is_err) {
        return;
    }
    // whatever it says of the end, the points have been judged
    let _ = solver.optimize_tnlp(Rc::new(RefCell::new(functions)));
}

/// The functions as the solver sees them: variables in natural steps, the objective in units of that at the start.
struct Functions {
    description: ProblemDescription,
    steps: Vec<f64>,
    unit: f64,
    start: Vec<f64>,
    latest: Option<(Vec<f64>, Evaluation)>,
    ask: Sender<Message>,
    answers: Receiver<Option<Evaluation>>,
}

impl Functions {
    /// The evaluation at a point of the solver; `None` where there is none or the run has ended.
    fn at(&mut self, z: &[f64]) -> Option<&Evaluation> {
        let bounds = &self.description.variable_bounds;
        // bounds are relaxed by round-off in there
        let x: Vec<f64> =
            (0..z.len()).map(|k| (z[k] * self.steps[k]).max(bounds[k].lower).min(bounds[k].upper)).collect();
        if self.latest.as_ref().is_none_or(|(known, _)| *known != x) {
            self.latest = None;
            self.ask.send(Message::Evaluate(x.clone())).ok()?;
            let evaluation = self.answers.recv().ok()??;
            self.latest = Some((x, evaluation));
        }
        self.latest.as_ref().map(|(_, evaluation)| evaluation)
    }
}

fn index(n: usize) -> i32 {
    i32::try_from(n).unwrap_or(i32::MAX)
}

impl TNLP for Functions {
    fn get_nlp_info(&mut self) -> Option<NlpInfo> {
        let (n, m) = (self.start.len(), self.description.constraint_bounds.len());
        Some(NlpInfo { n: index(n), m: index(m), nnz_jac_g: index(n * m), nnz_h_lag: 0, index_style: IndexStyle::C })
    }

    fn get_bounds_info(&mut self, bounds: BoundsInfo<'_>) -> bool {
        for (k, (b, step)) in self.description.variable_bounds.iter().zip(&self.steps).enumerate() {
            bounds.x_l[k] = (b.lower / step).max(-UNBOUNDED);
            bounds.x_u[k] = (b.upper / step).min(UNBOUNDED);
        }
        for (k, b) in self.description.constraint_bounds.iter().enumerate() {
            bounds.g_l[k] = b.lower.max(-UNBOUNDED);
            bounds.g_u[k] = b.upper.min(UNBOUNDED);
        }
        true
    }

    fn get_starting_point(&mut self, start: StartingPoint<'_>) -> bool {
        (0..self.start.len()).for_each(|k| start.x[k] = self.start[k] / self.steps[k]);
        true
    }

    fn eval_f(&mut self, x: &[f64], _new_x: bool) -> Option<f64> {
        let unit = self.unit;
        self.at(x).map(|evaluation| evaluation.objective / unit)
    }

    fn eval_grad_f(&mut self, x: &[f64], _new_x: bool, gradient: &mut [f64]) -> bool {
        let (unit, steps) = (self.unit, self.steps.clone());
        let Some(evaluation) = self.at(x) else { return false };
        (0..x.len()).for_each(|k| gradient[k] = evaluation.gradient[k] * steps[k] / unit);
        true
    }

    fn eval_g(&mut self, x: &[f64], _new_x: bool, values: &mut [f64]) -> bool {
        let Some(evaluation) = self.at(x) else { return false };
        values.copy_from_slice(&evaluation.constraints);
        true
    }

    fn eval_jac_g(&mut self, x: Option<&[f64]>, _new_x: bool, mode: SparsityRequest<'_>) -> bool {
        let n = self.start.len();
        match (mode, x) {
            (SparsityRequest::Structure { irow, jcol }, _) => {
                for (place, (row, column)) in irow.iter_mut().zip(jcol).enumerate() {
                    (*row, *column) = (index(place / n), index(place % n));
                }
                true
            }
            (SparsityRequest::Values { values }, Some(x)) => {
                let steps = self.steps.clone();
                let Some(evaluation) = self.at(x) else { return false };
                let entries = evaluation.jacobian.iter().flat_map(|row| row.iter().zip(&steps).map(|(g, s)| g * s));
                values.iter_mut().zip(entries).for_each(|(value, entry)| *value = entry);
                true
            }
            (SparsityRequest::Values { .. }, None) => false,
        }
    }

    fn finalize_solution(&mut self, _: Solution<'_>, _: &IpoptData, _: &IpoptCq) {}

    fn intermediate_callback(&mut self, _: pounce_rs::IterStats, _: &IpoptData, _: &IpoptCq) -> bool {
        self.ask.send(Message::Iteration).is_ok()
    }
}

#[cfg(test)]
mod tests {
    use super::super::testcases::*;
    use super::*;
    use crate::differentiate::VectorFunction;
    use crate::scalar::Scalar;
    use std::convert::Infallible;

    /// Hock and Schittkowski's problem 71: optimum 17.0140173.
    #[derive(Clone)]
    struct Problem71;

    impl VectorFunction for Problem71 {
        type Error = Infallible;
        fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, Infallible> {
            let squares = x.iter().map(|x| *x * *x).sum();
            Ok(vec![x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2], x[0] * x[1] * x[2] * x[3], squares])
        }
    }

    fn problem() -> Constrained<Problem71> {
        Constrained::new(Problem71, &[1.0, 5.0, 5.0, 1.0], &[(25.0, f64::INFINITY), (40.0, 40.0)]).bounded(1.0, 5.0)
    }

    #[test]
    fn a_published_problem_is_solved() {
        let outcome = run(&InteriorPoint::default(), &mut problem());
        assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
        assert!((outcome.evaluation.unwrap().objective - 17.0140173).abs() < 1e-5);
        assert!(outcome.evaluations <= 40 && outcome.iterations > 3, "{} {}", outcome.evaluations, outcome.iterations);
        assert!(outcome.kkt_residual <= 1e-6);
    }

    #[test]
    fn limits_and_failures_end_a_run_with_their_reason() {
        let limits = Limits { evaluations: 4, iterations: usize::MAX };
        let outcome = run(&InteriorPoint { limits, ..InteriorPoint::default() }, &mut problem());
        assert_eq!((outcome.status, outcome.evaluations), (Termination::EvaluationLimit, 4));
        let limits = Limits { evaluations: 1000, iterations: 2 };
        let outcome = run(&InteriorPoint { limits, ..InteriorPoint::default() }, &mut problem());
        assert_eq!((outcome.status, outcome.iterations), (Termination::IterationLimit, 2));
        let outcome = run(&InteriorPoint::default(), &mut problem().failing(|_| true));
        assert_eq!((outcome.status, outcome.evaluations), (Termination::Failed, 1));
        let outcome = run(&InteriorPoint::default(), &mut problem().failing(|x| x[0] > 1.02));
        assert!(outcome.failures > 0 || outcome.status == Termination::Converged, "{}", outcome.message);
        let method = InteriorPoint { memory: 0, ..InteriorPoint::default() };
        assert!(method.minimize(&mut problem(), &mut |_| ControlFlow::Continue(())).is_err());
    }
}
