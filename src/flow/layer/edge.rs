//! The state of the flow at the edge of the layer: a perfect gas, isentropic from the free stream.
//!
//! The layer knows the outer flow by [`EdgeLaw`] alone, which turns the unknown of that flow, a positive speed, into
//! the compressible state at the edge.

use crate::scalar::Scalar;

/// Sutherland's constant over the stagnation temperature (value of XFOIL).
const SUTHERLAND: f64 = 0.35;
/// The ratio of specific heats less one, γ − 1, for γ = 1.4.
const GAMMA_MINUS_1: f64 = 0.4;

/// State of the flow at the edge of the layer. Speeds are in units of the onset speed, lengths in chords.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Edge<S> {
    /// Compressible speed.
    pub speed: S,
    /// Square of the local Mach number.
    pub mach2: S,
    /// Density over that of the free stream.
    pub density: S,
    /// Reynolds number at the edge per chord: density times speed over viscosity.
    pub reynolds: S,
}

/// The law by which the unknown of an outer flow at a station, a positive speed, becomes the state at the edge of the
/// layer.
pub(crate) trait EdgeLaw: Copy {
    /// Kind of number the law is evaluated in.
    type Number: Scalar;
    /// The law with the constants in another kind of number.
    type In<S: Scalar>: EdgeLaw<Number = S>;

    /// State at the edge for a value of the outer flow's unknown.
    fn edge(&self, unknown: Self::Number) -> Edge<Self::Number>;

    /// This law with all constants converted by `f`.
    fn map<S: Scalar>(&self, f: impl Fn(Self::Number) -> S) -> Self::In<S>;
}

/// Free stream of a perfect gas. As an [`EdgeLaw`] it suits an outer flow whose unknown is the compressible speed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FreeStream<S> {
    /// Square of the Mach number of the onset flow.
    mach2: S,
    /// Reynolds number on a chord of one.
    reynolds: S,
}

impl<S: Scalar> FreeStream<S> {
    /// A free stream with a Mach number and a Reynolds number of the chord.
    pub fn new(mach: S, reynolds: S) -> Self {
        Self { mach2: mach * mach, reynolds }
    }
}

impl<S: Scalar> EdgeLaw for FreeStream<S> {
    type Number = S;
    type In<T: Scalar> = FreeStream<T>;

    fn edge(&self, speed: S) -> Edge<S> {
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

    fn map<T: Scalar>(&self, f: impl Fn(S) -> T) -> FreeStream<T> {
        FreeStream { mach2: f(self.mach2), reynolds: f(self.reynolds) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_mach_number_nothing_changes() {
        let edge = FreeStream::new(0.0, 1e6).edge(1.3);
        assert_eq!((edge.speed, edge.mach2, edge.density, edge.reynolds), (1.3, 0.0, 1.0, 1.3e6));
    }

    #[test]
    fn the_free_stream_is_itself() {
        let edge = FreeStream::new(0.5f64, 3e6).edge(1.0);
        assert!((edge.speed - 1.0).abs() < 1e-15 && (edge.mach2 - 0.25).abs() < 1e-15);
        assert!((edge.density - 1.0).abs() < 1e-15 && (edge.reynolds / 3e6 - 1.0).abs() < 1e-14);
    }

    #[test]
    fn stagnation_is_isentropic() {
        let edge = FreeStream::new(0.5f64, 3e6).edge(1e-9);
        assert!((edge.density - 1.05f64.powf(2.5)).abs() < 1e-12);
    }
}
