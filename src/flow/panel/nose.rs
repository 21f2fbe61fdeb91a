//! The nose of a section: where the surface is farthest from the trailing edge, as a smooth function of the nodes.
//!
//! The farthest point itself hops from one place to another where two tie, as on a blunt or a dented nose, and the chord
//! line and all trips with it. The nose is therefore a mean over the surface with the weight d^(1/[`RANGE`]) per arc
//! length for the distance d from the middle of the trailing edge: all but the surroundings of the farthest point have
//! no weight. Its direction is that of the mean point. Its distance D follows from the mean logarithm,
//!
//! ```text
//! ln D = mean(ln d) + RANGE / 2
//! ```
//!
//! where the second term makes up for what a round nose falls back within the mean. On a nose of radius r in chords, D
//! falls short of the farthest point by RANGE² / (8 r) chords where it is a circle and by RANGE² / (2 r) where it is a
//! parabola, 3e-7 for a NACA 0012; on a pointed nose by RANGE / 2.

use crate::differentiate::Tangent;
use crate::flow::duals::gradient;
use crate::flow::surface::spline::{IndexSpline, combine};
use crate::plane::{distance, dot, minus};
use crate::scalar::Scalar;
use crate::spline::GaussRule;

/// Fall of the distance from the trailing edge, in chords, over which the weight falls to 1/e.
const RANGE: f64 = 1e-4;
/// Fall of the distance, in [`RANGE`]s, beyond which the weight is below round-off.
const CUT: f64 = 42.0;
/// Points of the quadrature between two nodes.
const POINTS: usize = 6;

/// The four spline coefficients of x and y on which a point of the surface depends.
type Local<S> = [[S; 2]; 4];

/// Weighted sums over the surface: of 1, x, y and ln d.
type Sums<S> = [S; 4];

/// A point of the quadrature.
struct Point {
    /// First of the four spline coefficients on which the point depends.
    first: usize,
    /// Weights of the coefficients for the place and for its derivative with respect to the node index.
    by_place: [f64; 4],
    by_slope: [f64; 4],
    /// Share in the integral over the node index.
    share: f64,
}

impl Point {
    /// The share of this point in the sums. Weights are taken relative to `highest`, a number near the largest ln d that
    /// cancels in the mean.
    fn sums<S: Scalar>(&self, local: &Local<S>, tail: [S; 2], highest: f64) -> Sums<S> {
        let at = |weights: &[f64; 4]| [0, 1].map(|c| combine(&(0, weights.map(S::from)), &local.map(|p| p[c])));
        let (place, heading) = (at(&self.by_place), at(&self.by_slope));
        let from_tail = minus(place, tail);
        let logarithm = dot(from_tail, from_tail).ln() * 0.5;
        let weight = ((logarithm - highest) * RANGE.recip()).exp() * dot(heading, heading).sqrt() * self.share;
        [weight, weight * place[0], weight * place[1], weight * logarithm]
    }
}

/// The nose from the sums and the middle of the trailing edge.
fn from_sums<S: Scalar>([sum, x, y, logarithm]: Sums<S>, tail: [S; 2]) -> [S; 2] {
    let toward = minus([x / sum, y / sum], tail);
    let stretch = (logarithm / sum + 0.5 * RANGE).exp() / dot(toward, toward).sqrt();
    [0, 1].map(|c| tail[c] + toward[c] * stretch)
}

/// The nose of a section, with what its derivatives need.
#[derive(Debug, Clone)]
pub(super) struct Nose {
    pub place: [f64; 2],
    spline: IndexSpline,
    /// Spline coefficients of x and y.
    coefficients: Vec<[f64; 2]>,
    tail: [f64; 2],
    /// Nodes between which the nose lies.
    range: std::ops::Range<usize>,
    highest: f64,
    sums: Sums<f64>,
}

impl Nose {
    /// The nose of the surface through `nodes`, seen from the middle of the trailing edge. Without a nose, as where all
    /// nodes are one point, its place is not finite.
    pub fn new(nodes: &[[f64; 2]], tail: [f64; 2]) -> Self {
        let spline = IndexSpline::new(nodes.len());
        let [x, y] = [0, 1].map(|c| spline.coefficients(&nodes.iter().map(|p| p[c]).collect::<Vec<_>>()));
        let logarithm = |p: &[f64; 2]| distance(*p, tail).ln();
        let highest = nodes.iter().map(logarithm).fold(f64::NEG_INFINITY, f64::max);
        let counts = |p: &[f64; 2]| logarithm(p) > highest - CUT * RANGE;
        let last = nodes.len() - 1;
        // one node more on either side, as the surface may be farther away than its nodes
        let first = nodes.iter().position(counts).unwrap_or(0).saturating_sub(1);
        let end = nodes.iter().rposition(counts).map_or(last, |k| (k + 1).min(last));
        let coefficients = x.into_iter().zip(y).map(|(x, y)| [x, y]).collect();
        let mut nose =
            Self { place: [f64::NAN; 2], spline, coefficients, tail, range: first..end, highest, sums: [0.0; 4] };
        nose.sums = nose.points().fold([0.0; 4], |sums, point| {
            let more = point.sums(&nose.local(&point), tail, highest);
            std::array::from_fn(|k| sums[k] + more[k])
        });
        nose.place = from_sums(nose.sums, tail);
        nose
    }

    /// The points of the quadrature.
    fn points(&self) -> impl Iterator<Item = Point> {
        let rule = GaussRule::new(POINTS);
        self.range.clone().flat_map(move |cell| {
            let points: Vec<(f64, f64)> = rule.on(cell as f64, (cell + 1) as f64).collect();
            points.into_iter().map(|(t, share)| {
                let (first, by_place) = self.spline.weights(t);
                Point { first, by_place, by_slope: self.spline.slope_weights(t).1, share }
            })
        })
    }

    /// The coefficients on which a point depends.
    fn local(&self, point: &Point) -> Local<f64> {
        std::array::from_fn(|q| self.coefficients[point.first + q])
    }

    /// Derivatives with respect to the nodes and to the middle of the trailing edge, from those with respect to the nose.
    pub fn pull_back(&self, by_nose: [f64; 2]) -> (Vec<[f64; 2]>, [f64; 2]) {
        let unit = |value: f64, k: usize| Tangent::<6>::from_re(value).derivative(k);
        let sums = std::array::from_fn(|k| unit(self.sums[k], k));
        let place = from_sums(sums, [unit(self.tail[0], 4), unit(self.tail[1], 5)]);
        let by_sums = gradient(&(place[0] * by_nose[0] + place[1] * by_nose[1]));
        let mut by_tail = [by_sums[4], by_sums[5]];
        let mut by_coefficients = vec![[0.0; 2]; self.coefficients.len()];
        for point in self.points() {
            let local = self.local(&point);
            let unit = |value: f64, k: usize| Tangent::<10>::from_re(value).derivative(k);
            let seeds = std::array::from_fn(|q| [unit(local[q][0], 2 * q), unit(local[q][1], 2 * q + 1)]);
            let sums = point.sums(&seeds, [unit(self.tail[0], 8), unit(self.tail[1], 9)], self.highest);
            let by =
                gradient(&(sums[0] * by_sums[0] + sums[1] * by_sums[1] + sums[2] * by_sums[2] + sums[3] * by_sums[3]));
            for c in 0..2 {
                (0..4).for_each(|q| by_coefficients[point.first + q][c] += by[2 * q + c]);
                by_tail[c] += by[8 + c];
            }
        }
        let by_nodes =
            |c: usize| self.spline.coefficients_transposed(&by_coefficients.iter().map(|by| by[c]).collect::<Vec<_>>());
        (by_nodes(0).into_iter().zip(by_nodes(1)).map(|(x, y)| [x, y]).collect(), by_tail)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::testcases::naca_symmetric;

    fn nose_of(nodes: &[[f64; 2]]) -> [f64; 2] {
        let last = nodes[nodes.len() - 1];
        Nose::new(nodes, [0, 1].map(|c| 0.5 * (nodes[0][c] + last[c]))).place
    }

    /// A section whose nose ends in two humps, the upper one farther from the trailing edge by `lead`.
    fn two_humps(lead: f64) -> Vec<[f64; 2]> {
        let hump = |y: f64, at: f64| (-((y - at) / 0.012).powi(2)).exp();
        let blunt = |[x, y]: [f64; 2]| {
            let front = (-(x / 0.05).powi(2)).exp();
            // the arc about the trailing edge, less what the humps leave of a dent
            let arc = 1.0 - (1.0 - y * y).sqrt();
            let dent = 0.01 * (1.0 - hump(y, 0.02) - hump(y, -0.02)) - lead * hump(y, 0.02);
            [x + front * (arc - x + dent), y]
        };
        naca_symmetric(0.2, 0.0025, 201).into_iter().map(blunt).collect()
    }

    #[test]
    fn the_nose_is_the_farthest_point() {
        for thickness in [0.06, 0.12, 0.24] {
            let [x, y] = nose_of(&naca_symmetric(thickness, 0.0025, 161));
            // that of a NACA section is nearly a parabola of this radius
            let short = RANGE * RANGE / (2.0 * 1.1019 * thickness * thickness);
            assert!(x.abs() < 1.1 * short && y.abs() < 1e-13, "{thickness}: {x:e} for {short:e}, {y:e}");
        }
        // on a cambered section it is not a node
        let nodes: Vec<_> =
            naca_symmetric(0.12, 0.0025, 401).into_iter().map(|[x, y]| [x, y + 0.2 * x * (1.0 - x)]).collect();
        let [x, y] = nose_of(&nodes);
        let tail = nodes[0][0];
        let farthest = nodes.iter().map(|p| distance(*p, [tail, 0.0])).fold(0.0, f64::max);
        assert!((distance([x, y], [tail, 0.0]) - farthest).abs() < 5e-6);
        let nearest = nodes.iter().map(|p| distance(*p, [x, y])).fold(1.0, f64::min);
        assert!(nearest < 2e-3 && x.abs() < 2e-3, "{nearest} {x} {y}");
    }

    #[test]
    fn the_nose_moves_smoothly_from_hump_to_hump() {
        let side = |lead: f64| nose_of(&two_humps(lead))[1];
        assert!(side(0.003) > 0.015 && side(-0.003) < -0.015 && side(0.0).abs() < 1e-9);
        // it never leaps: half the step, half the largest change
        let largest = |steps: i32| {
            let at = |k: i32| side(0.003 * f64::from(k) / f64::from(steps));
            (-steps..steps).map(|k| (at(k + 1) - at(k)).abs()).fold(0.0, f64::max)
        };
        let ratio = largest(200) / largest(100);
        assert!((ratio - 0.5).abs() < 0.02, "{ratio}");
    }

    #[test]
    fn derivatives_are_exact_where_two_humps_tie() {
        let nodes = two_humps(5e-5);
        let tail = nose_of(&nodes);
        let end = [0, 1].map(|c| 0.5 * (nodes[0][c] + nodes[200][c]));
        let (by_nodes, _) = Nose::new(&nodes, end).pull_back([0.7, -1.3]);
        let output = |nodes: &[[f64; 2]]| {
            let [x, y] = Nose::new(nodes, end).place;
            0.7 * (x - tail[0]) - 1.3 * (y - tail[1])
        };
        for (i, c) in [(88, 0), (92, 0), (95, 1), (100, 0), (104, 1), (108, 0), (112, 0)] {
            let at = |step: f64| {
                let mut moved = nodes.clone();
                moved[i][c] += step;
                output(&moved)
            };
            let h = 5e-7;
            let difference = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
            let exact = by_nodes[i][c];
            assert!((difference - exact).abs() < 1e-7 * (1.0 + exact.abs()), "{i} {c}: {difference} {exact}");
        }
    }
}
