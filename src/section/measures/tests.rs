//! Measures against closed forms, under motions, and their derivatives.

use super::*;
use crate::differentiate::{Function, StepRange, VectorFunction, finite_difference_jacobian, hessian, jacobian};
use crate::section::{Coordinates, Kulfan, MeasureProblem, SectionDefinition, TrailingEdge};
use crate::spline::{BSplineCurve, EndCondition, KnotVector, interpolate};
use approx::assert_relative_eq;
use num_dual::Dual64;
use proptest::prelude::*;

fn built(text: &str, control_points: usize) -> Section {
    let definition = SectionDefinition::parse(text).unwrap().with_control_points(control_points).unwrap();
    definition.section().unwrap()
}

fn all_measures() -> Vec<Measure> {
    Measure::NAMES.iter().map(|name| Measure::parse(name).unwrap()).collect()
}

/// A section of straight lines.
fn polygon(points: &[[f64; 2]], trailing_edge: TrailingEdge) -> Section {
    let knots = KnotVector::clamped_uniform(1, points.len()).unwrap();
    Section::new(BSplineCurve::new(knots, points.to_vec()).unwrap(), trailing_edge, 0.5, "polygon").unwrap()
}

/// An ellipse with half axes 1/2 and `b`, trailing edge at (1, 0).
fn ellipse(b: f64, points: usize) -> Section {
    let n = points - 1;
    let parameters: Vec<f64> = (0..=n).map(|i| i as f64 / n as f64).collect();
    let angle = |i: usize| std::f64::consts::TAU * i as f64 / n as f64;
    let mut outline: Vec<_> = (0..=n).map(|i| [0.5 + 0.5 * angle(i).cos(), b * angle(i).sin()]).collect();
    outline[n] = outline[0];
    let tangent = [0.0, std::f64::consts::TAU * b];
    let curve = interpolate(&parameters, &outline, EndCondition::Clamped { start: tangent, end: tangent }).unwrap();
    let curve = crate::section::stations::with_ends(&curve, outline[0], outline[0]).unwrap();
    Section::new(curve, TrailingEdge::Sharp, 0.5, "ellipse").unwrap()
}

#[test]
fn a_diamond_is_measured_exactly() {
    // half diagonals 1/2 and 0.1 about (0.5, 0)
    let s = polygon(&[[1.0, 0.0], [0.5, 0.1], [0.0, 0.0], [0.5, -0.1], [1.0, 0.0]], TrailingEdge::Sharp);
    let m = s.second_moments().unwrap();
    assert_relative_eq!(s.area(), 0.1, max_relative = 1e-14);
    assert_relative_eq!(s.centroid().unwrap()[0], 0.5, max_relative = 1e-14);
    assert!(s.centroid().unwrap()[1].abs() < 1e-16);
    // a diamond with diagonals a (along) and b (across): a b³/48 and a³ b/48
    assert_relative_eq!(m.xx, 0.008 / 48.0, max_relative = 1e-13);
    assert_relative_eq!(m.yy, 0.2 / 48.0, max_relative = 1e-13);
    assert!(m.xy.abs() < 1e-16);
    assert_relative_eq!(s.perimeter().unwrap(), 4.0 * 0.26f64.sqrt(), max_relative = 1e-14);
    assert_relative_eq!(s.thickness_at(0.25).unwrap(), 0.1, max_relative = 1e-14);
    assert_relative_eq!(s.trailing_edge_angle().unwrap(), 2.0 * 0.2f64.atan(), max_relative = 1e-14);
    assert_eq!(s.trailing_edge_gap().unwrap(), 0.0);
}

#[test]
fn a_blunt_wedge_is_closed_by_its_base() {
    let s = polygon(&[[1.0, 0.2], [0.0, 0.0], [1.0, -0.1]], TrailingEdge::Blunt);
    assert_relative_eq!(s.area(), 0.15, max_relative = 1e-14);
    let [x, y] = s.centroid().unwrap();
    assert!((x - 2.0 / 3.0).abs() < 1e-15 && (y - 0.1 / 3.0).abs() < 1e-15);
    assert_relative_eq!(s.perimeter().unwrap(), 0.3 + 1.04f64.sqrt() + 1.01f64.sqrt(), max_relative = 1e-14);
    // the gap stands normal to the chord, which points to (1, 0.05)
    let chord = 1.0025f64.sqrt();
    assert_relative_eq!(s.chord_frame().unwrap().chord, chord, max_relative = 1e-15);
    assert_relative_eq!(s.trailing_edge_gap().unwrap(), 0.3 / chord, max_relative = 1e-14);
    // the surfaces open towards the tail
    assert_relative_eq!(s.trailing_edge_angle().unwrap(), -0.2f64.atan() - 0.1f64.atan(), max_relative = 1e-14);
    // second moments of a triangle with base b, height h: b h³/36 about the axis along its base
    assert_relative_eq!(s.second_moments().unwrap().yy, 0.3 / 36.0, max_relative = 1e-13);
}

#[test]
fn an_ellipse_is_approached_with_the_fourth_order() {
    let b = 0.1;
    let pi = std::f64::consts::PI;
    let off = |s: &Section, x: f64, thickness: f64| (s.thickness_at(x).unwrap() / thickness - 1.0).abs();
    let mut previous: Option<[f64; 6]> = None;
    for n in [41, 161] {
        let s = ellipse(b, n);
        let m = s.second_moments().unwrap();
        let errors = [
            s.area() / (pi * 0.5 * b) - 1.0,
            m.xx / (pi * 0.5 * b.powi(3) / 4.0) - 1.0,
            m.yy / (pi * 0.125 * b / 4.0) - 1.0,
            // over many stations, since the error depends on the place within a span
            (1..20).map(|i| f64::from(i) / 20.0).map(|x| off(&s, x, 4.0 * b * (x - x * x).sqrt())).sum(),
            s.maximum_thickness().unwrap()[1] / (2.0 * b) - 1.0,
            // curvature of a cubic spline is of second order only
            (s.nose_radius().unwrap() / (b * b / 0.5) - 1.0) / (n * n) as f64,
        ];
        if let Some(previous) = previous {
            for (k, (new, old)) in errors.iter().zip(previous).enumerate() {
                // a fourfold density divides the error by 256, more or less with the place in a span
                assert!(new.abs() < old.abs() / 60.0 || new.abs() < 1e-13, "{n} {k}: {old:e} {new:e}");
            }
        }
        previous = Some(errors);
        assert_relative_eq!(s.maximum_thickness().unwrap()[0], 0.5, max_relative = 1e-6);
    }
    let circle = ellipse(0.5, 201);
    assert_relative_eq!(circle.perimeter().unwrap(), pi, max_relative = 1e-8);
    assert_relative_eq!(circle.nose_radius().unwrap(), 0.5, max_relative = 1e-3);
    assert!(circle.leading_edge().unwrap()[0].abs() < 1e-15);
}

#[test]
fn naca_sections_have_their_printed_properties() {
    for (text, t) in [("naca0012:sharp", 0.12), ("naca0024:sharp", 0.24), ("naca0006:sharp", 0.06)] {
        let s = built(text, 401);
        // the integral of the thickness polynomial
        let shape = 0.2969 / 1.5 - 0.1260 / 2.0 - 0.3516 / 3.0 + 0.2843 / 4.0 - 0.1036 / 5.0;
        assert_relative_eq!(s.area(), 10.0 * shape * t, max_relative = 2e-8);
        assert_relative_eq!(10.0 * shape, 0.68088, max_relative = 1e-5);
        assert_relative_eq!(s.maximum_thickness().unwrap()[1], t, max_relative = 3e-4);
        assert_relative_eq!(s.maximum_thickness().unwrap()[0], 0.3, max_relative = 3e-3);
        assert_relative_eq!(s.nose_radius().unwrap(), 1.1019 * t * t, max_relative = 2e-2);
        // slope of the thickness at the tail
        let slope = -5.0 * t * (0.2969 / 2.0 - 0.1260 - 2.0 * 0.3516 + 3.0 * 0.2843 - 4.0 * 0.1036);
        assert_relative_eq!(s.trailing_edge_angle().unwrap(), 2.0 * slope.atan(), max_relative = 1e-4);
        assert!(s.camber().unwrap().abs() < 1e-15);
        assert_eq!(s.curvature_reversals(0.01), [0, 0]);
        assert!(s.leading_edge().unwrap().iter().all(|c| c.abs() < 1e-12));
    }
    // the radius is approached as points are added
    let error = |n| (built("naca0012", n).nose_radius().unwrap() / (0.5 * (0.2969f64 * 0.6).powi(2)) - 1.0).abs();
    let (coarse, middle, fine) = (error(101), error(401), error(1601));
    assert!(middle < coarse / 3.0 && fine < middle / 3.0 && fine < 4e-3, "{coarse} {middle} {fine}");
    assert_relative_eq!(built("naca0012:sharp", 101).area(), 0.0817, max_relative = 1e-3);
    let gap = built("naca0012", 101).trailing_edge_gap().unwrap();
    assert!((gap - 0.00252).abs() < 1e-15);
    // camber stands normal to the chord, so it is 8 % only nearly
    let cambered = built("naca8416:sharp", 201).maximum_camber().unwrap();
    assert!((cambered[0] - 0.4).abs() < 0.02 && (cambered[1] - 0.08).abs() < 5e-4, "{cambered:?}");
    let inverted = built("naca4412", 101);
    let mirrored: Vec<_> = inverted.curve().control_points().iter().rev().map(|p| [p[0], -p[1]]).collect();
    let inverted = inverted.with_control_points(mirrored).unwrap();
    assert!((inverted.camber().unwrap() + 0.04).abs() < 2e-4);
}

#[test]
fn the_papers_areas_are_met() {
    assert!((built("naca0024:sharp", 101).area() - 0.16341).abs() < 1e-5);
    let stand_in = Kulfan::new(vec![0.3625; 4], vec![-0.2225; 4]).unwrap();
    let section = SectionDefinition::Kulfan(stand_in).section().unwrap();
    assert!((section.area() - 0.1560).abs() < 1e-6 && (section.maximum_thickness().unwrap()[1] - 0.225).abs() < 2e-4);
}

#[test]
fn names_are_read_back() {
    for measure in all_measures() {
        assert_eq!(Measure::parse(&measure.name()), Ok(measure));
        assert_eq!(measure.to_string(), measure.name());
    }
    assert_eq!(Measure::parse("thickness at 0.25"), Ok(Measure::ThicknessAt(0.25)));
    assert_eq!(Measure::parse(" Camber_At( 0.5 ) "), Ok(Measure::CamberAt(0.5)));
    assert_eq!("nose radius".parse(), Ok(Measure::NoseRadius));
    for text in ["", "are", "thickness_at", "thickness_at(x)", "thickness_at(1.5)", "area at 0.3", "camber_at(nan)"] {
        assert!(Measure::parse(text).is_err(), "{text}");
    }
}

#[test]
fn missing_measures_say_why() {
    let flat = polygon(&[[1.0, 0.0], [0.5, 0.0], [0.0, 0.0], [0.5, 0.0], [1.0, 0.0]], TrailingEdge::Sharp);
    assert_eq!(
        flat.centroid().unwrap_err(),
        SectionError::NoMeasure { measure: "centroid", reason: MeasureProblem::NoArea { area: 0.0 } }
    );
    assert!(matches!(flat.maximum_camber(), Err(SectionError::NoMeasure { .. })));
    let point = polygon(&[[1.0, 0.0], [0.5, 0.1], [1.0, 0.0], [0.5, -0.1], [1.0, 0.0]], TrailingEdge::Sharp);
    for measure in all_measures() {
        if let Ok(value) = measure.evaluate(&point) {
            assert!(value.is_finite(), "{measure}");
        }
    }
    assert!(matches!(point.chord_frame(), Err(SectionError::NoMeasure { measure: "chord", .. })));
    let s = built("naca2412", 101);
    for station in [0.0, 1.0, -1.0, f64::NAN] {
        assert!(s.thickness_at(station).is_err());
    }
    // a wedge is thickest at its base
    let wedge = polygon(&[[1.0, 0.2], [0.0, 0.0], [1.0, -0.1]], TrailingEdge::Blunt);
    assert!(wedge.maximum_thickness().is_err());
}

/// Sections of every kind, with few control points.
fn samples() -> Vec<(&'static str, Section)> {
    let file = b"test\n1 0.002\n.8 .035\n.5 .085\n.25 .1\n.08 .07\n.01 .025\n0 0\n.01 -.02\n.08 -.04\n.25 -.06\n.5 -.05\n.8 -.02\n1 -.001\n";
    vec![
        ("naca2412 sharp", built("naca2412:sharp", 21)),
        ("naca0024 blunt", built("naca0024", 21)),
        ("kulfan", built("kulfan:upper=0.3,0.25,0.2/lower=-0.12,-0.2,0.05/gap=0.004", 31)),
        ("file", Coordinates::parse(file).unwrap().section().unwrap()),
    ]
}

/// An error that the estimate of the differences leaves out: it takes functions to be good to 4 ε, but directions at
/// the dense points of the trailing edge lose three digits more, and steps go down to 1e-5.
const ROUND_OFF: f64 = 1e-8;

/// All measures as functions of the control points; the ends of a sharp section move together.
struct OfControlPoints<'a> {
    section: &'a Section,
    measures: Vec<Measure>,
}

impl OfControlPoints<'_> {
    fn start(&self) -> Vec<f64> {
        let mut points: Vec<f64> = self.section.curve().control_points().iter().flatten().copied().collect();
        if self.section.trailing_edge() == TrailingEdge::Sharp {
            points.truncate(points.len() - 2);
        }
        points
    }
}

impl VectorFunction for OfControlPoints<'_> {
    type Error = SectionError;
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, SectionError> {
        let mut points: Vec<[S; 2]> = x.chunks(2).map(|c| [c[0], c[1]]).collect();
        if self.section.trailing_edge() == TrailingEdge::Sharp {
            points.push(points[0]);
        }
        let section = self.section.with_control_points(points)?;
        self.measures.iter().map(|m| m.evaluate(&section)).collect()
    }
}

#[test]
fn gradients_by_control_points_agree_by_three_routes() {
    for (name, section) in &samples() {
        let measures: Vec<Measure> = all_measures()
            .into_iter()
            // a symmetric section has no place of largest camber, and its camber a kink
            .filter(|m| *name != "naca0024 blunt" || !matches!(m, Measure::CamberX | Measure::Camber))
            // the gap of a sharp trailing edge stays zero
            .filter(|m| section.trailing_edge() == TrailingEdge::Blunt || *m != Measure::TrailingEdgeGap)
            // a step of one control point is a dent, whose curvature differences do not resolve: by parameters below
            .filter(|m| *m != Measure::Concavity)
            .collect();
        let f = OfControlPoints { section, measures };
        let x = f.start();
        let (values, exact) = jacobian(&f, &x).unwrap();
        // one dual at a time
        for k in 0..x.len() {
            let duals: Vec<Dual64> =
                x.iter().enumerate().map(|(i, &v)| Dual64::new(v, f64::from(u8::from(i == k)))).collect();
            for (row, value) in f.evaluate(&duals).unwrap().iter().enumerate() {
                let scale = exact.row(row).amax().max(1.0);
                assert!((value.eps - exact[(row, k)]).abs() <= 1e-12 * scale, "{name} {}", f.measures[row]);
                assert!((value.re - values[row]).abs() <= 1e-13);
            }
        }
        let steps = vec![StepRange { first: 2e-4, levels: 7 }; x.len()];
        let checked = finite_difference_jacobian(|x| f.evaluate(x), &x, &steps).unwrap();
        for (row, measure) in f.measures.iter().enumerate() {
            let scale = exact.row(row).amax();
            assert!(scale > 0.0, "{name} {measure} depends on nothing");
            for k in 0..x.len() {
                let (a, b) = (exact[(row, k)], checked[(row, k)]);
                assert!((a - b.value).abs() <= b.error + ROUND_OFF * scale, "{name} {measure} by {k}: {a} {b:?}");
                assert!(b.error < 1e-3 * scale, "{name} {measure} by {k}: {b:?} is not worth having");
            }
        }
    }
}

/// One measure as a function of the build parameters.
struct OfParameters<'a>(&'a SectionDefinition, Measure);

impl Function for OfParameters<'_> {
    type Error = SectionError;
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<S, SectionError> {
        self.1.evaluate(&self.0.build(x)?)
    }
}

#[test]
fn gradients_by_build_parameters_agree_by_three_routes() {
    for text in [
        "naca2412:sharp",
        "naca4415",
        "naca23012",
        "naca23112:sharp",
        "kulfan:upper=0.2,0.25,0.2,0.3/lower=-0.15,-0.1,-0.12,0.05/gap=0.003",
    ] {
        let definition = SectionDefinition::parse(text).unwrap();
        let x: Vec<f64> = definition.parameters().iter().map(|p| p.1).collect();
        for measure in all_measures() {
            let f = OfParameters(&definition, measure);
            let (_, first) = crate::differentiate::gradient(&f, &x).unwrap();
            let (_, second, curvature) = hessian(&f, &x).unwrap();
            let scale = first.iter().fold(1.0, |m: f64, v| m.max(v.abs()));
            for (a, b) in first.iter().zip(&second) {
                assert!((a - b).abs() <= 1e-12 * scale, "{text} {measure}: {a} {b}");
            }
            assert!(curvature.iter().all(|v| v.is_finite()));
            // shorter steps would see the round-off of tangents
            let steps = vec![StepRange { first: 1e-3, levels: 5 }; x.len()];
            let checked = finite_difference_jacobian(|x| f.evaluate(x).map(|v| vec![v]), &x, &steps).unwrap();
            for (k, a) in first.iter().enumerate() {
                let b = checked[(0, k)];
                assert!((a - b.value).abs() <= b.error + ROUND_OFF * scale, "{text} {measure} by {k}: {a} {b:?}");
            }
        }
    }
}

#[test]
fn second_derivatives_are_exact_too() {
    // through the lifted parameters: gradients differenced against hyper-dual second derivatives
    let definition = SectionDefinition::parse("naca4415:sharp").unwrap();
    let x: Vec<f64> = definition.parameters().iter().map(|p| p.1).collect();
    for measure in [Measure::Thickness, Measure::ThicknessAt(0.3), Measure::Camber, Measure::CamberAt(0.6)] {
        let f = OfParameters(&definition, measure);
        let (_, _, exact) = hessian(&f, &x).unwrap();
        let steps = vec![StepRange { first: 1e-3, levels: 7 }; x.len()];
        let slope = |x: &[f64]| crate::differentiate::gradient(&f, x).map(|g| g.1);
        let checked = finite_difference_jacobian(slope, &x, &steps).unwrap();
        let scale = exact.amax();
        for (a, b) in exact.iter().zip(checked.iter()) {
            assert!((a - b.value).abs() <= b.error + 1e-9 * scale, "{measure}: {a} {b:?}");
        }
    }
}

proptest! {
    #[test]
    fn motions_change_measures_as_they_should(
        thickness in 0.05f64..0.3,
        camber in 0.01f64..0.08,
        position in 0.25f64..0.6,
        angle in -3.0f64..3.0,
        shift in [-100.0f64..100.0, -100.0f64..100.0],
        size in 0.1f64..10.0,
    ) {
        let definition = SectionDefinition::parse("naca2412:sharp").unwrap().with_control_points(41).unwrap();
        let a = definition.build(&[thickness, camber, position]).unwrap();
        let (sin, cos) = angle.sin_cos();
        let turn = |p: [f64; 2]| [cos * p[0] - sin * p[1], sin * p[0] + cos * p[1]];
        let motion = |p: [f64; 2]| {
            let q = turn(p);
            [size * q[0] + shift[0], size * q[1] + shift[1]]
        };
        let b = a.with_control_points(a.curve().control_points().iter().map(|&p| motion(p)).collect()).unwrap();
        let close = |x: f64, y: f64, tolerance: f64| (x - y).abs() <= tolerance * x.abs().max(y.abs()).max(1e-2);
        // coordinates of a hundred are rounded to 1e-14
        let noise = 1e-12 / size;
        prop_assert!(close(b.area(), a.area() * size * size, 10.0 * noise / size.min(1.0)));
        prop_assert!(close(b.perimeter().unwrap(), a.perimeter().unwrap() * size, noise));
        for measure in [Measure::Thickness, Measure::Camber, Measure::ThicknessAt(0.3), Measure::CamberAt(0.7)] {
            let (va, vb) = (measure.evaluate(&a).unwrap(), measure.evaluate(&b).unwrap() / size);
            prop_assert!(close(va, vb, 100.0 * noise), "{measure}: {va} {vb}");
        }
        for measure in [Measure::ThicknessX, Measure::CamberX, Measure::TrailingEdgeAngle] {
            let (va, vb) = (measure.evaluate(&a).unwrap(), measure.evaluate(&b).unwrap());
            prop_assert!(close(va, vb, 1e-6), "{measure}: {va} {vb}");
        }
        prop_assert!(close(b.nose_radius().unwrap(), a.nose_radius().unwrap() * size, 1e-8));
        for (moved, still) in [
            (b.centroid().unwrap(), a.centroid().unwrap()),
            (b.leading_edge().unwrap(), a.leading_edge().unwrap()),
        ] {
            let expected = motion(still);
            prop_assert!((moved[0] - expected[0]).hypot(moved[1] - expected[1]) < 1e-9, "{moved:?} {expected:?}");
        }
        // second moments turn as a tensor does
        let (ma, mb) = (a.second_moments().unwrap(), b.second_moments().unwrap());
        let scale = size.powi(4);
        prop_assert!(close(mb.xx + mb.yy, (ma.xx + ma.yy) * scale, 1e-9 / size.min(1.0).powi(4)));
        let turned = ma.xx * cos * cos + ma.yy * sin * sin + 2.0 * ma.xy * sin * cos;
        prop_assert!((mb.xx - turned * scale).abs() < 1e-9 * scale.max(1.0), "{} {}", mb.xx, turned * scale);
        prop_assert_eq!(b.self_intersection().is_some(), a.self_intersection().is_some());
    }
}

/// A section of thickness 0.12 about the camber line `size x (1 − x) (zero − x)`, over any scalar.
fn reflexed<S: Scalar>(size: S, zero: S) -> Section<S> {
    let base = built("naca0012:sharp", 201);
    let points = base.curve().control_points().iter().map(|&[x, y]| {
        let line = (zero - x) * size * (x * (1.0 - x));
        [S::from(x), line + y]
    });
    base.with_control_points(points.collect()).unwrap()
}

#[test]
fn where_extremes_tie_there_is_a_value_and_no_derivative() {
    let tied = |measure: Measure, section: &Section<Dual64>| {
        let error = measure.evaluate(section).unwrap_err();
        assert!(
            matches!(error, SectionError::NoMeasure { reason: MeasureProblem::Tied { .. }, .. }),
            "{measure}: {error}"
        );
    };
    // a symmetric section, and one that is symmetric to round-off
    for size in [0.0_f64, 1e-14, 1e-11] {
        assert!(reflexed(size, 0.7).camber().unwrap().abs() < 1e-11);
        tied(Measure::Camber, &reflexed(Dual64::new(size, 1.0), Dual64::from(0.7)));
    }
    // the sign of the larger extreme changes where the two tie
    let (mut low, mut high) = (0.3f64, 0.7f64);
    assert!(reflexed(0.5, low).camber().unwrap() < 0.0 && reflexed(0.5, high).camber().unwrap() > 0.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if reflexed(0.5, middle).camber().unwrap() > 0.0 { high = middle } else { low = middle }
    }
    let (below, above) = (reflexed(0.5, low).camber().unwrap(), reflexed(0.5, high).camber().unwrap());
    assert!((below + above).abs() < 1e-12 && above > 0.01, "{below} {above}");
    for measure in [Measure::Camber, Measure::CamberX] {
        tied(measure, &reflexed(Dual64::new(0.5, 1.0), Dual64::from(low)));
        // the derivative is back a little beside the tie
        assert!(measure.evaluate(&reflexed(Dual64::new(0.5, 1.0), Dual64::from(low + 1e-9))).is_ok());
    }
}

#[test]
fn the_camber_has_its_derivatives_wherever_one_extreme_is_the_largest() {
    struct OfLine;
    impl VectorFunction for OfLine {
        type Error = SectionError;
        fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, SectionError> {
            let section = reflexed(x[0], x[1]);
            let [station, largest] = section.maximum_camber()?;
            Ok(vec![section.camber()?, station, largest])
        }
    }
    for x in [[0.5, 0.9], [-0.3, 0.75], [0.02, 0.2], [1e-5, 0.9]] {
        let (values, exact) = jacobian(&OfLine, &x).unwrap();
        for k in 0..2 {
            let seeded: Vec<Dual64> = (0..2).map(|i| Dual64::new(x[i], f64::from(u8::from(i == k)))).collect();
            for (row, value) in OfLine.evaluate(&seeded).unwrap().iter().enumerate() {
                assert!((value.eps - exact[(row, k)]).abs() <= 1e-12 * exact.row(row).amax().max(1.0));
                assert_eq!(value.re, values[row]);
            }
        }
        let steps = [StepRange { first: 0.02 * f64::abs(x[0]), levels: 6 }, StepRange { first: 1e-3, levels: 6 }];
        let checked = finite_difference_jacobian(|x| OfLine.evaluate(x), &x, &steps).unwrap();
        for (row, k) in (0..3).flat_map(|row| [(row, 0), (row, 1)]) {
            let (a, e) = (exact[(row, k)], checked[(row, k)]);
            assert!((a - e.value).abs() <= 10.0 * e.error + 1e-7 * exact.row(row).amax(), "{x:?} {row} {k}: {a} {e:?}");
        }
        // the true extreme of many stations
        let section = reflexed(x[0], x[1]);
        let most = (1..2000)
            .map(|i| section.camber_at(i as f64 / 2000.0).unwrap())
            .fold(0.0f64, |m, c| if c.abs() > m.abs() { c } else { m });
        assert!((values[0] - most).abs() < 1e-6 && values[0].abs() >= most.abs() - 1e-15, "{x:?} {values:?} {most}");
    }
}
