//! Solids put together: primitives with exact distances, moved, joined, cut, blended, grown and swept.

mod blend;
mod boxes;
mod capsule;
mod complement;
mod cuboid;
mod ellipsoid;
mod exact;
mod frustum;
mod half_space;
mod kept;
mod level;
mod measure;
mod molecule;
mod offset;
mod placed;
mod sphere;
mod sponge;
mod stroke;
mod torus;
mod union;

pub use blend::{Blend, BlendKind};
pub use capsule::Capsule;
pub use complement::{Complement, difference, intersection};
pub use cuboid::Cuboid;
pub use ellipsoid::Ellipsoid;
pub use exact::Exact;
pub use frustum::Frustum;
pub use half_space::HalfSpace;
pub use molecule::Molecule;
pub use offset::{Offset, shell};
pub use placed::{Placed, Placement};
pub use sphere::Sphere;
pub use sponge::Sponge;
pub use stroke::{sweep, tube};
pub use torus::Torus;
pub use union::Union;
