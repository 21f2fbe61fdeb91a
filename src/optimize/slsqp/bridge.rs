//! A run of SLSQP, and the face it shows to `basin`.

use super::super::constraint_row::{ConstraintRow, scale_factor};
use super::super::kkt::Iterate;
use super::super::ledger::{Halted, Ledger};
use super::super::vector::norm;
use crate::design::{AnalysisFailure, Bounds, Evaluation, Problem};
use basin::{
    BoxBounds, ConstraintDescription, ConstraintJacobian, ConstraintSet, ConstraintSolveError, Constraints,
    CostFunction, DenseMatrix, Gradient, NoLinearConstraints, NonlinearBlock, NonlinearBlocks, NonlinearEqualityValues,
    NonlinearInequalityValues,
};
use std::cell::RefCell;

/// The state of a run, which lasts from leg to leg.
pub(super) struct SlsqpRun<'a> {
    pub ledger: Ledger<'a>,
    /// Length of the first step along the negative gradient of the objective.
    first_step: f64,
    /// The latest point, so that objective, constraints and gradients share an evaluation.
    latest: Option<(Vec<f64>, Result<Evaluation, AnalysisFailure>)>,
    /// Factor of the objective.
    scale: f64,
    /// Where the method stands.
    anchor: Option<Iterate>,
    /// Rows that must be 0.
    equalities: Vec<ConstraintRow>,
    /// Rows that must not be positive.
    inequalities: Vec<ConstraintRow>,
}

impl<'a> SlsqpRun<'a> {
    pub fn new(ledger: Ledger<'a>, first_step: f64) -> Self {
        Self {
            ledger,
            first_step,
            latest: None,
            scale: 1.0,
            anchor: None,
            equalities: Vec::new(),
            inequalities: Vec::new(),
        }
    }

    /// Evaluates the start, moved into its bounds, and chooses the scales of objective and constraints there.
    pub fn begin(&mut self) -> Result<Iterate, AnalysisFailure> {
        let x = self.ledger.start_in_bounds();
        let point = self.point(&x)?;
        let evaluation = &point.evaluation;
        let slope = norm(&evaluation.gradient);
        if slope > 0.0 {
            self.scale = self.first_step / slope;
        }
        let bounds = self.ledger.description().constraint_bounds.iter();
        for (constraint, (&Bounds { lower, upper }, row)) in bounds.zip(&evaluation.jacobian).enumerate() {
            let factor = scale_factor(row);
            if lower == upper {
                self.equalities.push(ConstraintRow { constraint, bound: lower, factor });
                continue;
            }
            if lower > f64::NEG_INFINITY {
                self.inequalities.push(ConstraintRow { constraint, bound: lower, factor: -factor });
            }
            if upper < f64::INFINITY {
                self.inequalities.push(ConstraintRow { constraint, bound: upper, factor });
            }
        }
        Ok(point)
    }

    /// The point at `x`, with what optimality it has.
    pub fn point(&mut self, x: &[f64]) -> Result<Iterate, AnalysisFailure> {
        let evaluation = self.at(x)?;
        Ok(Iterate::new(&self.ledger, x, evaluation))
    }

    fn at(&mut self, x: &[f64]) -> Result<Evaluation, AnalysisFailure> {
        if let Some((point, result)) = &self.latest
            && point == x
        {
            return result.clone();
        }
        let result = self.ledger.evaluate(x);
        self.latest = Some((x.to_vec(), result.clone()));
        result
    }

    /// The method stands at `point`: objectives are measured from there.
    pub fn stand_at(&mut self, point: &Iterate) {
        self.anchor = Some(point.clone());
    }

    fn rows(&self) -> impl Iterator<Item = &ConstraintRow> {
        self.equalities.iter().chain(&self.inequalities)
    }
}

/// The problem as `basin` sees it, with objective and constraints scaled. A failed analysis is NaN, which its line
/// search answers with half the step.
pub(super) struct BasinProblem<'r, 'a> {
    run: &'r RefCell<SlsqpRun<'a>>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    equalities: usize,
    inequalities: usize,
}

impl<'r, 'a> BasinProblem<'r, 'a> {
    pub fn new(run: &'r RefCell<SlsqpRun<'a>>) -> Self {
        let state = run.borrow();
        let bounds = &state.ledger.description().variable_bounds;
        Self {
            run,
            lower: bounds.iter().map(|b| b.lower).collect(),
            upper: bounds.iter().map(|b| b.upper).collect(),
            equalities: state.equalities.len(),
            inequalities: state.inequalities.len(),
        }
    }

    /// `of` the evaluation at `x`, or NaN in each of `length` places.
    fn numbers(
        &self,
        x: &[f64],
        length: usize,
        of: impl FnOnce(&SlsqpRun<'a>, &Evaluation) -> Vec<f64>,
    ) -> Result<Vec<f64>, Halted> {
        let mut run = self.run.borrow_mut();
        match run.at(x) {
            Ok(evaluation) => Ok(of(&run, &evaluation)),
            Err(_) if run.ledger.halted().is_some() => Err(Halted),
            Err(_) => Ok(vec![f64::NAN; length]),
        }
    }
}

impl CostFunction for BasinProblem<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;
    type Error = Halted;

    fn cost(&self, x: &Vec<f64>) -> Result<f64, Halted> {
        Ok(self.numbers(x, 1, |run, evaluation| {
            vec![run.scale * run.anchor.as_ref().map_or(0.0, |from| from.height(x, evaluation))]
        })?[0])
    }
}

impl Gradient for BasinProblem<'_, '_> {
    type Gradient = Vec<f64>;

    fn gradient(&self, x: &Vec<f64>) -> Result<Vec<f64>, Halted> {
        self.numbers(x, x.len(), |run, evaluation| evaluation.gradient.iter().map(|g| run.scale * g).collect())
    }
}

impl Constraints for BasinProblem<'_, '_> {
    type Set = ConstraintSet<BoxBounds<Vec<f64>>, NoLinearConstraints, NonlinearBlocks<NonlinearBlock, NonlinearBlock>>;

    fn constraints(&self) -> <Self::Set as ConstraintDescription>::Borrowed<'_> {
        ConstraintSet::new()
            .with_bounds(BoxBounds::new(Some(&self.lower), Some(&self.upper)))
            .with_nonlinear_equalities(self.equalities)
            .with_nonlinear_inequalities(self.inequalities)
    }
}

impl NonlinearEqualityValues for BasinProblem<'_, '_> {
    type Param = Vec<f64>;
    type Values = Vec<f64>;
    type Error = Halted;

    fn nonlinear_equalities(&self, x: &Vec<f64>) -> Result<Vec<f64>, ConstraintSolveError<Halted>> {
        let values = self.numbers(x, self.equalities, |run, e| run.equalities.iter().map(|r| r.value(e)).collect());
        Ok(values?)
    }
}

impl NonlinearInequalityValues for BasinProblem<'_, '_> {
    type Param = Vec<f64>;
    type Values = Vec<f64>;
    type Error = Halted;

    fn nonlinear_inequalities(&self, x: &Vec<f64>) -> Result<Vec<f64>, ConstraintSolveError<Halted>> {
        let values = self.numbers(x, self.inequalities, |run, e| run.inequalities.iter().map(|r| r.value(e)).collect());
        Ok(values?)
    }
}

impl ConstraintJacobian for BasinProblem<'_, '_> {
    type Param = Vec<f64>;
    type Jacobian = DenseMatrix;
    type Error = Halted;

    fn constraint_jacobian(&self, x: &Vec<f64>) -> Result<DenseMatrix, ConstraintSolveError<Halted>> {
        let rows = self.equalities + self.inequalities;
        let entries = self.numbers(x, rows * x.len(), |run, evaluation| {
            run.rows().flat_map(|row| evaluation.jacobian[row.constraint].iter().map(move |a| row.factor * a)).collect()
        })?;
        Ok(DenseMatrix::from_row_slice(rows, x.len(), &entries))
    }
}
