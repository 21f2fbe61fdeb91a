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
mod record;
mod section_curve;
mod settings;
mod solver;
mod start;
mod status;
mod system;

pub use settings::StreamtubeSettings;
pub use solver::StreamtubeSolver;
