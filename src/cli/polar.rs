//! `aeroform polar`: a sweep of the angle of attack.

use super::failure::Failure;
use super::figures;
use super::flow_arguments::{FlowArguments, panelled};
use super::output::{print, print_json};
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
        let reliable: Vec<&Solution> = points.iter().map(|(s, _)| s).filter(|s| s.is_reliable()).collect();
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
        let reports = points.iter().map(|(solution, seconds)| AnalysisReport::new(solution, *seconds));
        print_json(&PolarReport { section: arguments.point.shape.shape.clone(), points: reports.collect() })?;
    } else {
        print(&table(&points))?;
    }
    let failed = points.iter().filter(|(s, _)| !s.is_reliable()).count();
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

/// Solves all points; each job takes a run of neighbouring ones, every point starting from the last.
fn sweep(
    arguments: &PolarArguments,
    section: &PanelledSection,
    alphas: &[f64],
) -> Result<Vec<(Solution, f64)>, Failure> {
    let jobs = arguments.jobs.clamp(1, alphas.len().max(1));
    let chunk = alphas.len().div_ceil(jobs).max(1);
    let solve = |run: &[f64]| -> Result<Vec<(Solution, f64)>, Failure> {
        let mut solutions: Vec<(Solution, f64)> = Vec::with_capacity(run.len());
        for &alpha in run {
            let begin = Instant::now();
            let condition = arguments.point.condition(Some(alpha), None)?;
            let warm = solutions.last().map(|(s, _)| s).filter(|s| s.is_reliable());
            let solution = section
                .analyze(&condition, &Settings::default(), warm)
                .map_err(|e: FlowError| Failure::Input(format!("{}: {e}", arguments.point.shape.shape)))?;
            solutions.push((solution, begin.elapsed().as_secs_f64()));
        }
        Ok(solutions)
    };
    std::thread::scope(|scope| {
        let handles: Vec<_> = alphas.chunks(chunk).map(|run| scope.spawn(|| solve(run))).collect();
        let mut all = Vec::with_capacity(alphas.len());
        for handle in handles {
            let part = handle.join().map_err(|_| Failure::Computation("a sweep ended unexpectedly".into()))?;
            all.extend(part?);
        }
        Ok(all)
    })
}

fn table(points: &[(Solution, f64)]) -> String {
    let columns = ["alpha", "CL", "CD", "CD pressure", "Cm", "transition up", "transition low", "iterations", "status"];
    let align = |k: usize| if k == 8 { Align::Left } else { Align::Right };
    let mut table = Table::new(columns.iter().enumerate().map(|(k, name)| (*name, align(k))));
    for (s, _) in points {
        let number = |value: f64, digits: usize| if s.is_reliable() { format!("{value:.digits$}") } else { "-".into() };
        table.row([
            format!("{:.3}", s.alpha.to_degrees()),
            number(s.coefficients.cl, 5),
            number(s.coefficients.cd, 6),
            number(s.cd_pressure, 6),
            number(s.coefficients.cm, 5),
            number(s.coefficients.transition[0], 4),
            number(s.coefficients.transition[1], 4),
            s.iterations.to_string(),
            s.status.to_string(),
        ]);
    }
    format!("{table}\n")
}

fn csv(points: &[(Solution, f64)]) -> String {
    let mut text = String::from(
        "alpha,cl,cd,cd_pressure,cd_friction,cm,cp_min,transition_upper,transition_lower,iterations,residual,seconds,status\n",
    );
    for (s, seconds) in points {
        let number = |value: f64| if s.is_reliable() { value.to_string() } else { String::new() };
        let values = [
            s.coefficients.cl,
            s.coefficients.cd,
            s.cd_pressure,
            s.cd_friction,
            s.coefficients.cm,
            s.coefficients.cp_min,
            s.coefficients.transition[0],
            s.coefficients.transition[1],
        ];
        let values: Vec<String> = values.into_iter().map(number).collect();
        text.push_str(&format!(
            "{},{},{},{:e},{seconds:.6},\"{}\"\n",
            s.alpha.to_degrees(),
            values.join(","),
            s.iterations,
            s.residual,
            s.status
        ));
    }
    text
}
