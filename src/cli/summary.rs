//! A run in the terminal.

use super::message::{item, paragraph};
use super::overview::{Overview, Row, Tone};
use crate::report::json::RunReport;
use crate::report::{Align, OutputDirectory, Table, engineering};

/// The text that `aeroform run` prints at its end.
pub(super) fn text(result: &RunReport, overview: &Overview, directory: &OutputDirectory) -> String {
    let mut text = format!(
        "{}: {} by {} in {} iterations, {} evaluations, {} s\n",
        result.case,
        result.status,
        result.optimizer,
        result.iterations,
        result.evaluations,
        engineering(result.seconds, 3)
    );
    let [start, end, change] = &overview.headline;
    let change = if change.is_empty() { String::new() } else { format!(" ({change})") };
    if result.objective.is_some() || result.initial_objective.is_some() {
        text += &format!("{}: {start} → {end}{change}\n", overview.objective);
    }
    overview.conditions.iter().for_each(|condition| text += &format!("at {condition}\n"));
    text.push('\n');
    text += &paragraph(&result.message);
    text += &format!("\n\n{}\n", table(&overview.rows));
    if overview.holds.is_empty() && result.objective.is_none() {
        text += "there is no design\n";
    } else if overview.holds.is_empty() {
        text += "nothing holds the design: no constraint and no bound of a variable is reached\n";
    } else {
        text += "held by\n";
        overview.holds.iter().for_each(|hold| text += &(item(hold) + "\n"));
    }
    text += "checks\n";
    for check in &overview.checks {
        let mark = match check.tone {
            Tone::Good => "ok",
            Tone::Plain => "--",
            Tone::Warning => "! ",
            Tone::Bad => "!!",
        };
        text += &format!("  {mark}  {}\n", check.text);
    }
    for repair in &result.repairs {
        text += &(paragraph(&format!("repaired: {repair}")) + "\n");
    }
    text + &format!("\nresults in {}\n", directory.path().display())
}

fn table(rows: &[Row]) -> Table {
    let columns = [
        ("quantity", Align::Left),
        ("start", Align::Right),
        ("end", Align::Right),
        ("change", Align::Right),
        ("bound", Align::Left),
        ("", Align::Left),
    ];
    let mut table = Table::new(columns);
    for row in rows {
        table.row([&row.name, &row.start, &row.end, &row.change, &row.bound, &row.role].map(String::as_str));
    }
    table
}
