//! How a run converged.

use super::line::{LineFigure, Series, stack};
use super::{Color, FigureError, Stroke};

/// The objective of each evaluation and the lowest so far, with constraints also their largest violation below.
///
/// The axes are logarithmic where all values that can be shown are positive; violations of 0 are left out.
///
/// ```
/// use aeroform::report::figures::{ConvergenceFigure, convergence_figure};
/// let figure = ConvergenceFigure {
///     title: "Convergence".into(),
///     objectives: vec![1e-2, f64::NAN, 3e-3, 1e-5],
///     violations: None,
/// };
/// assert!(convergence_figure(&figure).unwrap().contains("best so far"));
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ConvergenceFigure {
    /// Title above the plot.
    pub title: String,
    /// Objective of each evaluation, NaN where it failed.
    pub objectives: Vec<f64>,
    /// Largest constraint violation of each evaluation, if there are constraints.
    pub violations: Option<Vec<f64>>,
}

const DOTS: Stroke = Stroke { color: Color(120, 170, 205), width: 0.0, dashed: false };

/// The figure as SVG text.
///
/// # Errors
/// The backend fails.
pub fn convergence_figure(figure: &ConvergenceFigure) -> Result<String, FigureError> {
    figure.to_svg()
}

impl ConvergenceFigure {
    fn to_svg(&self) -> Result<String, FigureError> {
        let objective = LineFigure {
            title: self.title.clone(),
            y_label: "objective".into(),
            x_label: if self.violations.is_none() { "evaluation".into() } else { String::new() },
            log_y: self.objectives.iter().all(|&v| v > 0.0 || v.is_nan()),
            series: vec![
                Series { label: "evaluation".into(), points: numbered(&self.objectives), stroke: DOTS, dots: true },
                Series {
                    label: "best so far".into(),
                    points: staircase(&self.objectives),
                    stroke: Stroke::palette(0),
                    dots: false,
                },
            ],
            ..LineFigure::default()
        };
        let Some(violations) = &self.violations else { return stack(&[(&objective, 400.0)]) };
        let mut points = numbered(violations);
        let log_y = violations.iter().any(|&v| v > 0.0);
        if !log_y {
            points.retain(|p| p[1].is_finite());
        }
        // the horizontal axis is that of the objective also where violations are missing
        points.extend([[1.0, f64::NAN], [self.objectives.len() as f64, f64::NAN]]);
        let violation = LineFigure {
            y_label: "violation".into(),
            x_label: "evaluation".into(),
            log_y,
            series: vec![Series {
                label: "largest constraint violation".into(),
                points,
                stroke: Stroke { width: 0.0, ..Stroke::palette(1) },
                dots: true,
            }],
            ..LineFigure::default()
        };
        stack(&[(&objective, 320.0), (&violation, 180.0)])
    }
}

/// Points over their number from 1.
fn numbered(values: &[f64]) -> Vec<[f64; 2]> {
    values.iter().zip(1..).map(|(&v, i)| [f64::from(i), v]).collect()
}

/// The lowest value so far, as steps.
fn staircase(values: &[f64]) -> Vec<[f64; 2]> {
    let mut points: Vec<[f64; 2]> = Vec::new();
    for [x, value] in numbered(values) {
        match points.last().copied() {
            Some([_, best]) => {
                points.push([x, best]);
                if value < best {
                    points.push([x, value]);
                }
            }
            None if value.is_finite() => points.push([x, value]),
            None => {}
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_history_can_be_drawn() {
        for objectives in [vec![], vec![f64::NAN], vec![1.0], vec![1.0, -1.0, 0.0], vec![1e-2, 1e-7]] {
            for violations in [None, Some(vec![]), Some(vec![0.0; objectives.len()]), Some(vec![1e-3, 0.0, f64::NAN])] {
                let figure = ConvergenceFigure { title: "t".into(), objectives: objectives.clone(), violations };
                let svg = figure.to_svg().unwrap();
                assert!(svg.ends_with("</svg>\n") && !svg.contains("NaN"));
                assert_eq!(svg.contains("largest constraint violation"), figure.violations.is_some());
            }
        }
    }

    #[test]
    fn the_best_never_rises() {
        let steps = staircase(&[f64::NAN, 3.0, 5.0, f64::NAN, 1.0, 2.0]);
        assert_eq!(steps, [[2.0, 3.0], [3.0, 3.0], [4.0, 3.0], [5.0, 3.0], [5.0, 1.0], [6.0, 1.0]]);
        assert!(staircase(&[f64::NAN]).is_empty());
    }
}
