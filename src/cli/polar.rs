//! `aeroform polar`: a sweep of the angle of attack.

use super::events::{EventArguments, Events};
use super::failure::Failure;
use super::figures;
use super::flow_arguments::{FlowArguments, Panelled, panelled};
use super::message::Voice;
use super::output::{print, print_json};
use super::table_csv::csv;
use crate::flow::{FlowError, PanelledSection, Settings, Solution};
use crate::report::json::{AnalysisReport, PolarReport, has_doubtful_numbers};
use crate::report::{OutputDirectory, engineering};
use serde::Serialize;
use std::io::Write;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
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
    pub json: bool,
    #[command(flatten)]
    events: EventArguments,
}

/// Most points of a sweep.
const MOST_POINTS: usize = 10_000;

/// One point of the sweep and the seconds it took.
type Point = (Solution, f64);

pub(super) fn run(arguments: &PolarArguments) -> Result<(), Failure> {
    let alphas = angles(&arguments.alpha)?;
    let directory = match &arguments.out {
        Some(path) => Some(OutputDirectory::prepare(path).map_err(|e| Failure::Input(e.to_string()))?),
        None => None,
    };
    let section = panelled(&arguments.point)?;
    let mut display = Display::new(arguments, &section.repairs)?;
    let (points, broken) = sweep(arguments, &section.panels, &alphas, &mut display)?;
    if points.is_empty()
        && let Some(error) = broken
    {
        return Err(error);
    }
    if let Some(directory) = &directory {
        let solutions: Vec<Solution> = points.iter().map(|(s, _)| s.clone()).collect();
        let surroundings = figures::surroundings_text(&arguments.point.condition(Some(0.0), None)?);
        let title = format!("{}: {surroundings}", arguments.point.name());
        let files = [("polar.csv", table(&points)?), ("polar.svg", figures::polar(&solutions, &title))];
        directory.write_all(files).map_err(|e| Failure::Computation(e.to_string()))?;
    }
    if arguments.json {
        print_json(&report(arguments, &section, &points))?;
    }
    if let Some(error) = broken {
        let reason = error.untold().unwrap_or("the sweep was not finished");
        return Err(Failure::Told(format!("{reason}; {} of {} points were found", points.len(), alphas.len())));
    }
    let failed = points.iter().filter(|(s, _)| !s.is_reliable()).count();
    if failed == 0 {
        return Ok(());
    }
    Err(Failure::Told(format!("{failed} of {} points do not hold; their status says why", points.len())))
}

fn report(arguments: &PolarArguments, section: &Panelled, points: &[Point]) -> PolarReport {
    PolarReport {
        section: arguments.point.shape.clone(),
        repairs: section.repairs.clone(),
        points: points.iter().map(|(s, seconds)| AnalysisReport::new(s, *seconds, &section.repairs)).collect(),
    }
}

/// A point as an event.
#[derive(Serialize)]
struct PointEvent {
    event: &'static str,
    #[serde(flatten)]
    point: AnalysisReport,
}

/// Shows the points in their order as they come.
struct Display<'a> {
    rows: Rows,
    /// Whether the head of the table has been shown.
    headed: bool,
    events: Events,
    repairs: &'a [String],
}

/// Where the rows of the table go.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Rows {
    Output,
    Errors,
    Nowhere,
}

impl<'a> Display<'a> {
    fn new(arguments: &PolarArguments, repairs: &'a [String]) -> Result<Self, Failure> {
        let events = arguments.events.open()?;
        let rows = match (arguments.json, Voice::current().quiet || events.take_standard_error()) {
            (false, _) => Rows::Output,
            (true, false) => Rows::Errors,
            (true, true) => Rows::Nowhere,
        };
        Ok(Self { rows, headed: false, events, repairs })
    }

    fn line(&self, line: &str) -> Result<(), Failure> {
        match self.rows {
            Rows::Output => print(&format!("{line}\n")),
            Rows::Errors => {
                let _ = writeln!(std::io::stderr().lock(), "{line}");
                Ok(())
            }
            Rows::Nowhere => Ok(()),
        }
    }

    fn show(&mut self, (solution, seconds): &Point) -> Result<(), Failure> {
        if !std::mem::replace(&mut self.headed, true) {
            let heads: Vec<String> = COLUMNS.iter().map(|(name, width, _)| format!("{name:>width$}")).collect();
            self.line(&format!("{}  status", heads.join("  ")))?;
        }
        let point = AnalysisReport::new(solution, *seconds, self.repairs);
        self.events.send(&PointEvent { event: "point", point });
        let given = solution.is_reliable() || has_doubtful_numbers(solution);
        let cell = |(name, width, of): &Column| match given || *name == "alpha" {
            true => format!("{:>width$}", of(solution)),
            false => format!("{:>width$}", "-"),
        };
        let cells: Vec<String> = COLUMNS.iter().map(cell).collect();
        self.line(&format!("{}  {}", cells.join("  "), solution.status))
    }
}

/// A column of the table in the terminal: name, width and text.
type Column = (&'static str, usize, fn(&Solution) -> String);

/// Columns with a fixed width, so that rows can be printed as they come.
const COLUMNS: [Column; 9] = [
    ("alpha", 8, |s| format!("{:.3}", s.alpha.to_degrees())),
    ("CL", 8, |s| format!("{:.5}", s.coefficients.cl)),
    ("CD, counts", 10, |s| format!("{:.2}", 1e4 * s.coefficients.cd)),
    ("pressure", 8, |s| format!("{:.2}", 1e4 * s.cd_pressure)),
    ("Cm", 8, |s| format!("{:.5}", s.coefficients.cm)),
    ("CL/CD", 7, |s| engineering(s.coefficients.cl / s.coefficients.cd, 4)),
    ("xtr upper", 9, |s| format!("{:.4}", s.coefficients.transition[0])),
    ("xtr lower", 9, |s| format!("{:.4}", s.coefficients.transition[1])),
    ("iterations", 10, |s| s.iterations.to_string()),
];

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

/// Solves all points and shows them in their order; each job takes a run of neighbouring ones, every point starting from
/// the last.
///
/// An error of one point ends the sweep: the points before it are given with the error.
fn sweep(
    arguments: &PolarArguments,
    section: &PanelledSection,
    alphas: &[f64],
    display: &mut Display<'_>,
) -> Result<(Vec<Point>, Option<Failure>), Failure> {
    let jobs = arguments.jobs.clamp(1, alphas.len().max(1));
    let chunk = alphas.len().div_ceil(jobs).max(1);
    let stopped = AtomicBool::new(false);
    let (sender, receiver) = mpsc::channel::<Found>();
    let solve = |first: usize, run: &[f64], sender: mpsc::Sender<Found>| {
        let mut last: Option<Solution> = None;
        for (k, &alpha) in run.iter().enumerate() {
            if stopped.load(Ordering::Relaxed) {
                return;
            }
            let point = solve_point(arguments, section, alpha, last.as_ref().filter(|s| s.is_reliable()));
            last = point.as_ref().ok().map(|(solution, _)| solution.clone());
            let over = point.is_err();
            if sender.send((first + k, point)).is_err() || over {
                return;
            }
        }
    };
    let solve = &solve;
    std::thread::scope(|scope| {
        for (job, run) in alphas.chunks(chunk).enumerate() {
            let own = sender.clone();
            let begun = std::thread::Builder::new().spawn_scoped(scope, move || solve(job * chunk, run, own));
            // without a thread to be had, the work is done here
            if begun.is_err() {
                solve(job * chunk, run, sender.clone());
            }
        }
        // the channel closes with the last job
        drop(sender);
        let result = gather(receiver, alphas.len(), display);
        stopped.store(true, Ordering::Relaxed);
        result
    })
}

/// A point by its place in the sweep.
type Found = (usize, Result<Point, Failure>);

fn solve_point(
    arguments: &PolarArguments,
    section: &PanelledSection,
    alpha: f64,
    warm: Option<&Solution>,
) -> Result<Point, Failure> {
    let begin = Instant::now();
    let condition = arguments.point.condition(Some(alpha), None)?;
    let solution = section
        .analyze(&condition, &Settings::default(), warm)
        .map_err(|e: FlowError| Failure::Input(format!("{}: {e}", arguments.point.shape)))?;
    Ok((solution, begin.elapsed().as_secs_f64()))
}

/// Takes the points as they come and shows them in their order, up to the first error.
fn gather(
    receiver: mpsc::Receiver<Found>,
    count: usize,
    display: &mut Display<'_>,
) -> Result<(Vec<Point>, Option<Failure>), Failure> {
    let mut waiting: Vec<Option<Result<Point, Failure>>> = (0..count).map(|_| None).collect();
    let mut points = Vec::with_capacity(count);
    for (index, point) in receiver {
        waiting[index] = Some(point);
        while let Some(next) = waiting.get_mut(points.len()).and_then(Option::take) {
            match next {
                Ok(point) => {
                    display.show(&point)?;
                    points.push(point);
                }
                Err(error) => return Ok((points, Some(error))),
            }
        }
    }
    let missing = points.len() < count;
    Ok((points, missing.then(|| Failure::Computation("a sweep ended unexpectedly".into()))))
}

/// The points as CSV. Those beyond the model have their numbers and say so; those without a flow have none.
fn table(points: &[Point]) -> Result<String, Failure> {
    const HEADER: [&str; 14] = [
        "alpha",
        "cl",
        "cd",
        "cd_pressure",
        "cd_friction",
        "cm",
        "cp_min",
        "transition_upper",
        "transition_lower",
        "iterations",
        "residual",
        "seconds",
        "status",
        "beyond_model",
    ];
    let rows = points.iter().map(|(s, seconds)| {
        let given = s.is_reliable() || has_doubtful_numbers(s);
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
        let mut row = vec![s.alpha.to_degrees().to_string()];
        row.extend(values.map(|value| if given { value.to_string() } else { String::new() }));
        row.extend([s.iterations.to_string(), format!("{:e}", s.residual), format!("{seconds:.6}")]);
        row.extend([s.status.to_string(), has_doubtful_numbers(s).to_string()]);
        row
    });
    csv(&HEADER, rows)
}
