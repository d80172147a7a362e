//! Coarser fields from finer ones: a tree cut off is a field again, for which no source is asked.
//!
//! Frisken et al. 2000 cut by depth, or where the error that every cell keeps is small enough.

use crate::error::{Error, Result};
use crate::field::adaptive::{Accuracy, AdaptiveField, Cell, Division, Frontier, Leaf, Record, about_corners, differences};
use crate::geom::Interval;
use crate::run::Run;

/// Where a tree is cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Detail {
    /// Below the first cells whose error is no larger than this at the surface, and grows with the distance from it as
    /// the field's own may.
    Tolerance(f64),
    /// Below cells of this depth.
    Depth(u32),
}

/// The field with less detail. Leaves keep the errors that inner cells have, so that bounds still hold the distance; they
/// never become smaller by cutting off more.
///
/// Where the shape itself leaves its distance open, the error is judged by how far the coarse values are from the fine.
pub fn level_of_detail(field: &AdaptiveField, detail: Detail, run: &Run<'_>) -> Result<AdaptiveField> {
    let own = field.accuracy();
    match detail {
        Detail::Depth(depth) => field.cut(|cell| cell.depth() >= depth, Accuracy { max_depth: own.max_depth.min(depth), ..own }, run),
        Detail::Tolerance(tolerance) => {
            if !(tolerance > 0.0 && tolerance.is_finite()) {
                return Err(Error::invalid(format!("the tolerance is {tolerance}; give a positive length")));
            }
            let good = good_enough(field, Accuracy { tolerance, ..own }, run)?;
            field.cut(|cell| good.holds(cell), Accuracy { tolerance: own.tolerance.max(tolerance), ..own }, run)
        }
    }
}

/// Cells of this depth are judged as blocks of their own.
const BLOCK_DEPTH: u32 = 3;

/// The uppermost branches that are good enough as leaves.
fn good_enough(field: &AdaptiveField, asked: Accuracy, run: &Run<'_>) -> Result<Frontier> {
    let mut blocks = Vec::new();
    field.walk(&mut |cell| {
        let block = cell.depth() == BLOCK_DEPTH;
        if block {
            blocks.push(cell);
        }
        !block
    });
    let judge = Judge { asked, own: field.accuracy(), division: field.division(), run };
    let judged = run.blocks("judge the cells", blocks.len(), |number| {
        let mut good = Frontier::default();
        let differs = judge.below(&blocks[number], &mut good, &mut |_, _| None)?;
        Ok((differs, good))
    })?;
    let mut judged = judged.into_iter();
    let mut good = Frontier::default();
    judge.below(&field.root(), &mut good, &mut |cell, good| {
        // Walks meet the blocks in the same order.
        let (differs, below) = if cell.depth() == BLOCK_DEPTH { judged.next()? } else { return None };
        good.append(below);
        Some(differs)
    })?;
    Ok(good)
}

/// What decides whether a branch is good enough as a leaf.
struct Judge<'a> {
    asked: Accuracy,
    own: Accuracy,
    division: Division,
    run: &'a Run<'a>,
}

impl Judge<'_> {
    /// Contains what the finest cells say minus what a cell's corners say; adds the uppermost branches from it down that
    /// are good enough. What `known` knows of a cell is not looked at again.
    fn below(
        &self,
        cell: &Cell<'_>,
        good: &mut Frontier,
        known: &mut impl FnMut(&Cell<'_>, &mut Frontier) -> Option<Interval>,
    ) -> Result<Interval> {
        if let Some(differs) = known(cell, good) {
            return Ok(differs);
        }
        let (record, before) = (cell.record(), good.len());
        if cell.is_leaf() {
            return Ok(match cell.leaf() {
                Leaf::Linear => Interval::exact(0.0),
                Leaf::Cubic(samples) => about_corners(&Record { lower: 0.0, upper: 0.0, ..*record }, Some(samples)),
                Leaf::Exact(_) => record.error(),
            });
        }
        self.run.cancel.check()?;
        let mut differs: Option<Interval> = None;
        for octant in 0..cell.children() {
            let child = cell.child(octant);
            let apart = self.below(&child, good, known)?.plus(differences(record, child.corners(), self.division, octant));
            differs = Some(differs.map_or(apart, |differs| differs.hull(apart)));
        }
        let differs = differs.unwrap_or(Interval::ALL);
        let range = record.range().plus(differs);
        let least = range.lower.max(-range.upper).max(0.0);
        let largest = |error: Interval| error.upper.max(-error.lower);
        let error = largest(record.error()).min(largest(differs) + self.own.allowed(least));
        if error <= self.asked.allowed(least) {
            good.truncate(before);
            good.push(cell);
        }
        Ok(differs)
    }
}
