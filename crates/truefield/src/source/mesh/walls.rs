//! Winding numbers on both sides of every triangle, and how far off it they still tell inside from outside.
//!
//! Where a surface is whole, its pseudonormals say on which side of it a nearby point lies, whatever is wrong elsewhere.
//! The winding number is W on the outer side of a triangle and W + 1 on the inner one, and changes along a path off
//! the surface only as fast as the edges that bound the surface let it ([`Boundary`]); where none do, not at all. So one
//! winding number serves a whole piece of surface: it is handed on from triangle to triangle across
//! sound edges, along a path just above them, as long as what it may change on the way is small.

use crate::bvh::boundary::Boundary;
use crate::bvh::winding::Winding;
use crate::error::Result;
use crate::geom::DVec3;
use crate::mesh::TriangleMesh;
use crate::mesh::topology::Topology;
use crate::run::Run;

use super::check::between;
use super::sign::Side;

/// Winding numbers are handed on while they are known this well.
const HANDED: f64 = 0.15;

/// A winding number that is asked for is asked to within this.
const ASKED: f64 = 0.05;

/// Triangles a worker takes at once.
const CHUNK: usize = 1024;

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

    /// The side of a point on the outer side (`height` positive) or the inner one.
    pub fn side(&self, height: f64) -> Side {
        let winding = if height > 0.0 { self.winding } else { self.winding + 1 };
        if winding == 0 { Side::Outside } else { Side::Inside }
    }
}

/// A triangle's place and what the winding number can change over it.
#[derive(Clone, Copy)]
struct Spot {
    center: DVec3,
    radius: f64,
    /// Infinite where the triangle is not sound or touches an edge that bounds the surface.
    change: f64,
}

/// The walls of all triangles. O(n), and one winding number for each sound piece of a closed surface.
pub(crate) fn walls(
    mesh: &TriangleMesh,
    topology: &Topology,
    sound: &[bool],
    winding: &Winding,
    boundary: &Boundary,
    run: &Run<'_>,
) -> Result<Vec<Wall>> {
    let count = sound.len();
    let chunk = |block: usize| block * CHUNK..((block + 1) * CHUNK).min(count);
    let spots: Vec<Spot> = run
        .blocks("walls", count.div_ceil(CHUNK), |block| {
            let spot = |t: usize| {
                let corners = mesh.corners(t as u32);
                let center = corners[0] + ((corners[1] - corners[0]) + (corners[2] - corners[0])) / 3.0;
                let radius = corners.iter().map(|&v| (v - center).length()).fold(0.0, f64::max) * (1.0 + 1e-12);
                let change = if sound[t] { boundary.steepest(center, radius) * radius } else { f64::INFINITY };
                Spot { center, radius, change }
            };
            Ok(chunk(block).map(spot).collect::<Vec<_>>())
        })?
        .into_iter()
        .flatten()
        .collect();
    let known = hand_on(mesh, topology, &spots, winding, run)?;
    let walls = run.blocks("walls", count.div_ceil(CHUNK), |block| {
        Ok(chunk(block).map(|t| wall(&spots[t], known[t], boundary)).collect::<Vec<_>>())
    })?;
    Ok(walls.into_iter().flatten().collect())
}

/// The winding number on the outer side of each triangle at its middle, and how wrong it may be.
fn hand_on(mesh: &TriangleMesh, topology: &Topology, spots: &[Spot], winding: &Winding, run: &Run<'_>) -> Result<Vec<Option<(f64, f64)>>> {
    let mut across = vec![[u32::MAX; 3]; spots.len()];
    for sides in topology.edges() {
        if let [a, b] = sides
            && a.forward != b.forward
        {
            across[a.triangle as usize][usize::from(a.side)] = b.triangle;
            across[b.triangle as usize][usize::from(b.side)] = a.triangle;
        }
    }
    let mut known: Vec<Option<(f64, f64)>> = vec![None; spots.len()];
    let mut queue = std::collections::VecDeque::new();
    for seed in 0..spots.len() {
        if seed % CHUNK == 0 {
            run.cancel.check()?;
        }
        if known[seed].is_some() || spots[seed].change > 0.5 {
            continue;
        }
        let Some((value, error)) = between(winding, &mesh.corners(seed as u32), ASKED).filter(|&(_, error)| error <= HANDED) else {
            continue;
        };
        known[seed] = Some((value - 0.5, error));
        queue.push_back(seed);
        while let Some(t) = queue.pop_front() {
            let Some((value, error)) = known[t] else { continue };
            for next in across[t].map(|next| next as usize) {
                if next < spots.len() && known[next].is_none() {
                    let error = error + (spots[t].change + spots[next].change) * (1.0 + 1e-9);
                    if error <= HANDED {
                        known[next] = Some((value, error));
                        queue.push_back(next);
                    }
                }
            }
        }
    }
    Ok(known)
}

fn wall(spot: &Spot, known: Option<(f64, f64)>, boundary: &Boundary) -> Wall {
    let Some((value, error)) = known else { return Wall::UNKNOWN };
    let whole = value.round();
    // What the winding number may change before it could pass a half.
    let left = 0.5 - (value - whole).abs() - error - 1e-9;
    if left <= 0.0 {
        return Wall::UNKNOWN;
    }
    if boundary.is_empty() {
        return Wall { winding: whole as i32, reach: f32::INFINITY };
    }
    let gap = boundary.gap(spot.center);
    let holds = |length: f64| boundary.steepest(spot.center, length) * length < left;
    let lengths = [0.8, 0.64, 0.5, 0.4, 0.32, 0.25, 0.2, 0.16, 0.12].map(|share| share * gap);
    let length = lengths.into_iter().take_while(|&length| length > spot.radius).find(|&length| holds(length));
    length.map_or(Wall::UNKNOWN, |length| Wall { winding: whole as i32, reach: ((length - spot.radius) as f32).next_down().max(0.0) })
}
