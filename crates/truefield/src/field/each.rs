//! Many points at once.

use crate::error::Result;
use crate::geom::DVec3;
use crate::run::Run;
use crate::source::mesh::check_points;

/// Points a worker answers in one go.
const CHUNK: usize = 4096;

/// The answers to all points, in their order; refuses points that are not finite.
pub(super) fn each<T: Send>(points: &[DVec3], run: &Run<'_>, answer: impl Fn(DVec3) -> T + Sync) -> Result<Vec<T>> {
    check_points(points)?;
    let blocks = run.blocks("query the field", points.len().div_ceil(CHUNK), |block| {
        Ok(points[block * CHUNK..((block + 1) * CHUNK).min(points.len())].iter().map(|&p| answer(p)).collect::<Vec<_>>())
    })?;
    Ok(blocks.into_iter().flatten().collect())
}
