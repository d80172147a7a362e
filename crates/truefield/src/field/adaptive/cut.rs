//! Fields that end where another goes on.

use std::sync::Arc;

use super::assemble::{Shape, Tree, kept, page};
use super::page::{PAGE_DEPTH, Record};
use super::{Accuracy, AdaptiveField, Cell, MAX_DEPTH};
use crate::error::Result;
use crate::run::Run;

/// Cells that end, none below another, in the order of a walk.
#[derive(Clone, Debug, Default)]
pub(crate) struct Frontier(Vec<u128>);

impl Frontier {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Leaves those that were found first.
    pub fn truncate(&mut self, count: usize) {
        self.0.truncate(count);
    }

    /// Adds a cell that a walk meets after all others.
    pub fn push(&mut self, cell: &Cell<'_>) {
        self.0.push(place(cell));
    }

    /// Adds cells that a walk meets after all others.
    pub fn append(&mut self, mut others: Self) {
        self.0.append(&mut others.0);
    }

    /// Whether a cell is one of them.
    pub fn holds(&self, cell: &Cell<'_>) -> bool {
        self.0.binary_search(&place(cell)).is_ok()
    }
}

/// Where a walk meets the cell: three bits for the child at each depth, and the depth, since first children lie at one place.
fn place(cell: &Cell<'_>) -> u128 {
    let [x, y, z] = cell.index();
    let bit = |index: u32, depth: u32| u128::from(index >> depth & 1);
    let path = (0..cell.depth()).rev().fold(0, |path, depth| path << 3 | bit(z, depth) << 2 | bit(y, depth) << 1 | bit(x, depth));
    path << (3 * (MAX_DEPTH - cell.depth()) + 8) | u128::from(cell.depth())
}

/// Another field down to some cells.
struct Cut<'a, F> {
    root: Cell<'a>,
    ends: F,
}

impl<'a, F: Fn(&Cell<'a>) -> bool> Tree for Cut<'a, F> {
    type Node = Cell<'a>;

    fn record(&self, cell: Cell<'a>) -> Record {
        *cell.record()
    }

    fn shape(&self, cell: Cell<'a>, children: &mut Vec<Cell<'a>>) -> Shape<'_> {
        if !cell.is_leaf() && (self.ends)(&cell) { Shape::Linear } else { kept(cell, children, |child| child) }
    }
}

impl AdaptiveField {
    /// The field without what is below some cells, which interpolate their corners then.
    pub(crate) fn cut<'a>(&'a self, ends: impl Fn(&Cell<'a>) -> bool + Sync, accuracy: Accuracy, run: &Run<'_>) -> Result<Self> {
        let (tree, mut portals) = (Cut { root: self.root(), ends }, Vec::new());
        let top = page(&tree, tree.root, 0, &mut portals);
        let pages = run.blocks("put the tree together", portals.len(), |number| {
            Ok(Arc::new(page(&tree, portals[number], PAGE_DEPTH, &mut Vec::new())))
        })?;
        Ok(Self { top: Arc::new(top), pages, accuracy, edits: self.edits.clone(), surface: self.surface.clone(), ..*self })
    }
}
