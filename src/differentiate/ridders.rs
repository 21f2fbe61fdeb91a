//! Finite differences with an error estimate: the independent check of every exact derivative.

use nalgebra::DMatrix;

/// A derivative by finite differences and how far it may be off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The derivative, extrapolated to a step of zero.
    pub value: f64,
    /// Estimated absolute error: disagreement of the extrapolation with itself plus the noise of the function values,
    /// which is measured, not assumed.
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
/// The first error that `f` returns.
pub fn finite_difference<E>(mut f: impl FnMut(f64) -> Result<f64, E>, x: f64, steps: StepRange) -> Result<Estimate, E> {
    let estimates = finite_difference_jacobian(|x| Ok(vec![f(x[0])?]), &[x], &[steps])?;
    Ok(estimates[(0, 0)])
}

/// Jacobian (outputs × variables) of `f` at `x` by extrapolated central differences; `steps` has one entry per
/// variable.
///
/// All outputs share the evaluations (`2 · levels + 9` per variable); each picks its own best entry of its tableau.
///
/// # Errors
/// The first error that `f` returns.
pub fn finite_difference_jacobian<E>(
    mut f: impl FnMut(&[f64]) -> Result<Vec<f64>, E>,
    x: &[f64],
    steps: &[StepRange],
) -> Result<DMatrix<Estimate>, E> {
    let rows = f(x)?.len();
    // noise belongs to an output, whichever variable shows it
    let mut floor = vec![0.0f64; rows];
    for (column, range) in steps.iter().enumerate() {
        let shown = noise_of_outputs(&mut f, &mut x.to_vec(), column, range)?;
        floor.iter_mut().zip(shown).for_each(|(floor, shown)| *floor = floor.max(shown));
    }
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
                let rounding = 4.0 * f64::EPSILON * above[row].abs().max(below[row].abs());
                noise[row].push(rounding.max(floor[row]) / step);
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

/// The noise of each output along one variable, from a table of differences at steps far below any feature of the
/// function (Moré and Wild, SIAM J. Sci. Comput. 33, 2011), times eight: one in many derivatives is an outlier.
fn noise_of_outputs<E>(
    f: &mut impl FnMut(&[f64]) -> Result<Vec<f64>, E>,
    point: &mut [f64],
    column: usize,
    range: &StepRange,
) -> Result<Vec<f64>, E> {
    const POINTS: usize = 9;
    let centre = point[column];
    let step = range.first * 1e-8;
    let mut samples = Vec::with_capacity(POINTS);
    for k in 0..POINTS {
        point[column] = centre + (k as f64 - 0.5 * (POINTS - 1) as f64) * step;
        samples.push(f(point)?);
    }
    point[column] = centre;
    let outputs = samples[0].len();
    let noise = (0..outputs).map(|row| {
        let mut table: Vec<f64> = samples.iter().map(|s| s[row]).collect();
        let (mut largest, mut factor) = (0.0f64, 1.0);
        for order in 1..=6 {
            table = table.windows(2).map(|w| w[1] - w[0]).collect();
            // (k!)² / (2k)!: what differences of order k make of independent noise
            factor *= order as f64 / (2.0 * (2 * order - 1) as f64);
            if order >= 3 {
                let mean = table.iter().map(|d| d * d).sum::<f64>() / table.len() as f64;
                largest = largest.max((factor * mean).sqrt());
            }
        }
        8.0 * largest
    });
    Ok(noise.collect())
}

/// The entry of the Neville tableau with the smallest estimated error.
///
/// An entry is judged by its neighbours: the two it was made from, and the one below it, made with half the step.
/// Without the latter a chance agreement would pass for accuracy.
fn extrapolate(differences: &[f64], noise: &[f64]) -> Estimate {
    let mut rows: Vec<Vec<f64>> = Vec::with_capacity(differences.len());
    for (level, &difference) in differences.iter().enumerate() {
        let mut row = vec![difference];
        let mut factor = 1.0;
        for order in 1..=level {
            // central differences have an error series in even powers of the step
            factor *= 4.0;
            let (coarse, fine) = (rows[level - 1][order - 1], row[order - 1]);
            row.push(fine + (fine - coarse) / (factor - 1.0));
        }
        rows.push(row);
    }
    let mut best = Estimate { value: differences[0], error: f64::INFINITY };
    for level in 1..rows.len() {
        for order in 1..=level {
            let value = rows[level][order];
            let made_from = [rows[level][order - 1], rows[level - 1][order - 1]];
            let below = rows.get(level + 1).map(|row| row[order]);
            let disagreement = made_from.into_iter().chain(below).fold(0.0, |m: f64, v| m.max((v - value).abs()));
            let error = disagreement + noise[level];
            if error <= best.error {
                best = Estimate { value, error };
            }
        }
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
    fn errors_pass_through() {
        assert_eq!(finite_difference(|_| Err::<f64, _>("no"), 0.0, StepRange::for_scale(1.0)), Err("no"));
    }
}
