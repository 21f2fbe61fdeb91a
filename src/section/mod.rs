//! Airfoil sections: NACA, Kulfan and coordinate files as one closed B-spline curve, and what is measured on them.
//!
//! A [`SectionDefinition`] names how a section is made and lists its build parameters; it builds a [`Section`] over any
//! [`Scalar`](crate::scalar::Scalar), exact in those parameters. [`Measure`] names the quantities that objectives and
//! constraints are made of.
//!
//! This module depends on [`scalar`](crate::scalar), [`differentiate`](crate::differentiate) and
//! [`spline`](crate::spline).

mod coordinates;
mod curve;
mod definition;
mod error;
mod kulfan;
mod measures;
mod naca;
mod naca5;
mod selig;
mod stations;

pub use coordinates::{Coordinates, Deviation, Repair};
pub use curve::{Section, TrailingEdge};
pub use definition::SectionDefinition;
pub use error::{CoordinateError, KeyProblem, MeasureProblem, SectionError};
pub use kulfan::{Kulfan, KulfanFit, fit_kulfan};
pub use measures::{ChordFrame, Crossing, Measure, SecondMoments};
pub use naca::Naca4;
pub use naca5::Naca5;
pub use selig::{Digits, SeligFormat};
