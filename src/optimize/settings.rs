//! The settings of the methods, and the numbers that they may take.

use super::optimizer::Limits;
use super::outcome::OptimizeError;

/// The numbers that a setting may take.
#[derive(Debug, Clone, Copy)]
enum Range {
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

/// A setting of a method: name, value, and the numbers it may take.
#[derive(Debug, Clone, Copy)]
pub(super) struct Setting {
    name: &'static str,
    value: f64,
    range: Range,
}

impl Setting {
    /// A number of things of which there must be one.
    pub fn count(name: &'static str, value: usize) -> Self {
        Self { name, value: value as f64, range: Range::AtLeastOne }
    }

    /// A tolerance that may be zero: then nothing but an exact answer meets it.
    pub fn tolerance(name: &'static str, value: f64) -> Self {
        Self { name, value, range: Range::NotNegative }
    }

    /// A length, or a tolerance that round-off must be able to meet.
    pub fn positive(name: &'static str, value: f64) -> Self {
        Self { name, value, range: Range::Positive }
    }

    /// The two tolerances of every method for problems with constraints: KKT residual, and largest violation.
    pub fn of_constraints(optimality: f64, feasibility: f64) -> [Self; 2] {
        [Self::tolerance("optimality_tolerance", optimality), Self::positive("feasibility_tolerance", feasibility)]
    }
}

/// Refuses the first setting that is out of its range, and a limit of no evaluations.
pub(super) fn check_settings(method: &'static str, limits: Limits, settings: &[Setting]) -> Result<(), OptimizeError> {
    let evaluations = Setting::count("max_evaluations", limits.evaluations);
    match std::iter::once(&evaluations).chain(settings).find(|s| !s.range.contains(s.value)) {
        None => Ok(()),
        Some(&Setting { name: setting, value, range }) => {
            Err(OptimizeError::Setting { method, setting, value, range: range.words() })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_setting_out_of_its_range_is_named() {
        let check = |evaluations: usize, settings: &[Setting]| {
            check_settings("m", Limits { evaluations, ..Limits::default() }, settings)
        };
        let good = [Setting::count("a", 1), Setting::tolerance("b", 0.0), Setting::positive("c", 1e-300)];
        assert!(check(1, &good).is_ok());
        let bad = [
            Setting::count("a", 0),
            Setting::tolerance("b", -1e-9),
            Setting::tolerance("b", f64::NAN),
            Setting::positive("c", 0.0),
            Setting::positive("c", f64::INFINITY),
        ];
        for setting in bad {
            let error = check(1, &[good[0], setting, Setting::count("z", 0)]).unwrap_err();
            assert!(matches!(&error, OptimizeError::Setting { setting: name, .. } if *name == setting.name), "{error}");
        }
        let error = check(0, &good).unwrap_err();
        assert!(matches!(error, OptimizeError::Setting { setting: "max_evaluations", .. }), "{error}");
    }
}
