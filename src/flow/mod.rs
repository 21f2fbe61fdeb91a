//! Viscous flow about a section: panels coupled with integral boundary layers, with exact derivatives.
//!
//! [`analyze`] takes the nodes of a section and a [`Condition`] and returns a [`Solution`]: coefficients, transition,
//! distributions and a [`Status`]. On request the solution gives the exact [`Gradients`] of the coefficients with
//! respect to every node, the angle of attack, and the Mach and Reynolds number. [`PanelledSection`] keeps the
//! factorised panel equations for several operating points. [`FlowSolver`] is the interface of every solver;
//! [`PanelSolver`] implements it.
//!
//! ```
//! use aeroform::flow::{Coefficients, Condition, Incidence, Settings, TrailingEdge, analyze};
//!
//! // NACA 0012 with its blunt edge, 121 nodes from the trailing edge over the upper surface and back
//! let nodes: Vec<[f64; 2]> = (0..121)
//!     .map(|i| {
//!         let x = 0.5 * (1.0 + (std::f64::consts::PI * i as f64 / 60.0).cos());
//!         let y = 0.6 * (0.2969 * f64::sqrt(x) - x * (0.1260 + x * (0.3516 - x * (0.2843 - x * 0.1015))));
//!         [x, if i <= 60 { y } else { -y }]
//!     })
//!     .collect();
//! let condition = Condition { trips: [Some(0.05); 2], ..Condition::new(Incidence::Alpha(4f64.to_radians()), 5e6) };
//! let solution = analyze(&nodes, TrailingEdge::Blunt, &condition, &Settings::default(), None)?;
//! assert!(solution.is_reliable());
//! let Coefficients { cl, cd, .. } = solution.coefficients;
//! assert!((cl - 0.457).abs() < 0.005 && (cd - 0.0085).abs() < 1e-4);
//! let gradients = solution.gradients().ok_or("not converged")?;
//! assert!((gradients.cl.alpha - 6.5).abs() < 0.2);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! To the solver a section is a list of points; [`panel_parameters`] chooses them on a
//! [`Section`](crate::section::Section). This module depends on [`section`](crate::section),
//! [`differentiate`](crate::differentiate) and [`scalar`](crate::scalar).

// sums over several parallel arrays read better with their common index
#![allow(clippy::needless_range_loop)]

mod choice;
mod coefficients;
mod condition;
mod duals;
mod elementary;
mod error;
mod field;

mod layer;
mod linear;
mod memory;
mod panel;
mod panelling;
mod resolution;
mod search;
mod solution;
mod solver;
mod streamtube;
mod surface;
#[cfg(test)]
pub(crate) mod testcases;
#[cfg(test)]
mod tests;

pub use crate::section::TrailingEdge;
pub use choice::SolverChoice;
pub(crate) use coefficients::COEFFICIENTS;
pub use coefficients::{Coefficients, Derivatives, Gradients};
pub(crate) use condition::STATIONS_PER_SIDE;
pub use condition::{Condition, Incidence, Settings};
pub use error::FlowError;
pub use field::{FieldBlock, FlowField};
pub use panel::{InviscidSolution, PanelSolver, PanelledSection, analyze};
pub use panelling::panel_parameters;
pub use resolution::DiscretisationError;
pub use solution::{Attempt, Distributions, HeldGradients, Solution, StationFlow, Status};
pub use solver::{FlowSection, FlowSolver};
pub use streamtube::{StreamtubeSettings, StreamtubeSolver};
