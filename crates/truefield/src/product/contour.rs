//! Contours: the points at a given distance, to any tolerance.
//!
//! Huang et al. subdivide voxels and keep sub-voxel centres whose distance is within E/2 of the wanted one. Their
//! sub-voxels, (sqrt(3)/2) s < E, are too coarse for that band: a contour can pass between them. With s <= E / sqrt(3)
//! every contour point lies within E/2 of some sub-voxel centre c, so |d(c) - t| <= E/2 and c is kept. Both hold:
//! every sample is within E/2 of the distance value, every contour point within E/2 of a sample.
//!
//! Sub-voxels are never laid out: blocks of them are halved while the contour may pass (|d| is 1-Lipschitz).

use std::sync::atomic::{AtomicU64, Ordering};

use crate::build::sides::{Sides, slots};
use crate::bvh::Candidate;
use crate::bvh::cover::Range;
use crate::bvh::descend::{Block, Descent, Span, Step, Visit};
use crate::bvh::evaluate::{Answers, Points, Rows, evaluate};
use crate::error::{Error, Result};
use crate::geom::{DVec3, Foot};
use crate::grid::Grid;
use crate::run::Run;
use crate::source::mesh::{Side, Surface};

/// Edge of the blocks of sub-voxels that are answered at once.
const EDGE: i64 = 4;

/// Edge of the blocks of sub-voxels for which lists are gathered.
const FINE: i64 = 32;

/// Blocks along the longest side that workers take, at least.
const TILES: f64 = 16.0;

/// Where the samples of a contour lie.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Placement {
    /// At sub-voxel centres: the distance is within E/2, coverage within E/2.
    #[default]
    Lattice,
    /// Moved along the gradient onto the contour where that is possible: the distance is exact there, within E/2
    /// where the medial axis is nearer than the contour; coverage within E.
    Projected,
}

/// Samples of a contour.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contour {
    /// Positions, model units.
    pub points: Vec<DVec3>,
    /// Unit gradients of the signed distance: the papers' cases C1, C2 and C3.
    pub normals: Vec<DVec3>,
    /// Nearest triangle of each sample.
    pub triangles: Vec<u32>,
}

/// Bytes that a sample takes.
const BYTES: u64 = 2 * size_of::<DVec3>() as u64 + 4;

/// Samples the contour at signed `distance` (negative inside) to within `tolerance`, both in model units.
///
/// Takes memory proportional to the contour, 52 bytes a sample, and refuses more than `memory` bytes. The samples come
/// in the order of their blocks, the same for any number of threads.
pub fn contour(surface: &Surface, distance: f64, tolerance: f64, placement: Placement, memory: u64, run: &Run<'_>) -> Result<Contour> {
    let lattice = lattice(surface, distance, tolerance)?;
    let scale = surface.scale();
    let scaled = Grid { origin: lattice.origin * scale, spacing: lattice.spacing * scale, ..lattice };
    let longest = lattice.shape.iter().copied().max().unwrap_or(1);
    let mut edge = EDGE;
    while f64::from(longest) / (2 * edge) as f64 >= TILES {
        edge *= 2;
    }
    let tiles = Block::tiles(&scaled, edge);
    let count = AtomicU64::new(0);
    let parts = run.blocks("trace the contour", tiles.len(), |index| {
        let mut tracer = Tracer::new(surface, &scaled, distance * scale, tolerance * scale, placement);
        let mut descent = Descent::new(surface.tree(), &scaled, Span::Points);
        let window = tracer.band();
        let mut seen = 0;
        descent.survey(tiles[index], edge, FINE, window, &mut |visit| {
            seen += 1;
            if seen % 256 == 0 {
                run.cancel.check()?;
            }
            Ok(tracer.visit(visit))
        })?;
        let samples = tracer.out.points.len() as u64;
        let needed = (count.fetch_add(samples, Ordering::Relaxed) + samples) * BYTES;
        if needed > memory {
            return Err(Error::Memory { what: format!("a contour at tolerance {tolerance:?}"), needed, allowed: memory });
        }
        Ok(tracer.out)
    })?;
    let total = count.into_inner() as usize;
    let mut out = Contour { points: Vec::with_capacity(total), normals: Vec::with_capacity(total), triangles: Vec::with_capacity(total) };
    for part in parts {
        out.points.extend(part.points.iter().map(|&p| p / scale));
        out.normals.extend(part.normals);
        out.triangles.extend(part.triangles);
    }
    Ok(out)
}

/// The lattice of sub-voxel centres around all points at `distance`.
fn lattice(surface: &Surface, distance: f64, tolerance: f64) -> Result<Grid> {
    let extent = surface.mesh().extent();
    if !distance.is_finite() {
        return Err(Error::invalid(format!("the contour's distance must be a finite length, not {distance}")));
    }
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(Error::invalid(format!("the tolerance must be a positive length, not {tolerance:?}")));
    }
    let grown = extent.grow(distance.max(0.0) + tolerance);
    let reach = grown.min.abs().max(grown.max.abs()).max_element();
    let spacing = tolerance / 3.0_f64.sqrt() * (1.0 - 1e-9);
    let least = (reach * 1e-13).max(grown.size().max_element() / 2e9);
    if spacing < least {
        return Err(Error::invalid(format!(
            "a tolerance of {tolerance:?} is far below what rounding allows for coordinates up to {reach:e}; use at least {:.1e}",
            least * 2.0
        )));
    }
    Ok(Grid::with_spacing(&grown, spacing))
}

/// The samples of one tile.
struct Tracer<'a> {
    surface: &'a Surface,
    lattice: &'a Grid,
    /// All in the tree's units.
    distance: f64,
    half: f64,
    placement: Placement,
    sides: Sides<'a>,
    rows: Rows,
    answers: Answers,
    out: Contour,
}

impl<'a> Tracer<'a> {
    fn new(surface: &'a Surface, lattice: &'a Grid, distance: f64, tolerance: f64, placement: Placement) -> Self {
        let (rows, answers, out) = (Rows::default(), Answers::NONE, Contour::default());
        Self { surface, lattice, distance, half: 0.5 * tolerance, placement, sides: Sides::new(surface), rows, answers, out }
    }

    /// The unsigned distances of samples, a little wider than the band for rounding.
    fn band(&self) -> Range {
        let half = self.half * (1.0 + 1e-9);
        Range { lower: (self.distance.abs() - half).max(0.0), upper: self.distance.abs() + half }
    }

    fn wanted(&self, side: Side) -> bool {
        // At distance 0 both sides are near enough.
        side.sign() * self.distance >= 0.0 || self.distance.abs() <= self.half
    }

    fn visit(&mut self, at: Visit<'_>) -> Step {
        let band = self.band();
        if !at.range.meets(band) {
            return Step::Done;
        }
        let side = self.sides.of_block(&at);
        if side.is_some_and(|side| !self.wanted(side)) {
            return Step::Done;
        }
        if at.block.edge() > EDGE {
            return Step::Refine;
        }
        let points = Points::of_block(self.lattice, &at.block);
        evaluate(self.surface.tree(), &at.cell, &points, at.list, band, &mut self.rows, &mut self.answers);
        let sides = side.map_or_else(|| self.sides.of_points(&at.block, self.lattice.spacing, &points, &self.answers), |s| [s; 64]);
        for (i, _) in slots(&at.block) {
            let triangle = self.answers.triangle[i];
            if triangle == u32::MAX {
                continue;
            }
            let foot = self.answers.foot(i);
            let distance = sides[i].sign() * foot.distance_squared.sqrt();
            if (distance - self.distance).abs() <= self.half {
                self.keep(DVec3::new(points.x[i], points.y[i], points.z[i]), triangle, foot, sides[i]);
            }
        }
        Step::Done
    }

    fn keep(&mut self, p: DVec3, triangle: u32, foot: Foot, side: Side) {
        let tree = self.surface.tree();
        let foot = tree.facet(triangle).at(foot);
        let normal = self.surface.normal(p, &foot, triangle, side);
        let (mut point, mut nearest) = (p, triangle);
        if self.placement == Placement::Projected {
            let moved = foot.point + normal * self.distance;
            // Outward of the sample another part of the surface may be nearer.
            let found = tree.nearest(moved, Candidate::within(self.distance.abs() * (1.0 + 1e-12) + self.half));
            let off = (found.distance_squared.sqrt() - self.distance.abs()).abs();
            let rounding = 1e-9 * self.half + 8.0 * f64::EPSILON * moved.abs().max_element();
            if found.found() && off <= rounding && (moved - p).length() <= self.half * (1.0 + 1e-9) {
                (point, nearest) = (moved, found.triangle);
            }
        }
        self.out.points.push(point);
        self.out.normals.push(normal);
        self.out.triangles.push(nearest);
    }
}
