//! The figures of the command: what is drawn, in the manner of the paper's Figs. 14 and 15.

use super::output::settled;
use crate::design::{DesignProblem, Shape};
use crate::flow::{Condition, Distributions, FieldBlock, Incidence, InviscidSolution, Solution, StationFlow};
use crate::optimize::{History, HistoryRow};
use crate::report::engineering;
use crate::report::figures::{
    Annotation, Color, ContourFigure, ContourLevel, ContourPatch, ConvergenceFigure, ConvergencePoint, LineFigure,
    SectionCurve, SectionFigure, Series, Stroke, contour_figure, convergence_figure, grid_figure, line_figure,
    section_figure,
};
use crate::section::Section;

/// Points drawn of a section, enough for the eye at the nose.
const SECTION_POINTS: usize = 801;
/// Points drawn of a line of the box.
const LINE_POINTS: usize = 61;

/// A section alone.
pub(super) fn section(section: &Section<f64>) -> String {
    section_figure(&SectionFigure {
        title: section.name().to_string(),
        curves: vec![outline(section.name(), section, Stroke::SECTION)],
        ..SectionFigure::default()
    })
}

/// A design: section, undeformed section, target, the lines of the box and its control points.
pub(super) fn design(problem: &DesignProblem, shape: &Shape, title: &str) -> String {
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

/// Objective and constraint violation over the iterations; drag is shown in counts.
pub(super) fn convergence(history: &History, objective: &str, in_counts: bool, title: &str) -> String {
    let unit = if in_counts { 1e4 } else { 1.0 };
    let point = |row: &HistoryRow| ConvergencePoint {
        // a trial belongs to the iteration that it may complete, a sample to the design around which it lies
        iteration: row.iteration + usize::from(row.evaluation > 1 && !row.sampling),
        objective: unit * row.objective,
        violation: row.violation,
        sampling: row.sampling,
        improved: row.improved,
    };
    convergence_figure(&ConvergenceFigure {
        title: title.to_string(),
        objective: if in_counts { format!("{objective}, counts") } else { objective.to_string() },
        points: history.rows().iter().map(point).collect(),
        constrained: history.rows().iter().any(|row| row.violation > 0.0),
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

/// An operating point in words, complete: what is held, Mach and Reynolds number, and how transition comes about.
pub(super) fn condition_text(condition: &Condition) -> String {
    let held = match condition.incidence {
        Incidence::Alpha(alpha) => format!("α {}°", engineering(alpha.to_degrees(), 4)),
        Incidence::Lift(lift) => format!("CL {}", engineering(lift, 4)),
    };
    format!("{held}, {}", surroundings_text(condition))
}

/// The part of an operating point that a sweep of the angle of attack keeps.
pub(super) fn surroundings_text(condition: &Condition) -> String {
    let side = |trip: Option<f64>| trip.map_or("free".to_string(), |x| engineering(x, 3));
    let transition = match condition.trips {
        [None, None] => format!("Ncrit {}", engineering(condition.n_critical, 3)),
        [upper, lower] if upper == lower => format!("trips at x/c {}", side(upper)),
        [upper, lower] => {
            let free = if upper.is_none() || lower.is_none() {
                format!(", Ncrit {}", engineering(condition.n_critical, 3))
            } else {
                String::new()
            };
            format!("trips at x/c {} and {}{free}", side(upper), side(lower))
        }
    };
    format!("M {}, Re {}, {transition}", engineering(condition.mach, 3), engineering(condition.reynolds, 4))
}

/// Pressure coefficient where the flow is sonic, by the isentropic relation for air; `None` without compressibility.
fn critical_pressure(mach: f64) -> Option<f64> {
    const GAMMA: f64 = 1.4;
    let ratio = (2.0 + (GAMMA - 1.0) * mach * mach) / (GAMMA + 1.0);
    (mach > 0.0).then(|| 2.0 / (GAMMA * mach * mach) * (ratio.powf(GAMMA / (GAMMA - 1.0)) - 1.0))
}

/// Values at the nodes over x along the chord line, in chords.
fn chordwise(nodes: &[[f64; 2]], values: &[f64]) -> Vec<[f64; 2]> {
    nodes.iter().zip(values).map(|(node, value)| [node[0], *value]).collect()
}

/// Pressure with and without boundary layer, transition marked.
pub(super) fn pressure(solution: &Solution, title: &str) -> String {
    line_figure(&LineFigure { title: title.into(), ..pressure_plot(solution) })
}

fn pressure_plot(solution: &Solution) -> LineFigure {
    let Distributions { nodes, cp, cp_inviscid, .. } = solution.distributions();
    let mark = |k: usize, name: &str| Annotation {
        at: solution.coefficients.transition[k],
        label: format!("transition {name}"),
    };
    let mut lines = vec![series("viscous", chordwise(&nodes, &cp), Stroke::SECTION)];
    if !cp_inviscid.is_empty() {
        lines.push(series("inviscid", chordwise(&nodes, &cp_inviscid), Stroke::palette(0).dashed()));
    }
    LineFigure { annotations: vec![mark(0, "upper"), mark(1, "lower")], ..cp_plot(lines, solution.condition.mach) }
}

/// Pressure at one operating point before and after a design run; either may be missing.
pub(super) fn pressure_change(before: Option<&Solution>, after: Option<&Solution>, title: &str) -> String {
    let mach = before.or(after).map_or(0.0, |solution| solution.condition.mach);
    let line = |name: &str, flow: Option<&Solution>, stroke: Stroke| {
        let Distributions { nodes, cp, .. } = flow?.distributions();
        Some(series(name, chordwise(&nodes, &cp), stroke))
    };
    let lines = [line("start", before, Stroke::INITIAL), line("end", after, Stroke::SECTION)];
    line_figure(&LineFigure { title: title.into(), ..cp_plot(lines.into_iter().flatten().collect(), mach) })
}

/// Pressure without boundary layer.
pub(super) fn inviscid_pressure(solution: &InviscidSolution, title: &str) -> String {
    let points = chordwise(&solution.nodes, &solution.cp);
    let plot = cp_plot(vec![series("inviscid", points, Stroke::SECTION)], solution.mach);
    line_figure(&LineFigure { title: title.into(), ..plot })
}

/// Pressure coefficients over the chord, suction upwards, with the critical one where the axis comes near it.
fn cp_plot(series: Vec<Series>, mach: f64) -> LineFigure {
    let values = || series.iter().flat_map(|s| &s.points).map(|p| p[1]).filter(|v| v.is_finite());
    let (low, high) = values().fold((0.0_f64, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
    let (mut y_label, mut levels, mut y_range) = ("Cp".to_string(), Vec::new(), None);
    if let Some(critical) = critical_pressure(mach) {
        if critical > low - (high - low) {
            // also for the name of the line
            let room = 0.12 * (high - low);
            y_range = Some([low.min(critical) - room, high.max(critical) + room]);
            levels.push(Annotation { at: critical, label: format!("critical Cp {}", engineering(critical, 3)) });
        } else {
            y_label = format!("Cp (critical {})", engineering(critical, 3));
        }
    }
    LineFigure { x_label: "x/c".into(), y_label, series, inverted_y: true, levels, y_range, ..LineFigure::default() }
}

/// Pressure and boundary layer along both sides.
pub(super) fn boundary_layer(solution: &Solution, title: &str) -> String {
    let distributions = solution.distributions();
    let along = |side: &[StationFlow], value: fn(&StationFlow) -> f64| side.iter().map(|s| [s.x, value(s)]).collect();
    let both = |name: &str, value: fn(&StationFlow) -> f64| LineFigure {
        x_label: "x/c".into(),
        y_label: name.into(),
        series: vec![
            series("upper side", along(&distributions.upper, value), Stroke::palette(0)),
            series("lower side", along(&distributions.lower, value), Stroke::palette(1)),
        ],
        ..LineFigure::default()
    };
    let mut friction = both("skin friction cf", |s| s.skin_friction);
    friction.y_range = behind_the_nose(&friction.series);
    let pressure = both("Cp", |s| s.cp);
    let pressure = cp_plot(pressure.series, solution.condition.mach);
    let plots = [
        pressure,
        both("H (kinematic)", |s| s.shape_parameter),
        friction,
        both("amplification n", |s| s.amplification),
        both("displacement δ*/c", |s| s.displacement_thickness),
        both("momentum θ/c", |s| s.momentum_thickness),
    ];
    grid_figure(title, 2, &plots)
}

/// The section in the frame of its chord line with its displacement thickness.
pub(super) fn displacement(solution: &Solution, title: &str) -> String {
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
    let mut outline = distributions.nodes.clone();
    outline.extend(distributions.nodes.first());
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

/// Mach numbers between the lines of the field.
const MACH_STEP: f64 = 0.05;

/// Lines of equal Mach number about the section, with the sonic line and the places at which the flow along the wall
/// becomes subsonic again; `None` where the solver knows no field.
pub(super) fn mach_field(solution: &Solution, title: &str) -> Option<String> {
    let field = solution.field()?;
    let blocks = [&field.upper, &field.lower];
    let values = || blocks.iter().flat_map(|b| b.mach.iter().flatten()).copied().filter(|m| m.is_finite());
    let (low, high) = values().fold((f64::INFINITY, 0.0_f64), |(l, h), m| (l.min(m), h.max(m)));
    let steps = (low / MACH_STEP).ceil() as i32..=(high / MACH_STEP).floor() as i32;
    let mut levels: Vec<ContourLevel> = steps
        .map(|k| (k, f64::from(k) * MACH_STEP))
        .filter(|(k, _)| *k > 0 && *k != SONIC)
        .map(|(k, value)| ContourLevel {
            value,
            label: if k % 4 == 0 { format!("M {value:.1}") } else { String::new() },
            stroke: Stroke { color: mach_color(value), width: if k % 4 == 0 { 1.5 } else { 0.8 }, dashed: false },
        })
        .collect();
    // sonic flow last, over all others
    if high > 1.0 {
        levels.push(ContourLevel { value: 1.0, label: "sonic line".into(), stroke: Stroke::SECTION });
    }
    let mut outline = solution.distributions().nodes;
    outline.extend(outline.first().copied());
    let patch = |block: &FieldBlock| ContourPatch { points: block.points.clone(), values: block.mach.clone() };
    let reach = |block: &FieldBlock, sign: f64| {
        let fast = block.points.iter().flatten().zip(block.mach.iter().flatten()).filter(|(_, m)| **m > 1.0);
        sign * fast.map(|(p, _)| sign * p[1]).fold(0.4, f64::max).min(2.0) * 1.3
    };
    Some(contour_figure(&ContourFigure {
        title: title.to_string(),
        patches: blocks.map(patch).into(),
        levels,
        curves: vec![SectionCurve { label: "section".into(), points: outline, stroke: Stroke::SECTION }],
        marks: subsonic_again(solution),
        window: [[-0.3, 1.4], [reach(&field.lower, -1.0), reach(&field.upper, 1.0)]],
    }))
}

/// Number of the line of sonic flow.
const SONIC: i32 = 20;

/// Blue for slow flow, over grey at the speed of sound, to red at a Mach number of 1.5.
fn mach_color(mach: f64) -> Color {
    const SLOW: [f64; 3] = [20.0, 60.0, 200.0];
    const SOUND: [f64; 3] = [150.0, 150.0, 165.0];
    const FAST: [f64; 3] = [205.0, 25.0, 20.0];
    let (from, to, share) = if mach < 1.0 { (SLOW, SOUND, mach) } else { (SOUND, FAST, 0.3 + 1.4 * (mach - 1.0)) };
    let [r, g, b] = [0, 1, 2].map(|c| (from[c] + share.min(1.0) * (to[c] - from[c])).round() as u8);
    Color(r, g, b)
}

/// The last place of each side at which the flow at the edge of the layer becomes subsonic, where there is one.
fn subsonic_again(solution: &Solution) -> Vec<SectionCurve> {
    let distributions = solution.distributions();
    let sides = [("upper", &distributions.upper), ("lower", &distributions.lower)];
    let of = |(k, (name, side)): (usize, (&str, &Vec<StationFlow>))| {
        let falls = side.windows(2).rev().find(|w| w[0].mach > 1.0 && w[1].mach <= 1.0)?;
        let share = (falls[0].mach - 1.0) / (falls[0].mach - falls[1].mach);
        let at = |a: f64, b: f64| a + share * (b - a);
        let point = [at(falls[0].x, falls[1].x), at(falls[0].y, falls[1].y)];
        let label = format!("subsonic again on the {name} side at x/c {}", engineering(point[0], 3));
        Some(SectionCurve { label, points: vec![point], stroke: Stroke::palette(2 + k) })
    };
    sides.into_iter().enumerate().filter_map(of).collect()
}

/// An axis for what happens behind the nose, where the peak at the stagnation point would dwarf it.
fn behind_the_nose(series: &[Series]) -> Option<[f64; 2]> {
    let values = series.iter().flat_map(|s| &s.points).filter(|p| p[0] > 0.03).map(|p| p[1]);
    let (low, high) = values.fold((0.0_f64, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
    (high > low).then_some([low - 0.05 * (high - low), high + 0.15 * (high - low)])
}

/// A named sweep of the angle of attack.
pub(super) struct Sweep<'a> {
    pub name: &'a str,
    pub points: &'a [Solution],
    pub stroke: Stroke,
}

/// Lift, drag, moment, glide ratio and transition of a sweep; points beyond the model are grey.
pub(super) fn polar(points: &[Solution], title: &str) -> String {
    let sweep = [Sweep { name: "", points, stroke: Stroke::SECTION }];
    let alpha = |s: &Solution| s.alpha.to_degrees();
    let mut transition = sweep_plot("α, degrees", "transition x/c", &[], alpha, |_| 0.0);
    for (k, side) in ["upper side", "lower side"].into_iter().enumerate() {
        let sweep = [Sweep { name: side, points, stroke: Stroke::palette(k) }];
        transition.series.extend(sweep_series(&sweep, alpha, |s| s.coefficients.transition[k]));
    }
    let plots = [
        drag_polar(&sweep),
        lift_curve(&sweep),
        sweep_plot("α, degrees", "Cm (c/4)", &sweep, alpha, |s| s.coefficients.cm),
        sweep_plot("α, degrees", "CL/CD", &sweep, alpha, |s| s.coefficients.cl / s.coefficients.cd),
        sweep_plot("α, degrees", "CD, counts", &sweep, alpha, |s| 1e4 * s.coefficients.cd),
        transition,
    ];
    grid_figure(title, 2, &plots)
}

/// The part of an operating point that a sweep of the Mach number keeps.
pub(super) fn of_a_rise(solution: &Solution) -> String {
    let all = condition_text(&solution.condition);
    let mach = format!("M {}, ", engineering(solution.condition.mach, 3));
    all.replace(&mach, "")
}

/// A number of a flow with its name.
type Named = (&'static str, fn(&Solution) -> f64);

/// Drag with its parts, and all that goes with it, over the Mach number; points beyond the model are grey.
pub(super) fn drag_rise(points: &[Solution], title: &str) -> String {
    let mach = |s: &Solution| s.condition.mach;
    let sweep = [Sweep { name: "", points, stroke: Stroke::SECTION }];
    let parts: [Named; 4] = [
        ("total", |s| s.coefficients.cd),
        ("friction", |s| s.cd_friction),
        ("pressure", |s| s.cd_pressure),
        ("part of shocks (wave)", |s| s.cd_wave),
    ];
    let mut drag = sweep_plot("Mach number", "CD, counts", &[], mach, |_| 0.0);
    for (k, (name, of)) in parts.into_iter().enumerate() {
        let stroke = if k == 0 { Stroke::SECTION } else { Stroke::palette(k - 1) };
        drag.series.extend(sweep_series(&[Sweep { name, points, stroke }], mach, |s| 1e4 * of(s)));
    }
    let (label, held): Named = match points.first().map(|s| s.condition.incidence) {
        Some(Incidence::Lift(_)) => ("α, degrees", |s| s.alpha.to_degrees()),
        _ => ("CL", |s| s.coefficients.cl),
    };
    let plots = [
        drag,
        sweep_plot("Mach number", label, &sweep, mach, held),
        sweep_plot("Mach number", "CL/CD", &sweep, mach, |s| s.coefficients.cl / s.coefficients.cd),
        sweep_plot("Mach number", "Cm (c/4)", &sweep, mach, |s| s.coefficients.cm),
    ];
    grid_figure(title, 2, &plots)
}

/// Drag polar, lift curve, moment, glide ratio and transition of several sections.
pub(super) fn polars(sweeps: &[Sweep<'_>], title: &str) -> String {
    let alpha = |s: &Solution| s.alpha.to_degrees();
    let transition = |k: usize, side: &str| {
        let label = format!("transition x/c, {side} side");
        // one axis for all: a trip does not move by what round-off makes of it
        let plot = sweep_plot("α, degrees", &label, sweeps, alpha, |s| s.coefficients.transition[k]);
        LineFigure { y_range: Some([0.0, 1.05]), ..plot }
    };
    let plots = [
        drag_polar(sweeps),
        lift_curve(sweeps),
        sweep_plot("α, degrees", "Cm (c/4)", sweeps, alpha, |s| s.coefficients.cm),
        sweep_plot("CL", "CL/CD", sweeps, |s| s.coefficients.cl, |s| s.coefficients.cl / s.coefficients.cd),
        transition(0, "upper"),
        transition(1, "lower"),
    ];
    grid_figure(title, 2, &plots)
}

fn drag_polar(sweeps: &[Sweep<'_>]) -> LineFigure {
    sweep_plot("CD, counts", "CL", sweeps, |s| 1e4 * s.coefficients.cd, |s| s.coefficients.cl)
}

fn lift_curve(sweeps: &[Sweep<'_>]) -> LineFigure {
    sweep_plot("α, degrees", "CL", sweeps, |s| s.alpha.to_degrees(), |s| s.coefficients.cl)
}

fn sweep_plot(
    x_label: &str,
    y_label: &str,
    sweeps: &[Sweep<'_>],
    x: impl Fn(&Solution) -> f64,
    y: impl Fn(&Solution) -> f64,
) -> LineFigure {
    let series = sweep_series(sweeps, x, y);
    LineFigure { x_label: x_label.into(), y_label: y_label.into(), series, ..LineFigure::default() }
}

/// A curve through the points of each sweep that hold, and grey dots for those beyond the model.
fn sweep_series(sweeps: &[Sweep<'_>], x: impl Fn(&Solution) -> f64, y: impl Fn(&Solution) -> f64) -> Vec<Series> {
    // round-off of a symmetric flow would fill an axis of its own
    let at = |s: &Solution| [settled(x(s)), settled(y(s))];
    let mut all = Vec::new();
    for Sweep { name, points, stroke } in sweeps {
        let gaps = points.iter().map(|s| if s.is_reliable() { at(s) } else { [f64::NAN; 2] }).collect();
        all.push(Series { dots: true, ..series(name, gaps, *stroke) });
        let beyond: Vec<[f64; 2]> = points.iter().filter(|s| s.status.is_beyond_model()).map(at).collect();
        if !beyond.is_empty() {
            let grey = Stroke { width: 0.0, color: Color(170, 170, 170), ..*stroke };
            all.push(Series { dots: true, ..series("beyond the model", beyond, grey) });
        }
    }
    all
}

fn series(label: &str, points: Vec<[f64; 2]>, stroke: Stroke) -> Series {
    Series { label: label.to_string(), points, stroke, dots: false }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn critical_pressures_are_those_of_the_tables() {
        // Abbott and von Doenhoff, figure 140: M 0.5 and 0.7
        assert!((critical_pressure(0.5).unwrap() + 2.133).abs() < 2e-3);
        assert!((critical_pressure(0.7).unwrap() + 0.779).abs() < 2e-3);
        assert_eq!(critical_pressure(0.0), None);
    }

    #[test]
    fn conditions_are_complete() {
        let free = Condition { mach: 0.2, ..Condition::new(Incidence::Lift(0.5), 3e6) };
        assert_eq!(condition_text(&free), "CL 0.5, M 0.2, Re 3e6, Ncrit 9");
        let tripped = Condition { trips: [Some(0.1), None], ..Condition::new(Incidence::Alpha(0.0), 5e5) };
        assert_eq!(condition_text(&tripped), "α 0°, M 0, Re 500000, trips at x/c 0.1 and free, Ncrit 9");
    }
}
