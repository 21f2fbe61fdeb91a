//! The kinds of lines in a coordinate file: numbers, words, or data that was damaged.

use super::number::{Field, Oddity, Style, number, numbers, plain};

/// One line without its comment.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Line {
    Blank,
    /// Nothing but a comment.
    Comment,
    Numbers(Vec<Field>, Oddity),
    /// A sentence, a heading, a note.
    Words,
    /// Meant as data as it seems, but not readable; the part that is no number.
    Damaged(String),
}

pub(super) fn classify(line: &str, style: Style) -> Line {
    let (text, dash) = plain(line);
    let content = text[..comment_start(&text)].trim();
    if content.is_empty() {
        return if text.trim().is_empty() { Line::Blank } else { Line::Comment };
    }
    if content.chars().all(|c| c.is_whitespace() || c == ',' || c == ';' || c == '"') {
        return Line::Blank;
    }
    if let Some((fields, mut oddity)) = numbers(content, style) {
        oddity.dash = dash;
        return Line::Numbers(fields, oddity);
    }
    if is_words(content) {
        return Line::Words;
    }
    let separates = |c: char| c.is_whitespace() || c == ',' || c == ';';
    let bad = content.split(separates).filter(|w| !w.is_empty()).find(|w| number(w).is_none());
    Line::Damaged(bad.unwrap_or(content).chars().take(40).collect())
}

/// Where the comment of a line begins: a mark at the start or behind white space (titles hold "12%").
pub(super) fn comment_start(line: &str) -> usize {
    let mut blank = true;
    for (at, c) in line.char_indices() {
        if blank && (matches!(c, '#' | '!' | '%') || line[at..].starts_with("//")) {
            return at;
        }
        blank = c.is_whitespace();
    }
    line.len()
}

/// Whether a line that is not all numbers is clearly no damaged data: it holds no digit, or it is a sentence.
fn is_words(content: &str) -> bool {
    let marks = ["->", "http", "www.", "@"];
    if !content.contains(|c: char| c.is_ascii_digit()) {
        // a row of marks stands where numbers did not fit
        return !content.split_whitespace().all(|word| number(word).is_some());
    }
    if marks.iter().any(|mark| content.contains(mark)) {
        return true;
    }
    let separates = |c: char| c.is_whitespace() || matches!(c, ',' | ';' | '"' | '(' | ')' | ':');
    let parts: Vec<&str> = content.split(separates).filter(|w| !w.is_empty()).collect();
    if parts.iter().any(|part| is_date(part) || is_percentage(part)) {
        return true;
    }
    let begins_as_number = content.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
    if content.contains('=') && !begins_as_number {
        return true;
    }
    let words = parts.iter().filter(|part| is_word(part)).count();
    // "M 77", "F1ABCE": no point, no number begins with a letter other than one taken for a digit
    let begins_as_name = content.starts_with(|c: char| c.is_alphabetic() && !"OoIlSZB".contains(c));
    let decimal = content
        .as_bytes()
        .windows(2)
        .any(|pair| (pair[0] == b'.' && pair[1].is_ascii_digit()) || (pair[1] == b'.' && pair[0].is_ascii_digit()));
    if begins_as_name && parts.len() <= 3 && !decimal {
        return true;
    }
    // "e207.dat": a point has two numbers, a name stands alone
    if let [name] = parts[..] {
        let suffix = name.rsplit_once('.').map_or("", |(_, suffix)| suffix);
        if begins_as_name || (suffix.len() >= 2 && suffix.chars().all(|c| c.is_ascii_alphabetic())) {
            return true;
        }
    }
    match words {
        0 => false,
        // "12 May", "lower 51", but not "0.05 nought"
        1 => {
            let first = parts.first().copied().unwrap_or("");
            is_word(first) || number(first).is_some_and(|field| field.whole)
        }
        _ => true,
    }
}

/// A word of two letters or more, whatever follows ("NACA2412").
fn is_word(part: &str) -> bool {
    let part = part.trim_start_matches(['*', '-', '_', '<', '[', '{', '\'', '.']);
    let letters = part.chars().take_while(|c| c.is_alphabetic()).count();
    letters >= 2 && number(part).is_none()
}

/// `28/12/2005`
fn is_date(part: &str) -> bool {
    let numbers: Vec<&str> = part.split('/').collect();
    numbers.len() == 3 && numbers.iter().all(|n| (1..=5).contains(&n.len()) && n.bytes().all(|b| b.is_ascii_digit()))
}

/// `8.5%`
fn is_percentage(part: &str) -> bool {
    part.split('_').all(|p| p.strip_suffix('%').is_some_and(|p| number(p).is_some()))
}

/// Whether a line heads the columns of a table: `x y`, `"x/c","y/c"`, `X (mm); Y (mm); Z (mm)`.
pub(super) fn heads_columns(line: &str) -> bool {
    let (text, _) = plain(line);
    let separates = |c: char| c.is_whitespace() || matches!(c, ',' | ';' | '"' | '\'' | '|');
    let lower = text.to_lowercase();
    let names: Vec<&str> = lower
        .split(separates)
        .filter(|w| !w.is_empty() && !matches!(*w, "(mm)" | "[mm]" | "(m)" | "[m]" | "(-)" | "[-]" | "mm" | "m"))
        .collect();
    // "x", "xu", "x/c", "x(mm)"
    let short = |name: &str| {
        let rest: Vec<char> = name.chars().skip(1).collect();
        rest.len() <= 1 || (rest.len() <= 5 && "/_([.:0123456789".contains(rest[0]))
    };
    let named = |letter: char| names.iter().any(|name| name.starts_with(letter) && short(name));
    let known = |name: &&str| {
        (name.starts_with(['x', 'y', 'z', 'n', 'i', 'p', '#']) && short(name))
            || is_side(name)
            || ["index", "point", "coord", "coords", "coordinate", "coordinates", "value", "no."].contains(name)
    };
    // the first line of a CSV file may name the separator
    lower.trim().starts_with("sep=")
        || named('x') && (named('y') || named('z') || names.iter().any(|name| is_side(name))) && names.iter().all(known)
}

/// Whether a column has the name of a side: `upper`, `y_lower`, `y-upper/c`.
fn is_side(name: &str) -> bool {
    let name = name.trim_start_matches('y').trim_start_matches(['_', '-', '/', '(', '.']);
    let rest = ["upper", "lower", "top", "bottom"].into_iter().find_map(|side| name.strip_prefix(side));
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(['_', '-', '/', ')', '(']))
}

/// Whether a line heads the points of a camber line or of a chord, which are no part of the outline.
pub(super) fn heads_mean_line(line: &str) -> bool {
    let heading = heading(line);
    ["camber line", "camberline", "mean line", "mean camber line", "chord line"].contains(&heading.as_str())
}

/// Whether a line heads the points of the outline among other blocks of points.
pub(super) fn heads_surface(line: &str) -> bool {
    ["airfoil surface", "aerofoil surface"].contains(&heading(line).as_str())
}

/// The words of a heading in small letters, without the separators of a table.
fn heading(line: &str) -> String {
    let (text, _) = plain(line);
    text.to_lowercase().trim_matches(|c: char| c.is_whitespace() || ",;:\"".contains(c)).into()
}

/// The number that counts points in a line such as `51 Num Pnts Upper` or `400 NumCoords`.
pub(super) fn labelled_count(line: &str) -> Option<usize> {
    let (text, _) = plain(line);
    let lower = text[..comment_start(&text)].to_lowercase();
    let (first, rest) = lower.trim().split_once(char::is_whitespace)?;
    let count: usize = first.trim_end_matches('.').parse().ok()?;
    let labels = ["numcoord", "num pnts", "num pts", "points", "pnts", "coordinates", "upper", "lower", "nodes"];
    labels.iter().any(|label| rest.contains(label)).then_some(count)
}

/// Whether a line is the switch for symmetry of an OpenVSP file, and whether it is on.
pub(super) fn symmetry_flag(line: &str) -> Option<bool> {
    let lower = line.to_lowercase();
    let (first, rest) = lower.trim().split_once(char::is_whitespace)?;
    rest.contains("sym flag").then_some(first != "0")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kind(line: &str) -> Line {
        classify(line, Style::default())
    }

    #[test]
    fn sentences_are_words() {
        for line in [
            "lower surface",
            "by hand, 12 May 2001",
            "28/12/2005 1.0 2.0",
            "28/12/2005    1.000733  -->1.0",
            "0.00000     0.00102 -> 0.00001     0.00102",
            "Profildicke(d):\t30.62\t%",
            "p= 10.5 a0= -2.1 Cm0 -0.05",
            "8%_1.8%  http://example.org/",
            "(15%)",
            "0.038 camber instead of 0.05",
            "20 nov 2005",
            "Element 2",
            "NACA2412",
            "e207.dat",
            "S2091.dat",
            "2412.txt",
            "a18.v2",
            "===========",
            "x y",
        ] {
            assert_eq!(kind(line), Line::Words, "{line}");
        }
    }

    #[test]
    fn damaged_data_are_no_words() {
        for line in [
            "0.O5000 0.03550",
            "0.05000 0.O3550",
            "O.05000 0.03550",
            "0.05 abc",
            "0.05000 - 0.03550",
            "0.05:0.03550",
            "x=0.05",
            "0.05=0.0355",
            "1.000000.00126",
            "0.0000     ......",
            "1.0000     (-0.0022)",
            "0.05 0,035 5x",
            "l.0 0.0",
        ] {
            let found = kind(line);
            assert!(matches!(found, Line::Damaged(_)) || line == "x=0.05", "{line}: {found:?}");
        }
        assert!(matches!(kind("******** *********"), Line::Numbers(..)));
        assert!(matches!(kind("0.05 # 0.03"), Line::Numbers(fields, _) if fields.len() == 1));
        assert_eq!([kind("  "), kind(" ,, "), kind("! x y")], [Line::Blank, Line::Blank, Line::Comment]);
    }

    #[test]
    fn headings_of_columns_and_counts() {
        for line in [
            "sep=;",
            "X Coordinate,Y Coordinate",
            "x y",
            "\"x/c\",\"y/c\"",
            "X (mm); Y (mm); Z (mm)",
            "x,y,z",
            "i x y",
            "X/C Y/C",
            "xu yu",
            "x upper lower",
            "x/c; y_upper; y_lower",
        ] {
            assert!(heads_columns(line), "{line}");
        }
        for line in ["lower surface", "x upper side of mine", "NACA 2412", "x-wing yawed", "extra 300", "clark y"] {
            assert!(!heads_columns(line), "{line}");
        }
        assert_eq!(labelled_count("51\tNum Pnts Upper"), Some(51));
        assert_eq!(labelled_count("   400   NumCoords   ! The number of coordinates"), Some(400));
        assert_eq!(labelled_count("2412 airfoil"), None);
        assert_eq!(symmetry_flag("0\tSym Flag (0 - No, 1 - Yes)"), Some(false));
    }
}
