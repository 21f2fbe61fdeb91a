//! The figures of the command: what is drawn, in the manner of the paper's Figs. 14 and 15.

use crate::design::{DesignProblem, Shape};
use crate::flow::{InviscidSolution, Solution, StationFlow};
use crate::optimize::History;
use crate::report::figures::{
    Annotation, ConvergenceFigure, FigureError, LineFigure, SectionCurve, SectionFigure, Series, Stroke,
    convergence_figure, line_figure, section_figure,
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
        ..SectionFigure::default()
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

/// Pressure with and without boundary layer, transition marked.
pub(super) fn pressure(nodes: &[[f64; 2]], solution: &Solution, title: &str) -> Result<String, FigureError> {
    let distributions = solution.distributions();
    let line = |cp: &[f64]| nodes.iter().zip(cp).map(|(n, cp)| [n[0], *cp]).collect::<Vec<_>>();
    let mark = |k: usize, name: &str| Annotation {
        x: solution.coefficients.transition[k],
        label: format!("transition {name}"),
    };
    let lines = vec![
        series("viscous", line(&distributions.cp), Stroke::SECTION),
        series("inviscid", line(&distributions.cp_inviscid), Stroke::palette(0).dashed()),
    ];
    cp_figure(title, lines, vec![mark(0, "upper"), mark(1, "lower")])
}

/// Pressure at one operating point before and after a design run; either may be missing.
pub(super) fn pressure_change(
    before: Option<(&[[f64; 2]], &Solution)>,
    after: Option<(&[[f64; 2]], &Solution)>,
    title: &str,
) -> Result<String, FigureError> {
    let line = |name: &str, flow: Option<(&[[f64; 2]], &Solution)>, stroke: Stroke| {
        let (nodes, solution) = flow?;
        let cp = solution.distributions().cp;
        Some(series(name, nodes.iter().zip(&cp).map(|(n, cp)| [n[0], *cp]).collect(), stroke))
    };
    let lines = [line("start", before, Stroke::INITIAL), line("end", after, Stroke::SECTION)];
    cp_figure(title, lines.into_iter().flatten().collect(), Vec::new())
}

/// Pressure without boundary layer.
pub(super) fn inviscid_pressure(
    nodes: &[[f64; 2]],
    solution: &InviscidSolution,
    title: &str,
) -> Result<String, FigureError> {
    let points = nodes.iter().zip(&solution.cp).map(|(n, cp)| [n[0], *cp]).collect();
    cp_figure(title, vec![series("inviscid", points, Stroke::SECTION)], Vec::new())
}

/// Pressure coefficients over the chord, suction upwards.
fn cp_figure(title: &str, series: Vec<Series>, annotations: Vec<Annotation>) -> Result<String, FigureError> {
    let (x_label, y_label) = ("x/c".into(), "Cp".into());
    line_figure(&LineFigure {
        title: title.into(),
        x_label,
        y_label,
        series,
        inverted_y: true,
        annotations,
        log_y: false,
    })
}

/// The section with its displacement thickness.
pub(super) fn displacement(nodes: &[[f64; 2]], solution: &Solution, title: &str) -> Result<String, FigureError> {
    let distributions = solution.distributions();
    let edge = |side: &[StationFlow], sign: f64| -> Vec<[f64; 2]> {
        let offset = |k: usize| {
            let (a, b) = (&side[k.saturating_sub(1)], &side[(k + 1).min(side.len() - 1)]);
            let (dx, dy) = (b.x - a.x, b.y - a.y);
            let length = dx.hypot(dy).max(f64::MIN_POSITIVE);
            let thickness = sign * side[k].displacement_thickness / length;
            [side[k].x - dy * thickness, side[k].y + dx * thickness]
        };
        (0..side.len()).map(offset).collect()
    };
    let mut outline = nodes.to_vec();
    outline.extend(nodes.first());
    let stroke = Stroke::palette(0);
    section_figure(&SectionFigure {
        title: title.to_string(),
        curves: vec![
            SectionCurve { label: "section".into(), points: outline, stroke: Stroke::SECTION },
            SectionCurve { label: "displacement, upper".into(), points: edge(&distributions.upper, 1.0), stroke },
            SectionCurve {
                label: "displacement, lower".into(),
                points: edge(&distributions.lower, -1.0),
                stroke: Stroke::palette(1),
            },
        ],
        ..SectionFigure::default()
    })
}

/// Lift over drag coefficient.
pub(super) fn drag_polar(points: &[&Solution], title: &str) -> Result<String, FigureError> {
    sweep_figure(title, "CD", "CL", points.iter().map(|s| [s.coefficients.cd, s.coefficients.cl]).collect())
}

/// Lift coefficient over the angle of attack.
pub(super) fn lift_curve(points: &[&Solution], title: &str) -> Result<String, FigureError> {
    sweep_figure(
        title,
        "alpha, degrees",
        "CL",
        points.iter().map(|s| [s.alpha.to_degrees(), s.coefficients.cl]).collect(),
    )
}

fn sweep_figure(title: &str, x: &str, y: &str, points: Vec<[f64; 2]>) -> Result<String, FigureError> {
    line_figure(&LineFigure {
        title: title.to_string(),
        x_label: x.into(),
        y_label: y.into(),
        series: vec![Series { dots: true, ..series("section", points, Stroke::SECTION) }],
        ..LineFigure::default()
    })
}

fn series(label: &str, points: Vec<[f64; 2]>, stroke: Stroke) -> Series {
    Series { label: label.to_string(), points, stroke, dots: false }
}
