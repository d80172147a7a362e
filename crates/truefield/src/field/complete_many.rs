//! Many points of a complete field at once: those of one list together by the list, those without by the tree.

use super::complete::{ABSENT, CellClass, CompleteField, EDGE, Found, block_range};
use crate::bvh::Candidate;
use crate::bvh::order::{Curve, Place, along_own_curve, by_key, sort};
use crate::bvh::pairs::{Group, Pair, offer, offer_lists};
use crate::error::Result;
use crate::geom::{DVec3, Interval, Nearest};
use crate::run::Run;
use crate::source::mesh::check_points;

/// Lists of a block have smaller numbers.
const LISTS: usize = ABSENT as usize;

/// Lanes of points pay from so many that share a list.
const FEW: usize = 3;

/// Bits of the places of points beyond the cells that only their own curve tells apart.
const COARSE: u32 = 12;

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
        by_key("query the field", points, run, self.keys(), |points| {
            let (found, classes) = self.search_many(points);
            points.iter().zip(found).zip(classes).map(|((&p, found), class)| answer(p, found, class)).collect()
        })
    }

    /// About the number of a point's block: near an edge of blocks it may be a neighbour's. Points beyond the cells come
    /// after the others, with their neighbours.
    fn keys(&self) -> impl Fn(&[DVec3]) -> Vec<u32> + Sync {
        let (extent, [_, ny, nz]) = (self.grid().extent(), self.block_shape().map(|n| n as u32));
        let beyond = Curve::over(&extent.grow(extent.size().max_element()));
        let (low, _) = block_range(self.grid());
        let edge = EDGE as f64 * self.grid().spacing;
        let (origin, scale) = (self.grid().origin + DVec3::from(low.map(|i| i as f64)) * edge, edge.recip());
        let blocks = self.blocks.len() as u32;
        move |points| {
            let others: Vec<DVec3> = points.iter().copied().filter(|&p| !extent.contains(p)).collect();
            let mut others = beyond.places(&others).into_iter();
            let key = |&p: &DVec3| {
                if !extent.contains(p) {
                    return blocks + (others.next().unwrap_or(0) >> COARSE);
                }
                let block = (p - origin) * scale;
                (block.x as u32 * ny + block.y as u32) * nz + block.z as u32
            };
            points.iter().map(key).collect()
        }
    }

    /// Nearest triangles, and the classes of cells, of some thousand points.
    fn search_many(&self, points: &[DVec3]) -> (Vec<Candidate>, Vec<CellClass>) {
        let (tree, scale) = (self.surface().tree(), self.surface().scale());
        let scaled: Vec<DVec3> = points.iter().map(|&p| p * scale).collect();
        let mut found = vec![Candidate::within(f64::INFINITY); points.len()];
        let (mut lists, mut listed, mut others) = (Vec::with_capacity(points.len()), Vec::with_capacity(points.len()), Vec::new());
        let class = |(point, &p): (usize, &DVec3)| {
            let (held, class) = self.find(p);
            match held {
                Found::List(block, list) => {
                    lists.push((block, list));
                    listed.push(((block * LISTS + list) as u32, point as u32));
                }
                Found::Start(_) => {
                    lists.push((0, 0));
                    others.push(point);
                }
            }
            class
        };
        let classes = points.iter().enumerate().map(class).collect();
        self.offer(&lists, listed, &scaled, &mut found);
        let there: Vec<DVec3> = others.iter().map(|&point| scaled[point]).collect();
        for (point, nearest) in others.into_iter().zip(along_own_curve(&there, |points, keys| tree.nearest_sorted(points, keys))) {
            found[point] = nearest.candidate();
        }
        (found, classes)
    }

    /// Offers every point the list of its cell. Points of equal lists have equal keys, though others may have them too.
    fn offer(&self, lists: &[(usize, usize)], mut listed: Vec<Place>, points: &[DVec3], found: &mut [Candidate]) {
        sort(&mut listed);
        let (mut pairs, mut groups, mut triangles, mut start) = (Vec::new(), Vec::new(), Vec::new(), 0);
        for same in listed.chunk_by(|a, b| lists[a.1 as usize] == lists[b.1 as usize]) {
            let (block, list) = lists[same[0].1 as usize];
            let list = self.blocks[block].list(list);
            if same.len() < FEW {
                pairs.extend(list.flat_map(|triangle| same.iter().map(move |&(_, point)| Pair { point, triangle })));
            } else {
                let first = triangles.len();
                triangles.extend(list);
                groups.push(Group { points: start..start + same.len(), triangles: first..triangles.len() });
            }
            start += same.len();
        }
        let tree = self.surface().tree();
        offer(tree, points, &pairs, found);
        offer_lists(tree, points, &listed, &triangles, &groups, found);
    }
}
