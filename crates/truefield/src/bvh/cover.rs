//! Which triangles can be nearest somewhere in a box: complete lists, much tighter than the paper's.
//!
//! Huang et al. keep every triangle within d(c) + sqrt(3) h of a cell's centre, a cap of the surface that grows
//! with the distance. Here a triangle T leaves the list of a box once one *witness* q, a point of the surface,
//! is nearer than T from every point of the box. As |p - t|^2 - |p - q|^2 is linear in p for every t, its
//! minimum over t in T is concave in p: it is positive on the box if it is positive at the eight corners.
//! So the test needs eight distances, is exact for a witness, and its lists do not grow with the distance.
//! Witnesses are the nearest points of the corners.

use super::frame::{FILTER_ERROR, Offsets};
use super::nearest::Candidate;
use super::tree::{ABSENT, LEAF, Tree, WIDTH};
use crate::geom::{Aabb, DVec3};
use crate::simd::{Fuse, multiversion};

const CORNERS: usize = 8;

/// Bounds of the unsigned distance over a box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Range {
    pub lower: f64,
    pub upper: f64,
}

impl Range {
    /// All distances.
    pub const ALL: Self = Self { lower: 0.0, upper: f64::INFINITY };
}

/// Memory that is used again from box to box.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    corners: Vec<[f32; CORNERS]>,
    stack: Vec<u32>,
}

/// Fills `out` with every triangle that can be nearest somewhere in `cell`, ascending, if distances in
/// `window` can occur there.
pub(crate) fn gather(tree: &Tree, cell: &Aabb, window: Range, scratch: &mut Scratch, out: &mut Vec<u32>) -> Range {
    let center = cell.center();
    let first = tree.nearest(center, Candidate::within(f64::INFINITY));
    let witness = tree.facets[first.triangle as usize].nearest(center).point;
    let distance = first.distance_squared.sqrt();
    let range = Range { lower: (distance - cell.radius()).max(0.0), upper: distance + cell.radius() };
    if range.lower > window.upper || range.upper < window.lower {
        out.clear();
        return range;
    }
    let mut rough = Vec::new();
    collect(tree, cell, witness, &mut scratch.stack, &mut rough);
    rough.sort_unstable();
    rough.dedup();
    refine(tree, cell, &rough, scratch, out)
}

multiversion!(
    /// Fills `out` with those triangles of `list`, a complete list of a box around `cell`, that can be
    /// nearest somewhere in `cell`; keeps their order.
    pub(crate) fn refine(tree: &Tree, cell: &Aabb, list: &[u32], scratch: &mut Scratch, out: &mut Vec<u32>) -> Range = refine_body
);

multiversion!(fn collect(tree: &Tree, cell: &Aabb, witness: DVec3, stack: &mut Vec<u32>, out: &mut Vec<u32>) = collect_body);

/// How far single-precision distances from points of `cell` may be off.
pub(crate) fn filter_error(tree: &Tree, cell: &Aabb) -> f64 {
    FILTER_ERROR * ((cell.center() - tree.center).length() + cell.radius() + 2.0 * tree.radius)
}

/// Descends into every node that the witness does not rule out for the whole cell.
#[inline(always)]
fn collect_body<F: Fuse>(tree: &Tree, cell: &Aabb, witness: DVec3, stack: &mut Vec<u32>, out: &mut Vec<u32>) {
    let (low, high, q) = (cell.min - tree.center, cell.max - tree.center, witness - tree.center);
    let size = low.abs().max(high.abs()).max_element() + tree.radius;
    // Rounding of sums of squares of coordinates up to `size`.
    let slack = 64.0 * f64::EPSILON * size * size;
    stack.clear();
    stack.push(0);
    while let Some(index) = stack.pop() {
        let node = &tree.nodes[index as usize];
        let mut least = [0.0f64; WIDTH];
        for axis in 0..3 {
            let (low, high, q) = (low[axis], high[axis], q[axis]);
            for lane in 0..WIDTH {
                let (min, max) = (f64::from(node.min[axis][lane]), f64::from(node.max[axis][lane]));
                // Squared distance to the box less squared distance to the witness: concave along the axis.
                let at = |p: f64| {
                    let gap = (min - p).max(p - max).max(0.0);
                    gap * gap - (p - q) * (p - q)
                };
                least[lane] += at(low).min(at(high));
            }
        }
        for lane in 0..WIDTH {
            let child = node.child[lane];
            if child == ABSENT || least[lane] > slack {
                continue;
            }
            if child & LEAF != 0 {
                out.extend_from_slice(&tree.packets[(child & !LEAF) as usize].triangle);
            } else {
                stack.push(child);
            }
        }
    }
}

#[inline(always)]
fn refine_body<F: Fuse>(tree: &Tree, cell: &Aabb, list: &[u32], scratch: &mut Scratch, out: &mut Vec<u32>) -> Range {
    let center = cell.center();
    let offsets = Offsets::<CORNERS>::from_fn(|corner| cell.corner(corner) - center);
    let error = filter_error(tree, cell) as f32;
    let squared = &mut scratch.corners;
    squared.clear();
    let mut least = [f32::INFINITY; CORNERS];
    let mut nearest = [0u32; CORNERS];
    for &triangle in list {
        let mut row = [0.0; CORNERS];
        tree.frames[triangle as usize].distances_squared::<F, CORNERS>(center, &offsets, &mut row);
        for lane in 0..CORNERS {
            let nearer = row[lane] < least[lane];
            least[lane] = if nearer { row[lane] } else { least[lane] };
            nearest[lane] = if nearer { triangle } else { nearest[lane] };
        }
        squared.push(row);
    }
    // Squared distances from every corner to every witness, too large rather than too small by all errors.
    let mut reach = [[0.0f32; CORNERS]; CORNERS];
    let mut upper = f32::INFINITY;
    for witness in 0..CORNERS {
        let q = tree.facets[nearest[witness] as usize].nearest(cell.corner(witness)).point - center;
        let (x, y, z) = (q.x as f32, q.y as f32, q.z as f32);
        let mut farthest = 0.0f32;
        for corner in 0..CORNERS {
            let (x, y, z) = (offsets.x[corner] - x, offsets.y[corner] - y, offsets.z[corner] - z);
            let distance = (x * x + y * y + z * z).sqrt() + 2.0 * error;
            farthest = farthest.max(distance);
            reach[witness][corner] = distance * distance * (1.0 + 8.0 * f32::EPSILON);
        }
        upper = upper.min(farthest);
    }
    out.clear();
    for (&triangle, row) in list.iter().zip(squared.iter()) {
        let mut beaten = false;
        for witness in &reach {
            let mut farther = true;
            for corner in 0..CORNERS {
                farther &= row[corner] > witness[corner];
            }
            beaten |= farther;
        }
        if !beaten {
            out.push(triangle);
        }
    }
    let nearest = least.iter().fold(f32::INFINITY, |a, &b| a.min(b)).sqrt();
    let lower = f64::from(nearest) - f64::from(error) - cell.radius();
    Range { lower: lower.max(0.0), upper: f64::from(upper) }
}
