//! Where a surface meets itself, and how much room its triangles have.
//!
//! Every pair of triangles that come near each other is either separated by a plane, with room
//! that is proven in spite of rounding, or reported: no intersection is ever missed, and a pair closer than
//! rounding can tell is reported too. Separating planes after Gottschalk, Lin and Manocha 1996.

use std::sync::atomic::{AtomicU32, Ordering};

use super::tree::{ABSENT, LEAF, Packet, Tree, WIDTH};
use crate::error::Result;
use crate::geom::{Aabb, DVec3};
use crate::mesh::TriangleMesh;
use crate::mesh::topology::Topology;
use crate::run::Run;
use crate::simd::{Fuse, multiversion};

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
        let bits = (value as f32).next_down().max(0.0).to_bits();
        let least = &self.clearance[triangle as usize][which];
        // Looking is much cheaper than writing, and most of the time enough.
        if bits < least.load(Ordering::Relaxed) {
            least.fetch_min(bits, Ordering::Relaxed);
        }
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
        let leaves = Leaves::new(mesh, topology, tree, solid, 0.5005 * reach + moved, run)?;
        let count = tree.packets.len();
        let blocks = run.blocks("self-intersections", count.div_ceil(BLOCK), |block| {
            let (mut found, mut near, mut stack) = (Vec::new(), Near::default(), Vec::new());
            let mut compared = 0;
            for first in block * BLOCK..((block + 1) * BLOCK).min(count) {
                run.cancel.check()?;
                if found.len() >= ENOUGH || compared >= COMPARED {
                    return Ok((found, false));
                }
                near.clear();
                leaves.pairs(first as u32, &mut stack, &mut near);
                compared += near.len();
                meetings.part(&leaves, &near, reach, &mut found);
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

    /// Adds the pairs that are not proven to be apart but for what they share; notes the room of all.
    fn part(&self, leaves: &Leaves<'_>, near: &Near, reach: f64, found: &mut Vec<[u32; 2]>) {
        found.extend(near.copies.iter().map(|places| places.map(|at| leaves.triangle(at))));
        for group in near.apart.chunks(LANES) {
            let pair = |lane: usize| group[lane.min(group.len() - 1)].map(|at| leaves.corners(at));
            let (mut lanes, mut gaps) = ([[[[0.0; LANES]; 3]; 3]; 2], [0.0; LANES]);
            for lane in 0..LANES {
                for (side, corners) in pair(lane).into_iter().enumerate() {
                    for (corner, v) in corners.iter().enumerate() {
                        set(&mut lanes[side][corner], lane, *v);
                    }
                }
            }
            gap(&lanes, reach, &mut gaps);
            for (places, gap) in group.iter().zip(gaps) {
                let pair = places.map(|at| leaves.triangle(at));
                pair.into_iter().for_each(|t| self.keep(t, 0, gap));
                if gap <= 0.0 {
                    found.push(pair);
                }
            }
        }
        for group in near.at_corner.chunks(LANES) {
            // The arms of both from the corner that they share.
            let pair = |lane: usize| {
                let (places, shared) = group[lane.min(group.len() - 1)];
                let arms = |side: usize| {
                    let (t, at) = (leaves.corners(places[side]), usize::from(shared[side]));
                    [t[(at + 1) % 3] - t[at], t[(at + 2) % 3] - t[at]]
                };
                [arms(0), arms(1)]
            };
            let (mut lanes, mut slopes) = ([[[[0.0; LANES]; 3]; 2]; 2], [[0.0; LANES]; 2]);
            for lane in 0..LANES {
                for (side, arms) in pair(lane).into_iter().enumerate() {
                    for (arm, v) in arms.into_iter().enumerate() {
                        set(&mut lanes[side][arm], lane, v);
                    }
                }
            }
            slopes_between(&lanes, &mut slopes);
            for (lane, (places, _)) in group.iter().enumerate() {
                let mut slopes = [slopes[0][lane], slopes[1][lane]];
                if slopes[0].min(slopes[1]) <= STEEP {
                    let [first, second] = pair(lane);
                    slopes = slopes_at_corner(first, second);
                }
                let pair = places.map(|at| leaves.triangle(at));
                for (t, slope) in pair.into_iter().zip(slopes) {
                    self.keep(t, 1, slope);
                }
                if slopes[0].min(slopes[1]) <= LEAST_SLOPE {
                    found.push(pair);
                }
            }
        }
        for group in near.at_edge.chunks(LANES) {
            let (mut lanes, mut slopes) = ([[[0.0; LANES]; 3]; 4], [0.0; LANES]);
            for lane in 0..LANES {
                let (places, [i, j, k, l]) = group[lane.min(group.len() - 1)];
                let [first, second] = places.map(|at| leaves.corners(at));
                let ends = [first[usize::from(i)], first[usize::from(k)]];
                for (corner, v) in ends.into_iter().chain([first[usize::from(3 - i - k)], second[usize::from(3 - j - l)]]).enumerate() {
                    set(&mut lanes[corner], lane, v);
                }
            }
            slopes_at_edges(&lanes, &mut slopes);
            for ((places, _), slope) in group.iter().zip(slopes) {
                let pair = places.map(|at| leaves.triangle(at));
                pair.into_iter().for_each(|t| self.keep(t, 1, slope));
                if slope <= LEAST_SLOPE {
                    found.push(pair);
                }
            }
        }
    }
}

/// Pairs that are compared at once.
const LANES: usize = 8;

/// Vectors in lanes.
type Vectors = [[f64; LANES]; 3];

#[inline(always)]
fn set(vectors: &mut Vectors, lane: usize, v: DVec3) {
    for axis in 0..3 {
        vectors[axis][lane] = v[axis];
    }
}

#[inline(always)]
fn get(vectors: &Vectors, lane: usize) -> DVec3 {
    DVec3::new(vectors[0][lane], vectors[1][lane], vectors[2][lane])
}

/// Where a triangle is: its leaf times [`WIDTH`], and its lane.
type Place = u32;

/// Pairs of triangles that come near each other, the lower index first, by what they share.
#[derive(Default)]
struct Near {
    apart: Vec<[Place; 2]>,
    /// With the corner of the first and of the second.
    at_corner: Vec<([Place; 2], [u8; 2])>,
    /// With the corners of the first and the second, end by end.
    at_edge: Vec<([Place; 2], [u8; 4])>,
    /// Duplicates.
    copies: Vec<[Place; 2]>,
}

impl Near {
    fn clear(&mut self) {
        self.apart.clear();
        self.at_corner.clear();
        self.at_edge.clear();
        self.copies.clear();
    }

    fn len(&self) -> usize {
        self.apart.len() + self.at_corner.len() + self.at_edge.len() + self.copies.len()
    }

    fn add(&mut self, places: [Place; 2], [mine, other]: [&[u32; 3]; 2]) {
        let mut shared = [(0, 0); 3];
        let mut count = 0;
        for i in 0..3u8 {
            if let Some(j) = other.iter().position(|&v| v == mine[usize::from(i)]) {
                shared[count] = (i, j as u8);
                count += 1;
            }
        }
        match shared[..count] {
            [] => self.apart.push(places),
            [(i, j)] => self.at_corner.push((places, [i, j])),
            [(i, j), (k, l)] => self.at_edge.push((places, [i, j, k, l])),
            _ => self.copies.push(places),
        }
    }
}

/// Finds triangles whose boxes come near each other, leaf against leaf.
struct Leaves<'a> {
    tree: &'a Tree,
    /// In blocks.
    leaves: Vec<Vec<Leaf>>,
    /// Boxes are grown by this on all sides.
    margin: f64,
}

/// The triangles of a leaf in lanes; lanes of triangles that are not to be compared have no box.
struct Leaf {
    min: [[f32; WIDTH]; 3],
    max: [[f32; WIDTH]; 3],
    corners: [[DVec3; 3]; WIDTH],
    /// Welded.
    vertices: [[u32; 3]; WIDTH],
    triangle: [u32; WIDTH],
}

impl<'a> Leaves<'a> {
    fn new(mesh: &TriangleMesh, topology: &Topology, tree: &'a Tree, solid: &[bool], margin: f64, run: &Run<'_>) -> Result<Self> {
        let leaves = run.blocks("self-intersections", tree.packets.len().div_ceil(BLOCK), |block| {
            let packets = &tree.packets[block * BLOCK..((block + 1) * BLOCK).min(tree.packets.len())];
            let leaf = |packet: &Packet| {
                let mut leaf = Leaf {
                    min: [[f32::INFINITY; WIDTH]; 3],
                    max: [[f32::NEG_INFINITY; WIDTH]; 3],
                    corners: packet.triangle.map(|t| mesh.corners(t)),
                    vertices: packet.triangle.map(|t| topology.triangles[t as usize]),
                    triangle: packet.triangle,
                };
                for lane in (0..packet.count as usize).filter(|&lane| solid[packet.triangle[lane] as usize]) {
                    let around = Aabb::around(leaf.corners[lane]).grow(margin);
                    for axis in 0..3 {
                        leaf.min[axis][lane] = ((around.min[axis] - tree.center[axis]) as f32).next_down();
                        leaf.max[axis][lane] = ((around.max[axis] - tree.center[axis]) as f32).next_up();
                    }
                }
                leaf
            };
            Ok(packets.iter().map(leaf).collect())
        })?;
        Ok(Self { tree, leaves, margin })
    }

    fn leaf(&self, index: u32) -> &Leaf {
        &self.leaves[index as usize / BLOCK][index as usize % BLOCK]
    }

    fn corners(&self, at: Place) -> &[DVec3; 3] {
        &self.leaf(at / WIDTH as u32).corners[at as usize % WIDTH]
    }

    fn triangle(&self, at: Place) -> u32 {
        self.leaf(at / WIDTH as u32).triangle[at as usize % WIDTH]
    }

    /// Adds all pairs of a triangle of leaf `index` and one of it or of a later leaf.
    fn pairs(&self, index: u32, stack: &mut Vec<u32>, near: &mut Near) {
        let own = self.leaf(index);
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
            if other < index {
                continue;
            }
            let others = self.leaf(other);
            for lane in 0..WIDTH {
                let corner = |bounds: &[[f32; WIDTH]; 3]| std::array::from_fn(|axis| bounds[axis][lane]);
                let hit = overlapping(&others.min, &others.max, &corner(&own.min), &corner(&own.max));
                for at in (0..WIDTH).filter(|&at| hit[at] && (other > index || at > lane)) {
                    let places = [index * WIDTH as u32 + lane as u32, other * WIDTH as u32 + at as u32];
                    let vertices = [&own.vertices[lane], &others.vertices[at]];
                    if own.triangle[lane] < others.triangle[at] {
                        near.add(places, vertices);
                    } else {
                        near.add([places[1], places[0]], [vertices[1], vertices[0]]);
                    }
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

multiversion!(
    /// Lengths that the distances of pairs of triangles are proven to exceed, at most `enough`; 0 if there is none.
    fn gap(pairs: &[[Vectors; 3]; 2], enough: f64, gaps: &mut [f64; LANES]) = gap_body
);

#[inline(always)]
fn gap_body<F: Fuse>(pairs: &[[Vectors; 3]; 2], enough: f64, gaps: &mut [f64; LANES]) {
    let mut noise = [0.0f64; LANES];
    let mut corners = *pairs;
    for lane in 0..LANES {
        let base = get(&pairs[0][0], lane);
        let mut largest = 0.0f64;
        for triangle in &mut corners {
            for v in triangle {
                let at = get(v, lane) - base;
                set(v, lane, at);
                largest = largest.max(at.length_squared());
            }
        }
        noise[lane] = largest.sqrt() * (8.0 * UNIT);
    }
    let [a, b] = &corners;
    // Axes in the planes of the triangles across their edges, upright ones, then across two edges.
    for which in 0..17 {
        for lane in 0..LANES {
            let edge = |t: &[Vectors; 3], i: usize| get(&t[(i + 1) % 3], lane) - get(&t[i], lane);
            let upright = |t: &[Vectors; 3]| edge(t, 0).cross(edge(t, 1));
            let axis = match which {
                0..3 => upright(a).cross(edge(a, which)),
                3..6 => upright(b).cross(edge(b, which - 3)),
                6 => upright(a),
                7 => upright(b),
                _ => edge(a, (which - 8) / 3).cross(edge(b, (which - 8) % 3)),
            };
            // Any direction separates if the projections say so: how well it was computed does not matter.
            let length = axis.length();
            let axis = axis / length;
            let span = |t: &[Vectors; 3]| {
                let [x, y, z]: [f64; 3] = std::array::from_fn(|corner| get(&t[corner], lane).dot(axis));
                (x.min(y).min(z), x.max(y).max(z))
            };
            let ((low, high), (least, most)) = (span(a), span(b));
            let gap = (least - high).max(low - most) * (1.0 - 1e-12) - noise[lane];
            let holds = (length > 0.0) & (length < f64::INFINITY) & (gap > gaps[lane]);
            gaps[lane] = if holds { gap } else { gaps[lane] };
        }
        if gaps.iter().all(|&gap| gap >= enough) {
            break;
        }
    }
    for gap in gaps {
        *gap = gap.min(enough);
    }
}

/// A slope that is good enough to stop looking.
const STEEP: f64 = 0.02;

/// Planes are not known to touch or not below this.
const TOUCHING: f64 = 1e-7;

multiversion!(
    /// For pairs of triangles that share one corner, given by their arms from there: the slopes that a plane between their
    /// middles proves, as in [`slopes_at_corner`]; it most often holds, with room.
    fn slopes_between(pairs: &[[Vectors; 2]; 2], slopes: &mut [[f64; LANES]; 2]) = slopes_between_body
);

#[inline(always)]
fn slopes_between_body<F: Fuse>(pairs: &[[Vectors; 2]; 2], slopes: &mut [[f64; LANES]; 2]) {
    for lane in 0..LANES {
        let unit = |v: DVec3| {
            let inverse = 1.0 / v.length();
            v * if inverse < f64::INFINITY { inverse } else { 0.0 }
        };
        let arm = |side: usize, arm: usize| unit(get(&pairs[side][arm], lane));
        let outward = [arm(0, 0), arm(0, 1), -arm(1, 0), -arm(1, 1)];
        let normal = unit(outward[0] + outward[1] + outward[2] + outward[3]);
        let rise = outward.map(|v| v.dot(normal) - 16.0 * UNIT);
        let least = rise[0].min(rise[1]).min(rise[2]).min(rise[3]);
        let holds = least > TOUCHING;
        slopes[0][lane] = if holds { rise[0].min(rise[1]) } else { 0.0 };
        slopes[1][lane] = if holds { rise[2].min(rise[3]) } else { 0.0 };
    }
}

/// For two triangles that share one corner, given by their arms from there: the largest proven slopes
/// of the first above the second and of the second above the first; 0 where a ray may belong to both.
///
/// A plane through the corner that has both arms of one strictly on one side, and both of the other strictly on
/// the other, separates them everywhere else. If there is one, one can be had from a plane that
/// touches: the plane of a triangle, a plane through one arm of each, or a plane upright on an arm; tilted
/// a little so that it no longer touches.
fn slopes_at_corner(first: [DVec3; 2], second: [DVec3; 2]) -> [f64; 2] {
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

multiversion!(
    /// For pairs of triangles that share an edge, given by its ends, the other corner of the first and that of the second: the
    /// sine of the angle between them, proven from below; 1 beyond a right angle, 0 where they may lie on each other.
    fn slopes_at_edges(pairs: &[Vectors; 4], slopes: &mut [f64; LANES]) = slopes_at_edges_body
);

#[inline(always)]
fn slopes_at_edges_body<F: Fuse>(pairs: &[Vectors; 4], slopes: &mut [f64; LANES]) {
    for lane in 0..LANES {
        let from = get(&pairs[0], lane);
        let along = get(&pairs[1], lane) - from;
        let along = along / along.length();
        let arm = |corner: usize| {
            let w = get(&pairs[corner], lane) - from;
            let across = w - along * w.dot(along);
            let length = across.length();
            (across / length, 16.0 * UNIT * w.length() / length)
        };
        let ((first, off), (second, other)) = (arm(2), arm(3));
        let noise = off + other;
        let (cosine, sine) = (first.dot(second), first.cross(second).length());
        let slope = (sine - 2.0 * noise).clamp(0.0, 1.0);
        let slope = if cosine < -2.0 * noise { 1.0 } else { slope };
        // Not-a-number falls on the careful side.
        slopes[lane] = if noise <= 1e-3 { slope } else { 0.0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Facet;
    use crate::laws::Random;

    /// A point of a triangle, near its corners and edges too.
    fn inside(random: &mut Random, [a, b, c]: &[DVec3; 3]) -> DVec3 {
        let (s, t) = (random.unit() * random.length(1e-6, 1.0), random.unit() * random.length(1e-6, 1.0));
        let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
        *a + (*b - *a) * s + (*c - *a) * t
    }

    fn facet(&[a, b, c]: &[DVec3; 3]) -> Facet {
        Facet::new(a, b, c)
    }

    /// A triangle from a corner, a sliver now and then.
    fn from(random: &mut Random, corner: DVec3) -> [DVec3; 3] {
        let (u, v) = (random.direction(), random.direction());
        [corner, corner + u, corner + if random.below(3) == 0 { u * 0.5 + v * random.length(1e-12, 1e-2) } else { v }]
    }

    #[test]
    fn no_gap_and_no_slope_is_more_than_there_is() {
        let mut random = Random::new(4);
        let (mut apart, mut at_corner, mut at_edge) = (0, 0, 0);
        for _ in 0..20_000 {
            let base = random.direction() * 3.0;
            let pairs: [[[DVec3; 3]; 2]; LANES] = std::array::from_fn(|_| {
                let first = from(&mut random, base);
                let away = random.direction() * random.length(1e-9, 2.0);
                [first, from(&mut random, base + away)]
            });
            let mut lanes = [[[[0.0; LANES]; 3]; 3]; 2];
            for (lane, pair) in pairs.iter().enumerate() {
                for (side, corners) in pair.iter().enumerate() {
                    for (corner, v) in corners.iter().enumerate() {
                        set(&mut lanes[side][corner], lane, *v);
                    }
                }
            }
            let mut gaps = [0.0; LANES];
            gap(&lanes, 0.5, &mut gaps);
            for (pair, gap) in pairs.iter().zip(gaps) {
                apart += usize::from(gap > 0.0);
                let p = inside(&mut random, &pair[0]);
                assert!(facet(&pair[1]).distance_squared(p).sqrt() >= gap * (1.0 - 1e-9) - 1e-14, "{pair:?}: {gap}");
            }
            // The second moved to share the first corner of the first, then its first edge.
            let second = pairs.map(|[first, second]| second.map(|v| v + (first[0] - second[0])));
            let mut arms = [[[[0.0; LANES]; 3]; 2]; 2];
            let mut edges = [[[0.0; LANES]; 3]; 4];
            for lane in 0..LANES {
                let first = &pairs[lane][0];
                for (side, t) in [first, &second[lane]].into_iter().enumerate() {
                    set(&mut arms[side][0], lane, t[1] - t[0]);
                    set(&mut arms[side][1], lane, t[2] - t[0]);
                }
                for (corner, v) in first.iter().chain([&second[lane][2]]).enumerate() {
                    set(&mut edges[corner], lane, *v);
                }
            }
            let (mut slopes, mut bends) = ([[0.0; LANES]; 2], [0.0; LANES]);
            slopes_between(&arms, &mut slopes);
            slopes_at_edges(&edges, &mut bends);
            for lane in 0..LANES {
                let (first, second) = (&pairs[lane][0], &second[lane]);
                let arms = [first, second].map(|t| [t[1] - t[0], t[2] - t[0]]);
                let alone = slopes_at_corner(arms[0], arms[1]);
                for slopes in [[slopes[0][lane], slopes[1][lane]], alone] {
                    at_corner += usize::from(slopes[0] > 0.0);
                    for (t, other, slope) in [(first, second, slopes[0]), (second, first, slopes[1])] {
                        let p = inside(&mut random, t);
                        let far = facet(other).distance_squared(p).sqrt();
                        assert!(far >= slope * (p - t[0]).length() * (1.0 - 1e-9) - 1e-14, "{t:?} {other:?}: {slope}");
                    }
                }
                let (second, slope) = ([first[0], first[1], second[2]], bends[lane]);
                at_edge += usize::from(slope > 0.0);
                let along = (first[1] - first[0]).normalize();
                for (t, other) in [(first, &second), (&second, first)] {
                    let p = inside(&mut random, t);
                    let off = (p - t[0]) - along * (p - t[0]).dot(along);
                    let far = facet(other).distance_squared(p).sqrt();
                    assert!(far >= slope * off.length() * (1.0 - 1e-9) - 1e-14, "{t:?} {other:?}: {slope}");
                }
            }
        }
        // Bounds of nothing hold too.
        assert!(apart > 40_000 && at_corner > 40_000 && at_edge > 80_000, "{apart} {at_corner} {at_edge}");
    }
}
