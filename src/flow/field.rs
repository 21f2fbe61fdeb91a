//! The field of a flow about a section, for figures. This module depends on nothing else in the crate.

use serde::{Deserialize, Serialize};

/// The flow in the region about a section: one block above the dividing streamline and one below it.
///
/// Lengths are in chords, in the frame with the nose at (0, 0) and the middle of the trailing edge at (1, 0). The flow
/// includes the displacement by the boundary layer, so that the blocks begin at the edge of the layer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FlowField {
    /// The flow above the dividing streamline.
    pub upper: FieldBlock,
    /// The flow below the dividing streamline.
    pub lower: FieldBlock,
}

/// Points of a flow in columns and rows. Columns stand across the flow and follow each other downstream; rows follow the
/// streamlines, and the first row is the dividing streamline, which includes the wall of the section.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FieldBlock {
    /// The points, column by column, from the dividing streamline outwards.
    pub points: Vec<Vec<[f64; 2]>>,
    /// Local Mach number at each of the points.
    pub mach: Vec<Vec<f64>>,
}
