//! Building the tree: surface area heuristic over bins, then eight children a node.

use super::frame::Frame;
use super::tree::{ABSENT, LEAF, Node, Packet, Slot, Tree, WIDTH};
use crate::error::Result;
use crate::geom::{Aabb, DVec3, Facet};
use crate::mesh::TriangleMesh;
use crate::run::Run;

const BINS: usize = 16;

/// From this depth on nodes are halved by count, so that a query's stack stays short on any mesh.
const DEEP: usize = 20;

struct Builder<'a> {
    boxes: &'a [Aabb],
    facets: &'a [Facet],
    center: DVec3,
    nodes: Vec<Node>,
    packets: Vec<Packet>,
    /// In the order of the packets.
    triangles: Vec<u32>,
}

/// A run of the order array and its box.
struct Part<'a> {
    order: &'a mut [u32],
    bounds: Aabb,
}

impl Tree {
    /// Builds the tree. O(n log n) time; the result does not depend on the number of threads.
    pub fn build(mesh: &TriangleMesh, run: &Run<'_>) -> Result<Self> {
        const CHUNK: usize = 16384;
        let count = mesh.triangles().len();
        let prepared = run.blocks("prepare triangles", count.div_ceil(CHUNK), |block| {
            let range = block * CHUNK..((block + 1) * CHUNK).min(count);
            Ok(range
                .map(|t| {
                    let corners = mesh.corners(t as u32);
                    let [a, b, c] = corners;
                    (Aabb::around(corners), Facet::new(a, b, c), Frame::new(corners))
                })
                .collect::<Vec<_>>())
        })?;
        let (mut boxes, mut facets, mut frames) = (Vec::with_capacity(count), Vec::with_capacity(count), Vec::with_capacity(count));
        for (bounds, facet, frame) in prepared.into_iter().flatten() {
            boxes.push(bounds);
            facets.push(facet);
            frames.push(frame);
        }
        run.cancel.check()?;
        let extent = mesh.extent();
        let center = extent.center();
        let mut builder = Builder { boxes: &boxes, facets: &facets, center, nodes: Vec::new(), packets: Vec::new(), triangles: Vec::new() };
        let mut order: Vec<u32> = (0..count as u32).collect();
        builder.node(Part { order: &mut order, bounds: extent }, 0, run)?;
        let Builder { nodes, packets, triangles, .. } = builder;
        let mut slots = vec![Slot(0); count];
        for (slot, &triangle) in triangles.iter().enumerate() {
            slots[triangle as usize] = Slot(slot as u32);
        }
        let facets = triangles.iter().map(|&t| facets[t as usize]).collect();
        let frames = triangles.iter().map(|&t| frames[t as usize]).collect();
        Ok(Self { nodes, packets, facets, frames, triangles, slots, extent, center, radius: extent.radius() })
    }
}

impl Builder<'_> {
    /// Adds a node over `part` and returns its index.
    fn node(&mut self, part: Part<'_>, depth: usize, run: &Run<'_>) -> Result<u32> {
        if part.order.len() > 4096 {
            run.cancel.check()?;
        }
        let index = self.nodes.len();
        self.nodes.push(Node { min: [[f32::INFINITY; WIDTH]; 3], max: [[f32::NEG_INFINITY; WIDTH]; 3], child: [ABSENT; WIDTH] });
        let mut parts = vec![part];
        while parts.len() < WIDTH {
            let Some(widest) = (0..parts.len())
                .filter(|&i| parts[i].order.len() > WIDTH)
                .max_by(|&i, &j| area(&parts[i].bounds).total_cmp(&area(&parts[j].bounds)).then(j.cmp(&i)))
            else {
                break;
            };
            let (left, right) = self.split(parts.swap_remove(widest), depth);
            parts.push(left);
            parts.push(right);
        }
        for (slot, part) in parts.into_iter().enumerate() {
            for axis in 0..3 {
                self.nodes[index].min[axis][slot] = below(part.bounds.min[axis] - self.center[axis]);
                self.nodes[index].max[axis][slot] = -below(self.center[axis] - part.bounds.max[axis]);
            }
            let child = if part.order.len() <= WIDTH { LEAF | self.packet(part.order) } else { self.node(part, depth + 1, run)? };
            self.nodes[index].child[slot] = child;
        }
        Ok(index as u32)
    }

    fn packet(&mut self, order: &mut [u32]) -> u32 {
        order.sort_unstable();
        let zero = [[0.0; WIDTH]; 3];
        let mut packet = Packet {
            a: zero,
            ab: zero,
            ac: zero,
            v: zero,
            inverse: zero,
            slope: [0.0; WIDTH],
            triangle: [0; WIDTH],
            first: self.triangles.len() as u32,
            count: order.len() as u32,
        };
        for lane in 0..WIDTH {
            let triangle = order[lane.min(order.len() - 1)];
            let facet = &self.facets[triangle as usize];
            for axis in 0..3 {
                packet.a[axis][lane] = facet.a[axis];
                packet.ab[axis][lane] = facet.ab[axis];
                packet.ac[axis][lane] = facet.ac[axis];
                packet.v[axis][lane] = facet.v[axis];
                packet.inverse[axis][lane] = facet.inverse[axis];
            }
            packet.slope[lane] = facet.slope;
            packet.triangle[lane] = triangle;
        }
        self.triangles.extend_from_slice(order);
        self.packets.push(packet);
        (self.packets.len() - 1) as u32
    }

    /// The cheapest split over the bins of all three axes; the middle where no bin separates.
    fn split<'o>(&self, part: Part<'o>, depth: usize) -> (Part<'o>, Part<'o>) {
        let middle = |t: u32| self.boxes[t as usize].center();
        let centers = Aabb::around(part.order.iter().map(|&t| middle(t)));
        let size = centers.size();
        let mut best: Option<(f64, usize, usize)> = None;
        for axis in if depth < DEEP { 0..3 } else { 0..0 } {
            let scale = BINS as f64 / size[axis];
            if !(size[axis] > 0.0 && scale.is_finite()) {
                continue;
            }
            let mut bins = [(Aabb::EMPTY, 0usize); BINS];
            for &t in part.order.iter() {
                let bin = &mut bins[bin_of(middle(t)[axis], centers.min[axis], scale)];
                bin.0 = bin.0.union(self.boxes[t as usize]);
                bin.1 += 1;
            }
            let mut after = [(Aabb::EMPTY, 0usize); BINS + 1];
            for i in (0..BINS).rev() {
                after[i] = (after[i + 1].0.union(bins[i].0), after[i + 1].1 + bins[i].1);
            }
            let mut before = (Aabb::EMPTY, 0usize);
            for cut in 1..BINS {
                before = (before.0.union(bins[cut - 1].0), before.1 + bins[cut - 1].1);
                if before.1 == 0 || after[cut].1 == 0 {
                    continue;
                }
                // Whole leaves are what costs.
                let leaves = |n: usize| n.div_ceil(WIDTH) as f64;
                let cost = area(&before.0) * leaves(before.1) + area(&after[cut].0) * leaves(after[cut].1);
                if best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, axis, cut));
                }
            }
        }
        let order = part.order;
        let at = match best {
            Some((_, axis, cut)) => {
                let scale = BINS as f64 / size[axis];
                let left = |t: &u32| bin_of(middle(*t)[axis], centers.min[axis], scale) < cut;
                order.sort_by_key(|t| !left(t));
                order.partition_point(left)
            }
            None => order.len() / 2,
        };
        let (left, right) = order.split_at_mut(at);
        let around = |o: &[u32]| o.iter().fold(Aabb::EMPTY, |b, &t| b.union(self.boxes[t as usize]));
        let (first, second) = (around(left), around(right));
        (Part { order: left, bounds: first }, Part { order: right, bounds: second })
    }
}

fn bin_of(x: f64, start: f64, scale: f64) -> usize {
    (((x - start) * scale) as usize).min(BINS - 1)
}

fn area(b: &Aabb) -> f64 {
    let s = b.size();
    if s.x < 0.0 { 0.0 } else { s.x * s.y + s.y * s.z + s.z * s.x }
}

/// The largest single that is not above `x`.
fn below(x: f64) -> f32 {
    let single = x as f32;
    if f64::from(single) > x { single.next_down() } else { single }
}
