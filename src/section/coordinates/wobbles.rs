//! Places where an outline turns one way and at once back again, as no smooth section does: a point, a run of points,
//! or an end that stands off the others.

use super::point::Point;
use super::repair::{Repair, record};
use crate::plane::{cross, distance, dot, middle, minus};

/// Fewest points that make an outline of which this can be told.
const FEWEST: usize = 10;
/// Points bulge out and their neighbours in by this share of the extent, on both sides or on one, at a wobble. Of 698
/// public files of at most 59 points two reach the first, and none the second.
const BOTH_SIDES: f64 = 0.0015;
const ONE_SIDE: f64 = 0.005;
/// A step sideways of this share of the extent is more than a smooth outline has, where the turns at its ends are this
/// many times those beside them.
const STEP: f64 = 0.002;
const STEP_RATIO: f64 = 1.5;
/// An end is off the others if the turn before it is at least the first of these angles (radians) and that many times
/// the turns before, and the end by this share of the extent off the straight line through the two points before it.
const END_TURNS: [(f64, f64); 2] = [(0.2, 3.0), (0.15, 12.0)];
const END_SHARE: f64 = 0.004;
/// The upper end below the lower one by this share of the extent: one of them is off.
const INVERTED: f64 = 0.001;
/// Numbers rounded to `step` may wobble by this many of them.
const ROUNDED: f64 = 6.0;

/// Reports wobbles; `sparse` outlines also where the neighbours of a point bulge the other way.
pub(super) fn report_wobbles(points: &[Point], sparse: bool, extent: f64, step: f64, repairs: &mut Vec<Repair>) {
    if points.len() <= FEWEST {
        return;
    }
    let told = |repairs: &[Repair]| {
        let spike = |r: &Repair| matches!(r, Repair::SpikeSuspected { .. } | Repair::SpikeDropped { .. });
        repairs.iter().any(spike)
    };
    for (line, distance) in ends(points, extent, step) {
        if !told(repairs) {
            record(repairs, Repair::SpikeSuspected { count: 1, line, distance });
        }
    }
    if sparse && !told(repairs) {
        for (line, distance) in zigzags(points, extent, step) {
            record(repairs, Repair::SpikeSuspected { count: 1, line, distance });
        }
    }
    if !told(repairs) {
        for (line, distance) in steps(points, extent, step) {
            record(repairs, Repair::StepSuspected { count: 1, line, distance });
        }
    }
}

/// Signed distance of a point from the straight line through its neighbours, positive to the left.
fn bulge(points: &[Point], i: usize) -> f64 {
    let along = minus(points[i + 1].xy, points[i - 1].xy);
    let length = dot(along, along).sqrt();
    if length > 0.0 { cross(along, minus(points[i].xy, points[i - 1].xy)) / length } else { 0.0 }
}

/// Angle by which the outline turns at a point, in radians, positive to the left.
fn turn(points: &[Point], i: usize) -> f64 {
    let (before, after) = (minus(points[i].xy, points[i - 1].xy), minus(points[i + 1].xy, points[i].xy));
    cross(before, after).atan2(dot(before, after))
}

/// Points that bulge out where their neighbours bulge in: line and distance of the worst of each group.
fn zigzags(points: &[Point], extent: f64, step: f64) -> Vec<(usize, f64)> {
    let last = points.len() - 1;
    let least = |share: f64| (share * extent).max(ROUNDED * step);
    let wobbles = |i: usize| {
        let own = bulge(points, i);
        let opposite = |k: usize| if 0 < k && k < last { -own.signum() * bulge(points, k) } else { f64::NEG_INFINITY };
        let (before, after) = (opposite(i - 1), opposite(i + 1));
        own.abs().min(before).min(after) > least(BOTH_SIDES) || own.abs().min(before.max(after)) > least(ONE_SIDE)
    };
    let size = |i: usize| bulge(points, i).abs();
    let found: Vec<usize> = (1..last).filter(|&i| wobbles(i)).collect();
    let is_worst = |&i: &usize| !found.iter().any(|&j| j != i && i.abs_diff(j) <= 2 && size(j) > size(i));
    found.iter().copied().filter(is_worst).map(|i| (points[i].line, size(i))).collect()
}

/// Sides along which the outline steps sideways, by the lines of their ends: where a run of shifted points begins or
/// ends. The last sides at both ends of the list are left out.
fn steps(points: &[Point], extent: f64, step: f64) -> Vec<(usize, f64)> {
    let last = points.len() - 1;
    let least = (STEP * extent).max(ROUNDED * step);
    let sideways = |i: usize| {
        let (here, there) = (turn(points, i), turn(points, i + 1));
        let (turned, height) = (here.abs().min(there.abs()), distance(points[i].xy, points[i + 1].xy));
        let beside = [i - 1, i.saturating_sub(2), i + 2, i + 3].into_iter().filter(|&k| 0 < k && k < last);
        let beside = beside.map(|k| turn(points, k).abs()).fold(0.0, f64::max);
        let is_step = here * there < 0.0 && turned * height > least && turned > STEP_RATIO * beside;
        is_step.then(|| (points[i + 1].line.max(points[i].line), turned * height))
    };
    (2..last.saturating_sub(2)).filter_map(sideways).collect()
}

/// First and last points off the line on which the others run out, by their lines.
fn ends(points: &[Point], extent: f64, step: f64) -> Vec<(usize, f64)> {
    let n = points.len();
    let (least, first, last) = ((END_SHARE * extent).max(ROUNDED * step), [0, 1, 2, 3], [n - 1, n - 2, n - 3, n - 4]);
    let off = |[from, near, far, _]: [usize; 4]| {
        let along = minus(points[near].xy, points[far].xy);
        (cross(along, minus(points[from].xy, points[far].xy)) / dot(along, along).sqrt()).abs()
    };
    let is_off = |end: &[usize; 4]| {
        let [own, next, after] = [end[1], end[2], end[3]].map(|i| turn(points, i).abs());
        let turns = END_TURNS.iter().any(|&(angle, ratio)| own > angle && own > ratio * next.max(after));
        turns && off(*end) > least
    };
    let mut found: Vec<[usize; 4]> = [first, last].into_iter().filter(is_off).collect();
    if found.is_empty() && ends_are_inverted(points, (INVERTED * extent).max(ROUNDED * step)) {
        found.push(if off(first) >= off(last) { first } else { last });
    }
    found.into_iter().map(|end| (points[end[0]].line, off(end))).collect()
}

/// Whether the end of the upper surface lies below that of the lower one by more than `least`, seen along the chord.
fn ends_are_inverted(points: &[Point], least: f64) -> bool {
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return false };
    let tail = middle(first.xy, last.xy);
    let nose = points.iter().map(|p| p.xy).max_by(|&a, &b| distance(a, tail).total_cmp(&distance(b, tail)));
    let chord = nose.map_or([0.0; 2], |nose| minus(tail, nose));
    cross(chord, minus(first.xy, last.xy)) < -least * dot(chord, chord).sqrt()
}
