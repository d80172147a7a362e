//! How far the direction in which a distance is said to grow may be from the true one.

use super::bend::{Middle, is_flat, one_foot};
use super::matrix::middle_of;
use super::search::Effort;
use super::shape::Implicit;
use super::sheet::Side;
use crate::geom::{Aabb, DVec3};

/// What normalising leaves.
const ROUNDING: f64 = 1e-15;

/// No less than the length of what the said direction at `p` and the distance's gradient differ by; infinite where that is
/// not proven, or the value may be farther from the distance than the noise.
///
/// A distance grows along the gradient of the formula at the foot of `p`: intervals hold it in all of a box in which the
/// only foot lies.
pub(super) fn tilt(shape: &Implicit, p: DVec3) -> f64 {
    proven(shape, p).unwrap_or(f64::INFINITY)
}

fn proven(shape: &Implicit, p: DVec3) -> Option<f64> {
    let domain = shape.domain();
    if !domain.contains(p) {
        return (shape.side(p.clamp(domain.min, domain.max)) == Some(Side::Inside)).then_some(ROUNDING);
    }
    let side = shape.side(p);
    let middle = match side {
        None => Middle { side, near: 0.0, far: crate::distance::Distance::at(shape, p).upper, foot: p },
        Some(known) => {
            let found = shape.search(p, known, Effort::Short);
            match found.foot {
                // The nearest face of the domain.
                None => return is_flat(shape, &Aabb::new(p, p), p, 0.0).then_some(ROUNDING),
                Some(foot) => Middle { side, near: found.lower, far: found.upper, foot },
            }
        }
    };
    if !(middle.far - middle.near <= crate::distance::Source::noise(shape)) {
        return None;
    }
    let (sheet, ..) = one_foot(shape, p, 0.0, &middle)?;
    let (slope, spread) = middle_of(&sheet.gradient);
    let size = slope.length();
    if !(spread <= 0.5 * size) {
        return None;
    }
    // Directions of two vectors differ by no more than twice what they differ by, over the length of one.
    let tilt = (shape.direction(p) - slope / size).length() + 2.0 * spread / size + ROUNDING;
    tilt.is_finite().then_some(tilt)
}
