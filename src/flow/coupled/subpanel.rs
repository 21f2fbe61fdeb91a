//! Interaction below the panel scale: the flat-wall response of the speed to the mass defect, over the node index.
//!
//! A wall with outflow σ has the speed (1/π) ∫ σ(s')/(s − s') ds'. Taken at the resolution of the stations, less the
//! same at the resolution of the nodes, it restores the stiffness of waves that are too short for the panels; for a
//! smooth defect both agree. The kernel is cut off smoothly after [`REACH`] panels, where they agree anyhow.

use crate::scalar::Scalar;
use std::f64::consts::PI;

/// Range of the interaction, in panels.
pub(crate) const REACH: f64 = 10.0;

/// x ln|x|, the second integral of 1/x.
#[inline(always)]
fn second_integral<S: Scalar>(x: S) -> S {
    let (value, log) = (x.re(), x.re().abs().ln());
    let inverse = if S::NDERIV > 1 { value.recip() } else { 0.0 };
    x.chain([value * log, log + 1.0, inverse, -inverse * inverse])
}

/// What the difference quotient becomes at the two ends of the surface: the defect goes on with the same slope as
/// far as the interaction reaches. (In truth it goes on in the wake; ending it would leave a logarithm.)
fn at_end() -> f64 {
    REACH.ln() + 1.0
}

/// Share of the correction near the ends of the surface, `last` the index of the last node: none at the trailing edge
/// itself, where the speed is that of both sides, all of it a few panels away.
pub(crate) fn share<S: Scalar>(t: S, last: f64) -> S {
    let from = |d: S| -(-(d * d)).exp() + 1.0;
    from(t) * from(-t + last)
}

/// Smooth cut-off, 1 at distance 0 and 0 beyond [`REACH`].
#[inline(always)]
fn window<S: Scalar>(distance: S) -> S {
    let ratio = distance / REACH;
    let rest = -(ratio * ratio) + 1.0;
    if rest.re() > 0.0 { rest * rest * rest / PI } else { S::from(0.0) }
}

/// Middle of the interval between two points.
fn middle<S: Scalar>(a: S, b: S) -> S {
    (a + b) * 0.5
}

/// The intervals between the points that act on each other.
pub(crate) struct Wall<S> {
    middles: Vec<S>,
    /// One over the distances of the middles.
    per_distance: Vec<S>,
}

impl<S: Scalar> Wall<S> {
    /// `t` are all points, ascending.
    pub fn new(t: &[S]) -> Self {
        let middles: Vec<S> = t.windows(2).map(|t| middle(t[0], t[1])).collect();
        let per_distance = middles.windows(2).map(|m| (m[1] - m[0]).recip()).collect();
        Self { middles, per_distance }
    }

    /// Calls `visit(k, influence)` with the speed at point `p`, which stands at `at`, per slope of the defect in
    /// interval `k` (between points k and k + 1).
    #[inline(always)]
    pub fn influences(&self, at: S, p: usize, mut visit: impl FnMut(usize, S)) {
        let last = self.middles.len() - 1;
        let here = at.re();
        let mut from = p.min(last);
        while from > 0 && here - self.middles[from - 1].re() < REACH {
            from -= 1;
        }
        let mut to = p.min(last);
        while to < last && self.middles[to].re() - here < REACH {
            to += 1;
        }
        let mut x = self.middles[from] - at;
        let mut here = second_integral(x);
        let mut below = if from == 0 {
            S::from(at_end())
        } else {
            let before = self.middles[from - 1] - at;
            (here - second_integral(before)) * self.per_distance[from - 1]
        };
        for k in from..=to {
            let (above, next_x, next);
            if k == last {
                (next_x, next) = (x, here);
                above = S::from(at_end());
            } else {
                next_x = self.middles[k + 1] - at;
                next = second_integral(next_x);
                above = (next - here) * self.per_distance[k];
            }
            visit(k, (below - above) * window(x));
            (x, here, below) = (next_x, next, above);
        }
    }
}

/// The influence of one interval by itself, as a function of the point `at` and of the four points around the
/// interval; the outer ones are missing at the ends of the surface. For the derivatives of [`Wall::influences`].
pub(crate) fn influence<S: Scalar>(at: S, before: Option<S>, interval: [S; 2], behind: Option<S>) -> S {
    let [a, b] = interval;
    let x = middle(a, b) - at;
    let quotient = |outer: Option<S>, near: S| match outer {
        Some(outer) => {
            let y = middle(outer, near) - at;
            (second_integral(x) - second_integral(y)) / (x - y)
        }
        None => S::from(at_end()),
    };
    (quotient(before, a) - quotient(behind, b)) * window(x)
}

/// Intervals that act on point `p`.
pub(crate) fn reach(t: &[f64], p: usize) -> std::ops::RangeInclusive<usize> {
    let near = |k: &usize| (middle(t[*k], t[k + 1]) - t[p]).abs() < REACH;
    let here = p.min(t.len() - 2);
    let first = (0..here).rev().take_while(near).last().unwrap_or(here);
    let last = (here..t.len() - 1).take_while(near).last().unwrap_or(here);
    first..=last
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_interval_alone_is_the_same() {
        let t = [0.0f64, 0.4, 1.0, 1.3, 2.2, 3.0];
        for p in 0..6 {
            Wall::new(&t).influences(t[p], p, |k, value| {
                let alone =
                    influence(t[p], (k > 0).then(|| t[k - 1]), [t[k], t[k + 1]], (k + 2 < t.len()).then(|| t[k + 2]));
                assert!((alone - value).abs() < 1e-14, "{p} {k}");
                assert!(reach(&t, p).contains(&k));
            });
        }
    }

    #[test]
    fn a_wave_gets_its_wave_number() {
        // m = cos(k t): slope −k sin(k t); (1/π) pv∫ m'/(t − t') dt' = k cos(k t)... of the sign of m itself
        let (count, h, k) = (401, 0.1, 2.0);
        let t: Vec<f64> = (0..count).map(|i| i as f64 * h).collect();
        let p = 200;
        let m = |i: usize| (k * (t[i] - t[p])).cos();
        let mut speed = 0.0;
        Wall::new(&t).influences(t[p], p, |i, a| speed += a * (m(i + 1) - m(i)) / h);
        assert!((speed.abs() / k - 1.0).abs() < 0.02, "{speed}");
        assert!(speed > 0.0);
    }
}
