//! Reading, mending and building sections from points.

use super::*;
use crate::section::SectionDefinition;

fn naca() -> Vec<[f64; 2]> {
    SectionDefinition::parse("naca4412").unwrap().section().unwrap().points(99)
}

fn file(points: impl IntoIterator<Item = [f64; 2]>) -> String {
    points.into_iter().map(|[x, y]| format!("{x} {y}\n")).collect()
}

fn parse(text: &str) -> Result<Coordinates, CoordinateError> {
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
    assert!(matches!(Coordinates::from_points("", &[[0.0, f64::NAN]]), Err(E::Value { line: 0, .. })));
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
