//! Interaction below the panel scale: the flat-wall response of the speed to the mass defect, over the node index.
//!
//! A wall with outflow σ has the speed (1/π) ∫ σ(s')/(s − s') ds'. Taken at the resolution of the stations, less the
//! same at the resolution of the nodes, it restores the stiffness of waves that are too short for the panels; for a
//! smooth defect both agree. The kernel is cut off smoothly after [`REACH`] panels, where they agree anyhow.

use crate::differentiate::Tangent;
use crate::scalar::Scalar;
use std::f64::consts::FRAC_1_PI;

/// Range of the interaction, in panels.
pub(crate) const REACH: f64 = 10.0;
/// Rounding of the logarithm at the ends of the surface, in panels.
const END_ROUNDING: f64 = 0.5;

/// x ln|x|, the second integral of 1/x.
#[inline(always)]
fn second_integral<S: Scalar>(x: S) -> S {
    let (value, log) = (x.re(), x.re().abs().ln());
    let inverse = if S::NDERIV > 1 { value.recip() } else { 0.0 };
    x.chain([value * log, log + 1.0, inverse, -inverse * inverse])
}

/// What the difference quotient becomes at an end of the surface, `distance` away: the outflow ends there, and the
/// logarithm that leaves is rounded over half a panel.
///
/// (In truth the outflow goes on in the wake, for panels and stations alike; only their difference matters. Letting
/// each go on with its own last slope would spread what the last, tiny interval does over all stations in reach.)
fn at_end<S: Scalar>(distance: S) -> S {
    (distance * distance + END_ROUNDING * END_ROUNDING).ln() * 0.5 + 1.0
}

/// The difference quotient of the second integral between two points, from its values there and one over the distance
/// of the points, which is known.
#[inline(always)]
fn quotient<S: Scalar>(a: S, at_a: S, b: S, at_b: S, per_distance: f64) -> S {
    let square = per_distance * per_distance;
    (at_b - at_a) * (b - a).chain([per_distance, -square, 2.0 * square * per_distance, -6.0 * square * square])
}

/// Smooth cut-off, 1 at distance 0 and 0 beyond [`REACH`].
#[inline(always)]
fn window<S: Scalar>(distance: S) -> S {
    let ratio = distance * (1.0 / REACH);
    let rest = -(ratio * ratio) + 1.0;
    if rest.re() > 0.0 { rest * rest * rest * FRAC_1_PI } else { S::from(0.0) }
}

/// Middle of the interval between two points.
fn middle<S: Scalar>(a: S, b: S) -> S {
    (a + b) * 0.5
}

/// The intervals between the points that act on each other.
pub(crate) struct Wall<S = f64> {
    middles: Vec<S>,
    /// One over the distances of the middles.
    per_distance: Vec<f64>,
    /// First and last point.
    ends: [S; 2],
}

/// Sub-panel speed at one point, with its derivatives with respect to the point's own place and to the middles of the
/// intervals (those of `range`, others are zero).
pub(crate) struct LocalSpeed {
    pub speed: f64,
    pub by_place: f64,
    pub range: std::ops::Range<usize>,
}

impl<S: Scalar> Wall<S> {
    /// `t` are all points, ascending.
    pub fn new(t: &[S]) -> Self {
        let middles: Vec<S> = t.windows(2).map(|t| middle(t[0], t[1])).collect();
        let per_distance = middles.windows(2).map(|m| (m[1].re() - m[0].re()).recip()).collect();
        Self { middles, per_distance, ends: [t[0], t[t.len() - 1]] }
    }

    /// Intervals that act on point `p`.
    fn reach(&self, at: f64, p: usize) -> [usize; 2] {
        let last = self.middles.len() - 1;
        let mut from = p.min(last);
        while from > 0 && at - self.middles[from - 1].re() < REACH {
            from -= 1;
        }
        let mut to = p.min(last);
        while to < last && self.middles[to].re() - at < REACH {
            to += 1;
        }
        [from, to]
    }

    /// Calls `visit(k, influence)` with the speed at point `p`, which stands at `at`, per slope of the defect in
    /// interval `k` (between points k and k + 1).
    #[inline(always)]
    pub fn influences(&self, at: S, p: usize, mut visit: impl FnMut(usize, S)) {
        let last = self.middles.len() - 1;
        let [from, to] = self.reach(at.re(), p);
        let mut x = self.middles[from] - at;
        let mut here = second_integral(x);
        let mut below = if from == 0 {
            at_end(self.ends[0] - at)
        } else {
            let before = self.middles[from - 1] - at;
            quotient(before, second_integral(before), x, here, self.per_distance[from - 1])
        };
        for k in from..=to {
            let (above, next_x, next);
            if k == last {
                (next_x, next) = (x, here);
                above = at_end(self.ends[1] - at);
            } else {
                next_x = self.middles[k + 1] - at;
                next = second_integral(next_x);
                above = quotient(x, here, next_x, next, self.per_distance[k]);
            }
            visit(k, (below - above) * window(x));
            (x, here, below) = (next_x, next, above);
        }
    }
}

impl Wall {
    /// The speed at point `p` for given slopes of the defect, with its derivatives; those with respect to the middles
    /// are written to `by_middle`. Calls `visit(k, influence)` like [`influences`](Self::influences).
    ///
    /// Every influence depends on three neighbouring middles alone: dual numbers carry two or three derivatives in
    /// place of those of all that moves the points.
    pub fn differentiate(
        &self,
        at: f64,
        p: usize,
        slopes: &[f64],
        by_middle: &mut [f64],
        mut visit: impl FnMut(usize, f64),
    ) -> LocalSpeed {
        let last = self.middles.len() - 1;
        let [from, to] = self.reach(at, p);
        let range = from.saturating_sub(1)..(to + 2).min(last + 1);
        by_middle[range.clone()].fill(0.0);
        let place = |k: usize| Tangent::<1>::from_re(self.middles[k] - at).derivative(0);
        // a number that depends on one of two variables
        let first = |v: Tangent<1>| Tangent::<2> { re: v.re, eps: [v.eps[0], 0.0] };
        let second = |v: Tangent<1>| Tangent::<2> { re: v.re, eps: [0.0, v.eps[0]] };
        let between = |k: usize, a: Tangent<1>, at_a: Tangent<1>, b: Tangent<1>, at_b: Tangent<1>| {
            quotient(first(a), first(at_a), second(b), second(at_b), self.per_distance[k])
        };
        let end = |k: usize| at_end(Tangent::<1>::from_re(self.ends[k] - at).derivative(0));
        let mut speed = 0.0;
        let mut by_ends = 0.0;
        let mut x = place(from);
        let mut here = second_integral(x);
        let mut below = if from == 0 {
            by_ends += end(0).eps[0] * window(x.re) * slopes[0];
            Tangent::from_re(end(0).re)
        } else {
            let before = place(from - 1);
            between(from - 1, before, second_integral(before), x, here)
        };
        for k in from..=to {
            let (next_x, next, above);
            if k == last {
                (next_x, next) = (x, here);
                by_ends -= end(1).eps[0] * window(x.re) * slopes[last];
                above = Tangent::from_re(end(1).re);
            } else {
                next_x = place(k + 1);
                next = second_integral(next_x);
                above = between(k, x, here, next_x, next);
            }
            let window = window(x);
            let difference = below.re - above.re;
            let influence = difference * window.re;
            visit(k, influence);
            speed += influence * slopes[k];
            let weight = window.re * slopes[k];
            by_middle[k.saturating_sub(1)] += weight * below.eps[0];
            by_middle[k] += weight * (below.eps[1] - above.eps[0]) + difference * window.eps[0] * slopes[k];
            by_middle[(k + 1).min(last)] -= weight * above.eps[1];
            (x, here, below) = (next_x, next, above);
        }
        let by_place = -by_middle[range.clone()].iter().sum::<f64>() - by_ends;
        LocalSpeed { speed, by_place, range }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_the_influences() {
        let t = [0.0f64, 0.4, 1.0, 1.3, 2.2, 3.0, 9.0, 14.0, 16.0];
        let slopes: Vec<f64> = (0..8).map(|k| (1.7 * f64::from(k)).cos()).collect();
        for p in 1..8 {
            // all points as variables
            let moving: Vec<Tangent<9>> = (0..9).map(|q| Tangent::from_re(t[q]).derivative(q)).collect();
            let (mut expected, mut found) = (Tangent::from_re(0.0), [0.0; 9]);
            let mut influences = Vec::new();
            Wall::new(&moving).influences(moving[p], p, |k, value| {
                expected += value * slopes[k];
                influences.push((k, value.re));
            });
            let (mut by_middle, mut seen) = (vec![f64::NAN; 8], Vec::new());
            let visit = |k, value| seen.push((k, value));
            let local = Wall::new(&t).differentiate(t[p], p, &slopes, &mut by_middle, visit);
            assert_eq!(influences, seen);
            assert!((local.speed - expected.re).abs() < 1e-14);
            found[p] += local.by_place;
            for k in local.range {
                found[k] += 0.5 * by_middle[k];
                found[k + 1] += 0.5 * by_middle[k];
            }
            for q in 1..8 {
                assert!((found[q] - expected.eps[q]).abs() < 1e-12, "{p} {q}: {} {}", found[q], expected.eps[q]);
            }
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
