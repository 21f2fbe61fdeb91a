//! The coupled system, linearised and reduced to about one unknown per station.
//!
//! The boundary-layer equations of a station give θ, the third unknown and the speed once the mass defect is known
//! (inverse mode, which stays regular through separation). Marching them downstream leaves a dense system for the
//! logarithms of the mass defects and the three global unknowns.

use super::chain::{self, Block, Layer};
use super::duals::{Dual4, Dual8, gradient};
use super::eliminate::Elimination;
use super::layout::Layout;
use super::response::{FlowResponse, Onset, SectionResponse};
use super::speeds::{EdgeSpeeds, Positions, SpeedsByMass, value_at};
use super::transition;
use super::unknowns::{Numbering, Side, Unknowns};
use crate::flow::boundary_layer::gas::Gas;
use crate::flow::boundary_layer::station::{Derived, Regime};
use crate::flow::linear::Factors;
use crate::flow::memory::Recycled;
use nalgebra::{DMatrix, SVector};

/// Everything that is constant while the coupled system is solved.
#[derive(Debug, Clone, Copy)]
pub(crate) struct System<'a> {
    pub section: &'a SectionResponse,
    pub flow: &'a FlowResponse,
    pub layout: &'a Layout,
    pub gas: Gas<f64>,
    pub n_critical: f64,
    /// Arc length of the trip of each side from the first node, where there is one.
    pub trips: [Option<f64>; 2],
}

/// The system at one set of unknowns: residuals and exact Jacobian in blocks.
#[derive(Debug, Clone)]
pub(crate) struct Linearised {
    pub numbering: Numbering,
    pub derived: Recycled<Derived<Dual4>>,
    pub positions: Positions,
    pub speeds: EdgeSpeeds,
    pub by_mass: SpeedsByMass,
    pub blocks: Recycled<Block>,
    /// Mass defect (unsigned) of every station and the gradient of its logarithm in the station's unknowns.
    pub mass: Vec<f64>,
    pub log_mass: Vec<[f64; 4]>,
    /// Edge-speed residual of every station.
    pub speed_residual: Vec<f64>,
    /// Transition residuals with derivatives: the four global directions, then n, then the trip's arc length.
    pub transition: [Dual8; 2],
}

/// Directions of [`Linearised::transition`] behind the global ones.
pub(crate) const BY_AMPLIFICATION: usize = 4;
pub(crate) const BY_TRIP: usize = 5;

impl<'a> System<'a> {
    pub fn layer(&self) -> Layer<'a> {
        Layer {
            numbering: Numbering::new(self.layout),
            gas: self.gas,
            gap: &self.flow.gap,
            distances: &self.section.wake_distances,
        }
    }

    pub fn linearise(&self, unknowns: &Unknowns) -> Linearised {
        let layer = self.layer();
        let numbering = layer.numbering;
        let derived = chain::derive_all(&layer, unknowns);
        let positions = Positions::new(self.layout, self.section, unknowns);
        let blocks = chain::blocks(&layer, unknowns, &derived, &positions);
        let (mass, log_mass) = self.masses(&derived, &numbering);
        let (points, wake) = signed(&mass, &numbering);
        let (speeds, by_mass) = SpeedsByMass::new(self.section, self.flow, &positions, &points, &wake);
        let speed_residual = self.speed_residuals(unknowns, &speeds);
        let transition = Side::BOTH.map(|side| self.transition(unknowns, side));
        Linearised {
            numbering,
            derived,
            positions,
            speeds,
            by_mass,
            blocks,
            mass,
            log_mass,
            speed_residual,
            transition,
        }
    }

    /// Mass defects of all stations; in the wake with the dead air.
    fn masses(&self, derived: &[Derived<Dual4>], numbering: &Numbering) -> (Vec<f64>, Vec<[f64; 4]>) {
        let total = |(k, d): (usize, &Derived<Dual4>)| match numbering.regime(k) {
            Regime::Wake => {
                let gap = self.flow.gap[k - numbering.wake_start()];
                d.mass + d.state.log_speed.map_exp() * gap
            }
            _ => d.mass,
        };
        derived.iter().enumerate().map(total).map(|m| (m.re, gradient(&m).map(|g| g / m.re))).unzip()
    }

    pub(super) fn transition(&self, unknowns: &Unknowns, side: Side) -> Dual8 {
        let (at, numbering) = (side.index(), Numbering::new(self.layout));
        let unit = |value: f64, k: usize| Dual8::from_re(value).derivative(k);
        let (stagnation, total) = (unit(unknowns.stagnation, 0), unit(self.section.map.total, 3));
        let length = if side == Side::Upper { stagnation } else { total - stagnation };
        let trip = self.trips[at].map(|s| (stagnation - unit(s, BY_TRIP)) * side.sign());
        let last = unknowns.stations[numbering.station(side, numbering.laminar - 1)].third;
        transition::residual(
            unit(unknowns.transition[at], 1 + at),
            length,
            trip,
            unit(last, BY_AMPLIFICATION),
            self.n_critical,
        )
    }
}

/// `exp` by value, so that chains read left to right.
trait MapExp {
    fn map_exp(&self) -> Self;
}
impl MapExp for Dual4 {
    fn map_exp(&self) -> Self {
        num_dual::DualNum::exp(self)
    }
}

/// Signed defects at the points along the surface, and defects of the wake.
pub(crate) fn signed(mass: &[f64], numbering: &Numbering) -> (Vec<f64>, Vec<f64>) {
    let mut points = vec![0.0; numbering.points()];
    for side in Side::BOTH {
        for j in 0..numbering.side {
            points[numbering.point(side, j)] = side.sign() * mass[numbering.station(side, j)];
        }
    }
    (points, mass[numbering.wake_start()..].to_vec())
}

/// A change of all unknowns: four numbers a station, then stagnation and the two transitions.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Change {
    pub stations: Vec<[f64; 4]>,
    pub globals: [f64; 3],
}

impl Change {
    /// Scalar product of the numbers as they are.
    pub fn dot(&self, other: &Self) -> f64 {
        let stations = self.stations.as_flattened().iter().zip(other.stations.as_flattened());
        stations.chain(self.globals.iter().zip(&other.globals)).map(|(a, b)| a * b).sum()
    }

    /// Adds `factor` times another change.
    pub fn add(&mut self, other: &Self, factor: f64) {
        let stations = self.stations.as_flattened_mut().iter_mut().zip(other.stations.as_flattened());
        for (a, b) in stations.chain(self.globals.iter_mut().zip(&other.globals)) {
            *a += factor * b;
        }
    }

    /// Multiplies by a factor.
    pub fn stretch(&mut self, factor: f64) {
        for v in self.stations.as_flattened_mut().iter_mut().chain(&mut self.globals) {
            *v *= factor;
        }
    }

    pub fn is_finite(&self) -> bool {
        self.globals.iter().chain(self.stations.iter().flatten()).all(|v| v.is_finite())
    }
}

impl Linearised {
    /// Largest residual of all equations.
    pub fn residual(&self) -> f64 {
        let chain = self.blocks.iter().flat_map(|b| b.residual);
        chain
            .chain(self.speed_residual.iter().copied())
            .chain(self.transition.iter().map(|t| t.re))
            .chain([self.speeds.points[self.numbering.side].re])
            // NaN must not be lost in a maximum
            .fold(0.0, |worst: f64, r| if r.is_nan() { f64::NAN } else { worst.max(r.abs()) })
    }

    /// Euclidean norm of all residuals.
    pub fn norm(&self) -> f64 {
        let chain = self.blocks.iter().flat_map(|b| b.residual);
        chain
            .chain(self.speed_residual.iter().copied())
            .chain(self.transition.iter().map(|t| t.re))
            .chain([self.speeds.points[self.numbering.side].re])
            .map(|r| r * r)
            .sum::<f64>()
            .sqrt()
    }

    /// Derivative of the speed residual of station `k` with respect to ln of the defects of all stations, and to the
    /// four global directions, but without the station's own speed.
    pub(super) fn speed_row(&self, k: usize, row: &mut [f64]) -> [f64; 4] {
        let n = &self.numbering;
        let (sign, by_mass, by_global) = match n.on_side(k) {
            Some((side, j)) => {
                let p = n.point(side, j);
                (side.sign(), self.by_mass.points.column(p), self.speeds.points[p])
            }
            None => {
                let w = k - n.wake_start();
                (1.0, self.by_mass.wake.column(w), self.speeds.wake[w])
            }
        };
        scatter_by_mass(n, by_mass.as_slice(), &self.mass, -sign, row);
        gradient(&by_global).map(|g| -sign * g)
    }
}

/// From derivatives with respect to the signed defects at the points and in the wake to those with respect to the
/// logarithms of the defects of the stations, times `factor`.
fn scatter_by_mass(numbering: &Numbering, by_mass: &[f64], mass: &[f64], factor: f64, row: &mut [f64]) {
    let side = numbering.side;
    let (upper, rest) = by_mass.split_at(side);
    let (lower, wake) = rest[1..].split_at(side);
    let (own_upper, rest) = row.split_at_mut(side);
    let (own_lower, own_wake) = rest.split_at_mut(side);
    for ((r, v), m) in own_upper.iter_mut().zip(upper.iter().rev()).zip(mass) {
        *r = factor * v * m;
    }
    for ((r, v), m) in own_lower.iter_mut().zip(lower).zip(&mass[side..]) {
        *r = -factor * v * m;
    }
    for ((r, v), m) in own_wake.iter_mut().zip(wake).zip(&mass[2 * side..]) {
        *r = factor * v * m;
    }
}

/// The linearised system, eliminated and factorised.
#[derive(Debug, Clone)]
pub(crate) struct Reduced<'a> {
    pub system: &'a Linearised,
    elimination: Elimination,
    /// Of the transposed dense matrix.
    factors: Factors,
}

impl<'a> Reduced<'a> {
    /// `None` where a block or the dense system is singular or not finite.
    pub fn new(system: &'a Linearised) -> Option<Self> {
        let elimination = Elimination::new(system)?;
        let factors = Factors::of(elimination.dense_transposed(system))?;
        Some(Self { system, elimination, factors })
    }

    /// The Newton step: minus the inverse Jacobian times the residuals.
    pub fn step(&self) -> Change {
        let system = self.system;
        self.solve(&Residuals {
            blocks: &system.blocks.iter().map(|b| b.residual).collect::<Vec<_>>(),
            speed: &system.speed_residual,
            transition: system.transition.map(|t| t.re),
            stagnation: system.speeds.points[system.numbering.side].re,
        })
    }

    /// Minus the inverse Jacobian times the derivative of the residuals by the onset flow, which changes by `factor`
    /// times `onset`.
    pub fn by_onset(&self, section: &SectionResponse, onset: &Onset, factor: f64) -> Change {
        let system = self.system;
        let n = &system.numbering;
        let at = |p: usize| value_at(section, &onset.inviscid_spline, system.positions.index[p].re);
        let speed: Vec<f64> = (0..n.stations())
            .map(|k| match n.on_side(k) {
                Some((side, j)) => -factor * side.sign() * at(n.point(side, j)),
                None => -factor * onset.wake_inviscid[k - n.wake_start()],
            })
            .collect();
        let blocks = vec![[0.0; 3]; n.stations()];
        self.solve(&Residuals { blocks: &blocks, speed: &speed, transition: [0.0; 2], stagnation: factor * at(n.side) })
    }

    /// The same for trips whose arc lengths change at the given rates.
    pub fn by_trips(&self, rates: [f64; 2]) -> Change {
        let n = self.system.numbering.stations();
        let slope = |side: Side| gradient(&self.system.transition[side.index()])[BY_TRIP];
        let transition = Side::BOTH.map(|side| slope(side) * rates[side.index()]);
        self.solve(&Residuals { blocks: &vec![[0.0; 3]; n], speed: &vec![0.0; n], transition, stagnation: 0.0 })
    }

    /// Minus the inverse Jacobian times any residuals.
    pub fn solve(&self, residuals: &Residuals) -> Change {
        let system = self.system;
        let n = system.numbering.stations();
        let still = self.elimination.march(residuals.blocks, &[], [0.0; 3]);
        let mut dense = vec![0.0; n + 3];
        for k in 0..n {
            dense[k] = -residuals.speed[k] - self.elimination.speed[k] * still[k][2];
        }
        for side in Side::BOTH {
            let slope = gradient(&system.transition[side.index()])[BY_AMPLIFICATION];
            dense[n + side.index()] = -residuals.transition[side.index()] - slope * still[system.last_laminar(side)][1];
        }
        dense[n + 2] = -residuals.stagnation;
        let dense = self.factors.solve_transposed_vector(dense);
        let globals = [dense[n], dense[n + 1], dense[n + 2]];
        let states = self.elimination.march(residuals.blocks, &dense[..n], globals);
        let stations = states
            .iter()
            .enumerate()
            .map(|(k, z)| {
                let [by_theta, by_shape, _, by_speed] = system.log_mass[k];
                let shape = (dense[k] - by_theta * z[0] - by_speed * z[2]) / by_shape;
                [z[0], shape, z[1], z[2]]
            })
            .collect();
        Change { stations, globals }
    }
}

/// Residuals of all equations.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Residuals<'a> {
    pub blocks: &'a [[f64; 3]],
    pub speed: &'a [f64],
    pub transition: [f64; 2],
    pub stagnation: f64,
}

impl Linearised {
    pub fn last_laminar(&self, side: Side) -> usize {
        self.numbering.station(side, self.numbering.laminar - 1)
    }

    /// Row of the stagnation equation over the dense unknowns.
    pub(super) fn stagnation_row(&self, row: &mut [f64]) {
        let n = &self.numbering;
        let by_mass = self.by_mass.points.column(n.side);
        scatter_by_mass(n, by_mass.as_slice(), &self.mass, 1.0, row);
        row[n.stations()..].copy_from_slice(&gradient(&self.speeds.points[n.side])[..3]);
    }
}

/// Sensitivity of one output to all unknowns, laid out like a [`Change`].
pub(crate) type OutputGradient = Change;

/// Multipliers of all equations, one number an output.
#[derive(Debug, Clone)]
pub(crate) struct Multipliers<const N: usize> {
    /// Of the boundary-layer equations, three a station.
    pub chain: Vec<[SVector<f64, N>; 3]>,
    /// Of the edge-speed equations.
    pub speed: Vec<SVector<f64, N>>,
    pub transition: [SVector<f64, N>; 2],
    pub stagnation: SVector<f64, N>,
}

impl Reduced<'_> {
    /// Solves the transposed system: multipliers λ with Jᵀ λ = output gradient, for every output.
    pub fn adjoint<const N: usize>(&self, outputs: &[OutputGradient; N]) -> Multipliers<N> {
        let (states, dense) = self.eliminate(outputs);
        let mut columns = DMatrix::from_fn(dense.len(), N, |k, output| dense[k][output]);
        self.factors.solve(&mut columns);
        let dense: Vec<SVector<f64, N>> =
            (0..columns.nrows()).map(|k| SVector::from_fn(|output, _| columns[(k, output)])).collect();
        self.complete(states, &dense)
    }

    /// What the outputs leave on the states once the dense unknowns are split off, and the right-hand sides of these.
    fn eliminate<const N: usize>(
        &self,
        outputs: &[OutputGradient; N],
    ) -> (Vec<[SVector<f64, N>; 3]>, Vec<SVector<f64, N>>) {
        let n = self.system.numbering.stations();
        let (mut states, mut dense) = (Vec::with_capacity(n), Vec::with_capacity(n + 3));
        for k in 0..n {
            let [theta, shape, third, speed] =
                std::array::from_fn(|i| SVector::from_fn(|output, _| outputs[output].stations[k][i]));
            let [by_theta, by_shape, _, by_speed] = self.system.log_mass[k];
            let share: SVector<f64, N> = shape / by_shape;
            states.push([theta - share * by_theta, third, speed - share * by_speed]);
            dense.push(share);
        }
        dense.extend((0..3).map(|g| SVector::from_fn(|output, _| outputs[output].globals[g])));
        self.elimination.march_back(&mut states.clone(), &mut dense);
        (states, dense)
    }

    /// All multipliers from those of the dense equations.
    fn complete<const N: usize>(
        &self,
        mut states: Vec<[SVector<f64, N>; 3]>,
        dense: &[SVector<f64, N>],
    ) -> Multipliers<N> {
        let system = self.system;
        let n = system.numbering.stations();
        for k in 0..n {
            states[k][2] -= dense[k] * self.elimination.speed[k];
        }
        for side in Side::BOTH {
            let slope = gradient(&system.transition[side.index()])[BY_AMPLIFICATION];
            states[system.last_laminar(side)][1] -= dense[n + side.index()] * slope;
        }
        Multipliers {
            chain: self.elimination.multipliers(states),
            speed: dense[..n].to_vec(),
            transition: [dense[n], dense[n + 1]],
            stagnation: dense[n + 2],
        }
    }
}
