//! Building adaptively sampled fields: a cell that does not say enough is divided.
//!
//! Frisken et al. 2000, top down. Level by level, so that a shape is asked for many points at once, and blocks of a
//! level are independent. The paper compares 19 points of a cell; here a cell is also proven, between its samples too
//! (`verify`), whichever rule divides it.

mod coalesce;
mod facets;
mod mesh;
pub(crate) mod verify;

use crate::distance::Source;
use crate::error::{Error, Result};
use crate::field::Continuity;
use crate::field::adaptive::{Accuracy, AdaptiveField, Division, Level, LevelKind, Levels, MAX_DEPTH, Record, Root};
use crate::geom::{Aabb, DVec3, Interval};
use crate::run::Run;

pub use crate::field::adaptive::Rule;
pub use coalesce::coalesce;
pub use mesh::{Leaves, adaptive_mesh};
use verify::{Block, Found};

/// Cells a worker takes in one go.
const CHUNK: usize = 512;

/// Bytes of a cell while its level is built.
const DRAFT: u64 = 160;

/// How much wider than the shape the domain is, where none is asked for.
const MARGIN: f64 = 0.125;

/// How leaves interpolate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reconstruction {
    /// Trilinear, from eight corners.
    Linear,
    /// Tricubic, from 64 samples, in leaves where eight corners are not enough: smoother, and fewer leaves.
    Cubic,
}

/// What is asked of a tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rules {
    /// Largest error at the surface, a length.
    pub tolerance: f64,
    /// How much the error may grow per unit of distance from the surface: 0 for the same everywhere, infinite where only
    /// the surface matters.
    pub growth: f64,
    /// No cell is divided at this depth, whatever its error.
    pub max_depth: u32,
    /// When a cell says enough.
    pub rule: Rule,
    /// How leaves interpolate.
    pub reconstruction: Reconstruction,
    /// Bytes it may take while it is built.
    pub memory: u64,
}

impl Rules {
    /// To a tolerance at the surface, growing by a twentieth of the distance from it.
    pub fn within(tolerance: f64) -> Self {
        Self {
            tolerance,
            growth: 0.05,
            max_depth: MAX_DEPTH,
            rule: Rule::Verified,
            reconstruction: Reconstruction::Linear,
            memory: u64::MAX,
        }
    }

    /// What edits will go on to ask.
    pub(crate) fn accuracy(&self) -> Accuracy {
        Accuracy { tolerance: self.tolerance, growth: self.growth, max_depth: self.max_depth, rule: self.rule }
    }

    /// Refuses what cannot be asked for.
    pub(crate) fn check(&self) -> Result<()> {
        self.accuracy().check()
    }

    /// The largest error of a cell no point of which is nearer to the surface than `least`.
    pub(crate) fn allowed(&self, least: f64) -> f64 {
        self.accuracy().allowed(least)
    }

    /// Refuses to go on where the next level would not fit.
    pub(crate) fn fits(&self, depth: u32, cells: u64, next: u64, within: f64) -> Result<()> {
        let needed = cells * (size_of::<Record>() as u64 + 8) + next * DRAFT;
        if needed <= self.memory {
            return Ok(());
        }
        let what = format!(
            "an adaptive field to a tolerance of {} (depth {depth} with {cells} cells reaches {within:.3e}; choose a larger tolerance or growth, or a max_depth)",
            self.tolerance
        );
        Err(Error::Memory { what, needed, allowed: self.memory })
    }
}

/// The root cell for a shape: a cube around the domain, or around the shape's extent with room on all sides. A quadtree's
/// is a square column.
pub fn root(source: &dyn Source, domain: Option<Aabb>, division: Division) -> Result<Root> {
    let axes = division.axes();
    let longest = |extent: &Aabb| (0..axes).map(|axis| extent.size()[axis]).fold(0.0, f64::max);
    let mut asked = match (domain, source.extent()) {
        (Some(domain), _) => domain,
        (None, Some(extent)) => extent.grow(MARGIN * longest(&extent)),
        (None, None) => return Err(Error::invalid("the shape has no end; give a domain, the box that the field is to cover")),
    };
    let size = longest(&asked);
    if division == Division::Quadtree && !(asked.min.z.is_finite() && asked.max.z.is_finite()) {
        // Any stretch of z will do.
        (asked.min.z, asked.max.z) = (-0.5 * size, 0.5 * size);
    }
    if !(asked.min.is_finite() && asked.max.is_finite() && asked.min.cmple(asked.max).all() && size > 0.0) {
        return Err(Error::invalid(format!(
            "the domain from {} to {} is no box; give its lowest corner, then its highest",
            asked.min, asked.max
        )));
    }
    let mut extent = asked;
    for axis in 0..axes {
        let middle = asked.center()[axis];
        (extent.min[axis], extent.max[axis]) = (middle - 0.5 * size, middle + 0.5 * size);
    }
    if !(extent.min.cmplt(extent.max).all()) {
        return Err(Error::invalid("the domain is too thin to be divided; give a box with some room along every axis"));
    }
    Ok(Root { extent, division })
}

/// Builds the field of a shape in a domain, by default its extent with an eighth of it on all sides.
///
/// Every cell's error is proven, as far as the shape's bend and slack are. Cells are divided until their error is as small
/// as the rules ask, but for what the shape itself leaves open.
pub fn adaptive(source: &dyn Source, root: Root, rules: &Rules, run: &Run<'_>) -> Result<AdaptiveField> {
    rules.check()?;
    let corners: [DVec3; 8] = std::array::from_fn(|corner| root.extent.corner(corner));
    let mut first = [0.0; 8];
    source.values(&corners, &mut first)?;
    let mut frontier = vec![Draft { index: [0; 3], corners: first }];
    let mut levels = Levels::new(root, Continuity::Everywhere, rules.accuracy());
    let mut cells = 0;
    for depth in 0.. {
        let builder = Builder { source, root, rules, depth };
        let parts = run.blocks("build the tree", frontier.len().div_ceil(CHUNK), |block| {
            builder.divide(&frontier[block * CHUNK..((block + 1) * CHUNK).min(frontier.len())])
        })?;
        let next: usize = parts.iter().map(|part| part.children.len()).sum();
        cells += frontier.len() as u64;
        let within = parts.iter().map(|part| part.worst).fold(0.0, f64::max);
        rules.fits(depth, cells, next as u64, within)?;
        let mut level = Level::default();
        let mut children = Vec::with_capacity(next);
        for part in parts {
            level.append(part.level);
            children.extend(part.children);
        }
        levels.levels.push(level);
        if children.is_empty() {
            break;
        }
        frontier = children;
    }
    levels.make_monotone();
    AdaptiveField::from_levels(&levels, None, run)
}

/// A cell before its kind is known.
struct Draft {
    index: [u32; 3],
    corners: [f64; 8],
}

/// What became of a chunk of cells.
#[derive(Default)]
struct Part {
    level: Level,
    children: Vec<Draft>,
    /// Largest error of its cells.
    worst: f64,
}

/// Divides the cells of one level.
struct Builder<'a> {
    source: &'a dyn Source,
    root: Root,
    rules: &'a Rules,
    depth: u32,
}

impl Builder<'_> {
    fn divide(&self, cells: &[Draft]) -> Result<Part> {
        let mut part = Part::default();
        let block = Block::new(self.root.division, self.rules.reconstruction);
        let size = block.len();
        let mut points = Vec::with_capacity(cells.len() * size);
        for draft in cells {
            block.points(&self.root.cell(self.depth, draft.index), &mut points);
        }
        let mut values = vec![0.0; points.len()];
        self.source.values(&points, &mut values)?;
        if let Some(at) = values.iter().position(|v| !v.is_finite() || v.abs() > f64::from(f32::MAX)) {
            return Err(Error::invalid(format!(
                "the shape's distance at {} is {}; a field holds numbers that fit single precision",
                points[at], values[at]
            )));
        }
        let noise = self.source.noise();
        for (draft, values) in cells.iter().zip(values.chunks_exact(size)) {
            let extent = self.root.cell(self.depth, draft.index);
            let samples = block.samples(&draft.corners, values);
            let found = block.verify(&extent, &samples, self.source.bend(&extent), noise);
            let slack = self.source.slack(&extent);
            self.settle(draft, &block, &samples, &found, slack, &mut part);
        }
        Ok(part)
    }

    fn settle(&self, draft: &Draft, block: &Block, samples: &[f64], found: &Found, slack: Interval, part: &mut Part) {
        let allowed = self.rules.allowed(found.least);
        let enough = |proven: Interval, sampled: f64| match self.rules.rule {
            Rule::Verified => proven.upper.max(-proven.lower) <= allowed,
            Rule::Samples => sampled <= allowed,
        };
        let corners = draft.corners.map(|v| v as f32);
        let linear = Record::new(corners, found.linear.plus(slack));
        let error = found.linear.upper.max(-found.linear.lower);
        if enough(found.linear, found.linear_samples) {
            part.level.push(LevelKind::Linear, linear);
            part.worst = part.worst.max(error);
            return;
        }
        if let Some(cubic) = &found.cubic
            && enough(cubic.error, cubic.samples)
        {
            part.level.push(LevelKind::Cubic, Record::new(corners, cubic.error.plus(slack)));
            part.level.cubics.push(cubic.thirds);
            part.worst = part.worst.max(cubic.error.upper.max(-cubic.error.lower));
            return;
        }
        part.worst = part.worst.max(error);
        if self.depth == self.rules.max_depth {
            part.level.push(LevelKind::Linear, linear);
            return;
        }
        part.level.push(LevelKind::Branch, linear);
        let division = self.root.division;
        for octant in 0..division.children() {
            part.children.push(Draft { index: division.child(draft.index, octant), corners: block.corners_of_child(samples, octant) });
        }
    }
}
