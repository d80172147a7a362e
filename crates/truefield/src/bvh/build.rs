//! Building the tree: surface area heuristic over bins, then eight children a node.

use std::sync::{Mutex, PoisonError};

use super::frame::Frame;
use super::tree::{ABSENT, LEAF, Node, Packet, Slot, Tree, WIDTH};
use crate::error::Result;
use crate::geom::{Aabb, DVec3, Facet};
use crate::mesh::TriangleMesh;
use crate::run::Run;

const BINS: usize = 16;

/// From this depth on nodes are halved by count, so that a query's stack stays short on any mesh.
const DEEP: usize = 20;

/// Triangles or leaves a worker takes at once.
const CHUNK: usize = 4096;

/// A box in single precision around the tree's centre, rounded outward: its least corner from lane 0 on, its greatest,
/// negated, from lane 4 on, so that one comparison of vectors serves both.
#[derive(Clone, Copy)]
struct Bounds([f32; 8]);

/// A triangle to be placed.
#[derive(Clone, Copy)]
struct Item {
    bounds: Bounds,
    triangle: u32,
}

/// Some of the triangles and their box.
struct Part<'a> {
    items: &'a mut [Item],
    bounds: Bounds,
}

/// A tree in the making; its leaves are runs of the order in which it saw the triangles.
#[derive(Default)]
struct Builder {
    nodes: Vec<Node>,
    /// First place and number of triangles of every leaf.
    leaves: Vec<(u32, u32)>,
    triangles: Vec<u32>,
}

impl Tree {
    /// Builds the tree. O(n log n) time; the result does not depend on the number of threads.
    pub fn build(mesh: &TriangleMesh, run: &Run<'_>) -> Result<Self> {
        let extent = mesh.extent();
        let center = extent.center();
        let count = mesh.triangles().len();
        let mut items = vec![Item { bounds: Bounds::EMPTY, triangle: 0 }; count];
        run.chunks("prepare triangles", &mut items, CHUNK, |block, items| {
            for (triangle, item) in (block * CHUNK..).map(|t| t as u32).zip(items) {
                *item = Item { bounds: Bounds::around(&Aabb::around(mesh.corners(triangle)), center), triangle };
            }
            Ok(())
        })?;
        let Builder { nodes, leaves, triangles } = Builder::grow(&mut items, run)?;
        let mut slots = vec![Slot(0); count];
        for (slot, &triangle) in triangles.iter().enumerate() {
            slots[triangle as usize] = Slot(slot as u32);
        }
        let mut facets = vec![Facet::new(DVec3::ZERO, DVec3::ZERO, DVec3::ZERO); count];
        run.chunks("prepare triangles", &mut facets, CHUNK, |block, facets| {
            for (facet, &triangle) in facets.iter_mut().zip(&triangles[block * CHUNK..]) {
                let [a, b, c] = mesh.corners(triangle);
                *facet = Facet::new(a, b, c);
            }
            Ok(())
        })?;
        let mut frames = vec![Frame::new([DVec3::ZERO; 3]); count];
        run.chunks("prepare triangles", &mut frames, CHUNK, |block, frames| {
            for (frame, &triangle) in frames.iter_mut().zip(&triangles[block * CHUNK..]) {
                *frame = Frame::new(mesh.corners(triangle));
            }
            Ok(())
        })?;
        let mut packets = vec![Packet::EMPTY; leaves.len()];
        run.chunks("prepare triangles", &mut packets, CHUNK / WIDTH, |block, packets| {
            for (packet, &(first, count)) in packets.iter_mut().zip(&leaves[block * CHUNK / WIDTH..]) {
                packet.fill(first, count, &facets, &triangles);
            }
            Ok(())
        })?;
        Ok(Self { nodes, packets, facets, frames, triangles, slots, extent, center, radius: extent.radius() })
    }
}

impl Builder {
    /// The whole tree: the root, and the trees of its children side by side.
    fn grow(items: &mut [Item], run: &Run<'_>) -> Result<Self> {
        let parts: Vec<Mutex<Part<'_>>> = divide(Part::of(items), 0).into_iter().map(Mutex::new).collect();
        let children = run.blocks("build tree", parts.len(), |index| {
            let mut part = parts[index].lock().unwrap_or_else(PoisonError::into_inner);
            let mut builder = Self::default();
            let bounds = part.bounds;
            let child = builder.child(Part { items: &mut *part.items, bounds }, 1, run)?;
            Ok((bounds, child, builder))
        })?;
        let mut whole = Self { nodes: vec![Node::EMPTY], ..Self::default() };
        for (slot, (bounds, child, part)) in children.into_iter().enumerate() {
            let (nodes, leaves, first) = (whole.nodes.len() as u32, whole.leaves.len() as u32, whole.triangles.len() as u32);
            let moved = |child: u32| match child {
                ABSENT => ABSENT,
                leaf if leaf & LEAF != 0 => leaf + leaves,
                node => node + nodes,
            };
            whole.nodes[0].set(slot, &bounds, moved(child));
            whole.nodes.extend(part.nodes.into_iter().map(|node| Node { child: node.child.map(moved), ..node }));
            whole.leaves.extend(part.leaves.into_iter().map(|(at, count)| (at + first, count)));
            whole.triangles.extend(part.triangles);
        }
        Ok(whole)
    }

    /// Adds the node or leaf over `part` and returns its name.
    fn child(&mut self, part: Part<'_>, depth: usize, run: &Run<'_>) -> Result<u32> {
        if part.items.len() <= WIDTH {
            part.items.sort_unstable_by_key(|item| item.triangle);
            self.leaves.push((self.triangles.len() as u32, part.items.len() as u32));
            self.triangles.extend(part.items.iter().map(|item| item.triangle));
            return Ok(LEAF | (self.leaves.len() - 1) as u32);
        }
        if part.items.len() > CHUNK {
            run.cancel.check()?;
        }
        let index = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        for (slot, part) in divide(part, depth).into_iter().enumerate() {
            let bounds = part.bounds;
            let child = self.child(part, depth + 1, run)?;
            self.nodes[index].set(slot, &bounds, child);
        }
        Ok(index as u32)
    }
}

/// Up to eight parts, the one with the largest surface split first.
fn divide(part: Part<'_>, depth: usize) -> Vec<Part<'_>> {
    let mut parts = vec![part];
    while parts.len() < WIDTH {
        let widest = (0..parts.len())
            .filter(|&i| parts[i].items.len() > WIDTH)
            .max_by(|&i, &j| parts[i].bounds.area().total_cmp(&parts[j].bounds.area()).then(j.cmp(&i)));
        let Some(widest) = widest else { break };
        let (left, right) = parts.swap_remove(widest).split(depth);
        parts.push(left);
        parts.push(right);
    }
    parts
}

impl<'a> Part<'a> {
    fn of(items: &'a mut [Item]) -> Self {
        let bounds = items.iter().fold(Bounds::EMPTY, |bounds, item| bounds.union(&item.bounds));
        Self { items, bounds }
    }

    /// The cheapest split over the bins of all three axes; the middle where no bin separates.
    fn split(self, depth: usize) -> (Self, Self) {
        let mut centers = Bounds::EMPTY;
        for item in self.items.iter() {
            let mut at = Bounds::EMPTY;
            for axis in 0..3 {
                let center = item.bounds.twice_center(axis);
                (at.0[axis], at.0[axis + 4]) = (center, -center);
            }
            centers = centers.union(&at);
        }
        let scale: [f32; 3] = std::array::from_fn(|axis| BINS as f32 / (centers.max(axis) - centers.min(axis)));
        let bin_of =
            |item: &Item, axis: usize| (((item.bounds.twice_center(axis) - centers.min(axis)) * scale[axis]) as usize).min(BINS - 1);
        let mut bins = [[(Bounds::EMPTY, 0usize); BINS]; 3];
        if depth < DEEP {
            for item in self.items.iter() {
                for (axis, bins) in bins.iter_mut().enumerate() {
                    let bin = &mut bins[bin_of(item, axis)];
                    *bin = (bin.0.union(&item.bounds), bin.1 + 1);
                }
            }
        }
        let mut best: Option<(f32, usize, usize, [Bounds; 2])> = None;
        for axis in 0..3 {
            if !(scale[axis] > 0.0 && scale[axis].is_finite()) {
                continue;
            }
            let mut after = [(Bounds::EMPTY, 0usize); BINS + 1];
            for i in (0..BINS).rev() {
                after[i] = (after[i + 1].0.union(&bins[axis][i].0), after[i + 1].1 + bins[axis][i].1);
            }
            let mut before = (Bounds::EMPTY, 0usize);
            for cut in 1..BINS {
                let bin = &bins[axis][cut - 1];
                before = (before.0.union(&bin.0), before.1 + bin.1);
                if before.1 == 0 || after[cut].1 == 0 {
                    continue;
                }
                // Whole leaves are what costs.
                let leaves = |n: usize| n.div_ceil(WIDTH) as f32;
                let cost = before.0.area() * leaves(before.1) + after[cut].0.area() * leaves(after[cut].1);
                if best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, axis, cut, [before.0, after[cut].0]));
                }
            }
        }
        let Some((_, axis, cut, [first, second])) = best else {
            let (left, right) = self.items.split_at_mut(self.items.len() / 2);
            return (Part::of(left), Part::of(right));
        };
        let at = partition(self.items, |item| bin_of(item, axis) < cut);
        let (left, right) = self.items.split_at_mut(at);
        (Part { items: left, bounds: first }, Part { items: right, bounds: second })
    }
}

/// Brings the items that are `left` to the front and returns their number.
fn partition(items: &mut [Item], left: impl Fn(&Item) -> bool) -> usize {
    let mut at = 0;
    for index in 0..items.len() {
        // Always swapped: no branch to be guessed.
        items.swap(index, at);
        at += usize::from(left(&items[at]));
    }
    at
}

impl Bounds {
    const EMPTY: Self = Self([f32::INFINITY; 8]);

    fn around(b: &Aabb, center: DVec3) -> Self {
        let mut bounds = Self::EMPTY;
        for axis in 0..3 {
            bounds.0[axis] = below(b.min[axis] - center[axis]);
            bounds.0[axis + 4] = below(center[axis] - b.max[axis]);
        }
        bounds
    }

    fn min(&self, axis: usize) -> f32 {
        self.0[axis]
    }

    fn max(&self, axis: usize) -> f32 {
        -self.0[axis + 4]
    }

    #[inline(always)]
    fn union(&self, other: &Self) -> Self {
        // Never NaN: comparisons are what the processor does at once.
        Self(std::array::from_fn(|lane| if other.0[lane] < self.0[lane] { other.0[lane] } else { self.0[lane] }))
    }

    #[inline(always)]
    fn twice_center(&self, axis: usize) -> f32 {
        self.0[axis] - self.0[axis + 4]
    }

    fn area(&self) -> f32 {
        let [x, y, z]: [f32; 3] = std::array::from_fn(|axis| self.max(axis) - self.min(axis));
        if x < 0.0 { 0.0 } else { x * y + y * z + z * x }
    }
}

impl Node {
    const EMPTY: Self = Self { min: [[f32::INFINITY; WIDTH]; 3], max: [[f32::NEG_INFINITY; WIDTH]; 3], child: [ABSENT; WIDTH] };

    fn set(&mut self, slot: usize, bounds: &Bounds, child: u32) {
        for axis in 0..3 {
            self.min[axis][slot] = bounds.min(axis);
            self.max[axis][slot] = bounds.max(axis);
        }
        self.child[slot] = child;
    }
}

impl Packet {
    pub(super) const EMPTY: Self = {
        let zero = [[0.0; WIDTH]; 3];
        Self { a: zero, ab: zero, ac: zero, v: zero, inverse: zero, slope: [0.0; WIDTH], triangle: [0; WIDTH], first: 0, count: 0 }
    };

    fn fill(&mut self, first: u32, count: u32, facets: &[Facet], triangles: &[u32]) {
        (self.first, self.count) = (first, count);
        for lane in 0..WIDTH {
            let slot = (first + (lane as u32).min(count - 1)) as usize;
            self.set(lane, &facets[slot], triangles[slot]);
        }
    }

    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, facet: &Facet, triangle: u32) {
        for axis in 0..3 {
            self.a[axis][lane] = facet.a[axis];
            self.ab[axis][lane] = facet.ab[axis];
            self.ac[axis][lane] = facet.ac[axis];
            self.v[axis][lane] = facet.v[axis];
            self.inverse[axis][lane] = facet.inverse[axis];
        }
        self.slope[lane] = facet.slope;
        self.triangle[lane] = triangle;
    }
}

/// The largest single that is not above `x`.
fn below(x: f64) -> f32 {
    let single = x as f32;
    if f64::from(single) > x { single.next_down() } else { single }
}
