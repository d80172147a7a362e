//! Putting pages together: from flat arrays, or from a patched tree, whose untouched pages are shared.

use std::collections::{HashMap, HashSet, VecDeque};
use std::sync::Arc;

use super::page::{Kind, ListSide, PAGE_DEPTH, Page, Record, Samples, Word};
use super::{AdaptiveField, Cell, Edits, Leaf, about_corners};
use crate::error::Result;
use crate::geom::Interval;
use crate::run::Run;

/// Anything that can be walked from its root down.
pub(super) trait Tree {
    /// A cell.
    type Node: Copy;
    /// What is stored of it.
    fn record(&self, node: Self::Node) -> Record;
    /// What it is; the children of a branch, one after the other, are added to `children`.
    fn shape(&self, node: Self::Node, children: &mut Vec<Self::Node>) -> Shape<'_>;
}

/// What a cell is.
pub(super) enum Shape<'a> {
    Branch,
    Linear,
    Cubic(&'a Samples),
    Exact(ListSide, &'a [u32]),
}

/// The page below a cell; branches at the depth of pages, but for the first cell itself, become portals.
pub(super) fn page<T: Tree>(tree: &T, first: T::Node, depth: u32, portals: &mut Vec<T::Node>) -> Page {
    let mut page = Page::default();
    page.push(tree.record(first));
    let mut waiting = VecDeque::from([(depth, first, 0)]);
    let mut children = Vec::new();
    while let Some((at, node, place)) = waiting.pop_front() {
        children.clear();
        let kind = match tree.shape(node, &mut children) {
            Shape::Branch if at == PAGE_DEPTH && depth < at => {
                portals.push(node);
                Kind::Portal(portals.len() as u32 - 1)
            }
            Shape::Branch => {
                let first = page.words.len() as u32;
                for &child in &children {
                    let place = page.push(tree.record(child));
                    waiting.push_back((at + 1, child, place));
                }
                Kind::Branch(first)
            }
            Shape::Linear => Kind::Linear,
            Shape::Cubic(samples) => {
                page.cubics.push(*samples);
                Kind::Cubic(page.cubics.len() as u32 - 1)
            }
            Shape::Exact(side, list) => Kind::Exact(page.lists.push(side, list) as u32),
        };
        page.words[place] = Word::from(kind);
    }
    page.words.shrink_to_fit();
    page.records.shrink_to_fit();
    page
}

/// A cell of a patched tree.
#[derive(Clone, Debug)]
pub(crate) enum Patched<'a> {
    /// As it was, with all below.
    Kept(Cell<'a>),
    /// A branch, and the number of its first child.
    Branch(Record, u32),
    /// A leaf that interpolates its corners.
    Linear(Record),
    /// A leaf that interpolates samples.
    Cubic(Record, Box<Samples>),
    /// A leaf that answers by triangles.
    Exact(Record, ListSide, &'a [u32]),
}

/// A tree that shares cells with another one; number 0 is its root.
pub(crate) struct Patch<'a> {
    pub old: &'a AdaptiveField,
    pub cells: Vec<Patched<'a>>,
    pub edits: Edits,
}

/// A cell of the patch, or one below a cell that was kept.
#[derive(Clone, Copy)]
pub(super) enum Place<'a> {
    New(u32),
    Old(Cell<'a>),
}

impl<'a> Tree for Patch<'a> {
    type Node = Place<'a>;

    fn record(&self, node: Place<'a>) -> Record {
        match node {
            Place::Old(cell) => *cell.record(),
            Place::New(number) => self.cells[number as usize].record(),
        }
    }

    fn shape(&self, node: Place<'a>, children: &mut Vec<Place<'a>>) -> Shape<'_> {
        let cell = match node {
            Place::Old(cell) => cell,
            Place::New(number) => match &self.cells[number as usize] {
                Patched::Kept(cell) => *cell,
                Patched::Branch(_, first) => {
                    children.extend((*first..first + self.old.division().children() as u32).map(Place::New));
                    return Shape::Branch;
                }
                Patched::Linear(_) => return Shape::Linear,
                Patched::Cubic(_, samples) => return Shape::Cubic(samples),
                Patched::Exact(_, side, list) => return Shape::Exact(*side, list),
            },
        };
        kept(cell, children, Place::Old)
    }
}

/// What a cell of a field is, with its children as nodes of another tree.
pub(super) fn kept<'a, N>(cell: Cell<'a>, children: &mut Vec<N>, node: impl Fn(Cell<'a>) -> N) -> Shape<'a> {
    if !cell.is_leaf() {
        children.extend((0..cell.children()).map(|octant| node(cell.child(octant))));
        return Shape::Branch;
    }
    match cell.leaf() {
        Leaf::Linear => Shape::Linear,
        Leaf::Cubic(samples) => Shape::Cubic(samples),
        Leaf::Exact(list) => Shape::Exact(cell.list_side(), list),
    }
}

impl Patched<'_> {
    /// What is stored of the cell.
    pub fn record(&self) -> Record {
        match self {
            Self::Kept(cell) => *cell.record(),
            Self::Branch(record, _) | Self::Linear(record) | Self::Cubic(record, _) | Self::Exact(record, ..) => *record,
        }
    }
}

impl Patched<'_> {
    /// Contains the distance minus the interpolated corners.
    pub fn error_about_corners(&self) -> Interval {
        let samples = match self {
            Self::Kept(cell) => match cell.leaf() {
                Leaf::Cubic(samples) => Some(samples),
                Leaf::Linear | Leaf::Exact(_) => None,
            },
            Self::Cubic(_, samples) => Some(&**samples),
            _ => None,
        };
        about_corners(&self.record(), samples)
    }
}

impl Patch<'_> {
    /// The field; pages that hold what they held are shared with the old one.
    pub fn field(&self, run: &Run<'_>) -> Result<AdaptiveField> {
        let mut portals = Vec::new();
        let top = page(self, Place::New(0), 0, &mut portals);
        let known: HashMap<usize, usize> = self.old.pages.iter().enumerate().map(|(n, page)| (Arc::as_ptr(page).addr(), n)).collect();
        let pages = run.blocks("put the tree together", portals.len(), |number| {
            let kept = match portals[number] {
                Place::Old(cell) => Some(cell),
                Place::New(number) => match self.cells[number as usize] {
                    Patched::Kept(cell) => Some(cell),
                    _ => None,
                },
            };
            if let Some(&number) = kept.and_then(|cell| known.get(&std::ptr::from_ref(cell.page).addr())) {
                return Ok(Arc::clone(&self.old.pages[number]));
            }
            Ok(Arc::new(page(self, portals[number], PAGE_DEPTH, &mut Vec::new())))
        })?;
        let AdaptiveField { root, continuity, accuracy, coverage, .. } = *self.old;
        let fresh = self.edits.list().get(self.old.edits.list().len()..).unwrap_or_default();
        Ok(AdaptiveField {
            root,
            top: Arc::new(top),
            pages,
            surface: self.old.surface.clone(),
            continuity,
            accuracy,
            coverage: coverage.after(fresh, &root),
            edits: self.edits.clone(),
        })
    }
}

impl AdaptiveField {
    /// How many pages it shares with another field, which take no memory of their own, and how many it has.
    pub fn shared_pages(&self, other: &Self) -> (usize, usize) {
        let theirs: HashSet<usize> = other.pages.iter().map(|page| Arc::as_ptr(page).addr()).collect();
        let shared = self.pages.iter().filter(|page| theirs.contains(&Arc::as_ptr(page).addr()));
        (shared.count(), self.pages.len())
    }
}
