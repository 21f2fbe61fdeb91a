//! The points of one curve that are closest to given points, searched on one side of it.

use crate::plane::{distance, middle, minus};
use crate::spline::{BSplineCurve, distance_slope, isolated};
use std::ops::Range;

/// Length by which a side reaches around the nose, as a share of the distance from nose to tail.
const AROUND_THE_NOSE: f64 = 0.05;
/// Gap between the ends of a curve, as a share of the distance from nose to tail, up to which it has two sides.
const OPEN: f64 = 0.5;
/// Points of the grid on a whole curve at least, and on each of its spans.
const GRID: usize = 400;
const GRID_OF_SPAN: usize = 4;

/// The closest point of a curve: its parameter, and whether it may slide along the curve. One at an end may not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Foot {
    pub parameter: f64,
    pub slides: bool,
}

/// The two sides of a curve, as ranges of a grid of parameters on it.
///
/// The sides overlap around the nose, so that a closest point passes the nose as it likes; but a point of the upper
/// side never finds its closest one on the lower side further back, however thin the tail is.
#[derive(Debug, Clone)]
pub(super) struct Sides {
    parameters: Vec<f64>,
    /// Parameter of the nose, where the curve has two sides.
    nose: Option<f64>,
    upper: Range<usize>,
    lower: Range<usize>,
}

impl Sides {
    /// The sides of a curve that runs from the upper end of the trailing edge over the nose to the lower end.
    pub fn of(curve: &BSplineCurve<f64>) -> Self {
        let spans = curve.knots().spans().count().max(1);
        let share = GRID_OF_SPAN.max(GRID.div_ceil(spans));
        let mut parameters = Vec::with_capacity(spans * share + 1);
        for (_, start, end) in curve.knots().spans() {
            parameters.extend((0..share).map(|i| start + (end - start) * i as f64 / share as f64));
        }
        parameters.push(curve.domain().1);
        let points: Vec<[f64; 2]> = parameters.iter().map(|&u| curve.point_at(u)).collect();
        let last = points.len() - 1;
        let tail = middle(points[0], points[last]);
        let nose = (0..=last).max_by(|&a, &b| distance(points[a], tail).total_cmp(&distance(points[b], tail)));
        let nose = nose.unwrap_or(0);
        let reach = distance(points[nose], tail);
        if distance(points[0], points[last]) > OPEN * reach {
            return Self { parameters, nose: None, upper: 0..last + 1, lower: 0..last + 1 };
        }
        let within = |from: usize, to: usize| -> f64 {
            (from.min(to)..from.max(to)).map(|k| distance(points[k], points[k + 1])).sum()
        };
        let beyond = |k: &usize| within(nose, *k) > AROUND_THE_NOSE * reach;
        let end = (nose..=last).find(beyond).unwrap_or(last);
        let begin = (0..=nose).rev().find(beyond).unwrap_or(0);
        Self { nose: Some(parameters[nose]), parameters, upper: 0..end + 1, lower: begin..last + 1 }
    }

    /// Whether the point at a parameter belongs to the upper side.
    pub fn is_upper(&self, parameter: f64) -> bool {
        self.nose.is_none_or(|nose| parameter <= nose)
    }

    /// The grid of these sides on a curve, to search for closest points.
    pub fn on<'a>(&'a self, curve: &'a BSplineCurve<f64>) -> Grid<'a> {
        Grid { sides: self, curve, points: self.parameters.iter().map(|&u| curve.point_at(u)).collect() }
    }
}

/// Points of a curve at the grid of its sides.
pub(super) struct Grid<'a> {
    sides: &'a Sides,
    curve: &'a BSplineCurve<f64>,
    points: Vec<[f64; 2]>,
}

impl Grid<'_> {
    /// The point of one side of the curve that is closest to `point`.
    ///
    /// All local minima of the distance that could be the lowest are followed to round-off, so that the distance is a
    /// continuous function of the point and of the curve; where two are equally near, it has a kink.
    pub fn closest(&self, point: [f64; 2], upper: bool) -> Foot {
        let window = if upper { self.sides.upper.clone() } else { self.sides.lower.clone() };
        let far: Vec<f64> = self.points[window.clone()].iter().map(|p| distance(*p, point)).collect();
        let least = far.iter().copied().fold(f64::INFINITY, f64::min);
        let length = |k: usize| distance(self.points[window.start + k], self.points[window.start + k + 1]);
        let mut best = (f64::INFINITY, Foot { parameter: self.sides.parameters[window.start], slides: false });
        for k in 0..far.len() {
            let (low, high) = (k.saturating_sub(1), (k + 1).min(far.len() - 1));
            // between two points of the grid the distance falls by no more than the way between them
            let way = (low..high).map(length).fold(0.0, f64::max);
            if far[k] > far[low] || far[k] > far[high] || far[k] > least + way {
                continue;
            }
            let foot = self.descend(point, window.start + low, window.start + k, window.start + high);
            let reached = distance(self.curve.point_at(foot.parameter), point);
            if reached < best.0 {
                best = (reached, foot);
            }
        }
        best.1
    }

    /// The minimum of the distance around the grid point `at`, between those at `low` and `high`.
    fn descend(&self, point: [f64; 2], low: usize, at: usize, high: usize) -> Foot {
        let [low, at, high] = [low, at, high].map(|k| self.sides.parameters[k]);
        let slope = |u: f64| {
            let (on, tangent) = self.curve.point_and_tangent(u);
            let away = minus(on, point);
            away[0] * tangent[0] + away[1] * tangent[1]
        };
        let here = slope(at);
        // an end of the side to which the distance falls is the closest point
        let end = (at == low && here >= 0.0) || (at == high && here <= 0.0);
        if end {
            return Foot { parameter: at, slides: false };
        }
        let (low, high) = if here > 0.0 { (low, at) } else { (at, high) };
        let parameter = isolated(low, high, true, |u| distance_slope(self.curve, &point, u));
        Foot { parameter, slides: true }
    }
}
