//! What a coarser cell says beside finer ones.

use super::cubic;
use super::page::{Record, Samples};
use super::{Division, cubic_third};
use crate::geom::{DVec3, Interval};

/// Contains what a child's corners say minus what its parent's say: both are trilinear in the child, so that corners decide.
pub(crate) fn differences(parent: &Record, child: &[f32; 8], division: Division, octant: usize) -> Interval {
    let at = |corner: usize| {
        DVec3::from_array(std::array::from_fn(|axis| {
            let bit = (corner >> axis & 1) as f64;
            if axis < division.axes() { 0.5 * ((octant >> axis & 1) as f64 + bit) } else { bit }
        }))
    };
    let apart = (0..8).map(|corner| Interval::exact(f64::from(child[corner]) - parent.value(at(corner))));
    apart.reduce(Interval::hull).unwrap_or(Interval::ALL)
}

/// Contains the distance minus the interpolated corners, for a leaf with or without tricubic samples.
pub(crate) fn about_corners(record: &Record, samples: Option<&Samples>) -> Interval {
    let Some(samples) = samples else { return record.error() };
    let apart: Samples = std::array::from_fn(|n| (f64::from(samples[n]) - record.value(cubic_third(n))) as f32);
    let (lower, upper) = cubic::range(&apart);
    // The differences are rounded, which comes back up to threefold between samples along every axis.
    let rounding = 27.0 * f64::from(f32::EPSILON) * samples.iter().fold(0.0, |size: f64, v| size.max(f64::from(v.abs())));
    record.error().plus(Interval { lower, upper }).widen(rounding)
}
