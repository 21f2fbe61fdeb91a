//! A viscous solution: coefficients, distributions, status, derivatives.

use super::boundary_layer::gas::Gas;
use super::condition::Condition;
use super::coupled::layout::Layout;
use super::coupled::newton::Converged;
use super::coupled::response::{FlowResponse, SectionResponse};
use super::coupled::speeds::{node_strengths, value_at};
use super::coupled::system::{Linearised, System};
use super::coupled::unknowns::{Side, Unknowns};
use super::outputs::{pressure_forces, squire_young};
use super::panel::forces::KarmanTsien;
use super::sensitivity::{Gradients, Solved, gradients};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Whether a solution is to be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Status {
    /// The residual is below the tolerance and the flow within the model.
    Converged,
    /// The iteration did not come down; the coefficients mean nothing.
    NotConverged {
        /// Largest residual left.
        residual: f64,
    },
    /// Converged, but separated so far that an integral layer with one-parameter profiles no longer describes it.
    Separated {
        /// Length of turbulent reversed flow on the worse side, over the length of the side.
        extent: f64,
    },
    /// Supersonic flow somewhere at the edge: the Kármán-Tsien correction does not hold, shocks and their drag are
    /// missing.
    Supersonic {
        /// Highest local Mach number.
        mach: f64,
    },
}

impl std::fmt::Display for Status {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Converged => write!(f, "converged"),
            Self::NotConverged { residual } => write!(f, "not converged (residual {residual:.1e})"),
            Self::Separated { extent } => {
                write!(f, "separated beyond the model (turbulent reversed flow over {:.0} % of a side)", 100.0 * extent)
            }
            Self::Supersonic { mach } => {
                write!(f, "supersonic (local Mach number {mach:.2}): shocks are beyond this solver")
            }
        }
    }
}

/// Turbulent Hk above which the flow at the wall runs backwards.
const REVERSED: f64 = 3.5;
/// Largest extent of turbulent reversed flow the model is trusted with, over the length of a side.
const REVERSED_EXTENT: f64 = 0.5;

/// One attempt of the solver, for the report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Attempt {
    /// What was tried.
    pub what: String,
    /// Newton iterations it took.
    pub iterations: usize,
    /// Largest residual at its end.
    pub residual: f64,
}

impl Attempt {
    pub(super) fn of(what: &str, end: &Converged) -> Self {
        Self { what: what.into(), iterations: end.iterations, residual: end.residual }
    }
}

/// The flow about a section at one operating point.
///
/// Lengths in chords, speeds in units of the onset speed, coefficients on the chord; moment about the quarter chord,
/// nose-up positive.
#[derive(Debug, Clone)]
pub struct Solution {
    /// Whether the numbers below are to be trusted.
    pub status: Status,
    /// Angle of attack in radians (found, where the lift was given).
    pub alpha: f64,
    /// Lift coefficient, from the surface pressure.
    pub cl: f64,
    /// Drag coefficient, from the end of the wake (Squire & Young).
    pub cd: f64,
    /// Pressure drag: total less friction.
    pub cd_pressure: f64,
    /// Friction drag.
    pub cd_friction: f64,
    /// Moment coefficient about the quarter chord, nose-up positive.
    pub cm: f64,
    /// Lowest pressure coefficient on the surface.
    pub cp_min: f64,
    /// Transition on the upper and the lower side, x in chords.
    pub transition: [f64; 2],
    /// Stagnation point, x in chords.
    pub stagnation: f64,
    /// Largest residual of all equations.
    pub residual: f64,
    /// Newton iterations of the last attempt.
    pub iterations: usize,
    /// What was tried before, where the direct way failed.
    pub attempts: Vec<Attempt>,
    pub(super) record: Arc<Record>,
}

/// What a solution was sought for.
pub(super) struct OperatingPoint {
    pub condition: Condition,
    pub section: Arc<SectionResponse>,
    pub nodes: Vec<[f64; 2]>,
    pub flow: FlowResponse,
    pub layout: Layout,
    pub trips: [Option<f64>; 2],
}

/// What derivatives, distributions and warm starts need.
#[derive(Debug)]
pub(super) struct Record {
    pub condition: Condition,
    pub section: Arc<SectionResponse>,
    pub flow: FlowResponse,
    pub layout: Layout,
    pub nodes: Vec<[f64; 2]>,
    pub trips: [Option<f64>; 2],
    pub unknowns: Unknowns,
    pub linearised: Linearised,
    pub strengths: Vec<f64>,
}

/// Flow at one station of the boundary layer or the wake.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StationFlow {
    /// Arc length from the stagnation point; in the wake, from the trailing edge.
    pub s: f64,
    /// x of the station, in chords.
    pub x: f64,
    /// y of the station, in chords.
    pub y: f64,
    /// Edge speed.
    pub edge_velocity: f64,
    /// Pressure coefficient at the edge.
    pub cp: f64,
    /// Momentum thickness θ.
    pub momentum_thickness: f64,
    /// Displacement thickness δ*, in the wake without the dead air.
    pub displacement_thickness: f64,
    /// Kinematic shape parameter.
    pub shape_parameter: f64,
    /// Skin-friction coefficient on the local dynamic pressure.
    pub skin_friction: f64,
    /// Amplification factor; zero where turbulent.
    pub amplification: f64,
    /// Shear-stress coefficient; zero where laminar.
    pub shear_stress: f64,
}

/// Distributions of a solution.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Distributions {
    /// Pressure coefficient at the nodes of the section, in their order.
    pub cp: Vec<f64>,
    /// Pressure coefficient at the nodes without boundary layer.
    pub cp_inviscid: Vec<f64>,
    /// Upper side from the stagnation point to the trailing edge.
    pub upper: Vec<StationFlow>,
    /// Lower side from the stagnation point to the trailing edge.
    pub lower: Vec<StationFlow>,
    /// Wake from the trailing edge.
    pub wake: Vec<StationFlow>,
}

impl Record {
    fn gas(&self) -> Gas<f64> {
        Gas::new(self.condition.mach, self.condition.reynolds)
    }

    fn system(&self) -> System<'_> {
        System {
            section: &self.section,
            flow: &self.flow,
            layout: &self.layout,
            gas: self.gas(),
            n_critical: self.condition.n_critical,
            trips: self.trips,
        }
    }

    fn coordinate(&self, c: usize) -> Vec<f64> {
        let values: Vec<f64> = self.nodes.iter().map(|p| p[c]).collect();
        self.section.map.spline.coefficients(&values)
    }
}

impl Solution {
    pub(super) fn new(point: OperatingPoint, end: Converged, attempts: Vec<Attempt>) -> Self {
        let OperatingPoint { condition, section, nodes, flow, layout, trips } = point;
        let Converged { unknowns, linearised, residual, iterations, converged } = end;
        let wake = &linearised.mass[linearised.numbering.wake_start()..];
        let node_mass: Vec<f64> = linearised.speeds.node_mass.iter().map(|m| m.re).collect();
        let strengths = node_strengths(&section, &flow, &node_mass, wake);
        let forces = pressure_forces(&section, &strengths, flow.alpha, condition.mach);
        let last = linearised.derived.len() - 1;
        let end = &linearised.derived[last];
        let cd = squire_young(end.state.log_theta, end.shape, end.log_speed).re;
        let alpha = flow.alpha;
        let record =
            Record { condition, section, flow, layout, nodes: nodes.to_vec(), trips, unknowns, linearised, strengths };
        let cd_friction = record.friction_drag();
        let x = record.coordinate(0);
        let x_at = |t: f64| value_at(&record.section, &x, t);
        let numbering = record.linearised.numbering;
        let index = &record.linearised.positions.index;
        let transition = Side::BOTH.map(|side| x_at(index[numbering.point(side, numbering.laminar - 1)].re));
        let status = if converged { record.status() } else { Status::NotConverged { residual } };
        Self {
            status,
            alpha,
            cl: forces.lift,
            cd,
            cd_pressure: cd - cd_friction,
            cd_friction,
            cm: forces.moment,
            cp_min: forces.lowest_pressure,
            transition,
            stagnation: x_at(index[numbering.side].re),
            residual,
            iterations,
            attempts,
            record: Arc::new(record),
        }
    }

    /// Whether the status is [`Status::Converged`].
    pub fn is_reliable(&self) -> bool {
        self.status == Status::Converged
    }

    /// The condition that was asked for.
    pub fn condition(&self) -> &Condition {
        &self.record.condition
    }

    /// Exact derivatives of the coefficients at fixed angle of attack, wake and stagnation point moving.
    ///
    /// `None` where the solution is not converged, so that it has no derivatives. For a point at fixed lift see
    /// [`Gradients::at_fixed_lift`].
    pub fn gradients(&self) -> Option<Gradients> {
        if matches!(self.status, Status::NotConverged { .. }) {
            return None;
        }
        let record = &*self.record;
        gradients(&Solved {
            system: record.system(),
            unknowns: &record.unknowns,
            at: &record.linearised,
            strengths: &record.strengths,
            mach: record.condition.mach,
            reynolds: record.condition.reynolds,
            nodes: &record.nodes,
        })
    }

    /// Distributions along the surface and the wake, for plots and constraints.
    pub fn distributions(&self) -> Distributions {
        let record = &*self.record;
        let correction = KarmanTsien::new(record.condition.mach);
        let pressure = |speeds: &[f64]| speeds.iter().map(|&q| correction.pressure(q)).collect();
        let side = |side| record.side_flow(side, &correction);
        Distributions {
            cp: pressure(&record.strengths),
            cp_inviscid: pressure(&record.flow.inviscid),
            upper: side(Side::Upper),
            lower: side(Side::Lower),
            wake: record.wake_flow(&correction),
        }
    }
}

impl Record {
    fn station(&self, k: usize, correction: &KarmanTsien<f64>, s: f64, at: [f64; 2]) -> StationFlow {
        use super::boundary_layer::station::Regime;
        let d = self.linearised.derived[k].map(|v| v.re);
        let laminar = self.linearised.numbering.regime(k) == Regime::Laminar;
        StationFlow {
            s,
            x: at[0],
            y: at[1],
            edge_velocity: d.log_speed.exp(),
            cp: correction.pressure(d.state.log_speed.exp()),
            momentum_thickness: d.theta,
            displacement_thickness: d.displacement,
            shape_parameter: d.hk,
            skin_friction: d.friction,
            amplification: if laminar { d.state.third } else { 0.0 },
            shear_stress: if laminar { 0.0 } else { d.stress * d.stress },
        }
    }

    fn side_flow(&self, side: Side, correction: &KarmanTsien<f64>) -> Vec<StationFlow> {
        let numbering = self.linearised.numbering;
        let positions = &self.linearised.positions;
        let (x, y) = (self.coordinate(0), self.coordinate(1));
        (0..numbering.side)
            .map(|j| {
                let t = positions.index[numbering.point(side, j)].re;
                let at = [value_at(&self.section, &x, t), value_at(&self.section, &y, t)];
                let s = positions.abscissas[side.index()][j].re;
                self.station(numbering.station(side, j), correction, s, at)
            })
            .collect()
    }

    fn wake_flow(&self, correction: &KarmanTsien<f64>) -> Vec<StationFlow> {
        let first = self.linearised.numbering.wake_start();
        let distances = &self.section.wake_distances;
        let nodes = self.flow.wake_nodes.iter().enumerate();
        nodes.map(|(j, at)| self.station(first + j, correction, distances[j], *at)).collect()
    }

    /// Wall shear stress along the onset flow, by the trapezoidal rule over the stations.
    fn friction_drag(&self) -> f64 {
        let (sin, cos) = self.flow.alpha.sin_cos();
        let gas = self.gas();
        let correction = KarmanTsien::new(self.condition.mach);
        let origin = self.linearised.positions.index[self.linearised.numbering.side].re;
        let along = |x: f64, y: f64| x * cos + y * sin;
        let (cx, cy) = (self.coordinate(0), self.coordinate(1));
        let start = along(value_at(&self.section, &cx, origin), value_at(&self.section, &cy, origin));
        let mut drag = 0.0;
        for side in Side::BOTH {
            let (mut before, mut stress_before) = (start, 0.0);
            for station in self.side_flow(side, &correction) {
                // the edge state again, for its density: from the incompressible speed of the pressure
                let edge = gas.edge(correction.incompressible_speed(station.cp));
                let stress = station.skin_friction * edge.density * edge.speed * edge.speed;
                let here = along(station.x, station.y);
                drag += 0.5 * (stress + stress_before) * (here - before);
                (before, stress_before) = (here, stress);
            }
        }
        drag
    }

    /// Whether a converged flow is within the model.
    fn status(&self) -> Status {
        let derived = &self.linearised.derived;
        let mach2 = derived.iter().map(|d| d.mach2.re).fold(0.0, f64::max);
        if mach2 > 1.0 {
            return Status::Supersonic { mach: mach2.sqrt() };
        }
        let extent = Side::BOTH.map(|side| self.reversed(side)).into_iter().fold(0.0, f64::max);
        if extent > REVERSED_EXTENT { Status::Separated { extent } } else { Status::Converged }
    }

    /// Length of turbulent reversed flow over the length of the side.
    fn reversed(&self, side: Side) -> f64 {
        let numbering = self.linearised.numbering;
        let x = &self.linearised.positions.abscissas[side.index()];
        let shape = |j: usize| self.linearised.derived[numbering.station(side, j)].hk.re;
        let reversed = (numbering.laminar + 1..numbering.side).filter(|&j| shape(j) > REVERSED);
        reversed.map(|j| x[j].re - x[j - 1].re).sum::<f64>() / x[numbering.side - 1].re
    }
}
