//! The chord axis, and what is read off at the trailing edge.

use crate::scalar::Scalar;
use crate::section::{MeasureProblem, Section, SectionError};

/// The section's own axes: origin at the nose, first axis to the middle of the trailing edge, second to the left of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChordFrame<S> {
    /// The nose.
    pub origin: [S; 2],
    /// Unit vector from the nose to the middle of the trailing edge.
    pub axis: [S; 2],
    /// Distance from the nose to the middle of the trailing edge.
    pub chord: S,
}

impl<S: Scalar> ChordFrame<S> {
    /// A point in the frame, in units of the section (not divided by the chord).
    pub fn coordinates(&self, point: [S; 2]) -> [S; 2] {
        self.components([point[0] - self.origin[0], point[1] - self.origin[1]])
    }

    /// A vector in the directions of the frame.
    pub fn components(&self, v: [S; 2]) -> [S; 2] {
        let [c, s] = self.axis;
        [v[0] * c + v[1] * s, v[1] * c - v[0] * s]
    }

    /// The frame of the real parts.
    pub fn real(&self) -> ChordFrame<f64> {
        ChordFrame { origin: self.origin.map(|c| c.re()), axis: self.axis.map(|c| c.re()), chord: self.chord.re() }
    }
}

impl<S: Scalar> Section<S> {
    /// The section's own axes.
    ///
    /// # Errors
    /// A nose that coincides with the trailing edge.
    pub fn chord_frame(&self) -> Result<ChordFrame<S>, SectionError> {
        let origin = self.nose();
        let tail = self.trailing_edge_middle();
        let along = [tail[0] - origin[0], tail[1] - origin[1]];
        let chord = length(along);
        if chord.re() > 0.0 {
            Ok(ChordFrame { origin, axis: along.map(|c| c / chord), chord })
        } else {
            Err(SectionError::NoMeasure { measure: "chord", reason: MeasureProblem::NoChord })
        }
    }

    /// The middle of the trailing edge.
    pub fn trailing_edge_middle(&self) -> [S; 2] {
        let [a, b] = self.trailing_edge_points();
        [(a[0] + b[0]) * 0.5, (a[1] + b[1]) * 0.5]
    }

    /// Height of the base normal to the chord: upper minus lower end, so negative where the surfaces have changed
    /// places. Zero for a sharp trailing edge, but with the derivatives of tearing it open.
    ///
    /// # Errors
    /// A section without a chord.
    pub fn trailing_edge_gap(&self) -> Result<S, SectionError> {
        let [a, b] = self.trailing_edge_points();
        Ok(self.chord_frame()?.components([a[0] - b[0], a[1] - b[1]])[1])
    }

    /// Angle between the surfaces at the trailing edge in radians, in (−π, π]; negative where they open
    /// towards the tail or have crossed.
    ///
    /// # Errors
    /// A surface without a direction at its end.
    pub fn trailing_edge_angle(&self) -> Result<S, SectionError> {
        let (first, last) = self.curve().domain();
        let upper = self.curve().point_and_tangent(S::from(first)).1;
        let lower = self.curve().point_and_tangent(S::from(last)).1.map(|c| -c);
        let sine = upper[0] * lower[1] - upper[1] * lower[0];
        let cosine = upper[0] * lower[0] + upper[1] * lower[1];
        if sine.re().abs() + cosine.re().abs() > 0.0 {
            Ok(sine.angle(cosine))
        } else {
            let reason = MeasureProblem::Singular;
            Err(SectionError::NoMeasure { measure: "trailing_edge_angle", reason })
        }
    }
}

/// Length of a vector.
pub(super) fn length<S: Scalar>(v: [S; 2]) -> S {
    // scaled, so that squares neither overflow nor vanish
    let scale = v[0].re().abs().max(v[1].re().abs());
    if scale == 0.0 || !scale.is_finite() {
        return S::from(scale);
    }
    let [x, y] = v.map(|c| c / scale);
    (x * x + y * y).sqrt() * scale
}
