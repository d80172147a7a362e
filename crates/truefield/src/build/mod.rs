//! Builders: source to field.

pub mod complete;
pub mod sampled;
pub(crate) mod sides;
