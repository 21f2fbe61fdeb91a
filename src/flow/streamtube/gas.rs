//! The gas and the numbers that the equations share: a perfect gas in units of the onset flow.
//!
//! Density and speed of the onset flow and the chord are one. The total enthalpy is that of the onset flow in every
//! tube, so that the speed alone gives the temperature.

use crate::flow::layer::{EdgeLaw, FreeStream};
use crate::scalar::{Over, Scalar};

/// Ratio of specific heats.
pub(super) const GAMMA: f64 = 1.4;
/// The ratio (γ − 1)/γ by which density times enthalpy gives the pressure.
const PRESSURE: f64 = (GAMMA - 1.0) / GAMMA;

/// The numbers by which a flow is asked for, in any kind of number, so that it can be followed from one flow to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Parameters<P = f64> {
    /// Mach number of the onset flow.
    pub mach: P,
    /// Reynolds number of the chord.
    pub reynolds: P,
    /// Angle of attack against the chord line in radians, or the lift coefficient, whichever is held.
    pub incidence: P,
    /// Strength of the numerical dissipation in supersonic flow.
    pub strength: P,
    /// Local Mach number from which on there is dissipation.
    pub threshold: P,
    /// Share of the second-order part of the upwinding: 0 is first order, 1 second order.
    pub order: P,
}

impl<P: Scalar> Parameters<P> {
    /// The numbers in the order of the fields.
    pub fn numbers(&self) -> [P; 6] {
        [self.mach, self.reynolds, self.incidence, self.strength, self.threshold, self.order]
    }

    /// Parameters from numbers in the order of the fields.
    pub fn from_numbers([mach, reynolds, incidence, strength, threshold, order]: [P; 6]) -> Self {
        Self { mach, reynolds, incidence, strength, threshold, order }
    }

    /// These parameters with all numbers converted by `f`.
    pub fn map<T: Scalar>(&self, f: impl FnMut(P) -> T) -> Parameters<T> {
        Parameters::from_numbers(self.numbers().map(f))
    }
}

/// Gas, free stream and dissipation of a flow, ready for the kernels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Flow<P> {
    /// Total enthalpy.
    pub total_enthalpy: P,
    /// Static pressure of the onset flow.
    pub static_pressure: P,
    /// Square of the Mach number of the onset flow.
    pub mach2: P,
    /// Root of 1 − M² of the onset flow, by which the far field is stretched.
    pub stretching: P,
    /// Held angle or lift coefficient.
    pub incidence: P,
    /// Factor of the softened dissipation, with the strength in it.
    pub upwinding: P,
    /// One less the square of the Mach number at which dissipation begins.
    pub margin: P,
    /// Share of the second-order part of the upwinding.
    pub order: P,
    /// Free stream as the boundary layer sees it.
    pub stream: FreeStream<P>,
}

impl<P: Scalar> Flow<P> {
    pub fn new(parameters: &Parameters<P>) -> Self {
        let mach2 = parameters.mach * parameters.mach;
        let margin = -(parameters.threshold * parameters.threshold) + 1.0;
        Self {
            total_enthalpy: (mach2 * (GAMMA - 1.0)).recip() + 0.5,
            static_pressure: (mach2 * GAMMA).recip(),
            mach2,
            stretching: (-mach2 + 1.0).sqrt(),
            incidence: parameters.incidence,
            upwinding: parameters.strength * margin / GAMMA,
            margin,
            order: parameters.order,
            stream: FreeStream::new(parameters.mach, parameters.reynolds),
        }
    }

    /// The free stream in the numbers of a kernel.
    #[inline(always)]
    pub fn stream_in<S: Over<P>>(&self) -> FreeStream<S> {
        self.stream.map(|p| S::from(0.0) + p)
    }

    /// Static enthalpy at a speed.
    #[inline(always)]
    pub fn enthalpy<S: Over<P>>(&self, speed: S) -> S {
        -(speed * speed) * 0.5 + self.total_enthalpy
    }

    /// Pressure of a density at a speed.
    #[inline(always)]
    pub fn pressure<S: Over<P>>(&self, density: S, speed: S) -> S {
        density * self.enthalpy(speed) * PRESSURE
    }

    /// Square of the local Mach number at a speed.
    #[inline(always)]
    pub fn mach2<S: Over<P>>(&self, speed: S) -> S {
        speed * speed / (self.enthalpy(speed) * (GAMMA - 1.0))
    }

    /// Logarithm of the total pressure of a pressure at a speed, up to a constant.
    #[inline(always)]
    pub fn log_total_pressure<S: Over<P>>(&self, pressure: S, speed: S) -> S {
        pressure.ln() - self.enthalpy(speed).ln() * PRESSURE.recip()
    }

    /// Pressure at a speed without losses.
    pub fn isentropic_pressure<S: Over<P>>(&self, speed: S) -> S {
        let far = self.total_enthalpy - 0.5;
        (self.enthalpy(speed) / far).powf(PRESSURE.recip()) * self.static_pressure
    }

    /// Speed and reciprocal of density times speed of a tube with the mass flow `mass`, expanded without further losses
    /// to the pressure of the onset flow from the speed at which the tube has the area `area`.
    pub fn expanded<S: Over<P>>(&self, speed: S, area: S, mass: f64) -> (S, S) {
        let pressure = self.pressure((speed * area).recip() * mass, speed);
        let enthalpy = self.enthalpy(speed) * ((pressure.recip() * self.static_pressure).ln() * PRESSURE).exp();
        let expanded = ((-enthalpy + self.total_enthalpy) * 2.0).sqrt();
        let density = enthalpy.recip() * self.static_pressure * PRESSURE.recip();
        (expanded, (density * expanded).recip())
    }

    /// Pressure coefficient of a pressure.
    #[inline(always)]
    pub fn coefficient<S: Over<P>>(&self, pressure: S) -> S {
        (pressure - self.static_pressure) * 2.0
    }
}

impl Flow<f64> {
    /// Subsonic speed without losses for density times speed, limited to the local Mach number `cap`.
    pub fn subsonic_speed(&self, flux: f64, cap: f64) -> f64 {
        let half = 0.5 * (GAMMA - 1.0) * cap * cap;
        let highest = (2.0 * self.total_enthalpy * half / (1.0 + half)).sqrt();
        let flux_at = |q: f64| {
            let ratio: f64 = self.enthalpy::<f64>(q) / (self.total_enthalpy - 0.5);
            q * ratio.powf(1.0 / (GAMMA - 1.0))
        };
        // written so that NaN gives the limit
        if !(flux < flux_at(highest)) {
            return highest;
        }
        let (mut low, mut high) = (0.0, highest);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if flux_at(middle) > flux { high = middle } else { low = middle }
        }
        0.5 * (low + high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(crate) fn flow(mach: f64) -> Flow<f64> {
        let parameters = Parameters { mach, reynolds: 1e6, incidence: 0.0, strength: 1.0, threshold: 0.98, order: 1.0 };
        Flow::new(&parameters)
    }

    #[test]
    fn the_onset_flow_is_itself() {
        let flow = flow(0.7);
        assert!((flow.pressure(1.0, 1.0) - flow.static_pressure).abs() < 1e-14);
        assert!((flow.mach2(1.0f64) - 0.49).abs() < 1e-14);
        assert!((flow.isentropic_pressure(1.0f64) - flow.static_pressure).abs() < 1e-14);
        assert!((flow.subsonic_speed(1.0, 0.9) - 1.0).abs() < 1e-12);
        let (speed, volume) = flow.expanded(1.0, 0.3, 0.3);
        assert!((speed - 1.0f64).abs() < 1e-14 && (volume - 1.0f64).abs() < 1e-14);
    }

    #[test]
    fn stagnation_pressure_follows_the_isentropic_law() {
        let flow = flow(0.7);
        let ratio: f64 = flow.isentropic_pressure(0.0) / flow.static_pressure;
        assert!((ratio - (1.0 + 0.2 * 0.49f64).powf(3.5)).abs() < 1e-13);
        assert!(
            (flow.subsonic_speed(9.0, 0.9) - {
                let (cap, total): (f64, f64) = (0.9, flow.total_enthalpy);
                (2.0 * total * 0.2 * cap * cap / (1.0 + 0.2 * cap * cap)).sqrt()
            })
            .abs()
                < 1e-14
        );
    }
}
