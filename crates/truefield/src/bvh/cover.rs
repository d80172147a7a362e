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
use super::tree::{ABSENT, LEAF, Slot, Tree, WIDTH};
use crate::geom::{Aabb, DVec3, Facet};
use crate::simd::{Fuse, multiversion};

/// Bounds of the unsigned distance over a box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Range {
    pub lower: f64,
    pub upper: f64,
}

impl Range {
    /// All distances.
    pub const ALL: Self = Self { lower: 0.0, upper: f64::INFINITY };

    /// Whether both hold a common distance.
    pub fn meets(self, other: Self) -> bool {
        self.lower <= other.upper && self.upper >= other.lower
    }
}

/// Corners of a box, and witnesses of a box.
const CORNERS: usize = 8;

/// Boxes shortened in one go: the octants of a block.
pub(crate) const OCTANTS: usize = 8;

/// Two boxes a vector.
const LANES: usize = 2 * CORNERS;
const PAIRS: usize = OCTANTS / 2;

/// Memory that is used again from box to box.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    /// By triangle of a list and pair of boxes.
    rows: Vec<[f32; LANES]>,
    stack: Vec<u32>,
}

/// The triangle nearest to the centre of `cell`, and the range that follows for all of it; `near` is a triangle that may be near.
pub(crate) fn center_range(tree: &Tree, cell: &Aabb, near: Slot) -> (Candidate, Range) {
    let center = cell.center();
    let start = Candidate { distance_squared: tree.facet_at(near).distance_squared(center), triangle: tree.triangle(near) };
    let nearest = tree.nearest(center, start);
    let (distance, radius) = (nearest.distance_squared.sqrt(), cell.radius() * (1.0 + 1e-12));
    (nearest, Range { lower: (distance - radius).max(0.0), upper: distance + radius })
}

/// Fills `out` with every triangle that can be nearest somewhere in `cell`, ascending, if distances in
/// `window` can occur there.
pub(crate) fn gather(tree: &Tree, cell: &Aabb, near: Slot, window: Range, scratch: &mut Scratch, out: &mut Vec<Slot>) -> Range {
    let (first, range) = center_range(tree, cell, near);
    out.clear();
    if range.meets(window) {
        let witness = tree.facet(first.triangle).nearest(cell.center()).point;
        collect(tree, cell, &[witness], usize::MAX, &mut scratch.stack, out);
        out.sort_unstable();
    }
    range
}

/// The complete list of `cell` in `out`, in the order of a walk; false, and no list, where about `most` triangles cannot be
/// ruled out at once by `witnesses`, points of the surface nearby.
pub(crate) fn gather_few(tree: &Tree, cell: &Aabb, witnesses: &[DVec3], most: usize, scratch: &mut Scratch, out: &mut Vec<Slot>) -> bool {
    out.clear();
    collect(tree, cell, witnesses, most, &mut scratch.stack, out);
    if out.len() > most {
        out.clear();
        return false;
    }
    true
}

multiversion!(
    /// Fills `out[i]` with those triangles of `list`, a complete list of a box around all `cells`, that can be
    /// nearest somewhere in `cells[i]`; keeps their order. Returns the range of every cell.
    pub(crate) fn refine(
        tree: &Tree,
        cells: &[Aabb],
        list: &[Slot],
        scratch: &mut Scratch,
        out: &mut [Vec<Slot>; OCTANTS],
    ) -> [Range; OCTANTS] = refine_body
);

multiversion!(
    fn collect(tree: &Tree, cell: &Aabb, witnesses: &[DVec3], most: usize, stack: &mut Vec<u32>, out: &mut Vec<Slot>) = collect_body
);

/// How far single-precision distances from points of `cell` may be off.
pub(crate) fn filter_error(tree: &Tree, cell: &Aabb) -> f64 {
    FILTER_ERROR * ((cell.center() - tree.center).length() + cell.radius() + 2.0 * tree.radius)
}

/// Descends into every node that no witness rules out for the whole cell; gives up beyond `most` triangles.
#[inline(always)]
fn collect_body<F: Fuse>(tree: &Tree, cell: &Aabb, witnesses: &[DVec3], most: usize, stack: &mut Vec<u32>, out: &mut Vec<Slot>) {
    let (low, high) = (cell.min - tree.center, cell.max - tree.center);
    let size = low.abs().max(high.abs()).max_element() + tree.radius;
    // Rounding of sums of squares of coordinates up to `size`.
    let slack = 64.0 * f64::EPSILON * size * size;
    stack.clear();
    stack.push(0);
    while let Some(index) = stack.pop() {
        if out.len() > most {
            return;
        }
        let node = &tree.nodes[index as usize];
        // Squared distances of the ends of the cell to the boxes, axis by axis.
        let mut gaps = [[[0.0f64; WIDTH]; 2]; 3];
        for axis in 0..3 {
            for (p, gaps) in [low[axis], high[axis]].into_iter().zip(&mut gaps[axis]) {
                for lane in 0..WIDTH {
                    let (min, max) = (f64::from(node.min[axis][lane]), f64::from(node.max[axis][lane]));
                    let gap = (min - p).max(p - max).max(0.0);
                    gaps[lane] = gap * gap;
                }
            }
        }
        // The squared distance to a box less that to a witness is concave along each axis, so least at an end.
        let mut least = [f64::NEG_INFINITY; WIDTH];
        for witness in witnesses {
            let q = *witness - tree.center;
            let (near, far) = ((low - q) * (low - q), (high - q) * (high - q));
            for lane in 0..WIDTH {
                let along = |axis: usize| {
                    let (near, far) = (gaps[axis][0][lane] - near[axis], gaps[axis][1][lane] - far[axis]);
                    if near < far { near } else { far }
                };
                let sum = along(0) + along(1) + along(2);
                least[lane] = if sum > least[lane] { sum } else { least[lane] };
            }
        }
        for lane in 0..WIDTH {
            let child = node.child[lane];
            if child == ABSENT || least[lane] > slack {
                continue;
            }
            if child & LEAF != 0 {
                let packet = &tree.packets[(child & !LEAF) as usize];
                out.extend((packet.first..packet.first + packet.count).map(Slot));
            } else {
                stack.push(child);
            }
        }
    }
}

#[inline(always)]
fn refine_body<F: Fuse>(
    tree: &Tree,
    cells: &[Aabb],
    list: &[Slot],
    scratch: &mut Scratch,
    out: &mut [Vec<Slot>; OCTANTS],
) -> [Range; OCTANTS] {
    // Slots beyond the cells that there are repeat the last.
    let cell = |i: usize| &cells[i.min(cells.len() - 1)];
    let around = cells.iter().fold(Aabb::EMPTY, |b, &c| b.union(c));
    let center = around.center();
    let offsets: [Offsets<LANES>; PAIRS] =
        std::array::from_fn(|pair| Offsets::from_fn(|lane| cell(2 * pair + lane / CORNERS).corner(lane % CORNERS) - center));
    let error = filter_error(tree, &around) as f32;
    let pairs = cells.len().div_ceil(2);
    let rows = &mut scratch.rows;
    rows.clear();
    rows.reserve(list.len() * pairs);
    let mut least = [[f32::INFINITY; LANES]; PAIRS];
    // Position in the list, as a float so that both are chosen by one kind of instruction.
    let mut nearest = [[0.0f32; LANES]; PAIRS];
    for (position, &slot) in list.iter().enumerate() {
        let (frame, position) = (tree.frame_at(slot), position as f32);
        for pair in 0..pairs {
            let mut row = [0.0; LANES];
            frame.distances_squared::<F, LANES>(center, &offsets[pair], &mut row);
            F::keep_least(&row, position, &mut least[pair], &mut nearest[pair]);
            rows.push(row);
        }
    }
    let mut ranges = [Range::ALL; OCTANTS];
    if let &[only] = list {
        // Nothing to drop; and the distance to one triangle is convex, so largest at a corner.
        for (i, (out, range)) in out.iter_mut().zip(&mut ranges).enumerate().take(cells.len()) {
            let corners = &rows[i / 2][i % 2 * CORNERS..][..CORNERS];
            let (low, high) = corners.iter().fold((f32::INFINITY, 0.0f32), |(low, high), &d| (low.min(d), high.max(d)));
            let error = f64::from(error);
            let lower = f64::from(low.sqrt()) - error - cells[i].radius();
            *range = Range { lower: lower.max(0.0), upper: f64::from(high.sqrt()) + error };
            out.clear();
            out.push(only);
        }
        return ranges;
    }
    for pair in 0..pairs {
        let offsets = &offsets[pair];
        // Squared distances from every corner to every witness of its box, too large rather than too small by all errors.
        let mut reach = [[0.0f32; LANES]; CORNERS];
        let mut farthest = [0.0f32; LANES];
        let [wx, wy, wz] = feet(tree, list, &nearest[pair], offsets, center);
        for (corner, reach) in reach.iter_mut().enumerate() {
            for lane in 0..LANES {
                let at = lane / CORNERS * CORNERS + corner;
                let (x, y, z) = (offsets.x[at] - wx[lane], offsets.y[at] - wy[lane], offsets.z[at] - wz[lane]);
                let distance = (x * x + y * y + z * z).sqrt() + 2.0 * error;
                farthest[lane] = if distance > farthest[lane] { distance } else { farthest[lane] };
                reach[lane] = distance * distance * (1.0 + 8.0 * f32::EPSILON);
            }
        }
        let [first, second] = [2 * pair, 2 * pair + 1];
        let (left, right) = out.split_at_mut(second);
        let (left, right) = (&mut left[first], &mut right[0]);
        for out in [&mut *left, &mut *right] {
            out.clear();
            out.resize(list.len(), Slot(0));
        }
        let mut kept = (0, 0);
        for (&slot, row) in list.iter().zip(rows[pair..].iter().step_by(pairs)) {
            // Kept without a branch, which nothing could foretell.
            (left[kept.0], right[kept.1]) = (slot, slot);
            let (low, high) = F::each_reached(row, &reach);
            kept = (kept.0 + usize::from(low), kept.1 + usize::from(high));
        }
        left.truncate(kept.0);
        right.truncate(kept.1);
        for (half, octant) in [first, second].into_iter().enumerate() {
            let lanes = half * CORNERS..(half + 1) * CORNERS;
            let nearest = least[pair][lanes.clone()].iter().fold(f32::INFINITY, |a, &b| a.min(b)).sqrt();
            let lower = f64::from(nearest) - f64::from(error) - cell(octant).radius();
            let upper = farthest[lanes].iter().fold(f32::INFINITY, |a, &b| a.min(b));
            ranges[octant] = Range { lower: lower.max(0.0), upper: f64::from(upper) };
        }
    }
    ranges
}

/// The nearest points of the triangles at `positions` from `center + offsets`, relative to `center`.
#[inline(always)]
fn feet(tree: &Tree, list: &[Slot], positions: &[f32; LANES], offsets: &Offsets<LANES>, center: DVec3) -> [[f32; LANES]; 3] {
    let facets: [Facet; LANES] = std::array::from_fn(|lane| *tree.facet_at(list[positions[lane] as usize]));
    let mut out = [[0.0; LANES]; 3];
    for lane in 0..LANES {
        let p = center + DVec3::new(f64::from(offsets.x[lane]), f64::from(offsets.y[lane]), f64::from(offsets.z[lane]));
        let (facet, foot) = (&facets[lane], facets[lane].foot(p));
        let q = facet.a + facet.ab * foot.s + facet.ac * foot.t - center;
        (out[0][lane], out[1][lane], out[2][lane]) = (q.x as f32, q.y as f32, q.z as f32);
    }
    out
}
