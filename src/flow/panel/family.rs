//! The flow that is asked for about one section, its neighbours, and the ways to find it.

use super::coupling::response::{FlowResponse, SectionResponse};
use super::coupling::system::{Evaluated, Linearised, Stream, System};
use super::outputs::highest_mach;
use super::polar::Straight;
use crate::flow::condition::Settings;
use crate::flow::layer::transport::resample;
use crate::flow::layer::{Layout, Unknowns};
use crate::flow::search::{self, Effort, End, Family, newton};
use crate::flow::solution::Attempt;
use crate::flow::surface::SurfaceMap;

/// Largest number of iterations of a warm start; a march is closer to a flow that takes more.
const WARM_ITERATIONS: usize = 8;
/// First move of transition, in lengths of the side, beyond which a march is closer to the flow than a warm start.
const WARM_REACH: f64 = 0.1;

/// Iterations without progress after which the direct attempt is given up where other ways
/// may follow. Of 434 random flows that it finds with the
/// usual patience it finds 422 with this one, and saves on the others more than those twelve cost.
const DIRECT_PATIENCE: usize = 5;

/// Share of the requested stations on which a cold start looks for the flow first.
const FEW: f64 = 0.6;
/// Least number of stations of a regime on a side there.
const LEAST_STATIONS: usize = 8;
/// Largest residual of the flow on few stations. More accuracy would be lost in the passage to all of them.
const ROUGH: f64 = 0.1;
/// Largest number of iterations from there. A good start needs one to three.
const ITERATIONS_FROM_FEW: usize = 12;

/// Highest local Mach number without boundary layer above which no layer makes a flow subsonic.
const HOPELESS_MACH: f64 = 1.2;
/// Share of the usual work for a search above that Mach number.
const LITTLE_HOPE: f64 = 0.12;

/// The requested flow and its neighbours about one section, with one wake.
pub(crate) struct PanelFamily<'a> {
    pub section: &'a SectionResponse,
    pub flow: &'a FlowResponse,
    pub layout: &'a Layout,
    pub stream: Stream,
    pub settings: Settings,
}

impl PanelFamily<'_> {
    /// Tries a warm start unless it is far off, then a cold start by way of few stations and one without, then easier
    /// conditions that lead to the requested one. The result comes with the layout of the stations it stands on and with
    /// the attempts that failed.
    pub fn converge(&self, warm: Option<Unknowns>) -> ((End<Evaluated>, Layout), Vec<Attempt>) {
        let Settings { tolerance, iterations, retry, .. } = self.settings;
        let system = self.equations(self.flow, self.layout, self.stream.trips);
        let as_wanted = |end| (end, self.layout.clone());
        let mut attempts = Vec::new();
        let mut note =
            |what: &str, end: &End<Evaluated>| attempts.push(Attempt::of(what, end.iterations, end.residual));
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
        // fewer stations are easier conditions
        if retry {
            let (layout, few) = self.on_few_stations();
            if few.converged {
                let start = resample(&layout, self.layout, &few.unknowns, self.surface());
                let end = newton::solve(&system, start, Effort::new(tolerance, iterations.min(ITERATIONS_FROM_FEW)));
                if end.converged {
                    return (as_wanted(end), attempts);
                }
                note("march on few stations and from there", &end);
            } else {
                note("march on few stations", &few);
            }
        }
        let mut effort = Effort::new(tolerance, iterations);
        if retry {
            effort.patience = DIRECT_PATIENCE;
        }
        let direct = newton::solve(&system, system.march(), effort);
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

    /// The rough flow on few stations, whose iterations cost a third, with the layout of these stations.
    fn on_few_stations(&self) -> (Layout, End<Evaluated>) {
        let fewer = |stations: &[f64]| ((stations.len() as f64 * FEW).round() as usize).max(LEAST_STATIONS);
        let layout = Layout::new(fewer(&self.layout.laminar), fewer(&self.layout.turbulent), self.layout.wake);
        let system = self.equations(self.flow, &layout, self.stream.trips);
        let effort = Effort { patience: DIRECT_PATIENCE, ..Effort::new(ROUGH, self.settings.iterations) };
        let end = newton::solve(&system, system.march(), effort);
        (layout, end)
    }
}

impl Family for PanelFamily<'_> {
    type Outer = FlowResponse;
    type Evaluated = Evaluated;
    type At = Linearised;
    type Factors = super::coupling::reduced::Reduced;
    type Equations<'b>
        = System<'b>
    where
        Self: 'b;

    fn surface(&self) -> &SurfaceMap {
        &self.section.map
    }

    fn layout(&self) -> &Layout {
        self.layout
    }

    fn tolerance(&self) -> f64 {
        self.settings.tolerance
    }

    fn hope(&self) -> f64 {
        let mach = highest_mach(self.section, &self.flow.inviscid, self.stream.mach);
        if mach > HOPELESS_MACH { LITTLE_HOPE } else { 1.0 }
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
