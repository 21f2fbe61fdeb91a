//! A section over dual numbers: every measure of it comes with its derivatives.
//!
//! The NACA 2412 is built from dual numbers for its thickness and camber. First derivatives of all measures come from
//! one build; second ones need another kind of number and no other code. A free-form deformation box carries them
//! further.
//!
//! `cargo run --example dual_section`

use aeroform::ffd::{FfdBox, Placement};
use aeroform::scalar::Scalar;
use aeroform::section::{Measure, Section, SectionDefinition, SectionError};
use num_dual::{Dual2_64, DualSVec64};
use std::error::Error;

/// Thickness and camber in chords; the place of the largest camber is 0.4.
const THICKNESS: f64 = 0.12;
const CAMBER: f64 = 0.02;

/// A NACA four-digit section of any number.
fn naca<S: Scalar>(thickness: S, camber: S) -> Result<Section<S>, SectionError> {
    SectionDefinition::parse("naca2412:sharp")?.build(&[thickness, camber, S::from(0.4)])
}

/// The section with the rear upper corner of a 4 × 4 box around it lifted.
fn lifted<S: Scalar>(section: &Section<S>, height: f64) -> Result<Section<S>, Box<dyn Error>> {
    let lattice = FfdBox::rectangular(
        [[-0.1, 1.1], [-0.15, 0.15]].map(|side| side.map(S::from)),
        [4, 4],
        [3, 3],
        Placement::Even,
    )?;
    let mut displacements = vec![[S::from(0.0); 2]; 16];
    displacements[15] = [S::from(0.0), S::from(height)];
    let points = section.curve().control_points();
    Ok(section.with_control_points(lattice.embed(points)?.deform(points, &displacements)?)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    // one number with two derivative parts: by the thickness and by the camber
    type Pair = DualSVec64<2>;
    let (thickness, camber) = (Pair::from(THICKNESS).derivative(0), Pair::from(CAMBER).derivative(1));
    let section = naca(thickness, camber)?;
    let deformed = lifted(&section, 0.05)?;

    println!("NACA 2412, and deformed by a box; derivatives by thickness and by camber\n");
    println!(
        "measure                    value  by thickness     by camber     |  deformed  by thickness     by camber"
    );
    for name in ["area", "thickness", "thickness_x", "camber", "nose_radius", "thickness_at(0.8)", "perimeter"] {
        let measure = Measure::parse(name)?;
        print!("{name:<20}");
        for (section, end) in [(&section, "     |"), (&deformed, "\n")] {
            let value = measure.evaluate(section)?;
            let [by_thickness, by_camber] = [0, 1].map(|k| value.eps.0.map_or(0.0, |eps| eps[k]));
            print!(" {:10.6}  {by_thickness:12.6}  {by_camber:12.6}{end}", value.re);
        }
    }

    // a number with a second derivative
    let curvature = naca(Dual2_64::from(THICKNESS).derivative(), Dual2_64::from(CAMBER))?;
    let radius = Measure::parse("nose_radius")?.evaluate(&curvature)?;
    println!(
        "\nNose radius as a function of thickness: r = {:.6}, r' = {:.6}, r'' = {:.6}",
        radius.re, radius.v1, radius.v2
    );
    println!(
        "(r grows with the square of the thickness t: 2 r / t = {:.6}, 2 r / t² = {:.6})",
        2.0 * radius.re / THICKNESS,
        2.0 * radius.re / THICKNESS.powi(2)
    );
    Ok(())
}
