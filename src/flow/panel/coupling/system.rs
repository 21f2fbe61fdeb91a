//! The coupled system, linearised and reduced to about one unknown per station.
//!
//! The boundary-layer equations of a station give θ, the third unknown and the speed once the mass defect is known
//! (inverse mode, which stays regular through separation). Marching them downstream leaves a dense system for the
//! logarithms of the mass defects and the three global unknowns.

use super::eliminate::Elimination;
use super::response::{FlowResponse, Onset, SectionResponse};
use super::speeds::{EdgeSpeeds, Global, Positions, SpeedsByMass, value_at};
use crate::flow::duals::{ByStation, gradient};
use crate::flow::layer::blocks::Block;
use crate::flow::layer::equations::{BY_AMPLIFICATION, BY_TRIP, ByTransition};
use crate::flow::layer::{
    Change, Derived, EQUATIONS, GLOBAL_UNKNOWNS, GLOBALS, Layer, Layout, Numbering, OuterSpeeds, Side, State, Unknowns,
};
use crate::flow::linear::Factors;
use crate::flow::memory::Recycled;
use crate::flow::panel::compressibility::PanelEdge;
use crate::flow::search::{self, Equations};
use crate::scalar::Scalar;
use nalgebra::{DMatrix, SVector};
use num_dual::DualNum;
use std::f64::consts::FRAC_PI_2;

/// Everything that is constant while the coupled system is solved.
#[derive(Debug, Clone, Copy)]
pub(crate) struct System<'a> {
    pub section: &'a SectionResponse,
    pub flow: &'a FlowResponse,
    pub layer: Layer<'a, PanelEdge<f64>>,
}

/// The free stream and where transition is forced.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stream {
    pub mach: f64,
    pub reynolds: f64,
    pub n_critical: f64,
    /// Arc length of the trip of each side from the first node, where there is one.
    pub trips: [Option<f64>; 2],
}

/// The system at one set of unknowns: residuals and exact Jacobian in blocks.
#[derive(Debug, Clone)]
pub(crate) struct Linearised {
    pub numbering: Numbering,
    pub derived: Recycled<Derived<ByStation>>,
    pub positions: Positions,
    pub speeds: EdgeSpeeds,
    pub by_mass: SpeedsByMass,
    pub blocks: Recycled<Block>,
    /// Mass defect (unsigned) of every station and the gradient of its logarithm in the station's unknowns.
    pub mass: Vec<f64>,
    pub log_mass: Vec<State>,
    /// Transition residuals of both sides.
    pub transition: [ByTransition; 2],
    pub residuals: Residuals,
}

/// Mass defect of a station, without sign: the speed of the panels times the displacement thickness, in the wake with the
/// dead air.
pub(crate) fn mass_defect<S: Scalar>(station: &Derived<S>, gap: Option<S>) -> S {
    let displacement = gap.map_or(station.displacement, |gap| station.displacement + gap);
    station.speed * displacement
}

impl<'a> System<'a> {
    pub fn new(section: &'a SectionResponse, flow: &'a FlowResponse, layout: &'a Layout, stream: Stream) -> Self {
        let Stream { mach, reynolds, n_critical, trips } = stream;
        let layer = Layer {
            layout,
            law: PanelEdge::new(mach, reynolds),
            gap: &flow.gap,
            distances: &section.wake_distances,
            total: section.map.total,
            n_critical,
            trips,
        };
        Self { section, flow, layer }
    }

    /// Edge-speed residual of every station.
    fn speed_residuals<D: Scalar, S: Global>(&self, derived: &[Derived<D>], speeds: &EdgeSpeeds<S>) -> Vec<f64> {
        let numbering = self.layer.numbering();
        let residual = |(k, station): (usize, &Derived<D>)| match numbering.on_side(k) {
            Some((side, j)) => station.speed.re() - side.sign() * speeds.points[numbering.point(side, j)].re(),
            None => station.speed.re() - speeds.wake[k - numbering.wake_start()].re(),
        };
        derived.iter().enumerate().map(residual).collect()
    }

    /// Mass defects of all stations and the gradients of their logarithms.
    fn masses(&self, derived: &[Derived<ByStation>]) -> (Vec<f64>, Vec<State>) {
        let first = self.layer.numbering().wake_start();
        let gap = |k: usize| k.checked_sub(first).map(|k| ByStation::from_re(self.flow.gap[k]));
        let masses = derived.iter().enumerate().map(|(k, d)| mass_defect(d, gap(k)));
        masses.map(|m| (m.re, State::gradient(&m.ln()))).unzip()
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

impl Linearised {
    /// Derivative of the speed residual of station `k` with respect to ln of the defects of all stations, and to the
    /// four global directions, but without the station's own speed.
    pub(super) fn speed_row(&self, k: usize, row: &mut [f64]) -> [f64; GLOBALS] {
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

/// A linearised system, eliminated and factorised.
#[derive(Debug, Clone)]
pub(crate) struct Reduced {
    elimination: Elimination,
    /// Factors of the transposed dense matrix.
    factors: Factors,
}

impl Reduced {
    /// `None` where a block or the dense system is singular or not finite.
    pub fn new(at: &Linearised) -> Option<Self> {
        let elimination = Elimination::new(at)?;
        let factors = Factors::of(elimination.dense_transposed(at))?;
        Some(Self { elimination, factors })
    }

    /// Minus the inverse Jacobian times the derivative of the residuals by the onset flow, which changes by `factor`
    /// times `onset`.
    pub fn by_onset(&self, at: &Linearised, section: &SectionResponse, onset: &Onset, factor: f64) -> Change {
        let n = &at.numbering;
        let strength = |p: usize| value_at(section, &onset.inviscid_spline, at.positions.index[p].re);
        let speed: Vec<f64> = (0..n.stations())
            .map(|k| match n.on_side(k) {
                Some((side, j)) => -factor * side.sign() * strength(n.point(side, j)),
                None => -factor * onset.wake_inviscid[k - n.wake_start()],
            })
            .collect();
        self.solve(at, &Residuals { speed, stagnation: factor * strength(n.side), ..Residuals::zeros(n.stations()) })
    }

    /// Minus the inverse Jacobian times the derivative of the residuals by trips whose arc lengths change at the given
    /// rates.
    pub fn by_trips(&self, at: &Linearised, rates: [f64; 2]) -> Change {
        let slope = |side: Side| at.transition[side.index()].eps[BY_TRIP];
        let transition = Side::BOTH.map(|side| slope(side) * rates[side.index()]);
        self.solve(at, &Residuals { transition, ..Residuals::zeros(at.numbering.stations()) })
    }

    /// Minus the inverse Jacobian times any residuals.
    pub fn solve(&self, system: &Linearised, residuals: &Residuals) -> Change {
        let n = system.numbering.stations();
        let still = self.elimination.march(&residuals.blocks, &[], [0.0; GLOBAL_UNKNOWNS]);
        let mut dense = vec![0.0; n + GLOBAL_UNKNOWNS];
        for k in 0..n {
            dense[k] = -residuals.speed[k] - self.elimination.speed[k] * still[k][2];
        }
        for side in Side::BOTH {
            let slope = gradient(&system.transition[side.index()])[BY_AMPLIFICATION];
            dense[n + side.index()] =
                -residuals.transition[side.index()] - slope * still[system.numbering.last_laminar(side)][1];
        }
        dense[n + 2] = -residuals.stagnation;
        let dense = self.factors.solve_transposed_vector(dense);
        let globals = [dense[n], dense[n + 1], dense[n + 2]];
        let states = self.elimination.march(&residuals.blocks, &dense[..n], globals);
        let stations = states
            .iter()
            .enumerate()
            .map(|(k, &[log_theta, third, log_speed])| {
                let by = &system.log_mass[k];
                let log_shape = (dense[k] - by.log_theta * log_theta - by.log_speed * log_speed) / by.log_shape;
                State { log_theta, log_shape, third, log_speed }
            })
            .collect();
        Change::new(stations, globals)
    }
}

/// Residuals of all equations.
#[derive(Debug, Clone)]
pub(crate) struct Residuals {
    pub blocks: Vec<[f64; EQUATIONS]>,
    /// Edge-speed residual of every station.
    pub speed: Vec<f64>,
    pub transition: [f64; 2],
    pub stagnation: f64,
}

impl Residuals {
    /// No residuals at so many stations.
    fn zeros(stations: usize) -> Self {
        let blocks = vec![[0.0; EQUATIONS]; stations];
        Self { blocks, speed: vec![0.0; stations], transition: [0.0; 2], stagnation: 0.0 }
    }

    /// All numbers.
    pub fn all(&self) -> impl Iterator<Item = f64> + '_ {
        let ends = self.transition.into_iter().chain([self.stagnation]);
        self.blocks.as_flattened().iter().chain(&self.speed).copied().chain(ends)
    }
}

impl search::Residuals for Residuals {
    fn norm(&self) -> f64 {
        self.all().map(|r| r * r).sum::<f64>().sqrt()
    }

    fn largest(&self) -> f64 {
        // NaN must not be lost in a maximum
        self.all().fold(0.0, |worst: f64, r| if r.is_nan() { f64::NAN } else { worst.max(r.abs()) })
    }
}

/// The solved form of a linearisation, for Newton's method and the search.
impl<'a> Equations for System<'a> {
    type Law = PanelEdge<f64>;
    type Residuals = Residuals;
    type At = Linearised;
    type Factors = Reduced;

    fn layer(&self) -> &Layer<'_, PanelEdge<f64>> {
        &self.layer
    }

    fn march(&self) -> Unknowns {
        let (section, flow) = (self.section, self.flow);
        let stagnation = flow.stagnation(section);
        let surface = |side: Side, x: f64| {
            let t = section.map.index(side.place(stagnation, x));
            side.sign() * value_at(section, &flow.inviscid_spline, t)
        };
        self.layer.march(&OuterSpeeds { stagnation, surface: &surface, wake: &flow.wake_inviscid })
    }

    fn residuals(&self, unknowns: &Unknowns) -> Residuals {
        let layer = &self.layer;
        let numbering = layer.numbering();
        let positions = Positions::<f64>::new(layer.layout, self.section, unknowns);
        let derived: Vec<Derived<f64>> = layer.derive(unknowns, |state| *state, &layer.law);
        let blocks = layer.residuals(&derived, &positions.abscissas, &layer.law, layer.gap);
        let gap = |k: usize| k.checked_sub(numbering.wake_start()).map(|k| layer.gap[k]);
        let mass: Vec<f64> = derived.iter().enumerate().map(|(k, d)| mass_defect(d, gap(k))).collect();
        let (points, wake) = signed(&mass, &numbering);
        let speeds = EdgeSpeeds::new(self.section, self.flow, &positions, &points, &wake);
        Residuals {
            blocks,
            speed: self.speed_residuals(&derived, &speeds),
            transition: Side::BOTH.map(|side| layer.transition(unknowns, side).re),
            stagnation: speeds.points[numbering.side],
        }
    }

    fn linearise(&self, unknowns: &Unknowns) -> Linearised {
        let numbering = self.layer.numbering();
        let derived = self.layer.derive_all(unknowns);
        let positions = Positions::new(self.layer.layout, self.section, unknowns);
        let blocks = self.layer.blocks(&derived, &positions.abscissas);
        let (mass, log_mass) = self.masses(&derived);
        let (points, wake) = signed(&mass, &numbering);
        let (speeds, by_mass) = SpeedsByMass::new(self.section, self.flow, &positions, &points, &wake);
        let transition = Side::BOTH.map(|side| self.layer.transition(unknowns, side));
        let residuals = Residuals {
            blocks: blocks.iter().map(|b| b.residual).collect(),
            speed: self.speed_residuals(&derived, &speeds),
            transition: transition.map(|t| t.re),
            stagnation: speeds.points[numbering.side].re,
        };
        Linearised { numbering, derived, positions, speeds, by_mass, blocks, mass, log_mass, transition, residuals }
    }

    fn residuals_at<'b>(&self, at: &'b Linearised) -> &'b Residuals {
        &at.residuals
    }

    fn factorise(&self, at: &Linearised) -> Option<Reduced> {
        Reduced::new(at)
    }

    fn solve(&self, at: &Linearised, factors: &Reduced, residuals: &Residuals) -> Change {
        factors.solve(at, residuals)
    }

    fn by_angle(&self, at: &Linearised, factors: &Reduced) -> Change {
        // the system is linear in the onset flow, whose derivative with respect to the angle is that flow a quarter turn on
        let quarter_turn = self.flow.onset(self.section, self.flow.alpha + FRAC_PI_2);
        factors.by_onset(at, self.section, &quarter_turn, 1.0)
    }

    fn by_trips(&self, at: &Linearised, factors: &Reduced, rates: [f64; 2]) -> Change {
        factors.by_trips(at, rates)
    }
}

impl Linearised {
    /// Row of the stagnation equation over the dense unknowns.
    pub(super) fn stagnation_row(&self, row: &mut [f64]) {
        let n = &self.numbering;
        let by_mass = self.by_mass.points.column(n.side);
        scatter_by_mass(n, by_mass.as_slice(), &self.mass, 1.0, row);
        row[n.stations()..].copy_from_slice(&gradient(&self.speeds.points[n.side])[..GLOBAL_UNKNOWNS]);
    }
}

/// Multipliers λ of all equations, one number per output.
#[derive(Debug, Clone)]
pub(crate) struct Multipliers<const N: usize> {
    /// Multipliers of the boundary-layer equations, station by station.
    pub chain: Vec<[SVector<f64, N>; EQUATIONS]>,
    /// Multipliers of the edge-speed equations.
    pub speed: Vec<SVector<f64, N>>,
    pub transition: [SVector<f64, N>; 2],
    pub stagnation: SVector<f64, N>,
}

impl Reduced {
    /// Solves the transposed system: multipliers λ with Jᵀ λ = output gradient, for every output.
    pub fn adjoint<const N: usize>(&self, system: &Linearised, outputs: [&Change; N]) -> Multipliers<N> {
        let (states, dense) = self.eliminate(system, outputs);
        let mut columns = DMatrix::from_fn(dense.len(), N, |k, output| dense[k][output]);
        self.factors.solve(&mut columns);
        let dense: Vec<SVector<f64, N>> =
            (0..columns.nrows()).map(|k| SVector::from_fn(|output, _| columns[(k, output)])).collect();
        self.complete(system, states, &dense)
    }

    /// What the outputs leave on the states once the dense unknowns are split off, and the right-hand sides of these.
    fn eliminate<const N: usize>(
        &self,
        system: &Linearised,
        outputs: [&Change; N],
    ) -> (Vec<[SVector<f64, N>; 3]>, Vec<SVector<f64, N>>) {
        let n = system.numbering.stations();
        let lanes = |of: &dyn Fn(&Change) -> f64| SVector::<f64, N>::from_fn(|output, _| of(outputs[output]));
        let (mut states, mut dense) = (Vec::with_capacity(n), Vec::with_capacity(n + GLOBAL_UNKNOWNS));
        for k in 0..n {
            let by = &system.log_mass[k];
            let share = lanes(&|output| output.stations[k].log_shape) / by.log_shape;
            states.push([
                lanes(&|output| output.stations[k].log_theta) - share * by.log_theta,
                lanes(&|output| output.stations[k].third),
                lanes(&|output| output.stations[k].log_speed) - share * by.log_speed,
            ]);
            dense.push(share);
        }
        dense.extend((0..GLOBAL_UNKNOWNS).map(|g| lanes(&|output| output.globals()[g])));
        self.elimination.march_back(&mut states.clone(), &mut dense);
        (states, dense)
    }

    /// All multipliers from those of the dense equations.
    fn complete<const N: usize>(
        &self,
        system: &Linearised,
        mut states: Vec<[SVector<f64, N>; 3]>,
        dense: &[SVector<f64, N>],
    ) -> Multipliers<N> {
        let n = system.numbering.stations();
        for k in 0..n {
            states[k][2] -= dense[k] * self.elimination.speed[k];
        }
        for side in Side::BOTH {
            let slope = gradient(&system.transition[side.index()])[BY_AMPLIFICATION];
            states[system.numbering.last_laminar(side)][1] -= dense[n + side.index()] * slope;
        }
        Multipliers {
            chain: self.elimination.multipliers(states),
            speed: dense[..n].to_vec(),
            transition: [dense[n], dense[n + 1]],
            stagnation: dense[n + 2],
        }
    }
}
