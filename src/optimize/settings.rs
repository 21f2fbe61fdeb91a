//! Checks of the settings of the methods.

use super::optimizer::Limits;
use super::outcome::OptimizeError;

/// The numbers that a setting may take.
#[derive(Debug, Clone, Copy)]
pub(super) enum Range {
    AtLeastOne,
    NotNegative,
    Positive,
}

impl Range {
    /// Whether a number is in the range; NaN never is.
    fn contains(self, value: f64) -> bool {
        match self {
            Self::AtLeastOne => value >= 1.0,
            Self::NotNegative => value >= 0.0,
            Self::Positive => value > 0.0 && value.is_finite(),
        }
    }

    fn words(self) -> &'static str {
        match self {
            Self::AtLeastOne => "at least 1",
            Self::NotNegative => "0 or more",
            Self::Positive => "positive",
        }
    }
}

/// Refuses the first setting, given by name, value and range, that is out of its range, and a limit of no evaluations.
pub(super) fn check_settings(
    method: &'static str,
    limits: Limits,
    settings: &[(&'static str, f64, Range)],
) -> Result<(), OptimizeError> {
    let evaluations = ("max_evaluations", limits.evaluations as f64, Range::AtLeastOne);
    for &(setting, value, range) in std::iter::once(&evaluations).chain(settings) {
        if !range.contains(value) {
            return Err(OptimizeError::Setting { method, setting, value, range: range.words() });
        }
    }
    Ok(())
}
