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

/// Sections of several families, cosine-spaced or as the knots lie, in so many points.
fn healthy(count: usize) -> impl Iterator<Item = Vec<[f64; 2]>> {
    ["naca4412", "naca0012", "naca23012", "naca6309", "kulfan:upper=0.1,0.3/lower=-0.2,0.1"]
        .into_iter()
        .map(move |name| SectionDefinition::parse(name).unwrap().section().unwrap().points(count))
}

/// Whether a file is refused, or something is said of points that are off the others.
fn noticed(points: &[[f64; 2]]) -> bool {
    let Ok(read) = Coordinates::from_points("", points) else { return true };
    let told = |repair: &Repair| {
        matches!(
            repair,
            Repair::SpikeDropped { .. }
                | Repair::SpikeSuspected { .. }
                | Repair::StepSuspected { .. }
                | Repair::StrayDropped { .. }
                // an end that is moved far across stands on an upright side, as a base does
                | Repair::BasePointDropped { .. }
                | Repair::Sorted { .. }
        )
    };
    read.section().is_err() || read.repairs().iter().any(told)
}

#[test]
fn spikes_on_sparse_outlines_are_noticed() {
    let (mut missed, mut all) = (0, 0);
    for points in [25, 33, 41, 51].into_iter().flat_map(healthy) {
        assert!(!noticed(&points), "{} points", points.len());
        for index in 1..points.len() - 1 {
            for shift in [-0.02, 0.02] {
                let mut spoilt = points.clone();
                spoilt[index][1] += shift;
                missed += usize::from(!noticed(&spoilt));
                all += 1;
            }
        }
    }
    // a nose point that is moved across gives another nose, no spike
    assert!(50 * missed <= all, "{missed} of {all}");
}

#[test]
fn ends_off_the_others_are_noticed() {
    for points in [33, 51, 99, 161].into_iter().flat_map(healthy) {
        assert!(!noticed(&points), "{} points", points.len());
        for index in [0, points.len() - 1] {
            for shift in [-0.02, 0.02] {
                let mut spoilt = points.clone();
                spoilt[index][1] += shift;
                assert!(noticed(&spoilt), "{} points, {index}, {shift}", points.len());
            }
        }
    }
}

#[test]
fn runs_of_shifted_points_are_noticed() {
    let (mut missed, mut all) = (0, 0);
    for points in [51, 99, 161].into_iter().flat_map(healthy) {
        for size in [4, 7, 12] {
            for first in (1..points.len() - size - 1).step_by(3) {
                for shift in [-0.02, 0.02] {
                    let mut spoilt = points.clone();
                    spoilt[first..first + size].iter_mut().for_each(|p| p[1] += shift);
                    missed += usize::from(!noticed(&spoilt));
                    all += 1;
                }
            }
        }
    }
    assert!(20 * missed <= all, "{missed} of {all}");
    // the place is told
    let mut spoilt = naca();
    spoilt[10..16].iter_mut().for_each(|p| p[1] += 0.02);
    let read = Coordinates::from_points("", &spoilt).unwrap();
    let step = read.repairs().iter().find_map(|r| match r {
        Repair::StepSuspected { count, line, distance } => Some((*count, *line, *distance)),
        _ => None,
    });
    let Some((2, 11, distance)) = step else { panic!("{:?}", read.repairs()) };
    assert!((distance - 0.02).abs() < 0.005, "{distance}");
}

#[test]
fn tables_of_both_sides_are_read_as_sections() {
    let points = naca();
    let dense = SectionDefinition::parse("naca4412").unwrap().section().unwrap();
    let row = |x: f64| {
        // ordinates of both sides at equal x
        let side = |points: &[[f64; 2]]| {
            let k = (1..points.len()).find(|&k| (points[k - 1][0] - x) * (points[k][0] - x) <= 0.0).unwrap();
            let ([a, ya], [b, yb]) = (points[k - 1], points[k]);
            ya + (yb - ya) * (x - a) / (b - a)
        };
        let fine = dense.points(2001);
        let nose = (0..fine.len()).min_by(|&i, &j| fine[i][0].total_cmp(&fine[j][0])).unwrap();
        [x, side(&fine[..=nose]), side(&fine[nose..])]
    };
    let table: Vec<[f64; 3]> = (0..=40)
        .map(|k| row(1e-3 + 0.998 * 0.5 * (1.0 - (f64::from(k) * std::f64::consts::PI / 40.0).cos())))
        .collect();
    let text = |of: &dyn Fn(&[f64; 3]) -> String| table.iter().map(of).collect::<String>();
    for text in [
        format!("wing\nx upper lower\n{}", text(&|[x, u, l]| format!("{x:.6} {u:.6} {l:.6}\n"))),
        format!("wing\n41\n{}", text(&|[x, u, l]| format!("{x:.6} {l:.6} {u:.6}\n"))),
        format!("wing\n{}", table.iter().rev().map(|[x, u, l]| format!("{x:.6};{u:.6};{l:.6}\n")).collect::<String>()),
    ] {
        let read = parse(&text).unwrap();
        assert_eq!((read.name(), read.points().len()), ("wing", 82), "{:?}", read.repairs());
        assert!(read.repairs().iter().any(|r| matches!(r, Repair::SidesInColumns { .. })), "{:?}", read.repairs());
        let section = read.section().unwrap();
        assert!((section.area() / dense.area() - 1.0).abs() < 5e-3, "{}", section.area());
        assert!(section.camber().unwrap() > 0.035);
    }
    // three numbers that are no such table
    let spatial: String = points.iter().map(|[x, y]| format!("{x} {y} {}\n", 0.1 * x)).collect();
    let error = parse(&spatial).unwrap_err();
    assert!(error.to_string().contains("upper and the lower side"), "{error}");
}

#[test]
fn headers_that_divide_the_points_wrongly_are_refused() {
    let points = naca();
    let text = |upper: usize, lower: usize| {
        let first: Vec<_> = points[..50].iter().rev().copied().collect();
        format!("t\n{upper} {lower}\n\n{}\n{}", file(first), file(points[49..].to_vec()))
    };
    assert_eq!(parse(&text(50, 50)).unwrap().points(), points);
    for wrong in [20, 49, 51, 90] {
        let error = parse(&text(wrong, 100 - wrong)).unwrap_err();
        let split = CoordinateError::Split { line: 55, announced: [wrong, 100 - wrong], found: [50, 50] };
        assert_eq!(error, split);
        assert!(error.to_string().contains(&format!("announces {wrong} and {}", 100 - wrong)), "{error}");
    }
}
