//! Building a complete field: candidate lists halved down to every cell.
//!
//! The paper propagates lists from voxel to voxel; here they are shortened from coarse blocks to cells
//! ([`crate::bvh::cover`]), which yields the same guarantee with much shorter lists, block by block.

use std::collections::HashMap;
use std::sync::Arc;

use super::sides::Sides;
use crate::bvh::cover::Range;
use crate::bvh::descend::{Block, Descent, Span, Step, Visit};
use crate::bvh::tree::Slot;
use crate::error::{Error, Result};
use crate::field::CompleteField;
use crate::field::complete::{ABSENT, CELLS, CellBlock, CellClass, CellList, CellWord, EDGE, Entries, LONG, Region, block_range};
use crate::geom::triangle_overlaps_box;
use crate::grid::Grid;
use crate::run::Run;
use crate::source::mesh::{Side, Surface};

/// Edge of the blocks that workers take, in cells.
const TILE: i64 = 32;

/// Lists as short as this are not shortened further: a query over them costs no more than finding them.
const SHORT: usize = 2;

/// Longer lists are not kept: the tree is quicker.
const LONGEST: usize = 64;

/// Builds the complete field of `surface` over the cells of `grid` (model units).
///
/// The lists take at most `budget` bytes: where they would take more, the longest are replaced by a
/// search of the tree, until they fit. Every query stays exact.
pub fn complete(surface: &Arc<Surface>, grid: &Grid, region: Region, budget: u64, run: &Run<'_>) -> Result<CompleteField> {
    let (low, shape) = block_range(grid);
    let count = shape.iter().try_fold(1u64, |product, &n| product.checked_mul(n as u64)).unwrap_or(u64::MAX);
    let needed = count.saturating_mul(size_of::<CellBlock>() as u64);
    if needed > budget {
        let [x, y, z] = grid.shape;
        return Err(Error::Memory { what: format!("a complete field of {x} x {y} x {z} cells"), needed, allowed: budget });
    }
    let scale = surface.scale();
    let scaled = Grid { origin: grid.origin * scale, spacing: grid.spacing * scale, ..*grid };
    let tiles = Block::tiles(&scaled, TILE);
    let parts = run.blocks("complete field", tiles.len(), |index| {
        let mut builder = Builder::new(surface, region);
        let mut descent = Descent::new(surface.tree(), &scaled, Span::Cells);
        descent.tile(tiles[index], TILE, Range::ALL, &mut |visit| {
            run.cancel.check()?;
            builder.visit(visit)
        })?;
        Ok(builder.finish())
    })?;
    let mut blocks = vec![CellBlock::default(); count as usize];
    let mut filled = 0;
    for (place, block) in parts.into_iter().flatten() {
        let [a, b, c] = std::array::from_fn(|axis| (place[axis] - low[axis]) as usize);
        blocks[(a * shape[1] + b) * shape[2] + c] = block;
        filled += 1;
    }
    debug_assert_eq!(filled, count);
    fit(&mut blocks, budget)?;
    Ok(CompleteField { surface: Arc::clone(surface), grid: *grid, region, blocks })
}

/// Cuts the longest lists until the field fits its budget.
fn fit(blocks: &mut [CellBlock], budget: u64) -> Result<()> {
    let size = |blocks: &[CellBlock]| blocks.iter().map(|b| (b.bytes() + size_of::<CellBlock>()) as u64).sum::<u64>();
    let mut limit = LONGEST;
    while size(blocks) > budget {
        if limit <= 1 {
            return Err(Error::Memory { what: "the complete field at this resolution".into(), needed: size(blocks), allowed: budget });
        }
        limit /= 2;
        for block in blocks.iter_mut() {
            *block = Draft::cut(block, limit).seal();
        }
    }
    Ok(())
}

/// A block of 8 x 8 x 8 cells in the making.
struct Draft {
    words: Box<[CellWord; CELLS]>,
    lists: Vec<Vec<u32>>,
    known: HashMap<Vec<u32>, u16>,
}

impl Draft {
    fn new() -> Self {
        Self { words: Box::new([ABSENT; CELLS]), lists: Vec::new(), known: HashMap::new() }
    }

    /// `block` with lists longer than `limit` cut to their first triangle.
    fn cut(block: &CellBlock, limit: usize) -> Self {
        let mut draft = Self::new();
        for cell in 0..CELLS {
            let (held, class) = block.cell(cell);
            draft.words[cell] = (class as u16) << 14
                | match held {
                    CellList::Absent => ABSENT,
                    CellList::Start(list) => draft.list(&block.list(list).collect::<Vec<_>>(), usize::MAX),
                    CellList::Whole(list) => draft.list(&block.list(list).collect::<Vec<_>>(), limit),
                }
                | if matches!(held, CellList::Start(_)) { LONG } else { 0 };
        }
        draft
    }

    /// The word of a list, without a class.
    fn list(&mut self, list: &[u32], limit: usize) -> CellWord {
        let (list, mark) = if list.len() > limit { (&list[..1], LONG) } else { (list, 0) };
        if let Some(&known) = self.known.get(list) {
            return known | mark;
        }
        let number = self.lists.len() as u16;
        self.lists.push(list.to_vec());
        self.known.insert(list.to_vec(), number);
        number | mark
    }

    fn seal(self) -> CellBlock {
        let mut triangles: Vec<u32> = self.lists.iter().flatten().copied().collect();
        triangles.sort_unstable();
        triangles.dedup();
        let position = |t: &u32| triangles.partition_point(|u| u < t);
        let entries = self.lists.iter().flatten();
        let entries = if triangles.len() <= 256 {
            Entries::Bytes(entries.map(|t| position(t) as u8).collect())
        } else {
            Entries::Words(entries.map(|t| position(t) as u16).collect())
        };
        let mut starts = vec![0u16];
        for list in &self.lists {
            starts.push(starts[starts.len() - 1] + list.len() as u16);
        }
        let uniform = self.words[0];
        let cells = if self.words.iter().all(|&w| w == uniform) { Box::default() } else { Box::<[u16]>::from(&self.words[..]) };
        CellBlock { triangles: triangles.into(), entries, starts: starts.into(), cells, uniform }
    }
}

/// The blocks of one tile.
struct Builder<'a> {
    surface: &'a Surface,
    region: Region,
    done: Vec<([i64; 3], CellBlock)>,
    current: Option<([i64; 3], Draft)>,
    sides: Sides<'a>,
    /// Memory for one list.
    list: Vec<u32>,
}

impl<'a> Builder<'a> {
    fn new(surface: &'a Surface, region: Region) -> Self {
        Self { surface, region, done: Vec::new(), current: None, sides: Sides::new(surface), list: Vec::new() }
    }

    fn visit(&mut self, at: Visit<'_>) -> Result<Step> {
        let edge = at.block.edge();
        let settled = self.sides.of_block(&at).map(|side| class(Some(side)));
        if edge > EDGE as i64 {
            if settled == Some(CellClass::Outside) && self.region == Region::Inside {
                self.leave_out(&at.block);
                return Ok(Step::Done);
            }
            return Ok(Step::Refine);
        }
        match settled {
            Some(CellClass::Outside) if self.region == Region::Inside => {
                self.fill(&at.block, CellClass::Outside, None);
                return Ok(Step::Done);
            }
            Some(class) if edge == 1 || at.list.len() <= SHORT => {
                self.fill(&at.block, class, Some(at.list));
                return Ok(Step::Done);
            }
            None if edge == 1 => {
                let class = self.class_of_cell(&at);
                let absent = class == CellClass::Outside && self.region == Region::Inside;
                self.fill(&at.block, class, (!absent).then_some(at.list));
                return Ok(Step::Done);
            }
            _ => {}
        }
        Ok(if at.list.len() <= SHORT && settled.is_some() { Step::Share } else { Step::Refine })
    }

    /// Blocks that hold nothing.
    fn leave_out(&mut self, block: &Block) {
        let edge = EDGE as i64;
        let places = |axis: usize| block.low[axis].div_euclid(edge)..(block.high[axis] + edge - 1).div_euclid(edge);
        let empty = Draft::new().seal();
        for i in places(0) {
            for j in places(1) {
                for k in places(2) {
                    self.done.push(([i, j, k], empty.clone()));
                }
            }
        }
    }

    fn class_of_cell(&self, at: &Visit<'_>) -> CellClass {
        let corners = |slot: Slot| self.surface.work().corners(self.surface.tree().triangle(slot));
        let touched = at.list.iter().any(|&slot| triangle_overlaps_box(corners(slot), &at.cell));
        if touched { CellClass::Surface } else { class(self.sides.of_clear_box(at)) }
    }

    fn fill(&mut self, block: &Block, class: CellClass, list: Option<&[Slot]>) {
        let place = block.low.map(|i| i.div_euclid(EDGE as i64));
        if self.current.as_ref().is_none_or(|(current, _)| *current != place) {
            self.seal();
            self.current = Some((place, Draft::new()));
        }
        let Some((_, draft)) = &mut self.current else { return };
        let word = (class as u16) << 14
            | list.map_or(ABSENT, |list| {
                self.list.clear();
                self.list.extend(list.iter().map(|&slot| self.surface.tree().triangle(slot)));
                draft.list(&self.list, LONGEST)
            });
        for i in block.low[0]..block.high[0] {
            for j in block.low[1]..block.high[1] {
                for k in block.low[2]..block.high[2] {
                    let [i, j, k] = [i, j, k].map(|i| i.rem_euclid(EDGE as i64) as usize);
                    draft.words[(i * EDGE + j) * EDGE + k] = word;
                }
            }
        }
    }

    fn seal(&mut self) {
        if let Some((place, draft)) = self.current.take() {
            self.done.push((place, draft.seal()));
        }
    }

    fn finish(mut self) -> Vec<([i64; 3], CellBlock)> {
        self.seal();
        self.done
    }
}

/// The class of cells on one side, `None` where that is not certain.
fn class(side: Option<Side>) -> CellClass {
    match side {
        Some(Side::Inside) => CellClass::Inside,
        Some(Side::Outside) => CellClass::Outside,
        _ => CellClass::Undecided,
    }
}
