//! Second derivatives of a design problem.

use super::DesignProblem;
use crate::design::DesignError;
use crate::design::ShapeError;
use crate::design::linearised::LinearisedShape;
use crate::design::quantity::Quantity;
use crate::differentiate::{self, Function};
use crate::ffd::penalty_of_indicator;
use crate::scalar::Scalar;
use nalgebra::{DMatrix, DVector};
use num_dual::{Dual2_64, second_derivative};

impl DesignProblem {
    /// Exact Hessian of the objective in scaled variables.
    ///
    /// On a linear geometry the shape error is quadratic, its Hessian constant, and the penalty's comes from local
    /// second-order duals; whatever else goes through the whole pipeline in hyper-dual numbers.
    pub(super) fn try_hessian(&mut self, x: &[f64]) -> Result<DMatrix<f64>, DesignError> {
        self.set_scaled(x);
        let n = x.len();
        let mut total = DMatrix::zeros(n, n);
        let mut rest = Vec::new();
        let tangents = self.tangents.clone();
        if tangents.is_some() {
            self.deform_in_place();
        }
        for (q, &weight) in self.weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
            match (&self.quantities[q], &tangents) {
                (Quantity::ShapeError, Some(tangents)) => {
                    if self.error_hessian.is_none() {
                        self.error_hessian = self.instruments.error()?.hessian(&tangents.section_tangents(0..n));
                    }
                    match (&self.error_hessian, self.instruments.error()?.hessian_at(&self.work.points)) {
                        (Some(constant), _) => total += constant * weight,
                        (None, Some(of_points)) => total += in_variables(&of_points, tangents) * weight,
                        (None, None) => rest.push(q),
                    }
                }
                (Quantity::FoldPenalty, Some(_)) => {
                    let mut of_net = self.net_matrix();
                    self.instruments.penalty()?.add_hessian(&self.work.net, &mut of_net);
                    self.project(&of_net, weight, &mut total);
                }
                _ => rest.push(q),
            }
        }
        if !rest.is_empty() {
            let part = Partial { problem: self, quantities: &rest };
            let (_, _, hessian) = differentiate::hessian(&part, &self.work.values)?;
            total += hessian;
        }
        self.scale_both(&mut total);
        Ok(total)
    }

    /// Whether the objective is a sum of squares, or of other functions that are convex in quantities which change
    /// smoothly with the variables, as the fold penalty is in the fold indicators.
    pub fn is_sum_of_squares(&self) -> bool {
        let squares = |quantity: &Quantity| match quantity {
            Quantity::ShapeError => self.instruments.error().is_ok_and(ShapeError::is_sum_of_squares),
            Quantity::FoldPenalty | Quantity::PressureError | Quantity::Soft { .. } => true,
            _ => false,
        };
        let mut terms = self.quantities.iter().zip(&self.weights).filter(|(_, weight)| **weight != 0.0);
        terms.all(|(quantity, weight)| *weight > 0.0 && squares(quantity))
    }

    /// The Gauss-Newton matrix of an objective that is a sum of squares, in scaled variables: `2 Σ ∇r ∇rᵀ`, and
    /// `Σ η″ ∇m ∇mᵀ` of a penalty `η(m)`.
    pub(super) fn normal_matrix(&mut self, x: &[f64]) -> Result<DMatrix<f64>, DesignError> {
        self.set_scaled(x);
        let tangents = self.prepare()?;
        let mut total = DMatrix::zeros(x.len(), x.len());
        for q in 0..self.quantities.len() {
            let weight = self.weights[q];
            if weight == 0.0 {
                continue;
            }
            match self.quantities[q].clone() {
                Quantity::ShapeError => {
                    if let Some(of_points) = self.instruments.error()?.gauss_newton_at(&self.work.points) {
                        total += in_variables(&of_points, &tangents) * weight;
                    }
                }
                Quantity::PressureError => {
                    let of_points = self.instruments.pressures()?.pressure_matrix(self.work.posed().0)?;
                    total += in_variables(&of_points, &tangents) * weight;
                }
                Quantity::Soft { quantity, limit } => {
                    let (value, gradient) = self.gradient_of(&quantity, &tangents)?;
                    if limit.square(value) > 0.0 {
                        let gradient = DVector::from_vec(gradient);
                        total.ger(2.0 * weight, &gradient, &gradient, 1.0);
                    }
                }
                _ => self.add_penalty_matrix(weight, &tangents, &mut total)?,
            }
        }
        self.scale_both(&mut total);
        Ok(total)
    }

    /// `2 Σ ∇r r″` over the distances of the closest points, with their second derivatives r″ along a step, in scaled
    /// variables; `None` where there are none.
    pub(super) fn curvature_along(&mut self, x: &[f64], step: &[f64]) -> Option<Vec<f64>> {
        let place = self.quantities.iter().position(|q| *q == Quantity::ShapeError)?;
        let weight = self.weights[place];
        let variables = self.geometry.variables().iter();
        let along: Vec<Dual2_64> =
            variables.zip(x).zip(step).map(|((v, x), s)| Dual2_64::new(x * v.scale, s * v.scale, 0.0)).collect();
        let shape = self.geometry.shape(&along).ok()?;
        self.set_scaled(x);
        let tangents = self.prepare().ok()?;
        self.clear_slopes();
        let error = self.instruments.error().ok()?;
        error.add_curvature(shape.section.curve().control_points(), weight, &mut self.work.point_slope)?;
        let mut sum = self.pull_back(&tangents);
        sum.iter_mut().zip(self.geometry.variables()).for_each(|(s, v)| *s *= v.scale);
        Some(sum)
    }

    /// The part of the fold penalty, over all control points of the box.
    fn add_penalty_matrix(
        &mut self,
        weight: f64,
        tangents: &LinearisedShape,
        total: &mut DMatrix<f64>,
    ) -> Result<(), DesignError> {
        for index in 0..self.work.net.len() {
            self.clear_slopes();
            let work = &mut self.work;
            let penalty = self.instruments.penalty()?;
            let indicator = penalty.indicator_and_gradient(index, &work.net, 1.0, &mut work.net_slope);
            let (_, _, bend) = second_derivative(penalty_of_indicator, indicator);
            // far from a fold the penalty underflows
            if bend > f64::MIN_POSITIVE {
                let slope = DVector::from_vec(self.pull_back(tangents));
                total.ger(weight * bend, &slope, &slope, 1.0);
            }
        }
        Ok(())
    }

    /// The distortion of the box plus the squares of natural steps: steps that keep the cells' areas may be long.
    pub(super) fn distortion(&mut self, x: &[f64]) -> Option<DMatrix<f64>> {
        self.tangents.as_ref()?;
        self.set_scaled(x);
        self.deform_in_place();
        let mut of_net = self.net_matrix();
        self.instruments.penalty.as_ref()?.add_distortion(&self.work.net, &mut of_net);
        let mut metric = DMatrix::zeros(x.len(), x.len());
        self.project(&of_net, 1.0, &mut metric);
        self.scale_both(&mut metric);
        let natural = self.geometry.variables().iter().map(|v| v.scale / v.step);
        natural.enumerate().for_each(|(k, size)| metric[(k, k)] += size * size);
        Some(metric)
    }

    /// A zero matrix over the components of the net.
    fn net_matrix(&self) -> DMatrix<f64> {
        DMatrix::zeros(2 * self.work.net.len(), 2 * self.work.net.len())
    }

    /// Second derivatives in the variables' own units → in scaled variables.
    fn scale_both(&self, matrix: &mut DMatrix<f64>) {
        for (i, a) in self.geometry.variables().iter().enumerate() {
            for (j, b) in self.geometry.variables().iter().enumerate() {
                matrix[(i, j)] *= a.scale * b.scale;
            }
        }
    }

    /// `total += weight · motionᵀ hessian motion`, all of them sparse.
    fn project(&self, of_net: &DMatrix<f64>, weight: f64, total: &mut DMatrix<f64>) {
        let motion = &self.geometry.initial_frame().motion;
        for row in 0..motion.outputs() {
            for column in 0..motion.outputs() {
                let second = weight * of_net[(row, column)];
                if second != 0.0 {
                    for (i, a) in motion.row(row) {
                        for (j, b) in motion.row(column) {
                            total[(i, j)] += second * a * b;
                        }
                    }
                }
            }
        }
    }
}

/// Second derivatives in the components of the section's control points, and where there are more of them than that also in
/// the angles of attack in radians → in the variables.
fn in_variables(of_points: &DMatrix<f64>, tangents: &LinearisedShape) -> DMatrix<f64> {
    let mut columns = DMatrix::zeros(of_points.nrows(), tangents.variables());
    for (variable, tangent) in tangents.section_tangents(0..tangents.variables()).iter().enumerate() {
        for (row, component) in tangent.as_flattened().iter().enumerate() {
            columns[(row, variable)] = *component;
        }
        if let Some(angle) = tangents.angle(variable).map(|k| tangent.as_flattened().len() + k)
            && angle < columns.nrows()
        {
            columns[(angle, variable)] = 1f64.to_radians();
        }
    }
    columns.tr_mul(&(of_points * &columns))
}

/// Part of the objective, for second derivatives through the whole pipeline.
struct Partial<'a> {
    problem: &'a DesignProblem,
    quantities: &'a [usize],
}

impl Function for Partial<'_> {
    type Error = DesignError;
    fn evaluate<S: Scalar>(&self, values: &[S]) -> Result<S, DesignError> {
        let shape = self.problem.geometry.shape(values)?;
        let mut sum = S::from(0.0);
        for &q in self.quantities {
            sum += self.problem.instruments.value(&self.problem.quantities[q], &shape)? * self.problem.weights[q];
        }
        Ok(sum)
    }
}
