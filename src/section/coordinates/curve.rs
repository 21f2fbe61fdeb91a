//! The curve through the points: a cubic spline that stays with them.
//!
//! Smooth and well-spaced points are interpolated by one C2 spline. A side that is far longer than its neighbours, such
//! as a flat lower surface drawn by its two ends, would bulge: there further data are laid along the straight side, and
//! where the outline turns sharply at an end of such a side, the curve has a corner (a knot of multiplicity three).

use super::point::Point;
use crate::plane::{between, bounds, cross, distance, dot, minus};
use crate::scalar::Scalar;
use crate::section::stations::with_ends;
use crate::section::{CoordinateError, SectionError};
use crate::spline::{
    BSplineCurve, EndCondition, KnotVector, chord_length_parameters, fit, fit_to_tolerance, interpolate,
};

/// How the curve follows the points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Fit {
    /// Through the points, unless they are rounded more coarsely than they are spaced.
    Interpolate,
    Tolerance(f64),
    ControlPoints(usize),
}

/// A point between two data points: the first of them, and the share of the way to the next.
pub(super) type Place = (usize, f64);

/// How far the curve of a section is from its points, in their unit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Deviation {
    /// Largest distance of a point from the curve at the parameter of the point; zero for an interpolating curve up to
    /// round-off.
    pub points: f64,
    /// Index of that point.
    pub points_at: usize,
    /// Largest distance of the curve from the straight lines between the points: how far it arches over its data.
    pub polygon: f64,
    /// Index of the point before that place.
    pub polygon_at: usize,
}

/// How a curve is made from points: everything that follows from their real parts, so that the curve is linear in them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Plan {
    /// Data of the curve.
    pub places: Vec<Place>,
    pub parameters: Vec<f64>,
    /// Positions in `places` at which the curve has a corner.
    pub corners: Vec<usize>,
    pub fit: Fit,
    /// Tolerance within which rounded points are smoothed.
    pub smoothing: Option<f64>,
    /// Sides that are kept straight, by their first points.
    pub straight: Vec<usize>,
    /// Share of the way from the polygon to the smooth curve at which further data lie, where that curve would enclose
    /// too much or too little.
    pub drawn: Option<f64>,
    /// Area within the smooth curve over that of the polygon, less one.
    pub excess: f64,
    /// Distances of the curve from the points and from the polygon.
    pub deviation: Deviation,
}

/// Turns sharper than this (radians) at the end of a straight side are edges, rounded by a small fraction of the
/// extent.
const EDGE: f64 = 0.08;
/// Size of the rounding of an edge, as a share of the extent.
const ROUNDING: f64 = 0.002;
/// Turns sharper than this (radians) at the end of a straight side are corners of the curve.
pub(super) const CORNER: f64 = 1.0;
/// Distance from the polygon, as a share of the extent, beyond which a curve has left the points.
const FAR: f64 = 0.05;
/// Pieces into which sides are divided where the curve is drawn towards the polygon.
const BETWEEN: usize = 4;

impl Plan {
    /// The plan with given straight sides.
    pub fn with(points: &[[f64; 2]], straight: &[bool], fit: Fit) -> Result<Self, SectionError> {
        let (last, extent) = (points.len() - 1, extent(points));
        let is_corner = |i: usize| {
            let at_straight = i > 0 && i < last && (straight[i - 1] || straight[i]);
            at_straight && turn(points, i) > CORNER
        };
        let (mut places, mut corners) = (Vec::with_capacity(points.len()), Vec::new());
        for i in 0..points.len() {
            if is_corner(i) {
                corners.push(places.len());
            }
            places.push((i, 0.0));
            if i < last && straight[i] {
                // distance from an end within which the curve follows the other side of it
                let reach = |end: usize, beside: Option<f64>| {
                    let beside = beside.filter(|_| !is_corner(end))?;
                    Some(if turn(points, end) > EDGE { ROUNDING * extent } else { beside })
                };
                let length = |j: usize| (j < last).then(|| distance(points[j], points[j + 1]));
                let before = reach(i, i.checked_sub(1).and_then(length));
                let behind = reach(i + 1, length(i + 1));
                places.extend(graded(distance(points[i], points[i + 1]), before, behind).map(|share| (i, share)));
            }
        }
        let data: Vec<[f64; 2]> = places.iter().map(|&place| at(points, place)).collect();
        let parameters = chord_length_parameters(&data)?;
        let straight = (0..last).filter(|&i| straight[i]).collect();
        let deviation = Deviation::default();
        Ok(Self { places, parameters, corners, fit, smoothing: None, straight, drawn: None, excess: 0.0, deviation })
    }

    /// The data of the curve.
    pub fn data<S: Scalar>(&self, points: &[[S; 2]]) -> Vec<[S; 2]> {
        self.places.iter().map(|&place| at(points, place)).collect()
    }

    /// The curve for points of any scalar.
    pub fn curve<S: Scalar>(&self, points: &[[S; 2]]) -> Result<BSplineCurve<S>, SectionError> {
        let data = self.data(points);
        let curve = match (self.fit, self.smoothing) {
            (Fit::ControlPoints(n), _) => fit(&self.parameters, &data, even_knots(&self.parameters, n)?)?,
            (Fit::Tolerance(tolerance), _) | (Fit::Interpolate, Some(tolerance)) => {
                pieces(&self.parameters, &self.corners, &data, |t, p| fit_to_tolerance(t, p, 3, tolerance))?
            }
            (Fit::Interpolate, None) => self.interpolating(&data)?,
        };
        Ok(with_ends(&curve, data[0], data[data.len() - 1])?)
    }

    /// Number of control points of the curve.
    pub fn control_points(&self, points: &[[f64; 2]]) -> Result<usize, SectionError> {
        Ok(self.curve(points)?.control_points().len())
    }

    /// The curve through the data, drawn towards the polygon if the plan says so.
    fn interpolating<S: Scalar>(&self, data: &[[S; 2]]) -> Result<BSplineCurve<S>, SectionError> {
        let natural = |t: &[f64], p: &[[S; 2]]| interpolate(t, p, EndCondition::Natural);
        let smooth = pieces(&self.parameters, &self.corners, data, natural)?;
        let Some(drawn) = self.drawn else { return Ok(smooth) };
        let (mut parameters, mut between_data) = (Vec::new(), Vec::new());
        for (t, p) in self.parameters.windows(2).zip(data.windows(2)) {
            parameters.push(t[0]);
            between_data.push(p[0]);
            for k in 1..BETWEEN {
                let share = k as f64 / BETWEEN as f64;
                let u = t[0] + (t[1] - t[0]) * share;
                parameters.push(u);
                between_data.push(between(between(p[0], p[1], share), smooth.point_at(u), drawn));
            }
        }
        parameters.extend(self.parameters.last());
        between_data.extend(data.last());
        let corners: Vec<usize> = self.corners.iter().map(|&at| BETWEEN * at).collect();
        pieces(&parameters, &corners, &between_data, natural)
    }

    /// The side of the polygon at a parameter.
    pub fn side_at(&self, u: f64) -> usize {
        let next = self.parameters.partition_point(|&t| t <= u).clamp(1, self.places.len() - 1);
        self.places[next - 1].0
    }

    /// Refuses a curve that has left the points.
    pub fn check(&self, points: &[[f64; 2]], lines: &[usize]) -> Result<(), CoordinateError> {
        let Deviation { polygon, polygon_at, points: from_points, points_at } = self.deviation;
        let (distance, at) = if polygon > from_points { (polygon, polygon_at) } else { (from_points, points_at) };
        // written so that NaN fails
        if !(distance <= FAR * extent(points)) {
            let line = lines.get(at).copied().unwrap_or(0);
            return Err(CoordinateError::FarFromPoints { distance, line, fitted: self.fit != Fit::Interpolate });
        }
        Ok(())
    }
}

/// One curve of the pieces between the corners.
fn pieces<S: Scalar>(
    parameters: &[f64],
    corners: &[usize],
    data: &[[S; 2]],
    piece: impl Fn(&[f64], &[[S; 2]]) -> Result<BSplineCurve<S>, crate::spline::SplineError>,
) -> Result<BSplineCurve<S>, SectionError> {
    if corners.is_empty() {
        return Ok(piece(parameters, data)?);
    }
    let ends = corners.iter().copied().chain([data.len() - 1]);
    let (mut first, mut inner, mut control) = (0, Vec::new(), Vec::new());
    for end in ends {
        let (t, p) = (&parameters[first..=end], &data[first..=end]);
        let curve = if t.len() < 4 { interpolate(t, p, EndCondition::Natural)? } else { piece(t, p)? };
        if first > 0 {
            inner.extend([parameters[first]; 3]);
            control.pop();
        }
        let knots = curve.knots().as_slice();
        inner.extend_from_slice(&knots[4..knots.len() - 4]);
        control.extend_from_slice(curve.control_points());
        // the corner itself, not what the solution of the equations makes of it
        if let (Some(slot), true) = (control.last_mut(), end + 1 < data.len()) {
            *slot = data[end];
        }
        first = end;
    }
    let (start, end) = (parameters[0], parameters[parameters.len() - 1]);
    Ok(BSplineCurve::new(KnotVector::clamped(3, start, end, inner)?, control)?)
}

/// A point at a place between data points; a data point to the bit where the share is zero.
fn at<S: Scalar>(points: &[[S; 2]], (index, share): Place) -> [S; 2] {
    if share == 0.0 { points[index] } else { between(points[index], points[index + 1], share) }
}

/// Larger side of the bounding box.
pub(super) fn extent(points: &[[f64; 2]]) -> f64 {
    let [x, y] = bounds(points.iter().copied());
    (x[1] - x[0]).max(y[1] - y[0]).max(0.0)
}

/// Angle by which the polygon turns at a point, without sign.
pub(super) fn turn(points: &[[f64; 2]], i: usize) -> f64 {
    let (a, b) = (minus(points[i], points[i - 1]), minus(points[i + 1], points[i]));
    cross(a, b).abs().atan2(dot(a, b))
}

/// Shares of the way along a side at which data are laid, denser towards the ends where the curve goes on smoothly,
/// from a given distance on.
fn graded(length: f64, before: Option<f64>, behind: Option<f64>) -> impl Iterator<Item = f64> {
    let shares = |first: Option<f64>| {
        let mut shares = Vec::new();
        let Some(first) = first else { return shares };
        let (mut step, mut sum) = ((first / length).clamp(1e-3, 0.25), 0.0);
        while sum + step < 0.45 {
            sum += step;
            shares.push(sum);
            step *= 2.0;
        }
        shares
    };
    let middle = (before.is_some() || behind.is_some()).then_some(0.5);
    let second = shares(behind).into_iter().rev().map(|share| 1.0 - share);
    shares(before).into_iter().chain(middle).chain(second)
}

/// Cubic knots that share the data evenly.
fn even_knots(parameters: &[f64], control_points: usize) -> Result<KnotVector, SectionError> {
    let spans = control_points - 3;
    let last = parameters.len() - 1;
    let inner = (1..spans).map(|i| {
        let at = i as f64 * last as f64 / spans as f64;
        let (index, rest) = (at.floor() as usize, at.fract());
        let next = parameters[(index + 1).min(last)];
        parameters[index] + (next - parameters[index]) * rest
    });
    Ok(KnotVector::clamped(3, 0.0, 1.0, inner)?)
}

/// Real parts of points.
pub(super) fn real<S: Scalar>(points: &[[S; 2]]) -> Vec<[f64; 2]> {
    points.iter().map(|p| p.map(|c| c.re())).collect()
}

/// Lines of points.
pub(super) fn lines(points: &[Point]) -> Vec<usize> {
    points.iter().map(|p| p.line).collect()
}
