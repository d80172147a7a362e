//! Dense and narrow-band samples of a surface's signed distance, exact at every sample.
//!
//! Coherence does the work: blocks of the lattice are halved with ever shorter lists of candidates
//! ([`crate::bvh::cover`]), 64 samples at a time are answered from a list, and a side once known
//! is handed on to every sample that a path off the surface reaches.

use super::sides::{Sides, slots};
use super::tiles::{Dense, TILE, Tile};
use crate::bvh::Tree;
use crate::bvh::cover::Range;
use crate::bvh::descend::{Block, Descent, Span, Step, Visit};
use crate::bvh::evaluate::{Answers, BLOCK, Points, Rows, evaluate};
use crate::error::{Error, Result};
use crate::field::{Continuity, Known, SampledField};
use crate::grid::Grid;
use crate::run::Run;
use crate::simd::{Fuse, multiversion};
use crate::source::mesh::{Side, Surface};

/// Edge of the blocks that are answered at once.
const EDGE: i64 = 4;

/// Lists as short as this are not shortened further.
const SHORT: usize = 4;

/// Samples `surface` at the points `lattice.corner(i, j, k)`.
///
/// `band` limits the field to |distance| <= band; farther samples hold plus or minus the band.
/// Needs 4 bytes a sample; refuses more than `memory` bytes.
pub fn sample(surface: &Surface, lattice: &Grid, band: Option<f64>, memory: u64, run: &Run<'_>) -> Result<SampledField> {
    let band = band.unwrap_or(f64::INFINITY);
    if band.is_nan() || band <= 0.0 {
        return Err(Error::invalid(format!("the band must be a positive length, not {band}")));
    }
    let needed = lattice.shape.iter().fold(size_of::<f32>() as u64, |bytes, &n| bytes.saturating_mul(u64::from(n)));
    if needed > memory {
        let [x, y, z] = lattice.shape;
        return Err(Error::Memory { what: format!("a lattice of {x} x {y} x {z} samples"), needed, allowed: memory });
    }
    let scale = surface.scale();
    let scaled = Grid { origin: lattice.origin * scale, spacing: lattice.spacing * scale, ..*lattice };
    let mut values = vec![0.0f32; lattice.len()];
    let tiles = Block::tiles(&scaled, TILE);
    let dense = Dense::new(&scaled, &mut values);
    let doubtful = run.blocks("sample distances", tiles.len(), |index| {
        let tile = tiles[index];
        let mut sampler = Sampler::new(surface, &scaled, band * scale, tile);
        let mut descent = Descent::new(surface.tree(), &scaled, Span::Points);
        // Sides of far tiles of an open mesh may differ from sample to sample: they need their lists.
        let upper = if surface.side_changes_at_surface_only() { band * scale } else { f64::INFINITY };
        // Little of the lattice is in a band: single queries find it quicker than lists.
        let fine = if band.is_finite() { EDGE } else { TILE };
        descent.survey(tile, TILE, fine, Range { lower: 0.0, upper }, &mut |visit| {
            run.cancel.check()?;
            Ok(sampler.visit(visit))
        })?;
        dense.write(&sampler.values);
        Ok(sampler.doubtful)
    })?;
    drop(dense);
    let mut doubtful: Vec<u64> = doubtful.into_iter().flatten().collect();
    doubtful.sort_unstable();
    let continuity = if surface.side_changes_at_surface_only() { Continuity::Everywhere } else { Continuity::ExceptOpenings };
    SampledField::new((*lattice).into(), values, Known::Rounded { band, doubtful }, continuity)
}

/// One tile in the making.
struct Sampler<'a> {
    surface: &'a Surface,
    tree: &'a Tree,
    lattice: &'a Grid,
    band: f64,
    values: Tile<f32>,
    doubtful: Vec<u64>,
    sides: Sides<'a>,
    rows: Rows,
    answers: Answers,
}

impl<'a> Sampler<'a> {
    fn new(surface: &'a Surface, lattice: &'a Grid, band: f64, tile: Block) -> Self {
        Self {
            surface,
            tree: surface.tree(),
            lattice,
            band,
            values: Tile::new(tile, 0.0),
            doubtful: Vec::new(),
            sides: Sides::new(surface),
            rows: Rows::default(),
            answers: Answers::NONE,
        }
    }

    fn visit(&mut self, at: Visit<'_>) -> Step {
        let side = self.sides.of_block(&at);
        if at.range.lower > self.band
            && let Some(side) = side
        {
            let value = (side.sign() * self.band / self.surface.scale()) as f32;
            self.values.fill(&at.block, value);
            return Step::Done;
        }
        if at.block.edge() > EDGE {
            return if at.list.len() <= SHORT && self.band == f64::INFINITY { Step::Share } else { Step::Refine };
        }
        let points = Points::of_block(self.lattice, &at.block);
        evaluate(self.tree, &at.cell, &points, at.list, Range::ALL, &mut self.rows, &mut self.answers);
        let sides = match side {
            Some(side) => [side; BLOCK],
            None => self.sides.of_points(&at.block, self.lattice.spacing, &points, &self.answers),
        };
        self.store(&at.block, &sides);
        Step::Done
    }

    fn store(&mut self, block: &Block, sides: &[Side; BLOCK]) {
        // A power of two: as exact as dividing.
        let inverse = 1.0 / self.surface.scale();
        let mut values = [0.0; BLOCK];
        lengths(&self.answers, inverse, (self.band * inverse) as f32, &mut values);
        for (value, side) in values.iter_mut().zip(sides) {
            *value *= side.sign() as f32;
        }
        self.values.copy(block, &values, EDGE as usize);
        if sides.iter().all(|side| side.is_certain()) {
            return;
        }
        for (_, local) in slots(block).filter(|&(i, _)| !sides[i].is_certain()) {
            let global: [u64; 3] = std::array::from_fn(|axis| (block.low[axis] + local[axis] - self.lattice.first[axis]) as u64);
            let [_, ny, nz] = self.lattice.shape.map(u64::from);
            self.doubtful.push((global[0] * ny + global[1]) * nz + global[2]);
        }
    }
}

multiversion!(
    /// Distances times `scale`, at most `limit`.
    fn lengths(answers: &Answers, scale: f64, limit: f32, out: &mut [f32; BLOCK]) = lengths_body
);

#[inline(always)]
fn lengths_body<F: Fuse>(answers: &Answers, scale: f64, limit: f32, out: &mut [f32; BLOCK]) {
    for (out, squared) in out.iter_mut().zip(&answers.squared) {
        let value = (squared.sqrt() * scale) as f32;
        *out = if value < limit { value } else { limit };
    }
}
