//! Cosine-spaced stations along the chord and the interpolation of analytic sections.

use super::{Section, SectionError, TrailingEdge};
use crate::scalar::Scalar;
use crate::spline::{BSplineCurve, EndCondition, SplineError, interpolate};

/// Which side of the nose a station lies on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Surface {
    Upper,
    Lower,
}

/// Control points of an analytic section unless told otherwise (paper, section on the L2 match).
pub(super) const DEFAULT_CONTROL_POINTS: usize = 101;
const LEAST_CONTROL_POINTS: usize = 11;
/// Far beyond any use; a slip of the keyboard must not fill the memory.
const MOST_CONTROL_POINTS: usize = 20_001;

/// Checks a number of control points of an analytic section.
pub(super) fn check_control_points(found: usize) -> Result<(), SectionError> {
    if !(LEAST_CONTROL_POINTS..=MOST_CONTROL_POINTS).contains(&found) || found.is_multiple_of(2) {
        let (least, most) = (LEAST_CONTROL_POINTS, MOST_CONTROL_POINTS);
        return Err(SectionError::ControlPointCount { found, least, most });
    }
    Ok(())
}

/// An analytic section: natural cubic spline through points at cosine stations, `control_points - 2` of them.
///
/// `point(s, surface)` gives the outline at station `s` in (0, 1]; the nose is the origin. The interpolation
/// parameters are even in the cosine angle on each surface, because there `x = cos²` and `y ~ cos` are smooth through
/// the nose; `nose` is the share of the parameter that the upper surface takes.
pub(super) fn analytic_section<S: Scalar>(
    control_points: usize,
    nose: f64,
    trailing_edge: TrailingEdge,
    name: &str,
    point: impl Fn(f64, Surface) -> [S; 2],
) -> Result<Section<S>, SectionError> {
    check_control_points(control_points)?;
    let intervals = control_points - 3;
    let half = intervals / 2;
    let mut points = Vec::with_capacity(intervals + 1);
    let mut parameters = Vec::with_capacity(intervals + 1);
    for i in 0..=intervals {
        // counted from the nearer end, so that symmetric sections are symmetric to the bit
        let from_end = i.min(intervals - i);
        let station = (std::f64::consts::PI * from_end as f64 / intervals as f64).cos().powi(2);
        points.push(match i.cmp(&half) {
            std::cmp::Ordering::Less => point(station, Surface::Upper),
            std::cmp::Ordering::Equal => [S::from(0.0); 2],
            std::cmp::Ordering::Greater => point(station, Surface::Lower),
        });
        parameters.push(if i <= half {
            nose * i as f64 / half as f64
        } else {
            1.0 - (1.0 - nose) * from_end as f64 / half as f64
        });
    }
    if trailing_edge == TrailingEdge::Sharp {
        // equal already, but perhaps not in the sign of a zero
        points[intervals] = points[0];
    }
    let curve = interpolate(&parameters, &points, EndCondition::Natural)?;
    let curve = with_ends(&curve, points[0], points[intervals])?;
    Section::new(curve, trailing_edge, nose, name)
}

/// A clamped curve with its end control points replaced by the end points they equal up to round-off.
pub(super) fn with_ends<S: Scalar>(
    curve: &BSplineCurve<S>,
    first: [S; 2],
    last: [S; 2],
) -> Result<BSplineCurve<S>, SplineError> {
    let mut points = curve.control_points().to_vec();
    if let [start, .., end] = &mut points[..] {
        (*start, *end) = (first, last);
    }
    curve.with_control_points(points)
}
