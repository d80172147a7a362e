//! Area-weighted statistics of wall thickness.

use super::wall::{Across, Sample};
use crate::geom::DVec3;

/// The thinnest or the thickest wall found, with both of its sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extreme {
    /// In model units.
    pub thickness: f64,
    /// The sample's place on the wall.
    pub point: DVec3,
    /// Its triangle.
    pub triangle: u32,
    /// The place on the other wall.
    pub opposite: DVec3,
    /// Its triangle.
    pub opposite_triangle: u32,
}

/// Wall thickness by one method; every sample weighs as much as the area it stands for.
///
/// Percentile `q` is the least thickness such that the samples up to it hold at least `q` percent
/// of the area. Limits are strict: above counts `thickness > limit`, below `thickness < limit`.
#[derive(Clone, Debug, PartialEq)]
pub struct Statistics {
    /// Samples that count.
    pub samples: usize,
    /// Their area.
    pub area: f64,
    /// The thinnest.
    pub minimum: Extreme,
    /// The thickest.
    pub maximum: Extreme,
    /// Mean over the area.
    pub mean: f64,
    /// Percentile 50.
    pub median: f64,
    /// Percentiles 1, 5, 95 and 99.
    pub percentiles: [f64; 4],
    /// Share of the area that is thicker than `above`, if that limit was given.
    pub share_above: Option<f64>,
    /// Share of the area that is thinner than `below`, if that limit was given.
    pub share_below: Option<f64>,
}

impl Statistics {
    /// Over the samples for which `pick` gives a thickness; `None` if there is no such sample.
    pub(super) fn of(samples: &[Sample], above: Option<f64>, below: Option<f64>, pick: impl Fn(&Sample) -> Option<Across>) -> Option<Self> {
        let mut picked: Vec<(Across, &Sample)> = samples.iter().filter_map(|s| pick(s).map(|across| (across, s))).collect();
        // A stable sort: ties stay in the order of the samples.
        picked.sort_by(|a, b| a.0.thickness.total_cmp(&b.0.thickness));
        let extreme = |(across, sample): &(Across, &Sample)| Extreme {
            thickness: across.thickness,
            point: sample.point,
            triangle: sample.triangle,
            opposite: across.opposite,
            opposite_triangle: across.triangle,
        };
        let (minimum, maximum) = (extreme(picked.first()?), extreme(picked.last()?));
        let area: f64 = picked.iter().map(|(_, s)| s.area).sum();
        let mut sums = Vec::with_capacity(picked.len());
        let mut sum = 0.0;
        for (_, sample) in &picked {
            sum += sample.area;
            sums.push(sum);
        }
        let percentile = |q: f64| {
            let index = sums.partition_point(|&s| s < 0.01 * q * area * (1.0 - 1e-12));
            picked[index.min(picked.len() - 1)].0.thickness
        };
        let share = |counts: &dyn Fn(f64) -> bool| {
            let part: f64 = picked.iter().filter(|(across, _)| counts(across.thickness)).map(|(_, s)| s.area).sum();
            // An empty sum is -0.
            (part / area).clamp(0.0, 1.0) + 0.0
        };
        Some(Self {
            samples: picked.len(),
            area,
            minimum,
            maximum,
            mean: picked.iter().map(|(across, s)| across.thickness * s.area).sum::<f64>() / area,
            median: percentile(50.0),
            percentiles: [1.0, 5.0, 95.0, 99.0].map(percentile),
            share_above: above.map(|limit| share(&|t| t > limit)),
            share_below: below.map(|limit| share(&|t| t < limit)),
        })
    }
}
