//! Surfaces of bicubic Bezier patches: the closest point, with proof.

mod bends;
mod bezier;
mod nearest;
mod net;
mod oriented;
mod piece;
mod side;
mod surface;
mod tree;

pub use bezier::Bezier;
pub use surface::{Patches, Sides};
