//! The distance to the surface within the domain, from a point: best first over boxes, until both bounds meet.

use std::collections::BinaryHeap;

use super::boxes::{Boxes, Node, halves};
use super::foot::{Foot, Proof};
use super::sheet::{Content, Sheet, Side};
use super::tape::Tape;
use super::taylor::Taylor;
use crate::geom::{Aabb, DVec3};
use crate::source::waiting::Waiting;

/// Boxes that one search makes at most, beside those of the tree.
const MOST: usize = 20_000;

/// Of those, boxes without a sheet.
const OPEN: usize = 2_000;

/// Boxes of a search after which it is a hard one.
const MANY: usize = 100;

/// The box around a foot that is tried first, in sizes of the box it was found in, to either side.
const WIDE: f64 = 0.5;

/// How often that is halved.
const SHRINKS: usize = 8;

/// Newton steps; from a point of the right sheet, two or three do.
const STEPS: usize = 16;

/// They double their digits: where one was this small, in sizes of the box, it is the last.
const DONE: f64 = 1e-5;

/// Boxes are farther than the surface for certain, where they are by this part.
const CLEAR: f64 = 1.0 + 1e-9;

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
    /// Squared: what was set aside is no nearer.
    floor: f64,
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
        let (heap, pieces, proven, feet) = (BinaryHeap::new(), Vec::new(), Vec::new(), Vec::new());
        let (floor, upper) = (f64::INFINITY, limit);
        Self {
            tape,
            domain,
            boxes,
            accuracy,
            p,
            side,
            heap,
            pieces,
            open: 0,
            floor,
            upper,
            beyond: f64::INFINITY,
            foot: None,
            proven,
            free: Vec::new(),
            feet,
            started: None,
            above: Vec::new(),
            first: None,
        }
    }

    /// Searches the tree.
    pub(super) fn run(mut self) -> Found {
        if let Some(root) = self.boxes.root() {
            self.start(root);
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
            if bound >= self.floor || self.is_enough(bound) || self.pieces.len() > MOST || self.open > OPEN {
                self.floor = self.floor.min(bound);
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
        }
        // Next to a rim of the domain, the other side may lie off the slope of the formula.
        if let Some(first) = self.first.filter(|_| self.upper == f64::INFINITY) {
            self.scan(&first);
        }
        // Rounding of points and of what was subtracted from them.
        let rounding = 4.0 * f64::EPSILON * (self.p.abs().max_element() + self.domain.min.abs().max(self.domain.max.abs()).max_element());
        let lower = (self.floor.max(0.0).sqrt() * (1.0 - 4.0 * f64::EPSILON) - rounding).max(0.0);
        Found { lower: lower.min(self.upper), upper: self.upper + rounding, foot: self.foot }
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

    /// A foot to begin with, from the leaf to which the nearest boxes lead: what is farther is then left alone.
    fn start(&mut self, root: u32) {
        let (boxes, p) = (self.boxes, self.p);
        let Some(near) = self.lead(root, |node| bound(boxes, p, node)) else { return };
        let node = &boxes.nodes[near as usize];
        let Some((taylor, _)) = boxes.content(node).filter(|_| bound(boxes, self.p, node) < self.upper * self.upper) else { return };
        let from = taylor.onto(self.p).clamp(node.extent.min, node.extent.max);
        // The foot may lie leaves away.
        let Some(foot) = Foot::find(|x| self.tape.jet(x), self.p, from, self.domain, STEPS, DONE) else { return };
        let Some(there) = self.lead(root, |node| node.extent.distance_squared(foot.point)) else { return };
        let node = &boxes.nodes[there as usize];
        let bound = bound(boxes, self.p, node);
        if node.sheet.is_some() && node.extent.contains(foot.point) && bound < self.upper * self.upper {
            self.started = Some(there);
            self.sheet(bound, there, foot.point);
        }
        self.above.clear();
    }

    /// The leaf below a node to which the least of some number leads.
    fn lead(&mut self, node: u32, number: impl Fn(&Node) -> f64) -> Option<u32> {
        let mut at = node;
        self.above.clear();
        while self.boxes.nodes[at as usize].count > 0 {
            let node = &self.boxes.nodes[at as usize];
            self.above.push(at);
            let children = node.first..node.first + u32::from(node.count);
            let numbers = children.map(|child| (number(&self.boxes.nodes[child as usize]), child));
            at = numbers.min_by(|a, b| a.0.total_cmp(&b.0))?.1;
        }
        Some(at)
    }

    /// The children of a node.
    fn open(&mut self, index: u32) {
        let boxes = self.boxes;
        let node = &boxes.nodes[index as usize];
        let children = if node.count == 0 { index..index + 1 } else { node.first..node.first + u32::from(node.count) };
        let started = self.started;
        for child in children.filter(|child| started != Some(*child)) {
            let node = &boxes.nodes[child as usize];
            let nearest = node.extent.distance_squared(self.p) * (1.0 - 8.0 * f64::EPSILON);
            if nearest > self.beyond || nearest >= self.upper * self.upper || self.is_proven(&node.extent) {
                continue;
            }
            if let Some(sheet) = node.sheet.filter(|_| self.foot.is_none()) {
                self.beyond = self.beyond.min((boxes.taylors[sheet as usize].most(self.p) * CLEAR).powi(2));
            }
            let mut bound = bound(boxes, self.p, node);
            if !self.tells(child, bound) || bound >= self.upper * self.upper {
                continue;
            }
            if node.count > 0 {
                self.enter(bound, Place::Node(child));
                continue;
            }
            if let Some(sheet) = node.sheet {
                bound = bound.max(self.beside(&boxes.taylors[sheet as usize], &node.extent));
                if self.is_enough(bound) {
                    self.floor = self.floor.min(bound);
                    continue;
                }
            }
            self.enter(bound, Place::Leaf(child));
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
                    for part in parts {
                        self.part(bound, taylor, sheet, part, true);
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
            None => self.settle(bound, &Piece { extent: node.extent, sheet: None, fresh: true }),
        }
    }

    /// A leaf with a sheet.
    fn sheet(&mut self, bound: f64, index: u32, near: DVec3) {
        let node = &self.boxes.nodes[index as usize];
        let sheet = node.sheet.map(|sheet| (self.boxes.taylors[sheet as usize], self.boxes.sheets[sheet as usize], near));
        self.settle(bound, &Piece { extent: node.extent, sheet, fresh: true });
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
            for part in parts {
                self.part(bound, taylor, sheet, part, piece.fresh);
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
                self.floor = self.floor.min(bound);
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
            self.add(bound, Piece { extent, sheet, fresh: !piece.fresh });
        }
    }

    /// A part of a box with a sheet.
    fn part(&mut self, bound: f64, taylor: &Taylor, sheet: &Sheet, extent: Aabb, fresh: bool) {
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
            self.add(bound, Piece { extent, sheet: Some((*taylor, *sheet, near)), fresh });
        }
    }

    /// No more than the squared distance to the surface in a box beside the foot.
    fn beside(&self, taylor: &Taylor, extent: &Aabb) -> f64 {
        self.foot.map_or(f64::NEG_INFINITY, |foot| taylor.beside(self.p, foot, extent))
    }

    /// What is left of a box beside what is proven, where that is some of it.
    fn unproven(&self, extent: &Aabb) -> Option<impl Iterator<Item = Aabb> + use<>> {
        let proven = *self.proven.iter().find(|proven| proven.min.max(extent.min).cmplt(proven.max.min(extent.max)).all())?;
        let mut rest = *extent;
        let parts: [Option<Aabb>; 6] = std::array::from_fn(|face| {
            let (axis, mut part) = (face / 2, rest);
            if face % 2 == 0 && rest.min[axis] < proven.min[axis] {
                (part.max[axis], rest.min[axis]) = (proven.min[axis], proven.min[axis]);
                Some(part)
            } else if face % 2 == 1 && rest.max[axis] > proven.max[axis] {
                (part.min[axis], rest.max[axis]) = (proven.max[axis], proven.max[axis]);
                Some(part)
            } else {
                None
            }
        });
        Some(parts.into_iter().flatten())
    }

    fn add(&mut self, bound: f64, piece: Piece) {
        self.open += usize::from(piece.sheet.is_none());
        self.pieces.push(piece);
        self.enter(bound, Place::Piece((self.pieces.len() - 1) as u32));
    }

    /// What is left of a box without those halves, next to the point, that have no surface.
    fn shaved(&self, extent: &Aabb) -> Aabb {
        let mut rest = *extent;
        for axis in 0..3 {
            let below = self.p[axis] < rest.min[axis];
            if !below && self.p[axis] <= rest.max[axis] {
                continue;
            }
            while rest.size()[axis] > 0.125 * self.accuracy.rough {
                let middle = rest.center()[axis];
                let (mut near, mut far) = (rest, rest);
                if below {
                    (near.max[axis], far.min[axis]) = (middle, middle);
                } else {
                    (near.min[axis], far.max[axis]) = (middle, middle);
                }
                if !matches!(Content::of(self.tape, &near), Content::Nothing(_)) {
                    break;
                }
                rest = far;
            }
        }
        rest
    }

    /// Whether a squared lower bound is as good as wanted.
    fn is_enough(&self, bound: f64) -> bool {
        bound.max(0.0).sqrt() >= self.upper - self.enough()
    }

    fn is_proven(&self, extent: &Aabb) -> bool {
        self.proven.iter().any(|proven| proven.contains(extent.min) && proven.contains(extent.max))
    }

    /// Looks for the foot on the sheet around a box, from `near`; whether what is known of the box is as good as wanted.
    fn prove(&mut self, sheet: &Sheet, cell: &Aabb, near: DVec3) -> bool {
        // Where the foot next to the box is known, others look beyond the box.
        let extent = if self.free.iter().any(|foot| sheet.extent.contains(*foot)) { cell } else { &sheet.extent };
        // Around a foot that is known, only smaller boxes help.
        if self.feet.iter().any(|foot| cell.contains(*foot)) {
            return false;
        }
        let Some(foot) = Foot::find(|x| self.tape.jet(x), self.p, near, extent, STEPS, DONE) else { return false };
        let here = self.tape.jet_over::<0>(&Aabb::new(foot.point, foot.point));
        let far = (foot.point - self.p).length();
        if far < self.upper {
            let reached = foot.reached(self.tape, &here, self.p, self.side.other(), sheet, self.domain);
            if reached < self.upper {
                self.upper = reached;
                self.foot = Some(foot.point);
            }
        }
        let held = foot.is_held(extent, self.domain);
        if !held {
            self.free.push(foot.point);
        }
        if self.holds(&foot.proof(&here, self.p, sheet, extent)) && self.is_proven(cell) {
            // What holds around the leaf may hold far around it.
            while let Some((_, sheet)) = self.above.pop().and_then(|above| self.boxes.content(&self.boxes.nodes[above as usize]))
                && self.holds(&foot.proof(&here, self.p, sheet, &sheet.extent))
            {}
            return true;
        }
        if held || far > self.upper {
            return false;
        }
        self.feet.push(foot.point);
        // The wider the box around the foot, the more is proven at once; the smaller, the less derivatives differ.
        let mut half = WIDE * cell.size().max_element();
        for _ in 0..SHRINKS {
            let around = Aabb::new((foot.point - half).max(self.domain.min), (foot.point + half).min(self.domain.max));
            let proof = foot.proof(&here, self.p, &Sheet::over(self.tape, &around), &around);
            half *= 0.5;
            if self.holds(&proof) && (proof.within.max - proof.within.min).max_element() >= half {
                break;
            }
        }
        self.is_proven(cell)
    }

    /// Keeps what is proven, if it is as good as wanted.
    fn holds(&mut self, proof: &Proof) -> bool {
        let holds = self.is_enough(proof.bound);
        if holds {
            self.floor = self.floor.min(proof.bound);
            self.proven.retain(|proven| !(proof.within.contains(proven.min) && proof.within.contains(proven.max)));
            self.proven.push(proof.within);
        }
        holds
    }

    /// How far apart the bounds may be: where much of the surface is nearly as far, less is asked for.
    fn enough(&self) -> f64 {
        if self.pieces.len() < MANY { self.accuracy.smooth } else { self.accuracy.hard }
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

/// No more than the squared distance to the surface in a node.
fn bound(boxes: &Boxes, p: DVec3, node: &Node) -> f64 {
    match boxes.content(node) {
        Some((taylor, _)) => taylor.rough(p, &node.extent),
        None => node.extent.distance_squared(p) * (1.0 - 8.0 * f64::EPSILON),
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
