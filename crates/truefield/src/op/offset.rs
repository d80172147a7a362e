//! Solids grown and shrunk.

use super::solid::{Turned, build, check_solid};
use crate::error::{Error, Result};
use crate::field::SampledField;
use crate::geom::Interval;
use crate::run::Run;

/// All points no farther than `distance` from a solid; the points deeper than `-distance` when it is negative.
///
/// Outside of the grown solid, the way to it is shorter by just `distance`. Inside it is at least as deep as that says,
/// deeper where two fronts of the growing solid met: there the samples outside bound the distance from below. A solid
/// that shrinks is one whose outside grows.
///
/// Takes 29 bytes a sample while it runs. Refuses a `distance` that is not finite, and fields of meshes with openings.
pub fn offset(field: &SampledField, distance: f64, memory: u64, run: &Run<'_>) -> Result<SampledField> {
    check_solid(field)?;
    if !distance.is_finite() {
        return Err(Error::invalid(format!("the offset is {distance}; give a finite length")));
    }
    let turned = if distance < 0.0 { Turned::InsideOut } else { Turned::No };
    let grown = distance.abs();
    build(*field.lattice(), turned, memory, run, "offset the field", |number| {
        let (value, Interval { lower, upper }) = turned.sample(field, number);
        let lower = if lower - grown > 0.0 || grown == 0.0 { (lower - grown).next_down() } else { f64::NEG_INFINITY };
        ((f64::from(value) - grown) as f32, Interval { lower, upper: (upper - grown).next_up() })
    })
}
