//! A section and its measures.

use super::Named;
use crate::section::{Coordinates, Measure, Repair, Section, SectionDefinition, TrailingEdge};
use serde::Serialize;

/// A section: its measures and its curve.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SectionReport {
    /// Name of the section.
    pub name: String,
    /// The [measures](Self::MEASURES), each a key of its own; `None` where the section has no such measure.
    #[serde(flatten)]
    pub measures: Named<Option<f64>>,
    /// Centroid of the area; `None` where the area vanishes.
    pub centroid: Option<[f64; 2]>,
    /// Unit of the lengths above and of the control points: `"chord"` for a section that is made by name, else the unit
    /// of the file, by its symbol where it was given.
    pub length_unit: String,
    /// A sentence for everything that was mended in the file of the section.
    pub repairs: Vec<String>,
    /// Number of control points of the curve.
    pub control_points: usize,
    /// `"sharp"` or `"blunt"`.
    pub trailing_edge: &'static str,
    /// Parameters of the definition, such as the thickness of a NACA section.
    pub parameters: Named<f64>,
    /// Whether the section crosses itself.
    pub self_intersecting: bool,
    /// The curve itself.
    pub curve: CurveReport,
}

/// A B-spline curve.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CurveReport {
    /// Degree of the curve.
    pub degree: usize,
    /// Knots with their multiplicity.
    pub knots: Vec<f64>,
    /// Control points, from the trailing edge over the upper surface and back.
    pub control_points: Vec<[f64; 2]>,
}

/// The kind of number that a measure is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    /// A length in the unit of the coordinates.
    Length,
    /// An area in that unit squared.
    Area,
    /// A place along the chord, as share of it.
    Share,
    /// An angle in degrees.
    Angle,
}

impl SectionReport {
    /// The measures of a report in order.
    pub const MEASURES: [(Measure, Dimension); 10] = [
        (Measure::Area, Dimension::Area),
        (Measure::Thickness, Dimension::Length),
        (Measure::ThicknessX, Dimension::Share),
        (Measure::Camber, Dimension::Length),
        (Measure::CamberX, Dimension::Share),
        (Measure::NoseRadius, Dimension::Length),
        (Measure::TrailingEdgeAngle, Dimension::Angle),
        (Measure::TrailingEdgeGap, Dimension::Length),
        (Measure::Perimeter, Dimension::Length),
        (Measure::Chord, Dimension::Length),
    ];

    /// Measures `section`, which was built from `definition`; `unit` is that of a file, where it is known.
    pub fn new(definition: &SectionDefinition, section: &Section<f64>, unit: Option<&str>) -> Self {
        // a symmetric section has no place of largest camber
        let value = |measure: Measure| {
            let value = measure.evaluate(section).ok()?;
            Some(if measure == Measure::TrailingEdgeAngle { value.to_degrees() } else { value })
        };
        let curve = section.curve();
        Self {
            name: section.name().to_string(),
            measures: Named(Self::MEASURES.map(|(m, _)| (m.name(), value(m).filter(|v| v.is_finite()))).into()),
            centroid: section.centroid().ok(),
            length_unit: match (definition, unit) {
                (SectionDefinition::Coordinates(c), _) if is_normalized(c) => "chord".into(),
                (SectionDefinition::Coordinates(_), Some(unit)) => unit.to_string(),
                (SectionDefinition::Coordinates(_), None) => "unit of the file".into(),
                _ => "chord".into(),
            },
            repairs: repairs(definition),
            control_points: curve.control_points().len(),
            trailing_edge: match section.trailing_edge() {
                TrailingEdge::Sharp => "sharp",
                TrailingEdge::Blunt => "blunt",
            },
            parameters: Named(definition.parameters()),
            self_intersecting: section.self_intersection().is_some(),
            curve: CurveReport {
                degree: curve.degree(),
                knots: curve.knots().as_slice().to_vec(),
                control_points: curve.control_points().to_vec(),
            },
        }
    }
}

/// Whether the points of a file were brought to chord 1.
fn is_normalized(coordinates: &Coordinates) -> bool {
    coordinates.repairs().iter().any(|repair| matches!(repair, Repair::Normalized { .. }))
}

/// A sentence for everything that was mended in the points of a file, beginning with the name of the section; empty
/// where nothing was.
pub fn repairs(definition: &SectionDefinition) -> Vec<String> {
    definition.repairs().iter().map(|repair| format!("{}: {repair}", definition.name())).collect()
}
