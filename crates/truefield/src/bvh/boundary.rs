//! How fast a winding number can change: bounded by the edges that bound the surface.
//!
//! The gradient of the solid angle is a Biot-Savart integral over the boundary chain, so that of the
//! winding number at x is at most `1/(4 pi) * sum of times * integral over the edge of dl / |x - y|^2`.
//! Where the boundary is empty the winding number is constant on everything that stays off the surface.

use std::f64::consts::PI;

use crate::geom::{Aabb, DVec3};
use crate::mesh::TriangleMesh;

/// Edges of a leaf.
const LEAF: usize = 4;

/// The edges of a mesh whose traversals do not cancel, in a tree of boxes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Boundary {
    nodes: Vec<Node>,
}

/// A group of edges; the first child follows at once, `skip` is the node after the whole group.
#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Aabb,
    /// Length of the edges, each as many times as it counts.
    length: f64,
    skip: u32,
}

impl Boundary {
    /// From directed edges and how many times each counts.
    pub fn new(mesh: &TriangleMesh, edges: &[([u32; 2], u32)]) -> Self {
        let mut items: Vec<(Aabb, f64)> = edges
            .iter()
            .map(|&(ends, times)| {
                let [a, b] = ends.map(|v| mesh.vertices()[v as usize]);
                (Aabb::around([a, b]), (b - a).length() * f64::from(times) * (1.0 + 1e-12))
            })
            .collect();
        let mut boundary = Self::default();
        if !items.is_empty() {
            boundary.add(&mut items);
        }
        boundary
    }

    /// Whether every edge is traversed as often one way as the other.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Total length in model units.
    #[cfg(test)]
    pub fn length(&self) -> f64 {
        self.nodes.first().map_or(0.0, |root| root.length)
    }

    fn add(&mut self, items: &mut [(Aabb, f64)]) {
        let index = self.nodes.len();
        let bounds = items.iter().fold(Aabb::EMPTY, |b, item| b.union(item.0));
        self.nodes.push(Node { bounds, length: items.iter().map(|item| item.1).sum::<f64>() * (1.0 + 1e-9), skip: 0 });
        if items.len() > LEAF {
            let size = bounds.size();
            let axis = if size.x >= size.y.max(size.z) {
                0
            } else if size.y >= size.z {
                1
            } else {
                2
            };
            let half = items.len() / 2;
            items.select_nth_unstable_by(half, |a, b| a.0.center()[axis].total_cmp(&b.0.center()[axis]));
            let (left, right) = items.split_at_mut(half);
            self.add(left);
            self.add(right);
        } else if items.len() > 1 {
            for item in items {
                let skip = self.nodes.len() as u32 + 1;
                self.nodes.push(Node { bounds: item.0, length: item.1, skip });
            }
        }
        self.nodes[index].skip = self.nodes.len() as u32;
    }

    /// A bound on the gradient of the winding number over the ball around `p` (per model unit);
    /// infinite where the ball reaches the box of a boundary edge.
    pub fn steepest(&self, p: DVec3, radius: f64) -> f64 {
        let mut sum = 0.0;
        let mut index = 0;
        while let Some(node) = self.nodes.get(index) {
            let leaf = node.skip as usize == index + 1;
            let gap = node.bounds.distance_squared(p).sqrt() * (1.0 - 1e-12) - radius;
            // Far for its size: at most a quarter is given away.
            if leaf || gap > 4.0 * node.bounds.diagonal() {
                if gap <= 0.0 {
                    return f64::INFINITY;
                }
                sum += node.length / (gap * gap);
                index = node.skip as usize;
            } else {
                index += 1;
            }
        }
        sum * (1.0 + 1e-9) / (4.0 * PI)
    }
}
