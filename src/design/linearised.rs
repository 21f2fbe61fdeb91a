//! A shape with its derivatives, kept as the sparse maps they are.

use super::shape::Shape;
use crate::ffd::LinearMap;
use std::ops::Range;

/// The derivative of a shape with respect to one variable: of every control point.
#[derive(Debug, Clone)]
pub(super) struct Tangent {
    pub section: Vec<[f64; 2]>,
    pub net: Vec<[f64; 2]>,
}

/// A shape with its derivative with respect to every variable, in the variables' own units.
///
/// Each movement of a control point of the box reaches few points of the section, so these derivatives are sparse: a
/// box of 100 × 100 control points has 20 000 variables, and a table of variables by control points would fill
/// gigabytes.
#[derive(Debug, Clone)]
pub struct LinearisedShape {
    /// The shape at the given variables.
    pub shape: Shape<f64>,
    /// For each section parameter among the variables, which come first; angles of attack come last and move nothing.
    parameters: Vec<Tangent>,
    /// Displacement components of the net (2 × control point + axis) → motion variables.
    motion: LinearMap,
    /// Control points of the section → control points of the net.
    weights: LinearMap,
}

impl LinearisedShape {
    /// From the derivatives in the section parameters and the maps from variables to the net and on to the section.
    pub(super) fn new(shape: Shape<f64>, parameters: Vec<Tangent>, motion: &LinearMap, weights: &LinearMap) -> Self {
        Self { shape, parameters, motion: motion.transposed(), weights: weights.transposed() }
    }

    /// Number of variables.
    pub fn variables(&self) -> usize {
        self.parameters.len() + self.motion.outputs() + self.shape.angles.len()
    }

    /// The derivative of every control point of the section with respect to a variable, by its position; zero for an
    /// angle of attack, `None` beyond the last variable.
    pub fn section_tangent(&self, variable: usize) -> Option<Vec<[f64; 2]>> {
        if let Some(tangent) = self.parameters.get(variable) {
            return Some(tangent.section.clone());
        }
        let mut tangent = vec![[0.0; 2]; self.shape.section.curve().control_points().len()];
        for (component, coefficient) in self.moved(variable)? {
            for (point, weight) in self.weights.row(component / 2) {
                tangent[point][component % 2] += coefficient * weight;
            }
        }
        Some(tangent)
    }

    /// The derivative of every control point of the box with respect to a variable, by its position; zero for an angle
    /// of attack, `None` beyond the last variable.
    pub fn net_tangent(&self, variable: usize) -> Option<Vec<[f64; 2]>> {
        if let Some(tangent) = self.parameters.get(variable) {
            return Some(tangent.net.clone());
        }
        let mut tangent = vec![[0.0; 2]; self.shape.net.len()];
        for (component, coefficient) in self.moved(variable)? {
            tangent[component / 2][component % 2] += coefficient;
        }
        Some(tangent)
    }

    /// Components of the net that a variable of motion or an angle moves.
    fn moved(&self, variable: usize) -> Option<impl Iterator<Item = (usize, f64)> + '_> {
        let row = variable.checked_sub(self.parameters.len()).filter(|_| variable < self.variables())?;
        let motion = (row < self.motion.outputs()).then(|| self.motion.row(row));
        Some(motion.into_iter().flatten())
    }

    /// Which angle of attack a variable is, by its position among them.
    pub(super) fn angle(&self, variable: usize) -> Option<usize> {
        variable.checked_sub(self.parameters.len() + self.motion.outputs())
    }

    /// Derivatives of the section's control points for a range of variables.
    pub(super) fn section_tangents(&self, variables: Range<usize>) -> Vec<Vec<[f64; 2]>> {
        variables.filter_map(|variable| self.section_tangent(variable)).collect()
    }

    /// Carries slopes in the control points of section and net and in the angles of attack (per radian) back to the
    /// variables; those of the net are used up.
    pub(super) fn pull_back(
        &self,
        section_slope: &[[f64; 2]],
        net_slope: &mut [[f64; 2]],
        angle_slope: &[f64],
    ) -> Vec<f64> {
        let dot =
            |a: &[[f64; 2]], b: &[[f64; 2]]| -> f64 { a.iter().zip(b).map(|(a, b)| a[0] * b[0] + a[1] * b[1]).sum() };
        let mut gradient: Vec<f64> = (self.parameters.iter())
            .map(|tangent| dot(section_slope, &tangent.section) + dot(net_slope, &tangent.net))
            .collect();
        self.weights.add_to(section_slope, net_slope);
        for variable in 0..self.motion.outputs() {
            let slopes = self.motion.row(variable).map(|(component, c)| net_slope[component / 2][component % 2] * c);
            gradient.push(slopes.fold(0.0, |sum, slope| sum + slope));
        }
        gradient.extend(angle_slope.iter().map(|slope| slope * 1f64.to_radians()));
        gradient
    }
}
