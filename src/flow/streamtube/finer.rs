//! The way of a flow from a grid to a finer one.
//!
//! A flow is carried over with its transition, which is kept until the flow stands, and let go from there. Where that leads
//! to nothing, a grid in between does.

use super::limits::Limits;
use super::newton::solve;
use super::numbering::{STAGNATION, TRANSITION};
use super::refine::carried_over;
use super::settings::StreamtubeSettings;
use super::solver::{Found, StreamtubeSection, StreamtubeSolver};
use crate::flow::condition::Condition;
use crate::flow::layer::Side;

/// Cells a side and tubes of the coarse grid, on which a flow is sought first.
const COARSE: [usize; 2] = [60, 14];
/// Largest number of steps of a flow that was carried over to another grid, and of those of which nothing comes. Most flows
/// take two.
const CARRIED: (usize, usize) = (12, 6);
/// Residual at which a flow that was carried over with its transition stands well enough to let that go.
const SETTLED: f64 = 0.1;
/// Share of the way from the station of transition to the one nearest to it from which on stations are laid anew.
const NEARER: f64 = 0.75;

impl StreamtubeSection {
    /// Goes on from a flow on a coarser grid.
    pub(super) fn refined(&self, condition: &Condition, coarse: &Found) -> Option<Found> {
        let turning = self.turning_of(condition, &coarse.unknowns);
        let mut problem = self.problem(condition, turning);
        let globals = coarse.unknowns.globals;
        let mut unknowns = carried_over(&coarse.problem, &coarse.unknowns, &problem, globals)?;
        // transition on the finer grid may be elsewhere; it is kept until the flow stands
        problem.fixed_transition = Some(TRANSITION.map(|g| globals[g]));
        let limits = Limits { tolerance: SETTLED, ..self.carried() };
        let mut ended = solve(&problem, None, &mut unknowns, &limits);
        ended.steps += coarse.ended.steps;
        if ended.converged {
            ended = self.followed(condition, &mut problem, &mut unknowns, ended, true);
        }
        Some(self.laid_closer(condition, Found { problem, unknowns, ended }))
    }

    /// A flow on stations that are laid anew where transition is nearer to another station than to its own; the flow as it was
    /// where that is not found. How stations are laid then hardly depends on the way to the flow.
    pub(super) fn laid_closer(&self, condition: &Condition, found: Found) -> Found {
        let globals = found.unknowns.globals;
        let problem = self.problem(condition, self.turning_of(condition, &found.unknowns));
        let [old, new] = [&found.problem, &problem].map(|problem| &problem.grid.stations);
        let far = |side: Side| {
            let k = side.index();
            let [own, other] = [old, new].map(|stations| stations.fractions[stations.turning[k]]);
            let place = globals[TRANSITION[k]] / side.length(globals[STAGNATION], self.curve.total());
            (place - own).abs() > NEARER * (other - own).abs() && other != own
        };
        if !found.ended.converged || !Side::BOTH.into_iter().any(far) {
            return found;
        }
        let Some(mut unknowns) = carried_over(&found.problem, &found.unknowns, &problem, globals) else { return found };
        let mut ended = solve(&problem, None, &mut unknowns, &self.carried());
        ended.steps += found.ended.steps;
        if ended.converged { Found { problem, unknowns, ended } } else { found }
    }

    /// Goes on from a flow on a coarser grid to one between that and the one that is wanted, and from there.
    pub(super) fn refined_by_way_of_another(&self, condition: &Condition, coarse: &Found) -> Option<Found> {
        let between = |from: usize, to: usize| ((from * to) as f64).sqrt().round() as usize;
        let (grid, settings) = (&coarse.problem.grid, &self.solver.settings);
        let cells = between(grid.stations.fractions.len() - 1, settings.cells);
        let middle = self.on_grid([cells, between(grid.half(), settings.tubes)]).refined(condition, coarse)?;
        let fine = if middle.ended.converged { self.refined(condition, &middle) } else { None };
        fine.filter(|fine| fine.ended.converged)
    }

    /// This section for a coarser grid; `None` where the grid is coarse already.
    pub(super) fn on_a_coarser_grid(&self) -> Option<Self> {
        let settings = self.solver.settings;
        let finer = settings.cells > COARSE[0] && settings.tubes > COARSE[1];
        finer.then(|| self.on_grid(COARSE))
    }

    /// This section for a grid with other cells and tubes.
    fn on_grid(&self, [cells, tubes]: [usize; 2]) -> Self {
        let solver = StreamtubeSolver { settings: StreamtubeSettings { cells, tubes, ..self.solver.settings } };
        Self { panels: self.panels.clone(), curve: self.curve.clone(), solver }
    }

    /// Limits of a flow that was carried over to another grid.
    fn carried(&self) -> Limits {
        let (steps, patience) = CARRIED;
        Limits { steps, patience, ..self.last() }
    }
}
