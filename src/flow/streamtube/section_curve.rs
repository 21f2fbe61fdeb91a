//! The section as a curve over the index of its nodes, in any kind of number.

use crate::flow::layer::Side;
use crate::flow::surface::spline::{IndexSpline, Weights, combine, invert, weigh};
use crate::plane::distance;
use crate::scalar::Scalar;
use num_dual::Dual;

/// Nodes on both sides of the nose from which the nose radius is taken.
const REACH: f64 = 2.0;

/// The section as a cubic spline over the index of its nodes, from the trailing edge over the upper surface to the nose
/// and back. Coordinates are those of the chord line. What is read off the curve has the value and the first derivatives of the
/// scalar.
#[derive(Debug, Clone)]
pub(super) struct SectionCurve<S> {
    spline: IndexSpline,
    x: Vec<S>,
    y: Vec<S>,
    /// Coefficients of the length of the polygon through the nodes.
    arc: Vec<S>,
    /// Real parts of those.
    real_arc: Vec<f64>,
    /// Arc lengths of the nodes.
    places: Vec<f64>,
    total: S,
    last: f64,
    /// Node index of the nose, where the surface is upright.
    nose: f64,
}

impl<S: Scalar> SectionCurve<S> {
    /// The curve through nodes; `None` where they are so uneven that the length does not rise everywhere.
    pub fn new(nodes: &[[S; 2]]) -> Option<Self> {
        let n = nodes.len();
        let spline = IndexSpline::new(n);
        let mut arcs = vec![S::from(0.0)];
        for w in nodes.windows(2) {
            arcs.push(arcs[arcs.len() - 1] + distance(w[0], w[1]));
        }
        let coordinate = |c: usize| spline.coefficients(&nodes.iter().map(|p| p[c]).collect::<Vec<_>>());
        let (x, y, arc) = (coordinate(0), coordinate(1), spline.coefficients(&arcs));
        let real_arc: Vec<f64> = arc.iter().map(|v| v.re()).collect();
        let rises = (8..=8 * (n - 2)).all(|i| combine(&spline.slope_weights(i as f64 / 8.0), &real_arc) > 0.0);
        let foremost = (1..n).fold(0, |best, i| if nodes[i][0].re() < nodes[best][0].re() { i } else { best });
        let real_x: Vec<f64> = x.iter().map(|v| v.re()).collect();
        let slope = |t: f64| combine(&spline.slope_weights(t), &real_x);
        // x falls to the nose and rises behind it
        let (mut low, mut high) = (foremost.saturating_sub(1) as f64, (foremost + 1).min(n - 1) as f64);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if slope(middle) < 0.0 { low = middle } else { high = middle }
        }
        let total = arcs[n - 1];
        let places = arcs.iter().map(|arc| arc.re()).collect();
        let nose = 0.5 * (low + high);
        rises.then_some(Self { spline, x, y, arc, real_arc, places, total, last: (n - 1) as f64, nose })
    }

    /// Length of the polygon through all nodes, in chords.
    pub fn total(&self) -> S {
        self.total
    }

    /// Node index of the end of a side.
    pub fn edge_index(&self, side: Side) -> f64 {
        match side {
            Side::Upper => 0.0,
            Side::Lower => self.last,
        }
    }

    /// Node index at an arc length from the first node.
    pub fn index(&self, s: S) -> S {
        let above = self.places.partition_point(|place| *place < s.re()).clamp(1, self.places.len() - 1);
        let t = invert(&self.spline, &self.real_arc, s.re(), (above - 1) as f64, above as f64, 1.0);
        let rate = combine(&self.spline.slope_weights(t), &self.real_arc);
        // Newton's step in the number carries the first derivatives
        let miss = weigh(&self.spline.weights(t), &self.arc) - s;
        (miss - miss.re()) / -rate + t
    }

    /// The sum of coefficients with real weights for a node index, of which the derivative has the weights `slopes`.
    fn along(coefficients: &[S], weights: &Weights<f64>, slopes: &Weights<f64>, t: S) -> S {
        let (first, slopes) = slopes;
        let slope = (0..4).map(|q| slopes[q] * coefficients[first + q].re()).sum::<f64>();
        weigh(weights, coefficients) + (t - t.re()) * slope
    }

    /// Values of lists of coefficients at a node index.
    fn values<const N: usize>(&self, coefficients: [&[S]; N], t: S) -> [S; N] {
        let (weights, slopes) = (self.spline.weights(t.re()), self.spline.slope_weights(t.re()));
        coefficients.map(|c| Self::along(c, &weights, &slopes, t))
    }

    /// Arc length from the first node at a node index.
    pub fn arc_length(&self, t: S) -> S {
        let [length] = self.values([&self.arc], t);
        length
    }

    /// The point at a node index.
    pub fn point(&self, t: S) -> [S; 2] {
        self.values([&self.x, &self.y], t)
    }

    /// Derivative of the point with respect to the node index.
    pub fn tangent(&self, t: S) -> [S; 2] {
        let (weights, bends) = (self.spline.slope_weights(t.re()), self.bend_weights(t.re()));
        [&self.x, &self.y].map(|c| Self::along(c, &weights, &bends, t))
    }

    /// Node index of the nose, where the surface is upright.
    pub fn nose(&self) -> S {
        let t = S::from(self.nose);
        let slope = self.tangent(t)[0];
        let bend = weigh(&self.bend_weights(self.nose), &self.x).re();
        (slope - slope.re()) / -bend + self.nose
    }

    /// Weights of the coefficients for the second derivative at a node index.
    fn bend_weights(&self, t: f64) -> Weights<f64> {
        let (cell, weights) = self.spline.slope_weights(Dual::new(t, 1.0));
        (cell, weights.map(|w| w.eps))
    }

    /// The side of the nose on which a node index lies.
    pub fn side_of_nose(&self, index: f64) -> Side {
        if index <= self.nose { Side::Upper } else { Side::Lower }
    }

    /// Focus of the parabola that has the nose as its vertex and the nose radius there.
    ///
    /// Slope and curvature are differences over some nodes on both sides. The second derivative of the spline itself has
    /// kinks at the nodes, and the grid would have them where the nose passes one.
    pub fn focus(&self) -> [S; 2] {
        let t = self.nose();
        let [before, [x, y], behind] = [t - REACH, t, t + REACH].map(|t| self.point(t));
        let rise = (behind[1] - before[1]) * (0.5 / REACH);
        let bend = (before[0] + behind[0] - x * 2.0) * (1.0 / (REACH * REACH));
        let radius = rise * rise / bend;
        [x + radius * 0.5, y]
    }

    /// Node index on a side where x has a value.
    pub fn index_at_x(&self, side: Side, x: f64) -> S {
        let real: Vec<f64> = self.x.iter().map(|v| v.re()).collect();
        let t = match side {
            Side::Upper => invert(&self.spline, &real, x, 0.0, self.nose, -1.0),
            Side::Lower => invert(&self.spline, &real, x, self.nose, self.last, 1.0),
        };
        let rate = combine(&self.spline.slope_weights(t), &real);
        let miss = weigh(&self.spline.weights(t), &self.x);
        (miss - miss.re()) / -rate + t
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::differentiate::Tangent;
    use crate::flow::testcases::naca_symmetric;

    #[test]
    fn the_nose_of_a_symmetric_section_is_found() {
        let nodes = naca_symmetric(0.12, 0.0, 161);
        let curve = SectionCurve::new(&nodes).unwrap();
        assert!((curve.nose() - 80.0).abs() < 1e-9);
        // nose radius 1.1019 t²
        let focus = curve.focus();
        assert!((focus[0] / (0.5 * 1.1019 * 0.0144) - 1.0).abs() < 0.05, "{focus:?}");
        let t = curve.index(0.4);
        assert!((curve.arc_length(t) - 0.4).abs() < 1e-13);
        let t = curve.index_at_x(Side::Lower, 0.3);
        assert!((curve.point(t)[0] - 0.3).abs() < 1e-13 && curve.point(t)[1] < 0.0);
    }

    #[test]
    fn derivatives_follow_the_nodes() {
        type T = Tangent<1>;
        let nodes = naca_symmetric(0.12, 0.002, 121);
        let bent = |h: f64| -> Vec<[f64; 2]> {
            nodes.iter().map(|&[x, y]| [x + 0.2 * h * y, y * (1.0 + h) + h * x * (1.0 - x)]).collect()
        };
        let moving: Vec<[T; 2]> = {
            let h = T::from(0.0).derivative(0);
            nodes.iter().map(|&[x, y]| [h * (0.2 * y) + x, (h + 1.0) * y + h * (x * (1.0 - x))]).collect()
        };
        fn numbers<S: Scalar>(curve: &SectionCurve<S>) -> Vec<S> {
            let t = curve.index(S::from(0.7));
            let u = curve.index_at_x(Side::Upper, 0.1);
            let [focus, point, tangent] = [curve.focus(), curve.point(t), curve.tangent(t)];
            vec![focus[0], focus[1], point[0], point[1], tangent[0], curve.arc_length(u), curve.total()]
        }
        let exact = numbers(&SectionCurve::new(&moving).unwrap());
        let h = 1e-5;
        let [plus, minus] = [h, -h].map(|h| numbers(&SectionCurve::new(&bent(h)).unwrap()));
        for k in 0..exact.len() {
            let difference = (plus[k] - minus[k]) / (2.0 * h);
            assert!((difference - exact[k].eps[0]).abs() < 1e-7, "{k}: {difference} {}", exact[k].eps[0]);
        }
    }
}
