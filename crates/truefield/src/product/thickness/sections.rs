//! Heavy sections: the connected regions that are deeper than half a wall thickness.

use super::cells::{Ask, Cell, LEVELS, Octree, View};
use super::deepest::{Deepest, Region, before, deepest};
use super::volume::Linear;
use crate::error::Result;
use crate::geom::{Aabb, DVec3, Interval};
use crate::run::Run;

/// Cells kept at most; beyond it the answer stays right and gets coarser.
const BUDGET: usize = 1_000_000;

/// Rounds of splitting that bring the volumes' bounds together.
const VOLUME_ROUNDS: usize = 8;

/// Cells that the volumes may add.
const VOLUME_BUDGET: usize = 300_000;

/// Width of a volume interval that is good enough, as a share of the volume.
const VOLUME_GAP: f64 = 5e-3;

/// A connected region deeper than half the limit on wall thickness.
#[derive(Clone, Debug, PartialEq)]
pub struct HeavySection {
    /// The deepest place; at least `depth.lower` deep.
    pub point: DVec3,
    /// Contains the section's greatest depth; no wider than the tolerance.
    pub depth: Interval,
    /// Contains the section's volume, in cubic model units.
    pub volume: Interval,
    /// A box around the section; it may reach past it by a small part of `Sections::resolution`.
    pub bounds: Aabb,
    /// Centre of gravity, estimated from the cells.
    pub centroid: DVec3,
    /// Whether a point deeper than the limit was found; else the section may not exist.
    pub certain: bool,
}

/// All heavy sections of a part, deepest first.
///
/// * Every point deeper than `depth` lies in one of the sections.
/// * Two sections are truly apart: no path joins them at a greater depth than `depth`.
/// * Places reported as one section are joined by a path nowhere shallower than `joined`.
#[derive(Clone, Debug, PartialEq)]
pub struct Sections {
    /// The limit: half the wall thickness asked for. Strict: a section is deeper than this.
    pub depth: f64,
    /// Sorted by `depth.lower`, deepest first; ties by place.
    pub sections: Vec<HeavySection>,
    /// Depth at which all places of one section are surely joined: about `depth - tolerance` or
    /// better; less, and at worst 0, if the cell budget ended the refinement.
    pub joined: f64,
    /// Diagonal of the largest cell that is neither surely inside nor surely outside.
    pub resolution: f64,
    /// Cells that cover the sections.
    pub cells: usize,
}

/// A cell that belongs to a section.
#[derive(Clone, Copy)]
struct Leaf {
    cell: Cell,
    upper: f64,
    best: f64,
    place: DVec3,
    volume: Interval,
    bounds: Aabb,
    state: State,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    /// Every point is deep enough.
    Full,
    /// Holds a point so near the limit that the cell joins its neighbours.
    Settled,
    /// Must be split before anything can be said.
    Open,
}

/// Finds the connected regions deeper than `depth`, joined to within `tolerance`.
///
/// Cost: proportional to the area of the regions' boundary divided by `depth * tolerance`, because
/// all bounds are of second order in the cell size.
pub(super) fn sections(octree: &Octree<'_>, depth: f64, tolerance: f64, run: &Run<'_>) -> Result<Sections> {
    let search = Search { octree, depth, tolerance };
    let leaves = search.cover(run)?;
    let partial = || leaves.iter().filter(|leaf| leaf.state != State::Full);
    let resolution = partial().map(|leaf| octree.diagonal(leaf.cell.level)).fold(0.0, f64::max);
    let shallowest = partial().map(|leaf| leaf.best).fold(depth, f64::min);
    let joined = joined_depth(shallowest, resolution);
    let (labels, count) = connect(&leaves);
    let mut regions = vec![Region { seeds: Vec::new(), best: f64::NEG_INFINITY, place: DVec3::ZERO }; count];
    for (leaf, &label) in leaves.iter().zip(&labels) {
        let region = &mut regions[label];
        region.seeds.push((leaf.cell, leaf.upper));
        if leaf.best > region.best || (leaf.best == region.best && before(leaf.place, region.place)) {
            (region.best, region.place) = (leaf.best, leaf.place);
        }
    }
    let deepest = deepest(octree, regions, tolerance, depth, "heavy sections", run)?;
    let (leaves, labels) = search.measure(leaves, labels, count, run)?;
    let mut sections: Vec<HeavySection> = summarise(&leaves, &labels, &deepest, depth).into_iter().flatten().collect();
    sections.sort_by(|a, b| {
        let places = a.point.to_array().into_iter().zip(b.point.to_array());
        places.fold(b.depth.lower.total_cmp(&a.depth.lower), |order, (p, q)| order.then(p.total_cmp(&q)))
    });
    Ok(Sections { depth, sections, joined, resolution, cells: leaves.len() })
}

struct Search<'a> {
    octree: &'a Octree<'a>,
    depth: f64,
    tolerance: f64,
}

impl Search<'_> {
    /// Refines until every cell that may hold a deep point is full, or settled, or the budget is reached.
    fn cover(&self, run: &Run<'_>) -> Result<Vec<Leaf>> {
        let mut leaves = Vec::new();
        let mut cells = vec![Cell::ROOT];
        while !cells.is_empty() {
            let level = cells[0].level + 1;
            run.progress.report("heavy sections", level as usize, level as usize + 1);
            let mut open = Vec::new();
            for leaf in self.look(&cells, run)? {
                if leaf.state == State::Open { open.push(leaf) } else { leaves.push(leaf) }
            }
            if leaves.len() + 8 * open.len() > BUDGET || level == LEVELS {
                leaves.append(&mut open);
            }
            cells = open.iter().map(|leaf| leaf.cell).collect();
        }
        leaves.sort_unstable_by_key(|leaf| leaf.cell.code);
        Ok(leaves)
    }

    /// The children of the cells that may hold a deep point.
    fn look(&self, cells: &[Cell], run: &Run<'_>) -> Result<Vec<Leaf>> {
        let asked: Vec<Ask> = cells.iter().map(|&cell| Ask { cell, exceed: self.depth }).collect();
        let seen = self.octree.look(&asked, self.depth, run, |view| self.leaf(view))?;
        Ok(seen.into_iter().filter_map(|(leaf, _)| leaf).collect())
    }

    fn leaf(&self, view: &View<'_>) -> Leaf {
        let size = view.bounds.size();
        let content = size.x * size.y * size.z;
        let (volume, bounds, state);
        if view.lower > self.depth {
            volume = Interval { lower: content * (1.0 - 1e-12), upper: content * (1.0 + 1e-12) };
            (bounds, state) = (view.bounds, State::Full);
        } else {
            let (share, around) = self.part(view);
            volume = Interval { lower: content * share.lower, upper: content * share.upper };
            bounds = around;
            // Then any two deep points of cells that touch are joined as `joined_depth` says.
            let small = square(self.octree.diagonal(view.cell.level))
                <= self.tolerance * (self.depth - 0.75 * self.tolerance).max(self.tolerance / 64.0);
            let deep = view.best > self.depth - 0.5 * self.tolerance;
            state = if small && deep { State::Settled } else { State::Open };
        }
        Leaf { cell: view.cell, upper: view.upper, best: view.best, place: view.place, volume, bounds, state }
    }

    /// The share of the cell that is deep, and a box around that part.
    fn part(&self, view: &View<'_>) -> (Interval, Aabb) {
        let limit = self.depth;
        let radius = view.bounds.radius() * (1.0 + 1e-12);
        let lower = if view.lower > 0.0 {
            // u^2 >= trilinear(u_k^2) - r^2, see `cells`.
            let floor = limit + self.octree.rounding;
            Linear::fit(&view.distances.map(|u| u * u)).surely_above(floor * floor + radius * radius)
        } else {
            0.0
        };
        let mut upper = 1.0;
        let mut bounds = view.bounds;
        for column in view.columns {
            let linear = Linear::fit(column);
            upper = linear.possibly_above(limit - self.octree.rounding).min(upper);
            if let Some(part) = linear.possible_box(&view.bounds, limit - self.octree.rounding) {
                bounds = Aabb::new(bounds.min.max(part.min), bounds.max.min(part.max));
            }
        }
        if bounds.min.cmpgt(bounds.max).any() {
            // The parts below the single bounds do not meet: almost nothing is left of the cell.
            bounds = Aabb::new(view.place, view.place);
        }
        (Interval { lower, upper: upper.max(lower) }, bounds)
    }

    /// Splits the cells with the widest volume bounds until each section's volume is known well.
    fn measure(&self, mut leaves: Vec<Leaf>, mut labels: Vec<usize>, count: usize, run: &Run<'_>) -> Result<(Vec<Leaf>, Vec<usize>)> {
        let mut budget = VOLUME_BUDGET;
        for round in 0..VOLUME_ROUNDS {
            run.progress.report("volumes", round, VOLUME_ROUNDS);
            let mut volumes = vec![Interval::exact(0.0); count];
            let mut partial = vec![0usize; count];
            for (leaf, &label) in leaves.iter().zip(&labels) {
                volumes[label].lower += leaf.volume.lower;
                volumes[label].upper += leaf.volume.upper;
                partial[label] += usize::from(leaf.state != State::Full);
            }
            // What a cell's gap may be, were the allowed gap shared out evenly.
            let fair: Vec<f64> = volumes
                .iter()
                .zip(&partial)
                .map(|(v, &n)| if v.width() <= VOLUME_GAP * v.upper { f64::INFINITY } else { 0.5 * VOLUME_GAP * v.upper / n.max(1) as f64 })
                .collect();
            let mut wide: Vec<usize> = (0..leaves.len())
                .filter(|&i| leaves[i].state != State::Full && leaves[i].volume.width() > fair[labels[i]] && leaves[i].cell.level < LEVELS)
                .collect();
            wide.sort_by(|&a, &b| {
                let excess = |i: usize| leaves[i].volume.width() / fair[labels[i]];
                excess(b).total_cmp(&excess(a)).then(leaves[a].cell.cmp(&leaves[b].cell))
            });
            wide.truncate(budget / 8);
            if wide.is_empty() {
                break;
            }
            budget -= 8 * wide.len();
            wide.sort_unstable_by_key(|&i| leaves[i].cell.code);
            let cells: Vec<Cell> = wide.iter().map(|&i| leaves[i].cell).collect();
            let mut split = vec![false; leaves.len()];
            for &i in &wide {
                split[i] = true;
            }
            let kept = leaves.iter().zip(&labels).zip(&split).filter(|(_, split)| !**split).map(|(pair, _)| (*pair.0, *pair.1));
            let mut next: Vec<(Leaf, usize)> = kept.collect();
            for leaf in self.look(&cells, run)? {
                let parent = wide.partition_point(|&i| leaves[i].cell.code <= leaf.cell.code) - 1;
                next.push((leaf, labels[wide[parent]]));
            }
            next.sort_unstable_by_key(|(leaf, _)| leaf.cell.code);
            (leaves, labels) = next.into_iter().unzip();
        }
        Ok((leaves, labels))
    }
}

/// Depth above which the places of cells that touch are joined, if each has a place no shallower
/// than `shallowest` and is no larger across than `diagonal`.
///
/// Squared distance minus squared length is concave, so the segment between two points at distance
/// `s` is nowhere nearer to the surface than `sqrt(d^2 - s^2/4)`; here `s` is two diagonals.
fn joined_depth(shallowest: f64, diagonal: f64) -> f64 {
    (square(shallowest.max(0.0)) - square(diagonal)).max(0.0).sqrt()
}

/// Joins leaves that share a face. A path through an open region can be moved off edges and
/// corners, so regions that no chain of faces joins are truly apart.
fn connect(leaves: &[Leaf]) -> (Vec<usize>, usize) {
    let mut parent: Vec<usize> = (0..leaves.len()).collect();
    for (i, leaf) in leaves.iter().enumerate() {
        for code in (0..6).filter_map(|face| leaf.cell.neighbour(face)) {
            // The last leaf that starts no later; a smaller one there will look at us by itself.
            let Some(j) = leaves.partition_point(|l| l.cell.code <= code).checked_sub(1) else { continue };
            let other = leaves[j].cell;
            if other.level <= leaf.cell.level && code < other.code + other.span() {
                let (a, b) = (root(&mut parent, i), root(&mut parent, j));
                parent[a.max(b)] = a.min(b);
            }
        }
    }
    let mut names = vec![usize::MAX; leaves.len()];
    let mut count = 0;
    let label = |i: usize| {
        let r = root(&mut parent, i);
        if names[r] == usize::MAX {
            names[r] = count;
            count += 1;
        }
        names[r]
    };
    let labels = (0..leaves.len()).map(label).collect();
    (labels, count)
}

fn root(parent: &mut [usize], mut i: usize) -> usize {
    while parent[i] != i {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    i
}

fn square(x: f64) -> f64 {
    x * x
}

/// Adds up the cells of each section; `None` for those that turned out not to be deep enough.
fn summarise(leaves: &[Leaf], labels: &[usize], deepest: &[Deepest], depth: f64) -> Vec<Option<HeavySection>> {
    let mut sums: Vec<(Interval, Aabb, DVec3, f64)> = vec![(Interval::exact(0.0), Aabb::EMPTY, DVec3::ZERO, 0.0); deepest.len()];
    for (leaf, &label) in leaves.iter().zip(labels) {
        let (volume, bounds, moment, weight) = &mut sums[label];
        volume.lower += leaf.volume.lower;
        volume.upper += leaf.volume.upper;
        *bounds = bounds.union(leaf.bounds);
        let mass = 0.5 * (leaf.volume.lower + leaf.volume.upper);
        *moment += leaf.bounds.center() * mass;
        *weight += mass;
    }
    let section = |((volume, bounds, moment, weight), deepest): ((Interval, Aabb, DVec3, f64), &Deepest)| {
        (deepest.depth.upper > depth).then(|| HeavySection {
            point: deepest.point,
            depth: deepest.depth,
            volume: Interval { lower: volume.lower * (1.0 - 1e-12), upper: volume.upper * (1.0 + 1e-12) },
            bounds: if bounds.contains(deepest.point) { bounds } else { bounds.union(Aabb::new(deepest.point, deepest.point)) },
            centroid: if weight > 0.0 { moment / weight } else { deepest.point },
            certain: deepest.depth.lower > depth,
        })
    };
    sums.into_iter().zip(deepest).map(section).collect()
}
