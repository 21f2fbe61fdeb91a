//! Interaction below the panel scale: the flat-wall response of the speed to the mass defect, over the node index.
//!
//! A wall with outflow σ has the speed (1/π) ∫ σ(s')/(s − s') ds'. Taken at the resolution of the stations, less the
//! same at the resolution of the nodes, it restores the stiffness of waves that are too short for the panels; for a
//! smooth defect both agree. The kernel is cut off smoothly after [`REACH`] panels, where they agree anyhow.

use crate::differentiate::Tangent;
use crate::flow::linear::{dot, sum};
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

/// Sub-panel speed at one point, with what it consists of: one number for every interval of `range`, which those that
/// do not act only make wider.
pub(crate) struct LocalSpeed<'a> {
    pub speed: f64,
    /// Derivative with respect to the place of the point itself.
    pub by_place: f64,
    pub range: std::ops::Range<usize>,
    /// Speed per slope of the defect.
    pub influences: &'a [f64],
    /// Derivatives with respect to the middles of the intervals.
    pub by_middle: &'a [f64],
}

/// Sub-panel speeds for given slopes of the defect, with their derivatives.
///
/// Every influence depends on three neighbouring middles alone: dual numbers carry one or two derivatives in place of
/// those of all that moves the points. The intervals that act on a point are worked off together, step by step, so that
/// the compiler can use vectors.
pub(crate) struct LocalSpeeds<'a> {
    wall: Wall,
    /// Slope of the defect in every interval.
    slopes: &'a [f64],
    /// Of the middles that matter for the point under way: places, and the second integral there with its derivative.
    middles: [Vec<f64>; 3],
    /// Below the first of these middles, between them, and above the last.
    quotients: Partial,
    /// Influences.
    influences: Vec<f64>,
    /// Derivatives of the speed with respect to the middle below, the own middle and the one above.
    shares: [Vec<f64>; 3],
    by_middle: Vec<f64>,
}

/// Numbers with their derivatives with respect to the middles below and above.
struct Partial {
    value: Vec<f64>,
    below: Vec<f64>,
    above: Vec<f64>,
}

/// A number that depends on the first of two variables, and one that depends on the second.
#[inline(always)]
fn first(value: f64, derivative: f64) -> Tangent<2> {
    Tangent { re: value, eps: [derivative, 0.0] }
}

#[inline(always)]
fn second(value: f64, derivative: f64) -> Tangent<2> {
    Tangent { re: value, eps: [0.0, derivative] }
}

/// Difference quotients of the second integral between neighbouring middles (places, values and derivatives).
#[inline(never)]
fn add_quotients(middles: [&[f64]; 3], per_distance: &[f64], quotients: [&mut [f64]; 3]) {
    let n = per_distance.len();
    let [x, value, slope] = middles.map(|v| &v[..n + 1]);
    let [result, below, above] = quotients.map(|v| &mut v[..n]);
    for i in 0..n {
        let (a, at_a) = (first(x[i], 1.0), first(value[i], slope[i]));
        let (b, at_b) = (second(x[i + 1], 1.0), second(value[i + 1], slope[i + 1]));
        let q = quotient(a, at_a, b, at_b, per_distance[i]);
        (result[i], below[i], above[i]) = (q.re, q.eps[0], q.eps[1]);
    }
}

/// Influences of the intervals and the derivatives of the speed; `quotients` are those below every interval and, last,
/// above.
#[inline(never)]
fn add_influences(x: &[f64], slopes: &[f64], quotients: [&[f64]; 3], influences: &mut [f64], shares: [&mut [f64]; 3]) {
    let n = influences.len();
    let (x, slopes) = (&x[..n], &slopes[..n]);
    let [value, below, above] = quotients.map(|v| &v[..n + 1]);
    let [by_below, by_own, by_above] = shares.map(|v| &mut v[..n]);
    for i in 0..n {
        let window = window(Tangent::<1>::from_re(x[i]).derivative(0));
        let difference = value[i] - value[i + 1];
        influences[i] = difference * window.re;
        let weight = window.re * slopes[i];
        by_below[i] = weight * below[i];
        by_own[i] = weight * (above[i] - below[i + 1]) + difference * window.eps[0] * slopes[i];
        by_above[i] = -weight * above[i + 1];
    }
}

impl<'a> LocalSpeeds<'a> {
    /// `t` are all points, ascending; `slopes` those of the defect between them.
    pub fn new(t: &[f64], slopes: &'a [f64]) -> Self {
        let room = || vec![0.0; t.len() + 2];
        Self {
            wall: Wall::new(t),
            slopes,
            middles: [room(), room(), room()],
            quotients: Partial { value: room(), below: room(), above: room() },
            influences: room(),
            shares: [room(), room(), room()],
            by_middle: room(),
        }
    }

    /// The speed at point `p`, which stands at `at`.
    pub fn at(&mut self, at: f64, p: usize) -> LocalSpeed<'_> {
        let last = self.slopes.len() - 1;
        let [from, to] = self.wall.reach(at, p);
        let range = from.saturating_sub(1)..(to + 2).min(last + 1);
        let (start, count) = (range.start, range.len());
        for i in 0..count {
            let x = self.wall.middles[start + i] - at;
            let integral = second_integral(Tangent::<1>::from_re(x).derivative(0));
            for (list, value) in self.middles.iter_mut().zip([x, integral.re, integral.eps[0]]) {
                list[i] = value;
            }
        }
        let by_ends = self.fill_quotients(at, start, count);
        // the intervals that act, counted from the first of the range
        let (acting, all) = (from - start..to + 1 - start, 0..count);
        self.influences[all.clone()].fill(0.0);
        for list in &mut self.shares {
            list[..count + 2].fill(0.0);
        }
        let quotients = [&self.quotients.value, &self.quotients.below, &self.quotients.above];
        let shares = self.shares.each_mut().map(|list| &mut list[acting.start + 1..]);
        add_influences(
            &self.middles[0][acting.clone()],
            &self.slopes[from..=to],
            quotients.map(|list| &list[acting.start..]),
            &mut self.influences[acting],
            shares,
        );
        let [by_below, by_own, by_above] = &self.shares;
        for i in 0..count {
            // what interval i + 1 has below it is interval i
            self.by_middle[i] = by_below[i + 2] + by_own[i + 1] + by_above[i];
        }
        let (influences, by_middle) = (&self.influences[all.clone()], &self.by_middle[all]);
        let speed = dot(influences, &self.slopes[range.clone()]);
        LocalSpeed { speed, by_place: -sum(by_middle) - by_ends, range, influences, by_middle }
    }

    /// Quotients below, between and above `count` middles from number `start`; returns what the speed changes by where
    /// the ends of the surface move, and the middles do not.
    fn fill_quotients(&mut self, at: f64, start: usize, count: usize) -> f64 {
        let last = self.slopes.len() - 1;
        let Partial { value, below, above } = &mut self.quotients;
        let middles = self.middles.each_ref().map(|list| &list[..count]);
        let lists = [&mut value[1..count], &mut below[1..count], &mut above[1..count]];
        add_quotients(middles, &self.wall.per_distance[start..start + count - 1], lists);
        let mut by_ends = 0.0;
        for (end, place, interval, sign) in [(0, 0, 0, 1.0), (1, count, last, -1.0)] {
            if !(start..start + count).contains(&interval) {
                continue;
            }
            let quotient = at_end(Tangent::<1>::from_re(self.wall.ends[end] - at).derivative(0));
            (value[place], below[place], above[place]) = (quotient.re, 0.0, 0.0);
            by_ends += sign * quotient.eps[0] * window(self.wall.middles[interval] - at) * self.slopes[interval];
        }
        by_ends
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
            let mut speeds = LocalSpeeds::new(&t, &slopes);
            let local = speeds.at(t[p], p);
            let acting = local.range.clone().zip(local.influences.iter().copied()).filter(|(_, v)| *v != 0.0);
            influences.retain(|(_, influence)| *influence != 0.0);
            assert_eq!(influences, acting.collect::<Vec<_>>());
            assert!((local.speed - expected.re).abs() < 1e-14);
            found[p] += local.by_place;
            for (k, by_middle) in local.range.zip(local.by_middle) {
                found[k] += 0.5 * by_middle;
                found[k + 1] += 0.5 * by_middle;
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
