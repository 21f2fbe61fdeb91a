//! A flow about a section as every solver gives it: coefficients, distributions, status, derivatives.

use super::coefficients::{Coefficients, Derivatives, Gradients};
use super::condition::{Condition, Incidence};
use serde::{Deserialize, Serialize};
use std::any::Any;
use std::borrow::Cow;
use std::fmt::Debug;
use std::sync::Arc;

/// Whether a solution is to be trusted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Status {
    /// The residual is below the tolerance and the flow within the model.
    Converged,
    /// The iteration did not come down; the coefficients mean nothing.
    NotConverged {
        /// Largest residual left.
        residual: f64,
    },
    /// Converged, but separated so far that an integral layer with one-parameter profiles no longer describes it.
    Separated {
        /// Length of turbulent reversed flow on the worse side, over the length of the side.
        extent: f64,
    },
    /// Converged, but outside what the outer flow of the solver describes.
    OutsideModel {
        /// What the flow is, in a word: for the panel solver "supersonic".
        name: Cow<'static, str>,
        /// How far it is outside: for the panel solver the highest local Mach number.
        value: f64,
        /// The reason in words, with the value.
        reason: Cow<'static, str>,
    },
}

impl Status {
    /// The status in a word or two, for counting.
    pub fn name(&self) -> &str {
        match self {
            Self::Converged => "converged",
            Self::NotConverged { .. } => "not converged",
            Self::Separated { .. } => "separated",
            Self::OutsideModel { name, .. } => name,
        }
    }
}

impl std::fmt::Display for Status {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Converged => write!(f, "converged"),
            Self::NotConverged { residual } => write!(f, "not converged (residual {residual:.1e})"),
            Self::Separated { extent } => {
                write!(f, "separated beyond the model (turbulent reversed flow over {:.0} % of a side)", 100.0 * extent)
            }
            Self::OutsideModel { name, reason, .. } => write!(f, "{name} {reason}"),
        }
    }
}

/// One attempt of the solver, for the report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Attempt {
    /// What was tried.
    pub what: String,
    /// Newton iterations it took.
    pub iterations: usize,
    /// Largest residual at its end.
    pub residual: f64,
}

impl Attempt {
    pub(super) fn of(what: &str, iterations: usize, residual: f64) -> Self {
        Self { what: what.into(), iterations, residual }
    }
}

/// The flow about a section at one operating point.
///
/// Lengths in chords, speeds in units of the onset speed, coefficients on the chord; moment about the quarter chord,
/// nose-up positive.
#[derive(Debug, Clone)]
pub struct Solution {
    /// Whether the numbers below are to be trusted.
    pub status: Status,
    /// The condition that was asked for.
    pub condition: Condition,
    /// Angle of attack in radians (found, where the lift was given).
    pub alpha: f64,
    /// Coefficients: lift and moment from the surface pressure, drag from the end of the wake (Squire & Young).
    pub coefficients: Coefficients,
    /// Pressure drag: total less friction.
    pub cd_pressure: f64,
    /// Friction drag.
    pub cd_friction: f64,
    /// Stagnation point, x in chords.
    pub stagnation: f64,
    /// Largest residual of all equations.
    pub residual: f64,
    /// Newton iterations of the last attempt.
    pub iterations: usize,
    /// What was tried before, where the direct way failed.
    pub attempts: Vec<Attempt>,
    /// What the solver remembers of the solution.
    pub(super) record: Arc<dyn Record>,
}

/// What a solver remembers of a solution, for derivatives, distributions and warm starts.
pub(super) trait Record: Any + Debug + Send + Sync {
    /// Exact derivatives of the coefficients at fixed angle of attack; `None` where the equations are singular.
    fn gradients(&self) -> Option<Gradients>;

    fn distributions(&self) -> Distributions;
}

/// Derivatives of what a solution reports, with that held which the condition holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeldGradients {
    /// Derivatives of the coefficients.
    pub coefficients: Gradients,
    /// Derivatives of the angle of attack (radians): where the lift is held the angle follows; where the angle is held
    /// all are zero but that by the angle itself.
    pub alpha: Derivatives,
}

/// Flow at one station of the boundary layer or the wake.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StationFlow {
    /// Arc length from the stagnation point; in the wake, from the trailing edge.
    pub s: f64,
    /// x of the station, in chords.
    pub x: f64,
    /// y of the station, in chords.
    pub y: f64,
    /// Edge speed.
    pub edge_velocity: f64,
    /// Pressure coefficient at the edge.
    pub cp: f64,
    /// Momentum thickness θ.
    pub momentum_thickness: f64,
    /// Displacement thickness δ*, in the wake without the dead air.
    pub displacement_thickness: f64,
    /// Kinematic shape parameter.
    pub shape_parameter: f64,
    /// Skin-friction coefficient on the local dynamic pressure.
    pub skin_friction: f64,
    /// Amplification factor; zero where turbulent.
    pub amplification: f64,
    /// Shear-stress coefficient; zero where laminar.
    pub shear_stress: f64,
}

/// Distributions of a solution.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Distributions {
    /// Pressure coefficient at the nodes of the section, in their order.
    pub cp: Vec<f64>,
    /// Pressure coefficient at the nodes without boundary layer.
    pub cp_inviscid: Vec<f64>,
    /// Upper side from the stagnation point to the trailing edge.
    pub upper: Vec<StationFlow>,
    /// Lower side from the stagnation point to the trailing edge.
    pub lower: Vec<StationFlow>,
    /// Wake from the trailing edge.
    pub wake: Vec<StationFlow>,
}

impl Solution {
    /// Whether the status is [`Status::Converged`].
    pub fn is_reliable(&self) -> bool {
        self.status == Status::Converged
    }

    /// Exact derivatives of the coefficients at fixed angle of attack, wake and stagnation point moving.
    ///
    /// `None` where the solution is not converged, so that it has no derivatives. See
    /// [`held_gradients`](Self::held_gradients) for a point at fixed lift.
    pub fn gradients(&self) -> Option<Gradients> {
        match self.status {
            Status::NotConverged { .. } => None,
            _ => self.record.gradients(),
        }
    }

    /// Exact derivatives with that held which the condition holds: the angle of attack, or the lift.
    ///
    /// `None` where the solution is not converged.
    pub fn held_gradients(&self) -> Option<HeldGradients> {
        let at_alpha = self.gradients()?;
        Some(match self.condition.incidence {
            Incidence::Alpha(_) => {
                let still = vec![[0.0; 2]; at_alpha.cl.nodes.len()];
                let alpha = Derivatives { nodes: still, alpha: 1.0, mach: 0.0, reynolds: 0.0 };
                HeldGradients { coefficients: at_alpha, alpha }
            }
            Incidence::Lift(_) => {
                HeldGradients { coefficients: at_alpha.at_fixed_lift(), alpha: at_alpha.alpha_at_fixed_lift() }
            }
        })
    }

    /// Distributions along the surface and the wake, for plots and constraints.
    pub fn distributions(&self) -> Distributions {
        self.record.distributions()
    }
}
