//! Mean square distance of two curves, every point from the closest one of the other.

use super::kernel::{WeightedSquare, signed_distance, weighted_square};
use super::matching::{Foot, Sides};
use crate::differentiate::lift_root;
use crate::plane::{distance, length, minus};
use crate::scalar::{Over, Scalar};
use crate::spline::{BSplineCurve, BasisValues, GaussRule, KnotVector, distance_slope, foot};
use nalgebra::DMatrix;
use num_dual::{Dual2_64, Dual2SVec64, DualSVec64};
use std::sync::Arc;

/// Gauss points on a whole curve at least, and on each of its spans.
const SAMPLES: usize = 240;
const SAMPLES_OF_SPAN: usize = 3;

/// A shape and its target, prepared for shapes on one knot vector.
///
/// Half of the error comes from points of the shape and the curve of the target, half from points of the target and
/// the curve of the shape: a part of the target that the shape does not reach counts as much as a part of the shape
/// that the target does not have. The weights of all points add up to one.
#[derive(Debug, Clone)]
pub(super) struct Closest<S> {
    target: BSplineCurve<S>,
    real_target: BSplineCurve<f64>,
    knots: Arc<KnotVector>,
    target_sides: Sides,
    shape_sides: Sides,
    /// Points at fixed parameters of the shape.
    of_shape: Vec<ShapeSample<S>>,
    /// Fixed points of the target.
    of_target: Vec<TargetSample<S>>,
}

#[derive(Debug, Clone)]
struct ShapeSample<S> {
    first: usize,
    basis: BasisValues<f64>,
    upper: bool,
    weight: S,
}

#[derive(Debug, Clone, Copy)]
struct TargetSample<S> {
    point: [S; 2],
    upper: bool,
    weight: S,
}

/// A difference `Σ weight · control point − other`, whose square is a term of the error.
struct Term {
    /// Position of the first control point.
    first: usize,
    basis: BasisValues<f64>,
    /// The difference.
    away: [f64; 2],
    weight: f64,
    /// Direction of the curve at the closest point where that slides along it.
    tangent: Option<[f64; 2]>,
    /// Parameter of the closest point on its curve.
    foot: Foot,
    on_target: bool,
}

impl Term {
    /// The residuals whose squares add up to that of a difference: the signed distance where the closest point slides,
    /// the components of the difference where it stays at an end.
    fn residuals<T: Scalar>(&self, away: [T; 2]) -> Vec<T> {
        match self.tangent {
            Some(tangent) => vec![signed_distance(away, tangent.map(T::from))],
            None => away.to_vec(),
        }
    }

    /// Derivatives of the residuals in the two components of the difference. That of a signed distance is the normal,
    /// as the closest point slides at a right angle to it.
    fn residual_slopes(&self) -> Vec<[f64; 2]> {
        let seeded: [DualSVec64<2>; 2] = std::array::from_fn(|d| DualSVec64::from_re(self.away[d]).derivative(d));
        self.residuals(seeded).iter().map(|r| r.eps.0.map_or([0.0; 2], |eps| [eps[0], eps[1]])).collect()
    }
}

impl<S: Scalar> Closest<S> {
    /// Prepares the comparison of shapes on the knots of `start` with `target`; lengths on the shape are those of
    /// `start`.
    pub fn new(target: &BSplineCurve<S>, start: &BSplineCurve<S>) -> Self {
        let (real_target, real_start) = (target.real(), start.real());
        let (target_sides, shape_sides) = (Sides::of(&real_target), Sides::of(&real_start));
        let knots = start.knots();
        let of_shape = places(start).into_iter().map(|(u, weight)| {
            let span = knots.span(u);
            let (first, basis) = (span - knots.degree(), knots.basis(span, u));
            ShapeSample { first, basis, upper: shape_sides.is_upper(u), weight }
        });
        let of_target = places(target).into_iter().map(|(t, weight)| TargetSample {
            point: target.point_at(t),
            upper: target_sides.is_upper(t),
            weight,
        });
        Self {
            of_shape: of_shape.collect(),
            of_target: of_target.collect(),
            target: target.clone(),
            real_target,
            knots: Arc::clone(knots),
            target_sides,
            shape_sides,
        }
    }

    /// The closest points for a shape: on the target for each point of the shape, and the other way round.
    fn feet(&self, shape: &BSplineCurve<f64>) -> (Vec<Foot>, Vec<Foot>) {
        let (on_target, on_shape) = (self.target_sides.on(&self.real_target), self.shape_sides.on(shape));
        let points = shape.control_points();
        (
            self.of_shape.iter().map(|s| on_target.closest(combine(&s.basis, &points[s.first..]), s.upper)).collect(),
            self.of_target.iter().map(|s| on_shape.closest(s.point.map(|c| c.re()), s.upper)).collect(),
        )
    }

    fn real_shape<T: Scalar>(&self, control_points: &[[T; 2]]) -> Option<BSplineCurve<f64>> {
        let points = control_points.iter().map(|p| p.map(|c| c.re())).collect();
        BSplineCurve::new(Arc::clone(&self.knots), points).ok()
    }

    /// The mean square distance; NaN for control points that are no curve on the knots.
    pub fn value<T: Over<S>>(&self, control_points: &[[T; 2]]) -> T {
        let shape = BSplineCurve::new(Arc::clone(&self.knots), control_points.to_vec());
        let (Ok(shape), Some(real)) = (shape, self.real_shape(control_points)) else { return T::from(f64::NAN) };
        let (on_target, on_shape) = self.feet(&real);
        let mut sum = T::from(0.0);
        for (sample, foot) in self.of_shape.iter().zip(on_target) {
            let point = combine(&sample.basis, &control_points[sample.first..]);
            let on = match lifted(foot, point, &self.real_target, |t: T| self.target.point_and_tangent(t)) {
                Some(parameter) => self.target.point_and_tangent(parameter).0,
                None => self.target.point_at(foot.parameter).map(|c| T::from(0.0) + c),
            };
            sum += weighted_square(minus(point, on), sample.weight);
        }
        for (sample, foot) in self.of_target.iter().zip(on_shape) {
            let point = sample.point.map(|c| T::from(0.0) + c);
            let on = match lifted(foot, point, &real, |u: T| shape.point_and_tangent(u)) {
                Some(parameter) => shape.evaluate(parameter),
                None => shape.point_at(foot.parameter),
            };
            sum += weighted_square(minus(on, point), sample.weight);
        }
        sum
    }
}

/// The parameter of a foot with the derivatives it has; `None` where it is not needed.
///
/// A first derivative of the distance does not depend on where the closest point goes (envelope theorem). Nor is there
/// a second one where the point lies in the centre of curvature of the curve.
fn lifted<T: Scalar>(
    at: Foot,
    point: [T; 2],
    curve: &BSplineCurve<f64>,
    on: impl Fn(T) -> ([T; 2], [T; 2]),
) -> Option<T> {
    if T::NDERIV < 2 || !at.slides {
        return None;
    }
    let slope = || distance_slope(curve, &point.map(|c| c.re()), at.parameter).1;
    lift_root(at.parameter, slope, |u| foot(on(u), point)).ok()
}

/// Gauss points on every span of a curve, each with its share of the length, which add up to one half.
fn places<S: Scalar>(curve: &BSplineCurve<S>) -> Vec<(f64, S)> {
    let spans = curve.knots().spans().count().max(1);
    let rule = GaussRule::new(SAMPLES_OF_SPAN.max(SAMPLES.div_ceil(spans)).min(12));
    let mut places = Vec::new();
    for (_, start, end) in curve.knots().spans() {
        places.extend(rule.on(start, end).map(|(u, weight)| (u, length(curve.tangent_at(u)) * weight)));
    }
    let total: S = places.iter().map(|(_, weight)| *weight).sum();
    places.iter_mut().for_each(|(_, weight)| *weight /= total * 2.0);
    places
}

fn combine<T: Scalar>(basis: &[f64], points: &[[T; 2]]) -> [T; 2] {
    let mut sum = [T::from(0.0); 2];
    for (weight, point) in basis.iter().zip(points) {
        sum[0] += point[0] * *weight;
        sum[1] += point[1] * *weight;
    }
    sum
}

impl Closest<f64> {
    /// All terms of the error of a shape, with the closest points they are measured to.
    fn terms(&self, shape: &BSplineCurve<f64>) -> Vec<Term> {
        let (on_target, on_shape) = self.feet(shape);
        let points = shape.control_points();
        let of_shape = self.of_shape.iter().zip(on_target).map(|(sample, foot)| {
            let (on, tangent) = self.real_target.point_and_tangent(foot.parameter);
            let away = minus(combine(&sample.basis, &points[sample.first..]), on);
            let (first, basis, weight) = (sample.first, sample.basis.clone(), sample.weight);
            Term { first, basis, away, weight, tangent: foot.slides.then_some(tangent), foot, on_target: true }
        });
        let of_target = self.of_target.iter().zip(on_shape).map(|(sample, foot)| {
            let (on, tangent) = shape.point_and_tangent(foot.parameter);
            let span = self.knots.span(foot.parameter);
            let (first, basis) = (span - self.knots.degree(), self.knots.basis(span, foot.parameter));
            let (away, weight) = (minus(on, sample.point), sample.weight);
            Term { first, basis, away, weight, tangent: foot.slides.then_some(tangent), foot, on_target: false }
        });
        of_shape.chain(of_target).collect()
    }

    /// Value; adds `factor` times its derivative with respect to the control points to `gradient`.
    pub fn value_and_gradient(&self, control_points: &[[f64; 2]], factor: f64, gradient: &mut [[f64; 2]]) -> f64 {
        let Some(shape) = self.real_shape(control_points) else { return f64::NAN };
        let mut sum = 0.0;
        for term in self.terms(&shape) {
            let square = WeightedSquare::at(term.away, term.weight);
            sum += square.value;
            square.add_slope(factor, &term.basis, &mut gradient[term.first..]);
        }
        sum
    }

    /// Root of the mean square distance, and the largest distance.
    pub fn distances(&self, control_points: &[[f64; 2]]) -> Option<(f64, f64)> {
        let terms = self.terms(&self.real_shape(control_points)?);
        let square = |a: [f64; 2]| a[0] * a[0] + a[1] * a[1];
        let mean: f64 = terms.iter().map(|t| t.weight * square(t.away)).sum();
        let largest = terms.iter().map(|t| distance(t.away, [0.0; 2])).fold(0.0, f64::max);
        Some((mean.sqrt(), largest))
    }

    /// Adds `2 Σ ∇r ∇rᵀ` over all residuals `r`, in the components of the control points (2 × control point + axis).
    pub fn add_gauss_newton(&self, control_points: &[[f64; 2]], matrix: &mut DMatrix<f64>) {
        let Some(shape) = self.real_shape(control_points) else { return };
        for term in self.terms(&shape) {
            for row in term.residual_slopes() {
                let block: [[f64; 2]; 2] =
                    std::array::from_fn(|a| std::array::from_fn(|b| 2.0 * term.weight * row[a] * row[b]));
                spread(&[(&term.basis, 0)], term.first, |_, _| block, matrix);
            }
        }
    }

    /// Adds `factor` times `2 Σ ∇r r″` to `gradient`, with the second derivatives r″ of the residuals along the motion
    /// that the control points carry.
    pub fn add_curvature(
        &self,
        control_points: &[[Dual2_64; 2]],
        factor: f64,
        gradient: &mut [[f64; 2]],
    ) -> Option<()> {
        let shape = BSplineCurve::new(Arc::clone(&self.knots), control_points.to_vec()).ok()?;
        let real = self.real_shape(control_points)?;
        for (place, term) in self.terms(&real).into_iter().enumerate() {
            let residuals = if term.on_target {
                let point = combine(&term.basis, &control_points[term.first..]);
                self.residuals_of_point(&term, point)
            } else {
                let centre = self.of_target[place - self.of_shape.len()].point;
                residuals_of_curve(&term, &shape, &real, centre.map(Dual2_64::from))
            };
            let mut slope = [0.0; 2];
            for (row, residual) in term.residual_slopes().into_iter().zip(residuals) {
                let bend = 2.0 * factor * term.weight * residual.v2;
                slope[0] += bend * row[0];
                slope[1] += bend * row[1];
            }
            for (weight, point) in term.basis.iter().zip(&mut gradient[term.first..]) {
                point[0] += slope[0] * weight;
                point[1] += slope[1] * weight;
            }
        }
        Some(())
    }

    /// Residuals of a point of the shape that moves along the target.
    fn residuals_of_point<T: Scalar>(&self, term: &Term, point: [T; 2]) -> Vec<T> {
        let on_target = |t: T| self.real_target.point_and_tangent(t);
        match lifted(term.foot, point, &self.real_target, on_target) {
            Some(parameter) => {
                let (on, tangent) = on_target(parameter);
                vec![signed_distance(minus(point, on), tangent)]
            }
            None => term.residuals(minus(point, self.real_target.point_at(term.foot.parameter).map(T::from))),
        }
    }

    /// Adds the exact Hessian in the components of the control points, the motion of the closest points included.
    pub fn add_hessian(&self, control_points: &[[f64; 2]], matrix: &mut DMatrix<f64>) {
        let Some(shape) = self.real_shape(control_points) else { return };
        for term in self.terms(&shape) {
            if term.on_target {
                self.add_hessian_on_target(&term, matrix);
            } else {
                self.add_hessian_on_shape(&term, &shape, matrix);
            }
        }
    }

    /// A point of the shape that moves, against the target that stands still: second derivatives in the two
    /// coordinates of the point.
    fn add_hessian_on_target(&self, term: &Term, matrix: &mut DMatrix<f64>) {
        let on = self.real_target.point_at(term.foot.parameter);
        let point: [Dual2SVec64<2>; 2] =
            std::array::from_fn(|d| Dual2SVec64::from_re(on[d] + term.away[d]).derivative(d));
        let parameter = lifted(term.foot, point, &self.real_target, |t| self.real_target.point_and_tangent(t));
        let on = match parameter {
            Some(parameter) => self.real_target.point_and_tangent(parameter).0,
            None => on.map(Dual2SVec64::from_re),
        };
        let square = weighted_square(minus(point, on), term.weight);
        let Some(second) = square.v2.0 else { return };
        let block: [[f64; 2]; 2] = std::array::from_fn(|a| std::array::from_fn(|b| second[(a, b)]));
        spread(&[(&term.basis, 0)], term.first, |_, _| block, matrix);
    }

    /// A point of the target that stands still, against the curve of the shape: second derivatives in the point of the
    /// curve and its tangent at the closest parameter, which are linear in the control points. Its second derivative
    /// by the parameter counts with its value alone.
    fn add_hessian_on_shape(&self, term: &Term, shape: &BSplineCurve<f64>, matrix: &mut DMatrix<f64>) {
        let span = self.knots.span(term.foot.parameter);
        let rows = self.knots.basis_derivatives(span, term.foot.parameter, 2);
        let points = &shape.control_points()[term.first..];
        let [on, tangent, bend] = [0, 1, 2].map(|k| combine(&rows[k], points));
        let centre = minus(on, term.away).map(Dual2SVec64::<4>::from_re);
        let seed = |k: usize, value: f64| Dual2SVec64::<4>::from_re(value).derivative(k);
        let a = [seed(0, on[0]), seed(1, on[1])];
        let b = [seed(2, tangent[0]), seed(3, tangent[1])];
        let moved = |v: Dual2SVec64<4>| {
            let point = [0, 1].map(|d| a[d] + (b[d] + v * (0.5 * bend[d])) * v);
            (point, [0, 1].map(|d| b[d] + v * bend[d]))
        };
        let slope = || distance_slope(shape, &centre.map(|c| c.re), term.foot.parameter).1;
        let way = match term.foot.slides {
            true => lift_root(0.0, slope, |v| foot(moved(v), centre)).ok(),
            false => None,
        };
        let point = way.map_or(a, |way| moved(way).0);
        let square = weighted_square(minus(point, centre), term.weight);
        let Some(second) = square.v2.0 else { return };
        let block = |i: usize, j: usize| -> [[f64; 2]; 2] {
            std::array::from_fn(|p| std::array::from_fn(|q| second[(2 * i + p, 2 * j + q)]))
        };
        spread(&[(&rows[0], 0), (&rows[1], 1)], term.first, block, matrix);
    }
}

/// Residuals of a fixed point beside the curve of a shape that moves.
fn residuals_of_curve<T: Scalar>(
    term: &Term,
    shape: &BSplineCurve<T>,
    real: &BSplineCurve<f64>,
    centre: [T; 2],
) -> Vec<T> {
    match lifted(term.foot, centre, real, |u: T| shape.point_and_tangent(u)) {
        Some(parameter) => {
            let (on, tangent) = shape.point_and_tangent(parameter);
            vec![signed_distance(minus(on, centre), tangent)]
        }
        None => term.residuals(minus(shape.point_at(term.foot.parameter), centre)),
    }
}

/// Adds second derivatives in points that are linear in the control points, from `first` on, by the given weights.
fn spread(
    rows: &[(&BasisValues<f64>, usize)],
    first: usize,
    block: impl Fn(usize, usize) -> [[f64; 2]; 2],
    matrix: &mut DMatrix<f64>,
) {
    for &(left, i) in rows {
        for &(right, j) in rows {
            let block = block(i, j);
            for (p, a) in left.iter().enumerate() {
                for (q, b) in right.iter().enumerate() {
                    for d in 0..2 {
                        for e in 0..2 {
                            matrix[(2 * (first + p) + d, 2 * (first + q) + e)] += a * b * block[d][e];
                        }
                    }
                }
            }
        }
    }
}
