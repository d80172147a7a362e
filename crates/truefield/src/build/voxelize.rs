//! Voxels of a surface: those it touches, thin ones that separate its sides, those inside.
//!
//! Blocks of voxels are halved with ever shorter lists of candidates ([`crate::bvh::cover`]) down to four
//! voxels an edge; there the nearest triangles of all centres are found at once and settle most voxels. The rest ask the
//! triangles of the list: one that touches a voxel has distance 0 somewhere in it, so a complete list holds one such.
//!
//! Thin voxels after Laine, *A topological approach to voxelization* (2013): a voxel counts where the surface meets
//! the segments from its centre to the centres of its neighbours. Every path of neighbours runs along such segments, so none crosses
//! the surface without meeting a marked voxel.

use super::sides::{Sides, slots};
use super::tiles::{Dense, TILE, Tile};
use crate::bvh::cover::Range;
use crate::bvh::descend::{Block, Descent, Span, Step, Visit};
use crate::bvh::evaluate::{Answers, BLOCK, Points, Rows, evaluate};
use crate::bvh::tree::Slot;
use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3, triangle_meets_segment, triangle_overlaps_box};
use crate::grid::Grid;
use crate::run::Run;
use crate::source::mesh::{Side, Surface};

/// Edge of the blocks whose centres are answered at once.
const EDGE: i64 = 4;

/// Which voxels count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rule {
    /// Every voxel that the surface touches, its faces included.
    #[default]
    Conservative,
    /// Voxels that no path over common faces gets around: the surface meets a segment between the centres of two faces.
    Separating6,
    /// Voxels that no path over common faces, edges or corners gets around.
    Separating26,
    /// Voxels whose centre is inside.
    Solid,
}

/// The surface nearest to the centre of a marked voxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Near {
    /// Linear index of the voxel, x slowest.
    pub voxel: u64,
    /// The nearest triangle; the lowest index where several tie.
    pub triangle: u32,
    /// From the centre to that triangle, model units, not signed.
    pub distance: f64,
}

/// Marked voxels.
#[derive(Clone, Debug, PartialEq)]
pub struct Voxels {
    /// Voxel (i, j, k) is cell (i, j, k).
    pub grid: Grid,
    /// One for each voxel, x slowest.
    pub marks: Vec<bool>,
    /// For each marked voxel, in order, what is nearest; empty for [`Rule::Solid`].
    pub near: Vec<Near>,
    /// Voxels whose side could not be decided; [`Rule::Solid`] marks them by the better guess. 0 for the other rules.
    pub doubtful: u64,
}

impl Voxels {
    /// Index of a voxel along each axis, from its linear one.
    pub fn index(&self, voxel: u64) -> [u64; 3] {
        let [_, ny, nz] = self.grid.shape.map(u64::from);
        [voxel / (ny * nz), voxel / nz % ny, voxel % nz]
    }
}

/// Marks voxels of `surface` among the cells of `grid`.
///
/// Takes a byte a voxel and 24 for every marked voxel of the surface; refuses more than `memory` bytes.
pub fn voxelize(surface: &Surface, grid: &Grid, rule: Rule, memory: u64, run: &Run<'_>) -> Result<Voxels> {
    let wanted = match rule {
        Rule::Conservative => Wanted { touch: Some(Touch::Box), sides: Asked::Never },
        Rule::Separating6 => Wanted { touch: Some(Touch::Cross), sides: Asked::Never },
        Rule::Separating26 => Wanted { touch: Some(Touch::Star), sides: Asked::Never },
        Rule::Solid => Wanted { touch: None, sides: Asked::Everywhere },
    };
    let found = classify(surface, grid, wanted, memory, run)?;
    let bit = if rule == Rule::Solid { INSIDE } else { TOUCHED };
    // In the memory of the classes.
    let marks = found.classes.into_iter().map(|class| class & bit != 0).collect();
    Ok(Voxels { grid: *grid, marks, near: found.near, doubtful: found.doubtful })
}

/// The surface counts in the voxel.
pub(crate) const TOUCHED: u8 = 1;
/// The centre is inside, by the better guess.
pub(crate) const INSIDE: u8 = 2;
/// It cannot be decided whether the centre is inside.
pub(crate) const DOUBTFUL: u8 = 4;

/// What of a voxel the surface has to meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Touch {
    /// Any point.
    Box,
    /// The segments between the centres of opposite faces.
    Cross,
    /// The segments between opposite centres of faces, of edges, and corners.
    Star,
}

/// Whether sides are asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Asked {
    Everywhere,
    Never,
}

/// What is asked of voxels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wanted {
    pub touch: Option<Touch>,
    pub sides: Asked,
}

/// What was found of voxels.
#[derive(Debug)]
pub(crate) struct Classified {
    /// Bits [`TOUCHED`], [`INSIDE`] and [`DOUBTFUL`] of each voxel.
    pub classes: Vec<u8>,
    /// In order of voxels.
    pub near: Vec<Near>,
    pub doubtful: u64,
}

/// Classes of all cells of `grid`.
pub(crate) fn classify(surface: &Surface, grid: &Grid, wanted: Wanted, memory: u64, run: &Run<'_>) -> Result<Classified> {
    let needed = grid.shape.iter().fold(1u64, |bytes, &n| bytes.saturating_mul(u64::from(n)));
    if needed > memory {
        let [x, y, z] = grid.shape;
        return Err(Error::Memory { what: format!("{x} x {y} x {z} voxels"), needed, allowed: memory });
    }
    let scale = surface.scale();
    let scaled = Grid { origin: grid.origin * scale, spacing: grid.spacing * scale, ..*grid };
    let mut classes = vec![0u8; grid.len()];
    let dense = Dense::new(&scaled, &mut classes);
    let tiles = Block::tiles(&scaled, TILE);
    // Sides of far tiles may need their lists, touched voxels are near.
    let window = if wanted.sides == Asked::Never { Range { lower: 0.0, upper: 0.0 } } else { Range::ALL };
    let parts = run.blocks("voxels", tiles.len(), |index| {
        let mut marker = Marker::new(surface, &scaled, wanted, tiles[index]);
        let mut descent = Descent::new(surface.tree(), &scaled, Span::Cells);
        descent.tile(tiles[index], TILE, window, &mut |visit| {
            run.cancel.check()?;
            Ok(marker.visit(visit))
        })?;
        dense.write(&marker.classes);
        Ok((marker.near, marker.doubtful))
    })?;
    drop(dense);
    let doubtful = parts.iter().map(|(_, doubtful)| doubtful).sum();
    let mut near: Vec<Near> = parts.into_iter().flat_map(|(near, _)| near).collect();
    near.sort_unstable_by_key(|near| near.voxel);
    Ok(Classified { classes, near, doubtful })
}

/// One tile in the making, in the tree's units.
struct Marker<'a> {
    surface: &'a Surface,
    grid: &'a Grid,
    /// The cells' centres as the corners of another grid.
    centers: Grid,
    wanted: Wanted,
    classes: Tile<u8>,
    near: Vec<Near>,
    doubtful: u64,
    sides: Sides<'a>,
    rows: Rows,
    answers: Answers,
}

impl<'a> Marker<'a> {
    fn new(surface: &'a Surface, grid: &'a Grid, wanted: Wanted, tile: Block) -> Self {
        Self {
            surface,
            grid,
            centers: Grid { origin: grid.origin + 0.5 * grid.spacing, ..*grid },
            wanted,
            classes: Tile::new(tile, 0),
            near: Vec::new(),
            doubtful: 0,
            sides: Sides::new(surface),
            rows: Rows::default(),
            answers: Answers::NONE,
        }
    }

    fn visit(&mut self, at: Visit<'_>) -> Step {
        let clear = at.range.lower > 0.0;
        if clear && self.wanted.sides == Asked::Never {
            return Step::Done;
        }
        let side = if self.wanted.sides == Asked::Everywhere { self.sides.of_block(&at) } else { None };
        if let Some(side) = side
            && clear
        {
            self.classes.fill(&at.block, class(side));
            return Step::Done;
        }
        if at.block.edge() > EDGE {
            return Step::Refine;
        }
        let points = Points::of_block(&self.centers, &at.block);
        evaluate(self.surface.tree(), &at.cell, &points, at.list, Range::ALL, &mut self.rows, &mut self.answers);
        if self.wanted.sides == Asked::Everywhere {
            let sides = self.sides.of_points(&at.block, self.grid.spacing, &points, &self.answers);
            self.store_sides(&at.block, &sides);
        }
        if let Some(touch) = self.wanted.touch
            && !clear
        {
            self.store_touched(&at, &points, touch);
        }
        Step::Done
    }

    fn store_sides(&mut self, block: &Block, sides: &[Side; BLOCK]) {
        for (i, local) in slots(block) {
            *self.classes.at([0, 1, 2].map(|axis| block.low[axis] + local[axis])) |= class(sides[i]);
            self.doubtful += u64::from(!sides[i].is_certain());
        }
    }

    fn store_touched(&mut self, at: &Visit<'_>, points: &Points, touch: Touch) {
        let scale = self.surface.scale();
        for (i, local) in slots(&at.block) {
            let index = [0, 1, 2].map(|axis| at.block.low[axis] + local[axis]);
            let center = DVec3::new(points.x[i], points.y[i], points.z[i]);
            let (distance, triangle) = (self.answers.squared[i].sqrt(), self.answers.triangle[i]);
            if !self.touches(index, center, distance, triangle, at.list, touch) {
                continue;
            }
            *self.classes.at(index) |= TOUCHED;
            let [x, y, z] = [0, 1, 2].map(|axis| (index[axis] - self.grid.first[axis]) as u64);
            let [_, ny, nz] = self.grid.shape.map(u64::from);
            self.near.push(Near { voxel: (x * ny + y) * nz + z, triangle, distance: distance / scale });
        }
    }

    /// Whether the surface, `distance` from the centre, meets a voxel as asked.
    fn touches(&self, index: [i64; 3], center: DVec3, distance: f64, triangle: u32, list: &[Slot], touch: Touch) -> bool {
        let [i, j, k] = index;
        let cell = Aabb::new(self.grid.corner(i, j, k), self.grid.corner(i + 1, j + 1, k + 1));
        let reach = match touch {
            Touch::Box | Touch::Star => cell.radius(),
            Touch::Cross => 0.5 * self.grid.spacing,
        };
        // Rounding of the corners may move them by a few ulp.
        let slack = 16.0 * f64::EPSILON * (center.abs().max_element() + self.surface.tree().radius + self.grid.spacing);
        if distance > reach + slack {
            return false;
        }
        let tree = self.surface.tree();
        if touch == Touch::Box && cell.contains(tree.facet(triangle).nearest(center).point) {
            return true;
        }
        let corners = |slot: &Slot| self.surface.work().corners(tree.triangle(*slot));
        match touch {
            Touch::Box => list.iter().any(|slot| triangle_overlaps_box(corners(slot), &cell)),
            Touch::Cross => list.iter().any(|slot| meets_cross(corners(slot), center, &cell)),
            Touch::Star => list.iter().any(|slot| {
                let corners = corners(slot);
                triangle_overlaps_box(corners, &cell) && (meets_cross(corners, center, &cell) || meets_diagonals(corners, center, &cell))
            }),
        }
    }
}

/// Whether a triangle meets the segments between the centres of opposite faces of a voxel.
fn meets_cross(corners: [DVec3; 3], center: DVec3, cell: &Aabb) -> bool {
    (0..3).any(|axis| {
        let mut segment = Aabb::new(center, center);
        (segment.min[axis], segment.max[axis]) = (cell.min[axis], cell.max[axis]);
        triangle_overlaps_box(corners, &segment)
    })
}

/// Whether a triangle meets the segments between opposite centres of edges and opposite corners of a voxel.
fn meets_diagonals(corners: [DVec3; 3], center: DVec3, cell: &Aabb) -> bool {
    // One of each pair of opposite steps to neighbours over edges and corners.
    let steps = (0..13).map(|n: i32| [n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1]).filter(|step| step.iter().filter(|s| **s != 0).count() > 1);
    steps.into_iter().any(|step| {
        let end = |turn: i32| {
            let coordinate = |axis: usize| match step[axis] * turn {
                -1 => cell.min[axis],
                0 => center[axis],
                _ => cell.max[axis],
            };
            DVec3::new(coordinate(0), coordinate(1), coordinate(2))
        };
        triangle_meets_segment(corners, [end(1), end(-1)])
    })
}

/// The bits of a side.
fn class(side: Side) -> u8 {
    let inside = if side.sign() < 0.0 { INSIDE } else { 0 };
    if side.is_certain() { inside } else { inside | DOUBTFUL }
}
