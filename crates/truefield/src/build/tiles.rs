//! Tiles of a dense array: each is made by one worker, then copied to its place.

use std::sync::{Mutex, PoisonError};

use crate::bvh::descend::Block;
use crate::grid::Grid;

/// Edge of the blocks that workers take.
pub(crate) const TILE: i64 = 32;

/// A tile in the making.
#[derive(Debug)]
pub(crate) struct Tile<T> {
    block: Block,
    values: Vec<T>,
}

impl<T: Copy> Tile<T> {
    pub fn new(block: Block, value: T) -> Self {
        let count = (0..3).map(|axis| (block.high[axis] - block.low[axis]) as usize).product();
        Self { block, values: vec![value; count] }
    }

    /// The value at a global index.
    pub fn at(&mut self, index: [i64; 3]) -> &mut T {
        let at = self.number(index);
        &mut self.values[at]
    }

    /// Takes the values of a part from a block of so many a row and rows a layer.
    pub fn copy(&mut self, part: &Block, from: &[T], edge: usize) {
        let length = (part.high[2] - part.low[2]) as usize;
        for (x, i) in (part.low[0]..part.high[0]).enumerate() {
            for (y, j) in (part.low[1]..part.high[1]).enumerate() {
                let (start, row) = (self.number([i, j, part.low[2]]), (x * edge + y) * edge);
                self.values[start..start + length].copy_from_slice(&from[row..row + length]);
            }
        }
    }

    /// Gives a part of the tile one value.
    pub fn fill(&mut self, part: &Block, value: T) {
        for i in part.low[0]..part.high[0] {
            for j in part.low[1]..part.high[1] {
                let start = self.number([i, j, part.low[2]]);
                self.values[start..start + (part.high[2] - part.low[2]) as usize].fill(value);
            }
        }
    }

    fn number(&self, [i, j, k]: [i64; 3]) -> usize {
        let Block { low, high } = self.block;
        (((i - low[0]) * (high[1] - low[1]) + j - low[1]) * (high[2] - low[2]) + k - low[2]) as usize
    }
}

/// The dense array, x slowest; tiles of one slab along x share a lock, held only while a finished tile is written.
#[derive(Debug)]
pub(crate) struct Dense<'a, T> {
    grid: Grid,
    slabs: Vec<(i64, Mutex<&'a mut [T]>)>,
}

impl<'a, T: Copy> Dense<'a, T> {
    /// `values` has one for each index of `grid`.
    pub fn new(grid: &Grid, values: &'a mut [T]) -> Self {
        let layer = grid.shape[1] as usize * grid.shape[2] as usize;
        let (mut slabs, mut rest, mut low) = (Vec::new(), values, grid.first[0]);
        while !rest.is_empty() {
            let high = (low.div_euclid(TILE) + 1) * TILE;
            let (slab, after) = rest.split_at_mut(((high - low) as usize * layer).min(rest.len()));
            slabs.push((low, Mutex::new(slab)));
            (rest, low) = (after, high);
        }
        Self { grid: *grid, slabs }
    }

    /// Copies a tile to its place.
    pub fn write(&self, tile: &Tile<T>) {
        let Block { low, high } = tile.block;
        let Some((start, slab)) = self.slabs.iter().rfind(|(start, _)| *start <= low[0]) else { return };
        let mut slab = slab.lock().unwrap_or_else(PoisonError::into_inner);
        let [_, ny, nz] = self.grid.shape.map(|n| n as usize);
        let (length, rows) = ((high[2] - low[2]) as usize, (high[1] - low[1]) as usize);
        for (row, values) in tile.values.chunks_exact(length).enumerate() {
            let i = (low[0] - start) as usize + row / rows;
            let j = (low[1] - self.grid.first[1]) as usize + row % rows;
            let k = (low[2] - self.grid.first[2]) as usize;
            let at = (i * ny + j) * nz + k;
            slab[at..at + length].copy_from_slice(values);
        }
    }
}
