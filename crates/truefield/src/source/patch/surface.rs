//! A set of patches ready to be asked.

use std::collections::{BinaryHeap, HashMap};
use std::sync::Arc;

use super::bezier::Bezier;
use super::oriented::Oriented;
use super::piece::Piece;
use crate::distance::{Distance, SampleBlock, Source};
use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3, Interval};
use crate::mesh::TriangleMesh;
use crate::run::Run;
use crate::source::balls;
use crate::source::mesh::{SignChoice, SignKind, Surface};
use crate::source::waiting::Waiting;

/// Triangles along the side of a patch, two for each square, that decide sides.
const FACETS: u32 = 24;

/// Halvings of a patch that are kept; further ones are made when they are needed.
const LEVELS: u32 = 6;

/// Halvings beyond these that are tried for a whole cell.
const FINER: u32 = 5;

/// Pieces that one search makes at most.
const MOST: usize = 20_000;

/// Balls that lead from a point off the surface until its triangles say on which side that is.
const STEPS: usize = 64;

/// What decides sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// The patches close up and are oriented alike, or are refused.
    Closed,
    /// There is no inside; distances are positive.
    Unsigned,
}

/// A set of bicubic Bezier patches, and its distance to 1e-11 of its size.
///
/// A query goes through parts of patches, nearest first. Where the squared distance is convex over a part, as derivatives'
/// control points prove, Newton's method finds the nearest point and the tangent there proves that none is nearer.
///
/// Sides come from triangles: farther from the patches than the triangles are from them, both have the same side; nearer,
/// a chain of balls that certainly hold no surface leads away from it.
#[derive(Debug)]
pub struct Patches {
    nodes: Vec<Node>,
    extent: Aabb,
    sides: Option<Facets>,
    accuracy: f64,
}

/// A piece, and its halves if they are kept.
#[derive(Debug)]
enum Node {
    Inner { extent: Aabb, children: [u32; 2] },
    Leaf(Box<(Piece, Oriented)>),
}

/// Triangles next to the patches.
#[derive(Debug)]
struct Facets {
    surface: Surface,
    /// No point of a patch is farther from its place on the triangles.
    error: f64,
}

/// The nearest point found.
#[derive(Clone, Copy, Debug)]
struct Found {
    lower: f64,
    upper: f64,
    point: DVec3,
}

impl Patches {
    /// Fails where there are no patches, control points are not finite, or sides are wanted and the patches do not close up.
    pub fn new(patches: &[Bezier], sides: Sides, run: &Run<'_>) -> Result<Self> {
        if patches.is_empty() {
            return Err(Error::invalid("there are no patches; give an array of shape (n, 4, 4, 3)"));
        }
        if let Some(index) = patches.iter().position(|patch| patch.controls().any(|p| !p.is_finite())) {
            return Err(Error::invalid(format!("patch {index} has control points that are not finite numbers")));
        }
        let mut nodes = Vec::new();
        let roots: Vec<u32> = patches.iter().map(|&patch| grow(&mut nodes, Piece::new(patch), LEVELS)).collect();
        let root = join(&mut nodes, roots);
        // The root comes first.
        let last = nodes.len() - 1;
        debug_assert_eq!(root as usize, last);
        let extent = *extent_of(&nodes[last]);
        let facets = match sides {
            Sides::Unsigned => None,
            Sides::Closed => Some(Facets::new(patches, run)?),
        };
        let accuracy = 1e-11 * (extent.diagonal() + extent.min.abs().max(extent.max.abs()).max_element());
        Ok(Self { nodes, extent, sides: facets, accuracy })
    }

    /// Whether there is an inside.
    pub fn is_closed(&self) -> bool {
        self.sides.is_some()
    }

    /// The nearest point of the patches.
    pub fn foot(&self, p: DVec3) -> DVec3 {
        self.search(p).point
    }

    fn search(&self, p: DVec3) -> Found {
        let mut heap = BinaryHeap::new();
        let mut pieces: Vec<Piece> = Vec::new();
        let (mut floor, mut upper, mut point) = (f64::INFINITY, f64::INFINITY, DVec3::NAN);
        let count = self.nodes.len() as u32;
        let mut entered = 0;
        // Items are nodes, then leaves whose own boxes were asked, then pieces of the search.
        let mut enter = |heap: &mut BinaryHeap<Waiting<u32>>, extent: &Aabb, least: f64, item: u32| {
            entered += 1;
            heap.push(Waiting { bound: (extent.distance_squared(p) * (1.0 - 8.0 * f64::EPSILON)).max(least), number: entered, item });
        };
        enter(&mut heap, &self.extent, 0.0, count - 1);
        while let Some(Waiting { bound, item: place, .. }) = heap.pop() {
            if bound >= floor || bound.sqrt() >= upper - self.accuracy || pieces.len() > MOST {
                floor = floor.min(bound);
                break;
            }
            let piece = if place < 2 * count {
                match &self.nodes[(place % count) as usize] {
                    Node::Inner { children, .. } => {
                        for &child in children {
                            enter(&mut heap, extent_of(&self.nodes[child as usize]), bound, child);
                        }
                        continue;
                    }
                    Node::Leaf(leaf) => {
                        let (piece, oriented) = &**leaf;
                        let least = oriented.distance(p).max(0.0).powi(2) * (1.0 - 8.0 * f64::EPSILON);
                        if place < count && least > bound {
                            enter(&mut heap, piece.extent(), least, place + count);
                            continue;
                        }
                        piece
                    }
                }
            } else {
                &pieces[(place - 2 * count) as usize]
            };
            let nearest = piece.nearest(p);
            let far = (nearest.point - p).length();
            if far < upper {
                (upper, point) = (far, nearest.point);
            }
            if nearest.lower.max(0.0).sqrt() >= upper - self.accuracy {
                floor = floor.min(nearest.lower);
                continue;
            }
            for half in piece.halves() {
                enter(&mut heap, half.extent(), nearest.lower.max(bound), 2 * count + pieces.len() as u32);
                pieces.push(half);
            }
        }
        let rounding = 64.0 * f64::EPSILON * (p.abs().max_element() + self.extent.min.abs().max(self.extent.max.abs()).max_element());
        let lower = (floor.max(0.0).sqrt() - rounding).max(0.0).min(upper);
        Found { lower, upper: upper + rounding, point }
    }

    /// Whether searches from all points of a cell certainly end at once: near it, all pieces are simple.
    fn is_simple(&self, cell: &Aabb, reach: f64) -> bool {
        let square = reach * reach * (1.0 + 1e-12);
        let near = |extent: &Aabb| (extent.min - cell.max).max(cell.min - extent.max).max(DVec3::ZERO).length_squared() <= square;
        let mut pending = vec![self.nodes.len() - 1];
        let mut halves: Vec<(Piece, u32)> = Vec::new();
        while let Some(index) = pending.pop() {
            match &self.nodes[index] {
                node if !near(extent_of(node)) => {}
                Node::Inner { children, .. } => pending.extend(children.iter().map(|&child| child as usize)),
                Node::Leaf(leaf) => halves.push((leaf.0.clone(), FINER)),
            }
            while let Some((piece, levels)) = halves.pop() {
                if !near(piece.extent()) || piece.is_simple(cell) {
                    continue;
                }
                if levels == 0 {
                    return false;
                }
                halves.extend(piece.halves().map(|half| (half, levels - 1)));
            }
        }
        true
    }

    /// -1 inside, 1 outside; `None` where that is not certain.
    fn side(&self, facets: &Facets, p: DVec3, found: Found) -> Option<f64> {
        let (mut at, mut lower, mut direction) = (p, found.lower, p - found.point);
        for _ in 0..STEPS {
            if lower > facets.error {
                let there = facets.surface.at(at);
                return if there.upper < 0.0 {
                    Some(-1.0)
                } else if there.lower > 0.0 {
                    Some(1.0)
                } else {
                    None
                };
            }
            if lower <= self.accuracy {
                return None;
            }
            // Within the ball there is no surface: all of it is on one side.
            at += direction.normalize_or_zero() * (0.99 * lower);
            let next = self.search(at);
            if next.lower <= lower {
                return None;
            }
            (lower, direction) = (next.lower, at - next.point);
        }
        None
    }

    fn answer(&self, p: DVec3) -> (Interval, Option<f64>) {
        if !p.is_finite() {
            return (Interval::ALL, None);
        }
        let found = self.search(p);
        let size = Interval { lower: found.lower, upper: found.upper };
        let value = 0.5 * (found.lower + found.upper);
        let Some(facets) = &self.sides else { return (size, Some(value)) };
        match self.side(facets, p, found) {
            Some(side) if side > 0.0 => (size, Some(value)),
            Some(_) => (Interval { lower: -size.upper, upper: -size.lower }, Some(-value)),
            None => (Interval::either_side(found.upper), (found.upper <= 4.0 * self.accuracy).then_some(0.0)),
        }
    }
}

impl Facets {
    fn new(patches: &[Bezier], run: &Run<'_>) -> Result<Self> {
        let size = Aabb::around(patches.iter().flat_map(Bezier::controls));
        let mut weld = Weld { near: 1e-12 * (size.diagonal() + size.min.abs().max(size.max.abs()).max_element()), ..Weld::default() };
        let mut triangles = Vec::new();
        let mut error = 0.0_f64;
        for patch in patches {
            let mut vertex = |i: u32, j: u32| weld.vertex(patch.point(f64::from(i) / f64::from(FACETS), f64::from(j) / f64::from(FACETS)));
            for (i, j) in (0..FACETS * FACETS).map(|k| (k / FACETS, k % FACETS)) {
                let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| vertex(i, j));
                triangles.extend([[a, b, c], [a, c, d]].into_iter().filter(|[a, b, c]| a != b && b != c && a != c));
            }
            // Linear interpolation over a triangle is off by an eighth of its squared sides times second derivatives.
            let [.., uu, uv, vv] = patch.hulls().map(|hull| hull.min.abs().max(hull.max.abs()).length());
            error = error.max((uu + 2.0 * uv + vv) / (8.0 * f64::from(FACETS * FACETS)));
        }
        if triangles.is_empty() {
            return Err(Error::invalid("the patches have no area"));
        }
        let weld_error = weld.near;
        let surface = Surface::new(Arc::new(TriangleMesh::new(weld.vertices, triangles)?), SignChoice::Auto, run)?;
        let rule = surface.sign_rule();
        if rule.kind != SignKind::Pseudonormal {
            return Err(Error::invalid(format!(
                "the patches have no certain inside ({}); make them close up, with equal control points along shared edges, or take \
                 them unsigned",
                rule.reason
            )));
        }
        Ok(Self { surface, error: error * (1.0 + 1e-9) + 16.0 * weld_error })
    }
}

/// Points of several patches that are one but for rounding.
#[derive(Default)]
struct Weld {
    vertices: Vec<DVec3>,
    cells: HashMap<[i64; 3], u32>,
    near: f64,
}

impl Weld {
    /// The number of a point, or of one known nearby.
    fn vertex(&mut self, p: DVec3) -> u32 {
        // What is near lies in the same cell, four times as wide, or just beyond its border.
        let cell = |q: DVec3| (q / (4.0 * self.near)).floor().to_array().map(|c| c as i64);
        let around = Aabb::new(p - self.near, p + self.near);
        if let Some(&known) = (0..8).find_map(|corner| self.cells.get(&cell(around.corner(corner)))) {
            return known;
        }
        let number = self.vertices.len() as u32;
        let home = cell(p);
        self.vertices.push(p);
        self.cells.insert(home, number);
        number
    }
}

fn extent_of(node: &Node) -> &Aabb {
    match node {
        Node::Inner { extent, .. } => extent,
        Node::Leaf(leaf) => leaf.0.extent(),
    }
}

/// Adds a piece and its halves; its number.
fn grow(nodes: &mut Vec<Node>, piece: Piece, levels: u32) -> u32 {
    if levels == 0 {
        let oriented = piece.oriented();
        nodes.push(Node::Leaf(Box::new((piece, oriented))));
    } else {
        let children = piece.halves().map(|half| grow(nodes, half, levels - 1));
        nodes.push(Node::Inner { extent: around(nodes, children), children });
    }
    (nodes.len() - 1) as u32
}

/// Adds nodes above others, by halves along the longest axis; the number of the highest, which is the last.
fn join(nodes: &mut Vec<Node>, mut parts: Vec<u32>) -> u32 {
    if parts.len() == 1 {
        return parts[0];
    }
    let center = |nodes: &[Node], part: u32| extent_of(&nodes[part as usize]).center();
    let size = Aabb::around(parts.iter().map(|&part| center(nodes, part))).size();
    let axis = (0..3).fold(0, |best, axis| if size[axis] > size[best] { axis } else { best });
    parts.sort_by(|&a, &b| center(nodes, a)[axis].total_cmp(&center(nodes, b)[axis]));
    let upper = parts.split_off(parts.len() / 2);
    let children = [join(nodes, parts), join(nodes, upper)];
    nodes.push(Node::Inner { extent: around(nodes, children), children });
    (nodes.len() - 1) as u32
}

fn around(nodes: &[Node], children: [u32; 2]) -> Aabb {
    children.iter().fold(Aabb::EMPTY, |extent, &child| extent.union(*extent_of(&nodes[child as usize])))
}

impl Distance for Patches {
    fn extent(&self) -> Option<Aabb> {
        Some(self.extent)
    }

    fn at(&self, p: DVec3) -> Interval {
        self.answer(p).0
    }
}

impl Source for Patches {
    /// Fails where the side is not certain: next to places where the patches meet themselves.
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        for (&p, out) in points.iter().zip(out) {
            *out = self.answer(p).1.ok_or_else(|| {
                Error::invalid(format!("the side of {p} next to the patches is not certain; take them unsigned, or part them there"))
            })?;
        }
        Ok(())
    }

    fn slack(&self, cell: &Aabb) -> Interval {
        let center = cell.center();
        let (at, value) = self.answer(center);
        let radius = cell.radius() * (1.0 + 1e-12);
        let reach = at.upper.max(-at.lower) + radius;
        if self.is_simple(cell, reach) {
            return Interval::around(0.0, self.noise());
        }
        // Both change by no more than one moves.
        let (value, moved) = (value.unwrap_or(0.0), 2.0 * radius + self.noise());
        Interval { lower: at.lower - value - moved, upper: at.upper - value + moved }
    }

    /// A distance bends no more than that of a point.
    fn bend(&self, cell: &Aabb) -> Interval {
        let range = self.over(cell);
        if range.lower > 0.0 {
            Interval { lower: f64::NEG_INFINITY, upper: 1.0 / range.lower }
        } else if range.upper < 0.0 {
            Interval { lower: 1.0 / range.upper, upper: f64::INFINITY }
        } else {
            Interval::ALL
        }
    }

    fn residual(&self, block: &SampleBlock<'_>, out: &mut [Interval]) -> Result<()> {
        balls::of_distance(self, block, out)
    }

    fn noise(&self) -> f64 {
        4.0 * self.accuracy
    }
}
