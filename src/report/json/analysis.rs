//! Flows about a section.

use crate::flow::{Attempt, Coefficients, Derivatives, Incidence, InviscidSolution, Solution, Status};
use serde::Serialize;

/// A viscous flow. The coefficients of a flow that was not found are `None`; those of a flow beyond the model are
/// there, flagged.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AnalysisReport {
    /// Whether the numbers hold.
    pub converged: bool,
    /// Whether the flow is solved but beyond the model, so that the numbers show a trend at best.
    pub beyond_model: bool,
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
    /// The coefficients, each under the name it has in case files.
    #[serde(flatten)]
    pub coefficients: Coefficients<Option<f64>>,
    /// Drag coefficient of the pressure.
    pub cd_pressure: Option<f64>,
    /// Drag coefficient of the friction.
    pub cd_friction: Option<f64>,
    /// Whether the estimated errors that come from panels and stations are small: see [`Solution::is_resolved`].
    pub resolved: Option<bool>,
    /// Estimated errors that come from the number of panels, as absolute values.
    pub panel_error: Option<ErrorReport>,
    /// Estimated errors that come from the number of stations of the boundary layer, as absolute values.
    pub station_error: Option<ErrorReport>,
    /// Drag coefficient of shocks; zero by a solver that knows none.
    pub cd_wave: Option<f64>,
    /// Name of the flow solver; `None` where no solver took the point.
    pub solver: Option<String>,
    /// A sentence for everything that was mended in the file of the section.
    pub repairs: Vec<String>,
    /// Wall-clock time in seconds.
    pub seconds: f64,
    /// Derivatives, where they were asked for; `None` inside where the numbers do not hold.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gradients: Option<Option<FlowGradientsReport>>,
    /// Panel nodes that the derivatives belong to, in the unit and frame of the section as given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nodes: Option<Vec<[f64; 2]>>,
}

/// Estimated errors of the coefficients: see [`Solution::discretisation_error`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ErrorReport {
    /// Error of the lift coefficient.
    pub cl: f64,
    /// Error of the drag coefficient.
    pub cd: f64,
    /// Error of the moment coefficient.
    pub cm: f64,
}

/// Exact derivatives of a flow.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FlowGradientsReport {
    /// The quantity that is held while the other inputs change: `"alpha"`, or `"cl"` where the lift was asked for.
    pub held: &'static str,
    /// Derivatives of the coefficients, each under the name it has in case files.
    #[serde(flatten)]
    pub coefficients: Coefficients<FlowDerivatives>,
    /// Derivatives of the angle of attack (degrees), where the lift is held.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alpha: Option<FlowDerivatives>,
}

/// Derivatives of one number of a flow.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FlowDerivatives {
    /// With respect to the angle of attack, per degree; `None` where the lift is held, so that the angle is no input.
    pub alpha: Option<f64>,
    /// With respect to the Mach number.
    pub mach: f64,
    /// With respect to the Reynolds number.
    pub reynolds: f64,
    /// With respect to x of every node, per unit of the nodes.
    pub x: Vec<f64>,
    /// With respect to y of every node, per unit of the nodes.
    pub y: Vec<f64>,
}

impl AnalysisReport {
    /// The report of a flow that took `seconds`, about a section with these repairs.
    pub fn new(solution: &Solution, seconds: f64, repairs: &[String]) -> Self {
        let solved = solution.is_solved();
        let number = |value: f64| solved.then_some(value);
        let error = solution.discretisation_error();
        let report = |Coefficients { cl, cd, cm, .. }: Coefficients| ErrorReport { cl, cd, cm };
        Self {
            converged: solution.is_reliable(),
            beyond_model: solution.status.is_beyond_model(),
            status: solution.status.to_string(),
            residual: solution.residual,
            iterations: solution.iterations,
            attempts: solution.attempts.clone(),
            alpha: solution.alpha.to_degrees(),
            mach: solution.condition.mach,
            reynolds: solution.condition.reynolds,
            coefficients: solution.coefficients.map(number),
            cd_pressure: number(solution.cd_pressure),
            cd_friction: number(solution.cd_friction),
            resolved: error.map(|error| error.is_small(&solution.coefficients)),
            panel_error: error.map(|error| report(error.panels)),
            station_error: error.map(|error| report(error.stations)),
            cd_wave: number(solution.cd_wave),
            solver: Some(solution.solver.into()),
            repairs: repairs.to_vec(),
            seconds,
            gradients: None,
            nodes: None,
        }
    }

    /// The report with the angle of attack as it was asked for, in degrees: that of the solution went through radians.
    pub fn at_angle(self, alpha: f64) -> Self {
        Self { alpha, ..self }
    }

    /// The report of a point that has no flow, for the reason given; `alpha` is in degrees.
    pub fn refused(alpha: f64, mach: f64, reynolds: f64, reason: String, repairs: &[String]) -> Self {
        let none = None;
        let coefficients = Coefficients { cl: none, cd: none, cm: none, cp_min: none, transition: [none; 2] };
        Self {
            converged: false,
            beyond_model: false,
            status: reason,
            residual: f64::NAN,
            iterations: 0,
            attempts: Vec::new(),
            alpha,
            mach,
            reynolds,
            coefficients,
            cd_pressure: none,
            cd_friction: none,
            resolved: None,
            panel_error: None,
            station_error: None,
            cd_wave: none,
            solver: None,
            repairs: repairs.to_vec(),
            seconds: 0.0,
            gradients: None,
            nodes: None,
        }
    }

    /// The report with derivatives; `nodes` are those of the solution.
    pub fn with_gradients(self, solution: &Solution, nodes: &[[f64; 2]]) -> Self {
        Self { gradients: Some(FlowGradientsReport::new(solution)), nodes: Some(nodes.to_vec()), ..self }
    }
}

impl FlowGradientsReport {
    /// The derivatives with that held which the condition holds; `None` where the numbers do not hold.
    pub fn new(solution: &Solution) -> Option<Self> {
        let gradients = solution.held_gradients().filter(|_| solution.is_reliable())?;
        let lift_held = matches!(solution.condition.incidence, Incidence::Lift(_));
        let one = |d: &Derivatives, unit: f64| {
            let axis = |k: usize| d.nodes.iter().map(|n| unit * n[k]).collect();
            FlowDerivatives {
                alpha: (!lift_held).then_some(unit * d.alpha.to_radians()),
                mach: unit * d.mach,
                reynolds: unit * d.reynolds,
                x: axis(0),
                y: axis(1),
            }
        };
        Some(Self {
            held: if lift_held { "cl" } else { "alpha" },
            coefficients: gradients.coefficients.as_ref().map(|d| one(d, 1.0)),
            alpha: lift_held.then(|| one(&gradients.alpha, 1f64.to_degrees())),
        })
    }
}

/// A flow without boundary layer; the coefficients of a flow that is supersonic somewhere are flagged.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InviscidReport {
    /// Whether the numbers hold.
    pub converged: bool,
    /// Whether the flow is beyond the model, so that the numbers show a trend at best.
    pub beyond_model: bool,
    /// The status in words.
    pub status: String,
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
    /// Mach number of the onset flow at which this flow becomes sonic somewhere.
    pub critical_mach: Option<f64>,
    /// A sentence for everything that was mended in the file of the section.
    pub repairs: Vec<String>,
    /// Wall-clock time in seconds.
    pub seconds: f64,
}

impl InviscidReport {
    /// The report of a flow that took `seconds`, about a section with these repairs.
    pub fn new(solution: &InviscidSolution, seconds: f64, repairs: &[String]) -> Self {
        let InviscidSolution { cl, cm, cp_min, mach, critical_mach, .. } = *solution;
        Self {
            converged: solution.status == Status::Converged,
            beyond_model: solution.status.is_beyond_model(),
            status: solution.status.to_string(),
            alpha: solution.alpha.to_degrees(),
            mach,
            cl,
            cm,
            cp_min,
            critical_mach,
            repairs: repairs.to_vec(),
            seconds,
        }
    }
}

/// A sweep of the angle of attack.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PolarReport {
    /// The section, as it was asked for.
    pub section: String,
    /// A sentence for everything that was mended in the file of the section.
    pub repairs: Vec<String>,
    /// One flow per angle of attack.
    pub points: Vec<AnalysisReport>,
}
