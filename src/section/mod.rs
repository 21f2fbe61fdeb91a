//! Airfoil sections: NACA, Kulfan, coordinate files, and what is measured on them.

mod curve;
mod definition;
mod error;
mod kulfan;
mod naca;
mod naca5;
mod stations;

pub use curve::{Section, TrailingEdge};
pub use definition::SectionDefinition;
pub use error::{CoordinateError, KeyProblem, MeasureProblem, SectionError};
pub use kulfan::Kulfan;
pub use naca::Naca4;
pub use naca5::Naca5;
