//! A whole tree as flat arrays, level by level: what builders make and files hold. Its first levels are a coarser field.

use std::collections::VecDeque;
use std::sync::Arc;

use super::assemble::{Shape, Tree, page};
use super::page::{Lists, PAGE_DEPTH, Record, Samples};
use super::{Accuracy, AdaptiveField, Cell, Coverage, Division, Edits, Leaf, MAX_DEPTH, Root, about_corners, differences};
use crate::error::{Error, Result};
use crate::field::Continuity;
use crate::geom::Interval;
use crate::run::Run;
use crate::source::mesh::Surface;

/// What a cell of a level is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LevelKind {
    /// The n-th branch of a level has the n-th group of siblings in the next.
    Branch,
    /// A leaf that interpolates its corners.
    Linear,
    /// The n-th such leaf has the n-th samples.
    Cubic,
    /// The n-th such leaf has the n-th list.
    Exact,
}

/// All cells of one depth; siblings side by side, in the order of their parents.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Level {
    /// What each cell is.
    pub kinds: Vec<LevelKind>,
    /// What is stored of each cell.
    pub records: Vec<Record>,
    /// Samples of tricubic leaves.
    pub cubics: Vec<Samples>,
    /// Triangles of exact leaves.
    pub lists: Lists,
}

/// A tree as flat arrays.
#[derive(Clone, Debug, PartialEq)]
pub struct Levels {
    /// Where it lies.
    pub root: Root,
    /// Where the sign can change.
    pub continuity: Continuity,
    /// What was asked of it.
    pub accuracy: Accuracy,
    /// Whether the domain holds the whole solid.
    pub coverage: Coverage,
    /// What was changed since.
    pub edits: Edits,
    /// From the root down.
    pub levels: Vec<Level>,
}

impl Level {
    /// Adds a cell that is no exact or tricubic leaf.
    pub fn push(&mut self, kind: LevelKind, record: Record) {
        self.kinds.push(kind);
        self.records.push(record);
    }

    /// Adds all cells of another part of the level.
    pub fn append(&mut self, mut other: Self) {
        self.kinds.append(&mut other.kinds);
        self.records.append(&mut other.records);
        self.cubics.append(&mut other.cubics);
        self.lists.append(&other.lists);
    }

    /// Cells that have children.
    pub fn branches(&self) -> usize {
        self.count(LevelKind::Branch)
    }

    fn count(&self, kind: LevelKind) -> usize {
        self.kinds.iter().filter(|&&k| k == kind).count()
    }

    /// How many cells of the same kind come before each.
    pub(crate) fn ranks(&self) -> Vec<u32> {
        let mut counts = [0u32; 4];
        let rank = |kind: &LevelKind| {
            let count = &mut counts[*kind as usize];
            *count += 1;
            *count - 1
        };
        self.kinds.iter().map(rank).collect()
    }
}

impl Levels {
    /// A tree without levels yet.
    pub fn new(root: Root, continuity: Continuity, accuracy: Accuracy) -> Self {
        Self { root, continuity, accuracy, coverage: Coverage::Unknown, edits: Edits::default(), levels: Vec::new() }
    }

    /// See [`derive_errors`].
    pub fn derive_errors(&mut self) {
        derive_errors(&mut self.levels, self.root.division);
    }

    /// Cuts off what is deeper; cells of the last level are leaves then.
    pub fn cut(&mut self, depth: u32) {
        self.levels.truncate(depth as usize + 1);
        let Some(last) = self.levels.last_mut() else { return };
        last.kinds.iter_mut().filter(|kind| **kind == LevelKind::Branch).for_each(|kind| *kind = LevelKind::Linear);
    }

    /// What is wrong with the arrays, if anything is; `triangles` is the number of the surface's.
    fn check(&self, triangles: usize) -> Result<()> {
        let wrong =
            |depth: usize, what: &str| Err(Error::Format(format!("level {depth} of the tree {what}; the file is damaged, write it again")));
        let extent = self.root.extent;
        if !(extent.min.is_finite() && extent.max.is_finite() && extent.min.cmplt(extent.max).all()) {
            return Err(Error::Format("the domain of the tree is no box; the file is damaged, write it again".into()));
        }
        if self.accuracy.check().is_err() || !self.edits.is_sound() {
            return Err(Error::Format(
                "what was asked of the tree, or its edits, are no numbers; the file is damaged, write it again".into(),
            ));
        }
        let group = self.root.division.children();
        let mut expected = 1;
        if self.levels.len() > MAX_DEPTH as usize + 1 {
            return wrong(self.levels.len() - 1, "is too deep");
        }
        for (depth, level) in self.levels.iter().enumerate() {
            if level.kinds.len() != expected || level.records.len() != expected {
                return wrong(depth, "has not as many cells as its parents ask for");
            }
            if level.records.iter().any(|r| !r.corners.iter().all(|v| v.is_finite()) || !(r.lower <= r.upper)) {
                return wrong(depth, "has corners or errors that are no numbers");
            }
            let lists = &level.lists;
            let ascending = lists.ends.is_sorted() && lists.ends.last().map_or(0, |&end| end as usize) == lists.triangles.len();
            if level.cubics.len() != level.count(LevelKind::Cubic)
                || lists.ends.len() != level.count(LevelKind::Exact)
                || lists.sides.len() != lists.ends.len()
                || !ascending
            {
                return wrong(depth, "has not one list or set of samples for each leaf that needs one");
            }
            if lists.triangles.iter().any(|&t| t as usize >= triangles) || (triangles == 0 && !lists.ends.is_empty()) {
                return wrong(depth, "names triangles that the part does not have");
            }
            if level.cubics.iter().flatten().any(|v| !v.is_finite()) {
                return wrong(depth, "has samples that are no numbers");
            }
            expected = level.branches() * group;
        }
        if expected != 0 || self.levels.is_empty() {
            return wrong(self.levels.len(), "is missing");
        }
        Ok(())
    }
}

/// Gives inner cells the errors that follow from their children's, where those are smaller: what children say is
/// trilinear where their parent's interpolation is too, so that the difference is largest at their corners. No error is
/// less than those of the children, so that a coarser tree never promises more.
pub(crate) fn derive_errors(levels: &mut [Level], division: Division) {
    let group = division.children();
    for depth in (1..levels.len()).rev() {
        let (above, below) = levels.split_at_mut(depth);
        let (Some(parents), Some(level)) = (above.last_mut(), below.first()) else { return };
        let mut cubics = level.cubics.iter();
        let mut children = level.records.chunks_exact(group).zip(level.kinds.chunks_exact(group));
        let branches = parents.kinds.iter().zip(&mut parents.records).filter(|(kind, _)| **kind == LevelKind::Branch);
        for ((_, parent), (records, kinds)) in branches.zip(&mut children) {
            let (mut derived, mut least): (Option<Interval>, Interval) = (None, Interval::exact(0.0));
            for (octant, (child, kind)) in records.iter().zip(kinds).enumerate() {
                let samples = if *kind == LevelKind::Cubic { cubics.next() } else { None };
                let error = about_corners(child, samples).plus(differences(parent, &child.corners, division, octant));
                derived = Some(derived.map_or(error, |derived| derived.hull(error)));
                least = least.hull(child.error());
            }
            let rounding = 1e-14 * parent.corners.iter().fold(0.0, |size, &v| f64::max(size, f64::from(v.abs())));
            let derived = derived.unwrap_or(Interval::ALL).widen(rounding).intersection(parent.error());
            *parent = Record::new(parent.corners, derived.hull(least));
        }
    }
}

impl AdaptiveField {
    /// From flat arrays; `surface` is what exact leaves name the triangles of.
    pub fn from_levels(levels: &Levels, surface: Option<Arc<Surface>>, run: &Run<'_>) -> Result<Self> {
        levels.check(surface.as_ref().map_or(0, |surface| surface.mesh().triangles().len()))?;
        Self::from_tiles(levels, 0, std::slice::from_ref(&levels.levels), surface, run)
    }

    /// From a tree all of whose cells above the depth of the `tiles` are branches, and from the trees below the cells of that
    /// depth, which follow each other as their siblings do: as they were built, and nothing is looked through again.
    pub(crate) fn from_tiles(
        whole: &Levels,
        depth: u32,
        tiles: &[Vec<Level>],
        surface: Option<Arc<Surface>>,
        run: &Run<'_>,
    ) -> Result<Self> {
        let ranks = run.blocks("count the leaves", tiles.len(), |tile| Ok(tiles[tile].iter().map(Level::ranks).collect()))?;
        let flat = Flat { above: &whole.levels[..depth as usize], tiles, ranks, group: whole.root.division.children() };
        let mut portals = Vec::new();
        let top = page(&flat, Place { depth: 0, tile: 0, cell: 0 }, 0, &mut portals);
        let pages = run.blocks("put the tree together", portals.len(), |number| {
            Ok(Arc::new(page(&flat, portals[number], PAGE_DEPTH, &mut Vec::new())))
        })?;
        Ok(Self {
            root: whole.root,
            top: Arc::new(top),
            pages,
            surface,
            continuity: whole.continuity,
            accuracy: whole.accuracy,
            coverage: whole.coverage,
            edits: whole.edits.clone(),
        })
    }

    /// The tree as flat arrays.
    pub fn to_levels(&self) -> Levels {
        let mut levels: Vec<Level> = Vec::new();
        let mut waiting = VecDeque::from([self.root()]);
        while let Some(cell) = waiting.pop_front() {
            let depth = cell.depth() as usize;
            if levels.len() == depth {
                levels.push(Level::default());
            }
            let level = &mut levels[depth];
            let kind = match cell.leaf() {
                _ if !cell.is_leaf() => LevelKind::Branch,
                Leaf::Linear => LevelKind::Linear,
                Leaf::Cubic(samples) => {
                    level.cubics.push(*samples);
                    LevelKind::Cubic
                }
                Leaf::Exact(list) => {
                    level.lists.push(cell.list_side(), list);
                    LevelKind::Exact
                }
            };
            level.push(kind, *cell.record());
            waiting.extend((0..cell.children()).map(|octant| cell.child(octant)));
        }
        let AdaptiveField { root, continuity, accuracy, coverage, .. } = *self;
        Levels { root, continuity, accuracy, coverage, edits: self.edits.clone(), levels }
    }
}

/// Levels to make pages of.
struct Flat<'a> {
    above: &'a [Level],
    tiles: &'a [Vec<Level>],
    /// By tile and level.
    ranks: Vec<Vec<Vec<u32>>>,
    group: usize,
}

/// A cell: of its level above the tiles, or of its level of a tile.
#[derive(Clone, Copy)]
struct Place {
    depth: u32,
    tile: u32,
    cell: u32,
}

impl Tree for Flat<'_> {
    type Node = Place;

    fn record(&self, Place { depth, tile, cell }: Place) -> Record {
        let level = self.above.get(depth as usize).unwrap_or_else(|| &self.tiles[tile as usize][depth as usize - self.above.len()]);
        // Of files written before, errors need not take in 0.
        let record = &level.records[cell as usize];
        Record::new(record.corners, record.error())
    }

    fn shape(&self, Place { depth, tile, cell }: Place, children: &mut Vec<Place>) -> Shape<'_> {
        let below = depth + 1;
        if below as usize <= self.above.len() {
            let all = cell * self.group as u32..(cell + 1) * self.group as u32;
            let is_tile = below as usize == self.above.len();
            children.extend(all.map(|child| match is_tile {
                true => Place { depth: below, tile: child, cell: 0 },
                false => Place { depth: below, tile, cell: child },
            }));
            return Shape::Branch;
        }
        let number = depth as usize - self.above.len();
        let level = &self.tiles[tile as usize][number];
        let rank = self.ranks[tile as usize][number][cell as usize] as usize;
        match level.kinds[cell as usize] {
            LevelKind::Branch => {
                let all = rank * self.group..(rank + 1) * self.group;
                children.extend(all.map(|child| Place { depth: below, tile, cell: child as u32 }));
                Shape::Branch
            }
            LevelKind::Linear => Shape::Linear,
            LevelKind::Cubic => Shape::Cubic(&level.cubics[rank]),
            LevelKind::Exact => {
                let (side, list) = level.lists.get(rank);
                Shape::Exact(side, list)
            }
        }
    }
}

impl Division {
    /// The division whose cells have so many children.
    pub fn with_children(count: usize) -> Result<Self> {
        match count {
            8 => Ok(Self::Octree),
            4 => Ok(Self::Quadtree),
            _ => Err(Error::Format(format!("cells are divided into {count}; the file is damaged, write it again"))),
        }
    }
}

impl Cell<'_> {
    /// Largest absolute end of the error.
    pub fn largest_error(&self) -> f64 {
        let error = self.error();
        error.upper.max(-error.lower)
    }
}
