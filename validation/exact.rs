//! Closed forms.

use crate::Failure;
use crate::random::Random;
use crate::sheet::Sheet;
use aeroform::design::{ShapeError, ShapeNorm};
use aeroform::ffd::{FfdBox, FoldPenalty, Placement, penalty_of_indicator};
use aeroform::section::{Section, SectionDefinition, TrailingEdge};
use aeroform::spline::{BSplineCurve, KnotVector, ellipse};
use std::f64::consts::PI;

pub fn sheets() -> Result<Vec<Sheet>, Failure> {
    Ok(vec![naca()?, ellipses()?, basis()?, refinement()?, boxes()?, norms()?])
}

/// Half thickness over thickness, by powers of the root of the station: `y = t Σ c sᵏ` with `s = √x`.
fn thickness_terms(sharp: bool) -> [(i32, f64); 5] {
    let last = if sharp { 0.1036 } else { 0.1015 };
    [(1, 0.2969), (2, -0.1260), (4, -0.3516), (6, 0.2843), (8, -last)].map(|(power, c)| (power, c / 0.2))
}

/// `∫₀¹ xᵐ (y/t)ⁿ dx` for n = 1 or 3, term by term: `∫ s^p dx = 2 / (p + 2)`.
fn thickness_integral(sharp: bool, m: i32, n: usize) -> f64 {
    let mut product = vec![(2 * m, 1.0)];
    for _ in 0..n {
        product = product.iter().flat_map(|(p, a)| thickness_terms(sharp).map(|(q, b)| (p + q, a * b))).collect();
    }
    product.iter().map(|(p, c)| c * 2.0 / f64::from(p + 2)).sum()
}

fn naca() -> Result<Sheet, Failure> {
    let mut sheet = Sheet::new(
        "NACA four-digit sections",
        "Term-by-term integrals and derivatives of the thickness polynomial (Abbott and von Doenhoff; last coefficient\n\
         -0.1036 for a sharp trailing edge). The splines interpolate the section, so errors are those of interpolation:\n\
         they fall by sixteen for twice the points. Only the nose radius is of first order: the term in x of the thickness gives\n\
         the section a jump in the slope of its curvature at the nose, which a C2 spline rounds off.",
    );
    for (digits, t) in [("0006", 0.06), ("0012", 0.12), ("0024", 0.24)] {
        let area = 2.0 * t * thickness_integral(true, 0, 1);
        for (points, tolerance) in [(101, 1e-5), (401, 1e-7)] {
            let section = SectionDefinition::parse(&format!("naca{digits}:sharp"))?;
            let section = section.with_control_points(points)?.section()?;
            sheet.relative(
                &format!("area, NACA {digits} sharp, {points} points (0.68088 t)"),
                area,
                section.area(),
                tolerance,
            );
        }
    }
    let blunt = SectionDefinition::parse("naca0012")?.with_control_points(401)?.section()?;
    sheet.relative("area, NACA 0012 blunt, 401 points", 0.24 * thickness_integral(false, 0, 1), blunt.area(), 1e-7);
    let t: f64 = 0.12;
    sheet.relative("trailing-edge gap, NACA 0012 blunt (0.021 t)", 0.021 * t, blunt.trailing_edge_gap()?, 1e-12);
    let sharp = SectionDefinition::parse("naca0012:sharp")?.with_control_points(401)?.section()?;
    let moment = |m, n| thickness_integral(true, m, n);
    let (area, first) = (2.0 * t * moment(0, 1), 2.0 * t * moment(1, 1));
    sheet.relative("centroid x, NACA 0012 sharp", first / area, sharp.centroid()?[0], 1e-6);
    let seconds = sharp.second_moments()?;
    sheet.relative("second moment xx, NACA 0012 sharp", 2.0 / 3.0 * t.powi(3) * moment(0, 3), seconds.xx, 1e-6);
    let about_centroid = 2.0 * t * moment(2, 1) - first * first / area;
    sheet.relative("second moment yy, NACA 0012 sharp", about_centroid, seconds.yy, 1e-6);
    sheet.relative(
        "nose radius (1.1019 t^2), 401 points",
        0.5 * (0.2969 / 0.2 * t).powi(2),
        sharp.nose_radius()?,
        5e-3,
    );
    let half = |x: f64| t * thickness_terms(true).iter().map(|(p, c)| c * x.sqrt().powi(*p)).sum::<f64>();
    sheet.relative("thickness at 0.3", 2.0 * half(0.3), sharp.thickness_at(0.3)?, 1e-8);
    let best = (2000..4000).map(|i| 2.0 * half(f64::from(i) * 1e-4)).fold(0.0, f64::max);
    sheet.relative("largest thickness", best, sharp.maximum_thickness()?[1], 1e-7);
    // s^p = x^(p/2) has the slope p/2 at x = 1
    let slope = t * thickness_terms(true).iter().map(|(p, c)| c * f64::from(*p) / 2.0).sum::<f64>();
    sheet.relative("trailing-edge angle", 2.0 * slope.abs().atan(), sharp.trailing_edge_angle()?, 1e-4);
    let cambered = SectionDefinition::parse("naca2412:sharp")?.with_control_points(401)?.section()?;
    sheet.value("area, NACA 2412 sharp: no closed form; of the same thickness", area, cambered.area(), 1e-3 * area);
    Ok(sheet)
}

/// Perimeter of an ellipse by the arithmetic-geometric mean (Abramowitz and Stegun 17.6).
fn ellipse_perimeter(a: f64, b: f64) -> f64 {
    let (mut x, mut y, mut sum, mut power) = (a, b, a * a, 0.5);
    sum -= power * (a * a - b * b);
    while (x - y).abs() > 1e-15 * x {
        let c = 0.5 * (x - y);
        (x, y) = (0.5 * (x + y), (x * y).sqrt());
        power *= 2.0;
        sum -= power * c * c;
    }
    2.0 * PI * sum / (0.5 * (x + y))
}

fn ellipses() -> Result<Sheet, Failure> {
    let mut sheet = Sheet::new(
        "Circle and ellipses as sections",
        "Elementary formulas; perimeter by the arithmetic-geometric mean (Abramowitz and Stegun 17.6). The outline is a\n\
         spline within 1e-12 of the ellipse with semi-axes a (along the chord) and b.",
    );
    let tolerance = 1e-10;
    for (name, a, b) in [("circle", 0.5, 0.5), ("ellipse 4:1", 0.5, 0.125), ("ellipse 10:1", 0.5, 0.05)] {
        let outline = ellipse([0.5, 0.0], [a, b], 0.0, 1e-12)?.curve;
        let section = Section::new(outline, TrailingEdge::Sharp, 0.5, name)?;
        let seconds = section.second_moments()?;
        let [station, thickness] = section.maximum_thickness()?;
        let centroid = section.centroid()?;
        for (what, expected, ours) in [
            ("area", PI * a * b, section.area()),
            ("perimeter", ellipse_perimeter(a, b), section.perimeter()?),
            ("centroid x", 0.5, centroid[0]),
            ("second moment xx", PI * a * b.powi(3) / 4.0, seconds.xx),
            ("second moment yy", PI * a.powi(3) * b / 4.0, seconds.yy),
            ("largest thickness", 2.0 * b, thickness),
            ("thickness at 0.25", 3f64.sqrt() * b, section.thickness_at(0.25)?),
        ] {
            sheet.relative(&format!("{what}, {name}"), expected, ours, tolerance);
        }
        sheet.value(&format!("centroid y, {name}"), 0.0, centroid[1], 1e-13);
        // second derivatives, and a place where the thickness is flat, are reproduced to a lower order
        sheet.relative(&format!("nose radius, {name}"), b * b / a, section.nose_radius()?, 1e-6);
        sheet.value(&format!("station of the largest thickness, {name}"), 0.5, station, 1e-6);
        let leading = section.leading_edge()?;
        sheet.value(&format!("leading edge x, {name}"), 0.0, leading[0], 1e-11);
        sheet.statement(&format!("self-intersection, {name}"), false, section.self_intersection().is_some());
    }
    Ok(sheet)
}

/// A clamped knot vector with random inner knots, some of them double.
fn random_knots(random: &mut Random, degree: usize) -> Result<KnotVector, Failure> {
    let mut inner = Vec::new();
    for _ in 0..random.whole(0, 6) {
        let knot = random.between(0.02, 0.98);
        let times = if degree > 1 && random.chance(0.3) { 2 } else { 1 };
        inner.extend(std::iter::repeat_n(knot, times));
    }
    inner.sort_by(f64::total_cmp);
    Ok(KnotVector::clamped(degree, 0.0, 1.0, inner)?)
}

fn basis() -> Result<Sheet, Failure> {
    let mut sheet = Sheet::new(
        "B-spline basis functions",
        "Known values from The NURBS Book (Piegl and Tiller, example 2.3: knots 0 0 0 1 2 3 4 4 5 5 5 at u = 5/2), Bernstein\n\
         polynomials and uniform splines; partition of unity and linear precision at 200 random knot vectors a degree.",
    );
    let book = KnotVector::new(2, vec![0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 4.0, 5.0, 5.0, 5.0])?;
    let rows = book.basis_derivatives(book.span(2.5), 2.5, 2);
    let known = [[0.125, 0.75, 0.125], [-0.5, 0.0, 0.5], [1.0, -2.0, 1.0]];
    for (order, (row, expected)) in rows.iter().zip(known).enumerate() {
        for (j, (ours, expected)) in row.iter().zip(expected).enumerate() {
            sheet.value(&format!("NURBS Book 2.3, N{},2 derivative {order}", j + 2), expected, *ours, 1e-15);
        }
    }
    let bezier = KnotVector::clamped_uniform(3, 4)?;
    for (j, (ours, expected)) in bezier.basis(bezier.span(0.25), 0.25).iter().zip([27.0, 27.0, 9.0, 1.0]).enumerate() {
        sheet.value(&format!("Bernstein polynomial {j} of degree 3 at 1/4"), expected / 64.0, *ours, 1e-16);
    }
    let uniform = KnotVector::new(3, (0..12).map(f64::from).collect())?;
    for (j, (ours, expected)) in uniform.basis(5, 5.0).iter().zip([1.0, 4.0, 1.0, 0.0]).enumerate() {
        sheet.value(&format!("uniform cubic at a knot, function {j}"), expected / 6.0, *ours, 1e-15);
    }
    let mut random = Random::new(1);
    for degree in 1..=5 {
        let [mut unity, mut linear, mut slope] = [0.0f64; 3];
        for _ in 0..200 {
            let knots = random_knots(&mut random, degree)?;
            let greville = knots.greville();
            for _ in 0..20 {
                let u = random.between(0.0, 1.0);
                let span = knots.span(u);
                let rows = knots.basis_derivatives(span, u, 1);
                let at = |row: usize| {
                    let weighted = rows[row].iter().zip(&greville[span - degree..]);
                    [rows[row].iter().sum::<f64>(), weighted.map(|(n, x)| n * x).sum()]
                };
                unity = unity.max((at(0)[0] - 1.0).abs());
                linear = linear.max((at(0)[1] - u).abs());
                // slopes are as large as the shortest span is short
                let size = rows[1].iter().fold(1.0, |m: f64, v| m.max(v.abs()));
                slope = slope.max(at(1)[0].abs() / size).max((at(1)[1] - 1.0).abs() / size);
            }
        }
        sheet.value(&format!("partition of unity, degree {degree}, worst"), 0.0, unity, 1e-14);
        sheet.value(&format!("linear precision at the Greville abscissae, degree {degree}, worst"), 0.0, linear, 1e-14);
        sheet.value(&format!("slopes of both, degree {degree}, worst relative"), 0.0, slope, 1e-13);
    }
    Ok(sheet)
}

fn refinement() -> Result<Sheet, Failure> {
    let mut sheet = Sheet::new(
        "Changes of representation",
        "Knot insertion, degree elevation, splitting and reversal describe the same curve: largest distance at 200 parameters\n\
         of 50 random curves a degree, coordinates within 1.",
    );
    let mut random = Random::new(2);
    for degree in 1..=5 {
        let mut worst = [0.0f64; 4];
        for _ in 0..50 {
            let knots = random_knots(&mut random, degree)?;
            let points = (0..knots.control_points()).map(|_| [random.between(-1.0, 1.0), random.between(-1.0, 1.0)]);
            let curve = BSplineCurve::new(knots.clone(), points.collect())?;
            let cut = random.between(0.1, 0.9);
            let refined = curve.refine(&[cut, random.between(0.0, 1.0)])?;
            let elevated = curve.elevate_degree(2)?;
            let (left, right) = curve.split(cut)?;
            let reversed = curve.reversed()?;
            let (first, last) = reversed.domain();
            for i in 0..=200 {
                let u = f64::from(i) / 200.0;
                let point = curve.point_at(u);
                let part = if u < cut { &left } else { &right };
                let others =
                    [refined.point_at(u), elevated.point_at(u), part.point_at(u), reversed.point_at(first + last - u)];
                for (worst, other) in worst.iter_mut().zip(others) {
                    *worst = worst.max((other[0] - point[0]).hypot(other[1] - point[1]));
                }
            }
        }
        for (what, worst) in ["knots inserted", "degree elevated twice", "split", "reversed"].iter().zip(worst) {
            sheet.value(&format!("{what}, degree {degree}"), 0.0, worst, 1e-12);
        }
    }
    Ok(sheet)
}

fn boxes() -> Result<Sheet, Failure> {
    let mut sheet = Sheet::new(
        "Boxes and their penalty",
        "Affine movements of the net move the section affinely; a Greville box is the identity map; equations 1 to 4 of the\n\
         paper by hand: an undeformed even box has indicators 1 - ln 4 / (1000 A) inside, 1 - ln 2 / (1000 A) at edges, 1 at\n\
         corners (A the area of a triangle), eta(0) = 1/4, eta(-1) = 3/2.",
    );
    let section = SectionDefinition::parse("naca2412:sharp")?.section()?;
    let points = section.curve().control_points();
    let affine = |p: [f64; 2]| [0.1 + 1.2 * p[0] - 0.3 * p[1], -0.05 + 0.2 * p[0] + 0.9 * p[1]];
    let bounds = [[-0.1, 1.1], [-0.15, 0.15]];
    for degree in 1..=5 {
        let greville = FfdBox::rectangular(bounds, [7, 6], [degree; 2], Placement::Greville)?;
        let mut worst = 0.0f64;
        for i in 0..=20 {
            for j in 0..=20 {
                let [u, v] = [f64::from(i) / 20.0, f64::from(j) / 20.0];
                let [x, y] = greville.evaluate([u, v]);
                worst = worst.max((x + 0.1 - 1.2 * u).abs()).max((y + 0.15 - 0.3 * v).abs());
            }
        }
        sheet.value(&format!("identity map, Greville box of degree {degree}, worst"), 0.0, worst, 1e-14);
        for placement in [Placement::Even, Placement::Greville] {
            let lattice = FfdBox::rectangular(bounds, [7, 6], [degree; 2], placement)?;
            let moves: Vec<[f64; 2]> =
                (lattice.control_points().iter()).map(|&p| [affine(p)[0] - p[0], affine(p)[1] - p[1]]).collect();
            let moved = lattice.embed(points)?.deform(points, &moves)?;
            let distance = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - affine(*b)[0]).hypot(a[1] - affine(*b)[1]);
            let worst = moved.iter().zip(points).map(distance).fold(0.0, f64::max);
            sheet.value(&format!("affine movement, {placement:?} box of degree {degree}, worst"), 0.0, worst, 1e-14);
            let tail = (moved[0], moved[moved.len() - 1]);
            let closed = tail.0.map(f64::to_bits) == tail.1.map(f64::to_bits);
            sheet.statement(
                &format!("sharp trailing edge closed to the bit, {placement:?}, degree {degree}"),
                true,
                closed,
            );
        }
    }
    for counts in [[4usize, 4], [5, 5], [7, 5]] {
        let lattice = FfdBox::rectangular(bounds, counts, [3, 3], Placement::Even)?;
        let area = 0.5 * 1.2 / (counts[0] - 1) as f64 * 0.3 / (counts[1] - 1) as f64;
        let penalty = FoldPenalty::default().on(&lattice)?;
        let report = penalty.report(lattice.control_points());
        let what = format!("smallest indicator, undeformed {}x{} box", counts[0], counts[1]);
        sheet.relative(&what, 1.0 - 4f64.ln() / 1000.0 / area, report.smallest_indicator, 1e-9);
        sheet.statement(&format!("folded, undeformed {}x{} box", counts[0], counts[1]), false, report.folded);
    }
    sheet.relative("eta(0)", 0.25, penalty_of_indicator(0.0), 1e-15);
    sheet.relative("eta(-1)", 1.5, penalty_of_indicator(-1.0), 1e-12);
    // erfc(1) from Abramowitz and Stegun, table 7.1
    sheet.relative("eta(0.1) with erfc(1) = 0.157299207050", 0.157_299_207_050 * 0.2, penalty_of_indicator(0.1), 1e-11);
    Ok(sheet)
}

fn norms() -> Result<Sheet, Failure> {
    let mut sheet = Sheet::new(
        "Shape errors",
        "A section against itself shifted by d = 0.01: d^2 times perimeter, d^2, 101 d^2, and d.",
    );
    let target = SectionDefinition::parse("naca8416:sharp")?.section()?;
    let curve = target.curve();
    let d: f64 = 0.01;
    let shifted: Vec<[f64; 2]> = curve.control_points().iter().map(|p| [p[0] + 0.6 * d, p[1] - 0.8 * d]).collect();
    for (name, norm) in ShapeNorm::NAMES {
        let error = ShapeError::new(norm, curve, curve)?;
        let (expected, tolerance) = match norm {
            // two quadratures of the length of the same curve
            ShapeNorm::ArcLength => (d * d * target.perimeter()?, 1e-6),
            ShapeNorm::Parameter => (d * d, 1e-12),
            ShapeNorm::ControlPoints => (101.0 * d * d, 1e-12),
            ShapeNorm::RootMeanSquare => (d, 1e-12),
            // the mean square of the normal component, for which there is no formula
            ShapeNorm::Closest => (f64::NAN, 0.0),
        };
        if norm != ShapeNorm::Closest {
            sheet.relative(&format!("{name}, shifted"), expected, error.value(&shifted), tolerance);
        }
        sheet.value(&format!("{name}, itself"), 0.0, error.value(curve.control_points()), 1e-15);
    }
    Ok(sheet)
}
