//! The free-form deformation box: a tensor-product B-spline map from parameters to space.

use super::FfdError;
use super::simplices::smallest_simplex;
use crate::scalar::Scalar;
use crate::spline::{KnotVector, TensorSpline};

/// Highest degree. The work per point goes with the square of it, and beyond some five a box gains nothing.
const MOST_DEGREE: usize = 50;
/// Largest magnitude of a coordinate of a control point. Areas, volumes and their squares stay finite.
const MOST_COORDINATE: f64 = 1e100;

/// Where the control points of a rectangular box stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Placement {
    /// Evenly spaced, as in the paper. For degrees above one the map from parameters to space is then not linear.
    #[default]
    Even,
    /// At the Greville abscissae: the undeformed box is the identity map up to scale, so that embedding is exact.
    Greville,
}

/// A free-form deformation box in `D` dimensions (two unless told): a clamped B-spline of any degree in each
/// direction, with parameters in [0, 1].
///
/// Control points are stored with the first direction (x, "columns") running fastest: control point `(i, j)` of an
/// `n × m` net stands at `i + n j`. The source is Section IV of the paper.
///
/// ```
/// use aeroform::ffd::{FfdBox, Placement};
/// let lattice = FfdBox::rectangular([[-0.1, 1.1], [-0.15, 0.15]], [4, 4], [3, 3], Placement::Even).unwrap();
/// assert!((lattice.control_points()[5][0] - 0.3_f64).abs() < 1e-15);
/// let embedding = lattice.embed(&[[0.0, 0.0], [1.0, 0.0]]).unwrap();
/// // lift the whole box: both points follow
/// let up = vec![[0.0, 0.25]; 16];
/// let moved = embedding.deform(&[[0.0, 0.0], [1.0, 0.0]], &up).unwrap();
/// assert!(moved.iter().all(|[_, y]| (y - 0.25_f64).abs() < 1e-15));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct FfdBox<S, const D: usize = 2> {
    spline: TensorSpline<S, D, D>,
}

impl<S: Scalar, const D: usize> FfdBox<S, D> {
    /// A box over `ranges` (`[first, last]` per direction) with `counts` control points and `degrees`, one number of
    /// each per direction.
    ///
    /// # Errors
    /// Empty or reversed ranges, a degree of zero, or not more control points than the degree.
    pub fn rectangular(
        ranges: [[S; 2]; D],
        counts: [usize; D],
        degrees: [usize; D],
        placement: Placement,
    ) -> Result<Self, FfdError> {
        for (axis, [first, last]) in ranges.map(|range| range.map(|end| end.re())).into_iter().enumerate() {
            // written so that NaN fails
            if !(-MOST_COORDINATE <= first && first < last && last <= MOST_COORDINATE) {
                return Err(FfdError::Range { axis, first, last });
            }
        }
        let axes = Self::axes(counts, degrees)?;
        let fractions = Self::fractions(&axes, placement);
        let points = (0..counts.iter().product())
            .map(|index| {
                let local = Self::unravel(counts, index);
                std::array::from_fn(|d| {
                    let [first, last] = ranges[d];
                    let t = fractions[d][local[d]];
                    // exact at both ends
                    if t == 1.0 { last } else { first + (last - first) * t }
                })
            })
            .collect();
        Self::from_spline(axes, points)
    }

    /// A box whose undeformed net is multilinear between `2^D` corners, first direction fastest (in the plane:
    /// lower front, lower rear, upper front, upper rear). Corners are arrays, or `nalgebra` points or vectors.
    ///
    /// # Errors
    /// As [`rectangular`](Self::rectangular), a wrong number of corners, or corners that fold the net.
    pub fn from_corners(
        corners: &[impl Into<[S; D]> + Copy],
        counts: [usize; D],
        degrees: [usize; D],
        placement: Placement,
    ) -> Result<Self, FfdError> {
        if corners.len() != 1 << D {
            return Err(FfdError::PointCount { expected: 1 << D, found: corners.len() });
        }
        let axes = Self::axes(counts, degrees)?;
        let fractions = Self::fractions(&axes, placement);
        let points = (0..counts.iter().product())
            .map(|index| {
                let local = Self::unravel(counts, index);
                let mut point = [S::from(0.0); D];
                for (corner, &position) in corners.iter().enumerate() {
                    let weight: f64 = (0..D)
                        .map(|d| {
                            let t = fractions[d][local[d]];
                            if corner >> d & 1 == 1 { t } else { 1.0 - t }
                        })
                        .product();
                    for (sum, c) in point.iter_mut().zip(position.into()) {
                        *sum += c * weight;
                    }
                }
                point
            })
            .collect();
        Self::from_spline(axes, points)
    }

    /// A box with any undeformed control points (arrays, or `nalgebra` points or vectors), first direction fastest.
    ///
    /// # Errors
    /// As [`rectangular`](Self::rectangular), a wrong number of control points, one that is not finite, or a net that
    /// is folded.
    pub fn from_control_points(
        points: Vec<impl Into<[S; D]>>,
        counts: [usize; D],
        degrees: [usize; D],
    ) -> Result<Self, FfdError> {
        Self::from_spline(Self::axes(counts, degrees)?, points.into_iter().map(Into::into).collect())
    }

    fn from_spline(axes: [KnotVector; D], points: Vec<[S; D]>) -> Result<Self, FfdError> {
        let spline = TensorSpline::new(axes, points).map_err(FfdError::ControlPoints)?;
        let real: Vec<[f64; D]> = spline.control_points().iter().map(|p| p.map(|c| c.re())).collect();
        if let Some(index) = real.iter().position(|p| p.iter().any(|c| c.abs() > MOST_COORDINATE)) {
            return Err(FfdError::TooLarge { index, point: real[index].to_vec(), most: MOST_COORDINATE });
        }
        let (index, measure) = smallest_simplex(&spline.counts(), &real);
        if !(measure > 0.0) {
            let control_point = Self::unravel(spline.counts(), index).to_vec();
            return Err(FfdError::Folded { control_point, measure });
        }
        Ok(Self { spline })
    }

    fn axes(counts: [usize; D], degrees: [usize; D]) -> Result<[KnotVector; D], FfdError> {
        let mut axes = Vec::with_capacity(D);
        for axis in 0..D {
            if degrees[axis] > MOST_DEGREE {
                return Err(FfdError::Degree { axis, degree: degrees[axis], most: MOST_DEGREE });
            }
            let knots = KnotVector::clamped_uniform(degrees[axis], counts[axis]);
            axes.push(knots.map_err(|source| FfdError::Direction { axis, source })?);
        }
        Ok(std::array::from_fn(|axis| axes[axis].clone()))
    }

    /// Positions of the control points along each direction, 0 to 1.
    fn fractions(axes: &[KnotVector; D], placement: Placement) -> [Vec<f64>; D] {
        std::array::from_fn(|axis| match placement {
            Placement::Greville => axes[axis].greville(),
            Placement::Even => {
                let last = axes[axis].control_points() - 1;
                (0..=last).map(|i| i as f64 / last as f64).collect()
            }
        })
    }

    /// The B-spline map from parameters in [0, 1] to space.
    pub fn spline(&self) -> &TensorSpline<S, D, D> {
        &self.spline
    }

    /// The control points, the first direction running fastest.
    pub fn control_points(&self) -> &[[S; D]] {
        self.spline.control_points()
    }

    /// Number of control points in each direction.
    pub fn counts(&self) -> [usize; D] {
        self.spline.counts()
    }

    /// Polynomial degree in each direction.
    pub fn degrees(&self) -> [usize; D] {
        std::array::from_fn(|axis| self.spline.axes()[axis].degree())
    }

    /// A box with the degrees and knots of this one and other control points, which may be folded and of any scalar.
    ///
    /// # Errors
    /// A wrong number of control points, or one that is not finite.
    pub fn with_control_points<T: Scalar>(&self, points: Vec<impl Into<[T; D]>>) -> Result<FfdBox<T, D>, FfdError> {
        Ok(FfdBox { spline: self.spline.with_control_points(points).map_err(FfdError::ControlPoints)? })
    }

    /// The point of the box at parameters in [0, 1].
    pub fn evaluate(&self, parameters: [S; D]) -> [S; D] {
        self.spline.evaluate(parameters)
    }

    /// Indices of a control point in each direction from its position in the list.
    pub fn unravel(counts: [usize; D], mut index: usize) -> [usize; D] {
        std::array::from_fn(|d| {
            let local = index % counts[d];
            index /= counts[d];
            local
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn greville_placement_is_the_identity() {
        let range: [[f64; 2]; 2] = [[-0.1, 1.1], [-0.15, 0.15]];
        let lattice = FfdBox::rectangular(range, [7, 5], [4, 2], Placement::Greville).unwrap();
        for u in [[0.2, 0.7], [0.0, 1.0], [0.9, 0.33]] {
            let x = lattice.evaluate(u);
            assert!((x[0] + 0.1 - 1.2 * u[0]).abs() < 1e-15 && (x[1] + 0.15 - 0.3 * u[1]).abs() < 1e-15);
        }
    }

    #[test]
    fn corners_of_a_rectangle_make_the_rectangle() {
        let corners: [[f64; 2]; 4] = [[0.0, 0.0], [2.0, 0.0], [0.0, 1.0], [2.0, 1.0]];
        let a = FfdBox::from_corners(&corners, [4, 3], [3, 2], Placement::Even).unwrap();
        let b = FfdBox::rectangular([[0.0, 2.0], [0.0, 1.0]], [4, 3], [3, 2], Placement::Even).unwrap();
        for (p, q) in a.control_points().iter().zip(b.control_points()) {
            assert!((p[0] - q[0]).abs() < 1e-15 && (p[1] - q[1]).abs() < 1e-15);
        }
    }

    #[test]
    fn a_volume_is_the_same_code() {
        let lattice =
            FfdBox::rectangular([[0.0, 1.0], [0.0, 2.0], [0.0, 3.0]], [3, 4, 2], [2, 3, 1], Placement::Greville)
                .unwrap();
        let x: [f64; 3] = lattice.evaluate([0.25, 0.5, 0.75]);
        assert!((x[0] - 0.25).abs() < 1e-15 && (x[1] - 1.0).abs() < 1e-15 && (x[2] - 2.25).abs() < 1e-15);
    }

    #[test]
    fn bad_boxes_are_refused() {
        let even = Placement::Even;
        let wrong = |r, n, p| FfdBox::<f64, 2>::rectangular(r, n, p, even).unwrap_err();
        let unit = [[0.0, 1.0], [0.0, 1.0]];
        assert!(matches!(wrong([[1.0, 0.0], [0.0, 1.0]], [4, 4], [3, 3]), FfdError::Range { axis: 0, .. }));
        assert!(matches!(wrong([[0.0, 1.0], [0.0, f64::NAN]], [4, 4], [3, 3]), FfdError::Range { axis: 1, .. }));
        assert!(matches!(wrong(unit, [4, 3], [3, 3]), FfdError::Direction { axis: 1, .. }));
        assert!(matches!(wrong(unit, [4, 4], [3, 0]), FfdError::Direction { axis: 1, .. }));
        // turned over: x and y exchanged
        let corners = [[0.0, 0.0], [0.0, 1.0], [2.0, 0.0], [2.0, 1.0]];
        assert!(matches!(FfdBox::from_corners(&corners, [2, 2], [1, 1], even), Err(FfdError::Folded { .. })));
    }
}
