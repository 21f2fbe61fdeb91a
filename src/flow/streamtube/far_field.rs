//! The flow far from the section: onset flow, vortex, source and doublets in linearised compressible flow, and the
//! equations that join the domain to it.

use super::gas::Flow;
use super::kernel::Kernel;
use crate::scalar::{Over, Scalar};
use std::f64::consts::TAU;

/// Place of the vortex on the chord line, in chords.
const VORTEX: f64 = 0.25;
/// Place of source and doublets on the chord line, in chords.
const CENTRE: f64 = 0.5;

/// Strengths of the singularities: circulation (clockwise), doublets along and across the onset flow, source.
pub(super) type Strengths<S> = [S; 4];

/// Velocity at a point in the frame of the chord line, for an angle of attack in radians.
pub(super) fn velocity<S: Over<P>, P: Scalar>(
    [x, y]: [S; 2],
    [circulation, along, across, source]: Strengths<S>,
    alpha: S,
    flow: &Flow<P>,
) -> [S; 2] {
    let beta = flow.stretching;
    let beta2 = beta * beta;
    let (sin, cos) = alpha.sin_cos();
    // coordinates along and across the onset flow, and the reciprocal square of the stretched distance
    let from = |place: f64| {
        let dx = x - place;
        let (a, b) = (dx * cos + y * sin, y * cos - dx * sin);
        (a, b, (a * a + b * b * beta2).recip())
    };
    let (a, b, r) = from(VORTEX);
    let mut u = circulation * b * r * (beta / TAU) + 1.0;
    let mut v = -(circulation * a * r * (beta / TAU));
    let (a, b, r) = from(CENTRE);
    u += source * a * r * (beta * TAU).recip();
    v += source * b * r * (beta / TAU);
    u += along * (r - a * a * r * r * 2.0) - across * a * b * r * r * (beta * 2.0);
    v += across * (r - b * b * r * r * (beta2 * 2.0)) * beta - along * a * b * r * r * (beta2 * 2.0);
    [u * cos - v * sin, u * sin + v * cos]
}

/// Pressure of the far field at a point. Inputs: the point, four strengths, the angle of attack.
pub(super) struct OuterPressure;

impl Kernel<7, 1> for OuterPressure {
    fn evaluate<S: Over<P>, P: Scalar>(&self, x: [S; 7], flow: &Flow<P>) -> [S; 1] {
        let [u, v] = velocity([x[0], x[1]], [x[2], x[3], x[4], x[5]], x[6], flow);
        [flow.isentropic_pressure((u * u + v * v).sqrt())]
    }
}

/// Slope of a line between two stations against that of the far field. Inputs: both points, four strengths, the angle
/// of attack.
pub(super) struct Slope;

impl Kernel<9, 1> for Slope {
    fn evaluate<S: Over<P>, P: Scalar>(&self, x: [S; 9], flow: &Flow<P>) -> [S; 1] {
        let middle = [(x[0] + x[2]) * 0.5, (x[1] + x[3]) * 0.5];
        let [u, v] = velocity(middle, [x[4], x[5], x[6], x[7]], x[8], flow);
        [(x[3] - x[1]) / (x[2] - x[0]) * u - v]
    }
}

/// The projections of the mismatch of an outer line on the upwash of the two doublets, whose sums over both outer lines
/// vanish: the doublets fit the far field to the outer lines by least squares. Inputs as of [`Slope`].
pub(super) struct Mismatch;

impl Kernel<9, 2> for Mismatch {
    fn evaluate<S: Over<P>, P: Scalar>(&self, x: [S; 9], flow: &Flow<P>) -> [S; 2] {
        let middle = [(x[0] + x[2]) * 0.5, (x[1] + x[3]) * 0.5];
        let [u, v] = velocity(middle, [x[4], x[5], x[6], x[7]], x[8], flow);
        let dx = x[2] - x[0];
        let mismatch = (x[3] - x[1]) - v / u * dx;
        let [zero, one] = [0.0, 1.0].map(S::from);
        let upwash = |strengths| velocity(middle, strengths, x[8], flow)[1];
        let still = upwash([zero; 4]);
        [[zero, one, zero, zero], [zero, zero, one, zero]].map(|unit| mismatch * (upwash(unit) - still))
    }
}

#[cfg(test)]
mod tests {
    use super::super::gas::Parameters;
    use super::*;
    use crate::differentiate::Tangent;

    #[test]
    fn the_singularities_satisfy_the_linearised_equations() {
        let mach: f64 = 0.6;
        let parameters = Parameters { mach, reynolds: 1e6, incidence: 0.0, strength: 1.0, threshold: 0.98, order: 1.0 };
        let flow = Flow::new(&parameters);
        type T = Tangent<2>;
        for k in 0..4 {
            let strengths = std::array::from_fn(|q| T::from(if q == k { 0.3 } else { 0.0 }));
            // (1 − M²) ∂u/∂x + ∂v/∂y = 0 and ∂u/∂y = ∂v/∂x in the axes of the onset flow
            let at = [T::from(1.7).derivative(0), T::from(-0.8).derivative(1)];
            let [u, v] = velocity(at, strengths, T::from(0.0), &flow);
            let divergence = (1.0 - mach * mach) * u.eps[0] + v.eps[1];
            assert!(divergence.abs() < 1e-15, "{k}: {divergence}");
            assert!((u.eps[1] - v.eps[0]).abs() < 1e-15, "{k}");
        }
    }

    #[test]
    fn the_field_turns_with_the_onset_flow() {
        let parameters =
            Parameters { mach: 0.5, reynolds: 1e6, incidence: 0.0, strength: 1.0, threshold: 0.98, order: 1.0 };
        let [u, v] = velocity([5.0f64, 2.0], [0.0; 4], 0.1, &Flow::new(&parameters));
        assert!((u - 0.1f64.cos()).abs() < 1e-15 && (v - 0.1f64.sin()).abs() < 1e-15);
        // a clockwise vortex lifts: downwash behind, upwash ahead
        let wash = |x: f64| velocity([x, 0.0], [0.5, 0.0, 0.0, 0.0], 0.0, &Flow::new(&parameters))[1];
        assert!(wash(3.0) < 0.0 && wash(-3.0) > 0.0);
    }
}
