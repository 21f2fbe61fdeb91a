//! Parameters of random points.

use crate::Failure;
use crate::random::Random;
use crate::sheet::Sheet;
use aeroform::ffd::{FfdBox, Placement};
use aeroform::report::{Align, Table};

/// Points embedded at once, which bounds the memory of the weights.
const BATCH: usize = 5_000;

/// Kinds of boxes; a sixth of the points of a degree each.
const KINDS: [(&str, Placement); 6] = [
    ("rectangular", Placement::Even),
    ("rectangular", Placement::Greville),
    ("skewed", Placement::Even),
    ("skewed", Placement::Greville),
    ("bent", Placement::Even),
    ("bent", Placement::Greville),
];

fn lattice(kind: &str, placement: Placement, degree: usize) -> Result<FfdBox<f64>, Failure> {
    let counts = [degree + 4, degree + 3];
    let flat = FfdBox::rectangular([[-0.1, 1.1], [-0.15, 0.15]], counts, [degree; 2], placement)?;
    Ok(match kind {
        "rectangular" => flat,
        "skewed" => {
            let corners = [[-0.1, -0.2], [1.1, -0.15], [-0.15, 0.2], [1.2, 0.25]];
            FfdBox::from_corners(&corners, counts, [degree; 2], placement)?
        }
        // every control point moved by a smooth field: curved faces
        _ => {
            let bend = |p: &[f64; 2]| [p[0] + 0.1 * (9.0 * p[1]).sin(), p[1] + 0.05 * (4.0 * p[0]).sin()];
            FfdBox::from_control_points(flat.control_points().iter().map(bend).collect(), counts, [degree; 2])?
        }
    })
}

/// A random point of the box; every fourth on a face, every sixteenth of these at a corner.
fn point(random: &mut Random, lattice: &FfdBox<f64>, on_face: bool) -> [f64; 2] {
    let mut u = [random.between(0.0, 1.0), random.between(0.0, 1.0)];
    if on_face {
        let end = |random: &mut Random| if random.chance(0.5) { 1.0 } else { 0.0 };
        let axis = random.whole(0, 1);
        u[axis] = end(random);
        if random.chance(1.0 / 16.0) {
            u[1 - axis] = end(random);
        }
    }
    lattice.evaluate(u)
}

/// The results of embedding the points of one kind of box.
#[derive(Default)]
struct Tally {
    points: usize,
    failures: usize,
    outside: usize,
    residual: f64,
    moved: usize,
}

fn tally(random: &mut Random, lattice: &FfdBox<f64>, points: usize) -> Result<Tally, Failure> {
    let net = lattice.control_points();
    let range = |d: usize| {
        let (low, high) = net.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[d]), h.max(p[d])));
        high - low
    };
    let diagonal = range(0).hypot(range(1));
    let still = vec![[0.0; 2]; net.len()];
    let mut tally = Tally::default();
    while tally.points < points {
        let batch: Vec<[f64; 2]> =
            (0..BATCH.min(points - tally.points)).map(|i| point(random, lattice, i % 4 == 0)).collect();
        tally.points += batch.len();
        tally.failures += batch.len();
        // one point that is refused refuses the batch: then one by one, to count
        let embedded = match lattice.embed(&batch) {
            Ok(embedding) => vec![(embedding, batch)],
            Err(_) => batch.iter().filter_map(|p| Some((lattice.embed(&[*p]).ok()?, vec![*p]))).collect(),
        };
        for (embedding, batch) in embedded {
            for (u, p) in embedding.parameters().iter().zip(&batch) {
                let found = lattice.evaluate(*u);
                tally.residual = tally.residual.max((found[0] - p[0]).abs().max((found[1] - p[1]).abs()) / diagonal);
                tally.outside += usize::from(u.iter().any(|u| !(0.0..=1.0).contains(u)));
            }
            let deformed = embedding.deform(&batch, &still)?;
            tally.moved += deformed.iter().zip(&batch).filter(|(a, b)| a != b).count();
            tally.failures -= batch.len();
        }
    }
    Ok(tally)
}

pub fn sheets(quick: bool) -> Result<Vec<Sheet>, Failure> {
    let total: usize = if quick { 10_000 } else { 1_000_000 };
    let mut sheet = Sheet::new(
        "Embedding",
        "Random points of random boxes, a quarter of them on the faces: every one must be found, with a residual of at most\n\
         1e-14 of the diagonal of the box (the target of this project), parameters in [0, 1], and stay where it is, to the\n\
         bit, while the box stays where it is.",
    );
    let mut figures = Table::new([
        ("degree", Align::Right),
        ("box", Align::Left),
        ("points", Align::Right),
        ("not found", Align::Right),
        ("worst residual", Align::Right),
    ]);
    let mut random = Random::new(3);
    for degree in 1..=5 {
        let mut all = Tally::default();
        for (kind, placement) in KINDS {
            let t = tally(&mut random, &lattice(kind, placement, degree)?, total.div_ceil(KINDS.len()))?;
            figures.row([
                degree.to_string(),
                format!("{kind}, {placement:?}"),
                t.points.to_string(),
                t.failures.to_string(),
                format!("{:.1e}", t.residual),
            ]);
            all.points += t.points;
            all.failures += t.failures;
            all.outside += t.outside;
            all.moved += t.moved;
            all.residual = all.residual.max(t.residual);
        }
        let n = all.points;
        sheet.count_at_most(&format!("not found among {n} points, degree {degree}"), 0, Some(all.failures));
        sheet.at_most(&format!("worst residual relative to the diagonal, degree {degree}"), 1e-14, all.residual);
        sheet.count_at_most(&format!("parameters outside of [0, 1], degree {degree}"), 0, Some(all.outside));
        sheet.count_at_most(&format!("points moved by a box at rest, degree {degree}"), 0, Some(all.moved));
    }
    sheet.set_figures(figures);
    Ok(vec![sheet])
}
