//! `aeroform gradients`: every derivative of a case, three ways.

use super::design_vector;
use super::failure::Failure;
use super::message::note;
use super::output::{print, print_json};
use super::overview::groups;
use crate::case::Case;
use crate::design::{DerivativeCheck, DesignProblem, check_gradients};
use crate::report::json::GradientsReport;

/// Arguments of `aeroform gradients`.
#[derive(Debug, clap::Args)]
pub(super) struct GradientsArguments {
    /// A TOML file or the name of a built-in case
    case: String,
    /// JSON file with the design vector to check at; missing variables keep their start; `-` reads standard input
    #[arg(long, value_name = "FILE.json")]
    at: Option<String>,
    /// Move every variable off that point by up to this share of its natural step first, so that no derivative
    /// vanishes by symmetry; 0 checks at the point itself
    #[arg(long, default_value_t = 0.05, allow_negative_numbers = true)]
    shake: f64,
    /// Print every derivative, not only the worst of each quantity
    #[arg(long)]
    all: bool,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

pub(super) fn run(arguments: &GradientsArguments) -> Result<(), Failure> {
    if !arguments.shake.is_finite() {
        return Err(Failure::Input(format!("--shake {}: must be finite", arguments.shake)));
    }
    let mut case = Case::open(&arguments.case)?;
    let mut values = design_vector::read(&case, arguments.at.as_deref())?;
    case.repairs().iter().for_each(note);
    shake(&case.problem, &mut values, arguments.shake);
    let checks = check_gradients(&mut case.problem, &values)
        .map_err(|e| Failure::Computation(format!("{}: no value here or a finite step away: {e}", case.name)))?;
    if arguments.json {
        print_json(&GradientsReport::new(&case, &values, &checks))?;
    } else {
        print(&as_text(&case.name, &checks, arguments.all))?;
    }
    verdict(&checks)
}

/// A failure where a derivative disagrees.
fn verdict(checks: &[DerivativeCheck]) -> Result<(), Failure> {
    match checks.iter().filter(|c| !c.agrees()).count() {
        0 => Ok(()),
        wrong => {
            Err(Failure::Told(format!("{wrong} of {} derivatives disagree beyond the estimated error", checks.len())))
        }
    }
}

/// A fixed pseudo-random movement, the same on every run, kept within the bounds.
fn shake(problem: &DesignProblem, values: &mut [f64], share: f64) {
    for (k, (value, variable)) in values.iter_mut().zip(problem.geometry().variables()).enumerate() {
        let moved = *value + share * variable.step * (12.9898 * (k + 1) as f64).sin();
        *value = moved.clamp(variable.bounds.lower, variable.bounds.upper);
    }
}

/// The names in groups: families together, every other name alone.
fn families<'a>(names: &[&'a str]) -> Vec<Vec<&'a str>> {
    groups(names).into_iter().map(|group| group.members.into_iter().map(|k| names[k]).collect()).collect()
}

fn as_text(name: &str, checks: &[DerivativeCheck], all: bool) -> String {
    let mut text = format!(
        "{name}: exact derivatives against plain forward mode and finite differences\n\
         (deviation, estimate and routes relative to the gradient of the quantity)\n\n\
         {:20} {:12} {:>20} {:>20} {:>10} {:>10} {:>10}\n",
        "quantity", "variable", "exact", "finite difference", "deviation", "estimate", "two routes"
    );
    let mut quantities: Vec<&str> = checks.iter().map(|c| c.quantity.as_str()).collect();
    quantities.dedup();
    let together = if all { quantities.iter().map(|q| vec![*q]).collect() } else { families(&quantities) };
    for members in together {
        let rows: Vec<&DerivativeCheck> = checks.iter().filter(|c| members.contains(&c.quantity.as_str())).collect();
        let worst = rows.iter().max_by(|a, b| a.difference_deviation().total_cmp(&b.difference_deviation()));
        let shown = if all { rows.clone() } else { worst.map(|c| vec![*c]).unwrap_or_default() };
        for c in shown {
            let estimate = if c.scale > 0.0 { c.difference_error / c.scale } else { c.difference_error };
            text.push_str(&format!(
                "{:20} {:12} {:20.12e} {:20.12e} {:10.1e} {:10.1e} {:10.1e}{}\n",
                c.quantity,
                c.variable,
                c.exact,
                c.difference,
                c.difference_deviation(),
                estimate,
                c.route_error(),
                if c.agrees() { "" } else { "  DISAGREES" }
            ));
        }
        let agreeing = rows.iter().filter(|c| c.agrees()).count();
        let route = rows.iter().map(|c| c.route_error()).fold(0.0, f64::max);
        text.push_str(&format!(
            "{:20} {agreeing} of {} agree{}; worst between the two automatic routes {route:.1e}\n\n",
            "",
            rows.len(),
            if members.len() > 1 { format!(" in {} quantities of this family", members.len()) } else { String::new() }
        ));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(exact: f64) -> DerivativeCheck {
        DerivativeCheck {
            quantity: "cd".into(),
            variable: "dy[1,1]".into(),
            exact,
            forward: 2.0,
            difference: 2.0,
            difference_error: 1e-8,
            scale: 2.0,
        }
    }

    #[test]
    fn one_derivative_that_disagrees_is_exit_status_1() {
        assert!(verdict(&[check(2.0), check(2.0)]).is_ok());
        for wrong in [2.0 + 1e-10, -2.0, 0.0, f64::NAN] {
            let failure = verdict(&[check(2.0), check(wrong)]).unwrap_err();
            assert_eq!(failure.exit_status(), 1);
            assert!(matches!(&failure, Failure::Told(m) if m.starts_with("1 of 2 derivatives")), "{failure:?}");
            assert!(as_text("case", &[check(2.0), check(wrong)], true).contains("DISAGREES"));
        }
    }
}
