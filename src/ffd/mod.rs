//! Free-form deformation: a box of control points around a shape, and the shape's movement with it.
//!
//! * [`FfdBox`]: the box, a clamped tensor-product B-spline of any degree;
//! * [`Embedding`]: parameters of embedded points, found once; after that deformation is a constant sparse linear map;
//! * [`FoldPenalty`]: the paper's penalty on folded boxes.
//!
//! Depends on [`spline`](crate::spline), [`differentiate`](crate::differentiate) and [`scalar`](crate::scalar). The
//! plane is the default; space is the same code with one more direction.

mod embedding;
mod error;
mod evaluation;
mod folding;
mod inversion;
mod lattice;
mod linear_map;
mod simplices;

pub use embedding::Embedding;
pub use error::FfdError;
pub use evaluation::BoxEvaluator;
pub use folding::{BoxPenalty, FoldPenalty, FoldReport, penalty_of_indicator};
pub use lattice::{FfdBox, Placement};
pub use linear_map::LinearMap;
