//! How far marched sites are from the nearest ones: the judge of [`super::wavefront`] and [`super::march`].

use super::raster::{NO_SITE, Raster};
use crate::error::{Error, Result};
use crate::run::Run;

/// Voxels a worker compares at once.
const CHUNK: usize = 1 << 16;

/// Squared distances nearer to each other than this part of them are the same: what rounding of their sums leaves.
const ROUNDING: f64 = 1e-14;

/// Where marched sites are farther than the nearest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Difference {
    /// Voxels whose site is farther than the nearest.
    pub voxels: u64,
    /// The most by which one is farther, a length.
    pub largest: f64,
}

/// Compares the sites that a march left with those of an exact transform of the same voxels.
///
/// Both hold a linear index for each voxel, [`NO_SITE`] where there is none; a voxel that was not reached counts if it
/// has a nearest site, but not for the largest difference. Refuses sites that no march can have left: ones that are nearer.
pub fn difference(shape: &[usize], sampling: &[f64], marched: &[u32], exact: &[u32], run: &Run<'_>) -> Result<Difference> {
    let raster = Raster::new(shape, sampling)?;
    if marched.len() != raster.len() || exact.len() != raster.len() {
        let (a, b, c) = (marched.len(), exact.len(), raster.len());
        return Err(Error::invalid(format!("there are {a} marched and {b} exact sites for {c} voxels; give one for each")));
    }
    let parts = run.blocks("compare", raster.len().div_ceil(CHUNK), |block| {
        let mut found = Difference::default();
        for index in block * CHUNK..((block + 1) * CHUNK).min(raster.len()) {
            let (marched, exact) = (marched[index], exact[index]);
            if marched == exact {
                continue;
            }
            let place = raster.place(index as u32);
            let squared = |site: u32| match site {
                NO_SITE => Ok(f64::INFINITY),
                site if (site as usize) < raster.len() => Ok(raster.squared(place, raster.place(site))),
                site => Err(Error::invalid(format!("voxel {index} has site {site}, but there are only {} voxels", raster.len()))),
            };
            let (ours, least) = (squared(marched)?, squared(exact)?);
            if ours < least * (1.0 - ROUNDING) {
                return Err(Error::invalid(format!("voxel {index} has site {exact} as nearest, but {marched} is nearer: it is not exact")));
            }
            if ours > least * (1.0 + ROUNDING) {
                found.voxels += 1;
                if ours.is_finite() {
                    found.largest = found.largest.max(ours.sqrt() - least.sqrt());
                }
            }
        }
        Ok(found)
    })?;
    Ok(parts.into_iter().fold(Difference::default(), |a, b| Difference { voxels: a.voxels + b.voxels, largest: a.largest.max(b.largest) }))
}
