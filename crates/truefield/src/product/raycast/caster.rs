//! A tree made ready for rays: cells that the surface does not meet are one with their neighbours of the same side.

use super::facets::Touching;
use super::walk::FULL;
use crate::error::{Error, Result};
use crate::field::adaptive::{AdaptiveField, Cell, Division, Leaf};
use crate::geom::{Aabb, DVec3};
use crate::product::reach;
use crate::run::Run;

/// Cells of this depth are looked at as blocks of their own.
const BLOCK_DEPTH: u32 = 3;

/// What a child is: two bits of its word; the others are a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Child {
    /// Number of a node.
    Branch(u32),
    /// Number of the corners of a trilinear leaf with corners of both sides.
    Linear(u32),
    /// Number of a leaf that answers in another way.
    Other(u32),
    /// All of one side; whether that is the inside.
    Empty(bool),
}

const SHIFT: u32 = 30;

impl Child {
    #[inline(always)]
    pub fn of(word: u32) -> Self {
        let number = word & ((1 << SHIFT) - 1);
        match word >> SHIFT {
            0 => Self::Branch(number),
            1 => Self::Linear(number),
            2 => Self::Other(number),
            _ => Self::Empty(number == 1),
        }
    }

    fn word(self) -> u32 {
        match self {
            Self::Branch(number) => number,
            Self::Linear(number) => 1 << SHIFT | number,
            Self::Other(number) => 2 << SHIFT | number,
            Self::Empty(inside) => 3 << SHIFT | u32::from(inside),
        }
    }
}

/// A leaf that answers in another way than by its corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct Other {
    /// Its middle.
    pub center: DVec3,
    /// Its triangles among all, or none where it is not known that the surface is theirs.
    pub first: u32,
    pub count: u32,
}

/// A field prepared for rays that look for one distance.
///
/// Makes no more than 36 bytes of every cell that the surface meets, and of those above it, and 4 more of every triangle
/// that touches an exact leaf; making it takes one look at every cell.
#[derive(Debug)]
pub struct Caster {
    pub(super) field: AdaptiveField,
    pub(super) distance: f64,
    pub(super) extent: Aabb,
    /// Finest cells a unit of length, along each axis.
    pub(super) scale: DVec3,
    pub(super) columns: bool,
    pub(super) root: u32,
    /// Children as words; of columns the upper four are not used.
    pub(super) nodes: Vec<[u32; 8]>,
    /// Corners of trilinear leaves.
    pub(super) corners: Vec<[f32; 8]>,
    /// Leaves that answer in another way.
    pub(super) others: Vec<Other>,
    /// Triangles that touch exact leaves, leaf by leaf.
    pub(super) triangles: Vec<u32>,
}

/// Part of a caster while it is made.
#[derive(Default)]
struct Part {
    nodes: Vec<[u32; 8]>,
    corners: Vec<[f32; 8]>,
    others: Vec<Other>,
    triangles: Vec<u32>,
}

impl Caster {
    /// Prepares a field for the surface at a signed distance.
    pub fn new(field: &AdaptiveField, distance: f64, run: &Run<'_>) -> Result<Self> {
        if !distance.is_finite() {
            return Err(Error::invalid(format!("the distance of the surface is {distance}; give a finite length")));
        }
        reach::check(field, distance)?;
        let mut blocks = Vec::new();
        field.walk(&mut |cell| {
            let block = cell.is_leaf() || cell.depth() == BLOCK_DEPTH;
            if block {
                blocks.push(cell);
            }
            !block
        });
        let parts = run.blocks("prepare for rays", blocks.len(), |number| {
            let mut part = Part::default();
            let root = part.add(blocks[number], distance, &mut Touching::of(field, distance));
            Ok((part, root))
        })?;
        let mut whole = Part::default();
        let roots: Vec<Child> = parts.into_iter().map(|(part, root)| whole.append(part, root)).collect();
        let root = whole.join(field.root(), &mut roots.into_iter()).word();
        let Part { nodes, corners, others, triangles } = whole;
        let columns = field.division() == Division::Quadtree;
        Ok(Self {
            field: field.clone(),
            distance,
            extent: field.extent_box(),
            scale: f64::from(FULL) / field.extent_box().size(),
            columns,
            root,
            nodes,
            corners,
            others,
            triangles,
        })
    }

    /// Corners of cells that the surface meets: the outermost in each of many directions. All of it lies in their hull, but for
    /// a part of a cell; none where it meets no cell.
    pub fn outline(&self, run: &Run<'_>) -> Result<Vec<DVec3>> {
        let steps = || (-2..=2).map(f64::from);
        let directions = steps().flat_map(|x| steps().flat_map(move |y| steps().map(move |z| DVec3::new(x, y, z))));
        let directions: Vec<DVec3> = directions.filter(|&direction| direction != DVec3::ZERO).collect();
        let mut cells = Vec::new();
        let mut stack = vec![(self.root, [0u32; 3], FULL)];
        while let Some((word, place, size)) = stack.pop() {
            let sizes = if self.columns { [size, size, FULL] } else { [size; 3] };
            match Child::of(word) {
                Child::Branch(node) => {
                    let half = size / 2;
                    let octants = if self.columns { 4 } else { 8 };
                    for octant in 0..octants {
                        let at = std::array::from_fn(|axis| place[axis] + half * (octant as u32 >> axis & 1));
                        stack.push((self.nodes[node as usize][octant], at, half));
                    }
                }
                Child::Linear(_) | Child::Other(_) => {
                    let at = |step: u32| DVec3::from_array(std::array::from_fn(|axis| f64::from(place[axis] + step * sizes[axis])));
                    cells.push(Aabb::new(self.extent.min + at(0) / self.scale, self.extent.min + at(1) / self.scale));
                }
                Child::Empty(_) => {}
            }
        }
        run.blocks("find the outline", if cells.is_empty() { 0 } else { directions.len() }, |number| {
            let direction = directions[number];
            let corner = |cell: &Aabb| DVec3::select(direction.cmpgt(DVec3::ZERO), cell.max, cell.min);
            let outermost = cells.iter().map(|cell| (corner(cell).dot(direction), corner(cell)));
            Ok(outermost.fold((f64::NEG_INFINITY, DVec3::ZERO), |best, next| if next.0 > best.0 { next } else { best }).1)
        })
    }
}

impl Part {
    fn add(&mut self, cell: Cell<'_>, distance: f64, touching: &mut Option<Touching<'_>>) -> Child {
        let count = cell.children();
        if count == 0 {
            let extent = cell.extent();
            let below = cell.corners().iter().filter(|&&v| f64::from(v) < distance).count();
            return match cell.leaf() {
                Leaf::Linear if below % 8 != 0 => {
                    self.corners.push(*cell.corners());
                    Child::Linear(self.corners.len() as u32 - 1)
                }
                Leaf::Cubic(_) | Leaf::Exact(_) if below % 8 != 0 || cell.over().contains(distance) => {
                    let first = self.triangles.len();
                    let known = touching.as_mut().is_some_and(|touching| touching.add(&cell, &mut self.triangles));
                    let count = self.triangles.len() - first;
                    // What no triangle touches has one side.
                    if known && count == 0 && below % 8 == 0 {
                        return Child::Empty(below == 8);
                    }
                    self.others.push(Other { center: extent.center(), first: first as u32, count: count as u32 });
                    Child::Other(self.others.len() as u32 - 1)
                }
                _ => Child::Empty(below == 8),
            };
        }
        let children: [Child; 8] =
            std::array::from_fn(
                |octant| if octant < count { self.add(cell.child(octant), distance, touching) } else { Child::Empty(false) },
            );
        self.node(&children[..count])
    }

    /// A node, or what all its children are.
    fn node(&mut self, children: &[Child]) -> Child {
        if let Child::Empty(_) = children[0]
            && children.iter().all(|child| *child == children[0])
        {
            return children[0];
        }
        self.nodes.push(std::array::from_fn(|octant| children[octant % children.len()].word()));
        Child::Branch(self.nodes.len() as u32 - 1)
    }

    /// Adds a part made apart; returns what its root is now.
    fn append(&mut self, other: Self, root: Child) -> Child {
        let (nodes, corners, others) = (self.nodes.len() as u32, self.corners.len() as u32, self.others.len() as u32);
        let triangles = self.triangles.len() as u32;
        let moved = |child: Child| match child {
            Child::Branch(number) => Child::Branch(number + nodes),
            Child::Linear(number) => Child::Linear(number + corners),
            Child::Other(number) => Child::Other(number + others),
            Child::Empty(_) => child,
        };
        self.nodes.extend(other.nodes.into_iter().map(|node| node.map(|word| moved(Child::of(word)).word())));
        self.corners.extend(other.corners);
        self.others.extend(other.others.into_iter().map(|leaf| Other { first: leaf.first + triangles, ..leaf }));
        self.triangles.extend(other.triangles);
        moved(root)
    }

    /// The nodes above the blocks, which come in the order of the walk.
    fn join(&mut self, cell: Cell<'_>, blocks: &mut impl Iterator<Item = Child>) -> Child {
        if cell.is_leaf() || cell.depth() == BLOCK_DEPTH {
            return blocks.next().unwrap_or(Child::Empty(false));
        }
        let children: Vec<Child> = (0..cell.children()).map(|octant| self.join(cell.child(octant), blocks)).collect();
        self.node(&children)
    }
}
