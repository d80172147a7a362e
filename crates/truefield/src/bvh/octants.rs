//! A cell and its octants in one pass over the cell's complete list: the nearest triangles of all their corners, and the
//! complete lists of the octants.
//!
//! The 27 corners fill two vectors. Single-precision distances from them to every triangle of the list choose the few
//! that are asked again in double precision; the same distances tell, as in [`super::cover`], which triangles a witness
//! rules out for an octant. Witnesses are the exact nearest points of the octant's corners.

use super::cover::{OCTANTS, filter_error};
use super::feet::{Feet, Found};
use super::frame::Offsets;
use super::tree::{Slot, Tree};
use crate::geom::{Aabb, DVec3};
use crate::simd::{Fuse, multiversion};

/// Corners of the octants of a cell, x fastest.
pub(crate) const NODES: usize = 27;

/// Corners of a cell or of an octant.
const CORNERS: usize = 8;

const LANES: usize = 16;
const PARTS: usize = 2;

/// The node in each lane: the corners of the cell come first, so that they fill half a vector.
const NODE: [u8; NODES] = [0, 2, 6, 8, 18, 20, 24, 26, 13, 4, 10, 12, 14, 16, 22, 1, 3, 5, 7, 9, 11, 15, 17, 19, 21, 23, 25];

/// The lane of each node.
const LANE: [u8; NODES] = {
    let mut lanes = [0; NODES];
    let mut lane = 0;
    while lane < NODES {
        lanes[NODE[lane] as usize] = lane as u8;
        lane += 1;
    }
    lanes
};

/// By octant: the lanes of its corners.
const PICK: [[u8; CORNERS]; OCTANTS] = {
    let mut pick = [[0; CORNERS]; OCTANTS];
    let mut n = 0;
    while n < OCTANTS * CORNERS {
        pick[n / CORNERS][n % CORNERS] = LANE[node(n / CORNERS, n % CORNERS)];
        n += 1;
    }
    pick
};

/// The number of a corner of an octant.
pub(crate) const fn node(octant: usize, corner: usize) -> usize {
    let x = (octant & 1) + (corner & 1);
    let y = (octant >> 1 & 1) + (corner >> 1 & 1);
    let z = (octant >> 2) + (corner >> 2);
    x + 3 * y + 9 * z
}

/// One cell, and memory that is used again from cell to cell.
#[derive(Debug)]
pub(crate) struct Octants {
    base: DVec3,
    error: f32,
    points: [DVec3; LANES * PARTS],
    offsets: [Offsets<LANES>; PARTS],
    /// Squared distances to each triangle of the list.
    rows: Vec<[[f32; LANES]; PARTS]>,
    feet: Feet,
    spare: Vec<Slot>,
}

impl Default for Octants {
    fn default() -> Self {
        Self {
            base: DVec3::ZERO,
            error: 0.0,
            points: [DVec3::ZERO; LANES * PARTS],
            offsets: std::array::from_fn(|_| Offsets::from_fn(|_| DVec3::ZERO)),
            rows: Vec::new(),
            feet: Feet::default(),
            spare: Vec::new(),
        }
    }
}

impl Octants {
    /// Takes up a cell, the corners of its octants and a complete list.
    pub fn measure(&mut self, tree: &Tree, cell: &Aabb, nodes: &[DVec3; NODES], list: &[Slot]) {
        self.place(tree, cell, nodes);
        measure(tree, self, list);
    }

    /// [`Self::measure`], dropping from the list what the nearest points of the cell's corners rule out.
    pub fn shorten(&mut self, tree: &Tree, cell: &Aabb, nodes: &[DVec3; NODES], feet: &[DVec3; CORNERS], list: &mut Vec<Slot>) {
        self.place(tree, cell, nodes);
        let reach = reaches(self, &[std::array::from_fn(|corner| corner as u8); 2], &[*feet; 2]);
        shorten(tree, self, &reach, list);
    }

    fn place(&mut self, tree: &Tree, cell: &Aabb, nodes: &[DVec3; NODES]) {
        self.points = std::array::from_fn(|lane| nodes[usize::from(NODE[lane.min(NODES - 1)])]);
        self.base = cell.center();
        self.error = filter_error(tree, cell) as f32;
        self.offsets = std::array::from_fn(|part| Offsets::from_fn(|lane| self.points[part * LANES + lane] - self.base));
    }

    /// The nearest triangles and points of the nodes that are no corners of the cell, with the bits of brute force.
    pub fn nearest(&mut self, tree: &Tree, list: &[Slot]) -> [Found; NODES] {
        nearest(tree, self, list);
        std::array::from_fn(|node| self.feet.found(usize::from(LANE[node])))
    }

    /// Fills `out` with the complete lists of those octants that are `wanted`, a bit for each, from the nearest points of all
    /// nodes, which have to be answered; keeps the list's order.
    pub fn split(&mut self, wanted: u8, feet: &[DVec3; NODES], list: &[Slot], out: &mut [Vec<Slot>; OCTANTS]) {
        let mut octants = (0..OCTANTS).filter(|octant| wanted >> octant & 1 == 1);
        while let Some(first) = octants.next() {
            let second = octants.next();
            if list.len() > 1 {
                let mut lists =
                    [std::mem::take(&mut out[first]), std::mem::take(second.map_or(&mut self.spare, |second| &mut out[second]))];
                split(self, [first, second.unwrap_or(first)], feet, list, &mut lists);
                let [low, high] = lists;
                out[first] = low;
                *second.map_or(&mut self.spare, |second| &mut out[second]) = high;
                continue;
            }
            for octant in [Some(first), second].into_iter().flatten() {
                out[octant].clear();
                out[octant].extend(list);
            }
        }
    }
}

/// By witness: squared distances from the corners of two octants that a triangle must not exceed to stay.
type Reach = [[f32; LANES]; CORNERS];

multiversion!(fn measure(tree: &Tree, octants: &mut Octants, list: &[Slot]) = measure_body);
multiversion!(fn shorten(tree: &Tree, octants: &mut Octants, reach: &Reach, list: &mut Vec<Slot>) = shorten_body);
multiversion!(fn nearest(tree: &Tree, octants: &mut Octants, list: &[Slot]) = nearest_body);
multiversion!(
    /// The lists of two octants.
    fn split(octants: &Octants, pair: [usize; 2], feet: &[DVec3; NODES], list: &[Slot], out: &mut [Vec<Slot>; 2]) = split_body
);

#[inline(always)]
fn measure_body<F: Fuse>(tree: &Tree, octants: &mut Octants, list: &[Slot]) {
    octants.rows.clear();
    for &slot in list {
        let frame = tree.frame_at(slot);
        let mut row = [[0.0; LANES]; PARTS];
        for part in 0..PARTS {
            frame.distances_squared::<F, LANES>(octants.base, &octants.offsets[part], &mut row[part]);
        }
        octants.rows.push(row);
    }
}

/// Too large rather than too small by all errors: those of the rows, of the places and of the witnesses.
#[inline(always)]
fn reaches(octants: &Octants, lanes: &[[u8; CORNERS]; 2], feet: &[[DVec3; CORNERS]; 2]) -> Reach {
    let offsets = Offsets::<LANES>::from_fn(|lane| {
        let at = usize::from(lanes[lane / CORNERS][lane % CORNERS]);
        octants.points[at] - octants.base
    });
    let mut reach = [[0.0f32; LANES]; CORNERS];
    for (witness, reach) in reach.iter_mut().enumerate() {
        let q = [feet[0][witness] - octants.base, feet[1][witness] - octants.base];
        for lane in 0..LANES {
            let q = q[lane / CORNERS];
            let (x, y, z) = (offsets.x[lane] - q.x as f32, offsets.y[lane] - q.y as f32, offsets.z[lane] - q.z as f32);
            let distance = (x * x + y * y + z * z).sqrt() + 2.0 * octants.error;
            reach[lane] = distance * distance * (1.0 + 8.0 * f32::EPSILON);
        }
    }
    reach
}

/// Whether a triangle stays in the lists of two octants, 1 or 0: each witness leaves a corner's bit.
#[inline(always)]
fn stays<F: Fuse>(row: &[f32; LANES], reach: &Reach) -> (usize, usize) {
    let (mut low, mut high) = (true, true);
    // Without a branch, which nothing could foretell.
    for witness in reach {
        let mask = F::mask_not_above(row, witness);
        low &= mask & 0xff != 0;
        high &= mask & 0xff00 != 0;
    }
    (usize::from(low), usize::from(high))
}

#[inline(always)]
fn shorten_body<F: Fuse>(tree: &Tree, octants: &mut Octants, reach: &Reach, list: &mut Vec<Slot>) {
    let Octants { base, rows, offsets, .. } = octants;
    rows.clear();
    let mut kept = 0;
    for at in 0..list.len() {
        // The first part has the corners of the cell.
        let (slot, mut row) = (list[at], [[0.0; LANES]; PARTS]);
        tree.frame_at(slot).distances_squared::<F, LANES>(*base, &offsets[0], &mut row[0]);
        list[kept] = slot;
        kept += stays::<F>(&row[0], reach).0;
        rows.push(row);
        rows.truncate(kept);
    }
    list.truncate(kept);
    for (&slot, row) in list.iter().zip(rows) {
        tree.frame_at(slot).distances_squared::<F, LANES>(*base, &offsets[1], &mut row[1]);
    }
}

#[inline(always)]
fn nearest_body<F: Fuse>(tree: &Tree, octants: &mut Octants, list: &[Slot]) {
    let Octants { rows, points, feet, error, .. } = octants;
    let mut least = [[f32::INFINITY; LANES]; PARTS];
    for row in rows.iter() {
        for part in 0..PARTS {
            for lane in 0..LANES {
                least[part][lane] = if row[part][lane] < least[part][lane] { row[part][lane] } else { least[part][lane] };
            }
        }
    }
    for least in least.as_flattened_mut() {
        // Both sides of a comparison may be off by the error.
        let reach = least.sqrt() + 2.0 * *error;
        *least = reach * reach * (1.0 + 8.0 * f32::EPSILON);
    }
    // The cell's own corners are known, and beyond the last node are none.
    least[0][..CORNERS].fill(-1.0);
    least[1][NODES - LANES..].fill(-1.0);
    feet.clear();
    for (&slot, row) in list.iter().zip(rows.iter()) {
        feet.choose(slot, F::mask_not_above(&row[0], &least[0]) | F::mask_not_above(&row[1], &least[1]) << LANES);
    }
    feet.find(tree, points);
}

#[inline(always)]
fn split_body<F: Fuse>(octants: &Octants, pair: [usize; 2], feet: &[DVec3; NODES], list: &[Slot], out: &mut [Vec<Slot>; 2]) {
    let lanes = [PICK[pair[0]], PICK[pair[1]]];
    let mut around = [[DVec3::ZERO; CORNERS]; 2];
    for lane in 0..LANES {
        around[lane / CORNERS][lane % CORNERS] = feet[node(pair[lane / CORNERS], lane % CORNERS)];
    }
    let reach = reaches(octants, &lanes, &around);
    for out in out.iter_mut() {
        out.clear();
        out.resize(list.len(), Slot(0));
    }
    let [left, right] = out;
    let lanes: [u32; LANES] = std::array::from_fn(|lane| u32::from(lanes[lane / CORNERS][lane % CORNERS]));
    let mut kept = (0, 0);
    for (&slot, row) in list.iter().zip(&octants.rows) {
        (left[kept.0], right[kept.1]) = (slot, slot);
        let (low, high) = stays::<F>(&F::pick(row, &lanes), &reach);
        kept = (kept.0 + low, kept.1 + high);
    }
    left.truncate(kept.0);
    right.truncate(kept.1);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::Candidate;
    use crate::laws::Random;
    use crate::mesh::TriangleMesh;
    use crate::run::Run;
    use crate::simd::Plain;

    /// Triangles of a size, some of them twice.
    fn soup(random: &mut Random, count: u32, size: f64) -> Tree {
        let mut vertices = Vec::new();
        for _ in 0..count {
            let middle = random.direction() * random.unit();
            vertices.extend((0..3).map(|_| middle + random.direction() * size));
        }
        let triangles = (0..count).chain(0..count / 8).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        Tree::build(&TriangleMesh::new(vertices, triangles).expect("a soup"), &Run::default()).expect("a tree")
    }

    fn judge(tree: &Tree, p: DVec3) -> Candidate {
        let mut best = Candidate::within(f64::INFINITY);
        for t in 0..tree.len() as u32 {
            best.offer(tree.facet(t).distance_squared(p), t);
        }
        best
    }

    fn nodes(cell: &Aabb) -> [DVec3; NODES] {
        std::array::from_fn(|n| cell.min + 0.5 * cell.size() * DVec3::new((n % 3) as f64, (n / 3 % 3) as f64, (n / 9) as f64))
    }

    #[test]
    fn nodes_and_points_of_octants_find_their_nearest_triangles_in_the_lists() {
        let mut random = Random::new(3);
        let mut octants = Octants::default();
        let mut shortened = 0;
        for (count, size) in [(1, 1.0), (2, 0.3), (60, 0.3), (400, 0.05), (300, 1e-4)] {
            let tree = soup(&mut random, count, size);
            for round in 0..60 {
                let middle = random.direction() * random.between(0.0, 2.0);
                let half = DVec3::splat(random.length(1e-4, 0.5));
                let cell = Aabb::new(middle - half, middle + half);
                let nodes = nodes(&cell);
                let found = nodes.map(|p| judge(&tree, p));
                let feet = std::array::from_fn(|n| tree.facet(found[n].triangle).nearest(nodes[n]).point);
                let mut list: Vec<Slot> = (0..tree.len() as u32).map(Slot).collect();
                if round % 2 == 0 {
                    octants.shorten(&tree, &cell, &nodes, &std::array::from_fn(|corner| feet[node(corner, corner)]), &mut list);
                    assert!(list.is_sorted() && !list.is_empty());
                    shortened += tree.len() - list.len();
                } else {
                    octants.measure(&tree, &cell, &nodes, &list);
                }
                let answers = octants.nearest(&tree, &list);
                for n in (0..NODES).filter(|n| (0..CORNERS).all(|corner| node(corner, corner) != *n)) {
                    assert_eq!(answers[n].nearest, found[n], "node {n} of {cell:?}, {count} triangles of {size}");
                    assert_eq!(answers[n].foot, feet[n], "node {n} of {cell:?}, {count} triangles of {size}");
                }
                let wanted = random.below(256) as u8;
                let mut lists: [Vec<Slot>; OCTANTS] = std::array::from_fn(|_| vec![Slot(u32::MAX)]);
                octants.split(wanted, &feet, &list, &mut lists);
                for octant in 0..OCTANTS {
                    if wanted >> octant & 1 == 0 {
                        assert_eq!(lists[octant], [Slot(u32::MAX)], "octant {octant} was not wanted");
                        continue;
                    }
                    assert!(lists[octant].is_sorted() && lists[octant].iter().all(|slot| list.contains(slot)));
                    let low = nodes[node(octant, 0)];
                    for _ in 0..20 {
                        let p = low + half * DVec3::new(random.unit(), random.unit(), random.unit());
                        let nearest = judge(&tree, p);
                        let kept = lists[octant].iter().any(|&slot| tree.triangle(slot) == nearest.triangle);
                        assert!(kept, "{p} in octant {octant} of {cell:?}, {count} triangles of {size}");
                    }
                }
            }
        }
        assert!(shortened > 10_000, "only {shortened} triangles were ruled out");
    }

    #[test]
    fn every_corner_of_an_octant_is_picked_from_its_lane() {
        let row: [[f32; LANES]; PARTS] = std::array::from_fn(|part| std::array::from_fn(|lane| (part * LANES + lane) as f32));
        for (octant, lanes) in PICK.iter().enumerate() {
            let lanes: [u32; LANES] = std::array::from_fn(|lane| u32::from(lanes[lane % CORNERS]));
            let picked = Plain::pick(&row, &lanes);
            for lane in 0..LANES {
                let n = usize::from(NODE[picked[lane] as usize]);
                assert_eq!(n, node(octant, lane % CORNERS));
            }
            assert_eq!(native(&row, &lanes), picked);
        }
    }

    multiversion!(
        /// What this machine runs.
        fn native(row: &[[f32; LANES]; PARTS], lanes: &[u32; LANES]) -> [f32; LANES] = native_body
    );

    #[inline(always)]
    fn native_body<F: Fuse>(row: &[[f32; LANES]; PARTS], lanes: &[u32; LANES]) -> [f32; LANES] {
        F::pick(row, lanes)
    }
}
