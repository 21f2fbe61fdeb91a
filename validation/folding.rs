//! Unfolded boxes and self-intersections of what is in them.

use crate::Failure;
use crate::random::Random;
use crate::sheet::Sheet;
use aeroform::ffd::{FfdBox, FoldPenalty, Placement};
use aeroform::report::{Align, Table};
use aeroform::section::{Section, SectionDefinition};

/// The box of the paper's shape match.
const BOUNDS: [[f64; 2]; 2] = [[-0.1, 1.1], [-0.15, 0.15]];

/// A NACA 0012 in a box whose control points stand at `net`.
struct Deformed {
    folded: bool,
    indicator: f64,
    penalty: f64,
    crossing: bool,
    /// Smallest determinant of the map's Jacobian on a grid, relative to the area of the box.
    determinant: f64,
}

fn deformed(lattice: &FfdBox<f64>, section: &Section, net: &[[f64; 2]]) -> Result<Deformed, Failure> {
    let penalty = FoldPenalty::default().on(lattice)?;
    let report = penalty.report(net);
    let now = lattice.with_control_points(net.to_vec())?;
    let mut determinant = f64::INFINITY;
    for i in 0..=100 {
        for j in 0..=100 {
            let (_, jacobian) = now.spline().point_and_jacobian([f64::from(i) / 100.0, f64::from(j) / 100.0]);
            determinant = determinant.min(jacobian[0][0] * jacobian[1][1] - jacobian[0][1] * jacobian[1][0]);
        }
    }
    Ok(Deformed {
        folded: report.folded,
        indicator: report.smallest_indicator,
        penalty: penalty.value(net),
        crossing: moved(lattice, section, net)?.self_intersection().is_some(),
        determinant: determinant / ((BOUNDS[0][1] - BOUNDS[0][0]) * (BOUNDS[1][1] - BOUNDS[1][0])),
    })
}

/// The section in the box with control points at `net`.
fn moved(lattice: &FfdBox<f64>, section: &Section, net: &[[f64; 2]]) -> Result<Section, Failure> {
    let points = section.curve().control_points();
    let moves: Vec<[f64; 2]> =
        net.iter().zip(lattice.control_points()).map(|(a, b)| [a[0] - b[0], a[1] - b[1]]).collect();
    Ok(section.with_control_points(lattice.embed(points)?.deform(points, &moves)?)?)
}

/// A random unfolded net: control points are placed anew, one after the other, anywhere within `reach` cells of where
/// they stood in the undeformed box, and put back where that folds the net.
fn walk(random: &mut Random, lattice: &FfdBox<f64>, reach: f64) -> Result<Vec<[f64; 2]>, Failure> {
    let penalty = FoldPenalty::default().on(lattice)?;
    let home = lattice.control_points();
    let counts = lattice.counts();
    let mut net = home.to_vec();
    for _ in 0..20 * net.len() {
        let index = random.whole(0, net.len() - 1);
        let before = net[index];
        net[index] = std::array::from_fn(|d| {
            let cell = (BOUNDS[d][1] - BOUNDS[d][0]) / (counts[d] - 1) as f64;
            home[index][d] + reach * cell * random.between(-1.0, 1.0)
        });
        if penalty.report(&net).folded {
            net[index] = before;
        }
    }
    Ok(net)
}

/// Counts of one degree: unfolded boxes, and those whose section crosses itself.
fn count(random: &mut Random, degree: usize, reach: f64, boxes: usize) -> Result<usize, Failure> {
    let mut crossings = 0;
    for _ in 0..boxes {
        let counts = [degree + random.whole(1, 3).max(5 - degree.min(4)), degree + random.whole(1, 3)];
        let placement = if random.chance(0.5) { Placement::Even } else { Placement::Greville };
        let lattice = FfdBox::rectangular(BOUNDS, counts, [degree; 2], placement)?;
        let digits = ["0006", "0012", "0024", "2412", "4415", "6409"][random.whole(0, 5)];
        let section = SectionDefinition::parse(&format!("naca{digits}:sharp"))?.section()?;
        let net = walk(random, &lattice, reach)?;
        crossings += usize::from(moved(&lattice, &section, &net)?.self_intersection().is_some());
    }
    Ok(crossings)
}

/// Unfolded nets in which a NACA 0012 crosses itself, found by random search and rounded to hundredths.
struct Counterexample {
    what: &'static str,
    counts: [usize; 2],
    degree: usize,
    net: &'static [[f64; 2]],
    /// Whether the map itself turns over somewhere.
    turns_over: bool,
}

const COUNTEREXAMPLES: [Counterexample; 3] = [
    Counterexample {
        what: "quadratic 3x3",
        counts: [3, 3],
        degree: 2,
        net: &[
            [0.72, -0.34],
            [0.72, -0.27],
            [1.57, -0.09],
            [-1.64, -0.32],
            [-1.19, -0.22],
            [-0.55, -0.18],
            [-2.05, 0.25],
            [-0.49, 0.56],
            [-0.11, -0.07],
        ],
        turns_over: true,
    },
    Counterexample {
        what: "cubic 4x4",
        counts: [4, 4],
        degree: 3,
        net: &[
            [0.33, -0.50],
            [1.65, -0.55],
            [2.27, -0.43],
            [1.70, 0.21],
            [-0.81, -0.20],
            [0.02, -0.22],
            [0.90, -0.18],
            [1.10, -0.05],
            [-1.61, 0.13],
            [0.18, 0.00],
            [0.94, 0.16],
            [1.10, 0.05],
            [-0.81, 0.24],
            [1.48, 0.45],
            [1.99, 0.41],
            [2.12, -0.25],
        ],
        turns_over: true,
    },
    Counterexample {
        what: "linear 5x2, overlapping itself",
        counts: [5, 2],
        degree: 1,
        net: &[
            [0.07, -0.21],
            [1.01, -0.62],
            [0.86, 0.29],
            [1.18, 0.46],
            [0.71, -0.05],
            [-0.36, 0.16],
            [0.44, 0.03],
            [0.30, 1.00],
            [1.44, 0.68],
            [0.24, -0.61],
        ],
        turns_over: false,
    },
];

pub fn sheets(quick: bool) -> Result<Vec<Sheet>, Failure> {
    Ok(vec![random_boxes(if quick { 40 } else { 2000 })?, known_boxes()?])
}

fn random_boxes(boxes: usize) -> Result<Sheet, Failure> {
    let mut sheet = Sheet::new(
        "Unfolded random boxes",
        "Paper, Section V: so long as the control net does not fold (no triangle turned over), what is in the box does not\n\
         cross itself. Random walks through unfolded nets: with control points within one cell of their places no section\n\
         crosses itself. Far beyond, a few do (figures without verdict): see the next table.",
    );
    let mut figures = Table::new([
        ("degree", Align::Right),
        ("boxes", Align::Right),
        ("crossing within 1 cell", Align::Right),
        ("crossing within 4 cells", Align::Right),
    ]);
    let mut random = Random::new(4);
    for degree in 1..=5 {
        let near = count(&mut random, degree, 1.0, boxes)?;
        let far = count(&mut random, degree, 4.0, boxes)?;
        figures.row([degree.to_string(), boxes.to_string(), near.to_string(), far.to_string()]);
        let what =
            format!("sections that cross themselves in {boxes} unfolded boxes of degree {degree}, within 1 cell");
        sheet.count_at_most(&what, 0, Some(near));
    }
    sheet.set_figures(figures);
    Ok(sheet)
}

fn known_boxes() -> Result<Sheet, Failure> {
    let mut sheet = Sheet::new(
        "Folded and unfolded boxes that make a section cross itself",
        "Paper, Fig. 6: a NACA 0012 in a linear 4x4 box with one control point moved past its neighbours. The paper's converse\n\
         is no theorem: above degree 1 unfolded nets can turn the map over between them (the Jacobian of a B-spline also\n\
         depends on products of distant legs of the net), and even a linear map that turns over nowhere can overlap itself\n\
         around a corner. These nets, rounded to hundredths, were found by random search; they lie cells away from where\n\
         they began. A small penalty says that an optimiser would not be held back from them by it.",
    );
    let mut figures = Table::new([
        ("box", Align::Left),
        ("smallest indicator", Align::Right),
        ("penalty", Align::Right),
        ("smallest Jacobian", Align::Right),
    ]);
    let section = SectionDefinition::parse("naca0012:sharp")?.section()?;
    let mut check = |what: &str, lattice: &FfdBox<f64>, net: &[[f64; 2]], folded: bool, turns_over: bool| {
        let seen = deformed(lattice, &section, net)?;
        figures.row([
            what.to_owned(),
            format!("{:.3}", seen.indicator),
            format!("{:.1e}", seen.penalty),
            format!("{:.2e}", seen.determinant),
        ]);
        sheet.statement(&format!("{what}: net folded"), folded, seen.folded);
        sheet.statement(&format!("{what}: map turned over somewhere"), turns_over, !(seen.determinant > 0.0));
        sheet.statement(&format!("{what}: section crosses itself"), true, seen.crossing);
        Ok::<(), Failure>(())
    };
    let linear = FfdBox::rectangular(BOUNDS, [4, 4], [1, 1], Placement::Even)?;
    let mut net = linear.control_points().to_vec();
    // column 1, row 1: past the control point above it
    net[5] = [0.35, 0.12];
    check("Fig. 6, linear 4x4", &linear, &net, true, true)?;
    for example in &COUNTEREXAMPLES {
        let lattice = FfdBox::rectangular(BOUNDS, example.counts, [example.degree; 2], Placement::Even)?;
        check(example.what, &lattice, example.net, false, example.turns_over)?;
    }
    sheet.set_figures(figures);
    Ok(sheet)
}
