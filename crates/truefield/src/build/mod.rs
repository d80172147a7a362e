//! Builders: source to field.

pub mod complete;
pub mod difference;
pub mod march;
pub mod raster;
pub mod sampled;
pub(crate) mod sides;
pub mod transform;
pub mod wavefront;
