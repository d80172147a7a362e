//! Many points at once.

use super::{AdaptiveField, Cell};
use crate::bvh::Candidate;
use crate::bvh::order::along_curve;
use crate::error::Result;
use crate::geom::DVec3;
use crate::run::Run;
use crate::source::mesh::check_points;

impl AdaptiveField {
    /// The answers to all points, in their order; refuses points that are not finite.
    ///
    /// Points of exact leaves that keep no list are answered by `exact`, with their nearest triangle: neighbours among them
    /// share what is known of the surface around them. All others are answered by `one`.
    pub(super) fn answer<T: Copy + Send + Sync>(
        &self,
        points: &[DVec3],
        run: &Run<'_>,
        one: impl Fn(DVec3) -> T + Sync,
        exact: impl Fn(&Cell<'_>, DVec3, Candidate) -> T + Sync,
    ) -> Result<Vec<T>> {
        check_points(points)?;
        along_curve("query the field", points, run, |points, keys| {
            let Some(surface) = &self.surface else { return points.iter().map(|&p| one(p)).collect() };
            let open: Vec<Option<Cell<'_>>> = points.iter().map(|&p| self.find(p).filter(Cell::asks_all)).collect();
            let asked = points.iter().zip(keys).zip(&open).filter(|(_, cell)| cell.is_some());
            let (places, keys): (Vec<DVec3>, Vec<u32>) = asked.map(|((&p, &key), _)| (p * surface.scale(), key)).unzip();
            let mut found = surface.tree().nearest_sorted(&places, &keys).into_iter();
            let answer = |(&p, cell): (&DVec3, Option<Cell<'_>>)| match cell.and_then(|cell| Some((cell, found.next()?))) {
                Some((cell, nearest)) => exact(&cell, p, nearest.candidate()),
                None => one(p),
            };
            points.iter().zip(open).map(answer).collect()
        })
    }
}
