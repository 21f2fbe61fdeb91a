//! Continuation along a branch of solutions through its folds.
//!
//! Where the layer at a nose bursts, or a bubble jumps from one bump of ragged coordinates to the next, the branch of
//! solutions over the angle of attack turns back and forward again: no solution is near the last one at the next angle,
//! but both are on one curve. Its arc length is followed in place of the angle (pseudo-arclength continuation; Keller,
//! "Numerical Solution of Bifurcation and Nonlinear Eigenvalue Problems", 1977).
//!
//! On the way the wake stays where it is at the angle wanted, so that the system is linear in the onset flow and its
//! derivative with respect to the angle is that flow a quarter turn on.

use super::continuation::{Place, temporary};
use super::coupled::chord::Evaluated;
use super::coupled::layout::Layout;
use super::coupled::newton::{self, Metric};
use super::coupled::response::FlowResponse;
use super::coupled::system::{Change, Linearised, Reduced, System};
use super::coupled::unknowns::Unknowns;
use super::ladder::{self, Ladder};
use std::f64::consts::FRAC_PI_2;

/// First, largest and smallest step, in the metric of the usual changes of one Newton step.
const FIRST_STEP: f64 = 0.5;
const LARGEST_STEP: f64 = 2.0;
const SMALLEST_STEP: f64 = 0.002;
/// Growth of the step after one that took no more work than so many iterations, and its share after a failure.
const LONGER: f64 = 1.6;
const EASY: f64 = 3.2;
const SHORTER: f64 = 0.4;
/// Steps after a failure before they grow again.
const CAUTION: usize = 2;
/// Work after which a branch is given up, in Newton iterations with all stations.
const WORK: f64 = 500.0;
/// Most steps.
const STEPS: usize = 300;
/// Angle, in degrees, and ratio of the places of trips that count as a step of one.
const DEGREES: f64 = 1.0;
const LOG_TRIP: f64 = 0.5;
/// Distance behind its start at which a branch is given up, in these steps.
const BEHIND: f64 = 2.0;
/// Factorisations in one step.
const FACTORISATIONS: usize = 4;
/// Largest residual of the solutions on the way, and that at which a step is given up.
const TOLERANCE: f64 = 1e-4;
const LOST: f64 = 30.0;
/// Iterations where the parameter is as wanted, and those without progress.
const LANDING_ITERATIONS: usize = 20;
const LANDING_PATIENCE: usize = 8;
/// Contraction of the residuals with which factors are kept, and the residual from which they are used at all.
const CONTRACTION: f64 = 0.5;
const CLOSE: f64 = 1.0;
/// Work of an evaluation of the residuals, over that of an iteration.
const EVALUATION: f64 = 0.3;

/// What changes along a branch; wanted is the value 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Parameter {
    /// Angle of attack less that wanted, in degrees.
    Angle,
    /// Logarithm of the places of temporary trips over the lengths of the sides.
    Trips,
}

impl Parameter {
    /// Its square, in steps of one.
    fn weight(self) -> f64 {
        match self {
            Self::Angle => DEGREES.powi(-2),
            Self::Trips => LOG_TRIP.powi(-2),
        }
    }

    fn value(self, place: &Place) -> f64 {
        match self {
            Self::Angle => place.turned,
            Self::Trips => place.trips.ln(),
        }
    }

    /// The place with the parameter at `value`.
    pub(super) fn at(self, value: f64, place: &Place) -> Place {
        match self {
            Self::Angle => Place { turned: value, ..*place },
            Self::Trips => Place { trips: value.exp(), ..*place },
        }
    }
}

/// A solution on the way.
#[derive(Clone)]
struct Point {
    unknowns: Unknowns,
    value: f64,
}

/// A direction in which to go from a point.
#[derive(Clone)]
struct Direction {
    change: Change,
    value: f64,
}

impl Ladder<'_> {
    /// From a solution at `place` to one where the parameter is as wanted.
    pub(super) fn follow_branch(
        &mut self,
        layout: &Layout,
        what: &str,
        from: Unknowns,
        (parameter, place): (Parameter, Place),
    ) -> Option<Unknowns> {
        let mut branch = Branch::new(self, layout, parameter, place);
        let start = parameter.value(&place);
        let mut at = Point { unknowns: from, value: start };
        let mut heading: Option<Direction> = None;
        let limit = self.work() + WORK;
        let mut stride = Stride { length: FIRST_STEP, successes: CAUTION };
        for count in 1..=STEPS {
            // a branch that has come back behind its start goes nowhere
            if self.exhausted()
                || self.work() > limit
                || (at.value.abs() - start.abs()) * parameter.weight().sqrt() > BEHIND
            {
                break;
            }
            branch.set(self, at.value);
            let linearised = branch.system(self).linearise(&at.unknowns);
            let ahead = branch.ahead(self, &at, &linearised, heading.as_ref())?;
            self.spend(1.0, layout);
            let next = self.stride(&mut branch, &at, &ahead, &mut stride)?;
            if next.value == 0.0 || next.value.signum() != at.value.signum() {
                let near = if next.value.abs() < at.value.abs() { &next } else { &at };
                branch.set(self, 0.0);
                let end = newton::solve_patiently(
                    &branch.system(self),
                    near.unknowns.clone(),
                    ladder::TOLERANCE,
                    LANDING_ITERATIONS,
                    LANDING_PATIENCE,
                );
                self.note(&format!("{what}, {count} steps along the branch"), &end);
                if end.converged {
                    return Some(end.unknowns);
                }
            }
            (at, heading) = (next, Some(ahead.direction));
        }
        None
    }

    /// A step, shortened until it succeeds.
    fn stride(&mut self, branch: &mut Branch, at: &Point, ahead: &Ahead, stride: &mut Stride) -> Option<Point> {
        loop {
            let (next, work) = branch.step(self, at, ahead, stride.length);
            self.spend(work, branch.layout);
            if next.is_some() {
                stride.successes += 1;
                if work <= EASY && stride.successes > CAUTION {
                    stride.length = (stride.length * LONGER).min(LARGEST_STEP);
                }
                return next;
            }
            *stride = Stride { length: stride.length * SHORTER, successes: 0 };
            if stride.length < SMALLEST_STEP || self.exhausted() {
                return None;
            }
        }
    }
}

/// Length of the next step, and steps since the last failure.
struct Stride {
    length: f64,
    successes: usize,
}

/// The curve of solutions.
struct Branch<'a> {
    parameter: Parameter,
    place: Place,
    flow: FlowResponse,
    trips: [Option<f64>; 2],
    layout: &'a Layout,
}

impl<'a> Branch<'a> {
    fn new(ladder: &Ladder, layout: &'a Layout, parameter: Parameter, place: Place) -> Self {
        let flow = ladder.turned(place.turned);
        Self { parameter, place, flow, trips: temporary(ladder.case, ladder.stagnation, place.trips), layout }
    }

    fn set(&mut self, ladder: &Ladder, value: f64) {
        self.place = self.parameter.at(value, &self.place);
        match self.parameter {
            Parameter::Angle => {
                let alpha = ladder.flow.alpha + value.to_radians();
                self.flow.turn(self.flow.onset(&ladder.case.section.response, alpha));
            }
            Parameter::Trips => self.trips = temporary(ladder.case, ladder.stagnation, self.place.trips),
        }
    }

    fn system<'b>(&'b self, ladder: &'b Ladder) -> System<'b> {
        System { trips: self.trips, ..ladder.case.system(&self.flow, &ladder.case.condition, self.layout) }
    }

    /// Minus the inverse Jacobian times the derivative by the parameter.
    fn by_parameter(&self, ladder: &Ladder, reduced: &Reduced) -> Change {
        let section = &ladder.case.section.response;
        match self.parameter {
            Parameter::Angle => {
                let quarter_turn = self.flow.onset(section, self.flow.alpha + FRAC_PI_2);
                reduced.by_onset(section, &quarter_turn, 1f64.to_radians())
            }
            Parameter::Trips => {
                let own = ladder.case.trip_arcs();
                // a temporary trip moves by its own distance from the stagnation point
                reduced.by_trips([0, 1].map(|side| match self.trips[side] {
                    Some(arc) if own[side] != Some(arc) => arc - ladder.stagnation,
                    _ => 0.0,
                }))
            }
        }
    }

    /// The way on from a point: onward from `heading`, or towards the condition wanted.
    fn ahead<'l>(
        &self,
        ladder: &Ladder,
        at: &Point,
        linearised: &'l Linearised,
        heading: Option<&Direction>,
    ) -> Option<Ahead<'l>> {
        let reduced = Reduced::new(linearised)?;
        let by_value = self.by_parameter(ladder, &reduced);
        if !by_value.is_finite() {
            return None;
        }
        let metric = Metric::new(&self.system(ladder), &at.unknowns);
        let weight = self.parameter.weight();
        let length = (metric.dot(&by_value, &by_value) + weight).sqrt();
        let onward = match heading {
            Some(last) => metric.dot(&last.change, &by_value) + last.value * weight,
            None => -at.value,
        };
        let factor = onward.signum() / length;
        let mut direction = Direction { change: by_value.clone(), value: factor };
        direction.change.stretch(factor);
        Some(Ahead { reduced, by_value, direction, metric })
    }

    /// The next solution, a step along `ahead` and then across it; with it the work that took.
    fn step(&mut self, ladder: &Ladder, from: &Point, ahead: &Ahead, length: f64) -> (Option<Point>, f64) {
        let direction = &ahead.direction;
        let start = newton::carried(&self.system(ladder), &from.unknowns, &direction.change, length);
        let start = Point { unknowns: start, value: from.value + length * direction.value };
        let mut work = 0.0;
        let mut settled = self.settle(ladder, start, ahead, (&ahead.reduced, &ahead.by_value), &mut work);
        for _ in 0..FACTORISATIONS {
            let mut at = match settled {
                Settled::Done(at) => return (Some(at), work),
                Settled::Lost => return (None, work),
                Settled::Slow(at) => at,
            };
            self.set(ladder, at.value);
            let system = self.system(ladder);
            let linearised = system.linearise(&at.unknowns);
            work += 1.0;
            let Some(reduced) = Reduced::new(&linearised) else { return (None, work) };
            let by_value = self.by_parameter(ladder, &reduced);
            let Some((change, value)) = self.across(ahead, reduced.step(), &by_value) else { return (None, work) };
            let factor = newton::admissible_factor(&system, &linearised, &at.unknowns, &change);
            at.unknowns = newton::carried(&system, &at.unknowns, &change, factor);
            at.value += factor * value;
            settled = self.settle(ladder, at, ahead, (&reduced, &by_value), &mut work);
        }
        match settled {
            Settled::Done(at) => (Some(at), work),
            _ => (None, work),
        }
    }

    /// Newton's method across the direction with the factors there are, as long as they do.
    fn settle(
        &mut self,
        ladder: &Ladder,
        mut at: Point,
        ahead: &Ahead,
        (reduced, by_value): (&Reduced, &Change),
        work: &mut f64,
    ) -> Settled {
        let mut before = f64::INFINITY;
        loop {
            self.set(ladder, at.value);
            let system = self.system(ladder);
            let evaluated = Evaluated::new(&system, &at.unknowns);
            *work += EVALUATION;
            let largest = evaluated.largest();
            if largest < TOLERANCE {
                return Settled::Done(at);
            }
            if !(largest < LOST) {
                return Settled::Lost;
            }
            if !(largest < CONTRACTION * before.min(CLOSE)) {
                return Settled::Slow(at);
            }
            before = largest;
            let straight = reduced.solve(&evaluated.residuals());
            let Some((change, value)) = self.across(ahead, straight, by_value) else { return Settled::Lost };
            at.unknowns = newton::carried(&system, &at.unknowns, &change, 1.0);
            at.value += value;
        }
    }

    /// Newton's step `change`, with the parameter moved so that it leads across the direction; and that move.
    fn across(&self, ahead: &Ahead, mut change: Change, by_value: &Change) -> Option<(Change, f64)> {
        let Ahead { direction, metric, .. } = ahead;
        let along = metric.dot(&direction.change, by_value) + direction.value * self.parameter.weight();
        let value = -metric.dot(&direction.change, &change) / along;
        change.add(by_value, value);
        change.is_finite().then_some((change, value))
    }
}

/// How far Newton's method came with one set of factors.
enum Settled {
    Done(Point),
    /// The residuals no longer fall as they should.
    Slow(Point),
    Lost,
}

/// The way on from a point of the curve.
struct Ahead<'l> {
    reduced: Reduced<'l>,
    /// Change of the unknowns per change of the parameter.
    by_value: Change,
    /// Unit tangent.
    direction: Direction,
    metric: Metric,
}

#[cfg(test)]
mod tests {
    use super::super::analysis::{Case, PanelledSection};
    use super::super::condition::{Condition, Incidence, Settings};
    use super::super::panel::outline::TrailingEdge;
    use super::super::testcases::naca_symmetric;
    use super::*;

    /// A ladder at an angle of attack, on a layout of few stations.
    fn with_ladder<R>(alpha: f64, work: impl FnOnce(Ladder, &Layout) -> R) -> R {
        let nodes = naca_symmetric(0.12, 0.0025, 121);
        let section = PanelledSection::new(&nodes, TrailingEdge::Blunt).unwrap();
        let condition = Condition::new(Incidence::Alpha(alpha), 1e6);
        let layout = Layout::new(40, 30, section.response.wake_distances.len());
        let case = Case { section: &section, condition, settings: Settings::default(), layout: layout.clone() };
        let flow = FlowResponse::new(&section.response, alpha);
        work(Ladder::new(&case, &flow, Vec::new()), &layout)
    }

    fn solution(ladder: &mut Ladder, layout: &Layout, place: Place) -> Unknowns {
        ladder.start_of_branch(layout, place, "start").unwrap()
    }

    fn farthest(a: &Unknowns, b: &Unknowns) -> f64 {
        let states = a.stations.iter().zip(&b.stations);
        let of_states = states.flat_map(|(a, b)| [a.log_theta - b.log_theta, a.log_speed - b.log_speed]);
        let of_transition = [0, 1].map(|side| a.transition[side] - b.transition[side]);
        of_states.chain(of_transition).fold(0.0, |m: f64, d| m.max(d.abs()))
    }

    #[test]
    fn branches_lead_to_the_solution_wanted() {
        with_ladder(0.05, |mut ladder, layout| {
            let wanted = solution(&mut ladder, layout, Place::default());
            let places = [
                (Parameter::Angle, Place { turned: -2.0, ..Place::default() }),
                (Parameter::Angle, Place { turned: 2.0, ..Place::default() }),
                (Parameter::Trips, Place { trips: 0.05, ..Place::default() }),
            ];
            for (parameter, place) in places {
                let from = solution(&mut ladder, layout, place);
                assert!(farthest(&from, &wanted) > 0.01);
                let found = ladder.follow_branch(layout, "way", from, (parameter, place)).unwrap();
                assert!(farthest(&found, &wanted) < 1e-3, "{parameter:?}: {}", farthest(&found, &wanted));
            }
        });
    }

    #[test]
    fn tangents_are_those_of_the_solutions() {
        with_ladder(0.05, |ladder, layout| {
            for (parameter, value) in [(Parameter::Angle, -0.5), (Parameter::Trips, -2.5)] {
                let place = parameter.at(value, &Place::default());
                let branch = Branch::new(&ladder, layout, parameter, place);
                let system = branch.system(&ladder);
                let solve = |at: &Branch, from: &Unknowns| {
                    let end = newton::solve(&at.system(&ladder), from.clone(), 1e-11, 30);
                    assert!(end.converged);
                    end
                };
                let middle = solve(&branch, &system.march(&system.start()));
                let reduced = Reduced::new(&middle.linearised).unwrap();
                let tangent = branch.by_parameter(&ladder, &reduced);
                let step = 1e-4;
                let [low, high] = [-step, step].map(|by| {
                    let mut aside = Branch::new(&ladder, layout, parameter, place);
                    aside.set(&ladder, value + by);
                    solve(&aside, &middle.unknowns).unknowns
                });
                for (k, exact) in tangent.stations.iter().enumerate() {
                    let difference = (high.stations[k].log_theta - low.stations[k].log_theta) / (2.0 * step);
                    assert!(
                        (difference - exact[0]).abs() < 1e-4 * (1.0 + exact[0].abs()),
                        "{k}: {difference} {exact:?}"
                    );
                }
                for side in 0..2 {
                    let difference = (high.transition[side] - low.transition[side]) / (2.0 * step);
                    let exact = tangent.globals[1 + side];
                    assert!((difference - exact).abs() < 1e-4 * (1.0 + exact.abs()), "{difference} {exact}");
                }
            }
        });
    }
}
