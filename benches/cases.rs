//! The cases the benches run: the paper's shape match with finer boxes.

use aeroform::case::Case;
use std::path::Path;

/// The text of the shape match NACA 0012 to NACA 8416 with a cubic box of `n` × `n` control points: 2 n² variables.
pub fn shape_match(n: usize, method: &str) -> String {
    format!(
        "name = \"bench-{n}x{n}\"\n\
         [section]\nnaca = \"0012\"\ntrailing_edge = \"sharp\"\ncontrol_points = 101\n\
         [target]\nnaca = \"8416\"\ntrailing_edge = \"sharp\"\ncontrol_points = 101\n\
         [box]\nx = [-0.1, 1.1]\ny = [-0.15, 0.15]\ncontrol_points = [{n}, {n}]\ndegree = [3, 3]\n\
         [variables]\nfree = \"all\"\n\
         [objective]\nminimize = {{ shape_error = 1.0, fold_penalty = 1.0 }}\n\
         [optimizer]\nmethod = \"{method}\"\nmax_evaluations = 1000\n"
    )
}

/// The case of [`shape_match`].
pub fn open(n: usize, method: &str) -> Case {
    Case::parse("bench", &shape_match(n, method), Path::new("")).expect("the text above is a case")
}

/// A fixed shake of the start, so that nothing is evaluated where all displacements are zero.
pub fn shaken(start: &[f64]) -> Vec<f64> {
    start.iter().enumerate().map(|(k, x)| x + 0.05 * (12.9898 * (k + 1) as f64).sin()).collect()
}
