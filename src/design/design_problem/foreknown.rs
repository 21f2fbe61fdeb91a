//! Values and curvatures of a design problem that are known before a flow is solved.

use super::DesignProblem;
use crate::design::DesignError;
use crate::design::problem::ValueAndGradient;
use nalgebra::DMatrix;

impl DesignProblem {
    /// Values and gradients of the constraints that need no flow, in scaled variables; `None` for the others.
    pub(super) fn constraints_of_shape(&mut self, x: &[f64]) -> Result<Vec<Option<ValueAndGradient>>, DesignError> {
        self.set_scaled(x);
        let tangents = self.prepare()?;
        let mut known = Vec::with_capacity(self.constraints.len());
        for index in 0..self.constraints.len() {
            let quantity = self.quantities[self.constraints[index]].clone();
            known.push(if quantity.needs_flow() {
                None
            } else {
                let (value, mut gradient) = self.gradient_of(&quantity, &tangents)?;
                gradient.iter_mut().zip(self.geometry.variables()).for_each(|(g, v)| *g *= v.scale);
                Some((value, gradient))
            });
        }
        Ok(known)
    }

    /// The squared slope of the displacement of the surface, integrated along the surface, as a quadratic form of the
    /// scaled variables; `None` where the objective takes no flow or there is no shape.
    ///
    /// In thin-section theory the speed at the surface changes by the Hilbert transform of that slope, which keeps the
    /// integral of the square: the form is that of the change of the speed, in which drag is curved.
    pub(super) fn slope_of_displacement(&mut self, x: &[f64]) -> Option<DMatrix<f64>> {
        let mut terms = self.quantities.iter().zip(&self.weights);
        terms.find(|(quantity, weight)| **weight != 0.0 && quantity.needs_flow())?;
        self.set_scaled(x);
        let tangents = self.prepare().ok()?;
        let flow = self.instruments.flow.as_ref()?;
        let nodes = flow.nodes(&self.work.points);
        let last = nodes.len().checked_sub(1)?;
        let across = |a: usize, b: usize| [nodes[b][1] - nodes[a][1], nodes[a][0] - nodes[b][0]];
        let length = |v: [f64; 2]| v[0].hypot(v[1]).max(f64::MIN_POSITIVE);
        let mut slopes = DMatrix::zeros(last, x.len());
        for (mut column, variable) in slopes.column_iter_mut().zip(0..) {
            let moved = flow.nodes(&tangents.section_tangent(variable)?);
            let scale = self.geometry.variables()[variable].scale;
            let outward = |k: usize| {
                let normal = across(k.saturating_sub(1), (k + 1).min(last));
                scale * (moved[k][0] * normal[0] + moved[k][1] * normal[1]) / length(normal)
            };
            for k in 0..last {
                column[k] = (outward(k + 1) - outward(k)) / length(across(k, k + 1)).sqrt();
            }
        }
        Some(slopes.tr_mul(&slopes))
    }
}

#[cfg(test)]
mod tests {
    use crate::case::Case;
    use crate::design::{DesignProblem, Problem};
    use nalgebra::DVector;
    use std::path::Path;

    fn problem(objective: &str) -> DesignProblem {
        let text = format!(
            r#"
            name = "foreknown"
            section = {{ naca = "2412" }}
            box = {{ x = [-0.01, 1.01], y = [-0.1, 0.1], control_points = [5, 4], degree = [3, 3], placement = "even" }}
            variables = {{ free = "all" }}
            flow = {{ cl = 0.4, reynolds = 1e6 }}
            objective = {{ minimize = {{ {objective} = 1.0 }} }}
            [constraints]
            area = {{ min = "0.9 * initial" }}
            cm = {{ min = -0.1 }}
            fold_indicator = {{ min = 0.2 }}
            "#
        );
        Case::parse("foreknown", &text, Path::new(".")).unwrap().problem
    }

    /// A design away from the start, and a direction.
    fn design(problem: &DesignProblem) -> (Vec<f64>, Vec<f64>) {
        let wave = |k: usize, of: f64| (of * k as f64 + 0.4).sin();
        let start = &problem.description().start;
        let steps = problem.natural_steps().unwrap();
        let x = start.iter().zip(&steps).enumerate().map(|(k, (x, s))| x + 0.2 * s * wave(k, 2.3)).collect();
        (x, steps.iter().enumerate().map(|(k, s)| s * wave(k, 1.1)).collect())
    }

    #[test]
    fn constraints_that_need_no_flow_are_those_of_an_evaluation() {
        let mut problem = problem("cd");
        let (x, _) = design(&problem);
        let known = problem.known_constraints(&x).unwrap();
        let evaluation = problem.evaluate(&x).unwrap();
        let names = problem.description().constraint_names.clone();
        for (k, (known, name)) in known.into_iter().zip(names).enumerate() {
            let Some((value, gradient)) = known else {
                assert_eq!(name, "cm");
                continue;
            };
            assert_ne!(name, "cm");
            assert_eq!((value, &gradient), (evaluation.constraints[k], &evaluation.jacobian[k]), "{name}");
        }
    }

    #[test]
    fn the_likely_curvature_is_the_squared_slope_of_the_displacement() {
        let mut problem = problem("cd");
        let (x, way) = design(&problem);
        let form = problem.likely_curvature(&x).unwrap();
        let way = DVector::from_vec(way);
        let nodes = |t: f64| {
            let x: Vec<f64> = x.iter().zip(way.iter()).map(|(x, d)| x + t * d).collect();
            let shape = problem.shape(&problem.unscaled(&x)).unwrap();
            problem.instruments.flow.as_ref().unwrap().nodes(shape.section.curve().control_points())
        };
        let (here, there) = (nodes(0.0), nodes(1e-3));
        let last = here.len() - 1;
        let out: Vec<f64> = (0..=last)
            .map(|k| {
                let (a, b) = (here[k.saturating_sub(1)], here[(k + 1).min(last)]);
                let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
                (dy * (there[k][0] - here[k][0]) - dx * (there[k][1] - here[k][1])) / dx.hypot(dy) / 1e-3
            })
            .collect();
        let length = |k: usize| (here[k + 1][0] - here[k][0]).hypot(here[k + 1][1] - here[k][1]);
        let sum: f64 = (0..last).map(|k| (out[k + 1] - out[k]).powi(2) / length(k)).sum();
        approx::assert_relative_eq!(way.dot(&(&form * &way)), sum, max_relative = 1e-9);
        assert!(form.symmetric_eigenvalues().min() > -1e-12 * form.amax());
    }

    #[test]
    fn an_objective_without_flow_has_no_likely_curvature() {
        let mut problem = problem("area");
        let (x, _) = design(&problem);
        assert!(problem.likely_curvature(&x).is_none() && problem.known_constraints(&x).is_some());
    }
}
