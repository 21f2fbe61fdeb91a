//! Exact derivatives of lift, drag and moment against extrapolated finite differences, over random sections.

use super::common::{PANELS, cores, in_parallel};
use crate::Failure;
use crate::random::Random;
use crate::sheet::Sheet;
use aeroform::differentiate::{Estimate, StepRange, finite_difference_jacobian};
use aeroform::ffd::{Embedding, FfdBox, Placement};
use aeroform::flow::{
    Coefficients, Condition, Derivatives, Gradients, Incidence, PanelledSection, Settings, Solution, TrailingEdge,
    panel_parameters,
};
use aeroform::report::{Align, Table};
use aeroform::section::{Section, SectionDefinition};

/// Tighter than the command, so that differences are good to many digits.
const SETTINGS: Settings =
    Settings { laminar_stations: 80, turbulent_stations: 40, tolerance: 1e-13, iterations: 40, retry: true };
const COEFFICIENTS: [&str; 3] = ["CL", "CD", "CM"];
const KINDS: [&str; 7] =
    ["one node", "trailing-edge node", "smooth mode", "angle of attack", "Mach", "Reynolds", "box variable"];
/// First step of a single node, in lengths of the shorter panel beside it.
const NODE_STEP: f64 = 2e-3;
/// Ranges of steps in units of the first step of each direction, tried one after the other until the differences say
/// enough.
const STEPS: [StepRange; 3] =
    [StepRange { first: 1.0, levels: 4 }, StepRange { first: 0.1, levels: 4 }, StepRange { first: 10.0, levels: 5 }];

/// A section in a box, at a condition.
struct Sample {
    name: String,
    section: Section,
    embedding: Embedding<f64, 2>,
    moves: Vec<[f64; 2]>,
    parameters: Vec<f64>,
    condition: Condition,
    /// Random numbers that choose the directions.
    seed: u64,
}

/// A derivative to be checked.
struct Line {
    /// Index into [`KINDS`].
    kind: usize,
    /// Step of the differences.
    step: f64,
    direction: Direction,
}

/// Along what a derivative is taken.
enum Direction {
    /// All nodes, each so far.
    Nodes(Vec<[f64; 2]>),
    Alpha,
    Mach,
    Reynolds,
}

/// A derivative of one coefficient by both ways.
struct Row {
    kind: usize,
    coefficient: usize,
    exact: f64,
    difference: f64,
    /// Estimated error of the difference and deviation from the exact derivative, relative.
    error: f64,
    deviation: f64,
    what: String,
}

fn definition(random: &mut Random) -> String {
    if random.chance(0.3) {
        let mut list = |low: f64, high: f64| -> String {
            (0..4).map(|_| format!("{:.4}", random.between(low, high))).collect::<Vec<_>>().join(",")
        };
        return format!("kulfan:upper={}/lower={}", list(0.13, 0.22), list(-0.14, -0.05));
    }
    let camber = random.whole(0, 4);
    let place = if camber == 0 { 0 } else { random.whole(2, 5) };
    let edge = if random.chance(0.3) { ":sharp" } else { "" };
    format!("naca{camber}{place}{:02}{edge}", random.whole(8, 18))
}

impl Sample {
    fn random(random: &mut Random, tripped: bool) -> Result<Self, Failure> {
        let text = definition(random);
        let section = SectionDefinition::parse(&text)?.section()?;
        let lattice = FfdBox::rectangular([[-0.05, 1.05], [-0.15, 0.15]], [6, 4], [3, 3], Placement::Even)?;
        let embedding = lattice.embed(section.curve().control_points())?;
        let mut moves = vec![[0.0; 2]; lattice.control_points().len()];
        for value in moves.iter_mut().flatten() {
            *value = 0.008 * random.between(-1.0, 1.0);
        }
        let incidence = Incidence::Alpha(random.between(-2.0, 8.0).to_radians());
        let reynolds = 5e5 * 12f64.powf(random.between(0.0, 1.0));
        // every third one incompressible
        let mach = if random.chance(1.0 / 3.0) { 0.0 } else { random.between(0.02, 0.4) };
        let trips = if tripped { [(); 2].map(|()| Some(random.between(0.03, 0.2))) } else { [None; 2] };
        let condition = Condition { mach, trips, ..Condition::new(incidence, reynolds) };
        let trip = if tripped { "tripped" } else { "free" };
        let degrees = match incidence {
            Incidence::Alpha(alpha) => alpha.to_degrees(),
            Incidence::Lift(lift) => lift,
        };
        let name = format!("{text}, alpha {degrees:.2}, M {mach:.2}, Re {reynolds:.1e}, {trip}");
        let parameters = panel_parameters(&section, PANELS + 1);
        let seed = random.whole(0, 1 << 40) as u64;
        Ok(Self { name, section, embedding, moves, parameters, condition, seed })
    }

    fn nodes(&self, moves: &[[f64; 2]]) -> Result<Vec<[f64; 2]>, String> {
        let points = self.embedding.deform(self.section.curve().control_points(), moves).map_err(|e| e.to_string())?;
        let moved = self.section.with_control_points(points).map_err(|e| e.to_string())?;
        Ok(self.parameters.iter().map(|&u| moved.curve().point_at(u)).collect())
    }

    fn solve(&self, nodes: &[[f64; 2]], condition: &Condition, warm: Option<&Solution>) -> Result<Solution, String> {
        let panels = PanelledSection::new(nodes, self.section.trailing_edge()).map_err(|e| e.to_string())?;
        panels.analyze(condition, &SETTINGS, warm).map_err(|e| e.to_string())
    }

    /// Lines through the sample.
    fn directions(&self, nodes: &[[f64; 2]]) -> Result<Vec<Line>, String> {
        let mut random = Random::new(self.seed);
        let last = nodes.len() - 1;
        let sharp = self.section.trailing_edge() == TrailingEdge::Sharp;
        let mut one = |k: usize| {
            let mut direction = vec![[0.0; 2]; nodes.len()];
            let angle = random.between(0.0, std::f64::consts::TAU);
            direction[k] = [angle.cos(), angle.sin()];
            direction
        };
        let node = 2 + (self.seed % (last as u64 - 3)) as usize;
        let single = one(node);
        let mut tail = one(0);
        if sharp {
            tail[last] = tail[0];
        }
        // waves of the node index that return to where they began, so that a closed edge stays closed
        let (amplitudes, phases) =
            ([(); 6].map(|()| random.between(-1.0, 1.0)), [(); 6].map(|()| random.between(0.0, std::f64::consts::TAU)));
        let wave = |k: usize, axis: usize| -> f64 {
            let turn = std::f64::consts::TAU * (k % last) as f64 / last as f64;
            (0..3).map(|m| amplitudes[2 * m + axis] * (m as f64 * turn + phases[2 * m + axis]).cos()).sum()
        };
        let mode = (0..nodes.len()).map(|k| [0.3 * wave(k, 0), wave(k, 1)]).collect();
        let control = random.whole(0, self.moves.len() - 1);
        let axis = random.whole(0, 1);
        let mut moves = self.moves.clone();
        moves[control][axis] += 1.0;
        // the box is linear in its control points
        let moved = self.nodes(&moves)?;
        let box_variable = moved.iter().zip(nodes).map(|(a, b)| [a[0] - b[0], a[1] - b[1]]).collect();
        let line = |kind, step, direction| Line { kind, step, direction };
        // what one node does to the flow depends on its move over the length of the panels beside it
        let length = |k: usize| (nodes[k + 1][0] - nodes[k][0]).hypot(nodes[k + 1][1] - nodes[k][1]);
        let panel = length(node - 1).min(length(node));
        let mut directions = vec![
            line(0, NODE_STEP * panel, Direction::Nodes(single)),
            line(1, 1e-5, Direction::Nodes(tail)),
            line(2, 2e-5, Direction::Nodes(mode)),
            line(3, 2e-4, Direction::Alpha),
            line(5, 1e-2 * self.condition.reynolds, Direction::Reynolds),
            line(6, 2e-4, Direction::Nodes(box_variable)),
        ];
        // no differences across Mach 0
        if self.condition.mach > 0.0 {
            directions.push(line(4, 1e-3, Direction::Mach));
        }
        Ok(directions)
    }

    /// `None` where the sample itself does not converge.
    fn run(&self, bar: f64) -> Result<Option<Vec<Row>>, String> {
        let nodes = self.nodes(&self.moves)?;
        let base = self.solve(&nodes, &self.condition, None)?;
        let Some(gradients) = base.gradients().filter(|_| base.is_reliable()) else { return Ok(None) };
        let mut rows = Vec::new();
        for line in self.directions(&nodes)? {
            rows.extend(self.compare(&base, &gradients, &nodes, &line, bar));
        }
        Ok(Some(rows))
    }

    fn moved(&self, base: &Solution, nodes: &[[f64; 2]], direction: &Direction, x: f64) -> Result<Vec<f64>, String> {
        let mut condition = self.condition;
        let mut moved = nodes.to_vec();
        match direction {
            Direction::Nodes(d) => {
                moved.iter_mut().zip(d).for_each(|(p, d)| *p = [p[0] + x * d[0], p[1] + x * d[1]]);
            }
            Direction::Alpha => condition.incidence = Incidence::Alpha(base.alpha + x),
            Direction::Mach => condition.mach += x,
            Direction::Reynolds => condition.reynolds += x,
        }
        let solution = self.solve(&moved, &condition, Some(base))?;
        if !solution.is_reliable() {
            return Err(format!("a step away: {}", solution.status));
        }
        Ok(vec![solution.coefficients.cl, solution.coefficients.cd, solution.coefficients.cm])
    }

    fn compare(&self, base: &Solution, gradients: &Gradients, nodes: &[[f64; 2]], line: &Line, bar: f64) -> Vec<Row> {
        let Line { kind, step, ref direction } = *line;
        let along = |d: &Derivatives| match direction {
            Direction::Nodes(v) => d.nodes.iter().zip(v).map(|(g, v)| g[0] * v[0] + g[1] * v[1]).sum(),
            Direction::Alpha => d.alpha,
            Direction::Mach => d.mach,
            Direction::Reynolds => d.reynolds,
        };
        let exact: [f64; 3] = [along(&gradients.cl), along(&gradients.cd), along(&gradients.cm)];
        // derivatives that happen to vanish are judged by the parts that cancel, or by a usual change of the variable
        let Coefficients { cl, cd, cm, .. } = base.coefficients;
        let sizes = [cl.abs().max(0.1), cd, cm.abs().max(0.01)];
        let parts = [&gradients.cl, &gradients.cd, &gradients.cm];
        let floor: [f64; 3] = std::array::from_fn(|k| match direction {
            Direction::Nodes(v) => {
                let part = |(g, v): (&[f64; 2], &[f64; 2])| (g[0] * v[0] + g[1] * v[1]).powi(2);
                parts[k].nodes.iter().zip(v).map(part).sum::<f64>().sqrt()
            }
            Direction::Alpha | Direction::Mach => 0.1 * sizes[k],
            Direction::Reynolds => 1e-2 * sizes[k] / self.condition.reynolds,
        });
        let scale = |k: usize| exact[k].abs().max(floor[k]);
        let nothing = Estimate { value: f64::NAN, error: f64::INFINITY };
        let mut best = [nothing; 3];
        for range in STEPS {
            let range = StepRange { first: range.first * step, ..range };
            let f = |x: &[f64]| self.moved(base, nodes, direction, x[0]);
            // a step that leaves the range of convergence: others may not
            let Ok(estimates) = finite_difference_jacobian(f, &[0.0], &[range]) else { continue };
            for (k, best) in best.iter_mut().enumerate() {
                if estimates[(k, 0)].error < best.error {
                    *best = estimates[(k, 0)];
                }
            }
            if (0..3).all(|k| best[k].error <= 0.3 * bar * scale(k)) {
                break;
            }
        }
        (0..3)
            .map(|k| {
                let scale = scale(k);
                Row {
                    kind,
                    coefficient: k,
                    exact: exact[k],
                    difference: best[k].value,
                    error: best[k].error / scale,
                    deviation: (best[k].value - exact[k]).abs() / scale,
                    what: self.name.clone(),
                }
            })
            .collect()
    }
}

pub fn sheets(quick: bool) -> Result<Vec<Sheet>, Failure> {
    let count = if quick { 1 } else { 25 };
    Ok(vec![sheet(count, true, 1e-6)?, sheet(count, false, 1e-5)?])
}

/// Whether differences are too inaccurate to confirm or refute within the bar.
fn vague(row: &Row, bar: f64) -> bool {
    !(row.error <= bar)
}

/// Beyond the bar, and beyond what the difference itself may be off.
fn wrong(row: &Row, bar: f64) -> bool {
    !vague(row, bar) && row.deviation > bar && row.deviation > 3.0 * row.error
}

fn sheet(count: usize, tripped: bool, bar: f64) -> Result<Sheet, Failure> {
    let mut random = Random::new(if tripped { 610 } else { 625 });
    let samples = (0..count).map(|_| Sample::random(&mut random, tripped)).collect::<Result<Vec<_>, _>>()?;
    let found =
        in_parallel(cores(), &samples, |sample| sample.run(bar)).into_iter().collect::<Result<Vec<_>, String>>()?;
    let rows: Vec<&Row> = found.iter().flatten().flatten().collect();
    let title = if tripped { "Derivatives, tripped" } else { "Derivatives, free transition" };
    let text = format!(
        "{count} random NACA and Kulfan sections in random cubic boxes, alpha -2 to 8, M 0 to 0.4, Re 5e5 to 6e6: exact derivatives\n\
         of lift, drag and moment against central differences of the coefficients, extrapolated, with their own estimate. Directions\n\
         of each section: a node, the trailing-edge node, a smooth mode of all nodes, angle, Mach and Reynolds number, a control\n\
         point of the box. Relative to the derivative, but at least to the root of the summed squares of the parts of the nodes\n\
         where these cancel, and to a tenth of the coefficient per radian and unit of Mach number, a hundredth per Reynolds number.\n\
         Vague: differences estimated worse than the bar of {bar:.0e} with all steps tried, or not converged a step away.\n\
         Beyond: further off than the bar and three estimates."
    );
    let mut sheet = Sheet::new(title, &text);
    let mut figures = Table::new([
        ("derivative of", Align::Left),
        ("by", Align::Left),
        ("checked", Align::Right),
        ("vague", Align::Right),
        ("worst", Align::Right),
        ("its estimate", Align::Right),
        ("median", Align::Right),
        ("beyond", Align::Right),
    ]);
    for (kind, name) in KINDS.into_iter().enumerate() {
        for (coefficient, symbol) in COEFFICIENTS.into_iter().enumerate() {
            let mut these: Vec<&&Row> =
                rows.iter().filter(|r| r.kind == kind && r.coefficient == coefficient).collect();
            let beyond = these.iter().filter(|r| wrong(r, bar)).count();
            let all = these.len();
            these.retain(|r| !vague(r, bar));
            these.sort_by(|a, b| a.deviation.total_cmp(&b.deviation));
            let cell = |row: Option<&&&Row>, of: fn(&Row) -> f64| row.map_or("-".into(), |r| format!("{:.1e}", of(r)));
            figures.row([
                symbol.to_owned(),
                name.to_owned(),
                all.to_string(),
                (all - these.len()).to_string(),
                cell(these.last(), |r| r.deviation),
                cell(these.last(), |r| r.error),
                cell(these.get(these.len() / 2), |r| r.deviation),
                beyond.to_string(),
            ]);
        }
    }
    let bad = rows.iter().filter(|r| wrong(r, bar)).count();
    let unclear: Vec<&&Row> = rows.iter().filter(|r| vague(r, bar)).collect();
    let mut notes: Vec<String> = Vec::new();
    let mut listed: Vec<&&Row> = rows.iter().filter(|r| wrong(r, bar) || vague(r, bar)).collect();
    listed.sort_by_key(|r| !wrong(r, bar));
    for r in listed.iter().take(12) {
        let (kind, symbol) = (KINDS[r.kind], COEFFICIENTS[r.coefficient]);
        let word = if wrong(r, bar) { "beyond" } else { "vague" };
        let Row { exact, difference, error, deviation, what, .. } = r;
        notes.push(format!("{word}: {symbol} by {kind}: exact {exact:.9e}, difference {difference:.9e}, off {deviation:.1e}, estimate {error:.1e}; {what}"));
    }
    for (sample, found) in samples.iter().zip(&found) {
        if found.is_none() {
            notes.push(format!("not converged: {}", sample.name));
        }
    }
    sheet.set_figures(figures);
    sheet.set_notes(notes);
    let converged = found.iter().flatten().count();
    sheet.count_at_least("sections that converge", count - count / 10, converged);
    let known: Vec<&&Row> = rows.iter().filter(|r| !vague(r, bar)).collect();
    for (kind, name) in KINDS.into_iter().enumerate() {
        let of_kind = known.iter().filter(|r| r.kind == kind && (wrong(r, bar) || r.deviation <= bar));
        sheet.at_most(&format!("worst by {name}"), bar, of_kind.map(|r| r.deviation).fold(0.0, f64::max));
    }
    sheet.count_at_most(&format!("of {} derivatives, beyond the bar", rows.len()), 0, Some(bad));
    sheet.at_most("share of vague differences", 0.05, unclear.len() as f64 / rows.len().max(1) as f64);
    Ok(sheet)
}
