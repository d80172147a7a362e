//! Fast marching order: voxels settle nearest first and pass their closest point on.
//!
//! Breen, Mauch, Whitaker: 3D Scan Conversion of CSG Models into Distance, Closest-Point and Colour Volumes. From
//! a narrow band whose closest points are known, the voxel with the smallest distance settles, and each of its
//! neighbours that has not settled tries its closest point, instead of solving a finite difference as Sethian does.
//! Accuracy follows the points, not the spacing of the voxels.
//!
//! What a point carries (a place, a colour, a triangle) is the caller's: it is named by its number.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::raster::{NO_SITE, Raster, check_limit};
use crate::error::{Error, Result};
use crate::geom::DVec3;
use crate::grid::Grid;
use crate::run::Run;

/// Trials between two looks at the flag that cancels.
const CHUNK: usize = 4096;

/// What a march leaves behind.
#[derive(Clone, Debug, PartialEq)]
pub struct Marched {
    /// For each voxel the number of its closest point; [`NO_SITE`] where none came within the limit.
    pub points: Vec<u32>,
    /// Distances to those points, rounded to nearest; infinite without a point.
    pub distance: Vec<f32>,
}

/// A voxel at the edge of what is known.
///
/// Bits of positive floats sort like the floats, so the heap compares whole numbers.
type Trial = Reverse<(u64, u32, u32)>;

/// Marches over the points of `lattice` from those whose closest point is known, at most to `limit`.
///
/// `known` names lattice points by linear index and their closest points by their place in `points` (model units); a
/// lattice point may be named several times. One thread does it. Takes 16 bytes a lattice point and the heap's 16
/// for every trial; refuses more than `memory` bytes.
pub fn march(lattice: &Grid, points: &[DVec3], known: &[(u32, u32)], limit: f64, memory: u64, run: &Run<'_>) -> Result<Marched> {
    let shape = lattice.shape.map(|n| n as usize);
    // Refuses what linear indices cannot name.
    Raster::new(&shape, &[1.0; 3])?;
    if let Some(index) = points.iter().position(|p| !p.is_finite()) {
        return Err(Error::invalid(format!("point {index} is {}; all points must be finite numbers", points[index])));
    }
    if let Some((voxel, point)) = known.iter().find(|(voxel, point)| *voxel as usize >= lattice.len() || *point as usize >= points.len()) {
        let (voxels, points) = (lattice.len(), points.len());
        return Err(Error::invalid(format!("voxel {voxel} has point {point}, but there are {voxels} voxels and {points} points")));
    }
    let squared = |place: [u32; 3], point: u32| {
        let [i, j, k] = [0, 1, 2].map(|axis| lattice.first[axis] + i64::from(place[axis]));
        (lattice.corner(i, j, k) - points[point as usize]).length_squared()
    };
    settle(shape, known, limit, memory, run, squared)
}

/// Marches from the voxels marked in `sites` over a volume of `shape` (x slowest), at most to `limit`.
///
/// The closest points are the centres of sites, their numbers linear indices; see [`march`]. Takes 1 to 3 axes.
pub fn march_sites(shape: &[usize], sampling: &[f64], sites: &[bool], limit: f64, memory: u64, run: &Run<'_>) -> Result<Marched> {
    let raster = Raster::new(shape, sampling)?;
    raster.check_marks(sites)?;
    let known: Vec<(u32, u32)> = (0u32..).zip(sites).filter(|(_, site)| **site).map(|(index, _)| (index, index)).collect();
    settle(raster.shape, &known, limit, memory, run, |place, site| raster.squared(place, raster.place(site)))
}

/// The march itself, over a volume of `shape`.
fn settle(
    shape: [usize; 3],
    known: &[(u32, u32)],
    limit: f64,
    memory: u64,
    run: &Run<'_>,
    squared: impl Fn([u32; 3], u32) -> f64,
) -> Result<Marched> {
    check_limit(limit)?;
    let count: usize = shape.iter().product();
    let needed = 16 * (count as u64 + known.len() as u64);
    if needed > memory {
        return Err(Error::Memory { what: format!("a march over {shape:?} voxels"), needed, allowed: memory });
    }
    let reach = limit * limit;
    let jump = |step: [i32; 3]| {
        step[0].wrapping_mul(shape[1] as i32).wrapping_add(step[1]).wrapping_mul(shape[2] as i32).wrapping_add(step[2]) as u32
    };
    let ring = (0..27).map(|n| [n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1]).filter(|step| *step != [0; 3]);
    let ring: Vec<([i32; 3], u32)> = ring.map(|step| (step, jump(step))).collect();
    let mut points = vec![NO_SITE; count];
    // The least squared distance that was tried.
    let mut least = vec![f64::INFINITY; count];
    let mut trials: BinaryHeap<Trial> = BinaryHeap::new();
    let place = |index: u32| {
        let (row, nz) = (index / shape[2] as u32, shape[2] as u32);
        [row / shape[1] as u32, row % shape[1] as u32, index % nz]
    };
    let offer = |trials: &mut BinaryHeap<Trial>, least: &mut f64, at: [u32; 3], index: u32, point: u32| {
        let distance = squared(at, point);
        if distance < *least && distance <= reach {
            *least = distance;
            trials.push(Reverse((distance.to_bits(), index, point)));
        }
    };
    for (number, &(voxel, point)) in known.iter().enumerate() {
        if number % CHUNK == 0 {
            run.cancel.check()?;
        }
        offer(&mut trials, &mut least[voxel as usize], place(voxel), voxel, point);
    }
    let (mut settled, mut tried) = (0, 0usize);
    while let Some(Reverse((bits, index, point))) = trials.pop() {
        tried += 1;
        if tried % CHUNK == 0 {
            run.cancel.check()?;
            run.progress.report("march", settled, count);
        }
        // A trial that a nearer point has overtaken.
        if points[index as usize] != NO_SITE || f64::from_bits(bits) != least[index as usize] {
            continue;
        }
        points[index as usize] = point;
        settled += 1;
        let at = place(index);
        for &(step, jump) in &ring {
            let next = [0, 1, 2].map(|axis| at[axis].wrapping_add_signed(step[axis]));
            let neighbour = index.wrapping_add(jump);
            if (0..3).all(|axis| (next[axis] as usize) < shape[axis]) && points[neighbour as usize] == NO_SITE {
                offer(&mut trials, &mut least[neighbour as usize], next, neighbour, point);
            }
        }
    }
    let distance = least.iter().map(|squared| squared.sqrt() as f32).collect();
    Ok(Marched { points, distance })
}
