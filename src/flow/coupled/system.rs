//! The coupled system, linearised and reduced to about one unknown per station.
//!
//! The boundary-layer equations of a station give θ, the third unknown and the speed once the mass defect is known
//! (inverse mode, which stays regular through separation). Marching them downstream leaves a dense system for the
//! logarithms of the mass defects and the three global unknowns.

use super::chain::{self, Block, Layer};
use super::duals::{Dual4, Dual8, gradient};
use super::layout::Layout;
use super::response::{FlowResponse, SectionResponse};
use super::speeds::{EdgeSpeeds, Positions};
use super::transition;
use super::unknowns::{Numbering, Side, Unknowns};
use crate::flow::boundary_layer::gas::Gas;
use crate::flow::boundary_layer::station::{Derived, Regime};
use crate::flow::linear::Factors;
use nalgebra::{DMatrix, Matrix3, Vector3};

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
    pub derived: Vec<Derived<Dual4>>,
    pub positions: Positions,
    pub speeds: EdgeSpeeds,
    pub blocks: Vec<Block>,
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
        let speeds = EdgeSpeeds::new(self.section, self.flow, &positions, &points, &wake);
        let speed_residual = (0..numbering.stations())
            .map(|k| {
                let speed = unknowns.stations[k].log_speed.exp();
                match numbering.on_side(k) {
                    Some((side, j)) => speed - side.sign() * speeds.points[numbering.point(side, j)].re,
                    None => speed - speeds.wake[k - numbering.wake_start()].re,
                }
            })
            .collect();
        let transition = Side::BOTH.map(|side| self.transition(unknowns, side));
        Linearised { numbering, derived, positions, speeds, blocks, mass, log_mass, speed_residual, transition }
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

    fn transition(&self, unknowns: &Unknowns, side: Side) -> Dual8 {
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
    fn speed_row(&self, k: usize, row: &mut [f64]) -> [f64; 4] {
        let n = &self.numbering;
        let (sign, by_mass, by_global) = match n.on_side(k) {
            Some((side, j)) => {
                let p = n.point(side, j);
                (side.sign(), self.speeds.points_by_mass.column(p), self.speeds.points[p])
            }
            None => {
                let w = k - n.wake_start();
                (1.0, self.speeds.wake_by_mass.column(w), self.speeds.wake[w])
            }
        };
        for (l, value) in row.iter_mut().enumerate().take(n.stations()) {
            let (column, signed) = match n.on_side(l) {
                Some((side, j)) => (n.point(side, j), side.sign()),
                None => (n.points() + l - n.wake_start(), 1.0),
            };
            *value = -sign * by_mass[column] * signed * self.mass[l];
        }
        gradient(&by_global).map(|g| -sign * g)
    }
}

/// The linearised system, eliminated and factorised.
#[derive(Debug, Clone)]
pub(crate) struct Reduced<'a> {
    pub system: &'a Linearised,
    /// Inverse of the block of every station in (ln θ, third, ln u).
    inverse: Vec<Matrix3<f64>>,
    /// Response of (ln θ, third, ln u) of every station to the dense unknowns; the last row holds the right-hand side.
    /// One column per station and unknown.
    response: DMatrix<f64>,
    factors: Factors,
}

/// A coupling in the variables of the elimination: (ln θ, third, ln u) and the logarithm of the defect.
struct Turned {
    states: Matrix3<f64>,
    defect: Vector3<f64>,
}

fn turn(coupling: &chain::Coupling, log_mass: &[f64; 4]) -> Turned {
    let [by_theta, by_shape, _, by_speed] = *log_mass;
    let mut states = Matrix3::zeros();
    let mut defect = Vector3::zeros();
    for (i, row) in coupling.iter().enumerate() {
        let share = row[1] / by_shape;
        states[(i, 0)] = row[0] - share * by_theta;
        states[(i, 1)] = row[2];
        states[(i, 2)] = row[3] - share * by_speed;
        defect[i] = share;
    }
    Turned { states, defect }
}

impl<'a> Reduced<'a> {
    /// `None` where a block or the dense system is singular or not finite.
    pub fn new(system: &'a Linearised) -> Option<Self> {
        let n = system.numbering.stations();
        let (inverse, response) = eliminate(system)?;
        let size = n + 3;
        let mut rows = DMatrix::zeros(size, size);
        for k in 0..n {
            let speed = system.derived[k].state.log_speed.re.exp();
            let mut column = rows.column_mut(k);
            let row = column.as_mut_slice();
            let globals = system.speed_row(k, row);
            row[n..].copy_from_slice(&globals[..3]);
            for (r, z) in row.iter_mut().zip(response.column(3 * k + 2).iter()) {
                *r += speed * z;
            }
        }
        for side in Side::BOTH {
            let at = side.index();
            let slope = gradient(&system.transition[at]);
            let last = system.last_laminar(side);
            let mut column = rows.column_mut(n + at);
            let row = column.as_mut_slice();
            for (r, z) in row.iter_mut().zip(response.column(3 * last + 1).iter()) {
                *r = slope[BY_AMPLIFICATION] * z;
            }
            for g in 0..3 {
                row[n + g] += slope[g];
            }
        }
        let mut column = rows.column_mut(n + 2);
        system.stagnation_row(column.as_mut_slice());
        let factors = Factors::new(&rows.transpose())?;
        Some(Self { system, inverse, response, factors })
    }

    /// The Newton step: minus the inverse Jacobian times the residuals.
    pub fn step(&self) -> Change {
        let system = self.system;
        let n = system.numbering.stations();
        let constant = n + 3;
        let mut dense = DMatrix::zeros(n + 3, 1);
        for k in 0..n {
            let speed = system.derived[k].state.log_speed.re.exp();
            dense[k] = -system.speed_residual[k] - speed * self.response[(constant, 3 * k + 2)];
        }
        for side in Side::BOTH {
            let t = system.transition[side.index()];
            let last = system.last_laminar(side);
            dense[n + side.index()] = -t.re - gradient(&t)[BY_AMPLIFICATION] * self.response[(constant, 3 * last + 1)];
        }
        dense[n + 2] = -system.speeds.points[system.numbering.side].re;
        self.factors.solve(&mut dense);
        let stations = (0..n)
            .map(|k| {
                let z = [0, 1, 2].map(|i| {
                    let column = self.response.column(3 * k + i);
                    column.iter().zip(dense.iter()).map(|(a, b)| a * b).sum::<f64>() + column[constant]
                });
                let [by_theta, by_shape, _, by_speed] = system.log_mass[k];
                let shape = (dense[k] - by_theta * z[0] - by_speed * z[2]) / by_shape;
                [z[0], shape, z[1], z[2]]
            })
            .collect();
        Change { stations, globals: [dense[n], dense[n + 1], dense[n + 2]] }
    }
}

impl Linearised {
    pub fn last_laminar(&self, side: Side) -> usize {
        self.numbering.station(side, self.numbering.laminar - 1)
    }

    /// Row of the stagnation equation over the dense unknowns.
    fn stagnation_row(&self, row: &mut [f64]) {
        let n = &self.numbering;
        let by_mass = self.speeds.points_by_mass.column(n.side);
        for l in 0..n.stations() {
            let (column, sign) = match n.on_side(l) {
                Some((side, j)) => (n.point(side, j), side.sign()),
                None => (n.points() + l - n.wake_start(), 1.0),
            };
            row[l] = by_mass[column] * sign * self.mass[l];
        }
        row[n.stations()..].copy_from_slice(&gradient(&self.speeds.points[n.side])[..3]);
    }
}

/// Marches the blocks downstream. Returns the inverse own blocks and the responses.
fn eliminate(system: &Linearised) -> Option<(Vec<Matrix3<f64>>, DMatrix<f64>)> {
    let numbering = &system.numbering;
    let n = numbering.stations();
    let mut inverses = Vec::with_capacity(n);
    let mut response = DMatrix::zeros(n + 4, 3 * n);
    let mut right = DMatrix::zeros(n + 4, 3);
    for (k, block) in system.blocks.iter().enumerate() {
        let own = turn(&block.own, &system.log_mass[k]);
        let inverse = own.states.try_inverse()?;
        // unknowns that can act on this station
        let reach = match numbering.on_side(k) {
            Some((side, _)) => numbering.station(side, 0)..k + 1,
            None => 0..k + 1,
        };
        right.fill(0.0);
        for (up, coupling) in block.upstream.iter().flatten() {
            let turned = turn(coupling, &system.log_mass[*up]);
            for i in 0..3 {
                right[(*up, i)] += turned.defect[i];
                for q in 0..3 {
                    let factor = turned.states[(i, q)];
                    if factor == 0.0 {
                        continue;
                    }
                    let source = response.column(3 * up + q);
                    let (source, mut target) = (source.as_slice(), right.column_mut(i));
                    let target = target.as_mut_slice();
                    for range in [reach.clone(), n..n + 4] {
                        for (t, s) in target[range.clone()].iter_mut().zip(&source[range]) {
                            *t += factor * s;
                        }
                    }
                }
            }
        }
        for i in 0..3 {
            right[(k, i)] += own.defect[i];
            for g in 0..3 {
                right[(n + g, i)] += block.globals[i][g];
            }
            right[(n + 3, i)] += block.residual[i];
        }
        for i in 0..3 {
            let mut column = response.column_mut(3 * k + i);
            let target = column.as_mut_slice();
            for q in 0..3 {
                let factor = -inverse[(i, q)];
                let source = right.column(q);
                for range in [reach.clone(), n..n + 4] {
                    for (t, s) in target[range.clone()].iter_mut().zip(&source.as_slice()[range]) {
                        *t += factor * s;
                    }
                }
            }
        }
        inverses.push(inverse);
    }
    Some((inverses, response))
}

/// Sensitivity of one output to all unknowns, laid out like a [`Change`].
pub(crate) type OutputGradient = Change;

/// Multipliers of all equations for one output.
#[derive(Debug, Clone)]
pub(crate) struct Multipliers {
    /// Of the boundary-layer equations, three a station.
    pub chain: Vec<[f64; 3]>,
    /// Of the edge-speed equations.
    pub speed: Vec<f64>,
    pub transition: [f64; 2],
    pub stagnation: f64,
}

impl Reduced<'_> {
    /// Solves the transposed system: multipliers λ with Jᵀ λ = output gradient.
    pub fn adjoint(&self, output: &OutputGradient) -> Multipliers {
        let system = self.system;
        let n = system.numbering.stations();
        let mut states = Vec::with_capacity(n);
        let mut dense = DMatrix::zeros(n + 3, 1);
        for (k, [theta, shape, third, speed]) in output.stations.iter().copied().enumerate() {
            let [by_theta, by_shape, _, by_speed] = system.log_mass[k];
            let share = shape / by_shape;
            states.push(Vector3::new(theta - share * by_theta, third, speed - share * by_speed));
            dense[k] += share;
        }
        for g in 0..3 {
            dense[n + g] += output.globals[g];
        }
        for (k, z) in states.iter().enumerate() {
            for i in (0..3).filter(|&i| z[i] != 0.0) {
                for (d, r) in dense.iter_mut().zip(self.response.column(3 * k + i).iter()) {
                    *d += z[i] * r;
                }
            }
        }
        self.factors.solve_transposed(&mut dense);
        for k in 0..n {
            states[k][2] -= system.derived[k].state.log_speed.re.exp() * dense[k];
        }
        for side in Side::BOTH {
            let slope = gradient(&system.transition[side.index()])[BY_AMPLIFICATION];
            states[system.last_laminar(side)][1] -= slope * dense[n + side.index()];
        }
        let mut chain = vec![[0.0; 3]; n];
        for k in (0..n).rev() {
            let multiplier = self.inverse[k].transpose() * states[k];
            chain[k] = [multiplier[0], multiplier[1], multiplier[2]];
            for (up, coupling) in system.blocks[k].upstream.iter().flatten() {
                states[*up] -= turn(coupling, &system.log_mass[*up]).states.transpose() * multiplier;
            }
        }
        let dense = dense.as_slice();
        Multipliers {
            chain,
            speed: dense[..n].to_vec(),
            transition: [dense[n], dense[n + 1]],
            stagnation: dense[n + 2],
        }
    }
}
