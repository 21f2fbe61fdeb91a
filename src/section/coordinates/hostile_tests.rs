//! Files that are easily misunderstood: each is read as it was meant, or refused.

use super::tests::{file, naca, parse};
use super::*;
use crate::section::SectionDefinition;

#[test]
fn lists_that_begin_behind_mid_chord_are_rotated() {
    let points = naca();
    for start in [3, 8, 12, 20, 80, 95] {
        let open: Vec<_> = points[start..].iter().chain(&points[..start]).copied().collect();
        let closed: Vec<_> = open.iter().chain(&open[..1]).copied().collect();
        for text in [open, closed] {
            let read = parse(&file(text)).unwrap();
            assert_eq!(read.points(), points, "{start}");
            assert!(matches!(read.repairs(), [Repair::Rotated { .. }]), "{start} {:?}", read.repairs());
        }
    }
}

#[test]
fn points_of_reference_near_the_trailing_edge_are_strays() {
    let points = naca();
    for stray in [[0.95, 0.0], [0.98, 0.0], [1.02, 0.0], [1.05, -0.001]] {
        let first: Vec<_> = [stray].into_iter().chain(points.clone()).collect();
        let last: Vec<_> = points.iter().copied().chain([stray]).collect();
        for (text, line) in [(first, 1), (last, 100)] {
            let read = parse(&file(text)).unwrap();
            assert_eq!(read.points(), points, "{stray:?}");
            assert_eq!(read.repairs(), [Repair::StrayDropped { count: 1, line }], "{stray:?}");
        }
    }
    // a surface that ends many sides short of the other has lost points
    let short = parse(&file(points[..93].to_vec())).unwrap_err();
    assert!(matches!(short, CoordinateError::Unfinished { line: 93, .. }), "{short}");
}

#[test]
fn two_digits_are_smoothed() {
    let dense = SectionDefinition::parse("naca4412").unwrap().section().unwrap();
    for count in [41, 121, 201] {
        let text: String = dense.points(count).iter().map(|[x, y]| format!("{x:.2} {y:.2}\n")).collect();
        let read = parse(&text).unwrap();
        let section = read.section().unwrap();
        assert!(read.repairs().iter().any(|r| matches!(r, Repair::Smoothed { .. })), "{:?}", read.repairs());
        assert!((section.area() / dense.area() - 1.0).abs() < 0.02, "{count}: {}", section.area());
    }
}

#[test]
fn few_points_on_a_smooth_section_are_interpolated() {
    let dense = SectionDefinition::parse("naca4412").unwrap().section().unwrap();
    let points = dense.points(11);
    let read = Coordinates::from_points("", &points).unwrap();
    let section = read.section().unwrap();
    assert!((section.area() / dense.area() - 1.0).abs() < 0.02, "{} {}", section.area(), dense.area());
    let nose = section.nose_radius().unwrap() / dense.nose_radius().unwrap();
    assert!(nose > 0.4, "{nose}");
    let excess = read.repairs().iter().find_map(|r| match r {
        Repair::FewPoints { excess } => Some(*excess),
        _ => None,
    });
    assert!(excess.is_some_and(|excess| excess > 0.05 && excess < 0.1), "{:?}", read.repairs());
}

#[test]
fn corners_between_straight_runs_stay_corners() {
    for count in [10, 20, 100] {
        let along = |i: usize| i as f64 / count as f64;
        let upper = (0..=count).rev().map(|i| [along(i), 0.015]);
        let plate: Vec<_> = upper.chain((0..=count).map(|i| [along(i), -0.015])).collect();
        let section = Coordinates::from_points("plate", &plate).unwrap().section().unwrap();
        assert!((section.area() / 0.03 - 1.0).abs() < 1e-6, "{count}: area {}", section.area());
        let [_, thickness] = section.maximum_thickness().unwrap();
        assert!((thickness / 0.03 - 1.0).abs() < 1e-3, "{count}: thickness {thickness}");
    }
    // a staircase of rounding has corners too, but no straight runs
    let dense = SectionDefinition::parse("naca4412").unwrap().with_control_points(2003).unwrap().section().unwrap();
    let text: String = dense.points(2001).iter().map(|[x, y]| format!("{x:.3} {y:.3}\n")).collect();
    let read = parse(&text).unwrap();
    assert!(!read.repairs().iter().any(|r| matches!(r, Repair::KeptStraight { .. })), "{:?}", read.repairs());
}

#[test]
fn headers_that_do_not_count_are_refused_in_any_unit() {
    let points = naca();
    let table = |[x, y]: [f64; 2], chord: f64| format!("{:.3} {:.3}\n", chord * x, chord * y);
    for chord in [1.0, 100.0, 1000.0] {
        let upper: String = points[..50].iter().rev().map(|&p| table(p, chord)).collect();
        let lower: String = points[49..].iter().map(|&p| table(p, chord)).collect();
        let right = parse(&format!("t\n50 50\n\n{upper}\n{lower}")).unwrap();
        assert_eq!(right.points().len(), 99);
        let wrong = parse(&format!("t\n50 54\n\n{upper}\n{lower}"));
        assert_eq!(wrong, Err(CoordinateError::Count { line: 2, announced: 104, found: 100 }), "{chord}");
    }
    // a first point in whole numbers beside the last one is a point
    let selig = file([[100.0, 2.0], [50.5, 10.2], [0.1, 0.0], [50.5, -10.2], [100.1, -2.1]]);
    assert_eq!(parse(&selig).unwrap().points().len(), 5);
}

#[test]
fn wide_bases_with_the_nose_to_the_right_are_mirrored() {
    let wide: Vec<_> =
        naca().iter().enumerate().map(|(i, [x, y])| [*x, y + x * if i < 50 { 0.05 } else { -0.05 }]).collect();
    let mirrored = wide.iter().map(|[x, y]| [1.0 - x, *y]);
    let read = parse(&file(mirrored)).unwrap();
    assert_eq!(read.repairs(), [Repair::Mirrored]);
    let area = Coordinates::from_points("", &wide).unwrap().section().unwrap().area();
    assert!((read.section().unwrap().area() / area - 1.0).abs() < 1e-9);
}

#[test]
fn sections_turned_by_half_a_turn_keep_their_camber() {
    let points = naca();
    for shift in [0.0, 1.0] {
        let turned: Vec<_> = points.iter().map(|[x, y]| [shift - x, -y]).collect();
        let read = parse(&file(turned.clone())).unwrap();
        assert_eq!(read.repairs(), [Repair::TurnedBack]);
        let camber = read.section().unwrap().camber().unwrap();
        assert!((camber - 0.04).abs() < 0.003, "{camber}");
        // listed the other way round it is a mirrored section that was cambered downwards
        let read = parse(&file(turned.into_iter().rev())).unwrap();
        assert_eq!(read.repairs(), [Repair::Mirrored]);
    }
    // two surfaces of a section with its nose to the right, without a header
    let mirrored: Vec<_> = points.iter().map(|[x, y]| [-x, *y]).collect();
    let upper: Vec<_> = mirrored[..50].iter().rev().copied().collect();
    let read = parse(&format!("t\n{}\n{}", file(upper), file(mirrored[49..].to_vec()))).unwrap();
    assert_eq!(read.points(), points, "{:?}", read.repairs());
}

#[test]
fn blocks_of_camber_and_chord_are_passed_over() {
    let points = naca();
    let rows = |points: &[[f64; 2]]| points.iter().map(|[x, y]| format!("{x},{y}\n")).collect::<String>();
    let mean: Vec<_> = (0..=10).map(|i| [0.1 * f64::from(i), 0.04]).collect();
    let text = format!(
        "Name,NACA 4412\nChord(mm),1\n\nAirfoil surface,\nX(mm),Y(mm)\n{}\nCamber line,\nX(mm),Y(mm)\n{}\nChord line,\n\
         X(mm),Y(mm)\n0,0\n1,0\n",
        rows(&points),
        rows(&mean)
    );
    let read = parse(&text).unwrap();
    assert_eq!((read.points(), read.name()), (&points[..], "NACA 4412"));
    assert_eq!(read.repairs(), [Repair::MeanLineIgnored { count: 13, line: 108 }]);
    // the outline may come last
    let text = format!("Camber line,\n{}\nAirfoil surface,\n{}", rows(&mean), rows(&points));
    assert_eq!(parse(&text).unwrap().points(), points);
}

#[test]
fn exponents_tell_the_digits_of_the_points() {
    let mut points = naca();
    points[49] = [0.0, 0.0];
    let text: String = points.iter().map(|[x, y]| format!("{:.3e} {:.3e}\n", 0.05 * x, 0.05 * y)).collect();
    let text = text.replace("e-", "e-0").replace("e0", "e+00");
    assert!(text.contains("0.000e+00"));
    let read = parse(&text).unwrap();
    assert!(read.repairs().is_empty(), "{:?}", read.repairs());
    let whole = Coordinates::from_points("", &points).unwrap().section().unwrap();
    let section = read.section().unwrap();
    let radius = section.nose_radius().unwrap() / (0.05 * whole.nose_radius().unwrap());
    assert!((radius - 1.0).abs() < 0.01, "{radius}");
}

#[test]
fn points_in_memory_are_counted_from_one() {
    let mut points = naca();
    points[30][1] = f64::NAN;
    let error = Coordinates::from_points("", &points).unwrap_err();
    assert!(matches!(error, CoordinateError::Value { line: 31, .. }), "{error}");
    let cut = Coordinates::from_points("", &naca()[..80]).unwrap_err();
    let CoordinateError::Unfinished { line: 80, distance } = cut else { panic!("{cut}") };
    let message = cut.to_string();
    assert!(message.contains(&format!("ends {distance:.3} short")), "{message}");
    let small = CoordinateError::Unfinished { line: 1, distance: 1.2345e-5 };
    assert_eq!(small.to_string(), "line 1: the outline ends 1.23e-5 short of the trailing edge; points are missing");
}
