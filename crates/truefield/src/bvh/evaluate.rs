//! Exact distances of a small block of points from a complete list of candidates.
//!
//! A single-precision pass over all pairs finds for every point the few triangles that can be
//! nearest within its error; those are asked again in double precision, in lanes. The result has
//! the bits of brute force.

use super::cover::{Range, filter_error};
use super::descend::Block;
use super::frame::Offsets;
use super::tree::{Slot, Tree};
use crate::geom::{Aabb, DVec3, Foot};
use crate::grid::Grid;
use crate::simd::{Fuse, multiversion};

/// Points of a block: 4 x 4 x 4.
pub(crate) const BLOCK: usize = 64;

const LANES: usize = 16;
const PARTS: usize = BLOCK / LANES;
const GROUP: usize = 8;

/// Coordinates of the points of a block.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(crate) struct Points {
    pub x: [f64; BLOCK],
    pub y: [f64; BLOCK],
    pub z: [f64; BLOCK],
    /// No fewer than differ; the others repeat them.
    pub count: usize,
}

/// Squared distance and nearest triangle of every point of a block, and where on the triangle its nearest point lies.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(crate) struct Answers {
    pub squared: [f64; BLOCK],
    pub triangle: [u32; BLOCK],
    s: [f64; BLOCK],
    t: [f64; BLOCK],
}

impl Points {
    /// The points of a block of at most 4 x 4 x 4; slots beyond a clipped block repeat its last points.
    pub fn of_block(lattice: &Grid, block: &Block) -> Self {
        let mut points = Self { x: [0.0; BLOCK], y: [0.0; BLOCK], z: [0.0; BLOCK], count: BLOCK };
        let at = |axis: usize, step: usize| (block.low[axis] + step as i64).min(block.high[axis] - 1);
        // Each coordinate depends on one index.
        let steps: [DVec3; 4] = std::array::from_fn(|step| lattice.corner(at(0, step), at(1, step), at(2, step)));
        for i in 0..BLOCK {
            (points.x[i], points.y[i], points.z[i]) = (steps[i >> 4].x, steps[i >> 2 & 3].y, steps[i & 3].z);
        }
        points
    }

    /// At least one and at most 64 points; slots beyond repeat the last, and answers for them may be missing.
    pub fn of_some(some: &[DVec3]) -> Self {
        let mut points = Self { x: [0.0; BLOCK], y: [0.0; BLOCK], z: [0.0; BLOCK], count: some.len() };
        for i in 0..BLOCK {
            let p = some[i.min(some.len() - 1)];
            (points.x[i], points.y[i], points.z[i]) = (p.x, p.y, p.z);
        }
        points
    }
}

impl Answers {
    pub const NONE: Self = Self { squared: [f64::INFINITY; BLOCK], triangle: [u32::MAX; BLOCK], s: [0.0; BLOCK], t: [0.0; BLOCK] };

    /// The foot of an answered point on its triangle.
    pub fn foot(&self, i: usize) -> Foot {
        Foot { distance_squared: self.squared[i], s: self.s[i], t: self.t[i] }
    }
}

/// Memory that is used again from block to block.
#[derive(Debug, Default)]
pub(crate) struct Rows(Vec<[[f32; LANES]; PARTS]>);

multiversion!(
    /// Nearest triangles of `points`, all inside `cell`, from its complete list.
    ///
    /// Points whose unsigned distance is certainly not in `window` may be left without an answer.
    pub(crate) fn evaluate(
        tree: &Tree,
        cell: &Aabb,
        points: &Points,
        list: &[Slot],
        window: Range,
        rows: &mut Rows,
        out: &mut Answers,
    ) = evaluate_body
);

#[inline(always)]
fn evaluate_body<F: Fuse>(tree: &Tree, cell: &Aabb, points: &Points, list: &[Slot], window: Range, rows: &mut Rows, out: &mut Answers) {
    *out = Answers::NONE;
    if let [only] = list {
        let every: [u8; BLOCK] = std::array::from_fn(|i| i as u8);
        return exact(tree, points, *only, &every[..points.count.min(BLOCK)], out);
    }
    let base = cell.center();
    let offsets: [Offsets<LANES>; PARTS] = std::array::from_fn(|part| {
        Offsets::from_fn(|lane| {
            let i = part * LANES + lane;
            DVec3::new(points.x[i], points.y[i], points.z[i]) - base
        })
    });
    let (rows, parts) = (&mut rows.0, points.count.div_ceil(LANES).min(PARTS));
    rows.clear();
    let mut least = [[f32::INFINITY; LANES]; PARTS];
    for &slot in list {
        let frame = tree.frame_at(slot);
        let mut row = [[0.0; LANES]; PARTS];
        for part in 0..parts {
            frame.distances_squared::<F, LANES>(base, &offsets[part], &mut row[part]);
            for lane in 0..LANES {
                least[part][lane] = if row[part][lane] < least[part][lane] { row[part][lane] } else { least[part][lane] };
            }
        }
        rows.push(row);
    }
    // Both sides of a comparison may be off by the error.
    let error = filter_error(tree, cell) as f32;
    let (low, high) = ((window.lower * (1.0 - 1e-6)) as f32 - error, (window.upper * (1.0 + 1e-6)) as f32 + error);
    for lane in least[..parts].as_flattened_mut() {
        let distance = lane.sqrt();
        let reach = distance + 2.0 * error;
        let reach = reach * reach * (1.0 + 8.0 * f32::EPSILON);
        *lane = if (distance < low) | (distance > high) { -1.0 } else { reach };
    }
    for (&slot, row) in list.iter().zip(rows.iter()) {
        exact_near::<F>(tree, points, slot, &row[..parts], &least[..parts], out);
    }
}

/// Offers a triangle to the points for which its filtered squared distance is not above a limit.
#[inline(always)]
fn exact_near<F: Fuse>(tree: &Tree, points: &Points, slot: Slot, squared: &[[f32; LANES]], limits: &[[f32; LANES]], out: &mut Answers) {
    let mut chosen = [0u8; BLOCK + LANES];
    let mut count = 0;
    for (part, (squared, limits)) in squared.iter().zip(limits).enumerate() {
        let mut mask = F::mask_not_above(squared, limits);
        while mask != 0 {
            chosen[count] = (part * LANES) as u8 + mask.trailing_zeros() as u8;
            count += 1;
            mask &= mask - 1;
        }
    }
    exact(tree, points, slot, &chosen[..count], out);
}

/// Offers a triangle to the chosen points; the lowest index keeps ties.
#[inline(always)]
fn exact(tree: &Tree, points: &Points, slot: Slot, chosen: &[u8], out: &mut Answers) {
    let (facet, triangle) = (*tree.facet_at(slot), tree.triangle(slot));
    for group in chosen.chunks(GROUP) {
        let mut p = [[0.0f64; GROUP]; 3];
        for lane in 0..GROUP {
            let i = usize::from(group[lane.min(group.len() - 1)]) % BLOCK;
            (p[0][lane], p[1][lane], p[2][lane]) = (points.x[i], points.y[i], points.z[i]);
        }
        let (mut squared, mut s, mut t) = ([0.0f64; GROUP], [0.0f64; GROUP], [0.0f64; GROUP]);
        for lane in 0..GROUP {
            let foot = facet.foot(DVec3::new(p[0][lane], p[1][lane], p[2][lane]));
            (squared[lane], s[lane], t[lane]) = (foot.distance_squared, foot.s, foot.t);
        }
        for (lane, &i) in group.iter().enumerate() {
            let i = usize::from(i) % BLOCK;
            if squared[lane] < out.squared[i] || (squared[lane] == out.squared[i] && triangle < out.triangle[i]) {
                (out.squared[i], out.s[i], out.t[i]) = (squared[lane], s[lane], t[lane]);
                out.triangle[i] = triangle;
            }
        }
    }
}
