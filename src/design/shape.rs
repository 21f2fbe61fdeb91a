//! [`Shape`]: what a design looks like.

use crate::scalar::Scalar;
use crate::section::Section;

/// A deformed section with the control net that made it.
#[derive(Debug, Clone)]
pub struct Shape<S = f64> {
    /// The deformed section.
    pub section: Section<S>,
    /// The deformed control net of the box, first direction (x) fastest; empty where there is none.
    pub net: Vec<[S; 2]>,
    /// Angles of attack that are design variables, in radians and in the order of the variables; empty where every
    /// operating point prescribes its angle or its lift.
    pub angles: Vec<S>,
}

impl<S: Scalar> Shape<S> {
    /// The part that flows depend on.
    pub(super) fn posed(&self) -> Posed<'_, S> {
        Posed { points: self.section.curve().control_points(), angles: &self.angles }
    }
}

/// The part of a shape that flows depend on: the control points of its section, and the angles of attack in radians that
/// are design variables.
#[derive(Debug, Clone, Copy)]
pub(super) struct Posed<'a, S = f64> {
    pub points: &'a [[S; 2]],
    pub angles: &'a [S],
}

/// Derivatives with respect to all numbers of a [`Posed`]; no derivatives are wanted where `points` is empty.
#[derive(Debug)]
pub(super) struct PosedSlope<'a> {
    pub points: &'a mut [[f64; 2]],
    pub angles: &'a mut [f64],
}

impl PosedSlope<'_> {
    pub fn is_wanted(&self) -> bool {
        !self.points.is_empty()
    }
}
