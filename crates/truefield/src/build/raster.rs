//! Dense arrays of voxels in one to three dimensions, the last index fastest.

use crate::error::{Error, Result};

/// Marks a voxel that no site reaches.
pub const NO_SITE: u32 = u32::MAX;

/// Number of voxels and their distance from centre to centre along three axes.
///
/// Arrays of fewer dimensions get axes of length 1 in front, and axes of length 1 are moved there: neither
/// changes a linear index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Raster {
    pub shape: [usize; 3],
    pub sampling: [f64; 3],
}

impl Raster {
    /// Checks shape and sampling; linear indices fit a `u32` that is not [`NO_SITE`].
    pub fn new(shape: &[usize], sampling: &[f64]) -> Result<Self> {
        if !(1..=3).contains(&shape.len()) {
            return Err(Error::invalid(format!(
                "the image has {} axes; marching takes 1 to 3, the exact transform any number",
                shape.len()
            )));
        }
        if sampling.len() != shape.len() {
            return Err(Error::invalid(format!("sampling has {} numbers; give one for each of the {} axes", sampling.len(), shape.len())));
        }
        if let Some(step) = sampling.iter().find(|step| !(**step > 0.0 && step.is_finite())) {
            return Err(Error::invalid(format!("sampling holds {step}; every axis needs a positive, finite length")));
        }
        let count = shape.iter().try_fold(1usize, |product, &n| product.checked_mul(n));
        if count.is_none_or(|count| count >= NO_SITE as usize) {
            return Err(Error::invalid(format!(
                "an image of {shape:?} has more than 2^32 - 2 voxels; march it in parts or choose the exact transform"
            )));
        }
        let mut raster = Self { shape: [1; 3], sampling: [1.0; 3] };
        let mut axis = 3;
        for (&n, &step) in shape.iter().zip(sampling).rev().filter(|(n, _)| **n != 1) {
            axis -= 1;
            (raster.shape[axis], raster.sampling[axis]) = (n, step);
        }
        // Steps along axes of length 1 do not matter, but equal steps everywhere are quicker.
        let last = raster.sampling[2];
        raster.sampling[..axis].fill(last);
        Ok(raster)
    }

    /// Refuses marks that are not one for each voxel.
    pub fn check_marks(&self, sites: &[bool]) -> Result<()> {
        if sites.len() == self.len() {
            return Ok(());
        }
        Err(Error::invalid(format!("there are {} marks of sites for {} voxels; give one for each", sites.len(), self.len())))
    }

    /// Number of voxels.
    pub fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// The voxel with linear index `index`.
    #[inline(always)]
    pub fn place(&self, index: u32) -> [u32; 3] {
        let (ny, nz) = (self.shape[1] as u32, self.shape[2] as u32);
        let row = index / nz;
        [row / ny, row % ny, index % nz]
    }

    /// Squared distance of the centres of two voxels; whole where all sampling is 1.
    #[inline(always)]
    pub fn squared(&self, a: [u32; 3], b: [u32; 3]) -> f64 {
        let along = |axis: usize| {
            let steps = f64::from(a[axis]) - f64::from(b[axis]);
            (steps * steps) * (self.sampling[axis] * self.sampling[axis])
        };
        along(0) + along(1) + along(2)
    }
}

/// Refuses a limit that is no length.
pub(crate) fn check_limit(limit: f64) -> Result<()> {
    if limit > 0.0 { Ok(()) } else { Err(Error::invalid(format!("the limit must be a positive length, not {limit}"))) }
}
