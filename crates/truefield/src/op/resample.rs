//! Samples on another lattice.

use crate::distance::Distance;
use crate::error::{Error, Result};
use crate::field::sampled::{rounded_down, rounded_up};
use crate::field::{Known, SampledField};
use crate::lattice::Lattice;
use crate::run::Run;

/// The field at the points of another lattice: interpolated values, between the bounds that hold there.
///
/// Beyond the field's lattice the value at its nearest point is taken, plus the way to that point: the most it can be.
/// Needs 12 bytes a sample; refuses more than `memory` bytes.
pub fn resample(field: &SampledField, lattice: Lattice, memory: u64, run: &Run<'_>) -> Result<SampledField> {
    let lattice = lattice.checked()?;
    let needed = lattice.shape.iter().fold(3 * size_of::<f32>() as u64, |bytes, &n| bytes.saturating_mul(u64::from(n)));
    if needed > memory {
        let [x, y, z] = lattice.shape;
        return Err(Error::Memory { what: format!("a lattice of {x} x {y} x {z} samples with bounds"), needed, allowed: memory });
    }
    let extent = field.lattice().extent();
    let [_, ny, nz] = lattice.shape.map(|n| n as usize);
    let layers = run.blocks("resample the field", lattice.shape[0] as usize, |layer| {
        let mut found = Vec::with_capacity(ny * nz);
        for number in layer * ny * nz..(layer + 1) * ny * nz {
            let p = lattice.node(number);
            let inside = p.clamp(extent.min, extent.max);
            let bounds = field.at(p);
            let (lower, upper) = (rounded_down(bounds.lower), rounded_up(bounds.upper));
            let value = field.interpolate(inside).map_or(f64::INFINITY, |value| value + (p - inside).length());
            found.push([lower, (value as f32).max(lower).min(upper), upper]);
        }
        Ok(found)
    })?;
    let column = |which: usize| layers.iter().flatten().map(|row| row[which]).collect::<Vec<f32>>();
    let known = Known::Between { lower: column(0), upper: column(2) };
    SampledField::new(lattice, column(1), known, field.continuity())
}
