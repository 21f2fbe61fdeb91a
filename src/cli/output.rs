//! Text and JSON, as all subcommands give them out.

use super::failure::Failure;
use std::io::Write;

/// Prints to standard output. A reader that has gone (`aeroform … | head`) has what it wanted: the command goes on, and
/// its exit status says how the computation went.
pub(super) fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        Err(error) => Err(Failure::Computation(format!("standard output cannot be written: {error}"))),
        Ok(()) => Ok(()),
    }
}

/// A coefficient or an angle for people: what lies below the round-off of the solvers is zero, without a sign.
pub(super) fn settled(value: f64) -> f64 {
    const ROUND_OFF: f64 = 1e-9;
    if value.abs() < ROUND_OFF { 0.0 } else { value }
}

/// A number with a fixed count of decimals, zero without a sign.
pub(super) fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.bytes().all(|b| b == b'0' || b == b'.') => digits.into(),
        _ => text,
    }
}

/// Prints one JSON object; numbers that are not finite are `null`.
pub(super) fn print_json(value: &impl serde::Serialize) -> Result<(), Failure> {
    print(&pretty(value)?)
}

/// The text of a JSON file.
pub(super) fn pretty(value: &impl serde::Serialize) -> Result<String, Failure> {
    let text = serde_json::to_string_pretty(value).map_err(|e| Failure::Computation(e.to_string()))?;
    Ok(text + "\n")
}

#[cfg(test)]
mod tests {
    use super::{fixed, settled};

    #[test]
    fn zero_has_no_sign_and_round_off_is_zero() {
        assert_eq!(
            [-1e-9, 0.0, -0.0, 1.25, -0.000_006].map(|v| fixed(v, 5)),
            ["0.00000", "0.00000", "0.00000", "1.25000", "-0.00001"]
        );
        assert_eq!([6.754e-12, -3e-17, 1e-6, -0.5].map(settled), [0.0, 0.0, 1e-6, -0.5]);
        assert!(settled(-3e-17).is_sign_positive() && settled(f64::NAN).is_nan());
    }
}
