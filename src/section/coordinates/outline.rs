//! From numbered points to one loop in Selig order, with every change recorded.

use super::listing::Listing;
use super::orientation::{Lie, UNCHANGED, farthest_pair, orient, signed_area};
use super::point::Point;
use super::repair::{Repair, record};
use super::strays::{DENSE, drop_outlier, drop_spikes, drop_strays, report_ends, report_spikes};
use super::wobbles::report_wobbles;
use crate::plane::{self, between, bounds, cross, dot, length, middle, minus};
use crate::section::{CoordinateError, TrailingEdge};
use std::collections::HashMap;

/// A loop from the upper to the lower trailing edge.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Outline {
    pub points: Vec<Point>,
    pub trailing_edge: TrailingEdge,
    pub repairs: Vec<Repair>,
    /// Linear map that was applied to the points of the file.
    pub map: [[f64; 2]; 2],
}

/// Different points that make a section.
const FEWEST: usize = 4;
/// Rounds of repairs after which a file counts as beyond repair.
const ROUNDS: usize = 8;
/// Points nearer than this share of the extent are the same.
const SAME: f64 = 1e-8;
/// A gap below this share of the extent is rounding of a file, not a base.
const CLOSED: f64 = 1e-6;
/// A surface that ends further (in extents) before the other has lost points.
const LONGEST_COMPLETION: f64 = 0.05;
/// Points behind both ends of the list by more than this share of the extent belong to the trailing edge.
const AFT: f64 = 0.002;
/// A surface that ends before the other by more than this share of the extent ends short of the trailing edge.
const SHORT: f64 = 0.002;
/// Most of the sides nearby that one missing side of a surface can be as long as.
const MISSING_SIDES: f64 = 2.0;
/// A step of this share of the extent divides two surfaces listed one after the other.
const LEAP: f64 = 0.75;

pub(super) fn assemble(listing: Listing) -> Result<Outline, CoordinateError> {
    let Listing { points: mut given, breaks, surfaces, mut repairs, step, .. } = listing;
    if surfaces.is_none() {
        drop_outlier(&mut given, &mut repairs);
        drop_strays_of(&mut given, &mut repairs);
    }
    if let Some([upper, lower]) = surfaces {
        check_split(&given, [upper, lower], &breaks)?;
    }
    let mut points = join_surfaces(&given, surfaces, &breaks);
    check_closed(&points)?;
    let mut map = UNCHANGED;
    let mut mend = Mend { lie: Lie::level(), step, repairs };
    // one repair may call for another; what comes out must need none, and be read again as it is
    for _ in 0..ROUNDS {
        let (before, recorded) = (points.clone(), mend.repairs.clone());
        let extent = extent(&points);
        let (lie, change) = orient(&mut points, extent, &mut mend.repairs);
        mend.lie = lie;
        map = [0, 1].map(|row| [0, 1].map(|column| (0..2).map(|k| change[row][k] * map[k][column]).sum()));
        let trailing_edge = mend.round(&mut points)?;
        let joined = join_surfaces(&points, None, &[]);
        if points == before && mend.repairs == recorded && joined == points {
            let Some((i, j, [x, y])) = polygon_crossing(&points) else {
                if let Some(turn) = lie.upright() {
                    mend.repairs.push(Repair::Upright { turn });
                }
                report_spikes(&points, extent, step, &mut mend.repairs);
                report_ends(&points, extent, step, &mut mend.repairs);
                report_wobbles(&points, points.len() < DENSE, extent, step, &mut mend.repairs);
                return Ok(Outline { points, trailing_edge, repairs: mend.repairs, map });
            };
            let (first, second) = (points[i].line, points[j].line);
            // edges that cross with one between them: its ends stand in each other's place
            if j != i + 2 {
                return Err(CoordinateError::SelfCrossing { first, second, x, y });
            }
            points.swap(i + 1, i + 2);
            if polygon_crossing(&points).is_some() {
                return Err(CoordinateError::SelfCrossing { first, second, x, y });
            }
            let line = points[i + 2].line.min(points[i + 1].line);
            record(&mut mend.repairs, Repair::Sorted { count: 2, line });
        }
        points = join_surfaces(&points, None, &[]);
    }
    Err(CoordinateError::Unsettled)
}

fn drop_strays_of(points: &mut Vec<Point>, repairs: &mut Vec<Repair>) {
    let extent = extent(points);
    drop_strays(points, extent, repairs);
}

/// Refuses announced numbers of points that divide the list elsewhere than the points do, which leap back along the
/// chord where the second surface begins.
fn check_split(points: &[Point], announced: [usize; 2], breaks: &[usize]) -> Result<(), CoordinateError> {
    let extent = extent(points);
    let Some(at) = divide_at(points, breaks, extent) else { return Ok(()) };
    let leaps = |i: usize| 0 < i && i < points.len() && distance(&points[i - 1], &points[i]) > 0.5 * extent;
    // surfaces that are listed round the outline do not leap
    let joined = |i: usize| 0 < i && i < points.len() && distance(&points[i - 1], &points[i]) <= SAME * extent;
    if at == announced[0] || leaps(announced[0]) || joined(announced[0]) {
        return Ok(());
    }
    let found = [at, points.len() - at];
    Err(CoordinateError::Split { line: points[at].line, announced, found })
}

/// Refuses points that run from one end of the section to the other.
fn check_closed(points: &[Point]) -> Result<(), CoordinateError> {
    let (Some((first, last)), Some((a, b))) = (points.first().zip(points.last()), farthest_pair(points)) else {
        return Ok(());
    };
    let (gap, most) = (distance(first, last), plane::distance(a, b));
    if points.len() < FEWEST || gap <= 0.5 * most {
        return Ok(());
    }
    let at_end = |p: &Point| plane::distance(p.xy, a).min(plane::distance(p.xy, b)) < 0.1 * most;
    if at_end(first) && at_end(last) {
        return Err(CoordinateError::OneSurface { first: first.line, last: last.line });
    }
    Err(CoordinateError::Unfinished { line: if at_end(first) { last.line } else { first.line }, distance: gap })
}

/// The repairs of an outline, and all they share.
struct Mend {
    lie: Lie,
    /// Unit of the last digit.
    step: f64,
    repairs: Vec<Repair>,
}

impl Mend {
    /// One round of repairs.
    fn round(&mut self, points: &mut Vec<Point>) -> Result<TrailingEdge, CoordinateError> {
        let extent = extent(points);
        self.drop_duplicates(points, extent);
        if points.len() < FEWEST {
            return Err(CoordinateError::TooFewPoints { found: points.len(), needed: FEWEST });
        }
        let area = signed_area(points).abs();
        // written so that NaN fails
        if !(area > 1e-6 * extent * extent && extent > 1e-9) {
            return Err(CoordinateError::NoArea { chord: extent, area });
        }
        self.begin_at_tail(points, extent);
        self.drop_base(points, extent);
        self.complete_tail(points, extent)?;
        drop_spikes(points, extent, self.step, &mut self.repairs);
        self.sort_surfaces(points, extent);
        drop_strays(points, extent, &mut self.repairs);
        if signed_area(points) < 0.0 {
            points.reverse();
            self.repairs.push(Repair::Reversed);
        }
        let trailing_edge = self.close_tail(points, extent);
        let different = points.len() - usize::from(trailing_edge == TrailingEdge::Sharp);
        if different < FEWEST {
            return Err(CoordinateError::TooFewPoints { found: different, needed: FEWEST });
        }
        Ok(trailing_edge)
    }

    fn record(&mut self, repair: Repair) {
        record(&mut self.repairs, repair);
    }

    fn drop_duplicates(&mut self, points: &mut Vec<Point>, extent: f64) {
        let mut kept: Vec<Point> = Vec::with_capacity(points.len());
        for point in points.iter() {
            match kept.last() {
                Some(last) if distance(last, point) <= SAME * extent => {
                    self.record(Repair::DuplicateDropped { count: 1, line: point.line });
                }
                _ => kept.push(*point),
            }
        }
        *points = kept;
        self.drop_detours(points, extent);
        self.drop_repeated_blocks(points);
    }

    /// Drops points to which the outline goes and comes back to where it was: points of reference between surfaces.
    fn drop_detours(&mut self, points: &mut Vec<Point>, extent: f64) {
        let mut i = 1;
        while i + 1 < points.len() && points.len() > FEWEST {
            let back = distance(&points[i - 1], &points[i + 1]) <= SAME * extent;
            if back && distance(&points[i - 1], &points[i]) > 0.01 * extent {
                let line = points[i].line;
                points.drain(i..=i + 1);
                self.record(Repair::StrayDropped { count: 1, line });
            } else {
                i += 1;
            }
        }
    }

    /// Drops points that repeat, in the same order, the points just before them.
    fn drop_repeated_blocks(&mut self, points: &mut Vec<Point>) {
        let mut seen: HashMap<[u64; 2], usize> = HashMap::new();
        let mut i = 0;
        while i < points.len() {
            let key = points[i].xy.map(f64::to_bits);
            let size = seen.get(&key).map_or(0, |&earlier| i - earlier);
            let same = |k: usize| points.get(i + k).is_some_and(|p| p.xy == points[i + k - size].xy);
            if size > 1 && i + size < points.len() && (0..size).all(same) {
                let line = points[i].line;
                points.drain(i..i + size);
                self.record(Repair::DuplicateDropped { count: size, line });
                continue;
            }
            seen.insert(key, i);
            i += 1;
        }
    }

    /// Makes a loop begin at its rearmost point, or behind its rearmost edge if that stands upright (a base).
    fn begin_at_tail(&mut self, points: &mut Vec<Point>, extent: f64) {
        let lie = self.lie;
        let x = |p: &Point| lie.along(p);
        let rearmost = points.iter().map(x).fold(f64::NEG_INFINITY, f64::max);
        let foremost = points.iter().map(x).fold(f64::INFINITY, f64::min);
        let Some((first, last)) = points.first().zip(points.last()) else { return };
        let middle = 0.5 * (rearmost + foremost);
        // a list that begins on a surface behind mid-chord has points behind both of its ends
        let ends = x(first).max(x(last));
        let begins_behind = x(first).min(x(last)) > middle;
        if begins_behind && rearmost - ends <= AFT * extent {
            return;
        }
        let closed = distance(first, last) <= CLOSED * extent;
        if closed {
            points.pop();
        }
        let n = points.len();
        let Some(tail) = (0..n).max_by(|&i, &j| x(&points[i]).total_cmp(&x(&points[j]))) else { return };
        let near = |i: usize| {
            let d = lie.components(minus(points[i].xy, points[tail].xy));
            d[0].abs() <= 0.02 * extent && d[0].abs() <= 0.2 * d[1].abs()
        };
        let (before, after) = ((tail + n - 1) % n, (tail + 1) % n);
        // the loop is cut at the base, or at the tail point, which then stands at both ends
        let (start, copy) = if near(after) {
            (after, false)
        } else if near(before) {
            (tail, false)
        } else {
            (tail, true)
        };
        points.rotate_left(start);
        if copy {
            points.push(points[0]);
        }
        self.record(Repair::Rotated { line: points[0].line });
    }

    /// Drops end points that lie on an upright base: an edge across the chord, behind a sharp corner.
    fn drop_base(&mut self, points: &mut Vec<Point>, extent: f64) {
        let lie = self.lie;
        let on_base = |end: &Point, next: &Point, further: &Point| {
            let (d, e) = (lie.components(minus(next.xy, end.xy)), lie.components(minus(further.xy, next.xy)));
            let upright = d[0].abs() < 0.2 * d[1].abs() && d[1].abs() < 0.05 * extent;
            let corner = dot(d, e) < 0.7 * length(d) * length(e);
            upright && corner
        };
        let mut dropped = 0;
        while dropped < 4 && points.len() > FEWEST {
            let n = points.len();
            let line = if on_base(&points[0], &points[1], &points[2]) {
                points.remove(0).line
            } else if on_base(&points[n - 1], &points[n - 2], &points[n - 3]) {
                points.remove(n - 1).line
            } else {
                return;
            };
            self.record(Repair::BasePointDropped { count: 1, line });
            dropped += 1;
        }
    }

    /// Closes a loop of which one surface ends short of the other, because the file names the trailing edge only once,
    /// and drops a point of reference near the trailing edge.
    fn complete_tail(&mut self, points: &mut Vec<Point>, extent: f64) -> Result<(), CoordinateError> {
        let n = points.len();
        let [from, to] = [points[0], points[n - 1]];
        let lie = self.lie;
        let apart = |a: &Point, b: &Point| lie.components(minus(a.xy, b.xy));
        let is_short = |[along, across]: [f64; 2]| along.abs() > SHORT * extent && along.abs() > 2.0 * across.abs();
        let gap = apart(&from, &to);
        if !is_short(gap) {
            return Ok(());
        }
        let distance = length(gap);
        // the shorter of the two sides at an end is one of the surface, even where that end is a point of reference
        let side = |a: usize, b: usize, c: usize| {
            self::distance(&points[a], &points[b]).min(self::distance(&points[b], &points[c]))
        };
        let spacing = side(0, 1, 2).max(side(n - 1, n - 2, n - 3));
        let first_is_stray = !is_short(apart(&points[1], &to));
        let last_is_stray = !is_short(apart(&from, &points[n - 2]));
        // a surface does not run back from its end towards the trailing edge
        let (end, inner, is_stray) =
            if gap[0] > 0.0 { (&to, &points[n - 2], last_is_stray) } else { (&from, &points[1], first_is_stray) };
        let runs_back = is_stray && lie.along(inner) > lie.along(end);
        if distance > MISSING_SIDES * spacing || runs_back {
            let stray = match (first_is_stray, last_is_stray) {
                _ if n <= FEWEST => None,
                (true, false) => Some(0),
                (false, true) => Some(n - 1),
                (true, true) => Some(if gap[0] > 0.0 { n - 1 } else { 0 }),
                (false, false) => None,
            };
            if let Some(stray) = stray {
                let line = points.remove(stray).line;
                self.record(Repair::StrayDropped { count: 1, line });
                return Ok(());
            }
        }
        if distance > (LONGEST_COMPLETION * extent).min(MISSING_SIDES * spacing) {
            let line = if gap[0] > 0.0 { to.line } else { from.line };
            return Err(CoordinateError::Unfinished { line, distance });
        }
        if gap[0] > 0.0 {
            points.push(from);
        } else {
            points.insert(0, to);
        }
        self.repairs.push(Repair::TrailingEdgeCompleted { distance });
        Ok(())
    }

    /// Sorts points that run back along the chord, if that shortens the outline.
    fn sort_surfaces(&mut self, points: &mut [Point], extent: f64) {
        let lie = self.lie;
        let x = |p: &Point| lie.along(p);
        let Some(nose) = (0..points.len()).min_by(|&i, &j| x(&points[i]).total_cmp(&x(&points[j]))) else { return };
        let foremost = x(&points[nose]);
        let length = |p: &[Point]| p.windows(2).map(|w| distance(&w[0], &w[1])).sum::<f64>();
        let mut sorted = points.to_vec();
        // near the nose a surface may bulge forward, so points there keep their order
        let behind = |p: &Point| x(p) > foremost + 0.05 * extent;
        let upper_end = points[..nose].iter().take_while(|p| behind(p)).count();
        let lower_start = points.len() - points[nose..].iter().rev().take_while(|p| behind(p)).count();
        sorted[..upper_end].sort_by(|a, b| x(b).total_cmp(&x(a)));
        sorted[lower_start..].sort_by(|a, b| x(a).total_cmp(&x(b)));
        let count = sorted.iter().zip(points.iter()).filter(|(a, b)| a.xy != b.xy).count();
        let line = sorted.iter().zip(points.iter()).filter(|(a, b)| a.xy != b.xy).map(|(_, b)| b.line).min();
        if count > 0 && length(&sorted) < length(points) * (1.0 - 1e-9) {
            points.copy_from_slice(&sorted);
            self.record(Repair::Sorted { count, line: line.unwrap_or(0) });
        }
    }

    /// Makes a gap that is only rounding vanish to the bit.
    fn close_tail(&mut self, points: &mut [Point], extent: f64) -> TrailingEdge {
        let n = points.len();
        let gap = distance(&points[0], &points[n - 1]);
        if gap > CLOSED * extent {
            return TrailingEdge::Blunt;
        }
        if gap > 0.0 {
            points[0].xy = middle(points[0].xy, points[n - 1].xy);
            self.repairs.push(Repair::TrailingEdgeClosed { gap });
        }
        // also where the two differ in the sign of a zero
        points[n - 1].xy = points[0].xy;
        TrailingEdge::Sharp
    }
}

pub(super) fn distance(a: &Point, b: &Point) -> f64 {
    plane::distance(a.xy, b.xy)
}

/// Larger side of the bounding box.
fn extent(points: &[Point]) -> f64 {
    let [x, y] = bounds(points.iter().map(|p| p.xy));
    // no points have no extent
    (x[1] - x[0]).max(y[1] - y[0]).max(0.0)
}

/// One chain of points. Lednicer files, and files that list two surfaces without a header, give two: the first is
/// turned round so that they meet at the nose.
fn join_surfaces(points: &[Point], surfaces: Option<[usize; 2]>, breaks: &[usize]) -> Vec<Point> {
    let extent = extent(points);
    let divide = match surfaces {
        Some([upper, _]) => Some(upper),
        None => divide_at(points, breaks, extent),
    };
    let Some(at) = divide else { return points.to_vec() };
    let (a, b) = points.split_at(at);
    let (Some(a_first), Some(a_last), Some(b_first), Some(b_last)) = (a.first(), a.last(), b.first(), b.last()) else {
        return points.to_vec();
    };
    // the two ends that lie furthest to the left (together) are the nose; lowest, where the section stands upright
    let [dx, dy] = minus(a_last.xy, a_first.xy);
    let d = usize::from(dy.abs() > dx.abs());
    // announced surfaces that begin at one point and end at two begin at the nose, wherever it lies
    let at_base = |p: &Point, q: &Point| distance(p, q) > SAME * extent;
    let from_nose = surfaces.is_some() && !at_base(a_first, b_first) && at_base(a_last, b_last);
    let nose_first = from_nose || a_first.xy[d] <= a_last.xy[d];
    let nose_second = from_nose || b_first.xy[d] <= b_last.xy[d];
    let mut chain: Vec<Point> = if nose_first { a.iter().rev().copied().collect() } else { a.to_vec() };
    let second: Vec<Point> = if nose_second { b.to_vec() } else { b.iter().rev().copied().collect() };
    // both surfaces name the nose
    let shared = chain.last().zip(second.first()).is_some_and(|(a, b)| distance(a, b) <= SAME * extent);
    chain.extend(second.into_iter().skip(usize::from(shared)));
    chain
}

/// Where a file without a header changes from one surface to the other by a leap back along the chord.
fn divide_at(points: &[Point], breaks: &[usize], extent: f64) -> Option<usize> {
    let leap = |i: usize| distance(&points[i - 1], &points[i]);
    let longest = (1..points.len()).max_by(|&i, &j| leap(i).total_cmp(&leap(j)))?;
    // a surface of two points is a straight one, drawn from end to end
    let both = longest >= 2 && points.len() - longest >= 2;
    let at_break = breaks.contains(&longest) && leap(longest) > 0.5 * extent;
    (both && (leap(longest) > LEAP * extent || at_break)).then_some(longest)
}

/// Two edges of a polygon that cross properly: positions of their first points, and where.
fn polygon_crossing(points: &[Point]) -> Option<(usize, usize, [f64; 2])> {
    let turn = |o: [f64; 2], a: [f64; 2], b: [f64; 2]| cross(minus(a, o), minus(b, o));
    let mut edges: Vec<(f64, f64, usize)> = points
        .windows(2)
        .enumerate()
        .map(|(i, w)| (w[0].xy[0].min(w[1].xy[0]), w[0].xy[0].max(w[1].xy[0]), i))
        .collect();
    edges.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (k, &(_, right, i)) in edges.iter().enumerate() {
        for &(_, _, j) in edges[k + 1..].iter().take_while(|e| e.0 <= right) {
            let (i, j) = (i.min(j), i.max(j));
            let (a, b, c, d) = (points[i].xy, points[i + 1].xy, points[j].xy, points[j + 1].xy);
            let (s, t) = (turn(a, b, c), turn(a, b, d));
            if s * t < 0.0 && turn(c, d, a) * turn(c, d, b) < 0.0 {
                return Some((i, j, between(c, d, s / (s - t))));
            }
        }
    }
    None
}
