//! What people want from a field or a mesh.

pub mod contour;
pub mod render;
pub mod surface;
pub mod thickness;
