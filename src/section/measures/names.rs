//! The list of measures and their names. It knows no section, so that the errors of sections can name it.

use std::fmt;

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
    /// Largest thickness. It has no derivative where two maxima tie.
    Thickness,
    /// Station of the largest thickness, in chords; it jumps, and has no derivative, where two maxima tie.
    ThicknessX,
    /// Thickness at a station, in chords.
    ThicknessAt(f64),
    /// Camber of largest magnitude, with its sign. It has no derivative where two extremes tie or the section is
    /// symmetric.
    Camber,
    /// Station of the camber of largest magnitude, in chords; it jumps, and has no derivative, where two extremes tie.
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
    /// Angle in radians by which the concave parts of the outline turn, smoothed: no reversals of curvature, no
    /// concavity.
    Concavity,
}

/// Lists every measure once, by variant and name; 0.25 stands for any station.
macro_rules! measures {
    ($($variant:ident $(($station:literal))? = $name:literal,)*) => {
        /// The names that [`parse`](Self::parse) takes, with 0.25 standing for any station between 0 and 1.
        pub const NAMES: [&str; 20] = [$(concat!($name $(, "(", $station, ")")?)),*];

        pub(super) const ALL: [Self; 20] = [$(Self::$variant $(($station))?),*];

        /// The name without a station.
        pub(super) fn family(&self) -> &'static str {
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

    /// The name, as [`parse`](Self::parse) takes it.
    pub fn name(&self) -> String {
        match self {
            Self::ThicknessAt(station) => format!("thickness_at({station})"),
            Self::CamberAt(station) => format!("camber_at({station})"),
            _ => self.family().into(),
        }
    }
}

impl fmt::Display for Measure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name())
    }
}
