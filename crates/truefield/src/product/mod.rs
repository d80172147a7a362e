//! What people want from a field or a mesh.

pub mod render;
pub mod thickness;
