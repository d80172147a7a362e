//! How the distance of a formula's surface bends.

use super::boxes::halves;
use super::matrix::{eigenvalues, middle_of, penalised};
use super::shape::Implicit;
use super::sheet::Side;
use crate::distance::Distance;
use crate::geom::{Aabb, DVec3, Interval};

/// Contains the second derivatives of the distance over a cell.
///
/// Anywhere off the surface, a distance bends by no more than that of a single point: 1 / distance, away from the shape.
/// More is known where all feet of the cell lie in a box in which |x - p|^2 + 2 a f + b f^2 is convex for each p of the cell
/// and the multiplier a of its foot: then each p has one foot only, the distance is smooth, and its bends are k / (1 + k d)
/// for curvatures k of the surface in that box.
pub(super) fn bend(shape: &Implicit, cell: &Aabb) -> Interval {
    let (center, radius) = (cell.center(), cell.radius() * (1.0 + 1e-12));
    let at = shape.at(center);
    let range = at.widen(radius);
    let rough = if range.lower > 0.0 {
        Interval { lower: f64::NEG_INFINITY, upper: 1.0 / range.lower }
    } else if range.upper < 0.0 {
        Interval { lower: 1.0 / range.upper, upper: f64::INFINITY }
    } else {
        Interval::ALL
    };
    smooth(shape, cell, center, radius).map_or(rough, |bend| bend.intersection(rough))
}

fn smooth(shape: &Implicit, cell: &Aabb, center: DVec3, radius: f64) -> Option<Interval> {
    let domain = shape.domain();
    if !(domain.contains(cell.min) && domain.contains(cell.max)) {
        return None;
    }
    // Where the side of the middle is open, the surface runs through it.
    let (side, near, far) = match Side::of(shape.tape().certain(center)) {
        Some(side) => {
            let found = shape.search(center, side);
            (Some(side), found.lower, found.upper)
        }
        None => (None, 0.0, shape.at(center).upper),
    };
    // The faces of the domain are not surface here.
    if !(far + radius < shape.depth(center) - radius) {
        return None;
    }
    // The feet of the cell reach about this far from that of its middle.
    let fine = radius.max(0.5 * (radius * far).sqrt());
    let feet = feet(shape, center, far + 2.0 * radius, fine)?;
    let strictly = feet.min.cmpgt(domain.min).all() && feet.max.cmplt(domain.max).all();
    if !strictly {
        return None;
    }
    let jet = shape.tape().jet_over::<6>(&feet);
    let (middle, spread) = middle_of(&jet.gradient);
    let (least, most) = (middle.length() - spread, middle.length() + spread);
    let turns = eigenvalues(&jet.hessian);
    if !(least > 0.0) || !turns.width().is_finite() {
        return None;
    }
    // Signed distances in the cell.
    let (low, high) = match side {
        Some(Side::Outside) => ((near - radius).max(-(far + radius)), far + radius),
        Some(Side::Inside) => (-far - radius, radius - near),
        None => (-far - radius, far + radius),
    };
    let (outside, inside) = (high.max(0.0) / least, (-low).max(0.0) / least);
    let single = |multiplier: f64| {
        let weights = [0.0, (0.5 + multiplier.abs() * turns.upper.max(-turns.lower)) / (least * least)];
        weights.into_iter().any(|weight| eigenvalues(&penalised(&jet.hessian, multiplier, weight, &jet.gradient, jet.value)).lower > 0.0)
    };
    if !(single(outside) && single(-inside)) {
        return None;
    }
    let curvature = Interval { lower: (turns.lower / least).min(turns.lower / most), upper: (turns.upper / least).max(turns.upper / most) };
    let (below, above) = (1.0 + curvature.lower * high.max(0.0), 1.0 + curvature.upper * low.min(0.0));
    if !(below > 0.0 && above > 0.0) {
        return None;
    }
    // k / (1 + k d) grows with k and falls with d; along the normal, a distance does not bend.
    let lower = (curvature.lower / (1.0 + curvature.lower * high)).min(0.0);
    let upper = (curvature.upper / (1.0 + curvature.upper * low)).max(0.0);
    Some(Interval { lower, upper }.widen(1e-12 * (upper - lower)))
}

/// The most boxes that feet are looked for in.
const BOXES: usize = 512;

/// A box around all surface within `reach` of `p`, found by boxes no larger than `fine`; `None` where that is not smooth.
fn feet(shape: &Implicit, p: DVec3, reach: f64, fine: f64) -> Option<Aabb> {
    let boxes = shape.tree();
    let square = reach * reach;
    let mut around = Aabb::EMPTY;
    let mut looked = 0;
    let mut pending = vec![0_usize];
    let mut parts = Vec::new();
    while let Some(index) = pending.pop() {
        let node = boxes.nodes.get(index)?;
        if node.extent.distance_squared(p) > square {
            continue;
        }
        if node.count > 0 {
            pending.extend((0..usize::from(node.count)).map(|child| node.first as usize + child));
            continue;
        }
        parts.push((node.extent, std::borrow::Cow::Borrowed(&boxes.sheets[node.sheet? as usize])));
        while let Some((extent, sheet)) = parts.pop() {
            if sheet.least(p, &extent).0 > square {
                continue;
            }
            looked += 1;
            if looked > BOXES {
                return None;
            }
            if extent.size().max_element() <= fine {
                around = around.union(extent);
            } else if !(around.contains(extent.min) && around.contains(extent.max)) {
                parts.extend(halves(&extent).into_iter().map(|part| (part, std::borrow::Cow::Owned(sheet.part(shape.tape(), &part)))));
            }
        }
    }
    (looked > 0).then_some(around)
}
