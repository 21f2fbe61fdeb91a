//! Exact sensitivities of a converged solution by its adjoint.
//!
//! For an output J with multipliers λ (transposed coupled system, factors at hand) the derivative with respect to any
//! input p is ∂J/∂p − λ·∂R/∂p. The vortex strengths are carried as explicit variables with the multipliers of the
//! panel equations, so that every term is local: a panel and a point, an interval, a spline coefficient. All local
//! derivatives come from dual numbers of the kernels themselves; all outputs share one sweep.

mod edge;
mod influence;
mod sums;
mod surface;
mod velocity;
mod wake;

use super::coupled::duals::{Dual2, gradient};
use super::coupled::residuals::layer_residuals;
use super::coupled::response::{FlowResponse, SectionResponse, smooth, smooth_columns, wake_strength_matrix};
use super::coupled::speeds::{node_strengths, per_rate};
use super::coupled::surface::combine_real;
use super::coupled::system::{Change, Linearised, Multipliers, Reduced, System};
use super::coupled::unknowns::{Numbering, Side, Unknowns};
use super::linear::product;
use super::outputs::{PressureGradient, pressure_gradient, squire_young};
use super::panel::outline::balance;
use crate::differentiate::Tangent;
use crate::flow::boundary_layer::gas::Gas;
use crate::flow::boundary_layer::station::Derived;
use nalgebra::{DMatrix, DVector, SVector};

/// Number of outputs: lift, drag, moment, lowest pressure coefficient, transition on the upper and the lower side.
pub(crate) const OUTPUTS: usize = 6;

/// Derivatives of one coefficient at fixed angle of attack.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Derivatives {
    /// With respect to the coordinates of every node, in the order given.
    pub nodes: Vec<[f64; 2]>,
    /// With respect to the angle of attack, per radian.
    pub alpha: f64,
    /// With respect to the Mach number.
    pub mach: f64,
    /// With respect to the Reynolds number.
    pub reynolds: f64,
}

/// Derivatives of the coefficients of a solution with respect to everything it depends on, the angle of attack held.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Gradients {
    /// Lift coefficient.
    pub cl: Derivatives,
    /// Drag coefficient.
    pub cd: Derivatives,
    /// Moment coefficient about the quarter chord.
    pub cm: Derivatives,
    /// Lowest pressure coefficient.
    pub cp_min: Derivatives,
    /// Transition on the upper and the lower side, x in chords.
    pub transition: [Derivatives; 2],
}

impl Derivatives {
    /// These derivatives with the lift held instead: the angle of attack follows.
    fn at_fixed_lift(&self, lift: &Self) -> Self {
        let rate = self.alpha / lift.alpha;
        let pair = |(own, lift): (&[f64; 2], &[f64; 2])| [own[0] - rate * lift[0], own[1] - rate * lift[1]];
        Self {
            nodes: self.nodes.iter().zip(&lift.nodes).map(pair).collect(),
            alpha: 0.0,
            mach: self.mach - rate * lift.mach,
            reynolds: self.reynolds - rate * lift.reynolds,
        }
    }
}

impl Gradients {
    /// The derivatives of a point at fixed lift coefficient: that of `cl` vanishes, the angle of attack follows.
    ///
    /// Entries `alpha` are zero, the angle being no input any more.
    pub fn at_fixed_lift(&self) -> Self {
        let turn = |d: &Derivatives| d.at_fixed_lift(&self.cl);
        Self {
            cl: turn(&self.cl),
            cd: turn(&self.cd),
            cm: turn(&self.cm),
            cp_min: turn(&self.cp_min),
            transition: [turn(&self.transition[0]), turn(&self.transition[1])],
        }
    }
}

/// Sensitivities of all outputs that pass through one quantity, one entry an output.
pub(crate) type Each<T> = [T; OUTPUTS];

/// The multipliers of all outputs in the places where the reverse sweep needs them.
pub(crate) struct Reverse<'a> {
    pub section: &'a SectionResponse,
    pub flow: &'a FlowResponse,
    pub at: &'a Linearised,
    pub multipliers: Multipliers<OUTPUTS>,
    /// Weight of the strength at every point along the surface.
    pub point_weights: Each<Vec<f64>>,
    /// Weight of the speed at every wake node.
    pub wake_weights: Each<Vec<f64>>,
    /// Sensitivity to the strengths at the nodes, as an explicit variable.
    pub strengths: Each<Vec<f64>>,
    /// Sensitivity to the defects at the nodes as projected.
    pub node_mass: Each<Vec<f64>>,
    /// Sensitivity to the unsigned defect of every station.
    pub mass: Each<Vec<f64>>,
    pub at_solution: Strengths,
}

/// What stands on the panels of a solution.
pub(crate) struct Strengths {
    /// Vortex strengths at the nodes.
    pub nodes: Vec<f64>,
    /// Mass defects at the nodes, smoothed as the panels see them.
    pub smoothed: Vec<f64>,
    /// Source strengths at the ends of the half panels of the wake.
    pub wake: Vec<f64>,
}

impl Strengths {
    fn new(section: &SectionResponse, flow: &FlowResponse, at: &Linearised) -> Self {
        let mut smoothed: Vec<f64> = at.speeds.node_mass.iter().map(|m| m.re).collect();
        let wake = &at.mass[at.numbering.wake_start()..];
        let nodes = node_strengths(section, flow, &smoothed, wake);
        smooth(&mut smoothed);
        let wake = wake_strength_matrix(&section.wake_distances) * DVector::from_column_slice(wake);
        Self { nodes, smoothed, wake: wake.as_slice().to_vec() }
    }
}

/// What the sweep collects: derivatives with respect to the balanced nodes and the scalars.
pub(crate) struct Collected {
    pub nodes: Each<Vec<[f64; 2]>>,
    pub alpha: [f64; OUTPUTS],
    pub mach: [f64; OUTPUTS],
    pub reynolds: [f64; OUTPUTS],
}

/// The state a solution was found in.
pub(crate) struct Solved<'a> {
    pub system: System<'a>,
    pub unknowns: &'a Unknowns,
    pub at: &'a Linearised,
    pub strengths: &'a [f64],
    pub mach: f64,
    pub reynolds: f64,
    /// Nodes as given, on the surface.
    pub nodes: &'a [[f64; 2]],
}

/// All derivatives of all outputs; `None` where the system at the solution is singular.
pub(crate) fn gradients(solved: &Solved) -> Option<Gradients> {
    let pressure = pressure_gradient(solved.system.section, solved.strengths, solved.system.flow.alpha, solved.mach);
    let reduced = Reduced::new(solved.at)?;
    let reverse = Reverse::new(solved, &reduced, &pressure);
    let n = solved.nodes.len();
    let mut collected = Collected {
        nodes: std::array::from_fn(|_| vec![[0.0; 2]; n]),
        alpha: [0.0; OUTPUTS],
        mach: [0.0; OUTPUTS],
        reynolds: [0.0; OUTPUTS],
    };
    collected.add_pressure(&pressure);
    collected.add_gas(solved, &reverse);
    let weights = influence::panel_weights(&reverse);
    influence::add_panels(&reverse, &weights, &mut collected);
    wake::add_wake(solved, &reverse, &weights, &mut collected);
    surface::add_surface(solved, &reverse, &mut collected);
    let mut all = collected.finish(solved.nodes);
    for side in Side::BOTH {
        add_abscissas(solved, side, &mut all[TRANSITION + side.index()].nodes);
    }
    let [cl, cd, cm, cp_min, upper, lower] = all;
    Some(Gradients { cl, cd, cm, cp_min, transition: [upper, lower] })
}

/// Place of the outputs of [`PressureGradient`] among all outputs.
const PRESSURE_OUTPUTS: [usize; 3] = [0, 2, 3];
const DRAG: usize = 1;
/// Place of the transition points among all outputs.
pub(super) const TRANSITION: usize = 4;

/// The last laminar point of a side: its number, its node index and how fast x changes with that.
pub(super) fn transition_point(solved: &Solved, side: Side) -> (usize, f64, f64) {
    let numbering = solved.at.numbering;
    let point = numbering.point(side, numbering.laminar - 1);
    let t = solved.at.positions.index[point].re;
    let spline = &solved.system.section.map.spline;
    let x: Vec<f64> = solved.nodes.iter().map(|p| p[0]).collect();
    (point, t, combine_real(&spline.slope_weights(t), &spline.coefficients(&x)))
}

/// The transition point is read off the abscissas of the nodes.
fn add_abscissas(solved: &Solved, side: Side, nodes: &mut [[f64; 2]]) {
    let (_, t, _) = transition_point(solved, side);
    let spline = &solved.system.section.map.spline;
    let mut by_x = vec![0.0; nodes.len() + 2];
    let (first, weights) = spline.weights(t);
    for (q, w) in weights.iter().enumerate() {
        by_x[first + q] = *w;
    }
    for (node, x) in nodes.iter_mut().zip(spline.coefficients_transposed(&by_x)) {
        node[0] += x;
    }
}

impl Collected {
    fn add_pressure(&mut self, pressure: &PressureGradient) {
        for (k, output) in PRESSURE_OUTPUTS.into_iter().enumerate() {
            for (sum, own) in self.nodes[output].iter_mut().zip(&pressure.nodes[k]) {
                sum[0] += own[0];
                sum[1] += own[1];
            }
            self.alpha[output] += pressure.alpha[k];
            self.mach[output] += pressure.mach[k];
        }
    }

    /// Mach and Reynolds number through the boundary layer: equations, mass defects and the drag formula.
    fn add_gas(&mut self, solved: &Solved, reverse: &Reverse) {
        let layer = solved.system.layer();
        let [mach, reynolds] =
            [Dual2::from_re(solved.mach).derivative(0), Dual2::from_re(solved.reynolds).derivative(1)];
        let gas = Gas::new(mach, reynolds);
        let abscissas = solved.at.positions.abscissas.clone().map(|side| side.iter().map(|x| x.re).collect());
        let gap: Vec<Dual2> = solved.system.flow.gap.iter().map(|&g| Dual2::from_re(g)).collect();
        let (residuals, masses) = layer_residuals(&layer, solved.unknowns, &abscissas, &gas, &gap);
        let last = solved.unknowns.stations.len() - 1;
        let end = solved.unknowns.stations[last].map(Dual2::from_re);
        let end = Derived::new(end, layer.numbering.regime(last), &gas);
        let drag = gradient(&squire_young(end.state.log_theta, end.shape, end.log_speed));
        let mut chain = [SVector::<f64, OUTPUTS>::zeros(); 2];
        for (block, multipliers) in residuals.iter().zip(&reverse.multipliers.chain) {
            for (r, m) in block.iter().zip(multipliers) {
                let g = gradient(r);
                chain[0] += m * g[0];
                chain[1] += m * g[1];
            }
        }
        for output in 0..OUTPUTS {
            let mut sum = if output == DRAG { drag } else { [0.0; 2] };
            sum[0] -= chain[0][output];
            sum[1] -= chain[1][output];
            for (mass, weight) in masses.iter().zip(&reverse.mass[output]) {
                let g = gradient(mass);
                sum[0] += weight * g[0];
                sum[1] += weight * g[1];
            }
            self.mach[output] += sum[0];
            self.reynolds[output] += sum[1];
        }
    }

    /// From the balanced nodes to those given.
    fn finish(self, nodes: &[[f64; 2]]) -> [Derivatives; OUTPUTS] {
        let n = nodes.len();
        let mut given: Each<Vec<[f64; 2]>> = std::array::from_fn(|o| {
            let mut own = vec![[0.0; 2]; n];
            own[0] = self.nodes[o][0];
            own[n - 1] = self.nodes[o][n - 1];
            own
        });
        for i in 1..n - 1 {
            let unit = |k: usize, c: usize| Tangent::<8>::from_re(nodes[i + k - 1][c]).derivative(2 * k + c);
            let seed = |k: usize| [unit(k, 0), unit(k, 1)];
            let [x, y] = balance([seed(0), seed(1), seed(2)]);
            let moved = [gradient(&x), gradient(&y)];
            for (output, given) in given.iter_mut().enumerate() {
                let [x, y] = self.nodes[output][i];
                for k in 0..3 {
                    for c in 0..2 {
                        given[i + k - 1][c] += x * moved[0][2 * k + c] + y * moved[1][2 * k + c];
                    }
                }
            }
        }
        let (alpha, mach, reynolds) = (self.alpha, self.mach, self.reynolds);
        let mut given = given.into_iter();
        std::array::from_fn(|o| Derivatives {
            nodes: given.next().unwrap_or_default(),
            alpha: alpha[o],
            mach: mach[o],
            reynolds: reynolds[o],
        })
    }
}

impl<'a> Reverse<'a> {
    fn new(solved: &Solved<'a>, reduced: &Reduced, pressure: &PressureGradient) -> Self {
        let (section, flow, at) = (solved.system.section, solved.system.flow, solved.at);
        let n = section.len();
        // direct sensitivities of the outputs to strengths and, through them, to the defects
        let mut direct = DMatrix::zeros(OUTPUTS, n);
        for (k, output) in PRESSURE_OUTPUTS.into_iter().enumerate() {
            for i in 0..n {
                direct[(output, i)] = pressure.strengths[k][i];
            }
        }
        let through_nodes = smooth_columns(&product(&direct, &section.nodes));
        let through_wake = product(&direct, &flow.nodes_by_wake);
        let outputs: Each<Change> = std::array::from_fn(|o| output_gradient(solved, o, &through_nodes, &through_wake));
        let multipliers = reduced.adjoint(&outputs);
        let numbering = at.numbering;
        let point_weights: Each<Vec<f64>> = std::array::from_fn(|o| point_weights(&numbering, &multipliers, o));
        let wake_weights: Each<Vec<f64>> =
            std::array::from_fn(|o| multipliers.speed[numbering.wake_start()..].iter().map(|m| m[o]).collect());
        let mut reverse = Self {
            section,
            flow,
            at,
            multipliers,
            point_weights,
            wake_weights,
            strengths: std::array::from_fn(|o| direct.row(o).iter().copied().collect()),
            node_mass: std::array::from_fn(|o| through_nodes.row(o).iter().copied().collect()),
            mass: std::array::from_fn(|_| Vec::new()),
            at_solution: Strengths::new(section, flow, at),
        };
        reverse.mass = reverse.station_masses(&through_wake);
        reverse.complete();
        reverse
    }

    /// Sensitivity to the unsigned mass defect of every station.
    fn station_masses(&self, through_wake: &DMatrix<f64>) -> Each<Vec<f64>> {
        let numbering = &self.at.numbering;
        let columns = product(&self.at.by_mass.points, &by_columns(&self.point_weights))
            + product(&self.at.by_mass.wake, &by_columns(&self.wake_weights));
        std::array::from_fn(|o| {
            let mut direct = vec![0.0; numbering.points()];
            self.at.speeds.projection.transpose_apply(&self.node_mass[o], &mut direct);
            (0..numbering.stations())
                .map(|k| match numbering.on_side(k) {
                    Some((side, j)) => {
                        let p = numbering.point(side, j);
                        side.sign() * (columns[(p, o)] + direct[p])
                    }
                    None => {
                        let w = k - numbering.wake_start();
                        columns[(numbering.points() + w, o)] + through_wake[(o, w)]
                    }
                })
                .collect()
        })
    }

    /// Adds what reaches the strengths and the node defects through the edge-speed equations.
    fn complete(&mut self) {
        let (section, flow) = (self.section, self.flow);
        let n = section.len();
        let index = &self.at.positions.index;
        let mut strength = vec![SVector::<f64, OUTPUTS>::zeros(); n + 2];
        let mut wall = strength.clone();
        for (p, t) in index.iter().enumerate() {
            let (first, w) = section.map.spline.weights(t.re);
            let inner = p > 0 && p + 1 < index.len();
            let per_rate = if inner { per_rate(section, t.re) } else { 0.0 };
            let weight = SVector::from_fn(|o, _| self.point_weights[o][p]);
            for q in 0..4 {
                strength[first + q] += weight * w[q];
                wall[first + q] -= weight * (per_rate * w[q]);
            }
        }
        let columns = |lanes: &[SVector<f64, OUTPUTS>]| DMatrix::from_fn(n + 2, OUTPUTS, |i, o| lanes[i][o]);
        let by_points = product(&section.spline, &columns(&strength)) + product(&section.wall, &columns(&wall));
        let wake_weights = by_columns(&self.wake_weights);
        let by_wake = product(&flow.wake_by_nodes, &wake_weights);
        let strengths_by_wake = product(&wake_weights.transpose(), &flow.wake_by_strength);
        let through_spline = section.map.spline.coefficients_transposed(&strength);
        for o in 0..OUTPUTS {
            for i in 0..n {
                self.node_mass[o][i] += by_points[(i, o)] + by_wake[(i, o)];
                self.strengths[o][i] += through_spline[i][o] + strengths_by_wake[(o, i)];
            }
        }
    }
}

/// One column an output.
fn by_columns(each: &Each<Vec<f64>>) -> DMatrix<f64> {
    DMatrix::from_fn(each[0].len(), OUTPUTS, |i, o| each[o][i])
}

/// The edge-speed equation is u − (±γ) = 0 and the stagnation equation γ = 0: weights of γ at the points in −λ·R.
fn point_weights(numbering: &Numbering, multipliers: &Multipliers<OUTPUTS>, output: usize) -> Vec<f64> {
    let mut weights = vec![0.0; numbering.points()];
    for side in Side::BOTH {
        for j in 0..numbering.side {
            weights[numbering.point(side, j)] = side.sign() * multipliers.speed[numbering.station(side, j)][output];
        }
    }
    weights[numbering.side] = -multipliers.stagnation[output];
    weights
}

/// Derivative of an output with respect to the unknowns.
fn output_gradient(
    solved: &Solved,
    output: usize,
    through_nodes: &DMatrix<f64>,
    through_wake: &DMatrix<f64>,
) -> Change {
    let at = solved.at;
    let numbering = at.numbering;
    let mut result = Change { stations: vec![[0.0; 4]; numbering.stations()], globals: [0.0; 3] };
    if output == DRAG {
        let end = &at.derived[numbering.stations() - 1];
        let drag = squire_young(end.state.log_theta, end.shape, end.log_speed);
        result.stations[numbering.stations() - 1] = gradient(&drag);
        return result;
    }
    if output >= TRANSITION {
        let (point, _, slope) = transition_point(solved, Side::BOTH[output - TRANSITION]);
        let index = gradient(&at.positions.index[point]);
        result.globals = std::array::from_fn(|k| slope * index[k]);
        return result;
    }
    let by_nodes: Vec<f64> = through_nodes.row(output).iter().copied().collect();
    let mut by_points = vec![0.0; numbering.points()];
    at.speeds.projection.transpose_apply(&by_nodes, &mut by_points);
    for k in 0..numbering.stations() {
        let by_mass = match numbering.on_side(k) {
            Some((side, j)) => side.sign() * by_points[numbering.point(side, j)],
            None => through_wake[(output, k - numbering.wake_start())],
        };
        result.stations[k] = at.log_mass[k].map(|g| by_mass * at.mass[k] * g);
    }
    for (weight, mass) in by_nodes.iter().zip(&at.speeds.node_mass) {
        let g = gradient(mass);
        for k in 0..3 {
            result.globals[k] += weight * g[k];
        }
    }
    result
}
