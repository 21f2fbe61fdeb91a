//! The wake: spacing of the nodes, dead air behind a blunt edge, and strength of the sources. The [streamline] gives the
//! path.
//!
//! [streamline]: super::streamline

use super::outline::TrailingEdgeFrame;
use crate::scalar::Scalar;

/// Length of the wake in chords.
const LENGTH: f64 = 1.0;

/// Distances of the wake nodes from the trailing edge along the path, in chords, for a section of `panels` panels.
///
/// The first panel is as long as a mean surface panel near the edge; the others grow geometrically.
pub(crate) fn distances(panels: usize) -> Vec<f64> {
    let count = panels / 8 + 7;
    let first = 1.0 / panels as f64;
    // ratio of the geometric series by bisection of its sum
    let sum = |ratio: f64| (0..count - 1).map(|k| first * ratio.powi(k as i32)).sum::<f64>();
    let (mut low, mut high) = (1.0, 3.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if sum(middle) < LENGTH { low = middle } else { high = middle }
    }
    let mut at = 0.0;
    let mut result = vec![at];
    for k in 0..count - 1 {
        at += first * low.powi(k as i32);
        result.push(at);
    }
    result
}

/// Width of the dead air behind a blunt edge at the distances of the wake nodes, in chords (Drela, XFOIL, 1989). It is
/// a cubic that leaves the edge with the slopes of the surface and ends 2.5 gaps behind it, where it is rounded off.
pub(crate) fn dead_air<S: Scalar>(edge: &TrailingEdgeFrame<S>, distances: &[f64]) -> Vec<S> {
    // closing rate within the limits that keep the cubic positive
    let slope = (edge.opening / 1.2).saturating_tanh() * 1.2;
    let (a, b) = (slope * 2.5 + 3.0, slope * -2.5 - 2.0);
    let width = |d: f64| {
        let z = (-(edge.thickness.recip() * (d / 2.5)) + 1.0).positive_part(0.02);
        edge.thickness * (a + b * z) * z * z
    };
    distances.iter().map(|&d| width(d)).collect()
}

/// Strengths of the linear source sheet at the nodes and the middles of the wake panels (node, middle, node, …) per
/// mass defect at the nodes: the slopes of the defect at the middles, linear between them, zero at the far end.
///
/// The result has one row per node or middle, with the few nodes and weights that are not zero.
pub(crate) fn source_strengths(distances: &[f64]) -> Vec<Vec<(usize, f64)>> {
    let n = distances.len();
    let slope = |k: usize| {
        let d = distances[k + 1] - distances[k];
        [(k, -1.0 / d), (k + 1, 1.0 / d)]
    };
    let mut rows = Vec::with_capacity(2 * n - 1);
    for k in 0..n {
        if k == 0 {
            rows.push(slope(0).to_vec());
        } else if k + 1 == n {
            rows.push(Vec::new());
        } else {
            let (before, behind) = (distances[k] - distances[k - 1], distances[k + 1] - distances[k]);
            let share = before / (before + behind);
            let mut row = Vec::with_capacity(4);
            row.extend(slope(k - 1).map(|(i, w)| (i, w * (1.0 - share))));
            row.extend(slope(k).map(|(i, w)| (i, w * share)));
            rows.push(row);
        }
        if k + 1 < n {
            rows.push(slope(k).to_vec());
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge() -> TrailingEdgeFrame<f64> {
        TrailingEdgeFrame::new([[1.0, 0.005], [0.98, 0.01]], [[0.98, -0.01], [1.0, -0.005]])
    }

    #[test]
    fn the_panels_grow_from_that_of_the_surface_over_one_chord() {
        let d = distances(160);
        assert!((d[d.len() - 1] - 1.0).abs() < 1e-9 && (d[1] - 1.0 / 160.0).abs() < 1e-12);
    }

    #[test]
    fn dead_air_starts_with_the_gap_and_its_slope_and_ends() {
        let e = edge();
        let gap = dead_air(&e, &[0.0, 1e-5, 0.1]);
        assert!((gap[0] / 0.01 - 1.0).abs() < 1e-3, "{gap:?}");
        assert!((((gap[1] - gap[0]) / 1e-5) / e.opening - 1.0).abs() < 0.06, "{gap:?}");
        assert!(gap[2].abs() < 1e-8, "{gap:?}");
    }

    #[test]
    fn strengths_of_a_linear_defect_are_its_slope() {
        let d = distances(80);
        for (j, row) in source_strengths(&d).iter().enumerate().take(2 * d.len() - 2) {
            let strength: f64 = row.iter().map(|(k, w)| w * 3.0 * d[*k]).sum();
            assert!((strength - 3.0).abs() < 1e-9, "{j} {strength}");
        }
    }
}
