//! Curvature reversals.

use crate::section::Section;

impl Section<f64> {
    /// How often the curvature changes its sign on the upper and on the lower surface.
    ///
    /// Curvatures below `threshold` (per unit of length; 0.01 is sensible for a chord of one) count as straight: only
    /// bends beyond it, one way and then the other, make a reversal. A number to judge shapes by, not differentiable.
    pub fn curvature_reversals(&self, threshold: f64) -> [usize; 2] {
        let mut counts = [0; 2];
        let mut last_sign = [0.0; 2];
        for u in super::dense_parameters(self.curve()) {
            let side = usize::from(u > self.nose_parameter());
            let d = self.curve().derivatives(u, 2);
            let speed = super::frame::length(d[1]);
            let curvature = (d[1][0] * d[2][1] - d[1][1] * d[2][0]) / speed.powi(3);
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
