//! The multipliers of all coefficients in the form the reverse sweep needs, and the derivatives that the sweep
//! collects.

use crate::flow::coefficients::{COEFFICIENTS, Coefficients, Derivatives, Gradients};
use crate::flow::duals::Dual2;
use crate::flow::layer::{Derived, Numbering, Side};
use crate::flow::linear::product;
use crate::flow::panel::compressibility::PanelEdge;
use crate::flow::panel::coupling::reduced::{Multipliers, Reduced};
use crate::flow::panel::coupling::response::{FlowResponse, SectionResponse, smooth, wake_strength_matrix};
use crate::flow::panel::coupling::speeds::per_rate;
use crate::flow::panel::coupling::system::{Linearised, mass_defect};
use crate::flow::panel::solved::{Direct, Solved, output_gradient, through_defects};
use nalgebra::{DMatrix, DVector, SVector};

/// One number per coefficient, in the order of [`Coefficients::to_array`].
pub(super) type Lanes = SVector<f64, COEFFICIENTS>;

/// The multipliers of all coefficients in the places where the reverse sweep needs them.
pub(super) struct Reverse<'a> {
    pub section: &'a SectionResponse,
    pub flow: &'a FlowResponse,
    pub at: &'a Linearised,
    /// Multipliers of all equations of the coupled system.
    pub multipliers: Multipliers<COEFFICIENTS>,
    /// Weight of the strength at every point along the surface.
    pub point_weights: Coefficients<Vec<f64>>,
    /// Weight of the speed at every wake node.
    pub wake_weights: Coefficients<Vec<f64>>,
    /// Sensitivity to the strengths at the nodes, as explicit variables.
    pub strengths: Coefficients<Vec<f64>>,
    /// Sensitivity to the mass defects at the nodes as projected, before smoothing.
    pub node_mass: Coefficients<Vec<f64>>,
    /// Sensitivity to the unsigned mass defect of every station.
    pub mass: Coefficients<Vec<f64>>,
    /// Strengths of the sheets on the panels of the solution.
    pub at_solution: Strengths,
}

/// Strengths of the sheets on the panels of a solution, in units of the onset speed.
pub(super) struct Strengths {
    /// Vortex strengths at the nodes.
    pub nodes: Vec<f64>,
    /// Mass defects at the nodes, smoothed as the panels see them.
    pub smoothed: Vec<f64>,
    /// Source strengths at the ends of the half panels of the wake.
    pub wake: Vec<f64>,
}

impl Strengths {
    pub fn new(solved: &Solved) -> Self {
        let at = solved.at;
        let mut smoothed: Vec<f64> = at.speeds.node_mass.iter().map(|m| m.re).collect();
        smooth(&mut smoothed);
        let wake = DVector::from_column_slice(&at.mass[at.numbering.wake_start()..]);
        let wake = wake_strength_matrix(&solved.system.section.wake_distances) * wake;
        Self { nodes: solved.strengths.to_vec(), smoothed, wake: wake.as_slice().to_vec() }
    }

    /// The sheets of the flow without boundary layer: no sources.
    pub fn inviscid(flow: &FlowResponse) -> Self {
        let nodes = flow.inviscid.clone();
        Self { smoothed: vec![0.0; nodes.len()], nodes, wake: Vec::new() }
    }
}

/// The derivatives that the sweep collects: with respect to the nodes of the panels, and with respect to the scalar inputs.
pub(super) struct Collected {
    /// Derivatives with respect to the nodes of the panels.
    pub nodes: Coefficients<Vec<[f64; 2]>>,
    /// Derivatives with respect to the angle of attack, per radian.
    pub alpha: Lanes,
    /// Derivatives with respect to the Mach number.
    pub mach: Lanes,
    /// Derivatives with respect to the Reynolds number.
    pub reynolds: Lanes,
}

/// One number per coefficient, taken from each by `number`.
pub(super) fn lanes<T>(of: &Coefficients<T>, number: impl FnMut(&T) -> f64) -> Lanes {
    Lanes::from(of.as_ref().map(number).to_array())
}

impl Collected {
    /// The direct dependence of the coefficients, to which the sweep adds.
    pub fn new(direct: &Coefficients<Direct>) -> Self {
        Self {
            nodes: direct.as_ref().map(|d| d.panels.clone()),
            alpha: lanes(direct, |d| d.alpha),
            mach: lanes(direct, |d| d.mach),
            reynolds: lanes(direct, |d| d.reynolds),
        }
    }

    /// Adds the effect of the Mach and the Reynolds number through the boundary-layer equations and the mass defects.
    pub fn add_gas(&mut self, solved: &Solved, reverse: &Reverse) {
        let layer = &solved.system.layer;
        let first = layer.numbering().wake_start();
        let [mach, reynolds] =
            [Dual2::from_re(solved.stream.mach).derivative(0), Dual2::from_re(solved.stream.reynolds).derivative(1)];
        let law = PanelEdge::new(mach, reynolds);
        let abscissas = solved.at.positions.abscissas.each_ref().map(|side| side.iter().map(|x| x.re).collect());
        let gap: Vec<Dual2> = layer.gap.iter().map(|&g| Dual2::from_re(g)).collect();
        let derived: Vec<Derived<Dual2>> = layer.derive(solved.unknowns, |state| state.map(Dual2::from_re), &law);
        let mut sums = [Lanes::zeros(); 2];
        for (residuals, multipliers) in
            layer.residuals(&derived, &abscissas, &law, &gap).iter().zip(&reverse.multipliers.chain)
        {
            for (r, m) in residuals.iter().zip(multipliers) {
                sums[0] -= m * r.eps[0];
                sums[1] -= m * r.eps[1];
            }
        }
        for (k, station) in derived.iter().enumerate() {
            let mass = mass_defect(station, k.checked_sub(first).map(|k| gap[k]));
            let weight = lanes(&reverse.mass, |mass| mass[k]);
            sums[0] += weight * mass.eps[0];
            sums[1] += weight * mass.eps[1];
        }
        self.mach += sums[0];
        self.reynolds += sums[1];
    }

    /// The derivatives of each coefficient.
    pub fn finish(self) -> Gradients {
        let scalars =
            Coefficients::from_array(std::array::from_fn(|o| [self.alpha[o], self.mach[o], self.reynolds[o]]));
        self.nodes.zip(scalars).map(|(nodes, [alpha, mach, reynolds])| Derivatives { nodes, alpha, mach, reynolds })
    }
}

impl<'a> Reverse<'a> {
    pub fn new(solved: &Solved<'a>, reduced: &Reduced, direct: &Coefficients<Direct>) -> Self {
        let (section, flow, at) = (solved.system.section, solved.system.flow, solved.at);
        let numbering = at.numbering;
        let strengths = direct.as_ref().map(|d| d.strengths.clone());
        let (by_nodes, by_wake) = through_defects(&solved.system, &by_columns(&strengths).transpose());
        let row = |matrix: &DMatrix<f64>, o: usize| -> Vec<f64> { matrix.row(o).iter().copied().collect() };
        let rows = |matrix: &DMatrix<f64>| Coefficients::from_array(std::array::from_fn(|o| row(matrix, o)));
        let (node_mass, through_wake) = (rows(&by_nodes), rows(&by_wake));
        let outputs = direct
            .as_ref()
            .zip(node_mass.as_ref().zip(through_wake.as_ref()))
            .map(|(direct, (by_nodes, by_wake))| output_gradient(solved, direct, by_nodes, by_wake));
        let multipliers = reduced.adjoint(at, outputs.as_ref().to_array());
        let each = |of: &dyn Fn(usize) -> Vec<f64>| Coefficients::from_array(std::array::from_fn(of));
        let wake_weights = |o: usize| multipliers.speed[numbering.wake_start()..].iter().map(|m| m[o]).collect();
        let mut reverse = Self {
            section,
            flow,
            at,
            point_weights: each(&|o| point_weights(&numbering, &multipliers, o)),
            wake_weights: each(&wake_weights),
            multipliers,
            strengths,
            node_mass,
            mass: Coefficients::default(),
            at_solution: Strengths::new(solved),
        };
        reverse.mass = reverse.station_masses(through_wake);
        reverse.complete();
        reverse
    }

    /// Sensitivity to the unsigned mass defect of every station.
    fn station_masses(&self, through_wake: Coefficients<Vec<f64>>) -> Coefficients<Vec<f64>> {
        let numbering = &self.at.numbering;
        let columns = product(&self.at.by_mass.points, &by_columns(&self.point_weights))
            + product(&self.at.by_mass.wake, &by_columns(&self.wake_weights));
        let columns = Coefficients::from_array(std::array::from_fn(|o| columns.column(o).into_owned()));
        columns.zip(self.node_mass.as_ref().zip(through_wake)).map(|(column, (node_mass, through_wake))| {
            let mut direct = vec![0.0; numbering.points()];
            self.at.speeds.projection.transpose_apply(node_mass, &mut direct);
            (0..numbering.stations())
                .map(|k| match numbering.on_side(k) {
                    Some((side, j)) => {
                        let p = numbering.point(side, j);
                        side.sign() * (column[p] + direct[p])
                    }
                    None => {
                        let w = k - numbering.wake_start();
                        column[numbering.points() + w] + through_wake[w]
                    }
                })
                .collect()
        })
    }

    /// Adds the sensitivities that reach the strengths and the node defects through the edge-speed equations.
    fn complete(&mut self) {
        let (section, flow) = (self.section, self.flow);
        let n = section.len();
        let index = &self.at.positions.index;
        let mut strength = vec![Lanes::zeros(); n + 2];
        let mut wall = strength.clone();
        for (p, t) in index.iter().enumerate() {
            let (first, w) = section.map.spline.weights(t.re);
            let inner = p > 0 && p + 1 < index.len();
            let per_rate = if inner { per_rate(section, t.re) } else { 0.0 };
            let weight = lanes(&self.point_weights, |weights| weights[p]);
            for q in 0..4 {
                strength[first + q] += weight * w[q];
                wall[first + q] -= weight * (per_rate * w[q]);
            }
        }
        let columns = |lanes: &[Lanes]| DMatrix::from_fn(n + 2, COEFFICIENTS, |i, o| lanes[i][o]);
        let by_points = product(&section.spline, &columns(&strength)) + product(&section.wall, &columns(&wall));
        let wake_weights = by_columns(&self.wake_weights);
        let by_wake = product(&flow.wake_by_nodes, &wake_weights);
        let strengths_by_wake = product(&wake_weights.transpose(), &flow.wake_by_strength);
        let through_spline = section.map.spline.coefficients_transposed(&strength);
        for (o, (node_mass, strengths)) in self.node_mass.iter_mut().zip(self.strengths.iter_mut()).enumerate() {
            for i in 0..n {
                node_mass[i] += by_points[(i, o)] + by_wake[(i, o)];
                strengths[i] += through_spline[i][o] + strengths_by_wake[(o, i)];
            }
        }
    }
}

/// A matrix with one column per coefficient.
pub(super) fn by_columns(each: &Coefficients<Vec<f64>>) -> DMatrix<f64> {
    let columns = each.as_ref().to_array();
    DMatrix::from_fn(each.cl.len(), COEFFICIENTS, |i, o| columns[o][i])
}

/// Weights of the strength γ at the points in −λ·R for one output. The edge-speed equation is u − (±γ) = 0 and the
/// stagnation equation γ = 0.
fn point_weights(numbering: &Numbering, multipliers: &Multipliers<COEFFICIENTS>, output: usize) -> Vec<f64> {
    let mut weights = vec![0.0; numbering.points()];
    for side in Side::BOTH {
        for j in 0..numbering.side {
            weights[numbering.point(side, j)] = side.sign() * multipliers.speed[numbering.station(side, j)][output];
        }
    }
    weights[numbering.side] = -multipliers.stagnation[output];
    weights
}
