//! How a run converged.

use super::line::{LineFigure, Series, stack};
use super::{Color, Stroke};

/// The objective over the iterations: the best design so far, the trial steps, and apart from them the evaluations that
/// only sample the neighbourhood of a design and those that failed. With constraints their largest violation stands
/// below.
///
/// The vertical axis holds the best designs; trials beyond it are triangles at its edge. It is logarithmic where the
/// best designs span more than a decade. Violations of 0 are left out.
///
/// ```
/// use aeroform::report::figures::{ConvergenceFigure, ConvergencePoint, convergence_figure};
/// let point = |iteration, objective| ConvergencePoint { iteration, objective, improved: true, ..Default::default() };
/// let figure = ConvergenceFigure {
///     title: "Convergence".into(),
///     objective: "drag, counts".into(),
///     points: vec![point(0, 100.0), point(1, f64::NAN), point(1, 80.0)],
///     constrained: false,
/// };
/// assert!(convergence_figure(&figure).contains("best so far"));
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ConvergenceFigure {
    /// Title above the plot.
    pub title: String,
    /// Name of the axis of the objective, with its unit.
    pub objective: String,
    /// The evaluations in their order.
    pub points: Vec<ConvergencePoint>,
    /// Whether there are constraints whose violation is shown.
    pub constrained: bool,
}

/// One evaluation in a [`ConvergenceFigure`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ConvergencePoint {
    /// The iteration that the evaluation belongs to; 0 for the start.
    pub iteration: usize,
    /// The objective, NaN where the evaluation failed.
    pub objective: f64,
    /// Largest violation of a constraint, NaN where the evaluation failed.
    pub violation: f64,
    /// Whether the evaluation only samples the neighbourhood of a design.
    pub sampling: bool,
    /// Whether this was the best design so far.
    pub improved: bool,
}

const TRIAL: Stroke = Stroke { color: Color(120, 170, 205), width: 0.0, dashed: false };
const SAMPLE: Stroke = Stroke { color: Color(205, 205, 205), width: 0.0, dashed: false };
const FAILED: Stroke = Stroke { color: Color(200, 30, 30), width: 0.0, dashed: false };

/// The figure as SVG text.
pub fn convergence_figure(figure: &ConvergenceFigure) -> String {
    let objective = figure.plot(|p| p.objective, &figure.objective);
    if !figure.constrained {
        return stack(&[(&LineFigure { x_label: "iteration".into(), ..objective }, 400.0)]);
    }
    let violation = LineFigure { x_label: "iteration".into(), ..figure.plot(|p| p.violation, "largest violation") };
    stack(&[(&objective, 320.0), (&violation, 180.0)])
}

impl ConvergenceFigure {
    /// One number of the evaluations over the iterations.
    fn plot(&self, value: impl Fn(&ConvergencePoint) -> f64, label: &str) -> LineFigure {
        let best = self.best(&value);
        let values = || best.iter().map(|p| p[1]).filter(|v| v.is_finite());
        let (least, most) = values().fold((f64::INFINITY, 0.0_f64), |(l, m), v| (l.min(v), m.max(v)));
        let positive = values().filter(|v| *v > 0.0).fold(f64::INFINITY, f64::min);
        let log_y = least >= 0.0 && most > 10.0 * positive;
        let range = vertical_range(values(), log_y);
        let of = |wanted: &dyn Fn(&ConvergencePoint) -> bool| -> Vec<[f64; 2]> {
            let points = self.points.iter().filter(|p| !p.objective.is_nan() && wanted(p));
            points.map(|p| [p.iteration as f64, value(p)]).collect()
        };
        let floor = range.map_or(0.0, |[low, _]| low);
        let failed = self.points.iter().filter(|p| p.objective.is_nan()).map(|p| [p.iteration as f64, floor]).collect();
        let series = [
            ("samples of the curvature", of(&|p| p.sampling), SAMPLE, true),
            ("trial steps", of(&|p| !p.sampling), TRIAL, true),
            ("failed evaluations", failed, FAILED, true),
            (
                if self.constrained { "best so far, constraints first" } else { "best so far" },
                best.clone(),
                Stroke::palette(0),
                best.len() <= 60,
            ),
        ];
        LineFigure {
            title: self.title.clone(),
            y_label: label.into(),
            log_y,
            y_range: range,
            series: series
                .into_iter()
                .filter(|(_, points, ..)| !points.is_empty())
                .map(|(label, points, stroke, dots)| Series { label: label.into(), points, stroke, dots })
                .collect(),
            ..LineFigure::default()
        }
    }

    /// The best design at the end of each iteration up to the last.
    fn best(&self, value: impl Fn(&ConvergencePoint) -> f64) -> Vec<[f64; 2]> {
        let mut best: Vec<[f64; 2]> = Vec::new();
        for point in &self.points {
            let x = point.iteration as f64;
            let last = best.last().copied();
            let now = if point.improved && !point.objective.is_nan() { Some(value(point)) } else { last.map(|l| l[1]) };
            match (now, last) {
                (Some(now), Some(last)) if last[0] == x => {
                    best.pop();
                    best.push([x, now]);
                }
                (Some(now), _) => best.push([x, now]),
                (None, _) => {}
            }
        }
        best
    }
}

/// Ends of an axis that holds `values` with some room, more of it above for trials; `None` without values.
fn vertical_range(values: impl Iterator<Item = f64>, logarithmic: bool) -> Option<[f64; 2]> {
    let scaled = values.filter(|v| !logarithmic || *v > 0.0).map(|v| if logarithmic { v.log10() } else { v });
    let (low, high) = scaled.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    let span = (high - low).max(0.02 * low.abs().max(high.abs())).max(1e-12);
    let ends = [low - 0.06 * span, high + 0.25 * span].map(|v| if logarithmic { 10_f64.powf(v) } else { v });
    ends.iter().all(|v| v.is_finite()).then_some(ends)
}

#[cfg(test)]
mod tests {
    use super::super::canvas::tests::{polylines, texts};
    use super::*;

    fn point(iteration: usize, objective: f64) -> ConvergencePoint {
        ConvergencePoint { iteration, objective, violation: 0.0, sampling: false, improved: true }
    }

    #[test]
    fn any_history_can_be_drawn() {
        for objectives in
            [vec![], vec![f64::NAN], vec![1.0], vec![1.0, -1.0, 0.0], vec![1e-2, 1e-7], vec![1e300, -1e300]]
        {
            for (constrained, violation) in [(false, 0.0), (true, 0.0), (true, 1e-3), (true, f64::NAN)] {
                let points = objectives.iter().enumerate();
                let points = points.map(|(k, o)| ConvergencePoint { violation, ..point(k, *o) }).collect();
                let figure =
                    ConvergenceFigure { title: "t".into(), objective: "objective".into(), points, constrained };
                let svg = convergence_figure(&figure);
                assert!(svg.ends_with("</svg>\n") && !svg.contains("NaN") && !svg.contains("inf"), "{svg}");
                assert_eq!(svg.contains("largest violation"), constrained);
            }
        }
    }

    #[test]
    fn the_line_shows_the_best_of_each_iteration_and_other_evaluations_stand_apart() {
        let worse = |iteration, objective| ConvergencePoint { improved: false, ..point(iteration, objective) };
        let sample = |iteration, objective| ConvergencePoint { sampling: true, ..worse(iteration, objective) };
        let points = vec![
            point(0, 3.0),
            sample(0, 3.1),
            worse(1, 50.0),
            point(1, 2.5),
            point(1, 2.0),
            worse(2, f64::NAN),
            worse(2, 2.2),
            point(3, 1.0),
        ];
        let figure = ConvergenceFigure { title: "t".into(), objective: "drag".into(), points, constrained: false };
        assert_eq!(figure.best(|p| p.objective), [[0.0, 3.0], [1.0, 2.0], [2.0, 2.0], [3.0, 1.0]]);
        let svg = convergence_figure(&figure);
        for label in
            ["samples of the curvature", "trial steps", "failed evaluations", "best so far", "iteration", "drag"]
        {
            assert!(texts(&svg).iter().any(|t| t == label), "{label}");
        }
        // the trial far above is pointed to and does not stretch the axis
        assert_eq!(svg.matches("<polygon").count(), 1);
        let line = polylines(&svg, "#0072b2").into_iter().max_by_key(Vec::len).unwrap();
        assert_eq!(line.len(), 4);
        assert!(line[3][1] - line[0][1] > 200.0, "{line:?}");
    }
}
