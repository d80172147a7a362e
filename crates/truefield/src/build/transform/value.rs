//! The number in which squared distances are kept between passes.

use crate::simd::Fuse;

/// Columns that are worked on at once.
pub(super) const LANES: usize = 16;

/// One row of a panel.
pub(super) type Row<V> = [V; LANES];

/// A squared distance: whole multiples of a unit where the spacing allows, double precision elsewhere.
pub(super) trait Value: Copy + Default + PartialOrd + Send + Sync + 'static {
    /// No site at all. Adding any cost to it gives nothing smaller and does not overflow.
    const FAR: Self;

    fn plus(self, other: Self) -> Self;

    /// A squared distance in units; callers see to it that it fits.
    fn of(square: f64) -> Self;

    fn to_f64(self) -> f64;

    /// Whether a lane is above `limit`.
    fn any_above<F: Fuse>(row: &Row<Self>, limit: Self) -> bool;

    /// Whether a lane is at `limit` or above; a lane at a limit of zero may be overlooked.
    fn any_from<F: Fuse>(row: &Row<Self>, limit: Self) -> bool;
}

impl Value for u32 {
    const FAR: Self = 1 << 31;

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        // Never wraps: values are at most FAR and costs below it.
        self.wrapping_add(other)
    }

    fn of(square: f64) -> Self {
        square as Self
    }

    #[inline(always)]
    fn to_f64(self) -> f64 {
        if self >= Self::FAR { f64::INFINITY } else { f64::from(self) }
    }

    #[inline(always)]
    fn any_above<F: Fuse>(row: &Row<Self>, limit: Self) -> bool {
        F::any_above(row, limit)
    }

    #[inline(always)]
    fn any_from<F: Fuse>(row: &Row<Self>, limit: Self) -> bool {
        F::any_above(row, limit.saturating_sub(1))
    }
}

impl Value for f64 {
    const FAR: Self = Self::INFINITY;

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self + other
    }

    fn of(square: f64) -> Self {
        square
    }

    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }

    #[inline(always)]
    fn any_above<F: Fuse>(row: &Row<Self>, limit: Self) -> bool {
        let mut any = false;
        for &value in row {
            any |= value > limit;
        }
        any
    }

    #[inline(always)]
    fn any_from<F: Fuse>(row: &Row<Self>, limit: Self) -> bool {
        let mut any = false;
        for &value in row {
            any |= value >= limit;
        }
        any
    }
}

/// The flat index of a site, 32 bits where the image allows.
pub trait Site: Copy + Default + Send + Sync + 'static {
    /// There is no site, or it is the border.
    const NONE: Self;

    /// An index that is known to fit.
    fn of(index: usize) -> Self;

    /// The flat index, unless it is [`Site::NONE`].
    fn flat(self) -> Option<usize>;
}

impl Site for u32 {
    const NONE: Self = Self::MAX;

    fn of(index: usize) -> Self {
        index as Self
    }

    fn flat(self) -> Option<usize> {
        (self != Self::NONE).then_some(self as usize)
    }
}

impl Site for u64 {
    const NONE: Self = Self::MAX;

    fn of(index: usize) -> Self {
        index as Self
    }

    fn flat(self) -> Option<usize> {
        (self != Self::NONE).then_some(self as usize)
    }
}
