//! The own frame of a section: the chord line through its nodes, in which the solver works.
//!
//! Nodes may come in any unit, at any place and at any angle. The solver sees them in their own frame, with the nose at
//! the origin and the middle of the trailing edge at (1, 0), and the onset flow at the angle that it makes with the
//! chord line. Coefficients, trips and transition are thereby on the section's own chord, and derivatives pass through
//! the frame.

use super::nose::Nose;
use crate::differentiate::Tangent;
use crate::flow::FlowError;
use crate::flow::coefficients::Derivatives;
use crate::flow::duals::gradient;
use crate::plane::{cross, distance, dot, middle, minus};
use crate::scalar::Scalar;

/// Nose and middle of the trailing edge.
#[derive(Debug, Clone, Copy)]
struct ChordLine<S> {
    nose: [S; 2],
    tail: [S; 2],
}

impl<S: Scalar> ChordLine<S> {
    /// A point in the frame, in chords.
    fn inside(&self, point: [S; 2]) -> [S; 2] {
        let (along, from_nose) = (minus(self.tail, self.nose), minus(point, self.nose));
        let square = dot(along, along);
        [dot(along, from_nose) / square, cross(along, from_nose) / square]
    }

    /// Angle of the chord line with the x axis in radians: positive where the trailing edge is higher than the nose.
    fn turn(&self) -> S {
        let [x, y] = minus(self.tail, self.nose);
        y.angle(x)
    }
}

/// The nodes of a section: as they were given, and in the section's own frame.
#[derive(Debug, Clone)]
pub(in crate::flow) struct Nodes {
    /// Nodes as they were given.
    pub given: Vec<[f64; 2]>,
    /// Nodes in the frame of the section, in chords.
    pub inside: Vec<[f64; 2]>,
    /// The frame of the section.
    pub frame: Frame,
}

impl Nodes {
    /// The nodes with their frame.
    ///
    /// # Errors
    /// See [`Frame::new`].
    pub fn new(given: &[[f64; 2]]) -> Result<Self, FlowError> {
        let frame = Frame::new(given)?;
        Ok(Self { given: given.to_vec(), inside: frame.inside(given), frame })
    }
}

/// The frame of a section, with what its derivatives need.
///
/// The [`Nose`] is the point that is farthest from the middle of the trailing edge, smoothed so that the chord line moves
/// smoothly with the nodes, also where two points tie.
#[derive(Debug, Clone)]
pub(in crate::flow) struct Frame {
    line: ChordLine<f64>,
    nose: Nose,
}

impl Frame {
    /// The frame of nodes in the order of a section.
    ///
    /// # Errors
    /// Too few nodes, a node that is not finite, nodes without a nose.
    pub fn new(nodes: &[[f64; 2]]) -> Result<Self, FlowError> {
        let count = nodes.len();
        if count < super::outline::MIN_NODES {
            return Err(FlowError::TooFewNodes { found: count, needed: super::outline::MIN_NODES });
        }
        if let Some(index) = nodes.iter().position(|p| !(p[0].is_finite() && p[1].is_finite())) {
            return Err(FlowError::NodeNotFinite { index });
        }
        let tail = middle(nodes[0], nodes[count - 1]);
        let nose = Nose::new(nodes, tail);
        let line = ChordLine { nose: nose.place, tail };
        let chord = distance(line.nose, tail);
        let place = tail[0].abs().max(tail[1].abs());
        // written so that NaN fails
        if !(chord > 1e-9 * place && chord > 0.0 && chord.is_finite()) {
            return Err(FlowError::NoNose);
        }
        Ok(Self { line, nose })
    }

    /// Distance from the nose to the middle of the trailing edge, in the unit of the nodes.
    pub fn chord(&self) -> f64 {
        distance(self.line.nose, self.line.tail)
    }

    /// Points in the frame, in chords.
    pub fn inside(&self, points: &[[f64; 2]]) -> Vec<[f64; 2]> {
        points.iter().map(|&p| self.line.inside(p)).collect()
    }

    /// Angle between the onset flow and the chord line for an angle of attack against the x axis, both in radians.
    pub fn incidence(&self, alpha: f64) -> f64 {
        alpha - self.line.turn()
    }

    /// Angle of attack against the x axis for an angle between the onset flow and the chord line, both in radians.
    pub fn alpha(&self, incidence: f64) -> f64 {
        incidence + self.line.turn()
    }

    /// The derivatives of this frame, for the nodes as they were given.
    pub fn derivatives(&self, nodes: &[[f64; 2]]) -> FrameDerivatives {
        let unit = |value: f64, k: usize| Tangent::<6>::from_re(value).derivative(k);
        let lift = |p: [f64; 2], k: usize| [unit(p[0], k), unit(p[1], k + 1)];
        let line = ChordLine { nose: lift(self.line.nose, 2), tail: lift(self.line.tail, 4) };
        FrameDerivatives {
            turn: gradient(&line.turn()),
            inside: nodes.iter().map(|&node| line.inside(lift(node, 0)).map(|c| gradient(&c))).collect(),
            nose: [[1.0, 0.0], [0.0, 1.0]].map(|axis| self.nose.pull_back(axis)),
        }
    }
}

/// Derivatives of the frame of a section and of its nodes in that frame. All outputs share them.
#[derive(Debug, Clone)]
pub(in crate::flow) struct FrameDerivatives {
    /// Derivatives of the angle of the chord line with respect to a node, the nose and the tail.
    turn: [f64; 6],
    /// Derivatives of the two coordinates of every node in the frame with respect to the node, the nose and the tail.
    inside: Vec<[[f64; 6]; 2]>,
    /// Derivatives of the two coordinates of the nose with respect to the nodes and to the tail.
    nose: [(Vec<[f64; 2]>, [f64; 2]); 2],
}

impl FrameDerivatives {
    /// Derivatives with respect to the nodes as they were given, from those with respect to the nodes in the frame and to
    /// the angle between onset flow and chord line.
    pub fn pull_back(&self, inner: Derivatives) -> Derivatives {
        let mut by_line = self.turn.map(|d| -inner.alpha * d);
        let mut outer = Vec::with_capacity(self.inside.len());
        for ([x, y], by) in self.inside.iter().zip(&inner.nodes) {
            let by_all: [f64; 6] = std::array::from_fn(|k| by[0] * x[k] + by[1] * y[k]);
            outer.push([by_all[0], by_all[1]]);
            (2..6).for_each(|k| by_line[k] += by_all[k]);
        }
        let mut by_tail = [by_line[4], by_line[5]];
        for ((by_nodes, by_end), weight) in self.nose.iter().zip([by_line[2], by_line[3]]) {
            for (node, by) in outer.iter_mut().zip(by_nodes) {
                (0..2).for_each(|c| node[c] += weight * by[c]);
            }
            (0..2).for_each(|c| by_tail[c] += weight * by_end[c]);
        }
        let last = outer.len() - 1;
        for end in [0, last] {
            (0..2).for_each(|c| outer[end][c] += 0.5 * by_tail[c]);
        }
        Derivatives { nodes: outer, ..inner }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::testcases::naca_symmetric;

    fn turned_and_scaled(nodes: &[[f64; 2]], angle: f64, scale: f64, shift: [f64; 2]) -> Vec<[f64; 2]> {
        let (sin, cos) = angle.sin_cos();
        nodes
            .iter()
            .map(|[x, y]| [shift[0] + scale * (cos * x - sin * y), shift[1] + scale * (sin * x + cos * y)])
            .collect()
    }

    #[test]
    fn any_place_size_and_angle_give_one_section() {
        let nodes = naca_symmetric(0.12, 0.0025, 121);
        let given = Frame::new(&nodes).unwrap();
        assert!((given.chord() - 1.0).abs() < 5e-7 && (given.incidence(0.1) - 0.1).abs() < 1e-14);
        let moved = turned_and_scaled(&nodes, -0.3, 1000.0, [-400.0, 70.0]);
        let frame = Frame::new(&moved).unwrap();
        assert!((frame.chord() / given.chord() - 1000.0).abs() < 1e-9);
        assert!((frame.incidence(0.1) - 0.4).abs() < 1e-13 && (frame.alpha(0.4) - 0.1).abs() < 1e-13);
        for (a, b) in frame.inside(&moved).iter().zip(&given.inside(&nodes)) {
            assert!(distance(*a, *b) < 1e-13, "{a:?} {b:?}");
        }
    }

    #[test]
    fn derivatives_pass_through_the_frame() {
        // a cambered section, so that the nose lies between nodes
        let bend = |[x, y]: [f64; 2]| [x + 0.1 * y, y + 0.3 * x * (1.0 - x)];
        let nodes: Vec<_> = naca_symmetric(0.12, 0.0025, 81).into_iter().map(bend).collect();
        let nodes = turned_and_scaled(&nodes, 0.2, 3.0, [5.0, -2.0]);
        let weight = |i: usize, c: usize| ((7 * i + 3 * c) as f64).sin();
        let output = |nodes: &[[f64; 2]]| {
            let frame = Frame::new(nodes).unwrap();
            let inside = frame.inside(nodes);
            let sum: f64 =
                inside.iter().enumerate().map(|(i, p)| weight(i, 0) * p[0] + weight(i, 1) * p[1].sin()).sum();
            sum + 4.0 * frame.incidence(0.1).powi(2)
        };
        let frame = Frame::new(&nodes).unwrap();
        let by_inside =
            frame.inside(&nodes).into_iter().enumerate().map(|(i, p)| [weight(i, 0), weight(i, 1) * p[1].cos()]);
        let inner =
            Derivatives { nodes: by_inside.collect(), alpha: 8.0 * frame.incidence(0.1), mach: 0.5, reynolds: 0.25 };
        let exact = frame.derivatives(&nodes).pull_back(inner);
        assert_eq!((exact.mach, exact.reynolds), (0.5, 0.25));
        for i in [0, 1, 20, 38, 39, 40, 41, 42, 60, 80] {
            for c in 0..2 {
                let at = |step: f64| {
                    let mut moved = nodes.clone();
                    moved[i][c] += step;
                    output(&moved)
                };
                let h = 1e-5;
                let difference = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
                assert!((difference - exact.nodes[i][c]).abs() < 1e-8, "{i} {c}: {difference} {}", exact.nodes[i][c]);
            }
        }
    }

    #[test]
    fn nodes_without_a_nose_are_refused() {
        assert_eq!(Frame::new(&[[1.0, 0.0]; 50]).unwrap_err(), FlowError::NoNose);
        assert!(matches!(Frame::new(&[[1.0, 0.0]; 5]), Err(FlowError::TooFewNodes { .. })));
        let mut nodes = naca_symmetric(0.12, 0.0025, 121);
        nodes[3][1] = f64::NAN;
        assert_eq!(Frame::new(&nodes).unwrap_err(), FlowError::NodeNotFinite { index: 3 });
    }
}
