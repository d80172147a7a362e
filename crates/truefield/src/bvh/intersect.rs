//! Where a surface meets itself, and how much room its triangles have.
//!
//! Every pair of triangles that come near each other is either separated by a plane, with room
//! that is proven in spite of rounding, or reported: no intersection is ever missed, and a pair closer than
//! rounding can tell is reported too. Separating planes after Gottschalk, Lin and Manocha 1996.

use std::sync::atomic::{AtomicU32, Ordering};

use super::tree::{ABSENT, LEAF, Tree, WIDTH};
use crate::error::Result;
use crate::geom::{Aabb, DVec3};
use crate::mesh::TriangleMesh;
use crate::mesh::topology::Topology;
use crate::run::Run;

/// Leaves a worker takes at once.
const BLOCK: usize = 64;

/// Pairs that meet that are looked for in every block; there is seldom a use for more.
const ENOUGH: usize = 2048;

/// Pairs that are compared for every block: more is not a surface but a heap.
const COMPARED: usize = 1024 * WIDTH * BLOCK;

/// Half an ulp of 1.
const UNIT: f64 = f64::EPSILON / 2.0;

/// Triangles that share a corner or an edge and open less than this (as a sine) count as meeting.
const LEAST_SLOPE: f64 = 1e-6;

/// Proven room around a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clearance {
    /// Triangles that share no corner with it are farther away than this.
    pub gap: f64,
    /// A triangle that shares only a corner, or only an edge, is at least `slope` times as far from a
    /// point of this triangle as that corner, or the line of that edge, is.
    pub slope: f64,
}

/// Pairs of triangles that meet beyond the corner or edge they share, and the room of all others.
#[derive(Debug)]
pub(crate) struct Meetings {
    /// In the order of the first triangle, then of the second.
    pub pairs: Vec<[u32; 2]>,
    /// False where the search was cut short: there are more pairs.
    pub complete: bool,
    clearance: Vec<[AtomicU32; 2]>,
}

impl Meetings {
    /// Proven room around a triangle that meets no other; none around those that were left out.
    pub fn clearance(&self, triangle: u32) -> Clearance {
        let [gap, slope] = &self.clearance[triangle as usize];
        let load = |x: &AtomicU32| f64::from(f32::from_bits(x.load(Ordering::Relaxed)));
        Clearance { gap: load(gap), slope: load(slope) }
    }

    /// Which of the triangles given as true meet no other but in a corner or an edge; none where not all were compared.
    pub fn sound(&self, mut sound: Vec<bool>) -> Vec<bool> {
        for t in self.pairs.iter().flatten() {
            sound[*t as usize] = false;
        }
        if !self.complete {
            sound.fill(false);
        }
        sound
    }

    /// Gaps and slopes are kept in single precision, rounded down; as they are positive, their bits
    /// sort like their values, and the least does not depend on who comes first.
    fn keep(&self, triangle: u32, which: usize, value: f64) {
        let single = (value as f32).next_down().max(0.0);
        self.clearance[triangle as usize][which].fetch_min(single.to_bits(), Ordering::Relaxed);
    }

    /// Tests every pair of `solid` triangles that come within `reach` of each other, of a mesh that was `moved`
    /// so far from the one the tree is of.
    pub fn find(
        mesh: &TriangleMesh,
        topology: &Topology,
        tree: &Tree,
        solid: &[bool],
        [reach, moved]: [f64; 2],
        run: &Run<'_>,
    ) -> Result<Self> {
        let open = |value: f64| AtomicU32::new((value as f32).next_down().max(0.0).to_bits());
        let mut meetings = Self {
            pairs: Vec::new(),
            complete: true,
            clearance: solid.iter().map(|&s| if s { [open(reach), open(1.0)] } else { [open(0.0), open(0.0)] }).collect(),
        };
        let leaves = Leaves { mesh, tree, margin: 0.5005 * reach + moved };
        let count = tree.packets.len();
        let blocks = run.blocks("self-intersections", count.div_ceil(BLOCK), |block| {
            let (mut found, mut near, mut stack) = (Vec::new(), Vec::new(), Vec::new());
            let mut compared = 0;
            for first in block * BLOCK..((block + 1) * BLOCK).min(count) {
                run.cancel.check()?;
                if found.len() >= ENOUGH || compared >= COMPARED {
                    return Ok((found, false));
                }
                near.clear();
                leaves.pairs(first as u32, &mut stack, &mut near);
                compared += near.len();
                for &pair in near.iter().filter(|pair| pair.iter().all(|&t| solid[t as usize])) {
                    if !meetings.part(mesh, topology, pair, reach) {
                        found.push(pair);
                    }
                }
            }
            Ok((found, true))
        })?;
        for (found, complete) in blocks {
            meetings.pairs.extend(found);
            meetings.complete &= complete;
        }
        meetings.pairs.sort_unstable();
        Ok(meetings)
    }

    /// Whether a pair is proven to be apart but for what it shares; notes its room.
    fn part(&self, mesh: &TriangleMesh, topology: &Topology, pair: [u32; 2], reach: f64) -> bool {
        let [mine, other] = pair.map(|t| topology.triangles[t as usize]);
        let [corners, others] = pair.map(|t| mesh.corners(t));
        let mut shared = [(0, 0); 3];
        let mut count = 0;
        for i in 0..3 {
            if let Some(j) = other.iter().position(|&v| v == mine[i]) {
                shared[count] = (i, j);
                count += 1;
            }
        }
        match shared[..count] {
            [] => {
                let gap = gap(&corners, &others, reach);
                for t in pair {
                    self.keep(t, 0, gap);
                }
                gap > 0.0
            }
            [(i, j)] => {
                let arms = |t: &[DVec3; 3], at: usize| [t[(at + 1) % 3] - t[at], t[(at + 2) % 3] - t[at]];
                let slopes = slopes_at_corner(arms(&corners, i), arms(&others, j));
                for (t, slope) in pair.into_iter().zip(slopes) {
                    self.keep(t, 1, slope);
                }
                slopes[0].min(slopes[1]) > LEAST_SLOPE
            }
            [(i, j), (k, l)] => {
                let slope = slope_at_edge([corners[i], corners[k]], corners[3 - i - k], others[3 - j - l]);
                for t in pair {
                    self.keep(t, 1, slope);
                }
                slope > LEAST_SLOPE
            }
            // Duplicates.
            _ => false,
        }
    }
}

/// Finds triangles whose boxes come near each other, leaf against leaf.
struct Leaves<'a> {
    mesh: &'a TriangleMesh,
    tree: &'a Tree,
    /// Boxes are grown by this on all sides.
    margin: f64,
}

/// Boxes of the triangles of a leaf in lanes, as in a [`Node`].
struct Boxes {
    min: [[f32; WIDTH]; 3],
    max: [[f32; WIDTH]; 3],
}

impl Leaves<'_> {
    fn boxes(&self, leaf: u32) -> Boxes {
        let packet = &self.tree.packets[leaf as usize];
        let mut boxes = Boxes { min: [[f32::INFINITY; WIDTH]; 3], max: [[f32::NEG_INFINITY; WIDTH]; 3] };
        for lane in 0..packet.count as usize {
            let around = Aabb::around(self.mesh.corners(packet.triangle[lane])).grow(self.margin);
            for axis in 0..3 {
                boxes.min[axis][lane] = ((around.min[axis] - self.tree.center[axis]) as f32).next_down();
                boxes.max[axis][lane] = ((around.max[axis] - self.tree.center[axis]) as f32).next_up();
            }
        }
        boxes
    }

    /// Adds all pairs of a triangle of `leaf` and one of it or of a later leaf, the lower index first.
    fn pairs(&self, leaf: u32, stack: &mut Vec<u32>, pairs: &mut Vec<[u32; 2]>) {
        let own = self.boxes(leaf);
        let triangles = &self.tree.packets[leaf as usize].triangle;
        let count = self.tree.packets[leaf as usize].count as usize;
        // The tree's own boxes are not grown.
        let margin = (1.0001 * self.margin) as f32 + f32::MIN_POSITIVE;
        let min: [f32; 3] = std::array::from_fn(|axis| (own.min[axis].iter().copied().fold(f32::INFINITY, f32::min) - margin).next_down());
        let max: [f32; 3] =
            std::array::from_fn(|axis| (own.max[axis].iter().copied().fold(f32::NEG_INFINITY, f32::max) + margin).next_up());
        stack.clear();
        stack.push(0);
        while let Some(child) = stack.pop() {
            if child & LEAF == 0 {
                let node = &self.tree.nodes[child as usize];
                let hit = overlapping(&node.min, &node.max, &min, &max);
                stack.extend((0..WIDTH).filter(|&lane| hit[lane] && node.child[lane] != ABSENT).map(|lane| node.child[lane]));
                continue;
            }
            let other = child & !LEAF;
            if other < leaf {
                continue;
            }
            let boxes = self.boxes(other);
            let others = &self.tree.packets[other as usize].triangle;
            for lane in 0..count {
                let corner = |bounds: &[[f32; WIDTH]; 3]| std::array::from_fn(|axis| bounds[axis][lane]);
                let hit = overlapping(&boxes.min, &boxes.max, &corner(&own.min), &corner(&own.max));
                for at in (0..WIDTH).filter(|&at| hit[at] && (other > leaf || at > lane)) {
                    let (a, b) = (triangles[lane], others[at]);
                    pairs.push([a.min(b), a.max(b)]);
                }
            }
        }
    }
}

/// Which of the boxes in lanes share a point with one box.
#[inline(always)]
fn overlapping(mins: &[[f32; WIDTH]; 3], maxs: &[[f32; WIDTH]; 3], min: &[f32; 3], max: &[f32; 3]) -> [bool; WIDTH] {
    let mut hit = [true; WIDTH];
    for axis in 0..3 {
        for (lane, hit) in hit.iter_mut().enumerate() {
            *hit &= (mins[axis][lane] <= max[axis]) & (maxs[axis][lane] >= min[axis]);
        }
    }
    hit
}

/// A length that the distance of two triangles is proven to exceed, at most `enough`; 0 if there is none.
fn gap(first: &[DVec3; 3], second: &[DVec3; 3], enough: f64) -> f64 {
    let base = first[0];
    let a = first.map(|v| v - base);
    let b = second.map(|v| v - base);
    let noise = a.iter().chain(&b).map(|v| v.length_squared()).fold(0.0, f64::max).sqrt() * (8.0 * UNIT);
    let edges = |t: &[DVec3; 3]| [t[1] - t[0], t[2] - t[1], t[0] - t[2]];
    let (ea, eb) = (edges(&a), edges(&b));
    let (na, nb) = (ea[0].cross(ea[1]), eb[0].cross(eb[1]));
    let mut best: f64 = 0.0;
    // Any direction separates if the projections say so: how well it was computed does not matter.
    let mut try_axis = |axis: DVec3| {
        let length = axis.length();
        if length > 0.0 && length.is_finite() {
            let axis = axis / length;
            let span = |t: &[DVec3; 3]| {
                let [x, y, z] = t.map(|v| v.dot(axis));
                (x.min(y).min(z), x.max(y).max(z))
            };
            let ((low, high), (least, most)) = (span(&a), span(&b));
            best = best.max((least - high).max(low - most) * (1.0 - 1e-12) - noise);
        }
        best >= enough
    };
    let mut axes = ea.iter().map(|e| na.cross(*e)).chain(eb.iter().map(|e| nb.cross(*e))).chain([na, nb]);
    if axes.any(&mut try_axis) {
        return enough;
    }
    for e in ea {
        for f in eb {
            if try_axis(e.cross(f)) {
                return enough;
            }
        }
    }
    best
}

/// For two triangles that share one corner, given by their arms from there: the largest proven slopes
/// of the first above the second and of the second above the first; 0 where a ray may belong to both.
///
/// A plane through the corner that has both arms of one strictly on one side, and both of the other strictly on
/// the other, separates them everywhere else. If there is one, one can be had from a plane that
/// touches: the plane of a triangle, a plane through one arm of each, or a plane upright on an arm; tilted
/// a little so that it no longer touches.
fn slopes_at_corner(first: [DVec3; 2], second: [DVec3; 2]) -> [f64; 2] {
    /// Good enough to stop looking.
    const STEEP: f64 = 0.02;
    const TOUCHING: f64 = 1e-7;
    let a = first.map(DVec3::normalize_or_zero);
    let b = second.map(DVec3::normalize_or_zero);
    let (na, nb) = (a[0].cross(a[1]), b[0].cross(b[1]));
    let mut best = [0.0f64; 2];
    let mut try_plane = |normal: DVec3| {
        let normal = normal.normalize_or_zero();
        let rise = [a[0].dot(normal), a[1].dot(normal), -b[0].dot(normal), -b[1].dot(normal)];
        let outward = [a[0], a[1], -b[0], -b[1]];
        let least = rise.iter().copied().filter(|x| x.abs() >= TOUCHING).fold(f64::INFINITY, f64::min);
        if !(least > 0.0 && least < f64::INFINITY) {
            return false;
        }
        let tilt: DVec3 = (0..4).filter(|&i| rise[i].abs() < TOUCHING).map(|i| outward[i]).sum();
        let tilted = normal + tilt * (0.25 * least);
        let length = tilted.length();
        let rise = outward.map(|v| v.dot(tilted) / length - 16.0 * UNIT);
        let slopes = [rise[0].min(rise[1]), rise[2].min(rise[3])];
        if slopes[0].min(slopes[1]) > 0.0 {
            best = [best[0].max(slopes[0]), best[1].max(slopes[1])];
        }
        best[0].min(best[1]) > STEEP
    };
    // Between the two wedges: the one that most often holds, with room.
    if try_plane(a[0] + a[1] - b[0] - b[1]) {
        return best;
    }
    let upright = [na.cross(a[0]), a[1].cross(na), b[0].cross(nb), nb.cross(b[1])];
    let planes = upright.into_iter().chain([na, -na, nb, -nb]);
    let across = a.into_iter().flat_map(|x| b.into_iter().flat_map(move |y| [x.cross(y), y.cross(x)]));
    for plane in planes.chain(across) {
        if try_plane(plane) {
            break;
        }
    }
    best
}

/// For two triangles that share an edge: the sine of the angle between them, proven from below; 1 beyond
/// a right angle, 0 where they may lie on each other.
fn slope_at_edge(edge: [DVec3; 2], first: DVec3, second: DVec3) -> f64 {
    let along = (edge[1] - edge[0]).normalize_or_zero();
    let arms = [first, second].map(|v| {
        let w = v - edge[0];
        let across = w - along * w.dot(along);
        (across.normalize_or_zero(), 16.0 * UNIT * w.length() / across.length())
    });
    let noise = arms[0].1 + arms[1].1;
    if noise.is_nan() || noise > 1e-3 {
        return 0.0;
    }
    let (cosine, sine) = (arms[0].0.dot(arms[1].0), arms[0].0.cross(arms[1].0).length());
    if cosine < -2.0 * noise { 1.0 } else { (sine - 2.0 * noise).clamp(0.0, 1.0) }
}
