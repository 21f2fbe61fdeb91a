//! What the search and Newton's method ask of a flow, and what an attempt may cost.

use crate::flow::layer::{Change, EdgeLaw, Layer, Layout, Unknowns};

/// Residuals of all equations at some unknowns.
pub(crate) trait Residuals {
    /// Euclidean norm.
    fn norm(&self) -> f64;
    /// Largest magnitude; NaN where any residual is.
    fn largest(&self) -> f64;
}

/// The equations of a flow on one layout of stations.
pub(crate) trait Equations {
    type Law: EdgeLaw<Number = f64>;
    type Residuals: Residuals;
    /// The equations linearised at some unknowns.
    type At;
    /// Factors of the Jacobian of a linearisation.
    type Factors;

    fn layer(&self) -> &Layer<'_, Self::Law>;

    /// A start by marching the layer along the outer flow without a layer.
    fn march(&self) -> Unknowns;

    fn residuals(&self, unknowns: &Unknowns) -> Self::Residuals;

    fn linearise(&self, unknowns: &Unknowns) -> Self::At;

    /// The residuals where the equations were linearised.
    fn residuals_at<'a>(&self, at: &'a Self::At) -> &'a Self::Residuals;

    /// `None` where the Jacobian is singular or not finite.
    fn factorise(&self, at: &Self::At) -> Option<Self::Factors>;

    /// Minus the inverse Jacobian times residuals: Newton's step.
    fn solve(&self, at: &Self::At, factors: &Self::Factors, residuals: &Self::Residuals) -> Change;

    /// Minus the inverse Jacobian times the derivative of the residuals by the angle of attack (per radian), the wake
    /// staying where it is.
    fn by_angle(&self, at: &Self::At, factors: &Self::Factors) -> Change;

    /// Minus the inverse Jacobian times the derivative of the residuals by trips whose arc lengths change at the given
    /// rates.
    fn by_trips(&self, at: &Self::At, factors: &Self::Factors, rates: [f64; 2]) -> Change;
}

/// The flow that is sought, and those about the same section at other angles of attack, with other trips, and on other
/// layouts.
pub(crate) trait Family {
    /// The outer flow at one angle of attack.
    type Outer;
    /// The equations linearised at some unknowns.
    type At;
    /// Factors of the Jacobian of a linearisation.
    type Factors;
    type Equations<'a>: Equations<At = Self::At, Factors = Self::Factors>
    where
        Self: 'a;

    /// Total arc length of the surface.
    fn total(&self) -> f64;

    /// Stations that are wanted.
    fn layout(&self) -> &Layout;

    /// Largest residual that is wanted.
    fn tolerance(&self) -> f64;

    /// Sign of the lift without a layer.
    fn lift_sign(&self) -> f64;

    /// Arc length of the stagnation point without a layer.
    fn stagnation(&self) -> f64;

    /// Arc lengths of the trips that are wanted.
    fn trips(&self) -> [Option<f64>; 2];

    /// The outer flow at an angle of attack so many radians from the one wanted, the wake staying where it is.
    fn turned(&self, radians: f64) -> Self::Outer;

    /// [`turned`](Self::turned) in the memory of an outer flow of this family.
    fn turn(&self, outer: &mut Self::Outer, radians: f64);

    fn equations<'a>(
        &'a self,
        outer: &'a Self::Outer,
        layout: &'a Layout,
        trips: [Option<f64>; 2],
    ) -> Self::Equations<'a>;
}

/// Iterations without progress after which an attempt is given up.
const PATIENCE: usize = 12;

/// What an attempt may cost.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Effort {
    /// Largest residual of a converged solution.
    pub tolerance: f64,
    pub iterations: usize,
    /// Iterations without progress after which the attempt is given up.
    pub patience: usize,
    /// The attempt is given up at once where transition would move farther than this in the first step, in lengths of its
    /// side.
    pub reach: f64,
}

impl Effort {
    /// With the usual patience and any reach.
    pub fn new(tolerance: f64, iterations: usize) -> Self {
        Self { tolerance, iterations, patience: PATIENCE, reach: f64::INFINITY }
    }
}

/// How an attempt ended, with the equations linearised there.
#[derive(Debug, Clone)]
pub(crate) struct End<A> {
    pub unknowns: Unknowns,
    pub at: A,
    pub residual: f64,
    pub iterations: usize,
    pub converged: bool,
}
