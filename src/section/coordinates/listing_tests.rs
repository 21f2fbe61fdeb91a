//! Layouts of coordinate files.

use super::*;

fn parse(bytes: &[u8]) -> Result<Listing, CoordinateError> {
    super::parse(bytes, None)
}

fn points(text: &str) -> Vec<[f64; 2]> {
    parse(text.as_bytes()).unwrap().points.iter().map(|p| p.xy).collect()
}

#[test]
fn separators_comments_and_line_ends() {
    let expected = [[1.0, 0.0], [0.5, 0.1], [0.0, 0.0]];
    for text in [
        "title\n1 0\n0.5 0.1\n0 0\n",
        "title\r\n1\t0\r\n0.5\t0.1\r\n0\t0",
        "title\r1,0\r0.5,0.1\r0,0\r",
        "# comment\ntitle\n1; 0 ! tail\n\n0.5 , .1\n % more\n0.0D0 0\n",
        "1 0\n+5.0e-1 1d-1\n-0 0\n\x1a",
        "\u{feff}title\n1 0\n0.5 0.1\n0 0\nremark at the end\n",
    ] {
        assert_eq!(points(text), expected, "{text:?}");
    }
    let listing = parse(b"G\xf6ttingen 10%\n1 0\n0 0\n").unwrap();
    assert_eq!(listing.title.as_deref(), Some("Göttingen 10%"));
}

#[test]
fn titles_may_look_like_numbers() {
    for title in ["2412", "64 2 15", "2412 airfoil", "0.5 thick", "12% 3"] {
        let listing = parse(format!("{title}\n1 0\n0 0\n").as_bytes()).unwrap();
        assert_eq!((listing.title.as_deref(), listing.points.len()), (Some(title), 2));
    }
    assert_eq!(parse(b"title\n3\n1 0\n0 0\n1 0\n").unwrap().points.len(), 3);
}

#[test]
fn bad_lines_are_named() {
    use CoordinateError as E;
    let cases: [(&[u8], E); 10] = [
        (b"", E::Empty),
        (b"title only\n", E::Empty),
        (b"t\n1 0\n0.5\n", E::Columns { line: 3, found: 1 }),
        (b"t\n1 0 1\n0 1 0\n0 0 1\n", E::Columns { line: 2, found: 3 }),
        (b"t\n1 0\n\n0.5 0.1x\n", E::NotANumber { line: 4, text: "0.1x".into() }),
        (b"t\n1 0\n0 inf\n", E::Value { line: 3, value: f64::INFINITY }),
        (b"t\n1 0\n1e300 0\n", E::Value { line: 3, value: 1e300 }),
        (b"t\n1 0\n\x00\x01", E::Binary { offset: 6, byte: 0 }),
        (b"t\n4\n1 0\n0 0\n", E::Count { line: 2, announced: 4, found: 2 }),
        (b"t\n3 3\n\n0 0\n1 0\n", E::Count { line: 2, announced: 6, found: 2 }),
    ];
    for (bytes, error) in cases {
        assert_eq!(parse(bytes).unwrap_err(), error, "{:?}", String::from_utf8_lossy(bytes));
    }
    assert!(matches!(parse(b"t\n1 0\nnan 0\n"), Err(E::Value { line: 3, .. })));
    let many = "1 0\n".repeat(MOST + 1);
    assert_eq!(parse(many.as_bytes()).unwrap_err(), E::TooManyPoints { found: MOST + 1, most: MOST });
}

#[test]
fn lednicer_headers_are_recognised() {
    let listing = parse(b"t\n2. 3.\n\n0 0\n1 0\n\n0 0\n0.5 -0.1\n1 0\n").unwrap();
    assert_eq!(listing.surfaces, Some([2, 3]));
    assert_eq!((listing.points.len(), listing.breaks), (5, vec![2]));
    // chord of 100, blunt
    let listing = parse(b"t\n100 2\n50 10\n0 0\n50 -10\n100 -2\n").unwrap();
    assert_eq!((listing.surfaces, listing.points.len()), (None, 5));
}

const OUTLINE: [[f64; 2]; 7] =
    [[1.0, 0.001], [0.5, 0.06], [0.1, 0.03], [0.0, 0.0], [0.1, -0.02], [0.5, -0.04], [1.0, -0.001]];

fn rows(row: impl Fn(usize, f64, f64) -> String) -> String {
    OUTLINE.iter().enumerate().map(|(i, [x, y])| row(i, *x, *y) + "\n").collect()
}

#[test]
fn tables_of_other_programs_are_read() {
    let plain = rows(|_, x, y| format!("{x} {y}"));
    let cases: [(&str, &str, String); 19] = [
        ("x y z", "t", format!("t\n{}", rows(|_, x, y| format!("{x} {y} 0.5")))),
        ("x z y", "t", format!("t\n{}", rows(|_, x, y| format!("{x} -2 {y}")))),
        ("z x y, no title", "", rows(|_, x, y| format!("0.0 {x} {y}"))),
        ("counted", "t", format!("t\n{}", rows(|i, x, y| format!("{} {x} {y}", i + 1)))),
        ("counted, x y z", "t", format!("t\n{}", rows(|i, x, y| format!("{i} {x} {y} 0")))),
        ("counted at the end", "t", format!("t\n{}", rows(|i, x, y| format!("{x} {y} {}", i + 1)))),
        ("x y z, counted at the end", "t", format!("t\n{}", rows(|i, x, y| format!("{x} {y} 2.5 {i}")))),
        ("MSES, four numbers", "t", format!("t\n-2 3 -2.5 3.5\n{plain}")),
        ("ISES, five numbers", "t", format!("t\n-2. 3. -2.5 3.5 1\n{plain}")),
        ("MSES, separator at the end", "t", format!("t\n-2 3 -2.5 3.5\n{plain}999.0 999.0\n")),
        ("CSV with a heading", "", format!("x,y\n{}", rows(|_, x, y| format!("{x},{y}")))),
        ("CSV in quotation marks", "", format!("\"x/c\",\"y/c\"\n{}", rows(|_, x, y| format!("\"{x}\",\"{y}\"")))),
        ("decimal commas", "t", format!("t\n{plain}").replace('.', ",")),
        ("decimal commas, semicolons", "t", format!("t\n{}", rows(|_, x, y| format!("{x};{y}")).replace('.', ","))),
        ("AeroDyn", "", format!(" 7 NumCoords ! number of coordinates\n! x-y coordinates\n! x/c y/c\n{plain}")),
        ("two numbers as title", "63 415", format!("63 415\n{plain}")),
        ("two small numbers as title", "12 24", format!("12 24\n{plain}")),
        ("Tecplot", "wing", format!("TITLE = \"wing\"\nVARIABLES = \"x\", \"y\"\nZONE I=7\n{plain}")),
        ("parentheses", "t", format!("t\n{}", rows(|_, x, y| format!("({x}, {y})")))),
    ];
    for (name, title, text) in cases {
        let listing = parse(text.as_bytes()).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(listing.points.iter().map(|p| p.xy).collect::<Vec<_>>(), OUTLINE, "{name}");
        assert_eq!(listing.title.as_deref().unwrap_or(""), title, "{name}");
    }
    let error = parse(rows(|_, x, y| format!("{x} {y} {}", x + y)).as_bytes()).unwrap_err();
    assert_eq!(error, CoordinateError::Columns { line: 1, found: 3 });
}

#[test]
fn counts_of_surfaces_are_recognised() {
    let lines = |points: &[[f64; 2]]| points.iter().map(|[x, y]| format!("{x} {y}\n")).collect::<String>();
    let upper: Vec<_> = OUTLINE[..4].iter().rev().copied().collect();
    let (upper, lower) = (lines(&upper), lines(&OUTLINE[3..]));
    for text in [
        format!("t\n4\n{upper}4\n{lower}"),
        format!("t\n4\n4\n{upper}{lower}"),
        format!("t\n4 4\n\n{upper}\n{lower}"),
        format!(
            "X AIRFOIL FILE\nt\n0\tSym Flag (0 - No, 1 - Yes)\n4\tNum Pnts Upper\n4\tNum Pnts Lower\n{upper}\n{lower}"
        ),
    ] {
        let listing = parse(text.as_bytes()).unwrap();
        assert_eq!((listing.surfaces, listing.title.as_deref()), (Some([4, 4]), Some("t")), "{text}");
    }
    let short = format!("t\n4\n{upper}4\n{}", &lower[..lower.len() - 9]);
    assert!(matches!(
        parse(short.as_bytes()),
        Err(CoordinateError::Count { announced: 4, .. } | CoordinateError::Columns { .. })
    ));
}

#[test]
fn one_of_several_elements_is_chosen() {
    let second = OUTLINE.map(|[x, y]| [0.3 * x + 1.05, 0.3 * y - 0.1]);
    let lines = |points: &[[f64; 2]]| points.iter().map(|[x, y]| format!("{x} {y}\n")).collect::<String>();
    let (main, flap) = (lines(&OUTLINE), lines(&second));
    for text in [
        format!("t\n-2 3 -2.5 3.5\n{main}999. 999.\n{flap}"),
        format!("t\n\n{main}\n{flap}"),
        format!("t\nmain\n{main}flap\n{flap}"),
    ] {
        let error = parse(text.as_bytes()).unwrap_err();
        assert_eq!(error, CoordinateError::SeveralElements { lines: vec![3, 11] });
        assert!(error.to_string().contains("--element"));
        for (element, points) in [(1, OUTLINE), (2, second)] {
            let listing = super::parse(text.as_bytes(), Some(element)).unwrap();
            assert_eq!(listing.points.iter().map(|p| p.xy).collect::<Vec<_>>(), points);
            assert!(matches!(listing.repairs.last(), Some(Repair::ElementTaken { count: 2, .. })));
        }
        let error = super::parse(text.as_bytes(), Some(3)).unwrap_err();
        assert_eq!(error, CoordinateError::NoElement { element: 3, count: 2 });
    }
}

#[test]
fn damaged_data_lines_are_read_or_refused() {
    let fixed = |damaged: &str| {
        let text = rows(|i, x, y| if i == 4 { damaged.into() } else { format!(" {x:.5} {y:.5}") });
        parse(format!("t\n{text}").as_bytes())
    };
    for good in
        [" 0.10000-0.02000", " 0.10000 \u{2212}0.02000", " 0.10000 \u{2013}0.02000", " 0,10000 -0,02000", " 1D-1 -2D-2"]
    {
        let listing = fixed(good).unwrap_or_else(|error| panic!("{good}: {error}"));
        assert_eq!(listing.points[4].xy, [0.1, -0.02], "{good}");
    }
    for bad in ["0.1", "0", "0.1O000 -0.02", "0.1 - 0.02", "0.1 -0.02 7", "0.100000.02", "1e -2", "0.1 *****", "nan 0"]
    {
        let error = fixed(bad).unwrap_err();
        assert!(error.to_string().starts_with("line 6"), "{bad}: {error}");
    }
}
