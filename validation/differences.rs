//! The finite-difference suite.

use crate::Failure;
use crate::random::Random;
use crate::sheet::Sheet;
use aeroform::case::Case;
use aeroform::design::{DerivativeCheck, DesignProblem, check_gradients};
use aeroform::differentiate::{StepRange, finite_difference_jacobian};
use aeroform::report::{Align, Table};
use aeroform::section::Measure;
use num_dual::Dual64;
use std::collections::BTreeMap;
use std::path::Path;

/// A shape error and a penalty that one sample is checked with.
const INSTRUMENTS: [(&str, bool); 4] =
    [("arc length", false), ("parameter", true), ("control points", false), ("root mean square", true)];

/// Steps in units of each variable's own, tried where the usual ones (1e-2 to 1e-5) disagree.
const REPEATED_STEPS: [StepRange; 2] = [StepRange { first: 1e-2, levels: 5 }, StepRange { first: 1e-4, levels: 4 }];

/// The worst differences seen of one quantity.
#[derive(Default)]
struct Tally {
    checked: usize,
    /// Worst relative difference of the value by `f64` and by duals.
    value: f64,
    /// Worst difference of the two automatic routes, relative to the gradient.
    routes: f64,
    /// Worst difference from finite differences, relative to the gradient.
    deviation: f64,
    /// Worst of the same over what is allowed (three estimates, and 1e-9 of the gradient).
    over_allowed: f64,
    /// Derivatives confirmed only by the second or third range of steps.
    repeated: [usize; 2],
    wrong: usize,
}

pub fn sheets(quick: bool) -> Result<Vec<Sheet>, Failure> {
    let samples = if quick { 8 } else { 220 };
    let mut random = Random::new(5);
    let mut tallies: BTreeMap<String, Tally> = BTreeMap::new();
    let (mut without_value, mut first) = (0, None);
    for _ in 0..samples {
        let sample = Sample::new(&mut random);
        for (index, &(norm, normalised)) in INSTRUMENTS.iter().enumerate() {
            let measures = if index == 0 { sample.measures() } else { vec![] };
            let mut skipped = sample.check(norm, normalised, &measures, &mut tallies, &mut first)?;
            without_value += skipped.len();
            first = first.or(skipped.pop());
        }
    }
    Ok(vec![summary(samples, tallies, without_value, first)])
}

fn summary(samples: usize, tallies: BTreeMap<String, Tally>, without_value: usize, first: Option<String>) -> Sheet {
    let mut text = format!(
        "{samples} random sections (NACA four- and five-digit, Kulfan; sharp and blunt) in random boxes (degree 1 to 5, even and\n\
         Greville, rectangular and skewed; all control points free, every third sample with section parameters as variables\n\
         too) at random deformations. Each derivative of each quantity by each variable: the derivative optimisers use (local\n\
         duals carried back through the linear maps), plain forward mode through the whole pipeline one variable at a time,\n\
         and extrapolated finite differences with their own estimate. Differences are relative to the gradient of the\n\
         quantity. Allowed: 1e-12 between the automatic routes; three estimates and 1e-9 from finite differences.\n\
         Two columns count derivatives that disagreed at first and then agreed: 'long steps', without the shortest steps,\n\
         which see the round-off of quantities that are not good to four units in the last place (angles between tangents of\n\
         the dense points at a trailing edge are good to 1e-12); 'short steps', a hundred times shorter ones, which do not\n\
         reach a kink or jump nearby (maxima that tie, knots that an extreme passes).\n\
         Quantities without a value on some sample (no isolated extreme, a surface that does not reach a station) or a step\n\
         away from it, set aside: {without_value}."
    );
    if let Some(first) = first {
        text.push_str(&format!("\nSet aside or wrong, for example: {first}"));
    }
    let mut sheet = Sheet::new("Derivatives three ways", &text);
    let mut figures = Table::new([
        ("quantity", Align::Left),
        ("checked", Align::Right),
        ("f64 - dual", Align::Right),
        ("two routes", Align::Right),
        ("deviation", Align::Right),
        ("over allowed", Align::Right),
        ("long steps", Align::Right),
        ("short steps", Align::Right),
        ("wrong", Align::Right),
    ]);
    for (name, t) in &tallies {
        figures.row([
            name.clone(),
            t.checked.to_string(),
            format!("{:.1e}", t.value),
            format!("{:.1e}", t.routes),
            format!("{:.1e}", t.deviation),
            format!("{:.2}", t.over_allowed),
            t.repeated[0].to_string(),
            t.repeated[1].to_string(),
            t.wrong.to_string(),
        ]);
        let what = format!("{name}: of {} derivatives, beyond what finite differences allow", t.checked);
        sheet.count_at_most(&what, 0, Some(t.wrong));
    }
    let worst = |of: fn(&Tally) -> f64| tallies.values().map(of).fold(0.0, f64::max);
    sheet.at_most("worst between the automatic routes, all quantities", 1e-12, worst(|t| t.routes));
    sheet.at_most("worst between values by f64 and by duals, all quantities", 1e-12, worst(|t| t.value));
    // a suite that set much aside would show little
    let checked: usize = tallies.values().map(|t| t.checked).sum();
    for (range, steps) in ["long", "short"].into_iter().enumerate() {
        let repeated: usize = tallies.values().map(|t| t.repeated[range]).sum();
        let what = format!("share of {checked} derivatives confirmed by {steps} steps only");
        sheet.at_most(&what, 0.01, repeated as f64 / checked as f64);
    }
    let share = without_value as f64 / (samples * Measure::NAMES.len()) as f64;
    sheet.at_most("share of measures without a value", 0.01, share);
    sheet.count_at_least("random sections and boxes", if samples < 200 { 8 } else { 200 }, samples);
    sheet.set_figures(figures);
    sheet
}

/// A random section, target, box and deformation.
struct Sample {
    section: String,
    target: String,
    /// A target on the knots of the section, which some norms ask for.
    target_on_knots: String,
    lattice: String,
    parameters: &'static str,
    blunt: bool,
    /// Displacements in units of the natural step of each variable.
    shake: Vec<f64>,
}

/// A section as the body of a TOML table, and its build parameters.
struct Definition {
    text: String,
    parameters: &'static str,
    /// First coefficients of the surfaces of a Kulfan section, on which its knots depend.
    nose: Option<[f64; 2]>,
}

/// NACA four- or five-digit.
fn naca(random: &mut Random, blunt: bool) -> Definition {
    let edge = if blunt { "blunt" } else { "sharp" };
    let thickness = random.whole(8, 24);
    let (digits, parameters) = if random.chance(0.5) {
        let (camber, position) = (random.whole(1, 6), random.whole(3, 6));
        (format!("{camber}{position}"), "[\"thickness\", \"camber\", \"camber_position\"]")
    } else {
        let line = ["210", "220", "230", "240", "250"][random.whole(0, 4)];
        (line.to_owned(), "[\"thickness\", \"design_lift\"]")
    };
    let text = format!("naca = \"{digits}{thickness:02}\"\ntrailing_edge = \"{edge}\"\n");
    Definition { text, parameters, nose: None }
}

/// Four coefficients a surface, the first ones given.
fn kulfan(random: &mut Random, blunt: bool, nose: [f64; 2]) -> Definition {
    let mut list = |first: f64, low: f64, high: f64| {
        [first, random.between(low, high), random.between(low, high), random.between(low, high)]
    };
    let (upper, lower) = (list(nose[0], 0.15, 0.3), list(nose[1], -0.15, -0.05));
    let gap = if blunt { ", gap = 0.004" } else { "" };
    let text = format!("kulfan = {{ upper = {upper:?}, lower = {lower:?}{gap} }}\n");
    Definition { text, parameters: "[\"upper_0\", \"lower_3\"]", nose: Some(nose) }
}

fn definition(random: &mut Random, blunt: bool) -> Definition {
    if random.chance(2.0 / 3.0) {
        return naca(random, blunt);
    }
    let nose = [random.between(0.15, 0.3), random.between(-0.15, -0.05)];
    kulfan(random, blunt, nose)
}

impl Sample {
    fn new(random: &mut Random) -> Self {
        let blunt = random.chance(0.5);
        let points = [41, 61, 101][random.whole(0, 2)];
        let own = definition(random, blunt);
        let other = definition(random, blunt);
        let on_knots = match own.nose {
            None => naca(random, blunt),
            Some(nose) => kulfan(random, blunt, nose),
        };
        let table = |d: &Definition| format!("{}control_points = {points}\n", d.text);
        let degree = [random.whole(1, 5), random.whole(1, 5)];
        let counts = degree.map(|p| (p + random.whole(1, 2)).max(3));
        let placement = if random.chance(0.5) { "even" } else { "greville" };
        let place = if random.chance(0.5) {
            "x = [-0.1, 1.1]\ny = [-0.25, 0.25]".to_owned()
        } else {
            let mut corner = |x: f64, y: f64| format!("[{:.3}, {:.3}]", x + random.between(-0.05, 0.05), y);
            let corners = [corner(-0.2, -0.25), corner(1.2, -0.3), corner(-0.2, 0.3), corner(1.2, 0.25)];
            format!("corners = [{}]", corners.join(", "))
        };
        Self {
            section: table(&own),
            target: table(&other),
            target_on_knots: table(&on_knots),
            lattice: format!(
                "{place}\ncontrol_points = {counts:?}\ndegree = {degree:?}\nplacement = \"{placement}\"\n"
            ),
            parameters: if random.chance(1.0 / 3.0) { own.parameters } else { "[]" },
            blunt,
            shake: (0..2 * counts[0] * counts[1] + 3).map(|_| 0.2 * random.between(-1.0, 1.0)).collect(),
        }
    }

    /// All measures; the gap of a sharp trailing edge is zero whatever moves.
    fn measures(&self) -> Vec<&'static str> {
        Measure::NAMES.into_iter().filter(|name| self.blunt || *name != "trailing_edge_gap").collect()
    }

    fn text(&self, norm: &str, normalised: bool, measures: &[&str]) -> String {
        let Self { section, lattice, parameters, .. } = self;
        let target = if norm == "control points" { &self.target_on_knots } else { &self.target };
        format!(
            "name = \"sample\"\n[section]\n{section}[target]\n{target}[box]\n{lattice}\
             [variables]\nfree = \"all\"\nparameters = {parameters}\n\
             [fold_penalty]\nnormalised = {normalised}\n[shape_error]\nnorm = \"{norm}\"\n\
             [objective]\nminimize = {{ shape_error = 1.0, fold_penalty = 1.0 }}\n[report]\nvalues = {measures:?}\n"
        )
    }

    /// Checks one case; returns the measures that had to be set aside.
    fn check(
        &self,
        norm: &str,
        normalised: bool,
        measures: &[&str],
        tallies: &mut BTreeMap<String, Tally>,
        worst: &mut Option<String>,
    ) -> Result<Vec<String>, Failure> {
        let mut kept = measures.to_vec();
        let mut skipped = Vec::new();
        loop {
            let text = self.text(norm, normalised, &kept);
            let mut problem = Case::parse("sample", &text, Path::new(""))?.problem;
            let values = self.point(&problem);
            match check_gradients(&mut problem, &values) {
                Ok(checks) => {
                    compare_values(&mut problem, &values, norm, normalised, tallies)?;
                    for check in &checks {
                        tally(&problem, &values, check, norm, normalised, tallies, worst)?;
                    }
                    return Ok(skipped);
                }
                Err(error) => {
                    let culprit = self.culprit(norm, normalised, &kept)?;
                    let Some(culprit) = culprit else { return Err(error.into()) };
                    skipped.push(format!("{culprit}: {error}; {text:?}"));
                    kept.retain(|name| *name != culprit);
                }
            }
        }
    }

    /// The first measure that fails by itself.
    fn culprit<'a>(&self, norm: &str, normalised: bool, measures: &[&'a str]) -> Result<Option<&'a str>, Failure> {
        for measure in measures {
            let text = self.text(norm, normalised, &[measure]);
            let mut problem = Case::parse("sample", &text, Path::new(""))?.problem;
            let values = self.point(&problem);
            if check_gradients(&mut problem, &values).is_err() {
                return Ok(Some(measure));
            }
        }
        Ok(None)
    }

    /// The deformation: box variables moved off their start; section parameters a little.
    fn point(&self, problem: &DesignProblem) -> Vec<f64> {
        let variables = problem.geometry().variables();
        variables.iter().zip(&self.shake).map(|(v, shake)| v.start + shake * v.step).collect()
    }
}

/// Penalties and norms go by their kind.
fn label(quantity: &str, norm: &str, normalised: bool) -> String {
    match quantity {
        "shape_error" => format!("shape_error ({norm})"),
        "fold_penalty" if normalised => "fold_penalty (normalised)".into(),
        "fold_penalty" => "fold_penalty (printed)".into(),
        _ => quantity.into(),
    }
}

/// Values by `f64`, by duals, and as they come with the gradients.
fn compare_values(
    problem: &mut DesignProblem,
    values: &[f64],
    norm: &str,
    normalised: bool,
    tallies: &mut BTreeMap<String, Tally>,
) -> Result<(), Failure> {
    let plain = problem.quantities_at(values)?;
    let seeded: Vec<Dual64> = values.iter().map(|&v| Dual64::new(v, 1.0)).collect();
    let duals = problem.quantities_at(&seeded)?;
    let with_gradients = problem.gradients(values)?;
    for (q, quantity) in problem.quantities().iter().enumerate() {
        let tally = tallies.entry(label(&quantity.name(), norm, normalised)).or_default();
        // lengths, areas and ratios of a section of unit chord: below 1e-3 differences are absolute
        let size = plain[q].abs().max(1e-3);
        let of_gradient = with_gradients[q].as_ref().map(|(value, _)| *value);
        for other in std::iter::once(duals[q].re).chain(of_gradient) {
            tally.value = tally.value.max((other - plain[q]).abs() / size);
        }
    }
    Ok(())
}

fn tally(
    problem: &DesignProblem,
    values: &[f64],
    check: &DerivativeCheck,
    norm: &str,
    normalised: bool,
    tallies: &mut BTreeMap<String, Tally>,
    worst: &mut Option<String>,
) -> Result<(), Failure> {
    let mut check = check.clone();
    let name = label(&check.quantity, norm, normalised);
    let tally = tallies.entry(name.clone()).or_default();
    if !check.agrees() && check.route_error() <= 1e-12 {
        for (repeated, steps) in tally.repeated.iter_mut().zip(REPEATED_STEPS) {
            let mut again = check.clone();
            repeat(problem, values, &mut again, steps)?;
            if again.agrees() {
                *repeated += 1;
                check = again;
                break;
            }
        }
    }
    tally.checked += 1;
    tally.routes = tally.routes.max(check.route_error());
    tally.deviation = tally.deviation.max(check.difference_deviation());
    let allowed = 3.0 * check.difference_error + 1e-9 * check.scale;
    if allowed > 0.0 {
        tally.over_allowed = tally.over_allowed.max((check.exact - check.difference).abs() / allowed);
    }
    if !check.agrees() {
        tally.wrong += 1;
        *worst = Some(format!("{name}: {check:?}"));
    }
    Ok(())
}

/// Repeats the difference with other steps.
fn repeat(
    problem: &DesignProblem,
    values: &[f64],
    check: &mut DerivativeCheck,
    steps: StepRange,
) -> Result<(), Failure> {
    let position = |name: &str| problem.geometry().variables().iter().position(|v| v.name == name);
    let k = position(&check.variable).ok_or("a variable without a name")?;
    let q = problem.quantities().iter().position(|q| q.name() == check.quantity).ok_or("a quantity without a name")?;
    let along = |x: &[f64]| -> Result<Vec<f64>, Failure> {
        let mut moved = values.to_vec();
        moved[k] = x[0];
        Ok(vec![problem.quantities_at(&moved)?[q]])
    };
    let steps = StepRange { first: steps.first * problem.steps()[k], ..steps };
    let difference = finite_difference_jacobian(along, &values[k..=k], &[steps])?[(0, 0)];
    check.difference = difference.value;
    check.difference_error = difference.error;
    Ok(())
}
