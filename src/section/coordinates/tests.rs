//! Reading, mending and building sections from points.

use super::*;
use crate::section::SectionDefinition;

pub(super) fn naca() -> Vec<[f64; 2]> {
    SectionDefinition::parse("naca4412").unwrap().section().unwrap().points(99)
}

pub(super) fn file(points: impl IntoIterator<Item = [f64; 2]>) -> String {
    points.into_iter().map(|[x, y]| format!("{x} {y}\n")).collect()
}

pub(super) fn parse(text: &str) -> Result<Coordinates, CoordinateError> {
    Coordinates::parse(text.as_bytes())
}

#[test]
fn selig_files_come_back_to_the_bit() {
    for text in ["naca4412", "naca0012:sharp", "naca23112", "kulfan:upper=0.1,0.3/lower=-0.2,0.1"] {
        let section = SectionDefinition::parse(text).unwrap().section().unwrap();
        let read = parse(&section.selig()).unwrap();
        assert_eq!(read.points(), section.points(99));
        assert_eq!((read.name(), read.trailing_edge()), (section.name(), section.trailing_edge()));
        assert_eq!(read.repairs(), []);
        // and again through the curve of the file
        let again = read.section().unwrap();
        for (a, b) in again.points(99).iter().zip(read.points()) {
            assert!((a[0] - b[0]).abs() < 1e-15 && (a[1] - b[1]).abs() < 1e-15);
        }
        assert!((again.area() / section.area() - 1.0).abs() < 1e-5);
    }
}

#[test]
fn every_arrangement_gives_the_same_outline() {
    let points = naca();
    let (upper, lower) = (&points[..50], &points[49..]);
    let to_nose = |p: &[[f64; 2]]| p.to_vec();
    let reversed = |p: &[[f64; 2]]| p.iter().rev().copied().collect::<Vec<_>>();
    let header = "50. 50.\n\n";
    let arrangements = [
        file(points.clone()),
        file(reversed(&points)),
        // Lednicer, either surface first, from nose to tail or back
        format!("title\n{header}{}\n{}", file(reversed(upper)), file(to_nose(lower))),
        format!("title\n{header}{}\n{}", file(to_nose(lower)), file(reversed(upper))),
        format!("title\n{header}{}\n{}", file(to_nose(upper)), file(reversed(lower))),
        // the same without a header, divided by a blank line, by a heading, or not at all
        format!("{}\n{}", file(reversed(upper)), file(to_nose(lower))),
        format!("{}lower surface\n{}", file(reversed(upper)), file(to_nose(lower))),
        format!("{}{}", file(to_nose(lower)), file(reversed(upper))),
        // from the nose round the tail
        format!("{}{}", file(to_nose(lower)), file(to_nose(&upper[..49]))),
        format!("{}{}", file(reversed(upper)), file(reversed(&lower[1..]))),
    ];
    for text in arrangements {
        let read = parse(&format!("title\n{text}")).unwrap();
        assert_eq!(read.points(), points, "{:?}", read.repairs());
    }
}

#[test]
fn repairs_are_recorded() {
    let points = naca();
    let sharp = SectionDefinition::parse("naca4412:sharp").unwrap().section().unwrap().points(99);
    // a duplicate
    let mut text: Vec<_> = points.clone();
    text.insert(10, points[9]);
    let read = parse(&file(text)).unwrap();
    assert_eq!(read.repairs(), [Repair::DuplicateDropped { count: 1, line: 11 }]);
    assert_eq!(read.points(), points);
    // two points exchanged
    let mut text = points.clone();
    text.swap(20, 21);
    let read = parse(&file(text)).unwrap();
    assert_eq!((read.repairs(), read.points()), (&[Repair::Sorted { count: 2, line: 21 }][..], &points[..]));
    // the base drawn, with a point in its middle at both ends or as a closing line
    let mut text = points.clone();
    let middle = [0.5 * (points[0][0] + points[98][0]), 0.5 * (points[0][1] + points[98][1])];
    text.insert(0, middle);
    text.push(middle);
    let read = parse(&file(text)).unwrap();
    assert_eq!(read.repairs(), [Repair::BasePointDropped { count: 2, line: 1 }]);
    assert_eq!(read.points(), points);
    let mut text = points.clone();
    text.push(points[0]);
    assert_eq!(parse(&file(text)).unwrap().points(), points);
    // the sharp trailing edge named once only, or with rounding
    let read = parse(&file(sharp[..98].to_vec())).unwrap();
    assert_eq!(read.trailing_edge(), TrailingEdge::Blunt, "a step of 0.001 may be meant");
    let coarse: Vec<_> = sharp.iter().step_by(2).copied().collect();
    let read = parse(&file(coarse[..coarse.len() - 1].to_vec())).unwrap();
    assert!(matches!(read.repairs(), [Repair::TrailingEdgeCompleted { .. }]), "{:?}", read.repairs());
    assert_eq!((read.points(), read.trailing_edge()), (&coarse[..], TrailingEdge::Sharp));
    let mut text = sharp.clone();
    text[98][1] = 1e-8;
    let read = parse(&file(text)).unwrap();
    assert_eq!(read.repairs(), [Repair::TrailingEdgeClosed { gap: 1e-8 }]);
    assert_eq!(read.points()[0], read.points()[98]);
    // remarks
    let read = parse(&format!("title\n{}\nby hand, 12 May 2001\n28/12/2005 1.0 2.0\n", file(points.clone()))).unwrap();
    assert_eq!(read.repairs(), [Repair::RemarkIgnored { count: 2, line: 102 }]);
}

#[test]
fn what_is_no_section_is_refused() {
    use CoordinateError as E;
    let points = naca();
    assert!(matches!(parse("t\n0.5 0.5\n"), Err(E::TooFewPoints { found: 1, needed: 4 })));
    assert!(matches!(parse("t\n1 0\n0 0\n1 0\n"), Err(E::TooFewPoints { .. })));
    assert!(matches!(parse(&"0.5 0.5\n".repeat(50)), Err(E::TooFewPoints { found: 1, .. })));
    assert!(matches!(parse("1 0\n0.5 0\n0.2 0\n0 0\n0.5 0\n1 0\n"), Err(E::NoArea { .. })));
    // a figure of eight
    let eight = points.iter().map(|p| [p[0], p[1] * (p[0] - 0.4)]);
    assert!(matches!(parse(&file(eight)), Err(E::SelfCrossing { .. })));
    // cut off
    assert!(matches!(parse(&file(points[..80].to_vec())), Err(E::Unfinished { line: 80, .. })));
    // thrown together
    let shuffled = (0..99).map(|i| points[(i * 37) % 99]);
    assert!(parse(&file(shuffled)).is_err());
    let tiny = points.iter().map(|p| p.map(|c| c * 1e-12));
    assert!(matches!(parse(&file(tiny)), Err(E::NoArea { .. })));
    assert!(matches!(Coordinates::from_points("", &[[0.0, f64::NAN]]), Err(E::Value { line: 1, .. })));
    assert!(Coordinates::from_points("", &points).is_ok());
}

#[test]
fn any_unit_and_place_will_do() {
    let points = naca();
    let moved: Vec<[f64; 2]> = points.iter().map(|p| [300.0 * p[0] - 40.0, 300.0 * p[1] + 7.0]).collect();
    let read = parse(&file(moved.clone())).unwrap();
    assert_eq!((read.points(), read.repairs()), (&moved[..], &[][..]));
    assert!((read.chord() - 300.0).abs() < 0.1);
    let section = read.normalized().unwrap().section().unwrap();
    let frame = section.chord_frame().unwrap();
    assert!(frame.origin.iter().all(|c| c.abs() < 1e-12) && (frame.chord - 1.0).abs() < 1e-12);
    assert!(section.trailing_edge_middle()[1].abs() < 1e-12);
    assert!((section.area() - read.section().unwrap().area() / 9e4).abs() < 1e-4);
}

#[test]
fn fits_smooth_rounded_points() {
    let rounded: Vec<_> = naca().into_iter().map(|p| p.map(|c| (c * 1e3).round() / 1e3)).collect();
    let read = Coordinates::from_points("rounded", &rounded).unwrap();
    let rough = read.section().unwrap();
    let smooth = read.clone().with_fit_tolerance(7e-4).unwrap().section().unwrap();
    assert!(smooth.curve().control_points().len() < rough.curve().control_points().len());
    let bends = |s: &Section| s.curvature_reversals(0.05).iter().sum::<usize>();
    assert!(bends(&smooth) < bends(&rough), "{} {}", bends(&smooth), bends(&rough));
    for p in read.points() {
        assert!(smooth.curve().closest_point(*p).unwrap().distance() < 7.1e-4);
    }
    let few = SectionDefinition::Coordinates(read.clone()).with_control_points(31).unwrap().section().unwrap();
    assert_eq!(few.curve().control_points().len(), 31);
    for n in [3, 100] {
        let error = read.clone().with_control_points(n).unwrap_err();
        assert_eq!(error, SectionError::FitControlPoints { found: n, least: 7, most: read.points().len() });
    }
    assert!(read.with_fit_tolerance(-1.0).is_err());
}

fn turned(points: &[[f64; 2]], degrees: f64) -> Vec<[f64; 2]> {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    points.iter().map(|[x, y]| [x * cosine - y * sine, x * sine + y * cosine]).collect()
}

#[test]
fn turned_sections_keep_their_frame() {
    let points = naca();
    let area = parse(&file(points.clone())).unwrap().section().unwrap().area();
    for degrees in [5.0, -5.0, 30.0, -60.0, 90.0, -90.0, 110.0] {
        let there = turned(&points, degrees);
        let read = parse(&file(there.clone())).unwrap();
        assert_eq!(read.points(), there, "{degrees}");
        // the angle of the chord is that of the section, which is level but for the round of its nose
        match read.repairs() {
            [] => assert!(degrees.abs() <= 60.0),
            [Repair::Upright { turn }] => assert!((turn.to_degrees() - degrees).abs() < 1.0, "{degrees} {turn}"),
            other => panic!("{degrees}: {other:?}"),
        }
        assert!((read.section().unwrap().area() / area - 1.0).abs() < 1e-9);
        // the lower surface first, or surfaces with a header
        let back: Vec<_> = there.iter().rev().copied().collect();
        let read = parse(&file(back)).unwrap();
        let upright = usize::from(read.repairs().iter().any(|r| matches!(r, Repair::Upright { .. })));
        assert_eq!((read.points().len(), read.repairs().len()), (99, 1 + upright), "{degrees}");
        let upper: Vec<_> = there[..50].iter().rev().copied().collect();
        if degrees.abs() < 100.0 {
            let lednicer = format!("t\n50. 50.\n\n{}\n{}", file(upper), file(there[49..].to_vec()));
            assert_eq!(parse(&lednicer).unwrap().points(), there, "{degrees}");
        }
    }
}

#[test]
fn noses_to_the_right_and_upright_sections_are_recognised() {
    let points = naca();
    for coarse in [1, 7] {
        let points: Vec<_> = points.iter().step_by(coarse).copied().collect();
        let mirrored: Vec<_> = points.iter().map(|[x, y]| [-x, *y]).collect();
        let read = parse(&file(mirrored.clone())).unwrap();
        assert_eq!(read.points(), points);
        assert!(read.repairs().starts_with(&[Repair::Mirrored]));
        let read = parse(&file(mirrored.iter().rev().copied())).unwrap();
        assert_eq!(read.points(), points);
        assert!(read.repairs().starts_with(&[Repair::Mirrored, Repair::Reversed]));
        let read = parse(&file(points.iter().map(|[x, y]| [*y, *x]))).unwrap();
        assert_eq!(read.points(), points);
        assert!(read.repairs().starts_with(&[Repair::AxesExchanged]));
    }
    // the derivatives are mirrored with the points
    use num_dual::Dual64;
    let duals: Vec<_> = points.iter().map(|[x, y]| [Dual64::new(-x, 2.0), Dual64::new(*y, 3.0)]).collect();
    let read = Coordinates::from_points("", &duals).unwrap();
    assert!(read.points().iter().all(|[x, y]| x.eps == -2.0 && y.eps == 3.0));
}

#[test]
fn strays_and_spikes_are_dropped_or_told() {
    let points = naca();
    let read = |points: &[[f64; 2]]| parse(&file(points.to_vec())).unwrap();
    let reference = [0.25, 0.0];
    let first: Vec<_> = [reference].into_iter().chain(points.clone()).collect();
    let last: Vec<_> = points.iter().copied().chain([reference]).collect();
    for (text, line) in [(first, 1), (last, 100)] {
        let read = read(&text);
        assert_eq!((read.points(), read.repairs()), (&points[..], &[Repair::StrayDropped { count: 1, line }][..]));
    }
    let mut slip = points.clone();
    slip[70][0] *= 1e4;
    let without: Vec<_> = (0..99).filter(|&i| i != 70).map(|i| points[i]).collect();
    assert_eq!(read(&slip).points(), without);
    for (index, height) in [(30, 0.02), (30, 0.005), (70, -0.005), (3, 0.01), (95, 0.02), (46, 0.02)] {
        let mut spike = points.clone();
        spike[index][1] += height;
        let read = read(&spike);
        let line = index + 1;
        let dropped = |r: &Repair| matches!(r, Repair::SpikeDropped { count: 1, line: l, .. } if *l == line);
        assert!(read.repairs().len() == 1 && dropped(&read.repairs()[0]), "{index} {height} {:?}", read.repairs());
        assert_eq!(read.points().len(), 98);
    }
    let mut small = points.clone();
    small[30][1] += 0.0015;
    let read = read(&small);
    assert!(matches!(read.repairs(), [Repair::SpikeSuspected { count: 1, line: 31, .. }]), "{:?}", read.repairs());
    assert_eq!(read.points().len(), 99);
}

#[test]
fn exchanged_points_and_repeated_blocks_are_put_right() {
    let points = naca();
    for i in [5, 46, 49, 52, 80] {
        let mut text = points.clone();
        text.swap(i, i + 1);
        let read = parse(&file(text)).unwrap();
        assert_eq!(read.points(), points, "{i}");
        assert!(matches!(read.repairs(), [Repair::Sorted { count: 2, .. }]), "{:?}", read.repairs());
    }
    let twice: Vec<_> = points[..60].iter().chain(&points[40..]).copied().collect();
    let read = parse(&file(twice)).unwrap();
    assert_eq!((read.points(), read.repairs()), (&points[..], &[Repair::DuplicateDropped { count: 20, line: 61 }][..]));
}

#[test]
fn missing_surfaces_and_noses_are_noticed() {
    use CoordinateError as E;
    let points = naca();
    for surface in [&points[..50], &points[49..]] {
        assert!(matches!(parse(&file(surface.to_vec())), Err(E::OneSurface { first: 1, last: 50 })));
    }
    let behind = |x: f64| points.iter().copied().filter(move |p| p[0] > x);
    for x in [0.1, 0.03] {
        let read = parse(&file(behind(x))).unwrap();
        let told = |r: &Repair| matches!(r, Repair::KeptStraight { .. } | Repair::GapSuspected { .. });
        assert!(read.repairs().iter().any(told), "{x} {:?}", read.repairs());
    }
}

/// Area of the closed polygon.
fn polygon(points: &[[f64; 2]]) -> f64 {
    let next = points.iter().skip(1).chain(&points[..1]);
    points.iter().zip(next).map(|(a, b)| 0.5 * (a[0] * b[1] - a[1] * b[0])).sum()
}

#[test]
fn the_curve_stays_with_straight_sides_and_corners() {
    let points = naca();
    let with = |rest: &[[f64; 2]]| [&points[..50], rest].concat();
    let shapes: [(&str, Vec<[f64; 2]>); 8] = [
        ("flat bottom by its ends", with(&[[1.0, -0.001]])),
        ("flat bottom behind a round nose", with(&[points[52], points[55], [1.0, -0.001]])),
        ("few points below", with(&[[0.3, -0.03], [0.7, -0.01], [1.0, -0.001]])),
        ("plate", vec![[1.0, 0.015], [0.0, 0.015], [0.0, -0.015], [1.0, -0.015]]),
        ("diamond", vec![[1.0, 0.0], [0.5, 0.05], [0.0, 0.0], [0.5, -0.05], [1.0, 0.0]]),
        (
            "double wedge",
            vec![[1.0, 0.0], [0.7, 0.04], [0.3, 0.04], [0.0, 0.0], [0.3, -0.04], [0.7, -0.04], [1.0, 0.0]],
        ),
        ("wedge", vec![[1.0, 0.05], [0.5, 0.025], [0.0, 0.0], [0.5, -0.025], [1.0, -0.05]]),
        ("four sides of an arc", vec![[1.0, 0.0], [0.75, 0.09], [0.5, 0.12], [0.25, 0.09], [0.0, 0.0], [1.0, 0.0]]),
    ];
    for (name, points) in shapes {
        let read = Coordinates::from_points(name, &points).unwrap();
        let section = read.section().unwrap();
        assert!((section.area() / polygon(&points) - 1.0).abs() < 0.01, "{name} {}", section.area());
        assert!(read.repairs().iter().any(|r| matches!(r, Repair::KeptStraight { .. })), "{name} {:?}", read.repairs());
        assert!(read.deviation().unwrap().polygon < 0.02, "{name}");
        for p in &points {
            assert!(section.curve().closest_point(*p).unwrap().distance() < 1e-9, "{name}");
        }
        // a curve is linear in its points: twice the points make twice the curve
        let twice: Vec<_> = points.iter().map(|p| p.map(|c| 2.0 * c)).collect();
        let twice = Coordinates::from_points(name, &twice).unwrap().section().unwrap();
        assert!((twice.area() / section.area() - 4.0).abs() < 1e-9, "{name}");
    }
}

#[test]
fn smooth_points_are_interpolated_as_ever() {
    use crate::spline::{EndCondition, chord_length_parameters, interpolate};
    let points = naca();
    let read = Coordinates::from_points("", &points).unwrap();
    let parameters: Vec<f64> = chord_length_parameters(&points).unwrap();
    let plain = interpolate(&parameters, &points, EndCondition::Natural).unwrap();
    let curve = read.section().unwrap().curve().clone();
    assert_eq!(curve.knots(), plain.knots());
    assert_eq!(curve.control_points()[1..100], plain.control_points()[1..100]);
    let Deviation { points, polygon, .. } = read.deviation().unwrap();
    assert!(points < 1e-14 && polygon > 1e-5 && polygon < 1e-3, "{points} {polygon}");
}

#[test]
fn coarsely_rounded_points_are_smoothed() {
    let definition = SectionDefinition::parse("naca4412").unwrap().with_control_points(2003).unwrap();
    let dense = definition.section().unwrap();
    let radius = dense.nose_radius().unwrap();
    for (digits, most) in [(3, 0.5), (4, 0.1), (5, 0.05)] {
        let text: String = dense.points(2001).iter().map(|[x, y]| format!("{x:.digits$} {y:.digits$}\n")).collect();
        let read = parse(&text).unwrap();
        let section = read.section().unwrap();
        let found = section.nose_radius().unwrap();
        assert!((found / radius - 1.0).abs() < most, "{digits} digits: nose radius {found} for {radius}");
        assert!((section.area() / dense.area() - 1.0).abs() < 1e-3);
        let step = 10f64.powi(-(digits as i32));
        let told = |r: &Repair| matches!(r, Repair::Smoothed { step: s, distance, .. } if (s / step - 1.0).abs() < 1e-9 && *distance < 1.6 * step);
        assert!(read.repairs().iter().any(told), "{:?}", read.repairs());
        assert!(section.curve().control_points().len() < 600);
    }
    // points in memory have no last digit
    let rounded: Vec<_> = dense.points(2001).iter().map(|p| p.map(|c| (c * 1e5).round() / 1e5)).collect();
    let read = Coordinates::from_points("", &rounded).unwrap();
    assert!(!read.repairs().iter().any(|r| matches!(r, Repair::Smoothed { .. })));
}

#[test]
fn fits_and_the_chord_frame_are_told() {
    let points = turned(&naca(), 5.0).iter().map(|p| p.map(|c| 300.0 * c)).collect::<Vec<_>>();
    let read = parse(&file(points)).unwrap().with_control_points(41).unwrap();
    let [Repair::Fitted { control_points: 41, distance, .. }] = read.repairs()[..] else {
        panic!("{:?}", read.repairs())
    };
    assert_eq!(distance, read.deviation().unwrap().points);
    assert!(distance > 0.0 && distance < 1.0);
    let normalized = read.normalized().unwrap();
    let [Repair::Normalized { shift, turn, scale }, Repair::Fitted { .. }] = normalized.repairs()[..] else {
        panic!("{:?}", normalized.repairs())
    };
    assert!((turn.to_degrees() + 5.0).abs() < 0.5 && (scale * 300.0 - 1.0).abs() < 1e-2);
    let moved: Vec<_> = read.points().iter().map(|p| [p[0] + shift[0], p[1] + shift[1]]).collect();
    for (p, q) in turned(&moved, turn.to_degrees()).iter().zip(normalized.points()) {
        assert!((p[0] * scale - q[0]).abs() < 1e-12 && (p[1] * scale - q[1]).abs() < 1e-12);
    }
    let frame = normalized.section().unwrap().chord_frame().unwrap();
    assert!((frame.chord - 1.0).abs() < 1e-9 && frame.axis[1].abs() < 1e-9);
}
