//! The flow that is asked for about one section, its neighbours, and the ways to find it.

use super::coupling::response::{FlowResponse, SectionResponse};
use super::coupling::system::{Evaluated, Linearised, Stream, System};
use super::outputs::highest_mach;
use super::polar::Straight;
use crate::flow::condition::Settings;
use crate::flow::layer::transport::resample;
use crate::flow::layer::{Layout, Unknowns};
use crate::flow::search::{self, Effort, End, Family, Start, newton};
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

/// Shares of the requested stations on which a cold start looks for the flow first, one after the other. Of 1500 random
/// flows, 64 are left for other ways with the first alone, and 43 with both.
const FEW: [f64; 2] = [0.5, 0.6];
/// Least number of stations of a regime on a side there.
const LEAST_STATIONS: usize = 8;
/// Largest residual of the flow on few stations. More accuracy would be lost in the passage to all of them.
const ROUGH: f64 = 0.1;
/// Largest number of iterations from there. A good start needs one to three.
const ITERATIONS_FROM_FEW: usize = 12;

/// Share of a step from a march below which other ways are tried. On few stations steps as short as this led on in 27 of the
/// 229 random flows about real sections, of 300, that Newton's method finds alone, and these are found by other ways as soon.
const SHORTEST_STEP: f64 = 0.1;

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
                attempts.push(failed("warm start", &end));
            }
        }
        let mut by_few = |share| self.by_few_stations(&system, share, &mut attempts);
        if retry && let Some(end) = FEW.into_iter().find_map(&mut by_few) {
            return (as_wanted(end), attempts);
        }
        let mut effort = Effort::new(tolerance, iterations);
        if retry {
            effort = Effort { patience: DIRECT_PATIENCE, shortest: SHORTEST_STEP, ..effort };
        }
        let direct = newton::solve(&system, system.march(), effort);
        if direct.converged || (far.is_none() && !retry) {
            return (as_wanted(direct), attempts);
        }
        attempts.push(failed("march", &direct));
        if let Some(warm) = far {
            let end = newton::solve(&system, warm, Effort::new(tolerance, iterations));
            if end.converged {
                return (as_wanted(end), attempts);
            }
            attempts.push(failed("warm start", &end));
        }
        if !retry {
            return (as_wanted(direct), attempts);
        }
        let (found, attempts) = search::climb(self, self.flow, attempts);
        (found.unwrap_or_else(|| as_wanted(direct)), attempts)
    }

    /// A cold start by way of a rough flow on a share of the stations, which are easier conditions: Newton's method from a
    /// march or, where that soon goes astray, with transition held in place. The attempts that fail are noted.
    fn by_few_stations(&self, system: &System, share: f64, attempts: &mut Vec<Attempt>) -> Option<End<Evaluated>> {
        let Settings { tolerance, iterations, .. } = self.settings;
        let layout = self.few_stations(share);
        let few = self.equations(self.flow, &layout, self.stream.trips);
        let marched = few.march();
        let effort = Effort { patience: DIRECT_PATIENCE, shortest: SHORTEST_STEP, ..Effort::new(ROUGH, iterations) };
        let end = newton::solve(&few, marched.clone(), effort);
        let rough = if end.converged {
            end.unknowns
        } else {
            attempts.push(failed(&format!("march on {share} of the stations"), &end));
            let (held, attempt) = search::by_held_transition(self, self.flow, &layout, Start::Marched(&marched));
            if held.is_none() {
                attempts.push(attempt);
            }
            held?
        };
        let effort =
            Effort { patience: DIRECT_PATIENCE, ..Effort::new(tolerance, iterations.min(ITERATIONS_FROM_FEW)) };
        let passage = resample(&layout, self.layout, &rough, self.surface());
        let end = newton::solve(system, passage.clone(), effort);
        if end.converged {
            return Some(end);
        }
        attempts.push(failed(&format!("from {share} of the stations"), &end));
        let (held, attempt) = search::by_held_transition(self, self.flow, self.layout, Start::Found(&passage));
        if held.is_none() {
            attempts.push(attempt);
        }
        let end = newton::solve(system, held?, effort);
        if !end.converged {
            attempts.push(failed("from held transition", &end));
        }
        end.converged.then_some(end)
    }

    /// The layout with a share of the stations. On half of them an iteration costs a quarter.
    fn few_stations(&self, share: f64) -> Layout {
        let fewer = |stations: &[f64]| ((stations.len() as f64 * share).round() as usize).max(LEAST_STATIONS);
        Layout::new(fewer(&self.layout.laminar), fewer(&self.layout.turbulent), self.layout.wake)
    }
}

/// The record of an attempt.
fn failed(what: &str, end: &End<Evaluated>) -> Attempt {
    Attempt::of(what, end.iterations, end.residual)
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

    fn held<'b>(&'b self, flow: &'b FlowResponse, layout: &'b Layout, places: [f64; 2]) -> System<'b> {
        // no amplification is ever critical
        let stream = Stream { trips: places.map(Some), n_critical: f64::INFINITY, ..self.stream };
        System::new(self.section, flow, layout, stream)
    }
}
