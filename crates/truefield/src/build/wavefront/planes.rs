//! The state of a wavefront: for every voxel how far its site is and where.

use super::metric::{Metric, code, delta};
use crate::build::raster::Raster;
use crate::error::Result;
use crate::run::Run;

/// Voxels of a segment: the part of a row that is looked at in one go.
pub(super) const LANES: usize = 16;

/// Planes of a slab, the part of the volume that one worker changes.
const PLANES: usize = 8;

/// Where rows of the volume stand in padded arrays: each voxel has all its neighbours, and each row whole segments.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    pub shape: [usize; 3],
    /// Rows before the first one along x and y.
    pad: [usize; 2],
    /// Length of padded arrays along x, y and z.
    padded: [usize; 3],
    /// The axis that is cut into slabs.
    slow: usize,
    /// The step to each neighbour by its number, and what it adds to an index, modulo the range of `usize`.
    pub moves: [([i16; 3], usize); 28],
}

impl Layout {
    pub fn new(raster: &Raster) -> Self {
        let shape = raster.shape;
        let pad = [usize::from(shape[0] > 1), usize::from(shape[1] > 1)];
        let padded = [shape[0] + 2 * pad[0], shape[1] + 2 * pad[1], shape[2].div_ceil(LANES) * LANES + 2];
        let moves = std::array::from_fn(|code| {
            let step = delta(code);
            let [x, y, z] = step.map(isize::from);
            (step, ((x * padded[1] as isize + y) * padded[2] as isize + z) as usize)
        });
        Self { shape, pad, padded, slow: usize::from(shape[0] == 1), moves }
    }

    /// Padded length.
    pub fn len(&self) -> usize {
        self.padded.iter().product()
    }

    /// Segments of a row.
    pub fn segments(&self) -> usize {
        self.shape[2].div_ceil(LANES)
    }

    /// Rows of the volume in a plane.
    fn rows_of_plane(&self) -> usize {
        if self.slow == 0 { self.shape[1] } else { 1 }
    }

    /// Number of slabs.
    pub fn slabs(&self) -> usize {
        self.shape[self.slow].div_ceil(PLANES)
    }

    /// Rows of the volume in a slab.
    pub fn rows(&self, slab: usize) -> std::ops::Range<usize> {
        let rows = self.rows_of_plane();
        slab * PLANES * rows..((slab + 1) * PLANES).min(self.shape[self.slow]) * rows
    }

    /// Rows of the volume that a slab's rows look at, and their own.
    pub fn rows_around(&self, slab: usize) -> std::ops::Range<usize> {
        let (rows, beyond) = (self.rows(slab), self.rows_of_plane());
        rows.start.saturating_sub(beyond)..rows.end + beyond
    }

    /// Voxels of a full slab in arrays that are not padded.
    pub fn slab_voxels(&self) -> usize {
        PLANES * self.rows_of_plane() * self.shape[2]
    }

    /// Padded voxels of a full slab.
    pub fn slab_length(&self) -> usize {
        PLANES * self.padded[self.slow + 1..].iter().product::<usize>()
    }

    /// Where the first slab starts and the last ends in padded arrays.
    pub fn inner(&self) -> std::ops::Range<usize> {
        let plane: usize = self.padded[self.slow + 1..].iter().product();
        let start = self.pad[self.slow] * plane;
        start..start + self.shape[self.slow] * plane
    }

    /// Where a row of the volume starts in padded arrays.
    pub fn start(&self, row: usize) -> usize {
        let [i, j] = self.place(row);
        ((i + self.pad[0]) * self.padded[1] + j + self.pad[1]) * self.padded[2] + 1
    }

    /// What leads to the row `(X, Y)` away, modulo the range of `usize`.
    #[inline(always)]
    pub fn jump<const X: i16, const Y: i16>(&self) -> usize {
        self.moves[code(X, Y, 0) as usize].1
    }

    /// Where a row of the volume is along x and y.
    pub fn place(&self, row: usize) -> [usize; 2] {
        [row / self.shape[1], row % self.shape[1]]
    }

    /// The row `(x, y)` away from `place`, if the volume has it.
    #[inline]
    pub fn row(&self, place: [usize; 2], x: isize, y: isize) -> Option<usize> {
        let [i, j] = [place[0].wrapping_add_signed(x), place[1].wrapping_add_signed(y)];
        (i < self.shape[0] && j < self.shape[1]).then(|| i * self.shape[1] + j)
    }
}

/// Keys and offsets of all voxels; voxels around the volume have no site and never get one.
#[derive(Debug)]
pub(super) struct Planes<M: Metric> {
    pub layout: Layout,
    pub metric: M,
    pub key: Vec<M::Key>,
    /// Steps from the site to the voxel along x, y and z.
    pub offset: [Vec<i16>; 3],
}

/// The part of [`Planes`] that belongs to a slab.
#[derive(Debug)]
pub(super) struct Part<'a, M: Metric> {
    pub key: &'a mut [M::Key],
    pub offset: [&'a mut [i16]; 3],
}

impl<M: Metric> Planes<M> {
    /// Every site is its own, all other voxels have none.
    pub fn new(layout: Layout, metric: M, sites: &[bool], run: &Run<'_>) -> Result<Self> {
        let offset = || vec![0i16; layout.len()];
        let mut planes = Self { layout, metric, key: vec![M::NONE; layout.len()], offset: [offset(), offset(), offset()] };
        let n = layout.shape[2];
        run.chunks("wavefront", &mut planes.key[layout.inner()], layout.slab_length(), |slab, key| {
            let first = layout.inner().start + slab * layout.slab_length();
            for row in layout.rows(slab) {
                let at = layout.start(row) - first;
                for (key, _) in key[at..at + n].iter_mut().zip(&sites[row * n..(row + 1) * n]).filter(|(_, site)| **site) {
                    *key = M::SITE;
                }
            }
            Ok(())
        })?;
        Ok(planes)
    }

    /// The slabs, to be changed.
    pub fn parts(&mut self) -> Vec<Part<'_, M>> {
        let (inner, length) = (self.layout.inner(), self.layout.slab_length());
        let [x, y, z] = self.offset.each_mut().map(|offset| offset[inner.clone()].chunks_mut(length));
        let keys = self.key[inner].chunks_mut(length);
        keys.zip(x).zip(y).zip(z).map(|(((key, x), y), z)| Part { key, offset: [x, y, z] }).collect()
    }
}
