//! How near to the truth a tree was asked to be.

use super::MAX_DEPTH;
use crate::error::{Error, Result};

/// When a cell says enough.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// When its error is proven to be small enough.
    Verified,
    /// When the paper's 19 samples, its centre and those of its edges and faces, are near enough. Quicker and
    /// coarser; bounds stay proven, and may be wider than what was asked for.
    Samples,
}

/// What was asked of a tree, and what edits of it go on to ask.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accuracy {
    /// Largest error at the surface, a length.
    pub tolerance: f64,
    /// How much the error may grow per unit of distance from the surface; may be infinite.
    pub growth: f64,
    /// No cell is divided at this depth, whatever its error.
    pub max_depth: u32,
    /// When a cell says enough.
    pub rule: Rule,
}

impl Accuracy {
    /// Refuses what cannot be asked for.
    pub(crate) fn check(&self) -> Result<()> {
        if !(self.tolerance > 0.0 && self.tolerance.is_finite()) {
            return Err(Error::invalid(format!("the tolerance is {}; give a positive length", self.tolerance)));
        }
        if !(self.growth >= 0.0) {
            return Err(Error::invalid(format!("the growth is {}; give 0 or more, or infinity for the surface only", self.growth)));
        }
        if self.max_depth > MAX_DEPTH {
            return Err(Error::invalid(format!("max_depth is {}; give at most {MAX_DEPTH}", self.max_depth)));
        }
        Ok(())
    }

    /// The largest error of a cell no point of which is nearer to the surface than `least`.
    pub(crate) fn allowed(&self, least: f64) -> f64 {
        if least > 0.0 { self.tolerance + self.growth * least } else { self.tolerance }
    }
}
