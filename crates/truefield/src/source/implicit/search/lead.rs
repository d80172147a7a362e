//! The way from the root to the boxes that may hold the nearest point.

use super::super::boxes::{Boxes, Node};
use super::super::foot::Foot;
use super::{CLEAR, DONE, Place, STEPS, Search};
use crate::geom::DVec3;

impl Search<'_> {
    /// A foot to begin with, from the leaf to which the nearest boxes lead: what is farther is then left alone.
    pub(super) fn start(&mut self, root: u32) {
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
    pub(super) fn open(&mut self, index: u32) {
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
}

/// No more than the squared distance to the surface in a node.
fn bound(boxes: &Boxes, p: DVec3, node: &Node) -> f64 {
    match boxes.content(node) {
        Some((taylor, _)) => taylor.rough(p, &node.extent),
        None => node.extent.distance_squared(p) * (1.0 - 8.0 * f64::EPSILON),
    }
}
