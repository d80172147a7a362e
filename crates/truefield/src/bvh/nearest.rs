//! Nearest triangle of one point and of many.

use super::cloud;
use super::order::along_curve;
use super::tree::{ABSENT, LEAF, Packet, Slot, Tree, WIDTH};
use crate::error::Result;
use crate::geom::{DVec3, Foot};
use crate::run::Run;
use crate::simd::{Fuse, multiversion};

/// The best triangle so far: its squared distance and index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Squared distance.
    pub distance_squared: f64,
    /// Triangle index; `u32::MAX` when none was found within the bound.
    pub triangle: u32,
}

impl Candidate {
    /// Nothing found yet within `within` of the point.
    pub fn within(within: f64) -> Self {
        Self { distance_squared: within * within, triangle: u32::MAX }
    }

    /// Whether a triangle was found.
    pub fn found(&self) -> bool {
        self.triangle != u32::MAX
    }

    #[inline(always)]
    pub(crate) fn offer(&mut self, distance_squared: f64, triangle: u32) {
        let better = distance_squared < self.distance_squared || (distance_squared == self.distance_squared && triangle < self.triangle);
        if better {
            *self = Self { distance_squared, triangle };
        }
    }
}

/// The nearest triangle of a point and the foot of the point on it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Located {
    pub triangle: u32,
    pub foot: Foot,
}

impl Located {
    pub fn candidate(self) -> Candidate {
        Candidate { distance_squared: self.foot.distance_squared, triangle: self.triangle }
    }
}

impl Tree {
    /// The nearest triangle that is not farther than `best` already is; the lowest index on ties.
    pub fn nearest(&self, p: DVec3, best: Candidate) -> Candidate {
        search(self, p, best)
    }

    /// The nearest triangle of every point.
    ///
    /// Points that are near each other share what is known about a box around them; the result does not depend on it.
    pub fn nearest_many(&self, points: &[DVec3], run: &Run<'_>) -> Result<Vec<Candidate>> {
        self.nearest_along(points, run, |_, found| found.iter().map(|found| found.candidate()).collect())
    }

    /// What `answer` makes of points that follow each other along a space-filling curve and of their nearest triangles.
    ///
    /// It is given some thousand points and as many answers; which ones does not depend on the threads.
    pub(crate) fn nearest_along<T: Copy + Send + Sync>(
        &self,
        points: &[DVec3],
        run: &Run<'_>,
        answer: impl Fn(&[DVec3], &[Located]) -> Vec<T> + Sync,
    ) -> Result<Vec<T>> {
        along_curve("nearest points", points, run, |points, keys| answer(points, &self.nearest_sorted(points, keys)))
    }

    /// The nearest triangles of points that are sorted by their places on a Morton curve.
    pub(crate) fn nearest_sorted(&self, points: &[DVec3], keys: &[u32]) -> Vec<Located> {
        cloud::nearest(self, points, keys)
    }
}

multiversion!(fn search(tree: &Tree, p: DVec3, best: Candidate) -> Candidate = search_body);
multiversion!(
    /// The nearest triangle of every point, each search starting from the answer before, the first from `warm`; returns the last answer.
    pub(super) fn search_many(tree: &Tree, points: &[DVec3], warm: Slot, out: &mut [Located]) -> Slot = search_many_body
);

#[inline(always)]
fn search_many_body<F: Fuse>(tree: &Tree, points: &[DVec3], mut warm: Slot, out: &mut [Located]) -> Slot {
    for (&p, out) in points.iter().zip(out) {
        let start = Candidate { distance_squared: tree.facet_at(warm).distance_squared(p), triangle: tree.triangle(warm) };
        let triangle = search_body::<F>(tree, p, start).triangle;
        warm = tree.slots[triangle as usize];
        *out = Located { triangle, foot: tree.facet_at(warm).foot(p) };
    }
    warm
}

#[inline(always)]
fn search_body<F: Fuse>(tree: &Tree, p: DVec3, mut best: Candidate) -> Candidate {
    let local = p - tree.center;
    let q = [local.x as f32, local.y as f32, local.z as f32];
    // What single precision may add to a box distance.
    let slack = 4.0 * f64::from(f32::EPSILON) * (local.abs().max_element() + tree.radius);
    let reach = |best: &Candidate| {
        let d = best.distance_squared.sqrt() + slack;
        ((d * d) * (1.0 + 4.0 * f64::from(f32::EPSILON))) as f32
    };
    let mut limit = reach(&best);
    let mut stack = [(0.0f32, 0u32); 256];
    let mut height = 1;
    while height > 0 {
        height -= 1;
        let (distance, index) = stack[height];
        if distance > limit {
            continue;
        }
        if index & LEAF != 0 {
            let before = best;
            visit(&tree.packets[(index & !LEAF) as usize], p, &mut best);
            if best != before {
                limit = reach(&best);
            }
            continue;
        }
        let node = &tree.nodes[index as usize];
        let mut squared = [0.0f32; WIDTH];
        for lane in 0..WIDTH {
            let gap = |axis: usize| (node.min[axis][lane] - q[axis]).max(q[axis] - node.max[axis][lane]).max(0.0);
            let (x, y, z) = (gap(0), gap(1), gap(2));
            squared[lane] = x * x + y * y + z * z;
        }
        // The children within reach, nearest on top.
        let start = height;
        for lane in 0..WIDTH {
            if squared[lane] <= limit && node.child[lane] != ABSENT {
                let entry = (squared[lane], node.child[lane]);
                let mut at = height;
                while at > start && stack[at - 1].0 < entry.0 {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = entry;
                height += 1;
            }
        }
    }
    best
}

#[inline(always)]
fn visit(packet: &Packet, p: DVec3, best: &mut Candidate) {
    let mut squared = [0.0f64; WIDTH];
    for lane in 0..WIDTH {
        squared[lane] = packet.facet(lane).distance_squared(p);
    }
    for lane in 0..WIDTH {
        best.offer(squared[lane], packet.triangle[lane]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriangleMesh;

    fn soup(count: usize, size: f64, seed: u64) -> TriangleMesh {
        let mut state = seed;
        let mut random = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let mut vertices = Vec::new();
        for _ in 0..count {
            let corner = DVec3::new(random(), random(), random());
            for _ in 0..3 {
                vertices.push(corner + DVec3::new(random(), random(), random()) * size);
            }
        }
        let triangles = (0..count as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        TriangleMesh::new(vertices, triangles).expect("a soup")
    }

    #[test]
    fn equals_brute_force_bit_for_bit() {
        for (count, size) in [(1, 1.0), (9, 0.5), (300, 0.3), (3000, 0.02)] {
            let mesh = soup(count, size, count as u64);
            let tree = Tree::build(&mesh, &Run::default()).expect("a tree");
            let points: Vec<DVec3> = soup(1000, 3.0, 7).vertices().to_vec();
            let many = tree.nearest_many(&points, &Run::with_threads(2)).expect("answers");
            for (p, many) in points.iter().zip(&many) {
                let mut judge = Candidate::within(f64::INFINITY);
                for t in 0..count as u32 {
                    judge.offer(mesh.facet(t).distance_squared(*p), t);
                }
                assert_eq!(judge, *many);
                assert_eq!(judge, tree.nearest(*p, Candidate::within(f64::INFINITY)));
                let d = judge.distance_squared.sqrt();
                assert!(!tree.nearest(*p, Candidate::within(d * 0.999_999)).found());
                assert_eq!(judge, tree.nearest(*p, Candidate::within(d * 1.000_001)));
            }
        }
    }
}
