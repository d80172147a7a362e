//! Shapes that can be asked their distance.

pub mod mesh;
