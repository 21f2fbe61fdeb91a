//! Measures of a section. Every measure is written once over [`Scalar`](crate::scalar::Scalar), so its
//! derivative with respect to control points or build parameters is exact.
//!
//! Lengths are in the units of the control points (chords, for built sections), stations along the chord in chords,
//! angles in radians. The *chord axis* runs from the nose (the point at the nose parameter) to the middle of the
//! trailing edge; thickness and camber are the difference and the mean of the two surfaces' ordinates at equal station
//! of that axis. Parameters that a measure has to search for are found in `f64` and lifted by the implicit function
//! theorem.

mod crossing;
mod extremes;
mod frame;
mod integrals;
mod names;
mod nose;
mod reversals;
mod sampling;
#[cfg(test)]
mod tests;

pub use crossing::Crossing;
pub(super) use crossing::outline_crossing;
pub use frame::ChordFrame;
pub use integrals::SecondMoments;
pub use names::Measure;
pub(super) use nose::farthest_parameter;

use super::{Section, SectionError};
use crate::scalar::Scalar;
use std::str::FromStr;

impl Measure {
    /// Reads a name; besides `thickness_at(0.25)` also `thickness at 0.25`.
    ///
    /// # Errors
    /// A name that is none; a station that is no number between 0 and 1.
    pub fn parse(text: &str) -> Result<Self, SectionError> {
        let unknown = || SectionError::UnknownMeasure { text: text.into() };
        let words = text.trim().to_ascii_lowercase().replace(['(', ')', '_', ' ', '\t'], " ");
        let words: Vec<&str> = words.split_whitespace().collect();
        if let [kind, "at", station] = words[..] {
            let station: f64 = station.parse().map_err(|_| SectionError::NotANumber { text: station.into() })?;
            let measure = match kind {
                "thickness" => Self::ThicknessAt(station),
                "camber" => Self::CamberAt(station),
                _ => return Err(unknown()),
            };
            extremes::check_station(measure.family(), station)?;
            return Ok(measure);
        }
        let name = words.join("_");
        let index = Self::NAMES.iter().position(|known| *known == name).ok_or_else(unknown)?;
        Ok(Self::ALL[index])
    }

    /// The value on a section.
    ///
    /// # Errors
    /// [`SectionError::NoMeasure`] where the section has no such measure.
    pub fn evaluate<S: Scalar>(&self, section: &Section<S>) -> Result<S, SectionError> {
        match *self {
            Self::Area => Ok(section.area()),
            Self::Perimeter => section.perimeter(),
            Self::CentroidX => Ok(section.centroid()?[0]),
            Self::CentroidY => Ok(section.centroid()?[1]),
            Self::SecondMomentXx => Ok(section.second_moments()?.xx),
            Self::SecondMomentYy => Ok(section.second_moments()?.yy),
            Self::SecondMomentXy => Ok(section.second_moments()?.xy),
            Self::Chord => Ok(section.chord_frame()?.chord),
            Self::Thickness => Ok(section.maximum_thickness()?[1]),
            Self::ThicknessX => Ok(section.maximum_thickness()?[0]),
            Self::ThicknessAt(station) => section.thickness_at(station),
            Self::Camber => section.camber(),
            Self::CamberX => Ok(section.maximum_camber()?[0]),
            Self::CamberAt(station) => section.camber_at(station),
            Self::NoseRadius => section.nose_radius(),
            Self::LeadingEdgeX => Ok(section.leading_edge()?[0]),
            Self::LeadingEdgeY => Ok(section.leading_edge()?[1]),
            Self::TrailingEdgeAngle => section.trailing_edge_angle(),
            Self::TrailingEdgeGap => section.trailing_edge_gap(),
            Self::Concavity => section.concavity(),
        }
    }
}

impl FromStr for Measure {
    type Err = SectionError;
    fn from_str(text: &str) -> Result<Self, SectionError> {
        Self::parse(text)
    }
}
