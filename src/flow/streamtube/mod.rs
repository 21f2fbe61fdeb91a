//! The streamtube solver: transonic flow with shocks, coupled with the boundary layer.
//!
//! The Euler equations are solved in streamtubes (Giles & Drela, AIAA Journal 25, 1987) whose lines are unknowns, at the
//! same time as the integral boundary layers, whose displacement moves the lines. Mass flow and total enthalpy of every
//! tube are exact, and subsonic flow has no losses.
//!
//! [`grading`] says how many stations, lines and tubes there are and where they stand, [`numbering`] which unknowns they
//! have. [`section_curve`] is the section over any scalar, [`background`] the grid as an explicit function of the section
//! and the stagnation point, [`geometry`] the nodes after displacement and [`moves`] the derivatives of these with respect
//! to the unknowns. Equations are sums of local terms ([`kernel`]): the momentum of a tube about a station ([`cell`], read by way
//! of [`tubes`]), the
//! [`far_field`] and the boundary layer ([`layer_kernels`], which call the equations of the
//! [`layer`](super::layer)); [`equations`] lists them all, and [`outputs`] those of forces. [`system`] evaluates and
//! linearises them, [`band`] solves the linear system by [`block`]s, their [`dense`] parts, [`strips`] of columns and
//! [`rows`], [`newton`] iterates within [`limits`], with factors that are kept by [`chords`], [`guess`] says where a flow may
//! begin, [`start`] leads from nothing to it, and [`finer`] from a coarse grid to the one that is wanted. [`adjoint`] differentiates a solution by the [`transposed`] system, whose
//! derivatives stand in [`local`] term by term, with the factors that [`kept`] holds. [`solver`] is the door, [`record`]
//! what a solution keeps, [`status`] says whether
//! it holds. [`gas`] and [`settings`] hold numbers.
//!
//! This module depends on the [`layer`](super::layer) and, for the frame of a section and the first guess, on the
//! [`panel`](super::panel) solver.

mod adjoint;
mod background;
mod band;
#[cfg(test)]
mod band_tests;
mod block;
mod cell;
mod chords;
mod dense;
mod equations;
mod far_field;
mod finer;
mod follow;
mod gas;
mod geometry;
mod grading;
mod guess;
mod kept;
mod kernel;
mod layer_kernels;
mod limits;
mod local;
mod moves;
mod newton;
mod numbering;
mod outputs;
mod record;
mod refine;
mod rows;
mod section_curve;
mod settings;
mod solver;
mod start;
#[cfg(test)]
mod start_tests;
mod status;
mod strips;
mod system;
#[cfg(test)]
mod tests;
mod transposed;
mod tubes;

pub use settings::StreamtubeSettings;
pub use solver::StreamtubeSolver;
