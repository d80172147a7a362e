//! One ring: segments of 16 voxels look at their neighbours, a vector at a time.

use super::metric::{Metric, Scaled, Whole, delta};
use super::planes::{LANES, Planes};
use crate::simd::{Fuse, multiversion};

/// A segment that may change, and the rows whose voxels it has to look at: bit 3 (x + 1) + y + 1 for row `(x, y)`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    pub row: u32,
    pub segment: u32,
    pub rows: u16,
}

/// A segment that changed: bit i for voxel i.
#[derive(Clone, Copy, Debug)]
pub(super) struct Changed {
    pub row: u32,
    pub segment: u32,
    pub voxels: u16,
}

/// A voxel's new state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Change<K> {
    pub at: u32,
    pub key: K,
    pub offset: [i16; 3],
}

/// What a slab finds to change in a pass.
#[derive(Debug)]
pub(super) struct Found<K> {
    pub segments: Vec<Changed>,
    pub voxels: Vec<Change<K>>,
    /// How many of the voxels had no site before.
    pub reached: usize,
}

impl<K> Default for Found<K> {
    fn default() -> Self {
        Self { segments: Vec::new(), voxels: Vec::new(), reached: 0 }
    }
}

/// A metric whose rings are compiled for several instruction sets.
pub(super) trait Ringed: Metric {
    /// Looks at segments and notes what changes.
    fn ring(planes: &Planes<Self>, looks: &[Look], found: &mut Found<Self::Key>);
}

impl Ringed for Whole {
    fn ring(planes: &Planes<Self>, looks: &[Look], found: &mut Found<u32>) {
        ring_whole(planes, looks, found);
    }
}

impl Ringed for Scaled {
    fn ring(planes: &Planes<Self>, looks: &[Look], found: &mut Found<u64>) {
        ring_scaled(planes, looks, found);
    }
}

multiversion!(fn ring_whole(planes: &Planes<Whole>, looks: &[Look], found: &mut Found<u32>) = ring_whole_body);
multiversion!(fn ring_scaled(planes: &Planes<Scaled>, looks: &[Look], found: &mut Found<u64>) = ring_scaled_body);

#[inline(always)]
fn ring_whole_body<F: Fuse>(planes: &Planes<Whole>, looks: &[Look], found: &mut Found<u32>) {
    ring(planes, looks, found);
}

#[inline(always)]
fn ring_scaled_body<F: Fuse>(planes: &Planes<Scaled>, looks: &[Look], found: &mut Found<u64>) {
    ring(planes, looks, found);
}

#[inline(always)]
fn ring<M: Metric>(planes: &Planes<M>, looks: &[Look], found: &mut Found<M::Key>) {
    let layout = &planes.layout;
    for look in looks {
        let first = look.segment as usize * LANES;
        let at = layout.start(look.row as usize) + first;
        let held: &[M::Key] = &planes.key[at..at + LANES];
        let limits: [M::Key; LANES] = std::array::from_fn(|lane| planes.metric.within(held[lane]));
        let mut best = limits;
        let beside = |x: isize, y: isize| at.wrapping_add(layout.jump(x, y));
        let wanted = |row: u16| look.rows >> row & 1 != 0;
        if wanted(0) {
            row::<M, -1, -1>(planes, beside(-1, -1), &mut best);
        }
        if wanted(1) {
            row::<M, -1, 0>(planes, beside(-1, 0), &mut best);
        }
        if wanted(2) {
            row::<M, -1, 1>(planes, beside(-1, 1), &mut best);
        }
        if wanted(3) {
            row::<M, 0, -1>(planes, beside(0, -1), &mut best);
        }
        if wanted(4) {
            row::<M, 0, 0>(planes, at, &mut best);
        }
        if wanted(5) {
            row::<M, 0, 1>(planes, beside(0, 1), &mut best);
        }
        if wanted(6) {
            row::<M, 1, -1>(planes, beside(1, -1), &mut best);
        }
        if wanted(7) {
            row::<M, 1, 0>(planes, beside(1, 0), &mut best);
        }
        if wanted(8) {
            row::<M, 1, 1>(planes, beside(1, 1), &mut best);
        }
        let mut voxels = 0u16;
        for lane in 0..LANES {
            voxels |= u16::from(best[lane] < limits[lane]) << lane;
        }
        // Beyond the end of the row there are no voxels.
        voxels &= u16::MAX >> (LANES - (layout.shape[2] - first).min(LANES));
        if voxels != 0 {
            note(planes, look, at, &best, voxels, found);
        }
    }
}

/// What the three neighbours in row `(X, Y)`, whose voxel beside the first lane is at `at`, offer every lane.
#[inline(always)]
fn row<M: Metric, const X: i16, const Y: i16>(planes: &Planes<M>, at: usize, best: &mut [M::Key; LANES]) {
    let (Some(key), [Some(x), Some(y), Some(z)]) = (span(&planes.key, at), planes.offset.each_ref().map(|offset| span(offset, at))) else {
        return;
    };
    for lane in 0..LANES {
        best[lane] = best[lane].min(planes.metric.offer::<X, Y, -1>(key[lane], x[lane], y[lane], z[lane]));
    }
    if X != 0 || Y != 0 {
        for lane in 0..LANES {
            let i = lane + 1;
            best[lane] = best[lane].min(planes.metric.offer::<X, Y, 0>(key[i], x[i], y[i], z[i]));
        }
    }
    for lane in 0..LANES {
        let i = lane + 2;
        best[lane] = best[lane].min(planes.metric.offer::<X, Y, 1>(key[i], x[i], y[i], z[i]));
    }
}

/// The values beside a segment that starts at `at`, one more at both ends.
#[inline(always)]
fn span<T>(values: &[T], at: usize) -> Option<&[T; LANES + 2]> {
    values.get(at - 1..)?.first_chunk()
}

/// Notes the new state of `voxels` of a segment.
fn note<M: Metric>(planes: &Planes<M>, look: &Look, at: usize, best: &[M::Key; LANES], voxels: u16, found: &mut Found<M::Key>) {
    found.segments.push(Changed { row: look.row, segment: look.segment, voxels });
    let mut rest = voxels;
    while rest != 0 {
        let lane = rest.trailing_zeros() as usize;
        rest &= rest - 1;
        let (code, key) = M::split(best[lane]);
        let [x, y, z] = delta(code);
        let here = at + lane;
        let from = here.wrapping_add(planes.layout.jump(isize::from(x), isize::from(y))).wrapping_add_signed(isize::from(z));
        let offset = [planes.offset[0][from] - x, planes.offset[1][from] - y, planes.offset[2][from] - z];
        found.reached += usize::from(planes.key[here] == M::NONE);
        found.voxels.push(Change { at: here as u32, key, offset });
    }
}
