//! The flow about a section in the form that every solver returns: coefficients, distributions, status, derivatives.

use super::FlowError;
use super::coefficients::{Coefficients, Derivatives, Gradients};
use super::condition::{Condition, Incidence};
use super::field::FlowField;
use super::resolution::{DiscretisationError, at_fixed_lift};
use crate::scalar::Scalar;
use serde::{Deserialize, Serialize};
use std::any::Any;
use std::borrow::Cow;
use std::fmt::Debug;
use std::sync::Arc;

/// Whether a solution is to be trusted, and why not.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Status {
    /// The residual is below the tolerance and the flow is within the model.
    Converged,
    /// The iteration did not converge; the coefficients mean nothing.
    NotConverged {
        /// Largest residual at the end of the attempt, without dimension.
        residual: f64,
        /// Length of reversed flow in the last state over the length of the side, for the side where that is larger.
        reversed: f64,
    },
    /// The lift coefficient that was asked for is not reached by a flow within the model. The solution is that with the
    /// largest lift that was found (the smallest, where the lift asked for is negative).
    LiftOutOfReach {
        /// Lift coefficient that was asked for.
        wanted: f64,
        /// Largest lift coefficient, or the smallest, of a flow within the model.
        largest: f64,
        /// Angle of attack at that lift in radians.
        alpha: f64,
        /// Status of the flow at the next angle, where the lift was still growing; `None` where it fell, so that the lift
        /// above is the largest there is.
        ended: Option<String>,
    },
    /// The iteration converged, but the flow is separated so far that an integral layer with one-parameter profiles no
    /// longer describes it: the flow at the wall is reversed over more than half of a side, counted over laminar
    /// (kinematic shape parameter above 4.0) and turbulent (above 3.5) stations alike.
    Separated {
        /// Length of reversed flow over the length of the side, for the side where that is larger.
        extent: f64,
    },
    /// The equations are solved, but not on the grid that was asked for: on another number of stations only. The flow is
    /// at the limit of what these resolve, as thin bubbles behind the nose are.
    Unresolved {
        /// The reason in words, with the numbers of stations.
        reason: Cow<'static, str>,
    },
    /// The flow is outside what the outer flow of the solver describes.
    OutsideModel {
        /// Kind of flow in a word: "supersonic" by the panel solver; "buffet", "leading-edge shock" or "no start" by the
        /// streamtube solver.
        name: Cow<'static, str>,
        /// Number that shows how far the flow is outside: the highest local Mach number. Without a start it is the coordinate
        /// x in chords at which the grid turns over, or the Mach number at which the equations have no value.
        value: f64,
        /// Reason in words, with the value.
        reason: Cow<'static, str>,
        /// Whether the iteration converged; the coefficients mean nothing where it did not.
        converged: bool,
    },
}

impl Status {
    /// The status in a word or two, for counting.
    pub fn name(&self) -> &str {
        match self {
            Self::Converged => "converged",
            Self::NotConverged { .. } => "not converged",
            Self::LiftOutOfReach { .. } => "lift out of reach",
            Self::Separated { .. } => "separated",
            Self::Unresolved { .. } => "unresolved",
            Self::OutsideModel { name, .. } => name,
        }
    }

    /// Whether the equations are solved but the flow is beyond what the model describes or what the grid resolves, so
    /// that the coefficients show a trend at best.
    pub fn is_beyond_model(&self) -> bool {
        matches!(self, Self::Separated { .. } | Self::Unresolved { .. } | Self::OutsideModel { converged: true, .. })
    }
}

/// Reversed flow of the last state, over the length of a side, above which it is named as the likely cause of a
/// failure.
const LIKELY_SEPARATED: f64 = 0.3;

impl std::fmt::Display for Status {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Converged => write!(f, "converged"),
            Self::NotConverged { residual, reversed } if *reversed > LIKELY_SEPARATED => {
                let percent = 100.0 * reversed;
                write!(f, "not converged (residual {residual:.1e}; reversed flow over {percent:.0} % of a side)")
            }
            Self::NotConverged { residual, .. } => write!(f, "not converged (residual {residual:.1e})"),
            Self::LiftOutOfReach { wanted, largest, alpha, ended } => {
                let degrees = alpha.to_degrees();
                if let Some(status) = ended {
                    return write!(
                        f,
                        "CL {wanted} is not reached: beyond CL {largest:.4} at {degrees:.2} degrees the flow is {status}"
                    );
                }
                let extreme = if *wanted < 0.0 { "smallest" } else { "largest" };
                write!(f, "CL {wanted} is beyond the {extreme} lift {largest:.4} at {degrees:.2} degrees")
            }
            Self::Separated { extent } => {
                write!(f, "separated beyond the model (reversed flow over {:.0} % of a side)", 100.0 * extent)
            }
            Self::Unresolved { reason } => write!(f, "not resolved ({reason})"),
            Self::OutsideModel { name, reason, .. } => write!(f, "{name} {reason}"),
        }
    }
}

/// One attempt of the solver, for the report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Attempt {
    /// Name of the start or way that was tried.
    pub what: String,
    /// Number of Newton iterations of the attempt.
    pub iterations: usize,
    /// Largest residual at the end of the attempt, without dimension.
    pub residual: f64,
}

impl Attempt {
    pub(super) fn of(what: &str, iterations: usize, residual: f64) -> Self {
        Self { what: what.into(), iterations, residual }
    }
}

/// The flow about a section at one operating point.
///
/// Nodes may come in any unit, at any place and at any angle: the angle of attack is that against the x axis of the
/// nodes, and everything else refers to the section's own chord line, from the point of the section that is farthest
/// from the middle of the trailing edge to that middle. (Where two points are equally far, the line lies between them: it
/// moves smoothly with the nodes.) Lengths are in chords, and coordinates x and y in the frame with
/// the nose at (0, 0) and the middle of the trailing edge at (1, 0). Speeds are in units of the onset speed.
/// Coefficients are on the chord and the dynamic pressure of the onset flow; the moment is about the quarter chord,
/// nose-up positive.
#[derive(Debug, Clone)]
pub struct Solution {
    /// Whether the numbers below are to be trusted.
    pub status: Status,
    /// Name of the solver that found the flow.
    pub solver: &'static str,
    /// Operating point that was asked for.
    pub condition: Condition,
    /// Angle of attack against the x axis of the nodes in radians. The solver has found it where the lift coefficient was
    /// prescribed.
    pub alpha: f64,
    /// Coefficients of the section. Lift and moment come from the surface pressure, drag from the end of the wake by
    /// the formula of Squire and Young.
    pub coefficients: Coefficients,
    /// Pressure drag coefficient: the drag coefficient less the friction drag coefficient.
    pub cd_pressure: f64,
    /// Friction drag coefficient: wall shear stress along the onset flow, integrated over both sides.
    pub cd_friction: f64,
    /// Wave drag coefficient: the part of the drag coefficient that belongs to the losses in shocks. It is zero where
    /// the solver knows no shocks.
    pub cd_wave: f64,
    /// Stagnation point, as x in chords.
    pub stagnation: f64,
    /// Largest residual of all equations, without dimension.
    pub residual: f64,
    /// Number of Newton iterations of the last attempt.
    pub iterations: usize,
    /// Attempts that failed before the last one, in their order; empty where the direct way succeeded.
    pub attempts: Vec<Attempt>,
    /// State of the solver from which derivatives, distributions and warm starts are made.
    pub(super) record: Arc<dyn Record>,
}

/// The state of a solution that its solver keeps for derivatives, distributions and warm starts.
pub(super) trait Record: Any + Debug + Send + Sync {
    /// Exact derivatives of the coefficients at fixed angle of attack; `None` where the equations are singular.
    fn gradients(&self) -> Option<Gradients>;

    /// Estimated errors of the coefficients that come from the panels, from the derivatives of the coefficients; `None`
    /// for a solver without panels.
    fn panel_error(&self, _gradients: &Gradients) -> Option<Coefficients> {
        None
    }

    /// Estimated changes of the coefficients, at fixed angle of attack, where the stations of the boundary layer are
    /// doubled; `None` for a solver without such an estimate.
    fn station_error(&self) -> Option<Coefficients> {
        None
    }

    /// Exact derivatives of weighted sums of the pressure coefficients at the nodes at fixed angle of attack, one for
    /// each list of weights; `None` where the equations are singular, or where the solver offers none.
    fn pressure_gradients(&self, _weights: &[Vec<f64>]) -> Option<Vec<Derivatives>> {
        None
    }

    /// Exact derivatives of the wave drag coefficient at fixed angle of attack; `None` where the solver knows no shocks,
    /// or where the equations are singular.
    fn wave_drag_gradient(&self) -> Option<Derivatives> {
        None
    }

    /// Distributions along the surface and the wake.
    fn distributions(&self) -> Distributions;

    /// The flow in the region about the section; `None` for a solver that knows the flow at the surface alone, or where
    /// the last state has none.
    fn field(&self) -> Option<FlowField> {
        None
    }

    /// Nodes of the section as they were given.
    fn nodes(&self) -> &[[f64; 2]];

    /// Length of the section's own chord, in the unit of the nodes.
    fn chord(&self) -> f64;
}

/// Derivatives of the results of a solution. They hold whatever the condition holds: the angle of attack or the lift
/// coefficient.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeldGradients {
    /// Derivatives of the coefficients.
    pub coefficients: Gradients,
    /// Derivatives of the angle of attack (radians). Where the lift coefficient is held the angle follows; where the
    /// angle is held all are zero but the derivative with respect to the angle itself.
    pub alpha: Derivatives,
    /// Derivatives of the wave drag coefficient; zero where the solver knows no shocks.
    pub cd_wave: Derivatives,
}

/// Flow at one station of the boundary layer or the wake. Lengths are in chords, x and y in the frame of the chord line
/// (see [`Solution`]), speeds in units of the onset speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StationFlow {
    /// Arc length from the stagnation point, or in the wake from the trailing edge.
    pub s: f64,
    /// Coordinate x of the station.
    pub x: f64,
    /// Coordinate y of the station.
    pub y: f64,
    /// Compressible speed at the edge of the layer.
    pub edge_velocity: f64,
    /// Mach number at the edge of the layer.
    pub mach: f64,
    /// Pressure coefficient at the edge of the layer.
    pub cp: f64,
    /// Momentum thickness θ.
    pub momentum_thickness: f64,
    /// Displacement thickness δ*; in the wake without the dead air behind a blunt edge.
    pub displacement_thickness: f64,
    /// Kinematic shape parameter Hk.
    pub shape_parameter: f64,
    /// Skin-friction coefficient on the local dynamic pressure; zero in the wake.
    pub skin_friction: f64,
    /// Amplification factor n; zero where the layer is turbulent.
    pub amplification: f64,
    /// Coefficient Cτ = τ/(ρu²) of the largest shear stress, on density and speed at the edge; zero where the layer is
    /// laminar.
    pub shear_stress: f64,
}

/// Distributions of a solution along the surface and the wake.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Distributions {
    /// Nodes of the section in the frame of its chord line, in chords.
    pub nodes: Vec<[f64; 2]>,
    /// Pressure coefficient at the nodes of the section, in the order of the nodes.
    pub cp: Vec<f64>,
    /// Pressure coefficient at the nodes of the flow without boundary layer, at the angle of attack of the solution;
    /// empty where the solver has no such flow at hand.
    pub cp_inviscid: Vec<f64>,
    /// Stations of the upper side from the stagnation point to the trailing edge.
    pub upper: Vec<StationFlow>,
    /// Stations of the lower side from the stagnation point to the trailing edge.
    pub lower: Vec<StationFlow>,
    /// Stations of the wake from the trailing edge downstream.
    pub wake: Vec<StationFlow>,
}

impl Solution {
    /// Whether the status is [`Status::Converged`].
    pub fn is_reliable(&self) -> bool {
        self.status == Status::Converged
    }

    /// Whether the coefficients belong to a solved flow at the operating point, within the model or beyond it.
    pub fn is_solved(&self) -> bool {
        self.is_reliable() || self.status.is_beyond_model()
    }

    /// Exact derivatives of the coefficients at fixed angle of attack. The wake, the stagnation point and transition
    /// move with the inputs.
    ///
    /// The result is `None` where the solution is not converged, because it has no derivatives then. See
    /// [`held_gradients`](Self::held_gradients) for a point at fixed lift coefficient.
    pub fn gradients(&self) -> Option<Gradients> {
        if self.is_solved() { self.record.gradients() } else { None }
    }

    /// Exact derivatives that hold whatever the condition holds: the angle of attack or the lift coefficient.
    ///
    /// The result is `None` where the solution is not converged.
    pub fn held_gradients(&self) -> Option<HeldGradients> {
        let at_alpha = self.gradients()?;
        let still = |alpha: f64| {
            let nodes = vec![[0.0; 2]; at_alpha.cl.nodes.len()];
            Derivatives { nodes, alpha, mach: 0.0, reynolds: 0.0 }
        };
        let wave = self.record.wave_drag_gradient().unwrap_or_else(|| still(0.0));
        Some(match self.condition.incidence {
            Incidence::Alpha(_) => HeldGradients { alpha: still(1.0), coefficients: at_alpha, cd_wave: wave },
            Incidence::Lift(_) => HeldGradients {
                coefficients: at_alpha.at_fixed_lift(),
                alpha: at_alpha.alpha_at_fixed_lift(),
                cd_wave: wave.at_fixed_lift(&at_alpha.cl),
            },
        })
    }

    /// Estimated errors of the coefficients that the number of panels and the number of stations leave.
    ///
    /// The result is `None` where the solution is not converged, and for a solver without such an estimate. It costs
    /// about as much as a warm analysis and [`gradients`](Self::gradients) together: 6 ms where a warm analysis takes 5.
    pub fn discretisation_error(&self) -> Option<DiscretisationError> {
        if !self.is_solved() {
            return None;
        }
        let stations = self.record.station_error()?;
        let gradients = self.record.gradients()?;
        let (gradients, stations) = match self.condition.incidence {
            Incidence::Alpha(_) => (gradients, stations),
            Incidence::Lift(_) => (gradients.at_fixed_lift(), at_fixed_lift(stations, &gradients)),
        };
        // a step without end means that twice as many stations have another flow
        let stations = stations.map(|change| if change.is_finite() { change.abs() } else { f64::INFINITY });
        Some(DiscretisationError { panels: self.record.panel_error(&gradients)?, stations })
    }

    /// Whether the [`discretisation_error`](Self::discretisation_error) of lift and drag
    /// [is small](DiscretisationError::is_small). `None` where there is no estimate.
    pub fn is_resolved(&self) -> Option<bool> {
        self.discretisation_error().map(|error| error.is_small(&self.coefficients))
    }

    /// Exact derivatives of weighted sums of the pressure coefficients at the nodes, that is of `Σ weights[k][i] cp[i]`
    /// with `cp` as in [`Distributions`], one for each list of weights. They hold whatever the condition holds: the angle
    /// of attack or the lift coefficient.
    ///
    /// The result is `None` where the solution is not converged, or where a list has not one weight per node. Six sums
    /// cost about as much as the derivatives of all coefficients.
    pub fn pressure_derivatives(&self, weights: &[Vec<f64>]) -> Option<Vec<Derivatives>> {
        let nodes = self.record.nodes().len();
        if !self.is_solved() || weights.iter().any(|list| list.len() != nodes) {
            return None;
        }
        let at_alpha = self.record.pressure_gradients(weights)?;
        Some(match self.condition.incidence {
            Incidence::Alpha(_) => at_alpha,
            Incidence::Lift(_) => {
                let lift = self.record.gradients()?.cl;
                at_alpha.into_iter().map(|by| by.at_fixed_lift(&lift)).collect()
            }
        })
    }

    /// The coefficients over any scalar that carries at most first derivatives. `nodes` are the nodes of the solution,
    /// in their own unit, with whatever derivatives they have. The angle of attack or the lift coefficient is held, as the
    /// condition says.
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
        let tolerance = 1e-9 * self.record.chord();
        let far = |(own, other): (&[f64; 2], &[S; 2])| !(0..2).all(|c| (other[c].re() - own[c]).abs() <= tolerance);
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

    /// Pressure along the surface, and the boundary layer along both sides and the wake, for plots and constraints.
    pub fn distributions(&self) -> Distributions {
        self.record.distributions()
    }

    /// The flow in the region about the section, for figures.
    ///
    /// The result is `None` where the solution is not converged, and for a solver that knows the flow at the surface
    /// alone, as the panel solver does.
    pub fn field(&self) -> Option<FlowField> {
        if self.is_solved() { self.record.field() } else { None }
    }
}
