//! The interface through which Newton's method and the search see a flow, and the limits of an attempt.

use crate::flow::layer::{Change, EdgeLaw, Layer, Layout, Unknowns};
use crate::flow::surface::SurfaceMap;

/// Residuals of all equations at some unknowns.
pub(crate) trait Residuals {
    /// Euclidean norm of all residuals.
    fn norm(&self) -> f64;
    /// Largest magnitude of any residual; NaN where any residual is NaN.
    fn largest(&self) -> f64;
}

/// The equations of a flow on one layout of stations.
pub(crate) trait Equations {
    /// The law by which the outer flow's unknown becomes the state at the edge of the layer.
    type Law: EdgeLaw<Number = f64>;
    /// Residuals of all equations at some unknowns.
    type Residuals: Residuals;
    /// The state of the flow at some unknowns, with the residuals there.
    type Evaluated;
    /// The equations linearised at some unknowns.
    type At;
    /// Factors of the Jacobian of a linearisation.
    type Factors;

    /// The boundary layer of the flow.
    fn layer(&self) -> &Layer<'_, Self::Law>;

    /// Start of the iteration, made by marching the layer along the outer flow without a layer.
    fn march(&self) -> Unknowns;

    /// The state at some unknowns with the residuals of all equations, without derivatives.
    fn evaluate(&self, unknowns: &Unknowns) -> Self::Evaluated;

    /// The residuals of an evaluated state.
    fn residuals_of<'a>(&self, state: &'a Self::Evaluated) -> &'a Self::Residuals;

    /// Residuals and derivatives of all equations.
    fn linearise(&self, unknowns: &Unknowns) -> Self::At;

    /// The state where the equations were linearised.
    fn state_at(&self, at: &Self::At) -> Self::Evaluated;

    /// The residuals at the unknowns where the equations were linearised.
    fn residuals_at<'a>(&self, at: &'a Self::At) -> &'a Self::Residuals;

    /// Factorises the Jacobian; `None` where it is singular or not finite.
    fn factorise(&self, at: &Self::At) -> Option<Self::Factors>;

    /// Minus the inverse Jacobian times residuals: Newton's step.
    fn solve(&self, at: &Self::At, factors: &Self::Factors, residuals: &Self::Residuals) -> Change;

    /// Minus the inverse Jacobian times the derivative of the residuals with respect to the angle of attack (per
    /// radian). The wake stays where it is.
    fn by_angle(&self, at: &Self::At, factors: &Self::Factors) -> Change;

    /// Minus the inverse Jacobian times the derivative of the residuals with respect to a parameter that moves the
    /// trips of the upper and lower side; `rates` are the changes of their arc lengths per change of the parameter.
    fn by_trips(&self, at: &Self::At, factors: &Self::Factors, rates: [f64; 2]) -> Change;
}

/// The requested flow and its neighbours: flows about one section at other angles of attack, with other trips, and on
/// other layouts of stations.
pub(crate) trait Family {
    /// The outer flow at one angle of attack.
    type Outer;
    /// The state of a flow at some unknowns.
    type Evaluated;
    /// The equations linearised at some unknowns.
    type At;
    /// Factors of the Jacobian of a linearisation.
    type Factors;
    type Equations<'a>: Equations<Evaluated = Self::Evaluated, At = Self::At, Factors = Self::Factors>
    where
        Self: 'a;

    /// The surface along which the stations stand.
    fn surface(&self) -> &SurfaceMap;

    /// The requested layout of stations.
    fn layout(&self) -> &Layout;

    /// The largest residual of a converged solution.
    fn tolerance(&self) -> f64;

    /// Share of the usual work that is worth spending on a search: less than one for a flow that would be beyond the
    /// model if it were found.
    fn hope(&self) -> f64;

    /// Sign of the lift without boundary layer.
    fn lift_sign(&self) -> f64;

    /// Arc length of the stagnation point without boundary layer, in chords from the first node.
    fn stagnation(&self) -> f64;

    /// Arc lengths of the requested trips on the upper and lower side, in chords from the first node.
    fn trips(&self) -> [Option<f64>; 2];

    /// The outer flow at an angle of attack that differs from the requested one by `radians`. The wake stays where it
    /// is.
    fn turned(&self, radians: f64) -> Self::Outer;

    /// Does the work of [`turned`](Self::turned) in the memory of an outer flow of this family.
    fn turn(&self, outer: &mut Self::Outer, radians: f64);

    /// The equations of a flow on a layout of stations with trips at the given arc lengths.
    fn equations<'a>(
        &'a self,
        outer: &'a Self::Outer,
        layout: &'a Layout,
        trips: [Option<f64>; 2],
    ) -> Self::Equations<'a>;

    /// The equations of a flow on a layout of stations with transition held at the given arc lengths, whatever the
    /// amplification there.
    fn held<'a>(&'a self, outer: &'a Self::Outer, layout: &'a Layout, places: [f64; 2]) -> Self::Equations<'a>;
}

/// Usual number of iterations without progress after which an attempt is given up.
const PATIENCE: usize = 12;

/// The limits of one attempt.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Effort {
    /// Largest residual of a converged solution.
    pub tolerance: f64,
    /// Largest number of Newton iterations.
    pub iterations: usize,
    /// Iterations without progress after which the attempt is given up.
    pub patience: usize,
    /// Longest move of transition in the first step, in lengths of its side. The attempt is given up at once where
    /// transition would move farther.
    pub reach: f64,
    /// Share of a step below which the attempt is given up where a step must be shortened to it.
    pub shortest: f64,
}

impl Effort {
    /// Limits with the usual patience, without a limit on the first move of transition and on how short a step may be.
    pub fn new(tolerance: f64, iterations: usize) -> Self {
        Self { tolerance, iterations, patience: PATIENCE, reach: f64::INFINITY, shortest: 0.0 }
    }
}

/// The end of an attempt, with the state of the flow there.
#[derive(Debug, Clone)]
pub(crate) struct End<V> {
    /// Unknowns at the end of the attempt.
    pub unknowns: Unknowns,
    /// The state at `unknowns`.
    pub state: V,
    /// Largest magnitude of any residual.
    pub residual: f64,
    /// Number of Newton iterations.
    pub iterations: usize,
    /// Whether the residual is below the tolerance.
    pub converged: bool,
}
