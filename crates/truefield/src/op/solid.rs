//! What the operations share: solids made of samples.

use super::tighten::tighten;
use crate::error::{Error, Result};
use crate::field::sampled::{rounded_down, rounded_up};
use crate::field::{Continuity, Known, SampledField};
use crate::geom::Interval;
use crate::lattice::Lattice;
use crate::run::Run;

/// Samples a worker takes in one go.
const CHUNK: usize = 1 << 15;

/// Bytes that a sample takes in the making: bounds and value twice, where a bound comes from, and whether it is open.
const BYTES: u64 = 29;

/// A solid, or everything outside of it, which is a solid too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turned {
    /// As it is.
    No,
    /// Inside out: all signs changed.
    InsideOut,
}

impl Turned {
    /// The value and its interval, turned.
    pub(super) fn sample(self, field: &SampledField, number: usize) -> (f32, Interval) {
        let (value, interval) = (field.values()[number], field.interval(number));
        match self {
            Self::No => (value, interval),
            Self::InsideOut => (-value, Interval { lower: -interval.upper, upper: -interval.lower }),
        }
    }
}

/// Refuses a field of which nobody knows where it is inside.
pub(super) fn check_solid(field: &SampledField) -> Result<()> {
    match field.continuity() {
        Continuity::Everywhere => Ok(()),
        Continuity::ExceptOpenings => Err(Error::invalid(
            "the field is of a mesh with openings, which has no definite inside; close the mesh, or take distances without sign",
        )),
    }
}

/// The solid whose samples `sample` gives, `turned` back in the end.
///
/// The lower bound of a sample may be minus infinity; then the other samples bound it as far as they can. Takes 29 bytes a
/// sample while it runs, 12 then; refuses more than `memory` bytes.
pub(super) fn build(
    lattice: Lattice,
    turned: Turned,
    memory: u64,
    run: &Run<'_>,
    phase: &'static str,
    sample: impl Fn(usize) -> (f32, Interval) + Sync,
) -> Result<SampledField> {
    let count = lattice.len();
    let needed = (count as u64).saturating_mul(BYTES);
    if needed > memory {
        return Err(Error::Memory { what: format!("a field of {count} samples with bounds"), needed, allowed: memory });
    }
    let mut rows = vec![[0.0f32; 3]; count];
    run.chunks(phase, &mut rows, CHUNK, |chunk, rows| {
        for (row, number) in rows.iter_mut().zip(chunk * CHUNK..) {
            let (value, Interval { lower, upper }) = sample(number);
            *row = [rounded_down(lower), value, rounded_up(upper)];
        }
        Ok(())
    })?;
    let mut lower: Vec<f32> = rows.iter().map(|row| row[0]).collect();
    tighten(&lattice, &mut lower, run)?;
    if rows.iter().zip(&lower).any(|(row, lower)| *lower > row[2]) {
        return Err(Error::invalid(
            "samples of the field differ by more than the way between them, so they are no distances; state a larger error",
        ));
    }
    let value = |(row, lower): (&[f32; 3], &f32)| row[1].max(*lower).min(row[2]);
    let mut values: Vec<f32> = rows.iter().zip(&lower).map(value).collect();
    let mut upper: Vec<f32> = rows.into_iter().map(|row| row[2]).collect();
    if turned == Turned::InsideOut {
        for array in [&mut lower, &mut values, &mut upper] {
            array.iter_mut().for_each(|v| *v = -*v);
        }
        std::mem::swap(&mut lower, &mut upper);
    }
    SampledField::new(lattice, values, Known::Between { lower, upper }, Continuity::Everywhere)
}
