//! Reasons why a spline is not built or an operation on it fails.

/// Why a spline was not built or an operation on it failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SplineError {
    /// There are fewer control points than the degree needs.
    #[error("degree {degree} needs at least {} control points, there are {control_points}", degree.saturating_add(1))]
    TooFewControlPoints {
        /// Degree that was asked for.
        degree: usize,
        /// Number of control points given.
        control_points: usize,
    },
    /// The degree is zero, which makes no curve.
    #[error("the degree must be at least 1")]
    DegreeZero,
    /// A knot vector decreases or holds a number that is not finite.
    #[error("knot {index} is {value}: knots must be finite and must not decrease")]
    BadKnot {
        /// Position in the knot vector.
        index: usize,
        /// Value of the offending knot.
        value: f64,
    },
    /// A knot is repeated more often than the degree allows.
    #[error("knot {value} stands {multiplicity} times; degree {degree} allows {allowed}")]
    Multiplicity {
        /// Value of the knot.
        value: f64,
        /// How often it would stand.
        multiplicity: usize,
        /// Degree of the spline.
        degree: usize,
        /// How often it may stand there.
        allowed: usize,
    },
    /// The number of knots does not fit the number of control points.
    #[error("{expected} control points wanted by the knot vectors, {found} given")]
    ControlPointCount {
        /// Number of control points that go with the knot vectors.
        expected: usize,
        /// Number of control points given.
        found: usize,
    },
    /// A control point or data point is not finite.
    #[error("point {index} is not finite")]
    NotFinite {
        /// Position of the point in its list, counted from 0.
        index: usize,
    },
    /// A parameter outside of the domain, or a pair of parameters in the wrong order.
    #[error("parameter {parameter} is outside of ({first}, {last})")]
    OutsideDomain {
        /// Parameter that was asked for.
        parameter: f64,
        /// Start of the domain.
        first: f64,
        /// End of the domain.
        last: f64,
    },
    /// Parameters of points must be finite and increase strictly.
    #[error("parameter {index} ({value}) must be finite and exceed the one before it")]
    ParametersNotIncreasing {
        /// Position of the parameter in its list, counted from 0.
        index: usize,
        /// Value of the parameter.
        value: f64,
    },
    /// As many points as parameters, and for an interpolation as control points, are wanted.
    #[error("{expected} points wanted, {found} given")]
    PointCount {
        /// Number of points that go with the parameters or knots.
        expected: usize,
        /// Number of points given.
        found: usize,
    },
    /// The curve stands still, so that something asked of it has no derivative or no direction there.
    #[error("the tangent vanishes at parameter {parameter}")]
    ZeroTangent {
        /// Parameter at which the tangent vanishes.
        parameter: f64,
    },
    /// A length from the start of a curve that is negative or more than the whole.
    #[error("length {length} is not between 0 and the length {total} of the curve")]
    LengthOutside {
        /// Length that was asked for, from the start of the curve.
        length: f64,
        /// Length of the whole curve.
        total: f64,
    },
    /// A coordinate that the curve does not cross in the range given.
    #[error(
        "coordinate {axis} does not cross {value} between parameters {low} and {high}: it is {at_low} and {at_high} there"
    )]
    NoCrossing {
        /// Number of the coordinate, from 0.
        axis: usize,
        /// Value of the coordinate that was asked for.
        value: f64,
        /// First parameter of the range.
        low: f64,
        /// Last parameter of the range.
        high: f64,
        /// Coordinate at the first parameter.
        at_low: f64,
        /// Coordinate at the last parameter.
        at_high: f64,
    },
    /// A parameter that is defined by an equation does not depend smoothly on the shape: a tangent crossing, or the
    /// centre of curvature as point of a projection.
    #[error("the parameter found ({parameter}) has no derivative: the slope of its equation vanishes there")]
    NoDerivative {
        /// Parameter that was found.
        parameter: f64,
    },
    /// A radius or semi-axis must be positive and finite.
    #[error("a radius must be positive and finite, not {value}")]
    BadRadius {
        /// The radius given.
        value: f64,
    },
    /// An arc must have some sweep and no more than a full turn.
    #[error("an arc from angle {from} to {to} (radians): the sweep must not be zero or more than a full turn")]
    BadSweep {
        /// Angle at which the arc starts, in radians.
        from: f64,
        /// Angle at which the arc ends, in radians.
        to: f64,
    },
    /// An axis that the spline does not have.
    #[error("no axis {axis}: there are {axes}, counted from 0")]
    NoSuchAxis {
        /// Axis that was asked for, counted from 0.
        axis: usize,
        /// Number of axes of the spline.
        axes: usize,
    },
    /// The operation needs knots with both ends repeated `degree + 1` times.
    #[error("the knot vector is not clamped: both end knots must stand degree + 1 times")]
    NotClamped,
    /// End tangents go with a clamped interpolation, and with no other.
    #[error("end tangents {}", if *.wanted { "are missing: use curve_with_tangents" } else { "are for Interpolation::clamped only" })]
    EndTangents {
        /// Whether the interpolation needs tangents.
        wanted: bool,
    },
    /// Too few points for the interpolation or fit.
    #[error("{needed} points needed, {found} given")]
    TooFewPoints {
        /// Smallest number of points that will do.
        needed: usize,
        /// Number of points given.
        found: usize,
    },
    /// A linear system of a fit is singular.
    #[error("the fit is not determined: some basis function sees no data (Schoenberg-Whitney)")]
    Singular,
    /// A fit did not reach its tolerance.
    #[error("fit error {error:.3e} with {control_points} control points, wanted {tolerance:.1e}")]
    ToleranceNotReached {
        /// Largest distance of a data point from the fit, at its parameter.
        error: f64,
        /// Number of control points of the fit.
        control_points: usize,
        /// Largest distance that was asked for.
        tolerance: f64,
    },
}
