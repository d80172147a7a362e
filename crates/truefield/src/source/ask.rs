//! Asking a source at many points, on all threads.

use crate::distance::Source;
use crate::error::Result;
use crate::geom::{DVec3, Interval};
use crate::run::Run;

use super::mesh::check_points;

/// Points handed out at a time: enough that a call costs nothing, few enough that a job stops at once.
const CHUNK: usize = 1024;

/// [`Source::values`] on all threads.
pub fn values(source: &dyn Source, points: &[DVec3], run: &Run<'_>) -> Result<Vec<f64>> {
    each(points, run, 0.0, |points, out| source.values(points, out))
}

/// [`crate::distance::Distance::at`] on all threads. Fails where the shape cannot be asked.
pub fn bounds(source: &dyn Source, points: &[DVec3], run: &Run<'_>) -> Result<Vec<Interval>> {
    each(points, run, Interval::ALL, |points, out| {
        source.at_many(points, out);
        // Where nothing is known, it may be because the shape failed: its values say so.
        let open: Vec<DVec3> =
            points.iter().zip(&*out).filter(|(_, known)| !(known.lower.is_finite() && known.upper.is_finite())).map(|(&p, _)| p).collect();
        if open.is_empty() { Ok(()) } else { source.values(&open, &mut vec![0.0; open.len()]) }
    })
}

/// [`Source::gradients`] on all threads.
pub fn gradients(source: &dyn Source, points: &[DVec3], run: &Run<'_>) -> Result<Vec<DVec3>> {
    each(points, run, DVec3::ZERO, |points, out| source.gradients(points, out))
}

fn each<T: Copy + Send>(
    points: &[DVec3],
    run: &Run<'_>,
    empty: T,
    ask: impl Fn(&[DVec3], &mut [T]) -> Result<()> + Sync,
) -> Result<Vec<T>> {
    check_points(points)?;
    let mut out = vec![empty; points.len()];
    run.chunks("asking", &mut out, CHUNK, |index, out| ask(&points[index * CHUNK..][..out.len()], out))?;
    Ok(out)
}
