//! `report.html`: one page that shows a run, without anything from the network.

use super::overview::{Overview, Row, Tone};
use crate::optimize::Termination;
use crate::report::engineering;
use crate::report::json::{BoundsReport, RunReport};
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// The content of the page.
pub(super) struct Page<'a> {
    /// The content of `result.json`.
    pub result: &'a RunReport,
    /// The verdict at the top of the page.
    pub overview: &'a Overview,
    /// The command that runs the case again.
    pub command: String,
    /// One sentence on the case, or empty.
    pub description: &'a str,
    /// The case file.
    pub case: &'a str,
    /// Bounds of the variables, in their order.
    pub bounds: Vec<BoundsReport>,
    /// Headings and SVG figures.
    pub figures: Vec<(String, String)>,
    /// Tables that stand between the figures and the design variables.
    pub tables: Vec<HtmlTable>,
}

/// A table of the page.
pub(super) struct HtmlTable {
    pub heading: &'static str,
    pub columns: Vec<&'static str>,
    pub rows: Vec<Vec<String>>,
}

const STYLE: &str = "\
body{font:15px/1.5 sans-serif;max-width:1000px;margin:1.5em auto;padding:0 1em;color:#222}\
h1{font-size:1.35em;margin:0 0 .2em}h2{font-size:1.15em;margin:2em 0 .4em}\
.verdict{border:1px solid #d5d5d5;border-radius:8px;padding:1em 1.4em;background:#fafafa}\
.about{color:#555;margin:.2em 0}.headline{font-size:2.1em;line-height:1.2;margin:.35em 0}\
.headline b{color:#0b5}.headline b.worse{color:#b00}.headline small{font-size:.5em;color:#555}\
.columns{display:flex;gap:2.5em;flex-wrap:wrap}.columns>div{flex:1 1 380px;margin-bottom:.8em}\
.verdict h2{font-size:1em;margin:.9em 0 .2em;color:#555}ul{margin:0;padding-left:1.2em}\
ul.checks{list-style:none;padding:0}.checks li{padding-left:1.5em;text-indent:-1.5em}.checks li::before{display:inline-block;width:1.5em;text-indent:0;font-weight:bold}\
li.good::before{content:'\\2713';color:#0a5}li.bad::before{content:'\\2717';color:#c00}\
li.warning::before{content:'!';color:#b70}li.plain::before{content:'\\2013';color:#777}\
.bad,tr.bad td{color:#c00;font-weight:bold}.warning{color:#850}\
table{border-collapse:collapse;margin:.4em 0}td,th{padding:.15em .8em;border-bottom:1px solid #ddd;text-align:right;\
font-variant-numeric:tabular-nums}td:first-child,th:first-child,.left{text-align:left}tr.first td{font-weight:bold}\
svg{width:100%;height:auto}figure{margin:0}pre{background:#f5f5f5;padding:.8em;overflow:auto}summary{cursor:pointer}";

/// Numbers in tables of details.
fn number(value: Option<f64>) -> String {
    value.map_or("–".into(), |v| engineering(v, 7))
}

fn class(tone: Tone) -> &'static str {
    match tone {
        Tone::Plain => "plain",
        Tone::Good => "good",
        Tone::Warning => "warning",
        Tone::Bad => "bad",
    }
}

/// An SVG document as a part of the page: its texts were escaped when it was drawn.
fn inline(svg: &str) -> PreEscaped<&str> {
    PreEscaped(svg.find("<svg").map_or(svg, |at| &svg[at..]))
}

impl Page<'_> {
    /// The page as HTML.
    pub fn render(&self) -> String {
        let result = self.result;
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    title { (result.case) ": " (result.status) }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    (self.verdict())
                    (quantities(&self.overview.rows))
                    @if !result.repairs.is_empty() {
                        h2 { "Repairs of the input" }
                        ul { @for repair in &result.repairs { li { (repair) } } }
                    }
                    @for (heading, svg) in &self.figures {
                        h2 { (heading) }
                        figure { (inline(svg)) }
                    }
                    @for table in self.tables.iter().filter(|table| !table.rows.is_empty()) { (plain_table(table)) }
                    (self.variables())
                    (self.details())
                }
            }
        };
        page.into_string() + "\n"
    }

    /// The verdict: what went down by how much, what holds it, and why it may be trusted.
    fn verdict(&self) -> Markup {
        let (result, overview) = (self.result, self.overview);
        let [start, end, change] = &overview.headline;
        let objective = if overview.objective == "cd" { "drag (cd)" } else { overview.objective.as_str() };
        let worse = result.objective.zip(result.initial_objective).is_some_and(|(end, start)| end > start);
        html! {
            section.verdict {
                h1 { (result.case) ": " (result.status) }
                @if !self.description.is_empty() { p.about { (self.description) } }
                @for condition in &overview.conditions { p.about { "at " (condition) } }
                @if result.objective.is_some() || result.initial_objective.is_some() {
                    p.headline {
                        small { (objective) " " } (start) " → " (end) " "
                        b.worse[worse] { (change) }
                    }
                }
                @if !matches!(result.status, Termination::Converged) {
                    p.bad[matches!(result.status, Termination::Failed | Termination::Infeasible)] { (result.message) }
                }
                div.columns {
                    div {
                        h2 { "What holds it there" }
                        ul {
                            @for hold in &overview.holds { li { (hold) } }
                            @if overview.holds.is_empty() {
                                li {
                                    @if result.objective.is_some() { "no constraint and no bound of a variable" }
                                    @else { "there is no design" }
                                }
                            }
                        }
                    }
                    div {
                        h2 { "Whether to trust it" }
                        ul.checks {
                            @for check in &overview.checks { li class=(class(check.tone)) { (check.text) } }
                        }
                    }
                }
                p.about {
                    (result.optimizer) ", " (result.iterations) " iterations, " (result.evaluations) " evaluations, "
                    (engineering(result.seconds, 3)) " s"
                }
            }
        }
    }

    fn variables(&self) -> Markup {
        let starts = self.result.initial_variables.iter().map(|(_, value)| *value);
        let rows = self.result.variables.iter().zip(starts).zip(&self.bounds);
        html! {
            h2 { "Design variables" }
            details {
                summary { (self.result.variables.0.len()) " variables, " (self.result.active_bounds.0.len()) " at a bound" }
                table {
                    tr { th { "variable" } th { "start" } th { "end" } th { "lower" } th { "upper" } th { "multiplier" } }
                    @for (((name, end), start), bounds) in rows {
                        tr {
                            td { (name) } td { (number(Some(start))) } td { (number(Some(*end))) }
                            td { (number(bounds.lower)) } td { (number(bounds.upper)) }
                            td { (number(self.result.active_bounds.get(name).map(|active| active.multiplier))) }
                        }
                    }
                }
            }
        }
    }

    /// Everything in full, folded away.
    fn details(&self) -> Markup {
        let result = self.result;
        html! {
            h2 { "Details" }
            @if matches!(result.status, Termination::Converged) { p { (result.message) } }
            details {
                summary { "All " (result.values.0.len()) " values and " (result.constraints.0.len()) " constraints" }
                table {
                    tr {
                        th { "quantity" } th { "start" } th { "end" } th { "lower" } th { "upper" }
                        th { "violation" } th { "multiplier" }
                    }
                    @for ((name, end), (_, start)) in result.values.iter().zip(result.initial.iter()) {
                        @let constraint = result.constraints.get(name);
                        tr {
                            td { (name) } td { (number(*start)) } td { (number(*end)) }
                            td { (number(constraint.and_then(|c| c.lower))) }
                            td { (number(constraint.and_then(|c| c.upper))) }
                            td { (number(constraint.and_then(|c| c.violation))) }
                            td { (number(constraint.and_then(|c| c.multiplier))) }
                        }
                    }
                }
                p { "Multiplier: change of the objective per unit of the bound." }
            }
            details { summary { "Case file" } pre { (self.case) } }
            p { "Run again: " code { (self.command) } }
        }
    }
}

/// Start, end, change and bound of every quantity.
fn quantities(rows: &[Row]) -> Markup {
    html! {
        h2 { "From start to end" }
        table {
            tr { th { "quantity" } th { "start" } th { "end" } th { "change" } th.left { "bound" } th {} }
            @for row in rows {
                tr.bad[row.tone == Tone::Bad].first[row.role == "minimised"] {
                    td { (row.name) } td { (row.start) } td { (row.end) } td { (row.change) }
                    td.left { (row.bound) } td.left { (row.role) }
                }
            }
        }
    }
}

fn plain_table(table: &HtmlTable) -> Markup {
    html! {
        h2 { (table.heading) }
        table {
            tr { @for column in &table.columns { th { (column) } } }
            @for row in &table.rows { tr { @for cell in row { td { (cell) } } } }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::overview::Check;
    use super::*;
    use crate::optimize::Termination;
    use crate::report::json::Named;

    #[test]
    fn a_page_is_complete_and_harmless() {
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
            without_value: Named(Vec::new()),
            constraints: Named(Vec::new()),
            kkt_residual: f64::NAN,
            variables: Named::new(["dx[0,0]"], [0.25]),
            initial_objective: None,
            initial: Named::new(["cd"], [None]),
            initial_variables: Named::new(["dx[0,0]"], [0.0]),
            active_bounds: Named(Vec::new()),
            flow_solver: None,
            drag: Vec::new(),
            repairs: vec!["s<1>.dat: one point moved".into()],
            min_fold_indicator: None,
            folded: None,
            self_intersecting: true,
            target_distance: None,
            identifiers: Named(Vec::new()),
        };
        let row = |name: &str, tone: Tone| Row {
            name: name.into(),
            start: "none".into(),
            end: "70 counts".into(),
            change: String::new(),
            bound: "≤ 60 counts".into(),
            role: "violated by 0.001".into(),
            tone,
        };
        let overview = Overview {
            objective: "cd".into(),
            conditions: vec!["α 0°".into()],
            headline: ["none".into(), "70 counts".into(), String::new()],
            rows: vec![row("cd", Tone::Bad)],
            holds: vec!["area ≥ <0.1>".into()],
            checks: vec![Check { text: "the section crosses itself".into(), tone: Tone::Bad }],
        };
        let page = Page {
            result: &result,
            overview: &overview,
            command: "aeroform run a".into(),
            description: "a case",
            case: "name = \"a<b\"",
            bounds: vec![BoundsReport { lower: Some(-1.0), upper: None }],
            figures: vec![("Start".into(), "<?xml version=\"1.0\"?><svg></svg>".into())],
            tables: vec![
                HtmlTable { heading: "Gradient check", columns: vec!["quantity"], rows: Vec::new() },
                HtmlTable { heading: "Timing", columns: vec!["what"], rows: vec![vec!["flow".into()]] },
            ],
        };
        let html = page.render();
        for part in [
            "a&lt;b",
            "fine &amp; done",
            "<svg></svg>",
            "<li class=\"bad\">the section crosses itself</li>",
            "<tr class=\"bad\"><td>cd</td>",
            // marks are for lists: before a row one would be a cell of its own
            "li.bad::before",
            "area ≥ &lt;0.1&gt;",
            "s&lt;1&gt;.dat: one point moved",
            "Timing",
            "–",
            "0.007",
        ] {
            assert!(html.contains(part), "{part} is not in {html}");
        }
        assert!(!html.contains("}.bad::before") && !html.contains("Gradient check"));
        assert!(!html.contains("<?xml") && !html.contains("http") && html.ends_with("</html>\n"));
    }
}
