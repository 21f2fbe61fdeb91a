//! `aeroform polar`: a sweep of the angle of attack.

use super::failure::Failure;
use super::figures;
use super::flow_arguments::{FlowArguments, panelled};
use super::output::{print, print_json};
use crate::design::parallel::{in_parallel_with, processors};
use crate::flow::{FlowError, PanelledSection, Settings, Solution};
use crate::report::json::{AnalysisReport, PolarReport};
use crate::report::{Align, OutputDirectory, Table};
use std::path::PathBuf;
use std::time::Instant;

/// Arguments of `aeroform polar`.
#[derive(Debug, clap::Args)]
pub(super) struct PolarArguments {
    #[command(flatten)]
    point: FlowArguments,
    /// Angles of attack in degrees
    #[arg(long, value_name = "FIRST:LAST:STEP", allow_hyphen_values = true)]
    alpha: String,
    /// Sweeps to run side by side
    #[arg(long, default_value_t = 1)]
    jobs: usize,
    /// Write polar.csv and polar.svg into this directory
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Most points of a sweep.
const MOST_POINTS: usize = 10_000;

pub(super) fn run(arguments: &PolarArguments) -> Result<(), Failure> {
    let alphas = angles(&arguments.alpha)?;
    let directory = match &arguments.out {
        Some(path) => Some(OutputDirectory::prepare(path).map_err(|e| Failure::Input(e.to_string()))?),
        None => None,
    };
    let (_, section) = panelled(&arguments.point)?;
    let points = sweep(arguments, &section, &alphas)?;
    if let Some(directory) = &directory {
        let failed = |e: &dyn std::fmt::Display| Failure::Computation(e.to_string());
        let reliable: Vec<&Solution> = points.iter().filter_map(Point::reliable).collect();
        let title = format!(
            "{}: M {}, Re {:.3e}",
            arguments.point.shape.name(),
            arguments.point.mach,
            arguments.point.reynolds
        );
        let files = [
            ("polar.csv", csv(&points)),
            ("polar.svg", figures::drag_polar(&reliable, &title).map_err(|e| failed(&e))?),
            ("lift.svg", figures::lift_curve(&reliable, &title).map_err(|e| failed(&e))?),
        ];
        directory.write_all(files).map_err(|e| failed(&e))?;
    }
    if arguments.json {
        let reports = points.iter().map(|point| match &point.flow {
            Ok((solution, seconds)) => AnalysisReport::new(solution, *seconds),
            Err(_) => {
                AnalysisReport::refused(point.alpha, arguments.point.mach, arguments.point.reynolds, point.status())
            }
        });
        print_json(&PolarReport { section: arguments.point.shape.shape.clone(), points: reports.collect() })?;
    } else {
        print(&table(&points))?;
    }
    let failed = points.iter().filter(|p| p.reliable().is_none()).count();
    if failed == 0 {
        return Ok(());
    }
    Err(Failure::Computation(format!("{failed} of {} points do not hold; their status says why", points.len())))
}

/// FIRST:LAST:STEP in degrees, both ends included.
fn angles(text: &str) -> Result<Vec<f64>, Failure> {
    let wrong = |why: &str| Failure::Input(format!("--alpha {text}: {why}; write FIRST:LAST:STEP in degrees"));
    let parts: Vec<f64> = text.split(':').map(|p| p.trim().parse().unwrap_or(f64::NAN)).collect();
    let (first, last, step) = match parts[..] {
        [only] => (only, only, 1.0),
        [first, last] => (first, last, if last >= first { 1.0 } else { -1.0 }),
        [first, last, step] => (first, last, step),
        _ => return Err(wrong("three numbers are wanted")),
    };
    if ![first, last, step].iter().all(|v| v.is_finite()) {
        return Err(wrong("not finite numbers"));
    }
    let count = (last - first) / step;
    // written so that NaN fails
    if !(count >= 0.0 && count <= MOST_POINTS as f64) {
        return Err(wrong("the step does not lead from first to last in a sensible number of points"));
    }
    Ok((0..=(count + 1e-9).floor() as usize).map(|k| first + k as f64 * step).collect())
}

/// One point of a sweep.
struct Point {
    /// Angle of attack in degrees.
    alpha: f64,
    /// The flow and the seconds it took, or why there is none.
    flow: Result<(Solution, f64), Failure>,
}

impl Point {
    fn solution(&self) -> Option<&Solution> {
        self.flow.as_ref().ok().map(|(solution, _)| solution)
    }

    /// The solution, where its numbers hold.
    fn reliable(&self) -> Option<&Solution> {
        self.solution().filter(|s| s.is_reliable())
    }

    /// The status in words: of the flow, or the reason why there is none.
    fn status(&self) -> String {
        match &self.flow {
            Ok((solution, _)) => solution.status.to_string(),
            Err(failure) => failure.to_string(),
        }
    }
}

/// Solves all points; each job takes a run of neighbouring ones, every point starting from the last. A point that has
/// no flow keeps its reason, and the others their flows.
///
/// # Errors
/// The reason of the first point where no point has a flow.
fn sweep(arguments: &PolarArguments, section: &PanelledSection, alphas: &[f64]) -> Result<Vec<Point>, Failure> {
    let jobs = arguments.jobs.clamp(1, alphas.len().max(1));
    let runs: Vec<&[f64]> = alphas.chunks(alphas.len().div_ceil(jobs).max(1)).collect();
    let solve = |run: &[f64]| -> Vec<Point> {
        let mut points: Vec<Point> = Vec::with_capacity(run.len());
        for &alpha in run {
            let warm = points.last().and_then(Point::reliable);
            let flow = solve_point(arguments, section, alpha, warm);
            points.push(Point { alpha, flow });
        }
        points
    };
    let mut points: Vec<Point> =
        in_parallel_with(jobs.min(processors()), &runs, || (), |(), run| solve(run)).into_iter().flatten().collect();
    if points.iter().all(|p| p.flow.is_err())
        && let Some(Point { flow: Err(failure), .. }) = points.drain(..).next()
    {
        return Err(Failure::Input(format!("{}: {failure}", arguments.point.shape.shape)));
    }
    Ok(points)
}

fn solve_point(
    arguments: &PolarArguments,
    section: &PanelledSection,
    alpha: f64,
    warm: Option<&Solution>,
) -> Result<(Solution, f64), Failure> {
    let begin = Instant::now();
    let condition = arguments.point.condition(Some(alpha), None)?;
    let solution = section
        .analyze(&condition, &Settings::default(), warm)
        .map_err(|e: FlowError| Failure::Input(e.to_string()))?;
    Ok((solution, begin.elapsed().as_secs_f64()))
}

fn table(points: &[Point]) -> String {
    let columns = ["alpha", "CL", "CD", "CD pressure", "Cm", "transition up", "transition low", "iterations", "status"];
    let align = |k: usize| if k == 8 { Align::Left } else { Align::Right };
    let mut table = Table::new(columns.iter().enumerate().map(|(k, name)| (*name, align(k))));
    for point in points {
        let number = |value: fn(&Solution) -> f64, digits: usize| {
            point.reliable().map_or("-".into(), |s| format!("{:.digits$}", value(s)))
        };
        table.row([
            format!("{:.3}", point.alpha),
            number(|s| s.coefficients.cl, 5),
            number(|s| s.coefficients.cd, 6),
            number(|s| s.cd_pressure, 6),
            number(|s| s.coefficients.cm, 5),
            number(|s| s.coefficients.transition[0], 4),
            number(|s| s.coefficients.transition[1], 4),
            point.solution().map_or("-".into(), |s| s.iterations.to_string()),
            point.status(),
        ]);
    }
    format!("{table}\n")
}

fn csv(points: &[Point]) -> String {
    let mut text = String::from(
        "alpha,cl,cd,cd_pressure,cd_friction,cm,cp_min,transition_upper,transition_lower,iterations,residual,seconds,status\n",
    );
    for point in points {
        let number = |value: fn(&Solution) -> f64| point.reliable().map_or(String::new(), |s| value(s).to_string());
        let values = [
            number(|s| s.coefficients.cl),
            number(|s| s.coefficients.cd),
            number(|s| s.cd_pressure),
            number(|s| s.cd_friction),
            number(|s| s.coefficients.cm),
            number(|s| s.coefficients.cp_min),
            number(|s| s.coefficients.transition[0]),
            number(|s| s.coefficients.transition[1]),
        ];
        let solving = match &point.flow {
            Ok((s, seconds)) => format!("{},{:e},{seconds:.6}", s.iterations, s.residual),
            Err(_) => ",,".into(),
        };
        let status = point.status().replace('"', "\"\"");
        text.push_str(&format!("{},{},{solving},\"{status}\"\n", point.alpha, values.join(",")));
    }
    text
}
