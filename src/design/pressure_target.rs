//! Wanted pressures along the chord, and how far the pressures of a flow are from them.

use super::DesignError;
use crate::plane::{distance, dot, middle, minus};
use crate::scalar::Scalar;
use num_dual::DualSVec64;

/// The wanted pressure coefficient of one side as a function of x in chords: a cubic through the given points in √x,
/// which is smooth around the nose, with slopes that keep what rises rising (Fritsch & Butland, SIAM J. Sci. Stat.
/// Comput. 5, 1984).
#[derive(Debug, Clone, PartialEq)]
pub struct PressureSide {
    /// Roots of the places, ascending.
    roots: Vec<f64>,
    values: Vec<f64>,
    slopes: Vec<f64>,
}

impl PressureSide {
    /// From places x in chords, which grow from 0 or more, and the pressure coefficients there.
    ///
    /// # Errors
    /// [`DesignError::PressureTable`]: fewer than two points, numbers that are not finite, or places that do not grow.
    pub fn new(points: &[[f64; 2]]) -> Result<Self, DesignError> {
        let refuse = |reason: String| Err(DesignError::PressureTable { reason });
        if points.len() < 2 {
            return refuse(format!("a side needs two points or more; there are {}", points.len()));
        }
        if let Some([x, cp]) = points.iter().find(|p| !(p[0].is_finite() && p[1].is_finite() && p[0] >= 0.0)) {
            return refuse(format!("the point x = {x}, Cp = {cp} is not on the chord"));
        }
        if let Some(pair) = points.windows(2).find(|pair| pair[1][0] <= pair[0][0]) {
            return refuse(format!("x does not grow from {} to {}", pair[0][0], pair[1][0]));
        }
        let roots: Vec<f64> = points.iter().map(|p| p[0].sqrt()).collect();
        let values: Vec<f64> = points.iter().map(|p| p[1]).collect();
        let slopes = monotone_slopes(&roots, &values);
        Ok(Self { roots, values, slopes })
    }

    /// First and last place, in chords.
    pub fn range(&self) -> [f64; 2] {
        [self.roots[0], self.roots[self.roots.len() - 1]].map(|root| root * root)
    }

    /// The wanted pressure coefficient at `x` in chords; beyond the first and the last place that of the place.
    pub fn at<S: Scalar>(&self, x: S) -> S {
        let [first, last] = self.range();
        let end = self.values.len() - 1;
        if x.re() <= first {
            return S::from(self.values[0]);
        }
        if x.re() >= last {
            return S::from(self.values[end]);
        }
        let root = x.sqrt();
        let k = self.roots.partition_point(|r| *r <= root.re()).clamp(1, end) - 1;
        let width = self.roots[k + 1] - self.roots[k];
        let t = (root - self.roots[k]) / width;
        let rise = self.values[k + 1] - self.values[k];
        let [a, b] = [self.slopes[k] * width, self.slopes[k + 1] * width];
        // the cubic of Hermite in powers of t
        ((t * (a + b - 2.0 * rise) + (3.0 * rise - 2.0 * a - b)) * t + a) * t + self.values[k]
    }
}

/// Slopes at the points of a table that leave no overshoot between them.
fn monotone_slopes(x: &[f64], y: &[f64]) -> Vec<f64> {
    let n = x.len();
    let h: Vec<f64> = x.windows(2).map(|p| p[1] - p[0]).collect();
    let s: Vec<f64> = y.windows(2).zip(&h).map(|(p, h)| (p[1] - p[0]) / h).collect();
    let inner = |k: usize| {
        if s[k - 1] * s[k] <= 0.0 {
            return 0.0;
        }
        let share = (h[k - 1] + 2.0 * h[k]) / (3.0 * (h[k - 1] + h[k]));
        s[k - 1] * s[k] / (share * s[k] + (1.0 - share) * s[k - 1])
    };
    (0..n)
        .map(|k| {
            if k == 0 {
                s[0]
            } else if k == n - 1 {
                s[n - 2]
            } else {
                inner(k)
            }
        })
        .collect()
}

/// Wanted pressures at one operating point; a side without any is left free.
#[derive(Debug, Clone, PartialEq)]
pub struct PressureTarget {
    /// The upper and the lower side.
    pub sides: [Option<PressureSide>; 2],
    /// Operating point whose pressures are compared, by position.
    pub point: usize,
}

/// The mean square difference between the pressures of a flow and those wanted: `Σ w (cp − wanted(x))²` over the panel
/// nodes, weighted by the undeformed surface they stand for.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PressureError {
    target: PressureTarget,
    /// Side and weight of every node; the weights add up to one.
    nodes: Vec<(usize, f64)>,
    /// Chord line of the undeformed section.
    line: PlacesOnChord,
}

/// The line from the node that is farthest from the trailing edge to the trailing edge, along which pressures have their
/// places.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlacesOnChord {
    nose: [f64; 2],
    /// The line over the square of its length.
    along: [f64; 2],
}

impl PlacesOnChord {
    /// The position of the farthest node, and the line, for nodes from the trailing edge over the nose and back.
    pub fn new(nodes: &[[f64; 2]]) -> (usize, Self) {
        let last = nodes.len() - 1;
        let tail = middle(nodes[0], nodes[last]);
        let farthest = |&a: &usize, &b: &usize| distance(nodes[a], tail).total_cmp(&distance(nodes[b], tail));
        let nose = (0..=last).max_by(farthest).unwrap_or(0);
        let along = minus(tail, nodes[nose]);
        (nose, Self { nose: nodes[nose], along: along.map(|c| c / dot(along, along)) })
    }

    /// Coordinate x of a point along the line, in chords.
    pub fn place<S: Scalar>(&self, point: [S; 2]) -> S {
        (0..2).map(|d| (point[d] - self.nose[d]) * self.along[d]).sum()
    }
}

/// Derivatives of a residual with respect to the pressure and the two coordinates of its node.
type ByNode = DualSVec64<3>;

impl PressureError {
    /// Prepares the comparison on the panel nodes of the undeformed section.
    ///
    /// # Errors
    /// [`DesignError::PressureTable`] where the wanted pressures reach no node.
    pub fn new(target: PressureTarget, nodes: &[[f64; 2]]) -> Result<Self, DesignError> {
        let last = nodes.len() - 1;
        let (nose, line) = PlacesOnChord::new(nodes);
        let mut error = Self { target, nodes: Vec::new(), line };
        let weight = |k: usize| {
            let before = if k > 0 { distance(nodes[k - 1], nodes[k]) } else { 0.0 };
            let after = if k < last { distance(nodes[k], nodes[k + 1]) } else { 0.0 };
            let side = usize::from(k > nose);
            let x = error.line.place(nodes[k]);
            // the places of nodes and of a table from the same nodes differ by round-off
            let within = |[first, last]: [f64; 2]| first - 1e-9 <= x && x <= last + 1e-9;
            let wanted = error.target.sides[side].as_ref().is_some_and(|s| within(s.range()));
            (side, if wanted { 0.5 * (before + after) } else { 0.0 })
        };
        let weighted: Vec<(usize, f64)> = (0..=last).map(weight).collect();
        let total: f64 = weighted.iter().map(|(_, weight)| weight).sum();
        if !(total > 0.0) {
            let reason = "the wanted pressures reach no panel node".into();
            return Err(DesignError::PressureTable { reason });
        }
        error.nodes = weighted.into_iter().map(|(side, weight)| (side, weight / total)).collect();
        Ok(error)
    }

    /// The operating point whose pressures are compared.
    pub fn point(&self) -> usize {
        self.target.point
    }

    /// The residuals, whose squares add up to the error, with their derivatives; a node without weight has none.
    fn residuals(&self, nodes: &[[f64; 2]], cp: &[f64]) -> Vec<Option<ByNode>> {
        let one = |(k, &(side, weight)): (usize, &(usize, f64))| {
            let wanted = self.target.sides[side].as_ref().filter(|_| weight > 0.0)?;
            let unit = |value: f64, place: usize| ByNode::from_re(value).derivative(place);
            let x = self.line.place([unit(nodes[k][0], 1), unit(nodes[k][1], 2)]);
            Some((unit(cp[k], 0) - wanted.at(x)) * weight.sqrt())
        };
        self.nodes.iter().enumerate().map(one).collect()
    }

    /// The error, with its derivatives with respect to the pressure at every node, and to the coordinates of every node
    /// at unchanged pressures.
    pub fn value_and_slopes(&self, nodes: &[[f64; 2]], cp: &[f64]) -> (f64, Vec<f64>, Vec<[f64; 2]>) {
        let (mut sum, mut by_cp, mut by_node) = (0.0, vec![0.0; cp.len()], vec![[0.0; 2]; cp.len()]);
        for (k, residual) in self.residuals(nodes, cp).into_iter().enumerate() {
            let Some(residual) = residual else { continue };
            let square = residual * residual;
            sum += square.re;
            let [cp, x, y] = slopes(&square);
            by_cp[k] = cp;
            by_node[k] = [x, y];
        }
        (sum, by_cp, by_node)
    }

    /// The nodes that are compared, each with the derivatives of its residual with respect to its pressure and its two
    /// coordinates.
    pub fn rows(&self, nodes: &[[f64; 2]], cp: &[f64]) -> Vec<(usize, [f64; 3])> {
        let residuals = self.residuals(nodes, cp).into_iter().enumerate();
        residuals.filter_map(|(k, residual)| Some((k, slopes(&residual?)))).collect()
    }
}

fn slopes(of: &ByNode) -> [f64; 3] {
    of.eps.0.map_or([0.0; 3], |eps| [eps[0], eps[1], eps[2]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use num_dual::{Dual64, first_derivative};

    #[test]
    fn a_side_passes_its_points_without_overshoot() {
        let points = [[0.0, 1.0], [0.01, -1.0], [0.09, -1.2], [0.25, -0.4], [1.0, 0.1]];
        let side = PressureSide::new(&points).unwrap();
        for [x, cp] in points {
            assert_relative_eq!(side.at(x), cp, epsilon = 1e-13);
        }
        for k in 1..1000 {
            let x = k as f64 / 1000.0;
            let (value, slope) = first_derivative(|x: Dual64| side.at(x), x);
            assert!((-1.2..=1.0).contains(&value));
            let h = 1e-6;
            let estimate = (side.at(x + h) - side.at(x - h)) / (2.0 * h);
            assert!((slope - estimate).abs() < 1e-3 * (1.0 + slope.abs()), "{x}: {slope} {estimate}");
        }
        assert_eq!((side.at(-0.1), side.at(2.0)), (1.0, 0.1));
    }

    #[test]
    fn bad_tables_are_refused() {
        for points in
            [&[[0.0, 1.0]][..], &[[0.1, 0.0], [0.1, 1.0]], &[[0.0, f64::NAN], [1.0, 0.0]], &[[-0.1, 0.0], [1.0, 0.0]]]
        {
            assert!(matches!(PressureSide::new(points), Err(DesignError::PressureTable { .. })));
        }
    }
}
