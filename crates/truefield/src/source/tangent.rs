//! Affine functions below distances, by the gradient in the middle of a box and how values bend in it.

use crate::distance::Source;
use crate::geom::{Aabb, Affine, DVec3};

/// By so much of the coordinates gradients step that are differences.
const STEP: f64 = 1e-5;

/// [`Distance::below`](crate::distance::Distance::below) of a shape, where its slope does not jump in the box, nor does its
/// distance lie below its values by an unknown length; else the least distance.
pub(crate) fn below(shape: &dyn Source, cell: &Aabb) -> Affine {
    let least = shape.over(cell).lower;
    tangent(shape, cell).map_or(Affine::constant(least), |tangent| tangent.or_constant(least, cell.radius()))
}

fn tangent(shape: &dyn Source, cell: &Aabb) -> Option<Affine> {
    let bend = shape.bend(cell);
    let most = bend.upper.max(-bend.lower);
    if !most.is_finite() {
        return None;
    }
    let slack = shape.slack(cell).lower;
    let (center, radius) = (cell.center(), cell.radius() * (1.0 + 1e-12));
    let (mut value, mut slope) = ([0.0], [DVec3::ZERO]);
    shape.values(&[center], &mut value).ok()?;
    shape.gradients(&[center], &mut slope).ok()?;
    let (value, slope) = (value[0], slope[0]);
    let size = center.abs().max_element().max(value.abs()).max(shape.extent().map_or(1.0, |extent| extent.diagonal()));
    // What bends beyond the box, where differences step, is not known.
    if radius > 0.0 && radius < STEP * size {
        return None;
    }
    let tilt = shape.tilt(center);
    if !tilt.is_finite() {
        return None;
    }
    let off = radius * (tilt + STEP * size * most.max(0.0)).min(2.0) + 2.0 * shape.noise_over(cell) + 8.0 * f64::EPSILON * size;
    let value = value + slack.min(0.0) + 0.5 * bend.lower.min(0.0) * radius * radius - off;
    (value.is_finite() && slope.is_finite()).then_some(Affine { value, slope })
}
