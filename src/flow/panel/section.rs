//! The way from a section and an operating point to a solution of the panel solver.

use super::compressibility::KarmanTsien;
use super::coupling::response::{FlowResponse, SectionResponse};
use super::coupling::surface::invert;
use super::coupling::system::{Linearised, Stream, System};
use super::outline::{Outline, TrailingEdge};
use super::outputs;
use super::polar::Straight;
use super::record::{PanelRecord, Sought};
use crate::flow::FlowError;
use crate::flow::condition::{Condition, Incidence, Settings};
use crate::flow::layer::{Layout, Unknowns};
use crate::flow::search::{self, Effort, End, Family, newton};
use crate::flow::solution::{Attempt, Solution, Status};
use crate::flow::solver::{FlowSection, FlowSolver};
use std::any::Any;
use std::sync::Arc;

/// Highest Mach number of the onset flow that the panel solver takes.
const LARGEST_MACH: f64 = 0.95;

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
    nodes: Vec<[f64; 2]>,
    pub(crate) response: Arc<SectionResponse>,
}

/// Inviscid flow about a section, with coefficients as in [`Coefficients`](crate::flow::Coefficients).
#[derive(Debug, Clone, PartialEq)]
pub struct InviscidSolution {
    /// Angle of attack in radians.
    pub alpha: f64,
    /// Lift coefficient.
    pub cl: f64,
    /// Moment coefficient about the quarter chord, nose-up positive.
    pub cm: f64,
    /// Lowest pressure coefficient on the surface.
    pub cp_min: f64,
    /// Pressure coefficient at the nodes, one value per node.
    pub cp: Vec<f64>,
    /// Incompressible speed along the surface at the nodes, in units of the onset speed, positive clockwise (along the
    /// upper surface from the nose to the trailing edge).
    pub speed: Vec<f64>,
}

impl PanelledSection {
    /// Lays panels through the nodes and factorises the panel equations.
    ///
    /// `nodes` are the points of the section in chords (at least 40), from the trailing edge over the upper surface to
    /// the nose and back along the lower surface. For a sharp edge the first and the last node are one point.
    ///
    /// # Errors
    /// [`FlowError`] for nodes that make no section.
    pub fn new(nodes: &[[f64; 2]], trailing_edge: TrailingEdge) -> Result<Self, FlowError> {
        let response = SectionResponse::new(&Outline::new(nodes, trailing_edge)?)?;
        Ok(Self { nodes: nodes.to_vec(), response: Arc::new(response) })
    }

    /// Flow without boundary layer at an angle of attack `alpha` in radians and a Mach number below 1.
    pub fn inviscid(&self, alpha: f64, mach: f64) -> InviscidSolution {
        let speed = self.response.panels.strengths(alpha);
        let forces = outputs::surface_values(&self.response, &speed, alpha, mach);
        let correction = KarmanTsien::new(mach);
        InviscidSolution {
            alpha,
            cl: forces.cl,
            cm: forces.cm,
            cp_min: forces.cp_min,
            cp: speed.iter().map(|&q| correction.pressure(q)).collect(),
            speed,
        }
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
        PanelSolver { settings: *settings }.check(condition)?;
        settings.check()?;
        let warm = warm.and_then(panel_record).map(|(alpha, record)| (alpha, record.unknowns.clone()));
        let request = Request { section: self, condition: *condition, settings: *settings };
        Ok(match condition.incidence {
            Incidence::Alpha(alpha) => request.report(request.at_alpha(alpha, warm.map(|(_, unknowns)| unknowns))),
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

/// Largest number of iterations of a warm start; a march is closer to a flow that takes more.
const WARM_ITERATIONS: usize = 8;
/// First move of transition, in lengths of the side, beyond which a march is closer to the flow than a warm start.
const WARM_REACH: f64 = 0.1;
/// Largest number of solutions on the way to a prescribed lift coefficient.
const LIFT_STEPS: usize = 20;
/// Largest change of the angle of attack between two solutions on the way to a prescribed lift coefficient, in radians.
const LIFT_REACH: f64 = 0.05;

/// One flow that is asked for.
struct Request<'a> {
    section: &'a PanelledSection,
    condition: Condition,
    settings: Settings,
}

/// The end of the search for a flow at one angle of attack, converged or not.
struct Ended {
    record: PanelRecord,
    attempts: Vec<Attempt>,
    residual: f64,
    iterations: usize,
    converged: bool,
}

impl Request<'_> {
    fn at_alpha(&self, alpha: f64, warm: Option<Unknowns>) -> Ended {
        let Self { section, settings, .. } = self;
        let response = &section.response;
        let layout = Layout::new(settings.laminar_stations, settings.turbulent_stations, response.wake_distances.len());
        let warm = warm.filter(|u| u.stations.len() == layout.stations());
        let flow = FlowResponse::new(response, alpha);
        let stream = self.stream();
        let search = PanelFamily { section: response, flow: &flow, layout: &layout, stream, settings: *settings };
        let ((end, found), attempts) = search.converge(warm);
        let (residual, iterations, converged) = (end.residual, end.iterations, end.converged);
        let nodes = section.nodes.clone();
        let sought = Sought { section: Arc::clone(response), flow, layout: found, stream, nodes };
        Ended { record: PanelRecord::new(sought, end), attempts, residual, iterations, converged }
    }

    fn report(&self, ended: Ended) -> Solution {
        let Ended { record, attempts, residual, iterations, converged } = ended;
        let coefficients = record.coefficients();
        let cd_friction = record.friction_drag();
        Solution {
            status: if converged { record.status() } else { Status::NotConverged { residual } },
            condition: self.condition,
            alpha: record.flow.alpha,
            coefficients,
            cd_pressure: coefficients.cd - cd_friction,
            cd_friction,
            stagnation: record.stagnation(),
            residual,
            iterations,
            attempts,
            record: Arc::new(record),
        }
    }

    /// Newton's method on the angle of attack, with the lift slope of each solution at a wake that stays where it is.
    fn at_lift(&self, lift: f64, warm: Option<(f64, Unknowns)>) -> Solution {
        let zero = self.section.inviscid(0.0, self.condition.mach).cl;
        let slope = self.section.inviscid(0.1, self.condition.mach).cl - zero;
        let (start, mut unknowns) = warm.map_or(((lift - zero) / slope * 0.1, None), |(a, u)| (a, Some(u)));
        let mut alpha = start.clamp(-0.5, 0.5);
        let mut step = 0;
        loop {
            let last = self.at_alpha(alpha, unknowns.take());
            let missed = last.record.coefficients().cl - lift;
            let reached = missed.abs() <= 10.0 * self.settings.tolerance;
            let slope = if last.converged && !reached { last.record.lift_slope() } else { None };
            let Some(slope) = slope else { return self.report(last) };
            if step == LIFT_STEPS {
                return Solution { status: Status::NotConverged { residual: missed.abs() }, ..self.report(last) };
            }
            alpha -= (missed / slope).clamp(-LIFT_REACH, LIFT_REACH);
            unknowns = Some(last.record.unknowns);
            step += 1;
        }
    }

    fn stream(&self) -> Stream {
        let Condition { mach, reynolds, n_critical, .. } = self.condition;
        Stream { mach, reynolds, n_critical, trips: self.trip_arcs() }
    }

    /// Arc lengths of the trips in chords, found from their x by the spline through the nodes.
    fn trip_arcs(&self) -> [Option<f64>; 2] {
        let section = &self.section.response;
        let x: Vec<f64> = section.panels.outline.nodes.iter().map(|p| p[0]).collect();
        let nose = section.panels.outline.foremost() as f64;
        let (spline, last) = (&section.map.spline, (x.len() - 1) as f64);
        let c = spline.coefficients(&x);
        let arc = |t: f64| section.map.spline.value(&section.map.arc, t);
        let [upper, lower] = self.condition.trips.map(|trip| trip.filter(|&x| x < 1.0));
        [
            upper.map(|x| arc(invert(spline, &c, x, 0.0, nose, -1.0))),
            lower.map(|x| arc(invert(spline, &c, x, nose, last, 1.0))),
        ]
    }
}

/// The requested flow and its neighbours about one section, with one wake.
pub(crate) struct PanelFamily<'a> {
    pub section: &'a SectionResponse,
    pub flow: &'a FlowResponse,
    pub layout: &'a Layout,
    pub stream: Stream,
    pub settings: Settings,
}

impl PanelFamily<'_> {
    /// Tries a warm start unless it is far off, then a cold start, then easier conditions that lead to the requested
    /// one. The result comes with the layout of the stations it stands on and with the attempts that failed.
    fn converge(&self, warm: Option<Unknowns>) -> ((End<Linearised>, Layout), Vec<Attempt>) {
        let Settings { tolerance, iterations, retry, .. } = self.settings;
        let system = self.equations(self.flow, self.layout, self.stream.trips);
        let as_wanted = |end| (end, self.layout.clone());
        let mut attempts = Vec::new();
        let mut note =
            |what: &str, end: &End<Linearised>| attempts.push(Attempt::of(what, end.iterations, end.residual));
        let mut far = None;
        if let Some(warm) = warm {
            let limit = iterations.min(WARM_ITERATIONS);
            let effort = Effort { reach: WARM_REACH, ..Effort::new(tolerance, limit) };
            let end = newton::solve(&system, warm.clone(), effort);
            if end.converged {
                return (as_wanted(end), attempts);
            }
            if end.iterations == 0 {
                far = Some(warm);
            } else {
                note("warm start", &end);
            }
        }
        let direct = newton::solve(&system, system.march(), Effort::new(tolerance, iterations));
        if direct.converged || (far.is_none() && !retry) {
            return (as_wanted(direct), attempts);
        }
        note("march", &direct);
        if let Some(warm) = far {
            let end = newton::solve(&system, warm, Effort::new(tolerance, iterations));
            if end.converged {
                return (as_wanted(end), attempts);
            }
            note("warm start", &end);
        }
        if !retry {
            return (as_wanted(direct), attempts);
        }
        let (found, attempts) = search::climb(self, self.flow, attempts);
        (found.unwrap_or_else(|| as_wanted(direct)), attempts)
    }
}

impl Family for PanelFamily<'_> {
    type Outer = FlowResponse;
    type At = Linearised;
    type Factors = super::coupling::reduced::Reduced;
    type Equations<'b>
        = System<'b>
    where
        Self: 'b;

    fn total(&self) -> f64 {
        self.section.map.total
    }

    fn layout(&self) -> &Layout {
        self.layout
    }

    fn tolerance(&self) -> f64 {
        self.settings.tolerance
    }

    fn lift_sign(&self) -> f64 {
        let (outline, strengths) = (&self.section.panels.outline, &self.flow.inviscid);
        let mean = |j: usize| 0.5 * (strengths[j] + strengths[j + 1]);
        let circulation: f64 = (0..outline.len() - 1).map(|j| mean(j) * Straight::new(outline.panel(j)).length).sum();
        circulation.signum()
    }

    fn stagnation(&self) -> f64 {
        self.flow.stagnation(self.section)
    }

    fn trips(&self) -> [Option<f64>; 2] {
        self.stream.trips
    }

    fn turned(&self, radians: f64) -> FlowResponse {
        let mut flow = self.flow.clone();
        self.turn(&mut flow, radians);
        flow
    }

    fn turn(&self, flow: &mut FlowResponse, radians: f64) {
        flow.turn(flow.onset(self.section, self.flow.alpha + radians));
    }

    fn equations<'b>(&'b self, flow: &'b FlowResponse, layout: &'b Layout, trips: [Option<f64>; 2]) -> System<'b> {
        System::new(self.section, flow, layout, Stream { trips, ..self.stream })
    }
}
