//! Sides of whole blocks and of the points of a block, asked as seldom as possible.

use crate::bvh::descend::{Block, Visit};
use crate::bvh::evaluate::{Answers, BLOCK, Points};
use crate::bvh::tree::Slot;
use crate::bvh::{Candidate, Tree};
use crate::geom::DVec3;
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
        let mut sides = [Side::Outside; BLOCK];
        let distance: [f64; BLOCK] = std::array::from_fn(|i| answers.squared[i].sqrt());
        let hand_on = self.surface.side_changes_at_surface_only();
        // Two balls that overlap leave no room for the surface between their centres, however both were rounded.
        let tree = self.surface.tree();
        let reach = points.x[0].abs().max(points.y[0].abs()).max(points.z[0].abs())
            + tree.extent.max.abs().max(tree.extent.min.abs()).max_element();
        let step = spacing * (1.0 + 1e-9) + 64.0 * f64::EPSILON * reach;
        for (i, local) in slots(block) {
            if answers.triangle[i] == u32::MAX {
                continue;
            }
            let told = [(local[2] > 0, 1), (local[1] > 0, 4), (local[0] > 0, 16)].into_iter().find(|&(exists, back)| {
                let asked = |j: usize| answers.triangle[j] != u32::MAX && sides[j].is_certain();
                hand_on && exists && asked(i - back) && distance[i] + distance[i - back] > step
            });
            sides[i] = match told {
                Some((_, back)) => sides[i - back],
                None => {
                    let p = DVec3::new(points.x[i], points.y[i], points.z[i]);
                    let triangle = answers.triangle[i];
                    self.surface.side(p, &tree.facet(triangle).nearest(p), triangle)
                }
            };
        }
        sides
    }
}

/// The nearest triangle of a point, from the complete list of a box around it where that is short.
fn nearest(tree: &Tree, list: &[Slot], p: DVec3) -> Candidate {
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
    (0..size[0]).flat_map(move |i| (0..size[1]).flat_map(move |j| (0..size[2]).map(move |k| ((i * 16 + j * 4 + k) as usize, [i, j, k]))))
}
