//! Problems of the crate for the solvers of `argmin`.

use super::bounded::Bounded;
use super::outcome::{OptimizeError, check, refuse_constraints};
use crate::design::{AnalysisFailure, Evaluation, Problem};
use argmin::core::{CostFunction, Error, Gradient, Hessian};
use std::cell::{Cell, RefCell};

/// A [`Problem`] as `argmin` sees one: [`CostFunction`], [`Gradient`] and [`Hessian`] on `Vec<f64>`, so that every solver
/// of [`argmin`] runs on it.
///
/// Bounds on variables are met by the change of variables of [`Bounded`]: the solver works on free variables, from
/// [`start`](Self::start), and [`design_variables`](Self::design_variables) turns its result into variables of the problem.
/// Cost and gradient at one point share one evaluation. An analysis that fails is an infinite cost, from which line
/// searches step back; where a gradient is asked for there, it is an error that ends the run.
///
/// Parameters are `Vec<f64>` and Hessians `Vec<Vec<f64>>`, for which `argmin-math` needs its feature `vec`. Version 0.5
/// of `argmin-math` knows `nalgebra` up to version 0.34 only, and this crate uses 0.35: solvers that need to invert a
/// matrix, as `argmin`'s own Newton method does, are therefore out of reach of this adapter, while those that multiply by
/// one (trust regions with the Cauchy point, Steihaug's method, Newton by conjugate gradients) run.
///
/// ```
/// use aeroform::design::{AnalysisFailure, Bounds, Evaluation, Problem, ProblemDescription};
/// use aeroform::optimize::ArgminProblem;
/// use argmin::core::{Executor, State};
/// use argmin::solver::{linesearch::MoreThuenteLineSearch, quasinewton::LBFGS};
///
/// /// Rosenbrock's valley, with x0 at most 0.5.
/// struct Valley(ProblemDescription);
/// impl Problem for Valley {
///     fn description(&self) -> &ProblemDescription { &self.0 }
///     fn evaluate(&mut self, x: &[f64]) -> Result<Evaluation, AnalysisFailure> {
///         let (a, b) = (1.0 - x[0], x[1] - x[0] * x[0]);
///         Ok(Evaluation {
///             objective: a * a + 100.0 * b * b,
///             gradient: vec![-2.0 * a - 400.0 * x[0] * b, 200.0 * b],
///             constraints: vec![], jacobian: vec![], values: vec![],
///         })
///     }
///     fn hessian(&mut self, _: &[f64]) -> Option<Result<nalgebra::DMatrix<f64>, AnalysisFailure>> { None }
/// }
///
/// let problem = ArgminProblem::new(Valley(ProblemDescription {
///     variable_names: vec!["x0".into(), "x1".into()],
///     start: vec![-1.2, 1.0],
///     variable_bounds: vec![Bounds { lower: f64::NEG_INFINITY, upper: 0.5 }, Bounds::FREE],
///     ..ProblemDescription::default()
/// }))?;
/// let solver = LBFGS::new(MoreThuenteLineSearch::new(), 7).with_tolerance_grad(1e-8)?;
/// let result = Executor::new(&problem, solver)
///     .configure(|state| state.param(problem.start()).max_iters(200))
///     .run()?;
/// let best = result.state().get_best_param().ok_or("no step")?;
/// let x = problem.design_variables(best);
/// assert!((x[0] - 0.5).abs() < 1e-6 && (x[1] - 0.25).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct ArgminProblem<P> {
    problem: RefCell<Bounded<P>>,
    /// The last point and what was found there.
    last: RefCell<Option<Known>>,
    evaluations: Cell<usize>,
}

/// A point with what was found there.
type Known = (Vec<f64>, Result<Evaluation, AnalysisFailure>);

impl<P: Problem> ArgminProblem<P> {
    /// Wraps a problem without constraints; bounds on its variables are taken.
    ///
    /// # Errors
    /// [`OptimizeError::ConstraintsNotSupported`], and those of descriptions whose lists do not fit together.
    pub fn new(problem: P) -> Result<Self, OptimizeError> {
        check(&problem)?;
        refuse_constraints(&problem, "argmin")?;
        let problem = RefCell::new(Bounded::new(problem));
        Ok(Self { problem, last: RefCell::default(), evaluations: Cell::new(0) })
    }

    /// The start in the variables of the solver (length n).
    pub fn start(&self) -> Vec<f64> {
        self.problem.borrow().description().start.clone()
    }

    /// The variables of the problem (length n) for variables of the solver (length n).
    pub fn design_variables(&self, parameters: &[f64]) -> Vec<f64> {
        self.problem.borrow().unwrap_point(parameters)
    }

    /// Number of evaluations of the problem so far.
    pub fn evaluations(&self) -> usize {
        self.evaluations.get()
    }

    /// The problem, out of its wrapping.
    pub fn into_inner(self) -> P {
        self.problem.into_inner().into_inner()
    }

    /// The evaluation at a point; a point asked for again is not evaluated again.
    fn at<T>(&self, x: &[f64], part: impl FnOnce(&Result<Evaluation, AnalysisFailure>) -> T) -> T {
        let mut last = self.last.borrow_mut();
        if let Some((known, result)) = &*last
            && known == x
        {
            return part(result);
        }
        self.evaluations.set(self.evaluations.get() + 1);
        let result = self.problem.borrow_mut().evaluate(x);
        let wanted = part(&result);
        *last = Some((x.to_vec(), result));
        wanted
    }
}

impl<P: Problem> CostFunction for &ArgminProblem<P> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, x: &Vec<f64>) -> Result<f64, Error> {
        Ok(self.at(x, |result| result.as_ref().map_or(f64::INFINITY, |evaluation| evaluation.objective)))
    }
}

impl<P: Problem> Gradient for &ArgminProblem<P> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, x: &Vec<f64>) -> Result<Vec<f64>, Error> {
        let gradient = |result: &Result<Evaluation, AnalysisFailure>| match result {
            Ok(evaluation) => Ok(evaluation.gradient.clone()),
            Err(failure) => Err(failure.clone()),
        };
        Ok(self.at(x, gradient)?)
    }
}

impl<P: Problem> Hessian for &ArgminProblem<P> {
    type Param = Vec<f64>;
    type Hessian = Vec<Vec<f64>>;

    fn hessian(&self, x: &Vec<f64>) -> Result<Vec<Vec<f64>>, Error> {
        let hessian = self.problem.borrow_mut().hessian(x).ok_or(OptimizeError::NoHessian { method: "argmin" })??;
        Ok(hessian.row_iter().map(|row| row.iter().copied().collect()).collect())
    }
}

/// An owned adapter, for an executor that keeps it.
impl<P: Problem> CostFunction for ArgminProblem<P> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, x: &Vec<f64>) -> Result<f64, Error> {
        (&self).cost(x)
    }
}

impl<P: Problem> Gradient for ArgminProblem<P> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, x: &Vec<f64>) -> Result<Vec<f64>, Error> {
        (&self).gradient(x)
    }
}

impl<P: Problem> Hessian for ArgminProblem<P> {
    type Param = Vec<f64>;
    type Hessian = Vec<Vec<f64>>;

    fn hessian(&self, x: &Vec<f64>) -> Result<Vec<Vec<f64>>, Error> {
        (&self).hessian(x)
    }
}

#[cfg(test)]
mod tests {
    use super::super::testcases::{Constrained, quadratic, rosenbrock, shape_match};
    use super::*;
    use crate::differentiate::VectorFunction;
    use crate::scalar::Scalar;
    use approx::assert_relative_eq;
    use argmin::core::{Executor, State};
    use argmin::solver::linesearch::MoreThuenteLineSearch;
    use argmin::solver::quasinewton::LBFGS;
    use argmin::solver::trustregion::{Steihaug, TrustRegion};
    use std::convert::Infallible;

    /// x0 + x1 on the unit circle.
    struct Circle;
    impl VectorFunction for Circle {
        type Error = Infallible;
        fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, Infallible> {
            Ok(vec![x[0] + x[1], x[0] * x[0] + x[1] * x[1]])
        }
    }

    #[test]
    fn second_derivatives_reach_trust_regions() {
        let problem = ArgminProblem::new(rosenbrock(2)).unwrap();
        let solver = TrustRegion::new(Steihaug::new().with_max_iters(20));
        let result = Executor::new(&problem, solver)
            .configure(|state| state.param(problem.start()).max_iters(100))
            .run()
            .unwrap();
        let best = problem.design_variables(result.state().get_best_param().unwrap());
        best.iter().for_each(|&x| assert_relative_eq!(x, 1.0, epsilon = 1e-6));
    }

    #[test]
    fn an_owned_adapter_runs_and_bounds_hold() {
        let problem = ArgminProblem::new(shape_match().bounded(-0.2, 0.2)).unwrap();
        let start = problem.start();
        let solver = LBFGS::new(MoreThuenteLineSearch::new(), 10).with_tolerance_grad(1e-10).unwrap();
        let result = Executor::new(problem, solver).configure(|state| state.param(start).max_iters(500)).run().unwrap();
        let best = result.state().get_best_param().unwrap().clone();
        let problem = result.problem.problem.unwrap();
        assert!(problem.design_variables(&best).iter().all(|x| x.abs() <= 0.2));
        let evaluations = problem.evaluations();
        assert_eq!(problem.into_inner().asked.len(), evaluations);
    }

    #[test]
    fn failures_and_constraints() {
        let problem = ArgminProblem::new(quadratic(2, 1.0, 1.0, 0.0).failing(|x| x[0] > 5.0)).unwrap();
        assert_eq!(problem.cost(&vec![6.0, 0.0]).unwrap(), f64::INFINITY);
        assert!(problem.gradient(&vec![6.0, 0.0]).is_err());
        assert_eq!(problem.evaluations(), 1);
        let error = ArgminProblem::new(Constrained::new(Circle, &[1.0, 0.0], &[(1.0, 1.0)])).map(|_| ()).unwrap_err();
        assert!(matches!(error, OptimizeError::ConstraintsNotSupported { .. }), "{error}");
    }
}
