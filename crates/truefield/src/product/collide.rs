//! Whether two solids meet, how far they are apart or how deep they overlap, and where: branch and bound over boxes.
//!
//! Let m be the least of max(f, g) over all points, f and g the signed distances of the solids. If m > 0 they are apart, and
//! the way from one to the other is 2 m: its middle is m from both, and no point is nearer than m to both, or the way by it
//! would be shorter. If m < 0 they overlap, and a ball of radius -m about the deepest common point lies in both.

use std::collections::BinaryHeap;

use crate::distance::Distance;
use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3, Interval};
use crate::run::Run;
use crate::source::waiting::Waiting;

/// Boxes that are divided at a time: the result depends on it, and not on the number of threads.
const BATCH: usize = 64;

/// Steps that lead to a witness on a surface.
const STEPS: usize = 60;

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
/// and the solids are exact. Where surfaces run in parallel, the number of boxes grows with the square of their size over the
/// tolerance. Refuses two solids without an end, and a tolerance that is no positive length.
pub fn collide(f: &dyn Distance, g: &dyn Distance, tolerance: f64, budget: usize, run: &Run<'_>) -> Result<Collision> {
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(Error::invalid(format!("the tolerance is {tolerance}; give a positive length")));
    }
    let start = domain(f, g)?;
    let ask = |extent: Aabb| {
        let center = extent.center();
        let (a, b) = (f.at(center), g.at(center));
        let over = Interval { lower: f.over(&extent).lower.max(g.over(&extent).lower), upper: f64::INFINITY };
        // Each distance at the middle bounds it in the whole box, too.
        (over.lower, a.upper.max(b.upper), a.upper.max(0.0) + b.upper.max(0.0), center)
    };
    let (lower, upper, sum, center) = ask(start);
    let mut best = Best { upper, at: center, sum };
    let mut heap = BinaryHeap::from([Waiting { bound: lower, number: 0, item: start }]);
    let mut boxes = 1;
    loop {
        let floor = heap.peek().map_or(best.upper, |first| first.bound).min(best.upper);
        let known = best.separation(floor);
        run.progress.report("search for contact", boxes.min(budget), budget);
        // Half of it, since a way is twice the least.
        if known.width() <= tolerance || boxes >= budget || heap.is_empty() {
            return Ok(best.collision(f, g, known, &start, boxes));
        }
        let mut batch = Vec::with_capacity(8 * BATCH);
        while batch.len() < 8 * BATCH
            && let Some(candidate) = heap.pop()
        {
            if candidate.bound > best.upper {
                heap.clear();
                break;
            }
            let (low, middle, high) = (candidate.item.min, candidate.item.center(), candidate.item.max);
            // Along sides that can still be divided.
            let fine = !(middle.cmpgt(low).any() && middle.cmplt(high).any());
            if fine {
                heap.push(candidate);
                break;
            }
            let halves = Aabb::new(low, middle);
            for corner in 0..8 {
                let shift = DVec3::from_array(std::array::from_fn(|axis| f64::from(corner as u8 >> axis & 1)));
                let min = low + (middle - low) * shift;
                batch.push(Aabb::new(min, if corner == 7 { high } else { min + halves.size() }));
            }
        }
        if batch.is_empty() {
            return Ok(best.collision(f, g, known, &start, boxes));
        }
        let found = run.blocks("search for contact", batch.len().div_ceil(8), |block| {
            Ok(batch[8 * block..(8 * block + 8).min(batch.len())].iter().map(|&extent| ask(extent)).collect::<Vec<_>>())
        })?;
        for (&extent, (lower, upper, sum, center)) in batch.iter().zip(found.into_iter().flatten()) {
            if upper < best.upper {
                (best.upper, best.at) = (upper, center);
            }
            best.sum = best.sum.min(sum);
            if lower <= best.upper {
                heap.push(Waiting { bound: lower, number: boxes, item: extent });
            }
            boxes += 1;
        }
    }
}

/// The best of all points asked.
struct Best {
    /// Least upper end of max(f, g).
    upper: f64,
    at: DVec3,
    /// Least upper end of the way through one point.
    sum: f64,
}

impl Best {
    /// What is known of the separation, if max(f, g) is nowhere below `floor`.
    fn separation(&self, floor: f64) -> Interval {
        let lower = if floor > 0.0 { 2.0 * floor } else { floor };
        let upper = if self.upper > 0.0 { (2.0 * self.upper).min(self.sum) } else { self.upper };
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
            (foot(f, self.at, step), foot(g, self.at, step))
        } else {
            (self.at, self.at)
        };
        Collision { contact, separation, first, second, boxes }
    }
}

/// A point of the surface, by going against the slope as far as the distance says.
fn foot(f: &dyn Distance, from: DVec3, step: f64) -> DVec3 {
    let value = |p: DVec3| {
        let known = f.at(p);
        0.5 * known.lower + 0.5 * known.upper
    };
    let (mut at, mut distance) = (from, value(from));
    for _ in 0..STEPS {
        if distance.abs() < 1e-3 * step {
            break;
        }
        let slope = |axis: DVec3| value(at + axis * step) - value(at - axis * step);
        let Some(direction) = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z)).try_normalize() else { break };
        let next = at - direction * distance;
        let there = value(next);
        // On a ridge the slope tells little: half the way is enough.
        (at, distance) = if there.abs() < distance.abs() {
            (next, there)
        } else {
            (at - direction * (0.5 * distance), value(at - direction * (0.5 * distance)))
        };
    }
    at
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
