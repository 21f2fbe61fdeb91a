//! Every evaluation recorded, and served again when a run resumes.

use super::checkpoint::{Checkpoint, CheckpointError};
use crate::design::{AnalysisFailure, Bounds, Evaluation, Problem};
use nalgebra::DMatrix;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// What was asked of a problem, and what it answered.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// The point (length n).
    pub x: Vec<f64>,
    /// The answer.
    pub answer: Answer,
}

/// An answer of a problem.
#[derive(Debug, Clone, PartialEq)]
pub enum Answer {
    /// To [`Problem::evaluate`].
    Evaluation(Result<Evaluation, AnalysisFailure>),
    /// To [`Problem::hessian`].
    Hessian(Result<DMatrix<f64>, AnalysisFailure>),
}

/// The records of a run, in order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Journal {
    /// The records.
    pub records: Vec<Record>,
}

impl Journal {
    /// How many of the records are evaluations.
    pub fn evaluations(&self) -> usize {
        self.records.iter().filter(|r| matches!(r.answer, Answer::Evaluation(_))).count()
    }
}

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
    case: String,
    interval: Duration,
    saved: Instant,
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

    /// Saves a [`Checkpoint`] of `case` to `path` after an evaluation, but not more often than every `interval`.
    ///
    /// A checkpoint that cannot be saved does not end the run: see [`checkpoint_error`](Self::checkpoint_error).
    pub fn with_checkpoints(
        mut self,
        path: impl Into<PathBuf>,
        case: impl Into<String>,
        interval: Duration,
    ) -> Self {
        let saved = Instant::now();
        self.saver = Some(Saver { path: path.into(), case: case.into(), interval, saved, error: None });
        self
    }

    /// What has been recorded, the replayed part included.
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
        // a failed attempt waits for the next interval too
        saver.saved = Instant::now();
        Checkpoint::save(&saver.path, &saver.case, &self.journal)
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
        if self.saver.as_ref().is_some_and(|s| s.saved.elapsed() >= s.interval) {
            let result = self.save();
            if let (Err(error), Some(saver)) = (result, &mut self.saver) {
                saver.error.get_or_insert(error);
            }
        }
    }
}

impl<P: Problem> Problem for Journaled<P> {
    fn variable_names(&self) -> &[String] {
        self.inner.variable_names()
    }

    fn start(&self) -> &[f64] {
        self.inner.start()
    }

    fn variable_bounds(&self) -> &[Bounds] {
        self.inner.variable_bounds()
    }

    fn constraint_names(&self) -> &[String] {
        self.inner.constraint_names()
    }

    fn constraint_bounds(&self) -> &[Bounds] {
        self.inner.constraint_bounds()
    }

    fn value_names(&self) -> &[String] {
        self.inner.value_names()
    }

    fn evaluate(&mut self, x: &[f64]) -> Result<Evaluation, AnalysisFailure> {
        if let Some(Answer::Evaluation(result)) = self.replay(x, |a| matches!(a, Answer::Evaluation(_))) {
            return result;
        }
        let result = self.inner.evaluate(x);
        self.record(x, Answer::Evaluation(result.clone()));
        result
    }

    fn hessian(&mut self, x: &[f64]) -> Option<Result<DMatrix<f64>, AnalysisFailure>> {
        if let Some(Answer::Hessian(result)) = self.replay(x, |a| matches!(a, Answer::Hessian(_))) {
            return Some(result);
        }
        let result = self.inner.hessian(x)?;
        self.record(x, Answer::Hessian(result.clone()));
        Some(result)
    }
}
