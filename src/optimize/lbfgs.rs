//! L-BFGS: `argmin` drives, this module supplies what it lacks.
//!
//! `argmin` asks for cost and gradient separately, takes every step for a good one, measures progress in absolute
//! terms and gives up for good when a line search fails. Here one evaluation serves both calls, the line search is
//! [`WolfeLineSearch`], the objective is scaled so that the very first step has a chosen length, the stopping criteria
//! are relative, and a failed line search restarts the method from the best point with an empty memory as long as that
//! leads anywhere.

use super::bounded::Bounded;
use super::ledger::{Ledger, dot, norm};
use super::line_search::{Rejected, WolfeLineSearch};
use super::outcome::check;
use super::{Limits, OptimizeError, Optimizer, Outcome, Progress, Status};
use crate::design::Problem;
use argmin::core::{
    CostFunction, Error, Executor, Gradient, IterState, KV, Problem as Counted, Solver, State, TerminationReason,
    TerminationStatus,
};
use argmin::solver::quasinewton::LBFGS;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::ops::ControlFlow;

/// Limited-memory BFGS with restarts, for problems without constraints.
///
/// One iteration costs one evaluation, rarely more. Bounds on variables are met by a change of variables
/// ([`Bounded`]). Failed analyses shorten the step.
///
/// The objective is divided by a constant so that the first trial step, along the negative gradient, has the length
/// [`first_step`](Self::first_step); no tolerance depends on that constant. The run has converged when
///
/// * the objective fell by less than [`objective_tolerance`](Self::objective_tolerance) of its size over
///   [`patience`](Self::patience) iterations, or
/// * the norm of the gradient is below [`gradient_tolerance`](Self::gradient_tolerance) times the largest met so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lbfgs {
    /// Steps remembered. The default of 500 forgets nothing in most runs, which makes it full BFGS: on an
    /// ill-conditioned problem of 32 variables it needs a quarter of the evaluations that a memory of 20 needs, and a
    /// step remembered costs two vectors only.
    pub memory: usize,
    /// Relative change of the objective, over `patience` iterations, that counts as none.
    pub objective_tolerance: f64,
    /// Iterations over which the change of the objective is measured.
    pub patience: usize,
    /// Reduction of the norm of the gradient at which the run has converged.
    pub gradient_tolerance: f64,
    /// Length of the first trial step, in scaled variables.
    pub first_step: f64,
    /// Limits of the run.
    pub limits: Limits,
}

impl Default for Lbfgs {
    fn default() -> Self {
        Self {
            memory: 500,
            objective_tolerance: 1e-7,
            patience: 10,
            gradient_tolerance: 1e-10,
            first_step: 0.1,
            limits: Limits::default(),
        }
    }
}

impl Lbfgs {
    /// The name in case files.
    pub const NAME: &'static str = "lbfgs";

    fn check(&self) -> Result<(), OptimizeError> {
        let settings = [
            ("memory", self.memory as f64, self.memory >= 1, "at least 1"),
            ("patience", self.patience as f64, self.patience >= 1, "at least 1"),
            ("max_evaluations", self.limits.evaluations as f64, self.limits.evaluations >= 1, "at least 1"),
            ("objective_tolerance", self.objective_tolerance, self.objective_tolerance >= 0.0, "0 or more"),
            ("gradient_tolerance", self.gradient_tolerance, self.gradient_tolerance >= 0.0, "0 or more"),
            ("first_step", self.first_step, self.first_step > 0.0 && self.first_step.is_finite(), "positive"),
        ];
        match settings.into_iter().find(|s| !s.2) {
            Some((setting, value, _, range)) => {
                Err(OptimizeError::Setting { method: Self::NAME, setting, value, range })
            }
            None => Ok(()),
        }
    }
}

impl Optimizer for Lbfgs {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn minimize(
        &self,
        problem: &mut dyn Problem,
        observer: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    ) -> Result<Outcome, OptimizeError> {
        self.check()?;
        check(problem, Self::NAME)?;
        let run = RefCell::new(Run::new(*self, problem, observer));
        let verdict = drive(&run);
        Ok(run.into_inner().problem.into_inner().close(verdict))
    }
}

/// Runs `argmin` leg by leg, each from the point reached with an empty memory, until there is a reason to stop.
fn drive(run: &RefCell<Run<'_>>) -> (Status, String) {
    if let Err(verdict) = run.borrow_mut().begin() {
        return verdict;
    }
    loop {
        let (x, gradient, cost) = run.borrow_mut().begin_leg();
        if let Some(verdict) = run.borrow_mut().verdict.take() {
            return verdict;
        }
        let solver =
            Supervised { run, lbfgs: LBFGS::new(WolfeLineSearch::default(), run.borrow().settings.memory) };
        let ended = Executor::new(Bridge(run), solver)
            .configure(|state| state.param(x).gradient(gradient).cost(cost))
            .ctrlc(false)
            .run();
        let mut run = run.borrow_mut();
        if let Some(verdict) = run.verdict.take() {
            return verdict;
        }
        if run.problem.inner().halted().is_some() {
            // the ledger words it
            return (Status::Interrupted, String::new());
        }
        // a line search failed; the memory may be to blame unless a new one led nowhere either
        if ended.is_err() || !run.leg_gained() {
            return run.stuck();
        }
    }
}

/// A point, its objective and gradient, in the unbounded variables.
#[derive(Debug, Clone, Default)]
struct Point {
    x: Vec<f64>,
    objective: f64,
    gradient: Vec<f64>,
}

/// What a run carries from leg to leg.
struct Run<'a> {
    problem: Bounded<Ledger<'a>>,
    settings: Lbfgs,
    /// The latest points, so that cost and gradient share an evaluation.
    recent: VecDeque<Point>,
    /// Where the run stands.
    current: Point,
    /// Objectives of the last `patience` iterations.
    objectives: VecDeque<f64>,
    /// Objective where the leg began.
    leg_start: f64,
    /// Length of the last step.
    step: f64,
    /// Largest norm of the gradient so far.
    steepest: f64,
    /// What the objective is divided by.
    scale: f64,
    /// Whether an analysis succeeded since the last step.
    succeeded: bool,
    verdict: Option<(Status, String)>,
}

impl<'a> Run<'a> {
    /// Points kept: a little more than those of one line search.
    const RECENT: usize = 24;

    fn new(
        settings: Lbfgs,
        problem: &'a mut dyn Problem,
        observer: &'a mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    ) -> Self {
        Self {
            problem: Bounded::new(Ledger::new(problem, observer, settings.limits)),
            settings,
            recent: VecDeque::new(),
            current: Point::default(),
            objectives: VecDeque::new(),
            leg_start: f64::INFINITY,
            step: settings.first_step,
            steepest: 0.0,
            scale: 1.0,
            succeeded: false,
            verdict: None,
        }
    }

    /// Evaluates the start.
    fn begin(&mut self) -> Result<(), (Status, String)> {
        let start = self.problem.start().to_vec();
        self.current = self.at(&start).map_err(|_| {
            let reason = self.problem.inner().last_failure();
            (Status::Failed, format!("The analysis fails at the start: {reason}."))
        })?;
        self.judge();
        Ok(())
    }

    /// Chooses the scale of the objective such that the first step of a leg has the length of the last step, and
    /// returns point, scaled gradient and scaled objective.
    fn begin_leg(&mut self) -> (Vec<f64>, Vec<f64>, f64) {
        self.leg_start = self.current.objective;
        self.scale = (norm(&self.current.gradient) / self.step).max(f64::MIN_POSITIVE);
        let gradient = self.current.gradient.iter().map(|g| g / self.scale).collect();
        (self.current.x.clone(), gradient, self.current.objective / self.scale)
    }

    /// Objective and gradient at `x`, evaluated once.
    fn at(&mut self, x: &[f64]) -> Result<Point, Error> {
        if let Some(point) = self.recent.iter().rfind(|p| p.x == x) {
            return Ok(point.clone());
        }
        let evaluation = match self.problem.evaluate(x) {
            Ok(evaluation) => evaluation,
            Err(_) if self.problem.inner().halted().is_some() => return Err(Halted.into()),
            Err(_) => return Err(Rejected.into()),
        };
        self.succeeded = true;
        if self.recent.len() == Self::RECENT {
            self.recent.pop_front();
        }
        let point = Point { x: x.to_vec(), objective: evaluation.objective, gradient: evaluation.gradient };
        self.recent.push_back(point.clone());
        Ok(point)
    }

    /// Takes the step to `next`. Returns whether the leg can go on.
    fn accept(&mut self, next: Point) -> bool {
        let change = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>();
        let s = change(&next.x, &self.current.x);
        let y = change(&next.gradient, &self.current.gradient);
        self.step = norm(&s).clamp(f64::MIN_POSITIVE, self.settings.first_step);
        self.current = next;
        self.succeeded = false;
        self.problem.inner_mut().iteration += 1;
        self.judge();
        // a pair without positive curvature would spoil the memory, which argmin does not check
        self.verdict.is_none() && dot(&s, &y) > 0.0
    }

    /// Whether the current point ends the run.
    fn judge(&mut self) {
        let slope = norm(&self.current.gradient);
        self.steepest = self.steepest.max(slope);
        let Lbfgs { objective_tolerance, gradient_tolerance, patience, limits, .. } = self.settings;
        if self.objectives.len() > patience {
            self.objectives.pop_front();
        }
        self.objectives.push_back(self.current.objective);
        let objective = self.current.objective;
        let before = self.objectives[0];
        self.verdict = if slope <= gradient_tolerance * self.steepest {
            let message = if slope == 0.0 {
                "Converged: the gradient vanishes.".into()
            } else {
                let ratio = slope / self.steepest;
                format!("Converged: the gradient fell to {slope:.1e}, {ratio:.1e} of its largest norm.")
            };
            Some((Status::Converged, message))
        } else if self.objectives.len() > patience && before - objective <= objective_tolerance * objective.abs() {
            let change = (before - objective) / objective.abs();
            let message = format!(
                "Converged: the objective changed by {change:.1e} of its size over {patience} iterations; the norm of the gradient is {slope:.1e}."
            );
            Some((Status::Converged, message))
        } else if self.problem.inner().out_of_iterations() {
            let message =
                format!("Stopped at the limit of {} iterations before a tolerance was met.", limits.iterations);
            Some((Status::IterationLimit, message))
        } else {
            None
        };
    }

    /// Whether the leg that just ended lowered the objective by more than the tolerance.
    fn leg_gained(&self) -> bool {
        let Point { objective, .. } = self.current;
        self.leg_start - objective > self.settings.objective_tolerance * objective.abs()
    }

    /// The verdict where no line search leads on.
    fn stuck(&self) -> (Status, String) {
        let slope = norm(&self.current.gradient);
        if !self.succeeded && self.problem.inner().last_failed() {
            let reason = self.problem.inner().last_failure();
            return (Status::Failed, format!("The analysis fails at every step from the best point: {reason}."));
        }
        let ratio = slope / self.steepest;
        let message = format!(
            "No step lowers the objective further at the precision it is computed with; the norm of the gradient is {slope:.1e}, {ratio:.1e} of its largest."
        );
        (Status::Stalled, message)
    }
}

/// The observer or a limit ended the run in the middle of a line search.
#[derive(Debug, thiserror::Error)]
#[error("the run has ended")]
struct Halted;

/// The scaled objective as `argmin` sees it.
struct Bridge<'r, 'a>(&'r RefCell<Run<'a>>);

impl CostFunction for Bridge<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, x: &Vec<f64>) -> Result<f64, Error> {
        let mut run = self.0.borrow_mut();
        Ok(run.at(x)?.objective / run.scale)
    }
}

impl Gradient for Bridge<'_, '_> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, x: &Vec<f64>) -> Result<Vec<f64>, Error> {
        let mut run = self.0.borrow_mut();
        let mut gradient = run.at(x)?.gradient;
        gradient.iter_mut().for_each(|g| *g /= run.scale);
        Ok(gradient)
    }
}

type Iterate = IterState<Vec<f64>, Vec<f64>, (), (), (), f64>;

/// `argmin`'s L-BFGS under the stopping criteria of this module.
struct Supervised<'r, 'a> {
    run: &'r RefCell<Run<'a>>,
    lbfgs: LBFGS<WolfeLineSearch, Vec<f64>, Vec<f64>, f64>,
}

impl<'r, 'a> Solver<Bridge<'r, 'a>, Iterate> for Supervised<'r, 'a> {
    fn name(&self) -> &str {
        "supervised L-BFGS"
    }

    fn init(
        &mut self,
        problem: &mut Counted<Bridge<'r, 'a>>,
        state: Iterate,
    ) -> Result<(Iterate, Option<KV>), Error> {
        self.lbfgs.init(problem, state)
    }

    fn next_iter(
        &mut self,
        problem: &mut Counted<Bridge<'r, 'a>>,
        state: Iterate,
    ) -> Result<(Iterate, Option<KV>), Error> {
        let (state, kv) = self.lbfgs.next_iter(problem, state)?;
        if state.terminated() {
            return Ok((state, kv));
        }
        let Some(x) = state.get_param() else { return Ok((state, kv)) };
        let mut run = self.run.borrow_mut();
        let next = run.at(x)?;
        let state = if run.accept(next) { state } else { state.terminate_with(TerminationReason::SolverConverged) };
        Ok((state, kv))
    }

    fn terminate(&mut self, _state: &Iterate) -> TerminationStatus {
        TerminationStatus::NotTerminated
    }
}

#[cfg(test)]
mod tests {
    use super::super::testcases::*;
    use super::*;

    #[test]
    fn explore() {
        let levels = [1e-5, 1e-6, 4e-7, 1.6e-7, 1.4e-7, 1.36e-7, 1.35e-7, 1.346e-7, 1.3451e-7];
        for memory in [500] {
            for first_step in [0.01, 0.02, 0.03, 0.05, 0.1, 0.2, 0.3, 0.5] {
                let method = Lbfgs { memory, first_step, ..Lbfgs::default() };
                let mut case = shape_match();
                let mut firsts = vec![None; levels.len()];
                let o = method
                    .minimize(&mut case, &mut |p| {
                        for (l, f) in levels.iter().zip(&mut firsts) {
                            if f.is_none() && p.best_objective <= *l {
                                *f = Some(p.evaluation);
                            }
                        }
                        ControlFlow::Continue(())
                    })
                    .unwrap();
                println!("m {memory} s {first_step}: {} evals {} it {} f {:.6e} {} {:?}", o.status, o.evaluations, o.iterations, o.evaluation.unwrap().objective, o.message, firsts);
            }
        }
    }
}
