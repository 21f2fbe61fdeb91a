//! `aeroform analyze`: one operating point of a section.

use super::failure::Failure;
use super::figures;
use super::flow_arguments::{FlowArguments, Panelled, panelled};
use super::message::Voice;
use super::output::{pretty, print, print_json, settled};
use super::table_csv::csv;
use crate::flow::{InviscidSolution, Solution, SolverChoice, StationFlow};
use crate::report::json::{AnalysisReport, InviscidReport};
use crate::report::{OutputDirectory, engineering};
use std::path::PathBuf;
use std::time::Instant;

/// Arguments of `aeroform analyze`.
#[derive(Debug, clap::Args)]
pub(super) struct AnalyzeArguments {
    #[command(flatten)]
    point: FlowArguments,
    /// Angle of attack in degrees
    #[arg(long, allow_negative_numbers = true, required_unless_present = "cl", conflicts_with = "cl")]
    alpha: Option<f64>,
    /// Mach number
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    mach: f64,
    /// Lift coefficient; the angle of attack is found
    #[arg(long, allow_negative_numbers = true)]
    cl: Option<f64>,
    /// Without boundary layer
    #[arg(long, conflicts_with = "cl")]
    inviscid: bool,
    /// Write figures, boundary-layer table and result.json into this directory
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Also the exact derivatives with respect to angle (per degree), Mach and Reynolds number and every node
    #[arg(long)]
    gradients: bool,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

pub(super) fn run(arguments: &AnalyzeArguments) -> Result<(), Failure> {
    let directory = match &arguments.out {
        Some(path) => Some(OutputDirectory::prepare(path).map_err(|e| Failure::Input(e.to_string()))?),
        None => None,
    };
    let section = panelled(&arguments.point)?;
    let condition = arguments.point.condition(arguments.mach, arguments.alpha, arguments.cl)?;
    let input = |e: crate::flow::FlowError| Failure::Input(format!("{}: {e}", arguments.point.shape.shape));
    let begin = Instant::now();
    if arguments.inviscid {
        if arguments.point.solver != SolverChoice::Panel {
            let message = "--inviscid is a flow of the panel solver; leave --solver out";
            return Err(Failure::Input(message.into()));
        }
        let alpha = arguments.alpha.unwrap_or(0.0).to_radians();
        let solution = section.panels.inviscid(alpha, condition.mach).map_err(input)?;
        return inviscid(arguments, &section, &solution, directory.as_ref(), begin.elapsed().as_secs_f64());
    }
    let solution = section.flow.analyze(&condition, None).map_err(input)?;
    let seconds = begin.elapsed().as_secs_f64();
    let mut result = AnalysisReport::new(&solution, seconds, &section.repairs);
    if let Some(alpha) = arguments.alpha {
        result = result.at_angle(alpha);
    }
    if arguments.gradients {
        result = result.with_gradients(&solution, &section.nodes);
    }
    if let Some(directory) = &directory {
        let files = files(arguments, &solution, &result)?;
        directory.write_all(files).map_err(|e| Failure::Computation(e.to_string()))?;
    }
    if arguments.json {
        print_json(&result)?
    } else {
        print(&as_text(arguments, &solution, seconds))?
    }
    if solution.is_reliable() {
        return Ok(());
    }
    Err(Failure::Told(format!("{}: {}", arguments.point.shape.shape, solution.status)))
}

/// Names and contents of the files of a point. A flow that was not found has no figures.
fn files(
    arguments: &AnalyzeArguments,
    solution: &Solution,
    result: &AnalysisReport,
) -> Result<Vec<(&'static str, String)>, Failure> {
    let mut files = vec![("result.json", pretty(result)?)];
    if solution.is_solved() {
        let title = title(arguments, solution);
        files.extend([
            ("pressure.svg", figures::pressure(solution, &title)),
            ("boundary_layer.svg", figures::boundary_layer(solution, &title)),
            ("section.svg", figures::displacement(solution, &title)),
            ("boundary_layer.csv", boundary_layer_csv(solution)?),
        ]);
        files.extend(figures::mach_field(solution, &title).map(|svg| ("mach.svg", svg)));
    }
    Ok(files)
}

fn title(arguments: &AnalyzeArguments, solution: &Solution) -> String {
    let coefficients = &solution.coefficients;
    let doubt = if solution.is_reliable() { "" } else { ", beyond the model" };
    format!(
        "{}: {}; α {}°, CL {}, CD {} counts, Cm {}{doubt}",
        arguments.point.shape.name(),
        figures::surroundings_text(&solution.condition),
        engineering(settled(solution.alpha.to_degrees()), 4),
        engineering(settled(coefficients.cl), 4),
        engineering(1e4 * coefficients.cd, 4),
        engineering(settled(coefficients.cm), 3),
    )
}

/// The solver of a flow and the nodes of the section in words.
fn resolution(arguments: &AnalyzeArguments, solution: &Solution) -> String {
    let panels = arguments.point.panels;
    // the usual solver needs no name
    if solution.solver == SolverChoice::Panel.name() {
        return format!("{panels} panels");
    }
    format!("{} solver, {panels} intervals between nodes", solution.solver)
}

/// Digits of a coefficient in text.
const DIGITS: usize = 5;

fn as_text(arguments: &AnalyzeArguments, solution: &Solution, seconds: f64) -> String {
    // the status of a flow that was not found names the residual itself
    let residual = if solution.is_solved() { format!("residual {:.1e}, ", solution.residual) } else { String::new() };
    let mut text = format!(
        "{}, {}, {}\n{} ({}{} iterations, {} s)\n",
        arguments.point.shape.shape,
        resolution(arguments, solution),
        figures::condition_text(&solution.condition),
        solution.status,
        residual,
        solution.iterations,
        engineering(seconds, 3)
    );
    if Voice::current().verbose {
        for attempt in &solution.attempts {
            let (what, iterations, residual) = (&attempt.what, attempt.iterations, attempt.residual);
            text.push_str(&format!("  tried: {what}: {iterations} iterations, residual {residual:.1e}\n"));
        }
    }
    if solution.status.is_beyond_model() {
        text.push_str("the numbers show a trend at best: they are not to be relied on\n");
    } else if !solution.is_reliable() {
        return text;
    }
    let coefficients = &solution.coefficients;
    let mut numbers = vec![
        ("alpha", settled(solution.alpha.to_degrees()), " degrees"),
        ("CL", settled(coefficients.cl), ""),
        ("CD", 1e4 * coefficients.cd, " counts"),
        ("CD pressure", 1e4 * solution.cd_pressure, " counts"),
        ("CD friction", 1e4 * solution.cd_friction, " counts"),
        ("CL/CD", settled(coefficients.cl) / coefficients.cd, ""),
        ("Cm (c/4)", settled(coefficients.cm), ""),
        ("Cp minimum", coefficients.cp_min, ""),
        ("transition upper x/c", coefficients.transition[0], ""),
        ("transition lower x/c", coefficients.transition[1], ""),
    ];
    if solution.solver == SolverChoice::Streamtube.name() {
        numbers.insert(3, ("CD wave", 1e4 * settled(solution.cd_wave), " counts"));
    }
    for (name, value, unit) in numbers {
        text.push_str(&format!("  {name:22} {:>12}{unit}\n", engineering(value, DIGITS)));
    }
    if let Some(error) = solution.discretisation_error().filter(|error| !error.is_small(coefficients)) {
        let [panels, stations] = [error.panels, error.stations]
            .map(|e| format!("{} in CL and {} counts in CD", engineering(e.cl, 2), engineering(1e4 * e.cd, 2)));
        text.push_str(&format!(
            "the numbers are not resolved: {} panels leave an estimated error of {panels} (see --panels), the stations of \
             the boundary layer one of {stations} (see --stations)\n",
            arguments.point.panels,
        ));
    }
    text
}

/// A column of the table of the boundary layer: its name and its number.
type StationColumn = (&'static str, fn(&StationFlow) -> f64);

/// Columns after the name of the side.
const STATION: [StationColumn; 12] = [
    ("s", |p| p.s),
    ("x", |p| p.x),
    ("y", |p| p.y),
    ("edge_velocity", |p| p.edge_velocity),
    ("mach", |p| p.mach),
    ("cp", |p| p.cp),
    ("momentum_thickness", |p| p.momentum_thickness),
    ("displacement_thickness", |p| p.displacement_thickness),
    ("shape_parameter", |p| p.shape_parameter),
    ("skin_friction", |p| p.skin_friction),
    ("amplification", |p| p.amplification),
    ("shear_stress", |p| p.shear_stress),
];

fn boundary_layer_csv(solution: &Solution) -> Result<String, Failure> {
    let distributions = solution.distributions();
    let sides = [("upper", &distributions.upper), ("lower", &distributions.lower), ("wake", &distributions.wake)];
    let row = |name: &str, station: &StationFlow| -> Vec<String> {
        std::iter::once(name.to_string()).chain(STATION.iter().map(|(_, of)| of(station).to_string())).collect()
    };
    let rows = sides.iter().flat_map(|(name, side)| side.iter().map(move |station| row(name, station)));
    let header: Vec<&str> = std::iter::once("side").chain(STATION.iter().map(|(name, _)| *name)).collect();
    csv(&header, rows)
}

fn inviscid(
    arguments: &AnalyzeArguments,
    section: &Panelled,
    solution: &InviscidSolution,
    directory: Option<&OutputDirectory>,
    seconds: f64,
) -> Result<(), Failure> {
    let mach = arguments.mach;
    let alpha = arguments.alpha.unwrap_or(0.0);
    let result = InviscidReport { alpha, ..InviscidReport::new(solution, seconds, &section.repairs) };
    let alpha = engineering(alpha, 4);
    if let Some(directory) = directory {
        let cl = engineering(settled(solution.cl), 4);
        let title = format!("{}: inviscid, α {alpha}°, M {mach}, CL {cl}", arguments.point.shape.name());
        let figure = figures::inviscid_pressure(solution, &title);
        let files = [("result.json", pretty(&result)?), ("pressure.svg", figure)];
        directory.write_all(files).map_err(|e| Failure::Computation(e.to_string()))?;
    }
    let failure = Failure::Told(format!("{}: {}", arguments.point.shape.shape, solution.status));
    let end = if result.converged { Ok(()) } else { Err(failure) };
    if arguments.json {
        print_json(&result)?;
        return end;
    }
    let number = |value: f64| engineering(settled(value), DIGITS);
    print(&format!(
        "{}, {} panels, inviscid, alpha {alpha} degrees, M {mach}\n  CL {}\n  Cm (c/4) {}\n  Cp minimum {}\n",
        arguments.point.shape.shape,
        arguments.point.panels,
        number(solution.cl),
        number(solution.cm),
        number(solution.cp_min)
    ))?;
    end
}
