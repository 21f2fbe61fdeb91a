//! Finite differences with an error estimate: the independent check of every exact derivative.

use nalgebra::DMatrix;

/// A derivative by finite differences and how far it may be off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The extrapolated derivative.
    pub value: f64,
    /// Estimated absolute error: disagreement of the extrapolation with itself plus round-off of the function values.
    pub error: f64,
}

/// The steps tried: `first`, then halved, `levels` of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepRange {
    /// The largest step, in units of the variable.
    pub first: f64,
    /// How many steps, each half of the one before.
    pub levels: usize,
}

impl StepRange {
    /// Eleven steps from a hundredth of `scale` down to a hundred-thousandth.
    pub fn for_scale(scale: f64) -> Self {
        Self { first: 0.01 * scale, levels: 11 }
    }
}

/// Derivative of `f` at `x` by central differences, extrapolated to zero step (Ridders 1982).
///
/// # Errors
/// Those of `f`.
pub fn finite_difference<E>(mut f: impl FnMut(f64) -> Result<f64, E>, x: f64, steps: StepRange) -> Result<Estimate, E> {
    let estimates = finite_difference_jacobian(|x| Ok(vec![f(x[0])?]), &[x], &[steps])?;
    Ok(estimates[(0, 0)])
}

/// Jacobian (outputs × variables) of `f` at `x` by extrapolated central differences; `steps` has one entry a variable.
///
/// All outputs share the evaluations (`2 · levels` a variable); each picks its own best entry of its tableau.
///
/// # Errors
/// Those of `f`.
pub fn finite_difference_jacobian<E>(
    mut f: impl FnMut(&[f64]) -> Result<Vec<f64>, E>,
    x: &[f64],
    steps: &[StepRange],
) -> Result<DMatrix<Estimate>, E> {
    let rows = f(x)?.len();
    let nothing = Estimate { value: 0.0, error: f64::INFINITY };
    let mut result = DMatrix::from_element(rows, x.len(), nothing);
    let mut point = x.to_vec();
    for (column, range) in steps.iter().enumerate() {
        let mut differences = vec![Vec::with_capacity(range.levels); rows];
        let mut noise = vec![Vec::with_capacity(range.levels); rows];
        let mut step = range.first;
        for _ in 0..range.levels {
            // the step that was really taken, after rounding
            let (high, low) = (x[column] + step, x[column] - step);
            point[column] = high;
            let above = f(&point)?;
            point[column] = low;
            let below = f(&point)?;
            for row in 0..rows {
                differences[row].push((above[row] - below[row]) / (high - low));
                noise[row].push(4.0 * f64::EPSILON * above[row].abs().max(below[row].abs()) / step);
            }
            step *= 0.5;
        }
        point[column] = x[column];
        for row in 0..rows {
            result[(row, column)] = extrapolate(&differences[row], &noise[row]);
        }
    }
    Ok(result)
}

/// Round-off of the differences that they show themselves, at the first step; it doubles from step to step.
///
/// A function that cancels inside is good to less than the few units in the last place that [`finite_difference`]
/// supposes. In the shorter half of the steps differences, extrapolated once, disagree by little else than round-off; in
/// all of these, because rounded values may well agree at some. Twice that, because the entry with the smallest
/// disagreement is chosen, be it by chance.
fn visible_noise(differences: &[f64]) -> f64 {
    let once: Vec<f64> = differences.windows(2).map(|d| d[1] + (d[1] - d[0]) / 3.0).collect();
    let scatter = once.windows(2).enumerate().map(|(i, r)| (r[1] - r[0]).abs() * 0.5f64.powi(i as i32 + 2));
    2.0 * scatter.rev().take(differences.len() / 2).fold(0.0, f64::max)
}

/// The entry of the Neville tableau with the smallest estimated error.
fn extrapolate(differences: &[f64], noise: &[f64]) -> Estimate {
    let visible = visible_noise(differences);
    let mut best = Estimate { value: differences[0], error: f64::INFINITY };
    let mut previous = vec![differences[0]];
    for level in 1..differences.len() {
        let mut row = vec![differences[level]];
        let mut factor = 1.0;
        for order in 1..=level {
            // central differences have an error series in even powers of the step
            factor *= 4.0;
            let value = row[order - 1] + (row[order - 1] - previous[order - 1]) / (factor - 1.0);
            let disagreement = (value - row[order - 1]).abs().max((value - previous[order - 1]).abs());
            let error = disagreement + noise[level].max(visible * 2f64.powi(level as i32));
            if error <= best.error {
                best = Estimate { value, error };
            }
            row.push(value);
        }
        previous = row;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    #[test]
    fn the_estimate_covers_the_error() {
        type Case = (fn(f64) -> f64, f64, f64);
        let cases: [Case; 4] = [
            (f64::sin, 0.7, 0.7f64.cos()),
            (f64::exp, 3.0, 3f64.exp()),
            (|x| (300.0 * x).tanh(), 0.001, 300.0 / (0.3f64.cosh() * 0.3f64.cosh())),
            (|x| 1e6 + x * x, 0.5, 1.0),
        ];
        for (f, x, exact) in cases {
            let e = finite_difference(|x| Ok::<_, Infallible>(f(x)), x, StepRange::for_scale(1.0)).unwrap();
            assert!((e.value - exact).abs() <= e.error, "{e:?} against {exact}");
            assert!(e.error <= 1e-4 * exact.abs(), "{e:?} is not worth having");
        }
    }

    #[test]
    fn a_smooth_function_is_differenced_to_ten_digits() {
        let e = finite_difference(|x| Ok::<_, Infallible>(x.exp()), 0.0, StepRange::for_scale(1.0)).unwrap();
        assert!((e.value - 1.0).abs() < 1e-11, "{e:?}");
    }

    #[test]
    fn round_off_beyond_the_last_digits_is_seen() {
        // good to 1e-12 only, which the size of the values does not tell
        let f = |x: f64| Ok::<_, Infallible>((1e4 + x.sin()) - 1e4);
        for k in 0..500 {
            let x = f64::from(k) * 0.01;
            let e = finite_difference(f, x, StepRange::for_scale(1.0)).unwrap();
            assert!((e.value - x.cos()).abs() <= 3.0 * e.error, "{x}: {e:?} against {}", x.cos());
            assert!(e.error < 1e-8, "{x}: {e:?} is not worth having");
        }
    }

    #[test]
    fn errors_pass_through() {
        assert_eq!(finite_difference(|_| Err::<f64, _>("no"), 0.0, StepRange::for_scale(1.0)), Err("no"));
    }
}
