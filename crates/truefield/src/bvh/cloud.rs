//! Nearest triangles of scattered points that are near each other: boxes around them, halved from coarse to fine, each
//! with its complete list of candidates, answer 64 points at once where a search would answer one.

use super::cover::{OCTANTS, Range, Scratch, center_range, gather_few, refine};
use super::evaluate::{Answers, BLOCK, Points, Rows, evaluate};
use super::nearest::{Located, search_many};
use super::tree::{Slot, Tree};
use crate::geom::{Aabb, DVec3, Foot};

/// Points of the boxes that are given a list; it is shortened for their parts.
const MOST: usize = 512;

/// Fewer points are searched for one by one.
const FEW: usize = 8;

/// A search costs as much as so many candidates for one point of a box.
const SEARCH: usize = 16;

/// Lists as short as this are not shortened further.
const SHORT: usize = 8;

/// Boxes farther away than so many sizes of the mesh have lists that single precision cannot shorten.
const FAR: f64 = 64.0;

/// Not answered yet.
const UNKNOWN: Located = Located { triangle: u32::MAX, foot: Foot { distance_squared: f64::INFINITY, s: 0.0, t: 0.0 } };

/// Memory that is used again from box to box.
pub(crate) struct Cloud<'a> {
    tree: &'a Tree,
    points: &'a [DVec3],
    /// Places on a Morton curve, ascending.
    keys: &'a [u32],
    found: Vec<Located>,
    scratch: Scratch,
    rows: Rows,
    answers: Box<Answers>,
    /// Lists that no box uses at present.
    lists: Vec<[Vec<Slot>; OCTANTS]>,
    near: Slot,
}

/// Points that follow each other, and the box around them.
#[derive(Clone, Copy)]
struct Part {
    first: usize,
    end: usize,
    cell: Aabb,
}

/// The nearest triangles of `points`, sorted by their places on a Morton curve.
pub(crate) fn nearest(tree: &Tree, points: &[DVec3], keys: &[u32]) -> Vec<Located> {
    let mut cloud = Cloud {
        tree,
        points,
        keys,
        found: vec![UNKNOWN; points.len()],
        scratch: Scratch::default(),
        rows: Rows::default(),
        answers: Box::new(Answers::NONE),
        lists: Vec::new(),
        near: Slot(0),
    };
    cloud.seek(0, points.len());
    cloud.found
}

impl Cloud<'_> {
    fn part(&self, first: usize, end: usize) -> Part {
        Part { first, end, cell: Aabb::around(self.points[first..end].iter().copied()) }
    }

    /// Answers points whose list is not known.
    fn seek(&mut self, first: usize, end: usize) {
        let count = end - first;
        if count <= MOST {
            let part = self.part(first, end);
            let reach = (part.cell.center() - self.tree.center).length() + part.cell.radius();
            if count < FEW || !(reach <= FAR * self.tree.radius) {
                return self.search(first, end);
            }
            let (nearest, _) = center_range(self.tree, &part.cell, self.near);
            self.near = self.tree.slots[nearest.triangle as usize];
            let witness = self.tree.facet(nearest.triangle).nearest(part.cell.center()).point;
            let mut list = Vec::new();
            if gather_few(self.tree, &part.cell, &[witness], SEARCH * count, &mut self.scratch, &mut list) {
                // One witness made it; eight make it much shorter.
                if list.len() <= SHORT {
                    return self.shorten(part, &list);
                }
                let (parts, count) = self.halves(part, 2);
                return self.share(&parts[..count], &list);
            }
        }
        let (ends, count) = self.cuts(first, end, 2);
        if count == 1 {
            return self.search(first, end);
        }
        for &(first, end) in &ends[..count] {
            self.seek(first, end);
        }
    }

    /// Answers a part from the complete list of a box around it.
    fn shorten(&mut self, part: Part, list: &[Slot]) {
        let count = part.end - part.first;
        if list.len() > SEARCH * count {
            return self.search(part.first, part.end);
        }
        if count <= BLOCK || list.len() <= SHORT {
            return self.evaluate(part, list);
        }
        let (parts, count) = self.halves(part, OCTANTS);
        if count == 1 { self.evaluate(part, list) } else { self.share(&parts[..count], list) }
    }

    /// Answers parts of a box from its complete list, shortened for each.
    fn share(&mut self, parts: &[Part], list: &[Slot]) {
        let cells: [Aabb; OCTANTS] = std::array::from_fn(|i| parts[i.min(parts.len() - 1)].cell);
        let mut lists = self.lists.pop().unwrap_or_default();
        refine(self.tree, &cells[..parts.len()], list, &mut self.scratch, &mut lists);
        for (part, list) in parts.iter().zip(&lists) {
            self.shorten(*part, list);
        }
        self.lists.push(lists);
    }

    /// The parts of [`Cloud::cuts`].
    fn halves(&self, part: Part, most: usize) -> ([Part; OCTANTS], usize) {
        let (ends, count) = self.cuts(part.first, part.end, most);
        let mut parts = [part; OCTANTS];
        if count > 1 {
            for (part, &(first, end)) in parts.iter_mut().zip(&ends[..count]) {
                *part = self.part(first, end);
            }
        }
        (parts, count)
    }

    /// Up to `most` ranges, each of one cube or half a cube of the curve, the largest halved first; one where all points have one place.
    fn cuts(&self, first: usize, end: usize, most: usize) -> ([(usize, usize); OCTANTS], usize) {
        let mut ends = [(first, end); OCTANTS];
        let mut count = 1;
        while count < most {
            let largest = (0..count).max_by_key(|&i| (ends[i].1 - ends[i].0, usize::MAX - i)).unwrap_or(0);
            let (first, end) = ends[largest];
            let differ = self.keys[first] ^ self.keys[end - 1];
            if end - first <= BLOCK || differ == 0 {
                break;
            }
            let bit = 1u32 << differ.ilog2();
            let middle = first + self.keys[first..end].partition_point(|key| key & bit == 0);
            ends[largest] = (first, middle);
            ends[count] = (middle, end);
            count += 1;
        }
        (ends, count)
    }

    fn evaluate(&mut self, part: Part, list: &[Slot]) {
        for first in (part.first..part.end).step_by(BLOCK) {
            let range = first..(first + BLOCK).min(part.end);
            let points = Points::of_some(&self.points[range.clone()]);
            evaluate(self.tree, &part.cell, &points, list, Range::ALL, &mut self.rows, &mut self.answers);
            for (i, found) in self.found[range].iter_mut().enumerate() {
                *found = Located { triangle: self.answers.triangle[i], foot: self.answers.foot(i) };
            }
        }
    }

    fn search(&mut self, first: usize, end: usize) {
        self.near = search_many(self.tree, &self.points[first..end], self.near, &mut self.found[first..end]);
    }
}

#[cfg(test)]
mod tests {
    use crate::bvh::{Candidate, Tree};
    use crate::geom::DVec3;
    use crate::laws::Random;
    use crate::mesh::TriangleMesh;
    use crate::run::Run;

    /// Triangles of a size, some of them twice.
    fn soup(random: &mut Random, count: u32, size: f64) -> TriangleMesh {
        let mut vertices = Vec::new();
        for _ in 0..count {
            let middle = random.direction() * random.unit();
            vertices.extend((0..3).map(|_| middle + random.direction() * size));
        }
        let triangles = (0..count).chain(0..count / 8).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        TriangleMesh::new(vertices, triangles).expect("a soup")
    }

    /// Dense and thin clouds, planes, lines, corners, one place many times, far away, and some of all.
    fn clouds(random: &mut Random, mesh: &TriangleMesh) -> Vec<Vec<DVec3>> {
        let cloud = |count: usize, make: &mut dyn FnMut() -> DVec3| (0..count).map(|_| make()).collect::<Vec<_>>();
        let mut clouds = vec![
            cloud(9000, &mut || random.direction() * random.unit()),
            cloud(3000, &mut || random.direction() * (1e-3 * random.unit())),
            cloud(3000, &mut || DVec3::new(random.unit(), 0.25, random.unit())),
            cloud(3000, &mut || DVec3::Y * random.between(-2.0, 2.0)),
            cloud(3000, &mut || mesh.vertices()[random.below(mesh.vertices().len())]),
            cloud(2000, &mut || DVec3::splat(0.1)),
            cloud(2000, &mut || DVec3::X * 1e3 + random.direction()),
            cloud(500, &mut || random.direction() * random.length(1e-6, 1e200)),
        ];
        clouds.push(clouds.iter().flatten().copied().step_by(3).collect());
        clouds
    }

    #[test]
    fn equals_brute_force_bit_for_bit() {
        let mut random = Random::new(11);
        for (count, size) in [(1, 1.0), (40, 0.3), (700, 0.05), (900, 1e-4)] {
            let mesh = soup(&mut random, count, size);
            let tree = Tree::build(&mesh, &Run::default()).expect("a tree");
            let facets: Vec<_> = (0..mesh.triangles().len() as u32).map(|t| mesh.facet(t)).collect();
            for (which, points) in clouds(&mut random, &mesh).into_iter().enumerate() {
                let found = tree.nearest_many(&points, &Run::with_threads(2)).expect("answers");
                for (p, found) in points.iter().zip(found) {
                    let mut judge = Candidate::within(f64::INFINITY);
                    for (t, facet) in facets.iter().enumerate() {
                        judge.offer(facet.distance_squared(*p), t as u32);
                    }
                    assert_eq!(judge, found, "{p} of cloud {which}, {count} triangles of {size}");
                }
            }
        }
    }
}
