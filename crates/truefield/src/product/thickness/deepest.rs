//! Greatest depth by branch and bound, for one region or for many at once.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::cells::{Ask, Cell, LEVELS, Octree};
use crate::error::Result;
use crate::geom::{DVec3, Interval};
use crate::run::Run;

/// Cells taken per round; each round is spread over all threads, so the result does not depend on them.
const ROUND: usize = 1024;

/// Cells looked at before the search ends with a wider interval: reached only where sides are
/// doubtful all over, as around the holes of an open mesh.
const BUDGET: usize = 4_000_000;

/// The deepest place of a region and what is certain about its depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deepest {
    /// A place whose depth is at least `depth.lower`.
    pub point: DVec3,
    /// Contains the greatest depth of the region.
    pub depth: Interval,
}

/// A region of cells whose deepest place is wanted.
#[derive(Clone, Debug)]
pub(super) struct Region {
    /// Cells and upper bounds of the depth in them; together they cover the region.
    pub seeds: Vec<(Cell, f64)>,
    /// The best place known so far and its certain depth.
    pub best: f64,
    pub place: DVec3,
}

/// A cell still to be split; the greatest is the one that promises most above its region's best.
struct Open {
    promise: f64,
    upper: f64,
    region: usize,
    cell: Cell,
}

impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        self.promise.total_cmp(&other.promise).then(other.region.cmp(&self.region)).then(other.cell.cmp(&self.cell))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Open {}

/// For each region the deepest place, its depth enclosed to a width of `tolerance`.
///
/// A region is given up early, its interval still right, once it cannot be deeper than `floor`.
pub(super) fn deepest(
    octree: &Octree<'_>,
    regions: Vec<Region>,
    tolerance: f64,
    floor: f64,
    phase: &'static str,
    run: &Run<'_>,
) -> Result<Vec<Deepest>> {
    // What rounding adds fits into the rest.
    let slack = 0.9 * tolerance;
    let mut heap = BinaryHeap::new();
    // The greatest upper bound among the cells that were put aside, per region.
    let mut aside = vec![f64::NEG_INFINITY; regions.len()];
    let mut best: Vec<(f64, DVec3)> = regions.iter().map(|r| (r.best, r.place)).collect();
    for (region, seeds) in regions.into_iter().enumerate().map(|(i, r)| (i, r.seeds)) {
        for (cell, upper) in seeds {
            heap.push(Open { promise: promise(upper, best[region].0), upper, region, cell });
        }
    }
    let (mut rounds, mut looked) = (0, 0);
    while !heap.is_empty() && looked < BUDGET {
        run.cancel.check()?;
        let mut asked = Vec::new();
        let mut owners = Vec::new();
        while asked.len() < ROUND {
            let Some(open) = heap.pop() else { break };
            let exceed = (best[open.region].0 + slack).max(floor);
            if open.upper <= exceed || open.cell.level == LEVELS {
                aside[open.region] = aside[open.region].max(open.upper);
                continue;
            }
            asked.push(Ask { cell: open.cell, exceed });
            owners.push(open.region);
        }
        let seen = octree.look(&asked, f64::INFINITY, run, |view| (view.best, view.place))?;
        let owner_of = |child: usize| owners[child / 8];
        for (child, (found, _)) in seen.iter().enumerate() {
            if let Some((depth, place)) = *found {
                let (known, at) = &mut best[owner_of(child)];
                if depth > *known || (depth == *known && before(place, *at)) {
                    (*known, *at) = (depth, place);
                }
            }
        }
        let children = asked.iter().flat_map(|ask| ask.cell.children());
        for ((child, cell), (found, upper)) in children.enumerate().zip(seen) {
            let region = owner_of(child);
            if found.is_some() && upper > (best[region].0 + slack).max(floor) {
                heap.push(Open { promise: promise(upper, best[region].0), upper, region, cell });
            } else {
                aside[region] = aside[region].max(upper);
            }
        }
        rounds += 1;
        looked += 8 * asked.len();
        run.progress.report(phase, rounds, rounds + heap.len().div_ceil(ROUND));
    }
    for open in heap {
        aside[open.region] = aside[open.region].max(open.upper);
    }
    Ok(best
        .into_iter()
        .zip(aside)
        .map(|((depth, point), aside)| Deepest { point, depth: Interval { lower: depth, upper: aside.max(depth + 2.0 * octree.rounding) } })
        .collect())
}

/// What a cell may add to its region's best; all of it while nothing is known.
fn promise(upper: f64, best: f64) -> f64 {
    if best.is_finite() { upper - best } else { upper }
}

/// Order of places that decides ties.
pub(super) fn before(a: DVec3, b: DVec3) -> bool {
    a.to_array().partial_cmp(&b.to_array()) == Some(Ordering::Less)
}
