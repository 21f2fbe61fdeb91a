//! Which end of an outline is the tail, and how the section lies.
//!
//! A nose is round: near it the width grows with the root of the distance. A trailing edge is sharp or has a base.
//! Where the two ends do not differ so, the order of the points decides, and then the abscissa (the tail is to the
//! right).

use super::point::Point;
use super::repair::{Repair, record};
use crate::plane::{between, cross, distance, dot, middle, minus};

/// How a section lies in the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lie {
    /// Unit vector from the nose to the tail; exactly along x for sections that are turned by little.
    pub axis: [f64; 2],
}

/// The linear map of a section that is left as it is.
pub(super) const UNCHANGED: [[f64; 2]; 2] = [[1.0, 0.0], [0.0, 1.0]];
/// Sections turned by less are looked at along x.
const LITTLE_TURN: f64 = 0.2;
/// The nose lies to the right where the chord is turned by more.
const NOSE_RIGHT: f64 = 120.0 * std::f64::consts::PI / 180.0;
/// Chords turned between this and its supplement stand upright.
const UPRIGHT: f64 = 60.0 * std::f64::consts::PI / 180.0;

/// A gap between the ends of the list of more than this share of the extent is a wide base.
const WIDE_BASE: f64 = 0.02;
/// A centroid below the chord by this share of the extent is that of a section cambered downwards.
const CAMBERED: f64 = 1e-3;

/// Finds how a section lies, and mirrors one with its nose to the right or exchanges the axes of one that stands
/// upright and runs clockwise. Returns the linear map that was applied too.
pub(super) fn orient(points: &mut [Point], extent: f64, repairs: &mut Vec<Repair>) -> (Lie, [[f64; 2]; 2]) {
    let turn = turn(points, extent);
    let map = if turn.abs() > NOSE_RIGHT && runs_as_turned(points, extent) {
        record(repairs, Repair::TurnedBack);
        [[-1.0, 0.0], [0.0, -1.0]]
    } else if turn.abs() > NOSE_RIGHT {
        record(repairs, Repair::Mirrored);
        [[-1.0, 0.0], [0.0, 1.0]]
    } else if turn > UPRIGHT && signed_area(points) < 0.0 {
        record(repairs, Repair::AxesExchanged);
        [[0.0, 1.0], [1.0, 0.0]]
    } else {
        UNCHANGED
    };
    if map == UNCHANGED {
        return (Lie::turned(turn), UNCHANGED);
    }
    for point in points.iter_mut() {
        // rows of one number and a zero: exact
        point.xy = map.map(|row| dot(row, point.xy));
    }
    let turn = self::turn(points, extent);
    (Lie::turned(turn), map)
}

/// Whether a section with its nose to the right was turned by 180 degrees: it runs counter-clockwise, as no mirrored
/// section does that begins with its upper surface, and mirrored left to right it would be cambered downwards.
fn runs_as_turned(points: &[Point], extent: f64) -> bool {
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return false };
    let tail = middle(first.xy, last.xy);
    let farthest = points.iter().map(|p| p.xy).max_by(|a, b| distance(*a, tail).total_cmp(&distance(*b, tail)));
    let Some(nose) = farthest.filter(|_| signed_area(points) > 0.0) else { return false };
    let chord = distance(nose, tail);
    // the list may begin at the nose: towards the right in any case
    let axis = minus(nose, tail).map(|c| c / chord.copysign(nose[0] - tail[0]));
    // moment of the area about the chord, from the triangles at the tail; above the chord is left of `axis`
    let pieces = points.windows(2).map(|w| {
        let (p, q) = (minus(w[0].xy, tail), minus(w[1].xy, tail));
        let area = 0.5 * cross(p, q);
        [area, area * (cross(axis, p) + cross(axis, q)) / 3.0]
    });
    let [area, moment] = pieces.fold([0.0; 2], |sum, piece| [sum[0] + piece[0], sum[1] + piece[1]]);
    moment < -CAMBERED * extent * area
}

impl Lie {
    /// Angle of the chord if it stands upright.
    pub fn upright(self) -> Option<f64> {
        let turn = self.axis[1].atan2(self.axis[0]);
        (turn.abs() > UPRIGHT * (1.0 + 1e-9)).then_some(turn)
    }

    /// The chord along x.
    pub fn level() -> Self {
        Self { axis: [1.0, 0.0] }
    }

    fn turned(turn: f64) -> Self {
        let axis = if turn.abs() < LITTLE_TURN { [1.0, 0.0] } else { [turn.cos(), turn.sin()] };
        Self { axis }
    }

    /// Coordinate of a point from the nose towards the tail.
    pub fn along(self, point: &Point) -> f64 {
        dot(self.axis, point.xy)
    }

    /// Components of a vector along and across the chord.
    pub fn components(self, v: [f64; 2]) -> [f64; 2] {
        [dot(self.axis, v), cross(self.axis, v)]
    }
}

pub(super) fn signed_area(points: &[Point]) -> f64 {
    let Some(first) = points.first() else { return 0.0 };
    points.windows(2).map(|w| 0.5 * cross(minus(w[0].xy, first.xy), minus(w[1].xy, first.xy))).sum()
}

/// Two points about as far apart as any.
pub(super) fn farthest_pair(points: &[Point]) -> Option<([f64; 2], [f64; 2])> {
    let farthest =
        |from: [f64; 2]| points.iter().map(|p| p.xy).max_by(|a, b| distance(*a, from).total_cmp(&distance(*b, from)));
    let mut pair = (points.first()?.xy, farthest(points.first()?.xy)?);
    for _ in 0..8 {
        let next = farthest(pair.1)?;
        if distance(next, pair.1) <= distance(pair.0, pair.1) {
            break;
        }
        pair = (pair.1, next);
    }
    Some(pair)
}

/// Angle from the x axis to the direction from the nose to the tail, counter-clockwise positive.
fn turn(points: &[Point], extent: f64) -> f64 {
    let (Some((a, b)), Some((first, last))) = (farthest_pair(points), points.first().zip(points.last())) else {
        return 0.0;
    };
    let start = middle(first.xy, last.xy);
    // `a` is the end at which the list begins, if it begins at one, else the one to the right
    let begins =
        distance(start, a).min(distance(start, b)) < 0.25 * extent && distance(first.xy, last.xy) < 0.3 * extent;
    let nearer = distance(start, a) <= distance(start, b);
    let right = a[0] >= b[0];
    let (a, b) = if (begins && nearer) || (!begins && right) { (a, b) } else { (b, a) };
    // a wide base is judged from its middle, not from the corner that is farther away
    let has_base = begins && distance(first.xy, last.xy) > WIDE_BASE * extent;
    let tail = if has_base && distance(start, a) < 0.25 * extent { start } else { a };
    let ((kind, width), (other, other_width)) = (end(points, tail, b), end(points, b, tail));
    let tail_is_a = match (kind, other) {
        (End::Round, End::Sharp) => false,
        (End::Sharp, End::Round) => true,
        _ if a[0] - b[0] >= -0.5 * distance(a, b) => true,
        // listed from an end to the left: from the tail, if the other end is clearly thicker
        _ => begins && other_width > 1.4 * width,
    };
    let [x, y] = if tail_is_a { minus(a, b) } else { minus(b, a) };
    y.atan2(x)
}

/// The look of an end of an outline.
#[derive(Debug, Clone, Copy, PartialEq)]
enum End {
    Round,
    /// A wedge or a base.
    Sharp,
    /// Somewhere in between.
    Unclear,
}

/// Judges an end by the widths of the outline at distances from there towards the other end, and gives the farthest.
fn end(points: &[Point], end: [f64; 2], other: [f64; 2]) -> (End, f64) {
    let chord = distance(end, other);
    let axis = minus(other, end).map(|c| c / chord);
    let [tip, near, far] = [0.002, 0.02, 0.08].map(|share| width(points, end, axis, share * chord));
    // a base is as wide at its end as behind it; of the rest a wedge grows fourfold and a parabola twofold
    let (tip, growth) = (tip / far, (near - tip) / (far - tip));
    let kind = if tip > 0.6 || (growth < 0.3 && tip < 0.5) {
        End::Sharp
    } else if (0.07..0.3).contains(&tip) && (0.36..0.62).contains(&growth) {
        End::Round
    } else {
        End::Unclear
    };
    (kind, far)
}

/// Width of the closed outline across `axis` at a distance from `end`.
fn width(points: &[Point], end: [f64; 2], axis: [f64; 2], at: f64) -> f64 {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for (i, p) in points.iter().enumerate() {
        let q = &points[(i + 1) % points.len()];
        let (p, q) = (minus(p.xy, end), minus(q.xy, end));
        let (s, t) = (dot(axis, p) - at, dot(axis, q) - at);
        if (s <= 0.0) != (t <= 0.0) {
            let across = cross(axis, between(p, q, s / (s - t)));
            (low, high) = (low.min(across), high.max(across));
        }
    }
    (high - low).max(0.0)
}
