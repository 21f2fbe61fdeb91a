//! From a start to a converged flow: Newton's method, and other ways where the direct one fails.
//!
//! [`Equations`] is the interface through which Newton's method ([`newton`], with [`chord`] near the solution) sees a
//! flow: residuals, their linearisation, solutions of the linearised system. [`Family`] gives such equations at
//! neighbouring conditions and on other numbers of stations. Where Newton's method goes astray, transition is [`held`] in
//! place and moved between flows that are easier to find. The [`ladder`] tries these, cheapest first, and follows
//! [branches](branch) of solutions from [neighbours](neighbour) where the flow is easier to find, within a [`budget`].
//!
//! This module depends on the [`layer`](super::layer), whose stations it moves, and knows no outer flow.

mod branch;
mod budget;
mod chord;
mod family;
mod held;
mod ladder;
mod neighbour;
pub(crate) mod newton;
#[cfg(test)]
mod tests;

pub(crate) use family::{Effort, End, Equations, Family, Residuals};
pub(crate) use held::{Start, by_held_transition};
pub(crate) use ladder::climb;
