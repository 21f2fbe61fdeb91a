//! The text of a case file and where its keys stand.

use super::error::{CaseError, nearest};
use super::schema::CaseTable;
use toml::de::{DeTable, DeValue};

/// A case file as text, which turns keys into lines.
#[derive(Debug, Clone)]
pub(super) struct Document {
    origin: String,
    text: String,
}

impl Document {
    pub fn new(origin: &str, text: &str) -> Self {
        Self { origin: origin.to_string(), text: text.to_string() }
    }

    /// Parses the tables; errors name line and key, unknown keys the nearest known one.
    pub fn parse(&self) -> Result<CaseTable, CaseError> {
        toml::from_str(&self.text).map_err(|error| {
            let offset = error.span().map(|s| s.start);
            let message = error.message().to_string();
            // toml reports a missing key at the table that lacks it, an unknown one at the key
            let unknown = message.strip_prefix("unknown field `").and_then(|rest| rest.split_once('`'));
            let message = match unknown {
                Some((wrong, rest)) => {
                    let known: Vec<&str> = rest.split('`').skip(1).step_by(2).collect();
                    match nearest(wrong, known.iter().copied()) {
                        Some(name) => format!("unknown key `{wrong}`; did you mean `{name}`?"),
                        None => format!("unknown key `{wrong}`; known here: {}", known.join(", ")),
                    }
                }
                None => message.replace("missing field", "missing key").trim_end().to_string(),
            };
            let key = offset.and_then(|o| self.key_at(o)).unwrap_or_default();
            CaseError { origin: self.origin.clone(), line: offset.map(|o| self.line(o)), key, message }
        })
    }

    /// An error at a key, given as the path from the top.
    pub fn error(&self, path: &[&str], message: impl Into<String>) -> CaseError {
        let offset = DeTable::parse(&self.text).ok().and_then(|root| offset_of(root.get_ref(), path));
        CaseError {
            origin: self.origin.clone(),
            line: offset.map(|o| self.line(o)),
            key: path.join("."),
            message: message.into(),
        }
    }

    fn line(&self, offset: usize) -> usize {
        1 + self.text.as_bytes().iter().take(offset).filter(|b| **b == b'\n').count()
    }

    /// Dotted path of the innermost key whose name or value covers a position.
    fn key_at(&self, offset: usize) -> Option<String> {
        let root = DeTable::parse(&self.text).ok()?;
        path_at(root.get_ref(), offset).map(|path| path.join("."))
    }
}

/// Path of the innermost key that covers a position. The span of a table is its header only, so all are searched.
fn path_at(table: &DeTable<'_>, offset: usize) -> Option<Vec<String>> {
    table.iter().find_map(|(key, value)| {
        let inner = match value.get_ref() {
            DeValue::Table(inner) => path_at(inner, offset),
            _ => None,
        };
        let covered = key.span().contains(&offset) || value.span().contains(&offset);
        let mut path = vec![key.get_ref().to_string()];
        match inner {
            Some(rest) => {
                path.extend(rest);
                Some(path)
            }
            None => covered.then_some(path),
        }
    })
}

/// Position of a key: of its last part that exists.
fn offset_of(table: &DeTable<'_>, path: &[&str]) -> Option<usize> {
    let (first, rest) = path.split_first()?;
    let (key, value) = table.iter().find(|(key, _)| key.get_ref() == first)?;
    let inner = match value.get_ref() {
        DeValue::Table(inner) => offset_of(inner, rest),
        _ => None,
    };
    inner.or(Some(key.span().start))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CASE: &str = "name = \"x\"\n[section]\nnaca = \"0012\"\n[box]\nx = [0, 1]\ncontrol_points = [4, 4]\ndegre = [3, 3]\n[objective]\nminimize = { area = 1.0 }\n";

    #[test]
    fn an_unknown_key_is_named_with_its_line_and_the_nearest() {
        let error = Document::new("a.toml", CASE).parse().unwrap_err();
        assert_eq!(error.line, Some(7));
        assert_eq!(error.to_string(), "a.toml:7: box.degre: unknown key `degre`; did you mean `degree`?");
    }

    #[test]
    fn a_wrong_type_is_named_with_its_line() {
        let text = CASE.replace("degre ", "degree ").replace("[4, 4]", "\"four\"");
        let error = Document::new("a.toml", &text).parse().unwrap_err();
        assert_eq!((error.line, error.key.as_str()), (Some(6), "box.control_points"));
    }

    #[test]
    fn keys_have_lines() {
        let document = Document::new("a.toml", CASE);
        assert_eq!(document.error(&["box", "control_points"], "no").line, Some(6));
        assert_eq!(document.error(&["box", "placement"], "no").line, Some(4));
        assert_eq!(document.error(&["nothing"], "no").line, None);
    }
}
