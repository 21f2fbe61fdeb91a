//! Figures, tables and JSON of results, and the files they are written to.
//!
//! * `figures`: sections, convergence and line plots as SVG text (feature `figures`, on by default);
//! * [`json`]: the JSON of runs, evaluations, sections and flows, as types;
//! * [`OutputDirectory`]: a directory proved writable before a run, and files written into it whole or not at all;
//! * [`Table`]: aligned plain-text tables;
//! * [`number`]: numbers for JSON, `null` where there is none; [`engineering`]: numbers for people.
//!
//! This module depends on [`case`](crate::case) and the modules below it for the JSON, on `serde_json`, `tempfile`, and
//! with figures on `maud`.

#[cfg(feature = "figures")]
pub mod figures;
mod files;
pub mod json;
mod table;

pub use crate::optimize::engineering;
pub use files::{DirectoryLock, OutputDirectory, OutputError};
pub use table::{Align, Table, number};
