//! How fast a winding number can change: bounded by the edges that bound the surface.
//!
//! The gradient of the solid angle is a Biot-Savart integral over the boundary chain, so that of the
//! winding number at x is at most `1/(4 pi) * sum of times * integral over the edge of dl / |x - y|^2`.
//! Where the boundary is empty the winding number is constant on everything that stays off the surface.
//!
//! Far from a group of edges what counts is their sum as vectors, which is zero for a closed loop: with
//! K(r) = r / |r|^3, whose derivative is at most 2 / |r|^3, replacing K(y - x) by K(c - x) for the middle c of the group
//! leaves at most `2 |y - c| / gap^3` for every unit of length.

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
    /// Diagonal of the box.
    size: f64,
    /// Length of the edges, each as many times as it counts.
    length: f64,
    /// Length of their sum as vectors.
    sum: f64,
    skip: u32,
}

impl Boundary {
    /// From directed edges and how many times each counts.
    pub fn new(mesh: &TriangleMesh, edges: &[([u32; 2], u32)]) -> Self {
        let mut items: Vec<(Aabb, DVec3)> = edges
            .iter()
            .map(|&(ends, times)| {
                let [a, b] = ends.map(|v| mesh.vertices()[v as usize]);
                (Aabb::around([a, b]), (b - a) * f64::from(times))
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

    fn add(&mut self, items: &mut [(Aabb, DVec3)]) {
        let index = self.nodes.len();
        let bounds = items.iter().fold(Aabb::EMPTY, |b, item| b.union(item.0));
        let length = items.iter().map(|item| item.1.length()).sum::<f64>() * (1.0 + 1e-9);
        // Rounding of coordinates may keep a loop from closing.
        let sum = items.iter().map(|item| item.1).sum::<DVec3>().length() + length * 1e-9;
        self.nodes.push(Node { bounds, size: bounds.diagonal(), length, sum, skip: 0 });
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
                let (skip, length) = (self.nodes.len() as u32 + 1, item.1.length() * (1.0 + 1e-9));
                self.nodes.push(Node { bounds: item.0, size: item.0.diagonal(), length, sum: length, skip });
            }
        }
        self.nodes[index].skip = self.nodes.len() as u32;
    }

    /// A distance from `p` within which there is no edge; infinite where there is none at all.
    pub fn gap(&self, p: DVec3) -> f64 {
        let mut least = f64::INFINITY;
        let mut index = 0;
        while let Some(node) = self.nodes.get(index) {
            let squared = node.bounds.distance_squared(p);
            let leaf = node.skip as usize == index + 1;
            if leaf {
                least = least.min(squared);
            }
            index = if leaf || squared >= least { node.skip as usize } else { index + 1 };
        }
        least.sqrt() * (1.0 - 1e-12)
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
            let size = node.size;
            if leaf || gap > 4.0 * size {
                if gap <= 0.0 {
                    return f64::INFINITY;
                }
                sum += node.length.min(node.sum + node.length * size / gap) / (gap * gap);
                index = node.skip as usize;
            } else {
                index += 1;
            }
        }
        sum * (1.0 + 1e-9) / (4.0 * PI)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::winding::triangle;

    /// The winding number of a fan over a ring changes no faster than the bound, and the bound is of use.
    #[test]
    fn no_step_is_steeper_than_the_bound() {
        let mut state = 7u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let ring: Vec<DVec3> = (0..50)
            .map(|i| {
                let f = f64::from(i) / 50.0 * 2.0 * PI;
                DVec3::new(f.cos(), f.sin(), 0.3 * (3.0 * f).sin())
            })
            .collect();
        let mut vertices = ring;
        vertices.push(DVec3::new(0.1, 0.2, 0.4));
        let triangles: Vec<[u32; 3]> = (0..50).map(|i| [i, (i + 1) % 50, 50]).collect();
        let mesh = TriangleMesh::new(vertices, triangles).expect("a mesh");
        let edges: Vec<([u32; 2], u32)> = (0..50).map(|i| ([i, (i + 1) % 50], 1)).collect();
        let boundary = Boundary::new(&mesh, &edges);
        let length: f64 = edges.iter().map(|(e, _)| (mesh.vertices()[e[1] as usize] - mesh.vertices()[e[0] as usize]).length()).sum();
        assert!((boundary.nodes[0].length / length - 1.0).abs() < 1e-6);
        let winding = |p: DVec3| (0..50).map(|t| triangle(&mesh.corners(t), p).value).sum::<f64>();
        let (mut tried, mut sharpest) = (0, 0.0f64);
        for _ in 0..200_000 {
            let p = DVec3::new(random() - 0.5, random() - 0.5, random() - 0.5) * 6.0;
            let radius = random() * random();
            let steepest = boundary.steepest(p, radius);
            let to = p + DVec3::new(random() - 0.5, random() - 0.5, random() - 0.5).normalize_or_zero() * radius;
            let step = (winding(to) - winding(p)).abs();
            // The fan itself may be crossed: a jump of a whole turn.
            if step < 0.5 && steepest.is_finite() {
                tried += 1;
                assert!(step <= steepest * radius, "{p} to {to}: {step} > {}", steepest * radius);
                sharpest = sharpest.max(step / (steepest * radius));
            }
        }
        assert!(tried > 100_000 && sharpest > 0.3, "{tried} {sharpest}");
        assert!(Boundary::new(&mesh, &[]).is_empty() && Boundary::new(&mesh, &[]).steepest(DVec3::ZERO, 1.0) == 0.0);
    }
}
