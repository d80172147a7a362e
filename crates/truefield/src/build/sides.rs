//! Sides of whole blocks and of the points of a block, asked as seldom as possible.

use crate::bvh::descend::{Block, Visit};
use crate::bvh::evaluate::{Answers, BLOCK, Points};
use crate::bvh::tree::Slot;
use crate::bvh::{Candidate, Tree};
use crate::geom::DVec3;
use crate::simd::{Fuse, multiversion};
use crate::source::mesh::{Side, Surface};

/// Lists up to this length are searched; longer ones are slower than the tree.
const SEARCHED: usize = 48;

/// Remembers the last block that was found to lie on one side.
pub(crate) struct Sides<'a> {
    surface: &'a Surface,
    settled: Option<(Block, Side)>,
}

impl<'a> Sides<'a> {
    pub fn new(surface: &'a Surface) -> Self {
        Self { surface, settled: None }
    }

    /// The one side of a block that no triangle touches; `None` where it may have two or cannot be decided.
    pub fn of_block(&mut self, at: &Visit<'_>) -> Option<Side> {
        if let Some((block, side)) = self.settled
            && block.holds(&at.block)
        {
            return Some(side);
        }
        if at.range.lower <= 0.0 {
            return None;
        }
        let side = self.of_clear_box(at)?;
        self.settled = Some((at.block, side));
        Some(side)
    }

    /// The one side of a box that no triangle touches.
    pub fn of_clear_box(&self, at: &Visit<'_>) -> Option<Side> {
        let (tree, center) = (self.surface.tree(), at.cell.center());
        let found = nearest(tree, at.list, center);
        let foot = tree.facet(found.triangle).nearest(center);
        if self.surface.side_changes_at_surface_only() {
            Some(self.surface.side(center, &foot, found.triangle)).filter(|side| side.is_certain())
        } else {
            self.surface.side_of_ball(center, &foot, found.triangle, at.cell.radius())
        }
    }

    /// The side of every point of a block of a lattice of points, asking only where no neighbour can tell.
    pub fn of_points(&self, block: &Block, spacing: f64, points: &Points, answers: &Answers) -> [Side; BLOCK] {
        // Rounding of coordinates, however two balls were rounded.
        let tree = self.surface.tree();
        let reach = points.x[0].abs().max(points.y[0].abs()).max(points.z[0].abs())
            + tree.extent.max.abs().max(tree.extent.min.abs()).max_element();
        let slack = 64.0 * f64::EPSILON * reach;
        let steps = [1.0f64, 2.0, 3.0].map(|squared| squared.sqrt() * spacing * (1.0 + 1e-9) + slack);
        let mut left = 0u64;
        for (i, _) in slots(block) {
            left |= u64::from(answers.triangle[i] != u32::MAX) << i;
        }
        let mut clear = Clear([0; WAYS.len()]);
        clear_ways(answers, &steps, &mut clear);
        // A side carries across a block, from the first point that is asked.
        let longest = 10.0 * spacing;
        let mut sides = [Side::Outside; BLOCK];
        while left != 0 {
            let i = farthest(answers, left);
            let p = DVec3::new(points.x[i], points.y[i], points.z[i]);
            let triangle = answers.triangle[i];
            let (side, carry) = self.surface.steady(p, &tree.facet(triangle).at(answers.foot(i)), triangle, longest);
            let reached = if side.is_certain() { clear.reach(1 << i, left, carry / steps[2]) } else { 1 << i };
            left &= !reached;
            for (i, out) in sides.iter_mut().enumerate() {
                *out = if reached >> i & 1 == 1 { side } else { *out };
            }
        }
        sides
    }
}

/// Points that are looked at side by side.
const LANES: usize = 16;

/// The way to a neighbour: how far on it is, along how many axes, and the slots that have one there.
type Way = (u32, usize, u64);

/// Half of the 26 neighbours; the others are those whose neighbour a slot is.
const WAYS: [Way; 13] = {
    let mut ways = [(0, 0, 0); 13];
    let mut n = 0;
    while n < 13 {
        // The later half of the steps -1, 0, 1 along three axes.
        let step = [(n as i32 + 14) / 9 - 1, (n as i32 + 14) / 3 % 3 - 1, (n as i32 + 14) % 3 - 1];
        let mut axes = 0;
        let mut held = u64::MAX;
        let mut axis = 0;
        while axis < 3 {
            axes += (step[axis] != 0) as usize;
            let mut i = 0;
            while i < 64 {
                let at = (i >> (4 - 2 * axis) & 3) + step[axis];
                if at < 0 || at > 3 {
                    held &= !(1u64 << i);
                }
                i += 1;
            }
            axis += 1;
        }
        ways[n] = ((16 * step[0] + 4 * step[1] + step[2]) as u32, axes, held);
        n += 1;
    }
    ways
};

/// By way: the slots from which it leads clear of the surface, as two balls that overlap leave no room for it between their centres.
struct Clear([u64; WAYS.len()]);

impl Clear {
    /// The slots among `open` that can be reached from those of `from` in so many steps.
    fn reach(&self, from: u64, open: u64, steps: f64) -> u64 {
        let mut reached = from;
        let mut step = 1.0;
        while step <= steps {
            let mut next = reached;
            for (&(on, ..), clear) in WAYS.iter().zip(self.0) {
                next |= (reached & clear) << on | (reached >> on) & clear;
            }
            next &= open;
            if next == reached {
                break;
            }
            reached = next;
            step += 1.0;
        }
        reached
    }
}

multiversion!(
    /// Finds the clear ways of a block, whose steps along one, two and three axes have the lengths `steps`.
    fn clear_ways(answers: &Answers, steps: &[f64; 3], clear: &mut Clear) = clear_ways_body
);

#[inline(always)]
fn clear_ways_body<F: Fuse>(answers: &Answers, steps: &[f64; 3], clear: &mut Clear) {
    // Single precision, shorter than the truth by more than all its rounding; slots beyond the block lead nowhere.
    let mut distance = [0.0f32; BLOCK + 32];
    for (distance, squared) in distance.iter_mut().zip(&answers.squared) {
        *distance = squared.sqrt() as f32 * (1.0 - 8.0 * f32::EPSILON);
    }
    for (&(on, axes, held), clear) in WAYS.iter().zip(&mut clear.0) {
        let length = [(steps[axes - 1] as f32).next_up(); LANES];
        let mut blocked = 0u64;
        for start in (0..BLOCK).step_by(LANES) {
            let mut sum = [0.0f32; LANES];
            for lane in 0..LANES {
                sum[lane] = distance[start + lane] + distance[start + lane + on as usize];
            }
            blocked |= u64::from(F::mask_not_above(&sum, &length)) << start;
        }
        *clear = held & !blocked;
    }
}

multiversion!(
    /// The one of `among` with the greatest distance, the lowest of those.
    fn farthest(answers: &Answers, among: u64) -> usize = farthest_body
);

#[inline(always)]
fn farthest_body<F: Fuse>(answers: &Answers, among: u64) -> usize {
    let mut greatest = [-1.0f64; LANES];
    for start in (0..BLOCK).step_by(LANES) {
        for lane in 0..LANES {
            let squared = answers.squared[start + lane];
            greatest[lane] = if (among >> (start + lane) & 1 == 1) & (squared > greatest[lane]) { squared } else { greatest[lane] };
        }
    }
    let greatest = greatest.into_iter().fold(-1.0, f64::max);
    (0..BLOCK).find(|&i| among >> i & 1 == 1 && answers.squared[i] == greatest).unwrap_or(0)
}

/// The nearest triangle of a point, from the complete list of a box around it where that is short.
pub(crate) fn nearest(tree: &Tree, list: &[Slot], p: DVec3) -> Candidate {
    let mut best = Candidate::within(f64::INFINITY);
    if list.is_empty() || list.len() > SEARCHED {
        return tree.nearest(p, best);
    }
    for &slot in list {
        best.offer(tree.facet_at(slot).distance_squared(p), tree.triangle(slot));
    }
    best
}

/// The slots of a block of at most 4 x 4 x 4 that hold its points, with their position in it.
pub(crate) fn slots(block: &Block) -> impl Iterator<Item = (usize, [i64; 3])> + use<> {
    let size: [i64; 3] = std::array::from_fn(|axis| block.high[axis] - block.low[axis]);
    (0..BLOCK).map(|i| (i, place(i))).filter(move |(_, at)| (0..3).all(|axis| at[axis] < size[axis]))
}

/// Where a slot lies in its block.
fn place(i: usize) -> [i64; 3] {
    [i >> 4, i >> 2 & 3, i & 3].map(|x| x as i64)
}
