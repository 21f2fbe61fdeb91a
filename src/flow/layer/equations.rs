//! The equations of the layer, each in one place, and the links between every station and those upstream of it.
//!
//! A station has three equations. [`Layer::links`] lists all stations with what precedes them. [`first`], [`Interval`]
//! and [`Merged`](super::interval::Merged) hold the residuals, generic over the number. The value pass
//! ([`Layer::residuals`]), the local Jacobians ([`blocks`](super::blocks)), the marches ([`march`](super::march),
//! [`project`](super::project)) and the derivatives by gas and dead air differ only in the variables that they seed.

use super::edge::EdgeLaw;
use super::interval::{Merged, Span, growth, lag, momentum_and_energy, similarity, upwind_weight};
use super::layout::Layout;
use super::side::Side;
use super::station::{Derived, Regime, State, transition_state};
use super::transition;
use super::unknowns::{GLOBALS, Numbering, STAGNATION, TOTAL, TRANSITION, Unknowns};
use crate::differentiate::Tangent;
use crate::flow::surface::SurfaceMap;
use crate::scalar::Scalar;

/// Number of equations of a station.
pub(crate) const EQUATIONS: usize = 3;

/// Abscissa of the trailing edge in the wake. The value does not matter: only ratios of abscissas enter, and they
/// belong to the dissipation.
const WAKE_ORIGIN: f64 = 1.0;

/// Direction of the amplification factor of the last laminar station in a [transition residual](Layer::transition),
/// behind the global directions.
pub(crate) const BY_AMPLIFICATION: usize = GLOBALS;
/// Direction of the arc length of the trip in a [transition residual](Layer::transition).
pub(crate) const BY_TRIP: usize = GLOBALS + 1;
/// A number with the derivatives of a [transition residual](Layer::transition).
pub(crate) type ByTransition = Tangent<{ GLOBALS + 2 }>;

/// The constants of the equations of the layer.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Layer<'a, L> {
    /// Fractions at which the stations stand.
    pub layout: &'a Layout,
    /// The law by which the outer flow's unknown becomes the state at the edge.
    pub law: L,
    /// Dead-air gap at the stations of the wake, in chords.
    pub gap: &'a [f64],
    /// Distances of the stations of the wake behind the trailing edge, in chords.
    pub distances: &'a [f64],
    /// The surface along which the stations stand.
    pub surface: &'a SurfaceMap,
    /// Critical amplification factor.
    pub n_critical: f64,
    /// Arc length of the trip of each side from the first node in chords, where there is a trip.
    pub trips: [Option<f64>; 2],
}

/// A station with the stations that precede it. Stations are given by their positions on the side or in the wake.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Link {
    /// The first station of a side, where the layer is similar.
    First { side: Side },
    /// Station `number` of a side behind the one before it; `turns` where transition stands between both.
    Surface { side: Side, number: usize, regime: Regime, turns: bool },
    /// The first station of the wake, where both sides flow together.
    WakeStart,
    /// Station `number` of the wake behind the one before it.
    Wake { number: usize },
}

/// Residuals of the first station of a side at distance `x` from the stagnation point; amplification starts at zero.
pub(crate) fn first<S: Scalar>(own: &Derived<S>, x: S) -> [S; EQUATIONS] {
    let [momentum, energy] = similarity(own, x);
    [momentum, energy, own.state.amplification()]
}

/// The interval between two stations, seen from its end.
pub(crate) struct Interval<'a, S> {
    /// The station upstream, turbulent where transition stands in between.
    pub from: &'a Derived<S>,
    /// Abscissas and gaps of the two ends.
    pub span: Span<S>,
    /// Regime of the station at the end.
    pub regime: Regime,
}

impl<S: Scalar> Interval<'_, S> {
    /// Residuals of the momentum and kinetic-energy equations with the station `own` at the end.
    pub fn momentum_and_energy(&self, own: &Derived<S>) -> [S; 2] {
        self.upwinded(own).0
    }

    /// Momentum and kinetic-energy residuals, and the upwinding they share with the lag equation.
    fn upwinded(&self, own: &Derived<S>) -> ([S; 2], S) {
        let upwind = upwind_weight(self.from, own, self.regime);
        (momentum_and_energy(self.from, own, &self.span, self.regime, upwind), upwind)
    }

    /// Residuals of all equations with the station `own` at the end of the interval.
    pub fn residual(&self, own: &Derived<S>, law: &impl EdgeLaw<Number = S>) -> [S; EQUATIONS] {
        let ([momentum, energy], upwind) = self.upwinded(own);
        let third = match self.regime {
            Regime::Laminar => {
                let (from, to) = (&self.from.state, &own.state);
                let [start, end] = self.span.x;
                to.amplification() - from.amplification() - growth(from, to, law) * (end - start)
            }
            Regime::Turbulent | Regime::Wake => lag(self.from, own, &self.span, self.regime, upwind),
        };
        [momentum, energy, third]
    }
}

impl<L: EdgeLaw<Number = f64>> Layer<'_, L> {
    /// The numbering of the stations of this layer.
    pub fn numbering(&self) -> Numbering {
        Numbering::new(self.layout)
    }

    /// All stations in the order of their numbers, with the stations that precede them.
    pub fn links(&self) -> impl Iterator<Item = Link> + use<L> {
        let numbering = self.numbering();
        let surface = move |side: Side, number: usize| match number {
            0 => Link::First { side },
            _ => Link::Surface {
                side,
                number,
                regime: numbering.regime(numbering.station(side, number)),
                turns: number == numbering.laminar,
            },
        };
        let sides = Side::BOTH.into_iter().flat_map(move |side| (0..numbering.side).map(move |j| surface(side, j)));
        let wake = (0..numbering.wake).map(|number| if number == 0 { Link::WakeStart } else { Link::Wake { number } });
        sides.chain(wake)
    }

    /// Evaluates the closure at every station in any kind of number, with the derivatives that `state` and `law` carry.
    pub fn derive<S: Scalar, D: FromIterator<Derived<S>>>(
        &self,
        unknowns: &Unknowns,
        state: impl Fn(&State) -> State<S>,
        law: &L::In<S>,
    ) -> D {
        let numbering = self.numbering();
        let derive = |(k, own): (usize, &State)| Derived::new(state(own), numbering.regime(k), law);
        unknowns.stations.iter().enumerate().map(derive).collect()
    }

    /// Residuals of all stations for fixed unknowns, as functions of the law of the edge and of the dead air. `derived`
    /// are the stations, `abscissas` their distances from the stagnation point on both sides, `gap` the dead-air gaps
    /// of the wake.
    pub fn residuals<S: Scalar>(
        &self,
        derived: &[Derived<S>],
        abscissas: &[Vec<f64>; 2],
        law: &L::In<S>,
        gap: &[S],
    ) -> Vec<[S; EQUATIONS]> {
        let numbering = self.numbering();
        let [upper, lower] = numbering.ends();
        let residual = |link: Link| match link {
            Link::First { side } => first(&derived[numbering.station(side, 0)], S::from(abscissas[side.index()][0])),
            Link::Surface { side, number, regime, turns } => {
                let k = numbering.station(side, number);
                let turned = turns.then(|| turned(derived[k - 1].state, law));
                let x = &abscissas[side.index()];
                let span = Span::on_wall([x[number - 1], x[number]].map(S::from));
                let from = turned.as_ref().unwrap_or(&derived[k - 1]);
                Interval { from, span, regime }.residual(&derived[k], law)
            }
            Link::WakeStart => Merged::new(&derived[upper], &derived[lower]).residual(&derived[numbering.wake_start()]),
            Link::Wake { number } => {
                let k = numbering.wake_start() + number;
                let span = self.wake_span(number, [gap[number - 1], gap[number]]);
                Interval { from: &derived[k - 1], span, regime: Regime::Wake }.residual(&derived[k], law)
            }
        };
        self.links().map(residual).collect()
    }

    /// The wake interval that ends at station `number` of the wake, with given gaps at the two ends.
    pub fn wake_span<S: Scalar>(&self, number: usize, gap: [S; 2]) -> Span<S> {
        Span { x: [number - 1, number].map(|i| S::from(self.wake_abscissa(i))), gap }
    }

    /// Abscissa of a station of the wake.
    pub fn wake_abscissa(&self, number: usize) -> f64 {
        WAKE_ORIGIN + self.distances[number]
    }

    /// The wake interval that ends at station `number` of the wake, with the gaps of this layer.
    pub fn wake_interval_span<S: Scalar>(&self, number: usize) -> Span<S> {
        self.wake_span(number, [number - 1, number].map(|i| S::from(self.gap[i])))
    }

    /// Distance of the trip of a side from the stagnation point, where there is a trip.
    pub fn trip_distance(&self, side: Side, stagnation: f64) -> Option<f64> {
        self.trips[side.index()].map(|arc| side.distance(stagnation, arc))
    }

    /// Latest place of transition on a side of the given length: the trip, or shortly ahead of the trailing edge.
    pub fn latest_transition(&self, side: Side, stagnation: f64, length: f64) -> f64 {
        transition::latest(self.trip_distance(side, stagnation), length)
    }

    /// Residual of the transition point of a side, with derivatives in the directions of [`ByTransition`].
    pub fn transition(&self, unknowns: &Unknowns, side: Side) -> ByTransition {
        let at = side.index();
        let unit = |value: f64, k: usize| ByTransition::from_re(value).derivative(k);
        let stagnation = unit(unknowns.stagnation, STAGNATION);
        let trip = self.trips[at].map(|arc| side.distance(stagnation, unit(arc, BY_TRIP)));
        let last = unknowns.stations[self.numbering().last_laminar(side)].amplification();
        transition::residual(
            unit(unknowns.transition[at], TRANSITION[at]),
            side.length(stagnation, unit(self.surface.total, TOTAL)),
            trip,
            unit(last, BY_AMPLIFICATION),
            self.n_critical,
        )
    }
}

/// The end of a laminar layer as the turbulent equations behind it see it.
pub(crate) fn turned<S: Scalar>(laminar: State<S>, law: &impl EdgeLaw<Number = S>) -> Derived<S> {
    Derived::new(transition_state(laminar, law), Regime::Turbulent, law)
}
