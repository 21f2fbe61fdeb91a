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

/// Prints one JSON object; numbers that are not finite are `null`.
pub(super) fn print_json(value: &impl serde::Serialize) -> Result<(), Failure> {
    print(&pretty(value)?)
}

/// The text of a JSON file.
pub(super) fn pretty(value: &impl serde::Serialize) -> Result<String, Failure> {
    let text = serde_json::to_string_pretty(value).map_err(|e| Failure::Computation(e.to_string()))?;
    Ok(text + "\n")
}
