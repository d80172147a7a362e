//! Solids put together: primitives with exact distances, moved, joined, cut, blended, grown and swept.

mod cuboid;
mod half_space;
mod measure;
mod sphere;

pub use cuboid::Cuboid;
pub use half_space::HalfSpace;
pub use sphere::Sphere;
