//! A surface sampled by its voxels: touched voxels know their nearest triangles, a wavefront carries them on.
//!
//! *Bounded distance transforms of trimmed NURBS*, section 5.2 and appendix B, for any mesh. There, a voxel's distance
//! is that to the centre of the nearest boundary voxel plus that voxel's own, and the truth is within the latter of
//! it. Here the value is the distance to the triangle that the wavefront brought, which is a triangle of the
//! surface and so an upper bound, never above the paper's; and as the surface lies in touched voxels only, the distance to the nearest of
//! those, as boxes, is a lower bound, never below the paper's least.

use std::sync::{Mutex, PoisonError};

use super::raster::NO_SITE;
use super::transform::{Border, Image, Measure, Target, Transform};
use super::voxelize::{Asked, DOUBTFUL, INSIDE, TOUCHED, Touch, Wanted, classify};
use super::wavefront::wavefront;
use crate::error::{Error, Result};
use crate::field::sampled::rounded_down;
use crate::field::{Continuity, Known, SampledField};
use crate::grid::Grid;
use crate::run::Run;
use crate::source::mesh::Surface;

/// Samples a worker takes at once.
const CHUNK: usize = 1 << 14;

/// Bytes that a sample takes at the height of the job.
const BYTES: u64 = 36;

/// Samples `surface` at the points `lattice.corner(i, j, k)`, each the centre of a voxel.
///
/// The intervals are of zero width, but for rounding to single precision, at voxels that the surface touches, and at
/// most root 3 times the spacing elsewhere. `band` limits the field to |distance| <= band; farther samples hold plus or minus the
/// band. Takes 36 bytes a sample; refuses more than `memory` bytes.
pub fn sample_marched(surface: &Surface, lattice: &Grid, band: Option<f64>, memory: u64, run: &Run<'_>) -> Result<SampledField> {
    let band = band.unwrap_or(f64::INFINITY);
    if band.is_nan() || band <= 0.0 {
        return Err(Error::invalid(format!("the band must be a positive length, not {band}")));
    }
    let [x, y, z] = lattice.shape;
    let needed = lattice.shape.iter().fold(BYTES, |bytes, &n| bytes.saturating_mul(u64::from(n)));
    if needed > memory {
        return Err(Error::Memory { what: format!("a wavefront over {x} x {y} x {z} samples"), needed, allowed: memory });
    }
    let spacing = lattice.spacing;
    let cells = Grid { origin: lattice.origin - 0.5 * spacing, ..*lattice };
    let found = classify(surface, &cells, Wanted { touch: Some(Touch::Box), sides: Asked::Everywhere }, memory, run)?;
    if found.near.is_empty() {
        return Err(Error::invalid(
            "the surface touches no voxel of the lattice, so there is nothing to march from; move the lattice to the part",
        ));
    }
    let shape = lattice.shape.map(|n| n as usize);
    let mut lower = vec![0.0f32; lattice.len()];
    let mut upper = vec![0.0f32; lattice.len()];
    let touched: Vec<u8> = found.classes.iter().map(|class| class & TOUCHED).collect();
    let ask = Transform {
        image: Image::U8(&touched),
        shape: &shape,
        spacing: &[spacing; 3],
        periodic: &[false; 3],
        target: Target::Foreground,
        border: Border::Nothing,
        measure: Measure::Between,
        memory,
    };
    ask.bounds(&mut lower, &mut upper, run)?;
    drop(touched);
    let sites: Vec<bool> = found.classes.iter().map(|class| class & TOUCHED != 0).collect();
    // Whoever is within the band has a touched voxel whose centre is within half a diagonal more.
    let limit = band + spacing;
    let marched = wavefront(&shape, &[spacing; 3], &sites, limit, memory, run)?.sites;
    drop(sites);
    let mut triangles = vec![NO_SITE; lattice.len()];
    for near in &found.near {
        triangles[near.voxel as usize] = near.triangle;
    }
    let measure = Gauge::new(surface, lattice, &cells, band);
    let mut values = vec![0.0f32; lattice.len()];
    let parts: Vec<Mutex<[&mut [f32]; 3]>> = values
        .chunks_mut(CHUNK)
        .zip(lower.chunks_mut(CHUNK))
        .zip(upper.chunks_mut(CHUNK))
        .map(|((values, lower), upper)| Mutex::new([values, lower, upper]))
        .collect();
    run.blocks("distances", parts.len(), |part| {
        let mut arrays = parts[part].lock().unwrap_or_else(PoisonError::into_inner);
        let [values, lower, upper] = &mut *arrays;
        for (local, number) in (part * CHUNK..lattice.len()).take(values.len()).enumerate() {
            let triangle = marched.get(number).and_then(|site| triangles.get(*site as usize)).copied();
            (values[local], lower[local], upper[local]) = measure.sample(number, found.classes[number], triangle, lower[local]);
        }
        Ok(())
    })?;
    drop(parts);
    let continuity = if surface.side_changes_at_surface_only() { Continuity::Everywhere } else { Continuity::ExceptOpenings };
    SampledField::new((*lattice).into(), values, Known::Between { lower, upper }, continuity)
}

/// What turns sites into distances.
struct Gauge<'a> {
    surface: &'a Surface,
    lattice: &'a Grid,
    /// The lattice in the tree's units.
    scaled: Grid,
    band: f64,
    /// What rounding of positions may add to distances between boxes.
    rounding: f64,
    /// Whether there is surface beyond the voxels, which is as near as their border at least.
    beyond: Option<&'a Grid>,
}

impl<'a> Gauge<'a> {
    fn new(surface: &'a Surface, lattice: &'a Grid, cells: &'a Grid, band: f64) -> Self {
        let (scale, part, voxels) = (surface.scale(), surface.mesh().extent(), cells.extent());
        let scaled = Grid { origin: lattice.origin * scale, spacing: lattice.spacing * scale, ..*lattice };
        let size = part.union(voxels);
        let rounding = 64.0 * f64::EPSILON * size.min.abs().max(size.max.abs()).max_element();
        let whole = voxels.contains(part.min) && voxels.contains(part.max);
        Self { surface, lattice, scaled, band, rounding, beyond: (!whole).then_some(cells) }
    }

    /// Value, lower and upper bound of a sample of a class, whose nearest voxel as a box is `boxed` away and, if it is near,
    /// brought `triangle`.
    fn sample(&self, number: usize, class: u8, triangle: Option<u32>, boxed: f32) -> (f32, f32, f32) {
        let [_, ny, nz] = self.lattice.shape.map(|n| n as usize);
        let local = [number / nz / ny, number / nz % ny, number % nz];
        let [i, j, k] = [0, 1, 2].map(|axis| self.lattice.first[axis] + local[axis] as i64);
        let distance = triangle.map_or(f64::INFINITY, |triangle| {
            let facet = self.surface.tree().facet(triangle);
            facet.distance_squared(self.scaled.corner(i, j, k)).sqrt() / self.surface.scale()
        });
        let single = distance as f32;
        let value = single.min(self.band as f32);
        let lower = if class & TOUCHED != 0 {
            // The triangle is its own, the nearest of all.
            single.next_down()
        } else {
            let border = self.beyond.map_or(f64::INFINITY, |cells| {
                let (extent, p) = (cells.extent(), self.lattice.corner(i, j, k));
                (p - extent.min).min(extent.max - p).min_element()
            });
            rounded_down(f64::from(boxed).min(border) - self.rounding)
        };
        let lower = lower.clamp(0.0, value);
        // Beyond the band nothing was marched, or not far enough to be sure.
        let upper = if single.is_finite() { single.next_up() } else { f32::INFINITY };
        match (class & DOUBTFUL != 0, class & INSIDE != 0) {
            (true, inside) => (if inside { -value } else { value }, -upper, upper),
            (false, true) => (-value, -upper, -lower),
            (false, false) => (value, lower, upper),
        }
    }
}
