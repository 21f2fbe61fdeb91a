//! `aeroform analyze`: one operating point of a section.

use super::failure::Failure;
use super::figures;
use super::flow_arguments::{FlowArguments, panelled};
use super::output::{pretty, print, print_json};
use crate::flow::{InviscidSolution, Settings, Solution};
use crate::report::OutputDirectory;
use crate::report::json::{AnalysisReport, InviscidReport};
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
    json: bool,
}

pub(super) fn run(arguments: &AnalyzeArguments) -> Result<(), Failure> {
    let directory = match &arguments.out {
        Some(path) => Some(OutputDirectory::prepare(path).map_err(|e| Failure::Input(e.to_string()))?),
        None => None,
    };
    let (nodes, section) = panelled(&arguments.point)?;
    let condition = arguments.point.condition(arguments.alpha, arguments.cl)?;
    let input = |e: crate::flow::FlowError| Failure::Input(format!("{}: {e}", arguments.point.shape.shape));
    let begin = Instant::now();
    if arguments.inviscid {
        let alpha = arguments.alpha.unwrap_or(0.0).to_radians();
        let solution = section.inviscid(alpha, condition.mach).map_err(input)?;
        return inviscid(arguments, &nodes, &solution, directory.as_ref(), begin.elapsed().as_secs_f64());
    }
    let solution = section.analyze(&condition, &Settings::default(), None).map_err(input)?;
    let seconds = begin.elapsed().as_secs_f64();
    let mut result = AnalysisReport::new(&solution, seconds);
    if arguments.gradients {
        result = result.with_gradients(&solution, &nodes);
    }
    if let Some(directory) = &directory {
        let failed = |e: &dyn std::fmt::Display| Failure::Computation(e.to_string());
        let title = title(arguments, &solution);
        let files = [
            ("result.json", pretty(&result)?),
            ("pressure.svg", figures::pressure(&nodes, &solution, &title).map_err(|e| failed(&e))?),
            ("section.svg", figures::displacement(&nodes, &solution, &title).map_err(|e| failed(&e))?),
            ("boundary_layer.csv", boundary_layer_csv(&solution)),
        ];
        directory.write_all(files).map_err(|e| failed(&e))?;
    }
    if arguments.json {
        print_json(&result)?
    } else {
        print(&as_text(arguments, &solution, seconds))?
    }
    if solution.is_reliable() {
        return Ok(());
    }
    Err(Failure::Computation(format!("{}: {}", arguments.point.shape.shape, solution.status)))
}

fn title(arguments: &AnalyzeArguments, solution: &Solution) -> String {
    let condition = solution.condition;
    format!(
        "{}: alpha {:.2} deg, M {}, Re {:.3e}, CL {:.4}, CD {:.5}",
        arguments.point.shape.name(),
        solution.alpha.to_degrees(),
        condition.mach,
        condition.reynolds,
        solution.coefficients.cl,
        solution.coefficients.cd
    )
}

fn as_text(arguments: &AnalyzeArguments, solution: &Solution, seconds: f64) -> String {
    let condition = solution.condition;
    let mut text = format!(
        "{}, {} panels: {} (residual {:.1e}, {} iterations, {seconds:.3} s)\n",
        arguments.point.shape.shape, arguments.point.panels, solution.status, solution.residual, solution.iterations
    );
    for attempt in &solution.attempts {
        let (what, iterations, residual) = (&attempt.what, attempt.iterations, attempt.residual);
        text.push_str(&format!("  tried: {what}: {iterations} iterations, residual {residual:.1e}\n"));
    }
    if !solution.is_reliable() {
        return text;
    }
    for (name, value) in [
        ("alpha (degrees)", solution.alpha.to_degrees()),
        ("Mach", condition.mach),
        ("Reynolds", condition.reynolds),
        ("CL", solution.coefficients.cl),
        ("CD", solution.coefficients.cd),
        ("CD pressure", solution.cd_pressure),
        ("CD friction", solution.cd_friction),
        ("Cm (c/4)", solution.coefficients.cm),
        ("Cp minimum", solution.coefficients.cp_min),
        ("transition upper x/c", solution.coefficients.transition[0]),
        ("transition lower x/c", solution.coefficients.transition[1]),
    ] {
        text.push_str(&format!("  {name:22} {value:>14.7}\n"));
    }
    text
}

fn boundary_layer_csv(solution: &Solution) -> String {
    let mut text = String::from(
        "side,s,x,y,edge_velocity,cp,momentum_thickness,displacement_thickness,shape_parameter,skin_friction,amplification,shear_stress\n",
    );
    let distributions = solution.distributions();
    for (name, side) in
        [("upper", &distributions.upper), ("lower", &distributions.lower), ("wake", &distributions.wake)]
    {
        for p in side {
            text.push_str(&format!(
                "{name},{},{},{},{},{},{},{},{},{},{},{}\n",
                p.s,
                p.x,
                p.y,
                p.edge_velocity,
                p.cp,
                p.momentum_thickness,
                p.displacement_thickness,
                p.shape_parameter,
                p.skin_friction,
                p.amplification,
                p.shear_stress
            ));
        }
    }
    text
}

fn inviscid(
    arguments: &AnalyzeArguments,
    nodes: &[[f64; 2]],
    solution: &InviscidSolution,
    directory: Option<&OutputDirectory>,
    seconds: f64,
) -> Result<(), Failure> {
    let result = InviscidReport::new(solution, seconds);
    if let Some(directory) = directory {
        let failed = |e: &dyn std::fmt::Display| Failure::Computation(e.to_string());
        let title = format!("{}: inviscid, CL {:.4}", arguments.point.shape.name(), solution.cl);
        let files = [
            ("result.json", pretty(&result)?),
            ("pressure.svg", figures::inviscid_pressure(nodes, solution, &title).map_err(|e| failed(&e))?),
        ];
        directory.write_all(files).map_err(|e| failed(&e))?;
    }
    let failure = Failure::Computation(format!("{}: {}", arguments.point.shape.shape, solution.status));
    let end = if result.converged { Ok(()) } else { Err(failure) };
    if arguments.json {
        print_json(&result)?;
        return end;
    }
    print(&format!(
        "{}, {} panels, inviscid, alpha {} degrees, M {}\n  CL {:.6}\n  Cm (c/4) {:.6}\n  Cp minimum {:.5}\n",
        arguments.point.shape.shape,
        arguments.point.panels,
        solution.alpha.to_degrees(),
        arguments.point.mach,
        solution.cl,
        solution.cm,
        solution.cp_min
    ))?;
    end
}
