//! The equations of all stations with their local Jacobians.
//!
//! Every block depends on two stations (three at the start of the wake) and on two abscissas, and is differentiated by
//! dual numbers of exactly that width.

use super::edge::EdgeLaw;
use super::equations::{EQUATIONS, Interval, Layer, Link, first, turned};
use super::interval::{Merged, Span};
use super::side::Side;
use super::station::{ByStation, Derived, Regime, State, UNKNOWNS};
use super::unknowns::{ByGlobal, GLOBALS, Unknowns};
use crate::differentiate::Tangent;
use crate::flow::memory::{Recycled, kept};

/// Derivatives with respect to the unknowns of two stations, the upstream one first.
type ByPair = Tangent<{ 2 * UNKNOWNS }>;
/// Derivatives with respect to the unknowns of two stations and then to their two abscissas.
type ByInterval = Tangent<{ 2 * UNKNOWNS + 2 }>;
/// Derivatives with respect to the unknowns of three stations.
type ByThree = Tangent<{ 3 * UNKNOWNS }>;

/// Derivatives of the equations of a station with respect to the unknowns of one station.
pub(crate) type Coupling = [State; EQUATIONS];

/// The equations that belong to one station, linearised.
#[derive(Debug, Clone)]
pub(crate) struct Block {
    /// Residuals of the equations.
    pub residual: [f64; EQUATIONS],
    /// Derivatives with respect to the unknowns of the station itself.
    pub own: Coupling,
    /// Numbers of the stations upstream, with derivatives with respect to their unknowns: none at the first station of
    /// a side, two at the start of the wake, otherwise one.
    pub upstream: [Option<(usize, Coupling)>; 2],
    /// Derivatives with respect to the global directions, one row per equation.
    pub globals: [[f64; GLOBALS]; EQUATIONS],
    /// Derivatives with respect to the distances, from the stagnation point, of the station upstream and of the station
    /// itself, one row per equation; zero in the wake.
    pub abscissas: [[f64; 2]; EQUATIONS],
}

kept!(Block);
kept!(Derived<ByStation>);

/// Derivatives with respect to the station whose unknowns are in the directions from `first` on.
fn coupling<const N: usize>(residuals: &[Tangent<N>; EQUATIONS], first: usize) -> Coupling {
    residuals.each_ref().map(|r| State::derivatives(r, first))
}

/// A station in wider dual numbers, with the derivatives in the directions from `offset` on.
fn placed<const N: usize>(station: &Derived<ByStation>, offset: usize) -> Derived<Tangent<N>> {
    station.map(|v| {
        let mut wide = Tangent::from_re(v.re);
        wide.eps[offset..offset + UNKNOWNS].copy_from_slice(&v.eps);
        wide
    })
}

/// First direction of the unknowns of the station at the end of an interval.
const OWN: usize = UNKNOWNS;
/// First direction of the abscissas of an interval.
const ABSCISSAS: usize = 2 * UNKNOWNS;

/// The abscissas of an interval as independent variables.
fn moving(x: [ByGlobal; 2]) -> [ByInterval; 2] {
    [0, 1].map(|end| ByInterval::from_re(x[end].re).derivative(ABSCISSAS + end))
}

/// Derivatives with respect to the abscissas.
fn by_abscissas(residuals: &[ByInterval; EQUATIONS]) -> [[f64; 2]; EQUATIONS] {
    residuals.each_ref().map(|r| [0, 1].map(|end| r.eps[ABSCISSAS + end]))
}

/// Derivatives in the global directions, which move the abscissas.
fn by_globals(residuals: &[ByInterval; EQUATIONS], x: [ByGlobal; 2]) -> [[f64; GLOBALS]; EQUATIONS] {
    residuals
        .each_ref()
        .map(|r| std::array::from_fn(|g| r.eps[ABSCISSAS] * x[0].eps[g] + r.eps[ABSCISSAS + 1] * x[1].eps[g]))
}

impl<L: EdgeLaw<Number = f64>> Layer<'_, L> {
    /// Evaluates the closure at every station, with derivatives with respect to the unknowns of the station.
    pub fn derive_all(&self, unknowns: &Unknowns) -> Recycled<Derived<ByStation>> {
        self.derive(unknowns, |state| state.seed(0), &self.law.map(ByStation::from_re))
    }

    /// All blocks in the order of the stations. `abscissas` are the distances of the stations of both sides from the
    /// stagnation point, in chords.
    pub fn blocks(&self, derived: &[Derived<ByStation>], abscissas: &[Vec<ByGlobal>; 2]) -> Recycled<Block> {
        let mut result = Recycled::with_capacity(derived.len());
        let (law, wake_law) = (self.law.map(ByInterval::from_re), self.law.map(ByPair::from_re));
        for link in self.links() {
            result.push(match link {
                Link::First { side } => self.first_block(derived, side, abscissas[side.index()][0]),
                Link::Surface { side, number, regime, turns } => {
                    let x = &abscissas[side.index()];
                    let k = self.numbering().station(side, number);
                    self.surface_block(derived, (k, regime, turns), [x[number - 1], x[number]], &law)
                }
                Link::WakeStart => self.wake_start_block(derived),
                Link::Wake { number } => self.wake_block(derived, number, &wake_law),
            });
        }
        result
    }

    fn first_block(&self, derived: &[Derived<ByStation>], side: Side, x: ByGlobal) -> Block {
        let ends = [x; 2];
        let own = placed::<{ 2 * UNKNOWNS + 2 }>(&derived[self.numbering().station(side, 0)], OWN);
        let residuals = first(&own, moving(ends)[1]);
        Block {
            residual: residuals.map(|r| r.re),
            own: coupling(&residuals, OWN),
            upstream: [None, None],
            globals: by_globals(&residuals, ends),
            abscissas: by_abscissas(&residuals),
        }
    }

    /// The block of station `k` on the surface, at the end of an interval.
    fn surface_block(
        &self,
        derived: &[Derived<ByStation>],
        (k, regime, turns): (usize, Regime, bool),
        x: [ByGlobal; 2],
        law: &L::In<ByInterval>,
    ) -> Block {
        let before = match turns {
            true => placed(&turned(derived[k - 1].state, &self.law.map(ByStation::from_re)), 0),
            false => placed(&derived[k - 1], 0),
        };
        let interval = Interval { from: &before, span: Span::on_wall(moving(x)), regime };
        let residuals = interval.residual(&placed(&derived[k], OWN), law);
        Block {
            residual: residuals.map(|r| r.re),
            own: coupling(&residuals, OWN),
            upstream: [Some((k - 1, coupling(&residuals, 0))), None],
            globals: by_globals(&residuals, x),
            abscissas: by_abscissas(&residuals),
        }
    }

    fn wake_start_block(&self, derived: &[Derived<ByStation>]) -> Block {
        let numbering = self.numbering();
        let [upper, lower] = numbering.ends();
        let at = |station: usize, offset: usize| -> Derived<ByThree> { placed(&derived[station], offset) };
        let residuals =
            Merged::new(&at(upper, 0), &at(lower, UNKNOWNS)).residual(&at(numbering.wake_start(), 2 * UNKNOWNS));
        Block {
            residual: residuals.map(|r| r.re),
            own: coupling(&residuals, 2 * UNKNOWNS),
            upstream: [Some((upper, coupling(&residuals, 0))), Some((lower, coupling(&residuals, UNKNOWNS)))],
            globals: [[0.0; GLOBALS]; EQUATIONS],
            abscissas: [[0.0; 2]; EQUATIONS],
        }
    }

    fn wake_block(&self, derived: &[Derived<ByStation>], number: usize, law: &L::In<ByPair>) -> Block {
        let k = self.numbering().wake_start() + number;
        let (before, own): (Derived<ByPair>, _) = (placed(&derived[k - 1], 0), placed(&derived[k], OWN));
        let interval = Interval { from: &before, span: self.wake_interval_span(number), regime: Regime::Wake };
        let residuals = interval.residual(&own, law);
        Block {
            residual: residuals.map(|r| r.re),
            own: coupling(&residuals, OWN),
            upstream: [Some((k - 1, coupling(&residuals, 0))), None],
            globals: [[0.0; GLOBALS]; EQUATIONS],
            abscissas: [[0.0; 2]; EQUATIONS],
        }
    }
}
