//! How a subcommand ends badly.

use super::message::say;
use crate::case::{CaseError, RunError};

/// Why the command ends with a status other than 0.
#[derive(Debug)]
pub(super) enum Failure {
    /// Bad usage or input: status 2.
    Input(String),
    /// The computation did not succeed: status 1.
    Computation(String),
    /// The computation did not succeed, and standard output holds what there is: status 1.
    Told(String),
    /// The reader of standard output has gone: status 0, nothing said.
    Quiet,
}

impl Failure {
    /// The reason, where no result has been printed that holds it.
    pub fn untold(&self) -> Option<&str> {
        match self {
            Self::Input(message) | Self::Computation(message) => Some(message),
            Self::Told(_) | Self::Quiet => None,
        }
    }

    pub fn report(&self) {
        match self {
            Self::Input(message) | Self::Computation(message) | Self::Told(message) => say(message),
            Self::Quiet => {}
        }
    }

    /// The exit status of the process.
    pub fn exit_status(&self) -> u8 {
        match self {
            Self::Input(_) => 2,
            Self::Computation(_) | Self::Told(_) => 1,
            Self::Quiet => 0,
        }
    }

    /// A run of the case `name` that gave no outcome.
    pub fn of_run(name: &str, error: &RunError) -> Self {
        let message = format!("{name}: {error}");
        match error {
            RunError::Optimize(_) => Self::Input(message),
            RunError::Design(_) => Self::Computation(message),
        }
    }
}

impl From<CaseError> for Failure {
    fn from(error: CaseError) -> Self {
        Self::Input(error.to_string())
    }
}
