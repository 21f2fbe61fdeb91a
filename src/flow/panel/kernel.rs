//! Influence of one straight panel on one point, generic over the scalar.
//!
//! Panel frame: origin at the start, `x` along the panel, `z` to its left. Strengths are linear along the panel.
//! Equations: Katz & Plotkin, "Low-Speed Aerodynamics", chapter 10; Drela, XFOIL (1989), section 2.

use crate::scalar::Scalar;
use std::f64::consts::{FRAC_PI_2, PI};

/// Where a field point lies on a panel: known from the numbering of the nodes, never from a distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Place {
    /// Neither end of the panel.
    Elsewhere,
    /// The first node of the panel.
    Start,
    /// The last node of the panel.
    End,
}

/// Coordinates of a point in the frame of a panel, with the transcendental functions both strengths share.
#[derive(Debug, Clone, Copy)]
struct Frame<S> {
    x: S,
    z: S,
    length: S,
    /// ln of the distance to the start; 0 at the start itself, where it is always multiplied by zero.
    ln1: S,
    /// ln of the distance to the end; 0 at the end itself.
    ln2: S,
}

impl<S: Scalar> Frame<S> {
    fn new(panel: [[S; 2]; 2], point: [S; 2], place: Place) -> Self {
        let [a, b] = panel;
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let length = (dx * dx + dy * dy).sqrt();
        let zero = S::from(0.0);
        match place {
            Place::Start => Self { x: zero, z: zero, length, ln1: zero, ln2: length.ln() },
            Place::End => Self { x: length, z: zero, length, ln1: length.ln(), ln2: zero },
            Place::Elsewhere => {
                let (tx, ty) = (dx / length, dy / length);
                let (px, py) = (point[0] - a[0], point[1] - a[1]);
                let (x, z) = (px * tx + py * ty, py * tx - px * ty);
                let w = x - length;
                let ln1 = (x * x + z * z).ln() * 0.5;
                let ln2 = (w * w + z * z).ln() * 0.5;
                Self { x, z, length, ln1, ln2 }
            }
        }
    }

    /// Angle under which the panel is seen, positive from the left; zero on the panel's own line.
    fn seen(&self, place: Place) -> S {
        if place != Place::Elsewhere {
            return S::from(0.0);
        }
        (self.z * self.length).angle(self.x * (self.x - self.length) + self.z * self.z)
    }
}

/// Stream function at a point per unit strength at the two ends of a panel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StreamInfluence<S> {
    /// Linear clockwise vortex sheet: per strength at the start and at the end.
    pub vortex: [S; 2],
    /// Constant source sheet.
    pub source: S,
}

/// Stream function of a vortex and source panel (start, end) at `point`.
///
/// The cut of the source's angle leaves the panel along its right-hand normal: outside a section whose nodes run
/// counter-clockwise, so that the stream function is continuous inside it.
pub(crate) fn stream_influence<S: Scalar>(panel: [[S; 2]; 2], point: [S; 2], place: Place) -> StreamInfluence<S> {
    let f = Frame::new(panel, point, place);
    let (x, z, d) = (f.x, f.z, f.length);
    let w = x - d;
    let seen = f.seen(place);
    // angle of the point seen from the start and the end, from the panel's direction
    let (angle1, angle2) = match place {
        Place::Start => (S::from(0.0), S::from(PI)),
        Place::End => (S::from(0.0), S::from(0.0)),
        Place::Elsewhere => ((-x).angle(z) + FRAC_PI_2, (-w).angle(z) + FRAC_PI_2),
    };
    let constant = z * seen - d + x * f.ln1 - w * f.ln2;
    let (r1, r2) = (x * x + z * z, w * w + z * z);
    let moment = x * constant + (r2 * f.ln2 - r1 * f.ln1) * 0.5 + (r1 - r2) * 0.25;
    let at_end = moment / d;
    let scale = 0.5 / PI;
    let source = x * angle1 - w * angle2 + z * (f.ln1 - f.ln2);
    StreamInfluence { vortex: [(constant - at_end) * scale, at_end * scale], source: source * scale }
}

/// Stream function at `point` of a linear source panel, per strength at the start and at the end.
///
/// The cut leaves the panel straight ahead, so it is meant for the wake, whose panels look downstream.
pub(crate) fn wake_source_stream<S: Scalar>(panel: [[S; 2]; 2], point: [S; 2], place: Place) -> [S; 2] {
    let f = Frame::new(panel, point, place);
    let (x, z, d) = (f.x, f.z, f.length);
    let w = x - d;
    let zero = S::from(0.0);
    let angle1 = if place == Place::Start { zero } else { (-z).angle(-x) };
    let angle2 = if place == Place::End { zero } else { (-z).angle(-w) };
    let (r1, r2) = (x * x + z * z, w * w + z * z);
    let constant = x * angle1 - w * angle2 + z * (f.ln1 - f.ln2);
    let moment = x * constant - (r1 * angle1 - r2 * angle2 + z * d) * 0.5;
    let at_end = moment / d;
    [(constant - at_end) * (0.5 / PI), at_end * (0.5 / PI)]
}

/// Velocity at a point, in the outer frame, per unit strength at the two ends of a panel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct VelocityInfluence<S> {
    /// Linear clockwise vortex sheet: velocity vector per strength at the start and at the end.
    pub vortex: [[S; 2]; 2],
    /// Linear source sheet.
    pub source: [[S; 2]; 2],
}

/// Velocity of a vortex and source panel (start, end) at `point`.
///
/// At an end of the panel the infinite logarithm and half the jump are left out: two panels that meet there with
/// equal strength cancel them.
pub(crate) fn velocity_influence<S: Scalar>(panel: [[S; 2]; 2], point: [S; 2], place: Place) -> VelocityInfluence<S> {
    let f = Frame::new(panel, point, place);
    let (x, z, d) = (f.x, f.z, f.length);
    let (seen, log) = (f.seen(place), f.ln1 - f.ln2);
    // gradients along and across the panel of ∫ ln r and of ∫ ξ ln r, divided by the length
    let along = [log, (x * log - d + z * seen) / d];
    let across = [seen, (x * seen - z * log) / d];
    let (tx, ty) = ((panel[1][0] - panel[0][0]) / d, (panel[1][1] - panel[0][1]) / d);
    let scale = 0.5 / PI;
    let outer = |t: S, n: S| [(t * tx - n * ty) * scale, (t * ty + n * tx) * scale];
    let ends =
        |along: [S; 2], across: [S; 2]| [outer(along[0] - along[1], across[0] - across[1]), outer(along[1], across[1])];
    let minus = along.map(|v| -v);
    VelocityInfluence { vortex: ends(across, minus), source: ends(along, across) }
}
