//! Winding numbers on both sides of every triangle, and how far off it they still tell inside from outside.
//!
//! Where a surface is whole, its pseudonormals say on which side of it a nearby point lies, whatever is wrong elsewhere.
//! The winding number is W on the outer side of a triangle and W + 1 on the inner one, and changes along a path off
//! the surface only as fast as the edges that bound the surface let it ([`Boundary`]); where none do, not at all. So one
//! winding number serves a whole piece of surface: it is handed on from triangle to triangle across
//! sound edges, along a path just above them, as long as what it may change on the way is small.

use crate::bvh::Tree;
use crate::bvh::boundary::Boundary;
use crate::error::Result;
use crate::geom::DVec3;
use crate::mesh::TriangleMesh;
use crate::mesh::topology::Topology;
use crate::run::Run;

use super::check::between;
use super::sign::Side;
use super::sum::Sum;

/// Winding numbers are handed on while they are known this well.
const HANDED: f64 = 0.15;

/// A winding number that is asked for is asked to within this.
const ASKED: f64 = 0.05;

/// Too near to the boundary for a group of triangles may still be far enough for one of them.
const STEEP: f64 = 0.02;

/// Groups of triangles a worker takes at once.
const CHUNK: usize = 256;

/// Groups that follow each other in the tree, and share what is known where the boundary is far.
const CLUSTER: usize = 8;

/// So many times its radius has to be known around what shares.
const ROOM: f64 = 4.0;

/// What a triangle parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wall {
    /// The whole winding number nearest to that on the outer side.
    winding: i32,
    /// Every path off the surface of at most this length, from either side of the triangle, stays inside or outside; 0 where nothing is known.
    pub reach: f32,
}

impl Wall {
    /// Nothing is known.
    const UNKNOWN: Self = Self { winding: 0, reach: 0.0 };

    /// Outside on the outer side, inside on the inner one, everywhere.
    pub const CLEAN: Self = Self { winding: 0, reach: f32::INFINITY };

    /// Whether its outer side is outside and its inner one inside.
    pub fn is_plain(&self) -> bool {
        self.winding == 0
    }

    /// Whether it parts inside from outside.
    pub fn parts(&self) -> bool {
        self.side(1.0) != self.side(-1.0)
    }

    /// The side of a point on the outer side (`height` positive) or the inner one.
    pub fn side(&self, height: f64) -> Side {
        let winding = if height > 0.0 { self.winding } else { self.winding + 1 };
        if winding == 0 { Side::Outside } else { Side::Inside }
    }
}

/// A ball around a triangle, or around some, and how fast the winding number can change in it.
#[derive(Clone, Copy)]
struct Spot {
    center: DVec3,
    radius: f64,
    /// Infinite where the triangle is not sound or touches an edge that bounds the surface.
    steepest: f64,
}

impl Spot {
    /// As steep as `known`, or as the boundary says where that is too steep.
    fn around(corners: &[DVec3], boundary: &Boundary, known: f64) -> Self {
        let center = corners[0] + corners.iter().map(|&v| v - corners[0]).sum::<DVec3>() / corners.len() as f64;
        let radius = corners.iter().map(|&v| (v - center).length()).fold(0.0, f64::max) * (1.0 + 1e-12);
        let steepest = if known * radius < STEEP { known } else { boundary.steepest(center, radius) };
        Self { center, radius, steepest }
    }
}

/// The walls of all triangles. O(n), and one winding number for each sound piece of a closed surface.
pub(crate) fn walls(mesh: &TriangleMesh, topology: &Topology, tree: &Tree, sound: &[bool], sum: &Sum, run: &Run<'_>) -> Result<Vec<Wall>> {
    let boundary = &sum.boundary;
    // Triangles of a leaf share what is known of the boundary.
    let groups = tree.leaves().map(|triangles| triangles.iter().copied().filter(|&t| sound[t as usize]).collect::<Vec<u32>>());
    let groups: Vec<Vec<u32>> = groups.filter(|group| !group.is_empty()).collect();
    let chunk = |block: usize| &groups[block * CHUNK..((block + 1) * CHUNK).min(groups.len())];
    let found = run.blocks("decide sides", groups.len().div_ceil(CHUNK), |block| {
        let corners = |group: &Vec<u32>| group.iter().flat_map(|&t| mesh.corners(t)).collect::<Vec<DVec3>>();
        let spots = chunk(block).chunks(CLUSTER).map(|cluster| {
            let each: Vec<Vec<DVec3>> = cluster.iter().map(corners).collect();
            let all = Spot::around(&each.concat(), boundary, f64::INFINITY);
            let groups = each.iter().map(|corners| {
                let group = Spot::around(corners, boundary, all.steepest);
                let each = corners.chunks_exact(3).map(|corners| Spot::around(corners, boundary, group.steepest));
                (group, each.collect::<Vec<Spot>>())
            });
            (all, groups.collect::<Vec<_>>())
        });
        Ok(spots.collect::<Vec<_>>())
    })?;
    let (clusters_at, found): (Vec<Spot>, Vec<_>) = found.into_iter().flatten().unzip();
    let (groups_at, each): (Vec<Spot>, Vec<Vec<Spot>>) = found.into_iter().flatten().unzip();
    let mut spots = vec![Spot { center: DVec3::ZERO, radius: 0.0, steepest: f64::INFINITY }; sound.len()];
    for (group, each) in groups.iter().zip(each) {
        for (&t, spot) in group.iter().zip(each) {
            spots[t as usize] = spot;
        }
    }
    let known = hand_on(mesh, topology, &spots, sum, run)?;
    let reached = run.blocks("decide sides", groups.len().div_ceil(CHUNK), |block| {
        let start = block * CHUNK;
        let clusters = chunk(block).chunks(CLUSTER).zip(&clusters_at[start / CLUSTER..]).zip(groups_at[start..].chunks(CLUSTER));
        let each = clusters.flat_map(|((cluster, at), groups_at)| {
            let mut far = Steps::new(at, boundary);
            let walls = cluster.iter().zip(groups_at).map(|(group, group_at)| {
                let mut near = None;
                let mut wall = |t: u32| {
                    let (spot, known) = (&spots[t as usize], known[t as usize]?);
                    let wall = far.wall(spot, known);
                    if f64::from(wall.reach) >= ROOM * at.radius {
                        return Some(wall);
                    }
                    let wall = near.get_or_insert_with(|| Steps::new(group_at, boundary)).wall(spot, known);
                    let enough = f64::from(wall.reach) >= ROOM * group_at.radius;
                    Some(if enough { wall } else { Steps::new(spot, boundary).wall(spot, known) })
                };
                group.iter().map(|&t| wall(t).unwrap_or(Wall::UNKNOWN)).collect::<Vec<_>>()
            });
            walls.collect::<Vec<_>>()
        });
        Ok(each.collect::<Vec<_>>())
    })?;
    let mut walls = vec![Wall::UNKNOWN; sound.len()];
    for (group, each) in groups.iter().zip(reached.into_iter().flatten()) {
        for (&t, wall) in group.iter().zip(each) {
            walls[t as usize] = wall;
        }
    }
    Ok(walls)
}

/// The winding number on the outer side of each triangle at its middle, and how wrong it may be.
fn hand_on(mesh: &TriangleMesh, topology: &Topology, spots: &[Spot], sum: &Sum, run: &Run<'_>) -> Result<Vec<Option<(f64, f64)>>> {
    let winding = sum.winding(run)?;
    let mut across = vec![[(u32::MAX, DVec3::ZERO); 3]; spots.len()];
    for sides in topology.edges() {
        if let [a, b] = sides
            && a.forward != b.forward
        {
            let [from, to] = a.ends.map(|v| mesh.vertices()[v as usize]);
            let middle = from + (to - from) * 0.5;
            across[a.triangle as usize][usize::from(a.side)] = (b.triangle, middle);
            across[b.triangle as usize][usize::from(b.side)] = (a.triangle, middle);
        }
    }
    let mut known: Vec<Option<(f64, f64)>> = vec![None; spots.len()];
    let mut queue = std::collections::VecDeque::new();
    for seed in 0..spots.len() {
        if seed % CHUNK == 0 {
            run.cancel.check()?;
        }
        if known[seed].is_some() || spots[seed].steepest * spots[seed].radius > 0.5 {
            continue;
        }
        let Some((value, error)) = between(winding, &mesh.corners(seed as u32), ASKED).filter(|&(_, error)| error <= HANDED) else {
            continue;
        };
        known[seed] = Some((value - 0.5, error));
        queue.push_back(seed);
        while let Some(t) = queue.pop_front() {
            let Some((value, error)) = known[t] else { continue };
            for (next, middle) in across[t] {
                let next = next as usize;
                if next < spots.len() && known[next].is_none() {
                    let step = |spot: &Spot| (middle - spot.center).length() * spot.steepest;
                    let error = error + (step(&spots[t]) + step(&spots[next])) * (1.0 + 1e-9);
                    known[next] =
                        if error <= HANDED { Some((value, error)) } else { sum.sharpen(spots[next].center, (value, error), ASKED) };
                    if known[next].is_some() {
                        queue.push_back(next);
                    }
                }
            }
        }
    }
    Ok(known)
}

/// Balls around a group of triangles, each with a bound on how fast the winding number changes in it; found when asked for.
struct Steps<'a> {
    boundary: &'a Boundary,
    center: DVec3,
    gap: f64,
    steepest: [Option<f64>; SHARES.len()],
}

/// Radii of the balls, as parts of the distance to the nearest edge that bounds the surface.
const SHARES: [f64; 5] = [0.15, 0.25, 0.4, 0.6, 0.8];

impl<'a> Steps<'a> {
    fn new(at: &Spot, boundary: &'a Boundary) -> Self {
        Self { boundary, center: at.center, gap: boundary.gap(at.center), steepest: [None; SHARES.len()] }
    }

    fn wall(&mut self, spot: &Spot, (value, error): (f64, f64)) -> Wall {
        let winding = value.round() as i32;
        // What the winding number may change before it could pass a half.
        let left = 0.5 - (value - value.round()).abs() - error - 1e-9;
        if left <= 0.0 {
            return Wall::UNKNOWN;
        }
        if self.boundary.is_empty() {
            return Wall { winding, reach: f32::INFINITY };
        }
        let off = (spot.center - self.center).length() * (1.0 + 1e-9);
        let mut best = 0.0f64;
        // The larger the ball, the more room there is, and the steeper it gets.
        let (mut from, mut to) = (0, SHARES.len());
        while from < to {
            let middle = (from + to) / 2;
            let radius = SHARES[middle] * self.gap;
            let steepest = *self.steepest[middle].get_or_insert_with(|| self.boundary.steepest(self.center, radius));
            // Paths from the middle of the triangle that stay in the ball.
            let (room, path) = (radius - off, left / steepest);
            best = best.max(room.min(path));
            if room <= path { from = middle + 1 } else { to = middle }
        }
        let reach = best * (1.0 - 1e-9) - spot.radius;
        if reach > 0.0 { Wall { winding, reach: (reach as f32).next_down() } } else { Wall::UNKNOWN }
    }
}
