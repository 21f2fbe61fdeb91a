//! `aeroform polar`: a sweep of the angle of attack or of the Mach number.

use super::events::{EventArguments, Events};
use super::failure::Failure;
use super::figures;
use super::flow_arguments::{FlowArguments, Panelled, panelled};
use super::message::Voice;
use super::output::{fixed, print, print_json, settled};
use super::table_csv::csv;
use crate::flow::{FlowError, FlowSection, Solution};
use crate::report::json::{AnalysisReport, PolarReport};
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
    /// Angles of attack in degrees, or one angle beside a range of Mach numbers
    #[arg(long, value_name = "FIRST:LAST:STEP", allow_hyphen_values = true, required_unless_present = "cl")]
    alpha: Option<String>,
    /// Mach number, or a range of Mach numbers for a drag rise
    #[arg(long, value_name = "M or FIRST:LAST:STEP", default_value = "0", allow_hyphen_values = true)]
    mach: String,
    /// Lift coefficient held over a range of Mach numbers; the angles of attack are found
    #[arg(long, allow_negative_numbers = true, conflicts_with = "alpha")]
    cl: Option<f64>,
    /// Sweeps to run side by side
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
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

/// The condition that is asked for at a point of a sweep.
#[derive(Clone, Copy)]
struct Place {
    mach: f64,
    /// Angle of attack in degrees; `None` where the lift coefficient is held.
    alpha: Option<f64>,
}

/// The places of a sweep.
struct Places {
    all: Vec<Place>,
    /// Whether the Mach number changes from place to place.
    by_mach: bool,
}

impl Places {
    fn new(arguments: &PolarArguments) -> Result<Self, Failure> {
        let machs = range("--mach", &arguments.mach, "")?;
        let by_mach = machs.len() > 1;
        let alphas = arguments.alpha.as_ref().map(|text| range("--alpha", text, " in degrees")).transpose()?;
        let input = |text: String| Err(Failure::Input(text));
        let all = match alphas {
            Some(alphas) if by_mach && alphas.len() > 1 => {
                let [a, m] = [alphas.len(), machs.len()];
                return input(format!("{a} angles of attack and {m} Mach numbers: give a range of one of them only"));
            }
            None if !by_mach => {
                return input("--cl is held over a range of Mach numbers: write --mach FIRST:LAST:STEP".into());
            }
            None => machs.into_iter().map(|mach| Place { mach, alpha: None }).collect(),
            Some(alphas) => {
                let at = |mach: f64| alphas.iter().map(move |&alpha| Place { mach, alpha: Some(alpha) });
                machs.into_iter().flat_map(at).collect()
            }
        };
        Ok(Self { all, by_mach })
    }
}

/// One point of a sweep.
struct Point {
    place: Place,
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

    /// The solution, where it has numbers: within the model or beyond it.
    fn solved(&self) -> Option<&Solution> {
        self.solution().filter(|s| s.is_solved())
    }

    /// The status in words: of the flow, or the reason why there is none.
    fn status(&self) -> String {
        match &self.flow {
            Ok((solution, _)) => solution.status.to_string(),
            Err(failure) => failure.to_string(),
        }
    }

    fn report(&self, arguments: &PolarArguments, repairs: &[String]) -> AnalysisReport {
        match &self.flow {
            Ok((solution, seconds)) => {
                let report = AnalysisReport::new(solution, *seconds, repairs);
                self.place.alpha.map_or(report.clone(), |alpha| report.at_angle(alpha))
            }
            Err(_) => {
                let Place { mach, alpha } = self.place;
                let alpha = alpha.unwrap_or(f64::NAN);
                AnalysisReport::refused(alpha, mach, arguments.point.reynolds, self.status(), repairs)
            }
        }
    }
}

pub(super) fn run(arguments: &PolarArguments) -> Result<(), Failure> {
    let places = Places::new(arguments)?;
    let directory = match &arguments.out {
        Some(path) => Some(OutputDirectory::prepare(path).map_err(|e| Failure::Input(e.to_string()))?),
        None => None,
    };
    let section = panelled(&arguments.point)?;
    let mut display = Display::new(arguments, places.by_mach, &section.repairs)?;
    let mut points = sweep(arguments, &*section.flow, &places.all, &mut display)?;
    if points.iter().all(|p| p.flow.is_err())
        && let Some(Point { flow: Err(failure), .. }) = points.drain(..).next()
    {
        return Err(Failure::Input(format!("{}: {failure}", arguments.point.shape.shape)));
    }
    if let Some(directory) = &directory {
        let solutions: Vec<Solution> = points.iter().filter_map(Point::solution).cloned().collect();
        let name = arguments.point.shape.name();
        let figure = match solutions.first() {
            Some(first) if places.by_mach => {
                figures::drag_rise(&solutions, &format!("{name}: {}", figures::of_a_rise(first)))
            }
            _ => {
                let mach = places.all.first().map_or(0.0, |place| place.mach);
                let surroundings = figures::surroundings_text(&arguments.point.condition(mach, Some(0.0), None)?);
                figures::polar(&solutions, &format!("{name}: {surroundings}"))
            }
        };
        let files = [("polar.csv", table(&points)?), ("polar.svg", figure)];
        directory.write_all(files).map_err(|e| Failure::Computation(e.to_string()))?;
    }
    if arguments.json {
        print_json(&report(arguments, &section, &points))?;
    }
    let failed = points.iter().filter(|p| p.reliable().is_none()).count();
    if failed == 0 {
        return Ok(());
    }
    Err(Failure::Told(format!("{failed} of {} points do not hold; their status says why", points.len())))
}

fn report(arguments: &PolarArguments, section: &Panelled, points: &[Point]) -> PolarReport {
    PolarReport {
        section: arguments.point.shape.shape.clone(),
        repairs: section.repairs.clone(),
        points: points.iter().map(|point| point.report(arguments, &section.repairs)).collect(),
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
    arguments: &'a PolarArguments,
    rows: Rows,
    /// Whether the head of the table has been shown.
    headed: bool,
    events: Events,
    by_mach: bool,
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
    fn new(arguments: &'a PolarArguments, by_mach: bool, repairs: &'a [String]) -> Result<Self, Failure> {
        let events = arguments.events.open()?;
        let rows = match (arguments.json, Voice::current().quiet || events.take_standard_error()) {
            (false, _) => Rows::Output,
            (true, false) => Rows::Errors,
            (true, true) => Rows::Nowhere,
        };
        Ok(Self { arguments, rows, headed: false, events, by_mach, repairs })
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

    fn columns(&self) -> impl Iterator<Item = &'static Column> {
        let of_a_rise = if self.by_mach { &RISE_COLUMNS[..] } else { &[] };
        of_a_rise.iter().chain(&COLUMNS)
    }

    fn show(&mut self, point: &Point) -> Result<(), Failure> {
        if !std::mem::replace(&mut self.headed, true) {
            let heads: Vec<String> = self.columns().map(|(name, width, _)| format!("{name:>width$}")).collect();
            let first = if self.by_mach { "Mach" } else { "alpha" };
            self.line(&format!("{first:>8}  {}  status", heads.join("  ")))?;
        }
        self.events.send(&PointEvent { event: "point", point: point.report(self.arguments, self.repairs) });
        let cell = |(_, width, of): &Column| format!("{:>width$}", point.solved().map_or("-".into(), of));
        let cells: Vec<String> = self.columns().map(cell).collect();
        let first = if self.by_mach { point.place.mach } else { point.place.alpha.unwrap_or(f64::NAN) };
        self.line(&format!("{:>8}  {}  {}", fixed(first, 3), cells.join("  "), point.status()))
    }
}

/// A column of the table in the terminal: name, width and text.
type Column = (&'static str, usize, fn(&Solution) -> String);

/// Columns that a sweep of the Mach number has ahead of the others.
const RISE_COLUMNS: [Column; 2] =
    [("alpha", 8, |s| fixed(settled(s.alpha.to_degrees()), 3)), ("wave", 8, |s| fixed(1e4 * settled(s.cd_wave), 2))];

/// Columns with a fixed width, so that rows can be printed as they come.
const COLUMNS: [Column; 8] = [
    ("CL", 8, |s| fixed(s.coefficients.cl, 5)),
    ("CD, counts", 10, |s| fixed(1e4 * s.coefficients.cd, 2)),
    ("pressure", 8, |s| fixed(1e4 * s.cd_pressure, 2)),
    ("Cm", 8, |s| fixed(s.coefficients.cm, 5)),
    ("CL/CD", 7, |s| engineering(settled(s.coefficients.cl) / s.coefficients.cd, 4)),
    ("xtr upper", 9, |s| fixed(s.coefficients.transition[0], 4)),
    ("xtr lower", 9, |s| fixed(s.coefficients.transition[1], 4)),
    ("iterations", 10, |s| s.iterations.to_string()),
];

/// FIRST:LAST:STEP of an option in a unit, both ends included.
fn range(option: &str, text: &str, unit: &str) -> Result<Vec<f64>, Failure> {
    let wrong = |why: &str| Failure::Input(format!("{option} {text}: {why}; write FIRST:LAST:STEP{unit}"));
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
    // numbers of as many decimals as were asked for, not sums of rounded steps
    let decimals = text.split(':').map(decimals).max().unwrap_or(0);
    let round = |value: f64| format!("{value:.decimals$}").parse().unwrap_or(value) + 0.0;
    let all = (0..=(count + 1e-9).floor() as usize).map(|k| first + k as f64 * step);
    Ok(if decimals <= MOST_DECIMALS { all.map(round).collect() } else { all.collect() })
}

/// Decimals of numbers beyond which sums of steps are as good.
const MOST_DECIMALS: usize = 12;

/// Decimals of a number as it is written; as many as there may be of one with an exponent.
fn decimals(number: &str) -> usize {
    match number.trim().split_once('.') {
        _ if number.contains(['e', 'E']) => usize::MAX,
        Some((_, decimals)) => decimals.len(),
        None => 0,
    }
}

/// Solves all points and shows them in their order; each job takes a run of neighbouring ones, every point starting
/// from the last.
///
/// A point that has no flow keeps its reason, and the others their flows.
fn sweep(
    arguments: &PolarArguments,
    section: &dyn FlowSection,
    places: &[Place],
    display: &mut Display<'_>,
) -> Result<Vec<Point>, Failure> {
    let jobs = arguments.jobs.clamp(1, places.len().max(1));
    let chunk = places.len().div_ceil(jobs).max(1);
    let stopped = AtomicBool::new(false);
    let (sender, receiver) = mpsc::channel::<Found>();
    let solve = |first: usize, run: &[Place], sender: mpsc::Sender<Found>| {
        let mut last: Option<Solution> = None;
        for (k, &place) in run.iter().enumerate() {
            if stopped.load(Ordering::Relaxed) {
                return;
            }
            let flow = solve_point(arguments, section, place, last.as_ref().filter(|s| s.is_reliable()));
            last = flow.as_ref().ok().map(|(solution, _)| solution.clone());
            if sender.send((first + k, Point { place, flow })).is_err() {
                return;
            }
        }
    };
    let solve = &solve;
    std::thread::scope(|scope| {
        for (job, run) in places.chunks(chunk).enumerate() {
            let own = sender.clone();
            let begun = std::thread::Builder::new().spawn_scoped(scope, move || solve(job * chunk, run, own));
            // without a thread to be had, the work is done here
            if begun.is_err() {
                solve(job * chunk, run, sender.clone());
            }
        }
        // the channel closes with the last job
        drop(sender);
        let result = gather(receiver, places.len(), display);
        stopped.store(true, Ordering::Relaxed);
        result
    })
}

/// A point by its place in the sweep.
type Found = (usize, Point);

fn solve_point(
    arguments: &PolarArguments,
    section: &dyn FlowSection,
    place: Place,
    warm: Option<&Solution>,
) -> Result<(Solution, f64), Failure> {
    let begin = Instant::now();
    let condition = arguments.point.condition(place.mach, place.alpha, arguments.cl)?;
    let solution = section.analyze_next(&condition, warm).map_err(|e: FlowError| Failure::Input(e.to_string()))?;
    Ok((solution, begin.elapsed().as_secs_f64()))
}

/// Takes the points as they come and shows them in their order.
fn gather(receiver: mpsc::Receiver<Found>, count: usize, display: &mut Display<'_>) -> Result<Vec<Point>, Failure> {
    let mut waiting: Vec<Option<Point>> = (0..count).map(|_| None).collect();
    let mut points = Vec::with_capacity(count);
    for (index, point) in receiver {
        waiting[index] = Some(point);
        while let Some(next) = waiting.get_mut(points.len()).and_then(Option::take) {
            display.show(&next)?;
            points.push(next);
        }
    }
    if points.len() == count { Ok(points) } else { Err(Failure::Computation("a sweep ended unexpectedly".into())) }
}

/// The points as CSV. Those beyond the model have their numbers and say so; those without a flow have none.
fn table(points: &[Point]) -> Result<String, Failure> {
    const HEADER: [&str; 17] = [
        "alpha",
        "cl",
        "cd",
        "cd_pressure",
        "cd_friction",
        "cd_wave",
        "cm",
        "cp_min",
        "transition_upper",
        "transition_lower",
        "iterations",
        "residual",
        "seconds",
        "status",
        "beyond_model",
        "resolved",
        "mach",
    ];
    let rows = points.iter().map(|point| {
        let solved = |of: fn(&Solution) -> f64| point.solved().map_or(String::new(), |s| of(s).to_string());
        let found = |of: &dyn Fn(&(Solution, f64)) -> String| point.flow.as_ref().map_or(String::new(), of);
        [
            point.place.alpha.map_or_else(|| solved(|s| s.alpha.to_degrees()), |alpha| alpha.to_string()),
            solved(|s| s.coefficients.cl),
            solved(|s| s.coefficients.cd),
            solved(|s| s.cd_pressure),
            solved(|s| s.cd_friction),
            solved(|s| s.cd_wave),
            solved(|s| s.coefficients.cm),
            solved(|s| s.coefficients.cp_min),
            solved(|s| s.coefficients.transition[0]),
            solved(|s| s.coefficients.transition[1]),
            found(&|(s, _)| s.iterations.to_string()),
            found(&|(s, _)| format!("{:e}", s.residual)),
            found(&|(_, seconds)| format!("{seconds:.6}")),
            point.status(),
            point.solution().is_some_and(|s| s.status.is_beyond_model()).to_string(),
            point.solved().and_then(Solution::is_resolved).map_or(String::new(), |resolved| resolved.to_string()),
            point.place.mach.to_string(),
        ]
    });
    csv(&HEADER, rows)
}

#[cfg(test)]
mod tests {
    use super::range;

    #[test]
    fn numbers_are_those_asked_for() {
        let tenths = range("--alpha", "-0.3:0.3:0.1", "").unwrap();
        assert_eq!(tenths, [-0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3]);
        assert!(tenths[3].is_sign_positive());
        assert_eq!(range("--alpha", "4", "").unwrap(), [4.0]);
        assert_eq!(range("--alpha", "3:1", "").unwrap(), [3.0, 2.0, 1.0]);
        assert_eq!(range("--alpha", "0:1e-1:5e-2", "").unwrap(), [0.0, 0.05, 0.1]);
    }
}
