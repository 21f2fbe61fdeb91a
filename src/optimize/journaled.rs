//! Every evaluation recorded, and served again when a run resumes.

use super::checkpoint::{Checkpoint, CheckpointError};
use super::identity::Identity;
use super::journal::{Answer, Journal, Record};
use crate::design::{AnalysisFailure, Evaluation, Problem, ProblemDescription, ValueAndGradient};
use nalgebra::DMatrix;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// A problem that records every answer, and that first gives the answers of an earlier run.
///
/// The optimisers are deterministic, so a run started again from the start asks the same questions in the same order.
/// As long as it does (points compared bit by bit) the answers come from the journal, at no cost; after its last record
/// the problem itself answers. The resumed run therefore continues bit for bit where the first one was cut. Should a
/// question differ (another version, other settings), [`divergence`](Self::divergence) tells, the records from there on
/// are dropped and the problem itself answers.
///
/// ```no_run
/// # use aeroform::design::Problem;
/// # use aeroform::optimize::{Checkpoint, CheckpointError, Journaled, Lbfgs, Optimizer};
/// # use std::{ops::ControlFlow, path::Path, time::Duration};
/// # fn resume(problem: impl Problem) -> Result<(), Box<dyn std::error::Error>> {
/// let path = Path::new("out/checkpoint.json");
/// let journal = Checkpoint::load(path, "the case and its settings")?.journal;
/// let mut problem = Journaled::resume(problem, journal)
///     .with_checkpoints(path, "the case and its settings", Duration::from_secs(5));
/// let outcome = Lbfgs::default().minimize(&mut problem, &mut |_| ControlFlow::Continue(()))?;
/// problem.save()?;
/// # Ok(()) }
/// ```
#[derive(Debug)]
pub struct Journaled<P> {
    inner: P,
    journal: Journal,
    /// How many records have been given again.
    replayed: usize,
    /// How many there were to give again.
    recorded: usize,
    divergence: Option<usize>,
    saver: Option<Saver>,
}

/// When and where to save.
#[derive(Debug)]
struct Saver {
    path: PathBuf,
    identity: Identity,
    interval: Duration,
    saved: Instant,
    /// How long the last save took.
    took: Duration,
    error: Option<CheckpointError>,
}

impl<P: Problem> Journaled<P> {
    /// Records `inner` from now on.
    pub fn new(inner: P) -> Self {
        Self::resume(inner, Journal::default())
    }

    /// Gives the answers in `journal` first.
    pub fn resume(inner: P, journal: Journal) -> Self {
        let recorded = journal.records.len();
        Self { inner, journal, replayed: 0, recorded, divergence: None, saver: None }
    }

    /// Saves a [`Checkpoint`] of the run `identity` to `path` after an evaluation, but not more often than every
    /// `interval`, and so that saving a large one takes at most about a tenth of the time of the run. An interval of
    /// zero saves after every evaluation.
    ///
    /// A checkpoint that cannot be saved does not end the run: see [`checkpoint_error`](Self::checkpoint_error).
    pub fn with_checkpoints(
        mut self,
        path: impl Into<PathBuf>,
        identity: impl Into<Identity>,
        interval: Duration,
    ) -> Self {
        let (saved, took) = (Instant::now(), Duration::ZERO);
        self.saver = Some(Saver { path: path.into(), identity: identity.into(), interval, saved, took, error: None });
        self
    }

    /// The records so far, the replayed part included.
    pub fn journal(&self) -> &Journal {
        &self.journal
    }

    /// Whether the next answer comes from the journal, if the question is the recorded one.
    pub fn is_replaying(&self) -> bool {
        self.replayed < self.recorded
    }

    /// The index of the first record whose question was not asked again, if the replay went another way.
    pub fn divergence(&self) -> Option<usize> {
        self.divergence
    }

    /// The first failure to save a checkpoint on the way.
    pub fn checkpoint_error(&self) -> Option<&CheckpointError> {
        self.saver.as_ref()?.error.as_ref()
    }

    /// Saves a checkpoint now; does nothing without [`with_checkpoints`](Self::with_checkpoints).
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn save(&mut self) -> Result<(), CheckpointError> {
        let Some(saver) = &mut self.saver else { return Ok(()) };
        let begin = Instant::now();
        let result = Checkpoint::save(&saver.path, &saver.identity, &self.journal);
        // a failed attempt waits for the next interval too
        saver.saved = Instant::now();
        saver.took = begin.elapsed();
        result
    }

    /// The wrapped problem and the journal.
    pub fn into_parts(self) -> (P, Journal) {
        (self.inner, self.journal)
    }

    /// The recorded answer to the question at hand, if that is the recorded question.
    fn replay(&mut self, x: &[f64], same_kind: impl Fn(&Answer) -> bool) -> Option<Answer> {
        if !self.is_replaying() {
            return None;
        }
        let record = &self.journal.records[self.replayed];
        let same_point = record.x.len() == x.len() && record.x.iter().zip(x).all(|(a, b)| a.to_bits() == b.to_bits());
        if same_point && same_kind(&record.answer) {
            self.replayed += 1;
            return Some(record.answer.clone());
        }
        self.divergence = Some(self.replayed);
        self.journal.records.truncate(self.replayed);
        self.recorded = self.replayed;
        None
    }

    fn record(&mut self, x: &[f64], answer: Answer) {
        self.journal.records.push(Record { x: x.to_vec(), answer });
        let due = |s: &Saver| s.interval.is_zero() || s.saved.elapsed() >= s.interval.max(10 * s.took);
        if self.saver.as_ref().is_some_and(due) {
            let result = self.save();
            if let (Err(error), Some(saver)) = (result, &mut self.saver) {
                saver.error.get_or_insert(error);
            }
        }
    }
}

impl<P: Problem> Problem for Journaled<P> {
    fn description(&self) -> &ProblemDescription {
        self.inner.description()
    }

    fn evaluate(&mut self, x: &[f64]) -> Result<Evaluation, AnalysisFailure> {
        if let Some(Answer::Evaluation(result)) = self.replay(x, |a| matches!(a, Answer::Evaluation(_))) {
            return result;
        }
        let result = self.inner.evaluate(x);
        self.record(x, Answer::Evaluation(result.clone()));
        result
    }

    fn evaluate_near(&mut self, base: &[f64], points: &[Vec<f64>]) -> Vec<Result<Evaluation, AnalysisFailure>> {
        let mut results = Vec::with_capacity(points.len());
        while let Some(x) = points.get(results.len()) {
            match self.replay(x, |a| matches!(a, Answer::Evaluation(_))) {
                Some(Answer::Evaluation(result)) => results.push(result),
                _ => break,
            }
        }
        let rest = &points[results.len()..];
        if !rest.is_empty() {
            for (x, result) in rest.iter().zip(self.inner.evaluate_near(base, rest)) {
                self.record(x, Answer::Evaluation(result.clone()));
                results.push(result);
            }
        }
        results
    }

    fn hessian(&mut self, x: &[f64]) -> Option<Result<DMatrix<f64>, AnalysisFailure>> {
        if let Some(Answer::Hessian(result)) = self.replay(x, |a| matches!(a, Answer::Hessian(_))) {
            return Some(result);
        }
        let result = self.inner.hessian(x)?;
        self.record(x, Answer::Hessian(result.clone()));
        Some(result)
    }

    fn gauss_newton(&mut self, x: &[f64]) -> Option<Result<DMatrix<f64>, AnalysisFailure>> {
        if let Some(Answer::Hessian(result)) = self.replay(x, |a| matches!(a, Answer::Hessian(_))) {
            return Some(result);
        }
        let result = self.inner.gauss_newton(x)?;
        self.record(x, Answer::Hessian(result.clone()));
        Some(result)
    }

    // geometry only: cheap, and the same whenever it is asked for
    fn metric(&mut self, x: &[f64]) -> Option<DMatrix<f64>> {
        self.inner.metric(x)
    }

    fn known_constraints(&mut self, x: &[f64]) -> Option<Vec<Option<ValueAndGradient>>> {
        self.inner.known_constraints(x)
    }

    fn likely_curvature(&mut self, x: &[f64]) -> Option<DMatrix<f64>> {
        self.inner.likely_curvature(x)
    }

    fn residual_curvature(&mut self, x: &[f64], step: &[f64]) -> Option<Vec<f64>> {
        self.inner.residual_curvature(x, step)
    }

    fn natural_steps(&self) -> Option<Vec<f64>> {
        self.inner.natural_steps()
    }
}

#[cfg(test)]
mod tests {
    use super::super::testcases::*;
    use super::super::{Lbfgs, Newton, Optimizer, Outcome, Termination};
    use super::*;
    use std::ops::ControlFlow;

    fn bits(outcome: &Outcome) -> (Vec<u64>, usize, usize, Termination) {
        let x = outcome.x.iter().map(|v| v.to_bits()).collect();
        (x, outcome.evaluations, outcome.iterations, outcome.status)
    }

    /// A run killed after `k` evaluations, its checkpoint reloaded, resumed to the end.
    fn kill_and_resume(
        method: &dyn Optimizer,
        case: impl Fn() -> Unconstrained<ShapeMatch>,
        k: usize,
    ) -> (Outcome, usize) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("checkpoint.json");
        let mut killed = Journaled::new(case()).with_checkpoints(&path, "case", Duration::ZERO);
        let stop = &mut |p: &super::super::Progress<'_>| {
            if p.evaluation == k { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        assert_eq!(method.minimize(&mut killed, stop).unwrap().status, Termination::Interrupted);
        assert!(killed.checkpoint_error().is_none());
        drop(killed);
        let journal = Checkpoint::load(&path, "case").unwrap().journal;
        assert_eq!(journal.evaluations(), k);
        let mut resumed = Journaled::resume(case(), journal);
        let outcome = run(method, &mut resumed);
        assert_eq!(resumed.divergence(), None);
        assert_eq!(resumed.journal().evaluations(), outcome.evaluations);
        (outcome, resumed.into_parts().0.asked.len())
    }

    #[test]
    fn resumed_runs_continue_bit_for_bit() {
        let fails: fn(&[f64]) -> bool = |x| x[0].to_bits() % 7 == 3;
        let cases: [fn() -> Unconstrained<ShapeMatch>; 2] = [shape_match, || shape_match().bounded(-0.2, 0.2)];
        for (method, case, kills) in [
            (&Lbfgs::default() as &dyn Optimizer, cases[0], &[1, 2, 3, 17, 100, 200][..]),
            (&Lbfgs::default(), cases[1], &[1, 5, 60]),
            (&Newton::default(), cases[0], &[1, 2, 7, 30]),
            (&Newton::default(), cases[1], &[1, 6, 20]),
        ] {
            let case = || case().failing(fails);
            let whole = run(method, &mut case());
            for &k in kills.iter().filter(|&&k| k < whole.evaluations) {
                let (resumed, asked) = kill_and_resume(method, case, k);
                assert_eq!(bits(&resumed), bits(&whole), "{} killed after {k}", method.name());
                assert_eq!(asked, whole.evaluations - k);
            }
        }
    }

    #[test]
    fn another_path_is_noticed() {
        let mut first = Journaled::new(rosenbrock(2));
        run(&Lbfgs::default(), &mut first);
        let (_, journal) = first.into_parts();
        let recorded = journal.records.len();
        let other = Lbfgs { first_step: 0.02, ..Lbfgs::default() };
        let mut resumed = Journaled::resume(rosenbrock(2), journal.clone());
        let outcome = run(&other, &mut resumed);
        // the start is the same, the first step is not
        assert_eq!(resumed.divergence(), Some(1));
        assert_eq!(bits(&outcome), bits(&run(&other, &mut rosenbrock(2))));
        assert_eq!(resumed.journal().records.len(), outcome.evaluations);
        // a finished run replays without a single evaluation
        let mut again = Journaled::resume(rosenbrock(2), journal);
        assert!(again.is_replaying());
        let outcome = run(&Lbfgs::default(), &mut again);
        assert_eq!((outcome.evaluations, again.divergence()), (recorded, None));
        assert!(!again.is_replaying() && again.into_parts().0.asked.is_empty());
    }

    #[test]
    fn a_checkpoint_that_cannot_be_saved_does_not_end_the_run() {
        let mut problem = Journaled::new(rosenbrock(2)).with_checkpoints("/dev/null/x.json", "case", Duration::ZERO);
        assert_eq!(run(&Lbfgs::default(), &mut problem).status, Termination::Converged);
        assert!(matches!(problem.checkpoint_error(), Some(CheckpointError::Write { .. })));
        assert!(problem.save().is_err());
    }

    #[test]
    fn checkpoints_keep_their_distance() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("checkpoint.json");
        let mut problem = Journaled::new(rosenbrock(2)).with_checkpoints(&path, "case", Duration::from_secs(3600));
        run(&Lbfgs::default(), &mut problem);
        assert!(!path.exists());
        problem.save().unwrap();
        assert_eq!(Checkpoint::load(&path, "case").unwrap().journal, *problem.journal());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
