//! A tree over triangles and the questions it answers exactly.

mod build;
mod frame;
mod nearest;
mod order;
mod tree;

pub use nearest::Candidate;
pub use tree::Tree;
