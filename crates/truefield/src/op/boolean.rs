//! Union, intersection, difference and complement of solids on one lattice.

use super::solid::{Turned, build, check_solid};
use crate::error::{Error, Result};
use crate::field::{Known, SampledField};
use crate::geom::Interval;
use crate::run::Run;

/// What is in one of two solids or in the other.
///
/// The least of two distances is the distance of the union outside of both. Inside one of them it is the distance too if
/// the other is farther away than its boundary: the nearest point of that boundary is then no part of the other.
/// Elsewhere it is an upper bound, and the lower one follows from the samples around.
///
/// Takes 29 bytes a sample while it runs. Refuses fields on different lattices, and of meshes with openings.
pub fn union(a: &SampledField, b: &SampledField, memory: u64, run: &Run<'_>) -> Result<SampledField> {
    either([a, b], [Turned::No, Turned::No], Turned::No, memory, run)
}

/// What is in both solids: outside of the union of what is outside. As [`union`].
pub fn intersection(a: &SampledField, b: &SampledField, memory: u64, run: &Run<'_>) -> Result<SampledField> {
    either([a, b], [Turned::InsideOut, Turned::InsideOut], Turned::InsideOut, memory, run)
}

/// What is in `a` and not in `b`. As [`union`].
pub fn difference(a: &SampledField, b: &SampledField, memory: u64, run: &Run<'_>) -> Result<SampledField> {
    either([a, b], [Turned::InsideOut, Turned::No], Turned::InsideOut, memory, run)
}

/// What is not in a solid: all signs changed. Exact where the field is.
pub fn complement(a: &SampledField) -> Result<SampledField> {
    let negative = |values: &[f32]| values.iter().map(|v| -v).collect::<Vec<f32>>();
    let known = match a.known() {
        Known::Between { lower, upper } => Known::Between { lower: negative(upper), upper: negative(lower) },
        other => other.clone(),
    };
    SampledField::new(*a.lattice(), negative(a.values()), known, a.continuity())
}

fn either([a, b]: [&SampledField; 2], turned: [Turned; 2], result: Turned, memory: u64, run: &Run<'_>) -> Result<SampledField> {
    check_solid(a)?;
    check_solid(b)?;
    if a.lattice() != b.lattice() {
        return Err(Error::invalid("the fields have their samples at different places; resample one onto the lattice of the other"));
    }
    build(*a.lattice(), result, memory, run, "combine fields", |number| {
        let ((value_a, a), (value_b, b)) = (turned[0].sample(a, number), turned[1].sample(b, number));
        // Outside of both, or inside one and farther from the other than from its own boundary.
        let lower = if a.lower + b.lower > 0.0 { a.lower.min(b.lower) } else { f64::NEG_INFINITY };
        (value_a.min(value_b), Interval { lower, upper: a.upper.min(b.upper) })
    })
}
