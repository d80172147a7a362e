//! How far two solids are apart at least, and at most: best first over pairs of boxes, one that may hold some of the first
//! solid and one that may hold some of the second.
//!
//! A box is asked about its own solid only, near which that is cheap, and once. What it may hold of the solid is bounded by
//! a plane, too, so that faces that run in parallel are told apart by their largest boxes.
//!
//! Solids that know their distance and no slope have no planes, and pairs of boxes alone are too many: then the boxes of one
//! solid are divided and asked about the other as a whole.

use std::collections::BinaryHeap;

use super::collide::{COARSE, FINE, GAIN, foot, octants};
use super::piece::{Gap, Piece};
use crate::distance::Distance;
use crate::error::Result;
use crate::geom::{Aabb, DVec3};
use crate::run::Run;
use crate::source::waiting::Waiting;

/// Pairs that are divided at a time: the result depends on it, and not on the number of threads.
const BATCH: usize = 64;

/// Of those, how many are asked for a way, and how many are in the end.
const TRIED: usize = 4;
const LAST: usize = 256;

/// Steps that lead from a point to the surface of a solid without slopes.
const STEPS: usize = 3;

/// Boxes that a worker divides at a time: a few are not worth another thread.
const CHUNK: usize = 8;

/// Pairs for each box of the budget.
const PAIRS: usize = 8;

/// Pairs looked at to tell solids that touch from such that are apart by less than was asked for.
const CLOSE: usize = 1 << 14;

/// Pairs that any search may look at, and such as it may before it asks what the solids leave open.
const LEAST: usize = 1 << 14;
const SURE: usize = 1 << 11;

/// Divisions that have to raise a bound: each box is halved by two of them.
const DIVISIONS: usize = 4;

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
    let step = 1e-6 * start.diagonal();
    let mut solids = sides(f, g, start, step);
    let mut heap = BinaryHeap::new();
    if solids.iter().all(|solid| !solid.nodes.is_empty()) {
        heap.push(Waiting { bound: 0.0, number: 0, item: Pair { nodes: [0, 0], before: [f64::NEG_INFINITY; DIVISIONS] } });
    }
    let (mut pairs, mut patience) = (1, Patience::new(LEAST));
    loop {
        known.lower = heap.peek().map_or(known.upper, |first| first.bound).min(known.upper);
        run.cancel.check()?;
        run.progress.report("search for the shortest way", known.boxes.min(budget), budget);
        let gap = known.upper - known.lower;
        let told = gap <= tolerance && (known.lower > 0.0 || known.upper <= 0.0 || pairs >= CLOSE);
        let in_doubt = !told && pairs >= SURE && heap.peek().is_some_and(|first| in_doubt(&solids, first, gap));
        if in_doubt {
            // What is left is the doubt of solids, which is not the same everywhere.
            for pair in heap.iter().take(LAST) {
                known.offer([f, g], ends_of(&solids, pair.item.nodes), step);
            }
        }
        // Nothing is left where a solid is empty.
        if heap.is_empty() || told || in_doubt || known.boxes >= budget || pairs / PAIRS >= budget || patience.ends(pairs, gap) {
            return Ok(known);
        }
        let mut batch = Vec::with_capacity(BATCH);
        while batch.len() < BATCH
            && let Some(first) = heap.pop()
        {
            let Some(side) = larger(&solids, first.item.nodes) else {
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
            known.offer([f, g], ends_of(&solids, pair.item.nodes), step);
        }
        // To and fro, while that is worth it.
        if before - known.upper > 0.25 * tolerance {
            let first = toward(f, known.ends[1], step).0;
            known.offer([f, g], [first, toward(g, first, step).0], step);
        }
        for (side, solid) in solids.iter_mut().enumerate() {
            let wanted = batch.iter().filter(|(_, of)| *of == side).map(|(pair, _)| pair.item.nodes[side]);
            known.boxes += solid.divide(wanted, known.upper, run)?;
        }
        for (Waiting { bound: whole, item, .. }, side) in batch {
            for part in solids[side].nodes[item.nodes[side]].parts.clone().into_iter().flatten() {
                let mut item = item;
                item.nodes[side] = part;
                item.before.rotate_right(1);
                item.before[0] = whole;
                let mut bound = whole.max(solids[side].nodes[part].reach);
                if bound <= known.upper {
                    bound = bound.max(gap_of(&solids, item.nodes, known.upper).least);
                }
                if bound <= known.upper {
                    heap.push(Waiting { bound, number: pairs, item });
                }
                pairs += 1;
            }
        }
    }
}

/// A box of each solid.
#[derive(Clone, Copy)]
struct Pair {
    nodes: [usize; 2],
    /// The bounds of the pairs that it is a part of, the last first.
    before: [f64; DIVISIONS],
}

impl Clearance {
    /// Takes a way between two points, and from there to the solids.
    fn offer(&mut self, solids: [&dyn Distance; 2], ends: [DVec3; 2], step: f64) {
        let ends = [0, 1].map(|side| toward(solids[side], ends[side], step));
        let way = ends[0].1 + (ends[1].0 - ends[0].0).length() + ends[1].1;
        if way < self.upper {
            (self.upper, self.ends) = (way, ends.map(|end| end.0));
        }
    }
}

/// Whether what is open comes from what the solids themselves leave open where a pair is nearest, and not from the size of
/// its boxes.
fn in_doubt(solids: &[Solid<'_>; 2], first: &Waiting<Pair>, gap: f64) -> bool {
    let pair = first.item.nodes;
    let divided = (0..2).filter(|&side| solids[1 - side].against.is_none());
    let size: f64 = divided.map(|side| solids[side].nodes[pair[side]].piece.diagonal()).sum();
    if size > COARSE * gap || first.bound - first.item.before[DIVISIONS - 1] > GAIN * gap {
        return false;
    }
    let ends = ends_of(solids, pair);
    let open: f64 = (0..2).map(|side| solids[side].of.at(ends[side]).width()).sum();
    gap <= open || size < FINE * gap
}

/// A point as near to a solid as a step along its slope leads from another one, and no less than the way that is left.
fn toward(solid: &dyn Distance, from: DVec3, step: f64) -> (DVec3, f64) {
    let left = solid.at(from).upper.max(0.0);
    if left == 0.0 || !left.is_finite() {
        return (from, left);
    }
    let slope = solid.below(&Aabb::new(from, from)).slope.try_normalize();
    let next = slope.map_or_else(|| foot(solid, from, step, STEPS), |slope| from - slope * left);
    let then = solid.at(next).upper.max(0.0);
    if then < left { (next, then) } else { (from, left) }
}

fn gap_of(solids: &[Solid<'_>; 2], [a, b]: [usize; 2], enough: f64) -> Gap {
    solids[0].nodes[a].piece.to(&solids[1].nodes[b].piece, enough)
}

/// Points of a pair from where ways are tried.
fn ends_of(solids: &[Solid<'_>; 2], pair: [usize; 2]) -> [DVec3; 2] {
    match (0..2).find(|&side| solids[side].against.is_some()) {
        Some(side) => [solids[side].nodes[pair[side]].extent.center(); 2],
        None => gap_of(solids, pair, f64::INFINITY).ends,
    }
}

/// Which of a pair to divide; `None` where neither can be.
fn larger(solids: &[Solid<'_>; 2], pair: [usize; 2]) -> Option<usize> {
    let nodes = [&solids[0].nodes[pair[0]], &solids[1].nodes[pair[1]]];
    let first = usize::from(nodes[0].piece.diagonal() < nodes[1].piece.diagonal());
    [first, 1 - first].into_iter().find(|&side| solids[1 - side].against.is_none() && octants(&nodes[side].extent).is_some())
}

/// Both solids, and which of them is to be asked as a whole: one that tells no slope, by its surface.
fn sides<'a>(f: &'a dyn Distance, g: &'a dyn Distance, start: &Aabb, step: f64) -> [Solid<'a>; 2] {
    let sloping = [f, g].map(|solid| {
        let at = foot(solid, start.center(), step, STEPS);
        solid.below(&Aabb::new(at, at)).slope != DVec3::ZERO
    });
    let size = |solid: &dyn Distance| solid.extent().map_or(f64::INFINITY, |extent| extent.diagonal());
    let against = match sloping {
        [true, true] => [None, None],
        [true, false] => [Some(g), None],
        [false, true] => [None, Some(f)],
        [false, false] if size(f) <= size(g) => [Some(g), None],
        [false, false] => [None, Some(f)],
    };
    [Solid::new(f, start, against[0]), Solid::new(g, start, against[1])]
}

/// A solid and the boxes that may hold some of it.
struct Solid<'a> {
    of: &'a dyn Distance,
    /// The other one, where that is asked about the boxes, too.
    against: Option<&'a dyn Distance>,
    nodes: Vec<Node>,
}

struct Node {
    extent: Aabb,
    piece: Piece,
    /// No more than the way to the other solid, as far as that was asked.
    reach: f64,
    /// Those of its octants that may hold some of the solid, once it was divided.
    parts: Option<std::ops::Range<usize>>,
}

impl<'a> Solid<'a> {
    fn new(of: &'a dyn Distance, start: &Aabb, against: Option<&'a dyn Distance>) -> Self {
        let root = of.enclosure().unwrap_or(*start);
        let mut solid = Self { of, against, nodes: Vec::new() };
        solid.nodes.extend(solid.node(&root, f64::INFINITY));
        solid
    }

    /// `None` where a box holds nothing of the solid, or nothing as near to the other as `enough`.
    fn node(&self, extent: &Aabb, enough: f64) -> Option<Node> {
        let piece = Piece::of(self.of, extent)?;
        let mut reach = 0.0f64;
        if let Some(other) = self.against {
            reach = reach.max(other.over(extent).lower);
            if reach <= enough {
                reach = reach.max(piece.least_of(&other.below(extent), extent));
            }
        }
        (reach <= enough).then_some(Node { extent: *extent, piece, reach, parts: None })
    }

    /// Divides those of the nodes that were not yet; counts the boxes asked about.
    fn divide(&mut self, wanted: impl Iterator<Item = usize>, enough: f64, run: &Run<'_>) -> Result<usize> {
        let mut whole: Vec<usize> = wanted.filter(|&node| self.nodes[node].parts.is_none()).collect();
        whole.sort_unstable();
        whole.dedup();
        let found = run.blocks("search for the shortest way", whole.len().div_ceil(CHUNK), |block| {
            let chunk = &whole[CHUNK * block..(CHUNK * (block + 1)).min(whole.len())];
            let parts = |&node: &usize| {
                let parts = octants(&self.nodes[node].extent).into_iter().flatten();
                parts.filter_map(|extent| self.node(&extent, enough)).collect::<Vec<_>>()
            };
            Ok(chunk.iter().map(parts).collect::<Vec<_>>())
        })?;
        for (&node, parts) in whole.iter().zip(found.into_iter().flatten()) {
            let first = self.nodes.len();
            self.nodes.extend(parts);
            self.nodes[node].parts = Some(first..self.nodes.len());
        }
        Ok(8 * whole.len())
    }
}
