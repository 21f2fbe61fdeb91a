//! The JSON that the command prints and writes, as types.
//!
//! * [`RunReport`]: `result.json` of a run;
//! * [`EvaluationReport`]: one evaluation of a case, with gradients where they were asked for;
//! * [`GradientsReport`]: exact derivatives against a second route and finite differences;
//! * [`SectionReport`]: the measures and the curve of a section;
//! * [`AnalysisReport`], [`InviscidReport`], [`PolarReport`]: flows;
//! * [`CaseList`]: the built-in cases.
//!
//! All of them serialise with `serde_json`. Lengths are in chords, angles in degrees where the field says so. A number
//! that is infinite or undefined becomes `null`, as does a missing one. Keys keep their order. Quantities and variables
//! stand under the names they have in case files, such as `cm_at(cruise)` or `dx[1,2]`; the key `identifiers` gives
//! each of them a name that programming languages accept, such as `cm_at_cruise` or `dx_1_2`.
//!
//! ```
//! use aeroform::case::Case;
//! use aeroform::report::json::EvaluationReport;
//! let case = Case::open("l2-match")?;
//! let evaluation = case.evaluate(&case.problem.start_values())?;
//! let text = serde_json::to_string_pretty(&EvaluationReport::new(&case, &evaluation))?;
//! assert!(text.contains("\"shape_error\"") && text.contains("\"min_fold_indicator\""));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod analysis;
mod evaluation;
mod gradients;
mod named;
mod run;
mod section;

pub use analysis::{AnalysisReport, ErrorReport, FlowDerivatives, FlowGradientsReport, InviscidReport, PolarReport};
pub use evaluation::{BoundsReport, CaseEntry, CaseList, EvaluationReport};
pub use gradients::{DerivativeReport, GradientsReport};
pub use named::{Named, identifier, identifiers};
pub use run::{ActiveBoundReport, ConstraintReport, DragParts, DragReport, RunReport, Side};
pub use section::{CurveReport, Dimension, SectionReport, repairs};
