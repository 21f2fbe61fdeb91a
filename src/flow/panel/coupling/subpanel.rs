//! Interaction below the panel scale: the response of the speed on a flat wall to the mass defect, over the node index.
//!
//! A wall with outflow σ has the speed (1/π) ∫ σ(s')/(s − s') ds'. This speed at the resolution of the stations, less
//! the speed at the resolution of the nodes, restores the stiffness of waves that are too short for the panels; for a
//! smooth defect both agree. The kernel is cut off smoothly after [`REACH`] panels, where they agree anyhow.
//!
//! [`Wall`] holds the formula, over any number. [`LocalSpeeds`] evaluates it with derivatives by narrow dual numbers whose
//! chain rule is written out, so that the intervals in reach go through vectors: with [`Wall`] in its place a cold point
//! takes 2.9 % more instructions and a warm one 3.7 %. A unit test holds both to each other.

use crate::differentiate::Tangent;
use crate::flow::elementary::log_distances;
use crate::flow::linear::{dot, sum};
use crate::scalar::Scalar;
use std::f64::consts::FRAC_1_PI;

/// Range of the interaction, in panels.
pub(crate) const REACH: f64 = 10.0;
/// Rounding of the logarithm at the ends of the surface, in panels.
const END_ROUNDING: f64 = 0.5;

/// The second integral of 1/x, x ln|x|, from the logarithm ln|x|.
#[inline(always)]
fn second_integral<S: Scalar>(x: S, log: f64) -> S {
    let value = x.re();
    let inverse = if S::NDERIV > 1 { value.recip() } else { 0.0 };
    x.chain([value * log, log + 1.0, inverse, -inverse * inverse])
}

/// The value that replaces the difference quotient at an end of the surface, `distance` away. The outflow ends there,
/// and the logarithm that this leaves is rounded over half a panel.
///
/// (In truth the outflow goes on in the wake, for panels and stations alike; only their difference matters. Letting
/// each go on with its own last slope would spread the effect of the last, tiny interval over all stations in reach.)
fn at_end<S: Scalar>(distance: S) -> S {
    (distance * distance + END_ROUNDING * END_ROUNDING).ln() * 0.5 + 1.0
}

/// The difference quotient of the second integral between two points, from the values there and the known reciprocal of
/// the distance of the points.
#[inline(always)]
fn quotient<S: Scalar>(a: S, at_a: S, b: S, at_b: S, per_distance: f64) -> S {
    let square = per_distance * per_distance;
    (at_b - at_a) * (b - a).chain([per_distance, -square, 2.0 * square * per_distance, -6.0 * square * square])
}

/// Smooth cut-off of the kernel, with the factor 1/π: full at distance 0 and zero beyond [`REACH`].
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

/// The intervals between the points that act on each other, over the node index.
pub(crate) struct Wall<S = f64> {
    /// Node indices of the middles of the intervals.
    middles: Vec<S>,
    /// Reciprocals of the distances between neighbouring middles.
    per_distance: Vec<f64>,
    /// First and last point.
    ends: [S; 2],
}

impl<S: Scalar> Wall<S> {
    /// The intervals between points with the node indices `t`, ascending.
    pub fn new(t: &[S]) -> Self {
        let middles: Vec<S> = t.windows(2).map(|t| middle(t[0], t[1])).collect();
        let per_distance = middles.windows(2).map(|m| (m[1].re() - m[0].re()).recip()).collect();
        Self { middles, per_distance, ends: [t[0], t[t.len() - 1]] }
    }

    /// First and last interval that act on point `p`, which stands at `at`.
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

    /// Calls `visit(k, influence)` for every interval `k` (between the points k and k + 1) that acts on point `p`,
    /// which stands at `at`. The influence is the speed at the point per slope of the defect in the interval.
    #[inline(always)]
    pub fn influences(&self, at: S, p: usize, mut visit: impl FnMut(usize, S)) {
        let last = self.middles.len() - 1;
        let [from, to] = self.reach(at.re(), p);
        let mut x = self.middles[from] - at;
        let integral = |x: S| second_integral(x, x.re().abs().ln());
        let mut here = integral(x);
        let mut below = if from == 0 {
            at_end(self.ends[0] - at)
        } else {
            let before = self.middles[from - 1] - at;
            quotient(before, integral(before), x, here, self.per_distance[from - 1])
        };
        for k in from..=to {
            let (above, next_x, next);
            if k == last {
                (next_x, next) = (x, here);
                above = at_end(self.ends[1] - at);
            } else {
                next_x = self.middles[k + 1] - at;
                next = integral(next_x);
                above = quotient(x, here, next_x, next, self.per_distance[k]);
            }
            visit(k, (below - above) * window(x));
            (x, here, below) = (next_x, next, above);
        }
    }
}

/// Sub-panel speed at one point, with the parts it consists of. The lists have one number per interval of `range`,
/// which may contain intervals that do not act.
pub(crate) struct LocalSpeed<'a> {
    /// Speed at the point, to be divided by the arc-length rate.
    pub speed: f64,
    /// Derivative with respect to the place of the point itself.
    pub by_place: f64,
    /// Intervals to which the lists belong.
    pub range: std::ops::Range<usize>,
    /// Speed per slope of the defect in every interval.
    pub influences: &'a [f64],
    /// Derivatives with respect to the middles of the intervals.
    pub by_middle: &'a [f64],
}

/// Sub-panel speeds for given slopes of the defect, with or without their derivatives.
///
/// Every influence depends on three neighbouring middles alone, so that dual numbers carry one or two derivatives in
/// place of those with respect to everything that moves the points. The intervals that act on a point are worked off
/// together, step by step, so that the compiler can use vectors.
pub(crate) struct LocalSpeeds<'a> {
    wall: Wall,
    /// Slope of the defect in every interval.
    slopes: &'a [f64],
    middles: Middles,
    quotients: Quotients,
    influences: Vec<f64>,
    /// Derivatives of the speed with respect to the middle below every interval, the middle of the interval, and the
    /// one above.
    shares: [Vec<f64>; 3],
    by_middle: Vec<f64>,
}

/// The middles of the intervals that matter for the present point, relative to that point.
struct Middles {
    /// Node indices of the middles less that of the point.
    place: Vec<f64>,
    /// Logarithms of the distances between the middles and the point.
    log: Vec<f64>,
    /// Second integral at the middles.
    integral: Vec<f64>,
    /// Derivative of the second integral at the middles.
    slope: Vec<f64>,
}

/// Difference quotients of the second integral below the first of the present middles, between them, and above the
/// last, with their derivatives with respect to the middles below and above.
struct Quotients {
    /// Values of the quotients.
    value: Vec<f64>,
    /// Derivatives of the quotients with respect to the middle below.
    below: Vec<f64>,
    /// Derivatives of the quotients with respect to the middle above.
    above: Vec<f64>,
}

/// Intervals that act on a point, and all intervals whose middles matter: the acting ones and those next to them.
struct Reach {
    acting: std::ops::Range<usize>,
    all: std::ops::Range<usize>,
}

impl Reach {
    /// Positions of the acting intervals among all.
    fn inner(&self) -> std::ops::Range<usize> {
        self.acting.start - self.all.start..self.acting.end - self.all.start
    }
}

/// A number that depends on the first of two variables alone.
#[inline(always)]
fn first(value: f64, derivative: f64) -> Tangent<2> {
    Tangent { re: value, eps: [derivative, 0.0] }
}

/// A number that depends on the second of two variables alone.
#[inline(always)]
fn second(value: f64, derivative: f64) -> Tangent<2> {
    Tangent { re: value, eps: [0.0, derivative] }
}

/// Influences of intervals from their middles `x` and from the quotients below each interval and, last, above the last
/// one.
#[inline(never)]
fn fill_influences(x: &[f64], quotients: &[f64], influences: &mut [f64]) {
    let n = influences.len();
    let (x, quotients) = (&x[..n], &quotients[..n + 1]);
    for i in 0..n {
        influences[i] = (quotients[i] - quotients[i + 1]) * window(x[i]);
    }
}

/// Derivatives of the speed with respect to the middles below, of, and above every interval.
#[inline(never)]
fn fill_shares(x: &[f64], slopes: &[f64], quotients: [&[f64]; 3], shares: [&mut [f64]; 3]) {
    let n = x.len();
    let slopes = &slopes[..n];
    let [value, below, above] = quotients.map(|v| &v[..n + 1]);
    let [by_below, by_own, by_above] = shares.map(|v| &mut v[..n]);
    for i in 0..n {
        let window = window(Tangent::<1>::from_re(x[i]).derivative(0));
        let weight = window.re * slopes[i];
        by_below[i] = weight * below[i];
        by_own[i] = weight * (above[i] - below[i + 1]) + (value[i] - value[i + 1]) * window.eps[0] * slopes[i];
        by_above[i] = -weight * above[i + 1];
    }
}

impl Middles {
    fn new(count: usize) -> Self {
        let room = || vec![0.0; count];
        Self { place: room(), log: room(), integral: room(), slope: room() }
    }

    /// Computes places, logarithms and integrals for a point that stands at `at`.
    #[inline(never)]
    fn set(&mut self, middles: &[f64], at: f64) {
        let n = middles.len();
        for (place, middle) in self.place[..n].iter_mut().zip(middles) {
            *place = middle - at;
        }
        log_distances(&self.place[..n], &mut self.log[..n]);
        let (place, log) = (&self.place[..n], &self.log[..n]);
        let (integrals, slopes) = (&mut self.integral[..n], &mut self.slope[..n]);
        for i in 0..n {
            let integral = second_integral(Tangent::<1>::from_re(place[i]).derivative(0), log[i]);
            (integrals[i], slopes[i]) = (integral.re, integral.eps[0]);
        }
    }
}

impl Quotients {
    fn new(count: usize) -> Self {
        let room = || vec![0.0; count];
        Self { value: room(), below: room(), above: room() }
    }

    /// Computes the quotients between the middles.
    #[inline(never)]
    fn set(&mut self, middles: &Middles, per_distance: &[f64]) {
        let n = per_distance.len();
        let (x, integral) = (&middles.place[..n + 1], &middles.integral[..n + 1]);
        let value = &mut self.value[1..n + 1];
        for i in 0..n {
            value[i] = quotient(x[i], integral[i], x[i + 1], integral[i + 1], per_distance[i]);
        }
    }

    /// Computes the derivatives of the quotients between the middles.
    #[inline(never)]
    fn differentiate(&mut self, middles: &Middles, per_distance: &[f64]) {
        let n = per_distance.len();
        let (x, integral, slope) = (&middles.place[..n + 1], &middles.integral[..n + 1], &middles.slope[..n + 1]);
        let (below, above) = (&mut self.below[1..n + 1], &mut self.above[1..n + 1]);
        for i in 0..n {
            let (a, at_a) = (first(x[i], 1.0), first(integral[i], slope[i]));
            let (b, at_b) = (second(x[i + 1], 1.0), second(integral[i + 1], slope[i + 1]));
            let q = quotient(a, at_a, b, at_b, per_distance[i]);
            (below[i], above[i]) = (q.eps[0], q.eps[1]);
        }
        (self.below[0], self.above[0]) = (0.0, 0.0);
        (self.below[n + 1], self.above[n + 1]) = (0.0, 0.0);
    }
}

impl<'a> LocalSpeeds<'a> {
    /// Speeds at points with the node indices `t`, ascending; `slopes` are the slopes of the defect between them.
    pub fn new(t: &[f64], slopes: &'a [f64]) -> Self {
        let room = || vec![0.0; t.len() + 2];
        Self {
            wall: Wall::new(t),
            slopes,
            middles: Middles::new(t.len()),
            quotients: Quotients::new(t.len() + 1),
            influences: room(),
            shares: [room(), room(), room()],
            by_middle: room(),
        }
    }

    /// The speed at point `p`, which stands at `at`, and the influences of a range of intervals.
    pub fn value(&mut self, at: f64, p: usize) -> (f64, std::ops::Range<usize>, &[f64]) {
        let range = self.fill(at, p).all;
        let influences = &self.influences[..range.len()];
        (dot(influences, &self.slopes[range.clone()]), range, influences)
    }

    /// The speed at point `p`, which stands at `at`, with its derivatives.
    pub fn at(&mut self, at: f64, p: usize) -> LocalSpeed<'_> {
        let reach = self.fill(at, p);
        let (inner, count) = (reach.inner(), reach.all.len());
        self.quotients.differentiate(&self.middles, &self.wall.per_distance[reach.all.start..reach.all.end - 1]);
        for list in &mut self.shares {
            list[..count + 2].fill(0.0);
        }
        let Quotients { value, below, above } = &self.quotients;
        let shares = self.shares.each_mut().map(|list| &mut list[inner.start + 1..]);
        let quotients = [value, below, above].map(|list| &list[inner.start..]);
        fill_shares(&self.middles.place[inner], &self.slopes[reach.acting.clone()], quotients, shares);
        let [by_below, by_own, by_above] = &self.shares;
        for i in 0..count {
            // what interval i + 1 has below it is interval i
            self.by_middle[i] = by_below[i + 2] + by_own[i + 1] + by_above[i];
        }
        let by_ends = self.by_ends(at, &reach.all);
        let (influences, by_middle) = (&self.influences[..count], &self.by_middle[..count]);
        let speed = dot(influences, &self.slopes[reach.all.clone()]);
        LocalSpeed { speed, by_place: -sum(by_middle) - by_ends, range: reach.all, influences, by_middle }
    }

    /// Computes middles, quotients and influences for point `p`, which stands at `at`.
    fn fill(&mut self, at: f64, p: usize) -> Reach {
        let last = self.slopes.len() - 1;
        let [from, to] = self.wall.reach(at, p);
        let reach = Reach { acting: from..to + 1, all: from.saturating_sub(1)..(to + 2).min(last + 1) };
        let (inner, count) = (reach.inner(), reach.all.len());
        self.middles.set(&self.wall.middles[reach.all.clone()], at);
        self.quotients.set(&self.middles, &self.wall.per_distance[reach.all.start..reach.all.end - 1]);
        for (end, place) in self.ends(&reach.all) {
            self.quotients.value[place] = at_end(self.wall.ends[end] - at);
        }
        self.influences[..count].fill(0.0);
        let (x, quotients) = (&self.middles.place[inner.clone()], &self.quotients.value[inner.start..]);
        fill_influences(x, quotients, &mut self.influences[inner]);
        reach
    }

    /// Ends of the surface in reach (0: first, 1: last), and their positions among the quotients.
    fn ends(&self, all: &std::ops::Range<usize>) -> impl Iterator<Item = (usize, usize)> + use<> {
        let first = (all.start == 0).then_some((0, 0));
        let last = (all.end == self.slopes.len()).then_some((1, all.len()));
        first.into_iter().chain(last)
    }

    /// Derivative of the speed with respect to a common shift of the ends of the surface, with the middles held.
    fn by_ends(&self, at: f64, all: &std::ops::Range<usize>) -> f64 {
        let change = |(end, place): (usize, usize)| {
            let quotient = at_end(Tangent::<1>::from_re(self.wall.ends[end] - at).derivative(0));
            let (interval, sign) = if end == 0 { (0, 1.0) } else { (place - 1, -1.0) };
            sign * quotient.eps[0] * window(self.middles.place[interval]) * self.slopes[all.start + interval]
        };
        self.ends(all).map(change).sum()
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
            let (value, ..) = speeds.value(t[p], p);
            let local = speeds.at(t[p], p);
            assert_eq!(value, local.speed);
            let acting = local.range.clone().zip(local.influences.iter().copied()).filter(|(_, v)| *v != 0.0);
            influences.retain(|(_, influence)| *influence != 0.0);
            let close = |(a, b): (&(usize, f64), (usize, f64))| a.0 == b.0 && (a.1 - b.1).abs() < 1e-15;
            assert_eq!(influences.len(), acting.clone().count());
            assert!(influences.iter().zip(acting).all(close));
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
