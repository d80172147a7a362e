//! The complete distance field: for every cell, each triangle that can be nearest inside it.
//!
//! Huang, Li, Crawfis, Lu, Liou: A Complete Distance Field Representation, 2001. Theirs takes 4 n + 5 bytes for a
//! cell of n triangles. Here a block of 8 x 8 x 8 cells names its triangles once and its distinct lists once; a
//! cell is two bytes: the list, and whether it lies inside, outside or on the surface.

use std::sync::Arc;

use crate::bvh::Candidate;
use crate::distance::{Closest, Distance};
use crate::geom::{Aabb, DVec3, Interval, Nearest};
use crate::grid::Grid;
use crate::source::mesh::{Side, Surface};

/// Cells along an edge of a block.
pub(crate) const EDGE: usize = 8;

/// Cells of a block.
pub(crate) const CELLS: usize = EDGE * EDGE * EDGE;

/// Where a cell lies: the paper's in / surface / out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum CellClass {
    /// No triangle touches the cell and it lies outside.
    Outside = 0,
    /// A triangle touches the cell.
    Surface = 1,
    /// No triangle touches the cell and it lies inside.
    Inside = 2,
    /// No triangle touches the cell, but its points may lie on different sides, near an opening.
    Undecided = 3,
}

/// One block's lists.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct CellBlock {
    /// Every triangle that a list of the block holds, ascending.
    pub triangles: Box<[u32]>,
    /// Positions in `triangles`, list after list, one byte each where that suffices.
    pub entries: Entries,
    /// List i is `entries[starts[i] .. starts[i + 1]]`.
    pub starts: Box<[u16]>,
    /// Class, mark and list of every cell; empty when all cells equal `uniform`.
    pub cells: Box<[u16]>,
    pub uniform: CellWord,
}

/// A cell in two bytes: two bits of class, one that marks a list cut to the triangle a search starts from, 13 of list.
pub(crate) type CellWord = u16;

/// The list was too long to keep: its one triangle only starts a search of the tree.
pub(crate) const LONG: CellWord = 0x2000;

/// The cell holds no list: it lies outside and the field keeps the inside.
pub(crate) const ABSENT: CellWord = 0x1fff;

/// What a cell offers to a query.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CellList {
    /// Every triangle that can be nearest.
    Whole(usize),
    /// One triangle to start a search of the tree from.
    Start(usize),
    /// Nothing.
    Absent,
}

/// Positions in a block's triangle table.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Entries {
    Bytes(Box<[u8]>),
    Words(Box<[u16]>),
}

impl Default for Entries {
    fn default() -> Self {
        Self::Bytes(Box::default())
    }
}

impl CellBlock {
    /// What a cell holds and where it lies.
    #[inline]
    pub fn cell(&self, index: usize) -> (CellList, CellClass) {
        let word = self.cells.get(index).copied().unwrap_or(self.uniform);
        let class = match word >> 14 {
            0 => CellClass::Outside,
            1 => CellClass::Surface,
            2 => CellClass::Inside,
            _ => CellClass::Undecided,
        };
        let list = usize::from(word & ABSENT);
        let held = match word & (LONG | ABSENT) {
            ABSENT => CellList::Absent,
            word if word & LONG != 0 => CellList::Start(list),
            _ => CellList::Whole(list),
        };
        (held, class)
    }

    /// The triangles of a list.
    #[inline]
    pub fn list(&self, list: usize) -> impl Iterator<Item = u32> + '_ {
        let range = usize::from(self.starts[list])..usize::from(self.starts[list + 1]);
        range.map(move |i| {
            let position = match &self.entries {
                Entries::Bytes(bytes) => usize::from(bytes[i]),
                Entries::Words(words) => usize::from(words[i]),
            };
            self.triangles[position]
        })
    }

    /// Heap bytes.
    pub fn bytes(&self) -> usize {
        let entries = match &self.entries {
            Entries::Bytes(bytes) => bytes.len(),
            Entries::Words(words) => 2 * words.len(),
        };
        4 * self.triangles.len() + entries + 2 * self.starts.len() + 2 * self.cells.len()
    }
}

/// Which cells of a complete field hold lists.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Region {
    /// All cells.
    #[default]
    Everywhere = 0,
    /// Surface and inside cells, as the paper; points in outside cells are answered by the tree.
    Inside = 1,
}

/// Counts of a complete field, as in the paper's Tables 2 to 4.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CompleteStatistics {
    /// Cells inside, on the surface, outside (undecided ones counted with the surface).
    pub inside: u64,
    /// See `inside`.
    pub surface: u64,
    /// See `inside`.
    pub outside: u64,
    /// Cells that hold a list.
    pub listed: u64,
    /// Cells whose list was too long and that ask the tree instead.
    pub long: u64,
    /// Mean length of the lists of surface cells.
    pub surface_mean: f64,
    /// Mean length of the lists of inside cells.
    pub inside_mean: f64,
    /// Longest list kept.
    pub longest: u64,
    /// Bytes of the field proper: lists and cells.
    pub bytes: u64,
    /// What the paper's layout would take for the same lists: the sum of 4 n + 5.
    pub paper_bytes: u64,
}

/// A complete distance field of a surface: exact everywhere, a handful of triangles a query.
#[derive(Debug)]
pub struct CompleteField {
    pub(crate) surface: Arc<Surface>,
    /// Cells, in model units.
    pub(crate) grid: Grid,
    pub(crate) region: Region,
    /// Blocks of 8 x 8 x 8 cells, x slowest.
    pub(crate) blocks: Vec<CellBlock>,
}

/// The blocks that hold the cells of `grid`: global index of the first, and how many along each axis.
///
/// Blocks start at multiples of their edge, wherever the grid starts.
pub(crate) fn block_range(grid: &Grid) -> ([i64; 3], [usize; 3]) {
    let edge = EDGE as i64;
    let low = grid.first.map(|i| i.div_euclid(edge));
    let shape =
        std::array::from_fn(|axis| ((grid.first[axis] + i64::from(grid.shape[axis]) + edge - 1).div_euclid(edge) - low[axis]) as usize);
    (low, shape)
}

/// A cell's triangles, by the numbers of its block and of its list there, or where to start a search.
pub(super) enum Found {
    List(usize, usize),
    Start(u32),
}

impl CompleteField {
    /// The surface it was built from.
    pub fn surface(&self) -> &Arc<Surface> {
        &self.surface
    }

    /// Its cells.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Which cells hold lists.
    pub fn region(&self) -> Region {
        self.region
    }

    /// Blocks along each axis.
    pub(crate) fn block_shape(&self) -> [usize; 3] {
        block_range(&self.grid).1
    }

    /// Class and list length of a cell; `None` for the length where the tree answers.
    pub fn cell(&self, [i, j, k]: [u32; 3]) -> (CellClass, Option<usize>) {
        let (number, index) = self.place([i as usize, j as usize, k as usize]);
        let block = &self.blocks[number];
        let (held, class) = block.cell(index);
        let length = if let CellList::Whole(list) = held { Some(block.list(list).count()) } else { None };
        (class, length)
    }

    /// The number of a cell's block, and of the cell in it.
    fn place(&self, mut cell: [usize; 3]) -> (usize, usize) {
        let shape = self.block_shape();
        for axis in 0..3 {
            cell[axis] += self.grid.first[axis].rem_euclid(EDGE as i64) as usize;
        }
        let [a, b, c] = cell.map(|i| i / EDGE);
        let [i, j, k] = cell.map(|i| i % EDGE);
        ((a * shape[1] + b) * shape[2] + c, (i * EDGE + j) * EDGE + k)
    }

    /// The place of the cell that holds `p` (model units).
    pub(super) fn place_of(&self, p: DVec3) -> Option<(usize, usize)> {
        let index = (p - self.grid.origin) / self.grid.spacing;
        let mut cell = [0; 3];
        for axis in 0..3 {
            let count = f64::from(self.grid.shape[axis]);
            let local = index[axis] - self.grid.first[axis] as f64;
            if !(local >= 0.0 && local < count) {
                return None;
            }
            cell[axis] = local as usize;
        }
        Some(self.place(cell))
    }

    /// The list of the cell that holds `p` (model units), and the cell's class.
    pub(super) fn find(&self, p: DVec3) -> (Found, CellClass) {
        let Some((number, index)) = self.place_of(p) else {
            let beyond = self.surface.beyond(p * self.surface.scale());
            return (Found::Start(0), if beyond { CellClass::Outside } else { CellClass::Undecided });
        };
        let block = &self.blocks[number];
        let (held, class) = block.cell(index);
        let found = match held {
            CellList::Whole(list) => Found::List(number, list),
            CellList::Start(list) => Found::Start(block.list(list).next().unwrap_or(0)),
            CellList::Absent => Found::Start(0),
        };
        (found, class)
    }

    /// Nearest triangle of `p`; all in the tree's units but `p`.
    #[inline]
    fn search(&self, p: DVec3) -> (Candidate, CellClass) {
        let (found, class) = self.find(p);
        let tree = self.surface.tree();
        let scaled = p * self.surface.scale();
        let mut best = Candidate::within(f64::INFINITY);
        match found {
            Found::List(block, list) => {
                for triangle in self.blocks[block].list(list) {
                    best.offer(tree.facet(triangle).distance_squared(scaled), triangle);
                }
            }
            Found::Start(triangle) => {
                best.offer(tree.facet(triangle).distance_squared(scaled), triangle);
                best = tree.nearest(scaled, best);
            }
        }
        (best, class)
    }

    /// The unsigned distance of `p` and its side, by its nearest triangle and the class of its cell.
    pub(super) fn sided(&self, p: DVec3, found: Candidate, class: CellClass) -> (f64, Side) {
        let (surface, scale) = (&self.surface, self.surface.scale());
        let side = match class {
            CellClass::Inside => Side::Inside,
            CellClass::Outside => Side::Outside,
            CellClass::Surface | CellClass::Undecided => {
                surface.side(p * scale, &surface.tree().facet(found.triangle).nearest(p * scale), found.triangle)
            }
        };
        (found.distance_squared.sqrt() / scale, side)
    }

    /// The interval of [`CompleteField::sided`].
    pub(super) fn interval(&self, p: DVec3, found: Candidate, class: CellClass) -> Interval {
        let (distance, side) = self.sided(p, found, class);
        if side.is_certain() { Interval::exact(side.sign() * distance) } else { Interval::either_side(distance) }
    }

    /// Counts and sizes.
    pub fn statistics(&self) -> CompleteStatistics {
        let mut s = CompleteStatistics::default();
        let (mut on_surface, mut inside, mut lists) = (0, 0, [0u64; 2]);
        for i in 0..self.grid.shape[0] {
            for j in 0..self.grid.shape[1] {
                for k in 0..self.grid.shape[2] {
                    let (class, length) = self.cell([i, j, k]);
                    match class {
                        CellClass::Inside => s.inside += 1,
                        CellClass::Outside => s.outside += 1,
                        CellClass::Surface | CellClass::Undecided => s.surface += 1,
                    }
                    let Some(length) = length.map(|n| n as u64) else {
                        s.long += u64::from(class != CellClass::Outside || self.region == Region::Everywhere);
                        continue;
                    };
                    s.listed += 1;
                    s.longest = s.longest.max(length);
                    s.paper_bytes += 4 * length + 5;
                    match class {
                        CellClass::Inside => (inside, lists[0]) = (inside + length, lists[0] + 1),
                        CellClass::Surface => (on_surface, lists[1]) = (on_surface + length, lists[1] + 1),
                        CellClass::Outside | CellClass::Undecided => {}
                    }
                }
            }
        }
        s.inside_mean = inside as f64 / lists[0].max(1) as f64;
        s.surface_mean = on_surface as f64 / lists[1].max(1) as f64;
        s.bytes = self.blocks.iter().map(|b| (b.bytes() + size_of::<CellBlock>()) as u64).sum();
        s
    }
}

impl Distance for CompleteField {
    fn extent(&self) -> Option<Aabb> {
        Some(self.grid.extent())
    }

    fn at(&self, p: DVec3) -> Interval {
        let (found, class) = self.search(p);
        self.interval(p, found, class)
    }

    fn over(&self, cell: &Aabb) -> Interval {
        self.surface.over_from(self.at(cell.center()), cell)
    }
}

impl Closest for CompleteField {
    fn nearest(&self, p: DVec3, within: f64) -> Option<Nearest> {
        let (found, _) = self.search(p);
        let scale = self.surface.scale();
        (found.distance_squared.sqrt() / scale <= within).then(|| self.surface.describe(p * scale, found))
    }
}
