//! The chord axis, and what is read off at the trailing edge.

use crate::plane::{cross, dot, length, middle, minus};
use crate::scalar::Scalar;
use crate::section::{MeasureProblem, Section, SectionError};

/// The section's own axes: origin at the nose, first axis to the middle of the trailing edge, second to the left of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChordFrame<S> {
    /// The nose of the section, where the frame has its origin.
    pub origin: [S; 2],
    /// Unit vector from the nose to the middle of the trailing edge.
    pub axis: [S; 2],
    /// Distance from the nose to the middle of the trailing edge.
    pub chord: S,
}

impl<S: Scalar> ChordFrame<S> {
    /// A point in the frame, in units of the section (not divided by the chord).
    pub fn coordinates(&self, point: [S; 2]) -> [S; 2] {
        self.components(minus(point, self.origin))
    }

    /// A vector in the directions of the frame.
    pub fn components(&self, v: [S; 2]) -> [S; 2] {
        [dot(v, self.axis), cross(self.axis, v)]
    }

    /// Point and tangent of a curve in the frame.
    pub(super) fn on(&self, (point, tangent): ([S; 2], [S; 2])) -> ([S; 2], [S; 2]) {
        (self.coordinates(point), self.components(tangent))
    }

    /// The frame over `f64`, of the real parts.
    pub fn real(&self) -> ChordFrame<f64> {
        ChordFrame { origin: self.origin.map(|c| c.re()), axis: self.axis.map(|c| c.re()), chord: self.chord.re() }
    }
}

impl ChordFrame<f64> {
    /// The frame as constants of another scalar.
    pub(super) fn lifted<S: Scalar>(&self) -> ChordFrame<S> {
        ChordFrame { origin: self.origin.map(S::from), axis: self.axis.map(S::from), chord: S::from(self.chord) }
    }
}

impl<S: Scalar> Section<S> {
    /// The frame of the section: origin at the nose, first axis to the middle of the trailing edge.
    ///
    /// # Errors
    /// A nose that coincides with the trailing edge.
    pub fn chord_frame(&self) -> Result<ChordFrame<S>, SectionError> {
        let origin = self.nose();
        let along = minus(self.trailing_edge_middle(), origin);
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
        middle(a, b)
    }

    /// Height of the base normal to the chord: upper minus lower end, so negative where the surfaces have changed
    /// places. Zero for a sharp trailing edge, but with the derivatives of tearing it open.
    ///
    /// # Errors
    /// A section without a chord.
    pub fn trailing_edge_gap(&self) -> Result<S, SectionError> {
        let [a, b] = self.trailing_edge_points();
        Ok(self.chord_frame()?.components(minus(a, b))[1])
    }

    /// Angle between the surfaces at the trailing edge in radians, in (−π, π]; negative where they open
    /// towards the tail or have crossed.
    ///
    /// # Errors
    /// A surface without a direction at its end.
    pub fn trailing_edge_angle(&self) -> Result<S, SectionError> {
        let (first, last) = self.curve().domain();
        let (upper, lower) = (self.curve().tangent_at(first), self.curve().tangent_at(last).map(|c| -c));
        let (sine, cosine) = (cross(upper, lower), dot(upper, lower));
        if sine.re().abs() + cosine.re().abs() > 0.0 {
            Ok(sine.angle(cosine))
        } else {
            let reason = MeasureProblem::Singular;
            Err(SectionError::NoMeasure { measure: "trailing_edge_angle", reason })
        }
    }
}
