//! Reasons why a free-form deformation is not set up.

use crate::spline::SplineError;

/// Why a box was not built, a point not embedded or a penalty not set up.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FfdError {
    /// The degree and control points of one direction do not go together.
    #[error("box direction {axis} (0 = x): {source}")]
    Direction {
        /// Number of the direction, 0 for x.
        axis: usize,
        /// The mistake in degree or number of control points.
        source: SplineError,
    },
    /// The degree of one direction is too high.
    #[error("box direction {axis} (0 = x) has degree {degree}; at most {most}")]
    Degree {
        /// Number of the direction, 0 for x.
        axis: usize,
        /// Degree that was asked for.
        degree: usize,
        /// Highest degree.
        most: usize,
    },
    /// A range is empty, reversed, not finite or beyond 1e100.
    #[error(
        "box direction {axis} (0 = x) has the range [{first:e}, {last:e}]: it must be finite, increase and stay within ±1e100"
    )]
    Range {
        /// Number of the direction, 0 for x.
        axis: usize,
        /// Start of the range.
        first: f64,
        /// End of the range.
        last: f64,
    },
    /// The control points of the box are wrong in number or not finite.
    #[error("box control points: {0}")]
    ControlPoints(SplineError),
    /// A cell of the undeformed control net is degenerate or turned over.
    #[error(
        "the undeformed box is folded at control point {control_point:?}: a neighbouring simplex has measure {measure:.3e}; order the control points so that x × y is positive"
    )]
    Folded {
        /// Indices of the control point, one per direction.
        control_point: Vec<usize>,
        /// Signed area (volume) of the worst simplex at it.
        measure: f64,
    },
    /// A point to embed lies outside of the box.
    #[error("point {index} at {point:?} lies outside of the box; enlarge the box")]
    Outside {
        /// Position in the list of points.
        index: usize,
        /// Coordinates of the point.
        point: Vec<f64>,
    },
    /// A point lies where the box is so nearly flat that its parameters are not determined.
    #[error(
        "the parameters of point {index} at {point:?} are not determined: the box is nearly flat there; move its control points apart"
    )]
    Singular {
        /// Position in the list of points.
        index: usize,
        /// Coordinates of the point.
        point: Vec<f64>,
    },
    /// A control point lies so far away that areas would overflow.
    #[error("box control point {index} is at {point:?}: coordinates must not exceed {most:e} in magnitude")]
    TooLarge {
        /// Position in the list of control points.
        index: usize,
        /// Coordinates of the control point.
        point: Vec<f64>,
        /// Largest magnitude of a coordinate.
        most: f64,
    },
    /// The parameters of an embedded point have no derivatives, because the Jacobian of the box is singular there.
    #[error(
        "point {index} at {point:?} has no derivatives: the Jacobian of the box is singular there; move the control points near it apart"
    )]
    NoDerivative {
        /// Position in the list of points.
        index: usize,
        /// Coordinates of the point.
        point: Vec<f64>,
    },
    /// A setting of the fold penalty is out of range.
    #[error("fold penalty: {name} is {value}, it must be positive and finite")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Value of the setting.
        value: f64,
    },
    /// A list has the wrong length.
    #[error("{expected} points expected, {found} given")]
    PointCount {
        /// Number of points that the map takes.
        expected: usize,
        /// Number of points given.
        found: usize,
    },
}
