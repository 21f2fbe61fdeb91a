//! The state of a solution that the panel solver keeps, and the results that it reads off it.

use super::adjoint::{gradients, pressure_gradients};
use super::compressibility::KarmanTsien;
use super::coupling::reduced::Reduced;
use super::coupling::response::{FlowResponse, SectionResponse};
use super::coupling::speeds::node_strengths;
use super::coupling::system::{Evaluated, Linearised, Stream, System};
use super::frame::Nodes;
use super::outputs;
use super::resolution::panel_error;
use super::solved::Solved;
use crate::flow::coefficients::{Coefficients, Derivatives, Gradients};
use crate::flow::layer::transport::resample;
use crate::flow::layer::{EdgeLaw, Layout, Regime, Side, Unknowns};
use crate::flow::search::End;
use crate::flow::solution::{Distributions, Record, StationFlow, Status};
use std::sync::{Arc, OnceLock};

/// Laminar Hk above which the flow at the wall is reversed: where the skin friction of the closure changes sign.
pub(in crate::flow) const LAMINAR_REVERSED: f64 = 4.0;
/// Turbulent Hk above which the flow at the wall is reversed.
pub(in crate::flow) const TURBULENT_REVERSED: f64 = 3.5;
/// Largest extent of reversed flow of either regime for which the model is trusted, over the length of a side.
pub(in crate::flow) const REVERSED_EXTENT: f64 = 0.5;

/// A solution of the panel solver.
#[derive(Debug)]
pub(crate) struct PanelRecord {
    pub section: Arc<SectionResponse>,
    pub flow: FlowResponse,
    pub layout: Layout,
    pub stream: Stream,
    pub nodes: Nodes,
    pub unknowns: Unknowns,
    /// The state at the unknowns.
    state: Evaluated,
    /// The coupled system linearised at the unknowns, from the first derivatives on that are asked for.
    at: OnceLock<Linearised>,
    /// The factors of that system, where it is regular.
    reduced: OnceLock<Option<Reduced>>,
    /// Vortex strengths at the nodes, in units of the onset speed.
    strengths: Vec<f64>,
}

/// The flow that was requested: section, onset flow, stations, free stream and nodes.
pub(super) struct Sought {
    pub section: Arc<SectionResponse>,
    pub flow: FlowResponse,
    pub layout: Layout,
    pub stream: Stream,
    pub nodes: Nodes,
}

/// Vortex strengths at the nodes of the section in a state, in units of the onset speed.
fn strengths_of(section: &SectionResponse, flow: &FlowResponse, state: &Evaluated) -> Vec<f64> {
    node_strengths(section, flow, &state.node_mass, &state.mass[state.numbering.wake_start()..])
}

impl PanelRecord {
    pub fn new(sought: Sought, end: End<Evaluated>) -> Self {
        let Sought { section, flow, layout, stream, nodes } = sought;
        let End { unknowns, state, .. } = end;
        let strengths = strengths_of(&section, &flow, &state);
        let (at, reduced) = (OnceLock::new(), OnceLock::new());
        Self { section, flow, layout, stream, nodes, unknowns, state, at, reduced, strengths }
    }

    pub fn system(&self) -> System<'_> {
        System::new(&self.section, &self.flow, &self.layout, self.stream)
    }

    fn at(&self) -> &Linearised {
        self.at.get_or_init(|| self.system().linearise(&self.unknowns))
    }

    /// The factors of the linearised system, where it is regular. They are kept, because derivatives, estimates of the
    /// error and the slope of the lift need them in turn.
    fn reduced(&self) -> Option<&Reduced> {
        self.reduced.get_or_init(|| Reduced::new(self.at())).as_ref()
    }

    pub fn solved(&self) -> Solved<'_> {
        Solved {
            system: self.system(),
            unknowns: &self.unknowns,
            at: self.at(),
            strengths: &self.strengths,
            stream: self.stream,
            nodes: &self.nodes.inside,
        }
    }

    pub fn coefficients(&self) -> Coefficients {
        outputs::values((&self.system(), self.stream.mach), &self.state, &self.strengths, &self.nodes.inside)
    }

    /// The coefficients on twice as many stations of the layer, by one step of Newton's method from this solution.
    fn coefficients_on_more_stations(&self) -> Option<Coefficients> {
        let layout = self.layout.doubled();
        let system = System::new(&self.section, &self.flow, &layout, self.stream);
        let here = resample(&self.layout, &layout, &self.unknowns, &self.section.map);
        let at = system.linearise(&here);
        let step = Reduced::new(&at)?.solve(&at, &at.residuals);
        let state = system.evaluate(&system.layer.moved(&here, &step, 1.0));
        let strengths = strengths_of(&self.section, &self.flow, &state);
        Some(outputs::values((&system, self.stream.mach), &state, &strengths, &self.nodes.inside))
    }

    /// Derivative of the lift coefficient with respect to the angle of attack (per radian), with the wake held where it
    /// is.
    pub fn lift_slope(&self) -> Option<f64> {
        Some(outputs::lift_slope(&self.solved(), self.reduced()?))
    }

    /// Spline coefficients of x (`c` = 0) or y (`c` = 1) over the node index.
    fn coordinate(&self, c: usize) -> Vec<f64> {
        let values: Vec<f64> = self.nodes.inside.iter().map(|p| p[c]).collect();
        self.section.map.spline.coefficients(&values)
    }

    /// The point of the surface as a function of the node index.
    fn places(&self) -> impl Fn(f64) -> [f64; 2] + '_ {
        let [x, y] = [0, 1].map(|c| self.coordinate(c));
        move |t| [self.section.map.spline.value(&x, t), self.section.map.spline.value(&y, t)]
    }

    /// Coordinate x of the stagnation point, in chords.
    pub fn stagnation(&self) -> f64 {
        self.places()(self.state.positions.index[self.state.numbering.side])[0]
    }

    fn station(&self, k: usize, correction: &KarmanTsien<f64>, s: f64, at: [f64; 2]) -> StationFlow {
        let d = &self.state.derived[k];
        let laminar = self.state.numbering.regime(k) == Regime::Laminar;
        StationFlow {
            s,
            x: at[0],
            y: at[1],
            edge_velocity: d.log_speed.exp(),
            mach: d.mach2.sqrt(),
            cp: correction.pressure(d.speed),
            momentum_thickness: d.theta,
            displacement_thickness: d.displacement,
            shape_parameter: d.hk,
            skin_friction: d.friction,
            amplification: if laminar { d.state.amplification() } else { 0.0 },
            shear_stress: if laminar { 0.0 } else { d.stress * d.stress },
        }
    }

    fn side_flow(&self, side: Side) -> Vec<StationFlow> {
        let (numbering, positions) = (self.state.numbering, &self.state.positions);
        let (place, correction) = (self.places(), KarmanTsien::new(self.stream.mach));
        (0..numbering.side)
            .map(|j| {
                let at = place(positions.index[numbering.point(side, j)]);
                let s = positions.abscissas[side.index()][j];
                self.station(numbering.station(side, j), &correction, s, at)
            })
            .collect()
    }

    fn wake_flow(&self) -> Vec<StationFlow> {
        let first = self.state.numbering.wake_start();
        let (distances, correction) = (&self.section.wake_distances, KarmanTsien::new(self.stream.mach));
        let nodes = self.flow.path.nodes.iter().enumerate();
        nodes.map(|(j, at)| self.station(first + j, &correction, distances[j], *at)).collect()
    }

    /// Friction drag coefficient: the wall shear stress along the onset flow, by the trapezoidal rule over the
    /// stations.
    pub fn friction_drag(&self) -> f64 {
        let (sin, cos) = self.flow.alpha.sin_cos();
        let law = self.system().layer.law;
        let (numbering, place) = (self.state.numbering, self.places());
        let along = |t: f64| {
            let [x, y] = place(t);
            x * cos + y * sin
        };
        let mut drag = 0.0;
        for side in Side::BOTH {
            let (mut before, mut stress_before) = (along(self.state.positions.index[numbering.side]), 0.0);
            for j in 0..numbering.side {
                let station = &self.state.derived[numbering.station(side, j)];
                let edge = law.edge(station.speed);
                let stress = station.friction * edge.density * edge.speed * edge.speed;
                let here = along(self.state.positions.index[numbering.point(side, j)]);
                drag += 0.5 * (stress + stress_before) * (here - before);
                (before, stress_before) = (here, stress);
            }
        }
        drag
    }

    /// Whether a converged flow is within the model.
    pub fn status(&self) -> Status {
        // a suction peak may stand between two stations
        let wall = outputs::highest_mach(&self.section, &self.strengths, self.stream.mach);
        let mach = self.state.derived.iter().map(|d| d.mach2).fold(0.0, f64::max).sqrt().max(wall);
        if mach > 1.0 {
            return supersonic(mach, true);
        }
        let extent = self.reversed_extent();
        if extent > REVERSED_EXTENT { Status::Separated { extent } } else { Status::Converged }
    }

    /// Length of reversed flow over the length of the side, for the side where that is larger.
    pub fn reversed_extent(&self) -> f64 {
        Side::BOTH.map(|side| self.reversed(side)).into_iter().fold(0.0, f64::max)
    }

    /// Length of reversed flow on a side, laminar or turbulent, over the length of the side.
    fn reversed(&self, side: Side) -> f64 {
        let numbering = self.state.numbering;
        let x = &self.state.positions.abscissas[side.index()];
        let reversed = |j: usize| {
            let k = numbering.station(side, j);
            let regime = numbering.regime(k);
            self.state.derived[k].hk > if regime == Regime::Laminar { LAMINAR_REVERSED } else { TURBULENT_REVERSED }
        };
        let length = (1..numbering.side).filter(|&j| reversed(j)).map(|j| x[j] - x[j - 1]);
        length.sum::<f64>() / x[numbering.side - 1]
    }
}

/// The status of a flow that is supersonic somewhere: the Kármán-Tsien correction does not hold, and shocks with their
/// drag are missing. A flow that was not found is supersonic without boundary layer.
pub(super) fn supersonic(mach: f64, converged: bool) -> Status {
    let which = if converged { "" } else { " without boundary layer" };
    // beyond the speed at which the correction ends there is no number
    let number =
        if mach.is_finite() { format!("local Mach number {mach:.2}{which}") } else { "far".to_string() + which };
    let reason = format!("({number}): shocks are beyond this solver").into();
    Status::OutsideModel { name: "supersonic".into(), value: mach, reason, converged }
}

impl Record for PanelRecord {
    fn nodes(&self) -> &[[f64; 2]] {
        &self.nodes.given
    }

    fn chord(&self) -> f64 {
        self.nodes.frame.chord()
    }

    fn gradients(&self) -> Option<Gradients> {
        let frame = self.nodes.frame.derivatives(&self.nodes.given);
        Some(gradients(&self.solved(), self.reduced()?).map(|by| frame.pull_back(by)))
    }

    fn panel_error(&self, gradients: &Gradients) -> Option<Coefficients> {
        Some(panel_error(&self.nodes.given, gradients))
    }

    fn station_error(&self) -> Option<Coefficients> {
        Some(self.coefficients_on_more_stations()?.zip(self.coefficients()).map(|(more, here)| more - here))
    }

    fn pressure_gradients(&self, weights: &[Vec<f64>]) -> Option<Vec<Derivatives>> {
        let frame = self.nodes.frame.derivatives(&self.nodes.given);
        let inside = pressure_gradients(weights, &self.solved(), self.reduced()?);
        Some(inside.into_iter().map(|by| frame.pull_back(by)).collect())
    }

    fn distributions(&self) -> Distributions {
        let correction = KarmanTsien::new(self.stream.mach);
        let pressure = |speeds: &[f64]| speeds.iter().map(|&q| correction.pressure(q)).collect();
        Distributions {
            nodes: self.nodes.inside.clone(),
            cp: pressure(&self.strengths),
            cp_inviscid: pressure(&self.flow.inviscid),
            upper: self.side_flow(Side::Upper),
            lower: self.side_flow(Side::Lower),
            wake: self.wake_flow(),
        }
    }
}
