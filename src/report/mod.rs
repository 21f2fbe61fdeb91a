//! What a run leaves behind: figures, tables, JSON and the files they are written to.
//!
//! * `figures`: sections, convergence and line plots as SVG text (feature `command`);
//! * [`OutputDirectory`]: a directory proved writable before a run, and files written into it whole or not at all;
//! * [`Table`]: aligned plain-text tables;
//! * [`number`]: numbers for JSON, `null` where there is none.
//!
//! Depends on `serde_json`, `tempfile`, with figures `plotters`; on nothing that computes.

#[cfg(feature = "command")]
pub mod figures;
mod files;
mod table;

pub use files::{OutputDirectory, OutputError};
pub use table::{Align, Table, number};
