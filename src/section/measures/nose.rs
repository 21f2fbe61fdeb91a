//! Leading edge and nose radius.

use super::sampling::dense_parameters;
use crate::differentiate::lift_root;
use crate::plane::distance;
use crate::scalar::Scalar;
use crate::section::{MeasureProblem, Section, SectionError};
use crate::spline::{BSplineCurve, distance_slope, foot, isolated};

/// No curve point is farther from the trailing edge than all around it.
const NO_LEADING_EDGE: SectionError =
    SectionError::NoMeasure { measure: "leading edge", reason: MeasureProblem::NoExtreme };

/// Two curve points are equally far from the trailing edge.
const TIED: SectionError =
    SectionError::NoMeasure { measure: "leading edge", reason: MeasureProblem::Tied { instead: "\"chord\"" } };

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
        // straight up to round-off, as on both sides of a sharp nose
        let chord = distance(self.nose(), self.trailing_edge_middle()).re();
        if (curvature.re() * chord).abs() < 1e-9 {
            return Err(SectionError::NoMeasure { measure: "nose_radius", reason: MeasureProblem::Singular });
        }
        Ok(curvature.recip())
    }

    /// Parameter of the leading edge: the curve point farthest from the middle of the trailing edge.
    ///
    /// It jumps where two points are equally far, to 1e-12 chords.
    ///
    /// # Errors
    /// No such point inside the curve, or a curve that is a circle about the trailing edge there;
    /// [`MeasureProblem::Tied`] where derivatives are wanted and two points are equally far.
    pub fn leading_edge_parameter(&self) -> Result<S, SectionError> {
        let tail = self.trailing_edge_middle();
        let real = self.curve().real();
        let u = farthest_parameter(&real, tail.map(|c| c.re()))?;
        if S::NDERIV > 0 && rivals(&real, tail.map(|c| c.re()), u) {
            return Err(TIED);
        }
        let slope = || distance_slope(&real, &tail.map(|c| c.re()), u).1;
        lift_root(u, slope, |u| foot(self.curve().point_and_tangent(u), tail)).map_err(|_| NO_LEADING_EDGE)
    }

    /// The leading edge: the curve point farthest from the middle of the trailing edge.
    ///
    /// # Errors
    /// As [`leading_edge_parameter`](Self::leading_edge_parameter).
    pub fn leading_edge(&self) -> Result<[S; 2], SectionError> {
        Ok(self.curve().evaluate(self.leading_edge_parameter()?))
    }
}

/// The parameter of the curve point farthest from `tail`, to round-off.
pub(in crate::section) fn farthest_parameter(curve: &BSplineCurve<f64>, tail: [f64; 2]) -> Result<f64, SectionError> {
    let parameters = dense_parameters(curve);
    let distances: Vec<f64> = parameters.iter().map(|&u| distance(curve.point_at(u), tail)).collect();
    let best = (0..distances.len()).max_by(|&a, &b| distances[a].total_cmp(&distances[b]));
    let best = best.filter(|&i| i > 0 && i + 1 < parameters.len()).ok_or(NO_LEADING_EDGE)?;
    // the distance grows before and falls after its maximum
    let (low, high) = (parameters[best - 1], parameters[best + 1]);
    let slope = |u: f64| distance_slope(curve, &tail, u);
    if !(slope(low).0 >= 0.0 && slope(high).0 <= 0.0) {
        return Err(NO_LEADING_EDGE);
    }
    let u = isolated(low, high, false, slope);
    // written so that NaN fails
    if slope(u).1 < 0.0 { Ok(u) } else { Err(NO_LEADING_EDGE) }
}

/// Whether another point of the curve than that at `best` is as far from `tail`, to 1e-12 of the distance.
fn rivals(curve: &BSplineCurve<f64>, tail: [f64; 2], best: f64) -> bool {
    let parameters = dense_parameters(curve);
    let far = |u: f64| distance(curve.point_at(u), tail);
    let (distances, most) = (parameters.iter().map(|&u| far(u)).collect::<Vec<_>>(), far(best));
    (1..parameters.len().saturating_sub(1)).any(|k| {
        let [before, here, after] = [k - 1, k, k + 1].map(|k| distances[k]);
        let (low, high) = (parameters[k - 1], parameters[k + 1]);
        if here < before || here < after || here < most * (1.0 - 1e-3) || (low <= best && best <= high) {
            return false;
        }
        let rival = isolated(low, high, false, |u| distance_slope(curve, &tail, u));
        far(rival) >= most * (1.0 - 1e-12)
    })
}
