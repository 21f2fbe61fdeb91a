//! `--events`: what happens, as JSON lines for programs that watch.

use super::failure::Failure;
use serde::Serialize;
use std::fs::File;
use std::io::Write;

/// Where events go.
#[derive(Debug, Clone, Default, clap::Args)]
pub(super) struct EventArguments {
    /// Write a JSON object per event, one a line, to this file, or with - to standard error (then without progress)
    #[arg(long = "events", value_name = "FILE")]
    to: Option<String>,
}

/// A stream of events; it may be none.
pub(super) enum Events {
    Nowhere,
    StandardError,
    To(File),
}

impl EventArguments {
    /// Opens the stream.
    ///
    /// # Errors
    /// A file that cannot be created.
    pub fn open(&self) -> Result<Events, Failure> {
        match self.to.as_deref() {
            None => Ok(Events::Nowhere),
            Some("-") => Ok(Events::StandardError),
            Some(path) => File::create(path)
                .map(Events::To)
                .map_err(|e| Failure::Input(format!("--events {path}: cannot be written: {e}"))),
        }
    }
}

impl Events {
    /// Whether standard error is for events, so that nothing else may stand there.
    pub fn take_standard_error(&self) -> bool {
        matches!(self, Self::StandardError)
    }

    /// Writes one event, a type that serialises to an object. A reader that has gone is no reason to end the work.
    pub fn send(&mut self, event: &impl Serialize) {
        let Ok(mut line) = serde_json::to_string(event) else { return };
        line.push('\n');
        let _ = match self {
            Self::Nowhere => Ok(()),
            Self::StandardError => std::io::stderr().lock().write_all(line.as_bytes()),
            Self::To(file) => file.write_all(line.as_bytes()),
        };
    }
}
