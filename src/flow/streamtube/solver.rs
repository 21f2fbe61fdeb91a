//! The way from a section and an operating point to a solution of the streamtube solver.

use super::equations::Held;
use super::follow::Following;
use super::gas::Parameters;
use super::grading::Stations;
use super::guess::{Guessing, SHIFT, USUAL_TRANSITION, turning_of_trips};
use super::kept::Base;
use super::limits::Limits;
use super::newton::{Ended, solve, solve_near};
use super::numbering::{Grid, STAGNATION, TRANSITION, Unknowns};
use super::outputs::OUTPUTS;
use super::record::StreamtubeRecord;
use super::refine::carried_over;
use super::section_curve::SectionCurve;
use super::settings::StreamtubeSettings;
use super::start::{Guess, climb};
use super::status;
use super::system::Problem;
use crate::flow::condition::{Condition, Incidence, Settings};
use crate::flow::layer::Side;
use crate::flow::solution::{Attempt, Solution};
use crate::flow::solver::{FlowSection, FlowSolver};
use crate::flow::{FlowError, PanelledSection, TrailingEdge};
use std::any::Any;
use std::sync::Arc;

/// Range of the Mach number of the onset flow. Below, the pressures lose their digits against the static pressure;
/// above, the domain is too small for the region of supersonic flow.
const MACH: [f64; 2] = [0.1, 0.9];
/// Largest angle between the onset flow and the chord line, in degrees.
const LARGEST_INCIDENCE: f64 = 15.0;
/// Strength and threshold of the dissipation.
const DISSIPATION: (f64, f64) = (1.0, 0.98);
/// Factors by which transition is expected earlier where that of the slow flow leads to nothing.
const EARLY: [f64; 2] = [0.4, 0.1];
/// Earliest kept transition in fractions of a side, but for transition that is earlier anyhow: a layer among the first
/// stations is not turbulent yet.
const EARLIEST: f64 = 0.02;
/// Mach number of the flow from which the place of free transition is guessed.
const GUESS_MACH: f64 = 0.4;
/// A first guess of a flow.
#[derive(Debug, Clone, Copy)]
struct Start {
    name: &'static str,
    /// Whether stagnation point and circulation are those of the panel flow, or those of a flow at rest at the nose.
    panel: bool,
    /// Whether a lift that is sought is held from the slow flow on.
    lift_first: bool,
    /// Factor of the place at which transition is expected. Early transition, also ahead of a trip, keeps laminar layers from
    /// separating on the way.
    early: f64,
}

/// The use for which a flow is sought.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Purpose {
    /// A shape at an operating point; stations stay those of a neighbour, where there is one.
    Shape,
    /// A trial shape of a design, which is given up sooner.
    Trial,
    /// The next operating point of a sweep, where stations follow transition.
    Sweep,
}

/// The guesses in the order in which they are tried.
const START: [Start; 5] = [
    Start { name: "from the panel flow", panel: true, lift_first: false, early: 1.0 },
    Start { name: "from the panel flow with early transition", panel: true, lift_first: false, early: EARLY[0] },
    Start { name: "from the panel flow with the lift held", panel: true, lift_first: true, early: 1.0 },
    Start {
        name: "from the panel flow with transition close to the nose",
        panel: true,
        lift_first: false,
        early: EARLY[1],
    },
    Start { name: "from the nose", panel: false, lift_first: false, early: EARLY[0] },
];
/// Number of guesses that are tried for a trial shape of a design. Of random flows that are found from nothing, 19 of 20 are
/// with the first two.
const TRIAL_STARTS: usize = 2;
/// Number of steps of which nothing comes until a start on a fine grid is given up, after those on a coarse one. Where they
/// lead to a flow there are at most three in a row.
const BRIEF: usize = 8;
/// Number of times that the stations are laid anew because transition has moved.
const LAYINGS: usize = 4;

/// The streamtube solver with its settings: the Euler equations in streamtubes (the method of Giles and Drela, 1987)
/// solved together with integral boundary layers. It is meant for transonic flow with shocks of moderate strength, and
/// takes subsonic flow down to a Mach number of 0.1.
///
/// ```
/// use aeroform::flow::{Condition, FlowSolver, Incidence, StreamtubeSolver, panel_parameters};
/// use aeroform::section::SectionDefinition;
/// let section = SectionDefinition::parse("naca0012:sharp")?.section()?;
/// let nodes: Vec<[f64; 2]> =
///     panel_parameters(&section, 161).into_iter().map(|u| section.curve().point_at(u)).collect();
/// let condition = Condition { mach: 0.8, trips: [Some(0.1); 2], ..Condition::new(Incidence::Alpha(0.0), 5e6) };
/// let solution =
///     StreamtubeSolver::default().section(&nodes, section.trailing_edge())?.analyze(&condition, None)?;
/// assert!(solution.is_reliable());
/// assert!((solution.coefficients.cd - 0.0156).abs() < 3e-4 && (solution.cd_wave - 0.0058).abs() < 2e-4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StreamtubeSolver {
    /// Resolution and limits of every analysis.
    pub settings: StreamtubeSettings,
}

impl FlowSolver for StreamtubeSolver {
    fn name(&self) -> &'static str {
        "streamtube"
    }

    fn check(&self, condition: &Condition) -> Result<(), FlowError> {
        condition.check()?;
        self.settings.check()?;
        if (MACH[0]..=MACH[1]).contains(&condition.mach) {
            return Ok(());
        }
        Err(FlowError::Condition { name: "Mach number", value: condition.mach, allowed: "from 0.1 to 0.9" })
    }

    fn gains_from_neighbours(&self) -> bool {
        true
    }

    fn section(&self, nodes: &[[f64; 2]], trailing_edge: TrailingEdge) -> Result<Box<dyn FlowSection>, FlowError> {
        let panels = PanelledSection::new(nodes, trailing_edge)?;
        let curve = SectionCurve::new(&panels.nodes.inside).ok_or(FlowError::UnevenNodes)?;
        Ok(Box::new(StreamtubeSection { panels, curve, solver: *self }))
    }
}

/// A section prepared for the streamtube solver.
#[derive(Debug)]
pub(super) struct StreamtubeSection {
    pub panels: PanelledSection,
    pub curve: SectionCurve<f64>,
    pub solver: StreamtubeSolver,
}

impl FlowSection for StreamtubeSection {
    fn analyze(&self, condition: &Condition, warm: Option<&Solution>) -> Result<Solution, FlowError> {
        self.check(condition)?;
        Ok(self.solution(condition, warm, Purpose::Shape))
    }

    fn analyze_trial(&self, condition: &Condition, near: &Solution) -> Result<Solution, FlowError> {
        self.check(condition)?;
        Ok(self.solution(condition, Some(near), Purpose::Trial))
    }

    fn analyze_next(&self, condition: &Condition, last: Option<&Solution>) -> Result<Solution, FlowError> {
        self.check(condition)?;
        Ok(self.solution(condition, last, Purpose::Sweep))
    }
}

impl StreamtubeSection {
    fn check(&self, condition: &Condition) -> Result<(), FlowError> {
        self.solver.check(condition)?;
        if let Incidence::Alpha(alpha) = condition.incidence {
            let degrees = self.panels.nodes.frame.incidence(alpha).to_degrees();
            let value = (degrees * 1e9).round() / 1e9;
            if !(value.abs() <= LARGEST_INCIDENCE) {
                let name = "angle between the onset flow and the chord line (degrees)";
                return Err(FlowError::Condition { name, value, allowed: "from -15 to 15" });
            }
        }
        Ok(())
    }
}

/// The end of a search: the flow that was sought, its last state and how the iteration ended.
pub(super) struct Found {
    pub problem: Problem,
    pub unknowns: Unknowns,
    pub ended: Ended,
}

impl StreamtubeSection {
    /// The flow at an operating point, from a neighbouring one where there is one.
    fn solution(&self, condition: &Condition, warm: Option<&Solution>, purpose: Purpose) -> Solution {
        let mut attempts = Vec::new();
        let record = warm.and_then(|solution| {
            let record: &dyn Any = &*solution.record;
            record.downcast_ref::<StreamtubeRecord>().filter(|_| solution.is_solved())
        });
        let near = record.and_then(|record| self.continued(condition, record, &mut attempts));
        let near = near.map(|found| match purpose {
            Purpose::Sweep => self.laid_closer(condition, found),
            Purpose::Shape | Purpose::Trial => found,
        });
        let found = near.unwrap_or_else(|| self.climbed(condition, purpose, &mut attempts));
        let Found { problem, unknowns, ended } = found;
        let mut record = StreamtubeRecord::new(problem, unknowns, self.panels.nodes.clone());
        record.base.clone_from(&ended.base);
        let status = status::of(&record, &ended, &self.solver.settings);
        if !ended.residual.is_finite() {
            // what never was a flow has no coefficients
            record.outputs = [f64::NAN; OUTPUTS];
        }
        let coefficients = record.coefficients();
        let cd_friction = record.friction_drag();
        Solution {
            status,
            solver: self.solver.name(),
            condition: *condition,
            alpha: self.panels.nodes.frame.alpha(record.alpha()),
            coefficients,
            cd_pressure: coefficients.cd - cd_friction,
            cd_friction,
            cd_wave: record.wave_drag(),
            stagnation: record.stagnation(),
            residual: ended.residual,
            iterations: ended.steps,
            attempts,
            record: Arc::new(record),
        }
    }

    /// The flow that is sought, with transition expected at fractions of the sides.
    pub(super) fn problem(&self, condition: &Condition, turning: [f64; 2]) -> Problem {
        let (held, incidence) = match condition.incidence {
            Incidence::Alpha(alpha) => (Held::Angle, self.panels.nodes.frame.incidence(alpha)),
            Incidence::Lift(lift) => (Held::Lift, lift),
        };
        Problem {
            grid: Grid { stations: Stations::new(self.solver.settings.size(), turning), viscous: true },
            nodes: self.panels.nodes.inside.clone(),
            trips: condition.trips,
            critical: condition.n_critical,
            held,
            fixed_transition: None,
            parameters: Parameters {
                mach: condition.mach,
                reynolds: condition.reynolds,
                incidence,
                strength: DISSIPATION.0,
                threshold: DISSIPATION.1,
                order: 1.0,
            },
        }
    }

    /// Starts from the solution of a neighbouring flow; `None` where that does not lead to one.
    fn continued(
        &self,
        condition: &Condition,
        record: &StreamtubeRecord,
        attempts: &mut Vec<Attempt>,
    ) -> Option<Found> {
        let old = &record.problem;
        let mut problem = self.problem(condition, [0.1; 2]);
        // the stations of transition are those of the neighbour; for other trips they do not fit
        problem.grid.stations.turning = old.grid.stations.turning;
        let fits = problem.grid == old.grid
            && problem.nodes.len() == old.nodes.len()
            && problem.held == old.held
            && problem.trips == old.trips
            && problem.critical == old.critical;
        if !fits {
            return None;
        }
        let mut unknowns = record.unknowns.clone();
        let limits = self.last();
        let base =
            record.base.clone().unwrap_or_else(|| Arc::new(Base { problem: old.clone(), unknowns: unknowns.clone() }));
        let ended = solve_near(&problem, old, &base, &mut unknowns, &limits);
        if ended.converged && self.misplaced(&problem, &unknowns).is_none() {
            return Some(Found { problem, unknowns, ended });
        }
        attempts.push(Attempt::of("from the neighbouring flow", ended.steps, ended.residual));
        None
    }

    /// The fractions at which stations should be laid for transition, where they stand too far from it.
    fn misplaced(&self, problem: &Problem, unknowns: &Unknowns) -> Option<[f64; 2]> {
        let stations = &problem.grid.stations;
        let trips = turning_of_trips(problem.trips).map(|turning| turning.unwrap_or(f64::NAN));
        let laid_for_trips = {
            let tripped = Stations::new(self.solver.settings.size(), trips).turning;
            [0, 1].map(|k| tripped[k] == stations.turning[k])
        };
        let fraction = |side: Side| {
            let length = side.length(unknowns.globals[STAGNATION], self.curve.total());
            unknowns.globals[TRANSITION[side.index()]] / length
        };
        let far = |side: Side| {
            let k = side.index();
            let mut expected = stations.fractions[stations.turning[k]];
            if laid_for_trips[k]
                && let Some(x) = problem.trips[k].filter(|x| *x < 1.0)
            {
                // the station follows the trip
                let trip = self.curve.arc_length(self.curve.index_at_x(side, x));
                let stagnation = unknowns.globals[STAGNATION];
                expected = side.distance(stagnation, trip) / side.length(stagnation, self.curve.total());
            }
            (fraction(side) - expected).abs() > SHIFT * expected.min(1.0 - expected)
        };
        Side::BOTH.into_iter().any(far).then(|| Side::BOTH.map(fraction))
    }

    /// Starts from nothing, and from other guesses where the first one fails. A flow is sought on a coarse grid first
    /// and carried over; that is quicker, and leads to flows that are not found on a fine grid from nothing.
    fn climbed(&self, condition: &Condition, purpose: Purpose, attempts: &mut Vec<Attempt>) -> Found {
        let slow = self.slow(condition);
        let starts = if purpose == Purpose::Trial { &START[..TRIAL_STARTS] } else { &START };
        let Some(coarse) = self.on_a_coarser_grid() else {
            let found = self.started(condition, slow.as_ref(), starts, attempts);
            return self.laid_closer(condition, found);
        };
        let on_coarse = coarse.started(condition, slow.as_ref(), starts, attempts);
        let retry = self.solver.settings.retry;
        let known = on_coarse.ended.converged;
        if known {
            let direct = self.refined(condition, &on_coarse);
            if !retry && let Some(fine) = direct {
                return fine;
            }
            let fine = direct.filter(|fine| fine.ended.converged);
            if let Some(fine) = fine.or_else(|| self.refined_by_way_of_another(condition, &on_coarse)) {
                return fine;
            }
            attempts.push(Attempt::of("from a coarser grid", on_coarse.ended.steps, on_coarse.ended.residual));
        }
        if purpose == Purpose::Trial {
            return on_coarse;
        }
        // what is not found by way of a coarse grid is seldom found without it: it is not sought for long
        let found = self.guessed(condition, slow.as_ref(), START[0], attempts);
        if found.ended.converged || !retry {
            return found;
        }
        attempts.push(Attempt::of(START[0].name, found.ended.steps, found.ended.residual));
        // a coarser grid shows at least what kind of flow it is
        if known { on_coarse } else { found }
    }

    /// Starts from one guess after the other on this grid. Where none leads to a flow, the result is the state that came
    /// nearest to one.
    fn started(
        &self,
        condition: &Condition,
        slow: Option<&Solution>,
        starts: &[Start],
        attempts: &mut Vec<Attempt>,
    ) -> Found {
        let lifted = matches!(condition.incidence, Incidence::Lift(_));
        let retry = self.solver.settings.retry;
        let mut nearest: Option<Found> = None;
        for &start in starts.iter().filter(|start| lifted || !start.lift_first) {
            let found = self.guessed(condition, slow, start, attempts);
            if found.ended.converged || !retry {
                return found;
            }
            attempts.push(Attempt::of(start.name, found.ended.steps, found.ended.residual));
            // written so that NaN is farthest
            if nearest.as_ref().is_none_or(|nearest| !(nearest.ended.residual <= found.ended.residual)) {
                nearest = Some(found);
            }
        }
        nearest.unwrap_or_else(|| self.guessed(condition, slow, START[0], attempts))
    }

    /// Fractions of the sides at which the layers of a flow turn turbulent, with those of the trips where they do there.
    pub(super) fn turning_of(&self, condition: &Condition, unknowns: &Unknowns) -> [f64; 2] {
        let trips = turning_of_trips(condition.trips);
        let stagnation = unknowns.globals[STAGNATION];
        Side::BOTH.map(|side| {
            let (k, length) = (side.index(), side.length(stagnation, self.curve.total()));
            let place = unknowns.globals[TRANSITION[k]];
            let trip = trips[k].zip(self.trip(condition, side));
            match trip {
                Some((turning, trip)) if place > (1.0 - SHIFT) * side.distance(stagnation, trip) => turning,
                _ => place / length,
            }
        })
    }

    /// Arc length from the first node to the trip of a side.
    pub(super) fn trip(&self, condition: &Condition, side: Side) -> Option<f64> {
        let x = condition.trips[side.index()].filter(|x| *x < 1.0)?;
        Some(self.curve.arc_length(self.curve.index_at_x(side, x)))
    }

    /// Leads a flow with fixed transition to one with free transition; `known` says whether a flow on another grid has it
    /// there.
    pub(super) fn followed(
        &self,
        condition: &Condition,
        problem: &mut Problem,
        unknowns: &mut Unknowns,
        before: Ended,
        known: bool,
    ) -> Ended {
        let trips = turning_of_trips(condition.trips);
        let lay = |fractions: [f64; 2]| {
            let at = |k: usize| match trips[k] {
                // close to a trip the stations are those of the trip
                Some(turning) if fractions[k] > (1.0 - SHIFT) * turning => turning,
                _ => fractions[k],
            };
            self.problem(condition, [at(0), at(1)])
        };
        let following = Following {
            lay: &lay,
            trips: Side::BOTH.map(|side| self.trip(condition, side)),
            total: self.curve.total(),
            settings: &self.solver.settings,
        };
        following.follow(problem, unknowns, before, known)
    }

    /// Starts from the panel flow, or from a stagnation point at the nose with stricter limits of the steps. Stations are
    /// laid anew where transition ends far from its station.
    fn guessed(
        &self,
        condition: &Condition,
        slow: Option<&Solution>,
        Start { panel, lift_first, early, .. }: Start,
        attempts: &mut Vec<Attempt>,
    ) -> Found {
        let guessing = Guessing::new(&self.panels, &self.curve);
        let mut guess = Guess { lift_first, ..guessing.outer(condition, panel) };
        // steps on a fine grid take long, and a coarse one has shown that they may lead nowhere
        if self.on_a_coarser_grid().is_some() {
            guess.patience = BRIEF;
        }
        let mut turning = guessing.turning(condition, slow, guess.alpha);
        guess.layers = slow.map(|solution| {
            let distributions = solution.distributions();
            [distributions.upper, distributions.lower]
        });
        let trips = turning_of_trips(condition.trips);
        turning = turning.map(|fraction| (early * fraction).max(EARLIEST.min(fraction)));
        let mut problem = self.problem(condition, turning);
        for side in Side::BOTH {
            let (k, length) = (side.index(), side.length(guess.stagnation, self.curve.total()));
            let trip = self.trip(condition, side).filter(|_| trips[k] == Some(turning[k]));
            guess.transition[k] = match trip {
                Some(trip) => side.distance(guess.stagnation, trip).max(0.25 * turning[k] * length),
                None => turning[k] * length,
            };
        }
        let (mut unknowns, mut ended) = climb(&problem, &guess, &self.solver.settings);
        problem.fixed_transition = Some(guess.transition);
        if ended.converged {
            ended = self.followed(condition, &mut problem, &mut unknowns, ended, false);
        }
        self.laid_anew(condition, Found { problem, unknowns, ended }, attempts)
    }

    /// The flow with stations laid anew while transition stands far from its stations.
    fn laid_anew(&self, condition: &Condition, mut found: Found, attempts: &mut Vec<Attempt>) -> Found {
        for _ in 0..LAYINGS {
            let Some(better) = found.ended.converged.then(|| self.misplaced(&found.problem, &found.unknowns)).flatten()
            else {
                break;
            };
            attempts.push(Attempt::of("stations of transition", found.ended.steps, found.ended.residual));
            // a layer that turned turbulent elsewhere than where it was to be tripped is expected there
            let turning = better.map(|f| if f.is_finite() { f.clamp(0.005, 0.97) } else { USUAL_TRANSITION });
            let problem = self.problem(condition, turning);
            let globals = found.unknowns.globals;
            let Some(mut unknowns) = carried_over(&found.problem, &found.unknowns, &problem, globals) else { break };
            let mut ended = solve(&problem, None, &mut unknowns, &self.last());
            ended.steps += found.ended.steps;
            found = Found { problem, unknowns, ended };
        }
        found
    }

    /// Limits of the last stage of a start.
    pub(super) fn last(&self) -> Limits {
        let settings = &self.solver.settings;
        Limits::new(settings.iterations, settings.tolerance)
    }

    /// A slower flow of the panel solver at about the angle of attack that is sought. Transition and the first layers are
    /// guessed from it.
    fn slow(&self, condition: &Condition) -> Option<Solution> {
        let alpha = Guessing::new(&self.panels, &self.curve).alpha(condition);
        let incidence = Incidence::Alpha(self.panels.nodes.frame.alpha(alpha));
        let slower = Condition { mach: condition.mach.min(GUESS_MACH), incidence, ..*condition };
        let settings = Settings { retry: false, ..Settings::default() };
        self.panels.analyze(&slower, &settings, None).ok().filter(Solution::is_solved)
    }
}
