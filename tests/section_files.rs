//! Coordinate files as a user meets them: printed tables, damaged files, and anything at all.

use aeroform::section::{Coordinates, Measure, Repair, Section, SectionDefinition, TrailingEdge};
use proptest::prelude::*;

fn reference(name: &str) -> String {
    format!("{}/validation/reference/sections/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// The printed ordinates against the section built from the equations, to the accuracy of the tables.
#[test]
fn printed_tables_agree_with_the_equations() {
    for (file, shape) in [("naca2412.dat", "naca2412"), ("naca23012.dat", "naca23012")] {
        let printed = match SectionDefinition::parse(&reference(file)).unwrap() {
            SectionDefinition::Coordinates(coordinates) => coordinates,
            other => panic!("{other:?}"),
        };
        assert_eq!(printed.repairs(), [], "{file}");
        assert_eq!((printed.points().len(), printed.trailing_edge()), (35, TrailingEdge::Blunt));
        assert!((printed.chord() - 100.0).abs() < 1e-3);
        let built = SectionDefinition::parse(shape).unwrap().section().unwrap();
        assert_eq!(printed.name(), built.name());
        for (i, [x, y]) in printed.points().iter().map(|p| p.map(|c| c / 100.0)).enumerate() {
            if x > 0.0 && x < 1.0 {
                let side = if i < 17 { 0.5 } else { -0.5 };
                let exact = built.camber_at(x).unwrap() + side * built.thickness_at(x).unwrap();
                assert!((y - exact).abs() < 3.1e-4, "{shape} at {x}: {y} printed, {exact} built");
            }
        }
        // 35 points make a sound section
        let section = printed.normalized().unwrap().section().unwrap();
        assert!((section.area() / built.area() - 1.0).abs() < 5e-3);
        assert!((section.nose_radius().unwrap() / built.nose_radius().unwrap() - 1.0).abs() < 0.2);
    }
}

#[test]
fn a_file_is_called_by_its_name_if_it_has_no_title() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.dat");
    std::fs::write(&path, "1 0\n0.5 0.1\n0 0\n0.5 -0.1\n1 0\n").unwrap();
    assert_eq!(Coordinates::read(&path).unwrap().name(), "mine");
    std::fs::write(&path, "1 0\n0.5 0.1 0.3\n").unwrap();
    let message = Coordinates::read(&path).unwrap_err().to_string();
    assert!(message.contains("mine.dat") && message.contains("line 2"), "{message}");
    let message = Coordinates::read(folder.path().join("absent.dat")).unwrap_err().to_string();
    assert!(message.contains("absent.dat") && message.contains("not found"), "{message}");
}

/// Whatever loads must be a sound section: finite, closed where it says so, free of crossings, readable again.
fn check(coordinates: &Coordinates) {
    let Ok(section) = coordinates.section() else { return };
    assert!(section.curve().control_points().iter().flatten().all(|c| c.is_finite()));
    let [a, b] = section.trailing_edge_points().map(|p| p.map(f64::to_bits));
    assert!(a == b || section.trailing_edge() == TrailingEdge::Blunt);
    assert_eq!(section.self_intersection(), None);
    assert!(section.area() > 0.0);
    for name in Measure::NAMES {
        if let Ok(value) = Measure::parse(name).unwrap().evaluate(&section) {
            assert!(value.is_finite(), "{name} {value}");
        }
    }
    reread(&section, coordinates);
}

fn reread(section: &Section, coordinates: &Coordinates) {
    let text: String = coordinates.points().iter().map(|[x, y]| format!("{x} {y}\n")).collect();
    let again = Coordinates::parse(format!("again\n{text}").as_bytes()).unwrap();
    assert_eq!(again.points(), coordinates.points(), "{:?}", again.repairs());
    // zeros that are not written may make digits coarser than the points are spaced
    let smoothed = |c: &Coordinates| c.repairs().iter().any(|r| matches!(r, Repair::Smoothed { .. }));
    if !smoothed(&again) && !smoothed(coordinates) {
        assert_eq!(again.section().unwrap().curve(), section.curve());
    }
}

/// One thing that happens to files.
#[derive(Debug, Clone)]
enum Damage {
    Cut(usize),
    Remove(usize),
    Insert(usize, u8),
    Replace(usize, u8),
    DropLine(usize),
    DoubleLine(usize),
    SwapLines(usize, usize),
    Splice(usize, &'static str),
}

fn damage() -> impl Strategy<Value = Damage> {
    let words =
        ["nan", "inf", "1e308", "-", ",", "#", "title", "0 0", "1e-320 5", "\n", "\0", "0x1p3", "1 1 1", "99 99"];
    prop_oneof![
        any::<usize>().prop_map(Damage::Cut),
        any::<usize>().prop_map(Damage::Remove),
        (any::<usize>(), any::<u8>()).prop_map(|(i, b)| Damage::Insert(i, b)),
        (any::<usize>(), any::<u8>()).prop_map(|(i, b)| Damage::Replace(i, b)),
        any::<usize>().prop_map(Damage::DropLine),
        any::<usize>().prop_map(Damage::DoubleLine),
        (any::<usize>(), any::<usize>()).prop_map(|(i, j)| Damage::SwapLines(i, j)),
        (any::<usize>(), proptest::sample::select(words.to_vec())).prop_map(|(i, w)| Damage::Splice(i, w)),
    ]
}

fn apply(bytes: &mut Vec<u8>, damage: &Damage) {
    let n = bytes.len().max(1);
    let mut lines: Vec<Vec<u8>> = bytes.split(|b| *b == b'\n').map(<[u8]>::to_vec).collect();
    let count = lines.len();
    match *damage {
        Damage::Cut(i) => return bytes.truncate(i % n),
        Damage::Insert(i, b) => return bytes.insert(i % n.min(bytes.len() + 1), b),
        Damage::Splice(i, word) => {
            let at = i % n.min(bytes.len() + 1);
            bytes.splice(at..at, word.bytes());
            return;
        }
        Damage::Remove(i) if !bytes.is_empty() => {
            bytes.remove(i % n);
            return;
        }
        Damage::Replace(i, b) if !bytes.is_empty() => return bytes[i % n] = b,
        Damage::Remove(_) | Damage::Replace(..) => return,
        Damage::DropLine(i) => {
            lines.remove(i % count);
        }
        Damage::DoubleLine(i) => lines.insert(i % count, lines[i % count].clone()),
        Damage::SwapLines(i, j) => lines.swap(i % count, j % count),
    }
    *bytes = lines.join(&b'\n');
}

fn sources() -> Vec<Vec<u8>> {
    let small = |text: &str| {
        let definition = SectionDefinition::parse(text).unwrap().with_control_points(31).unwrap();
        definition.section().unwrap().selig().into_bytes()
    };
    let mut sources = vec![small("naca2412"), small("naca0012:sharp"), small("kulfan:upper=0.1,0.2/lower=-0.2,0.1")];
    sources.extend(["naca2412.dat", "naca23012.dat"].map(|name| std::fs::read(reference(name)).unwrap()));
    sources
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_give_a_section_or_an_error(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        if let Ok(coordinates) = Coordinates::parse(&bytes) {
            check(&coordinates);
        }
    }

    #[test]
    fn any_numbers_give_a_section_or_an_error(
        text in "(title\n)?([ ]?-?[0-9.]{1,4}[ ,\t;]-?[0-9.]{1,4}([ ][0-9])?\r?\n){0,12}",
    ) {
        if let Ok(coordinates) = Coordinates::parse(text.as_bytes()) {
            check(&coordinates);
        }
    }

    #[test]
    fn any_points_give_a_section_or_an_error(
        points in proptest::collection::vec(
            prop_oneof![
                [0.0f64..1.0, -0.2f64..0.2],
                [any::<f64>(), any::<f64>()],
                Just([1.0, 0.0]),
                Just([0.0, 0.0]),
            ],
            0..12,
        ),
    ) {
        if let Ok(coordinates) = Coordinates::from_points("any", &points) {
            check(&coordinates);
        }
    }

    #[test]
    fn any_round_outline_is_a_section(
        radii in proptest::collection::vec(0.97f64..1.03, 8..40),
        size in 1e-6f64..1e6,
        shift in [-1e3f64..1e3, -1e3f64..1e3],
    ) {
        let n = radii.len();
        let mut points: Vec<[f64; 2]> = radii
            .iter()
            .enumerate()
            .map(|(i, r)| {
                let angle = std::f64::consts::TAU * i as f64 / n as f64;
                [size * (r * angle.cos() + shift[0]), size * (0.2 * r * angle.sin() + shift[1])]
            })
            .collect();
        points.push(points[0]);
        let coordinates = Coordinates::from_points("round", &points).unwrap();
        check(&coordinates);
    }

    #[test]
    fn damaged_files_give_a_section_or_an_error(
        source in 0usize..5,
        damages in proptest::collection::vec(damage(), 1..4),
    ) {
        let mut bytes = sources().swap_remove(source);
        for d in &damages {
            apply(&mut bytes, d);
        }
        if let Ok(coordinates) = Coordinates::parse(&bytes) {
            check(&coordinates);
        }
    }

    #[test]
    fn any_text_is_a_shape_or_an_error(text in "(naca|kulfan:|NACA )?[a-z0-9=,./: -]{0,20}") {
        if let Ok(section) = SectionDefinition::parse(&text).and_then(|definition| definition.section()) {
            assert!(section.curve().control_points().iter().flatten().all(|c| c.is_finite()), "{text}");
        }
    }
}

#[test]
fn repairs_read_well() {
    let coordinates = Coordinates::parse(b"t\n1 0\n0.5 -0.1\n0.5 -0.1\n0 0\n0.5 0.1\n1 0\nthe end\n").unwrap();
    let told: Vec<String> = coordinates.repairs().iter().map(Repair::to_string).collect();
    assert_eq!(
        told,
        [
            "1 line of text passed over, the first in line 8",
            "1 point repeating the one before dropped, the first in line 4",
            "the outline ran over the lower surface first, reversed",
            "the curve is kept straight along 4 sides where a smooth one would leave the polygon, with 1 corner, from line \
             7 on; points may be missing there"
        ]
    );
}

/// A damaged file is refused, or what was done about the damage is told, or the section is what it was.
#[test]
fn damage_never_changes_a_section_in_silence() {
    let originals = ["naca4412", "naca0012:sharp", "kulfan:upper=0.15,0.2,0.2/lower=-0.1,-0.05,0.05"].map(|name| {
        let section = SectionDefinition::parse(name).unwrap().section().unwrap();
        let points = section.points(99);
        let text: String = points.iter().map(|[x, y]| format!("{x:9.5}{y:9.5}\n")).collect();
        (format!("{name}\n{text}").into_bytes(), section.area())
    });
    // a linear congruential generator: the inputs are those of every other run
    let mut state = 1u64;
    let mut below = |n: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % n.max(1)
    };
    let (mut read, mut refused) = (0, 0);
    for _ in 0..3000 {
        let (text, area) = &originals[below(3)];
        let mut bytes = text.clone();
        for _ in 0..1 + below(2) {
            let (i, j) = (below(1 << 20), below(1 << 20));
            let damage = match below(10) {
                0 => Damage::Cut(i),
                1 => Damage::Remove(i),
                2 => Damage::Insert(i, b"0123456789.,-eO \n;:"[j % 19]),
                3 => Damage::Replace(i, b"0123456789.,-eO \n;:"[j % 19]),
                4 => Damage::DropLine(i),
                5 => Damage::DoubleLine(i),
                6 => Damage::SwapLines(i, j),
                7 => Damage::Splice(i, ["0.25 0", "\n0.25 0\n", "nan", "999 999", "\u{2212}", "#"][j % 6]),
                8 => Damage::Replace(i, b'-'),
                _ => Damage::Replace(i, b'.'),
            };
            apply(&mut bytes, &damage);
        }
        let found = Coordinates::parse(&bytes).ok().and_then(|c| Some((c.section().ok()?, c)));
        let Some((section, coordinates)) = found else {
            refused += 1;
            continue;
        };
        read += 1;
        if coordinates.repairs().is_empty() {
            let off = section.area() / area - 1.0;
            assert!(off.abs() < 0.02, "area off by {off}:\n{}", String::from_utf8_lossy(&bytes));
        }
    }
    assert!(read > 600 && refused > 600, "{read} read, {refused} refused");
}
