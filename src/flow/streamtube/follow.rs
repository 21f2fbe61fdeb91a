//! Free transition, followed by flows with fixed transition one after the other.
//!
//! A flow whose transition is kept somewhere converges as well as a tripped one, also where the laminar layer separates.
//! Its amplification says where transition wants to be. Stations are laid there and the flow is carried over, until
//! transition stands close enough for Newton's method to find its place together with all other unknowns.

use super::limits::Limits;
use super::newton::{Ended, solve};
use super::numbering::{SPEED, STAGNATION, Sheet, TRANSITION, Unknowns};
use super::refine::carried_over;
use super::settings::StreamtubeSettings;
use super::start::NEARLY;
use super::system::Problem;
use crate::flow::layer::{EdgeLaw, Side};
use std::ops::Range;

/// Largest number of flows with fixed transition.
const FLOWS: usize = 16;
/// Largest number of Newton steps of one of them, and of those of which nothing comes. Most flows take two to four steps.
const STEPS: (usize, usize) = (20, 6);
/// Distances of transition from its wanted place from which on it is let go, one after the other, over its distance from
/// the nearer end of the side. At a shock only the nearer one may do.
const NEAR: [f64; 2] = [0.08, 0.005];
/// Number of steps of which nothing comes where transition was let go far from its wanted place.
const FAR: usize = 12;
/// Number of Newton steps after which transition that was let go where a flow on another grid has it is held again, number of
/// those of which nothing comes, and growth of the residual. Most flows take two to five steps; others go astray with the first
/// one.
const BRIEF: (usize, usize, f64) = (12, 6, 8.0);
/// Distances of transition from its wanted place between which it is moved there then. A wanted place that is farther away is
/// not to be relied on.
const NEARER: [f64; 2] = [0.02, 0.15];

/// A way to get near the wanted place before transition is let go.
#[derive(Debug, Clone, Copy)]
enum Approach {
    /// Transition is let go where it stands.
    None,
    /// Whole moves to within the first distance, as long as it is not farther than the second one.
    Near([f64; 2]),
    /// Whole moves to within a distance, as long as they lead to flows.
    Bold(f64),
    /// Moves to within a distance, which are shortened where they lead to no flow.
    Careful(f64),
}

/// The ways in which transition is approached from a guess.
const FROM_A_GUESS: [Approach; 3] = [Approach::Bold(NEAR[0]), Approach::Careful(NEAR[0]), Approach::Careful(NEAR[1])];
/// The ways in which transition is approached from where a flow on another grid has it.
const FROM_A_FLOW: [Approach; 3] = [Approach::None, Approach::Near(NEARER), Approach::Careful(NEAR[1])];
/// Largest ratio of the place of transition after and before a move, and of that from the edge.
const MOVE: f64 = 1.5;
/// Shares of a move that are tried one after the other.
const SHARES: [f64; 3] = [1.0, 0.4, 0.1];
/// Last place of transition, as fraction of the side.
const LAST: f64 = 0.9995;

/// Least and largest change of the distance to the wanted place per change of the place of transition.
const SLOPES: [f64; 2] = [-8.0, -0.5];

/// The secant rule for the place of transition of a side. A bubble that grows with the laminar layer brings the wanted
/// place forward as transition goes back, so that going to the wanted place would swing from side to side.
#[derive(Debug, Clone, Copy, Default)]
struct Rule {
    /// The last place, and the distance of the wanted one from there.
    last: Option<[f64; 2]>,
    /// Change of the distance per change of the place, where two places are known.
    slope: Option<f64>,
}

impl Rule {
    /// The move from a place, from which the wanted place has a distance.
    fn next(&mut self, place: f64, distance: f64) -> f64 {
        let [least, most] = SLOPES;
        if let Some([before, old]) = self.last.replace([place, distance]) {
            let slope = (distance - old) / (place - before);
            // a move of nothing says nothing, and leaves what is known
            self.slope = if slope.is_finite() { Some(slope.clamp(least, most)) } else { self.slope };
        }
        -distance / self.slope.unwrap_or(-1.0)
    }
}

/// A flow whose transition is to be found.
pub(super) struct Following<'a> {
    /// The flow that is sought, with stations for transition at fractions of the sides.
    pub lay: &'a dyn Fn([f64; 2]) -> Problem,
    /// Arc lengths of the trips from the first node.
    pub trips: [Option<f64>; 2],
    /// Length of the surface.
    pub total: f64,
    pub settings: &'a StreamtubeSettings,
}

/// The flow with transition let go.
fn released(problem: &Problem, unknowns: &Unknowns, limits: &Limits) -> (Problem, Unknowns, Ended) {
    let released = Problem { fixed_transition: None, ..problem.clone() };
    let mut state = unknowns.clone();
    let ended = solve(&released, None, &mut state, limits);
    (released, state, ended)
}

impl Following<'_> {
    /// Leads a flow with fixed transition to one with free transition; `known` says whether a flow on another grid has it
    /// there. Where free transition is not found, problem and unknowns hold the last flow with fixed transition.
    pub fn follow(&self, problem: &mut Problem, unknowns: &mut Unknowns, before: Ended, known: bool) -> Ended {
        let mut steps = before.steps;
        let mut rules = [Rule::default(); 2];
        let mut ended = before;
        // whether whole moves have led to no flow, and where transition was let go in vain
        let (mut failed, mut left) = (false, None);
        for approach in if known { FROM_A_FLOW } else { FROM_A_GUESS } {
            let moves = match approach {
                Approach::None => None,
                Approach::Near(range) => Some((range, 0..1)),
                Approach::Bold(near) => Some(([near, f64::INFINITY], 0..1)),
                Approach::Careful(near) => Some(([near, f64::INFINITY], usize::from(failed)..SHARES.len())),
            };
            let arrived =
                moves.map(|(range, shares)| self.approach(problem, unknowns, &mut rules, range, shares, &mut steps));
            failed |= arrived == Some(false);
            let here = TRANSITION.map(|g| unknowns.globals[g]);
            if left.replace(here) != Some(here) {
                let usual = Limits::new(self.settings.iterations, self.settings.tolerance);
                let limits = match arrived {
                    Some(true) => usual,
                    Some(false) => Limits { patience: FAR, ..usual },
                    None => {
                        let (most, patience, growth) = BRIEF;
                        Limits { steps: most.min(usual.steps), patience, growth, ..usual }
                    }
                };
                let (released, state, end) = released(problem, unknowns, &limits);
                steps += end.steps;
                ended = Ended { steps, ..end };
                if ended.converged {
                    (*problem, *unknowns) = (released, state);
                    break;
                }
            }
            // moves that led to no flow would not do so either another time
            if arrived == Some(false) && matches!(approach, Approach::Careful(_)) {
                break;
            }
        }
        ended
    }

    /// Moves transition until it stands within the share `near` of the way to the nearer end of the side from its wanted
    /// place, by the [`SHARES`] of moves with the numbers `shares`, smaller ones where larger ones lead to no flow. Nothing is
    /// moved that stands farther away than the share `far`. The result is whether it stands there.
    fn approach(
        &self,
        problem: &mut Problem,
        unknowns: &mut Unknowns,
        rules: &mut [Rule; 2],
        [near, far]: [f64; 2],
        shares: Range<usize>,
        steps: &mut usize,
    ) -> bool {
        // number of the largest share that is tried
        let mut largest = shares.start;
        for _ in 0..FLOWS {
            let now = TRANSITION.map(|g| unknowns.globals[g]);
            let lengths = Side::BOTH.map(|side| side.length(unknowns.globals[STAGNATION], self.total));
            let moves: [f64; 2] =
                std::array::from_fn(|k| rules[k].next(now[k], self.wanted(problem, unknowns, Side::BOTH[k]) - now[k]));
            let away = |k: usize| moves[k].abs() / now[k].min(lengths[k] - now[k]);
            let most = away(0).max(away(1));
            // written so that NaN is not there
            if most <= near || !(most <= far) {
                return most <= near;
            }
            let targets: [f64; 2] = std::array::from_fn(|k| {
                let rest = lengths[k] - now[k];
                let least = (now[k] / MOVE).max(lengths[k] - MOVE * rest);
                (now[k] + moves[k]).clamp(least, (MOVE * now[k]).min(lengths[k] - rest / MOVE))
            });
            let moved = (largest..shares.end).find_map(|number| {
                let places = std::array::from_fn(|k| now[k] + SHARES[number] * (targets[k] - now[k]));
                let (next, state, ended) = self.fixed(problem, unknowns, places, lengths)?;
                *steps += ended.steps;
                // the next move may be a little bolder
                largest = number.saturating_sub(1);
                ended.converged.then_some((next, state))
            });
            let Some((next, state)) = moved else { return false };
            (*problem, *unknowns) = (next, state);
        }
        false
    }

    /// The flow with transition kept at other places, from one nearby.
    fn fixed(
        &self,
        problem: &Problem,
        unknowns: &Unknowns,
        places: [f64; 2],
        lengths: [f64; 2],
    ) -> Option<(Problem, Unknowns, Ended)> {
        let laid = (self.lay)(std::array::from_fn(|k| places[k] / lengths[k]));
        let next = Problem { fixed_transition: Some(places), ..laid };
        let mut from = unknowns.clone();
        for (g, place) in TRANSITION.into_iter().zip(places) {
            from.globals[g] = place;
        }
        let mut state = carried_over(problem, unknowns, &next, from.globals)?;
        let (steps, patience) = STEPS;
        let limits = Limits { patience, ..Limits::new(steps, NEARLY) };
        let ended = solve(&next, None, &mut state, &limits);
        Some((next, state, ended))
    }

    /// The place at which the amplification of a layer becomes critical, as arc length from the stagnation point: at a
    /// trip at the latest, and behind transition by extrapolation.
    fn wanted(&self, problem: &Problem, unknowns: &Unknowns, side: Side) -> f64 {
        let (grid, k) = (&problem.grid, side.index());
        let stagnation = unknowns.globals[STAGNATION];
        let length = side.length(stagnation, self.total);
        let trip = self.trips[k].map_or(f64::INFINITY, |trip| side.distance(stagnation, trip));
        let limit = trip.min(LAST * length);
        let Some(geometry) = problem.geometry(unknowns) else { return unknowns.globals[TRANSITION[k]] };
        let arcs = &geometry.wall.arcs[k];
        let turning = grid.stations.turning[k];
        let amplification =
            |number: usize| unknowns.at(grid.layer(grid.stations.nose() + number, Sheet::Wall(side), 2));
        let critical = problem.critical;
        let first = (2..=turning).find(|&n| amplification(n) >= critical).unwrap_or(turning);
        let (a, b) = (amplification(first - 1), amplification(first));
        let rise = (b - a) / (arcs[first] - arcs[first - 1]);
        let place = if rise > 0.0 { arcs[first] + (critical - b) / rise } else { limit };
        let speeds = log_speeds_behind(problem, unknowns, side, arcs);
        let shock = shock(&arcs[turning..], &speeds, &problem.flow().stream);
        place.max(0.0).min(limit).min(shock.unwrap_or(limit))
    }
}

/// Logarithms of the speeds at the edge of the layer of a side, from transition on.
fn log_speeds_behind(problem: &Problem, unknowns: &Unknowns, side: Side, arcs: &[f64]) -> Vec<f64> {
    let grid = &problem.grid;
    let place = |number: usize| grid.layer(grid.stations.nose() + number, Sheet::Wall(side), SPEED);
    (grid.stations.turning[side.index()]..arcs.len()).map(|number| unknowns.at(place(number))).collect()
}

/// The place of a shock in a flow that is supersonic at the first place: where the speed falls most steeply on the way to
/// subsonic flow. A laminar layer does not pass a shock, so that extrapolation from ahead of one says nothing of what is behind.
fn shock(arcs: &[f64], log_speeds: &[f64], stream: &impl EdgeLaw<Number = f64>) -> Option<f64> {
    let is_supersonic = |log_speed: &f64| stream.edge(log_speed.exp()).mach2 >= 1.0;
    let supersonic = log_speeds.iter().take_while(|v| is_supersonic(v)).count();
    let fall = |n: &usize| (log_speeds[*n] - log_speeds[n + 1]) / (arcs[n + 1] - arcs[*n]);
    let falls = 0..supersonic.min(arcs.len() - 1);
    falls.max_by(|a, b| fall(a).total_cmp(&fall(b))).map(|n| 0.5 * (arcs[n] + arcs[n + 1]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::layer::FreeStream;

    #[test]
    fn a_shock_stands_where_the_speed_falls_most() {
        let stream = FreeStream::new(0.7, 1e6);
        let arcs: Vec<f64> = (0..8).map(|k| 0.3 + 0.1 * f64::from(k)).collect();
        let log = |speeds: [f64; 8]| speeds.map(f64::ln);
        // the speed of sound is that of about 1.4 times the onset flow
        let found = shock(&arcs, &log([1.6, 1.62, 1.6, 1.45, 1.35, 1.1, 1.05, 1.0]), &stream).unwrap();
        assert!((found - 0.55).abs() < 1e-12, "{found}");
        // there is none in subsonic flow, behind which the flow may be anything
        assert_eq!(shock(&arcs, &log([1.3, 1.6, 1.1, 1.0, 1.0, 1.0, 1.0, 1.0]), &stream), None);
    }

    #[test]
    fn a_wanted_place_that_swings_is_found() {
        // a bubble: three times as far back as transition goes forward
        let wanted = |place: f64| 0.3 - 3.0 * (place - 0.3);
        let (mut place, mut rule) = (0.36, Rule::default());
        for _ in 0..3 {
            place += rule.next(place, wanted(place) - place);
        }
        assert!((place - 0.3).abs() < 1e-12, "{place}");
        // a place that does not depend on transition is gone to at once
        assert!((Rule::default().next(0.2, 0.1) - 0.1).abs() < 1e-15);
    }
}
