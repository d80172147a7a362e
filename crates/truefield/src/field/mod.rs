//! Stored representations: layout and lookup, no construction.

pub mod adaptive;
pub mod complete;
mod complete_many;
mod each;
pub mod parts;
pub mod sampled;

pub use adaptive::{AdaptiveField, AdaptiveStatistics, Cell, Division, Leaf};
pub use complete::CompleteField;
pub use parts::Parts;
pub use sampled::{Continuity, Known, SampledField};
