//! Buffers of one evaluation of a design problem.

use crate::design::shape::{Posed, PosedSlope};

/// Buffers of one evaluation.
#[derive(Debug, Clone, Default)]
pub(super) struct Workspace {
    pub values: Vec<f64>,
    pub net: Vec<[f64; 2]>,
    pub points: Vec<[f64; 2]>,
    pub angles: Vec<f64>,
    pub net_slope: Vec<[f64; 2]>,
    pub point_slope: Vec<[f64; 2]>,
    pub angle_slope: Vec<f64>,
}

impl Workspace {
    /// The part of the deformed shape that flows depend on, and its slopes.
    pub fn posed(&mut self) -> (Posed<'_>, PosedSlope<'_>) {
        let slope = PosedSlope { points: &mut self.point_slope, angles: &mut self.angle_slope };
        (Posed { points: &self.points, angles: &self.angles }, slope)
    }
}
