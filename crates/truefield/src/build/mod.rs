//! Builders: source to field.

pub mod adaptive;
pub mod complete;
pub mod difference;
pub mod march;
pub mod marched;
pub mod raster;
pub mod sampled;
pub(crate) mod sides;
pub(crate) mod tiles;
pub mod transform;
pub mod voxelize;
pub mod wavefront;
