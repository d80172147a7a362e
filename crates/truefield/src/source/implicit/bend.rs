//! How the distance of a formula's surface bends.

use super::matrix::{eigenvalues, middle, middle_of, penalised};
use super::search::Effort;
use super::shape::Implicit;
use super::sheet::{Sheet, Side};
use crate::distance::Distance;
use crate::geom::{Aabb, DVec3, Interval};

/// A point that is tried as foot lies within this part of the domain's diagonal of the surface.
const NEAR: f64 = 1e-10;

/// Contains the second derivatives of the distance over a cell.
///
/// Anywhere off the surface, a distance bends by no more than that of a single point: 1 / distance, away from the shape.
/// More is known where all feet of the cell lie in a box in which |x - p|^2 + 2 a f + b f^2 is convex for each p of the cell
/// and the multiplier a of its foot: then each p has one foot only, the distance is smooth, and its bends are k / (1 + k d)
/// for curvatures k of the surface in that box.
pub(super) fn bend(shape: &Implicit, cell: &Aabb) -> Interval {
    let (center, radius) = (cell.center(), cell.radius() * (1.0 + 1e-12));
    let domain = shape.domain();
    if !(domain.contains(cell.min) && domain.contains(cell.max)) {
        let Interval { lower, upper } = shape.at(center);
        return around_point(lower.max(-upper) - radius, if lower > 0.0 { Side::Outside } else { Side::Inside });
    }
    let Some(side) = shape.side(center) else {
        // The surface runs through the middle.
        return smooth(shape, cell, &Middle { side: None, near: 0.0, far: shape.at(center).upper, foot: center }).unwrap_or(Interval::ALL);
    };
    if side == Side::Inside && is_flat(shape, cell, center, radius) {
        return Interval::exact(0.0);
    }
    let found = shape.search(center, side, Effort::Short);
    let rough = around_point(found.lower - radius, side);
    let Some(foot) = found.foot else { return rough };
    let middle = Middle { side: Some(side), near: found.lower, far: found.upper, foot };
    smooth(shape, cell, &middle).map_or(rough, |bend| bend.intersection(rough))
}

/// What is known of the middle of a cell.
pub(super) struct Middle {
    /// Open where the surface runs through it.
    pub side: Option<Side>,
    /// The surface is no nearer, and no farther.
    pub near: f64,
    pub far: f64,
    /// Where it seems nearest.
    pub foot: DVec3,
}

/// What is known where no point of a shape is nearer than `least`.
fn around_point(least: f64, side: Side) -> Interval {
    match side {
        _ if !(least > 0.0) => Interval::ALL,
        Side::Outside => Interval { lower: f64::NEG_INFINITY, upper: 1.0 / least },
        Side::Inside => Interval { lower: -1.0 / least, upper: f64::INFINITY },
    }
}

/// Whether one and the same face of the domain is nearest in all of a cell.
pub(super) fn is_flat(shape: &Implicit, cell: &Aabb, center: DVec3, radius: f64) -> bool {
    let domain = shape.domain();
    let mut depths = [0.0; 6];
    for axis in 0..3 {
        (depths[2 * axis], depths[2 * axis + 1]) = (center[axis] - domain.min[axis], domain.max[axis] - center[axis]);
    }
    depths.sort_unstable_by(f64::total_cmp);
    let reach = (depths[0] + 2.0 * radius) * (1.0 + 1e-12);
    if depths[1] <= reach {
        return false;
    }
    let boxes = shape.tree();
    let mut pending = vec![0_usize];
    while let Some(node) = pending.pop().and_then(|index| boxes.nodes.get(index)) {
        if node.extent.distance_squared(center) > reach * reach {
            continue;
        }
        let taylor = node.sheet.map(|sheet| &boxes.taylors[sheet as usize]);
        if node.count == 0 && taylor.is_none_or(|taylor| taylor.rough(center, &node.extent) <= reach * reach) {
            return false;
        }
        pending.extend((0..usize::from(node.count)).map(|child| node.first as usize + child));
    }
    domain.contains(cell.min)
}

/// What is known around the feet of a cell whose points have one foot each, and the least and the greatest signed distance.
pub(super) fn one_foot(shape: &Implicit, center: DVec3, radius: f64, middle: &Middle) -> Option<(Sheet, f64, f64)> {
    let domain = shape.domain();
    let &Middle { side, near, far, foot } = middle;
    // The faces of the domain are not surface here.
    if side != Some(Side::Outside) && !(far + radius < shape.depth(center) - radius) {
        return None;
    }
    let within = feet(shape, center, radius, middle)?;
    let strictly = within.min.cmpgt(domain.min).all() && within.max.cmplt(domain.max).all();
    if !strictly {
        return None;
    }
    // Signed distances in the cell.
    let (low, high) = match side {
        Some(Side::Outside) => ((near - radius).max(-(far + radius)), far + radius),
        Some(Side::Inside) => (-far - radius, radius - near),
        None => (-far - radius, far + radius),
    };
    let mut sheet = Sheet::over(shape.tape(), &within);
    let (least, _) = steepness(&sheet)?;
    let multipliers = Interval { lower: low.min(0.0) / least, upper: high.max(0.0) / least };
    if !(is_single(&sheet, multipliers.upper, least) && is_single(&sheet, multipliers.lower, least)) {
        return None;
    }
    // Once each point has one foot, feet lie no farther apart than points, but for what the surface bends.
    if let Some(closer) = closer(shape, &sheet, multipliers, center, radius, foot) {
        sheet = Sheet::over(shape.tape(), &closer);
    }
    Some((sheet, low, high))
}

fn smooth(shape: &Implicit, cell: &Aabb, middle: &Middle) -> Option<Interval> {
    let (sheet, low, high) = one_foot(shape, cell.center(), cell.radius() * (1.0 + 1e-12), middle)?;
    let (least, most) = steepness(&sheet)?;
    let turns = sheet.turns;
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

/// The least and the greatest length of a gradient, where none vanishes and second derivatives are known.
fn steepness(sheet: &Sheet) -> Option<(f64, f64)> {
    let (middle, spread) = middle_of(&sheet.gradient);
    let (least, most) = ((middle.length() - spread) * (1.0 - 1e-14), (middle.length() + spread) * (1.0 + 1e-14));
    (least > 0.0 && sheet.turns.width().is_finite()).then_some((least, most))
}

/// Whether |x - p|^2 + 2 a f + b f^2 is convex for some b, where all gradients are at least that long.
fn is_single(sheet: &Sheet, multiplier: f64, least: f64) -> bool {
    let turns = sheet.turns;
    let weight = (0.5 + multiplier.abs() * turns.upper.max(-turns.lower)) / (least * least);
    convexity(sheet, multiplier) > 0.0
        || eigenvalues(&penalised(&sheet.hessian, multiplier, weight, &sheet.gradient, sheet.value)).lower > 0.0
}

/// No eigenvalue of I + a H is less.
fn convexity(sheet: &Sheet, multiplier: f64) -> f64 {
    let turns = sheet.turns;
    1.0 + (multiplier * turns.lower).min(multiplier * turns.upper) - 1e-14 * (1.0 + multiplier.abs() * turns.upper.max(-turns.lower))
}

/// A smaller box around all feet of a cell, which lie in the box of `sheet` and are one for each point.
///
/// Let q be the foot of x, so that q - x + a g = 0, and q' some point, x' = q' + a' g'. Both |y - x|^2 / 2 + a f(y) and the
/// same of x' and a' are convex, with eigenvalues no less than l. So l |q - q'|^2 <= (x' - x) (q' - q) + (a - a') (g + g') (q' - q) / 2,
/// and that last product differs from f(q') by no more than |q' - q|^2 times half the spread of second derivatives.
fn closer(shape: &Implicit, sheet: &Sheet, multipliers: Interval, center: DVec3, radius: f64, foot: DVec3) -> Option<Aabb> {
    if !sheet.extent.contains(foot) {
        return None;
    }
    let here = shape.tape().jet_over::<0>(&Aabb::new(foot, foot));
    // The true gradient is somewhere near.
    let (slope, doubt) = middle_of(&here.gradient);
    let own = (center - foot).dot(slope) / slope.length_squared();
    let (lower, upper) = (multipliers.lower.min(own), multipliers.upper.max(own));
    let spread = (0..6).map(|k| middle(sheet.hessian[k]).1.powi(2) * if k < 3 { 1.0 } else { 2.0 }).sum::<f64>().sqrt();
    let least = convexity(sheet, lower).min(convexity(sheet, upper)) - 0.5 * (upper - lower) * spread * (1.0 + 1e-12);
    if !(least > 0.0) {
        return None;
    }
    let rounding = 1e-14 * (center.length() + foot.length() + slope.length() * own.abs());
    let apart = (center - (foot + slope * own)).length() + doubt * own.abs() + rounding;
    let value = here.value.upper.max(-here.value.lower);
    let reach = ((radius + apart) / least + ((upper - lower) * value / least).sqrt()) * (1.0 + 1e-9);
    let extent = sheet.extent;
    let closer = Aabb::new((foot - reach).max(extent.min), (foot + reach).min(extent.max));
    closer.min.is_finite().then_some(closer)
}

/// A box around the feet of all points no farther than `radius` from `center`; `None` where that surface is not smooth.
///
/// A point of the surface q can be the foot of center + u only where it is no farther than the known foot q', so that
/// |center - q|^2 - |center - q'|^2 <= 2 u (q - q').
fn feet(shape: &Implicit, center: DVec3, radius: f64, middle: &Middle) -> Option<Aabb> {
    let (boxes, tape, foot) = (shape.tree(), shape.tape(), middle.foot);
    // How far the known foot may be from the surface.
    let doubt = match middle.side {
        None => middle.far,
        Some(_) => {
            let domain = shape.domain();
            let step = NEAR * domain.diagonal();
            let way = tape.gradient(foot).normalize_or_zero() * step;
            let side = |p: DVec3| if domain.contains(p) { Side::of(tape.certain(p)) } else { None };
            let (inner, outer) = (side(foot - way)?, side(foot + way)?);
            if inner == outer {
                return None;
            }
            2.0 * step
        }
    };
    let known = (center - foot).length() * (1.0 + 1e-14);
    let more = known * known + 2.0 * doubt * (known + radius) + doubt * doubt;
    let limit = |extent: &Aabb| {
        let widest = (extent.max - foot).max(foot - extent.min).length();
        (more + 2.0 * radius * widest) * (1.0 + 1e-13)
    };
    let mut around = Aabb::EMPTY;
    let mut pending = vec![0_usize];
    while let Some(index) = pending.pop() {
        let node = boxes.nodes.get(index)?;
        let limit = limit(&node.extent);
        if node.extent.distance_squared(center) > limit {
            continue;
        }
        if node.count > 0 {
            pending.extend((0..usize::from(node.count)).map(|child| node.first as usize + child));
            continue;
        }
        let taylor = &boxes.taylors[node.sheet? as usize];
        if taylor.rough(center, &node.extent) <= limit && taylor.least(center, &node.extent).0 <= limit {
            around = around.union(node.extent);
        }
    }
    (around != Aabb::EMPTY).then_some(around)
}
