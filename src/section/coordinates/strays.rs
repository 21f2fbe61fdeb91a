//! Points that do not belong to the outline: points of reference before or behind it, and points off the line of all
//! their neighbours.

use super::point::Point;
use super::repair::{Repair, record};
use crate::plane::{between, bounds, distance, dot, minus};

/// Fewest points that make an outline from which others can be told.
const FEWEST: usize = 10;
/// A point off the line of its neighbours by this many times what they are off it is wrong, or may be.
const CERTAIN: f64 = 20.0;
const SUSPECT: f64 = 8.0;
/// A point off the line of its neighbours by less than this share of the extent may be meant so.
const CERTAIN_SHARE: f64 = 0.002;
const SUSPECT_SHARE: f64 = 0.0008;
/// An end is suspect if it is off the run of the others by this share of the extent, and so many times what those are.
const END_SHARE: f64 = 0.005;
const END_RATIO: f64 = 12.0;
/// A side so many times longer than both neighbours may be a gap; at an end there is one neighbour.
const GAP: f64 = 3.5;
const END_GAP: f64 = 4.5;
/// A side shorter than this share of the extent is no gap.
const GAP_SHARE: f64 = 0.05;
/// Points of an outline that is sampled densely.
pub(super) const DENSE: usize = 60;
/// Most points that are dropped; a file with more is not understood.
const MOST_SPIKES: usize = 4;

/// Drops points so far away that all others together are small beside them: slips of the decimal point.
pub(super) fn drop_outlier(points: &mut Vec<Point>, repairs: &mut Vec<Repair>) {
    while let Some(index) = outlier(points) {
        let line = points.remove(index).line;
        record(repairs, Repair::StrayDropped { count: 1, line });
    }
}

fn outlier(points: &[Point]) -> Option<usize> {
    const FACTOR: f64 = 5.0;
    if points.len() <= FEWEST {
        return None;
    }
    let extent = |skipped: Option<usize>| {
        let others = points.iter().enumerate().filter(|(i, _)| Some(*i) != skipped);
        let [x, y] = bounds(others.map(|(_, p)| p.xy));
        (x[1] - x[0]).max(y[1] - y[0])
    };
    let all = extent(None);
    // one of the points on the sides of the bounding box
    let most = |key: fn(&Point) -> f64| (0..points.len()).max_by(|&i, &j| key(&points[i]).total_cmp(&key(&points[j])));
    let keys: [fn(&Point) -> f64; 4] = [|p| p.xy[0], |p| -p.xy[0], |p| p.xy[1], |p| -p.xy[1]];
    keys.into_iter().filter_map(most).find(|&i| FACTOR * extent(Some(i)) < all)
}

/// Drops a first or last point far from an outline that is closed without it.
pub(super) fn drop_strays(points: &mut Vec<Point>, extent: f64, repairs: &mut Vec<Repair>) {
    for _ in 0..2 {
        let n = points.len();
        if n <= FEWEST {
            return;
        }
        let between = |i: usize, j: usize| distance(points[i].xy, points[j].xy);
        let closed = |gap: f64| gap < 0.05 * extent;
        let stray = if closed(between(1, n - 1)) && between(0, 1) > 0.1 * extent && between(0, n - 1) > 0.1 * extent {
            0
        } else if closed(between(0, n - 2)) && between(n - 2, n - 1) > 0.1 * extent && between(0, n - 1) > 0.1 * extent
        {
            n - 1
        } else {
            return;
        };
        let point = points.remove(stray);
        record(repairs, Repair::StrayDropped { count: 1, line: point.line });
    }
}

/// Drops points that are certainly off the line of their neighbours.
pub(super) fn drop_spikes(points: &mut Vec<Point>, extent: f64, step: f64, repairs: &mut Vec<Repair>) {
    let mut dropped = 0;
    while dropped < MOST_SPIKES && points.len() > FEWEST {
        let least = (CERTAIN_SHARE * extent).max(6.0 * step);
        let Some((index, distance)) = worst_spike(points, least, CERTAIN) else { return };
        let line = points.remove(index).line;
        record(repairs, Repair::SpikeDropped { count: 1, line, distance });
        dropped += 1;
    }
}

/// Reports points that may be off the line of their neighbours.
pub(super) fn report_spikes(points: &[Point], extent: f64, step: f64, repairs: &mut Vec<Repair>) {
    if points.len() <= FEWEST {
        return;
    }
    let least = (SUSPECT_SHARE * extent).max(6.0 * step);
    for index in 1..points.len() - 1 {
        let line = points[index].line;
        if let Some(distance) = spike(points, index, least, SUSPECT) {
            record(repairs, Repair::SpikeSuspected { count: 1, line, distance });
        }
        for size in 2..=3 {
            if let Some(distance) = offset(points, index, size, 2.0 * least, SUSPECT) {
                record(repairs, Repair::SpikeSuspected { count: size, line, distance });
            }
        }
    }
}

/// Distance of a run of points from the cubic through the four around it, if it is at least `least` and `ratio` times
/// that of the points around it from such curves without the run.
fn offset(points: &[Point], index: usize, size: usize, least: f64, ratio: f64) -> Option<f64> {
    let n = points.len();
    if n < DENSE || index < 3 || index + size + 3 > n {
        return None;
    }
    let around = [index - 2, index - 1, index + size, index + size + 1].map(|i| points[i].xy);
    let run = &points[index..index + size];
    let own = run.iter().map(|p| from_polynomial(p.xy, around, least)).fold(f64::INFINITY, f64::min);
    // written so that NaN fails
    if !(own >= least) || distance(around[1], around[2]) > 6.0 * distance(around[0], around[1]) {
        return None;
    }
    let without = |i: usize| points[i + if i >= index { size } else { 0 }].xy;
    let others = (index - 2..(index + 2).min(n - size - 2)).map(|i| off_the_line::<4>(n - size, i, without, 0.0));
    (own > ratio * others.fold(0.0, f64::max)).then_some(own)
}

/// Reports first and last points off the line on which the others run out.
pub(super) fn report_ends(points: &[Point], extent: f64, step: f64, repairs: &mut Vec<Repair>) {
    let n = points.len();
    if n <= FEWEST {
        return;
    }
    let least = (END_SHARE * extent).max(6.0 * step);
    for (line, run) in [(points[0].line, false), (points[n - 1].line, true)] {
        let at = |i: usize| points[if run { n - 1 - i } else { i }].xy;
        let others = off_the_run(1, at).max(off_the_run(2, at));
        let own = off_the_run(0, at);
        // a parabola tells nothing far beyond its points
        let near = distance(at(0), at(1)) < 3.0 * distance(at(1), at(2));
        if near && own > least && own > END_RATIO * others {
            record(repairs, Repair::SpikeSuspected { count: 1, line, distance: own });
        }
    }
}

/// Sides far longer than their neighbours, by their first points.
pub(super) fn gaps(points: &[[f64; 2]], extent: f64) -> Vec<usize> {
    let n = points.len();
    if n <= FEWEST {
        return Vec::new();
    }
    let length = |i: usize| distance(points[i], points[i + 1]);
    let is_gap = |i: &usize| {
        let beside = [i.checked_sub(1).map(length), (i + 2 < n).then(|| length(i + 1))];
        let ratio = if beside.iter().flatten().count() == 2 { GAP } else { END_GAP };
        let widest = beside.into_iter().flatten().fold(0.0, f64::max);
        length(*i) > ratio * widest && length(*i) > GAP_SHARE * extent
    };
    (0..n - 1).filter(is_gap).collect()
}

/// Distance of a point from where the parabola through the three behind it arrives after the length of the side.
fn off_the_run(index: usize, at: impl Fn(usize) -> [f64; 2]) -> f64 {
    let p = [0, 1, 2, 3].map(|k| at(index + k));
    let mut t = [0.0; 4];
    for k in 1..4 {
        t[k] = t[k - 1] + distance(p[k], p[k - 1]).max(f64::MIN_POSITIVE);
    }
    let weight = |k: usize| (1..4).filter(|&j| j != k).map(|j| -t[j] / (t[k] - t[j])).product::<f64>();
    let weights = [1, 2, 3].map(weight);
    distance(p[0], [0, 1].map(|d| (0..3).map(|k| weights[k] * p[k + 1][d]).sum::<f64>()))
}

fn worst_spike(points: &[Point], least: f64, ratio: f64) -> Option<(usize, f64)> {
    let found = (1..points.len() - 1).filter_map(|i| spike(points, i, least, ratio).map(|distance| (i, distance)));
    found.max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Distance of a point from the curve through its neighbours, if it is at least `least` and `ratio` times the distance
/// that the neighbours have from such curves without that point.
fn spike(points: &[Point], index: usize, least: f64, ratio: f64) -> Option<f64> {
    let few = spike_among::<4>(points, index, least, ratio);
    // curves of a higher degree need points on both sides, and many of them
    let inside = points.len() >= DENSE && index >= 3 && index + 3 < points.len();
    few.or_else(|| if inside { spike_among::<6>(points, index, least, ratio) } else { None })
}

/// A spike as curves through `NEAR` neighbours show it.
fn spike_among<const NEAR: usize>(points: &[Point], index: usize, least: f64, ratio: f64) -> Option<f64> {
    let all = |i: usize| points[i].xy;
    // beside an end the neighbours stand on one side
    let sided = match index == 1 || index + 2 == points.len() {
        true if points.len() < DENSE => 4.0,
        true => 2.0,
        false => 1.0,
    };
    let own = off_the_line::<NEAR>(points.len(), index, all, sided * least);
    // written so that NaN fails
    if !(own >= sided * least) {
        return None;
    }
    // a lone point on a long side has no line of neighbours to be off
    let length = |i: usize| distance(points[i].xy, points[i + 1].xy);
    let beside = [index.checked_sub(2).map(length), (index + 2 < points.len()).then(|| length(index + 1))];
    let beside = beside.into_iter().flatten().fold(0.0, f64::max);
    if distance(points[index - 1].xy, points[index + 1].xy) > 5.0 * beside {
        return None;
    }
    let without = |i: usize| points[i + usize::from(i >= index)].xy;
    let n = points.len() - 1;
    let near = index.saturating_sub(2).max(1)..(index + 2).min(n - 1);
    let others = near.map(|i| off_the_line::<NEAR>(n, i, without, 0.0)).fold(0.0, f64::max);
    (own > sided * ratio * others).then_some(own)
}

/// Distance of the point at `index` from the polynomial through the `NEAR` points around it, or any distance below
/// `least` where that is.
fn off_the_line<const NEAR: usize>(count: usize, index: usize, at: impl Fn(usize) -> [f64; 2], least: f64) -> f64 {
    let first = index.saturating_sub(NEAR / 2).min(count - NEAR - 1);
    let mut around = [[0.0; 2]; NEAR];
    let others = (first..=first + NEAR).filter(|&i| i != index);
    for (slot, i) in around.iter_mut().zip(others) {
        *slot = at(i);
    }
    from_polynomial(at(index), around, least)
}

/// Distance of a point from the polynomial through `NEAR` points, or any distance below `least` where that is.
fn from_polynomial<const NEAR: usize>(point: [f64; 2], around: [[f64; 2]; NEAR], least: f64) -> f64 {
    const PIECES: usize = 8;
    let mut t = [0.0; NEAR];
    for k in 1..NEAR {
        t[k] = t[k - 1] + distance(around[k], around[k - 1]).max(f64::MIN_POSITIVE);
    }
    let scales: [f64; NEAR] =
        std::array::from_fn(|k| (0..NEAR).filter(|&j| j != k).map(|j| (t[k] - t[j]).recip()).product());
    let value = |u: f64| {
        let weight = |k: usize| (0..NEAR).filter(|&j| j != k).map(|j| u - t[j]).product::<f64>() * scales[k];
        let weights: [f64; NEAR] = std::array::from_fn(weight);
        [0, 1].map(|d| (0..NEAR).map(|k| weights[k] * around[k][d]).sum::<f64>())
    };
    let mut nearest = f64::INFINITY;
    // the piece in the middle is the likeliest to pass by the point
    for span in (0..NEAR - 1).map(|k| (NEAR / 2 - 1 + k) % (NEAR - 1)) {
        let mut before = around[span];
        for piece in 1..=PIECES {
            let next = value(t[span] + (t[span + 1] - t[span]) * piece as f64 / PIECES as f64);
            nearest = nearest.min(from_segment(point, before, next));
            if nearest < least {
                return nearest;
            }
            before = next;
        }
    }
    nearest
}

/// Distance of a point from a straight piece.
pub(super) fn from_segment(point: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let along = minus(b, a);
    let squared = dot(along, along);
    let share = if squared > 0.0 { (dot(minus(point, a), along) / squared).clamp(0.0, 1.0) } else { 0.0 };
    distance(point, between(a, b, share))
}
