//! Logarithms and directions of many numbers at a time, in vectors: several times faster than one by one, and as exact.
//!
//! Depends on nothing.

use wide::f64x4;

/// Numbers in a vector.
const LANES: usize = 4;

/// Natural logarithms of the distances `values` from zero.
pub(crate) fn log_distances(values: &[f64], logs: &mut [f64]) {
    for (x, log) in values.chunks(LANES).zip(logs.chunks_mut(LANES)) {
        let result = vector(x, 1.0).abs().ln().to_array();
        log.copy_from_slice(&result[..log.len()]);
    }
}

/// Natural logarithms of the lengths and directions (−π to π) of vectors; both are zero for a vector of no length.
pub(crate) fn polar_coordinates(dx: &[f64], dy: &[f64], logs: &mut [f64], angles: &mut [f64]) {
    let components = dx.chunks(LANES).zip(dy.chunks(LANES));
    for ((x, y), (log, angle)) in components.zip(logs.chunks_mut(LANES).zip(angles.chunks_mut(LANES))) {
        let (x, y) = (vector(x, 1.0), vector(y, 0.0));
        let square = x * x + y * y;
        let (half_log, direction) = ((square.ln() * 0.5).to_array(), y.atan2(x).to_array());
        let square = square.to_array();
        for k in 0..log.len() {
            (log[k], angle[k]) = if square[k] > 0.0 { (half_log[k], direction[k]) } else { (0.0, 0.0) };
        }
    }
}

/// The first numbers of a slice, or all and a number to fill up with.
#[inline(always)]
fn vector(values: &[f64], rest: f64) -> f64x4 {
    let mut lanes = [rest; LANES];
    lanes[..values.len()].copy_from_slice(values);
    f64x4::from(lanes)
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
