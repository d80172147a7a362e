//! A tree of boxes, eight to a node, over the parts of all patches.

use super::bends::Bends;
use super::bezier::Bezier;
use super::net::{Net, Point};
use super::oriented::Oriented;
use super::piece::Piece;
use crate::geom::{Aabb, DVec3};

/// Boxes side by side in a node.
pub(super) const WIDTH: usize = 8;

/// How often a patch is divided, into eight each time, at most.
const LEVELS: u32 = 4;

/// Parts, about half a kilobyte each, that all patches may have together; searches divide further what needs it.
const MOST: usize = 1 << 18;

/// As often it is always divided, unless it is nearly flat.
const USUAL: u32 = 2;

/// A part is not divided where its bends are bounded to within this part, seen from the patch itself.
const KNOWN: f64 = 0.5;

/// The same, of parts that are nearly flat.
const FLAT: f64 = 0.7;

/// No node, no part.
pub(super) const NONE: u32 = u32::MAX;

/// The mark of a part among a node's children.
pub(super) const PART: u32 = 1 << 31;

/// What lies in eight boxes: nodes, or parts of patches.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub min: [[f64; WIDTH]; 3],
    pub max: [[f64; WIDTH]; 3],
    pub children: [u32; WIDTH],
}

/// A part of a patch.
#[derive(Clone, Debug)]
pub(super) struct Part {
    pub patch: u32,
    /// The node of its own parts, if it has any.
    pub node: u32,
    /// Its rectangle of (u, v).
    pub low: [f64; 2],
    pub high: [f64; 2],
    pub bends: Bends,
    pub oriented: Oriented,
    /// Its middle, and what the patch does there.
    pub middle: Point,
    /// No less than how far it is from its middle.
    pub reach: f64,
}

/// Patches, their parts and the boxes around them.
#[derive(Debug)]
pub(super) struct Tree {
    pub nets: Vec<Net>,
    pub patches: Vec<Bezier>,
    pub nodes: Vec<Node>,
    pub parts: Vec<Part>,
    pub root: u32,
    pub extent: Aabb,
    /// The largest coordinate.
    pub size: f64,
}

impl Tree {
    pub fn new(patches: &[Bezier]) -> Self {
        let nets = patches.iter().map(Net::new).collect();
        let fits = |level: &u32| patches.len() << (3 * level) <= MOST;
        let levels = (USUAL..=LEVELS).rev().find(fits).unwrap_or(USUAL);
        let mut tree =
            Self { nets, patches: patches.to_vec(), nodes: Vec::new(), parts: Vec::new(), root: 0, extent: Aabb::EMPTY, size: 0.0 };
        let roots: Vec<(Aabb, u32)> = (0..patches.len())
            .map(|patch| {
                let piece = Piece::new(patches[patch]);
                tree.grow(&Half { patch: patch as u32, piece, low: [0.0; 2], size: [1.0; 2] }, 0, levels)
            })
            .collect();
        tree.extent = around(&roots);
        tree.size = tree.extent.min.abs().max(tree.extent.max.abs()).max_element();
        tree.root = tree.join(roots);
        tree
    }

    /// A part of a patch, without parts of its own.
    pub fn part(&self, half: &Half) -> Part {
        let Half { patch, piece, low, size } = half;
        Part {
            patch: *patch,
            node: NONE,
            low: *low,
            high: [low[0] + size[0], low[1] + size[1]],
            bends: half.bends(),
            oriented: piece.oriented(),
            middle: self.nets[*patch as usize].derivatives([low[0] + 0.5 * size[0], low[1] + 0.5 * size[1]]),
            reach: piece.extent().diagonal(),
        }
    }

    /// What a part is made of.
    pub fn half(&self, part: &Part) -> Half {
        let size = [part.high[0] - part.low[0], part.high[1] - part.low[1]];
        let piece = Piece::new(self.patches[part.patch as usize].part(part.low, size));
        Half { patch: part.patch, piece, low: part.low, size }
    }

    /// Of length 1, and none where the patch is a point or an edge.
    pub fn normal(&self, patch: u32, place: [f64; 2]) -> DVec3 {
        let here = self.nets[patch as usize].derivatives(place);
        here.u.cross(here.v).normalize_or_zero()
    }

    /// Adds a part of a patch and its own parts; a box around it, and what it is called among children.
    fn grow(&mut self, half: &Half, level: u32, levels: u32) -> (Aabb, u32) {
        let part = self.part(half);
        let known = part.bends.determinant() / part.middle.u.cross(part.middle.v).length_squared();
        let (number, mut extent) = (self.parts.len(), *half.piece.extent());
        self.parts.push(part);
        if level < levels && !(known > FLAT) && (level < USUAL || known <= KNOWN) {
            let mut parts = vec![half.clone()];
            while parts.len() < WIDTH {
                parts = parts.iter().flat_map(Half::halves).collect();
            }
            let children: Vec<_> = parts.iter().map(|part| self.grow(part, level + 1, levels)).collect();
            extent = around(&children);
            self.parts[number].node = self.node(children);
        }
        (extent, number as u32 | PART)
    }

    /// Adds nodes above others, by halves along the longest axis; the number of the highest.
    fn join(&mut self, children: Vec<(Aabb, u32)>) -> u32 {
        if children.len() <= WIDTH {
            return self.node(children);
        }
        let mut groups = vec![children];
        while groups.len() < WIDTH {
            groups = groups.into_iter().flat_map(halved).collect();
        }
        let children = groups
            .into_iter()
            .map(|group| {
                let extent = around(&group);
                if let [(_, only)] = group[..] { (extent, only) } else { (extent, self.join(group)) }
            })
            .collect();
        self.node(children)
    }

    fn node(&mut self, children: Vec<(Aabb, u32)>) -> u32 {
        let mut node = Node { min: [[f64::INFINITY; WIDTH]; 3], max: [[f64::NEG_INFINITY; WIDTH]; 3], children: [NONE; WIDTH] };
        for (lane, (extent, child)) in children.into_iter().enumerate() {
            node.children[lane] = child;
            for axis in 0..3 {
                (node.min[axis][lane], node.max[axis][lane]) = (extent.min[axis], extent.max[axis]);
            }
        }
        self.nodes.push(node);
        (self.nodes.len() - 1) as u32
    }
}

/// A patch over a rectangle of (u, v).
#[derive(Clone, Debug)]
pub(super) struct Half {
    patch: u32,
    pub piece: Piece,
    low: [f64; 2],
    size: [f64; 2],
}

impl Half {
    pub fn bends(&self) -> Bends {
        Bends::new(&self.piece, self.size)
    }

    /// Cut across the direction in which it is longer.
    pub fn halves(&self) -> [Self; 2] {
        let axis = self.piece.longer();
        let (mut low, mut size) = (self.low, self.size);
        size[axis] *= 0.5;
        let [below, above] = self.piece.halves();
        let first = Self { patch: self.patch, piece: below, low, size };
        low[axis] += size[axis];
        [first, Self { patch: self.patch, piece: above, low, size }]
    }
}

fn around(parts: &[(Aabb, u32)]) -> Aabb {
    parts.iter().fold(Aabb::EMPTY, |extent, (part, _)| extent.union(*part))
}

/// By the middles of the boxes.
fn halved(mut parts: Vec<(Aabb, u32)>) -> Vec<Vec<(Aabb, u32)>> {
    if parts.len() < 2 {
        return vec![parts];
    }
    let size = Aabb::around(parts.iter().map(|(extent, _)| extent.center())).size();
    let axis = (0..3).fold(0, |best, axis| if size[axis] > size[best] { axis } else { best });
    parts.sort_by(|(a, _), (b, _)| a.center()[axis].total_cmp(&b.center()[axis]));
    let upper = parts.split_off(parts.len() / 2);
    vec![parts, upper]
}

impl Node {
    /// No more than the squared distances to what is in the boxes.
    #[inline(always)]
    pub fn distances_squared(&self, p: DVec3) -> [f64; WIDTH] {
        let mut squared = [0.0; WIDTH];
        for axis in 0..3 {
            for lane in 0..WIDTH {
                let low = self.min[axis][lane] - p[axis];
                let high = p[axis] - self.max[axis][lane];
                let gap = if low > high { low } else { high };
                let gap = if gap > 0.0 { gap } else { 0.0 };
                squared[lane] += gap * gap;
            }
        }
        squared.map(|squared| squared * (1.0 - 8.0 * f64::EPSILON))
    }
}
