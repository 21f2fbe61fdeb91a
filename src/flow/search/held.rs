//! Flows whose transition is held in place, and the way from there to the flow with free transition.
//!
//! Newton's method for all unknowns at once often goes astray while transition is far from where it belongs, because
//! amplification grows exponentially with the distance. A flow whose transition is held is found from a march in one to
//! three steps. It says how far amplification is from critical on both sides, and transition moves by that: along the
//! growth of amplification, later by secants and between bounds. Close to critical transition is released.

use super::family::{Effort, End, Equations, Family};
use super::newton;
use crate::flow::Attempt;
use crate::flow::layer::{EdgeLaw, Layer, Layout, Side, Unknowns};

/// Largest number of places at which transition is held.
const PLACES: usize = 14;
/// Largest residual of a flow whose transition is held.
const TOLERANCE: f64 = 0.1;
/// Largest number of iterations for such a flow, and iterations without progress after which it is given up.
const EFFORT: (usize, usize) = (12, 4);
/// Kinematic shape parameter of a marched layer from which on it counts as separated. A flow that separates for long
/// ahead of a transition that is held too late is hard to find, and the march knows little about it.
const SEPARATED: f64 = 3.7;
/// Growth of the amplification factor along a separated layer per momentum thickness. At high Reynolds numbers the
/// envelope of Drela and Giles grows by 0.026 where Hk is 4 and by 0.048 where it is 6.
const SEPARATED_GROWTH: f64 = 0.03;
/// The first places that are tried in turn. On 86 random flows that Newton's method does not find from a march, searches
/// from behind separation need 4.3 places and lose 0.8 iterations on average, searches from separation 5.4 and 3.1.
const STARTS: [First; 4] = [First::Amplified, First::Separated(1.0), First::Separated(0.6), First::Separated(0.3)];
/// Shares of a move of transition that are tried in turn.
const SHARES: [f64; 4] = [1.0, 0.4, 0.15, 0.05];
/// Difference of amplification from critical below which transition is released, over the critical amplification.
const CLOSE: f64 = 0.11;
/// Largest move of transition along the growth of amplification, over the length of the side.
const LONGEST: f64 = 0.1;
/// Earliest transition, over the length of the side.
const EARLIEST: f64 = 3e-3;
/// Share of the distance between two bounds that a new place keeps from both.
const MARGIN: f64 = 0.1;
/// Distance of two bounds below which one of them is doubted, over the distance from the stagnation point.
const NARROW: f64 = 0.02;
/// Move of transition on the other surface, over the distance of two bounds, from which on one of them is doubted.
const MOVED: f64 = 0.1;
/// Distance from the latest place of transition that counts as none, over the length of the side.
const AT_END: f64 = 1e-3;

/// The first place of transition on both sides. Where the march has transition earlier, it stands there.
#[derive(Debug, Clone, Copy)]
enum First {
    /// Where amplification becomes critical in the layer behind separation.
    Amplified,
    /// At a share of the way to separation.
    Separated(f64),
}

/// Where a search begins.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Start<'a> {
    /// A marched layer, which disagrees with the outer flow where it is separated.
    Marched(&'a Unknowns),
    /// A flow that was found on other stations.
    Found(&'a Unknowns),
}

/// Looks for the flow with free transition on the stations of a layout. The record of the attempt comes with it.
pub(crate) fn by_held_transition<F: Family>(
    family: &F,
    outer: &F::Outer,
    layout: &Layout,
    start: Start,
) -> (Option<Unknowns>, Attempt) {
    let free = family.equations(outer, layout, family.trips());
    let bounds = [Bounds::default(); 2];
    let mut search = Search { family, outer, layout, free, bounds, places: 0, iterations: 0, residual: f64::NAN };
    let found = search.run(start);
    let what = format!("transition held at {} places in turn", search.places);
    (found, Attempt::of(&what, search.iterations, search.residual))
}

/// A place of transition with the amplification factor there, less the critical one.
#[derive(Debug, Clone, Copy)]
struct Place {
    x: f64,
    excess: f64,
    /// The place of transition on the other surface.
    opposite: f64,
}

/// The latest places on a side where amplification was below and above critical.
#[derive(Debug, Clone, Copy, Default)]
struct Bounds {
    below: Option<Place>,
    above: Option<Place>,
}

impl Bounds {
    /// Notes a place. A bound on the other side that is very close, although amplification here is far from critical,
    /// and that was found with transition of the other surface elsewhere, holds no longer.
    fn note(&mut self, place: Place, critical: f64) {
        let (own, other) =
            if place.excess > 0.0 { (&mut self.above, &mut self.below) } else { (&mut self.below, &mut self.above) };
        *own = Some(place);
        let doubtful = |other: &Place| {
            let distance = (other.x - place.x).abs();
            distance < NARROW * place.x && (other.opposite - place.opposite).abs() > MOVED * distance
        };
        if place.excess.abs() > CLOSE * critical && other.as_ref().is_some_and(doubtful) {
            *other = None;
        }
    }

    /// The place between the bounds where a straight line is critical.
    fn between(&self) -> Option<f64> {
        let (a, b) = (self.below?, self.above?);
        let width = b.x - a.x;
        // the other surface has changed as well, so that bounds can lie the wrong way round
        (width > 0.0).then(|| {
            let straight = -a.excess / (b.excess - a.excess);
            a.x + width * straight.clamp(MARGIN, 1.0 - MARGIN)
        })
    }
}

fn effort() -> Effort {
    let (iterations, patience) = EFFORT;
    Effort { patience, ..Effort::new(TOLERANCE, iterations) }
}

/// The search for one flow.
struct Search<'a, F: Family + 'a> {
    family: &'a F,
    outer: &'a F::Outer,
    layout: &'a Layout,
    /// The equations with free transition.
    free: F::Equations<'a>,
    bounds: [Bounds; 2],
    /// Number of places at which transition was held.
    places: usize,
    /// Number of all iterations.
    iterations: usize,
    /// Largest residual at the end of the last attempt.
    residual: f64,
}

impl<F: Family> Search<'_, F> {
    fn run(&mut self, start: Start) -> Option<Unknowns> {
        let mut at = match start {
            Start::Marched(unknowns) => self.first(unknowns)?,
            Start::Found(unknowns) => self.solve(unknowns.clone())?,
        };
        while self.places < PLACES {
            let (next, close) = self.next(&at);
            if close && let Some(found) = self.release(&at) {
                return Some(found);
            }
            at = self.move_towards(&at, next)?;
        }
        None
    }

    /// The first flow, with transition where the march has it or, if that is earlier, where or shortly behind where the
    /// layer separates.
    fn first(&mut self, marched: &Unknowns) -> Option<Unknowns> {
        let layer = self.free.layer();
        let latest = Side::BOTH.map(|side| Separation::new(layer, marched, side));
        STARTS.into_iter().find_map(|first| {
            let mut start = marched.clone();
            start.transition = Side::BOTH.map(|side| {
                let length = start.side_length(side, self.family.surface().total);
                latest[side.index()].place(first).max(EARLIEST * length)
            });
            if start.transition != marched.transition {
                start = self.held(&start).march();
            }
            self.solve(start)
        })
    }

    /// The equations with transition held where it is.
    fn held(&self, unknowns: &Unknowns) -> F::Equations<'_> {
        let places = Side::BOTH.map(|side| side.place(unknowns.stagnation, unknowns.transition[side.index()]));
        self.family.held(self.outer, self.layout, places)
    }

    /// The flow with transition held where `start` has it.
    fn solve(&mut self, start: Unknowns) -> Option<Unknowns> {
        self.places += 1;
        let end = newton::solve(&self.held(&start), start, effort());
        self.ended(end)
    }

    /// The flow with free transition, from one whose transition is close.
    fn release(&mut self, at: &Unknowns) -> Option<Unknowns> {
        let end = newton::solve(&self.free, at.clone(), effort());
        self.ended(end)
    }

    fn ended(&mut self, end: End<F::Evaluated>) -> Option<Unknowns> {
        self.iterations += end.iterations;
        self.residual = end.residual;
        end.converged.then_some(end.unknowns)
    }

    /// The next places of transition, and whether it is close to where it belongs on both sides.
    fn next(&mut self, at: &Unknowns) -> ([f64; 2], bool) {
        let layer = self.free.layer();
        let critical = layer.n_critical;
        let mut close = true;
        let places = Side::BOTH.map(|side| {
            let length = at.side_length(side, self.family.surface().total);
            let latest = layer.latest_transition(side, at.stagnation, length);
            let amplified = Amplified::new(layer, at, side);
            let place = amplified.place(critical);
            let ends = place.excess < 0.0 && place.x >= latest - AT_END * length;
            close &= ends || place.excess.abs() < CLOSE * critical;
            let bounds = &mut self.bounds[side.index()];
            bounds.note(place, critical);
            let next = bounds.between().unwrap_or_else(|| amplified.critical(critical, LONGEST * length));
            next.clamp(EARLIEST * length, latest)
        });
        (places, close)
    }

    /// The flow with transition at the given places or, where that cannot be found, on the way there.
    fn move_towards(&mut self, at: &Unknowns, places: [f64; 2]) -> Option<Unknowns> {
        let profiles = self.free.layer().profiles(at);
        SHARES.into_iter().find_map(|share| {
            let mut next = at.clone();
            for (x, place) in next.transition.iter_mut().zip(places) {
                *x += share * (place - *x);
            }
            profiles.place(&mut next);
            self.solve(next)
        })
    }
}

/// Where the marched laminar layer of a side separates, if it does, and where it would become turbulent.
#[derive(Debug, Clone, Copy)]
struct Separation {
    separated: f64,
    /// Where amplification becomes critical if it grows as in a separated layer from there on.
    amplified: f64,
}

impl Separation {
    fn new<L: EdgeLaw<Number = f64>>(layer: &Layer<'_, L>, marched: &Unknowns, side: Side) -> Self {
        let numbering = layer.numbering();
        let x = marched.abscissas(layer.layout, side, layer.surface);
        let station = |j: usize| &marched.stations[numbering.station(side, j)];
        let last = numbering.laminar - 1;
        let separated = (1..last).find(|&j| station(j).kinematic_shape() > SEPARATED).unwrap_or(last);
        let missing = (layer.n_critical - station(separated).amplification()).max(0.0);
        let distance = missing * station(separated).theta() / SEPARATED_GROWTH;
        Self { separated: x[separated], amplified: (x[separated] + distance).min(x[last]) }
    }

    fn place(&self, first: First) -> f64 {
        match first {
            First::Amplified => self.amplified,
            First::Separated(share) => share * self.separated,
        }
    }
}

/// The amplification factor along the laminar layer of a side.
struct Amplified {
    x: Vec<f64>,
    n: Vec<f64>,
    /// Least growth per chord behind transition: that of a separated layer where the layer is separated.
    least: f64,
    /// The place of transition on the other surface.
    opposite: f64,
}

impl Amplified {
    fn new<L: EdgeLaw<Number = f64>>(layer: &Layer<'_, L>, at: &Unknowns, side: Side) -> Self {
        let numbering = layer.numbering();
        let n = |j: usize| at.stations[numbering.station(side, j)].amplification();
        let end = &at.stations[numbering.last_laminar(side)];
        Self {
            x: at.abscissas(layer.layout, side, layer.surface),
            n: (0..numbering.laminar).map(n).collect(),
            least: if end.kinematic_shape() > SEPARATED { SEPARATED_GROWTH / end.theta() } else { 0.0 },
            opposite: at.transition[side.other().index()],
        }
    }

    /// The place of transition.
    fn place(&self, critical: f64) -> Place {
        let last = self.n.len() - 1;
        Place { x: self.x[last], excess: self.n[last] - critical, opposite: self.opposite }
    }

    /// Where amplification becomes critical: in the layer or, as far as it grows on like at the end, or like in a
    /// separated layer where that is more, at most `longest` behind.
    fn critical(&self, critical: f64, longest: f64) -> f64 {
        let Self { x, n, least, .. } = self;
        let last = n.len() - 1;
        match (1..=last).find(|&j| n[j] >= critical) {
            Some(j) => x[j - 1] + (x[j] - x[j - 1]) * ((critical - n[j - 1]) / (n[j] - n[j - 1])).clamp(0.0, 1.0),
            None => {
                let growth = ((n[last] - n[last - 1]) / (x[last] - x[last - 1])).max(*least);
                let move_on = if growth > 0.0 { (critical - n[last]) / growth } else { f64::INFINITY };
                x[last] + move_on.min(longest)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::panel::testing::with_family;

    #[test]
    fn bounds_give_way_to_what_contradicts_them() {
        let mut bounds = Bounds::default();
        let place = |x, excess, opposite| Place { x, excess, opposite };
        bounds.note(place(0.2, -3.0, 0.6), 9.0);
        assert_eq!(bounds.between(), None);
        bounds.note(place(0.4, 1.5, 0.7), 9.0);
        assert!((bounds.between().unwrap() - (0.2 + 0.2 * 3.0 / 4.5)).abs() < 1e-15);
        // much too much just behind a place where it was too little: a sharp bubble, or a flow whose other surface differs
        bounds.note(place(0.201, 12.0, 0.6), 9.0);
        assert!(bounds.between().is_some());
        bounds.note(place(0.201, 12.0, 0.7), 9.0);
        assert_eq!(bounds.between(), None);
    }

    #[test]
    fn critical_amplification_is_found_in_the_layer_and_behind() {
        let layer = Amplified { x: vec![0.1, 0.2, 0.3], n: vec![0.0, 4.0, 12.0], least: 0.0, opposite: 0.5 };
        assert!((layer.critical(8.0, 0.1) - 0.25).abs() < 1e-15);
        assert!((layer.critical(14.0, 0.1) - 0.325).abs() < 1e-15);
        assert_eq!(layer.critical(1e3, 0.1), 0.4);
        let still = Amplified { x: vec![0.1, 0.2], n: vec![0.0, 0.0], ..layer };
        assert_eq!(still.critical(9.0, 0.1), 0.2 + 0.1);
        let separated = Amplified { least: 180.0, ..still };
        assert!((separated.critical(9.0, 0.1) - 0.25).abs() < 1e-15);
    }

    #[test]
    fn holding_transition_leads_to_the_flow_of_newtons_method() {
        with_family(
            0.05,
            |wake| Layout::new(40, 30, wake),
            |family| {
                let system = family.equations(family.flow, family.layout, family.trips());
                let marched = system.march();
                let direct = newton::solve(&system, marched.clone(), Effort::new(1e-10, 30));
                // a march that is wrong about transition on both sides
                let mut early = marched;
                early.transition = early.transition.map(|x| 0.3 * x);
                for start in [Start::Marched(&early), Start::Found(&direct.unknowns)] {
                    let (held, _) = by_held_transition(family, family.flow, family.layout, start);
                    let end = newton::solve(&system, held.unwrap(), Effort::new(1e-10, 30));
                    assert!(direct.converged && end.converged);
                    for side in 0..2 {
                        let [a, b] = [&direct, &end].map(|end| end.unknowns.transition[side]);
                        assert!((a - b).abs() < 1e-8, "{a} {b}");
                    }
                }
            },
        );
    }
}
