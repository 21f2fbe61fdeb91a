//! CAD files read back by small readers written from the standards: every number must return bit for bit.

use aeroform::cad;
use aeroform::spline::{BSplineCurve, EndCondition, KnotVector, ellipse, interpolate};
use std::collections::{BTreeMap, HashSet};

/// The contents of a CAD file as a reader finds them.
#[derive(Debug, PartialEq)]
struct Found {
    degree: usize,
    knots: Vec<f64>,
    points: Vec<[f64; 3]>,
    closed: bool,
    closing: Option<[[f64; 3]; 2]>,
}

fn expected<const D: usize>(curve: &BSplineCurve<f64, D>) -> Found {
    let lift = |p: &[f64; D]| std::array::from_fn(|d| p.get(d).copied().unwrap_or(0.0));
    let (first, last) = curve.domain();
    let ends = [lift(&curve.point_at(last)), lift(&curve.point_at(first))];
    let closed = ends[0] == ends[1];
    Found {
        degree: curve.degree(),
        knots: curve.knots().as_slice().to_vec(),
        points: curve.control_points().iter().map(lift).collect(),
        closed,
        closing: (!closed).then_some(ends),
    }
}

fn blunt() -> BSplineCurve<f64> {
    let tail = 1.3e-3;
    let points = [[1.0, tail], [0.6, 0.05], [0.3, 0.06], [0.0, 1e-7 / 3.0], [0.3, -0.06], [0.6, -0.05], [1.0, -tail]];
    interpolate(&[0.0, 0.21, 0.35, 0.5, 0.66, 0.79, 1.0], &points, EndCondition::Natural).unwrap()
}

fn sharp() -> BSplineCurve<f64> {
    let points = vec![[1.0, 0.0], [0.4, 0.1], [-0.1, 0.1 / 3.0], [0.0, -0.05], [0.5, 1e-12], [1.0, 0.0]];
    BSplineCurve::new(KnotVector::clamped(3, 0.0, 1.0, [1.0 / 3.0; 2]).unwrap(), points).unwrap()
}

/// Not clamped, not planar, with numbers at the ends of the range.
fn in_space() -> BSplineCurve<f64, 3> {
    let knots = KnotVector::new(2, vec![-0.5, 0.0, 0.1, 0.7, 1.0, 1.0 + 1e-9, 2.0]).unwrap();
    let points = vec![[0.0, 1e-300, -2.5e7], [1.0, -0.0, f64::MIN_POSITIVE], [0.1, 1.0 / 3.0, 9.9e22], [1.0, 2.0, 3.0]];
    BSplineCurve::new(knots, points).unwrap()
}

/// A real with a decimal point and the exponent letter of the format.
fn number(text: &str, exponent: &str) -> f64 {
    assert!(text.contains('.') && !text.contains('e'), "{text} is not a real of the format");
    text.replace(exponent, "e").parse().unwrap()
}

/// Arguments at the top level of `NAME(a,(b,c),'d')`.
fn arguments(entity: &str) -> Vec<String> {
    let inside = &entity[entity.find('(').unwrap() + 1..entity.rfind(')').unwrap()];
    let (mut depth, mut quoted, mut result) = (0, false, vec![String::new()]);
    for c in inside.chars() {
        match c {
            '\'' => quoted = !quoted,
            '(' if !quoted => depth += 1,
            ')' if !quoted => depth -= 1,
            ',' if !quoted && depth == 0 => {
                result.push(String::new());
                continue;
            }
            _ => {}
        }
        result.last_mut().unwrap().push(c);
    }
    result
}

/// The instances of a STEP file by name; all references must be defined, all instances but roots used.
fn step_entities(text: &str) -> BTreeMap<&str, &str> {
    assert!(text.starts_with("ISO-10303-21;\nHEADER;\n") && text.ends_with("ENDSEC;\nEND-ISO-10303-21;\n"));
    assert!(text.contains("FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));"));
    let (_, data) = text.split_once("DATA;\n").unwrap();
    let entities: BTreeMap<&str, &str> = data
        .lines()
        .filter(|line| line.starts_with('#'))
        .map(|line| line.strip_suffix(';').unwrap().split_once('=').unwrap())
        .collect();
    let mut used = HashSet::new();
    for entity in entities.values() {
        for reference in entity.split('#').skip(1) {
            let digits = reference.find(|c: char| !c.is_ascii_digit()).unwrap_or(reference.len());
            let name = format!("#{}", &reference[..digits]);
            assert!(entities.contains_key(name.as_str()), "{name} is not defined");
            used.insert(name);
        }
    }
    let roots = ["SHAPE_DEFINITION_REP", "APPLICATION_PROTOCOL", "PRODUCT_RELATED"];
    for (name, entity) in &entities {
        let root = roots.iter().any(|r| entity.starts_with(r));
        assert!(root || used.contains(*name), "{name} {entity} is not used");
    }
    entities
}

fn read_step(text: &str) -> Found {
    let entities = step_entities(text);
    assert_eq!(step_unit(text), 1.0);
    let all =
        |kind: &str| entities.values().filter(|e| e.starts_with(&format!("{kind}("))).copied().collect::<Vec<_>>();
    let one = |kind: &str| {
        let found = all(kind);
        assert_eq!(found.len(), 1, "{kind}");
        arguments(found[0])
    };
    for kind in ["PRODUCT", "PRODUCT_DEFINITION", "PRODUCT_DEFINITION_SHAPE", "SHAPE_DEFINITION_REPRESENTATION"] {
        one(kind);
    }
    let point = |name: &String| {
        let entity = entities[name.as_str()];
        assert!(entity.starts_with("CARTESIAN_POINT("));
        let numbers: Vec<f64> = arguments(&arguments(entity)[1]).iter().map(|n| number(n, "E")).collect();
        <[f64; 3]>::try_from(numbers).unwrap()
    };
    let spline = one("B_SPLINE_CURVE_WITH_KNOTS");
    let times = arguments(&spline[6]);
    let knots = arguments(&spline[7]);
    assert_eq!(times.len(), knots.len());
    let repeated = knots.iter().zip(&times).flat_map(|(k, n)| vec![number(k, "E"); n.parse().unwrap()]);
    let segments = all("POLYLINE");
    assert_eq!(arguments(&one("GEOMETRIC_CURVE_SET")[1]).len(), 1 + segments.len());
    Found {
        degree: spline[1].parse().unwrap(),
        knots: repeated.collect(),
        points: arguments(&spline[2]).iter().map(point).collect(),
        closed: match spline[4].as_str() {
            ".T." => true,
            ".F." => false,
            other => panic!("closed flag {other}"),
        },
        closing: segments.first().map(|s| {
            let ends: Vec<_> = arguments(&arguments(s)[1]).iter().map(point).collect();
            <[_; 2]>::try_from(ends).unwrap()
        }),
    }
}

/// The sections of an IGES file, 72 columns of each line; sequence numbers and the terminate line are checked.
fn iges_sections(text: &str) -> BTreeMap<char, Vec<&str>> {
    let mut sections: BTreeMap<char, Vec<&str>> = BTreeMap::new();
    let mut order = vec![];
    for line in text.lines() {
        assert_eq!(line.len(), 80, "{line}");
        let letter = line.as_bytes()[72] as char;
        order.push("SGDPT".find(letter).unwrap());
        let lines = sections.entry(letter).or_default();
        lines.push(&line[..72]);
        assert_eq!(line[73..].trim().parse::<usize>().unwrap(), lines.len());
    }
    assert!(order.is_sorted());
    let counts = ['S', 'G', 'D', 'P'].map(|l| format!("{l}{:>7}", sections[&l].len())).concat();
    assert_eq!(sections[&'T'], [format!("{counts:<72}")]);
    sections
}

fn read_iges(text: &str) -> Found {
    let sections = iges_sections(text);
    let global = sections[&'G'].concat();
    assert!(global.starts_with("1H,,1H;,"));
    let fields = hollerith_fields(&global);
    assert_eq!(fields.len(), 25, "{fields:?}");
    // metres, IGES 5.3
    assert_eq!((fields[13].as_str(), fields[14].as_str(), fields[22].as_str()), ("6", "1HM", "11"));

    let mut spline = None;
    let mut closing = None;
    for (i, pair) in sections[&'D'].chunks(2).enumerate() {
        let field = |line: usize, k: usize| pair[line][8 * k..8 * k + 8].trim();
        let kind = field(0, 0);
        assert_eq!(kind, field(1, 0));
        let first: usize = field(0, 1).parse().unwrap();
        let count: usize = field(1, 3).parse().unwrap();
        let mut data = String::new();
        for line in &sections[&'P'][first - 1..first - 1 + count] {
            assert_eq!(line[64..].trim().parse::<usize>().unwrap(), 2 * i + 1, "back pointer");
            data += line[..64].trim_end();
        }
        let fields: Vec<&str> = data.strip_suffix(';').unwrap().split(',').collect();
        assert_eq!(fields[0], kind);
        match kind {
            "126" => spline = Some(iges_spline(&fields)),
            "110" => {
                let n: Vec<f64> = fields[1..].iter().map(|n| number(n, "D")).collect();
                closing = Some([[n[0], n[1], n[2]], [n[3], n[4], n[5]]]);
            }
            other => panic!("entity {other}"),
        }
    }
    Found { closing, ..spline.unwrap() }
}

/// Splits a global section at its commas, but not inside of Hollerith strings.
fn hollerith_fields(text: &str) -> Vec<String> {
    let (mut rest, mut fields) = (text.trim_end().strip_suffix(';').unwrap(), vec![]);
    loop {
        // a field that does not fit starts the next line
        rest = rest.trim_start();
        let digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
        let length = if digits > 0 && rest[digits..].starts_with('H') {
            digits + 1 + rest[..digits].parse::<usize>().unwrap()
        } else {
            rest.find(',').unwrap_or(rest.len())
        };
        fields.push(rest[..length].to_string());
        match rest[length..].strip_prefix(',') {
            Some(tail) => rest = tail,
            None => return fields,
        }
    }
}

fn iges_spline(fields: &[&str]) -> Found {
    let whole = |i: usize| fields[i].parse::<usize>().unwrap();
    let (last, degree) = (whole(1), whole(2));
    assert_eq!((whole(5), whole(6)), (1, 0), "polynomial, not periodic");
    let reals: Vec<f64> = fields[7..].iter().map(|n| number(n, "D")).collect();
    let (knots, rest) = reals.split_at(last + degree + 2);
    let (weights, rest) = rest.split_at(last + 1);
    assert!(weights.iter().all(|&w| w == 1.0));
    let (points, rest) = rest.split_at(3 * (last + 1));
    assert_eq!(rest[..2], [knots[degree], knots[last + 1]]);
    assert_eq!(rest[2..], if whole(3) == 1 { [0.0, 0.0, 1.0] } else { [0.0; 3] });
    let points: Vec<[f64; 3]> = points.chunks(3).map(|c| [c[0], c[1], c[2]]).collect();
    assert_eq!(whole(3) == 1, points.iter().all(|p| p[2] == 0.0));
    Found { degree, knots: knots.to_vec(), points, closed: whole(4) == 1, closing: None }
}

type Groups<'a> = Vec<(u16, &'a str)>;

/// Code and value pairs of a DXF file; sections and handles are checked.
fn dxf_groups(text: &str) -> Groups<'_> {
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len() % 2, 0);
    let groups: Groups = lines.chunks(2).map(|c| (c[0].trim().parse().unwrap(), c[1])).collect();
    assert_eq!(groups.last(), Some(&(0, "EOF")));
    let sections: Vec<&str> = groups.windows(2).filter(|w| w[0] == (0, "SECTION")).map(|w| w[1].1).collect();
    assert_eq!(sections, ["HEADER", "CLASSES", "TABLES", "BLOCKS", "ENTITIES", "OBJECTS"]);
    let seed = groups.iter().position(|g| *g == (9, "$HANDSEED")).unwrap() + 1;
    let hex = |s: &str| u64::from_str_radix(s, 16).unwrap();
    let mut handles = HashSet::from([0]);
    for (i, (code, value)) in groups.iter().enumerate() {
        if i != seed && (*code == 5 || *code == 105) {
            assert!(handles.insert(hex(value)), "handle {value} twice");
            assert!(hex(value) < hex(groups[seed].1));
        }
    }
    for (_, owner) in groups.iter().filter(|(code, _)| *code == 330 || *code == 350) {
        assert!(handles.contains(&hex(owner)), "no object {owner}");
    }
    groups
}

fn read_dxf(text: &str) -> Found {
    let groups = dxf_groups(text);
    let entity = |kind: &str| {
        let start = groups.iter().position(|g| *g == (0, kind))?;
        let length = groups[start + 1..].iter().position(|(code, _)| *code == 0).unwrap();
        Some(groups[start + 1..start + 1 + length].to_vec())
    };
    let reals = |groups: &[(u16, &str)], code: u16| -> Vec<f64> {
        groups.iter().filter(|(c, _)| *c == code).map(|(_, v)| v.parse().unwrap()).collect()
    };
    let triples = |groups: &[(u16, &str)], code: u16| -> Vec<[f64; 3]> {
        let axes = [0, 10, 20].map(|d| reals(groups, code + d));
        (0..axes[0].len()).map(|i| [axes[0][i], axes[1][i], axes[2][i]]).collect()
    };
    let spline = entity("SPLINE").unwrap();
    let whole = |code: u16| reals(&spline, code)[0] as usize;
    let (knots, points) = (reals(&spline, 40), triples(&spline, 10));
    assert_eq!((whole(72), whole(73), whole(74)), (knots.len(), points.len(), 0));
    assert_eq!(whole(70) & 8 != 0, points.iter().all(|p| p[2] == 0.0));
    Found {
        degree: whole(71),
        knots,
        points,
        closed: whole(70) & 1 != 0,
        closing: entity("LINE").map(|l| [triples(&l, 10)[0], triples(&l, 11)[0]]),
    }
}

fn check<const D: usize>(curve: &BSplineCurve<f64, D>) {
    let wanted = expected(curve);
    let long = "a rather long name, with commas; semicolons, 5H and all else that a line of 72 columns does not hold";
    for name in ["section", "", long] {
        let read = [
            read_step(&cad::step(curve, name).unwrap()),
            read_iges(&cad::iges(curve, name).unwrap()),
            read_dxf(&cad::dxf(curve, name).unwrap()),
        ];
        for found in read {
            assert_eq!(found, wanted);
        }
    }
}

#[test]
fn a_blunt_section_gets_a_closing_segment() {
    assert!(expected(&blunt()).closing.is_some());
    check(&blunt());
}

#[test]
fn a_sharp_section_is_closed() {
    assert!(expected(&sharp()).closed);
    check(&sharp());
    check(&ellipse([0.5, 0.1], [0.5, 0.06], 0.1, 1e-9).unwrap().curve);
}

#[test]
fn unclamped_curves_in_space_with_extreme_numbers() {
    check(&in_space());
}

/// The length of a unit in metres as a STEP file declares it.
fn step_unit(text: &str) -> f64 {
    let entities = step_entities(text);
    let context = entities.values().find(|e| e.contains("GLOBAL_UNIT_ASSIGNED_CONTEXT")).unwrap();
    let units = context.split_once("GLOBAL_UNIT_ASSIGNED_CONTEXT((").unwrap().1;
    let metres = |reference: &str| {
        let entity = entities[reference];
        assert!(entity.contains("LENGTH_UNIT()"), "{entity}");
        match entity.split_once("SI_UNIT(").unwrap().1.split_once(',').unwrap().0 {
            "$" => 1.0,
            ".CENTI." => 0.01,
            ".MILLI." => 0.001,
            other => panic!("prefix {other}"),
        }
    };
    let first = units.split_once(',').unwrap().0;
    let Some(based) = entities[first].split_once("CONVERSION_BASED_UNIT(") else { return metres(first) };
    let measure = entities[based.1.split_once(',').unwrap().1.split_once(')').unwrap().0];
    let fields = arguments(measure);
    let factor = fields[0].strip_prefix("LENGTH_MEASURE(").unwrap().strip_suffix(')').unwrap();
    number(factor, "E") * metres(&fields[1])
}

#[test]
fn units_are_declared_and_coordinates_stay() {
    use cad::LengthUnit::{Centimetre, Foot, Inch, Metre, Millimetre};
    for (unit, metres, iges, dxf) in [
        (Metre, 1.0, ("6", "1HM"), ("6", "1")),
        (Centimetre, 0.01, ("10", "2HCM"), ("5", "1")),
        (Millimetre, 0.001, ("2", "2HMM"), ("4", "1")),
        (Inch, 0.0254, ("1", "2HIN"), ("1", "0")),
        (Foot, 0.3048, ("4", "2HFT"), ("2", "0")),
    ] {
        assert!((unit.millimetres() - 1000.0 * metres).abs() < 1e-12);
        let options = cad::Options { unit, ..cad::Options::named("unit") };
        let step = cad::step_with(&blunt(), &options).unwrap();
        assert!((step_unit(&step) - metres).abs() < 1e-15, "{unit:?}");
        assert!(step.contains(&format!("unit {}", unit.name())));
        let file = cad::iges_with(&blunt(), &options).unwrap();
        let fields = hollerith_fields(&iges_sections(&file)[&'G'].concat());
        assert_eq!((fields[13].as_str(), fields[14].as_str()), iges);
        let file = cad::dxf_with(&blunt(), &options).unwrap();
        let groups = dxf_groups(&file);
        let header = |name: &str| groups[groups.iter().position(|g| *g == (9, name)).unwrap() + 1].1;
        assert_eq!((header("$INSUNITS"), header("$MEASUREMENT")), dxf);
        assert_eq!(read_dxf(&file), expected(&blunt()));
        // the resolution is a nanometre in every unit
        let resolution = step.split_once("UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(").unwrap().1;
        let resolution = number(resolution.split_once(')').unwrap().0, "E");
        assert!((resolution * metres - 1e-9).abs() < 1e-20, "{unit:?}: {resolution}");
    }
}

#[test]
fn a_face_is_bounded_by_the_outline_and_its_base() {
    for (curve, edges) in [(blunt(), 2), (sharp(), 1)] {
        let options = cad::Options { face: true, ..cad::Options::named("face") };
        let step = cad::step_with(&curve, &options).unwrap();
        let entities = step_entities(&step);
        let all = |kind: &str| -> Vec<(&str, Vec<String>)> {
            let wanted = format!("{kind}(");
            entities.iter().filter(|(_, e)| e.starts_with(&wanted)).map(|(name, e)| (*name, arguments(e))).collect()
        };
        let one = |kind: &str| {
            let mut found = all(kind);
            assert_eq!(found.len(), 1, "{kind}");
            found.remove(0)
        };
        let numbers = |list: &str| -> Vec<f64> { arguments(list).iter().map(|n| number(n, "E")).collect() };
        // from the representation down to the edges
        let representation = one("MANIFOLD_SURFACE_SHAPE_REPRESENTATION").1;
        assert!(arguments(&representation[1]).contains(&one("SHELL_BASED_SURFACE_MODEL").0.to_string()));
        assert_eq!(arguments(&one("SHELL_BASED_SURFACE_MODEL").1[1]), [one("OPEN_SHELL").0]);
        assert_eq!(arguments(&one("OPEN_SHELL").1[1]), [one("ADVANCED_FACE").0]);
        let face = one("ADVANCED_FACE").1;
        assert_eq!(
            (arguments(&face[1]), face[2].as_str()),
            (vec![one("FACE_OUTER_BOUND").0.to_string()], one("PLANE").0)
        );
        assert_eq!(one("FACE_OUTER_BOUND").1[1], one("EDGE_LOOP").0);
        let oriented = arguments(&one("EDGE_LOOP").1[1]);
        assert_eq!(oriented.len(), edges);
        // every edge begins where the one before ends, and the loop closes
        let ends: Vec<[Vec<f64>; 2]> = oriented
            .iter()
            .map(|name| {
                let oriented = arguments(entities[name.as_str()]);
                assert_eq!(oriented[4], ".T.");
                let edge = arguments(entities[oriented[3].as_str()]);
                [1, 2].map(|k| {
                    let vertex = arguments(entities[edge[k].as_str()]);
                    numbers(&arguments(entities[vertex[1].as_str()])[1])
                })
            })
            .collect();
        for (k, edge) in ends.iter().enumerate() {
            assert_eq!(edge[1], ends[(k + 1) % edges][0]);
        }
        let points = expected(&curve).points;
        assert_eq!((&ends[0][0][..], &ends[0][1][..]), (&points[0][..], &points[points.len() - 1][..]));
        // the plane is z = 0, seen from above: these outlines run counter-clockwise
        let placement = arguments(entities[one("PLANE").1[1].as_str()]);
        assert_eq!(numbers(&arguments(entities[placement[1].as_str()])[1]), [0.0; 3]);
        assert_eq!(numbers(&arguments(entities[placement[2].as_str()])[1]), [0.0, 0.0, 1.0]);
        // the base is a line from the last point to the first
        if let [_, base] = &ends[..] {
            let line = one("LINE").1;
            assert_eq!(numbers(&arguments(entities[line[1].as_str()])[1]), base[0]);
            let vector = arguments(entities[line[2].as_str()]);
            let direction = numbers(&arguments(entities[vector[1].as_str()])[1]);
            let length = number(&vector[2], "E");
            for d in 0..3 {
                assert!((base[0][d] + length * direction[d] - base[1][d]).abs() < 1e-15);
            }
        }
    }
    // clockwise outlines are seen from below
    let mut points = sharp().control_points().to_vec();
    points.reverse();
    let reversed = BSplineCurve::new(KnotVector::clamped(3, 0.0, 1.0, [1.0 / 3.0; 2]).unwrap(), points).unwrap();
    let step = cad::step_with(&reversed, &cad::Options { face: true, ..cad::Options::named("face") }).unwrap();
    assert!(step.contains("DIRECTION('',(0.,0.,-1.))"));
    let open = cad::Options { face: true, close: false, ..cad::Options::named("open") };
    assert_eq!(cad::step_with(&blunt(), &open), Err(cad::CadError::NoFace));
    let options = cad::Options { face: true, ..cad::Options::named("face") };
    assert_eq!(cad::step_with(&in_space(), &options), Err(cad::CadError::NoFace));
    assert_eq!(cad::dxf_with(&blunt(), &options), Err(cad::CadError::FaceFormat { format: "DXF" }));
    assert_eq!(cad::iges_with(&blunt(), &options), Err(cad::CadError::FaceFormat { format: "IGES" }));
}

#[test]
fn options_leave_the_gap_open_and_set_the_time() {
    let time_stamp = cad::TimeStamp { year: 2031, month: 2, day: 3, time: [4, 5, 6] };
    let options = cad::Options { time_stamp, close: false, ..cad::Options::named("open") };
    let step = cad::step_with(&blunt(), &options).unwrap();
    assert!(step.contains("'2031-02-03T04:05:06'"));
    let iges = cad::iges_with(&blunt(), &options).unwrap();
    assert!(iges.contains("15H20310203.040506"));
    let dxf = cad::dxf_with(&blunt(), &options).unwrap();
    for found in [read_step(&step), read_iges(&iges), read_dxf(&dxf)] {
        assert_eq!((found.closed, found.closing), (false, None));
    }
    assert_eq!(cad::step(&blunt(), "x").unwrap(), cad::step(&blunt(), "x").unwrap());
}
