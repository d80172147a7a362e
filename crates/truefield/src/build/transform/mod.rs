//! Exact distance transforms of images: each voxel's distance to the nearest site, in any number of dimensions.
//!
//! A site is a voxel of the background, of the other side or of another label. Squared distances are separable: one
//! pass along each axis, the contiguous one by runs ([`scan`]), the others as lower envelopes of sixteen columns
//! at once ([`panel`]). They are whole numbers, kept in the output itself, wherever the spacings are whole multiples of a
//! common unit and the squares fit 31 bits, and double precision elsewhere; so nothing is rounded before the root.
//! Saito and Toriwaki 1994; Felzenszwalb and Huttenlocher 2012.
//!
//! Whole jobs over flat arrays, first axis slowest: the seam at which another engine can take over.

mod columns;
mod cost;
mod finish;
mod image;
mod indices;
mod panel;
mod passes;
mod scan;
mod skewed;
mod value;

pub use image::Image;
pub use indices::{Index, indices};
pub use skewed::Skewed;
pub use value::Site;

use crate::error::{Error, Result};
use crate::run::Run;
use cost::Reach;
use finish::{Finish, Rounding};
use image::Reading;

/// Which voxels distances go to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// Zeros: they have distance 0.
    Background,
    /// Values that are not zero: they have distance 0.
    Foreground,
    /// Zeros for the foreground, others for the background: signed distances, negative in the foreground.
    OtherSide,
    /// Voxels of any other value.
    OtherLabel,
}

/// What lies beyond the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Border {
    /// Nothing that distances could go to.
    Nothing,
    /// Background: zeros.
    Background,
    /// Foreground: values that are not zero; with [`Target::OtherLabel`], a label of its own.
    Foreground,
}

/// Where the surface of a site lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// In its centre.
    Centers,
    /// In the faces between it and its neighbours: distances go to the nearest point of its voxel.
    Between,
}

/// What is asked of a transform.
#[derive(Clone, Copy, Debug)]
pub struct Transform<'a> {
    /// The voxels, row-major.
    pub image: Image<'a>,
    /// Number of voxels along each axis.
    pub shape: &'a [usize],
    /// Distance of neighbouring voxels along each axis.
    pub spacing: &'a [f64],
    /// Which axes begin again where they end.
    pub periodic: &'a [bool],
    /// Which voxels distances go to.
    pub target: Target,
    /// What lies beyond the image, along axes that are not periodic.
    pub border: Border,
    /// Where the surface of a site lies.
    pub measure: Measure,
    /// Bytes that it may take beside its output.
    pub memory: u64,
}

impl Target {
    /// The border that is a site to all voxels.
    fn border(self) -> Border {
        if self == Self::Foreground { Border::Foreground } else { Border::Background }
    }

    /// How voxels are read where both sides have distances.
    fn reading(self) -> Option<Reading> {
        match self {
            Self::Background | Self::Foreground => None,
            Self::OtherSide => Some(Reading::Foreground),
            Self::OtherLabel => Some(Reading::Label),
        }
    }
}

impl Border {
    /// Whether voxels of a label see a site beyond the border.
    fn ends(self, label: u32, target: Target) -> bool {
        match self {
            Self::Nothing => false,
            Self::Background => label != 0,
            Self::Foreground => label == 0 || target == Target::OtherLabel,
        }
    }
}

impl Transform<'_> {
    /// Writes the distance of every voxel to its nearest site, infinite where there is none.
    ///
    /// `sites` gets the flat index of that site, the lowest of equals, and [`Site::NONE`] where there is none or it is the border.
    /// Distances are the exact ones rounded to single precision (to rounding in double precision, where
    /// spacings have no common unit). Takes no memory beside the output but scratch of some MiB for each
    /// thread and 8 bytes a voxel where spacings have no common unit.
    pub fn distance<S: Site>(&self, out: &mut [f32], sites: Option<&mut [S]>, run: &Run<'_>) -> Result<()> {
        let reach = match self.measure {
            Measure::Centers => Reach::Centre,
            Measure::Between => Reach::Near,
        };
        if let Some(sites) = &sites
            && (sites.len() != out.len() || out.len() as u64 > 1 << (8 * size_of::<S>() - 1))
        {
            return Err(Error::invalid(format!("{} indices of sites do not serve {} voxels", sites.len(), out.len())));
        }
        self.squares(reach, Rounding::Nearest, out, sites, run)
    }

    /// Writes bounds of every voxel's distance to the surface that the image stands for, whatever rule made voxels of it.
    ///
    /// With one kind of site, they hold for each surface that stays within the voxels of sites and meets each of them
    /// that has a neighbour which is none. With sides or labels, for each that stays within the voxels that have
    /// a neighbour (across faces, edges or corners) of another label, and has a point of another label within each voxel.
    /// They are rounded outward, and the closest such bounds there are.
    pub fn bounds(&self, lower: &mut [f32], upper: &mut [f32], run: &Run<'_>) -> Result<()> {
        let near = if self.target.reading().is_some() { Reach::Neighbourhood } else { Reach::Near };
        self.squares(near, Rounding::Down, lower, None::<&mut [u32]>, run)?;
        self.squares(Reach::Far, Rounding::Up, upper, None::<&mut [u32]>, run)?;
        if self.target == Target::OtherSide {
            // Inside, distances are negative and bounds change places.
            let length = 1 << 16;
            let pairs: Vec<_> = lower.chunks_mut(length).zip(upper.chunks_mut(length)).map(std::sync::Mutex::new).collect();
            run.blocks("bounds", pairs.len(), |index| {
                let mut pair = pairs[index].lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                let (lower, upper) = &mut *pair;
                for (low, high) in lower.iter_mut().zip(upper.iter_mut()) {
                    if low.is_sign_negative() {
                        std::mem::swap(low, high);
                    }
                }
                Ok(())
            })?;
        }
        Ok(())
    }

    /// The distances to one part of the sites' voxels.
    fn squares<S: Site>(&self, to: Reach, rounding: Rounding, out: &mut [f32], sites: Option<&mut [S]>, run: &Run<'_>) -> Result<()> {
        self.check(out.len())?;
        if out.is_empty() {
            return Ok(());
        }
        let border = self.border != Border::Nothing;
        let reaches: Vec<usize> =
            self.shape.iter().zip(self.periodic).map(|(&length, &periodic)| cost::reach(length, periodic, border)).collect();
        if let Some(steps) = cost::whole(self.spacing, &reaches, to) {
            let axes = cost::axes::<u32>(self.shape, self.periodic, &reaches, &steps.factors, to);
            let finish = Finish { unit: steps.unit, rounding };
            passes::whole(self, &axes, finish, out, sites, run)
        } else {
            let needed = 8 * out.len() as u64;
            if needed > self.memory {
                let what = format!("the squared distances of {} voxels whose spacings have no common unit", out.len());
                return Err(Error::Memory { what, needed, allowed: self.memory });
            }
            let halves: Vec<f64> = self.spacing.iter().map(|s| s / 2.0).collect();
            let axes = cost::axes::<f64>(self.shape, self.periodic, &reaches, &halves, to);
            passes::double(self, &axes, Finish { unit: 1.0, rounding }, out, sites, run)
        }
    }

    fn check(&self, out: usize) -> Result<()> {
        let axes = self.shape.len();
        let voxels = self.shape.iter().try_fold(1usize, |all, &n| all.checked_mul(n));
        if axes == 0 || self.spacing.len() != axes || self.periodic.len() != axes {
            return Err(Error::invalid(format!("an image of {axes} axes needs as many spacings and as many answers to what is periodic")));
        }
        if voxels != Some(self.image.len()) || voxels != Some(out) {
            return Err(Error::invalid(format!(
                "an image of shape {:?} has not {} voxels for {out} distances",
                self.shape,
                self.image.len()
            )));
        }
        if let Some(spacing) = self.spacing.iter().find(|s| !(s.is_finite() && **s > 0.0)) {
            return Err(Error::invalid(format!("the sampling is {spacing} along an axis; give positive lengths")));
        }
        if self.target == Target::OtherLabel && !self.image.has_labels() {
            return Err(Error::invalid("labels are whole numbers of at most 32 bits; number them first"));
        }
        Ok(())
    }
}
