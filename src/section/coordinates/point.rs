//! A point of a coordinate file.

/// A point, the line it stands in, and its position among the points to mend (set when mending starts).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Point {
    pub xy: [f64; 2],
    pub line: usize,
    pub source: usize,
}
