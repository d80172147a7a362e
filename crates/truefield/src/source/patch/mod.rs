//! Surfaces of bicubic Bezier patches: the closest point, with proof.

mod bezier;
mod oriented;
mod piece;
mod surface;

pub use bezier::Bezier;
pub use surface::{Patches, Sides};
