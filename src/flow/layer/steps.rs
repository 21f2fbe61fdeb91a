//! Steps of all unknowns: how long a step may be, and where it leads.

use super::edge::EdgeLaw;
use super::equations::Layer;
use super::side::Side;
use super::station::{Regime, State, UNKNOWNS};
use super::transition::kept_inside;
use super::transport::Profiles;
use super::unknowns::{Change, Numbering, Unknowns};

/// Largest logarithm of Hk − 1: far beyond any layer, and short of an overflow.
const LARGEST_LOG_SHAPE: f64 = 8.0;

/// Number of usual changes that a step may take at most. A longer step is tried before it is taken, so that this limit
/// need only keep it within the range of the closure.
const FREEDOM: f64 = 3.0;
/// Usual change of ln θ in one step.
const LOG_THETA: f64 = 0.4;
/// Usual change of ln(Hk − 1) in one step.
const LOG_SHAPE: f64 = 0.4;
/// Usual change of the amplification factor in one step.
const AMPLIFICATION: f64 = 6.0;
/// Usual change of the logarithm of the root of the shear-stress coefficient in one step.
const LOG_STRESS: f64 = 1.0;
/// Usual change of the logarithm of the speed in one step.
const LOG_SPEED: f64 = 0.25;
/// Usual change of the arc length of the stagnation point in one step, in chords.
const STAGNATION: f64 = 0.02;

/// Usual change of the unknowns of a station in one step.
fn usual(regime: Regime) -> State {
    let third = if regime == Regime::Laminar { AMPLIFICATION } else { LOG_STRESS };
    State { log_theta: LOG_THETA, log_shape: LOG_SHAPE, third, log_speed: LOG_SPEED }
}

/// Scalar product of two changes of the states, every unknown in units of the usual change, divided by the number of
/// unknowns.
fn states_dot(numbering: &Numbering, a: &Change, b: &Change) -> f64 {
    let station = |(k, (a, b)): (usize, (&State, &State))| {
        let usual = usual(numbering.regime(k));
        a.zip(&usual, |v, scale| v / (scale * scale)).dot(b)
    };
    let sum: f64 = a.stations.iter().zip(&b.stations).enumerate().map(station).sum();
    sum / (UNKNOWNS * a.stations.len()) as f64
}

impl<L: EdgeLaw<Number = f64>> Layer<'_, L> {
    /// The states as functions of the place.
    pub fn profiles(&self, unknowns: &Unknowns) -> Profiles {
        Profiles::new(self.layout, unknowns, self.surface)
    }

    /// The largest factor, at most one, on a change that keeps every unknown within the limits of one step.
    pub fn admissible_factor(&self, profiles: &Profiles, unknowns: &Unknowns, change: &Change) -> f64 {
        let numbering = self.numbering();
        let mut factor: f64 = 1.0;
        let mut limit = |step: f64, bound: f64| {
            if step.abs() > bound * factor.recip() {
                factor = factor.min(bound / step.abs());
            }
        };
        for (k, own) in change.stations.iter().enumerate() {
            let own = match numbering.on_side(k) {
                // laminar states move with the stations through the layer, turbulent ones with the stations; the
                // abscissa of a laminar station is a fixed share of that of transition
                Some((side, j)) if j < numbering.laminar => {
                    let side = side.index();
                    profiles.material(k, own, change.transition[side] / unknowns.transition[side])
                }
                _ => *own,
            };
            for (step, usual) in own.numbers().into_iter().zip(usual(numbering.regime(k)).numbers()) {
                limit(step, FREEDOM * usual);
            }
        }
        limit(change.stagnation, STAGNATION);
        for side in Side::BOTH {
            limit(change.transition[side.index()], self.room(unknowns, side, change));
        }
        factor
    }

    /// Largest admissible step of the transition point of a side.
    fn room(&self, unknowns: &Unknowns, side: Side, change: &Change) -> f64 {
        let length = unknowns.side_length(side, self.surface.total);
        let x = unknowns.transition[side.index()];
        let room = if change.transition[side.index()] < 0.0 { 0.3 * x } else { 0.5 * (length - x) + 1e-3 * length };
        room.min(0.1 * length)
    }

    /// The unknowns after `factor` times a change, where the states move along with their stations.
    pub fn moved(&self, unknowns: &Unknowns, change: &Change, factor: f64) -> Unknowns {
        let mut next = unknowns.clone();
        next.add(change, factor);
        for state in &mut next.stations {
            state.log_shape = state.log_shape.min(LARGEST_LOG_SHAPE);
        }
        next.stagnation = next.stagnation.clamp(0.02 * self.surface.total, 0.98 * self.surface.total);
        for side in Side::BOTH {
            let length = next.side_length(side, self.surface.total);
            let x = &mut next.transition[side.index()];
            *x = kept_inside(*x, length);
        }
        next
    }

    /// Corrects unknowns after a step that has [moved](Self::moved) them, so that the layer stays where it is when the
    /// stations move. `profiles` are the states before the step.
    pub fn staying(&self, profiles: &Profiles, mut moved: Unknowns) -> Unknowns {
        profiles.carry(&mut moved);
        moved
    }

    /// The unknowns after `factor` times a change, where the layer stays where it is when the stations move.
    pub fn carried(&self, unknowns: &Unknowns, change: &Change, factor: f64) -> Unknowns {
        self.staying(&self.profiles(unknowns), self.moved(unknowns, change, factor))
    }

    /// Length of a change, every unknown in units of the usual change of one step.
    pub fn size(&self, unknowns: &Unknowns, change: &Change) -> f64 {
        let mut globals = (change.stagnation / STAGNATION).powi(2);
        for side in Side::BOTH {
            globals += (change.transition[side.index()] / self.room(unknowns, side, change)).powi(2);
        }
        (states_dot(&self.numbering(), change, change) + globals).sqrt()
    }
}

/// A scalar product of changes, every unknown in units of the usual change of one step.
pub(crate) struct Metric {
    numbering: Numbering,
    /// Usual changes of the transition points of the upper and lower side, in chords.
    transition: [f64; 2],
}

impl Metric {
    pub fn new<L: EdgeLaw<Number = f64>>(layer: &Layer<L>, unknowns: &Unknowns) -> Self {
        Self { numbering: layer.numbering(), transition: unknowns.transition.map(|x| 0.3 * x) }
    }

    pub fn dot(&self, a: &Change, b: &Change) -> f64 {
        let mut globals = a.stagnation * b.stagnation / (STAGNATION * STAGNATION);
        for side in 0..2 {
            globals += a.transition[side] * b.transition[side] / self.transition[side].powi(2);
        }
        states_dot(&self.numbering, a, b) + globals
    }
}
