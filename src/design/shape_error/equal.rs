//! Distance between a section and a target, at equal parameters.

use super::kernel::{WeightedSquare, weighted_square};
use super::norm::ShapeNorm;
use crate::design::DesignError;
use crate::plane::length;
use crate::scalar::{Over, Scalar};
use crate::spline::{BSplineCurve, GaussRule, KnotVector};
use nalgebra::DMatrix;
use num_dual::Dual2SVec64;

/// The error at equal parameters, prepared for curves on one knot vector.
///
/// All norms are a sum of weighted squared distances between sampled points of the curve, which are linear in its
/// control points, and points of the target, which may be of any scalar. Samples are Gauss points of every span of the
/// merged knots, so that each span is a polynomial piece of both curves.
#[derive(Debug, Clone)]
pub(super) struct EqualParameters<S> {
    norm: ShapeNorm,
    /// Control points a sample depends on: `order` of them from `first`.
    order: usize,
    samples: Vec<Sample<S>>,
    /// `order` weights per sample.
    basis: Vec<f64>,
    /// Length of the target, by which the sum is divided before the root (root mean square only).
    length: S,
}

#[derive(Debug, Clone, Copy)]
struct Sample<S> {
    first: usize,
    target: [S; 2],
    weight: S,
}

impl<S: Scalar> EqualParameters<S> {
    /// Prepares the comparison of curves on `knots` with `target`.
    ///
    /// # Errors
    /// Different domains, or different knots where control points are compared.
    pub fn new(norm: ShapeNorm, target: &BSplineCurve<S>, knots: &KnotVector) -> Result<Self, DesignError> {
        if target.domain() != knots.domain() {
            return Err(DesignError::TargetDomain { target: target.domain(), section: knots.domain() });
        }
        let mut result =
            Self { norm, order: knots.degree() + 1, samples: Vec::new(), basis: Vec::new(), length: S::from(1.0) };
        if norm == ShapeNorm::ControlPoints {
            if target.knots().as_ref() != knots {
                return Err(DesignError::TargetKnots);
            }
            result.order = 1;
            for (first, &point) in target.control_points().iter().enumerate() {
                result.samples.push(Sample { first, target: point, weight: S::from(1.0) });
                result.basis.push(1.0);
            }
        } else {
            result.sample_spans(target, knots);
        }
        if norm == ShapeNorm::RootMeanSquare {
            result.length = result.samples.iter().map(|s| s.weight).sum();
        }
        Ok(result)
    }

    fn sample_spans(&mut self, target: &BSplineCurve<S>, knots: &KnotVector) {
        let mut breaks: Vec<f64> = knots.as_slice().iter().chain(target.knots().as_slice()).copied().collect();
        breaks.sort_by(f64::total_cmp);
        breaks.dedup();
        // exact for the squared distance; two more for the arc length element
        let rule = GaussRule::new(knots.degree().max(target.degree()) + 3);
        for ends in breaks.windows(2) {
            for (u, weight) in rule.on(ends[0], ends[1]) {
                let span = knots.span(u);
                let speed = match self.norm {
                    ShapeNorm::Parameter => S::from(1.0),
                    _ => length(target.tangent_at(u)),
                };
                let first = span - knots.degree();
                self.samples.push(Sample { first, target: target.point_at(u), weight: speed * weight });
                self.basis.extend(knots.basis(span, u));
            }
        }
    }

    fn distance<T: Over<S>>(&self, index: usize, control_points: &[[T; 2]]) -> [T; 2] {
        let sample = &self.samples[index];
        let mut distance = sample.target.map(|t| T::from(0.0) - t);
        let basis = &self.basis[index * self.order..(index + 1) * self.order];
        for (weight, point) in basis.iter().zip(&control_points[sample.first..]) {
            distance[0] += point[0] * *weight;
            distance[1] += point[1] * *weight;
        }
        distance
    }

    fn finish<T: Over<S>>(&self, sum: T) -> T {
        match self.norm {
            ShapeNorm::RootMeanSquare => (sum / self.length).sqrt(),
            _ => sum,
        }
    }

    /// The error of a curve with the given control points, as many as the knots ask for.
    pub fn value<T: Over<S>>(&self, control_points: &[[T; 2]]) -> T {
        let mut sum = T::from(0.0);
        for (index, sample) in self.samples.iter().enumerate() {
            sum += weighted_square(self.distance(index, control_points), sample.weight);
        }
        self.finish(sum)
    }
}

impl EqualParameters<f64> {
    /// Value; adds `factor` times its derivative with respect to the control points to `gradient`.
    ///
    /// The kernel is differentiated in its two components, and carried back through the linear sampling.
    pub fn value_and_gradient(&self, control_points: &[[f64; 2]], factor: f64, gradient: &mut [[f64; 2]]) -> f64 {
        let mut sum = 0.0;
        let outer = match self.norm {
            ShapeNorm::RootMeanSquare => {
                let total: f64 = (0..self.samples.len())
                    .map(|i| weighted_square(self.distance(i, control_points), self.samples[i].weight))
                    .sum();
                num_dual::first_derivative(|s: num_dual::Dual64| self.finish(s), total).1
            }
            _ => 1.0,
        };
        for (index, sample) in self.samples.iter().enumerate() {
            let square = WeightedSquare::at(self.distance(index, control_points), sample.weight);
            sum += square.value;
            let basis = &self.basis[index * self.order..(index + 1) * self.order];
            square.add_slope(factor * outer, basis, &mut gradient[sample.first..]);
        }
        self.finish(sum)
    }

    /// Hessian in design variables through which the control points move linearly, or `None` for the root mean square,
    /// which is not quadratic.
    ///
    /// `tangents[k]` holds the derivative of every control point with respect to variable k. The Hessian is constant.
    pub fn hessian(&self, tangents: &[Vec<[f64; 2]>]) -> Option<DMatrix<f64>> {
        if self.norm == ShapeNorm::RootMeanSquare {
            return None;
        }
        let n = tangents.len();
        // second derivatives of the kernel per unit weight; they do not depend on the distance
        let origin: [Dual2SVec64<2>; 2] = std::array::from_fn(|d| Dual2SVec64::from_re(0.0).derivative(d));
        let kernel = weighted_square(origin, 1.0).v2.0?;
        let mut rows = DMatrix::zeros(2 * self.samples.len(), n);
        let mut weighted = rows.clone();
        for (index, sample) in self.samples.iter().enumerate() {
            let basis = &self.basis[index * self.order..(index + 1) * self.order];
            for (k, tangent) in tangents.iter().enumerate() {
                let mut moved = [0.0; 2];
                for (weight, point) in basis.iter().zip(&tangent[sample.first..]) {
                    moved[0] += point[0] * weight;
                    moved[1] += point[1] * weight;
                }
                for d in 0..2 {
                    rows[(2 * index + d, k)] = moved[d];
                    weighted[(2 * index + d, k)] =
                        sample.weight * (kernel[(d, 0)] * moved[0] + kernel[(d, 1)] * moved[1]);
                }
            }
        }
        Some(rows.tr_mul(&weighted))
    }

    /// Adds `2 Σ ∇r ∇rᵀ`, in the components of the control points, over the residuals r: the components of the
    /// distances by the roots of their weights.
    pub fn add_gauss_newton(&self, matrix: &mut DMatrix<f64>) {
        for (index, sample) in self.samples.iter().enumerate() {
            let basis = &self.basis[index * self.order..(index + 1) * self.order];
            for (p, a) in basis.iter().enumerate() {
                for (q, b) in basis.iter().enumerate() {
                    for d in 0..2 {
                        matrix[(2 * (sample.first + p) + d, 2 * (sample.first + q) + d)] += 2.0 * sample.weight * a * b;
                    }
                }
            }
        }
    }
}
