//! Influence of one straight panel on one point, generic over the scalar.
//!
//! The frame of a panel has its origin at the start, `x` along the panel and `z` to the left of it. Strengths are
//! linear along the panel. Equations: Katz & Plotkin, "Low-Speed Aerodynamics", chapter 10; Drela, XFOIL (1989),
//! section 2.

use crate::scalar::Scalar;
use std::f64::consts::{FRAC_PI_2, PI};

/// Where a field point lies on a panel. This is known from the numbering of the nodes, never from a distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Place {
    /// At neither end of the panel.
    Elsewhere,
    /// At the first node of the panel.
    Start,
    /// At the last node of the panel.
    End,
}

/// A point in the frame of a panel, with the transcendental functions that the kernels share.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sight<S> {
    /// Coordinate along the panel, from the start.
    pub x: S,
    /// Coordinate across the panel, positive to the left.
    pub z: S,
    /// Length of the panel.
    pub length: S,
    /// Logarithm of the distance to the start; 0 at the start itself, where it is always multiplied by zero.
    pub ln1: S,
    /// Logarithm of the distance to the end; 0 at the end itself, where it is always multiplied by zero.
    pub ln2: S,
    /// Angle under which the panel is seen, positive from the left; zero on the panel's own line.
    pub seen: S,
    /// Direction of the point from the start, where the kernel needs it; the kernel says where the cut is.
    pub angle1: S,
    /// Direction of the point from the end, where the kernel needs it; the kernel says where the cut is.
    pub angle2: S,
}

impl<S: Scalar> Sight<S> {
    /// A point seen from a panel, without the two directions.
    fn new(panel: [[S; 2]; 2], point: [S; 2], place: Place) -> Self {
        let [a, b] = panel;
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let length = (dx * dx + dy * dy).sqrt();
        let zero = S::from(0.0);
        let on_panel = |x, ln1, ln2| Self { x, z: zero, length, ln1, ln2, seen: zero, angle1: zero, angle2: zero };
        match place {
            Place::Start => on_panel(zero, zero, length.ln()),
            Place::End => on_panel(length, length.ln(), zero),
            Place::Elsewhere => {
                let (tx, ty) = (dx / length, dy / length);
                let (px, py) = (point[0] - a[0], point[1] - a[1]);
                let (x, z) = (px * tx + py * ty, py * tx - px * ty);
                let w = x - length;
                let ln1 = (x * x + z * z).ln() * 0.5;
                let ln2 = (w * w + z * z).ln() * 0.5;
                let seen = (z * length).angle(x * w + z * z);
                Self { x, z, length, ln1, ln2, seen, angle1: zero, angle2: zero }
            }
        }
    }

    /// Stream function of a vortex and source panel. The directions are relative to the panel, with the cut along its
    /// right-hand normal.
    #[inline(always)]
    pub fn stream(&self) -> StreamInfluence<S> {
        let Self { x, z, length, ln1, ln2, seen, angle1, angle2 } = *self;
        let w = x - length;
        let constant = z * seen - length + x * ln1 - w * ln2;
        let (r1, r2) = (x * x + z * z, w * w + z * z);
        let moment = x * constant + (r2 * ln2 - r1 * ln1) * 0.5 + (r1 - r2) * 0.25;
        // one over the length is the same for all points that see a panel, and divisions are slow
        let at_end = moment * length.recip();
        let scale = 0.5 / PI;
        let source = x * angle1 - w * angle2 + z * (ln1 - ln2);
        StreamInfluence { vortex: [(constant - at_end) * scale, at_end * scale], source: source * scale }
    }

    /// Stream function of a linear source panel, per strength at the start and at the end. The directions are relative
    /// to the panel, less π, with the cut straight ahead.
    #[inline(always)]
    pub fn wake_stream(&self) -> [S; 2] {
        let Self { x, z, length, ln1, ln2, angle1, angle2, .. } = *self;
        let w = x - length;
        let (r1, r2) = (x * x + z * z, w * w + z * z);
        let constant = x * angle1 - w * angle2 + z * (ln1 - ln2);
        let moment = x * constant - (r1 * angle1 - r2 * angle2 + z * length) * 0.5;
        let at_end = moment * length.recip();
        [(constant - at_end) * (0.5 / PI), at_end * (0.5 / PI)]
    }

    /// Velocity of a vortex and source panel in the frame of the panel.
    #[inline(always)]
    pub fn velocity(&self) -> LocalVelocity<S> {
        let Self { x, z, length, ln1, ln2, seen, .. } = *self;
        let log = ln1 - ln2;
        let scale = 0.5 / PI;
        let per_length = length.recip();
        // gradients along and across the panel of ∫ ln r and of ∫ ξ ln r, divided by the length
        let along = [log, (x * log - length + z * seen) * per_length];
        let across = [seen, (x * seen - z * log) * per_length];
        let ends = |v: [S; 2]| [(v[0] - v[1]) * scale, v[1] * scale];
        LocalVelocity { along: ends(along), across: ends(across) }
    }
}

/// Velocity of a source panel along and across it, per strength at the start and at the end. The velocity of a vortex
/// panel is that of the source panel turned by a right angle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LocalVelocity<S> {
    /// Component along the panel, per strength at the start and at the end.
    along: [S; 2],
    /// Component across the panel, per strength at the start and at the end.
    across: [S; 2],
}

impl<S: Scalar> LocalVelocity<S> {
    /// Velocity along and across the panel per source strength at an end (0: start, 1: end).
    #[inline(always)]
    pub fn source(&self, end: usize) -> [S; 2] {
        [self.along[end], self.across[end]]
    }

    /// Velocity along and across the panel per clockwise vortex strength at an end (0: start, 1: end).
    #[inline(always)]
    pub fn vortex(&self, end: usize) -> [S; 2] {
        [self.across[end], -self.along[end]]
    }
}

/// Stream function at a point per unit strength at the two ends of a panel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StreamInfluence<S> {
    /// Linear clockwise vortex sheet, per strength at the start and at the end.
    pub vortex: [S; 2],
    /// Constant source sheet, per strength.
    pub source: S,
}

/// Stream function of a vortex and source panel (start, end) at `point`.
///
/// The cut of the source's angle leaves the panel along its right-hand normal: outside a section whose nodes run
/// counter-clockwise, so that the stream function is continuous inside it.
pub(crate) fn stream_influence<S: Scalar>(panel: [[S; 2]; 2], point: [S; 2], place: Place) -> StreamInfluence<S> {
    let mut sight = Sight::new(panel, point, place);
    let (x, w, z) = (sight.x, sight.x - sight.length, sight.z);
    (sight.angle1, sight.angle2) = match place {
        Place::Start => (S::from(0.0), S::from(PI)),
        Place::End => (S::from(0.0), S::from(0.0)),
        Place::Elsewhere => ((-x).angle(z) + FRAC_PI_2, (-w).angle(z) + FRAC_PI_2),
    };
    sight.stream()
}

/// Stream function at `point` of a linear source panel, per strength at the start and at the end.
///
/// The cut leaves the panel straight ahead, so it is meant for the wake, whose panels look downstream.
#[cfg(test)]
pub(crate) fn wake_source_stream<S: Scalar>(panel: [[S; 2]; 2], point: [S; 2], place: Place) -> [S; 2] {
    let mut sight = Sight::new(panel, point, place);
    let (x, w, z) = (sight.x, sight.x - sight.length, sight.z);
    let zero = S::from(0.0);
    sight.angle1 = if place == Place::Start { zero } else { (-z).angle(-x) };
    sight.angle2 = if place == Place::End { zero } else { (-z).angle(-w) };
    sight.wake_stream()
}

/// Velocity at a point, in the outer frame, per unit strength at the two ends of a panel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct VelocityInfluence<S> {
    /// Linear clockwise vortex sheet: velocity vector per strength at the start and at the end.
    pub vortex: [[S; 2]; 2],
    /// Linear source sheet: velocity vector per strength at the start and at the end.
    pub source: [[S; 2]; 2],
}

/// Velocity of a vortex and source panel (start, end) at `point`.
///
/// At an end of the panel the infinite logarithm and half the jump are left out: two panels that meet there with
/// equal strength cancel them.
pub(crate) fn velocity_influence<S: Scalar>(panel: [[S; 2]; 2], point: [S; 2], place: Place) -> VelocityInfluence<S> {
    let sight = Sight::new(panel, point, place);
    let d = sight.length;
    let (tx, ty) = ((panel[1][0] - panel[0][0]) / d, (panel[1][1] - panel[0][1]) / d);
    let outer = |[t, n]: [S; 2]| [t * tx - n * ty, t * ty + n * tx];
    let velocity = sight.velocity();
    let ends = [0, 1];
    VelocityInfluence {
        vortex: ends.map(|end| outer(velocity.vortex(end))),
        source: ends.map(|end| outer(velocity.source(end))),
    }
}
