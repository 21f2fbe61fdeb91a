//! The record of a run: what a problem was asked and what it answered.

use crate::design::{AnalysisFailure, Evaluation};
use nalgebra::DMatrix;

/// One question to a problem and its answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// The point (length n).
    pub x: Vec<f64>,
    /// The answer at that point.
    pub answer: Answer,
}

/// An answer of a problem.
#[derive(Debug, Clone, PartialEq)]
pub enum Answer {
    /// Answer to [`Problem::evaluate`](crate::design::Problem::evaluate).
    Evaluation(Result<Evaluation, AnalysisFailure>),
    /// Answer to [`Problem::hessian`](crate::design::Problem::hessian) or
    /// [`Problem::gauss_newton`](crate::design::Problem::gauss_newton), of which a method asks one alone.
    Hessian(Result<DMatrix<f64>, AnalysisFailure>),
}

/// The records of a run, in order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Journal {
    /// The records in the order of the questions.
    pub records: Vec<Record>,
}

impl Journal {
    /// How many of the records are evaluations.
    pub fn evaluations(&self) -> usize {
        self.records.iter().filter(|r| matches!(r.answer, Answer::Evaluation(_))).count()
    }
}
