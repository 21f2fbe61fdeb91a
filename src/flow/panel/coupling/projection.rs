//! Projection of the mass defect from the stations to the nodes: the mean of the piecewise linear defect over the hat
//! function of each node.
//!
//! With interpolation the solution would notice when a kink of the defect (transition) passes a node; the overlap
//! integrals are twice continuously differentiable in the station positions.

use crate::scalar::Scalar;
use num_dual::Dual;

/// The ramp ∫ hat(τ) (τ + x)₊ dτ over the unit hat, which has risen for x at the centre of a node.
fn ramp<S: Scalar>(x: S) -> S {
    if x.re() <= -1.0 {
        S::from(0.0)
    } else if x.re() <= 0.0 {
        let y = x + 1.0;
        y * y * y / 6.0
    } else if x.re() < 1.0 {
        let y = -x + 1.0;
        x + y * y * y / 6.0
    } else {
        x
    }
}

/// The integral ∫ hat(τ) [τ + x > 0] dτ, the derivative of [`ramp`].
fn step<S: Scalar>(x: S) -> S {
    ramp(Dual::new(x, S::from(1.0))).eps
}

/// Calls `visit(node, weight)` for every node whose hat overlaps that of point `p`. `t` are the node indices of all
/// points, ascending from the first node (t = 0) to the last (t = n − 1). The two end nodes take the values at the end
/// points.
pub(crate) fn overlaps<S: Scalar>(t: &[S], p: usize, nodes: usize, mut visit: impl FnMut(usize, S)) {
    let last = t.len() - 1;
    let left = t[p.saturating_sub(1)].re() - 1.0;
    let right = t[(p + 1).min(last)].re() + 1.0;
    let from = (left.max(0.0) as usize).max(1);
    let to = (right.ceil().max(0.0) as usize).min(nodes - 2);
    if p == 0 {
        visit(0, S::from(1.0));
    }
    for i in from..=to {
        let at = |s: S| -s + i as f64;
        let rise = |a: S, b: S| (ramp(at(a)) - ramp(at(b))) / (b - a);
        let weight = match p {
            0 => step(at(t[0])) - rise(t[0], t[1]),
            _ if p == last => rise(t[p - 1], t[p]) - step(at(t[p])),
            _ => rise(t[p - 1], t[p]) - rise(t[p], t[p + 1]),
        };
        if weight.re() != 0.0 {
            visit(i, weight);
        }
    }
    if p == last {
        visit(nodes - 1, S::from(1.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The defect at the nodes.
    fn project<S: Scalar>(t: &[S], mass: &[S], nodes: usize) -> Vec<S> {
        let mut result = vec![S::from(0.0); nodes];
        for (p, m) in mass.iter().enumerate() {
            overlaps(t, p, nodes, |i, weight| result[i] += weight * *m);
        }
        result
    }

    #[test]
    fn straight_lines_stay_straight() {
        let t = [0.0f64, 0.3, 0.35, 1.9, 2.0, 5.5, 7.2, 9.0];
        let mass = t.map(|t| 2.0 - 0.3 * t);
        for (i, m) in project(&t, &mass, 10).iter().enumerate() {
            assert!((m - (2.0 - 0.3 * i as f64)).abs() < 1e-13, "{i} {m}");
        }
    }

    #[test]
    fn the_weights_are_smooth_in_the_positions() {
        // the second difference of a weight across an event (station passes a node) stays small
        let weight = |s: f64| {
            let t = [0.0, 2.6, s, 3.9, 9.0];
            project(&t, &[0.0, 0.0, 1.0, 0.0, 0.0], 10)[3]
        };
        let h = 1e-3;
        let curvature = |s: f64| (weight(s + h) - 2.0 * weight(s) + weight(s - h)) / (h * h);
        assert!((curvature(3.0 - 2.0 * h) - curvature(3.0 + 2.0 * h)).abs() < 0.05);
    }
}
