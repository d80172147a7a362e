//! Trees of meshes: a cell is proven by its corners, its nearest points and, where they are few, its triangles. From a
//! cell's complete list the corners of all its parts are answered at once, and the parts' lists made of it.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::cell::{Part, Seen, Start, place, within};
use super::corner::{Corner, carry, corner, found, list_side, one_side, side_by, side_of, side_of_ball};
use super::facets::Prover;
use super::halves::{CENTER, Halves, INNER, blend, of_part};
use super::planes::Plane;
use super::{Rule, Rules};
use crate::bvh::cover::{OCTANTS, Range, Scratch, gather_few};
use crate::bvh::octants::{NODES, Octants, node};
use crate::bvh::tree::Slot;
use crate::error::{Error, Result};
use crate::field::Continuity;
use crate::field::adaptive::{AdaptiveField, Coverage, Division, Level, LevelKind, Levels, Record, Root, derive_errors};
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
const LONGEST: usize = 14;

/// Triangles of a cell that is not divided are listed where there are no more than this.
const LISTED: usize = 128;

/// Those of a cell that may be divided; its corners' nearest points shorten the list.
const MOST: usize = 2048;

/// Exact leaves this many times their half diagonal away are not divided for the sake of their lists, which are as long in
/// the parts.
const FAR: f64 = 3.0;

/// Squares of lengths up to this, in the tree's units, are numbers of single precision with room to spare, as lists need.
const FARTHEST: f64 = (1u64 << 60) as f64;

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
    /// By interpolation where that is within the tolerance, else by the triangles as soon as they are few.
    Mixed,
}

/// Builds the field of a mesh from its triangles; several times as quick as [`super::adaptive`], and proven more tightly.
///
/// Exact leaves are divided until their lists are short; the tolerance does not matter to them. Mixed ones are divided until
/// either is so, and a cell that is divided no more is exact where interpolation will not do.
pub fn adaptive_mesh(surface: &Arc<Surface>, root: Root, leaves: Leaves, rules: &Rules, run: &Run<'_>) -> Result<AdaptiveField> {
    rules.check()?;
    if root.division != Division::Octree {
        return Err(Error::invalid("a mesh is divided into an octree; a quadtree is for shapes that do not depend on z"));
    }
    let edge = root.extent.size().x;
    if !(root.extent.diagonal() + surface.mesh().extent().diagonal() < f64::from(f32::MAX)) {
        return Err(Error::invalid("the part is so large that its distances do not fit single precision; scale it down"));
    }
    rules.check_rounding(&root)?;
    let wanted = match leaves {
        // Half a diagonal of such a cell is within the tolerance.
        Leaves::Linear | Leaves::Mixed => rules.tolerance,
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
    let planes = if leaves == Leaves::Exact { Vec::new() } else { Plane::all(surface, run)? };
    let outer = Outer::new(surface, &lattice, tiles, run)?;
    let job = Job { surface, planes: &planes, lattice: &lattice, outer: &outer, depth, tiles, leaves, rules, cells: AtomicU64::new(0) };
    let parts = run.blocks("build the tree", 1 << (3 * tiles), |number| {
        let mut builder = Builder::new(&job);
        builder.tile(from_curve(number), run)?;
        derive_errors(&mut builder.levels, Division::Octree);
        Ok(builder.levels)
    })?;
    let continuity = if surface.side_changes_at_surface_only() { Continuity::Everywhere } else { Continuity::ExceptOpenings };
    let coverage = Coverage::of(&root, Some(surface.mesh().extent()));
    let mut levels: Vec<Level> = (0..tiles).map(|above| outer.level(above, scale)).collect();
    let mut last = Level::default();
    for root in &parts {
        last.push(root[0].kinds[0], root[0].records[0]);
    }
    levels.push(last);
    derive_errors(&mut levels, Division::Octree);
    let whole = Levels { coverage, levels, ..Levels::new(root, continuity, rules.accuracy()) };
    // Along the curve the cells of one tile follow those of the one before, at every depth.
    AdaptiveField::from_tiles(&whole, tiles, &parts, (leaves != Leaves::Linear).then(|| Arc::clone(surface)), run)
}

/// What all tiles share.
struct Job<'a> {
    surface: &'a Surface,
    planes: &'a [Plane],
    lattice: &'a Grid,
    outer: &'a Outer,
    /// Depth of single lattice cells.
    depth: u32,
    /// Depth of the tiles.
    tiles: u32,
    leaves: Leaves,
    rules: &'a Rules,
    cells: AtomicU64,
}

/// A bit for each part of which something holds.
fn bits(holds: impl Fn(usize) -> bool) -> u8 {
    (0..OCTANTS).fold(0, |bits, octant| bits | u8::from(holds(octant)) << octant)
}

/// Lists of parts of a cell, of which there is a bit each.
#[derive(Default)]
struct Parts {
    lists: [Vec<Slot>; OCTANTS],
    listed: u8,
}

/// The cells of one tile.
struct Builder<'a> {
    job: &'a Job<'a>,
    prover: Prover<'a>,
    /// Corners that were searched for in the tree, or whose sides are dear.
    corners: HashMap<u64, Corner, BuildHasherDefault<Mix>>,
    /// Those of the tile, from its own on, siblings side by side.
    levels: Vec<Level>,
    count: usize,
    scratch: Scratch,
    octants: Octants,
    /// Lists that no cell uses at present.
    lists: Vec<Parts>,
    owned: Vec<Vec<Slot>>,
    parts: Vec<Vec<Part>>,
}

impl<'a> Builder<'a> {
    fn new(job: &'a Job<'a>) -> Self {
        Self {
            job,
            prover: Prover::new(job.surface, job.planes),
            corners: HashMap::default(),
            levels: Vec::new(),
            count: 0,
            scratch: Scratch::default(),
            octants: Octants::default(),
            lists: Vec::new(),
            owned: Vec::new(),
            parts: Vec::new(),
        }
    }

    /// Builds a tile, of which there are so many before it along each axis.
    fn tile(&mut self, index: [i64; 3], run: &Run<'_>) -> Result<()> {
        let edge = 1 << (self.job.depth - self.job.tiles);
        let (low, corners) = (index.map(|index| index * edge), self.job.outer.corners(index, 1));
        let start = Start { low, edge, side: None, range: Range::ALL };
        let cell = start.cell(self.job.lattice);
        let tile = Part { start: self.look(start, &cell, &corners), cell, corners };
        self.divide(self.see(&tile), &[], run)
    }

    /// What follows for a cell from its corners: its range and its side.
    fn look(&self, start: Start, cell: &Aabb, corners: &[Corner; 8]) -> Start {
        let mut start = start.within(self.prover.range(cell, corners));
        if start.side.is_none() && start.range.lower > 0.0 && self.job.surface.side_changes_at_surface_only() {
            start.side = one_side(corners);
        }
        start
    }

    /// The side of a cell by one of its corners or a ball around it, where sides change elsewhere too; `near` are points that may be
    /// near its centre.
    fn settle(&self, mut start: Start, cell: &Aabb, corners: &[Corner; 8], near: &[Corner]) -> Start {
        let surface = self.job.surface;
        if start.side.is_none() && start.range.lower > 0.0 && !surface.side_changes_at_surface_only() {
            let radius = cell.radius() * (1.0 + 1e-12) + self.prover.slack(cell);
            let carries = |corner: &&Corner| carry(surface, corner) >= 2.0 * radius;
            let by_corner = corners.iter().find(carries).map(|corner| side_of(corner.value));
            start.side = by_corner.or_else(|| side_of_ball(surface, cell.center(), radius, near));
        }
        start
    }

    /// The parts of a cell whose corners are known.
    fn part(&self, start: &Start, halves: &Halves, octant: usize) -> Part {
        let (part, corners) = (start.part(octant), halves.corners(octant));
        let cell = part.cell(self.job.lattice);
        Part { start: self.look(part, &cell, &corners), cell, corners }
    }

    /// The largest error of a cell, in the tree's units.
    fn allowed(&self, start: &Start) -> f64 {
        let scale = self.job.surface.scale();
        self.job.rules.allowed(start.range.lower / scale) * scale
    }

    /// What a cell says, and what follows from its corners.
    fn see<'b>(&self, part: &'b Part) -> Seen<'b> {
        let scale = self.job.surface.scale();
        let Part { start, cell, corners } = part;
        let start = self.settle(*start, cell, corners, corners);
        let values = corners.map(|corner| (corner.value / scale) as f32);
        let told = values.map(|v| f64::from(v) * scale);
        let limit = self.allowed(&start);
        let mut seen = Seen { start, cell: *cell, corners, values, told, limit, known: Interval::ALL };
        seen.known = self.prover.coarse(&seen.at(&[]), limit);
        seen
    }

    /// Whether the corners alone prove a cell with linear leaves.
    fn is_proven(&self, seen: &Seen<'_>) -> bool {
        self.job.leaves != Leaves::Exact && seen.is_within()
    }

    /// How a leaf answers of which no more will be known.
    fn kind(&self, seen: &Seen<'_>) -> LevelKind {
        match self.job.leaves {
            Leaves::Mixed if !seen.is_within() => LevelKind::Exact,
            Leaves::Linear | Leaves::Mixed => LevelKind::Linear,
            Leaves::Exact => LevelKind::Exact,
        }
    }

    /// Judges a cell and, where it is a branch, its parts. `list` is complete, or empty where there is none.
    fn divide(&mut self, mut seen: Seen<'_>, list: &[Slot], run: &Run<'_>) -> Result<()> {
        let proven = self.is_proven(&seen);
        if seen.start.edge > 1 && !proven {
            return self.look_inside(seen, list, run);
        }
        let mut own = self.owned.pop().unwrap_or_default();
        let mut list = list;
        if list.is_empty() && !proven && self.gather(&seen, LISTED, &mut own) {
            list = &own;
        }
        if !proven && !list.is_empty() && self.job.leaves != Leaves::Exact {
            seen.known = self.prover.planes(&seen.at(list), seen.known).0;
        }
        let done = self.push_leaf(&seen, self.kind(&seen), list, run);
        self.owned.push(own);
        done
    }

    /// The complete list of a cell, of no more than about `most` triangles; none of cells so far off that lengths overflow.
    fn gather(&mut self, seen: &Seen<'_>, most: usize, list: &mut Vec<Slot>) -> bool {
        let (tree, feet) = (self.job.surface.tree(), seen.corners.map(|corner| corner.foot));
        let reach = (seen.cell.center() - tree.center).length() + seen.cell.radius() + tree.radius;
        reach <= FARTHEST && gather_few(tree, &seen.cell, &feet, most, &mut self.scratch, list)
    }

    /// Judges a cell by the corners of its parts, and divides it where that is not enough.
    fn look_inside(&mut self, mut seen: Seen<'_>, list: &[Slot], run: &Run<'_>) -> Result<()> {
        if self.job.leaves != Leaves::Linear && (1..=LIST).contains(&list.len()) {
            // Little more than its range is to be known of such a leaf.
            let ([x, y, z], tree) = (seen.start.node(CENTER), self.job.surface.tree());
            let center = self.job.lattice.corner(x, y, z);
            let squared = list.iter().fold(f64::INFINITY, |least, &slot| least.min(tree.facet_at(slot).distance_squared(center)));
            let corners = seen.corners;
            self.narrow(&mut seen, squared.sqrt(), corners);
            if self.job.leaves == Leaves::Mixed {
                seen.limit = self.allowed(&seen.start);
                seen.known = self.prover.planes(&seen.at(list), seen.known).0;
            }
            return self.push_leaf(&seen, self.kind(&seen), list, run);
        }
        let mut own = self.owned.pop().unwrap_or_default();
        let few = list.is_empty() && self.gather(&seen, MOST, &mut own);
        let mut halves = Halves::new(seen.corners);
        if few {
            let nodes = self.nodes(&seen.start);
            self.octants.shorten(self.job.surface.tree(), &seen.cell, &nodes, &seen.corners.map(|corner| corner.foot), &mut own);
            self.answer(&seen.start, &mut halves, &own);
        } else if !list.is_empty() {
            let nodes = self.nodes(&seen.start);
            self.octants.measure(self.job.surface.tree(), &seen.cell, &nodes, list);
            self.answer(&seen.start, &mut halves, list);
        } else {
            // The centre tells the range.
            self.ask(&seen.start, &mut halves, CENTER);
        }
        let list = if few { own.as_slice() } else { list };
        self.narrow(&mut seen, halves.corner(CENTER).value.abs(), std::slice::from_ref(halves.corner(CENTER)));
        seen.limit = self.allowed(&seen.start);
        let mut parts = self.parts.pop().unwrap_or_default();
        parts.clear();
        let few = (1..=LIST).contains(&list.len());
        let (leaf, lists) = match self.job.leaves {
            Leaves::Exact => ((few || seen.start.range.lower >= FAR * seen.cell.radius()).then_some(LevelKind::Exact), None),
            Leaves::Mixed if few => {
                seen.known = self.prover.planes(&seen.at(list), seen.known).0;
                (Some(self.kind(&seen)), None)
            }
            Leaves::Linear | Leaves::Mixed => {
                let (proven, lists) = self.prove(&mut seen, &mut halves, list, &mut parts);
                (proven.then_some(LevelKind::Linear), lists)
            }
        };
        let done = if let Some(kind) = leaf {
            self.lists.extend(lists);
            self.push_leaf(&seen, kind, list, run)
        } else {
            self.branch(&seen, &mut halves, list, lists, &mut parts, run)
        };
        self.owned.push(own);
        self.parts.push(parts);
        done
    }

    /// What follows for a cell from how far its centre is from the surface; `near` are points that may be near it.
    fn narrow(&self, seen: &mut Seen<'_>, far: f64, near: &[Corner]) {
        let radius = seen.cell.radius() * (1.0 + 1e-12) + self.prover.slack(&seen.cell);
        let start = seen.start.within(Range { lower: far - radius, upper: far + radius });
        seen.start = self.settle(self.look(start, &seen.cell, seen.corners), &seen.cell, seen.corners, near);
    }

    /// Whether a cell with linear leaves need not be divided; and the lists of its parts, where they were needed to know.
    fn prove(&mut self, seen: &mut Seen<'_>, halves: &mut Halves, list: &[Slot], parts: &mut Vec<Part>) -> (bool, Option<Parts>) {
        let blended = blend(&seen.told);
        // A sample that is too far off ends the hope.
        if !self.is_close(&seen.start, halves, &blended, seen.limit) {
            return (false, None);
        }
        let samples = self.job.rules.rule == Rule::Samples;
        if !list.is_empty() {
            // The cheapest look at the list says enough where the surface is smooth.
            let at = seen.at(list);
            let (mut known, slopes) = self.prover.planes(&at, seen.known);
            let certain = (0..NODES).all(|number| halves.corner(number).certain);
            if let Some(slopes) = slopes.filter(|_| certain && !within(known, seen.limit)) {
                let differences = std::array::from_fn(|number| halves.corner(number).value - blended[number]);
                known = known.intersection(self.prover.by_samples(&at, &differences, &slopes));
            }
            seen.known = known;
        }
        if seen.is_within() {
            return (true, None);
        }
        parts.extend((0..OCTANTS).map(|octant| self.part(&seen.start, halves, octant)));
        let limit = seen.limit;
        let coarse = |prover: &Prover<'_>, octant: usize| {
            let (part, told) = (&parts[octant], of_part(&blended, octant));
            let known = prover.coarse(&part.at(told, &[]), limit);
            if samples || within(known, limit) {
                return known;
            }
            prover.parts(&part.at(told, &[]), known, limit)
        };
        // Parts are looked at one by one. The first that fails decides, unless its list or the cell's says more.
        let mut by_corners = [Interval::ALL; OCTANTS];
        let mut failing = None;
        for (octant, known) in by_corners.iter_mut().enumerate() {
            *known = coarse(&self.prover, octant);
            if self.fails(*known, limit) {
                failing = Some(octant);
                break;
            }
        }
        if failing.is_none() {
            seen.known = seen.known.intersection(by_corners.into_iter().fold(NOTHING, Interval::hull));
        }
        if !samples && !list.is_empty() && !seen.is_within() {
            seen.known = self.prover.triangles(&seen.at(list), seen.known, limit);
        }
        if seen.is_within() || list.is_empty() {
            return (samples || seen.is_within(), None);
        }
        let mut lists = None;
        let by_list = |prover: &mut Prover<'_>, octant: usize, known: Interval, lists: &Parts| {
            let at = parts[octant].at(of_part(&blended, octant), &lists.lists[octant]);
            let known = prover.planes(&at, known).0;
            if samples || within(known, limit) {
                return known;
            }
            let known = prover.triangles(&at, known, limit);
            prover.triangles_in_parts(&at, known, limit)
        };
        if let Some(failing) = failing {
            let few = self.split(1 << failing, halves, list, None);
            by_corners[failing] = by_list(&mut self.prover, failing, by_corners[failing], &few);
            lists = Some(few);
            if self.fails(by_corners[failing], limit) {
                return (false, lists);
            }
            for octant in failing + 1..OCTANTS {
                by_corners[octant] = coarse(&self.prover, octant);
            }
        }
        let wanted = bits(|octant| !within(by_corners[octant], limit));
        let lists = self.split(wanted, halves, list, lists);
        let mut whole = NOTHING;
        for octant in 0..OCTANTS {
            let known = by_corners[octant];
            let known = if wanted >> octant & 1 == 1 { by_list(&mut self.prover, octant, known, &lists) } else { known };
            whole = whole.hull(known);
            if self.fails(known, limit) {
                whole = Interval::ALL;
                break;
            }
        }
        seen.known = seen.known.intersection(whole);
        (samples || seen.is_within(), Some(lists))
    }

    /// The complete lists of parts of the cell that was taken up; `lists` has some of them.
    fn split(&mut self, wanted: u8, halves: &Halves, list: &[Slot], lists: Option<Parts>) -> Parts {
        let mut parts = lists.unwrap_or_else(|| Parts { listed: 0, ..self.lists.pop().unwrap_or_default() });
        let missing = if list.is_empty() { 0 } else { wanted & !parts.listed };
        if missing != 0 {
            self.octants.split(missing, &halves.feet(), list, &mut parts.lists);
            parts.listed |= missing;
        }
        parts
    }

    /// Whether a part that is not proven any better decides that the cell is divided.
    fn fails(&self, part: Interval, limit: f64) -> bool {
        self.job.rules.rule == Rule::Verified && !within(part, limit)
    }

    /// Stores a leaf.
    fn push_leaf(&mut self, seen: &Seen<'_>, kind: LevelKind, list: &[Slot], run: &Run<'_>) -> Result<()> {
        let tree = self.job.surface.tree();
        let level = self.push(seen, kind, run)?;
        if kind == LevelKind::Exact {
            let kept = if list.len() <= LONGEST { list } else { &[] };
            level.lists.add(list_side(seen.start.side), kept.iter().map(|&slot| tree.triangle(slot)));
        }
        Ok(())
    }

    /// Stores a cell and divides it; `parts` are its parts, or none where they have not been looked at.
    fn branch(
        &mut self,
        seen: &Seen<'_>,
        halves: &mut Halves,
        list: &[Slot],
        lists: Option<Parts>,
        parts: &mut Vec<Part>,
        run: &Run<'_>,
    ) -> Result<()> {
        self.push(seen, LevelKind::Branch, run)?;
        if parts.is_empty() {
            (0..NODES).for_each(|number| self.ask(&seen.start, halves, number));
            parts.extend((0..OCTANTS).map(|octant| self.part(&seen.start, halves, octant)));
        }
        let parts: [_; OCTANTS] = std::array::from_fn(|octant| self.see(&parts[octant]));
        let wanted = bits(|octant| !self.is_proven(&parts[octant]));
        let lists = self.split(wanted, halves, list, lists);
        for (octant, part) in parts.into_iter().enumerate() {
            let list: &[Slot] = if lists.listed >> octant & 1 == 1 { &lists.lists[octant] } else { &[] };
            self.divide(part, list, run)?;
        }
        self.lists.push(lists);
        Ok(())
    }

    /// Stores a cell; the lists of its level are for the caller to keep up.
    fn push(&mut self, seen: &Seen<'_>, kind: LevelKind, run: &Run<'_>) -> Result<&mut Level> {
        let Job { surface, depth, tiles, rules, leaves, .. } = *self.job;
        let scale = surface.scale();
        let record = Record::new(seen.values, Interval { lower: seen.known.lower / scale, upper: seen.known.upper / scale });
        let level = depth - seen.start.edge.trailing_zeros();
        self.count += 1;
        if self.count.is_multiple_of(COUNTED) {
            run.cancel.check()?;
            let cells = self.job.cells.fetch_add(COUNTED as u64, Ordering::Relaxed) + COUNTED as u64;
            let other = if leaves == Leaves::Linear { ", or method mixed, which keeps triangles where cells would be many" } else { "" };
            rules.fits(cells, cells, || format!("{cells} cells so far; choose a larger tolerance or growth, or a max_depth{other}"))?;
        }
        let number = (level - tiles) as usize;
        self.levels.resize_with(self.levels.len().max(number + 1), Level::default);
        self.levels[number].push(kind, record);
        Ok(&mut self.levels[number])
    }

    /// Asks for the corners of the parts of a cell; stops, with false, at one whose side is certain that is farther than
    /// `limit` from what is told.
    fn is_close(&mut self, start: &Start, halves: &mut Halves, told: &[f64; NODES], limit: f64) -> bool {
        INNER.iter().all(|&number| {
            self.ask(start, halves, number);
            let found = halves.corner(number);
            !found.certain || (found.value - told[number]).abs() <= limit
        })
    }

    /// The corners of the parts of a cell.
    fn nodes(&self, start: &Start) -> [DVec3; NODES] {
        std::array::from_fn(|number| {
            let [x, y, z] = start.node(number);
            self.job.lattice.corner(x, y, z)
        })
    }

    /// Fills in the corners of the parts of the cell that was taken up, from its complete list.
    fn answer(&mut self, start: &Start, halves: &mut Halves, list: &[Slot]) {
        let Job { surface, lattice, .. } = *self.job;
        self.octants.nearest(surface.tree(), list);
        let parted = surface.side_changes_at_surface_only();
        let near: [Corner; 8] = std::array::from_fn(|corner| *halves.corner(node(corner, corner)));
        let carries = if start.side.is_none() { near.each_ref().map(|corner| carry(surface, corner)) } else { [0.0; 8] };
        for number in INNER {
            let place = start.node(number);
            let (p, answer) = (lattice.corner(place[0], place[1], place[2]), self.octants.found(number));
            let side = start.side.or_else(|| side_by(surface, p, answer.nearest.distance_squared.sqrt(), &near, &carries));
            let found = || found(surface, p, answer, side);
            // Only sides that have to be asked are dear.
            let cheap = parted || side.is_some();
            halves.set(number, if cheap { found() } else { *self.corners.entry(key(place)).or_insert_with(found) });
        }
    }

    /// Fills in one corner of the parts of a cell, where it is not known, by the tree.
    fn ask(&mut self, start: &Start, halves: &mut Halves, number: usize) {
        if !halves.knows(number) {
            let found = self.corner(start.node(number), halves.all(), start.side);
            halves.set(number, found);
        }
    }

    /// A lattice point of a cell, in the tree's units; `near` may be near it.
    fn corner(&mut self, place: [i64; 3], near: &[Corner], side: Option<Side>) -> Corner {
        let job = self.job;
        let found = || corner(job.surface, job.lattice.corner(place[0], place[1], place[2]), near, side);
        *self.corners.entry(key(place)).or_insert_with(found)
    }
}

/// The corners of all tiles.
struct Outer {
    /// x fastest.
    corners: Vec<Corner>,
    /// Tiles along each axis.
    edge: i64,
}

impl Outer {
    fn new(surface: &Surface, lattice: &Grid, tiles: u32, run: &Run<'_>) -> Result<Self> {
        let (edge, step) = (1 << tiles, i64::from(lattice.shape[0] >> tiles));
        let rows = run.blocks("look at the corners", ((edge + 1) * (edge + 1)) as usize, |row| {
            let (y, z) = (row as i64 % (edge + 1), row as i64 / (edge + 1));
            let mut corners: Vec<Corner> = Vec::new();
            for x in 0..=edge {
                let near = corners.last().copied();
                corners.push(corner(surface, lattice.corner(x * step, y * step, z * step), near.as_slice(), None));
            }
            Ok(corners)
        })?;
        Ok(Self { corners: rows.concat(), edge })
    }

    /// Those of a cell of so many tiles along each axis, before which there are so many tiles.
    fn corners(&self, low: [i64; 3], edge: i64) -> [Corner; 8] {
        std::array::from_fn(|octant| {
            let [x, y, z] = place(low, edge, octant);
            self.corners[((z * (self.edge + 1) + y) * (self.edge + 1) + x) as usize]
        })
    }

    /// A level above the tiles.
    fn level(&self, depth: u32, scale: f64) -> Level {
        let (mut level, edge) = (Level::default(), self.edge >> depth);
        for number in 0..1 << (3 * depth) {
            let corners = self.corners(from_curve(number).map(|index| index * edge), edge);
            level.push(LevelKind::Branch, Record::new(corners.map(|corner| (corner.value / scale) as f32), Interval::ALL));
        }
        level
    }
}

/// A number for each lattice point.
fn key(place: [i64; 3]) -> u64 {
    place.iter().fold(0, |key, &i| key << 21 | i as u64)
}

/// The index along each axis of a place on the curve that visits siblings in their order.
fn from_curve(place: usize) -> [i64; 3] {
    std::array::from_fn(|axis| (0..TILES).map(|bit| (place >> (3 * bit as usize + axis) & 1) as i64 * (1 << bit)).sum())
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
