//! The operating point of a flow, and the resolution and limits of a flow solver.

use super::FlowError;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// The quantity that an operating point prescribes: the angle of attack or the lift coefficient.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Incidence {
    /// Angle of attack against the x axis of the coordinates in radians.
    Alpha(f64),
    /// Lift coefficient on the chord of the section; the solver finds the angle of attack that gives it.
    Lift(f64),
}

/// An operating point: incidence, Mach and Reynolds number, and how transition comes about.
///
/// ```
/// use aeroform::flow::{Condition, Incidence};
/// let tripped = Condition { trips: [Some(0.05), Some(0.05)], ..Condition::new(Incidence::Alpha(0.07), 5e6) };
/// assert_eq!((tripped.mach, tripped.n_critical), (0.0, 9.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Condition {
    /// The angle of attack or the lift coefficient that is prescribed.
    pub incidence: Incidence,
    /// Mach number of the onset flow, at least 0. Each solver has an upper limit of its own (0.95 for the panel
    /// solver).
    pub mach: f64,
    /// Reynolds number of the chord of the section, from 1e3 to 1e10.
    pub reynolds: f64,
    /// Amplification factor n at which the laminar layer breaks down, from 0.1 to 30. A value of 9 stands for a quiet
    /// wind tunnel.
    pub n_critical: f64,
    /// Trip strips on the upper and on the lower side: x along the chord line in chords, above 0 and at most
    /// 1. Transition stands at the strip at the latest; `None` leaves it free.
    pub trips: [Option<f64>; 2],
}

impl Condition {
    /// Incompressible flow (Mach number 0) with free transition at an amplification factor of 9.
    pub fn new(incidence: Incidence, reynolds: f64) -> Self {
        Self { incidence, mach: 0.0, reynolds, n_critical: 9.0, trips: [None, None] }
    }

    /// Checks the ranges that hold for every solver.
    ///
    /// # Errors
    /// [`FlowError::Condition`] for the first number out of range.
    pub(crate) fn check(&self) -> Result<(), FlowError> {
        let check = |name, value: f64, ok: bool, allowed| {
            if ok { Ok(()) } else { Err(FlowError::Condition { name, value, allowed }) }
        };
        let (name, value, limit, allowed) = match self.incidence {
            // sections may stand at any angle; solvers check that against the chord line
            Incidence::Alpha(alpha) => ("angle of attack (degrees)", alpha.to_degrees(), 360.0, "from -360 to 360"),
            Incidence::Lift(lift) => ("lift coefficient", lift, 5.0, "from -5 to 5"),
        };
        check(name, value, value.abs() <= limit, allowed)?;
        check("Mach number", self.mach, self.mach.is_finite() && self.mach >= 0.0, "finite, at least 0")?;
        check("Reynolds number", self.reynolds, (1e3..=1e10).contains(&self.reynolds), "from 1e3 to 1e10")?;
        let n = self.n_critical;
        check("critical amplification factor", n, (0.1..=30.0).contains(&n), "from 0.1 to 30")?;
        for trip in self.trips.into_iter().flatten() {
            check("trip position (chords)", trip, trip > 0.0 && trip <= 1.0, "above 0, at most 1")?;
        }
        Ok(())
    }
}

/// Resolution and limits of a flow solver.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Number of boundary-layer stations on each side from the stagnation point to transition, from 8 to 1000.
    pub laminar_stations: usize,
    /// Number of boundary-layer stations on each side from transition to the trailing edge, from 8 to 1000.
    pub turbulent_stations: usize,
    /// Largest residual of a converged solution, without dimension, from 1e-13 to 1e-3.
    pub tolerance: f64,
    /// Largest number of Newton iterations of one attempt.
    pub iterations: usize,
    /// Whether the solver starts from easier conditions where the direct attempt fails.
    pub retry: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { laminar_stations: 80, turbulent_stations: 48, tolerance: 1e-10, iterations: 40, retry: true }
    }
}

/// Numbers of boundary-layer stations on each side that commands and cases may ask for. The equations that are left of the
/// stations are dense.
pub(crate) const STATIONS_PER_SIDE: RangeInclusive<usize> = 32..=1000;

impl Settings {
    /// Number of boundary-layer stations on each side.
    pub(crate) fn stations_per_side(&self) -> usize {
        self.laminar_stations + self.turbulent_stations
    }

    /// These settings with a number of boundary-layer stations on each side, five eighths of them laminar as by default
    /// (80 of 128).
    pub fn with_stations(self, per_side: usize) -> Self {
        let laminar_stations = (5 * per_side).div_ceil(8);
        Self { laminar_stations, turbulent_stations: per_side - laminar_stations, ..self }
    }

    pub(crate) fn check(&self) -> Result<(), FlowError> {
        for (name, value) in [
            ("number of laminar stations", self.laminar_stations),
            ("number of turbulent stations", self.turbulent_stations),
        ] {
            if !(8..=1000).contains(&value) {
                return Err(FlowError::Condition { name, value: value as f64, allowed: "from 8 to 1000" });
            }
        }
        if !(self.tolerance >= 1e-13 && self.tolerance <= 1e-3) {
            return Err(FlowError::Condition {
                name: "tolerance",
                value: self.tolerance,
                allowed: "from 1e-13 to 1e-3",
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_out_of_range_are_named() {
        let good = Condition::new(Incidence::Alpha(0.1), 1e6);
        assert!(good.check().is_ok());
        let name = |c: Condition| match c.check() {
            Err(FlowError::Condition { name, .. }) => name,
            _ => "",
        };
        assert_eq!(name(Condition { mach: -0.1, ..good }), "Mach number");
        assert_eq!(name(Condition { mach: f64::NAN, ..good }), "Mach number");
        assert_eq!(name(Condition { reynolds: 0.0, ..good }), "Reynolds number");
        assert_eq!(name(Condition { trips: [None, Some(0.0)], ..good }), "trip position (chords)");
        assert_eq!(name(Condition { incidence: Incidence::Alpha(7.0), ..good }), "angle of attack (degrees)");
        let default = Settings::default();
        assert_eq!(Settings { laminar_stations: 9, ..default }.with_stations(128), default);
        assert!(Settings { laminar_stations: 2, ..Settings::default() }.check().is_err());
    }
}
