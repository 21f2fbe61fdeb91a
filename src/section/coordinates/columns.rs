//! Tables with more columns than two: which of them are x and y.

use super::number::Field;
use super::repair::Repair;
use crate::section::CoordinateError;

/// A line of numbers.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Row {
    pub line: usize,
    pub fields: Vec<Field>,
}

/// The number of columns most rows have (at least two); the smaller where two are as frequent.
pub(super) fn usual_width(rows: &[Row]) -> usize {
    let count = |width: usize| rows.iter().filter(|row| row.fields.len() == width).count();
    let mut widths: Vec<usize> = rows.iter().map(|row| row.fields.len()).filter(|&width| width >= 2).collect();
    widths.sort_unstable();
    widths.dedup();
    widths.into_iter().rev().max_by_key(|&width| count(width)).unwrap_or(2)
}

/// The columns of a table that hold the points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Layout {
    /// Columns of x and y: a row is a point.
    Points([usize; 2]),
    /// Columns of x and of the ordinates of the upper and the lower side: a row is a point of both.
    Sides([usize; 3]),
}

/// The layout of a table: what is left when constant columns and a column that counts the rows are taken away.
pub(super) fn layout(rows: &[Row], width: usize) -> Result<(Layout, Vec<Repair>), CoordinateError> {
    let Some(first) = rows.first().filter(|_| width > 2) else { return Ok((Layout::Points([0, 1]), Vec::new())) };
    let column = |c: usize| rows.iter().filter_map(move |row| row.fields.get(c).map(|field| field.value));
    let constant = |c: usize| rows.len() > 2 && column(c).all(|value| value == first.fields[c].value);
    let counts = |c: usize| {
        // surfaces may each be counted from the first number on
        let steps = column(c).zip(column(c).skip(1)).all(|(a, b)| b == a + 1.0 || b == first.fields[c].value);
        rows.len() > 2 && steps && first.fields[c].whole && !constant(c)
    };
    let mut repairs = Vec::new();
    let read_as_sides = |columns: [usize; 3]| Repair::SidesInColumns { columns: columns.map(|c| c + 1) };
    // stations in whole per cents count the rows too
    if width == 3
        && let Some(columns) = sides(rows, [0, 1, 2])
    {
        return Ok((Layout::Sides(columns), vec![read_as_sides(columns)]));
    }
    let mut kept: Vec<usize> = (0..width).collect();
    if let Some(index) = [0, width - 1].into_iter().find(|&c| counts(c)) {
        kept.remove(index);
        repairs.push(Repair::IndexDropped { column: index + 1 });
    }
    // a coordinate may be constant by chance only where more than one column is
    while let Some(at) = kept.iter().rposition(|&c| kept.len() > 2 && constant(c)) {
        let c = kept.remove(at);
        repairs.push(Repair::PlaneFound { column: c + 1, value: first.fields[c].value });
    }
    match kept[..] {
        [x, y] => Ok((Layout::Points([x, y]), repairs)),
        [x, a, b] => match sides(rows, [x, a, b]) {
            Some(columns) => {
                repairs.push(read_as_sides(columns));
                Ok((Layout::Sides(columns), repairs))
            }
            None => Err(CoordinateError::Columns { line: first.line, found: width }),
        },
        _ => Err(CoordinateError::Columns { line: first.line, found: width }),
    }
}

/// Fewest rows of a table of both sides.
const FEWEST: usize = 5;
/// Sections are thinner than this share of their chord.
const THICKEST: f64 = 0.6;

/// The columns of x, upper and lower side, if the first of three columns runs from nose to tail or back and the other
/// two are the ordinates of two sides there: one is above the other throughout, they meet at the nose, and what lies
/// between them is as thin as a section.
fn sides(rows: &[Row], columns: [usize; 3]) -> Option<[usize; 3]> {
    let row = |row: &Row| -> Option<[f64; 3]> {
        let [x, a, b] = columns.map(|c| row.fields.get(c).map(|field| field.value));
        Some([x?, a?, b?])
    };
    let mut table: Vec<[f64; 3]> = rows.iter().map(row).collect::<Option<_>>()?;
    if table.len() < FEWEST {
        return None;
    }
    if table[0][0] > table[table.len() - 1][0] {
        table.reverse();
    }
    let increases = table.windows(2).all(|pair| pair[1][0] > pair[0][0]);
    let chord = table[table.len() - 1][0] - table[0][0];
    let heights = || table.iter().map(|[_, a, b]| a - b);
    let (low, high) = heights().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    let thickest = low.abs().max(high.abs());
    let slack = 1e-3 * thickest;
    let ordered = low >= -slack || high <= slack;
    let at_nose = (table[0][1] - table[0][2]).abs();
    let is_section = increases && ordered && thickest > 0.0 && thickest < THICKEST * chord && at_nose < 0.5 * thickest;
    let [x, a, b] = columns;
    is_section.then_some(if high.abs() >= low.abs() { [x, a, b] } else { [x, b, a] })
}
