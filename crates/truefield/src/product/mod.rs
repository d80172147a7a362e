//! What people want from a field or a mesh.

mod clearance;
pub mod collide;
pub mod contour;
pub mod dual;
pub mod medial;
pub mod nearest;
mod piece;
pub mod raycast;
mod reach;
pub mod render;
pub mod sampled;
pub mod surface;
pub mod thickness;
