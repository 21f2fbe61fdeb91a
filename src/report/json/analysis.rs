//! Flows about a section.

use crate::flow::{Attempt, InviscidSolution, Solution};
use serde::Serialize;

/// A viscous flow; the coefficients of a flow whose status says that its numbers do not hold are `None`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AnalysisReport {
    /// Whether the numbers hold.
    pub converged: bool,
    /// The status in words.
    pub status: String,
    /// Largest residual of the equations.
    pub residual: f64,
    /// Newton iterations.
    pub iterations: usize,
    /// Attempts before the one that gave the solution.
    pub attempts: Vec<Attempt>,
    /// Angle of attack in degrees.
    pub alpha: f64,
    /// Mach number.
    pub mach: f64,
    /// Reynolds number of the chord.
    pub reynolds: f64,
    /// Lift coefficient.
    pub cl: Option<f64>,
    /// Drag coefficient.
    pub cd: Option<f64>,
    /// Drag coefficient of the pressure.
    pub cd_pressure: Option<f64>,
    /// Drag coefficient of the friction.
    pub cd_friction: Option<f64>,
    /// Moment coefficient about the quarter chord, nose-up positive.
    pub cm: Option<f64>,
    /// Transition on the upper side, x in chords.
    pub transition_upper: Option<f64>,
    /// Transition on the lower side, x in chords.
    pub transition_lower: Option<f64>,
    /// Lowest pressure coefficient.
    pub cp_min: Option<f64>,
    /// Wall-clock time in seconds.
    pub seconds: f64,
}

impl AnalysisReport {
    /// The report of a flow that took `seconds`.
    pub fn new(solution: &Solution, seconds: f64) -> Self {
        let condition = solution.condition;
        let reliable = solution.is_reliable();
        let number = |value: f64| reliable.then_some(value);
        Self {
            converged: reliable,
            status: solution.status.to_string(),
            residual: solution.residual,
            iterations: solution.iterations,
            attempts: solution.attempts.clone(),
            alpha: solution.alpha.to_degrees(),
            mach: condition.mach,
            reynolds: condition.reynolds,
            cl: number(solution.coefficients.cl),
            cd: number(solution.coefficients.cd),
            cd_pressure: number(solution.cd_pressure),
            cd_friction: number(solution.cd_friction),
            cm: number(solution.coefficients.cm),
            transition_upper: number(solution.coefficients.transition[0]),
            transition_lower: number(solution.coefficients.transition[1]),
            cp_min: number(solution.coefficients.cp_min),
            seconds,
        }
    }
}

/// A flow without boundary layer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InviscidReport {
    /// Always `true`: the equations are linear.
    pub converged: bool,
    /// Angle of attack in degrees.
    pub alpha: f64,
    /// Mach number.
    pub mach: f64,
    /// Lift coefficient.
    pub cl: f64,
    /// Moment coefficient about the quarter chord, nose-up positive.
    pub cm: f64,
    /// Lowest pressure coefficient.
    pub cp_min: f64,
    /// Wall-clock time in seconds.
    pub seconds: f64,
}

impl InviscidReport {
    /// The report of a flow at a Mach number that took `seconds`.
    pub fn new(solution: &InviscidSolution, mach: f64, seconds: f64) -> Self {
        let InviscidSolution { cl, cm, cp_min, .. } = *solution;
        Self { converged: true, alpha: solution.alpha.to_degrees(), mach, cl, cm, cp_min, seconds }
    }
}

/// A sweep of the angle of attack.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PolarReport {
    /// The section, as it was asked for.
    pub section: String,
    /// One flow per angle of attack.
    pub points: Vec<AnalysisReport>,
}
