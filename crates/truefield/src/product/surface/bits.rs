//! Which samples are inside, one bit each, and how many edges of the lattice the surface crosses.

use super::Border;
use crate::error::Result;
use crate::field::SampledField;
use crate::lattice::Lattice;
use crate::run::Run;
use crate::simd::{Fuse, multiversion};

/// One bit a sample, rows along z, each row in whole words.
pub(super) struct Bits {
    words: Vec<u64>,
    /// Samples along each axis, those beyond the border included.
    pub(super) shape: [usize; 3],
    /// Words of a row.
    pub(super) width: usize,
    /// Samples beyond the border on each side: 0 or 1.
    pub(super) beyond: usize,
}

/// Number of the first vertex on the edges of a row along x, y and z.
pub(super) type Start = [u32; 3];

impl Bits {
    /// Marks the samples below `distance`.
    pub(super) fn below(field: &SampledField, distance: f64, border: Border, run: &Run<'_>) -> Result<Self> {
        let Lattice { shape, .. } = *field.lattice();
        let [nx, ny, nz] = shape.map(|n| n as usize);
        let beyond = usize::from(border == Border::Closed);
        let shape = [nx + 2 * beyond, ny + 2 * beyond, nz + 2 * beyond];
        let width = shape[2].div_ceil(64);
        let mut words = vec![0u64; shape[0] * shape[1] * width];
        let limit = crate::field::sampled::rounded_down(distance);
        // The largest single below the distance.
        let limit = if f64::from(limit) < distance { limit } else { limit.next_down() };
        run.chunks("find the surface", &mut words, shape[1] * width, |i, layer| {
            let Some(i) = i.checked_sub(beyond).filter(|&i| i < nx) else { return Ok(()) };
            for (j, row) in layer.chunks_exact_mut(width).skip(beyond).take(ny).enumerate() {
                let start = (i * ny + j) * nz;
                mark(&field.values()[start..start + nz], limit, beyond, row);
            }
            Ok(())
        })?;
        Ok(Self { words, shape, width, beyond })
    }

    /// Layers of samples across x.
    pub(super) fn layers(&self) -> usize {
        self.shape[0]
    }

    /// The row at (i, j).
    pub(super) fn row(&self, i: usize, j: usize) -> &[u64] {
        let start = (i * self.shape[1] + j) * self.width;
        &self.words[start..start + self.width]
    }

    /// Number of crossed edges along x, y and z that begin at a row.
    pub(super) fn crossings(&self, i: usize, j: usize) -> Start {
        let row = self.row(i, j);
        let across = |other: &[u64]| row.iter().zip(other).map(|(a, b)| (a ^ b).count_ones()).sum();
        let x = if i + 1 < self.shape[0] { across(self.row(i + 1, j)) } else { 0 };
        let y = if j + 1 < self.shape[1] { across(self.row(i, j + 1)) } else { 0 };
        let z = (0..self.width).map(|w| self.along(row, w).count_ones()).sum();
        [x, y, z]
    }

    /// Word `w` of a row, each bit compared with the next: set where the edge between them is crossed.
    #[inline(always)]
    pub(super) fn along(&self, row: &[u64], w: usize) -> u64 {
        (row[w] ^ next(row, w)) & self.edges(w)
    }

    /// Bits of word `w` whose sample has a next one along z.
    #[inline(always)]
    pub(super) fn edges(&self, w: usize) -> u64 {
        let count = self.shape[2] - 1 - (64 * w).min(self.shape[2] - 1);
        if count >= 64 { u64::MAX } else { (1 << count) - 1 }
    }

    /// The first vertices of each row, given those of each layer.
    pub(super) fn starts(&self, layers: &[u32], run: &Run<'_>) -> Result<Vec<Start>> {
        let mut starts = vec![[0; 3]; self.shape[0] * self.shape[1]];
        run.chunks("count the surface", &mut starts, self.shape[1], |i, rows| {
            let mut first = layers[i];
            for (j, start) in rows.iter_mut().enumerate() {
                for (start, count) in start.iter_mut().zip(self.crossings(i, j)) {
                    *start = first;
                    first += count;
                }
            }
            Ok(())
        })?;
        Ok(starts)
    }
}

/// Word `w` of a row moved by one sample: bit k is that of sample k + 1.
#[inline(always)]
pub(super) fn next(row: &[u64], w: usize) -> u64 {
    row[w] >> 1 | row.get(w + 1).map_or(0, |word| word << 63)
}

multiversion!(
    /// Sets the bits of samples not above `limit`, the first at bit `shift`.
    fn mark(values: &[f32], limit: f32, shift: usize, row: &mut [u64]) = mark_body
);

#[inline(always)]
fn mark_body<F: Fuse>(values: &[f32], limit: f32, shift: usize, row: &mut [u64]) {
    let limits = [limit; 16];
    let mut set = |at: usize, mask: u32| {
        let (word, bit) = (at / 64, at % 64);
        row[word] |= u64::from(mask) << bit;
        if bit > 48 && word + 1 < row.len() {
            row[word + 1] |= u64::from(mask) >> (64 - bit);
        }
    };
    let (whole, rest) = values.as_chunks::<16>();
    for (n, chunk) in whole.iter().enumerate() {
        set(16 * n + shift, F::mask_not_above(chunk, &limits));
    }
    for (n, &value) in rest.iter().enumerate() {
        set(16 * whole.len() + n + shift, u32::from(value <= limit));
    }
}
