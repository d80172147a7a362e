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

/// The lanes of the corners of the cell itself.
const OUTER: [u8; CORNERS] = [0, 1, 2, 3, 4, 5, 6, 7];

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
        let reach = reaches(self, OUTER, feet);
        shorten(tree, self, &reach, list);
    }

    fn place(&mut self, tree: &Tree, cell: &Aabb, nodes: &[DVec3; NODES]) {
        (self.base, self.error) = (cell.center(), filter_error(tree, cell) as f32);
        for lane in 0..LANES * PARTS {
            let p = nodes[usize::from(NODE[lane.min(NODES - 1)])];
            let ([x, y, z], offsets, at) = ((p - self.base).to_array(), &mut self.offsets[lane / LANES], lane % LANES);
            (offsets.x[at], offsets.y[at], offsets.z[at]) = (x as f32, y as f32, z as f32);
            self.points[lane] = p;
        }
    }

    /// Finds the nearest triangles and points of the nodes that are no corners of the cell, with the bits of brute force.
    pub fn nearest(&mut self, tree: &Tree, list: &[Slot]) {
        nearest(tree, self, list);
    }

    /// What is nearest to a node, of those that were looked for last.
    pub fn found(&self, node: usize) -> Found {
        self.feet.found(usize::from(LANE[node]))
    }

    /// Fills `out` with the complete lists of those octants that are `wanted`, a bit for each, from the nearest points of all
    /// nodes, which have to be answered; keeps the list's order.
    pub fn split(&mut self, wanted: u8, feet: &[DVec3; NODES], list: &[Slot], out: &mut [Vec<Slot>; OCTANTS]) {
        for (octant, out) in out.iter_mut().enumerate().filter(|(octant, _)| wanted >> octant & 1 == 1) {
            if list.len() > 1 {
                split(self, octant, feet, list, out);
            } else {
                out.clear();
                out.extend(list);
            }
        }
    }
}

/// By corner, for each witness: squared distances that a triangle must not exceed to stay.
type Reach = [[f32; CORNERS]; CORNERS];

multiversion!(fn measure(tree: &Tree, octants: &mut Octants, list: &[Slot]) = measure_body);
multiversion!(fn shorten(tree: &Tree, octants: &mut Octants, reach: &Reach, list: &mut Vec<Slot>) = shorten_body);
multiversion!(fn nearest(tree: &Tree, octants: &mut Octants, list: &[Slot]) = nearest_body);
multiversion!(
    /// The list of an octant.
    fn split(octants: &Octants, octant: usize, feet: &[DVec3; NODES], list: &[Slot], out: &mut Vec<Slot>) = split_body
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
fn reaches(octants: &Octants, lanes: [u8; CORNERS], feet: &[DVec3; CORNERS]) -> Reach {
    let q = Offsets::<CORNERS>::from_fn(|witness| feet[witness] - octants.base);
    let mut reach = [[0.0f32; CORNERS]; CORNERS];
    for (lane, reach) in lanes.into_iter().zip(&mut reach) {
        let (offsets, lane) = (&octants.offsets[usize::from(lane) / LANES], usize::from(lane) % LANES);
        for witness in 0..CORNERS {
            let (x, y, z) = (offsets.x[lane] - q.x[witness], offsets.y[lane] - q.y[witness], offsets.z[lane] - q.z[witness]);
            let distance = (x * x + y * y + z * z).sqrt() + 2.0 * octants.error;
            reach[witness] = distance * distance * (1.0 + 8.0 * f32::EPSILON);
        }
    }
    reach
}

/// Whether a triangle stays in the list of a cell with corners in these lanes, 1 or 0: it does where no witness is nearer to all corners.
#[inline(always)]
fn stays<F: Fuse>(row: &[[f32; LANES]; PARTS], lanes: [u8; CORNERS], reach: &Reach) -> usize {
    let row = row.as_flattened();
    // Without a branch, which nothing could foretell.
    let mut room = [f32::NEG_INFINITY; CORNERS];
    for (lane, reach) in lanes.into_iter().zip(reach) {
        let squared = row[usize::from(lane) % (PARTS * LANES)];
        for witness in 0..CORNERS {
            let left = reach[witness] - squared;
            room[witness] = if left > room[witness] { left } else { room[witness] };
        }
    }
    usize::from(!F::any_negative(&room))
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
        kept += stays::<F>(&row, OUTER, reach);
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
    let (chosen, mut count) = (feet.room(list.len()), 0);
    for (&slot, row) in list.iter().zip(rows.iter()) {
        let points = F::mask_not_above(&row[0], &least[0]) | F::mask_not_above(&row[1], &least[1]) << LANES;
        chosen[count] = (slot, points);
        count += usize::from(points != 0);
    }
    feet.choose(count);
    feet.find(tree, points);
}

#[inline(always)]
fn split_body<F: Fuse>(octants: &Octants, octant: usize, feet: &[DVec3; NODES], list: &[Slot], out: &mut Vec<Slot>) {
    let lanes = PICK[octant];
    let reach = reaches(octants, lanes, &std::array::from_fn(|corner| feet[node(octant, corner)]));
    out.clear();
    out.resize(list.len(), Slot(0));
    let mut kept = 0;
    for (&slot, row) in list.iter().zip(&octants.rows) {
        out[kept] = slot;
        kept += stays::<F>(row, lanes, &reach);
    }
    out.truncate(kept);
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
                octants.nearest(&tree, &list);
                let answers: [Found; NODES] = std::array::from_fn(|node| octants.found(node));
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
    fn a_triangle_stays_where_no_witness_is_nearer_to_all_corners() {
        let mut random = Random::new(9);
        let mut ruled = 0;
        for round in 0..4000 {
            let mut number = || if random.below(9) == 0 { 0.5 } else { random.unit() as f32 };
            let row: [[f32; LANES]; PARTS] = std::array::from_fn(|_| std::array::from_fn(|_| number()));
            let reach: Reach = std::array::from_fn(|_| std::array::from_fn(|_| 0.6 * number()));
            let octant = round % OCTANTS;
            let kept = stays::<Plain>(&row, PICK[octant], &reach);
            let lane_of = |corner: usize| (0..NODES).find(|&lane| usize::from(NODE[lane]) == node(octant, corner)).expect("a lane");
            let nearer = |witness: usize| (0..CORNERS).all(|corner| row.as_flattened()[lane_of(corner)] > reach[corner][witness]);
            assert_eq!(kept == 0, (0..CORNERS).any(nearer), "octant {octant}: {row:?} and {reach:?}");
            assert_eq!(native(&row, octant, &reach), kept, "octant {octant}: {row:?} and {reach:?}");
            ruled += 1 - kept;
        }
        assert!((100..3900).contains(&ruled), "{ruled} are ruled out");
    }

    multiversion!(
        /// What this machine runs.
        fn native(row: &[[f32; LANES]; PARTS], octant: usize, reach: &Reach) -> usize = native_body
    );

    #[inline(always)]
    fn native_body<F: Fuse>(row: &[[f32; LANES]; PARTS], octant: usize, reach: &Reach) -> usize {
        stays::<F>(row, PICK[octant], reach)
    }
}
