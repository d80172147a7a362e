//! Points, boxes, intervals and triangles: pure and allocation-free.

mod aabb;
mod affine;
mod facet;
mod interval;
mod overlap;
mod plane;

pub use aabb::Aabb;
pub use affine::Affine;
pub(crate) use facet::Foot;
pub use facet::{Facet, FacetPoint};
pub use glam::DVec3;
pub use interval::Interval;
pub use overlap::{triangle_meets_segment, triangle_overlaps_box};
pub(crate) use plane::side_of_plane;

/// Which part of a triangle is nearest: the papers' cases C1, C2 and C3.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Feature {
    /// The interior (C1).
    Face,
    /// Edge 0 = v0 v1, 1 = v1 v2, 2 = v2 v0 (C2).
    Edge(u8),
    /// Corner 0, 1 or 2 (C3).
    Vertex(u8),
}

impl Feature {
    /// 0 for a face, 1 to 3 for an edge, 4 to 6 for a vertex: the code used in arrays and files.
    pub const fn code(self) -> u8 {
        match self {
            Self::Face => 0,
            Self::Edge(index) => 1 + index,
            Self::Vertex(index) => 4 + index,
        }
    }
}

/// The nearest point of a shape and how far it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// The nearest point of the surface.
    pub point: DVec3,
    /// Signed distance, negative inside; by the sign rule's best guess where the side is doubtful.
    pub distance: f64,
    /// The element (triangle) that holds `point`; the lowest index where several tie.
    pub element: u32,
    /// The part of the element that holds `point`.
    pub feature: Feature,
    /// Unit gradient of the signed distance: the face normal in case C1, the direction
    /// from the nearest point in cases C2 and C3, turned outward.
    pub normal: DVec3,
}
