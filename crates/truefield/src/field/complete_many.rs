//! Many points of a complete field at once: those with a list by the list, the others together by the tree.

use super::complete::{CellClass, CompleteField, Found};
use crate::bvh::Candidate;
use crate::bvh::order::along_curve;
use crate::bvh::pairs::{Pair, offer};
use crate::error::Result;
use crate::geom::{DVec3, Interval, Nearest};
use crate::run::Run;
use crate::source::mesh::check_points;

impl CompleteField {
    /// Signed distances, negative inside. A fraction of a microsecond a point where lists are short.
    pub fn distances(&self, points: &[DVec3], run: &Run<'_>) -> Result<Vec<f64>> {
        self.each(points, run, |p, found, class| {
            let (distance, side) = self.sided(p, found, class);
            side.sign() * distance
        })
    }

    /// The intervals that contain the true signed distances.
    pub fn bounds(&self, points: &[DVec3], run: &Run<'_>) -> Result<Vec<Interval>> {
        self.each(points, run, |p, found, class| self.interval(p, found, class))
    }

    /// The nearest points of the surface.
    pub fn nearest_many(&self, points: &[DVec3], run: &Run<'_>) -> Result<Vec<Nearest>> {
        self.each(points, run, |p, found, _| self.surface().describe(p * self.surface().scale(), found))
    }

    /// What `answer` makes of every point, its nearest triangle and the class of its cell.
    fn each<T: Copy + Send + Sync>(
        &self,
        points: &[DVec3],
        run: &Run<'_>,
        answer: impl Fn(DVec3, Candidate, CellClass) -> T + Sync,
    ) -> Result<Vec<T>> {
        check_points(points)?;
        along_curve("query the field", points, run, |points, keys| {
            let (found, classes) = self.search_many(points, keys);
            points.iter().zip(found).zip(classes).map(|((&p, found), class)| answer(p, found, class)).collect()
        })
    }

    /// Nearest triangles, and the classes of cells, of points that are sorted by their places on a Morton curve.
    fn search_many(&self, points: &[DVec3], keys: &[u32]) -> (Vec<Candidate>, Vec<CellClass>) {
        let (tree, scale) = (self.surface().tree(), self.surface().scale());
        let scaled: Vec<DVec3> = points.iter().map(|&p| p * scale).collect();
        let (mut pairs, mut others) = (Vec::with_capacity(8 * points.len()), Vec::new());
        let class = |(point, &p): (usize, &DVec3)| {
            let (held, class) = self.find(p);
            match held {
                Found::List(block, list) => pairs.extend(block.list(list).map(|triangle| Pair { point: point as u32, triangle })),
                Found::Start(_) => others.push(point),
            }
            class
        };
        let classes = points.iter().enumerate().map(class).collect();
        let mut found = vec![Candidate::within(f64::INFINITY); points.len()];
        offer(tree, &scaled, &pairs, &mut found);
        let (there, keys): (Vec<DVec3>, Vec<u32>) = others.iter().map(|&point| (scaled[point], keys[point])).unzip();
        for (point, nearest) in others.into_iter().zip(tree.nearest_sorted(&there, &keys)) {
            found[point] = nearest;
        }
        (found, classes)
    }
}
