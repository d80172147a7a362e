//! How far two solids are apart at least, and at most: the least distance of one over all points of the other.
//!
//! Best first over boxes that may hold some of the first solid. Where it is bounded from below by an affine function, its
//! points lie where that is not positive, and the least of the other's affine function under this condition bounds the way: by
//! duality, least(g) >= least(g + p f) for every p >= 0. Faces that run in parallel are seen from afar that way.

use std::collections::BinaryHeap;

use super::collide::{foot, octants};
use crate::distance::Distance;
use crate::error::Result;
use crate::geom::{Aabb, Affine, DVec3};
use crate::run::Run;
use crate::source::waiting::Waiting;

/// Boxes that are divided at a time: the result depends on it, and not on the number of threads.
const BATCH: usize = 16;

/// Steps that lead from a point to a surface: any point will do.
const STEPS: usize = 3;

/// When a search is given up that gets no farther, because the solids themselves leave more open than was asked for.
#[derive(Default)]
pub(super) struct Patience {
    /// Boxes asked about and how much was open when it was last looked at.
    last: Option<(usize, f64)>,
}

impl Patience {
    /// Whether four times as many boxes have not closed a tenth of the gap.
    pub fn ends(&mut self, boxes: usize, gap: f64) -> bool {
        let (before, open) = self.last.unwrap_or((LEAST / 4, f64::INFINITY));
        if boxes < 4 * before {
            return false;
        }
        self.last = Some((boxes, gap));
        gap > 0.9 * open
    }
}

/// Boxes that any search may ask about.
const LEAST: usize = 4096;

/// Boxes of a try.
const TRY: usize = 2048;

/// What a search for the shortest way found.
pub(super) struct Clearance {
    /// No more than the way; not above zero where the solids may meet.
    pub lower: f64,
    /// No less than the way.
    pub upper: f64,
    /// By which point such a way leads.
    pub at: DVec3,
    /// Boxes that were asked about.
    pub boxes: usize,
}

/// Looks for the shortest way from one solid to the other, until it is known to `tolerance`, or they seem to meet.
///
/// `start` is a box that holds the end of such a way on each solid that has an extent. Either may be the one whose points
/// are looked at: after a short try of both, the one that tells more.
pub(super) fn clearance(
    f: &dyn Distance,
    g: &dyn Distance,
    start: &Aabb,
    tolerance: f64,
    budget: usize,
    run: &Run<'_>,
) -> Result<Clearance> {
    let mut known = Clearance { lower: f64::NEG_INFINITY, upper: f64::INFINITY, at: start.center(), boxes: 0 };
    let mut gaps = [f64::INFINITY; 2];
    let pairs = [(f, g), (g, f)];
    for (gap, (first, second)) in gaps.iter_mut().zip(pairs) {
        if known.goes_on(tolerance) && first.extent().is_some() {
            let found = search(first, second, start, tolerance, budget.min(TRY), run)?;
            *gap = found.upper - found.lower;
            known.join(found);
        }
    }
    if known.goes_on(tolerance) && known.boxes < budget {
        let (first, second) = if gaps[0] <= gaps[1] { pairs[0] } else { pairs[1] };
        known.join(search(first, second, start, tolerance, budget - known.boxes, run)?);
    }
    Ok(known)
}

impl Clearance {
    /// Whether more would be of use: ways so short are as good as none, where solids meet or touch.
    fn goes_on(&self, tolerance: f64) -> bool {
        !(self.upper - self.lower <= tolerance || self.upper <= tolerance)
    }

    fn join(&mut self, other: Self) {
        self.boxes += other.boxes;
        if other.upper < self.upper {
            (self.upper, self.at) = (other.upper, other.at);
        }
        self.lower = self.lower.max(other.lower).min(self.upper);
    }
}

/// The same by the points of the first.
fn search(f: &dyn Distance, g: &dyn Distance, start: &Aabb, tolerance: f64, budget: usize, run: &Run<'_>) -> Result<Clearance> {
    let mut known = Clearance { lower: f64::NEG_INFINITY, upper: f64::INFINITY, at: start.center(), boxes: 0 };
    let (step, mut patience) = (1e-6 * start.diagonal(), Patience::default());
    let mut heap = BinaryHeap::from([Waiting { bound: f64::NEG_INFINITY, number: 0, item: *start }]);
    loop {
        known.lower = heap.peek().map_or(known.upper, |first| first.bound).min(known.upper);
        run.progress.report("search for the shortest way", known.boxes.min(budget), budget);
        // Nothing is left where the first solid is empty.
        if heap.is_empty() || !known.goes_on(tolerance) || known.boxes >= budget || patience.ends(known.boxes, known.upper - known.lower) {
            return Ok(known);
        }
        let mut batch = Vec::with_capacity(8 * BATCH);
        while batch.len() < 8 * BATCH
            && let Some(first) = heap.pop()
        {
            let Some(parts) = octants(&first.item) else { return Ok(known) };
            batch.extend(parts);
        }
        let enough = known.upper;
        let found = run.blocks("search for the shortest way", batch.len().div_ceil(8), |block| {
            let extents = &batch[8 * block..(8 * block + 8).min(batch.len())];
            Ok(extents.iter().map(|extent| Asked::of(f, g, extent, enough, step)).collect::<Vec<_>>())
        })?;
        for (extent, asked) in batch.into_iter().zip(found.into_iter().flatten()) {
            known.boxes += 1;
            let Some(Asked { lower, upper, at }) = asked else { continue };
            if upper < known.upper {
                (known.upper, known.at) = (upper, at);
            }
            if lower <= known.upper {
                heap.push(Waiting { bound: lower, number: known.boxes, item: extent });
            }
        }
    }
}

/// What is known of the first solid's part in a box.
struct Asked {
    /// No more than the way from any of its points.
    lower: f64,
    /// No less than a way by a point.
    upper: f64,
    at: DVec3,
}

impl Asked {
    /// `None` where the box holds nothing of the first solid, or nothing as near as `enough`.
    fn of(f: &dyn Distance, g: &dyn Distance, extent: &Aabb, enough: f64, step: f64) -> Option<Self> {
        if f.over(extent).lower > 0.0 {
            return None;
        }
        let (center, half) = (extent.center(), 0.5 * extent.size());
        let there = g.at(center);
        let mut lower = there.lower - extent.radius() * (1.0 + 1e-15);
        let mut asked = Self { lower, upper: f.at(center).upper.max(0.0) + there.upper.max(0.0), at: center };
        if lower > enough {
            return None;
        }
        let (near, far) = (f.below(extent), g.below(extent));
        if near.least(half) > 0.0 {
            return None;
        }
        lower = lower.max(g.over(extent).lower).max(least_where(&far, &near, half));
        if lower > enough {
            return None;
        }
        asked.lower = lower;
        // From a good point, the way to each surface leads to better ones.
        if asked.upper < enough {
            let first = foot(f, center, step, STEPS);
            for at in [first, foot(g, first, step, STEPS)] {
                let way = f.at(at).upper.max(0.0) + g.at(at).upper.max(0.0);
                if way < asked.upper {
                    (asked.upper, asked.at) = (way, at);
                }
            }
        }
        Some(asked)
    }
}

/// No more than an affine function anywhere in a box where another one is not positive.
fn least_where(of: &Affine, positive: &Affine, half: DVec3) -> f64 {
    // Concave in the multiplier, with kinks where a slope vanishes.
    let kinks = -of.slope / positive.slope;
    let factors = [0.0].into_iter().chain(kinks.to_array().into_iter().filter(|&factor| factor > 0.0 && factor < 1e6));
    let sum = |factor: f64| Affine { value: of.value + factor * positive.value, slope: of.slope + positive.slope * factor };
    let least =
        |factor: f64| sum(factor).least(half) - 1e-14 * (of.value.abs() + factor * positive.value.abs() + (1.0 + factor) * half.length());
    factors.map(least).fold(f64::NEG_INFINITY, f64::max)
}
