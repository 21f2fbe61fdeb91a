//! A flow about a section as every solver gives it: coefficients, distributions, status, derivatives.

use super::FlowError;
use super::coefficients::{Coefficients, Derivatives, Gradients};
use super::condition::{Condition, Incidence};
use crate::scalar::Scalar;
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

    /// The nodes of the section as they were given.
    fn nodes(&self) -> &[[f64; 2]];
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

    /// The coefficients over any scalar that carries first derivatives at most: `nodes` are those of the solution, in
    /// chords, with whatever derivatives they have. What the condition holds is held: the angle of attack, or the lift.
    ///
    /// ```
    /// use aeroform::flow::{Condition, Incidence, Settings, TrailingEdge, analyze, panel_parameters};
    /// use aeroform::section::SectionDefinition;
    /// use num_dual::Dual64;
    /// let section = SectionDefinition::parse("naca2412")?.section()?;
    /// let at = |u: f64| section.curve().point_at(u);
    /// let nodes: Vec<[f64; 2]> = panel_parameters(&section, 121).into_iter().map(at).collect();
    /// let condition = Condition::new(Incidence::Alpha(0.03), 3e6);
    /// let solution = analyze(&nodes, TrailingEdge::Blunt, &condition, &Settings::default(), None)?;
    /// // all of the section grows thicker about the x axis
    /// let thicker: Vec<[Dual64; 2]> = nodes.iter().map(|&[x, y]| [x.into(), Dual64::new(y, y)]).collect();
    /// let lifted = solution.lift(&thicker)?;
    /// assert_eq!(lifted.cd.re, solution.coefficients.cd);
    /// assert!(lifted.cd.eps > 0.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`FlowError::FirstOrderOnly`] for scalars with higher derivatives, [`FlowError::OtherNodes`] for nodes whose real
    /// parts are not those of the solution (to 1e-9 chords), [`FlowError::NoDerivatives`] where the solution is not
    /// converged.
    pub fn lift<S: Scalar, P: Into<[S; 2]> + Copy>(&self, nodes: &[P]) -> Result<Coefficients<S>, FlowError> {
        if S::NDERIV > 1 {
            return Err(FlowError::FirstOrderOnly);
        }
        let nodes: Vec<[S; 2]> = nodes.iter().map(|&p| p.into()).collect();
        let own = self.record.nodes();
        let far = |(own, other): (&[f64; 2], &[S; 2])| !(0..2).all(|c| (other[c].re() - own[c]).abs() <= 1e-9);
        if own.len() != nodes.len() || own.iter().zip(&nodes).any(far) {
            return Err(FlowError::OtherNodes);
        }
        if S::NDERIV == 0 {
            return Ok(self.coefficients.map(S::from));
        }
        let gradients = self.held_gradients().ok_or(FlowError::NoDerivatives)?.coefficients;
        // Taylor's formula, exact for what the scalar carries
        Ok(self.coefficients.zip(gradients).map(|(value, gradient)| {
            let moves = nodes.iter().zip(&gradient.nodes).flat_map(|(node, by)| [(node[0], by[0]), (node[1], by[1])]);
            moves.fold(S::from(value), |sum, (coordinate, by)| sum + (coordinate - coordinate.re()) * by)
        }))
    }

    /// Distributions along the surface and the wake, for plots and constraints.
    pub fn distributions(&self) -> Distributions {
        self.record.distributions()
    }
}
