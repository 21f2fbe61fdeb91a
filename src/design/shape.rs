//! [`Shape`]: what a design looks like.

use crate::section::Section;

/// A deformed section with the control net that made it.
#[derive(Debug, Clone)]
pub struct Shape<S = f64> {
    /// The deformed section.
    pub section: Section<S>,
    /// The deformed control net of the box, first direction (x) fastest; empty where there is none.
    pub net: Vec<[S; 2]>,
}
