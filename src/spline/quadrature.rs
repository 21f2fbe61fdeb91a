//! Gauss-Legendre quadrature.

use crate::scalar::Scalar;
use num_dual::{Dual64, first_derivative};

/// Nodes and weights of Gauss-Legendre quadrature, exact for polynomials of degree `2 · points − 1`.
///
/// ```
/// use aeroform::spline::GaussRule;
/// let rule = GaussRule::new(3);
/// let integral = rule.integrate(0.0, 2.0, |x| x.powi(5));
/// assert!((integral - 64.0 / 6.0).abs() < 1e-14);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct GaussRule {
    /// Node on [−1, 1] and weight, in increasing order.
    nodes: Vec<(f64, f64)>,
}

impl GaussRule {
    /// The rule with `points` nodes (none counts as one), by Newton's method on the Legendre polynomial to round-off.
    pub fn new(points: usize) -> Self {
        let n = points.max(1);
        let at = |x: f64| first_derivative(|x: Dual64| legendre(n, x), x);
        let mut nodes = vec![(0.0, 0.0); n];
        for i in 0..n.div_ceil(2) {
            // asymptotic for the i-th largest root; within the basin of Newton's method for every n
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            if 2 * i + 1 == n {
                x = 0.0;
            }
            let mut slope = at(x).1;
            for _ in 0..10 {
                let (value, derivative) = at(x);
                let step = value / derivative;
                x -= step;
                slope = at(x).1;
                if step.abs() <= f64::EPSILON {
                    break;
                }
            }
            let weight = 2.0 / ((1.0 - x) * (1.0 + x) * slope * slope);
            nodes[i] = (-x, weight);
            nodes[n - 1 - i] = (x, weight);
        }
        Self { nodes }
    }

    /// Nodes on [−1, 1] and weights, in increasing order.
    pub fn nodes(&self) -> &[(f64, f64)] {
        &self.nodes
    }

    /// Nodes and weights on `[a, b]`.
    pub fn on(&self, a: f64, b: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
        self.nodes.iter().map(move |&(x, w)| (middle + half * x, half * w))
    }

    /// The integral of `f` from `a` to `b`.
    pub fn integrate<S: Scalar>(&self, a: f64, b: f64, mut f: impl FnMut(f64) -> S) -> S {
        let mut sum = S::from(0.0);
        for (x, w) in self.on(a, b) {
            sum += f(x) * w;
        }
        sum
    }

    /// The integral of `f` between limits that may carry derivatives.
    pub fn integrate_between<S: Scalar>(&self, a: S, b: S, mut f: impl FnMut(S) -> S) -> S {
        let (middle, half) = ((a + b) * 0.5, (b - a) * 0.5);
        let mut sum = S::from(0.0);
        for &(x, w) in &self.nodes {
            sum += f(middle + half * x) * w;
        }
        sum * half
    }
}

/// Legendre polynomial of degree `n >= 1`.
fn legendre<S: Scalar>(n: usize, x: S) -> S {
    let (mut before, mut value) = (S::from(1.0), x);
    for k in 2..=n {
        let k = k as f64;
        (before, value) = (value, (x * value * (2.0 * k - 1.0) - before * (k - 1.0)) / k);
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::{Dual64, DualNum};

    #[test]
    fn polynomials_are_integrated_exactly() {
        for points in 1..=40 {
            let rule = GaussRule::new(points);
            assert_eq!(rule.nodes().len(), points);
            assert!(rule.nodes().windows(2).all(|w| w[0].0 < w[1].0));
            for power in 0..2 * points as i32 {
                let exact = 1.0 / (power + 1) as f64;
                let error = rule.integrate(0.0, 1.0, |x: f64| x.powi(power)) - exact;
                assert!(error.abs() < 1e-14 * exact.max(0.1), "{points} {power} {error}");
            }
            let beyond = rule.integrate(-1.0, 1.0, |x: f64| x.powi(2 * points as i32)) - 2.0 / (2 * points + 1) as f64;
            assert!(points > 15 || beyond < -1e-11, "{points} {beyond}");
        }
    }

    #[test]
    fn two_and_three_points_are_the_textbook_ones() {
        let two = GaussRule::new(2);
        assert!((two.nodes()[1].0 - (1.0f64 / 3.0).sqrt()).abs() < 1e-16 && (two.nodes()[1].1 - 1.0).abs() < 3e-16);
        let three = GaussRule::new(3);
        assert_eq!(three.nodes()[1].0, 0.0);
        assert!((three.nodes()[2].0 - 0.6f64.sqrt()).abs() < 2e-16);
        assert!((three.nodes()[1].1 - 8.0 / 9.0).abs() < 3e-16);
    }

    #[test]
    fn limits_carry_derivatives() {
        let rule = GaussRule::new(12);
        let b = Dual64::new(0.8, 1.0);
        let integral = rule.integrate_between(Dual64::from(0.1), b, |x| x.exp());
        assert!((integral.re - (0.8f64.exp() - 0.1f64.exp())).abs() < 1e-15);
        assert!((integral.eps - 0.8f64.exp()).abs() < 2e-15);
    }
}
