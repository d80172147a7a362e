//! Adaptively sampled fields: distances at the corners of the cells of a tree that is fine where the shape asks for it.
//!
//! Frisken, Perry, Rockwood, Jones: Adaptively Sampled Distance Fields, 2000. Here every cell, inner ones too, also
//! holds an interval that contains the distance minus what the corners say, so that every answer has bounds and a tree
//! cut anywhere is a field again.

mod accuracy;
mod answer;
mod assemble;
mod beyond;
mod cell;
mod coarse;
mod coverage;
mod cubic;
mod cut;
mod edits;
mod levels;
mod many;
mod model;
mod page;
mod solid;

use std::sync::Arc;

pub use accuracy::{Accuracy, Rule};
pub(crate) use assemble::{Patch, Patched};
pub(crate) use cell::aged_error;
pub use cell::{Cell, Leaf, Root};
pub(crate) use coarse::{about_corners, differences};
pub use coverage::Coverage;
pub(crate) use cubic::{bends, third as cubic_third, value as cubic_value, weights as cubic_weights};
pub(crate) use cut::Frontier;
pub(crate) use edits::farthest;
pub use edits::{Change, Edit, Edits};
pub(crate) use levels::derive_errors;
pub use levels::{Level, LevelKind, Levels};
pub(crate) use page::{Kind, Page};
pub use page::{ListSide, Lists, Record, Samples};
pub use solid::Solid;

use super::each::each;
use crate::distance::Distance;
use crate::error::Result;
use crate::field::Continuity;
use crate::geom::{Aabb, DVec3, Interval};
use crate::run::Run;
use crate::source::mesh::Surface;

/// No cell lies deeper.
pub const MAX_DEPTH: u32 = 24;

/// Into what cells are divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Division {
    /// Eight: every axis is halved.
    Octree,
    /// Four columns: the field does not depend on z, which is never divided.
    Quadtree,
}

impl Division {
    /// Children of a cell.
    pub fn children(self) -> usize {
        match self {
            Self::Octree => 8,
            Self::Quadtree => 4,
        }
    }

    /// Axes that are halved.
    pub(crate) fn axes(self) -> usize {
        match self {
            Self::Octree => 3,
            Self::Quadtree => 2,
        }
    }

    /// Index of a child, counted in cells of its size.
    #[inline]
    pub(crate) fn child(self, index: [u32; 3], octant: usize) -> [u32; 3] {
        let bit = |axis: usize| octant as u32 >> axis & 1;
        match self {
            Self::Octree => [2 * index[0] + bit(0), 2 * index[1] + bit(1), 2 * index[2] + bit(2)],
            Self::Quadtree => [2 * index[0] + bit(0), 2 * index[1] + bit(1), 0],
        }
    }
}

/// Distances on a tree of cells, with bounds. Pages of cells are shared between fields that an edit made of each other.
#[derive(Clone, Debug)]
pub struct AdaptiveField {
    root: Root,
    /// Cells down to the depth of pages.
    top: Arc<Page>,
    pages: Vec<Arc<Page>>,
    /// Whose triangles exact leaves name.
    surface: Option<Arc<Surface>>,
    continuity: Continuity,
    accuracy: Accuracy,
    coverage: Coverage,
    edits: Edits,
}

/// Counts and sizes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AdaptiveStatistics {
    /// All cells, inner ones too.
    pub cells: u64,
    /// Leaves, of every kind.
    pub leaves: u64,
    /// Leaves that answer by tricubic interpolation.
    pub cubic: u64,
    /// Leaves that answer by their triangles.
    pub exact: u64,
    /// Entries of their lists.
    pub entries: u64,
    /// Depth of the deepest leaf.
    pub depth: u32,
    /// Bytes taken, without the surface.
    pub bytes: u64,
}

impl AdaptiveField {
    /// The root cell: the domain.
    pub fn extent_box(&self) -> Aabb {
        self.root.extent
    }

    /// Where the tree lies and how it is divided.
    pub fn placement(&self) -> Root {
        self.root
    }

    /// Into what cells are divided.
    pub fn division(&self) -> Division {
        self.root.division
    }

    /// Whose triangles exact leaves name.
    pub fn surface(&self) -> Option<&Arc<Surface>> {
        self.surface.as_ref()
    }

    /// Where the sign can change.
    pub fn continuity(&self) -> Continuity {
        self.continuity
    }

    /// What was asked of it.
    pub fn accuracy(&self) -> Accuracy {
        self.accuracy
    }

    /// Whether the domain holds the whole solid.
    pub fn coverage(&self) -> Coverage {
        self.coverage
    }

    /// What was changed since it was built.
    pub fn edits(&self) -> &Edits {
        &self.edits
    }

    /// The cell that is the whole domain.
    pub fn root(&self) -> Cell<'_> {
        Cell { field: self, page: &self.top, node: 0, depth: 0, index: [0; 3] }.enter()
    }

    /// The leaf that holds `p`, the upper one where cells meet; `None` outside the domain.
    pub fn find(&self, p: DVec3) -> Option<Cell<'_>> {
        let Aabb { min, max } = self.root.extent;
        if !self.root.extent.contains(p) {
            return None;
        }
        let finest = f64::from(1u32 << MAX_DEPTH);
        let at = ((p - min) / (max - min) * finest).min(DVec3::splat(finest - 1.0));
        Some(self.find_at([at.x as u32, at.y as u32, at.z as u32]))
    }

    /// The leaf that holds the cell of the greatest depth with an index.
    fn find_at(&self, at: [u32; 3]) -> Cell<'_> {
        let (mut page, mut node, mut depth) = (&*self.top, 0, 0);
        loop {
            match page.words[node].kind() {
                Kind::Branch(first) => {
                    depth += 1;
                    let bit = |axis: usize| (at[axis] >> (MAX_DEPTH - depth) & 1) as usize;
                    let upper = if self.root.division == Division::Octree { bit(2) } else { 0 };
                    node = first as usize + (bit(0) | bit(1) << 1 | upper << 2);
                }
                Kind::Portal(number) => (page, node) = (&self.pages[number as usize], 0),
                Kind::Linear | Kind::Cubic(_) | Kind::Exact(_) => break,
            }
        }
        let mut index = at.map(|at| at >> (MAX_DEPTH - depth));
        if self.root.division == Division::Quadtree {
            index[2] = 0;
        }
        Cell { field: self, page, node, depth, index }
    }

    /// The value at a corner of the cell of some depth and index, the same whichever cell it is a corner of: that of the
    /// leaves of which it is a corner too, or else what the uppermost leaf says there.
    pub(crate) fn corner_value(&self, depth: u32, index: [u32; 3], corner: usize) -> f64 {
        let axes = self.root.division.axes();
        let shift = MAX_DEPTH - depth;
        // In cells of the greatest depth; a quadtree has one along z.
        let place: [u32; 3] =
            std::array::from_fn(|axis| if axis < axes { (index[axis] + (corner as u32 >> axis & 1)) << shift } else { 0 });
        let end = (1u32 << MAX_DEPTH) - 1;
        let mut uppermost = None;
        for side in 0..1usize << axes {
            let below = |axis: usize| side >> axis & 1 == 1;
            if (0..axes).any(|axis| below(axis) && (place[axis] == 0 || place[axis] > end)) {
                continue;
            }
            let at = std::array::from_fn(|axis| if below(axis) { place[axis] - 1 } else { place[axis].min(end) });
            let leaf = self.find_at(at);
            let shift = MAX_DEPTH - leaf.depth;
            let within = |axis: usize| place[axis] - (leaf.index[axis] << shift);
            if (0..axes).all(|axis| within(axis) & ((1 << shift) - 1) == 0) {
                let own =
                    (0..axes).map(|axis| usize::from(within(axis) != 0) << axis).sum::<usize>() | (corner & if axes == 2 { 4 } else { 0 });
                return f64::from(leaf.corners()[own]);
            }
            uppermost.get_or_insert(leaf);
            if (0..axes).all(|axis| within(axis) & ((1 << shift) - 1) != 0) {
                break;
            }
        }
        let p = self.root.cell(depth, index).corner(corner);
        uppermost.map_or(f64::NAN, |leaf| leaf.value(p))
    }

    /// What the field says: interpolated, or exact in exact leaves; `None` outside the domain.
    pub fn interpolate(&self, p: DVec3) -> Option<f64> {
        self.find(p).map(|cell| cell.value(p))
    }

    /// [`AdaptiveField::interpolate`] for many points; not a number outside the domain.
    pub fn distances(&self, points: &[DVec3], run: &Run<'_>) -> Result<Vec<f64>> {
        self.answer(points, run, |p| self.interpolate(p).unwrap_or(f64::NAN), |cell, p, nearest| cell.exact_value(p, nearest))
    }

    /// The intervals that contain the true distances, outside the domain too.
    pub fn bounds(&self, points: &[DVec3], run: &Run<'_>) -> Result<Vec<Interval>> {
        self.answer(points, run, |p| self.at(p), |cell, p, nearest| cell.exact_bounds(p, nearest))
    }

    /// Unit vectors in which the field grows fastest, zero where it grows nowhere; not numbers outside the domain.
    pub fn gradients(&self, points: &[DVec3], run: &Run<'_>) -> Result<Vec<DVec3>> {
        each(points, run, |p| self.find(p).map_or(DVec3::NAN, |cell| cell.gradient(p).normalize_or_zero()))
    }

    /// Every cell, parents before children, siblings in order; `visit` says whether to go on below it.
    pub fn walk<'a>(&'a self, visit: &mut impl FnMut(Cell<'a>) -> bool) {
        let mut stack = vec![self.root()];
        while let Some(cell) = stack.pop() {
            if visit(cell) {
                stack.extend((0..cell.children()).rev().map(|octant| cell.child(octant)));
            }
        }
    }

    /// Counts and sizes.
    pub fn statistics(&self) -> AdaptiveStatistics {
        let mut s =
            AdaptiveStatistics { bytes: (self.pages.len() * size_of::<Arc<Page>>()) as u64 + self.top.bytes(), ..Default::default() };
        s.bytes += self.pages.iter().map(|page| page.bytes()).sum::<u64>();
        self.walk(&mut |cell| {
            s.cells += 1;
            s.depth = s.depth.max(cell.depth);
            if cell.is_leaf() {
                s.leaves += 1;
                match cell.leaf() {
                    Leaf::Linear => {}
                    Leaf::Cubic(_) => s.cubic += 1,
                    Leaf::Exact(list) => (s.exact, s.entries) = (s.exact + 1, s.entries + list.len() as u64),
                }
            }
            true
        });
        s
    }

    /// A few ulp for the places of corners and points.
    fn rounding(&self, p: DVec3) -> f64 {
        8.0 * f64::EPSILON * (p.abs().max_element() + self.root.extent.min.abs().max(self.root.extent.max.abs()).max_element())
    }
}
