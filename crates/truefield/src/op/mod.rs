//! Sampled fields to sampled fields.
//!
//! Each result is the field of a new solid, and its bounds hold the signed distance of that solid: the least of two
//! distances is the distance of the union outside of both, and only a bound of it inside.

pub mod boolean;
pub mod edit;
pub mod level_of_detail;
pub mod offset;
pub mod resample;
mod solid;
mod tighten;
