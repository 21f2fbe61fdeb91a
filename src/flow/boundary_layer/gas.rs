//! Edge state of the boundary layer: isentropic perfect gas behind the Kármán-Tsien correction.

use crate::flow::panel::forces::KarmanTsien;
use crate::scalar::Scalar;

/// Sutherland's constant over the stagnation temperature (XFOIL).
const SUTHERLAND: f64 = 0.35;
/// γ − 1, ratio of specific heats 1.4.
const GAMMA_MINUS_1: f64 = 0.4;

/// Free stream, as the boundary layer needs it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gas<S> {
    mach2: S,
    reynolds: S,
    correction: KarmanTsien<S>,
}

/// State of the flow at the edge of the layer. Speeds in units of the onset speed, lengths in chords.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Edge<S> {
    /// Compressible speed.
    pub speed: S,
    /// Square of the local Mach number.
    pub mach2: S,
    /// Density over that of the free stream.
    pub density: S,
    /// Reynolds number per chord.
    pub reynolds: S,
}

impl<S: Scalar> Gas<S> {
    pub fn new(mach: S, reynolds: S) -> Self {
        Self { mach2: mach * mach, reynolds, correction: KarmanTsien::new(mach) }
    }

    /// The same gas in another scalar.
    pub fn map<T: Scalar>(&self, f: impl Fn(S) -> T) -> Gas<T> {
        Gas { mach2: f(self.mach2), reynolds: f(self.reynolds), correction: self.correction.map(f) }
    }

    /// Edge state from the incompressible speed of the panels.
    pub fn edge(&self, incompressible: S) -> Edge<S> {
        let speed = self.correction.speed(incompressible);
        let half = 0.5 * GAMMA_MINUS_1;
        let temperature = self.mach2 * (-(speed * speed) + 1.0) * half + 1.0;
        // temperatures over that of stagnation: local and far away
        let far = (self.mach2 * half + 1.0).recip();
        let local = temperature * far;
        let root = temperature.sqrt();
        let viscosity = temperature * root * (far + SUTHERLAND) / (local + SUTHERLAND);
        let density = temperature * temperature * root;
        Edge {
            speed,
            mach2: self.mach2 * speed * speed / temperature,
            density,
            reynolds: density * speed / viscosity * self.reynolds,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_mach_number_nothing_changes() {
        let edge = Gas::new(0.0, 1e6).edge(1.3);
        assert_eq!((edge.speed, edge.mach2, edge.density, edge.reynolds), (1.3, 0.0, 1.0, 1.3e6));
    }

    #[test]
    fn the_free_stream_is_itself() {
        let edge = Gas::new(0.5f64, 3e6).edge(1.0);
        assert!((edge.speed - 1.0).abs() < 1e-15 && (edge.mach2 - 0.25).abs() < 1e-15);
        assert!((edge.density - 1.0).abs() < 1e-15 && (edge.reynolds / 3e6 - 1.0).abs() < 1e-14);
    }

    #[test]
    fn stagnation_is_isentropic() {
        let edge = Gas::new(0.5f64, 3e6).edge(1e-9);
        assert!((edge.density - 1.05f64.powf(2.5)).abs() < 1e-12);
    }
}
