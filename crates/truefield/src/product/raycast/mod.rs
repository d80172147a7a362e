//! Rays against adaptively sampled fields: what is seen, and what is hidden.
//!
//! As Frisken et al. 2000 do, from cell to cell: the way through a cell is crossed where the interpolation along it is at
//! the distance, and the value with which a ray enters a cell is the one with which it left the cell before, so that the
//! cracks between cells of different size let nothing through.

mod along;
mod beam;
mod caster;
mod facets;
mod lanes;
mod walk;

use std::sync::{Mutex, PoisonError};

pub use caster::Caster;
use lanes::{Lanes, RAYS, take_rays};
pub use walk::{Hit, Hits};

use crate::error::{Error, Result};
use crate::geom::DVec3;
use crate::run::Run;

/// Rays that a worker takes at a time.
const CHUNK: usize = 4096;

/// How the crossing in a trilinear leaf is found. The surface in exact leaves is met in their triangles; leaves that answer in
/// another way, and other distances than zero in exact ones, are followed step by step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Between the ends of the way through the cell the value is taken to be linear: the paper's, and the quicker one.
    Linear,
    /// The exact crossing: along a line, trilinear interpolation is a cubic.
    Cubic,
}

impl Caster {
    /// The first hit of each ray; directions need not be of unit length. Entering and leaving both count.
    pub fn cast(&self, origins: &[DVec3], directions: &[DVec3], method: Method, run: &Run<'_>) -> Result<Hits> {
        same_length(origins, directions)?;
        // Zeros cost nothing until the workers write over them.
        let count = origins.len();
        let mut hits = Hits { distances: vec![0.0; count], points: vec![[0.0; 3]; count], normals: vec![[0.0; 3]; count] };
        let columns = hits.points.chunks_mut(CHUNK).zip(hits.normals.chunks_mut(CHUNK));
        let parts: Vec<_> = hits.distances.chunks_mut(CHUNK).zip(columns).map(Mutex::new).collect();
        run.blocks("cast rays", parts.len(), |chunk| {
            let mut part = parts[chunk].lock().unwrap_or_else(PoisonError::into_inner);
            let (distances, (points, normals)) = &mut *part;
            let range = chunk * CHUNK..chunk * CHUNK + distances.len();
            let (from, along) = (&origins[range.clone()], &directions[range]);
            let (mut lanes, mut beam) = (Lanes::EMPTY, [Hit::NONE; RAYS]);
            for first in (0..from.len()).step_by(RAYS) {
                let rays = first..(first + RAYS).min(from.len());
                take_rays(&mut lanes, &self.extent, self.scale, &from[rays.clone()], &along[rays.clone()]);
                if !lanes.are_sound() {
                    return Err(fault(origins, directions));
                }
                self.cast_beam(&lanes, method, &mut beam[..rays.len()]);
                for (i, hit) in rays.zip(&beam) {
                    (distances[i], points[i], normals[i]) = (hit.distance, hit.point.to_array(), hit.normal.to_array());
                }
            }
            Ok(())
        })?;
        drop(parts);
        Ok(hits)
    }

    /// Rays that are quicker together where they run side by side.
    fn cast_beam(&self, rays: &Lanes<RAYS>, method: Method, hits: &mut [Hit]) {
        let free = self.free(rays);
        for (lane, hit) in hits.iter_mut().enumerate() {
            let ray = if free < f64::INFINITY { rays.ray(lane) } else { None };
            *hit = ray.and_then(|ray| self.follow(&ray, free, f64::INFINITY, method)).unwrap_or(Hit::NONE);
        }
    }

    /// Whether each ray meets the surface within `length`, model units.
    pub fn occluded(&self, origins: &[DVec3], directions: &[DVec3], length: f64, method: Method, run: &Run<'_>) -> Result<Vec<bool>> {
        if !(length >= 0.0) {
            return Err(Error::invalid(format!("the length of the rays is {length}; give a length, not negative")));
        }
        same_length(origins, directions)?;
        let mut out = vec![false; origins.len()];
        run.chunks("cast rays", &mut out, CHUNK, |chunk, out| {
            let range = chunk * CHUNK..chunk * CHUNK + out.len();
            let (from, along) = (&origins[range.clone()], &directions[range]);
            for (out, (&origin, &direction)) in out.iter_mut().zip(from.iter().zip(along)) {
                if !sound(origin, direction) {
                    return Err(fault(origins, directions));
                }
                *out = self.meets(origin, direction, length, method);
            }
            Ok(())
        })?;
        Ok(out)
    }
}

fn same_length(origins: &[DVec3], directions: &[DVec3]) -> Result<()> {
    if origins.len() == directions.len() {
        return Ok(());
    }
    Err(Error::invalid(format!("{} origins need as many directions, not {}", origins.len(), directions.len())))
}

/// Whether both are finite, and the direction is not zero.
fn sound(origin: DVec3, direction: DVec3) -> bool {
    origin.is_finite() && direction.is_finite() && direction != DVec3::ZERO
}

/// What is wrong with the first that is no ray.
fn fault(origins: &[DVec3], directions: &[DVec3]) -> Error {
    if let Some(ray) = origins.iter().position(|p| !p.is_finite()) {
        return Error::invalid(format!("the origin of ray {ray} is {}; all origins must be finite numbers", origins[ray]));
    }
    let ray = directions.iter().position(|d| !(d.is_finite() && *d != DVec3::ZERO)).unwrap_or(0);
    Error::invalid(format!("the direction of ray {ray} is {}; give a direction, finite and not zero", directions[ray]))
}
