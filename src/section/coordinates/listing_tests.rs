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
