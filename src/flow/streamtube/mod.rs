//! The streamtube solver: transonic flow with shocks, coupled with the boundary layer.

#![allow(dead_code)]

mod adjoint;
mod background;
mod band;
mod cell;
mod equations;
mod far_field;
mod gas;
mod geometry;
mod grading;
mod kernel;
mod layer_kernels;
mod moves;
mod newton;
mod numbering;
mod outputs;
mod section_curve;
mod solver;
mod start;
mod system;

pub use solver::probe;
