//! The guide: what a newcomer reads first.
//!
//! * [`architecture`]: the crate on one page, with the picture of who may import whom;
//! * [`flow`]: the flow solver as formulas, with the names of the fields beside the symbols;
//! * [`transonic`]: the solver for flows with shocks, its equations, range and limits;
//! * [`recipes`]: to change the transition condition, add a closure, an unknown, an output, a constraint, a solver:
//!   which files to touch;
//! * [`changes`]: what moved, and how to follow.
//!
//! Programs to start from stand in `validation/examples/`; `cargo run --example NAME` runs one:
//!
//! * `own_objective`: an objective of your own, minimised through [`Problem`](crate::design::Problem);
//! * `flow_gradients`: the flow at one operating point and its derivatives, compared with shapes that have really
//!   moved;
//! * `dual_section`: a section over dual numbers;
//! * `argmin_solver`: a solver of `argmin` on a design problem of the crate.
//!
//! Formulas are MathML, which browsers show without any script. The annotation of each holds it in TeX, from which a
//! converter makes the MathML anew.

#[doc = include_str!("architecture.md")]
pub mod architecture {}

#[doc = include_str!("changes.md")]
pub mod changes {}

#[doc = include_str!("flow.md")]
pub mod flow {}

#[doc = include_str!("recipes.md")]
pub mod recipes {}

#[doc = include_str!("transonic.md")]
pub mod transonic {}
