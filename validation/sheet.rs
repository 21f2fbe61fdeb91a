//! A table of checks, perhaps with a table of figures that are only reported.

use aeroform::report::{Align, Table};
use std::fmt;

/// One titled table: expected, ours, error, tolerance, verdict.
pub struct Sheet {
    title: String,
    text: String,
    figures: Option<Table>,
    notes: Vec<String>,
    checks: Table,
    rows: usize,
    failures: usize,
}

impl Sheet {
    /// An empty sheet; `text` says what is compared and where the expected values come from.
    pub fn new(title: &str, text: &str) -> Self {
        let columns = [
            ("what", Align::Left),
            ("expected", Align::Right),
            ("ours", Align::Right),
            ("error", Align::Right),
            ("tolerance", Align::Right),
            ("verdict", Align::Left),
        ];
        Self {
            title: title.into(),
            text: text.into(),
            figures: None,
            notes: Vec::new(),
            checks: Table::new(columns),
            rows: 0,
            failures: 0,
        }
    }

    /// A table of figures without verdict, printed above the checks.
    pub fn set_figures(&mut self, figures: Table) {
        self.figures = Some(figures);
    }

    /// Lines printed between the figures and the checks.
    pub fn set_notes(&mut self, notes: Vec<String>) {
        self.notes = notes;
    }

    /// A value that should be `expected` to within `tolerance`, absolute.
    pub fn value(&mut self, what: &str, expected: f64, ours: f64, tolerance: f64) {
        let error = (ours - expected).abs();
        let cells =
            [format!("{expected:.9e}"), format!("{ours:.9e}"), format!("{error:.1e}"), format!("{tolerance:.1e}")];
        // written so that NaN fails
        self.push(what, cells, error <= tolerance);
    }

    /// A value that should be `expected` to within `tolerance` of it, relative.
    pub fn relative(&mut self, what: &str, expected: f64, ours: f64, tolerance: f64) {
        self.value(what, expected, ours, tolerance * expected.abs());
    }

    /// A number that should not exceed `limit`.
    pub fn at_most(&mut self, what: &str, limit: f64, ours: f64) {
        let cells = [format!("<= {limit:.3e}"), format!("{ours:.3e}"), String::new(), String::new()];
        self.push(what, cells, ours <= limit);
    }

    /// A number that should be reached.
    pub fn at_least(&mut self, what: &str, least: f64, ours: f64) {
        let cells = [format!(">= {least:.3e}"), format!("{ours:.3e}"), String::new(), String::new()];
        self.push(what, cells, ours >= least);
    }

    /// A count that should not exceed `limit`; `None` is a count that was never reached.
    pub fn count_at_most(&mut self, what: &str, limit: usize, ours: Option<usize>) {
        let shown = ours.map_or("never".into(), |n| n.to_string());
        let holds = ours.is_some_and(|n| n <= limit);
        self.push(what, [format!("<= {limit}"), shown, String::new(), String::new()], holds);
    }

    /// A count that should be reached.
    pub fn count_at_least(&mut self, what: &str, least: usize, ours: usize) {
        self.push(what, [format!(">= {least}"), ours.to_string(), String::new(), String::new()], ours >= least);
    }

    /// A number whose bar is known to be missed at times: shown against the bar, but no failure.
    pub fn open(&mut self, what: &str, bar: f64, ours: f64) {
        let cells = [format!("<= {bar:.3e}"), format!("{ours:.3e}"), String::new(), String::new()];
        let verdict = if ours <= bar { "ok" } else { "misses" };
        self.checks.row(std::iter::once(what.to_owned()).chain(cells).chain([verdict.to_owned()]));
    }

    /// A statement that should be true or false.
    pub fn statement(&mut self, what: &str, expected: bool, ours: bool) {
        let word = |b: bool| if b { "yes" } else { "no" }.to_owned();
        self.push(what, [word(expected), word(ours), String::new(), String::new()], expected == ours);
    }

    fn push(&mut self, what: &str, cells: [String; 4], holds: bool) {
        self.rows += 1;
        self.failures += usize::from(!holds);
        let verdict = if holds { "ok" } else { "FAILS" };
        self.checks.row(std::iter::once(what.to_owned()).chain(cells).chain([verdict.to_owned()]));
    }

    /// Number of checks.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of checks that fail.
    pub fn failures(&self) -> usize {
        self.failures
    }
}

impl fmt::Display for Sheet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "## {}\n\n{}\n", self.title, self.text)?;
        if let Some(figures) = &self.figures {
            writeln!(f, "{figures}")?;
        }
        for note in &self.notes {
            writeln!(f, "{note}")?;
        }
        if !self.notes.is_empty() {
            writeln!(f)?;
        }
        if self.rows > 0 { write!(f, "{}", self.checks) } else { Ok(()) }
    }
}
