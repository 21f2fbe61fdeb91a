//! The steps that the model of a run proposes.

use super::quadratic::{ElasticProgram, ProgramSolution};
use super::rows::short;
use super::state::SqpRun;
use nalgebra::{DMatrix, DVector};

/// Price of a shortfall over the norm of the gradient, to begin with.
const LEAST_PRICE: f64 = 10.0;
/// Price over the norm of the gradient that is not raised any further.
const MOST_PRICE: f64 = 1e9;
/// Price of a shortfall in the merit function over the norm of the gradient, at least: no row is left for nothing.
const LEAST_WEIGHT: f64 = 0.1;
/// Share of the relief that any price buys with which a price is content.
const RELIEF: f64 = 0.9;
/// Models solved at most to find a step of the length of the radius.
const TRIALS: usize = 40;
/// Length over the radius with which that search is content, and that it takes at most.
const LENGTHS: [f64; 2] = [0.7, 1.1];

/// A step that the model proposes.
pub(super) struct Proposal {
    pub step: DVector<f64>,
    /// Multipliers of the constraints as the step sees them.
    pub multipliers: Vec<f64>,
    /// Decrease of the merit function that the model predicts.
    pub predicted: f64,
    /// Decrease of the objective that the model predicts.
    pub lower: f64,
    /// Linearised rows at the end of the step.
    pub linear: Vec<f64>,
    /// Length in the metric.
    pub length: f64,
}

/// Rows at the end of a step, as their gradients tell.
fn ends(rows: &DMatrix<f64>, values: &[f64], step: &ProgramSolution) -> Vec<f64> {
    (rows * &step.d).iter().zip(values).map(|(a, v)| a + v).collect()
}

impl SqpRun {
    /// The lowest point of a model under the linearised rows and bounds.
    pub fn solve_for(
        &self,
        rows: &DMatrix<f64>,
        values: &[f64],
        price: f64,
        gradient: &DVector<f64>,
        hessian: &DMatrix<f64>,
    ) -> Option<ProgramSolution> {
        let (lower, upper) = self.frame.room(&self.point.x, self.radius);
        let needed: Vec<f64> = values.iter().map(|v| -v).collect();
        ElasticProgram {
            gradient: gradient.as_slice(),
            hessian,
            rows,
            needed: &needed,
            penalties: &vec![price; values.len()],
            lower: &lower,
            upper: &upper,
        }
        .solve()
    }

    /// The step of the model within the trust region: as much of the metric is added to the curvature as keeps the step
    /// from being longer than the radius.
    fn trusted(&self, rows: &DMatrix<f64>, values: &[f64], price: f64) -> Option<ProgramSolution> {
        let gradient = self.gradient();
        let solve = |added: f64| {
            let hessian = self.curvature.matrix() + &self.metric * added;
            let step = self.solve_for(rows, values, price, &gradient, &hessian)?;
            let length = self.length(&step.d);
            Some((step, length))
        };
        let (step, length) = solve(0.0)?;
        let [enough, most] = LENGTHS.map(|share| share * self.radius);
        if length <= most {
            return Some(step);
        }
        // between too much, which is too short, and too little, which is too long
        let (mut little, mut much) = (0.0, f64::INFINITY);
        let mut added = self.curvature.matrix().diagonal().amax() * length / self.radius;
        let mut best = None;
        for _ in 0..TRIALS {
            let (step, length) = solve(added)?;
            if length > most {
                little = added;
            } else {
                much = added;
                best = Some(step);
                if length >= enough {
                    break;
                }
            }
            added = match (little > 0.0, much.is_finite()) {
                (true, true) => (little * much).sqrt(),
                (true, false) => 10.0 * little,
                _ => 0.1 * much,
            };
        }
        best
    }

    /// The step at a price that is raised until nearly all relief is bought that any price buys (Byrd, Nocedal and
    /// Waltz, Optim. Methods Softw. 23, 2008).
    fn steered(&mut self, rows: &DMatrix<f64>, values: &[f64]) -> Option<ProgramSolution> {
        let slope = self.steepness();
        self.price = self.price.max(LEAST_PRICE * slope);
        let mut step = self.trusted(rows, values, self.price)?;
        let (now, left) = (short(values), |step: &ProgramSolution| short(&ends(rows, values, step)));
        if left(&step) <= 1e-9 * (1.0 + now) {
            return Some(step);
        }
        let Some(best) = self.trusted(rows, values, 1e3 * self.price) else { return Some(step) };
        let attainable = now - left(&best);
        while now - left(&step) < RELIEF * attainable && self.price < MOST_PRICE * slope {
            self.price *= 10.0;
            step = self.trusted(rows, values, self.price)?;
        }
        Some(step)
    }

    /// The step of the model from the point.
    pub fn propose(&mut self) -> Option<Proposal> {
        let (matrix, values) = (self.row_matrix(), self.values(&self.point.evaluation));
        let step = self.steered(&matrix, &values)?;
        // a price for each row that its multiplier justifies, falling slowly where it is not needed
        let least = LEAST_WEIGHT * self.steepness();
        for (row, z) in self.rows.iter_mut().zip(&step.multipliers) {
            row.weight = z.max(0.5 * (row.weight + z)).max(least);
        }
        Some(self.proposal(step, &matrix, &values))
    }

    /// The step of the model where the rows are off by what a first step has found beyond their gradients.
    pub fn correct(&self, corrected: &[f64]) -> Option<Proposal> {
        let matrix = self.row_matrix();
        let step = self.trusted(&matrix, corrected, self.price)?;
        Some(self.proposal(step, &matrix, corrected))
    }

    fn proposal(&self, step: ProgramSolution, matrix: &DMatrix<f64>, values: &[f64]) -> Proposal {
        let linear = ends(matrix, values, &step);
        let d = &step.d;
        let model = self.gradient().dot(d) + 0.5 * d.dot(&(self.curvature.matrix() * d));
        let relief = self.charged(&self.values(&self.point.evaluation)) - self.charged(&linear);
        Proposal {
            predicted: relief - model,
            lower: -model,
            multipliers: self.multipliers(&step.multipliers),
            linear,
            length: self.length(d),
            step: step.d,
        }
    }
}
