//! The equations of the boundary layer as kernels. The equations themselves are those of the
//! [`layer`](crate::flow::layer), which every outer flow shares.

use super::gas::Flow;
use super::kernel::Kernel;
use crate::flow::layer::equations::{Interval, first, turned};
use crate::flow::layer::interval::{Merged, Span};
use crate::flow::layer::transition_residual;
use crate::flow::layer::{Derived, EdgeLaw, Regime, State};
use crate::scalar::{Over, Scalar};

/// The state of a station from four inputs.
fn state<S: Scalar>(x: &[S], first: usize) -> State<S> {
    State::from_fn(|k| x[first + k])
}

/// The first station of a side. Inputs: its state, and the arc length from the stagnation point.
pub(super) struct FirstStation;

impl Kernel<5, 3> for FirstStation {
    fn evaluate<S: Over<P>, P: Scalar>(&self, x: [S; 5], flow: &Flow<P>) -> [S; 3] {
        first(&Derived::new(state(&x, 0), Regime::Laminar, &flow.stream_in()), x[4])
    }
}

/// An interval between two stations. Inputs: the states of both, upstream first; then the two arc lengths on the wall,
/// or the two heights of the dead air in the wake.
pub(super) struct LayerInterval {
    /// Regime of the station downstream.
    pub regime: Regime,
    /// Whether the layer turns turbulent at the station upstream.
    pub turns: bool,
    /// Abscissas of the stations of the wake; on the wall they are inputs.
    pub wake: [f64; 2],
}

impl Kernel<10, 3> for LayerInterval {
    fn evaluate<S: Over<P>, P: Scalar>(&self, x: [S; 10], flow: &Flow<P>) -> [S; 3] {
        let law = flow.stream_in::<S>();
        let from = match self.turns {
            true => turned(state(&x, 0), &law),
            false => Derived::new(state(&x, 0), self.regime, &law),
        };
        let own = Derived::new(state(&x, 4), self.regime, &law);
        let last = [x[8], x[9]];
        let span = match self.regime {
            Regime::Wake => Span { x: self.wake.map(S::from), gap: last },
            _ => Span::on_wall(last),
        };
        Interval { from: &from, span, regime: self.regime }.residual(&own, &law)
    }
}

/// The start of the wake. Inputs: the states of the upper and the lower side at the edge and of the wake.
pub(super) struct WakeStart;

impl Kernel<12, 3> for WakeStart {
    fn evaluate<S: Over<P>, P: Scalar>(&self, x: [S; 12], flow: &Flow<P>) -> [S; 3] {
        let law = flow.stream_in::<S>();
        let wall = |first: usize| Derived::new(state(&x, first), Regime::Turbulent, &law);
        Merged::new(&wall(0), &wall(4)).residual(&Derived::new(state(&x, 8), Regime::Wake, &law))
    }
}

/// The place of transition on a side. Inputs: arc lengths from the stagnation point to transition, from the first node to
/// the stagnation point, of the surface, and from the first node to the trip; amplification at transition.
pub(super) struct TransitionPoint {
    pub side: crate::flow::layer::Side,
    pub tripped: bool,
    pub critical: f64,
}

impl Kernel<5, 1> for TransitionPoint {
    fn evaluate<S: Over<P>, P: Scalar>(&self, x: [S; 5], _: &Flow<P>) -> [S; 1] {
        let [place, stagnation, total, trip, amplification] = x;
        let trip = self.tripped.then(|| self.side.distance(stagnation, trip));
        [transition_residual(place, self.side.length(stagnation, total), trip, amplification, self.critical)]
    }
}

/// Displacement thickness of the wake. Inputs: the state.
pub(super) struct WakeDisplacement;

impl Kernel<4, 1> for WakeDisplacement {
    fn evaluate<S: Over<P>, P: Scalar>(&self, x: [S; 4], flow: &Flow<P>) -> [S; 1] {
        [super::geometry::displacement_thickness(x, &flow.stream_in())]
    }
}

/// Friction drag of an interval of a side. Inputs: the states of both stations, their wall points, the angle of attack.
pub(super) struct Friction {
    /// Regimes of both stations.
    pub regimes: [Regime; 2],
}

impl Kernel<13, 1> for Friction {
    fn evaluate<S: Over<P>, P: Scalar>(&self, x: [S; 13], flow: &Flow<P>) -> [S; 1] {
        let law = flow.stream_in::<S>();
        let stress = |end: usize| {
            let derived = Derived::new(state(&x, 4 * end), self.regimes[end], &law);
            let edge = law.edge(derived.speed);
            derived.friction * edge.density * edge.speed * edge.speed
        };
        let (sin, cos) = x[12].sin_cos();
        let along = (x[10] - x[8]) * cos + (x[11] - x[9]) * sin;
        [(stress(0) + stress(1)) * along * 0.5]
    }
}
