//! Leading edge and nose radius.

use crate::differentiate::lift_root;
use crate::scalar::Scalar;
use crate::section::{MeasureProblem, Section, SectionError};
use crate::spline::BSplineCurve;
use num_dual::Dual64;

impl<S: Scalar> Section<S> {
    /// Radius of curvature at the nose parameter: positive where the outline is convex there.
    ///
    /// The nose parameter is fixed, so the radius is a smooth function of the control points. (Curvature of a cubic
    /// spline has a kink at each knot, which a moving parameter would cross.)
    ///
    /// # Errors
    /// No curvature at the nose.
    pub fn nose_radius(&self) -> Result<S, SectionError> {
        let curvature = self.curve().curvature(S::from(self.nose_parameter()))?;
        if curvature.re() == 0.0 {
            return Err(SectionError::NoMeasure { measure: "nose_radius", reason: MeasureProblem::Singular });
        }
        Ok(curvature.recip())
    }

    /// Parameter of the leading edge: the curve point farthest from the middle of the trailing edge.
    ///
    /// Jumps where two points are equally far.
    ///
    /// # Errors
    /// No such point inside the curve, or a curve that is a circle about the trailing edge there.
    pub fn leading_edge_parameter(&self) -> Result<S, SectionError> {
        let u = farthest_parameter(&self.curve().real(), self.real().trailing_edge_middle())?;
        let tail = self.trailing_edge_middle();
        let real = self.curve().real();
        let slope = stationarity_slope(&real, tail.map(|c| c.re()), u);
        Ok(lift_root(u, slope, |u| stationarity(self.curve().point_and_tangent(u), tail)))
    }

    /// The leading edge: the curve point farthest from the middle of the trailing edge.
    ///
    /// # Errors
    /// As [`leading_edge_parameter`](Self::leading_edge_parameter).
    pub fn leading_edge(&self) -> Result<[S; 2], SectionError> {
        Ok(self.curve().evaluate(self.leading_edge_parameter()?))
    }
}

/// Half the derivative of the squared distance from `tail` along the curve.
fn stationarity<S: Scalar>((point, tangent): ([S; 2], [S; 2]), tail: [S; 2]) -> S {
    (point[0] - tail[0]) * tangent[0] + (point[1] - tail[1]) * tangent[1]
}

fn stationarity_slope(curve: &BSplineCurve<f64>, tail: [f64; 2], u: f64) -> f64 {
    stationarity(super::real_point_and_tangent(curve, Dual64::new(u, 1.0)), tail.map(Dual64::from)).eps
}

/// The parameter of the curve point farthest from `tail`, to round-off.
pub(in crate::section) fn farthest_parameter(curve: &BSplineCurve<f64>, tail: [f64; 2]) -> Result<f64, SectionError> {
    let missing = SectionError::NoMeasure { measure: "leading edge", reason: MeasureProblem::NoExtreme };
    let parameters = super::dense_parameters(curve);
    let distance = |u: f64| {
        let [x, y] = curve.point_at(u);
        (x - tail[0]).hypot(y - tail[1])
    };
    let distances: Vec<f64> = parameters.iter().map(|&u| distance(u)).collect();
    let Some(best) = (0..distances.len()).max_by(|&a, &b| distances[a].total_cmp(&distances[b])) else {
        return Err(missing);
    };
    if best == 0 || best + 1 == parameters.len() {
        return Err(missing);
    }
    // the distance grows before and falls after its maximum
    let (mut low, mut high) = (parameters[best - 1], parameters[best + 1]);
    let slope = |u: f64| stationarity(curve.point_and_tangent(u), tail);
    if !(slope(low) >= 0.0 && slope(high) <= 0.0) {
        return Err(missing);
    }
    let mut u = parameters[best];
    for _ in 0..200 {
        let value = slope(u);
        if value == 0.0 {
            break;
        }
        if value > 0.0 {
            low = u
        } else {
            high = u
        }
        let newton = u - value / stationarity_slope(curve, tail, u);
        let next = if low < newton && newton < high { newton } else { 0.5 * (low + high) };
        if next == u || high - low <= f64::EPSILON * high.abs() {
            break;
        }
        u = next;
    }
    // written so that NaN fails
    if stationarity_slope(curve, tail, u) < 0.0 { Ok(u) } else { Err(missing) }
}
