//! What people want from a field or a mesh.

pub mod contour;
pub mod medial;
pub mod render;
pub mod sampled;
pub mod surface;
pub mod thickness;
