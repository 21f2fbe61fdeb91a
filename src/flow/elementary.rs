//! Logarithms and directions of many numbers at a time, in vectors: several times faster than one by one, and as exact.
//!
//! This module depends on nothing else in the crate.

use wide::f64x4;

/// Number of values in one vector.
const LANES: usize = 4;

/// Writes the natural logarithms of the magnitudes of `values` to `logs`; both lists have one entry per value.
pub(crate) fn log_distances(values: &[f64], logs: &mut [f64]) {
    let log = |x: [f64; LANES]| f64x4::from(x).abs().ln().to_array();
    let ((values, values_left), (logs, logs_left)) = (values.as_chunks(), logs.as_chunks_mut());
    for (x, result) in values.iter().zip(logs) {
        *result = log(*x);
    }
    if !logs_left.is_empty() {
        logs_left.copy_from_slice(&log(filled(values_left, 1.0))[..logs_left.len()]);
    }
}

/// Writes the natural logarithms of the lengths of the vectors (dx, dy) to `logs` and their directions (−π to π) to
/// `angles`. Both are zero for a vector of no length.
pub(crate) fn polar_coordinates(dx: &[f64], dy: &[f64], logs: &mut [f64], angles: &mut [f64]) {
    let ((x, x_left), (y, y_left)) = (dx.as_chunks(), dy.as_chunks());
    let ((logs, logs_left), (angles, angles_left)) = (logs.as_chunks_mut(), angles.as_chunks_mut());
    for ((x, y), (log, angle)) in x.iter().zip(y).zip(logs.iter_mut().zip(angles)) {
        (*log, *angle) = polar(*x, *y);
    }
    if !logs_left.is_empty() {
        let (log, angle) = polar(filled(x_left, 1.0), filled(y_left, 0.0));
        logs_left.copy_from_slice(&log[..logs_left.len()]);
        angles_left.copy_from_slice(&angle[..angles_left.len()]);
    }
}

#[inline(always)]
fn polar(x: [f64; LANES], y: [f64; LANES]) -> ([f64; LANES], [f64; LANES]) {
    let (x, y) = (f64x4::from(x), f64x4::from(y));
    let square = x * x + y * y;
    let (mut logs, mut angles) = ((square.ln() * 0.5).to_array(), y.atan2(x).to_array());
    let square = square.to_array();
    for k in 0..LANES {
        (logs[k], angles[k]) = if square[k] > 0.0 { (logs[k], angles[k]) } else { (0.0, 0.0) };
    }
    (logs, angles)
}

/// The values left at the end of a list, filled up to a whole vector with `rest`.
fn filled(values: &[f64], rest: f64) -> [f64; LANES] {
    let mut lanes = [rest; LANES];
    lanes[..values.len()].copy_from_slice(values);
    lanes
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn they_are_those_of_the_standard_library() {
        for count in 0..9 {
            let x: Vec<f64> = (0..count).map(|i| (1.3 * i as f64 - 4.0) * 10f64.powi(i - 5)).collect();
            let y: Vec<f64> = (0..count).map(|i| (0.7 * i as f64 - 2.0) * 10f64.powi(2 - i)).collect();
            let (mut logs, mut lengths, mut angles) = (vec![0.0; x.len()], vec![0.0; x.len()], vec![0.0; x.len()]);
            log_distances(&x, &mut logs);
            polar_coordinates(&x, &y, &mut lengths, &mut angles);
            for k in 0..x.len() {
                let close = |a: f64, b: f64| assert!((a - b).abs() <= 4.0 * f64::EPSILON * b.abs(), "{k}: {a} {b}");
                close(logs[k], x[k].abs().ln());
                close(lengths[k], 0.5 * (x[k] * x[k] + y[k] * y[k]).ln());
                close(angles[k], y[k].atan2(x[k]));
            }
        }
    }

    #[test]
    fn along_the_axes_and_at_the_origin() {
        let (x, y) = ([0.0, 2.0, -2.0, -2.0, 0.0, 0.0], [0.0, 0.0, 0.0, -0.0, 3.0, -3.0]);
        let (mut logs, mut angles) = ([1.0; 6], [1.0; 6]);
        polar_coordinates(&x, &y, &mut logs, &mut angles);
        assert_eq!(angles, [0.0, 0.0, PI, -PI, 0.5 * PI, -0.5 * PI]);
        assert_eq!((logs[0], logs[1], logs[4]), (0.0, 2f64.ln(), 3f64.ln()));
    }
}
