//! One ring: segments of 16 voxels look at their neighbours, a vector at a time.

use super::metric::{Metric, Scaled, Whole, code};
use super::planes::{LANES, Planes};
use crate::simd::{Fuse, multiversion};

/// A segment that may change, and the neighbours that its voxels have to look at: bit i for that with number i + 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    pub row: u32,
    pub segment: u32,
    pub neighbours: u32,
}

/// A segment that changed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Changed {
    pub row: u32,
    pub segment: u32,
    /// Bit i for voxel i.
    pub voxels: u16,
    /// The directions in which the front goes on from here: bit 2 i for axis i upward, bit 2 i + 1 downward.
    pub ahead: u8,
}

/// A voxel's new state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Change<K> {
    pub key: K,
    pub offset: [i16; 3],
}

/// What a slab finds to change in a pass.
#[derive(Debug)]
pub(super) struct Found<K> {
    pub segments: Vec<Changed>,
    /// One for each voxel of the segments, in their order.
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
    /// Looks at segments in a pass and notes what changes.
    fn ring(planes: &Planes<Self>, pass: u16, looks: &[Look], found: &mut Found<Self::Key>);
}

impl Ringed for Whole {
    fn ring(planes: &Planes<Self>, pass: u16, looks: &[Look], found: &mut Found<u32>) {
        ring_whole(planes, pass, looks, found);
    }
}

impl Ringed for Scaled {
    fn ring(planes: &Planes<Self>, pass: u16, looks: &[Look], found: &mut Found<u64>) {
        ring_scaled(planes, pass, looks, found);
    }
}

multiversion!(fn ring_whole(planes: &Planes<Whole>, pass: u16, looks: &[Look], found: &mut Found<u32>) = ring_whole_body);
multiversion!(fn ring_scaled(planes: &Planes<Scaled>, pass: u16, looks: &[Look], found: &mut Found<u64>) = ring_scaled_body);

#[inline(always)]
fn ring_whole_body<F: Fuse>(planes: &Planes<Whole>, pass: u16, looks: &[Look], found: &mut Found<u32>) {
    ring(planes, pass, looks, found);
}

#[inline(always)]
fn ring_scaled_body<F: Fuse>(planes: &Planes<Scaled>, pass: u16, looks: &[Look], found: &mut Found<u64>) {
    ring(planes, pass, looks, found);
}

#[inline(always)]
fn ring<M: Metric>(planes: &Planes<M>, pass: u16, looks: &[Look], found: &mut Found<M::Key>) {
    let (layout, settled) = (&planes.layout, planes.metric.settled(pass));
    for look in looks {
        let first = look.segment as usize * LANES;
        let at = layout.start(look.row as usize) + first;
        let Some(held) = planes.key[at..].first_chunk::<LANES>() else { continue };
        let mut open = false;
        for key in held {
            open |= *key > settled;
        }
        if !open {
            continue;
        }
        let limits: [M::Key; LANES] = std::array::from_fn(|lane| planes.metric.within(held[lane]));
        let best = limits;
        let best = row::<M, -1, -1>(planes, look, at, best);
        let best = row::<M, -1, 0>(planes, look, at, best);
        let best = row::<M, -1, 1>(planes, look, at, best);
        let best = row::<M, 0, -1>(planes, look, at, best);
        let best = row::<M, 0, 0>(planes, look, at, best);
        let best = row::<M, 0, 1>(planes, look, at, best);
        let best = row::<M, 1, -1>(planes, look, at, best);
        let best = row::<M, 1, 0>(planes, look, at, best);
        let best = row::<M, 1, 1>(planes, look, at, best);
        let mut voxels = 0u16;
        for lane in 0..LANES {
            voxels |= u16::from(best[lane] < limits[lane]) << lane;
        }
        // Beyond the end of the row there are no voxels.
        voxels &= u16::MAX >> (LANES - (layout.shape[2] - first).min(LANES));
        if voxels != 0 {
            note(planes, pass, look, at, &best, voxels, found);
        }
    }
}

/// What the neighbours in row `(X, Y)` offer a segment at `at` that has `best` so far.
#[inline(always)]
fn row<M: Metric, const X: i16, const Y: i16>(planes: &Planes<M>, look: &Look, at: usize, best: [M::Key; LANES]) -> [M::Key; LANES] {
    let wanted = look.neighbours >> (code(X, Y, -1) - 1) & 7;
    if wanted == 0 {
        return best;
    }
    let at = at.wrapping_add(planes.layout.jump::<X, Y>());
    let (key, offset) = (span(&planes.key, at), planes.offset.each_ref().map(|offset| span(offset, at)));
    let (Some(key), [Some(x), Some(y), Some(z)]) = (key, offset) else { return best };
    let best = if wanted & 1 != 0 { step::<M, X, Y, -1>(planes.metric, key, [x, y, z], best) } else { best };
    let best = if wanted & 2 != 0 { step::<M, X, Y, 0>(planes.metric, key, [x, y, z], best) } else { best };
    if wanted & 4 != 0 { step::<M, X, Y, 1>(planes.metric, key, [x, y, z], best) } else { best }
}

/// What one neighbour offers.
#[inline(always)]
fn step<M: Metric, const X: i16, const Y: i16, const Z: i16>(
    metric: M,
    key: &[M::Key; LANES + 2],
    [x, y, z]: [&[i16; LANES + 2]; 3],
    mut best: [M::Key; LANES],
) -> [M::Key; LANES] {
    for lane in 0..LANES {
        let i = (lane as isize + 1 + Z as isize) as usize;
        best[lane] = best[lane].min(metric.offer::<X, Y, Z>(key[i], x[i], y[i], z[i]));
    }
    best
}

/// The values beside a segment that starts at `at`, one more at both ends.
#[inline(always)]
fn span<T>(values: &[T], at: usize) -> Option<&[T; LANES + 2]> {
    values.get(at - 1..)?.first_chunk()
}

/// Notes the new state of `voxels` of a segment.
fn note<M: Metric>(planes: &Planes<M>, pass: u16, look: &Look, at: usize, best: &[M::Key; LANES], voxels: u16, found: &mut Found<M::Key>) {
    let (mut rest, mut ahead, front) = (voxels, 0, pass as i16);
    let held = &planes.key[at..at + LANES];
    found.voxels.reserve(LANES);
    while rest != 0 {
        let lane = rest.trailing_zeros() as usize;
        rest &= rest - 1;
        let (code, key) = M::split(best[lane]);
        let ([x, y, z], jump) = planes.layout.moves[code];
        let from = (at + lane).wrapping_add(jump);
        let offset = [planes.offset[0][from] - x, planes.offset[1][from] - y, planes.offset[2][from] - z];
        for axis in 0..3 {
            ahead |= u8::from(offset[axis] == front) << (2 * axis) | u8::from(offset[axis] == -front) << (2 * axis + 1);
        }
        found.reached += usize::from(held[lane] == M::NONE);
        found.voxels.push(Change { key, offset });
    }
    found.segments.push(Changed { row: look.row, segment: look.segment, voxels, ahead });
}
