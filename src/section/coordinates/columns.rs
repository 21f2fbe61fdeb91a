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

/// The two columns of a table that are coordinates: what is left when constant columns and a column that counts the
/// rows are taken away.
pub(super) fn coordinates(rows: &[Row], width: usize) -> Result<([usize; 2], Vec<Repair>), CoordinateError> {
    let Some(first) = rows.first().filter(|_| width > 2) else { return Ok(([0, 1], Vec::new())) };
    let column = |c: usize| rows.iter().filter_map(move |row| row.fields.get(c).map(|field| field.value));
    let constant = |c: usize| rows.len() > 2 && column(c).all(|value| value == first.fields[c].value);
    let counts = |c: usize| {
        // surfaces may each be counted from the first number on
        let steps = column(c).zip(column(c).skip(1)).all(|(a, b)| b == a + 1.0 || b == first.fields[c].value);
        rows.len() > 2 && steps && first.fields[c].whole && !constant(c)
    };
    let mut kept: Vec<usize> = (0..width).collect();
    let mut repairs = Vec::new();
    if counts(0) {
        kept.remove(0);
        repairs.push(Repair::IndexDropped);
    }
    // a coordinate may be constant by chance only where more than one column is
    while let Some(at) = kept.iter().rposition(|&c| kept.len() > 2 && constant(c)) {
        let c = kept.remove(at);
        repairs.push(Repair::PlaneFound { column: c + 1, value: first.fields[c].value });
    }
    match kept[..] {
        [x, y] => Ok(([x, y], repairs)),
        _ => Err(CoordinateError::Columns { line: first.line, found: width }),
    }
}
