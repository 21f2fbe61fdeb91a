//! Optimisers, what they report, and how a run is recorded and resumed.
//!
//! * [`Lbfgs`]: limited-memory BFGS on [`argmin`], for problems without constraints; first derivatives only;
//! * [`Newton`]: trust-region Newton with the exact Hessian; the fewest evaluations where second derivatives exist;
//! * [`GaussNewton`]: Levenberg-Marquardt within bounds, for objectives that are sums of squares, such as the match of a
//!   shape;
//! * [`Slsqp`]: sequential least-squares programming on [`basin`], for problems with constraints; first derivatives
//!   only;
//! * [`Sqp`]: sequential quadratic programming in a trust region, for problems with constraints: the fewest evaluations;
//! * [`Method`]: any of them behind one type, as a case file names it;
//! * [`Bounded`]: bounds on variables by a smooth change of variables, which the first two use by themselves;
//! * [`ArgminProblem`]: a problem for the solvers of `argmin`, with its bounds;
//! * [`Journaled`], [`Checkpoint`]: every evaluation recorded, so that a killed run resumes bit for bit;
//! * [`History`]: a row per evaluation, as CSV.
//!
//! An optimiser sees a [`Problem`](crate::design::Problem) and nothing else. It calls an observer after every
//! evaluation; the observer can end the run. The best point so far is always kept and returned, whatever ends the run,
//! and the reason is a sentence.
//!
//! ```
//! use aeroform::design::{AnalysisFailure, Bounds, Evaluation, Problem, ProblemDescription};
//! use aeroform::optimize::{Lbfgs, Optimizer, Termination};
//! use std::ops::ControlFlow;
//!
//! struct Bowl(ProblemDescription);
//! impl Problem for Bowl {
//!     fn description(&self) -> &ProblemDescription { &self.0 }
//!     fn evaluate(&mut self, x: &[f64]) -> Result<Evaluation, AnalysisFailure> {
//!         Ok(Evaluation {
//!             objective: (x[0] - 1.0).powi(2) + 10.0 * x[1].powi(2),
//!             gradient: vec![2.0 * (x[0] - 1.0), 20.0 * x[1]],
//!             constraints: vec![], jacobian: vec![], values: vec![],
//!         })
//!     }
//!     fn hessian(&mut self, _: &[f64]) -> Option<Result<nalgebra::DMatrix<f64>, AnalysisFailure>> { None }
//! }
//!
//! let mut bowl = Bowl(ProblemDescription {
//!     variable_names: vec!["x".into(), "y".into()],
//!     start: vec![3.0, 1.0],
//!     variable_bounds: vec![Bounds::FREE; 2],
//!     ..ProblemDescription::default() // no constraints, no further values
//! });
//! let outcome = Lbfgs::default().minimize(&mut bowl, &mut |_| ControlFlow::Continue(())).unwrap();
//! assert_eq!(outcome.status, Termination::Converged);
//! assert!((outcome.x[0] - 1.0).abs() < 1e-6);
//! ```
//!
//! Constraints have their values and gradients in the evaluation, and their bounds in the description:
//!
//! ```
//! use aeroform::design::{AnalysisFailure, Bounds, Evaluation, Problem, ProblemDescription};
//! use aeroform::optimize::{Optimizer, Sqp, Termination};
//! use std::ops::ControlFlow;
//!
//! /// The point of the unit disc with x ≤ 0.8 that is closest to (2, 1).
//! struct InDisc(ProblemDescription);
//! impl Problem for InDisc {
//!     fn description(&self) -> &ProblemDescription { &self.0 }
//!     fn evaluate(&mut self, x: &[f64]) -> Result<Evaluation, AnalysisFailure> {
//!         Ok(Evaluation {
//!             objective: (x[0] - 2.0).powi(2) + (x[1] - 1.0).powi(2),
//!             gradient: vec![2.0 * (x[0] - 2.0), 2.0 * (x[1] - 1.0)],
//!             constraints: vec![x[0] * x[0] + x[1] * x[1]],
//!             jacobian: vec![vec![2.0 * x[0], 2.0 * x[1]]],
//!             values: vec![],
//!         })
//!     }
//!     fn hessian(&mut self, _: &[f64]) -> Option<Result<nalgebra::DMatrix<f64>, AnalysisFailure>> { None }
//! }
//!
//! let mut problem = InDisc(ProblemDescription {
//!     variable_names: vec!["x".into(), "y".into()],
//!     start: vec![0.1, 0.1],
//!     variable_bounds: vec![Bounds { lower: f64::NEG_INFINITY, upper: 0.8 }, Bounds::FREE],
//!     constraint_names: vec!["squared radius".into()],
//!     constraint_bounds: vec![Bounds { lower: f64::NEG_INFINITY, upper: 1.0 }],
//!     ..ProblemDescription::default()
//! });
//! let outcome = Sqp::default().minimize(&mut problem, &mut |_| ControlFlow::Continue(())).unwrap();
//! assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
//! assert!((outcome.x[0] - 0.8).abs() < 1e-4 && (outcome.x[1] - 0.6).abs() < 1e-4, "{:?}", outcome.x);
//! ```
//!
//! This module depends on [`design::Problem`](crate::design::Problem), `argmin`, `basin`, `nalgebra` and `serde`.

mod argmin_problem;
pub(crate) mod atomic;
mod bounded;
mod box_quadratic;
mod checkpoint;
#[cfg(test)]
mod constrained_tests;
mod constraint_row;
mod cubic;
mod dense;
mod engineering;
mod gauss_newton;
mod history;
mod identity;
#[cfg(feature = "interior-point")]
mod interior_point;
mod journal;
mod journaled;
mod kkt;
mod lbfgs;
mod ledger;
pub(crate) mod limited;
mod method;
mod newton;
mod optimizer;
mod outcome;
mod redundancy;
mod scope;
mod settings;
mod slsqp;
mod sqp;
#[cfg(test)]
mod testcases;
mod trend;
mod trust_region;
mod vector;
mod verdict;
mod watch;

pub use argmin_problem::ArgminProblem;
pub use bounded::Bounded;
pub use checkpoint::{Checkpoint, CheckpointError};
pub use engineering::engineering;
pub use gauss_newton::GaussNewton;
pub use history::{History, HistoryRow};
pub use identity::Identity;
#[cfg(feature = "interior-point")]
pub use interior_point::InteriorPoint;
pub use journal::{Answer, Journal, Record};
pub use journaled::Journaled;
pub(crate) use kkt::REACHED;
pub use lbfgs::Lbfgs;
pub use method::Method;
pub use newton::Newton;
pub use optimizer::{Limits, Optimizer};
pub use outcome::{OptimizeError, Outcome, Progress, Termination, projected_gradient};
pub use slsqp::Slsqp;
pub use sqp::Sqp;
