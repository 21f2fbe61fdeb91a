//! Automatic-differentiation-first aerodynamic shape design.
//!
//! A parametric section (NACA, Kulfan, coordinates) becomes an exact B-spline; a free-form deformation (FFD) box around
//! it moves the control points of that spline; an optimiser moves the box. Every geometric routine is generic over
//! [`Scalar`](scalar::Scalar), so that every number has its exact derivative:
//!
//! **design variables → section → FFD box → deformed section → quantities → objective and constraints → optimiser**
//!
//! ```
//! use aeroform::ffd::{FfdBox, Placement};
//! use aeroform::section::SectionDefinition;
//! use num_dual::Dual64;
//!
//! // a NACA 2412 that knows how it changes with its thickness
//! let definition = SectionDefinition::parse("naca2412:sharp")?;
//! let thickness = Dual64::new(0.12, 1.0);
//! let section = definition.build(&[thickness, 0.02.into(), 0.4.into()])?;
//! let area = section.area();
//! assert!((area.re - 0.0817).abs() < 3e-4 && (area.eps - 0.681).abs() < 3e-3);
//!
//! // a 4 × 4 cubic box around it; its rear upper corner goes up
//! let lattice = FfdBox::rectangular([[-0.1, 1.1], [-0.15, 0.15]], [4, 4], [3, 3], Placement::Even)?;
//! let section = definition.section()?;
//! let points = section.curve().control_points();
//! let mut displacements = vec![[0.0; 2]; 16];
//! displacements[15] = [0.0, 0.05];
//! let deformed = section.with_control_points(lattice.embed(points)?.deform(points, &displacements)?)?;
//! assert!(deformed.area() > section.area());
//! let step = aeroform::cad::step(deformed.curve(), "deformed section")?; // opens in CAD
//! # assert!(step.starts_with("ISO-10303-21;"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Newcomers read the [`guide`]: the [architecture](guide::architecture) with the picture of who may import whom, the
//! [equations of the flow solver](guide::flow), [which files to touch](guide::recipes) to change or add a thing, and
//! [what moved](guide::changes). Programs to start from stand in `validation/examples/`.
//!
//! Modules stand in the order in which data flows; a module uses those above it, never those below. A whole problem
//! comes from a case file: see [`case::Case`]. The command `aeroform` is the module `cli` (feature `command`, on by
//! default); figures have a feature of their own, `figures`.

pub mod guide;

pub mod differentiate;
pub mod scalar;

mod plane;

pub mod spline;

pub mod section;

pub mod ffd;

pub mod flow;

pub mod design;

pub mod optimize;

pub mod case;

pub mod cad;

pub mod report;

#[cfg(feature = "command")]
pub mod cli;

/// The README's example, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
