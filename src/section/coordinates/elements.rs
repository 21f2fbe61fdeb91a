//! Files with several outlines: which points make each of them.

use super::point::Point;
use crate::plane::{bounds, cross, distance, minus};
use std::ops::Range;

/// The elements of a file as ranges of its points; one range where nothing tells several.
///
/// Separators of flow solvers (`999. 999.`) divide for certain, other breaks only where what they divide are closed
/// outlines; single points between these belong to no element.
pub(super) fn elements(points: &[Point], separators: &[usize], breaks: &[usize]) -> Vec<Range<usize>> {
    let apart = ranges(points.len(), separators);
    if apart.len() > 1 {
        return apart;
    }
    let (outlines, others): (Vec<_>, Vec<_>) =
        ranges(points.len(), breaks).into_iter().partition(|range| is_outline(&points[range.clone()]));
    if outlines.len() > 1 && others.iter().all(|range| range.len() <= 2) {
        outlines
    } else {
        std::iter::once(0..points.len()).collect()
    }
}

fn ranges(count: usize, cuts: &[usize]) -> Vec<Range<usize>> {
    let mut ends: Vec<usize> = cuts.iter().copied().filter(|&cut| 0 < cut && cut < count).collect();
    ends.push(count);
    ends.dedup();
    let starts = std::iter::once(0).chain(ends.clone());
    starts.zip(ends).map(|(start, end)| start..end).filter(|range| !range.is_empty()).collect()
}

/// Whether points make a closed outline with an area of its own.
fn is_outline(points: &[Point]) -> bool {
    let [Point { xy: first, .. }, .., Point { xy: last, .. }] = points else { return false };
    let [x, y] = bounds(points.iter().map(|p| p.xy));
    let extent = (x[1] - x[0]).max(y[1] - y[0]);
    let area: f64 = points.windows(2).map(|w| 0.5 * cross(minus(w[0].xy, *first), minus(w[1].xy, *first))).sum();
    points.len() >= 6 && distance(*first, *last) < 0.1 * extent && area.abs() > 1e-3 * extent * extent
}
