//! Distances of pairs of a point and a triangle, whichever they are, in lanes.

use super::nearest::Candidate;
use super::tree::{Packet, Tree, WIDTH};
use crate::geom::DVec3;
use crate::simd::{Fuse, multiversion};

/// A point and a triangle that may be its nearest, by their indices.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    pub point: u32,
    pub triangle: u32,
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
