//! One hot path at a time, for counting instructions: `instructions HOT_PATH REPETITIONS`.
//!
//! Counts of 1 and of 1 + n repetitions differ by n times the hot path alone, set-up excluded; see `benches/README.md`.
//! Without arguments (as `cargo bench` calls it) it runs every hot path once.

mod cases;
mod points;
#[allow(dead_code)]
mod sections;

use aeroform::design::{Problem, check_gradients};
use aeroform::ffd::BoxEvaluator;
use aeroform::flow::{PanelledSection, Settings, TrailingEdge};
use aeroform::optimize::{Method, Optimizer};
use aeroform::section::SectionDefinition;
use std::hint::black_box;
use std::ops::ControlFlow;
use std::process::ExitCode;

const HOT_PATHS: [&str; 14] = [
    "ffd_evaluate_10000",
    "ffd_embed_1000",
    "l2_value_32",
    "l2_evaluate_32",
    "l2_value_512",
    "l2_evaluate_512",
    "l2_hessian_32",
    "l2_match_lbfgs",
    "l2_match_newton",
    "naca_section",
    "check_gradients_32",
    "flow_cold_point",
    "flow_warm_point",
    "flow_gradients",
];

fn run(name: &str, repetitions: usize) -> Option<()> {
    let repeat = |f: &mut dyn FnMut()| (0..repetitions).for_each(|_| f());
    match name {
        "ffd_evaluate_10000" => {
            let evaluator = BoxEvaluator::new(&points::deformed());
            let parameters = points::scattered(10_000);
            let mut moved = vec![[0.0; 2]; parameters.len()];
            repeat(&mut || evaluator.evaluate_many(black_box(&parameters), black_box(&mut moved)));
        }
        "ffd_embed_1000" => {
            let lattice = points::bicubic();
            let inside = points::inside(1000);
            repeat(&mut || drop(black_box(lattice.embed(black_box(&inside)))));
        }
        "l2_value_32" | "l2_value_512" | "l2_evaluate_32" | "l2_evaluate_512" | "l2_hessian_32" => {
            let mut problem = cases::open(if name.ends_with("512") { 16 } else { 4 }, "lbfgs").problem;
            let x = cases::shaken(&problem.description().start);
            match name.split('_').nth(1)? {
                "value" => repeat(&mut || drop(black_box(problem.objective(black_box(&x))))),
                "evaluate" => repeat(&mut || drop(black_box(problem.evaluate(black_box(&x))))),
                _ => repeat(&mut || drop(black_box(problem.hessian(black_box(&x))))),
            }
        }
        "l2_match_lbfgs" | "l2_match_newton" => {
            let name = name.rsplit('_').next()?;
            let case = cases::open(4, name);
            let method = Method::from_name(name).ok()?;
            repeat(&mut || {
                let outcome = method.minimize(&mut case.problem.clone(), &mut |_| ControlFlow::Continue(()));
                drop(black_box(outcome));
            });
        }
        "naca_section" => repeat(&mut || {
            let definition = SectionDefinition::parse(black_box("naca2412:sharp"));
            drop(black_box(definition.and_then(|d| d.section())));
        }),
        "check_gradients_32" => {
            let mut problem = cases::open(4, "lbfgs").problem;
            let x = problem.unscaled(&cases::shaken(&problem.description().start));
            repeat(&mut || drop(black_box(check_gradients(&mut problem, black_box(&x)))));
        }
        "flow_cold_point" => {
            let nodes = sections::nodes("naca0012");
            let at = sections::condition(2.0, 1e6, [None; 2]);
            repeat(&mut || drop(black_box(sections::cold(black_box(&nodes), &at))));
        }
        "flow_warm_point" => {
            let nodes = sections::nodes("naca0012");
            let section = PanelledSection::new(&nodes, TrailingEdge::Blunt).ok()?;
            let before = sections::polar(&section, std::iter::once(1.5), 1e6).pop()?;
            let (at, settings) = (sections::condition(2.0, 1e6, [None; 2]), Settings::default());
            repeat(&mut || drop(black_box(section.analyze(black_box(&at), &settings, Some(&before)))));
        }
        "flow_gradients" => {
            let solution = sections::cold(&sections::nodes("naca0012"), &sections::condition(2.0, 1e6, [None; 2]));
            repeat(&mut || drop(black_box(black_box(&solution).gradients())));
        }
        _ => return None,
    }
    Some(())
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let repetitions = arguments.get(1).and_then(|n| n.parse().ok()).unwrap_or(1);
    match arguments.first() {
        None if HOT_PATHS.iter().all(|name| run(name, 1).is_some()) => ExitCode::SUCCESS,
        Some(name) if run(name, repetitions).is_some() => ExitCode::SUCCESS,
        _ => {
            eprintln!("instructions HOT_PATH REPETITIONS, with HOT_PATH one of: {}", HOT_PATHS.join(", "));
            ExitCode::from(2)
        }
    }
}
