//! How a subcommand ends badly.

use crate::design::CaseError;
use std::process::ExitCode;

/// Why the command ends with a status other than 0.
#[derive(Debug)]
pub(super) enum Failure {
    /// Bad usage or input: status 2.
    Input(String),
    /// The computation did not succeed: status 1.
    Computation(String),
    /// The reader of standard output has gone: status 0, nothing said.
    Quiet,
}

impl Failure {
    pub fn report(&self) {
        match self {
            Self::Input(message) | Self::Computation(message) => eprintln!("aeroform: {message}"),
            Self::Quiet => {}
        }
    }

    pub fn exit_code(&self) -> ExitCode {
        match self {
            Self::Input(_) => ExitCode::from(2),
            Self::Computation(_) => ExitCode::from(1),
            Self::Quiet => ExitCode::SUCCESS,
        }
    }
}

impl From<CaseError> for Failure {
    fn from(error: CaseError) -> Self {
        Self::Input(error.to_string())
    }
}
