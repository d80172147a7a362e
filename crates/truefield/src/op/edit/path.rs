//! A tool along a path: one edit after the other.

use super::{Operation, edit};
use crate::distance::{Distance, Source};
use crate::error::{Error, Result};
use crate::field::adaptive::AdaptiveField;
use crate::geom::{Aabb, DVec3, Interval};
use crate::run::Run;

/// Between corners of the path the tool stands no farther apart than this part of its shortest side.
const STEP: f64 = 0.1;

/// No more places.
const MOST: usize = 100_000;

/// [`edit`] with the tool moved to every corner of the path, and to places between them a tenth of the tool's shortest
/// side apart at most: a ball leaves ridges no higher than a 400th of its radius.
pub fn edit_along(
    field: &AdaptiveField,
    tool: &dyn Source,
    operation: Operation,
    path: &[DVec3],
    memory: u64,
    run: &Run<'_>,
) -> Result<AdaptiveField> {
    let places = places(tool, operation, path)?;
    let mut edited = field.clone();
    for (done, &by) in places.iter().enumerate() {
        run.cancel.check()?;
        edited = edit(&edited, &Moved { tool, by }, operation, memory, run)?;
        run.progress.report("follow the path", done + 1, places.len());
    }
    Ok(edited)
}

fn places(tool: &dyn Source, operation: Operation, path: &[DVec3]) -> Result<Vec<DVec3>> {
    let Some(&first) = path.first() else {
        return Err(Error::invalid("the path has no points; give one or more"));
    };
    if let Some(bad) = path.iter().find(|p| !p.is_finite()) {
        return Err(Error::invalid(format!("the path has a point at {bad}; give finite numbers")));
    }
    if operation == Operation::Intersect {
        return Err(Error::invalid("what is in a tool at two places at once is seldom meant; intersect without a path"));
    }
    let sides = tool.extent().map_or(DVec3::INFINITY, |extent| extent.size());
    let step = STEP * sides.min_element();
    if !(step > 0.0 && step.is_finite()) {
        return Err(Error::invalid("the tool has no end, so it cannot follow a path; give a bounded one"));
    }
    let mut places = vec![first];
    for ends in path.windows(2) {
        let way = ends[1] - ends[0];
        let count = (way.length() / step).ceil();
        if places.len() as f64 + count > MOST as f64 {
            return Err(Error::invalid(format!(
                "the path is more than {MOST} steps of {step} long; give a larger tool, or parts of the path"
            )));
        }
        places.extend((1..=count as usize).map(|n| ends[0] + way * (n as f64 / count)));
    }
    Ok(places)
}

/// A tool at another place.
struct Moved<'a> {
    tool: &'a dyn Source,
    by: DVec3,
}

impl Moved<'_> {
    fn back(&self, cell: &Aabb) -> Aabb {
        // Rounding may carry a corner by an ulp.
        let margin = 4.0 * f64::EPSILON * (cell.min.abs().max(cell.max.abs()) + self.by.abs()).max_element();
        Aabb::new(cell.min - self.by, cell.max - self.by).grow(margin)
    }
}

impl Distance for Moved<'_> {
    fn extent(&self) -> Option<Aabb> {
        self.tool.extent().map(|extent| Aabb::new(extent.min + self.by, extent.max + self.by))
    }

    fn at(&self, p: DVec3) -> Interval {
        self.tool.at(p - self.by)
    }

    fn over(&self, cell: &Aabb) -> Interval {
        self.tool.over(&self.back(cell))
    }
}

impl Source for Moved<'_> {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        let points: Vec<DVec3> = points.iter().map(|p| *p - self.by).collect();
        self.tool.values(&points, out)
    }

    fn slack(&self, cell: &Aabb) -> Interval {
        self.tool.slack(&self.back(cell))
    }

    fn bend(&self, cell: &Aabb) -> Interval {
        self.tool.bend(&self.back(cell))
    }

    fn is_flat(&self) -> bool {
        self.tool.is_flat()
    }

    fn noise(&self) -> f64 {
        self.tool.noise() + 4.0 * f64::EPSILON * self.by.abs().max_element()
    }
}
