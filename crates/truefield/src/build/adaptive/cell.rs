//! Cells on their way to be proven.

use super::corner::Corner;
use super::facets::At;
use super::halves::steps;
use crate::bvh::cover::Range;
use crate::bvh::tree::Slot;
use crate::geom::{Aabb, Interval};
use crate::grid::Grid;
use crate::source::mesh::Side;

/// A cell to be judged, and what its parent knew.
#[derive(Clone, Copy)]
pub(super) struct Start {
    /// Lattice indices of its lowest corner.
    pub low: [i64; 3],
    /// In lattice cells.
    pub edge: i64,
    /// The side of all its points, where that is known.
    pub side: Option<Side>,
    /// Of unsigned distances in it.
    pub range: Range,
}

/// Lattice indices of a corner of the cell from `low` on.
pub(super) fn place(low: [i64; 3], edge: i64, corner: usize) -> [i64; 3] {
    [0, 1, 2].map(|axis| low[axis] + (corner >> axis & 1) as i64 * edge)
}

impl Start {
    pub fn cell(&self, lattice: &Grid) -> Aabb {
        let at = |corner| {
            let [x, y, z] = place(self.low, self.edge, corner);
            lattice.corner(x, y, z)
        };
        Aabb::new(at(0), at(7))
    }

    /// One of eight parts, of which all that is known holds.
    pub fn part(&self, octant: usize) -> Self {
        let half = self.edge / 2;
        Self { low: place(self.low, half, octant), edge: half, ..*self }
    }

    /// Lattice indices of a corner of its parts.
    pub fn node(&self, number: usize) -> [i64; 3] {
        let steps = steps(number);
        [0, 1, 2].map(|axis| self.low[axis] + steps[axis] * (self.edge / 2))
    }

    /// With what else is known of its range.
    pub fn within(self, range: Range) -> Self {
        Self { range: Range { lower: self.range.lower.max(range.lower), upper: self.range.upper.min(range.upper) }, ..self }
    }
}

/// A cell, what it says and what is proven of it.
pub(super) struct Seen<'a> {
    pub start: Start,
    pub cell: Aabb,
    pub corners: &'a [Corner; 8],
    pub values: [f32; 8],
    /// The values in the tree's units.
    pub told: [f64; 8],
    /// The largest error that is allowed.
    pub limit: f64,
    /// Contains the distance minus what is told.
    pub known: Interval,
}

impl Seen<'_> {
    pub fn at<'b>(&'b self, list: &'b [Slot]) -> At<'b> {
        let Start { range, side, .. } = self.start;
        At { cell: self.cell, range, side, corners: self.corners, told: self.told, list }
    }

    /// Whether no more is asked of it.
    pub fn is_within(&self) -> bool {
        within(self.known, self.limit)
    }
}

/// A part of a cell, and what follows from its corners.
pub(super) struct Part {
    pub start: Start,
    pub cell: Aabb,
    pub corners: [Corner; 8],
}

impl Part {
    /// What is told by the cell that it is a part of.
    pub fn at<'b>(&'b self, told: [f64; 8], list: &'b [Slot]) -> At<'b> {
        let Start { range, side, .. } = self.start;
        At { cell: self.cell, range, side, corners: &self.corners, told, list }
    }
}

pub(super) fn within(error: Interval, limit: f64) -> bool {
    error.upper <= limit && error.lower >= -limit
}
