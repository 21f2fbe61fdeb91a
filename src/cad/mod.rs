//! Exchange files for CAD: planar section curves as STEP, IGES and DXF.
//!
//! The exact B-spline is written, not points on it: degree, knots with their multiplicities and control points, every
//! number with as many digits as identify its `f64`. No coordinate is scaled: [`Options`] say which unit they are in,
//! the metre unless told otherwise, so that a section of unit chord is one metre long; scale the control points first
//! for another size.
//!
//! A curve whose ends are apart (a blunt trailing edge) gets a straight closing segment, from the last point to the
//! first, as a second entity; one whose ends coincide within [`RESOLUTION`] is marked closed. [`Options`] can leave
//! the gap open, ask for a planar face inside of the outline (STEP), and set the time stamp, which is a constant unless
//! set: the same curve gives the same file.
//!
//! ```
//! use aeroform::spline::{BSplineCurve, KnotVector};
//! let knots = KnotVector::clamped_uniform(3, 5).unwrap();
//! let points = vec![[1.0, 0.001], [0.3, 0.2], [-0.1, 0.0], [0.3, -0.1], [1.0, -0.001]];
//! let section = BSplineCurve::new(knots, points).unwrap();
//! let step = aeroform::cad::step(&section, "my section").unwrap();
//! assert!(step.contains("B_SPLINE_CURVE_WITH_KNOTS('my section',3,"));
//! let iges = aeroform::cad::iges(&section, "my section").unwrap();
//! let dxf = aeroform::cad::dxf(&section, "my section").unwrap();
//! assert!(iges.lines().all(|line| line.len() == 80) && dxf.contains("AcDbSpline"));
//! ```
//!
//! This module depends on [`spline`](crate::spline) only.

mod drawing;
mod dxf;
mod iges;
mod step;
mod unit;

pub use drawing::{CadError, Options, RESOLUTION, TimeStamp};
pub use dxf::{dxf, dxf_with};
pub use iges::{iges, iges_with};
pub use step::{step, step_with};
pub use unit::LengthUnit;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spline::{BSplineCurve, KnotVector};

    #[test]
    fn other_dimensions_and_bad_names_are_refused() {
        let knots = KnotVector::clamped_uniform(1, 2).unwrap();
        let number = BSplineCurve::new(knots.clone(), vec![[0.0], [1.0]]).unwrap();
        assert_eq!(step(&number, "x").unwrap_err(), CadError::Dimensions { dimensions: 1 });
        let line = BSplineCurve::new(knots, vec![[0.0, 0.0], [1.0, 0.0]]).unwrap();
        assert_eq!(step(&line, "a\nb").unwrap_err(), CadError::Name { index: 1, character: '\n' });
        assert_eq!(iges(&line, "é").unwrap_err(), CadError::Name { index: 0, character: 'é' });
        assert_eq!(dxf(&line, "é").unwrap_err(), CadError::Name { index: 0, character: 'é' });
        assert!(step(&line, "é").is_ok());
    }
}
