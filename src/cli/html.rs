//! `report.html`: one page that shows a run, without anything from the network.

use crate::report::json::{ConstraintReport, RunReport};
use std::fmt::Write;

/// The content of the page.
pub(super) struct Page<'a> {
    /// The content of `result.json`.
    pub result: &'a RunReport,
    /// The command that runs the case again.
    pub command: String,
    /// The case file.
    pub case: &'a str,
    /// Headings and SVG figures.
    pub figures: Vec<(String, String)>,
    /// Tables that stand between the values and the design variables.
    pub tables: Vec<HtmlTable>,
}

/// A table of the page.
pub(super) struct HtmlTable {
    pub heading: &'static str,
    pub columns: Vec<&'static str>,
    pub rows: Vec<Vec<String>>,
}

const STYLE: &str = "body{font:15px/1.5 sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;color:#222}\
h1{font-size:1.5em}h2{font-size:1.15em;margin-top:2em}table{border-collapse:collapse;margin:.6em 0}\
td,th{padding:.15em .8em;border-bottom:1px solid #ddd;text-align:right;font-variant-numeric:tabular-nums}\
td:first-child,th:first-child{text-align:left}svg{width:100%;height:auto}pre{background:#f5f5f5;padding:.8em;overflow:auto}\
figure{margin:0}.held{font-weight:bold}";

/// Text as HTML shows it.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

fn number(value: Option<f64>) -> String {
    match value {
        Some(0.0) => "0".into(),
        Some(v) if v.is_finite() => format!("{v:.7e}"),
        _ => "–".into(),
    }
}

fn table(text: &mut String, HtmlTable { heading, columns, rows }: &HtmlTable) {
    let _ = write!(text, "<h2>{}</h2><table><tr>", escaped(heading));
    columns.iter().for_each(|c| {
        let _ = write!(text, "<th>{}</th>", escaped(c));
    });
    text.push_str("</tr>");
    for row in rows {
        text.push_str("<tr>");
        row.iter().for_each(|c| {
            let _ = write!(text, "<td>{}</td>", escaped(c));
        });
        text.push_str("</tr>");
    }
    text.push_str("</table>\n");
}

/// An SVG document as a part of the page.
fn inline(svg: &str) -> &str {
    svg.find("<svg").map_or(svg, |at| &svg[at..])
}

impl Page<'_> {
    /// The page as HTML.
    pub fn render(&self) -> String {
        let result = self.result;
        let mut text = format!(
            "<!DOCTYPE html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}: {1}</title><style>{STYLE}</style></head><body>\n\
             <h1>{0}: {1}</h1><p>{2}</p><p>Run again: <code>{3}</code></p>\n",
            escaped(&result.case),
            escaped(result.status.as_str()),
            escaped(&result.message),
            escaped(&self.command)
        );
        table(&mut text, &overview(result));
        for (heading, svg) in &self.figures {
            let _ = writeln!(text, "<h2>{}</h2><figure>{}</figure>", escaped(heading), inline(svg));
        }
        if let Some(constraints) = constraints(result) {
            table(&mut text, &constraints);
        }
        let rows = result.values.iter().map(|(name, v)| vec![name.to_string(), number(*v)]).collect();
        table(&mut text, &HtmlTable { heading: "Values", columns: vec!["value", "at the end"], rows });
        self.tables.iter().for_each(|further| table(&mut text, further));
        let rows = result.variables.iter().map(|(name, v)| vec![name.to_string(), number(Some(*v))]).collect();
        table(&mut text, &HtmlTable { heading: "Design variables", columns: vec!["variable", "at the end"], rows });
        let _ = writeln!(text, "<h2>Case file</h2><pre>{}</pre></body></html>", escaped(self.case));
        text
    }
}

fn overview(result: &RunReport) -> HtmlTable {
    let rows = [
        ("optimizer", result.optimizer.to_string()),
        ("iterations", result.iterations.to_string()),
        ("evaluations", result.evaluations.to_string()),
        ("failed evaluations", result.failed_evaluations.to_string()),
        ("seconds", number(Some(result.seconds))),
        ("objective", number(result.objective)),
        ("kkt residual", number(Some(result.kkt_residual))),
    ];
    let rows = rows.into_iter().map(|(name, value)| vec![name.to_string(), value]).collect();
    HtmlTable { heading: "Run", columns: vec!["", ""], rows }
}

/// All constraints, those that hold the design first; `None` without constraints.
fn constraints(result: &RunReport) -> Option<HtmlTable> {
    let mut entries: Vec<(&str, &ConstraintReport)> = result.constraints.iter().collect();
    let pull = |c: &ConstraintReport| c.multiplier.map_or(0.0, f64::abs);
    entries.sort_by(|(_, a), (_, b)| pull(b).total_cmp(&pull(a)));
    let row = |(name, c): &(&str, &ConstraintReport)| {
        let cells = [c.value, c.lower, c.upper, c.violation, c.multiplier].map(number);
        std::iter::once(name.to_string()).chain(cells).collect()
    };
    (!entries.is_empty()).then(|| HtmlTable {
        heading: "Constraints (multiplier: change of the objective per unit of the bound)",
        columns: vec!["constraint", "value", "lower bound", "upper bound", "violation", "multiplier"],
        rows: entries.iter().map(row).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimize::Termination;
    use crate::report::json::Named;

    #[test]
    fn a_page_is_complete_and_harmless() {
        let area = ConstraintReport {
            value: Some(0.1),
            lower: Some(0.1),
            upper: None,
            violation: Some(0.0),
            multiplier: Some(2.0),
        };
        let result = RunReport {
            case: "a<b".into(),
            optimizer: "slsqp",
            status: Termination::Converged,
            message: "fine & done".into(),
            evaluations: 4,
            failed_evaluations: 0,
            iterations: 3,
            seconds: 0.5,
            objective: None,
            values: Named::new(["cd"], [Some(0.007)]),
            constraints: Named::new(["area"], [area]),
            kkt_residual: f64::NAN,
            variables: Named::new(["dx[0,0]"], [0.25]),
            min_fold_indicator: None,
            folded: None,
            self_intersecting: false,
        };
        let page = Page {
            result: &result,
            command: "aeroform run a".into(),
            case: "name = \"a<b\"",
            figures: vec![("Start".into(), "<?xml version=\"1.0\"?><svg></svg>".into())],
            tables: vec![HtmlTable { heading: "Timing", columns: vec!["what"], rows: vec![vec!["flow".into()]] }],
        };
        let html = page.render();
        for part in ["a&lt;b", "fine &amp; done", "<svg></svg>", "1.0000000e-1", "Timing", "–", "7.0000000e-3"] {
            assert!(html.contains(part), "{part}");
        }
        assert!(!html.contains("<?xml") && !html.contains("http") && html.ends_with("</html>\n"));
    }
}
