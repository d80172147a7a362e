//! Trees of meshes: a cell is proven by its corners, its nearest points and, where they are few, its triangles.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::facets::{At, Corner, Plane, Prover};
use super::halves::{CENTER, Halves, INNER, blend, of_part, steps};
use super::{Rule, Rules};
use crate::build::sides::nearest;
use crate::bvh::Candidate;
use crate::bvh::cover::{OCTANTS, Range, Scratch, gather_few, refine};
use crate::bvh::descend::Block;
use crate::bvh::tree::Slot;
use crate::error::{Error, Result};
use crate::field::Continuity;
use crate::field::adaptive::{AdaptiveField, Coverage, Division, Level, LevelKind, Levels, ListSide, Record, Root};
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

/// Points are looked for in lists up to this length, and in the tree where they are longer.
const SEARCHED: usize = 32;

/// What no number is in.
const NOTHING: Interval = Interval { lower: f64::INFINITY, upper: f64::NEG_INFINITY };

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
    let planes = if leaves == Leaves::Linear { Plane::all(surface) } else { Vec::new() };
    let job = Job { surface, planes: &planes, lattice: &lattice, depth, leaves, rules, cells: AtomicU64::new(0) };
    let edge = 1i64 << (depth - tiles);
    let blocks = Block::tiles(&lattice, edge);
    let parts = run.blocks("build the tree", blocks.len(), |number| {
        let mut builder = Builder::new(&job);
        let start = builder.start(blocks[number].low, edge);
        builder.divide(start, None, run)?;
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
    let coverage = Coverage::of(&root, Some(surface.mesh().extent()));
    let mut levels = assemble(&cells, Levels { coverage, ..Levels::new(root, continuity, rules.accuracy()) });
    drop(cells);
    levels.derive_errors();
    AdaptiveField::from_levels(&levels, (leaves == Leaves::Exact).then(|| Arc::clone(surface)), run)
}

/// What all tiles share.
struct Job<'a> {
    surface: &'a Surface,
    planes: &'a [Plane],
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
    corners: [Corner; 8],
    /// The side of all its points, where that is known.
    side: Option<Side>,
    /// Of unsigned distances in it.
    range: Range,
}

/// Lattice indices of a corner of the cell from `low` on.
fn place(low: [i64; 3], edge: i64, corner: usize) -> [i64; 3] {
    [0, 1, 2].map(|axis| low[axis] + (corner >> axis & 1) as i64 * edge)
}

impl Start {
    fn cell(&self, lattice: &Grid) -> Aabb {
        let at = |corner| {
            let [x, y, z] = place(self.low, self.edge, corner);
            lattice.corner(x, y, z)
        };
        Aabb::new(at(0), at(7))
    }

    /// One of eight parts, of which all that is known holds.
    fn part(&self, octant: usize, corners: [Corner; 8]) -> Self {
        let half = self.edge / 2;
        Self { low: place(self.low, half, octant), edge: half, corners, ..*self }
    }

    fn parts(&self, lattice: &Grid) -> [Aabb; OCTANTS] {
        std::array::from_fn(|octant| self.part(octant, self.corners).cell(lattice))
    }

    /// With what else is known of its range.
    fn within(self, range: Range) -> Self {
        Self { range: Range { lower: self.range.lower.max(range.lower), upper: self.range.upper.min(range.upper) }, ..self }
    }
}

/// What is proven of a cell that has been looked at more closely.
struct Proof {
    /// Contains the distance minus what is told.
    known: Interval,
    /// Of each part, as far as the first that fails.
    parts: [Option<Interval>; OCTANTS],
}

/// What a list proves of a cell, and the lists and ranges of its parts where they were needed.
struct Listed {
    known: Interval,
    parts: Option<([Vec<Slot>; OCTANTS], [Range; OCTANTS])>,
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
        let prover = Prover::new(job.surface, job.planes);
        Self { job, prover, corners: HashMap::default(), cells: Vec::new(), scratch: Scratch::default(), lists: Vec::new() }
    }

    /// The cell of a tile.
    fn start(&mut self, low: [i64; 3], edge: i64) -> Start {
        let corners = std::array::from_fn(|octant| self.corner(place(low, edge, octant), &[], &[], None));
        Start { low, edge, corners, side: None, range: Range::ALL }
    }

    /// Looks at a cell: its range and its side.
    fn look(&self, start: Start) -> (Start, Aabb) {
        let (cell, mut start) = self.part(start);
        let surface = self.job.surface;
        if start.side.is_none() && start.range.lower > 0.0 && !surface.side_changes_at_surface_only() {
            let center = corner(surface, cell.center(), &[], &start.corners, None);
            start.side = side_of_ball(surface, &center, cell.radius() * (1.0 + 1e-12));
        }
        (start, cell)
    }

    /// Asks for the corners of the parts of a cell; stops, with false, at one whose side is certain that is farther than
    /// `limit` from what is told.
    fn sample(&mut self, start: &Start, halves: &mut Halves, told: &[f64; 27], list: &[Slot], limit: f64) -> bool {
        for number in INNER {
            let found = match halves.0[number] {
                Some(found) => found,
                None => {
                    let [x, y, z] = steps(number).map(|step| step * (start.edge / 2));
                    let found = self.corner([start.low[0] + x, start.low[1] + y, start.low[2] + z], list, &start.corners, start.side);
                    *halves.0[number].insert(found)
                }
            };
            if found.certain && (found.value - told[number]).abs() > limit {
                return false;
            }
        }
        true
    }

    /// Proves the parts of a cell one by one by their corners. Where one fails a cell will be divided, or its list is looked
    /// at, unless samples are enough.
    fn prove_parts(&self, start: &Start, halves: &Halves, told: &[f64; 27], limit: f64) -> Proof {
        let mut proof = Proof { known: NOTHING, parts: [None; OCTANTS] };
        for octant in 0..OCTANTS {
            let Some(corners) = halves.corners(octant) else { continue };
            let (cell, start) = self.part(start.part(octant, corners));
            let at = At { cell, range: start.range, side: start.side, corners, center: None, told: of_part(told, octant), list: &[] };
            let part = self.prover.coarse(&at, limit);
            proof.parts[octant] = Some(part);
            proof.known = proof.known.hull(part);
            if self.fails(part, limit) {
                proof.known = Interval::ALL;
                break;
            }
        }
        proof
    }

    /// Whether a part that is not proven any better decides that the cell is divided.
    fn fails(&self, part: Interval, limit: f64) -> bool {
        self.job.rules.rule == Rule::Verified && (part.upper > limit || part.lower < -limit)
    }

    /// Sharpens what is proven of a cell by its complete list, until it is within `limit`; `parts` are its parts and what is
    /// proven of them.
    fn prove_by_list(
        &mut self,
        start: &Start,
        at: At<'_>,
        parts: Option<(&Halves, &[f64; 27], Proof)>,
        known: Interval,
        limit: f64,
    ) -> Listed {
        let within = |error: Interval| error.upper <= limit && error.lower >= -limit;
        let (mut known, turn) = self.prover.fine(&at, known, limit);
        let Some((halves, told, proof)) = parts else { return Listed { known, parts: None } };
        if turn < 1.0 && !within(known) {
            let differences = halves.0.iter().zip(told).filter_map(|(found, told)| Some(Interval::exact((*found)?.value - told)));
            let differences = differences.fold(NOTHING, Interval::hull);
            known = known.intersection(self.prover.by_samples(&at, differences, 0.5 * at.cell.size().x, turn));
        }
        if within(known) {
            return Listed { known, parts: None };
        }
        let mut lists = self.lists.pop().unwrap_or_default();
        let ranges = refine(self.job.surface.tree(), &start.parts(self.job.lattice), at.list, &mut self.scratch, &mut lists);
        let mut whole = NOTHING;
        for octant in 0..OCTANTS {
            let Some(corners) = halves.corners(octant) else { continue };
            let (cell, start) = self.part(start.part(octant, corners).within(ranges[octant]));
            let told = of_part(told, octant);
            let at = At { cell, range: start.range, side: start.side, corners, center: None, told, list: &lists[octant] };
            let mut part = proof.parts[octant].unwrap_or_else(|| self.prover.coarse(&at, limit));
            if !within(part) {
                part = self.prover.fine(&at, part, limit).0;
            }
            whole = whole.hull(part);
            if self.fails(part, limit) {
                whole = Interval::ALL;
                break;
            }
        }
        Listed { known: known.intersection(whole), parts: Some((lists, ranges)) }
    }

    /// A part of a cell, and what follows from its corners.
    fn part(&self, start: Start) -> (Aabb, Start) {
        let cell = start.cell(self.job.lattice);
        let range = self.prover.range(&cell, &start.corners);
        let mut start = start.within(range);
        if start.side.is_none() && start.range.lower > 0.0 && self.job.surface.side_changes_at_surface_only() {
            start.side = one_side(&start.corners);
        }
        (cell, start)
    }

    /// Judges a cell and, where it is a branch, its parts. `list` is complete, where there is one.
    fn divide(&mut self, start: Start, list: Option<&[Slot]>, run: &Run<'_>) -> Result<()> {
        let Job { surface, lattice, depth, rules, leaves, .. } = *self.job;
        let (scale, tree) = (surface.scale(), surface.tree());
        let (mut start, cell) = self.look(start);
        let Start { low, edge, corners, .. } = start;
        let values = corners.map(|corner| (corner.value / scale) as f32);
        let told = values.map(|v| f64::from(v) * scale);
        let blended = blend(&told);
        let allowed = |range: Range| rules.allowed(range.lower / scale) * scale;
        let at = |start: &Start, center, list| At { cell, range: start.range, side: start.side, corners, center, told, list };
        let mut limit = allowed(start.range);
        let within = |error: Interval, limit: f64| error.upper <= limit && error.lower >= -limit;
        let mut known = self.prover.coarse(&at(&start, None, &[]), limit);
        let mut halves = Halves::new(&corners);
        let linear = leaves == Leaves::Linear;
        // A sample that is too far off ends the hope.
        let (mut close, mut proof) = (true, None);
        if edge > 1 && !(linear && within(known, limit)) {
            // The centre, which is a corner of the parts, tells the range.
            let center = self.corner(place(low, edge / 2, 7), list.unwrap_or(&[]), &corners, start.side);
            halves.0[CENTER] = Some(center);
            let (far, radius) = (center.value.abs(), cell.radius() * (1.0 + 1e-12));
            start = self.look(start.within(Range { lower: far - radius, upper: far + radius })).0;
            limit = allowed(start.range);
            close = !linear || self.sample(&start, &mut halves, &blended, list.unwrap_or(&[]), limit);
            if linear && close {
                let found = self.prove_parts(&start, &halves, &blended, limit);
                known = known.intersection(found.known);
                proof = Some(found);
            }
        }
        let range = start.range;
        let center = halves.0[CENTER].map(|center| center.foot);
        let done = linear && (within(known, limit) || !close);
        // Triangles are looked at where they can still tell something.
        let mut own = Vec::new();
        let witness = center.unwrap_or(corners[0].foot);
        let listed = list.is_some() || !done && gather_few(tree, &cell, witness, LISTED, &mut self.scratch, &mut own);
        let list = list.or_else(|| listed.then_some(own.as_slice()));
        let mut parts = None;
        if !done
            && linear
            && let Some(list) = list
        {
            let found = self.prove_by_list(&start, at(&start, center, list), proof.map(|proof| (&halves, &blended, proof)), known, limit);
            (known, parts) = (found.known, found.parts);
        }
        let leaf = match (leaves, list) {
            _ if edge == 1 => true,
            (Leaves::Exact, list) => range.lower >= FAR * cell.radius() || list.is_some_and(|list| list.len() <= LIST),
            (Leaves::Linear, _) => within(known, limit) || close && rules.rule == Rule::Samples,
        };
        let kind = match (leaf, leaves) {
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
            self.lists.extend(parts.map(|(lists, _)| lists));
            return Ok(());
        }
        self.sample(&start, &mut halves, &blended, list.unwrap_or(&[]), f64::INFINITY);
        if let (Some(list), None) = (list, &parts) {
            let mut lists = self.lists.pop().unwrap_or_default();
            let ranges = refine(tree, &start.parts(lattice), list, &mut self.scratch, &mut lists);
            parts = Some((lists, ranges));
        }
        for octant in 0..OCTANTS {
            let Some(corners) = halves.corners(octant) else { continue };
            let part = start.part(octant, corners);
            match &parts {
                Some((lists, ranges)) => self.divide(part.within(ranges[octant]), Some(&lists[octant]), run)?,
                None => self.divide(part, None, run)?,
            }
        }
        self.lists.extend(parts.map(|(lists, _)| lists));
        Ok(())
    }

    /// A lattice point of a cell, in the tree's units; `near` may be near it.
    fn corner(&mut self, place: [i64; 3], list: &[Slot], near: &[Corner], side: Option<Side>) -> Corner {
        let key = place.iter().fold(0, |key, &i| key << 21 | i as u64);
        let job = self.job;
        *self.corners.entry(key).or_insert_with(|| corner(job.surface, job.lattice.corner(place[0], place[1], place[2]), list, near, side))
    }

    /// An inner cell above the tiles.
    fn inner(&mut self, depth: u32, index: [u32; 3]) -> Node {
        let Job { surface, lattice, .. } = *self.job;
        let edge = 1i64 << (self.job.depth - depth);
        let values = std::array::from_fn(|octant| {
            let place = [0, 1, 2].map(|axis| (i64::from(index[axis]) + (octant >> axis & 1) as i64) * edge);
            let p = lattice.corner(place[0], place[1], place[2]);
            (corner(surface, p, &[], &[], None).value / surface.scale()) as f32
        });
        let record = Record::new(values, Interval::ALL);
        Node { depth, place: along_curve(index), kind: LevelKind::Branch, record, list: (ListSide::Asked, Box::default()) }
    }
}

/// The nearest point of the surface and the side of a point of a cell, in the tree's units. `near` are points that may be
/// near it, and `list` is complete, or empty where there is none.
fn corner(surface: &Surface, p: DVec3, list: &[Slot], near: &[Corner], side: Option<Side>) -> Corner {
    let tree = surface.tree();
    let found = if list.is_empty() || list.len() > SEARCHED {
        let nearer = |a: &&Corner, b: &&Corner| (a.foot - p).length_squared().total_cmp(&(b.foot - p).length_squared());
        let hint = near.iter().min_by(nearer).map_or(Slot(0), |corner| corner.near);
        tree.nearest(p, Candidate { distance_squared: tree.facet_at(hint).distance_squared(p), triangle: tree.triangle(hint) })
    } else {
        nearest(tree, list, p)
    };
    let foot = tree.facet(found.triangle).nearest(p);
    let side = side.unwrap_or_else(|| surface.side(p, &foot, found.triangle));
    Corner {
        value: side.sign() * foot.distance_squared.sqrt(),
        certain: side.is_certain(),
        point: p,
        foot: foot.point,
        near: tree.slots[found.triangle as usize],
    }
}

/// The one side of a cell that the surface does not touch, where the side changes at the surface only.
fn one_side(corners: &[Corner; 8]) -> Option<Side> {
    let certain = corners.iter().find(|corner| corner.certain)?;
    Some(if certain.value < 0.0 { Side::Inside } else { Side::Outside })
}

/// The one side of a ball that the surface does not touch, if that is certain.
fn side_of_ball(surface: &Surface, center: &Corner, radius: f64) -> Option<Side> {
    let triangle = surface.tree().triangle(center.near);
    surface.side_of_ball(center.point, &surface.tree().facet(triangle).nearest(center.point), triangle, radius)
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
