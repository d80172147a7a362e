//! What people want from a field or a mesh.

mod clearance;
pub mod collide;
pub mod contour;
pub mod dual;
pub mod medial;
mod piece;
pub mod raycast;
pub mod render;
pub mod sampled;
pub mod surface;
pub mod thickness;
