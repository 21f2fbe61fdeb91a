//! Errors of case files: always file, line and key.

use std::fmt;

/// An error in a case file.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseError {
    /// File name, or the name of the built-in case.
    pub origin: String,
    /// Line, from 1; `None` where the whole file is meant.
    pub line: Option<usize>,
    /// Dotted key, like `box.degree`; empty where no key is meant.
    pub key: String,
    /// The mistake and its remedy, in a sentence.
    pub message: String,
}

impl fmt::Display for CaseError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.origin)?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        if !self.key.is_empty() {
            write!(f, ": {}", self.key)?;
        }
        write!(f, ": {}", self.message)
    }
}

impl std::error::Error for CaseError {}

/// A name close to `wrong` among `known`, for "did you mean".
pub(crate) fn nearest<'a>(wrong: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    known
        .into_iter()
        .map(|name| (strsim::damerau_levenshtein(wrong, name), name))
        .filter(|(distance, name)| *distance <= 1 + name.len() / 3)
        .min()
        .map(|(_, name)| name.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suggestions_are_near_or_none() {
        let known = ["degree", "placement", "control_points"];
        assert_eq!(nearest("degre", known).as_deref(), Some("degree"));
        assert_eq!(nearest("controlpoints", known).as_deref(), Some("control_points"));
        assert_eq!(nearest("zzz", known), None);
    }
}
