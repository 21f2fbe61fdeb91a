//! The command as a user runs it, for several test files.

// not every test file uses every helper
#![allow(dead_code)]

use std::path::Path;
use std::process::{Command, Output};

pub fn aeroform(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_aeroform")).args(arguments).current_dir(folder).output().unwrap()
}

pub fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Standard output as JSON.
pub fn json(output: &Output) -> serde_json::Value {
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}{}", text(&output.stdout), text(&output.stderr)))
}

/// Exit status 2, the words on standard error, no result on standard output, no panic.
pub fn refused(output: &Output, words: &[&str]) {
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{message}");
    // with --json the reason stands there
    let reason = serde_json::from_slice::<serde_json::Value>(&output.stdout).ok();
    assert!(output.stdout.is_empty() || reason.is_some_and(|r| r["failed"].is_string()), "{}", text(&output.stdout));
    assert!(!message.contains("panicked"), "{message}");
    for word in words {
        assert!(message.contains(word), "{message} lacks {word}");
    }
}
