//! The coupled system and its linearisation.
//!
//! The boundary-layer equations of a station give θ, the third unknown and the speed once the mass defect is known
//! (inverse mode, which stays regular through separation). Marching them downstream leaves a dense system for the
//! logarithms of the mass defects and the three global unknowns.

use super::response::{FlowResponse, SectionResponse};
use super::speeds::{EdgeSpeeds, Global, Positions, SpeedsByMass};
use crate::flow::duals::gradient;
use crate::flow::layer::blocks::Block;
use crate::flow::layer::equations::ByTransition;
use crate::flow::layer::{
    ByStation, Derived, EQUATIONS, GLOBAL_UNKNOWNS, GLOBALS, Layer, Layout, Numbering, OuterSpeeds, Side, State,
    Unknowns,
};
use crate::flow::memory::Recycled;
use crate::flow::panel::compressibility::PanelEdge;
use crate::flow::search;
use crate::scalar::Scalar;
use num_dual::DualNum;

/// Everything that is constant while the coupled system is solved.
#[derive(Debug, Clone, Copy)]
pub(crate) struct System<'a> {
    /// Panel equations of the section.
    pub section: &'a SectionResponse,
    /// Onset flow and wake.
    pub flow: &'a FlowResponse,
    /// Constants of the boundary-layer equations.
    pub layer: Layer<'a, PanelEdge<f64>>,
}

/// The free stream, and where transition is forced.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stream {
    /// Mach number of the onset flow.
    pub mach: f64,
    /// Reynolds number on a chord of one.
    pub reynolds: f64,
    /// Critical amplification factor.
    pub n_critical: f64,
    /// Arc length of the trip of each side from the first node in chords, where there is a trip.
    pub trips: [Option<f64>; 2],
}

/// The system at one set of unknowns: the state of the flow, and the residuals.
#[derive(Debug, Clone)]
pub(crate) struct Evaluated {
    pub numbering: Numbering,
    /// Closure at every station.
    pub derived: Vec<Derived<f64>>,
    /// Abscissas of the stations.
    pub positions: Positions<f64>,
    /// Mass defect of every station, without sign.
    pub mass: Vec<f64>,
    /// Mass defect at the nodes as projected, before smoothing.
    pub node_mass: Vec<f64>,
    /// Residuals of all equations.
    pub residuals: Residuals,
}

/// The system at one set of unknowns: residuals, and the exact Jacobian in blocks.
#[derive(Debug, Clone)]
pub(crate) struct Linearised {
    pub numbering: Numbering,
    /// Closure at every station, with derivatives with respect to the unknowns of the station.
    pub derived: Recycled<Derived<ByStation>>,
    /// Abscissas of the stations, with derivatives in the global directions.
    pub positions: Positions,
    /// Speeds at the stations, with derivatives in the global directions.
    pub speeds: EdgeSpeeds,
    /// Derivatives of the speeds with respect to the mass defects.
    pub by_mass: SpeedsByMass,
    /// Linearised boundary-layer equations of every station.
    pub blocks: Recycled<Block>,
    /// Mass defect of every station, without sign.
    pub mass: Vec<f64>,
    /// Derivatives of the logarithm of the mass defect of every station with respect to the unknowns of the station.
    pub log_mass: Vec<State>,
    /// Transition residuals of both sides.
    pub transition: [ByTransition; 2],
    /// Residuals of all equations.
    pub residuals: Residuals,
}

/// Mass defect of a station, without sign: the speed of the panels times the displacement thickness, plus the dead air
/// in the wake.
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
            surface: &section.map,
            n_critical,
            trips,
        };
        Self { section, flow, layer }
    }

    /// Start of the Newton iteration, made by marching along the inviscid speeds.
    pub fn march(&self) -> Unknowns {
        let (section, flow) = (self.section, self.flow);
        let stagnation = flow.stagnation(section);
        let surface = |side: Side, x: f64| {
            let t = section.map.index(side.place(stagnation, x));
            side.sign() * section.map.spline.value(&flow.inviscid_spline, t)
        };
        self.layer.march(&OuterSpeeds { stagnation, surface: &surface, wake: &flow.wake_inviscid })
    }

    /// The state at some unknowns with the residuals of all equations, computed in `f64` throughout.
    pub fn evaluate(&self, unknowns: &Unknowns) -> Evaluated {
        let layer = &self.layer;
        let numbering = layer.numbering();
        let positions = Positions::<f64>::new(layer.layout, self.section, unknowns);
        let derived: Vec<Derived<f64>> = layer.derive(unknowns, |state| *state, &layer.law);
        let blocks = layer.residuals(&derived, &positions.abscissas, &layer.law, layer.gap);
        let gap = |k: usize| k.checked_sub(numbering.wake_start()).map(|k| layer.gap[k]);
        let mass: Vec<f64> = derived.iter().enumerate().map(|(k, d)| mass_defect(d, gap(k))).collect();
        let (points, wake) = signed(&mass, &numbering);
        let speeds = EdgeSpeeds::new(self.section, self.flow, &positions, &points, &wake);
        let residuals = Residuals {
            blocks,
            speed: self.speed_residuals(&derived, &speeds),
            transition: Side::BOTH.map(|side| layer.transition(unknowns, side).re),
            stagnation: speeds.points[numbering.side],
        };
        Evaluated { numbering, derived, positions, mass, node_mass: speeds.node_mass, residuals }
    }

    /// Residuals and derivatives of all equations.
    pub fn linearise(&self, unknowns: &Unknowns) -> Linearised {
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

/// Signed mass defects at the points along the surface, and mass defects of the wake.
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
    /// The state at the unknowns where the system was linearised.
    pub fn state(&self) -> Evaluated {
        Evaluated {
            numbering: self.numbering,
            derived: self.derived.iter().map(|d| d.map(|v| v.re)).collect(),
            positions: self.positions.values(),
            mass: self.mass.clone(),
            node_mass: self.speeds.node_mass.iter().map(|m| m.re).collect(),
            residuals: self.residuals.clone(),
        }
    }

    /// Writes to `row` the derivatives of the speed residual of station `k` with respect to the logarithms of the mass
    /// defects of all stations, and returns those with respect to the four global directions. The station's own speed
    /// is left out.
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

    /// Writes the row of the stagnation equation over the dense unknowns.
    pub(super) fn stagnation_row(&self, row: &mut [f64]) {
        let n = &self.numbering;
        let by_mass = self.by_mass.points.column(n.side);
        scatter_by_mass(n, by_mass.as_slice(), &self.mass, 1.0, row);
        row[n.stations()..].copy_from_slice(&gradient(&self.speeds.points[n.side])[..GLOBAL_UNKNOWNS]);
    }
}

/// Turns derivatives with respect to the signed mass defects at the points and in the wake into `factor` times those
/// with respect to the logarithms of the mass defects of the stations.
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

/// Residuals of all equations.
#[derive(Debug, Clone)]
pub(crate) struct Residuals {
    /// Residuals of the boundary-layer equations of every station.
    pub blocks: Vec<[f64; EQUATIONS]>,
    /// Edge-speed residual of every station.
    pub speed: Vec<f64>,
    /// Transition residuals of the upper and lower side.
    pub transition: [f64; 2],
    /// Residual of the stagnation equation.
    pub stagnation: f64,
}

impl Residuals {
    /// Zero residuals for a number of stations.
    pub fn zeros(stations: usize) -> Self {
        let blocks = vec![[0.0; EQUATIONS]; stations];
        Self { blocks, speed: vec![0.0; stations], transition: [0.0; 2], stagnation: 0.0 }
    }

    /// All residuals in one list.
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
