//! Tables of reference data, with their sources in their comments.

use crate::Failure;
use std::str::FromStr;

/// Rows of a table of comma-separated values.
pub struct Reference {
    columns: Vec<&'static str>,
    rows: Vec<Vec<&'static str>>,
}

/// One row with its columns.
#[derive(Clone, Copy)]
pub struct Row<'a> {
    columns: &'a [&'static str],
    cells: &'a [&'static str],
}

impl Reference {
    /// Lines that begin with `#` are comments; the first other names the columns.
    pub fn new(text: &'static str) -> Self {
        let mut lines = text.lines().filter(|line| !line.starts_with('#') && !line.is_empty());
        let split = |line: &'static str| line.split(',').collect();
        Self { columns: lines.next().map(split).unwrap_or_default(), rows: lines.map(split).collect() }
    }

    pub fn rows(&self) -> impl Iterator<Item = Row<'_>> {
        self.rows.iter().map(|cells| Row { columns: &self.columns, cells })
    }
}

impl Row<'_> {
    /// The text in a column.
    pub fn text(&self, column: &str) -> Result<&'static str, Failure> {
        let cell = self.columns.iter().position(|c| *c == column).and_then(|k| self.cells.get(k));
        Ok(*cell.ok_or_else(|| format!("reference data: no column {column} in {:?}", self.cells))?)
    }

    /// The number in a column; `None` where it is empty.
    pub fn number(&self, column: &str) -> Result<Option<f64>, Failure> {
        let text = self.text(column)?;
        if text.is_empty() { Ok(None) } else { Ok(Some(f64::from_str(text)?)) }
    }

    /// The number in a column that has to have one.
    pub fn required(&self, column: &str) -> Result<f64, Failure> {
        Ok(self.number(column)?.ok_or_else(|| format!("reference data: {column} is empty in {:?}", self.cells))?)
    }

    /// Trips on both sides: a place or `free`.
    pub fn trips(&self) -> Result<[Option<f64>; 2], Failure> {
        let trip = if self.text("xtrip")? == "free" { None } else { self.number("xtrip")? };
        Ok([trip; 2])
    }
}
