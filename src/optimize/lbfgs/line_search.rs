//! A line search that lives with failed analyses and with round-off.
//!
//! The step must satisfy the strong Wolfe conditions (Nocedal & Wright, Numerical Optimization, 2nd edition, equation
//! 3.7) or, near the minimum where differences of the objective drown in round-off, the approximate Wolfe conditions
//! of Hager & Zhang (SIAM J. Optim. 16, 2005, equation 4.1), which need slopes only. Trial steps come from the cubic
//! through two values and two slopes, kept inside of the bracket.
//!
//! [`BracketSearch`] is the bare algorithm on numbers, [`WolfeLineSearch`] lends it to `argmin`, whose own line
//! searches end the whole run at the first failed analysis.

use super::super::cubic::{LineSample, cubic_minimum};
use super::super::vector::dot;
use argmin::core::{
    CostFunction, Error, Gradient, IterState, KV, Problem, Solver, State, TerminationReason, TerminationStatus,
};
use argmin::solver::linesearch::LineSearch;

/// Share of the initial slope by which the objective must fall (Armijo).
const DECREASE: f64 = 1e-4;
/// Share of the initial slope below which the slope must fall in size.
const CURVATURE: f64 = 0.9;
/// Share of the initial slope in the approximate decrease condition.
const APPROXIMATE_DECREASE: f64 = 0.1;
/// Relative size of differences of the objective that may be round-off.
const ROUND_OFF: f64 = 1e-10;
/// Most trials of one search.
const MAX_TRIALS: usize = 20;
/// Failed analyses after which a step that lowers the objective is good enough.
const PATIENCE: usize = 3;
/// Where between the last good step and a failed one to try next.
const RETREAT: f64 = 0.25;
/// How far beyond the last interval to extrapolate at most, in lengths of that interval.
const STRETCH: f64 = 4.0;
/// Nearest to an end of a bracket that interpolation may come, as a share of its length.
const MARGIN: f64 = 0.2;

/// A failed analysis, on its way through `argmin`; the line search answers it with a shorter step.
#[derive(Debug, thiserror::Error)]
#[error("the analysis failed")]
pub(super) struct Rejected;

/// A search that ended without a step.
#[derive(Debug, thiserror::Error)]
#[error("no acceptable step along the line")]
struct NoStep;

/// The next move after a trial.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Advice {
    /// Try this step.
    Try(f64),
    /// Take this step, one of those tried.
    Accept(f64),
    /// There is no acceptable step.
    GiveUp,
}

/// The far end of the bracket.
#[derive(Debug, Clone, Copy)]
enum Far {
    Open,
    Known(LineSample),
    Failed(f64),
}

/// One line search: a bracket and the rules that shrink it.
#[derive(Debug, Clone)]
struct BracketSearch {
    origin: LineSample,
    near: LineSample,
    far: Far,
    trials: usize,
    failures: usize,
    /// Length of the bracket two trials ago and one trial ago.
    lengths: [f64; 2],
}

impl BracketSearch {
    fn new(value: f64, slope: f64) -> Self {
        let origin = LineSample { step: 0.0, value, slope };
        Self { origin, near: origin, far: Far::Open, trials: 0, failures: 0, lengths: [f64::INFINITY; 2] }
    }

    /// Takes the result of the trial at `step` (`None`: the analysis failed).
    fn report(&mut self, step: f64, result: Option<(f64, f64)>) -> Advice {
        self.trials += 1;
        let Some((value, slope)) = result else {
            self.failures += 1;
            self.far = Far::Failed(step);
            return self.next(step);
        };
        let trial = LineSample { step, value, slope };
        if self.accepts(trial) {
            return Advice::Accept(step);
        }
        let enough = value <= self.origin.value + DECREASE * step * self.origin.slope;
        if !enough || value >= self.near.value {
            self.far = Far::Known(trial);
        } else {
            let uphill = slope >= 0.0;
            let far_ahead = !matches!(self.far_step(), Some(far) if far < self.near.step);
            if uphill == far_ahead {
                self.far = Far::Known(self.near);
            }
            let previous = std::mem::replace(&mut self.near, trial);
            if matches!(self.far, Far::Open) {
                return self.extrapolate(previous);
            }
        }
        self.next(step)
    }

    fn accepts(&self, trial: LineSample) -> bool {
        let LineSample { value: value0, slope: slope0, .. } = self.origin;
        let flat = trial.slope.abs() <= -CURVATURE * slope0;
        let wolfe = trial.value <= value0 + DECREASE * trial.step * slope0 && flat;
        let in_noise = (trial.value - value0).abs() <= ROUND_OFF * value0.abs();
        let falling = (2.0 * APPROXIMATE_DECREASE - 1.0) * slope0 >= trial.slope && trial.slope >= CURVATURE * slope0;
        wolfe || (in_noise && falling)
    }

    fn far_step(&self) -> Option<f64> {
        match self.far {
            Far::Open => None,
            Far::Known(sample) => Some(sample.step),
            Far::Failed(step) => Some(step),
        }
    }

    /// The step after `last` was tried: inside of the bracket, or the end.
    fn next(&mut self, last: f64) -> Advice {
        let Some(far) = self.far_step() else { return Advice::GiveUp };
        let near = self.near;
        let length = (far - near.step).abs();
        let progress = near.step > 0.0;
        let exhausted = self.trials >= MAX_TRIALS || length <= f64::EPSILON * last.max(near.step);
        if exhausted || (progress && self.failures >= PATIENCE) {
            return if progress { Advice::Accept(near.step) } else { Advice::GiveUp };
        }
        let share = match self.far {
            // slow shrinking is cut short by halving
            Far::Known(_) if length > 0.66 * self.lengths[0] => 0.5,
            Far::Known(sample) => cubic_minimum(near, sample)
                .map_or(0.5, |step| ((step - near.step) / (far - near.step)).clamp(MARGIN, 1.0 - MARGIN)),
            _ => RETREAT,
        };
        self.lengths = [self.lengths[1], length];
        Advice::Try(near.step + share * (far - near.step))
    }

    /// The step beyond `near` when the objective still falls there.
    fn extrapolate(&self, previous: LineSample) -> Advice {
        if self.trials >= MAX_TRIALS {
            return Advice::Accept(self.near.step);
        }
        let length = self.near.step - previous.step;
        let ahead = cubic_minimum(previous, self.near).map(|step| step - self.near.step).filter(|ahead| *ahead > 0.0);
        Advice::Try(self.near.step + ahead.unwrap_or(f64::INFINITY).clamp(length, STRETCH * length))
    }
}

/// [`BracketSearch`] as `argmin` wants it: one iteration of the solver is one trial step.
#[derive(Debug, Clone, Default)]
pub(super) struct WolfeLineSearch {
    direction: Vec<f64>,
    origin: Vec<f64>,
    first: Option<f64>,
    step: f64,
    search: Option<BracketSearch>,
    /// Evaluated points that may still be accepted: step, value, gradient.
    tried: Vec<(f64, f64, Vec<f64>)>,
}

impl WolfeLineSearch {
    fn point(&self, step: f64) -> Vec<f64> {
        self.origin.iter().zip(&self.direction).map(|(x, d)| x + step * d).collect()
    }
}

impl LineSearch<Vec<f64>, f64> for WolfeLineSearch {
    fn search_direction(&mut self, direction: Vec<f64>) {
        self.direction = direction;
    }

    fn initial_step_length(&mut self, step: f64) -> Result<(), Error> {
        self.first = Some(step);
        Ok(())
    }
}

/// The state that `argmin` carries from one trial to the next.
pub(super) type ArgminState = IterState<Vec<f64>, Vec<f64>, (), (), (), f64>;

impl<O> Solver<O, ArgminState> for WolfeLineSearch
where
    O: CostFunction<Param = Vec<f64>, Output = f64> + Gradient<Param = Vec<f64>, Gradient = Vec<f64>>,
{
    fn name(&self) -> &str {
        "Wolfe line search"
    }

    fn init(&mut self, _problem: &mut Problem<O>, mut state: ArgminState) -> Result<(ArgminState, Option<KV>), Error> {
        self.origin = state.take_param().unwrap_or_default();
        let slope = state.get_gradient().map_or(0.0, |gradient| dot(gradient, &self.direction));
        // also false for NaN
        if !(slope < 0.0 && slope.is_finite()) {
            return Err(NoStep.into());
        }
        self.search = Some(BracketSearch::new(state.get_cost(), slope));
        self.step = self.first.unwrap_or(1.0);
        self.tried.clear();
        let origin = self.origin.clone();
        Ok((state.param(origin), None))
    }

    fn next_iter(&mut self, problem: &mut Problem<O>, state: ArgminState) -> Result<(ArgminState, Option<KV>), Error> {
        let step = self.step;
        let x = self.point(step);
        let result = match problem.cost(&x) {
            Ok(value) => {
                let gradient = problem.gradient(&x)?;
                let slope = dot(&gradient, &self.direction);
                self.tried.push((step, value, gradient));
                Some((value, slope))
            }
            Err(error) if error.is::<Rejected>() => None,
            Err(error) => return Err(error),
        };
        // a step too short to change the point tells nothing
        let moved = x != self.origin;
        let Some(search) = self.search.as_mut() else { return Err(NoStep.into()) };
        let verdict = if moved { search.report(step, result) } else { Advice::GiveUp };
        match verdict {
            Advice::Try(next) => {
                self.step = next;
                Ok((state, None))
            }
            Advice::Accept(step) => {
                let found = self.tried.iter().rposition(|t| t.0 == step);
                let Some(index) = found else { return Err(NoStep.into()) };
                let (_, value, gradient) = self.tried.swap_remove(index);
                let x = self.point(step);
                let state = state.param(x).cost(value).gradient(gradient);
                Ok((state.terminate_with(TerminationReason::SolverConverged), None))
            }
            Advice::GiveUp => Err(NoStep.into()),
        }
    }

    fn terminate(&mut self, _state: &ArgminState) -> TerminationStatus {
        TerminationStatus::NotTerminated
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs a search on `f` (value and slope; `None` fails) and returns the step and the number of trials.
    fn run(f: impl Fn(f64) -> Option<(f64, f64)>, first: f64) -> (Advice, usize) {
        let (value, slope) = f(0.0).unwrap();
        let mut search = BracketSearch::new(value, slope);
        let mut step = first;
        loop {
            match search.report(step, f(step)) {
                Advice::Try(next) => step = next,
                end => return (end, search.trials),
            }
        }
    }

    fn is_wolfe(f: impl Fn(f64) -> Option<(f64, f64)>, verdict: Advice) -> bool {
        let Advice::Accept(step) = verdict else { return false };
        let ((value0, slope0), (value, slope)) = (f(0.0).unwrap(), f(step).unwrap());
        value <= value0 + DECREASE * step * slope0 && slope.abs() <= CURVATURE * slope0.abs()
    }

    #[test]
    fn wolfe_conditions_hold_from_any_first_step() {
        // Moré & Thuente's first and second test function, and a wall
        let rational = |a: f64| Some((-a / (a * a + 2.0), (a * a - 2.0) / (a * a + 2.0).powi(2)));
        let quintic = |a: f64| {
            let b = a + 0.004;
            Some((b.powi(5) - 2.0 * b.powi(4), 5.0 * b.powi(4) - 8.0 * b.powi(3)))
        };
        let wall = |a: f64| {
            let p = (a - 0.3).max(0.0);
            Some((-a + 1e6 * p.powi(3), -1.0 + 3e6 * p * p))
        };
        for first in [1e-3, 0.1, 1.0, 10.0, 1e3] {
            for (name, f) in
                [("rational", &rational as &dyn Fn(f64) -> Option<(f64, f64)>), ("quintic", &quintic), ("wall", &wall)]
            {
                let (verdict, trials) = run(f, first);
                assert!(is_wolfe(f, verdict), "{name} from {first}: {verdict:?}");
                assert!(trials <= 16, "{name} from {first}: {trials} trials");
            }
        }
    }

    #[test]
    fn failed_analyses_shorten_the_step() {
        let f = |a: f64| (a < 0.01).then_some((-a, -1.0));
        let (verdict, trials) = run(f, 1.0);
        let Advice::Accept(step) = verdict else { panic!("{verdict:?}") };
        assert!(step > 1e-4 && step < 0.01, "{step}");
        assert!(trials < 10);
        assert_eq!(run(|a| (a == 0.0).then_some((0.0, -1.0)), 1.0).0, Advice::GiveUp);
    }

    #[test]
    fn slopes_decide_where_values_are_round_off() {
        // the values say "worse" by one unit in the last place, the slopes say "just right"
        let f = |a: f64| Some((1.0 + a * f64::EPSILON, 1e-9 * (a - 1.0)));
        assert_eq!(run(f, 1.0), (Advice::Accept(1.0), 1));
    }

    #[test]
    fn rising_everywhere_gives_up() {
        let f = |a: f64| Some((a, if a == 0.0 { -1e-3 } else { 1.0 }));
        assert_eq!(run(f, 1.0).0, Advice::GiveUp);
    }
}
