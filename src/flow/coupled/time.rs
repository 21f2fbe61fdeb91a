//! Time terms of the boundary layer: damping of the Newton step that follows the physics.
//!
//! The unsteady integral equations of momentum, ∂(u δ*)/∂t + ∂(u² θ)/∂x + u δ* ∂u/∂x = u² cf/2, and of kinetic energy,
//! ∂(u² (δ* + θ))/∂t − 2 u δ* ∂u/∂t + ∂(u³ θ*)/∂x = 2 CD u³, in the logarithmic form of the interval equations, with
//! one implicit Euler step of length C Δx/u. A large Courant number C is Newton's method; a moderate one lets the layer
//! change no faster than it would in time, so that separated layers find the solution that is stable.

use super::duals::{Dual8, dual, gradient};
use super::system::Linearised;
use super::transport::{Profiles, lengths};
use super::unknowns::{Side, Unknowns};
use crate::flow::boundary_layer::station::Regime;

/// Derivatives of the time terms with respect to the change of (ln θ, ln(Hk − 1), third, ln u), over Δx/u.
fn rates(shape: f64, energy_shape: f64, regime: Regime) -> [[f64; 4]; 3] {
    let (h, inverse) = (shape, energy_shape.recip());
    // d H = (H − 1) d ln(H − 1)
    let by_shape = h - 1.0;
    [
        [h, by_shape, 0.0, h],
        [(1.0 + h) * inverse - h, (inverse - 1.0) * by_shape, 0.0, 2.0 * inverse - h],
        // the lag equation is written with the stress falling
        [0.0, 0.0, if regime == Regime::Laminar { 1.0 } else { -1.0 }, 0.0],
    ]
}

impl Linearised {
    /// Adds the time terms of Courant number 1/`share` to the Jacobian. The residuals stay: the step starts from rest.
    pub fn add_time_terms(&mut self, unknowns: &Unknowns, profiles: &Profiles, total: f64, share: f64) {
        let numbering = self.numbering;
        for k in 0..numbering.stations() {
            if k == numbering.wake_start() {
                continue; // no interval ends there
            }
            let d = &self.derived[k];
            let terms = rates(d.shape.re, d.energy_shape.re, numbering.regime(k)).map(|row| row.map(|v| v * share));
            let block = &mut self.blocks[k];
            for i in 0..3 {
                for c in 0..4 {
                    block.own[i][c] += terms[i][c];
                }
            }
            if let Some((side, j)) = numbering.on_side(k) {
                // the change that counts is that at a fixed place
                let x = &self.positions.abscissas[side.index()][j];
                let (slope, by_globals) = (profiles.slope(k), gradient(x).map(|g| g / x.re));
                for i in 0..3 {
                    let along: f64 = (0..4).map(|c| terms[i][c] * slope[c]).sum();
                    for g in 0..3 {
                        block.globals[i][g] -= along * by_globals[g];
                    }
                }
            }
        }
        let lengths = lengths(unknowns, total);
        for side in Side::BOTH {
            let at = side.index();
            let mut slopes = gradient(&self.transition[at]);
            slopes[1 + at] -= share / lengths[at];
            let damped: Dual8 = dual(self.transition[at].re, slopes);
            self.transition[at] = damped;
        }
    }
}
