//! Automatic-differentiation-first aerodynamic shape design.

pub mod differentiate;
pub mod scalar;
pub mod spline;

pub mod section;

pub mod ffd;

pub mod flow;

pub mod design;

pub mod optimize;

pub mod cad;

pub mod report;

#[cfg(feature = "command")]
pub mod cli;
