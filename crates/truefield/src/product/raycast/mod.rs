//! Rays against adaptively sampled fields: what is seen, and what is hidden.
//!
//! As Frisken et al. 2000 do, from cell to cell: the way through a cell is crossed where the interpolation along it is at
//! the distance, and the value with which a ray enters a cell is the one with which it left the cell before, so that the
//! cracks between cells of different size let nothing through.

mod along;
mod beam;
mod caster;
mod walk;

use beam::RAYS;
pub use caster::Caster;
pub use walk::Hit;

use crate::error::{Error, Result};
use crate::geom::DVec3;
use crate::run::Run;

/// Rays that a worker takes at a time.
const CHUNK: usize = 4096;

/// How the crossing in a trilinear leaf is found. Leaves that answer in another way are followed step by step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Between the ends of the way through the cell the value is taken to be linear: the paper's, and the quicker one.
    Linear,
    /// The exact crossing: along a line, trilinear interpolation is a cubic.
    Cubic,
}

impl Caster {
    /// The first hit of each ray; directions need not be of unit length. Entering and leaving both count.
    ///
    /// Where nothing is met, the distance is infinite, and place and normal are not numbers.
    pub fn cast(&self, origins: &[DVec3], directions: &[DVec3], method: Method, run: &Run<'_>) -> Result<Vec<Hit>> {
        check(origins, directions)?;
        let mut hits = vec![Hit::NONE; origins.len()];
        run.chunks("cast rays", &mut hits, CHUNK, |chunk, hits| {
            for (i, hits) in hits.chunks_mut(RAYS).enumerate() {
                let rays = chunk * CHUNK + i * RAYS..chunk * CHUNK + i * RAYS + hits.len();
                self.cast_beam(&origins[rays.clone()], &directions[rays], method, hits);
            }
            Ok(())
        })?;
        Ok(hits)
    }

    /// Up to [`RAYS`] rays; quicker together where they run side by side.
    fn cast_beam(&self, origins: &[DVec3], directions: &[DVec3], method: Method, hits: &mut [Hit]) {
        let mut units = [DVec3::ZERO; RAYS];
        let mut rays = [const { None }; RAYS];
        for (i, (&origin, &direction)) in origins.iter().zip(directions).enumerate() {
            units[i] = unit(direction);
            rays[i] = self.prepare(origin, units[i], f64::INFINITY);
        }
        let free = self.free(&rays[..origins.len()]);
        if free == f64::INFINITY {
            return;
        }
        for ((hit, ray), &direction) in hits.iter_mut().zip(&rays).zip(&units) {
            if let Some(ray) = ray {
                *hit = self.follow(ray, free, direction, f64::INFINITY, method).unwrap_or(Hit::NONE);
            }
        }
    }

    /// Whether each ray meets the surface within `length`, model units.
    pub fn occluded(&self, origins: &[DVec3], directions: &[DVec3], length: f64, method: Method, run: &Run<'_>) -> Result<Vec<bool>> {
        if !(length >= 0.0) {
            return Err(Error::invalid(format!("the length of the rays is {length}; give a length, not negative")));
        }
        check(origins, directions)?;
        let mut out = vec![false; origins.len()];
        run.chunks("cast rays", &mut out, CHUNK, |chunk, out| {
            for (i, out) in out.iter_mut().enumerate() {
                let ray = chunk * CHUNK + i;
                *out = self.meets(origins[ray], unit(directions[ray]), length, method);
            }
            Ok(())
        })?;
        Ok(out)
    }
}

/// Of any length that is a number, however small or large.
fn unit(direction: DVec3) -> DVec3 {
    let largest = direction.abs().max_element();
    (direction / largest).normalize()
}

fn check(origins: &[DVec3], directions: &[DVec3]) -> Result<()> {
    if origins.len() != directions.len() {
        return Err(Error::invalid(format!("{} origins need as many directions, not {}", origins.len(), directions.len())));
    }
    if let Some(ray) = origins.iter().position(|p| !p.is_finite()) {
        return Err(Error::invalid(format!("the origin of ray {ray} is {}; all origins must be finite numbers", origins[ray])));
    }
    match directions.iter().position(|d| !(d.is_finite() && *d != DVec3::ZERO)) {
        Some(ray) => {
            Err(Error::invalid(format!("the direction of ray {ray} is {}; give a direction, finite and not zero", directions[ray])))
        }
        None => Ok(()),
    }
}
