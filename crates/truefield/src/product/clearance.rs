//! How far two solids are apart at least, and at most: best first over pairs of boxes, one that may hold some of the first
//! solid and one that may hold some of the second.
//!
//! A box is asked about its own solid only, near which that is cheap, and once. What it may hold of the solid is bounded by
//! a plane, too, so that faces that run in parallel are told apart by their largest boxes.

use std::collections::BinaryHeap;

use super::collide::{COARSE, FINE, octants};
use super::piece::{Gap, Piece};
use crate::distance::Distance;
use crate::error::Result;
use crate::geom::{Aabb, DVec3};
use crate::run::Run;
use crate::source::waiting::Waiting;

/// Pairs that are divided at a time: the result depends on it, and not on the number of threads.
const BATCH: usize = 64;

/// Of those, how many are asked for a way.
const TRIED: usize = 4;

/// Pairs for each box of the budget.
const PAIRS: usize = 8;

/// Pairs looked at to tell solids that touch from such that are apart by less than was asked for.
const CLOSE: usize = 1 << 14;

/// Pairs that any search may look at, and such as it may before it asks what the solids leave open.
const LEAST: usize = 1 << 14;
const SURE: usize = 1 << 11;

/// When a search is given up that gets no farther, because the solids themselves leave more open than was asked for.
pub(super) struct Patience {
    /// What any search may ask about.
    least: usize,
    /// What was asked about and how much was open when it was last looked at.
    last: Option<(usize, f64)>,
}

impl Patience {
    /// Any search may ask about `least`.
    pub fn new(least: usize) -> Self {
        Self { least, last: None }
    }

    /// Whether asking about four times as many has not closed a tenth of the gap.
    pub fn ends(&mut self, asked: usize, gap: f64) -> bool {
        let (before, open) = self.last.unwrap_or((self.least / 4, f64::INFINITY));
        if asked < 4 * before {
            return false;
        }
        self.last = Some((asked, gap));
        gap > 0.9 * open
    }
}

/// What a search for the shortest way found.
pub(super) struct Clearance {
    /// No more than the way; 0 where the solids may meet.
    pub lower: f64,
    /// No less than the way.
    pub upper: f64,
    /// Such a way leads from next to the first solid to next to the second.
    pub ends: [DVec3; 2],
    /// Boxes that were asked about.
    pub boxes: usize,
}

/// Looks for the shortest way from one solid to the other, until it is known to `tolerance` and whether there is any, or they
/// seem to meet.
///
/// `start` is a box that holds the end of such a way on each solid.
pub(super) fn clearance(
    f: &dyn Distance,
    g: &dyn Distance,
    start: &Aabb,
    tolerance: f64,
    budget: usize,
    run: &Run<'_>,
) -> Result<Clearance> {
    let mut known = Clearance { lower: 0.0, upper: f64::INFINITY, ends: [start.center(); 2], boxes: 2 };
    let mut solids = [Solid::new(f, start), Solid::new(g, start)];
    let mut heap = BinaryHeap::new();
    if solids.iter().all(|solid| !solid.nodes.is_empty()) {
        heap.push(Waiting { bound: 0.0, number: 0, item: [0, 0] });
    }
    let (mut pairs, mut patience) = (1, Patience::new(LEAST));
    loop {
        known.lower = heap.peek().map_or(known.upper, |first| first.bound).min(known.upper);
        run.progress.report("search for the shortest way", known.boxes.min(budget), budget);
        let gap = known.upper - known.lower;
        let told = gap <= tolerance && (known.lower > 0.0 || known.upper <= 0.0 || pairs >= CLOSE);
        let in_doubt = pairs >= SURE && heap.peek().is_some_and(|first| in_doubt(&solids, first.item, gap));
        // Nothing is left where a solid is empty.
        if heap.is_empty() || told || in_doubt || known.boxes >= budget || pairs / PAIRS >= budget || patience.ends(pairs, gap) {
            return Ok(known);
        }
        let mut batch = Vec::with_capacity(BATCH);
        while batch.len() < BATCH
            && let Some(first) = heap.pop()
        {
            let Some(side) = larger(&solids, first.item) else {
                heap.push(first);
                break;
            };
            batch.push((first, side));
        }
        if batch.is_empty() {
            return Ok(known);
        }
        let before = known.upper;
        for (pair, _) in batch.iter().take(TRIED) {
            known.offer([f, g], gap_of(&solids, pair.item, f64::INFINITY).ends);
        }
        // To and fro, while that is worth it.
        if before - known.upper > 0.25 * tolerance {
            let first = toward(f, known.ends[1]).0;
            known.offer([f, g], [first, toward(g, first).0]);
        }
        for (side, solid) in solids.iter_mut().enumerate() {
            known.boxes += solid.divide(batch.iter().filter(|(_, of)| *of == side).map(|(pair, _)| pair.item[side]), run)?;
        }
        for (Waiting { bound, item, .. }, side) in batch {
            for part in solids[side].nodes[item[side]].parts.clone().into_iter().flatten() {
                let mut item = item;
                item[side] = part;
                let bound = bound.max(gap_of(&solids, item, known.upper).least);
                if bound <= known.upper {
                    heap.push(Waiting { bound, number: pairs, item });
                }
                pairs += 1;
            }
        }
    }
}

impl Clearance {
    /// Takes a way between two points, and from there to the solids.
    fn offer(&mut self, solids: [&dyn Distance; 2], ends: [DVec3; 2]) {
        let ends = [0, 1].map(|side| toward(solids[side], ends[side]));
        let way = ends[0].1 + (ends[1].0 - ends[0].0).length() + ends[1].1;
        if way < self.upper {
            (self.upper, self.ends) = (way, ends.map(|end| end.0));
        }
    }
}

/// Whether what is open comes from what the solids themselves leave open where a pair is nearest, and not from the size of
/// its boxes.
fn in_doubt(solids: &[Solid<'_>; 2], pair: [usize; 2], gap: f64) -> bool {
    let size: f64 = (0..2).map(|side| solids[side].nodes[pair[side]].piece.diagonal()).sum();
    if size > COARSE * gap {
        return false;
    }
    let ends = gap_of(solids, pair, f64::INFINITY).ends;
    let open: f64 = (0..2).map(|side| solids[side].of.at(ends[side]).width()).sum();
    gap <= open || size < FINE * gap
}

/// A point as near to a solid as a step along its slope leads from another one, and no less than the way that is left.
fn toward(solid: &dyn Distance, from: DVec3) -> (DVec3, f64) {
    let left = solid.at(from).upper.max(0.0);
    if left == 0.0 {
        return (from, left);
    }
    let next = from - solid.below(&Aabb::new(from, from)).slope.normalize_or_zero() * left;
    let then = solid.at(next).upper.max(0.0);
    if then < left { (next, then) } else { (from, left) }
}

fn gap_of(solids: &[Solid<'_>; 2], [a, b]: [usize; 2], enough: f64) -> Gap {
    solids[0].nodes[a].piece.to(&solids[1].nodes[b].piece, enough)
}

/// Which of a pair to divide; `None` where neither can be.
fn larger(solids: &[Solid<'_>; 2], pair: [usize; 2]) -> Option<usize> {
    let nodes = [&solids[0].nodes[pair[0]], &solids[1].nodes[pair[1]]];
    let first = usize::from(nodes[0].piece.diagonal() < nodes[1].piece.diagonal());
    [first, 1 - first].into_iter().find(|&side| octants(&nodes[side].extent).is_some())
}

/// A solid and the boxes that may hold some of it.
struct Solid<'a> {
    of: &'a dyn Distance,
    nodes: Vec<Node>,
}

struct Node {
    extent: Aabb,
    piece: Piece,
    /// Those of its octants that may hold some of the solid, once it was divided.
    parts: Option<std::ops::Range<usize>>,
}

impl Node {
    fn of(solid: &dyn Distance, extent: &Aabb) -> Option<Self> {
        Piece::of(solid, extent).map(|piece| Self { extent: *extent, piece, parts: None })
    }
}

impl<'a> Solid<'a> {
    fn new(of: &'a dyn Distance, start: &Aabb) -> Self {
        let root = of.enclosure().unwrap_or(*start);
        Self { of, nodes: Node::of(of, &root).into_iter().collect() }
    }

    /// Divides those of the nodes that were not yet; counts the boxes asked about.
    fn divide(&mut self, wanted: impl Iterator<Item = usize>, run: &Run<'_>) -> Result<usize> {
        let mut whole: Vec<usize> = wanted.filter(|&node| self.nodes[node].parts.is_none()).collect();
        whole.sort_unstable();
        whole.dedup();
        let (of, nodes) = (self.of, &self.nodes);
        let found = run.blocks("search for the shortest way", whole.len(), |block| {
            let parts = octants(&nodes[whole[block]].extent).into_iter().flatten();
            Ok(parts.filter_map(|extent| Node::of(of, &extent)).collect::<Vec<_>>())
        })?;
        for (&node, parts) in whole.iter().zip(found) {
            let first = self.nodes.len();
            self.nodes.extend(parts);
            self.nodes[node].parts = Some(first..self.nodes.len());
        }
        Ok(8 * whole.len())
    }
}
