//! From the bytes of a coordinate file to numbered points.

use crate::section::CoordinateError;

/// A point, the line it stands in, and its position among the points to mend (set when mending starts).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Point {
    pub xy: [f64; 2],
    pub line: usize,
    pub source: usize,
}

/// The contents of a file: points in the order of the file, and where it was divided.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Listing {
    pub title: Option<String>,
    pub points: Vec<Point>,
    /// Positions in `points` before which a blank line or a heading stands.
    pub breaks: Vec<usize>,
    /// Lines of text passed over.
    pub remarks: Vec<usize>,
    /// Numbers of upper and lower points announced by a Lednicer header.
    pub lednicer: Option<[usize; 2]>,
}

/// Coordinates beyond are refused: their products would lose all meaning.
const LARGEST: f64 = 1e9;
/// More points than any section needs; the checks take time that grows with the square.
pub(super) const MOST: usize = 10_000;

/// Whether a coordinate is finite and of sensible size.
pub(super) fn usable(coordinate: f64) -> bool {
    coordinate.abs() <= LARGEST
}

/// One line without its comment.
enum Line<'a> {
    Blank,
    Numbers(Vec<f64>),
    Text,
    /// A number and then a field that is none.
    Broken {
        field: &'a str,
        /// Whether the line looks like a damaged point: two fields, or two numbers to begin with.
        a_point: bool,
    },
}

pub(super) fn parse(bytes: &[u8]) -> Result<Listing, CoordinateError> {
    let text = decode(bytes)?;
    let mut listing = Listing::default();
    // a line that counts the points, and the first line behind the points that may be damaged data
    let mut count: Option<(usize, f64)> = None;
    let mut damage: Option<CoordinateError> = None;
    for (number, line) in lines(&text) {
        let kind = classify(line);
        let no_points = listing.points.is_empty();
        let untitled = no_points && listing.title.is_none();
        match kind {
            Line::Blank => listing.divide(),
            Line::Numbers(values) if values.len() == 2 => {
                if let Some(error) = damage {
                    return Err(error);
                }
                listing.add(number, values[0], values[1])?;
            }
            // titles may be numbers, or begin with one
            Line::Text | Line::Numbers(_) | Line::Broken { .. } if untitled => listing.title = Some(line.trim().into()),
            Line::Numbers(values) if no_points && values.len() == 1 && count.is_none() => {
                count = Some((number, values[0]));
            }
            // the domain of an MSES file
            Line::Numbers(values) if no_points && values.len() == 4 => listing.remarks.push(number),
            Line::Numbers(values) => {
                let error = CoordinateError::Columns { line: number, found: values.len() };
                // numbers among remarks are no data, as long as no data follow
                if no_points || listing.remarks.is_empty() {
                    return Err(error);
                }
                listing.remarks.push(number);
                damage.get_or_insert(error);
            }
            Line::Broken { field, a_point } => {
                let error = CoordinateError::NotANumber { line: number, text: field.chars().take(40).collect() };
                if no_points || (a_point && listing.remarks.is_empty()) {
                    return Err(error);
                }
                listing.remarks.push(number);
                damage.get_or_insert(error);
            }
            Line::Text => {
                listing.remarks.push(number);
                listing.divide();
            }
        }
    }
    if listing.points.is_empty() {
        return Err(CoordinateError::Empty);
    }
    if let Some((line, _)) = count.filter(|&(_, count)| count != listing.points.len() as f64) {
        return Err(CoordinateError::Columns { line, found: 1 });
    }
    listing.breaks.retain(|&at| at < listing.points.len());
    listing.take_header()?;
    for point in &listing.points {
        if let Some(&value) = point.xy.iter().find(|c| !usable(**c)) {
            return Err(CoordinateError::Value { line: point.line, value });
        }
    }
    Ok(listing)
}

impl Listing {
    fn add(&mut self, line: usize, x: f64, y: f64) -> Result<(), CoordinateError> {
        self.points.push(Point { xy: [x, y], line, source: 0 });
        if self.points.len() > MOST {
            return Err(CoordinateError::TooManyPoints { found: self.points.len(), most: MOST });
        }
        Ok(())
    }

    fn divide(&mut self) {
        let at = self.points.len();
        if at > 0 && self.breaks.last() != Some(&at) {
            self.breaks.push(at);
        }
    }

    /// Recognises a Lednicer header: two counts that add up to the number of points that follow.
    fn take_header(&mut self) -> Result<(), CoordinateError> {
        let Some(&Point { xy: [a, b], line, .. }) = self.points.first() else { return Ok(()) };
        let is_count = |c: f64| (2.0..=MOST as f64).contains(&c) && c.fract() == 0.0;
        if !is_count(a) || !is_count(b) {
            return Ok(());
        }
        let (counts, found) = ([a as usize, b as usize], self.points.len() - 1);
        let announced = counts[0] + counts[1];
        // in a Selig file of unusual units the first line would be an ordinary point of the outline
        let largest = self.points[1..].iter().flat_map(|p| p.xy).fold(0.0f64, |m, c| m.max(c.abs()));
        if announced != found {
            return if a.min(b) > 1.5 * largest {
                Err(CoordinateError::Count { line, announced, found })
            } else {
                Ok(())
            };
        }
        self.points.remove(0);
        self.breaks = self.breaks.iter().filter(|&&at| at > 1).map(|at| at - 1).collect();
        self.lednicer = Some(counts);
        Ok(())
    }
}

/// Text of a file; bytes that are no UTF-8 are taken as Latin-1, so that old titles survive.
fn decode(bytes: &[u8]) -> Result<String, CoordinateError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    // 0x1a ended files under DOS
    let bytes = bytes.strip_suffix(b"\x1a").unwrap_or(bytes);
    let control = |b: &u8| *b < 0x20 && !matches!(b, b'\t' | b'\n' | b'\r' | 0x0c);
    if let Some(offset) = bytes.iter().position(control) {
        return Err(CoordinateError::Binary { offset, byte: bytes[offset] });
    }
    Ok(match std::str::from_utf8(bytes) {
        Ok(text) => text.into(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    })
}

/// Lines with their numbers; ends of lines are those of Unix, DOS or old Macintosh.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let macintosh = !text.contains('\n');
    text.split(move |c| c == '\n' || (macintosh && c == '\r')).enumerate().map(|(i, line)| (i + 1, line))
}

fn classify(line: &str) -> Line<'_> {
    let is_separator = |c: char| c.is_whitespace() || c == ',' || c == ';';
    let fields =
        |text: &str| -> Option<Vec<f64>> { text.split(is_separator).filter(|f| !f.is_empty()).map(number).collect() };
    let content = &line[..comment_start(line)];
    if content.trim_matches(is_separator).is_empty() {
        return Line::Blank;
    }
    if let Some(numbers) = fields(content) {
        return Line::Numbers(numbers);
    }
    let words: Vec<&str> = content.split(is_separator).filter(|f| !f.is_empty()).collect();
    match words.iter().position(|word| number(word).is_none()) {
        Some(at) if at > 0 => Line::Broken { field: words[at], a_point: at > 1 || words.len() <= 2 },
        _ => Line::Text,
    }
}

/// Where the comment of a line begins: a mark at the start or behind white space (titles hold "12%").
fn comment_start(line: &str) -> usize {
    let mut blank = true;
    for (at, c) in line.char_indices() {
        if blank && matches!(c, '#' | '!' | '%') {
            return at;
        }
        blank = c.is_whitespace();
    }
    line.len()
}

/// A number, also with a Fortran exponent.
fn number(field: &str) -> Option<f64> {
    field.parse().ok().or_else(|| field.replace(['d', 'D'], "e").parse().ok())
}

#[cfg(test)]
mod tests {
    use super::*;

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
            (b"t\n1 0 0\n", E::Columns { line: 2, found: 3 }),
            (b"t\n1 0\n\n0.5 0.1x\n", E::NotANumber { line: 4, text: "0.1x".into() }),
            (b"t\n1 0\n0 inf\n", E::Value { line: 3, value: f64::INFINITY }),
            (b"t\n1 0\n1e300 0\n", E::Value { line: 3, value: 1e300 }),
            (b"t\n1 0\n\x00\x01", E::Binary { offset: 6, byte: 0 }),
            (b"t\n4\n1 0\n0 0\n", E::Columns { line: 2, found: 1 }),
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
        assert_eq!(listing.lednicer, Some([2, 3]));
        assert_eq!((listing.points.len(), listing.breaks), (5, vec![2]));
        // chord of 100, blunt
        let listing = parse(b"t\n100 2\n50 10\n0 0\n50 -10\n100 -2\n").unwrap();
        assert_eq!((listing.lednicer, listing.points.len()), (None, 5));
    }
}
