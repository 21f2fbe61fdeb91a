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
mod nose;
mod reversals;
#[cfg(test)]
mod tests;

pub use crossing::Crossing;
pub(super) use crossing::outline_crossing;
pub use frame::ChordFrame;
pub use integrals::SecondMoments;
pub(super) use nose::farthest_parameter;

use super::{Section, SectionError};
use crate::scalar::Scalar;
use crate::spline::BSplineCurve;
use std::fmt;
use std::str::FromStr;

/// A named measure of a section, as in case files and constraints.
///
/// ```
/// use aeroform::section::{Measure, SectionDefinition};
/// let section = SectionDefinition::parse("naca0012:sharp").unwrap().section().unwrap();
/// let measure = Measure::parse("thickness_at(0.25)").unwrap();
/// assert!((measure.evaluate(&section).unwrap() - 0.1188).abs() < 1e-4);
/// assert_eq!(Measure::parse("thickness at 0.25").unwrap().name(), "thickness_at(0.25)");
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Measure {
    /// Area enclosed by the outline.
    Area,
    /// Length of the closed outline.
    Perimeter,
    /// Abscissa of the centroid of the area.
    CentroidX,
    /// Ordinate of the centroid of the area.
    CentroidY,
    /// `∫ (y − ȳ)² dA`.
    SecondMomentXx,
    /// `∫ (x − x̄)² dA`.
    SecondMomentYy,
    /// `∫ (x − x̄)(y − ȳ) dA`.
    SecondMomentXy,
    /// Distance from the nose to the middle of the trailing edge.
    Chord,
    /// Largest thickness. Continuous only where two maxima tie.
    Thickness,
    /// Station of the largest thickness, in chords; jumps where two maxima tie.
    ThicknessX,
    /// Thickness at a station, in chords.
    ThicknessAt(f64),
    /// Camber of largest magnitude, with its sign. Continuous only where two extremes tie.
    Camber,
    /// Station of the camber of largest magnitude, in chords; jumps where two extremes tie.
    CamberX,
    /// Camber at a station, in chords.
    CamberAt(f64),
    /// Radius of curvature at the nose parameter.
    NoseRadius,
    /// Abscissa of the point farthest from the trailing edge.
    LeadingEdgeX,
    /// Ordinate of the point farthest from the trailing edge.
    LeadingEdgeY,
    /// Angle between the surfaces at the trailing edge, in radians.
    TrailingEdgeAngle,
    /// Height of the base normal to the chord; negative where the surfaces have changed places.
    TrailingEdgeGap,
    /// Angle in radians by which the concave parts of the outline turn, smoothed: no reversals of curvature, no concavity.
    Concavity,
}

/// Lists every measure once, by variant and name; 0.25 stands for any station.
macro_rules! measures {
    ($($variant:ident $(($station:literal))? = $name:literal,)*) => {
        /// The names that [`parse`](Self::parse) takes, with 0.25 standing for any station between 0 and 1.
        pub const NAMES: [&str; 20] = [$(concat!($name $(, "(", $station, ")")?)),*];

        const ALL: [Self; 20] = [$(Self::$variant $(($station))?),*];

        /// The name without a station.
        fn family(&self) -> &'static str {
            match self {
                $(Self::$variant { .. } => $name),*
            }
        }
    };
}

impl Measure {
    measures! {
        Area = "area",
        Perimeter = "perimeter",
        CentroidX = "centroid_x",
        CentroidY = "centroid_y",
        SecondMomentXx = "second_moment_xx",
        SecondMomentYy = "second_moment_yy",
        SecondMomentXy = "second_moment_xy",
        Chord = "chord",
        Thickness = "thickness",
        ThicknessX = "thickness_x",
        ThicknessAt(0.25) = "thickness_at",
        Camber = "camber",
        CamberX = "camber_x",
        CamberAt(0.25) = "camber_at",
        NoseRadius = "nose_radius",
        LeadingEdgeX = "leading_edge_x",
        LeadingEdgeY = "leading_edge_y",
        TrailingEdgeAngle = "trailing_edge_angle",
        TrailingEdgeGap = "trailing_edge_gap",
        Concavity = "concavity",
    }

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

    /// The name, as [`parse`](Self::parse) takes it.
    pub fn name(&self) -> String {
        match self {
            Self::ThicknessAt(station) => format!("thickness_at({station})"),
            Self::CamberAt(station) => format!("camber_at({station})"),
            _ => self.family().into(),
        }
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

impl fmt::Display for Measure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name())
    }
}

impl FromStr for Measure {
    type Err = SectionError;
    fn from_str(text: &str) -> Result<Self, SectionError> {
        Self::parse(text)
    }
}

/// Four parameters per knot span, ends included.
fn dense_parameters(curve: &BSplineCurve<f64>) -> Vec<f64> {
    const SHARE: usize = 4;
    let mut parameters = vec![];
    for (_, start, end) in curve.knots().spans() {
        parameters.extend((0..SHARE).map(|i| start + (end - start) * i as f64 / SHARE as f64));
    }
    parameters.push(curve.domain().1);
    parameters
}
