//! Shapes that can be asked their distance.

mod ask;
pub(crate) mod balls;
pub mod csg;
pub mod function;
pub mod implicit;
pub(crate) mod kink;
pub mod mesh;
pub mod patch;
pub mod polygon;
pub(crate) mod tangent;
pub(crate) mod waiting;

pub use ask::{bounds, gradients, values};
