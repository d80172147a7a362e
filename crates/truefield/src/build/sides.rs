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
        // Rounding of coordinates, however two balls were rounded.
        let tree = self.surface.tree();
        let reach = points.x[0].abs().max(points.y[0].abs()).max(points.z[0].abs())
            + tree.extent.max.abs().max(tree.extent.min.abs()).max_element();
        let slack = 64.0 * f64::EPSILON * reach;
        let mut flood = Flood {
            size: std::array::from_fn(|axis| block.high[axis] - block.low[axis]),
            distance: std::array::from_fn(|i| answers.squared[i].sqrt()),
            steps: [1.0f64, 2.0, 3.0].map(|squared| squared.sqrt() * spacing * (1.0 + 1e-9) + slack),
            sides: [None; BLOCK],
            carries: [0.0; BLOCK],
        };
        // The longest path through a block is asked for.
        let longest = 10.0 * spacing;
        let mut order: [(f64, u8); BLOCK] = std::array::from_fn(|i| (flood.distance[i], i as u8));
        order.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut held = [false; BLOCK];
        for (i, _) in slots(block) {
            held[i] = answers.triangle[i] != u32::MAX;
        }
        for i in order.map(|(_, i)| usize::from(i)) {
            if !held[i] || flood.sides[i].is_some() {
                continue;
            }
            if !flood.take_over(i) {
                let p = DVec3::new(points.x[i], points.y[i], points.z[i]);
                let triangle = answers.triangle[i];
                let (side, carry) = self.surface.steady(p, &tree.facet(triangle).nearest(p), triangle, longest);
                (flood.sides[i], flood.carries[i]) = (Some(side), if side.is_certain() { carry } else { 0.0 });
            }
            flood.hand_on(i, &held);
        }
        flood.sides.map(|side| side.unwrap_or(Side::Outside))
    }
}

/// Sides spreading over a block: two balls that overlap leave no room for the surface between their centres.
struct Flood {
    size: [i64; 3],
    distance: [f64; BLOCK],
    /// Lengths of steps along one, two and three axes, with room for rounding.
    steps: [f64; 3],
    sides: [Option<Side>; BLOCK],
    /// How far each side carries along paths off the surface.
    carries: [f64; BLOCK],
}

impl Flood {
    /// The slot `step` away, if it is in the block.
    fn neighbour(&self, place: [i64; 3], step: [i64; 3]) -> Option<usize> {
        let at: [i64; 3] = std::array::from_fn(|axis| place[axis] + step[axis]);
        (0..3).all(|axis| (0..self.size[axis]).contains(&at[axis])).then(|| (at[0] * 16 + at[1] * 4 + at[2]) as usize)
    }

    /// Gives slot `to` the side of slot `from`, `length` away, if the way there is clear.
    fn copy(&mut self, from: usize, to: usize, length: f64) -> bool {
        let clear = self.sides[from].is_some() && self.carries[from] >= length && self.distance[from] + self.distance[to] > length;
        if clear {
            (self.sides[to], self.carries[to]) = (self.sides[from], self.carries[from] - length);
        }
        clear
    }

    /// Takes a side over from any of the 26 neighbours.
    fn take_over(&mut self, to: usize) -> bool {
        let at = place(to);
        for step in (0..27).map(|n| [n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1]) {
            let axes = step.iter().filter(|&&x| x != 0).count();
            if axes == 0 {
                continue;
            }
            if let Some(from) = self.neighbour(at, step)
                && self.copy(from, to, self.steps[axes - 1])
            {
                return true;
            }
        }
        false
    }

    /// Hands a side on along the axes, as far as it goes.
    fn hand_on(&mut self, from: usize, held: &[bool; BLOCK]) {
        const AXES: [[i64; 3]; 6] = [[0, 0, 1], [0, 0, -1], [0, 1, 0], [0, -1, 0], [1, 0, 0], [-1, 0, 0]];
        let mut stack = [0u8; BLOCK];
        stack[0] = from as u8;
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let from = usize::from(stack[height]);
            let at = place(from);
            for step in AXES {
                let Some(to) = self.neighbour(at, step) else { continue };
                if held[to] && self.sides[to].is_none() && self.copy(from, to, self.steps[0]) {
                    stack[height] = to as u8;
                    height += 1;
                }
            }
        }
    }
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
