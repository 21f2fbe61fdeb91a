//! Plain-text tables and JSON numbers.

use std::fmt;

/// On which side of its column a text stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    /// The left side, for words.
    Left,
    /// The right side, for numbers.
    Right,
}

/// A table of aligned columns for a terminal.
///
/// ```
/// use aeroform::report::{Align, Table};
/// let mut table = Table::new([("variable", Align::Left), ("value", Align::Right)]);
/// table.row(["thickness", "0.12"]);
/// table.row(["α", "-4"]);
/// assert_eq!(table.to_string(), "\
/// variable   value
/// ---------  -----
/// thickness   0.12
/// α             -4
/// ");
/// ```
#[derive(Debug, Clone)]
pub struct Table {
    header: Vec<(String, Align)>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table with these columns.
    pub fn new<N: Into<String>>(columns: impl IntoIterator<Item = (N, Align)>) -> Self {
        Self { header: columns.into_iter().map(|(name, align)| (name.into(), align)).collect(), rows: Vec::new() }
    }

    /// Adds a row. Missing cells are empty, cells beyond the last column are dropped; control characters become spaces.
    pub fn row<C: Into<String>>(&mut self, cells: impl IntoIterator<Item = C>) {
        let clean = |cell: C| -> String { cell.into().chars().map(|c| if c.is_control() { ' ' } else { c }).collect() };
        let mut cells: Vec<String> = cells.into_iter().take(self.header.len()).map(clean).collect();
        cells.resize(self.header.len(), String::new());
        self.rows.push(cells);
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let length = |text: &str| text.chars().count();
        let mut widths: Vec<usize> = self.header.iter().map(|(name, _)| length(name)).collect();
        for row in &self.rows {
            widths.iter_mut().zip(row).for_each(|(width, cell)| *width = (*width).max(length(cell)));
        }
        let line = |cells: &mut dyn Iterator<Item = &str>| {
            let aligned = cells.zip(&self.header).zip(&widths).map(|((cell, &(_, align)), &width)| match align {
                Align::Left => format!("{cell:<width$}"),
                Align::Right => format!("{cell:>width$}"),
            });
            aligned.collect::<Vec<_>>().join("  ").trim_end().to_owned()
        };
        let rules: Vec<String> = widths.iter().map(|&width| "-".repeat(width)).collect();
        writeln!(f, "{}", line(&mut self.header.iter().map(|(name, _)| name.as_str())))?;
        writeln!(f, "{}", line(&mut rules.iter().map(String::as_str)))?;
        for row in &self.rows {
            writeln!(f, "{}", line(&mut row.iter().map(String::as_str)))?;
        }
        Ok(())
    }
}

/// A JSON number with all digits of `value`; `null` where it is infinite or NaN, which JSON has no number for.
///
/// ```
/// use aeroform::report::number;
/// assert_eq!(serde_json::json!({"cl": number(0.1), "cd": number(f64::NAN)}).to_string(), r#"{"cl":0.1,"cd":null}"#);
/// ```
pub fn number(value: f64) -> serde_json::Value {
    serde_json::Number::from_f64(value).map_or(serde_json::Value::Null, serde_json::Value::Number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_aligned() {
        let mut table = Table::new([("α", Align::Right), ("what", Align::Left), ("cl", Align::Right)]);
        table.row(["1.25", "a\nb", "0.5"]);
        table.row(["-10", "longer", "1", "too many"]);
        table.row(["0"]);
        let expected = "   α  what     cl\n----  ------  ---\n1.25  a b     0.5\n -10  longer    1\n   0\n";
        assert_eq!(table.to_string(), expected);
    }

    #[test]
    fn numbers_keep_their_digits() {
        for value in [0.1, -0.0, 1.0 / 3.0, 5e-324, f64::MAX, 1e22] {
            let text = number(value).to_string();
            assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits(), "{text}");
        }
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(number(value).is_null());
        }
    }
}
