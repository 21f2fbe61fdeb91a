//! `validate`: tables of what the library computes against what is known from elsewhere.
//!
//! Every table names the source of its expected values. Exit status 0: all rows hold; 1: some do not; 2: bad usage.

mod differences;
mod drag;
mod embedding;
mod exact;
mod flow;
mod folding;
mod l2;
mod optimise;
mod random;
mod sheet;
mod started;
mod transonic;

use clap::{Parser, ValueEnum};
use flow::FlowArguments;
use sheet::Sheet;
use std::process::ExitCode;
use std::time::Instant;

/// Tables of computed against known values.
#[derive(Debug, Parser)]
#[command(name = "validate", version, about)]
struct Arguments {
    /// Topics to validate [default: everything]
    topics: Vec<Topic>,
    /// Fewer random samples, for continuous integration
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    flow: FlowArguments,
}

/// A topic of the validation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Topic {
    /// Closed forms: areas, circles and ellipses, basis functions, penalty and norms
    Exact,
    /// Parameters of random points in boxes of degree 1 to 5
    Embedding,
    /// The shape match of the paper and finer boxes
    L2,
    /// Unfolded boxes and self-intersections
    Folding,
    /// Every derivative by two automatic routes and by finite differences
    Differences,
    /// Flow: exact solutions, other codes, gradients, smoothness; with --database convergence over many sections
    Flow,
    /// Flow with shocks: MSES, gradients, smoothness, grids, time
    Transonic,
    /// Constrained drag minimisation: the paper's cases, finite-difference gradients in the same optimiser
    Drag,
    /// Evaluations of the constrained optimiser beside those of other codes, and from random starts
    Optimise,
}

/// Error of a topic that could not be carried through.
type Failure = Box<dyn std::error::Error>;

impl Topic {
    fn run(self, arguments: &Arguments) -> Result<Vec<Sheet>, Failure> {
        let quick = arguments.quick;
        match self {
            Self::Exact => exact::sheets(),
            Self::Embedding => embedding::sheets(quick),
            Self::L2 => l2::sheets(),
            Self::Folding => folding::sheets(quick),
            Self::Differences => differences::sheets(quick),
            Self::Flow => Ok(flow::sheets(&arguments.flow, quick)),
            Self::Transonic => transonic::sheets(quick),
            Self::Drag => drag::sheets(quick),
            Self::Optimise => optimise::sheets(quick),
        }
    }
}

fn main() -> ExitCode {
    let mut arguments = Arguments::parse();
    if arguments.topics.is_empty() {
        arguments.topics = Topic::value_variants().to_vec();
    }
    let (mut rows, mut failures) = (0, 0);
    for topic in arguments.topics.clone() {
        let start = Instant::now();
        match topic.run(&arguments) {
            Ok(sheets) => {
                for sheet in sheets {
                    println!("{sheet}");
                    rows += sheet.rows();
                    failures += sheet.failures();
                }
            }
            Err(error) => {
                println!("{topic:?} could not be carried through: {error}\n");
                failures += 1;
            }
        }
        eprintln!("validate: {topic:?} took {:.1} s", start.elapsed().as_secs_f64());
    }
    println!("{rows} rows, {failures} failed");
    if failures == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
