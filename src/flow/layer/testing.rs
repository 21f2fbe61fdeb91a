//! Forward sweeps of the layer in which the stations move, for tests of several modules.

use super::edge::EdgeLaw;
use super::equations::{EQUATIONS, Interval, Layer, Link, first, turned};
use super::interval::{Merged, Span};
use super::side::Side;
use super::station::{Derived, Regime};
use super::transition;
use crate::scalar::Scalar;

/// [`Layer::residuals`] for abscissas that may move too.
pub(crate) fn residuals<S: Scalar, L: EdgeLaw<Number = f64>>(
    layer: &Layer<L>,
    derived: &[Derived<S>],
    abscissas: &[Vec<S>; 2],
    law: &L::In<S>,
    gap: &[S],
) -> Vec<[S; EQUATIONS]> {
    let numbering = layer.numbering();
    let residual = |link: Link| match link {
        Link::First { side } => first(&derived[numbering.station(side, 0)], abscissas[side.index()][0]),
        Link::Surface { side, number, regime, turns } => {
            let k = numbering.station(side, number);
            let start = derived[k - 1];
            let start = if turns { turned(start.state, law) } else { start };
            let x = &abscissas[side.index()];
            let span = Span::on_wall([x[number - 1], x[number]]);
            Interval { from: &start, span, regime }.residual(&derived[k], law)
        }
        Link::WakeStart => {
            let [upper, lower] = numbering.ends();
            Merged::new(&derived[upper], &derived[lower]).residual(&derived[numbering.wake_start()])
        }
        Link::Wake { number } => {
            let k = numbering.wake_start() + number;
            let span = layer.wake_span(number, [gap[number - 1], gap[number]]);
            Interval { from: &derived[k - 1], span, regime: Regime::Wake }.residual(&derived[k], law)
        }
    };
    layer.links().map(residual).collect()
}

/// The transition residual of a side for a transition point, a stagnation point, a total arc length and an amplification
/// that may move; a trip stays where it is.
pub(crate) fn transition<S: Scalar, L: EdgeLaw<Number = f64>>(
    layer: &Layer<L>,
    side: Side,
    [transition, stagnation, total, amplification]: [S; 4],
    trip: Option<S>,
) -> S {
    let trip = trip.map(|arc| side.distance(stagnation, arc));
    transition::residual(transition, side.length(stagnation, total), trip, amplification, layer.n_critical)
}
