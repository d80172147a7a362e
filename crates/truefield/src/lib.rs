//! Distance fields that people can trust.
//!
//! Any shape, one question: how far is it from here? Every answer is an [`geom::Interval`] that
//! contains the true distance, of zero width where the answer is exact. Lengths are in model
//! units, distances are negative inside.

pub mod build;
pub mod bvh;
pub mod distance;
pub mod error;
pub mod field;
pub mod geom;
pub mod grid;
pub mod lattice;
#[cfg(feature = "laws")]
pub mod laws;
pub mod mesh;
pub mod op;
pub mod product;
pub mod run;
mod simd;
pub mod source;

pub use distance::{Closest, Distance, SampleBlock, Source};
pub use error::{Error, Result};
pub use field::{CompleteField, Continuity, Known, Parts, SampledField};
pub use geom::{Aabb, Affine, DVec3, Feature, Interval, Nearest};
pub use grid::Grid;
pub use lattice::Lattice;
pub use mesh::TriangleMesh;
pub use run::{Cancel, Progress, Run, Silent};
pub use source::mesh::{Check, Found, SignChoice, SignKind, SignRule, Surface};
