//! Exact nearest points of triangles that were chosen for points, eight pairs at a time, whichever they are.

use super::nearest::Candidate;
use super::tree::{Packet, Slot, Tree, WIDTH};
use crate::geom::DVec3;

/// Points asked in one go: a bit each.
const POINTS: usize = 32;

/// The nearest triangle of a point, and its nearest point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found {
    pub nearest: Candidate,
    pub foot: DVec3,
}

/// Pairs, and what is the nearest so far; memory that is used again.
#[derive(Debug, Default)]
pub(super) struct Feet {
    chosen: Vec<(Slot, u32)>,
    pairs: Vec<(Slot, u32)>,
    groups: Vec<Packet>,
    found: Vec<Found>,
}

impl Feet {
    /// Room for so many triangles, each with a bit for the points that it is chosen for.
    #[inline(always)]
    pub fn room(&mut self, count: usize) -> &mut [(Slot, u32)] {
        if self.chosen.len() < count {
            self.chosen.resize(count, (Slot(0), 0));
        }
        &mut self.chosen[..count]
    }

    /// Chooses the first so many that were put there.
    #[inline(always)]
    pub fn choose(&mut self, count: usize) {
        self.pairs.clear();
        for &(slot, mut points) in &self.chosen[..count] {
            while points != 0 {
                self.pairs.push((slot, points.trailing_zeros()));
                points &= points - 1;
            }
        }
    }

    /// What is nearest to a point of those chosen for it.
    pub fn found(&self, point: usize) -> Found {
        self.found[point]
    }

    /// Looks at all pairs; the lowest index keeps ties. The bits are those of [`crate::geom::Facet::nearest`].
    #[inline(always)]
    pub fn find(&mut self, tree: &Tree, points: &[DVec3; POINTS]) {
        self.found.clear();
        self.found.resize(POINTS, Found { nearest: Candidate::within(f64::INFINITY), foot: DVec3::ZERO });
        let Self { pairs, groups, found, .. } = self;
        let count = pairs.len().div_ceil(WIDTH);
        if groups.len() < count {
            groups.resize(count, Packet::EMPTY);
        }
        // All that is stored here has long been written when it is read.
        for (group, packet) in pairs.chunks(WIDTH).zip(groups.iter_mut()) {
            gather(tree, group, packet);
        }
        for (group, packet) in pairs.chunks(WIDTH).zip(groups.iter()) {
            let mut p = [[0.0f64; WIDTH]; 3];
            for (lane, &(_, point)) in group.iter().enumerate() {
                for axis in 0..3 {
                    p[axis][lane] = points[point as usize % POINTS][axis];
                }
            }
            let (mut squared, mut foot) = ([0.0f64; WIDTH], [[0.0f64; WIDTH]; 3]);
            for lane in 0..WIDTH {
                let facet = packet.facet(lane);
                let found = facet.foot(DVec3::new(p[0][lane], p[1][lane], p[2][lane]));
                let point = facet.a + facet.ab * found.s + facet.ac * found.t;
                squared[lane] = found.distance_squared;
                (foot[0][lane], foot[1][lane], foot[2][lane]) = (point.x, point.y, point.z);
            }
            for (lane, &(_, point)) in group.iter().enumerate() {
                let (found, triangle) = (&mut found[point as usize % POINTS], packet.triangle[lane]);
                let best = found.nearest;
                if squared[lane] < best.distance_squared || (squared[lane] == best.distance_squared && triangle < best.triangle) {
                    let nearest = Candidate { distance_squared: squared[lane], triangle };
                    *found = Found { nearest, foot: DVec3::new(foot[0][lane], foot[1][lane], foot[2][lane]) };
                }
            }
        }
    }
}

/// The triangles of a group in lanes; those beyond it are anything.
#[inline(always)]
fn gather(tree: &Tree, group: &[(Slot, u32)], packet: &mut Packet) {
    for (lane, &(slot, _)) in group.iter().enumerate() {
        packet.set(lane, tree.facet_at(slot), tree.triangle(slot));
    }
}
