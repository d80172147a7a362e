//! Layout of the tree: eight children a node, boxes in single precision rounded outward around a
//! local centre, leaves of up to eight triangles in lanes.

use super::frame::Frame;
use crate::geom::{Aabb, DVec3, Facet};

/// Children of a node and triangles of a leaf.
pub(crate) const WIDTH: usize = 8;

/// Marks a child that is a leaf: the rest is the index of its packet.
pub(crate) const LEAF: u32 = 1 << 31;

/// Marks a child that is not there.
pub(crate) const ABSENT: u32 = u32::MAX;

/// Boxes of up to eight children, relative to the tree's centre.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(crate) struct Node {
    pub min: [[f32; WIDTH]; 3],
    pub max: [[f32; WIDTH]; 3],
    pub child: [u32; WIDTH],
}

/// Up to eight facets in lanes; unused lanes repeat the last facet.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(crate) struct Packet {
    pub a: [[f64; WIDTH]; 3],
    pub ab: [[f64; WIDTH]; 3],
    pub ac: [[f64; WIDTH]; 3],
    pub v: [[f64; WIDTH]; 3],
    pub inverse: [[f64; WIDTH]; 3],
    pub slope: [f64; WIDTH],
    pub triangle: [u32; WIDTH],
    /// The slots of the facets: `first .. first + count`.
    pub first: u32,
    pub count: u32,
}

/// A triangle's place in the tree's own order, in which neighbours in space are neighbours in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Slot(pub u32);

impl Packet {
    #[inline(always)]
    pub fn facet(&self, lane: usize) -> Facet {
        let get = |v: &[[f64; WIDTH]; 3]| DVec3::new(v[0][lane], v[1][lane], v[2][lane]);
        Facet {
            a: get(&self.a),
            ab: get(&self.ab),
            ac: get(&self.ac),
            v: get(&self.v),
            inverse: get(&self.inverse),
            slope: self.slope[lane],
        }
    }
}

/// A bounding volume hierarchy over the triangles of one mesh.
///
/// Memory: about half a kilobyte a triangle. Every query is exact: it gives the bits of a brute-force
/// search with [`Facet::nearest`] over all triangles, the lowest index on ties.
#[derive(Clone, Debug)]
pub struct Tree {
    pub(crate) nodes: Vec<Node>,
    pub(crate) packets: Vec<Packet>,
    /// By slot.
    pub(crate) facets: Vec<Facet>,
    /// By slot.
    pub(crate) frames: Vec<Frame>,
    /// Triangle of every slot.
    pub(crate) triangles: Vec<u32>,
    /// Slot of every triangle.
    pub(crate) slots: Vec<Slot>,
    pub(crate) extent: Aabb,
    pub(crate) center: DVec3,
    /// Radius of the ball around the extent.
    pub(crate) radius: f64,
}

impl Tree {
    /// The box of all triangles.
    pub fn extent(&self) -> Aabb {
        self.extent
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.facets.len()
    }

    /// Never: a mesh has at least one triangle.
    pub fn is_empty(&self) -> bool {
        self.facets.is_empty()
    }

    /// A triangle prepared for nearest-point queries.
    pub fn facet(&self, triangle: u32) -> &Facet {
        self.facet_at(self.slots[triangle as usize])
    }

    /// The triangles of each leaf, neighbours in space.
    pub(crate) fn leaves(&self) -> impl Iterator<Item = &[u32]> {
        self.packets.iter().map(|packet| &self.triangles[packet.first as usize..(packet.first + packet.count) as usize])
    }

    #[inline(always)]
    pub(crate) fn facet_at(&self, slot: Slot) -> &Facet {
        &self.facets[slot.0 as usize]
    }

    #[inline(always)]
    pub(crate) fn frame_at(&self, slot: Slot) -> &Frame {
        &self.frames[slot.0 as usize]
    }

    #[inline(always)]
    pub(crate) fn triangle(&self, slot: Slot) -> u32 {
        self.triangles[slot.0 as usize]
    }
}
