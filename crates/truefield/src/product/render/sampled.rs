//! Values known at points of a surface, looked up where a pixel sees it.

use std::collections::HashMap;

use super::spacing::covering_radius;
use crate::error::{Error, Result};
use crate::geom::DVec3;

/// Values at points of a surface. A pixel takes the weighted mean of the samples around the point it sees, on
/// the same side of sharp edges and thin walls (normals within 60 degrees), and the nearest one where none is near.
#[derive(Clone, Debug)]
pub struct SurfaceSamples {
    points: Vec<DVec3>,
    normals: Vec<DVec3>,
    values: Vec<f64>,
    /// Samples of each cell of a lattice of edge `radius`, as a range.
    cells: HashMap<[i64; 3], (u32, u32)>,
    radius: f64,
}

/// Rings of cells that are searched for a nearest sample.
const RINGS: i64 = 4;
const ALIKE: f64 = 0.5;

impl SurfaceSamples {
    /// Sorts the samples into a lattice; `normals` need no unit length. NaN values are left out.
    pub fn new(points: &[DVec3], normals: &[DVec3], values: &[f64]) -> Result<Self> {
        if points.len() != normals.len() || points.len() != values.len() {
            return Err(Error::invalid(format!(
                "{} sample points need as many normals and values, not {} and {}",
                points.len(),
                normals.len(),
                values.len()
            )));
        }
        if let Some(index) = (0..points.len()).find(|&i| !points[i].is_finite() || !normals[i].is_finite()) {
            return Err(Error::invalid(format!("sample {index} has a coordinate that is not finite; leave it out")));
        }
        let mut radius = 1.5 * if points.is_empty() { 1.0 } else { covering_radius(points)? };
        if !(radius > 0.0 && (1.0 / radius).is_finite()) {
            radius = 1.0;
        }
        let place = |p: DVec3| cell(p, radius);
        let mut order: Vec<usize> = (0..points.len()).filter(|&i| !values[i].is_nan()).collect();
        order.sort_by_key(|&i| place(points[i]));
        let mut cells = HashMap::new();
        for (rank, &i) in order.iter().enumerate() {
            cells.entry(place(points[i])).or_insert((rank as u32, rank as u32)).1 = rank as u32 + 1;
        }
        Ok(Self {
            points: order.iter().map(|&i| points[i]).collect(),
            normals: order.iter().map(|&i| normals[i].normalize_or_zero()).collect(),
            values: order.iter().map(|&i| values[i]).collect(),
            cells,
            radius,
        })
    }

    /// Value at a point of the surface with unit normal `normal`; NaN where no sample is near.
    pub(super) fn at(&self, point: DVec3, normal: DVec3) -> f64 {
        let (mut sum, mut weights) = (0.0, 0.0);
        let mut nearest = (f64::INFINITY, f64::NAN);
        let middle = cell(point, self.radius);
        for ring in 0..=RINGS {
            self.visit_ring(middle, ring, |i| {
                if self.normals[i].dot(normal) < ALIKE && self.normals[i] != DVec3::ZERO {
                    return;
                }
                let squared = self.points[i].distance_squared(point);
                if squared < nearest.0 {
                    nearest = (squared, self.values[i]);
                }
                let weight = (1.0 - squared / (self.radius * self.radius)).max(0.0);
                sum += self.values[i] * weight * weight;
                weights += weight * weight;
            });
            // All within one radius lie in the first two rings; what a further ring holds is farther than ring - 1 cells.
            if ring >= 1 && (weights > 0.0 || nearest.0 <= (ring as f64 * self.radius).powi(2)) {
                break;
            }
        }
        if weights > 0.0 { sum / weights } else { nearest.1 }
    }

    fn visit_ring(&self, middle: [i64; 3], ring: i64, mut visit: impl FnMut(usize)) {
        for dz in -ring..=ring {
            for dy in -ring..=ring {
                let rim = dz.abs() == ring || dy.abs() == ring;
                let step = if rim || ring == 0 { 1 } else { 2 * ring };
                let mut dx = -ring;
                while dx <= ring {
                    if let Some(&(start, end)) = self.cells.get(&[middle[0] + dx, middle[1] + dy, middle[2] + dz]) {
                        (start..end).for_each(|i| visit(i as usize));
                    }
                    dx += step;
                }
            }
        }
    }
}

fn cell(point: DVec3, edge: f64) -> [i64; 3] {
    (point / edge).floor().to_array().map(|c| c as i64)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn near_samples_are_averaged_far_ones_looked_up_and_other_sides_ignored() {
        let mut points = Vec::new();
        let mut normals = Vec::new();
        let mut values = Vec::new();
        // A thin plate: the value is x on top, and 100 at the bottom.
        for i in 0..60 {
            for j in 0..60 {
                let p = DVec3::new(f64::from(i), f64::from(j), 0.0);
                points.extend([p, p - DVec3::Z * 0.1]);
                normals.extend([DVec3::Z * 3.0, -DVec3::Z]);
                values.extend([p.x, 100.0]);
            }
        }
        let samples = SurfaceSamples::new(&points, &normals, &values).unwrap();
        for (x, y) in [(30.0, 30.0), (20.4, 11.7), (44.5, 50.2)] {
            let found = samples.at(DVec3::new(x, y, 0.0), DVec3::Z);
            assert!((found - x).abs() < 0.25, "{found} at {x}");
            assert!((samples.at(DVec3::new(x, y, 0.0), -DVec3::Z) - 100.0).abs() < 1e-9);
        }
        assert!((samples.at(DVec3::new(62.5, 30.0, 0.0), DVec3::Z) - 59.0).abs() < 1.0);
        assert!(samples.at(DVec3::new(900.0, 0.0, 0.0), DVec3::Z).is_nan());
        assert!(samples.at(DVec3::new(30.0, 30.0, 0.0), DVec3::X).is_nan());
        assert!(SurfaceSamples::new(&[], &[], &[]).unwrap().at(DVec3::ZERO, DVec3::Z).is_nan());
    }

    #[test]
    fn samples_that_cannot_be_used_are_named() {
        let z = [DVec3::Z];
        assert!(SurfaceSamples::new(&z, &z, &[]).unwrap_err().to_string().contains("1 sample points"));
        assert!(SurfaceSamples::new(&[DVec3::NAN], &z, &[1.0]).unwrap_err().to_string().contains("sample 0"));
        assert!(SurfaceSamples::new(&z, &z, &[f64::NAN]).unwrap().at(DVec3::Z, DVec3::Z).is_nan());
    }
}
