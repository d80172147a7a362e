//! Halving blocks of a lattice from coarse to fine, each with its complete list of candidates.

use super::cover::{OCTANTS, Range, Scratch, center_range, gather, refine};
use super::tree::{Slot, Tree};
use crate::error::Result;
use crate::geom::Aabb;
use crate::grid::Grid;

/// What the lattice indices of a block stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Span {
    /// Lattice points: a block reaches from its first to its last point.
    Points,
    /// Cells: a block reaches to the far corners of its last cells.
    Cells,
}

/// A box of global lattice indices, `low` included, `high` not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Block {
    pub low: [i64; 3],
    pub high: [i64; 3],
}

impl Block {
    /// Indices along the longest side.
    pub fn edge(&self) -> i64 {
        (0..3).map(|axis| self.high[axis] - self.low[axis]).max().unwrap_or(0)
    }

    /// Whether `other` is part of it.
    pub fn holds(&self, other: &Self) -> bool {
        (0..3).all(|axis| self.low[axis] <= other.low[axis] && other.high[axis] <= self.high[axis])
    }

    /// The space it stands for.
    pub fn extent(&self, lattice: &Grid, span: Span) -> Aabb {
        let last = match span {
            Span::Points => self.high.map(|i| i - 1),
            Span::Cells => self.high,
        };
        let ([a, b, c], [d, e, f]) = (self.low, last);
        Aabb::new(lattice.corner(a, b, c), lattice.corner(d, e, f))
    }

    /// The blocks of edge `edge` that tile `lattice`, in order; they start at multiples of `edge`.
    pub fn tiles(lattice: &Grid, edge: i64) -> Vec<Self> {
        let start = lattice.first;
        let end: [i64; 3] = std::array::from_fn(|axis| start[axis] + i64::from(lattice.shape[axis]));
        let tiles = |axis: usize| start[axis].div_euclid(edge)..(end[axis] + edge - 1).div_euclid(edge);
        let mut out = Vec::new();
        for i in tiles(0) {
            for j in tiles(1) {
                for k in tiles(2) {
                    let tile = [i, j, k];
                    out.push(Self {
                        low: std::array::from_fn(|axis| (tile[axis] * edge).max(start[axis])),
                        high: std::array::from_fn(|axis| ((tile[axis] + 1) * edge).min(end[axis])),
                    });
                }
            }
        }
        out
    }

    /// The up to eight blocks of half the edge, split at multiples of it.
    fn halves(&self, edge: i64) -> impl Iterator<Item = Self> {
        let Self { low, high } = *self;
        (0..8).filter_map(move |octant| {
            let mut half = Self { low, high };
            for axis in 0..3 {
                let middle = (low[axis].div_euclid(2 * edge) * 2 + 1) * edge;
                if octant >> (2 - axis) & 1 == 0 {
                    half.high[axis] = high[axis].min(middle);
                } else {
                    half.low[axis] = low[axis].max(middle);
                }
                if half.low[axis] >= half.high[axis] {
                    return None;
                }
            }
            Some(half)
        })
    }
}

/// A block with what is known about it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Visit<'a> {
    pub block: Block,
    pub cell: Aabb,
    /// Bounds of the unsigned distance in the block.
    pub range: Range,
    /// Every triangle that can be nearest somewhere in the block, ascending in the tree's order.
    pub list: &'a [Slot],
}

/// What to do with a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Step {
    /// Nothing more is wanted of it.
    Done,
    /// Halve it and shorten the lists of its halves.
    Refine,
    /// Halve it; its list is short enough to serve its halves.
    Share,
}

/// Walks the blocks of one tile, halving as the visitor asks.
pub(crate) struct Descent<'a> {
    pub tree: &'a Tree,
    pub lattice: &'a Grid,
    pub span: Span,
    scratch: Scratch,
    /// Lists that no block uses at present.
    lists: Vec<[Vec<Slot>; OCTANTS]>,
    /// The triangle found last; it may be near the next block too.
    near: Slot,
}

impl<'a> Descent<'a> {
    pub fn new(tree: &'a Tree, lattice: &'a Grid, span: Span) -> Self {
        Self { tree, lattice, span, scratch: Scratch::default(), lists: Vec::new(), near: Slot(0) }
    }

    /// Visits `tile`, whose edge is at most `edge` (a power of two), and its parts.
    ///
    /// A tile where no distance in `window` can occur is shown with its range and no list.
    pub fn tile(&mut self, tile: Block, edge: i64, window: Range, visit: &mut impl FnMut(Visit<'_>) -> Result<Step>) -> Result<()> {
        let cell = tile.extent(self.lattice, self.span);
        let mut list = Vec::new();
        let range = gather(self.tree, &cell, self.near, window, &mut self.scratch, &mut list);
        self.block(Visit { block: tile, cell, range, list: &list }, edge, visit)
    }

    /// As [`Self::tile`]; blocks above the edge `fine` are shown without lists, and divided where distances in `window` can occur.
    ///
    /// Down to blocks of that edge single queries tell where those are: quicker than lists while little is wanted.
    pub fn survey(
        &mut self,
        tile: Block,
        edge: i64,
        fine: i64,
        window: Range,
        visit: &mut impl FnMut(Visit<'_>) -> Result<Step>,
    ) -> Result<()> {
        // Where the lattice ends blocks may be smaller than their edge.
        if tile.edge() <= fine {
            return self.tile(tile, edge, window, visit);
        }
        let cell = tile.extent(self.lattice, self.span);
        let (found, range) = center_range(self.tree, &cell, self.near);
        self.near = self.tree.slots[found.triangle as usize];
        if visit(Visit { block: tile, cell, range, list: &[] })? == Step::Done || !range.meets(window) {
            return Ok(());
        }
        for half in tile.halves(edge / 2) {
            self.survey(half, edge / 2, fine, window, visit)?;
        }
        Ok(())
    }

    fn block(&mut self, at: Visit<'_>, edge: i64, visit: &mut impl FnMut(Visit<'_>) -> Result<Step>) -> Result<()> {
        let step = visit(at)?;
        if step == Step::Done || edge <= 1 {
            return Ok(());
        }
        let half = edge / 2;
        let mut blocks = [at.block; OCTANTS];
        let mut cells = [at.cell; OCTANTS];
        let mut count = 0;
        for block in at.block.halves(half) {
            (blocks[count], cells[count]) = (block, block.extent(self.lattice, self.span));
            count += 1;
        }
        if step == Step::Share {
            for (&block, &cell) in blocks.iter().zip(&cells).take(count) {
                self.block(Visit { block, cell, ..at }, half, visit)?;
            }
            return Ok(());
        }
        let mut lists = self.lists.pop().unwrap_or_default();
        let ranges = refine(self.tree, &cells[..count], at.list, &mut self.scratch, &mut lists);
        for i in 0..count {
            self.block(Visit { block: blocks[i], cell: cells[i], range: ranges[i], list: &lists[i] }, half, visit)?;
        }
        self.lists.push(lists);
        Ok(())
    }
}
