//! Affine functions on boxes.

use super::DVec3;

/// A function of constant slope on a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    /// In the middle of the box.
    pub value: f64,
    /// Its gradient.
    pub slope: DVec3,
}

impl Affine {
    /// The same everywhere.
    pub const fn constant(value: f64) -> Self {
        Self { value, slope: DVec3::ZERO }
    }

    /// The least value within half edges of the middle, along each axis.
    #[inline]
    pub fn least(&self, half: DVec3) -> f64 {
        self.value - self.slope.abs().dot(half)
    }

    /// Of two lower bounds in a box of this radius the one that is higher in the middle: this one, or the same everywhere.
    /// At a point, which has no radius, the slope is kept.
    #[must_use]
    pub fn or_constant(self, least: f64, radius: f64) -> Self {
        if radius == 0.0 {
            Self { value: self.value.max(least), ..self }
        } else if self.value > least {
            self
        } else {
            Self::constant(least)
        }
    }

    /// `self` and `other` by parts of one.
    #[must_use]
    pub fn mix(&self, other: &Self, part: f64) -> Self {
        Self { value: self.value * (1.0 - part) + other.value * part, slope: self.slope * (1.0 - part) + other.slope * part }
    }
}
