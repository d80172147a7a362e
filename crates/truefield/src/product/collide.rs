//! Whether two solids meet, how far they are apart or how deep they overlap, and where: branch and bound over boxes.
//!
//! Let m be the least of max(f, g) over all points, f and g the signed distances of the solids. If m > 0 they are apart, and
//! the way from one to the other is 2 m: its middle is m from both, and no point is nearer than m to both, or the way by it
//! would be shorter. If m < 0 they overlap, and a ball of radius -m about the deepest common point lies in both.
//!
//! In a box, the greater of f and g is nowhere less than any mean of both. Where each is bounded by an affine function, the best
//! mean is found among a few: across a gap the slopes are opposite and cancel, so that large boxes tell how wide it is.

use std::collections::BinaryHeap;

use super::clearance::{Clearance, Patience, clearance};
use crate::distance::Distance;
use crate::error::{Error, Result};
use crate::geom::{Aabb, Affine, DVec3, Interval};
use crate::run::Run;
use crate::source::waiting::Waiting;

/// Boxes that are divided at a time: the result depends on it, and not on the number of threads.
const BATCH: usize = 64;

/// Boxes that any search may ask about.
const LEAST: usize = 4096;

/// Boxes before it is asked what the solids themselves leave open.
const SURE: usize = 2048;

/// Boxes that are larger than what is open by this may tell more when they are divided; such that are smaller by this not.
pub(super) const COARSE: f64 = 1.0;
pub(super) const FINE: f64 = 0.25;

/// What division has to raise a bound by, of what is open.
pub(super) const GAIN: f64 = 0.1;

/// Steps that lead to a witness on a surface.
const STEPS: usize = 60;

/// Halvings of a way that crosses a surface.
const HALVINGS: usize = 40;

/// What is certain of two solids.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contact {
    /// No point belongs to both.
    Separated,
    /// They share inner points.
    Penetrating,
    /// To the tolerance, or to what the solids themselves leave open, it cannot be said.
    Undecided,
}

/// How two solids lie to each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collision {
    /// What is certain.
    pub contact: Contact,
    /// Contains the separation, model units: the length of the way from one solid to the other, or, negative, the radius of the
    /// largest ball that lies in both.
    pub separation: Interval,
    /// Of solids that are apart, the end of the shortest way on the first; else the deepest common point found.
    pub first: DVec3,
    /// The same on the second.
    pub second: DVec3,
    /// Boxes that were asked about.
    pub boxes: usize,
}

/// Finds how two solids lie to each other, to `tolerance`, asking about no more than `budget` boxes.
///
/// The interval contains the truth however early the search ends, and is no wider than `tolerance` where the budget was enough
/// and the solids are exact; where they leave more open, it ends when asking on tells no more. Of solids that tell no slope
/// ([`Distance::below`]) the number of boxes grows with the square of the size of surfaces in parallel over the tolerance. Refuses
/// two solids without an end, and a tolerance that is no positive length.
pub fn collide(f: &dyn Distance, g: &dyn Distance, tolerance: f64, budget: usize, run: &Run<'_>) -> Result<Collision> {
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(Error::invalid(format!("the tolerance is {tolerance}; give a positive length")));
    }
    let start = domain(f, g)?;
    let apart = clearance(f, g, &start, tolerance, budget / 2, run)?;
    let mut best = Best::new(&apart);
    if apart.lower > 0.0 {
        let known = Interval { lower: apart.lower.min(best.way), upper: best.way };
        return Ok(best.collision(f, g, known, &start, apart.boxes));
    }
    // The middle of the shortest way, and each point of both, is no farther from either than half of such a way.
    let reach = (0.5 * best.way).min(start.diagonal()) + 1e-9 * start.diagonal();
    let near = [f, g].map(|solid| solid.enclosure().map_or(start, |enclosure| enclosure.grow(reach)));
    let both = Aabb::new(near[0].min.max(near[1].min), near[0].max.min(near[1].max));
    if both.min.cmpgt(both.max).any() {
        return Ok(best.collision(f, g, Interval { lower: 0.0, upper: best.way }, &start, apart.boxes));
    }
    let first = Asked::of(f, g, &both, best.least());
    best.offer(&first);
    let mut heap = BinaryHeap::from([Waiting { bound: first.lower, number: 0, item: (both, f64::NEG_INFINITY) }]);
    let (mut boxes, mut patience) = (apart.boxes + 1, Patience::new(LEAST));
    loop {
        let floor = heap.peek().map_or(best.least(), |first| first.bound).min(best.least());
        let known = best.separation(floor);
        run.progress.report("search for contact", boxes.min(budget), budget);
        let decided = known.lower > 0.0 || known.upper < 0.0 || boxes >= apart.boxes + LEAST;
        let in_doubt = boxes >= apart.boxes + SURE && heap.peek().is_some_and(|first| in_doubt(f, g, first, known.width()));
        let told = known.width() <= tolerance && decided || in_doubt || heap.is_empty();
        if told || boxes >= budget || patience.ends(boxes, known.width()) {
            return Ok(best.collision(f, g, known, &start, boxes));
        }
        let mut batch = Vec::with_capacity(8 * BATCH);
        while batch.len() < 8 * BATCH
            && let Some(candidate) = heap.pop()
        {
            if candidate.bound > best.least() {
                heap.clear();
                break;
            }
            let Some(parts) = octants(&candidate.item.0) else {
                heap.push(candidate);
                break;
            };
            batch.extend(parts.map(|part| (part, candidate.bound)));
        }
        if batch.is_empty() {
            return Ok(best.collision(f, g, known, &start, boxes));
        }
        let found = run.blocks("search for contact", batch.len().div_ceil(8), |block| {
            let extents = &batch[8 * block..(8 * block + 8).min(batch.len())];
            Ok(extents.iter().map(|(extent, _)| Asked::of(f, g, extent, best.least())).collect::<Vec<_>>())
        })?;
        for (&item, asked) in batch.iter().zip(found.into_iter().flatten()) {
            best.offer(&asked);
            if asked.lower <= best.least() {
                heap.push(Waiting { bound: asked.lower, number: boxes, item });
            }
            boxes += 1;
        }
    }
}

/// Whether what is open comes from what the solids themselves leave open in a box, and not from its size.
fn in_doubt(f: &dyn Distance, g: &dyn Distance, first: &Waiting<(Aabb, f64)>, gap: f64) -> bool {
    let (extent, before) = first.item;
    let (center, size) = (extent.center(), extent.diagonal());
    size <= COARSE * gap && first.bound - before <= GAIN * gap && (size < FINE * gap || gap <= f.at(center).width() + g.at(center).width())
}

/// What is known of a box.
struct Asked {
    /// No more than max(f, g) anywhere in it.
    lower: f64,
    center: DVec3,
    /// No less than max(f, g) in the middle.
    upper: f64,
    /// No less than the way from one solid to the other by the middle.
    way: f64,
}

impl Asked {
    /// Asks no more than is needed to see that a box has nothing below `enough`. Only ranges tell where sides may jump.
    fn of(f: &dyn Distance, g: &dyn Distance, extent: &Aabb, enough: f64) -> Self {
        let center = extent.center();
        let (a, b) = (f.at(center), g.at(center));
        let mut lower = f.over(extent).lower.max(g.over(extent).lower);
        if lower <= enough {
            lower = lower.max(least_of_greater(&f.below(extent), &g.below(extent), 0.5 * extent.size()));
        }
        Self { lower, center, upper: a.upper.max(b.upper), way: a.upper.max(0.0) + b.upper.max(0.0) }
    }
}

/// No more than the greater of two affine functions anywhere in a box of these half edges: the best that their means tell.
fn least_of_greater(f: &Affine, g: &Affine, half: DVec3) -> f64 {
    // The least of a mean is concave in its parts, with kinks where a slope vanishes.
    let kinks = f.slope / (f.slope - g.slope);
    let parts = [0.0, 1.0].into_iter().chain(kinks.to_array().into_iter().filter(|part| (0.0..=1.0).contains(part)));
    let least = parts.map(|part| f.mix(g, part).least(half)).fold(f64::NEG_INFINITY, f64::max);
    // For rounding.
    least - 1e-14 * (f.value.abs() + g.value.abs() + half.length())
}

/// The best of all points asked.
struct Best {
    /// Least upper end of max(f, g).
    upper: f64,
    at: DVec3,
    /// Least upper end of the way from one to the other.
    way: f64,
    /// Between which points it leads.
    ends: [DVec3; 2],
}

impl Best {
    /// Only a way is known.
    fn new(apart: &Clearance) -> Self {
        Self { upper: f64::INFINITY, at: apart.ends[0], way: apart.upper, ends: apart.ends }
    }

    fn offer(&mut self, asked: &Asked) {
        if asked.upper < self.upper {
            (self.upper, self.at) = (asked.upper, asked.center);
        }
        if asked.way < self.way {
            (self.way, self.ends) = (asked.way, [asked.center; 2]);
        }
    }

    /// No less than the least of max(f, g): half of a way, too.
    fn least(&self) -> f64 {
        self.upper.min(0.5 * self.way)
    }

    /// What is known of the separation, if max(f, g) is nowhere below `floor`.
    fn separation(&self, floor: f64) -> Interval {
        let lower = if floor > 0.0 { 2.0 * floor } else { floor };
        let upper = if self.upper > 0.0 { (2.0 * self.upper).min(self.way) } else { self.upper };
        Interval { lower: lower.min(upper), upper }
    }

    fn collision(&self, f: &dyn Distance, g: &dyn Distance, separation: Interval, start: &Aabb, boxes: usize) -> Collision {
        let contact = if separation.lower > 0.0 {
            Contact::Separated
        } else if separation.upper < 0.0 {
            Contact::Penetrating
        } else {
            Contact::Undecided
        };
        let (first, second) = if contact == Contact::Separated {
            let step = 1e-6 * start.diagonal();
            (foot(f, self.ends[0], step, STEPS), foot(g, self.ends[1], step, STEPS))
        } else {
            (self.at, self.at)
        };
        Collision { contact, separation, first, second, boxes }
    }
}

/// A point of the surface, by going against the slope as far as the distance says.
pub(super) fn foot(f: &dyn Distance, from: DVec3, step: f64, steps: usize) -> DVec3 {
    let value = |p: DVec3| {
        let known = f.at(p);
        0.5 * known.lower + 0.5 * known.upper
    };
    let (mut at, mut distance) = (from, value(from));
    for _ in 0..steps {
        if distance.abs() < 1e-3 * step {
            break;
        }
        let slope = |axis: DVec3| value(at + axis * step) - value(at - axis * step);
        // What fields know needs no steps, which their errors would spoil.
        let known = f.below(&Aabb::new(at, at)).slope.try_normalize();
        let steps = || DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z)).try_normalize();
        let Some(direction) = known.or_else(steps) else { break };
        let next = at - direction * distance;
        let there = value(next);
        if (there < 0.0) != (distance < 0.0) && there.abs() > step {
            // Beyond an edge: the surface lies on the way.
            return crossing(&value, at, next);
        }
        // On a ridge the slope tells little: half the way is enough.
        (at, distance) = if there.abs() < distance.abs() {
            (next, there)
        } else {
            (at - direction * (0.5 * distance), value(at - direction * (0.5 * distance)))
        };
    }
    at
}

/// Where a value changes its sign between two points, by halving.
fn crossing(value: &impl Fn(DVec3) -> f64, from: DVec3, to: DVec3) -> DVec3 {
    let (mut low, mut high) = (0.0, 1.0);
    let inside = value(from) < 0.0;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if (value(from.lerp(to, middle)) < 0.0) == inside {
            low = middle;
        } else {
            high = middle;
        }
    }
    from.lerp(to, high)
}

/// The eight parts of a box; `None` where it is too small to be divided.
pub(super) fn octants(extent: &Aabb) -> Option<[Aabb; 8]> {
    let (low, middle, high) = (extent.min, extent.center(), extent.max);
    // Along sides that can still be divided.
    (middle.cmpgt(low).any() && middle.cmplt(high).any()).then(|| {
        std::array::from_fn(|corner| {
            let upper = |axis: usize| corner >> axis & 1 == 1;
            let pick = |of_upper: DVec3, of_lower: DVec3| {
                DVec3::from_array(std::array::from_fn(|axis| if upper(axis) { of_upper[axis] } else { of_lower[axis] }))
            };
            Aabb::new(pick(middle, low), pick(high, middle))
        })
    })
}

/// A box that holds a point where max(f, g) is least.
///
/// The middle of the shortest way lies in the box of both solids. Of one without an end only the way from the other's box
/// matters, which is no longer than from that box's middle and across it.
fn domain(f: &dyn Distance, g: &dyn Distance) -> Result<Aabb> {
    let reach = |open: &dyn Distance, extent: Aabb| {
        let far = open.at(extent.center()).upper.max(0.0) + extent.radius();
        extent.grow(far * (1.0 + 1e-9))
    };
    let extent = match (f.extent(), g.extent()) {
        (Some(a), Some(b)) => a.union(b),
        (Some(a), None) => reach(g, a),
        (None, Some(b)) => reach(f, b),
        (None, None) => return Err(Error::invalid("neither solid has an end; give at least one that has")),
    };
    let around = extent.grow(1e-9 * extent.diagonal());
    if !(around.min.is_finite() && around.max.is_finite() && around.diagonal() > 0.0) {
        return Err(Error::invalid("the box of the two solids is not finite; give solids that have an end"));
    }
    Ok(around)
}
