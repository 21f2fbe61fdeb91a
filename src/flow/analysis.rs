//! From a section and a condition to a solution.

use super::FlowError;
use super::boundary_layer::gas::Gas;
use super::condition::{Condition, Incidence, Settings};
use super::coupled::layout::Layout;
use super::coupled::newton::{self, Converged};
use super::coupled::response::{FlowResponse, SectionResponse};
use super::coupled::speeds::value_at;
use super::coupled::surface::invert;
use super::coupled::system::System;
use super::coupled::unknowns::Unknowns;
use super::ladder::{Found, Ladder};
use super::outputs::pressure_forces;
use super::panel::forces::KarmanTsien;
use super::panel::outline::{Outline, TrailingEdge};
use super::solution::{Attempt, OperatingPoint, Solution, Status};
use std::sync::Arc;

/// A section with its panel equations factorised: the part of an analysis that all operating points share.
#[derive(Debug, Clone)]
pub struct PanelledSection {
    nodes: Vec<[f64; 2]>,
    pub(super) response: Arc<SectionResponse>,
}

/// Inviscid flow about a section.
#[derive(Debug, Clone, PartialEq)]
pub struct InviscidSolution {
    /// Angle of attack in radians.
    pub alpha: f64,
    /// Lift coefficient.
    pub cl: f64,
    /// Moment coefficient about the quarter chord, nose-up positive.
    pub cm: f64,
    /// Lowest pressure coefficient.
    pub cp_min: f64,
    /// Pressure coefficient at the nodes.
    pub cp: Vec<f64>,
    /// Incompressible speed along the surface at the nodes, positive clockwise.
    pub speed: Vec<f64>,
}

impl PanelledSection {
    /// Lays panels through the nodes and factorises.
    ///
    /// `nodes` in chords, from the trailing edge over the upper surface to the nose and back along the lower surface;
    /// for a sharp edge the first and the last are the same point.
    ///
    /// # Errors
    /// [`FlowError`] for nodes that make no section.
    pub fn new(nodes: &[[f64; 2]], trailing_edge: TrailingEdge) -> Result<Self, FlowError> {
        let response = SectionResponse::new(&Outline::new(nodes, trailing_edge)?)?;
        Ok(Self { nodes: nodes.to_vec(), response: Arc::new(response) })
    }

    /// Flow without boundary layer at an angle of attack `alpha` (radians) and a Mach number.
    pub fn inviscid(&self, alpha: f64, mach: f64) -> InviscidSolution {
        let speed = self.response.panels.strengths(alpha);
        let forces = pressure_forces(&self.response, &speed, alpha, mach);
        let correction = KarmanTsien::new(mach);
        InviscidSolution {
            alpha,
            cl: forces.lift,
            cm: forces.moment,
            cp_min: forces.lowest_pressure,
            cp: speed.iter().map(|&q| correction.pressure(q)).collect(),
            speed,
        }
    }

    /// Viscous flow. `warm` is any solution of a neighbouring section or condition with the same settings; the result
    /// does not depend on it beyond the tolerance.
    ///
    /// # Errors
    /// [`FlowError`] for a condition out of range. A flow that does not converge is a [`Solution`] whose status says so.
    pub fn analyze(
        &self,
        condition: &Condition,
        settings: &Settings,
        warm: Option<&Solution>,
    ) -> Result<Solution, FlowError> {
        condition.check()?;
        settings.check()?;
        match condition.incidence {
            Incidence::Alpha(alpha) => self.at_alpha(condition, alpha, settings, warm),
            Incidence::Lift(lift) => self.at_lift(condition, lift, settings, warm),
        }
    }

    fn at_alpha(
        &self,
        condition: &Condition,
        alpha: f64,
        settings: &Settings,
        warm: Option<&Solution>,
    ) -> Result<Solution, FlowError> {
        let layout =
            Layout::new(settings.laminar_stations, settings.turbulent_stations, self.response.wake_distances.len());
        let case = Case { section: self, condition: *condition, settings: *settings, layout };
        let warm = warm.map(|s| &s.record.unknowns);
        let warm = warm.filter(|u| u.stations.len() == 2 * case.layout.side() + case.layout.wake);
        let flow = FlowResponse::new(&self.response, alpha);
        let ((end, layout), attempts) = case.converge(&flow, warm);
        let trips = case.trip_arcs();
        let point = OperatingPoint {
            condition: *condition,
            section: Arc::clone(&self.response),
            nodes: self.nodes.clone(),
            flow,
            layout,
            trips,
        };
        Ok(Solution::new(point, end, attempts))
    }

    /// Newton's method on the angle of attack, with the exact lift slope of each solution.
    fn at_lift(
        &self,
        condition: &Condition,
        lift: f64,
        settings: &Settings,
        warm: Option<&Solution>,
    ) -> Result<Solution, FlowError> {
        let zero = self.inviscid(0.0, condition.mach).cl;
        let slope = self.inviscid(0.1, condition.mach).cl - zero;
        let mut alpha = warm.map_or((lift - zero) / slope * 0.1, |s| s.alpha).clamp(-0.5, 0.5);
        let mut last = self.at_alpha(condition, alpha, settings, warm)?;
        for _ in 0..20 {
            let Some(gradients) = last.gradients() else { return Ok(last) };
            let miss = last.cl - lift;
            if miss.abs() <= 10.0 * settings.tolerance {
                return Ok(last);
            }
            alpha -= (miss / gradients.cl.alpha).clamp(-0.05, 0.05);
            last = self.at_alpha(condition, alpha, settings, Some(&last))?;
        }
        last.status = Status::NotConverged { residual: (last.cl - lift).abs() };
        Ok(last)
    }
}

/// Viscous flow about the section through `nodes`; see [`PanelledSection`], which saves work where several conditions
/// are wanted for one section.
///
/// # Errors
/// [`FlowError`] for nodes that make no section, or a condition out of range.
pub fn analyze(
    nodes: &[[f64; 2]],
    trailing_edge: TrailingEdge,
    condition: &Condition,
    settings: &Settings,
    warm: Option<&Solution>,
) -> Result<Solution, FlowError> {
    PanelledSection::new(nodes, trailing_edge)?.analyze(condition, settings, warm)
}

/// Iterations of a warm start; the march stands nearer to what takes more.
const WARM_ITERATIONS: usize = 8;
/// First move of transition from which on the march stands nearer than a neighbour, in lengths of the side.
const WARM_REACH: f64 = 0.1;

/// One operating point on its way to convergence.
pub(super) struct Case<'a> {
    pub section: &'a PanelledSection,
    pub condition: Condition,
    pub settings: Settings,
    pub layout: Layout,
}

impl Case<'_> {
    /// Arc lengths of the trips, from x by the spline of the nodes.
    pub fn trip_arcs(&self) -> [Option<f64>; 2] {
        let section = &self.section.response;
        let x: Vec<f64> = section.panels.outline.nodes.iter().map(|p| p[0]).collect();
        let nose = (0..x.len()).min_by(|&a, &b| x[a].total_cmp(&x[b])).unwrap_or(0) as f64;
        let (spline, last) = (&section.map.spline, (x.len() - 1) as f64);
        let c = spline.coefficients(&x);
        let arc = |t: f64| value_at(section, &section.map.arc, t);
        let [upper, lower] = self.condition.trips.map(|trip| trip.filter(|&x| x < 1.0));
        [
            upper.map(|x| arc(invert(spline, &c, x, 0.0, nose, -1.0))),
            lower.map(|x| arc(invert(spline, &c, x, nose, last, 1.0))),
        ]
    }

    pub fn system<'b>(&'b self, flow: &'b FlowResponse, condition: &Condition, layout: &'b Layout) -> System<'b> {
        System {
            section: &self.section.response,
            flow,
            layout,
            gas: Gas::new(condition.mach, condition.reynolds),
            n_critical: condition.n_critical,
            trips: self.trip_arcs(),
        }
    }

    fn solve(&self, flow: &FlowResponse, condition: &Condition, start: Option<&Unknowns>) -> Converged {
        let system = self.system(flow, condition, &self.layout);
        let start = start.cloned().unwrap_or_else(|| system.march(&system.start()));
        newton::solve(&system, start, self.settings.tolerance, self.settings.iterations)
    }

    /// Warm start unless it is far off, cold start, then easier conditions that lead to the one wanted.
    fn converge(&self, flow: &FlowResponse, warm: Option<&Unknowns>) -> (Found, Vec<Attempt>) {
        let mut attempts = Vec::new();
        let mut far = None;
        if let Some(warm) = warm {
            let system = self.system(flow, &self.condition, &self.layout);
            let limit = self.settings.iterations.min(WARM_ITERATIONS);
            let end = newton::solve_nearby(&system, warm.clone(), self.settings.tolerance, limit, WARM_REACH);
            if end.converged {
                return ((end, self.layout.clone()), attempts);
            }
            if end.iterations == 0 {
                far = Some(warm);
            } else {
                attempts.push(Attempt::of("warm start", &end));
            }
        }
        let direct = self.solve(flow, &self.condition, None);
        if direct.converged || (far.is_none() && !self.settings.retry) {
            return ((direct, self.layout.clone()), attempts);
        }
        attempts.push(Attempt::of("march", &direct));
        if let Some(warm) = far {
            let end = self.solve(flow, &self.condition, Some(warm));
            if end.converged {
                return ((end, self.layout.clone()), attempts);
            }
            attempts.push(Attempt::of("warm start", &end));
        }
        if !self.settings.retry {
            return ((direct, self.layout.clone()), attempts);
        }
        let (found, attempts) = Ladder::new(self, flow, attempts).climb();
        (found.unwrap_or_else(|| (direct, self.layout.clone())), attempts)
    }
}
