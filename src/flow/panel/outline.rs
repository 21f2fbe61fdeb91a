//! The outline of a panelled section: nodes, arc length, trailing edge.

use crate::flow::FlowError;
use crate::plane::{cross, distance, minus};
use crate::scalar::Scalar;
pub use crate::section::TrailingEdge;

/// Smallest number of nodes of a section.
pub const MIN_NODES: usize = 40;

/// Nodes of a section in chords, from the trailing edge over the upper surface and the nose back along the lower
/// surface.
#[derive(Debug, Clone)]
pub(crate) struct Outline {
    pub nodes: Vec<[f64; 2]>,
    pub trailing_edge: TrailingEdge,
}

impl Outline {
    /// Checks the nodes: enough of them, finite, counter-clockwise, no two equal neighbours, trailing edge as
    /// announced.
    pub fn new(nodes: &[[f64; 2]], trailing_edge: TrailingEdge) -> Result<Self, FlowError> {
        let count = nodes.len();
        if count < MIN_NODES {
            return Err(FlowError::TooFewNodes { found: count, needed: MIN_NODES });
        }
        if let Some(index) = nodes.iter().position(|p| !(p[0].is_finite() && p[1].is_finite())) {
            return Err(FlowError::NodeNotFinite { index });
        }
        if let Some(index) = nodes.windows(2).position(|p| distance(p[0], p[1]) < 1e-9) {
            return Err(FlowError::CoincidentNodes { first: index, second: index + 1 });
        }
        let [first, last] = [nodes[0], nodes[count - 1]];
        let gap = distance(first, last);
        match trailing_edge {
            TrailingEdge::Sharp if gap > 1e-10 => return Err(FlowError::TrailingEdgeOpen { gap }),
            TrailingEdge::Blunt if gap < 1e-9 => return Err(FlowError::TrailingEdgeClosed { gap }),
            _ => {}
        }
        let area = signed_area(nodes);
        if area <= 0.0 {
            return Err(FlowError::NotCounterClockwise { area });
        }
        Ok(Self { nodes: nodes.to_vec(), trailing_edge })
    }

    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Start and end of panel `j`; panel `len − 1` closes a blunt trailing edge from the lower to the upper side.
    pub fn panel(&self, j: usize) -> [[f64; 2]; 2] {
        let next = if j + 1 == self.len() { 0 } else { j + 1 };
        [self.nodes[j], self.nodes[next]]
    }

    /// The trailing edge.
    pub fn edge_frame(&self) -> TrailingEdgeFrame<f64> {
        let (nodes, n) = (&self.nodes, self.len());
        TrailingEdgeFrame::new([nodes[0], nodes[1]], [nodes[n - 2], nodes[n - 1]])
    }

    /// Index of the node with the least x, the first of several.
    pub fn foremost(&self) -> usize {
        (1..self.len()).fold(0, |best, i| if self.nodes[i][0] < self.nodes[best][0] { i } else { best })
    }

    /// Place of node `i` on panel `j`. The ends of a sharp trailing edge are one point.
    pub fn place(&self, i: usize, j: usize) -> super::kernel::Place {
        use super::kernel::Place;
        let last = self.len() - 1;
        let same = |a: usize, b: usize| {
            a == b || (self.trailing_edge == TrailingEdge::Sharp && a.min(b) == 0 && a.max(b) == last)
        };
        let end = if j == last { 0 } else { j + 1 };
        if same(i, j) {
            Place::Start
        } else if same(i, end) {
            Place::End
        } else {
            Place::Elsewhere
        }
    }
}

/// Area enclosed by the polygon, positive counter-clockwise. The sum is taken about the first point to save digits.
fn signed_area(nodes: &[[f64; 2]]) -> f64 {
    let o = nodes[0];
    0.5 * nodes.windows(2).map(|p| cross(minus(p[0], o), minus(p[1], o))).sum::<f64>()
}

/// Arc length of the polygon from the first node to each node; one value per node.
pub(crate) fn arc_lengths<S: Scalar>(nodes: &[[S; 2]]) -> Vec<S> {
    let mut sum = S::from(0.0);
    let mut result = vec![sum];
    for p in nodes.windows(2) {
        let (dx, dy) = (p[1][0] - p[0][0], p[1][1] - p[0][1]);
        sum += (dx * dx + dy * dy).sqrt();
        result.push(sum);
    }
    result
}

/// The trailing edge as the wake and the closing panel see it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TrailingEdgeFrame<S> {
    /// Midpoint of the gap.
    pub middle: [S; 2],
    /// Unit vector along the bisector, downstream.
    pub bisector: [S; 2],
    /// Gap across the bisector, in chords.
    pub thickness: S,
    /// Slope of the gap across the bisector, d(thickness)/ds.
    pub opening: S,
    /// Strength of the source sheet on the closing panel times the length of that panel, per unit edge speed at the
    /// trailing edge.
    pub source: S,
    /// Strength of the clockwise vortex sheet on the closing panel times the length of that panel, per unit edge speed
    /// at the trailing edge.
    pub vortex: S,
}

impl<S: Scalar> TrailingEdgeFrame<S> {
    /// This frame with all numbers converted by `f`.
    pub fn map<T: Scalar>(&self, f: impl Fn(S) -> T + Copy) -> TrailingEdgeFrame<T> {
        TrailingEdgeFrame {
            middle: self.middle.map(f),
            bisector: self.bisector.map(f),
            thickness: f(self.thickness),
            opening: f(self.opening),
            source: f(self.source),
            vortex: f(self.vortex),
        }
    }

    /// The frame from the first two nodes and the last two, in the order of the section.
    pub fn new(first: [[S; 2]; 2], last: [[S; 2]; 2]) -> Self {
        let unit = |a: [S; 2], b: [S; 2]| {
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            let d = (dx * dx + dy * dy).sqrt();
            [dx / d, dy / d]
        };
        let (upper, lower) = (unit(first[1], first[0]), unit(last[0], last[1]));
        let bisector = unit([S::from(0.0); 2], [upper[0] + lower[0], upper[1] + lower[1]]);
        let (from, to) = (last[1], first[0]);
        let gap = [to[0] - from[0], to[1] - from[1]];
        let thickness = bisector[0] * gap[1] - bisector[1] * gap[0];
        let along = bisector[0] * gap[0] + bisector[1] * gap[1];
        // strengths times the length of the panel; the caller divides by it
        let opening = bisector[0] * (upper[1] - lower[1]) - bisector[1] * (upper[0] - lower[0]);
        Self {
            middle: [(from[0] + to[0]) * 0.5, (from[1] + to[1]) * 0.5],
            bisector,
            thickness,
            opening,
            source: thickness,
            vortex: -along,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle(n: usize) -> Vec<[f64; 2]> {
        (0..n)
            .map(|i| std::f64::consts::TAU * i as f64 / (n - 1) as f64)
            .map(|t| [0.5 + 0.5 * t.cos(), if t > 6.2 { 0.0 } else { 0.5 * t.sin() }])
            .map(|p| if p[0] == 1.0 { [1.0, 0.0] } else { p })
            .collect()
    }

    #[test]
    fn bad_outlines_are_named() {
        let good = circle(50);
        assert!(Outline::new(&good, TrailingEdge::Sharp).is_ok());
        assert!(matches!(
            Outline::new(&good[..10], TrailingEdge::Sharp),
            Err(FlowError::TooFewNodes { found: 10, .. })
        ));
        assert!(matches!(Outline::new(&good, TrailingEdge::Blunt), Err(FlowError::TrailingEdgeClosed { .. })));
        assert!(matches!(Outline::new(&good[..49], TrailingEdge::Sharp), Err(FlowError::TrailingEdgeOpen { .. })));
        let backwards: Vec<_> = good.iter().rev().copied().collect();
        assert!(matches!(
            Outline::new(&backwards, TrailingEdge::Sharp),
            Err(FlowError::NotCounterClockwise { area }) if area < 0.0
        ));
        let mut twice = good.clone();
        twice[7] = twice[6];
        assert_eq!(
            Outline::new(&twice, TrailingEdge::Sharp).unwrap_err(),
            FlowError::CoincidentNodes { first: 6, second: 7 }
        );
        twice[7] = [f64::NAN, 0.0];
        assert_eq!(Outline::new(&twice, TrailingEdge::Sharp).unwrap_err(), FlowError::NodeNotFinite { index: 7 });
    }
}
