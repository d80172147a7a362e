//! Whether a field's domain holds all of its solid.

use super::{Change, Division, Edit, Root};
use crate::geom::{Aabb, DVec3};

/// What is known of the solid outside the domain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coverage {
    /// There is none: the domain holds the whole solid and its surface; of a field of columns, seen along z.
    Whole,
    /// Nothing.
    #[default]
    Unknown,
}

impl Coverage {
    /// Of a shape that lies in `extent`; `None` where it has no end.
    pub fn of(root: &Root, extent: Option<Aabb>) -> Self {
        let holds = |shape: Aabb| {
            let Aabb { min, max } = root.extent;
            let within = |axis: usize| min[axis] <= shape.min[axis] && shape.max[axis] <= max[axis];
            (0..root.division.axes()).all(within)
        };
        if extent.is_some_and(holds) { Self::Whole } else { Self::Unknown }
    }

    /// After edits: what grew may reach beyond the domain.
    pub(super) fn after(self, edits: &[Edit], root: &Root) -> Self {
        let stays = |edit: &Edit| edit.change == Change::Shrunk || Self::of(root, Some(edit.extent)) == Self::Whole;
        if edits.iter().all(stays) { self } else { Self::Unknown }
    }
}

impl Root {
    /// A point of the same distance, with a height that the domain has: columns are the same at every one.
    #[inline]
    pub(super) fn flattened(&self, p: DVec3) -> DVec3 {
        match self.division {
            Division::Octree => p,
            Division::Quadtree => p.with_z(p.z.clamp(self.extent.min.z, self.extent.max.z)),
        }
    }
}
