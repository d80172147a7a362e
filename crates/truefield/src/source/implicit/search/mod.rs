//! The distance to the surface within the domain, from a point: best first over boxes, until both bounds meet.

mod deep;
mod lead;
mod prove;
mod side;

use std::collections::BinaryHeap;

use super::boxes::{Boxes, halves};
use super::sheet::{Content, Sheet, Side};
use super::tape::Tape;
use super::taylor::Taylor;
use crate::geom::{Aabb, DVec3};
use crate::source::waiting::Waiting;

pub(super) use side::both_sides;

/// Boxes that one search makes at most, beside those of the tree, before it is cut off,
const MOST: usize = 20_000;

/// or goes into the depth.
const SOON: usize = 2_000;

/// Of those, boxes without a sheet.
const OPEN: usize = 2_000;

/// Boxes of a search after which it is a hard one.
const MANY: usize = 100;

/// Newton steps; from a point of the right sheet, two or three do.
const STEPS: usize = 16;

/// They double their digits: where one was this small, in sizes of the box, it is the last.
const DONE: f64 = 1e-5;

/// Boxes are farther than the surface for certain, where they are by this part.
const CLEAR: f64 = 1.0 + 1e-9;

/// What a search does about places that much of the surface is nearly as far from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Effort {
    /// It is cut off: bounds hold, and may be far apart.
    Short,
    /// It goes on until both bounds nearly meet, at two hundred times the boxes.
    Whole,
}

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
    /// Of what is no nearer than `lower`, but for leaves that say themselves how much farther the surface may be.
    pub left: f64,
}

/// Something that may hold the nearest point.
#[derive(Clone, Copy, Debug)]
enum Place {
    Node(u32),
    Leaf(u32),
    /// A leaf again, by second derivatives, and a point where the surface in it may be nearest.
    Sheet(u32, DVec3),
    Piece(u32),
}

/// A box made during the search.
#[derive(Clone, Copy)]
struct Piece {
    extent: Aabb,
    /// If it has one sheet, that, and where it may be nearest.
    sheet: Option<(Taylor, Sheet, DVec3)>,
    /// Whether a foot is worth looking for: every other time that a box is cut.
    fresh: bool,
    /// Whether its leaf says how far the surface is from any point of it.
    known: bool,
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
    /// How many of them have no sheet.
    open: usize,
    effort: Effort,
    /// In the depth: what is next with its squared lower bound, and how many there were.
    deep: Vec<(f64, Aabb)>,
    made: usize,
    /// Squared: what was set aside is no nearer,
    floor: f64,
    /// nor is what was set aside though nothing says how much farther the surface is.
    left: f64,
    upper: f64,
    /// Squared: some surface is nearer, whichever; what is not, is not looked at.
    beyond: f64,
    foot: Option<DVec3>,
    /// Boxes whose surface is no nearer than `floor` says.
    proven: Vec<Aabb>,
    /// Feet that no box holds back.
    free: Vec<DVec3>,
    /// Feet around which that was tried.
    feet: Vec<DVec3>,
    /// The leaf of the first foot.
    started: Option<u32>,
    /// The nodes that led there, the smallest last.
    above: Vec<u32>,
    /// The first box that was looked into.
    first: Option<Aabb>,
}

impl<'a> Search<'a> {
    /// Surface that is not nearer than `limit` is not looked for.
    pub(super) fn new(tape: &'a Tape, domain: &'a Aabb, boxes: &'a Boxes, accuracy: Accuracy, p: DVec3, side: Side, limit: f64) -> Self {
        Self {
            tape,
            domain,
            boxes,
            accuracy,
            p,
            side,
            heap: BinaryHeap::new(),
            pieces: Vec::new(),
            open: 0,
            effort: Effort::Short,
            deep: Vec::new(),
            made: 0,
            floor: f64::INFINITY,
            left: f64::INFINITY,
            upper: limit,
            beyond: f64::INFINITY,
            foot: None,
            proven: Vec::new(),
            free: Vec::new(),
            feet: Vec::new(),
            started: None,
            above: Vec::new(),
            first: None,
        }
    }

    /// Searches the tree.
    pub(super) fn run(mut self, effort: Effort) -> Found {
        self.effort = effort;
        if let Some(root) = self.boxes.root() {
            self.start(root);
            // What led to the first leaf says nothing of others.
            self.above.clear();
            self.open(root);
        }
        while let Some(Waiting { bound, item, .. }) = self.heap.pop() {
            if bound >= self.upper * self.upper {
                break;
            }
            // What is only a number of boxes says nothing itself, so that the answer does not depend on how boxes are grouped.
            if let Place::Node(index) = item {
                if self.tells(index, bound) {
                    self.open(index);
                }
                continue;
            }
            if self.is_done(bound, self.enough()) {
                self.reach(item);
                continue;
            }
            let known = self.is_known(item);
            if self.is_full(known) && (known || !self.goes_deep()) {
                self.set_aside(bound, known);
                self.reach(item);
                continue;
            }
            match item {
                Place::Node(_) => {}
                Place::Leaf(index) => self.look(bound, index),
                Place::Sheet(index, near) => self.sheet(bound, index, near),
                Place::Piece(index) => {
                    let piece = self.pieces[index as usize];
                    self.settle(bound, &piece);
                }
            }
            self.go_deep();
        }
        // Next to a rim of the domain, the other side may lie off the slope of the formula.
        if let Some(first) = self.first.filter(|_| self.upper == f64::INFINITY) {
            self.scan(&first);
        }
        // Rounding of points and of what was subtracted from them.
        let rounding = 4.0 * f64::EPSILON * (self.p.abs().max_element() + self.domain.min.abs().max(self.domain.max.abs()).max_element());
        let [lower, left] = [self.floor, self.left].map(|square| {
            let least = square.max(0.0).sqrt() * (1.0 - 4.0 * f64::EPSILON) - rounding;
            least.max(0.0).min(self.upper)
        });
        Found { lower, upper: self.upper + rounding, foot: self.foot, left }
    }

    /// Whether nothing is gained by looking at what is no nearer than that; then it is set aside.
    fn is_done(&mut self, bound: f64, enough: f64) -> bool {
        let done = bound >= self.floor || self.is_within(bound, enough);
        if done {
            self.floor = self.floor.min(bound);
        }
        done
    }

    /// Looks no further at what may hold surface that is no nearer than `bound`.
    fn set_aside(&mut self, bound: f64, known: bool) {
        self.floor = self.floor.min(bound);
        if !known {
            self.left = self.left.min(bound);
        }
    }

    /// Whether no more boxes are kept: soon, of those that the depth takes.
    fn is_full(&self, known: bool) -> bool {
        self.pieces.len() > if !known && self.goes_deep() { SOON } else { MOST } || self.open > OPEN
    }

    /// Whether a leaf says how far the surface is from any point of it.
    fn is_known(&self, item: Place) -> bool {
        match item {
            Place::Node(index) | Place::Leaf(index) | Place::Sheet(index, _) => self.boxes.nodes[index as usize].known > 0.0,
            Place::Piece(index) => self.pieces[index as usize].known,
        }
    }

    fn enter(&mut self, bound: f64, place: Place) {
        // Of equals, what holds others comes first, then what was made first.
        let number = match place {
            Place::Node(index) => index as usize,
            Place::Leaf(index) => 1 << 32 | index as usize,
            Place::Sheet(index, _) => 2 << 32 | index as usize,
            Place::Piece(index) => 3 << 32 | index as usize,
        };
        if bound < self.upper * self.upper && bound <= self.beyond {
            self.heap.push(Waiting { bound, number, item: place });
        }
    }

    /// Whether a node says anything new: beyond what was set aside, only surface that is known for certain does.
    fn tells(&self, index: u32, bound: f64) -> bool {
        bound < self.floor || self.boxes.nodes[index as usize].sure
    }

    /// How far the surface is at most, of which only that is still open.
    fn reach(&mut self, item: Place) {
        let Place::Leaf(index) = item else { return };
        let node = &self.boxes.nodes[index as usize];
        if node.sheet.is_none() && node.sure {
            let far = (node.extent.distance_squared(self.p).sqrt() + f64::from(node.known)) * (1.0 + 8.0 * f64::EPSILON);
            if far < self.upper {
                (self.upper, self.foot) = (far, Some(node.extent.center()));
            }
        } else if let Some(sheet) = node.sheet.filter(|_| self.foot.is_none()) {
            let (taylor, sheet) = (&self.boxes.taylors[sheet as usize], &self.boxes.sheets[sheet as usize]);
            let near = taylor.least(self.p, &node.extent).1;
            self.prove(sheet, &node.extent, near);
        }
    }

    /// Looks at a leaf again, by second derivatives.
    fn look(&mut self, bound: f64, index: u32) {
        let node = &self.boxes.nodes[index as usize];
        match node.sheet {
            Some(sheet) => {
                if bound > self.beyond {
                    return;
                }
                let taylor = &self.boxes.taylors[sheet as usize];
                if let Some(parts) = self.unproven(&node.extent) {
                    let sheet = &self.boxes.sheets[sheet as usize];
                    for extent in parts {
                        self.part(bound, taylor, sheet, Piece { extent, sheet: None, fresh: true, known: node.known > 0.0 });
                    }
                    return;
                }
                let (least, near) = taylor.least_within(self.p, &node.extent, self.beyond);
                self.beyond = self.beyond.min((taylor.most_by(self.p, near, &node.extent) * CLEAR).powi(2));
                let bound = bound.max(least);
                if self.is_enough(bound) {
                    self.floor = self.floor.min(bound);
                } else if self.foot.is_none() && bound <= self.beyond {
                    // A first foot, soon, spares looks at most others.
                    self.sheet(bound, index, near);
                } else {
                    self.enter(bound, Place::Sheet(index, near));
                }
            }
            // What may touch zero without a change of sign would be cut for nothing, or in vain.
            None if !node.is_crossed() => self.floor = self.floor.min(bound),
            None => self.settle(bound, &Piece { extent: node.extent, sheet: None, fresh: true, known: true }),
        }
    }

    /// A leaf with a sheet.
    fn sheet(&mut self, bound: f64, index: u32, near: DVec3) {
        let node = &self.boxes.nodes[index as usize];
        let sheet = node.sheet.map(|sheet| (self.boxes.taylors[sheet as usize], self.boxes.sheets[sheet as usize], near));
        self.settle(bound, &Piece { extent: node.extent, sheet, fresh: true, known: node.known > 0.0 });
    }

    /// Proves how near the surface of a box is, or cuts the box.
    fn settle(&mut self, bound: f64, piece: &Piece) {
        let extent = &piece.extent;
        if self.is_proven(extent) {
            return;
        }
        if let Some((taylor, sheet, _)) = &piece.sheet
            && let Some(parts) = self.unproven(extent)
        {
            for extent in parts {
                self.part(bound, taylor, sheet, Piece { extent, ..*piece });
            }
            return;
        }
        self.first.get_or_insert(*extent);
        let size = extent.size().max_element();
        if let Some((_, sheet, near)) = &piece.sheet {
            if (piece.fresh || self.upper == f64::INFINITY) && self.prove(sheet, extent, *near) {
                return;
            }
            if size <= 0.125 * self.accuracy.smooth {
                self.set_aside(bound, piece.known);
                return;
            }
        } else {
            self.probe(extent);
            let close = bound.max(0.0).sqrt() >= self.upper - self.accuracy.rough;
            if close || size <= 0.125 * self.accuracy.rough {
                if !close {
                    self.scan(extent);
                }
                self.floor = self.floor.min(bound);
                return;
            }
            let extent = self.shaved(extent);
            if extent != piece.extent {
                let bound = bound.max(extent.distance_squared(self.p) * (1.0 - 8.0 * f64::EPSILON));
                self.add(bound, Piece { extent, ..*piece });
                return;
            }
        }
        for extent in halves(extent) {
            let mut bound = bound.max(extent.distance_squared(self.p) * (1.0 - 8.0 * f64::EPSILON));
            // What is known of the whole box may do.
            if let Some((taylor, ..)) = &piece.sheet {
                bound = bound.max(taylor.rough(self.p, &extent)).max(self.beside(taylor, &extent));
                if bound < self.upper * self.upper {
                    bound = bound.max(taylor.least(self.p, &extent).0);
                }
            }
            if self.is_proven(&extent) {
                continue;
            }
            if self.is_enough(bound) {
                self.floor = self.floor.min(bound);
                continue;
            }
            let content = if piece.sheet.is_some() {
                let sheet = Sheet::over(self.tape, &extent);
                Some((Taylor::of(self.tape, &sheet), sheet))
            } else {
                match Content::of(self.tape, &extent) {
                    Content::Nothing(_) => continue,
                    Content::Sheet(sheet) => Some(*sheet),
                    Content::Open => None,
                }
            };
            let sheet = content.map(|(taylor, sheet)| {
                bound = bound.max(taylor.rough(self.p, &extent));
                let (least, near) = taylor.least(self.p, &extent);
                bound = bound.max(least);
                (taylor, sheet, near)
            });
            self.add(bound, Piece { extent, sheet, fresh: !piece.fresh, known: piece.known });
        }
    }

    /// A part of a box with a sheet.
    fn part(&mut self, bound: f64, taylor: &Taylor, sheet: &Sheet, part: Piece) {
        let extent = part.extent;
        let mut bound = bound.max(taylor.rough(self.p, &extent));
        let mut near = extent.center();
        if !self.is_enough(bound) {
            bound = bound.max(self.beside(taylor, &extent));
        }
        if !self.is_enough(bound) {
            let (least, at) = taylor.least(self.p, &extent);
            (bound, near) = (bound.max(least), at);
        }
        if self.is_enough(bound) {
            self.floor = self.floor.min(bound);
        } else {
            self.add(bound, Piece { sheet: Some((*taylor, *sheet, near)), ..part });
        }
    }

    /// No more than the squared distance to the surface in a box beside the foot.
    fn beside(&self, taylor: &Taylor, extent: &Aabb) -> f64 {
        self.foot.map_or(f64::NEG_INFINITY, |foot| taylor.beside(self.p, foot, extent))
    }

    fn add(&mut self, bound: f64, piece: Piece) {
        if !piece.known && self.goes_deep() && self.is_full(false) {
            self.deep.push((bound, piece.extent));
            return;
        }
        self.open += usize::from(piece.sheet.is_none());
        self.pieces.push(piece);
        self.enter(bound, Place::Piece((self.pieces.len() - 1) as u32));
    }
}
