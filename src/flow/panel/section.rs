//! The way from a section and an operating point to a solution of the panel solver.

use super::compressibility::KarmanTsien;
use super::coupling::response::SectionResponse;
use super::frame::Nodes;
use super::outline::{Outline, TrailingEdge};
use super::outputs;
use super::record::{PanelRecord, supersonic};
use super::request::Request;
use crate::flow::FlowError;
use crate::flow::condition::{Condition, Incidence, Settings};
use crate::flow::solution::{Solution, Status};
use crate::flow::solver::{FlowSection, FlowSolver};
use std::any::Any;
use std::sync::Arc;

/// Highest Mach number of the onset flow that the panel solver takes.
const LARGEST_MACH: f64 = 0.95;
/// Largest angle between the onset flow and the chord line, in degrees.
const LARGEST_INCIDENCE: f64 = 40.0;

/// The panel solver with its settings: linear vortex panels with the Kármán-Tsien correction, coupled with integral
/// boundary layers (the method of Drela, XFOIL, 1989). It is meant for flows without shocks; a solution with supersonic
/// flow has a [`Status`] that says so.
///
/// ```
/// use aeroform::flow::{Condition, FlowSolver, Incidence, PanelSolver, TrailingEdge, panel_parameters};
/// use aeroform::section::SectionDefinition;
/// let section = SectionDefinition::parse("naca0012")?.section()?;
/// let nodes: Vec<[f64; 2]> =
///     panel_parameters(&section, 161).into_iter().map(|u| section.curve().point_at(u)).collect();
/// let solver = PanelSolver::default();
/// let solution = solver.section(&nodes, TrailingEdge::Blunt)?.analyze(&Condition::new(Incidence::Lift(0.4), 3e6), None)?;
/// assert!(solution.is_reliable() && (solution.coefficients.cl - 0.4).abs() < 1e-8);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PanelSolver {
    /// Resolution and limits of every analysis.
    pub settings: Settings,
}

impl FlowSolver for PanelSolver {
    fn name(&self) -> &'static str {
        "panel"
    }

    fn check(&self, condition: &Condition) -> Result<(), FlowError> {
        condition.check()?;
        if condition.mach < LARGEST_MACH {
            return Ok(());
        }
        Err(FlowError::Condition { name: "Mach number", value: condition.mach, allowed: "from 0 to 0.95" })
    }

    fn section(&self, nodes: &[[f64; 2]], trailing_edge: TrailingEdge) -> Result<Box<dyn FlowSection>, FlowError> {
        let section = PanelledSection::new(nodes, trailing_edge)?;
        Ok(Box::new(SolverSection { section, settings: self.settings }))
    }
}

/// A section prepared for the panel solver, with the settings of the solver.
#[derive(Debug)]
struct SolverSection {
    section: PanelledSection,
    settings: Settings,
}

impl FlowSection for SolverSection {
    fn analyze(&self, condition: &Condition, warm: Option<&Solution>) -> Result<Solution, FlowError> {
        self.section.analyze(condition, &self.settings, warm)
    }
}

/// A section with its panel equations factorised: the part of an analysis that all operating points share.
#[derive(Debug, Clone)]
pub struct PanelledSection {
    pub(in crate::flow) nodes: Nodes,
    pub(crate) response: Arc<SectionResponse>,
}

/// Inviscid flow about a section, with coefficients as in [`Coefficients`](crate::flow::Coefficients).
#[derive(Debug, Clone, PartialEq)]
pub struct InviscidSolution {
    /// Whether the numbers below are to be trusted: [`Status::OutsideModel`] where the flow is supersonic somewhere.
    pub status: Status,
    /// Angle of attack against the x axis of the nodes in radians.
    pub alpha: f64,
    /// Mach number of the onset flow.
    pub mach: f64,
    /// Lift coefficient.
    pub cl: f64,
    /// Moment coefficient about the quarter chord, nose-up positive.
    pub cm: f64,
    /// Lowest pressure coefficient on the surface.
    pub cp_min: f64,
    /// Mach number of the onset flow at which the flow at this angle of attack becomes sonic where it is fastest;
    /// `None` where that is beyond the range of the solver.
    pub critical_mach: Option<f64>,
    /// Nodes of the section in the frame of its chord line, in chords: see [`Solution`].
    pub nodes: Vec<[f64; 2]>,
    /// Pressure coefficient at the nodes, one value per node.
    pub cp: Vec<f64>,
    /// Incompressible speed along the surface at the nodes, in units of the onset speed, positive clockwise (along the
    /// upper surface from the nose to the trailing edge).
    pub speed: Vec<f64>,
}

impl PanelledSection {
    /// Lays panels through the nodes and factorises the panel equations.
    ///
    /// `nodes` are points of the section (at least 40), from the trailing edge over the upper surface to the nose and back
    /// along the lower surface, in any unit, at any place and at any angle: see [`Solution`]. For a sharp edge the first
    /// and the last node are one point.
    ///
    /// # Errors
    /// [`FlowError`] for nodes that make no section.
    pub fn new(nodes: &[[f64; 2]], trailing_edge: TrailingEdge) -> Result<Self, FlowError> {
        let nodes = Nodes::new(nodes)?;
        let response = SectionResponse::new(&Outline::new(&nodes.inside, trailing_edge)?)?;
        Ok(Self { nodes, response: Arc::new(response) })
    }

    /// Flow without boundary layer at an angle of attack `alpha` against the x axis of the nodes, in radians.
    ///
    /// # Errors
    /// [`FlowError::Condition`] for an angle or a Mach number that the viscous flow would not take either.
    pub fn inviscid(&self, alpha: f64, mach: f64) -> Result<InviscidSolution, FlowError> {
        let condition = Condition { mach, ..Condition::new(Incidence::Alpha(alpha), 1e6) };
        self.check(&condition)?;
        let angle = self.nodes.frame.incidence(alpha);
        let speed = self.response.panels.strengths(angle);
        let forces = outputs::surface_values(&self.response, &speed, angle, mach);
        let correction = KarmanTsien::new(mach);
        let highest = outputs::highest_mach(&self.response, &speed, mach);
        Ok(InviscidSolution {
            status: if highest > 1.0 { supersonic(highest, true) } else { Status::Converged },
            alpha,
            mach,
            cl: forces.cl,
            cm: forces.cm,
            cp_min: forces.cp_min,
            critical_mach: self.critical_mach(&speed),
            nodes: self.nodes.inside.clone(),
            cp: speed.iter().map(|&q| correction.pressure(q)).collect(),
            speed,
        })
    }

    /// Mach number of the onset flow at which the flow becomes sonic where it is fastest.
    fn critical_mach(&self, speed: &[f64]) -> Option<f64> {
        let sonic = |mach: f64| outputs::highest_mach(&self.response, speed, mach) >= 1.0;
        if !sonic(LARGEST_MACH) {
            return None;
        }
        let (mut low, mut high) = (0.0, LARGEST_MACH);
        // to the last bit: the highest Mach number rises with that of the onset flow
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if sonic(middle) { high = middle } else { low = middle }
        }
        Some(high)
    }

    /// Checks an operating point, and the angle that it has against the chord line.
    fn check(&self, condition: &Condition) -> Result<(), FlowError> {
        PanelSolver::default().check(condition)?;
        if let Incidence::Alpha(alpha) = condition.incidence {
            // without the round-off of the conversion, which the message would show
            let value = (self.nodes.frame.incidence(alpha).to_degrees() * 1e9).round() / 1e9;
            // written so that NaN fails
            if !(value.abs() <= LARGEST_INCIDENCE) {
                let name = "angle between the onset flow and the chord line (degrees)";
                return Err(FlowError::Condition { name, value, allowed: "from -40 to 40" });
            }
        }
        Ok(())
    }

    /// Viscous flow at an operating point.
    ///
    /// `warm` is a solution of a neighbouring section or condition with these settings to start from. The result does
    /// not depend on it beyond the tolerance.
    ///
    /// # Errors
    /// [`FlowError`] for a condition or settings out of range. A flow that does not converge is a [`Solution`] whose
    /// status says so.
    pub fn analyze(
        &self,
        condition: &Condition,
        settings: &Settings,
        warm: Option<&Solution>,
    ) -> Result<Solution, FlowError> {
        self.check(condition)?;
        settings.check()?;
        let warm = warm.and_then(panel_record).map(|(alpha, record)| (alpha, record.unknowns.clone()));
        let request =
            Request { nodes: &self.nodes, response: &self.response, condition: *condition, settings: *settings };
        Ok(match condition.incidence {
            Incidence::Alpha(alpha) => request.at_alpha(alpha, warm.map(|(_, unknowns)| unknowns)),
            Incidence::Lift(lift) => request.at_lift(lift, warm),
        })
    }
}

/// Angle of attack and record of a solution; `None` for a solution of another solver.
fn panel_record(solution: &Solution) -> Option<(f64, &PanelRecord)> {
    let record: &dyn Any = &*solution.record;
    Some((solution.alpha, record.downcast_ref()?))
}

/// Viscous flow about the section through `nodes` at an operating point.
///
/// The arguments are those of [`PanelledSection::new`] and [`PanelledSection::analyze`]; a [`PanelledSection`] saves
/// work where several operating points of one section are wanted.
///
/// # Errors
/// [`FlowError`] for nodes that make no section, or a condition or settings out of range.
pub fn analyze(
    nodes: &[[f64; 2]],
    trailing_edge: TrailingEdge,
    condition: &Condition,
    settings: &Settings,
    warm: Option<&Solution>,
) -> Result<Solution, FlowError> {
    PanelledSection::new(nodes, trailing_edge)?.analyze(condition, settings, warm)
}
