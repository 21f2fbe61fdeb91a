//! Points embedded in a box: their parameters and the linear map that moves them.

use super::inversion::{Found, Inversion};
use super::{FfdBox, FfdError, LinearMap};
use crate::differentiate::lift_roots;
use crate::scalar::Scalar;
use crate::spline::for_each_weight;

/// Points whose parameters in a box are known.
///
/// The parameters do not change while the box deforms, so the deformation is a constant sparse linear map of the
/// displacements of the box control points: `point + Σ weight · displacement` (paper, Section V). Written in
/// displacements, an undeformed box leaves the points exactly where they were, and equal points stay equal to the
/// last bit.
#[derive(Debug, Clone, PartialEq)]
pub struct Embedding<S = f64, const D: usize = 2> {
    parameters: Vec<[S; D]>,
    map: LinearMap<S>,
}

impl<S: Scalar, const D: usize> FfdBox<S, D> {
    /// Embeds points, given as arrays or as `nalgebra` points or vectors, in the undeformed box.
    ///
    /// The parameters are found in `f64` by bracketed Newton, to a residual along each axis of at most 1e-14 of the
    /// size of the box plus the round-off of its coordinates, and then carry the derivatives of the points and of the
    /// box by the implicit function theorem.
    ///
    /// # Errors
    /// The first point outside of the box, or in a part of it that is singular. Where derivatives are wanted, the first
    /// point at which the box has a singular Jacobian, so that its parameters have no derivatives.
    pub fn embed(&self, points: &[impl Into<[S; D]> + Copy]) -> Result<Embedding<S, D>, FfdError> {
        let real_points = self.control_points().iter().map(|p| p.map(|c| c.re())).collect::<Vec<_>>();
        let real: FfdBox<f64, D> = self.with_control_points(real_points)?;
        let inversion = Inversion::new(&real)?;
        let mut parameters = Vec::with_capacity(points.len());
        let mut map = LinearMap::new(self.control_points().len());
        for (index, &point) in points.iter().enumerate() {
            let point: [S; D] = point.into();
            let target = point.map(|c| c.re());
            let found = match inversion.solve(target) {
                Found::Inside(found) => found,
                Found::Outside => return Err(FfdError::Outside { index, point: target.to_vec() }),
                Found::Lost => return Err(FfdError::Singular { index, point: target.to_vec() }),
            };
            let residual = |u: [S; D]| {
                let value = self.evaluate(u);
                std::array::from_fn(|d| value[d] - point[d])
            };
            let lifted = lift_roots(found, || real.spline().point_and_jacobian(found).1, residual)
                .map_err(|_| FfdError::NoDerivative { index, point: target.to_vec() })?;
            for_each_weight(self.spline().axes(), lifted, |column, weight| map.push(column, weight));
            map.end_row();
            parameters.push(lifted);
        }
        Ok(Embedding { parameters, map })
    }
}

impl<S: Scalar, const D: usize> Embedding<S, D> {
    /// Parameters of the points, in [0, 1].
    pub fn parameters(&self) -> &[[S; D]] {
        &self.parameters
    }

    /// The map from displacements of the box control points to displacements of the points.
    pub fn map(&self) -> &LinearMap<S> {
        &self.map
    }

    /// The points after the box control points moved by `displacements`.
    ///
    /// # Errors
    /// A wrong number of points or displacements.
    pub fn deform(
        &self,
        points: &[impl Into<[S; D]> + Copy],
        displacements: &[impl Into<[S; D]> + Copy],
    ) -> Result<Vec<[S; D]>, FfdError> {
        for (expected, found) in [(self.map.outputs(), points.len()), (self.map.inputs(), displacements.len())] {
            if expected != found {
                return Err(FfdError::PointCount { expected, found });
            }
        }
        let displacements: Vec<[S; D]> = displacements.iter().map(|&d| d.into()).collect();
        let mut moved = vec![[S::from(0.0); D]; points.len()];
        self.map.add_to(&displacements, &mut moved);
        for (moved, &point) in moved.iter_mut().zip(points) {
            for (moved, point) in moved.iter_mut().zip(point.into()) {
                *moved += point;
            }
        }
        Ok(moved)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::differentiate::{StepRange, VectorFunction, finite_difference_jacobian, jacobian};
    use crate::ffd::Placement;

    /// Deformed point as a function of the undeformed point, of one corner of the undeformed box and of a displacement.
    struct Moved;
    impl VectorFunction for Moved {
        type Error = FfdError;
        fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, FfdError> {
            let flat = FfdBox::rectangular([[0.0, 1.0], [0.0, 1.0]], [5, 4], [3, 2], Placement::Even)?;
            let mut net: Vec<[S; 2]> = flat.control_points().iter().map(|p| p.map(S::from)).collect();
            net[7][0] += x[2];
            net[7][1] += x[3];
            let lattice = flat.with_control_points(net)?;
            let point = [[x[0], x[1]]];
            let mut displacements = vec![[S::from(0.0); 2]; 20];
            displacements[6] = [x[4], x[5]];
            displacements[12] = [-x[5], x[4]];
            Ok(lattice.embed(&point)?.deform(&point, &displacements)?[0].to_vec())
        }
    }

    #[test]
    fn derivatives_with_respect_to_point_and_box_are_exact() {
        for point in [[0.31, 0.62], [0.5, 0.5], [0.77, 0.2]] {
            let x = [point[0], point[1], 0.02, -0.01, 0.05, -0.08];
            let (_, exact) = jacobian(&Moved, &x).unwrap();
            let steps = [StepRange::for_scale(0.5); 6];
            let check = finite_difference_jacobian(|x| Moved.evaluate(x), &x, &steps).unwrap();
            for row in 0..2 {
                for column in 0..6 {
                    let (a, e) = (exact[(row, column)], check[(row, column)]);
                    assert!((a - e.value).abs() <= 1e-9 + 10.0 * e.error, "{row} {column}: {a} {e:?}");
                }
            }
        }
    }

    #[test]
    fn no_displacement_moves_nothing_at_all() {
        let lattice = FfdBox::rectangular([[-0.1, 1.1], [-0.15, 0.15]], [5, 5], [3, 3], Placement::Even).unwrap();
        let points = [[1.0, 0.0], [0.3, 0.05], [1.0, 0.0]];
        let embedding = lattice.embed(&points).unwrap();
        assert_eq!(embedding.deform(&points, &[[0.0; 2]; 25]).unwrap(), points);
        let random: Vec<[f64; 2]> = (0..25).map(|i| [(i as f64).sin(), (i as f64 * 1.7).cos()]).collect();
        let moved = embedding.deform(&points, &random).unwrap();
        assert_eq!(moved[0], moved[2]);
        assert!(matches!(
            embedding.deform(&points, &random[1..]),
            Err(FfdError::PointCount { expected: 25, found: 24 })
        ));
    }

    #[test]
    fn an_outside_point_is_named() {
        let lattice = FfdBox::rectangular([[0.0, 1.0], [0.0, 1.0]], [4, 4], [3, 3], Placement::Even).unwrap();
        assert_eq!(
            lattice.embed(&[[0.5, 0.5], [0.5, 1.5]]).unwrap_err(),
            FfdError::Outside { index: 1, point: vec![0.5, 1.5] }
        );
    }
}
