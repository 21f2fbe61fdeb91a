//! How far the pressures of the flow are from those wanted, with exact derivatives in the shape.

use super::FlowAnalysis;
use crate::design::DesignError;
use crate::design::pressure_target::{PressureError, PressureTarget};
use crate::design::shape::{Posed, PosedSlope};
use crate::flow::{Derivatives, Solution};
use crate::scalar::Scalar;
use crate::section::Section;
use nalgebra::DMatrix;

/// The name of the quantity in case files.
pub(in crate::design) const CP_ERROR: &str = "cp_error";

impl FlowAnalysis {
    /// Takes wanted pressures, compared on the panels of the undeformed `section`.
    ///
    /// # Errors
    /// [`DesignError::PressureTable`] where they reach no panel node.
    pub(crate) fn set_pressure_target(
        &mut self,
        target: PressureTarget,
        section: &Section<f64>,
    ) -> Result<(), DesignError> {
        let nodes = self.nodes(section.curve().control_points());
        self.pressures = Some(PressureError::new(target, &nodes)?);
        Ok(())
    }

    fn pressures(&self) -> Result<&PressureError, DesignError> {
        self.pressures.as_ref().ok_or(DesignError::NoPressureTarget)
    }

    /// Whether there are wanted pressures.
    pub(crate) fn has_pressure_target(&self) -> bool {
        self.pressures.is_some()
    }

    /// The error over any scalar that carries first derivatives at most.
    pub(in crate::design) fn pressure_error<S: Scalar>(&self, shape: Posed<'_, S>) -> Result<S, DesignError> {
        if S::NDERIV > 1 {
            return Err(DesignError::FlowSecondOrder { name: CP_ERROR.into() });
        }
        super::taylor(shape, |real, slope| self.pressure_error_and_slope(real, 1.0, slope))
    }

    /// The error; adds `factor` times its derivatives to `slope` where they are wanted. One adjoint serves all nodes.
    pub(in crate::design) fn pressure_error_and_slope(
        &self,
        shape: Posed<'_>,
        factor: f64,
        slope: &mut PosedSlope<'_>,
    ) -> Result<f64, DesignError> {
        let error = self.pressures()?;
        let flows = self.flows(shape);
        let solution = flows.solutions[error.point()].as_ref().map_err(DesignError::clone)?;
        let (value, by_cp, mut by_node) = error.value_and_slopes(&flows.nodes, &solution.distributions().cp);
        if !slope.is_wanted() {
            return Ok(value);
        }
        for through_flow in self.pressure_derivatives(solution, &[by_cp])? {
            for (sum, own) in by_node.iter_mut().zip(&through_flow.nodes) {
                *sum = [factor * (sum[0] + own[0]), factor * (sum[1] + own[1])];
            }
            if let Some(angle) = self.points[error.point()].angle {
                slope.angles[angle] += factor * through_flow.alpha;
            }
        }
        self.map.add_transposed_to(&by_node, slope.points);
        Ok(value)
    }

    /// The Gauss-Newton matrix `2 Σ ∇r ∇rᵀ` of the residuals at the nodes, in the components of the control points (2 ×
    /// control point + axis) and behind them in the angles of attack. It takes an adjoint for every node, six at a time.
    pub(in crate::design) fn pressure_matrix(&self, shape: Posed<'_>) -> Result<DMatrix<f64>, DesignError> {
        let error = self.pressures()?;
        let flows = self.flows(shape);
        let solution = flows.solutions[error.point()].as_ref().map_err(DesignError::clone)?;
        let rows = error.rows(&flows.nodes, &solution.distributions().cp);
        let of_node = |&(node, [by_cp, ..]): &(usize, [f64; 3])| {
            let mut weights = vec![0.0; flows.nodes.len()];
            weights[node] = by_cp;
            weights
        };
        let weights: Vec<Vec<f64>> = rows.iter().map(of_node).collect();
        let components = 2 * shape.points.len();
        let mut jacobian = DMatrix::zeros(rows.len(), components + shape.angles.len());
        let through_flow = self.pressure_derivatives(solution, &weights)?;
        for (r, ((node, [_, by_x, by_y]), mut by)) in rows.into_iter().zip(through_flow).enumerate() {
            by.nodes[node][0] += by_x;
            by.nodes[node][1] += by_y;
            let mut row = vec![[0.0; 2]; shape.points.len()];
            self.map.add_transposed_to(&by.nodes, &mut row);
            row.as_flattened().iter().enumerate().for_each(|(k, slope)| jacobian[(r, k)] = *slope);
            if let Some(angle) = self.points[error.point()].angle {
                jacobian[(r, components + angle)] = by.alpha;
            }
        }
        Ok(jacobian.tr_mul(&jacobian) * 2.0)
    }

    /// Derivatives of weighted sums of the pressures, by whatever the operating point holds.
    fn pressure_derivatives(&self, solution: &Solution, weights: &[Vec<f64>]) -> Result<Vec<Derivatives>, DesignError> {
        let found = solution.pressure_derivatives(weights);
        found.ok_or_else(|| DesignError::NotFinite { name: CP_ERROR.into() })
    }
}
