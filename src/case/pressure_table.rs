//! Files of pressures along the chord: x and Cp, from the trailing edge over the upper side to the nose and back.

/// A fault of a file, with the line from 1 where one is meant.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct TableError {
    pub line: Option<usize>,
    pub message: String,
}

/// Points x (in chords, growing) and Cp of the upper and the lower side.
pub(super) type Sides = [Vec<[f64; 2]>; 2];

/// Where the numbers of a row stand.
enum Columns {
    /// Place and pressure, around the section.
    Around { x: usize, cp: usize },
    /// Place, and the pressures of the upper and the lower side there.
    BothSides { x: usize, upper: usize, lower: usize },
}

/// Places beyond these, in chords, are no places on the chord.
const CHORD: std::ops::RangeInclusive<f64> = -0.05..=1.05;

/// Reads a table. A header names the columns (`x` or `x/c`, and `cp`, or `cp_upper` and `cp_lower`); without one, two
/// columns are x and Cp, and three are x, y and Cp. Lines that begin with `#`, `!` or `%` are comments or headers.
pub(super) fn read(text: &str) -> Result<Sides, TableError> {
    let mut columns = None;
    let mut rows: Vec<(usize, Vec<f64>)> = Vec::new();
    for (k, line) in text.lines().enumerate() {
        let bare = line.trim().trim_start_matches(['#', '!', '%', '\u{feff}']);
        let words: Vec<&str> = bare.split([' ', '\t', ',', ';']).filter(|word| !word.is_empty()).collect();
        let numbers: Option<Vec<f64>> = words.iter().map(|word| word.parse().ok()).collect();
        match numbers {
            _ if words.is_empty() => {}
            Some(numbers) if bare.len() == line.trim().len() => rows.push((k + 1, numbers)),
            _ if rows.is_empty() => columns = header(&words).or(columns),
            _ if bare.len() < line.trim().len() => {}
            _ => return Err(at(k + 1, format!("{:?} is no row of numbers", line.trim()))),
        }
    }
    let count = rows.first().map_or(0, |(_, row)| row.len());
    let columns = match (columns, count) {
        (Some(columns), _) => columns,
        (None, 2) => Columns::Around { x: 0, cp: 1 },
        (None, 3) => Columns::Around { x: 0, cp: 2 },
        (None, 0) => return Err(TableError { line: None, message: "has no rows of numbers".into() }),
        (None, _) => {
            let message = format!("{count} columns need a header that names x and cp");
            return Err(at(rows[0].0, message));
        }
    };
    sides(&columns, &rows)
}

fn at(line: usize, message: String) -> TableError {
    TableError { line: Some(line), message }
}

fn header(words: &[&str]) -> Option<Columns> {
    let names: Vec<String> = words.iter().map(|word| word.trim_matches('"').to_lowercase()).collect();
    let find = |known: &[&str]| names.iter().position(|name| known.contains(&name.as_str()));
    let x = find(&["x", "x/c"])?;
    match (find(&["cp"]), find(&["cp_upper", "upper"]), find(&["cp_lower", "lower"])) {
        (_, Some(upper), Some(lower)) => Some(Columns::BothSides { x, upper, lower }),
        (Some(cp), ..) => Some(Columns::Around { x, cp }),
        _ => None,
    }
}

fn sides(columns: &Columns, rows: &[(usize, Vec<f64>)]) -> Result<Sides, TableError> {
    let pick = |line: usize, row: &[f64], column: usize| match row.get(column) {
        Some(value) if value.is_finite() => Ok(*value),
        Some(value) => Err(at(line, format!("{value} is not finite"))),
        None => Err(at(line, format!("column {} is missing", column + 1))),
    };
    let place = |line: usize, row: &[f64], column: usize| match pick(line, row, column)? {
        x if CHORD.contains(&x) => Ok(x),
        x => Err(at(line, format!("x = {x} is not on the chord; places are in chords, from 0 at the nose to 1"))),
    };
    match *columns {
        Columns::BothSides { x, upper, lower } => {
            let mut result = Sides::default();
            for (line, row) in rows {
                let x = place(*line, row, x)?;
                result[0].push([x, pick(*line, row, upper)?]);
                result[1].push([x, pick(*line, row, lower)?]);
            }
            for pair in rows.windows(2) {
                if pair[1].1[x] <= pair[0].1[x] {
                    return Err(at(pair[1].0, "x must grow from row to row".into()));
                }
            }
            Ok(result.map(on_the_chord))
        }
        Columns::Around { x, cp } => {
            let mut points: Vec<(usize, [f64; 2])> = Vec::new();
            for (line, row) in rows {
                points.push((*line, [place(*line, row, x)?, pick(*line, row, cp)?]));
            }
            around(&points)
        }
    }
}

/// The two sides of points around the section.
fn around(points: &[(usize, [f64; 2])]) -> Result<Sides, TableError> {
    let nose = (0..points.len()).min_by(|&a, &b| points[a].1[0].total_cmp(&points[b].1[0])).unwrap_or(0);
    let (upper, lower) = (&points[..=nose], &points[nose..]);
    let turned = |pair: &[(usize, [f64; 2])], falls: bool| {
        let [(_, a), (line, b)] = pair else { return None };
        let wrong = if falls { b[0] > a[0] } else { b[0] < a[0] };
        wrong.then_some(*line)
    };
    let wrong = upper.windows(2).find_map(|pair| turned(pair, true));
    if let Some(line) = wrong.or(lower.windows(2).find_map(|pair| turned(pair, false))) {
        let message = "x turns here: rows run from the trailing edge over the upper side to the nose, and back along the lower side";
        return Err(at(line, message.into()));
    }
    if upper.len() < 2 || lower.len() < 2 {
        let message = "has one side only: give its points as `upper` or `lower` of [pressure_target]";
        return Err(TableError { line: None, message: message.into() });
    }
    let upper = upper.iter().rev().map(|(_, point)| *point).collect();
    Ok([upper, lower.iter().map(|(_, point)| *point).collect()].map(on_the_chord))
}

/// The points with places that grow from 0 or more: of equal places the first is kept.
pub(super) fn on_the_chord(points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let mut kept: Vec<[f64; 2]> = Vec::with_capacity(points.len());
    for point in points.into_iter().filter(|point| point[0] >= 0.0) {
        if kept.last().is_none_or(|last| point[0] > last[0]) {
            kept.push(point);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn common_forms_are_read() {
        let expected: Sides = [vec![[0.0, 1.0], [0.5, -0.6], [1.0, 0.2]], vec![[0.0, 1.0], [0.4, -0.1], [1.0, 0.1]]];
        for text in [
            "1 0.2\n0.5 -0.6\n0 1\n0.4 -0.1\n1 0.1\n",
            "NACA 2412\n# x y Cp\n1,0,0.2\n0.5,0.06,-0.6\n0,0,1\n\n0.4,-0.04,-0.1\n1,0,0.1\n",
            "#    x        Cp\n 1.0 0.2\n 0.5 -0.6\n 0.0 1.0\n 0.4 -0.1\n 1.0 0.1\n",
            "cp x/c\n0.2 1\n-0.6 0.5\n1 0\n-0.1 0.4\n0.1 1",
        ] {
            assert_eq!(read(text).unwrap(), expected, "{text}");
        }
        let both = "x, cp_upper, cp_lower\n0, 1, 1\n0.5, -0.6, -0.1\n1, 0.2, 0.1\n";
        assert_eq!(read(both).unwrap()[1], [[0.0, 1.0], [0.5, -0.1], [1.0, 0.1]]);
    }

    #[test]
    fn faults_are_named_with_their_line() {
        for (text, line, word) in [
            ("1 0.2\n0.5 x\n", Some(2), "no row of numbers"),
            ("1 0\n0.5 0\n0.7 0\n0 1\n0.5 0\n", Some(3), "turns"),
            ("1 0 0 0\n", Some(1), "header"),
            ("100 0\n50 0\n0 1\n50 0\n", Some(1), "chords"),
            ("0 1\n0.5 0\n1 0\n", None, "one side"),
            ("nothing\n", None, "no rows"),
            ("1 0.2\n0.5\n0 1\n1 0\n", Some(2), "missing"),
            ("1 0.2\n0.5 inf\n0 1\n1 0\n", Some(2), "finite"),
            ("x cp_upper cp_lower\n0 1 1\n0.5 0 0\n0.4 0 0\n", Some(4), "grow"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.line == line && error.message.contains(word), "{text:?}: {error:?}");
        }
    }
}
