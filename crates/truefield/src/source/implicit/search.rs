//! The distance to the surface within the domain, from a point: best first over boxes, until both bounds meet.

use std::collections::BinaryHeap;

use super::boxes::{Boxes, halves};
use super::foot::Foot;
use super::sheet::{Content, Sheet, Side};
use super::tape::Tape;
use crate::geom::{Aabb, DVec3};
use crate::source::waiting::Waiting;

/// Boxes that one search makes at most, beside those of the tree.
const MOST: usize = 20_000;

/// Boxes of a search after which it is a hard one.
const MANY: usize = 100;

/// The box around a foot that is tried first, in sizes of the box it was found in, to either side.
const WIDE: f64 = 1.5;

/// How often that is halved.
const SHRINKS: usize = 8;

/// How exactly the surface is located.
#[derive(Clone, Copy, Debug)]
pub(super) struct Accuracy {
    /// Where it is smooth.
    pub smooth: f64,
    /// Where it is smooth, and many places are nearly as far.
    pub hard: f64,
    /// Where it has kinks, or meets itself.
    pub rough: f64,
}

/// What a search found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    /// The surface is no nearer.
    pub lower: f64,
    /// The surface is no farther.
    pub upper: f64,
    /// Where it seems nearest.
    pub foot: Option<DVec3>,
}

/// Something that may hold the nearest point.
#[derive(Clone, Copy, Debug)]
enum Place {
    Node(u32),
    /// A leaf of the tree, or a piece of one, whose sheet has been looked at.
    Sheet(u32),
    Piece(u32),
}

/// A box made during the search.
struct Piece {
    extent: Aabb,
    sheet: Option<Box<Sheet>>,
    /// Whether a foot is worth looking for: every other time that a box is cut.
    fresh: bool,
}

/// One search under way.
pub(super) struct Search<'a> {
    tape: &'a Tape,
    domain: &'a Aabb,
    boxes: &'a Boxes,
    accuracy: Accuracy,
    p: DVec3,
    /// The side of `p`, or of the nearest point of the domain where `p` lies outside it.
    side: Side,
    /// Places by their squared lower bounds.
    heap: BinaryHeap<Waiting<Place>>,
    pieces: Vec<Piece>,
    entered: usize,
    /// Squared: what was set aside is no nearer.
    floor: f64,
    upper: f64,
    foot: Option<DVec3>,
    /// Boxes whose surface is no nearer than `floor` says.
    proven: Vec<Aabb>,
    /// Feet around which that was tried.
    feet: Vec<DVec3>,
}

impl<'a> Search<'a> {
    /// Surface that is not nearer than `limit` is not looked for.
    pub(super) fn new(tape: &'a Tape, domain: &'a Aabb, boxes: &'a Boxes, accuracy: Accuracy, p: DVec3, side: Side, limit: f64) -> Self {
        let (heap, pieces, proven, feet) = (BinaryHeap::new(), Vec::new(), Vec::new(), Vec::new());
        let (floor, upper) = (f64::INFINITY, limit);
        Self { tape, domain, boxes, accuracy, p, side, heap, pieces, entered: 0, floor, upper, foot: None, proven, feet }
    }

    /// Searches.
    pub(super) fn run(mut self) -> Found {
        if !self.boxes.nodes.is_empty() {
            self.enter(0.0, Place::Node(0));
        }
        while let Some(entry) = self.heap.pop() {
            if entry.bound >= self.floor || entry.bound.max(0.0).sqrt() >= self.upper - self.enough() {
                self.floor = self.floor.min(entry.bound);
                break;
            }
            if self.pieces.len() > MOST {
                self.floor = self.floor.min(entry.bound);
                break;
            }
            match entry.item {
                Place::Node(index) => self.open(index),
                Place::Sheet(index) => {
                    let node = &self.boxes.nodes[index as usize];
                    let sheet = node.sheet.map(|sheet| &self.boxes.sheets[sheet as usize]);
                    self.settle(entry.bound, &node.extent, sheet, true);
                }
                Place::Piece(index) => {
                    let Piece { extent, sheet, fresh } = &mut self.pieces[index as usize];
                    let (extent, sheet, fresh) = (*extent, sheet.take(), *fresh);
                    self.settle(entry.bound, &extent, sheet.as_deref(), fresh);
                }
            }
        }
        // Rounding of points and of what was subtracted from them.
        let rounding = 4.0 * f64::EPSILON * (self.p.abs().max_element() + self.domain.min.abs().max(self.domain.max.abs()).max_element());
        let lower = (self.floor.max(0.0).sqrt() * (1.0 - 4.0 * f64::EPSILON) - rounding).max(0.0);
        Found { lower: lower.min(self.upper), upper: self.upper + rounding, foot: self.foot }
    }

    fn enter(&mut self, bound: f64, place: Place) {
        let limit = self.upper;
        if bound <= limit * limit {
            self.entered += 1;
            self.heap.push(Waiting { bound, number: self.entered, item: place });
        } else {
            self.floor = self.floor.min(bound);
        }
    }

    /// The children of a node, or the sheet of a leaf.
    fn open(&mut self, index: u32) {
        let boxes = self.boxes;
        let node = &boxes.nodes[index as usize];
        for child in node.first..node.first + u32::from(node.count) {
            let extent = &boxes.nodes[child as usize].extent;
            let place = if boxes.nodes[child as usize].count == 0 { Place::Sheet(child) } else { Place::Node(child) };
            let sheet = boxes.nodes[child as usize].sheet.map(|sheet| &boxes.sheets[sheet as usize]);
            let bound = self.bound(extent, sheet);
            self.enter(bound, place);
        }
        if node.count == 0 {
            let sheet = node.sheet.map(|sheet| &boxes.sheets[sheet as usize]);
            let bound = self.bound(&node.extent, sheet);
            self.enter(bound, Place::Sheet(index));
        }
    }

    /// No more than the squared distance to the surface in a box.
    fn bound(&self, extent: &Aabb, sheet: Option<&Sheet>) -> f64 {
        match sheet {
            Some(sheet) => sheet.least(self.p, extent).0,
            None => extent.distance_squared(self.p) * (1.0 - 8.0 * f64::EPSILON),
        }
    }

    /// Proves how near the surface of a box is, or cuts the box.
    fn settle(&mut self, bound: f64, extent: &Aabb, sheet: Option<&Sheet>, fresh: bool) {
        if self.is_proven(extent) {
            return;
        }
        match sheet {
            Some(sheet) => {
                if (fresh || self.upper == f64::INFINITY) && (self.prove(bound, extent, sheet) || self.is_proven(extent)) {
                    return;
                }
                if extent.size().max_element() <= 0.125 * self.accuracy.smooth {
                    self.floor = self.floor.min(bound);
                    return;
                }
            }
            None => {
                self.probe(extent);
                let near = bound.max(0.0).sqrt() >= self.upper - self.accuracy.rough;
                if near || extent.size().max_element() <= 0.125 * self.accuracy.rough {
                    if !near {
                        self.scan(extent);
                    }
                    self.floor = self.floor.min(bound);
                    return;
                }
            }
        }
        for part in halves(extent) {
            let sheet = match sheet {
                Some(_) if self.is_proven(&part) => continue,
                Some(sheet) => Some(Box::new(sheet.part(self.tape, &part))),
                None => match Content::of(self.tape, self.domain, &part) {
                    Content::Nothing(_) => continue,
                    Content::Sheet(sheet) => Some(sheet),
                    Content::Open => None,
                },
            };
            let bound = self.bound(&part, sheet.as_deref()).max(bound);
            self.pieces.push(Piece { extent: part, sheet, fresh: !fresh });
            self.enter(bound, Place::Piece((self.pieces.len() - 1) as u32));
        }
    }

    fn is_proven(&self, extent: &Aabb) -> bool {
        self.proven.iter().any(|proven| proven.contains(extent.min) && proven.contains(extent.max))
    }

    /// Looks for the foot on a sheet; whether what is known of the box is as good as wanted.
    fn prove(&mut self, bound: f64, extent: &Aabb, sheet: &Sheet) -> bool {
        // Around a foot that is known, only smaller boxes help.
        if self.feet.iter().any(|foot| extent.contains(*foot)) {
            return false;
        }
        let (_, start) = sheet.least(self.p, extent);
        let Some(foot) = Foot::find(self.tape, self.p, start, &sheet.reach) else { return false };
        let far = (foot.point - self.p).length();
        if far < self.upper {
            let reached = foot.beyond(self.tape, self.p, self.side.other(), self.domain);
            if reached < self.upper {
                self.upper = reached;
                self.foot = Some(foot.point);
            }
        }
        if !foot.is_held(&sheet.reach, self.domain)
            && far <= self.upper
            && self.feet.iter().all(|known| (*known - foot.point).length() > self.accuracy.smooth)
        {
            self.feet.push(foot.point);
            // The wider the box around the foot, the more is proven at once; the smaller, the less derivatives differ.
            let mut half = WIDE * extent.size().max_element();
            for _ in 0..SHRINKS {
                let around = Aabb::new((foot.point - half).max(self.domain.min), (foot.point + half).min(self.domain.max));
                if self.accept(foot.proof(self.tape, self.p, &Sheet::around(self.tape, around)), &around) {
                    break;
                }
                half *= 0.5;
            }
            return self.is_proven(extent);
        }
        self.accept(foot.proof(self.tape, self.p, sheet).max(bound), &sheet.reach)
    }

    /// How far apart the bounds may be: where much of the surface is nearly as far, less is asked for.
    fn enough(&self) -> f64 {
        if self.pieces.len() < MANY { self.accuracy.smooth } else { self.accuracy.hard }
    }

    /// Notes what is proven of the surface in a box, if that is as good as wanted.
    fn accept(&mut self, proof: f64, within: &Aabb) -> bool {
        let good = proof.max(0.0).sqrt() >= self.upper - self.enough();
        if good {
            self.floor = self.floor.min(proof);
            self.proven.push(*within);
        }
        good
    }

    /// Looks for the other side around a box that is as small as boxes get.
    fn scan(&mut self, extent: &Aabb) {
        let center = extent.center();
        let far = both_sides(self.tape, self.domain, center, 0.5 * extent.size().max_element(), Some(self.side.other()));
        let reached = (center - self.p).length() + far;
        if reached < self.upper {
            self.upper = reached;
            self.foot = Some(center);
        }
    }

    /// Tries whether the middle of a box, or a point behind it, is beyond the surface; then the surface is on the way.
    fn probe(&mut self, extent: &Aabb) {
        let start = self.p.clamp(self.domain.min, self.domain.max);
        let middle = extent.center();
        let behind = middle + (middle - self.p).normalize_or_zero() * extent.diagonal();
        let beyond = |point: DVec3| Side::of(self.tape.certain(point)) == Some(self.side.other());
        for target in [middle, behind.clamp(self.domain.min, self.domain.max)] {
            if (target - self.p).length() >= self.upper + extent.diagonal() || !beyond(target) {
                continue;
            }
            // Halving finds where the side changes; the last point beyond is what counts.
            let (mut here, mut there) = (0.0, 1.0);
            let way = target - start;
            while (there - here) * way.length() > 0.1 * self.accuracy.rough {
                let half = 0.5 * (here + there);
                if beyond(start + way * half) {
                    there = half;
                } else {
                    here = half;
                }
            }
            let point = start + way * there;
            let far = (point - self.p).length() * (1.0 + 4.0 * f64::EPSILON);
            // Rounding may put it elsewhere than where it was tried.
            if far < self.upper && beyond(point) {
                self.upper = far;
                self.foot = Some(point);
            }
            break;
        }
    }
}

/// How far from a point of the domain a side is certainly found, or both; `step` is where the search starts.
pub(super) fn both_sides(tape: &Tape, domain: &Aabb, p: DVec3, step: f64, wanted: Option<Side>) -> f64 {
    let size = domain.diagonal();
    let gradient = tape.gradient(p).normalize_or_zero();
    let mut step = step.max(f64::EPSILON * (size + p.length()));
    let (mut inside, mut outside) = match wanted {
        None => (f64::INFINITY, f64::INFINITY),
        Some(Side::Inside) => (f64::INFINITY, 0.0),
        Some(Side::Outside) => (0.0, f64::INFINITY),
    };
    while step < size && !(inside.max(outside) < f64::INFINITY) {
        let around = (0..27).map(|k| DVec3::new(f64::from(k % 3 - 1), f64::from(k / 3 % 3 - 1), f64::from(k / 9 - 1)).normalize_or_zero());
        for direction in [gradient, -gradient].into_iter().chain(around) {
            let there = (p + direction * step).clamp(domain.min, domain.max);
            let far = (there - p).length() * (1.0 + 4.0 * f64::EPSILON);
            match Side::of(tape.certain(there)) {
                Some(Side::Inside) => inside = inside.min(far),
                Some(Side::Outside) => outside = outside.min(far),
                None => {}
            }
        }
        step *= 4.0;
    }
    inside.max(outside)
}
