//! Interpolation of an objective along a line.

/// Objective and slope at a step along a line.
#[derive(Debug, Clone, Copy)]
pub(super) struct LineSample {
    pub step: f64,
    pub value: f64,
    pub slope: f64,
}

/// Step at which the cubic through the values and slopes of two samples has its minimum (Nocedal & Wright, Numerical
/// Optimization, 2nd edition, equation 3.59); `None` where it has none.
pub(super) fn cubic_minimum(a: LineSample, b: LineSample) -> Option<f64> {
    let d1 = a.slope + b.slope - 3.0 * (a.value - b.value) / (a.step - b.step);
    // the square root of a negative number is NaN, which the last line turns into `None`
    let d2 = (d1 * d1 - a.slope * b.slope).sqrt().copysign(b.step - a.step);
    let step = b.step - (b.step - a.step) * (b.slope + d2 - d1) / (b.slope - a.slope + 2.0 * d2);
    step.is_finite().then_some(step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_minimum_of_a_cubic_is_found_from_either_side() {
        // (t − 2)² (t + 1) has its minimum at 2 and its maximum at 0
        let sample = |t: f64| LineSample {
            step: t,
            value: (t - 2.0).powi(2) * (t + 1.0),
            slope: 2.0 * (t - 2.0) * (t + 1.0) + (t - 2.0).powi(2),
        };
        for (a, b) in [(0.5, 3.0), (3.0, 0.5), (1.0, 1.5), (-0.5, 5.0)] {
            assert_relative_eq!(cubic_minimum(sample(a), sample(b)).unwrap(), 2.0, max_relative = 1e-13);
        }
    }

    #[test]
    fn a_cubic_without_a_minimum_has_none() {
        // t³ + t rises everywhere
        let sample = |t: f64| LineSample { step: t, value: t * t * t + t, slope: 3.0 * t * t + 1.0 };
        assert_eq!(cubic_minimum(sample(-1.0), sample(2.0)), None);
    }
}
