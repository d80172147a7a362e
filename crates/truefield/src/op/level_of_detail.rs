//! Coarser fields from finer ones: a tree cut off is a field again, for which no source is asked.
//!
//! Frisken et al. 2000 cut by depth, or where the error that every cell keeps is small enough.

use crate::error::{Error, Result};
use crate::field::adaptive::{Accuracy, AdaptiveField, Level, LevelKind, Levels, Record, about_corners, differences};
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
    let mut levels = field.to_levels();
    match detail {
        Detail::Depth(depth) => {
            levels.cut(depth);
            levels.accuracy.max_depth = levels.accuracy.max_depth.min(depth);
        }
        Detail::Tolerance(tolerance) => {
            if !(tolerance > 0.0 && tolerance.is_finite()) {
                return Err(Error::invalid(format!("the tolerance is {tolerance}; give a positive length")));
            }
            let asked = Accuracy { tolerance, ..levels.accuracy };
            levels = prune(&levels, asked);
            levels.accuracy.tolerance = levels.accuracy.tolerance.max(tolerance);
        }
    }
    AdaptiveField::from_levels(&levels, field.surface().cloned(), run)
}

/// The tree without what is below cells that are good enough.
fn prune(levels: &Levels, asked: Accuracy) -> Levels {
    let leaves = judge(levels, asked);
    let group = levels.root.division.children();
    let mut out = Levels { levels: Vec::new(), ..levels.clone() };
    let mut cells: Vec<usize> = vec![0];
    for (level, ends) in levels.levels.iter().zip(&leaves) {
        if cells.is_empty() {
            break;
        }
        let ranks = level.ranks();
        let mut kept = Level::default();
        let mut below = Vec::new();
        for &cell in &cells {
            let (kind, rank) = (level.kinds[cell], ranks[cell] as usize);
            let kind = if ends[cell] { LevelKind::Linear } else { kind };
            match kind {
                LevelKind::Branch => below.extend(rank * group..(rank + 1) * group),
                LevelKind::Linear => {}
                LevelKind::Cubic => kept.cubics.push(level.cubics[rank]),
                LevelKind::Exact => {
                    let (side, list) = level.lists.get(rank);
                    kept.lists.push(side, list);
                }
            }
            kept.push(kind, level.records[cell]);
        }
        out.levels.push(kept);
        cells = below;
    }
    out
}

/// Of each cell, whether it is a branch that is good enough as a leaf.
fn judge(levels: &Levels, asked: Accuracy) -> Vec<Vec<bool>> {
    let (division, own) = (levels.root.division, levels.accuracy);
    let mut out: Vec<Vec<bool>> = Vec::new();
    // Contains what the finest cells say minus what a cell's corners say.
    let mut below: Vec<Interval> = Vec::new();
    for level in levels.levels.iter().rev() {
        let ranks = level.ranks();
        let mut apart = Vec::with_capacity(level.kinds.len());
        let mut ends = Vec::with_capacity(level.kinds.len());
        for (cell, (&kind, record)) in level.kinds.iter().zip(&level.records).enumerate() {
            let rank = ranks[cell] as usize;
            let differs = match kind {
                LevelKind::Linear => Interval::exact(0.0),
                LevelKind::Cubic => about_corners(&Record { lower: 0.0, upper: 0.0, ..*record }, Some(&level.cubics[rank])),
                LevelKind::Exact => record.error(),
                LevelKind::Branch => {
                    let group = division.children();
                    let first = rank * group;
                    let parts = (0..group).map(|octant| {
                        let child = &levels.levels[levels.levels.len() - out.len()].records[first + octant];
                        below[first + octant].plus(differences(record, &child.corners, division, octant))
                    });
                    parts.reduce(Interval::hull).unwrap_or(Interval::ALL)
                }
            };
            let range = record.range().plus(differs);
            let least = range.lower.max(-range.upper).max(0.0);
            let largest = |error: Interval| error.upper.max(-error.lower);
            let error = largest(record.error()).min(largest(differs) + own.allowed(least));
            ends.push(kind == LevelKind::Branch && error <= asked.allowed(least));
            apart.push(differs);
        }
        below = apart;
        out.push(ends);
    }
    out.reverse();
    out
}
