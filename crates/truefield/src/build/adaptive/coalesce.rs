//! Trees of samples that are there already, from the leaves up.
//!
//! Frisken et al. 2000, bottom up: eight cells become one where the larger one says the same within the tolerance.

use crate::error::{Error, Result};
use crate::field::adaptive::{AdaptiveField, Division, Level, LevelKind, Levels, Record, Root, differences};
use crate::field::{Continuity, SampledField};
use crate::geom::{Aabb, DVec3, Interval};
use crate::run::Run;

use super::Rules;

/// Workers take cells of this depth.
const TILES: u32 = 3;

/// A cell and what is left below it.
struct Node {
    record: Record,
    /// Contains what the samples say, interpolated, minus what the corners say.
    differs: Interval,
    children: Option<Box<[Node; 8]>>,
}

/// The adaptive field of a sampled one: as many cells along every axis as the next power of two, of the samples' spacing.
///
/// Within the samples' lattice the field says what they say, interpolated, to within the tolerance and its growth; the
/// rest of the domain is filled outward from them. The errors are those of the samples, and what lies between them: half
/// a diagonal of their spacing, which no choice of the tolerance makes smaller.
pub fn coalesce(samples: &SampledField, rules: &Rules, run: &Run<'_>) -> Result<AdaptiveField> {
    rules.check()?;
    let lattice = samples.lattice();
    if lattice.shape.iter().any(|&n| n < 2) {
        let [x, y, z] = lattice.shape;
        return Err(Error::invalid(format!("{x} x {y} x {z} samples have no cells; give two or more along every axis")));
    }
    if samples.continuity() == Continuity::ExceptOpenings {
        return Err(Error::invalid(
            "the samples are of a mesh with openings, across which they jump; close the mesh, or take distances without sign",
        ));
    }
    if let Some(number) = samples.values().iter().position(|v| !v.is_finite()) {
        return Err(Error::invalid(format!("sample {number} is {}; an adaptive field needs finite values", samples.values()[number])));
    }
    let cells = lattice.shape.iter().fold(1, |cells, &n| cells.max(n - 1)).next_power_of_two();
    let depth = cells.trailing_zeros();
    if depth > rules.max_depth {
        return Err(Error::invalid(format!("max_depth is {}; {cells} cells along an axis need {depth}", rules.max_depth)));
    }
    let low = lattice.node(0);
    let root = Root { extent: Aabb::new(low, low + lattice.spacing * f64::from(cells)), division: Division::Octree };
    let builder = Builder { samples, rules, depth };
    let tiles = TILES.min(depth);
    let parts = run.blocks("merge the samples", 1 << (3 * tiles), |place| {
        run.cancel.check()?;
        let index = std::array::from_fn(|axis| (0..tiles).map(|bit| (place as u32 >> (3 * bit + axis as u32) & 1) << bit).sum());
        Ok(builder.node(tiles, index))
    })?;
    let mut nodes = parts;
    for _ in 0..tiles {
        let mut nodes_above = Vec::with_capacity(nodes.len() / 8);
        let mut rest = nodes.into_iter();
        while let Ok(children) = <[Node; 8]>::try_from(rest.by_ref().take(8).collect::<Vec<_>>()) {
            nodes_above.push(builder.join(children));
        }
        nodes = nodes_above;
    }
    let mut levels = Levels::new(root, samples.continuity(), rules.accuracy());
    let mut cells = 0;
    while !nodes.is_empty() {
        let mut level = Level::default();
        let mut below = Vec::new();
        for node in nodes {
            level.push(if node.children.is_some() { LevelKind::Branch } else { LevelKind::Linear }, node.record);
            below.extend(node.children.into_iter().flat_map(|children| *children));
        }
        cells += level.kinds.len() as u64;
        levels.levels.push(level);
        rules.fits(cells, below.len() as u64, || format!("{cells} cells so far; choose a larger tolerance or growth, or a max_depth"))?;
        nodes = below;
    }
    levels.derive_errors();
    AdaptiveField::from_levels(&levels, None, run)
}

struct Builder<'a> {
    samples: &'a SampledField,
    rules: &'a Rules,
    /// Of cells between samples.
    depth: u32,
}

impl Builder<'_> {
    fn node(&self, depth: u32, index: [u32; 3]) -> Node {
        if depth == self.depth {
            return self.cell(index);
        }
        self.join(std::array::from_fn(|octant| self.node(depth + 1, Division::Octree.child(index, octant))))
    }

    /// A cell between samples.
    fn cell(&self, index: [u32; 3]) -> Node {
        let corners: [(f32, Interval); 8] =
            std::array::from_fn(|corner| self.sample([0, 1, 2].map(|axis| index[axis] + (corner as u32 >> axis & 1))));
        // Distances change by no more than one moves: a mean of corners is off by no more than the mean way to them.
        let way = 0.5 * self.samples.lattice().spacing.length() * (1.0 + 1e-12);
        let known = corners.map(|(value, known)| known.plus(Interval::exact(-f64::from(value))));
        let error = known.into_iter().reduce(Interval::hull).unwrap_or(Interval::ALL).widen(way);
        let record = Record::new(corners.map(|(value, _)| value), error);
        Node { record, differs: Interval::exact(0.0), children: None }
    }

    /// A sample and its interval; beyond the lattice the nearest one's, as far as it may be off.
    fn sample(&self, index: [u32; 3]) -> (f32, Interval) {
        let lattice = self.samples.lattice();
        let inside: [u32; 3] = std::array::from_fn(|axis| index[axis].min(lattice.shape[axis] - 1));
        let [_, ny, nz] = lattice.shape.map(|n| n as usize);
        let number = (inside[0] as usize * ny + inside[1] as usize) * nz + inside[2] as usize;
        let (value, known) = (self.samples.values()[number], self.samples.interval(number));
        let steps = DVec3::from_array([0, 1, 2].map(|axis| f64::from(index[axis] - inside[axis])));
        let way = (steps * lattice.spacing).length() * (1.0 + 1e-12);
        ((f64::from(value) + way) as f32, known.widen(way))
    }

    /// Siblings, or the cell that says the same.
    fn join(&self, children: [Node; 8]) -> Node {
        let corners = std::array::from_fn(|corner| children[corner].record.corners[corner]);
        let plain = Record { corners, ..Record::default() };
        let (mut error, mut differs): (Option<Interval>, Option<Interval>) = (None, None);
        let mut least = f64::INFINITY;
        for (octant, child) in children.iter().enumerate() {
            let apart = differences(&plain, &child.record.corners, Division::Octree, octant);
            let hull = |all: Option<Interval>, one: Interval| Some(all.map_or(one, |all| all.hull(one)));
            error = hull(error, child.record.error().plus(apart));
            differs = hull(differs, child.differs.plus(apart));
            let range = child.record.range().plus(child.differs);
            least = least.min(range.lower.max(-range.upper).max(0.0));
        }
        let (error, differs) = (error.unwrap_or(Interval::ALL), differs.unwrap_or(Interval::ALL));
        let size = corners.iter().fold(0.0, |size: f64, v| size.max(f64::from(v.abs())));
        let record = Record::new(corners, error.widen(64.0 * f64::EPSILON * size));
        let leaves = children.iter().all(|child| child.children.is_none());
        let merge = leaves && differs.upper.max(-differs.lower) <= self.rules.allowed(least);
        Node { record, differs, children: (!merge).then(|| Box::new(children)) }
    }
}
