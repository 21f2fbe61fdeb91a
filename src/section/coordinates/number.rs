//! The numbers in a line, as people and programs write them.

/// A number, and how it was written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Field {
    pub value: f64,
    /// Digits behind the decimal point.
    pub decimals: i32,
    /// Power of ten of the exponent; 0 where none is written.
    pub exponent: i32,
    /// Whether there is neither a point with digits behind it nor an exponent.
    pub whole: bool,
}

/// Unusual ways of writing in a line that have one reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Oddity {
    /// A minus sign that is a dash of printed text.
    pub dash: bool,
    /// Decimal commas.
    pub comma: bool,
    /// Numbers without anything between them.
    pub touching: bool,
}

/// How the numbers of a whole file are written.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Style {
    /// Commas are decimal points, not separators.
    pub decimal_comma: bool,
    /// Digits behind the point where all numbers have as many.
    pub decimals: Option<usize>,
}

/// Plain text of a line: signs of printed text replaced by those of keyboards.
pub(super) fn plain(line: &str) -> (String, bool) {
    let mut dash = false;
    let text = line
        .chars()
        .filter(|c| !matches!(c, '\u{200b}'..='\u{200d}' | '\u{2060}' | '\u{feff}'))
        .map(|c| match c {
            '\u{2010}'..='\u{2015}' | '\u{2212}' | '\u{fe58}' | '\u{fe63}' | '\u{ff0d}' // raised, lowered, and others
            | '\u{207b}' | '\u{208b}' | '\u{02d7}' | '\u{2796}' | '\u{00ad}' => {
                dash = true;
                '-'
            }
            '\u{ff0b}' | '\u{207a}' | '\u{208a}' | '\u{2795}' => '+',
            '\u{201c}' | '\u{201d}' => '"',
            c if c.is_whitespace() => ' ',
            c => c,
        })
        .collect();
    (text, dash)
}

/// The numbers of a line of plain text, if it holds nothing else.
pub(super) fn numbers(line: &str, style: Style) -> Option<(Vec<Field>, Oddity)> {
    // quotation marks separate, whatever stands between two of them
    let line = line.trim();
    let bare = line.strip_prefix('(').and_then(|rest| rest.trim_end_matches([',', ';']).strip_suffix(')'));
    let unquoted = bare.unwrap_or(line).replace("\",\"", ";").replace("';'", ";").replace(['"', '\''], " ");
    let (words, comma) = words(&unquoted, style);
    let mut oddity = Oddity { comma, ..Oddity::default() };
    let mut fields = Vec::with_capacity(words.len());
    for word in &words {
        match number(word) {
            Some(field) => fields.push(field),
            None => {
                fields.extend(touching(word, style)?);
                oddity.touching = true;
            }
        }
    }
    (!fields.is_empty()).then_some((fields, oddity))
}

/// The words of a line, with decimal points; whether there were decimal commas.
fn words(line: &str, style: Style) -> (Vec<String>, bool) {
    let separates = |c: char| c.is_whitespace() || c == ';' || c == '|';
    let blocks: Vec<&str> =
        line.split(separates).map(|word| word.trim_matches(',')).filter(|word| !word.is_empty()).collect();
    let dotted = line.contains('.');
    let between_digits = blocks.iter().any(|block| has_inner_comma(block));
    // a comma between digits is a decimal one where something else separates, or all over the file
    let decimal = between_digits && !dotted && (blocks.len() > 1 || style.decimal_comma);
    if decimal && blocks.iter().all(|block| block.matches(',').count() <= 1) {
        return (blocks.iter().map(|block| block.replace(',', ".")).collect(), true);
    }
    if let [block] = blocks[..]
        && let Some(pair) = four_parts(block)
    {
        return (pair.to_vec(), true);
    }
    (blocks.iter().flat_map(|b| b.split(',')).filter(|w| !w.is_empty()).map(String::from).collect(), false)
}

fn has_inner_comma(block: &str) -> bool {
    let bytes = block.as_bytes();
    (1..bytes.len().saturating_sub(1))
        .any(|i| bytes[i] == b',' && bytes[i - 1].is_ascii_digit() && bytes[i + 1].is_ascii_digit())
}

/// `0,05000,-0,03550`: commas within numbers and between them. Only decimals can begin with a zero.
fn four_parts(block: &str) -> Option<[String; 2]> {
    let parts: Vec<&str> = block.split(',').collect();
    let [a, b, c, d] = parts[..] else { return None };
    let digits = |p: &str| !p.is_empty() && p.bytes().all(|c| c.is_ascii_digit());
    let short = |p: &str| digits(p.trim_start_matches(['-', '+'])) && p.len() <= 2;
    let decimals = digits(b) && digits(d) && b.len() >= 3 && d.len() >= 3;
    (short(a) && short(c) && decimals && (b.starts_with('0') || d.starts_with('0') || b.len() == d.len()))
        .then(|| [format!("{a}.{b}"), format!("{c}.{d}")])
}

/// Whether a line of plain text can only be read with decimal commas (1), cannot (-1), or tells nothing (0).
pub(super) fn decimal_comma_vote(line: &str) -> i32 {
    if !line.contains(',') || line.chars().any(|c| c.is_alphabetic() && !"eEdD".contains(c)) {
        return 0;
    }
    if line.contains('.') {
        return -1;
    }
    match numbers(line, Style::default()) {
        Some((fields, oddity)) if oddity.comma && fields.len() >= 2 => 1,
        _ => 0,
    }
}

/// A number on its own, also with a Fortran exponent; the signs of no number (`nan`, `****`) count as one.
pub(super) fn number(word: &str) -> Option<Field> {
    if no_number(word) {
        let value = word.parse().unwrap_or(f64::NAN);
        return Some(Field { value, decimals: 0, exponent: 0, whole: false });
    }
    let unsigned = word.strip_prefix(['+', '-']).unwrap_or(word);
    let (mantissa, exponent) = match unsigned.find(['e', 'E', 'd', 'D', 'q', 'Q']) {
        Some(at) => (&unsigned[..at], Some(&unsigned[at + 1..])),
        None => (unsigned, None),
    };
    let (before, behind) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits = |text: &str| text.bytes().all(|b| b.is_ascii_digit());
    if before.len() + behind.len() == 0 || !digits(before) || !digits(behind) {
        return None;
    }
    let power: i32 = match exponent {
        None => 0,
        Some(text) => {
            let unsigned = text.strip_prefix(['+', '-']).unwrap_or(text);
            if unsigned.is_empty() || !digits(unsigned) {
                return None;
            }
            text.parse().unwrap_or(i32::MAX)
        }
    };
    let value = match exponent {
        None => word.parse().ok()?,
        Some(_) => {
            let sign = if word.starts_with('-') { "-" } else { "" };
            format!("{sign}{mantissa}e{power}").parse().ok()?
        }
    };
    let decimals = i32::try_from(behind.len()).unwrap_or(i32::MAX);
    Some(Field { value, decimals, exponent: power, whole: behind.is_empty() && exponent.is_none() })
}

/// Marks that programs write where a number is missing or too long for its column.
fn no_number(word: &str) -> bool {
    let word = word.trim_start_matches(['+', '-']);
    // most words are numbers with digits behind a point
    if word.starts_with(['.', '0']) {
        return false;
    }
    let word = word.to_ascii_lowercase();
    let overflow = word.len() > 1 && word.bytes().all(|b| b == b'*');
    overflow || ["nan", "inf", "infinity", "1.#qnan", "1.#ind", "1.#inf"].contains(&word.as_str())
}

/// Numbers without anything between them: a sign begins the next one, or the number of decimals is known.
fn touching(word: &str, style: Style) -> Option<Vec<Field>> {
    let bytes = word.as_bytes();
    let mut starts = vec![0];
    for i in 1..bytes.len() {
        if matches!(bytes[i], b'-' | b'+') && !matches!(bytes[i - 1], b'e' | b'E' | b'd' | b'D' | b'q' | b'Q') {
            starts.push(i);
        }
    }
    if starts.len() == 1 {
        let first_end = word.find('.')? + 1 + style.decimals.filter(|&d| d > 0)?;
        starts.push(first_end);
    }
    starts.push(word.len());
    let mut fields = Vec::with_capacity(starts.len());
    for ends in starts.windows(2) {
        let part = word.get(ends[0]..ends[1])?;
        // without a point it may be an exponent whose letter had no room, or a date
        let field = number(part).filter(|_| part.contains('.'))?;
        if style.decimals.is_some_and(|d| usize::try_from(field.decimals) != Ok(d)) {
            return None;
        }
        fields.push(field);
    }
    Some(fields)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(line: &str, style: Style) -> Option<Vec<f64>> {
        numbers(&plain(line).0, style).map(|(fields, _)| fields.iter().map(|f| f.value).collect())
    }

    #[test]
    fn unambiguous_numbers_are_read() {
        let plainly = Style::default();
        for (line, wanted) in [
            ("0.05 -0.0355", [0.05, -0.0355]),
            (" 0.05000-0.03550", [0.05, -0.0355]),
            ("-0.00010-0.00355", [-0.0001, -0.00355]),
            ("0.05 \u{2212}0.0355", [0.05, -0.0355]),
            ("0.05 \u{207b}0.0355", [0.05, -0.0355]),
            ("\u{207a}0.05 \u{2796}0.0355", [0.05, -0.0355]),
            ("0.05\t\u{2013}0.0355", [0.05, -0.0355]),
            ("0.05\u{a0}-0.0355", [0.05, -0.0355]),
            ("0,05000 -0,03550", [0.05, -0.0355]),
            ("0,05;-0,0355", [0.05, -0.0355]),
            ("0,05\t-0,0355", [0.05, -0.0355]),
            ("0,05, -0,0355", [0.05, -0.0355]),
            ("0,05000,-0,03550", [0.05, -0.0355]),
            ("0,5 0", [0.5, 0.0]),
            ("\"0.05\",\"-0.0355\"", [0.05, -0.0355]),
            ("\"0,05\",\"-0,0355\"", [0.05, -0.0355]),
            ("0.5D-1 -.355d-1", [0.05, -0.0355]),
            ("+5.E-02, -3.55E-02,", [0.05, -0.0355]),
            ("1,0", [1.0, 0.0]),
            ("1, 0", [1.0, 0.0]),
            ("1 ,0", [1.0, 0.0]),
            ("(1, 0),", [1.0, 0.0]),
            ("0.5E-01-0.355E-01", [0.05, -0.0355]),
        ] {
            assert_eq!(values(line, plainly), Some(wanted.to_vec()), "{line}");
        }
        let fixed = Style { decimals: Some(5), ..plainly };
        assert_eq!(values("1.000000.00126", fixed), Some(vec![1.0, 0.00126]));
        let comma = Style { decimal_comma: true, ..plainly };
        assert_eq!(values("0,5", comma), Some(vec![0.5]));
    }

    #[test]
    fn ambiguous_and_damaged_ones_are_not() {
        for line in [
            "0.O5 0.1",
            "1.000000.00126",
            "0.5-1",
            "0.5 - 0.1",
            "0.5x 0.1",
            "0.5 0.1e",
            "0..5 1",
            "0.5 0.1.",
            "x 1",
            "1e 2",
        ] {
            assert_eq!(values(line, Style::default()), None, "{line}");
        }
        let fixed = Style { decimals: Some(5), ..Style::default() };
        assert_eq!(values("1.000000.0012", fixed), None);
        assert!(values("nan 0.1", Style::default()).unwrap()[0].is_nan());
        assert!(values("0.1 *******", Style::default()).unwrap()[1].is_nan());
        // a decimal comma beside a decimal point has three parts
        assert_eq!(values("0,5 0.1", Style::default()).unwrap().len(), 3);
    }

    #[test]
    fn the_way_of_writing_is_kept() {
        let field = number("-0.9150677E-01").unwrap();
        assert_eq!((field.decimals, field.exponent, field.whole), (7, -1, false));
        assert!(number("51.").unwrap().whole && number("51").unwrap().whole && !number("51.0").unwrap().whole);
        assert_eq!(number("1e999999999999").unwrap().value, f64::INFINITY);
    }

    #[test]
    fn files_vote_on_decimal_commas() {
        for (line, vote) in [("0,5 0,1", 1), ("0,5;0,1", 1), ("0.5,0.1", -1), ("0,0", 0), ("0.5 0.1", 0), ("a, b", 0)] {
            assert_eq!(decimal_comma_vote(line), vote, "{line}");
        }
    }
}
