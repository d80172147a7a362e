//! Measures that every shape is made from, refused in a sentence where they are none, and what boxes measure.

use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3, Interval};

/// A positive, finite length.
pub(super) fn length(name: &str, value: f64) -> Result<f64> {
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(Error::invalid(format!("{name} is {value}; give a positive length in model units")))
}

/// A finite position.
pub(super) fn point(name: &str, value: DVec3) -> Result<DVec3> {
    if value.is_finite() {
        return Ok(value);
    }
    Err(Error::invalid(format!("{name} is {value}; give three finite numbers")))
}

/// The unit vector along a finite direction that is not zero.
pub(super) fn direction(name: &str, value: DVec3) -> Result<DVec3> {
    // Squares of very long and very short vectors leave the range of numbers.
    let scaled = value / value.abs().max_element();
    if value.is_finite() && scaled.is_finite() {
        return Ok(scaled.normalize());
    }
    Err(Error::invalid(format!("{name} is {value}; give a finite direction that is not zero")))
}

/// The least and greatest distance from `p` to points of the box.
pub(super) fn reach(cell: &Aabb, p: DVec3) -> (f64, f64) {
    let far = (p - cell.min).abs().max((cell.max - p).abs());
    (cell.distance_squared(p).sqrt(), far.length())
}

/// What rounding moves the distance of a shape by, near it.
pub(super) fn rounding(extent: Option<Aabb>) -> f64 {
    16.0 * f64::EPSILON * extent.map_or(1.0, |extent| extent.min.abs().max(extent.max.abs()).max_element())
}

/// How a distance bends that belongs to a convex shape, all points within a radius of a core, where the cell is at least
/// `least` from that core: never downward, upward at most as a circle around its nearest point.
pub(super) fn convex(least: f64) -> Interval {
    Interval { lower: 0.0, upper: if least > 0.0 { (1.0 + 1e-9) / least } else { f64::INFINITY } }
}
