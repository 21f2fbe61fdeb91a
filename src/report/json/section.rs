//! A section and its measures.

use super::Named;
use crate::section::{Measure, Section, SectionDefinition, TrailingEdge};
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

impl SectionReport {
    /// The measures of a report in order, each with its unit.
    pub const MEASURES: [(Measure, &'static str); 10] = [
        (Measure::Area, "chord²"),
        (Measure::Thickness, "chord"),
        (Measure::ThicknessX, "chord"),
        (Measure::Camber, "chord"),
        (Measure::CamberX, "chord"),
        (Measure::NoseRadius, "chord"),
        (Measure::TrailingEdgeAngle, "degrees"),
        (Measure::TrailingEdgeGap, "chord"),
        (Measure::Perimeter, "chord"),
        (Measure::Chord, "unit of the coordinates"),
    ];

    /// Measures `section`, which was built from `definition`.
    pub fn new(definition: &SectionDefinition, section: &Section<f64>) -> Self {
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
