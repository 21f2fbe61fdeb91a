//! Real roots in `f64`: isolation of those of Bernstein polynomials, and bracketed Newton.

/// Visits intervals of [0, 1] that hold the roots of a polynomial given by Bernstein coefficients.
///
/// Each interval holds one change of sign (Descartes' rule of signs in the Bernstein basis), from negative to positive
/// where the third argument is true; or, for a multiple root or one at a point of subdivision, it is a single point.
/// Coefficients no larger than `noise` count as zero; where all are zero nothing is visited. The order is not that of
/// the roots. Roots at 0 and 1 themselves may be left out.
pub(super) fn isolate(coefficients: &[f64], noise: f64, mut visit: impl FnMut(f64, f64, bool)) {
    let mut stack = vec![(0.0, 1.0, coefficients.to_vec())];
    // as many halvings as all roots need that a polynomial can have; more are the work of round-off
    let mut halvings = 64 * coefficients.len();
    while let Some((low, high, mut left)) = stack.pop() {
        match sign_changes(&left, noise) {
            0 => {}
            1 => visit(low, high, left.iter().find(|c| c.abs() > noise).is_some_and(|c| *c < 0.0)),
            _ => {
                let middle = 0.5 * (low + high);
                if high - low < 1e-13 || halvings == 0 {
                    visit(middle, middle, true);
                    continue;
                }
                halvings -= 1;
                let right = halve(&mut left, |a, b| 0.5 * (a + b));
                if right[0].abs() <= noise {
                    visit(middle, middle, true);
                }
                stack.push((middle, high, right));
                stack.push((low, middle, left));
            }
        }
    }
}

fn sign_changes(coefficients: &[f64], noise: f64) -> usize {
    let mut signs = coefficients.iter().filter(|c| c.abs() > noise).map(|c| *c > 0.0);
    let mut last = signs.next();
    signs.filter(|&s| last.replace(s) != Some(s)).count()
}

/// De Casteljau at one half: leaves the left half in place and gives the right one. `middle` takes the mean of two.
pub(crate) fn halve<T: Copy>(coefficients: &mut [T], middle: impl Fn(T, T) -> T) -> Vec<T> {
    let n = coefficients.len();
    let mut right = coefficients.to_vec();
    for level in 1..n {
        for i in (level..n).rev() {
            coefficients[i] = middle(coefficients[i - 1], coefficients[i]);
        }
        right[n - 1 - level] = coefficients[n - 1];
    }
    right
}

/// Bernstein coefficients of the product of two polynomials.
pub(super) fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    let (m, n) = (a.len() - 1, b.len() - 1);
    let mut result = vec![0.0; m + n + 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            result[i + j] += binomial(m, i) * binomial(n, j) / binomial(m + n, i + j) * x * y;
        }
    }
    result
}

fn binomial(n: usize, k: usize) -> f64 {
    (0..k).fold(1.0, |c, i| c * (n - i) as f64 / (i + 1) as f64)
}

/// Bernstein coefficients of the derivative with respect to the parameter on [0, 1].
pub(super) fn slopes(coefficients: &[f64]) -> Vec<f64> {
    let n = (coefficients.len() - 1) as f64;
    coefficients.windows(2).map(|w| n * (w[1] - w[0])).collect()
}

/// A root of `f`, which gives value and slope, between `low` and `high`, to round-off.
///
/// Where the values at the two ends have the same sign the end with the smaller one is returned.
pub(super) fn bracketed(low: f64, high: f64, mut f: impl FnMut(f64) -> (f64, f64)) -> f64 {
    let (at_low, at_high) = (f(low).0, f(high).0);
    if at_low == 0.0 || at_high == 0.0 || (at_low > 0.0) == (at_high > 0.0) {
        return if at_low.abs() <= at_high.abs() { low } else { high };
    }
    isolated(low, high, at_high > 0.0, f)
}

/// The root of `f` between `low` and `high` where it is known to be the only change of sign, `rising` or falling; the
/// values at the two ends may be zero or noise and are not looked at.
///
/// Newton's method, replaced by bisection where it would leave the bracket or is slow.
pub(crate) fn isolated(mut low: f64, mut high: f64, rising: bool, mut f: impl FnMut(f64) -> (f64, f64)) -> f64 {
    let resolution = f64::EPSILON * low.abs().max(high.abs());
    let mut u = 0.5 * (low + high);
    let mut last_step = high - low;
    let mut best = (f64::INFINITY, u);
    for _ in 0..120 {
        let (value, slope) = f(u);
        // noise in f may throw later iterates about
        if value.abs() < best.0 {
            best = (value.abs(), u);
        }
        if value == 0.0 || high - low <= resolution {
            break;
        }
        if (value > 0.0) == rising {
            high = u;
        } else {
            low = u;
        }
        let newton = u - value / slope;
        // a step that does not halve the one before it is no Newton convergence
        let good = newton >= low && newton <= high && (newton - u).abs() <= 0.5 * last_step;
        if good && (newton - u).abs() <= resolution {
            break;
        }
        let next = if good { newton } else { 0.5 * (low + high) };
        last_step = (next - u).abs();
        u = next;
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_roots_of_a_product_are_isolated() {
        let roots = [0.1, 0.25, 0.5, 0.5001, 0.93];
        let polynomial = roots.iter().fold(vec![1.0], |p, r| product(&p, &[-r, 1.0 - r]));
        let mut found = vec![];
        isolate(&polynomial, 1e-17, |a, b, _| found.push((a, b)));
        assert_eq!(found.len(), 5, "{found:?}");
        found.sort_by(|a, b| a.partial_cmp(b).unwrap());
        for (&root, &(a, b)) in roots.iter().zip(&found) {
            assert!(a <= root && root <= b, "{root} {a} {b}");
        }
    }

    #[test]
    fn double_roots_are_points_and_zero_has_none() {
        let mut found = vec![];
        isolate(&product(&[-0.3, 0.7], &[-0.3, 0.7]), 1e-16, |a, b, _| found.push((a, b)));
        assert!(!found.is_empty() && found.iter().all(|(a, b)| (0.5 * (a + b) - 0.3).abs() < 1e-7), "{found:?}");
        isolate(&[1e-20; 6], 1e-16, |_, _, _| panic!("zero has no isolated root"));
    }

    #[test]
    fn noise_overflow_and_no_numbers_end() {
        // a polynomial of nothing but noise, with a noise level far below it
        let noise: Vec<f64> = (0..40).map(|k| if k % 2 == 0 { 1e-17 } else { -1e-17 }).collect();
        for coefficients in [noise, vec![f64::MAX, -f64::MAX, f64::MAX, -f64::MAX], vec![f64::NAN, 1.0, f64::NAN, -1.0]]
        {
            let mut visits = 0;
            isolate(&coefficients, 0.0, |low, high, _| {
                assert!((0.0..=1.0).contains(&low) && (low..=1.0).contains(&high));
                visits += 1;
            });
            assert!(visits < 64 * 40, "{visits}");
        }
    }

    #[test]
    fn a_root_at_the_end_does_not_hide_the_inner_one() {
        // t (t - 0.3)
        let polynomial = product(&[0.0, 1.0], &[-0.3, 0.7]);
        let mut found = vec![];
        isolate(&polynomial, 1e-16, |a, b, rising| {
            found.push(isolated(a, b, rising, |t| (t * (t - 0.3), 2.0 * t - 0.3)));
        });
        assert!(found.len() == 1 && (found[0] - 0.3).abs() < 1e-15, "{found:?}");
    }

    #[test]
    fn bracketed_newton_is_safe() {
        // Newton alone diverges on this one
        let root = bracketed(-3.0, 5.0, |x| (x.atan() - 0.2, 1.0 / (1.0 + x * x)));
        assert!((root - 0.2f64.tan()).abs() < 1e-15);
        // flat at the root: only bisection-like progress
        let flat = bracketed(-1.0, 2.0, |x| ((x - 0.3).powi(3), 3.0 * (x - 0.3).powi(2)));
        assert!((flat - 0.3).abs() < 1e-12, "{flat}");
        let none = bracketed(0.0, 1.0, |x| (x + 1.0, 1.0));
        assert_eq!(none, 0.0);
    }
}
