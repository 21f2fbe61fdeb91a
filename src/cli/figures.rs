//! The figures of the command: what is drawn, in the manner of the paper's Figs. 14 and 15.

use crate::design::{DesignProblem, Shape};
use crate::optimize::History;
use crate::report::figures::{
    ConvergenceFigure, FigureError, SectionCurve, SectionFigure, Stroke, convergence_figure, section_figure,
};
use crate::section::Section;

/// Points drawn of a section, enough for the eye at the nose.
const SECTION_POINTS: usize = 801;
/// Points drawn of a line of the box.
const LINE_POINTS: usize = 61;

/// A section alone.
pub(super) fn section(section: &Section<f64>) -> Result<String, FigureError> {
    section_figure(&SectionFigure {
        title: section.name().to_string(),
        curves: vec![outline(section.name(), section, Stroke::SECTION)],
        lattice: Vec::new(),
        control_points: Vec::new(),
    })
}

/// A design: section, undeformed section, target, the lines of the box and its control points.
pub(super) fn design(problem: &DesignProblem, shape: &Shape, title: &str) -> Result<String, FigureError> {
    let mut curves = vec![outline("section", &shape.section, Stroke::SECTION)];
    if let Some(target) = problem.target() {
        curves.push(outline("target", target, Stroke::TARGET));
    } else if shape.section.curve() != problem.geometry().section().curve() {
        curves.push(outline("undeformed", problem.geometry().section(), Stroke::INITIAL));
    }
    section_figure(&SectionFigure {
        title: title.to_string(),
        curves,
        lattice: lattice_lines(problem, shape),
        control_points: shape.net.clone(),
    })
}

/// Objective and constraint violation over the evaluations.
pub(super) fn convergence(history: &History, title: &str) -> Result<String, FigureError> {
    let violations = history.violations();
    convergence_figure(&ConvergenceFigure {
        title: title.to_string(),
        objectives: history.objectives(),
        violations: violations.iter().any(|v| *v > 0.0).then_some(violations),
    })
}

fn outline(label: &str, section: &Section<f64>, stroke: Stroke) -> SectionCurve {
    let mut points = section.points(SECTION_POINTS);
    // the base of a blunt trailing edge
    points.extend(points.first().copied());
    SectionCurve { label: label.to_string(), points, stroke }
}

/// Lines of constant parameter of the deformed box, as many as control points in each direction.
fn lattice_lines(problem: &DesignProblem, shape: &Shape) -> Vec<Vec<[f64; 2]>> {
    let Some(undeformed) = problem.geometry().lattice() else { return Vec::new() };
    let Ok(lattice) = undeformed.with_control_points(shape.net.clone()) else { return Vec::new() };
    let counts = lattice.counts();
    let mut lines = Vec::new();
    for axis in 0..2 {
        for line in 0..counts[axis] {
            let fixed = line as f64 / (counts[axis] - 1) as f64;
            let point = |i: usize| {
                let running = i as f64 / (LINE_POINTS - 1) as f64;
                lattice.evaluate(if axis == 0 { [fixed, running] } else { [running, fixed] })
            };
            lines.push((0..LINE_POINTS).map(point).collect());
        }
    }
    lines
}
