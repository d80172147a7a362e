//! Stored representations: layout and lookup, no construction.

pub mod complete;
pub mod sampled;

pub use complete::CompleteField;
pub use sampled::SampledField;
