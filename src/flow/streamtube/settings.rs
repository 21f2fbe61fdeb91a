//! Resolution and limits of the streamtube solver.

use super::grading::Size;
use crate::flow::FlowError;

/// Resolution and limits of the streamtube solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StreamtubeSettings {
    /// Number of cells on each side of the section, from 40 to 400.
    pub cells: usize,
    /// Number of tubes above and below the section each, from 8 to 100.
    pub tubes: usize,
    /// Distance of the outer lines from the section far away, in chords, from 1 to 50. The domain reaches four fifths of it
    /// ahead of the nose and behind the trailing edge.
    pub reach: f64,
    /// Largest residual of a converged solution, without dimension, from 1e-13 to 1e-3. Below
    /// what round-off leaves, iterations end with the last step that changes nothing.
    pub tolerance: f64,
    /// Largest number of Newton steps of one stage of a start.
    pub iterations: usize,
    /// Whether the solver tries other starts where the first one fails.
    pub retry: bool,
}

impl Default for StreamtubeSettings {
    fn default() -> Self {
        Self { cells: 120, tubes: 24, reach: 5.0, tolerance: 1e-10, iterations: 60, retry: true }
    }
}

impl StreamtubeSettings {
    /// Checks the ranges.
    ///
    /// # Errors
    /// [`FlowError::Condition`] for the first number out of range.
    pub(super) fn check(&self) -> Result<(), FlowError> {
        let check = |name, value: f64, ok: bool, allowed| {
            if ok { Ok(()) } else { Err(FlowError::Condition { name, value, allowed }) }
        };
        check("number of cells", self.cells as f64, (40..=400).contains(&self.cells), "from 40 to 400")?;
        check("number of tubes", self.tubes as f64, (8..=100).contains(&self.tubes), "from 8 to 100")?;
        check("reach of the domain", self.reach, (1.0..=50.0).contains(&self.reach), "from 1 to 50")?;
        let tolerance = self.tolerance;
        check("tolerance", tolerance, (1e-13..=1e-3).contains(&tolerance), "from 1e-13 to 1e-3")
    }

    pub(super) fn size(&self) -> Size {
        // about as many stations ahead and behind as the cells of a side demand
        let outside = (self.cells / 4).max(16);
        Size { wall: self.cells, ahead: outside, behind: outside, tubes: self.tubes, reach: self.reach }
    }
}
