//! The boxes of many parts, found by how near they can be.

use crate::geom::{Aabb, DVec3};

/// A tree over boxes; leaves hold a few.
#[derive(Clone, Debug)]
pub(super) struct Boxes {
    boxes: Vec<Aabb>,
    /// The order of the boxes: a node holds a run of them.
    order: Vec<u32>,
    nodes: Vec<Node>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    extent: Aabb,
    first: u32,
    /// The end of the run; the children of an inner node are `child` and `child + 1`.
    end: u32,
    child: Option<u32>,
}

/// Boxes in a leaf.
const LEAF: usize = 4;

impl Boxes {
    /// Splits at the middle of the longest side of the centres' box until few are left.
    pub fn new(boxes: Vec<Aabb>) -> Self {
        let mut tree = Self { order: (0..boxes.len() as u32).collect(), boxes, nodes: Vec::new() };
        if !tree.boxes.is_empty() {
            tree.nodes.push(tree.node(0, tree.boxes.len()));
            let mut at = 0;
            while at < tree.nodes.len() {
                tree.split(at);
                at += 1;
            }
        }
        tree
    }

    fn node(&self, first: usize, end: usize) -> Node {
        let extent = self.order[first..end].iter().fold(Aabb::EMPTY, |all, &i| all.union(self.boxes[i as usize]));
        Node { extent, first: first as u32, end: end as u32, child: None }
    }

    fn split(&mut self, at: usize) {
        let (first, end) = (self.nodes[at].first as usize, self.nodes[at].end as usize);
        if end - first <= LEAF {
            return;
        }
        let boxes = &self.boxes;
        let run = &mut self.order[first..end];
        let axis = Aabb::around(run.iter().map(|&i| boxes[i as usize].center())).size().max_position();
        let key = |i: u32| boxes[i as usize].center()[axis];
        let half = run.len() / 2;
        run.select_nth_unstable_by(half, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
        self.nodes[at].child = Some(self.nodes.len() as u32);
        let children = [self.node(first, first + half), self.node(first + half, end)];
        self.nodes.extend(children);
    }

    /// Visits the boxes whose signed distance may be as low as `limit` somewhere in the cell, the lowest first as far as
    /// the tree tells; `visit` may lower the limit, and ends the search with `false`.
    pub fn visit(&self, cell: &Aabb, mut limit: f64, mut visit: impl FnMut(usize, &mut f64) -> bool) {
        if self.nodes.is_empty() {
            return;
        }
        let mut stack = vec![(lowest(&self.nodes[0].extent, cell), 0u32)];
        while let Some((low, at)) = stack.pop() {
            if low > limit {
                continue;
            }
            let node = &self.nodes[at as usize];
            if let Some(child) = node.child {
                let [a, b] = [child, child + 1].map(|child| (lowest(&self.nodes[child as usize].extent, cell), child));
                stack.extend(if a.0 <= b.0 { [b, a] } else { [a, b] });
                continue;
            }
            for &i in &self.order[node.first as usize..node.end as usize] {
                if lowest(&self.boxes[i as usize], cell) <= limit && !visit(i as usize, &mut limit) {
                    return;
                }
            }
        }
    }
}

/// The least signed distance to a box over a cell.
fn lowest(extent: &Aabb, cell: &Aabb) -> f64 {
    let beyond = (extent.min - cell.max).max(cell.min - extent.max);
    let outside = beyond.max(DVec3::ZERO);
    if outside != DVec3::ZERO {
        return outside.length() * (1.0 - 1e-14);
    }
    // As deep as the point of the cell nearest to the middle.
    let half = 0.5 * extent.size();
    let (low, high) = (cell.min - extent.center(), cell.max - extent.center());
    (low.max(-high).max(DVec3::ZERO) - half).max_element() * (1.0 + 1e-14)
}
