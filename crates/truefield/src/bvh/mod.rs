//! A tree over triangles and the questions it answers exactly.

pub(crate) mod boundary;
mod build;
mod cloud;
pub(crate) mod cover;
pub(crate) mod descend;
pub(crate) mod evaluate;
pub(crate) mod feet;
mod frame;
pub(crate) mod intersect;
mod nearest;
pub(crate) mod octants;
pub(crate) mod order;
pub(crate) mod pairs;
mod ray;
pub(crate) mod tree;
pub mod winding;

pub use nearest::Candidate;
pub use ray::{Hit, Ray};
pub use tree::Tree;
