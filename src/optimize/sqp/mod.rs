//! Sequential quadratic programming in a trust region, the curvature sampled now and then.
//!
//! Drag depends strongly on a few directions of a free-form box and hardly at all on many. Quasi-Newton methods learn
//! one direction an iteration; here the curvature of the Lagrangian along every variable is read off neighbouring exact
//! gradients every few iterations, all at once ([`Problem::evaluate_near`]), and kept up by quasi-Newton updates in
//! between. Steps minimise the quadratic model under the linearised constraints within a trust region; what cannot be
//! met there is priced, so that every step exists.

mod curvature;
mod quadratic;

use super::constraint_row::{ConstraintRow, scale_factor};
use super::kkt::Iterate;
use super::ledger::Ledger;
use super::optimizer::{Limits, Optimizer};
use super::outcome::{OptimizeError, Outcome, Progress, Termination, check};
use super::settings::{Range, check_settings};
use super::vector::{dot, norm};
use super::verdict;
use super::watch::{Ending, Watch};
use crate::design::{Bounds, Evaluation, Problem};
use crate::optimize::dense::refuse_size;
use curvature::Curvature;
use nalgebra::DMatrix;
use quadratic::{ElasticProgram, ProgramSolution};
use std::ops::ControlFlow;

/// Sequential quadratic programming for problems with equality, one- and two-sided constraints and bounds.
///
/// The run has converged where every constraint is met within [`feasibility_tolerance`](Self::feasibility_tolerance)
/// and the [KKT residual](Outcome::kkt_residual) is at most [`optimality_tolerance`](Self::optimality_tolerance). A
/// failed analysis is a rejected step. Where no constraint can be met any better the run ends as
/// [`Termination::Infeasible`] and the message names what stands against what.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sqp {
    /// KKT residual (objective per scaled variable) at which the run has converged.
    pub optimality_tolerance: f64,
    /// Largest violation of a constraint, in its own unit, that counts as none.
    pub feasibility_tolerance: f64,
    /// Length of a step along the negative gradient at the start, in scaled variables: the first guess of the
    /// curvature.
    pub first_step: f64,
    /// Largest change of a scaled variable in one step, at the start.
    pub radius: f64,
    /// Iterations between two samples of the curvature; 0 for none.
    pub sampling: usize,
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
            first_step: 0.4,
            radius: 1.0,
            sampling: 8,
            patience: 30,
            limits: Limits::default(),
        }
    }
}

impl Sqp {
    /// The name in case files.
    pub const NAME: &'static str = "sqp";

    /// Violation of a constraint that says it cannot be met, rather than that it was not met so closely.
    fn missed(&self) -> f64 {
        self.feasibility_tolerance.max(1e-6)
    }

    fn check(&self) -> Result<(), OptimizeError> {
        check_settings(
            Self::NAME,
            self.limits,
            &[
                ("patience", self.patience as f64, Range::AtLeastOne),
                ("optimality_tolerance", self.optimality_tolerance, Range::NotNegative),
                ("feasibility_tolerance", self.feasibility_tolerance, Range::Positive),
                ("first_step", self.first_step, Range::Positive),
                ("radius", self.radius, Range::Positive),
            ],
        )
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
        self.check()?;
        check(problem)?;
        refuse_size(problem, Self::NAME)?;
        let mut ledger = Ledger::new(problem, observer, self.limits).feasible_within(self.feasibility_tolerance);
        let verdict = run(&mut ledger, self);
        Ok(ledger.close(verdict))
    }
}

/// All sides of all constraints, each to be at least 0, their gradients at `start` brought to length one.
fn rows(bounds: &[Bounds], start: &Evaluation) -> Vec<ConstraintRow> {
    let mut rows = Vec::new();
    for (constraint, (b, slope)) in bounds.iter().zip(&start.jacobian).enumerate() {
        let factor = scale_factor(slope);
        if b.lower > f64::NEG_INFINITY {
            rows.push(ConstraintRow { constraint, bound: b.lower, factor });
        }
        if b.upper < f64::INFINITY {
            rows.push(ConstraintRow { constraint, bound: b.upper, factor: -factor });
        }
    }
    rows
}

/// Smallest trust region.
const LEAST_RADIUS: f64 = 1e-10;
/// Largest trust region.
const MOST_RADIUS: f64 = 10.0;
/// Trust region after the curvature has been sampled, at least.
const RENEWED_RADIUS: f64 = 0.1;
/// Price of a shortfall in the model over the norm of the gradient: so much that all is bought that can be had.
const PRICE: f64 = 1e3;

/// Violation below which an optimal point is brought onto the constraints by the shortest way.
const NEARLY_MET: f64 = 3e-3;

/// A run on its way.
struct SqpRun {
    point: Iterate,
    rows: Vec<ConstraintRow>,
    curvature: Curvature,
    radius: f64,
    /// Curvature added in all directions: small where the model has proved right.
    damping: f64,
    price: f64,
    /// Price of the shortfall of each row in the merit function.
    weights: Vec<f64>,
}

/// A step that the model proposes.
struct Proposal {
    step: ProgramSolution,
    /// Decrease of the merit function it predicts.
    predicted: f64,
    /// Linearised rows at its end.
    linear: Vec<f64>,
}

impl SqpRun {
    fn row_matrix(&self) -> DMatrix<f64> {
        let jacobian = &self.point.evaluation.jacobian;
        DMatrix::from_fn(self.rows.len(), self.point.x.len(), |i, j| {
            self.rows[i].factor * jacobian[self.rows[i].constraint][j]
        })
    }

    /// Largest distance of a constraint that holds from its bound.
    fn slack(&self) -> f64 {
        let evaluation = &self.point.evaluation;
        let holding = self.rows.iter().filter(|r| self.point.optimality.multipliers[r.constraint] * r.factor > 0.0);
        holding.map(|r| (evaluation.constraints[r.constraint] - r.bound).abs()).fold(0.0, f64::max)
    }

    /// The curvature with its damping.
    fn model(&self) -> DMatrix<f64> {
        let n = self.point.x.len();
        self.curvature.matrix() + DMatrix::identity(n, n) * self.damping
    }

    fn values(&self) -> Vec<f64> {
        self.rows.iter().map(|r| r.value(&self.point.evaluation)).collect()
    }

    /// The step of the model at a price, for rows that have `values` now.
    fn solve(&self, bounds: &[Bounds], rows: &DMatrix<f64>, values: &[f64], price: f64) -> Option<ProgramSolution> {
        self.solve_for(bounds, rows, values, price, &self.point.evaluation.gradient, &self.model())
    }

    /// The step of the model with another gradient and curvature in place of its own.
    fn solve_for(
        &self,
        bounds: &[Bounds],
        rows: &DMatrix<f64>,
        values: &[f64],
        price: f64,
        gradient: &[f64],
        hessian: &DMatrix<f64>,
    ) -> Option<ProgramSolution> {
        let x = &self.point.x;
        let reach = |k: usize| {
            let (low, high) = ((bounds[k].lower - x[k]).max(-self.radius), (bounds[k].upper - x[k]).min(self.radius));
            // a variable held between equal bounds still needs an interior
            if high - low > 1e-14 { (low, high) } else { (low - 1e-14, high + 1e-14) }
        };
        let (lower, upper): (Vec<f64>, Vec<f64>) = (0..x.len()).map(reach).unzip();
        let needed: Vec<f64> = values.iter().map(|v| -v).collect();
        ElasticProgram {
            gradient,
            hessian,
            rows,
            needed: &needed,
            penalties: &vec![price; values.len()],
            lower: &lower,
            upper: &upper,
        }
        .solve()
    }

    /// The step of the model, for rows as they are or as corrected.
    fn propose(&mut self, bounds: &[Bounds], correction: Option<&[f64]>) -> Option<Proposal> {
        let rows = self.row_matrix();
        let actual = self.values();
        let values = correction.unwrap_or(&actual);
        let step = self.solve(bounds, &rows, values, self.price)?;
        let linear: Vec<f64> = (&rows * &step.d).iter().zip(values).map(|(a, v)| a + v).collect();
        if correction.is_none() {
            // a price for each row that its multiplier justifies, falling slowly where it is not needed
            for (weight, z) in self.weights.iter_mut().zip(&step.multipliers) {
                *weight = z.max(0.5 * (*weight + z));
            }
        }
        let d = &step.d;
        let gradient = dot(&self.point.evaluation.gradient, d.as_slice());
        let model = gradient + 0.5 * d.dot(&(self.model() * d));
        let relief = self.shortfall(&actual) - self.shortfall(&linear);
        Some(Proposal { predicted: relief - model, step, linear })
    }

    /// Sum of the shortfalls of the rows, each times its price.
    fn shortfall(&self, values: &[f64]) -> f64 {
        values.iter().zip(&self.weights).map(|(v, w)| w * (-v).max(0.0)).sum()
    }

    /// Trusts the model more or less after a step of a given largest entry that gained `ratio` of what was predicted.
    fn adapt(&mut self, ratio: f64, length: f64) {
        if ratio > 0.75 {
            self.damping *= 0.25;
            if length > 0.8 * self.radius {
                self.radius = (2.0 * self.radius).min(MOST_RADIUS);
            }
        } else if ratio < 0.25 {
            self.damping = (3.0 * self.damping).max(3.0 * self.curvature.least());
        }
    }

    fn moved(&self, bounds: &[Bounds], step: &ProgramSolution) -> Vec<f64> {
        let x = self.point.x.iter().zip(step.d.iter()).zip(bounds);
        x.map(|((x, d), b)| (x + d).clamp(b.lower, b.upper)).collect()
    }

    /// Decrease of the merit function to an evaluation.
    fn gained(&self, x: &[f64], evaluation: &Evaluation) -> f64 {
        let after: Vec<f64> = self.rows.iter().map(|r| r.value(evaluation)).collect();
        self.shortfall(&self.values()) - self.shortfall(&after) - self.point.height(x, evaluation)
    }

    /// Multipliers of the constraints as the step sees them.
    fn multipliers(&self, step: &ProgramSolution) -> Vec<f64> {
        let mut sums = vec![0.0; self.point.evaluation.constraints.len()];
        for (row, z) in self.rows.iter().zip(&step.multipliers) {
            sums[row.constraint] += row.factor * z;
        }
        sums
    }
}

/// The result of trying a proposal.
enum Trial {
    Accepted { x: Vec<f64>, evaluation: Evaluation, ratio: f64 },
    Rejected,
    Failed,
}

fn run(ledger: &mut Ledger<'_>, settings: &Sqp) -> (Termination, String) {
    let bounds = ledger.description().variable_bounds.to_vec();
    let start: Vec<f64> =
        ledger.description().start.iter().zip(&bounds).map(|(x, b)| x.max(b.lower).min(b.upper)).collect();
    let evaluation = match ledger.evaluate(&start) {
        Ok(evaluation) => evaluation,
        Err(failure) => return verdict::fails_at_start(&failure.reason),
    };
    let slope = norm(&evaluation.gradient).max(f64::MIN_POSITIVE);
    let rows = rows(&ledger.description().constraint_bounds, &evaluation);
    let mut state = SqpRun {
        weights: vec![0.0; rows.len()],
        rows,
        point: Iterate::new(ledger, &start, evaluation),
        curvature: Curvature::new(start.len(), slope / settings.first_step, 2.0 * settings.optimality_tolerance),
        radius: settings.radius,
        damping: 0.0,
        price: PRICE * slope,
    };
    let mut watch = Watch::new(settings.feasibility_tolerance, settings.patience);
    loop {
        match watch.judge(ledger, &state.point, settings.optimality_tolerance) {
            None => {}
            Some(Ending::Optimal) => {
                ledger.settle_on(&state.point.x, &state.point.evaluation);
                // the constraints that hold may be off by what their multipliers let pass
                if state.slack() > settings.feasibility_tolerance {
                    settle(ledger, &mut state, &bounds, settings);
                }
                return (Termination::Converged, verdict::converged(ledger, &state.point));
            }
            Some(Ending::OutOfIterations) => {
                let point = retreat(ledger, &mut state, &bounds, settings);
                return (Termination::IterationLimit, verdict::out_of_iterations(ledger, &point));
            }
            Some(Ending::Stalled) => {
                let point = retreat(ledger, &mut state, &bounds, settings);
                return verdict::at_rest(ledger, &point, settings.missed());
            }
        }
        if settings.sampling > 0 && state.curvature.age >= settings.sampling {
            if !state.curvature.sampled {
                state.damping = state.damping.max(state.curvature.first());
            }
            state.curvature.sample(ledger, &state.point, &bounds);
            // what is known anew may be trusted anew
            state.radius = state.radius.max(RENEWED_RADIUS);
            state.damping = state.damping.min(state.curvature.first());
        }
        // an optimal point that misses the constraints only needs to get onto them
        let optimal = state.point.optimality.residual <= settings.optimality_tolerance;
        let nearly = optimal && state.point.violation < NEARLY_MET && restore(ledger, &mut state, &bounds);
        let advanced = if nearly { Some(()) } else { advance(ledger, &mut state, &bounds) };
        match advanced {
            Some(()) => ledger.iteration += 1,
            None if ledger.halted().is_some() => return (Termination::Interrupted, String::new()),
            None => {
                if ledger.last_failed() {
                    return verdict::beset(ledger, &ledger.handed_out(&state.point));
                }
                let point = retreat(ledger, &mut state, &bounds, settings);
                return verdict::at_rest(ledger, &point, settings.missed());
            }
        }
    }
}

/// The point that a run without convergence hands out: where it stands brought onto the constraints, unless an earlier
/// one is better.
fn retreat(ledger: &mut Ledger<'_>, state: &mut SqpRun, bounds: &[Bounds], settings: &Sqp) -> Iterate {
    const STEPS: usize = 5;
    for _ in 0..STEPS {
        if state.point.violation <= settings.feasibility_tolerance || !restore(ledger, state, bounds) {
            break;
        }
    }
    ledger.handed_out(&state.point)
}

/// The shortest step that brings the constraints that hold onto their bounds, if the point stays optimal there.
fn settle(ledger: &mut Ledger<'_>, state: &mut SqpRun, bounds: &[Bounds], settings: &Sqp) {
    let before = (state.point.clone(), state.rows.clone());
    let both = |row: &ConstraintRow| {
        let holds = state.point.optimality.multipliers[row.constraint] * row.factor > 0.0;
        let other = holds.then_some(ConstraintRow { factor: -row.factor, ..*row });
        std::iter::once(*row).chain(other)
    };
    state.rows = state.rows.iter().flat_map(both).collect();
    let settled = restore(ledger, state, bounds)
        && state.point.violation <= settings.feasibility_tolerance
        && state.point.optimality.residual <= settings.optimality_tolerance;
    state.rows = before.1;
    if !settled {
        state.point = before.0;
    }
    ledger.settle_on(&state.point.x, &state.point.evaluation);
}

/// The shortest step onto the constraints; whether it led there.
fn restore(ledger: &mut Ledger<'_>, state: &mut SqpRun, bounds: &[Bounds]) -> bool {
    let still = vec![0.0; state.point.x.len()];
    let identity = DMatrix::identity(still.len(), still.len());
    let rows = state.row_matrix();
    let values = state.values();
    let Some(step) = state.solve_for(bounds, &rows, &values, 1.0, &still, &identity) else { return false };
    let x = state.moved(bounds, &step);
    let Ok(evaluation) = ledger.evaluate(&x) else { return false };
    let next = Iterate::new(ledger, &x, evaluation);
    let nearer = next.violation < 0.5 * state.point.violation || next.violation <= 1e-12;
    if nearer {
        state.point = next;
    }
    nearer
}

/// Takes one step; `None` where there is none to take.
fn advance(ledger: &mut Ledger<'_>, state: &mut SqpRun, bounds: &[Bounds]) -> Option<()> {
    let mut rejections = 0;
    while state.radius > LEAST_RADIUS {
        let Some(proposal) = state.propose(bounds, None) else {
            // a curvature that numbers cannot handle is forgotten
            if !state.curvature.forget() {
                return None;
            }
            continue;
        };
        let length = proposal.step.d.amax();
        match attempt(ledger, state, bounds, &proposal) {
            Trial::Accepted { x, evaluation, ratio } => {
                state.adapt(ratio, length);
                let multipliers = state.multipliers(&proposal.step);
                state.curvature.update(&state.point, &x, &evaluation, &multipliers);
                state.point = Iterate::new(ledger, &x, evaluation);
                return Some(());
            }
            Trial::Failed if ledger.halted().is_some() => return None,
            Trial::Failed => {
                state.radius = 0.25 * length;
                state.damping = (4.0 * state.damping).max(state.curvature.first());
            }
            Trial::Rejected => {
                rejections += 1;
                state.damping = (4.0 * state.damping).max(10.0 * state.curvature.least());
                if rejections > 2 {
                    state.radius = 0.3 * length;
                }
                if state.curvature.age >= 4 && state.curvature.sampled {
                    state.curvature.sample(ledger, &state.point, bounds);
                }
            }
        }
    }
    None
}

/// Evaluates a proposal, and once more with the constraints' own curvature where that spoilt it.
fn attempt(ledger: &mut Ledger<'_>, state: &mut SqpRun, bounds: &[Bounds], proposal: &Proposal) -> Trial {
    let noise = 1e-14 * state.point.evaluation.objective.abs();
    let judge = |state: &SqpRun, x: Vec<f64>, evaluation: Evaluation, predicted: f64| {
        let gained = state.gained(&x, &evaluation);
        let ratio = (gained + noise) / (predicted.max(0.0) + noise);
        (ratio >= 1e-4).then_some(Trial::Accepted { x, evaluation, ratio })
    };
    let x = state.moved(bounds, &proposal.step);
    let evaluation = match ledger.evaluate(&x) {
        Ok(evaluation) => evaluation,
        Err(_) => return Trial::Failed,
    };
    let ends: Vec<f64> = state.rows.iter().map(|r| r.value(&evaluation)).collect();
    if let Some(accepted) = judge(state, x, evaluation, proposal.predicted) {
        return accepted;
    }
    if state.shortfall(&ends) <= state.shortfall(&proposal.linear) + noise {
        return Trial::Rejected;
    }
    // rows as the linear model sees them, moved by what it missed
    let now = state.values();
    let missed: Vec<f64> = now.iter().zip(&ends).zip(&proposal.linear).map(|((v, e), l)| v + e - l).collect();
    let Some(corrected) = state.propose(bounds, Some(&missed)) else { return Trial::Rejected };
    let x = state.moved(bounds, &corrected.step);
    match ledger.evaluate(&x) {
        Ok(evaluation) => judge(state, x, evaluation, proposal.predicted).unwrap_or(Trial::Rejected),
        Err(_) if ledger.halted().is_some() => Trial::Failed,
        Err(_) => Trial::Rejected,
    }
}
