//! Trees of meshes: a cell is proven by its corners, its nearest points and, where they are few, its triangles.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::facets::{At, Corner, Prover};
use super::{Rule, Rules};
use crate::build::sides::nearest;
use crate::bvh::Candidate;
use crate::bvh::cover::{OCTANTS, Range, Scratch, gather_few, refine};
use crate::bvh::descend::Block;
use crate::bvh::tree::Slot;
use crate::error::{Error, Result};
use crate::field::Continuity;
use crate::field::adaptive::{AdaptiveField, Division, Level, LevelKind, Levels, ListSide, Record, Root};
use crate::geom::{Aabb, DVec3, Interval};
use crate::grid::Grid;
use crate::run::Run;
use crate::source::mesh::{Side, Surface};

/// Depth of the cells that workers take; no leaf is coarser.
const TILES: u32 = 3;

/// Lattice indices take 21 bits.
const DEEPEST: u32 = 20;

/// Exact leaves are divided while their lists are longer.
const LIST: usize = 12;

/// Longer lists are not kept: the tree is quicker.
const LONGEST: usize = 64;

/// Triangles are listed where there are no more than this.
const LISTED: usize = 128;

/// Exact leaves this many times their half diagonal away are not divided for the sake of their lists, which are as long in
/// the parts.
const FAR: f64 = 3.0;

/// How many times a cell is divided in thought to prove it, before it is divided.
const AHEAD: u32 = 1;

/// Memory is looked at each time a tile has so many cells more.
const COUNTED: usize = 4096;

/// How the leaves of a mesh's tree answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leaves {
    /// By trilinear interpolation, within the tolerance.
    Linear,
    /// By the triangles that can be nearest: the complete field inside the tree.
    Exact,
}

/// Builds the field of a mesh from its triangles; several times as quick as [`super::adaptive`], and proven more tightly.
///
/// Exact leaves are divided until their lists are short; the tolerance does not matter to them.
pub fn adaptive_mesh(surface: &Arc<Surface>, root: Root, leaves: Leaves, rules: &Rules, run: &Run<'_>) -> Result<AdaptiveField> {
    rules.check()?;
    if root.division != Division::Octree {
        return Err(Error::invalid("a mesh is divided into an octree; a quadtree is for shapes that do not depend on z"));
    }
    let edge = root.extent.size().x;
    if !(root.extent.diagonal() + surface.mesh().extent().diagonal() < f64::from(f32::MAX)) {
        return Err(Error::invalid("the part is so large that its distances do not fit single precision; scale it down"));
    }
    let wanted = match leaves {
        // Half a diagonal of such a cell is within the tolerance.
        Leaves::Linear => rules.tolerance,
        Leaves::Exact => {
            let mesh = surface.mesh();
            let area: f64 =
                (0..mesh.triangles().len() as u32).map(|t| mesh.corners(t)).map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum();
            (area / mesh.triangles().len() as f64).sqrt()
        }
    };
    let finest = (edge / wanted).log2().ceil().clamp(f64::from(TILES), f64::from(DEEPEST)) as u32;
    let depth = finest.min(rules.max_depth);
    let tiles = TILES.min(depth);
    let scale = surface.scale();
    let lattice =
        Grid { origin: root.extent.min * scale, spacing: edge * scale * (-f64::from(depth)).exp2(), first: [0; 3], shape: [1 << depth; 3] };
    let job = Job { surface, lattice: &lattice, depth, leaves, rules, cells: AtomicU64::new(0) };
    let edge = 1i64 << (depth - tiles);
    let blocks = Block::tiles(&lattice, edge);
    let parts = run.blocks("build the tree", blocks.len(), |number| {
        let mut builder = Builder::new(&job);
        builder.divide(&Start { low: blocks[number].low, edge, near: Slot(0), side: None, range: Range::ALL }, None, run)?;
        Ok(builder.cells)
    })?;
    let continuity = if surface.side_changes_at_surface_only() { Continuity::Everywhere } else { Continuity::ExceptOpenings };
    let mut cells: Vec<Node> = parts.into_iter().flatten().collect();
    let mut builder = Builder::new(&job);
    for above in 0..tiles {
        for number in 0..8u32.pow(above) {
            let index = from_curve(u64::from(number));
            cells.push(builder.inner(above, index));
        }
    }
    let mut levels = assemble(&cells, Levels::new(root, continuity, rules.accuracy()));
    drop(cells);
    levels.derive_errors();
    AdaptiveField::from_levels(&levels, (leaves == Leaves::Exact).then(|| Arc::clone(surface)), run)
}

/// What all tiles share.
struct Job<'a> {
    surface: &'a Surface,
    lattice: &'a Grid,
    /// Depth of single lattice cells.
    depth: u32,
    leaves: Leaves,
    rules: &'a Rules,
    cells: AtomicU64,
}

/// A cell that is done.
struct Node {
    depth: u32,
    /// Its place on the curve that visits siblings in their order.
    place: u64,
    kind: LevelKind,
    record: Record,
    list: (ListSide, Box<[u32]>),
}

/// A cell to be judged, and what its parent knew.
struct Start {
    /// Lattice indices of its lowest corner.
    low: [i64; 3],
    /// In lattice cells.
    edge: i64,
    /// A triangle that may be near.
    near: Slot,
    /// The side of all its points, where that is known.
    side: Option<Side>,
    /// Of unsigned distances in it.
    range: Range,
}

impl Start {
    /// Lattice index of a corner of the cell, if its edge were `edge`.
    fn corner(&self, edge: i64, octant: usize) -> [i64; 3] {
        [0, 1, 2].map(|axis| self.low[axis] + (octant >> axis & 1) as i64 * edge)
    }

    /// One of eight parts, of which all that is known holds.
    fn part(&self, octant: usize) -> Self {
        let half = self.edge / 2;
        Self { low: self.corner(half, octant), edge: half, ..*self }
    }

    /// With what else is known of its range.
    fn within(self, range: Range) -> Self {
        Self { range: Range { lower: self.range.lower.max(range.lower), upper: self.range.upper.min(range.upper) }, ..self }
    }

    fn cell(&self, lattice: &Grid) -> Aabb {
        let place = |[x, y, z]: [i64; 3]| lattice.corner(x, y, z);
        Aabb::new(place(self.low), place(self.corner(self.edge, 7)))
    }

    fn parts(&self, lattice: &Grid) -> [Aabb; OCTANTS] {
        std::array::from_fn(|octant| self.part(octant).cell(lattice))
    }
}

/// What is seen of a cell.
struct Look {
    cell: Aabb,
    radius: f64,
    center: Corner,
    corners: [Corner; 8],
}

/// The interpolation of eight numbers at a corner of an octant.
fn blend(told: &[f64; 8], octant: usize, corner: usize) -> f64 {
    let half = |axis: usize| (octant >> axis & 1) + (corner >> axis & 1);
    let weight = |axis: usize, side: usize| [[2.0, 0.0], [1.0, 1.0], [0.0, 2.0]][half(axis)][side];
    (0..8).map(|j| told[j] * weight(0, j & 1) * weight(1, j >> 1 & 1) * weight(2, j >> 2)).sum::<f64>() / 8.0
}

/// The cells of one tile.
struct Builder<'a> {
    job: &'a Job<'a>,
    prover: Prover<'a>,
    corners: HashMap<u64, Corner, BuildHasherDefault<Mix>>,
    cells: Vec<Node>,
    scratch: Scratch,
    /// Lists that no cell uses at present.
    lists: Vec<[Vec<Slot>; OCTANTS]>,
}

impl<'a> Builder<'a> {
    fn new(job: &'a Job<'a>) -> Self {
        let prover = Prover::new(job.surface);
        Self { job, prover, corners: HashMap::default(), cells: Vec::new(), scratch: Scratch::default(), lists: Vec::new() }
    }

    /// Looks at a cell: its range, its side and its corners. `list` is complete, or empty where there is none.
    fn look(&mut self, start: &Start, list: &[Slot]) -> (Start, Look) {
        let Job { surface, lattice, .. } = *self.job;
        let cell = start.cell(lattice);
        let radius = cell.radius() * (1.0 + 1e-12);
        // The centre tells the range; it is a corner of the parts.
        let middle = start.corner(start.edge / 2, 7);
        let center = if start.edge > 1 { self.corner(middle, list, start) } else { corner(surface, cell.center(), list, start) };
        let far = center.value.abs();
        let range = Range { lower: start.range.lower.max(far - radius), upper: start.range.upper.min(far + radius) };
        let clear = || if range.lower > 0.0 { side_of(surface, &cell, &center) } else { None };
        let start = Start { near: center.near, side: start.side.or_else(clear), range, ..*start };
        let corners = std::array::from_fn(|octant| self.corner(start.corner(start.edge, octant), list, &start));
        (start, Look { cell, radius, center, corners })
    }

    /// Contains the distance minus the interpolation of `told`, in a cell or a part of one; as sharp as it takes to be within
    /// `limit`, if it can be. `ahead` is how many times the cell may be divided to prove it.
    fn prove(&mut self, start: &Start, look: &Look, told: [f64; 8], list: &[Slot], limit: f64, ahead: u32) -> Interval {
        let Look { cell, center, corners, .. } = *look;
        let at = At { cell, range: start.range, side: start.side, corners, center, told, list };
        let within = |error: Interval| error.upper <= limit && error.lower >= -limit;
        let known = self.prover.coarse(&at);
        if within(known) || list.is_empty() {
            return known;
        }
        let (mut known, turn) = self.prover.fine(&at, known, limit);
        if within(known) || ahead == 0 || start.edge == 1 {
            return known;
        }
        // A sample that is too far off ends the hope, and is a corner of the children that there will be.
        let Some(differences) = self.sample(start, &told, list, limit) else { return known };
        if turn < 1.0 {
            known = known.intersection(self.prover.by_samples(&at, differences, 0.5 * cell.size().x, turn));
            if within(known) {
                return known;
            }
        }
        let mut lists = self.lists.pop().unwrap_or_default();
        let ranges = refine(self.job.surface.tree(), &start.parts(self.job.lattice), list, &mut self.scratch, &mut lists);
        let mut whole = Interval { lower: f64::INFINITY, upper: f64::NEG_INFINITY };
        for octant in 0..OCTANTS {
            let (start, look) = self.look(&start.part(octant).within(ranges[octant]), &lists[octant]);
            let part =
                self.prove(&start, &look, std::array::from_fn(|corner| blend(&told, octant, corner)), &lists[octant], limit, ahead - 1);
            whole = whole.hull(part);
            if !within(part) {
                whole = Interval::ALL;
                break;
            }
        }
        self.lists.push(lists);
        known.intersection(whole)
    }

    /// Contains the distance minus the interpolation of `told` at the corners of the eight parts; `None` where it is beyond
    /// `limit` at any whose side is certain.
    fn sample(&mut self, start: &Start, told: &[f64; 8], list: &[Slot], limit: f64) -> Option<Interval> {
        let mut differences = Interval { lower: f64::INFINITY, upper: f64::NEG_INFINITY };
        for octant in 0..OCTANTS {
            let part = start.part(octant);
            for corner in 0..8 {
                let found = self.corner(part.corner(part.edge, corner), list, start);
                let difference = found.value - blend(told, octant, corner);
                if found.certain && difference.abs() > limit {
                    return None;
                }
                differences = differences.hull(Interval::exact(difference));
            }
        }
        Some(differences)
    }

    /// Judges a cell and, where it is a branch, its parts. `list` is complete, where there is one.
    fn divide(&mut self, start: &Start, list: Option<&[Slot]>, run: &Run<'_>) -> Result<()> {
        let Job { surface, lattice, depth, rules, .. } = *self.job;
        let (scale, tree) = (surface.scale(), surface.tree());
        let (start, look) = self.look(start, list.unwrap_or(&[]));
        let Start { low, edge, range, .. } = start;
        let values = look.corners.map(|corner| (corner.value / scale) as f32);
        let told = values.map(|v| f64::from(v) * scale);
        let limit = rules.allowed(range.lower / scale) * scale;
        let within = |error: Interval| error.upper <= limit && error.lower >= -limit;
        let mut known = self.prove(&start, &look, told, &[], limit, 0);
        let middle = told.iter().sum::<f64>() / 8.0;
        let hopeless = edge > 1 && look.center.certain && (look.center.value - middle).abs() > limit;
        let done = self.job.leaves == Leaves::Linear && (within(known) || hopeless);
        // Triangles are looked at where they can still tell something.
        let mut own = Vec::new();
        let listed = list.is_some() || !done && gather_few(tree, &look.cell, look.center.foot, LISTED, &mut self.scratch, &mut own);
        let list = list.or_else(|| listed.then_some(own.as_slice()));
        let leaf = match (self.job.leaves, list) {
            (Leaves::Exact, _) if edge == 1 || range.lower >= FAR * look.radius => true,
            (Leaves::Exact, list) => list.is_some_and(|list| list.len() <= LIST),
            (Leaves::Linear, list) if !done && rules.rule == Rule::Samples => {
                let list = list.unwrap_or(&[]);
                let enough = edge == 1 || self.sample(&start, &told, list, limit).is_some();
                if enough {
                    known = known.intersection(self.prove(&start, &look, told, list, 0.0, 1));
                }
                enough
            }
            (Leaves::Linear, Some(list)) if !done => {
                known = self.prove(&start, &look, told, list, if edge > 1 { limit } else { 0.0 }, AHEAD);
                edge == 1 || within(known)
            }
            (Leaves::Linear, _) => edge == 1 || within(known),
        };
        let kind = match (leaf, self.job.leaves) {
            (false, _) => LevelKind::Branch,
            (true, Leaves::Linear) => LevelKind::Linear,
            (true, Leaves::Exact) => LevelKind::Exact,
        };
        let kept = match (kind, list) {
            (LevelKind::Exact, Some(list)) if list.len() <= LONGEST => list.iter().map(|&slot| tree.triangle(slot)).collect(),
            _ => Box::default(),
        };
        let record = Record::new(values, Interval { lower: known.lower / scale, upper: known.upper / scale });
        let level = depth - edge.trailing_zeros();
        let place = along_curve(low.map(|low| (low / edge) as u32));
        self.cells.push(Node { depth: level, place, kind, record, list: (list_side(start.side), kept) });
        if self.cells.len().is_multiple_of(COUNTED) {
            run.cancel.check()?;
            let cells = self.job.cells.fetch_add(COUNTED as u64, Ordering::Relaxed) + COUNTED as u64;
            rules.fits(level, cells, cells, f64::from(record.upper.max(-record.lower)))?;
        }
        if leaf {
            return Ok(());
        }
        let Some(list) = list else {
            return (0..OCTANTS).try_for_each(|octant| self.divide(&start.part(octant), None, run));
        };
        let mut lists = self.lists.pop().unwrap_or_default();
        let ranges = refine(tree, &start.parts(lattice), list, &mut self.scratch, &mut lists);
        for octant in 0..OCTANTS {
            self.divide(&start.part(octant).within(ranges[octant]), Some(&lists[octant]), run)?;
        }
        self.lists.push(lists);
        Ok(())
    }

    /// A lattice point of a cell, in the tree's units.
    fn corner(&mut self, place: [i64; 3], list: &[Slot], start: &Start) -> Corner {
        let key = place.iter().fold(0, |key, &i| key << 21 | i as u64);
        let job = self.job;
        *self.corners.entry(key).or_insert_with(|| corner(job.surface, job.lattice.corner(place[0], place[1], place[2]), list, start))
    }

    /// An inner cell above the tiles.
    fn inner(&mut self, depth: u32, index: [u32; 3]) -> Node {
        let Job { surface, lattice, .. } = *self.job;
        let edge = 1i64 << (self.job.depth - depth);
        let values = std::array::from_fn(|octant| {
            let place = [0, 1, 2].map(|axis| (i64::from(index[axis]) + (octant >> axis & 1) as i64) * edge);
            let p = lattice.corner(place[0], place[1], place[2]);
            let start = Start { low: place, edge, near: Slot(0), side: None, range: Range::ALL };
            (corner(surface, p, &[], &start).value / surface.scale()) as f32
        });
        let record = Record::new(values, Interval::ALL);
        Node { depth, place: along_curve(index), kind: LevelKind::Branch, record, list: (ListSide::Asked, Box::default()) }
    }
}

/// The nearest point of the surface and the side of a point of a cell, in the tree's units.
fn corner(surface: &Surface, p: DVec3, list: &[Slot], start: &Start) -> Corner {
    let tree = surface.tree();
    let found = if list.is_empty() {
        let hint = Candidate { distance_squared: tree.facet_at(start.near).distance_squared(p), triangle: tree.triangle(start.near) };
        tree.nearest(p, hint)
    } else {
        nearest(tree, list, p)
    };
    let foot = tree.facet(found.triangle).nearest(p);
    let side = start.side.unwrap_or_else(|| surface.side(p, &foot, found.triangle));
    Corner {
        value: side.sign() * foot.distance_squared.sqrt(),
        certain: side.is_certain(),
        point: p,
        foot: foot.point,
        near: tree.slots[found.triangle as usize],
    }
}

/// The one side of a cell that the surface does not touch, if that is certain.
fn side_of(surface: &Surface, cell: &Aabb, center: &Corner) -> Option<Side> {
    if surface.side_changes_at_surface_only() {
        let side = if center.value < 0.0 { Side::Inside } else { Side::Outside };
        return center.certain.then_some(side);
    }
    let triangle = surface.tree().triangle(center.near);
    surface.side_of_ball(center.point, &surface.tree().facet(triangle).nearest(center.point), triangle, cell.radius())
}

fn list_side(side: Option<Side>) -> ListSide {
    match side {
        Some(Side::Inside) => ListSide::Inside,
        Some(Side::Outside) => ListSide::Outside,
        _ => ListSide::Asked,
    }
}

/// Cells in any order to levels.
fn assemble(cells: &[Node], empty: Levels) -> Levels {
    let deepest = cells.iter().map(|cell| cell.depth).max().unwrap_or(0) as usize;
    let mut order: Vec<Vec<(u64, u32)>> = vec![Vec::new(); deepest + 1];
    for (number, cell) in cells.iter().enumerate() {
        order[cell.depth as usize].push((cell.place, number as u32));
    }
    let levels = order.into_iter().map(|mut order| {
        order.sort_unstable();
        let mut level = Level::default();
        for (_, number) in order {
            let cell = &cells[number as usize];
            level.push(cell.kind, cell.record);
            if cell.kind == LevelKind::Exact {
                level.lists.push(cell.list.0, &cell.list.1);
            }
        }
        level
    });
    Levels { levels: levels.collect(), ..empty }
}

/// Bits of x, y and z in turn, x lowest: cells of one depth in the order of their parents, siblings in theirs.
fn along_curve(index: [u32; 3]) -> u64 {
    (0..3).map(|axis| spread(u64::from(index[axis])) << axis).sum()
}

/// Two empty bits after each of 21.
fn spread(x: u64) -> u64 {
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

/// The index whose place on the curve is `place`, for few cells.
fn from_curve(place: u64) -> [u32; 3] {
    std::array::from_fn(|axis| (0..21).map(|bit| ((place >> (3 * bit + axis)) & 1) as u32 * (1 << bit)).sum())
}

/// Mixes the bits of keys that are whole numbers.
#[derive(Default)]
struct Mix(u64);

impl Hasher for Mix {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u64(u64::from(byte));
        }
    }

    fn write_u64(&mut self, key: u64) {
        let mixed = (self.0 ^ key).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        self.0 = mixed ^ mixed >> 32;
    }
}
