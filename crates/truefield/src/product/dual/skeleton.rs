//! A copy of a tree that holds no more than where its corners are inside: what is of one side is one leaf.

use crate::error::Result;
use crate::field::adaptive::{AdaptiveField, Cell, Division};
use crate::geom::Aabb;
use crate::run::Run;

/// The number of a leaf has this bit; other nodes are named by the place of their first child.
const LEAF: u32 = 1 << 31;

/// Cells of this depth are copied as blocks of their own.
const BLOCK_DEPTH: u32 = 3;

/// Which part of a cell a leaf is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    Whole,
    /// The lower half of a column.
    Lower,
    /// The upper half of a column.
    Upper,
}

/// A leaf of the tree, or a branch whose corners are all of one side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaf<'a> {
    pub cell: Cell<'a>,
    /// Which corners are inside, a bit each. Those on the border of the domain are not: there the surface is closed.
    pub signs: u8,
    /// Whether a corner was taken out of the inside for being on the border.
    pub on_border: bool,
    part: Part,
}

impl<'a> Leaf<'a> {
    fn new(cell: Cell<'a>, part: Part, distance: f64) -> Self {
        let last = (1u32 << cell.depth()) - 1;
        let mut below = 0;
        for corner in 0..8 {
            below |= u8::from(value(&cell, part, corner) < distance) << corner;
        }
        let mut signs: u8 = below;
        for axis in 0..3 {
            // Corners whose number has the axis' bit.
            let high = [0b1010_1010, 0b1100_1100, 0b1111_0000][axis];
            let (low_border, high_border) = match (part, axis) {
                (Part::Lower, 2) => (true, false),
                (Part::Upper, 2) => (false, true),
                _ => (cell.index()[axis] == 0, cell.index()[axis] == last),
            };
            signs &= if low_border { high } else { 0xff };
            signs &= if high_border { !high } else { 0xff };
        }
        Self { cell, signs, on_border: signs != below, part }
    }

    /// The space it stands for.
    pub fn extent(&self) -> Aabb {
        let mut extent = self.cell.extent();
        let middle = 0.5 * extent.min.z + 0.5 * extent.max.z;
        match self.part {
            Part::Whole => {}
            Part::Lower => extent.max.z = middle,
            Part::Upper => extent.min.z = middle,
        }
        extent
    }

    pub fn inside(&self, corner: usize) -> bool {
        self.signs >> corner & 1 == 1
    }

    /// What the field says at a corner.
    pub fn value(&self, corner: usize) -> f64 {
        value(&self.cell, self.part, corner)
    }
}

/// In a column all of z is alike.
fn value(cell: &Cell<'_>, part: Part, corner: usize) -> f64 {
    f64::from(cell.corners()[if part == Part::Whole { corner } else { corner & 3 }])
}

/// Nodes of the copy.
#[derive(Debug, Default)]
pub(super) struct Skeleton<'a> {
    /// Eight children, or four, side by side.
    nodes: Vec<u32>,
    pub leaves: Vec<Leaf<'a>>,
}

/// A set of nodes among which edges are to be found, each once.
#[derive(Clone, Copy, Debug)]
pub(super) enum Job {
    /// Inside a node.
    Inside(u32),
    /// On the face between two, the lower one first.
    Face([u32; 2], usize),
    /// Along an edge between four: bit 0 of their place is along the next axis, bit 1 along the one after.
    Edge([u32; 4], usize),
}

/// The whole copy with what there is to do.
#[derive(Debug)]
pub(super) struct Copy<'a> {
    pub skeleton: Skeleton<'a>,
    pub jobs: Vec<Job>,
    /// Axes that are divided.
    axes: usize,
}

impl<'a> Copy<'a> {
    /// Copies a field for its surface at a distance.
    pub fn of(field: &'a AdaptiveField, distance: f64, run: &Run<'_>) -> Result<Self> {
        let mut blocks = Vec::new();
        field.walk(&mut |cell| {
            let block = cell.is_leaf() || cell.depth() == BLOCK_DEPTH;
            if block {
                blocks.push(cell);
            }
            !block
        });
        let parts: &[Part] = match field.division() {
            Division::Octree => &[Part::Whole],
            Division::Quadtree => &[Part::Lower, Part::Upper],
        };
        let mut skeleton = Skeleton::default();
        let mut roots = Vec::new();
        for &part in parts {
            let copies = run.blocks("look at the cells", blocks.len(), |number| {
                let mut copy = Skeleton::default();
                let root = copy.add(blocks[number], part, distance);
                Ok((copy, root))
            })?;
            skeleton.nodes.reserve_exact(copies.iter().map(|(copy, _)| copy.nodes.len()).sum());
            skeleton.leaves.reserve_exact(copies.iter().map(|(copy, _)| copy.leaves.len()).sum());
            let mut copied = Vec::with_capacity(copies.len());
            for (copy, root) in copies {
                copied.push(skeleton.append(copy, root));
            }
            roots.push(skeleton.join(field.root(), &mut copied.into_iter()));
        }
        let mut jobs: Vec<Job> = roots.iter().map(|&root| Job::Inside(root)).collect();
        if let [lower, upper] = roots[..] {
            jobs.push(Job::Face([lower, upper], 2));
        }
        Ok(Self { skeleton, jobs, axes: if field.division() == Division::Octree { 3 } else { 2 } })
    }

    /// Divides jobs until there are enough of them to be shared out.
    pub fn divide(&mut self, enough: usize) {
        loop {
            let mut divided = Vec::with_capacity(4 * self.jobs.len());
            let mut grown = false;
            for &job in &self.jobs {
                if self.done(job) {
                    divided.push(job);
                } else {
                    grown = true;
                    self.expand(job, &mut divided);
                }
            }
            self.jobs = divided;
            if !grown || self.jobs.len() >= enough {
                return;
            }
        }
    }

    /// Calls `visit` for all edges of a job that no smaller cell divides.
    pub fn edges(&self, job: Job, mut visit: impl FnMut([u32; 4], usize)) {
        let mut stack = vec![job];
        while let Some(job) = stack.pop() {
            match job {
                Job::Edge(nodes, axis) if self.done(job) => visit(nodes.map(|node| node & !LEAF), axis),
                _ => self.expand(job, &mut stack),
            }
        }
    }

    fn done(&self, job: Job) -> bool {
        matches!(job, Job::Edge(nodes, _) if nodes.iter().all(|node| node & LEAF != 0))
    }

    fn child(&self, node: u32, octant: usize) -> u32 {
        if node & LEAF != 0 { node } else { self.skeleton.nodes[node as usize + octant] }
    }

    /// Jobs among the children, after Ju, Losasso, Schaefer and Warren, Dual Contouring of Hermite Data, 2002.
    fn expand(&self, job: Job, out: &mut Vec<Job>) {
        // The numbers of both halves along an axis that is divided.
        let halves = |axis: usize| if axis < self.axes { 0..2 } else { 0..1 };
        match job {
            Job::Inside(node) => {
                if node & LEAF != 0 {
                    return;
                }
                out.extend((0..1usize << self.axes).map(|octant| Job::Inside(self.child(node, octant))));
                for axis in 0..3 {
                    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                    if axis < self.axes {
                        for i in halves(u) {
                            for j in halves(v) {
                                let low = i << u | j << v;
                                out.push(Job::Face([low, low | 1 << axis].map(|octant| self.child(node, octant)), axis));
                            }
                        }
                    }
                    if u < self.axes && v < self.axes {
                        for along in halves(axis) {
                            let at = |place: usize| self.child(node, along << axis | (place & 1) << u | (place >> 1) << v);
                            out.push(Job::Edge([at(0), at(1), at(2), at(3)], axis));
                        }
                    }
                }
            }
            Job::Face(nodes, axis) => {
                if nodes.iter().all(|node| node & LEAF != 0) {
                    return;
                }
                // The lower node's upper children meet the upper node's lower ones; columns have no such.
                let near = |side: usize, octant: usize| {
                    let touching = if axis < self.axes { (1 - side) << axis } else { 0 };
                    self.child(nodes[side], octant | touching)
                };
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                for i in halves(u) {
                    for j in halves(v) {
                        out.push(Job::Face([0, 1].map(|side| near(side, i << u | j << v)), axis));
                    }
                }
                for (along, across) in [(u, v), (v, u)] {
                    if across >= self.axes {
                        continue;
                    }
                    for half in halves(along) {
                        // Bit 0 of a place is along the axis after `along`.
                        let at = |place: usize| {
                            let bits = [place & 1, place >> 1];
                            let bit = |wanted: usize| bits[(wanted + 2 - along) % 3];
                            near(bit(axis), half << along | bit(across) << across)
                        };
                        out.push(Job::Edge([at(0), at(1), at(2), at(3)], along));
                    }
                }
            }
            Job::Edge(nodes, axis) => {
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                for half in halves(axis) {
                    let at = |place: usize| {
                        let touching = |bit: usize, across: usize| if across < self.axes { (1 - bit) << across } else { 0 };
                        let octant = half << axis | touching(place & 1, u) | touching(place >> 1, v);
                        self.child(nodes[place], if axis < self.axes { octant } else { octant & 3 })
                    };
                    out.push(Job::Edge([at(0), at(1), at(2), at(3)], axis));
                }
            }
        }
    }
}

impl<'a> Skeleton<'a> {
    /// Copies a cell and all below it; returns its node.
    fn add(&mut self, cell: Cell<'a>, part: Part, distance: f64) -> u32 {
        let count = cell.children();
        if count == 0 {
            return self.leaf(Leaf::new(cell, part, distance));
        }
        let (leaves, mut children) = (self.leaves.len(), [0; 8]);
        for octant in 0..count {
            children[octant] = self.add(cell.child(octant), part, distance);
        }
        // Corners that are all of one side are of one side here, too.
        let plain = self.leaves.len() - leaves == count && children[..count].iter().all(|child| child & LEAF != 0);
        if let Some(&Leaf { signs: signs @ (0 | 0xff), .. }) = self.leaves.last()
            && plain
            && self.leaves[leaves..].iter().all(|leaf| leaf.signs == signs)
        {
            self.leaves.truncate(leaves);
            return self.leaf(Leaf { cell, signs, on_border: false, part });
        }
        self.node(&children[..count])
    }

    fn leaf(&mut self, leaf: Leaf<'a>) -> u32 {
        self.leaves.push(leaf);
        (self.leaves.len() - 1) as u32 | LEAF
    }

    fn node(&mut self, children: &[u32]) -> u32 {
        self.nodes.extend_from_slice(children);
        (self.nodes.len() - children.len()) as u32
    }

    /// Adds a copy made apart; returns its root's new number.
    fn append(&mut self, other: Self, root: u32) -> u32 {
        let (nodes, leaves) = (self.nodes.len() as u32, self.leaves.len() as u32);
        let moved = |node: u32| if node & LEAF != 0 { node + leaves } else { node + nodes };
        self.nodes.extend(other.nodes.into_iter().map(moved));
        self.leaves.extend(other.leaves);
        moved(root)
    }

    /// The nodes above the blocks, which come in the order of the walk.
    fn join(&mut self, cell: Cell<'a>, blocks: &mut impl Iterator<Item = u32>) -> u32 {
        if cell.is_leaf() || cell.depth() == BLOCK_DEPTH {
            return blocks.next().unwrap_or(LEAF);
        }
        let children: Vec<u32> = (0..cell.children()).map(|octant| self.join(cell.child(octant), blocks)).collect();
        self.node(&children)
    }
}
