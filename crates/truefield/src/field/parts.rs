//! A complete field as flat arrays, for whoever stores or sends it, and back with every number checked.

use std::borrow::Cow;
use std::sync::Arc;

use super::complete::{ABSENT, CELLS, CellBlock, CellWord, CompleteField, Entries, LONG, Region, block_range};
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::run::Run;
use crate::source::mesh::Surface;

/// Blocks that a worker checks in one go.
const CHUNK: usize = 1024;

/// A block that names more triangles than this keeps its entries in two bytes each.
const BYTES: usize = 256;

/// Cell indices beyond this leave no digits for a position inside the cell.
const FARTHEST: i64 = 1 << 40;

/// The lists of a complete field, block after block (8 x 8 x 8 cells each, x slowest), in arrays without pointers.
///
/// A block has a table of triangles, lists of positions in that table, and for each of its cells a word: bits 14 and 15
/// are the class (0 outside, 1 surface, 2 inside, 3 undecided), bit 13 marks a list cut to the triangle a search of the
/// tree starts from, bits 0 to 12 are the number of the list; 0x1fff: none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parts<'a> {
    /// For each block, the triangles in its table.
    pub triangle_counts: Cow<'a, [u16]>,
    /// For each block, its lists.
    pub list_counts: Cow<'a, [u16]>,
    /// For each block, 1 where `cells` holds all its 512 words, 0 where one stands for all.
    pub varied: Cow<'a, [u8]>,
    /// The tables, each ascending.
    pub triangles: Cow<'a, [u32]>,
    /// For each list, where it ends among the entries of its block; it starts where the one before it ends.
    pub ends: Cow<'a, [u16]>,
    /// Entries of the blocks with at most 256 triangles.
    pub entries: Cow<'a, [u8]>,
    /// Entries of the other blocks.
    pub wide_entries: Cow<'a, [u16]>,
    /// The words of cells.
    pub cells: Cow<'a, [u16]>,
}

impl CompleteField {
    /// Its lists as flat arrays: a copy, as large as the field.
    pub fn to_parts(&self, run: &Run<'_>) -> Result<Parts<'static>> {
        let blocks = &self.blocks;
        let total = |length: fn(&CellBlock) -> usize| blocks.iter().map(length).sum::<usize>();
        let mut triangle_counts = Vec::with_capacity(blocks.len());
        let mut list_counts = Vec::with_capacity(blocks.len());
        let mut varied = Vec::with_capacity(blocks.len());
        let mut triangles = Vec::with_capacity(total(|b| b.triangles.len()));
        let mut ends = Vec::with_capacity(total(|b| b.starts.len().saturating_sub(1)));
        let mut entries = Vec::with_capacity(total(|b| if let Entries::Bytes(bytes) = &b.entries { bytes.len() } else { 0 }));
        let mut wide_entries = Vec::with_capacity(total(|b| if let Entries::Words(words) = &b.entries { words.len() } else { 0 }));
        let mut cells = Vec::with_capacity(total(|b| b.cells.len().max(1)));
        for (index, block) in blocks.iter().enumerate() {
            if index % CHUNK == 0 {
                run.cancel.check()?;
                run.progress.report("copy field", index, blocks.len());
            }
            // A block has at most 512 lists, whose ends fit 16 bits: so do these counts.
            triangle_counts.push(block.triangles.len() as u16);
            list_counts.push(block.starts.len().saturating_sub(1) as u16);
            varied.push(u8::from(!block.cells.is_empty()));
            triangles.extend_from_slice(&block.triangles);
            ends.extend_from_slice(block.starts.get(1..).unwrap_or_default());
            match &block.entries {
                Entries::Bytes(bytes) => entries.extend_from_slice(bytes),
                Entries::Words(words) => wide_entries.extend_from_slice(words),
            }
            if block.cells.is_empty() { cells.push(block.uniform) } else { cells.extend_from_slice(&block.cells) }
        }
        Ok(Parts {
            triangle_counts: triangle_counts.into(),
            list_counts: list_counts.into(),
            varied: varied.into(),
            triangles: triangles.into(),
            ends: ends.into(),
            entries: entries.into(),
            wide_entries: wide_entries.into(),
            cells: cells.into(),
        })
    }

    /// The field whose lists are `parts`, over the cells of `grid` (model units): the reverse of
    /// [`CompleteField::to_parts`].
    ///
    /// Whatever the arrays hold, no query of the result leaves them. That a list names every triangle that can be
    /// nearest cannot be seen from the list: see to it that the parts are those of a field of this `surface`.
    ///
    /// # Errors
    /// [`Error::Format`] says which block breaks which rule.
    pub fn from_parts(surface: Arc<Surface>, grid: Grid, region: Region, parts: &Parts<'_>, run: &Run<'_>) -> Result<Self> {
        let count = block_count(&grid)?;
        for (what, length) in
            [("triangle_counts", parts.triangle_counts.len()), ("list_counts", parts.list_counts.len()), ("varied", parts.varied.len())]
        {
            if length != count {
                return Err(Error::Format(format!("{what} counts {length} blocks but the grid has {count}")));
            }
        }
        let mut firsts = Vec::with_capacity(count.div_ceil(CHUNK));
        let mut rest = Rest::all(parts);
        for block in 0..count {
            if block % CHUNK == 0 {
                run.cancel.check()?;
                firsts.push(rest);
            }
            rest.take(parts, block)?;
        }
        if let Some(what) = rest.left() {
            return Err(Error::Format(format!("{what} is longer than the counts of the blocks say")));
        }
        let facets = surface.mesh().triangles().len();
        let mut blocks = vec![CellBlock::default(); count];
        run.chunks("check field", &mut blocks, CHUNK, |chunk, blocks| {
            let mut rest = firsts[chunk];
            for (block, place) in blocks.iter_mut().zip(chunk * CHUNK..) {
                let raw = rest.take(parts, place)?;
                raw.check(facets).map_err(|fault| Error::Format(format!("block {place} {fault}")))?;
                *block = raw.block();
            }
            Ok(())
        })?;
        Ok(Self { surface, grid, region, blocks })
    }
}

/// How many blocks hold the cells of a grid that a field can have.
fn block_count(grid: &Grid) -> Result<usize> {
    let Grid { origin, spacing, first, shape } = *grid;
    let wrong = |what: String| Err(Error::Format(what));
    if !(spacing > 0.0 && spacing.is_finite()) {
        return wrong(format!("the cells have edges of {spacing}, which is no positive length"));
    }
    if shape.contains(&0) || first.iter().any(|&i| !(-FARTHEST..=FARTHEST).contains(&i)) {
        return wrong(format!("the grid has {shape:?} cells from {first:?} on, which is no grid"));
    }
    let extent = grid.extent();
    if !(origin.is_finite() && extent.min.is_finite() && extent.max.is_finite()) {
        return wrong(format!("the grid lies at {origin} with cells of {spacing}, which is not finite"));
    }
    let blocks = block_range(grid).1;
    blocks
        .iter()
        .try_fold(1usize, |product, &n| product.checked_mul(n))
        .map_or_else(|| wrong(format!("the grid has {shape:?} cells, too many")), Ok)
}

/// What is left of the arrays.
#[derive(Clone, Copy)]
struct Rest<'a> {
    triangles: &'a [u32],
    ends: &'a [u16],
    entries: &'a [u8],
    wide_entries: &'a [u16],
    cells: &'a [u16],
}

impl<'a> Rest<'a> {
    fn all(parts: &'a Parts<'_>) -> Self {
        Self {
            triangles: &parts.triangles,
            ends: &parts.ends,
            entries: &parts.entries,
            wide_entries: &parts.wide_entries,
            cells: &parts.cells,
        }
    }

    /// Takes the next block, whose counts are at `index`.
    fn take(&mut self, parts: &Parts<'_>, index: usize) -> Result<Raw<'a>> {
        let triangles = front(&mut self.triangles, parts.triangle_counts[index].into(), "triangles", index)?;
        let ends = front(&mut self.ends, parts.list_counts[index].into(), "ends", index)?;
        let length = ends.last().map_or(0, |&end| usize::from(end));
        let entries = if triangles.len() <= BYTES {
            RawEntries::Bytes(front(&mut self.entries, length, "entries", index)?)
        } else {
            RawEntries::Words(front(&mut self.wide_entries, length, "wide_entries", index)?)
        };
        let words = match parts.varied[index] {
            0 => 1,
            1 => CELLS,
            mark => return Err(Error::Format(format!("block {index} has {mark} in varied, which must be 0 or 1"))),
        };
        let cells = front(&mut self.cells, words, "cells", index)?;
        Ok(Raw { triangles, ends, entries, cells })
    }

    /// An array of which something is left.
    fn left(&self) -> Option<&'static str> {
        let lengths = [
            ("triangles", self.triangles.len()),
            ("ends", self.ends.len()),
            ("entries", self.entries.len()),
            ("wide_entries", self.wide_entries.len()),
            ("cells", self.cells.len()),
        ];
        lengths.into_iter().find(|&(_, length)| length > 0).map(|(what, _)| what)
    }
}

/// The first `count` items, which leave `rest`.
fn front<'a, T>(rest: &mut &'a [T], count: usize, what: &str, block: usize) -> Result<&'a [T]> {
    let Some((front, back)) = rest.split_at_checked(count) else {
        return Err(Error::Format(format!("{what} ends inside block {block}")));
    };
    *rest = back;
    Ok(front)
}

/// One block, not yet to be trusted.
struct Raw<'a> {
    triangles: &'a [u32],
    ends: &'a [u16],
    entries: RawEntries<'a>,
    cells: &'a [CellWord],
}

enum RawEntries<'a> {
    Bytes(&'a [u8]),
    Words(&'a [u16]),
}

impl Raw<'_> {
    /// What is wrong with the block of a mesh with `facets` triangles.
    fn check(&self, facets: usize) -> std::result::Result<(), &'static str> {
        if !self.triangles.is_sorted_by(|a, b| a < b) {
            return Err("has triangles that do not ascend");
        }
        if self.triangles.last().is_some_and(|&t| t as usize >= facets) {
            return Err("names a triangle that the mesh does not have");
        }
        // An empty list would leave a query without an answer.
        if self.ends.first() == Some(&0) || !self.ends.is_sorted_by(|a, b| a < b) {
            return Err("has a list that ends where it starts or before");
        }
        let known = self.triangles.len();
        let in_table = match self.entries {
            RawEntries::Bytes(bytes) => bytes.iter().all(|&e| usize::from(e) < known),
            RawEntries::Words(words) => words.iter().all(|&e| usize::from(e) < known),
        };
        if !in_table {
            return Err("has an entry beyond its triangles");
        }
        let lists = self.ends.len();
        if !self.cells.iter().all(|&word| word & (LONG | ABSENT) == ABSENT || usize::from(word & ABSENT) < lists) {
            return Err("has a cell whose list does not exist");
        }
        Ok(())
    }

    /// The block, once checked.
    fn block(&self) -> CellBlock {
        let mut starts = Vec::with_capacity(self.ends.len() + 1);
        starts.push(0);
        starts.extend_from_slice(self.ends);
        CellBlock {
            triangles: self.triangles.into(),
            entries: match self.entries {
                RawEntries::Bytes(bytes) => Entries::Bytes(bytes.into()),
                RawEntries::Words(words) => Entries::Words(words.into()),
            },
            starts: starts.into(),
            cells: if self.cells.len() == 1 { Box::default() } else { self.cells.into() },
            uniform: self.cells[0],
        }
    }
}
