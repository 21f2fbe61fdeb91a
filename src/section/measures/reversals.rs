//! Curvature reversals.

use super::sampling::dense_parameters;
use crate::plane::{cross, dot, length};
use crate::scalar::Scalar;
use crate::section::{MeasureProblem, Section, SectionError};
use crate::spline::GaussRule;

/// Curvature, per chord, from which on a concave part counts with its full turning.
const STRAIGHT: f64 = 0.1;

impl<S: Scalar> Section<S> {
    /// Angle in radians by which the concave parts of the outline turn: the smooth measure of curvature reversals.
    ///
    /// `∫ k²/√(k² + 0.1²) ds/c` over the parts where the curvature times the chord `k = κ c` is negative (surface
    /// bending away from the section, as under a rear-loaded edge), Gauss quadrature on each knot span. Zero for a
    /// convex section. Value and gradient are continuous in the shape; second derivatives jump where a curvature passes
    /// zero.
    ///
    /// # Errors
    /// A chord of no length; a curve that stands still.
    pub fn concavity(&self) -> Result<S, SectionError> {
        let chord = self.chord_frame()?.chord;
        let curve = self.curve();
        let rule = GaussRule::new(2 * curve.degree() + 2);
        let mut sum = S::from(0.0);
        for (_, start, end) in curve.knots().spans() {
            for (u, weight) in rule.on(start, end) {
                let d = curve.derivatives(S::from(u), 2);
                let squared = dot(d[1], d[1]);
                let speed = squared.sqrt();
                let bending = cross(d[1], d[2]) / (squared * speed) * chord;
                if bending.re() >= 0.0 {
                    continue;
                }
                let share = bending * bending / (bending * bending + STRAIGHT * STRAIGHT).sqrt();
                sum += share * speed / chord * weight;
            }
        }
        if sum.re().is_finite() {
            Ok(sum)
        } else {
            Err(SectionError::NoMeasure { measure: "concavity", reason: MeasureProblem::Singular })
        }
    }
}

impl Section<f64> {
    /// How often the curvature changes its sign on the upper and on the lower surface.
    ///
    /// Curvatures below `threshold` (per unit of length; 0.01 is sensible for a chord of one) count as straight: only
    /// bends beyond it, one way and then the other, make a reversal. A number to judge shapes by, not differentiable.
    pub fn curvature_reversals(&self, threshold: f64) -> [usize; 2] {
        let mut counts = [0; 2];
        let mut last_sign = [0.0; 2];
        for u in dense_parameters(self.curve()) {
            let side = usize::from(u > self.nose_parameter());
            let d = self.curve().derivatives(u, 2);
            let curvature = cross(d[1], d[2]) / length(d[1]).powi(3);
            if curvature.abs() > threshold {
                let sign = curvature.signum();
                if sign * last_sign[side] < 0.0 {
                    counts[side] += 1;
                }
                last_sign[side] = sign;
            }
        }
        counts
    }
}

#[cfg(test)]
mod tests {
    use crate::section::{Section, SectionDefinition};

    fn section(name: &str) -> Section<f64> {
        SectionDefinition::parse(name).unwrap().section().unwrap()
    }

    #[test]
    fn convex_sections_have_no_concavity_and_rear_loaded_ones_their_turning() {
        assert_eq!(section("kulfan:upper=0.17,0.17,0.17,0.17/lower=-0.17,-0.17,-0.17,-0.17").concavity().unwrap(), 0.0);
        // the lower surface of a rear-loaded section turns back by about the angle between its steepest place and the
        // edge
        let loaded = section("kulfan:upper=0.17,0.17,0.17,0.17/lower=-0.17,-0.17,-0.17,0.2");
        let curve = loaded.curve();
        let lower = (0..=4000)
            .map(|k| curve.tangent_at(loaded.nose_parameter() + (1.0 - loaded.nose_parameter()) * k as f64 / 4000.0));
        let slopes: Vec<f64> = lower.filter(|t| t[0] > 0.0).map(|t| t[1].atan2(t[0])).collect();
        // turned forwards less turned backwards is what the ends differ by; the backward part is a sum of falls
        let falls: f64 = slopes.windows(2).map(|w| (w[0] - w[1]).max(0.0)).sum();
        let concavity = loaded.concavity().unwrap();
        assert!(falls > 0.1 && (concavity / falls - 1.0).abs() < 0.1, "{concavity} {falls}");
    }
}
