//! The map between node index and arc length: the geometry of the surface coordinate.

use super::spline::{IndexSpline, combine, combine_real, invert};
use crate::differentiate::{Tangent, lift_root};
use crate::scalar::Scalar;

/// Step of Newton's method for a node index after which the iteration ends.
const CLOSE: f64 = 1e-9;

/// The map between node index and arc length: the geometry of the surface coordinate.
#[derive(Debug, Clone)]
pub(crate) struct SurfaceMap {
    pub spline: IndexSpline,
    /// Coefficients of the arc length over the node index.
    pub arc: Vec<f64>,
    /// Arc lengths of the nodes, in chords.
    nodes: Vec<f64>,
    /// Total arc length, in chords.
    pub total: f64,
}

impl SurfaceMap {
    /// The map for nodes at given arc lengths; `None` where they are so uneven that the spline does not rise
    /// everywhere.
    pub fn new(arc_lengths: &[f64]) -> Option<Self> {
        let n = arc_lengths.len();
        let spline = IndexSpline::new(n);
        let arc = spline.coefficients(arc_lengths);
        // in the two end intervals the spline may start flat (cosine spacing); no station but the last stands there
        let rises = (8..=8 * (n - 2)).all(|i| combine(&spline.slope_weights(i as f64 / 8.0), &arc) > 0.0);
        rises.then(|| Self { spline, arc, nodes: arc_lengths.to_vec(), total: arc_lengths[n - 1] })
    }

    /// Node index at arc length `s`, with the derivatives `s` carries.
    pub fn index<S: Scalar>(&self, s: S) -> S {
        let t =
            self.cell_index(s.re()).unwrap_or_else(|| invert(&self.spline, &self.arc, s.re(), 0.0, self.last(), 1.0));
        let rate: f64 = self.rate(t);
        // first derivatives are all that is asked for, so that the equation may be taken as linear
        debug_assert!(S::NDERIV <= 1);
        let lifted = lift_root(t, || rate, |u: S| (u - t) * rate - (s - s.re()));
        // where the arc length stands still (only the end intervals may begin so) the flow is refused as not converged
        lifted.unwrap_or(S::from(f64::NAN))
    }

    /// Node index at arc length `s` by Newton's method on the polynomial between two nodes. The result is `None` where
    /// the method does not converge, and in the end intervals, where the spline need not rise.
    fn cell_index(&self, s: f64) -> Option<f64> {
        let cell = self.nodes.partition_point(|&node| node < s).checked_sub(1)?;
        if cell == 0 || cell + 2 >= self.nodes.len() {
            return None;
        }
        let [a, b, c, d] = self.spline.polynomial(cell, &self.arc);
        let mut u = (s - self.nodes[cell]) / (self.nodes[cell + 1] - self.nodes[cell]);
        for _ in 0..8 {
            let v = Tangent::<1>::from_re(u).derivative(0);
            let value = ((v * d + c) * v + b) * v + a;
            let step = (value.re - s) / value.eps[0];
            u -= step;
            // convergence is quadratic: what such a step leaves is below round-off
            if step.abs() <= CLOSE {
                return Some(cell as f64 + u).filter(|_| (u - 0.5).abs() < 0.5 + 1e-9);
            }
        }
        None
    }

    /// Arc length from the first node at the node index `t`, in chords.
    pub fn arc_length<S: Scalar>(&self, t: S) -> S {
        combine_real(&self.spline.weights(t), &self.arc)
    }

    /// Node index of the last node.
    pub fn last(&self) -> f64 {
        (self.nodes.len() - 1) as f64
    }

    /// Arc length per node index at `t`.
    pub fn rate<S: Scalar>(&self, t: S) -> S {
        combine_real(&self.spline.slope_weights(t), &self.arc)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn index_inverts_the_arc_length() {
        let s: Vec<f64> = (0..50).map(|i| (i as f64 * 0.05).sinh()).collect();
        let map = SurfaceMap::new(&s).unwrap();
        assert!((map.index(s[17]) - 17.0).abs() < 1e-11);
        let mut uneven = s.clone();
        uneven[20] = uneven[21] - 1e-6;
        assert!(SurfaceMap::new(&uneven).is_none());
    }
}
