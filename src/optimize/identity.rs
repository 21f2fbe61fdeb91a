//! Everything that a run depends on, so that its answers are not taken for those of another.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// Everything that the answers of a run and the path of its optimiser depend on, part by part, each as text: the
/// program, the method, the case, the content of each file.
///
/// ```
/// use aeroform::optimize::Identity;
/// let before = Identity::new().with("method", "lbfgs").with_content("file wing.dat", b"1 0\n0 0\n1 0\n");
/// let after = Identity::new().with("method", "lbfgs").with_content("file wing.dat", b"1 0\n0 0.1\n1 0\n");
/// assert_eq!(before.changes(&after), ["file wing.dat has another content"]);
/// assert!(before.changes(&before).is_empty());
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Identity {
    parts: Vec<(String, String)>,
}

/// The beginning of a part that stands for a content.
const HASH: &str = "sha256:";

impl Identity {
    /// An identity of no parts.
    pub fn new() -> Self {
        Self::default()
    }

    /// With one more part: its name and its text.
    pub fn with(mut self, name: impl Into<String>, text: impl Into<String>) -> Self {
        self.parts.push((name.into(), text.into()));
        self
    }

    /// With one more part that is too long to be kept: its name and the SHA-256 hash of its content.
    pub fn with_content(self, name: impl Into<String>, content: &[u8]) -> Self {
        let hash = Sha256::digest(content).iter().map(|byte| format!("{byte:02x}")).collect::<String>();
        self.with(name, format!("{HASH}{hash}"))
    }

    /// The ways in which `other` differs from this one, each in words; empty where they are equal.
    pub fn changes(&self, other: &Self) -> Vec<String> {
        let text_in = |parts: &[(String, String)], name: &str| {
            parts.iter().find(|(other, _)| other == name).map(|(_, text)| text.clone())
        };
        let mut changes = Vec::new();
        for (name, before) in &self.parts {
            match text_in(&other.parts, name) {
                Some(after) if *before == after => {}
                Some(after) => changes.push(change(name, before, &after)),
                None => changes.push(format!("{name} is not part of this run")),
            }
        }
        let new = other.parts.iter().filter(|(name, _)| text_in(&self.parts, name).is_none());
        changes.extend(new.map(|(name, _)| format!("{name} was not part of that run")));
        changes
    }
}

/// The change of a part, with the texts where they are short.
fn change(name: &str, before: &str, after: &str) -> String {
    let short = |text: &str| text.len() <= 40 && !text.contains('\n');
    if before.starts_with(HASH) && after.starts_with(HASH) {
        format!("{name} has another content")
    } else if short(before) && short(after) {
        format!("{name} was {before}, is {after}")
    } else {
        format!("{name} has changed")
    }
}

impl From<&str> for Identity {
    fn from(name: &str) -> Self {
        Self::new().with("run", name)
    }
}

impl From<&Identity> for Identity {
    fn from(identity: &Identity) -> Self {
        identity.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_change_is_named() {
        let before = Identity::new().with("program", "aeroform 1").with("case", "a\nb").with_content("file x", b"1");
        let after = Identity::new().with("program", "aeroform 2").with("case", "a\nc").with_content("file y", b"1");
        assert_eq!(
            before.changes(&after),
            [
                "program was aeroform 1, is aeroform 2",
                "case has changed",
                "file x is not part of this run",
                "file y was not part of that run",
            ]
        );
    }

    #[test]
    fn the_hash_is_sha_256() {
        // FIPS 180-2, appendix B.1
        let expected = "sha256:ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        let known = Identity::new().with("x", expected);
        assert!(known.changes(&Identity::new().with_content("x", b"abc")).is_empty());
    }
}
