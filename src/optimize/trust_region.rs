//! The trust-region subproblem: the lowest point of a quadratic within an ellipsoid, solved exactly.

use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

/// Eigenvalues are trusted to this share of the largest.
const RESOLUTION: f64 = 1e-13;

/// The quadratic `gᵀp + ½ pᵀHp`, factorised at most once each way.
///
/// Steps are measured by a metric `M = LLᵀ`: everything below works on `Lᵀp`, in which the ellipsoid is a ball.
pub(super) struct QuadraticModel {
    gradient: DVector<f64>,
    hessian: DMatrix<f64>,
    /// L of the metric; `None` for the identity.
    metric: Option<DMatrix<f64>>,
    /// The step to the minimum, where the Hessian is positive definite.
    newton: Option<DVector<f64>>,
    eigen: Option<Eigen>,
}

/// The Hessian's eigenvectors, ascending eigenvalues, and the gradient in that basis.
struct Eigen {
    values: Vec<f64>,
    vectors: DMatrix<f64>,
    gradient: DVector<f64>,
}

/// A step and what the quadratic promises of it.
pub(super) struct TrustRegionStep {
    pub(super) vector: DVector<f64>,
    /// Length in the metric.
    pub(super) length: f64,
    /// By how much the quadratic falls, ≥ 0.
    pub(super) decrease: f64,
    /// Whether the ball, not the quadratic, bounds the step.
    pub(super) at_boundary: bool,
}

impl QuadraticModel {
    /// A metric that is not positive definite counts as the identity.
    pub(super) fn new(gradient: &[f64], hessian: DMatrix<f64>, metric: Option<DMatrix<f64>>) -> Self {
        let mut gradient = DVector::from_column_slice(gradient);
        let mut hessian = hessian;
        let metric = metric.and_then(Cholesky::new).map(|factors| factors.l());
        if let Some(l) = &metric
            && l.solve_lower_triangular_mut(&mut gradient)
            && l.solve_lower_triangular_mut(&mut hessian)
        {
            hessian = hessian.transpose();
            l.solve_lower_triangular_mut(&mut hessian);
            // symmetric up to round-off; the eigenvalue routine reads one half
            hessian = (&hessian + hessian.transpose()) * 0.5;
        }
        let newton = Cholesky::new(hessian.clone()).map(|factors| factors.solve(&-&gradient));
        let newton = newton.filter(|step| step.iter().all(|s| s.is_finite()));
        Self { gradient, hessian, metric, newton, eigen: None }
    }

    /// The lowest point within `radius` of the origin.
    pub(super) fn minimum_within(&mut self, radius: f64) -> TrustRegionStep {
        if let Some(newton) = &self.newton
            && newton.norm() <= radius
        {
            let decrease = -0.5 * self.gradient.dot(newton);
            let (vector, length) = (self.in_variables(newton.clone()), newton.norm());
            return TrustRegionStep { vector, length, decrease, at_boundary: false };
        }
        let eigen = self.eigen();
        let (coordinates, at_boundary) = eigen.minimum_within(radius);
        let vector = &eigen.vectors * coordinates;
        let decrease = -(self.gradient.dot(&vector) + 0.5 * vector.dot(&(&self.hessian * &vector)));
        let length = vector.norm();
        TrustRegionStep { vector: self.in_variables(vector), length, decrease: decrease.max(0.0), at_boundary }
    }

    /// The step `p` from `Lᵀp`.
    fn in_variables(&self, mut step: DVector<f64>) -> DVector<f64> {
        if let Some(l) = &self.metric {
            l.tr_solve_lower_triangular_mut(&mut step);
        }
        step
    }

    /// Whether the quadratic curves downwards in some direction, beyond round-off.
    pub(super) fn is_indefinite(&mut self) -> bool {
        if self.newton.is_some() {
            return false;
        }
        let eigen = self.eigen();
        eigen.lowest() < -RESOLUTION * eigen.size()
    }

    /// Decrease of the quadratic at its minimum, where it has one.
    pub(super) fn decrement(&self) -> Option<f64> {
        self.newton.as_ref().map(|step| -0.5 * self.gradient.dot(step))
    }

    fn eigen(&mut self) -> &Eigen {
        let (gradient, hessian) = (&self.gradient, &self.hessian);
        self.eigen.get_or_insert_with(|| Eigen::new(gradient, hessian))
    }
}

impl Eigen {
    fn new(gradient: &DVector<f64>, hessian: &DMatrix<f64>) -> Self {
        let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(hessian.clone());
        let mut order: Vec<usize> = (0..eigenvalues.len()).collect();
        order.sort_by(|&a, &b| eigenvalues[a].total_cmp(&eigenvalues[b]));
        let vectors = DMatrix::from_fn(gradient.len(), order.len(), |i, k| eigenvectors[(i, order[k])]);
        Self { values: order.iter().map(|&k| eigenvalues[k]).collect(), gradient: vectors.tr_mul(gradient), vectors }
    }

    fn lowest(&self) -> f64 {
        self.values.first().copied().unwrap_or(0.0)
    }

    fn size(&self) -> f64 {
        self.values.iter().fold(0.0, |size, v| size.max(v.abs()))
    }

    /// `−(Λ − λ₁ + rise)⁻¹ g`, an entry of `g` that vanishes giving 0 whatever its eigenvalue.
    ///
    /// Counting the shift from the lowest eigenvalue λ₁ keeps its digits where it nearly cancels that.
    fn step(&self, rise: f64) -> DVector<f64> {
        let entries = self.values.iter().zip(&self.gradient);
        let entries = entries.map(|(v, &g)| if g == 0.0 { 0.0 } else { -g / (v - self.lowest() + rise) });
        DVector::from_iterator(self.values.len(), entries)
    }

    /// Lowest point of the ball in the basis of the eigenvectors (Moré & Sorensen, SIAM J. Sci. Stat. Comput. 4,
    /// 1983): `(Λ + σ) p = −g` with σ ≥ 0, Λ + σ positive semidefinite and σ (radius − |p|) = 0.
    fn minimum_within(&self, radius: f64) -> (DVector<f64>, bool) {
        let margin = RESOLUTION * self.size().max(f64::MIN_POSITIVE);
        let least = self.lowest().max(0.0) + margin;
        let step = self.step(least);
        if step.norm() <= radius {
            return self.hard_case(step, radius, margin);
        }
        // |p| falls from above the radius to below it between these two
        let (mut low, mut high) = (least, least + self.gradient.norm() / radius);
        let mut rise = low;
        let mut step = step;
        for _ in 0..100 {
            let length = step.norm();
            if (length - radius).abs() <= 1e-12 * radius {
                break;
            }
            if length > radius {
                low = rise;
            } else {
                high = rise;
            }
            // Newton on 1/radius − 1/|p|, which is nearly linear in the shift
            let slope: f64 = step.iter().zip(&self.values).map(|(p, v)| p * p / (v - self.lowest() + rise)).sum();
            let next = rise + length * length / slope * (length - radius) / radius;
            rise = if next > low && next < high { next } else { 0.5 * (low + high) };
            step = self.step(rise);
        }
        (step, true)
    }

    /// The shifted step does not reach the boundary: the rest goes along the eigenvector of the lowest eigenvalue, if
    /// that one is negative.
    fn hard_case(&self, mut step: DVector<f64>, radius: f64, margin: f64) -> (DVector<f64>, bool) {
        if self.lowest() >= -margin {
            return (step, false);
        }
        let others = step.norm_squared() - step[0] * step[0];
        let reach = (radius * radius - others).max(0.0).sqrt();
        step[0] = if self.gradient[0] > 0.0 { -reach } else { reach };
        (step, true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn matrix(diagonal: &[f64]) -> DMatrix<f64> {
        // rotated by a Householder reflection
        let n = diagonal.len();
        let v = DVector::from_fn(n, |i, _| 1.0 + (i as f64 * 1.3).sin()).normalize();
        let q = DMatrix::identity(n, n) - &v * v.transpose() * 2.0;
        &q * DMatrix::from_diagonal(&DVector::from_column_slice(diagonal)) * &q
    }

    /// The conditions of Moré & Sorensen, which characterise the solution.
    fn is_solution(gradient: &[f64], hessian: &DMatrix<f64>, radius: f64) {
        let mut quadratic = QuadraticModel::new(gradient, hessian.clone(), None);
        let step = quadratic.minimum_within(radius);
        let p = &step.vector;
        let residual = hessian * p + DVector::from_column_slice(gradient);
        let shift = -residual.dot(p) / p.norm_squared();
        let scale = hessian.amax();
        assert!(p.norm() <= radius * (1.0 + 1e-9));
        assert_relative_eq!(residual + p * shift, DVector::zeros(p.len()), epsilon = 1e-8 * scale);
        let lowest = hessian.symmetric_eigenvalues().min();
        assert!(shift >= -1e-9 * scale && lowest + shift >= -1e-9 * scale, "shift {shift}, lowest {lowest}");
        if step.at_boundary {
            assert_relative_eq!(p.norm(), radius, max_relative = 1e-9);
        } else {
            assert!(shift.abs() <= 1e-9 * scale);
        }
        assert!(step.decrease >= 0.0);
    }

    #[test]
    fn optimality_conditions_hold() {
        for diagonal in [[1.0, 2.0, 30.0, 4e4], [-3.0, 0.5, 2.0, 10.0], [-5.0, -5.0, -1.0, -1e-3], [0.0, 1.0, 2.0, 3.0]]
        {
            let hessian = matrix(&diagonal);
            for gradient in [[1.0, -2.0, 0.3, 5.0], [1e-8, 0.0, 1e-9, 0.0], [0.0, 0.0, 100.0, -1.0]] {
                for radius in [1e-4, 0.1, 1.0, 50.0] {
                    is_solution(&gradient, &hessian, radius);
                }
            }
        }
    }

    #[test]
    fn hard_case_goes_along_the_lowest_eigenvector() {
        let hessian = matrix(&[-2.0, 1.0, 3.0, 4.0]);
        let eigen = SymmetricEigen::new(hessian.clone());
        let above = eigen.eigenvalues.iter().position(|&v| v > 3.5).unwrap();
        // the gradient has no component along the eigenvector of −2
        let gradient: Vec<f64> = eigen.eigenvectors.column(above).iter().map(|v| 0.6 * v).collect();
        is_solution(&gradient, &hessian, 1.0);
        let mut at_saddle = QuadraticModel::new(&[0.0; 4], hessian, None);
        assert!(at_saddle.is_indefinite());
        let step = at_saddle.minimum_within(0.5);
        assert_relative_eq!(step.vector.norm(), 0.5, max_relative = 1e-12);
        assert_relative_eq!(step.decrease, 0.25, max_relative = 1e-10);
    }

    #[test]
    fn a_metric_makes_the_ball_an_ellipsoid() {
        let (hessian, metric) = (matrix(&[-3.0, 0.5, 2.0, 10.0]), matrix(&[7.0, 1.0, 0.3, 2.0]));
        let gradient = [1.0, -2.0, 0.3, 5.0];
        for radius in [0.01, 1.0, 20.0] {
            let step = QuadraticModel::new(&gradient, hessian.clone(), Some(metric.clone())).minimum_within(radius);
            let p = &step.vector;
            assert_relative_eq!(p.dot(&(&metric * p)).sqrt(), step.length, max_relative = 1e-12);
            assert_relative_eq!(step.length, radius, max_relative = 1e-9);
            // the conditions of Moré and Sorensen with the metric: (H + σ M) p = −g, σ ≥ 0
            let residual = &hessian * p + DVector::from_column_slice(&gradient);
            let shift = -residual.dot(p) / p.dot(&(&metric * p));
            assert!(shift >= 0.0);
            assert_relative_eq!(residual + &metric * p * shift, DVector::zeros(4), epsilon = 1e-7);
        }
    }

    #[test]
    fn semidefinite_without_slope_stays() {
        let mut flat =
            QuadraticModel::new(&[0.0, 2.0], DMatrix::from_diagonal(&DVector::from_column_slice(&[0.0, 4.0])), None);
        assert!(!flat.is_indefinite());
        let step = flat.minimum_within(10.0);
        assert_relative_eq!(step.vector[0], 0.0);
        assert_relative_eq!(step.vector[1], -0.5, max_relative = 1e-10);
    }
}
