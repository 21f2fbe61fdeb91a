//! Design vectors as JSON files: `{"variable name": value, …}`.

use super::failure::Failure;
use crate::case::Case;
use crate::optimize::limited::{read_from, read_limited};
use serde::de::{Deserialize, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::fmt;
use std::path::Path;

/// Largest file that is read, in bytes.
const MOST_BYTES: u64 = 64 << 20;

/// Reads a design vector, in the unit of each variable; missing variables keep their start. `-` is standard input.
pub(super) fn read(case: &Case, path: Option<&str>) -> Result<Vec<f64>, Failure> {
    let Some(path) = path else { return Ok(case.problem.start_values()) };
    let (name, content) = match path {
        "-" => ("standard input", read_from(std::io::stdin().lock(), MOST_BYTES)),
        _ => (path, read_limited(Path::new(path), MOST_BYTES)),
    };
    let content = content.map_err(|e| Failure::Input(format!("{name}: cannot be read: {e}")))?;
    parse(case, name, &content)
}

fn parse(case: &Case, origin: &str, content: &[u8]) -> Result<Vec<f64>, Failure> {
    let wrong = |e: serde_json::Error| {
        Failure::Input(format!("{origin}:{}: not a JSON object of numbers by variable: {e}", e.line()))
    };
    // some editors begin a text with a mark of its encoding
    let content = content.strip_prefix(b"\xef\xbb\xbf").unwrap_or(content);
    let Entries(mut given) = serde_json::from_slice(content).map_err(wrong)?;
    // what `run` and `evaluate` write is a design vector too
    if let Some(inner) = given.iter_mut().find_map(|(name, node)| match node {
        Node::Object(inner) if name == "variables" => Some(std::mem::take(inner)),
        _ => None,
    }) {
        given = inner;
    }
    let mut numbers = Vec::with_capacity(given.len());
    for (name, node) in &given {
        let Node::Number(number) = node else {
            return Err(Failure::Input(format!("{origin}: {name:?} is {node}, a finite number is needed")));
        };
        numbers.push((name.as_str(), *number));
    }
    case.design_vector(numbers).map_err(|e| Failure::Input(format!("{origin}: {e}")))
}

/// A JSON object with every entry it has, also where a key stands twice.
struct Entries(Vec<(String, Node)>);

/// A JSON value, as far as a design vector cares.
enum Node {
    Number(f64),
    Object(Vec<(String, Node)>),
    /// Anything else, in words.
    Other(&'static str),
}

impl fmt::Display for Node {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Object(_) => f.write_str("an object"),
            Self::Other(words) => f.write_str(words),
        }
    }
}

struct NodeVisitor;

impl<'de> Visitor<'de> for NodeVisitor {
    type Value = Node;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a JSON value")
    }
    fn visit_f64<E>(self, number: f64) -> Result<Node, E> {
        Ok(Node::Number(number))
    }
    fn visit_u64<E>(self, number: u64) -> Result<Node, E> {
        Ok(Node::Number(number as f64))
    }
    fn visit_i64<E>(self, number: i64) -> Result<Node, E> {
        Ok(Node::Number(number as f64))
    }
    fn visit_bool<E>(self, truth: bool) -> Result<Node, E> {
        Ok(Node::Other(if truth { "true" } else { "false" }))
    }
    fn visit_str<E>(self, _: &str) -> Result<Node, E> {
        Ok(Node::Other("a text"))
    }
    fn visit_unit<E>(self) -> Result<Node, E> {
        Ok(Node::Other("null"))
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Node, A::Error> {
        while list.next_element::<IgnoredAny>()?.is_some() {}
        Ok(Node::Other("a list"))
    }
    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Node, A::Error> {
        Ok(Node::Object(EntriesVisitor.visit_map(map)?.0))
    }
}

impl<'de> Deserialize<'de> for Node {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NodeVisitor)
    }
}

struct EntriesVisitor;

impl<'de> Visitor<'de> for EntriesVisitor {
    type Value = Entries;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object")
    }
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Entries, A::Error> {
        let mut entries = Vec::new();
        while let Some(entry) = map.next_entry()? {
            entries.push(entry);
        }
        Ok(Entries(entries))
    }
}

impl<'de> Deserialize<'de> for Entries {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(EntriesVisitor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The case of the paper with a bounded variable.
    fn case() -> Case {
        let text = crate::case::builtin_cases().iter().find(|c| c.name == "l2-match").unwrap().text;
        let text = text.replace("free = \"all\"", "free = \"all\"\nbounds = { \"dy[1,1]\" = [-0.1, 0.3] }");
        Case::parse("case.toml", &text, Path::new("")).unwrap()
    }

    fn read(text: &str) -> Result<Vec<f64>, String> {
        parse(&case(), "x.json", text.as_bytes()).map_err(|e| e.to_string())
    }

    #[test]
    fn what_is_not_a_design_vector_is_refused_by_name() {
        for (text, words) in [
            ("[1]", "x.json:1: not a JSON object"),
            ("{\n\"dy[1,1]\": 0.1,\n", "x.json:3:"),
            (r#"{"dy[1,1]": 0.1, "dy[1,1]": 0.2}"#, "\"dy[1,1]\" is given twice"),
            (r#"{"variables": {"dy[1,1]": 0.1, "dy[1,1]": 0.1}, "objective": 1}"#, "given twice"),
            (r#"{"dy[1,11]": 0.1}"#, "did you mean"),
            (r#"{"dy[1,1]": 1e400}"#, "out of range"),
            (r#"{"dy[1,1]": null}"#, "is null, a finite number is needed"),
            (r#"{"dy[1,1]": "0.1"}"#, "is a text"),
            (r#"{"dy[1,1]": [0.1]}"#, "is a list"),
            (r#"{"dy[1,1]": {"value": 0.1}}"#, "is an object"),
            (r#"{"dy[1,1]": 0.31}"#, "dy[1,1] is 0.31, outside of its bounds -0.1 and 0.3"),
            (r#"{"dy[1,1]": -0.2}"#, "outside of its bounds"),
        ] {
            let message = read(text).unwrap_err();
            assert!(message.contains(words), "{text}: {message}");
        }
    }

    #[test]
    fn what_lies_at_a_bound_up_to_round_off_is_kept_bit_for_bit() {
        let index = case().problem.geometry().variables().iter().position(|v| v.name == "dy[1,1]").unwrap();
        for value in [0.3_f64, 0.3 + 1e-16, 0.300_000_000_000_01, -0.1 - 1e-17, 0.0] {
            let vector = read(&format!("{{\"variables\": {{\"dy[1,1]\": {value:e}}}, \"values\": {{}}}}")).unwrap();
            assert_eq!(vector[index].to_bits(), value.to_bits());
        }
        assert_eq!(read("{}").unwrap(), case().problem.start_values());
        let marked = read("\u{feff}{\"dy[1,1]\": 0.25}").unwrap();
        assert_eq!(marked[index], 0.25);
    }
}
