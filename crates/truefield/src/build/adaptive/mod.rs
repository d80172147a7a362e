//! Building adaptively sampled fields: a cell that does not say enough is divided.
//!
//! Frisken et al. 2000, top down. Level by level, so that a shape is asked for many points at once, and blocks of a
//! level are independent. The paper compares 19 points of a cell; here a cell is also proven, between its samples too
//! (`verify`), whichever rule divides it.

mod cell;
mod coalesce;
mod corner;
mod facets;
mod halves;
mod mesh;
mod planes;
mod triangles;
pub(crate) mod verify;

use crate::distance::{SampleBlock, Source};
use crate::error::{Error, Result};
use crate::field::Continuity;
use crate::field::adaptive::{Accuracy, AdaptiveField, Coverage, Division, Level, LevelKind, Levels, MAX_DEPTH, Record, Root};
use crate::geom::{Aabb, DVec3, Interval};
use crate::run::{Cancel, Run};

pub use crate::field::adaptive::Rule;
pub use coalesce::coalesce;
pub use mesh::{Leaves, adaptive_mesh};
use verify::{Layout, Said};

/// Cells whose children a worker takes in one go.
const CHUNK: usize = 64;

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

    /// Refuses a tolerance that is less than the rounding of the places in a tree, which no cell can reach.
    pub(crate) fn check_rounding(&self, root: &Root) -> Result<()> {
        let reach = root.extent.min.abs().max(root.extent.max.abs()).max_element();
        let least = f64::EPSILON * reach;
        if self.tolerance >= least {
            return Ok(());
        }
        Err(Error::invalid(format!(
            "a tolerance of {:e} is below what rounding leaves of coordinates up to {reach:e}; give at least {least:.1e}, better much more",
            self.tolerance
        )))
    }

    /// The largest error of a cell no point of which is nearer to the surface than `least`.
    pub(crate) fn allowed(&self, least: f64) -> f64 {
        self.accuracy().allowed(least)
    }

    /// Refuses to go on where `next` cells beside those that there are would not fit; `state` says how far it is, and what to choose.
    pub(crate) fn fits(&self, cells: u64, next: u64, state: impl FnOnce() -> String) -> Result<()> {
        let needed = cells * (size_of::<Record>() as u64 + 8) + next * DRAFT;
        if needed <= self.memory {
            return Ok(());
        }
        let what = format!("an adaptive field to a tolerance of {:?} ({})", self.tolerance, state());
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
    rules.check_rounding(&root)?;
    let layout = Layout::new(root.division, rules.reconstruction);
    let mut levels = Levels::new(root, Continuity::Everywhere, rules.accuracy());
    let mut parents = Vec::new();
    levels.coverage = Coverage::of(&root, source.extent());
    let mut cells = 0;
    for depth in 0.. {
        let builder = Builder { source, root, rules, layout, depth, cancel: run.cancel };
        // The root has no parent.
        let parts = if depth == 0 {
            vec![builder.first()?]
        } else {
            let whole = run.blocks("build the tree", parents.len().div_ceil(CHUNK), |block| {
                builder.divide(&parents[block * CHUNK..((block + 1) * CHUNK).min(parents.len())])
            })?;
            cells += (parents.len() * root.division.children()) as u64;
            whole
        };
        let branches: usize = parts.iter().map(|part| part.branches.len()).sum();
        let within = parts.iter().map(|part| part.worst).fold(0.0, f64::max);
        rules.fits(cells, (branches * root.division.children()) as u64, || {
            format!("depth {depth} with {cells} cells reaches {within:.3e}; choose a larger tolerance or growth, or a max_depth")
        })?;
        let mut level = Level::default();
        parents = Vec::with_capacity(branches);
        for part in parts {
            level.append(part.level);
            parents.extend(part.branches);
        }
        levels.levels.push(level);
        if parents.is_empty() {
            break;
        }
    }
    levels.derive_errors();
    AdaptiveField::from_levels(&levels, None, run)
}

/// A cell that is to be divided.
struct Branch {
    index: [u32; 3],
    /// Its samples, which are some of its children's; none where they are too many to be kept.
    samples: Vec<f64>,
}

/// What became of the children of a chunk of cells.
#[derive(Default)]
struct Part {
    level: Level,
    branches: Vec<Branch>,
    /// Largest difference at a sample of what is no leaf, or error of what is one.
    worst: f64,
}

/// A cell and all that is known of it.
struct Draft<'a> {
    index: [u32; 3],
    points: &'a [DVec3],
    samples: &'a [f64],
}

/// Divides cells into those of one level.
struct Builder<'a> {
    source: &'a dyn Source,
    root: Root,
    rules: &'a Rules,
    layout: Layout,
    /// Of the cells that are made.
    depth: u32,
    /// Looked at before every cell: a function may take long for each.
    cancel: &'a Cancel,
}

impl Builder<'_> {
    /// The root cell.
    fn first(&self) -> Result<Part> {
        let (mut part, mut points) = (Part::default(), Vec::new());
        self.layout.points(&self.root, 0, [0; 3], &mut points);
        let samples = self.ask(&points)?;
        self.judge(&Draft { index: [0; 3], points: &points, samples: &samples }, &mut part)?;
        Ok(part)
    }

    /// The children of some cells.
    fn divide(&self, parents: &[Branch]) -> Result<Part> {
        let (mut part, mut points, mut asked) = (Part::default(), Vec::new(), Vec::new());
        let all = self.layout.of_children();
        for parent in parents {
            let first = points.len();
            all.points(&self.root, self.depth - 1, parent.index, &mut points);
            let known = !parent.samples.is_empty();
            let new = points[first..].iter().zip(all.are_shared()).filter(|(_, shared)| !(known && *shared));
            asked.extend(new.map(|(p, _)| *p));
        }
        let mut asked = self.ask(&asked)?.into_iter();
        let (mut samples, mut child_points, mut child_samples) = (Vec::new(), Vec::new(), Vec::new());
        for (parent, points) in parents.iter().zip(points.chunks_exact(all.len())) {
            let mut known = parent.samples.iter().copied();
            samples.clear();
            samples.extend(all.are_shared().map(|shared| {
                let known = if shared { known.next() } else { None };
                known.or_else(|| asked.next()).unwrap_or(f64::NAN)
            }));
            for octant in 0..self.root.division.children() {
                child_points.clear();
                child_samples.clear();
                all.part(points, octant, &mut child_points);
                all.part(&samples, octant, &mut child_samples);
                let index = self.root.division.child(parent.index, octant);
                self.judge(&Draft { index, points: &child_points, samples: &child_samples }, &mut part)?;
            }
        }
        Ok(part)
    }

    fn ask(&self, points: &[DVec3]) -> Result<Vec<f64>> {
        let mut values = vec![0.0; points.len()];
        self.source.values(points, &mut values)?;
        match values.iter().position(|v| !v.is_finite() || v.abs() > f64::from(f32::MAX)) {
            Some(at) => Err(Error::invalid(format!(
                "the shape's distance at {} is {}; a field holds numbers that fit single precision",
                points[at], values[at]
            ))),
            None => Ok(values),
        }
    }

    /// Makes a leaf of a cell that says enough, and else a branch. What the samples alone refuse is not proven.
    fn judge(&self, draft: &Draft<'_>, part: &mut Part) -> Result<()> {
        self.cancel.check()?;
        let extent = self.root.cell(self.depth, draft.index);
        let block = self.layout.block(&extent, draft.points, draft.samples);
        let noise = self.source.noise_over(&extent);
        let allowed = self.rules.allowed(Layout::least(&block, noise)) + Layout::left_open(&extent, noise);
        let corners = self.layout.corners(draft.samples).map(|v| v as f32);
        let last = self.depth == self.rules.max_depth;
        let linear = self.layout.linear(&corners);
        let worst = linear.worst(&block);
        if last || worst <= allowed {
            let error = self.error(&block, &linear)?;
            if last || self.rules.rule == Rule::Samples || largest(error) <= allowed {
                part.worst = part.worst.max(largest(error));
                part.level.push(LevelKind::Linear, Record::new(corners, error.plus(self.source.slack(&extent))));
                return Ok(());
            }
        }
        if self.rules.reconstruction == Reconstruction::Cubic {
            let thirds = self.layout.thirds(draft.samples);
            let cubic = self.layout.cubic(&thirds);
            if cubic.worst(&block) <= allowed {
                let error = self.error(&block, &cubic)?;
                if self.rules.rule == Rule::Samples || largest(error) <= allowed {
                    part.worst = part.worst.max(largest(error));
                    part.level.push(LevelKind::Cubic, Record::new(corners, error.plus(self.source.slack(&extent))));
                    part.level.cubics.push(thirds);
                    return Ok(());
                }
            }
        }
        part.worst = part.worst.max(worst);
        part.level.push(LevelKind::Branch, Record::new(corners, Interval::ALL));
        // Of a fine lattice the children have few in common.
        let kept = self.rules.reconstruction == Reconstruction::Linear;
        part.branches.push(Branch { index: draft.index, samples: if kept { draft.samples.to_vec() } else { Vec::new() } });
        Ok(())
    }

    /// Contains the value minus what would be said.
    fn error(&self, block: &SampleBlock<'_>, said: &Said) -> Result<Interval> {
        let mut residual = vec![Interval::ALL; block.len()];
        self.source.residual(&block.with(block.values, &said.values), &mut residual)?;
        let error = said.error(block, &residual);
        if error.lower <= error.upper {
            return Ok(error);
        }
        Err(Error::invalid(format!(
            "what the shape says of the box from {} to {} contradicts itself: its values change by more than one moves, or bend more \
             than it says; give the true lipschitz constant, or values=\"bound\" where they are no distances",
            block.cell.min, block.cell.max
        )))
    }
}

/// The larger of two ends.
fn largest(error: Interval) -> f64 {
    error.upper.max(-error.lower)
}
