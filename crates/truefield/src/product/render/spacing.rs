//! How large the discs of a cloud of points must be to leave no holes.

use std::collections::HashMap;

use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3};

/// Points whose neighbours are looked at.
const PROBES: usize = 512;
/// A lattice point has eight neighbours within 1.42 times its spacing.
const NEIGHBOURS: usize = 8;

/// A radius for discs at `points`, samples of a surface, that closes the gaps between them.
///
/// 0.8 times the distance of the eighth neighbour, of the widest but two per cent of 512 points spread over the
/// cloud; on a square lattice that is 1.13 times its spacing. One pass over the points, no sorting.
pub fn covering_radius(points: &[DVec3]) -> Result<f64> {
    let extent = Aabb::around(points.iter().copied());
    if !extent.diagonal().is_finite() {
        return Err(Error::invalid("a point is not finite, or there is none; the distance of neighbours is unknown"));
    }
    let size = extent.diagonal() / (points.len() as f64).sqrt();
    if size <= 0.0 {
        return Ok(1.0);
    }
    // Far more room than a surface with this many points in this box needs for eight neighbours.
    let cell = 4.0 * size;
    let place = |p: DVec3| ((p - extent.min) / cell).floor().to_array().map(|c| c as i64);
    let probes: Vec<DVec3> = (0..PROBES.min(points.len())).map(|k| points[k * points.len() / PROBES.min(points.len())]).collect();
    let mut near: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
    for (index, probe) in probes.iter().enumerate() {
        let [x, y, z] = place(*probe);
        for shift in 0..27 {
            near.entry([x + shift % 3 - 1, y + shift / 3 % 3 - 1, z + shift / 9 - 1]).or_default().push(index);
        }
    }
    let mut nearest = vec![[f64::INFINITY; NEIGHBOURS]; probes.len()];
    for point in points {
        for &index in near.get(&place(*point)).into_iter().flatten() {
            let squared = point.distance_squared(probes[index]);
            let list = &mut nearest[index];
            // Twins of the point itself say nothing about gaps.
            if squared > 1e-12 * cell * cell && squared < list[NEIGHBOURS - 1] {
                list[NEIGHBOURS - 1] = squared;
                list.sort_unstable_by(f64::total_cmp);
            }
        }
    }
    // Lonely points take the farthest neighbour they have, or the cell.
    let mut reach: Vec<f64> =
        nearest.iter().map(|list| list.iter().rev().find(|d| d.is_finite()).map_or(0.25 * cell, |d| d.sqrt())).collect();
    reach.sort_unstable_by(f64::total_cmp);
    Ok(0.8 * reach[(reach.len() - 1) * 98 / 100])
}
