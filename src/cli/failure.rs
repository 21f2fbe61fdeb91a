//! How a subcommand ends badly.

use super::message::say;
use crate::case::{CaseError, RunError};

/// Why the command ends with a status other than 0.
#[derive(Debug)]
pub(super) enum Failure {
    /// Bad usage or input: status 2.
    Input(String),
    /// Arguments that were not understood, which has been said: status 2.
    Usage,
    /// The computation did not succeed: status 1.
    Computation(String),
    /// The computation did not succeed, and standard output holds what there is: status 1.
    Told(String),
    /// A signal ended the run, and standard output holds what there is: this status.
    Interrupted(String, u8),
}

impl Failure {
    /// The reason, where no result has been printed that holds it.
    pub fn untold(&self) -> Option<&str> {
        match self {
            Self::Input(message) | Self::Computation(message) => Some(message),
            Self::Told(_) | Self::Interrupted(..) | Self::Usage => None,
        }
    }

    pub fn report(&self) {
        match self {
            Self::Input(message) | Self::Computation(message) | Self::Told(message) | Self::Interrupted(message, _) => {
                say(message);
            }
            Self::Usage => {}
        }
    }

    /// The exit status of the process.
    pub fn exit_status(&self) -> u8 {
        match self {
            Self::Input(_) | Self::Usage => 2,
            Self::Computation(_) | Self::Told(_) => 1,
            Self::Interrupted(_, status) => *status,
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

/// The reason of the failure in a sentence.
impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Input(message) | Self::Computation(message) | Self::Told(message) | Self::Interrupted(message, _) => {
                f.write_str(message)
            }
            Self::Usage => f.write_str("the arguments were not understood"),
        }
    }
}

impl From<CaseError> for Failure {
    fn from(error: CaseError) -> Self {
        Self::Input(error.to_string())
    }
}
