//! What the command says on standard error.

use std::fmt::Display;
use std::io::Write;

/// Writes a message to standard error. One that cannot be written is lost, and nothing else: a closed pipe or a full
/// disk behind standard error must not end a computation.
pub(super) fn say(message: impl Display) {
    let text = format!("aeroform: {message}\n");
    // one write, so that messages of several processes do not mix within a line
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}
