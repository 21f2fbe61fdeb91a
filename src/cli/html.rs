//! `report.html`: one page that shows a run, without anything from the network.

use serde_json::Value;
use std::fmt::Write;

/// What the page shows.
pub(super) struct Page<'a> {
    /// The content of `result.json`.
    pub result: &'a Value,
    /// How to run it again.
    pub command: String,
    /// The case file.
    pub case: &'a str,
    /// Headings and SVG figures.
    pub figures: Vec<(String, String)>,
    /// Further tables: heading, columns, rows.
    pub tables: Vec<(String, Vec<String>, Vec<Vec<String>>)>,
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

fn number(value: &Value) -> String {
    match value.as_f64() {
        Some(0.0) => "0".into(),
        Some(v) => format!("{v:.7e}"),
        None => "–".into(),
    }
}

fn table(text: &mut String, heading: &str, columns: &[String], rows: &[Vec<String>]) {
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
    /// The page.
    pub fn render(&self) -> String {
        let result = self.result;
        let word = |key: &str| escaped(result[key].as_str().unwrap_or("–"));
        let mut text = format!(
            "<!DOCTYPE html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}: {1}</title><style>{STYLE}</style></head><body>\n\
             <h1>{0}: {1}</h1><p>{2}</p><p>Run again: <code>{3}</code></p>\n",
            word("case"),
            word("status"),
            word("message"),
            escaped(&self.command)
        );
        let summary =
            ["optimizer", "iterations", "evaluations", "failed_evaluations", "seconds", "objective", "kkt_residual"];
        let shown = |key: &&str| {
            let value = &result[*key];
            let shown = match value {
                Value::Number(n) if n.is_u64() => n.to_string(),
                Value::String(text) => text.clone(),
                _ => number(value),
            };
            vec![key.replace('_', " "), shown]
        };
        let rows: Vec<Vec<String>> = summary.iter().map(shown).collect();
        table(&mut text, "Run", &["".into(), "".into()], &rows);
        for (heading, svg) in &self.figures {
            let _ = writeln!(text, "<h2>{}</h2><figure>{}</figure>", escaped(heading), inline(svg));
        }
        self.constraints(&mut text);
        let values = result["values"].as_object().into_iter().flatten();
        let rows: Vec<Vec<String>> = values.map(|(name, v)| vec![name.clone(), number(v)]).collect();
        table(&mut text, "Values", &["value".into(), "at the end".into()], &rows);
        for (heading, columns, rows) in &self.tables {
            table(&mut text, heading, columns, rows);
        }
        let variables = result["variables"].as_object().into_iter().flatten();
        let rows: Vec<Vec<String>> = variables.map(|(name, v)| vec![name.clone(), number(v)]).collect();
        table(&mut text, "Design variables", &["variable".into(), "at the end".into()], &rows);
        let _ = writeln!(text, "<h2>Case file</h2><pre>{}</pre></body></html>", escaped(self.case));
        text
    }

    /// All constraints, those that hold the design first.
    fn constraints(&self, text: &mut String) {
        let entries = self.result["constraints"].as_object().into_iter().flatten();
        let mut rows: Vec<(f64, Vec<String>)> = entries
            .map(|(name, c)| {
                let multiplier = c["multiplier"].as_f64().unwrap_or(0.0);
                let keys = ["value", "lower", "upper", "violation", "multiplier"];
                let cells = std::iter::once(name.clone()).chain(keys.iter().map(|k| number(&c[*k])));
                (multiplier.abs(), cells.collect())
            })
            .collect();
        if rows.is_empty() {
            return;
        }
        rows.sort_by(|a, b| b.0.total_cmp(&a.0));
        let columns =
            ["constraint", "value", "lower bound", "upper bound", "violation", "multiplier"].map(String::from);
        let rows: Vec<Vec<String>> = rows.into_iter().map(|(_, row)| row).collect();
        table(text, "Constraints (multiplier: change of the objective per unit of the bound)", &columns, &rows);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_page_is_complete_and_harmless() {
        let result = json!({
            "case": "a<b", "status": "converged", "message": "fine & done", "iterations": 3, "seconds": 0.5,
            "constraints": { "area": { "value": 0.1, "lower": 0.1, "upper": null, "violation": 0.0, "multiplier": 2.0 } },
            "values": { "cd": 0.007 }, "variables": { "dx[0,0]": null },
        });
        let page = Page {
            result: &result,
            command: "aeroform run a".into(),
            case: "name = \"a<b\"",
            figures: vec![("Start".into(), "<?xml version=\"1.0\"?><svg></svg>".into())],
            tables: vec![("Timing".into(), vec!["what".into()], vec![vec!["flow".into()]])],
        };
        let html = page.render();
        for part in ["a&lt;b", "fine &amp; done", "<svg></svg>", "1.0000000e-1", "Timing", "–", "7.0000000e-3"] {
            assert!(html.contains(part), "{part}");
        }
        assert!(!html.contains("<?xml") && !html.contains("http") && html.ends_with("</html>\n"));
    }
}
