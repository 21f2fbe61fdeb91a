//! Where a run stands, and what it makes of an evaluation.

use super::curvature::Curvature;
use super::frame::Frame;
use super::leap::Leaps;
use super::rows::{Row, farthest, rows, short};
use crate::design::{Evaluation, Problem};
use crate::optimize::kkt::Iterate;
use crate::optimize::ledger::Ledger;
use nalgebra::{DMatrix, DVector};

/// Largest shortfall of all rows together, in natural steps, that a step may lead to at the beginning.
const WIDEST_FUNNEL: f64 = 1.0;
/// Shortfall that a step may always lead to: linear constraints are off by the square of a step.
const NARROWEST_FUNNEL: f64 = 0.03;
/// Shortfall of a row, in its own unit, that a step may lead to in any case. The funnel alone measures by the steepest
/// gradients there have been: close to where a cell of a box turns over these are so steep that the funnel lets steps
/// through to the other side, where gradients lead on and not back.
const ALWAYS_IN_REACH: f64 = 0.3;
/// Gain over prediction above which the trust region may grow.
const GOOD: f64 = 0.75;
/// Gain over prediction below which it shrinks.
const POOR: f64 = 0.1;
/// Factor of the price from one iteration to the next, where nothing raises it.
const PRICE_DECAY: f64 = 0.3;
/// Share of the gradient at the start that counts as next to nothing.
const FLAT: f64 = 1e-4;

/// A run on its way.
pub(super) struct SqpRun {
    pub point: Iterate,
    pub frame: Frame,
    pub rows: Vec<Row>,
    pub curvature: Curvature,
    /// The metric in which steps are measured, by the free variables in natural steps.
    pub metric: DMatrix<f64>,
    /// Longest step, in the metric.
    pub radius: f64,
    /// Price of the shortfall of a row in the quadratic program.
    pub price: f64,
    /// Largest shortfall that a step may lead to.
    pub funnel: f64,
    /// Largest shortfall of a row that a step may lead to, in the own unit of the row.
    pub reach: f64,
    /// Steps in a row that were taken for a lower objective in spite of the merit function.
    pub relaxed: usize,
    /// Leaps of the analysis that were met.
    pub leaps: Leaps,
    /// Norm of the gradient at the start.
    slope: f64,
    /// The likely curvature at the start, in a size at which Newton's step is as long as the gradient.
    likely: DMatrix<f64>,
}

impl SqpRun {
    /// A run at its start.
    pub fn new(ledger: &mut Ledger<'_>, frame: Frame, start: &[f64], evaluation: Evaluation) -> Self {
        // an objective that is level at the start still needs a scale
        let slope = frame.slope(&evaluation.gradient).max(1e-6 * ledger.unit(&evaluation));
        let slope = if slope > 1e-200 { slope } else { 1.0 };
        let rows = rows(&ledger.description().constraint_bounds, &frame, &evaluation);
        let metric = frame.metric(ledger, start);
        let point = Iterate::new(ledger, start, evaluation);
        let likely = frame.likely_curvature(ledger, start, &frame.gradient(&point.evaluation.gradient));
        let curvature = Curvature::new(&likely * slope);
        let mut run = Self {
            point,
            frame,
            rows,
            curvature,
            metric,
            radius: 1.0,
            price: 0.0,
            funnel: 0.0,
            reach: 0.0,
            relaxed: 0,
            leaps: Leaps::default(),
            slope,
            likely,
        };
        run.funnel = run.short(&run.point.evaluation).max(WIDEST_FUNNEL);
        run.reach = farthest(&run.rows, &run.point.evaluation).max(WIDEST_FUNNEL);
        run
    }

    /// Begins with this first guess of a step along the gradient, and this radius.
    pub fn stepping(mut self, first_step: f64, radius: f64) -> Self {
        self.curvature = Curvature::new(&self.likely * (self.slope / first_step));
        self.radius = radius;
        self
    }

    /// Forgets what the way to the point has taught, and begins from there.
    pub fn begin_again(&mut self, first_step: f64, radius: f64) {
        self.slope = self.steepness();
        self.curvature = Curvature::new(&self.likely * (self.slope / first_step));
        (self.radius, self.price, self.relaxed) = (radius, 0.0, 0);
        self.rows.iter_mut().for_each(|row| (row.margin, row.weight) = (0.0, 0.0));
        self.funnel = self.short(&self.point.evaluation).max(WIDEST_FUNNEL);
        self.reach = farthest(&self.rows, &self.point.evaluation).max(ALWAYS_IN_REACH);
    }

    /// Gradients of the rows, one a row.
    pub fn row_matrix(&self) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(self.rows.len(), self.frame.size());
        for (i, row) in self.rows.iter().enumerate() {
            let gradient = self.frame.gradient(&self.point.evaluation.jacobian[row.side.constraint]);
            matrix.set_row(i, &(gradient * row.side.factor).transpose());
        }
        matrix
    }

    /// Values of the rows.
    pub fn values(&self, evaluation: &Evaluation) -> Vec<f64> {
        self.rows.iter().map(|row| row.value(evaluation)).collect()
    }

    pub fn gradient(&self) -> DVector<f64> {
        self.frame.gradient(&self.point.evaluation.gradient)
    }

    /// Norm of the gradient, and never next to nothing.
    pub fn steepness(&self) -> f64 {
        self.gradient().norm().max(FLAT * self.slope)
    }

    /// Length of a step in the metric.
    pub fn length(&self, step: &DVector<f64>) -> f64 {
        step.dot(&(&self.metric * step)).max(0.0).sqrt()
    }

    /// Sum of the shortfalls of the rows.
    pub fn short(&self, evaluation: &Evaluation) -> f64 {
        short(&self.values(evaluation))
    }

    /// Whether the run may go to an evaluation, whatever it gains.
    pub fn admits(&self, evaluation: &Evaluation) -> bool {
        let now = &self.point.evaluation;
        self.short(evaluation) <= self.funnel.max(self.short(now))
            && farthest(&self.rows, evaluation) <= self.reach.max(farthest(&self.rows, now))
    }

    /// Sum of the shortfalls of rows of these values, each times its price.
    pub fn charged(&self, values: &[f64]) -> f64 {
        self.rows.iter().zip(values).map(|(row, v)| row.weight * (-v).max(0.0)).sum()
    }

    /// Decrease of the merit function to an evaluation.
    pub fn gained(&self, x: &[f64], evaluation: &Evaluation) -> f64 {
        let before = self.charged(&self.values(&self.point.evaluation));
        before - self.charged(&self.values(evaluation)) - self.point.height(x, evaluation)
    }

    /// Multipliers of the constraints from those of the rows.
    pub fn multipliers(&self, of_rows: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; self.point.evaluation.constraints.len()];
        for (row, z) in self.rows.iter().zip(of_rows) {
            sums[row.side.constraint] += row.side.factor * z;
        }
        sums
    }

    /// Learns the curvature on the way to an evaluation, whether the run goes there or not.
    pub fn learn(&mut self, x: &[f64], evaluation: &Evaluation, multipliers: &[f64]) {
        let from = &self.point.evaluation;
        let change = |end: &[f64], begin: &[f64]| self.frame.gradient(end) - self.frame.gradient(begin);
        let mut changes = vec![change(&evaluation.gradient, &from.gradient)];
        changes.extend(evaluation.jacobian.iter().zip(&from.jacobian).map(|(end, begin)| change(end, begin)));
        let way = self.frame.way(&self.point.x, x);
        self.curvature.learn(way, DMatrix::from_columns(&changes), multipliers);
    }

    /// Trusts the model more or less after a step of a given length that gained `ratio` of what was predicted.
    pub fn adapt(&mut self, ratio: f64, length: f64) {
        if ratio > GOOD && length > 0.7 * self.radius {
            self.radius *= 2.0;
        } else if ratio < POOR {
            self.radius = self.radius.min(0.5 * length);
        }
    }

    /// Goes to a point by a step of a given length.
    pub fn arrive(&mut self, ledger: &mut Ledger<'_>, point: Iterate, length: f64) {
        self.point = point;
        self.price *= PRICE_DECAY;
        for row in &mut self.rows {
            row.narrow(length, &self.point.evaluation);
            row.rescale(&self.frame, &self.point.evaluation);
        }
        if self.relaxed == 0 {
            let wide = (2.0 * self.short(&self.point.evaluation)).max(NARROWEST_FUNNEL);
            self.funnel = self.funnel.min(wide.max(0.5 * self.funnel));
            let far = (2.0 * farthest(&self.rows, &self.point.evaluation)).max(ALWAYS_IN_REACH);
            self.reach = self.reach.min(far.max(0.5 * self.reach));
        }
        self.metric = self.frame.metric(ledger, &self.point.x);
    }

    /// Largest distance of a constraint that holds from its bound.
    pub fn slack(&self) -> f64 {
        let evaluation = &self.point.evaluation;
        let pulls = |row: &&Row| self.point.optimality.multipliers[row.side.constraint] * row.side.factor > 0.0;
        let distance = |row: &Row| (evaluation.constraints[row.side.constraint] - row.side.bound).abs();
        self.rows.iter().filter(pulls).map(distance).fold(0.0, f64::max)
    }
}
