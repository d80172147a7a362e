//! Distances of points to the triangles that may be nearest, in lanes: pairs of any point and any triangle, and groups of
//! points that share a list.

use super::nearest::Candidate;
use super::order::Place;
use super::tree::{Packet, Tree, WIDTH};
use crate::geom::DVec3;
use crate::simd::{Fuse, multiversion};

/// A point and a triangle that may be its nearest, by their indices.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    pub point: u32,
    pub triangle: u32,
}

/// Points that share a list of triangles, by their ranges in common tables.
#[derive(Clone, Debug)]
pub(crate) struct Group {
    pub points: std::ops::Range<usize>,
    pub triangles: std::ops::Range<usize>,
}

multiversion!(
    /// The nearest of each group's triangles for each of its points; the lowest index keeps ties.
    ///
    /// A group's points are those of `points` that `order` names second; others keep what was found.
    pub(crate) fn offer_lists(
        tree: &Tree,
        points: &[DVec3],
        order: &[Place],
        triangles: &[u32],
        groups: &[Group],
        found: &mut [Candidate],
    ) = offer_lists_body
);

#[inline(always)]
fn offer_lists_body<F: Fuse>(tree: &Tree, points: &[DVec3], order: &[Place], triangles: &[u32], groups: &[Group], found: &mut [Candidate]) {
    for group in groups {
        for some in order[group.points.clone()].chunks(WIDTH) {
            let mut p = [[0.0; WIDTH]; 3];
            for lane in 0..WIDTH {
                let point = points[some[lane.min(some.len() - 1)].1 as usize];
                (p[0][lane], p[1][lane], p[2][lane]) = (point.x, point.y, point.z);
            }
            // Indices are whole in double precision, and lanes of one kind are quicker.
            let (mut least, mut nearest) = ([f64::INFINITY; WIDTH], [f64::INFINITY; WIDTH]);
            for &triangle in &triangles[group.triangles.clone()] {
                let (facet, triangle) = (tree.facet(triangle), f64::from(triangle));
                for lane in 0..WIDTH {
                    let squared = facet.distance_squared(DVec3::new(p[0][lane], p[1][lane], p[2][lane]));
                    let better = (squared < least[lane]) | ((squared == least[lane]) & (triangle < nearest[lane]));
                    least[lane] = if better { squared } else { least[lane] };
                    nearest[lane] = if better { triangle } else { nearest[lane] };
                }
            }
            for (lane, &(_, point)) in some.iter().enumerate() {
                found[point as usize] = Candidate { distance_squared: least[lane], triangle: nearest[lane] as u32 };
            }
        }
    }
}

multiversion!(
    /// Offers the triangles to their points; the lowest index keeps ties.
    pub(crate) fn offer(tree: &Tree, points: &[DVec3], pairs: &[Pair], found: &mut [Candidate]) = offer_body
);

#[inline(always)]
fn offer_body<F: Fuse>(tree: &Tree, points: &[DVec3], pairs: &[Pair], found: &mut [Candidate]) {
    let mut packet = Packet::EMPTY;
    for group in pairs.chunks(WIDTH) {
        let mut p = [[0.0; WIDTH]; 3];
        for lane in 0..WIDTH {
            let Pair { point, triangle } = group[lane.min(group.len() - 1)];
            packet.set(lane, tree.facet(triangle), triangle);
            for axis in 0..3 {
                p[axis][lane] = points[point as usize][axis];
            }
        }
        let mut squared = [0.0; WIDTH];
        for lane in 0..WIDTH {
            squared[lane] = packet.facet(lane).distance_squared(DVec3::new(p[0][lane], p[1][lane], p[2][lane]));
        }
        for (pair, squared) in group.iter().zip(squared) {
            found[pair.point as usize].offer(squared, pair.triangle);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laws::Random;
    use crate::mesh::TriangleMesh;
    use crate::run::Run;

    /// Triangles of which every other one is a twin of the one before, so that ties are common.
    fn twins(random: &mut Random, count: usize) -> TriangleMesh {
        let vertices: Vec<DVec3> = (0..3 * count).map(|_| random.direction() * random.unit()).collect();
        let triangles = (0..2 * count as u32).map(|t| [0, 1, 2].map(|corner| 3 * (t / 2) + corner)).collect();
        TriangleMesh::new(vertices, triangles).expect("a mesh")
    }

    #[test]
    fn pairs_and_groups_are_what_single_offers_are() {
        let mut random = Random::new(11);
        let mesh = twins(&mut random, 40);
        let tree = Tree::build(&mesh, &Run::default()).expect("a tree");
        let points: Vec<DVec3> = (0..1000).map(|_| random.direction() * random.unit()).collect();
        let order: Vec<Place> = (0..1000).rev().map(|i| (0, i)).collect();
        let (mut groups, mut triangles, mut pairs, mut start) = (Vec::new(), Vec::new(), Vec::new(), 0);
        let mut judge = vec![Candidate::within(f64::INFINITY); points.len()];
        while start < order.len() {
            let end = (start + 1 + (random.unit() * 30.0) as usize).min(order.len());
            let first = triangles.len();
            // In any order, and some twice.
            triangles.extend((0..1 + (random.unit() * 12.0) as usize).map(|_| (random.unit() * 79.9) as u32));
            for &(_, point) in &order[start..end] {
                for &triangle in &triangles[first..] {
                    judge[point as usize].offer(mesh.facet(triangle).distance_squared(points[point as usize]), triangle);
                    pairs.push(Pair { point, triangle });
                }
            }
            groups.push(Group { points: start..end, triangles: first..triangles.len() });
            start = end;
        }
        let nothing = vec![Candidate::within(f64::INFINITY); points.len()];
        let (mut paired, mut grouped) = (nothing.clone(), nothing);
        offer(&tree, &points, &pairs, &mut paired);
        offer_lists(&tree, &points, &order, &triangles, &groups, &mut grouped);
        assert_eq!(judge, paired);
        assert_eq!(judge, grouped);
    }
}
